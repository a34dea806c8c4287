//! Records the commit and the versions of crates that affect results; they go into the provenance of every file.

use std::path::Path;
use std::process::Command;

/// Crates that affect numbers or files.
const CRATES: [&str; 6] = ["blake3", "hdf5-metno", "libm", "nalgebra", "rayon", "toml"];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    // Builds without a repository, or builds that must not change with every commit, may set the commit.
    println!("cargo::rerun-if-env-changed=CONCORDEM_COMMIT");
    let named = std::env::var("CONCORDEM_COMMIT").ok();
    // In another repository (a vendored copy), the commit would not describe this source.
    let tracked = git(&["ls-files", "--error-unmatch", "build.rs"]).is_some();
    if let Some(commit) = named {
        println!("cargo::rustc-env=CONCORDEM_COMMIT={commit}");
    } else if let Some(mut commit) = git(&["rev-parse", "HEAD"]).filter(|_| tracked) {
        if git(&["status", "--porcelain", "--untracked-files=no"]).is_some_and(|changes| !changes.is_empty()) {
            commit.push_str("+changes");
        }
        println!("cargo::rustc-env=CONCORDEM_COMMIT={commit}");
        println!("cargo::rerun-if-changed=..");
        // HEAD changes on checkout, logs/HEAD on every commit.
        for watched in ["HEAD", "logs/HEAD"] {
            if let Some(path) = git(&["rev-parse", "--git-path", watched]) {
                println!("cargo::rerun-if-changed={path}");
            }
        }
    }
    let lock = Path::new("../../Cargo.lock");
    if let Ok(text) = std::fs::read_to_string(lock) {
        println!("cargo::rerun-if-changed={}", lock.display());
        let versions: Vec<String> = text
            .split("[[package]]")
            .filter_map(|package| {
                let value = |key: &str| {
                    package.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = \"")?.strip_suffix('"'))
                };
                let name = value("name")?;
                CRATES.contains(&name).then(|| format!("{name} {}", value("version").unwrap_or("?")))
            })
            .collect();
        println!("cargo::rustc-env=CONCORDEM_CRATES={}", versions.join(", "));
    }
}
