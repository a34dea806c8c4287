//! Contacts and loads as operator input: borrowed slices from any owner.

use super::error::{OperatorError, check_finite, check_length};
use concordem_contact::math::Vec3;

/// Contacts between particles, one row each, seen from A (conventions in the [crate documentation](crate)).
///
/// Nothing is copied: the solver, a host program, and Python arrays can all lend their memory. [`vectors`] turns a flat
/// slice of reals into one of vectors.
#[derive(Debug, Clone, Copy)]
pub struct ContactSet<'a> {
    position: &'a [Vec3],
    pair: &'a [[u32; 2]],
    branch: &'a [Vec3],
    point: &'a [Vec3],
    force: &'a [Vec3],
    moment: Option<&'a [Vec3]>,
}

/// One contact.
#[derive(Debug, Clone, Copy)]
pub struct Contact {
    /// Particle A.
    pub a: usize,
    /// Particle B.
    pub b: usize,
    /// Center of A, m.
    pub position_a: Vec3,
    /// Branch vector `l = x_B − x_A`, image of B included, m.
    pub branch: Vec3,
    /// From the center of A to the contact point, m.
    pub arm_a: Vec3,
    /// From the center of B to the contact point, m.
    pub arm_b: Vec3,
    /// Force on A, N.
    pub force: Vec3,
    /// Moment on A about the contact point, N·m.
    pub moment: Vec3,
}

impl<'a> ContactSet<'a> {
    /// Contacts of the particles at `position` (m): `pair` names A and B; `branch` is the branch vector `l` (m),
    /// `point` the contact point next to A (m), `force` the force on A (N), `moment` the moment on A about the contact
    /// point (N·m; `None` if contacts transmit none).
    ///
    /// # Errors
    /// Slices of different lengths, a particle that does not exist, numbers that are not finite: no region contains a point that is
    /// not a number, and sums would leave it out.
    pub fn new(
        position: &'a [Vec3],
        pair: &'a [[u32; 2]],
        branch: &'a [Vec3],
        point: &'a [Vec3],
        force: &'a [Vec3],
        moment: Option<&'a [Vec3]>,
    ) -> Result<Self, OperatorError> {
        let count = pair.len();
        check_length("branch", branch.len(), count, "contact")?;
        check_length("point", point.len(), count, "contact")?;
        check_length("force", force.len(), count, "contact")?;
        if let Some(moment) = moment {
            check_length("moment", moment.len(), count, "contact")?;
        }
        let n = position.len();
        if let Some(entry) = pair.iter().position(|p| p[0] as usize >= n || p[1] as usize >= n) {
            let index = pair[entry].into_iter().find(|&p| p as usize >= n).unwrap_or_default();
            return Err(OperatorError::Index { name: "pair", entry, index, count: n });
        }
        for (name, values) in [("position", position), ("branch", branch), ("point", point), ("force", force)] {
            check_finite(name, values)?;
        }
        check_finite("moment", moment.unwrap_or_default())?;
        Ok(Self { position, pair, branch, point, force, moment })
    }

    /// Number of contacts.
    pub fn len(&self) -> usize {
        self.pair.len()
    }

    /// Whether there are no contacts.
    pub fn is_empty(&self) -> bool {
        self.pair.is_empty()
    }

    /// Centers of the particles, m.
    pub fn position(&self) -> &'a [Vec3] {
        self.position
    }

    /// Particles A and B of each contact.
    pub fn pair(&self) -> &'a [[u32; 2]] {
        self.pair
    }

    /// Branch vector of each contact, m.
    pub fn branch(&self) -> &'a [Vec3] {
        self.branch
    }

    /// Force on A of each contact, N.
    pub fn force(&self) -> &'a [Vec3] {
        self.force
    }

    /// Whether contacts transmit moments.
    pub fn transmits_moment(&self) -> bool {
        self.moment.is_some()
    }

    /// A part of the contacts, between the same particles.
    #[inline(always)]
    pub(super) fn part(&self, range: std::ops::Range<usize>) -> Self {
        Self {
            position: self.position,
            pair: &self.pair[range.clone()],
            branch: &self.branch[range.clone()],
            point: &self.point[range.clone()],
            force: &self.force[range.clone()],
            moment: self.moment.map(|moment| &moment[range]),
        }
    }

    /// Contact `k`.
    #[inline]
    pub fn get(&self, k: usize) -> Contact {
        let [a, b] = self.pair[k].map(|p| p as usize);
        let position_a = self.position[a];
        let branch = self.branch[k];
        let arm_a = self.point[k] - position_a;
        Contact {
            a,
            b,
            position_a,
            branch,
            arm_a,
            arm_b: arm_a - branch,
            force: self.force[k],
            moment: self.moment.map_or_else(Vec3::zeros, |m| m[k]),
        }
    }

    /// Half of the way from the image of B that A reaches to B itself, m; zero up to rounding unless the contact crosses the
    /// border of a periodic cell. Moved by it, a contact lies in the middle of its two places, one with A and one with B where
    /// they are listed: sums over positions then do not depend on which particle is called A.
    pub fn between_images(&self, contact: &Contact) -> Vec3 {
        (self.position[contact.b] - (contact.position_a + contact.branch)) * 0.5
    }
}

