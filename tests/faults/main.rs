//! Faults outside the physics: changed scenarios, damaged files, paths that must not be written to, impossible sizes, kills
//! before the first checkpoint, calls of the system that fail.

mod calls;
mod files;
mod restart;
mod sizes;

/// A small block of bonded spheres in tension.
const BLOCK: &str = r#"
version = 1
[packing]
kind = "lattice"
lattice = "hcp"
radius = "1 mm"
repeats = [5, 3, 5]
[[material]]
name = "stone"
density = 2500
linear_bond = { normal_stiffness = 1e6, shear_stiffness = 2e5 }
[bonds]
law = "linear_bond"
interaction_ratio = 1.05
[contacts]
law = "none"
[integration]
damping = { kind = "local", coefficient = 0.2 }
[loading]
kind = "uniaxial"
strain_rate = "1 1/s"
[stop]
steps = 100
[output]
sample_interval = 10
"#;
