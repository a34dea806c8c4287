//! Standard paths of a single contact and their comparison with closed forms.

use super::{Finding, Host, MotionMeasure, Station, Subject, Window, distance, drive, largest, legs, norm};

/// One step of an atlas path: input of a closed form.
#[derive(Debug, Clone, Copy)]
pub struct Observed {
    /// Prescribed deformation, but with the measured elongation, which excludes rounding of positions.
    pub station: Station,
    /// Measured gap `length − R_A − R_B`, m.
    pub gap: f64,
    /// Duration of the step, s.
    pub dt: f64,
    /// Index of the step; 0 is the step at rest at the start.
    pub step: usize,
}

/// Standard paths of a single contact within `window`, `steps` per leg: tension, compression, shear at constant elongation,
/// twist, growing cycles, mixed loading.
pub fn atlas_paths(window: &Window, steps: usize) -> Vec<(&'static str, Vec<Station>)> {
    let [low, high] = window.elongation;
    let at = |elongation: f64, y: f64, z: f64| Station {
        elongation,
        shear: [y * window.shear, z * window.shear],
        twist: 0.0,
    };
    let twisted = |elongation: f64, twist: f64| Station { twist, ..at(elongation, 0.0, 0.0) };
    let zero = Station::default();
    vec![
        ("tension", legs(&[zero, at(high, 0.0, 0.0), zero], steps)),
        ("compression", legs(&[zero, at(low, 0.0, 0.0), zero], steps)),
        (
            "shear at constant compression",
            legs(&[zero, at(0.5 * low, 0.0, 0.0), at(0.5 * low, 1.0, 0.0), at(0.5 * low, -1.0, 0.0)], steps),
        ),
        (
            "shear at constant tension",
            legs(&[zero, at(0.2 * high, 0.0, 0.0), at(0.2 * high, 0.0, 1.0), at(0.2 * high, 0.0, -1.0)], steps),
        ),
        ("twist", legs(&[zero, at(0.2 * low, 0.0, 0.0), twisted(0.2 * low, 1.0), twisted(0.2 * low, -1.0)], steps)),
        (
            "cyclic",
            legs(
                &[0.2, -0.5, 0.4, -1.0, 0.6, 0.1, 1.0].map(|x| at(if x > 0.0 { x * high } else { -x * low }, 0.0, 0.0)),
                steps,
            ),
        ),
        (
            "mixed",
            legs(
                &[
                    zero,
                    at(0.3 * low, 0.4, 0.0),
                    at(0.9 * low, 0.4, 0.5),
                    at(0.2 * high, -0.3, 0.5),
                    at(0.6 * low, -1.0, -0.8),
                    at(high, 0.0, 0.0),
                ],
                steps,
            ),
        ),
    ]
}

/// Compare the forces along the atlas paths with closed forms.
///
/// For each path, `closed_form` creates a function that gets the steps in order and returns the force on A as
/// `[normal, shear y, shear z]` (N), or `None` from the step in which the bond breaks. The measured value is the largest
/// difference relative to the largest force of the path. `tolerance` and `reason` belong to the law.
pub fn atlas<H: Host, F: FnMut(&Observed) -> Option<[f64; 3]>>(
    subject: &Subject<H>,
    paths: &[(&'static str, Vec<Station>)],
    closed_form: impl Fn() -> F,
    tolerance: f64,
    reason: &'static str,
) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (name, stations) in paths {
        let records = drive(subject, MotionMeasure::Finite, &subject.path(stations));
        let mut expected = closed_form();
        let (mut error, mut scale) = (0.0, 0.0_f64);
        for (step, station) in stations.iter().enumerate() {
            let Some(record) = records.get(step) else { break };
            let k = &record.kinematics;
            let station = Station { elongation: k.elongation, ..*station };
            let Some(force) = expected(&Observed { station, gap: k.gap, dt: subject.dt, step }) else {
                if !record.response.status.is_broken() {
                    error = f64::INFINITY;
                }
                break;
            };
            scale = scale.max(norm(&force));
            let broken = if record.response.status.is_broken() { f64::INFINITY } else { 0.0 };
            error = largest([error, distance(&force, &record.force) + broken].into_iter());
        }
        // A path without any force must agree exactly.
        let relative = if error == 0.0 { 0.0 } else { error / scale };
        findings.push(Finding::at_most(format!("atlas: {name}"), relative, tolerance, reason));
    }
    findings
}
