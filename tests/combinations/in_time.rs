//! What changes with time in a random scenario, and operators that read sets.

use std::fmt::Write as _;

use concordem_tests::random::Random;

use crate::case::{Action, Case, Loading, Motion, Region, Sample, Shape, Stage};
use crate::generator::{ids, planar, spin, vector};
use concordem::math::Vec3;

/// Adds histories, stages, and operators on sets. Runs last some 5 µs to 50 µs, in the plane more.
pub fn add(random: &mut Random, case: &mut Case) {
    for _ in 0..=random.below(2) {
        case.histories.push(history(random));
    }
    motions(random, case);
    stages(random, case);
    for _ in 0..=random.below(2) {
        let sample = sample(random, case);
        case.samples.push(sample);
    }
    turning_walls(random, case);
    drop_unused(case);
}

/// Planes that turn about their normals.
fn turning_walls(random: &mut Random, case: &mut Case) {
    if case.cell.is_some() || case.dimension == 2 || random.happens(0.5) {
        return;
    }
    let histories = case.histories.len();
    for wall in case.walls.iter_mut().filter(|wall| matches!(wall.shape, Shape::Plane(..))) {
        let history = random.happens(0.5).then(|| random.below(histories));
        wall.rotation = Some((random.between(-300.0, 300.0), history));
    }
}

/// A factor over time.
fn history(random: &mut Random) -> String {
    let period = random.one_of(&[3e-6, 1e-5, 4e-5]);
    if random.happens(0.4) {
        let (mean, phase) = (random.one_of(&[0.0, 0.5]), random.between(0.0, 6.0));
        if random.happens(0.3) {
            let formula = format!("{mean:?} + sin(2*pi*t/{period:?} + {phase:?})");
            return format!("{{ kind = \"expression\", expression = \"{formula}\", until = 2e-4 }}");
        }
        return format!("{{ kind = \"sine\", period = {period:?}, mean = {mean:?}, phase = {phase:?} }}");
    }
    let mut points = Vec::new();
    let mut time = random.between(0.0, period);
    for _ in 0..2 + random.below(3) {
        points.push(format!("[{time:?}, {:?}]", random.between(-1.0, 1.0)));
        time += random.between(0.2, 1.0) * period;
    }
    let (repeat, smooth) = (random.happens(0.5), random.happens(0.5));
    format!("{{ kind = \"table\", points = [{}], repeat = {repeat}, smooth = {smooth} }}", points.join(", "))
}

/// Motions, forces, and walls that follow histories.
fn motions(random: &mut Random, case: &mut Case) {
    let (count, dimension) = (case.spheres.len(), case.dimension);
    let histories = case.histories.len();
    let number = |random: &mut Random| Some(random.below(histories));
    for wall in &mut case.walls {
        if wall.velocity != Vec3::zeros() && random.happens(0.5) {
            wall.history = number(random);
        }
    }
    for (_, action) in &mut case.actions {
        if let Action::Force(_, _, history, acts) = action {
            *history = random.happens(0.5).then(|| random.below(histories));
            *acts = random.one_of(&["body", "pull", "push"]);
        }
    }
    let in_clump = |id: &usize| case.clumps.iter().any(|clump| clump.members.contains(id));
    if random.happens(0.6) {
        let mut some = ids(random, count, 4);
        some.retain(|id| !in_clump(id));
        let (v, u) = (planar(dimension, vector(random, 1.0)), planar(dimension, vector(random, 3e-6)));
        let w = spin(dimension, vector(random, 200.0));
        let mut motion = Motion { history: number(random), ..Motion::default() };
        for i in 0..3 {
            if dimension == 3 || i < 2 {
                match random.below(4) {
                    0 => motion.velocity[i] = Some(v[i]),
                    1 | 2 => motion.displacement[i] = Some(u[i]),
                    _ => {}
                }
            }
            if (dimension == 3 || i == 2) && random.happens(0.3) {
                motion.angular_velocity[i] = Some(w[i]);
            }
        }
        let all = [&motion.velocity, &motion.displacement, &motion.angular_velocity];
        if !some.is_empty() && all.into_iter().flatten().any(Option::is_some) {
            case.actions.push((some, Action::Prescribe(motion)));
        }
    }
    if random.happens(0.4) {
        let some = ids(random, count, 3);
        let size = if dimension == 2 { 1e3 } else { 10.0 };
        let (f, m) = (planar(dimension, vector(random, size)), spin(dimension, vector(random, 1e-3 * size)));
        let acts = random.one_of(&["body", "pull", "push"]);
        case.actions.push((some, Action::Force(f, m, number(random), acts)));
    }
}

/// Stages of the loading. Strains and stresses end stages only where they do not depend on the axes.
fn stages(random: &mut Random, case: &mut Case) {
    if random.happens(0.3) {
        return;
    }
    let loaded = !matches!(case.loading, Loading::None);
    let ends = matches!(case.loading, Loading::Uniaxial(..) | Loading::Platens(..));
    for _ in 0..2 + random.below(3) {
        let rate = if loaded { random.one_of(&[1.0, 1.0, -1.0, 0.0, 0.5]) } else { 1.0 };
        let history = (loaded && random.happens(0.3)).then(|| random.below(case.histories.len()));
        let mut stop = format!("steps = {}", 20 + random.below(80));
        if random.happens(0.3) {
            let _ = write!(stop, ", time = {:?}", random.between(1e-6, 3e-5));
        }
        if ends && random.happens(0.4) {
            let _ = write!(stop, ", strain = {:?}", random.between(-1e-3, 1e-3));
        }
        if ends && random.happens(0.4) {
            let _ = write!(stop, ", stress = {:?}", random.between(-1e5, 1e5));
        }
        if random.happens(0.2) {
            stop += ", unbalanced = 0.05";
        }
        case.stages.push(Stage { rate, history, stop });
    }
}

/// An operator that reads sets.
fn sample(random: &mut Random, case: &Case) -> Sample {
    let count = case.spheres.len();
    let (operator, region) = match random.below(3) {
        0 => {
            let about = random.happens(0.5).then(|| planar(case.dimension, vector(random, 5e-3)));
            ("set-force", Region::OfSet(ids(random, count, 8), about))
        }
        1 => ("set-motion", Region::OfSet(ids(random, count, 8), None)),
        _ => {
            let first = ids(random, count, 4);
            let mut second = ids(random, count, 4);
            second.retain(|id| !first.contains(id));
            if second.is_empty() {
                second = (0..count).filter(|id| !first.contains(id)).take(1).collect();
            }
            ("gauge", Region::Between([first, second]))
        }
    };
    Sample { operator, region, keys: String::new(), velocity: Vec3::zeros() }
}

/// Removes histories that nothing follows, from the end.
fn drop_unused(case: &mut Case) {
    let used = |k: usize| {
        let turning = case.walls.iter().filter_map(|wall| wall.rotation).map(|(_, history)| history);
        let walls = case.walls.iter().map(|wall| wall.history).chain(turning);
        let actions = case.actions.iter().map(|(_, action)| match action {
            Action::Prescribe(motion) => motion.history,
            Action::Force(_, _, history, _) => *history,
            Action::Initial(..) => None,
        });
        walls.chain(actions).chain(case.stages.iter().map(|stage| stage.history)).any(|history| history == Some(k))
    };
    let last = (0..case.histories.len()).rev().find(|&k| used(k));
    case.histories.truncate(last.map_or(0, |k| k + 1));
}
