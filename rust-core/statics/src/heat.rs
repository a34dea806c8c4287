//! Steady temperatures by a sparse Cholesky factor (`faer`).
//!
//! In the steady state as much heat flows into each particle as out of it: `Σ_j G_ij (T_j − T_i) + Q_i(T_i) = 0` with the
//! conductances and supplies of [`concordem_solver::heat`]. The equations are linear except for radiation; Newton steps
//! square its error. Prescribed temperatures are not unknowns. The solver has an iterative counterpart,
//! [`to_steady_state`](concordem_solver::heat::implicit::to_steady_state), which needs less memory.

use faer::linalg::solvers::SolveCore;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Conj, MatMut, Side};

use concordem_solver::heat::HeatModel;
use concordem_solver::heat::pass::HeatPass;
use concordem_solver::state::State;

use super::StaticsError;

/// Largest number of Newton steps.
const NEWTON_STEPS: usize = 50;

/// Largest change in the last Newton step, as a fraction of the highest temperature.
const ACCURACY: f64 = 1e-11;

/// Steady temperature of each particle of `state`, K, under the supply of `model` at time zero.
///
/// # Errors
/// The state has no temperatures, or there is no steady state: a part of the body has neither a prescribed temperature nor
/// a surface that exchanges heat by its temperature.
pub fn steady_temperatures(model: &HeatModel, state: &State) -> Result<Vec<f64>, StaticsError> {
    let unfit = |problem: String| StaticsError::Steady { problem };
    let mut heat = state.heat.clone().ok_or_else(|| unfit("the state has no temperatures".to_owned()))?;
    let particles = &state.particles;
    let mut pass = HeatPass::new(model, state);
    for held in &model.supply.held {
        for &p in &held.particles {
            heat.temperature[p as usize] = held.temperature;
        }
    }
    heat.correction.fill(0.0);
    // Numbers of the unknowns.
    let mut number = vec![None; particles.len()];
    let mut size = 0;
    for (p, number) in number.iter_mut().enumerate() {
        if !pass.is_held(p) {
            *number = Some(size);
            size += 1;
        }
    }
    for _ in 0..NEWTON_STEPS {
        let (rate, slope) = pass.rates(model, particles, &heat, 0.0);
        let (rate, slope) = (rate.to_vec(), slope.to_vec());
        let mut entries = Vec::new();
        let mut load = vec![0.0; size];
        for p in 0..particles.len() {
            let Some(row) = number[p] else { continue };
            load[row] = rate[p];
            let sum = pass.links(p).fold(slope[p], |sum, (_, conductance)| sum + conductance);
            entries.push(Triplet::new(row, row, sum));
            for (other, conductance) in pass.links(p) {
                if let Some(column) = number[other].filter(|column| *column < row) {
                    entries.push(Triplet::new(row, column, -conductance));
                }
            }
        }
        let matrix = SparseColMat::try_new_from_triplets(size, size, &entries).map_err(|e| unfit(format!("{e:?}")))?;
        let symbolic = SymbolicLlt::try_new(matrix.symbolic(), Side::Lower).map_err(|e| unfit(format!("{e:?}")))?;
        let factor = Llt::try_new_with_symbolic(symbolic, matrix.as_ref(), Side::Lower).map_err(|_| {
            unfit("every part of the body needs a prescribed temperature, convection, or radiation".to_owned())
        })?;
        factor.solve_in_place_with_conj(Conj::No, MatMut::from_column_major_slice_mut(&mut load, size, 1));
        let (mut largest, mut highest) = (0.0_f64, 0.0_f64);
        for (temperature, number) in heat.temperature.iter_mut().zip(&number) {
            if let Some(number) = number {
                *temperature += load[*number];
                largest = largest.max(load[*number].abs());
            }
            highest = highest.max(temperature.abs());
        }
        if largest <= ACCURACY * highest {
            return Ok(heat.temperature);
        }
        if !(largest / highest).is_finite() {
            break;
        }
    }
    Err(unfit(format!("the temperatures do not settle in {NEWTON_STEPS} Newton steps")))
}
