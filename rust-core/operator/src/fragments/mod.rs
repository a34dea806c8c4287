//! Fragments of a broken specimen: mass, size, shape, velocity, and their sieve curve ([`sieve`]).
//!
//! **Size.** A sieve lets through what its intermediate axis fits: a fragment turns until its longest axis is upright. The axes are those of the
//! ellipsoid with the same mass and the same second moments (in the plane: Legendre's ellipse of inertia, as in ISO 9276-6:2008):
//! `2√(5λ/m)` with the principal moments `λ` of `Σ m (x⊗x + r²/5)` about the center of mass, `2√(4λ/m)` with `r²/4` in the plane. They are
//! exact for single particles and for ellipsoids; of a cube they are 1.29 edges. The other size is the diameter of the sphere (disc) with the
//! volume of the particles, without the pores between them (ISO 9276-1:1998).

pub mod sieve;

use std::collections::BTreeMap;

use concordem_contact::math::{Mat3, Vec3};

use crate::error::{OperatorError, check_finite, check_length};
use crate::strain::Dimension;

/// Particles with the fragments that they belong to, one entry each.
#[derive(Debug, Clone, Copy)]
pub struct Membership<'a> {
    /// Number of the fragment of each particle; any numbers.
    pub fragment: &'a [u32],
    /// Center, m. Distances do not reach through periodic faces.
    pub position: &'a [Vec3],
    /// Radius, m.
    pub radius: &'a [f64],
    /// Mass, kg.
    pub mass: &'a [f64],
    /// Velocity, m/s.
    pub velocity: &'a [Vec3],
    /// Spheres in space, or discs in the plane of x and y.
    pub dimension: Dimension,
}

/// A fragment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fragment {
    /// Its number.
    pub number: u32,
    /// Number of particles.
    pub particles: usize,
    /// Mass, kg.
    pub mass: f64,
    /// Center of mass, m.
    pub position: Vec3,
    /// Velocity of the center of mass, m/s.
    pub velocity: Vec3,
    /// Diameter of the sphere (disc) with the volume of the particles, m; overlaps count twice.
    pub sphere: f64,
    /// Axes of the ellipsoid with the same second moments, longest first, m; the third is zero in the plane.
    pub axes: [f64; 3],
}

impl Fragment {
    /// Whether it is one particle, which cannot break.
    pub fn is_debris(&self) -> bool {
        self.particles == 1
    }
}

/// The fragments, the heaviest first; of equal ones the smallest number first. The numbering of the particles changes rounding only.
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::fragments::{Membership, measure};
/// use concordem_operator::strain::Dimension;
///
/// // Two spheres of radius 1 m that touch, and one alone.
/// let membership = Membership {
///     fragment: &[7, 7, 9],
///     position: &[Vec3::zeros(), Vec3::x() * 2.0, Vec3::x() * 9.0],
///     radius: &[1.0; 3],
///     mass: &[1.0; 3],
///     velocity: &[Vec3::zeros(); 3],
///     dimension: Dimension::Three,
/// };
/// let found = measure(&membership).unwrap();
/// assert_eq!((found[0].number, found[0].mass, found[0].position.x), (7, 2.0, 1.0));
/// assert!((found[0].axes[1] - 2.0).abs() < 1e-15 && found[1].is_debris());
/// ```
///
/// # Errors
/// Different lengths, numbers that are not finite, a radius or mass that is not positive.
pub fn measure(membership: &Membership) -> Result<Vec<Fragment>, OperatorError> {
    let Membership { fragment, position, radius, mass, velocity, dimension } = *membership;
    check_length("position", position.len(), fragment.len(), "particle")?;
    check_length("radius", radius.len(), fragment.len(), "particle")?;
    check_length("mass", mass.len(), fragment.len(), "particle")?;
    check_length("velocity", velocity.len(), fragment.len(), "particle")?;
    check_finite("position", position)?;
    check_finite("velocity", velocity)?;
    positive("radius", radius)?;
    positive("mass", mass)?;
    let mut members: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (p, &number) in fragment.iter().enumerate() {
        members.entry(number).or_default().push(p);
    }
    let mut found: Vec<Fragment> = members
        .iter()
        .map(|(&number, members)| {
            let total: f64 = members.iter().map(|&p| mass[p]).sum();
            let mean = |of: &[Vec3]| members.iter().map(|&p| of[p] * mass[p]).sum::<Vec3>() / total;
            let center = mean(position);
            // Second moment of a ball, and of a disc in its plane, over mass and r².
            let own = if dimension == Dimension::Three { 0.2 } else { 0.25 };
            let moment = members.iter().fold(Mat3::zeros(), |moment, &p| {
                let x = position[p] - center;
                moment + (x * x.transpose() + Mat3::from_diagonal_element(own * radius[p] * radius[p])) * mass[p]
            });
            Fragment {
                number,
                particles: members.len(),
                mass: total,
                position: center,
                velocity: mean(velocity),
                sphere: sphere(members.iter().map(|&p| radius[p]), dimension),
                axes: axes(&(moment / total), dimension),
            }
        })
        .collect();
    found.sort_by(|one, other| other.mass.total_cmp(&one.mass).then(one.number.cmp(&other.number)));
    Ok(found)
}

