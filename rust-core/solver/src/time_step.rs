//! Bounds of the stable time step.
//!
//! Central differences are stable for `Δt < 2/ω_max` (Madan 2019, (2.15)). Three estimates, from cheap to sharp:
//! * P-wave: `min r √(ρ/E)` over particles, a common rule but no bound;
//! * per particle: `ω² ≤ max_p λ_max(2 Σ_e Gᵀ k_e G, M_p)`, the sum over the contacts of a particle of its 6×6 stiffness
//!   blocks including the arms. Rigorous, because every contact's energy satisfies
//!   `½k(g_B − g_A)² ≤ k g_A² + k g_B²`;
//! * spectral: the largest eigenvalue of the assembled mass-scaled stiffness by Lanczos iteration, plus its residual
//!   norm. Sharp.
//!
//! Deformable particles raise the highest frequency if their strains lag behind the forces, and lower it if they are
//! iterated ([`coupling`](super::coupling)). The last two bounds include this, and the strains due to shear forces.
//! Some lower modes gain energy from shear forces that strain particles, at any time step; damping must remove it
//! (`docs/book/theory/deformable-particles.md`).
//!
//! Dashpots with `C ≤ βK` lower the limit to `(2/ω)(√(1+ζ²) − ζ)`, `ζ = ½βω` (Belytschko 1983): their force lags by half a
//! step. Artificial damping lowers it further. With Tchamwa and Wielgosz' φ a mode follows
//!
//! `x₊ − 2x + x₋ = −Ω²[φx − (φ−1)x₋] − D[φ(x − x₋) − (φ−1)(x₋ − x₋₋)]`, `Ω = ωΔt`, `D = cΔt/m`,
//!
//! whose characteristic polynomial has all roots in the unit circle exactly for `(2φ−1)(Ω² + 2D) < 4` (Jury's
//! criterion: the root −1 is the first to leave it). `C` and `K` need not have common modes: any eigenvector of the
//! damped motion follows this polynomial with its Rayleigh quotients. So `Δt < (2/ω)(√(ζ² + 1/s) − ζ)` with `s` of
//! [`Damping::stiffening`](crate::integrate::Damping::stiffening). The product of the separate limits for dashpots and
//! for φ is not a bound: at ζ = 1 and φ = 1.5 it is too large by a factor of 1.4.

mod network;

use nalgebra::{Matrix6, Vector6};
use rayon::prelude::*;

use self::network::{Network, halves, joined};
use crate::coupling::{Convergence, Coupling};
use crate::integrate::Damping;
use crate::lanczos;
use crate::state::contacts::{ContactFlags, Contacts, Pair};
use crate::state::{Cell, Particles, State};
use concordem_contact::kinematics::deformable::{Deformable, Update};
use concordem_contact::kinematics::sphere_sphere::initial_geometry;
use concordem_contact::law::Stiffness;
use concordem_contact::math::{Mat3, Vec3};

/// Bounds of the time step, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeStepBounds {
    /// Bound of the form `min 2 √(m/k_max)` from each particle's own contacts, dashpots included.
    pub per_particle: f64,
    /// From the largest frequency of the assembled system, dashpots included; the bound per particle if that was not computed
    /// ([`bounds_unless`]).
    pub spectral: f64,
    /// Largest angular frequency, rad/s: upper end of its interval.
    pub frequency: f64,
    /// Relative width of that interval.
    pub uncertainty: f64,
    /// Number of Lanczos steps; 0 if the largest frequency was not computed.
    pub iterations: usize,
    /// The smaller one of the frequencies of the two bounds, rad/s.
    pub smallest_frequency: f64,
    /// A bound of the frequencies of contacts between particles that is no result of an iteration, rad/s: that per particle, with the effect of
    /// deformable particles rounded up to a power of two. It depends on the frame and on the order of the particles by rounding only, and not on
    /// the form in which walls are given.
    pub closed_frequency: f64,
    /// Largest ratio β of a dashpot to its spring, s.
    pub dashpot_ratio: f64,
}

