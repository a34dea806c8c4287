//! Evaluation of many contacts of one law at a time.

use super::contract::{ContactLaw, Response};
use crate::columns::{Arrays, BATCH, Columns, Item, Lanes};
use crate::geometry::PreviousGeometry;
use crate::kinematics::deformable::ParticleVirial;
use crate::kinematics::{
    BranchVector, Kinematics, MotionMeasure, MotionSink, PointKinematics, measure_contact, measure_each,
};
use crate::wrench::Wrenches;

/// Contacts of law `L` that are measured and evaluated together.
///
/// Each contact is evaluated once, in ascending order, by one of [`evaluate`](MotionSink::evaluate), [`commit`](Self::commit),
/// [`commit_result`](Self::commit_result), and [`commit_four`](Self::commit_four). Before the last two, its geometry and history are stored.
pub trait Batch<L: ContactLaw>: MotionSink<L::Kinematics> {
    /// Whether the evaluation also needs stored energies.
    const SAMPLE: bool;

    /// History of contact `i`.
    fn history(&self, i: usize) -> L::State;

    /// Read the histories of the first `count` contacts.
    fn read_histories(&self, count: usize, arrays: &mut <L::State as Item>::Arrays);

    /// The law with the parameters of contact `i`.
    fn law(&self, i: usize) -> &L;

    /// Whether the first `count` contacts have equal parameters.
    fn alike(&self, count: usize) -> bool;

    /// Whether contact `i` begins with the energy of a bond that broke before. Its ledger needs the whole motion of the step,
    /// which columns may leave out: the scalar path evaluates it.
    fn inherits(&self, i: usize) -> bool;

    /// Whether any contact of the batch may inherit energy. Cheaper than [`Self::inherits`] of each.
    fn may_inherit(&self) -> bool;

    /// Damage from which on the event log records a contact.
    fn damage_threshold(&self) -> f64;

    /// Whether the event log has to record the damage of contact `i`, whose history after the step is `state`. The scalar path
    /// evaluates such a contact, because the log needs energies that columns leave out.
    fn reports(&self, i: usize, state: &L::State) -> bool;

    /// Whether dashpot forces strain particles.
    fn dashpots_strain(&self) -> bool;

    /// Store the motion and response of contact `i`.
    fn commit(&mut self, i: usize, point: &PointKinematics, response: &Response<L::State>);

    /// Store the geometries of the first `count` contacts after the step. A contact that is evaluated later, on the scalar path, must keep
    /// its old geometry here: that is what its measure reads.
    fn store_geometries(&mut self, count: usize, arrays: &<PreviousGeometry as Item>::Arrays);

    /// Store the histories of the first `count` contacts after the step; as [`Self::store_geometries`]. The last `unchanged` numbers of each
    /// stay as they are.
    fn store_histories(&mut self, count: usize, arrays: &<L::State as Item>::Arrays, unchanged: usize);

    /// Add the forces and energies that the law computed in columns for contact `i`, which survives the step. Its geometry and history are
    /// stored before.
    fn commit_result(&mut self, i: usize, result: &impl ColumnResult);

    /// As [`Self::commit_result`] for contacts `i` to `i + 3`.
    fn commit_four(&mut self, i: usize, results: &impl ColumnResults<L>);
}

/// Results of a law in columns, in steps without a sample. The caller stores geometries and histories as columns. Forces, which it adds
/// to rows, come from the columns four by four ([`Lanes`]), energies one by one.
pub trait ColumnResults<L: ContactLaw> {
    /// Whether contact `i` certainly needs no scalar path, unless it inherits energy: it survives, and its damage is below `threshold`. A
    /// comparison without branches, also of columns that no contact uses.
    fn survives(&self, i: usize, threshold: f64) -> bool;
    /// Whether contact `i`, of which [`Self::survives`] is not certain, needs the scalar path, because it ends, or because of what the
    /// columns leave out.
    #[inline(always)]
    fn needs_scalar_path<B: Batch<L>>(&self, _i: usize, _batch: &B) -> bool {
        true
    }
    /// Normals and lengths of the contacts after the step.
    fn geometries(&mut self) -> &mut <PreviousGeometry as Item>::Arrays;
    /// Histories of the contacts after the step; `None` if they did not change.
    fn histories(&mut self) -> Option<&mut <L::State as Item>::Arrays>;
    /// How many numbers at the end of each history did not change.
    #[inline(always)]
    fn unchanged(&self) -> usize {
        0
    }
    /// Forces and torques of contacts `i` to `i + 3`.
    fn wrenches(&self, i: usize, lanes: impl Lanes) -> [Wrenches; 4];
    /// Result for contact `i`.
    fn result(&self, i: usize) -> impl ColumnResult;
}

