//! Sums over tiles of fixed size: parallel, and the same bits for any number of threads.

use crate::interruption::Watch;
use rayon::prelude::*;
use std::ops::{AddAssign, Range};

/// Entries per tile.
pub(super) const TILE: usize = 8192;

/// `Σ` of `tile` over consecutive ranges that cover `0..count`, added in ascending order.
pub(super) fn sum_tiles<T, F>(count: usize, tile: F) -> T
where
    T: Default + AddAssign + Send,
    F: Fn(Range<usize>) -> T + Sync,
{
    let mut total = T::default();
    if count <= TILE {
        // The same operations as below: one tile added to zero.
        total += tile(0..count);
        return total;
    }
    let watch = Watch::here();
    let part = |k: usize| {
        watch.look();
        tile(k * TILE..((k + 1) * TILE).min(count))
    };
    let parts: Vec<T> = (0..count.div_ceil(TILE)).into_par_iter().map(part).collect();
    for part in parts {
        total += part;
    }
    total
}

/// Several sums at once.
macro_rules! sums {
    ($(#[$doc:meta])* $name:ident { $($field:ident : $type:ty),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, Default)]
        pub(super) struct $name { $(pub(super) $field: $type),* }
        impl std::ops::AddAssign for $name {
            fn add_assign(&mut self, other: Self) { $(self.$field += other.$field;)* }
        }
    };
}
pub(super) use sums;
