//! Gives a reader inputs that libFuzzer finds by the code that they reach, beginning with the good inputs, and changed as the other fuzz tests
//! change them. `run.py` compiles and starts this.
//!
//! `CONCORDEM_FUZZ_READER` names the reader, whose good inputs are written to the folder `CONCORDEM_FUZZ_CORPUS`. Without a reader, it prints
//! the names of all.

#![no_main]

mod forge;
mod mutate;
mod readers;

use std::path::PathBuf;
use std::sync::LazyLock;

use concordem_tests::random::Random;
use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};

use mutate::mutate;
use readers::{READERS, Reader, Samples};

/// The reader, and its good inputs.
static WORK: LazyLock<(&Reader, Samples)> = LazyLock::new(|| {
    let name = std::env::var("CONCORDEM_FUZZ_READER").unwrap_or_default();
    let Some(reader) = READERS.iter().find(|reader| reader.name == name) else {
        println!("{}", READERS.each_ref().map(|reader| reader.name).join(" "));
        std::process::exit(0);
    };
    // The folder stays: libFuzzer ends the process.
    let samples = Samples::new(&tempfile::tempdir().expect("a folder").keep());
    if let Some(folder) = std::env::var_os("CONCORDEM_FUZZ_CORPUS").map(PathBuf::from) {
        for (k, bytes) in samples.good(reader).iter().enumerate() {
            std::fs::write(folder.join(format!("good-{k}")), bytes).expect("a file");
        }
    }
    (reader, samples)
});

fuzz_target!(init: { let _ = &*WORK; }, |bytes: &[u8]| (WORK.0.read)(&WORK.1, bytes));

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    let (reader, samples) = &*WORK;
    let mut bytes = data[..size].to_vec();
    // Half of the changes of bytes are those of libFuzzer, which knows what the code compares them with.
    let mut bytewise = |bytes: &mut Vec<u8>, random: &mut Random| {
        if random.below(2) == 0 {
            return mutate(bytes, random, reader.text);
        }
        let length = bytes.len();
        let room = max_size.max(length);
        bytes.resize(room, 0);
        let changed = fuzzer_mutate(bytes, length, room);
        bytes.truncate(changed);
    };
    samples.change(reader, &mut bytes, &mut Random::new(u64::from(seed), 0), &mut bytewise);
    let length = bytes.len().min(max_size);
    data[..length].copy_from_slice(&bytes[..length]);
    length
});
