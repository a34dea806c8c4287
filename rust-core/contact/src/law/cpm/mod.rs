//! Cohesive particle model for concrete (CPM): damage in tension, Mohr–Coulomb plasticity in shear.
//!
//! Sources: Stránský 2018, §2.5 (equations quoted as (2.x), (6.x)); Šmilauer 2010, chapter "Concrete particle model"
//! (the full model: rate dependence, logarithmic yield surface, plasticity in compression, confinement); the source code of
//! YADE (`ConcretePM`) and Woo (`Concrete`).
//!
//! # The law
//!
//! Symbols: Ē, Ḡ normal and shear modulus (Pa), ε₀ crack onset strain, ε_f softening strain, c₀ cohesion (Pa), φ angle
//! of friction, L and A reference length (m) and area (m²) of the contact, n its unit normal from A to B. Tension
//! positive.
//!
//! Normal direction, (2.3)–(2.5), (2.13)–(2.17), with e = ε_N + σ₀/Ē − ε_Np:
//! ```text
//! ε_N = (d − L)/L                              κ = max over time of ε̃,  ε̃ = √(⟨e⟩² + ξ²|ε_T|²)
//! ω = g(κ) = 1 − (ε₀/κ) exp(−(κ−ε₀)/ε_f)       exponential softening (2.17), 0 for κ < ε₀
//!   or       (1 − ε₀/κ)/(1 − ε₀/ε_f)           linear softening, 1 for κ ≥ ε_f
//! σ_N = [1 − ω H(e)] Ē e − σ₀                  f_N = A σ_N
//! ```
//! ε_f is `relative_ductility` times ε₀. Or it follows from a fracture energy G (`fracture_energy`) so that every bond, of whatever length,
//! dissipates G per area in tension, ∫σ dε = G/L (crack band, Bažant & Oh 1983): ε_f = G/(Ēε₀L) − ε₀/2 with exponential, 2G/(Ēε₀L) with
//! linear softening. A bond must be shorter than 2G/(Ēε₀²), where it would store G at the onset of cracks.
//! ξ (`shear_contribution`) and σ₀ (`isotropic_prestress`, Šmilauer 2010, "Isotropic confinement") are 0 by default.
//! Plasticity in compression (Šmilauer 2010, "Compressive plasticity"), if ε_s = `soft_strain` < 0: for
//! ε_N + σ₀/Ē < ε_s the stress is at least Ē(ε_s + K̃(ε_N + σ₀/Ē − ε_s)) ≤ 0; the difference goes to ε_Np.
//!
//! Shear, (2.18)–(2.20): σ_T = Ḡ(ε_T − ε_Tp), |σ_T| ≤ y(σ_N, ω), flow along σ_T, radial return. With
//! v = `yield_log_speed` (Y₀ of Šmilauer 2010) the radius of the elastic domain, clipped at 0, is
//! ```text
//! 0 Mohr–Coulomb (2.19)      y = c₀(1−ω) − σ_N tan φ
//! 1 parabolic                y = √(c₀² − 2 c₀ σ_N tan φ) − c₀ ω
//! 2 logarithmic              y = c₀[(1−ω) + v tan φ ln(1 − σ_N/(c₀ v))],  0 for σ_N ≥ c₀ v
//! 3 logarithmic-linear       2 in compression, 0 in tension
//! ```
//! σ_N in y is taken before σ₀ is subtracted and before the viscous overstress is added.
//!
//! Rate dependence (Šmilauer 2010, "Visco-damage", "Visco-plasticity"). With characteristic times τ_d, τ_p and exponents
//! M_d, M_p:
//! ```text
//! σ_N ← σ_N + Ē(ωe − ε_d),     ωe − ε_d = (1−ω) ε₀ ⟨τ_d ε̇_d⟩^M_d       (tension; ε_d the damage strain)
//! |σ_T| = y + c₀ (τ_p |ε̇_Tp|)^M_p                                       (while flowing)
//! ```
//! Both are one backward Euler step Δε = s eᵝ of size s = (ωe − ε_d or (|σ_trial| − y)/Ḡ), with β ≤ 0 the root of
//! ln(eᵝ + c e^{Mβ}) = 0, where c = (1−ω) ε₀ (τ_d/Δt)^M_d s^{M_d−1}, or c = c₀ (τ_p/(ḠΔt))^M_p (|σ_trial|−y)^{M_p−1}.
//! The factor (1−ω) is in the published algorithm and in both programs, not in the published continuous equation.
//!
//! A contact that is not a bond has ω = 1: no cohesion and no tension. It ends when ε_N > 0.
//!
//! # Formulations
//!
//! * [`CpmFormulation::Thesis`] (default): the equations above. The radial return is exact, and ε_Tp rotates with the contact
//!   like ε_T. All options are available; with all of them it is the published full model.
//! * [`CpmFormulation::YadePublic`]: YADE's `Law2_ScGeom_CpmPhys_Cpm`, bit for bit with the
//!   kinematics of [`MotionMeasure::Yade`](crate::kinematics::MotionMeasure). Quirks: the plastic increment uses the already scaled stress,
//!   Δε_Tp = s(1−s)σ_trial/Ḡ instead of (1−s)σ_trial/Ḡ; ε_Tp is not rotated with the contact; the hardening line uses e
//!   in place of ε_N (so the hardening modulus depends on the step size: in the limit of small steps the branch is
//!   perfectly plastic whatever K̃); linear damage exceeds 1 beyond ε_f. Other yield surfaces and viscosity have
//!   no effect in YADE and are errors here. This formulation uses the system's `exp` and `tan`.
//! * [`CpmFormulation::Woo`]: Woo's `Law2_L6Geom_ConcretePhys`. Quirks: shear has no memory, the trial stress is Ḡ times the
//!   total ε_T (the published model has ε_Tp), so unloading recovers slip, and slip viscosity depends on Δt; ε_d is
//!   compared with ω ε_N also in compression; σ₀ is subtracted but ε_N is not adjusted; ξ is not used.
//!
//! # Energies
//!
//! With V = A L, D = ω H(e), subscripts o and n for the two ends of a step, per step and exactly (except for rounding)
//! ```text
//! V ½(σ_o+σ_n)·Δε = Δ stored + damage + friction + viscous + integration
//! stored normal   V[½(1−D)Ē e² − σ₀ ε_N − ½σ₀²/Ē]        stored shear  V ½|σ_T|²/Ḡ
//! damage          V ½Ē e_o e_n (D_n − D_o)                 while e keeps its sign, else counted as integration
//! friction        ⟨V ½(σ_o+σ_n)·Δε_p⟩, shear and normal    viscous       V ½(σ_v,o + σ_v,n)·Δε
//! ```
//! because ½[(1−D_o)e_o + (1−D_n)e_n](e_n − e_o) = Δ½(1−D)e² + ½e_o e_n(D_n − D_o). The viscous overstress is a stress
//! without stored energy, so its work in an unloading step can be negative. A bond that breaks releases the energy
//! stored at the end of its last step into `damage`; because the force of that end is not applied, −V ½σ_n·Δε goes to
//! `integration`. If sliding reverses while the bound falls, the rule can give a negative friction, which goes to
//! `integration` too (except in Woo's formulation, where unloading recovers slip for any step size). First-order
//! transport does not preserve lengths: V ½Ḡ(|e_T|² − |transported e_T|²) is `integration`. It also leaves a part of
//! σ_T along n, of second order in the rotations of a step, whose work is not counted. In YADE's formulation the slip
//! is Δε_T − Δσ_T/Ḡ, which differs from the increment of YADE's ε_Tp (quirk above).
//!
//! # Files
//!
//! `parameters` (and their validation), `damage` (g, its inverse, strength), `yield_surface` (the bound of the shear stress),
//! `thesis` (Stránský's published form), `full_model` (all options, also in Woo's form), `yade` (YADE's form), `columns` (batches).

