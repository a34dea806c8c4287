//! Unbonded contacts in columns: surfaces that press on each other and slide by Coulomb's rule.
//!
//! A law gives its response while the surfaces overlap as one function without branches, [`Pressing::pressing`], of which slip is a
//! selection. [`ContactLaw::respond`] and the columns both call it, so their bits are the same. Contacts that open take the scalar path.

use super::batch::{Batch, BatchResult, ColumnResult, ColumnResults, commit_columns, evaluate_batch, evaluate_each};
use super::{ContactGeometry, ContactLaw, Reference, Response};
use crate::columns::{Arrays, BATCH, Columns, Formula, Item, Lanes, all_plus_zero};
use crate::geometry::PreviousGeometry;
use crate::kinematics::sphere_sphere::FiniteInput;
use crate::kinematics::{BranchVector, MotionMeasure, PointKinematics};
use crate::math::Vec3;
use crate::wrench::{Wrenches, wrenches_of_four};

crate::columns! {
    /// Input of [`Evaluated`].
    struct PressingInput {
        motion: FiniteInput,
        reference: Reference,
        /// kg.
        mass_a: f64,
        mass_b: f64,
        history: History,
    }

    /// Output of [`Evaluated`].
    struct PressingOutput {
        /// m; not negative if the contact opens.
        elongation: f64,
        /// Normal and length at the end of the step.
        geometry: PreviousGeometry,
        wrenches: Wrenches,
        /// J.
        friction: f64,
        /// J.
        viscous: f64,
        /// J.
        integration: f64,
        history: History,
    }
}

/// History of a contact under any law, as its numbers in their order.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct History {
    shear: Vec3,
    normal_dashpot: f64,
    shear_dashpot: Vec3,
}

crate::column_arrays! { History { shear: Vec3, normal_dashpot: f64, shear_dashpot: Vec3 } }

/// A law of unbonded contacts with a spring and a dashpot along the normal, and both along the shear, which slip.
pub(super) trait Pressing: ContactLaw<Kinematics = PointKinematics> {
    /// Response of a contact with overlap, which survives the step, without branches. `SHEAR_DASHPOT`: false if neither the law nor the
    /// last step has a shear dashpot force; then the response leaves it out. For finite motion, the bits are the same.
    fn pressing<const SHEAR_DASHPOT: bool>(
        &self,
        kinematics: &PointKinematics,
        old: &Self::State,
        dt: f64,
    ) -> Response<Self::State>;

    /// Whether the law has a shear dashpot.
    fn has_shear_dashpot(&self) -> bool;
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
        let PressingInput { motion, reference, mass_a, mass_b, history } = input;
        let FiniteInput { a, b, previous, .. } = motion;
        let Reference { length: reference_length, area } = reference;
        let (radius_a, radius_b) = (a.radius, b.radius);
        let geometry = ContactGeometry { reference_length, area, radius_a, radius_b, mass_a, mass_b };
        let point = motion.measure().point(&geometry, &previous, false);
        let Response { force, state, energy, .. } =
            self.law.pressing::<SHEAR_DASHPOT>(&point, bytemuck::cast_ref(&history), self.dt);
        PressingOutput {
            elongation: point.elongation,
            geometry: PreviousGeometry { normal: point.normal, length: point.length },
            wrenches: Wrenches::of(&point.normal, &force, [point.arm_a, point.arm_b]),
            friction: energy.friction,
            viscous: energy.viscous,
            integration: energy.integration,
            history: bytemuck::cast(state),
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
    let law = *batch.law(0);
    let input = columns.input::<PressingInput>();
    FiniteInput::write(&mut input.motion, count, batch);
    batch.read_histories(count, bytemuck::cast_mut(&mut input.history));
    if !law.has_shear_dashpot() && !all_plus_zero(input.history.shear_dashpot.columns(), count) {
        // The first step after the law has lost its dashpot.
        evaluate_each(mode, count, dt, batch);
        return;
    }
    batch.read_references(count, &mut input.reference);
    batch.read_masses(count, [&mut input.mass_a, &mut input.mass_b]);
    if law.has_shear_dashpot() {
        columns.apply(&Evaluated::<L, true> { law: &law, dt });
    } else {
        columns.apply(&Evaluated::<L, false> { law: &law, dt });
    }
    let (columns, shear_dashpot) = (columns.output_mut::<PressingOutput>(), law.has_shear_dashpot());
    commit_columns(mode, count, dt, batch, &mut Results { columns, shear_dashpot });
}

/// Results of all contacts of a batch.
struct Results<'a> {
    columns: &'a mut <PressingOutput as Item>::Arrays,
    shear_dashpot: bool,
}

impl<L: Pressing> ColumnResults<L> for Results<'_> {
    #[inline(always)]
    fn survives(&self, i: usize, _threshold: f64) -> bool {
        self.columns.elongation[i] < 0.0
    }

    #[inline(always)]
    fn geometries(&mut self) -> &mut <PreviousGeometry as Item>::Arrays {
        &mut self.columns.geometry
    }

    #[inline(always)]
    fn histories(&mut self) -> Option<&mut <L::State as Item>::Arrays> {
        Some(bytemuck::cast_mut(&mut self.columns.history))
    }

    #[inline(always)]
    fn unchanged(&self) -> usize {
        // The shear dashpot force is zero and stays so.
        if self.shear_dashpot { 0 } else { 3 }
    }

    #[inline(always)]
    fn wrenches(&self, i: usize, lanes: impl Lanes) -> [Wrenches; 4] {
        wrenches_of_four(&self.columns.wrenches, i, lanes)
    }

    #[inline(always)]
    fn result(&self, i: usize) -> impl ColumnResult {
        let columns = &*self.columns;
        let PreviousGeometry { normal, length } = columns.geometry.get(i);
        BatchResult {
            branch: BranchVector { length, normal },
            wrenches: columns.wrenches.get(i),
            energy: Some([columns.viscous[i], columns.integration[i]]),
            friction: Some(columns.friction[i]),
            virial: None,
        }
    }
}
