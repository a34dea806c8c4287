//! How deformable particles couple their contacts: whether the iteration between forces and strains converges (Madan
//! 2019, (3.5)–(3.16)), and how it stiffens the fastest vibration.
//!
//! At fixed positions a change of the forces of normal springs gives, through the strains, the next one: `f ← B f`,
//! `B = −k Nᵀ C N`, where `N` collects forces to dyads (`T_p = Σ_c (n⊗n)_c f_c` over both particles of each contact), `C` is
//! the compliance of the particles ([`Compliance`]) and `k` the stiffnesses. `B` is similar to the symmetric
//! `−P`, `P = C^½ N k Nᵀ C^½ ≥ 0`, in the space of particles' dyads. The iteration and, with it, the lagged scheme
//! converge for `ρ(B) = λ_max(P) < 1`; shear forces do not enter, since they do not depend on strains.
//! * Spectral: `λ_max(P)` by Lanczos iteration, matrix-free.
//! * Sufficient: `max_p λ_max(2 C^½ Σ_c k (n⊗n)(n⊗n) C^½)`, because every contact satisfies
//!   `½k(a + b)² ≤ k a² + k b²`.
//!
//! Reactions of prescribed translations strain the particles too and make `P` unsymmetric; where there are any, the
//! spectral radius is found by power iteration as well, and the larger value counts.
//!
//! **Time step.** In the highest mode of the lagged scheme the sign alternates from step to step, `T` lagging by one: the
//! central differences then see the stiffness `K + Gᵀ k Nᵀ C^½ (1−P)⁻¹ C^½ N k G`, `G` from displacements to
//! elongations. It is never smaller than that of rigid particles, `K`, and at most `K/(1−ρ)`.

use nalgebra::{Matrix6, SymmetricEigen, Vector6};
use rayon::prelude::*;

use super::deformation::reaction_lever;
use super::lanczos::{self, Interval};
use crate::kinematics::deformable::{Compliance, Deformable};
use crate::kinematics::sphere_sphere::fresh_frame;
use crate::math::{Symmetric, Vec3};
use crate::state::State;
use crate::state::contacts::{Contacts, Link};

/// Whether strains and forces find each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// Spectral radius `ρ(B)`: upper end of its interval.
    pub spectral_radius: f64,
    /// Width of that interval.
    pub uncertainty: f64,
    /// The sufficient bound: the iteration converges if it is below 1.
    pub bound: f64,
    /// Iterations taken.
    pub iterations: usize,
}

/// A normal spring between particles, or a particle and a wall.
#[derive(Debug, Clone, Copy)]
struct Spring {
    a: u32,
    /// `u32::MAX` for a wall.
    b: u32,
    normal: Vec3,
    stiffness: f64,
}

impl Spring {
    fn ends(&self) -> impl Iterator<Item = usize> {
        [self.a, self.b].into_iter().filter(|&p| p != u32::MAX).map(|p| p as usize)
    }

    /// `n⊗n` with shear components times √2, so that the scalar product is that of matrices.
    fn dyad(&self) -> Vector6<f64> {
        vector(&Symmetric::product(&self.normal, &self.normal))
    }
}

fn vector(s: &Symmetric) -> Vector6<f64> {
    let root = std::f64::consts::SQRT_2;
    let [xx, yy, zz, yz, xz, xy] = s.0;
    Vector6::new(xx, yy, zz, root * yz, root * xz, root * xy)
}

/// The inverse of [`vector`].
fn matrix(v: &Vector6<f64>) -> Symmetric {
    let root = std::f64::consts::FRAC_1_SQRT_2;
    Symmetric([v[0], v[1], v[2], root * v[3], root * v[4], root * v[5]])
}

/// The two factors of `C^½`.
fn root_of(compliance: &Compliance) -> (f64, f64) {
    let (direct, isotropic) = compliance.principal();
    (direct.sqrt(), isotropic.max(0.0).sqrt())
}

