//! Takes over concrete with its histories from the host.

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::law::cpm::{Cpm, CpmParameters, CpmState, DamageLaw};
use concordem_contact::law::{LawState, Reference};
use concordem_contact::math::{Quat, Vec3, quaternion_of_rotation_vector, rotate};
use concordem_solver::integrate::Damping;
use concordem_solver::neighbor::spatial_order;
use concordem_solver::state::contacts::{ContactBlock, ContactFlags, Pair};
use concordem_solver::state::{Cell, Clump, Constraint, Particles, Sphere, State};
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
    /// Number of bonds and contacts that each body has already lost in the host (`CpmState::numBrokenCohesive`).
    pub lost: &'a [u32],
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
    /// Sums of the two radii that the contacts store (`refR1 + refR2`), m.
    pub radii: &'a [f64],
    /// Overlaps at the reference lengths (`refPD`), m.
    pub reference_overlap: &'a [f64],
    /// Parameters that the contacts store, contiguous: [`STORED`].
    pub stored: &'a [f64],
    /// For each contact, 0 for the parameters of its materials, or one more than the place of its own in [`Origin::Concrete`]. Empty: none has
    /// its own.
    pub own: &'a [u32],
}

/// Parameters in [`Contacts::stored`], named as in YADE's `CpmPhys`. YADE sets them once, and scripts can change them.
/// Flags and numbers of laws are reals here.
pub const STORED: [&str; 10] = [
    "E",
    "G",
    "tanFrictionAngle",
    "undamagedCohesion",
    "epsCrackOnset",
    "epsFracture",
    "equivStrainShearContrib",
    "isoPrestress",
    "damLaw",
    "neverDamage",
];

/// The values of [`STORED`] between two materials.
fn stored_of(parameters: &CpmParameters) -> [f64; STORED.len()] {
    [
        parameters.young,
        parameters.young * parameters.shear_ratio,
        parameters.friction_coefficient,
        parameters.cohesion,
        parameters.crack_onset_strain,
        parameters.crack_onset_strain * parameters.relative_ductility,
        parameters.shear_contribution,
        parameters.isotropic_prestress,
        f64::from(u8::from(parameters.damage_law == DamageLaw::Exponential)),
        f64::from(u8::from(parameters.never_damage)),
    ]
}

/// Whether two numbers of the host differ by more than the rounding of a few operations.
fn differ(found: f64, wanted: f64) -> bool {
    let close = (found - wanted).abs() <= 1e-12 * wanted.abs();
    // An infinite strength equals itself.
    !close && found.to_bits() != wanted.to_bits()
}

/// A rigid clump of the host.
#[derive(Debug, Clone)]
pub struct HostClump {
    /// Indices of the members in [`Bodies`], any order; each body is in at most one clump.
    pub members: Vec<u32>,
    /// Centers of the members in the clump's axes, m.
    pub offsets: Vec<Vec3>,
    /// Orientations of the members relative to the clump.
    pub orientations: Vec<Quat>,
    /// Center of mass, m.
    pub position: Vec3,
    /// Velocity at the half step, m/s.
    pub velocity: Vec3,
    /// Orientation of the principal axes, body to world.
    pub orientation: Quat,
    /// Angular momentum at the half step, world axes, kg·m²/s.
    pub angular_momentum: Vec3,
    /// Mass, kg.
    pub mass: f64,
    /// Principal moments of inertia, kg·m².
    pub inertia: Vec3,
    /// Bit mask of prescribed degrees of freedom, see [`Constraint`].
    pub constraint: u32,
}

impl HostClump {
    /// Check the numbers. `number` names the clump in messages, `bodies` is the number of bodies.
    fn check(&self, number: usize, bodies: usize) -> Result<(), String> {
        same_length("offsets of a clump", self.offsets.len(), self.members.len())?;
        same_length("orientations of a clump", self.orientations.len(), self.members.len())?;
        if let Some(member) = self.members.iter().find(|&&member| member as usize >= bodies) {
            return Err(format!("clump {number} refers to body index {member}, but there are {bodies} bodies"));
        }
        let finite =
            [self.position, self.velocity, self.angular_momentum].iter().all(|v| v.iter().all(|x| x.is_finite()));
        if !(finite && self.mass > 0.0 && self.inertia.min() > 0.0 && !self.members.is_empty()) {
            return Err(format!(
                "clump {number} has no members, a position or motion that is not finite, or a mass or moment of inertia that is \
                 not positive"
            ));
        }
        Ok(())
    }

