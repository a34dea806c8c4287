//! Mean deformation of the middle of a specimen by least squares, and size of a specimen from sets of particles.

use nalgebra::{SMatrix, SVector};

use concordem_contact::math::{Mat3, Vec3};
use concordem_solver::state::Sphere;

/// Mean deformation of a slender specimen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deformation {
    /// Strain along the axis, 1.
    pub axial: f64,
    /// Lateral strain (mean of both directions), 1.
    pub lateral: f64,
    /// Twist per length, rad/m.
    pub twist: f64,
    /// Curvature about the first and second lateral direction, 1/m.
    pub curvature: [f64; 2],
    /// Root mean square residual of the fit, m.
    pub scatter: f64,
}

/// Number of fitted fields: three translations, three rotations, axial and lateral strain, twist, and for each plane
/// of bending the deflection and the lateral strain caused by it.
const FIELDS: usize = 13;

/// Fits uniform tension, torsion, and bending along `axis` to displacements `u` (m) at positions `x` (m). The neutral
/// lines pass through the mean position. `None` if there are too few particles, or their positions do not determine the fit.
pub fn fit(x: &[Vec3], u: &[Vec3], axis: usize) -> Option<Deformation> {
    let (a, b, c) = (axis, (axis + 1) % 3, (axis + 2) % 3);
    let count = x.len() as f64;
    let mean = x.iter().sum::<Vec3>() / count;
    // Scale lengths to order 1, so that the normal equations are well conditioned.
    let size = (x.iter().map(|x| (x - mean).norm_squared()).sum::<f64>() / count).sqrt();
    if size.is_nan() || size <= 0.0 {
        return None;
    }
    let fields = |x: &Vec3| -> [Vec3; FIELDS] {
        let r = (x - mean) / size;
        let (p, q, s) = (r[a], r[b], r[c]);
        let at = |along: f64, first: f64, second: f64| {
            let mut v = Vec3::zeros();
            (v[a], v[b], v[c]) = (along, first, second);
            v
        };
        [
            at(1.0, 0.0, 0.0),
            at(0.0, 1.0, 0.0),
            at(0.0, 0.0, 1.0),
            at(0.0, -s, q),
            at(s, 0.0, -p),
            at(-q, p, 0.0),
            at(p, 0.0, 0.0),
            at(0.0, q, s),
            at(0.0, -p * s, p * q),
            // Curvature about the first direction across: the beam bends towards the second.
            at(p * s, 0.0, -0.5 * p * p),
            at(0.0, q * s, 0.5 * (s * s - q * q)),
            at(-p * q, 0.5 * p * p, 0.0),
            at(0.0, 0.5 * (q * q - s * s), q * s),
        ]
    };
    let mut matrix = SMatrix::<f64, FIELDS, FIELDS>::zeros();
    let mut right = SVector::<f64, FIELDS>::zeros();
    for (x, u) in x.iter().zip(u) {
        let fields = fields(x);
        for i in 0..FIELDS {
            right[i] += fields[i].dot(u);
            for j in 0..FIELDS {
                matrix[(i, j)] += fields[i].dot(&fields[j]);
            }
        }
    }
    let solution = matrix.cholesky()?.solve(&right);
    let left: f64 = x
        .iter()
        .zip(u)
        .map(|(x, u)| {
            let fitted: Vec3 = fields(x).iter().zip(solution.iter()).map(|(field, s)| field * *s).sum();
            (u - fitted).norm_squared()
        })
        .sum();
    Some(Deformation {
        axial: solution[6] / size,
        lateral: solution[7] / size,
        twist: solution[8] / (size * size),
        curvature: [solution[9] / (size * size), solution[11] / (size * size)],
        scatter: (left / count).sqrt(),
    })
}

/// Length and radius of a cylinder of spheres, measured from sets of particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CylinderSize {
    /// Length, m.
    pub length: f64,
    /// Radius, m.
    pub radius: f64,
}