/// Diameter of the sphere (disc) with the volume of all of them.
fn sphere(radii: impl Iterator<Item = f64>, dimension: Dimension) -> f64 {
    match dimension {
        Dimension::Three => 2.0 * libm::cbrt(radii.map(|r| r * r * r).sum()),
        Dimension::Two => 2.0 * radii.map(|r| r * r).sum::<f64>().sqrt(),
    }
}

/// Axes of the ellipsoid (ellipse) with this second moment over its mass, longest first.
fn axes(moment: &Mat3, dimension: Dimension) -> [f64; 3] {
    let length = |share: f64, moment: f64| 2.0 * (moment.max(0.0) / share).sqrt();
    match dimension {
        Dimension::Three => {
            let mut found: [f64; 3] = nalgebra::SymmetricEigen::new(*moment).eigenvalues.into();
            found.sort_by(|one, other| other.total_cmp(one));
            found.map(|moment| length(0.2, moment))
        }
        Dimension::Two => {
            let (middle, half) = (0.5 * (moment.m11 + moment.m22), 0.5 * (moment.m11 - moment.m22));
            let radius = (half * half + moment.m12 * moment.m12).sqrt();
            [length(0.25, middle + radius), length(0.25, middle - radius), 0.0]
        }
    }
}

fn positive(name: &'static str, values: &[f64]) -> Result<(), OperatorError> {
    check_finite(name, values)?;
    match values.iter().find(|value| **value <= 0.0) {
        Some(&value) => Err(OperatorError::Constant { name, value, demand: "it must be positive" }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ellipsoids (ellipses) filled with equal small spheres have the axes of the ellipsoid, wherever and however they lie.
    #[test]
    fn ellipsoids_have_their_axes() {
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, 0.7, -0.4);
        for (dimension, edges) in [(Dimension::Three, [6.0, 4.0, 2.0]), (Dimension::Two, [6.0, 4.0, 0.0])] {
            let (step, mut position) = (0.1, Vec::new());
            let steps = |edge: f64| (-(0.5 * edge / step) as i32)..=(0.5 * edge / step) as i32;
            let third = if dimension == Dimension::Three { steps(edges[2]) } else { 0..=0 };
            for (i, j, k) in
                third.flat_map(|k| steps(edges[1]).flat_map(move |j| steps(edges[0]).map(move |i| (i, j, k))))
            {
                let x = Vec3::new(f64::from(i), f64::from(j), f64::from(k)) * step;
                let over = |axis: usize| if edges[axis] > 0.0 { 2.0 * x[axis] / edges[axis] } else { 0.0 };
                if (0..3).map(|axis| over(axis) * over(axis)).sum::<f64>() <= 1.0 {
                    let turned = if dimension == Dimension::Three { turn * x } else { x };
                    position.push(turned + Vec3::new(7.0, 8.0, 0.0));
                }
            }
            let count = position.len();
            let membership = Membership {
                fragment: &vec![3; count],
                position: &position,
                radius: &vec![0.05; count],
                mass: &vec![2.0; count],
                velocity: &vec![Vec3::new(1.0, 2.0, 3.0); count],
                dimension,
            };
            let found = measure(&membership).unwrap();
            assert_eq!((found.len(), found[0].particles, found[0].mass), (1, count, 2.0 * count as f64));
            assert!((found[0].velocity - Vec3::new(1.0, 2.0, 3.0)).norm() < 1e-12);
            assert!((found[0].position - Vec3::new(7.0, 8.0, 0.0)).norm() < 1e-12);
            for (axis, edge) in found[0].axes.iter().zip(edges) {
                // The steps of 0.1 at the surface.
                assert!((axis - edge).abs() < 0.04, "{:?}", found[0].axes);
            }
        }
    }

    /// A cube of 2³ touching spheres: moment 1 + 0.2 per axis, so that its axes are 2√6. Its sphere has eight times the volume.
    #[test]
    fn a_cube_of_spheres_has_the_axes_of_its_moments() {
        let corners: Vec<Vec3> =
            (0..8).map(|k| Vec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) * 2.0).collect();
        let membership = Membership {
            fragment: &[0; 8],
            position: &corners,
            radius: &[1.0; 8],
            mass: &[1.0; 8],
            velocity: &[Vec3::zeros(); 8],
            dimension: Dimension::Three,
        };
        let found = measure(&membership).unwrap()[0];
        assert!(found.axes.iter().all(|axis| (axis - 2.0 * 6.0_f64.sqrt()).abs() < 1e-14), "{found:?}");
        assert!((found.sphere - 4.0).abs() < 1e-15);
        let flat = Membership { position: &corners[..4], ..cut(&membership, 4) };
        let found = measure(&Membership { dimension: Dimension::Two, ..flat }).unwrap()[0];
        // Moment 1 + 1/4, and four times the area.
        assert!((found.axes[0] - 2.0 * 5.0_f64.sqrt()).abs() < 1e-14 && found.axes[2] == 0.0, "{found:?}");
        assert_eq!(found.sphere, 4.0);
    }

    fn cut<'a>(membership: &Membership<'a>, count: usize) -> Membership<'a> {
        Membership {
            fragment: &membership.fragment[..count],
            position: &membership.position[..count],
            radius: &membership.radius[..count],
            mass: &membership.mass[..count],
            velocity: &membership.velocity[..count],
            dimension: membership.dimension,
        }
    }

    /// Another numbering of particles and fragments gives the same fragments: sums of a hundred terms differ in rounding.
    #[test]
    fn the_numbering_does_not_matter() {
        let count = 100;
        let at = |k: usize, factor: f64| (k as f64 * factor).fract();
        let fragment: Vec<u32> = (0..count).map(|k| (at(k, 0.618) * 7.0) as u32).collect();
        let position: Vec<Vec3> = (0..count).map(|k| Vec3::new(at(k, 0.37), at(k, 0.73), at(k, 0.11))).collect();
        let radius: Vec<f64> = (0..count).map(|k| 0.01 + 0.1 * at(k, 0.59)).collect();
        let mass: Vec<f64> = radius.iter().map(|r| r * r * r).collect();
        let velocity: Vec<Vec3> = position.iter().map(|x| x * 3.0).collect();
        let given = Membership {
            fragment: &fragment,
            position: &position,
            radius: &radius,
            mass: &mass,
            velocity: &velocity,
            dimension: Dimension::Three,
        };
        let one = measure(&given).unwrap();
        let order: Vec<usize> = (0..count).map(|k| 37 * k % count).collect();
        let (fragment, position, radius, mass, velocity) = (
            order.iter().map(|&k| 90 - fragment[k]).collect::<Vec<_>>(),
            order.iter().map(|&k| position[k]).collect::<Vec<_>>(),
            order.iter().map(|&k| radius[k]).collect::<Vec<_>>(),
            order.iter().map(|&k| mass[k]).collect::<Vec<_>>(),
            order.iter().map(|&k| velocity[k]).collect::<Vec<_>>(),
        );
        let other = measure(&Membership {
            fragment: &fragment,
            position: &position,
            radius: &radius,
            mass: &mass,
            velocity: &velocity,
            dimension: Dimension::Three,
        })
        .unwrap();
        assert_eq!(one.len(), 7);
        for (one, other) in one.iter().zip(&other) {
            assert_eq!((one.number, one.particles), (90 - other.number, other.particles));
            assert!((one.mass / other.mass - 1.0).abs() < 1e-14);
            assert!((one.position - other.position).norm() < 1e-14 && (one.velocity - other.velocity).norm() < 1e-14);
            assert!(one.axes.iter().zip(other.axes).all(|(one, other)| (one / other - 1.0).abs() < 1e-13));
        }
    }

    #[test]
    fn what_has_no_meaning_is_refused() {
        let good = Membership {
            fragment: &[0],
            position: &[Vec3::zeros()],
            radius: &[1.0],
            mass: &[1.0],
            velocity: &[Vec3::zeros()],
            dimension: Dimension::Three,
        };
        assert!(measure(&good).is_ok());
        let nan = [Vec3::x() * f64::NAN];
        for bad in [
            Membership { position: &nan, ..good },
            Membership { velocity: &nan, ..good },
            Membership { radius: &[f64::INFINITY], ..good },
            Membership { radius: &[0.0], ..good },
            Membership { mass: &[f64::NAN], ..good },
            Membership { mass: &[-1.0], ..good },
            Membership { mass: &[1.0, 1.0], ..good },
            Membership { velocity: &[], ..good },
        ] {
            assert!(measure(&bad).is_err(), "{bad:?}");
        }
    }
}
