//! Couple stress: from contacts, from external loads, and of a sampled region.

use super::contact_set::{ContactSet, LoadSet};
use super::error::{OperatorError, check_finite, check_length, check_volume};
use super::region::{Period, Region, Truncation};
use super::stress::{axial, particle_sums, region_stress};
use super::sum::{sum_tiles, sums};
use concordem_contact::math::{Mat3, Vec3};

/// Couple stress from external loads about a body's centroid `x⁰`, N/m (operator O9; Stránský 2018, (4.31), (4.59)):
/// `Vμ = V x⁰⊗(1×σ̄) + Σ_e x^e⊗c^e`, `σ̄ = (1/V) Σ x^e⊗f^e`.
///
/// Loads are moved to the particles' centers first: a force at `c` equals one at the center plus the moment `(c−x)×f`.
/// (Line 1254 of the thesis prints an extra V in the bracket.)
pub fn external(position: &[Vec3], loads: &LoadSet<'_>, volume: f64, centroid: &Vec3) -> Result<Mat3, OperatorError> {
    let volume = check_volume("the body", volume)?;
    let (mut stress, mut couple) = (Mat3::zeros(), Mat3::zeros());
    for k in 0..loads.len() {
        let (p, point, force, moment) = loads.get(k);
        let x = *position.get(p).ok_or(OperatorError::Length {
            name: "position",
            expected: p + 1,
            found: position.len(),
            each: "particle that is loaded",
        })?;
        stress += x * force.transpose();
        couple += x * ((point - x).cross(&force) + moment).transpose();
    }
    Ok((couple + centroid * axial(&stress).transpose()) / volume)
}

/// Couple stress from contacts about a body's centroid `x⁰`, N/m (operator O10; Stránský 2018, (4.51), (4.57)):
/// `Vμ = V x⁰⊗(1×σ̄) + Σ_c l⊗m^A + Σ_c [x_B⊗((c−x_B)×f^A) − x_A⊗((c−x_A)×f^A)]`.
///
/// Not for periodic contacts, because positions enter. Equal to [`external`] if every particle is in equilibrium (P7).
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::{ContactSet, couple_stress::internal};
///
/// let position = [Vec3::zeros(), Vec3::new(2.0, 0.0, 0.0)];
/// let (pair, branch, point, force) = ([[0, 1]], [Vec3::x() * 2.0], [Vec3::x()], [Vec3::zeros()]);
/// let moment = [Vec3::y() * 3.0];
/// let contacts = ContactSet::new(&position, &pair, &branch, &point, &force, Some(&moment)).unwrap();
/// assert_eq!(internal(&contacts, 6.0, &Vec3::x()).unwrap()[(0, 1)], 1.0);
/// ```
pub fn internal(contacts: &ContactSet<'_>, volume: f64, centroid: &Vec3) -> Result<Mat3, OperatorError> {
    let stress = region_stress(contacts, &Region::All { volume }, Truncation::BranchClipped, None)?.stress;
    let sum: Mat3 = sum_tiles(contacts.len(), |range| {
        let mut sum = Mat3::zeros();
        for k in range {
            let c = contacts.get(k);
            let b = c.position_a + c.branch;
            sum += c.branch * c.moment.transpose() + b * c.arm_b.cross(&c.force).transpose()
                - c.position_a * c.arm_a.cross(&c.force).transpose();
        }
        sum
    });
    Ok(sum / volume + centroid * axial(&stress).transpose())
}

/// Net wrench of the internal contacts on every particle: force (N) and moment about its center (N·m),
/// `F_p = Σ f^{pc}`, `M_p = Σ (r^{pc}×f^{pc} + m^{pc})`.
pub fn resultants(contacts: &ContactSet<'_>) -> Vec<Resultant> {
    particle_sums(contacts, |c| {
        (
            Resultant { force: c.force, moment: c.arm_a.cross(&c.force) + c.moment },
            Resultant { force: -c.force, moment: -(c.arm_b.cross(&c.force) + c.moment) },
        )
    })
}

/// Net force and moment of contacts on a particle.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Resultant {
    /// Force, N.
    pub force: Vec3,
    /// Moment about the center, N·m.
    pub moment: Vec3,
}

impl std::ops::AddAssign for Resultant {
    fn add_assign(&mut self, other: Self) {
        self.force += other.force;
        self.moment += other.moment;
    }
}