mod damage;
mod full_model;
mod parameters;
#[cfg(feature = "std")]
mod table;
#[cfg(test)]
mod tests;
mod thesis;
mod yade;
mod yield_surface;

pub use crate::geometry::contact_area;
pub use full_model::solve_beta;
pub use parameters::{CpmError, CpmFormulation, CpmParameters, DamageLaw, YieldSurface};
#[cfg(feature = "std")]
pub use table::CpmTable;
pub use yade::{YadeParameters, friction_of_yade};

use super::{
    ColumnUse, ContactGeometry, ContactLaw, EnergySplit, Given, Masses, Reference, Response, Status, Stiffness,
    TemperatureFactors,
};
use crate::columns::Item;
use crate::kinematics::{MotionMeasure, PointKinematics, Transport};
use crate::math::{Vec3, is_zero};

crate::law_state! {
    /// History of a CPM contact.
    pub struct CpmState {
        /// Normal strain ε_N = (d − L)/L, without the shift by an isotropic prestress (Stránský 2018, (2.5)).
        normal_strain: f64, "1", Even;
        /// Largest equivalent strain so far, κ (Stránský 2018, (2.16)).
        kappa: f64, "1", Even;
        /// Damage ω of the normal stiffness and of the cohesion (Stránský 2018, (2.17)); 1 for a contact that is not a bond.
        omega: f64, "1", Even;
        /// Plastic normal strain ε_Np ≤ 0 of compression (Šmilauer 2010, "Compressive plasticity").
        plastic_normal_strain: f64, "1", Even;
        /// Damage strain ε_d, which lags behind ωe when damage is viscous (Šmilauer 2010, "Visco-damage").
        damage_strain: f64, "1", Even;
        /// Shear strain ε_T (Stránský 2018, (2.12) divided by L).
        shear_strain: Vec3, "1", Odd;
        /// Plastic shear strain ε_Tp (Stránský 2018, (2.20)); in Woo's formulation ε_T − σ_T/Ḡ, which is not read.
        plastic_shear_strain: Vec3, "1", Odd;
    }
}

