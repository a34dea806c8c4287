//! What is refused: files of others, existing results, impossible paths, and wrong rows.

use super::*;
use crate::output::ResultFile;

#[test]
fn files_of_another_run_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (path, other) = (folder.path().join("run.h5"), folder.path().join("other.h5"));
    unfinished(&path, 2);
    unfinished(&other, 2);
    fs::copy(parts_folder(&other).join("segment-0000.h5"), parts_folder(&path).join("segment-0000.h5")).unwrap();
    let error = RunFiles::resume(&path).unwrap_err().to_string();
    assert!(error.contains("segment-0000.h5 is damaged: it belongs to another run"), "{error}");
}

#[test]
fn existing_results_are_overwritten_only_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    unfinished(&path, 1);
    let error = RunFiles::create(&path, header(), false).unwrap_err();
    assert!(matches!(error, OutputError::Unfinished { .. }), "{error}");
    let error = ResultFile::open(&path).unwrap_err();
    assert!(matches!(error, OutputError::Unfinished { .. }), "{error}");
    fs::remove_dir_all(parts_folder(&path)).unwrap();
    run_toy(&path, 0).unwrap();
    let first = fs::read(&path).unwrap();
    let error = RunFiles::create(&path, header(), false).unwrap_err().to_string();
    assert!(error.contains("--force"), "{error}");
    // An overwriting run keeps the old result until the new one is complete, even if the run is killed.
    let mut files = RunFiles::create(&path, header(), true).unwrap();
    let toy = Toy::new();
    toy.record(&mut files);
    files.commit(&toy).unwrap();
    drop(files);
    assert_eq!(fs::read(&path).unwrap(), first);
    let Resumed::Continue { files, .. } = RunFiles::resume(&path).unwrap() else { panic!("the new run is not done") };
    files.finish(&toy, &Tables(&toy)).unwrap();
    assert_eq!(ResultFile::open(&path).unwrap().samples("time").unwrap(), [0.0]);
    assert!(matches!(RunFiles::resume(&path), Ok(Resumed::Finished)));
}

#[test]
fn impossible_paths_and_names_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let create = |path: &Path| RunFiles::create(path, header(), false).unwrap_err();
    let error = create(&folder.path().join("none/run.h5"));
    assert!(matches!(error, OutputError::NoFolder { .. }), "{error}");
    let file = folder.path().join("file");
    fs::write(&file, "x").unwrap();
    let error = create(&file.join("run.h5"));
    assert!(matches!(error, OutputError::NotWritable { .. }), "{error}");
    assert!(matches!(create(folder.path()), OutputError::Name { .. }));
    let locked = folder.path().join("locked");
    fs::create_dir(&locked).unwrap();
    fs::set_permissions(&locked, std::os::unix::fs::PermissionsExt::from_mode(0o555)).unwrap();
    // The superuser may write anywhere.
    if fs::write(locked.join("probe"), "").is_err() {
        let error = create(&locked.join("run.h5"));
        assert!(matches!(error, OutputError::NotWritable { .. }), "{error}");
    }
    for name in ["", "a/b", ".", "a\0"] {
        let mut header = header();
        header.series[0].name = name.into();
        let error = RunFiles::create(&folder.path().join("run.h5"), header, false).unwrap_err();
        assert!(matches!(error, OutputError::Name { .. }), "{name:?}: {error}");
    }
    let mut twice = header();
    twice.series[1].name = "time".into();
    let error = RunFiles::create(&folder.path().join("run.h5"), twice, false).unwrap_err().to_string();
    assert_eq!(error, "`time` cannot name a series: another has the same name.");
    let error = RunFiles::resume(&folder.path().join("never.h5")).unwrap_err();
    assert!(matches!(error, OutputError::NoRun { .. }), "{error}");
}

struct Elsewhere;
impl WriteColumns for Elsewhere {
    fn write(&self, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        sink.column("VTKHDF/Points", Column::u8(&[1]))
    }
}

#[test]
fn wrong_rows_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut files = RunFiles::create(&folder.path().join("run.h5"), header(), false).unwrap();
    let error = files.append_sample(&[1.0, 2.0]).unwrap_err().to_string();
    assert_eq!(error, "a sample has 2 values, but the run has 3 series");
    let position = [Vec3::zeros(), Vec3::x()];
    let snapshot = |name, data| {
        let fields = vec![SnapshotField { name, description: "", column: Column::f64(data, 1, "m") }];
        StoredSnapshot::of(&Snapshot { time: 0.0, step: 5, id: &[1, 0], position: &position, cell: None, fields })
    };
    let error = snapshot("radius", &[1.0]).unwrap_err().to_string();
    assert_eq!(error, "snapshot at step 5: the field `radius` has 1 rows for 2 particles");
    files.append_snapshot(Arc::new(snapshot("radius", &[1.0, 2.0]).unwrap())).unwrap();
    let error = files.append_snapshot(Arc::new(snapshot("size", &[1.0, 2.0]).unwrap())).unwrap_err().to_string();
    assert!(error.contains("size (1 f64); the first had"), "{error}");
    let error = snapshot("id", &[1.0, 2.0]).unwrap_err().to_string();
    assert_eq!(error, "snapshot at step 5: the field `id` appears twice");
    let toy = Toy::new();
    let path = files.path.clone();
    let error = files.finish(&toy, &Elsewhere).unwrap_err().to_string();
    assert!(error.contains("final columns must be below cell or contacts or particles"), "{error}");
    // The final state is kept, so that no step is lost.
    let Resumed::Continue { checkpoint, .. } = RunFiles::resume(&path).unwrap() else { panic!("no checkpoint") };
    assert_eq!(checkpoint.state_hash, crate::output::hash::state_hash(&toy).unwrap());
}

/// A symbolic link to a result stays, and its target is replaced; devices, pipes, and other folders are refused.
#[test]
fn only_regular_files_and_own_folders_are_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let (link, real) = (folder.path().join("link.h5"), folder.path().join("real.h5"));
    fs::write(&real, "old").unwrap();
    std::os::unix::fs::symlink("real.h5", &link).unwrap();
    assert!(matches!(RunFiles::create(&link, header(), false), Err(OutputError::Exists { .. })));
    let toy = Toy::new();
    RunFiles::create(&link, header(), true).unwrap().finish(&toy, &Tables(&toy)).unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert!(ResultFile::open(&real).is_ok() && ResultFile::open(&link).is_ok());
    let pipe = folder.path().join("pipe.h5");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let error = RunFiles::create(&pipe, header(), true).unwrap_err();
    assert!(matches!(error, OutputError::NotReplaceable { .. }), "{error}");
    let error = RunFiles::create(Path::new("/dev/null"), header(), true).unwrap_err();
    assert!(matches!(error, OutputError::NotReplaceable { .. }), "{error}");
    let mine = parts_folder(&folder.path().join("other.h5"));
    fs::create_dir(&mine).unwrap();
    fs::write(mine.join("thesis.txt"), "precious").unwrap();
    let error = RunFiles::create(&folder.path().join("other.h5"), header(), true).unwrap_err();
    assert!(error.to_string().contains("thesis.txt"), "{error}");
    assert!(mine.join("thesis.txt").exists());
}
