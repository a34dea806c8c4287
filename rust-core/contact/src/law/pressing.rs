//! Unbonded contacts in columns: surfaces that press on each other and slide by Coulomb's rule.
//!
//! A law gives its response while the surfaces overlap as one function without branches, [`Pressing::pressing`], of which slip is a
//! selection. [`ContactLaw::respond`] and the columns both call it, so their bits are the same. Contacts that open take the scalar path.

use super::batch::{Batch, BatchResult, evaluate_batch, evaluate_one};
use super::{ContactGeometry, ContactLaw, Reference, Response};
use crate::columns::{Arrays, BATCH, Columns, Formula};
use crate::kinematics::sphere_sphere::FiniteInput;
use crate::kinematics::{BranchVector, MotionMeasure, PointKinematics, torques};
use crate::math::Vec3;

crate::columns! {
    /// History of a contact, in the units of its law.
    pub(super) struct PressingHistory {
        /// Elastic shear force or displacement.
        pub shear: Vec3,
        /// Normal dashpot force of the last step, N.
        pub normal_dashpot: f64,
        /// Shear dashpot force of the last step, N.
        pub shear_dashpot: Vec3,
    }

    /// Input of [`Evaluated`].
    struct PressingInput {
        motion: FiniteInput,
        /// Reference length, m.
        reference_length: f64,
        /// kg.
        mass_a: f64,
        mass_b: f64,
        history: PressingHistory,
    }

    /// Output of [`Evaluated`].
    struct PressingOutput {
        /// m; not negative if the contact opens.
        elongation: f64,
        branch: BranchVector,
        /// Force on A, N.
        force: Vec3,
        /// Torque on A about its center, N·m.
        torque_a: Vec3,
        torque_b: Vec3,
        /// J.
        friction: f64,
        /// J.
        viscous: f64,
        /// J.
        integration: f64,
        history: PressingHistory,
    }
}

/// A law of unbonded contacts with a spring and a dashpot along the normal, and both along the shear, which slip.
pub(super) trait Pressing: ContactLaw<Kinematics = PointKinematics> {
    /// Response of a contact with overlap, which survives the step, without branches.
    fn pressing(&self, kinematics: &PointKinematics, old: &Self::State, dt: f64) -> Response<Self::State>;

    /// Whether the law has a shear dashpot. It costs a root and a division.
    fn has_shear_dashpot(&self) -> bool;

    /// The law without that dashpot: itself, if it has none. The compiler then omits what the dashpot needs.
    fn without_shear_dashpot(&self) -> Self;

    /// The history for the columns.
    fn history_of(&self, state: &Self::State) -> PressingHistory;

    /// The history from the columns.
    fn state_of(&self, history: &PressingHistory) -> Self::State;
}

/// Measures and evaluates contacts with equal parameters in columns.
struct Evaluated<'a, L, const SHEAR_DASHPOT: bool> {
    law: &'a L,
    dt: f64,
}

impl<L: Pressing, const SHEAR_DASHPOT: bool> Formula for Evaluated<'_, L, SHEAR_DASHPOT> {
    type Input = PressingInput;
    type Output = PressingOutput;

    #[inline(always)]
    fn apply(&self, input: PressingInput) -> PressingOutput {
        let law = if SHEAR_DASHPOT { *self.law } else { self.law.without_shear_dashpot() };
        let PressingInput { motion, reference_length, mass_a, mass_b, history } = input;
        let FiniteInput { a, b, previous, .. } = motion;
        // The laws do not use the area.
        let (radius_a, radius_b) = (a.radius, b.radius);
        let geometry = ContactGeometry { reference_length, area: 0.0, radius_a, radius_b, mass_a, mass_b };
        let point = motion.measure().point(&geometry, &previous, false);
        let Response { force, state, energy, .. } = law.pressing(&point, &law.state_of(&history), self.dt);
        let [torque_a, torque_b] = torques(&point.normal, &force, [point.arm_a, point.arm_b]);
        PressingOutput {
            elongation: point.elongation,
            branch: BranchVector { length: point.length, normal: point.normal },
            force,
            torque_a,
            torque_b,
            friction: energy.friction,
            viscous: energy.viscous,
            integration: energy.integration,
            history: law.history_of(&state),
        }
    }
}

/// [`ContactLaw::respond_batch`]. Uses columns if the contacts have equal parameters, under the finite measure, between rigid
/// particles, in steps without a sample.
#[inline(always)]
pub(super) fn respond_batch<L: Pressing, B: Batch<L>>(
    mode: MotionMeasure,
    count: usize,
    dt: f64,
    batch: &mut B,
    columns: &mut Columns,
) {
    let count = count.min(BATCH);
    if count == 0 {
        return;
    }
    if mode != MotionMeasure::Finite || B::SAMPLE || B::DEFORM || !batch.alike(count) {
        evaluate_batch(mode, count, dt, batch, columns);
        return;
    }
    let law = *batch.law(0).0;
    let input = columns.input::<PressingInput>();
    FiniteInput::write(&mut input.motion, count, batch);
    for i in 0..count {
        let (Reference { length, .. }, _) = batch.reference(i);
        input.reference_length.set(i, length);
        let [mass_a, mass_b] = batch.masses(i);
        input.mass_a.set(i, mass_a);
        input.mass_b.set(i, mass_b);
        input.history.set(i, law.history_of(batch.history(i)));
    }
    if law.has_shear_dashpot() {
        columns.apply(&Evaluated::<L, true> { law: &law, dt });
    } else {
        columns.apply(&Evaluated::<L, false> { law: &law, dt });
    }
    for i in 0..count {
        let output = columns.output::<PressingOutput>();
        let presses = output.elongation.get(i) < 0.0;
        if !presses || batch.inherits(i) {
            evaluate_one(mode, i, dt, batch);
            continue;
        }
        let found = BatchResult {
            branch: output.branch.get(i),
            force: output.force.get(i),
            torques: [output.torque_a.get(i), output.torque_b.get(i)],
            energy: Some([output.viscous.get(i), output.integration.get(i)]),
            friction: Some(output.friction.get(i)),
            state: Some(law.state_of(&output.history.get(i))),
            virial: None,
        };
        batch.commit_result(i, &found);
    }
}
