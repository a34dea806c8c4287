//! Silica modeled with cohesive beams, compared with the tables of Jebahi, André, Terreros, Iordanoff 2015.
//!
//! ```text
//! cargo run --release --example beam_study                         one small case of each kind
//! cargo run --release --example beam_study -- FILE.json            all cases; skips those in FILE.json
//! ```
//!
//! Elastic constants for several sizes (tension, bending, torsion: tables 2.3 and 2.5), periods and the speed of a pulse
//! (table 2.6), and strength under the three loads with either criterion (tables 4.1 and 4.2). The file receives each case
//! as soon as it is finished.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};

use concordem::calibration::cohesive_beam::{
    CylinderLoad, CylinderRecipe, CylinderSpecimen, FractureCriterion, ParticlePressures, elastic, impact, strength,
    vibration,
};
use concordem::law::{BendingTerm, CohesiveBeam, Section};
use concordem::math::{Mat3, Vec3};
use serde_json::{Value, json};

/// Tables 2.3 and 2.4.
const YOUNG: f64 = 295.5e9;
const RATIO: f64 = 0.68;
const POISSON: f64 = 0.3;
const DENSITY: f64 = 2200.0;

type Outcome<T> = Result<T, Box<dyn Error>>;

struct Study {
    path: Option<PathBuf>,
    cases: BTreeMap<String, Value>,
    sample: Option<CylinderSpecimen>,
}

impl Study {
    fn open(path: Option<PathBuf>) -> Outcome<Self> {
        let cases = match &path {
            Some(path) if path.exists() => serde_json::from_str(&std::fs::read_to_string(path)?)?,
            _ => BTreeMap::new(),
        };
        Ok(Self { path, cases, sample: None })
    }

    /// Keeps only one specimen, because specimens are large.
    fn sample(&mut self, recipe: CylinderRecipe) -> Outcome<CylinderSpecimen> {
        if let Some(sample) = self.sample.as_ref().filter(|sample| sample.recipe == recipe) {
            return Ok(sample.clone());
        }
        self.sample = None;
        Ok(self.sample.insert(CylinderSpecimen::new(&recipe, &mut |_| {})?).clone())
    }

    /// Computes a case unless it is already in the file.
    fn case(&mut self, name: &str, work: impl FnOnce(&mut Self) -> Outcome<Value>) -> Outcome<()> {
        if self.cases.contains_key(name) {
            return Ok(());
        }
        let start = std::time::Instant::now();
        let mut value = work(self)?;
        value["wall_s"] = json!((start.elapsed().as_secs_f64() * 10.0).round() / 10.0);
        println!("{name}: {value}");
        self.cases.insert(name.to_owned(), value);
        if let Some(path) = &self.path {
            let text = serde_json::to_string_pretty(&self.cases)? + "\n";
            let temporary = path.with_extension("tmp");
            std::fs::write(&temporary, text)?;
            std::fs::rename(&temporary, path)?;
        }
        Ok(())
    }
}

fn facts(sample: &CylinderSpecimen) -> Value {
    json!({
        "spheres": sample.spheres.len(),
        "solid_fraction": sample.solid_fraction,
        "dispersion": sample.recipe.dispersion,
        "coordination_in_the_bulk": sample.coordination,
        "touching_in_the_bulk": sample.touching,
        "interaction_ratio": sample.interaction_ratio,
        "radius_m": sample.radius,
        "length_m": sample.length,
    })
}

fn elasticity(study: &mut Study, recipe: CylinderRecipe) -> Outcome<Value> {
    let sample = study.sample(recipe)?;
    let beam = CohesiveBeam::new(YOUNG, POISSON, Section::Ratio(RATIO))?;
    let mut value = json!({ "sample": facts(&sample) });
    let tension = elastic(&sample, &beam, CylinderLoad::Tension)?;
    let bending = elastic(&sample, &beam, CylinderLoad::Bending)?;
    let torsion = elastic(&sample, &beam, CylinderLoad::Torsion)?;
    let shear_modulus = tension.modulus / (2.0 * (1.0 + tension.poisson));
    value["young_gpa"] = json!(tension.modulus / 1e9);
    value["poisson"] = json!(tension.poisson);
    value["bounding_young_gpa"] = json!(tension.bounding_modulus / 1e9);
    value["bounding_poisson"] = json!(tension.bounding_poisson);
    value["bending_young_over_young"] = json!(bending.modulus / tension.modulus);
    value["torsion_shear_modulus_over_isotropic"] = json!(torsion.modulus / shear_modulus);
    value["energy_shares"] = json!(tension.shares);
    value["steps"] = json!([tension.steps, bending.steps, torsion.steps]);
    Ok(value)
}

