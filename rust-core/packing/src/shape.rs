//! Bodies to which packings are cropped.

mod mesh;

pub use mesh::Mesh;

use super::{PackingError, positive};
use concordem_contact::math::Vec3;

/// A body with an interior.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Shape {
    /// Box with edges along the axes.
    Box {
        /// Corner of least coordinates, m.
        low: Vec3,
        /// Opposite corner, m.
        high: Vec3,
    },
    /// Cylinder between two circles.
    Cylinder {
        /// Center of one end, m.
        base: Vec3,
        /// Center of the other end, m.
        top: Vec3,
        /// Radius, m.
        radius: f64,
    },
    /// Hyperboloid of revolution, thinnest half-way between its two ends.
    Hyperboloid {
        /// Center of one end, m.
        base: Vec3,
        /// Center of the other end, m.
        top: Vec3,
        /// Radius at both ends, m.
        end_radius: f64,
        /// Radius half-way, m; not above `end_radius`.
        waist_radius: f64,
    },
    /// Ball.
    Sphere {
        /// Center, m.
        center: Vec3,
        /// Radius, m.
        radius: f64,
    },
    /// Interior of a closed triangle mesh.
    Mesh(Mesh),
}

fn finite(name: &str, values: &Vec3) -> Result<(), PackingError> {
    if values.iter().all(|v| v.is_finite()) {
        return Ok(());
    }
    let reason = format!("{name} is ({}, {}, {}), which is not finite", values.x, values.y, values.z);
    Err(PackingError::BadShape { reason })
}

fn apart(base: &Vec3, top: &Vec3) -> Result<(), PackingError> {
    finite("the center of an end", base)?;
    finite("the center of an end", top)?;
    positive("the distance between the ends of the shape", (top - base).norm()).map(|_| ())
}

impl Shape {
    /// A box from its two extreme corners, m.
    ///
    /// # Errors
    /// Corners that are not finite, or a box without volume.
    pub fn new_box(low: Vec3, high: Vec3) -> Result<Self, PackingError> {
        finite("a corner of the box", &low)?;
        finite("a corner of the box", &high)?;
        for axis in 0..3 {
            positive("an edge of the box", high[axis] - low[axis])?;
        }
        Ok(Self::Box { low, high })
    }

    /// A cylinder from the centers of its ends and its radius, m.
    ///
    /// # Errors
    /// Ends that are not finite or coincide, or a radius that is not positive.
    pub fn new_cylinder(base: Vec3, top: Vec3, radius: f64) -> Result<Self, PackingError> {
        apart(&base, &top)?;
        positive("the radius of the cylinder", radius)?;
        Ok(Self::Cylinder { base, top, radius })
    }

    /// A hyperboloid from the centers of its ends, their radius, and the radius half-way, m.
    ///
    /// # Errors
    /// Ends that are not finite or coincide, radii that are not positive, or a waist wider than the ends.
    pub fn new_hyperboloid(base: Vec3, top: Vec3, end_radius: f64, waist_radius: f64) -> Result<Self, PackingError> {
        apart(&base, &top)?;
        positive("the end radius of the hyperboloid", end_radius)?;
        positive("the waist radius of the hyperboloid", waist_radius)?;
        super::within("the waist radius of the hyperboloid", waist_radius, 0.0, end_radius)?;
        Ok(Self::Hyperboloid { base, top, end_radius, waist_radius })
    }

    /// A ball from its center and radius, m.
    ///
    /// # Errors
    /// A center that is not finite, or a radius that is not positive.
    pub fn new_sphere(center: Vec3, radius: f64) -> Result<Self, PackingError> {
        finite("the center of the sphere", &center)?;
        positive("the radius of the sphere", radius)?;
        Ok(Self::Sphere { center, radius })
    }

    /// Whether a point (m) lies inside, at least `margin` (m) away from the surface. With the radius of a sphere as margin:
    /// whether the whole sphere lies inside. With a negative margin, points outside count as inside up to this distance,
    /// which is measured along the axes of a box, and along and across the axis of a body of revolution.
    pub fn contains(&self, point: &Vec3, margin: f64) -> bool {
        match self {
            Self::Box { low, high } => (point - low).min().min((high - point).min()) >= margin,
            Self::Cylinder { base, top, radius } => {
                let (height, axial, radial) = meridian(base, top, point);
                axial.min(height - axial).min(radius - radial) >= margin
            }
            Self::Hyperboloid { base, top, end_radius, waist_radius } => {
                let (height, axial, radial) = meridian(base, top, point);
                axial.min(height - axial) >= margin
                    && inside_hyperbola(
                        *waist_radius,
                        *end_radius,
                        0.5 * height,
                        radial,
                        (axial - 0.5 * height).abs(),
                        margin,
                    )
            }
            Self::Sphere { center, radius } => radius - (point - center).norm() >= margin,
            Self::Mesh(mesh) => mesh.contains(point, margin),
        }
    }

