//! Complete data of a bond or contact, by atom ids, for communication between processors, restart files, and data files.
//!
//! A row of a data file has a fixed number of reals. Processors and restart files exchange the compact form, without reals that are zero: the
//! history of an undamaged bond is mostly zeros, and the arrays of a host that reads a restart file hold it twice.

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::law::{Field, LawName, Reference};
use concordem_contact::math::Vec3;

use crate::atoms::Tag;

/// Number of reals in a history with these fields.
const fn reals(fields: &[Field]) -> usize {
    let (mut sum, mut i) = (0, 0);
    while i < fields.len() {
        sum += fields[i].components;
        i += 1;
    }
    sum
}

/// Largest number of reals in the history of any law, with what a bond keeps for heat.
pub const HISTORY: usize = {
    let (mut most, mut i) = (0, 0);
    while i < LawName::ALL.len() {
        let facts = LawName::ALL[i].facts();
        let (bond, contact) = (reals(facts.history), reals(facts.unbonded_history));
        let larger = if bond > contact { bond } else { contact };
        most = if larger > most { larger } else { most };
        i += 1;
    }
    most + THERMAL
};

/// Reals that a bond keeps for heat conduction, behind the history: length at the reference temperature (m), area (m²), and the
/// distances of A and B from it (m).
pub const THERMAL: usize = 4;

/// Fields of a history as text: name, number of reals, and unit, such as `shear_displacement 3 (m), normal_dashpot 1 (N)`.
pub fn history_fields(fields: &[Field]) -> String {
    let field = |field: &Field| format!("{} {} ({})", field.name, field.components, field.unit);
    fields.iter().map(field).collect::<Vec<_>>().join(", ")
}

/// Reals in a row before its history.
const HEAD: usize = 9;

/// Reals in a row before those that the compact form may leave out: two ids and the code.
const NEVER_ZERO: usize = 3;

/// Bits of the code: that of contacts, the lowest one of the row, and, in the compact form, that of ids in a real each and the lowest one of
/// the reals that are not zero.
const CONTACT: u64 = 1 << 8;
const ROW: u32 = 9;
const WIDE: u64 = 1 << 25;
const NOT_ZERO: u32 = 26;
// Reals hold integers of 53 bits.
const _: () = assert!(NOT_ZERO as usize + HEAD - NEVER_ZERO + HISTORY <= 53);

/// Two ids below this share a real. Its upper half would otherwise be that of a number that is not finite.
const NARROW: Tag = 0x7ff0_0000;

/// Block of the state that a contact belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Bonds.
    Bond,
    /// Unbonded contacts.
    Contact,
}

/// One bond or contact. A is the atom that comes first in the order of the particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Record {
    /// Ids of A and B.
    pub tags: [Tag; 2],
    /// Bond or contact.
    pub kind: Kind,
    /// [`ContactFlags`](concordem_solver::state::contacts::ContactFlags) without `NOT_OWNED`.
    pub flags: u8,
    /// Row of the pair coefficients; that of a bond counts if parameters belong to bond types.
    pub row: u16,
    /// Reference length and area.
    pub reference: Reference,
    /// Previous geometry.
    pub frame: PreviousGeometry,
    /// History of the law. Depending on [`Self::kind`], the fields are those of
    /// [`LawFacts::history`](concordem_contact::law::LawFacts::history) or of `unbonded_history`. Vectors are x, y, z; forces act on
    /// A; the remaining reals are zero. [`history_fields`] lists the fields of a law.
    pub history: [f64; HISTORY],
}

/// Two ids, the lower one first.
pub const fn ascending([a, b]: [Tag; 2]) -> [Tag; 2] {
    if a < b { [a, b] } else { [b, a] }
}

/// What [`Record::compact_head`] finds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompactHead {
    /// Sort key, as [`Record::key`].
    pub key: (Kind, [Tag; 2]),
    /// Ids of A and B.
    tags: [Tag; 2],
    /// Reals of the record.
    pub length: usize,
    code: u64,
    /// Reals before those that may be left out.
    head: usize,
}

/// Number of history reals in a row of `length` reals.
pub const fn width_of(length: usize) -> usize {
    length - HEAD
}

impl Record {
    /// Sort key; it identifies the contact. The lower id comes first.
    pub fn key(&self) -> (Kind, [Tag; 2]) {
        (self.kind, ascending(self.tags))
    }

