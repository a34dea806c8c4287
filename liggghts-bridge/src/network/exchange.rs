//! Bonds and contacts as records: for migration to another processor, for restart files, and across rebuilds.
//!
//! An atom that migrates takes all its records along, so that a bond may arrive twice. A restart file has each bond once, because the host's
//! arrays, which hold all data of atoms while a file is read, are as wide as the largest data of any atom: the records of a processor are
//! shared evenly among its atoms, whatever their bonds. Before the first rebuild they go to the owners of their atoms.

use std::collections::HashMap;

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::math::Vec3;
use concordem_solver::state::State;
use concordem_solver::state::contacts::{ContactFlags, Pair};

use super::{Network, NetworkError, blocks};
use crate::atoms::{Atoms, Tag};
use crate::records::{CompactHead, HISTORY, Kind, Record, THERMAL, ascending};

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

/// Compact records that arrived with atoms.
#[derive(Default)]
pub(super) struct Incoming {
    reals: Vec<f64>,
    /// Start and end of the records of each atom. Those of atoms that left again belong to none.
    of_atom: HashMap<Tag, [usize; 2]>,
}

impl Incoming {
    fn of(&self, tag: Tag) -> Option<&[f64]> {
        self.of_atom.get(&tag).map(|&[start, end]| &self.reals[start..end])
    }
}

/// What each atom of the host takes into a restart file: compact records, put together when the host packs the atom, because those of all
/// atoms take as much memory as the bonds.
#[derive(Default)]
pub(super) struct Pieces {
    /// Records that are in no block, compact: those that were read from a file or came with atoms, and dormant ones.
    others: Vec<f64>,
    /// Where each of them starts, and where the last one ends.
    other_starts: Vec<usize>,
    /// The records after them: contacts of the blocks.
    contacts: Vec<Link>,
    /// Where the piece of each atom starts, and where the last one ends, in records.
    starts: Vec<usize>,
    /// Reals of each piece.
    pub(super) lengths: Vec<usize>,
    /// The piece that the host packs.
    piece: Vec<f64>,
}

/// Records that a rebuild adds to the blocks, without duplicates, sorted by [`Record::key`]. They stay compact, because records of full
/// size would take more memory than the blocks.
#[derive(Default)]
pub(super) struct Arriving {
    reals: Vec<f64>,
    /// Where each record is.
    order: Vec<usize>,
    width: usize,
}

impl Arriving {
    /// Number of records.
    pub(super) fn len(&self) -> usize {
        self.order.len()
    }

    fn head(&self, at: usize) -> CompactHead {
        Record::compact_head(&self.reals[at..], self.width).expect("checked when it arrived")
    }

    fn read(&self, at: usize) -> Record {
        Record::read_compact(&self.reals[at..], &self.head(at), self.width)
    }

    /// Record `k`.
    pub(super) fn get(&self, k: usize) -> Record {
        self.read(self.order[k])
    }

    /// Number of records of this kind.
    pub(super) fn count(&self, kind: Kind) -> usize {
        self.order.iter().filter(|&&at| self.head(at).key.0 == kind).count()
    }

    /// The bonds.
    pub(super) fn bonds(&self) -> impl Iterator<Item = Record> + '_ {
        self.order.iter().filter(|&&at| self.head(at).key.0 == Kind::Bond).map(|&at| self.read(at))
    }

    /// Whether the bond of these atoms is among them.
    pub(super) fn has_bond(&self, tags: [Tag; 2]) -> bool {
        self.order.binary_search_by_key(&(Kind::Bond, tags), |&at| self.head(at).key).is_ok()
    }

    /// Keep the bonds and contacts for whose kind and atoms `keep` holds.
    pub(super) fn retain(&mut self, keep: impl Fn(Kind, [Tag; 2]) -> bool) {
        let mut order = std::mem::take(&mut self.order);
        order.retain(|&at| {
            let (kind, tags) = self.head(at).key;
            keep(kind, tags)
        });
        self.order = order;
    }
}

