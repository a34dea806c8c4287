//! The bonds and contacts of one processor's atoms.
//!
//! A processor holds every bond and contact that has an end among its own atoms, and evaluates it, so that forces need not
//! be communicated. One whose ends belong to two processors is held and evaluated on both: from the same numbers, by the
//! same function, hence with the same bits. An atom that migrates takes all its bonds along. Within a processor atoms are
//! ordered by id, and forces are added in that order ([`Solver::for_subdomain`]): the net force of an atom does not depend on
//! how many processors there are.

use std::collections::HashMap;

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::kinematics::deformable::{Deformable, Update};
use concordem_contact::kinematics::sphere_sphere::initial_geometry;
use concordem_contact::law::{EnergySplit, LawName, Reference};
use concordem_contact::material::Material;
use concordem_contact::math::{Mat3, Quat, Symmetric, Vec3, normalized, quaternion_of_rotation_vector};
use concordem_operator::stress::{ParticleVolume, Partition, particle_moments, region_stress};
use concordem_operator::{ContactSet, LoadSet, OperatorError, Region, Truncation, couple_stress};
use concordem_solver::forces::EvaluatedContacts;
use concordem_solver::laws::{self, LawError};
use concordem_solver::neighbor::{NeighborError, candidate_pairs};
use concordem_solver::record::ContactForces;
use concordem_solver::state::contacts::{ContactFlags, Contacts, Pair};
use concordem_solver::state::{Cell, Deformation, Sphere, State};
use concordem_solver::{Model, PairCoefficients, Solver, SolverError};

use crate::atoms::{Atoms, add, vector};
use crate::options::{Creation, Options};
use crate::records::{HISTORY, Kind, Record};

/// Why the network cannot go on. The message says what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NetworkError {
    /// The parameters make no law.
    #[error("{0}")]
    Parameters(#[from] LawError),
    /// The neighbour search refused.
    #[error("{0}")]
    Neighbor(#[from] NeighborError),
    /// The forces could not be found.
    #[error("{0}")]
    Solver(#[from] SolverError),
    /// An operator refused.
    #[error("{0}")]
    Operator(#[from] OperatorError),
    /// The forces of contacts are not there.
    #[error(
        "the forces of bonds at step {step} were not kept: nothing had asked for them beforehand; ask by `thermo_style`, `dump`, \
         or `fix ave/...`, which announce the steps they need"
    )]
    NotRecorded {
        /// Step.
        step: i64,
    },
    /// Couple stress depends on positions.
    #[error("couple stress depends on positions and has no meaning in a periodic box; use `boundary f f f`")]
    Periodic,
    /// An atom has a type without parameters.
    #[error(
        "bond of atoms {a} and {b}: no parameters of law {law} for atom types {types:?}; add them to the materials, or leave \
         the atoms out of the fix's group"
    )]
    NoRow {
        /// Atom.
        a: i32,
        /// Atom.
        b: i32,
        /// Law.
        law: &'static str,
        /// Their types.
        types: [i32; 2],
    },
    /// The other end of a bond is out of sight.
    #[error(
        "bond of atoms {tag} and {partner}: atom {partner} is not known to the processor that owns atom {tag}. Either it is \
         farther away than atoms are communicated ({cutoff} m): raise it with the fix's `reach LENGTH`; or it was deleted or \
         left the simulation box: bonded atoms cannot be"
    )]
    OutOfSight {
        /// The atom that is here.
        tag: i32,
        /// The one that is not.
        partner: i32,
        /// Distance up to which atoms are communicated, m.
        cutoff: f64,
    },
    /// The box is too small for images to be told apart.
    #[error(
        "the periodic box is {edge} m long in {axis}, less than twice the longest bond or contact ({longest} m): make it \
         larger"
    )]
    BoxTooSmall {
        /// Axis.
        axis: char,
        /// Its length, m.
        edge: f64,
        /// The longest bond or reach, m.
        longest: f64,
    },
    /// A copy of a bond from another processor is not the same.
    #[error(
        "the copies of the bond of atoms {a} and {b} differ between processors: something moves atoms on one processor alone, \
         or changes copies of atoms; such a fix cannot be used with bonds"
    )]
    CopiesDiffer {
        /// Atom.
        a: i32,
        /// Atom.
        b: i32,
    },
    /// Forces are not numbers.
    #[error(
        "at step {step} the force on atom {tag} is not a number; the time step may be too large, or atoms lie on top of each \
         other"
    )]
    NotFinite {
        /// Step.
        step: i64,
        /// Atom.
        tag: i32,
    },
    /// Atoms listed twice, or with ids that are none.
    #[error("atom ids must be positive and unique; {tag} is not (use `atom_modify` defaults, or `reset_ids`)")]
    BadTag {
        /// The id.
        tag: i32,
    },
    /// What came from another processor, or a restart file, is no record.
    #[error("bonds of atom {tag} cannot be read: the restart file belongs to another law or version")]
    BadRecord {
        /// The atom.
        tag: i32,
    },
}

