//! Provenance: name, version, and build of the program.

/// Name and version of this program.
pub const PROGRAM: &str = concat!("concordem ", env!("CARGO_PKG_VERSION"));

/// Name of the entry with the scenario's file.
pub const SCENARIO_FILE: &str = "scenario_file";

/// Commit of the source; "unknown" outside a repository; with "+changes" if files differed from it.
pub const COMMIT: &str = match option_env!("CONCORDEM_COMMIT") {
    Some(commit) => commit,
    None => "unknown",
};

/// Versions of the crates that affect numbers or files.
pub const CRATES: &str = match option_env!("CONCORDEM_CRATES") {
    Some(crates) => crates,
    None => "unknown",
};

/// Provenance of the program, the same for all runs: pairs of name and value.
pub fn of_program() -> Vec<(String, String)> {
    let (major, minor, patch) = hdf5::library_version();
    [
        ("program", PROGRAM.to_owned()),
        ("commit", COMMIT.to_owned()),
        ("crates", CRATES.to_owned()),
        ("hdf5_library", format!("{major}.{minor}.{patch}")),
        ("system", format!("{} {}", std::env::consts::OS, std::env::consts::ARCH)),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .to_vec()
}
