//! Bonds made during a run: lengths, energy, materials, periodic images, clumps, restart, refusals.

mod shared;

use std::path::Path;

use concordem_scenario::assembly::{assemble, restart};
use concordem_scenario::schedule::{Advance, Simulation};
use concordem_scenario::schema::Scenario;
use concordem_solver::state::columns::ColumnStore;
use shared::simulation;

/// Spheres of two materials with contacts of 1e5 N/m and bonds of 2e5 N/m; nothing is bonded at the start.
fn unbonded(packing: &str, more: &str) -> String {
    let laws = "frictional = { normal_stiffness = 1e5, shear_stiffness = 5e4, friction_coefficient = 0.3 }
        linear_bond = { normal_stiffness = 2e5, shear_stiffness = 1e5 }";
    format!(
        "version = 1
        [packing]
        kind = \"spheres\"
        {packing}
        [[material]]
        name = \"m\"
        density = 2500
        {laws}
        [[material]]
        name = \"other\"
        density = 2500
        {laws}
        [bonds]
        law = \"linear_bond\"
        at_start = false
        [contacts]
        law = \"frictional\"
        {more}"
    )
}

fn run(simulation: &mut Simulation) -> Vec<Advance> {
    let mut all = Vec::new();
    while all.last().is_none_or(|advance: &Advance| advance.stopped.is_none()) {
        all.push(simulation.advance().unwrap());
    }
    all
}