/// Stresses, history, and energies of a contact at the end of a step.
#[derive(Debug, Clone, Copy)]
pub struct StressResponse {
    /// History after the step, also of a contact that ends.
    pub state: CpmState,
    /// Normal stress on the contact, with overstress and without prestress, Pa (YADE's `sigmaN`).
    pub normal_stress: f64,
    /// Shear stress, Pa (YADE's `sigmaT`).
    pub shear_stress: Vec3,
    /// Whether the contact ends: a bond breaks, an unbonded contact opens.
    pub lost: bool,
    /// Energies of the contact if it did not end.
    pub energy: EnergySplit,
}

/// The cohesive particle model: parameters of a pair of materials, with constants derived from them.
///
/// ```
/// use concordem_contact::kinematics::{PointKinematics, Transport};
/// use concordem_contact::law::{ContactGeometry, ContactLaw, Cpm, CpmParameters, CpmState};
/// use concordem_contact::math::Vec3;
///
/// // Modulus, shear ratio, cohesion, friction coefficient, crack onset strain, ductility.
/// let concrete = CpmParameters::new(25e9, 0.2, 3e6, 0.8, 1e-4, 30.0);
/// let law = Cpm::new(&concrete).unwrap();
/// // A bond of 2 m with an area of 3 m² is stretched by half of its crack onset strain.
/// let geometry =
///     ContactGeometry { reference_length: 2.0, area: 3.0, radius_a: 1.0, radius_b: 1.0, mass_a: 1.0, mass_b: 1.0 };
/// let point = PointKinematics {
///     geometry,
///     length: 2.0001,
///     length_old: 2.0,
///     elongation: 2.0001 - 2.0,
///     elongation_old: 0.0,
///     gap: 2.0001 - 2.0,
///     normal: Vec3::x(),
///     shear_increment: Vec3::zeros(),
///     arm_a: 0.5 * 2.0001,
///     arm_b: 0.5 * 2.0001,
///     bonded: true,
///     transport: Transport::identity(Vec3::x()),
/// };
/// let response = law.respond(&point, &CpmState::default(), 1.0e-6);
/// assert!((response.force.x / (3.0 * 25e9 * 0.5e-4) - 1.0).abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Cpm {
    parameters: CpmParameters,
    shear_modulus: f64,
    prestress_strain: f64,
    inverse_shear_modulus: f64,
    /// Softening of bonds of all lengths; void with a fracture energy.
    softening: Softening,
    /// [`CpmParameters::characteristic_length`], m.
    characteristic_length: f64,
    /// The thesis formulation without options, which has its own code path.
    plain: bool,
}

