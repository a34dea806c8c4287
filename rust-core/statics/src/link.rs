//! A link and its twelve degrees of freedom.

use nalgebra::{SMatrix, SVector};

use concordem_contact::law::Stiffness;
use concordem_contact::math::{Mat3, Vec3};

/// Elastic link between two particles in the reference state.
///
/// With displacements u and small rotations φ of its ends, normal n from A to B, and arms a, b to the contact point
/// (a + b = L), the link strain is
/// `δ = u_B − u_A + n × (a φ_A + b φ_B)` and `θ = φ_B − φ_A`.
/// The link exerts on A the force `f = k_N n(n·δ) + k_T (1 − n n)·δ` and the moment about the contact point
/// `m = k_W n(n·θ) + k_B (1 − n n)·θ`. For a = b = L/2, k_N = ĒA/L, k_T = ḠA/L this is `A L BᵀDB` of Stránský 2018,
/// (3.51)–(3.57); for a = b = L/2, k_N = ES/L, k_T = 12EI/L³, k_B = EI/L, k_W = GI_O/L it is the Euler-Bernoulli beam
/// (Jebahi et al. 2015, [2.1]–[2.9]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// Particle A.
    pub a: u32,
    /// Particle B, or the particle of which B is a periodic image.
    pub b: u32,
    /// Branch vector from the center of A to that of B, m.
    pub branch: Vec3,
    /// Direction of `branch`, unit.
    pub normal: Vec3,
    /// Distance from the center of A to the contact point, m.
    pub arm_a: f64,
    /// Distance from the center of B to the contact point, m.
    pub arm_b: f64,
    /// Stiffnesses k_N, k_T (N/m), k_B, k_W (N·m/rad).
    pub stiffness: Stiffness,
}

/// Relative motion of the ends of a branch `l` under unit strain `component`.
pub(super) fn uniform(l: &Vec3, component: usize) -> Vec3 {
    match component {
        0 => Vec3::new(l.x, 0.0, 0.0),
        1 => Vec3::new(0.0, l.y, 0.0),
        2 => Vec3::new(0.0, 0.0, l.z),
        3 => Vec3::new(0.0, 0.5 * l.z, 0.5 * l.y),
        4 => Vec3::new(0.5 * l.z, 0.0, 0.5 * l.x),
        _ => Vec3::new(0.5 * l.y, 0.5 * l.x, 0.0),
    }
}

/// Motion of a particle: displacement (m) and small rotation (rad).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct NodeMotion {
    /// Displacement, m.
    pub displacement: Vec3,
    /// Rotation vector, rad.
    pub rotation: Vec3,
}

/// Link strain: displacement at the contact point (m) and rotation (rad) of B relative to A.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkStrain {
    /// δ, m.
    pub displacement: Vec3,
    /// θ, rad.
    pub rotation: Vec3,
}

impl LinkStrain {
    /// Displacement and rotation, each split along and across `n`: normal and shear displacement, bending and twist
    /// rotation.
    #[inline(always)]
    pub fn split(&self, n: &Vec3) -> [Vec3; 4] {
        let (normal, twist) = (n * n.dot(&self.displacement), n * n.dot(&self.rotation));
        [normal, self.displacement - normal, self.rotation - twist, twist]
    }
}

impl Link {
    /// Link strain from the motions of its ends.
    #[inline(always)]
    pub fn strain(&self, a: &NodeMotion, b: &NodeMotion) -> LinkStrain {
        let turned = a.rotation * self.arm_a + b.rotation * self.arm_b;
        LinkStrain {
            displacement: b.displacement - a.displacement + self.normal.cross(&turned),
            rotation: b.rotation - a.rotation,
        }
    }

    /// Force (N) and moment about the contact point (N·m) on A. B gets the opposite.
    #[inline(always)]
    pub fn response(&self, strain: &LinkStrain) -> (Vec3, Vec3) {
        let [normal, shear, bending, twist] = strain.split(&self.normal);
        let k = &self.stiffness;
        (normal * k.normal + shear * k.shear, bending * k.bending + twist * k.twist)
    }

