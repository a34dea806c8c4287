//! Struct-of-arrays storage: one formula for many contacts.
//!
//! A batch stores each scalar component of its contacts in an array of [`BATCH`] numbers. A [`Formula`] without branches
//! runs over these arrays, and the compiler uses the vector registers of the processor. The compiler neither fuses nor
//! reorders operations, so a batch gives the same bits as the formula applied to each contact alone.
//!
//! [`columns!`](crate::columns!) declares the numbers of one contact as a plain struct with named fields and derives their
//! arrays:
//!
//! ```
//! use concordem_contact::columns::{Arrays, Columns, Formula};
//! use concordem_contact::math::Vec3;
//!
//! concordem_contact::columns! {
//!     /// A spring between two points.
//!     struct Spring {
//!         /// Vector from one end to the other, m.
//!         branch: Vec3,
//!         /// Length without force, m.
//!         rest_length: f64,
//!     }
//! }
//!
//! /// Force of a spring of stiffness `self.0` (N/m), N: `k (l − l₀)`.
//! struct Force(f64);
//!
//! impl Formula for Force {
//!     type Input = Spring;
//!     type Output = f64;
//!     fn apply(&self, spring: Spring) -> f64 {
//!         self.0 * (spring.branch.norm() - spring.rest_length)
//!     }
//! }
//!
//! let mut columns = Columns::default();
//! let springs = columns.input::<Spring>();
//! springs.set(0, Spring { branch: Vec3::x() * 3.0, rest_length: 1.0 });
//! // Parts of an item can be written on their own.
//! springs.branch.set(1, Vec3::y() * 2.0);
//! springs.rest_length.set(1, 1.0);
//! columns.apply(&Force(10.0));
//! assert_eq!((columns.output::<f64>().get(0), columns.output::<f64>().get(1)), (20.0, 10.0));
//! ```

use bytemuck::Pod;

use crate::math::{Quat, Symmetric, Vec3};

/// Largest number of items in a batch.
pub const BATCH: usize = 16;

/// Largest number of scalar components in an input or output.
const COMPONENTS: usize = 40;

/// A value that can be stored in columns: `f64`, a vector, or a struct of [`columns!`](crate::columns!).
pub trait Item: Copy {
    /// [`BATCH`] items, one array per scalar component.
    type Arrays: Arrays<Item = Self>;
}

/// The arrays of [`BATCH`] items. They contain only `f64`.
pub trait Arrays: Pod {
    /// Type of the items.
    type Item: Copy;

    /// Item `i`.
    fn get(&self, i: usize) -> Self::Item;

    /// Write item `i`. To keep registers free, write items of more than some twenty components in parts, field by field.
    fn set(&mut self, i: usize, item: Self::Item);

    /// Write items `i` to `i + 3`, for an `i` that is a multiple of 4. Faster than four times [`Self::set`], which needs a store for every
    /// number: a processor stores once per cycle, whether one number or four.
    #[inline(always)]
    fn set_four(&mut self, i: usize, items: [&Self::Item; 4], lanes: impl Lanes)
    where
        Self::Item: Pod,
    {
        let [a, b, c, d] = items;
        let rows = [numbers(a), numbers(b), numbers(c), numbers(d)];
        let columns = bytemuck::cast_slice_mut::<Self, [f64; BATCH]>(core::slice::from_mut(self));
        let i = group_of(i);
        for first in (0..columns.len()).step_by(4) {
            set_square(columns, first, i, &rows, lanes);
        }
    }

    /// Items `i` to `i + 3`, as by [`Self::get`], for an `i` that is a multiple of 4.
    #[inline(always)]
    fn get_four(&self, i: usize, lanes: impl Lanes) -> [Self::Item; 4]
    where
        Self::Item: Pod,
    {
        let columns = bytemuck::cast_slice::<Self, [f64; BATCH]>(core::slice::from_ref(self));
        let i = group_of(i);
        let mut items = [<Self::Item as bytemuck::Zeroable>::zeroed(); 4];
        for first in (0..columns.len()).step_by(4) {
            get_square(columns, first, i, &mut items, lanes);
        }
        items
    }
}

