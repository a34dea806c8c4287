//! Frequencies of possible contacts: pairs of particles, and of particles and walls, that may meet during a run.
//!
//! A contact is stable for `Δt < 2/ω`, and an impact is resolved only at a fraction of that: the half period of a linear
//! contact has `π/(ωΔt)` steps. The frequencies are those of one contact between two free bodies,
//!
//! `ω_n² = k_n (1/m_A + 1/m_B)`, `ω_t² = k_t (1/m_A + 1/m_B + a_A²/I_A + a_B²/I_B)`
//!
//! with the arms a; prescribed bodies and walls have no inverse mass. Stiffnesses that grow with the overlap are those of an
//! elastic impact at the largest relative speed.

use concordem_contact::law::{ContactGeometry, Stiffness};
use concordem_contact::math::{Vec3, pow};

use crate::Model;
use crate::evaluation::BegunContact;
use crate::integrate::Damping;
use crate::state::contacts::{ContactFlags, Contacts};
use crate::state::{Particles, State};
use crate::time_step::{damping_ratio, limit};
use crate::walls::element_table;

/// Largest number of particles that represent one material, from the smallest to the largest.
const REPRESENTATIVES: usize = 16;

/// Largest number of representatives of all materials together, unless two of each are more.
const ALL_REPRESENTATIVES: usize = 512;

/// The contact of the highest frequency that may form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collision {
    /// Angular frequency, rad/s.
    pub frequency: f64,
    /// Largest ratio of a dashpot to its spring, s.
    pub dashpot_ratio: f64,
    /// Materials of both bodies, as indices.
    pub materials: [u16; 2],
    /// Index of the wall, if B is one.
    pub wall: Option<usize>,
    /// Largest relative speed expected, m/s.
    pub speed: f64,
    /// Overlap of the impact, m; 0 if the stiffness does not depend on it.
    pub overlap: f64,
}

impl Collision {
    /// Largest stable time step of this contact alone, s.
    pub fn limit(&self, damping: &Damping) -> f64 {
        limit(self.frequency, self.dashpot_ratio, damping)
    }
}

/// A body of a collision.
#[derive(Clone, Copy)]
struct Body {
    material: u16,
    radius: f64,
    mass: f64,
    /// Inverse mass, 1/kg, and inverse moment of inertia, 1/(kg·m²); zero if prescribed.
    inverse: [f64; 2],
}

impl Body {
    fn of(particles: &Particles, p: usize, fraction: f64) -> Self {
        let c = particles.constraint[p];
        let free = |fixed: bool, value: f64| if fixed { 0.0 } else { 1.0 / (fraction * value) };
        Self {
            material: particles.material[p],
            radius: particles.radius[p],
            mass: particles.mass[p],
            inverse: [
                free((0..3).all(|i| c.translation(i)), particles.mass[p]),
                free((0..3).all(|i| c.rotation(i)), particles.inertia[p]),
            ],
        }
    }
}

/// The stiffest contact that may form in a run from this state under the law of unbonded contacts of `model`; `None` if
/// no contact can form.
///
/// Considers every pair of materials and every wall. Up to 16 particles represent each material, the smallest and the
/// largest among them: for stiffnesses that are powers of the radii the frequency is largest at these.
pub fn stiffest(state: &State, model: &Model) -> Option<Collision> {
    let bodies = representatives(state);
    let speeds = Speeds::of(state, model);
    let mut found: Option<Collision> = None;
    let mut take = |candidate: Collision| {
        let faster = |best: &Collision| candidate.limit(&Damping::None) < best.limit(&Damping::None);
        if candidate.frequency > 0.0 && found.as_ref().is_none_or(faster) {
            found = Some(candidate);
        }
    };
    if let Some(block) = &state.contacts {
        let block = block.contacts();
        let across_joints = model.joints.rows();
        for a in &bodies {
            for b in &bodies {
                let Some(row) = model.contact_rows.get(a.material, b.material) else { continue };
                let geometry = geometry(a, b);
                for &row in [row].iter().chain(&across_joints) {
                    let (stiffness, overlap) = block.impact(row, &geometry, speeds.particles);
                    let stiffness = stiffness.times(block.largest_factor(a.material, b.material));
                    take(collision([a, b], &stiffness, [a.radius, b.radius], speeds.particles, overlap));
                }
            }
        }
    }
    if let Some(block) = &state.wall_contacts {
        let block = block.contacts();
        for (number, wall) in state.walls.iter().enumerate() {
            let surface = Body { material: wall.material, radius: 0.0, mass: f64::INFINITY, inverse: [0.0; 2] };
            for a in &bodies {
                let Some(row) = model.wall_rows.get(a.material, wall.material) else { continue };
                let speed = speeds.walls[number];
                let (stiffness, overlap) = block.impact(row, &geometry(a, &surface), speed);
                let found = collision([a, &surface], &stiffness, [a.radius, 0.0], speed, overlap);
                take(Collision { wall: Some(number), ..found });
            }
        }
    }
    found
}

