//! Evaluation of many contacts in columns.
//!
//! The damage of a bond whose κ grows contains an exponential, which is no formula for columns. In the plain thesis form a first
//! formula computes the κ of batches that are about to grow; then [`predict_damage`] computes their damage one by one.
//!
//! Other contacts whose damage grows, and those that end, need branches. Their damage becomes NaN in the columns, and the scalar path
//! evaluates them again; so it does contacts that inherit the energy of a bond, and those whose damage is reported.

use super::{Cpm, CpmFormulation, CpmState, StressResponse};
use crate::columns::{Arrays, BATCH, Columns, Formula, Item, Lanes};
use crate::geometry::{ContactGeometry, PreviousGeometry};
use crate::kinematics::deformable::ParticleVirial;
use crate::kinematics::sphere_sphere::{FiniteInput, Yade, YadeInput};
use crate::kinematics::{BranchVector, ImageShift, MotionMeasure, PointKinematics};
use crate::law::batch::{Batch, ColumnResult, ColumnResults, commit_columns, evaluate_batch};
use crate::law::{EnergySplit, Reference};
use crate::math::Vec3;
use crate::wrench::{Wrenches, wrenches_of_four};

crate::columns! {
    /// Response of a contact; a damage of NaN marks a contact that needs the scalar path.
    struct ColumnResponse {
        /// Normal and length at the end of the step.
        geometry: PreviousGeometry,
        wrenches: Wrenches,
        /// J.
        friction: f64,
        damage: f64,
        integration: f64,
        history: CpmState,
    }

    /// Input of [`PlainThesis`].
    struct ThesisInput {
        motion: FiniteInput,
        reference: Reference,
        /// 1 for a bond, else 0.
        bonded: f64,
        history: CpmState,
        /// Where the damage is known: κ at the end of the step, otherwise NaN.
        predicted_kappa: f64,
        /// Damage at that κ.
        predicted_damage: f64,
    }

    /// Input of [`YadePublic`].
    struct YadeContact {
        motion: YadeInput,
        /// 1 for a bond, else 0.
        bonded: f64,
        history: CpmState,
    }
}

impl ColumnResponse {
    #[inline(always)]
    fn new(point: &PointKinematics, force: Vec3, stresses: &StressResponse) -> Self {
        let &PointKinematics { length, normal, arm_a, arm_b, .. } = point;
        let wrenches = Wrenches::of(&normal, &force, [arm_a, arm_b]);
        let geometry = PreviousGeometry { normal, length };
        let EnergySplit { friction, damage, integration, .. } = stresses.energy;
        let mut history = stresses.state;
        if stresses.lost {
            history.omega = f64::NAN;
        }
        Self { geometry, wrenches, friction, damage, integration, history }
    }
}

/// Response of contact `i`, read from the columns.
struct ContactResponse<'a> {
    columns: &'a <ColumnResponse as Item>::Arrays,
    i: usize,
}

impl ColumnResult for ContactResponse<'_> {
    #[inline(always)]
    fn branch(&self) -> BranchVector {
        let PreviousGeometry { normal, length } = self.columns.geometry.get(self.i);
        BranchVector { length, normal }
    }

    #[inline(always)]
    fn wrenches(&self) -> Wrenches {
        self.columns.wrenches.get(self.i)
    }

    #[inline(always)]
    fn energy(&self) -> Option<[f64; 2]> {
        Some([0.0, self.columns.integration.get(self.i)])
    }

    #[inline(always)]
    fn friction(&self) -> Option<f64> {
        Some(self.columns.friction.get(self.i))
    }

    #[inline(always)]
    fn virial(&self) -> Option<ParticleVirial> {
        None
    }

    #[inline(always)]
    fn damage(&self) -> Option<f64> {
        Some(self.columns.damage.get(self.i))
    }
}

/// Responses of all contacts of a batch.
struct Responses<'a>(&'a mut <ColumnResponse as Item>::Arrays);

