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

/// Name of the entry with the reason why a run ended.
pub(crate) const STOPPED: &str = "stopped_because";

/// What that reason begins with in the result of an unfinished run.
pub(crate) const UNFINISHED: &str = "not finished";

/// Name of the entry with the date on which a run ended.
pub(crate) const ENDED: &str = "ended_utc";

/// Date and time of day of a moment, UTC, such as "2026-11-30 18:05"; empty before 1970.
///
/// Years of 400 have 146,097 days; counted from March, the leap day is the last one of a year.
pub(crate) fn date(moment: std::time::SystemTime) -> String {
    let Ok(since) = moment.duration_since(std::time::UNIX_EPOCH) else { return String::new() };
    let (days, seconds) = (since.as_secs() / 86_400 + 719_468, since.as_secs() % 86_400);
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1_460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let (day, month) = (day - (153 * month + 2) / 5 + 1, if month < 10 { month + 3 } else { month - 9 });
    let year = year + 400 * era + u64::from(month <= 2);
    format!("{year}-{month:02}-{day:02} {:02}:{:02}", seconds / 3600, seconds / 60 % 60)
}

#[cfg(test)]
mod tests {
    use super::date;
    use std::time::{Duration, UNIX_EPOCH};

    /// Known moments: the first one, leap days, the day after one, the end of a year.
    #[test]
    fn dates_of_known_moments() {
        for (seconds, expected) in [
            (0, "1970-01-01 00:00"),
            (951_782_400, "2000-02-29 00:00"),
            (1_709_251_199, "2024-02-29 23:59"),
            (1_709_251_200, "2024-03-01 00:00"),
            (1_767_225_599, "2025-12-31 23:59"),
            (4_107_542_400, "2100-03-01 00:00"),
        ] {
            assert_eq!(date(UNIX_EPOCH + Duration::from_secs(seconds)), expected);
        }
    }
}
