//! Strain and rotation of the Cosserat continuum (operator O14).

use crate::stress::axial;
use concordem_contact::math::{Mat3, Vec3};

/// Cosserat strain `γ_ij = ∂_i u_j − e_ijk φ_k` from the displacement gradient `G_ij = ∂u_i/∂x_j` and the particles'
/// rotation `φ` (rad): zero under rigid motion (Stránský 2018, (A.88)–(A.89); ERDC 2019, (11)).
pub fn strain(gradient: &Mat3, rotation: &Vec3) -> Mat3 {
    gradient.transpose() - cross_of_identity(rotation)
}

/// `(1×φ)_ij = e_ijk φ_k`.
pub fn cross_of_identity(rotation: &Vec3) -> Mat3 {
    let (x, y, z) = (rotation.x, rotation.y, rotation.z);
    Mat3::new(0.0, z, -y, -z, 0.0, x, y, -x, 0.0)
}

/// Macro-rotation `φ_M = ½ 1×U`, rad, of the displacement gradient `G = Uᵀ`.
pub fn macro_rotation(gradient: &Mat3) -> Vec3 {
    axial(&gradient.transpose()) * 0.5
}
