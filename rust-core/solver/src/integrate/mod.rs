//! Integration of the equations of motion of free spheres: kick and drift.
//!
//! Leapfrog: `v⁺ = v⁻ + a Δt`, `x' = x + v⁺ Δt`, `q' = exp(ω⁺Δt) q` (central differences; Madan 2019, (2.9)–(2.13)).
//! Velocity Verlet is the same recursion with a first kick of half a step, so that the given initial velocity is the
//! one at time 0 (its on-step velocity is `½(v⁻+v⁺)`).
//!
//! **Ledger.** With kinetic energy measured as `K = ½ m v⁻·v⁺` the recursion gives, without any error of order Δt,
//! `K(n) − K(n−1) = Σ ½(F(n−1) + F(n))·Δx(n)`: the trapezoidal rule over each force. Therefore the work of every external
//! force is booked in two halves: half the force times the displacement before the instant at which it acts, and half the
//! force times the displacement after.

mod batch;
mod chunk;
mod clumps;
mod damping;
mod kick;
mod particle;

use concordem_contact::math::{Mat3, Vec3};
use concordem_contact::wrench::Wrench;
use rayon::prelude::*;

pub use clumps::advance_clumps;
pub use damping::Damping;

use crate::evaluation::{TILE, TileMap};
use crate::lanes::dispatch;
use crate::state::{Cell, Particles};
use chunk::ChunkLoop;
use particle::{Chunk, Shared};

pub use crate::step_sums::KickSums;

/// Constants of the kick.
#[derive(Debug, Clone, Copy)]
pub struct KickContext<'a> {
    /// Time step, s.
    pub dt: f64,
    /// Fraction of the time step that this kick spans: 1, or ½ for the first kick of velocity Verlet.
    pub fraction: f64,
    /// Gravity, m/s².
    pub gravity: Vec3,
    /// Damping.
    pub damping: Damping,
    /// Periodic cell.
    pub cell: Option<&'a Cell>,
    /// Change of the cell's velocity gradient at this kick, 1/s. All particles follow it, except for constrained
    /// components, which have a prescribed velocity in space.
    pub gradient_change: Option<Mat3>,
    /// Whether particles also get the convective acceleration `L·v` of the cell's motion, as in YADE. Constrained
    /// components then also follow the cell, as in YADE.
    pub convective: bool,
    /// Velocities (m/s) and angular velocities (rad/s) that constrained degrees of freedom take at this kick, by particle;
    /// `None`: they keep theirs.
    pub targets: Option<&'a [(Vec3, Vec3)]>,
}

impl KickContext<'_> {
    /// Time that this kick spans, s.
    #[inline(always)]
    fn step(&self) -> f64 {
        self.dt * self.fraction
    }
}

/// Net contact forces (N) and torques about the centers (N·m), by particle.
#[derive(Debug, Clone, Copy)]
pub struct NetForces<'a> {
    /// Forces, N.
    pub force: &'a [Vec3],
    /// Torques, N·m.
    pub torque: &'a [Vec3],
}

/// Sum the forces and torques of each particle: those of its own tile, then those in the halos, in fixed order. Sets those of the tiles to
/// zero, for the next step.
pub fn gather(of_tiles: &mut [Wrench], maps: &[&TileMap], force: &mut [Vec3], torque: &mut [Vec3]) {
    let sums = force.par_chunks_mut(TILE).zip(torque.par_chunks_mut(TILE)).zip(of_tiles.par_chunks_mut(TILE));
    sums.enumerate().for_each(|(chunk, ((force, torque), of_tile))| {
        for ((force, torque), wrench) in force.iter_mut().zip(torque.iter_mut()).zip(of_tile) {
            *force = wrench.force;
            *torque = wrench.torque;
            *wrench = Wrench::default();
        }
        for map in maps {
            for (i, (force, torque)) in force.iter_mut().zip(torque.iter_mut()).enumerate() {
                for wrench in map.incoming(chunk * TILE + i) {
                    *force += wrench.force;
                    *torque += wrench.torque;
                }
            }
        }
    });
}

/// Kick and drift all particles outside of clumps; returns the sums of the kick.
pub fn kick_and_drift(context: &KickContext<'_>, particles: &mut Particles, net: NetForces<'_>) -> KickSums {
    let Particles {
        position,
        velocity,
        orientation,
        rotation_increment,
        angular_velocity,
        mass,
        inertia,
        clump,
        constraint,
        loads,
        previous,
        ..
    } = particles;
    let (mass, inertia, clump) = (&mass[..], &inertia[..], &clump[..]);
    let (constraint, loads) = (&constraint[..], &loads[..]);
    let mut previous = &mut previous[..];
    let chunks: Vec<Chunk<'_>> = position
        .chunks_mut(TILE)
        .zip(velocity.chunks_mut(TILE))
        .zip(orientation.chunks_mut(TILE))
        .zip(rotation_increment.chunks_mut(TILE))
        .zip(angular_velocity.chunks_mut(TILE))
        .enumerate()
        .map(|(c, ((((position, velocity), orientation), rotation_increment), angular_velocity))| Chunk {
            base: c * TILE,
            position,
            velocity,
            orientation,
            rotation_increment,
            angular_velocity,
            // Empty unless the damping reads it.
            previous: previous.split_off_mut(..TILE.min(previous.len())).unwrap_or_default(),
        })
        .collect();
    let gradient = context.cell.map(|cell| cell.velocity_gradient);
    let shared = Shared { context, mass, inertia, clump, constraint, loads, net, gradient };
    let sums: Vec<KickSums> =
        chunks.into_par_iter().map(|chunk| dispatch(ChunkLoop { shared: &shared, chunk })).collect();
    let mut total = KickSums::default();
    for s in &sums {
        total.merge(s);
    }
    total
}
