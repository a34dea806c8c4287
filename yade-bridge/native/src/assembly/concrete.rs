//! Takes over concrete with its histories from the host.

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::law::cpm::{Cpm, CpmParameters, CpmState};
use concordem_contact::law::{LawState, Reference};
use concordem_contact::math::{Quat, Vec3, quaternion_of_rotation_vector};
use concordem_solver::integrate::Damping;
use concordem_solver::neighbor::spatial_order;
use concordem_solver::state::contacts::{ContactBlock, ContactFlags, Pair};
use concordem_solver::state::{Cell, Constraint, Particles, Sphere, State};
use concordem_solver::{Model, PairCoefficients};
use serde::{Deserialize, Serialize};

use super::{Assembly, Origin, same_length};

/// Columns of the host's bodies, in the host's order.
#[derive(Debug, Clone, Copy)]
pub struct Bodies<'a> {
    /// Ids in the host.
    pub id: &'a [u32],
    /// Centers, m.
    pub position: &'a [Vec3],
    /// Velocities, m/s.
    pub velocity: &'a [Vec3],
    /// Orientations, unit quaternions (x, y, z, w), body to world.
    pub orientation: &'a [f64],
    /// Angular velocities, rad/s.
    pub angular_velocity: &'a [Vec3],
    /// Radii, m.
    pub radius: &'a [f64],
    /// Masses, kg.
    pub mass: &'a [f64],
    /// Moments of inertia, kg m².
    pub inertia: &'a [f64],
    /// Index of the material.
    pub material: &'a [u32],
    /// Bit masks of prescribed degrees of freedom, see [`Constraint`].
    pub constraint: &'a [u32],
}

/// Columns of the host's concrete contacts with their histories.
#[derive(Debug, Clone, Copy)]
pub struct Contacts<'a> {
    /// Indices of the two bodies in [`Bodies`].
    pub pair: &'a [[u32; 2]],
    /// Periodic images of the second body.
    pub image: &'a [[i8; 3]],
    /// Whether the contact is a bond.
    pub bonded: &'a [bool],
    /// Reference lengths, m.
    pub length: &'a [f64],
    /// Areas, m².
    pub area: &'a [f64],
    /// Normals from the first body to the second, at the last step.
    pub normal: &'a [Vec3],
    /// Center distances at the last step, m.
    pub distance: &'a [f64],
    /// Histories ([`CpmState`]), contiguous.
    pub history: &'a [f64],
}

/// Parameters of the concrete law between two materials.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairParameters {
    /// First material.
    pub a: u16,
    /// Second material, `a ≤ b`.
    pub b: u16,
    /// Parameters of the law.
    pub parameters: CpmParameters,
}

impl Bodies<'_> {
    fn particles(&self) -> Result<Particles, String> {
        let n = self.position.len();
        for (name, found) in [
            ("radius", self.radius.len()),
            ("mass", self.mass.len()),
            ("inertia", self.inertia.len()),
            ("velocity", self.velocity.len()),
            ("angular_velocity", self.angular_velocity.len()),
            ("orientation", self.orientation.len() / 4),
            ("id", self.id.len()),
            ("material", self.material.len()),
            ("constraint", self.constraint.len()),
        ] {
            same_length(name, found, n)?;
        }
        let mut particles = Particles::default();
        for p in 0..n {
            let finite = [self.position[p], self.velocity[p], self.angular_velocity[p]]
                .iter()
                .all(|v| v.iter().all(|x| x.is_finite()));
            let (radius, mass, inertia) = (self.radius[p], self.mass[p], self.inertia[p]);
            if !(finite && radius > 0.0 && mass > 0.0 && inertia > 0.0) {
                return Err(format!(
                    "body {} has a position or velocity that is not finite, or a radius, mass, or inertia that is not positive",
                    self.id[p]
                ));
            }
            let material = u16::try_from(self.material[p])
                .map_err(|_| "the scene has more than 65535 materials, which is the maximum".to_owned())?;
            particles.push(Sphere { position: self.position[p], radius }, material, mass, inertia);
        }
        particles.id = self.id.to_vec();
        particles.velocity = self.velocity.to_vec();
        particles.angular_velocity = self.angular_velocity.to_vec();
        particles.orientation = self.orientation.chunks_exact(4).map(|q| Quat::new(q[3], q[0], q[1], q[2])).collect();
        particles.constraint = self.constraint.iter().map(|&mask| Constraint(mask as u8)).collect();
        Ok(particles)
    }
}

/// The laws, and the index of the law for each pair of `materials` materials.
fn laws_of(pairs: &[PairParameters], materials: usize) -> Result<(Vec<Cpm>, PairCoefficients), String> {
    let mut laws = Vec::new();
    let mut map = PairCoefficients::new(materials);
    for PairParameters { a, b, parameters } in pairs {
        let law = Cpm::new(parameters).map_err(|error| error.to_string())?;
        map.set(*a, *b, laws.len() as u16);
        map.set(*b, *a, laws.len() as u16);
        laws.push(law);
    }
    Ok((laws, map))
}

