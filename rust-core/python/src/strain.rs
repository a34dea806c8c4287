//! Strain and tessellations on NumPy arrays.

use concordem::operator::strain::{
    AffineFit, ElasticConstants, ElasticState, affine_fit, bagi_strain, boundary_strain, cell_gradient, cell_strain,
    cosserat, platen_strain, satake_strain,
};
use concordem::operator::tessellation::{Domain, Mesh, PowerDiagram, delaunay, power_diagram};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Scalars, Tensor, Vector, Vectors, result, scalars, tensor, tensors, vector, vectors};
use crate::errors::OrRaise;
use crate::regions::{PyPeriod, PyRegion, dimension, period};
use crate::work::answering;

type Any<'py> = PyResult<Bound<'py, PyAny>>;

/// Best affine fit of the motion of particles; values are rates if velocities were fitted.
#[pyclass(frozen, name = "AffineFit", module = "concordem.operators")]
pub struct PyAffineFit(pub AffineFit);

#[pymethods]
impl PyAffineFit {
    /// Mean position of the particles, m, (3,).
    #[getter]
    fn centre<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        vector(py, &self.0.center).into_any()
    }
    /// Displacement (m) or velocity (m/s) at the center, (3,).
    #[getter]
    fn translation<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        vector(py, &self.0.translation).into_any()
    }
    /// Displacement gradient `G_ij = ∂u_i/∂x_j`, (3, 3).
    #[getter]
    fn gradient<'py>(&self, py: Python<'py>) -> Any<'py> {
        Ok(tensor(py, &self.0.gradient)?.into_any())
    }
    /// Rotation (rad) or angular velocity (rad/s) at the center, (3,).
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        vector(py, &self.0.rotation).into_any()
    }
    /// Curvature `κ_ij = ∂_i φ_j`, 1/m, (3, 3).
    #[getter]
    fn curvature<'py>(&self, py: Python<'py>) -> Any<'py> {
        Ok(tensor(py, &self.0.curvature)?.into_any())
    }
    /// Strain `½(G + Gᵀ)`, (3, 3).
    #[getter]
    fn strain<'py>(&self, py: Python<'py>) -> Any<'py> {
        Ok(tensor(py, &self.0.strain())?.into_any())
    }
    /// Cosserat strain `γ_ij = ∂_i u_j − e_ijk φ_k`, (3, 3).
    #[getter]
    fn cosserat_strain<'py>(&self, py: Python<'py>) -> Any<'py> {
        Ok(tensor(py, &self.0.cosserat_strain())?.into_any())
    }
    /// Macro-rotation `½ curl u`, (3,).
    #[getter]
    fn macro_rotation<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        vector(py, &self.0.macro_rotation()).into_any()
    }
    /// Micro-rotation: rotation of the particles minus the macro-rotation, (3,).
    #[getter]
    fn micro_rotation<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        vector(py, &self.0.micro_rotation()).into_any()
    }
    /// Sums of squares: of the non-affine displacement, and of the whole displacement, m².
    #[getter]
    fn residual(&self) -> (f64, f64) {
        self.0.residual.into()
    }
    /// Sums of squares: of the non-affine rotation, and of the whole rotation.
    #[getter]
    fn rotation_residual(&self) -> (f64, f64) {
        self.0.rotation_residual.into()
    }
    /// Number of particles in the fit.
    #[getter]
    fn particles(&self) -> usize {
        self.0.particles
    }
    /// Smallest over largest principal second moment of the positions: how well they span space.
    #[getter]
    fn spread(&self) -> f64 {
        self.0.spread
    }
    /// Displacement of the fit at points (k, 3), m, (k, 3).
    fn displacement<'py>(&self, py: Python<'py>, points: Vectors<'py>) -> Any<'py> {
        let found: Vec<_> = points.get()?.iter().map(|x| self.0.displacement(x)).collect();
        Ok(vectors(py, &found)?.into_any())
    }
    /// Rotation of the fit at points (k, 3), (k, 3).
    fn rotation_at<'py>(&self, py: Python<'py>, points: Vectors<'py>) -> Any<'py> {
        let found: Vec<_> = points.get()?.iter().map(|x| self.0.rotation_at(x)).collect();
        Ok(vectors(py, &found)?.into_any())
    }
    fn __repr__(&self) -> String {
        format!("<{:?}>", self.0)
    }
}

