//! Strain from edges and their dual area vectors (operator O16).

use crate::error::{OperatorError, check_volume};
use crate::region::Period;
use crate::strain::Dimension;
use crate::strain::cells::{check, size};
use crate::sum::{sum_tiles, sums};
use crate::tessellation::Mesh;
use concordem_contact::math::{Mat3, Vec3};

/// Strain from edges, with the identity that its dual vectors obey.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BagiStrain {
    /// `G_ij = ∂u_i/∂x_j`.
    pub gradient: Mat3,
    /// Volume `⅓ Σ d·l` (½ in the plane), m³.
    pub volume: f64,
    /// `(1/V) Σ l⊗d`: the unit matrix of the space (P15).
    pub unity: Mat3,
}

/// Displacement gradient from relative displacements along the edges of a triangulation (operator O16; Bagi 1996 in Jebahi
/// et al. 2015, (1.16)–(1.17)): `G = (1/V) Σ_edges (u_b − u_a)⊗d^{ab}`.
///
/// The complementary area vectors are summed cell by cell, `d^{ab} += (S_a − S_b)/12` in space and `/6` in the plane, with
/// `S_a` the outward area vector of the face opposite to corner a (from `∇N_a = −S_a/3V`). Arguments as in
/// [`super::cell_strain`].
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::{strain::{Dimension, bagi_strain}, tessellation::delaunay};
///
/// // The corners of a cube, sheared by 1e-3.
/// let position: Vec<Vec3> =
///     (0..8).map(|k| Vec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64)).collect();
/// let displacement: Vec<Vec3> = position.iter().map(|x| Vec3::x() * (1e-3 * x.y)).collect();
/// let mesh = delaunay(&position, Dimension::Three, None).unwrap();
/// let found = bagi_strain(&mesh, &position, &displacement, None).unwrap();
/// assert!((found.gradient[(0, 1)] - 1e-3).abs() < 1e-12 && (found.volume - 1.0).abs() < 1e-12);
/// ```
pub fn bagi_strain(
    mesh: &Mesh,
    position: &[Vec3],
    displacement: &[Vec3],
    period: Option<&Period>,
) -> Result<BagiStrain, OperatorError> {
    check(mesh, position, displacement, period)?;
    let share = if mesh.dimension() == Dimension::Two { 6.0 } else { 12.0 };
    sums!(Total { gradient: Mat3, unity: Mat3 });
    let total: Total = sum_tiles(mesh.len(), |range| {
        let mut sum = Total::default();
        for k in range {
            let (_, areas) = mesh.geometry(k, position, period);
            let corners = mesh.cell(k);
            for (a, corner_a) in corners.iter().enumerate() {
                for (b, corner_b) in corners.iter().enumerate().skip(a + 1) {
                    let dual = (areas[a] - areas[b]).transpose() / share;
                    let place = |c: &crate::tessellation::Corner| c.place(position, period);
                    let move_of = |c: &crate::tessellation::Corner| c.displacement(displacement, period);
                    sum.gradient += (move_of(corner_b) - move_of(corner_a)) * dual;
                    sum.unity += (place(corner_b) - place(corner_a)) * dual;
                }
            }
        }
        sum
    });
    let volume = check_volume("the triangulation", total.unity.trace() / size(mesh.dimension()))?;
    Ok(BagiStrain { gradient: total.gradient / volume, volume, unity: total.unity / volume })
}
