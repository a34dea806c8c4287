//! Forces of all contacts at the present positions, as input of operators.
//!
//! Laws are pure functions, so the response of the next step is known without the step: this module measures and
//! evaluates every contact as the step does and discards the new histories. Same inputs, same bits. After a step, before
//! the particles move, the forces of that step follow from the histories.

use concordem_contact::kinematics::deformable::ParticleVirials;
use concordem_contact::kinematics::{ImageShift, Motion};
use concordem_contact::law::{ContactLaw, Kinematics, Response, Status, TemperatureFactors};
use concordem_contact::math::{Quat, Vec3};
use concordem_contact::step::{Contact, Ends, How, step};
use concordem_contact::wrench::Wrench;

use super::{LawLoops, ParticleSums, StepContext};
use crate::evaluation::recorded::ContactForce;
pub(super) use crate::evaluation::recorded::WallForce;
pub use crate::evaluation::recorded::{ContactForces, ContactRecord, Forces, WallForces};
use crate::state::Wall;
use crate::state::contacts::{ContactBlock, ContactFlags, Pair};

/// Force and damage of contact `k` at the present positions.
pub fn contact_record<L: ContactLaw>(block: &ContactBlock<L>, k: usize, context: &StepContext<'_>) -> ContactRecord {
    if context.evaluated {
        return last_record(block, k, context);
    }
    let (pair, mut flags) = (block.pair[k], block.flags[k]);
    let (mut reference, mut previous) = (block.reference.get(k), block.previous.get(k));
    if flags.has(ContactFlags::BROKEN) {
        return ContactRecord { force: None, damage: [1.0; 2] };
    }
    let image = context.cell.map_or_else(ImageShift::default, |cell| ImageShift::of(cell, flags.image, context.mode));
    let motions = context.motions(pair);
    let ends = context.ends(pair, &motions, &image, !context.surface_displacement.is_empty());
    if !flags.has(ContactFlags::ACTIVE)
        && !ends.begin::<L>(&mut flags, &mut reference, &mut previous, context.mode, context.dt)
    {
        return ContactRecord::default();
    }
    let (law, history) = (&block.rows[flags.row as usize], block.history.get(k));
    let contact = Contact { bonded: flags.has(ContactFlags::BONDED), reference, previous, history };
    let factors = factors_of(context, pair, &contact);
    let stepped = step(law, &contact, &ends, &How { measure: context.mode, dt: context.dt, factors });
    let Response { force, moment, status, state, .. } = stepped.response;
    match status {
        Status::Broke | Status::BrokeInShear => return ContactRecord { force: None, damage: [1.0; 2] },
        Status::Opened => return ContactRecord::default(),
        Status::Lives => {}
    }
    let point = stepped.point();
    let force = ContactForce {
        pair: [pair.a, pair.b],
        branch: ends.branch(),
        point: motions[0].position + point.normal * point.to_contact_point(),
        force,
        moment: if L::TRANSMITS_MOMENT { moment } else { Vec3::zeros() },
        place: k as u32,
    };
    ContactRecord { force: Some(force), damage: [L::damage(&state), law.lost_strength(reference, &state)] }
}

/// Factors on the stiffness and strength of a contact, if it has any.
fn factors_of<S>(context: &StepContext<'_>, pair: Pair, contact: &Contact<S>) -> Option<TemperatureFactors> {
    let factors = context.factors?;
    let area = contact.reference.area;
    let strengths = factors.strengths.filter(|_| contact.bonded);
    let strength = strengths.map_or(1.0, |strengths| strengths.of_bond(context.particles, pair, area));
    Some(factors.of(pair, strength))
}

/// Force and damage of contact `k` in the step that has just been evaluated.
fn last_record<L: ContactLaw>(block: &ContactBlock<L>, k: usize, context: &StepContext<'_>) -> ContactRecord {
    let (pair, flags, previous) = (block.pair[k], block.flags[k], block.previous.get(k));
    if flags.has(ContactFlags::BROKEN) {
        return ContactRecord { force: None, damage: [1.0; 2] };
    }
    if !flags.has(ContactFlags::ACTIVE) {
        return ContactRecord::default();
    }
    let mut motions = context.motions(pair).map(|motion| Motion {
        velocity: Vec3::zeros(),
        angular_velocity: Vec3::zeros(),
        rotation_increment: Quat::identity(),
        ..motion
    });
    let mut image = context.cell.map_or_else(ImageShift::default, |cell| ImageShift {
        velocity: Vec3::zeros(),
        ..ImageShift::of(cell, flags.image, context.mode)
    });
    let contact = Contact {
        bonded: flags.has(ContactFlags::BONDED),
        reference: block.reference.get(k),
        previous,
        history: block.history.get(k),
    };
    // The strains of the step are stored as those of one step ago.
    let surface_displacement = context.deformable.map(|_| {
        let [a, b] = [pair.a, pair.b].map(|p| context.surface_displacement_before(p as usize));
        [a + b; 2]
    });
    let measure = |motions: &[Motion; 2], image: &ImageShift| {
        let ends = Ends { surface_displacement, ..context.ends(pair, motions, image, false) };
        let kinematics: L::Kinematics = ends.measure(&contact, context.mode, context.dt);
        (kinematics, ends.branch())
    };
    let (mut kinematics, mut branch) = measure(&motions, &image);
    if kinematics.point().length != previous.length {
        // The particles have moved since: a state that a host's own step evaluated. Put B where it was, seen from A.
        motions[1].position = motions[0].position + previous.normal * previous.length;
        image.displacement = Vec3::zeros();
        (kinematics, branch) = measure(&motions, &image);
    }
    let (law, history) = (&block.rows[flags.row as usize], &contact.history);
    let (force, moment) = match factors_of(context, pair, &contact) {
        Some(factors) => law.at_temperature(&factors).last_force(&kinematics, &L::history_at(history, &factors)),
        None => law.last_force(&kinematics, history),
    };
    let point = kinematics.point();
    let force = ContactForce {
        pair: [pair.a, pair.b],
        branch,
        point: motions[0].position + point.normal * point.to_contact_point(),
        force,
        moment: if L::TRANSMITS_MOMENT { moment } else { Vec3::zeros() },
        place: k as u32,
    };
    ContactRecord { force: Some(force), damage: [L::damage(history), law.lost_strength(contact.reference, history)] }
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
