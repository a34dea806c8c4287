//! Unbroken beams in columns.

use super::{BeamModel, BeamResponse, BendingTerm, CohesiveBeam, CohesiveBeamState, beam_response};
use crate::columns::{Arrays, BATCH, Columns, Formula, Item, Lanes, places};
use crate::geometry::{ContactGeometry, PreviousGeometry, Reference};
use crate::kinematics::{BranchVector, MotionMeasure, Pose, RestFrame};
use crate::law::batch::{Batch, BatchResult, ColumnResult, ColumnResults, commit_columns, evaluate_each};
use crate::math::Vec3;
use crate::wrench::{Wrenches, wrenches_of_four};

/// Evaluates slender or Timoshenko beams with equal parameters and small end rotations in columns; see
/// [`respond_batch`].
struct Intact<'a, const TURNED: bool> {
    beam: &'a CohesiveBeam,
    /// Infinite for slender beams.
    shear_coefficient: f64,
}

crate::columns! {
    /// Input of [`Intact`].
    struct IntactInput {
        /// The particles with their orientations.
        a: Pose,
        b: Pose,
        /// Displacement of B's image, m.
        shift: Vec3,
        rest: CohesiveBeamState,
        /// Its area is NaN for a contact that is not a bond.
        reference: Reference,
    }

    /// Output of [`Intact`].
    struct IntactOutput {
        /// Normal and length at the end of the step.
        geometry: PreviousGeometry,
        wrenches: Wrenches,
        /// Rankine stress, Pa; NaN if the contact needs the scalar path.
        stress: f64,
    }
}

impl<const TURNED: bool> Formula for Intact<'_, TURNED> {
    type Input = IntactInput;
    type Output = IntactOutput;

    #[inline(always)]
    fn apply(&self, input: IntactInput) -> IntactOutput {
        let IntactInput { a, b, shift, rest, reference: Reference { length: reference_length, area } } = input;
        let rest = RestFrame { direction: rest.rest_direction, rotation: rest.rest_rotation };
        let branch = BranchVector::of(&(b.position + shift - a.position));
        let (rotations, small) = branch.small_rotations::<TURNED>([a.rotation, b.rotation], &rest);
        // A beam does not use radii and masses.
        let geometry =
            ContactGeometry { reference_length, area, radius_a: 0.0, radius_b: 0.0, mass_a: 0.0, mass_b: 0.0 };
        let k = self.beam.stiffnesses_of_beam(&geometry, self.shear_coefficient);
        let BeamResponse { forces, axial, .. } = beam_response(&k, reference_length, &branch, &rotations);
        let (n, force, m) = (branch.normal, forces.force, forces.moment());
        let stress = CohesiveBeam::principal_stress(area, axial, &n, &forces, forces.bending(&n));
        let wrenches = Wrenches::of(&n, &force, [0.5 * branch.length; 2]).with_moment(&m);
        // A zero direction marks the first evaluation of the bond, which needs the scalar path.
        let stress = if small & (rest.direction.norm_squared() > 0.0) { stress } else { f64::NAN };
        let geometry = PreviousGeometry { normal: n, length: branch.length };
        IntactOutput { geometry, wrenches, stress }
    }
}

/// [`ContactLaw::respond_batch`](crate::law::ContactLaw::respond_batch). Uses columns for slender and Timoshenko beams if all have
/// equal parameters and the default [`BendingTerm`]. Beams that break or whose rotations are large then take the scalar path.
#[inline(always)]
pub(super) fn respond_batch<B: Batch<CohesiveBeam>>(
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
    let beam = *batch.law(0);
    let shear_coefficient = match beam.model {
        BeamModel::EulerBernoulli => Some(f64::INFINITY),
        BeamModel::Timoshenko { shear_coefficient } => Some(shear_coefficient),
        BeamModel::DualSpring { .. } | BeamModel::Spring => None,
    };
    let default_criterion = beam.bending_term == BendingTerm::MidSection;
    let alike = batch.alike(count);
    let Some(shear_coefficient) = shear_coefficient.filter(|_| default_criterion && alike && !B::SAMPLE) else {
        evaluate_each(mode, count, dt, batch);
        return;
    };
    let input = columns.input::<IntactInput>();
    input.shift = bytemuck::Zeroable::zeroed();
    batch.read_histories(count, &mut input.rest);
    batch.read_references(count, &mut input.reference);
    let lanes = batch.lanes();
    for i in (0..count).step_by(4) {
        let [a, b] = batch.four_poses(places(i, count));
        input.a.set_four(i, a, lanes);
        input.b.set_four(i, b, lanes);
    }
    if !batch.all_bonded() {
        // A NaN area makes the stress NaN, and the contact takes the scalar path.
        for i in 0..count {
            if !batch.bonded(i) {
                input.reference.area[i] = f64::NAN;
            }
        }
    }
    if B::PERIODIC && batch.may_cross_border() {
        for i in 0..count {
            if let Some(shift) = batch.shift(i) {
                input.shift.set(i, shift);
            }
        }
    }
    if input.rest.rest_rotation.any_nonzero() {
        columns.apply(&Intact::<true> { beam: &beam, shear_coefficient });
    } else {
        columns.apply(&Intact::<false> { beam: &beam, shear_coefficient });
    }
    let mut results = Results { columns: columns.output_mut::<IntactOutput>(), strength: beam.strength };
    commit_columns(mode, count, dt, batch, &mut results);
}

/// Results of all beams of a batch.
struct Results<'a> {
    columns: &'a mut <IntactOutput as Item>::Arrays,
    /// Pa.
    strength: f64,
}

impl ColumnResults<CohesiveBeam> for Results<'_> {
    /// Not with a stress of NaN.
    #[inline(always)]
    fn survives(&self, i: usize, _threshold: f64) -> bool {
        self.columns.stress[i] < self.strength
    }

    #[inline(always)]
    fn geometries(&mut self) -> &mut <PreviousGeometry as Item>::Arrays {
        &mut self.columns.geometry
    }

    #[inline(always)]
    fn histories(&mut self) -> Option<&mut <CohesiveBeamState as Item>::Arrays> {
        None
    }

    #[inline(always)]
    fn wrenches(&self, i: usize, lanes: impl Lanes) -> [Wrenches; 4] {
        wrenches_of_four(&self.columns.wrenches, i, lanes)
    }

    #[inline(always)]
    fn result(&self, i: usize) -> impl ColumnResult {
        let Self { columns, .. } = self;
        let PreviousGeometry { normal, length } = columns.geometry.get(i);
        BatchResult {
            branch: BranchVector { length, normal },
            wrenches: columns.wrenches.get(i),
            energy: None,
            friction: None,
            virial: None,
        }
    }
}