    /// The clump with its members at their `place` in the solver.
    fn placed(&self, place: &[u32]) -> Clump {
        let mut order: Vec<usize> = (0..self.members.len()).collect();
        order.sort_unstable_by_key(|&k| place[self.members[k] as usize]);
        Clump {
            members: order.iter().map(|&k| place[self.members[k] as usize]).collect(),
            offsets: order.iter().map(|&k| self.offsets[k]).collect(),
            orientations: order.iter().map(|&k| self.orientations[k]).collect(),
            position: self.position,
            velocity: self.velocity,
            orientation: self.orientation,
            angular_momentum: self.angular_momentum,
            mass: self.mass,
            inertia: self.inertia,
            constraint: Constraint(self.constraint as u8),
        }
    }
}

/// Put `clumps` into `state`, whose particles are bodies at their `place`. Members follow their clump, so their own constraints have no
/// effect, as in YADE. A member may be `displaced` from its place in the clump by this fraction of its radius.
pub(super) fn add_clumps(state: &mut State, clumps: &[HostClump], place: &[u32], displaced: f64) -> Result<(), String> {
    for (number, clump) in clumps.iter().enumerate() {
        clump.check(number, place.len())?;
        let placed = clump.placed(place);
        for (&member, offset) in placed.members.iter().zip(&placed.offsets) {
            let member = member as usize;
            let particles = &mut state.particles;
            if particles.clump[member] != u32::MAX {
                return Err(format!("body {} is in two clumps, but may be in one", particles.id[member]));
            }
            let away = (placed.position + rotate(&placed.orientation, offset) - particles.position[member]).norm();
            if away > displaced * particles.radius[member] {
                return Err(format!(
                    "body {} is {away:e} m away from its place in its clump; take one step, so that the host moves it there",
                    particles.id[member]
                ));
            }
            particles.clump[member] = number as u32;
            particles.constraint[member] = Constraint::FREE;
        }
        state.clumps.push(placed);
    }
    Ok(())
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
            ("lost", self.lost.len()),
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

    /// A state with these bodies in the order of the solver, which a step of `dt` seconds has moved, and the place of each body in it.
    pub(super) fn placed(
        &self,
        clumps: &[HostClump],
        cell: Option<&Cell>,
        dt: f64,
    ) -> Result<(State, Vec<u32>), String> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(format!("the time step is {dt} s, but must be positive; set O.dt"));
        }
        let unordered = self.particles()?;
        let order = spatial_order(&unordered.position, cell);
        let mut place = vec![0_u32; order.len()];
        for (new, &old) in order.iter().enumerate() {
            place[old as usize] = new as u32;
        }
        let mut particles = unordered.permuted(&order);
        for (increment, angular_velocity) in particles.rotation_increment.iter_mut().zip(&particles.angular_velocity) {
            *increment = quaternion_of_rotation_vector(&(angular_velocity * dt));
        }
        let mut state = State { particles, cell: cell.copied(), ..State::default() };
        // A host stores members with the rounding of its own arithmetic.
        add_clumps(&mut state, clumps, &place, 1e-6)?;
        state.clock.dt = dt;
        Ok((state, place))
    }
}

