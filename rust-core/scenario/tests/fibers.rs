//! Fibers in scenarios: pull-out against closed forms, the bonds they have, and what they meet.

mod shared;

use concordem_contact::law::CohesiveBeam;
use concordem_scenario::assembly::restart;
use concordem_scenario::schedule::Simulation;
use concordem_solver::state::State;
use concordem_solver::state::columns::ColumnStore;
use concordem_solver::state::contacts::{ContactBlock, ContactView};
use shared::{assembled, read, simulation, try_assembled};
use std::f64::consts::PI;
use std::fmt::Write as _;

/// All bonds of a block.
fn bonds(state: &State, block: usize) -> Vec<ContactView> {
    let contacts = state.bonds[block].contacts();
    (0..contacts.len()).map(|k| contacts.view(k)).collect()
}

const RINGS: usize = 8;
/// Beams between the last ring and the loaded end.
const FREE: usize = 3;
/// Young's modulus of the fiber, Pa; its radius, m; the distance of its particles, m.
const YOUNG: f64 = 2e9;
const RADIUS: f64 = 0.5e-3;
const SPACING: f64 = 1e-3;
/// Shear stiffness of a bond with the matrix, N/m.
const SHEAR: f64 = 4e4;

/// A fiber along x between four columns of fixed spheres. Every second of its particles has four bonds of equal shear stiffness across its
/// direction, so rings of four bonds act on a chain of springs. `law`: tables of bonds; `rest`: the load.
fn pull_out(law: &str, matrix: &str, interface: &str, rest: &str) -> String {
    let mut spheres = Vec::new();
    for ring in 0..RINGS {
        for (y, z) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            spheres.push([2.0 * ring as f64 * SPACING, y * 1e-3, z * 1e-3, 1e-3]);
        }
    }
    let fixed: Vec<usize> = (0..spheres.len()).collect();
    let particles = 2 * RINGS - 1 + FREE;
    let end = (particles as f64 - 0.5) * SPACING;
    let mut text = format!(
        "version = 1
        [packing]
        kind = \"spheres\"
        spheres = {spheres:?}
        [[material]]
        name = \"matrix\"
        density = 2500
        {law} = {matrix}
        [[material]]
        name = \"steel\"
        density = 7850
        cohesive_beam = {{ young = {YOUNG}, radius_ratio = 1 }}
        [[interface]]
        between = [\"matrix\", \"steel\"]
        {interface}
        [bonds]
        law = \"{law}\"
        interaction_ratio = 1.01
        [contacts]
        law = \"none\"
        [fibers]
        [[fibers.group]]
        material = \"steel\"
        diameter = {}
        lines = [[[{}, 0, 0], [{end}, 0, 0]]]
        [[prescribe]]
        set = \"matrix\"
        velocity = [0, 0, 0]
        angular_velocity = [0, 0, 0]
        {rest}",
        2.0 * RADIUS,
        -0.5 * SPACING,
    );
    text += &shared::set("matrix", &fixed);
    text += &shared::set("end", &[spheres.len() + particles - 1]);
    text
}

/// Rings `j = 0 … n − 1` of stiffness `K` on a chain of springs `k` with one free end: `u_j ∝ cosh((j + ½)μ)`, `2 cosh μ = 2 + K/k`.
struct Lag {
    ring: f64,
    /// `μ`
    decay: f64,
}

impl Lag {
    fn new() -> Self {
        let ring = 4.0 * SHEAR;
        // Two beams E A/s between two rings.
        let spring = 0.5 * YOUNG * PI * RADIUS * RADIUS / SPACING;
        Self { ring, decay: (1.0 + 0.5 * ring / spring).acosh() }
    }

    fn shape(&self, ring: usize) -> f64 {
        ((ring as f64 + 0.5) * self.decay).cosh()
    }

    /// Force on the end divided by the displacement of the last ring, N/m.
    fn stiffness(&self) -> f64 {
        self.ring * (0..RINGS).map(|ring| self.shape(ring)).sum::<f64>() / self.shape(RINGS - 1)
    }
}

const SPRINGS: &str = "{ normal_stiffness = 1e5, shear_stiffness = 4e4 }";