/// Scatter of the mean stresses that decide on the failure of particles, in the elastic specimen under each load.
fn pressures(study: &mut Study, recipe: CylinderRecipe) -> Outcome<Value> {
    let sample = study.sample(recipe)?;
    let beam = CohesiveBeam::new(YOUNG, POISSON, Section::Ratio(RATIO))?;
    let mut value = json!({ "sample": facts(&sample) });
    for (name, load) in
        [("tension", CylinderLoad::Tension), ("bending", CylinderLoad::Bending), ("torsion", CylinderLoad::Torsion)]
    {
        let ParticlePressures { bulk, skin, largest, sum } = elastic(&sample, &beam, load)?.pressures;
        value[name] = json!({
            "bulk_mean_and_deviation_over_local_stress": bulk,
            "skin_mean_and_deviation_over_local_stress": skin,
            "largest_over_stress_of_the_surface": largest,
            "sum_by_volume": sum,
        });
    }
    Ok(value)
}

/// First periods, compared with the formulas for a clamped-free bar with the constants of the specimen (table 2.6).
fn vibrations(study: &mut Study, size: usize, seed: u64) -> Outcome<Value> {
    use std::f64::consts::PI;
    let sample = study.sample(CylinderRecipe::book(size, seed))?;
    let beam = CohesiveBeam::new(YOUNG, POISSON, Section::Ratio(RATIO))?;
    let tension = elastic(&sample, &beam, CylinderLoad::Tension)?;
    let shear_modulus = tension.modulus / (2.0 * (1.0 + tension.poisson));
    let density = sample.sphere_density(DENSITY);
    let r = sample.radius;
    let mut value = json!({ "sample": facts(&sample), "young_gpa": tension.modulus / 1e9, "poisson": tension.poisson });
    for (name, load) in
        [("tension", CylinderLoad::Tension), ("bending", CylinderLoad::Bending), ("torsion", CylinderLoad::Torsion)]
    {
        let found = vibration(&sample, &beam, load, density)?;
        let l = found.free_length;
        let (area, inertia) = (PI * r * r, 0.25 * PI * r.powi(4));
        let theory = match load {
            CylinderLoad::Tension => 4.0 * l * (DENSITY / tension.modulus).sqrt(),
            CylinderLoad::Torsion => 4.0 * l * (DENSITY / shear_modulus).sqrt(),
            CylinderLoad::Bending => {
                2.0 * PI / 1.875_104_f64.powi(2) * l * l * (DENSITY * area / (tension.modulus * inertia)).sqrt()
            }
        };
        value[format!("{name}_period_s")] = json!(found.period);
        value[format!("{name}_over_theory")] = json!(found.period / theory);
    }
    Ok(value)
}

/// Speed of a pulse compared with `√(E/ρ)` with the modulus of the specimen (table 2.6), by the struck length. The cylinders
/// have a slenderness of ten, so that the pulse is long compared to the radius and short compared to the length; longer
/// ones show the speed of longer pulses.
fn impacts(study: &mut Study, count: usize, slenderness: f64, radii: &[f64], seed: u64) -> Outcome<Value> {
    let sample = study.sample(CylinderRecipe { slenderness, ..CylinderRecipe::book(count, seed) })?;
    let beam = CohesiveBeam::new(YOUNG, POISSON, Section::Ratio(RATIO))?;
    let tension = elastic(&sample, &beam, CylinderLoad::Tension)?;
    let bar = (tension.modulus / DENSITY).sqrt();
    let sphere_density = sample.sphere_density(DENSITY);
    let (mut by_half, mut by_peaks) = (Vec::new(), Vec::new());
    for struck in radii {
        let found = impact(&sample, &beam, sphere_density, struck * sample.radius, bar)?;
        by_half.push(found.wave_speed / bar);
        by_peaks.push(found.by_peaks / bar);
    }
    let solid: f64 = sample
        .spheres
        .iter()
        .filter(|sphere| sphere.position.x.abs() < 0.25 * sample.length)
        .map(|sphere| 4.0 / 3.0 * std::f64::consts::PI * sphere.radius.powi(3))
        .sum();
    let middle = std::f64::consts::PI * sample.radius * sample.radius * 0.5 * sample.length;
    Ok(json!({
        "sample": facts(&sample),
        "young_gpa": tension.modulus / 1e9,
        "poisson": tension.poisson,
        "bar_celerity_m_per_s": bar,
        "density_of_middle_half_over_mean": solid * sphere_density / (middle * DENSITY),
        "struck_length_over_radius": radii,
        "celerity_over_theory": by_half,
        "celerity_by_peaks_over_theory": by_peaks,
    }))
}

