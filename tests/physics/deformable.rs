//! Packings of deformable particles have the expected elastic constants and stability limits. Small packings;
//! `examples/deformable_study.rs` runs the same with the packings of the source.

use std::f64::consts::PI;

use concordem::kinematics::deformable::Condition;
use concordem::packing::lattice::Lattice;
use concordem::solver::coupling::convergence;
use concordem_tests::deformable::{NORMAL, Sample, disc_packing, elastic, growth, mean_field, ratio_for_coordination};
use concordem_tests::on_threads;

fn discs(count: usize) -> Sample {
    let packing = disc_packing(count, [2.18e-4, 3.6e-4, 6.52e-4], 0.22, 0.932, 1.0, 1);
    let ratio = ratio_for_coordination(&packing, 5.8);
    Sample { packing, planar: true, ratio, normal: NORMAL }
}

/// Cubic lattices of spheres without shear springs deform uniformly and agree with closed forms: simple cubic
/// `E = 1/(2R(1/k_n + 3/(πRE_p)))`, `ν = 3ν_p k_n/(πRE_p + 3k_n)`; any packing with uniform deformation
/// `K = φZk_n/(6πR(1+a))`, `a = Zk_n(1−2ν_p)/(2πRE_p)`. Tolerance 1e-5: strains of 1e-6 change lengths and directions by
/// 1e-6.
#[test]
fn cubic_lattices_of_spheres_agree_with_closed_forms() {
    let (normal, radius, young, poisson) = (1e7, 1e-3, 5e10, 0.3);
    let deformable = elastic(young, poisson, Condition::Solid);
    on_threads(1, || {
        for (lattice, count) in [(Lattice::SimpleCubic, 6.0), (Lattice::FaceCentered, 12.0)] {
            let packing = lattice.periodic(radius, [2; 3]).unwrap();
            let fraction = packing.packing_fraction().unwrap();
            let sample = Sample { packing, planar: false, ratio: 1.01, normal };
            let c = sample.constants(0.0, Some(&deformable));
            let a = count * normal * (1.0 - 2.0 * poisson) / (2.0 * PI * radius * young);
            let bulk = fraction * count * normal / (6.0 * PI * radius * (1.0 + a));
            println!("{lattice:?}: {c:?}");
            assert!(((c.c11 + 2.0 * c.c12) / (3.0 * bulk) - 1.0).abs() < 1e-5, "{c:?} {bulk:e}");
            if lattice == Lattice::SimpleCubic {
                let softer = PI * radius * young;
                assert!((c.poisson / (3.0 * poisson * normal / (softer + 3.0 * normal)) - 1.0).abs() < 1e-5);
                assert!((c.young * 2.0 * radius * (1.0 / normal + 3.0 / softer) - 1.0).abs() < 1e-5);
            }
        }
    });
}

/// An irregular packing of discs (Madan 2019, section 4.5): ν does not change at ν_p = 0.25 (within 0.01), grows with ν_p,
/// and the ratio of moduli agrees with the mean field within 3 %.
#[test]
fn poisson_range_of_an_irregular_packing() {
    let sample = discs(400);
    let (_, z) = sample.voigt_modulus();
    let (kappa, softness) = (0.5, 0.35);
    let rigid = sample.constants(kappa, None);
    let mut last = f64::NEG_INFINITY;
    for poisson in [0.05, 0.25, 0.45] {
        let deformable = elastic(NORMAL / softness, poisson, Condition::PlaneStrain);
        let c = sample.constants(kappa, Some(&deformable));
        let expected = mean_field(z, kappa, softness, poisson).0 / mean_field(z, kappa, 0.0, poisson).0;
        println!(
            "ν_p {poisson}: ν {:.4} (rigid {:.4}), E/E_rigid {:.4} (mean field {expected:.4})",
            c.poisson,
            rigid.poisson,
            c.young / rigid.young
        );
        assert!(c.poisson > last);
        last = c.poisson;
        assert!((c.young / rigid.young / expected - 1.0).abs() < 0.03);
        let shift = c.poisson - rigid.poisson;
        if poisson == 0.25 {
            assert!(shift.abs() < 0.01, "{shift}");
        } else {
            assert!(shift * (poisson - 0.25) > 0.0 && shift.abs() > 0.05, "{shift}");
        }
    }
}

/// The lagged scheme becomes unstable when the spectral radius of the packing exceeds 1: runs 1 % below the limit of k_n/E_p
/// stay bounded, runs 1 % above grow without bound; the sufficient bound is below the limit.
#[test]
fn stability_limit_of_an_irregular_packing() {
    let sample = discs(400);
    let state = sample.state(0.0);
    for poisson in [0.1, 0.35] {
        let found = convergence(&state, &elastic(1e11, poisson, Condition::PlaneStrain));
        let limit = 1e11 * found.spectral_radius;
        let grow = |factor: f64| growth(&sample, &elastic(limit * factor, poisson, Condition::PlaneStrain), 4000);
        let (stiffer, softer) = (grow(1.01), grow(0.99));
        println!("ν_p {poisson}: k_n/E_p {:.4}, bound {:.4}", NORMAL / limit, NORMAL / (1e11 * found.bound));
        assert!(stiffer < 3.0 && softer.is_infinite(), "{stiffer} {softer}");
        assert!(found.bound >= found.spectral_radius);
    }
}