/// Elastic pull-out: the displacement of the loaded end under a constant force is that of the shear lag, for the discrete chain and,
/// roughly, for a bar in a continuous bond.
#[test]
fn elastic_pull_out_is_shear_lag() {
    let (force, lag) = (0.05, Lag::new());
    let rest = format!(
        "[[force]]
        set = \"end\"
        force = [{force}, 0, 0]
        [integration]
        damping = {{ kind = \"local\", coefficient = 0.3 }}
        [stop]
        steps = 20000
        "
    );
    let text = pull_out("linear_bond", SPRINGS, &format!("linear_bond = {SPRINGS}"), &rest);
    let mut run = simulation(&text);
    let start: Vec<_> = run.state.particles.position.clone();
    while run.advance().unwrap().stopped.is_none() {}
    let particles = &run.state.particles;
    let index = |id: usize| particles.id.iter().position(|&other| other as usize == id).unwrap();
    let moved = |id: usize| {
        let p = index(id);
        particles.position[p] - start[p]
    };
    let first = 4 * RINGS;
    let beam = YOUNG * PI * RADIUS * RADIUS / SPACING;
    let scale = force / lag.stiffness() / lag.shape(RINGS - 1);
    for ring in 0..RINGS {
        let found = moved(first + 2 * ring);
        // Damping has brought the chain to rest; the slip of 1e-4 of the length of a bond turns it by as much, with errors of its square.
        assert!((found.x / (scale * lag.shape(ring)) - 1.0).abs() < 1e-6, "{ring} {found}");
        assert!(found.y.abs().max(found.z.abs()) < 1e-9 * found.x, "{found}");
    }
    let end = moved(first + 2 * RINGS - 2 + FREE).x;
    let expected = force / lag.stiffness() + force * FREE as f64 / beam;
    assert!((end / expected - 1.0).abs() < 1e-6, "{end} {expected}");
    // The continuous bar u'' = (q/EA) u with the bond q = K/2s per length, which ends s beyond the last ring. Its decay differs by the
    // part μ²/24 = 0.8 %, and the displacement of the last ring by half of μ times that: 0.2 %.
    let (axial, per_length) = (beam * SPACING, lag.ring / (2.0 * SPACING));
    let (length, decay) = (2.0 * SPACING * RINGS as f64, (per_length / axial).sqrt());
    let continuous =
        force / (axial * per_length).sqrt() * ((length - SPACING) * decay).cosh() / (length * decay).sinh();
    assert!((force / lag.stiffness() / continuous - 1.0).abs() < 0.003, "{} {continuous}", force / lag.stiffness());
}

/// The force that pulls the fiber, over time: that of the last beam.
fn pulled(text: &str, every: usize) -> Vec<[f64; 2]> {
    let mut run = simulation(text);
    let start = run.state.particles.position.clone();
    let last = run.state.particles.id.iter().enumerate().max_by_key(|(_, id)| **id).unwrap().0;
    let before = run.state.particles.id.iter().enumerate().find(|(_, id)| **id as usize == start.len() - 2).unwrap().0;
    let (mut found, mut steps) = (Vec::new(), 0);
    let beam = YOUNG * PI * RADIUS * RADIUS / SPACING;
    loop {
        let stopped = run.advance().unwrap().stopped.is_some();
        steps += 1;
        if steps % every == 0 || stopped {
            let moved = |p: usize| run.state.particles.position[p].x - start[p].x;
            found.push([moved(last), beam * (moved(last) - moved(before))]);
        }
        if stopped {
            return found;
        }
    }
}

const PULL: &str = "[[prescribe]]
    set = \"end\"
    velocity = [SPEED, 0, 0]
    angular_velocity = [0, 0, 0]
    [integration]
    damping = { kind = \"local\", coefficient = 0.3 }
    [stop]
    steps = STEPS
    ";

fn pull(speed: f64, steps: usize) -> String {
    PULL.replace("SPEED", &speed.to_string()).replace("STEPS", &steps.to_string())
}

/// Brittle bonds of a given shear strength: the peak is the force at which the ring at the loaded end breaks, and the rest unzips. With
/// infinite strength of the fiber it comes out; a weaker fiber breaks.
#[test]
fn brittle_bonds_part_at_the_shear_lag_of_their_strength() {
    let (strength, lag) = (0.4, Lag::new());
    let interface =
        format!("linear_bond = {{ normal_stiffness = 1e5, shear_stiffness = {SHEAR}, shear_strength = {strength} }}");
    let expected = lag.stiffness() * strength / SHEAR;
    // At 3 mm/s the wave of the start has 0.25 % of the peak, which comes after 6 ms; the last ring breaks at some 60 um.
    let text = pull_out("linear_bond", SPRINGS, &interface, &pull(3e-3, 30_000));
    let curve = pulled(&text, 10);
    let peak = curve.iter().map(|point| point[1]).fold(0.0, f64::max);
    // Inertia at this speed, and one record in ten steps.
    assert!((peak / expected - 1.0).abs() < 0.01, "{peak} {expected}");
    let last = curve.last().unwrap()[1];
    assert!(last.abs() < 0.02 * peak, "{last}");
    // The sum of all bonds is an upper bound that a stiff fiber would reach.
    assert!(expected < 0.8 * 4.0 * strength * RINGS as f64);
    // A fiber that breaks at half of that force does so, and its bonds hold.
    let weak = 0.5 * expected / (PI * RADIUS * RADIUS);
    let text = text.replace("radius_ratio = 1 }", &format!("radius_ratio = 1, tensile_strength = {weak} }}"));
    let mut run = simulation(&text);
    while run.advance().unwrap().stopped.is_none() {}
    let broken = &run.state.broken;
    // The free beams have equal forces, so more than one may break.
    assert!((1..=FREE).contains(&broken.len()) && broken.iter().all(|bond| bond.block == 1), "{broken:?}");
}

/// Bonds that slip at a given shear stress, as those of concrete: the plateau is the adhesive strength of all bonds together.
#[test]
fn ductile_bonds_hold_the_sum_of_their_strengths() {
    let cpm = |friction: f64| {
        format!(
            "{{ young = 5e8, shear_ratio = 0.2, crack_onset_strain = 1e-2, relative_ductility = 30, cohesion = 1e5, \
             friction_coefficient = {friction} }}"
        )
    };
    let interface = format!("cpm = {}", cpm(0.0));
    let text = pull_out("cpm", &cpm(0.8), &interface, &pull(2e-3, 12_000));
    let state = assembled(&text).state;
    let held: Vec<ContactView> = bonds(&state, 0)
        .into_iter()
        .filter(|view| [view.pair.a, view.pair.b].iter().any(|&p| state.particles.material[p as usize] == 1))
        .collect();
    assert_eq!(held.len(), 4 * RINGS);
    let expected: f64 = held.iter().map(|view| view.reference.area * 1e5).sum();
    let curve = pulled(&text, 10);
    let last = curve.last().unwrap();
    // All rings slip when the end has moved by 17 um. At slips of 20 um, bonds are 1e-4 longer and turned by 0.014: 5e8 · 1e-4 · 0.014 Pa are
    // 0.7 % of the cohesion; the wave of the start has 0.2 %.
    let plateau = curve.iter().find(|point| point[0] > 2e-5).unwrap();
    assert!((plateau[1] / expected - 1.0).abs() < 0.01, "{plateau:?} {expected}");
    assert!((last[1] / expected - 1.0).abs() < 0.03 && last[0] > 2.2e-5, "{last:?} {expected}");
    // Before, the elastic part.
    let half = curve.iter().find(|point| point[0] > 2e-6).unwrap();
    assert!(half[1] < 0.6 * expected, "{half:?}");
}

const CONCRETE: &str = "version = 1
    [[material]]
    name = \"mortar\"
    density = 4800
    cpm = { young = 25e9, shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = 30, cohesion = 3e6, friction_coefficient = 0.8 }
    [[material]]
    name = \"basalt\"
    density = 5600
    cpm = { young = 62.5e9, shear_ratio = 0.2, crack_onset_strain = 2e-4, relative_ductility = 30, cohesion = 15e6, friction_coefficient = 0.8 }
    [[material]]
    name = \"steel\"
    density = 7850
    cohesive_beam = { young = 200e9, radius_ratio = 1, tensile_strength = 1e9 }
    cpm = { young = 25e9, shear_ratio = 0.2, crack_onset_strain = 1e-3, relative_ductility = 30, cohesion = 3e6, friction_coefficient = 0.8 }
    [bonds]
    law = \"cpm\"
    interaction_ratio = 1.5
    [contacts]
    law = \"cpm\"
    [stop]
    steps = 60
    ";
const CUBE: &str = "[packing]
    kind = \"lattice\"
    lattice = \"fcc\"
    radius = \"0.8 mm\"
    shape = { kind = \"box\", size = [\"20 mm\", \"20 mm\", \"20 mm\"] }
    ";
const CELL: &str = "[packing]
    kind = \"lattice\"
    lattice = \"fcc\"
    radius = \"0.8 mm\"
    repeats = [8, 8, 8]
    shape = { kind = \"periodic\" }
    ";
const STONES: &str = "[aggregates]
    seed = 3
    [[aggregates.group]]
    material = \"basalt\"
    grading = { kind = \"single\", size = \"6 mm\" }
    volume_fraction = 0.1
    ";
const FIBERS: &str = "[fibers]
    seed = 2
    gap = \"0.1 mm\"
    [[fibers.group]]
    material = \"steel\"
    length = \"8 mm\"
    diameter = \"0.8 mm\"
    volume_fraction = 0.02
    ";

/// In a mould, between sawn faces, and in a cell: fibers have the volume that the scenario gives, every one is a chain with its own number,
/// no particle of the matrix is nearer than the clearing, aggregates keep their distance, and no bond joins two fibers.
#[test]
fn fibers_are_chains_in_their_places() {
    let sawn = STONES.replace("seed = 3", "seed = 3\nsurface = \"sawn\"");
    for (packing, stones) in [(CUBE, ""), (CUBE, STONES), (CUBE, &sawn), (CELL, STONES)] {
        let assembly = assembled(&format!("{CONCRETE}{packing}{stones}{FIBERS}"));
        let (state, particles) = (&assembly.state, &assembly.state.particles);
        let facts = assembly.summary.fibers.as_ref().unwrap();
        let phase = &facts.groups[0];
        // Half of a fiber of 4.02 mm³ in 5833 mm³ or more.
        assert!((phase.volume_fraction - 0.02).abs() < 0.5 * 4.03 / 5832.0, "{phase:?}");
        let is_fiber = |p: usize| particles.material[p] == 2;
        let of_fibers: Vec<usize> = (0..particles.len()).filter(|&p| is_fiber(p)).collect();
        assert_eq!(phase.particles, of_fibers.len());
        let chains = bonds(state, 1);
        assert_eq!(facts.bonds[0], chains.len());
        for view in &chains {
            let [a, b] = [view.pair.a, view.pair.b].map(|p| p as usize);
            assert_eq!(particles.aggregate[a], particles.aggregate[b]);
            assert!((view.reference.length / 0.8e-3 - 1.0).abs() < 1e-9 && is_fiber(a) && is_fiber(b));
            assert!((view.reference.area / (PI * 0.16e-6) - 1.0).abs() < 1e-9);
        }
        if packing == CELL || stones.is_empty() || !stones.contains("sawn") {
            // Ten spheres each.
            assert_eq!((of_fibers.len(), chains.len()), (10 * phase.count, 9 * phase.count));
        } else {
            // Cut fibers enter at the opposite face; only parts of one sphere and centers on a face are lost.
            assert!(of_fibers.len() > 9 * phase.count && of_fibers.len() < 11 * phase.count);
            let inside = |x: f64| x.abs() <= 10e-3;
            assert!(of_fibers.iter().all(|&p| particles.position[p].iter().all(|&x| inside(x))));
        }
        let mut held = 0;
        for view in bonds(state, 0) {
            let [a, b] = [view.pair.a, view.pair.b].map(|p| p as usize);
            assert!(!(is_fiber(a) && is_fiber(b)), "{view:?}");
            held += usize::from(is_fiber(a) || is_fiber(b));
            if is_fiber(a) != is_fiber(b) {
                let sum = particles.radius[a] + particles.radius[b];
                assert!(view.reference.length > 0.5 * sum && view.reference.length <= 1.5 * sum * (1.0 + 1e-8));
            }
        }
        assert_eq!(facts.bonds[1], held);
        assert!(held > 5 * of_fibers.len(), "{held}");
        assert!(facts.removed.0 > 0 && facts.removed.1 < 0.1, "{:?}", facts.removed);
        let stones: std::collections::BTreeSet<u32> =
            (0..particles.len()).filter(|&p| particles.material[p] == 1).map(|p| particles.aggregate[p]).collect();
        let numbers: std::collections::BTreeSet<u32> = of_fibers.iter().map(|&p| particles.aggregate[p]).collect();
        assert!(numbers.is_disjoint(&stones) && numbers.len() == phase.count);
    }
}

/// With bonds of the law of the fibers, all are in one block; fibers do not change the sections of the other beams, which refer to the
/// mean radius of the particles of the packing.
#[test]
fn fibers_between_beams() {
    let text = CONCRETE
        .replace("law = \"cpm\"\n    interaction_ratio = 1.5", "law = \"cohesive_beam\"\n    interaction_ratio = 1.01")
        .replace("name = \"mortar\"", "name = \"mortar\"\n    cohesive_beam = { young = 30e9, radius_ratio = 0.6 }");
    let interface = "[[interface]]
        between = [\"mortar\", \"steel\"]
        of = \"mortar\"
        ";
    let assembly = assembled(&format!("{text}{CUBE}{interface}{FIBERS}").replace("basalt", "unused"));
    let state = &assembly.state;
    assert_eq!(state.bonds.len(), 1);
    let block = state.bonds[0].contacts().as_any().downcast_ref::<ContactBlock<CohesiveBeam>>().unwrap();
    let (mut along, mut other) = (0, 0);
    for view in bonds(state, 0) {
        let fibers = [view.pair.a, view.pair.b].map(|p| state.particles.material[p as usize] == 2);
        let (section, young) = if fibers == [true; 2] { (0.4e-3, 200e9) } else { (0.6 * 0.8e-3, 30e9) };
        assert!((view.reference.area / (PI * section * section) - 1.0_f64).abs() < 1e-12, "{view:?}");
        assert_eq!(block.rows[view.flags.row as usize].young, young);
        if fibers == [true; 2] { along += 1 } else { other += 1 }
    }
    let facts = assembly.summary.fibers.unwrap();
    assert_eq!(facts.bonds[0], along);
    assert!(other > 5000 && assembly.summary.bonds == along + other);
}

/// A cut severs fibers, too, and takes their particles if it removes particles.
#[test]
fn cuts_go_through_fibers() {
    let line = "[fibers]
        clearing = 1
        [[fibers.group]]
        material = \"steel\"
        diameter = \"0.8 mm\"
        lines = [[[\"-8 mm\", 0, 0], [\"8 mm\", 0, 0]]]
        ";
    let crack = "[[cut]]
        shape = { kind = \"parallelogram\", corner = [0, -0.02, -0.02], edges = [[0, 0.04, 0], [0, 0, 0.04]] }
        ";
    let slit = "[[cut]]
        remove_particles = true
        shape = { kind = \"box\", minimum = [-0.001, -0.02, -0.02], maximum = [0.001, 0.02, 0.02] }
        ";
    for (cut, particles, links) in [("", 20, 19), (crack, 20, 18), (slit, 18, 16)] {
        let assembly = assembled(&format!("{CONCRETE}{CUBE}{cut}{line}"));
        let facts = assembly.summary.fibers.unwrap();
        assert_eq!((facts.groups[0].particles, facts.bonds[0]), (particles, links), "{cut}");
    }
    // Without bonds across the cut, particles that overlap a fiber would push it.
    let aside = line.replace(", 0, 0]", ", 0.0005, 0.0003]").replace("clearing = 1", "clearing = 0.5");
    let text = format!("{CONCRETE}{CUBE}{crack}{aside}");
    let message = try_assembled(&text).map(|_| ()).unwrap_err().to_string();
    assert!(message.contains("overlap") && message.contains("clearing = 1"), "{message}");
}

/// What cannot be placed says so; so do sets that would change the material of a fiber; fibers that take much room are a warning.
#[test]
fn full_moulds_and_wrong_sets() {
    let message = |text: &str| try_assembled(text).map(|_| ()).unwrap_err().to_string();
    let found = message(&format!("{CONCRETE}{CUBE}{}", FIBERS.replace("0.02", "0.6")));
    assert!(found.contains("no place for fiber") && found.contains("shorter"), "{found}");
    let found = message(&format!("{CONCRETE}{CUBE}{}", FIBERS.replace("8 mm", "38 mm")));
    assert!(found.contains("no place for fiber 1 of"), "{found}");
    let set = "[[set]]\nname = \"all\"\nmaterial = \"mortar\"\nselection = { kind = \"all\" }\n";
    let found = message(&format!("{CONCRETE}{CUBE}{FIBERS}{set}"));
    assert!(found.contains("set[0].material") && found.contains("of a fiber"), "{found}");
    let text = format!("{CONCRETE}{CUBE}{}", FIBERS.replace("seed = 2", "clearing = 1").replace("0.02", "0.06"));
    let warnings = assembled(&text).summary.warnings;
    assert!(warnings.iter().any(|one| one.key == "fibers.clearing"), "{warnings:?}");
}

/// A run in which concrete cracks around fibers continues from columns bit for bit; other fibers are another specimen.
#[test]
fn fibers_survive_a_restart() {
    let load = "[loading]\nkind = \"uniaxial\"\nstrain_rate = 20\ninitial_velocity_field = true\n";
    let text = format!("{CONCRETE}{CUBE}{STONES}{FIBERS}{load}").replace("steps = 60", "steps = 160");
    let mut whole = simulation(&text);
    while whole.advance().unwrap().stopped.is_none() {}
    let mut first = simulation(&text);
    for _ in 0..70 {
        first.advance().unwrap();
    }
    let mut columns = ColumnStore::of(&first.state).unwrap();
    let mut again = assembled(&text);
    restart::apply(&mut again, &mut columns, &read(&text), &[], false).unwrap();
    let mut second = Simulation::new(again.state, again.model, again.schedule).unwrap();
    while second.advance().unwrap().stopped.is_none() {}
    assert_eq!(ColumnStore::of(&whole.state).unwrap(), ColumnStore::of(&second.state).unwrap());
    let contacts = whole.state.bonds[0].contacts();
    assert!((0..contacts.len()).filter(|&k| contacts.damage(k) > 0.0).count() > 100);
    let other = text.replace("seed = 2", "seed = 4");
    let mut columns = ColumnStore::of(&first.state).unwrap();
    let refused = restart::apply(&mut assembled(&other), &mut columns, &read(&other), &[], false);
    assert!(refused.unwrap_err().to_string().contains("does not belong to this packing"));
}

/// A notched prism of concrete in tension: alone it loses its load once a crack has gone through; fibers across the crack, whose bonds slip
/// far before they break, hold more than the first peak.
#[test]
fn fibers_hold_the_load_after_the_crack() {
    let prism = "[packing]
        kind = \"lattice\"
        lattice = \"fcc\"
        radius = \"1 mm\"
        shape = { kind = \"box\", size = [\"12 mm\", \"12 mm\", \"30 mm\"] }
        ";
    let mut fibers = String::from("[fibers]\n[[fibers.group]]\nmaterial = \"steel\"\ndiameter = \"1 mm\"\nlines = [");
    for (x, y) in [(-3.0, -3.0), (3.0, -3.0), (-3.0, 3.0), (3.0, 3.0), (0.0, 0.0)] {
        let _ = write!(fibers, "[[{}, {}, -0.0095], [{0}, {1}, 0.0095]], ", x * 1e-3, y * 1e-3);
    }
    fibers += "]\n";
    let slit = "[[cut]]
        remove_particles = true
        shape = { kind = \"box\", minimum = [-0.007, -0.007, -0.0008], maximum = [-0.004, 0.007, 0.0008] }
        ";
    let slip = "[[interface]]
        between = [\"mortar\", \"steel\"]
        cpm = { young = 25e9, shear_ratio = 0.2, crack_onset_strain = 0.05, relative_ductility = 30, cohesion = 3e6, friction_coefficient = 0 }
        ";
    let load = "[loading]\nkind = \"uniaxial\"\nstrain_rate = 20\ninitial_velocity_field = true\n
        [integration]\ndamping = { kind = \"local\", coefficient = 0.2 }\n";
    let text = |more: &str| format!("{CONCRETE}{prism}{slit}{more}{load}").replace("steps = 60", "strain = 4e-3");
    let curve = |more: &str| {
        let mut run = simulation(&text(more));
        let mut stress = Vec::new();
        loop {
            let step = run.advance().unwrap();
            stress.extend(step.sample.map(|record| record.stress));
            if step.stopped.is_some() {
                return stress;
            }
        }
    };
    let (plain, held) = (curve(""), curve(&format!("{fibers}{slip}")));
    let peak = |curve: &[f64]| curve.iter().copied().fold(0.0, f64::max);
    let mean_of_end = |curve: &[f64]| {
        let tail = &curve[curve.len() * 3 / 4..];
        tail.iter().sum::<f64>() / tail.len() as f64
    };
    assert!(peak(&plain) > 1e6);
    // Measured: 0.07 of the peak (a tail of exponential softening) and 2.2 times the peak.
    assert!(mean_of_end(&plain) < 0.12 * peak(&plain), "{} {}", mean_of_end(&plain), peak(&plain));
    assert!(mean_of_end(&held) > peak(&plain), "{} {}", mean_of_end(&held), peak(&plain));
}