/// Softening strain, and what follows from it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
struct Softening {
    /// ε_f.
    strain: f64,
    /// 1/ε_f.
    inverse: f64,
    /// `1/(1 − ε₀/ε_f)`, for linear damage.
    linear_factor: f64,
}

impl Softening {
    /// With the onset ε₀ and the softening strain ε_f.
    #[inline(always)]
    fn of(onset: f64, strain: f64) -> Self {
        Self { strain, inverse: 1.0 / strain, linear_factor: 1.0 / (1.0 - onset / strain) }
    }
}

impl Cpm {
    /// The law with these parameters.
    pub fn new(parameters: &CpmParameters) -> Result<Self, CpmError> {
        parameters.validate()?;
        let shear_modulus = parameters.shear_modulus();
        Ok(Self {
            parameters: *parameters,
            shear_modulus,
            prestress_strain: parameters.prestress_strain(),
            inverse_shear_modulus: if shear_modulus > 0.0 { 1.0 / shear_modulus } else { 0.0 },
            softening: Softening::of(parameters.crack_onset_strain, parameters.softening_strain(1.0)),
            characteristic_length: parameters.characteristic_length(),
            plain: parameters.mode == CpmFormulation::Thesis
                && parameters.yield_surface == YieldSurface::MohrCoulomb
                && parameters.shear_contribution == 0.0
                && parameters.soft_strain >= 0.0
                && parameters.isotropic_prestress == 0.0
                && parameters.damage_time == 0.0
                && parameters.plasticity_time == 0.0,
        })
    }

    /// The parameters.
    pub fn parameters(&self) -> &CpmParameters {
        &self.parameters
    }

    /// Strain of a bond from the isotropic prestress, σ₀/Ē, 1; YADE's `epsN` contains it.
    pub fn prestress_strain(&self) -> f64 {
        self.prestress_strain
    }

    /// All formulations but the plain thesis form. Not inlined, because every loop would compile its own copy. On a graphics processor a
    /// call would put the bond into memory.
    #[cfg_attr(not(target_arch = "nvptx64"), inline(never))]
    #[cfg_attr(target_arch = "nvptx64", inline(always))]
    fn respond_with_options(&self, k: &PointKinematics, old: &CpmState, dt: f64) -> Response<CpmState> {
        if self.parameters.mode == CpmFormulation::YadePublic {
            self.respond_yade(k, old)
        } else {
            self.respond_full(k, old, dt)
        }
    }

    /// Response with force `(σ_N n + σ_T) A` from the stresses of a step.
    #[inline(always)]
    fn response_of(k: &PointKinematics, old: &CpmState, stresses: &StressResponse) -> Response<CpmState> {
        let StressResponse { state, normal_stress, shear_stress, lost, energy } = *stresses;
        let ContactGeometry { reference_length, area, .. } = k.geometry;
        if lost {
            let inverse_length = 1.0 / reference_length;
            let strain_step = state.normal_strain - strain_before(k, old, inverse_length);
            let (volume, shear_step) = (area * reference_length, k.shear_increment * inverse_length);
            return release(k, volume, normal_stress, &shear_stress, strain_step, &shear_step, &energy);
        }
        let force = (k.normal * normal_stress + shear_stress) * area;
        Response { force, moment: Vec3::zeros(), state, status: Status::Lives, energy }
    }
}

/// Strains of a contact in a step, and its history rotated to the present axes.
#[derive(Clone, Copy)]
struct Step {
    /// Volume A L, m³.
    volume: f64,
    /// Normal strain now.
    strain: f64,
    /// Normal strain at the start of the step.
    strain_old: f64,
    /// Increment of the shear strain.
    shear_strain_increment: Vec3,
    /// Old shear strain, rotated.
    carried_shear: Vec3,
    /// Old plastic shear strain, rotated.
    carried_plastic: Vec3,
}

