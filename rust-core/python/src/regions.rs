//! Regions of space and periods, for operators.

use concordem::math::{Mat3, Vec3};
use concordem::operator::strain::Dimension;
use concordem::operator::stress::Partition;
use concordem::operator::{HalfSpace, Period, Region, Truncation};
use concordem::packing::memory::affordable_bytes;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Flags, Tensor, Vector, Vectors, tensor, vector};
use crate::errors::OrRaise;

/// A region of space, or a set of particles.
#[pyclass(frozen, name = "Region", module = "concordem.operators")]
pub struct PyRegion(pub Region);

#[pymethods]
impl PyRegion {
    /// All of space; `volume` (m³) is the reference volume of averages.
    #[staticmethod]
    fn all(volume: f64) -> Self {
        Self(Region::All { volume })
    }
    /// A periodic cell; edge vectors (m) are columns.
    #[staticmethod]
    fn periodic_cell(edges: Tensor) -> Self {
        Self(Region::periodic_cell(&edges.0))
    }
    /// A box with edges parallel to the axes, from corner `low` to corner `high` (m).
    #[staticmethod]
    #[pyo3(name = "box")]
    fn of_box(low: Vector, high: Vector) -> Self {
        Self(Region::Box { low: low.0, high: high.0 })
    }
    /// A sphere with center and radius in m.
    #[staticmethod]
    fn sphere(centre: Vector, radius: f64) -> Self {
        Self(Region::Sphere { center: centre.0, radius })
    }
    /// A cylinder with flat ends; `half_length` (m) is the distance from the center to an end.
    #[staticmethod]
    fn cylinder(centre: Vector, axis: Vector, radius: f64, half_length: f64) -> Self {
        Self(Region::Cylinder { center: centre.0, axis: axis.0, radius, half_length })
    }
    /// An ellipsoid, the image of the unit sphere under `centre + axes x` (m).
    #[staticmethod]
    fn ellipsoid(centre: Vector, axes: Tensor) -> Self {
        Self(Region::Ellipsoid { center: centre.0, axes: axes.0 })
    }
    /// A parallelepiped; edge vectors (m) are columns.
    #[staticmethod]
    fn parallelepiped(corner: Vector, edges: Tensor) -> Self {
        Self(Region::Parallelepiped { corner: corner.0, edges: edges.0 })
    }
    /// An intersection of half-spaces, given by points on their planes (m) and outward normals; `volume` in m³.
    #[staticmethod]
    fn half_spaces(points: Vectors<'_>, normals: Vectors<'_>, volume: f64) -> PyResult<Self> {
        Ok(Self(Region::HalfSpaces { planes: planes(&points, &normals)?, volume }))
    }
    /// A set of particles: `member` is True for each particle of the set; `volume` (m³) is the reference volume.
    #[staticmethod]
    fn particles(member: Flags<'_>, volume: f64) -> PyResult<Self> {
        Ok(Self(Region::Particles { member: member.get()?.to_vec(), volume }))
    }
    /// The boxes of a regular grid that fills a box; x varies fastest. Raises PackingError if they need more memory than there is.
    #[staticmethod]
    fn grid(low: Vector, high: Vector, count: [usize; 3]) -> PyResult<Vec<Self>> {
        let regions = count.iter().map(|count| *count as f64).product::<f64>();
        // As regions, and as objects of Python.
        affordable_bytes(&format!("{regions:.4e} regions"), regions * 3.0 * size_of::<Region>() as f64).or_raise()?;
        Ok(Region::grid(low.0, high.0, count).into_iter().map(Self).collect())
    }
    /// Volume, m³.
    #[getter]
    fn volume(&self) -> PyResult<f64> {
        self.0.volume().or_raise()
    }
    /// Center, m; None for a region without one.
    #[getter]
    fn centre<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        self.0.center().map(|centre| vector(py, &centre).into_any())
    }
    /// Whether a point (m) is inside.
    fn contains(&self, point: Vector) -> bool {
        self.0.contains(usize::MAX, &point.0)
    }
    /// The region after a homogeneous motion `x' = origin + F (x − origin) + displacement`.
    #[pyo3(signature = (deformation, origin=None, displacement=None))]
    fn moved(&self, deformation: Tensor, origin: Option<Vector>, displacement: Option<Vector>) -> Self {
        let or_zero = |v: Option<Vector>| v.unwrap_or_default().0;
        Self(self.0.moved(&deformation.0, &or_zero(origin), &or_zero(displacement)))
    }
    fn __repr__(&self) -> String {
        format!("<Region {:?}>", self.0)
    }
}

/// Half-spaces from points and outward normals.
pub fn planes(points: &Vectors<'_>, normals: &Vectors<'_>) -> PyResult<Vec<HalfSpace>> {
    let (points, normals) = (points.get()?, normals.get()?);
    if points.len() != normals.len() {
        let message = format!("{} points and {} normals; give one normal per point", points.len(), normals.len());
        return Err(PyValueError::new_err(message));
    }
    Ok(points.iter().zip(normals).map(|(&point, &normal)| HalfSpace { point, normal }).collect())
}

/// Periodic images.
#[pyclass(frozen, name = "Period", module = "concordem.operators")]
pub struct PyPeriod(pub Period);

#[pymethods]
impl PyPeriod {
    #[new]
    #[pyo3(signature = (edges, change=None))]
    fn new(edges: Tensor, change: Option<Tensor>) -> Self {
        Self(Period { edges: edges.0, change: change.map_or_else(Mat3::zeros, |change| change.0) })
    }
    /// Edge vectors as columns, m.
    #[getter]
    fn edges<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(tensor(py, &self.0.edges)?.into_any())
    }
    /// Change (m) or rate of change (m/s) of the edge vectors.
    #[getter]
    fn change<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(tensor(py, &self.0.change)?.into_any())
    }
    fn __repr__(&self) -> String {
        format!("<{:?}>", self.0)
    }
}

/// The period behind an optional argument.
pub fn period(period: Option<&Bound<'_, PyPeriod>>) -> Option<Period> {
    period.map(|period| period.get().0)
}

/// Optional vector argument.
pub fn or_zero(vector: Option<Vector>) -> Vec3 {
    vector.unwrap_or_default().0
}

fn choice<T: Copy>(what: &str, given: &str, choices: &[(&str, T)]) -> PyResult<T> {
    choices.iter().find(|(name, _)| *name == given).map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<_> = choices.iter().map(|(name, _)| format!("\"{name}\"")).collect();
        PyValueError::new_err(format!("{what} is \"{given}\"; give one of {}", names.join(", ")))
    })
}

/// The truncation rule with this name.
pub fn truncation(name: &str) -> PyResult<Truncation> {
    choice(
        "truncation",
        name,
        &[
            ("branch-clipped", Truncation::BranchClipped),
            ("half-crossing", Truncation::HalfCrossing),
            ("internal-only", Truncation::InternalOnly),
        ],
    )
}

/// The partition of branch vectors with this name.
pub fn partition(name: &str) -> PyResult<Partition> {
    choice("partition", name, &[("contact-point", Partition::ContactPoint), ("half-branch", Partition::HalfBranch)])
}

/// Two or three dimensions.
pub fn dimension(dimension: u8) -> PyResult<Dimension> {
    match dimension {
        2 => Ok(Dimension::Two),
        3 => Ok(Dimension::Three),
        other => Err(PyValueError::new_err(format!("dimension is {other}; give 2 or 3"))),
    }
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PyRegion>()?;
    module.add_class::<PyPeriod>()
}
