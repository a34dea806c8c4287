//! Elastic constants and calibration.

use concordem::assembly::{Assembly, assemble};
use concordem::calibration::cohesive_beam::{
    CylinderLoad, CylinderRecipe, CylinderSpecimen, FractureCriterion, match_elastic, scenario_text, strength,
};
use concordem::law::{BendingTerm, Section};
use concordem::program::{self, ElasticRequest, ElasticSearch, Spelling};
use concordem::statics::relaxed::{Relaxation, relaxed_stiffness};
use concordem::statics::{Accuracy, ElasticConstants, LinkNetwork, StaticsError, cell_stiffness, closed_form};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{matrix6, result, scalars};
use crate::errors::{OrRaise, of_assembly};
use crate::scenario::Scenario;
use crate::warnings::warn;
use crate::work::guarded;

type Any<'py> = PyResult<Bound<'py, PyAny>>;

fn constants_of<'py>(py: Python<'py>, c: &ElasticConstants) -> Any<'py> {
    let fields = (
        c.mean_young,
        c.mean_poisson,
        c.bulk,
        c.mean_shear,
        scalars(py, &c.young),
        scalars(py, &c.shear),
        matrix6(py, &c.stiffness)?,
        matrix6(py, &c.compliance)?,
        c.anisotropy().young,
    );
    result(py, "ElasticConstants", fields)
}

/// Elastic constants of a scenario's periodic packing and bonds by up to four methods: closed form, affine sum, static equilibrium, and
/// (with `dynamics`) dynamic relaxation.
///
/// `residual`: relative residual of the static equilibrium, between 0 and 1e-3. Returns ElasticAnswers. Raises StaticsError or
/// AssemblyError if the packing cannot be solved or built.
#[pyfunction]
#[pyo3(signature = (scenario, dynamics=false, residual=None, threads=None, progress=None))]
fn elastic_constants<'py>(
    py: Python<'py>,
    scenario: &Bound<'py, Scenario>,
    dynamics: bool,
    residual: Option<f64>,
    threads: Option<usize>,
    progress: Option<Bound<'py, PyAny>>,
) -> Any<'py> {
    let accuracy = Accuracy { residual: residual.unwrap_or(Accuracy::default().residual), ..Accuracy::default() };
    if !(accuracy.residual > 0.0 && accuracy.residual < 1e-3) {
        let message = format!("residual is {:e}; give a number between 0 and 1e-3, such as 1e-11", accuracy.residual);
        return Err(PyValueError::new_err(message));
    }
    let Scenario { inner, folder } = scenario.get();
    let found = guarded(py, threads, progress.as_ref(), |progress| {
        let Assembly { state, model, summary, .. } = assemble(inner, folder, progress)?;
        let answers = || {
            let network = LinkNetwork::of_model(&state, &model)?;
            let cell = cell_stiffness(&network, accuracy)?;
            let closed = closed_form(&network).map(|closed| (closed.young, closed.poisson));
            let relaxed = if dynamics {
                let (stiffness, _) = relaxed_stiffness(&state, &model, Relaxation::default())?;
                Some(cell.constants_of(&stiffness)?)
            } else {
                None
            };
            let (affine, statics) = (cell.affine_constants()?, cell.constants()?);
            Ok((closed, affine, statics, relaxed, cell))
        };
        Ok((summary.warnings, answers()))
    })?;
    let (warnings, found): (_, Result<_, StaticsError>) = found.map_err(|error| of_assembly(inner, error))?;
    warn(py, inner, &warnings)?;
    let (closed, affine, statics, relaxed, cell) = found.or_raise()?;
    let relaxed = relaxed.map(|constants| constants_of(py, &constants)).transpose()?;
    let (affine, statics) = (constants_of(py, &affine)?, constants_of(py, &statics)?);
    let fields = (closed, affine, statics, relaxed, cell.links, cell.loose.rattlers, cell.loose.mechanisms);
    result(py, "ElasticAnswers", fields)
}