/// The springs of a state that carry at its positions, and the compliances of its particles.
pub struct Coupling {
    springs: Vec<Spring>,
    /// Square roots of the compliances: of the trace-free and of the isotropic part.
    roots: Vec<(f64, f64)>,
    planar: bool,
    /// Constrained translations (without that across the plane) and lever of their reaction.
    held: Vec<(usize, u8, Vec3)>,
}

impl Coupling {
    /// Coupling at the present positions: bonds, and contacts that touch.
    pub fn new(state: &State, deformable: &Deformable) -> Self {
        let particles = &state.particles;
        let mut springs = Vec::new();
        let mut add = |block: &dyn Contacts| {
            for k in 0..block.len() {
                let view = block.view(k);
                let (a, b) = (view.pair.a as usize, view.pair.b as usize);
                let shift = state.cell.as_ref().map_or_else(Vec3::zeros, |cell| cell.shift(view.link.image));
                let frame = fresh_frame(&particles.position[a], &particles.position[b], &shift);
                let touching = if view.link.has(Link::KEPT_REFERENCE) {
                    view.reference.length
                } else {
                    particles.radius[a] + particles.radius[b]
                };
                if view.link.carries() || (!view.link.has(Link::BROKEN) && frame.length <= touching) {
                    let stiffness = block.stiffness(k, particles, false).normal;
                    springs.push(Spring { a: view.pair.a, b: view.pair.b, normal: frame.normal, stiffness });
                }
            }
        };
        for block in &state.bonds {
            add(block.contacts());
        }
        if let Some(block) = &state.contacts {
            add(block.contacts());
        }
        if let Some(block) = &state.wall_contacts {
            let block = block.contacts();
            let table = super::walls::element_table(&state.walls);
            for k in 0..block.len() {
                let view = block.view(k);
                let a = view.pair.a as usize;
                let (wall, element) = table[view.pair.b as usize];
                if let Some(foot) = state.walls[wall as usize].foot(element as usize, &particles.position[a])
                    && foot.distance <= particles.radius[a]
                {
                    let stiffness = block.stiffness(k, particles, true).normal;
                    springs.push(Spring { a: view.pair.a, b: u32::MAX, normal: foot.normal, stiffness });
                }
            }
        }
        let planar = deformable.condition.is_planar();
        let roots = particles
            .material
            .iter()
            .zip(&particles.radius)
            .map(|(&material, &radius)| root_of(&deformable.compliance(material, radius)))
            .collect();
        let held_by = |p: usize| particles.constraint[p].0 & deformable.reacting().0;
        let mut normals = vec![Vec3::zeros(); particles.len()];
        for spring in &springs {
            normals[spring.a as usize] += spring.normal;
            if spring.b != u32::MAX {
                normals[spring.b as usize] -= spring.normal;
            }
        }
        let held = (0..particles.len())
            .filter(|&p| held_by(p) != 0)
            .map(|p| (p, held_by(p), reaction_lever(&normals[p])))
            .collect();
        Self { springs, roots, planar, held }
    }

    /// Coupling of springs between free particles of these compliances: particles A and B, direction from A to B, stiffness
    /// (N/m).
    pub(crate) fn between(springs: impl Iterator<Item = (u32, u32, Vec3, f64)>, compliances: &[Compliance]) -> Self {
        Self {
            springs: springs.map(|(a, b, normal, stiffness)| Spring { a, b, normal, stiffness }).collect(),
            roots: compliances.iter().map(root_of).collect(),
            planar: compliances.first().is_some_and(Compliance::is_planar),
            held: Vec::new(),
        }
    }

    /// `Rε` (m) of the particles in equilibrium, if with rigid particles the forces' dyads were `rigid` (N):
    /// `C^½ (1+P)⁻¹ C^½ T`, a symmetric map.
    pub(crate) fn widening(&self, rigid: &[Symmetric]) -> Vec<Symmetric> {
        let right = rigid.iter().enumerate().map(|(p, dyad)| self.root(p, &vector(dyad))).collect();
        let solution = self.solve(right, 1.0, 1e-15);
        solution.iter().enumerate().map(|(p, solution)| matrix(&self.root(p, solution))).collect()
    }

