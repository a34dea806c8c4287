//! Contents of results, to compare them bit for bit.

use std::collections::BTreeSet;
use std::path::Path;

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem_tests::commands::{concordem, text};
use concordem_tests::datasets::{Contents, datasets};
use tempfile::TempDir;

use crate::prism;

/// Contents of a result.
pub fn contents(path: &Path) -> Contents {
    // Opening a result verifies its seal.
    let hash = ResultFile::open(path).and_then(|result| result.state_hash()).expect("a complete result");
    let mut all = datasets(path);
    all.insert("state_hash".to_owned(), (hash, Vec::new(), Vec::new()));
    for name in
        ["samples/stress", "events/step", "particles/velocity", "contacts/cpm/force", "samples/region-stress/stress"]
    {
        assert!(all.contains_key(name), "{name} is not among {:?}", all.keys());
    }
    // The particles must move: if all snapshots were equal, the comparison would say little.
    let (_, shape, _) = &all["VTKHDF/Points"];
    let (_, _, times) = &all["VTKHDF/Steps/Values"];
    assert!(times.len() > 2 && shape[0] == times.len() * all["particles/id"].2.len(), "{shape:?} at {times:?}");
    all
}

/// Fails with the names of the datasets that differ.
pub fn same(found: &Contents, expected: &Contents, what: &str) {
    let names: BTreeSet<&String> = found.keys().chain(expected.keys()).collect();
    let differ: Vec<_> = names.into_iter().filter(|&name| found.get(name) != expected.get(name)).collect();
    assert!(differ.is_empty(), "{what}: {differ:?} differ");
}

/// The comparison of results detects a single changed bit of a snapshot.
#[test]
fn a_bit_of_a_snapshot_is_a_difference() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 300);
    let result = folder.path().join("prism.h5");
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    let all = contents(&result);
    for name in ["VTKHDF/Points", "VTKHDF/PointData/velocity"] {
        let mut other = all.clone();
        let (_, _, bits) = other.get_mut(name).expect("a dataset of the snapshots");
        let middle = bits.len() / 2;
        bits[middle] ^= 1;
        let found = std::panic::catch_unwind(|| same(&other, &all, "one bit"));
        assert!(found.is_err(), "a changed bit of {name} is not detected");
    }
    same(&all, &all, "nothing");
}