/// Sums over the contacts counted on this processor.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sums {
    /// Bonds that hold.
    pub bonds: f64,
    /// Bonds that broke so far.
    pub broken: f64,
    /// Contacts without a bond that touch.
    pub contacts: f64,
    /// Energy stored by normal deformation, shear, bending, twist, J, at the last step that was sampled.
    pub stored: [f64; 4],
    /// Energy dissipated so far by damage and breaking, friction, dashpots, J.
    pub dissipated: [f64; 3],
    /// Error of the trapezoidal work rule so far, J.
    pub integration: f64,
    /// Longest bond, m (reference or present length).
    pub longest: f64,
}

/// For each particle where its contacts begin in the list, and the list.
type Adjacency = (Vec<u32>, Vec<(Kind, u32)>);

/// Reals in [`Network::totals`].
pub const TOTALS: usize = 9;

/// Reals per atom for the net force and torque of the last step.
const NET: usize = 6;

/// Where the rest of an atom's memory lies: first what only its owner needs, then what copies need, too.
#[derive(Debug, Clone, Copy)]
struct Layout {
    /// Other dyads of a deformable particle (two of six reals).
    others: usize,
    /// Orientation (x, y, z, w).
    orientation: usize,
    /// Dyads that strain it and strained it (two of six reals).
    dyads: usize,
    end: usize,
}

impl Layout {
    fn new(oriented: bool, deformable: bool) -> Self {
        let others = NET;
        let orientation = others + if deformable { 12 } else { 0 };
        let dyads = orientation + if oriented { 4 } else { 0 };
        Self { others, orientation, dyads, end: dyads + if deformable { 12 } else { 0 } }
    }
}

/// Bonds and contacts of one processor.
pub struct Network {
    options: Options,
    model: Model,
    layout: Layout,
    bond_rows: PairCoefficients,
    /// Reals in the history of a bond and of a contact.
    width: usize,
    state: State,
    solver: Option<Solver>,
    /// For each particle of the state, its id and the place of its atom.
    tags: Vec<i32>,
    atom: Vec<u32>,
    owned: Vec<bool>,
    /// Records that came with an atom since the last rebuild, by its id.
    incoming: HashMap<i32, Vec<Record>>,
    /// Bonds to be made at the next rebuild; those without an atom of this processor are dropped then.
    fresh: Vec<Record>,
    /// Contacts that remember a broken bond and whose other atom is far away.
    dormant: Vec<Record>,
    /// For each particle of the state, its contacts: where they begin in the second.
    adjacency: Option<Adjacency>,
    recorded: ContactForces,
    /// Step at which they were.
    recorded_at: Option<i64>,
    /// Totals of what this processor counted.
    broken: f64,
    dissipated: EnergySplit,
    stored: EnergySplit,
    /// Step whose net forces the atoms' memory holds.
    found_at: Option<i64>,
    /// Ids of the bonds that broke when forces were last found, whoever counts them.
    broken_now: Vec<[i32; 2]>,
}

impl Network {
    /// A network without bonds.
    pub fn new(options: Options) -> Result<Self, NetworkError> {
        // Without bonds any block will do: it stays empty. This one sets the width of records in restart files.
        let law = options.law.unwrap_or(LawName::LinearBond);
        let (block, bond_rows) = laws::block(law, &options.materials, &options.interfaces)?;
        let contacts = laws::contact_block(options.contact, &options.materials, &options.interfaces)?;
        let width = |block: &dyn EvaluatedContacts| {
            block.contacts().history_reals().0.iter().map(|field| field.components).sum::<usize>()
        };
        let reals = width(&*block).max(contacts.as_ref().map_or(0, |(block, _)| width(&**block)));
        assert!(reals <= HISTORY, "a law remembers {reals} reals");
        let mut model = Model { mode: options.mode, skin: 0.0, ..Model::default() };
        model.deformable = options.deformable.map(|condition| Deformable {
            elasticity: options.materials.iter().map(Material::elasticity).collect(),
            condition,
            update: Update::Lagged,
            dashpots: false,
        });
        let mut blocks = std::iter::once(&block).chain(contacts.as_ref().map(|(block, _)| block));
        let oriented = blocks.any(|block| block.contacts().reads_orientations());
        let layout = Layout::new(oriented, model.deformable.is_some());
        let mut state = State { bonds: vec![block], ..State::default() };
        if let Some((block, rows)) = contacts {
            model.contact_rows = rows;
            state.contacts = Some(block);
        }
        Ok(Self {
            options,
            model,
            layout,
            bond_rows,
            width: reals,
            state,
            solver: None,
            tags: Vec::new(),
            atom: Vec::new(),
            owned: Vec::new(),
            incoming: HashMap::new(),
            fresh: Vec::new(),
            dormant: Vec::new(),
            adjacency: None,
            recorded: ContactForces::default(),
            recorded_at: None,
            broken: 0.0,
            dissipated: EnergySplit::default(),
            stored: EnergySplit::default(),
            found_at: None,
            broken_now: Vec::new(),
        })
    }

    /// The arguments it was made from.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Whether atoms need an orientation.
    pub fn needs_orientation(&self) -> bool {
        self.layout.dyads > self.layout.orientation
    }

