//! Takes over contacts whose histories have all that the host keeps of them: stiffnesses, strengths, forces, flags.
//!
//! In YADE a contact that loses its cohesion stays the same contact, with its shear force. So all contacts are in the block of unbonded ones, and
//! their histories tell which have cohesion.

use concordem_contact::kinematics::{MotionMeasure, PreviousGeometry};
use concordem_contact::law::LawState as _;
use concordem_contact::math::Vec3;
use concordem_solver::evaluation::EvaluatedContacts;
use concordem_solver::state::contacts::{ContactBlock, ContactFlags, Pair};
use concordem_solver::state::{Cell, State};
use concordem_solver::{Model, PairCoefficients};

use super::cohesive::CohesiveFriction;
use super::concrete::{Bodies, HostClump, refuse_in_clump};
use super::host_law::HostLaw;
use super::jointed::JointedFriction;
use super::{Assembly, Origin, same_length};

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
    /// Histories of the law, contiguous.
    pub history: &'a [f64],
}

/// Empty contact block and model of an assembly under a law of the host.
fn empty<L: HostLaw>(
    kinematics: MotionMeasure,
    materials: &[L::Material],
    rules: L::Rules,
) -> Result<(ContactBlock<L>, Model), String> {
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
            laws.push(L::of([*one, *two], rules));
        }
    }
    Ok((ContactBlock::new(laws), Model { mode: kinematics, contact_rows, ..Model::default() }))
}

impl Contacts<'_> {
    fn check_lengths(&self, width: usize) -> Result<(), String> {
        let count = self.pair.len();
        for (name, found, wanted) in [
            ("image", self.image.len(), count),
            ("normal", self.normal.len(), count),
            ("distance", self.distance.len(), count),
            ("history", self.history.len(), count * width),
        ] {
            same_length(name, found, wanted)?;
        }
        Ok(())
    }

    /// Add the contacts to a block. `place`: of each body among the particles.
    fn fill<L: HostLaw>(
        &self,
        block: &mut ContactBlock<L>,
        model: &Model,
        state: &State,
        place: &[u32],
    ) -> Result<(), String> {
        let width = size_of::<L::State>() / 8;
        self.check_lengths(width)?;
        let particles = &state.particles;
        for k in 0..self.pair.len() {
            let [one, two] = self.pair[k];
            let at = |p: u32| {
                let refused = || format!("contact {k} refers to body index {p}, but there are {} bodies", place.len());
                place.get(p as usize).copied().ok_or_else(refused)
            };
            let (mut a, mut b) = (at(one)?, at(two)?);
            refuse_in_clump(particles, a as usize, b as usize)?;
            let (mut normal, mut image) = (self.normal[k], self.image[k]);
            let history = &self.history[k * width..(k + 1) * width];
            let mut own: L::State = bytemuck::pod_read_unaligned(bytemuck::cast_slice(history));
            if !(L::is_valid(&own) && normal.norm_squared() > 0.5 && self.distance[k] > 0.0) {
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
            let reference = L::unbonded_reference(self.distance[k], one, two);
            block.push(Pair { a, b }, flags, reference, PreviousGeometry { normal, length: self.distance[k] });
            block.history.set(block.len() - 1, own);
        }
        block.sort();
        Ok(())
    }
}

/// The block of the law of an origin, with these contacts of bodies at these places of a state, and the model.
fn block_of(
    origin: &Origin,
    contacts: &Contacts<'_>,
    state: &State,
    place: &[u32],
) -> Result<(Box<dyn EvaluatedContacts>, Model), String> {
    fn of<L: HostLaw>(
        (mut block, model): (ContactBlock<L>, Model),
        contacts: &Contacts<'_>,
        state: &State,
        place: &[u32],
    ) -> Result<(Box<dyn EvaluatedContacts>, Model), String> {
        contacts.fill(&mut block, &model, state, place)?;
        Ok((Box::new(block), model))
    }
    match origin {
        Origin::Cohesive { kinematics, materials, rules } => {
            of(empty::<CohesiveFriction>(*kinematics, materials, *rules)?, contacts, state, place)
        }
        Origin::Jointed { kinematics, materials, rules } => {
            of(empty::<JointedFriction>(*kinematics, materials, *rules)?, contacts, state, place)
        }
        _ => Err("the assembly was not taken over with the histories of its contacts".into()),
    }
}

/// Number of contacts with cohesion, if the block is of this law.
fn bonds_in<L: HostLaw>(block: &dyn EvaluatedContacts) -> Option<usize> {
    let block = block.contacts().as_any().downcast_ref::<ContactBlock<L>>()?;
    Some((0..block.len()).filter(|&k| block.flags[k].carries() && L::is_bond(&block.history.get(k))).count())
}

impl Assembly {
    /// Empty state of the right kinds and model of an assembly with the histories of its contacts.
    pub(super) fn empty_with_histories(origin: &Origin) -> Result<(State, Model), String> {
        let none = Contacts { pair: &[], image: &[], normal: &[], distance: &[], history: &[] };
        let (block, model) = block_of(origin, &none, &State::default(), &[])?;
        Ok((State { contacts: Some(block), ..State::default() }, model))
    }

    /// Spheres with contacts and their histories. Members of a clump do not interact with each other.
    ///
    /// # Errors
    /// Columns of different lengths, values that are not finite or not positive, members that are not at their place in the clump or interact with
    /// each other.
    pub fn with_histories(
        bodies: &Bodies<'_>,
        contacts: &Contacts<'_>,
        clumps: &[HostClump],
        origin: Origin,
        cell: Option<Cell>,
        dt: f64,
    ) -> Result<Self, String> {
        let (mut state, place) = bodies.placed(clumps, cell.as_ref(), dt)?;
        let (block, model) = block_of(&origin, contacts, &state, &place)?;
        state.contacts = Some(block);
        Self::new(state, model, origin)
    }

    /// Number of bonds: of contacts with histories, those with cohesion.
    pub fn bond_count(&self) -> usize {
        let of_host = self
            .state
            .contacts
            .as_deref()
            .and_then(|block| bonds_in::<CohesiveFriction>(block).or_else(|| bonds_in::<JointedFriction>(block)));
        of_host.unwrap_or_else(|| self.state.bond_count())
    }
}
