//! Takes over YADE's cohesive and frictional spheres (`CohFrictMat`) with the histories of their contacts.
//!
//! In YADE a contact that loses its cohesion stays the same contact, with its shear force. So all contacts are in the block of unbonded ones, and
//! their histories tell which have cohesion.

mod law;
#[cfg(test)]
mod tests;

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::law::{ContactLaw as _, LawState as _};
use concordem_contact::math::Vec3;
use concordem_solver::state::Cell;
use concordem_solver::state::contacts::{ContactBlock, ContactFlags, Pair};
use concordem_solver::{Model, PairCoefficients};

use super::concrete::{Bodies, HostClump, refuse_in_clump};
use super::{Assembly, Origin, same_length};

pub use law::{CohesiveFriction, CohesiveFrictionState, HISTORY, Material, Rules, Version};

/// Columns of the host's contacts.
#[derive(Debug, Clone, Copy)]
pub struct Contacts<'a> {
    /// Indices of the two bodies in [`Bodies`].
    pub pair: &'a [[u32; 2]],
    /// Periodic images of the second body.
    pub image: &'a [[i8; 3]],
    /// Normals from the first body to the second, at the last step.
    pub normal: &'a [Vec3],
    /// Center distances at the last step, m.
    pub distance: &'a [f64],
    /// Histories ([`CohesiveFrictionState`]), contiguous.
    pub history: &'a [f64],
}

impl Assembly {
    /// Empty contact block and model of an assembly of cohesive and frictional spheres.
    pub(super) fn empty_cohesive(origin: &Origin) -> Result<(ContactBlock<CohesiveFriction>, Model), String> {
        let Origin::Cohesive { kinematics, materials, rules } = origin else {
            return Err("the assembly was not taken over from cohesive and frictional spheres".into());
        };
        let count = materials.len();
        // An index of a row is below `PairCoefficients::NONE`.
        if count * count > PairCoefficients::NONE as usize {
            return Err(format!("the scene has {count} materials, but 255 is the maximum; share them between bodies"));
        }
        let mut contact_rows = PairCoefficients::new(count);
        let mut laws = Vec::with_capacity(count * count);
        for (a, one) in materials.iter().enumerate() {
            for (b, two) in materials.iter().enumerate() {
                contact_rows.set(a as u16, b as u16, laws.len() as u16);
                laws.push(CohesiveFriction { materials: [*one, *two], rules: *rules });
            }
        }
        Ok((ContactBlock::new(laws), Model { mode: *kinematics, contact_rows, ..Model::default() }))
    }

    /// Spheres with contacts and their histories. Members of a clump do not interact with each other.
    ///
    /// # Errors
    /// Columns of different lengths, values that are not finite or not positive, members that are not at their place in the clump or interact with
    /// each other.
    pub fn cohesive(
        bodies: &Bodies<'_>,
        contacts: &Contacts<'_>,
        clumps: &[HostClump],
        origin: Origin,
        cell: Option<Cell>,
        dt: f64,
    ) -> Result<Self, String> {
        let count = contacts.pair.len();
        for (name, found, wanted) in [
            ("image", contacts.image.len(), count),
            ("normal", contacts.normal.len(), count),
            ("distance", contacts.distance.len(), count),
            ("history", contacts.history.len(), count * HISTORY),
        ] {
            same_length(name, found, wanted)?;
        }
        let (mut block, model) = Self::empty_cohesive(&origin)?;
        let (mut state, place) = bodies.placed(clumps, cell.as_ref(), dt)?;
        let particles = &state.particles;
        for k in 0..count {
            let [one, two] = contacts.pair[k];
            let at = |p: u32| {
                let refused = || format!("contact {k} refers to body index {p}, but there are {} bodies", place.len());
                place.get(p as usize).copied().ok_or_else(refused)
            };
            let (mut a, mut b) = (at(one)?, at(two)?);
            refuse_in_clump(particles, a as usize, b as usize)?;
            let (mut normal, mut image) = (contacts.normal[k], contacts.image[k]);
            let history = &contacts.history[k * HISTORY..(k + 1) * HISTORY];
            let mut own: CohesiveFrictionState = bytemuck::pod_read_unaligned(bytemuck::cast_slice(history));
            if !(law::is_valid(&own) && normal.norm_squared() > 0.5 && contacts.distance[k] > 0.0) {
                let [a, b] = [a, b].map(|p| particles.id[p as usize]);
                return Err(format!(
                    "the contact of bodies {a} and {b} has no stiffness, no normal, or a history that is not finite; take one step (O.step()) before"
                ));
            }
            if a > b {
                std::mem::swap(&mut a, &mut b);
                normal = -normal;
                image = image.map(|i| -i);
                own = own.swapped();
            }
            let [one, two] = [a, b].map(|p| p as usize);
            let row = model.contact_rows.get(particles.material[one], particles.material[two]);
            let row = row.ok_or_else(|| format!("there is no material for a body of contact {k}"))?;
            let flags = ContactFlags { row, bits: ContactFlags::ACTIVE, image, padding: 0 };
            let [one, two] = [one, two].map(|p| particles.radius[p]);
            let reference = CohesiveFriction::unbonded_reference(contacts.distance[k], one, two);
            block.push(Pair { a, b }, flags, reference, PreviousGeometry { normal, length: contacts.distance[k] });
            block.history.set(block.len() - 1, own);
        }
        block.sort();
        state.contacts = Some(Box::new(block));
        Self::new(state, model, origin)
    }

    /// Number of bonds: of cohesive and frictional spheres, the contacts with cohesion.
    pub fn bond_count(&self) -> usize {
        let block = self
            .state
            .contacts
            .as_ref()
            .and_then(|contacts| contacts.contacts().as_any().downcast_ref::<ContactBlock<CohesiveFriction>>());
        let Some(block) = block else { return self.state.bond_count() };
        (0..block.len()).filter(|&k| block.flags[k].carries() && block.history.get(k).cohesive != 0.0).count()
    }
}
