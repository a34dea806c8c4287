//! Power of the contacts, and the part of the affine motion (operator O21).

use super::contact_set::ContactSet;
use super::couple_stress::resultants;
use super::error::{OperatorError, check_length, check_volume};
use super::strain::AffineFit;
use super::stress::region_stress;
use super::sum::{sum_tiles, sums};
use super::{Region, Truncation};
use concordem_contact::math::{Mat3, Vec3};

/// Power of the internal contacts of a body, all in W; positive if it is put into the contacts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerReport {
    /// `−Σ_c (Δv·f^A + Δω·m^A)` with the relative motion `Δv = v_A + ω_A×r^A − v_B − ω_B×r^B`, `Δω = ω_A − ω_B`.
    pub contacts: f64,
    /// `−Σ_p (F_p·v_p + M_p·ω_p)` with the net wrenches of the contacts: the same power, summed over particles.
    pub particles: f64,
    /// `V σ:γ̇`.
    pub stress: f64,
    /// `V μ:κ̇`.
    pub couple: f64,
    /// Power under the non-affine motion, `−Σ_p (F_p·v'_p + M_p·ω'_p)`, which stress and strain do not include.
    pub gap: f64,
    /// Stress, Pa.
    pub stress_tensor: Mat3,
    /// Couple stress about the fit's center, N/m.
    pub couple_stress: Mat3,
}

/// Power report of a body with the `velocity` (m/s) and angular velocity `spin` (rad/s) of its particles, against the
/// affine part `fit` of the same motion (operators P13, P14): `contacts = stress + couple + gap` for any motion.
///
/// `image_velocity` (m/s) is the velocity of the image of B in each contact relative to B itself (periodic: `Ḣ·image`;
/// empty: none). The balance also holds in a periodic cell; only `particles` then omits the cell's motion, which the
/// net wrenches of the particles do not include. Contacts across the border count half where A is and half
/// where B is.
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::{ContactSet, Region, power::power, strain::{Dimension, affine_fit}};
///
/// // Three spheres in a row in the plane, and one beside them; the row is stretched at 0.1 1/s.
/// let position = [Vec3::zeros(), Vec3::x() * 2.0, Vec3::x() * 4.0, Vec3::new(2.0, 2.0, 0.0)];
/// let velocity = position.map(|x| Vec3::x() * (0.1 * x.x));
/// let pair = [[0, 1], [1, 2]];
/// let (branch, point) = ([Vec3::x() * 2.0; 2], [Vec3::x(), Vec3::x() * 3.0]);
/// let force = [Vec3::x() * 5.0; 2];
/// let contacts = ContactSet::new(&position, &pair, &branch, &point, &force, None).unwrap();
/// let region = Region::All { volume: 1.0 };
/// let fit = affine_fit(&position, &velocity, &[Vec3::zeros(); 4], &region, None, Dimension::Two).unwrap();
/// let found = power(&contacts, &velocity, &[Vec3::zeros(); 4], &[], &fit, 1.0).unwrap();
/// // Each contact lengthens by 0.2 m/s under 5 N; the motion is affine, so nothing is left.
/// assert!((found.contacts - 2.0).abs() < 1e-12 && found.gap.abs() < 1e-12);
/// ```
pub fn power(
    contacts: &ContactSet<'_>,
    velocity: &[Vec3],
    spin: &[Vec3],
    image_velocity: &[Vec3],
    fit: &AffineFit,
    volume: f64,
) -> Result<PowerReport, OperatorError> {
    let position = contacts.position();
    check_length("velocity", velocity.len(), position.len(), "particle")?;
    check_length("spin", spin.len(), position.len(), "particle")?;
    if !image_velocity.is_empty() {
        check_length("image_velocity", image_velocity.len(), contacts.len(), "contact")?;
    }
    let volume = check_volume("the body", volume)?;
    sums!(Sums { contacts: f64, gap: f64, couple: Mat3 });
    let sums: Sums = sum_tiles(contacts.len(), |range| {
        let mut sums = Sums::default();
        for k in range {
            let c = contacts.get(k);
            let carried = image_velocity.get(k).copied().unwrap_or_default();
            let xa = if image_velocity.is_empty() { c.position_a } else { c.position_a + contacts.between_images(&c) };
            let xb = xa + c.branch;
            let power = |[va, wa, vb, wb]: [Vec3; 4]| {
                let relative = (va + wa.cross(&c.arm_a)) - (vb + wb.cross(&c.arm_b));
                -(relative.dot(&c.force) + (wa - wb).dot(&c.moment))
            };
            let motion = [velocity[c.a], spin[c.a], velocity[c.b] + carried, spin[c.b]];
            let affine = [fit.displacement(&xa), fit.rotation_at(&xa), fit.displacement(&xb), fit.rotation_at(&xb)];
            let on_a = c.arm_a.cross(&c.force) + c.moment;
            let on_b = -(c.arm_b.cross(&c.force) + c.moment);
            sums += Sums {
                contacts: power(motion),
                gap: power(std::array::from_fn(|i| motion[i] - affine[i])),
                couple: (xa - fit.center) * on_a.transpose() + (xb - fit.center) * on_b.transpose(),
            };
        }
        sums
    });
    let net = resultants(contacts);
    let particles: f64 = sum_tiles(position.len(), |range| {
        range.map(|p| -(net[p].force.dot(&velocity[p]) + net[p].moment.dot(&spin[p]))).sum()
    });
    let stress = region_stress(contacts, &Region::All { volume }, Truncation::BranchClipped, None)?.stress;
    let couple_stress = -sums.couple / volume;
    Ok(PowerReport {
        contacts: sums.contacts,
        particles,
        stress: volume * stress.dot(&fit.cosserat_strain()),
        couple: volume * couple_stress.dot(&fit.curvature),
        gap: sums.gap,
        stress_tensor: stress,
        couple_stress,
    })
}
