//! A result contains what was appended, in the order of the run.

use super::*;
use crate::output::{ResultFile, csv};
use concordem_solver::state::columns::ColumnData;

#[test]
fn the_result_holds_everything_that_was_appended() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    run_toy(&path, 0).unwrap();
    assert!(!parts_folder(&path).exists());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "only the result remains");

    let result = ResultFile::open(&path).unwrap();
    assert_eq!(result.series(), header().series, "units, descriptions, and order of the run");
    let mut toy = Toy::new();
    let mut expected = vec![toy.x[1]];
    let mut events = 0;
    let mut last_event = 0.0;
    for _ in 0..STEPS {
        toy.advance(0);
        expected.push(toy.x[1]);
        for &x in toy.x.iter().filter(|x| **x > 0.9) {
            events += 1;
            last_event = x;
        }
    }
    assert_eq!(result.samples("a stress").unwrap(), expected);
    let read = result.events().unwrap();
    assert_eq!(read.len(), events);
    assert!(events > 10, "the toy must produce events");
    let last = read.last().unwrap();
    assert_eq!((last.damage, last.energy, last.position.x), (last_event, last_event * last_event, last_event));
    assert_eq!(last.mode_shares, [last_event, 1.0 - last_event, 0.0, 0.0]);
    assert_eq!(result.state_hash().unwrap(), crate::output::hash::state_hash(&toy).unwrap());
    assert_eq!(result.scenario().unwrap(), header().scenario);
    let provenance: BTreeMap<_, _> = result.provenance().unwrap().into_iter().collect();
    assert_eq!((&provenance["threads"][..], &provenance["empty"][..]), ("2", ""));
    assert_eq!(provenance["program"], crate::provenance::PROGRAM);
    assert!(provenance.contains_key("wall_time"));
    assert_eq!(result.laws().unwrap(), ["toy"]);
    assert_eq!(result.table("contacts/toy").unwrap()[0].1.data, ColumnData::F64(toy.x.clone()));
    assert_eq!(result.snapshot_times().unwrap(), [0.0, 5.0, 10.0, 15.0, 20.0]);
    // Radii change only with the number of particles (12, 12, 14, 14, 12) and are written three times, sorted by id; damage
    // is written five times.
    let fields: BTreeMap<_, _> = result.table("VTKHDF/PointData").unwrap().into_iter().collect();
    let radii = |count| (0..count).map(|k| 1.0 + f64::from(k));
    assert_eq!(fields["radius"].data, ColumnData::F64(radii(12).chain(radii(14)).chain(radii(12)).collect()));
    assert_eq!(fields["damage"].borrow().len(), 12 + 12 + 14 + 14 + 12);

    let text = csv::text(&result).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("time [s],strain [1],a stress [Pa]"));
    assert_eq!(lines.clone().count() as u64, STEPS + 1);
    let stress: Vec<f64> = lines.map(|line| line.rsplit(',').next().unwrap().parse().unwrap()).collect();
    assert_eq!(stress, expected, "the text restores the same bits");
    let error = result.samples("stress").unwrap_err().to_string();
    assert!(error.ends_with("has no `samples/stress`. It has: time, strain, a stress."), "{error}");
}

#[test]
fn two_runs_give_the_same_file_except_for_attributes() {
    let folder = tempfile::tempdir().unwrap();
    let first = undisturbed(folder.path(), 0);
    let other = folder.path().join("other.h5");
    run_toy(&other, 0).unwrap();
    assert_eq!(first, contents(&other));
    assert!(first.len() > 25, "{first:#?}");
}

/// Rows are read back for the right operator, although HDF5 lists `operator-1000` before `operator-101`. The same holds for
/// quantities, series, provenance, and snapshots.
#[test]
fn more_than_a_thousand_operators_keep_their_rows() {
    const COUNT: usize = 1203;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    let mut header = header();
    header.operators = (0..COUNT)
        .map(|k| OperatorTable {
            name: format!("probe {k}"),
            description: String::new(),
            quantities: vec![(SeriesColumn::new("value", "1", ""), 1)],
        })
        .collect();
    let rows = |files: &mut RunFiles, step: u64| {
        for k in 0..COUNT {
            files.append_operator(k, step as f64, step, &[(k as u64 + 10_000 * step) as f64]).unwrap();
        }
    };
    let toy = Toy::new();
    let mut files = RunFiles::create(&path, header.clone(), false).unwrap();
    rows(&mut files, 0);
    files.commit(&toy).unwrap();
    drop(files);
    let Resumed::Continue { mut files, .. } = RunFiles::resume(&path).unwrap() else { panic!() };
    assert_eq!(files.header().operators, header.operators, "the order of the run");
    rows(&mut files, 1);
    files.finish(&toy, &Tables(&toy)).unwrap();
    let result = ResultFile::open(&path).unwrap();
    for k in 0..COUNT {
        let table = result.table(&format!("samples/probe {k}")).unwrap();
        let (_, column) = table.iter().find(|(name, _)| name == "value").unwrap();
        assert_eq!(column.data, ColumnData::F64(vec![k as f64, (k + 10_000) as f64]), "operator {k}");
    }
}
