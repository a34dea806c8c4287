//! Does a pair keep its energy when its bond breaks, and go on from there as any other contact?

use std::fmt::Write as _;
use std::path::Path;

use concordem::assembly::assemble;
use concordem::math::Vec3;
use concordem::scenario::Scenario;
use concordem::schedule::Simulation;

fn simulation(text: &str) -> Simulation {
    let scenario = Scenario::parse("test.toml", text).unwrap_or_else(|error| panic!("{error}"));
    let assembly = assemble(&scenario, Path::new(""), &mut |_, _| ()).unwrap_or_else(|error| panic!("{error}"));
    Simulation::new(assembly.state, assembly.model, assembly.schedule).expect("a sound state")
}

/// Two spheres of 1 mm with a bond, `distance` (m) apart along x; the second one moves with `velocity`.
fn pair(distance: f64, bonds: &str, contacts: &str, tables: &str, velocity: [f64; 3]) -> String {
    format!(
        "version = 1
        [packing]
        kind = \"spheres\"
        spheres = [[0, 0, 0, 1e-3], [{distance}, 0, 0, 1e-3]]
        [[material]]
        name = \"m\"
        density = 2500
        {tables}
        [bonds]
        law = \"{bonds}\"
        interaction_ratio = 1.1
        [contacts]
        law = \"{contacts}\"
        [[set]]
        name = \"second\"
        selection = {{ kind = \"ids\", ids = [1] }}
        [[initial]]
        set = \"second\"
        velocity = {velocity:?}
        [integration]
        time_step = 2e-8
        [stop]
        steps = 4000
        [output]
        sample_interval = 1
        "
    )
}

const STIFF: &str = "frictional = { normal_stiffness = 2e7, shear_stiffness = 1e7, friction_coefficient = 0.5 }";
const BOND: &str =
    "linear_bond = { normal_stiffness = 1e6, shear_stiffness = 5e5, normal_strength = 5, shear_strength = 0.3";

/// Bonds that break under pressure, or between spheres that overlap, hand over no more energy than they release: neither a
/// stiffer contact, nor the overlap of the spheres makes any. Tolerance 2e-3: under pressure half of the normal work of the
/// breaking step is not done, 4e-4 of the energy in the first case with some hundred steps to the break.
#[test]
fn a_broken_bond_makes_no_energy() {
    let soft = "frictional = { normal_stiffness = 2e5, shear_stiffness = 1e5 }";
    let hertz = "hertz_mindlin = { young = 5e10, poisson = 0.2, friction_coefficient = 0.3, restitution = 1 }";
    let beam = "cohesive_beam = { young = 1e9, radius_ratio = 0.6, tensile_strength = 2e5 }";
    let cpm = "cpm = { young = 1e9, shear_ratio = 0.2, crack_onset_strain = 1e-5, relative_ductility = 3, cohesion = 1e4, \
               friction_coefficient = 0.3, omega_threshold = 0.5 }";
    let rock = "jointed = { young = 1e9, stiffness_ratio = 0.5, tensile_strength = 1e4, cohesion = 3e4, friction_coefficient = 0.3 }";
    // The bond breaks at a strain of -1.6e-4, far beyond the plastic limit of the contact that follows.
    let yielding = |mode: &str| {
        cpm.replace(" }", &format!(", soft_strain = -1e-5, relative_soft_stiffness = 0.3, mode = \"{mode}\" }}"))
    };
    let weak =
        "linear_bond = { normal_stiffness = 1e6, shear_stiffness = 5e5, normal_strength = 0.05, shear_strength = 1 }";
    let from_touch = ", subtract_initial_gap = false }";
    let (pressed, pulled) = ([-0.2, 0.4, 0.1], [0.05, 0.01, 0.0]);
    for (distance, bonds, contacts, tables, velocity) in [
        (2e-3, "linear_bond", "frictional", format!("{BOND} }}\n{STIFF}"), pressed),
        (2e-3, "linear_bond", "frictional", format!("{BOND} }}\n{soft}"), pressed),
        (2e-3, "linear_bond", "hertz_mindlin", format!("{BOND} }}\n{hertz}"), pressed),
        (2e-3, "linear_bond", "linear_bond", format!("{BOND} }}"), pressed),
        (1.9999e-3, "linear_bond", "frictional", format!("{BOND}{from_touch}\n{STIFF}"), pressed),
        (1.9e-3, "linear_bond", "frictional", format!("{BOND} }}\n{STIFF}"), pressed),
        (2e-3, "cohesive_beam", "frictional", format!("{beam}\n{STIFF}"), pressed),
        (2e-3, "cohesive_beam", "hertz_mindlin", format!("{beam}\n{hertz}"), pressed),
        (1.8e-3, "cpm", "frictional", format!("{cpm}\n{STIFF}"), pulled),
        (1.8e-3, "cpm", "hertz_mindlin", format!("{cpm}\n{hertz}"), pulled),
        (2e-3, "jointed", "jointed", rock.to_owned(), pressed),
        (2e-3, "jointed", "jointed", rock.to_owned(), pulled),
        (1.9e-3, "jointed", "jointed", rock.to_owned(), pressed),
        (1.9e-3, "jointed", "frictional", format!("{rock}\n{STIFF}"), pressed),
        (1.8e-3, "jointed", "hertz_mindlin", format!("{rock}\n{hertz}"), pulled),
        (1.9e-3, "linear_bond", "jointed", format!("{BOND} }}\n{rock}"), pressed),
        (1.9e-3, "linear_bond", "cpm", format!("{BOND} }}\n{cpm}"), pressed),
        (1.9e-3, "linear_bond", "cpm", format!("{weak}\n{cpm}"), pulled),
        (1.9e-3, "linear_bond", "cpm", format!("{BOND} }}\n{}", yielding("thesis")), pressed),
        (1.9e-3, "linear_bond", "cpm", format!("{BOND} }}\n{}", yielding("yade-public")), pressed),
    ] {
        let mut run = simulation(&pair(distance, bonds, contacts, &tables, velocity));
        let (mut before, mut broken) = (0.0_f64, 0.0);
        let name = format!("{bonds} {contacts} at {distance}");
        while run.stopped().is_none() {
            let advance = run.advance().unwrap_or_else(|error| panic!("{name}: {error}"));
            let record = advance.sample.expect("a record");
            let ledger = &run.state.ledger;
            // What a contact takes back of its bond is a part of what that released.
            assert!(
                record.damage > -1e-6 * ledger.initial,
                "{name}: damage {:e} of {:e}",
                record.damage,
                ledger.initial
            );
            let made = ledger.created() / ledger.initial;
            assert!(made < 2e-3, "{name}: {made:e} made at step {}", record.step);
            (before, broken) = (before.max(record.damage), record.broken);
        }
        assert!(broken == 1.0 && before > 0.0, "{name}: the bond must break");
    }
}

/// The faces of a crack touch where they parted, also those of the concrete law, whose other contacts begin unstrained at the
/// distance of their first step: spheres that overlap, pulled apart and pushed back, meet again at the bond's unstrained length.
/// Tolerance: a step of the motion, 0.05 m/s times 20 ns.
#[test]
fn crack_faces_of_overlapping_spheres_meet_where_they_parted() {
    let cpm = "cpm = { young = 1e9, shear_ratio = 0.2, crack_onset_strain = 1e-5, relative_ductility = 3, cohesion = 1e4, \
               friction_coefficient = 0.3 }";
    let bond =
        "linear_bond = { normal_stiffness = 1e6, shear_stiffness = 5e5, normal_strength = 0.05, shear_strength = 1 }";
    for (contacts, table) in [("cpm", cpm), ("frictional", STIFF)] {
        let text = pair(1.9e-3, "linear_bond", contacts, &format!("{bond}\n{table}"), [0.05, 0.0, 0.0])
            .replace("[integration]", "[integration]\nallow_energy_error = true");
        let mut run = simulation(&text);
        let distance = |run: &Simulation| (run.state.particles.position[1] - run.state.particles.position[0]).norm();
        while run.state.broken.is_empty() {
            assert!(run.stopped().is_none(), "{contacts}: the bond must break");
            run.advance().expect("a step");
        }
        // Some steps apart without a force, then back.
        for _ in 0..10 {
            run.advance().expect("a step");
            assert_eq!(run.solver.forces()[0], Vec3::zeros(), "{contacts}: apart");
        }
        assert!(distance(&run) < 2e-3, "the spheres still overlap");
        // From here on the ledger does not know the energy.
        run.state.particles.velocity[0] = Vec3::zeros();
        run.state.particles.velocity[1] = Vec3::new(-0.05, 0.0, 0.0);
        while run.solver.forces()[0] == Vec3::zeros() {
            assert!(run.stopped().is_none(), "{contacts}: the faces must meet");
            run.advance().expect("a step");
        }
        let met = distance(&run);
        assert!((met - 1.9e-3).abs() < 2.1e-9, "{contacts}: met at {met:e}");
    }
}

/// A contact of the concrete law is unstrained at the distance at which it begins, to the last bit and in every kinematics:
/// spheres that approach push each other from the next step on, whatever the direction.
#[test]
fn concrete_contacts_begin_unstrained_in_every_direction() {
    for kinematics in ["finite", "first-order", "yade", "yade-ratcheting"] {
        for k in 0..100 {
            let direction = concordem_tests::noise_vector(k, 3).normalize();
            // Not a multiple of the way of a step, so that rounding does not decide when they meet.
            let x = direction * 2.00105e-3;
            let mut text = format!(
                "version = 1
                kinematics = \"{kinematics}\"
                [packing]
                kind = \"spheres\"
                spheres = [[0, 0, 0, 1e-3], [{:?}, {:?}, {:?}, 1e-3]]
                [[material]]
                name = \"m\"
                density = 2500
                cpm = {{ young = 1e9, shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = 3, cohesion = 1e5, \
                 friction_coefficient = 0.3 }}
                [contacts]
                law = \"cpm\"
                [[set]]
                name = \"second\"
                selection = {{ kind = \"ids\", ids = [1] }}
                [integration]
                time_step = 1e-7
                [stop]
                steps = 100
                [[initial]]
                set = \"second\"
                ",
                x.x, x.y, x.z
            );
            let v: Vec3 = -direction;
            let _ = writeln!(text, "velocity = [{:?}, {:?}, {:?}]", v.x, v.y, v.z);
            let mut run = simulation(&text);
            let (mut touches, mut pushes) = (None, None);
            while run.stopped().is_none() {
                let distance = (run.state.particles.position[1] - run.state.particles.position[0]).norm();
                let step = run.state.clock.step;
                run.advance().expect("a step");
                touches = touches.or((distance < 2e-3).then_some(step));
                pushes = pushes.or((run.solver.forces()[0] != Vec3::zeros()).then_some(step));
            }
            let touches = touches.expect("they meet");
            assert_eq!(pushes, Some(touches + 1), "{kinematics}, direction {direction}");
        }
    }
}
