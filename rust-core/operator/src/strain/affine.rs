//! Affine fit of motion by least squares: one 4×4 normal matrix for displacements and rotations.

use crate::error::{OperatorError, check_length};
use crate::region::{self, Period, Region, Truncation};
use crate::stress::axial;
use crate::sum::{sum_tiles, sums};
use concordem_contact::math::{Mat3, Vec3};

/// Affine part of the motion of particles (operator O13; Cundall's best fit: Jebahi et al. 2015, (1.19)–(1.29) with the
/// missing transpose of (1.27); ERDC 2019, (25) with corrected blocks).
///
/// Displacements and rotations give strains, velocities and angular velocities give rates. The 24-parameter fit of the
/// report separates exactly into the regressions of displacement and of rotation on `(1, x)`, because its uniform
/// rotation is free. So lengths need no weight relative to angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AffineFit {
    /// Mean position of the particles, m: where the constant parts below hold.
    pub center: Vec3,
    /// Displacement (m) or velocity (m/s) at the center.
    pub translation: Vec3,
    /// `G_ij = ∂u_i/∂x_j`.
    pub gradient: Mat3,
    /// Particle rotation (rad) or angular velocity (rad/s) at the center.
    pub rotation: Vec3,
    /// Curvature `κ_ij = ∂_i φ_j`, 1/m or 1/(m·s).
    pub curvature: Mat3,
    /// Sum of squares of the non-affine displacement, and of the whole displacement about its mean, m².
    pub residual: [f64; 2],
    /// The same for rotation, rad².
    pub rotation_residual: [f64; 2],
    /// Particles in the fit.
    pub particles: usize,
    /// Smallest over largest principal second moment of the positions: how well they span space.
    pub spread: f64,
}

impl AffineFit {
    /// Displacement (m or m/s) of the fit at `x`.
    pub fn displacement(&self, x: &Vec3) -> Vec3 {
        self.translation + self.gradient * (x - self.center)
    }

    /// Rotation (rad or rad/s) of the fit at `x`.
    pub fn rotation_at(&self, x: &Vec3) -> Vec3 {
        self.rotation + self.curvature.transpose() * (x - self.center)
    }

    /// Symmetric strain `½(G + Gᵀ)`.
    pub fn strain(&self) -> Mat3 {
        (self.gradient + self.gradient.transpose()) * 0.5
    }

    /// Macro-rotation `φ_M = ½ 1×U = ½ curl u`, `U = Gᵀ`.
    pub fn macro_rotation(&self) -> Vec3 {
        axial(&self.gradient.transpose()) * 0.5
    }

    /// Micro-rotation `φ_m = φ − φ_M`: rotation of the particles relative to the body (the report's `wᵃ`).
    pub fn micro_rotation(&self) -> Vec3 {
        self.rotation - self.macro_rotation()
    }

    /// Cosserat strain `γ = U − 1×φ`, `γ_ij = ∂_i u_j − e_ijk φ_k`.
    pub fn cosserat_strain(&self) -> Mat3 {
        super::cosserat::strain(&self.gradient, &self.rotation)
    }
}

/// Space dimension.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Dimension {
    /// The plane z = 0: gradients have no third column.
    Two,
    /// Space.
    #[default]
    Three,
}

sums!(First { count: f64, x: Vec3, u: Vec3, phi: Vec3 });
sums!(Second { xx: Mat3, ux: Mat3, px: Mat3 });
sums!(Squares { u: f64, u_all: f64, phi: f64, phi_all: f64 });

