//! Fabric: number and directions of contacts.

use super::contact_set::ContactSet;
use super::error::OperatorError;
use super::region::{self, Period, Region, Truncation};
use super::stress::particle_sums;
use super::sum::{sum_tiles, sums};
use concordem_contact::math::{Mat3, Vec3};

/// Fabric of a region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fabric {
    /// `(1/N) Σ n⊗n` over the region's contacts, trace 1 (Satake 1982).
    pub tensor: Mat3,
    /// Number of contacts, weighted by [`Truncation`].
    pub contacts: f64,
    /// Particles whose centers lie inside.
    pub particles: usize,
    /// Coordination number: mean number of contacts per particle, `2 N_c/N_p`.
    pub coordination: f64,
    /// Mean length of the branch vectors, m.
    pub branch_length: f64,
}

/// Fabric tensor and coordination number of a region. Directions are those of the branch vectors.
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::{ContactSet, Region, Truncation, fabric::fabric};
///
/// // Two spheres of radius 1 m pull each other with 5 N.
/// let position = [Vec3::zeros(), Vec3::new(2.0, 0.0, 0.0)];
/// let (pair, branch, point, force) = ([[0, 1]], [Vec3::x() * 2.0], [Vec3::x()], [Vec3::x() * 5.0]);
/// let contacts = ContactSet::new(&position, &pair, &branch, &point, &force, None).unwrap();
///
/// let found = fabric(&contacts, &Region::All { volume: 10.0 }, Truncation::BranchClipped, None).unwrap();
/// assert_eq!(found.tensor[(0, 0)], 1.0);
/// assert_eq!((found.contacts, found.particles), (1.0, 2));
/// ```
pub fn fabric(
    contacts: &ContactSet<'_>,
    region: &Region,
    truncation: Truncation,
    period: Option<&Period>,
) -> Result<Fabric, OperatorError> {
    let position = contacts.position();
    region::check(region, truncation, position, period)?;
    let images = region.images(period);
    sums!(Sums { tensor: Mat3, count: f64, length: f64 });
    let sums: Sums = sum_tiles(contacts.len(), |range| {
        let mut sum = Sums::default();
        for k in range {
            let (l, [a, b]) = (contacts.branch()[k], contacts.pair()[k].map(|p| p as usize));
            let length = l.norm();
            let n = l / length;
            for image in images.of(&position[a], &l) {
                let x = position[a] + period.map_or_else(Vec3::zeros, |p| p.edges * image);
                let weight = region::weight(region, truncation, a, b, &x, &l);
                sum += Sums { tensor: (n * weight) * n.transpose(), count: weight, length: weight * length };
            }
        }
        sum
    });
    if sums.count == 0.0 {
        return Err(OperatorError::EmptyRegion { what: "contact" });
    }
    let particles = (0..position.len()).map(|p| images.inside(p, &position[p]).count()).sum::<usize>();
    Ok(Fabric {
        tensor: sums.tensor / sums.count,
        contacts: sums.count,
        particles,
        coordination: 2.0 * sums.count / particles.max(1) as f64,
        branch_length: sums.length / sums.count,
    })
}

/// Number of contacts of every particle.
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::{ContactSet, fabric::coordination};
///
/// // Two spheres of radius 1 m pull each other with 5 N.
/// let position = [Vec3::zeros(), Vec3::new(2.0, 0.0, 0.0)];
/// let (pair, branch, point, force) = ([[0, 1]], [Vec3::x() * 2.0], [Vec3::x()], [Vec3::x() * 5.0]);
/// let contacts = ContactSet::new(&position, &pair, &branch, &point, &force, None).unwrap();
///
/// assert_eq!(coordination(&contacts), [1.0, 1.0]);
/// ```
pub fn coordination(contacts: &ContactSet<'_>) -> Vec<f64> {
    particle_sums(contacts, |_| (1.0, 1.0))
}
