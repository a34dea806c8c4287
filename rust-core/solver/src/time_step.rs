//! Bounds of the stable time step.
//!
//! Central differences are stable for `Δt < 2/ω_max` (Madan 2019, (2.15)). Three estimates, from cheap to sharp:
//! * P-wave: `min r √(ρ/E)` over particles, the customary rule, no bound;
//! * per particle: `ω² ≤ max_p λ_max(2 Σ_e Gᵀ k_e G, M_p)`, the sum over the contacts of a particle of its 6×6 stiffness
//!   blocks including the arms. Rigorous, because every contact's energy satisfies
//!   `½k(g_B − g_A)² ≤ k g_A² + k g_B²`;
//! * spectral: the largest eigenvalue of the assembled mass-scaled stiffness by Lanczos iteration, plus its residual
//!   norm. Sharp.
//!
//! Deformable particles stiffen the fastest vibration where their strains lag behind the forces, and soften it where they
//! are iterated ([`coupling`](super::coupling)); the last two bounds take that into account, with the strains that shear
//! forces make. Slower than the fastest, some vibrations gain energy from shear forces that strain particles, at any time
//! step: damping has to take that (`docs/book/theory/deformable-particles.md`).
//!
//! Dashpots with `C ≤ βK` lower the limit to `(2/ω)(√(1+ζ²) − ζ)`, `ζ = ½βω` (Belytschko 1983).

use nalgebra::{Matrix6, SymmetricEigen, Vector6};
use rayon::prelude::*;

use super::coupling::{Convergence, Coupling};
use super::lanczos;
use crate::state::contacts::{ContactFlags, Contacts};
use crate::state::{Cell, Particles, State};
use concordem_contact::kinematics::deformable::{Deformable, Update};
use concordem_contact::kinematics::sphere_sphere::initial_geometry;
use concordem_contact::law::Stiffness;
use concordem_contact::math::{Mat3, Vec3};

/// Bounds of the time step, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeStepBounds {
    /// `min 2 √(m/k_max)`-like bound from each particle's own contacts, dashpots included.
    pub per_particle: f64,
    /// From the largest frequency of the assembled system, dashpots included.
    pub spectral: f64,
    /// Largest angular frequency, rad/s (upper end of its interval).
    pub frequency: f64,
    /// Relative width of the interval the frequency is known to lie in.
    pub uncertainty: f64,
    /// Lanczos steps taken.
    pub iterations: usize,
}

/// One contact as a linear element.
#[derive(Debug, Clone, Copy)]
struct Element {
    a: u32,
    b: u32,
    normal: Vec3,
    arm_a: f64,
    arm_b: f64,
    stiffness: Stiffness,
}

/// `min r √(ρ/E)`, s, over particles with density from mass and radius, and modulus `young` (Pa): the customary P-wave
/// rule (YADE's `PWaveTimeStep`).
pub fn p_wave(particles: &Particles, young: f64) -> f64 {
    particles
        .radius
        .iter()
        .zip(&particles.mass)
        .map(|(r, m)| r * (m / (4.0 / 3.0 * std::f64::consts::PI * r * r * r) / young).sqrt())
        .fold(f64::INFINITY, f64::min)
}

fn elements(state: &State) -> Vec<Element> {
    let mut all = Vec::new();
    let particles = &state.particles;
    let mut add = |block: &dyn Contacts| {
        for k in 0..block.len() {
            let view = block.view(k);
            if view.link.has(ContactFlags::BROKEN) {
                continue;
            }
            let (a, b) = (view.pair.a as usize, view.pair.b as usize);
            let shift = state.cell.as_ref().map_or_else(Vec3::zeros, |cell: &Cell| cell.shift(view.link.image));
            let frame = initial_geometry(&particles.position[a], &particles.position[b], &shift);
            let (arm_a, arm_b) = block.arms(k, particles, frame.length);
            all.push(Element {
                a: view.pair.a,
                b: view.pair.b,
                normal: frame.normal,
                arm_a,
                arm_b,
                stiffness: block.stiffness(k, particles, false),
            });
        }
    };
    for block in &state.bonds {
        add(block.contacts());
    }
    if let Some(block) = &state.contacts {
        add(block.contacts());
    }
    all
}

