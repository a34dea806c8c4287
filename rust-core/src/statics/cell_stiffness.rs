//! Stiffness of a periodic cell, statically.

use nalgebra::Matrix6;
use rayon::prelude::*;

use super::link::{LinkStrain, NodeMotion};
use super::network::Loose;
use super::solve::{Accuracy, Operator, add, motion, solve};
use super::{LinkNetwork, StaticsError};
use crate::math::Vec3;

/// Stiffness of a periodic cell (Pa; components 11, 22, 33, 23, 31, 12, engineering shear strains).
#[derive(Debug, Clone, PartialEq)]
pub struct CellStiffness {
    /// With all particles in equilibrium.
    pub relaxed: Matrix6<f64>,
    /// With all particles on the uniform field, not turning: the affine sum (Stránský 2018, (3.31)), an upper bound.
    pub affine: Matrix6<f64>,
    /// Share of normal, shear, bending, and twist stiffnesses: `relaxed` is their sum, and since the state is a minimum
    /// each is the exact derivative of `relaxed` by the logarithm of those stiffnesses.
    pub share: [Matrix6<f64>; 4],
    /// Particles that links do not hold.
    pub loose: Loose,
    /// Iterations of the solver.
    pub iterations: usize,
    /// Links that took part.
    pub links: usize,
}

/// Relative motion of the ends of a branch `l` under unit strain `component`.
fn uniform(l: &Vec3, component: usize) -> Vec3 {
    match component {
        0 => Vec3::new(l.x, 0.0, 0.0),
        1 => Vec3::new(0.0, l.y, 0.0),
        2 => Vec3::new(0.0, 0.0, l.z),
        3 => Vec3::new(0.0, 0.5 * l.z, 0.5 * l.y),
        4 => Vec3::new(0.5 * l.z, 0.0, 0.5 * l.x),
        _ => Vec3::new(0.5 * l.y, 0.5 * l.x, 0.0),
    }
}

/// Stiffness of the periodic cell of a network: six solutions with one unit strain each (Stránský 2018, (3.58)–(3.63),
/// with the uniform part of the displacement taken out: what is solved for is periodic).
///
/// # Errors
/// [`StaticsError::NoCell`], [`StaticsError::NoLinks`], [`StaticsError::NotConverged`].
pub fn cell_stiffness(network: &LinkNetwork, accuracy: Accuracy) -> Result<CellStiffness, StaticsError> {
    let volume = network.volume.ok_or(StaticsError::NoCell)?;
    if network.links.is_empty() {
        return Err(StaticsError::NoLinks);
    }
    let still = vec![vec![0.0; 6 * network.particles]; 6];
    let affine = sum(&energies(network, &still)) / volume;
    let mut held = network.clone();
    let rattlers = held.remove_rattlers();
    if held.links.is_empty() {
        let loose = Loose { rattlers, mechanisms: 0 };
        let share = [Matrix6::zeros(); 4];
        return Ok(CellStiffness { relaxed: Matrix6::zeros(), affine, share, loose, iterations: 0, links: 0 });
    }
    let scale = held.scale;
    let loads: Vec<Vec<f64>> = (0..6)
        .map(|component| {
            let mut load = vec![0.0; 6 * held.particles];
            for link in &held.links {
                let strain = LinkStrain { displacement: uniform(&link.branch, component), rotation: Vec3::zeros() };
                let (force, moment) = link.answer(&strain);
                let [on_a, on_b] = link.holding(&force, &moment);
                let minus =
                    |part: NodeMotion| NodeMotion { displacement: -part.displacement, rotation: -part.rotation };
                add(&mut load, link.a as usize, &minus(on_a), scale);
                add(&mut load, link.b as usize, &minus(on_b), scale);
            }
            load
        })
        .collect();
    let largest = held.links.iter().map(|l| l.stiffness.normal * l.branch.norm()).fold(0.0, f64::max);
    // What is left of forces that cancel (a lattice) is no load.
    let loads: Vec<Vec<f64>> = loads
        .into_iter()
        .map(|load| if load.iter().all(|x| x.abs() < 1e-13 * largest) { vec![0.0; load.len()] } else { load })
        .collect();
    let operator = Operator { network: &held, free: Vec::new() };
    let (inverses, singular) = operator.blocks();
    // Rattlers are particles without links now; each has six motions that nothing resists.
    let mechanisms = singular - 6 * rattlers;
    let names = ["strain 11", "strain 22", "strain 33", "shear 23", "shear 31", "shear 12"];
    let (solutions, iterations) = solve(&operator, &inverses, &loads, &names, accuracy)?;
    let share = energies(&held, &solutions).map(|energy| energy / volume);
    Ok(CellStiffness {
        relaxed: sum(&share),
        affine,
        share,
        loose: Loose { rattlers, mechanisms },
        iterations,
        links: held.links.len(),
    })
}

fn sum(parts: &[Matrix6<f64>; 4]) -> Matrix6<f64> {
    parts[0] + parts[1] + parts[2] + parts[3]
}

/// Mutual energies (twice the stored one, J) of the six states, by kind of stiffness.
fn energies(network: &LinkNetwork, states: &[Vec<f64>]) -> [Matrix6<f64>; 4] {
    const TILE: usize = 4096;
    let scale = network.scale;
    let tiles: Vec<[Matrix6<f64>; 4]> = network
        .links
        .par_chunks(TILE)
        .map(|links| {
            let mut parts = [Matrix6::zeros(); 4];
            for link in links {
                let (a, b) = (link.a as usize, link.b as usize);
                let strains: [[Vec3; 4]; 6] = std::array::from_fn(|component| {
                    let x = &states[component];
                    let mut strain = link.strain(&motion(x, a, scale), &motion(x, b, scale));
                    strain.displacement += uniform(&link.branch, component);
                    strain.split(&link.normal)
                });
                for (kind, stiffness) in link.stiffnesses().into_iter().enumerate() {
                    for i in 0..6 {
                        for j in 0..6 {
                            parts[kind][(i, j)] += stiffness * strains[i][kind].dot(&strains[j][kind]);
                        }
                    }
                }
            }
            parts
        })
        .collect();
    tiles.into_iter().fold([Matrix6::zeros(); 4], |mut total, tile| {
        for (total, tile) in total.iter_mut().zip(tile) {
            *total += tile;
        }
        total
    })
}
