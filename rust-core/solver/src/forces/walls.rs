//! Forces between particles and walls.
//!
//! A particle near a surface of triangles can have several closest points. A point inside a face always acts. A point
//! on an edge or corner acts only if it is a closest point of the surface as a whole: no other triangle that contains
//! it has a closer one. If it is the closest point of several triangles, only one of them acts. So a flat or convex
//! surface acts once, not once per triangle. In a fold of a [`Mesh`](crate::state::Mesh), `WallEvaluator::faces`
//! decides. When the closest point moves from one triangle to the next, the new
//! contact inherits the history of the old one.

use std::ops::Range;

use concordem_contact::kinematics::deformable::ParticleVirial;
use concordem_contact::kinematics::{Motion, PreviousGeometry};
use concordem_contact::law::{ContactLaw, Response, Status};
use concordem_contact::math::{Quat, Vec3, quaternion_of_rotation_vector};
use concordem_contact::step::{AtWall, Contact, How, Stepped, WallMotion, step_at_wall};
use concordem_contact::wall::ClosestPoint;

use super::commit::log_heat;
use super::record::{WallForce, WallForces};
use super::{BegunContact, BondEvent, ParticleSums, StepContext, Totals, motion_of};
use crate::state::Wall;
use crate::state::contacts::{ContactBlock, ContactFlags, Pair};

/// Two points of a surface are the same point if they are closer together than this fraction of the particle's radius.
const SAME_POINT: f64 = 1e-6;

/// Cosine of the largest rotation of the normal in one step for a contact to inherit history from a neighboring
/// triangle.
const SAME_SURFACE: f64 = 0.5;

/// Cosine of the angle, 0.2 rad, between two faces of a mesh below which a particle that comes to both at once touches only the nearer one.
///
/// Else the force on a nearly flat surface would be the double, where the particle comes down within `½Rε` of an edge of the angle ε.
const NEARLY_FLAT: f64 = 0.980_066_577_841_241_6;

/// Largest error of a distance by rounding, as a fraction of the particle's radius.
const ROUNDING: f64 = 1e-9;

/// Wall and element for every element number.
pub fn element_table(walls: &[Wall]) -> Vec<(u32, u32)> {
    walls
        .iter()
        .enumerate()
        .flat_map(|(w, wall)| (0..wall.element_count()).map(move |e| (w as u32, e as u32)))
        .collect()
}

/// See [`EvaluatedContacts::evaluate_walls`](super::EvaluatedContacts::evaluate_walls). Forces are also appended to
/// `record`, if there is one.
pub fn evaluate<L: ContactLaw>(
    block: &mut ContactBlock<L>,
    context: &StepContext<'_>,
    walls: &mut [Wall],
    mut sums: ParticleSums<'_>,
    mut record: Option<&mut WallForces>,
) -> Totals {
    for wall in walls.iter_mut() {
        wall.force = Vec3::zeros();
        wall.torque = Vec3::zeros();
        wall.pressing = 0.0;
        if let Some(mesh) = wall.mesh_mut() {
            mesh.force.fill(Vec3::zeros());
        }
    }
    let mut evaluator = WallEvaluator {
        context,
        elements: element_table(walls),
        particle: 0,
        contacts: 0..0,
        closest_points: Vec::new(),
        acts: Vec::new(),
        totals: Totals::default(),
    };
    let mut start = 0;
    while start < block.len() {
        let particle = block.pair[start].a as usize;
        let end = start + block.pair[start..].iter().take_while(|pair| pair.a as usize == particle).count();
        evaluator.particle = particle;
        evaluator.contacts = start..end;
        evaluator.select(block, walls);
        evaluator.inherit(block);
        for k in start..end {
            let Some(action) = evaluator.contact(block, walls, k) else { continue };
            evaluator.accumulate::<L>(&action, &mut sums, &mut walls[action.force.wall as usize]);
            if let Some(record) = record.as_deref_mut() {
                record.push(&action.force);
            }
        }
        start = end;
    }
    evaluator.totals
}

/// Evaluates the contacts of one particle with walls at a time.
struct WallEvaluator<'a> {
    context: &'a StepContext<'a>,
    /// Wall and element for every element number.
    elements: Vec<(u32, u32)>,
    /// The particle.
    particle: usize,
    /// Its contacts in the block.
    contacts: Range<usize>,
    /// Closest point of each of these contacts.
    closest_points: Vec<Option<ClosestPoint>>,
    /// Whether each of these contacts acts.
    acts: Vec<bool>,
    totals: Totals,
}

