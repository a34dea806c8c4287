//! Stiffness of a periodic cell by the dynamic solver: a small strain, then damped motion until the cell is at rest.

use nalgebra::Matrix6;

use super::{COMPONENTS, StaticsError};
use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::interruption::look;
use concordem_solver::integrate::Damping;
use concordem_solver::state::State;
use concordem_solver::{Model, Solver};

/// How the cell is strained and relaxed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relaxation {
    /// Strain of each mode, imposed in one step.
    pub strain: f64,
    /// Local damping of translation and rotation.
    pub damping: f64,
    /// Unbalanced force or moment at which the cell is at rest
    /// ([`StepReport::unbalanced`](concordem_solver::StepReport::unbalanced)).
    pub unbalanced: f64,
    /// Largest number of steps per mode.
    pub steps: u64,
}

impl Default for Relaxation {
    /// Strain 1e-7, damping 0.1 as in Stránský 2018, section 3.3.4; at rest at 1e-6, as there (rounding of positions
    /// some ten diameters from the origin leaves 1e-7); at most 200 000 steps.
    fn default() -> Self {
        Self { strain: 1e-7, damping: 0.1, unbalanced: 1e-6, steps: 200_000 }
    }
}

/// Stiffness (Pa; components 11, 22, 33, 23, 31, 12, engineering shear strains; in the plane 11, 22, 12) of the cell of
/// `state`, whose bonds must be unstressed, and the number of steps of the longest mode.
///
/// # Errors
/// [`StaticsError::NoCell`]; [`StaticsError::Relaxation`] if the solver fails or the cell does not come to rest.
pub fn relaxed_stiffness(
    state: &State,
    model: &Model,
    relaxation: Relaxation,
) -> Result<(Matrix6<f64>, u64), StaticsError> {
    const CHECK_INTERVAL: u64 = 50;
    let failed = |error: String| StaticsError::Relaxation(error);
    let mut stiffness = Matrix6::zeros();
    let mut longest = 0;
    // Lagged strains converge with the power ρ per step, whatever the net forces are.
    let settled = model.deformable.as_ref().map_or(0.0, |deformable| {
        let radius = concordem_solver::coupling::convergence(state, deformable).spectral_radius;
        if radius > 0.0 && radius < 1.0 { 1e-9_f64.ln() / radius.ln() } else { 0.0 }
    });
    let planar = super::network::is_planar(state);
    let radius = state.particles.mean_radius();
    for column in super::cell_stiffness::strains(planar) {
        let (i, j) = COMPONENTS[column];
        let mut state = state.clone();
        let damping = Damping::Local { translation: relaxation.damping, rotation: relaxation.damping };
        let mut solver =
            Solver::new(Model { damping, ..model.clone() }, &mut state).map_err(|e| failed(e.to_string()))?;
        let mut cell = state.cell.ok_or(StaticsError::NoCell)?;
        cell.velocity_gradient = Mat3::zeros();
        state.cell = Some(cell);
        let mut gradient = Mat3::zeros();
        gradient[(i, j)] += 0.5 * relaxation.strain / state.clock.dt;
        gradient[(j, i)] += 0.5 * relaxation.strain / state.clock.dt;
        state.particles.velocity.fill(Vec3::zeros());
        state.particles.angular_velocity.fill(Vec3::zeros());
        solver.set_velocity_gradient(&cell, gradient);
        solver.step_with(&mut state, false).map_err(|e| failed(e.to_string()))?;
        cell.velocity_gradient = gradient;
        solver.set_velocity_gradient(&cell, Mat3::zeros());
        let mut steps = 1;
        let report = loop {
            let sample = steps % CHECK_INTERVAL == 0;
            let report = solver.step_with(&mut state, sample).map_err(|e| failed(e.to_string()))?;
            steps += 1;
            if !sample {
                continue;
            }
            look();
            let unbalanced = report.unbalanced(radius);
            if unbalanced <= relaxation.unbalanced && steps as f64 > settled {
                break report;
            }
            if steps > relaxation.steps {
                return Err(failed(format!(
                    "the cell is not at rest after {steps} steps: net force or moment over that of the contacts is \
                     {unbalanced:.1e}; the limit is {:.1e}",
                    relaxation.unbalanced
                )));
            }
        };
        longest = longest.max(steps);
        let (before, cell) = (cell, state.cell.ok_or(StaticsError::NoCell)?);
        let stress = report.virial / cell.volume();
        let strained =
            (cell.deformation_gradient - before.deformation_gradient)[(i, j)] * if i == j { 1.0 } else { 2.0 };
        for row in super::cell_stiffness::strains(planar) {
            let (k, l) = COMPONENTS[row];
            stiffness[(row, column)] = 0.5 * (stress[(k, l)] + stress[(l, k)]) / strained;
        }
    }
    Ok((stiffness, longest))
}
