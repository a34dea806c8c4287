//! Kick and drift of the particles of a chunk: in batches where all are free, else one by one.

use concordem_contact::columns::{BATCH, Columns, Lanes};

use super::KickSums;
use super::batch::FreeKick;
use super::particle::{Chunk, Shared, advance};
use crate::lanes::LanesFnOnce;

/// The loop over the particles of a chunk, with the widest instructions of the processor.
pub(super) struct ChunkLoop<'a, 'b> {
    pub shared: &'a Shared<'a>,
    pub chunk: Chunk<'b>,
}

impl LanesFnOnce for ChunkLoop<'_, '_> {
    type Output = KickSums;
    #[inline(always)]
    fn call<T: Lanes>(self, lanes: T) -> KickSums {
        let Self { shared, mut chunk } = self;
        let mut sums = KickSums::default();
        let count = chunk.position.len();
        if let Some(kick) = FreeKick::of(shared, &chunk) {
            let mut columns = Columns::default();
            for first in (0..count).step_by(BATCH) {
                kick.advance(lanes, &mut columns, shared, &mut chunk, first..count.min(first + BATCH), &mut sums);
            }
        } else {
            for i in 0..count {
                advance(shared, &mut chunk, i, &mut sums);
            }
        }
        sums
    }
}