    /// Volume, m³. That of a hyperboloid with the radius `a` at the waist and `R` at the ends, and the height `h`, is
    /// `π h (2a² + R²)/3`.
    ///
    /// # Errors
    /// A mesh whose triangles have no common orientation.
    pub fn volume(&self) -> Result<f64, PackingError> {
        use std::f64::consts::PI;
        Ok(match self {
            Self::Box { low, high } => (high - low).product(),
            Self::Cylinder { base, top, radius } => PI * radius * radius * (top - base).norm(),
            Self::Hyperboloid { base, top, end_radius, waist_radius } => {
                let squares = 2.0 * waist_radius * waist_radius + end_radius * end_radius;
                PI * (top - base).norm() * squares / 3.0
            }
            Self::Sphere { radius, .. } => 4.0 / 3.0 * PI * radius * radius * radius,
            Self::Mesh(mesh) => mesh.volume()?,
        })
    }

    /// Corners of the bounding box of the shape, m.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        match self {
            Self::Box { low, high } => (*low, *high),
            Self::Cylinder { base, top, radius: end_radius } | Self::Hyperboloid { base, top, end_radius, .. } => {
                let axis = (top - base).normalize();
                // Half-width of a disc normal to the axis.
                let half = axis.map(|c| end_radius * (1.0 - c * c).max(0.0).sqrt());
                (base.inf(top) - half, base.sup(top) + half)
            }
            Self::Sphere { center, radius } => (center.add_scalar(-radius), center.add_scalar(*radius)),
            Self::Mesh(mesh) => mesh.bounds(),
        }
    }
}

/// Distance of the ends, and position of a point along and away from the axis, m.
fn meridian(base: &Vec3, top: &Vec3, point: &Vec3) -> (f64, f64, f64) {
    let height = (top - base).norm();
    let axis = (top - base) / height;
    let offset = point - base;
    let axial = offset.dot(&axis);
    (height, axial, (offset - axis * axial).norm())
}