/// Best affine fit of the motion of particles.
#[pyfunction]
#[pyo3(name = "affine_fit", signature = (position, displacement, region, rotation=None, period=None, dimension=3))]
fn fit<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    displacement: Vectors<'py>,
    region: &Bound<'py, PyRegion>,
    rotation: Option<Vectors<'py>>,
    period: Option<Bound<'py, PyPeriod>>,
    dimension: u8,
) -> PyResult<PyAffineFit> {
    let (x, u) = (position.get()?, displacement.get()?);
    let phi = rotation.as_ref().map_or(Ok(&[][..]), Vectors::get)?;
    let (period, dimension, region) = (self::period(period.as_ref()), self::dimension(dimension)?, &region.get().0);
    answering(py, x.len(), || affine_fit(x, u, phi, region, period.as_ref(), dimension))?.or_raise().map(PyAffineFit)
}

/// A triangulation.
#[pyclass(frozen, name = "Mesh", module = "concordem.operators")]
pub struct PyMesh(Mesh);

#[pymethods]
impl PyMesh {
    /// Corners of the cells: indices of points, (cells, 3 or 4).
    #[getter]
    fn cells<'py>(&self, py: Python<'py>) -> Any<'py> {
        let corners: Vec<u32> = (0..self.0.len()).flat_map(|k| self.0.cell(k).iter().map(|c| c.point)).collect();
        let each = corners.len() / self.0.len().max(1);
        scalars(py, &corners).into_any().call_method1("reshape", (self.0.len(), each))
    }
    /// Periodic images of the corners, in numbers of cell edges.
    #[getter]
    fn images<'py>(&self, py: Python<'py>) -> Any<'py> {
        let images: Vec<i32> = (0..self.0.len()).flat_map(|k| self.0.cell(k).iter().flat_map(|c| c.image)).collect();
        let each = images.len() / 3 / self.0.len().max(1);
        scalars(py, &images).into_any().call_method1("reshape", (self.0.len(), each, 3))
    }
    fn __len__(&self) -> usize {
        self.0.len()
    }
}

/// Delaunay triangulation of points.
#[pyfunction]
#[pyo3(name = "delaunay", signature = (position, dimension=3, edges=None))]
fn triangulate(py: Python<'_>, position: Vectors<'_>, dimension: u8, edges: Option<Tensor>) -> PyResult<PyMesh> {
    let (x, dimension) = (position.get()?, self::dimension(dimension)?);
    let edges = edges.map(|edges| edges.0);
    answering(py, x.len(), || delaunay(x, dimension, edges.as_ref()))?.or_raise().map(PyMesh)
}

/// Displacement gradient of a triangulated body from the linear field in each cell. Returns MeshStrain.
///
/// Args: `mesh` of `delaunay`; `position`, `displacement` (n, 3), m.
#[pyfunction]
#[pyo3(name = "cell_strain", signature = (mesh, position, displacement, period=None))]
fn strain_of_cells<'py>(
    py: Python<'py>,
    mesh: &Bound<'py, PyMesh>,
    position: Vectors<'py>,
    displacement: Vectors<'py>,
    period: Option<Bound<'py, PyPeriod>>,
) -> Any<'py> {
    let (x, u, period, mesh) = (position.get()?, displacement.get()?, self::period(period.as_ref()), &mesh.get().0);
    let found = answering(py, mesh.len(), || cell_strain(mesh, x, u, period.as_ref()))?.or_raise()?;
    let volumes: Vec<f64> = found.cells.iter().map(|cell| cell.volume).collect();
    let moments = found.cells.iter().map(|cell| cell.moment).collect();
    let fields = (tensor(py, &found.gradient)?, found.volume, scalars(py, &volumes), tensors(py, moments)?);
    result(py, "MeshStrain", fields)
}

