//! Elastic constants of links with uniformly distributed directions between particles that follow the uniform strain
//! without rotation.
//!
//! In space `K = Σk_N L²/9V`, `G = Σ(2k_N + 3k_T)L²/30V`: (3.38) of Stránský 2018. In the plane `K = Σk_N L²/4V`,
//! `G = Σ(k_N + k_T)L²/8V`: Voigt's moduli, (4.15)–(4.18) of Madan 2019. Deformable particles divide K by `1 + a_v` and
//! G by `1 + a_d`, because the mean forces on a particle strain it, and this strain is subtracted from the elongation
//! of its contacts, with `a_v = 2 c_v Z k_n/d` and `a_d = 2 c_d Z k_n q`. Here `c` are the compliances of the particle
//! ([`Compliance::principal`](concordem_contact::kinematics::deformable::Compliance::principal)), `Z k_n` is the sum
//! over its contacts (mean over particles), `d` the dimension, `q` = 2/15 in space and 1/4 in the plane (mean field, an
//! extension; for equal discs with 6 contacts `a_v` and `a_d` are the eigenvalues (3.76) of Madan 2019).

use super::LinkNetwork;

/// Isotropic elastic constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosedForm {
    /// Young's modulus, Pa.
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Bulk modulus, Pa; in the plane the two-dimensional one.
    pub bulk: f64,
    /// Shear modulus, Pa.
    pub shear: f64,
}

/// The closed form for the links of a cell; `None` without a cell or without stiffness.
///
/// ```
/// use concordem_contact::law::Stiffness;
/// use concordem_contact::math::Vec3;
/// use concordem_statics::{Accuracy, Link, LinkNetwork, cell_stiffness, closed_form};
///
/// // A cubic lattice: one sphere in a cell of 1 m³, joined to its own images by springs of 1 N/m.
/// let stiffness = Stiffness { normal: 1.0, ..Stiffness::default() };
/// let spring = |normal: Vec3| Link { a: 0, b: 0, branch: normal, normal, arm_a: 0.5, arm_b: 0.5, stiffness };
/// let network = LinkNetwork::new(1, vec![spring(Vec3::x()), spring(Vec3::y()), spring(Vec3::z())], Some(1.0));
/// // In the mean over directions, springs alone have a Poisson's ratio of a quarter.
/// assert!((closed_form(&network).unwrap().poisson - 0.25).abs() < 1e-12);
/// // The lattice itself has C₁₁ = 1 Pa along an edge, and no lateral strain.
/// let stiffness = cell_stiffness(&network, Accuracy::default()).unwrap().relaxed;
/// assert!((stiffness[(0, 0)] - 1.0).abs() < 1e-12 && stiffness[(0, 1)].abs() < 1e-12);
/// ```
pub fn closed_form(network: &LinkNetwork) -> Option<ClosedForm> {
    let volume = network.volume?;
    let (normal, tangential) = network.moduli_sums();
    let (mut bulk, mut shear) = if network.planar {
        (normal / (4.0 * volume), (normal + tangential) / (8.0 * volume))
    } else {
        (normal / (9.0 * volume), (2.0 * normal + 3.0 * tangential) / (30.0 * volume))
    };
    if !network.compliance.is_empty() {
        let mut contacts = vec![0.0; network.particles];
        for link in &network.links {
            contacts[link.a as usize] += link.stiffness.normal;
            contacts[link.b as usize] += link.stiffness.normal;
        }
        let (dimension, share) = if network.planar { (2.0, 0.25) } else { (3.0, 2.0 / 15.0) };
        let (mut volumetric, mut deviatoric) = (0.0, 0.0);
        for (compliance, stiffness) in network.compliance.iter().zip(&contacts) {
            let (direct, isotropic) = compliance.principal();
            volumetric += 2.0 * isotropic * stiffness / dimension;
            deviatoric += 2.0 * direct * stiffness * share;
        }
        bulk /= 1.0 + volumetric / network.particles as f64;
        shear /= 1.0 + deviatoric / network.particles as f64;
    }
    if !(bulk > 0.0 && shear > 0.0) {
        return None;
    }
    let (young, poisson) = if network.planar {
        (4.0 * bulk * shear / (bulk + shear), (bulk - shear) / (bulk + shear))
    } else {
        (9.0 * bulk * shear / (3.0 * bulk + shear), (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear))
    };
    Some(ClosedForm { young, poisson, bulk, shear })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Accuracy, Link, cell_stiffness};
    use concordem_contact::kinematics::deformable::{Condition, Deformable, Update};
    use concordem_contact::law::{Elastic, Stiffness};
    use concordem_contact::math::Vec3;

    /// A particle with twelve contacts in the directions of an icosahedron, as six links to its own images.
    fn icosahedron(shear: f64) -> LinkNetwork {
        let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
        let axes = [[0.0, 1.0, golden], [1.0, golden, 0.0], [golden, 0.0, 1.0]];
        let opposite = [[0.0, 1.0, -golden], [1.0, -golden, 0.0], [-golden, 0.0, 1.0]];
        let link = |axis: [f64; 3]| {
            let normal = Vec3::from(axis).normalize();
            let stiffness = Stiffness { normal: 2.0, shear, ..Stiffness::default() };
            Link { a: 0, b: 0, branch: normal * 0.4, normal, arm_a: 0.2, arm_b: 0.2, stiffness }
        };
        LinkNetwork::new(1, axes.into_iter().chain(opposite).map(link).collect(), Some(0.1))
    }

    /// These directions are as even as all directions together, up to the products of four that stiffness needs, and the
    /// particle stays in equilibrium. So the closed form is exact, also for a deformable particle without shear springs.
    /// Tolerance: rounding of six links.
    #[test]
    fn even_directions_have_the_closed_form() {
        let solid = Deformable {
            elasticity: vec![Elastic { young: 15.0, poisson: 0.3 }],
            condition: Condition::Solid,
            update: Update::Lagged,
            dashpots: false,
        };
        for (shear, compliance) in [(0.7, vec![]), (0.0, vec![solid.compliance(0, 0.2)])] {
            let network = LinkNetwork { compliance, ..icosahedron(shear) };
            let closed = closed_form(&network).unwrap();
            let cell = cell_stiffness(&network, Accuracy::default()).unwrap();
            for exact in [cell.affine_constants().unwrap(), cell.constants().unwrap()] {
                assert!(exact.anisotropy().shear < 1e-12, "{exact:?}");
                for (found, expected) in [
                    (closed.bulk, exact.bulk),
                    (closed.shear, exact.mean_shear),
                    (closed.young, exact.mean_young),
                    (closed.poisson, exact.mean_poisson),
                ] {
                    assert!((found / expected - 1.0).abs() < 1e-12, "{closed:?} {exact:?}");
                }
            }
        }
    }
}
