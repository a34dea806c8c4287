//! Colliding spheres of two types, for the pair styles of LIGGGHTS.

use std::fmt::Write as _;
use std::path::Path;

use concordem_contact::math::Vec3;

use super::{Atom, Dice, Dumped, data_file, dump, frames, head, run};

/// Steps of [`result`].
pub const STEPS: usize = 400;

/// Colliding spheres of two types and different sizes.
pub fn cloud(path: &Path) {
    let mut dice = Dice(11);
    let atoms: Vec<Atom> = (0..512)
        .map(|k| {
            let place = Vec3::new((k % 8) as f64, (k / 8 % 8) as f64, (k / 64) as f64) * 0.0105;
            let mut atom = Atom::resting(place + dice.vector() * 3e-4, 0.005 * (0.9 + 0.1 * dice.roll()));
            atom.kind = 1 + k % 2;
            atom.velocity = (Vec3::repeat(0.037) - place) * 60.0 + dice.vector();
            atom.spin = dice.vector() * 200.0;
            atom
        })
        .collect();
    data_file(path, &atoms, Vec3::repeat(-0.02), Vec3::repeat(0.1));
}

const PROPERTIES: &str = "fix p1 all property/global youngsModulus peratomtype 5e6 2e7\n\
    fix p2 all property/global poissonsRatio peratomtype 0.3 0.2\n\
    fix p3 all property/global coefficientRestitution peratomtypepair 2 0.9 0.7 0.7 0.5\n\
    fix p4 all property/global coefficientFriction peratomtypepair 2 0.4 0.2 0.2 0.2\n\
    fix p5 all property/global characteristicVelocity scalar 2.0\n\
    fix p6 all property/global kn peratomtypepair 2 STIFF\n\
    fix p7 all property/global kt peratomtypepair 2 STIFF\n\
    fix p8 all property/global gamman peratomtypepair 2 DASHPOT\n\
    fix p9 all property/global gammat peratomtypepair 2 DASHPOT\n";

/// The pair style `pair` with the properties of its models.
pub fn model(pair: &str) -> String {
    let hertz = pair.contains("hertz");
    let properties = PROPERTIES
        .replace("STIFF", if hertz { "3e6 2e6 2e6 4e6" } else { "4e4 3e4 3e4 5e4" })
        .replace("DASHPOT", if hertz { "3e4 2e4 2e4 1e4" } else { "200 100 100 300" });
    format!("{pair}\n{properties}")
}

/// States of the cloud with the pair style `pair`, at every 100th of [`STEPS`] steps in `runs` runs.
pub fn result(folder: &Path, pair: &str, processors: usize, runs: usize) -> Vec<(u64, Vec<Dumped>)> {
    let mut script = head("cloud.data", "f f f", 1e-3, 2e-6);
    script.push_str(&model(pair));
    script.push_str("fix integrate all nve/sphere\nthermo 100\n");
    script.push_str(&dump("out.dump", 100));
    for _ in 0..runs {
        writeln!(script, "run {}", STEPS / runs).unwrap();
    }
    run(folder, &script, processors);
    frames(&folder.join("out.dump"))
}

/// Largest differences between two results in positions, velocities, and angular velocities, each relative to its largest magnitude.
pub fn difference(a: &[(u64, Vec<Dumped>)], b: &[(u64, Vec<Dumped>)]) -> [f64; 3] {
    let mut worst = [0.0f64; 3];
    let get = [|d: &Dumped| d.position, |d: &Dumped| d.velocity, |d: &Dumped| d.spin];
    for ((_, a), (_, b)) in a.iter().zip(b) {
        for (worst, get) in worst.iter_mut().zip(get) {
            let size = b.iter().map(|d| get(d).norm()).fold(0.0, f64::max);
            let apart = a.iter().zip(b).map(|(a, b)| (get(a) - get(b)).norm()).fold(0.0, f64::max);
            *worst = worst.max(apart / size);
        }
    }
    worst
}

/// A floor of two triangles in the path of the spheres.
pub fn floor(folder: &Path) {
    std::fs::write(
        folder.join("floor.stl"),
        "solid floor\nfacet normal 0 0 1\nouter loop\nvertex -0.02 -0.02 0.012\nvertex 0.1 -0.02 0.012\nvertex 0.1 0.1 0.012\n\
         endloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex -0.02 -0.02 0.012\nvertex 0.1 0.1 0.012\nvertex -0.02 0.1 0.012\n\
         endloop\nendfacet\nendsolid floor\n",
    )
    .unwrap();
}
