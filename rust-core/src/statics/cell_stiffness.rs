//! Stiffness of a periodic cell, statically.

use nalgebra::Matrix6;
use rayon::prelude::*;

use super::link::NodeMotion;
use super::network::Loose;
use super::solve::{Accuracy, Method, Operator, add, motion, solve};
use super::{ElasticConstants, LinkNetwork, StaticsError, direct};
use crate::math::Vec3;

/// Stiffness of a periodic cell (Pa; components 11, 22, 33, 23, 31, 12, engineering shear strains; of a plane network the
/// rows and columns 11, 22, 12, all else being zero).
#[derive(Debug, Clone, PartialEq)]
pub struct CellStiffness {
    /// With all particles in equilibrium.
    pub relaxed: Matrix6<f64>,
    /// With all particles on the uniform field, not turning: the affine sum (Stránský 2018, (3.31)), of rigid particles an
    /// upper bound. Deformable particles have the strains that go with the forces of that field.
    pub affine: Matrix6<f64>,
    /// Share of normal, shear, bending, and twist stiffnesses: `relaxed` is their sum, and since the state is a minimum
    /// each is the exact derivative of `relaxed` by the logarithm of those stiffnesses. None with deformable particles:
    /// shear forces strain them without feeling it, so that there is no energy to be a minimum.
    pub share: Option<[Matrix6<f64>; 4]>,
    /// Particles that links do not hold.
    pub loose: Loose,
    /// Iterations of the solver.
    pub iterations: usize,
    /// Links that took part.
    pub links: usize,
    /// The network is one of discs in a plane.
    pub planar: bool,
}

impl CellStiffness {
    /// Constants with all particles in equilibrium.
    ///
    /// # Errors
    /// [`StaticsError::Soft`].
    pub fn constants(&self) -> Result<ElasticConstants, StaticsError> {
        self.constants_of(&self.relaxed)
    }

    /// Constants with all particles on the uniform field.
    ///
    /// # Errors
    /// [`StaticsError::Soft`].
    pub fn affine_constants(&self) -> Result<ElasticConstants, StaticsError> {
        self.constants_of(&self.affine)
    }

    /// Constants of another stiffness (Pa) of the same cell, such as that of relaxed dynamics.
    ///
    /// # Errors
    /// [`StaticsError::Soft`].
    pub fn constants_of(&self, stiffness: &Matrix6<f64>) -> Result<ElasticConstants, StaticsError> {
        if self.planar { ElasticConstants::of_plane(stiffness) } else { ElasticConstants::of(stiffness) }
    }
}

/// The strains that a network can be given: all six, or those of the plane.
pub(super) fn strains(planar: bool) -> impl Iterator<Item = usize> {
    (0..6).filter(move |component| !planar || matches!(component, 0 | 1 | 5))
}

/// Relative motion of the ends of a branch `l` under unit strain `component`.
pub(super) fn uniform(l: &Vec3, component: usize) -> Vec3 {
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
/// [`StaticsError::NoCell`], [`StaticsError::NoLinks`], [`StaticsError::NotConverged`],
/// [`StaticsError::DirectDeformable`].
pub fn cell_stiffness(network: &LinkNetwork, accuracy: Accuracy) -> Result<CellStiffness, StaticsError> {
    let volume = network.volume.ok_or(StaticsError::NoCell)?;
    let planar = network.planar;
    if network.links.is_empty() {
        return Err(StaticsError::NoLinks);
    }
    let rigid = network.compliance.is_empty();
    if !rigid && accuracy.method == Method::Direct {
        return Err(StaticsError::DirectDeformable);
    }
    let still = vec![vec![0.0; 6 * network.particles]; 6];
    let affine = if rigid {
        in_plane(sum(&energies(network, &still)) / volume, planar)
    } else {
        virial(&Operator::of_cell(network), &still) / volume
    };
    let mut held = network.clone();
    let rattlers = held.remove_rattlers();
    if held.links.is_empty() {
        let loose = Loose { rattlers, mechanisms: 0 };
        let share = rigid.then_some([Matrix6::zeros(); 4]);
        return Ok(CellStiffness { relaxed: Matrix6::zeros(), affine, share, loose, iterations: 0, links: 0, planar });
    }
    let scale = held.scale;
    let operator = Operator::of_cell(&held);
    let mut loads = vec![vec![0.0; 6 * held.particles]; 6];
    for component in strains(planar) {
        let answers = operator.answers(&still[component], Some(component));
        let load = &mut loads[component];
        for (link, (force, moment)) in held.links.iter().zip(&answers) {
            let [on_a, on_b] = link.holding(force, moment);
            let minus = |part: NodeMotion| NodeMotion { displacement: -part.displacement, rotation: -part.rotation };
            add(load, link.a as usize, &minus(on_a), scale);
            add(load, link.b as usize, &minus(on_b), scale);
        }
    }
    let largest = held.links.iter().map(|l| l.stiffness.normal * l.branch.norm()).fold(0.0, f64::max);
    // What is left of forces that cancel (a lattice) is no load.
    for load in &mut loads {
        if load.iter().all(|x| x.abs() < 1e-13 * largest) {
            load.fill(0.0);
        }
    }
    let (inverses, singular) = operator.blocks();
    // Rattlers are particles without links now; nothing resists any of their motions.
    let mechanisms = singular - if planar { 3 } else { 6 } * rattlers;
    let names = ["strain 11", "strain 22", "strain 33", "shear 23", "shear 31", "shear 12"];
    let (solutions, iterations) = match accuracy.method {
        Method::Iterative => solve(&operator, &inverses, &loads, &names, accuracy)?,
        Method::Direct => direct::solve(&operator, &loads, &names, accuracy)?,
    };
    let (relaxed, share) = if rigid {
        let share = energies(&held, &solutions).map(|energy| in_plane(energy / volume, planar));
        (sum(&share), Some(share))
    } else {
        (virial(&operator, &solutions) / volume, None)
    };
    let loose = Loose { rattlers, mechanisms };
    Ok(CellStiffness { relaxed, affine, share, loose, iterations, links: held.links.len(), planar })
}

/// The rows and columns 11, 22, 12, if only they mean something.
fn in_plane(mut matrix: Matrix6<f64>, planar: bool) -> Matrix6<f64> {
    if planar {
        for k in 2..5 {
            matrix.fill_row(k, 0.0);
            matrix.fill_column(k, 0.0);
        }
    }
    matrix
}

/// Volume times stress (J) of the states, by columns: `Σ ½(l⊗f + f⊗l)`.
fn virial(operator: &Operator<'_>, states: &[Vec<f64>]) -> Matrix6<f64> {
    let planar = operator.network.planar;
    let mut whole = Matrix6::zeros();
    for column in strains(planar) {
        let answers = operator.answers(&states[column], Some(column));
        for (link, (force, _)) in operator.network.links.iter().zip(&answers) {
            for row in strains(planar) {
                whole[(row, column)] += uniform(&link.branch, row).dot(force);
            }
        }
    }
    whole
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
