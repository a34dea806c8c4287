//! The bonds and contacts of one processor's atoms.
//!
//! A processor stores and evaluates every bond and contact with at least one owned atom, so forces need not be communicated. A bond
//! between atoms of two processors is evaluated on both, from the same numbers by the same function, with bitwise equal results. An
//! atom that migrates takes its bonds along. Within a processor, atoms are ordered along a space-filling curve, and forces are summed in
//! that order ([`Solver::for_subdomain`]). Each atom keeps the place that it had when it was new, so the net force on an atom does not
//! depend on the number of processors. It depends on ids only if two atoms have the same place.
//!
//! | module | contains |
//! |---|---|
//! | `before` | the particles before a rebuild |
//! | `bonds` | bonds as the host lists them, and new ones |
//! | `create` | new bonds |
//! | `limit` | new bonds if an atom may have a few |
//! | `lists` | bonds of the host's lists; pairs of the host's neighbor lists that belong to the network |
//! | `memory` | data stored per atom in the host's arrays |
//! | `exchange` | records of bonds and contacts for migration and restart |
//! | `exclude` | pairs that the host takes out of the contacts |
//! | `heat` | heat conduction along bonds, and their expansion |
//! | `heat_network` | the file of `heat_network`, of which each processor keeps a share |
//! | `lost` | bonds of atoms that no longer exist |
//! | `rebuild` | the state after migration |
//! | `resize` | contacts of atoms whose radii change |
//! | `results` | counts, energies, virial, stress |

mod before;
mod bonds;
mod create;
mod error;
mod exchange;
mod exclude;
mod heat;
mod heat_network;
mod limit;
mod lists;
mod lost;
mod memory;
mod rebuild;
mod resize;
mod results;

use concordem_contact::kinematics::deformable::{Deformable, Update};
use concordem_contact::law::{EnergySplit, LawName};
use concordem_contact::material::Material;
use concordem_solver::forces::EvaluatedContacts;
use concordem_solver::laws;
use concordem_solver::record::ContactForces;
use concordem_solver::state::State;
use concordem_solver::state::contacts::{Contacts, Pair};
use concordem_solver::{Excluded, Model, PairCoefficients, Solver, Strengths};

pub use bonds::BondsOfAtom;
use bonds::Fresh;
use create::UserList;
pub use error::NetworkError;
use exchange::{Adjacency, Incoming, Pieces};
pub use exclude::{Exclusions, Rules};
use heat::Thermal;
pub use heat_network::Asked;
use limit::Choice;
pub use lists::NeighborLists;
use memory::Layout;
use results::row_of_break;
pub use results::{BREAK, Sums, TOTALS};

use crate::atoms::{Atoms, Tag};
use crate::options::Options;
use crate::records::{Kind, Record, THERMAL, ascending};

/// Bonds and contacts of the atoms of one processor.
pub struct Network {
    options: Options,
    model: Model,
    layout: Layout,
    /// Parameters of bonds by pairs of atom types; or by bond types, each as a pair with itself.
    bond_coefficients: PairCoefficients,
    /// Reals in the history of a bond or contact, with what it keeps for heat.
    width: usize,
    state: State,
    solver: Option<Solver>,
    /// Heat conduction, if there is any.
    thermal: Option<Thermal>,
    /// Id of each particle of the state.
    tags: Vec<Tag>,
    /// The particles in the order of their ids.
    by_tag: Vec<u32>,
    /// Index of its atom in the host's arrays.
    atom: Vec<u32>,
    /// Whether this processor owns it.
    owned: Vec<bool>,
    /// Records that arrived with atoms since the last rebuild.
    incoming: Incoming,
    /// Compact records of a restart file, of atoms on any processor, until they are delivered.
    restored: Vec<f64>,
    /// Those of the atoms of this processor, until the next rebuild.
    delivered: Vec<f64>,
    /// Records on their way to a restart file.
    pieces: Pieces,
    /// The file of `bond list FILE`, until its bonds are created.
    user_list: UserList,
    /// Bonds to create at the next rebuild, which drops those without an owned atom.
    fresh: Vec<Fresh>,
    /// Pairs among which `limit N` chooses, while bonds are created.
    choice: Choice,
    /// Contacts with the history of a broken bond whose other atom is out of range.
    dormant: Vec<Record>,
    /// Bonds that another command added to the host's lists, until they are created.
    added: Vec<[Tag; 3]>,
    /// Particle of each of the host's atoms, `u32::MAX` for atoms outside the group; computed on demand.
    particle_of: Vec<u32>,
    /// Increases whenever the bonds or the numbers of atoms change.
    generation: i64,
    /// By how much radii may have grown since the last rebuild, m.
    grown: f64,
    /// What the host takes out of the unbonded contacts.
    exclusions: Exclusions,
    /// The same for the present particles.
    without_contacts: Excluded,
    /// Ids of atoms that no longer exist, ascending; the next rebuild drops their bonds.
    gone: Vec<Tag>,
    /// Contacts of each particle, computed on demand.
    adjacency: Option<Adjacency>,
    /// Forces of all contacts at the step `recorded_at`.
    recorded: ContactForces,
    recorded_at: Option<i64>,
    /// Rows of [`Self::take_breaks`] since the last call; `None` unless something asks for them.
    breaks: Option<Vec<f64>>,
    /// Broken bonds that this processor counted.
    broken: f64,
    dissipated: EnergySplit,
    stored: EnergySplit,
    /// Step of the net forces stored with the atoms.
    found_at: Option<i64>,
    /// Atom ids of the bonds that broke in the last force computation, the lower one first, including bonds that another processor counts.
    broken_now: Vec<[Tag; 2]>,
}

