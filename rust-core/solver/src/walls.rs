//! Forces between particles and walls.
//!
//! A particle near a surface of triangles can have several nearest points. A point inside a face always counts; a
//! point on an edge or corner counts only if it is a nearest point of the surface as a whole: no other triangle that
//! contains it has a nearer one, and of several triangles for which it is the nearest, one acts. So a flat or convex
//! surface acts once, not once per triangle. Where the
//! nearest point passes from one triangle to the next, the new contact goes on with the history of the old one.

use super::forces::{BondEvent, StepContext, Totals, motion_of};
use crate::record::WallForces;
use crate::state::Wall;
use crate::state::contacts::{ContactBlock, ContactFlags};
use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::kinematics::deformable::{ParticleVirial, ParticleVirials};
use concordem_contact::law::{ContactGeometry, ContactLaw, Kinematics, Status};
use concordem_contact::math::Vec3;
use concordem_contact::wall::ClosestPoint;

/// Two points of a surface closer than this share of the particle's radius are the same point.
const SAME_POINT: f64 = 1e-6;

/// Cosine of the largest turn of the normal in one step between triangles of which one takes over from the other.
const SAME_SURFACE: f64 = 0.5;

/// Wall and element of every element number.
pub fn element_table(walls: &[Wall]) -> Vec<(u32, u32)> {
    walls
        .iter()
        .enumerate()
        .flat_map(|(w, wall)| (0..wall.element_count()).map(move |e| (w as u32, e as u32)))
        .collect()
}