/// Fit an affine motion to the particles whose centers lie in a region.
///
/// `position` (m) is in the reference configuration of the strains, the initial or the present one; the results differ
/// by the order of the strain. `displacement` (m or m/s) and `rotation` (rad or rad/s; empty: none) belong to the
/// particles. Images of a `period` take part with displacements that follow its change.
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::{Region, strain::{Dimension, affine_fit}};
///
/// // Four particles; the body is stretched along x by 1e-3.
/// let position = [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()];
/// let displacement = position.map(|x| Vec3::x() * (1e-3 * x.x));
/// let fit =
///     affine_fit(&position, &displacement, &[], &Region::All { volume: 1.0 }, None, Dimension::Three).unwrap();
/// assert!((fit.strain()[(0, 0)] - 1e-3).abs() < 1e-15);
/// ```
pub fn affine_fit(
    position: &[Vec3],
    displacement: &[Vec3],
    rotation: &[Vec3],
    region: &Region,
    period: Option<&Period>,
    dimension: Dimension,
) -> Result<AffineFit, OperatorError> {
    let n = position.len();
    check_length("displacement", displacement.len(), n, "particle")?;
    if !rotation.is_empty() {
        check_length("rotation", rotation.len(), n, "particle")?;
    }
    region::check(region, Truncation::InternalOnly, position, period)?;
    let none = Vec3::zeros();
    let images = region.images(period);
    // All particles and images inside: position, displacement, rotation.
    let each = |p: usize, f: &mut dyn FnMut(Vec3, Vec3, Vec3)| {
        let phi = rotation.get(p).copied().unwrap_or_default();
        for image in images.inside(p, &position[p]) {
            let (shift, change) = period.map_or((none, none), |period| (period.edges * image, period.change * image));
            f(position[p] + shift, displacement[p] + change, phi);
        }
    };
    let first: First = sum_tiles(n, |range| {
        let mut sum = First::default();
        for p in range {
            each(p, &mut |x, u, phi| sum += First { count: 1.0, x, u, phi });
        }
        sum
    });
    if first.count == 0.0 {
        return Err(OperatorError::EmptyRegion { what: "particle" });
    }
    let (center, mean_u, mean_phi) = (first.x / first.count, first.u / first.count, first.phi / first.count);
    let second: Second = sum_tiles(n, |range| {
        let mut sum = Second::default();
        for p in range {
            each(p, &mut |x, u, phi| {
                let t = (x - center).transpose();
                sum += Second { xx: (x - center) * t, ux: (u - mean_u) * t, px: (phi - mean_phi) * t };
            });
        }
        sum
    });
    let (inverse, spread) = inverse_of_moments(&second.xx, first.count as usize, dimension)?;
    let gradient = second.ux * inverse;
    let curvature = (second.px * inverse).transpose();
    let squares: Squares = sum_tiles(n, |range| {
        let mut sum = Squares::default();
        for p in range {
            each(p, &mut |x, u, phi| {
                let (du, dphi) = (u - mean_u, phi - mean_phi);
                sum += Squares {
                    u: (du - gradient * (x - center)).norm_squared(),
                    u_all: du.norm_squared(),
                    phi: (dphi - curvature.transpose() * (x - center)).norm_squared(),
                    phi_all: dphi.norm_squared(),
                };
            });
        }
        sum
    });
    Ok(AffineFit {
        center,
        translation: mean_u,
        gradient,
        rotation: mean_phi,
        curvature,
        residual: [squares.u, squares.u_all],
        rotation_residual: [squares.phi, squares.phi_all],
        particles: first.count as usize,
        spread,
    })
}

/// Smallest over largest principal moment below which points lie in a plane: the square of the precision (1e-8) to
/// which second moments of coordinates of size 1 resolve a thickness.
const FLAT: f64 = 1e-16;

/// Inverse of the matrix of second moments, and how well the points span space.
fn inverse_of_moments(moments: &Mat3, points: usize, dimension: Dimension) -> Result<(Mat3, f64), OperatorError> {
    let two = dimension == Dimension::Two;
    let flat = |ratio: f64| OperatorError::Flat {
        points,
        dimension: if two { 2 } else { 3 },
        ratio,
        needed: if two { 3 } else { 4 },
        flat: if two { "line" } else { "plane" },
    };
    let mut m = *moments;
    let scale = m.trace();
    if !(scale > 0.0 && scale.is_finite()) {
        return Err(flat(0.0));
    }
    if two {
        for k in 0..3 {
            m[(2, k)] = 0.0;
            m[(k, 2)] = 0.0;
        }
        m[(2, 2)] = 0.5 * (m[(0, 0)] + m[(1, 1)]);
    }
    let eigen = nalgebra::SymmetricEigen::new(m);
    let spread = eigen.eigenvalues.min() / eigen.eigenvalues.max();
    if spread.is_nan() || spread < FLAT || points < if two { 3 } else { 4 } {
        return Err(flat(spread.max(0.0)));
    }
    let mut inverse = m.cholesky().ok_or_else(|| flat(spread))?.inverse();
    if two {
        inverse[(2, 2)] = 0.0;
    }
    Ok((inverse, spread))
}