    /// Number of reals in a row with a history of `width` reals; the compact form has at most as many.
    pub const fn reals(width: usize) -> usize {
        HEAD + width
    }

    fn code(&self) -> u64 {
        let kind = if self.kind == Kind::Contact { CONTACT } else { 0 };
        u64::from(self.flags) | kind | u64::from(self.row) << ROW
    }

    /// All reals behind the code.
    fn reals_of(&self) -> [f64; HEAD - NEVER_ZERO + HISTORY] {
        let mut reals = [0.0; HEAD - NEVER_ZERO + HISTORY];
        let PreviousGeometry { normal, length } = self.frame;
        let (head, history) = reals.split_at_mut(HEAD - NEVER_ZERO);
        head.copy_from_slice(&[self.reference.length, self.reference.area, normal.x, normal.y, normal.z, length]);
        history.copy_from_slice(&self.history);
        reals
    }

    fn of(tags: [Tag; 2], code: u64, reals: &[f64]) -> Self {
        let mut history = [0.0; HISTORY];
        let (head, rest) = reals.split_at(HEAD - NEVER_ZERO);
        history[..rest.len()].copy_from_slice(rest);
        Self {
            tags,
            kind: if code & CONTACT == 0 { Kind::Bond } else { Kind::Contact },
            flags: (code & 255) as u8,
            row: (code >> ROW) as u16,
            reference: Reference { length: head[0], area: head[1] },
            frame: PreviousGeometry { normal: Vec3::new(head[2], head[3], head[4]), length: head[5] },
            history,
        }
    }

    /// Append the record as a row, with `width` reals of history, to `buffer`.
    pub fn write(&self, width: usize, buffer: &mut Vec<f64>) {
        // Exact: ids reach LARGEST_TAG.
        buffer.extend([self.tags[0] as f64, self.tags[1] as f64, self.code() as f64]);
        buffer.extend(&self.reals_of()[..HEAD - NEVER_ZERO + width]);
    }

    /// Read a row that [`Self::write`] wrote; `None` if `reals` is too short.
    pub fn read(reals: &[f64], width: usize) -> Option<Self> {
        let reals = reals.get(..Self::reals(width))?;
        Some(Self::of([reals[0] as Tag, reals[1] as Tag], reals[2] as u64, &reals[NEVER_ZERO..]))
    }

    /// Append the record in compact form, with `width` reals of history before those that are zero are left out, to `buffer`.
    pub fn write_compact(&self, width: usize, buffer: &mut Vec<f64>) {
        let reals = self.reals_of();
        let reals = &reals[..HEAD - NEVER_ZERO + width];
        // Not those that equal zero: -0 must stay.
        let not_zero = |real: &f64| real.to_bits() != 0;
        let bits = reals.iter().enumerate().fold(0u64, |bits, (k, real)| bits | u64::from(not_zero(real)) << k);
        let code = self.code() | bits << NOT_ZERO;
        let [a, b] = self.tags;
        if a < NARROW && b < NARROW {
            buffer.extend([code as f64, f64::from_bits((a as u64) << 32 | b as u64)]);
        } else {
            buffer.extend([(code | WIDE) as f64, a as f64, b as f64]);
        }
        buffer.extend(reals.iter().filter(|real| not_zero(real)));
    }

    /// Key and length of the compact record at the start of `reals`; `None` if there is none with `width` reals of history.
    pub fn compact_head(reals: &[f64], width: usize) -> Option<CompactHead> {
        let code =
            reals.first().filter(|code| (0.0..9e15).contains(*code) && code.fract() == 0.0).map(|&code| code as u64)?;
        let head = if code & WIDE == 0 { 2 } else { 3 };
        let bits = code >> NOT_ZERO;
        let length = head + bits.count_ones() as usize;
        if reals.len() < length || bits >> (HEAD - NEVER_ZERO + width) != 0 {
            return None;
        }
        let tags = if code & WIDE == 0 {
            let both = reals[1].to_bits();
            [(both >> 32) as Tag, (both & 0xffff_ffff) as Tag]
        } else {
            [reals[1] as Tag, reals[2] as Tag]
        };
        let kind = if code & CONTACT == 0 { Kind::Bond } else { Kind::Contact };
        Some(CompactHead { key: (kind, ascending(tags)), tags, length, code, head })
    }