    /// `C^½ x` of particle `p`.
    #[inline(always)]
    fn root(&self, p: usize, x: &Vector6<f64>) -> Vector6<f64> {
        let (direct, isotropic) = self.roots[p];
        let dimension = if self.planar { 2.0 } else { 3.0 };
        let mean = (x[0] + x[1] + if self.planar { 0.0 } else { x[2] }) / dimension;
        let change = (isotropic - direct) * mean;
        let mut y = x * direct;
        y[0] += change;
        y[1] += change;
        if !self.planar {
            y[2] += change;
        }
        y
    }

    /// `y = P x`.
    fn apply(&self, x: &[Vector6<f64>], y: &mut [Vector6<f64>]) {
        let rooted: Vec<Vector6<f64>> = x.iter().enumerate().map(|(p, x)| self.root(p, x)).collect();
        y.fill(Vector6::zeros());
        for spring in &self.springs {
            let dyad = spring.dyad();
            let force = spring.stiffness * spring.ends().map(|p| dyad.dot(&rooted[p])).sum::<f64>();
            for p in spring.ends() {
                y[p] += dyad * force;
            }
        }
        for (p, y) in y.iter_mut().enumerate() {
            *y = self.root(p, y);
        }
    }

    /// `C^½ (N + reactions) k Nᵀ C^½ x`.
    fn apply_with_reactions(&self, x: &[Vector6<f64>], y: &mut [Vector6<f64>]) {
        let rooted: Vec<Vector6<f64>> = x.iter().enumerate().map(|(p, x)| self.root(p, x)).collect();
        let mut net = vec![Vec3::zeros(); x.len()];
        y.fill(Vector6::zeros());
        for spring in &self.springs {
            let dyad = spring.dyad();
            let force = spring.stiffness * spring.ends().map(|p| dyad.dot(&rooted[p])).sum::<f64>();
            for (end, p) in spring.ends().enumerate() {
                y[p] += dyad * force;
                net[p] += spring.normal * if end == 0 { force } else { -force };
            }
        }
        for (p, held, lever) in &self.held {
            let reaction = Vec3::from_fn(|i, _| if held >> i & 1 == 1 { -net[*p][i] } else { 0.0 });
            y[*p] += vector(&Symmetric::product(lever, &reaction));
        }
        for (p, y) in y.iter_mut().enumerate() {
            *y = self.root(p, y);
        }
    }

