//! Brittle bond of linear springs and dashpots: Madan 2019, (2.20)–(2.40).
//!
//! With `u` the elongation of the bond and `u_t` the shear displacement of B relative to A, carried with the contact,
//!
//! | | | |
//! |---|---|---|
//! | normal force | `f_n = k_n u + c_n u̇` | (2.23), (2.25), (2.33) |
//! | shear force | `f_t = k_t u_t + c_t u̇_t` | (2.24), (2.27), (2.34) |
//! | dashpots | `c = ξ·2√(m k)`, `m = m_A m_B/(m_A+m_B)` | (2.35)–(2.37) |
//! | failure | `f_n ≥ φ_n` or `‖f_t‖ ≥ φ_t` | (2.38)–(2.39) |
//!
//! in N, m, s, kg. Forces are those on A, positive in tension. (2.38) is printed with `‖f_n‖`, its prose says tension;
//! tension is implemented. Failure compares the whole forces, dashpots included, as printed. It is instantaneous;
//! the stored energy at that moment is released as [`EnergySplit::damage`], and the pair goes on as an unbonded
//! contact. A bond that was let go ([`PointKinematics::bonded`] false) breaks under any force. Rates are the mean rates of
//! the step.
//!
//! Whether the springs start unstressed is open in Madan 2019; see [`LinearBond::subtract_initial_gap`].

use super::common::{ParameterError, reciprocal_of_step, require};
use super::{
    ContactGeometry, ContactLaw, EnergySplit, Kinematics, Reference, Response, Status, Stiffness, evaluate_one,
};
use crate::kinematics::batch::Formula;
use crate::kinematics::deformable::ParticleVirial;
use crate::kinematics::sphere_sphere::{FINITE_INPUT, FiniteMeasure};
use crate::kinematics::{
    BATCH, Batch, BatchResult, BranchVector, Columns, MotionMeasure, PointKinematics, PreviousGeometry, torques,
};
use crate::math::{Symmetric, Vec3};

/// Parameters of the brittle linear bond.
///
/// ```
/// use concordem_contact::kinematics::{PointKinematics, Transport};
/// use concordem_contact::law::{ContactGeometry, ContactLaw, LinearBond, LinearBondState};
/// use concordem_contact::math::Vec3;
///
/// let bond = LinearBond::new(2.0e6, 1.0e6, 0.0, 500.0, 300.0).unwrap();
/// let geometry =
///     ContactGeometry { reference_length: 2.0, area: 1.0, radius_a: 1.0, radius_b: 1.0, mass_a: 1.0, mass_b: 1.0 };
/// let stretched = PointKinematics {
///     geometry,
///     length: 2.0001,
///     length_old: 2.0,
///     elongation: 1.0e-4,
///     elongation_old: 0.0,
///     gap: 1.0e-4,
///     normal: Vec3::x(),
///     shear_increment: Vec3::zeros(),
///     arm_a: 1.00005,
///     arm_b: 1.00005,
///     bonded: true,
///     transport: Transport::identity(Vec3::x()),
/// };
/// let answer = bond.respond(&stretched, &LinearBondState::default(), 1.0e-6);
/// assert_eq!(answer.force, Vec3::x() * 200.0);
/// assert_eq!(answer.energy.stored_normal, 0.5 * 200.0 * 1.0e-4);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearBond {
    /// Normal stiffness `k_n`, N/m.
    pub normal_stiffness: f64,
    /// Shear stiffness `k_t`, N/m.
    pub shear_stiffness: f64,
    /// Damping ratio `ξ` of both dashpots, 1; 1 is critical for the pair alone.
    pub damping_ratio: f64,
    /// Tensile strength `φ_n`, N; infinite for a bond that never fails in tension.
    pub normal_strength: f64,
    /// Shear strength `φ_t`, N; infinite for a bond that never fails in shear.
    pub shear_strength: f64,
    /// Whether the normal spring is unstressed at the distance of bonding (default), or at the distance at which the
    /// spheres touch, so that an initial gap or overlap loads the bond from the start.
    pub subtract_initial_gap: bool,
}

