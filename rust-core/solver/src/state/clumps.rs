//! Clumps: rigid bodies made of several spheres.
//!
//! A clump has a center of mass, a mass, and principal moments of inertia, which may be set independently of its
//! spheres (Stránský 2018, §2.3). Its spheres do not interact with each other; forces on them act on the clump, and
//! they move with it.

use crate::state::{Constraint, Particles};
use concordem_contact::math::{Mat3, Quat, Vec3, normalized, quaternion_of_rotation_vector, rotate};

/// One rigid body.
#[derive(Debug, Clone, PartialEq)]
pub struct Clump {
    /// Indices of the member particles, ascending.
    pub members: Vec<u32>,
    /// Positions of the members' centers in the body frame, m.
    pub offsets: Vec<Vec3>,
    /// Member orientations relative to the body.
    pub orientations: Vec<Quat>,
    /// Center of mass, m.
    pub position: Vec3,
    /// Velocity at the half step, m/s.
    pub velocity: Vec3,
    /// Orientation of the principal axes, body → world.
    pub orientation: Quat,
    /// Angular momentum at the half step, world axes, kg·m²/s.
    pub angular_momentum: Vec3,
    /// Mass, kg.
    pub mass: f64,
    /// Principal moments of inertia, kg·m²; in ascending order for a new clump.
    pub inertia: Vec3,
    /// Prescribed degrees of freedom.
    pub constraint: Constraint,
}

impl Clump {
    /// A clump of `members` with the given mass (kg) and principal moments of inertia (kg·m², ascending). Default: the
    /// sums over its spheres, which count overlaps twice, as if separate spheres were rigidly joined.
    pub fn new(members: Vec<u32>, particles: &Particles, mass: Option<f64>, inertia: Option<Vec3>) -> Self {
        let sum_mass: f64 = members.iter().map(|&m| particles.mass[m as usize]).sum();
        let weighted = |values: &[Vec3]| {
            members.iter().fold(Vec3::zeros(), |s, &m| s + values[m as usize] * particles.mass[m as usize]) / sum_mass
        };
        let position = weighted(&particles.position);
        let velocity = weighted(&particles.velocity);
        let mut tensor = Mat3::zeros();
        for &m in &members {
            let m = m as usize;
            let r = particles.position[m] - position;
            tensor += Mat3::identity() * (particles.inertia[m] + particles.mass[m] * r.norm_squared())
                - r * r.transpose() * particles.mass[m];
        }
        let (moments, axes) = principal_axes(&tensor);
        let orientation = quaternion_of_axes(&axes);
        let inverse = orientation.conjugate();
        let offsets = members.iter().map(|&m| rotate(&inverse, &(particles.position[m as usize] - position))).collect();
        let orientations = members.iter().map(|&m| inverse * particles.orientation[m as usize]).collect();
        Self {
            members,
            offsets,
            orientations,
            position,
            velocity,
            orientation,
            angular_momentum: Vec3::zeros(),
            mass: mass.unwrap_or(sum_mass),
            inertia: inertia.unwrap_or(moments),
            constraint: Constraint::FREE,
        }
    }

    /// Set the velocity (m/s) and angular velocity (rad/s) of the body and its members.
    pub fn start(&mut self, velocity: Vec3, angular_velocity: Vec3, particles: &mut Particles) {
        self.velocity = velocity;
        let local = rotate(&self.orientation.conjugate(), &angular_velocity);
        self.angular_momentum = rotate(&self.orientation, &local.component_mul(&self.inertia));
        self.place_members(particles, &angular_velocity, &Quat::identity());
    }

    /// Angular velocity (rad/s) of the angular momentum `momentum` (kg·m²/s) at `orientation`.
    pub fn angular_velocity(&self, momentum: &Vec3, orientation: &Quat) -> Vec3 {
        let body = rotate(&orientation.conjugate(), momentum);
        rotate(orientation, &body.component_div(&self.inertia))
    }