    /// Spectral radius and sufficient bound.
    pub fn convergence(&self) -> Convergence {
        let n = self.roots.len();
        let mut blocks = vec![Matrix6::<f64>::zeros(); n];
        for spring in &self.springs {
            let dyad = spring.dyad();
            let factor = if spring.b == u32::MAX { spring.stiffness } else { 2.0 * spring.stiffness };
            for p in spring.ends() {
                blocks[p] += dyad * dyad.transpose() * factor;
            }
        }
        let bound = blocks
            .par_iter()
            .enumerate()
            .map(|(p, block)| {
                let half =
                    Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(|i| self.root(p, &block.column(i).into())));
                let whole = half.transpose();
                let scaled =
                    Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(|i| self.root(p, &whole.column(i).into())));
                SymmetricEigen::new(scaled).eigenvalues.max()
            })
            .reduce(|| 0.0, f64::max);
        // The interval is widened by the residual, so a small one is worth its iterations.
        let found = lanczos::largest_eigenvalue(n, |_, _| true, bound, 1e-6, |x, y| self.apply(x, y));
        let Interval { mut upper, mut width, mut iterations } = found;
        if !self.held.is_empty() && upper > 0.0 {
            let (value, change, steps) = self.power_iteration();
            if value > upper {
                (upper, width) = (value, change);
            }
            iterations += steps;
        }
        Convergence { spectral_radius: upper, uncertainty: width, bound, iterations }
    }

    /// Size of the largest eigenvalue with reactions, its last change, and the iterations taken.
    fn power_iteration(&self) -> (f64, f64, usize) {
        const STEPS: usize = 2000;
        let n = self.roots.len();
        let mut x = lanczos::start(n, |_, _| true);
        let mut y = vec![Vector6::zeros(); n];
        let (mut value, mut change) = (0.0, f64::INFINITY);
        for step in 1..=STEPS {
            self.apply_with_reactions(&x, &mut y);
            let size = y.iter().map(Vector6::norm_squared).sum::<f64>().sqrt();
            if size == 0.0 {
                return (0.0, 0.0, step);
            }
            change = (size - value).abs();
            value = size;
            for (x, y) in x.iter_mut().zip(&y) {
                *x = y / size;
            }
            if change < 1e-9 * value {
                return (value, change, step);
            }
        }
        (value, change, STEPS)
    }

    /// Forces that the displacements `displacement` add through the strains of the particles when signs alternate from
    /// step to step: `add(p, force)` for both ends of each spring.
    pub(super) fn add_stiffening(&self, displacement: impl Fn(usize) -> Vec3, mut add: impl FnMut(usize, Vec3)) {
        let n = self.roots.len();
        let mut right = vec![Vector6::zeros(); n];
        for spring in &self.springs {
            let [a, b] =
                [spring.a, spring.b].map(|p| if p == u32::MAX { Vec3::zeros() } else { displacement(p as usize) });
            let force = spring.stiffness * spring.normal.dot(&(b - a));
            let dyad = spring.dyad();
            for p in spring.ends() {
                right[p] += dyad * force;
            }
        }
        for (p, right) in right.iter_mut().enumerate() {
            *right = self.root(p, right);
        }
        // A relative error of 1e-10 in the added force is far below the tolerance of the Lanczos iteration.
        let mut solution = self.solve(right, -1.0, 1e-10);
        for (p, solution) in solution.iter_mut().enumerate() {
            *solution = self.root(p, solution);
        }
        for spring in &self.springs {
            let dyad = spring.dyad();
            let force = spring.stiffness * spring.ends().map(|p| dyad.dot(&solution[p])).sum::<f64>();
            for (end, p) in spring.ends().enumerate() {
                add(p, spring.normal * if end == 0 { -force } else { force });
            }
        }
    }

    /// `(1 + sign P)⁻¹ r` by conjugate gradients up to a relative residual; with the sign −1 for `ρ < 1`.
    fn solve(&self, right: Vec<Vector6<f64>>, sign: f64, accuracy: f64) -> Vec<Vector6<f64>> {
        const STEPS: usize = 1000;
        let n = right.len();
        let dot = |a: &[Vector6<f64>], b: &[Vector6<f64>]| a.iter().zip(b).map(|(x, y)| x.dot(y)).sum::<f64>();
        let mut solution = vec![Vector6::zeros(); n];
        let mut residual = right;
        let mut direction = residual.clone();
        let mut image = vec![Vector6::zeros(); n];
        let mut square = dot(&residual, &residual);
        let target = accuracy * accuracy * square;
        for _ in 0..STEPS {
            if square <= target {
                break;
            }
            self.apply(&direction, &mut image);
            for (image, direction) in image.iter_mut().zip(&direction) {
                *image = direction + *image * sign;
            }
            let step = square / dot(&direction, &image);
            for ((solution, residual), (direction, image)) in
                solution.iter_mut().zip(&mut residual).zip(direction.iter().zip(&image))
            {
                *solution += direction * step;
                *residual -= image * step;
            }
            let next = dot(&residual, &residual);
            for (direction, residual) in direction.iter_mut().zip(&residual) {
                *direction = residual + *direction * (next / square);
            }
            square = next;
        }
        solution
    }
}

/// [`Coupling::convergence`] of a state.
pub fn convergence(state: &State, deformable: &Deformable) -> Convergence {
    Coupling::new(state, deformable).convergence()
}
