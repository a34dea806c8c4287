//! The program `concordem`; see [`concordem::program`].

use std::process::ExitCode;

fn main() -> ExitCode {
    concordem::program::main()
}
