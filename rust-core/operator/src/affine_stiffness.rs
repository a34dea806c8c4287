//! Elastic stiffness of a set of links whose particles move affinely (operator O22).

use super::error::{OperatorError, check_length, check_not_negative, check_positive, check_volume};
use super::sum::{sum_tiles, sums};
use concordem_contact::math::{Mat3, Vec3};
use nalgebra::{Matrix6, Vector6};

/// A bonded link between two particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AffineLink {
    /// Direction, a unit vector.
    pub normal: Vec3,
    /// Length times cross-section, m³.
    pub volume: f64,
    /// Normal modulus, Pa.
    pub normal_modulus: f64,
    /// Shear modulus, Pa.
    pub shear_modulus: f64,
}

/// Stiffness `D = (1/V) Σ LA (Ē N + Ḡ T)` (Pa) of links under affine motion without rotation of particles (Stránský 2018,
/// (3.31)); components 11, 22, 33, 23, 31, 12 with engineering shear strains.
///
/// `N_ijkl = n_i n_j n_k n_l`, `T_ijkl = ¼(n_j n_k δ_il + n_j n_l δ_ik + n_i n_k δ_jl + n_i n_l δ_jk) − N_ijkl`.
/// An upper bound of the relaxed stiffness, exact for lattices with one particle per cell.
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::affine_stiffness::{AffineLink, affine_stiffness};
///
/// // The links of a simple cubic lattice: length 1 m, section 1 m², 30 GPa.
/// let link = |normal| AffineLink { normal, volume: 1.0, normal_modulus: 30e9, shear_modulus: 0.0 };
/// let stiffness = affine_stiffness(&[link(Vec3::x()), link(Vec3::y()), link(Vec3::z())], 1.0).unwrap();
/// assert_eq!((stiffness[(0, 0)], stiffness[(0, 1)]), (30e9, 0.0));
/// ```
pub fn affine_stiffness(links: &[AffineLink], volume: f64) -> Result<Matrix6<f64>, OperatorError> {
    let volume = check_volume("the body", volume)?;
    if links.is_empty() {
        return Err(OperatorError::EmptyRegion { what: "link" });
    }
    check_not_negative("volume of a link", links.iter().map(|link| link.volume))?;
    check_not_negative("normal modulus", links.iter().map(|link| link.normal_modulus))?;
    sums!(Total { stiffness: Matrix6<f64> });
    let total: Total = sum_tiles(links.len(), |range| {
        let mut sum = Total::default();
        for link in &links[range] {
            let n = &link.normal;
            // Normal strain: nᵀεn; shear strain vector: εn − n(nᵀεn); both as rows that multiply (ε11, …, γ12).
            let along = Vector6::new(n.x * n.x, n.y * n.y, n.z * n.z, n.y * n.z, n.z * n.x, n.x * n.y);
            let rows = [
                Vector6::new(n.x, 0.0, 0.0, 0.0, 0.5 * n.z, 0.5 * n.y),
                Vector6::new(0.0, n.y, 0.0, 0.5 * n.z, 0.0, 0.5 * n.x),
                Vector6::new(0.0, 0.0, n.z, 0.5 * n.y, 0.5 * n.x, 0.0),
            ];
            let mut k = along * along.transpose() * (link.volume * link.normal_modulus);
            for (i, row) in rows.iter().enumerate() {
                let shear = row - along * n[i];
                k += shear * shear.transpose() * (link.volume * link.shear_modulus);
            }
            sum.stiffness += k;
        }
        sum
    });
    Ok(total.stiffness / volume)
}

/// Young's modulus (Pa) and Poisson's ratio of links with uniformly distributed directions (Stránský 2018, (3.38)):
/// `E = S Ē(2Ē+3Ḡ)/(4Ē+Ḡ)`, `ν = (Ē−Ḡ)/(4Ē+Ḡ)`, `S = Σ LA/3V`.
pub fn isotropic_moduli(
    link_volume: f64,
    volume: f64,
    normal_modulus: f64,
    shear_modulus: f64,
) -> Result<(f64, f64), OperatorError> {
    let s = check_positive("volume of the links", link_volume)? / (3.0 * check_volume("the body", volume)?);
    let (e, g) = (check_positive("normal modulus", normal_modulus)?, shear_modulus);
    check_not_negative("shear modulus", [g])?;
    Ok((s * e * (2.0 * e + 3.0 * g) / (4.0 * e + g), (e - g) / (4.0 * e + g)))
}

/// Bulk and shear modulus (N/m) of a plane assembly of equal discs under Voigt's assumption (Madan 2019, (4.15)–(4.18)):
/// `K = N_c R² k_n/V`, `G = N_c R² (k_n + k_t)/2V`, `V` the area per unit depth (m²).
pub fn voigt_plane(
    contacts: f64,
    radius: f64,
    area: f64,
    normal: f64,
    tangential: f64,
) -> Result<(f64, f64), OperatorError> {
    let area = check_volume("the assembly", area)?;
    let radius = check_positive("radius", radius)?;
    let c = check_positive("number of contacts", contacts)? * (radius * radius) / area;
    Ok((c * normal, 0.5 * c * (normal + tangential)))
}

/// Contact forces (N) on A of linear springs with normal stiffness `k_n` and tangential stiffness `k_t` (N/m) under an
/// affine displacement without particle rotation: `f = (k_n n⊗n + k_t (1 − n⊗n)) G l`. Their branch sum is `D : ε` for
/// symmetric `G` (P19).
pub fn affine_forces(branch: &[Vec3], stiffness: &[(f64, f64)], gradient: &Mat3) -> Result<Vec<Vec3>, OperatorError> {
    check_length("stiffness", stiffness.len(), branch.len(), "contact")?;
    let force = |l: &Vec3, &(normal, tangential): &(f64, f64)| {
        let n = l / l.norm();
        let stretch = gradient * l;
        let along = n * n.dot(&stretch);
        along * normal + (stretch - along) * tangential
    };
    Ok(branch.iter().zip(stiffness).map(|(l, k)| force(l, k)).collect())
}
