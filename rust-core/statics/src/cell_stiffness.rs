//! Stiffness of a periodic cell from the static network.

use nalgebra::Matrix6;
use rayon::prelude::*;

use super::iterative::{Accuracy, solve};
use super::link::{LinkStrain, NodeMotion, uniform};
use super::network::Loose;
use super::stiffness_product::{StiffnessProduct, add, motion, relief};
use super::{ElasticConstants, LinkNetwork, StaticsError};
use concordem_contact::kinematics::deformable::Compliance;
use concordem_contact::math::{Symmetric, Vec3};

/// Stiffness of a periodic cell (Pa; components 11, 22, 33, 23, 31, 12, engineering shear strains). For a plane network
/// only rows and columns 11, 22, 12 are not zero.
#[derive(Debug, Clone, PartialEq)]
pub struct CellStiffness {
    /// With all particles in equilibrium.
    pub relaxed: Matrix6<f64>,
    /// With all particles on the uniform field, without rotation: the affine sum (Stránský 2018, (3.31)). For rigid
    /// particles it is an upper bound. Deformable particles have the strains that belong to the forces of that field.
    pub affine: Matrix6<f64>,
    /// Exact derivatives of `relaxed`; for deformable particles only from [`cell_stiffness_and_derivatives`].
    pub derivatives: Option<Derivatives>,
    /// Particles that links do not hold.
    pub loose: Loose,
    /// Iterations of the solver.
    pub iterations: usize,
    /// Number of links in the solution.
    pub links: usize,
    /// Whether the network is one of discs in a plane.
    pub planar: bool,
}

/// Exact derivatives of the relaxed stiffness (Pa, for all entries). Those by logarithms sum up to the stiffness
/// itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Derivatives {
    /// By the logarithm of the normal, shear, bending, and twist stiffnesses of all links.
    pub links: [Matrix6<f64>; 4],
    /// By the logarithm of the modulus of all deformable particles.
    pub particle_young: Matrix6<f64>,
    /// By Poisson's ratio of all deformable particles.
    pub particle_poisson: Matrix6<f64>,
}

impl Derivatives {
    /// All zero.
    pub(super) fn zero() -> Self {
        Self { links: [Matrix6::zeros(); 4], particle_young: Matrix6::zeros(), particle_poisson: Matrix6::zeros() }
    }

    /// Derivatives for a cell with all stiffnesses, moduli of particles included, multiplied by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            links: self.links.map(|links| links * factor),
            particle_young: self.particle_young * factor,
            particle_poisson: self.particle_poisson * factor,
        }
    }
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

    /// Constants from another stiffness (Pa) of the same cell, such as that of relaxed dynamics.
    ///
    /// # Errors
    /// [`StaticsError::Soft`].
    pub fn constants_of(&self, stiffness: &Matrix6<f64>) -> Result<ElasticConstants, StaticsError> {
        if self.planar { ElasticConstants::of_plane(stiffness) } else { ElasticConstants::of(stiffness) }
    }
}

/// Fraction of the largest force of a link below which a load is a rounding remainder, also after many steps in which positions were rounded.
const CANCELED: f64 = 1e-9;
/// Rounding of a load as a part of the largest force of a link: sums of some thirty forces.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// Components of strain of a network: all six, or those of the plane.
pub(super) fn strains(planar: bool) -> impl Iterator<Item = usize> {
    (0..6).filter(move |component| !planar || matches!(component, 0 | 1 | 5))
}

/// Stiffness of the periodic cell of a network from six solutions with one unit strain each (Stránský 2018,
/// (3.58)–(3.63)). The unknowns are the periodic displacements on top of the uniform field.
///
/// # Errors
/// [`StaticsError::NoCell`], [`StaticsError::NoLinks`], [`StaticsError::NotConverged`].
pub fn cell_stiffness(network: &LinkNetwork, accuracy: Accuracy) -> Result<CellStiffness, StaticsError> {
    find(network, accuracy, false)
}

/// [`cell_stiffness`] with its derivatives also for deformable particles, which takes another six solutions; for rigid
/// ones the derivatives cost nothing.
///
/// The stiffness is `V D_ij = v_i·a_j` with the uniform motion `v` along the links and their forces
/// `a = r − k_N n(n·W n)`; `r` are the forces of rigid particles and `W = C T(a)` the surface displacement of both ends.
/// In equilibrium all changes of `D` are `y_i·dr_j`. Here `dr` is the change of `r` in a given state, and `y` the link
/// strain in equilibrium of the *transposed* system, in which shear springs are strained by the particles' strains but
/// do not cause them (adjoint method). `dr` by the logarithm of a stiffness is the force of that stiffness; by the
/// logarithm of the particles' modulus it is `k_N n(n·W n)`; by their Poisson's ratio `−k_N n(n·W′n)` with
/// `W′ = (dC/dν) T`. Without deformable particles `y` is the link strain itself, and the derivatives are energies.
///
/// # Errors
/// Those of [`cell_stiffness`].
pub fn cell_stiffness_and_derivatives(
    network: &LinkNetwork,
    accuracy: Accuracy,
) -> Result<CellStiffness, StaticsError> {
    find(network, accuracy, true)
}

