//! Strain of contact cells with particle rotations (operator O17).

use crate::error::{OperatorError, check_length, check_volume};
use crate::region::Period;
use crate::strain::cells::size;
use crate::sum::{sum_tiles, sums};
use crate::tessellation::{Neighbor, PowerDiagram};
use concordem_contact::math::{Mat3, Vec3};

/// Strain from contact cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SatakeStrain {
    /// `(1/V) Σ c⊗d`, i: displacement, j: position. Under an affine motion `G` with one rotation `θ` of all particles it is
    /// `G_ij + e_ijk θ_k`, the transpose of the Cosserat strain (P11).
    pub gradient: Mat3,
    /// Volume `⅓ Σ d·l` (½ in the plane), m³.
    pub volume: f64,
    /// `(1/V) Σ l⊗d`: the unit matrix of the space (P15).
    pub unity: Mat3,
}

/// Strain from relative displacements of neighbors at their common faces (operator O17; Satake 2004 in Jebahi et al.
/// 2015, (1.30)–(1.34)): `(1/V) Σ c^{pq}⊗d^{pq}` with `c^{pq} = (u_q + θ_q×r^{cq}) − (u_p + θ_p×r^{cp})`, `d` the
/// face's area vector in the power diagram, and the point c where the branch vector meets the face.
///
/// The printed rule (1.30) uses plain Voronoi cells, although the text claims to include the sizes; the power diagram does
/// include them. Zero radii in the diagram give the printed rule.
///
/// `displacement` (m or m/s) and `rotation` (rad or rad/s; empty: none) by particle. A diagram with a border needs the
/// displacement of the border at the centroid of every border face (`border_displacement`, in the order of
/// [`PowerDiagram::border`]), that is, the motion of the walls. A periodic one needs `period`.
///
/// ```
/// use concordem_contact::math::{Mat3, Vec3};
/// use concordem_operator::Period;
/// use concordem_operator::strain::{Dimension, satake_strain};
/// use concordem_operator::tessellation::{Domain, power_diagram};
///
/// // A sphere in a periodic cube of 1 m, stretched along x by 1e-3.
/// let edges = Mat3::identity();
/// let diagram = power_diagram(&[Vec3::zeros()], &[0.5], &Domain::Periodic(edges), Dimension::Three).unwrap();
/// let mut change = Mat3::zeros();
/// change[(0, 0)] = 1e-3;
/// let found = satake_strain(&diagram, &[Vec3::zeros()], &[], &[], Some(&Period { edges, change })).unwrap();
/// assert!((found.gradient[(0, 0)] - 1e-3).abs() < 1e-12);
/// ```
pub fn satake_strain(
    diagram: &PowerDiagram,
    displacement: &[Vec3],
    rotation: &[Vec3],
    border_displacement: &[Vec3],
    period: Option<&Period>,
) -> Result<SatakeStrain, OperatorError> {
    let n = diagram.volumes.len();
    check_length("displacement", displacement.len(), n, "particle")?;
    if !rotation.is_empty() {
        check_length("rotation", rotation.len(), n, "particle")?;
    }
    check_length("border_displacement", border_displacement.len(), diagram.border().count(), "face on the border")?;
    let faces = &diagram.faces;
    // Number the border faces once; otherwise each tile would have to count those before it.
    let mut border_number = Vec::with_capacity(faces.len());
    let mut count = 0;
    for face in faces {
        border_number.push(count);
        count += usize::from(matches!(face.neighbor, Neighbor::Border(_)));
    }
    let theta = |p: usize| rotation.get(p).copied().unwrap_or_default();
    sums!(Total { gradient: Mat3, unity: Mat3 });
    let total: Total = sum_tiles(faces.len(), |range| {
        let mut sum = Total::default();
        for k in range {
            let face = &faces[k];
            let p = face.point as usize;
            let relative = match face.neighbor {
                Neighbor::Particle { point, image } => {
                    let q = point as usize;
                    let shift = Vec3::from(image.map(f64::from));
                    let change = period.map_or_else(Vec3::zeros, |period| period.change * shift);
                    let normal = face.branch / face.branch.norm();
                    let (arm_p, arm_q) = (normal * face.distance, normal * face.distance - face.branch);
                    (displacement[q] + change + theta(q).cross(&arm_q)) - (displacement[p] + theta(p).cross(&arm_p))
                }
                Neighbor::Border(_) => {
                    border_displacement[border_number[k]] - (displacement[p] + theta(p).cross(&face.centroid))
                }
            };
            let area = face.area.transpose();
            sum.gradient += relative * area;
            sum.unity += face.branch * area;
        }
        sum
    });
    let volume = check_volume("the diagram", total.unity.trace() / size(diagram.dimension))?;
    Ok(SatakeStrain { gradient: total.gradient / volume, volume, unity: total.unity / volume })
}
