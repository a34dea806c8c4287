//! Contacts measured many at a time: their numbers are laid out as one array per component, and a formula runs over the
//! arrays, where the compiler uses the wide registers of the processor. Nothing is fused or reordered: the bits are those of
//! the formula applied to each contact alone.

use super::deformable::ParticleVirial;
use super::sphere_sphere::{ImageShift, Motion};
use super::{BranchVector, PointKinematics, PreviousGeometry};
use crate::law::{ContactGeometry, ContactLaw, Reference, Response};
use crate::math::{Quat, Symmetric, Vec3};

/// Most contacts in a [`Batch`].
pub const BATCH: usize = 32;

/// What the measure of most contacts reads of a particle, in one line of the processor's cache.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Pose {
    /// Centre at the end of the step, m.
    pub position: Vec3,
    /// Rotation of the step, which the default measure reads; or orientation (body to world), which beams do.
    pub rotation: Quat,
    /// Radius, m.
    pub radius: f64,
}

/// Contacts of law `L` that are measured and answered in one go. A contact's data stay the same until it is answered.
pub trait Batch<L: ContactLaw> {
    /// Whether there may be a periodic cell.
    const PERIODIC: bool;
    /// Whether the energies stored in contacts may be wanted, too.
    const SAMPLE: bool;
    /// Whether particles may deform.
    const DEFORM: bool;
    /// Contact `i` seen from A: its two particles with their rotations of the step, and the displacement of B's image (m).
    fn poses(&self, i: usize) -> ([Pose; 2], Vec3);
    /// Motions of A and B, and the image of B.
    fn motions(&self, i: usize) -> ([Motion; 2], ImageShift);
    /// Positions and orientations of A and B, and the displacement of B's image (m).
    fn ends(&self, i: usize) -> ([Vec3; 2], [Quat; 2], Vec3);
    /// Geometry, memory of the last step, and whether the contact is a bond.
    fn constants(&self, i: usize) -> (ContactGeometry, PreviousGeometry, bool);
    /// Of [`Self::constants`] the reference, and whether the contact is a bond.
    fn reference(&self, i: usize) -> (Reference, bool);
    /// Of [`Self::constants`] the memory of the last step.
    fn frame(&self, i: usize) -> PreviousGeometry;
    /// Of [`Self::constants`] the masses of A and B, kg.
    fn masses(&self, i: usize) -> [f64; 2];
    /// History of contact `i`.
    fn history(&self, i: usize) -> &L::State;
    /// The law with the parameters of contact `i`, and the contact's history.
    fn law(&self, i: usize) -> (&L, &L::State);
    /// Number of the parameters of contact `i`: contacts with equal numbers have equal ones.
    fn row(&self, i: usize) -> u16;
    /// How far the surfaces of A and B moved out, in sum, m; only if particles deform.
    fn surface_displacement(&self, i: usize) -> Symmetric;
    /// Whether forces of dashpots strain particles.
    fn dashpots_strain(&self) -> bool;
    /// Takes the measure of contact `i`, which the law answers. Each contact is answered once, in ascending order, by this
    /// or by one of the two that follow.
    fn evaluate(&mut self, i: usize, kinematics: &L::Kinematics);
    /// Takes the measure of contact `i` and the law's answer to it.
    fn commit(&mut self, i: usize, point: &PointKinematics, response: &Response<L::State>);
    /// Takes what a law found in columns for the bond `i`, which lives on.
    fn commit_result(&mut self, i: usize, found: &BatchResult<L::State>);
}

/// What a law without damage found for a bond that lives on, when no stored energies are wanted.
#[derive(Debug, Clone, Copy)]
pub struct BatchResult<S> {
    /// The line between the centres.
    pub branch: BranchVector,
    /// Force on A, N.
    pub force: Vec3,
    /// Torques on A and B about their centres, N·m.
    pub torques: [Vec3; 2],
    /// [`EnergySplit::viscous`](crate::law::EnergySplit) and `integration`, J; none if they are zero.
    pub energy: Option<[f64; 2]>,
    /// History after the step; none if it is the one before.
    pub state: Option<S>,
    /// What the contact does to the shape of its particles, if they deform.
    pub push: Option<ParticleVirial>,
}

/// Most components of an input or output.
const COMPONENTS: usize = 37;

/// Arrays of a batch, one per component, kept from batch to batch.
#[derive(Debug, Clone)]
pub struct Columns {
    input: [[f64; BATCH]; COMPONENTS],
    output: [[f64; BATCH]; COMPONENTS],
}

impl Default for Columns {
    fn default() -> Self {
        Self { input: [[0.0; BATCH]; COMPONENTS], output: [[0.0; BATCH]; COMPONENTS] }
    }
}

/// What is found for each contact alone: `I` numbers in, `O` numbers out. Without branches it runs fast.
pub trait Formula<const I: usize, const O: usize> {
    /// The numbers of one contact.
    fn apply(&self, input: [f64; I]) -> [f64; O];
}

impl Columns {
    /// Write the input of contact `i`.
    #[inline(always)]
    pub fn set<const I: usize>(&mut self, i: usize, input: [f64; I]) {
        self.set_from(0, i, input);
    }

    /// Write the input of contact `i` from component `first` on. Rows longer than some twenty numbers are better written in parts:
    /// a compiler keeps those in registers.
    #[inline(always)]
    pub fn set_from<const I: usize>(&mut self, first: usize, i: usize, input: [f64; I]) {
        for (column, value) in self.input[first..].iter_mut().zip(input) {
            column[i] = value;
        }
    }

    /// Output of contact `i`.
    #[inline(always)]
    pub fn get<const O: usize>(&self, i: usize) -> [f64; O] {
        self.get_from(0, i)
    }

    /// Output of contact `i` from component `first` on.
    #[inline(always)]
    pub fn get_from<const O: usize>(&self, first: usize, i: usize) -> [f64; O] {
        let mut output = [0.0; O];
        for (value, column) in output.iter_mut().zip(&self.output[first..]) {
            *value = column[i];
        }
        output
    }

    /// Apply a formula to all contacts. Rows without a contact are computed from what is there, and never read.
    #[inline(always)]
    pub fn apply<const I: usize, const O: usize>(&mut self, formula: &impl Formula<I, O>) {
        const { assert!(I <= COMPONENTS && O <= COMPONENTS) };
        for i in 0..BATCH {
            let mut row = [0.0; I];
            for (value, column) in row.iter_mut().zip(&self.input) {
                *value = column[i];
            }
            for (value, column) in formula.apply(row).into_iter().zip(&mut self.output) {
                column[i] = value;
            }
        }
    }
}