/// Stiffness of walls on each particle, as if the wall were there at all times: `(particle, normal, stiffness)`.
fn wall_elements(state: &State) -> Vec<(u32, Vec3, f64, Stiffness)> {
    let Some(block) = &state.wall_contacts else { return Vec::new() };
    let block = block.contacts();
    let table = super::walls::element_table(&state.walls);
    (0..block.len())
        .filter_map(|k| {
            let view = block.view(k);
            let a = view.pair.a as usize;
            let (w, e) = table[view.pair.b as usize];
            let closest_point = state.walls[w as usize].closest_point(e as usize, &state.particles.position[a])?;
            Some((
                view.pair.a,
                closest_point.normal,
                state.particles.radius[a],
                block.stiffness(k, &state.particles, true),
            ))
        })
        .collect()
}

/// Stiffness block of one end of an element: rows translation, rotation.
fn end_block(normal: &Vec3, arm: f64, k: &Stiffness) -> Matrix6<f64> {
    let nn = normal * normal.transpose();
    let tangent = Mat3::identity() - nn;
    // Tangential displacement of the end's contact point: P u + arm (φ × n) = P u − arm [n]× φ.
    let lever = -normal.cross_matrix() * arm;
    let mut block = Matrix6::zeros();
    block.fixed_view_mut::<3, 3>(0, 0).copy_from(&(nn * k.normal + tangent * k.shear));
    let coupling = tangent * lever * k.shear;
    block.fixed_view_mut::<3, 3>(0, 3).copy_from(&coupling);
    block.fixed_view_mut::<3, 3>(3, 0).copy_from(&coupling.transpose());
    let rotation = lever.transpose() * tangent * lever * k.shear + tangent * k.bending + nn * k.twist;
    block.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
    block
}

/// Largest ratio of dashpot to spring, s.
fn damping_ratio(k: &Stiffness) -> f64 {
    let ratio = |c: f64, k: f64| if c > 0.0 && k > 0.0 { c / k } else { 0.0 };
    ratio(k.normal_damping, k.normal).max(ratio(k.shear_damping, k.shear))
}

fn limit(frequency: f64, beta: f64) -> f64 {
    if frequency <= 0.0 {
        return f64::INFINITY;
    }
    let zeta = 0.5 * beta * frequency;
    2.0 / frequency * ((1.0 + zeta * zeta).sqrt() - zeta)
}

/// Compute the bounds for the contacts and candidates of `state` as they are, between rigid particles.
pub fn bounds(state: &State) -> TimeStepBounds {
    bounds_with(state, None).0
}

