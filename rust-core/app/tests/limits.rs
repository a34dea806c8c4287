//! Limits of the process: a small stack does not matter, and too little memory is an error.

use std::path::Path;
use std::process::{Command, Output};

use concordem::program::exit;

/// A lattice of `count` spheres along each edge, bonded, for ten steps.
fn scenario(folder: &Path, count: usize) -> String {
    let text = format!(
        "version = 1
        [packing]
        kind = \"lattice\"
        lattice = \"sc\"
        radius = \"1 mm\"
        repeats = [{count}, {count}, {count}]
        [[material]]
        name = \"m\"
        density = 2500
        linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 5e5 }}
        [bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.01
        [contacts]
        law = \"none\"
        [stop]
        steps = 10"
    );
    let path = folder.join(format!("{count}.toml"));
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

/// Runs a scenario with a limit of the shell.
fn limited(limit: &str, scenario: &str) -> Output {
    let script = format!("ulimit {limit} && exec \"$0\" run --quiet --force --threads 1 \"$1\"");
    Command::new("sh").args(["-c", &script, env!("CARGO_BIN_EXE_concordem"), scenario]).output().expect("a shell")
}

fn assert_ends(found: &Output, code: u8, words: &str) {
    let text = String::from_utf8_lossy(&found.stderr);
    assert_eq!(found.status.code(), Some(i32::from(code)), "{text}");
    assert!(text.contains(words), "{text}");
}

#[test]
fn a_small_stack_suffices() {
    let folder = tempfile::tempdir().unwrap();
    assert_ends(&limited("-s 64", &scenario(folder.path(), 4)), exit::DONE, "");
}

/// A run that needs more than the limit is refused beforehand. Where an estimate is too low, the program ends with a message when memory is
/// refused, and not with an abort.
#[test]
fn too_little_memory_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let large = scenario(folder.path(), 300);
    // 2 GB for 27 million spheres: the message names the key.
    assert_ends(&limited("-v 2000000", &large), exit::USAGE, "of memory for 2.7000e7 particles");
    // Some limit lies between what the program needs to start and what it needs for the run.
    let small = scenario(folder.path(), 40);
    let mut refused = false;
    for megabytes in (80..=320).step_by(60) {
        let found = limited(&format!("-v {}", megabytes * 1000), &small);
        let text = String::from_utf8_lossy(&found.stderr).into_owned();
        // Below that limit the system cannot load the program, or start a thread.
        let code = found.status.code();
        assert!(code.is_some(), "{megabytes} MB: killed by a signal: {text}");
        refused |= code == Some(i32::from(exit::PHYSICS)) && text.contains("memory");
    }
    assert!(refused, "no limit was too low");
}
