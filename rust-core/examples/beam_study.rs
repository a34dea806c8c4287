//! Silica made of cohesive beams, beside the tables of Jebahi, André, Terreros, Iordanoff 2015.
//!
//! ```text
//! cargo run --release --example beam_study                         one small case of each kind
//! cargo run --release --example beam_study -- FILE.json            all cases; goes on where FILE.json ends
//! ```
//!
//! Elastic constants for several sizes (tension, bending, torsion: tables 2.3 and 2.5), and strength under the three loads
//! with either criterion (tables 4.1 and 4.2). Each case goes to the file when it is done.

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use concordem::assembly::assemble;
use concordem::assembly::packing::export_text;
use concordem::calibration::cohesive_beam::{Load, Sample, SampleRecipe, elastic};
use concordem::fracture::fragments::{count, fragments};
use concordem::law::{CohesiveBeam, Section};
use concordem::plan::Simulation;
use concordem::scenario::Scenario;
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
    samples: BTreeMap<(usize, u64), Sample>,
}

impl Study {
    fn open(path: Option<PathBuf>) -> Outcome<Self> {
        let cases = match &path {
            Some(path) if path.exists() => serde_json::from_str(&std::fs::read_to_string(path)?)?,
            _ => BTreeMap::new(),
        };
        Ok(Self { path, cases, samples: BTreeMap::new() })
    }

    fn sample(&mut self, size: usize, seed: u64) -> Outcome<Sample> {
        if let Some(sample) = self.samples.get(&(size, seed)) {
            return Ok(sample.clone());
        }
        let sample = Sample::new(&SampleRecipe::book(size, seed), &mut |_| {})?;
        // One at a time is enough, and they are large.
        self.samples.clear();
        self.samples.insert((size, seed), sample.clone());
        Ok(sample)
    }

