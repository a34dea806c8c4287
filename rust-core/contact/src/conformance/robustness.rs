//! Determinism, and finite responses to extreme inputs.

use super::{
    Finding, Host, LawState, MODES, MotionMeasure, PointKinematics, Record, STEPS, Station, Subject, Vec3, drive, legs,
};
use crate::kinematics::Transport;

pub(super) fn determinism<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    let bits = |records: &[Record<H::State>]| -> Vec<u64> {
        records
            .iter()
            .flat_map(|record| {
                let e = &record.response.energy;
                let energies = [e.stored_normal, e.stored_shear, e.damage, e.friction, e.viscous, e.integration];
                record
                    .response
                    .force
                    .iter()
                    .chain(record.response.moment.iter())
                    .chain(record.response.state.as_reals())
                    .copied()
                    .chain(energies)
                    .map(f64::to_bits)
                    .collect::<Vec<_>>()
            })
            .collect()
    };
    let mut different = 0;
    for mode in MODES {
        let path = |seed| subject.moving_path(&subject.closed_path(&subject.inelastic, true, seed, STEPS), seed);
        let once = bits(&drive(subject, mode, &path(3)));
        // A contact evaluated in between must not change anything.
        drive(subject, mode, &path(4));
        let again = bits(&drive(subject, mode, &path(3)));
        different += once.iter().zip(&again).filter(|(x, y)| x != y).count() + once.len().abs_diff(again.len());
    }
    findings.push(Finding::at_most("same inputs, different bits", different as f64, 0.0, "a law is a pure function"));
}

pub(super) fn extremes<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    let size = subject.geometry.reference_length;
    let loaded =
        drive(subject, MotionMeasure::Finite, &subject.path(&legs(&[Station::default(), subject.held], STEPS)));
    let mut states = vec![H::State::default()];
    states.extend(loaded.last().map(|record| record.response.state));
    let elongations = [0.0, 1e-300, -1e-300, 1e-16, -1e-16, 1e-6, -1e-6, -0.5, -0.999, 1.0, 1e6].map(|x| x * size);
    let mut bad = 0_u32;
    for elongation in elongations {
        for old_elongation in [elongation, 0.0, subject.held.elongation, -0.5 * size] {
            for shear in [0.0, 1e-300, 1e-16, 1e-3, 1e6].map(|x| x * size) {
                for dt in [1e-30, 1e-9, 1.0, 1e30] {
                    for state in &states {
                        let length = size + elongation;
                        let half_gap = 0.5 * (length - subject.geometry.radius_a - subject.geometry.radius_b);
                        let kinematics = PointKinematics {
                            geometry: subject.geometry,
                            length,
                            length_old: size + old_elongation,
                            elongation,
                            elongation_old: old_elongation,
                            gap: 2.0 * half_gap,
                            normal: Vec3::x(),
                            shear_increment: Vec3::new(0.0, 0.6 * shear, -0.8 * shear),
                            arm_a: subject.geometry.radius_a + half_gap,
                            arm_b: subject.geometry.radius_b + half_gap,
                            bonded: subject.bonded,
                            transport: Transport::identity(Vec3::x()),
                        };
                        let r = subject.host.respond(&kinematics, state, dt);
                        let finite = r.force.iter().chain(r.moment.iter()).all(|x| x.is_finite())
                            && r.state.as_reals().iter().all(|x| x.is_finite())
                            && r.energy.stored().is_finite()
                            && r.energy.dissipated().is_finite()
                            && r.energy.integration.is_finite();
                        bad += u32::from(!finite);
                    }
                }
            }
        }
    }
    findings.push(Finding::at_most("extremes: responses with NaN or infinity", f64::from(bad), 0.0, "none is allowed"));
}