fn broken(study: &mut Study, recipe: CylinderRecipe, criterion: &str, load: &str) -> Outcome<Value> {
    let sample = study.sample(recipe)?;
    let beam = CohesiveBeam::new(YOUNG, POISSON, Section::Ratio(RATIO))?;
    let kind = match criterion {
        "particles" => FractureCriterion::Particle(64e6),
        "half-sum" => FractureCriterion::Beam(292e6, BendingTerm::HalfSum),
        "larger-end" => FractureCriterion::Beam(292e6, BendingTerm::LargerEnd),
        _ => FractureCriterion::Beam(292e6, BendingTerm::MidSection),
    };
    let loading = match load {
        "tension" => CylinderLoad::Tension,
        "bending" => CylinderLoad::Bending,
        _ => CylinderLoad::Torsion,
    };
    let found = strength(&sample, &beam, kind, sample.sphere_density(DENSITY), loading)?;
    let events = &found.events;
    // The direction in which broken bonds scatter least is the normal of the crack.
    let mean = events.iter().map(|e| e.position).sum::<Vec3>() / events.len().max(1) as f64;
    let scatter: Mat3 = events.iter().map(|e| (e.position - mean) * (e.position - mean).transpose()).sum();
    let eigen = nalgebra::SymmetricEigen::new(scatter);
    let across = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    Ok(json!({
        "particles": found.particles,
        "coordination_in_the_bulk": sample.coordination,
        "solid_fraction": sample.solid_fraction,
        "dispersion": sample.recipe.dispersion,
        "strength_mpa": found.strength / 1e6,
        "stress_at_first_break_mpa": found.first_break / 1e6,
        "strain_at_peak": found.strain,
        "broken": events.len(),
        "fragments": found.fragments,
        "angle_of_crack_normal_to_axis_deg": across.x.abs().min(1.0).acos().to_degrees(),
        "steps": found.steps,
        "ledger_residual_over_work": found.residual,
    }))
}

fn main() -> Outcome<()> {
    let path = std::env::args().nth(1);
    let full = path.is_some();
    let mut study = Study::open(path.as_deref().map(|p| Path::new(p).to_owned()))?;
    let (sizes, seeds): (&[usize], u64) = if full { (&[1000, 3000, 10_000], 4) } else { (&[500], 1) };
    let largest = sizes[sizes.len() - 1];
    for &size in sizes {
        for seed in 1..=seeds {
            let recipe = CylinderRecipe::book(size, seed);
            study.case(&format!("elastic, {size}, seed {seed}"), |s| elasticity(s, recipe))?;
            study.case(&format!("pressures, {size}, seed {seed}"), |s| pressures(s, recipe))?;
            study.case(&format!("vibration, {size}, seed {seed}"), |s| vibrations(s, size, seed))?;
            let radii = [1.0, 2.0, 3.0, 4.0];
            study.case(&format!("impact, {size}, seed {seed}"), |s| impacts(s, size, 10.0, &radii, seed))?;
            let criteria: &[&str] = if size == largest && seed == 1 && full {
                &["mid-section", "particles", "half-sum", "larger-end"]
            } else {
                &["mid-section", "particles"]
            };
            for criterion in criteria {
                for load in ["tension", "bending", "torsion"] {
                    let name = format!("strength, {size}, seed {seed}, {criterion}, {load}");
                    study.case(&name, |s| broken(s, recipe, criterion, load))?;
                }
            }
        }
    }
    // Filled between walls, with a dense skin.
    for &size in sizes {
        for seed in 1..=seeds {
            let recipe = CylinderRecipe { walled: true, ..CylinderRecipe::book(size, seed) };
            study.case(&format!("walled elastic, {size}, seed {seed}"), |s| elasticity(s, recipe))?;
            study.case(&format!("walled pressures, {size}, seed {seed}"), |s| pressures(s, recipe))?;
            for criterion in ["mid-section", "particles"] {
                for load in ["tension", "bending", "torsion"] {
                    let name = format!("walled strength, {size}, seed {seed}, {criterion}, {load}");
                    study.case(&name, |s| broken(s, recipe, criterion, load))?;
                }
            }
        }
    }
    // As thick as a cylinder of a thousand spheres, and four times as long.
    for seed in 1..=if full { seeds } else { 0 } {
        let radii = [1.0, 2.0, 4.0, 8.0, 16.0];
        study.case(&format!("impact on a long bar, 4000, seed {seed}"), |s| impacts(s, 4000, 40.0, &radii, seed))?;
    }
    Ok(())
}
