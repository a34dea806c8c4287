//! Histories, stages, and operators on sets: closed forms, and the same bits after a restart.

mod shared;

use std::f64::consts::PI;

use concordem_contact::math::Vec3;
use concordem_scenario::sampling::Record;
use concordem_scenario::schedule::{Advance, Simulation, StageReason, StopReason};
use concordem_scenario::schema::Scenario;

use shared::{SPRING, bonded, number, place, set, simulation, spheres};

/// All steps of a run to its end.
fn run(simulation: &mut Simulation) -> Vec<Advance> {
    let mut all = Vec::new();
    while all.last().is_none_or(|advance: &Advance| advance.stopped.is_none()) {
        all.push(simulation.advance().unwrap());
    }
    all
}

/// Rows of a quantity of the operator `name`: step and values.
fn rows(simulation: &Simulation, steps: &[Advance], name: &str, quantity: &str) -> Vec<(u64, Vec<f64>)> {
    let operators = &simulation.schedule.operators;
    let k = number(operators, name);
    let range = place(&operators[k], quantity);
    let all = steps.iter().flat_map(|advance| &advance.operators).filter(|row| row.operator == k);
    all.map(|row| (row.step, row.values[range.clone()].to_vec())).collect()
}

/// A chain of `count` touching spheres of radius 10 mm along x, bonded by springs of 1 MN/m, with the sets of its ends.
fn chain(count: usize, more: &str) -> String {
    let places: Vec<[f64; 4]> = (0..count).map(|k| [0.02 * k as f64, 0.0, 0.0, 0.01]).collect();
    bonded(&spheres(&places), "linear_bond", SPRING) + &set("first", &[0]) + &set("last", &[count - 1]) + more
}

