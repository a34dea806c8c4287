//! Rows of numbers, stored column by column.
//!
//! The loop over the contacts reads and writes 16 consecutive numbers of a column at a time, as its formulas need them
//! ([`mod@concordem_contact::columns`]). Stored as rows, they would have to be transposed twice in each step.

use std::marker::PhantomData;
use std::ops::Range;

use bytemuck::Pod;
use concordem_contact::columns::{BATCH, Item, places};
use rayon::prelude::*;

/// A vector of `T`, with a vector of its own for each number of `T`.
#[derive(Debug, Clone)]
pub struct Table<T> {
    columns: Vec<Vec<f64>>,
    of: PhantomData<fn() -> T>,
}

impl<T: Item + Pod> Default for Table<T> {
    fn default() -> Self {
        Self { columns: vec![Vec::new(); Self::WIDTH], of: PhantomData }
    }
}

impl<T: Item + Pod> Table<T> {
    /// Numbers per row; zero for the history of a law without memory.
    pub const WIDTH: usize = {
        assert!(size_of::<T::Arrays>() == BATCH * size_of::<T>(), "columns of a batch have other numbers than rows");
        size_of::<T>() / size_of::<f64>()
    };

    /// Number of rows; zero if rows have no numbers.
    pub fn len(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Row `k`.
    #[inline(always)]
    pub fn get(&self, k: usize) -> T {
        row(self.columns[..Self::WIDTH].iter().map(|column| column[k]))
    }

    /// Replace row `k`.
    #[inline(always)]
    pub fn set(&mut self, k: usize, row: T) {
        for (column, number) in self.columns.iter_mut().zip(numbers(&row)) {
            column[k] = *number;
        }
    }

    /// Replace the numbers of row `k`; missing ones stay, surplus ones are ignored.
    pub fn set_numbers(&mut self, k: usize, numbers: &[f64]) {
        for (column, number) in self.columns.iter_mut().zip(numbers) {
            column[k] = *number;
        }
    }

    /// All rows in their order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = T> + '_ {
        (0..self.len()).map(|k| self.get(k))
    }

    /// Column `n`.
    pub fn column(&self, n: usize) -> &[f64] {
        &self.columns[n]
    }

    /// Column `n`, to change.
    pub fn column_mut(&mut self, n: usize) -> &mut [f64] {
        &mut self.columns[n]
    }

    /// Make room for `count` more rows, and no more.
    pub fn reserve_exact(&mut self, count: usize) {
        self.columns.iter_mut().for_each(|column| column.reserve_exact(count));
    }

    /// Add a row.
    pub fn push(&mut self, row: T) {
        for (column, number) in self.columns.iter_mut().zip(numbers(&row)) {
            column.push(*number);
        }
    }

    /// Insert a row before row `k`.
    pub fn insert(&mut self, k: usize, row: T) {
        for (column, number) in self.columns.iter_mut().zip(numbers(&row)) {
            column.insert(k, *number);
        }
    }

    /// Replace each column by what `change` makes of it, in the same way for all of them.
    pub fn change_columns(&mut self, change: impl FnMut(&mut Vec<f64>)) {
        self.columns.iter_mut().for_each(change);
    }

    /// The numbers of the rows `rows`, row by row.
    pub fn numbers(&self, rows: Range<usize>) -> Vec<f64> {
        const PIECE: usize = 1 << 10;
        let mut numbers = vec![0.0; rows.len() * Self::WIDTH];
        let pieces = numbers.par_chunks_mut((PIECE * Self::WIDTH).max(1)).enumerate();
        pieces.for_each(|(piece, numbers)| {
            let first = rows.start + piece * PIECE;
            let rows = first..rows.end.min(first + PIECE);
            for (n, column) in self.columns.iter().enumerate() {
                let places = numbers.iter_mut().skip(n).step_by(Self::WIDTH);
                for (place, number) in places.zip(&column[rows.clone()]) {
                    *place = *number;
                }
            }
        });
        numbers
    }

