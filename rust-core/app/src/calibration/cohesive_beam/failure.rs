//! Loads a cylinder until it breaks.

use std::f64::consts::PI;

use super::error::CalibrationError;
use super::response::CylinderLoad;
use super::specimen::CylinderSpecimen;
use concordem_contact::law::{BendingTerm, CohesiveBeam, Section};
use concordem_contact::math::Vec3;
use concordem_operator::interruption::look;
use concordem_packing::export_text;
use concordem_scenario::assembly::assemble;
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::Scenario;
use concordem_solver::fracture::Event;
use concordem_solver::fracture::fragments::{count, fragments};

/// Fracture criterion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FractureCriterion {
    /// Largest principal stress of a beam, Pa, and the definition of its bending term.
    Beam(f64, BendingTerm),
    /// Mean stress of a particle, Pa.
    Particle(f64),
}

/// Strain rate of strength runs (in bending and torsion: at the surface), 1/s.
const STRAIN_RATE: f64 = 1.0;

/// Scenario that loads the specimen until it breaks: a cylinder, or for bending a prism of the same length and
/// cross-section. `packing` is the file of the periodic packing, in meters; without a file, and for a specimen between walls, the
/// scenario makes the packing again.
pub fn scenario_text(
    sample: &CylinderSpecimen,
    packing: Option<&str>,
    beam: &CohesiveBeam,
    criterion: FractureCriterion,
    sphere_density: f64,
    load: CylinderLoad,
) -> String {
    let recipe = &sample.recipe;
    let (r, l) = (sample.radius, sample.length);
    let side = r * PI.sqrt();
    let shape = if load == CylinderLoad::Bending {
        format!("{{ kind = \"box\", size = [{l:e}, {side:e}, {side:e}] }}")
    } else {
        format!("{{ kind = \"cylinder\", radius = {r:e}, height = {l:e}, axis = \"x\" }}")
    };
    let source = packing_keys(sample, packing);
    let motion = match load {
        CylinderLoad::Tension => {
            format!("kind = \"uniaxial\"\naxis = \"x\"\nstrain_rate = {STRAIN_RATE:?}\nlateral = \"free\"")
        }
        CylinderLoad::Bending => {
            let rate = 2.0 * STRAIN_RATE * l / side;
            format!("kind = \"bending\"\naxis = \"x\"\nabout = \"z\"\nrate = {rate:e}")
        }
        CylinderLoad::Torsion => format!("kind = \"torsion\"\naxis = \"x\"\nrate = {:e}", 2.0 * STRAIN_RATE * l / r),
    };
    let threshold = criterion_keys(criterion);
    let section = match beam.section {
        Section::Ratio(ratio) => format!("radius_ratio = {ratio:?}"),
        Section::RatioOfPair { ratio, radius } => {
            format!("radius_ratio = {ratio:?}\nradius_rule = {:?}", radius.key())
        }
        Section::Radius(radius) => format!("radius = {radius:e}"),
    };
    format!(
        "# SI units. Specimen: {} spheres, solid fraction {:.4}, dispersion of radii {}, {:.3} bonds per particle in the bulk.\n\
         version = 1\n\n[packing]\n{source}\nshape = {shape}\n\n\
         [[material]]\nname = \"beams\"\ndensity = {sphere_density:?}\n\n\
         [material.cohesive_beam]\nyoung = {:e}\npoisson = {:?}\n{section}\n{threshold}\n\n\
         [material.frictional]\nyoung = {:e}\nstiffness_ratio = 0.3\nfriction_coefficient = 0.5\n\n\
         [bonds]\nlaw = \"cohesive_beam\"\ncoordination = {:?}\n\n[contacts]\nlaw = \"frictional\"\n\n\
         [integration]\ndamping = {{ kind = \"tchamwa-wielgosz\", phi = 1.3 }}\n\n\
         [loading]\n{motion}\n\n[stop]\ndrop_to = 0.3\nstrain = 1e-2\n\n[output]\nsample_interval = 20\n",
        sample.spheres.len(),
        sample.solid_fraction,
        recipe.dispersion,
        sample.coordination,
        beam.young,
        beam.poisson,
        // This makes spheres in contact approximately as stiff as the material.
        0.25 * beam.young,
        recipe.coordination,
    )
}

