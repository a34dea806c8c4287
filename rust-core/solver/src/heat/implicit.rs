//! Backward Euler steps and steady states: conjugate gradients.
//!
//! With the changes `θ = T(t+Δt) − T(t)`, a step solves `(C/Δt + K + H) θ = r`: `K` conducts between the particles, `H` is
//! minus the derivative of the heat through the surface, and `r` the heat into each particle at the start of the step. The
//! matrix is symmetric, positive definite, and sparse; it is not stored. Sums run over chunks of fixed length in a
//! fixed order, so that all bits are the same for any number of threads.

use rayon::prelude::*;

use super::pass::HeatPass;
use super::{HeatModel, HeatState};
use crate::SolverError;
use crate::evaluation::TILE;
use crate::state::Particles;

/// Relative residual at which the iteration ends. The temperatures are updated by the flows that follow from the
/// solution, so that heat is conserved to rounding anyway.
const TOLERANCE: f64 = 1e-12;

/// Iterations per particle after which the iteration gives up; without rounding, one would suffice.
const MOST: usize = 4;

/// Sum of the products of two vectors.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let of = |(a, b): (&[f64], &[f64])| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let parts: Vec<f64> = a.par_chunks(TILE).zip(b.par_chunks(TILE)).map(of).collect();
    parts.iter().sum()
}

/// `a ← a + factor b`.
fn add(a: &mut [f64], factor: f64, b: &[f64]) {
    a.par_chunks_mut(TILE).zip(b.par_chunks(TILE)).for_each(|(a, b)| {
        for (a, b) in a.iter_mut().zip(b) {
            *a += factor * b;
        }
    });
}

/// Largest number of solutions in a step whose heat capacities vary, and the relative change of a capacity at which they end. The
/// temperatures follow from the heat that flows, so that it is conserved anyway.
const SOLUTIONS: usize = 50;
const SETTLED: f64 = 1e-9;

/// [`solve`] with the heat capacities of the step: if they vary, those between its start and its end, `∫ C dT/θ`, by iteration.
///
/// # Errors
/// As [`solve`]; capacities that do not settle.
pub(super) fn solve_step(pass: &mut HeatPass, model: &HeatModel, heat: &HeatState, dt: f64) -> Result<(), SolverError> {
    if !dt.is_finite() || !model.curves.specific_heat_varies() {
        return solve(pass, &model.capacity, dt);
    }
    let prescribed = pass.change.clone();
    let now = |p: usize, change: f64| {
        let small = change.abs() <= 1e-6;
        let change = if small { 1e-6 } else { change };
        model.heat_of(p, heat.temperature[p], change) / change
    };
    let mut capacity: Vec<f64> = (0..prescribed.len()).map(|p| now(p, 0.0)).collect();
    let mut worst = f64::INFINITY;
    for _ in 0..SOLUTIONS {
        pass.change.clone_from(&prescribed);
        solve(pass, &capacity, dt)?;
        worst = 0.0;
        for (p, capacity) in capacity.iter_mut().enumerate() {
            let next = now(p, pass.change[p]);
            worst = f64::max(worst, (next / *capacity - 1.0).abs());
            *capacity = next;
        }
        if worst <= SETTLED {
            return Ok(());
        }
    }
    Err(SolverError::HeatNotConverged { residual: worst, iterations: SOLUTIONS })
}

