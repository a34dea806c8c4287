//! Bonds and contacts of particles that a host program moves: one core for the native engine and the header-free one.

use std::path::Path;
use std::time::{Duration, Instant};

use concordem_contact::kinematics::{MotionMeasure, PreviousGeometry};
use concordem_contact::law::cpm::{Cpm, CpmParameters, CpmState};
use concordem_contact::law::{EnergySplit, LawState, Reference};
use concordem_contact::math::{Mat3, Quat, Vec3, quaternion_of_rotation_vector};
use concordem_scenario::assembly::assemble;
use concordem_scenario::schema::Scenario;
use concordem_solver::integrate::Damping;
use concordem_solver::neighbor::spatial_order;
use concordem_solver::state::columns::{ColumnData, ColumnKind, ColumnStore, StoredColumn};
use concordem_solver::state::contacts::{ContactBlock, ContactFlags, Pair};
use concordem_solver::state::{Cell, Constraint, Particles, Sphere, State};
use concordem_solver::{Model, PairCoefficients, Solver, StepReport};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Particles in the host's order.
#[derive(Debug, Clone, Copy)]
pub struct Bodies<'a> {
    /// Ids in the host.
    pub id: &'a [u32],
    /// Centres, m.
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
    /// Numbers of materials.
    pub material: &'a [u32],
    /// Masks of prescribed degrees of freedom, see [`Constraint`].
    pub constraint: &'a [u32],
}

/// Contacts of the concrete law with their histories.
#[derive(Debug, Clone, Copy)]
pub struct Contacts<'a> {
    /// Rows of the two bodies.
    pub pair: &'a [[u32; 2]],
    /// Periodic images of the second body.
    pub image: &'a [[i8; 3]],
    /// Bonds, as against ordinary contacts.
    pub bonded: &'a [bool],
    /// Reference lengths, m.
    pub length: &'a [f64],
    /// Areas, m².
    pub area: &'a [f64],
    /// Normals from the first body to the second, at the last step.
    pub normal: &'a [Vec3],
    /// Centre distances at the last step, m.
    pub distance: &'a [f64],
    /// Histories ([`CpmState`]), one after the other.
    pub history: &'a [f64],
}

/// Parameters of concrete between materials `a` and `b`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// First material.
    pub a: u16,
    /// Second material, `a ≤ b`.
    pub b: u16,
    /// Parameters.
    pub parameters: CpmParameters,
}

/// How an assembly was made: enough to make it again, without its state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// Taken over from the host's own concrete.
    Concrete {
        /// Measure of motion.
        kinematics: MotionMeasure,
        /// Number of materials.
        materials: usize,
        /// Damping, if the assembly moves its particles itself.
        damping: f64,
        /// Gravity, m/s², in the same case.
        gravity: [f64; 3],
        /// Parameters.
        rows: Vec<Row>,
    },
    /// Bonds of a scenario, whose text this is.
    Scenario {
        /// The text.
        text: String,
    },
    /// Made by somebody who keeps that himself.
    Elsewhere {},
}

/// The measure of motion of that name.
pub fn mode_of(name: &str) -> Result<MotionMeasure, String> {
    match name {
        "finite" => Ok(MotionMeasure::Finite),
        "first-order" => Ok(MotionMeasure::FirstOrder),
        "yade" => Ok(MotionMeasure::Yade),
        "yade-ratcheting" => Ok(MotionMeasure::YadeRatcheting),
        other => Err(format!(
            "kinematics is \"{other}\"; it may be \"finite\", \"first-order\", \"yade\", \"yade-ratcheting\""
        )),
    }
}

/// Behind edges, deformation gradient, and velocity gradient: the cell. Its edges have moved with the last step,
/// `H = (1 + LΔt) H_old`.
pub fn cell_of(matrix: Mat3, deformation_gradient: Mat3, velocity_gradient: Mat3, dt: f64) -> Cell {
    let matrix_change = (Mat3::identity() + velocity_gradient * dt)
        .try_inverse()
        .map_or_else(Mat3::zeros, |back| matrix - back * matrix);
    Cell { matrix, deformation_gradient, velocity_gradient, matrix_change }
}