crate::law_state! {
    /// History of a [`LinearBond`].
    pub struct LinearBondState {
        /// Shear displacement of B relative to A since bonding, Madan 2019 (2.28).
        shear_displacement: Vec3, "m", Odd;
        /// Normal dashpot force of the last step.
        normal_dashpot: f64, "N", Even;
        /// Shear dashpot force of the last step.
        shear_dashpot: Vec3, "N", Odd;
    }
}

impl LinearBond {
    /// A bond with the given stiffnesses (N/m), damping ratio, and strengths (N; may be infinite), unstressed at the
    /// distance of bonding.
    pub fn new(
        normal_stiffness: f64,
        shear_stiffness: f64,
        damping_ratio: f64,
        normal_strength: f64,
        shear_strength: f64,
    ) -> Result<Self, ParameterError> {
        let bond = Self {
            normal_stiffness,
            shear_stiffness,
            damping_ratio,
            normal_strength,
            shear_strength,
            subtract_initial_gap: true,
        };
        bond.validate()?;
        Ok(bond)
    }

    /// Refuse parameters without meaning.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let Self { normal_stiffness: kn, shear_stiffness: kt, damping_ratio: xi, .. } = *self;
        let (normal, shear) = (self.normal_strength, self.shear_strength);
        require(kn > 0.0 && kn.is_finite(), Self::NAME, "normal_stiffness", kn, "positive and finite (N/m)")?;
        require(kt >= 0.0 && kt.is_finite(), Self::NAME, "shear_stiffness", kt, "finite and not negative (N/m)")?;
        require(xi >= 0.0 && xi.is_finite(), Self::NAME, "damping_ratio", xi, "finite and not negative")?;
        require(normal > 0.0, Self::NAME, "normal_strength", normal, "positive (N; inf for an unbreakable bond)")?;
        require(shear > 0.0, Self::NAME, "shear_strength", shear, "positive (N; inf for an unbreakable bond)")
    }

    /// Dashpot constants `(c_n, c_t)`, N·s/m, Madan 2019 (2.35)–(2.37).
    #[inline(always)]
    fn dashpots(&self, geometry: &ContactGeometry) -> (f64, f64) {
        if self.damping_ratio == 0.0 {
            return (0.0, 0.0);
        }
        let mass = geometry.reduced_mass();
        (
            2.0 * self.damping_ratio * (mass * self.normal_stiffness).sqrt(),
            2.0 * self.damping_ratio * (mass * self.shear_stiffness).sqrt(),
        )
    }
}

impl LinearBond {
    /// What the normal spring feels, m.
    #[inline(always)]
    fn stretch(&self, kinematics: &PointKinematics) -> f64 {
        if self.subtract_initial_gap { kinematics.elongation } else { kinematics.gap }
    }

    /// The answer if the bond holds, and whether it does not.
    #[inline(always)]
    fn intact(
        &self,
        kinematics: &PointKinematics,
        old: &LinearBondState,
        (normal_viscosity, shear_viscosity): (f64, f64),
        dt: f64,
    ) -> (Response<LinearBondState>, bool) {
        let rate = reciprocal_of_step(dt);
        let stretch = self.stretch(kinematics);
        let lengthening = kinematics.length - kinematics.length_old;
        let elastic_normal = self.normal_stiffness * stretch;
        let normal_dashpot = normal_viscosity * lengthening * rate;

        let slide = kinematics.shear_increment;
        let shear_displacement = kinematics.transport.apply(&old.shear_displacement) + slide;
        let old_shear_dashpot = kinematics.transport.apply(&old.shear_dashpot);
        let elastic_shear = shear_displacement * self.shear_stiffness;
        let shear_dashpot = slide * (shear_viscosity * rate);

        let normal_force = elastic_normal + normal_dashpot;
        let shear_force = elastic_shear + shear_dashpot;
        let fails = normal_force >= self.normal_strength || shear_force.norm() >= self.shear_strength;
        let stored_normal = 0.5 * elastic_normal * stretch;
        let stored_shear = 0.5 * elastic_shear.dot(&shear_displacement);
        let mut energy = EnergySplit { stored_normal, stored_shear, ..EnergySplit::default() };
        energy.add_viscous(0.5 * (old.normal_dashpot + normal_dashpot) * lengthening);
        energy.add_viscous(0.5 * (old_shear_dashpot + shear_dashpot).dot(&slide));
        let response = Response {
            force: kinematics.normal * normal_force + shear_force,
            moment: Vec3::zeros(),
            state: LinearBondState { shear_displacement, normal_dashpot, shear_dashpot },
            status: Status::Lives,
            energy,
        };
        (response, fails)
    }
}

