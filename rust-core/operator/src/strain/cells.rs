//! Strain of space cells (operator O15).

use rayon::prelude::*;

use crate::error::{OperatorError, check_length, check_volume};
use crate::interruption::Watch;
use crate::region::{self, Period, Region, Truncation};
use crate::strain::Dimension;
use crate::sum::{sum_tiles, sums};
use crate::tessellation::Mesh;
use concordem_contact::math::{Mat3, Vec3};

/// Displacement gradient of one cell of a triangulation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CellStrain {
    /// Volume, m³ (area in the plane, m²).
    pub volume: f64,
    /// `∮u⊗n dA = V G`, m³.
    pub moment: Mat3,
}

impl CellStrain {
    /// `G_ij = ∂u_i/∂x_j`; `None` for a cell without volume.
    pub fn gradient(&self) -> Option<Mat3> {
        (self.volume != 0.0).then(|| self.moment / self.volume)
    }
}

/// Strain of a triangulated body.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshStrain {
    /// Volume-weighted mean of the cells' gradients, `G_ij = ∂u_i/∂x_j`.
    pub gradient: Mat3,
    /// Volume, m³.
    pub volume: f64,
    /// The cells.
    pub cells: Vec<CellStrain>,
}

impl MeshStrain {
    /// The cells whose centroids lie in a region, and their mean, images of periodic cells included. Pass the arguments
    /// of the call of [`cell_strain`] that returned `self`.
    pub fn within(
        &self,
        mesh: &Mesh,
        position: &[Vec3],
        region: &Region,
        period: Option<&Period>,
    ) -> Result<Self, OperatorError> {
        check(mesh, position, position, period)?;
        check_length("cells", self.cells.len(), mesh.len(), "cell of the mesh")?;
        region::check(region, Truncation::BranchClipped, position, period)?;
        let (mut inside, images) = (Vec::new(), region.images(period));
        for (k, cell) in self.cells.iter().enumerate() {
            let corners = mesh.cell(k);
            let middle = corners.iter().map(|c| c.place(position, period)).sum::<Vec3>() / corners.len() as f64;
            images.inside(0, &middle).for_each(|_| inside.push(*cell));
        }
        if inside.is_empty() {
            return Err(OperatorError::EmptyRegion { what: "cell" });
        }
        let (mut volume, mut moment) = (0.0, Mat3::zeros());
        for cell in &inside {
            volume += cell.volume;
            moment += cell.moment;
        }
        let volume = check_volume("the cells in the region", volume)?;
        Ok(Self { gradient: moment / volume, volume, cells: inside })
    }
}

/// Displacement gradient of every cell of a triangulation, and its mean (operator O15; Jebahi et al. 2015, (1.14)–(1.15);
/// Madan 2019, (4.4)–(4.6)): `G^c = (1/V^c) Σ_faces ū⊗A`, `ū` the mean over the face's corners, `A` its outward area
/// vector.
///
/// `position` (m) is the reference configuration of the gradients, not necessarily that of the mesh; `displacement` is
/// in m (or a velocity, m/s). Both by point. A periodic mesh needs `period` with its change.
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::{strain::{Dimension, cell_strain}, tessellation::delaunay};
///
/// // The corners of a cube, sheared by 1e-3.
/// let position: Vec<Vec3> =
///     (0..8).map(|k| Vec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64)).collect();
/// let displacement: Vec<Vec3> = position.iter().map(|x| Vec3::x() * (1e-3 * x.y)).collect();
/// let mesh = delaunay(&position, Dimension::Three, None).unwrap();
/// let strain = cell_strain(&mesh, &position, &displacement, None).unwrap();
/// for cell in &strain.cells {
///     assert!((cell.gradient().unwrap()[(0, 1)] - 1e-3).abs() < 1e-12);
/// }
/// ```
pub fn cell_strain(
    mesh: &Mesh,
    position: &[Vec3],
    displacement: &[Vec3],
    period: Option<&Period>,
) -> Result<MeshStrain, OperatorError> {
    check(mesh, position, displacement, period)?;
    let watch = Watch::here();
    let cells: Vec<CellStrain> = (0..mesh.len())
        .into_par_iter()
        .with_min_len(256)
        .map(|k| {
            watch.look();
            let (volume, areas) = mesh.geometry(k, position, period);
            let corners = mesh.cell(k);
            let size = corners.len();
            let mut u = [Vec3::zeros(); 4];
            let mut total = Vec3::zeros();
            for (u, corner) in u.iter_mut().zip(corners) {
                *u = corner.displacement(displacement, period);
                total += *u;
            }
            let mut moment = Mat3::zeros();
            for (u, area) in u.iter().zip(&areas).take(size) {
                // Mean over the face's corners: all but the one opposite.
                moment += (total - u) * area.transpose() / (size - 1) as f64;
            }
            CellStrain { volume, moment }
        })
        .collect();
    sums!(Total { volume: f64, moment: Mat3 });
    let total: Total = sum_tiles(cells.len(), |range| {
        let mut sum = Total::default();
        for cell in &cells[range] {
            sum += Total { volume: cell.volume, moment: cell.moment };
        }
        sum
    });
    let volume = check_volume("the triangulation", total.volume)?;
    Ok(MeshStrain { gradient: total.moment / volume, volume, cells })
}

pub(super) fn check(
    mesh: &Mesh,
    position: &[Vec3],
    displacement: &[Vec3],
    period: Option<&Period>,
) -> Result<(), OperatorError> {
    check_length("position", position.len(), mesh.points(), "point of the mesh")?;
    check_length("displacement", displacement.len(), mesh.points(), "point of the mesh")?;
    if mesh.is_periodic() && period.is_none() {
        return Err(OperatorError::Singular {
            what: "the strain of a periodic mesh",
            reason: "its cells need the period's edges and their change",
        });
    }
    Ok(())
}

/// Number of dimensions, as a real.
pub(super) fn size(dimension: Dimension) -> f64 {
    if dimension == Dimension::Two { 2.0 } else { 3.0 }
}
