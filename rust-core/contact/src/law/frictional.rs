//! Unbonded contact with linear springs and Coulomb friction (Cundall & Strack 1979, Géotechnique 29:47). A broken
//! linear bond continues as such a contact (Madan 2019, (2.40)).
//!
//! With the elongation `u` (negative while the particles touch) and the elastic shear displacement `u_t`,
//!
//! * `f_n = k_n u + c_n u̇` while `u < 0`, otherwise zero; unless [`Frictional::tension_from_damping`] is on, the
//!   normal force never pulls: `f_n ≤ 0`;
//! * `u_t` follows the shear displacement; if `k_t‖u_t‖` exceeds `μ|f_n|`, it is scaled back to the limit, and the
//!   difference is slip (return to the Coulomb cone at constant normal force);
//! * a shear dashpot `c_t u̇_t` acts within what the Coulomb limit leaves, so not during sliding;
//! * `c = ξ·2√(m k)` with the reduced mass `m`.
//!
//! Forces are those on A, in N, positive in tension. Particles touch if the length is less than
//! [`ContactGeometry::reference_length`], which is `R_A + R_B` for ordinary contacts; a broken bond may keep its own.
//! The energy balance is exact for the trapezoidal rule: friction is `½(f_old + f_new)·slip`. If a contact closes or
//! opens within a step, the rule overestimates or underestimates the work of the kinked spring by
//! `½k_n(u_old⁻u⁺ − u⁻u_old⁺)`, which is the [`EnergySplit::integration`] term.

use super::common::{ParameterError, dashpot_within_limit, reciprocal_of_step, require};
use super::{ContactGeometry, ContactLaw, EnergySplit, Response, Status, Stiffness, TemperatureFactors};
use crate::kinematics::PointKinematics;
#[cfg(not(feature = "std"))]
use crate::math::Real as _;
use crate::math::{Vec3, norm};
#[cfg(feature = "std")]
use {
    super::{
        Factors,
        factors::times,
        table::{Fault, LawTable, RegisteredLaw},
    },
    crate::quantity::{self, Number, Stress},
    schemars::JsonSchema,
    serde::{Deserialize, Serialize},
};

/// Source of the stiffnesses of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ContactStiffness {
    /// The same values for every contact.
    Given {
        /// `k_n`, N/m.
        normal: f64,
        /// `k_t`, N/m.
        shear: f64,
    },
    /// From moduli and radii, as in YADE's `Ip2_FrictMat_FrictMat_FrictPhys` (Šmilauer et al. 2010): two springs
    /// `2 E r` in series, `k_n = 2 E_A r_A E_B r_B/(E_A r_A + E_B r_B)`, `k_t = ratio·k_n`. A wall has no radius; the
    /// formulas use the radius of the particle for both.
    Moduli {
        /// Modulus of A, Pa.
        young_a: f64,
        /// Modulus of B, Pa.
        young_b: f64,
        /// `k_t/k_n`, 1 (YADE calls it `poisson`).
        ratio: f64,
    },
}

impl ContactStiffness {
    /// `(k_n, k_t)` of a contact, N/m.
    #[inline(always)]
    pub fn of(&self, geometry: &ContactGeometry) -> (f64, f64) {
        match *self {
            Self::Given { normal, shear } => (normal, shear),
            Self::Moduli { young_a, young_b, ratio } => {
                let radius_b = if geometry.radius_b > 0.0 { geometry.radius_b } else { geometry.radius_a };
                let (a, b) = (young_a * geometry.radius_a, young_b * radius_b);
                let normal = 2.0 * (a * b) / (a + b);
                (normal, ratio * normal)
            }
        }
    }
}

/// Parameters of the linear frictional contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frictional {
    /// Source of the stiffnesses.
    pub stiffness: ContactStiffness,
    /// Coefficient of friction `μ = tan φ`, 1.
    pub friction: f64,
    /// Damping ratio `ξ` of both dashpots, 1. [`damping_of_restitution`](super::restitution::damping_of_restitution)
    /// computes it from a coefficient of restitution.
    pub damping_ratio: f64,
    /// Whether the dashpot may pull the particles together while they separate.
    pub tension_from_damping: bool,
}

