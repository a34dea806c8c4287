//! Unbroken beams in columns.

use super::{BeamModel, BeamResponse, BendingTerm, CohesiveBeam, CohesiveBeamState, beam_response};
use crate::columns::{Arrays, BATCH, Columns, Formula};
use crate::geometry::{ContactGeometry, Reference};
use crate::kinematics::{BranchVector, MotionMeasure, RestFrame, torques};
use crate::law::batch::{Batch, BatchResult, evaluate_each, evaluate_one};
use crate::math::{Quat, Vec3};

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
        /// Vector between the centers, m.
        branch: Vec3,
        orientation_a: Quat,
        orientation_b: Quat,
        rest: RestFrame,
        /// Reference length, m.
        reference_length: f64,
        /// Area, m²; NaN for a contact that is not a bond.
        area: f64,
    }

    /// Output of [`Intact`].
    struct IntactOutput {
        branch: BranchVector,
        /// Force on A, N.
        force: Vec3,
        /// Torque on A about its center, N·m.
        torque_a: Vec3,
        torque_b: Vec3,
        /// Rankine stress, Pa; NaN if the contact needs the scalar path.
        stress: f64,
    }
}

impl<const TURNED: bool> Formula for Intact<'_, TURNED> {
    type Input = IntactInput;
    type Output = IntactOutput;

    #[inline(always)]
    fn apply(&self, input: IntactInput) -> IntactOutput {
        let IntactInput { branch, orientation_a, orientation_b, rest, reference_length, area } = input;
        let branch = BranchVector::of(&branch);
        let (rotations, small) = branch.small_rotations::<TURNED>([orientation_a, orientation_b], &rest);
        // A beam does not use radii and masses.
        let geometry =
            ContactGeometry { reference_length, area, radius_a: 0.0, radius_b: 0.0, mass_a: 0.0, mass_b: 0.0 };
        let k = self.beam.stiffnesses_of_beam(&geometry, self.shear_coefficient);
        let BeamResponse { forces, axial, .. } = beam_response(&k, reference_length, &branch, &rotations);
        let (n, force, m) = (branch.normal, forces.force, forces.moment());
        let stress = CohesiveBeam::principal_stress(area, axial, &n, &forces, forces.bending(&n));
        let [torque_a, torque_b] = torques(&n, &force, [0.5 * branch.length; 2]);
        // A zero direction marks the first evaluation of the bond, which needs the scalar path.
        let stress = if small & (rest.direction.norm_squared() > 0.0) { stress } else { f64::NAN };
        IntactOutput { branch, force, torque_a: torque_a + m, torque_b: torque_b - m, stress }
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
    let beam = *batch.law(0).0;
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
    let mut turned = false;
    for i in 0..count {
        let ([position_a, position_b], [orientation_a, orientation_b], shift) = batch.ends(i);
        let (Reference { length: reference_length, area }, bonded) = batch.reference(i);
        let CohesiveBeamState { rest_direction: direction, rest_rotation: rotation } = *batch.history(i);
        turned |= rotation != Vec3::zeros();
        let input = IntactInput {
            branch: position_b + shift - position_a,
            orientation_a,
            orientation_b,
            rest: RestFrame { direction, rotation },
            reference_length,
            // A NaN area makes the stress NaN, and the contact takes the scalar path.
            area: if bonded { area } else { f64::NAN },
        };
        columns.input::<IntactInput>().set(i, input);
    }
    if turned {
        columns.apply(&Intact::<true> { beam: &beam, shear_coefficient });
    } else {
        columns.apply(&Intact::<false> { beam: &beam, shear_coefficient });
    }
    for i in 0..count {
        let IntactOutput { branch, force, torque_a, torque_b, stress } = columns.output::<IntactOutput>().get(i);
        if stress < beam.strength {
            let torques = [torque_a, torque_b];
            let (energy, friction, state, virial) = (None, None, None, None);
            batch.commit_result(i, &BatchResult { branch, force, torques, energy, friction, state, virial });
        } else {
            evaluate_one(mode, i, dt, batch);
        }
    }
}
