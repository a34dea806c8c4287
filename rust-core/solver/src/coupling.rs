//! How deformable particles couple their contacts: whether the iteration between forces and strains converges (Madan
//! 2019, (3.5)–(3.16)), and how it changes the highest frequency.
//!
//! At fixed positions a change of the forces of normal springs causes the next change through the strains: `f ← B f`,
//! `B = −k Nᵀ C N`, where `N` maps forces to particle virials (`T_p = Σ_c (n⊗n)_c f_c` over both particles of each
//! contact), `C` is the compliance of the particles ([`Compliance`]) and `k` the stiffnesses. `B` is similar to the
//! symmetric `−P`, `P = C^½ N k Nᵀ C^½ ≥ 0`, in the space of particle virials. The iteration and, with it, the lagged
//! scheme converge for `ρ(B) = λ_max(P) < 1`. Shear forces `g = k_t H x` do not enter: they add their virials `S g` to
//! the source of the iteration, `f = k G x − k Nᵀ C (N f + S g)`, which is constant at fixed positions.
//! * Spectral: `λ_max(P)` by Lanczos iteration, matrix-free.
//! * Sufficient: `max_p λ_max(2 C^½ Σ_c k (n⊗n)(n⊗n) C^½)`, because every contact satisfies
//!   `½k(a + b)² ≤ k a² + k b²`.
//!
//! Reactions of prescribed translations strain the particles too, and make `P` unsymmetric. If there are any, the
//! spectral radius is also computed by power iteration, and the larger value is used.
//!
//! **Time step.** In the highest mode of the lagged scheme the sign alternates from step to step, and `T` lags by one
//! step. The central differences then have the effective stiffness (`R = (1−P)⁻¹`; `G`, `H` map displacements to
//! elongations and shear displacements)
//!
//! `A = K + Yᵀ(Y + Z)`, `Y = R^½ C^½ N k G`, `Z = R^½ C^½ S k_t H`.
//!
//! With iterated strains it is `A = K − Yᵀ(Y + Z)` with `R = (1+P)⁻¹`. Shear forces strain particles but do not depend
//! on the strain (`Z` without `Zᵀ`), so `A` is not symmetric. The real parts of its eigenvalues are at most the largest
//! eigenvalue of its symmetric part (Bendixson 1902, Acta Math. 25:359). That bound is sharp, because the antisymmetric
//! part contributes only its square (2e-5 to 6e-4 of the time step, from the eigenvalues of packings), so the symmetric
//! part is used. From `YᵀY ≤ ρ/(1−ρ) Gᵀ k G`, `ZᵀZ ≤ ρ_s/(1−ρ) Hᵀ k_t H` with `ρ_s = λ_max(C^½ S k_t Sᵀ C^½)`, and
//! `YᵀZ + ZᵀY ≤ η YᵀY + ZᵀZ/η` with the best `η`, it is at most `K·(1 + (ρ + √(ρ² + ρ ρ_s))/(2(1−ρ)))`; iterated, a
//! complete square leaves `K·(1 + ρ_s/4)`.
//!
//! `A` omits the reactions of prescribed translations: they change it only next to particles with prescribed
//! translation, by less than 2e-4 of the time step in rows and in square, triangular, and disturbed lattices with `ρ`
//! up to 0.85.

use nalgebra::{Matrix6, SymmetricEigen, Vector6};
use rayon::prelude::*;

use crate::deformation::reaction_arm;
use crate::lanczos::{self, Interval};
use crate::state::State;
use crate::state::contacts::{ContactFlags, Contacts};
use concordem_contact::kinematics::deformable::{Compliance, Deformable, Update};
use concordem_contact::kinematics::sphere_sphere::initial_geometry;
use concordem_contact::math::{Symmetric, Vec3, any_perpendicular};

/// Whether the iteration between strains and forces converges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// Spectral radius `ρ(B)`: upper end of its interval.
    pub spectral_radius: f64,
    /// Width of that interval.
    pub uncertainty: f64,
    /// Sufficient bound: the iteration converges if this is below 1.
    pub bound: f64,
    /// Number of iterations.
    pub iterations: usize,
}

/// Normal and shear spring between two particles, or a particle and a wall.
#[derive(Debug, Clone, Copy)]
struct Spring {
    a: u32,
    /// `u32::MAX` for a wall.
    b: u32,
    normal: Vec3,
    stiffness: f64,
    shear: f64,
    /// Distances from the centers to the contact point, m.
    arms: [f64; 2],
}

