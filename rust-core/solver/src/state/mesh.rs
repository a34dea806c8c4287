//! A surface of triangles whose vertices move on their own: prescribed in time, or by a host such as a finite element code.
//!
//! Inside a triangle all is linear: the point with the barycentric weights `w_i` of the vertices `x_i` is `x = Σ w_i x_i`, and its
//! velocity `v = Σ w_i v_i`. A force `f` of a particle at that point goes to the vertices as `f_i = w_i f`. Since `Σ w_i = 1` and
//! `Σ w_i x_i = x`, force and moment about any point are those of `f`, and so is the power, `Σ f_i·v_i = f·v`. On an edge or a corner
//! the weights of the triangles that meet there agree, so the forces on the vertices do not jump when the point passes.
//!
//! A moment `M`, as laws with rolling resistance have, becomes the forces `f_i = θ⁻¹M × r_i` with `r_i = x_i − x̄` and
//! `θ = Σ (r_i·r_i 1 − r_i⊗r_i)`: those of smallest size with the sum zero and the moment M.

use concordem_contact::math::{Mat3, Quat, Vec3};

use super::triangle::closest_on_triangle;

/// Height of a triangle over its longest side, relative to that side, below which the triangle has no area. Below it, the rounding
/// of the vertices turns the normal by more than 1e-7.
const DEGENERATE: f64 = 1e-9;

/// Why triangles are no surface.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// There is no triangle.
    #[error("the mesh has no triangle")]
    Empty,
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex}, but there are only {count}; they are counted from 0")]
    Index {
        /// Triangle.
        triangle: usize,
        /// Vertex.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A triangle has no area.
    #[error(
        "triangle {triangle} has no area: its corners lie on one line, or coincide; remove it, or move its vertices"
    )]
    Degenerate {
        /// Triangle.
        triangle: usize,
    },
    /// A vertex that no triangle names.
    #[error("vertex {vertex} belongs to no triangle; remove it")]
    Unused {
        /// Vertex.
        vertex: usize,
    },
    /// A coordinate or velocity that is no number.
    #[error("the {what} of vertex {vertex} is not finite")]
    NotFinite {
        /// Position or velocity.
        what: &'static str,
        /// Vertex.
        vertex: usize,
    },
    /// The number of rows does not fit.
    #[error("{given} {what} for the {count} vertices of the mesh; give one row per vertex")]
    Count {
        /// Positions or velocities.
        what: &'static str,
        /// Rows given.
        given: usize,
        /// Vertices.
        count: usize,
    },
}

