//! The stiffness matrix of a network as an operator.

use concordem_contact::math::{Symmetric, Vec3};
use concordem_solver::coupling::Coupling;
use nalgebra::{Matrix6, SymmetricEigen, Vector6};
use rayon::prelude::*;

use super::LinkNetwork;
use super::link::{LinkStrain, NodeMotion, uniform};

/// The product of a network's stiffness matrix with a vector, matrix-free. Rotations are scaled to lengths; prescribed
/// degrees of freedom are omitted.
pub(super) struct StiffnessProduct<'a> {
    pub network: &'a LinkNetwork,
    /// False for prescribed degrees of freedom; empty: all are free.
    free: Vec<bool>,
    /// Coupling of the links by deformable particles; `None` if all are rigid.
    pub coupling: Option<Coupling>,
    /// Whether the matrix is the transposed one.
    transposed: bool,
}

impl std::fmt::Debug for StiffnessProduct<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("StiffnessProduct").field("particles", &self.network.particles).finish_non_exhaustive()
    }
}

/// Motion of particle `p` in the vector `x`.
#[inline(always)]
pub(super) fn motion(x: &[f64], p: usize, scale: f64) -> NodeMotion {
    let x = &x[6 * p..6 * p + 6];
    NodeMotion { displacement: Vec3::new(x[0], x[1], x[2]), rotation: Vec3::new(x[3], x[4], x[5]) / scale }
}

/// Add forces and moments (divided by `scale`) to those of particle `p`.
#[inline(always)]
pub(super) fn add(y: &mut [f64], p: usize, part: &NodeMotion, scale: f64) {
    let y = &mut y[6 * p..6 * p + 6];
    for i in 0..3 {
        y[i] += part.displacement[i];
        y[i + 3] += part.rotation[i] / scale;
    }
}

/// Force (N) by which the surface displacements (m) of its particles reduce that of a link: `k_N n (n·(W_A + W_B)n)`.
pub(super) fn relief(link: &super::Link, surface_displacement: &[Symmetric]) -> Vec3 {
    let elongation =
        (surface_displacement[link.a as usize] + surface_displacement[link.b as usize]).quadratic(&link.normal);
    link.normal * (link.stiffness.normal * elongation)
}

impl<'a> StiffnessProduct<'a> {
    /// The product for a network; `free` is false for prescribed degrees of freedom, or empty if there are none.
    pub fn new(network: &'a LinkNetwork, free: Vec<bool>) -> Self {
        let springs = network.links.iter().map(|link| (link.a, link.b, link.normal, link.stiffness.normal));
        let coupling = (!network.compliance.is_empty()).then(|| Coupling::between(springs, &network.compliance));
        Self { network, free, coupling, transposed: false }
    }

    /// Number of degrees of freedom.
    pub fn size(&self) -> usize {
        6 * self.network.particles
    }

    /// The product with the transposed matrix.
    pub fn transposed(mut self) -> Self {
        self.transposed = true;
        self
    }

    /// Strains of all links in the state `x`, plus those of a uniform unit strain.
    pub fn link_strains(&self, x: &[f64], strain: Option<usize>) -> Vec<LinkStrain> {
        let LinkNetwork { links, scale, .. } = self.network;
        let of_link = |link: &super::Link| {
            let mut link_strain = link.strain(&motion(x, link.a as usize, *scale), &motion(x, link.b as usize, *scale));
            if let Some(component) = strain {
                link_strain.displacement += uniform(&link.branch, component);
            }
            link_strain
        };
        let mut strains: Vec<LinkStrain> = links.iter().map(of_link).collect();
        if let Some(coupling) = self.coupling.as_ref().filter(|_| self.transposed) {
            let normal = links.iter().zip(&strains).map(|(link, link_strain)| {
                let force = link.stiffness.normal * link.normal.dot(&link_strain.displacement);
                Symmetric::product(&link.normal, &link.normal) * force
            });
            let surface_displacement = coupling.surface_displacement(&self.on_both_ends(normal));
            for (link, link_strain) in links.iter().zip(&mut strains) {
                link_strain.displacement -=
                    (surface_displacement[link.a as usize] + surface_displacement[link.b as usize]).times(&link.normal);
            }
        }
        strains
    }

    /// Forces (N) on A and moments (N·m) about the contact points of all links in the state `x`, plus those of a uniform unit
    /// strain.
    pub fn link_forces(&self, x: &[f64], strain: Option<usize>) -> Vec<(Vec3, Vec3)> {
        let links = &self.network.links;
        let strains = self.link_strains(x, strain);
        let mut forces: Vec<(Vec3, Vec3)> =
            links.iter().zip(&strains).map(|(link, link_strain)| link.response(link_strain)).collect();
        if let Some(coupling) = self.coupling.as_ref().filter(|_| !self.transposed) {
            let surface_displacement = coupling.surface_displacement(&self.particle_virials(&forces));
            for (link, (force, _)) in links.iter().zip(&mut forces) {
                *force -= relief(link, &surface_displacement);
            }
        }
        forces
    }

