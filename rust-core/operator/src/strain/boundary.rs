//! Strain from the outer boundary (operator O18).

use crate::error::{OperatorError, check_volume};
use crate::region::Period;
use crate::strain::cells::{check, size};
use crate::tessellation::Mesh;
use concordem_contact::math::{Mat3, Vec3};

/// Displacement gradient from the motion of a triangulated body's hull alone: `G = (1/V) ∮ u⊗n dA`, with the volume from
/// `⅓ ∮ x·n dA` (½ in the plane) (operator O18). Not for periodic meshes, which have no hull: see [`cell_gradient`].
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::{strain::{Dimension, boundary_strain}, tessellation::delaunay};
///
/// // The corners of a cube, sheared by 1e-3.
/// let position: Vec<Vec3> =
///     (0..8).map(|k| Vec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64)).collect();
/// let displacement: Vec<Vec3> = position.iter().map(|x| Vec3::x() * (1e-3 * x.y)).collect();
/// let mesh = delaunay(&position, Dimension::Three, None).unwrap();
/// assert!((boundary_strain(&mesh, &position, &displacement).unwrap()[(0, 1)] - 1e-3).abs() < 1e-12);
/// ```
pub fn boundary_strain(mesh: &Mesh, position: &[Vec3], displacement: &[Vec3]) -> Result<Mat3, OperatorError> {
    check(mesh, position, displacement, None)?;
    // Measured from a point of the body, so that a distant origin costs no digits.
    let origin = mesh.hull().next().map_or_else(Vec3::zeros, |face| position[face[0].point as usize]);
    let (mut volume, mut moment) = (0.0, Mat3::zeros());
    for face in mesh.hull() {
        let count = face.len() as f64;
        let mut corners = [Vec3::zeros(); 3];
        let mut u = Vec3::zeros();
        let mut x = Vec3::zeros();
        for (place, corner) in corners.iter_mut().zip(face) {
            *place = position[corner.point as usize] - origin;
            x += *place;
            u += displacement[corner.point as usize];
        }
        let area = crate::tessellation::face_area(&corners[..face.len()]);
        volume += (x / count).dot(&area) / size(mesh.dimension());
        moment += (u / count) * area.transpose();
    }
    Ok(moment / check_volume("the hull", volume)?)
}

/// Displacement gradient of a periodic cell from its edges: `G = ΔH H⁻¹`, the boundary integral over a cell.
pub fn cell_gradient(period: &Period) -> Result<Mat3, OperatorError> {
    let inverse = period.edges.try_inverse().ok_or(OperatorError::Volume { of: "the periodic cell", volume: 0.0 })?;
    Ok(period.change * inverse)
}