fn same_length(name: &str, found: usize, wanted: usize) -> Result<(), String> {
    if found == wanted { Ok(()) } else { Err(format!("`{name}` has {found} entries where {wanted} are needed")) }
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
                    "body {} has a place or motion that is not finite, or no positive radius, mass, and inertia",
                    self.id[p]
                ));
            }
            let material = u16::try_from(self.material[p]).map_err(|_| "more than 65535 materials".to_owned())?;
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

/// Laws and which one is between two materials.
fn laws_of(rows: &[Row], materials: usize) -> Result<(Vec<Cpm>, PairCoefficients), String> {
    let mut laws = Vec::new();
    let mut map = PairCoefficients::new(materials);
    for Row { a, b, parameters } in rows {
        let law = Cpm::new(parameters).map_err(|error| error.to_string())?;
        map.set(*a, *b, laws.len() as u16);
        map.set(*b, *a, laws.len() as u16);
        laws.push(law);
    }
    Ok((laws, map))
}

/// Where a particle is and how it moves. What the assembly does not need ([`Assembly::needs_rotation`],
/// [`Assembly::needs_constraint`]) is not read.
#[derive(Debug, Clone, Copy, Default)]
pub struct Given {
    /// Centre, m.
    pub position: Vec3,
    /// Velocity, m/s.
    pub velocity: Vec3,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vec3,
    /// Orientation, unit quaternion (x, y, z, w), body to world.
    pub orientation: [f64; 4],
    /// Mask of degrees of freedom that the host prescribes, see [`Constraint`].
    pub constraint: u32,
}

/// OpenMP's `omp_pause_resource_all` (version 5.0, section 3.2.44). Refuses, which does no harm, inside of a parallel loop; to
/// be called by the thread that begins such loops.
pub type PauseThreads = unsafe extern "C" fn(i32) -> i32;
/// Its argument that keeps all settings.
pub const PAUSE_SOFT: i32 = 1;
/// Work that takes longer is worth the end and the new beginning of the host's threads, which cost 0.06 ms for one (measured, two
/// cores, nothing else running), and more for many.
const LONG: Duration = Duration::from_millis(1);

/// Particles with their bonds and contacts, and the solver that finds their forces.
pub struct Assembly {
    /// All that changes.
    pub state: State,
    /// The solver.
    pub solver: Solver,
    /// Bonds that broke so far.
    pub broken: u64,
    /// Bonds that each particle has lost, in the order of the particles.
    pub losses: Vec<u32>,
    /// Whether laws or measure read orientations and rotations.
    pub needs_rotation: bool,
    /// Whether prescribed degrees of freedom matter to forces: their reactions strain deformable particles.
    pub needs_constraint: bool,
    /// Dissipated so far: damage, friction, dashpots, J; and the error of the work rule.
    pub dissipated: [f64; 4],
    /// Stored at the last sampled step, J.
    pub stored: f64,
    /// What the forces of the last step took.
    spent: Duration,
    origin: Origin,
}

impl Assembly {
    /// A state with a model.
    pub fn new(mut state: State, model: Model, origin: Origin) -> Result<Self, String> {
        // Of the measures, only those of YADE read velocities in place of rotations.
        let oriented = state.bonds.iter().chain(&state.contacts).any(|block| block.reads_orientations());
        let needs_rotation = oriented || !matches!(model.mode, MotionMeasure::Yade | MotionMeasure::YadeRatcheting);
        let needs_constraint = model.deformable.is_some();
        let solver = Solver::new(model, &mut state).map_err(|error| error.to_string())?;
        let losses = vec![0; state.particles.len()];
        Ok(Self {
            state,
            solver,
            broken: 0,
            losses,
            needs_rotation,
            needs_constraint,
            dissipated: [0.0; 4],
            stored: 0.0,
            spent: Duration::ZERO,
            origin,
        })
    }

