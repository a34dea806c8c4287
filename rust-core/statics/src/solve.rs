//! Solution of `K u = f` by conjugate gradients (or, for cells, [directly](super::direct)).
//!
//! The matrix is never assembled: a link's answer costs some sixty operations, its share of an assembled matrix more
//! memory traffic than that. The iteration is [`faer`]'s, preconditioned with the inverse of each particle's own 6×6
//! block; motions that no link of a particle resists have no load either and are left out by the pseudo-inverse, so that
//! mechanisms need no artificial stiffness. Everything sequential inside one right-hand side: the bits do not depend on
//! the number of threads (they may depend on the processor, whose instructions faer chooses among).
//!
//! **Deformable particles** couple all contacts of a particle: with the matrix `B` of the iteration between forces and
//! strains ([`coupling`](concordem_solver::coupling)), normal forces are `(1−B)⁻¹ k_n (G u − …)`, where shear forces, which
//! strain the particles as well, are on the right. `1−B` is solved by conjugate gradients inside each product; it is
//! symmetric and never singular, whether or not the iteration itself converges. With shear forces the whole is not
//! symmetric, and faer's stabilised biconjugate gradients take the place of conjugate gradients. In the transposed system,
//! which derivatives need, shear springs feel the strains and do not cause them.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::matrix_free::bicgstab::{BicgError, BicgParams, bicgstab, bicgstab_scratch};
use faer::matrix_free::conjugate_gradient::{CgError, CgParams, conjugate_gradient, conjugate_gradient_scratch};
use faer::matrix_free::{IdentityPrecond, LinOp, Precond};
use faer::{MatMut, MatRef, Par};
use nalgebra::{Matrix6, SymmetricEigen, Vector6};
use rayon::prelude::*;

use super::cell_stiffness::uniform;
use super::link::{LinkStrain, NodeMotion};
use super::{LinkNetwork, StaticsError};
use concordem_contact::math::{Symmetric, Vec3};
use concordem_solver::coupling::Coupling;

/// How the system is solved.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Method {
    /// Preconditioned conjugate gradients without a matrix.
    #[default]
    Iterative,
    /// Sparse Cholesky factor; for rigid particles in a periodic cell.
    Direct,
}

/// How the system is solved and when the iteration stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Norm of the residual over norm of the right-hand side (rotational parts divided by [`LinkNetwork::scale`]).
    pub residual: f64,
    /// Most iterations.
    pub iterations: usize,
    /// How.
    pub method: Method,
}

impl Default for Accuracy {
    /// 1e-11, 20 000: the stiffness of a cell, being a minimum, is exact to the square of the residual and is limited by
    /// rounding.
    fn default() -> Self {
        Self { residual: 1e-11, iterations: 20_000, method: Method::Iterative }
    }
}

/// A degree of freedom with a prescribed motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Support {
    /// Particle.
    pub particle: usize,
    /// 0 to 2: displacement along x, y, z; 3 to 5: rotation about them.
    pub freedom: usize,
    /// m or rad.
    pub value: f64,
}

/// Motions of all particles under supports and loads.
#[derive(Debug, Clone, PartialEq)]
pub struct StaticState {
    /// Motion of each particle.
    pub motion: Vec<NodeMotion>,
    /// Force (N) and moment (N·m) that each particle needs from outside: the loads, and at supports the reactions.
    pub holding: Vec<NodeMotion>,
    /// Iterations of the solver.
    pub iterations: usize,
}

/// The network's stiffness with rotations scaled to lengths, acting on free degrees of freedom.
pub(super) struct Operator<'a> {
    pub network: &'a LinkNetwork,
    /// False for prescribed degrees of freedom; empty: all are free.
    free: Vec<bool>,
    /// Of deformable particles.
    coupling: Option<Coupling>,
    /// It is the transposed one.
    transposed: bool,
}

impl std::fmt::Debug for Operator<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Operator").field("particles", &self.network.particles).finish_non_exhaustive()
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

