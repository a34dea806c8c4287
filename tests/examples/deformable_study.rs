//! One case of the study of deformable particles; see `validation/deformable.py`.
//!
//! ```sh
//! deformable_study stability 4979 1 0.35             # count, seed, ν_p
//! deformable_study solid fcc 1 0 0.35 0.25           # packing, seed, k_t/k_n, k_n/(R E_p), ν_p
//! deformable_study wave 4 1 0.5 0.18 0.45            # size, seed, k_t/k_n, k_n/E_p, ν_p
//! ```
//! Prints one JSON object. `k_n/E_p = 0` means rigid particles.

use concordem::kinematics::deformable::Condition;
use concordem::packing::lattice::Lattice;
use concordem::packing::random_dense::{RandomDense, random_dense};
use concordem::solver::coupling::convergence;
use concordem_tests::deformable::{
    DENSITY, NORMAL, Sample, disc_packing, elastic, growth, mean_field_solid, ratio_for_coordination, wave_speed,
};

#[expect(clippy::too_many_lines, reason = "a study, step by step")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let text = |k: usize| arguments.get(k).map(String::as_str).ok_or("an argument is missing; see the source");
    let real = |k: usize| -> Result<f64, Box<dyn std::error::Error>> { Ok(text(k)?.parse()?) };
    match text(0)? {
        "stability" => {
            let sample = plane(text(1)?.parse()?, text(2)?.parse()?);
            let poisson = real(3)?;
            let found = convergence(&sample.state(0.0), &elastic(1e11, poisson, Condition::PlaneStrain));
            let limit = 1e11 * found.spectral_radius;
            let grow = |factor: f64| growth(&sample, &elastic(limit * factor, poisson, Condition::PlaneStrain), 4000);
            println!(
                "{{\"softness_limit\": {:.5}, \"softness_sufficient\": {:.5}, \"young_limit\": {limit:.5e}, \
                 \"growth_above\": {:.4}, \"growth_below\": {}}}",
                NORMAL / limit,
                NORMAL / (1e11 * found.bound),
                grow(1.01),
                if grow(0.99).is_infinite() { "\"unbounded\"" } else { "\"bounded\"" }
            );
        }
        "solid" => {
            let (kappa, softness, poisson) = (real(3)?, real(4)?, real(5)?);
            let (normal, radius) = (1e7, 1e-3);
            let packing = match text(1)? {
                "sc" => Lattice::SimpleCubic.periodic(radius, [2; 3])?,
                "fcc" => Lattice::FaceCentered.periodic(radius, [2; 3])?,
                _ => random_dense(&RandomDense::jammed(2000, radius, 0.0, text(2)?.parse()?), &mut |_| ())?.packing,
            };
            // A frictionless packing has 6 contacts per sphere and hardly resists shear; with 8 bonds it is a solid.
            let random = text(1)? == "random";
            let fraction = packing.packing_fraction().unwrap_or(0.0);
            let ratio = if random { ratio_for_coordination(&packing, 8.0) } else { 1.01 };
            let sample = Sample { packing, planar: false, ratio, normal };
            let z = sample.voigt_modulus().1;
            let deformable = (softness > 0.0).then(|| elastic(normal / (radius * softness), poisson, Condition::Solid));
            let state = sample.state(kappa);
            let spectral = deformable.as_ref().map_or(0.0, |d| convergence(&state, d).spectral_radius);
            let (young, expected) = mean_field_solid(z, fraction, kappa, softness, poisson);
            if spectral >= 1.0 {
                println!(
                    "{{\"coordination\": {z:.4}, \"fraction\": {fraction:.4}, \"spectral_radius\": {spectral:.5}}}"
                );
                return Ok(());
            }
            let c = sample.constants(kappa, deformable.as_ref());
            let scale = normal / radius;
            println!(
                "{{\"coordination\": {z:.4}, \"fraction\": {fraction:.4}, \"spectral_radius\": {spectral:.5}, \
                 \"c11\": {:.5}, \"c12\": {:.5}, \"c44\": {:.5}, \"young\": {:.5}, \"poisson\": {:.5}, \
                 \"young_mean_field\": {young:.5}, \"poisson_mean_field\": {expected:.5}}}",
                c.c11 / scale,
                c.c12 / scale,
                c.c44 / scale,
                c.young / scale,
                c.poisson
            );
        }
        "wave" => {
            let size: usize = text(1)?.parse()?;
            let (kappa, softness, poisson) = (real(3)?, real(4)?, real(5)?);
            let normal = 1e10;
            // Table 5.1: 682 discs of 0.1 to 0.145 mm in 16.54 mm by 2.3 mm; `size` times as long and wide.
            let packing =
                disc_packing(682 * size * size, [1e-4, 1.2e-4, 1.45e-4], 0.12, 0.892, 16.54 / 2.3, text(2)?.parse()?);
            let bulk = 0.892 * DENSITY;
            let ratio = ratio_for_coordination(&packing, 5.6);
            let sample = Sample { packing, planar: true, ratio, normal };
            let deformable = (softness > 0.0).then(|| elastic(normal / softness, poisson, Condition::PlaneStrain));
            let c = sample.constants(kappa, deformable.as_ref());
            let [long, shear] =
                [false, true].map(|t| wave_speed(&sample, kappa, deformable.as_ref(), t, 10e-3 * size as f64));
            println!(
                "{{\"coordination\": {:.4}, \"poisson\": {:.5}, \"longitudinal\": {long:.3}, \"shear\": {shear:.3}, \
                 \"ratio\": {:.5}, \"expected\": {:.5}, \"voigt\": {:.5}, \"longitudinal_static\": {:.3}, \
                 \"shear_static\": {:.3}}}",
                sample.voigt_modulus().1,
                c.poisson,
                long / shear,
                (2.0 * (1.0 + c.poisson)).sqrt(),
                (8.0 / (3.0 + kappa)).sqrt(),
                (c.young / bulk).sqrt(),
                (c.c44 / bulk).sqrt()
            );
        }
        other => return Err(format!("no case `{other}`").into()),
    }
    Ok(())
}

/// The irregular specimen of the source (section 4.5) as far as it is described: 4979 discs of 0.218 to 0.652 mm, mean
/// 0.370 mm, area fraction 0.932, 5.8 bonds per disc; periodic here.
fn plane(count: usize, seed: u64) -> Sample {
    let packing = disc_packing(count, [2.18e-4, 3.6e-4, 6.52e-4], 0.22, 0.932, 1.0, seed);
    let ratio = ratio_for_coordination(&packing, 5.8);
    Sample { packing, planar: true, ratio, normal: NORMAL }
}