impl ColumnResults<Cpm> for Responses<'_> {
    /// Not with a damage of NaN.
    #[inline(always)]
    fn survives(&self, i: usize, threshold: f64) -> bool {
        self.0.history.omega[i] < threshold
    }

    /// Its damage needs branches, or is reported.
    #[inline(always)]
    fn needs_scalar_path<B: Batch<Cpm>>(&self, i: usize, batch: &B) -> bool {
        self.0.history.omega[i].is_nan() || batch.reports(i, &self.0.history.get(i))
    }

    #[inline(always)]
    fn geometries(&mut self) -> &mut <PreviousGeometry as Item>::Arrays {
        &mut self.0.geometry
    }

    #[inline(always)]
    fn histories(&mut self) -> Option<&mut <CpmState as Item>::Arrays> {
        Some(&mut self.0.history)
    }

    #[inline(always)]
    fn wrenches(&self, i: usize, lanes: impl Lanes) -> [Wrenches; 4] {
        wrenches_of_four(&self.0.wrenches, i, lanes)
    }

    #[inline(always)]
    fn result(&self, i: usize) -> impl ColumnResult {
        ContactResponse { columns: self.0, i }
    }
}

impl ThesisInput {
    /// Constants of the contact, its geometry of the previous step, and whether it is a bond.
    #[inline(always)]
    fn constants(&self) -> (ContactGeometry, PreviousGeometry, bool) {
        let Self { motion: FiniteInput { a, b, previous, .. }, reference, bonded, .. } = *self;
        let (Reference { length: reference_length, area }, radius_a, radius_b) = (reference, a.radius, b.radius);
        // The law reads no masses.
        let geometry = ContactGeometry { reference_length, area, radius_a, radius_b, mass_a: 0.0, mass_b: 0.0 };
        (geometry, previous, bonded > 0.0)
    }
}

impl YadeContact {
    /// Constants of the contact, its geometry of the previous step, and whether it is a bond.
    #[inline(always)]
    fn constants(&self) -> (ContactGeometry, PreviousGeometry, bool) {
        let Self { motion: YadeInput { previous, radius_a, radius_b, reference, .. }, bonded, .. } = *self;
        let Reference { length: reference_length, area } = reference;
        // The law reads no masses.
        let geometry = ContactGeometry { reference_length, area, radius_a, radius_b, mass_a: 0.0, mass_b: 0.0 };
        (geometry, previous, bonded > 0.0)
    }
}

/// The plain thesis form with the finite measure.
struct PlainThesis<'a> {
    law: &'a Cpm,
}

impl PlainThesis<'_> {
    /// Kinematics and stresses of a contact; a damage that is not known is NaN.
    #[inline(always)]
    fn evaluate(&self, input: &ThesisInput) -> (PointKinematics, StressResponse) {
        let law = self.law;
        let ThesisInput { motion, history, predicted_kappa, predicted_damage, .. } = *input;
        let (geometry, previous, bonded) = input.constants();
        let k = motion.measure().point(&geometry, &previous, bonded);
        let stresses = law.evaluate_thesis(&k, &history, |kappa| {
            if kappa <= law.parameters.crack_onset_strain || law.parameters.never_damage {
                0.0
            } else if kappa == predicted_kappa {
                predicted_damage
            } else {
                f64::NAN
            }
        });
        (k, stresses)
    }
}

impl Formula for PlainThesis<'_> {
    type Input = ThesisInput;
    type Output = ColumnResponse;

    #[inline(always)]
    fn apply(&self, input: ThesisInput) -> ColumnResponse {
        let (k, stresses) = self.evaluate(&input);
        let force = (k.normal * stresses.normal_stress + stresses.shear_stress) * input.reference.area;
        ColumnResponse::new(&k, force, &stresses)
    }
}

/// κ at the end of a step, which does not depend on the damage. The compiler removes the rest of the law.
struct ThesisKappa<'a>(PlainThesis<'a>);

impl Formula for ThesisKappa<'_> {
    type Input = ThesisInput;
    type Output = f64;

    #[inline(always)]
    fn apply(&self, input: ThesisInput) -> f64 {
        self.0.evaluate(&input).1.state.kappa
    }
}

/// YADE's formulation with YADE's measure.
struct YadePublic<'a, const RATCHETING: bool> {
    law: &'a Cpm,
    kinematics: Yade<RATCHETING>,
}

impl<const RATCHETING: bool> Formula for YadePublic<'_, RATCHETING> {
    type Input = YadeContact;
    type Output = ColumnResponse;

    #[inline(always)]
    fn apply(&self, input: YadeContact) -> ColumnResponse {
        let law = self.law;
        let YadeContact { motion, history: old, .. } = input;
        let (geometry, previous, bonded) = input.constants();
        let area = geometry.area;
        let k = self.kinematics.measure(&motion, &ImageShift::default()).point(&geometry, &previous, bonded);
        let stresses = law.evaluate_with_damage(&k, &old, |kappa| {
            if kappa == old.kappa {
                old.omega
            } else if kappa < law.parameters.crack_onset_strain || law.parameters.never_damage {
                0.0
            } else {
                f64::NAN
            }
        });
        let force = k.normal * (stresses.normal_stress * area) + stresses.shear_stress * area;
        ColumnResponse::new(&k, force, &stresses)
    }
}

