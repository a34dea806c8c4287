//! The links along which heat flows, the volume that each particle stands for, and the surface of the body.
//!
//! | | area of a link | volume of a particle | source |
//! |---|---|---|---|
//! | [`ordered`] | `4 R_i R_j` (2-D: `2√(R_i R_j)`) | `8R³` (2-D: `4R²`) | (3.7)–(3.10), simple cubic |
//! | [`disordered`] | `√(S_i S_j)`, `S = S_t(n) R²` | `V/f_v(n)` | (3.12), (3.13), table 3.1 |
//! | [`power`] | faces of the power diagram | cells of the power diagram | two-point fluxes |
//!
//! Equations of Jebahi et al. 2015, with `n` neighbors; (3.11) is printed upside down and means `f_v = π/6`. The faces of
//! a power diagram are perpendicular to the lines between centers. Therefore a linear field of temperatures gives the
//! exact flux through each face, and is exactly steady inside. The printed method has no such property: it knows the
//! number of neighbors, not their places.

use concordem_contact::math::Vec3;
use concordem_operator::HalfSpace;
use concordem_operator::OperatorError;
use concordem_operator::strain::Dimension;
use concordem_operator::tessellation::{Domain, Neighbor, power_diagram};

use super::tables::{transmission_surface, volume_fraction};
use crate::neighbor::{NeighborError, candidate_pairs};
use crate::state::{Cell, Particles};

/// A link between two particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// First particle.
    pub a: u32,
    /// Second particle.
    pub b: u32,
    /// Area, m².
    pub area: f64,
    /// Distance of the center of A from the area, m.
    pub length_a: f64,
    /// Distance of the center of B from the area, m.
    pub length_b: f64,
    /// From the center of A to that of B, or of its image, at the start, m.
    pub branch: Vec3,
}

/// A plane that bounds the body. The planes around a curved face have the same number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// The half-space with the body.
    pub inside: HalfSpace,
    /// Number of the face of the body.
    pub face: u32,
}

/// A part of a particle's surface at the border of the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exposure {
    /// Particle.
    pub particle: u32,
    /// Number of the face of the body ([`Plane::face`]).
    pub face: u32,
    /// Area, m².
    pub area: f64,
    /// Distance of the center from it, m.
    pub distance: f64,
    /// Outward unit normal at the start.
    pub normal: Vec3,
}

/// Links, volumes, and surfaces.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Network {
    /// Links.
    pub links: Vec<Link>,
    /// Volume that each particle stands for, m³.
    pub volume: Vec<f64>,
    /// Surface of the body.
    pub exposures: Vec<Exposure>,
}

/// Two particles with the vector from the center of the first to that of the second, or of its image, m.
pub type NearPair = (u32, u32, Vec3);

/// Pairs of particles that touch: those not farther apart than `ratio` times the
/// sum of their radii. A particle may touch its own image.
///
/// # Errors
/// Input that the neighbor search rejects.
pub fn touching(particles: &Particles, cell: Option<&Cell>, ratio: f64) -> Result<Vec<NearPair>, NeighborError> {
    // The search leaves out pairs at exactly the given distance.
    let reach: Vec<f64> = particles.radius.iter().map(|r| r * ratio * (1.0 + 1e-9)).collect();
    let branch = |a: u32, b: u32, image: [i8; 3]| {
        let shift = cell.map_or(Vec3::zeros(), |cell| cell.shift(image));
        particles.position[b as usize] + shift - particles.position[a as usize]
    };
    let pairs = candidate_pairs(&particles.position, &reach, cell)?;
    let near = |&(a, b, branch): &NearPair| branch.norm() <= reach[a as usize] + reach[b as usize];
    Ok(pairs.iter().map(|pair| (pair.a, pair.b, branch(pair.a, pair.b, pair.image))).filter(near).collect())
}

/// Faces that a particle's sphere reaches, with the distance (m) of its center from the nearest plane of each, and its normal.
fn reached(particles: &Particles, planes: &[Plane], p: usize) -> Vec<(u32, f64, Vec3)> {
    let mut found: Vec<(u32, f64, Vec3)> = Vec::new();
    for Plane { inside, face } in planes {
        let normal = inside.normal.normalize();
        let distance = (inside.point - particles.position[p]).dot(&normal);
        if distance <= 0.0 || distance > particles.radius[p] * (1.0 + 1e-6) {
            continue;
        }
        match found.iter_mut().find(|(other, ..)| other == face) {
            Some(nearest) if distance < nearest.1 => *nearest = (*face, distance, normal),
            Some(_) => {}
            None => found.push((*face, distance, normal)),
        }
    }
    found
}

/// A link between the centers of two spheres with an area (m²).
fn link(particles: &Particles, (a, b, branch): NearPair, area: f64) -> Link {
    let length = branch.norm();
    let [radius_a, radius_b] = [a, b].map(|p| particles.radius[p as usize]);
    let length_a = length * (radius_a / (radius_a + radius_b));
    Link { a, b, area, length_a, length_b: length - length_a, branch }
}

