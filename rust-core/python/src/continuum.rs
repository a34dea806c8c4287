//! Continuum laws, and the hand-over of a packing to them.

use concordem::math::Mat3;
use concordem::operator::interruption::Watch;
use concordem::packing::memory::affordable_bytes;
use concordem_continuum::{ContinuumError, DamagePlastic as Law, HandOver, LinkDamage, Parameters, State, Update};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::arrays::{Rows, Scalars, Tensors, Vectors, result, scalars, tensor, tensors};
use crate::errors::OrRaise;
use crate::work::answering;

type Any<'py> = PyResult<Bound<'py, PyAny>>;

/// The damage-plastic model of Grassl and Jirásek (2006) at material points: σ = (1−ω) D_e : (ε − ε_p).
///
/// `young`, strengths in Pa, both positive; `fracture_energy` in J/m². States are arrays (n, 8): plastic strain 11, 22, 33, 23, 31,
/// 12 (tensor components), κ_P, κ_D; zeros are points without history. Raises ContinuumError for parameters out of range.
#[pyclass(frozen, module = "concordem.coupling")]
pub struct DamagePlastic(Law);

/// One size of element for all points, or one for each.
enum Sizes<'py> {
    One(f64),
    Each(Scalars<'py>),
}

impl<'a, 'py> FromPyObject<'a, 'py> for Sizes<'py> {
    type Error = PyErr;
    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        object.extract::<f64>().map(Self::One).or_else(|_| object.extract().map(Self::Each))
    }
}

impl Sizes<'_> {
    fn of(&self, points: usize) -> PyResult<Vec<f64>> {
        match self {
            Self::One(size) => Ok(vec![*size; points]),
            Self::Each(sizes) => same("size", sizes.get()?.len(), points).and_then(|()| Ok(sizes.get()?.to_vec())),
        }
    }
}

fn same(what: &str, found: usize, points: usize) -> PyResult<()> {
    if found == points {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("{what} has {found} rows for {points} points; give one row per point")))
}

fn formulas(name: &str) -> PyResult<HandOver> {
    match name {
        "printed" => Ok(HandOver::Printed),
        "coded" => Ok(HandOver::Coded),
        other => Err(PyValueError::new_err(format!("formulas is \"{other}\"; give \"printed\" or \"coded\""))),
    }
}

/// The results of all points, or the error of the first one that failed, with its index.
fn all<T>(found: Vec<Result<T, ContinuumError>>) -> PyResult<Vec<T>> {
    let mut values = Vec::with_capacity(found.len());
    for (point, value) in found.into_iter().enumerate() {
        values.push(value.map_err(|error| (point, error)).or_raise()?);
    }
    Ok(values)
}

fn states<'py>(py: Python<'py>, states: &[State]) -> Any<'py> {
    let reals: Vec<f64> = states.iter().flat_map(State::to_reals).collect();
    Ok(PyArray1::from_vec(py, reals).reshape([states.len(), State::REALS])?.into_any())
}