    /// Kick with `force` (N) and `torque` (about the center of mass, N·m) over the time `kick` (s), then drift by `dt` (s);
    /// members follow.
    ///
    /// The angular momentum is kicked in world axes. The orientation advances by the midpoint rule on the angular velocity
    /// (implicit in the midpoint orientation, three fixed-point iterations): second order, exact in momentum.
    pub fn advance(&mut self, force: &Vec3, torque: &Vec3, dt: f64, kick: f64, particles: &mut Particles) {
        let mut force = *force;
        let mut torque = *torque;
        for axis in 0..3 {
            if self.constraint.translation(axis) {
                force[axis] = 0.0;
            }
            if self.constraint.rotation(axis) {
                torque[axis] = 0.0;
            }
        }
        self.velocity += force * (kick / self.mass);
        self.angular_momentum += torque * kick;
        self.position += self.velocity * dt;
        let mut middle = self.orientation;
        let mut angular_velocity = self.angular_velocity(&self.angular_momentum, &middle);
        for _ in 0..3 {
            middle = normalized(&(quaternion_of_rotation_vector(&(angular_velocity * (0.5 * dt))) * self.orientation));
            angular_velocity = self.angular_velocity(&self.angular_momentum, &middle);
        }
        let increment = quaternion_of_rotation_vector(&(angular_velocity * dt));
        self.orientation = normalized(&(increment * self.orientation));
        self.place_members(particles, &angular_velocity, &increment);
    }

    /// Set positions and motions of the members from those of the body.
    pub fn place_members(&self, particles: &mut Particles, angular_velocity: &Vec3, increment: &Quat) {
        for ((&m, offset), relative) in self.members.iter().zip(&self.offsets).zip(&self.orientations) {
            let m = m as usize;
            let arm = rotate(&self.orientation, offset);
            particles.position[m] = self.position + arm;
            particles.velocity[m] = self.velocity + angular_velocity.cross(&arm);
            particles.angular_velocity[m] = *angular_velocity;
            particles.rotation_increment[m] = *increment;
            particles.orientation[m] = normalized(&(self.orientation * relative));
        }
    }

    /// Smallest ratio of the body's mass and principal moments to the sums over its members.
    pub fn mass_fraction(&self, particles: &Particles) -> f64 {
        let (mut mass, mut moments) = (0.0, Vec3::zeros());
        for (&m, offset) in self.members.iter().zip(&self.offsets) {
            let (own, inertia) = (particles.mass[m as usize], particles.inertia[m as usize]);
            mass += own;
            moments += offset.map(|x| inertia + own * (offset.norm_squared() - x * x));
        }
        (self.mass / mass).min(self.inertia.component_div(&moments).min())
    }

    /// Rotational energy `½ L·ω`, J.
    pub fn rotational_energy(&self) -> f64 {
        0.5 * self.angular_momentum.dot(&self.angular_velocity(&self.angular_momentum, &self.orientation))
    }
}

/// Principal moments in ascending order and axes (columns, right-handed) of a symmetric tensor, by cyclic Jacobi rotations
/// with processor-independent arithmetic.
fn principal_axes(tensor: &Mat3) -> (Vec3, Mat3) {
    let mut a = *tensor;
    let mut v = Mat3::identity();
    for _ in 0..30 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[(p, q)].abs() <= f64::EPSILON * 1e-2 * a.diagonal().abs().max() {
                continue;
            }
            let theta = (a[(q, q)] - a[(p, p)]) / (2.0 * a[(p, q)]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            let mut j = Mat3::identity();
            j[(p, p)] = c;
            j[(q, q)] = c;
            j[(p, q)] = s;
            j[(q, p)] = -s;
            a = j.transpose() * a * j;
            v *= j;
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&p, &q| a[(p, p)].total_cmp(&a[(q, q)]));
    let mut axes = Mat3::from_columns(&order.map(|k| v.column(k).into_owned()));
    if axes.determinant() < 0.0 {
        let flipped = -axes.column(2);
        axes.set_column(2, &flipped);
    }
    (Vec3::from(order.map(|k| a[(k, k)])), axes)
}

/// Unit quaternion of a rotation matrix with the body axes in world coordinates as columns.
fn quaternion_of_axes(m: &Mat3) -> Quat {
    let trace = m.trace();
    let q = if trace > 0.0 {
        let s = (trace + 1.0).sqrt() * 2.0;
        Quat::new(0.25 * s, (m[(2, 1)] - m[(1, 2)]) / s, (m[(0, 2)] - m[(2, 0)]) / s, (m[(1, 0)] - m[(0, 1)]) / s)
    } else {
        let i = if m[(0, 0)] >= m[(1, 1)] && m[(0, 0)] >= m[(2, 2)] {
            0
        } else if m[(1, 1)] >= m[(2, 2)] {
            1
        } else {
            2
        };
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let s = (1.0 + m[(i, i)] - m[(j, j)] - m[(k, k)]).sqrt() * 2.0;
        let mut imaginary = Vec3::zeros();
        imaginary[i] = 0.25 * s;
        imaginary[j] = (m[(i, j)] + m[(j, i)]) / s;
        imaginary[k] = (m[(i, k)] + m[(k, i)]) / s;
        Quat::from_parts((m[(k, j)] - m[(j, k)]) / s, imaginary)
    };
    normalized(&q)
}
