//! Bonds and contacts as records: for migration to another processor, for restart files, and across rebuilds.

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::math::Vec3;
use concordem_solver::state::State;
use concordem_solver::state::contacts::{ContactFlags, Pair};

use super::{Network, NetworkError, blocks};
use crate::atoms::Tag;
use crate::records::{HISTORY, Kind, Record, THERMAL};

/// Contacts per particle in compressed rows: the start of each particle's contacts, then the contacts.
pub(super) type Adjacency = (Vec<u32>, Vec<Link>);

/// A contact: its block, and its index there.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Link(u32);

impl Link {
    /// Set for unbonded contacts.
    const CONTACT: u32 = 1 << 31;

    fn new(kind: Kind, k: u32) -> Self {
        Self(if kind == Kind::Contact { k | Self::CONTACT } else { k })
    }

    pub(super) fn kind(self) -> Kind {
        if self.0 & Self::CONTACT == 0 { Kind::Bond } else { Kind::Contact }
    }

    pub(super) fn index(self) -> usize {
        (self.0 & !Self::CONTACT) as usize
    }
}

impl Network {
    /// Read the records of atom `tag` that [`Self::pack`] wrote on another processor or to a restart file.
    ///
    /// # Errors
    /// The reals are not records of this atom.
    pub fn unpack(&mut self, tag: Tag, reals: &[f64]) -> Result<(), NetworkError> {
        let length = Record::reals(self.width);
        let mut records = Vec::with_capacity(reals.len() / length);
        for chunk in reals.chunks(length) {
            let record = Record::read(chunk, self.width).filter(|record| record.tags.contains(&tag));
            records.push(record.ok_or(NetworkError::BadRecord { tag })?);
        }
        self.incoming.insert(tag, records);
        Ok(())
    }

    /// Contact `k` of a block as a record; `None` if it has no history to keep.
    pub(super) fn record_of(&self, tags: &[Tag], kind: Kind, k: usize) -> Option<Record> {
        let block = self.block(kind)?;
        let view = block.view(k);
        let remembers = view.flags.bits & (ContactFlags::ACTIVE | ContactFlags::KEPT_REFERENCE) != 0;
        if view.flags.has(ContactFlags::BROKEN) || !remembers {
            return None;
        }
        let (fields, reals) = block.history_reals();
        let width: usize = fields.iter().map(|field| field.components).sum();
        let mut history = [0.0; HISTORY];
        history[..width].copy_from_slice(&reals[k * width..(k + 1) * width]);
        // The previous geometry of a contact that does not touch has no effect and differs between processors.
        let previous = if view.flags.has(ContactFlags::ACTIVE) {
            view.previous
        } else {
            PreviousGeometry { normal: Vec3::x(), length: 1.0 }
        };
        let tags = [tags[view.pair.a as usize], tags[view.pair.b as usize]];
        if let Some(bond) = self.thermal.as_ref().filter(|_| kind == Kind::Bond).and_then(|thermal| thermal.bond(tags))
        {
            history[self.width - THERMAL..self.width].copy_from_slice(&bond.reals());
        }
        Some(Record {
            tags,
            kind,
            flags: view.flags.bits & !ContactFlags::NOT_OWNED,
            row: view.flags.row,
            reference: view.reference,
            frame: previous,
            history,
        })
    }

    /// Append the records of all bonds and contacts of atom `tag` to `buffer`. `leaves`: the atom leaves this processor.
    pub fn pack(&mut self, tag: Tag, leaves: bool, buffer: &mut Vec<f64>) {
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
        self.adjacency.get_or_insert_with(|| adjacency(&self.state));
        if let (Some(particle), Some((start, contacts))) = (self.particle(tag), &self.adjacency) {
            for link in &contacts[start[particle] as usize..start[particle + 1] as usize] {
                if let Some(record) = self.record_of(&self.tags, link.kind(), link.index()) {
                    record.write(width, buffer);
                }
            }
        }
        for record in self.dormant.iter().filter(|record| record.tags.contains(&tag)) {
            record.write(width, buffer);
        }
    }

    /// Largest number of reals that [`Self::pack`] writes for an atom.
    pub fn largest_pack(&mut self) -> usize {
        let (start, _) = self.adjacency.get_or_insert_with(|| adjacency(&self.state));
        let most = start.windows(2).map(|w| (w[1] - w[0]) as usize).max().unwrap_or(0);
        let arriving = self.incoming.values().map(Vec::len).max().unwrap_or(0);
        // Upper bound: all dormant contacts, which are few, belong to this atom.
        (most.max(arriving) + self.dormant.len()) * Record::reals(self.width)
    }

    /// Take the records of arriving atoms and the dormant ones, without duplicates, sorted by [`Record::key`].
    ///
    /// # Errors
    /// Different records of the same bond.
    pub(super) fn arriving(&mut self) -> Result<Vec<Record>, NetworkError> {
        let arriving: usize = self.incoming.values().map(Vec::len).sum();
        let mut all = std::mem::take(&mut self.dormant);
        all.reserve_exact(arriving);
        for (_, records) in std::mem::take(&mut self.incoming) {
            all.extend(records);
        }
        // Unstable sorting suffices: records with the same key must be equal.
        all.sort_unstable_by_key(Record::key);
        let differ = |pair: &&[Record]| pair[0].key() == pair[1].key() && pair[0] != pair[1];
        if let Some(pair) = all.windows(2).find(differ) {
            let [a, b] = pair[0].tags;
            return Err(NetworkError::CopiesDiffer { a, b });
        }
        all.dedup_by_key(|record| record.key());
        Ok(all)
    }
}

/// The contacts of each particle that have a history to keep.
pub(super) fn adjacency(state: &State) -> Adjacency {
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
    let mut contacts = vec![Link::default(); *start.last().unwrap_or(&0) as usize];
    each(&mut |pair, kind, k| {
        for p in [pair.a, pair.b] {
            contacts[next[p as usize] as usize] = Link::new(kind, k);
            next[p as usize] += 1;
        }
    });
    (start, contacts)
}