    /// Read the compact record with the head `found` at the start of `reals`.
    pub fn read_compact(reals: &[f64], found: &CompactHead, width: usize) -> Self {
        let mut all = [0.0; HEAD - NEVER_ZERO + HISTORY];
        let mut bits = found.code >> NOT_ZERO;
        for &real in &reals[found.head..found.length] {
            all[bits.trailing_zeros() as usize] = real;
            bits &= bits - 1;
        }
        Self::of(found.tags, found.code, &all[..HEAD - NEVER_ZERO + width])
    }

    /// All compact records in `reals`, with the place of each; ends with the first damaged one.
    pub fn all_compact(reals: &[f64], width: usize) -> impl Iterator<Item = (usize, CompactHead)> + '_ {
        let mut at = 0;
        std::iter::from_fn(move || {
            let head = Self::compact_head(&reals[at..], width)?;
            at += head.length;
            Some((at - head.length, head))
        })
    }
}

#[cfg(test)]
mod tests {
    use concordem_solver::state::contacts::ContactFlags;

    use super::*;
    use crate::atoms::LARGEST_TAG;

    #[test]
    fn history_fields_lists_name_size_and_unit() {
        let of = |law: LawName| history_fields(law.facts().history);
        assert_eq!(of(LawName::CohesiveBeam), "rest_direction 3 (1), rest_rotation 3 (1)");
        assert_eq!(of(LawName::LinearBond), "shear_displacement 3 (m), normal_dashpot 1 (N), shear_dashpot 3 (N)");
        let after = history_fields(LawName::LinearBond.facts().unbonded_history);
        assert_eq!(after, history_fields(LawName::Frictional.facts().history));
    }

    fn example(tags: [Tag; 2]) -> Record {
        let mut record = Record {
            tags,
            kind: Kind::Contact,
            flags: ContactFlags::KEPT_REFERENCE | ContactFlags::ACTIVE,
            row: 65535,
            reference: Reference { length: 0.5, area: 0.0 },
            frame: PreviousGeometry { normal: Vec3::new(0.1, -0.2, 0.3), length: 7.0 },
            history: [0.0; HISTORY],
        };
        record.history[..7].copy_from_slice(&[1.0, 0.0, 3.0, -0.0, 0.0, 6.0, -7.0]);
        record
    }

    #[test]
    fn a_record_survives_writing_and_reading() {
        // Ids of more than 32 bits.
        let record = example([3, LARGEST_TAG]);
        let mut buffer = Vec::new();
        record.write(7, &mut buffer);
        assert_eq!(buffer.len(), Record::reals(7));
        assert_eq!(Record::read(&buffer, 7), Some(record));
        assert_eq!(Record::read(&buffer[1..], 7), None);
    }

    #[test]
    fn the_compact_form_leaves_out_zeros_only() {
        // The largest ids that share a real, the smallest that do not, and the largest. Ten reals are not zero, -0 included.
        for (tags, head) in
            [([3, 4], 2), ([1, NARROW - 1], 2), ([NARROW - 1, NARROW - 2], 2), ([3, NARROW], 3), ([3, LARGEST_TAG], 3)]
        {
            let record = example(tags);
            let mut buffer = vec![5.0];
            record.write_compact(7, &mut buffer);
            assert_eq!(buffer.len(), 1 + head + 10);
            assert!(buffer.iter().all(|real| real.is_finite()), "a host may compare or print its buffers");
            record.write_compact(7, &mut buffer);
            let found: Vec<_> = Record::all_compact(&buffer[1..], 7).collect();
            assert_eq!(found.iter().map(|(at, _)| *at).collect::<Vec<_>>(), [0, head + 10]);
            for (at, head) in &found {
                assert_eq!(head.key, record.key());
                let read = Record::read_compact(&buffer[1 + at..], head, 7);
                assert_eq!(read, record);
                assert_eq!(read.history[3].to_bits(), (-0.0f64).to_bits(), "equality does not see the sign of zero");
            }
        }
    }

    #[test]
    fn damaged_compact_records_are_none() {
        let record = example([3, 4]);
        let mut good = Vec::new();
        record.write_compact(7, &mut good);
        let head = |reals: &[f64], width| Record::compact_head(reals, width);
        assert!(head(&good, 7).is_some());
        assert_eq!(head(&good[..good.len() - 1], 7), None, "cut off");
        assert_eq!(head(&good, 6), None, "the history of another law");
        assert_eq!(head(&[], 7), None);
        for code in [-1.0, 0.5, 1e300, f64::NAN, f64::INFINITY] {
            good[0] = code;
            assert_eq!(head(&good, 7), None, "{code}");
        }
    }
}
