//! Heat along the bonds of atoms in LIGGGHTS and LAMMPS: any number of processors, restart, balance, closed forms, ConcorDEM's solver,
//! LIGGGHTS' own heat conduction, and what is rejected.

mod contacts;
mod groups;
mod refused;
mod shares;
mod tables;

use std::fmt::Write as _;
use std::path::Path;

use crate::harness::{Atom, Dice, Host, data_file_for, head_for, run_in, tables, thermo};
use concordem_contact::kinematics::sphere_sphere::initial_geometry;
use concordem_contact::law::{LawName, Reference};
use concordem_contact::math::Vec3;
use concordem_liggghts::options::{Options, Units};
use concordem_liggghts::records::HISTORY;
use concordem_solver::heat::{Curves, HeatModel, Supply, ThermalMaterial, expansion, network};
use concordem_solver::state::contacts::{ContactFlags, Pair};
use concordem_solver::state::{Particles, Sphere, State};
use concordem_solver::{Model, Scheme, Solver, laws};

const BOTH: [Host; 2] = [Host::Liggghts, Host::Lammps];
const R: f64 = 1e-3;
const LINEAR: &str = "linear_bond normal_stiffness 1e6 shear_stiffness 2e5";
const GLASS: &str = "thermal.specific_heat 800 thermal.conductivity 1.1";
const ORDERED: &str = "[heat]\nmodel = \"ordered\"\npairs = \"bonds\"\n";
/// Heat capacity of a sphere, J/K, and conductance of a bond of touching spheres, W/K.
const CAPACITY: f64 = 2500.0 * (4.0 / 3.0 * std::f64::consts::PI) * 1e-9 * 800.0;
const CONDUCTANCE: f64 = 4.0 * R * R * 1.1 / (2.0 * R);

/// Spheres of a simple cubic lattice that touch, with random velocities below `speed` (m/s).
fn lattice(counts: [usize; 3], speed: f64) -> Vec<Atom> {
    let mut dice = Dice(5);
    let place = |k: usize| [k % counts[0], k / counts[0] % counts[1], k / counts[0] / counts[1]].map(|n| n as f64);
    let number = counts.iter().product();
    (0..number)
        .map(|k| {
            let mut atom = Atom::resting(Vec3::from(place(k)) * (2.0 * R), R);
            atom.velocity = dice.vector() * speed;
            atom
        })
        .collect()
}

/// Lines of a script: `atoms` in a box 20 mm larger than they are, written to `atoms.data`.
fn start(host: Host, folder: &Path, atoms: &[Atom], dt: f64) -> String {
    let low = atoms.iter().fold(Vec3::repeat(f64::INFINITY), |low, atom| low.inf(&atom.position)).add_scalar(-0.01);
    let high = atoms.iter().fold(Vec3::repeat(f64::NEG_INFINITY), |high, a| high.sup(&a.position)).add_scalar(0.01);
    data_file_for(host, &folder.join("atoms.data"), atoms, &[], low, high);
    head_for(host, "atoms.data", "f f f", 2e-4, dt)
}

/// Dump positions, velocities, and temperatures with all digits, and print the sums of heat.
fn output(host: Host, every: usize) -> String {
    let format = match host {
        Host::Liggghts => format!("format \"%d{}\"", " %.17g".repeat(7)),
        Host::Lammps => "format float %.17g".to_owned(),
    };
    format!(
        "dump d all custom {every} out.dump id x y z vx vy vz f_bonds\ndump_modify d sort id {format}\n\
         thermo_style custom step f_bonds f_bonds[2] f_bonds[13] f_bonds[14] f_bonds[15]\nthermo {every}\n\
         thermo_modify format float %25.17g\n"
    )
}

/// Temperatures of the last frame.
fn temperatures(folder: &Path) -> Vec<f64> {
    let (_, rows) = tables(&folder.join("out.dump")).pop().unwrap();
    rows.iter().map(|row| row[7]).collect()
}

