//! Objectivity under finite rigid motion.

use std::f64::consts::TAU;

use super::{
    Finding, Host, KNOTS, MotionMeasure, Path, Pose, Random, RigidMotion, SEEDS, STEPS, Station, Subject, Vec3,
    at_rest, distance, drive, largest, legs, norm,
};
use crate::math::quaternion_of_rotation_vector;

/// Load to the held deformation, rest for two steps, then apply a rigid motion to the pair in `steps` steps. Returns the
/// largest relative change of the force in the moving axes.
fn change_under<H: Host>(subject: &Subject<H>, mode: MotionMeasure, steps: usize, rigid: RigidMotion<'_>) -> f64 {
    let mut stations = legs(&[Station::default(), subject.held], STEPS);
    let loaded = stations.len() + 2;
    stations.resize(loaded + steps, subject.held);
    let last = (stations.len() - 1) as f64;
    let start = (loaded - 1) as f64;
    let path = Path::new(&subject.geometry, &stations, &|share: f64| {
        rigid(((share * last - start) / steps as f64).clamp(0.0, 1.0))
    });
    let records = drive(subject, mode, &path);
    if records.len() < stations.len() {
        return f64::NAN;
    }
    // The largest change on the way: a whole turn ends where it began.
    let before = &records[loaded - 1].force;
    largest(records[loaded..].iter().map(|record| distance(before, &record.force))) / norm(before)
}

fn turn(axis: Vec3) -> impl Fn(f64) -> Pose {
    move |share| Pose { position: Vec3::zeros(), orientation: quaternion_of_rotation_vector(&(axis * (TAU * share))) }
}

pub(super) fn objectivity<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    const TURN_STEPS: usize = 100;
    let size = subject.geometry.reference_length;
    let held_shear = Vec3::new(0.0, subject.held.shear[0], subject.held.shear[1]).norm();
    let deformation =
        if held_shear > 0.0 { held_shear.min(subject.held.elongation.abs()) } else { subject.held.elongation.abs() };
    let bound = subject.rounding(deformation, TURN_STEPS).max(1e-12);
    let reason = "1e-12, or rounding of positions against the held deformation where that is larger";

    let shift = |share: f64| Pose { position: Vec3::new(1.0, -2.0, 0.5) * (size * share), ..at_rest(share) };
    findings.push(Finding::at_most(
        "held and translated: change of force, Finite",
        change_under(subject, MotionMeasure::Finite, TURN_STEPS, &shift),
        bound,
        reason,
    ));
    for (name, axis) in [
        ("about a tangent", Vec3::y()),
        ("about the normal", Vec3::x()),
        ("about a random axis", Random::new(7).direction()),
    ] {
        findings.push(Finding::at_most(
            format!("held and turned by 2π {name} in 100 steps: change of force, Finite"),
            change_under(subject, MotionMeasure::Finite, TURN_STEPS, &turn(axis)),
            bound,
            reason,
        ));
    }

    // Deformation during rotation: the finite shear measure is objective to the order of the integrator.
    let difference = |steps: usize| {
        let mut error = 0.0_f64;
        for seed in 0..SEEDS {
            let stations = subject.closed_path(&subject.elastic, true, seed, steps);
            let still = drive(subject, MotionMeasure::Finite, &subject.path(&stations));
            let moving = drive(subject, MotionMeasure::Finite, &subject.moving_path(&stations, seed));
            let scale = largest(still.iter().map(|r| norm(&r.force)));
            let change = largest(still.iter().zip(&moving).map(|(s, m)| distance(&s.force, &m.force) / scale));
            error = largest([error, change, still.len().abs_diff(moving.len()) as f64].into_iter());
        }
        error
    };
    let (coarse, fine) = (difference(STEPS), difference(2 * STEPS));
    let rounding = subject.rounding(subject.elastic.smallest(), KNOTS * STEPS);
    findings.push(Finding::at_most(
        "deformed while turned by 2π in 320 steps: change of force, Finite",
        coarse,
        1e-3,
        "square of the rotation of a step, (2·2π/320)² = 1.5e-3",
    ));
    findings.push(Finding::at_least(
        "order of that change in the step",
        if coarse > 10.0 * rounding { libm::log2(coarse / fine) } else { 2.0 },
        1.8,
        "second order, as the integrator",
    ));

    if held_shear == 0.0 {
        return;
    }
    // First-order transport stretches a vector by √(1+θ²) per step, 2π²/N per turn; the first-order shear increment
    // of a rigid turn is L(θ − sin θ) per step, L(2π)³/(6N²) per turn.
    for mode in [MotionMeasure::FirstOrder, MotionMeasure::Yade, MotionMeasure::YadeRatcheting] {
        for (name, axis) in [("about a tangent", Vec3::y()), ("about the normal", Vec3::x())] {
            let [once, twice, four_times] =
                [1000, 2000, 4000].map(|steps| change_under(subject, mode, steps, &turn(axis)));
            let length = subject.geometry.reference_length + subject.held.elongation;
            let expected = TAU * TAU / 2000.0 + TAU * TAU * TAU / 6e6 * length / held_shear;
            findings.push(Finding::at_most(
                format!("held and turned by 2π {name} in 1000 steps, {mode:?}"),
                once,
                1.2 * expected,
                "2π²/N + (2π)³L/(6N² shear), plus a fifth for higher orders",
            ));
            findings.push(Finding::at_least(
                format!("order of that error in the step {name}, {mode:?}"),
                libm::log2(twice / four_times),
                0.9,
                "first order",
            ));
        }
    }
}