/// Displacement gradient from the edges of a triangulation and their dual area vectors (Bagi). Returns DualStrain.
///
/// Args: `mesh` of `delaunay`; `position`, `displacement` (n, 3), m.
#[pyfunction]
#[pyo3(name = "bagi_strain", signature = (mesh, position, displacement, period=None))]
fn strain_of_edges<'py>(
    py: Python<'py>,
    mesh: &Bound<'py, PyMesh>,
    position: Vectors<'py>,
    displacement: Vectors<'py>,
    period: Option<Bound<'py, PyPeriod>>,
) -> Any<'py> {
    let (x, u, period, mesh) = (position.get()?, displacement.get()?, self::period(period.as_ref()), &mesh.get().0);
    let found = answering(py, mesh.len(), || bagi_strain(mesh, x, u, period.as_ref()))?.or_raise()?;
    result(py, "DualStrain", (tensor(py, &found.gradient)?, found.volume, tensor(py, &found.unity)?))
}

/// Displacement gradient from the motion of the hull of a triangulated body, (3, 3).
#[pyfunction]
#[pyo3(name = "boundary_strain")]
fn strain_of_hull<'py>(
    py: Python<'py>,
    mesh: &Bound<'py, PyMesh>,
    position: Vectors<'py>,
    displacement: Vectors<'py>,
) -> Any<'py> {
    let found = boundary_strain(&mesh.get().0, position.get()?, displacement.get()?).or_raise()?;
    Ok(tensor(py, &found)?.into_any())
}

/// Displacement gradient of a periodic cell from the change of its edges, (3, 3).
#[pyfunction]
#[pyo3(name = "cell_gradient")]
fn gradient_of_cell<'py>(py: Python<'py>, period: &Bound<'py, PyPeriod>) -> Any<'py> {
    Ok(tensor(py, &cell_gradient(&period.get().0).or_raise()?)?.into_any())
}

/// A partition of space into one cell per particle.
#[pyclass(frozen, name = "PowerDiagram", module = "concordem.operators")]
pub struct PyPowerDiagram(PowerDiagram);

#[pymethods]
impl PyPowerDiagram {
    /// Volume of each particle's cell, m³, (n,).
    #[getter]
    fn volumes<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        scalars(py, &self.0.volumes).into_any()
    }
    /// Area vectors of the faces, m², (faces, 3).
    #[getter]
    fn face_areas<'py>(&self, py: Python<'py>) -> Any<'py> {
        let areas: Vec<_> = self.0.faces.iter().map(|face| face.area).collect();
        Ok(vectors(py, &areas)?.into_any())
    }
    /// Vectors from the particle centers to the centroids of the border faces, m.
    #[getter]
    fn border_centroids<'py>(&self, py: Python<'py>) -> Any<'py> {
        let centroids: Vec<_> = self.0.border().map(|face| face.centroid).collect();
        Ok(vectors(py, &centroids)?.into_any())
    }
    /// Particles of the border faces.
    #[getter]
    fn border_particles<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        let particles: Vec<u32> = self.0.border().map(|face| face.point).collect();
        scalars(py, &particles).into_any()
    }
    /// Strain by the contact cells of Satake, with rotations of the particles. Returns DualStrain.
    #[pyo3(signature = (displacement, rotation=None, border_displacement=None, period=None))]
    fn satake_strain<'py>(
        &self,
        py: Python<'py>,
        displacement: Vectors<'py>,
        rotation: Option<Vectors<'py>>,
        border_displacement: Option<Vectors<'py>>,
        period: Option<Bound<'py, PyPeriod>>,
    ) -> Any<'py> {
        let u = displacement.get()?;
        let phi = rotation.as_ref().map_or(Ok(&[][..]), Vectors::get)?;
        let border = border_displacement.as_ref().map_or(Ok(&[][..]), Vectors::get)?;
        let period = self::period(period.as_ref());
        let found = answering(py, u.len(), || satake_strain(&self.0, u, phi, border, period.as_ref()))?.or_raise()?;
        result(py, "DualStrain", (tensor(py, &found.gradient)?, found.volume, tensor(py, &found.unity)?))
    }
}