impl Step {
    #[inline(always)]
    fn new(k: &PointKinematics, old: &CpmState) -> Self {
        let length = k.geometry.reference_length;
        let inverse_length = 1.0 / length;
        // Most bonds never slip, and the zero vector needs no rotation.
        let carried_plastic = if is_zero(&old.plastic_shear_strain) {
            Vec3::zeros()
        } else {
            k.transport.apply(&old.plastic_shear_strain)
        };
        Self {
            volume: k.geometry.area * length,
            strain: k.elongation * inverse_length,
            strain_old: strain_before(k, old, inverse_length),
            shear_strain_increment: k.shear_increment * inverse_length,
            carried_shear: k.transport.apply(&old.shear_strain),
            carried_plastic,
        }
    }

    /// Shear strain now.
    #[inline(always)]
    fn shear_strain(&self) -> Vec3 {
        self.carried_shear + self.shear_strain_increment
    }

    /// Old elastic shear strain, rotated.
    #[inline(always)]
    fn carried_elastic(&self) -> Vec3 {
        self.carried_shear - self.carried_plastic
    }
}

impl Cpm {
    /// Add the energy dissipated by the growth of damage, J: `V ½Ē e_o e_n (D_n − D_o)` for elastic strains `e` and damage
    /// `D`, at the old and the new end of the step.
    #[inline(always)]
    fn add_damage(&self, energy: &mut EnergySplit, volume: f64, [e_old, e]: [f64; 2], [old, damage]: [f64; 2]) {
        if damage != old {
            let product = volume * 0.5 * self.parameters.young * e_old * e * (damage - old);
            if e_old * e < 0.0 {
                energy.integration += product;
            } else {
                energy.damage = product;
            }
        }
    }

    /// Add stored shear energy, and the change of it by first-order transport, which does not preserve lengths.
    #[inline(always)]
    fn add_shear(&self, energy: &mut EnergySplit, k: &PointKinematics, old: &CpmState, step: &Step, stress: &Vec3) {
        energy.stored_shear = 0.5 * step.volume * self.inverse_shear_modulus * stress.norm_squared();
        if matches!(k.transport, Transport::FirstOrder { .. }) {
            let elastic_old = old.shear_strain - old.plastic_shear_strain;
            energy.integration += 0.5
                * step.volume
                * self.shear_modulus
                * (elastic_old.norm_squared() - step.carried_elastic().norm_squared());
        }
    }
}

/// Normal strain at the start of the step. An unbonded contact deletes its history when it opens, so its strain follows
/// from the length instead.
#[inline(always)]
fn strain_before(k: &PointKinematics, old: &CpmState, inverse_length: f64) -> f64 {
    if k.bonded { old.normal_strain } else { (k.length_old - k.geometry.reference_length) * inverse_length }
}

/// Plastic and elastic normal strain at the start of the step, for the energies, from their sum `strain`. An unbonded contact that takes
/// over a compressed bond begins beyond the plastic limit: its dissipation until then belongs to the bond.
#[inline(always)]
fn normal_before(parameters: &CpmParameters, k: &PointKinematics, old: &CpmState, strain: f64) -> (f64, f64) {
    let (plastic, limit) = (old.plastic_normal_strain, parameters.soft_strain);
    if limit >= 0.0 || k.bonded || plastic != 0.0 || strain >= limit {
        return (plastic, strain - plastic);
    }
    let plastic = (strain - parameters.strain_at_limit(strain)).min(0.0);
    (plastic, strain - plastic)
}

/// Damage at the start of the step: 1 for an unbonded contact, also before its first evaluation.
#[inline(always)]
fn omega_before(k: &PointKinematics, old: &CpmState) -> f64 {
    if k.bonded { old.omega } else { 1.0 }
}

/// Response of a contact that ends in this step: no force, no history, stored energy released. The `stored_*` fields of a
/// bond keep the modes of the released energy, see [`Status::Broke`].
// Inlined, so that the response of the common path stays in registers.
#[inline(always)]
fn release(
    k: &PointKinematics,
    volume: f64,
    normal_stress: f64,
    shear_stress: &Vec3,
    strain_step: f64,
    shear_step: &Vec3,
    energy: &EnergySplit,
) -> Response<CpmState> {
    let mut energy = *energy;
    let stored = energy.stored_normal + energy.stored_shear;
    if k.bonded {
        energy.damage += stored;
    } else {
        energy.friction += stored;
        energy.stored_normal = 0.0;
        energy.stored_shear = 0.0;
    }
    // The energies of this step assume the stress of its end, which is not applied.
    energy.integration -= 0.5 * volume * (normal_stress * strain_step + shear_stress.dot(shear_step));
    Response {
        force: Vec3::zeros(),
        moment: Vec3::zeros(),
        state: CpmState::default(),
        status: if k.bonded { Status::Broke } else { Status::Opened },
        energy,
    }
}

