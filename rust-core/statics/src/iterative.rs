//! Solution of `K u = f` for many right-hand sides, preconditioned with the inverse of each particle's diagonal block.

use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;

use super::StaticsError;
use super::krylov::{Failure, biconjugate_gradients, conjugate_gradients};
use super::stiffness_product::StiffnessProduct;
use concordem_operator::interruption::Watch;

/// When the iteration stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Norm of the residual over norm of the right-hand side (rotational parts divided by [`LinkNetwork::scale`](crate::LinkNetwork::scale)).
    pub residual: f64,
    /// Largest number of iterations.
    pub iterations: usize,
}

impl Default for Accuracy {
    /// 1e-11, 20 000: the stiffness of a cell is a minimum, so its error is the square of the residual and limited by
    /// rounding.
    fn default() -> Self {
        Self { residual: 1e-11, iterations: 20_000 }
    }
}

/// Solve `K u = f` for each right-hand side. Returns the solutions and the largest number of iterations.
///
/// `rounding`: norm of the roundings in a right-hand side, N. They also load the motions of the whole, which nothing holds, so no residual can be
/// smaller.
pub(super) fn solve(
    product: &StiffnessProduct<'_>,
    inverses: &[Matrix6<f64>],
    loads: &[Vec<f64>],
    names: &[&str],
    accuracy: Accuracy,
    rounding: f64,
) -> Result<(Vec<Vec<f64>>, usize), StaticsError> {
    let watch = Watch::here();
    let solved: Result<Vec<(Vec<f64>, usize)>, StaticsError> = loads
        .par_iter()
        .zip(names)
        .map(|(load, name)| {
            if load.iter().all(|x| *x == 0.0) {
                return Ok((vec![0.0; product.size()], 0));
            }
            let what = (*name).to_owned();
            let norm = load.iter().map(|x| x * x).sum::<f64>().sqrt();
            let tolerance = accuracy.residual.max(rounding / norm);
            let not_converged = |residual| StaticsError::NotConverged {
                what: what.clone(),
                residual,
                wanted: tolerance,
                iterations: accuracy.iterations,
            };
            let multiply = |y: &mut [f64], x: &[f64]| {
                watch.look();
                product.multiply(y, x);
            };
            let precondition = |y: &mut [f64], x: &[f64]| {
                for ((y, x), inverse) in y.chunks_exact_mut(6).zip(x.chunks_exact(6)).zip(inverses) {
                    y.copy_from_slice((inverse * Vector6::from_column_slice(x)).as_slice());
                }
            };
            let (solution, iterations) = if product.coupling.is_some() {
                biconjugate_gradients(multiply, precondition, load, tolerance, accuracy.iterations)
            } else {
                conjugate_gradients(multiply, precondition, load, tolerance, accuracy.iterations)
            }
            .map_err(|failure| match failure {
                Failure::NotConverged(residual) => not_converged(residual),
                Failure::Indefinite => StaticsError::Unsupported { what: what.clone() },
            })?;
            if product.coupling.is_some() {
                // Biconjugate gradients may break down without an error.
                let residual = residual(product, &solution, load);
                if residual.is_nan() || residual > 10.0 * tolerance {
                    return Err(not_converged(residual));
                }
            }
            Ok((solution, iterations))
        })
        .collect();
    let solved = solved?;
    let iterations = solved.iter().map(|s| s.1).max().unwrap_or(0);
    Ok((solved.into_iter().map(|s| s.0).collect(), iterations))
}

/// Norm of `f − K u` over that of `f`.
fn residual(product: &StiffnessProduct<'_>, solution: &[f64], load: &[f64]) -> f64 {
    let mut image = vec![0.0; solution.len()];
    product.multiply(&mut image, solution);
    let square = |values: &mut dyn Iterator<Item = f64>| values.map(|x| x * x).sum::<f64>();
    let left = square(&mut image.iter().zip(load).map(|(y, f)| f - y));
    (left / square(&mut load.iter().copied())).sqrt()
}