/// Everything at once on a moving lattice that breaks: initial temperatures, sources, held atoms, convection, radiation, flux, expansion.
const EVERYTHING: &str = "temperature = 300\ntime_factor = 100\n
    [[heat.initial]]\nset = \"hot\"\ntemperature = \"450 K\"\n
    [[heat.source]]\nset = \"hot\"\npower = \"0.2 W\"\n
    [[heat.source]]\nset = \"cold\"\ndensity = \"1 W/cm^3\"\n
    [[heat.boundary]]\nset = \"cold\"\nconvection = { coefficient = 100, ambient = 290 }\n
    [[heat.boundary]]\nset = \"hot\"\nradiation = { emissivity = 0.8, ambient = 290 }\n
    [[heat.boundary]]\nset = \"cold\"\nflux = \"1 kW/m^2\"\n
    [[heat.boundary]]\nset = \"held\"\ntemperature = \"350 K\"\n";

const GROUPS: &str = "group hot id <= 20\ngroup cold id <> 50 110\ngroup held id >= 140\n";

/// The fix for [`EVERYTHING`].
fn breaking(bonds: &str) -> String {
    format!(
        "fix bonds all concordem/bond {LINEAR} normal_strength 4 shear_strength 4 {GLASS} thermal.expansion 1e-5 heat heat.toml bond {bonds} \
         contact frictional contact.normal_stiffness 1e6 contact.shear_stiffness 1e5 contact.friction_coefficient 0.3\n"
    )
}

#[test]
fn bits_do_not_depend_on_processors_and_restarts() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        std::fs::write(folder.join("heat.toml"), format!("{ORDERED}contact = {{ resistance = 1e-5 }}\n{EVERYTHING}"))
            .unwrap();
        let head = start(host, folder, &lattice([8, 5, 4], 2.0), 2e-7);
        let rest = format!("fix integrate all nve/sphere\n{}", output(host, 50));
        let dump = || std::fs::read(folder.join("out.dump")).unwrap();
        let whole = format!("{head}{GROUPS}{}{rest}run 300\nwrite_restart half\nrun 300\n", breaking("distance 1.01"));
        let mut dumps = Vec::new();
        for processors in [1, 2, 4] {
            let rows = thermo(&run_in(host, folder, &whole, processors));
            dumps.push(dump());
            // Balance of heat. The content is some 10 J; sums of the processors are rounded.
            let [first, last] = [&rows[0], rows.last().unwrap()];
            let residual = last[3] - first[3] - (last[4] + last[5]);
            assert!(residual.abs() <= 2e-14 * first[3], "{host:?}: {residual:e} J of {rows:?}");
            assert!(last[2] > 20.0 && last[1] > 100.0, "{host:?}: some bonds break, others do not: {last:?}");
            assert!(last[4] > 1e-4 && last[5].abs() > 1e-4, "{host:?}: heat enters: {last:?}");
        }
        assert!(dumps[1..].iter().all(|other| *other == dumps[0]), "{host:?}: runs differ");
        let last = |bytes: &[u8]| {
            let text = String::from_utf8(bytes.to_vec()).unwrap();
            text.rsplit("ITEM: TIMESTEP").next().unwrap().to_owned()
        };
        for processors in [1, 2] {
            // The restart file of four processors.
            let read = match host {
                Host::Liggghts => {
                    "units si\natom_modify sort 0 0\nnewton off\ncommunicate single vel yes\nread_restart half\n\
                     neighbor 2e-4 bin\nneigh_modify delay 0\ntimestep 2e-7\n"
                }
                Host::Lammps => {
                    "comm_modify vel yes\nread_restart half\nneighbor 2e-4 bin\nneigh_modify every 1 delay 0\ntimestep 2e-7\n"
                }
            };
            let rows = thermo(&run_in(host, folder, &format!("{read}{}{rest}run 300\n", breaking("none")), processors));
            assert_eq!(last(&dump()), last(&dumps[0]), "{host:?}: a restart on {processors} processors differs");
            assert_eq!(rows[0][0], 300.0);
        }
        // The same, from a data file.
        let script = format!("{head}{GROUPS}{}{rest}run 300\nwrite_data half.data\n", breaking("distance 1.01"));
        run_in(host, folder, &script, 2);
        let again = breaking("none").replace("bond none", "state half.data");
        let reset = if host == Host::Lammps { "reset_timestep 300\n" } else { "" };
        let again =
            format!("{}{reset}{GROUPS}{again}{rest}run 300\n", head_for(host, "half.data", "f f f", 2e-4, 2e-7));
        run_in(host, folder, &again, 1);
        let atoms = |text: &str| text.split("ITEM: ATOMS").nth(1).unwrap().to_owned();
        assert_eq!(atoms(&last(&dump())), atoms(&last(&dumps[0])), "{host:?}: a run from a data file differs");
    }
}