impl Network {
    /// A network without bonds.
    ///
    /// # Errors
    /// Invalid parameters for the law.
    pub fn new(options: Options) -> Result<Self, NetworkError> {
        // Without bonds the block stays empty, but its law still determines the record size in restart files.
        let law = options.law.unwrap_or(LawName::LinearBond);
        let (block, bond_coefficients) = if options.bond_types.is_empty() {
            laws::block(law, &options.materials, &options.interfaces)?
        } else {
            laws::block(law, &options.bond_types, &[])?
        };
        let contacts = laws::contact_block(options.contact, &options.materials, &options.interfaces)?;
        let width = |block: &dyn EvaluatedContacts| {
            block.contacts().history_fields().iter().map(|field| field.components).sum::<usize>()
        };
        let reals = width(&*block).max(contacts.as_ref().map_or(0, |(block, _)| width(&**block)));
        let strengths =
            Strengths { by_bond: Material::scatter_of_strengths(&options.materials), by_particle: Vec::new() };
        let mut model = Model { mode: options.mode, skin: 0.0, strengths, ..Model::default() };
        model.deformable = options.deformable.map(|condition| Deformable {
            elasticity: options.materials.iter().map(Material::elasticity).collect(),
            condition,
            update: Update::Lagged,
            dashpots: false,
        });
        let mut blocks = std::iter::once(&block).chain(contacts.as_ref().map(|(block, _)| block));
        let oriented = blocks.any(|block| block.contacts().reads_orientations());
        let thermal = options.heat.clone().map(Thermal::new);
        let of_file = options.heat.as_ref().is_some_and(|heat| heat.network.is_some());
        let heat_reals = if thermal.is_none() { 0 } else { 1 + if of_file { 2 } else { 0 } };
        let layout = Layout::new(oriented, model.deformable.is_some(), heat_reals);
        let reals = reals + if thermal.is_some() { THERMAL } else { 0 };
        let mut state = State { bonds: vec![block], ..State::default() };
        if let Some((block, rows)) = contacts {
            model.contact_rows = rows;
            state.contacts = Some(block);
        }
        Ok(Self {
            options,
            model,
            layout,
            bond_coefficients,
            width: reals,
            state,
            solver: None,
            thermal,
            tags: Vec::new(),
            by_tag: Vec::new(),
            atom: Vec::new(),
            owned: Vec::new(),
            incoming: Incoming::default(),
            restored: Vec::new(),
            delivered: Vec::new(),
            pieces: Pieces::default(),
            user_list: UserList::default(),
            fresh: Vec::new(),
            choice: Choice::default(),
            dormant: Vec::new(),
            added: Vec::new(),
            particle_of: Vec::new(),
            generation: 0,
            grown: 0.0,
            exclusions: Exclusions::default(),
            without_contacts: Excluded::default(),
            gone: Vec::new(),
            adjacency: None,
            recorded: ContactForces::default(),
            recorded_at: None,
            breaks: None,
            broken: 0.0,
            dissipated: EnergySplit::default(),
            stored: EnergySplit::default(),
            found_at: None,
            broken_now: Vec::new(),
        })
    }

