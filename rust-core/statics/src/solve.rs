//! Solution of `K u = f` by conjugate gradients.
//!
//! The matrix is never assembled: the response of a link costs some sixty operations, less than the memory traffic of
//! its part of an assembled matrix. The iteration is preconditioned with the inverse of each particle's 6×6 diagonal
//! block. Motions that no link of a particle resists have no load either, and the pseudo-inverse omits them, so mechanisms
//! need no artificial stiffness. Each right-hand side is solved sequentially, so the bits do not depend on the number of
//! threads.
//!
//! **Deformable particles** couple all contacts of a particle. With the matrix `B` of the iteration between forces and
//! strains ([`coupling`](concordem_solver::coupling)), normal forces are `(1−B)⁻¹ k_n (G u − …)`, where the right-hand
//! side contains the shear forces, which also strain the particles. Conjugate gradients inside each product solve for
//! `1−B`, which is symmetric and never singular, whether or not the iteration itself converges. With shear forces the
//! matrix is not symmetric, and stabilized biconjugate gradients replace conjugate gradients. In the transposed
//! system, which derivatives need, the particles' strains act on shear springs, but shear forces do not strain the
//! particles.

use nalgebra::Vector6;

use super::iterative::{Accuracy, solve};
use super::link::NodeMotion;
use super::stiffness_product::{StiffnessProduct, add, motion};
use super::{LinkNetwork, StaticsError};

/// A degree of freedom with a prescribed motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Support {
    /// Particle.
    pub particle: usize,
    /// Degree of freedom: 0 to 2, displacement along x, y, z; 3 to 5, rotation about them.
    pub freedom: usize,
    /// Prescribed motion, m or rad.
    pub value: f64,
}

/// Equilibrium of all particles under supports and loads.
#[derive(Debug, Clone, PartialEq)]
pub struct StaticState {
    /// Motion of each particle.
    pub motion: Vec<NodeMotion>,
    /// Force (N) and moment (N·m) on each particle from outside: the loads, and the reactions of supports.
    pub holding: Vec<NodeMotion>,
    /// Iterations of the solver.
    pub iterations: usize,
}