/// Input: of the measure, then reference length (m), masses (kg), history; with particles that deform the six components of
/// the sum of their widenings (m).
const INPUT: usize = FINITE_INPUT + 10;
/// Output: 1 where the bond holds, length, normal, force (N), torques on A and B (N·m), energies (J), history; with particles that
/// deform elastic normal force and other forces that strain (N).
const OUTPUT: usize = 14 + 2 + 7;

#[inline(always)]
fn columns_of(state: &LinearBondState) -> [f64; 7] {
    let LinearBondState { shear_displacement: s, normal_dashpot, shear_dashpot: d } = *state;
    [s.x, s.y, s.z, normal_dashpot, d.x, d.y, d.z]
}

#[inline(always)]
fn state_of([sx, sy, sz, normal_dashpot, dx, dy, dz]: [f64; 7]) -> LinearBondState {
    let (shear_displacement, shear_dashpot) = (Vec3::new(sx, sy, sz), Vec3::new(dx, dy, dz));
    LinearBondState { shear_displacement, normal_dashpot, shear_dashpot }
}

/// Measures and answers of many bonds that hold, of the same parameters.
struct Intact<'a, const DAMPED: bool> {
    bond: &'a LinearBond,
    dt: f64,
}

impl<const DAMPED: bool> Intact<'_, DAMPED> {
    /// `surface_displacement` (m) along the normal.
    #[inline(always)]
    fn answer(
        &self,
        input: [f64; INPUT],
        surface_displacement: impl FnOnce(&Vec3) -> f64,
    ) -> ([f64; OUTPUT], Vec3, Response<LinearBondState>) {
        let measure = FiniteMeasure::of(std::array::from_fn(|i| input[i]));
        let [reference_length, mass_a, mass_b] = std::array::from_fn(|i| input[FINITE_INPUT + i]);
        let [.., radius_a, radius_b, nx, ny, nz, length] = std::array::from_fn::<f64, FINITE_INPUT, _>(|i| input[i]);
        // The area is of no matter to this law.
        let geometry = ContactGeometry { reference_length, area: 0.0, radius_a, radius_b, mass_a, mass_b };
        let viscosities = if DAMPED { self.bond.dashpots(&geometry) } else { (0.0, 0.0) };
        let frame = PreviousGeometry { normal: Vec3::new(nx, ny, nz), length };
        let point = measure.point(&geometry, &frame, true);
        let point = point.with_surface_displacement(surface_displacement(&point.normal), f64::NAN);
        let old = state_of(std::array::from_fn(|i| input[FINITE_INPUT + 3 + i]));
        let (response, fails) = self.bond.intact(&point, &old, viscosities, self.dt);
        let (n, f, e) = (point.normal, response.force, response.energy);
        let [ta, tb] = torques(&n, &f, [point.arm_a, point.arm_b]);
        // No reference: no bond.
        let holds = if fails | reference_length.is_nan() { 0.0 } else { 1.0 };
        let mut output = [0.0; OUTPUT];
        output[..14].copy_from_slice(&[
            holds,
            point.length,
            n.x,
            n.y,
            n.z,
            f.x,
            f.y,
            f.z,
            ta.x,
            ta.y,
            ta.z,
            tb.x,
            tb.y,
            tb.z,
        ]);
        output[14..16].copy_from_slice(&[e.viscous, e.integration]);
        output[16..].copy_from_slice(&columns_of(&response.state));
        (output, n, response)
    }
}

impl<const DAMPED: bool> Formula<INPUT, OUTPUT> for Intact<'_, DAMPED> {
    #[inline(always)]
    fn apply(&self, input: [f64; INPUT]) -> [f64; OUTPUT] {
        self.answer(input, |_| 0.0).0
    }
}

/// The same between particles that deform.
struct IntactStraining<'a, const DAMPED: bool> {
    bond: &'a LinearBond,
    dt: f64,
    dashpots_strain: bool,
}