/// Fraction of the crack onset strain from which damage is expected to grow.
const NEAR_ONSET: f64 = 0.9;

impl ContactLaw for Cpm {
    type State = CpmState;
    type Kinematics = PointKinematics;
    const NAME: &'static str = "cpm";
    const VARIES: bool = true;

    /// The stress at which damage begins is that of the strength, so the strains ε₀ and ε_f have the factor strength/stiffness, and so
    /// has ε_s.
    fn at_temperature(&self, factors: &TemperatureFactors) -> Self {
        let TemperatureFactors { stiffness, strength } = *factors;
        let strain = strength / stiffness;
        let mut law = *self;
        law.parameters.young *= stiffness;
        law.parameters.cohesion *= strength;
        law.parameters.crack_onset_strain *= strain;
        law.parameters.soft_strain *= strain;
        law.shear_modulus *= stiffness;
        law.inverse_shear_modulus /= stiffness;
        law.softening.strain *= strain;
        law.softening.inverse /= strain;
        // The characteristic length stays: ε_f follows ε₀, so that ω remains a function of κ/ε₀, and the fracture energy
        // has the factor strength²/stiffness.
        law
    }

    /// ω is a function of κ/ε₀. κ is stored for the ε₀ of factors of 1, so that warming alone changes no damage.
    fn history_at(state: &CpmState, factors: &TemperatureFactors) -> CpmState {
        CpmState { kappa: state.kappa * (factors.strength / factors.stiffness), ..*state }
    }

    fn history_from(state: &CpmState, old: &CpmState, factors: &TemperatureFactors) -> CpmState {
        // A κ that has not grown keeps its bits.
        let kept = state.kappa == Self::history_at(old, factors).kappa;
        let kappa = if kept { old.kappa } else { state.kappa / (factors.strength / factors.stiffness) };
        CpmState { kappa, ..*state }
    }

    #[inline(always)]
    fn respond(&self, kinematics: &PointKinematics, old: &CpmState, dt: f64) -> Response<CpmState> {
        if self.plain { self.respond_thesis(kinematics, old) } else { self.respond_with_options(kinematics, old, dt) }
    }

    const COLUMNS: Option<ColumnUse> = Some(ColumnUse { masses: Masses::Unread, viscous: false, ..ColumnUse::ALL });
    /// The damage of a bond whose κ grows contains an exponential.
    const LOOKS_AHEAD: bool = true;

    /// The plain thesis form under the finite measure, and YADE's formulation under YADE's measures. Contacts that end are not certain,
    /// nor are those whose damage grows and is not known.
    #[inline(always)]
    fn straight(
        &self,
        kinematics: &PointKinematics,
        old: &CpmState,
        given: &Given,
        _dt: f64,
    ) -> (Response<CpmState>, bool) {
        let Given { measure, ahead: [known_kappa, known_damage], .. } = *given;
        let (onset, never) = (self.parameters.crack_onset_strain, self.parameters.never_damage);
        let area = kinematics.geometry.area;
        let (stresses, force);
        if measure == MotionMeasure::Finite {
            stresses = self.evaluate_thesis(kinematics, old, |kappa| {
                if kappa <= onset || never {
                    0.0
                } else if kappa == known_kappa {
                    known_damage
                } else {
                    f64::NAN
                }
            });
            force = (kinematics.normal * stresses.normal_stress + stresses.shear_stress) * area;
        } else {
            stresses = self.evaluate_with_damage(kinematics, old, |kappa| {
                if kappa == old.kappa {
                    old.omega
                } else if kappa < onset || never {
                    0.0
                } else {
                    f64::NAN
                }
            });
            force = kinematics.normal * (stresses.normal_stress * area) + stresses.shear_stress * area;
        }
        let StressResponse { state, lost, energy, .. } = stresses;
        (Response { energy, ..Response::of_force(force, state) }, !lost & !state.omega.is_nan())
    }

