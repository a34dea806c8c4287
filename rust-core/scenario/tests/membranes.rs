//! Membranes: forces of a closed surface, stress of a specimen, open ends, planes, clumps, energy, restart, refusals.

mod shared;

use std::path::Path;

use concordem_contact::math::{Mat3, Vec3};
use concordem_scenario::assembly::{assemble, restart};
use concordem_scenario::sampling::Record;
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::Scenario;
use concordem_solver::state::columns::ColumnStore;
use shared::{assembled, read, simulation};

/// The last record, and the last values of all operators.
fn run(simulation: &mut Simulation) -> (Record, Vec<Vec<f64>>) {
    loop {
        let advance = simulation.advance().unwrap_or_else(|error| panic!("{error}"));
        if advance.stopped.is_some() {
            let mut rows = vec![Vec::new(); simulation.schedule.operators.len()];
            advance.operators.into_iter().for_each(|row| rows[row.operator] = row.values);
            return (advance.last.unwrap(), rows);
        }
    }
}

const PRESSURE: f64 = 2e5;

/// Bonded spheres under a membrane whose pressure rises in 0.1 ms.
fn bonded(dimension: u8, packing: &str, membrane: &str, more: &str) -> String {
    let scale = if dimension == 2 { 100.0 } else { 1.0 };
    format!(
        "version = 1
        dimension = {dimension}
        [packing]
        {packing}
        [[material]]
        name = \"m\"
        density = 2500
        linear_bond = {{ normal_stiffness = {0}, shear_stiffness = {1} }}
        frictional = {{ normal_stiffness = {0}, shear_stiffness = {1}, friction_coefficient = 0.3 }}
        [bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.05
        [contacts]
        law = \"frictional\"
        [integration]
        damping = {{ kind = \"local\", coefficient = 0.5 }}
        [[history]]
        name = \"rise\"
        shape = {{ kind = \"table\", points = [[0, 0], [1e-4, 1]], smooth = true }}
        [[membrane]]
        pressure = {PRESSURE}
        history = \"rise\"
        {membrane}
        {more}",
        1e6 * scale,
        5e5 * scale
    )
}

/// Two edges of the unit cell, m: half the width of a box in which a uniform stress has exactly its mean.
const CELLS: f64 = 4.0 * std::f64::consts::SQRT_2 * 1e-3;

const BALL: &str = "kind = \"lattice\"\nlattice = \"fcc\"\nradius = 1e-3
    shape = { kind = \"cylinder\", radius = 0.011, height = 0.022 }";

/// The forces of a closed membrane and their moment sum to zero, whatever the shape; their virial is that of the pressure. The
/// specimen rests under the stress −p in its whole volume, and in a box in its middle, some unit cells of the lattice wide. Tolerances:
/// rounding for the sums; 1e-6 for the mean, what the residual forces leave; 5 % in the middle, since the bonds that are missing at the
/// surface let the outer layer, a tenth of the radius, carry another stress; 10 % in a random packing, whose stress varies from place to
/// place.
#[test]
fn a_closed_membrane_presses_from_all_sides() {
    for (dimension, packing, half, tolerance) in [
        (3, BALL, [CELLS, CELLS, CELLS], 0.05),
        (
            3,
            "kind = \"random-dense\"\ncount = 500\nradius = 1e-3\nseed = 3\nshape = { kind = \"box\", size = [0.016, 0.018, 0.02] }",
            [5e-3; 3],
            0.1,
        ),
        (
            2,
            "kind = \"lattice\"\nlattice = \"triangular\"\nradius = 1e-3\nshape = { kind = \"cylinder\", radius = 0.015, height = 1 }",
            [5e-3, 27_f64.sqrt() * 1e-3, 0.5],
            0.05,
        ),
    ] {
        // No center lies on a face of the box.
        let [low, high] = [-1.0, 1.0].map(|side| half.map(|h| side * h + 3e-4));
        let text = bonded(
            dimension,
            packing,
            "",
            &format!(
                "[[sample]]
            operator = \"boundary-stress\"
            region = {{ kind = \"all\", volume = 1 }}
            [[sample]]
            operator = \"region-stress\"
            region = {{ kind = \"box\", minimum = {low:?}, maximum = {high:?} }}
            [[sample]]
            operator = \"set-force\"
            set = \"all\"
            about = [0.1, 0.2, 0]
            [[set]]
            name = \"all\"
            selection = {{ kind = \"all\" }}
            [[stage]]
            name = \"rise\"
            stop = {{ time = 1e-4 }}
            [[stage]]
            name = \"rest\"
            stop = {{ unbalanced = 1e-5 }}"
            ),
        );
        let mut simulation = simulation(&text);
        let (record, rows) = run(&mut simulation);
        let position = &simulation.state.particles.position;
        let membrane = &simulation.schedule.histories.membranes[0];
        let (volume, axes) = (membrane.volume(position), if dimension == 2 { 2 } else { 3 });
        let loads = &simulation.state.particles.loads;
        let (mut force, mut moment, mut size) = (Vec3::zeros(), Vec3::zeros(), 0.0);
        for load in loads {
            force += load.force;
            moment += position[load.particle as usize].cross(&load.force);
            size += load.force.norm();
        }
        // The moment belongs to the positions before the last step, which moves the particles by 1e-10 of their distance.
        assert!(force.norm() < 1e-12 * size && moment.norm() < 1e-10 * size * 0.02, "{force} {moment} {size}");
        // Σ x⊗f = −p V.
        let virial = Mat3::from_row_slice(&rows[0][..9]);
        for i in 0..axes {
            for j in 0..axes {
                let expected = if i == j { -PRESSURE * volume } else { 0.0 };
                let found = virial[(i, j)];
                assert!((found - expected).abs() < 1e-6 * PRESSURE * volume, "{dimension} {i}{j}: {found} {expected}");
            }
        }
        let middle = Mat3::from_row_slice(&rows[1][..9]);
        for i in 0..axes {
            assert!((middle[(i, i)] / -PRESSURE - 1.0).abs() < tolerance, "{dimension}: {middle}");
        }
        let work = record.external_work;
        // Of second order in the step; unbonded contacts of the random packing close within steps, which leaves 2e-5.
        assert!(
            work > 0.0 && record.residual.abs() < 1e-4 * work,
            "{dimension} {}: {} {work}",
            position.len(),
            record.residual
        );
        assert!(record.stress == 0.0);
    }
}

/// A triaxial test: a cylinder between end layers that approach each other, in a membrane that is open at the ends. The mean lateral
/// stress in its middle is the pressure. The stress of the ends refers to the cylinder, that in the middle to the section between the
/// outermost centers, which is smaller by (10/11)².
#[test]
fn a_triaxial_cylinder_has_the_lateral_pressure() {
    let text = bonded(
        3,
        BALL,
        "open_along = \"z\"",
        &format!(
            "[loading]
        kind = \"uniaxial\"
        axis = \"z\"
        strain_rate = -1
        [[stage]]
        name = \"confine\"
        rate = 0
        stop = {{ time = 1.5e-4 }}
        [[stage]]
        name = \"compress\"
        stop = {{ time = 2e-4 }}
        [[stage]]
        name = \"rest\"
        rate = 0
        stop = {{ unbalanced = 1e-5 }}
        [[sample]]
        operator = \"region-stress\"
        region = {{ kind = \"box\", minimum = {:?}, maximum = {:?} }}",
            [3e-4 - CELLS; 3],
            [3e-4 + CELLS; 3]
        ),
    );
    let mut simulation = simulation(&text);
    let (record, rows) = run(&mut simulation);
    let middle = Mat3::from_row_slice(&rows[0][..9]);
    for i in [0, 1] {
        assert!((middle[(i, i)] / -PRESSURE - 1.0).abs() < 0.05, "{middle}");
    }
    let ratio = middle[(2, 2)] / record.stress;
    assert!((1.0..1.35).contains(&ratio) && record.stress < -PRESSURE, "{middle} {}", record.stress);
}

/// A particle that the packing holds only from below is outside of a membrane of small reach, and pores inside stay free: no corner of
/// the membrane is a particle around the pore.
#[test]
fn a_membrane_does_not_enter_pores() {
    let text = bonded(
        3,
        BALL,
        "",
        "[[cut]]\nshape = { kind = \"sphere\", center = [0, 0, 0], radius = 3e-3 }\nremove_particles = true\n[stop]\nsteps = 1",
    );
    let simulation = simulation(&text);
    let membrane = &simulation.schedule.histories.membranes[0];
    let position = &simulation.state.particles.position;
    let nearest = membrane.faces.iter().flatten().map(|&p| position[p as usize].norm()).fold(f64::INFINITY, f64::min);
    assert!(nearest > 7e-3, "{nearest}");
    // Nearly all of the cylinder through the outer centers; its faces are flat between rough rows.
    let volume = membrane.volume(position);
    let whole = std::f64::consts::PI * 0.010_f64.powi(2) * 0.020;
    assert!((0.8..1.0).contains(&(volume / whole)), "{volume} {whole}");
}

/// The same bits after a restart; a clump at the surface moves as one body, and the sum of the forces stays zero.
#[test]
fn a_membrane_survives_a_restart() {
    let spheres: Vec<[f64; 4]> = (0..64)
        .map(|k| {
            let [i, j, l] = [k % 4, k / 4 % 4, k / 16].map(f64::from);
            [2e-3 * i + 1e-4 * j, 2e-3 * j + 1e-4 * l, 2e-3 * l, 1.02e-3]
        })
        .collect();
    let text = bonded(
        3,
        &format!("kind = \"spheres\"\nspheres = {spheres:?}"),
        "",
        "[[set]]\nname = \"pair\"\nselection = { kind = \"ids\", ids = [0, 1] }\n[[clump]]\nset = \"pair\"\n[stop]\nsteps = 800",
    );
    let mut whole = simulation(&text);
    run(&mut whole);
    let mut first = simulation(&text);
    for _ in 0..333 {
        first.advance().unwrap();
    }
    let (scenario, mut assembly) = (read(&text), assembled(&text));
    restart::apply(&mut assembly, &mut ColumnStore::of(&first.state).unwrap(), &scenario, &[], false).unwrap();
    let mut second = Simulation::new(assembly.state, assembly.model, assembly.schedule).unwrap();
    run(&mut second);
    let bits = |v: &Vec3| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits()];
    let particles = |run: &Simulation| run.state.particles.position.iter().map(bits).collect::<Vec<_>>();
    assert!(particles(&whole) == particles(&second));
    let sum: Vec3 = whole.state.particles.loads.iter().map(|load| load.force).sum();
    assert!(sum.norm() < 1e-12 * PRESSURE * 1e-4, "{sum}");
    let after = Scenario::parse("test.toml", &text.replace("pressure = 200000", "pressure = 300000")).unwrap();
    let message =
        restart::check(&scenario, &after, restart::Continuation::NewResult).expect_err("membrane").to_string();
    assert!(message.contains("membrane"), "{message}");
}

/// What cannot be is refused, with the place and the remedy.
#[test]
fn impossible_membranes_are_refused() {
    let stop = "[stop]\nsteps = 1";
    let text = bonded(3, BALL, "", stop);
    for (old, new, words) in [
        (
            "shape = { kind = \"cylinder\", radius = 0.011, height = 0.022 }",
            "shape = { kind = \"periodic\" }\nrepeats = [4, 4, 4]",
            "has no surface",
        ),
        ("density = 2500", "density = 2500\ndeformable = { young = 1e9, poisson = 0.2 }", "deformable"),
        ("history = \"rise\"", "history = \"fall\"", "no history has this name"),
        ("pressure = 200000", "pressure = -1", "pressure"),
    ] {
        assert!(text.contains(old), "{old}");
        let message = Scenario::parse("test.toml", &text.replace(old, new)).expect_err(words).to_string();
        assert!(message.contains(words), "{message}");
    }
    let text = bonded(3, BALL, "reach = 1e-4", stop);
    let scenario = Scenario::parse("test.toml", &text).unwrap();
    let message = assemble(&scenario, Path::new(""), &mut |_, _| ()).err().expect("refused").to_string();
    assert!(message.contains("encloses nothing"), "{message}");
}

/// A particle far outside has torn the faces at it, and only these; the loads of all corners stay finite.
#[test]
fn a_particle_that_leaves_tears_its_faces() {
    let mut simulation = simulation(&bonded(3, BALL, "", "[stop]\nsteps = 1"));
    assert!(simulation.torn().is_empty());
    let membrane = &simulation.schedule.histories.membranes[0];
    let p = membrane.faces[0][0];
    let (of_particle, all) = (membrane.faces.iter().filter(|face| face.contains(&p)).count(), membrane.faces.len());
    simulation.state.particles.position[p as usize] *= 10.0;
    assert_eq!(
        simulation.torn(),
        [format!("membrane[0] has torn at {of_particle} of {all} faces, which press less or not at all")]
    );
}