/// Force (N) that particles which are so much wider (m) take from a link: `k_N n (n·(W_A + W_B)n)`.
pub(super) fn relief(link: &super::Link, surface_displacement: &[Symmetric]) -> Vec3 {
    let elongation =
        (surface_displacement[link.a as usize] + surface_displacement[link.b as usize]).quadratic(&link.normal);
    link.normal * (link.stiffness.normal * elongation)
}

impl<'a> Operator<'a> {
    /// The operator of a network; `free` is false for prescribed degrees of freedom, or empty.
    pub fn new(network: &'a LinkNetwork, free: Vec<bool>) -> Self {
        let springs = network.links.iter().map(|link| (link.a, link.b, link.normal, link.stiffness.normal));
        let coupling = (!network.compliance.is_empty()).then(|| Coupling::between(springs, &network.compliance));
        Self { network, free, coupling, transposed: false }
    }

    pub fn size(&self) -> usize {
        6 * self.network.particles
    }

    /// The transposed operator.
    pub fn transposed(mut self) -> Self {
        self.transposed = true;
        self
    }

    /// What all links feel in the state `x` on top of a uniform strain.
    pub fn felt(&self, x: &[f64], strain: Option<usize>) -> Vec<LinkStrain> {
        let LinkNetwork { links, scale, .. } = self.network;
        let of_link = |link: &super::Link| {
            let mut felt = link.strain(&motion(x, link.a as usize, *scale), &motion(x, link.b as usize, *scale));
            if let Some(component) = strain {
                felt.displacement += uniform(&link.branch, component);
            }
            felt
        };
        let mut felt: Vec<LinkStrain> = links.iter().map(of_link).collect();
        if let Some(coupling) = self.coupling.as_ref().filter(|_| self.transposed) {
            let normal = links.iter().zip(&felt).map(|(link, felt)| {
                let force = link.stiffness.normal * link.normal.dot(&felt.displacement);
                Symmetric::product(&link.normal, &link.normal) * force
            });
            let surface_displacement = coupling.surface_displacement(&self.on_both_ends(normal));
            for (link, felt) in links.iter().zip(&mut felt) {
                felt.displacement -=
                    (surface_displacement[link.a as usize] + surface_displacement[link.b as usize]).times(&link.normal);
            }
        }
        felt
    }

    /// Forces (N) on A and moments (N·m) about the contact points of all links in the state `x` on top of a uniform strain.
    pub fn answers(&self, x: &[f64], strain: Option<usize>) -> Vec<(Vec3, Vec3)> {
        let links = &self.network.links;
        let felt = self.felt(x, strain);
        let mut answers: Vec<(Vec3, Vec3)> = links.iter().zip(&felt).map(|(link, felt)| link.answer(felt)).collect();
        if let Some(coupling) = self.coupling.as_ref().filter(|_| !self.transposed) {
            let surface_displacement = coupling.surface_displacement(&self.dyads(&answers));
            for (link, (force, _)) in links.iter().zip(&mut answers) {
                *force -= relief(link, &surface_displacement);
            }
        }
        answers
    }

    /// Force dyads `T` (N) of all particles under these answers of the links.
    pub fn dyads(&self, answers: &[(Vec3, Vec3)]) -> Vec<Symmetric> {
        let dyads =
            self.network.links.iter().zip(answers).map(|(link, (force, _))| Symmetric::product(&link.normal, force));
        self.on_both_ends(dyads)
    }

    /// Sums by particle of what each link gives both of its ends.
    fn on_both_ends(&self, of_links: impl Iterator<Item = Symmetric>) -> Vec<Symmetric> {
        let mut sums = vec![Symmetric::default(); self.network.particles];
        for (link, part) in self.network.links.iter().zip(of_links) {
            sums[link.a as usize] += part;
            sums[link.b as usize] += part;
        }
        sums
    }