/// [`ContactLaw::respond_batch`](crate::law::ContactLaw::respond_batch). Uses columns if all contacts have equal
/// parameters and the formulation is either the plain thesis form with the finite measure or YADE's with YADE's
/// measure.
#[inline(always)]
pub(super) fn respond_batch<B: Batch<Cpm>>(
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
    let law = *batch.law(0);
    let alike = !B::SAMPLE && batch.alike(count);
    if alike && mode == MotionMeasure::Finite && law.plain {
        thesis_batch(&law, count, dt, batch, columns);
        return;
    }
    let yade = !B::PERIODIC && alike && law.parameters.mode == CpmFormulation::YadePublic;
    match mode {
        MotionMeasure::Yade if yade => yade_batch::<false, B>(&law, count, dt, batch, columns),
        MotionMeasure::YadeRatcheting if yade => yade_batch::<true, B>(&law, count, dt, batch, columns),
        _ => evaluate_batch(mode, count, dt, batch, columns),
    }
}

/// Fraction of the crack onset strain from which damage is expected to grow. It decides about time only: a bond that was not
/// expected takes the scalar path.
const NEAR_ONSET: f64 = 0.9;

/// Whether the damage of a contact of the batch is expected to grow, given the old normal strains.
#[inline(always)]
fn damage_may_grow(law: &Cpm, strains: &[f64; BATCH]) -> bool {
    let onset = NEAR_ONSET * law.parameters.crack_onset_strain;
    // A sum over all columns needs no branch. (Unused columns may count in vain.)
    strains.iter().map(|&strain| u64::from(strain > onset)).sum::<u64>() > 0
}

/// Compute the damage of the first `count` contacts whose κ, found by [`ThesisKappa`], has grown.
#[inline(always)]
fn predict_damage(law: &Cpm, count: usize, columns: &mut Columns) {
    let (input, kappas) = columns.both::<ThesisInput, f64>();
    for (i, &kappa) in kappas.iter().enumerate().take(count) {
        if kappa > input.history.kappa[i] {
            input.predicted_kappa[i] = kappa;
            input.predicted_damage[i] = law.damage_function(kappa);
        }
    }
}

/// Write 1 for a bond, else 0.
#[inline(always)]
fn write_bonded<B: Batch<Cpm>>(column: &mut [f64; BATCH], count: usize, batch: &B) {
    if batch.all_bonded() {
        *column = [1.0; BATCH];
        return;
    }
    for (i, bonded) in column.iter_mut().enumerate().take(count) {
        *bonded = f64::from(u8::from(batch.bonded(i)));
    }
}

#[inline(always)]
fn thesis_batch<B: Batch<Cpm>>(law: &Cpm, count: usize, dt: f64, batch: &mut B, columns: &mut Columns) {
    let input = columns.input::<ThesisInput>();
    FiniteInput::write(&mut input.motion, count, batch);
    batch.read_references(count, &mut input.reference);
    batch.read_histories(count, &mut input.history);
    write_bonded(&mut input.bonded, count, batch);
    input.predicted_kappa = [f64::NAN; BATCH];
    if damage_may_grow(law, &columns.input::<ThesisInput>().history.normal_strain) {
        columns.apply(&ThesisKappa(PlainThesis { law }));
        predict_damage(law, count, columns);
    }
    columns.apply(&PlainThesis { law });
    let mut results = Responses(columns.output_mut::<ColumnResponse>());
    commit_columns(MotionMeasure::Finite, count, dt, batch, &mut results);
}

#[inline(always)]
fn yade_batch<const RATCHETING: bool, B: Batch<Cpm>>(
    law: &Cpm,
    count: usize,
    dt: f64,
    batch: &mut B,
    columns: &mut Columns,
) {
    let mode = if RATCHETING { MotionMeasure::YadeRatcheting } else { MotionMeasure::Yade };
    let input = columns.input::<YadeContact>();
    YadeInput::write(&mut input.motion, count, batch);
    batch.read_histories(count, &mut input.history);
    write_bonded(&mut input.bonded, count, batch);
    columns.apply(&YadePublic { law, kinematics: Yade::<RATCHETING> { dt } });
    commit_columns(mode, count, dt, batch, &mut Responses(columns.output_mut::<ColumnResponse>()));
}