/// Insulated, 10⁴ steps on two processors.
#[test]
fn heat_is_conserved() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(
            folder.path().join("heat.toml"),
            format!(
                "{ORDERED}temperature = 300\ntime_factor = 1e3\n[[heat.initial]]\nset = \"hot\"\ntemperature = 400\n"
            ),
        )
        .unwrap();
        let head = start(host, folder.path(), &lattice([6, 2, 2], 0.1), 1e-6);
        let fix = format!("fix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml bond distance 1.01\n");
        let script =
            format!("{head}group hot id <= 9\n{fix}fix integrate all nve/sphere\n{}run 10000\n", output(host, 10000));
        let rows = thermo(&run_in(host, folder.path(), &script, 2));
        let [first, last] = [rows[0][3], rows.last().unwrap()[3]];
        assert!((first - 9.0 * 100.0 * CAPACITY).abs() < 1e-14 * first, "{host:?}: {first}");
        assert!((last - first).abs() <= 1e-14 * first, "{host:?}: {first} {last}");
        let spread = temperatures(folder.path());
        assert!((spread[0] - spread[23]).abs() < 50.0, "{host:?}: heat flows: {spread:?}");
    }
}

/// Explicit steps of a chain in closed form: a cosine of an insulated chain decays by the same factor in each step; between two held
/// ends, the field becomes linear.
#[test]
fn a_chain_follows_its_closed_forms() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let (n, steps) = (10, 200_i32);
        let head = start(host, folder.path(), &lattice([n, 1, 1], 0.0), 1e-6);
        let fix = format!("fix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml bond distance 1.01\n");
        // A quarter of C/G per step, half of the bound.
        let factor = 0.25 * CAPACITY / CONDUCTANCE / 1e-6;
        std::fs::write(
            folder.path().join("heat.toml"),
            format!("{ORDERED}temperature = 300\ntime_factor = {factor:e}\n"),
        )
        .unwrap();
        let at = |k: usize| (std::f64::consts::PI * (k as f64 + 0.5) / n as f64).cos();
        let mut script = format!("{head}{fix}");
        for k in 0..n {
            writeln!(script, "group a{k} id {}\nfix_modify bonds temperature a{k} {:e}", k + 1, 300.0 + 50.0 * at(k))
                .unwrap();
        }
        run_in(host, folder.path(), &format!("{script}{}run {steps}\n", output(host, steps as usize)), 2);
        let sine = (0.5 * std::f64::consts::PI / n as f64).sin();
        let decay = (1.0 - sine * sine).powi(steps);
        assert!(decay < 0.1);
        for (k, found) in temperatures(folder.path()).into_iter().enumerate() {
            let expected = 300.0 + 50.0 * decay * at(k);
            // Temperatures of 300 K are rounded at 6e-14 K in each step.
            assert!((found - expected).abs() < 1e-11, "{host:?}: {k}: {found} {expected}");
        }

        let ends = "[[heat.boundary]]\nset = \"first\"\ntemperature = 300\n[[heat.boundary]]\nset = \"last\"\ntemperature = 400\n";
        std::fs::write(
            folder.path().join("heat.toml"),
            format!("{ORDERED}temperature = 310\ntime_factor = {factor:e}\n{ends}"),
        )
        .unwrap();
        let groups = format!("group first id 1\ngroup last id {n}\n");
        run_in(host, folder.path(), &format!("{head}{groups}{fix}{}run 1500\n", output(host, 1500)), 2);
        for (k, found) in temperatures(folder.path()).into_iter().enumerate() {
            let expected = 300.0 + 100.0 * k as f64 / (n - 1) as f64;
            // The slowest mode has decayed by (1 − sin²(π/18))¹⁵⁰⁰ = 1e-20.
            assert!((found - expected).abs() < 1e-11, "{host:?}: {k}: {found} {expected}");
        }
    }
}

