//! Velocity fields: motions of sets that depend on the position of each particle.

use concordem_contact::math::{Mat3, Vec3};

/// A linear velocity field `v = L (x − x₀)`, at the factor 1 of its history.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// The point `x₀` without velocity, m.
    pub point: Vec3,
    /// Velocity gradient `L`, 1/s.
    pub gradient: Mat3,
    /// Angular velocity of the particles, rad/s; `None`: the field leaves it alone.
    pub angular_velocity: Option<Vec3>,
    /// Components of the velocity that the field prescribes.
    pub prescribed: [bool; 3],
}

/// Terms of the series of the exponential; exact up to rounding while `|L Δt|` is below 1.
const TERMS: i32 = 18;

impl Field {
    /// The field in a step of `dt` (s) with the factor `factor`.
    ///
    /// Its velocity is `(exp(L Δt) − 1) (x − x₀)/Δt`, so that the positions at the ends of the steps lie on the exact paths: on
    /// circles for a rotation.
    pub fn step(&self, factor: f64, dt: f64) -> FieldStep {
        let rate = self.gradient * factor;
        // (exp(A) − 1)/A = 1 + A/2 (1 + A/3 (1 + …)) with A = L Δt
        let increment = rate * dt;
        let series = (2..=TERMS)
            .rev()
            .fold(Mat3::identity(), |sum, k| Mat3::identity() + increment * sum * (1.0 / f64::from(k)));
        FieldStep {
            point: self.point,
            gradient: rate * series,
            angular_velocity: self.angular_velocity.map(|w| w * factor),
            prescribed: self.prescribed,
        }
    }
}

/// A velocity field in a step.
pub struct FieldStep {
    point: Vec3,
    /// `(exp(L Δt) − 1)/Δt`, 1/s.
    gradient: Mat3,
    angular_velocity: Option<Vec3>,
    prescribed: [bool; 3],
}

impl FieldStep {
    /// Sets the prescribed components of velocity (m/s) and angular velocity (rad/s) of a particle at `position` (m).
    pub fn set(&self, position: &Vec3, velocity: &mut Vec3, angular_velocity: &mut Vec3) {
        let found = self.gradient * (position - self.point);
        for i in (0..3).filter(|&i| self.prescribed[i]) {
            velocity[i] = found[i];
        }
        if let Some(given) = self.angular_velocity {
            *angular_velocity = given;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter turn in 90 large steps ends on the circle; a stretch ends at `exp(L t)`. Tolerance 1e-14: rounding of 90 steps.
    #[test]
    fn steps_follow_the_exact_paths() {
        let path = |gradient: Mat3, mut x: Vec3, dt: f64| {
            let point = Vec3::new(0.5, -0.25, 1.0);
            let field = Field { point, gradient, angular_velocity: None, prescribed: [true; 3] };
            x += point;
            for _ in 0..90 {
                let mut velocity = Vec3::zeros();
                field.step(2.0, dt).set(&x, &mut velocity, &mut Vec3::zeros());
                x += velocity * dt;
            }
            x - point
        };
        let about_z = Mat3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let x = path(about_z, Vec3::new(1.0, 0.0, 0.5), std::f64::consts::PI / 360.0);
        assert!((x - Vec3::new(0.0, 1.0, 0.5)).norm() < 1e-14, "{x}");
        let stretch = Mat3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let x = path(stretch, Vec3::new(1.0, 0.0, 0.0), 1.0 / 180.0);
        assert!((x - Vec3::new(1_f64.cosh(), 1_f64.sinh(), 0.0)).norm() < 1e-14, "{x}");
    }
}