    /// Reals remembered per atom: net force and torque of the last step, the orientation (x, y, z, w) if needed, and what
    /// strains the particle if it deforms.
    pub fn atom_width(&self) -> usize {
        self.layout.end
    }

    /// Reals of an atom's memory that copies of it need at every step: the last ones, from place [`Self::atom_width`] minus
    /// this on.
    pub fn communicated(&self) -> usize {
        self.layout.end - self.layout.orientation
    }

    /// Memory of an atom that has just come into being.
    pub fn initial_memory(&self, memory: &mut [f64]) {
        memory.fill(0.0);
        if self.needs_orientation() {
            memory[self.layout.orientation + 3] = 1.0;
        }
    }

    /// Bonds read from a list are to be made: remember them, on whatever processor.
    pub fn make_listed(&mut self) {
        if let Creation::List(bonds) = &self.options.creation {
            for &(tags, length) in bonds {
                self.fresh.push(Record::fresh(tags, length));
            }
        }
    }

    /// Bonds of the host's own lists are to be made: remember them, on whatever processor.
    pub fn make_given(&mut self, bonds: &[[i32; 2]]) {
        self.fresh.extend(bonds.iter().map(|&[a, b]| Record::fresh([a.min(b), a.max(b)], None)));
    }

    /// Take in what [`Self::pack`] wrote for atom `tag` elsewhere.
    pub fn unpack(&mut self, tag: i32, reals: &[f64]) -> Result<(), NetworkError> {
        let length = Record::reals(self.width);
        let mut records = Vec::with_capacity(reals.len() / length);
        for chunk in reals.chunks(length) {
            let record = Record::read(chunk, self.width).filter(|record| record.tags.contains(&tag));
            records.push(record.ok_or(NetworkError::BadRecord { tag })?);
        }
        self.incoming.insert(tag, records);
        Ok(())
    }

    /// Write all bonds and contacts of atom `tag` that must not be forgotten to `buffer`; with `leaves` the atom goes.
    pub fn pack(&mut self, tag: i32, leaves: bool, buffer: &mut Vec<f64>) {
        let width = self.width;
        if let Some(records) = self.incoming.get(&tag) {
            for record in records {
                record.write(width, buffer);
            }
            if leaves {
                self.incoming.remove(&tag);
            }
            return;
        }
        if let Ok(particle) = self.tags.binary_search(&tag) {
            let (start, contacts) = self.adjacency.get_or_insert_with(|| adjacency(&self.state));
            for &(kind, k) in &contacts[start[particle] as usize..start[particle + 1] as usize] {
                if let Some(record) = record_of(&self.state, &self.tags, kind, k as usize) {
                    record.write(width, buffer);
                }
            }
        }
        for record in self.dormant.iter().filter(|record| record.tags.contains(&tag)) {
            record.write(width, buffer);
        }
    }

    /// Most reals that [`Self::pack`] writes for any atom.
    pub fn largest_pack(&mut self) -> usize {
        let (start, _) = self.adjacency.get_or_insert_with(|| adjacency(&self.state));
        let most = start.windows(2).map(|w| (w[1] - w[0]) as usize).max().unwrap_or(0);
        let coming = self.incoming.values().map(Vec::len).max().unwrap_or(0);
        // Dormant contacts are few; an atom may have all of them.
        (most.max(coming) + self.dormant.len()) * Record::reals(self.width)
    }

    /// All records of this processor, each once, those of `incoming` included, sorted by atoms.
    fn records(&mut self) -> Result<Vec<Record>, NetworkError> {
        // Of the exact size, and thinned out in place: records of all bonds at once are the most memory that is ever needed.
        let held: usize = blocks(&self.state).map(|(_, block)| block.len()).sum();
        let coming: usize = self.incoming.values().map(Vec::len).sum();
        let mut all = Vec::with_capacity(self.dormant.len() + self.fresh.len() + held + coming);
        all.append(&mut std::mem::take(&mut self.dormant));
        all.append(&mut std::mem::take(&mut self.fresh));
        for (kind, block) in blocks(&self.state) {
            all.extend((0..block.len()).filter_map(|k| record_of(&self.state, &self.tags, kind, k)));
        }
        all.extend(self.incoming.drain().flat_map(|(_, records)| records));
        // A stable order of equal keys is not needed: what has the same key must be the same.
        all.sort_unstable_by_key(Record::key);
        let differ = |pair: &&[Record]| pair[0].key() == pair[1].key() && pair[0] != pair[1];
        if let Some(pair) = all.windows(2).find(differ) {
            let [a, b] = pair[0].tags;
            return Err(NetworkError::CopiesDiffer { a, b });
        }
        all.dedup_by_key(|record| record.key());
        Ok(all)
    }

