//! Builds the solver's state from the atoms and bonds of a processor after migration. Bonds and contacts that stay keep their place in
//! memory, because copies of all of them would double it; only those that arrive or are new are added.

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::kinematics::sphere_sphere::initial_geometry;
use concordem_contact::law::{LawName, Reference};
use concordem_contact::math::{Mat3, Vec3};
use concordem_solver::Solver;
use concordem_solver::heat::network::NearPair;
use concordem_solver::state::contacts::{ContactFlags, Pair, ReadContacts};
use concordem_solver::state::{Cell, Particles, Sphere, State};

use super::before::{ABSENT, Before};
use super::bonds::{BondsOfAtom, Fresh};
use super::exchange::Arriving;
use super::memory::inertia;
use super::{Network, NetworkError, blocks};
use crate::atoms::{Atoms, LARGEST_TAG, Tag, vector};
use crate::records::{HISTORY, Kind};

/// New bonds.
#[derive(Default)]
struct Placed {
    /// The longest length, m.
    longest: f64,
    /// Their pairs.
    bonded: Vec<Pair>,
    /// With heat conduction: ids and reference length (m) at the reference temperature of each bond.
    lengths: Vec<([Tag; 2], f64)>,
    /// With heat conduction: particles, and the vector between their centers.
    pairs: Vec<NearPair>,
}

/// What happens to a bond or contact when atoms have migrated.
enum Fate {
    /// Its atoms left.
    Leaves,
    /// One atom is owned; the other one is unknown.
    Alone,
    /// It stays between these particles.
    Stays([usize; 2]),
}