/// Planes of a periodic lattice exchange heat as a ring: a cosine decays by the same factor in each step. Bonds of LAMMPS' lists, by a bond
/// style, conduct as those of the fix.
#[test]
fn heat_crosses_periodic_borders() {
    let (n, steps) = (6_usize, 100_i32);
    let factor = 0.1 * CAPACITY / CONDUCTANCE / 1e-6;
    for (host, style) in [(Host::Liggghts, false), (Host::Lammps, false), (Host::Lammps, true)] {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        std::fs::write(folder.join("heat.toml"), format!("{ORDERED}temperature = 300\ntime_factor = {factor:e}\n"))
            .unwrap();
        let atoms = lattice([n, 4, 4], 0.0);
        let near = |a: usize, b: usize| {
            let apart = (atoms[b].position - atoms[a].position) / (2.0 * R);
            let around = [n as f64, 4.0, 4.0];
            (0..3).map(|k| (apart[k] - around[k] * (apart[k] / around[k]).round()).powi(2)).sum::<f64>() < 1.1
        };
        let pairs = (0..atoms.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
        let bonds: Vec<[usize; 2]> = pairs.filter(|&(a, b)| near(a, b)).map(|(a, b)| [a + 1, b + 1]).collect();
        let high = Vec3::new(2.0 * n as f64, 8.0, 8.0) * R - Vec3::repeat(R);
        let of_lists = if style { &bonds[..] } else { &[] };
        data_file_for(host, &folder.join("atoms.data"), &atoms, of_lists, Vec3::repeat(-R), high);
        let head = head_for(host, "atoms.data", "p p p", 2e-4, 1e-6);
        let (fix, id) = if style {
            let parameters = LINEAR.split_once(' ').unwrap().1;
            let pair = "pair_style zero 0.003\npair_coeff * *\n";
            (
                format!("{pair}bond_style concordem/linear_bond heat heat.toml\nbond_coeff * {parameters} {GLASS}\n"),
                "concordem_bonds",
            )
        } else {
            (format!("fix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml bond distance 1.01\n"), "bonds")
        };
        let mut script = format!("{head}{fix}");
        let at = |k: usize| (2.0 * std::f64::consts::PI * k as f64 / n as f64).cos();
        for k in 0..n {
            let ids: Vec<String> = (0..16).map(|row| (n * row + k + 1).to_string()).collect();
            let temperature = 300.0 + 50.0 * at(k);
            writeln!(script, "group a{k} id {}\nfix_modify {id} temperature a{k} {temperature:e}", ids.join(" "))
                .unwrap();
        }
        script += &output(host, steps as usize).replace("f_bonds", &format!("f_{id}"));
        let sine = (std::f64::consts::PI / n as f64).sin();
        let decay = (1.0 - 0.4 * sine * sine).powi(steps);
        for processors in [1, 2] {
            let rows = thermo(&run_in(host, folder, &format!("{script}run {steps}\n"), processors));
            assert_eq!(rows[0][1], bonds.len() as f64);
            for (p, found) in temperatures(folder).into_iter().enumerate() {
                let expected = 300.0 + 50.0 * decay * at(p % n);
                // Temperatures of 300 K are rounded at 6e-14 K in each step.
                assert!((found - expected).abs() < 1e-11, "{host:?}, {style}: {p}: {found} {expected}");
            }
        }
        assert!(decay < 0.01, "{decay}");
    }
}

/// A clamped bar that is heated pushes with `E A α ΔT`, here `k l α ΔT`; a bond that breaks insulates.
#[test]
fn a_clamped_bar_pushes_and_broken_bonds_insulate() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("heat.toml"), format!("{ORDERED}temperature = 300\n")).unwrap();
        let head = start(host, folder.path(), &lattice([6, 1, 1], 0.0), 1e-6);
        let fix = format!(
            "fix bonds all concordem/bond {LINEAR} {GLASS} thermal.expansion 1e-5 heat heat.toml bond distance 1.01\n"
        );
        let script = format!(
            "{head}{fix}compute rows all concordem/bond/local bonds\ndump rows all local 1 rows.dump c_rows[1] c_rows[3] c_rows[4]\n\
             run 1\nfix_modify bonds temperature all 420\nrun 1\n"
        );
        run_in(host, folder.path(), &script, 2);
        let (_, rows) = tables(&folder.path().join("rows.dump")).pop().unwrap();
        assert_eq!(rows.len(), 5);
        for row in rows {
            // Tension positive: B pushes A backwards. Dumps have six digits.
            let expected = -1e6 * 2.0 * R * 1e-5 * 120.0;
            assert!((row[1] - expected).abs() < 1e-5 * expected.abs(), "{host:?}: {row:?} {expected}");
        }

        let mut atoms = lattice([4, 1, 1], 0.0);
        atoms[2].velocity.x = 0.05;
        atoms[3].velocity.x = 0.05;
        std::fs::write(
            folder.path().join("heat.toml"),
            format!(
                "{ORDERED}temperature = 300\ntime_factor = 1e4\n[[heat.initial]]\nset = \"hot\"\ntemperature = 400\n"
            ),
        )
        .unwrap();
        let head = start(host, folder.path(), &atoms, 1e-6);
        let fix = fix
            .replace("shear_stiffness 2e5", "shear_stiffness 2e5 normal_strength 10")
            .replace(" thermal.expansion 1e-5", "");
        let script = format!(
            "{head}group hot id 1\n{fix}group pulled id >= 3\nfix integrate pulled nve/noforce\n{}run 400\n",
            output(host, 5)
        );
        let printed = thermo(&run_in(host, folder.path(), &script, 2));
        let broke = printed.iter().find(|row| row[2] == 1.0).expect("a bond breaks")[0] as u64;
        assert_eq!(printed.last().unwrap()[2], 1.0);
        let pair = |step: u64| {
            let (_, rows) = tables(&folder.path().join("out.dump")).into_iter().find(|frame| frame.0 == step).unwrap();
            (rows[0][7] + rows[1][7], rows[0][7] - rows[1][7])
        };
        let ([before, _], [at_break, _], [after, apart]) =
            ([pair(0).0, 0.0], [pair(broke).0, 0.0], [pair(400).0, pair(400).1]);
        assert!(before - at_break > 1e-6, "{host:?}: heat flows before: {before} {at_break}");
        // The pair keeps its heat and goes on exchanging it.
        assert!((after - at_break).abs() < 1e-11 && apart < 80.0, "{host:?}: {at_break} {after} {apart}");
    }
}

