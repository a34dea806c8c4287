//! Merging the parts of a sweep.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::{SweepArguments, command, remove, shell};
use crate::program::Failure;
use crate::sweep::Sweep;
use crate::sweep::journal::{Journal, JournalError, path_of, read};
use crate::sweep::outcome::Outcome;
use crate::sweep::parts::{self, Part};

/// Most unfinished parts that a message names.
const MOST_NAMED: usize = 8;

/// Moves the points of all parts to the journal of the whole sweep, if no point is missing.
pub(super) fn merge(
    sweep: &Sweep,
    groups: &[Vec<usize>],
    result: &Path,
    arguments: &SweepArguments,
) -> Result<(), Failure> {
    let found = parts::found(result).map_err(|error| {
        let folder = result.parent().unwrap_or(Path::new(".")).to_owned();
        Failure::File { path: folder, action: "read", error }
    })?;
    let fingerprint = sweep.fingerprint()?;
    let points_of = |path: &Path| match read(path, &fingerprint, sweep.numbers()) {
        Err(JournalError::Other { path }) => Err(Failure::Usage(format!(
            "{} has points of another sweep, scenario, or packing file, or of another version of the program; remove it, or compute \
             its part again with --force",
            path.display()
        ))),
        other => Ok(other?),
    };
    let whole = path_of(result);
    let before = if whole.exists() { points_of(&whole)? } else { BTreeMap::new() };
    let mut known: BTreeMap<usize, Outcome> = BTreeMap::new();
    for part in &found {
        known.extend(points_of(&part.path(result))?);
    }
    known.retain(|point, _| !before.contains_key(point));
    let count = sweep.points();
    let missing: BTreeSet<usize> =
        (0..count).filter(|point| !known.contains_key(point) && !before.contains_key(point)).collect();
    if !missing.is_empty() {
        return Err(Failure::Usage(unfinished(&found, &missing, groups, count, arguments)));
    }
    let (mut journal, _) = Journal::open(&whole, &fingerprint, sweep.numbers())?;
    let points = known.iter().map(|(point, outcome)| (*point, outcome));
    journal.add_all(points).map_err(|error| Failure::File { path: whole, action: "write", error })?;
    // Now the journal of the whole sweep has all points: after a kill, the same command writes the result from it.
    found.iter().try_for_each(|part| remove(&part.path(result)))
}

/// What to say when points are missing: how many, and which parts are not finished.
fn unfinished(
    found: &BTreeSet<Part>,
    missing: &BTreeSet<usize>,
    groups: &[Vec<usize>],
    points: usize,
    arguments: &SweepArguments,
) -> String {
    let command = command(arguments, &|word| shell::argument(Path::new(word)));
    let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
    for part in found {
        *counts.entry(part.of).or_default() += 1;
    }
    let Some((&of, _)) = counts.iter().max_by_key(|(_, count)| **count) else {
        return format!(
            "no part of the sweep is computed here; compute all parts first: {command} --part 1/10, and so on; or write a \
             script for a cluster with --slurm array.sh --parts 10"
        );
    };
    let lacks = |part: &Part| part.share(groups).iter().flatten().any(|point| missing.contains(point));
    let parts: Vec<Part> = (1..=of).map(|part| Part { of, part }).filter(lacks).collect();
    let mut names: Vec<String> = parts.iter().take(MOST_NAMED).map(Part::to_string).collect();
    if parts.len() > MOST_NAMED {
        names.push(format!("and {} more", parts.len() - MOST_NAMED));
    }
    let first = parts.first().map(Part::to_string).unwrap_or_default();
    format!(
        "{} of {points} points are missing; parts that are not finished: {}; compute each of them: {command} --part {first}",
        missing.len(),
        names.join(", ")
    )
}
