//! Joints: which particles lie on which side of which joint, and the pair coefficients of contacts across one.

use crate::state::Particles;
use crate::state::contacts::{ContactBlock, Pair};
use concordem_contact::law::ContactLaw;

/// The side of a joint on which a particle lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Mark {
    /// Number of the joint.
    pub joint: u16,
    /// Whether the particle lies on the side to which the normal points.
    pub in_front: bool,
    /// Pair coefficients of contacts across the joint at the particle.
    pub row: u16,
}

/// The sides of joints on which particles lie. It never changes, so that contacts that begin later across a joint are on it, too.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Joints {
    /// By id of the particle, and one more: place of its first mark.
    first: Vec<u32>,
    /// Marks, by particle and joint.
    marks: Vec<Mark>,
    /// Of each joint: the number of its table in the scenario, which may make several parallel ones.
    table: Vec<u16>,
}

impl Joints {
    /// Of marks with the ids of their particles, in any order; `table`: of each joint, the number of its table in the scenario.
    pub fn new(mut marks: Vec<(u32, Mark)>, table: Vec<u16>) -> Self {
        marks.sort_unstable();
        let count = marks.last().map_or(0, |(id, _)| *id as usize + 1);
        let first = (0..=count).map(|id| marks.partition_point(|mark| (mark.0 as usize) < id) as u32);
        Self { first: first.collect(), marks: marks.into_iter().map(|(_, mark)| mark).collect(), table }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.marks.is_empty()
    }

    /// Pair coefficients of contacts across joints, ascending.
    pub fn rows(&self) -> Vec<u16> {
        let mut rows: Vec<u16> = self.marks.iter().map(|mark| mark.row).collect();
        rows.sort_unstable();
        rows.dedup();
        rows
    }

    fn of(&self, id: u32) -> &[Mark] {
        let at = id as usize;
        match (self.first.get(at), self.first.get(at + 1)) {
            (Some(&first), Some(&end)) => &self.marks[first as usize..end as usize],
            _ => &[],
        }
    }

    /// The mark of the particle with the smaller id at the first joint that separates two particles.
    pub fn between(&self, ids: [u32; 2]) -> Option<Mark> {
        let [low, high] = [ids[0].min(ids[1]), ids[0].max(ids[1])].map(|id| self.of(id));
        let across = |mark: &&Mark| high.iter().any(|m| m.joint == mark.joint && m.in_front != mark.in_front);
        low.iter().find(across).copied()
    }

    /// The number of the table of the first joint that separates two particles.
    pub fn table_between(&self, ids: [u32; 2]) -> Option<u16> {
        self.table.get(usize::from(self.between(ids)?.joint)).copied()
    }

    /// Pair coefficients of a pair across a joint.
    pub fn row(&self, particles: &Particles, pair: Pair) -> Option<u16> {
        if self.is_empty() {
            return None;
        }
        Some(self.between([pair.a, pair.b].map(|p| particles.id[p as usize]))?.row)
    }

    /// Give the contacts of a block that lie across joints the pair coefficients of these; returns their places.
    pub fn assign<L: ContactLaw>(&self, block: &mut ContactBlock<L>, particles: &Particles) -> Vec<usize> {
        let mut found = Vec::new();
        for k in 0..block.len() {
            if let Some(row) = self.row(particles, block.pair[k]) {
                block.flags[k].row = row;
                found.push(k);
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two joints that cross: the first one that separates decides, with the row of the particle of the smaller id, in either order.
    #[test]
    fn the_first_joint_between_two_particles_decides() {
        let mark = |joint, in_front, row| Mark { joint, in_front, row };
        let marks = vec![
            (4, mark(1, true, 9)),
            (4, mark(0, true, 7)),
            (2, mark(0, false, 6)),
            (2, mark(1, false, 8)),
            (7, mark(1, false, 5)),
            (7, mark(0, true, 7)),
        ];
        let joints = Joints::new(marks, vec![3, 4]);
        let row = |a, b| joints.between([a, b]).map(|mark| mark.row);
        assert_eq!((row(2, 4), row(4, 2)), (Some(6), Some(6)));
        // On one side of the first joint, on two of the second.
        assert_eq!(row(7, 4), Some(9));
        // Particles without marks, also beyond the last one that has some, and a particle and itself.
        assert_eq!((row(0, 4), row(2, 90), row(4, 4)), (None, None, None));
        assert_eq!(joints.rows(), [5, 6, 7, 8, 9]);
        let table = |a, b| joints.table_between([a, b]);
        assert_eq!((table(2, 4), table(7, 4), table(0, 4)), (Some(3), Some(4), None));
        assert!(Joints::default().is_empty() && Joints::default().between([0, 1]).is_none());
    }
}
