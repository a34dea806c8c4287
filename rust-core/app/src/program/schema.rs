//! `concordem schema`: the JSON Schema of scenarios.

use super::{Console, Failure};

/// Arguments of `concordem schema`.
#[derive(Debug, clap::Args)]
pub(super) struct SchemaArguments {}

pub(super) fn schema(_: &SchemaArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    console.print(&format!("{:#}\n", concordem_scenario::schema::schema()))
}
