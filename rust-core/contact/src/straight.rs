//! Contacts in columns: the straight form of a law ([`crate::law::straight_form`]), for many contacts at once.
//!
//! The solver reads the contacts of a batch into [`ContactColumns`], applies the measure and the law to all of them, and stores the
//! results. The compiler neither fuses nor reorders operations, so the bits are those of [`ContactLaw::respond`].

use bytemuck::Zeroable as _;

use crate::columns::{Arrays, BATCH, Item};
use crate::geometry::{ContactGeometry, PreviousGeometry, Reference};
use crate::kinematics::deformable::ParticleVirial;
use crate::kinematics::{Kinematics, Measured, MotionMeasure, PointKinematics, PoseInput, VelocityInput};
use crate::law::{ColumnUse, ContactLaw, EnergySplit, Given, Response, TemperatureFactors};
use crate::math::{Symmetric, Vec3};
use crate::step::wrenches;
use crate::wrench::Wrenches;

/// Contacts of a batch, one array per number. Unused places are computed as well, from whatever the arrays contain.
///
/// Aligned, so that no access in vector registers crosses the border of two cache lines.
#[derive(Clone)]
#[repr(C, align(64))]
pub struct ContactColumns<L: ContactLaw> {
    /// What the measures read.
    pub poses: <PoseInput as Item>::Arrays,
    /// Unstrained geometry.
    pub reference: <Reference as Item>::Arrays,
    /// 1 for a bond, else 0.
    pub bonded: [f64; BATCH],
    /// Histories before the step.
    pub history: <L::State as Item>::Arrays,
    /// [`Given::ahead`].
    pub ahead: [[f64; BATCH]; 2],
    /// Masses of A and B, kg.
    pub masses: [[f64; BATCH]; 2],
    /// Sum of the surface displacements of both particles, m.
    pub surface_displacement: <Symmetric as Item>::Arrays,
    /// Factors on the strengths, 1, if they scatter.
    pub strength: [f64; BATCH],
    /// Results.
    pub results: Results<L>,
    /// What YADE's measures also read.
    pub velocities: <VelocityInput as Item>::Arrays,
    /// Motion of contacts whose law responds one by one.
    measured: <Measured as Item>::Arrays,
}

/// Results of the contacts of a batch.
#[derive(Clone)]
#[repr(C, align(64))]
pub struct Results<L: ContactLaw> {
    /// [`ContactLaw::damage`] after the step; NaN if the straight form is not certain.
    pub damage: [f64; BATCH],
    /// Normal and length at the end of the step.
    pub geometry: <PreviousGeometry as Item>::Arrays,
    /// Forces and torques on A and B.
    pub wrenches: <Wrenches as Item>::Arrays,
    /// [`EnergySplit::damage`], J.
    pub damage_energy: [f64; BATCH],
    /// [`EnergySplit::friction`], J.
    pub friction: [f64; BATCH],
    /// [`EnergySplit::viscous`], J.
    pub viscous: [f64; BATCH],
    /// [`EnergySplit::integration`], J.
    pub integration: [f64; BATCH],
    /// Histories after the step.
    pub history: <L::State as Item>::Arrays,
    /// Elastic normal force, N, if particles deform.
    pub pressure: [f64; BATCH],
    /// Other forces that strain the particles, N, if they deform.
    pub other: <Vec3 as Item>::Arrays,
}

/// How the straight form runs. Callers give constants, so that the compiler makes a loop for each.
#[derive(Clone, Copy)]
pub struct Run {
    /// Measure of the motion.
    pub measure: MotionMeasure,
    /// [`Given::reduced`].
    pub reduced: bool,
    /// Whether particles deform.
    pub deforms: bool,
    /// Whether dashpot forces strain the particles, if they deform.
    pub dashpots_strain: bool,
    /// Whether strengths scatter: [`ContactColumns::strength`].
    pub scattered: bool,
    /// Time step, s.
    pub dt: f64,
}

