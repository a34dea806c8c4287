//! All links of an assembly.

use super::{Link, StaticsError};
use concordem_contact::kinematics::deformable::Compliance;
use concordem_solver::Model;
use concordem_solver::state::contacts::ContactFlags;
use concordem_solver::state::{Constraint, State};

/// The links of an assembly of `particles` particles.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkNetwork {
    /// Number of particles.
    pub particles: usize,
    /// Links, in the order of the blocks they come from.
    pub links: Vec<Link>,
    /// Volume of the periodic cell, m³, if there is one.
    pub volume: Option<f64>,
    /// Typical arm, m: factor of rotations where they are combined with displacements.
    pub scale: f64,
    /// Whether particles are discs in the plane z = 0; then strains along and across z have no meaning.
    pub planar: bool,
    /// Compliance of each particle under the forces on it; empty if all are rigid.
    pub compliance: Vec<Compliance>,
}

/// Particles that links do not hold.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Loose {
    /// Rattlers: particles without links, or with one link to the rest (removed repeatedly). They carry no force in
    /// equilibrium.
    pub rattlers: usize,
    /// Zero-energy modes of single particles other than rattlers: a particle with two links rotates about the line
    /// through both contact points; rotations of particles whose links resist none.
    pub mechanisms: usize,
}

impl LinkNetwork {
    /// The intact bonds of a state, between particles that deform as the model says ([`Model::deformable`]).
    ///
    /// # Errors
    /// [`StaticsError::NoLinks`].
    pub fn of_model(state: &State, model: &Model) -> Result<Self, StaticsError> {
        let mut network = Self::of_state(state)?;
        if let Some(deformable) = &model.deformable {
            let bodies = state.particles.material.iter().zip(&state.particles.radius);
            network.compliance = bodies.map(|(&material, &radius)| deformable.compliance(material, radius)).collect();
        }
        Ok(network)
    }

    /// The intact bonds of a state, elastic and in its present geometry, between rigid particles.
    pub fn of_state(state: &State) -> Result<Self, StaticsError> {
        let mut links = Vec::new();
        for block in &state.bonds {
            let block = block.contacts();
            for k in 0..block.len() {
                let view = block.view(k);
                if !view.flags.has(ContactFlags::BONDED) || view.flags.has(ContactFlags::BROKEN) {
                    continue;
                }
                let (a, b) = (view.pair.a as usize, view.pair.b as usize);
                let x = &state.particles.position;
                let shift = state.cell.as_ref().map(|cell| cell.shift(view.flags.image)).unwrap_or_default();
                let branch = x[b] + shift - x[a];
                let length = branch.norm();
                let (arm_a, arm_b) = block.arms(k, &state.particles, length);
                links.push(Link {
                    a: view.pair.a,
                    b: view.pair.b,
                    branch,
                    normal: branch / length,
                    arm_a,
                    arm_b,
                    stiffness: block.stiffness(k, &state.particles, false),
                });
            }
        }
        if links.is_empty() {
            return Err(StaticsError::NoLinks);
        }
        let volume = state.cell.as_ref().map(concordem_solver::state::Cell::volume);
        let planar = is_planar(state);
        Ok(Self { planar, ..Self::new(state.particles.len(), links, volume) })
    }

    /// A network of the given links between rigid particles in space; `volume` of the periodic cell in m³.
    pub fn new(particles: usize, links: Vec<Link>, volume: Option<f64>) -> Self {
        let scale = links.iter().map(|l| 0.5 * (l.arm_a + l.arm_b)).sum::<f64>() / links.len().max(1) as f64;
        Self { particles, links, volume, scale, planar: false, compliance: Vec::new() }
    }

    /// Remove the links of rattlers: a particle with one link to the rest has no force in it. Returns their number.
    pub fn remove_rattlers(&mut self) -> usize {
        let mut count = vec![0u32; self.particles];
        let mut of: Vec<Vec<u32>> = vec![Vec::new(); self.particles];
        for (k, link) in self.links.iter().enumerate() {
            for p in [link.a, link.b] {
                count[p as usize] += 1;
                of[p as usize].push(k as u32);
            }
        }
        let mut gone = vec![false; self.links.len()];
        let mut pending: Vec<usize> = (0..self.particles).filter(|&p| count[p] <= 1).collect();
        let mut rattlers = 0;
        while let Some(p) = pending.pop() {
            rattlers += 1;
            for &k in &of[p] {
                if gone[k as usize] {
                    continue;
                }
                gone[k as usize] = true;
                let link = &self.links[k as usize];
                let other = (if link.a as usize == p { link.b } else { link.a }) as usize;
                count[p] -= 1;
                if other != p {
                    count[other] -= 1;
                    if count[other] == 1 {
                        pending.push(other);
                    }
                }
            }
        }
        let mut k = 0;
        self.links.retain(|_| {
            k += 1;
            !gone[k - 1]
        });
        rattlers
    }

    /// Sums over all links of k L² (J), for k_N and k_T: `Σ Ē A L` and `Σ Ḡ A L`.
    pub fn moduli_sums(&self) -> (f64, f64) {
        self.links.iter().fold((0.0, 0.0), |(normal, shear), link| {
            let square = link.branch.norm_squared();
            (normal + link.stiffness.normal * square, shear + link.stiffness.shear * square)
        })
    }

