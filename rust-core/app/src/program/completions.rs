//! `concordem completions`: scripts with which shells complete commands and options.

use clap::CommandFactory;
use clap_complete::Shell;

use super::{Cli, Console, Failure};

/// Arguments of `concordem completions`.
#[derive(Debug, clap::Args)]
pub(super) struct CompletionsArguments {
    /// Shell
    shell: Shell,
}

pub(super) fn completions(arguments: &CompletionsArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Cli::command(), "concordem", &mut script);
    console.print(&String::from_utf8_lossy(&script))
}