    /// Forces (N) and moments (N·m) that hold the ends A and B against this force and moment: the rows of `K u`.
    #[inline(always)]
    pub fn holding(&self, force: &Vec3, moment: &Vec3) -> [NodeMotion; 2] {
        let torque_per_arm = self.normal.cross(force);
        [
            NodeMotion { displacement: -force, rotation: -(torque_per_arm * self.arm_a + moment) },
            NodeMotion { displacement: *force, rotation: moment - torque_per_arm * self.arm_b },
        ]
    }

    /// Stiffnesses k_N, k_T, k_B, k_W in the order of [`LinkStrain::split`].
    #[inline(always)]
    pub fn stiffnesses(&self) -> [f64; 4] {
        let k = &self.stiffness;
        [k.normal, k.shear, k.bending, k.twist]
    }

    /// The link's stiffness matrix; freedoms u_A, φ_A, u_B, φ_B.
    pub fn matrix(&self) -> SMatrix<f64, 12, 12> {
        let mut matrix = SMatrix::<f64, 12, 12>::zeros();
        for column in 0..12 {
            let mut unit = SVector::<f64, 12>::zeros();
            unit[column] = 1.0;
            let part = |first: usize| NodeMotion {
                displacement: unit.fixed_rows::<3>(first).into_owned(),
                rotation: unit.fixed_rows::<3>(first + 3).into_owned(),
            };
            let (force, moment) = self.response(&self.strain(&part(0), &part(6)));
            for (end, holding) in self.holding(&force, &moment).iter().enumerate() {
                matrix.fixed_view_mut::<3, 1>(6 * end, column).copy_from(&holding.displacement);
                matrix.fixed_view_mut::<3, 1>(6 * end + 3, column).copy_from(&holding.rotation);
            }
        }
        matrix
    }

    /// [`Link::matrix`] with rotations multiplied by `scale` (m) so that all entries are N/m.
    pub(super) fn scaled_matrix(&self, scale: f64) -> SMatrix<f64, 12, 12> {
        let mut matrix = self.matrix();
        for first in [3, 9] {
            matrix.fixed_rows_mut::<3>(first).scale_mut(1.0 / scale);
            matrix.fixed_columns_mut::<3>(first).scale_mut(1.0 / scale);
        }
        matrix
    }

    /// The 6×6 diagonal block of end A (`end` 0) or B (1), with rotations multiplied by `scale` (m) so that all entries
    /// are N/m.
    pub(super) fn block(&self, end: usize, scale: f64) -> nalgebra::Matrix6<f64> {
        let n = &self.normal;
        let k = &self.stiffness;
        let along = n * n.transpose();
        let force = Mat3::identity() * k.shear + along * (k.normal - k.shear);
        let moment = Mat3::identity() * k.bending + along * (k.twist - k.bending);
        let (sign, arm) = if end == 0 { (-1.0, self.arm_a) } else { (1.0, self.arm_b) };
        let arm_cross = n.cross_matrix() * (arm / scale);
        let mixed = force * arm_cross * sign;
        let mut block = nalgebra::Matrix6::zeros();
        block.fixed_view_mut::<3, 3>(0, 0).copy_from(&force);
        block.fixed_view_mut::<3, 3>(0, 3).copy_from(&mixed);
        block.fixed_view_mut::<3, 3>(3, 0).copy_from(&mixed.transpose());
        block
            .fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&(arm_cross.transpose() * force * arm_cross + moment * (1.0 / (scale * scale))));
        block
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn link(direction: Vec3, length: f64, arm: f64, k: [f64; 4]) -> Link {
        let normal = direction.normalize();
        Link {
            a: 0,
            b: 1,
            branch: normal * length,
            normal,
            arm_a: arm,
            arm_b: length - arm,
            stiffness: Stiffness { normal: k[0], shear: k[1], bending: k[2], twist: k[3], ..Stiffness::default() },
        }
    }

