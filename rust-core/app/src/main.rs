//! The program `concordem`; see [`concordem::program`].

mod memory;

use std::process::ExitCode;

#[global_allocator]
static MEMORY: memory::OrExit = memory::OrExit;

fn main() -> ExitCode {
    concordem::program::main()
}