/// A contact whose stiffness has outgrown the time step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outgrown {
    /// Particle A, by index.
    pub a: usize,
    /// Particle B, by index, or wall, by index.
    pub b: usize,
    /// Whether B is a wall.
    pub with_wall: bool,
    /// Overlap that the contact has, or will reach at its present speed, m.
    pub overlap: f64,
    /// Largest stable time step of the contact alone, s.
    pub bound: f64,
}

/// The first contact whose time step bound is below the time step of `state`, at the overlap that it will reach at its present speed.
/// `None` for laws whose stiffness does not grow with the overlap: [`stiffest`] covers them from the start.
///
/// Considers contacts that touch, not candidates: which candidates exist depends on when the neighbor list was made, and a restarted
/// run makes it at another time.
pub fn outgrown(state: &State, model: &Model) -> Option<Outgrown> {
    let touching = |block: &dyn Contacts| -> Vec<BegunContact> {
        let views = (0..block.len()).map(|k| block.view(k)).filter(|view| view.flags.has(ContactFlags::ACTIVE));
        views.map(|view| BegunContact { pair: view.pair, image: view.flags.image, row: view.flags.row }).collect()
    };
    let of = |block: Option<&dyn Contacts>| block.filter(|block| block.stiffens()).map(touching).unwrap_or_default();
    let contacts = of(state.contacts.as_ref().map(|block| block.contacts()));
    let walls = of(state.wall_contacts.as_ref().map(|block| block.contacts()));
    if contacts.is_empty() && walls.is_empty() { None } else { outgrown_among(state, model, &contacts, &walls) }
}

/// [`outgrown`] among some contacts between particles, and some with walls.
pub fn outgrown_among(
    state: &State,
    model: &Model,
    contacts: &[BegunContact],
    walls: &[BegunContact],
) -> Option<Outgrown> {
    let particles = &state.particles;
    let fractions: Vec<f64> = state.clumps.iter().map(|clump| clump.mass_fraction(particles)).collect();
    let body = |p: usize| Body::of(particles, p, fractions.get(particles.clump[p] as usize).copied().unwrap_or(1.0));
    let gradient = state.cell.map(|cell| cell.velocity_gradient).unwrap_or_default();
    let bound_of = |block: &dyn Contacts, row: u16, bodies: [&Body; 2], gap: f64, speed: f64| {
        let geometry = geometry(bodies[0], bodies[1]);
        let (_, of_speed) = block.impact(row, &geometry, speed);
        // Energies of the present overlap and of the approach add up: δ^{5/2} = δ₀^{5/2} + δ_v^{5/2}.
        let now = (-gap).max(0.0);
        let overlap = pow(pow(now, 2.5) + pow(of_speed, 2.5), 0.4);
        let stiffness = block.compressed(row, &geometry, overlap);
        let found = collision(bodies, &stiffness, bodies.map(|body| body.radius), speed, overlap);
        (overlap, found.limit(&model.damping))
    };
    if let Some(block) = state.contacts.as_ref().map(|block| block.contacts()) {
        for contact in contacts {
            let (a, b) = (contact.pair.a as usize, contact.pair.b as usize);
            let shift = state.cell.map_or_else(Vec3::zeros, |cell| cell.shift(contact.image));
            let branch = particles.position[b] + shift - particles.position[a];
            let velocity = particles.velocity[b] + gradient * shift - particles.velocity[a];
            let gap = branch.norm() - particles.radius[a] - particles.radius[b];
            let speed = (-velocity.dot(&branch.normalize())).max(0.0);
            let (overlap, bound) = bound_of(block, contact.row, [&body(a), &body(b)], gap, speed);
            if state.clock.dt > bound {
                return Some(Outgrown { a, b, with_wall: false, overlap, bound });
            }
        }
    }
    let block = state.wall_contacts.as_ref().map(|block| block.contacts())?;
    let elements = if walls.is_empty() { Vec::new() } else { element_table(&state.walls) };
    for contact in walls {
        let (a, (w, e)) = (contact.pair.a as usize, elements[contact.pair.b as usize]);
        let (wall, cell) = (&state.walls[w as usize], state.cell.as_ref());
        let Some(point) = wall.closest_point_of_image(e as usize, &particles.position[a], cell, contact.image) else {
            continue;
        };
        let speed = (particles.velocity[a] - wall.velocity).dot(&point.normal).max(0.0);
        let surface = Body { material: wall.material, radius: 0.0, mass: f64::INFINITY, inverse: [0.0; 2] };
        let gap = point.distance - particles.radius[a];
        let (overlap, bound) = bound_of(block, contact.row, [&body(a), &surface], gap, speed);
        if state.clock.dt > bound {
            return Some(Outgrown { a, b: w as usize, with_wall: true, overlap, bound });
        }
    }
    None
}

