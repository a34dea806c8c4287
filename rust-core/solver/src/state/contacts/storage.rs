//! Blocks as columns of a checkpoint.

use bytemuck::Pod;
use concordem_contact::columns::Item;
use concordem_contact::law::ContactLaw;

use super::{ContactBlock, ContactFlags, Pair};
use crate::state::columns::{Column, ColumnError, ColumnSink, ColumnSource, RowsOfReals};
use crate::state::table::Table;

/// A block as named columns.
pub trait StoreContacts: Send + Sync {
    /// Write all columns under `path`.
    fn write(&self, path: &str, sink: &mut dyn ColumnSink) -> Result<(), ColumnError>;
    /// Replace all columns by those under `path`.
    fn read(&mut self, path: &str, source: &mut dyn ColumnSource) -> Result<(), ColumnError>;
}

/// Write the contacts with history; candidates follow from the positions.
fn write_columns<L: ContactLaw>(
    block: &ContactBlock<L>,
    path: &str,
    sink: &mut dyn ColumnSink,
) -> Result<(), ColumnError> {
    let has_history = |flags: &ContactFlags| {
        flags.bits & (ContactFlags::ACTIVE | ContactFlags::KEPT_REFERENCE | ContactFlags::BROKEN) != 0
    };
    let mut only = ContactBlock::<L>::new(Vec::new());
    let block = if block.flags.iter().all(has_history) {
        block
    } else {
        only.clone_from(block);
        only.retain(has_history);
        &only
    };
    let u32s = |data, components| Column::U32 { data, components, unit: "1" };
    sink.column(&format!("{path}/pair"), u32s(bytemuck::cast_slice(&block.pair), 2))?;
    sink.column(
        &format!("{path}/link"),
        Column::U8 { data: bytemuck::cast_slice(&block.flags), components: 8, unit: "1" },
    )?;
    write_table(&block.reference, &format!("{path}/reference"), "m, m^2", sink)?;
    write_table(&block.previous, &format!("{path}/frame"), "1, 1, 1, m", sink)?;
    write_table(&block.history, &format!("{path}/history"), "see fields", sink)?;
    if block.rest_length.is_empty() {
        return Ok(());
    }
    sink.column(&format!("{path}/rest_length"), Column::f64(&block.rest_length, 1, "m"))
}

/// Write a table row by row.
fn write_table<T: Item + Pod>(
    table: &Table<T>,
    path: &str,
    unit: &'static str,
    sink: &mut dyn ColumnSink,
) -> Result<(), ColumnError> {
    // A law without memory has no history.
    if Table::<T>::WIDTH == 0 {
        return Ok(());
    }
    let rows =
        RowsOfReals { components: Table::<T>::WIDTH, unit, count: table.len(), numbers: &|rows| table.numbers(rows) };
    sink.rows(path, &rows)
}

impl<L: ContactLaw> StoreContacts for ContactBlock<L> {
    fn write(&self, path: &str, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        write_columns(self, path, sink)
    }
    fn read(&mut self, path: &str, source: &mut dyn ColumnSource) -> Result<(), ColumnError> {
        let pair = source.u32(&format!("{path}/pair"))?;
        let flags = source.u8(&format!("{path}/link"))?;
        let reference = source.f64(&format!("{path}/reference"))?;
        let previous = source.f64(&format!("{path}/frame"))?;
        let width = Table::<L::State>::WIDTH;
        let history = if width > 0 { source.f64(&format!("{path}/history"))? } else { Vec::new() };
        let count = pair.len() / 2;
        let rest = format!("{path}/rest_length");
        let rest_length = if source.exists(&rest) { source.f64(&rest)? } else { Vec::new() };
        if !rest_length.is_empty() && rest_length.len() != count {
            return Err(ColumnError::Length { path: rest, expected: count, found: rest_length.len() });
        }
        for (name, found, expected) in [
            ("link", flags.len(), 8 * count),
            ("reference", reference.len(), 2 * count),
            ("frame", previous.len(), 4 * count),
            ("history", history.len(), width * count),
        ] {
            if found != expected {
                return Err(ColumnError::Length { path: format!("{path}/{name}"), expected, found });
            }
        }
        self.pair = pair.chunks_exact(2).map(|p| Pair { a: p[0], b: p[1] }).collect();
        self.flags = flags.chunks_exact(8).map(bytemuck::pod_read_unaligned).collect();
        self.reference = Table::from_numbers(&reference);
        self.previous = Table::from_numbers(&previous);
        self.history = Table::from_numbers(&history);
        self.rest_length = rest_length;
        if let Some(bad) = self.flags.iter().position(|l| usize::from(l.row) >= self.rows.len()) {
            return Err(ColumnError::Value {
                path: format!("{path}/link"),
                row: bad,
                problem: "names pair coefficients that the scenario does not have".into(),
            });
        }
        Ok(())
    }
}