    /// Begin anew with the atoms as they are now distributed: `skin` (m) is that of LIGGGHTS' neighbour lists, `cutoff` (m)
    /// the distance up to which atoms of other processors are known, `mean_radius` (m) that of all atoms of the group.
    pub fn rebuild(&mut self, atoms: &Atoms<'_>, skin: f64, cutoff: f64, mean_radius: f64) -> Result<(), NetworkError> {
        let records = self.records()?;
        self.place(atoms)?;
        self.adjacency = None;
        let largest = self.state.particles.radius.iter().copied().fold(0.0, f64::max);
        let smallest = self.state.particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
        // As far as LIGGGHTS' own lists see.
        self.model.skin = if smallest.is_finite() { skin / smallest } else { 0.0 };
        let mut longest = if self.state.contacts.is_some() { 2.0 * largest + skin } else { 0.0 };
        let State { particles, bonds, contacts, cell, .. } = &mut self.state;
        let bonds = bonds[0].contacts_mut();
        bonds.retain_where(&|_| false);
        let mut contacts = contacts.as_mut().map(|block| block.contacts_mut());
        if let Some(block) = &mut contacts {
            block.retain_where(&|_| false);
        }
        for mut record in records {
            let [a, b] = record.tags.map(|tag| self.tags.binary_search(&tag).ok());
            if !a.is_some_and(|a| self.owned[a]) && !b.is_some_and(|b| self.owned[b]) {
                continue;
            }
            let (Some(a), Some(b)) = (a, b) else {
                if record.kind == Kind::Bond {
                    let (tag, partner) = if a.is_some() { (0, 1) } else { (1, 0) };
                    let [tag, partner] = [record.tags[tag], record.tags[partner]];
                    return Err(NetworkError::OutOfSight { tag, partner, cutoff });
                }
                self.dormant.push(record);
                continue;
            };
            let between = particles.position[b] - particles.position[a];
            let image = image_of(&between, &atoms.edge);
            let rows = if record.kind == Kind::Bond { &self.bond_rows } else { &self.model.contact_rows };
            let Some(row) = rows.get(particles.material[a], particles.material[b]) else {
                let types = [a, b].map(|p| i32::from(particles.material[p]) + 1);
                let law = if record.kind == Kind::Bond { self.options.law } else { self.options.contact.law() };
                return Err(NetworkError::NoRow {
                    a: record.tags[0],
                    b: record.tags[1],
                    law: law.map_or("none", LawName::key),
                    types,
                });
            };
            if record.is_fresh() {
                let shift = cell.map_or_else(Vec3::zeros, |cell: Cell| cell.shift(image));
                record.frame = initial_geometry(&particles.position[a], &particles.position[b], &shift);
                let length = record.reference.length;
                record.reference = Reference {
                    length: if length > 0.0 { length } else { record.frame.length },
                    area: bonds.bonded_area(row, particles.radius[a], particles.radius[b], mean_radius),
                };
            }
            longest = longest.max(record.reference.length);
            if record.flags & ContactFlags::ACTIVE != 0 {
                longest = longest.max(record.frame.length);
            }
            let elsewhere = if self.owned[a] { 0 } else { ContactFlags::NOT_OWNED };
            let link = ContactFlags { row, bits: record.flags | elsewhere, image, padding: 0 };
            let pair = Pair { a: a as u32, b: b as u32 };
            match record.kind {
                Kind::Bond => bonds.push_with_history(pair, link, record.reference, record.frame, &record.history),
                Kind::Contact => {
                    if let Some(block) = &mut contacts {
                        block.push_with_history(pair, link, record.reference, record.frame, &record.history);
                    }
                }
            }
        }
        for (axis, edge) in ['x', 'y', 'z'].into_iter().zip(atoms.edge) {
            if edge > 0.0 && edge < 2.0 * longest {
                return Err(NetworkError::BoxTooSmall { axis, edge, longest });
            }
        }
        self.state.clock.dt = atoms.dt;
        self.solver = Some(Solver::for_subdomain(self.model.clone(), &mut self.state, self.owned.clone())?);
        Ok(())
    }

    /// Particles of the state from the atoms of the group, in the order of their ids, each once.
    fn place(&mut self, atoms: &Atoms<'_>) -> Result<(), NetworkError> {
        let mut order: Vec<(i32, u32)> = Vec::with_capacity(atoms.tag.len());
        order.extend(
            atoms
                .tag
                .iter()
                .zip(atoms.mask)
                .enumerate()
                .filter(|(_, (_, mask))| *mask & atoms.group != 0)
                .map(|(i, (&tag, _))| (tag, i as u32)),
        );
        // Owned atoms come before copies of them.
        order.sort_unstable();
        if let Some(&(tag, _)) = order.first().filter(|first| first.0 <= 0) {
            return Err(NetworkError::BadTag { tag });
        }
        let both_owned = |w: &&[(i32, u32)]| w[0].0 == w[1].0 && (w[1].1 as usize) < atoms.owned;
        if let Some(twice) = order.windows(2).find(both_owned) {
            return Err(NetworkError::BadTag { tag: twice[0].0 });
        }
        order.dedup_by_key(|entry| entry.0);
        self.tags = order.iter().map(|entry| entry.0).collect();
        self.atom = order.iter().map(|entry| entry.1).collect();
        self.owned = self.atom.iter().map(|&i| (i as usize) < atoms.owned).collect();
        let particles = &mut self.state.particles;
        *particles = concordem_solver::state::Particles::default();
        for &i in &self.atom {
            let i = i as usize;
            let (radius, mass) = (atoms.radius[i], atoms.mass[i]);
            let sphere = Sphere { position: vector(atoms.position, i), radius };
            particles.push(sphere, (atoms.kind[i] - 1) as u16, mass, 0.4 * mass * (radius * radius));
        }
        self.state.cell = (atoms.edge != [0.0; 3]).then(|| {
            // Along other axes images do not occur: any length that is longer than the cloud will do.
            let extent = |axis: usize| {
                let of = |fold: fn(f64, f64) -> f64, start: f64| {
                    particles.position.iter().map(|x| x[axis]).fold(start, fold)
                };
                let span = of(f64::max, f64::NEG_INFINITY) - of(f64::min, f64::INFINITY);
                4.0 * span.max(atoms.edge.iter().copied().fold(0.0, f64::max))
            };
            let edge = Vec3::from_fn(|axis, _| if atoms.edge[axis] > 0.0 { atoms.edge[axis] } else { extent(axis) });
            Cell::new(Mat3::from_diagonal(&edge))
        });
        Ok(())
    }