/// `i`, which is the first place of a group of four. The compiler then knows that the group lies in the columns.
#[inline(always)]
fn group_of(i: usize) -> usize {
    debug_assert!(i.is_multiple_of(4) && i < BATCH);
    i & (BATCH - 4)
}

/// Write the numbers `first` to `first + 3` of four rows, or to their end, to as many columns, at place `i`.
#[inline(always)]
fn set_square(columns: &mut [[f64; BATCH]], first: usize, i: usize, rows: &[&[f64]; 4], lanes: impl Lanes) {
    // The last square may overlap the one before.
    let start = first.min(columns.len().saturating_sub(4));
    let [a, b, c, d] = rows;
    let square = lanes.transposed([four(a, start), four(b, start), four(c, start), four(d, start)]);
    for (column, numbers) in columns[start..].iter_mut().zip(square).skip(first - start) {
        column[i..i + 4].copy_from_slice(&numbers);
    }
}

/// Read the numbers `first` to `first + 3` of four items, or to their end, from as many columns, at place `i`.
#[inline(always)]
fn get_square<I: Pod>(columns: &[[f64; BATCH]], first: usize, i: usize, items: &mut [I; 4], lanes: impl Lanes) {
    let count = columns.len();
    let start = first.min(count.saturating_sub(4));
    let mut rows = [[0.0; 4]; 4];
    for (row, column) in rows.iter_mut().zip(&columns[start..]) {
        *row = four(column, i);
    }
    let square = lanes.transposed(rows);
    let end = count.min(start + 4);
    for (item, numbers) in items.iter_mut().zip(square) {
        let row = bytemuck::cast_slice_mut::<I, f64>(core::slice::from_mut(item));
        row[first..end].copy_from_slice(&numbers[first - start..end - start]);
    }
}

/// The numbers of an item.
#[inline(always)]
fn numbers<I: Pod>(item: &I) -> &[f64] {
    bytemuck::cast_slice(core::slice::from_ref(item))
}

/// Four numbers from place `first` on; zeros in place of those that a short row lacks.
#[inline(always)]
fn four(numbers: &[f64], first: usize) -> [f64; 4] {
    if let Some(numbers) = numbers[first..].first_chunk() {
        return *numbers;
    }
    match numbers[first..] {
        [a, b, c] => [a, b, c, 0.0],
        [a, b] => [a, b, 0.0, 0.0],
        [a] => [a, 0.0, 0.0, 0.0],
        _ => [0.0; 4],
    }
}

/// Items `i` to `i + 3` of a batch of `count`; in place of those that do not exist, the last one.
#[inline(always)]
pub fn places(i: usize, count: usize) -> [usize; 4] {
    let last = count - 1;
    [i.min(last), (i + 1).min(last), (i + 2).min(last), (i + 3).min(last)]
}

/// Moves numbers between rows and columns, four by four.
pub trait Lanes: Copy {
    /// Number `k` of row `r` of the result is number `r` of row `k`.
    fn transposed(self, rows: [[f64; 4]; 4]) -> [[f64; 4]; 4];
}

/// [`Lanes`] without vector instructions.
#[derive(Debug, Clone, Copy)]
pub struct Scalar;

impl Lanes for Scalar {
    #[inline(always)]
    fn transposed(self, rows: [[f64; 4]; 4]) -> [[f64; 4]; 4] {
        let [a, b, c, d] = rows;
        let column = |k: usize| [a[k], b[k], c[k], d[k]];
        [column(0), column(1), column(2), column(3)]
    }
}

impl Item for f64 {
    type Arrays = [Self; BATCH];
}

impl Arrays for [f64; BATCH] {
    type Item = f64;

    #[inline(always)]
    fn get(&self, i: usize) -> f64 {
        self[i]
    }

    #[inline(always)]
    fn set(&mut self, i: usize, item: f64) {
        self[i] = item;
    }
}