/// External loads on particles: walls, supports, gravity. Force and moment act on the particle.
#[derive(Debug, Clone, Copy)]
pub struct LoadSet<'a> {
    particle: &'a [u32],
    point: &'a [Vec3],
    force: &'a [Vec3],
    moment: Option<&'a [Vec3]>,
}

impl<'a> LoadSet<'a> {
    /// Loads on `count` particles: `point` of action (m), `force` (N), `moment` about the point (N·m).
    ///
    /// # Errors
    /// Slices of different lengths, a particle that does not exist, numbers that are not finite.
    pub fn new(
        count: usize,
        particle: &'a [u32],
        point: &'a [Vec3],
        force: &'a [Vec3],
        moment: Option<&'a [Vec3]>,
    ) -> Result<Self, OperatorError> {
        check_length("point", point.len(), particle.len(), "load")?;
        check_length("force", force.len(), particle.len(), "load")?;
        if let Some(moment) = moment {
            check_length("moment", moment.len(), particle.len(), "load")?;
        }
        if let Some(entry) = particle.iter().position(|&p| p as usize >= count) {
            return Err(OperatorError::Index { name: "particle", entry, index: particle[entry], count });
        }
        for (name, values) in [("point", point), ("force", force), ("moment", moment.unwrap_or_default())] {
            check_finite(name, values)?;
        }
        Ok(Self { particle, point, force, moment })
    }

    /// No loads.
    pub fn none() -> Self {
        Self { particle: &[], point: &[], force: &[], moment: None }
    }

    /// Number of loads.
    pub fn len(&self) -> usize {
        self.particle.len()
    }

    /// Whether there are no loads.
    pub fn is_empty(&self) -> bool {
        self.particle.is_empty()
    }

    /// Load `k`: particle, point (m), force (N), moment about the point (N·m).
    #[inline]
    pub fn get(&self, k: usize) -> (usize, Vec3, Vec3, Vec3) {
        let moment = self.moment.map_or_else(Vec3::zeros, |m| m[k]);
        (self.particle[k] as usize, self.point[k], self.force[k], moment)
    }
}

/// Rows of three reals as vectors, without a copy.
pub fn vectors<'a>(name: &'static str, reals: &'a [f64]) -> Result<&'a [Vec3], OperatorError> {
    if !reals.len().is_multiple_of(3) {
        return Err(OperatorError::Ragged { name, found: reals.len(), components: 3 });
    }
    Ok(bytemuck::cast_slice(reals))
}

/// Rows of two indices as pairs, without a copy.
pub fn pairs<'a>(name: &'static str, indices: &'a [u32]) -> Result<&'a [[u32; 2]], OperatorError> {
    if !indices.len().is_multiple_of(2) {
        return Err(OperatorError::Ragged { name, found: indices.len(), components: 2 });
    }
    Ok(bytemuck::cast_slice(indices))
}

/// Moment of a beam about a contact point, so that the beam becomes a contact like any other.
///
/// Given force `F_A` (N) and moment `M_A` (N·m) on the end at the center of A, the moment on A about `c` is
/// `m_A = M_A − (c − x_A)×F_A`; equilibrium of the beam makes that of B `−m_A`. Region operators do not depend on the
/// choice of `c`, those of single particles do; the middle of the beam is usual. (ERDC TR-14-6 Report 3, (45) with true
/// arms.)
#[inline]
pub fn moment_about_contact_point(arm_a: &Vec3, force_a: &Vec3, moment_at_center: &Vec3) -> Vec3 {
    moment_at_center - arm_a.cross(force_a)
}
