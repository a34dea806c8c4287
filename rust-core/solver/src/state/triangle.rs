//! The closest point of a triangle.

use concordem_contact::math::Vec3;

/// Closest point of a triangle, whether it lies inside the face, and its barycentric weights (Ericson 2005, §5.1.5: regions by the
/// signs of the barycentric coordinates).
pub(super) fn closest_on_triangle(x: &Vec3, [a, b, c]: &[Vec3; 3]) -> (Vec3, bool, [f64; 3]) {
    let (ab, ac, ax) = (b - a, c - a, x - a);
    let (d1, d2) = (ab.dot(&ax), ac.dot(&ax));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, false, [1.0, 0.0, 0.0]);
    }
    let bx = x - b;
    let (d3, d4) = (ab.dot(&bx), ac.dot(&bx));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, false, [0.0, 1.0, 0.0]);
    }
    let vc = d1 * d4 - d3 * d2;
    // Two equal corners a and b make no edge.
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3 {
        let t = d1 / (d1 - d3);
        return (a + ab * t, false, [1.0 - t, t, 0.0]);
    }
    let cx = x - c;
    let (d5, d6) = (ab.dot(&cx), ac.dot(&cx));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, false, [0.0, 0.0, 1.0]);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return (a + ac * t, false, [1.0 - t, 0.0, t]);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return (b + (c - b) * t, false, [0.0, 1.0 - t, t]);
    }
    let denominator = 1.0 / (va + vb + vc);
    let (v, w) = (vb * denominator, vc * denominator);
    (a + ab * v + ac * w, true, [1.0 - v - w, v, w])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles with equal corners are edges or points; the same distance in every order of the corners.
    #[test]
    fn closest_point_of_a_triangle_with_equal_corners() {
        let (a, b) = (Vec3::new(0.1, 0.2, 0.3), Vec3::new(0.1, 1.2, 0.3));
        let edges = [[a, a, b], [a, b, a], [b, a, a], [a, b, b], [b, a, b], [b, b, a]];
        // Beside the middle of the edge, and beyond both ends.
        let cases =
            [(Vec3::new(0.6, 0.7, 0.3), 0.5), (Vec3::new(0.1, -0.3, 0.3), 0.5), (Vec3::new(0.1, 1.7, 0.3), 0.5)];
        for (x, distance) in cases {
            for corners in &edges {
                let (nearest, interior, _) = closest_on_triangle(&x, corners);
                // Rounding of coordinates of order 1.
                assert!(((nearest - x).norm() - distance).abs() < 1e-15 * 8.0, "{x} {corners:?}: {nearest}");
                assert!(!interior);
            }
        }
        assert_eq!(closest_on_triangle(&b, &[a, a, a]).0, a);
    }

    /// The closest point is at least as close as a dense sampling of the triangle, up to the spacing of the samples.
    #[test]
    fn closest_point_of_a_triangle() {
        let t = [Vec3::new(0.0, 0.0, 0.0), Vec3::new(1.0, 0.1, 0.2), Vec3::new(0.3, 0.9, -0.1)];
        for k in 0..200 {
            let u = |m: u32| f64::from((k * 7919 + m * 104_729) % 1000) / 250.0 - 1.5;
            let x = Vec3::new(u(1), u(2), u(3));
            let (nearest, _, weights) = closest_on_triangle(&x, &t);
            // Rounding of coordinates of order 1.
            let weighted = t[0] * weights[0] + t[1] * weights[1] + t[2] * weights[2];
            assert!((weighted - nearest).norm() < 1e-15 * 8.0, "{weighted} {nearest}");
            let mut best = f64::INFINITY;
            let n = 200;
            for i in 0..=n {
                for j in 0..=n - i {
                    let p = t[0]
                        + (t[1] - t[0]) * (f64::from(i) / f64::from(n))
                        + (t[2] - t[0]) * (f64::from(j) / f64::from(n));
                    best = best.min((p - x).norm());
                }
            }
            let found = (nearest - x).norm();
            assert!(found <= best + 1e-12 && found >= best - 0.01, "{found} {best}");
        }
    }
}
