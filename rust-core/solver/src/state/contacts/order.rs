//! The order of contacts by their particles: sorting, removing, inserting.

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::law::{ContactLaw, Reference};

use super::{ContactBlock, ContactFlags, Pair};

impl<L: ContactLaw> ContactBlock<L> {
    /// Sort by (a, b, image). Contacts that are sorted already stay in their memory; those that follow them are merged into them, because
    /// usually few have been added to many.
    pub fn sort(&mut self) {
        /// Put entry `late[n]` behind the first `before[n]` entries, for all `n`, from the last one on.
        fn merge<T: Copy>(values: &mut [T], late: &[u32], before: &[u32], sorted: usize) {
            let inserted: Vec<T> = late.iter().map(|&k| values[k as usize]).collect();
            let (mut from, mut to) = (sorted, values.len());
            for (value, &before) in inserted.into_iter().zip(before).rev() {
                let before = before as usize;
                to -= from - before;
                values.copy_within(before..from, to);
                from = before;
                to -= 1;
                values[to] = value;
            }
        }
        let key = |k: usize| (self.pair[k], self.flags[k].image);
        let count = self.len();
        let Some(sorted) = (1..count).find(|&k| key(k - 1) > key(k)) else { return };
        let mut late: Vec<u32> = (sorted as u32..count as u32).collect();
        late.sort_unstable_by_key(|&k| (key(k as usize), k));
        let before = |late: &u32| {
            let (mut low, mut high) = (0, sorted);
            while low < high {
                let middle = low.midpoint(high);
                if key(middle) <= key(*late as usize) { low = middle + 1 } else { high = middle }
            }
            low as u32
        };
        let before: Vec<u32> = late.iter().map(before).collect();
        merge(&mut self.pair, &late, &before, sorted);
        merge(&mut self.flags, &late, &before, sorted);
        self.reference.change_columns(|column| merge(column, &late, &before, sorted));
        self.previous.change_columns(|column| merge(column, &late, &before, sorted));
        self.history.change_columns(|column| merge(column, &late, &before, sorted));
        if !self.rest_length.is_empty() {
            merge(&mut self.rest_length, &late, &before, sorted);
        }
    }

    /// Keep the contacts for which `keep` holds.
    pub fn retain(&mut self, keep: impl Fn(&ContactFlags) -> bool) {
        let removed: Vec<u32> = (0..self.len() as u32).filter(|&k| !keep(&self.flags[k as usize])).collect();
        self.remove(&removed);
    }

    /// Remove contacts, given in ascending order. Moves the rest in place, because usually few of many are removed.
    pub fn remove(&mut self, removed: &[u32]) {
        fn close<T: Copy>(values: &mut Vec<T>, removed: &[u32]) {
            let count = values.len();
            let mut to = removed[0] as usize;
            for (n, &gap) in removed.iter().enumerate() {
                let from = gap as usize + 1;
                let end = removed.get(n + 1).map_or(count, |&next| next as usize);
                values.copy_within(from..end, to);
                to += end - from;
            }
            values.truncate(to);
        }
        if removed.is_empty() {
            return;
        }
        close(&mut self.pair, removed);
        close(&mut self.flags, removed);
        self.reference.change_columns(|column| close(column, removed));
        self.previous.change_columns(|column| close(column, removed));
        self.history.change_columns(|column| close(column, removed));
        if !self.rest_length.is_empty() {
            close(&mut self.rest_length, removed);
        }
    }

    /// Insert a contact without history into a sorted block.
    pub(super) fn insert(&mut self, pair: Pair, flags: ContactFlags, reference: Reference, previous: PreviousGeometry) {
        let key = |k: usize| (self.pair[k], self.flags[k].image);
        let (mut low, mut high) = (0, self.len());
        while low < high {
            let middle = low.midpoint(high);
            if key(middle) < (pair, flags.image) { low = middle + 1 } else { high = middle }
        }
        self.pair.insert(low, pair);
        self.flags.insert(low, flags);
        self.reference.insert(low, reference);
        self.previous.insert(low, previous);
        self.history.insert(low, L::State::default());
        if !self.rest_length.is_empty() {
            self.rest_length.insert(low, reference.length);
        }
    }
}

#[cfg(test)]
mod tests {
    use concordem_contact::law::{LawState as _, LinearBond};
    use concordem_contact::math::Vec3;

    use super::super::{ContactTemperature as _, EditContacts as _};
    use super::*;

    /// Add a contact whose particles and numbers follow from `n`.
    fn push(block: &mut ContactBlock<LinearBond>, n: u32, image: i8) {
        let (number, pair) = (f64::from(n), Pair { a: n % 11, b: 11 + n % 7 });
        let flags = ContactFlags { row: n as u16, bits: 0, image: [image, 0, 0], padding: 0 };
        let reference = Reference { length: number, area: -number };
        let previous = PreviousGeometry { normal: Vec3::repeat(number), length: number };
        block.push_with_history(pair, flags, reference, previous, &[number; 7]);
    }

    /// Sorted contacts and others behind them, in any number, end in the order of their particles and images, each with its own numbers.
    #[test]
    fn added_contacts_are_merged() {
        let law = LinearBond::new(1.0, 1.0, 0.0, 1.0, 1.0).unwrap();
        for (sorted, added) in [(0, 40), (1, 40), (40, 0), (40, 1), (40, 7), (3, 40)] {
            let mut block = ContactBlock::new(vec![law]);
            (0..sorted).for_each(|n| push(&mut block, n, 0));
            block.sort();
            // Contacts that are added later get rest lengths, too.
            block.begin_expansion();
            // Some with the pairs of earlier ones, in the same image or another one.
            (0..added).for_each(|n| push(&mut block, 1000 - 13 * n, (n % 2) as i8));
            block.sort();
            assert_eq!(block.len(), (sorted + added) as usize);
            let keys: Vec<_> = block.pair.iter().zip(&block.flags).map(|(pair, flags)| (*pair, flags.image)).collect();
            assert!(keys.is_sorted(), "{keys:?}");
            let mut numbers = Vec::new();
            for k in 0..block.len() {
                let (n, pair) = (u32::from(block.flags[k].row), block.pair[k]);
                assert_eq!((pair.a, pair.b), (n % 11, 11 + n % 7));
                let number = f64::from(n);
                assert_eq!(block.reference.get(k), Reference { length: number, area: -number });
                let previous = PreviousGeometry { normal: Vec3::repeat(number), length: number };
                assert_eq!((block.previous.get(k), block.history.get(k).as_reals()), (previous, &[number; 7][..]));
                assert!(sorted == 0 || block.rest_length[k] == number);
                numbers.push(n);
            }
            numbers.sort_unstable();
            let mut expected: Vec<u32> = (0..sorted).chain((0..added).map(|n| 1000 - 13 * n)).collect();
            expected.sort_unstable();
            assert_eq!(numbers, expected);
        }
    }
}