/// Whether the point at radius `rho` and height `z ≥ 0` above the waist lies within the hyperbola
/// `x(ζ) = a √(1 + ζ²/c²)`, through `(a, 0)` and `(end, half_height)`, by `margin` or more; for a negative margin, whether
/// it lies outside by at most `-margin` across the axis.
///
/// The outside of the hyperboloid, `x ≥ x(ζ)`, is convex in the meridian plane, so its nearest point is unique. It is
/// where `(x(ζ) − ρ) x'(ζ) + ζ − z`, half the derivative of the squared distance, changes sign in [0, z]; bisection
/// locates it to the last digit.
fn inside_hyperbola(a: f64, end: f64, half_height: f64, rho: f64, z: f64, margin: f64) -> bool {
    // 1/c², from x(half_height) = end; zero for a cylinder.
    let inverse_c2 = (end / a - 1.0) * (end / a + 1.0) / (half_height * half_height);
    let surface = |zeta: f64| a * (1.0 + zeta * zeta * inverse_c2).sqrt();
    let outside = rho - surface(z);
    if outside > 0.0 || margin <= 0.0 {
        return outside <= -margin;
    }
    let (mut low, mut high) = (0.0, z);
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        let x = surface(middle);
        if (x - rho) * (a * a * inverse_c2 * middle / x) + middle - z > 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    let (dx, dz) = (surface(low) - rho, low - z);
    dx * dx + dz * dz >= margin * margin
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Random;

    #[test]
    fn spheres_inside_do_not_stick_out() {
        // Every accepted sphere, sampled on its surface, lies inside. Some rejected spheres with the center inside do
        // stick out, so the margin is not simply too large.
        let shapes = [
            Shape::new_box(Vec3::new(-1.0, -0.5, 0.0), Vec3::new(1.0, 0.5, 2.0)).unwrap(),
            Shape::new_cylinder(Vec3::new(-0.5, 0.2, 0.1), Vec3::new(0.6, 0.7, 1.9), 0.6).unwrap(),
            Shape::new_hyperboloid(Vec3::new(0.0, -0.3, 0.0), Vec3::new(0.2, 0.3, 2.0), 1.0, 0.3).unwrap(),
            Shape::new_sphere(Vec3::new(0.1, 0.2, 0.9), 0.8).unwrap(),
        ];
        let mut random = Random::new(11);
        let directions: Vec<Vec3> = (0..2000)
            .map(|_| {
                loop {
                    let v = random.uniform_vector() * 2.0 - Vec3::repeat(1.0);
                    if v.norm() > 0.1 && v.norm() <= 1.0 {
                        break v.normalize();
                    }
                }
            })
            .collect();
        for shape in &shapes {
            let (low, high) = shape.bounds();
            let (mut accepted, mut confirmed) = (0, 0);
            for _ in 0..2000 {
                let point = low + random.uniform_vector().component_mul(&(high - low));
                let margin = 0.3 * random.uniform();
                // 1e-9: rounding of the sampled points.
                let fits = directions.iter().all(|d| shape.contains(&(point + d * margin * (1.0 - 1.0e-9)), 0.0));
                if shape.contains(&point, margin) {
                    assert!(fits, "{shape:?} {point:?} {margin}");
                    accepted += 1;
                } else if fits && shape.contains(&point, 0.0) {
                    // 2000 directions leave gaps of 5°: they miss 0.4 % of the radius at most.
                    assert!(!shape.contains(&point, margin * 1.001));
                    assert!(shape.contains(&point, margin * 0.99), "{shape:?} {point:?} {margin}");
                    confirmed += 1;
                }
            }
            assert!(accepted > 100 && confirmed < 30, "{shape:?}: {accepted} {confirmed}");
        }
    }

    #[test]
    fn volumes_by_counting() {
        let pi = std::f64::consts::PI;
        let z = Vec3::z() * 2.0;
        // ∫π a²(1 + ζ²/c²)dζ = 2π a² h (1 + h²/3c²) with h = 1, 1/c² = 1/0.09 − 1.
        let waist = 0.09;
        let cases = [
            (Shape::new_cylinder(Vec3::zeros(), z, 1.0).unwrap(), 2.0 * pi),
            (
                Shape::new_hyperboloid(Vec3::zeros(), z, 1.0, 0.3).unwrap(),
                2.0 * pi * waist * (1.0 + (1.0 / waist - 1.0) / 3.0),
            ),
            (Shape::new_hyperboloid(Vec3::zeros(), z, 1.0, 1.0).unwrap(), 2.0 * pi),
            (Shape::new_sphere(Vec3::zeros(), 1.0).unwrap(), 4.0 / 3.0 * pi),
        ];
        for (shape, volume) in cases {
            let (low, high) = shape.bounds();
            let size = high - low;
            let n = 60;
            let mut inside = 0;
            for i in 0..n {
                for j in 0..n {
                    for k in 0..n {
                        let place = Vec3::new(f64::from(i), f64::from(j), f64::from(k)).add_scalar(0.5) / f64::from(n);
                        inside += i32::from(shape.contains(&(low + place.component_mul(&size)), 0.0));
                    }
                }
            }
            let counted = f64::from(inside) / f64::from(n * n * n) * size.product();
            // Boxes cut by the surface are right or wrong by half their volume with alternating sign: 0.5 % is ample
            // for 60 per edge.
            approx::assert_relative_eq!(counted, volume, max_relative = 0.005);
            approx::assert_relative_eq!(shape.volume().unwrap(), volume, max_relative = 1e-14);
        }
    }

    #[test]
    fn invalid_parameters_are_refused() {
        let o = Vec3::zeros();
        assert!(Shape::new_box(Vec3::repeat(1.0), o).is_err());
        assert!(Shape::new_box(o, Vec3::repeat(f64::NAN)).is_err());
        assert!(Shape::new_cylinder(o, o, 1.0).is_err());
        assert!(Shape::new_cylinder(o, Vec3::z(), -1.0).is_err());
        assert!(Shape::new_hyperboloid(o, Vec3::z(), 1.0, 1.5).is_err());
        assert!(Shape::new_sphere(o, f64::INFINITY).is_err());
    }

    /// The box around an oblique cylinder touches its end circles: a circle with the normal `n` reaches `r √(1 − n_k²)` along axis k.
    #[test]
    fn oblique_cylinders_have_tight_bounds() {
        let (low, high) = Shape::new_cylinder(Vec3::zeros(), Vec3::new(3.0, 0.0, 4.0), 5.0).unwrap().bounds();
        let half = Vec3::new(4.0, 5.0, 3.0);
        // Rounding of numbers up to 5.
        assert!((low + half).amax() < 4e-15 && (high - Vec3::new(7.0, 5.0, 7.0)).amax() < 4e-15, "{low} {high}");
    }
}
