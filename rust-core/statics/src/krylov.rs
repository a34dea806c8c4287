//! Preconditioned conjugate gradients and stabilized biconjugate gradients for operators without a matrix.
//!
//! Every sum runs over its terms in order and on one thread, with plain products, so that the bits depend neither on the
//! number of threads nor on the processor. Both methods start from zero and end when the norm of the residual is at most
//! `tolerance` times that of the right-hand side.

/// Why an iteration stopped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Failure {
    /// At this relative residual.
    NotConverged(f64),
    /// The operator or the preconditioner is not positive definite: a mechanism.
    Indefinite,
}

/// A linear map `y ← A x`, called as `map(y, x)`.
pub(super) trait Map: Fn(&mut [f64], &[f64]) {}
impl<F: Fn(&mut [f64], &[f64])> Map for F {}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `a ← a + factor b`.
fn add(a: &mut [f64], factor: f64, b: &[f64]) {
    for (a, b) in a.iter_mut().zip(b) {
        *a += factor * b;
    }
}

/// Solve `A x = right` for symmetric positive definite `A` and preconditioner (Hestenes & Stiefel 1952). Returns the
/// solution and the number of iterations.
pub(super) fn conjugate_gradients(
    operator: impl Map,
    precondition: impl Map,
    right: &[f64],
    tolerance: f64,
    iterations: usize,
) -> Result<(Vec<f64>, usize), Failure> {
    let n = right.len();
    let norm = dot(right, right).sqrt();
    let (mut solution, mut residual) = (vec![0.0; n], right.to_vec());
    let (mut preconditioned, mut image) = (vec![0.0; n], vec![0.0; n]);
    precondition(&mut preconditioned, &residual);
    let mut direction = preconditioned.clone();
    let mut power = dot(&residual, &preconditioned);
    let mut size = norm;
    for count in 0..=iterations {
        if size <= tolerance * norm {
            return Ok((solution, count));
        }
        operator(&mut image, &direction);
        let curvature = dot(&direction, &image);
        if power <= 0.0 || curvature <= 0.0 || curvature.is_nan() {
            return Err(Failure::Indefinite);
        }
        let step = power / curvature;
        add(&mut solution, step, &direction);
        add(&mut residual, -step, &image);
        size = dot(&residual, &residual).sqrt();
        precondition(&mut preconditioned, &residual);
        let next = dot(&residual, &preconditioned);
        let factor = next / power;
        power = next;
        for (direction, preconditioned) in direction.iter_mut().zip(&preconditioned) {
            *direction = preconditioned + factor * *direction;
        }
    }
    Err(Failure::NotConverged(size / norm))
}

/// Solve `A x = right` for any regular `A` (van der Vorst 1992, SIAM J. Sci. Stat. Comput. 13:631; preconditioned from the
/// right). Returns the solution and the number of iterations. The method may break down, which the residual shows.
pub(super) fn biconjugate_gradients(
    operator: impl Map,
    precondition: impl Map,
    right: &[f64],
    tolerance: f64,
    iterations: usize,
) -> Result<(Vec<f64>, usize), Failure> {
    let n = right.len();
    let norm = dot(right, right).sqrt();
    let (mut solution, mut residual) = (vec![0.0; n], right.to_vec());
    let shadow = right.to_vec();
    let (mut direction, mut image) = (vec![0.0; n], vec![0.0; n]);
    let (mut preconditioned, mut second) = (vec![0.0; n], vec![0.0; n]);
    let (mut power, mut step, mut weight) = (1.0, 1.0, 1.0);
    let mut size = norm;
    for count in 0..=iterations {
        if size <= tolerance * norm {
            return Ok((solution, count));
        }
        let next = dot(&shadow, &residual);
        let factor = next / power * (step / weight);
        power = next;
        for ((direction, residual), image) in direction.iter_mut().zip(&residual).zip(&image) {
            *direction = residual + factor * (*direction - weight * image);
        }
        precondition(&mut preconditioned, &direction);
        operator(&mut image, &preconditioned);
        step = power / dot(&shadow, &image);
        add(&mut solution, step, &preconditioned);
        add(&mut residual, -step, &image);
        size = dot(&residual, &residual).sqrt();
        if size <= tolerance * norm {
            return Ok((solution, count + 1));
        }
        precondition(&mut preconditioned, &residual);
        operator(&mut second, &preconditioned);
        weight = dot(&second, &residual) / dot(&second, &second);
        add(&mut solution, weight, &preconditioned);
        add(&mut residual, -weight, &second);
        size = dot(&residual, &residual).sqrt();
        if size.is_nan() {
            break;
        }
    }
    Err(Failure::NotConverged(size / norm))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// A matrix with eigenvalues between 1 and 1e4; if `skew`, with an antisymmetric part of half its size.
    fn matrix(n: usize, skew: bool) -> DMatrix<f64> {
        let wave = |i: usize, j: usize| ((i * 7 + j * 13) as f64 * 0.37).sin();
        let basis = DMatrix::from_fn(n, n, wave).qr().q();
        let scale = DMatrix::from_diagonal(&DVector::from_fn(n, |i, _| 1e4_f64.powf(i as f64 / (n - 1) as f64)));
        let symmetric = &basis * scale * basis.transpose();
        let turn = DMatrix::from_fn(n, n, |i, j| if skew { 0.5 * (wave(i, j) - wave(j, i)) } else { 0.0 });
        symmetric + turn
    }

    fn times(a: &DMatrix<f64>) -> impl Fn(&mut [f64], &[f64]) + '_ {
        move |y, x| y.copy_from_slice((a * DVector::from_column_slice(x)).as_slice())
    }

    /// Both methods against LU factors. The error is at most the residual times the condition number, 1e-12 · 1e4.
    #[test]
    fn solutions_are_those_of_a_factor() {
        let n = 60;
        for skew in [false, true] {
            let a = matrix(n, skew);
            let right = DVector::from_fn(n, |i, _| (i as f64 * 0.7).cos());
            let expected = a.clone().lu().solve(&right).unwrap();
            let jacobi = |y: &mut [f64], x: &[f64]| {
                for (i, (y, x)) in y.iter_mut().zip(x).enumerate() {
                    *y = x / a[(i, i)];
                }
            };
            let found = if skew {
                biconjugate_gradients(times(&a), jacobi, right.as_slice(), 1e-12, 1000)
            } else {
                conjugate_gradients(times(&a), jacobi, right.as_slice(), 1e-12, 1000)
            };
            let (solution, iterations) = found.unwrap();
            let error = (DVector::from_vec(solution) - &expected).norm() / expected.norm();
            assert!(error < 1e-8, "{skew}: {error:e} after {iterations}");
            assert!(iterations > 5, "{iterations}");
        }
    }

    /// Too few iterations and negative curvature are errors.
    #[test]
    fn failures_are_named() {
        let a = matrix(30, false);
        let same = |y: &mut [f64], x: &[f64]| y.copy_from_slice(x);
        let right = vec![1.0; 30];
        let short = conjugate_gradients(times(&a), same, &right, 1e-12, 2);
        assert!(matches!(short, Err(Failure::NotConverged(left)) if left > 1e-12), "{short:?}");
        let short = biconjugate_gradients(times(&a), same, &right, 1e-12, 1);
        assert!(matches!(short, Err(Failure::NotConverged(left)) if left > 1e-12), "{short:?}");
        assert_eq!(conjugate_gradients(times(&-a), same, &right, 1e-12, 100), Err(Failure::Indefinite));
    }
}
