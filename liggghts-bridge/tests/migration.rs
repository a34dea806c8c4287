//! Bodies that move, collide, break, and are joined by new ones, across the borders and corners of the processor grid: the same bits on any
//! number of processors.

use std::fmt::Write as _;
use std::path::Path;

use crate::harness::{self, Atom, Dice, Host, data_file_for, dump_for, head_for, run_in, thermo};
use concordem_contact::math::Vec3;

const BOTH: [Host; 2] = [Host::Liggghts, Host::Lammps];
const BEAM: &str = "young 1e8 poisson 0.3 radius 0.004";
const SPHERES: &str = "young 1e8 poisson 0.3 friction_coefficient 0.4 restitution 0.7";

/// Bonds and contacts of all atoms as the host writes them. `strength` in Pa.
fn styles(host: Host, strength: &str) -> String {
    match host {
        Host::Liggghts => {
            let contact: String = SPHERES
                .split(' ')
                .enumerate()
                .fold(String::new(), |out, (k, word)| out + if k % 2 == 0 { " contact." } else { " " } + word);
            format!(
                "fix bonds all concordem/bond cohesive_beam {BEAM} tensile_strength {strength} bond distance 1.05 contact hertz_mindlin{contact}\n\
                 thermo_style custom step ke f_bonds f_bonds[2]\n"
            )
        }
        Host::Lammps => format!(
            "special_bonds lj 0 1 1 coul 1 1 1\npair_style concordem/hertz_mindlin reach 0.0105\npair_coeff * * {SPHERES}\n\
             bond_style concordem/cohesive_beam\nbond_coeff * {BEAM} tensile_strength {strength}\n\
             thermo_style custom step ke f_concordem_bonds f_concordem_bonds[2]\n"
        ),
    }
}

/// Pairs of atoms closer than 1.05 diameters.
fn near(atoms: &[Atom]) -> Vec<[usize; 2]> {
    let pairs = (0..atoms.len()).flat_map(|b| (0..b).map(move |a| [a, b]));
    let is_near = |[a, b]: &[usize; 2]| (atoms[*a].position - atoms[*b].position).norm() < 0.0105;
    pairs.filter(is_near).map(|[a, b]| [a + 1, b + 1]).collect()
}

/// A cube of `edge`³ touching spheres.
fn cube(edge: i32, corner: Vec3, velocity: Vec3, spin: Vec3) -> Vec<Atom> {
    let place =
        |k: i32| Vec3::new(f64::from(k % edge), f64::from(k / edge % edge), f64::from(k / edge / edge)) * 0.00999;
    let atom = |k| Atom { velocity, spin, ..Atom::resting(corner + place(k), 0.005) };
    (0..edge.pow(3)).map(atom).collect()
}

fn write(host: Host, folder: &Path, atoms: &[Atom]) {
    let bonds = if host == Host::Lammps { near(atoms) } else { Vec::new() };
    data_file_for(host, &folder.join("atoms.data"), atoms, &bonds, Vec3::repeat(-0.1), Vec3::repeat(0.1));
}

/// A cube crosses a corner of the processor grid within one rebuild: its atoms pass over processors that have fewer bonds than they have.
fn fly_over_the_corner(grid: [usize; 3]) {
    let processors = grid.iter().product();
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        // Along the axes that are divided; the corner is in the middle of the box.
        let divided = Vec3::from_fn(|k, _| if grid[k] > 1 { 1.0 } else { 0.0 });
        write(host, folder, &cube(3, divided * -0.03, divided * 50.0, Vec3::zeros()));
        let [x, y, z] = grid;
        let head = head_for(host, "atoms.data", "f f f", 2e-3, 1e-6)
            .replace("read_data", &format!("processors {x} {y} {z}\nread_data"));
        let script = head
            + &styles(host, "1e9")
            + "fix integrate all nve/sphere\nthermo 1200\nrun 1200\nwrite_restart half\n\
               write_restart again\n";
        let rows = thermo(&run_in(host, folder, &script, processors));
        let last = rows.last().unwrap();
        let square = 2500.0 * divided.norm_squared();
        let energy = 27.0 * 0.5 * 2500.0 * std::f64::consts::PI / 6.0 * 1e-6 * square;
        assert_eq!((rows.len(), last[0], last[2], last[3]), (2, 1200.0, 54.0, 0.0), "{host:?} {grid:?}: {rows:?}");
        // Digits of the output.
        assert!((last[1] / energy - 1.0).abs() < 1e-6, "{host:?} {grid:?}: {rows:?}");
    }
}

#[test]
fn a_cube_flies_over_the_corner_of_four_processors() {
    fly_over_the_corner([2, 2, 1]);
}

#[test]
#[ignore = "run by `make host-decks`"]
fn a_cube_flies_over_corners_of_more_processors() {
    let grids = [[2, 2, 2], [4, 2, 1], [4, 2, 2], [2, 4, 2]];
    grids.into_iter().for_each(fly_over_the_corner);
    harness::record::put(&["corners"], grids);
}