/// [`bounds`] between particles that deform, and whether their strains and forces find each other. Where they do not,
/// the bounds are those of rigid particles; no time step is stable.
pub fn bounds_with(state: &State, deformable: Option<&Deformable>) -> (TimeStepBounds, Option<Convergence>) {
    let coupling = deformable.map(|deformable| Coupling::new(state, deformable));
    let convergence = coupling.as_ref().map(Coupling::convergence);
    let update = deformable.map_or(Update::Lagged, |d| d.update);
    let radius = convergence.map_or(0.0, |c| c.spectral_radius);
    let coupling = coupling.filter(|_| radius > 0.0 && (radius < 1.0 || update != Update::Lagged));
    let stiffening = coupling.as_ref().map_or(1.0, |coupling| {
        let shear = coupling.shear_bound();
        match update {
            Update::Lagged => 1.0 + 0.5 * (radius + (radius * (radius + shear)).sqrt()) / (1.0 - radius),
            Update::Iterated { .. } => 1.0 + 0.25 * shear,
        }
    });
    let particles = &state.particles;
    let n = particles.len();
    let elements = elements(state);
    let walls = wall_elements(state);
    let beta = elements
        .iter()
        .map(|e| damping_ratio(&e.stiffness))
        .chain(walls.iter().map(|w| damping_ratio(&w.3)))
        .fold(0.0, f64::max);
    // Rigid links and more mass lower frequencies (Rayleigh): a clump vibrates no faster than its members would, each for
    // itself, with such shares of their masses that together they have no more than the body.
    let shares: Vec<f64> = state.clumps.iter().map(|clump| clump.share_of_members(particles)).collect();
    // Inverse square roots of mass; zero where the degree of freedom is prescribed.
    let scale: Vec<Vector6<f64>> = (0..n)
        .map(|p| {
            let c = particles.constraint[p];
            let share = shares.get(particles.clump[p] as usize).copied().unwrap_or(1.0);
            Vector6::from_fn(|i, _| {
                let fixed = if i < 3 { c.translation(i) } else { c.rotation(i - 3) };
                let m = if i < 3 { particles.mass[p] } else { particles.inertia[p] };
                if fixed { 0.0 } else { 1.0 / (share * m).sqrt() }
            })
        })
        .collect();

    let mut blocks = vec![Matrix6::<f64>::zeros(); n];
    for e in &elements {
        blocks[e.a as usize] += end_block(&e.normal, e.arm_a, &e.stiffness) * 2.0;
        blocks[e.b as usize] += end_block(&-e.normal, e.arm_b, &e.stiffness) * 2.0;
    }
    for (p, normal, arm, k) in &walls {
        blocks[*p as usize] += end_block(normal, *arm, k);
    }
    let largest = blocks
        .par_iter()
        .zip(&scale)
        .map(|(block, s)| {
            let scaled = Matrix6::from_fn(|i, j| block[(i, j)] * s[i] * s[j]);
            SymmetricEigen::new(scaled).eigenvalues.max()
        })
        .reduce(|| 0.0, f64::max)
        * stiffening;
    let per_particle = limit(largest.max(0.0).sqrt(), beta);

    let found = lanczos::largest_eigenvalue(
        n,
        |p, i| scale[p][i] != 0.0,
        largest,
        1e-4,
        |x, y| {
            apply(&elements, &walls, &scale, x, y);
            if let Some(coupling) = &coupling {
                let motion = |p: usize| halves(&x[p].component_mul(&scale[p]));
                coupling.add_stiffness(update, motion, |p, force, torque| {
                    y[p] += joined(&force, &torque).component_mul(&scale[p]);
                });
            }
        },
    );
    let (square, width, iterations) = (found.upper, found.width, found.iterations);
    let frequency = square.max(0.0).sqrt();
    let bounds = TimeStepBounds {
        per_particle,
        spectral: limit(frequency, beta),
        frequency,
        uncertainty: if square > 0.0 { 0.5 * width / square } else { 0.0 },
        iterations,
    };
    (bounds, convergence)
}

/// Translation and rotation.
fn halves(v: &Vector6<f64>) -> (Vec3, Vec3) {
    (Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5]))
}

/// The inverse of [`halves`].
fn joined(force: &Vec3, torque: &Vec3) -> Vector6<f64> {
    Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z)
}

/// `y = S K S x`, element by element in fixed order.
fn apply(
    elements: &[Element],
    walls: &[(u32, Vec3, f64, Stiffness)],
    scale: &[Vector6<f64>],
    x: &[Vector6<f64>],
    y: &mut [Vector6<f64>],
) {
    y.fill(Vector6::zeros());
    let split = |p: usize| halves(&x[p].component_mul(&scale[p]));
    let mut add = |p: usize, force: Vec3, torque: Vec3| y[p] += joined(&force, &torque).component_mul(&scale[p]);
    for e in elements {
        let ((ua, wa), (ub, wb)) = (split(e.a as usize), split(e.b as usize));
        let n = e.normal;
        let relative = ub - ua + n.cross(&(wa * e.arm_a + wb * e.arm_b));
        let normal_part = n * n.dot(&relative);
        let f = normal_part * e.stiffness.normal + (relative - normal_part) * e.stiffness.shear;
        let rotation = wb - wa;
        let twist = n * n.dot(&rotation);
        let moment = twist * e.stiffness.twist + (rotation - twist) * e.stiffness.bending;
        let lever = n.cross(&f);
        add(e.a as usize, -f, -lever * e.arm_a - moment);
        add(e.b as usize, f, -lever * e.arm_b + moment);
    }
    for (p, n, arm, k) in walls {
        let (u, w) = split(*p as usize);
        let relative = -u + n.cross(&(w * *arm));
        let normal_part = n * n.dot(&relative);
        let f = normal_part * k.normal + (relative - normal_part) * k.shear;
        add(*p as usize, -f, -n.cross(&f) * *arm);
    }
}
