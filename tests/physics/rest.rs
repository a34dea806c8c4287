//! A system counts as at rest only if forces and moments balance.

use concordem::law::LinearBond;
use concordem::math::Vec3;
use concordem::schedule::StopReason;
use concordem::solver::{Model, time_step};
use concordem::state::{Cell, Constraint, Particles, Sphere};
use concordem::statics::relaxed::{Relaxation, relaxed_stiffness};
use concordem::statics::{Accuracy, ElasticConstants, LinkNetwork, cell_stiffness};
use concordem_tests::runs::run;
use concordem_tests::{bonded, on_threads};

/// A chain of ten spheres is pulled and twisted at its tip. Tension settles first; a criterion of forces alone ended
/// the run at 65 % of the twist `9 M l₀/(G I_O)`. With a remaining net moment of 1e-6 of 2 N·mm, and a softest mode
/// whose share of the rotation of the tip is 6 times its share of the load, the twist is within 1e-5.
#[test]
fn a_twisted_chain_is_not_at_rest_before_it_has_twisted() {
    let spheres: Vec<[f64; 4]> = (0..10).map(|k| [2e-3 * f64::from(k), 0.0, 0.0, 1e-3]).collect();
    let simulation = run(&format!(
        "version = 1
        [packing]
        kind = \"spheres\"
        spheres = {spheres:?}
        [[material]]
        name = \"beam\"
        density = 2500
        cohesive_beam = {{ young = \"1 GPa\", poisson = 0.25, radius = \"1 mm\" }}
        [bonds]
        law = \"cohesive_beam\"
        interaction_ratio = 1.01
        [contacts]
        law = \"none\"
        [[set]]
        name = \"held\"
        selection = {{ kind = \"ids\", ids = [0] }}
        [[prescribe]]
        set = \"held\"
        velocity = [0, 0, 0]
        angular_velocity = [0, 0, 0]
        [[set]]
        name = \"tip\"
        selection = {{ kind = \"ids\", ids = [9] }}
        [[force]]
        set = \"tip\"
        force = [\"1 N\", 0, 0]
        moment = [\"1 N*mm\", 0, 0]
        [integration]
        damping = {{ kind = \"local\", coefficient = 0.5, rotation = 0.02 }}
        [stop]
        unbalanced = 1e-6
        steps = 400000"
    ));
    assert_eq!(simulation.stopped(), Some(StopReason::Equilibrium));
    // G I_O = E/(2(1+ν)) π r⁴/2
    let stiffness = 1e9 / 2.5 * std::f64::consts::FRAC_PI_2 * 1e-12;
    let exact = 9.0 * 1e-3 * 2e-3 / stiffness;
    let tip = simulation.state.particles.id.iter().position(|id| *id == 9).unwrap();
    let orientation = simulation.state.particles.orientation[tip];
    let twist = 2.0 * orientation.i.atan2(orientation.w);
    println!("twist {:.7} of the exact one after {} steps", twist / exact, simulation.state.clock.step);
    assert!((twist / exact - 1.0).abs() < 1e-5, "{twist} {exact}");
}

/// A kagome lattice of discs relaxes by rotations only: net forces vanish by symmetry from the first step. A criterion of
/// forces alone accepted ν = 0.383 at step 51; statics gives 1/3.
#[test]
fn rotations_of_a_kagome_lattice_relax() {
    let radius = 0.05;
    let (a, b) = (Vec3::new(0.2, 0.0, 0.0), Vec3::new(0.1, 0.1 * 3.0_f64.sqrt(), 0.0));
    let mut particles = Particles::default();
    for i in 0..3 {
        for j in 0..4 {
            let corner = a * f64::from(i) + b * f64::from(j);
            for site in [Vec3::zeros(), a * 0.5, b * 0.5] {
                particles.push(Sphere { position: corner + site, radius }, 0, 1.0, 0.5 * radius * radius);
            }
        }
    }
    particles.constraint.fill(Constraint::translation_along(2).with(Constraint(0b011_000)));
    let mut cell = Cell::new_box(Vec3::repeat(1.0));
    cell.matrix.set_column(0, &(a * 3.0));
    cell.matrix.set_column(1, &(b * 4.0));
    let bond = LinearBond::new(1.0, 0.4, 0.0, f64::INFINITY, f64::INFINITY).unwrap();
    let mut state = bonded(particles, Some(cell), bond, 1.01);
    state.clock.dt = 0.8 * time_step::bounds(&state).spectral;
    let network = LinkNetwork::of_state(&state).unwrap();
    let statics = cell_stiffness(&network, Accuracy::default()).unwrap();
    let exact = ElasticConstants::of_plane(&statics.relaxed).unwrap();
    let (found, steps) = on_threads(1, || relaxed_stiffness(&state, &Model::default(), Relaxation::default())).unwrap();
    let found = ElasticConstants::of_plane(&found).unwrap();
    println!("ν {:.6} dynamic after {steps} steps, {:.6} static", found.mean_poisson, exact.mean_poisson);
    assert!((exact.mean_poisson - 1.0 / 3.0).abs() < 1e-6, "{}", exact.mean_poisson);
    // Tolerance as for other packings: strains of 1e-7, and net forces of 1e-6.
    assert!((found.mean_poisson - exact.mean_poisson).abs() < 2e-6, "{} {}", found.mean_poisson, exact.mean_poisson);
}

/// A servo with target stress zero ends: at once if there is no stress, and with overlapping spheres when the cell has
/// expanded until they hardly overlap.
#[test]
fn a_servo_reaches_zero_stress() {
    let text = |spheres: &str, law: &str| {
        format!(
            "version = 1
            {spheres}
            [[material]]
            name = \"m\"
            density = 2500
            {law}
            [integration]
            damping = {{ kind = \"local\", coefficient = 0.3 }}
            [loading]
            kind = \"cell-stress\"
            stress = [[0, 0, 0], [0, 0, 0], [0, 0, 0]]
            maximum_strain_rate = 1
            [stop]
            unbalanced = 1e-3
            steps = 200000"
        )
    };
    let lattice = "[packing]\nkind = \"lattice\"\nlattice = \"fcc\"\nradius = 1e-3\nrepeats = [3, 3, 3]\nshape = { kind = \"periodic\" }";
    let bonds = "linear_bond = { normal_stiffness = 1e5, shear_stiffness = 1e4 }
        [bonds]\nlaw = \"linear_bond\"\ninteraction_ratio = 1.1\n[contacts]\nlaw = \"none\"";
    let free = run(&text(lattice, bonds));
    assert_eq!(free.stopped(), Some(StopReason::Equilibrium));
    assert!(free.state.clock.step < 100, "{}", free.state.clock.step);
    // Eight spheres on a lattice that is 0.2 % too small overlap by 0.4 % of the radius: at k/2R = 5e7 Pa a pressure of
    // about 2e5 Pa.
    let places = (0..8).map(|k| [k % 2, k / 2 % 2, k / 4].map(|i| 1.996e-3 * f64::from(i)));
    let spheres: Vec<[f64; 4]> = places.map(|[x, y, z]| [x, y, z, 1e-3]).collect();
    let pressed =
        format!("[packing]\nkind = \"spheres\"\nspheres = {spheres:?}\ncell = [3.992e-3, 3.992e-3, 3.992e-3]");
    let contacts = "frictional = { normal_stiffness = 1e5, shear_stiffness = 1e4, friction_coefficient = 0.5 }
        [contacts]\nlaw = \"frictional\"";
    let grown = run(&text(&pressed, contacts));
    assert_eq!(grown.stopped(), Some(StopReason::Equilibrium));
    let edge = grown.state.cell.unwrap().matrix[(0, 0)];
    // The remaining stress is within 0.5 % of the stress at the strain 1e-4 with the upper bound on the stiffness,
    // which is three times the stiffness along x, because Σkl²/V counts the contacts along all axes.
    println!("edge {edge:.9e} m after {} steps", grown.state.clock.step);
    assert!((edge / 4e-3 - 1.0).abs() < 1.5e-6 || edge > 4e-3, "{edge}");
    assert!(edge < 4.01e-3, "{edge}");
}
