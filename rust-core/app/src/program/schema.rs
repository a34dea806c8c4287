//! `concordem schema`: the JSON Schema of scenarios and sweeps.

use super::{Console, Failure};

/// Arguments of `concordem schema`.
#[derive(Debug, clap::Args)]
pub(super) struct SchemaArguments {
    /// Print the schema of sweep files instead of scenarios
    #[arg(long)]
    sweep: bool,
}

pub(super) fn schema(arguments: &SchemaArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let schema = if arguments.sweep { crate::sweep::schema() } else { concordem_scenario::schema::schema() };
    console.print(&format!("{schema:#}\n"))
}