    /// Make bonds between all pairs of the group nearer than the chosen factor times the sum of their radii that are not
    /// bonded yet. [`Self::rebuild`] must follow. Returns how many are counted here.
    pub fn make_near(&mut self) -> Result<usize, NetworkError> {
        let Creation::Distance(factor) = self.options.creation else { return Ok(0) };
        let particles = &self.state.particles;
        // A little more, so that the search's own rounding, which depends on what else is on this processor, decides nothing.
        let reach: Vec<f64> = particles.radius.iter().map(|r| r * factor * (1.0 + 1e-9)).collect();
        let present: std::collections::HashSet<[i32; 2]> = {
            let bonds = self.state.bonds[0].contacts();
            (0..bonds.len()).map(|k| self.tags_of(bonds.view(k).pair)).collect()
        };
        let mut made = 0;
        for pair in candidate_pairs(&particles.position, &reach, self.state.cell.as_ref())? {
            let (a, b) = (pair.a as usize, pair.b as usize);
            let tags = [self.tags[a], self.tags[b]];
            let rows = &self.bond_rows;
            let shift = self.state.cell.map_or_else(Vec3::zeros, |cell| cell.shift(pair.image));
            let distance = initial_geometry(&particles.position[a], &particles.position[b], &shift).length;
            if distance >= factor * (particles.radius[a] + particles.radius[b]) {
                continue;
            }
            if !(self.owned[a] || self.owned[b])
                || rows.get(particles.material[a], particles.material[b]).is_none()
                || present.contains(&tags)
            {
                continue;
            }
            made += usize::from(self.owned[a]);
            self.fresh.push(Record::fresh(tags, None));
        }
        Ok(made)
    }

    fn tags_of(&self, pair: Pair) -> [i32; 2] {
        [self.tags[pair.a as usize], self.tags[pair.b as usize]]
    }

    /// Turn the orientations of owned atoms by the spin of the step. Copies are to be communicated afterwards.
    pub fn turn(&self, atoms: &mut Atoms<'_>) {
        if !self.needs_orientation() {
            return;
        }
        let width = self.atom_width();
        for i in 0..atoms.owned {
            let memory = &mut atoms.memory[i * width + self.layout.orientation..][..4];
            let turned =
                normalized(&(quaternion_of_rotation_vector(&(vector(atoms.spin, i) * atoms.dt)) * orientation(memory)));
            memory.copy_from_slice(turned.coords.as_slice());
        }
    }