/// Stress and couple stress of a sampled region conjugate to the affine modes of motion of its particles (operators O6,
/// O11; ERDC 2019, (33), (44), (45) in our conventions): with the net wrenches `F`, `M` of the contacts internal to the
/// region, `σ = −(1/V) Σ_p x⊗F = (1/V) Σ_c l⊗f^A`, `μ = −(1/V) Σ_p (x−x⁰)⊗M`.
///
/// In equilibrium only particles at the region's border have a net wrench. A contact across the border of a periodic cell
/// counts half where A is and half where B is ([`ContactSet::between_images`]); in equilibrium the place does not matter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conjugate {
    /// Stress, Pa.
    pub stress: Mat3,
    /// Couple stress about the reference point, N/m.
    pub couple_stress: Mat3,
    /// `ΣF/V`, N/m³: zero for any pairs of opposite forces.
    pub rigid_force: Vec3,
    /// `Σ(x×F + M)/V`, N/m²: zero if both particles of every contact use the same contact point.
    pub rigid_moment: Vec3,
    /// `ΣM/V`, N/m²: conjugate of the uniform rotation, the axial part of the stress.
    pub rotation: Vec3,
    /// Volume, m³.
    pub volume: f64,
    /// Contacts with both particles inside.
    pub contacts: usize,
}

/// See [`Conjugate`]. `reference` is the region's reference point, usually its center (m). With `period`, all periodic
/// images in the region are included.
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::{ContactSet, Region, couple_stress::conjugate};
///
/// // A contact that transmits the moment 3 N·m and no force.
/// let position = [Vec3::zeros(), Vec3::new(2.0, 0.0, 0.0)];
/// let (pair, branch, point, force) = ([[0, 1]], [Vec3::x() * 2.0], [Vec3::x()], [Vec3::zeros()]);
/// let moment = [Vec3::y() * 3.0];
/// let contacts = ContactSet::new(&position, &pair, &branch, &point, &force, Some(&moment)).unwrap();
/// let found = conjugate(&contacts, &Region::All { volume: 6.0 }, &Vec3::x(), None).unwrap();
/// assert_eq!(found.couple_stress[(0, 1)], 1.0);
/// assert_eq!(found.stress.norm(), 0.0);
/// ```
pub fn conjugate(
    contacts: &ContactSet<'_>,
    region: &Region,
    reference: &Vec3,
    period: Option<&Period>,
) -> Result<Conjugate, OperatorError> {
    let position = contacts.position();
    let volume = super::region::check(region, Truncation::InternalOnly, position, period)?;
    let images = region.images(period);
    // A region with a shape contains the images that lie in it; others have the particles where they are listed.
    let listed = period.is_some() && matches!(region, Region::All { .. } | Region::Particles { .. });
    sums!(Sums { xf: Mat3, xm: Mat3, force: Vec3, total: Vec3, moment: Vec3, contacts: f64 });
    let sums: Sums = sum_tiles(contacts.len(), |range| {
        let mut sums = Sums::default();
        for k in range {
            let c = contacts.get(k);
            // Wrenches on the two particles.
            let ends = [
                (Vec3::zeros(), c.force, c.arm_a.cross(&c.force) + c.moment),
                (c.branch, -c.force, -(c.arm_b.cross(&c.force) + c.moment)),
            ];
            let offset = if listed { contacts.between_images(&c) } else { Vec3::zeros() };
            for image in images.of(&c.position_a, &c.branch) {
                let x = c.position_a + offset + period.map_or_else(Vec3::zeros, |period| period.edges * image);
                if !(region.contains(c.a, &x) && region.contains(c.b, &(x + c.branch))) {
                    continue;
                }
                sums.contacts += 1.0;
                for (from_a, force, moment) in &ends {
                    let x = x + from_a - reference;
                    sums.xf += x * force.transpose();
                    sums.xm += x * moment.transpose();
                    sums.force += force;
                    sums.total += x.cross(force) + moment;
                    sums.moment += moment;
                }
            }
        }
        sums
    });
    if sums.contacts == 0.0 {
        return Err(OperatorError::EmptyRegion { what: "contact" });
    }
    Ok(Conjugate {
        stress: -sums.xf / volume,
        couple_stress: -sums.xm / volume,
        rigid_force: sums.force / volume,
        rigid_moment: sums.total / volume,
        rotation: sums.moment / volume,
        volume,
        contacts: sums.contacts as usize,
    })
}

/// Couple stress of a body from the net wrenches of its internal contacts about `x⁰`, N/m (operator O11):
/// `Vμ = −Σ_p (x_p−x⁰)⊗M_p`.
pub fn from_resultants(
    position: &[Vec3],
    resultants: &[Resultant],
    volume: f64,
    reference: &Vec3,
) -> Result<Mat3, OperatorError> {
    check_length("resultants", resultants.len(), position.len(), "particle")?;
    // The forces do not enter, but a particle with an infinite one is no measurement.
    check_finite("force", &resultants.iter().map(|net| net.force).collect::<Vec<_>>())?;
    let volume = check_volume("the body", volume)?;
    let sum: Mat3 = sum_tiles(position.len(), |range| {
        range.map(|p| (position[p] - reference) * resultants[p].moment.transpose()).sum()
    });
    Ok(-sum / volume)
}
