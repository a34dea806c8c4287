//! The identities of the operators (P1 to P24), their reference tables, and their errors.
//!
//! Tolerances are in units of rounding: a sum of n terms of size s is known to about `n·s·1.1e-16`; pass the size of
//! the terms to the helper [`close`].

mod bad_input;
mod fields;
mod identities;
mod not_finite;
mod references;
mod sampling;

use super::*;
use concordem_contact::math::{Mat3, Vec3};
use proptest::prelude::*;

/// Reproducible random numbers.
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }
    /// Uniform between 0 and 1 (SplitMix64).
    pub(super) fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
    pub(super) fn real(&mut self) -> f64 {
        2.0 * self.share() - 1.0
    }
    pub(super) fn vector(&mut self) -> Vec3 {
        Vec3::new(self.real(), self.real(), self.real())
    }
    pub(super) fn matrix(&mut self) -> Mat3 {
        Mat3::from_fn(|_, _| self.real())
    }
    pub(super) fn below(&mut self, n: usize) -> usize {
        ((self.share() * n as f64) as usize).min(n - 1)
    }
    /// A unit vector with uniformly distributed direction.
    pub(super) fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.vector();
            let n = v.norm();
            if n > 1e-3 && n < 1.0 {
                return v / n;
            }
        }
    }
    pub(super) fn rotation(&mut self) -> Mat3 {
        let q = nalgebra::UnitQuaternion::from_axis_angle(
            &nalgebra::Unit::new_normalize(self.direction()),
            3.0 * self.real(),
        );
        q.to_rotation_matrix().into_inner()
    }
}

/// Particles with random contacts, forces, moments, and motion; contact points anywhere near the branch vector.
#[derive(Debug, Clone, Default)]
pub(super) struct Cluster {
    pub position: Vec<Vec3>,
    pub radius: Vec<f64>,
    pub pair: Vec<[u32; 2]>,
    pub branch: Vec<Vec3>,
    pub point: Vec<Vec3>,
    pub force: Vec<Vec3>,
    pub moment: Vec<Vec3>,
    pub velocity: Vec<Vec3>,
    pub spin: Vec<Vec3>,
}

impl Cluster {
    pub(super) fn random(seed: u64) -> Self {
        let mut r = Random::new(seed);
        let n = 5 + r.below(30);
        let mut c = Self::default();
        for _ in 0..n {
            c.position.push(r.vector() + Vec3::new(0.3, -0.2, 0.5));
            c.radius.push(0.05 + 0.1 * r.share());
            c.velocity.push(r.vector());
            c.spin.push(r.vector());
        }
        for a in 0..n {
            for _ in 0..3 {
                let b = r.below(n);
                if a != b {
                    c.push(a, b, &mut r);
                }
            }
        }
        c
    }
    fn push(&mut self, a: usize, b: usize, r: &mut Random) {
        let l = self.position[b] - self.position[a];
        self.pair.push([a as u32, b as u32]);
        self.branch.push(l);
        self.point.push(self.position[a] + l * r.share() + r.vector() * 0.1);
        self.force.push(r.vector());
        self.moment.push(r.vector() * 0.3);
    }
    pub(super) fn set(&self) -> ContactSet<'_> {
        ContactSet::new(&self.position, &self.pair, &self.branch, &self.point, &self.force, Some(&self.moment)).unwrap()
    }
    /// Net wrenches of the internal contacts.
    pub(super) fn net(&self) -> Vec<couple_stress::Resultant> {
        couple_stress::resultants(&self.set())
    }
    /// Loads at the centers that balance every particle.
    pub(super) fn reactions(&self) -> Reactions {
        let net = self.net();
        Reactions {
            particle: (0..self.position.len() as u32).collect(),
            point: self.position.clone(),
            force: net.iter().map(|w| -w.force).collect(),
            moment: net.iter().map(|w| -w.moment).collect(),
        }
    }
}

pub(super) struct Reactions {
    pub particle: Vec<u32>,
    pub point: Vec<Vec3>,
    pub force: Vec<Vec3>,
    pub moment: Vec<Vec3>,
}

impl Reactions {
    pub(super) fn set(&self) -> LoadSet<'_> {
        LoadSet::new(usize::MAX, &self.particle, &self.point, &self.force, Some(&self.moment)).unwrap()
    }
}

/// Rounding of a few hundred additions of terms of the given size.
pub(super) const ROUNDING: f64 = 200.0 * f64::EPSILON;

#[track_caller]
pub(super) fn close(a: &Mat3, b: &Mat3, size: f64) {
    let error = (a - b).abs().max();
    assert!(error <= ROUNDING * size, "{a}{b} differ by {error:e}, allowed {:e}", ROUNDING * size);
}

#[track_caller]
pub(super) fn close_vector(a: &Vec3, b: &Vec3, size: f64) {
    let error = (a - b).abs().max();
    assert!(error <= ROUNDING * size, "{a}{b} differ by {error:e}, allowed {:e}", ROUNDING * size);
}

/// A random packing with unequal radii: a jittered lattice, so that no two points are near each other.
pub(super) fn packing(n: usize, jitter: f64, plane: bool, seed: u64) -> (Vec<Vec3>, Vec<f64>) {
    let mut r = Random::new(seed);
    let (mut position, mut radius) = (Vec::new(), Vec::new());
    for k in 0..if plane { n * n } else { n * n * n } {
        let cell = Vec3::new((k % n) as f64, (k / n % n) as f64, if plane { 0.0 } else { (k / (n * n)) as f64 });
        let mut x = cell + Vec3::repeat(0.5) + r.vector() * jitter;
        if plane {
            x.z = 0.0;
        }
        position.push(x / n as f64);
        radius.push((0.3 + 0.2 * r.share()) / n as f64);
    }
    (position, radius)
}

/// Number of cases per property; each case is cheap.
pub(super) fn cases(count: u32) -> ProptestConfig {
    ProptestConfig { cases: count, failure_persistence: None, ..ProptestConfig::default() }
}