/// Bounding size of a cylinder, [2.20]–[2.21] of Jebahi et al. 2015 with the sign of the former corrected: `L = 2R̄ +
/// (mean of the upper − mean of the lower end)·X`, `R_M = R̄ + mean distance of the surface set from the axis`. With
/// `centers_only` the terms with the mean radius `R̄` are omitted, which gives the section spanned by the centers,
/// which the bonds connect. Sets are indices into `spheres`; the axis passes through the mean position of the surface
/// set.
pub fn cylinder_size(spheres: &[Sphere], axis: usize, sets: [&[usize]; 3], centers_only: bool) -> Option<CylinderSize> {
    let [lower, upper, surface] = sets;
    if spheres.is_empty() || lower.is_empty() || upper.is_empty() || surface.is_empty() {
        return None;
    }
    let mean = |set: &[usize]| set.iter().map(|&p| spheres[p].position).sum::<Vec3>() / set.len() as f64;
    let mean_radius = spheres.iter().map(|s| s.radius).sum::<f64>() / spheres.len() as f64;
    let border = if centers_only { 0.0 } else { mean_radius };
    let center = mean(surface);
    let mut across = Mat3::identity();
    across[(axis, axis)] = 0.0;
    let distance = surface.iter().map(|&p| (across * (spheres[p].position - center)).norm()).sum::<f64>();
    Some(CylinderSize {
        length: 2.0 * border + mean(upper)[axis] - mean(lower)[axis],
        radius: border + distance / surface.len() as f64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use concordem_packing::Random;

    /// The fit recovers known fields at random positions, to 1e-10 from well-conditioned normal equations.
    #[test]
    fn the_fit_recovers_known_deformations() {
        let mut random = Random::new(3);
        let x: Vec<Vec3> = (0..500)
            .map(|_| {
                let r = random.uniform_vector();
                Vec3::new(0.1 * r.x, 0.03 * (r.y - 0.5), 0.03 * (r.z - 0.5))
            })
            .collect();
        let mean = x.iter().sum::<Vec3>() / 500.0;
        let (axial, nu, twist, about_y, about_z) = (1e-4, 0.2, 2e-2, 3e-3, -4e-3);
        let u: Vec<Vec3> = x
            .iter()
            .map(|x| {
                let r = x - mean;
                let stretch = Vec3::new(r.x, -nu * r.y, -nu * r.z) * axial;
                let turn = Vec3::new(0.0, -r.x * r.z, r.x * r.y) * twist;
                // Pure bending of an elastic bar, Timoshenko & Goodier.
                let z_bend =
                    Vec3::new(-r.x * r.y, 0.5 * (r.x * r.x + nu * (r.y * r.y - r.z * r.z)), nu * r.y * r.z) * about_z;
                let y_bend =
                    Vec3::new(r.x * r.z, -nu * r.y * r.z, -0.5 * (r.x * r.x + nu * (r.z * r.z - r.y * r.y))) * about_y;
                let rigid = Vec3::new(1e-3, 2e-3, 3e-3) + Vec3::new(1e-3, -1e-3, 2e-3).cross(x);
                stretch + turn + z_bend + y_bend + rigid
            })
            .collect();
        let found = fit(&x, &u, 0).unwrap();
        let near = |a: f64, b: f64| (a - b).abs() < 1e-10 * b.abs();
        assert!(near(found.axial, axial) && near(found.lateral, -nu * axial), "{found:?}");
        assert!(near(found.twist, twist), "{found:?}");
        assert!(near(found.curvature[0], about_y) && near(found.curvature[1], about_z), "{found:?}");
        assert!(found.scatter < 1e-15, "{found:?}");
        assert_eq!(fit(&x[..2], &u[..2], 0), None);
    }

    /// Length and radius of a cylinder from the spheres on its surface and ends, with and without the sphere radius.
    #[test]
    fn the_size_of_a_cylinder_follows_from_its_spheres() {
        let mut spheres = Vec::new();
        for layer in 0..11 {
            for k in 0..12 {
                let (s, c) = (f64::from(k) * std::f64::consts::PI / 6.0).sin_cos();
                let position = Vec3::new(0.2 * f64::from(layer), 3.0 + 0.5 * c, 0.5 * s - 1.0);
                spheres.push(Sphere { position, radius: 0.1 });
            }
        }
        let (lower, upper): (Vec<usize>, Vec<usize>) = ((0..12).collect(), (120..132).collect());
        let surface: Vec<usize> = (0..132).collect();
        let size = |only| cylinder_size(&spheres, 0, [&lower, &upper, &surface], only).unwrap();
        // A dozen roundings of numbers near 1.
        assert!((size(false).length - 2.2).abs() < 1e-14 && (size(false).radius - 0.6).abs() < 1e-14);
        assert!((size(true).length - 2.0).abs() < 1e-14 && (size(true).radius - 0.5).abs() < 1e-14);
        assert_eq!(cylinder_size(&spheres, 0, [&lower, &[], &surface], true), None);
    }
}
