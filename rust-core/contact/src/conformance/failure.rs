//! Failure of a contact that is pulled apart.

use super::{
    Finding, Host, MotionMeasure, PULL_STEPS, Record, Station, Subject, distance, drive_with, largest, legs, norm,
};

/// Forces and energies of a contact that is pulled to failure.
struct Failure {
    /// Largest jump of the force from step to step, relative to the peak.
    jump: f64,
    /// Loss of force in the breaking step, relative to the strength; 0 without a break.
    loss: f64,
    /// Largest jump of the force in any other step, relative to the strength.
    ordinary: f64,
    /// Energy dissipated as damage in the breaking step, J.
    damage: f64,
    /// Released energy by the modes of the law, J.
    released: f64,
    /// Energy stored one step before, J.
    stored: f64,
}

fn pull<H: Host>(subject: &Subject<H>, steps: usize) -> Failure {
    let knots =
        [subject.elastic.elongation[0], subject.failure].map(|elongation| Station { elongation, ..Station::default() });
    // At the same speed for every number of steps, so dashpot forces are equal.
    let dt = subject.dt * PULL_STEPS as f64 / steps as f64;
    let records = drive_with(subject, MotionMeasure::Finite, &subject.path(&legs(&knots, steps)), dt, false);
    let jump = |pair: &[Record<H::State>]| distance(&pair[0].force, &pair[1].force);
    let steps_of = |records: &[Record<H::State>]| largest(records.windows(2).map(jump));
    let peak = largest(records.iter().map(|r| r.force[0].abs()));
    let strength = largest(records.iter().map(|r| r.force[0].max(0.0)));
    let mut out =
        Failure { jump: steps_of(&records) / peak, loss: 0.0, ordinary: 1.0, damage: 0.0, released: 0.0, stored: 0.0 };
    if let [before @ .., last] = records.as_slice()
        && last.response.status.is_broken()
    {
        out.ordinary = steps_of(before) / strength;
        out.damage = last.response.energy.damage;
        out.released = last.released;
        if let Some(previous) = before.last() {
            out.loss = norm(&previous.force) / strength;
            out.stored = previous.response.energy.stored();
        }
    }
    out
}

pub(super) fn failure<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    let (coarse, fine) = (pull(subject, PULL_STEPS), pull(subject, 2 * PULL_STEPS));
    let ratio = fine.jump / coarse.jump;
    let check = "pulled to failure: jump of force at half the step / at full step";
    findings.push(if subject.properties.continuous_failure {
        Finding::at_most(check, ratio, 0.75, "0.5 for a continuous force, 0.71 with a square-root singularity")
    } else {
        Finding::at_least(check, ratio, 0.9, "undeclared: a jump that does not shrink with the step")
    });
    if subject.properties.brittle {
        findings.push(Finding::at_least(
            "brittle: share of the strength lost in the breaking step",
            fine.loss,
            0.01,
            "a break under load",
        ));
        let miss = |f: &Failure| (f.damage - f.stored).abs() / f.stored;
        findings.push(Finding::at_most(
            "brittle: energy of the break against the energy stored a step before",
            miss(&fine),
            0.1,
            "they differ by the work of one step",
        ));
        findings.push(Finding::at_most(
            "brittle: that difference at half the step / at full step",
            if miss(&coarse) > 0.0 { miss(&fine) / miss(&coarse) } else { 0.0 },
            0.6,
            "first order in the step",
        ));
        findings.push(Finding::at_most(
            "brittle: energy of the break that no mode accounts for",
            (fine.damage - fine.released).abs() / fine.damage,
            0.1,
            "damage done in the breaking step itself is not released",
        ));
    } else {
        findings.push(Finding::at_most(
            "not brittle: force lost in the breaking step over the largest change in other steps",
            fine.loss / fine.ordinary,
            2.0,
            "the breaking step is like the others, or there is none",
        ));
    }
}
