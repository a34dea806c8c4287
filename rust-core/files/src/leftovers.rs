//! Incomplete files and folders that killed processes have left.

use std::fs::{self, File};
use std::path::Path;
use std::time::Duration;

use crate::paths::UNFINISHED;

/// Leftovers without content must be older than this: another process may not yet have locked a file or folder that it just created.
const YOUNGEST_LEFTOVER: Duration = Duration::from_secs(60);

/// Removes incomplete files and folders of killed processes from the folder of a result. Running processes hold locks
/// on theirs, which they take before they write into them.
///
/// Failures are ignored, because leftovers are harmless.
pub fn sweep(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let path = entry.path();
        if !entry.file_name().as_encoded_bytes().starts_with(UNFINISHED.as_bytes()) {
            continue;
        }
        let Ok(data) = fs::symlink_metadata(&path) else { continue };
        if data.is_dir() {
            let lock = path.join("lock");
            let is_written = fs::read_dir(&path)
                .is_ok_and(|mut all| all.any(|entry| entry.is_ok_and(|entry| entry.file_name() != "lock")));
            if (is_written || is_old(&data)) && (!lock.exists() || is_free(&lock)) {
                let _ = fs::remove_dir_all(&path);
            }
        } else if data.is_file() && (data.len() > 0 || is_old(&data)) && is_free(&path) {
            let _ = fs::remove_file(&path);
        }
    }
}

/// Whether a file was changed more than [`YOUNGEST_LEFTOVER`] ago, or as far in the future: the clock was set back.
fn is_old(data: &fs::Metadata) -> bool {
    let age = data.modified().map(|then| then.elapsed().unwrap_or_else(|ahead| ahead.duration()));
    age.is_ok_and(|age| age >= YOUNGEST_LEFTOVER)
}

/// Whether no running process holds the lock on a file.
fn is_free(path: &Path) -> bool {
    File::options().read(true).write(true).open(path).is_ok_and(|file| file.try_lock().is_ok())
}
