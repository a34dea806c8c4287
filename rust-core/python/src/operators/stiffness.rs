//! Stiffness of bonds under affine motion.

use concordem::operator::affine_stiffness::{self, AffineLink};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::Any;
use crate::arrays::{Scalars, Tensor, Vectors, matrix6, vectors};
use crate::errors::{OrRaise, detach};

/// Stiffness of bonds under affine motion without rotation of particles, Pa (Stránský 2018, (3.31)).
///
/// `D = (1/V) Σ v (E N + G T)`, v the volume (m³) of a bond. An upper bound of the relaxed stiffness. Args: `normal` (n, 3);
/// `link_volume`, `normal_modulus`, `shear_modulus` (n,). Returns (6, 6): 11, 22, 33, 23, 31, 12, engineering shear strains.
/// Raises ValueError for different lengths.
#[pyfunction]
#[pyo3(name = "affine_stiffness")]
fn affine_stiffness_of<'py>(
    py: Python<'py>,
    normal: Vectors<'py>,
    link_volume: Scalars<'py>,
    normal_modulus: Scalars<'py>,
    shear_modulus: Scalars<'py>,
    volume: f64,
) -> Any<'py> {
    let n = normal.get()?;
    let columns = [link_volume.get()?, normal_modulus.get()?, shear_modulus.get()?];
    if let Some(column) = columns.iter().find(|column| column.len() != n.len()) {
        return Err(PyValueError::new_err(format!(
            "{} numbers for {} bonds; give one per bond",
            column.len(),
            n.len()
        )));
    }
    let links: Vec<AffineLink> = (0..n.len())
        .map(|k| AffineLink {
            normal: n[k],
            volume: columns[0][k],
            normal_modulus: columns[1][k],
            shear_modulus: columns[2][k],
        })
        .collect();
    let found = detach(py, || affine_stiffness::affine_stiffness(&links, volume))?.or_raise()?;
    Ok(matrix6(py, &found)?.into_any())
}

/// Young's modulus (Pa) and Poisson's ratio of isotropically distributed bonds (Stránský 2018, (3.38)).
///
/// `E = S Ē(2Ē+3Ḡ)/(4Ē+Ḡ)`, `ν = (Ē−Ḡ)/(4Ē+Ḡ)`, S = link_volume / (3 volume). Returns (E, ν).
#[pyfunction]
fn isotropic_moduli(link_volume: f64, volume: f64, normal_modulus: f64, shear_modulus: f64) -> PyResult<(f64, f64)> {
    affine_stiffness::isotropic_moduli(link_volume, volume, normal_modulus, shear_modulus).or_raise()
}

/// Bulk and shear modulus (N/m) of a plane assembly of equal discs by Voigt's assumption (Madan 2019, (4.15)–(4.18)).
///
/// `K = N R² k_n/A`, `G = N R² (k_n + k_t)/2A`. Args: number of `contacts` N; `radius` R, m; `area` A, m²; stiffnesses, N/m.
#[pyfunction]
fn voigt_plane(contacts: f64, radius: f64, area: f64, normal: f64, tangential: f64) -> PyResult<(f64, f64)> {
    affine_stiffness::voigt_plane(contacts, radius, area, normal, tangential).or_raise()
}

/// Forces of springs on A under an affine displacement without rotation of particles, N.
///
/// `f = (k_n n⊗n + k_t (1 − n⊗n)) G l`. Args: `branch` l (n, 3), m; `normal_stiffness`, `shear_stiffness` (n,), N/m; `gradient` G (3, 3).
/// Returns (n, 3).
#[pyfunction]
fn affine_forces<'py>(
    py: Python<'py>,
    branch: Vectors<'py>,
    normal_stiffness: Scalars<'py>,
    shear_stiffness: Scalars<'py>,
    gradient: Tensor,
) -> Any<'py> {
    let stiffness: Vec<(f64, f64)> =
        normal_stiffness.get()?.iter().copied().zip(shear_stiffness.get()?.iter().copied()).collect();
    Ok(vectors(py, &affine_stiffness::affine_forces(branch.get()?, &stiffness, &gradient.0).or_raise()?)?.into_any())
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(affine_stiffness_of, module)?)?;
    module.add_function(wrap_pyfunction!(isotropic_moduli, module)?)?;
    module.add_function(wrap_pyfunction!(voigt_plane, module)?)?;
    module.add_function(wrap_pyfunction!(affine_forces, module)?)?;
    Ok(())
}