    /// Forces at the present positions, added to the atoms'. `setup`: nothing has moved since the step was computed, or
    /// nothing was ever computed; then what was found before is added again if it was. `sample`: sum up stored energies.
    /// `record`: keep the forces of all contacts for [`Self::recorded`].
    pub fn forces(
        &mut self,
        atoms: &mut Atoms<'_>,
        setup: bool,
        sample: bool,
        record: bool,
    ) -> Result<(), NetworkError> {
        self.broken_now.clear();
        let Some(solver) = &mut self.solver else { return Ok(()) };
        let Layout { others, orientation: oriented, dyads, end: width } = self.layout;
        let particles = &mut self.state.particles;
        for (p, &i) in self.atom.iter().enumerate() {
            let i = i as usize;
            particles.position[p] = vector(atoms.position, i);
            if setup {
                particles.velocity[p] = Vec3::zeros();
                particles.angular_velocity[p] = Vec3::zeros();
                particles.rotation_increment[p] = Quat::identity();
            } else {
                let spin = vector(atoms.spin, i);
                particles.velocity[p] = vector(atoms.velocity, i);
                particles.angular_velocity[p] = spin;
                particles.rotation_increment[p] = quaternion_of_rotation_vector(&(spin * atoms.dt));
            }
            if dyads > oriented {
                particles.orientation[p] = orientation(&atoms.memory[i * width + oriented..][..4]);
            }
        }
        let deforms = self.model.deformable.is_some();
        if deforms {
            let dyad = |i: u32, place: usize| {
                let mut reals = [0.0; 6];
                reals.copy_from_slice(&atoms.memory[i as usize * width + place..][..6]);
                Symmetric(reals)
            };
            particles.deformation.clear();
            particles.deformation.extend(self.atom.iter().map(|&i| Deformation {
                dyad: dyad(i, dyads),
                used: dyad(i, dyads + 6),
                other: dyad(i, others),
                reaction: dyad(i, others + 6),
            }));
        }
        self.state.clock.dt = atoms.dt;
        self.state.clock.step = atoms.step as u64;
        if record {
            self.recorded = solver.record(&mut self.state)?.contacts;
            self.recorded_at = Some(atoms.step);
        }
        if setup && self.found_at == Some(atoms.step) {
            for &i in self.atom.iter().filter(|&&i| (i as usize) < atoms.owned) {
                let i = i as usize;
                let memory = &atoms.memory[i * width..][..NET];
                add(atoms.force, i, &vector(memory, 0));
                add(atoms.torque, i, &vector(memory, 1));
            }
            return Ok(());
        }
        self.adjacency = None;
        let report = solver.find_forces(&mut self.state, sample)?;
        self.found_at = Some(atoms.step);
        self.dissipated += report.energy;
        if sample {
            self.stored = report.energy;
        }
        for (_, bond_event) in report.bond_events.iter().filter(|(_, bond_event)| bond_event.broke) {
            let Pair { a, b } = bond_event.pair;
            self.broken += f64::from(u8::from(self.owned[a as usize]));
            self.broken_now.push([self.tags[a as usize], self.tags[b as usize]]);
        }
        for (p, &i) in self.atom.iter().enumerate() {
            let i = i as usize;
            if i >= atoms.owned {
                continue;
            }
            let (force, torque) = (solver.forces()[p], solver.torques()[p]);
            if !(force.norm_squared() + torque.norm_squared()).is_finite() {
                return Err(NetworkError::NotFinite { step: atoms.step, tag: self.tags[p] });
            }
            let memory = &mut atoms.memory[i * width..][..NET];
            memory[..3].copy_from_slice(force.as_slice());
            memory[3..].copy_from_slice(torque.as_slice());
            if deforms {
                let memory = &mut atoms.memory[i * width..][..width];
                let Deformation { dyad, used, other, reaction } = self.state.particles.deformation[p];
                for (place, dyad) in [(dyads, dyad), (dyads + 6, used), (others, other), (others + 6, reaction)] {
                    memory[place..place + 6].copy_from_slice(&dyad.0);
                }
            }
            add(atoms.force, i, &force);
            add(atoms.torque, i, &torque);
        }
        Ok(())
    }

    /// Sums of what is counted on this processor.
    pub fn sums(&self) -> Sums {
        let bonds = self.state.bonds[0].contacts();
        let (mut count, mut longest) = (0.0, 0.0f64);
        for k in 0..bonds.len() {
            let view = bonds.view(k);
            if !view.flags.has(ContactFlags::BROKEN) {
                count += f64::from(u8::from(!view.flags.has(ContactFlags::NOT_OWNED)));
                longest = longest.max(view.previous.length).max(view.reference.length);
            }
        }
        let touching = self.state.contacts.as_ref().map_or(0, |block| {
            let block = block.contacts();
            let counts = |k: &usize| {
                let link = block.view(*k).flags;
                link.carries() && !link.has(ContactFlags::NOT_OWNED)
            };
            (0..block.len()).filter(counts).count()
        });
        for record in self.incoming.values().flatten().chain(&self.fresh).filter(|record| record.kind == Kind::Bond) {
            longest = longest.max(record.frame.length).max(record.reference.length);
        }
        let (s, d) = (&self.stored, &self.dissipated);
        Sums {
            bonds: count,
            broken: self.broken,
            contacts: touching as f64,
            stored: [s.stored_normal, s.stored_shear, s.stored_bending, s.stored_twist],
            dissipated: [d.damage, d.friction, d.viscous],
            integration: d.integration,
            longest,
        }
    }

    /// Bonds whose A is owned here, and bonds whose B is: summed over processors both are the number of bonds, if every
    /// processor sees those of its atoms.
    pub fn ends(&self) -> [f64; 2] {
        let bonds = self.state.bonds[0].contacts();
        let mut ends = [0.0; 2];
        for view in (0..bonds.len()).map(|k| bonds.view(k)).filter(|view| !view.flags.has(ContactFlags::BROKEN)) {
            for (end, p) in ends.iter_mut().zip([view.pair.a, view.pair.b]) {
                *end += f64::from(u8::from(self.owned[p as usize]));
            }
        }
        ends
    }

    /// Totals that a restart file keeps besides the bonds, to be added up over processors: bonds broken, dissipated
    /// energies, stored energies of the last sample.
    pub fn totals(&self) -> [f64; TOTALS] {
        let (d, s) = (&self.dissipated, &self.stored);
        [
            self.broken,
            d.damage,
            d.friction,
            d.viscous,
            d.integration,
            s.stored_normal,
            s.stored_shear,
            s.stored_bending,
            s.stored_twist,
        ]
    }

    /// Step whose forces the atoms' memory holds, if any.
    pub fn found_at(&self) -> Option<i64> {
        self.found_at
    }

