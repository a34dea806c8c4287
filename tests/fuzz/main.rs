//! The readers survive damaged and forged input. Every reader gets good inputs with random mutations and must return a value
//! or an error within a time limit: no panic, no crash, no endless loop. HDF5 files get other tables, and a seal that fits,
//! so that the content reaches the readers.
//!
//! `CONCORDEM_FUZZ_INPUTS` is the number of inputs (default 2,000), `CONCORDEM_FUZZ_SEED` the seed of the random numbers
//! (default 1). The same seed gives the same inputs. Failing inputs are kept in `target/fuzz`. `CONCORDEM_FUZZ_READER` names
//! readers, between spaces, which share all inputs.
//!
//! `make fuzz` gives each reader a million inputs, chosen by the code that they reach (`guided.rs`).

mod forge;
mod mutate;
mod readers;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use concordem_tests::random::Random;
use mutate::mutate;
use readers::{READERS, Reader, Samples};

/// Most memory of the process that reads, KiB. Inputs have some KiB, and the program itself takes some 100 MiB.
const MEMORY: u64 = 1 << 20;
/// Longest time for one input.
const LIMIT: Duration = Duration::from_secs(20);
/// Environment variable with which the test tells a child process what to do.
const WORK: &str = "CONCORDEM_FUZZ_WORK";

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name)
        .map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{name} is not a number: {text}")))
}

/// Not a test: the child process that reads inputs from a given number on, and records each number before reading.
#[test]
#[ignore = "run by another test in a separate process, because it may crash"]
fn worker() {
    let Ok(work) = std::env::var(WORK) else { return };
    let parts: Vec<&str> = work.split('|').collect();
    let [reader, seed, first, end, note] = parts[..] else { panic!("{work}") };
    let [reader, seed, first, end] = [reader, seed, first, end].map(|text| text.parse::<u64>().expect("a number"));
    let reader = &READERS[reader as usize];
    let folder = tempfile::tempdir().expect("a folder");
    let samples = Samples::new(folder.path());
    std::panic::set_hook(Box::new(|panic| eprintln!("{panic}")));
    for input in first..end {
        std::fs::write(note, input.to_string()).expect("a file");
        let bytes = mutated(&samples, reader, seed, input);
        if let Some(kept) = std::env::var_os("CONCORDEM_FUZZ_KEEP") {
            std::fs::write(kept, &bytes).expect("a file");
        }
        (reader.read)(&samples, &bytes);
    }
    std::fs::write(note, "done").expect("a file");
}

/// A good input with mutations.
fn mutated(samples: &Samples, reader: &Reader, seed: u64, input: u64) -> Vec<u8> {
    let mut random = Random::new(seed, input);
    let good = samples.good(reader);
    let mut bytes = good[random.below(good.len())].clone();
    samples.change(reader, &mut bytes, &mut random, &mut |bytes, random| mutate(bytes, random, reader.text));
    bytes
}

fn spawn(reader: usize, seed: u64, first: u64, end: u64, note: &Path, kept: Option<&Path>) -> Child {
    let mut command = Command::new(std::env::current_exe().expect("this test"));
    command
        .args(["--exact", "worker", "--ignored", "--nocapture"])
        .env(WORK, format!("{reader}|{seed}|{first}|{end}|{}", note.display()))
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    if let Some(kept) = kept {
        command.env("CONCORDEM_FUZZ_KEEP", kept);
    }
    command.spawn().expect("the test can start itself")
}

/// Waits for a worker; returns the reason if it fails.
fn wait(mut child: Child, note: &Path) -> Option<String> {
    let (mut last, mut since) = (String::new(), Instant::now());
    loop {
        let now = std::fs::read_to_string(note).unwrap_or_default();
        if now != last {
            (last, since) = (now, Instant::now());
        }
        if let Some(status) = child.try_wait().expect("a child") {
            if status.success() && last == "done" {
                return None;
            }
            let output = child.wait_with_output().expect("a child");
            let said = String::from_utf8_lossy(&output.stderr).lines().take(3).collect::<Vec<_>>().join(" ");
            return Some(format!("{status}: {said}"));
        }
        if memory(child.id()) > MEMORY {
            let _ = child.kill();
            let _ = child.wait();
            return Some(format!("more than {} MiB of memory", MEMORY >> 10));
        }
        if since.elapsed() > LIMIT {
            let _ = child.kill();
            let _ = child.wait();
            return Some(format!("no end after {LIMIT:?}"));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Most memory that a process has had, KiB; 0 if the system does not tell.
fn memory(process: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    peak.and_then(|peak| peak.trim().trim_end_matches(" kB").parse().ok()).unwrap_or(0)
}

#[test]
fn readers_survive_mutated_inputs() {
    let (count, seed) = (number("CONCORDEM_FUZZ_INPUTS", 2_000), number("CONCORDEM_FUZZ_SEED", 1));
    let folder = tempfile::tempdir().expect("a folder");
    let kept = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../target/fuzz");
    let mut failures = Vec::new();
    let only = std::env::var("CONCORDEM_FUZZ_READER").ok();
    let is_chosen = |name: &str| only.as_ref().is_none_or(|only| only.split_whitespace().any(|only| only == name));
    let chosen = || READERS.iter().enumerate().filter(|(_, reader)| is_chosen(reader.name));
    let each = count.div_ceil(chosen().count().max(1) as u64);
    for (k, reader) in chosen() {
        let (start, mut first) = (Instant::now(), 0);
        while first < each {
            let note = folder.path().join(format!("note-{k}"));
            let Some(reason) = wait(spawn(k, seed, first, each, &note, None), &note) else { break };
            let input: u64 = std::fs::read_to_string(&note).ok().and_then(|text| text.parse().ok()).unwrap_or(first);
            std::fs::create_dir_all(&kept).expect("a folder");
            let file = kept.join(format!("{}-{seed}-{input}", reader.name));
            wait(spawn(k, seed, input, input + 1, &note, Some(&file)), &note);
            failures.push(format!("{} input {input}, kept in {}: {reason}", reader.name, file.display()));
            assert!(failures.len() < 100, "too many failures:\n{}", failures.join("\n"));
            first = input + 1;
        }
        println!("{}: {each} inputs in {:.1} s", reader.name, start.elapsed().as_secs_f64());
    }
    assert!(failures.is_empty(), "{} of {count} inputs:\n{}", failures.len(), failures.join("\n"));
}