/// Two spheres press on each other by 1 N until they are at rest; the bond starts there without force, at the length
/// `2 R − F/k_c`. A pull of 0.5 N then stretches it by `P/k_b`. The contact gives up `½ F²/k_c`, which counts as damage. Tolerances:
/// the rest of the motion at the moment of bonding, `v = 1e-5 m/s`, changes the energy by `½ F v Δt`, 2e-5 of it.
#[test]
fn pressed_spheres_stick_at_their_distance() {
    let text = unbonded(
        "spheres = [[0, 0, 0, 0.01], [0.02, 0, 0, 0.01]]",
        "[[bonding]]
        time = 0.25
        kinetic_energy = \"1e-6 uJ\"
        [[set]]
        name = \"left\"
        selection = { kind = \"ids\", ids = [0] }
        [[set]]
        name = \"right\"
        selection = { kind = \"ids\", ids = [1] }
        [[history]]
        name = \"pull\"
        shape = { kind = \"table\", points = [[0.3, 1], [0.4, -0.5]] }
        [[prescribe]]
        set = \"left\"
        velocity = [0, 0, 0]
        [[force]]
        set = \"right\"
        force = [-1, 0, 0]
        history = \"pull\"
        [integration]
        time_step = 1e-5
        damping = { kind = \"local\", coefficient = 0.5 }
        [stop]
        time = 0.8",
    );
    let mut simulation = simulation(&text);
    let mut made = Vec::new();
    let last = loop {
        let advance = simulation.advance().unwrap();
        if let Some(bonds) = advance.bonded {
            made.push((simulation.state.clock.time(), bonds, simulation.state.ledger.damage.get()));
            let length = simulation.state.bonds[0].view(0).reference.length;
            assert!((length - (0.02 - 1e-5)).abs() < 1e-10, "{length}");
        }
        if let Some(last) = advance.last {
            break last;
        }
    };
    let [(time, bonds, damage)] = made[..] else { panic!("{made:?}") };
    assert!((0.25..0.3).contains(&time) && bonds == 1, "{time} {bonds}");
    let energy = 0.5 * 1.0 / 1e5;
    assert!((damage / energy - 1.0).abs() < 1e-4, "{damage} {energy}");
    assert!(last.residual.abs() < 1e-4 * energy, "{} {energy}", last.residual);
    let x = &simulation.state.particles.position;
    let distance = (x[1] - x[0]).norm();
    assert!((distance - (0.02 - 1e-5 + 0.5 / 2e5)).abs() < 1e-10, "{distance}");
    assert_eq!(simulation.intact_bonds(), 1);
    assert!(simulation.state.contacts.iter().all(|block| block.is_empty()));
}

/// A heap of spheres of two materials on a floor; the run bonds unequal materials at the end of a stage, and all later.
fn heap(more: &str) -> String {
    let mut list = Vec::new();
    for k in 0..27_usize {
        let [i, j, l] = [k % 3, k / 3 % 3, k / 9].map(|n| n as f64);
        // Rows that are shifted, so that the heap settles.
        list.push([0.021 * i + 0.004 * l, 0.021 * j + 0.003 * l, 0.011 + 0.021 * l, 0.01]);
    }
    let middle: Vec<usize> = (0..27).filter(|k| k % 3 == 1).collect();
    unbonded(
        &format!("spheres = {list:?}"),
        &format!(
            "[[set]]
            name = \"middle\"
            material = \"other\"
            selection = {{ kind = \"ids\", ids = {middle:?} }}
            [[wall]]
            material = \"m\"
            shape = {{ kind = \"plane\", point = [0, 0, 0], normal = [0, 0, 1] }}
            [integration]
            gravity = [0, 0, -9.81]
            damping = {{ kind = \"local\", coefficient = 0.3 }}
            time_step = 2e-5
            [[stage]]
            name = \"pour\"
            stop = {{ time = 0.03 }}
            [[stage]]
            name = \"rest\"
            stop = {{ time = 0.03 }}
            [[bonding]]
            stage = \"pour\"
            interaction_ratio = 1.1
            between = [\"m\", \"other\"]
            [[bonding]]
            time = 0.045
            interaction_ratio = 1.1
            {more}"
        ),
    )
}

/// Only the materials of the table are bonded, bonds that exist stay, and a restart before, between, and after the two moments gives the
/// same bits.
#[test]
fn a_heap_is_bonded_and_restarts() {
    let text = heap("");
    let bits = |simulation: &Simulation| {
        let particles = &simulation.state.particles;
        let all: Vec<u64> = particles
            .position
            .iter()
            .chain(&particles.velocity)
            .flat_map(|v| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits()])
            .collect();
        let pairs = simulation.state.bonds[0].pairs().iter().map(|pair| [pair.a, pair.b]).collect::<Vec<_>>();
        (all, pairs, simulation.state.ledger.damage.get().to_bits())
    };
    let mut whole = simulation(&text);
    let mut made = Vec::new();
    while whole.stopped().is_none() {
        let advance = whole.advance().unwrap();
        if let Some(bonds) = advance.bonded {
            made.push(bonds);
            assert_eq!(whole.intact_bonds(), made.iter().sum::<usize>());
            let material = &whole.state.particles.material;
            let unequal =
                |pair: &concordem_solver::state::contacts::Pair| material[pair.a as usize] != material[pair.b as usize];
            assert_eq!(whole.state.bonds[0].pairs().iter().all(unequal), made.len() == 1);
        }
    }
    assert!(made.len() == 2 && made[0] > 5 && made[1] > 5, "{made:?}");
    for step in [700, 2000, 2700] {
        let mut first = simulation(&text);
        for _ in 0..step {
            first.advance().unwrap();
        }
        let scenario = Scenario::parse("test.toml", &text).unwrap();
        let mut assembly = assemble(&scenario, Path::new(""), &mut |_, _| ()).unwrap();
        restart::apply(&mut assembly, &mut ColumnStore::of(&first.state).unwrap(), &scenario, &[], false).unwrap();
        let mut second = Simulation::new(assembly.state, assembly.model, assembly.schedule).unwrap();
        run(&mut second);
        assert!(bits(&whole) == bits(&second), "restart at {step}");
    }
}

/// Spheres that touch across the border of a periodic cell are bonded with their image, members of one clump are not, and discs are as
/// spheres are.
#[test]
fn images_clumps_and_discs_are_bonded() {
    let event = "[[bonding]]\ntime = 0\n[integration]\ntime_step = 1e-5\n[stop]\nsteps = 3";
    let cell = "spheres = [[0.01, 0.05, 0.05, 0.01], [0.09, 0.05, 0.05, 0.01]]\ncell = [0.1, 0.1, 0.1]";
    let clumped = format!(
        "[[set]]\nname = \"pair\"\nselection = {{ kind = \"ids\", ids = [0, 1] }}\n[[clump]]\nset = \"pair\"\n{event}"
    );
    let row = "spheres = [[0, 0, 0, 0.01], [0.02, 0, 0, 0.01], [0.04, 0, 0, 0.01], [0.0601, 0, 0, 0.01]]";
    for (text, bonds) in [
        (unbonded(cell, event), 1),
        (unbonded(row, event), 2),
        (unbonded(row, &clumped), 1),
        (unbonded(row, event).replace("version = 1", "version = 1\ndimension = 2"), 2),
    ] {
        let mut simulation = simulation(&text);
        run(&mut simulation);
        assert_eq!(simulation.intact_bonds(), bonds, "{text}");
        if text.contains("cell =") {
            assert_ne!(simulation.state.bonds[0].view(0).flags.image, [0; 3]);
        }
    }
}

/// Bonds that are too stiff for the time step end the run with the step that fits.
#[test]
fn stiff_bonds_need_a_smaller_step() {
    let text = unbonded(
        "spheres = [[0, 0, 0, 0.01], [0.02, 0, 0, 0.01]]",
        "[[bonding]]\ntime = 1e-3\n[integration]\ntime_step = 1e-4\n[stop]\ntime = 1",
    )
    .replace("linear_bond = { normal_stiffness = 2e5", "linear_bond = { normal_stiffness = 2e8");
    let mut simulation = simulation(&text);
    let error = (0..100).find_map(|_| simulation.advance().err()).expect("an unstable step").to_string();
    assert!(error.contains("after 1 bonds were made") && error.contains("integration.time_step ="), "{error}");
}

/// What cannot be is refused, with the place and the remedy.
#[test]
fn impossible_bondings_are_refused() {
    let sphere = "spheres = [[0, 0, 0, 0.01]]";
    let end = "\n[integration]\ntime_step = 1e-5\n[stop]\ntime = 1";
    for (more, words) in [
        ("", "bonds.at_start"),
        ("[[bonding]]\nstage = \"none\"", "no stage has this name"),
        ("[[bonding]]\ninteraction_ratio = 1.1", "does not say when"),
        ("[[bonding]]\ntime = 1\nbetween = [\"m\", \"n\"]", "bonding[0].between[1]"),
        ("[[stage]]\nname = \"a\"\nstop = { time = 1 }\n[[bonding]]\nstage = \"a\"", "the run ends with this stage"),
        (
            "[[stage]]\nname = \"a\"\nstop = { time = 1 }\n[[stage]]\nname = \"b\"\nstop = { time = 1 }\n\
             [[bonding]]\nstage = \"a\"\ntime = 1",
            "at the end of the stage",
        ),
        (
            "[[bonding]]\ntime = 1\n[[cut]]\nshape = { kind = \"sphere\", center = [0, 0, 0], radius = 1 }",
            "separates particles only at the start",
        ),
    ] {
        let message =
            Scenario::parse("test.toml", &unbonded(sphere, &format!("{more}{end}"))).expect_err(words).to_string();
        assert!(message.contains(words) && message.contains("help:"), "{message}");
    }
    let text = unbonded(sphere, &format!("[[bonding]]\ntime = 1{end}"));
    for (old, new, words) in [
        (
            "at_start = false",
            "at_start = false\n        interaction_ratio = 1.5",
            "has no effect without bonds at the start",
        ),
        ("density = 2500", "density = 2500\ndeformable = { young = 1e9, poisson = 0.2 }", "deformable particles"),
        ("[bonds]\n        law = \"linear_bond\"\n        at_start = false", "", "has no law of bonds"),
    ] {
        assert!(text.contains(old), "{text}");
        let message = Scenario::parse("test.toml", &text.replace(old, new)).expect_err(words).to_string();
        assert!(message.contains(words), "{message}");
    }
}