/// The material of [`LINEAR`] and [`GLASS`] with expansion, in ConcorDEM's solver, at the start of the host's run.
fn own(atoms: &[Atom], hot: usize, dt: f64) -> (State, Solver) {
    let words: Vec<String> = format!("{LINEAR} bond none").split_whitespace().map(str::to_owned).collect();
    let options = Options::parse(&words, 1, Units::Si).unwrap();
    let (mut block, rows) = laws::block(LawName::LinearBond, &options.materials, &[]).unwrap();
    let mut particles = Particles::default();
    for atom in atoms {
        let r = atom.radius;
        let mass = 4.0 * std::f64::consts::PI / 3.0 * r * r * r * atom.density;
        particles.push(Sphere { position: atom.position, radius: r }, 0, mass, 0.4 * mass * (r * r));
        *particles.velocity.last_mut().unwrap() = atom.velocity;
    }
    let row = rows.get(0, 0).unwrap();
    let mut pairs = Vec::new();
    for a in 0..atoms.len() {
        for b in a + 1..atoms.len() {
            let previous = initial_geometry(&atoms[a].position, &atoms[b].position, &Vec3::zeros());
            if previous.length < 1.01 * 2.0 * R {
                let pair = Pair { a: a as u32, b: b as u32 };
                let area = block.contacts().bonded_area(row, R, R, R);
                let reference = Reference { length: previous.length, area };
                let flags =
                    ContactFlags { row, bits: ContactFlags::BONDED | ContactFlags::ACTIVE, ..ContactFlags::default() };
                block.contacts_mut().push_with_history(pair, flags, reference, previous, &[0.0; HISTORY]);
                pairs.push((pair.a, pair.b, previous.normal * previous.length));
            }
        }
    }
    let heat = HeatModel {
        materials: vec![ThermalMaterial { specific_heat: 800.0, conductivity: 1.1, expansion: 1e-5 }],
        curves: Curves::default(),
        capacity: particles.mass.iter().map(|mass| mass * 800.0).collect(),
        network: network::ordered(&particles, &pairs, &[], false),
        supply: Supply::default(),
        reference_temperature: 300.0,
        time_factor: 1e4,
        implicit: false,
        mechanics: true,
        dissipation: false,
        crack_resistance: f64::INFINITY,
        contact: None,
    };
    let temperature = (0..atoms.len()).map(|p| if p < hot { 400.0 } else { 300.0 }).collect();
    let mut state = State { particles, bonds: vec![block], ..State::default() };
    state.heat = Some(heat.start(temperature));
    expansion::start(&heat, &mut state);
    state.clock.dt = dt;
    let model = Model { scheme: Scheme::VelocityVerlet, heat: Some(heat), ..Model::default() };
    let solver = Solver::new(model, &mut state).unwrap();
    (state, solver)
}