    /// The operator of a cell: in a plane network what moves across the plane is held.
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
            for (link, (force, moment)) in self.network.links.iter().zip(self.answers(x, None)) {
                hold(link, &force, &moment);
            }
        } else {
            for link in &self.network.links {
                let (a, b) = (link.a as usize, link.b as usize);
                let (force, moment) = link.answer(&link.strain(&motion(x, a, scale), &motion(x, b, scale)));
                hold(link, &force, &moment);
            }
        }
        for (y, free) in y.iter_mut().zip(&self.free) {
            if !free {
                *y = 0.0;
            }
        }
    }

    /// The particles' own blocks of rigid particles, with zeros where a degree of freedom is prescribed.
    pub fn own_blocks(&self) -> Vec<Matrix6<f64>> {
        let network = self.network;
        let mut blocks = vec![Matrix6::zeros(); network.particles];
        for link in &network.links {
            blocks[link.a as usize] += link.block(0, network.scale);
            blocks[link.b as usize] += link.block(1, network.scale);
            if link.a == link.b {
                // a particle and its own image: the coupling of both ends is in the particle's own block as well
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

    pub fn is_free(&self, p: usize, i: usize) -> bool {
        self.free.is_empty() || self.free[6 * p + i]
    }

    /// Pseudo-inverses of the particles' own blocks, and the number of motions of single particles that nothing resists.
    /// Eigenvalues below 1e-12 of the block's largest count as none: rounding of the sums leaves 1e-15.
    pub fn blocks(&self) -> (Vec<Matrix6<f64>>, usize) {
        let blocks = self.own_blocks();
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

/// Block-diagonal preconditioner.
#[derive(Debug)]
struct Blocks<'a>(&'a [Matrix6<f64>]);

/// The one column of a vector.
fn column(x: MatRef<'_, f64>) -> &[f64] {
    x.col(0).try_as_col_major().expect("columns of dense matrices lie in one piece").as_slice()
}

fn column_mut(x: MatMut<'_, f64>) -> &mut [f64] {
    x.col_mut(0).try_as_col_major_mut().expect("columns of dense matrices lie in one piece").as_slice_mut()
}

impl LinOp<f64> for Operator<'_> {
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

/// Solve `K u = f` for each right-hand side; the iterations of the longest.
pub(super) fn solve(
    operator: &Operator<'_>,
    inverses: &[Matrix6<f64>],
    loads: &[Vec<f64>],
    names: &[&str],
    accuracy: Accuracy,
) -> Result<(Vec<Vec<f64>>, usize), StaticsError> {
    let solved: Result<Vec<(Vec<f64>, usize)>, StaticsError> = loads
        .par_iter()
        .zip(names)
        .map(|(load, name)| {
            let rows = operator.size();
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
            let place = MatMut::from_column_major_slice_mut(&mut solution, rows, 1);
            let right = MatRef::from_column_major_slice(load, rows, 1);
            let iterations = if operator.coupling.is_some() {
                let without = IdentityPrecond { dim: rows };
                let mut memory = MemBuffer::new(bicgstab_scratch(Blocks(inverses), without, operator, 1, Par::Seq));
                // its fields cannot be named in a literal outside faer
                #[allow(clippy::field_reassign_with_default)]
                let parameters = {
                    let mut parameters = BicgParams::default();
                    parameters.rel_tolerance = accuracy.residual;
                    parameters.abs_tolerance = 0.0;
                    parameters.max_iters = accuracy.iterations;
                    parameters
                };
                let stack = MemStack::new(&mut memory);
                match bicgstab(place, Blocks(inverses), without, operator, right, parameters, |_| {}, Par::Seq, stack) {
                    Ok(info) => info.iter_count,
                    Err(BicgError::NoConvergence { rel_residual, .. }) => return Err(not_converged(rel_residual)),
                }
            } else {
                let blocks = Blocks(inverses);
                let mut memory = MemBuffer::new(conjugate_gradient_scratch(Blocks(inverses), operator, 1, Par::Seq));
                #[allow(clippy::field_reassign_with_default)]
                let parameters = {
                    let mut parameters = CgParams::default();
                    parameters.rel_tolerance = accuracy.residual;
                    parameters.abs_tolerance = 0.0;
                    parameters.max_iters = accuracy.iterations;
                    parameters
                };
                let stack = MemStack::new(&mut memory);
                match conjugate_gradient(place, blocks, operator, right, parameters, |_| {}, Par::Seq, stack) {
                    Ok(info) => info.iter_count,
                    Err(CgError::NoConvergence { rel_residual, .. }) => return Err(not_converged(rel_residual)),
                    Err(CgError::NonPositiveDefiniteOperator | CgError::NonPositiveDefinitePreconditioner) => {
                        return Err(StaticsError::Unsupported { what });
                    }
                }
            };
            if operator.coupling.is_some() {
                // Biconjugate gradients may break down without saying so.
                let residual = residual(operator, &solution, load);
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

/// Norm of `f − K u` over that of `f`.
pub(super) fn residual(operator: &Operator<'_>, solution: &[f64], load: &[f64]) -> f64 {
    let mut image = vec![0.0; solution.len()];
    operator.multiply(&mut image, solution);
    let square = |values: &mut dyn Iterator<Item = f64>| values.map(|x| x * x).sum::<f64>();
    let left = square(&mut image.iter().zip(load).map(|(y, f)| f - y));
    (left / square(&mut load.iter().copied())).sqrt()
}

/// Equilibrium under prescribed motions and loads (forces in N, moments in N·m, by particle).
///
/// # Errors
/// A support or load on a particle that does not exist; loads that nothing carries; no convergence.
pub fn solve_supported(
    network: &LinkNetwork,
    supports: &[Support],
    loads: &[(usize, NodeMotion)],
    accuracy: Accuracy,
) -> Result<StaticState, StaticsError> {
    let (particles, scale) = (network.particles, network.scale);
    let unit = |freedom: usize| if freedom < 3 { 1.0 } else { scale };
    let mut free = vec![true; 6 * particles];
    let mut given = vec![0.0; 6 * particles];
    for support in supports {
        let Support { particle, freedom, value } = *support;
        if particle >= particles || freedom >= 6 {
            return Err(StaticsError::Place { particle, freedom, particles });
        }
        free[6 * particle + freedom] = false;
        given[6 * particle + freedom] = value * unit(freedom);
    }
    let mut load = vec![0.0; 6 * particles];
    for (particle, wrench) in loads {
        if *particle >= particles {
            return Err(StaticsError::Place { particle: *particle, freedom: 0, particles });
        }
        add(&mut load, *particle, wrench, scale);
    }
    let whole = Operator::new(network, Vec::new());
    let mut held = vec![0.0; 6 * particles];
    whole.multiply(&mut held, &given);
    for ((load, held), free) in load.iter_mut().zip(&held).zip(&free) {
        *load = if *free { *load - held } else { 0.0 };
    }
    let operator = Operator::new(network, free.clone());
    let (inverses, _) = operator.blocks();
    // A load along a motion that nothing resists has no equilibrium.
    let size = load.iter().fold(0.0_f64, |s, x| s.max(x.abs()));
    let blocks_of = |p: usize| {
        let x = Vector6::from_column_slice(&load[6 * p..6 * p + 6]);
        (x, inverses[p] * x)
    };
    if (0..particles).any(|p| {
        let (x, y) = blocks_of(p);
        y == Vector6::zeros() && x.abs().max() > 1e-12 * size
    }) {
        return Err(StaticsError::Unsupported { what: "equilibrium".into() });
    }
    let (solution, iterations) = solve(&operator, &inverses, &[load], &["equilibrium"], accuracy)?;
    let x: Vec<f64> = solution[0].iter().zip(&given).map(|(x, given)| x + given).collect();
    let mut holding = vec![0.0; 6 * particles];
    whole.multiply(&mut holding, &x);
    let unscale = |y: &[f64], p: usize| {
        let part = motion(y, p, 1.0);
        NodeMotion { displacement: part.displacement, rotation: part.rotation * scale }
    };
    Ok(StaticState {
        motion: (0..particles).map(|p| motion(&x, p, scale)).collect(),
        holding: (0..particles).map(|p| unscale(&holding, p)).collect(),
        iterations,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Link;
    use concordem_contact::law::Stiffness;

    /// Cantilever of `n` links along x: stiffness of the Euler-Bernoulli beam in each.
    fn cantilever(n: usize, length: f64, ei: f64) -> LinkNetwork {
        let l = length / n as f64;
        let k = Stiffness {
            normal: 50.0 / l,
            shear: 12.0 * ei / (l * l * l),
            bending: ei / l,
            twist: 0.8 / l,
            ..Stiffness::default()
        };
        let link = |i: usize| Link {
            a: i as u32,
            b: i as u32 + 1,
            branch: Vec3::x() * l,
            normal: Vec3::x(),
            arm_a: 0.5 * l,
            arm_b: 0.5 * l,
            stiffness: k,
        };
        LinkNetwork::new(n + 1, (0..n).map(link).collect(), None)
    }

    fn clamp(particle: usize) -> Vec<Support> {
        (0..6).map(|freedom| Support { particle, freedom, value: 0.0 }).collect()
    }

    /// End load: w = FL³/3EI, φ = FL²/2EI, reaction −F with the moment −FL, for any number of elements (the cubic is
    /// exact in every element). Condition grows like n⁴: 20⁴·2⁻⁵³ = 2e-11.
    #[test]
    fn cantilever_under_an_end_load() {
        let (n, length, ei, load) = (20, 2.0, 3.0, 0.7);
        let network = cantilever(n, length, ei);
        let wrench = NodeMotion { displacement: Vec3::new(0.0, load, 0.0), rotation: Vec3::zeros() };
        let accuracy = Accuracy { residual: 1e-13, iterations: 10_000, ..Accuracy::default() };
        let state = solve_supported(&network, &clamp(0), &[(n, wrench)], accuracy).unwrap();
        let end = state.motion[n];
        assert!((end.displacement.y / (load * length.powi(3) / (3.0 * ei)) - 1.0).abs() < 1e-9, "{end:?}");
        assert!((end.rotation.z / (load * length.powi(2) / (2.0 * ei)) - 1.0).abs() < 1e-9, "{end:?}");
        let held = state.holding[0];
        assert!(
            (held.displacement.y + load).abs() < 1e-9 && (held.rotation.z + load * length).abs() < 1e-9,
            "{held:?}"
        );
    }

    /// A prescribed end rotation about the axis: all links twist alike, moment = k_W φ/n.
    #[test]
    fn prescribed_twist() {
        let (n, twist) = (10, 0.3);
        let network = cantilever(n, 1.0, 1.0);
        let mut supports = clamp(0);
        supports.push(Support { particle: n, freedom: 3, value: twist });
        let state = solve_supported(&network, &supports, &[], Accuracy::default()).unwrap();
        let moment = 0.8 * twist;
        assert!((state.holding[n].rotation.x - moment).abs() < 1e-9, "{:?}", state.holding[n]);
        assert!((state.motion[n / 2].rotation.x - 0.5 * twist).abs() < 1e-9);
    }

    #[test]
    fn impossible_problems_are_refused() {
        let network = cantilever(3, 1.0, 1.0);
        let wrench = NodeMotion { displacement: Vec3::y(), rotation: Vec3::zeros() };
        let far = solve_supported(&network, &clamp(9), &[], Accuracy::default());
        assert_eq!(far, Err(StaticsError::Place { particle: 9, freedom: 0, particles: 4 }));
        // Without supports the load has no equilibrium; the iteration finds a direction that nothing resists.
        let loose = solve_supported(&network, &[], &[(1, wrench)], Accuracy::default());
        assert!(loose.is_err(), "{loose:?}");
    }
}