    /// A table of the rows whose numbers are `numbers`, row by row; an incomplete row is left out.
    pub fn from_numbers(numbers: &[f64]) -> Self {
        let column = |n| numbers.chunks_exact(Self::WIDTH.max(1)).map(|row| row[n]).collect();
        Self { columns: (0..Self::WIDTH).map(column).collect(), of: PhantomData }
    }

    /// All rows, to change.
    pub fn rows_mut(&mut self) -> Rows<'_, T> {
        Rows { columns: self.columns.iter_mut().map(Vec::as_mut_slice).collect(), of: PhantomData }
    }
}

impl<T: Item + Pod> FromIterator<T> for Table<T> {
    fn from_iter<I: IntoIterator<Item = T>>(rows: I) -> Self {
        let mut table = Self::default();
        rows.into_iter().for_each(|row| table.push(row));
        table
    }
}

/// Consecutive rows of a [`Table`].
#[derive(Debug)]
pub struct Rows<'a, T> {
    columns: Box<[&'a mut [f64]]>,
    of: PhantomData<fn() -> T>,
}

impl<T: Item + Pod> Rows<'_, T> {
    const WIDTH: usize = Table::<T>::WIDTH;

    /// Row `k`.
    #[inline(always)]
    pub fn get(&self, k: usize) -> T {
        row(self.columns[..Self::WIDTH].iter().map(|column| column[k]))
    }

    /// Replace row `k`.
    #[inline(always)]
    pub fn set(&mut self, k: usize, row: T) {
        for (column, number) in self.columns[..Self::WIDTH].iter_mut().zip(numbers(&row)) {
            column[k] = *number;
        }
    }

    /// Take the first `count` rows off.
    pub fn split_off(&mut self, count: usize) -> Self {
        let first = self.columns.iter_mut().map(|column| column.split_off_mut(..count).unwrap_or_default());
        Self { columns: first.collect(), of: PhantomData }
    }

    /// Read a whole batch from row `k` on.
    #[inline(always)]
    pub fn read_run(&self, k: usize, arrays: &mut T::Arrays) {
        for (to, column) in columns_mut::<T>(arrays).iter_mut().zip(&self.columns[..Self::WIDTH]) {
            to.copy_from_slice(&column[k..k + BATCH]);
        }
    }

    /// Replace the rows of a whole batch from row `k` on, but not the last `unchanged` numbers of each.
    #[inline(always)]
    pub fn write_run(&mut self, k: usize, arrays: &T::Arrays, unchanged: usize) {
        for (from, column) in columns::<T>(arrays).iter().zip(&mut self.columns[..Self::WIDTH - unchanged]) {
            column[k..k + BATCH].copy_from_slice(from);
        }
    }

    /// Read the rows `rows`, at most a batch; a group of four places to its end, with the last row. Not inlined: few batches have gaps, and
    /// each loop would contain it.
    #[inline(never)]
    pub fn read(&self, rows: &[u32], arrays: &mut T::Arrays) {
        for i in (0..rows.len()).step_by(4) {
            let [a, b, c, d] = places(i, rows.len()).map(|place| rows[place] as usize);
            for (to, column) in columns_mut::<T>(arrays).iter_mut().zip(&self.columns[..Self::WIDTH]) {
                to[i..i + 4].copy_from_slice(&[column[a], column[b], column[c], column[d]]);
            }
        }
    }

    /// Replace the rows `rows`, at most a batch; as [`Self::read`].
    #[inline(never)]
    pub fn write(&mut self, rows: &[u32], arrays: &T::Arrays) {
        for (i, &k) in rows.iter().enumerate() {
            for (from, column) in columns::<T>(arrays).iter().zip(&mut self.columns[..Self::WIDTH]) {
                column[k as usize] = from[i];
            }
        }
    }
}

/// The row of these numbers.
#[inline(always)]
fn row<T: Pod>(numbers: impl Iterator<Item = f64>) -> T {
    let mut row = T::zeroed();
    if size_of::<T>() == 0 {
        return row;
    }
    for (to, number) in bytemuck::cast_slice_mut(std::slice::from_mut(&mut row)).iter_mut().zip(numbers) {
        *to = number;
    }
    row
}

