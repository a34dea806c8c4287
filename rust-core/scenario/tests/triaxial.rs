//! Cells whose axes follow a stress or a strain rate, against the elastic constants of an fcc lattice.

use std::path::Path;

use concordem_contact::math::Vec3;
use concordem_scenario::assembly::assemble;
use concordem_scenario::schedule::{Simulation, StopReason};
use concordem_scenario::schema::Scenario;

/// Stiffness of the bonds, N/m; distance of neighbors, m.
const STIFFNESS: f64 = 1e6;
const DISTANCE: f64 = 0.02;

/// An fcc cell of 4·2³ spheres with central springs.
fn fcc(loading: &str) -> String {
    format!(
        "version = 1
        [packing]
        kind = \"lattice\"
        lattice = \"fcc\"
        radius = {}
        repeats = [2, 2, 2]
        shape = {{ kind = \"periodic\" }}
        [[material]]
        name = \"m\"
        density = 2500
        linear_bond = {{ normal_stiffness = {STIFFNESS}, shear_stiffness = 0 }}
        [bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.01
        [contacts]
        law = \"none\"
        [integration]
        damping = {{ kind = \"local\", coefficient = 0.3 }}
        [output]
        sample_interval = 50
        {loading}",
        0.5 * DISTANCE
    )
}

/// Consolidated to 100 kPa, then compressed along z at constant lateral stress. Of the 12 bonds of a sphere 8 have `n_x² = 1/2`, so
/// that `C11 = √2 k/d` and `C12 = C11/2`: the slope is `E = C11 − 2 C12²/(C11 + C12) = 2/3 C11`.
#[test]
fn lateral_stress_stays_while_the_axis_moves() {
    let text = fcc("[loading]
        kind = \"cell-stress\"
        stress = [[-1e5, 0, 0], [0, -1e5, 0], [0, 0, -1e5]]
        strain_rate = [\"free\", \"free\", -0.004]
        maximum_strain_rate = 5
        tolerance = 1e-4
        [[stage]]
        name = \"consolidate\"
        control = \"stress\"
        stop = { unbalanced = 1e-4 }
        [[stage]]
        name = \"compress\"
        stop = { time = 0.5 }
        [[stage]]
        name = \"expand\"
        rate = -0.5
        stop = { time = 0.5 }
        [[stage]]
        name = \"hold\"
        rate = 0
        stop = { time = 2e-3 }");
    let scenario = Scenario::parse("test.toml", &text).unwrap_or_else(|error| panic!("{error}"));
    let assembly = assemble(&scenario, Path::new(""), &mut |_, _| ()).unwrap_or_else(|error| panic!("{error}"));
    let mut run = Simulation::new(assembly.state, assembly.model, assembly.schedule).unwrap();
    let modulus = 2.0 / 3.0 * 2_f64.sqrt() * STIFFNESS / DISTANCE;
    let (mut stage, mut at_end) = (0, Vec::new());
    let (mut start, mut volume) = (0.0, 0.0);
    loop {
        let advance = run.advance().unwrap();
        if let Some(record) = advance.sample {
            let cell = run.state.cell.unwrap();
            let stress = run.last_report().virial / cell.volume();
            if stage > 0 {
                // Ten times the stress of the strain in one step.
                for (i, j) in [(0, 0), (1, 1)] {
                    assert!((stress[(i, j)] / -1e5 - 1.0).abs() < 5e-3, "{} {stage}: {stress}", record.time);
                }
            }
            // The mean of the two, of the volume before the step; and no change of volume that the cell does not have.
            let lateral = 0.5 * (stress[(0, 0)] + stress[(1, 1)]);
            assert!(
                (record.lateral_stress - lateral).abs() <= 1e-3 * lateral.abs(),
                "{} {lateral}",
                record.lateral_stress
            );
            at_end = vec![record.strain, record.stress, record.volumetric_strain];
        }
        if let Some(end) = advance.stage {
            if stage == 0 {
                (start, volume) = (at_end[0], at_end[2]);
                assert!((at_end[1] / -1e5 - 1.0).abs() < 5e-3, "{at_end:?}");
            } else {
                let expected = if stage == 1 { -2e-3 } else { -1e-3 };
                // The last record lies up to 50 steps before the end of the stage.
                assert!((at_end[0] - start - expected).abs() < 4e-5, "{at_end:?} {start}");
                // ν = C12/(C11 + C12) = 1/3, so the volume changes by a third of the strain; the lateral stress lags by 0.5 % of 100 kPa, 1 % of this.
                let ratio = (at_end[2] - volume) / (at_end[0] - start);
                assert!((3.0 * ratio - 1.0).abs() < 3e-2, "stage {stage}: {ratio}");
                let slope = (at_end[1] + 1e5) / (at_end[0] - start);
                // While it moves, the lateral stress lags by up to 0.5 % of 100 kPa, and the axial one by 2/3 of that over 47 kPa.
                // The initial stress of 0.2 % of the modulus changes the slope by some three times as much.
                let tolerance = if stage == 3 { 7e-3 } else { 1.4e-2 };
                assert!((slope / modulus - 1.0).abs() < tolerance, "stage {stage}: {slope} {modulus}");
            }
            assert_eq!(end.stage, stage);
            stage += 1;
        }
        if let Some(reason) = advance.stopped {
            assert_eq!((reason, stage), (StopReason::Stages, 4));
            break;
        }
    }
}

/// With two driven axes at rest the test is oedometric: the slope is `C11`, the lateral stress grows by half of the axial one.
#[test]
fn axes_at_rest_give_an_oedometer() {
    let text = fcc("[loading]
        kind = \"cell-stress\"
        stress = [[0, 0, 0], [0, -1e5, 0], [0, 0, 0]]
        strain_rate = [0, \"free\", 0]
        maximum_strain_rate = 5
        [stop]
        unbalanced = 1e-5");
    let scenario = Scenario::parse("test.toml", &text).unwrap_or_else(|error| panic!("{error}"));
    let assembly = assemble(&scenario, Path::new(""), &mut |_, _| ()).unwrap_or_else(|error| panic!("{error}"));
    let mut run = Simulation::new(assembly.state, assembly.model, assembly.schedule).unwrap();
    while run.advance().unwrap().stopped.is_none() {}
    let cell = run.state.cell.unwrap();
    let stress = run.last_report().virial / cell.volume();
    let strain = cell.deformation_gradient[(1, 1)] - 1.0;
    let expected = 2_f64.sqrt() * STIFFNESS / DISTANCE;
    // The servo's tolerance of 0.5 %, and strains of 1e-3.
    assert!((stress[(1, 1)] / strain / expected - 1.0).abs() < 5e-3, "{} {expected}", stress[(1, 1)] / strain);
    for axis in [0, 2] {
        assert!((stress[(axis, axis)] / stress[(1, 1)] - 0.5).abs() < 5e-3, "{stress}");
        assert_eq!(cell.deformation_gradient[(axis, axis)], 1.0);
    }
}

/// The lateral stress keeps its value at a rate of the axis so high that a gain alone leaves a lag: 32 % with a tenth of the error per
/// step, by a run without the lasting rate. Tolerance: the 1 % that a servo promises, 450 steps after the sudden start.
#[test]
fn a_fast_test_keeps_its_lateral_stress() {
    let text = fcc("[loading]
        kind = \"cell-stress\"
        stress = [[-1e5, 0, 0], [0, -1e5, 0], [0, 0, -1e5]]
        strain_rate = [\"free\", \"free\", -0.4]
        maximum_strain_rate = 5
        [[stage]]
        name = \"consolidate\"
        control = \"stress\"
        stop = { unbalanced = 1e-4 }
        [[stage]]
        name = \"compress\"
        stop = { steps = 900 }");
    let scenario = Scenario::parse("test.toml", &text).unwrap_or_else(|error| panic!("{error}"));
    let assembly = assemble(&scenario, Path::new(""), &mut |_, _| ()).unwrap_or_else(|error| panic!("{error}"));
    let mut run = Simulation::new(assembly.state, assembly.model, assembly.schedule).unwrap();
    let (mut begin, mut checked) = (None, 0);
    loop {
        let advance = run.advance().unwrap();
        if let (Some(record), Some(begin)) = (advance.sample, begin)
            && record.step > begin + 450.0
        {
            checked += 1;
            let stress = run.last_report().virial / run.state.cell.unwrap().volume();
            for axis in [0, 1] {
                assert!((stress[(axis, axis)] / -1e5 - 1.0).abs() < 1e-2, "{} steps: {stress}", record.step - begin);
            }
        }
        if advance.stage.is_some() && begin.is_none() {
            begin = Some(run.state.clock.step as f64);
        }
        if advance.stopped.is_some() {
            assert!(checked > 3, "{checked}");
            break;
        }
    }
}

/// What has no effect, or what leaves nothing to control, is refused.
#[test]
fn impossible_controls_are_refused() {
    let cell = |stress: &str, rate: &str, more: &str| {
        fcc(&format!(
            "[loading]\nkind = \"cell-stress\"\nstress = {stress}\nstrain_rate = {rate}\nmaximum_strain_rate = 5\n\
             [stop]\nsteps = 9\n{more}"
        ))
    };
    let zero = "[[0, 0, 0], [0, 0, 0], [0, 0, 0]]";
    for (text, words) in [
        (
            cell("[[0, 0, 0], [0, 0, 0], [0, 0, -1]]", "[\"free\", \"free\", 1]", ""),
            "this axis follows its strain rate",
        ),
        (cell(zero, "[0, 0, 1]", ""), "no axis is left"),
        (
            cell(
                zero,
                "[\"free\", \"free\", \"free\"]",
                "[[stage]]\nname = \"a\"\ncontrol = \"stress\"\nstop = { steps = 2 }",
            ),
            "all axes follow their stress",
        ),
        (
            fcc("[loading]\nkind = \"cell-strain\"\nvelocity_gradient = [[0, 0, 0], [0, 0, 0], [0, 0, 1]]\n\
                 [[stage]]\nname = \"a\"\ncontrol = \"stress\"\nstop = { steps = 2 }"),
            "no axes that follow their stress",
        ),
    ] {
        let message = Scenario::parse("test.toml", &text).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
}

/// A specimen between plates, in a cylinder that it touches as it widens, in a box, and under a membrane: the stress across the axis is that of the forces of all
/// contacts with the sides, and the pressure. Tolerance: rounding of some hundred forces.
#[test]
fn walls_and_membranes_press_on_the_sides() {
    let cylinder = "[[wall]]
        material = \"m\"
        shape = { kind = \"cylinder\", center = [0, 0, 0], axis = \"z\", radius = 0.01100001, side = \"inside\" }";
    let box_of_planes = "[[wall]]
        material = \"m\"
        shape = { kind = \"box\", minimum = [-0.0108996, -0.0108997, -1], maximum = [0.0108996, 0.0108997, 1] }";
    let membrane = "[[membrane]]\npressure = 2e5\nopen_along = \"z\"";
    for (sides, is_round) in [(cylinder, true), (box_of_planes, false), (membrane, false)] {
        let text = format!(
            "version = 1
            [packing]
            kind = \"lattice\"
            lattice = \"fcc\"
            radius = 1e-3
            shape = {{ kind = \"cylinder\", radius = 0.011, height = 0.022 }}
            [[material]]
            name = \"m\"
            density = 2500
            linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 5e5 }}
            frictional = {{ normal_stiffness = 1e6, shear_stiffness = 5e5, friction_coefficient = 0.3 }}
            [bonds]
            law = \"linear_bond\"
            interaction_ratio = 1.05
            [contacts]
            law = \"frictional\"
            [loading]
            kind = \"platens\"
            axis = \"z\"
            closing_velocity = 0.1
            material = \"m\"
            [stop]
            steps = 300
            {sides}"
        );
        let scenario = Scenario::parse("test.toml", &text).unwrap_or_else(|error| panic!("{error}"));
        let assembly = assemble(&scenario, Path::new(""), &mut |_, _| ()).unwrap_or_else(|error| panic!("{error}"));
        let mut run = Simulation::new(assembly.state, assembly.model, assembly.schedule).unwrap();
        let last = loop {
            if let Some(last) = run.advance().unwrap().last {
                break last;
            }
        };
        if sides == membrane {
            assert_eq!(last.lateral_stress, -2e5);
            continue;
        }
        let walls = run.solver.record(&mut run.state).unwrap().walls;
        let [low, high] = [0, 1].map(|k| run.state.walls[run.state.walls.len() - 2 + k].distance(0, &Vec3::zeros()));
        let pressure = |wall: usize, area: f64| {
            let of_wall = (0..walls.force.len()).filter(|k| walls.wall[*k] as usize == wall);
            let across = |k: usize| {
                let (point, force) = (walls.point[k], walls.force[k]);
                if is_round { -force.dot(&Vec3::new(point.x, point.y, 0.0).normalize()) } else { force.abs().max() }
            };
            // On a plane the normal force is the largest one: nothing slides yet.
            of_wall.map(across).sum::<f64>() / area
        };
        let height = low + high;
        let expected = if is_round {
            pressure(0, 2.0 * std::f64::consts::PI * 0.01100001 * height)
        } else {
            let areas = [0.0217994, 0.0217994, 0.0217992, 0.0217992].map(|width| width * height);
            (0..4).map(|wall| pressure(wall, areas[wall])).sum::<f64>() / 4.0
        };
        assert!(
            expected > 1e3 && (last.lateral_stress / -expected - 1.0).abs() < 1e-6,
            "{expected} {}",
            last.lateral_stress
        );
        assert!(last.volumetric_strain != 0.0);
    }
}
