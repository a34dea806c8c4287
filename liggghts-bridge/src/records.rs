//! Complete data of a bond or contact, by atom ids, for communication between processors and for restart files.

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

/// Reals in a record before its history.
const HEAD: usize = 9;

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

/// Number of history reals in a record of `length` reals.
pub const fn width_of(length: usize) -> usize {
    length - HEAD
}

impl Record {
    /// Sort key; it identifies the contact. The lower id comes first.
    pub fn key(&self) -> (Kind, [Tag; 2]) {
        (self.kind, ascending(self.tags))
    }

    /// Number of reals in a record with a history of `width` reals.
    pub const fn reals(width: usize) -> usize {
        HEAD + width
    }

    /// Append the record, with `width` reals of history, to `buffer`.
    pub fn write(&self, width: usize, buffer: &mut Vec<f64>) {
        let kind = match self.kind {
            Kind::Bond => 0.0,
            Kind::Contact => 256.0,
        };
        buffer.extend([
            // Exact up to LARGEST_TAG.
            self.tags[0] as f64,
            self.tags[1] as f64,
            f64::from(self.flags) + kind + 512.0 * f64::from(self.row),
            self.reference.length,
            self.reference.area,
            self.frame.normal.x,
            self.frame.normal.y,
            self.frame.normal.z,
            self.frame.length,
        ]);
        buffer.extend(&self.history[..width]);
    }

    /// Read a record that [`Self::write`] wrote; `None` if `reals` is too short.
    pub fn read(reals: &[f64], width: usize) -> Option<Self> {
        if reals.len() < Self::reals(width) {
            return None;
        }
        let code = reals[2] as u32;
        let mut history = [0.0; HISTORY];
        history[..width].copy_from_slice(&reals[HEAD..HEAD + width]);
        Some(Self {
            tags: [reals[0] as Tag, reals[1] as Tag],
            kind: if code & 256 == 0 { Kind::Bond } else { Kind::Contact },
            flags: (code & 255) as u8,
            row: (code >> 9) as u16,
            reference: Reference { length: reals[3], area: reals[4] },
            frame: PreviousGeometry { normal: Vec3::new(reals[5], reals[6], reals[7]), length: reals[8] },
            history,
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

    #[test]
    fn a_record_survives_writing_and_reading() {
        let mut record = Record {
            // Ids of more than 32 bits.
            tags: [3, LARGEST_TAG],
            kind: Kind::Contact,
            flags: ContactFlags::KEPT_REFERENCE | ContactFlags::ACTIVE,
            row: 65535,
            reference: Reference { length: 0.5, area: 0.0 },
            frame: PreviousGeometry { normal: Vec3::new(0.1, -0.2, 0.3), length: 7.0 },
            history: [0.0; HISTORY],
        };
        record.history[..7].copy_from_slice(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, -7.0]);
        let mut buffer = Vec::new();
        record.write(7, &mut buffer);
        assert_eq!(buffer.len(), Record::reals(7));
        assert_eq!(Record::read(&buffer, 7), Some(record));
        assert_eq!(Record::read(&buffer[1..], 7), None);
    }
}