/// The numbers of a row.
#[inline(always)]
fn numbers<T: Pod>(row: &T) -> &[f64] {
    // A row without numbers need not be aligned for them.
    if size_of::<T>() == 0 { &[] } else { bytemuck::cast_slice(std::slice::from_ref(row)) }
}

#[inline(always)]
fn columns<T: Item>(arrays: &T::Arrays) -> &[[f64; BATCH]] {
    bytemuck::cast_slice(std::slice::from_ref(arrays))
}

#[inline(always)]
fn columns_mut<T: Item>(arrays: &mut T::Arrays) -> &mut [[f64; BATCH]] {
    bytemuck::cast_slice_mut(std::slice::from_mut(arrays))
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable as _;
    use concordem_contact::geometry::PreviousGeometry;
    use concordem_contact::math::Vec3;

    use super::*;

    type Arrays = <PreviousGeometry as Item>::Arrays;

    fn row(k: usize) -> PreviousGeometry {
        let x = |n: usize| (10 * k + n) as f64;
        PreviousGeometry { normal: Vec3::new(x(0), x(1), x(2)), length: x(3) }
    }

    fn table(count: usize) -> Table<PreviousGeometry> {
        (0..count).map(row).collect()
    }

    fn rows(table: &Table<PreviousGeometry>) -> Vec<PreviousGeometry> {
        table.iter().collect()
    }

    /// Rows come back as they were put in, and from their numbers.
    #[test]
    fn rows_survive() {
        let mut table = table(3000);
        table.set(7, row(70));
        table.insert(1, row(100));
        assert_eq!((table.len(), table.get(0), table.get(1), table.get(8)), (3001, row(0), row(100), row(70)));
        assert_eq!(table.column(3)[2], row(1).length);
        let numbers = table.numbers(5..2900);
        assert_eq!(bytemuck::cast_slice::<f64, PreviousGeometry>(&numbers), &rows(&table)[5..2900]);
        assert_eq!(rows(&Table::from_numbers(&table.numbers(0..3001))), rows(&table));
        table.change_columns(|column| column.truncate(2));
        assert_eq!(rows(&table), [row(0), row(100)]);
    }

    concordem_contact::law_state! {
        /// History of a law without memory.
        pub struct NoMemory {}
    }

    /// Rows without numbers.
    #[test]
    fn a_law_needs_no_memory() {
        let mut table: Table<NoMemory> = std::iter::repeat_n(NoMemory {}, 3).collect();
        table.set(2, NoMemory {});
        assert_eq!((table.get(2), table.numbers(0..0)), (NoMemory {}, Vec::new()));
        assert_eq!(concordem_contact::law::LawState::as_reals(&table.get(1)), [0.0; 0]);
        assert_eq!(concordem_contact::law::LawState::swapped(&table.get(1)), NoMemory {});
        assert_eq!(table.rows_mut().split_off(2).get(1), NoMemory {});
    }

    /// A batch of rows that follow each other, and one of any rows, whose last group of four ends with its last row.
    #[test]
    fn batches_are_read_and_written() {
        let mut table = table(40);
        let mut all = table.rows_mut();
        let mut first = all.split_off(30);
        let get = |arrays: &Arrays, i: usize| concordem_contact::columns::Arrays::get(arrays, i);
        let mut arrays = Arrays::zeroed();
        first.read_run(5, &mut arrays);
        assert!((0..BATCH).all(|i| get(&arrays, i) == row(5 + i)));
        first.write_run(10, &arrays, 0);
        first.read(&[0, 3, 6, 9, 12, 15], &mut arrays);
        let expected = [0, 3, 6, 9, 7, 10, 10, 10].map(row);
        assert_eq!(std::array::from_fn(|i| get(&arrays, i)), expected);
        all.write(&[0, 3], &arrays);
        let mut expected: Vec<_> = (0..40).map(row).collect();
        expected.copy_within(5..5 + BATCH, 10);
        (expected[30], expected[33]) = (row(0), row(3));
        assert_eq!(rows(&table), expected);
        // All numbers but the last one.
        let zeros = Arrays::zeroed();
        table.rows_mut().write_run(0, &zeros, 1);
        assert_eq!(table.get(1), PreviousGeometry { normal: Vec3::zeros(), length: row(1).length });
    }
}