/// Starts of the pieces, and the end of the last one, if records of these lengths are shared in order among `count` atoms so that the
/// largest piece is as small as possible.
fn share(lengths: &[u8], count: usize) -> Vec<usize> {
    if count == 0 {
        return vec![0];
    }
    let total: usize = lengths.iter().map(|&length| usize::from(length)).sum();
    let longest = lengths.iter().copied().max().map_or(0, usize::from);
    // Pieces of at most `most` reals, each as long as possible.
    let split = |most: usize| {
        let (mut start, mut end) = (vec![0], 0);
        for length in lengths.iter().map(|&length| usize::from(length)) {
            if end + length - start[start.len() - 1] > most {
                start.push(end);
            }
            end += length;
        }
        start.resize(start.len().max(count), end);
        start.push(end);
        start
    };
    // A piece of `high` reals leaves out fewer than `longest`, so they suffice.
    let mean = total.div_ceil(count);
    let (mut low, mut high) = (mean.max(longest), mean + longest);
    while low < high {
        let middle = usize::midpoint(low, high);
        if split(middle).len() <= count + 1 {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    split(high)
}

impl Network {
    /// Read the records of atom `tag` that [`Self::pack`] wrote on another processor.
    ///
    /// # Errors
    /// The reals are not records of this atom.
    pub fn unpack(&mut self, tag: Tag, reals: &[f64]) -> Result<(), NetworkError> {
        let found = Record::all_compact(reals, self.width).take_while(|(_, head)| head.key.1.contains(&tag));
        if found.map(|(_, head)| head.length).sum::<usize>() != reals.len() {
            return Err(NetworkError::BadRecord { tag });
        }
        let start = self.incoming.reals.len();
        self.incoming.reals.extend(reals);
        self.incoming.of_atom.insert(tag, [start, start + reals.len()]);
        Ok(())
    }

    /// Records that arrived with an atom.
    pub(super) fn incoming_of(&self, tag: Tag) -> Option<&[f64]> {
        self.incoming.of(tag)
    }

    /// Make room for this many reals of a restart file: a vector that grows leaves holes as large as itself in the memory of the process.
    pub fn reserve_restored(&mut self, count: usize) {
        self.restored.reserve_exact(count);
    }

    /// Keep compact records of a restart file, of any atoms, until [`Self::next_restored`] brings them to the owners of their atoms. `tag`:
    /// the atom that they came with.
    ///
    /// # Errors
    /// The reals are not records.
    pub fn restore(&mut self, tag: Tag, reals: &[f64]) -> Result<(), NetworkError> {
        if Record::all_compact(reals, self.width).map(|(_, head)| head.length).sum::<usize>() != reals.len() {
            return Err(NetworkError::BadRecord { tag });
        }
        self.restored.extend(reals);
        Ok(())
    }

    /// As [`Self::restore`], for a row of a data file.
    ///
    /// # Errors
    /// It is too short.
    pub fn restore_row(&mut self, row: &[f64]) -> Result<(), NetworkError> {
        let tag = row.first().map_or(0, |&tag| tag as Tag);
        let record = Record::read(row, self.width).ok_or(NetworkError::BadRecord { tag })?;
        record.write_compact(self.width, &mut self.restored);
        Ok(())
    }

    /// Number of records that wait for [`Self::next_restored`].
    pub fn restored(&self) -> usize {
        Record::all_compact(&self.restored, self.width).count()
    }

    /// Ids of the restored record at the place `at`, and its reals; `None` at the end.
    pub fn next_restored(&self, at: usize) -> Option<([Tag; 2], &[f64])> {
        let head = Record::compact_head(&self.restored[at..], self.width)?;
        Some((head.key.1, &self.restored[at..at + head.length]))
    }

    /// Forget the restored records.
    pub fn drop_restored(&mut self) {
        self.restored = Vec::new();
    }

    /// Take compact records for the next rebuild, which drops those without an owned atom.
    ///
    /// # Errors
    /// The reals are not records.
    pub fn deliver(&mut self, reals: &[f64]) -> Result<(), NetworkError> {
        if Record::all_compact(reals, self.width).map(|(_, head)| head.length).sum::<usize>() != reals.len() {
            return Err(NetworkError::BadRecord { tag: 0 });
        }
        self.delivered.extend(reals);
        Ok(())
    }

    /// Take all restored records for the next rebuild, if there are no other processors.
    pub fn deliver_here(&mut self) {
        self.delivered = std::mem::take(&mut self.restored);
    }

    /// Visit each record that is to be stored once among all processors: those whose lower id belongs to an atom that this one owns at
    /// present, those in blocks last.
    pub(super) fn each_counted(&self, atoms: &Atoms<'_>, visit: &mut dyn FnMut(Option<usize>, &Record)) {
        for (at, head) in Record::all_compact(&self.restored, self.width) {
            visit(None, &Record::read_compact(&self.restored[at..], &head, self.width));
        }
        self.each_with_owned(0, atoms, visit);
    }

    /// Numbers of bonds whose lower id, and whose higher id, belongs to an atom that this processor owns at present.
    pub fn owned_ends(&self, atoms: &Atoms<'_>) -> [usize; 2] {
        [0, 1].map(|end| {
            let mut count = 0;
            self.each_with_owned(end, atoms, &mut |_, record| count += usize::from(record.kind == Kind::Bond));
            count
        })
    }

    /// Visit each record whose lower id (`end` 0) or higher id (1) belongs to an atom that this processor owns at present, and its index in
    /// the block of its kind, if it is there.
    fn each_with_owned(&self, end: usize, atoms: &Atoms<'_>, visit: &mut dyn FnMut(Option<usize>, &Record)) {
        // Atoms may have migrated since the last rebuild.
        let mut owned: Vec<Tag> = atoms.tag.iter().take(atoms.owned).collect();
        owned.sort_unstable();
        for (&tag, reals) in owned.iter().filter_map(|tag| Some((tag, self.incoming.of(*tag)?))) {
            for (at, head) in Record::all_compact(reals, self.width).filter(|(_, head)| head.key.1[end] == tag) {
                visit(None, &Record::read_compact(&reals[at..], &head, self.width));
            }
        }
        let counts = |tag: &Tag| owned.binary_search(tag).is_ok() && self.incoming.of(*tag).is_none();
        for record in self.dormant.iter().filter(|record| counts(&record.key().1[end])) {
            visit(None, record);
        }
        for (kind, block) in blocks(&self.state) {
            let of_block = (0..block.len()).filter(|&k| counts(&ascending(self.tags_of(block.pairs()[k]))[end]));
            for (k, record) in of_block.filter_map(|k| Some((k, self.record_of(&self.tags, kind, k)?))) {
                visit(Some(k), &record);
            }
        }
    }

    /// Rows of all records that are to be stored by this processor.
    pub fn counted_rows(&self, atoms: &Atoms<'_>) -> Vec<f64> {
        let mut rows = Vec::new();
        self.each_counted(atoms, &mut |_, record| record.write(self.width, &mut rows));
        rows
    }

    /// Share all records that are to be stored by this processor evenly among its atoms. Returns their number, and the most reals of an
    /// atom.
    ///
    /// # Errors
    /// There are records, but no atoms.
    pub fn begin_restart(&mut self, atoms: &Atoms<'_>) -> Result<[usize; 2], NetworkError> {
        let (mut others, mut other_starts, mut contacts, mut lengths) = (Vec::new(), vec![0], Vec::new(), Vec::new());
        let mut compact = Vec::new();
        self.each_counted(atoms, &mut |index, record| {
            compact.clear();
            record.write_compact(self.width, &mut compact);
            lengths.push(compact.len() as u8);
            if let Some(k) = index {
                contacts.push(Link::new(record.kind, k as u32));
            } else {
                others.extend(&compact);
                other_starts.push(others.len());
            }
        });
        if atoms.owned == 0 && !lengths.is_empty() {
            return Err(NetworkError::NoCarrier);
        }
        let count = lengths.len();
        let real_starts = share(&lengths, atoms.owned);
        let (mut starts, mut record, mut real) = (Vec::with_capacity(real_starts.len()), 0, 0);
        for &start in &real_starts {
            while real < start {
                real += usize::from(lengths[record]);
                record += 1;
            }
            starts.push(record);
        }
        let lengths: Vec<usize> = real_starts.windows(2).map(|ends| ends[1] - ends[0]).collect();
        let most = lengths.iter().copied().max().unwrap_or(0);
        self.pieces = Pieces { others, other_starts, contacts, starts, lengths, piece: Vec::new() };
        Ok([count, most])
    }

    /// Number of reals that atom `i` of the host takes into the restart file.
    pub fn restart_length(&self, i: usize) -> usize {
        self.pieces.lengths.get(i).copied().unwrap_or(0)
    }

    /// Records that atom `i` of the host takes into the restart file.
    ///
    /// # Errors
    /// The bonds have changed since [`Self::begin_restart`]: the host has room for the length of that time.
    pub fn restart_piece(&mut self, i: usize) -> Result<&[f64], NetworkError> {
        let length = self.restart_length(i);
        let mut pieces = std::mem::take(&mut self.pieces);
        pieces.piece.clear();
        if let Some(&[first, end]) = pieces.starts.get(i..i + 2) {
            let others = pieces.other_starts.len() - 1;
            let [start, stop] = [first, end].map(|record| pieces.other_starts[record.min(others)]);
            pieces.piece.extend(&pieces.others[start..stop]);
            let [start, stop] = [first, end].map(|record| record.max(others) - others);
            for link in &pieces.contacts[start..stop] {
                if let Some(record) = self.record_of(&self.tags, link.kind(), link.index()) {
                    record.write_compact(self.width, &mut pieces.piece);
                }
            }
        }
        self.pieces = pieces;
        if self.pieces.piece.len() == length { Ok(&self.pieces.piece) } else { Err(NetworkError::ChangedWhileWritten) }
    }

    /// All records are in the restart file.
    pub fn end_restart(&mut self) {
        self.pieces = Pieces::default();
    }

    /// Contact `k` of a block as a record; `None` if it has no history to keep.
    pub(super) fn record_of(&self, tags: &[Tag], kind: Kind, k: usize) -> Option<Record> {
        let block = self.block(kind)?;
        let view = block.view(k);
        let remembers = view.flags.bits & (ContactFlags::ACTIVE | ContactFlags::KEPT_REFERENCE) != 0;
        if view.flags.has(ContactFlags::BROKEN) || !remembers {
            return None;
        }
        let width: usize = block.history_fields().iter().map(|field| field.components).sum();
        let mut history = [0.0; HISTORY];
        for (n, number) in history[..width].iter_mut().enumerate() {
            *number = block.history_column(n)[k];
        }
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

    /// Append the compact records of all bonds and contacts of atom `tag` to `buffer`. `leaves`: the atom leaves this processor.
    pub fn pack(&mut self, tag: Tag, leaves: bool, buffer: &mut Vec<f64>) {
        let width = self.width;
        if let Some(reals) = self.incoming.of(tag) {
            buffer.extend(reals);
            if leaves {
                self.incoming.of_atom.remove(&tag);
            }
            return;
        }
        self.adjacency.get_or_insert_with(|| adjacency(&self.state));
        if let (Some(particle), Some((start, contacts))) = (self.particle(tag), &self.adjacency) {
            for link in &contacts[start[particle] as usize..start[particle + 1] as usize] {
                if let Some(record) = self.record_of(&self.tags, link.kind(), link.index()) {
                    record.write_compact(width, buffer);
                }
            }
        }
        for record in self.dormant.iter().filter(|record| record.tags.contains(&tag)) {
            record.write_compact(width, buffer);
        }
    }

    /// Largest number of reals that [`Self::pack`] writes for an atom.
    pub fn largest_pack(&self) -> usize {
        // Not the contacts themselves: often no atom leaves.
        let most = match &self.adjacency {
            Some((start, _)) => start.windows(2).map(|w| w[1] - w[0]).max(),
            None => counts(&self.state).into_iter().max(),
        };
        let most = most.unwrap_or(0) as usize;
        let arriving = self.incoming.of_atom.values().map(|[start, end]| end - start).max().unwrap_or(0);
        // Upper bound: all dormant contacts, which are few, belong to this atom, and no real is zero.
        ((most + self.dormant.len()) * Record::reals(self.width)).max(arriving)
    }

    /// Longest reference or current length of a bond that waits for a rebuild, m.
    pub(super) fn longest_waiting(&self) -> f64 {
        let incoming = self.incoming.of_atom.keys().filter_map(|&tag| self.incoming.of(tag));
        let all = incoming.chain([&self.restored[..], &self.delivered[..]]);
        let bonds = all.flat_map(|reals| {
            let found = Record::all_compact(reals, self.width).filter(|(_, head)| head.key.0 == Kind::Bond);
            found.map(|(at, head)| Record::read_compact(&reals[at..], &head, self.width))
        });
        bonds.fold(0.0, |longest: f64, record| longest.max(record.frame.length).max(record.reference.length))
    }

    /// Take the records of arriving atoms and of a restart file, and the dormant ones.
    ///
    /// # Errors
    /// Different records of the same bond.
    pub(super) fn arriving(&mut self) -> Result<Arriving, NetworkError> {
        let width = self.width;
        let mut reals = std::mem::take(&mut self.delivered);
        for record in std::mem::take(&mut self.dormant) {
            record.write_compact(width, &mut reals);
        }
        let incoming = std::mem::take(&mut self.incoming);
        for &[start, end] in incoming.of_atom.values() {
            reals.extend(&incoming.reals[start..end]);
        }
        drop(incoming);
        let mut order: Vec<usize> = Record::all_compact(&reals, width).map(|(at, _)| at).collect();
        let mut all = Arriving { reals, order: Vec::new(), width };
        // Unstable sorting suffices: records with the same key must be equal.
        order.sort_unstable_by_key(|&at| all.head(at).key);
        let same = |a: usize, b: usize| all.head(a).key == all.head(b).key;
        if let Some(pair) =
            order.windows(2).find(|pair| same(pair[0], pair[1]) && all.read(pair[0]) != all.read(pair[1]))
        {
            let [a, b] = all.head(pair[0]).key.1;
            return Err(NetworkError::CopiesDiffer { a, b });
        }
        order.dedup_by(|a, b| same(*a, *b));
        all.order = order;
        Ok(all)
    }
}

/// The contacts that have a history to keep.
fn remembered(state: &State) -> impl Iterator<Item = (Pair, Kind, u32)> + '_ {
    blocks(state).flat_map(|(kind, block)| {
        let contacts = (0..).zip(block.pairs().iter().zip(block.flags()));
        let remembers = |flags: &ContactFlags| {
            flags.bits & (ContactFlags::ACTIVE | ContactFlags::KEPT_REFERENCE) != 0 && !flags.has(ContactFlags::BROKEN)
        };
        contacts.filter(move |(_, (_, flags))| remembers(flags)).map(move |(k, (pair, _))| (*pair, kind, k))
    })
}

/// The number of those of each particle.
fn counts(state: &State) -> Vec<u32> {
    let mut counts = vec![0; state.particles.len()];
    for (pair, _, _) in remembered(state) {
        counts[pair.a as usize] += 1;
        counts[pair.b as usize] += 1;
    }
    counts
}

/// Those of each particle.
pub(super) fn adjacency(state: &State) -> Adjacency {
    let mut next = 0;
    let mut start = vec![0];
    start.extend(counts(state).into_iter().map(|count| {
        next += count;
        next
    }));
    let mut next = start.clone();
    let mut contacts = vec![Link::default(); *start.last().unwrap_or(&0) as usize];
    for (pair, kind, k) in remembered(state) {
        for p in [pair.a, pair.b] {
            contacts[next[p as usize] as usize] = Link::new(kind, k);
            next[p as usize] += 1;
        }
    }
    (start, contacts)
}

#[cfg(test)]
mod tests {
    use super::share;

    #[test]
    fn records_are_shared_evenly() {
        let pieces = |lengths: &[u8], count: usize| {
            let start = share(lengths, count);
            assert_eq!(start.len(), count + 1);
            start.windows(2).map(|ends| ends[1] - ends[0]).collect::<Vec<_>>()
        };
        assert_eq!(pieces(&[], 3), [0, 0, 0]);
        assert_eq!(pieces(&[], 0), [0; 0]);
        assert_eq!(pieces(&[13], 3), [13, 0, 0]);
        assert_eq!(pieces(&[13; 12], 4), [39; 4]);
        // 70 reals for 4 atoms are 17.5 each, but records are not divided.
        assert_eq!(pieces(&[10, 10, 10, 10, 10, 10, 10], 4), [20, 20, 20, 10]);
        assert_eq!(pieces(&[19, 5, 5, 5, 19, 5], 3), [24, 10, 24]);
    }
}
