//! Forces and torques of a contact on its two particles.

use core::ops::AddAssign;

use crate::columns::{Arrays, Item, Lanes};
use crate::math::Vec3;

/// Force and torque.
#[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Wrench {
    /// Force, N.
    pub force: Vec3,
    /// Torque about the particle's center, N·m.
    pub torque: Vec3,
}

/// What a contact exerts on its particles.
#[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Wrenches {
    /// On A.
    pub a: Wrench,
    /// On B.
    pub b: Wrench,
}

crate::column_arrays! { pub Wrench { force: Vec3, torque: Vec3 } }

crate::column_arrays! { pub Wrenches { a: Wrench, b: Wrench } }

impl Wrenches {
    /// Of a force on A (N) with the arms of A and B (m) along the normal from A to B, and a moment on A (N·m).
    #[inline(always)]
    pub fn of(normal: &Vec3, force: &Vec3, arms: [f64; 2]) -> Self {
        let [on_a, on_b] = torques(normal, force, arms);
        Self { a: Wrench { force: *force, torque: on_a }, b: Wrench { force: -force, torque: on_b } }
    }

    /// With a moment on A, and its opposite on B, N·m.
    #[inline(always)]
    #[must_use]
    pub fn with_moment(mut self, moment: &Vec3) -> Self {
        self.a.torque += moment;
        self.b.torque -= moment;
        self
    }
}

/// Torques on A and B about their centers, N·m: `a n × f` for a force `f` on A (N) and the arms `a` of A and B (m).
#[inline(always)]
pub fn torques(normal: &Vec3, force: &Vec3, arms: [f64; 2]) -> [Vec3; 2] {
    let torque_per_arm = normal.cross(force);
    arms.map(|arm| torque_per_arm * arm)
}

/// Items `i` to `i + 3` of columns. Those of A and B apart, so that both begin in a vector register of their own.
#[inline(always)]
pub fn wrenches_of_four(columns: &<Wrenches as Item>::Arrays, i: usize, lanes: impl Lanes) -> [Wrenches; 4] {
    let (a, b) = (columns.a.get_four(i, lanes), columns.b.get_four(i, lanes));
    [
        Wrenches { a: a[0], b: b[0] },
        Wrenches { a: a[1], b: b[1] },
        Wrenches { a: a[2], b: b[2] },
        Wrenches { a: a[3], b: b[3] },
    ]
}

impl AddAssign<&Wrench> for Wrench {
    /// Number by number, which compilers do in vector registers.
    #[inline(always)]
    fn add_assign(&mut self, other: &Self) {
        let numbers: &mut [f64; 6] = bytemuck::cast_mut(self);
        let others: &[f64; 6] = bytemuck::cast_ref(other);
        for (number, other) in numbers.iter_mut().zip(others) {
            *number += other;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A force of 6 N across a normal, with arms of 2 and 3 m, and a moment; and sums of both. Exact numbers.
    #[test]
    fn actions_are_opposite_and_add() {
        let wrenches = Wrenches::of(&Vec3::x(), &(Vec3::y() * 6.0), [2.0, 3.0]).with_moment(&Vec3::x());
        assert_eq!(wrenches.a, Wrench { force: Vec3::y() * 6.0, torque: Vec3::new(1.0, 0.0, 12.0) });
        assert_eq!(wrenches.b, Wrench { force: Vec3::y() * -6.0, torque: Vec3::new(-1.0, 0.0, 18.0) });
        let mut sum = wrenches.a;
        sum += &wrenches.b;
        assert_eq!(sum, Wrench { force: Vec3::zeros(), torque: Vec3::z() * 30.0 });
    }
}
