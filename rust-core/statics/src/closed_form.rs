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