impl Network {
    /// Rebuild the state for the current distribution of atoms. `skin` (m): skin of the host's neighbor lists. `cutoff` (m): distance
    /// up to which ghosts exist. `mean_radius` (m): mean radius of the bonded atoms; only new bonds need it. `lists`: the host's bond lists of
    /// the owned atoms, if bonds follow them.
    ///
    /// # Errors
    /// An atom without parameters, a bond to an atom that does not exist here, a periodic box that is too small, or invalid ids.
    pub fn rebuild(
        &mut self,
        atoms: &mut Atoms<'_>,
        skin: f64,
        cutoff: f64,
        mean_radius: f64,
        lists: Option<&[BondsOfAtom<'_>]>,
    ) -> Result<(), NetworkError> {
        self.check_ids(atoms)?;
        self.grown = 0.0;
        let mut arriving = self.arriving()?;
        let mut fresh = self.take_fresh(&arriving)?;
        for block in self.state.bonds.iter_mut().chain(&mut self.state.contacts) {
            // Bonds that broke, and contacts without history, which the solver finds again.
            let remembers = ContactFlags::ACTIVE | ContactFlags::KEPT_REFERENCE;
            block.contacts_mut().retain_where(&|flags| flags.bits & remembers != 0 && !flags.has(ContactFlags::BROKEN));
        }
        let before = Before { tags: std::mem::take(&mut self.tags), by_tag: std::mem::take(&mut self.by_tag) };
        self.drop_gone(&before, &mut arriving);
        self.place_particles(atoms)?;
        self.place_heat(atoms)?;
        let number = before.renumbering(&self.tags, &self.by_tag);
        self.adjacency = None;
        self.particle_of.clear();
        self.generation += 1;
        if let Some(lists) = lists {
            self.follow_lists(lists, &before, &number, &mut arriving, &mut fresh)?;
        }
        let largest = self.state.particles.radius.iter().copied().fold(0.0, f64::max);
        let smallest = self.state.particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
        // Same range as the host's lists.
        self.model.skin = if smallest.is_finite() { skin / smallest } else { 0.0 };
        let mut longest = if self.state.contacts.is_some() { 2.0 * largest + skin } else { 0.0 };
        longest = longest.max(self.check_held(&before, &number, cutoff)?);
        self.relink(&number, &atoms.edge);
        // Those that are sorted; what follows is added behind them.
        let held = [Kind::Bond, Kind::Contact].map(|kind| self.block(kind).map_or(0, ReadContacts::len));
        let thermal = self.thermal_of(&arriving);
        longest = longest.max(self.place_arriving(&arriving, held, &atoms.edge, cutoff)?);
        // Before the solver takes its memory.
        drop(arriving);
        let new = self.place_fresh(&fresh, held[0], [cutoff, mean_radius], &atoms.edge)?;
        longest = longest.max(new.longest);
        // The solver sorts bonds, but takes contacts as sorted.
        if let Some(contacts) = self.block_mut(Kind::Contact) {
            contacts.sort();
        }
        drop(fresh);
        for (axis, edge) in ['x', 'y', 'z'].into_iter().zip(atoms.edge) {
            if edge > 0.0 && edge < 2.0 * longest {
                return Err(NetworkError::BoxTooSmall { axis, edge, longest });
            }
        }
        self.state.clock.dt = atoms.dt;
        let (owned, excluded) = (self.owned.clone(), self.excluded());
        self.drop_contacts(&excluded, &new.bonded);
        self.without_contacts = excluded.clone();
        self.solver = Some(Solver::for_subdomain(self.model.clone(), &mut self.state, owned, excluded)?);
        self.place_thermal_bonds(thermal, &new.lengths, &new.pairs)
    }

    /// What happens to a bond or contact between particles `ends`, which may be [`ABSENT`].
    fn fate(owned: &[bool], ends: [u32; 2]) -> Fate {
        if !ends.iter().any(|&p| p != ABSENT && owned[p as usize]) {
            return Fate::Leaves;
        }
        if ends.contains(&ABSENT) { Fate::Alone } else { Fate::Stays(ends.map(|p| p as usize)) }
    }

    /// The bond of `tags` cannot stay alone.
    fn out_of_sight(&self, tags: [Tag; 2], cutoff: f64) -> NetworkError {
        let knows_first = self.particle(tags[0]).is_some();
        let [tag, partner] = if knows_first { tags } else { [tags[1], tags[0]] };
        NetworkError::OutOfSight { tag, partner, cutoff }
    }

    /// Particles of two atoms.
    fn ends_of(&self, tags: [Tag; 2]) -> [u32; 2] {
        tags.map(|tag| self.particle(tag).map_or(ABSENT, |p| p as u32))
    }

    /// Row of the pair coefficients between particles `a` and `b`; `row` is that of a bond whose parameters belong to its type.
    fn row_of(&self, kind: Kind, [a, b]: [usize; 2], row: u16) -> Result<u16, NetworkError> {
        let coefficients = if kind == Kind::Bond { &self.bond_coefficients } else { &self.model.contact_rows };
        let particles = &self.state.particles;
        if kind == Kind::Bond && !self.options.bond_types.is_empty() {
            return Ok(row);
        }
        coefficients.get(particles.material[a], particles.material[b]).ok_or_else(|| {
            let law = if kind == Kind::Bond { self.options.law } else { self.options.contact.law() };
            NetworkError::NoRow {
                a: self.tags[a],
                b: self.tags[b],
                law: law.map_or("none", LawName::key),
                types: [a, b].map(|p| i32::from(particles.material[p]) + 1),
            }
        })
    }

    /// Whether no bond or contact can lack pair coefficients: all materials of the particles have some with each other, or they belong to bond
    /// types.
    fn all_rows_exist(&self, kind: Kind) -> bool {
        let coefficients = if kind == Kind::Bond { &self.bond_coefficients } else { &self.model.contact_rows };
        if kind == Kind::Bond && !self.options.bond_types.is_empty() {
            return true;
        }
        let mut present = vec![false; self.options.materials.len()];
        for &material in &self.state.particles.material {
            match present.get_mut(material as usize) {
                Some(present) => *present = true,
                None => return false,
            }
        }
        let present: Vec<u16> = (0..).zip(present).filter_map(|(material, is)| is.then_some(material)).collect();
        present.iter().all(|&a| present.iter().all(|&b| coefficients.get(a, b).is_some()))
    }

    /// Check that held bonds and contacts can stay or leave, and set contacts aside whose other atom is unknown. Returns the longest
    /// length of those that stay (m).
    fn check_held(&mut self, before: &Before, number: &[u32], cutoff: f64) -> Result<f64, NetworkError> {
        let (mut longest, mut alone) = (0.0f64, Vec::new());
        for (kind, block) in blocks(&self.state) {
            let all_rows_exist = self.all_rows_exist(kind);
            let geometries = block.references().iter().zip(block.previous().iter());
            for (k, ((pair, flags), (reference, previous))) in
                block.pairs().iter().zip(block.flags()).zip(geometries).enumerate()
            {
                match Self::fate(&self.owned, [pair.a, pair.b].map(|p| number[p as usize])) {
                    Fate::Leaves => {}
                    Fate::Alone if kind == Kind::Bond => {
                        return Err(self.out_of_sight(before.tags_of(*pair), cutoff));
                    }
                    Fate::Alone => alone.extend(self.record_of(&before.tags, kind, k)),
                    Fate::Stays(ends) => {
                        if !all_rows_exist {
                            self.row_of(kind, ends, flags.row)?;
                        }
                        longest = longest.max(length_of(*flags, &reference, &previous));
                    }
                }
            }
        }
        self.dormant = alone;
        Ok(longest)
    }

    /// Give the contacts that stay their new particles, and remove the others. Atoms keep their order, so the contacts stay sorted.
    fn relink(&mut self, number: &[u32], edge: &[f64; 3]) {
        let by_bond_type = !self.options.bond_types.is_empty();
        let State { particles, bonds, contacts, .. } = &mut self.state;
        let (position, material, owned) = (&particles.position, &particles.material, &self.owned);
        let with_rows = bonds.iter_mut().map(|block| (block, &self.bond_coefficients, by_bond_type));
        for (block, rows, keeps_row) in
            with_rows.chain(contacts.iter_mut().map(|block| (block, &self.model.contact_rows, false)))
        {
            block.contacts_mut().relink(&|pair, mut flags| {
                let Fate::Stays([a, b]) = Self::fate(owned, [pair.a, pair.b].map(|p| number[p as usize])) else {
                    return None;
                };
                if !keeps_row {
                    flags.row = rows.get(material[a], material[b]).unwrap_or(flags.row);
                }
                flags.image = image_of(&(position[b] - position[a]), edge);
                flags.bits = ownership(flags.bits, owned[a]);
                Some((Pair { a: a as u32, b: b as u32 }, flags))
            });
        }
    }

    /// Add the sorted records that arrived with atoms, except those of contacts that are held already, which must be equal. `held`: number
    /// of held bonds and contacts. Returns the longest length (m).
    fn place_arriving(
        &mut self,
        arriving: &Arriving,
        held: [usize; 2],
        edge: &[f64; 3],
        cutoff: f64,
    ) -> Result<f64, NetworkError> {
        let mut longest = 0.0f64;
        for kind in [Kind::Bond, Kind::Contact] {
            let count = arriving.count(kind);
            if let Some(block) = self.block_mut(kind) {
                block.reserve(count);
            }
        }
        for k in 0..arriving.len() {
            let mut record = arriving.get(k);
            let [a, b] = match Self::fate(&self.owned, self.ends_of(record.tags)) {
                Fate::Leaves => continue,
                Fate::Alone if record.kind == Kind::Bond => return Err(self.out_of_sight(record.tags, cutoff)),
                Fate::Alone => {
                    self.dormant.push(record);
                    continue;
                }
                Fate::Stays(ends) => ends,
            };
            if a >= b {
                return Err(NetworkError::BadRecord { tag: record.tags[0] });
            }
            record.row = self.row_of(record.kind, [a, b], record.row)?;
            let pair = Pair { a: a as u32, b: b as u32 };
            let Some(block) = self.block(record.kind) else { continue };
            if let Ok(k) = block.pairs()[..held[record.kind as usize]].binary_search(&pair) {
                if self.record_of(&self.tags, record.kind, k) != Some(record) {
                    let [a, b] = record.tags;
                    return Err(NetworkError::CopiesDiffer { a, b });
                }
                continue;
            }
            let position = &self.state.particles.position;
            let flags = ContactFlags {
                row: record.row,
                bits: ownership(record.flags, self.owned[a]),
                image: image_of(&(position[b] - position[a]), edge),
                padding: 0,
            };
            longest = longest.max(length_of(flags, &record.reference, &record.frame));
            if let Some(block) = self.block_mut(record.kind) {
                block.push_with_history(pair, flags, record.reference, record.frame, &record.history);
            }
        }
        Ok(longest)
    }

    /// Measure and add new bonds; the first `held` bonds are older.
    fn place_fresh(
        &mut self,
        fresh: &[Fresh],
        held: usize,
        [cutoff, mean_radius]: [f64; 2],
        edge: &[f64; 3],
    ) -> Result<Placed, NetworkError> {
        let (mut placed, has_contacts) = (Placed::default(), self.state.contacts.is_some());
        self.state.bonds[0].contacts_mut().reserve(fresh.len());
        for bond in fresh {
            let [a, b] = match Self::fate(&self.owned, self.ends_of(bond.tags)) {
                Fate::Leaves => continue,
                Fate::Alone => return Err(self.out_of_sight(bond.tags, cutoff)),
                Fate::Stays([a, b]) => [a.min(b), a.max(b)],
            };
            let row = self.row_of(Kind::Bond, [a, b], bond.row)?;
            let State { particles, bonds, cell, heat, .. } = &mut self.state;
            let block = bonds[0].contacts_mut();
            let pair = Pair { a: a as u32, b: b as u32 };
            // take_fresh has compared those that arrived.
            if block.pairs()[..held].binary_search(&pair).is_ok() {
                let [a, b] = bond.tags;
                return Err(NetworkError::CopiesDiffer { a, b });
            }
            let image = image_of(&(particles.position[b] - particles.position[a]), edge);
            let shift = cell.map_or_else(Vec3::zeros, |cell: Cell| cell.shift(image));
            let previous = initial_geometry(&particles.position[a], &particles.position[b], &shift);
            let area = block.bonded_area(row, particles.radius[a], particles.radius[b], mean_radius);
            if mean_radius == 0.0 && area == 0.0 {
                let [a, b] = bond.tags;
                return Err(NetworkError::NoMeanRadius { a, b });
            }
            let mut reference =
                Reference { length: if bond.length > 0.0 { bond.length } else { previous.length }, area };
            let (length, longest) = (reference.length, block.longest_bond(row));
            if length >= longest {
                let [a, b] = bond.tags;
                return Err(NetworkError::LongBond { a, b, length, longest });
            }
            if let (Some(thermal), Some(heat)) = (&self.thermal, heat) {
                placed.lengths.push(([self.tags[a], self.tags[b]], reference.length));
                placed.pairs.push((pair.a, pair.b, previous.normal * previous.length));
                if thermal.expands() {
                    reference.length = thermal.length(particles, heat, [a, b], reference.length);
                }
            }
            let bits = ownership(ContactFlags::BONDED | ContactFlags::ACTIVE, self.owned[a]);
            let flags = ContactFlags { row, bits, image, padding: 0 };
            placed.longest = placed.longest.max(length_of(flags, &reference, &previous));
            if has_contacts {
                placed.bonded.push(pair);
            }
            block.push_with_history(pair, flags, reference, previous, &[0.0; HISTORY]);
        }
        Ok(placed)
    }

    /// Create one particle per atom of the group, in the order of their places, then of their ids. An owned atom has priority over its
    /// ghosts.
    fn place_particles(&mut self, atoms: &Atoms<'_>) -> Result<(), NetworkError> {
        let mut order: Vec<(u64, Tag, u32)> = Vec::with_capacity(atoms.tag.len());
        order.extend(
            atoms
                .tag
                .iter()
                .zip(atoms.mask)
                .enumerate()
                .filter(|(_, (_, mask))| *mask & atoms.group != 0)
                .map(|(i, (tag, _))| (self.place_of(atoms, i), tag, i as u32)),
        );
        order.sort_unstable();
        if let Some(&(_, tag, _)) = order.iter().find(|entry| !(1..=LARGEST_TAG).contains(&entry.1)) {
            return Err(NetworkError::BadTag { tag });
        }
        // An atom and its ghosts have the same place.
        order.dedup_by(|next, kept| next.1 == kept.1 && next.2 as usize >= atoms.owned);
        self.tags = order.iter().map(|entry| entry.1).collect();
        self.atom = order.iter().map(|entry| entry.2).collect();
        drop(order);
        let tags = &self.tags;
        // Together with their ids, so that comparisons read no other memory.
        let mut by_tag: Vec<(Tag, u32)> = tags.iter().copied().zip(0..).collect();
        by_tag.sort_unstable();
        self.by_tag = by_tag.into_iter().map(|(_, p)| p).collect();
        let is_twice = |w: &&[u32]| tags[w[0] as usize] == tags[w[1] as usize];
        if let Some(twice) = self.by_tag.windows(2).find(is_twice) {
            return Err(NetworkError::BadTag { tag: tags[twice[0] as usize] });
        }
        self.owned = self.atom.iter().map(|&i| (i as usize) < atoms.owned).collect();
        let particles = &mut self.state.particles;
        *particles = Particles::default();
        particles.reserve(self.atom.len());
        for &i in &self.atom {
            let i = i as usize;
            atoms.check_sphere(i)?;
            let (radius, mass) = (atoms.radius[i], atoms.effective_mass[i]);
            let sphere = Sphere { position: vector(atoms.position, i), radius };
            particles.push(sphere, (atoms.kind[i] - 1) as u16, mass, inertia(mass, radius));
            // Numbers from 0, as the particles of a scenario have, from which strengths that scatter follow.
            *particles.id.last_mut().expect("just pushed") = (atoms.tag.get(i) - 1) as u32;
        }
        self.state.cell = (atoms.edge != [0.0; 3]).then(|| {
            // The other axes have no periodic images, so any edge longer than the extent of the atoms works.
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
}

/// The larger of the reference and, if it carries a force, current length of a contact (m).
fn length_of(flags: ContactFlags, reference: &Reference, previous: &PreviousGeometry) -> f64 {
    let current = if flags.has(ContactFlags::ACTIVE) { previous.length } else { 0.0 };
    reference.length.max(current)
}

/// Flags of a contact whose A this processor owns or not.
fn ownership(bits: u8, owned: bool) -> u8 {
    if owned { bits & !ContactFlags::NOT_OWNED } else { bits | ContactFlags::NOT_OWNED }
}

/// Periodic image of B closest to A; `between` is the position of B minus that of A. 0 along axes that are not periodic.
fn image_of(between: &Vec3, edge: &[f64; 3]) -> [i8; 3] {
    [0, 1, 2].map(|axis| if edge[axis] > 0.0 { -(between[axis] / edge[axis]).round() as i8 } else { 0 })
}
