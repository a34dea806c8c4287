//! Source mechanisms: the moment tensor of an event, and its shares of expansion, compensated linear vector dipole, and slip.
//!
//! Contact forces around a source change when its bonds break. With the change `ΔF` of the force on a point at `R` from the center of the event,
//! the moment tensor is `M = Σ ΔF⊗R` (Hazzard and Young 2002; 2004), of which the symmetric part counts.
//!
//! With the principal values `M₁ ≥ M₂ ≥ M₃` the parts are `M_iso = (M₁ + M₂ + M₃)/3`, `M_clvd = ⅔(M₁ + M₃ − 2M₂)`,
//! `M_dc = ½(M₁ − M₃ − |M₁ + M₃ − 2M₂|)` (Knopoff and Randall 1970, scaled as by Vavryčuk 2015), and the shares these over
//! `|M_iso| + |M_clvd| + M_dc`.

use concordem_contact::math::{Mat3, Vec3};

use crate::error::{OperatorError, check_finite, check_length};
use crate::stress::symmetric;

/// Moment tensor of an event (N m): the symmetric part of `Σ ΔF⊗R`. `force`: change of the force at each point, N; `arm`: from the center of
/// the event to the point, m.
///
/// # Errors
/// Different lengths, numbers that are not finite.
pub fn moment_tensor(force: &[Vec3], arm: &[Vec3]) -> Result<Mat3, OperatorError> {
    check_length("arm", arm.len(), force.len(), "force")?;
    check_finite("force", force)?;
    check_finite("arm", arm)?;
    let sum = force.iter().zip(arm).map(|(force, arm)| force * arm.transpose()).sum::<Mat3>();
    Ok(symmetric(&sum))
}

/// What kind of source a moment tensor describes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Source {
    /// Scalar moment `√(½ M:M)`, N m (Silver and Jordan 1982).
    pub moment: f64,
    /// Moment magnitude `⅔ log₁₀ M₀ − 6` (Hanks and Kanamori 1979, as in Hazzard and Young 2004); minus infinity without moment.
    pub magnitude: f64,
    /// Share of expansion, −1 (implosion) to 1 (explosion).
    pub isotropic: f64,
    /// Share of the compensated linear vector dipole, −1 (closing) to 1 (opening).
    pub dipole: f64,
    /// Share of the double couple, slip on a plane, 0 to 1. The three magnitudes add up to 1, or are 0 without moment.
    pub double_couple: f64,
}