/// The network of a simple cubic (in the plane: square) lattice, (3.7)–(3.10): the 7-point stencil. `pairs`: see
/// [`touching`]; `planes` bound the body.
pub fn ordered(particles: &Particles, pairs: &[NearPair], planes: &[Plane], planar: bool) -> Network {
    let edge = |p: u32| 2.0 * particles.radius[p as usize];
    let area = |p: u32| if planar { edge(p) } else { edge(p) * edge(p) };
    let between = |&(a, b, branch): &NearPair| {
        let (of_a, of_b) = (area(a), area(b));
        // Equal spheres have exactly their own area.
        let shared = if of_a == of_b { of_a } else { (of_a * of_b).sqrt() };
        link(particles, (a, b, branch), shared)
    };
    let count = particles.len() as u32;
    let volume = |p: u32| if planar { edge(p) * edge(p) } else { edge(p) * edge(p) * edge(p) };
    let exposures = (0..count).flat_map(|particle| {
        let faces = reached(particles, planes, particle as usize).into_iter();
        faces.map(move |(face, distance, normal)| Exposure { particle, face, area: area(particle), distance, normal })
    });
    Network {
        links: pairs.iter().filter(|pair| pair.0 != pair.1).map(between).collect(),
        volume: (0..count).map(volume).collect(),
        exposures: exposures.collect(),
    }
}

/// The network of grains: links of the [`ordered`] network between `pairs`, such as bonds, and the particles' own volumes. Grains have no
/// surface.
pub fn grains(particles: &Particles, pairs: &[NearPair], planar: bool) -> Network {
    let sphere = |r: f64| if planar { r * r } else { 4.0 / 3.0 * r * r * r };
    let volume = particles.radius.iter().map(|r| std::f64::consts::PI * sphere(*r)).collect();
    Network { volume, ..ordered(particles, pairs, &[], planar) }
}

/// The network of a disordered packing, (3.12) and (3.13). `pairs`: see [`touching`]; `planes` bound the body. A face counts
/// as a neighbor of the particles at it.
pub fn disordered(particles: &Particles, pairs: &[NearPair], planes: &[Plane]) -> Network {
    let mut neighbors = vec![0_u32; particles.len()];
    for &(a, b, _) in pairs {
        neighbors[a as usize] += 1;
        neighbors[b as usize] += 1;
    }
    let surface = |p: u32, neighbors: u32| {
        transmission_surface(neighbors) * particles.radius[p as usize] * particles.radius[p as usize]
    };
    let between = |&(a, b, branch): &NearPair| {
        let area = (surface(a, neighbors[a as usize]) * surface(b, neighbors[b as usize])).sqrt();
        link(particles, (a, b, branch), area)
    };
    let volume = |p: usize| {
        let radius = particles.radius[p];
        4.0 / 3.0 * std::f64::consts::PI * radius * radius * radius / volume_fraction(neighbors[p])
    };
    let neighbors = &neighbors;
    let exposures = (0..particles.len() as u32).flat_map(|particle| {
        let faces = reached(particles, planes, particle as usize);
        let area = surface(particle, neighbors[particle as usize] + faces.len() as u32);
        faces.into_iter().map(move |(face, distance, normal)| Exposure { particle, face, area, distance, normal })
    });
    Network {
        links: pairs.iter().filter(|pair| pair.0 != pair.1).map(between).collect(),
        volume: (0..particles.len()).map(volume).collect(),
        exposures: exposures.collect(),
    }
}

/// The network of the power diagram of the particles in a periodic cell, or else between `planes`, which must contain all
/// centers.
///
/// # Errors
/// A center outside the planes, centers that coincide, a cell that is not closed.
pub fn power(
    particles: &Particles,
    cell: Option<&Cell>,
    planes: &[Plane],
    planar: bool,
) -> Result<Network, OperatorError> {
    let dimension = if planar { Dimension::Two } else { Dimension::Three };
    let domain = match cell {
        Some(cell) => Domain::Periodic(cell.matrix),
        None => Domain::HalfSpaces(planes.iter().map(|plane| plane.inside).collect()),
    };
    let diagram = power_diagram(&particles.position, &particles.radius, &domain, dimension)?;
    let (mut links, mut exposures) = (Vec::new(), Vec::new());
    for face in &diagram.faces {
        let area = face.area.norm();
        match face.neighbor {
            Neighbor::Border(plane) => {
                let number = planes[plane as usize].face;
                let normal = planes[plane as usize].inside.normal.normalize();
                let distance = face.distance;
                exposures.push(Exposure { particle: face.point, face: number, area, distance, normal });
            }
            // Heat between a particle and its own image changes nothing.
            Neighbor::Particle { point, .. } if point == face.point => {}
            Neighbor::Particle { point, .. } => {
                let length = face.branch.norm();
                // The radical plane may lie behind the center of a small particle that overlaps a large one.
                let length_a = face.distance.clamp(0.0, length);
                let (length_a, length_b) = (length_a, length - length_a);
                let (a, b) = (face.point.min(point), face.point.max(point));
                let forward = a == face.point;
                let (length_a, length_b) = if forward { (length_a, length_b) } else { (length_b, length_a) };
                let branch = if forward { face.branch } else { -face.branch };
                links.push(Link { a, b, area, length_a, length_b, branch });
            }
        }
    }
    Ok(Network { links, volume: diagram.volumes, exposures })
}
