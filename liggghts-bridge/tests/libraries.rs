//! Sizes of the libraries that users install.

use crate::harness::built;

/// Stripped, LIGGGHTS' has 9.48 MB and LAMMPS' 9.32 MB; with its symbols, the latter had 12.1 MB when it had 6.2 MB without. The check of the
/// time step at set-up (eigenvalues by Lanczos' method, in parallel) took 0.25 MB of it; damped beams, and the loops of three laws for strengths
/// that scatter, 0.7 MB; jointed bonds, as bonds and as contacts by every measure, 0.64 MB; softening beams 0.85 MB. The bound leaves 3 % for growth: a loop that is
/// compiled twice by mistake added 2.5 MB.
#[test]
fn the_libraries_are_stripped_and_small() {
    for (name, script) in [
        ("liggghts/libconcordem-liggghts.so", "liggghts-bridge/build"),
        ("lammps/concordemplugin.so", "liggghts-bridge/lammps/build"),
    ] {
        let size = std::fs::metadata(built(name, script)).unwrap().len();
        println!("{name}: {size} bytes");
        assert!(size < 9_760_000, "{name} has {size} bytes");
    }
}
