//! Evaluation of many contacts of one law at a time.

use super::contract::{ContactLaw, Response};
use crate::columns::{Columns, Lanes};
use crate::geometry::PreviousGeometry;
use crate::kinematics::deformable::ParticleVirial;
use crate::kinematics::{
    BranchVector, Kinematics, MotionMeasure, MotionSink, PointKinematics, measure_contact, measure_each,
};
use crate::wrench::Wrenches;

/// Contacts of law `L` that are measured and evaluated together.
///
/// Each contact is evaluated once, in ascending order, by one of [`evaluate`](MotionSink::evaluate), [`commit`](Self::commit),
/// and [`commit_result`](Self::commit_result).
pub trait Batch<L: ContactLaw>: MotionSink<L::Kinematics> {
    /// Whether the evaluation also needs stored energies.
    const SAMPLE: bool;

    /// History of contact `i`.
    fn history(&self, i: usize) -> &L::State;

    /// Histories of four contacts.
    #[inline(always)]
    fn four_histories(&self, [i, j, k, l]: [usize; 4]) -> [&L::State; 4] {
        [self.history(i), self.history(j), self.history(k), self.history(l)]
    }

    /// The law with the parameters of contact `i`, and the contact's history.
    fn law(&self, i: usize) -> (&L, &L::State);

    /// Whether the first `count` contacts have equal parameters.
    fn alike(&self, count: usize) -> bool;

    /// Whether contact `i` begins with the energy of a bond that broke before. Its ledger needs the whole motion of the step,
    /// which columns may leave out: the scalar path evaluates it.
    fn inherits(&self, i: usize) -> bool;

    /// Damage from which on the event log records a contact.
    fn damage_threshold(&self) -> f64;

    /// Whether the event log has to record the damage of contact `i`, whose history after the step is `state`. The scalar path
    /// evaluates such a contact, because the log needs energies that columns leave out.
    fn reports(&self, i: usize, state: &L::State) -> bool;

    /// Whether dashpot forces strain particles.
    fn dashpots_strain(&self) -> bool;

    /// Store the motion and response of contact `i`.
    fn commit(&mut self, i: usize, point: &PointKinematics, response: &Response<L::State>);

    /// Store the result that the law computed in columns for contact `i`, which survives the step.
    fn commit_result<R: ColumnResult<L::State>>(&mut self, i: usize, result: &R);

    /// Store the results that the law computed in columns for contacts `i` to `i + 3`, which survive the step.
    fn commit_four<R: ColumnResults<L>>(&mut self, i: usize, results: &R);
}

/// Results of a law in columns, in steps without a sample. The numbers that the caller stores as rows come from the columns four by
/// four ([`Lanes`]), the others one by one.
pub trait ColumnResults<L: ContactLaw> {
    /// Whether contact `i` needs the scalar path, because it ends, or because of what the columns leave out.
    fn need_scalar_path<B: Batch<L>>(&self, i: usize, batch: &B) -> bool;
    /// Normals and lengths of contacts `i` to `i + 3` after the step.
    fn geometries(&self, i: usize, lanes: impl Lanes) -> [PreviousGeometry; 4];
    /// Histories of contacts `i` to `i + 3` after the step; `None` if they did not change.
    fn states(&self, i: usize, lanes: impl Lanes) -> Option<[L::State; 4]>;
    /// Forces and torques of contacts `i` to `i + 3`.
    fn wrenches(&self, i: usize, lanes: impl Lanes) -> [Wrenches; 4];
    /// Result for contact `i`.
    fn result(&self, i: usize) -> impl ColumnResult<L::State>;
}

/// Commit the first `count` contacts of a batch from columns, four at a time where none of them needs the scalar path.
#[inline(always)]
pub(super) fn commit_columns<L: ContactLaw, B: Batch<L>, R: ColumnResults<L>>(
    mode: MotionMeasure,
    count: usize,
    dt: f64,
    batch: &mut B,
    results: &R,
) {
    for first in (0..count).step_by(4) {
        let group = first..count.min(first + 4);
        let mut scalar = group.len() < 4;
        for i in group.clone() {
            scalar |= results.need_scalar_path(i, batch);
        }
        if !scalar {
            batch.commit_four(first, results);
            continue;
        }
        for i in group {
            if results.need_scalar_path(i, batch) {
                evaluate_one(mode, i, dt, batch);
            } else {
                batch.commit_result(i, &results.result(i));
            }
        }
    }
}