/// Parameters of bonds with which a scenario's packing has the elastic constants `young` (Pa) and `poisson`.
///
/// `deformable`: also find the elasticity of deformable particles. Returns ElasticFit. Raises CalibrationError if the packing cannot
/// have these constants.
#[pyfunction]
#[pyo3(signature = (
    scenario, young, poisson, law=None, deformable=false, particle_poisson=None, particle_softness=None, threads=None,
    progress=None
))]
fn calibrate_elastic<'py>(
    py: Python<'py>,
    scenario: Option<&Bound<'py, Scenario>>,
    young: f64,
    poisson: f64,
    law: Option<&str>,
    deformable: bool,
    particle_poisson: Option<f64>,
    particle_softness: Option<f64>,
    threads: Option<usize>,
    progress: Option<Bound<'py, PyAny>>,
) -> Any<'py> {
    let law = law.map(program::calibrated_law).transpose().map_err(PyValueError::new_err)?;
    let spelling = Spelling::Keywords;
    let request = ElasticRequest { young, poisson, law, deformable, particle_poisson, particle_softness, spelling };
    let scenario = scenario.map(Bound::get);
    let folder = scenario.map(|scenario| scenario.folder.clone()).unwrap_or_default();
    let found = guarded(py, threads, progress.as_ref(), |progress| {
        program::calibrate_elastic(scenario.map(|scenario| &scenario.inner), &folder, &request, progress)
    })?;
    let ElasticSearch { scenario, fit, parameters, spectral_radius } = found.or_raise()?;
    let achieved = constants_of(py, &fit.achieved)?;
    let normal = parameters.first().map_or(f64::NAN, |&(_, _, value)| value);
    let found = PyDict::new(py);
    for (table, key, value) in parameters {
        found.set_item(format!("{table}.{key}"), value)?;
    }
    let fields = (
        normal,
        fit.shear_ratio,
        achieved,
        fit.reach,
        fit.cell.loose.rattlers,
        found,
        spectral_radius,
        Scenario { inner: scenario, folder },
    );
    result(py, "ElasticFit", fields)
}

/// Parameters of cohesive beams with which a random packing has the properties of a material.
///
/// `young`, `tensile_strength` (Pa); `density` (kg/m³) of the material; `coordination`: bonds per particle; `dispersion`: (largest −
/// smallest)/mean radius; `count`: number of particles. Returns BeamFit. Raises CalibrationError if no parameters fit.
#[pyfunction]
#[pyo3(signature = (
    young, poisson, density, tensile_strength=None, beam_poisson=0.3, coordination=6.2, dispersion=0.25, count=5000,
    seed=1, threads=None, progress=None
))]
fn calibrate_cohesive_beam<'py>(
    py: Python<'py>,
    young: f64,
    poisson: f64,
    density: f64,
    tensile_strength: Option<f64>,
    beam_poisson: f64,
    coordination: f64,
    dispersion: f64,
    count: usize,
    seed: u64,
    threads: Option<usize>,
    progress: Option<Bound<'py, PyAny>>,
) -> Any<'py> {
    for (name, value) in [("young", young), ("density", density), ("tensile_strength", tensile_strength.unwrap_or(1.0))]
    {
        if !(value > 0.0 && value.is_finite()) {
            return Err(PyValueError::new_err(format!("{name} is {value}; it must be positive and finite")));
        }
    }
    let recipe = CylinderRecipe { coordination, dispersion, ..CylinderRecipe::book(count, seed) };
    let found = guarded(py, threads, progress.as_ref(), |progress| {
        let sample =
            CylinderSpecimen::new(&recipe, &mut |now| progress("compaction", (now.packing_fraction / 0.65).min(0.99)))?;
        let mut tried = 0;
        let found = match_elastic(&sample, young, poisson, beam_poisson, &mut |_, _| {
            tried += 1;
            progress("elastic constants", (f64::from(tried) / 8.0).min(0.99));
        })?;
        let spheres = sample.sphere_density(density);
        let mut achieved = None;
        let mut beams = None;
        if let Some(wanted) = tensile_strength {
            // The strength is proportional to that of the beams: one trial gives the factor, a second one checks it.
            let criterion = |value| FractureCriterion::Beam(value, BendingTerm::MidSection);
            let trial = 6.0 * wanted;
            progress("strength", 0.3);
            let first = strength(&sample, &found.beam, criterion(trial), spheres, CylinderLoad::Tension)?;
            let right = trial * wanted / first.strength;
            progress("strength", 0.7);
            achieved = Some(strength(&sample, &found.beam, criterion(right), spheres, CylinderLoad::Tension)?.strength);
            beams = Some(right);
        }
        let criterion = FractureCriterion::Beam(beams.unwrap_or(f64::MAX), BendingTerm::MidSection);
        let mut text = scenario_text(&sample, None, &found.beam, criterion, spheres, CylinderLoad::Tension);
        if beams.is_none() {
            text = text
                .lines()
                .filter(|line| !line.starts_with("tensile_strength"))
                .fold(String::new(), |all, line| all + line + "\n");
        }
        Ok((found, spheres, beams, achieved, text))
    })?;
    let found: Result<_, concordem::calibration::cohesive_beam::CalibrationError> = found;
    let (found, spheres, beams, achieved, text) = found.or_raise()?;
    let ratio = match found.beam.section {
        Section::Ratio(ratio) | Section::RatioOfPair { ratio, .. } => ratio,
        Section::Radius(radius) => radius / recipe.mean_radius,
    };
    let fields =
        (found.beam.young, ratio, spheres, beams, found.achieved.modulus, found.achieved.poisson, achieved, text);
    result(py, "BeamFit", fields)
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(elastic_constants, module)?)?;
    module.add_function(wrap_pyfunction!(calibrate_elastic, module)?)?;
    module.add_function(wrap_pyfunction!(calibrate_cohesive_beam, module)?)
}