/// A surface of triangles with moving vertices.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Present positions of the vertices, m.
    pub position: Vec<Vec3>,
    /// Velocities of the vertices in the coming step, m/s.
    pub velocity: Vec<Vec3>,
    /// Velocities of the vertices in the last step, with which they came to their positions, m/s. The laws see them.
    pub previous_velocity: Vec<Vec3>,
    /// Forces of the particles on the vertices in the last step, N.
    pub force: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// A mesh at rest.
    ///
    /// # Errors
    /// Triangles without area, vertices that do not exist, that no triangle names, or that are not finite.
    pub fn new(position: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        if triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        let count = position.len();
        let mut used = vec![false; count];
        for (triangle, corners) in triangles.iter().enumerate() {
            for &vertex in corners {
                *used.get_mut(vertex as usize).ok_or(MeshError::Index { triangle, vertex, count })? = true;
            }
        }
        if let Some(vertex) = used.iter().position(|used| !used) {
            return Err(MeshError::Unused { vertex });
        }
        let zero = vec![Vec3::zeros(); count];
        let mesh = Self { position, velocity: zero.clone(), previous_velocity: zero.clone(), force: zero, triangles };
        mesh.check()?;
        Ok(mesh)
    }

    /// Vertices of the triangles.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Corners of a triangle, m.
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|vertex| self.position[vertex as usize])
    }

    /// Unit normal of a triangle.
    pub fn normal(&self, triangle: usize) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(&(c - a)).normalize()
    }

    /// Whether all positions are finite and all triangles have an area.
    ///
    /// # Errors
    /// The first one that is not.
    pub fn check(&self) -> Result<(), MeshError> {
        finite("position", &self.position)?;
        let degenerate = |triangle: &usize| {
            let [a, b, c] = self.corners(*triangle);
            let longest = [b - a, c - b, a - c].iter().map(Vec3::norm_squared).fold(0.0, f64::max);
            let twice_area = (b - a).cross(&(c - a)).norm();
            // Not a number counts as degenerate: coordinates whose squares overflow.
            twice_area.partial_cmp(&(DEGENERATE * longest)) != Some(std::cmp::Ordering::Greater)
        };
        match (0..self.triangles.len()).find(degenerate) {
            Some(triangle) => Err(MeshError::Degenerate { triangle }),
            None => Ok(()),
        }
    }

    /// From now on, the vertices move with these velocities, m/s.
    ///
    /// # Errors
    /// A wrong number of rows; numbers that are not finite.
    pub fn drive(&mut self, velocity: &[Vec3]) -> Result<(), MeshError> {
        self.rows("velocities", velocity)?;
        finite("velocity", velocity)?;
        self.velocity.copy_from_slice(velocity);
        Ok(())
    }

    /// Place the vertices (m) where they came with these velocities (m/s) in the last step; they rest there until told otherwise.
    /// Returns the work of the vertices on the particles over the half step after the last forces, J.
    ///
    /// # Errors
    /// A wrong number of rows; numbers that are not finite; triangles without area. The mesh then stays as it was.
    pub fn place(&mut self, position: &[Vec3], velocity: &[Vec3], dt: f64) -> Result<f64, MeshError> {
        self.rows("positions", position)?;
        self.rows("velocities", velocity)?;
        finite("velocity", velocity)?;
        let old = std::mem::replace(&mut self.position, position.to_vec());
        if let Err(error) = self.check() {
            self.position = old;
            return Err(error);
        }
        self.previous_velocity.copy_from_slice(velocity);
        self.velocity.fill(Vec3::zeros());
        Ok(half_work(&self.force, velocity, dt))
    }

    fn rows(&self, what: &'static str, rows: &[Vec3]) -> Result<(), MeshError> {
        let (given, count) = (rows.len(), self.position.len());
        if given == count { Ok(()) } else { Err(MeshError::Count { what, given, count }) }
    }

    /// Barycentric weights of the point of a triangle that is closest to `x` (m).
    pub fn weights(&self, triangle: usize, x: &Vec3) -> [f64; 3] {
        closest_on_triangle(x, &self.corners(triangle)).2
    }

    /// Velocity of the point of a triangle with these weights in the last step, m/s.
    pub fn velocity_at(&self, triangle: usize, weights: &[f64; 3]) -> Vec3 {
        let vertices = self.triangles[triangle];
        (0..3).map(|i| self.previous_velocity[vertices[i] as usize] * weights[i]).sum()
    }

    /// Rotation of a triangle in the last step, of `dt` (s): that of its normal, then that in its plane (the rotation of the polar
    /// decomposition).
    pub fn rotation(&self, triangle: usize, dt: f64) -> Quat {
        let vertices = self.triangles[triangle];
        let now = self.corners(triangle);
        let before: [Vec3; 3] = std::array::from_fn(|i| now[i] - self.previous_velocity[vertices[i] as usize] * dt);
        let edges = |x: &[Vec3; 3]| [x[1] - x[0], x[2] - x[0]];
        let ([e, f], [e_old, f_old]) = (edges(&now), edges(&before));
        let (normal, normal_old) = (e.cross(&f).normalize(), e_old.cross(&f_old).normalize());
        let swing = quaternion(1.0 + normal_old.dot(&normal), &normal_old.cross(&normal));
        // A triangle that collapsed or turned over has no rotation; `check` finds it.
        let length = swing.norm();
        if length.partial_cmp(&f64::MIN_POSITIVE) != Some(std::cmp::Ordering::Greater) {
            return Quat::identity();
        }
        let swing = swing / length;
        let turned = |v: &Vec3| {
            let (w, u) = (swing.w, swing.imag());
            let t = u.cross(v) * 2.0;
            v + t * w + u.cross(&t)
        };
        let (u, w) = (turned(&e_old), turned(&f_old));
        // Trace and skew part of the deformation in the plane, times its old area.
        let trace = normal.dot(&(e.cross(&w) + u.cross(&f)));
        let skew = e.dot(&w) - f.dot(&u);
        let size = trace.hypot(skew);
        let twist = quaternion(size + trace, &(normal * skew));
        let length = twist.norm();
        if length.partial_cmp(&f64::MIN_POSITIVE) != Some(std::cmp::Ordering::Greater) {
            return swing;
        }
        (twist / length) * swing
    }

    /// Add a force (N) at the point of a triangle with these weights, and a moment (N·m), to the vertices.
    pub fn add_force(&mut self, triangle: usize, weights: &[f64; 3], force: &Vec3, moment: Option<&Vec3>) {
        let vertices = self.triangles[triangle].map(|vertex| vertex as usize);
        for (vertex, weight) in vertices.into_iter().zip(weights) {
            self.force[vertex] += force * *weight;
        }
        let Some(moment) = moment.filter(|moment| **moment != Vec3::zeros()) else { return };
        let corners = self.corners(triangle);
        let center = (corners[0] + corners[1] + corners[2]) / 3.0;
        let arms = corners.map(|corner| corner - center);
        let inertia: Mat3 = arms.iter().map(|r| Mat3::identity() * r.norm_squared() - r * r.transpose()).sum();
        // Triangles have an area, so their corners resist all rotations.
        let Some(inverse) = inertia.try_inverse() else { return };
        let spin = inverse * moment;
        for (vertex, arm) in vertices.into_iter().zip(&arms) {
            self.force[vertex] += spin.cross(arm);
        }
    }

    /// Move the vertices by one step. Returns their work on the particles over the half steps before and after the present instant, J.
    pub fn drift(&mut self, dt: f64) -> [f64; 2] {
        let work = [half_work(&self.force, &self.previous_velocity, dt), half_work(&self.force, &self.velocity, dt)];
        for (x, v) in self.position.iter_mut().zip(&self.velocity) {
            *x += v * dt;
        }
        self.previous_velocity.copy_from_slice(&self.velocity);
        work
    }

    /// Largest speed of a vertex in the last and the coming step, m/s, and that vertex.
    pub fn fastest(&self) -> (f64, usize) {
        let speeds = self.velocity.iter().zip(&self.previous_velocity).map(|(v, u)| v.norm().max(u.norm()));
        speeds.enumerate().fold((0.0, 0), |(most, at), (k, speed)| if speed > most { (speed, k) } else { (most, at) })
    }
}

fn quaternion(real: f64, imaginary: &Vec3) -> Quat {
    Quat::new(real, imaginary.x, imaginary.y, imaginary.z)
}

fn half_work(force: &[Vec3], velocity: &[Vec3], dt: f64) -> f64 {
    -0.5 * dt * force.iter().zip(velocity).map(|(f, v)| f.dot(v)).sum::<f64>()
}

fn finite(what: &'static str, rows: &[Vec3]) -> Result<(), MeshError> {
    match rows.iter().position(|row| !row.iter().all(|c| c.is_finite())) {
        Some(vertex) => Err(MeshError::NotFinite { what, vertex }),
        None => Ok(()),
    }
}