impl<const DAMPED: bool> Formula<{ INPUT + 6 }, { OUTPUT + 4 }> for IntactStraining<'_, DAMPED> {
    #[inline(always)]
    fn apply(&self, input: [f64; INPUT + 6]) -> [f64; OUTPUT + 4] {
        let surface_displacement = Symmetric(std::array::from_fn(|i| input[INPUT + i]));
        let intact = Intact::<DAMPED> { bond: self.bond, dt: self.dt };
        let (row, normal, Response { force, state, .. }) =
            intact.answer(std::array::from_fn(|i| input[i]), |normal| surface_displacement.quadratic(normal));
        let viscous = LinearBond::viscous_force(&normal, &state);
        let push = ParticleVirial::of(&normal, &force, &viscous, self.dashpots_strain);
        let other = push.other;
        let mut output = [0.0; OUTPUT + 4];
        output[..OUTPUT].copy_from_slice(&row);
        output[OUTPUT..].copy_from_slice(&[push.pressure, other.x, other.y, other.z]);
        output
    }
}

impl ContactLaw for LinearBond {
    fn kept_reference(&self, reference: Reference) -> Option<Reference> {
        self.subtract_initial_gap.then_some(reference)
    }

    type State = LinearBondState;
    type Kinematics = PointKinematics;
    const NAME: &'static str = "linear_bond";
    const DEFORMS: bool = true;
    const READS_OLD_ELONGATION: bool = false;

    #[inline(always)]
    fn respond(&self, kinematics: &PointKinematics, old: &LinearBondState, dt: f64) -> Response<LinearBondState> {
        let (response, fails) = self.intact(kinematics, old, self.dashpots(&kinematics.geometry), dt);
        if !fails && kinematics.bonded {
            return response;
        }
        // The force of this step is void. The energy stored by now is released; it contains the half of this step's
        // work that the void elastic force would have taken in, which nobody did: the integration term. How the energy was
        // stored is told, too.
        let EnergySplit { stored_normal, stored_shear, .. } = response.energy;
        let damage = stored_normal + stored_shear;
        let elastic_normal = self.normal_stiffness * self.stretch(kinematics);
        let elastic_shear = response.state.shear_displacement * self.shear_stiffness;
        let (slide, stretching) = (kinematics.shear_increment, kinematics.elongation - kinematics.elongation_old);
        let integration = -0.5 * (elastic_normal * stretching + elastic_shear.dot(&slide));
        let mut energy = EnergySplit { stored_normal, stored_shear, damage, integration, ..EnergySplit::default() };
        let old_shear_dashpot = kinematics.transport.apply(&old.shear_dashpot);
        energy.add_viscous(0.5 * old.normal_dashpot * (kinematics.length - kinematics.length_old));
        energy.add_viscous(0.5 * old_shear_dashpot.dot(&slide));
        Response {
            force: Vec3::zeros(),
            moment: Vec3::zeros(),
            state: LinearBondState::default(),
            status: Status::Broke,
            energy,
        }
    }