impl<L: ContactLaw> Default for ContactColumns<L> {
    fn default() -> Self {
        Self {
            poses: bytemuck::Zeroable::zeroed(),
            velocities: bytemuck::Zeroable::zeroed(),
            reference: bytemuck::Zeroable::zeroed(),
            masses: [[0.0; BATCH]; 2],
            bonded: [0.0; BATCH],
            history: <L::State as Item>::Arrays::zeroed(),
            ahead: [[f64::NAN; BATCH]; 2],
            surface_displacement: bytemuck::Zeroable::zeroed(),
            strength: [1.0; BATCH],
            measured: bytemuck::Zeroable::zeroed(),
            results: Results {
                damage: [0.0; BATCH],
                geometry: bytemuck::Zeroable::zeroed(),
                wrenches: bytemuck::Zeroable::zeroed(),
                damage_energy: [0.0; BATCH],
                friction: [0.0; BATCH],
                viscous: [0.0; BATCH],
                integration: [0.0; BATCH],
                history: <L::State as Item>::Arrays::zeroed(),
                pressure: [0.0; BATCH],
                other: bytemuck::Zeroable::zeroed(),
            },
        }
    }
}

impl<L: ContactLaw> ContactColumns<L> {
    /// What the law uses; nothing without a straight form.
    pub const USE: ColumnUse = match L::COLUMNS {
        Some(columns) => columns,
        None => ColumnUse::ELASTIC,
    };

    /// Reals at the end of the history of each contact that belong to the optional part, one array per real.
    #[inline(always)]
    pub fn optional_reals(&self) -> &[[f64; BATCH]] {
        let reals: &[[f64; BATCH]] = bytemuck::cast_slice(core::slice::from_ref(&self.history));
        &reals[reals.len() - Self::USE.optional..]
    }

    /// Constants of contact `i`. Masses that nobody reads may be those of another contact.
    #[inline(always)]
    fn geometry(&self, i: usize) -> ContactGeometry {
        let Reference { length: reference_length, area } = self.reference.get(i);
        ContactGeometry {
            reference_length,
            area,
            radius_a: self.poses.a.radius[i],
            radius_b: self.poses.b.radius[i],
            mass_a: self.masses[0][i],
            mass_b: self.masses[1][i],
        }
    }

    /// Motion of contact `i` by a measure.
    #[inline(always)]
    fn kinematics(&self, i: usize, measure: MotionMeasure, dt: f64) -> L::Kinematics {
        let (poses, geometry) = (self.poses.get(i), self.geometry(i));
        let bonded = self.bonded[i] > 0.0;
        match measure {
            MotionMeasure::Yade => {
                L::Kinematics::of_velocities::<false>(&poses, &self.velocities.get(i), &geometry, bonded, dt)
            }
            MotionMeasure::YadeRatcheting => {
                L::Kinematics::of_velocities::<true>(&poses, &self.velocities.get(i), &geometry, bonded, dt)
            }
            MotionMeasure::Finite | MotionMeasure::FirstOrder => L::Kinematics::of_poses(&poses, &geometry, bonded),
        }
    }

    /// Measure all contacts, for [`Self::motion`].
    #[inline(always)]
    pub fn measure(&mut self, measure: MotionMeasure, dt: f64) {
        for i in 0..BATCH {
            let measured = self.kinematics(i, measure, dt).point().measured();
            self.measured.set(i, measured);
        }
    }

    /// Motion of contact `i`, which [`Self::measure`] has measured as a point contact by `measure`.
    #[inline(always)]
    pub fn motion(&self, i: usize, measure: MotionMeasure) -> PointKinematics {
        let (geometry, previous) = (self.geometry(i), self.poses.previous.get(i));
        let finite = measure == MotionMeasure::Finite;
        self.measured.get(i).point(&geometry, &previous, self.bonded[i] > 0.0, finite)
    }

