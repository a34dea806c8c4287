//! Directions of cracks: area of faces by the direction of their normal, as roses on the sphere and in a plane.
//!
//! A face has an area vector `a`: its normal times its area. A normal and its opposite are the same direction. The fabric of the cracks is
//! `Σ a⊗a/|a| / Σ|a|`, with trace 1: its largest principal value is the share of area across its principal direction, 1/3 without
//! preference (as Kanatani 1984 weights directions).

use concordem_contact::math::{Mat3, Vec3, atan2};

use crate::error::{OperatorError, check_finite};
use crate::structure::Geode;

/// Directions of the area of cracks.
#[derive(Debug, Clone, PartialEq)]
pub struct CrackDirections {
    /// Area, m².
    pub area: f64,
    /// Fabric of the area, trace 1; zero without area.
    pub fabric: Mat3,
    /// Principal values of the fabric, largest first.
    pub principal: [f64; 3],
    /// Principal directions, in the same order; the largest component of each is positive.
    pub directions: [Vec3; 3],
    /// Area (m²) by face of a [`Geode`], half of it in the face of the normal, half in the opposite one.
    pub sphere: Vec<f64>,
}

/// Directions of faces with these area vectors (m²). Faces without area do not count.
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::crack_directions::crack_directions;
///
/// // 3 m² across x, 1 m² across y.
/// let found = crack_directions(&[Vec3::x() * -2.0, Vec3::x(), Vec3::y()]).unwrap();
/// assert_eq!((found.area, found.principal[0], found.directions[0]), (4.0, 0.75, Vec3::x()));
/// ```
///
/// # Errors
/// Numbers that are not finite.
pub fn crack_directions(areas: &[Vec3]) -> Result<CrackDirections, OperatorError> {
    check_finite("area", areas)?;
    let geode = Geode::new();
    let mut sphere = vec![0.0; Geode::FACES];
    let (mut area, mut sum) = (0.0, Mat3::zeros());
    for a in areas {
        let size = a.norm();
        if size == 0.0 {
            continue;
        }
        area += size;
        sum += a * a.transpose() / size;
        let face = geode.face_of(a);
        sphere[face] += 0.5 * size;
        sphere[geode.opposite(face)] += 0.5 * size;
    }
    let fabric = if area > 0.0 { sum / area } else { sum };
    let eigen = nalgebra::SymmetricEigen::new(fabric);
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
    let direction = |i: usize| {
        let x: Vec3 = eigen.eigenvectors.column(i).into();
        if x[x.iamax()] < 0.0 { -x } else { x }
    };
    let principal = order.map(|i| eigen.eigenvalues[i]);
    Ok(CrackDirections { area, fabric, principal, directions: order.map(direction), sphere })
}

impl CrackDirections {
    /// Density by face of a [`Geode`]: its share of the area over that of cracks without preferred direction; zero without area.
    pub fn densities(&self) -> Vec<f64> {
        let geode = Geode::new();
        let density = |(area, share): (&f64, &f64)| if self.area > 0.0 { area / self.area / share } else { 0.0 };
        self.sphere.iter().zip(geode.shares()).map(density).collect()
    }
}

/// Rose in a plane: the area (m²) that faces have across directions of the plane, by the angle of their normal in it. Bin `k` of `n` is the
/// angle `180° k/n` and half a bin to either side, so that common angles lie inside a bin. The angle is that from the next axis to the one after:
/// from x to y in the plane across z. A face that is inclined to the plane counts with its projection.
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::crack_directions::rose;
///
/// let found = rose(&[Vec3::x(), -Vec3::y() * 2.0, Vec3::z()], 2, 4).unwrap();
/// assert_eq!(found, [1.0, 0.0, 2.0, 0.0]);
/// ```
///
/// # Errors
/// Numbers that are not finite, no bin, an axis that is not 0, 1, or 2.
pub fn rose(areas: &[Vec3], axis: usize, bins: usize) -> Result<Vec<f64>, OperatorError> {
    check_finite("area", areas)?;
    if axis > 2 {
        return Err(OperatorError::Constant { name: "axis", value: axis as f64, demand: "it must be 0, 1, or 2" });
    }
    if !(1..=MOST_BINS).contains(&bins) {
        let demand = "it must be from 1 to 3600";
        return Err(OperatorError::Constant { name: "bins", value: bins as f64, demand });
    }
    let mut found = vec![0.0; bins];
    for a in areas {
        let (first, second) = (a[(axis + 1) % 3], a[(axis + 2) % 3]);
        let size = first.hypot(second);
        // The rest of a normal across the plane has no direction in it.
        if size <= NO_DIRECTION * a.norm() {
            continue;
        }
        let turns = atan2(second, first) / std::f64::consts::PI;
        let bin = (turns * bins as f64).round() as i64;
        found[bin.rem_euclid(bins as i64) as usize] += size;
    }
    Ok(found)
}

/// Most bins of a rose: a twentieth of a degree.
const MOST_BINS: usize = 3600;

