//! Forces of all contacts at the present positions, as input of operators.
//!
//! Laws are pure functions, so the response of the next step is known without the step: this module measures and
//! evaluates every contact as the step does and discards the new histories. Same inputs, same bits. After a step, before
//! the particles move, the forces of that step follow from the histories.

use concordem_contact::activate::{activate, length_of};
use concordem_contact::kinematics::deformable::ParticleVirials;
use concordem_contact::kinematics::{ContactInput, ImageShift, Motion};
use concordem_contact::law::{ContactGeometry, ContactLaw, Kinematics, Response, Status};
use concordem_contact::math::{Quat, Vec3};
use concordem_contact::wrench::Wrench;

use super::{LawLoops, ParticleSums, StepContext, motion_of};
use crate::evaluation::recorded::ContactForce;
pub(super) use crate::evaluation::recorded::WallForce;
pub use crate::evaluation::recorded::{ContactForces, ContactRecord, Forces, WallForces};
use crate::state::Wall;
use crate::state::contacts::{ContactBlock, ContactFlags};

/// Force and damage of contact `k` at the present positions.
pub fn contact_record<L: ContactLaw>(block: &ContactBlock<L>, k: usize, context: &StepContext<'_>) -> ContactRecord {
    if context.evaluated {
        return last_record(block, k, context);
    }
    let particles = context.particles;
    let (pair, mut flags) = (block.pair[k], block.flags[k]);
    let (mut reference, mut previous) = (block.reference.get(k), block.previous.get(k));
    if flags.has(ContactFlags::BROKEN) {
        return ContactRecord { force: None, damage: [1.0; 2] };
    }
    let (a, b) = (pair.a as usize, pair.b as usize);
    let image = context.cell.map_or_else(ImageShift::default, |cell| ImageShift::of(cell, flags.image, context.mode));
    let (motion_a, motion_b) = (motion_of(particles, a), motion_of(particles, b));
    let branch = motion_b.position + image.displacement - motion_a.position;
    if !flags.has(ContactFlags::ACTIVE) {
        let before = branch - (motion_b.velocity + image.velocity - motion_a.velocity) * context.dt;
        let (radius_a, radius_b) = (particles.radius[a], particles.radius[b]);
        let surface_displacement = if context.surface_displacement.is_empty() {
            0.0
        } else {
            let normal = branch.normalize();
            context.surface_approach(a, b, &normal, &normal).0
        };
        let (flags, reference, previous) = (&mut flags, &mut reference, &mut previous);
        if !activate::<L>(
            flags,
            reference,
            previous,
            length_of(&branch, context.mode),
            &before,
            [radius_a, radius_b],
            surface_displacement,
        ) {
            return ContactRecord::default();
        }
    }
    let geometry = ContactGeometry {
        reference_length: reference.length,
        area: reference.area,
        ..block.geometry(k, particles, false)
    };
    let input = ContactInput {
        a: &motion_a,
        b: &motion_b,
        image: &image,
        geometry: &geometry,
        previous: &previous,
        bonded: flags.has(ContactFlags::BONDED),
        dt: context.dt,
    };
    let mut kinematics = L::Kinematics::measure(context.mode, &input);
    if !context.surface_displacement.is_empty() {
        let normal = kinematics.point().normal;
        let (now, before) = context.surface_approach(a, b, &normal, &previous.normal);
        kinematics = kinematics.with_surface_displacement(now, before);
    }
    let (law, history) = (&block.rows[flags.row as usize], &block.history.get(k));
    let Response { force, moment, status, state, .. } = match &context.softening {
        Some(softened) => law.respond_at(&softened.of(pair.a, pair.b), &kinematics, history, context.dt),
        None => law.respond(&kinematics, history, context.dt),
    };
    match status {
        Status::Broke => return ContactRecord { force: None, damage: [1.0; 2] },
        Status::Opened => return ContactRecord::default(),
        Status::Lives => {}
    }
    let point = kinematics.point();
    let force = ContactForce {
        pair: [pair.a, pair.b],
        branch,
        point: motion_a.position + point.normal * point.arm_a,
        force,
        moment: if L::TRANSMITS_MOMENT { moment } else { Vec3::zeros() },
        place: k as u32,
    };
    ContactRecord { force: Some(force), damage: [L::damage(&state), law.lost_strength(&state)] }
}