/// The kind of source of a moment tensor (N m), of which the symmetric part counts.
///
/// ```
/// use concordem_contact::math::Mat3;
/// use concordem_operator::acoustic::source::source;
///
/// // Slip: a double couple.
/// let slip = Mat3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
/// assert!((source(&slip).unwrap().double_couple - 1.0).abs() < 1e-14);
/// ```
///
/// # Errors
/// Numbers that are not finite.
pub fn source(tensor: &Mat3) -> Result<Source, OperatorError> {
    check_finite("tensor", tensor.as_slice())?;
    let tensor = symmetric(tensor);
    let mut principal: [f64; 3] = nalgebra::SymmetricEigen::new(tensor).eigenvalues.into();
    principal.sort_by(|one, other| other.total_cmp(one));
    let [first, second, third] = principal;
    let isotropic = (first + second + third) / 3.0;
    let bend = first + third - 2.0 * second;
    let dipole = 2.0 / 3.0 * bend;
    let double_couple = (0.5 * (first - third - bend.abs())).max(0.0);
    let size = isotropic.abs() + dipole.abs() + double_couple;
    let share = |part: f64| if size > 0.0 { part / size } else { 0.0 };
    let moment = (0.5 * tensor.norm_squared()).sqrt();
    Ok(Source {
        moment,
        magnitude: 2.0 / 3.0 * libm::log10(moment) - 6.0,
        isotropic: share(isotropic),
        dipole: share(dipole),
        double_couple: share(double_couple),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shares(tensor: &Mat3) -> [f64; 3] {
        let found = source(tensor).unwrap();
        [found.isotropic, found.dipole, found.double_couple]
    }

    fn close(found: [f64; 3], wanted: [f64; 3]) {
        assert!(found.iter().zip(wanted).all(|(one, other)| (one - other).abs() < 1e-14), "{found:?} {wanted:?}");
    }

    /// Sources with closed forms, in any direction: explosion, slip, dipole; a crack that opens in a solid with Lamé's constants `λ = μ` has the
    /// values `λ + 2μ, λ, λ`, hence 5/9 and 4/9; a line force of one direction 1/3 and 2/3; all with the sign turned.
    #[test]
    fn sources_have_their_shares() {
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, -1.1, 2.0).into_inner();
        for (values, wanted) in [
            ([2.0, 2.0, 2.0], [1.0, 0.0, 0.0]),
            ([1.0, 0.0, -1.0], [0.0, 0.0, 1.0]),
            ([2.0, -1.0, -1.0], [0.0, 1.0, 0.0]),
            ([3.0, 1.0, 1.0], [5.0 / 9.0, 4.0 / 9.0, 0.0]),
            ([1.0, 0.0, 0.0], [1.0 / 3.0, 2.0 / 3.0, 0.0]),
            ([2.0, 1.0, 0.0], [0.5, 0.0, 0.5]),
        ] {
            let tensor = turn * Mat3::from_diagonal(&Vec3::from(values)) * turn.transpose();
            close(shares(&(tensor * 7.0)), wanted);
            close(shares(&(tensor * -7.0)), [-wanted[0], -wanted[1], wanted[2]]);
            let moment = (0.5 * values.iter().map(|value| value * value).sum::<f64>()).sqrt();
            assert!((source(&tensor).unwrap().moment - moment).abs() < 1e-14);
        }
        assert_eq!(shares(&Mat3::zeros()), [0.0; 3]);
        // 1 N m has magnitude -6, a thousand times as much 2 more.
        let slip = |size: f64| source(&(Mat3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0) * size)).unwrap();
        assert!((slip(1.0).magnitude + 6.0).abs() < 1e-14 && (slip(1e3).magnitude + 4.0).abs() < 1e-14);
    }

    /// One bond that breaks in tension `F` at the length `l` leaves two opposite changes of force: a dipole `F l` along it. One that breaks in
    /// shear leaves a couple; its symmetric part is slip of the moment `½ F l`.
    #[test]
    fn one_bond_has_the_moment_of_its_force() {
        let (force, length) = (5.0, 2e-3);
        let arms = [Vec3::x() * (-0.5 * length), Vec3::x() * (0.5 * length)];
        let opening = moment_tensor(&[Vec3::x() * -force, Vec3::x() * force], &arms).unwrap();
        assert!((opening - Mat3::from_diagonal(&Vec3::new(force * length, 0.0, 0.0))).norm() < 1e-17);
        close(shares(&opening), [1.0 / 3.0, 2.0 / 3.0, 0.0]);
        let slip = moment_tensor(&[Vec3::y() * -force, Vec3::y() * force], &arms).unwrap();
        close(shares(&slip), [0.0, 0.0, 1.0]);
        assert!((source(&slip).unwrap().moment - 0.5 * force * length).abs() < 1e-17);
        // Forces in balance: another center changes nothing.
        let moved = arms.map(|arm| arm + Vec3::new(3.0, 4.0, 5.0));
        let again = moment_tensor(&[Vec3::x() * -force, Vec3::x() * force], &moved).unwrap();
        assert!((again - opening).norm() < 1e-14);
    }

    #[test]
    fn what_has_no_meaning_is_refused() {
        let bad = [Vec3::x() * f64::NAN];
        assert!(moment_tensor(&bad, &[Vec3::x()]).is_err() && moment_tensor(&[Vec3::x()], &bad).is_err());
        assert!(moment_tensor(&[], &[Vec3::x()]).is_err());
        assert!(source(&Mat3::from_diagonal_element(f64::INFINITY)).is_err());
    }
}
