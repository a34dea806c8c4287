//! Are good scenarios accepted, and bad ones refused with a message that names place, key, value, and remedy?
//!
//! The messages are stored beside the scenarios; `INSTA_UPDATE=always cargo test -p concordem-tests` renews them.

use std::path::{Path, PathBuf};

use concordem::scenario::{ReadError, Scenario};
use rstest::rstest;

/// Path relative to this folder, in which the tests run: the messages must not depend on where it is.
fn relative(path: &Path) -> &Path {
    path.strip_prefix(env!("CARGO_MANIFEST_DIR")).expect("a file of this folder")
}

fn stem(path: &Path) -> &str {
    path.file_stem().and_then(|stem| stem.to_str()).expect("a file name")
}

#[rstest]
fn bad(#[files("scenarios/bad/*.toml")] path: PathBuf) {
    let error = match Scenario::read(relative(&path)) {
        Err(ReadError::Scenario(error)) => error,
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("{} is accepted", path.display()),
    };
    for problem in &error.problems {
        assert!(problem.span.end <= error.source_text.text.len(), "the place of `{problem}` is outside of the text");
        assert!(!problem.help.is_empty(), "`{problem}` comes without a remedy");
    }
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path("scenarios/bad");
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.set_input_file(relative(&path));
    settings.bind(|| insta::assert_snapshot!(stem(&path), error));
}

#[rstest]
fn good(#[files("scenarios/good/*.toml")] path: PathBuf) {
    if let Err(error) = Scenario::read(relative(&path)) {
        panic!("{error}");
    }
}
