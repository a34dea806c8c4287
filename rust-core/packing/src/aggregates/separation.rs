//! Are two convex bodies apart?

use super::{Form, Inclusion};
use concordem_contact::math::Vec3;

/// Iterations after which two bodies count as too near each other. Polyhedra need a dozen, ellipsoids a few dozen.
const MOST: usize = 100;

/// Whether two bodies, the second one moved by `shift` (m), are at least `gap` (m) apart. Meshes count with their convex hulls.
///
/// Exact for spheres. Otherwise the algorithm of Gilbert, Johnson and Keerthi (1988, IEEE J. Robot. Autom. 4, 193) with the
/// minimum-norm point of Wolfe (1976, Math. Program. 11, 128): `true` means that a direction was found along which the two lie
/// `gap` or more apart, so a `true` is certain up to rounding. Bodies that are apart by `gap` up to some digits, or so flat that
/// rounding spoils the search, may give `false`.
pub fn apart(a: &Inclusion, b: &Inclusion, shift: &Vec3, gap: f64) -> bool {
    let offset = b.center + shift - a.center;
    let distance = offset.norm();
    if distance >= a.reach() + b.reach() + gap {
        return true;
    }
    if matches!((&a.form, &b.form), (Form::Sphere, Form::Sphere)) || distance == 0.0 {
        return false;
    }
    // The point of b − a that lies farthest in a direction; the bodies are apart if the difference does not reach the origin.
    let farthest = |direction: &Vec3| b.support(direction) + shift - a.support(&-direction);
    let mut points = vec![farthest(&-offset)];
    let mut weights = vec![1.0];
    let mut nearest = points[0];
    for _ in 0..MOST {
        let length = nearest.norm();
        let new = farthest(&-nearest);
        let bound = nearest.dot(&new) / length;
        // NaN, of a nearest point at the origin, is not apart.
        if bound >= gap && bound > 0.0 {
            return true;
        }
        // The distance is at most the length, and at least the bound.
        let converged = length - bound <= 1e-9 * length;
        if length.is_nan() || length < gap || converged || points.contains(&new) || length == 0.0 {
            return false;
        }
        points.push(new);
        weights.push(0.0);
        match nearest_of(&mut points, &mut weights) {
            Some(point) => nearest = point,
            None => return false,
        }
    }
    false
}

/// The point nearest to the origin of the convex hull of at most four points; removes the points that it does not need. `None` if
/// the hull contains the origin, or is too flat to tell.
fn nearest_of(points: &mut Vec<Vec3>, weights: &mut Vec<f64>) -> Option<Vec3> {
    loop {
        let affine = affine_nearest(points)?;
        if affine.iter().all(|&weight| weight > 0.0) {
            if points.len() == 4 {
                return None;
            }
            *weights = affine;
            return Some(points.iter().zip(weights.iter()).map(|(point, weight)| point * *weight).sum());
        }
        // Move toward the nearest point of the plane (or line) until a weight vanishes.
        let mut step = 1.0_f64;
        let mut leaves = 0;
        for (k, (&old, &new)) in weights.iter().zip(&affine).enumerate() {
            if new <= 0.0 {
                let limit = if old > new { old / (old - new) } else { 0.0 };
                if limit < step {
                    (step, leaves) = (limit, k);
                } else if step == 1.0 {
                    leaves = k;
                }
            }
        }
        for (weight, new) in weights.iter_mut().zip(&affine) {
            *weight += step * (new - *weight);
        }
        points.remove(leaves);
        weights.remove(leaves);
        if points.is_empty() {
            return None;
        }
    }
}

/// Weights, with the sum 1, of the point nearest to the origin of the affine hull of at most four points; `None` if they are not
/// affinely independent.
fn affine_nearest(points: &[Vec3]) -> Option<Vec<f64>> {
    let base = points[0];
    let edges: Vec<Vec3> = points[1..].iter().map(|point| point - base).collect();
    let product = |i: usize, j: usize| edges[i].dot(&edges[j]);
    let right = |i: usize| -edges[i].dot(&base);
    let mut weights = match edges.len() {
        0 => vec![],
        1 => vec![right(0) / product(0, 0)],
        2 => {
            let (a, b, c) = (product(0, 0), product(0, 1), product(1, 1));
            let determinant = a * c - b * b;
            if determinant <= 1e-14 * a * c {
                return None;
            }
            vec![(right(0) * c - right(1) * b) / determinant, (right(1) * a - right(0) * b) / determinant]
        }
        3 => {
            // Three edges that span space: the nearest point is the origin itself.
            let volume = edges[0].cross(&edges[1]).dot(&edges[2]);
            if volume.abs() <= 1e-10 * edges[0].norm() * edges[1].norm() * edges[2].norm() {
                return None;
            }
            let part = |u: &Vec3, v: &Vec3| -base.dot(&u.cross(v)) / volume;
            vec![part(&edges[1], &edges[2]), part(&edges[2], &edges[0]), part(&edges[0], &edges[1])]
        }
        _ => return None,
    };
    weights.insert(0, 1.0 - weights.iter().sum::<f64>());
    weights.iter().all(|weight| weight.is_finite()).then_some(weights)
}
