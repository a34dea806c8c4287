//! Forces of all contacts at the present positions, as input of operators.
//!
//! Laws are pure functions, so the response of the next step is known without the step: this module measures and
//! evaluates every contact as the step does and discards the new histories. Same inputs, same bits. After a step, before
//! the particles move, the forces of that step follow from the histories.

use concordem_contact::kinematics::deformable::ParticleVirials;
use concordem_contact::kinematics::{ImageShift, Motion};
use concordem_contact::law::{ContactLaw, Kinematics, Response, Status};
use concordem_contact::math::{Quat, Vec3};
use concordem_contact::step::{Contact, Ends, How, step};
use concordem_contact::wrench::Wrench;
use concordem_operator::{ContactSet, LoadSet, OperatorError};

use super::{LawLoops, ParticleSums, StepContext};
use crate::state::contacts::{ContactBlock, ContactFlags};
use crate::state::{Particles, Wall};

/// Forces of contacts between particles, one row per contact with a force.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ContactForces {
    /// Particles A and B, by index.
    pub pair: Vec<[u32; 2]>,
    /// Branch vector `x_B + image − x_A`, m.
    pub branch: Vec<Vec3>,
    /// Contact point at the end of A's arm, m.
    pub point: Vec<Vec3>,
    /// Force on A, N.
    pub force: Vec<Vec3>,
    /// Moment on A about the contact point, N·m.
    pub moment: Vec<Vec3>,
    /// Index of the contact in its block.
    pub place: Vec<u32>,
    /// End of the rows of each block: bonds by law, then unbonded contacts.
    pub block_end: Vec<usize>,
    /// Damage and lost strength of all contacts at the present positions, including those without force: block after
    /// block, in the order of their contacts.
    pub damage: Vec<[f64; 2]>,
}

impl ContactForces {
    /// The contacts as operator input.
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

    /// Make room for `count` more contacts, and no more.
    pub(super) fn reserve(&mut self, count: usize) {
        self.pair.reserve_exact(count);
        self.branch.reserve_exact(count);
        self.point.reserve_exact(count);
        self.force.reserve_exact(count);
        self.moment.reserve_exact(count);
        self.place.reserve_exact(count);
        self.damage.reserve_exact(count);
    }

    /// Append contacts of a block.
    pub(super) fn extend(&mut self, contacts: &[ContactRecord]) {
        self.damage.extend(contacts.iter().map(|contact| contact.damage));
        for row in contacts.iter().filter_map(|contact| contact.force.as_ref()) {
            self.pair.push(row.pair);
            self.branch.push(row.branch);
            self.point.push(row.point);
            self.force.push(row.force);
            self.moment.push(row.moment);
            self.place.push(row.place);
        }
    }

    /// End the rows of a block.
    pub(super) fn end_block(&mut self) {
        self.block_end.push(self.pair.len());
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
    /// Forces of the particles on the vertices of each wall that is a mesh, N, by wall; empty for other walls.
    pub vertices: Vec<Vec<Vec3>>,
}

impl WallForces {
    /// The loads as operator input.
    pub fn set<'a>(&'a self, particles: &Particles) -> Result<LoadSet<'a>, OperatorError> {
        LoadSet::new(particles.len(), &self.particle, &self.point, &self.force, Some(&self.moment))
    }

    pub(super) fn push(&mut self, row: &WallForce) {
        self.particle.push(row.particle);
        self.wall.push(row.wall);
        self.point.push(row.point);
        self.force.push(row.force);
        self.moment.push(row.moment);
    }
}

/// One row of [`WallForces`].
pub(super) struct WallForce {
    pub particle: u32,
    pub wall: u32,
    pub point: Vec3,
    pub force: Vec3,
    pub moment: Vec3,
}

/// All contact forces of a state.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Forces {
    /// Between particles.
    pub contacts: ContactForces,
    /// Between particles and walls.
    pub walls: WallForces,
}

/// One contact at the present positions.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactRecord {
    /// Its force; `None` if it has none.
    force: Option<ContactForce>,
    /// Damage and lost strength; 1 if the contact breaks.
    damage: [f64; 2],
}

/// One row of [`ContactForces`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactForce {
    pair: [u32; 2],
    branch: Vec3,
    point: Vec3,
    force: Vec3,
    moment: Vec3,
    place: u32,
}

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
    let factors = context.softening.map(|softened| softened.of(pair.a, pair.b));
    let stepped = step(law, &contact, &ends, &How { measure: context.mode, dt: context.dt, factors });
    let Response { force, moment, status, state, .. } = stepped.response;
    match status {
        Status::Broke => return ContactRecord { force: None, damage: [1.0; 2] },
        Status::Opened => return ContactRecord::default(),
        Status::Lives => {}
    }
    let point = stepped.point();
    let force = ContactForce {
        pair: [pair.a, pair.b],
        branch: ends.branch(),
        point: motions[0].position + point.normal * point.arm_a,
        force,
        moment: if L::TRANSMITS_MOMENT { moment } else { Vec3::zeros() },
        place: k as u32,
    };
    ContactRecord { force: Some(force), damage: [L::damage(&state), law.lost_strength(&state)] }
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
        branch,
        point: motions[0].position + point.normal * point.arm_a,
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