    /// Bonds that hold, of the same parameters, measured by the finite measure, are answered in columns.
    #[inline(always)]
    fn respond_batch<B: Batch<Self>>(mode: MotionMeasure, count: usize, dt: f64, batch: &mut B, columns: &mut Columns) {
        let count = count.min(BATCH);
        if count == 0 {
            return;
        }
        let bond = *batch.law(0).0;
        // The loop with a sample serves rigid particles and others.
        if mode != MotionMeasure::Finite || B::SAMPLE || (1..count).any(|i| batch.row(i) != batch.row(0)) {
            PointKinematics::measure_batch::<Self, B>(mode, count, dt, batch, columns);
            return;
        }
        let damped = bond.damping_ratio != 0.0;
        for i in 0..count {
            FiniteMeasure::set(columns, i, batch);
            let (Reference { length, .. }, bonded) = batch.reference(i);
            let [mass_a, mass_b] = if damped { batch.masses(i) } else { [0.0; 2] };
            columns.set_from(FINITE_INPUT, i, [if bonded { length } else { f64::NAN }, mass_a, mass_b]);
            columns.set_from(FINITE_INPUT + 3, i, columns_of(batch.history(i)));
            if B::DEFORM {
                columns.set_from(INPUT, i, batch.surface_displacement(i).0);
            }
        }
        let dashpots_strain = B::DEFORM && batch.dashpots_strain();
        // Said so that what has no dashpots is computed without roots, and rigid particles without strains.
        match (damped, B::DEFORM) {
            (false, false) => columns.apply(&Intact::<false> { bond: &bond, dt }),
            (true, false) => columns.apply(&Intact::<true> { bond: &bond, dt }),
            (false, true) => columns.apply(&IntactStraining::<false> { bond: &bond, dt, dashpots_strain }),
            (true, true) => columns.apply(&IntactStraining::<true> { bond: &bond, dt, dashpots_strain }),
        }
        for i in 0..count {
            let [holds, length, nx, ny, nz, fx, fy, fz, ax, ay, az, bx, by, bz] = columns.get(i);
            if holds == 0.0 {
                evaluate_one(mode, i, dt, batch);
                continue;
            }
            let normal = Vec3::new(nx, ny, nz);
            let push = B::DEFORM.then(|| {
                let [pressure, ox, oy, oz] = columns.get_from(OUTPUT, i);
                ParticleVirial { normal, pressure, other: Vec3::new(ox, oy, oz) }
            });
            let found = BatchResult {
                branch: BranchVector { length, normal },
                force: Vec3::new(fx, fy, fz),
                torques: [Vec3::new(ax, ay, az), Vec3::new(bx, by, bz)],
                energy: Some(columns.get_from(14, i)),
                state: Some(state_of(columns.get_from(16, i))),
                push,
            };
            batch.commit_result(i, &found);
        }
    }