    #[inline(always)]
    fn is_straight(&self, measure: MotionMeasure) -> bool {
        match measure {
            MotionMeasure::Finite => self.plain,
            MotionMeasure::Yade | MotionMeasure::YadeRatcheting => self.parameters.mode == CpmFormulation::YadePublic,
            MotionMeasure::FirstOrder => false,
        }
    }

    /// Whether the strain of a contact is near the onset of cracks, in the plain thesis form.
    #[inline(always)]
    fn may_look_ahead(&self, histories: &<CpmState as Item>::Arrays) -> bool {
        let near = NEAR_ONSET * self.parameters.crack_onset_strain;
        // A sum over all columns needs no branch. (Unused columns may count in vain.)
        self.plain && histories.normal_strain.iter().map(|&strain| u64::from(strain > near)).sum::<u64>() > 0
    }

    /// κ, which does not depend on the damage, if it grows.
    #[inline(always)]
    fn argument_ahead(old: &CpmState, new: &CpmState) -> f64 {
        if new.kappa > old.kappa { new.kappa } else { f64::NAN }
    }

    #[inline(always)]
    fn value_ahead(&self, reference: Reference, kappa: f64) -> f64 {
        self.damage_function(kappa, reference.length)
    }

    /// The shear stress follows from the strains, except in YADE's formulation, whose plastic strain is not that of its stress: a
    /// return to the yield surface gives it. (Viscous slip in Woo's formulation depends on the time step.)
    fn last_force(&self, still: &PointKinematics, state: &CpmState) -> (Vec3, Vec3) {
        // A step so short that nothing viscous flows in it.
        let Response { force, state: again, .. } = self.respond(still, state, 1e-30);
        if self.parameters.mode == CpmFormulation::YadePublic {
            return (force, Vec3::zeros());
        }
        let elastic = |s: &CpmState| s.shear_strain - s.plastic_shear_strain;
        (force + (elastic(state) - elastic(&again)) * (self.shear_modulus * still.geometry.area), Vec3::zeros())
    }

    /// An unbonded contact is unstrained at the center distance of its first step (as in YADE); at the radius against a wall.
    fn unbonded_reference(length: f64, radius_a: f64, radius_b: f64) -> Reference {
        let length = if radius_b > 0.0 { length } else { radius_a };
        Reference { length, area: contact_area(radius_a, radius_b) }
    }

    /// k_N = ĒA/L, k_T = ḠA/L in N/m.
    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        let area_by_length = geometry.area / geometry.reference_length;
        Stiffness {
            normal: self.parameters.young * area_by_length,
            shear: self.shear_modulus * area_by_length,
            ..Stiffness::default()
        }
    }

    /// Beyond the plastic limit the spring has less strain than the contact.
    #[inline(always)]
    fn work_before(&self, motion: &PointKinematics, stored: f64) -> f64 {
        let mut ratio = motion.elongation_old / motion.elongation;
        if self.parameters.soft_strain < 0.0 {
            let spring = |elongation: f64| {
                let strain = elongation / motion.geometry.reference_length;
                normal_before(&self.parameters, motion, &CpmState::default(), strain).1
            };
            ratio = spring(motion.elongation_old) / spring(motion.elongation);
        }
        if stored > 0.0 { stored * (ratio * ratio) } else { 0.0 }
    }

    /// ω of a bond; 0 for an unbonded contact, which has κ = 0. (In YADE's formulation an unbonded contact can get κ > 0 from
    /// plasticity in compression, and is then reported as damaged.)
    fn damage(state: &CpmState) -> f64 {
        if state.kappa > 0.0 { state.omega } else { 0.0 }
    }

    /// `1 − (1−ω)κ/ε₀` (Stránský 2018, (6.5)–(6.6)).
    fn lost_strength(&self, reference: Reference, state: &CpmState) -> f64 {
        self.strength_damage(state.kappa, reference.length)
    }

    /// Beyond it, a bond would dissipate more than its fracture energy.
    fn longest_bond(&self) -> f64 {
        self.parameters.longest_bond()
    }
}