/// Projection over area of a face that has no direction in the plane.
const NO_DIRECTION: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions of equal weight all over the sphere (spiral of Fibonacci).
    fn everywhere(count: usize) -> Vec<Vec3> {
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        (0..count)
            .map(|k| {
                let z = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
                let (radius, angle) = ((1.0 - z * z).sqrt(), golden * k as f64);
                Vec3::new(radius * angle.cos(), radius * angle.sin(), z)
            })
            .collect()
    }

    /// Without preference the density is 1 everywhere, the fabric a third in each direction, and the mean projection into a plane π/4.
    #[test]
    fn cracks_without_preference_are_even() {
        let areas = everywhere(200_000);
        let found = crack_directions(&areas).unwrap();
        assert!((found.area / 200_000.0 - 1.0).abs() < 1e-12);
        assert!(found.principal.iter().all(|value| (value - 1.0 / 3.0).abs() < 1e-6), "{found:?}");
        // 600 directions per face: those along its edge.
        assert!(found.densities().iter().all(|density| (density - 1.0).abs() < 0.05));
        for axis in 0..3 {
            let rose = rose(&areas, axis, 24).unwrap();
            let mean = std::f64::consts::FRAC_PI_4 * 200_000.0 / 24.0;
            assert!(rose.iter().all(|area| (area / mean - 1.0).abs() < 0.01), "{axis} {rose:?}");
        }
    }

    /// The share of area in a cone of half angle β about z is `1 − cos β` without preference. Cracks within 30° of z have the largest principal
    /// value `(1 − cos³β)/(3(1 − cos β))`, and their rose across z has no preference.
    #[test]
    fn a_cone_has_the_moments_of_a_cone() {
        let cosine = 0.75_f64.sqrt();
        let areas: Vec<Vec3> = everywhere(400_000).into_iter().filter(|x| x.z.abs() >= cosine).collect();
        let found = crack_directions(&areas).unwrap();
        let expected = (1.0 - cosine.powi(3)) / (3.0 * (1.0 - cosine));
        assert!((found.principal[0] - expected).abs() < 1e-4, "{:?} {expected}", found.principal);
        assert!((found.directions[0] - Vec3::z()).norm() < 1e-3);
        assert!((found.area / 400_000.0 - (1.0 - cosine)).abs() < 1e-4);
        // Faces of the geode wholly in the cone have 1/(1 − cos β) times the mean density, those wholly outside none.
        let geode = Geode::new();
        for (face, density) in geode.faces().iter().zip(found.densities()) {
            let inside = face.iter().map(|x| x.z.abs() >= cosine).collect::<Vec<_>>();
            if inside == [true; 3] {
                assert!((density * (1.0 - cosine) - 1.0).abs() < 0.05, "{density}");
            } else if face.iter().all(|x| x.z.abs() < 0.8) {
                assert_eq!(density, 0.0);
            }
        }
    }

    /// Common angles lie inside a bin, whatever the rounding; a normal and its opposite are one direction; the rest of a normal across the
    /// plane counts nowhere.
    #[test]
    fn common_angles_lie_inside_bins() {
        for (angle, bin) in [(0.0_f64, 0), (30.0, 4), (45.0, 6), (60.0, 8), (90.0, 12), (135.0, 18), (179.0, 0)] {
            for turn in [-1e-13, 0.0, 1e-13, std::f64::consts::PI] {
                let at = angle.to_radians() + turn;
                let found = rose(&[Vec3::new(at.cos(), at.sin(), 0.5) * 2.0], 2, 24).unwrap();
                let mut expected = vec![0.0; 24];
                expected[bin] = 2.0;
                assert!(
                    found.iter().zip(&expected).all(|(one, other)| (one - other).abs() < 1e-12),
                    "{angle} {found:?}"
                );
            }
        }
        assert_eq!(rose(&[Vec3::new(1e-17, -1e-17, 1.0)], 2, 6).unwrap(), [0.0; 6]);
        // From y to z across x, from z to x across y.
        assert_eq!(rose(&[Vec3::z()], 0, 2).unwrap(), [0.0, 1.0]);
        assert_eq!(rose(&[Vec3::z()], 1, 2).unwrap(), [1.0, 0.0]);
    }

    #[test]
    fn what_has_no_meaning_is_refused() {
        for bad in [f64::NAN, f64::INFINITY] {
            assert!(crack_directions(&[Vec3::x() * bad]).is_err() && rose(&[Vec3::x() * bad], 2, 24).is_err());
        }
        assert!(rose(&[Vec3::x()], 3, 24).is_err() && rose(&[Vec3::x()], 2, 0).is_err());
        assert!(rose(&[Vec3::x()], 2, 3601).is_err());
        let nothing = crack_directions(&[Vec3::zeros()]).unwrap();
        assert_eq!((nothing.area, nothing.fabric, nothing.densities()), (0.0, Mat3::zeros(), vec![0.0; Geode::FACES]));
    }
}