#[pymethods]
impl DamagePlastic {
    #[new]
    #[pyo3(signature = (
        young, poisson, compressive_strength, tensile_strength, fracture_energy, *, eccentricity=0.525, initial_hardening=0.1,
        confined_ductility=0.08, compressive_ductility=0.003, ductility_pressure=2.0, tensile_ductility=1e-6, dilation=-0.85,
        softening_ductility=15.0
    ))]
    fn new(
        young: f64,
        poisson: f64,
        compressive_strength: f64,
        tensile_strength: f64,
        fracture_energy: f64,
        eccentricity: f64,
        initial_hardening: f64,
        confined_ductility: f64,
        compressive_ductility: f64,
        ductility_pressure: f64,
        tensile_ductility: f64,
        dilation: f64,
        softening_ductility: f64,
    ) -> PyResult<Self> {
        let parameters = Parameters {
            young,
            poisson,
            compressive_strength,
            tensile_strength,
            fracture_energy,
            eccentricity,
            initial_hardening,
            confined_ductility,
            compressive_ductility,
            ductility_pressure,
            tensile_ductility,
            dilation,
            softening_ductility,
        };
        Ok(Self(Law::new(parameters).or_raise()?))
    }

    /// Stress, state, damage, and consistent tangent for total strains at the end of a step.
    ///
    /// Args: `strain` (n, 3, 3); `state` (n, 8) before the step; `size` of the elements, m, one or (n,); `tangent`: also compute the
    /// tangents. Returns PointUpdate. Raises ContinuumError with the index of the point.
    #[pyo3(signature = (strain, state, size, tangent=true))]
    fn update<'py>(
        &self,
        py: Python<'py>,
        strain: Tensors<'py>,
        state: Rows<'py>,
        size: Sizes<'py>,
        tangent: bool,
    ) -> Any<'py> {
        let strain = strain.get()?;
        let state = read_states(&state, strain.len())?;
        let size = size.of(strain.len())?;
        let law = &self.0;
        // The updates, and the arrays made of them.
        let bytes = 2.0 * (strain.len() * size_of::<Update>()) as f64;
        affordable_bytes(&format!("the update of {} points", strain.len()), bytes).or_raise()?;
        let found: Vec<_> = answering(py, strain.len(), || {
            let watch = Watch::here();
            let update = |k: usize| {
                watch.look();
                law.update(&strain[k], &state[k], size[k])
            };
            (0..strain.len()).into_par_iter().map(update).collect()
        })?;
        let found: Vec<Update> = all(found)?;
        let next: Vec<State> = found.iter().map(|update| update.state).collect();
        let damage: Vec<f64> = found.iter().map(|update| update.damage).collect();
        let matrices = if tangent {
            let mut reals = Vec::with_capacity(36 * found.len());
            for update in &found {
                reals.extend_from_slice(update.tangent.transpose().as_slice());
            }
            Some(PyArray1::from_vec(py, reals).reshape([found.len(), 6, 6])?)
        } else {
            None
        };
        let stress = tensors(py, found.iter().map(|update| update.stress).collect())?;
        result(py, "PointUpdate", (stress, states(py, &next)?, scalars(py, &damage), matrices))
    }

    /// States of points without strain that start with the stress and damage of a packing (Stránský 2018, (6.14)–(6.19)).
    ///
    /// Args: `stress` (n, 3, 3), Pa; `damage` (n,), see handover_damage; `size` of the elements, m, one or (n,). Returns (n, 8). Raises
    /// ContinuumError with the index of the point.
    fn hand_over<'py>(
        &self,
        py: Python<'py>,
        stress: Tensors<'py>,
        damage: Scalars<'py>,
        size: Sizes<'py>,
    ) -> Any<'py> {
        let (stress, damage) = (stress.get()?, damage.get()?);
        same("damage", damage.len(), stress.len())?;
        let size = size.of(stress.len())?;
        let found = (0..stress.len()).map(|k| HandOver::state(&self.0, &stress[k], damage[k], size[k])).collect();
        states(py, &all(found)?)
    }

    /// Damage ω of a damage variable κ_D in an element of this size, m.
    fn damage(&self, variable: f64, size: f64) -> PyResult<f64> {
        self.0.damage(variable, size).or_raise()
    }

    /// Damage variable κ_D of a damage ω below 1 in an element of this size, m.
    fn damage_variable(&self, damage: f64, size: f64) -> PyResult<f64> {
        self.0.damage_variable(damage, size).or_raise()
    }

    /// The parameters by name.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let p = self.0.parameters();
        let dict = PyDict::new(py);
        for (name, value) in [
            ("young", p.young),
            ("poisson", p.poisson),
            ("compressive_strength", p.compressive_strength),
            ("tensile_strength", p.tensile_strength),
            ("fracture_energy", p.fracture_energy),
            ("eccentricity", p.eccentricity),
            ("initial_hardening", p.initial_hardening),
            ("confined_ductility", p.confined_ductility),
            ("compressive_ductility", p.compressive_ductility),
            ("ductility_pressure", p.ductility_pressure),
            ("tensile_ductility", p.tensile_ductility),
            ("dilation", p.dilation),
            ("softening_ductility", p.softening_ductility),
        ] {
            dict.set_item(name, value)?;
        }
        Ok(dict)
    }

    /// Size of the largest element that does not snap back, E G_f/f_t², m.
    #[getter]
    fn largest_size(&self) -> f64 {
        self.0.largest_size()
    }
}

fn read_states(states: &Rows<'_>, points: usize) -> PyResult<Vec<State>> {
    let (count, columns) = states.shape();
    same("state", count, points)?;
    if columns != State::REALS {
        return Err(PyValueError::new_err(format!(
            "state has {columns} columns; give shape ({points}, {})",
            State::REALS
        )));
    }
    let (rows, _) = states.get()?.as_chunks::<{ State::REALS }>();
    Ok(rows.iter().map(State::from_reals).collect())
}

/// Damage tensor of bonds with these directions and lost strengths, for handover_damage with the same formulas.
///
/// `formulas`: "printed", Ω = −(3/2N)(Σω̂) 1 + (15/2N) Σ ω̂ n⊗n (Stránský 2018, (6.13)), or "coded", with 12 for 15. Args: `normal`
/// (n, 3); `damage` (n,). Returns (3, 3). Raises ContinuumError without bonds.
#[pyfunction]
#[pyo3(signature = (normal, damage, formulas="printed"))]
fn handover_tensor<'py>(py: Python<'py>, normal: Vectors<'py>, damage: Scalars<'py>, formulas: &str) -> Any<'py> {
    let formulas = self::formulas(formulas)?;
    let links = LinkDamage::of(normal.get()?, damage.get()?).or_raise()?;
    Ok(tensor(py, &formulas.tensor(&links))?.into_any())
}

/// Damage ω of damage tensors: "printed", ω = 2.09 (0.85 Ω₁ + 0.15 Ω₃)^4.7 (Stránský 2018, (6.17)), or "coded",
/// ω = (2.09 (0.85 Ω₁ + 0.15 Ω₃))^4.7, at most 1.
///
/// Args: `tensor` (n, 3, 3) of handover_tensor with the same formulas. Returns (n,).
#[pyfunction]
#[pyo3(signature = (tensor, formulas="printed"))]
fn handover_damage<'py>(py: Python<'py>, tensor: Tensors<'py>, formulas: &str) -> Any<'py> {
    let formulas = self::formulas(formulas)?;
    let tensors: Vec<Mat3> = tensor.get()?;
    if !tensors.iter().all(|tensor| tensor.iter().all(|value| value.is_finite())) {
        return Err(PyValueError::new_err("a damage tensor is not finite"));
    }
    let damage: Vec<f64> = tensors.iter().map(|tensor| formulas.damage(tensor)).collect();
    Ok(scalars(py, &damage).into_any())
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<DamagePlastic>()?;
    module.add_function(wrap_pyfunction!(handover_tensor, module)?)?;
    module.add_function(wrap_pyfunction!(handover_damage, module)?)
}
