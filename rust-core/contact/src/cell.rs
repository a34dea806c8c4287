//! The triclinic periodic cell.

#[cfg(not(feature = "std"))]
use crate::math::Real as _;
use crate::math::{Mat3, Vec3};

/// Periodic cell `H`, whose columns are the three edge vectors. It deforms by its velocity gradient `L`: `Ḣ = L H`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Edge vectors as columns, m.
    pub matrix: Mat3,
    /// Deformation gradient since the start, `F = H H₀⁻¹`.
    pub deformation_gradient: Mat3,
    /// Velocity gradient `L_ij = ∂v_i/∂x_j`, 1/s.
    pub velocity_gradient: Mat3,
    /// Change of `matrix` in the last step, m.
    pub matrix_change: Mat3,
}

impl Cell {
    /// A box at rest with the given edge lengths (m).
    pub fn new_box(size: Vec3) -> Self {
        Self::new(Mat3::from_diagonal(&size))
    }

    /// A cell at rest with the given edge vectors as columns (m).
    pub fn new(matrix: Mat3) -> Self {
        Self {
            matrix,
            deformation_gradient: Mat3::identity(),
            velocity_gradient: Mat3::zeros(),
            matrix_change: Mat3::zeros(),
        }
    }

    /// Volume, m³.
    pub fn volume(&self) -> f64 {
        self.matrix.determinant().abs()
    }

    /// Translation of the image with integer indices `image`, m.
    #[inline(always)]
    pub fn shift(&self, image: [i8; 3]) -> Vec3 {
        self.matrix * Vec3::new(f64::from(image[0]), f64::from(image[1]), f64::from(image[2]))
    }

    /// Cell indices of a position: `floor(H⁻¹ x)`; the position wrapped into the cell is `x − H·index`.
    pub fn index_of(&self, position: &Vec3, inverse: &Mat3) -> [i32; 3] {
        let s = inverse * position;
        [s.x.floor() as i32, s.y.floor() as i32, s.z.floor() as i32]
    }
}