    /// State without contacts, and model, of an assembly of concrete.
    fn empty_concrete(origin: &Origin) -> Result<(ContactBlock<Cpm>, Model), String> {
        let Origin::Concrete { kinematics, materials, damping, gravity, rows } = origin else {
            return Err("not of concrete".into());
        };
        let (laws, contact_rows) = laws_of(rows, *materials)?;
        let damping =
            if *damping == 0.0 { Damping::None } else { Damping::Local { translation: *damping, rotation: *damping } };
        let gravity = Vec3::from(*gravity);
        let model = Model { mode: *kinematics, damping, gravity, contact_rows, ..Model::default() };
        Ok((ContactBlock::new(laws), model))
    }

    /// Spheres with bonds and contacts of the concrete law and their histories.
    pub fn concrete(
        bodies: &Bodies<'_>,
        contacts: &Contacts<'_>,
        origin: Origin,
        cell: Option<Cell>,
        dt: f64,
    ) -> Result<Self, String> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(format!("the time step is {dt}"));
        }
        let unordered = bodies.particles()?;
        let order = spatial_order(&unordered.position, cell.as_ref());
        let mut place = vec![0_u32; order.len()];
        for (new, &old) in order.iter().enumerate() {
            place[old as usize] = new as u32;
        }
        let mut particles = unordered.permuted(&order);
        for (increment, spin) in particles.rotation_increment.iter_mut().zip(&particles.angular_velocity) {
            *increment = quaternion_of_rotation_vector(&(spin * dt));
        }
        let (mut bonds, model) = Self::empty_concrete(&origin)?;
        let mut loose = bonds.clone();
        let count = contacts.pair.len();
        let width = size_of::<CpmState>() / 8;
        for (name, found, wanted) in [
            ("image", contacts.image.len(), count),
            ("bonded", contacts.bonded.len(), count),
            ("length", contacts.length.len(), count),
            ("area", contacts.area.len(), count),
            ("normal", contacts.normal.len(), count),
            ("distance", contacts.distance.len(), count),
            ("history", contacts.history.len(), count * width),
        ] {
            same_length(name, found, wanted)?;
        }
        for k in 0..count {
            let [one, two] = contacts.pair[k];
            let at = |p: u32| {
                place
                    .get(p as usize)
                    .copied()
                    .ok_or_else(|| format!("contact {k} names row {p}, but there are {} bodies", place.len()))
            };
            let (mut a, mut b) = (at(one)?, at(two)?);
            let row = model
                .contact_rows
                .get(particles.material[a as usize], particles.material[b as usize])
                .ok_or_else(|| format!("contact {k} is between materials without a law"))?;
            let (mut normal, mut image) = (contacts.normal[k], contacts.image[k]);
            let history = &contacts.history[k * width..(k + 1) * width];
            let mut state: CpmState = bytemuck::pod_read_unaligned(bytemuck::cast_slice(history));
            let (length, area) = (contacts.length[k], contacts.area[k]);
            if !(length > 0.0
                && area > 0.0
                && normal.norm_squared() > 0.5
                && state.as_reals().iter().all(|x| x.is_finite()))
            {
                return Err(format!(
                    "contact {k} of rows {one} and {two} has no reference length and area, no normal, or a history that \
                     is not finite"
                ));
            }
            if a > b {
                std::mem::swap(&mut a, &mut b);
                normal = -normal;
                image = image.map(|i| -i);
                state = state.swapped();
            }
            let bonded = contacts.bonded[k];
            let flags = ContactFlags::ACTIVE | if bonded { ContactFlags::BONDED } else { 0 };
            let link = ContactFlags { row, bits: flags, image, padding: 0 };
            let block = if bonded { &mut bonds } else { &mut loose };
            let frame = PreviousGeometry { normal, length: contacts.distance[k] };
            block.push(Pair { a, b }, link, Reference { length, area }, frame);
            if let Some(last) = block.history.last_mut() {
                *last = state;
            }
        }
        bonds.sort();
        loose.sort();
        let mut state = State { particles, cell, bonds: vec![Box::new(bonds)], ..State::default() };
        state.contacts = Some(Box::new(loose));
        state.clock.dt = dt;
        Self::new(state, model, origin)
    }

    /// The spheres of a scenario, with its bonds and contacts, as they would be built for a run. `bodies` says which body of
    /// the host each sphere of the scenario is; masses (kg) and moments of inertia (kg m²) are the host's.
    pub fn of_scenario(
        assembly: concordem_scenario::assembly::Assembly,
        allow_unstable: bool,
        origin: Origin,
        bodies: &[u32],
        mass: &[f64],
        inertia: &[f64],
        dt: f64,
    ) -> Result<Self, String> {
        let (mut state, model) = (assembly.state, assembly.model);
        let n = state.particles.len();
        for (name, found) in [("bodies", bodies.len()), ("mass", mass.len()), ("inertia", inertia.len())] {
            same_length(name, found, n)?;
        }
        let limit = assembly.summary.bounds.spectral.max(assembly.summary.bounds.per_particle);
        if !(allow_unstable || dt > 0.0 && dt < limit) {
            return Err(format!(
                "the host's time step is {dt:.4e} s, but the bonds are stable only below {limit:.4e} s (with the masses of \
                 the scenario's density); set O.dt, or integration.allow_unstable"
            ));
        }
        for p in 0..n {
            let sphere = state.particles.id[p] as usize;
            state.particles.mass[p] = mass[sphere];
            state.particles.inertia[p] = inertia[sphere];
            state.particles.id[p] = bodies[sphere];
        }
        state.clock.dt = dt;
        Self::new(state, model, origin)
    }

    /// [`Self::of_scenario`] from a text.
    pub fn of_text(text: &str, bodies: &[u32], mass: &[f64], inertia: &[f64], dt: f64) -> Result<Self, String> {
        let scenario = Scenario::parse("scenario", text)
            .map_err(|error| error.problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))?;
        let made = assemble(&scenario, Path::new("."), &mut |_, _| {}).map_err(|error| error.to_string())?;
        let origin = Origin::Scenario { text: text.to_owned() };
        Self::of_scenario(made, scenario.integration.allow_unstable, origin, bodies, mass, inertia, dt)
    }

    /// Forces at the present places, which the host has set; how many bonds broke. With `sample`, stored energies are summed.
    pub fn find_forces(&mut self, dt: f64, cell: Option<Cell>, sample: bool) -> Result<usize, String> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(format!("the time step is {dt}"));
        }
        if cell.is_some() != self.state.cell.is_some() {
            return Err("the host's scene has become periodic, or is so no more".into());
        }
        if cell.is_some() {
            self.state.cell = cell;
        }
        self.state.clock.dt = dt;
        let start = Instant::now();
        let report = self.solver.find_forces(&mut self.state, sample).map_err(|error| error.to_string())?;
        self.spent = start.elapsed();
        self.state.clock.step += 1;
        for (p, (force, torque)) in self.solver.forces().iter().zip(self.solver.torques()).enumerate() {
            if !(force.norm_squared() + torque.norm_squared()).is_finite() {
                return Err(format!(
                    "the force on body {} is not finite; is the time step too large?",
                    self.state.particles.id[p]
                ));
            }
        }
        if sample {
            self.stored = report.energy.stored();
        }
        Ok(self.count(&report))
    }

    /// Note the bonds that broke in a step, and what was dissipated; the number of bonds.
    pub fn count(&mut self, report: &StepReport) -> usize {
        let mut count = 0;
        for (_, bond_event) in report.bond_events.iter().filter(|(_, bond_event)| bond_event.broke) {
            self.losses[bond_event.pair.a as usize] += 1;
            self.losses[bond_event.pair.b as usize] += 1;
            count += 1;
        }
        self.broken += count as u64;
        let EnergySplit { damage, friction, viscous, integration, .. } = report.energy;
        for (sum, part) in self.dissipated.iter_mut().zip([damage, friction, viscous, integration]) {
            *sum += part;
        }
        count
    }

    /// Whether the host should first end those of its OpenMP's threads that wait for work ([`PauseThreads`]), if `threads` of
    /// ours are to work: they spin, for some 8 ms (measured), on the processors that ours need. The host's next parallel loop begins
    /// them anew. No result depends on it.
    pub fn wants_room(&self, threads: usize) -> bool {
        threads > 1 && self.spent > LONG
    }

    /// Take over where the particles are and how they move: `motion` of particle `k`, which is body `id`, from several threads
    /// at once. The first particle that cannot be taken over is told.
    pub fn take_motions(
        &mut self,
        dt: f64,
        motion: impl Fn(usize, u32) -> Result<Given, String> + Sync,
    ) -> Result<(), String> {
        const CHUNK: usize = 1024;
        let (rotation, constraint) = (self.needs_rotation, self.needs_constraint);
        let p = &mut self.state.particles;
        let moved = p.position.par_chunks_mut(CHUNK).zip(p.velocity.par_chunks_mut(CHUNK));
        let turned = p.orientation.par_chunks_mut(CHUNK).zip(p.rotation_increment.par_chunks_mut(CHUNK));
        let spun = p.angular_velocity.par_chunks_mut(CHUNK).zip(p.constraint.par_chunks_mut(CHUNK));
        let chunks = p.id.par_chunks(CHUNK).zip(moved).zip(turned).zip(spun).enumerate();
        let refused = chunks.find_map_first(|(chunk, (((id, (x, v)), (q, increment)), (w, mask)))| {
            for i in 0..id.len() {
                let given = match motion(chunk * CHUNK + i, id[i]) {
                    Ok(given) => given,
                    Err(why) => return Some(why),
                };
                let Given { position, velocity, angular_velocity, .. } = given;
                if !(position + velocity + angular_velocity).iter().all(|c| c.is_finite()) {
                    return Some(format!("place or motion of body {} is not finite", id[i]));
                }
                (x[i], v[i], w[i]) = (position, velocity, angular_velocity);
                if rotation {
                    let [qx, qy, qz, qw] = given.orientation;
                    q[i] = Quat::new(qw, qx, qy, qz);
                    increment[i] = quaternion_of_rotation_vector(&(w[i] * dt));
                }
                if constraint {
                    mask[i] = Constraint(given.constraint as u8);
                }
            }
            None
        });
        refused.map_or(Ok(()), Err)
    }

    /// Everything, as words for a host to keep: [`Self::from_words`].
    pub fn to_words(&self) -> Result<Vec<i32>, String> {
        let store = ColumnStore::of(&self.state).map_err(|error| error.to_string())?;
        let mut bytes = MAGIC.to_vec();
        let mut put = |data: &[u8]| {
            bytes.extend((data.len() as u64).to_le_bytes());
            bytes.extend(data);
        };
        put(toml::to_string(&self.origin).map_err(|error| error.to_string())?.as_bytes());
        put(bytemuck::cast_slice(&self.losses));
        put(bytemuck::cast_slice(&self.dissipated));
        for (path, column) in store.iter() {
            put(path.as_bytes());
            put(&[column.kind() as u8]);
            put(&(column.components as u64).to_le_bytes());
            put(column.borrow().bytes());
        }
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        Ok(bytes.chunks_exact(4).map(|c| i32::from_le_bytes([c[0], c[1], c[2], c[3]])).collect())
    }

    /// What [`Self::to_words`] wrote.
    pub fn from_words(words: &[i32]) -> Result<Self, String> {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let mut rest = bytes.strip_prefix(MAGIC).ok_or("the saved bonds are of another version, or no bonds")?;
        let mut take = || -> Result<&[u8], String> {
            let cut = || "the saved bonds are cut off".to_owned();
            let (length, tail) = rest.split_first_chunk::<8>().ok_or_else(cut)?;
            let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| cut())?;
            let (part, tail) = tail.split_at_checked(length).ok_or_else(cut)?;
            rest = tail;
            Ok(part)
        };
        let text = String::from_utf8(take()?.to_vec()).map_err(|error| error.to_string())?;
        let origin: Origin = toml::from_str(&text).map_err(|error| error.to_string())?;
        let losses: Vec<u32> = typed(take()?, u32::from_le_bytes);
        let dissipated: Vec<f64> = typed(take()?, f64::from_le_bytes);
        let mut store = ColumnStore::default();
        while let Ok(path) = take() {
            if path.is_empty() {
                break;
            }
            let path = String::from_utf8(path.to_vec()).map_err(|error| error.to_string())?;
            let kind = take()?.first().copied();
            let components: Vec<u64> = typed(take()?, u64::from_le_bytes);
            let data = take()?;
            let data = match kind {
                Some(k) if k == ColumnKind::F64 as u8 => ColumnData::F64(typed(data, f64::from_le_bytes)),
                Some(k) if k == ColumnKind::U64 as u8 => ColumnData::U64(typed(data, u64::from_le_bytes)),
                Some(k) if k == ColumnKind::U32 as u8 => ColumnData::U32(typed(data, u32::from_le_bytes)),
                Some(k) if k == ColumnKind::U16 as u8 => ColumnData::U16(typed(data, u16::from_le_bytes)),
                Some(k) if k == ColumnKind::U8 as u8 => ColumnData::U8(data.to_vec()),
                Some(k) if k == ColumnKind::I8 as u8 => ColumnData::I8(typed(data, i8::from_le_bytes)),
                _ => return Err(format!("the saved bonds have a column {path} of an unknown kind")),
            };
            let components = components.first().map_or(1, |&count| count as usize);
            store.insert(&path, StoredColumn { data, components }).map_err(|error| error.to_string())?;
        }
        let (mut state, model) = match &origin {
            Origin::Concrete { .. } => {
                let (block, model) = Self::empty_concrete(&origin)?;
                let mut state = State { bonds: vec![Box::new(block.clone())], ..State::default() };
                state.contacts = Some(Box::new(block));
                (state, model)
            }
            Origin::Scenario { text } => {
                let scenario = Scenario::parse("scenario", text).map_err(|_| "the saved scenario is not valid")?;
                let made = assemble(&scenario, Path::new("."), &mut |_, _| {}).map_err(|error| error.to_string())?;
                (made.state, made.model)
            }
            Origin::Elsewhere {} => return Err("these bonds were not made to be loaded here".into()),
        };
        state.read(&mut store).map_err(|error| error.to_string())?;
        same_length("losses", losses.len(), state.particles.len())?;
        let mut made = Self::new(state, model, origin)?;
        made.broken = losses.iter().map(|&n| u64::from(n)).sum::<u64>() / 2;
        made.losses = losses;
        for (to, from) in made.dissipated.iter_mut().zip(dissipated) {
            *to = from;
        }
        Ok(made)
    }
}

