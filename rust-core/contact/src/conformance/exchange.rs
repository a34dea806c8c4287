//! Action and reaction, and exchange of A and B.

use super::{
    ContactGeometry, Finding, Host, KNOTS, LawState, MODES, PointKinematics, Random, SEEDS, STEPS, Subject,
    clear_void_parts, drive, drive_with, largest, norm,
};
use crate::kinematics::Transport;

pub(super) fn action_and_reaction<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    let (mut arms, mut moments) = (0.0_f64, 0.0_f64);
    for mode in MODES {
        for seed in 0..SEEDS {
            let path = subject.moving_path(&subject.closed_path(&subject.elastic, true, seed, STEPS), seed);
            let point = Random::new(seed).direction() * subject.geometry.reference_length;
            for (record, [a, b]) in drive(subject, mode, &path).iter().zip(&path.poses) {
                let k = &record.kinematics;
                let (force, moment) = (record.response.force, record.response.moment);
                arms = arms.max((k.arm_a + k.arm_b - k.length).abs() / k.length);
                let from_a = (a.position - point).cross(&force) + (k.normal * k.arm_a).cross(&force) + moment;
                let from_b = (b.position - point).cross(&-force) + (k.normal * -k.arm_b).cross(&-force) - moment;
                let size = force.norm() * ((a.position - point).norm() + (b.position - point).norm() + k.length);
                if size > 0.0 {
                    moments = moments.max((from_a + from_b).norm() / size);
                }
            }
        }
    }
    findings.push(Finding::at_most("arms of A and B add up to the branch, all modes", arms, 1e-15, "a few roundings"));
    findings.push(Finding::at_most("moments balance about any point, all modes", moments, 2e-15, "a few roundings"));
}

/// Kinematics of the same step with A and B exchanged, exactly.
pub(super) fn exchanged(k: &PointKinematics) -> PointKinematics {
    let g = k.geometry;
    PointKinematics {
        geometry: ContactGeometry {
            radius_a: g.radius_b,
            radius_b: g.radius_a,
            mass_a: g.mass_b,
            mass_b: g.mass_a,
            ..g
        },
        normal: -k.normal,
        shear_increment: -k.shear_increment,
        arm_a: k.arm_b,
        arm_b: k.arm_a,
        transport: match k.transport {
            Transport::Finite { normal, bisector, cosine, sine } => {
                Transport::Finite { normal: -normal, bisector: -bisector, cosine, sine: -sine }
            }
            same @ Transport::FirstOrder { .. } => same,
        },
        ..*k
    }
}

pub(super) fn exchange<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    let mut different = 0_u32;
    for window in [&subject.elastic, &subject.inelastic] {
        for mode in MODES {
            for seed in 0..SEEDS {
                let path = subject.moving_path(&subject.closed_path(window, true, seed, STEPS), seed);
                for record in drive(subject, mode, &path) {
                    let k = exchanged(&record.kinematics);
                    let mut mirror = subject.host.respond_exchanged(&k, &record.old.swapped(), subject.dt);
                    clear_void_parts(&mut mirror);
                    let response = &record.response;
                    let same = mirror.status == response.status
                        && mirror.energy == response.energy
                        && mirror.force == -response.force
                        && mirror.moment == -response.moment
                        && mirror.state == response.state.swapped();
                    different += u32::from(!same);
                }
            }
        }
    }
    findings.push(Finding::at_most(
        "exchange of A and B by the law: steps that differ in any bit",
        f64::from(different),
        0.0,
        "a law has no preferred side",
    ));
    for mode in MODES {
        let mut error = 0.0_f64;
        for seed in 0..SEEDS {
            let path = subject.moving_path(&subject.closed_path(&subject.elastic, true, seed, STEPS), seed);
            let straight = drive(subject, mode, &path);
            let mirrored = drive_with(subject, mode, &path.exchanged(), subject.dt, true);
            let scale = largest(straight.iter().map(|r| norm(&r.force)));
            for (record, mirror) in straight.iter().zip(&mirrored) {
                error = error.max((record.response.force + mirror.response.force).norm() / scale);
            }
            error = error.max((straight.len() as f64 - mirrored.len() as f64).abs());
        }
        findings.push(Finding::at_most(
            format!("exchange of A and B by kinematics and law, {mode:?}"),
            error,
            subject.rounding(subject.elastic.smallest(), KNOTS * STEPS),
            "rounding of positions against the deformation",
        ));
    }
}