/// Reals per history.
const HISTORY: usize = size_of::<CpmState>() / 8;

impl Contacts<'_> {
    fn check_lengths(&self) -> Result<(), String> {
        let count = self.pair.len();
        for (name, found, wanted) in [
            ("image", self.image.len(), count),
            ("bonded", self.bonded.len(), count),
            ("length", self.length.len(), count),
            ("area", self.area.len(), count),
            ("normal", self.normal.len(), count),
            ("distance", self.distance.len(), count),
            ("history", self.history.len(), count * HISTORY),
        ] {
            same_length(name, found, wanted)?;
        }
        Ok(())
    }

    /// Append contact `k` to `block`. `place` maps the host's order of bodies to the order of `particles`.
    fn push(
        &self,
        k: usize,
        place: &[u32],
        particles: &Particles,
        coefficients: &PairCoefficients,
        block: &mut ContactBlock<Cpm>,
    ) -> Result<(), String> {
        let [one, two] = self.pair[k];
        let at = |p: u32| {
            place
                .get(p as usize)
                .copied()
                .ok_or_else(|| format!("contact {k} refers to body index {p}, but there are {} bodies", place.len()))
        };
        let (mut a, mut b) = (at(one)?, at(two)?);
        let row = coefficients
            .get(particles.material[a as usize], particles.material[b as usize])
            .ok_or_else(|| format!("there are no parameters for the materials of contact {k}"))?;
        let (mut normal, mut image) = (self.normal[k], self.image[k]);
        let history = &self.history[k * HISTORY..(k + 1) * HISTORY];
        let mut state: CpmState = bytemuck::pod_read_unaligned(bytemuck::cast_slice(history));
        let (length, area) = (self.length[k], self.area[k]);
        if !(length > 0.0
            && area > 0.0
            && normal.norm_squared() > 0.5
            && state.as_reals().iter().all(|x| x.is_finite()))
        {
            return Err(format!(
                "contact {k} of body indices {one} and {two} has no reference length or area, no normal, or a history that \
                 is not finite"
            ));
        }
        if a > b {
            std::mem::swap(&mut a, &mut b);
            normal = -normal;
            image = image.map(|i| -i);
            state = state.swapped();
        }
        let flags = ContactFlags::ACTIVE | if self.bonded[k] { ContactFlags::BONDED } else { 0 };
        let flags = ContactFlags { row, bits: flags, image, padding: 0 };
        let previous = PreviousGeometry { normal, length: self.distance[k] };
        block.push(Pair { a, b }, flags, Reference { length, area }, previous);
        if let Some(last) = block.history.last_mut() {
            *last = state;
        }
        Ok(())
    }
}

impl Assembly {
    /// Empty contact block and model of an assembly of concrete.
    pub(super) fn empty_concrete(origin: &Origin) -> Result<(ContactBlock<Cpm>, Model), String> {
        let Origin::Concrete { kinematics, materials, damping, gravity, pairs } = origin else {
            return Err("the assembly was not taken over from concrete".into());
        };
        let (laws, contact_rows) = laws_of(pairs, *materials)?;
        let damping =
            if *damping == 0.0 { Damping::None } else { Damping::Local { translation: *damping, rotation: *damping } };
        let gravity = Vec3::from(*gravity);
        let model = Model { mode: *kinematics, damping, gravity, contact_rows, ..Model::default() };
        Ok((ContactBlock::new(laws), model))
    }

    /// Spheres with bonds and contacts of the concrete law and their histories.
    ///
    /// # Errors
    /// Columns of different lengths, values that are not finite or not positive, contacts between materials without a law.
    pub fn concrete(
        bodies: &Bodies<'_>,
        contacts: &Contacts<'_>,
        origin: Origin,
        cell: Option<Cell>,
        dt: f64,
    ) -> Result<Self, String> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(format!("the time step is {dt} s, but must be positive; set O.dt"));
        }
        contacts.check_lengths()?;
        let unordered = bodies.particles()?;
        let order = spatial_order(&unordered.position, cell.as_ref());
        let mut place = vec![0_u32; order.len()];
        for (new, &old) in order.iter().enumerate() {
            place[old as usize] = new as u32;
        }
        let mut particles = unordered.permuted(&order);
        for (increment, angular_velocity) in particles.rotation_increment.iter_mut().zip(&particles.angular_velocity) {
            *increment = quaternion_of_rotation_vector(&(angular_velocity * dt));
        }
        let (mut bonds, model) = Self::empty_concrete(&origin)?;
        let mut unbonded = bonds.clone();
        for k in 0..contacts.pair.len() {
            let block = if contacts.bonded[k] { &mut bonds } else { &mut unbonded };
            contacts.push(k, &place, &particles, &model.contact_rows, block)?;
        }
        bonds.sort();
        unbonded.sort();
        let mut state = State { particles, cell, bonds: vec![Box::new(bonds)], ..State::default() };
        state.contacts = Some(Box::new(unbonded));
        state.clock.dt = dt;
        Self::new(state, model, origin)
    }
}