/// Cubes with random motions in a periodic box. `more`: bodies that are added between runs.
fn bodies(host: Host, folder: &Path, seed: u64, edge: i32, steps: usize) -> String {
    let mut dice = Dice(seed);
    let mut atoms = Vec::new();
    for k in 0..8 {
        let cell = Vec3::new(f64::from(k % 2), f64::from(k / 2 % 2), f64::from(k / 4)) * 0.1 - Vec3::repeat(0.07);
        // Towards the middle of them, and beside it.
        let velocity = (Vec3::repeat(-0.02) - cell) * 2000.0 + dice.vector() * 20.0;
        atoms.extend(cube(edge, cell + dice.vector() * 0.01, velocity, dice.vector() * 500.0));
    }
    write(host, folder, &atoms);
    let mut script = head_for(host, "atoms.data", "p p p", 4e-3, 1e-6);
    script += &styles(host, "5e5");
    script += "fix integrate all nve/sphere\n";
    script += &dump_for(host, "out.dump", steps);
    writeln!(script, "thermo {steps}\nrun {steps}").unwrap();
    // A pair from above, in LAMMPS bonded.
    let (units, number) = (if host == Host::Liggghts { " units box" } else { "" }, atoms.len());
    let first = Vec3::repeat(0.05) + dice.vector() * 0.04;
    for k in 0..2 {
        let x = first + Vec3::x() * 0.0101 * f64::from(k);
        writeln!(script, "create_atoms 1 single {:e} {:e} {:e}{units}", x.x, x.y, x.z).unwrap();
    }
    let (a, b) = (number + 1, number + 2);
    writeln!(script, "group new id {a}:{b}\nset group new diameter 0.01 density 2500\nvelocity new set 30 -40 50")
        .unwrap();
    if host == Host::Lammps {
        writeln!(script, "create_bonds single/bond 1 {a} {b}").unwrap();
    }
    writeln!(script, "run {steps}\nwrite_restart half").unwrap();
    script
}

/// Go on from the file of [`bodies`].
fn continued(host: Host, steps: usize) -> String {
    let head = match host {
        Host::Liggghts => "units si\natom_modify sort 0 0\nnewton off\ncommunicate single vel yes\nread_restart half\n",
        Host::Lammps => "comm_modify vel yes\nread_restart half\n",
    };
    let styles = styles(host, "5e5").replace("bond distance 1.05", "bond none");
    format!(
        "{head}neighbor 4e-3 bin\nneigh_modify delay 0\ntimestep 1e-6\n{styles}fix integrate all nve/sphere\n{}thermo {steps}\nrun {steps}\n",
        dump_for(host, "out.dump", steps)
    )
}

fn compare(edge: i32, steps: usize, seeds: u64, numbers: &[usize]) {
    for host in BOTH {
        for seed in 0..seeds {
            let folder = tempfile::tempdir().unwrap();
            let folder = folder.path();
            let (script, on) = (bodies(host, folder, seed, edge, steps), continued(host, steps));
            let mut wanted: Option<[String; 2]> = None;
            for (k, &processors) in numbers.iter().enumerate() {
                let rows = thermo(&run_in(host, folder, &script, processors));
                let first = std::fs::read_to_string(folder.join("out.dump")).unwrap();
                // The file of these processors, read by others.
                run_in(host, folder, &on, numbers[(k + 1) % numbers.len()]);
                let then = std::fs::read_to_string(folder.join("out.dump")).unwrap();
                let broken = rows.last().unwrap()[3];
                assert!(broken > 10.0, "{host:?}: bonds break: {rows:?}");
                match &wanted {
                    None => wanted = Some([first, then]),
                    Some(wanted) => {
                        assert!(wanted[0] == first, "{host:?}, seed {seed}, {processors} processors");
                        assert!(wanted[1] == then, "{host:?}, seed {seed}, from {processors} processors");
                    }
                }
            }
        }
    }
}

#[test]
fn bodies_on_any_number_of_processors() {
    compare(2, 400, 1, &[1, 8]);
}

/// Minutes.
#[test]
#[ignore = "run by `make host-decks`"]
fn many_bodies_on_any_number_of_processors() {
    compare(3, 2000, 6, &[1, 2, 4, 8, 16]);
    harness::record::put(&["bodies"], serde_json::json!({ "hosts": 2, "seeds": 6, "processes": [1, 2, 4, 8, 16] }));
}

/// Three layers fall into an empty box and meet at the borders of four processors: the first atoms decide how far ghosts must reach.
#[test]
fn poured_spheres_on_one_and_four_processors() {
    let script = format!(
        "units si\natom_style sphere\nboundary p p f\nnewton off\ncomm_modify vel yes\nprocessors * 2 2\n\
         region box block -0.05 0.05 -0.05 0.05 0 0.18\ncreate_box 1 box\nneighbor 0.002 bin\nneigh_modify every 1 delay 0\n\
         pair_style concordem/hertz_mindlin\npair_coeff * * {SPHERES}\ntimestep 1e-5\nfix integrate all nve/sphere\n\
         fix weight all gravity 1000 vector 0 0 -1\nregion above block -0.045 0.045 -0.045 0.045 0.15 0.17\n\
         fix pour all pour 300 1 4767548 vol 0.3 20 diam one 0.01 dens 2500 2500 region above\n\
         fix floor all wall/gran granular hertz/material 1e8 0.5 0.3 tangential mindlin NULL 1.0 0.4 damping coeff_restitution zplane 0 NULL\n\
         thermo_style custom step atoms f_concordem_contacts[3]\nthermo 2000\nrun 2000\n\
         write_dump all custom out.dump id x y z vx vy vz modify sort id format float %.17g\n"
    );
    let folder = tempfile::tempdir().unwrap();
    let [one, four] = [1, 4].map(|processors| {
        let script = if processors == 1 { script.replace("processors * 2 2\n", "") } else { script.clone() };
        let rows = thermo(&run_in(Host::Lammps, folder.path(), &script, processors));
        let last = rows.last().unwrap();
        assert!(last[..2] == [2000.0, 300.0] && last[2] > 40.0, "atoms touch: {rows:?}");
        std::fs::read_to_string(folder.path().join("out.dump")).unwrap()
    });
    assert!(one == four);
}