    /// Apply the straight form of `law` to all contacts.
    #[inline(always)]
    pub fn apply(&mut self, law: &L, run: Run) {
        for i in 0..BATCH {
            let mut kinematics = self.kinematics(i, run.measure, run.dt);
            if run.deforms {
                let approach = self.surface_displacement.get(i).quadratic(&kinematics.point().normal);
                kinematics = kinematics.with_surface_displacement(approach, f64::NAN);
            }
            let given =
                Given { measure: run.measure, reduced: run.reduced, ahead: [self.ahead[0][i], self.ahead[1][i]] };
            let (response, certain) = if run.scattered {
                self.straight_with_factors(law, i, &kinematics, &given, run.dt)
            } else {
                law.straight(&kinematics, &self.history.get(i), &given, run.dt)
            };
            let (point, results) = (kinematics.point(), &mut self.results);
            let (normal, force) = (point.normal, response.force);
            results.damage[i] = if certain { L::damage(&response.state) } else { f64::NAN };
            results.geometry.set(i, PreviousGeometry { normal, length: point.length });
            results.wrenches.set(i, wrenches::<L>(&normal, [point.arm_a, point.arm_b], &response));
            let EnergySplit { damage, friction, viscous, integration, .. } = response.energy;
            if Self::USE.damage {
                results.damage_energy[i] = damage;
            }
            if Self::USE.friction {
                results.friction[i] = friction;
            }
            if Self::USE.viscous {
                results.viscous[i] = viscous;
            }
            if Self::USE.integration {
                results.integration[i] = integration;
            }
            if Self::USE.history {
                results.history.set(i, response.state);
            }
            if run.deforms {
                let viscous = L::viscous_force(&normal, &response.state);
                let virial = ParticleVirial::of(&normal, &force, &viscous, run.dashpots_strain);
                results.pressure[i] = virial.pressure;
                results.other.set(i, virial.other);
            }
        }
    }

    /// The straight form of contact `i` with its own strength.
    #[inline(always)]
    fn straight_with_factors(
        &self,
        law: &L,
        i: usize,
        kinematics: &L::Kinematics,
        given: &Given,
        dt: f64,
    ) -> (Response<L::State>, bool) {
        let (factors, old) = (self.factors(i), self.history.get(i));
        let (response, certain) =
            law.at_temperature(&factors).straight(kinematics, &L::history_at(&old, &factors), given, dt);
        (Response { state: L::history_from(&response.state, &old, &factors), ..response }, certain)
    }

    /// Factors of contact `i`.
    #[inline(always)]
    fn factors(&self, i: usize) -> TemperatureFactors {
        TemperatureFactors { stiffness: 1.0, strength: self.strength[i] }
    }

    /// Find what the straight form needs ahead ([`ContactLaw::value_ahead`]) for the first `count` contacts.
    #[inline(always)]
    pub fn look_ahead(&mut self, law: &L, count: usize, run: Run) {
        if !L::LOOKS_AHEAD {
            return;
        }
        self.ahead[0] = [f64::NAN; BATCH];
        if !law.may_look_ahead(&self.history) {
            return;
        }
        // The compiler removes all of the law but the argument, in a loop without branches.
        let mut arguments = [0.0; BATCH];
        for (i, argument) in arguments.iter_mut().enumerate() {
            let kinematics = self.kinematics(i, run.measure, run.dt);
            let old = self.history.get(i);
            let given = Given { measure: run.measure, reduced: run.reduced, ahead: [f64::NAN; 2] };
            *argument = if run.scattered {
                let factors = self.factors(i);
                let old = L::history_at(&old, &factors);
                let (response, _) = law.at_temperature(&factors).straight(&kinematics, &old, &given, run.dt);
                L::argument_ahead(&old, &response.state)
            } else {
                let (response, _) = law.straight(&kinematics, &old, &given, run.dt);
                L::argument_ahead(&old, &response.state)
            };
        }
        for (i, &argument) in arguments.iter().enumerate().take(count) {
            if !argument.is_nan() {
                let reference = self.reference.get(i);
                let value = if run.scattered {
                    law.at_temperature(&self.factors(i)).value_ahead(reference, argument)
                } else {
                    law.value_ahead(reference, argument)
                };
                (self.ahead[0][i], self.ahead[1][i]) = (argument, value);
            }
        }
    }
}
