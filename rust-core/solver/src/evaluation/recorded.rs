//! Forces of contacts, as operators read them.

use concordem_contact::math::Vec3;
use concordem_operator::{ContactSet, LoadSet, OperatorError};

use crate::state::particles::Particles;

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
    pub(crate) fn reserve(&mut self, count: usize) {
        self.pair.reserve_exact(count);
        self.branch.reserve_exact(count);
        self.point.reserve_exact(count);
        self.force.reserve_exact(count);
        self.moment.reserve_exact(count);
        self.place.reserve_exact(count);
        self.damage.reserve_exact(count);
    }

    /// Append contacts of a block.
    pub(crate) fn extend(&mut self, contacts: &[ContactRecord]) {
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
    pub(crate) fn end_block(&mut self) {
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

    pub(crate) fn push(&mut self, row: &WallForce) {
        self.particle.push(row.particle);
        self.wall.push(row.wall);
        self.point.push(row.point);
        self.force.push(row.force);
        self.moment.push(row.moment);
    }
}

/// One row of [`WallForces`].
pub(crate) struct WallForce {
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
    pub(crate) force: Option<ContactForce>,
    /// Damage and lost strength; 1 if the contact breaks.
    pub(crate) damage: [f64; 2],
}

/// One row of [`ContactForces`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactForce {
    pub(crate) pair: [u32; 2],
    pub(crate) branch: Vec3,
    pub(crate) point: Vec3,
    pub(crate) force: Vec3,
    pub(crate) moment: Vec3,
    pub(crate) place: u32,
}
