//! History of a contact: one declaration gives the struct, the description of its fields, and its columns.

use bytemuck::Pod;

use crate::columns::Item;

/// Sign of a field when the two particles of a contact are exchanged (A↔B, hence n → −n).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parity {
    /// Unchanged.
    Even,
    /// Changes sign.
    Odd,
}

/// Description of one field of a law's history.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Field {
    /// Name, as in result files and hosts.
    pub name: &'static str,
    /// SI unit, "1" when dimensionless.
    pub unit: &'static str,
    /// Number of reals: 1 for a scalar, 3 for a vector.
    pub components: usize,
    /// Sign under exchange of the particles.
    pub parity: Parity,
    /// Meaning, with source.
    pub description: &'static str,
}

/// Columns of every contact in tables of contacts; the history has other names.
pub const COLUMNS_OF_EVERY_CONTACT: &[&str] =
    &["a", "b", "index_a", "index_b", "image", "bonded", "reference_length", "area", "length", "normal", "damage"];

/// History of one contact: reals, all zero before the first evaluation.
pub trait LawState: Pod + Item + Default + Send + Sync + core::fmt::Debug + PartialEq {
    /// The fields in storage order. The sum of their components is the number of reals in the struct.
    const FIELDS: &'static [Field];

    /// The history as reals, in the order of [`Self::FIELDS`].
    fn as_reals(&self) -> &[f64] {
        // A history without numbers need not be aligned for them.
        if size_of::<Self>() == 0 { &[] } else { bytemuck::cast_slice(core::slice::from_ref(self)) }
    }

    /// The same contact seen with A and B exchanged.
    fn swapped(&self) -> Self {
        let mut out = *self;
        if size_of::<Self>() == 0 {
            return out;
        }
        let reals: &mut [f64] = bytemuck::cast_slice_mut(core::slice::from_mut(&mut out));
        let mut offset = 0;
        for field in Self::FIELDS {
            if field.parity == Parity::Odd {
                for value in &mut reals[offset..offset + field.components] {
                    *value = -*value;
                }
            }
            offset += field.components;
        }
        out
    }
}

/// Type of a history field in [`law_state!`](crate::law_state): a real or a vector of three.
pub trait FieldType {
    /// Number of reals.
    const COMPONENTS: usize;
}
impl FieldType for f64 {
    const COMPONENTS: usize = 1;
}
impl FieldType for crate::math::Vec3 {
    const COMPONENTS: usize = 3;
}

/// Declare the history of a law: struct, field names, units, parity under exchange of A and B.
///
/// A crate that calls it needs `concordem-contact` among its dependencies, and nothing else.
///
/// ```
/// concordem_contact::law_state! {
///     /// History of a slider.
///     pub struct SliderState {
///         /// Tangential displacement.
///         displacement: concordem_contact::math::Vec3, "m", Odd;
///         /// Work done so far.
///         work: f64, "J", Even;
///     }
/// }
/// use concordem_contact::law::LawState;
/// assert_eq!(SliderState::FIELDS[0].name, "displacement");
/// assert_eq!(SliderState::FIELDS[1].unit, "J");
/// ```
#[macro_export]
macro_rules! law_state {
    // The derive macro of bytemuck wants the path of bytemuck as text, which cannot hold `$crate`.
    (in $path:tt $(#[$meta:meta])* pub struct $name:ident { $($(#[doc = $doc:literal])+ $field:ident : $ty:ty, $unit:literal, $parity:ident;)* }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Default, $crate::bytemuck::Pod, $crate::bytemuck::Zeroable)]
        #[bytemuck(crate = $path)]
        #[repr(C)]
        pub struct $name { $($(#[doc = $doc])+ pub $field: $ty,)* }
        impl $crate::law::LawState for $name {
            const FIELDS: &'static [$crate::law::Field] = &[$($crate::law::Field {
                name: stringify!($field),
                unit: $unit,
                components: <$ty as $crate::law::state::FieldType>::COMPONENTS,
                parity: $crate::law::Parity::$parity,
                description: concat!($($doc),+),
            }),*];
        }
        $crate::column_arrays! { in $path pub $name { $($field: $ty),* } }
    };
    ($($law:tt)*) => { $crate::law_state! { in "::concordem_contact::bytemuck" $($law)* } };
}