impl TimeStepBounds {
    /// Largest stable time step under artificial damping, s.
    pub fn limit(&self, damping: &Damping) -> f64 {
        limit(self.smallest_frequency, self.dashpot_ratio, damping)
    }
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

/// `min r √(ρ/E)`, s, over particles with density from mass and radius, and modulus `young` (Pa): the common P-wave
/// rule (YADE's `PWaveTimeStep`).
pub fn p_wave(particles: &Particles, young: f64) -> f64 {
    particles
        .radius
        .iter()
        .zip(&particles.mass)
        .map(|(r, m)| r * (m / (4.0 / 3.0 * std::f64::consts::PI * r * r * r) / young).sqrt())
        .fold(f64::INFINITY, f64::min)
}

/// Contact `k` of a block as an element; `None` for a broken bond.
fn element(state: &State, block: &dyn Contacts, k: usize) -> Option<Element> {
    let particles = &state.particles;
    let view = block.view(k);
    if view.flags.has(ContactFlags::BROKEN) {
        return None;
    }
    let (a, b) = (view.pair.a as usize, view.pair.b as usize);
    let shift = state.cell.as_ref().map_or_else(Vec3::zeros, |cell: &Cell| cell.shift(view.flags.image));
    let geometry = initial_geometry(&particles.position[a], &particles.position[b], &shift);
    let (arm_a, arm_b) = block.arms(k, particles, geometry.length);
    let overlap = particles.radius[a] + particles.radius[b] - geometry.length;
    Some(Element {
        a: view.pair.a,
        b: view.pair.b,
        normal: geometry.normal,
        arm_a,
        arm_b,
        stiffness: stiffness(block, k, particles, false, overlap),
    })
}

/// Blocks of all contacts between particles.
fn blocks(state: &State) -> impl Iterator<Item = &dyn Contacts> {
    state.bonds.iter().chain(&state.contacts).map(|block| block.contacts())
}

fn elements(state: &State) -> Vec<Element> {
    const PART: usize = 1 << 16;
    let mut all = Vec::new();
    for block in blocks(state) {
        all.reserve_exact(block.len());
        // In parts: a parallel iterator that leaves elements out needs the memory twice.
        for first in (0..block.len()).step_by(PART) {
            let part = first..(first + PART).min(block.len());
            all.par_extend(part.into_par_iter().filter_map(|k| element(state, block, k)));
        }
    }
    all
}

/// Largest stiffness of contact `k`, whose particles overlap by `overlap` now (m).
fn stiffness(block: &dyn Contacts, k: usize, particles: &Particles, with_wall: bool, overlap: f64) -> Stiffness {
    // Contacts with walls have no factors.
    let Pair { a, b } = block.view(k).pair;
    let b = if with_wall { a } else { b };
    let factor = block.largest_factor(particles.material[a as usize], particles.material[b as usize]);
    let stiffness = block.stiffness(k, particles, with_wall).times(factor);
    let unbonded = !block.view(k).flags.has(ContactFlags::BONDED);
    if !unbonded || overlap <= 0.0 {
        return stiffness;
    }
    let now = block.stiffness_at(k, particles, with_wall, overlap).times(factor);
    if now.normal > stiffness.normal { now } else { stiffness }
}

/// A contact with a wall as a linear element: particle, normal, arm (m), stiffness.
type WallElement = (u32, Vec3, f64, Stiffness);

/// Contacts with walls, candidates included as if particles touched the walls at all times.
fn wall_elements(state: &State) -> Vec<WallElement> {
    let Some(block) = &state.wall_contacts else { return Vec::new() };
    let block = block.contacts();
    let table = crate::walls::element_table(&state.walls);
    (0..block.len())
        .filter_map(|k| {
            let view = block.view(k);
            let a = view.pair.a as usize;
            let (w, e) = table[view.pair.b as usize];
            let (wall, position) = (&state.walls[w as usize], &state.particles.position[a]);
            let closest_point =
                wall.closest_point_of_image(e as usize, position, state.cell.as_ref(), view.flags.image)?;
            let radius = state.particles.radius[a];
            let overlap = radius - closest_point.distance;
            Some((view.pair.a, closest_point.normal, radius, stiffness(block, k, &state.particles, true, overlap)))
        })
        .collect()
}

/// Stiffness block of one end of an element: rows translation, rotation.
fn end_block(normal: &Vec3, arm: f64, k: &Stiffness) -> Matrix6<f64> {
    let nn = normal * normal.transpose();
    let tangent = Mat3::identity() - nn;
    // Tangential displacement of the end's contact point: P u + arm (φ × n) = P u − arm [n]× φ.
    let arm_cross = -normal.cross_matrix() * arm;
    let mut block = Matrix6::zeros();
    block.fixed_view_mut::<3, 3>(0, 0).copy_from(&(nn * k.normal + tangent * k.shear));
    let coupling = tangent * arm_cross * k.shear;
    block.fixed_view_mut::<3, 3>(0, 3).copy_from(&coupling);
    block.fixed_view_mut::<3, 3>(3, 0).copy_from(&coupling.transpose());
    let rotation = arm_cross.transpose() * tangent * arm_cross * k.shear + tangent * k.bending + nn * k.twist;
    block.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
    block
}

/// Largest ratio of a dashpot to its spring, s.
pub(crate) fn damping_ratio(k: &Stiffness) -> f64 {
    let ratio = |c: f64, k: f64| if c > 0.0 && k > 0.0 { c / k } else { 0.0 };
    ratio(k.normal_damping, k.normal)
        .max(ratio(k.shear_damping, k.shear))
        .max(ratio(k.bending_damping, k.bending))
        .max(ratio(k.twist_damping, k.twist))
}

/// Largest stable time step, s, at the angular frequency `frequency` (rad/s) with dashpots `C ≤ βK`, β in s.
pub(crate) fn limit(frequency: f64, beta: f64, damping: &Damping) -> f64 {
    if frequency <= 0.0 {
        return f64::INFINITY;
    }
    let zeta = 0.5 * beta * frequency;
    2.0 / frequency * ((1.0 / damping.stiffening() + zeta * zeta).sqrt() - zeta)
}

/// Bounds for the present contacts and candidates of `state` between rigid particles.
///
/// ```
/// use concordem_contact::law::LinearBond;
/// use concordem_contact::math::Vec3;
/// use concordem_packing::bonding::bond;
/// use concordem_solver::PairCoefficients;
/// use concordem_solver::state::contacts::ContactBlock;
/// use concordem_solver::state::{Particles, Sphere, State};
/// use concordem_solver::time_step::bounds;
///
/// // Two spheres of 2 kg, joined by a spring of 100 N/m: ω² = 2 · 100/2, Δt = 2/ω.
/// let mut particles = Particles::default();
/// for x in [0.0, 1.0] {
///     particles.push(Sphere { position: Vec3::new(x, 0.0, 0.0), radius: 0.5 }, 0, 2.0, 0.2);
/// }
/// let mut pairs = PairCoefficients::new(1);
/// pairs.set(0, 0, 0);
/// let spring = LinearBond::new(100.0, 0.0, 0.0, f64::INFINITY, f64::INFINITY).unwrap();
/// let mut bonds = ContactBlock::new(vec![spring]);
/// bond(&mut bonds, &pairs, &particles, None, 1.2).unwrap();
/// let state = State { particles, bonds: vec![Box::new(bonds)], ..State::default() };
/// assert!((bounds(&state).spectral - 0.2).abs() < 1e-6);
/// ```
pub fn bounds(state: &State) -> TimeStepBounds {
    bounds_with(state, None).0
}

/// [`bounds`] between deformable particles, and whether their strains and forces converge. If they do not, no time step
/// is stable, and the bounds are those of rigid particles.
pub fn bounds_with(state: &State, deformable: Option<&Deformable>) -> (TimeStepBounds, Option<Convergence>) {
    bounds_unless(state, deformable, |_| false)
}

/// As [`bounds_with`]. If the bound per particle `suffices`, the Lanczos iteration, which takes most of the time, is left out: `spectral`
/// is then the bound per particle, and `iterations` is 0.
pub fn bounds_unless(
    state: &State,
    deformable: Option<&Deformable>,
    suffices: impl Fn(&TimeStepBounds) -> bool,
) -> (TimeStepBounds, Option<Convergence>) {
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
    let walls = wall_elements(state);
    let scale = mass_scale(state);
    let PerParticle { largest, between, beta } = per_particle(state, &walls, &scale);
    let largest = largest * stiffening;
    let closed_frequency = (between * power_of_two_above(stiffening)).max(0.0).sqrt();
    let per_particle_frequency = largest.max(0.0).sqrt();
    let bounds = |square: f64, width: f64, iterations: usize| {
        let frequency = square.max(0.0).sqrt();
        TimeStepBounds {
            per_particle: limit(per_particle_frequency, beta, &Damping::None),
            spectral: limit(frequency, beta, &Damping::None),
            frequency,
            uncertainty: if square > 0.0 { 0.5 * width / square } else { 0.0 },
            iterations,
            smallest_frequency: frequency.min(per_particle_frequency),
            closed_frequency,
            dashpot_ratio: beta,
        }
    };
    let rough = bounds(largest, largest, 0);
    if suffices(&rough) {
        return (rough, convergence);
    }
    let mut network = Network::new(scale.len(), elements(state), &walls);
    let found = lanczos::largest_eigenvalue(
        scale.len(),
        |p, i| scale[p][i] != 0.0,
        largest,
        1e-4,
        |x, y| {
            network.apply(&scale, x, y);
            if let Some(coupling) = &coupling {
                let motion = |p: usize| halves(&x[p].component_mul(&scale[p]));
                coupling.add_stiffness(update, motion, |p, force, torque| {
                    y[p] += joined(&force, &torque).component_mul(&scale[p]);
                });
            }
        },
    );
    (bounds(found.upper, found.width, found.iterations), convergence)
}

/// The least power of two that is not below `value`; 1 for values up to 1, and for those that are no number.
fn power_of_two_above(value: f64) -> f64 {
    let powers = std::iter::successors(Some(1.0), |power| Some(2.0 * power));
    let mut powers = powers.skip_while(|power: &f64| *power < value && power.is_finite());
    powers.next().unwrap_or(1.0)
}

/// `Σ k l²` over all contacts and candidates, J, with the larger one of normal and shear stiffness k and the center distance l: over the volume,
/// at least the stiffness of a body under any affine strain.
pub fn stiffness_sum(state: &State) -> f64 {
    let all = blocks(state).flat_map(|block| (0..block.len()).filter_map(|k| element(state, block, k)));
    let length = |e: &Element| e.arm_a + e.arm_b;
    all.map(|e| e.stiffness.normal.max(e.stiffness.shear) * (length(&e) * length(&e))).sum()
}

/// Inverse square roots of the masses and moments of inertia, by particle; zero for prescribed degrees of freedom.
fn mass_scale(state: &State) -> Vec<Vector6<f64>> {
    let particles = &state.particles;
    // Rigid connections and more mass lower frequencies (Rayleigh). So a clump vibrates no faster than its members
    // would separately, if each had such a fraction of its mass that together they are no heavier than the clump.
    let fractions: Vec<f64> = state.clumps.iter().map(|clump| clump.mass_fraction(particles)).collect();
    (0..particles.len())
        .map(|p| {
            let c = particles.constraint[p];
            let fraction = fractions.get(particles.clump[p] as usize).copied().unwrap_or(1.0);
            Vector6::from_fn(|i, _| {
                let fixed = if i < 3 { c.translation(i) } else { c.rotation(i - 3) };
                let m = if i < 3 { particles.mass[p] } else { particles.inertia[p] };
                if fixed { 0.0 } else { 1.0 / (fraction * m).sqrt() }
            })
        })
        .collect()
}

/// Contacts of the particles of a tile.
#[derive(Default)]
struct TileContacts {
    /// Numbers of the block and of the contact in it, ascending.
    between: Vec<(u32, u32)>,
    /// Indices of the elements with walls, ascending.
    walls: Vec<u32>,
}

/// Bounds from the stiffness blocks of single particles.
#[derive(Debug, Clone, Copy, Default)]
struct PerParticle {
    /// `max_p λ_max` of the mass-scaled stiffness blocks: an upper bound of the largest squared frequency of rigid particles, 1/s².
    largest: f64,
    /// The same without walls.
    between: f64,
    /// Largest ratio of a dashpot to its spring, s.
    beta: f64,
}

impl PerParticle {
    fn or_larger(self, other: Self) -> Self {
        Self {
            largest: self.largest.max(other.largest),
            between: self.between.max(other.between),
            beta: self.beta.max(other.beta),
        }
    }
}

/// The bounds of rigid particles.
///
/// Tile by tile, so that neither all elements nor all stiffness blocks are in memory at once; a contact between two tiles is an element of
/// both. A particle sums its elements in their order.
fn per_particle(state: &State, walls: &[WallElement], scale: &[Vector6<f64>]) -> PerParticle {
    const TILE: usize = 1024;
    let is_held = |p: u32| scale[p as usize].amax() == 0.0;
    let mut tiles: Vec<TileContacts> = Vec::new();
    tiles.resize_with(scale.len().div_ceil(TILE), TileContacts::default);
    let contacts: Vec<&dyn Contacts> = blocks(state).collect();
    for (number, block) in contacts.iter().enumerate() {
        for (k, pair) in block.pairs().iter().enumerate() {
            let (a, b) = (pair.a as usize / TILE, pair.b as usize / TILE);
            tiles[a].between.push((number as u32, k as u32));
            if b != a {
                tiles[b].between.push((number as u32, k as u32));
            }
        }
    }
    for (k, wall) in walls.iter().enumerate() {
        tiles[wall.0 as usize / TILE].walls.push(k as u32);
    }
    let of_tile = |(tile, scale): (&TileContacts, &[Vector6<f64>]), first: usize| {
        let mut blocks = vec![Matrix6::<f64>::zeros(); scale.len()];
        let mut beta = 0.0_f64;
        for &(number, k) in &tile.between {
            let Some(e) = element(state, contacts[number as usize], k as usize) else { continue };
            // Between two particles that are held nothing moves, and a host may let their masses, and so their dashpot, be as good as infinite.
            if !(is_held(e.a) && is_held(e.b)) {
                beta = beta.max(damping_ratio(&e.stiffness));
            }
            // Ends in other tiles are not among the blocks.
            if let Some(block) = blocks.get_mut((e.a as usize).wrapping_sub(first)) {
                *block += end_block(&e.normal, e.arm_a, &e.stiffness) * 2.0;
            }
            if let Some(block) = blocks.get_mut((e.b as usize).wrapping_sub(first)) {
                *block += end_block(&-e.normal, e.arm_b, &e.stiffness) * 2.0;
            }
        }
        let eigenvalue = |(block, s): (&Matrix6<f64>, &Vector6<f64>)| {
            let scaled = Matrix6::from_fn(|i, j| block[(i, j)] * s[i] * s[j]);
            scaled.symmetric_eigenvalues().max()
        };
        let between = blocks.iter().zip(scale).map(eigenvalue).fold(0.0, f64::max);
        let mut beside_walls = vec![false; if tile.walls.is_empty() { 0 } else { scale.len() }];
        for &k in &tile.walls {
            let (p, normal, arm, k) = &walls[k as usize];
            let p = *p as usize - first;
            beta = beta.max(damping_ratio(k));
            blocks[p] += end_block(normal, *arm, k);
            beside_walls[p] = true;
        }
        let changed = blocks.iter().zip(scale).zip(&beside_walls).filter(|(_, beside)| **beside);
        let largest = changed.map(|(particle, _)| eigenvalue(particle)).fold(between, f64::max);
        PerParticle { largest, between, beta }
    };
    let tiles = tiles.par_iter().zip(scale.par_chunks(TILE)).enumerate();
    tiles.map(|(t, tile)| of_tile(tile, t * TILE)).reduce(PerParticle::default, PerParticle::or_larger)
}