/// Power diagram of particles in a box (`low`, `high`) or a periodic cell (`edges` as columns), m. Returns PowerDiagram.
#[pyfunction]
#[pyo3(name = "power_diagram", signature = (position, radius, low=None, high=None, edges=None, dimension=3))]
fn divide(
    py: Python<'_>,
    position: Vectors<'_>,
    radius: Scalars<'_>,
    low: Option<Vector>,
    high: Option<Vector>,
    edges: Option<Tensor>,
    dimension: u8,
) -> PyResult<PyPowerDiagram> {
    let domain = match (low, high, edges) {
        (Some(low), Some(high), None) => Domain::Box { low: low.0, high: high.0 },
        (None, None, Some(edges)) => Domain::Periodic(edges.0),
        _ => {
            return Err(PyValueError::new_err(
                "low, high, and edges conflict; give low and high of a box, or the edges of a periodic cell",
            ));
        }
    };
    let (x, r, dimension) = (position.get()?, radius.get()?, self::dimension(dimension)?);
    answering(py, x.len(), || power_diagram(x, r, &domain, dimension))?.or_raise().map(PyPowerDiagram)
}

/// Cosserat strain `γ_ij = G_ji − e_ijk φ_k` from a displacement gradient G (3, 3) and a rotation φ (3,).
#[pyfunction]
fn cosserat_strain<'py>(py: Python<'py>, gradient: Tensor, rotation: Vector) -> Any<'py> {
    Ok(tensor(py, &cosserat::strain(&gradient.0, &rotation.0))?.into_any())
}

/// Macro-rotation `½ curl u` of a displacement gradient (3, 3). Returns (3,).
#[pyfunction]
fn macro_rotation<'py>(py: Python<'py>, gradient: Tensor) -> Any<'py> {
    Ok(vector(py, &cosserat::macro_rotation(&gradient.0)).into_any())
}

/// Elastic strain (3, 3) of a particle under a stress (3, 3), Pa; `young` in Pa.
#[pyfunction]
#[pyo3(signature = (stress, young, poisson, state="solid"))]
fn particle_strain<'py>(py: Python<'py>, stress: Tensor, young: f64, poisson: f64, state: &str) -> Any<'py> {
    let state = match state {
        "solid" => ElasticState::Solid,
        "plane-strain" => ElasticState::PlaneStrain,
        "plane-stress" => ElasticState::PlaneStress,
        other => {
            let message = format!("state is \"{other}\"; give \"solid\", \"plane-strain\", or \"plane-stress\"");
            return Err(PyValueError::new_err(message));
        }
    };
    let constants = ElasticConstants::new(young, poisson, state).or_raise()?;
    Ok(tensor(py, &constants.strain(&stress.0))?.into_any())
}

/// Strain `(upper − lower)/length` from the displacements of two platens and their distance, m.
#[pyfunction]
#[pyo3(name = "platen_strain")]
fn strain_between_platens(lower: f64, upper: f64, length: f64) -> PyResult<f64> {
    platen_strain(lower, upper, length).or_raise()
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PyAffineFit>()?;
    module.add_class::<PyMesh>()?;
    module.add_class::<PyPowerDiagram>()?;
    macro_rules! add {
        ($($function:ident),* $(,)?) => { $(module.add_function(wrap_pyfunction!($function, module)?)?;)* };
    }
    add!(
        fit,
        triangulate,
        strain_of_cells,
        strain_of_edges,
        strain_of_hull,
        gradient_of_cell,
        divide,
        cosserat_strain,
        macro_rotation,
        particle_strain,
        strain_between_platens,
    );
    Ok(())
}