    /// Go on from a restart file: totals to go on from on this processor, and the step whose forces it holds.
    pub fn resume(&mut self, totals: &[f64; TOTALS], found_at: Option<i64>) {
        let [broken, damage, friction, viscous, integration, normal, shear, bending, twist] = *totals;
        self.found_at = found_at;
        self.broken = broken;
        self.dissipated = EnergySplit { damage, friction, viscous, integration, ..EnergySplit::default() };
        self.stored = EnergySplit {
            stored_normal: normal,
            stored_shear: shear,
            stored_bending: bending,
            stored_twist: twist,
            ..EnergySplit::default()
        };
    }

    /// Forces of all contacts at the last step for which they were recorded.
    pub fn recorded(&self) -> &ContactForces {
        &self.recorded
    }

    /// Ids of the bonds with an end on this processor that broke when forces were last found.
    pub fn broken_now(&self) -> &[[i32; 2]] {
        &self.broken_now
    }

    /// Virial `−Σ l⊗f^A` (J) of the recorded contacts: xx, yy, zz, xy, xz, yz, branch first. Half of each contact belongs to
    /// either end, so that sums over processors are complete; `per_atom` (six reals per atom of the host) gets the halves
    /// of owned atoms added.
    pub fn virial(&self, per_atom: &mut [f64]) -> [f64; 6] {
        let mut total = [0.0; 6];
        let r = &self.recorded;
        for ((pair, l), f) in r.pair.iter().zip(&r.branch).zip(&r.force) {
            let half = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|(i, j)| -0.5 * l[i] * f[j]);
            for p in pair.map(|p| p as usize) {
                if !self.owned[p] {
                    continue;
                }
                for (sum, half) in total.iter_mut().zip(half) {
                    *sum += half;
                }
                if let Some(of_atom) = per_atom.get_mut(6 * self.atom[p] as usize..).and_then(|rest| rest.get_mut(..6))
                {
                    for (sum, half) in of_atom.iter_mut().zip(half) {
                        *sum += half;
                    }
                }
            }
        }
        total
    }

    fn recorded_at(&self, step: i64) -> Result<&ContactForces, NetworkError> {
        if self.recorded_at == Some(step) || self.solver.is_none() {
            Ok(&self.recorded)
        } else {
            Err(NetworkError::NotRecorded { step })
        }
    }

    /// Stress of owned atoms from the contacts recorded at `step`, Pa, by [`particle_moments`] and the volumes: nine reals per
    /// atom of the host, xx, xy, xz, yx, …, position first. Every contact of an owned atom is known here, so that no other
    /// processor has to add to it.
    pub fn stress(
        &self,
        step: i64,
        partition: Partition,
        volume: ParticleVolume,
        per_atom: &mut [f64],
    ) -> Result<(), NetworkError> {
        let particles = &self.state.particles;
        let contacts = self.recorded_at(step)?.set(particles)?;
        let moments = particle_moments(&contacts, &LoadSet::none(), partition);
        let volumes = volume.of(&particles.radius)?;
        for (p, (moment, volume)) in moments.iter().zip(&volumes).enumerate().filter(|(p, _)| self.owned[*p]) {
            let stress = (moment / *volume).transpose();
            per_atom[9 * self.atom[p] as usize..][..9].copy_from_slice(stress.as_slice());
        }
        Ok(())
    }

    /// Sums over the contacts recorded at `step` and counted here: `Σ l⊗f^A` (J) and the couple stress about the origin times
    /// the volume, without its axial part (N·m²), nine reals each in the order of [`Self::stress`]. To be added up over processors.
    pub fn couple_sums(&self, step: i64) -> Result<[f64; 18], NetworkError> {
        if self.state.cell.is_some() {
            return Err(NetworkError::Periodic);
        }
        let all = self.recorded_at(step)?;
        let mut counted = ContactForces::default();
        for k in (0..all.pair.len()).filter(|&k| self.owned[all.pair[k][0] as usize]) {
            counted.pair.push(all.pair[k]);
            counted.branch.push(all.branch[k]);
            counted.point.push(all.point[k]);
            counted.force.push(all.force[k]);
            counted.moment.push(all.moment[k]);
        }
        let contacts: ContactSet<'_> = counted.set(&self.state.particles)?;
        let stress = region_stress(&contacts, &Region::All { volume: 1.0 }, Truncation::BranchClipped, None)?.stress;
        // About the origin the axial part drops out.
        let couple = couple_stress::internal(&contacts, 1.0, &Vec3::zeros())?;
        let mut sums = [0.0; 18];
        sums[..9].copy_from_slice(stress.transpose().as_slice());
        sums[9..].copy_from_slice(couple.transpose().as_slice());
        Ok(sums)
    }

    /// Reals of a record of [`Self::histories`].
    pub fn record_reals(&self) -> usize {
        Record::reals(self.width)
    }

    /// What is remembered of the bonds and contacts that are counted here, record after record ([`Record::write`]).
    pub fn histories(&self) -> Vec<f64> {
        let mut reals = Vec::new();
        for (kind, block) in blocks(&self.state) {
            for k in (0..block.len()).filter(|&k| !block.view(k).flags.has(ContactFlags::NOT_OWNED)) {
                if let Some(record) = record_of(&self.state, &self.tags, kind, k) {
                    record.write(self.width, &mut reals);
                }
            }
        }
        reals
    }

    /// Number of reals in a row of [`Self::rows`].
    pub const ROW: usize = 16;

    /// The recorded contacts that are counted here: ids of A and B, force on A (N), moment on A about the contact point
    /// (N·m), contact point (m), length (m), area (m²), damage, whether it is a bond, row after row.
    pub fn rows(&self) -> Vec<f64> {
        let mut rows = Vec::new();
        let r = &self.recorded;
        let mut row = 0;
        for ((_, block), &end) in blocks(&self.state).zip(&r.block_end) {
            while row < end {
                let [a, b] = r.pair[row];
                let pair = Pair { a, b };
                // A contact may have gone since (its bond broke): then its place says nothing any more.
                let k = r.place[row] as usize;
                let still = k < block.len() && block.view(k).pair == pair;
                let [a, b] = [a as usize, b as usize];
                if self.owned.get(a) == Some(&true) && b < self.tags.len() {
                    let [ta, tb] = self.tags_of(pair);
                    let (area, damage, bonded) = if still {
                        let view = block.view(k);
                        (view.reference.area, block.damage(k), f64::from(u8::from(view.flags.has(ContactFlags::BONDED))))
                    } else {
                        (0.0, 1.0, 0.0)
                    };
                    rows.extend([f64::from(ta), f64::from(tb)]);
                    rows.extend(r.force[row].iter());
                    rows.extend(r.moment[row].iter());
                    rows.extend(r.point[row].iter());
                    rows.extend([r.branch[row].norm(), area, damage, bonded, 0.0]);
                }
                row += 1;
            }
        }
        rows
    }
}

