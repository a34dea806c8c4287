//! Periodic lattices have the elastic constants that follow from their geometry.
//!
//! In a lattice with one particle per primitive cell the uniform deformation is the relaxed one, and the stiffness is
//! `D = (1/V) Σ L A (Ē n⊗n⊗n⊗n + Ḡ T)` exactly (Stránský 2018, (3.31)). With A = πr² and links between touching
//! spheres:
//! * simple cubic: `D11 = πĒ/4`, `D12 = 0`, `D44 = πḠ/8`;
//! * face-centered cubic: `q = 3π/√2`, `D11 = q(Ē+Ḡ)/6`, `D12 = q(Ē−Ḡ)/12`, `D44 = q(Ē+Ḡ)/12`.

use concordem::math::Mat3;
use concordem::packing::lattice::Lattice;
use concordem::solver::integrate::Damping;
use concordem::solver::{Model, time_step};
use concordem_tests::{DENSITY, bonded, concrete, law, on_threads, particles, solver};

/// Order 11, 22, 33, 23, 31, 12; engineering shear strains.
const VOIGT: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1)];

/// Stress per strain of a unit cell for a strain of 1e-7 in each of the six modes, relaxed by damping. In shear the
/// cell also rotates (only one component of the velocity gradient is not zero), and the spheres must follow.
fn stiffness(lattice: Lattice) -> [[f64; 6]; 6] {
    const STRAIN: f64 = 1e-7;
    const LOADING: u32 = 100;
    let mut columns = [[0.0; 6]; 6];
    for (mode, &(i, j)) in VOIGT.iter().enumerate() {
        let packing = lattice.periodic(1e-3, [1; 3]).unwrap();
        // Bond touching spheres only, in spite of rounding; the second neighbors are at least 15 % farther away.
        let mut state = bonded(particles(&packing, DENSITY), packing.cell, law(&concrete()), 1.0 + 1e-9);
        state.clock.dt = 0.2 * time_step::bounds(&state).spectral;
        let damping = Damping::Local { translation: 0.5, rotation: 0.5 };
        let mut solver = solver(Model { damping, ..Model::default() }, &mut state);
        let mut gradient = Mat3::zeros();
        gradient[(i, j)] = STRAIN / (f64::from(LOADING) * state.clock.dt);
        solver.set_velocity_gradient(&state.cell.unwrap(), gradient);
        for _ in 0..LOADING {
            solver.step(&mut state).unwrap();
        }
        solver.set_velocity_gradient(&state.cell.unwrap(), Mat3::zeros());
        for _ in 0..3000 {
            solver.step(&mut state).unwrap();
        }
        let report = solver.step(&mut state).unwrap();
        let cell = state.cell.unwrap();
        let stress = report.virial / cell.volume();
        let strain = (cell.deformation_gradient - Mat3::identity())[(i, j)];
        assert!((strain / STRAIN - 1.0).abs() < 1e-6, "the cell deformed by {strain:e}");
        for (row, &(k, l)) in VOIGT.iter().enumerate() {
            columns[row][mode] = 0.5 * (stress[(k, l)] + stress[(l, k)]) / strain;
        }
        assert!((stress - stress.transpose()).abs().max() < 1e-6 * stress.abs().max(), "moments must balance");
    }
    columns
}

/// Asserts all 36 constants within 1e-6 of D11: lengths of 2e-3 m are known to 4e-19 m and elongations are at most 2e-10 m,
/// so a dozen rounding errors are 1e-8; the change of geometry is 1e-7; the remaining oscillation is below both.
fn compare(lattice: Lattice, d11: f64, d12: f64, d44: f64) {
    let found = on_threads(1, || stiffness(lattice));
    let mut worst = 0.0_f64;
    for (i, row) in found.iter().enumerate() {
        for (j, value) in row.iter().enumerate() {
            let exact = match (i, j) {
                _ if i == j && i < 3 => d11,
                _ if i == j => d44,
                _ if i < 3 && j < 3 => d12,
                _ => 0.0,
            };
            worst = worst.max((value - exact).abs() / d11);
        }
    }
    println!(
        "{lattice:?}: D11 {:.9e} D12 {:.3e} D44 {:.9e}, worst error {worst:.1e} D11",
        found[0][0], found[0][1], found[3][3]
    );
    assert!(worst < 1e-6, "{lattice:?}: {worst:e} {found:?}");
}

#[test]
fn a_simple_cubic_lattice_has_its_elastic_constants() {
    let (normal, shear) = (concrete().young, concrete().shear_modulus());
    let pi = std::f64::consts::PI;
    compare(Lattice::SimpleCubic, pi * normal / 4.0, 0.0, pi * shear / 8.0);
}

#[test]
fn a_face_centered_cubic_lattice_has_its_elastic_constants() {
    let (normal, shear) = (concrete().young, concrete().shear_modulus());
    let q = 3.0 * std::f64::consts::PI / 2.0_f64.sqrt();
    compare(
        Lattice::FaceCentered,
        q * (normal + shear) / 6.0,
        q * (normal - shear) / 12.0,
        q * (normal + shear) / 12.0,
    );
}
