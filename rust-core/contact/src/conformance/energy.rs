//! Conservation, dissipation, and energy balance.

use super::{
    Finding, Host, KNOTS, Ledger, MotionMeasure, SEEDS, STEPS, Subject, distance, drive, drive_with, largest, norm,
};
use crate::law::EnergySplit;

pub(super) fn conservation<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    const SMALLEST_VIOLATION: f64 = 1e-6;
    for (name, sheared, declared) in [
        ("length", false, subject.properties.conservative_normal),
        ("shear", true, subject.properties.conservative_shear),
    ] {
        if declared {
            let (mut loss, mut dissipated, mut change) = (0.0_f64, 0.0_f64, 0.0_f64);
            for seed in 0..SEEDS {
                let stations = subject.closed_path(&subject.elastic, sheared, seed, STEPS);
                let records = drive(subject, MotionMeasure::Finite, &subject.path(&stations));
                let ledger = Ledger::of(&records);
                loss = loss.max((ledger.work - ledger.integration).abs() / ledger.absolute_work);
                dissipated = dissipated.max(ledger.dissipated.abs() / ledger.absolute_work);
                let scale = largest(records.iter().map(|r| norm(&r.force)));
                if let (Some(first), Some(last)) = (records.first(), records.last()) {
                    change = change.max(distance(&first.force, &last.force) / scale);
                }
                change = change.max((records.len() as f64 - stations.len() as f64).abs());
            }
            let rounding = subject.rounding(subject.elastic.smallest(), KNOTS * STEPS);
            let reason = "rounding of positions against the deformation";
            findings.push(Finding::at_most(
                format!("conservative in {name}: net work of closed paths"),
                loss,
                rounding,
                reason,
            ));
            findings.push(Finding::at_most(
                format!("conservative in {name}: dissipation on closed paths"),
                dissipated,
                1e-15,
                "declared zero; rounding",
            ));
            findings.push(Finding::at_most(
                format!("conservative in {name}: force after closed paths"),
                change,
                rounding,
                reason,
            ));
        } else {
            let mut violation = 0.0_f64;
            for seed in 0..SEEDS {
                let mut stations = subject.closed_path(&subject.inelastic, sheared, seed, STEPS);
                if sheared {
                    // At constant length all losses are losses in shear.
                    for station in &mut stations {
                        station.elongation = subject.held.elongation;
                    }
                }
                let ledger = Ledger::of(&drive(subject, MotionMeasure::Finite, &subject.path(&stations)));
                violation = violation.max(ledger.dissipated / ledger.absolute_work);
            }
            findings.push(Finding::at_least(
                format!("not conservative in {name}: share of work lost on closed paths"),
                violation,
                SMALLEST_VIOLATION,
                "an undeclared property must be measurably violated",
            ));
        }
    }
}

pub(super) fn dissipation<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    let mut worst = 0.0_f64;
    for window in [&subject.elastic, &subject.inelastic] {
        for seed in 0..4 * SEEDS {
            // Coarse paths, in which a step can reverse all motion, and fine ones.
            let steps = [1, 2, 5, STEPS][seed as usize % 4];
            let stations = subject.closed_path(window, true, seed, steps);
            let records = drive(subject, MotionMeasure::Finite, &subject.moving_path(&stations, seed));
            let scale = largest(records.iter().map(|r| r.response.energy.stored()));
            if scale > 0.0 {
                for record in &records {
                    let EnergySplit { damage, friction, viscous, .. } = record.response.energy;
                    for value in [damage, friction, viscous] {
                        worst = largest([worst, -value / scale].into_iter());
                    }
                }
            }
        }
    }
    let check = "most negative dissipation of a step, of the largest stored energy";
    findings.push(if subject.properties.dissipation_nonnegative {
        Finding::at_most(check, worst, 1e-15, "declared zero; rounding")
    } else {
        Finding::at_least(check, worst, 1e-12, "an undeclared property must be measurably violated")
    });
}

pub(super) fn energy_balance<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    for (name, window) in [("elastic", &subject.elastic), ("inelastic", &subject.inelastic)] {
        let (mut residual, mut step, mut coarse, mut fine, mut work) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for seed in 0..SEEDS {
            let stations = subject.closed_path(window, true, seed, STEPS);
            let ledger = Ledger::of(&drive(subject, MotionMeasure::Finite, &subject.moving_path(&stations, seed)));
            let unexplained = ledger.work - ledger.stored_change - ledger.dissipated - ledger.integration;
            residual = largest([residual, unexplained.abs() / ledger.absolute_work].into_iter());
            step = largest([step, ledger.unexplained / ledger.absolute_work].into_iter());
            coarse += ledger.absolute_integration;
            work += ledger.absolute_work;
            let stations = subject.closed_path(window, true, seed, 2 * STEPS);
            let refined = drive_with(subject, MotionMeasure::Finite, &subject.path(&stations), 0.5 * subject.dt, false);
            fine += Ledger::of(&refined).absolute_integration;
        }
        findings.push(Finding::at_most(
            format!("energy balance of random moving paths, {name}"),
            residual,
            subject.rounding(window.smallest(), KNOTS * STEPS).max(1e-12),
            "rounding over 320 steps; a shear increment is tangential up to rounding of the length",
        ));
        findings.push(Finding::at_most(
            format!("energy balance of the worst step of these paths, {name}"),
            step,
            subject.rounding(window.smallest(), 1).max(1e-14),
            "rounding of one step; a shear increment is tangential up to rounding of the length",
        ));
        findings.push(Finding::at_most(
            format!("integration terms, share of the work, {name}"),
            coarse / work,
            0.05,
            "an error of the trapezoidal rule at 40 steps per leg",
        ));
        findings.push(Finding::at_most(
            format!("integration terms at half the step / at full step, {name}"),
            if coarse > 1e-12 * work { fine / coarse } else { 0.0 },
            0.75,
            "0.25 for a smooth law, 0.5 with a break; in between, the position of a kink within its step decides",
        ));
    }
}