/// A motion that turns back from one step to the next has the kinetic energy `½ m v⁻·v⁺ < 0` for an instant. Here this is 400 times
/// the stored energy; still it is no instability, and the run goes on.
#[test]
fn a_motion_that_turns_back_is_stable() {
    let text = chain(
        2,
        "[integration]\ntime_step = 1e-6
        [stop]\nsteps = 20
        [output]\nsample_interval = 1",
    ) + "
        [[history]]
        name = \"to and fro\"
        shape = { kind = \"table\", points = [[0, 0], [5e-6, 1], [10e-6, 0]], repeat = true }
        [[prescribe]]
        set = \"last\"
        displacement = [1e-6, \"free\", \"free\"]
        history = \"to and fro\"";
    let mut simulation = simulation(&text);
    let steps = run(&mut simulation);
    let kinetic = steps.iter().filter_map(|step| step.sample.as_ref()).map(|record| record.kinetic);
    assert!(kinetic.fold(0.0, f64::min) < -1e-4, "the motion must turn back at a record");
    assert_eq!(simulation.state.clock.step, 20);
}

/// The same with a cell whose rate turns back: its particles, listed far from the origin, follow with 50 m/s.
#[test]
fn a_cell_that_turns_back_is_stable() {
    let pair = spheres(&[[0.51, 0.01, 0.01, 0.01], [0.53, 0.01, 0.01, 0.01]]) + "\ncell = [0.1, 0.1, 0.1]";
    let text = bonded(&pair, "linear_bond", SPRING)
        + "
        [integration]\ntime_step = 1e-6
        [stop]\nsteps = 20
        [output]\nsample_interval = 1
        [[history]]
        name = \"to and fro\"
        shape = { kind = \"table\", points = [[0, 1], [2e-6, -1], [4e-6, 1]], repeat = true }
        [loading]
        kind = \"cell-strain\"
        velocity_gradient = [[0, 0, 0], [100, 0, 0], [0, 0, 0]]
        [[stage]]
        name = \"shear\"
        stop = { steps = 20 }
        history = \"to and fro\"";
    let mut simulation = simulation(&text);
    let mut lowest = 0.0_f64;
    while simulation.stopped().is_none() {
        simulation.advance().unwrap();
        // With the mean motion of the cell, by which the guard judges.
        lowest = lowest.min(simulation.state.ledger.kinetic);
    }
    assert!(lowest < -1.0, "the cell must turn back at a record");
    assert_eq!(simulation.state.clock.step, 20);
}

/// A displacement that follows a table reaches every value of the table; the reaction is that of a spring, and both end sets
/// see it with opposite signs. Local damping lets the single free particle follow.
#[test]
fn displacements_follow_tables() {
    let text = chain(
        2,
        "[integration]\ntime_step = 1e-6
        [stop]\nsteps = 3000
        [output]\nsample_interval = 100",
    ) + "
        [[history]]
        name = \"up and down\"
        shape = { kind = \"table\", points = [[0, 0], [\"1 ms\", 1], [\"2 ms\", 1], [\"3 ms\", -0.5]] }
        [[prescribe]]
        set = \"first\"
        velocity = [0, 0, 0]
        [[prescribe]]
        set = \"last\"
        velocity = [\"free\", 0, 0]
        displacement = [\"0.01 mm\", \"free\", \"free\"]
        history = \"up and down\"
        [[sample]]
        operator = \"set-motion\"
        set = \"last\"
        [[sample]]
        operator = \"set-force\"
        set = \"last\"
        [[sample]]
        name = \"support\"
        operator = \"set-force\"
        set = \"first\"
        [[sample]]
        operator = \"gauge\"
        sets = [\"first\", \"last\"]";
    let mut simulation = simulation(&text);
    let steps = run(&mut simulation);
    let displacement = rows(&simulation, &steps, "set-motion", "displacement");
    let reaction = rows(&simulation, &steps, "set-force", "reaction");
    let force = rows(&simulation, &steps, "set-force", "force");
    let support = rows(&simulation, &steps, "support", "reaction");
    let elongation = rows(&simulation, &steps, "gauge", "elongation");
    let strain = rows(&simulation, &steps, "gauge", "strain");
    assert_eq!(displacement.len(), 31);
    let points = [(0, 0.0), (500, 0.5e-5), (1000, 1e-5), (1500, 1e-5), (2000, 1e-5), (2500, 0.25e-5), (3000, -0.5e-5)];
    for (step, expected) in points {
        let at = displacement.iter().position(|row| row.0 == step).unwrap();
        // The position of 20 mm rounds by 3e-18 m in each of 3000 steps.
        assert!((displacement[at].1[0] - expected).abs() < 1e-14, "step {step}: {:?}", displacement[at]);
        assert!((elongation[at].1[0] - expected).abs() < 1e-14);
        assert!((strain[at].1[0] - expected / 0.02).abs() < 1e-12);
        let spring = 1e6 * expected;
        // The reaction is that of the held degrees of freedom alone.
        for (row, sign) in [(&reaction, 1.0), (&force, -1.0), (&support, -1.0)] {
            assert!((row[at].1[0] - sign * spring).abs() < 1e-6, "step {step}: {:?}, {spring}", row[at]);
        }
    }
}

/// A factor that does not start at zero does not move the particles at the start: a cosine from 1 to −1 displaces by −2.
/// Tolerance: roundings of 20 mm in 1000 steps.
#[test]
fn displacements_start_at_the_packing() {
    let text = chain(2, "[integration]\ntime_step = 1e-6\n[stop]\nsteps = 1000")
        + "
        [[history]]
        name = \"cosine\"
        shape = { kind = \"sine\", period = \"2 ms\", phase = \"90 deg\" }
        [[prescribe]]
        set = \"last\"
        displacement = [\"0.01 mm\", 0, 0]
        history = \"cosine\"";
    let mut simulation = simulation(&text);
    run(&mut simulation);
    assert!((simulation.state.particles.position[1].x - (0.02 - 2e-5)).abs() < 1e-14);
}

/// A free particle under `F sin(2πt/T)` has the momentum `F T/π` after half a period, and none after a whole one. Leapfrog sums
/// the force at its steps: an error of `(π/n)²/3` of n steps per half period.
#[test]
fn forces_follow_histories() {
    let text = "version = 1
        [packing]
        kind = \"spheres\"
        spheres = [[0, 0, 0, 0.01], [1, 0, 0, 0.01]]
        [[material]]
        name = \"m\"
        density = 2500
        [contacts]
        law = \"none\"
        [integration]
        time_step = 1e-6
        [[set]]
        name = \"one\"
        selection = { kind = \"ids\", ids = [0] }
        [[set]]
        name = \"both\"
        selection = { kind = \"all\" }
        [[history]]
        name = \"wave\"
        shape = { kind = \"sine\", period = \"2 ms\" }
        [[force]]
        set = \"one\"
        force = [0, 10, 0]
        history = \"wave\"
        [[force]]
        set = \"both\"
        force = [1, 0, 0]
        [[sample]]
        operator = \"set-motion\"
        set = \"one\"
        interval = 1000
        [stop]
        steps = 2000";
    let mut simulation = simulation(text);
    let mass = simulation.state.particles.mass[0];
    let steps = run(&mut simulation);
    let velocity = rows(&simulation, &steps, "set-motion", "velocity");
    let at = |step: u64| Vec3::from_column_slice(&velocity.iter().find(|row| row.0 == step).unwrap().1);
    let expected = 10.0 * 2e-3 / PI / mass;
    assert!((at(1000).y / expected - 1.0).abs() < 1e-5, "{} {expected}", at(1000).y);
    assert!(at(2000).y.abs() < 1e-5 * expected);
    // The constant force acts beside the changing one.
    assert!((at(2000).x / (2e-3 / mass) - 1.0).abs() < 1e-9);
}

/// A wall whose velocity follows a table has moved by its integral; forces that change do not disturb it.
#[test]
fn walls_follow_histories() {
    let text = "version = 1
        [packing]
        kind = \"spheres\"
        spheres = [[0, 0, 1, 0.01]]
        [[material]]
        name = \"m\"
        density = 2500
        frictional = { normal_stiffness = 1e5, shear_stiffness = 1e5 }
        [contacts]
        law = \"frictional\"
        [integration]
        time_step = 1e-5
        [[history]]
        name = \"there and back\"
        shape = { kind = \"table\", points = [[0, 0], [1e-3, 1], [3e-3, -1], [4e-3, 0]], smooth = true }
        [[wall]]
        shape = { kind = \"plane\", point = [0, 0, 0], normal = [0, 0, 1] }
        material = \"m\"
        velocity = [0, 0, 0.5]
        history = \"there and back\"
        [stop]
        steps = 400";
    let mut simulation = simulation(text);
    let mut highest: f64 = 0.0;
    loop {
        let stopped = simulation.advance().unwrap().stopped;
        highest = highest.max(simulation.state.walls[0].displacement.z);
        if stopped.is_some() {
            break;
        }
    }
    // 0.5 m/s · (½ + 11/16) ms: the smooth step from 0 to 1 has the mean ½; that from 1 to −1 over 2 ms has, up to its middle, the
    // integral (½ − 2·5/64)·2 ms.
    assert!((highest / (0.5 * 1.1875e-3) - 1.0).abs() < 1e-4, "{highest}");
    assert!(simulation.state.walls[0].displacement.z.abs() < 1e-9);
}

const CYCLE: &str = "
    [[stage]]
    name = \"load\"
    stop = { strain = 1e-4 }
    [[stage]]
    name = \"unload\"
    rate = -1
    stop = { stress = 0 }
    [[stage]]
    name = \"hold\"
    rate = 0
    stop = { time = \"1 ms\" }
    [[stage]]
    name = \"ramp\"
    rate = 2
    history = \"ramp\"
    stop = { steps = 1000 }
    [[history]]
    name = \"ramp\"
    shape = { kind = \"table\", points = [[0, 0], [\"0.5 ms\", 1]] }";

/// A chain that is pulled, released, held, and pulled again: every stage ends where it should. The mean of the two end forces
/// is that of the springs as long as waves are small beside it.
#[test]
fn stages_follow_each_other() {
    let text = cyclic();
    let mut simulation = simulation(&text);
    let steps = run(&mut simulation);
    let ends: Vec<(String, f64, u64)> =
        simulation.ended_stages().map(|(name, time, step)| (name.to_owned(), time, step)).collect();
    let names: Vec<&str> = ends.iter().map(|end| end.0.as_str()).collect();
    assert_eq!(names, ["load", "unload", "hold", "ramp"]);
    assert_eq!(steps.last().unwrap().stopped, Some(StopReason::Stages));
    let dt = simulation.state.clock.dt;
    // Strain 1e-4 at 0.1/s after 1 ms; records are due every 10 steps.
    assert!((ends[0].1 - 1e-3).abs() <= 11.0 * dt, "{ends:?}");
    assert!((ends[2].1 - ends[1].1 - 1e-3).abs() <= 11.0 * dt, "{ends:?}");
    assert_eq!(ends[3].2 - ends[2].2, 1000);
    let samples: Vec<Record> = steps.iter().filter_map(|advance| advance.sample).collect();
    let at = |time: f64| samples.iter().min_by(|a, b| (a.time - time).abs().total_cmp(&(b.time - time).abs())).unwrap();
    // Released to zero stress, it stays as long as it is held.
    let held = at(ends[1].1 + 0.5e-3).strain;
    assert!((at(ends[2].1).strain - held).abs() < 1e-15, "{held}");
    // Twice the rate after a ramp of 0.5 ms: 2·0.1·(0.25 + 0.5) ms.
    let last = samples.last().unwrap();
    let expected = held + 0.2 * (ends[3].1 - ends[2].1 - 0.25e-3);
    assert!((last.strain - expected).abs() < 11.0 * dt * 0.2, "{} {expected}", last.strain);
    // Positions of 0.1 m round by 1e-17 m in each of 4000 steps, under 3 N in each of four bonds: 5e-13 J of 2e-5 J at most.
    assert!(last.residual.abs() < 5e-13 && last.boundary_work > 1e-5, "{last:?}");
}

fn cyclic() -> String {
    chain(
        5,
        "[loading]\nkind = \"uniaxial\"\naxis = \"x\"\nstrain_rate = 0.1\nlayer_thickness = 0.015\narea = 1e-4\n[integration]\ntime_step = 1e-6\n",
    ) + CYCLE
}

/// A pair whose bond breaks at 1 N, the force at a strain of 5e-5: its run ends by `stop.drop_to` when that happens, and not before, while a
/// stage unloads or loads again. A stage that unloads may end at a fraction of the peak.
#[test]
fn an_unloaded_specimen_has_not_failed() {
    let strong = SPRING.replace(" }", ", normal_strength = 1, shear_strength = 100 }");
    let text = bonded(&spheres(&[[0.0, 0.0, 0.0, 0.01], [0.02, 0.0, 0.0, 0.01]]), "linear_bond", &strong)
        + "[loading]\nkind = \"uniaxial\"\naxis = \"x\"\nstrain_rate = 0.1\nlayer_thickness = 0.015\narea = 1e-4
        [integration]\ntime_step = 1e-6
        [output]\nsample_interval = 10
        [stop]\ndrop_to = 0.6
        [[stage]]\nname = \"load\"\nstop = { strain = 3e-5 }
        [[stage]]\nname = \"unload\"\nrate = -1\nstop = { drop_to = 0.2 }
        [[stage]]\nname = \"load again\"\nstop = { strain = 1e-3 }";
    for stop in [usize::MAX, 500] {
        let mut run = simulation(&text);
        let mut strain = Vec::new();
        let reason = loop {
            if strain.len() == stop {
                let fresh = simulation(&text);
                let (model, schedule) = (fresh.solver.model().clone(), fresh.schedule.clone());
                run = Simulation::new(run.state.clone(), model, schedule).unwrap();
            }
            let advance = run.advance().unwrap();
            strain.push(advance.sample.map_or(f64::NAN, |record| record.strain));
            if let Some(reason) = advance.stopped {
                break reason;
            }
        };
        assert_eq!(reason, StopReason::Drop);
        assert_eq!(run.ended_stages().map(|(name, ..)| name.to_owned()).collect::<Vec<_>>(), ["load", "unload"]);
        // Records are due every 10 steps, in which the strain grows by 1e-6.
        let last = strain.iter().rev().find(|strain| !strain.is_nan()).unwrap();
        assert!((5e-5..5.3e-5).contains(last), "{last:e}");
        let lowest = strain[400..].iter().copied().fold(f64::INFINITY, f64::min);
        assert!((4e-6..7e-6).contains(&lowest), "{lowest:e}");
    }
}

/// The peak from which a stage drops is its own: pressed with 1.8 N and unloaded to zero, the pair is pulled until its bond breaks at 1 N. A stage
/// that unloads drops from the stress at its start, in a run that goes on from its state, too.
#[test]
fn a_stage_drops_from_its_own_peak() {
    let strong = SPRING.replace(" }", ", normal_strength = 1, shear_strength = 100 }");
    let text = bonded(&spheres(&[[0.0, 0.0, 0.0, 0.01], [0.02, 0.0, 0.0, 0.01]]), "linear_bond", &strong)
        + "[loading]\nkind = \"uniaxial\"\naxis = \"x\"\nstrain_rate = 0.1\nlayer_thickness = 0.015\narea = 1e-4
        [integration]\ntime_step = 1e-6
        [output]\nsample_interval = 10
        [[stage]]\nname = \"press\"\nrate = -1\nstop = { strain = -9e-5 }
        [[stage]]\nname = \"unload half\"\nstop = { drop_to = 0.5 }
        [[stage]]\nname = \"unload\"\nstop = { stress = 0 }
        [[stage]]\nname = \"pull\"\nstop = { drop_to = 0.6 }";
    for stop in [usize::MAX, 1100, 2000] {
        let mut run = simulation(&text);
        let (mut ends, mut strains, mut steps) = (Vec::new(), Vec::new(), 0);
        loop {
            if steps == stop {
                let fresh = simulation(&text);
                let (model, schedule) = (fresh.solver.model().clone(), fresh.schedule.clone());
                run = Simulation::new(run.state.clone(), model, schedule).unwrap();
            }
            steps += 1;
            let advance = run.advance().unwrap();
            if let (Some(end), Some(record)) = (&advance.stage, &advance.sample) {
                ends.push(end.reason);
                strains.push(record.strain);
            }
            if advance.stopped.is_some() {
                break;
            }
        }
        let drop = StageReason::Stop(StopReason::Drop);
        assert_eq!(ends, [StageReason::Strain, drop, StageReason::Stress, drop], "stopped at {stop}");
        // Records are due every 10 steps, in which the strain changes by 1e-6; strains are those of springs at rest within some waves.
        for (found, expected) in strains.iter().zip([-9e-5, -4.5e-5, 0.0, 5e-5]) {
            assert!((found - expected).abs() < 3e-6, "{strains:?}");
        }
    }
}

/// A lattice of concrete that is held and then pulled. Its bonds are as long as they were made up to rounding, so it has stresses while it is
/// held.
const HELD: &str = r#"
version = 1
[packing]
kind = "lattice"
lattice = "fcc"
radius = "1 mm"
shape = { kind = "box", size = ["9 mm", "9 mm", "16 mm"] }
[[material]]
name = "concrete"
density = 4800
cpm = { young = "25 GPa", shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = 5, cohesion = "3 MPa", friction_coefficient = 0.8 }
[bonds]
law = "cpm"
interaction_ratio = 1.5
[contacts]
law = "cpm"
[integration]
damping = { kind = "local", coefficient = 0.3 }
[loading]
kind = "uniaxial"
strain_rate = "20 1/s"
[[stage]]
name = "hold"
rate = 0
stop = { steps = 2000, drop_to = 0.2 }
[[stage]]
name = "pull"
stop = { strain = 1e-2, drop_to = 0.5 }
[stop]
drop_to = 0.3
[output]
sample_interval = 10
"#;

/// Rounding errors of a specimen that is held are no peak to drop from, neither for the run, nor for the stage that holds, nor for the one that
/// pulls: that one ends where the specimen has failed.
#[test]
fn rounding_errors_of_a_held_specimen_are_no_peak() {
    let mut run = simulation(HELD);
    let mut largest = [0.0_f64; 2];
    let reason = loop {
        let stage = run.ended_stages().count();
        let advance = run.advance().unwrap();
        if let (Some(record), Some(largest)) = (&advance.sample, largest.get_mut(stage)) {
            *largest = largest.max(record.stress.abs());
            let rounding = run.schedule.rounding.after(record.step as u64);
            // One in a hundred of what counts as rounding is the most that 2,000 steps make.
            assert!(stage > 0 || *largest < 0.01 * rounding, "{largest:e} {rounding:e}");
        }
        if let Some(reason) = advance.stopped {
            break reason;
        }
    };
    let ends: Vec<(&str, u64)> = run.ended_stages().map(|(name, _, step)| (name, step)).collect();
    assert_eq!(ends[0], ("hold", 2000));
    assert_eq!((ends[1].0, reason), ("pull", StopReason::Stages));
    // A lattice is stronger than the onset stress of its bonds, 2.5 MPa.
    assert!(0.0 < largest[0] && largest[0] < 1e-2 && largest[1] > 2.5e6, "{largest:?}");
}

/// A run that stops anywhere and continues from its state goes through the same states as one that does not stop.
#[test]
fn a_restart_continues_within_a_stage() {
    let text = cyclic()
        + "
        [[history]]
        name = \"wave\"
        shape = { kind = \"sine\", period = \"0.7 ms\", mean = 0.5 }
        [[force]]
        set = \"last\"
        force = [0, 3, 0]
        history = \"wave\"";
    let mut whole = simulation(&text);
    let steps = run(&mut whole).len();
    for stop in [1, 500, 1003, steps / 2, steps - 200] {
        let mut first = simulation(&text);
        for _ in 0..stop {
            first.advance().unwrap();
        }
        let fresh = simulation(&text);
        let mut second =
            Simulation::new(first.state.clone(), fresh.solver.model().clone(), fresh.schedule.clone()).unwrap();
        run(&mut second);
        assert_eq!(second.state.particles.position, whole.state.particles.position, "stopped at {stop}");
        assert_eq!(second.state.schedule_memory, whole.state.schedule_memory, "stopped at {stop}");
    }
}

/// A periodic lattice of 32 bonded spheres.
fn cell() -> String {
    let packing = "kind = \"lattice\"
        lattice = \"fcc\"
        radius = 0.01
        repeats = [2, 2, 2]
        shape = { kind = \"periodic\" }";
    bonded(packing, "linear_bond", SPRING)
}

/// Strain and stress of a cell are those of the component that changes most, also if it shortens: `F_yy − 1` of the exact growth of
/// the edges, and a pressure.
#[test]
fn the_component_of_a_compressed_cell_is_the_largest() {
    let mut pressed = simulation(&format!(
        "{}
        [loading]
        kind = \"cell-strain\"
        velocity_gradient = [[0.1, 0, 0], [0, -1, 0], [0, 0, 0]]
        [stop]
        strain = 1e-3",
        cell()
    ));
    let last = run(&mut pressed).pop().unwrap().last.unwrap();
    let deformed = pressed.state.cell.unwrap().deformation_gradient;
    assert!(last.strain < -1e-3 && last.stress < 0.0, "{last:?}");
    assert!((last.strain - (deformed[(1, 1)] - 1.0)).abs() < 1e-12, "{} {deformed}", last.strain);
}

/// A servo that is resumed knows the stress of the step before: the same bits as without a break, before and after it has reached its
/// target.
#[test]
fn a_resumed_servo_knows_its_stress() {
    let text = format!(
        "{}
        [integration]
        damping = {{ kind = \"local\", coefficient = 0.3 }}
        [loading]
        kind = \"cell-stress\"
        stress = [[-1e5, 0, 0], [0, -1e5, 0], [0, 0, -1e5]]
        maximum_strain_rate = 1
        [stop]
        steps = 600",
        cell()
    );
    let mut whole = simulation(&text);
    run(&mut whole);
    for stop in [1, 300, 590] {
        let mut first = simulation(&text);
        for _ in 0..stop {
            first.advance().unwrap();
        }
        let (model, schedule) = (first.solver.model().clone(), first.schedule.clone());
        let mut second = Simulation::new(first.state.clone(), model, schedule).unwrap();
        run(&mut second);
        assert_eq!(second.state.cell, whole.state.cell, "stopped at {stop}");
        assert_eq!(second.state.particles.position, whole.state.particles.position, "stopped at {stop}");
    }
}

/// A servo whose target follows stages, and a cell that is sheared there and back.
#[test]
fn cells_follow_stages() {
    let cell = cell();
    let shear = format!(
        "{cell}
        [loading]
        kind = \"cell-strain\"
        velocity_gradient = [[0, 1, 0], [0, 0, 0], [0, 0, 0]]
        [[stage]]
        name = \"there\"
        stop = {{ strain = 1e-3 }}
        [[stage]]
        name = \"back\"
        rate = -1
        stop = {{ strain = 0 }}"
    );
    let mut sheared = simulation(&shear);
    let samples: Vec<Record> = run(&mut sheared).iter().filter_map(|advance| advance.sample).collect();
    let largest = samples.iter().map(|sample| sample.strain).fold(0.0, f64::max);
    let step = sheared.state.clock.dt * 11.0;
    assert!((largest - 1e-3).abs() <= step, "{largest}");
    assert!(samples.last().unwrap().strain.abs() <= step);
    let servo = format!(
        "{cell}
        [integration]
        damping = {{ kind = \"local\", coefficient = 0.3 }}
        [loading]
        kind = \"cell-stress\"
        stress = [[-1e5, 0, 0], [0, -1e5, 0], [0, 0, -1e5]]
        maximum_strain_rate = 1
        [[stage]]
        name = \"press\"
        stop = {{ unbalanced = 1e-2 }}
        [[stage]]
        name = \"half\"
        rate = 0.5
        stop = {{ unbalanced = 1e-2 }}
        [stop]
        steps = 200_000"
    );
    let mut pressed = simulation(&servo);
    let steps = run(&mut pressed);
    assert_eq!(steps.last().unwrap().stopped, Some(StopReason::Stages));
    let last = steps.iter().rev().find_map(|advance| advance.sample).unwrap();
    // The tolerance of the servo is 0.5 % of the whole target.
    assert!((last.stress / -0.5e5 - 1.0).abs() < 0.01, "{}", last.stress);
}

/// What contradicts itself is refused by its key.
#[test]
fn contradictions_are_refused() {
    let base = chain(2, "") + "\n[stop]\nsteps = 10\n";
    let cases = [
        ("[[prescribe]]\nset = \"last\"\nvelocity = [0, 0, 1]\nhistory = \"none\"", "prescribe[0].history"),
        ("[[prescribe]]\nset = \"last\"\ndisplacement = [0, 0, 1e-3]", "prescribe[0].displacement"),
        (
            "[[history]]\nname = \"a\"\nshape = { kind = \"table\", points = [[1, 0], [1, 1]] }\n[[force]]\nset = \"last\"\nforce = [1, 0, 0]\nhistory = \"a\"",
            "history[0].shape.points",
        ),
        ("[[stage]]\nname = \"a\"\nstop = {}", "stage[0].stop"),
        ("[[stage]]\nname = \"a\"\nrate = 2\nstop = { steps = 3 }", "stage[0].rate"),
        ("[[sample]]\noperator = \"set-force\"", "sample[0].operator"),
        ("[[sample]]\noperator = \"set-force\"\nset = \"nobody\"", "sample[0].set"),
        ("[[sample]]\noperator = \"gauge\"\nset = \"last\"", "sample[0].set"),
        ("[[sample]]\noperator = \"fabric\"\nset = \"last\"\nregion = { kind = \"all\", volume = 1 }", "sample[0].set"),
    ];
    for (text, key) in cases {
        let error =
            Scenario::parse("test.toml", &format!("{base}{text}")).err().unwrap_or_else(|| panic!("accepted: {text}"));
        let keys: Vec<&str> = error.problems.iter().map(|problem| problem.key.as_str()).collect();
        assert!(keys.contains(&key), "{text}: {keys:?}");
    }
}