/// Force and damage of contact `k` in the step that has just been evaluated.
fn last_record<L: ContactLaw>(block: &ContactBlock<L>, k: usize, context: &StepContext<'_>) -> ContactRecord {
    let particles = context.particles;
    let (pair, flags, previous) = (block.pair[k], block.flags[k], block.previous.get(k));
    if flags.has(ContactFlags::BROKEN) {
        return ContactRecord { force: None, damage: [1.0; 2] };
    }
    if !flags.has(ContactFlags::ACTIVE) {
        return ContactRecord::default();
    }
    let (a, b) = (pair.a as usize, pair.b as usize);
    let still = |p: usize| Motion {
        velocity: Vec3::zeros(),
        angular_velocity: Vec3::zeros(),
        rotation_increment: Quat::identity(),
        ..motion_of(particles, p)
    };
    let (motion_a, mut motion_b) = (still(a), still(b));
    let mut image = context.cell.map_or_else(ImageShift::default, |cell| ImageShift {
        velocity: Vec3::zeros(),
        ..ImageShift::of(cell, flags.image, context.mode)
    });
    let geometry = block.geometry(k, particles, false);
    let measure = |a: &Motion, b: &Motion, image: &ImageShift| {
        let bonded = flags.has(ContactFlags::BONDED);
        let input = ContactInput { a, b, image, geometry: &geometry, previous: &previous, bonded, dt: context.dt };
        L::Kinematics::measure(context.mode, &input)
    };
    let mut kinematics = measure(&motion_a, &motion_b, &image);
    if kinematics.point().length != previous.length {
        // The particles have moved since: a state that a host's own step evaluated. Put B where it was, seen from A.
        motion_b.position = motion_a.position + previous.normal * previous.length;
        image.displacement = Vec3::zeros();
        kinematics = measure(&motion_a, &motion_b, &image);
    }
    if context.deformable.is_some() {
        // The strains of the step are stored as those of one step ago.
        let normal = kinematics.point().normal;
        let sum = context.surface_displacement_before(a) + context.surface_displacement_before(b);
        let approach = sum.quadratic(&normal);
        kinematics = kinematics.with_surface_displacement(approach, approach);
    }
    let (law, history) = (&block.rows[flags.row as usize], &block.history.get(k));
    let (force, moment) = match &context.softening {
        Some(softened) => {
            let factors = softened.of(pair.a, pair.b);
            law.at_temperature(&factors).last_force(&kinematics, &L::history_at(history, &factors))
        }
        None => law.last_force(&kinematics, history),
    };
    let point = kinematics.point();
    let force = ContactForce {
        pair: [pair.a, pair.b],
        branch: motion_b.position + image.displacement - motion_a.position,
        point: motion_a.position + point.normal * point.arm_a,
        force,
        moment: if L::TRANSMITS_MOMENT { moment } else { Vec3::zeros() },
        place: k as u32,
    };
    ContactRecord { force: Some(force), damage: [L::damage(history), law.lost_strength(history)] }
}

/// Append the forces of walls on particles.
pub(super) fn record_walls<L: LawLoops>(
    block: &ContactBlock<L>,
    context: &StepContext<'_>,
    walls: &[Wall],
    out: &mut WallForces,
) {
    // The evaluation decides which points of a surface act and which contact inherits which history. It changes
    // contacts and walls, so it works on copies.
    let (mut block, mut walls) = (block.clone(), walls.to_vec());
    let mut net = vec![Wrench::default(); context.particles.len()];
    let sums = ParticleSums { net: &mut net, virials: ParticleVirials::default() };
    L::evaluate_walls(&mut block, context, &mut walls, sums, Some(out));
    out.vertices = walls.iter().map(|wall| wall.mesh().map_or_else(Vec::new, |mesh| mesh.force.clone())).collect();
}