/// The laws, and the index of the law for each pair of `materials` materials; the laws of contacts with parameters of their own come last.
fn laws_of(
    pairs: &[PairParameters],
    own: &[CpmParameters],
    materials: usize,
) -> Result<(Vec<Cpm>, PairCoefficients), String> {
    const MOST: usize = u16::MAX as usize;
    if pairs.len() + own.len() > MOST {
        return Err(format!(
            "the contacts have {} different sets of parameters, but {MOST} is the maximum; round them, or group them by material",
            pairs.len() + own.len()
        ));
    }
    let made = |parameters: &CpmParameters| Cpm::new(parameters).map_err(|error| error.to_string());
    let mut laws = Vec::with_capacity(pairs.len() + own.len());
    let mut map = PairCoefficients::new(materials);
    for PairParameters { a, b, parameters } in pairs {
        map.set(*a, *b, laws.len() as u16);
        map.set(*b, *a, laws.len() as u16);
        laws.push(made(parameters)?);
    }
    for parameters in own {
        laws.push(made(parameters)?);
    }
    Ok((laws, map))
}

/// The values of [`STORED`] for each law. Refuses materials with different damage laws, because YADE's functor takes that
/// of the body that comes first in the contact.
fn stored_of_laws(origin: &Origin) -> Result<Vec<[f64; STORED.len()]>, String> {
    let Origin::Concrete { pairs, own, .. } = origin else { return Ok(Vec::new()) };
    let law = |material: u16| {
        pairs.iter().find(|pair| (pair.a, pair.b) == (material, material)).map(|pair| pair.parameters.damage_law)
    };
    if let Some(PairParameters { a, b, .. }) = pairs.iter().find(|pair| law(pair.a) != law(pair.b)) {
        return Err(format!(
            "materials {a} and {b} of the spheres (in their order) have different damLaw, of which YADE takes one or the other \
             in a contact between them; give both the same"
        ));
    }
    Ok(pairs.iter().map(|pair| &pair.parameters).chain(own).map(stored_of).collect())
}

/// Refuse a contact between members of one clump.
pub(super) fn refuse_in_clump(particles: &Particles, a: usize, b: usize) -> Result<(), String> {
    if particles.clump[a] == particles.clump[b] && particles.clump[a] != u32::MAX {
        return Err(format!(
            "bodies {} and {} interact, but belong to one clump; erase the interaction",
            particles.id[a], particles.id[b]
        ));
    }
    Ok(())
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
            ("radii", self.radii.len(), count),
            ("reference_overlap", self.reference_overlap.len(), count),
            ("stored", self.stored.len(), count * STORED.len()),
            ("own", self.own.len(), if self.own.is_empty() { 0 } else { count }),
        ] {
            same_length(name, found, wanted)?;
        }
        Ok(())
    }

    /// Refuse contact `k` if the host's law has not evaluated it yet, or if it does not match its two bodies. `radii`: sum of their radii;
    /// `stored`: what their materials give; `which`: the contact in messages.
    fn check_against_bodies(&self, k: usize, radii: f64, stored: &[f64], which: &str) -> Result<(), String> {
        let length = self.length[k];
        if !length.is_finite() {
            return Err(format!("{which} has not been evaluated by its law; take one step (O.step()) before"));
        }
        if differ(self.radii[k], radii) {
            return Err(format!(
                "{which} has stored radii with the sum {:e} m, but that of the bodies is {radii:e} m; do not change radii after \
                 bonding",
                self.radii[k]
            ));
        }
        // Redundant, unless a script has changed one of them.
        let consistent = (self.reference_overlap[k] - (radii - length)).abs() <= 1e-12 * radii;
        if !consistent {
            return Err(format!(
                "{which} has refPD = {:e} m, but refLength = {length:e} m and the radii give {:e} m; do not change only one of \
                 them",
                self.reference_overlap[k],
                radii - length
            ));
        }
        let found = &self.stored[k * STORED.len()..(k + 1) * STORED.len()];
        for ((name, &found), &wanted) in STORED.iter().zip(found).zip(stored) {
            if differ(found, wanted) {
                return Err(format!(
                    "{which} has {name} = {found}, but its materials give {wanted}, and ConcorDEM takes the values of the materials; set it back, \
                     or set the materials before the contact is created"
                ));
            }
        }
        Ok(())
    }

    /// Append contact `k` to `block`. `place` maps the host's order of bodies to the order of `particles`; `stored`: what each law gives, first
    /// those of the `pairs` of materials.
    fn push(
        &self,
        k: usize,
        place: &[u32],
        particles: &Particles,
        coefficients: &PairCoefficients,
        (pairs, stored): (u16, &[[f64; STORED.len()]]),
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
        let of_materials = coefficients
            .get(particles.material[a as usize], particles.material[b as usize])
            .ok_or_else(|| format!("there are no parameters for the materials of contact {k}"))?;
        let row = match self.own.get(k) {
            None | Some(0) => of_materials,
            Some(&own) => pairs + (own - 1) as u16,
        };
        let which = format!("the contact of bodies {} and {}", particles.id[a as usize], particles.id[b as usize]);
        let radii = particles.radius[a as usize] + particles.radius[b as usize];
        let wanted = stored.get(row as usize).ok_or_else(|| format!("{which} has no parameters of its own"))?;
        self.check_against_bodies(k, radii, wanted, &which)?;
        refuse_in_clump(particles, a as usize, b as usize)?;
        let (mut normal, mut image) = (self.normal[k], self.image[k]);
        let history = &self.history[k * HISTORY..(k + 1) * HISTORY];
        let mut state: CpmState = bytemuck::pod_read_unaligned(bytemuck::cast_slice(history));
        let (length, area) = (self.length[k], self.area[k]);
        if !(length > 0.0
            && area > 0.0
            && normal.norm_squared() > 0.5
            && state.as_reals().iter().all(|x| x.is_finite()))
        {
            return Err(format!("{which} has no reference length or area, no normal, or a history that is not finite"));
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
        block.history.set(block.len() - 1, state);
        Ok(())
    }
}

