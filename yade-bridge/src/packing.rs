//! Packings.

use std::io::BufReader;
use std::path::PathBuf;

use concordem::math::Vec3;
use concordem::packing::random_dense::{RandomDense, Stage, random_dense};
use concordem::packing::size::SizeDistribution;
use concordem::packing::summary::PackingSummary;
use concordem::packing::{Packing, file, lattice::Lattice};
use concordem::state::{Cell, Sphere};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Scalars, Tensor, Vectors, result, scalars, tensor, vectors};
use crate::errors::OrRaise;
use crate::simulation::guarded;

type Any<'py> = PyResult<Bound<'py, PyAny>>;

/// A packing for Python.
pub fn packing_of<'py>(py: Python<'py>, packing: &Packing) -> Any<'py> {
    let radii: Vec<f64> = packing.spheres.iter().map(|sphere| sphere.radius).collect();
    let cell = packing.cell.map(|cell| tensor(py, &cell.matrix)).transpose()?;
    result(py, "Packing", (vectors(py, &packing.positions())?, scalars(py, &radii), cell))
}

fn of_arrays(positions: &Vectors<'_>, radii: &Scalars<'_>, cell: Option<Tensor>) -> PyResult<Packing> {
    let (positions, radii) = (positions.get()?, radii.get()?);
    if positions.len() != radii.len() {
        return Err(PyValueError::new_err(format!("{} positions and {} radii", positions.len(), radii.len())));
    }
    let spheres = positions.iter().zip(radii).map(|(&position, &radius)| Sphere { position, radius }).collect();
    Ok(Packing { spheres, cell: cell.map(|cell| Cell::new(cell.0)) })
}

/// A random dense periodic packing by compaction.
#[pyfunction]
#[pyo3(name = "random_dense", signature = (
    count, radius, dispersion=0.0, friction=0.0, seed=1, protocol="jammed", threads=None, progress=None
))]
fn dense<'py>(
    py: Python<'py>,
    count: usize,
    radius: f64,
    dispersion: f64,
    friction: f64,
    seed: u64,
    protocol: &str,
    threads: Option<usize>,
    progress: Option<Bound<'py, PyAny>>,
) -> Any<'py> {
    let mut recipe = match protocol {
        "jammed" => RandomDense::jammed(count, radius, friction, seed),
        "yade" => RandomDense::thesis(count, radius, friction, seed),
        other => {
            let message = format!("protocol is \"{other}\"; it may be \"jammed\" or \"yade\"");
            return Err(PyValueError::new_err(message));
        }
    };
    if !(0.0..2.0).contains(&dispersion) {
        let message = format!("dispersion is {dispersion}; (largest − smallest)/mean radius lies from 0 to below 2");
        return Err(PyValueError::new_err(message));
    }
    if dispersion > 0.0 {
        let half = 0.5 * dispersion * radius;
        recipe.sizes = SizeDistribution::Uniform { low: radius - half, high: radius + half };
    }
    let made = guarded(py, threads, progress.as_ref(), |progress| {
        random_dense(&recipe, &mut |now| {
            let stage = if now.stage == Stage::Compression { "compression" } else { "release" };
            progress(stage, (now.packing_fraction / 0.65).min(0.99));
        })
    })?;
    packing_of(py, &made.or_raise()?.packing)
}

/// A periodic lattice of touching spheres.
#[pyfunction]
fn lattice<'py>(py: Python<'py>, kind: &str, radius: f64, repeats: [u32; 3]) -> Any<'py> {
    let all = [
        ("simple-cubic", Lattice::SimpleCubic),
        ("body-centered", Lattice::BodyCentered),
        ("face-centered", Lattice::FaceCentered),
        ("hexagonal-close-packed", Lattice::HexagonalClosePacked),
        ("square", Lattice::Square),
        ("triangular", Lattice::Triangular),
    ];
    let Some((_, lattice)) = all.iter().find(|(name, _)| *name == kind) else {
        let names: Vec<_> = all.iter().map(|(name, _)| format!("\"{name}\"")).collect();
        return Err(PyValueError::new_err(format!("kind is \"{kind}\"; it may be {}", names.join(", "))));
    };
    packing_of(py, &lattice.periodic(radius, repeats).or_raise()?)
}

/// Read a packing from a text file.
#[pyfunction]
fn read_packing(py: Python<'_>, path: PathBuf) -> Any<'_> {
    let reader = BufReader::new(std::fs::File::open(&path)?);
    packing_of(py, &file::import_text(reader).or_raise()?)
}

/// Write a packing to a text file.
#[pyfunction]
#[pyo3(signature = (path, positions, radii, cell=None))]
fn write_packing(path: PathBuf, positions: Vectors<'_>, radii: Scalars<'_>, cell: Option<Tensor>) -> PyResult<()> {
    let packing = of_arrays(&positions, &radii, cell)?;
    let file = std::fs::File::create(&path)?;
    file::export_text(&packing, std::io::BufWriter::new(file)).or_raise()
}

/// Density and neighbours of a packing.
#[pyfunction]
#[pyo3(signature = (positions, radii, cell=None, interaction_ratio=1.0))]
fn packing_summary<'py>(
    py: Python<'py>,
    positions: Vectors<'py>,
    radii: Scalars<'py>,
    cell: Option<Tensor>,
    interaction_ratio: f64,
) -> Any<'py> {
    let packing = of_arrays(&positions, &radii, cell)?;
    if packing.spheres.iter().any(|s| s.position.iter().any(|x: &f64| !x.is_finite())) {
        return Err(PyValueError::new_err("positions are not finite"));
    }
    let s = PackingSummary::new(&packing, interaction_ratio).or_raise()?;
    let fields = (
        s.count,
        s.packing_fraction,
        s.coordination,
        s.coordination_of_backbone,
        s.rattlers,
        s.mean_overlap,
        s.largest_overlap,
    );
    result(py, "PackingSummary", fields)
}

/// Order of points along a space-filling curve.
#[pyfunction]
#[pyo3(signature = (positions, cell=None))]
fn spatial_order<'py>(py: Python<'py>, positions: Vectors<'py>, cell: Option<Tensor>) -> Any<'py> {
    let points: &[Vec3] = positions.get()?;
    let cell = cell.map(|cell| Cell::new(cell.0));
    Ok(scalars(py, &concordem::neighbor::spatial_order(points, cell.as_ref())).into_any())
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(dense, module)?)?;
    module.add_function(wrap_pyfunction!(lattice, module)?)?;
    module.add_function(wrap_pyfunction!(read_packing, module)?)?;
    module.add_function(wrap_pyfunction!(write_packing, module)?)?;
    module.add_function(wrap_pyfunction!(packing_summary, module)?)?;
    module.add_function(wrap_pyfunction!(spatial_order, module)?)
}