/// Solve for the changes of the temperatures in a step of `dt` (s; infinite for the steady state) into `pass.change`, which holds
/// those of the prescribed temperatures.
///
/// # Errors
/// The iteration does not converge, as for a steady state that does not exist.
pub(super) fn solve(pass: &mut HeatPass, capacity: &[f64], dt: f64) -> Result<(), SolverError> {
    let n = capacity.len();
    // `(C/Δt + K + H) x` for the free particles; prescribed ones have 0.
    let multiply = |x: &[f64], out: &mut Vec<f64>| {
        pass.conduct(x, out);
        out.par_iter_mut().enumerate().with_min_len(TILE).for_each(|(p, y)| {
            *y = if pass.is_held(p) { 0.0 } else { (capacity[p] / dt + pass.surface[p]) * x[p] - *y };
        });
    };
    let diagonal = |p: usize| {
        let sum: f64 = pass.links(p).map(|(_, conductance)| conductance).sum();
        let own = capacity[p] / dt + pass.surface[p] + sum;
        if pass.is_held(p) || own == 0.0 { 0.0 } else { 1.0 / own }
    };
    let inverse: Vec<f64> = (0..n).into_par_iter().with_min_len(TILE).map(diagonal).collect();
    let precondition = |residual: &[f64]| -> Vec<f64> {
        residual.par_iter().zip(&inverse).with_min_len(TILE).map(|(r, inverse)| r * inverse).collect()
    };
    let mut product = Vec::new();
    let mut solution = pass.change.clone();
    multiply(&solution, &mut product);
    let of = |p: usize| if pass.is_held(p) { 0.0 } else { pass.rate[p] - product[p] };
    let mut residual: Vec<f64> = (0..n).into_par_iter().with_min_len(TILE).map(of).collect();
    // What rounding leaves of the rates, if they cancel.
    let size = |p: usize| {
        let held = pass.links(p).map(|(other, conductance)| conductance * pass.change[other].abs()).sum::<f64>();
        pass.rate[p].abs() + held
    };
    let sizes: Vec<f64> = (0..n).into_par_iter().with_min_len(TILE).map(size).collect();
    let wanted = TOLERANCE * TOLERANCE * dot(&sizes, &sizes);
    let mut preconditioned = precondition(&residual);
    let mut direction = preconditioned.clone();
    let mut power = dot(&residual, &preconditioned);
    let most = MOST * n + 100;
    for _ in 0..most {
        if dot(&residual, &residual) <= wanted {
            pass.change = solution;
            return Ok(());
        }
        multiply(&direction, &mut product);
        let step = power / dot(&direction, &product);
        if !step.is_finite() {
            break;
        }
        add(&mut solution, step, &direction);
        add(&mut residual, -step, &product);
        preconditioned = precondition(&residual);
        let next = dot(&residual, &preconditioned);
        let factor = next / power;
        power = next;
        direction.par_iter_mut().zip(&preconditioned).with_min_len(TILE).for_each(|(d, z)| *d = z + factor * *d);
    }
    let left = (dot(&residual, &residual) / dot(&sizes, &sizes)).sqrt();
    Err(SolverError::HeatNotConverged { residual: left, iterations: most })
}

/// Largest number of linearizations of radiation; each squares the error.
const LINEARIZATIONS: usize = 50;

/// Change the temperatures to those of the steady state under the present supply. The heat that this takes is booked as
/// initial heat.
///
/// # Errors
/// There is no steady state (a part of the body has neither a prescribed temperature nor a surface that depends on the
/// temperature), or the iteration does not converge.
pub fn to_steady_state(
    model: &HeatModel,
    particles: &Particles,
    pass: &mut HeatPass,
    heat: &mut HeatState,
) -> Result<(), SolverError> {
    let steady = HeatModel { implicit: true, ..model.clone() };
    let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    for _ in 0..LINEARIZATIONS {
        let mut scratch = heat.clone();
        pass.begin(&steady, particles, &mut scratch, 0.0, f64::INFINITY)?;
        let change = largest(&pass.change);
        for p in 0..heat.temperature.len() {
            heat.temperature[p] += pass.change[p];
            heat.correction[p] = 0.0;
        }
        if change <= 1e-11 * largest(&heat.temperature) {
            heat.ledger = super::HeatLedger::default();
            heat.ledger.initial = model.content(heat);
            return Ok(());
        }
    }
    Err(SolverError::HeatNotConverged { residual: f64::NAN, iterations: LINEARIZATIONS })
}
