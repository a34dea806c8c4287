//! The loops over the contacts of one law.
//!
//! Every crate that uses a generic function compiles it again, for each law in one piece. The loops are by far the
//! largest generic functions of ConcorDEM. Therefore this crate compiles those of the registered laws once. They
//! compile in parallel, because the compiler puts the methods of an `impl` into the unit of the law's own module.

use concordem_contact::law::ContactLaw;

use super::record::{ContactRecord, WallForces};
use super::{ParticleSums, StepContext, Tile, Totals};
use crate::state::Wall;
use crate::state::contacts::ContactBlock;

/// The loops over the contacts of one law; [`compile_loops!`](crate::compile_loops) implements them.
#[diagnostic::on_unimplemented(
    message = "the loops over contacts of the law `{Self}` are not compiled",
    note = "register the law (`for_each_law!`), or call `concordem_solver::compile_loops!(YourLaw)` in the crate of the law"
)]
pub trait LawLoops: ContactLaw {
    /// Evaluate the contacts of a tile; see [`EvaluatedContacts::evaluate`](super::EvaluatedContacts::evaluate).
    fn evaluate_tile(context: &StepContext<'_>, rows: &[Self], tile: Tile<'_, Self>) -> Totals;
    /// Evaluate contacts with walls; see [`EvaluatedContacts::evaluate_walls`](super::EvaluatedContacts::evaluate_walls).
    /// The forces are also appended to `record`, if there is one.
    fn evaluate_walls(
        block: &mut ContactBlock<Self>,
        context: &StepContext<'_>,
        walls: &mut [Wall],
        sums: ParticleSums<'_>,
        record: Option<&mut WallForces>,
    ) -> Totals;
    /// Force and damage of contact `k` at the present positions.
    fn record_contact(block: &ContactBlock<Self>, k: usize, context: &StepContext<'_>) -> ContactRecord;
}

/// Compile the loops over contacts ([`LawLoops`](crate::forces::LawLoops)) of the given laws in the calling crate.
#[macro_export]
macro_rules! compile_loops {
    ($($law:ty),+ $(,)?) => {$(
        impl $crate::forces::LawLoops for $law {
            #[inline(never)]
            fn evaluate_tile(
                context: &$crate::forces::StepContext<'_>,
                rows: &[Self],
                tile: $crate::forces::Tile<'_, Self>,
            ) -> $crate::forces::Totals {
                $crate::forces::evaluate_tile(context, rows, tile)
            }
            #[inline(never)]
            fn evaluate_walls(
                block: &mut $crate::state::contacts::ContactBlock<Self>,
                context: &$crate::forces::StepContext<'_>,
                walls: &mut [$crate::state::Wall],
                sums: $crate::forces::ParticleSums<'_>,
                record: Option<&mut $crate::record::WallForces>,
            ) -> $crate::forces::Totals {
                $crate::walls::evaluate(block, context, walls, sums, record)
            }
            #[inline(never)]
            fn record_contact(
                block: &$crate::state::contacts::ContactBlock<Self>,
                k: usize,
                context: &$crate::forces::StepContext<'_>,
            ) -> $crate::record::ContactRecord {
                $crate::record::contact_record(block, k, context)
            }
        }
    )+};
}

macro_rules! compile_listed {
    ($($key:ident: $Law:ident,)*) => { compile_loops!($(concordem_contact::law::$key::$Law),*); };
}
concordem_contact::for_each_law!(compile_listed);
compile_loops!(concordem_contact::law::jointed::JointedRock);
