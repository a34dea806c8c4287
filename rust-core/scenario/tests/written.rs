//! A caller writes to velocities and positions between steps: the energy balance holds, and the guard lets the run go on.

mod shared;

use concordem_contact::math::Vec3;
use concordem_scenario::schedule::simulation::Written;
use shared::simulation;

const TWO: &str = "version = 1
    [packing]
    kind = \"spheres\"
    spheres = [[0, 0, 0, 1e-3], [3e-3, 0, 0, 1e-3]]
    [[material]]
    name = \"m\"
    density = 2500
    frictional = { normal_stiffness = 1e5, shear_stiffness = 1e5, friction_coefficient = 0.5 }
    [contacts]
    law = \"frictional\"
    [stop]
    steps = 1000000
    [output]
    sample_interval = 1
    ";

/// A kick of 10 mm/s between steps is external work; the sphere meets the other one, and the ledger closes to rounding.
#[test]
fn written_velocities_are_external_work() {
    let mut run = simulation(TWO);
    for _ in 0..600 {
        run.advance().unwrap();
    }
    let before = Written::of(&run.state);
    run.state.particles.velocity[0] = Vec3::new(0.01, 0.0, 0.0);
    run.state.particles.angular_velocity[1] = Vec3::new(0.0, 0.0, 2.0);
    before.book(&mut run.state);
    let (mass, inertia) = (run.state.particles.mass[0], run.state.particles.inertia[1]);
    let energy = 0.5 * mass * 1e-4 + 0.5 * inertia * 4.0;
    let mut last = None;
    while run.state.particles.velocity[1].x < 1e-3 {
        last = run.advance().unwrap().sample;
    }
    let last = last.unwrap();
    assert!((last.external_work / energy - 1.0).abs() < 1e-12, "{} {energy}", last.external_work);
    // Places of 3e-3 m are rounded by 4e-19 m, under forces of up to 1 N.
    assert!(last.residual.abs() < 1e-8 * energy, "{}", last.residual);
}

/// The same for a sphere whose motion is prescribed by a constant, which goes on as it was written.
#[test]
fn written_velocities_of_a_prescribed_motion_are_external_work() {
    let text = TWO.to_owned()
        + "[[set]]
        name = \"held\"
        selection = { kind = \"ids\", ids = [0] }
        [[prescribe]]
        set = \"held\"
        velocity = [1e-3, 0, 0]
        angular_velocity = [0, 0, 0]";
    let mut run = simulation(&text);
    for _ in 0..10 {
        run.advance().unwrap();
    }
    let before = Written::of(&run.state);
    run.state.particles.velocity[0] = Vec3::new(0.01, 0.02, 0.0);
    run.state.particles.angular_velocity[0] = Vec3::new(0.0, 0.0, 2.0);
    before.book(&mut run.state);
    for _ in 0..3 {
        let record = run.advance().unwrap().sample.unwrap();
        assert!(record.residual.abs() < 1e-12 * record.external_work, "{} {}", record.residual, record.external_work);
    }
    assert_eq!(run.state.particles.velocity[0], Vec3::new(0.01, 0.02, 0.0));
}

/// Other positions begin another balance.
#[test]
fn written_positions_start_the_balance_anew() {
    let mut run = simulation(TWO);
    for _ in 0..10 {
        run.advance().unwrap();
    }
    let before = Written::of(&run.state);
    run.state.particles.position[1].x = 1.99e-3;
    before.book(&mut run.state);
    // The overlap of 10 um stores ½ k δ².
    let first = run.advance().unwrap().sample.unwrap();
    assert!((first.stored_normal / 5e-6 - 1.0).abs() < 1e-6, "{}", first.stored_normal);
    for _ in 0..300 {
        let record = run.advance().unwrap().sample.unwrap();
        assert!(record.residual.abs() < 1e-9 * 5e-6, "{}", record.residual);
    }
}

/// Velocities written before the first step are energy of the start, not work: counted twice, they would be missing from the first step on.
#[test]
fn velocities_written_before_the_first_step_are_no_work() {
    let mut run = simulation(TWO);
    let before = Written::of(&run.state);
    run.state.particles.velocity[0] = Vec3::new(0.01, 0.0, 0.0);
    before.book(&mut run.state);
    let energy = 0.5 * run.state.particles.mass[0] * 1e-4;
    let first = run.advance().unwrap().sample.unwrap();
    assert!((first.kinetic / energy - 1.0).abs() < 1e-12, "{} {energy}", first.kinetic);
    assert_eq!((first.external_work, first.residual), (0.0, 0.0));
}
