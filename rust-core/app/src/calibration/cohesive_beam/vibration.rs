//! Free vibration of a clamped cylinder.

use std::f64::consts::PI;

use super::error::CalibrationError;
use super::response::{CylinderLoad, STEP_LIMIT, most_frequent};
use super::specimen::CylinderSpecimen;
use concordem_contact::law::CohesiveBeam;
use concordem_contact::math::{Vec3, sin_cos};
use concordem_operator::interruption::look;
use concordem_solver::fracture::fragments::fragments;
use concordem_solver::state::{Constraint, State};
use concordem_solver::{Model, Scheme, Solver, time_step};

/// Free vibration of a specimen with a clamped lower end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeVibration {
    /// First period, s.
    pub period: f64,
    /// Length from the innermost centers of the clamped layer to the free end of the specimen, m.
    pub free_length: f64,
    /// Half cycles of the measurement.
    pub half_cycles: usize,
}

/// Number of zero crossings of the displacement that are measured.
const CROSSINGS: usize = 7;

/// First period of a specimen clamped at its lower end and free at its upper end, from the mean motion of the free end after
/// a start with velocities close to the first mode. `sphere_density` in kg/m³. There is no damping.
///
/// # Errors
/// Invalid beam parameters, or too few crossings within the largest number of steps.
pub fn vibration(
    specimen: &CylinderSpecimen,
    beam: &CohesiveBeam,
    load: CylinderLoad,
    sphere_density: f64,
) -> Result<FreeVibration, CalibrationError> {
    let beam = CohesiveBeam { strength: f64::INFINITY, ..*beam };
    let mut state = specimen.state(beam, sphere_density)?;
    state.clock.dt = 0.5 * time_step::bounds(&state).spectral;
    let l = specimen.length;
    let thickness = 2.0 * specimen.recipe.mean_radius * (1.0 + 0.5 * specimen.recipe.dispersion);
    let start = state.particles.position.clone();
    let pieces = fragments(&state);
    let largest = most_frequent(&pieces);
    let inner = -0.5 * l + thickness;
    let tip: Vec<usize> =
        (0..start.len()).filter(|&p| pieces[p] == largest && start[p].x > 0.5 * l - thickness).collect();
    let free_length = 0.5 * l - inner;
    set_in_motion(&mut state, specimen.radius, load, inner, free_length);
    let signal = |state: &State| -> f64 {
        tip.iter()
            .map(|&p| {
                let u = state.particles.position[p] - start[p];
                match load {
                    CylinderLoad::Tension => u.x,
                    CylinderLoad::Bending => u.y,
                    // Spheres rotate with the cross-section; those on the axis have no other motion.
                    CylinderLoad::Torsion => 2.0 * state.particles.orientation[p].i,
                }
            })
            .sum()
    };
    let mut solver = Solver::new(Model { scheme: Scheme::VelocityVerlet, ..Model::default() }, &mut state)?;
    let (mut before, mut times) = (0.0, Vec::new());
    while times.len() < CROSSINGS {
        look();
        solver.step_with(&mut state, false)?;
        let now = signal(&state);
        if before * now < 0.0 {
            times.push(state.clock.time() - state.clock.dt * now / (now - before));
        }
        before = now;
        if state.clock.step > STEP_LIMIT {
            return Err(CalibrationError::NotSettled { steps: state.clock.step, change: f64::NAN });
        }
    }
    // The start is a crossing, too. Higher modes disturb a line fitted to all crossings less than a single crossing.
    times.insert(0, 0.0);
    let count = times.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let slope = times.iter().enumerate().map(|(k, t)| (k as f64 - middle) * t).sum::<f64>()
        / times.iter().enumerate().map(|(k, _)| (k as f64 - middle).powi(2)).sum::<f64>();
    Ok(FreeVibration { period: 2.0 * slope, free_length, half_cycles: CROSSINGS })
}

/// Clamps particles below `inner` (m) and gives the others velocities close to the first mode.
fn set_in_motion(state: &mut State, radius: f64, load: CylinderLoad, inner: f64, free_length: f64) {
    // Low enough for small strains.
    let speed = 1e-6 * free_length / state.clock.dt * 1e-3;
    let particles = &mut state.particles;
    for p in 0..particles.len() {
        let x = particles.position[p];
        if x.x < inner {
            particles.constraint[p] = Constraint::ALL;
            continue;
        }
        let share = (x.x - inner) / free_length;
        let quarter = sin_cos(0.5 * PI * share).0;
        match load {
            CylinderLoad::Tension => particles.velocity[p].x = speed * quarter,
            CylinderLoad::Torsion => {
                let angular_velocity = Vec3::new(speed / radius * quarter, 0.0, 0.0);
                particles.angular_velocity[p] = angular_velocity;
                particles.velocity[p] = angular_velocity.cross(&Vec3::new(0.0, x.y, x.z));
            }
            CylinderLoad::Bending => {
                // Deflection under a uniform load, which is close to the first mode; the cross-sections rotate accordingly.
                let deflection = share * share * (6.0 - 4.0 * share + share * share) / 3.0;
                let slope = share * (12.0 - 12.0 * share + 4.0 * share * share) / (3.0 * free_length);
                particles.angular_velocity[p].z = speed * slope;
                particles.velocity[p] = Vec3::new(-speed * slope * x.y, speed * deflection, 0.0);
            }
        }
    }
}
