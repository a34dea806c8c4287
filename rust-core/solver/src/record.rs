//! The forces of all contacts at the present positions, as operators read them.
//!
//! Laws are pure functions, so the answer that the next step will get can be had without taking the step: the recording
//! measures and asks every contact like the step does, and throws the new histories away. Same inputs, same bits.

use rayon::prelude::*;

use super::forces::{StepContext, activate};
use super::walls;
use crate::state::contacts::{ContactBlock, ContactFlags};
use crate::state::{Particles, Wall};
use concordem_contact::kinematics::deformable::ParticleVirials;
use concordem_contact::kinematics::sphere_sphere::ImageShift;
use concordem_contact::law::{ContactGeometry, ContactLaw, Kinematics, Response, Status};
use concordem_contact::math::Vec3;
use concordem_operator::{ContactSet, LoadSet, OperatorError};

/// Forces of contacts between particles, one row per contact that carries something.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ContactForces {
    /// Particles A and B, by index.
    pub pair: Vec<[u32; 2]>,
    /// Branch `x_B + image − x_A`, m.
    pub branch: Vec<Vec3>,
    /// Contact point next to A, m.
    pub point: Vec<Vec3>,
    /// Force on A, N.
    pub force: Vec<Vec3>,
    /// Moment on A about the contact point, N·m.
    pub moment: Vec<Vec3>,
    /// Place of the contact in its block.
    pub place: Vec<u32>,
    /// Where the rows of each block end: bonds by law, then unbonded contacts.
    pub block_end: Vec<usize>,
}

impl ContactForces {
    /// The contacts as operators take them.
    pub fn set<'a>(&'a self, particles: &'a Particles) -> Result<ContactSet<'a>, OperatorError> {
        let moments = self.moment.iter().any(|m| *m != Vec3::zeros());
        ContactSet::new(
            &particles.position,
            &self.pair,
            &self.branch,
            &self.point,
            &self.force,
            moments.then_some(&self.moment[..]),
        )
    }

    fn push(&mut self, row: &Row) {
        self.pair.push(row.pair);
        self.branch.push(row.branch);
        self.point.push(row.point);
        self.force.push(row.force);
        self.moment.push(row.moment);
        self.place.push(row.place);
    }
}

/// Forces of walls on particles.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct WallForces {
    /// Particle, by index.
    pub particle: Vec<u32>,
    /// Wall, by index.
    pub wall: Vec<u32>,
    /// Contact point, m.
    pub point: Vec<Vec3>,
    /// Force on the particle, N.
    pub force: Vec<Vec3>,
    /// Moment on the particle about the contact point, N·m.
    pub moment: Vec<Vec3>,
}

impl WallForces {
    /// The loads as operators take them.
    pub fn set<'a>(&'a self, particles: &Particles) -> Result<LoadSet<'a>, OperatorError> {
        LoadSet::new(particles.len(), &self.particle, &self.point, &self.force, Some(&self.moment))
    }

    pub(super) fn push(&mut self, particle: u32, wall: u32, point: Vec3, force: Vec3, moment: Vec3) {
        self.particle.push(particle);
        self.wall.push(wall);
        self.point.push(point);
        self.force.push(force);
        self.moment.push(moment);
    }
}

/// All forces of a state.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Forces {
    /// Between particles.
    pub contacts: ContactForces,
    /// Of walls.
    pub walls: WallForces,
}

struct Row {
    pair: [u32; 2],
    branch: Vec3,
    point: Vec3,
    force: Vec3,
    moment: Vec3,
    place: u32,
}

/// Record the contacts of a block.
pub(super) fn record<L: ContactLaw>(block: &ContactBlock<L>, context: &StepContext<'_>, out: &mut ContactForces) {
    let rows: Vec<Option<Row>> = (0..block.len()).into_par_iter().map(|k| row(block, k, context)).collect();
    rows.iter().flatten().for_each(|row| out.push(row));
    out.block_end.push(out.pair.len());
}

fn row<L: ContactLaw>(block: &ContactBlock<L>, k: usize, context: &StepContext<'_>) -> Option<Row> {
    let particles = context.particles;
    let (pair, mut link, mut reference, mut frame) = (block.pair[k], block.link[k], block.reference[k], block.frame[k]);
    if link.has(ContactFlags::BROKEN) {
        return None;
    }
    let (a, b) = (pair.a as usize, pair.b as usize);
    let image = context.cell.map_or_else(ImageShift::default, |cell| ImageShift::of(cell, link.image, context.mode));
    let (motion_a, motion_b) = (super::forces::motion_of(particles, a), super::forces::motion_of(particles, b));
    let branch = motion_b.position + image.displacement - motion_a.position;
    if !link.has(ContactFlags::ACTIVE) {
        let before = branch - (motion_b.velocity + image.velocity - motion_a.velocity) * context.dt;
        let (radius_a, radius_b) = (particles.radius[a], particles.radius[b]);
        let surface_displacement = if context.surface_displacement.is_empty() {
            0.0
        } else {
            let normal = branch.normalize();
            context.surface_approach(a, b, &normal, &normal).0
        };
        let (link, reference, frame) = (&mut link, &mut reference, &mut frame);
        if !activate::<L>(link, reference, frame, &branch, &before, [radius_a, radius_b], surface_displacement) {
            return None;
        }
    }
    let geometry = ContactGeometry {
        reference_length: reference.length,
        area: reference.area,
        ..block.geometry(k, particles, false)
    };
    let mut kinematics = L::Kinematics::measure(
        context.mode,
        &motion_a,
        &motion_b,
        &image,
        &geometry,
        &frame,
        link.has(ContactFlags::BONDED),
        context.dt,
    );
    if !context.surface_displacement.is_empty() {
        let normal = kinematics.point().normal;
        let (now, before) = context.surface_approach(a, b, &normal, &frame.normal);
        kinematics = kinematics.with_surface_displacement(now, before);
    }
    let Response { force, moment, status, .. } =
        block.rows[link.row as usize].respond(&kinematics, &block.history[k], context.dt);
    let point = kinematics.point();
    (status == Status::Lives).then(|| Row {
        pair: [pair.a, pair.b],
        branch,
        point: motion_a.position + point.normal * point.arm_a,
        force,
        moment: if L::TRANSMITS_MOMENT { moment } else { Vec3::zeros() },
        place: k as u32,
    })
}

/// Record the contacts of a block with walls.
pub(super) fn record_walls<L: ContactLaw>(
    block: &ContactBlock<L>,
    context: &StepContext<'_>,
    walls: &[Wall],
    out: &mut WallForces,
) {
    // Which points of a surface act, and which contact goes on for which, is decided along with the forces: on copies.
    let (mut block, mut walls) = (block.clone(), walls.to_vec());
    let n = context.particles.len();
    let (mut force, mut torque) = (vec![Vec3::zeros(); n], vec![Vec3::zeros(); n]);
    walls::evaluate(
        &mut block,
        context,
        &mut walls,
        &mut force,
        &mut torque,
        &mut ParticleVirials::default(),
        Some(out),
    );
}
