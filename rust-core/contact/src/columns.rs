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

use crate::math::{Quat, Symmetric, Vec3};

/// Largest number of items in a batch.
pub const BATCH: usize = 32;

/// Largest number of scalar components in an input or output.
const COMPONENTS: usize = 37;

/// A value that can be stored in columns: `f64`, a vector, or a struct of [`columns!`](crate::columns!).
pub trait Item: Copy {
    /// [`BATCH`] items, one array per scalar component.
    type Arrays: Arrays<Item = Self>;
}

/// The arrays of [`BATCH`] items. They contain only `f64`.
pub trait Arrays: bytemuck::Pod {
    /// Type of the items.
    type Item: Copy;

    /// Item `i`.
    fn get(&self, i: usize) -> Self::Item;

    /// Write item `i`. To keep registers free, write items of more than some twenty components in parts, field by field.
    fn set(&mut self, i: usize, item: Self::Item);
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
    ($vis:vis $name:ident { $($field:ident : $ty:ty),* $(,)? }) => {
        const _: () = {
            /// One array per scalar component.
            #[derive(Clone, Copy, ::bytemuck::Pod, ::bytemuck::Zeroable)]
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
}

/// Arrays of a vector: x, y, z.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct Vec3Arrays([[f64; BATCH]; 3]);

impl Item for Vec3 {
    type Arrays = Vec3Arrays;
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
#[derive(Debug, Clone)]
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
