//! 1,000 glass spheres in a program with its own loop: two halves of a cube fly into each other.
//!
//! The loop owns positions, velocities, and the list of near pairs; the library steps the contacts.

use std::collections::BTreeMap;

use concordem_contact::law::{Elastic, HertzMindlin};
use concordem_contact::math::{Quat, Vec3};
use concordem_contact::own_loop::{PairContact, Particle};

/// Radius, m.
const RADIUS: f64 = 1e-3;
/// Time step, s.
const DT: f64 = 1e-7;
/// Spheres along an edge of the cube.
const EDGE: usize = 10;

/// A sphere between steps.
struct Sphere {
    position: Vec3,
    velocity: Vec3,
    angular_velocity: Vec3,
}

/// Pairs whose surfaces are nearer than half a radius.
fn near_pairs(spheres: &[Sphere]) -> Vec<(usize, usize)> {
    let near = |i: usize, j: usize| (spheres[i].position - spheres[j].position).norm() < 2.5 * RADIUS;
    (0..spheres.len()).flat_map(|i| (i + 1..spheres.len()).map(move |j| (i, j))).filter(|&(i, j)| near(i, j)).collect()
}

fn main() {
    let glass = Elastic { young: 70e9, poisson: 0.22 };
    let law = HertzMindlin::new(glass, glass, 0.3, 0.9).expect("parameters in their ranges");
    let mass = 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3);
    let inertia = 0.4 * mass * RADIUS * RADIUS;
    let mut spheres: Vec<Sphere> = (0..EDGE * EDGE * EDGE)
        .map(|k| {
            let place = [k % EDGE, k / EDGE % EDGE, k / (EDGE * EDGE)].map(|n| n as f64);
            // Rows that are a little shifted, so that spheres meet obliquely.
            let position = Vec3::new(place[0], place[1] + 0.03 * place[0], place[2] + 0.02 * place[1]) * (2.1 * RADIUS);
            let speed = if place[0] < EDGE as f64 / 2.0 { 0.5 } else { -0.5 };
            Sphere { position, velocity: Vec3::x() * speed, angular_velocity: Vec3::zeros() }
        })
        .collect();
    let momentum = |spheres: &[Sphere]| spheres.iter().map(|s| s.velocity).sum::<Vec3>() * mass;
    let kinetic = |spheres: &[Sphere]| -> f64 {
        let twice = |s: &Sphere| mass * s.velocity.norm_squared() + inertia * s.angular_velocity.norm_squared();
        spheres.iter().map(|s| 0.5 * twice(s)).sum()
    };
    let before = kinetic(&spheres);
    let mut contacts: BTreeMap<(usize, usize), PairContact<_>> = BTreeMap::new();
    // By contacts that are not followed any more.
    let mut lost = 0.0;
    for step in 0..5_000 {
        // 0.5 m/s for 200 steps is a hundredth of a radius.
        if step % 200 == 0 {
            let near = near_pairs(&spheres);
            contacts.retain(|pair, contact| {
                let stays = contact.is_active() || near.binary_search(pair).is_ok();
                lost += if stays { 0.0 } else { contact.energy().dissipated };
                stays
            });
            for pair in near {
                contacts.entry(pair).or_default();
            }
        }
        let moved: Vec<Particle> = spheres
            .iter_mut()
            .map(|s| {
                s.position += s.velocity * DT;
                Particle::new(s.position, s.velocity, RADIUS, mass).turning(s.angular_velocity, Quat::identity(), DT)
            })
            .collect();
        for (&(i, j), contact) in &mut contacts {
            let on = contact.respond(&law, &moved[i], &moved[j], DT);
            for (k, wrench) in [(i, on.a), (j, on.b)] {
                spheres[k].velocity += wrench.force / mass * DT;
                spheres[k].angular_velocity += wrench.torque / inertia * DT;
            }
        }
    }
    let stored: f64 = contacts.values().map(|contact| contact.energy().stored).sum();
    lost += contacts.values().map(|contact| contact.energy().dissipated).sum::<f64>();
    let after = kinetic(&spheres);
    println!("momentum {:.1e} of {:.1e} kg m/s", momentum(&spheres).norm(), 0.5 * mass * spheres.len() as f64);
    println!("energy: {before:.4e} J at the start; {after:.4e} J of motion, {stored:.1e} J stored, {lost:.4e} J lost");
    println!("balance {:.1e} of it", ((after + stored + lost) / before - 1.0).abs());
}