    /// The parsed arguments.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Whether atoms need an orientation.
    pub fn needs_orientation(&self) -> bool {
        self.layout.has_orientation()
    }

    /// Compute forces at the current positions and add them to the atoms' forces. `setup`: the host sets up a run and nothing moves;
    /// if the forces of this step are stored, add those instead. `sample`: sum stored energies. `record`: keep the force of every
    /// contact.
    ///
    /// # Errors
    /// An error of the solver, or a force that is not finite.
    pub fn forces(
        &mut self,
        atoms: &mut Atoms<'_>,
        setup: bool,
        sample: bool,
        record: bool,
    ) -> Result<(), NetworkError> {
        self.broken_now.clear();
        if self.solver.is_none() {
            return Ok(());
        }
        self.read_atoms(atoms, setup)?;
        self.expand();
        let Some(solver) = &mut self.solver else { return Ok(()) };
        self.state.clock.dt = atoms.dt;
        self.state.clock.step = atoms.step as u64;
        let evaluated = setup && self.found_at == Some(atoms.step);
        if record {
            // The forces of this step are known, dashpots included, if a run ended with it.
            self.recorded = ContactForces::default();
            let forces = if evaluated { solver.last_forces(&self.state) } else { solver.record(&mut self.state)? };
            self.recorded = forces.contacts;
            self.recorded_at = Some(atoms.step);
        } else if self.recorded_at.take().is_some() {
            // They take almost as much memory as the bonds.
            self.recorded = ContactForces::default();
        }
        if evaluated {
            self.add_stored_forces(atoms);
            return Ok(());
        }
        self.adjacency = None;
        let report = solver.find_forces(&mut self.state, sample)?;
        self.found_at = Some(atoms.step);
        self.dissipated += report.energy;
        if sample {
            self.stored = report.energy;
        }
        for (_, bond_event) in &report.bond_events {
            let Pair { a, b } = bond_event.pair;
            let tags = ascending([self.tags[a as usize], self.tags[b as usize]]);
            if bond_event.broke {
                self.broken_now.push(tags);
            }
            // A bond that failed under pressure is broken, though it lives on as a contact.
            if bond_event.fails {
                self.broken += f64::from(u8::from(self.owned[a as usize]));
                if let Some(breaks) = self.breaks.as_mut().filter(|_| self.owned[a as usize]) {
                    breaks.extend(row_of_break(tags, atoms.step, bond_event));
                }
            }
        }
        if !self.broken_now.is_empty() {
            self.generation += 1;
            self.bonds_broke();
        }
        self.write_atoms(atoms)
    }

    /// The particle of an atom.
    fn particle(&self, tag: Tag) -> Option<usize> {
        particle_of(&self.tags, &self.by_tag, tag)
    }

    /// The block of bonds or contacts, if there is one.
    fn block(&self, kind: Kind) -> Option<&dyn Contacts> {
        match kind {
            Kind::Bond => self.state.bonds.first(),
            Kind::Contact => self.state.contacts.as_ref(),
        }
        .map(|block| block.contacts())
    }

    fn block_mut(&mut self, kind: Kind) -> Option<&mut dyn Contacts> {
        match kind {
            Kind::Bond => self.state.bonds.first_mut(),
            Kind::Contact => self.state.contacts.as_mut(),
        }
        .map(|block| block.contacts_mut())
    }
}

/// The particle with an id; `by_tag`: the particles in the order of their ids.
fn particle_of(tags: &[Tag], by_tag: &[u32], tag: Tag) -> Option<usize> {
    by_tag.binary_search_by_key(&tag, |&p| tags[p as usize]).ok().map(|k| by_tag[k] as usize)
}

/// The contact blocks of a state with their kinds; bonds come first.
fn blocks(state: &State) -> impl Iterator<Item = (Kind, &dyn Contacts)> {
    let bonds = state.bonds.iter().map(|block| (Kind::Bond, block.contacts()));
    bonds.chain(state.contacts.iter().map(|block| (Kind::Contact, block.contacts())))
}

#[cfg(test)]
mod tests;
