//! Aggregates in scenarios: phases of particles, parameters of bonds by phase, pores, and what they meet.

mod shared;

use concordem_contact::law::{CohesiveBeam, ContactLaw, Cpm, LinearBond};
use concordem_scenario::assembly::Assembly;
use concordem_scenario::assembly::restart::{self, Continuation};
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::Scenario;
use concordem_solver::state::State;
use concordem_solver::state::columns::ColumnStore;
use concordem_solver::state::contacts::{ContactBlock, ContactView};
use shared::{assembled, read, simulation, try_assembled};

const CPM: &str = "shear_ratio = 0.2, relative_ductility = 30, friction_coefficient = 0.8";

/// Bonds of all kinds of concrete: mortar, two materials of aggregates.
fn concrete(packing: &str, rest: &str) -> String {
    format!(
        "version = 1
        [packing]
        {packing}
        [[material]]
        name = \"mortar\"
        density = 4800
        cpm = {{ young = 25e9, crack_onset_strain = 1e-4, cohesion = 3e6, {CPM} }}
        [[material]]
        name = \"basalt\"
        density = 5600
        cpm = {{ young = 62.5e9, crack_onset_strain = 2e-4, cohesion = 15e6, {CPM} }}
        [[material]]
        name = \"granite\"
        density = 5000
        cpm = {{ young = 50e9, crack_onset_strain = 2e-4, cohesion = 10e6, {CPM} }}
        [bonds]
        law = \"cpm\"
        interaction_ratio = 1.5
        [contacts]
        law = \"cpm\"
        [stop]
        steps = 40
        {rest}"
    )
}