#[test]
fn hosts_agree_with_our_solver() {
    let (dt, hot) = (5e-7, 13);
    let atoms = lattice([5, 4, 3], 0.3);
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(
            folder.path().join("heat.toml"),
            format!(
                "{ORDERED}temperature = 300\ntime_factor = 1e4\n[[heat.initial]]\nset = \"hot\"\ntemperature = 400\n"
            ),
        )
        .unwrap();
        let head = start(host, folder.path(), &atoms, dt);
        let fix = format!(
            "fix bonds all concordem/bond {LINEAR} {GLASS} thermal.expansion 1e-5 heat heat.toml bond distance 1.01\n"
        );
        let script =
            format!("{head}group hot id <= {hot}\n{fix}fix integrate all nve/sphere\n{}run 400\n", output(host, 100));
        run_in(host, folder.path(), &script, 2);
        let (mut state, mut solver) = own(&atoms, hot, dt);
        for (step, rows) in tables(&folder.path().join("out.dump")) {
            while state.clock.step < step {
                solver.step(&mut state).unwrap();
            }
            let temperature = &state.heat.as_ref().unwrap().temperature;
            for (p, row) in rows.iter().enumerate() {
                let apart = (Vec3::new(row[1], row[2], row[3]) - state.particles.position[p]).norm();
                // Rounding of coordinates of 10 mm; the data file rounds them in LIGGGHTS.
                assert!(apart < 1e-15, "{host:?}, step {step}: {apart:e}");
                // Masses of the host follow from the data file up to rounding, so changes of 100 K differ in the last digits.
                assert!(
                    (row[7] - temperature[p]).abs() < 1e-11,
                    "{host:?}, step {step}: {} {}",
                    row[7],
                    temperature[p]
                );
            }
        }
        let temperature = &state.heat.as_ref().unwrap().temperature;
        assert!(temperature[0] < 399.0, "heat flows: {temperature:?}");
    }
}