/// Declare structs of scalars, vectors, and other such structs, which can be stored in columns: [`Item`](crate::columns::Item).
///
/// The arrays have the same field names as the struct. See the [module documentation](mod@crate::columns) for an example.
#[macro_export]
macro_rules! columns {
    ($($(#[$meta:meta])* $vis:vis struct $name:ident { $($(#[$field_meta:meta])* $field_vis:vis $field:ident : $ty:ty),* $(,)? })*) => {$(
        $(#[$meta])*
        #[derive(Debug, Clone, Copy)]
        $vis struct $name { $($(#[$field_meta])* $field_vis $field: $ty,)* }
        $crate::column_arrays! { $vis $name { $($field: $ty),* } }
    )*};
}

/// Derive the arrays of a struct that exists: visibility, name, and `field: type` of every field. See
/// [`columns!`](crate::columns!).
#[macro_export]
macro_rules! column_arrays {
    (in $path:tt $vis:vis $name:ident { $($field:ident : $ty:ty),* $(,)? }) => {
        const _: () = {
            /// One array per scalar component.
            #[derive(Clone, Copy, $crate::bytemuck::Pod, $crate::bytemuck::Zeroable)]
            #[bytemuck(crate = $path)]
            #[repr(C)]
            $vis struct ItemArrays { $($vis $field: <$ty as $crate::columns::Item>::Arrays,)* }

            impl $crate::columns::Item for $name {
                type Arrays = ItemArrays;
            }

            impl $crate::columns::Arrays for ItemArrays {
                type Item = $name;

                #[inline(always)]
                fn get(&self, i: usize) -> $name {
                    $name { $($field: $crate::columns::Arrays::get(&self.$field, i),)* }
                }

                #[inline(always)]
                fn set(&mut self, i: usize, item: $name) {
                    $($crate::columns::Arrays::set(&mut self.$field, i, item.$field);)*
                }
            }
        };
    };
    ($($item:tt)*) => { $crate::column_arrays! { in "::concordem_contact::bytemuck" $($item)* } };
}

/// Arrays of a vector: x, y, z.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct Vec3Arrays([[f64; BATCH]; 3]);

impl Item for Vec3 {
    type Arrays = Vec3Arrays;
}

impl Vec3Arrays {
    /// Whether an item has a number other than zero. Without branches; unused items count, too.
    #[inline(always)]
    pub fn any_nonzero(&self) -> bool {
        let mut any = false;
        for column in &self.0 {
            for number in column {
                any |= *number != 0.0;
            }
        }
        any
    }

    /// x, y, and z of all items.
    #[inline(always)]
    pub fn columns(&self) -> &[[f64; BATCH]] {
        &self.0
    }
}

/// Whether all numbers of the first `count` items of these columns are zero, and not -0.
#[inline(always)]
pub fn all_plus_zero(columns: &[[f64; BATCH]], count: usize) -> bool {
    let mut bits = 0;
    for column in columns {
        // A whole column has a known length: no loop, and no branch per number.
        if count == BATCH {
            for number in column {
                bits |= number.to_bits();
            }
        } else {
            for number in &column[..count] {
                bits |= number.to_bits();
            }
        }
    }
    bits == 0
}

impl Arrays for Vec3Arrays {
    type Item = Vec3;

    #[inline(always)]
    fn get(&self, i: usize) -> Vec3 {
        let [x, y, z] = &self.0;
        Vec3::new(x[i], y[i], z[i])
    }

    #[inline(always)]
    fn set(&mut self, i: usize, item: Vec3) {
        let [x, y, z] = &mut self.0;
        (x[i], y[i], z[i]) = (item.x, item.y, item.z);
    }
}

/// Arrays of a quaternion: i, j, k, w.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct QuatArrays([[f64; BATCH]; 4]);

impl Item for Quat {
    type Arrays = QuatArrays;
}

impl Arrays for QuatArrays {
    type Item = Quat;

    #[inline(always)]
    fn get(&self, n: usize) -> Quat {
        let [i, j, k, w] = &self.0;
        Quat::new(w[n], i[n], j[n], k[n])
    }

    #[inline(always)]
    fn set(&mut self, n: usize, item: Quat) {
        let [i, j, k, w] = &mut self.0;
        (i[n], j[n], k[n], w[n]) = (item.i, item.j, item.k, item.w);
    }
}

/// Arrays of a symmetric matrix, in its order of components.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct SymmetricArrays([[f64; BATCH]; 6]);

impl Item for Symmetric {
    type Arrays = SymmetricArrays;
}

impl Arrays for SymmetricArrays {
    type Item = Symmetric;

    #[inline(always)]
    fn get(&self, i: usize) -> Symmetric {
        Symmetric(core::array::from_fn(|k| self.0[k][i]))
    }

    #[inline(always)]
    fn set(&mut self, i: usize, item: Symmetric) {
        for (column, value) in self.0.iter_mut().zip(item.0) {
            column[i] = value;
        }
    }
}

/// A function of one item. Without branches it runs in vector registers.
pub trait Formula {
    /// Type of the argument.
    type Input: Item;
    /// Type of the result.
    type Output: Item;

    /// The result for one item.
    fn apply(&self, input: Self::Input) -> Self::Output;
}

/// Memory for the inputs and outputs of a batch, reused from batch to batch and by all formulas.
///
/// Aligned, so that no access in vector registers crosses the border of two cache lines.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub struct Columns {
    input: [[f64; BATCH]; COMPONENTS],
    output: [[f64; BATCH]; COMPONENTS],
}

impl Default for Columns {
    fn default() -> Self {
        Self { input: [[0.0; BATCH]; COMPONENTS], output: [[0.0; BATCH]; COMPONENTS] }
    }
}

impl Columns {
    /// The input arrays of a formula that reads `I`.
    #[inline(always)]
    pub fn input<I: Item>(&mut self) -> &mut I::Arrays {
        arrays_mut::<I>(&mut self.input)
    }

    /// The output arrays of a formula that returns `O`.
    #[inline(always)]
    pub fn output<O: Item>(&self) -> &O::Arrays {
        arrays::<O>(&self.output)
    }

    /// [`Self::output`], to change.
    #[inline(always)]
    pub fn output_mut<O: Item>(&mut self) -> &mut O::Arrays {
        arrays_mut::<O>(&mut self.output)
    }

    /// The input arrays of a formula that reads `I`, and the output arrays of one that returns `O`.
    #[inline(always)]
    pub fn both<I: Item, O: Item>(&mut self) -> (&mut I::Arrays, &O::Arrays) {
        (arrays_mut::<I>(&mut self.input), arrays::<O>(&self.output))
    }

    /// Apply a formula to all [`BATCH`] items. Unused items are computed too, from whatever the memory contains.
    #[inline(always)]
    pub fn apply<F: Formula>(&mut self, formula: &F) {
        let (input, output) = (arrays::<F::Input>(&self.input), arrays_mut::<F::Output>(&mut self.output));
        for i in 0..BATCH {
            output.set(i, formula.apply(input.get(i)));
        }
    }
}

/// Scalar components of an item.
const fn components<I: Item>() -> usize {
    let components = size_of::<I::Arrays>() / size_of::<[f64; BATCH]>();
    assert!(components <= COMPONENTS, "more components than Columns has arrays");
    components
}

#[inline(always)]
fn arrays<I: Item>(memory: &[[f64; BATCH]; COMPONENTS]) -> &I::Arrays {
    let used = &memory[..const { components::<I>() }];
    &bytemuck::cast_slice(used)[0]
}

#[inline(always)]
fn arrays_mut<I: Item>(memory: &mut [[f64; BATCH]; COMPONENTS]) -> &mut I::Arrays {
    let used = &mut memory[..const { components::<I>() }];
    &mut bytemuck::cast_slice_mut(used)[0]
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable as _;

    use super::*;

    columns! {
        struct Part {
            quaternion: Quat,
            symmetric: Symmetric,
        }

        struct Whole {
            scalar: f64,
            vector: Vec3,
            part: Part,
        }
    }

    /// Reorders the components, so that a wrong offset shows.
    struct Negate;

    impl Formula for Negate {
        type Input = Whole;
        type Output = Part;

        fn apply(&self, input: Whole) -> Part {
            let w = input.scalar + input.vector.sum();
            Part {
                quaternion: Quat::new(w, -input.part.quaternion.i, -input.part.quaternion.j, -input.part.quaternion.k),
                symmetric: input.part.symmetric * -1.0,
            }
        }
    }

    /// Four items at a time as one at a time: items of fewer numbers than a square of four has, of several squares, and of squares that
    /// overlap. Other places keep their numbers.
    #[test]
    fn four_items_move_as_one_by_one() {
        fn check<I: Item + PartialEq + std::fmt::Debug + Pod>() {
            let item = |i: usize| {
                let mut item = I::zeroed();
                let numbers: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut item));
                for (k, number) in numbers.iter_mut().enumerate() {
                    *number = (100 * i + k + 1) as f64;
                }
                item
            };
            let (mut by_four, mut by_one) = (I::Arrays::zeroed(), I::Arrays::zeroed());
            for first in (0..BATCH - 4).step_by(4) {
                let items = [item(first), item(first + 1), item(first + 2), item(first + 3)];
                by_four.set_four(first, [&items[0], &items[1], &items[2], &items[3]], Scalar);
                for (r, item) in items.into_iter().enumerate() {
                    by_one.set(first + r, item);
                }
                assert_eq!(by_four.get_four(first, Scalar), items);
            }
            assert_eq!(bytemuck::bytes_of(&by_four), bytemuck::bytes_of(&by_one));
            assert_eq!(by_four.get_four(BATCH - 4, Scalar), [I::zeroed(); 4]);
        }
        check::<f64>();
        check::<crate::geometry::Reference>();
        check::<Vec3>();
        check::<crate::geometry::PreviousGeometry>();
        check::<Symmetric>();
        check::<crate::wrench::Wrench>();
        check::<crate::law::LinearBondState>();
        check::<crate::law::CpmState>();
        check::<crate::wrench::Wrenches>();
    }

    /// In place of contacts that do not exist, the last one.
    #[test]
    fn places_repeat_the_last_one() {
        assert_eq!((places(0, 16), places(12, 16)), ([0, 1, 2, 3], [12, 13, 14, 15]));
        assert_eq!((places(0, 1), places(4, 6)), ([0; 4], [4, 5, 5, 5]));
    }

    /// Any number of any item counts, in either sign; -0 is zero.
    #[test]
    fn a_number_other_than_zero_is_found() {
        let mut arrays = <Vec3 as Item>::Arrays::zeroed();
        arrays.set(3, Vec3::new(0.0, -0.0, 0.0));
        assert!(!arrays.any_nonzero());
        for (i, axis) in [(0, 0), (7, 1), (BATCH - 1, 2)] {
            let mut item = Vec3::zeros();
            item[axis] = -1e-300;
            arrays.set(i, item);
            assert!(arrays.any_nonzero());
            arrays.set(i, Vec3::zeros());
            assert!(!arrays.any_nonzero());
        }
    }

    /// Only the first items count, each of their numbers, and -0 is not zero.
    #[test]
    fn plus_zeros_are_told_from_other_numbers() {
        for count in [1, 7, BATCH] {
            let mut columns = [[0.0; BATCH]; 2];
            assert!(all_plus_zero(&columns, count));
            for (column, i) in [(0, 0), (1, count - 1)] {
                for number in [-0.0, 1e-300, f64::NAN] {
                    columns[column][i] = number;
                    assert!(!all_plus_zero(&columns, count), "{number} in item {i} of {count}");
                }
                columns[column][i] = 0.0;
            }
            if let Some(unused) = columns[1].get_mut(count) {
                *unused = 1.0;
                assert!(all_plus_zero(&columns, count));
            }
        }
    }

    /// Every component comes back from its own array.
    #[test]
    fn items_survive_columns() {
        let item = |i: usize| {
            let x = |k: usize| (i * 100 + k) as f64;
            let part = Part {
                quaternion: Quat::new(x(4), x(5), x(6), x(7)),
                symmetric: Symmetric(std::array::from_fn(|k| x(8 + k))),
            };
            Whole { scalar: x(0), vector: Vec3::new(x(1), x(2), x(3)), part }
        };
        let mut columns = Columns::default();
        for i in 0..BATCH {
            let arrays = columns.input::<Whole>();
            let Whole { scalar, vector, part } = item(i);
            arrays.scalar.set(i, scalar);
            arrays.vector.set(i, vector);
            arrays.part.set(i, part);
        }
        columns.apply(&Negate);
        for i in 0..BATCH {
            let (expected, found) = (item(i), columns.output::<Part>().get(i));
            let turned = expected.part.quaternion;
            let w = expected.scalar + expected.vector.sum();
            assert_eq!(found.quaternion, Quat::new(w, -turned.i, -turned.j, -turned.k));
            assert_eq!(found.symmetric, expected.part.symmetric * -1.0);
        }
    }
}