crate::law_state! {
    /// History of a [`Frictional`] contact.
    pub struct FrictionalState {
        /// Elastic shear displacement.
        shear_displacement: Vec3, "m", Odd;
        /// Normal dashpot force of the last step, after limiting.
        normal_dashpot: f64, "N", Even;
        /// Shear dashpot force of the last step, after limiting.
        shear_dashpot: Vec3, "N", Odd;
    }
}

impl Frictional {
    /// A contact that never pulls, with the given stiffnesses, friction coefficient, and damping ratio.
    pub fn new(stiffness: ContactStiffness, friction: f64, damping_ratio: f64) -> Result<Self, ParameterError> {
        let contact = Self { stiffness, friction, damping_ratio, tension_from_damping: false };
        contact.validate()?;
        Ok(contact)
    }

    /// Check that all parameters are in their ranges.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let not_negative = |value: f64| value >= 0.0 && value.is_finite();
        match self.stiffness {
            ContactStiffness::Given { normal, shear } => {
                require(positive(normal), Self::NAME, "normal_stiffness", normal, "positive and finite (N/m)")?;
                require(not_negative(shear), Self::NAME, "shear_stiffness", shear, "finite and not negative (N/m)")?;
            }
            ContactStiffness::Moduli { young_a, young_b, ratio } => {
                require(positive(young_a), Self::NAME, "young", young_a, "positive and finite (Pa)")?;
                require(positive(young_b), Self::NAME, "young", young_b, "positive and finite (Pa)")?;
                require(not_negative(ratio), Self::NAME, "stiffness_ratio", ratio, "finite and not negative")?;
            }
        }
        require(
            not_negative(self.friction),
            Self::NAME,
            "friction_coefficient",
            self.friction,
            "finite and not negative",
        )?;
        let xi = self.damping_ratio;
        require(not_negative(xi), Self::NAME, "damping_ratio", xi, "finite and not negative")
    }

    /// Dashpot constants `(c_n, c_t)`, N·s/m.
    #[inline(always)]
    fn dashpots(&self, geometry: &ContactGeometry, normal: f64, shear: f64) -> (f64, f64) {
        if self.damping_ratio == 0.0 {
            return (0.0, 0.0);
        }
        let mass = geometry.reduced_mass();
        (2.0 * self.damping_ratio * (mass * normal).sqrt(), 2.0 * self.damping_ratio * (mass * shear).sqrt())
    }
}

impl ContactLaw for Frictional {
    type State = FrictionalState;
    type Kinematics = PointKinematics;
    const NAME: &'static str = "frictional";
    const DEFORMS: bool = true;
    const VARIES: bool = true;

    fn at_temperature(&self, factors: &TemperatureFactors) -> Self {
        let factor = factors.stiffness;
        let stiffness = match self.stiffness {
            ContactStiffness::Given { normal, shear } => {
                ContactStiffness::Given { normal: normal * factor, shear: shear * factor }
            }
            ContactStiffness::Moduli { young_a, young_b, ratio } => {
                ContactStiffness::Moduli { young_a: young_a * factor, young_b: young_b * factor, ratio }
            }
        };
        Self { stiffness, ..*self }
    }

