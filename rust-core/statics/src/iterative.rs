//! Iterative solution of `K u = f` with [`faer`].

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::matrix_free::bicgstab::{BicgError, BicgParams, bicgstab, bicgstab_scratch};
use faer::matrix_free::conjugate_gradient::{CgError, CgParams, conjugate_gradient, conjugate_gradient_scratch};
use faer::matrix_free::{IdentityPrecond, LinOp, Precond};
use faer::{MatMut, MatRef, Par};
use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;

use super::StaticsError;
use super::solve::Accuracy;
use super::stiffness_product::StiffnessProduct;

/// Block-diagonal preconditioner: inverse diagonal blocks by particle.
#[derive(Debug)]
struct Blocks<'a>(&'a [Matrix6<f64>]);

/// The single column of a matrix.
fn column(x: MatRef<'_, f64>) -> &[f64] {
    x.col(0).try_as_col_major().expect("columns of dense matrices lie in one piece").as_slice()
}

fn column_mut(x: MatMut<'_, f64>) -> &mut [f64] {
    x.col_mut(0).try_as_col_major_mut().expect("columns of dense matrices lie in one piece").as_slice_mut()
}

impl LinOp<f64> for StiffnessProduct<'_> {
    fn apply_scratch(&self, _columns: usize, _par: Par) -> StackReq {
        StackReq::EMPTY
    }
    fn nrows(&self) -> usize {
        self.size()
    }
    fn ncols(&self) -> usize {
        self.size()
    }
    fn apply(&self, out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, _par: Par, _stack: &mut MemStack) {
        self.multiply(column_mut(out), column(rhs));
    }
    fn conj_apply(&self, out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, par: Par, stack: &mut MemStack) {
        self.apply(out, rhs, par, stack);
    }
}

impl LinOp<f64> for Blocks<'_> {
    fn apply_scratch(&self, _columns: usize, _par: Par) -> StackReq {
        StackReq::EMPTY
    }
    fn nrows(&self) -> usize {
        6 * self.0.len()
    }
    fn ncols(&self) -> usize {
        6 * self.0.len()
    }
    fn apply(&self, out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, _par: Par, _stack: &mut MemStack) {
        let (out, rhs) = (column_mut(out), column(rhs));
        for ((y, x), inverse) in out.chunks_exact_mut(6).zip(rhs.chunks_exact(6)).zip(self.0) {
            y.copy_from_slice((inverse * Vector6::from_column_slice(x)).as_slice());
        }
    }
    fn conj_apply(&self, out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, par: Par, stack: &mut MemStack) {
        self.apply(out, rhs, par, stack);
    }
}

impl Precond<f64> for Blocks<'_> {}

