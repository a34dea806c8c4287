//! Sizes of the libraries that users install.

mod harness;

use harness::built;

/// Stripped, each has 6.6 to 6.8 MB; with its symbols, that for LAMMPS had 12.1 MB when it had 6.2 MB without. The bound leaves 3 % for
/// growth: a loop that is compiled twice by mistake added 2.5 MB.
#[test]
fn the_libraries_are_stripped_and_small() {
    for (name, script) in [
        ("liggghts/libconcordem-liggghts.so", "liggghts-bridge/build"),
        ("lammps/concordemplugin.so", "liggghts-bridge/lammps/build"),
    ] {
        let size = std::fs::metadata(built(name, script)).unwrap().len();
        println!("{name}: {size} bytes");
        assert!(size < 7_000_000, "{name} has {size} bytes");
    }
}