    #[inline(always)]
    fn respond(&self, kinematics: &PointKinematics, old: &FrictionalState, dt: f64) -> Response<FrictionalState> {
        let geometry = &kinematics.geometry;
        let (normal_stiffness, shear_stiffness) = self.stiffness.of(geometry);
        let lengthening = kinematics.length - kinematics.length_old;
        let slide = kinematics.shear_increment;
        let stretch = kinematics.elongation;
        let old_stretch = kinematics.elongation_old;
        let old_shear = kinematics.transport.apply(&old.shear_displacement);
        let old_shear_dashpot = kinematics.transport.apply(&old.shear_dashpot);

        let mut energy = EnergySplit {
            integration: 0.5
                * normal_stiffness
                * (old_stretch.min(0.0) * stretch.max(0.0) - stretch.min(0.0) * old_stretch.max(0.0)),
            ..EnergySplit::default()
        };
        if stretch >= 0.0 {
            energy.add_friction(0.5 * shear_stiffness * old_shear.dot(&(old_shear + slide)));
            energy.add_viscous(0.5 * old.normal_dashpot * lengthening);
            energy.add_viscous(0.5 * old_shear_dashpot.dot(&slide));
            return Response {
                force: Vec3::zeros(),
                moment: Vec3::zeros(),
                state: FrictionalState::default(),
                status: Status::Opened,
                energy,
            };
        }

        let (normal_viscosity, shear_viscosity) = self.dashpots(geometry, normal_stiffness, shear_stiffness);
        let rate = reciprocal_of_step(dt);
        let elastic_normal = normal_stiffness * stretch;
        let mut normal_dashpot = normal_viscosity * lengthening * rate;
        if !self.tension_from_damping {
            normal_dashpot = normal_dashpot.min(-elastic_normal);
        }
        let normal_force = elastic_normal + normal_dashpot;

        let limit = self.friction * (-normal_force).max(0.0);
        let trial = old_shear + slide;
        let trial_force = shear_stiffness * norm(&trial);
        let (shear_displacement, shear_dashpot) = if trial_force > limit {
            let shear_displacement = trial * (limit / trial_force);
            let slip = trial - shear_displacement;
            energy.add_friction(0.5 * shear_stiffness * (old_shear + shear_displacement).dot(&slip));
            (shear_displacement, Vec3::zeros())
        } else {
            let dashpot = slide * (shear_viscosity * rate);
            (trial, dashpot_within_limit(&(trial * shear_stiffness), &dashpot, limit))
        };
        let elastic_shear = shear_displacement * shear_stiffness;

        energy.stored_normal = 0.5 * elastic_normal * stretch;
        energy.stored_shear = 0.5 * elastic_shear.dot(&shear_displacement);
        energy.add_viscous(0.5 * (old.normal_dashpot + normal_dashpot) * lengthening);
        energy.add_viscous(0.5 * (old_shear_dashpot + shear_dashpot).dot(&slide));
        Response {
            force: kinematics.normal * normal_force + elastic_shear + shear_dashpot,
            moment: Vec3::zeros(),
            state: FrictionalState { shear_displacement, normal_dashpot, shear_dashpot },
            status: Status::Lives,
            energy,
        }
    }

    /// The friction limit depends on the dashpot, so the shear force comes from the history.
    fn last_force(&self, still: &PointKinematics, state: &FrictionalState) -> (Vec3, Vec3) {
        let (normal_stiffness, shear_stiffness) = self.stiffness.of(&still.geometry);
        let elastic = still.normal * (normal_stiffness * still.elongation) + state.shear_displacement * shear_stiffness;
        (elastic + Self::viscous_force(&still.normal, state), Vec3::zeros())
    }

    #[inline(always)]
    fn viscous_force(normal: &Vec3, state: &Self::State) -> Vec3 {
        normal * state.normal_dashpot + state.shear_dashpot
    }

    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        let (normal, shear) = self.stiffness.of(geometry);
        let (normal_damping, shear_damping) = self.dashpots(geometry, normal, shear);
        Stiffness { normal, shear, normal_damping, shear_damping, ..Stiffness::default() }
    }

    fn exchanged(&self) -> Self {
        let mut out = *self;
        if let ContactStiffness::Moduli { young_a, young_b, .. } = &mut out.stiffness {
            core::mem::swap(young_a, young_b);
        }
        out
    }
}

