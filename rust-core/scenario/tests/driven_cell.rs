//! Energies of a periodic cell that deforms: those of the motion relative to the cell, whatever the images at which particles are listed.

mod shared;

use concordem_scenario::sampling::Record;
use shared::simulation;

/// Eight bonded spheres on a cubic lattice in a cell that is sheared and stretched; `moved`: edges along x by which the second one is moved.
fn records(moved: f64, more: &str) -> Vec<Record> {
    let mut spheres = Vec::new();
    for k in 0..8 {
        let mut x = [k % 2, k / 2 % 2, k / 4].map(|n| 0.02 * f64::from(n) + 0.005);
        if k == 1 {
            x[0] += 0.04 * moved;
        }
        spheres.push(format!("[{}, {}, {}, 0.01]", x[0], x[1], x[2]));
    }
    let mut run = simulation(&format!(
        "version = 1
        [packing]
        kind = \"spheres\"
        cell = [0.04, 0.04, 0.04]
        spheres = [{}]
        [[material]]
        name = \"a\"
        density = 2500
        linear_bond = {{ normal_stiffness = 1e5, shear_stiffness = 4e4 }}
        [bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.01
        [contacts]
        law = \"none\"
        [loading]
        kind = \"cell-strain\"
        velocity_gradient = [[0, 1, 0], [0, 0, 0], [0, 0, 0.5]]
        [output]
        sample_interval = 100
        [stop]
        steps = 1000
        [integration]
        time_step = \"1 us\"
        {more}",
        spheres.join(", ")
    ));
    let mut all = Vec::new();
    while run.stopped().is_none() {
        all.extend(run.advance().unwrap().sample);
    }
    all
}

/// A sphere listed in the next cell changes nothing, and the work of the boundary is what the content stores and moves with: the kinetic energy of
/// the mean motion, 1.7e-5 J, is in neither. With damping, which acts on the relative motion alone, damped energy is added.
#[test]
fn energies_are_those_of_the_content() {
    for more in ["", "damping = { kind = \"local\", coefficient = 0.3 }"] {
        let [here, there] = [0.0, 1.0].map(|moved| records(moved, more));
        assert_eq!(here.len(), 10);
        for (a, b) in here.iter().zip(&there) {
            // Positions of 0.05 m are rounded by 1e-17 m; bonds stretch by 1e-5 m, and the energies are quadratic in it.
            // The kinetic energy of the mean motion, 1e-5 J, is rounded by 1e-21 J.
            let scale = a.boundary_work.abs().max(1e-9);
            assert!((a.kinetic - b.kinetic).abs() < 1e-9 * scale, "{} {}", a.kinetic, b.kinetic);
            assert!(
                (a.boundary_work - b.boundary_work).abs() < 1e-9 * scale,
                "{} {}",
                a.boundary_work,
                b.boundary_work
            );
            assert!((a.numerical_damping - b.numerical_damping).abs() < 1e-9 * scale);
            // Spheres that shear drives turn with up to 1 rad/s, twice the mean rotation: 8 · ½ I ω², I = 0.4 m r².
            let turning = 4.0 * 0.4 * 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * 1e-10;
            assert!(a.kinetic < 1.1 * turning, "{} {turning}", a.kinetic);
            assert!(a.numerical_damping >= 0.0, "{}", a.numerical_damping);
            let content = a.kinetic + a.stored_normal + a.stored_shear + a.numerical_damping;
            assert!((a.boundary_work - content).abs() < 1e-9 * scale, "{} {content}", a.boundary_work);
        }
        let last = here.last().unwrap();
        assert!(last.boundary_work > 1e-7, "{}", last.boundary_work);
    }
}

/// A cell that deforms fast with local damping ends by no guard: damping that follows the mean motion does not create energy.
#[test]
fn a_fast_cell_with_damping_runs() {
    let mut run = simulation(
        "version = 1
        [packing]
        kind = \"random-dense\"
        count = 60
        radius = \"1 mm\"
        seed = 1
        shape = { kind = \"periodic\" }
        [[material]]
        name = \"concrete\"
        density = 4800
        cpm = { young = 25e9, shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = 30, cohesion = 3e6, friction_coefficient = 0.8 }
        [bonds]
        law = \"cpm\"
        interaction_ratio = 1.5
        [contacts]
        law = \"cpm\"
        [integration]
        damping = { kind = \"local\", coefficient = 0.3 }
        [loading]
        kind = \"cell-strain\"
        velocity_gradient = [[0, 0, 0], [0, 0, 0], [0, 0, 2000]]
        [stop]
        strain = 2
        ",
    );
    let mut lowest = 0.0_f64;
    while run.stopped().is_none() {
        if let Some(record) = run.advance().unwrap().sample {
            lowest = lowest.min(record.numerical_damping);
        }
    }
    assert!(lowest >= 0.0, "{lowest}");
}