/// Commit the first `count` contacts of a batch from columns: geometries and histories all at once, forces and energies four at a time
/// where none of the four needs the scalar path.
#[inline(always)]
pub(super) fn commit_columns<L: ContactLaw, B: Batch<L>, R: ColumnResults<L>>(
    mode: MotionMeasure,
    count: usize,
    dt: f64,
    batch: &mut B,
    results: &mut R,
) {
    // Bit `i`: contact `i` takes the scalar path.
    let mut scalar = 0_u32;
    let threshold = batch.damage_threshold();
    // All columns at once, without a branch per contact.
    let mut all_survive = true;
    for i in 0..BATCH {
        all_survive &= results.survives(i, threshold);
    }
    if !all_survive || batch.may_inherit() {
        for i in 0..count {
            let needs = batch.inherits(i) || !results.survives(i, threshold) && results.needs_scalar_path(i, batch);
            scalar |= u32::from(needs) << i;
        }
    }
    if scalar != 0 {
        keep(scalar, count, batch, results);
    }
    batch.store_geometries(count, results.geometries());
    let unchanged = results.unchanged();
    if let Some(histories) = results.histories() {
        batch.store_histories(count, histories, unchanged);
    }
    for first in (0..count).step_by(4) {
        let group = first..count.min(first + 4);
        if group.len() == 4 && (scalar >> first).trailing_zeros() >= 4 {
            batch.commit_four(first, results);
            continue;
        }
        for i in group {
            if scalar >> i & 1 == 1 {
                evaluate_one(mode, i, dt, batch);
            } else {
                batch.commit_result(i, &results.result(i));
            }
        }
    }
}

/// Put the old geometry and history of the contacts that take the scalar path into the columns: they are evaluated after the columns are
/// stored.
#[inline(always)]
fn keep<L: ContactLaw, B: Batch<L>, R: ColumnResults<L>>(scalar: u32, count: usize, batch: &B, results: &mut R) {
    for i in (0..count).filter(|i| scalar >> i & 1 == 1) {
        results.geometries().set(i, batch.previous(i));
        if let Some(histories) = results.histories() {
            histories.set(i, batch.history(i));
        }
    }
}

/// Result of a law for a contact that survives the step, in steps without a sample.
///
/// The caller reads each part when it stores it. A law that reads them from its columns keeps few numbers in registers;
/// [`BatchResult`] is a result whose parts are known.
pub trait ColumnResult {
    /// Line between the centers.
    fn branch(&self) -> BranchVector;
    /// Forces and torques on A and B.
    fn wrenches(&self) -> Wrenches;
    /// [`EnergySplit::viscous`](super::EnergySplit) and `integration`, J; `None` if both are zero.
    fn energy(&self) -> Option<[f64; 2]>;
    /// [`EnergySplit::friction`](super::EnergySplit), J; `None` if it is zero.
    fn friction(&self) -> Option<f64>;
    /// Contribution to the deformation of the particles, if they deform.
    fn virial(&self) -> Option<ParticleVirial>;
    /// [`EnergySplit::damage`](super::EnergySplit), J; `None` under laws without damage.
    fn damage(&self) -> Option<f64> {
        None
    }
}

/// [`ColumnResult`] of a contact under a law without damage.
#[derive(Debug, Clone, Copy)]
pub struct BatchResult {
    /// Line between the centers.
    pub branch: BranchVector,
    /// Forces and torques on A and B.
    pub wrenches: Wrenches,
    /// [`EnergySplit::viscous`](super::EnergySplit) and `integration`, J; `None` if both are zero.
    pub energy: Option<[f64; 2]>,
    /// [`EnergySplit::friction`](super::EnergySplit), J; `None` if it is zero.
    pub friction: Option<f64>,
    /// Contribution to the deformation of the particles, if they deform.
    pub virial: Option<ParticleVirial>,
}

impl ColumnResult for BatchResult {
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