    /// The network with all stiffnesses and the moduli of deformable particles multiplied by `all`, and shear
    /// stiffnesses also by `shear`.
    pub fn scaled(&self, all: f64, shear: f64) -> Self {
        let mut network = self.clone();
        for link in &mut network.links {
            let k = &mut link.stiffness;
            k.normal *= all;
            k.shear *= all * shear;
            k.bending *= all;
            k.twist *= all;
        }
        for compliance in &mut network.compliance {
            *compliance = compliance.stiffened(all);
        }
        network
    }
}

/// Whether all particles are discs that stay in the plane z = 0.
pub(super) fn is_planar(state: &State) -> bool {
    let across = Constraint(0b011_100).0;
    let held = &state.particles.constraint;
    !held.is_empty() && held.iter().all(|constraint| constraint.0 & across == across)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Accuracy, cell_stiffness};
    use concordem_contact::kinematics::PreviousGeometry;
    use concordem_contact::law::{LinearBond, Reference, Stiffness};
    use concordem_contact::math::Vec3;
    use concordem_solver::state::Sphere;
    use concordem_solver::state::contacts::{ContactBlock, Pair};

    fn link(a: u32, b: u32, normal: Vec3, stiffness: Stiffness) -> Link {
        Link { a, b, branch: normal, normal, arm_a: 0.5, arm_b: 0.5, stiffness }
    }

    /// A triangle of three particles in the plane, two more in a row that hangs on it, and one without links.
    fn hanging() -> LinkNetwork {
        let stiffness = Stiffness { normal: 2.0, shear: 1.0, ..Stiffness::default() };
        let (x, slope) = (Vec3::x(), Vec3::new(0.5, 0.75_f64.sqrt(), 0.0));
        let links = [(0, 1, x), (0, 2, slope), (1, 2, slope - x), (0, 3, -x), (4, 3, x)];
        let links = links.into_iter().map(|(a, b, normal)| link(a, b, normal, stiffness)).collect();
        LinkNetwork { planar: true, ..LinkNetwork::new(6, links, Some(100.0)) }
    }

    /// Rattlers are removed one after the other. In the plane each of them has three freedoms, and all others here are held.
    #[test]
    fn particles_that_hang_on_one_link_are_rattlers() {
        let mut network = hanging();
        assert_eq!(cell_stiffness(&network, Accuracy::default()).unwrap().loose, Loose { rattlers: 3, mechanisms: 0 });
        assert_eq!(network.remove_rattlers(), 3);
        assert_eq!(network.links, hanging().links[..3]);
    }

    /// Two layers of one particle each, linked to its own images in the layer and to the other layer across it. Normal springs leave
    /// each particle its rotations and the motions in its layer, because its images move with it.
    #[test]
    fn a_link_to_the_own_image_holds_no_translation() {
        let spring = Stiffness { normal: 2.0, ..Stiffness::default() };
        let ends = [(0, 0, Vec3::x()), (0, 0, Vec3::y()), (1, 1, Vec3::x()), (1, 1, Vec3::y())];
        let across = [(0, 1, Vec3::z()), (0, 1, -Vec3::z())];
        let links = ends.into_iter().chain(across).map(|(a, b, normal)| link(a, b, normal, spring)).collect();
        let network = LinkNetwork::new(2, links, Some(2.0));
        let loose = cell_stiffness(&network, Accuracy::default()).unwrap().loose;
        assert_eq!(loose, Loose { rattlers: 0, mechanisms: 2 * 5 });
    }

    /// Exact numbers.
    #[test]
    fn scaling_has_one_factor_for_all_and_one_for_shear() {
        let stiffness = Stiffness { normal: 1.0, shear: 2.0, bending: 3.0, twist: 4.0, ..Stiffness::default() };
        let network = LinkNetwork::new(2, vec![link(0, 1, Vec3::x(), stiffness)], None).scaled(4.0, 0.25);
        let scaled = Stiffness { normal: 4.0, shear: 2.0, bending: 12.0, twist: 16.0, ..Stiffness::default() };
        assert_eq!(network.links[0].stiffness, scaled);
    }

    /// Only intact bonds are links.
    #[test]
    fn broken_bonds_are_no_links() {
        let mut state = State::default();
        let mut bonds = ContactBlock::new(vec![LinearBond::new(5.0, 1.0, 0.0, f64::INFINITY, f64::INFINITY).unwrap()]);
        for p in 0..3_u32 {
            let sphere = Sphere { position: Vec3::x() * f64::from(p), radius: 0.5 };
            state.particles.push(sphere, 0, 1.0, 1.0);
            if p > 0 {
                let bits = ContactFlags::BONDED | if p == 2 { ContactFlags::BROKEN } else { ContactFlags::ACTIVE };
                let flags = ContactFlags { bits, ..ContactFlags::default() };
                let (pair, reference) = (Pair { a: p - 1, b: p }, Reference { length: 1.0, area: 1.0 });
                bonds.push(pair, flags, reference, PreviousGeometry { normal: Vec3::x(), length: 1.0 });
            }
        }
        state.bonds.push(Box::new(bonds));
        let links = LinkNetwork::of_state(&state).unwrap().links;
        assert_eq!((links.len(), links[0].a, links[0].stiffness.normal), (1, 0, 5.0));
    }
}