/// See [`super::forces::EvaluatedContacts::evaluate_walls`]. What acts is added to `record`, if there is one.
pub fn evaluate<L: ContactLaw>(
    block: &mut ContactBlock<L>,
    context: &StepContext<'_>,
    walls: &mut [Wall],
    force: &mut [Vec3],
    torque: &mut [Vec3],
    virials: &mut ParticleVirials<'_>,
    mut record: Option<&mut WallForces>,
) -> Totals {
    let elements = element_table(walls);
    let particles = context.particles;
    let mut totals = Totals::default();
    for wall in walls.iter_mut() {
        wall.force = Vec3::zeros();
        wall.torque = Vec3::zeros();
    }
    let mut start = 0;
    let mut feet: Vec<Option<ClosestPoint>> = Vec::new();
    let mut holds: Vec<bool> = Vec::new();
    while start < block.len() {
        let a = block.pair[start].a as usize;
        let end = start + block.pair[start..].iter().take_while(|pair| pair.a as usize == a).count();
        let centre = particles.position[a];
        let radius = particles.radius[a];
        feet.clear();
        feet.extend(block.pair[start..end].iter().map(|pair| {
            let (w, e) = elements[pair.b as usize];
            walls[w as usize].closest_point(e as usize, &centre)
        }));
        // Radius towards a wall, with what the particle widened.
        let with_surface_displacement =
            |normal: &Vec3| radius + context.surface_displacement.get(a).map_or(0.0, |w| w.0.quadratic(normal));
        let touching = |k: usize| {
            feet[k].filter(|closest_point| closest_point.distance < with_surface_displacement(&closest_point.normal))
        };
        // Which of them act.
        holds.clear();
        holds.extend((0..end - start).map(|k| {
            let Some(closest_point) = touching(k) else { return false };
            let w = elements[block.pair[start + k].b as usize].0;
            let point = closest_point.normal * closest_point.distance;
            closest_point.interior
                || !(0..end - start).any(|other| {
                    let (w_other, e) = elements[block.pair[start + other].b as usize];
                    other != k
                        && w_other == w
                        && touching(other).is_some_and(|o| {
                            // Is this edge point on the other triangle, too? Then that one's foot is nearer, or the
                            // same point.
                            let same = (o.normal * o.distance - point).norm() < SAME_POINT * radius;
                            if same {
                                o.interior || other < k
                            } else {
                                let x = centre + point;
                                walls[w as usize]
                                    .closest_point(e as usize, &x)
                                    .is_none_or(|f| f.distance.abs() < SAME_POINT * radius)
                            }
                        })
                })
        }));
        // Contacts that begin take over from one of the same surface that ends.
        for k in start..end {
            if let (true, Some(closest_point)) = (holds[k - start], feet[k - start])
                && !block.link[k].has(ContactFlags::ACTIVE)
            {
                begin(block, &elements, start, k, &closest_point.normal, &holds);
            }
        }
        for k in start..end {
            let w = elements[block.pair[k].b as usize].0;
            let Some(closest_point) = feet[k - start] else {
                forget(block, k);
                continue;
            };
            let opens = block.link[k].has(ContactFlags::ACTIVE)
                && closest_point.distance >= with_surface_displacement(&closest_point.normal);
            if !holds[k - start] && !opens {
                forget(block, k);
                continue;
            }
            let point = closest_point.normal * closest_point.distance;
            let motion = motion_of(particles, a);
            let mut geometry = ContactGeometry {
                reference_length: block.reference[k].length,
                area: block.reference[k].area,
                radius_a: radius,
                radius_b: 0.0,
                mass_a: particles.mass[a],
                mass_b: f64::INFINITY,
            };
            if !block.link[k].has(ContactFlags::ACTIVE) {
                block.link[k].flags |= ContactFlags::ACTIVE;
                block.reference[k] = L::unbonded_reference(radius, radius, 0.0);
                // Where it was one step ago follows from the velocities, so that candidates need no memory.
                let approach = (motion.velocity - walls[w as usize].velocity).dot(&closest_point.normal);
                block.frame[k] = PreviousGeometry {
                    normal: closest_point.normal,
                    length: closest_point.distance + approach * context.dt,
                };
                geometry.reference_length = block.reference[k].length;
                geometry.area = block.reference[k].area;
            }
            let velocity = walls[w as usize].velocity;
            let Some(mut kinematics) = L::Kinematics::measure_wall(
                context.mode,
                &motion,
                &closest_point,
                &velocity,
                &geometry,
                &block.frame[k],
                context.dt,
            ) else {
                continue;
            };
            if let Some(surface_displacement) = context.surface_displacement.get(a) {
                let before = context.surface_displacement_before(a).quadratic(&block.frame[k].normal);
                kinematics = kinematics
                    .with_surface_displacement(surface_displacement.0.quadratic(&closest_point.normal), before);
            }
            let response = block.rows[block.link[k].row as usize].respond(&kinematics, &block.history[k], context.dt);
            block.frame[k] = PreviousGeometry { normal: closest_point.normal, length: closest_point.distance };
            totals.energy += response.energy;
            match response.status {
                Status::Lives => block.history[k] = response.state,
                Status::Broke => totals.bond_events.push(BondEvent {
                    pair: block.pair[k],
                    broke: true,
                    damage: 1.0,
                    position: centre + point,
                    energy: response.energy.damage,
                    stored: [0.0; 4],
                }),
                Status::Opened => {}
            }
            if response.status != Status::Lives {
                forget(block, k);
                continue;
            }
            totals.active += 1;
            if context.sample {
                totals.force_squared += response.force.norm_squared();
            }
            force[a] += response.force;
            if let Some(sum) = virials.dyads.get_mut(a) {
                let viscous = L::viscous_force(&closest_point.normal, &response.state);
                let push =
                    ParticleVirial::of(&closest_point.normal, &response.force, &viscous, context.dashpots_strain);
                *sum += push.dyads();
                if particles.constraint[a].any(context.reacting) {
                    virials.held[a].add(&push);
                }
            }
            torque[a] += point.cross(&response.force);
            if L::TRANSMITS_MOMENT {
                torque[a] += response.moment;
            }
            if let Some(record) = record.as_deref_mut() {
                let moment = if L::TRANSMITS_MOMENT { response.moment } else { Vec3::zeros() };
                record.push(a as u32, w, centre + point, response.force, moment);
            }
            let wall = &mut walls[w as usize];
            wall.force -= response.force;
            wall.torque -= (centre + point - wall.displacement).cross(&response.force);
        }
        start = end;
    }
    totals
}

/// Let contact `k` go on with the history of the active contact of the same wall and row that ends in this step, if
/// there is one: that whose normal is nearest to `normal`. Contacts of the particle begin at `start`; `holds` tells
/// which act.
fn begin<L: ContactLaw>(
    block: &mut ContactBlock<L>,
    elements: &[(u32, u32)],
    start: usize,
    k: usize,
    normal: &Vec3,
    holds: &[bool],
) {
    let wall = |k: usize| elements[block.pair[k].b as usize].0;
    let mut best = None;
    let mut nearest = SAME_SURFACE;
    for (other, _) in (start..).zip(holds).filter(|(_, holds)| !**holds) {
        let cosine = block.frame[other].normal.dot(normal);
        if block.link[other].has(ContactFlags::ACTIVE)
            && wall(other) == wall(k)
            && block.link[other].row == block.link[k].row
            && cosine > nearest
        {
            (best, nearest) = (Some(other), cosine);
        }
    }
    if let Some(other) = best {
        block.link[k].flags |= ContactFlags::ACTIVE;
        block.reference[k] = block.reference[other];
        block.frame[k] = block.frame[other];
        block.history[k] = block.history[other];
        forget(block, other);
    }
}

fn forget<L: ContactLaw>(block: &mut ContactBlock<L>, k: usize) {
    block.link[k].flags &= !ContactFlags::ACTIVE;
    block.history[k] = L::State::default();
}
