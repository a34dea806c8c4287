//! Fields of snapshots as numbers and vectors.

use concordem_contact::math::Vec3;
use concordem_solver::state::columns::ColumnData;

use crate::output::frames::Frame;

/// A field of real numbers; empty if the frame has none with this name.
pub(super) fn reals<'a>(frame: &'a Frame, name: &str) -> &'a [f64] {
    match frame.field(name) {
        Some(ColumnData::F64(values)) => values,
        _ => &[],
    }
}

/// Vectors from their components.
pub(super) fn vectors(values: &[f64]) -> Vec<Vec3> {
    values.chunks_exact(3).map(Vec3::from_column_slice).collect()
}

/// Whole numbers of a field.
pub(super) fn whole(frame: &Frame, name: &str) -> Vec<usize> {
    match frame.field(name) {
        Some(ColumnData::U32(values)) => values.iter().map(|value| *value as usize).collect(),
        Some(ColumnData::U16(values)) => values.iter().map(|value| usize::from(*value)).collect(),
        Some(ColumnData::U8(values)) => values.iter().map(|value| usize::from(*value)).collect(),
        _ => Vec::new(),
    }
}
