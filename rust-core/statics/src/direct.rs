//! Solution of `K u = f` for a periodic cell by a sparse Cholesky factor (`faer`, approximate minimum degree).
//!
//! `K` is singular in the zero-energy modes: the translation of each connected part, and motions of single particles
//! that none of their links resists. These modes carry no load, so a stiffness added to one translation of each part
//! and to those motions changes nothing except that they become zero; its size does not enter the solution. In space
//! the fill-in of the factor grows with the four-thirds power of the number of particles: beyond some 10⁴ the iteration
//! is better ([`super::solve`]).

use faer::linalg::solvers::SolveCore;
use faer::sparse::linalg::cholesky::{CholeskySymbolicParams, SymmetricOrdering, factorize_symbolic_cholesky};
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Conj, MatMut, Side};
use nalgebra::Matrix6;

use super::iterative::residual;
use super::solve::Accuracy;
use super::stiffness_product::StiffnessProduct;
use super::{LinkNetwork, StaticsError};

/// Number of refinements of a solution by its residual.
const REFINEMENTS: usize = 4;

/// Largest memory of a factor, GB. The iteration is faster long before.
const MAX_GIGABYTES: f64 = 12.0;

/// Memory of the numbers in the Cholesky factor, bytes.
fn bytes(matrix: &SparseColMat<usize, f64>) -> Result<usize, StaticsError> {
    let parameters = CholeskySymbolicParams::default();
    factorize_symbolic_cholesky(matrix.symbolic(), Side::Lower, SymmetricOrdering::Amd, parameters)
        .map(|symbolic| symbolic.len_val() * size_of::<f64>())
        .map_err(|error| StaticsError::Factor { problem: format!("{error:?}") })
}

/// Solve for each right-hand side; returns the solutions and the number of refinements.
pub(super) fn solve(
    product: &StiffnessProduct<'_>,
    loads: &[Vec<f64>],
    names: &[&str],
    accuracy: Accuracy,
) -> Result<(Vec<Vec<f64>>, usize), StaticsError> {
    let unfit = |problem: String| StaticsError::Factor { problem };
    let matrix = assemble(product)?;
    let symbolic = SymbolicLlt::try_new(matrix.symbolic(), Side::Lower).map_err(|e| unfit(format!("{e:?}")))?;
    let gigabytes = bytes(&matrix)? as f64 * 1e-9;
    if gigabytes > MAX_GIGABYTES {
        return Err(unfit(format!("the factor would take {gigabytes:.1} GB; the limit is {MAX_GIGABYTES} GB")));
    }
    let factor =
        Llt::try_new_with_symbolic(symbolic, matrix.as_ref(), Side::Lower).map_err(|e| unfit(format!("{e:?}")))?;
    let rows = product.size();
    let mut solutions = Vec::with_capacity(loads.len());
    let mut most = 0;
    for (load, name) in loads.iter().zip(names) {
        let mut solution = vec![0.0; rows];
        if load.iter().all(|x| *x == 0.0) {
            solutions.push(solution);
            continue;
        }
        let mut left = 1.0;
        let mut rest = load.clone();
        for round in 0..=REFINEMENTS {
            factor.solve_in_place_with_conj(Conj::No, MatMut::from_column_major_slice_mut(&mut rest, rows, 1));
            for (x, change) in solution.iter_mut().zip(&rest) {
                *x += change;
            }
            most = most.max(round);
            left = residual(product, &solution, load);
            if left <= accuracy.residual || left.is_nan() {
                break;
            }
            product.multiply(&mut rest, &solution);
            for (rest, load) in rest.iter_mut().zip(load) {
                *rest = load - *rest;
            }
        }
        if left.is_nan() || left > accuracy.residual {
            return Err(unfit(format!(
                "{name}: the relative residual is {left:.1e} after {REFINEMENTS} refinements; the limit is {:.1e}. Part of \
                 the packing may be a mechanism",
                accuracy.residual
            )));
        }
        solutions.push(solution);
    }
    Ok((solutions, most))
}

/// Lower triangle of the stiffness, made positive definite in its zero-energy modes.
fn assemble(product: &StiffnessProduct<'_>) -> Result<SparseColMat<usize, f64>, StaticsError> {
    let network = product.network;
    let blocks = product.diagonal_blocks();
    let (inverses, _) = product.inverse_diagonal_blocks();
    let size = blocks.iter().map(|block| block.abs().max()).fold(0.0, f64::max);
    let mut entries = Vec::with_capacity(36 * network.links.len() + 21 * network.particles);
    let mut lower = |row: usize, column: usize, value: f64| {
        if row >= column && value != 0.0 {
            entries.push(Triplet::new(row, column, value));
        }
    };
    for (p, (block, inverse)) in blocks.iter().zip(&inverses).enumerate() {
        let own = block.abs().max();
        let filler = if own > 0.0 { own } else { size };
        let filled = block + (Matrix6::identity() - block * inverse) * filler;
        for i in 0..6 {
            for j in 0..=i {
                lower(6 * p + i, 6 * p + j, 0.5 * (filled[(i, j)] + filled[(j, i)]));
            }
        }
    }
    for link in network.links.iter().filter(|link| link.a != link.b) {
        let matrix = link.scaled_matrix(network.scale);
        let (a, b) = (6 * link.a as usize, 6 * link.b as usize);
        for i in 0..6 {
            for j in 0..6 {
                if product.is_free(link.a as usize, i) && product.is_free(link.b as usize, j) {
                    lower((a + i).max(b + j), (a + i).min(b + j), matrix[(i, 6 + j)]);
                }
            }
        }
    }
    for p in one_of_each_part(network) {
        for i in 0..3 {
            lower(6 * p + i, 6 * p + i, size);
        }
    }
    let rows = product.size();
    SparseColMat::try_new_from_triplets(rows, rows, &entries)
        .map_err(|error| StaticsError::Factor { problem: format!("{error:?}") })
}

/// One particle of each connected part of the network, without particles that have no links.
fn one_of_each_part(network: &LinkNetwork) -> Vec<usize> {
    fn root(parent: &mut [u32], mut p: u32) -> u32 {
        while parent[p as usize] != p {
            parent[p as usize] = parent[parent[p as usize] as usize];
            p = parent[p as usize];
        }
        p
    }
    let mut parent: Vec<u32> = (0..network.particles as u32).collect();
    let mut linked = vec![false; network.particles];
    for link in &network.links {
        let (a, b) = (root(&mut parent, link.a), root(&mut parent, link.b));
        parent[a.max(b) as usize] = a.min(b);
        (linked[link.a as usize], linked[link.b as usize]) = (true, true);
    }
    (0..network.particles).filter(|&p| linked[p] && parent[p] == p as u32).collect()
}