    /// `A L Tᵀ B_lᵀ D B_l T` written out as in Stránský 2018, (3.44)–(3.56).
    fn thesis(normal: &Vec3, length: f64, area: f64, young: f64, shear: f64) -> SMatrix<f64, 12, 12> {
        let first = concordem_contact::math::any_perpendicular(normal);
        let second = normal.cross(&first);
        let mut rotation = Mat3::zeros();
        for (row, axis) in [*normal, first, second].iter().enumerate() {
            rotation.set_row(row, &axis.transpose());
        }
        let mut turn = SMatrix::<f64, 12, 12>::zeros();
        for k in 0..4 {
            turn.fixed_view_mut::<3, 3>(3 * k, 3 * k).copy_from(&rotation);
        }
        let half = 0.5 * length;
        let mut b = SMatrix::<f64, 3, 12>::zeros();
        for (row, entries) in [
            vec![(1, -1.0), (7, 1.0)],
            vec![(2, -1.0), (6, -half), (8, 1.0), (12, -half)],
            vec![(3, -1.0), (5, half), (9, 1.0), (11, half)],
        ]
        .into_iter()
        .enumerate()
        {
            for (column, value) in entries {
                b[(row, column - 1)] = value / length;
            }
        }
        let b = b * turn;
        let d = Mat3::from_diagonal(&Vec3::new(young, shear, shear));
        b.transpose() * d * b * (area * length)
    }

    proptest! {
        /// The matrix equals that of the thesis, is symmetric, and gives no force for rigid motions. Tolerance: a few
        /// roundings of entries of the size of the largest one.
        #[test]
        fn matrix_of_the_thesis(
            x in -1.0..1.0_f64, y in -1.0..1.0_f64, z in 0.1..1.0_f64, length in 0.5..2.0_f64, shear in 0.0..3.0_f64,
        ) {
            let (area, young) = (0.7, 2.5);
            let k = [young * area / length, shear * area / length, 0.0, 0.0];
            let link = link(Vec3::new(x, y, z), length, 0.5 * length, k);
            let matrix = link.matrix();
            let size = matrix.abs().max();
            prop_assert!((matrix - thesis(&link.normal, length, area, young, shear)).abs().max() < 1e-14 * size);
            prop_assert!((matrix - matrix.transpose()).abs().max() < 1e-15 * size);
        }

        /// Unequal arms, with moments: symmetric, no force for six rigid motions, blocks as in the whole matrix.
        #[test]
        fn rigid_motions_need_no_force(
            x in -1.0..1.0_f64, y in -1.0..1.0_f64, z in 0.1..1.0_f64, share in 0.1..0.9_f64,
            wx in -1.0..1.0_f64, wy in -1.0..1.0_f64, wz in -1.0..1.0_f64,
        ) {
            let length = 1.3;
            let link = link(Vec3::new(x, y, z), length, share * length, [3.0, 1.1, 0.4, 0.2]);
            let matrix = link.matrix();
            let (turn, shift, place) = (Vec3::new(wx, wy, wz), Vec3::new(0.3, -0.2, 0.5), Vec3::new(0.4, 0.1, -0.8));
            let mut motion = SVector::<f64, 12>::zeros();
            for (end, center) in [place, place + link.branch].iter().enumerate() {
                motion.fixed_rows_mut::<3>(6 * end).copy_from(&(shift + turn.cross(center)));
                motion.fixed_rows_mut::<3>(6 * end + 3).copy_from(&turn);
            }
            // Sums of products of numbers up to 4: some 20 roundings.
            prop_assert!((matrix * motion).abs().max() < 2e-14);
            prop_assert!((matrix - matrix.transpose()).abs().max() < 1e-14);
            for end in 0..2 {
                let scale = 0.37;
                let mut block = matrix.fixed_view::<6, 6>(6 * end, 6 * end).into_owned();
                block.fixed_rows_mut::<3>(3).scale_mut(1.0 / scale);
                block.fixed_columns_mut::<3>(3).scale_mut(1.0 / scale);
                prop_assert!((block - link.block(end, scale)).abs().max() < 1e-13);
            }
        }
    }

    /// k_T = 12EI/L³ and k_B = EI/L at the middle are the Euler-Bernoulli beam: 4EI/L and 2EI/L at its ends.
    #[test]
    fn euler_bernoulli_beam() {
        let (ei, length) = (2.0, 1.5);
        let k = [7.0, 12.0 * ei / (length * length * length), ei / length, 0.9];
        let matrix = link(Vec3::x(), length, 0.5 * length, k).matrix();
        let near = |value: f64, exact: f64| (value / exact - 1.0).abs() < 1e-14;
        assert!(near(matrix[(5, 5)], 4.0 * ei / length) && near(matrix[(5, 11)], 2.0 * ei / length));
        assert!(near(matrix[(1, 5)], 6.0 * ei / (length * length)) && near(matrix[(3, 9)], -0.9));
    }
}
