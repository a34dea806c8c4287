//! Unbroken linear bonds in columns, between rigid and between deformable particles.

use super::{LinearBond, LinearBondState};
use crate::columns::{Arrays, BATCH, Columns, Formula, Item, Lanes, all_plus_zero};
use crate::geometry::{ContactGeometry, PreviousGeometry, Reference};
use crate::kinematics::deformable::ParticleVirial;
use crate::kinematics::sphere_sphere::FiniteInput;
use crate::kinematics::{BranchVector, MotionMeasure};
use crate::law::batch::{Batch, BatchResult, ColumnResult, ColumnResults, commit_columns, evaluate_batch};
use crate::law::{ContactLaw as _, Response};
use crate::math::{Symmetric, Vec3};
use crate::wrench::{Wrenches, wrenches_of_four};

crate::columns! {
    /// Input of [`Intact`].
    struct IntactInput {
        motion: FiniteInput,
        /// Its length is NaN for a contact that is not a bond.
        reference: Reference,
        /// Mass, kg; of no meaning without dashpots.
        mass_a: f64,
        mass_b: f64,
        history: LinearBondState,
    }

    /// Output of [`Intact`].
    struct IntactOutput {
        /// 1 if the bond survives, else 0.
        holds: f64,
        /// Normal and length at the end of the step.
        geometry: PreviousGeometry,
        wrenches: Wrenches,
        /// J.
        viscous: f64,
        /// J.
        integration: f64,
        history: LinearBondState,
    }

    /// Input of [`IntactStraining`].
    struct StrainingInput {
        bond: IntactInput,
        /// Sum of the surface displacements of both particles, m.
        surface_displacement: Symmetric,
    }

    /// Output of [`IntactStraining`].
    struct StrainingOutput {
        bond: IntactOutput,
        /// Elastic normal force, N.
        pressure: f64,
        /// Other forces that strain the particle, N.
        other: Vec3,
    }
}

/// Measures and evaluates unbroken bonds with equal parameters in columns. `DASHPOTS`: see [`LinearBond::intact`].
struct Intact<'a, const DASHPOTS: bool> {
    bond: &'a LinearBond,
    dt: f64,
}

impl<const DASHPOTS: bool> Intact<'_, DASHPOTS> {
    /// Output and response for one bond. `surface_displacement` gives the sum of both particles' surface displacements
    /// along a normal, m.
    #[inline(always)]
    fn evaluate(
        &self,
        input: &IntactInput,
        surface_displacement: impl FnOnce(&Vec3) -> f64,
    ) -> (IntactOutput, Response<LinearBondState>) {
        let IntactInput { motion, reference: Reference { length: reference_length, area }, mass_a, mass_b, history } =
            *input;
        let FiniteInput { a, b, previous, .. } = motion;
        let (radius_a, radius_b) = (a.radius, b.radius);
        let geometry = ContactGeometry { reference_length, area, radius_a, radius_b, mass_a, mass_b };
        let viscosities = if DASHPOTS { self.bond.dashpots(&geometry) } else { (0.0, 0.0) };
        let point = motion.measure().point(&geometry, &previous, true);
        let point = point.with_surface_displacement(surface_displacement(&point.normal), f64::NAN);
        let (response, fails) = self.bond.intact::<DASHPOTS>(&point, &history, viscosities, self.dt);
        let (normal, force, energy) = (point.normal, response.force, response.energy);
        let output = IntactOutput {
            // A NaN reference length marks a contact that is not a bond.
            holds: if fails | reference_length.is_nan() { 0.0 } else { 1.0 },
            geometry: PreviousGeometry { normal, length: point.length },
            wrenches: Wrenches::of(&normal, &force, [point.arm_a, point.arm_b]),
            viscous: energy.viscous,
            integration: energy.integration,
            history: response.state,
        };
        (output, response)
    }
}

impl<const DASHPOTS: bool> Formula for Intact<'_, DASHPOTS> {
    type Input = IntactInput;
    type Output = IntactOutput;

    #[inline(always)]
    fn apply(&self, input: IntactInput) -> IntactOutput {
        self.evaluate(&input, |_| 0.0).0
    }
}

/// [`Intact`] for bonds between particles that deform.
struct IntactStraining<'a, const DASHPOTS: bool> {
    bond: &'a LinearBond,
    dt: f64,
    dashpots_strain: bool,
}