impl Assembly {
    /// Empty contact block and model of an assembly of concrete.
    pub(super) fn empty_concrete(origin: &Origin) -> Result<(ContactBlock<Cpm>, Model), String> {
        let Origin::Concrete { kinematics, materials, damping, gravity, pairs, own } = origin else {
            return Err("the assembly was not taken over from concrete".into());
        };
        let (laws, contact_rows) = laws_of(pairs, own, *materials)?;
        let damping =
            if *damping == 0.0 { Damping::None } else { Damping::Local { translation: *damping, rotation: *damping } };
        let gravity = Vec3::from(*gravity);
        let model = Model { mode: *kinematics, damping, gravity, contact_rows, ..Model::default() };
        Ok((ContactBlock::new(laws), model))
    }

    /// Spheres with bonds and contacts of the concrete law and their histories. Members of a clump do not interact with each other.
    ///
    /// # Errors
    /// Columns of different lengths, values that are not finite or not positive, contacts between materials without a law or that do
    /// not match their bodies, materials with different damage laws, members that are not at their place in the clump or interact with
    /// each other.
    pub fn concrete(
        bodies: &Bodies<'_>,
        contacts: &Contacts<'_>,
        clumps: &[HostClump],
        origin: Origin,
        cell: Option<Cell>,
        dt: f64,
    ) -> Result<Self, String> {
        contacts.check_lengths()?;
        let stored = stored_of_laws(&origin)?;
        let (mut bonds, model) = Self::empty_concrete(&origin)?;
        let mut unbonded = bonds.clone();
        let (mut state, place) = bodies.placed(clumps, cell.as_ref(), dt)?;
        let particles = &state.particles;
        let pairs = if let Origin::Concrete { pairs, .. } = &origin { pairs.len() as u16 } else { 0 };
        for k in 0..contacts.pair.len() {
            let block = if contacts.bonded[k] { &mut bonds } else { &mut unbonded };
            contacts.push(k, &place, particles, &model.contact_rows, (pairs, &stored), block)?;
        }
        bonds.sort();
        unbonded.sort();
        state.bonds = vec![Box::new(bonds)];
        state.contacts = Some(Box::new(unbonded));
        let mut made = Self::new(state, model, origin)?;
        for (&place, &lost) in place.iter().zip(bodies.lost) {
            made.openings[place as usize] = lost;
        }
        Ok(made)
    }
}