/// Orientation as it is stored: x, y, z, w.
fn orientation(memory: &[f64]) -> Quat {
    Quat::new(memory[3], memory[0], memory[1], memory[2])
}

/// The blocks of a state with their kinds.
fn blocks(state: &State) -> impl Iterator<Item = (Kind, &dyn Contacts)> {
    let bonds = state.bonds.iter().map(|block| (Kind::Bond, block.contacts()));
    bonds.chain(state.contacts.iter().map(|block| (Kind::Contact, block.contacts())))
}

/// Contact `k` of a block as a record, if it must not be forgotten.
fn record_of(state: &State, tags: &[i32], kind: Kind, k: usize) -> Option<Record> {
    let block = match kind {
        Kind::Bond => state.bonds[0].contacts(),
        Kind::Contact => state.contacts.as_ref()?.contacts(),
    };
    let view = block.view(k);
    let remembers = view.flags.bits & (ContactFlags::ACTIVE | ContactFlags::KEPT_REFERENCE) != 0;
    if view.flags.has(ContactFlags::BROKEN) || !remembers {
        return None;
    }
    let (fields, reals) = block.history_reals();
    let width: usize = fields.iter().map(|field| field.components).sum();
    let mut history = [0.0; HISTORY];
    history[..width].copy_from_slice(&reals[k * width..(k + 1) * width]);
    // What a contact remembers while it does not touch is of no consequence, and differs between processors.
    let frame = if view.flags.has(ContactFlags::ACTIVE) {
        view.previous
    } else {
        PreviousGeometry { normal: Vec3::x(), length: 1.0 }
    };
    Some(Record {
        tags: [tags[view.pair.a as usize], tags[view.pair.b as usize]],
        kind,
        flags: view.flags.bits & !ContactFlags::NOT_OWNED,
        reference: view.reference,
        frame,
        history,
    })
}

/// For each particle, where its contacts that must not be forgotten begin in the list.
fn adjacency(state: &State) -> Adjacency {
    let mut start = vec![0u32; state.particles.len() + 1];
    let each = |visit: &mut dyn FnMut(Pair, Kind, u32)| {
        for (kind, block) in blocks(state) {
            for k in 0..block.len() {
                let view = block.view(k);
                if view.flags.bits & (ContactFlags::ACTIVE | ContactFlags::KEPT_REFERENCE) != 0
                    && !view.flags.has(ContactFlags::BROKEN)
                {
                    visit(view.pair, kind, k as u32);
                }
            }
        }
    };
    each(&mut |pair, _, _| {
        start[pair.a as usize + 1] += 1;
        start[pair.b as usize + 1] += 1;
    });
    for p in 1..start.len() {
        start[p] += start[p - 1];
    }
    let mut next = start.clone();
    let mut contacts = vec![(Kind::Bond, 0); *start.last().unwrap_or(&0) as usize];
    each(&mut |pair, kind, k| {
        for p in [pair.a, pair.b] {
            contacts[next[p as usize] as usize] = (kind, k);
            next[p as usize] += 1;
        }
    });
    (start, contacts)
}

/// Image of B nearest to A for the difference of their positions; 0 where the box is not periodic.
fn image_of(between: &Vec3, edge: &[f64; 3]) -> [i8; 3] {
    [0, 1, 2].map(|axis| if edge[axis] > 0.0 { -(between[axis] / edge[axis]).round() as i8 } else { 0 })
}