    /// Particle virials `T` (N) of all particles under these forces and moments of the links.
    pub fn particle_virials(&self, forces: &[(Vec3, Vec3)]) -> Vec<Symmetric> {
        let virials =
            self.network.links.iter().zip(forces).map(|(link, (force, _))| Symmetric::product(&link.normal, force));
        self.on_both_ends(virials)
    }

    /// Sum over the links of each particle.
    fn on_both_ends(&self, of_links: impl Iterator<Item = Symmetric>) -> Vec<Symmetric> {
        let mut sums = vec![Symmetric::default(); self.network.particles];
        for (link, part) in self.network.links.iter().zip(of_links) {
            sums[link.a as usize] += part;
            sums[link.b as usize] += part;
        }
        sums
    }

    /// The product for a periodic cell; in a plane network motion across the plane is prescribed as zero.
    pub fn of_cell(network: &'a LinkNetwork) -> Self {
        let in_plane = [true, true, false, false, false, true];
        let free = if network.planar { in_plane.repeat(network.particles) } else { Vec::new() };
        Self::new(network, free)
    }

    /// `y = K x` on the free degrees of freedom.
    pub fn multiply(&self, y: &mut [f64], x: &[f64]) {
        y.fill(0.0);
        let scale = self.network.scale;
        let mut hold = |link: &super::Link, force: &Vec3, moment: &Vec3| {
            let [on_a, on_b] = link.holding(force, moment);
            add(y, link.a as usize, &on_a, scale);
            add(y, link.b as usize, &on_b, scale);
        };
        if self.coupling.is_some() {
            for (link, (force, moment)) in self.network.links.iter().zip(self.link_forces(x, None)) {
                hold(link, &force, &moment);
            }
        } else {
            for link in &self.network.links {
                let (a, b) = (link.a as usize, link.b as usize);
                let (force, moment) = link.response(&link.strain(&motion(x, a, scale), &motion(x, b, scale)));
                hold(link, &force, &moment);
            }
        }
        for (y, free) in y.iter_mut().zip(&self.free) {
            if !free {
                *y = 0.0;
            }
        }
    }

    /// The 6×6 diagonal block of each particle for rigid particles, with zeros for prescribed degrees of freedom.
    pub fn diagonal_blocks(&self) -> Vec<Matrix6<f64>> {
        let network = self.network;
        let mut blocks = vec![Matrix6::zeros(); network.particles];
        for link in &network.links {
            blocks[link.a as usize] += link.block(0, network.scale);
            blocks[link.b as usize] += link.block(1, network.scale);
            if link.a == link.b {
                // A link between a particle and its own image couples both ends within the same block.
                let mixed = link.scaled_matrix(network.scale).fixed_view::<6, 6>(0, 6).into_owned();
                blocks[link.a as usize] += mixed + mixed.transpose();
            }
        }
        for (p, block) in blocks.iter_mut().enumerate() {
            for i in (0..6).filter(|&i| !self.is_free(p, i)) {
                block.fill_row(i, 0.0);
                block.fill_column(i, 0.0);
            }
        }
        blocks
    }

    /// Whether degree of freedom `i` of particle `p` is free.
    pub fn is_free(&self, p: usize, i: usize) -> bool {
        self.free.is_empty() || self.free[6 * p + i]
    }

    /// Pseudo-inverses of the diagonal blocks, and the number of zero-energy modes of single particles.
    /// Eigenvalues below 1e-12 of the block's largest count as zero: rounding of the sums leaves 1e-15.
    pub fn inverse_diagonal_blocks(&self) -> (Vec<Matrix6<f64>>, usize) {
        let blocks = self.diagonal_blocks();
        let largest = blocks.iter().map(|block| block.abs().max()).fold(0.0, f64::max);
        let found: Vec<(Matrix6<f64>, usize)> = blocks
            .into_par_iter()
            .enumerate()
            .map(|(p, block)| {
                let held = (0..6).filter(|&i| !self.is_free(p, i)).count();
                if block.abs().max() <= 1e-12 * largest {
                    return (Matrix6::zeros(), 6 - held);
                }
                let eigen = SymmetricEigen::new(block);
                let limit = 1e-12 * eigen.eigenvalues.max();
                let inverse =
                    Vector6::from_fn(
                        |i, _| {
                            if eigen.eigenvalues[i] > limit { 1.0 / eigen.eigenvalues[i] } else { 0.0 }
                        },
                    );
                let none = inverse.iter().filter(|&&x| x == 0.0).count();
                let v = &eigen.eigenvectors;
                (v * Matrix6::from_diagonal(&inverse) * v.transpose(), none - held)
            })
            .collect();
        let mechanisms = found.iter().map(|f| f.1).sum();
        (found.into_iter().map(|f| f.0).collect(), mechanisms)
    }
}