const CUBE: &str = "kind = \"lattice\"
    lattice = \"fcc\"
    radius = \"0.8 mm\"
    shape = { kind = \"box\", size = [\"24 mm\", \"24 mm\", \"24 mm\"] }";

const CELL: &str = "kind = \"lattice\"
    lattice = \"fcc\"
    radius = \"0.8 mm\"
    repeats = [9, 9, 9]
    shape = { kind = \"periodic\" }";

/// Spheres of 4 to 8 mm; 0.05 of the volume are pores.
const GROUPS: &str = "[aggregates]
    seed = 3
    [[aggregates.group]]
    material = \"basalt\"
    grading = { kind = \"fuller\", largest = \"8 mm\" }
    smallest = \"4 mm\"
    volume_fraction = 0.6
    depth = 0.25
    [[aggregates.group]]
    material = \"granite\"
    grading = { kind = \"single\", size = \"5 mm\" }
    shape = { kind = \"ellipsoid\", elongation = 1.3, flatness = 0.8 }
    volume_fraction = 0.08
    [[aggregates.group]]
    remove_particles = true
    grading = { kind = \"single\", size = \"3 mm\" }
    volume_fraction = 0.05
    ";

const ZONE: &str = "[[interface]]
    between = [\"basalt\", \"mortar\"]
    of = \"mortar\"
    factors = { stiffness = 0.5, strength = 0.4, ductility = 0.1 }
    [[interface]]
    between = [\"mortar\", \"granite\"]
    of = \"mortar\"
    factors = { stiffness = 0.7, strength = 0.8 }
    [[interface]]
    between = [\"granite\", \"granite\"]
    of = \"mortar\"
    factors = { strength = 0.6 }
    ";

/// All bonds, and the coefficients of each.
fn bonds<L: ContactLaw>(assembly: &Assembly) -> Vec<(ContactView, L)> {
    let contacts = assembly.state.bonds[0].contacts();
    let block = contacts.as_any().downcast_ref::<ContactBlock<L>>().expect("bonds of this law");
    let coefficients = |view: &ContactView| block.rows[view.flags.row as usize];
    (0..contacts.len()).map(|k| contacts.view(k)).map(|view| (view, coefficients(&view))).collect()
}

/// Every bond has the parameters of its phases: those of one material within an aggregate or the mortar, the factors times those of
/// the mortar at an interface, also between two aggregates; the mean without an interface.
#[test]
fn bonds_have_the_parameters_of_their_phases() {
    let assembly = assembled(&concrete(CUBE, &format!("{GROUPS}{ZONE}")));
    let particles = &assembly.state.particles;
    let mut kinds = std::collections::BTreeMap::<_, usize>::new();
    for (view, law) in bonds::<Cpm>(&assembly) {
        let [a, b] = [view.pair.a, view.pair.b].map(|p| p as usize);
        let mut materials = [particles.material[a], particles.material[b]];
        materials.sort_unstable();
        let apart = particles.aggregate[a] != particles.aggregate[b];
        // Modulus and crack onset strain, relative ductility, cohesion.
        let zone = |k: f64, s: f64, d: f64| [25e9 * k, 1e-4 * (s / k), 30.0 * d, 3e6 * s];
        let expected = match (materials, apart) {
            ([0, 0], _) => zone(1.0, 1.0, 1.0),
            ([1, 1], false) => [62.5e9, 2e-4, 30.0, 15e6],
            ([2, 2], false) => [50e9, 2e-4, 30.0, 10e6],
            // Two aggregates of basalt have no interface of their own, so they have that with the mortar.
            ([0 | 1, 1], true) => zone(0.5, 0.4, 0.1),
            ([0, 2], _) => zone(0.7, 0.8, 1.0),
            ([2, 2], true) => zone(1.0, 0.6, 1.0),
            ([1, 2], _) => [56.25e9, 2e-4, 30.0, 12.5e6],
            other => panic!("{other:?}"),
        };
        *kinds.entry((materials, apart)).or_default() += 1;
        let found = law.parameters();
        let found = [found.young, found.crack_onset_strain, found.relative_ductility, found.cohesion];
        for (found, expected) in found.iter().zip(expected) {
            // One rounding of each product, and of the mean.
            assert!((found / expected - 1.0).abs() < 1e-14, "{materials:?} {apart}: {found:?} {expected:?}");
        }
        assert_eq!(law.parameters().friction_coefficient, 0.8);
    }
    // All kinds occur but bonds between mortar and mortar of two aggregates, which is none.
    assert_eq!(kinds.len(), 8, "{kinds:?}");
    assert!(!kinds.contains_key(&([0, 0], true)));
    let counts = assembly.summary.bonds_by_phase.unwrap();
    let of = |materials: [u16; 2], apart: bool| kinds.get(&(materials, apart)).copied().unwrap_or(0);
    assert_eq!(counts[0], of([0, 0], false));
    assert_eq!(counts[1], of([1, 1], false) + of([2, 2], false));
    assert_eq!(counts[2], of([0, 1], true) + of([0, 2], true));
    assert_eq!(counts[3], of([1, 1], true) + of([1, 2], true) + of([2, 2], true));
}

/// The rule of Stránský 2018 for spheres, `|x − c| ≤ R − depth r`, by a look at all pairs; spheres in given places.
#[test]
fn centers_and_sizes_decide_about_phases() {
    let places = [[-6.0, 1.0, 2.0, 4.0], [5.0, -4.0, 0.0, 5.5], [4.0, 7.0, -3.0, 3.0]];
    for (depth, removed) in [(0.0, false), (0.5, false), (0.5, true)] {
        let list: Vec<String> = places.iter().map(|s| format!("{:?}", s.map(|x| x * 1e-3))).collect();
        let phase = if removed { "remove_particles = true" } else { "material = \"basalt\"" };
        let group =
            format!("[aggregates]\n[[aggregates.group]]\n{phase}\ndepth = {depth}\nspheres = [{}]\n", list.join(", "));
        let whole = assembled(&concrete(CUBE, ""));
        let divided = assembled(&concrete(CUBE, &group));
        let expected: Vec<u32> = (0..whole.state.particles.len())
            .map(|p| {
                let x = whole.state.particles.position[p];
                let inside = |s: &[f64; 4]| {
                    (x * 1e3 - concordem_contact::math::Vec3::new(s[0], s[1], s[2])).norm() <= s[3] - depth * 0.8
                };
                places.iter().position(inside).map_or(0, |body| body as u32 + 1)
            })
            .collect();
        let inside = expected.iter().filter(|number| **number > 0).count();
        assert!(inside > 100);
        let particles = &divided.state.particles;
        if removed {
            assert_eq!(particles.len(), expected.len() - inside);
            assert!(particles.aggregate.iter().all(|number| *number == 0));
            let mut ids = particles.id.clone();
            ids.sort_unstable();
            assert!(ids.iter().copied().eq(0..particles.len() as u32), "particles are numbered without gaps");
        } else {
            assert_eq!(particles.aggregate, expected);
            let material: Vec<u16> = expected.iter().map(|number| u16::from(*number > 0)).collect();
            assert_eq!(particles.material, material);
            // The mass is that of the material.
            let ratio = particles.mass[expected.iter().position(|number| *number > 0).unwrap()]
                / particles.mass[expected.iter().position(|number| *number == 0).unwrap()];
            assert!((ratio - 5600.0 / 4800.0).abs() < 1e-14);
        }
        let phases = divided.summary.phases.unwrap();
        assert_eq!((phases.groups[0].count, phases.groups[0].particles), (3, inside));
        assert_eq!(phases.matrix.0, expected.len() - inside);
    }
}

/// Placed aggregates have the volume that the scenario gives; with depth 0 so have the particles inside, up to the scatter of a
/// lattice.
#[test]
fn particles_have_the_volume_of_the_aggregates() {
    for packing in [CUBE, CELL] {
        let text = concrete(packing, &GROUPS.replace("depth = 0.25", "depth = 0"));
        let phases = assembled(&text).summary.phases.unwrap();
        // 0.6 of Fuller's curve, of which (4/8)^½ is finer.
        for (phase, fraction) in phases.groups.iter().zip([0.6 * (1.0 - 0.5_f64.sqrt()), 0.08, 0.05]) {
            // Half of the smallest body: 4 mm in 24³ mm³ are 0.24 %, 5 mm are 0.47 %, 3 mm are 0.1 %.
            assert!((phase.volume_fraction - fraction).abs() < 0.005, "{phase:?}");
            // In the cell, up to the scatter of the lattice in bodies of 5 to 40 particles; the cube has no particles at its faces
            // and no aggregates there, so their share is larger.
            let ratio = phase.share / phase.volume_fraction;
            assert!(if packing == CELL { (ratio - 1.0).abs() < 0.2 } else { ratio > 1.0 && ratio < 1.6 }, "{phase:?}");
        }
        let total: f64 = phases.matrix.1 + phases.groups.iter().map(|phase| phase.share).sum::<f64>();
        assert!((total - 1.0).abs() < 1e-12);
    }
}

/// A set with a material takes its particles out of the aggregates.
#[test]
fn sets_override_aggregates() {
    let set = "[[set]]
        name = \"plate\"
        material = \"granite\"
        selection = { kind = \"layer\", axis = \"z\", end = \"minimum\", thickness = \"6 mm\" }
        [[set]]
        name = \"all\"
        selection = { kind = \"all\" }
        ";
    let plain = assembled(&concrete(CUBE, GROUPS)).state.particles;
    let particles = assembled(&concrete(CUBE, &format!("{GROUPS}{set}"))).state.particles;
    let mut changed = 0;
    for p in 0..particles.len() {
        if particles.tags[p] & 1 == 1 {
            assert_eq!((particles.aggregate[p], particles.material[p]), (0, 2));
            changed += usize::from(plain.aggregate[p] > 0);
        } else {
            assert_eq!((particles.aggregate[p], particles.material[p]), (plain.aggregate[p], plain.material[p]));
        }
    }
    assert!(changed > 50);
}

/// The other laws: factors multiply what they have; brittle laws have no ductility.
#[test]
fn factors_of_brittle_laws() {
    let text = |law: &str, one: &str, factors: &str| {
        format!(
            "version = 1
            [packing]
            {CUBE}
            [[material]]
            name = \"mortar\"
            density = 2500
            {law} = {{ {one} }}
            frictional = {{ normal_stiffness = 1e6, shear_stiffness = 4e5 }}
            [[material]]
            name = \"stone\"
            density = 2500
            {law} = {{ {one} }}
            frictional = {{ normal_stiffness = 3e6, shear_stiffness = 4e5 }}
            [[interface]]
            between = [\"mortar\", \"stone\"]
            of = \"mortar\"
            factors = {{ {factors} }}
            [aggregates]
            [[aggregates.group]]
            material = \"stone\"
            spheres = [[0, 0, 0, \"8 mm\"]]
            [bonds]
            law = \"{law}\"
            interaction_ratio = 1.01
            [contacts]
            law = \"frictional\"
            [stop]
            steps = 1"
        )
    };
    let spring = "normal_stiffness = 1e6, shear_stiffness = 5e5, normal_strength = 10, shear_strength = 20";
    let assembly = assembled(&text("linear_bond", spring, "stiffness = 0.5, strength = 0.25"));
    let particles = &assembly.state.particles;
    let mut interface = 0;
    for (view, law) in bonds::<LinearBond>(&assembly) {
        let across = particles.material[view.pair.a as usize] != particles.material[view.pair.b as usize];
        let expected = if across { (5e5, 2.5e5, 2.5, 5.0) } else { (1e6, 5e5, 10.0, 20.0) };
        assert_eq!((law.normal_stiffness, law.shear_stiffness, law.normal_strength, law.shear_strength), expected);
        interface += usize::from(across);
    }
    assert!(interface > 100);
    let beam = "young = 1e9, radius_ratio = 0.5, tensile_strength = 1e6";
    let assembly = assembled(&text("cohesive_beam", beam, "stiffness = 0.5, strength = 0.25"));
    let particles = &assembly.state.particles;
    for (view, law) in bonds::<CohesiveBeam>(&assembly) {
        let across = particles.material[view.pair.a as usize] != particles.material[view.pair.b as usize];
        assert_eq!((law.young, law.strength), if across { (5e8, 2.5e5) } else { (1e9, 1e6) });
    }
    for (law, parameters, factors, message) in [
        ("linear_bond", spring, "ductility = 0.5", "have no softening to scale"),
        ("cohesive_beam", beam, "ductility = 0.5", "have no softening to scale"),
        ("linear_bond", "normal_stiffness = 1, shear_stiffness = 1", "strength = 2", "have no strength to scale"),
        ("cohesive_beam", "young = 1, radius_ratio = 1", "strength = 2", "have no strength to scale"),
    ] {
        let refused = Scenario::parse("test.toml", &text(law, parameters, factors)).unwrap_err().to_string();
        assert!(refused.contains(message) && refused.contains("interface[0].factors."), "{refused}");
    }
}

/// Two runs, one with the aggregates as clumps and one deformable, and a plane one, step without error; the same seed gives the same
/// bits.
#[test]
fn aggregates_meet_clumps_deformable_particles_and_the_plane() {
    let springs = |packing: &str, dimension: u8, rest: &str| {
        format!(
            "version = 1
            dimension = {dimension}
            [packing]
            {packing}
            [[material]]
            name = \"mortar\"
            density = 2500
            linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 5e5 }}
            deformable = {{ young = 2e10, poisson = 0.2 }}
            [[material]]
            name = \"stone\"
            density = 2500
            linear_bond = {{ normal_stiffness = 2e6, shear_stiffness = 5e5 }}
            deformable = {{ young = 3e10, poisson = 0.2 }}
            [bonds]
            law = \"linear_bond\"
            interaction_ratio = 1.01
            [contacts]
            law = \"linear_bond\"
            [stop]
            steps = 20
            [aggregates]
            surface = \"sawn\"
            [[aggregates.group]]
            material = \"stone\"
            volume_fraction = 0.2
            grading = {{ kind = \"sieves\", sizes = [\"4 mm\", \"6 mm\"], passing = [0, 1] }}
            {rest}"
        )
    };
    let clump = "[[set]]\nname = \"stone\"\nselection = { kind = \"sphere\", center = [0, 0, 0], radius = \"3 mm\" }\n[[clump]]\nset = \"stone\"\n";
    let rigid = |text: String| {
        text.replace("deformable = { young = 2e10, poisson = 0.2 }", "")
            .replace("deformable = { young = 3e10, poisson = 0.2 }", "")
    };
    let discs = "kind = \"random-discs\"
        count = 200
        radius = \"0.5 mm\"
        shape = { kind = \"box\", size = [\"20 mm\", \"20 mm\", \"1 mm\"] }";
    let ellipses = "shape = { kind = \"ellipsoid\", elongation = 1.5 }";
    for text in [
        springs(CUBE, 3, ""),
        rigid(springs(CUBE, 3, clump)),
        springs(discs, 2, ellipses),
        springs(&CELL.replace("repeats", "repeats "), 3, "").replace("surface = \"sawn\"", ""),
    ] {
        let run = || {
            let mut simulation = simulation(&text);
            assert!(simulation.state.particles.aggregate.iter().any(|number| *number > 0));
            while simulation.advance().unwrap().stopped.is_none() {}
            let state = simulation.state;
            (state.particles.position.clone(), state.particles.aggregate.clone())
        };
        assert_eq!(run(), run());
    }
}

/// Aggregates of a plane have the area that the scenario gives, and lie in the plane.
#[test]
fn discs_have_aggregates_by_area() {
    let packing = "kind = \"lattice\"
        lattice = \"triangular\"
        radius = \"0.25 mm\"
        shape = { kind = \"box\", size = [\"40 mm\", \"40 mm\", \"1 mm\"] }";
    let text = concrete(packing, GROUPS)
        .replace("version = 1", "version = 1\ndimension = 2")
        .replace(", flatness = 0.8", "")
        .replace("law = \"cpm\"", "law = \"linear_bond\"")
        .replace("[[material]]", "[[material]]\nlinear_bond = { normal_stiffness = 1e6, shear_stiffness = 5e5 }");
    let phases = assembled(&text).summary.phases.unwrap();
    for (phase, fraction) in phases.groups.iter().zip([0.6 * (1.0 - 0.5_f64.sqrt()), 0.08, 0.05]) {
        // Half of a body: an ellipse of 5 by 6.5 mm in 40² mm² is 1.6 %.
        assert!((phase.volume_fraction - fraction).abs() < 0.009, "{phase:?}");
    }
    // Depth 0 conserves the area; the ring of a quarter of a radius, 0.06 mm, around bodies of 5 mm is 5 % of it.
    assert!((phases.groups[1].share / phases.groups[1].volume_fraction - 1.0).abs() < 0.1, "{phases:?}");
}

/// What cannot be placed says how far it got; what contains no particle is a warning.
#[test]
fn full_moulds_and_empty_aggregates() {
    let full = try_assembled(&concrete(CUBE, &GROUPS.replace("volume_fraction = 0.08", "volume_fraction = 0.6")));
    let message = full.map(|_| ()).unwrap_err().to_string();
    assert!(message.contains("no place for inclusion") && message.contains("smaller volume fraction"), "{message}");
    let tiny = GROUPS
        .replace("size = \"3 mm\"", "size = \"0.5 mm\"")
        .replace("volume_fraction = 0.05", "volume_fraction = 0.002");
    let assembly = assembled(&concrete(CUBE, &tiny));
    let warning = assembly.summary.warnings.iter().find(|one| one.key == "aggregates.group[2]").unwrap().to_string();
    assert!(warning.contains("contain no particle"), "{warning}");
}

/// Two runs with damage around aggregates have the same bits if the second one is restarted from columns in the middle.
#[test]
fn aggregates_survive_a_restart() {
    let pull = "[loading]\nkind = \"uniaxial\"\nstrain_rate = 20\ninitial_velocity_field = true\n";
    let text = concrete(CUBE, &format!("{GROUPS}{ZONE}{pull}")).replace("steps = 40", "steps = 120");
    let mut whole = simulation(&text);
    while whole.advance().unwrap().stopped.is_none() {}
    let mut first = simulation(&text);
    for _ in 0..50 {
        first.advance().unwrap();
    }
    let mut columns = ColumnStore::of(&first.state).unwrap();
    let scenario = read(&text);
    let mut again = assembled(&text);
    restart::apply(&mut again, &mut columns, &scenario, &[], false).unwrap();
    let mut second = Simulation::new(again.state, again.model, again.schedule).unwrap();
    while second.advance().unwrap().stopped.is_none() {}
    let columns = |state: &State| ColumnStore::of(state).unwrap();
    assert_eq!(columns(&whole.state), columns(&second.state));
    let contacts = whole.state.bonds[0].contacts();
    let damaged = (0..contacts.len()).filter(|&k| contacts.damage(k) > 0.0).count();
    assert!(damaged > 100, "{damaged}");
    // A state of other aggregates belongs to another specimen.
    let other = text.replace("seed = 3", "seed = 4");
    let mut columns = ColumnStore::of(&first.state).unwrap();
    let refused = restart::apply(&mut assembled(&other), &mut columns, &read(&other), &[], false);
    assert!(refused.unwrap_err().to_string().contains("does not belong to this packing"));
}

/// A restart cannot change the aggregates, but the factors of an interface.
#[test]
fn restarts_keep_the_aggregates() {
    let before = read(&concrete(CUBE, &format!("{GROUPS}{ZONE}")));
    let change = |from: &str, to: &str| {
        let after = read(&concrete(CUBE, &format!("{GROUPS}{ZONE}").replace(from, to)));
        restart::check(&before, &after, Continuation::NewResult)
    };
    assert_eq!(change("strength = 0.4", "strength = 0.3").unwrap().len(), 1);
    for (from, to) in
        [("seed = 3", "seed = 4"), ("depth = 0.25", "depth = 0.5"), ("of = \"mortar\"", "of = \"granite\"")]
    {
        assert!(change(from, to).is_err(), "{from}");
    }
}
