//! Contents of results, to compare them bit for bit.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem_tests::commands::{concordem, text};
use tempfile::TempDir;

use crate::prism;

/// Contents of a result without attributes (which say when and how it was made): type, shape, and bits of every dataset, by
/// path.
pub type Contents = BTreeMap<String, (String, Vec<usize>, Vec<u64>)>;

pub fn contents(path: &Path) -> Contents {
    // Opening a result verifies its seal.
    let hash = ResultFile::open(path).and_then(|result| result.state_hash()).expect("a complete result");
    let mut all = BTreeMap::from([("state_hash".to_owned(), (hash, Vec::new(), Vec::new()))]);
    collect(&hdf5::File::open(path).expect("an HDF5 file"), "", &mut all);
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

fn collect(group: &hdf5::Group, prefix: &str, all: &mut Contents) {
    use hdf5::types::{FloatSize, TypeDescriptor, VarLenUnicode};
    for name in group.member_names().expect("a readable group") {
        let path = format!("{prefix}{name}");
        if let Ok(inner) = group.group(&name) {
            collect(&inner, &format!("{path}/"), all);
            continue;
        }
        let data = group.dataset(&name).expect("a group or a dataset");
        let kind = data.dtype().and_then(|kind| kind.to_descriptor()).expect("a type");
        let bits = match &kind {
            // The library fails to read an empty dataset.
            _ if data.size() == 0 => Vec::new(),
            TypeDescriptor::Float(FloatSize::U8) => {
                data.read_raw::<f64>().expect("reals").into_iter().map(f64::to_bits).collect()
            }
            TypeDescriptor::Unsigned(_) => data.read_raw::<u64>().expect("numbers"),
            TypeDescriptor::Integer(_) => {
                data.read_raw::<i64>().expect("numbers").into_iter().map(i64::cast_unsigned).collect()
            }
            TypeDescriptor::VarLenUnicode => {
                let text: VarLenUnicode = data.read_scalar().expect("a text");
                text.bytes().map(u64::from).collect()
            }
            other => panic!("{path} holds {other}, which is not compared yet"),
        };
        all.insert(path, (kind.to_string(), data.shape(), bits));
    }
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