/// Linear elastic contact with Coulomb friction; no tension.
#[cfg(feature = "std")]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "Frictional", deny_unknown_fields)]
pub struct FrictionalTable {
    /// Modulus, Pa: the normal stiffness of two equal spheres is modulus × radius; or give both stiffnesses.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub young: Option<Stress>,
    /// Shear stiffness divided by normal stiffness; with `young`.
    #[schemars(extend("minimum" = 0))]
    pub stiffness_ratio: Option<Number>,
    /// Normal stiffness, N/m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub normal_stiffness: Option<quantity::Stiffness>,
    /// Shear stiffness, N/m.
    #[schemars(extend("minimum" = 0))]
    pub shear_stiffness: Option<quantity::Stiffness>,
    /// Friction coefficient (tangent of the angle).
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub friction_coefficient: Number,
    /// Dashpots as a fraction of critical damping.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub damping_ratio: Number,
}

#[cfg(feature = "std")]
impl LawTable for FrictionalTable {
    fn faults(&self) -> Vec<Fault> {
        let moduli = [("young", self.young.is_some()), ("stiffness_ratio", self.stiffness_ratio.is_some())];
        let springs = [
            ("normal_stiffness", self.normal_stiffness.is_some()),
            ("shear_stiffness", self.shear_stiffness.is_some()),
        ];
        let help = "give `young` and `stiffness_ratio` (the stiffness grows with the radius), \
                    or `normal_stiffness` and `shear_stiffness` (the same for all contacts)";
        let any = |pair: &[(&str, bool); 2]| pair.iter().any(|(_, given)| *given);
        if any(&moduli) && any(&springs) {
            let key = springs.iter().find(|(_, given)| *given).map_or("normal_stiffness", |(key, _)| key);
            return vec![Fault::conflict(key, "the stiffness is given twice", help)];
        }
        if !any(&moduli) && !any(&springs) {
            return vec![Fault::missing("", "the stiffness is missing", help)];
        }
        let pair = if any(&moduli) { moduli } else { springs };
        pair.iter().filter(|(_, given)| !given).map(|(key, _)| Fault::missing(key, "missing key", help)).collect()
    }

    fn modulus(&self) -> Option<f64> {
        self.young.map(Stress::si)
    }

    fn fault_of_variation(&self) -> Option<Fault> {
        None
    }

    fn fault_in_plane(&self) -> Option<Fault> {
        self.young?;
        let help = "give `normal_stiffness` and `shear_stiffness` in N/m, or use dimension = 3";
        let message = "gives the stiffness of spheres, which has no meaning between discs of unit depth";
        Some(Fault::conflict("young", message, help))
    }
}

#[cfg(feature = "std")]
impl RegisteredLaw for Frictional {
    type Table = FrictionalTable;
    type Unbonded = Self;
    const TITLE: &'static str = "linear frictional contact";
    const AS_CONTACT: Option<&'static str> = Some("Linear elastic contact with Coulomb friction.");

    fn row(a: &FrictionalTable, b: &FrictionalTable) -> Result<Self, ParameterError> {
        let mean = |x: f64, y: f64| 0.5 * (x + y);
        let stiffness = match (a.young, b.young, a.normal_stiffness, b.normal_stiffness) {
            (Some(young_a), Some(young_b), _, _) => {
                let ratio = |table: &FrictionalTable| table.stiffness_ratio.map_or(0.0, Number::si);
                ContactStiffness::Moduli {
                    young_a: young_a.si(),
                    young_b: young_b.si(),
                    ratio: mean(ratio(a), ratio(b)),
                }
            }
            (_, _, Some(normal_a), Some(normal_b)) => {
                let shear = |table: &FrictionalTable| table.shear_stiffness.map_or(0.0, quantity::Stiffness::si);
                ContactStiffness::Given { normal: mean(normal_a.si(), normal_b.si()), shear: mean(shear(a), shear(b)) }
            }
            _ => {
                return Err(ParameterError::Unlike(
                    "one material gives `young`, the other `normal_stiffness`; give both the same, or an [[interface]]",
                ));
            }
        };
        // The smoother surface slides first.
        let friction = a.friction_coefficient.si().min(b.friction_coefficient.si());
        Self::new(stiffness, friction, mean(a.damping_ratio.si(), b.damping_ratio.si()))
    }

