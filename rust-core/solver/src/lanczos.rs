//! Largest eigenvalue of a symmetric operator on six reals per particle, by Lanczos iteration.

use nalgebra::{DMatrix, SymmetricEigen, Vector6};
use rayon::prelude::*;

use concordem_contact::math::{Vec3, any_perpendicular};
use concordem_operator::interruption::look;

/// Interval of the largest eigenvalue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Upper end: Ritz value plus residual norm, at most the ceiling.
    pub upper: f64,
    /// Residual norm; an eigenvalue lies within twice this below the upper end.
    pub width: f64,
    /// Number of iterations.
    pub iterations: usize,
}

/// A unit vector without symmetry (alternating, with incommensurate weights), zero where `free` is false.
pub(super) fn start(n: usize, free: impl Fn(usize, usize) -> bool) -> Vec<Vector6<f64>> {
    let t = any_perpendicular(&Vec3::new(1.0, 0.3, 0.2).normalize());
    let mut v: Vec<Vector6<f64>> = (0..n)
        .map(|p| {
            Vector6::from_fn(|i, _| {
                let phase = (p * 6 + i) as f64 * 0.618_033_988_749_894_9;
                if free(p, i) { (phase - phase.floor()) - 0.5 + 0.1 * t[i % 3] } else { 0.0 }
            })
        })
        .collect();
    let norm = dot(&v, &v).sqrt();
    if norm > 0.0 {
        for x in &mut v {
            *x /= norm;
        }
    }
    v
}

fn dot(a: &[Vector6<f64>], b: &[Vector6<f64>]) -> f64 {
    let products: Vec<f64> = a.par_iter().zip(b).with_min_len(SMALL).map(|(x, y)| x.dot(y)).collect();
    // In the order of the particles, for any number of threads.
    products.iter().sum()
}

/// Fewest particles that a thread computes at a time.
const SMALL: usize = 1 << 12;

/// Largest eigenvalue of the operator `apply`, known to be at most `ceiling`, among vectors that are zero where `free`
/// is false. The residual is at most `tolerance` times the eigenvalue.
pub(super) fn largest_eigenvalue(
    n: usize,
    free: impl Fn(usize, usize) -> bool,
    ceiling: f64,
    tolerance: f64,
    mut apply: impl FnMut(&[Vector6<f64>], &mut [Vector6<f64>]),
) -> Interval {
    const STEPS: usize = 200;
    let mut v = start(n, free);
    if dot(&v, &v) == 0.0 {
        return Interval { upper: 0.0, width: 0.0, iterations: 0 };
    }
    let mut previous = vec![Vector6::zeros(); n];
    let mut w = vec![Vector6::zeros(); n];
    let (mut alpha, mut beta) = (Vec::new(), Vec::<f64>::new());
    let mut best = Interval { upper: ceiling, width: ceiling, iterations: 0 };
    for step in 1..=STEPS.min(6 * n) {
        look();
        apply(&v, &mut w);
        let a = dot(&v, &w);
        let b_old = beta.last().copied().unwrap_or(0.0);
        let terms = w.par_iter_mut().zip(&v).zip(&previous).with_min_len(SMALL);
        terms.for_each(|((w, v), p)| *w -= v * a + p * b_old);
        alpha.push(a);
        let b = dot(&w, &w).sqrt();
        if step % 10 == 0 || b <= 1e-14 * ceiling || step == STEPS.min(6 * n) {
            let t = DMatrix::from_fn(step, step, |i, j| {
                if i == j {
                    alpha[i]
                } else if i.abs_diff(j) == 1 {
                    beta[i.min(j)]
                } else {
                    0.0
                }
            });
            let eigen = SymmetricEigen::new(t);
            let top = eigen.eigenvalues.imax();
            let theta = eigen.eigenvalues[top];
            let residual = (b * eigen.eigenvectors[(step - 1, top)]).abs();
            best = Interval { upper: (theta + residual).min(ceiling), width: residual, iterations: step };
            if residual <= tolerance * theta || b <= 1e-14 * ceiling {
                break;
            }
        }
        beta.push(b);
        std::mem::swap(&mut previous, &mut v);
        v.par_iter_mut().zip(&w).with_min_len(SMALL).for_each(|(v, w)| *v = w / b);
    }
    best
}