fn geometry(a: &Body, b: &Body) -> ContactGeometry {
    ContactGeometry {
        reference_length: a.radius + b.radius,
        area: 0.0,
        radius_a: a.radius,
        radius_b: b.radius,
        mass_a: a.mass,
        mass_b: b.mass,
    }
}

fn collision([a, b]: [&Body; 2], k: &Stiffness, arms: [f64; 2], speed: f64, overlap: f64) -> Collision {
    let translation = a.inverse[0] + b.inverse[0];
    let rotation = arms[0] * arms[0] * a.inverse[1] + arms[1] * arms[1] * b.inverse[1];
    let square = (k.normal * translation).max(k.shear * (translation + rotation));
    Collision {
        frequency: square.sqrt(),
        dashpot_ratio: damping_ratio(k),
        materials: [a.material, b.material],
        wall: None,
        speed,
        overlap,
    }
}

/// Particles of each material, evenly spaced in the order by radius, then mass.
fn representatives(state: &State) -> Vec<Body> {
    let particles = &state.particles;
    let fractions: Vec<f64> = state.clumps.iter().map(|clump| clump.mass_fraction(particles)).collect();
    let mut order: Vec<u32> = (0..particles.len() as u32).collect();
    let key = |p: u32| {
        let p = p as usize;
        (particles.material[p], particles.radius[p], particles.mass[p])
    };
    order.sort_unstable_by(|&p, &q| {
        let (a, b) = (key(p), key(q));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.total_cmp(&b.2)).then(p.cmp(&q))
    });
    let materials = order.chunk_by(|&p, &q| particles.material[p as usize] == particles.material[q as usize]).count();
    let most = (ALL_REPRESENTATIVES / materials.max(1)).clamp(2, REPRESENTATIVES);
    let mut bodies = Vec::new();
    for group in order.chunk_by(|&p, &q| particles.material[p as usize] == particles.material[q as usize]) {
        // Select free particles and members of clumps separately, so that prescribed particles do not hide them.
        let free = |p: &&u32| {
            let c = particles.constraint[**p as usize];
            !(0..3).all(|i| c.translation(i))
        };
        let movable: Vec<u32> = group.iter().filter(free).copied().collect();
        let held: Vec<u32> = group.iter().filter(|p| !free(p)).copied().collect();
        for part in [movable, held] {
            let count = part.len().min(most);
            for k in 0..count {
                let place = if count > 1 { k * (part.len() - 1) / (count - 1) } else { 0 };
                let p = part[place] as usize;
                let fraction = fractions.get(particles.clump[p] as usize).copied().unwrap_or(1.0);
                bodies.push(Body::of(particles, p, fraction));
            }
        }
    }
    bodies
}

/// Largest relative speeds expected, m/s.
struct Speeds {
    /// Between particles.
    particles: f64,
    /// Between particles and each wall.
    walls: Vec<f64>,
}

impl Speeds {
    /// From the present velocities (in a periodic cell without its affine motion), and free fall through the height of
    /// the scene.
    fn of(state: &State, model: &Model) -> Self {
        let particles = &state.particles;
        let gradient = state.cell.map(|cell| cell.velocity_gradient).unwrap_or_default();
        let velocity = |p: usize| particles.velocity[p] - gradient * particles.position[p];
        let n = particles.len();
        let mean = (0..n).map(velocity).sum::<Vec3>() / n.max(1) as f64;
        let largest = |from: &Vec3| (0..n).map(|p| (velocity(p) - from).norm_squared()).fold(0.0, f64::max).sqrt();
        let gravity = model.gravity.norm();
        // v² = 2gh
        let fall = if gravity > 0.0 { 2.0 * gravity * height(state, &(model.gravity / gravity)) } else { 0.0 };
        let with_fall = |speed: f64| (speed * speed + fall).sqrt();
        let shear =
            if n > 0 { gradient.norm() * 2.0 * particles.radius.iter().copied().fold(0.0, f64::max) } else { 0.0 };
        Self {
            particles: with_fall(2.0 * largest(&mean) + shear),
            walls: state
                .walls
                .iter()
                // Vertices of a mesh may move in any direction.
                .map(|wall| with_fall(largest(&wall.velocity) + wall.mesh().map_or(0.0, |mesh| mesh.fastest().0)))
                .collect(),
        }
    }
}

/// Extent of particles and walls along the unit vector `along`, m.
fn height(state: &State, along: &Vec3) -> f64 {
    let mut bounds = (f64::INFINITY, f64::NEG_INFINITY);
    let mut take = |place: f64| bounds = (bounds.0.min(place), bounds.1.max(place));
    for position in &state.particles.position {
        take(position.dot(along));
    }
    for wall in &state.walls {
        wall.span(along).into_iter().flatten().for_each(&mut take);
    }
    (bounds.1 - bounds.0).max(0.0)
}