    /// Do a case that is not known yet.
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

fn facts(sample: &Sample) -> Value {
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

fn elasticity(study: &mut Study, size: usize, seed: u64) -> Outcome<Value> {
    let sample = study.sample(size, seed)?;
    let beam = CohesiveBeam::new(YOUNG, POISSON, Section::Ratio(RATIO))?;
    let mut value = json!({ "sample": facts(&sample) });
    let tension = elastic(&sample, &beam, Load::Tension)?;
    let bending = elastic(&sample, &beam, Load::Bending)?;
    let torsion = elastic(&sample, &beam, Load::Torsion)?;
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

/// Break a sample; `prism`: a box of the same volume and slenderness.
fn strength(study: &mut Study, size: usize, seed: u64, criterion: &str, load: &str) -> Outcome<Value> {
    let sample = study.sample(size, seed)?;
    let folder = tempfile::tempdir()?;
    let mut text = Vec::new();
    export_text(&sample.unit, &mut text)?;
    std::fs::write(folder.path().join("unit.txt"), text)?;
    let edges = sample.unit.cell.ok_or("the packing is periodic")?.matrix.diagonal();
    let (r, l) = (sample.radius, sample.length);
    let side = r * std::f64::consts::PI.sqrt();
    let shape = if load == "bending" {
        format!("{{ kind = \"box\", size = [{l:e}, {side:e}, {side:e}] }}")
    } else {
        format!("{{ kind = \"cylinder\", radius = {r:e}, height = {l:e}, axis = \"x\" }}")
    };
    let density = sample.sphere_density(DENSITY);
    // Strain of the surface at a rate of 1/s.
    let motion = match load {
        "tension" => "kind = \"uniaxial\"\naxis = \"x\"\nstrain_rate = 1.0\nlateral = \"free\"".to_owned(),
        "bending" => format!("kind = \"bending\"\naxis = \"x\"\nabout = \"z\"\nrate = {:e}", 2.0 * l / side),
        _ => format!("kind = \"torsion\"\naxis = \"x\"\nrate = {:e}", 2.0 * l / r),
    };
    let threshold = match criterion {
        "particles" => "hydrostatic_strength = \"64 MPa\"".to_owned(),
        reading => format!("tensile_strength = \"292 MPa\"\nbending_term = \"{reading}\""),
    };
    let mut scenario = String::new();
    write!(
        scenario,
        "version = 1\n[packing]\nkind = \"file\"\npath = \"unit.txt\"\ncell = [{:e}, {:e}, {:e}]\nshape = {shape}\n\
         [[material]]\nname = \"silica\"\ndensity = {density:e}\n[material.cohesive_beam]\nyoung = {YOUNG:e}\n\
         poisson = {POISSON}\nradius_ratio = {RATIO}\n{threshold}\n[material.frictional]\nyoung = \"75 GPa\"\n\
         stiffness_ratio = 0.3\nfriction_coefficient = 0.5\n[bonds]\nlaw = \"cohesive_beam\"\ncoordination = {}\n\
         [contacts]\nlaw = \"frictional\"\n[integration]\ndamping = {{ kind = \"tchamwa-wielgosz\", phi = 1.3 }}\n\
         [loading]\n{motion}\n[stop]\ndrop_to = 0.3\nstrain = 1e-2\n[output]\nsample_interval = 20\n",
        edges.x, edges.y, edges.z, sample.recipe.coordination
    )?;
    let scenario = Scenario::parse("beam_study.toml", &scenario)?;
    let assembly = assemble(&scenario, folder.path(), &mut |_, _| {})?;
    let particles = assembly.summary.particles;
    let mut simulation = Simulation::new(assembly.state, assembly.model, assembly.plan)?;
    let (mut peak, mut at_peak, mut first, mut samples) = (0.0_f64, 0.0, None, Vec::new());
    let mut broken_at_peak = 0.0;
    let mut events = Vec::new();
    loop {
        let advance = simulation.advance()?;
        if first.is_none() && !advance.events.is_empty() {
            first = samples.last().map(|s: &(f64, f64)| s.1);
        }
        events.extend(advance.events);
        if let Some(sample) = advance.sample {
            samples.push((sample.strain, sample.stress));
            if sample.stress > peak {
                (peak, at_peak, broken_at_peak) = (sample.stress, sample.strain, sample.broken);
            }
        }
        if let Some(reason) = advance.stopped {
            let ledger = &simulation.state.ledger;
            let pieces = fragments(&simulation.state);
            let mut normal = nalgebra::Matrix3::zeros();
            let mean = events.iter().map(|e| e.position).sum::<concordem::math::Vec3>() / events.len().max(1) as f64;
            for event in &events {
                let d = event.position - mean;
                normal += d * d.transpose();
            }
            let eigen = nalgebra::SymmetricEigen::new(normal);
            let across = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
            return Ok(json!({
                "particles": particles,
                "coordination_in_the_bulk": sample.coordination,
                "solid_fraction": sample.solid_fraction,
                "dispersion": sample.recipe.dispersion,
                "strength_mpa": peak / 1e6,
                "stress_at_first_break_mpa": first.map(|s| s / 1e6),
                "strain_at_peak": at_peak,
                "broken_at_peak": broken_at_peak,
                "broken": events.len(),
                "fragments": count(&pieces),
                "angle_of_crack_normal_to_axis_deg": across.x.abs().min(1.0).acos().to_degrees(),
                "stop": reason.to_string(),
                "steps": simulation.state.clock.step,
                "ledger_residual_over_work": ledger.residual() / ledger.boundary_work.get(),
            }));
        }
    }
}

fn main() -> Outcome<()> {
    let path = std::env::args().nth(1);
    let full = path.is_some();
    let mut study = Study::open(path.as_deref().map(|p| Path::new(p).to_owned()))?;
    let (sizes, seeds): (&[usize], u64) = if full { (&[1000, 3000, 10_000], 4) } else { (&[500], 1) };
    let largest = sizes[sizes.len() - 1];
    for &size in sizes {
        for seed in 1..=seeds {
            study.case(&format!("elastic, {size}, seed {seed}"), |s| elasticity(s, size, seed))?;
            let criteria: &[&str] =
                if size == largest && seed == 1 && full { &["mid-section", "particles", "half-sum", "larger-end"] } else { &["mid-section", "particles"] };
            for criterion in criteria {
                for load in ["tension", "bending", "torsion"] {
                    let name = format!("strength, {size}, seed {seed}, {criterion}, {load}");
                    study.case(&name, |s| strength(s, size, seed, criterion, load))?;
                }
            }
        }
    }
    Ok(())
}