/// Solve `K u = f` for each right-hand side. Returns the solutions and the largest number of iterations.
pub(super) fn solve(
    product: &StiffnessProduct<'_>,
    inverses: &[Matrix6<f64>],
    loads: &[Vec<f64>],
    names: &[&str],
    accuracy: Accuracy,
) -> Result<(Vec<Vec<f64>>, usize), StaticsError> {
    let solved: Result<Vec<(Vec<f64>, usize)>, StaticsError> = loads
        .par_iter()
        .zip(names)
        .map(|(load, name)| {
            let rows = product.size();
            let mut solution = vec![0.0; rows];
            let norm = load.iter().map(|x| x * x).sum::<f64>().sqrt();
            if norm == 0.0 {
                return Ok((solution, 0));
            }
            let what = (*name).to_owned();
            let not_converged = |residual| StaticsError::NotConverged {
                what: what.clone(),
                residual,
                wanted: accuracy.residual,
                iterations: accuracy.iterations,
            };
            let iterations = if product.coupling.is_some() {
                biconjugate_gradients(product, inverses, load, &mut solution, accuracy)
            } else {
                conjugate_gradients(product, inverses, load, &mut solution, accuracy)
            }
            .map_err(|failure| match failure {
                Failure::NotConverged(residual) => not_converged(residual),
                Failure::Indefinite => StaticsError::Unsupported { what: what.clone() },
            })?;
            if product.coupling.is_some() {
                // Biconjugate gradients may break down without an error.
                let residual = residual(product, &solution, load);
                if residual.is_nan() || residual > 10.0 * accuracy.residual {
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

/// Why an iteration stopped.
enum Failure {
    /// At this relative residual.
    NotConverged(f64),
    /// The matrix or the preconditioner is not positive definite: a mechanism.
    Indefinite,
}

/// Preconditioned conjugate gradients; returns the number of iterations.
fn conjugate_gradients(
    product: &StiffnessProduct<'_>,
    inverses: &[Matrix6<f64>],
    load: &[f64],
    solution: &mut [f64],
    accuracy: Accuracy,
) -> Result<usize, Failure> {
    let rows = product.size();
    let solution = MatMut::from_column_major_slice_mut(solution, rows, 1);
    let load = MatRef::from_column_major_slice(load, rows, 1);
    let mut memory = MemBuffer::new(conjugate_gradient_scratch(Blocks(inverses), product, 1, Par::Seq));
    // faer does not allow its fields in a literal.
    #[allow(clippy::field_reassign_with_default)]
    let parameters = {
        let mut parameters = CgParams::default();
        parameters.rel_tolerance = accuracy.residual;
        parameters.abs_tolerance = 0.0;
        parameters.max_iters = accuracy.iterations;
        parameters
    };
    let stack = MemStack::new(&mut memory);
    match conjugate_gradient(solution, Blocks(inverses), product, load, parameters, |_| {}, Par::Seq, stack) {
        Ok(info) => Ok(info.iter_count),
        Err(CgError::NoConvergence { rel_residual, .. }) => Err(Failure::NotConverged(rel_residual)),
        Err(CgError::NonPositiveDefiniteOperator | CgError::NonPositiveDefinitePreconditioner) => {
            Err(Failure::Indefinite)
        }
    }
}

/// Preconditioned stabilized biconjugate gradients; returns the number of iterations.
fn biconjugate_gradients(
    product: &StiffnessProduct<'_>,
    inverses: &[Matrix6<f64>],
    load: &[f64],
    solution: &mut [f64],
    accuracy: Accuracy,
) -> Result<usize, Failure> {
    let rows = product.size();
    let solution = MatMut::from_column_major_slice_mut(solution, rows, 1);
    let load = MatRef::from_column_major_slice(load, rows, 1);
    let without = IdentityPrecond { dim: rows };
    let mut memory = MemBuffer::new(bicgstab_scratch(Blocks(inverses), without, product, 1, Par::Seq));
    // faer does not allow its fields in a literal.
    #[allow(clippy::field_reassign_with_default)]
    let parameters = {
        let mut parameters = BicgParams::default();
        parameters.rel_tolerance = accuracy.residual;
        parameters.abs_tolerance = 0.0;
        parameters.max_iters = accuracy.iterations;
        parameters
    };
    let stack = MemStack::new(&mut memory);
    match bicgstab(solution, Blocks(inverses), without, product, load, parameters, |_| {}, Par::Seq, stack) {
        Ok(info) => Ok(info.iter_count),
        Err(BicgError::NoConvergence { rel_residual, .. }) => Err(Failure::NotConverged(rel_residual)),
    }
}

/// Norm of `f − K u` over that of `f`.
pub(super) fn residual(product: &StiffnessProduct<'_>, solution: &[f64], load: &[f64]) -> f64 {
    let mut image = vec![0.0; solution.len()];
    product.multiply(&mut image, solution);
    let square = |values: &mut dyn Iterator<Item = f64>| values.map(|x| x * x).sum::<f64>();
    let left = square(&mut image.iter().zip(load).map(|(y, f)| f - y));
    (left / square(&mut load.iter().copied())).sqrt()
}