const MAGIC: &[u8] = b"concordem bonds 1\n\0\0";

/// Numbers out of little-endian bytes.
fn typed<const N: usize, T>(bytes: &[u8], number: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks::<N>().0.iter().map(|&chunk| number(chunk)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three spheres of concrete in a row, the first two bonded; the third comes from the right.
    fn row_of_three(kinematics: MotionMeasure) -> Assembly {
        let position = [Vec3::zeros(), Vec3::new(2e-3, 0.0, 0.0), Vec3::new(4.1e-3, 0.0, 0.0)];
        let velocity = [Vec3::zeros(), Vec3::new(0.1, 0.02, 0.0), Vec3::new(-3.0, 0.0, 0.0)];
        let bodies = Bodies {
            id: &[7, 3, 11],
            position: &position,
            velocity: &velocity,
            orientation: &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            angular_velocity: &[Vec3::zeros(); 3],
            radius: &[1e-3; 3],
            mass: &[1e-5; 3],
            inertia: &[4e-12; 3],
            material: &[0; 3],
            constraint: &[0; 3],
        };
        let contacts = Contacts {
            pair: &[[1, 0]],
            image: &[[0; 3]],
            bonded: &[true],
            length: &[2e-3],
            area: &[3e-6],
            normal: &[Vec3::new(-1.0, 0.0, 0.0)],
            distance: &[2e-3],
            history: &[0.0, 2e-4, 0.3, 0.0, 0.0, 0.0, 1e-5, 0.0, 0.0, 0.0, 0.0],
        };
        let parameters = CpmParameters::new(25e9, 0.2, 3e6, 0.6, 1e-4, 10.0);
        let rows = vec![Row { a: 0, b: 0, parameters }];
        let origin = Origin::Concrete { kinematics, materials: 1, damping: 0.0, gravity: [0.0; 3], rows };
        Assembly::concrete(&bodies, &contacts, origin, None, 1e-7).expect("it is sound")
    }

    /// Move as a host would, and give the forces of all steps.
    fn drive(assembly: &mut Assembly, steps: usize) -> Vec<u64> {
        let mut bits = Vec::new();
        for _ in 0..steps {
            let p = &assembly.state.particles;
            let (position, velocity, spin) = (p.position.clone(), p.velocity.clone(), p.angular_velocity.clone());
            let given = |k: usize| Given {
                position: position[k] + velocity[k] * 1e-7,
                velocity: velocity[k],
                angular_velocity: spin[k],
                orientation: [0.0, 0.0, 0.0, 1.0],
                constraint: 0,
            };
            assembly.take_motions(1e-7, |k, _| Ok(given(k))).expect("finite");
            assembly.find_forces(1e-7, None, true).expect("a step");
            bits.extend(assembly.solver.forces().iter().flat_map(|f| f.iter().map(|x| x.to_bits())));
        }
        bits
    }

    #[test]
    fn words_hold_everything() {
        for kinematics in [MotionMeasure::Finite, MotionMeasure::YadeRatcheting] {
            let mut straight = row_of_three(kinematics);
            drive(&mut straight, 500);
            let words = straight.to_words().expect("words");
            let mut again = Assembly::from_words(&words).expect("the same");
            assert_eq!(again.to_words().expect("words"), words);
            let forces = drive(&mut straight, 500);
            assert_eq!(drive(&mut again, 500), forces);
            assert!(forces.iter().any(|&bits| f64::from_bits(bits).abs() > 0.1), "something acts");
        }
    }

    #[test]
    fn words_that_are_not_whole_are_refused() {
        let words = row_of_three(MotionMeasure::Finite).to_words().expect("words");
        for length in (0..words.len()).step_by(7) {
            assert!(Assembly::from_words(&words[..length]).is_err(), "{length} of {}", words.len());
        }
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        let mut assembly = row_of_three(MotionMeasure::Finite);
        let nan = Vec3::new(f64::NAN, 0.0, 0.0);
        let place = assembly.state.particles.id.iter().position(|&id| id == 11).expect("it is there");
        let given = |k| Given { velocity: if k == place { nan } else { Vec3::zeros() }, ..Given::default() };
        let message = assembly.take_motions(1e-7, |k, _| Ok(given(k))).expect_err("not finite");
        assert!(message.contains("body 11"), "{message}");
        assert!(assembly.find_forces(0.0, None, false).expect_err("no step").contains("time step"));
        let cell = cell_of(Mat3::identity(), Mat3::identity(), Mat3::zeros(), 1e-7);
        assert!(assembly.find_forces(1e-7, Some(cell), false).expect_err("no cell").contains("periodic"));
        assert!(mode_of("nonsense").expect_err("unknown").contains("first-order"));
    }
}
