//! Speed of a longitudinal pulse in a cylinder.

use std::f64::consts::PI;

use super::error::CalibrationError;
use super::response::{STEP_LIMIT, most_frequent};
use super::specimen::CylinderSpecimen;
use concordem_contact::law::CohesiveBeam;
use concordem_contact::math::sin_cos;
use concordem_operator::interruption::look;
use concordem_solver::fracture::fragments::fragments;
use concordem_solver::{Model, Scheme, Solver, time_step};

/// Measured speed of a longitudinal pulse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PulseSpeed {
    /// Distance of two sections over the time between the moments at which their displacement reaches half of its final
    /// value, m/s.
    pub wave_speed: f64,
    /// The same from the times of peak velocity, m/s.
    pub by_peaks: f64,
    /// Distance of the sections, m.
    pub distance: f64,
    /// Time step, s.
    pub dt: f64,
}

/// Speed of a longitudinal pulse in a specimen with free surfaces.
///
/// Jebahi et al. 2015 give neither the dimensions and velocity of their impact nor the criterion of arrival. Here,
/// spheres within `struck` (m) of the lower end start along the axis with a velocity that falls to zero as half a
/// cosine wave; together with its reflection at the end, the pulse is a bell of length `2·struck`. It passes two
/// sections at the ends of the middle half, where [`elastic`](super::elastic) measures strain. A pulse arrives when the
/// mean displacement of a section reaches half of its final value: precursors cause no displacement, and the nearly
/// symmetric dispersion of the bell hardly shifts this moment. The run ends before the pulse returns from the other end
/// at the `expected` wave speed (m/s). `sphere_density` in kg/m³. There is no damping.
///
/// # Errors
/// [`CalibrationError::Pulse`] if `struck` is not below a quarter of the length; [`CalibrationError::TooSmall`] if a section
/// is empty or the pulse does not pass it.
pub fn impact(
    sample: &CylinderSpecimen,
    beam: &CohesiveBeam,
    sphere_density: f64,
    struck: f64,
    expected: f64,
) -> Result<PulseSpeed, CalibrationError> {
    let l = sample.length;
    if !(0.0 < struck && struck < 0.25 * l) {
        return Err(CalibrationError::Pulse { struck, length: l });
    }
    let beam = CohesiveBeam { strength: f64::INFINITY, ..*beam };
    let mut state = sample.state(beam, sphere_density)?;
    state.clock.dt = 0.5 * time_step::bounds(&state).spectral;
    let dt = state.clock.dt;
    let n = state.particles.len();
    let too_small = || CalibrationError::TooSmall { count: n };
    let diameter = 2.0 * sample.recipe.mean_radius;
    let start = state.particles.position.clone();
    let pieces = fragments(&state);
    let largest = most_frequent(&pieces);
    let sections: [Vec<usize>; 2] = [-0.25, 0.25]
        .map(|at| (0..n).filter(|&p| pieces[p] == largest && (start[p].x - at * l).abs() < diameter).collect());
    if sections.iter().any(Vec::is_empty) {
        return Err(too_small());
    }
    let mean = |section: &[usize], value: &dyn Fn(usize) -> f64| {
        section.iter().map(|&p| value(p)).sum::<f64>() / section.len() as f64
    };
    let places = sections.each_ref().map(|section| mean(section, &|p| start[p].x));
    // Low enough for small strains.
    let speed = 1e-9 * struck / dt;
    for (velocity, x) in state.particles.velocity.iter_mut().zip(&start) {
        let depth = (x.x + 0.5 * l) / struck;
        if depth < 1.0 {
            velocity.x = 0.5 * speed * (1.0 + sin_cos(PI * depth).1);
        }
    }
    let mut solver = Solver::new(Model { scheme: Scheme::VelocityVerlet, ..Model::default() }, &mut state)?;
    let mut displacements: [Vec<f64>; 2] = Default::default();
    let mut velocities: [Vec<f64>; 2] = Default::default();
    let end = (1.25 * l - struck) / expected;
    while state.clock.time() < end {
        look();
        solver.step_with(&mut state, false)?;
        let particles = &state.particles;
        for (k, section) in sections.iter().enumerate() {
            displacements[k].push(mean(section, &|p| particles.position[p].x - start[p].x));
            velocities[k].push(mean(section, &|p| particles.velocity[p].x));
        }
        if state.clock.step > STEP_LIMIT {
            return Err(CalibrationError::NotSettled { steps: state.clock.step, change: f64::NAN });
        }
    }
    let distance = places[1] - places[0];
    let steps = |moments: [Option<f64>; 2]| match moments {
        [Some(first), Some(second)] if second > first => Ok(second - first),
        _ => Err(too_small()),
    };
    let halves = steps(displacements.each_ref().map(|trace| half_way(trace)))?;
    let peaks = steps(velocities.each_ref().map(|trace| peak(trace)))?;
    Ok(PulseSpeed { wave_speed: distance / (halves * dt), by_peaks: distance / (peaks * dt), distance, dt })
}

/// Fractional index at which a trace first passes half of its largest value, by linear interpolation.
pub(super) fn half_way(trace: &[f64]) -> Option<f64> {
    let half = 0.5 * trace.iter().copied().fold(0.0, f64::max);
    let at = (1..trace.len()).find(|&k| trace[k - 1] < half && trace[k] >= half)?;
    Some(at as f64 - (trace[at] - half) / (trace[at] - trace[at - 1]))
}

/// Fractional index of the maximum of a trace, from a parabola through three points.
fn peak(trace: &[f64]) -> Option<f64> {
    let at = (1..trace.len().checked_sub(1)?).max_by(|&i, &j| trace[i].total_cmp(&trace[j]))?;
    let (slope, curve) = (0.5 * (trace[at + 1] - trace[at - 1]), trace[at + 1] - 2.0 * trace[at] + trace[at - 1]);
    Some(at as f64 - slope / curve)
}