/// Force and virial of a wall contact on its particle.
struct WallAction {
    force: WallForce,
    /// Triangle and weights of the contact point, if the wall is a mesh.
    place: Option<(usize, [f64; 3])>,
    /// Vector from the particle's center to the contact point, m.
    arm: Vec3,
    /// Unit vector from the particle to the wall.
    normal: Vec3,
    /// Image of the wall.
    image: [i8; 3],
    /// Contribution to the particle virial, if the particle deforms.
    virial: ParticleVirial,
}

/// Motion of a wall at a contact point in the last step.
struct Surface {
    /// Triangle and weights of the point, if the wall is a mesh.
    place: Option<(usize, [f64; 3])>,
    /// Velocity, m/s.
    velocity: Vec3,
    /// Rotation.
    rotation: Quat,
}

impl WallEvaluator<'_> {
    /// Radius of the particle plus its surface displacement along this normal, m.
    fn extent(&self, normal: &Vec3) -> f64 {
        let radius = self.context.particles.radius[self.particle];
        radius + self.context.surface_displacement.get(self.particle).map_or(0.0, |w| w.0.quadratic(normal))
    }

    /// Closest point of the particle's contact number `i`, if the particle touches the wall there.
    fn touching(&self, i: usize) -> Option<ClosestPoint> {
        self.closest_points[i].filter(|closest_point| closest_point.distance < self.extent(&closest_point.normal))
    }

    /// Find the closest points of the particle's contacts, and which of them act.
    fn select<L: ContactLaw>(&mut self, block: &ContactBlock<L>, walls: &[Wall]) {
        let center = self.context.particles.position[self.particle];
        let radius = self.context.particles.radius[self.particle];
        self.closest_points.clear();
        let cell = self.context.cell;
        for k in self.contacts.clone() {
            let (w, e) = self.elements[block.pair[k].b as usize];
            let image = block.flags[k].image;
            self.closest_points.push(walls[w as usize].closest_point_of_image(e as usize, &center, cell, image));
        }
        let mut acts = std::mem::take(&mut self.acts);
        let element = |i: usize| self.elements[block.pair[self.contacts.start + i].b as usize];
        // Whether contact `other` replaces contact `i` at the edge point `point` (from the center).
        let supersedes = |other: usize, i: usize, point: &Vec3| {
            let (w, _) = element(i);
            let (w_other, e_other) = element(other);
            other != i
                && w_other == w
                // Also where the particle does not touch it: one that deforms may bulge towards the edge alone.
                && self.closest_points[other].is_some_and(|o| {
                    if (o.normal * o.distance - point).norm() < SAME_POINT * radius {
                        o.interior || other < i
                    } else {
                        // If the edge point also lies on the other triangle, that triangle has a closer point.
                        let image = block.flags[self.contacts.start + other].image;
                        walls[w as usize]
                            .closest_point_of_image(e_other as usize, &(center + point), cell, image)
                            .is_none_or(|found| found.distance.abs() < SAME_POINT * radius)
                    }
                })
        };
        let count = self.contacts.len();
        let in_mesh = |i: usize| walls[element(i).0 as usize].mesh().is_some();
        let meshes = (0..count).any(in_mesh);
        let faces = if meshes { self.faces(block, walls) } else { Vec::new() };
        let active = |i: usize| block.flags[self.contacts.start + i].has(ContactFlags::ACTIVE);
        acts.clear();
        acts.extend((0..count).map(|i| {
            let Some(closest_point) = self.touching(i) else { return false };
            let point = closest_point.normal * closest_point.distance;
            if closest_point.interior {
                return !in_mesh(i) || faces[i];
            }
            // In a fold, a contact that has left its face acts on, at the edge, until it opens; else its force would jump to zero.
            let beside = |other: usize| {
                in_mesh(i) && active(i) && active(other) && self.touching(other).is_some_and(|o| o.interior)
            };
            !(0..count).any(|other| supersedes(other, i, &point) && !beside(other))
        }));
        self.acts = acts;
    }

    /// Which of the particle's contacts inside faces of meshes act.
    ///
    /// A contact that begins without overlap, as that with the second face of a deep fold, acts beside others. One that is there with an
    /// overlap at once is an old one that came over a concave edge: it stays silent while another face is nearer, and then takes over from
    /// the contact whose normal is closest. So the size of the force does not jump, and neither does the energy that the contact stores.
    fn faces<L: ContactLaw>(&self, block: &ContactBlock<L>, walls: &[Wall]) -> Vec<bool> {
        let start = self.contacts.start;
        let points: Vec<Option<ClosestPoint>> =
            (0..self.contacts.len()).map(|i| self.touching(i).filter(|point| point.interior)).collect();
        let wall = |i: usize| self.elements[block.pair[start + i].b as usize].0;
        // Cosine between the normals of two contacts with one mesh.
        let cosine = |i: usize, j: usize| match (points[i], points[j]) {
            (Some(a), Some(b)) if i != j && wall(i) == wall(j) => a.normal.dot(&b.normal),
            _ => -1.0,
        };
        let first = |i: usize, j: usize| {
            let distance = |i: usize| points[i].map_or(f64::INFINITY, |point| point.distance);
            distance(i) < distance(j) || (distance(i) == distance(j) && i < j)
        };
        let all = 0..points.len();
        let active = |i: usize| points[i].is_some() && block.flags[start + i].has(ContactFlags::ACTIVE);
        // Whether it did not touch one step ago.
        let begins = |i: usize, point: &ClosestPoint| {
            let (pair, image) = (block.pair[start + i], block.flags[start + i].image);
            let surface = self.surface(&walls[wall(i) as usize], pair.b, image);
            let velocity = self.context.particles.velocity[self.particle] - surface.velocity;
            let extent = self.extent(&point.normal);
            point.distance + velocity.dot(&point.normal) * self.context.dt >= extent * (1.0 - ROUNDING)
        };
        let own: Vec<bool> = all
            .clone()
            .map(|i| {
                let Some(point) = points[i] else { return false };
                let beside = |j: usize| cosine(i, j) > NEARLY_FLAT && (active(j) || first(j, i));
                active(i) || begins(i, &point) && !all.clone().any(beside)
            })
            .collect();
        let follows = |i: usize| {
            points[i].is_some() && !own[i] && !all.clone().any(|j| cosine(i, j) > SAME_SURFACE && first(j, i))
        };
        // The contact from which contact `j` takes over.
        let source = |j: usize| {
            let candidates = all.clone().filter(|&i| own[i] && cosine(i, j) > SAME_SURFACE);
            candidates.reduce(|best, i| if cosine(i, j) > cosine(best, j) { i } else { best })
        };
        let taken: Vec<usize> = all.clone().filter(|&j| follows(j)).filter_map(source).collect();
        all.clone().map(|i| follows(i) || (own[i] && !taken.contains(&i))).collect()
    }

    /// Let new contacts inherit from a contact with the same surface that ends.
    fn inherit<L: ContactLaw>(&self, block: &mut ContactBlock<L>) {
        for (i, k) in self.contacts.clone().enumerate() {
            if let (true, Some(closest_point)) = (self.acts[i], self.closest_points[i])
                && !block.flags[k].has(ContactFlags::ACTIVE)
                && let Some(other) = self.predecessor(block, k, &closest_point.normal)
            {
                block.flags[k].bits |= ContactFlags::ACTIVE;
                block.reference.set(k, block.reference.get(other));
                block.previous.set(k, block.previous.get(other));
                block.history.set(k, block.history.get(other));
                deactivate(block, other);
            }
        }
    }

    /// The active contact with the same wall and pair coefficients as contact `k` that ends in this step and whose
    /// normal is closest to `normal`, if there is one.
    fn predecessor<L: ContactLaw>(&self, block: &ContactBlock<L>, k: usize, normal: &Vec3) -> Option<usize> {
        let wall = |k: usize| self.elements[block.pair[k].b as usize].0;
        let mut best = None;
        let mut nearest = SAME_SURFACE;
        for (other, _) in self.contacts.clone().zip(&self.acts).filter(|(_, acts)| !**acts) {
            let cosine = block.previous.get(other).normal.dot(normal);
            if block.flags[other].has(ContactFlags::ACTIVE)
                && wall(other) == wall(k)
                && block.flags[other].row == block.flags[k].row
                && cosine > nearest
            {
                (best, nearest) = (Some(other), cosine);
            }
        }
        best
    }

    /// Evaluate contact `k`; `None` if it has no force.
    fn contact<L: ContactLaw>(&mut self, block: &mut ContactBlock<L>, walls: &[Wall], k: usize) -> Option<WallAction> {
        let i = k - self.contacts.start;
        let wall = self.elements[block.pair[k].b as usize].0;
        let acting = if self.acts[i] { self.closest_points[i].map(|point| (k, point)) } else { self.opening(block, k) };
        let Some((at, closest_point)) = acting else {
            deactivate(block, k);
            return None;
        };
        let begins = !block.flags[k].has(ContactFlags::ACTIVE);
        let surface = self.surface(&walls[wall as usize], block.pair[at].b, block.flags[at].image);
        let Stepped { response, .. } = self.step(block, k, &closest_point, &walls[wall as usize], &surface)?;
        if L::STIFFENS && begins {
            let ContactFlags { row, image, .. } = block.flags[k];
            self.totals.begun.push(BegunContact { pair: block.pair[k], image, row });
        }
        let context = self.context;
        block.previous.set(k, PreviousGeometry { normal: closest_point.normal, length: closest_point.distance });
        self.totals.energy += response.energy;
        if context.heats {
            // The wall takes up nothing.
            let particle = self.particle as u32;
            log_heat(&mut self.totals.dissipated, Pair { a: particle, b: particle }, response.energy.dissipated());
        }
        let arm = closest_point.normal * closest_point.distance;
        let point = context.particles.position[self.particle] + arm;
        if response.status != Status::Lives {
            if response.status.is_broken() {
                self.totals.bond_events.push(BondEvent {
                    pair: block.pair[k],
                    broke: true,
                    fails: true,
                    in_shear: response.status == Status::BrokeInShear,
                    damage: 1.0,
                    position: point,
                    energy: response.energy.damage,
                    stored: [0.0; 4],
                });
            }
            deactivate(block, k);
            return None;
        }
        let Response { force, moment, state, .. } = response;
        block.history.set(k, state);
        let viscous = L::viscous_force(&closest_point.normal, &state);
        let virial = ParticleVirial::of(&closest_point.normal, &force, &viscous, context.dashpots_strain);
        let moment = if L::TRANSMITS_MOMENT { moment } else { Vec3::zeros() };
        let force = WallForce { particle: self.particle as u32, wall, point, force, moment };
        let (place, normal, image) = (surface.place, closest_point.normal, block.flags[k].image);
        Some(WallAction { force, place, arm, normal, image, virial })
    }

    /// Motion of the wall where it is closest to the particle, on the element `element` of its image `image`.
    fn surface(&self, wall: &Wall, element: u32, image: [i8; 3]) -> Surface {
        let Some(mesh) = wall.mesh() else {
            return Surface { place: None, velocity: wall.velocity, rotation: Quat::identity() };
        };
        let context = self.context;
        let shift = context.cell.map_or_else(Vec3::zeros, |cell| cell.shift(image));
        let triangle = self.elements[element as usize].1 as usize;
        let weights = mesh.weights(triangle, &(context.particles.position[self.particle] - shift));
        Surface {
            place: Some((triangle, weights)),
            velocity: mesh.velocity_at(triangle, &weights),
            rotation: mesh.rotation(triangle, context.dt),
        }
    }

    /// Closest point at which contact `k` opens in this step, and the contact that has it; `None` if it does not open. The particle may
    /// have passed to another triangle of the surface in the same step.
    fn opening<L: ContactLaw>(&self, block: &ContactBlock<L>, k: usize) -> Option<(usize, ClosestPoint)> {
        let own = self.closest_points[k - self.contacts.start]?;
        if !block.flags[k].has(ContactFlags::ACTIVE) || own.distance < self.extent(&own.normal) {
            return None;
        }
        let wall = |k: usize| self.elements[block.pair[k].b as usize].0;
        let others = self.contacts.clone().zip(&self.closest_points).filter(|(other, _)| wall(*other) == wall(k));
        // A face that the particle still touches, as the other one of a fold, has a contact of its own.
        let same_surface = |point: &ClosestPoint| {
            block.previous.get(k).normal.dot(&point.normal) > SAME_SURFACE
                && point.distance >= self.extent(&point.normal)
        };
        let points = others.filter_map(|(other, point)| Some((other, point.filter(same_surface)?)));
        Some(points.fold(
            (k, own),
            |nearest, point| {
                if point.1.distance < nearest.1.distance { point } else { nearest }
            },
        ))
    }

    /// Step contact `k`, activating it if it begins; `None` if the law has no contacts with walls.
    fn step<L: ContactLaw>(
        &self,
        block: &mut ContactBlock<L>,
        k: usize,
        closest_point: &ClosestPoint,
        wall: &Wall,
        surface: &Surface,
    ) -> Option<Stepped<L>> {
        let (context, a) = (self.context, self.particle);
        let radius = context.particles.radius[a];
        let motion: Motion = motion_of(context.particles, a);
        if !block.flags[k].has(ContactFlags::ACTIVE) {
            block.flags[k].bits |= ContactFlags::ACTIVE;
            block.reference.set(k, L::unbonded_reference(radius, radius, 0.0));
            // The velocities give the distance one step ago, so candidates need not store it.
            let approach = (motion.velocity - surface.velocity).dot(&closest_point.normal);
            let length = closest_point.distance + approach * context.dt;
            block.previous.set(k, PreviousGeometry { normal: closest_point.normal, length });
        }
        let previous = block.previous.get(k);
        // Halfway between the contact points at the start and the end of the step, so that the slip is work-conjugate, under the
        // trapezoidal rule, to the moment on a turning wall.
        let turned = wall.turning.map(|_| {
            let start = motion.position - motion.velocity * context.dt + previous.normal * previous.length;
            let end = motion.position + closest_point.normal * closest_point.distance;
            let moved = wall.velocity * (0.5 * context.dt);
            let (velocity, angular_velocity) = wall.motion_at(&((start + end) * 0.5 + moved));
            (velocity, quaternion_of_rotation_vector(&(angular_velocity * context.dt)))
        });
        let (wall_velocity, wall_rotation) = turned.unwrap_or((surface.velocity, surface.rotation));
        let sides = AtWall {
            motion: WallMotion { particle: &motion, closest_point, velocity: wall_velocity, rotation: wall_rotation },
            radius,
            mass: context.particles.mass[a],
            surface_displacement: context
                .surface_displacement
                .get(a)
                .map(|now| [now.0, context.surface_displacement_before(a)]),
        };
        let (reference, history) = (block.reference.get(k), block.history.get(k));
        let contact = Contact { bonded: false, reference, previous, history };
        let law = &block.rows[block.flags[k].row as usize];
        step_at_wall(law, &contact, &sides, &How::new(context.mode, context.dt))
    }

    /// Add a contact to the totals, to its particle, and to its wall.
    fn accumulate<L: ContactLaw>(&mut self, action: &WallAction, sums: &mut ParticleSums<'_>, wall: &mut Wall) {
        let a = self.particle;
        let WallAction { force: WallForce { force, moment, point, .. }, place, arm, normal, image, virial } = action;
        self.totals.active += 1;
        if self.context.sample {
            self.totals.force_squared += force.norm_squared();
            if L::TRANSMITS_MOMENT {
                self.totals.moment_squared += moment.norm_squared();
            }
        }
        sums.net[a].force += force;
        if let Some(sum) = sums.virials.virials.get_mut(a) {
            *sum += virial.parts();
            if self.context.particles.constraint[a].any(self.context.reacting) {
                sums.virials.reaction_sums[a].add(virial);
            }
        }
        sums.net[a].torque += arm.cross(force);
        if L::TRANSMITS_MOMENT {
            sums.net[a].torque += moment;
        }
        wall.force -= force;
        wall.pressing -= force.dot(normal);
        // The point lies on an image of the wall; move it back to the wall itself.
        let shift = self.context.cell.map_or_else(Vec3::zeros, |cell| cell.shift(*image));
        wall.torque -= (point - shift - wall.displacement).cross(force);
        if let (Some((triangle, weights)), Some(mesh)) = (place, wall.mesh_mut()) {
            mesh.add_force(*triangle, weights, &-force, L::TRANSMITS_MOMENT.then_some(&-moment));
        }
        if L::TRANSMITS_MOMENT {
            wall.torque -= moment;
        }
    }
}

/// Deactivate contact `k` and clear its history.
fn deactivate<L: ContactLaw>(block: &mut ContactBlock<L>, k: usize) {
    block.flags[k].bits &= !ContactFlags::ACTIVE;
    block.history.set(k, L::State::default());
}