fn find(network: &LinkNetwork, accuracy: Accuracy, wants_derivatives: bool) -> Result<CellStiffness, StaticsError> {
    let volume = network.volume.ok_or(StaticsError::NoCell)?;
    let planar = network.planar;
    if network.links.is_empty() {
        return Err(StaticsError::NoLinks);
    }
    let rigid = network.compliance.is_empty();
    let still = vec![vec![0.0; 6 * network.particles]; 6];
    let affine = if rigid {
        in_plane(sum(&energies(network, &still)) / volume, planar)
    } else {
        virial(&StiffnessProduct::of_cell(network), &still) / volume
    };
    let mut held = network.clone();
    let rattlers = held.remove_rattlers();
    if held.links.is_empty() {
        let loose = Loose { rattlers, mechanisms: 0 };
        let derivatives = (rigid || wants_derivatives).then(Derivatives::zero);
        let relaxed = Matrix6::zeros();
        return Ok(CellStiffness { relaxed, affine, derivatives, loose, iterations: 0, links: 0, planar });
    }
    let product = StiffnessProduct::of_cell(&held);
    let (inverses, singular) = product.inverse_diagonal_blocks();
    // Rattlers are particles without links here, so all their motions are zero-energy modes.
    let mechanisms = singular - if planar { 3 } else { 6 } * rattlers;
    let names = ["strain 11", "strain 22", "strain 33", "shear 23", "shear 31", "shear 12"];
    let loads = loads(&product, &still);
    let rounding = ROUNDING * largest_force(&held) * (product.size() as f64).sqrt();
    let (solutions, mut iterations) = solve(&product, &inverses, &loads, &names, accuracy, rounding)?;
    let (relaxed, derivatives) = if rigid {
        let links = energies(&held, &solutions).map(|energy| in_plane(energy / volume, planar));
        (sum(&links), Some(Derivatives { links, ..Derivatives::zero() }))
    } else {
        let derivatives = if wants_derivatives {
            let transposed = StiffnessProduct::of_cell(&held).transposed();
            let names = names.map(|name| format!("{name}, transposed"));
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let loads = self::loads(&transposed, &still);
            let (adjoint, more) = solve(&transposed, &inverses, &loads, &names, accuracy, rounding)?;
            iterations = iterations.max(more);
            Some(derivatives(&product, &solutions, &transposed, &adjoint).scaled(1.0 / volume))
        } else {
            None
        };
        (virial(&product, &solutions) / volume, derivatives)
    };
    let loose = Loose { rattlers, mechanisms };
    Ok(CellStiffness { relaxed, affine, derivatives, loose, iterations, links: held.links.len(), planar })
}

/// Loads of the periodic problem by strain: minus the forces that hold the particles on the uniform field.
fn loads(product: &StiffnessProduct<'_>, still: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let network = product.network;
    let mut loads = vec![vec![0.0; 6 * network.particles]; 6];
    for component in strains(network.planar) {
        let forces = product.link_forces(&still[component], Some(component));
        let load = &mut loads[component];
        for (link, (force, moment)) in network.links.iter().zip(&forces) {
            let [on_a, on_b] = link.holding(force, moment);
            let minus = |part: NodeMotion| NodeMotion { displacement: -part.displacement, rotation: -part.rotation };
            add(load, link.a as usize, &minus(on_a), network.scale);
            add(load, link.b as usize, &minus(on_b), network.scale);
        }
    }
    let largest = largest_force(network);
    // Forces that cancel but for rounding (as in a lattice) are no load: what they relax changes the stiffness by the square of this fraction,
    // below its rounding, and has no equilibrium.
    for load in &mut loads {
        if load.iter().all(|x| x.abs() < CANCELED * largest) {
            load.fill(0.0);
        }
    }
    loads
}

/// Largest force of a link under unit strain, N.
fn largest_force(network: &LinkNetwork) -> f64 {
    network.links.iter().map(|l| l.stiffness.normal * l.branch.norm()).fold(0.0, f64::max)
}

/// Derivatives of volume times stiffness (J) with deformable particles, from the states of both systems.
fn derivatives(
    product: &StiffnessProduct<'_>,
    states: &[Vec<f64>],
    transposed: &StiffnessProduct<'_>,
    adjoint: &[Vec<f64>],
) -> Derivatives {
    let network = product.network;
    let felt: Vec<Vec<LinkStrain>> =
        (0..6).map(|component| transposed.link_strains(&adjoint[component], Some(component))).collect();
    let by_poisson: Vec<Compliance> = network.compliance.iter().map(Compliance::by_poisson).collect();
    let mut all = Derivatives::zero();
    for column in strains(network.planar) {
        let forces = product.link_forces(&states[column], Some(column));
        let virials = product.particle_virials(&forces);
        let surface_displacement = |compliance: &[Compliance]| -> Vec<Symmetric> {
            compliance
                .iter()
                .zip(&virials)
                .map(|(compliance, virial)| compliance.surface_displacement(virial))
                .collect()
        };
        let (by_young, by_poisson) = (surface_displacement(&network.compliance), surface_displacement(&by_poisson));
        for (k, (link, (force, moment))) in network.links.iter().zip(&forces).enumerate() {
            let carried = LinkStrain { displacement: *force, rotation: *moment }.split(&link.normal);
            let (young, poisson) = (relief(link, &by_young), -relief(link, &by_poisson));
            for row in strains(network.planar) {
                let y = &felt[row][k];
                let along = [y.displacement, y.displacement, y.rotation, y.rotation];
                for ((links, carried), along) in all.links.iter_mut().zip(&carried).zip(&along) {
                    links[(row, column)] += along.dot(carried);
                }
                all.particle_young[(row, column)] += y.displacement.dot(&young);
                all.particle_poisson[(row, column)] += y.displacement.dot(&poisson);
            }
        }
    }
    all
}

/// Only the rows and columns 11, 22, 12, if the network is plane.
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
fn virial(product: &StiffnessProduct<'_>, states: &[Vec<f64>]) -> Matrix6<f64> {
    let planar = product.network.planar;
    let mut whole = Matrix6::zeros();
    for column in strains(planar) {
        let forces = product.link_forces(&states[column], Some(column));
        for (link, (force, _)) in product.network.links.iter().zip(&forces) {
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

/// Mutual energies of the six states by kind of stiffness, J; twice the stored energy on the diagonal.
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