/// The keys of the packing.
fn packing_keys(sample: &CylinderSpecimen, packing: Option<&str>) -> String {
    let recipe = &sample.recipe;
    let half = 0.5 * recipe.dispersion * recipe.mean_radius;
    let (low, high) = (recipe.mean_radius - half, recipe.mean_radius + half);
    if recipe.walled {
        return format!(
            "kind = \"cooker\"\ncoordination = {:?}\nradii = {{ kind = \"uniform\", minimum = {low:e}, maximum = {high:e} }}\n\
             seed = {}",
            recipe.coordination, recipe.seed
        );
    }
    if let Some(file) = packing {
        let edges = sample.unit.cell.map_or_else(Vec3::zeros, |cell| cell.matrix.diagonal());
        return format!("kind = \"file\"\npath = \"{file}\"\ncell = [{:e}, {:e}, {:e}]", edges.x, edges.y, edges.z);
    }
    format!(
        "kind = \"random-dense\"\ncount = {}\nradii = {{ kind = \"uniform\", minimum = {low:e}, maximum = {high:e} }}\n\
         seed = {}\nfriction = 0",
        recipe.count, recipe.seed
    )
}

/// The keys of the fracture criterion.
fn criterion_keys(criterion: FractureCriterion) -> String {
    match criterion {
        FractureCriterion::Beam(strength, term) => {
            let term = match term {
                BendingTerm::MidSection => "mid-section",
                BendingTerm::HalfSum => "half-sum",
                BendingTerm::LargerEnd => "larger-end",
            };
            format!("tensile_strength = {strength:e}\nbending_term = \"{term}\"")
        }
        FractureCriterion::Particle(strength) => format!("hydrostatic_strength = {strength:e}"),
    }
}

/// Failure of a specimen.
#[derive(Debug, Clone, PartialEq)]
pub struct CylinderFailure {
    /// Largest stress (in bending and torsion: at the surface, by elastic theory), Pa.
    pub strength: f64,
    /// Stress when the first bond broke, Pa.
    pub first_break: f64,
    /// Strain at the largest stress.
    pub strain: f64,
    /// Number of particles.
    pub particles: usize,
    /// Broken bonds, in the order of breaking.
    pub events: Vec<Event>,
    /// Number of fragments at the end.
    pub fragments: usize,
    /// Residual of the energy balance over the boundary work.
    pub residual: f64,
    /// Number of steps.
    pub steps: u64,
}

/// Loads a specimen until it breaks; `sphere_density` in kg/m³.
///
/// # Errors
/// The scenario cannot be written, assembled, or run.
pub fn strength(
    sample: &CylinderSpecimen,
    beam: &CohesiveBeam,
    criterion: FractureCriterion,
    sphere_density: f64,
    load: CylinderLoad,
) -> Result<CylinderFailure, CalibrationError> {
    let folder = tempfile::tempdir().map_err(CalibrationError::Folder)?;
    let mut text = Vec::new();
    export_text(&sample.unit, &mut text)?;
    std::fs::write(folder.path().join("unit.txt"), text).map_err(CalibrationError::Folder)?;
    let text = scenario_text(sample, Some("unit.txt"), beam, criterion, sphere_density, load);
    let scenario = Scenario::parse("calibration", &text)?;
    let assembly = assemble(&scenario, folder.path(), &mut |_, _| {})?;
    let particles = assembly.summary.particles;
    let mut simulation = Simulation::new(assembly.state, assembly.model, assembly.schedule)?;
    let (mut peak, mut strain, mut last) = (0.0_f64, 0.0, 0.0);
    let mut first_break = f64::NAN;
    let mut events = Vec::new();
    loop {
        look();
        let advance = simulation.advance()?;
        if events.is_empty() && !advance.events.is_empty() {
            first_break = last;
        }
        events.extend(advance.events);
        if let Some(row) = advance.sample {
            last = row.stress;
            if row.stress > peak {
                (peak, strain) = (row.stress, row.strain);
            }
        }
        if advance.stopped.is_some() {
            let state = &simulation.state;
            return Ok(CylinderFailure {
                strength: peak,
                first_break,
                strain,
                particles,
                events,
                fragments: count(&fragments(state)),
                residual: state.ledger.residual() / state.ledger.boundary_work.get(),
                steps: state.clock.step,
            });
        }
    }
}