/// With equal contacts, LIGGGHTS' `heat/gran/conduction` has our conductances up to a factor on the conductivity (see
/// `validation/concordem_validate/engines/liggghts_heat.py`); LAMMPS' granular heat, `2 λ a`, another one.
#[test]
fn bonds_conduct_as_the_contacts_of_the_hosts() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        // Spheres that overlap by 1 %.
        let mut atoms = lattice([4, 3, 3], 0.0);
        for atom in &mut atoms {
            atom.position *= 0.99;
        }
        let length: f64 = 2.0 * R * 0.99;
        std::fs::write(
            folder.path().join("heat.toml"),
            format!("{ORDERED}temperature = 300\n[[heat.initial]]\nset = \"hot\"\ntemperature = 400\n"),
        )
        .unwrap();
        let head = start(host, folder.path(), &atoms, 1e-2);
        let ours = format!(
            "{head}group hot id <= 7\nfix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml bond distance 1.0\n{}run 200\n",
            output(host, 200)
        );
        run_in(host, folder.path(), &ours, 2);
        let found = temperatures(folder.path());
        let theirs = match host {
            Host::Liggghts => {
                let lens = (std::f64::consts::PI * (R * R - 0.25 * length * length)).sqrt();
                let conductivity = 1.1 * 2.0 * R * R / (length * lens);
                format!(
                    "{}fix p1 all property/global kn peratomtypepair 1 1000\nfix p2 all property/global kt peratomtypepair 1 1000\n\
                     fix p3 all property/global gamman peratomtypepair 1 0\nfix p4 all property/global gammat peratomtypepair 1 0\n\
                     fix p5 all property/global coefficientFriction peratomtypepair 1 0\n\
                     fix p6 all property/global thermalConductivity peratomtype {conductivity:e}\n\
                     fix p7 all property/global thermalCapacity peratomtype 800\n\
                     pair_style gran model hooke/stiffness tangential history tangential_damping off\npair_coeff * *\n\
                     fix conduct all heat/gran/conduction initial_temperature 300 contact_area overlap area_correction no\nrun 0\n\
                     group hot id <= 7\nset group hot property/atom Temp 400\n\
                     dump d all custom 200 out.dump id x y z vx vy vz f_Temp[0]\ndump_modify d sort id format \"%d{}\"\nrun 200\n",
                    head.replace("atom_style sphere", "atom_style granular"),
                    " %.17g".repeat(7)
                )
            }
            Host::Lammps => {
                // `2 λ a` with the contact radius a = √(δ R/2).
                let spot = ((2.0 * R - length) * 0.5 * R).sqrt();
                let conductivity = CONDUCTANCE * (2.0 * R / length) / (2.0 * spot);
                format!(
                    "{head}fix state all property/atom temperature heatflow\nset group all temperature 300\ngroup hot id <= 7\n\
                     set group hot temperature 400\npair_style granular\n\
                     pair_coeff * * hooke 1000 0 tangential linear_nohistory 0 0 damping velocity heat radius {conductivity:e}\n\
                     fix conduct all heat/flow constant 800\ncompute temperature all property/atom temperature\n\
                     dump d all custom 200 out.dump id x y z vx vy vz c_temperature\n\
                     dump_modify d sort id format float %.17g\nrun 200\n"
                )
            }
        };
        run_in(host, folder.path(), &theirs, 1);
        let peers = temperatures(folder.path());
        let apart = found.iter().zip(&peers).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("{host:?}: {apart:e} K apart");
        // 200 explicit steps of temperatures that are rounded at 6e-14 K, and overlaps of 1e-5 m whose coordinates are rounded at 1e-18 m, so
        // that changes of 100 K differ by 1e-11.
        assert!(apart < 2.5e-11, "{host:?}: {apart:e}: {found:?} {peers:?}");
        assert!(found[0] < 395.0 && found[35] > 300.01, "{host:?}: heat flows: {found:?}");
    }
}