    #[inline(always)]
    fn viscous_force(normal: &Vec3, state: &Self::State) -> Vec3 {
        normal * state.normal_dashpot + state.shear_dashpot
    }

    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        let (normal_damping, shear_damping) = self.dashpots(geometry);
        Stiffness {
            normal: self.normal_stiffness,
            shear: self.shear_stiffness,
            normal_damping,
            shear_damping,
            ..Stiffness::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::conformance::{Native, Observed, Properties, Station, Subject, Window, atlas, atlas_paths, check};

    /// Deformations are a good part of the length, so that rounding of positions does not hide anything.
    fn subject(name: &'static str, bond: LinearBond) -> Subject<Native<LinearBond>> {
        let window = Window { elongation: [-0.4, 0.6], shear: 0.5 };
        Subject {
            name,
            host: Native(bond),
            geometry: ContactGeometry {
                reference_length: 2.1,
                area: 1.0,
                radius_a: 0.8,
                radius_b: 1.2,
                mass_a: 1.0,
                mass_b: 2.0,
            },
            bonded: true,
            properties: Properties {
                conservative_normal: bond.damping_ratio == 0.0,
                conservative_shear: bond.damping_ratio == 0.0,
                dissipation_nonnegative: true,
                continuous_failure: true,
                brittle: false,
            },
            elastic: window,
            inelastic: window,
            held: Station { elongation: 0.3, shear: [0.2, -0.3], twist: 0.0 },
            failure: 1.0,
            dt: 1e-3,
        }
    }

    /// (2.23)–(2.40) written out for the prescribed deformation.
    fn closed_form(
        bond: LinearBond,
        subject: &Subject<Native<LinearBond>>,
    ) -> impl FnMut(&Observed) -> Option<[f64; 3]> {
        let mass = 2.0 / 3.0;
        let initial_gap = if bond.subtract_initial_gap { 0.0 } else { 0.1 };
        assert_eq!(subject.geometry.reference_length, 2.1);
        let cn = bond.damping_ratio * 2.0 * (mass * bond.normal_stiffness).sqrt();
        let ct = bond.damping_ratio * 2.0 * (mass * bond.shear_stiffness).sqrt();
        let mut before: Option<Station> = None;
        move |now| {
            let s = now.station;
            let b = before.replace(s).unwrap_or(s);
            let force = [
                bond.normal_stiffness * (s.elongation + initial_gap) + cn * (s.elongation - b.elongation) / now.dt,
                bond.shear_stiffness * s.shear[0] + ct * (s.shear[0] - b.shear[0]) / now.dt,
                bond.shear_stiffness * s.shear[1] + ct * (s.shear[1] - b.shear[1]) / now.dt,
            ];
            let shear = (force[1] * force[1] + force[2] * force[2]).sqrt();
            (force[0] < bond.normal_strength && shear < bond.shear_strength).then_some(force)
        }
    }

    /// 1e-11: 300 steps, each with a rounding of the order of 1e-16 of the length in the orientation, read as shear
    /// (and, divided by the step, as rate), against shears of a quarter of the length.
    fn conforms(subject: &Subject<Native<LinearBond>>) {
        let mut report = check(subject);
        report.findings.extend(atlas(
            subject,
            &atlas_paths(&subject.inelastic, 50),
            || closed_form(subject.host.0, subject),
            1e-11,
            "rounding of orientations over 300 steps",
        ));
        println!("{report}");
        assert!(report.passed(), "{report}");
    }

    #[test]
    fn elastic_bond_conforms() {
        conforms(&subject("linear bond", LinearBond::new(1e6, 4e5, 0.0, f64::INFINITY, f64::INFINITY).unwrap()));
    }

    #[test]
    fn damped_bond_conforms() {
        conforms(&subject("damped bond", LinearBond::new(1e6, 4e5, 0.3, f64::INFINITY, f64::INFINITY).unwrap()));
    }

    #[test]
    fn bond_with_its_initial_gap_conforms() {
        let mut bond = LinearBond::new(1e6, 4e5, 0.0, f64::INFINITY, f64::INFINITY).unwrap();
        bond.subtract_initial_gap = false;
        conforms(&subject("bond under its initial gap", bond));
    }

    #[test]
    fn brittle_bond_conforms() {
        for damping_ratio in [0.0, 0.1] {
            // breaks at an elongation of 0.45 or a shear of 0.475
            let bond = LinearBond::new(1e6, 4e5, damping_ratio, 4.5e5, 1.9e5).unwrap();
            let mut subject = subject("brittle bond", bond);
            subject.properties.continuous_failure = false;
            subject.properties.brittle = true;
            subject.elastic = Window { elongation: [-0.4, 0.4], shear: 0.3 };
            conforms(&subject);
        }
    }

    /// Compression never breaks a bond, however strong; shear does, under any normal force.
    #[test]
    fn which_strength_breaks() {
        let bond = LinearBond::new(1e6, 4e5, 0.0, 1e3, 1e3).unwrap();
        let subject = subject("bond", bond);
        let at = |elongation: f64, shear: f64| {
            let k = PointKinematics {
                geometry: subject.geometry,
                length: 2.1 + elongation,
                length_old: 2.1,
                elongation,
                elongation_old: 0.0,
                gap: 0.1 + elongation,
                normal: Vec3::x(),
                shear_increment: Vec3::new(0.0, shear, 0.0),
                arm_a: 1.0,
                arm_b: 1.0,
                bonded: true,
                transport: crate::kinematics::Transport::identity(Vec3::x()),
            };
            bond.respond(&k, &LinearBondState::default(), 1e-3)
        };
        assert_eq!(at(-0.5, 0.0).status, Status::Lives);
        assert_eq!(at(0.9e-3, 0.0).status, Status::Lives);
        assert_eq!(at(1.1e-3, 0.0).status, Status::Broke);
        assert_eq!(at(-0.5, 2.4e-3).status, Status::Lives);
        assert_eq!(at(-0.5, 2.6e-3).status, Status::Broke);
        let broken = at(1.1e-3, 0.0);
        assert_eq!(broken.force, Vec3::zeros());
        assert_eq!(broken.energy.damage, 0.5 * (1e6 * 1.1e-3) * 1.1e-3);
    }

    #[test]
    fn bad_parameters_are_named() {
        let message = LinearBond::new(1e6, -1.0, 0.0, 1.0, 1.0).unwrap_err().to_string();
        assert_eq!(message, "law linear_bond: shear_stiffness = -1 must be finite and not negative (N/m)");
        assert!(LinearBond::new(0.0, 1.0, 0.0, 1.0, 1.0).is_err());
        assert!(LinearBond::new(1.0, 1.0, f64::NAN, 1.0, 1.0).is_err());
        assert!(LinearBond::new(1.0, 1.0, 0.0, 0.0, 1.0).is_err());
        assert!(LinearBond::new(1.0, 1.0, 0.0, 1.0, f64::NAN).is_err());
    }
}