/// Equilibrium under prescribed motions and loads (forces in N, moments in N·m, by particle).
///
/// # Errors
/// A support or load on a particle that does not exist; loads on a zero-energy mode; no convergence.
pub fn solve_supported(
    network: &LinkNetwork,
    supports: &[Support],
    loads: &[(usize, NodeMotion)],
    accuracy: Accuracy,
) -> Result<StaticState, StaticsError> {
    let (particles, scale) = (network.particles, network.scale);
    let unit = |freedom: usize| if freedom < 3 { 1.0 } else { scale };
    let mut free = vec![true; 6 * particles];
    let mut given = vec![0.0; 6 * particles];
    for support in supports {
        let Support { particle, freedom, value } = *support;
        if particle >= particles || freedom >= 6 {
            return Err(StaticsError::Place { particle, freedom, particles });
        }
        free[6 * particle + freedom] = false;
        given[6 * particle + freedom] = value * unit(freedom);
    }
    let mut load = vec![0.0; 6 * particles];
    for (particle, wrench) in loads {
        if *particle >= particles {
            return Err(StaticsError::Place { particle: *particle, freedom: 0, particles });
        }
        add(&mut load, *particle, wrench, scale);
    }
    let whole = StiffnessProduct::new(network, Vec::new());
    let mut held = vec![0.0; 6 * particles];
    whole.multiply(&mut held, &given);
    for ((load, held), free) in load.iter_mut().zip(&held).zip(&free) {
        *load = if *free { *load - held } else { 0.0 };
    }
    let product = StiffnessProduct::new(network, free.clone());
    let (inverses, _) = product.inverse_diagonal_blocks();
    // A load along a zero-energy mode has no equilibrium.
    let size = load.iter().fold(0.0_f64, |s, x| s.max(x.abs()));
    let blocks_of = |p: usize| {
        let x = Vector6::from_column_slice(&load[6 * p..6 * p + 6]);
        (x, inverses[p] * x)
    };
    if (0..particles).any(|p| {
        let (x, y) = blocks_of(p);
        y == Vector6::zeros() && x.abs().max() > 1e-12 * size
    }) {
        return Err(StaticsError::Unsupported { what: "equilibrium".into() });
    }
    let (solution, iterations) = solve(&product, &inverses, &[load], &["equilibrium"], accuracy, 0.0)?;
    let x: Vec<f64> = solution[0].iter().zip(&given).map(|(x, given)| x + given).collect();
    let mut holding = vec![0.0; 6 * particles];
    whole.multiply(&mut holding, &x);
    let unscale = |y: &[f64], p: usize| {
        let part = motion(y, p, 1.0);
        NodeMotion { displacement: part.displacement, rotation: part.rotation * scale }
    };
    Ok(StaticState {
        motion: (0..particles).map(|p| motion(&x, p, scale)).collect(),
        holding: (0..particles).map(|p| unscale(&holding, p)).collect(),
        iterations,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Link;
    use concordem_contact::law::Stiffness;
    use concordem_contact::math::Vec3;

    /// Cantilever of `n` links along x: stiffness of the Euler-Bernoulli beam in each.
    fn cantilever(n: usize, length: f64, ei: f64) -> LinkNetwork {
        let l = length / n as f64;
        let k = Stiffness {
            normal: 50.0 / l,
            shear: 12.0 * ei / (l * l * l),
            bending: ei / l,
            twist: 0.8 / l,
            ..Stiffness::default()
        };
        let link = |i: usize| Link {
            a: i as u32,
            b: i as u32 + 1,
            branch: Vec3::x() * l,
            normal: Vec3::x(),
            arm_a: 0.5 * l,
            arm_b: 0.5 * l,
            stiffness: k,
        };
        LinkNetwork::new(n + 1, (0..n).map(link).collect(), None)
    }

    fn clamp(particle: usize) -> Vec<Support> {
        (0..6).map(|freedom| Support { particle, freedom, value: 0.0 }).collect()
    }

    /// End load: w = FL³/3EI, φ = FL²/2EI, reaction −F with the moment −FL, for any number of elements (the cubic is
    /// exact in every element). The condition number grows like n⁴: 20⁴·2⁻⁵³ = 2e-11.
    #[test]
    fn cantilever_under_an_end_load() {
        let (n, length, ei, load) = (20, 2.0, 3.0, 0.7);
        let network = cantilever(n, length, ei);
        let wrench = NodeMotion { displacement: Vec3::new(0.0, load, 0.0), rotation: Vec3::zeros() };
        let accuracy = Accuracy { residual: 1e-13, iterations: 10_000 };
        let state = solve_supported(&network, &clamp(0), &[(n, wrench)], accuracy).unwrap();
        let end = state.motion[n];
        assert!((end.displacement.y / (load * length.powi(3) / (3.0 * ei)) - 1.0).abs() < 1e-9, "{end:?}");
        assert!((end.rotation.z / (load * length.powi(2) / (2.0 * ei)) - 1.0).abs() < 1e-9, "{end:?}");
        let held = state.holding[0];
        assert!(
            (held.displacement.y + load).abs() < 1e-9 && (held.rotation.z + load * length).abs() < 1e-9,
            "{held:?}"
        );
    }

    /// A prescribed end rotation about the axis: all links twist equally, moment = k_W φ/n.
    #[test]
    fn prescribed_twist() {
        let (n, twist) = (10, 0.3);
        let network = cantilever(n, 1.0, 1.0);
        let mut supports = clamp(0);
        supports.push(Support { particle: n, freedom: 3, value: twist });
        let state = solve_supported(&network, &supports, &[], Accuracy::default()).unwrap();
        let moment = 0.8 * twist;
        assert!((state.holding[n].rotation.x - moment).abs() < 1e-9, "{:?}", state.holding[n]);
        assert!((state.motion[n / 2].rotation.x - 0.5 * twist).abs() < 1e-9);
    }

    #[test]
    fn impossible_problems_are_refused() {
        let network = cantilever(3, 1.0, 1.0);
        let wrench = NodeMotion { displacement: Vec3::y(), rotation: Vec3::zeros() };
        let far = solve_supported(&network, &clamp(9), &[], Accuracy::default());
        assert_eq!(far, Err(StaticsError::Place { particle: 9, freedom: 0, particles: 4 }));
        // Without supports the load has no equilibrium; the iteration finds a zero-energy direction.
        let loose = solve_supported(&network, &[], &[(1, wrench)], Accuracy::default());
        assert!(loose.is_err(), "{loose:?}");
    }
}
