//! Files that must not be replaced, and files that must not be read.

use std::os::unix::fs::FileTypeExt;
use std::os::unix::fs::symlink;
use std::process::Command;

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

use crate::BLOCK;

/// `--force` replaces regular files only: pipes and devices are refused, links stay and their targets are replaced.
#[test]
fn force_replaces_regular_files_only() {
    let folder = TempDir::new().expect("a folder");
    let scenario = write(folder.path(), "run.toml", BLOCK);
    let result = folder.path().join("run.h5");
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    let pipe = folder.path().join("pipe.h5");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
    let page = folder.path().join("page.html");
    assert!(Command::new("mkfifo").arg(&page).status().expect("mkfifo").success());
    let commands: [&[&str]; 4] = [
        &["run", "-q", "--force", text(&scenario), "-o", text(&pipe)],
        &["pack", "-q", "--force", text(&scenario), "-o", text(&pipe)],
        &["report", "--force", text(&result), "-o", text(&page)],
        &["init", "--template", "cpm-small", "--force", text(&page)],
    ];
    for command in commands {
        let given = concordem(command.iter().copied());
        assert!(given.code == exit::FILE && given.err.contains("not a regular file"), "{command:?}: {}", given.err);
    }
    assert!(std::fs::symlink_metadata(&pipe).expect("the pipe").file_type().is_fifo());
    let link = folder.path().join("link.h5");
    symlink("run.h5", &link).expect("a link");
    let before = std::fs::read(&result).expect("bytes");
    assert_eq!(concordem(["run", "-q", text(&scenario), "-o", text(&link)]).code, exit::FILE, "it exists");
    assert_eq!(concordem(["run", "-q", "--force", text(&scenario), "-o", text(&link)]).code, exit::DONE);
    assert!(std::fs::symlink_metadata(&link).expect("the link").is_symlink());
    assert!(std::fs::read(&result).expect("bytes") != before, "the target is replaced");
}

/// Overwriting a result removes its old CSV table, but not a CSV file that we did not write.
#[test]
fn a_stale_table_is_removed_with_its_result() {
    let folder = TempDir::new().expect("a folder");
    let scenario = write(folder.path(), "run.toml", &BLOCK.replace("[output]", "[output]\ncsv = true"));
    let table = folder.path().join("run.csv");
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    assert!(table.exists());
    write(folder.path(), "run.toml", BLOCK);
    assert_eq!(concordem(["run", "-q", "--force", text(&scenario)]).code, exit::DONE);
    assert!(!table.exists(), "the table belongs to the overwritten result");
    // A file that was not written with a result stays.
    write(folder.path(), "run.csv", "mine\n");
    assert_eq!(concordem(["run", "-q", "--force", text(&scenario)]).code, exit::DONE);
    assert_eq!(std::fs::read_to_string(&table).expect("the file"), "mine\n");
}

/// Devices and pipes, which may never end, are not read.
#[test]
fn devices_and_pipes_are_not_read() {
    let folder = TempDir::new().expect("a folder");
    let pipe = folder.path().join("pipe.txt");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
    for path in ["/dev/zero", text(&pipe)] {
        let packing = format!("kind = \"file\"\npath = \"{path}\"");
        let source =
            BLOCK.replace("kind = \"lattice\"\nlattice = \"hcp\"\nradius = \"1 mm\"\nrepeats = [5, 3, 5]", &packing);
        let scenario = write(folder.path(), "run.toml", &source);
        for command in ["check", "run", "pack"] {
            let given = concordem([command, text(&scenario)]);
            assert_eq!(given.code, exit::USAGE, "{}", given.err);
            assert!(given.err.contains("packing.path") && given.err.contains("not a regular file"), "{}", given.err);
        }
    }
    let given = concordem(["check", "/dev/zero"]);
    assert!(given.code == exit::FILE && given.err.contains("64 MiB"), "{}", given.err);
}

/// All numbers of a good file are readable, and reading a string as a table gives a message that says so.
#[test]
fn tables_of_a_good_file_are_not_called_damaged() {
    let folder = TempDir::new().expect("a folder");
    let scenario = write(folder.path(), "run.toml", BLOCK);
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    let result = ResultFile::open(&folder.path().join("run.h5")).expect("a result");
    let table = result.table("VTKHDF").expect("the snapshots");
    assert!(table.iter().any(|(name, _)| name == "NumberOfPoints"), "{table:?}");
    assert!(!result.table("VTKHDF/Steps").expect("the steps").is_empty());
    let error = result.table("provenance").expect_err("a text").to_string();
    assert!(error.contains("is a string") && !error.contains("damaged"), "{error}");
}
