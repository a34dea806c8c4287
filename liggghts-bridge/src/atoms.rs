//! The atoms of one processor, as LIGGGHTS holds them: owned ones first, then copies of neighbours.

use concordem_contact::math::Vec3;

/// Atoms as slices; vectors are three reals one after the other.
pub struct Atoms<'a> {
    /// Number of owned atoms.
    pub owned: usize,
    /// Id of every atom, copies included; as in all slices unless said otherwise.
    pub tag: &'a [i32],
    /// Type, from 1.
    pub kind: &'a [i32],
    /// Groups.
    pub mask: &'a [i32],
    /// Bit of the group that takes part.
    pub group: i32,
    /// Position, m; of copies: that of the original, not of its periodic image.
    pub position: &'a [f64],
    /// Velocity, m/s.
    pub velocity: &'a [f64],
    /// Angular velocity, rad/s.
    pub spin: &'a [f64],
    /// Radius, m.
    pub radius: &'a [f64],
    /// Mass, kg.
    pub mass: &'a [f64],
    /// Force, N, to be added to.
    pub force: &'a mut [f64],
    /// Torque, N·m, to be added to.
    pub torque: &'a mut [f64],
    /// What the network remembers of every atom ([`Network::atom_width`](crate::network::Network::atom_width) reals each).
    pub memory: &'a mut [f64],
    /// Periodic edge lengths of the box, m; 0 where it is not periodic.
    pub edge: [f64; 3],
    /// Time step, s.
    pub dt: f64,
    /// Number of the step.
    pub step: i64,
}

/// Vector `i` of a slice.
#[inline(always)]
pub fn vector(reals: &[f64], i: usize) -> Vec3 {
    Vec3::new(reals[3 * i], reals[3 * i + 1], reals[3 * i + 2])
}

/// Add to vector `i` of a slice.
#[inline(always)]
pub fn add(reals: &mut [f64], i: usize, v: &Vec3) {
    reals[3 * i] += v.x;
    reals[3 * i + 1] += v.y;
    reals[3 * i + 2] += v.z;
}