/// Result of a law for a contact that survives the step, in steps without a sample.
///
/// The caller reads each part when it stores it. A law that reads them from its columns keeps few numbers in registers;
/// [`BatchResult`] is a result whose parts are known.
pub trait ColumnResult<S> {
    /// Line between the centers.
    fn branch(&self) -> BranchVector;
    /// Forces and torques on A and B.
    fn wrenches(&self) -> Wrenches;
    /// [`EnergySplit::viscous`](super::EnergySplit) and `integration`, J; `None` if both are zero.
    fn energy(&self) -> Option<[f64; 2]>;
    /// [`EnergySplit::friction`](super::EnergySplit), J; `None` if it is zero.
    fn friction(&self) -> Option<f64>;
    /// History after the step; `None` if it did not change.
    fn state(&self) -> Option<S>;
    /// Contribution to the deformation of the particles, if they deform.
    fn virial(&self) -> Option<ParticleVirial>;
    /// [`EnergySplit::damage`](super::EnergySplit), J; `None` under laws without damage.
    fn damage(&self) -> Option<f64> {
        None
    }
}

/// [`ColumnResult`] of a contact under a law without damage.
#[derive(Debug, Clone, Copy)]
pub struct BatchResult<S> {
    /// Line between the centers.
    pub branch: BranchVector,
    /// Forces and torques on A and B.
    pub wrenches: Wrenches,
    /// [`EnergySplit::viscous`](super::EnergySplit) and `integration`, J; `None` if both are zero.
    pub energy: Option<[f64; 2]>,
    /// [`EnergySplit::friction`](super::EnergySplit), J; `None` if it is zero.
    pub friction: Option<f64>,
    /// History after the step; `None` if it did not change.
    pub state: Option<S>,
    /// Contribution to the deformation of the particles, if they deform.
    pub virial: Option<ParticleVirial>,
}

impl<S: Copy> ColumnResult<S> for BatchResult<S> {
    #[inline(always)]
    fn branch(&self) -> BranchVector {
        self.branch
    }

    #[inline(always)]
    fn wrenches(&self) -> Wrenches {
        self.wrenches
    }

    #[inline(always)]
    fn energy(&self) -> Option<[f64; 2]> {
        self.energy
    }

    #[inline(always)]
    fn friction(&self) -> Option<f64> {
        self.friction
    }

    #[inline(always)]
    fn state(&self) -> Option<S> {
        self.state
    }

    #[inline(always)]
    fn virial(&self) -> Option<ParticleVirial> {
        self.virial
    }
}

/// Measure and evaluate the first `count` contacts of a batch; kinematics may use columns.
#[inline(always)]
pub(super) fn evaluate_batch<L: ContactLaw, B: Batch<L>>(
    mode: MotionMeasure,
    count: usize,
    dt: f64,
    batch: &mut B,
    columns: &mut Columns,
) {
    L::Kinematics::measure_batch(mode, count, dt, batch, columns);
}

/// Measure and evaluate the first `count` contacts of a batch one at a time.
#[inline(always)]
pub(super) fn evaluate_each<L: ContactLaw, B: Batch<L>>(mode: MotionMeasure, count: usize, dt: f64, batch: &mut B) {
    measure_each(mode, count, dt, batch);
}

/// Measure and evaluate contact `i` of a batch on the scalar path. Cold and not inlined, because few contacts need
/// branches.
#[cold]
#[inline(never)]
pub(super) fn evaluate_one<L: ContactLaw, B: Batch<L>>(mode: MotionMeasure, i: usize, dt: f64, batch: &mut B) {
    let measured: L::Kinematics = measure_contact(mode, i, dt, batch);
    batch.evaluate(i, &measured);
}