impl Spring {
    fn ends(&self) -> impl Iterator<Item = usize> {
        [self.a, self.b].into_iter().filter(|&p| p != u32::MAX).map(|p| p as usize)
    }

    /// `n⊗n` with shear components times √2, so that the scalar product equals that of matrices.
    fn dyad(&self) -> Vector6<f64> {
        vector(&Symmetric::product(&self.normal, &self.normal))
    }

    /// Normal and shear force (N) between rigid particles after these displacements and rotations.
    fn force(&self, motion: &impl Fn(usize) -> (Vec3, Vec3)) -> (f64, Vec3) {
        let [(ua, wa), (ub, wb)] =
            [self.a, self.b].map(|p| if p == u32::MAX { Default::default() } else { motion(p as usize) });
        let n = self.normal;
        let relative = ub - ua + n.cross(&(wa * self.arms[0] + wb * self.arms[1]));
        let elongation = n.dot(&relative);
        (self.stiffness * elongation, (relative - n * elongation) * self.shear)
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

/// The springs at each particle, in the order of the springs, so that sums do not depend on the number of threads.
struct Ends {
    /// First entry of each particle, and the number of entries.
    first: Vec<u32>,
    /// Twice the number of the spring, plus one at its second end.
    entries: Vec<u32>,
}

impl Ends {
    fn new(springs: &[Spring], particles: usize) -> Self {
        let mut first = vec![0_u32; particles + 1];
        for p in springs.iter().flat_map(Spring::ends) {
            first[p + 1] += 1;
        }
        for p in 0..particles {
            first[p + 1] += first[p];
        }
        let mut next = first.clone();
        let mut entries = vec![0; first[particles] as usize];
        for (k, spring) in springs.iter().enumerate() {
            for (end, p) in spring.ends().enumerate() {
                entries[next[p] as usize] = 2 * k as u32 + end as u32;
                next[p] += 1;
            }
        }
        Self { first, entries }
    }

    /// Number of each spring at this particle, and 1 at its first end or −1 at its second.
    fn of(&self, p: usize) -> impl Iterator<Item = (usize, f64)> {
        self.entries[self.first[p] as usize..self.first[p + 1] as usize]
            .iter()
            .map(|&entry| ((entry / 2) as usize, if entry % 2 == 0 { 1.0 } else { -1.0 }))
    }
}

/// The springs of a state that have forces at its positions, and the compliances of its particles.
pub struct Coupling {
    springs: Vec<Spring>,
    ends: Ends,
    /// Square roots of the compliances: of the trace-free and of the isotropic part.
    roots: Vec<(f64, f64)>,
    planar: bool,
    /// Particles with prescribed translation: index, constrained translations (in the plane, for discs), and arm of the
    /// reaction over the radius.
    prescribed: Vec<(usize, u8, Vec3)>,
}

impl Coupling {
    /// Coupling by the bonds and the touching contacts at the present positions.
    pub fn new(state: &State, deformable: &Deformable) -> Self {
        let particles = &state.particles;
        let mut springs = Vec::new();
        let mut add = |block: &dyn Contacts| {
            for k in 0..block.len() {
                let view = block.view(k);
                let (a, b) = (view.pair.a as usize, view.pair.b as usize);
                let shift = state.cell.as_ref().map_or_else(Vec3::zeros, |cell| cell.shift(view.flags.image));
                let geometry = initial_geometry(&particles.position[a], &particles.position[b], &shift);
                let touching = if view.flags.has(ContactFlags::KEPT_REFERENCE) {
                    view.reference.length
                } else {
                    particles.radius[a] + particles.radius[b]
                };
                if view.flags.carries() || (!view.flags.has(ContactFlags::BROKEN) && geometry.length <= touching) {
                    let stiffness = block.stiffness(k, particles, false);
                    let (arm_a, arm_b) = block.arms(k, particles, geometry.length);
                    springs.push(Spring {
                        a: view.pair.a,
                        b: view.pair.b,
                        normal: geometry.normal,
                        stiffness: stiffness.normal,
                        shear: stiffness.shear,
                        arms: [arm_a, arm_b],
                    });
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
            let table = crate::walls::element_table(&state.walls);
            for k in 0..block.len() {
                let view = block.view(k);
                let a = view.pair.a as usize;
                let (wall, element) = table[view.pair.b as usize];
                let (image, cell) = (view.flags.image, state.cell.as_ref());
                let wall = &state.walls[wall as usize];
                if let Some(closest_point) =
                    wall.closest_point_of_image(element as usize, &particles.position[a], cell, image)
                    && closest_point.distance <= particles.radius[a]
                {
                    let stiffness = block.stiffness(k, particles, true);
                    springs.push(Spring {
                        a: view.pair.a,
                        b: u32::MAX,
                        normal: closest_point.normal,
                        stiffness: stiffness.normal,
                        shear: stiffness.shear,
                        arms: [particles.radius[a], 0.0],
                    });
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
        let prescribed_by = |p: usize| particles.constraint[p].0 & deformable.reacting().0;
        let mut normals = vec![Vec3::zeros(); particles.len()];
        for spring in &springs {
            normals[spring.a as usize] += spring.normal;
            if spring.b != u32::MAX {
                normals[spring.b as usize] -= spring.normal;
            }
        }
        let prescribed = (0..particles.len())
            .filter(|&p| prescribed_by(p) != 0)
            .map(|p| (p, prescribed_by(p), reaction_arm(&normals[p])))
            .collect();
        let ends = Ends::new(&springs, particles.len());
        Self { springs, ends, roots, planar, prescribed }
    }

    /// Coupling by normal springs between free particles with these compliances. A spring is given as particles A and
    /// B, direction from A to B, and stiffness (N/m).
    pub fn between(springs: impl Iterator<Item = (u32, u32, Vec3, f64)>, compliances: &[Compliance]) -> Self {
        let springs: Vec<Spring> = springs
            .map(|(a, b, normal, stiffness)| Spring { a, b, normal, stiffness, shear: 0.0, arms: [0.0; 2] })
            .collect();
        Self {
            ends: Ends::new(&springs, compliances.len()),
            springs,
            roots: compliances.iter().map(root_of).collect(),
            planar: compliances.first().is_some_and(Compliance::is_planar),
            prescribed: Vec::new(),
        }
    }

    /// Surface displacements `Rε` (m) in equilibrium, `C^½ (1+P)⁻¹ C^½ T`, where `rigid` are the particle virials `T`
    /// (N) of the forces between rigid particles. The map is symmetric.
    pub fn surface_displacement(&self, rigid: &[Symmetric]) -> Vec<Symmetric> {
        let right = rigid.iter().enumerate().map(|(p, virial)| self.root(p, &vector(virial))).collect();
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

    /// Forces (N) of the springs for `x`: `k Nᵀ C^½ x`.
    fn forces(&self, x: &[Vector6<f64>]) -> Vec<f64> {
        let rooted: Vec<Vector6<f64>> = x.par_iter().enumerate().map(|(p, x)| self.root(p, x)).collect();
        self.springs
            .par_iter()
            .map(|spring| {
                let dyad = spring.dyad();
                spring.stiffness * spring.ends().map(|p| dyad.dot(&rooted[p])).sum::<f64>()
            })
            .collect()
    }

    /// `y = P x`.
    fn apply(&self, x: &[Vector6<f64>], y: &mut [Vector6<f64>]) {
        let forces = self.forces(x);
        y.par_iter_mut().enumerate().for_each(|(p, y)| {
            let virial = self.ends.of(p).map(|(spring, _)| self.springs[spring].dyad() * forces[spring]);
            *y = self.root(p, &virial.sum());
        });
    }

    /// `C^½ (N + reactions) k Nᵀ C^½ x`.
    fn apply_with_reactions(&self, x: &[Vector6<f64>], y: &mut [Vector6<f64>]) {
        let forces = self.forces(x);
        y.par_iter_mut().enumerate().for_each(|(p, y)| {
            *y = self.ends.of(p).map(|(spring, _)| self.springs[spring].dyad() * forces[spring]).sum();
        });
        for (p, constrained, arm) in &self.prescribed {
            let net: Vec3 =
                self.ends.of(*p).map(|(spring, sign)| self.springs[spring].normal * (sign * forces[spring])).sum();
            let reaction = Vec3::from_fn(|i, _| if constrained >> i & 1 == 1 { -net[i] } else { 0.0 });
            y[*p] += vector(&Symmetric::product(arm, &reaction));
        }
        y.par_iter_mut().enumerate().for_each(|(p, y)| *y = self.root(p, y));
    }

    /// Compute spectral radius and sufficient bound.
    pub fn convergence(&self) -> Convergence {
        let n = self.roots.len();
        let bound = self.largest_of_blocks(|spring| {
            let dyad = spring.dyad();
            dyad * dyad.transpose() * spring.stiffness
        });
        // The interval includes the residual, so a small residual is worth more iterations.
        let found = lanczos::largest_eigenvalue(n, |_, _| true, bound, 1e-6, |x, y| self.apply(x, y));
        let Interval { mut upper, mut width, mut iterations } = found;
        if !self.prescribed.is_empty() && upper > 0.0 {
            let (value, change, steps) = self.power_iteration();
            if value > upper {
                (upper, width) = (value, change);
            }
            iterations += steps;
        }
        Convergence { spectral_radius: upper, uncertainty: width, bound, iterations }
    }

    /// `max_p λ_max(2 C^½ Σ_c block_c C^½)` over the springs of a particle (without the 2 for walls): an upper bound of
    /// the largest eigenvalue of the whole.
    fn largest_of_blocks(&self, block: impl Fn(&Spring) -> Matrix6<f64>) -> f64 {
        let mut blocks = vec![Matrix6::<f64>::zeros(); self.roots.len()];
        for spring in &self.springs {
            let block = block(spring) * if spring.b == u32::MAX { 1.0 } else { 2.0 };
            for p in spring.ends() {
                blocks[p] += block;
            }
        }
        blocks
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
            .reduce(|| 0.0, f64::max)
    }

    /// Upper bound of `ρ_s`, by particle; 0 without shear springs.
    pub(super) fn shear_bound(&self) -> f64 {
        if self.springs.iter().all(|spring| spring.shear == 0.0) {
            return 0.0;
        }
        self.largest_of_blocks(|spring| {
            let first = any_perpendicular(&spring.normal);
            let dyads = [first, spring.normal.cross(&first)].map(|t| vector(&Symmetric::product(&spring.normal, &t)));
            dyads.iter().map(|dyad| dyad * dyad.transpose()).sum::<Matrix6<f64>>() * spring.shear
        })
    }

    /// Modulus of the largest eigenvalue with reactions, its last change, and the number of iterations.
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

    /// Product of displacements and rotations `motion(p)` with the symmetric part of `A − K`, the stiffness added by the
    /// strains of the particles in the highest mode of the [`Update`]. Calls `add(p, force, torque)` for both ends of each
    /// spring.
    pub(super) fn add_stiffness(
        &self,
        update: Update,
        motion: impl Fn(usize) -> (Vec3, Vec3),
        mut add: impl FnMut(usize, Vec3, Vec3),
    ) {
        let sign = if update == Update::Lagged { -1.0 } else { 1.0 };
        let n = self.roots.len();
        let (mut by_normal, mut by_shear) = (vec![Vector6::zeros(); n], vec![Vector6::zeros(); n]);
        for spring in &self.springs {
            let (normal, shear) = spring.force(&motion);
            let (normal, shear) = (spring.dyad() * normal, vector(&Symmetric::product(&spring.normal, &shear)));
            for p in spring.ends() {
                by_normal[p] += normal;
                by_shear[p] += shear;
            }
        }
        // C^½ (1 ± P)⁻¹ C^½ for either sign. A relative error of 1e-10 in the added force is far below the tolerance of
        // the Lanczos iteration.
        let displacement_of = |virials: Vec<Vector6<f64>>| {
            let right = virials.iter().enumerate().map(|(p, virial)| self.root(p, virial)).collect();
            let mut solution = self.solve(right, sign, 1e-10);
            for (p, solution) in solution.iter_mut().enumerate() {
                *solution = self.root(p, solution);
            }
            solution
        };
        let (by_normal, by_shear) = (displacement_of(by_normal), displacement_of(by_shear));
        for spring in &self.springs {
            let n = spring.normal;
            let dyad = spring.dyad();
            let normal: f64 = spring.ends().map(|p| dyad.dot(&(by_normal[p] + by_shear[p] * 0.5))).sum();
            let turned: Vec3 = spring.ends().map(|p| matrix(&by_normal[p]).times(&n)).sum();
            let shear = (turned - n * n.dot(&turned)) * (0.5 * spring.shear);
            let force = (n * (spring.stiffness * normal) + shear) * -sign;
            for (end, p) in spring.ends().enumerate() {
                add(p, if end == 0 { -force } else { force }, -n.cross(&force) * spring.arms[end]);
            }
        }
    }

    /// `(1 + sign P)⁻¹ r` by conjugate gradients up to the relative residual `accuracy`; the sign −1 requires `ρ < 1`.
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
