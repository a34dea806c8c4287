//! Killed processes, full disks, and damaged checkpoints change no result.

use super::*;

#[test]
fn a_run_killed_at_any_stage_gives_the_same_result() {
    let folder = tempfile::tempdir().unwrap();
    let expected = undisturbed(folder.path(), 0);
    let path = folder.path().join("killed.h5");
    let mut kills = 0;
    for stage in [
        "before segment",
        "within segment",
        "after segment",
        "after checkpoint",
        "before merge",
        "within merge",
        "after merge",
    ] {
        for count in 1.. {
            let killed = child_command(&path).env("CONCORDEM_TEST_KILL", format!("{stage}:{count}")).output().unwrap();
            if killed.status.success() {
                fs::remove_file(&path).unwrap();
                break;
            }
            assert_eq!(std::os::unix::process::ExitStatusExt::signal(&killed.status), Some(9), "{killed:?}");
            kills += 1;
            if path.exists() {
                assert_eq!(stage, "after merge");
                assert_eq!(contents(&path), expected);
            }
            let again = child_command(&path).output().unwrap();
            assert!(again.status.success(), "{stage} {count}: {again:?}");
            assert_eq!(contents(&path), expected, "{stage} {count}");
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "{stage} {count}: leftover files");
            fs::remove_file(&path).unwrap();
        }
    }
    // 7 segments (at the start, five during the run, at the end) with three stages each, 6 checkpoints (none at the end), and
    // 1 + 7 + 1 stages of the merge.
    assert_eq!(kills, 3 * 7 + 6 + 1 + 7 + 1);
}

#[test]
fn a_run_killed_repeatedly_at_random_times_gives_the_same_result() {
    let folder = tempfile::tempdir().unwrap();
    let expected = undisturbed(folder.path(), 2000);
    let path = folder.path().join("killed.h5");
    let (mut kills, mut delay) = (0, 3);
    for attempt in 0.. {
        assert!(attempt < 2000, "no progress");
        let mut child = child_command(&path).env("CONCORDEM_TEST_GROWTH", "2000").spawn().unwrap();
        std::thread::sleep(Duration::from_millis(delay));
        // Growing delays let the run finish on any machine.
        delay = (delay * 7) % 41 + 3 + attempt;
        if child.try_wait().unwrap().is_none() {
            child.kill().unwrap();
            kills += 1;
        }
        let output = child.wait_with_output().unwrap();
        if output.status.success() {
            break;
        }
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert!(!complaint.contains("RUN FAILED"), "{complaint}");
    }
    assert!(kills > 3, "only {kills} kills");
    assert_eq!(contents(&path), expected);
}

#[test]
fn a_full_disk_leaves_the_last_commit_intact() {
    let folder = tempfile::tempdir().unwrap();
    // The state grows by 16 kB per step and reaches the limit of 256 KiB per file.
    let expected = undisturbed(folder.path(), 2000);
    let path = folder.path().join("full.h5");
    let inner = child_command(&path);
    let mut command = Command::new("bash");
    // Without the trap, the signal would end the process before the write fails.
    command
        .args(["-c", "trap '' XFSZ; ulimit -f 256; exec \"$@\"", "bash"])
        .arg(inner.get_program())
        .args(inner.get_args());
    command.env("CONCORDEM_TEST_RUN", &path).env("CONCORDEM_TEST_GROWTH", "2000").stdout(Stdio::null());
    let output = command.output().unwrap();
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{complaint}");
    assert!(complaint.contains("no space for") && complaint.contains("checkpoint-000"), "{complaint}");
    assert!(complaint.contains("File too large"), "{complaint}");
    assert!(complaint.contains("AT "), "{complaint}");
    let left: Vec<_> = fs::read_dir(parts_folder(&path)).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert!(left.iter().all(|name| !name.to_string_lossy().starts_with(".unfinished")), "{left:?}");
    let again = child_command(&path).env("CONCORDEM_TEST_GROWTH", "2000").output().unwrap();
    assert!(again.status.success(), "{again:?}");
    assert_eq!(contents(&path), expected);
}

#[test]
fn two_checkpoints_are_kept_and_the_older_one_replaces_a_damaged_newer_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    unfinished(&path, 5);
    let parts = parts_folder(&path);
    let checkpoints = list_numbered(&parts, "checkpoint").unwrap();
    assert_eq!(checkpoints.keys().copied().collect::<Vec<_>>(), [3, 4]);
    let mut bytes = fs::read(&checkpoints[&4]).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&checkpoints[&4], bytes).unwrap();
    let Resumed::Continue { files, mut checkpoint, unusable } = RunFiles::resume(&path).unwrap() else { panic!() };
    assert_eq!(Toy::read(&mut checkpoint.columns).step, 4);
    assert_eq!(files.segments, 4);
    assert!(unusable[0].to_string().contains("checkpoint-0004.h5 is damaged"), "{unusable:?}");
    assert_eq!(list_numbered(&parts, "segment").unwrap().len(), 4);
    // A process locks its run.
    assert!(matches!(RunFiles::resume(&path), Err(OutputError::Busy { .. })));
    assert!(matches!(RunFiles::create(&path, header(), true), Err(OutputError::Busy { .. })));
    drop(files);
    // A segment before the remaining checkpoint is lost: the run cannot be resumed, and the error says why.
    fs::remove_file(parts.join("segment-0001.h5")).unwrap();
    let error = RunFiles::resume(&path).unwrap_err().to_string();
    assert!(error.contains("segment-0001.h5 does not exist"), "{error}");
}

/// The next run removes files that a killed process left beside the result, but not files that a running process has locked.
#[test]
fn leftovers_of_killed_processes_are_removed() {
    let folder = tempfile::tempdir().unwrap();
    let old = std::time::SystemTime::now() - Duration::from_secs(3600);
    let age = |path: &Path| File::open(path).unwrap().set_modified(old).unwrap();
    let make = |name: &str| {
        let path = folder.path().join(name);
        fs::create_dir(&path).unwrap();
        fs::write(path.join("lock"), "").unwrap();
        age(&path);
        path
    };
    let (dead, alive) = (make(".unfinished-dead"), make(".unfinished-alive"));
    let held = lock(&alive).unwrap();
    age(&alive);
    let file = |name: &str, content: &str| {
        let path = folder.path().join(name);
        fs::write(&path, content).unwrap();
        path
    };
    // What has content was locked before, so whoever wrote it is gone; what is empty may not be locked yet.
    let (text, young) = (file(".unfinished-text", "half"), file(".unfinished-young", ""));
    let (written, writing) = (make(".unfinished-written"), make(".unfinished-writing"));
    let held_too = lock(&writing).unwrap();
    for folder in [&written, &writing] {
        fs::write(folder.join("header.h5"), "half").unwrap();
        File::open(folder).unwrap().set_modified(std::time::SystemTime::now()).unwrap();
    }
    // The clock was set back.
    let future = file(".unfinished-future", "");
    File::open(&future).unwrap().set_modified(std::time::SystemTime::now() + Duration::from_secs(3600)).unwrap();
    run_toy(&folder.path().join("run.h5"), 0).unwrap();
    for gone in [dead, text, written, future] {
        assert!(!gone.exists(), "{} is not removed", gone.display());
    }
    for used in [&alive, &young, &writing] {
        assert!(used.exists(), "{}, which is in use, is removed", used.display());
    }
    drop((held, held_too));
}