    fn unbonded_row(a: &FrictionalTable, b: &FrictionalTable) -> Result<Self, ParameterError> {
        Self::row(a, b)
    }

    /// Only bonds have strength and ductility.
    fn scaled(table: &FrictionalTable, factors: &Factors) -> Result<FrictionalTable, Fault> {
        Ok(FrictionalTable {
            young: table.young.map(|young| times(young, factors.stiffness)),
            normal_stiffness: table.normal_stiffness.map(|stiffness| times(stiffness, factors.stiffness)),
            shear_stiffness: table.shear_stiffness.map(|stiffness| times(stiffness, factors.stiffness)),
            ..table.clone()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance::{
        GEOMETRY, Native, Observed, Properties, Station, Subject, Window, atlas, atlas_paths, check,
    };

    /// Overlaps are a large fraction of the length, so rounding of positions hides nothing.
    fn subject(name: &'static str, law: Frictional) -> Subject<Native<Frictional>> {
        let window = Window { elongation: [-0.4, 0.1], shear: 0.5 };
        Subject {
            name,
            host: Native(law),
            geometry: GEOMETRY,
            bonded: false,
            properties: Properties {
                conservative_normal: law.damping_ratio == 0.0,
                conservative_shear: false,
                dissipation_nonnegative: true,
                continuous_failure: !law.tension_from_damping,
                brittle: false,
            },
            elastic: window,
            inelastic: window,
            held: Station { elongation: -0.3, shear: [0.1, -0.15], twist: 0.0 },
            failure: 0.1,
            dt: 1e-3,
        }
    }

    /// The law written out without dashpots: a shear spring of two components with a circular limit.
    fn closed_form(kn: f64, kt: f64, friction: f64) -> impl FnMut(&Observed) -> Option<[f64; 3]> {
        let mut before = [0.0; 2];
        let mut spring = [0.0; 2];
        move |now| {
            let s = now.station;
            let pressure = (-kn * s.elongation).max(0.0);
            for k in 0..2 {
                spring[k] += s.shear[k] - before[k];
            }
            before = s.shear;
            let size = kt * (spring[0] * spring[0] + spring[1] * spring[1]).sqrt();
            if size > friction * pressure {
                for x in &mut spring {
                    *x *= friction * pressure / size;
                }
            }
            Some([-pressure, kt * spring[0], kt * spring[1]])
        }
    }

    #[test]
    fn undamped_contact_conforms() {
        let law = Frictional::new(ContactStiffness::Given { normal: 1e6, shear: 5e5 }, 0.5, 0.0).unwrap();
        let subject = subject("frictional", law);
        let mut report = check(&subject);
        report.findings.extend(atlas(
            &subject,
            &atlas_paths(&subject.inelastic, 50),
            || closed_form(1e6, 5e5, 0.5),
            1e-12,
            "rounding of orientations over 250 steps",
        ));
        println!("{report}");
        assert!(report.passed(), "{report}");
    }

    #[test]
    fn damped_contacts_conform() {
        let stiffness = ContactStiffness::Moduli { young_a: 5e5, young_b: 9e5, ratio: 0.3 };
        let mut law = Frictional::new(stiffness, 0.4, 0.2).unwrap();
        for tension_from_damping in [false, true] {
            law.tension_from_damping = tension_from_damping;
            let mut subject = subject("damped frictional, unlike particles", law);
            // Fast enough for the dashpot to matter.
            subject.dt = 1e-4;
            let report = check(&subject);
            println!("{report}");
            assert!(report.passed(), "{report}");
        }
    }

    /// Two springs 2Er in series; for a wall the radius of the sphere is used.
    #[test]
    fn stiffness_from_moduli() {
        let stiffness = ContactStiffness::Moduli { young_a: 5e5, young_b: 9e5, ratio: 0.3 };
        let (a, b) = (2.0 * 5e5 * 0.8, 2.0 * 9e5 * 1.2);
        let (kn, kt) = stiffness.of(&GEOMETRY);
        // Three roundings on either side.
        assert!((kn * (1.0 / a + 1.0 / b) - 1.0).abs() < 1e-15);
        assert!((kt / kn - 0.3).abs() < 1e-15);
        let wall = ContactGeometry { radius_b: 0.0, mass_b: f64::INFINITY, ..GEOMETRY };
        let b = 2.0 * 9e5 * 0.8;
        assert!((stiffness.of(&wall).0 * (1.0 / a + 1.0 / b) - 1.0).abs() < 1e-15);
    }

    /// A sphere bouncing off a wall rebounds with the restitution from which the damping ratio was computed. Tolerance
    /// 1e-4: 2e4 steps per collision, and the dashpot lags by half a step.
    #[test]
    fn restitution_of_a_bounce() {
        use crate::law::restitution::{End, damping_of_restitution};
        let wall = ContactGeometry { reference_length: 0.8, radius_b: 0.0, mass_b: f64::INFINITY, ..GEOMETRY };
        for (end, pulls) in [(End::ForceSpent, false), (End::OverlapSpent, true)] {
            for e in [0.3, 0.7, 0.95, 1.0] {
                let stiffness = ContactStiffness::Given { normal: 1e6, shear: 0.0 };
                let mut law = Frictional::new(stiffness, 0.0, damping_of_restitution(e, end)).unwrap();
                law.tension_from_damping = pulls;
                let dt = std::f64::consts::PI / 1e3 / 2e4;
                let (mut length, mut velocity, mut state) = (0.8, -1.0, FrictionalState::default());
                loop {
                    let length_old = length;
                    length += velocity * dt;
                    let k = PointKinematics {
                        geometry: wall,
                        length,
                        length_old,
                        elongation: length - 0.8,
                        elongation_old: length_old - 0.8,
                        gap: length - 0.8,
                        normal: -Vec3::y(),
                        shear_increment: Vec3::zeros(),
                        arm_a: 0.4 + 0.5 * length,
                        arm_b: 0.5 * length - 0.4,
                        bonded: false,
                        transport: crate::kinematics::Transport::identity(-Vec3::y()),
                    };
                    let response = law.respond(&k, &state, dt);
                    if response.status == Status::Opened {
                        break;
                    }
                    state = response.state;
                    velocity += response.force.y * dt / wall.mass_a;
                }
                assert!((velocity - e).abs() < 1e-4, "{end:?} {e}: {velocity}");
            }
        }
    }

    #[test]
    fn bad_parameters_are_named() {
        let stiffness = ContactStiffness::Given { normal: 1e6, shear: 5e5 };
        let message = Frictional::new(stiffness, -0.1, 0.0).unwrap_err().to_string();
        assert_eq!(message, "law frictional: friction_coefficient = -0.1 must be finite and not negative");
        assert!(Frictional::new(ContactStiffness::Given { normal: 0.0, shear: 0.0 }, 0.1, 0.0).is_err());
        let moduli = ContactStiffness::Moduli { young_a: 1e9, young_b: f64::INFINITY, ratio: 0.3 };
        assert!(Frictional::new(moduli, 0.1, 0.0).is_err());
        assert!(Frictional::new(stiffness, 0.1, f64::NAN).is_err());
    }

    fn table(young: f64, friction: f64, damping: f64) -> FrictionalTable {
        FrictionalTable {
            young: Some(Stress::new(young)),
            stiffness_ratio: Some(Number::new(0.25)),
            normal_stiffness: None,
            shear_stiffness: None,
            friction_coefficient: Number::new(friction),
            damping_ratio: Number::new(damping),
        }
    }

    /// Two materials: the smoother surface slides, dashpots and stiffnesses in N/m are means, and each sphere keeps its own
    /// modulus: two springs `2Er` in series, whoever is A. All numbers are exact.
    #[test]
    fn two_materials_share_a_contact() {
        let (soft, stiff) = (table(1e6, 0.75, 0.0), table(3e6, 0.25, 0.5));
        let row = Frictional::row(&soft, &stiff).unwrap();
        assert_eq!((row.friction, row.damping_ratio), (0.25, 0.25));
        // 2·(1e6·1)(3e6·2)/(1e6·1 + 3e6·2); at a wall, both with the radius of the sphere.
        let geometry = ContactGeometry { radius_a: 1.0, radius_b: 2.0, ..GEOMETRY };
        let expected = (12e12 / 7e6, 0.25 * (12e12 / 7e6));
        assert_eq!(row.stiffness.of(&geometry), expected);
        let mirrored = ContactGeometry { radius_a: 2.0, radius_b: 1.0, ..GEOMETRY };
        assert_eq!(row.exchanged().stiffness.of(&mirrored), expected);
        let wall = ContactGeometry { radius_a: 1.0, radius_b: 0.0, ..GEOMETRY };
        assert_eq!(row.stiffness.of(&wall).0, 1.5e6);
        let given = |normal: f64| FrictionalTable {
            young: None,
            stiffness_ratio: None,
            normal_stiffness: Some(quantity::Stiffness::new(normal)),
            shear_stiffness: Some(quantity::Stiffness::new(0.5 * normal)),
            ..soft.clone()
        };
        let row = Frictional::row(&given(1e6), &given(3e6)).unwrap();
        assert_eq!(row.stiffness, ContactStiffness::Given { normal: 2e6, shear: 1e6 });
        assert!(Frictional::row(&soft, &given(1e6)).is_err());
    }

    /// The Coulomb limit is that of the whole normal force, dashpot included: a contact that approaches holds a shear force that
    /// its spring alone would not let it hold, `k_t u_t + c_t u̇_t` with `c = 2ξ√(m k)`. Some roundings.
    #[test]
    fn dashpots_count_for_friction() {
        let (kn, kt, xi, mass) = (1e6, 5e5, 0.2, 2.0 / 3.0);
        let law = Frictional::new(ContactStiffness::Given { normal: kn, shear: kt }, 0.5, xi).unwrap();
        let (cn, ct) = (2.0 * xi * f64::sqrt(mass * kn), 2.0 * xi * f64::sqrt(mass * kt));
        let (dt, rate, shear, shear_rate) = (1e-6, -1.0, 1.2e-3, 0.1);
        let k = PointKinematics {
            geometry: GEOMETRY,
            length: 1.999,
            length_old: 1.999 - rate * dt,
            elongation: -1e-3,
            elongation_old: -1e-3 - rate * dt,
            gap: -1e-3,
            normal: Vec3::x(),
            shear_increment: Vec3::y() * (shear_rate * dt),
            arm_a: 0.8,
            arm_b: 1.199,
            bonded: false,
            transport: crate::kinematics::Transport::identity(Vec3::x()),
        };
        let before =
            FrictionalState { shear_displacement: Vec3::y() * (shear - shear_rate * dt), ..FrictionalState::default() };
        let answer = law.respond(&k, &before, dt);
        let (normal, tangential) = (-kn * 1e-3 + cn * rate, kt * shear + ct * shear_rate);
        assert!(0.5 * kn * 1e-3 < kt * shear && tangential < -0.5 * normal, "the case must tell");
        // The rate is a difference of lengths of 2 over 1e-6.
        assert!((answer.force - Vec3::new(normal, tangential, 0.0)).norm() < 1e-6, "{}", answer.force);
        assert_eq!(answer.energy.friction, 0.0);
        let viscous = Frictional::viscous_force(&k.normal, &answer.state);
        assert!((viscous - Vec3::new(cn * rate, ct * shear_rate, 0.0)).norm() < 1e-6, "{viscous}");
    }
}
