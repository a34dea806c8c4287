//! Phases that a scenario gives for each particle, as arrays of another program.

mod shared;

use std::path::Path;

use concordem_scenario::assembly::Assembly;
use concordem_scenario::schema::Scenario;
use concordem_solver::state::columns::ColumnStore;
use shared::{assembled, read, try_assembled};

/// Concrete of two kinds of aggregates in a cube; `phases`: what divides it.
fn concrete(phases: &str) -> String {
    let cpm = "shear_ratio = 0.2, relative_ductility = 30, friction_coefficient = 0.8";
    format!(
        "version = 1
        [packing]
        kind = \"lattice\"
        lattice = \"fcc\"
        radius = \"1 mm\"
        shape = {{ kind = \"box\", size = [\"24 mm\", \"24 mm\", \"24 mm\"] }}
        [[material]]
        name = \"mortar\"
        density = 4800
        cpm = {{ young = 25e9, crack_onset_strain = 1e-4, cohesion = 3e6, {cpm} }}
        [[material]]
        name = \"basalt\"
        density = 5600
        cpm = {{ young = 62.5e9, crack_onset_strain = 2e-4, cohesion = 15e6, {cpm} }}
        [[material]]
        name = \"granite\"
        density = 5000
        cpm = {{ young = 50e9, crack_onset_strain = 2e-4, cohesion = 10e6, {cpm} }}
        [[interface]]
        between = [\"mortar\", \"basalt\"]
        of = \"mortar\"
        factors = {{ stiffness = 0.5, strength = 0.4, ductility = 0.1 }}
        [[interface]]
        between = [\"granite\", \"granite\"]
        of = \"mortar\"
        factors = {{ strength = 0.6 }}
        [bonds]
        law = \"cpm\"
        interaction_ratio = 1.5
        [contacts]
        law = \"cpm\"
        [[cut]]
        remove_particles = true
        shape = {{ kind = \"box\", minimum = [-0.02, -0.02, -0.001], maximum = [-0.008, 0.02, 0.001] }}
        [stop]
        steps = 30
        {phases}"
    )
}

const GROUPS: &str = "[aggregates]
    seed = 3
    [[aggregates.group]]
    material = \"basalt\"
    grading = { kind = \"single\", size = \"6 mm\" }
    volume_fraction = 0.1
    [[aggregates.group]]
    material = \"granite\"
    grading = { kind = \"single\", size = \"5 mm\" }
    volume_fraction = 0.1
    ";

/// Numbers of the materials and of the aggregates of the spheres of the packing, in its order; spheres that a cut removes have any.
fn arrays(assembly: &Assembly, spheres: usize) -> (Vec<u16>, Vec<u32>) {
    let particles = &assembly.state.particles;
    let (mut materials, mut aggregates) = (vec![0; spheres], vec![0; spheres]);
    let scenario = read(&concrete(GROUPS));
    let placed = concordem_scenario::assembly::place(&scenario, Path::new(""), &mut |_, _| ()).unwrap();
    assert_eq!(placed.packing.spheres.len(), spheres);
    for p in 0..particles.len() {
        let same = |sphere: &concordem_solver::state::Sphere| sphere.position == particles.position[p];
        let at = placed.packing.spheres.iter().position(same).unwrap();
        (materials[at], aggregates[at]) = (particles.material[p], particles.aggregate[p]);
    }
    (materials, aggregates)
}

/// The same materials and aggregates, once found from shapes and once given, are the same specimen bit for bit: particles, bonds, and their
/// parameters, also between two aggregates of one material.
#[test]
fn given_phases_equal_those_of_aggregates() {
    let found = assembled(&concrete(GROUPS));
    let scenario = read(&concrete(GROUPS));
    let spheres =
        concordem_scenario::assembly::place(&scenario, Path::new(""), &mut |_, _| ()).unwrap().packing.spheres.len();
    assert!(found.state.particles.len() < spheres, "the cut removes particles");
    let (materials, aggregates) = arrays(&found, spheres);
    assert!((0..3).all(|kind| materials.iter().filter(|&&material| material == kind).count() > 30));
    let given = assembled(&concrete(&format!("[phases]\nmaterials = {materials:?}\naggregates = {aggregates:?}\n")));
    assert_eq!(ColumnStore::of(&found.state).unwrap(), ColumnStore::of(&given.state).unwrap());
    assert_eq!(found.summary.bonds_by_phase, given.summary.bonds_by_phase);
    assert!(found.summary.bonds_by_phase.unwrap()[3] > 10);
    // Without the numbers of aggregates, bonds between two of them are those within one.
    let text = concrete(&format!("[phases]\nmaterials = {materials:?}\n"));
    let given = assembled(&text.replace("[\"granite\", \"granite\"]", "[\"mortar\", \"granite\"]"));
    assert_eq!(given.summary.bonds_by_phase.unwrap()[2..], [0, 0]);
}

/// Numbers that do not fit.
#[test]
fn wrong_phases_are_refused() {
    let message = |phases: &str| {
        let text = concrete(phases).replace("[\"granite\", \"granite\"]", "[\"mortar\", \"granite\"]");
        match Scenario::parse("test.toml", &text) {
            Err(error) => error.to_string(),
            Ok(_) => try_assembled(&text).map(|_| ()).unwrap_err().to_string(),
        }
    };
    for (phases, words) in [
        ("[phases]\nmaterials = [0, 3]\n", "no material has this number"),
        ("[phases]\nmaterials = [0, 1]\naggregates = [1]\n", "1 numbers for 2 materials"),
        ("[phases]\nmaterials = [0, 1, 2]\naggregates = [0, 4, 4]\n", "aggregate 4 has spheres of two materials"),
        ("[phases]\nmaterials = [0, 1]\n", "2 materials are given for"),
    ] {
        let found = message(phases);
        assert!(found.contains(words), "{found}");
    }
    let both = message(&format!("{GROUPS}[phases]\nmaterials = [0]\n"));
    assert!(both.contains("cannot be combined with [aggregates]"), "{both}");
}