impl<const DASHPOTS: bool> Formula for IntactStraining<'_, DASHPOTS> {
    type Input = StrainingInput;
    type Output = StrainingOutput;

    #[inline(always)]
    fn apply(&self, input: StrainingInput) -> StrainingOutput {
        let intact = Intact::<DASHPOTS> { bond: self.bond, dt: self.dt };
        let (bond, Response { force, state, .. }) =
            intact.evaluate(&input.bond, |normal| input.surface_displacement.quadratic(normal));
        let normal = bond.geometry.normal;
        let viscous = LinearBond::viscous_force(&normal, &state);
        let ParticleVirial { pressure, other, .. } =
            ParticleVirial::of(&normal, &force, &viscous, self.dashpots_strain);
        StrainingOutput { bond, pressure, other }
    }
}

/// Results of all bonds of a batch; those that deform particles have virials.
struct Results<'a, const DEFORM: bool> {
    columns: &'a mut <StrainingOutput as Item>::Arrays,
    dashpots: bool,
}

impl<const DEFORM: bool> ColumnResults<LinearBond> for Results<'_, DEFORM> {
    #[inline(always)]
    fn survives(&self, i: usize, _threshold: f64) -> bool {
        self.columns.bond.holds[i] != 0.0
    }

    #[inline(always)]
    fn geometries(&mut self) -> &mut <PreviousGeometry as Item>::Arrays {
        &mut self.columns.bond.geometry
    }

    #[inline(always)]
    fn histories(&mut self) -> Option<&mut <LinearBondState as Item>::Arrays> {
        Some(&mut self.columns.bond.history)
    }

    #[inline(always)]
    fn unchanged(&self) -> usize {
        // Dashpot forces are zero and stay so.
        if self.dashpots { 0 } else { 4 }
    }

    #[inline(always)]
    fn wrenches(&self, i: usize, lanes: impl Lanes) -> [Wrenches; 4] {
        wrenches_of_four(&self.columns.bond.wrenches, i, lanes)
    }

    #[inline(always)]
    fn result(&self, i: usize) -> impl ColumnResult {
        let columns = &*self.columns;
        let bond = &columns.bond;
        let PreviousGeometry { normal, length } = bond.geometry.get(i);
        let virial =
            DEFORM.then(|| ParticleVirial { normal, pressure: columns.pressure.get(i), other: columns.other.get(i) });
        BatchResult {
            branch: BranchVector { length, normal },
            wrenches: bond.wrenches.get(i),
            energy: Some([bond.viscous.get(i), bond.integration.get(i)]),
            friction: None,
            virial,
        }
    }
}

/// [`ContactLaw::respond_batch`](crate::law::ContactLaw::respond_batch). Uses columns for bonds with equal parameters under the finite
/// measure. Bonds that break then take the scalar path.
#[inline(always)]
pub(super) fn respond_batch<B: Batch<LinearBond>>(
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
    let bond = *batch.law(0);
    // `evaluate_batch` covers steps with a sample, for rigid and deformable particles.
    if mode != MotionMeasure::Finite || B::SAMPLE || !batch.alike(count) {
        evaluate_batch(mode, count, dt, batch, columns);
        return;
    }
    // The input for rigid particles is the beginning of the input for deformable ones.
    let arrays = columns.input::<StrainingInput>();
    let input = &mut arrays.bond;
    FiniteInput::write(&mut input.motion, count, batch);
    batch.read_histories(count, &mut input.history);
    let history = &input.history;
    // Old dashpot forces: the first step after the law has lost its dashpots.
    let dashpots = bond.damping_ratio != 0.0
        || !all_plus_zero(core::slice::from_ref(&history.normal_dashpot), count)
        || !all_plus_zero(history.shear_dashpot.columns(), count);
    batch.read_references(count, &mut input.reference);
    if !batch.all_bonded() {
        for i in 0..count {
            if !batch.bonded(i) {
                input.reference.length[i] = f64::NAN;
            }
        }
    }
    if dashpots {
        batch.read_masses(count, [&mut input.mass_a, &mut input.mass_b]);
    }
    if B::DEFORM {
        for i in 0..count {
            arrays.surface_displacement.set(i, batch.surface_displacement(i));
        }
    }
    let dashpots_strain = B::DEFORM && batch.dashpots_strain();
    // Separate formulas, so that undamped bonds compute no square roots and rigid particles no strains.
    match (dashpots, B::DEFORM) {
        (false, false) => columns.apply(&Intact::<false> { bond: &bond, dt }),
        (true, false) => columns.apply(&Intact::<true> { bond: &bond, dt }),
        (false, true) => columns.apply(&IntactStraining::<false> { bond: &bond, dt, dashpots_strain }),
        (true, true) => columns.apply(&IntactStraining::<true> { bond: &bond, dt, dashpots_strain }),
    }
    let columns = columns.output_mut::<StrainingOutput>();
    if B::DEFORM {
        commit_columns(mode, count, dt, batch, &mut Results::<true> { columns, dashpots });
    } else {
        commit_columns(mode, count, dt, batch, &mut Results::<false> { columns, dashpots });
    }
}
