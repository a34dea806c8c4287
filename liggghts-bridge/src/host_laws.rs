//! LIGGGHTS' own granular contact laws, implemented with our [`ContactLaw`] trait: to compare engines, and to run faster.
//!
//! The formulas are those of LIGGGHTS-PUBLIC 3.8.0 (Kloss et al. 2012; Di Renzo & Di Maio 2004), with the overlap `δ`,
//! `1/E* = Σ(1−ν²)/E`, `1/G* = Σ 2(2−ν)(1+ν)/E`, `β = ln e/√(ln²e+π²)`, reduced mass `m`, effective radius `R*`:
//!
//! | model | `k_n`, `k_t` | dashpots |
//! |---|---|---|
//! | hertz | `(4/3)E*√(R*δ)`, `8G*√(R*δ)` | `−2√(5/6) β √(S m)`, `S_n = 2E*√(R*δ)`, `S_t = k_t` |
//! | hertz/stiffness | `k_n√(R*δ)`, `k_t√(R*δ)` | `m γ √(R*δ)` |
//! | hooke | `(16/15)√R* E* (15 m V²/(16 √R* E*))^{1/5}`, the same | `√(4 m k_n ln²e/(ln²e+π²))`, the same |
//! | hooke/stiffness | `k_n`, `k_t` | `m γ` |
//!
//! The normal force is `k_n δ − γ_n v_n`; it can be tensile. With history, the shear displacement is projected onto the current
//! tangential plane. If the elastic shear force exceeds `μ|f_n|`, the displacement is scaled back and the dashpot is off; otherwise
//! the dashpot force is added. Without history, the shear force is the dashpot force, limited to `μ|f_n|`.
//!
//! These laws keep LIGGGHTS' quirks: the shear spring creates energy when the overlap shrinks, and the dashpot can pull and can
//! exceed the friction limit. The energy ledger does not cover them. ConcorDEM's own laws are
//! [`HertzMindlin`] and [`Frictional`].

use concordem_contact::kinematics::{ContactInput, MotionMeasure, PointKinematics, Transport, WallInput};
use concordem_contact::law::{
    ContactGeometry, ContactLaw, EnergySplit, Frictional, HertzMindlin, Kinematics, Response, Status, Stiffness,
};
use concordem_contact::math::Vec3;

/// A point contact with instantaneous velocities. LIGGGHTS uses these; ConcorDEM uses mean rates over the step.
#[derive(Debug, Clone, Copy)]
pub struct InstantKinematics {
    /// Geometry.
    pub point: PointKinematics,
    /// Normal velocity of B relative to A, positive when separating, m/s.
    pub normal_velocity: f64,
    /// Tangential velocity of B relative to A at the contact, m/s.
    pub tangential_velocity: Vec3,
}

impl Kinematics for InstantKinematics {
    #[inline(always)]
    fn measure(_mode: MotionMeasure, input: &ContactInput<'_>) -> Self {
        let ContactInput { a, b, image, geometry, previous, bonded, dt } = *input;
        let l = input.branch();
        let length = l.norm();
        let normal = l * (1.0 / length);
        let gap = length - geometry.radius_a - geometry.radius_b;
        let (arm_a, arm_b) = (geometry.radius_a + 0.5 * gap, geometry.radius_b + 0.5 * gap);
        let velocity = b.velocity + image.velocity - a.velocity;
        let normal_velocity = velocity.dot(&normal);
        let spin = a.angular_velocity * arm_a + b.angular_velocity * arm_b;
        let tangential_velocity = velocity - normal * normal_velocity + normal.cross(&spin);
        Self {
            point: PointKinematics {
                geometry: *geometry,
                length,
                length_old: previous.length,
                elongation: length - geometry.reference_length,
                elongation_old: previous.length - geometry.reference_length,
                gap,
                normal,
                shear_increment: tangential_velocity * dt,
                arm_a,
                arm_b,
                bonded,
                transport: Transport::identity(normal),
            },
            normal_velocity,
            tangential_velocity,
        }
    }
    /// The contact point is in the middle of the overlap, as between spheres.
    fn measure_wall(_mode: MotionMeasure, input: &WallInput<'_>) -> Option<Self> {
        let WallInput { a, closest_point, wall_velocity, geometry, previous, dt, .. } = *input;
        let normal = closest_point.normal;
        let gap = closest_point.distance - geometry.radius_a;
        let arm_a = geometry.radius_a + 0.5 * gap;
        let velocity = wall_velocity - a.velocity;
        let normal_velocity = velocity.dot(&normal);
        let tangential_velocity = velocity - normal * normal_velocity + normal.cross(&(a.angular_velocity * arm_a));
        Some(Self {
            point: PointKinematics {
                geometry: *geometry,
                length: closest_point.distance,
                length_old: previous.length,
                elongation: closest_point.distance - geometry.reference_length,
                elongation_old: previous.length - geometry.reference_length,
                gap,
                normal,
                shear_increment: tangential_velocity * dt,
                arm_a,
                arm_b: 0.0,
                bonded: false,
                transport: Transport::identity(normal),
            },
            normal_velocity,
            tangential_velocity,
        })
    }
    #[inline(always)]
    fn point(&self) -> &PointKinematics {
        &self.point
    }
    fn with_surface_displacement(&self, now: f64, before: f64) -> Self {
        Self { point: self.point.with_surface_displacement(now, before), ..*self }
    }
}

/// A law of the models `concordem/...`, beside which LIGGGHTS' cohesion and rolling models act.
pub trait HostLaw: ContactLaw {
    /// Secant stiffnesses `k_n`, `k_t` (N/m) at the given overlap δ (m): the normal spring presses with `k_n δ`. LIGGGHTS' rolling
    /// models read them.
    fn stiffnesses(&self, geometry: &ContactGeometry, overlap: f64) -> [f64; 2];

    /// As [`ContactLaw::respond`]. A cohesion model adds the normal force `added` (N, compression positive) to the force that limits
    /// friction; it must be 0 for ConcorDEM laws.
    #[inline(always)]
    fn respond_beside(&self, k: &Self::Kinematics, old: &Self::State, dt: f64, added: f64) -> Response<Self::State> {
        debug_assert!(added == 0.0);
        self.respond(k, old, dt)
    }
}

/// Model of the stiffnesses and dashpots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HostModel {
    /// `hertz`
    Hertz {
        /// `E*`, Pa.
        young: f64,
        /// `G*`, Pa.
        shear: f64,
        /// `−2√(5/6) β`.
        damping: f64,
        /// `√(4G*/E*) = √(S_t/S_n)`.
        ratio: f64,
    },
    /// `hooke`
    Hooke {
        /// `E*`, Pa.
        young: f64,
        /// `ln e`.
        log_restitution: f64,
        /// Characteristic velocity `V`, m/s.
        velocity: f64,
    },
    /// `hertz/stiffness` and `hooke/stiffness`: `k_n`, `k_t` (N/m², or N/m), `γ_n`, `γ_t` (1/(m s), or 1/s).
    Stiffness {
        /// Whether all four are multiplied by `√(R*δ)`.
        hertz: bool,
        /// `k_n`.
        normal: f64,
        /// `k_t`.
        shear: f64,
        /// `γ_n`.
        normal_damping: f64,
        /// `γ_t`.
        shear_damping: f64,
    },
}

/// Tangential model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HostShear {
    /// No tangential force (`tangential off`).
    Off,
    /// Dashpot with friction limit (`no_history`).
    NoHistory,
    /// Spring with friction limit (`history`).
    History,
}

/// A LIGGGHTS contact law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HostContact {
    /// Stiffnesses and dashpots.
    pub model: HostModel,
    /// Tangential model.
    pub shear: HostShear,
    /// Coefficient of friction.
    pub friction: f64,
}

concordem_contact::law_state! {
    /// History of a [`HostContact`].
    pub struct HostContactState {
        /// Shear displacement of B relative to A.
        shear_displacement: Vec3, "m", Odd;
    }
}

impl HostModel {
    /// `hertz` with effective moduli `E*`, `G*` (Pa) and the coefficient of restitution `e`.
    pub fn hertz(young: f64, shear: f64, restitution: f64) -> Self {
        let log = restitution.ln();
        let pi = std::f64::consts::PI;
        let beta = log / (log * log + pi * pi).sqrt();
        Self::Hertz { young, shear, damping: -2.0 * (5.0_f64 / 6.0).sqrt() * beta, ratio: (4.0 * shear / young).sqrt() }
    }
}

impl HostContact {
    /// `k_n`, `k_t` (N/m), `γ_n`, `γ_t` (N·s/m) at the given overlap δ, m.
    #[inline(always)]
    fn springs_and_dashpots(&self, geometry: &ContactGeometry, overlap: f64) -> [f64; 4] {
        let mass = geometry.reduced_mass();
        match self.model {
            HostModel::Hertz { young, shear, damping, ratio } => {
                let root = (geometry.effective_radius() * overlap).sqrt();
                let gn = damping * (2.0 * young * root * mass).sqrt();
                [4.0 / 3.0 * young * root, 8.0 * shear * root, gn, gn * ratio]
            }
            HostModel::Hooke { young, log_restitution, velocity } => {
                let root = geometry.effective_radius().sqrt();
                let kn =
                    16.0 / 15.0 * root * young * (15.0 * mass * velocity * velocity / (16.0 * root * young)).powf(0.2);
                let squared = log_restitution * log_restitution;
                let pi = std::f64::consts::PI;
                let damping = (4.0 * mass * kn * squared / (squared + pi * pi)).sqrt();
                [kn, kn, damping, damping]
            }
            HostModel::Stiffness { hertz, normal, shear, normal_damping, shear_damping } => {
                let root = if hertz { (geometry.effective_radius() * overlap).sqrt() } else { 1.0 };
                [normal * root, shear * root, mass * normal_damping * root, mass * shear_damping * root]
            }
        }
    }
}

impl HostLaw for HostContact {
    #[inline(always)]
    fn stiffnesses(&self, geometry: &ContactGeometry, overlap: f64) -> [f64; 2] {
        let [normal, shear, ..] = self.springs_and_dashpots(geometry, overlap);
        [normal, shear]
    }

    #[inline(always)]
    fn respond_beside(
        &self,
        k: &InstantKinematics,
        old: &HostContactState,
        _dt: f64,
        added: f64,
    ) -> Response<HostContactState> {
        let geometry = &k.point.geometry;
        let overlap = -k.point.gap;
        let respond = |force, shear_displacement, status| Response {
            force,
            moment: Vec3::zeros(),
            state: HostContactState { shear_displacement },
            status,
            energy: EnergySplit::default(),
        };
        if overlap <= 0.0 {
            return respond(Vec3::zeros(), Vec3::zeros(), Status::Opened);
        }
        let [kn, kt, gn, gt] = self.springs_and_dashpots(geometry, overlap);
        let push = kn * overlap - gn * k.normal_velocity;
        let limiting = push + added;
        let pressing = k.point.normal * -push;
        match self.shear {
            HostShear::Off => respond(pressing, Vec3::zeros(), Status::Lives),
            HostShear::NoHistory => {
                let speed = k.tangential_velocity.norm();
                let coefficient = if speed > 0.0 { (self.friction * limiting.abs() / speed).min(gt) } else { 0.0 };
                respond(pressing + k.tangential_velocity * coefficient, Vec3::zeros(), Status::Lives)
            }
            HostShear::History => {
                let moved = old.shear_displacement + k.point.shear_increment;
                let displacement = moved - k.point.normal * moved.dot(&k.point.normal);
                let size = displacement.norm();
                let (elastic, limit) = (kt * size, self.friction * limiting.abs());
                if elastic > limit {
                    let cut = displacement * (limit / elastic);
                    respond(pressing + cut * kt, cut, Status::Lives)
                } else {
                    let force = displacement * kt + k.tangential_velocity * gt;
                    respond(pressing + force, displacement, Status::Lives)
                }
            }
        }
    }
}

impl HostLaw for HertzMindlin {
    #[inline(always)]
    fn stiffnesses(&self, geometry: &ContactGeometry, overlap: f64) -> [f64; 2] {
        let Stiffness { normal, shear, .. } = self.stiffness_at(geometry, overlap);
        // The force is proportional to δ^{3/2}.
        [normal * (2.0 / 3.0), shear]
    }
}

impl HostLaw for Frictional {
    #[inline(always)]
    fn stiffnesses(&self, geometry: &ContactGeometry, overlap: f64) -> [f64; 2] {
        let Stiffness { normal, shear, .. } = self.stiffness_at(geometry, overlap);
        [normal, shear]
    }
}

impl ContactLaw for HostContact {
    type State = HostContactState;
    type Kinematics = InstantKinematics;
    const NAME: &'static str = "liggghts";

    #[inline(always)]
    fn respond(&self, k: &InstantKinematics, old: &HostContactState, dt: f64) -> Response<HostContactState> {
        self.respond_beside(k, old, dt, 0.0)
    }

    /// Stiffnesses that depend on the overlap are taken at an overlap of `R*/20`.
    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        let root = geometry.effective_radius() * 0.05_f64.sqrt();
        let (normal, shear) = match self.model {
            HostModel::Hertz { young, shear, .. } => (2.0 * young * root, 8.0 * shear * root),
            HostModel::Hooke { young, velocity, .. } => {
                let scale = geometry.effective_radius().sqrt() * young;
                let mass = geometry.reduced_mass();
                let k = 16.0 / 15.0 * scale * (15.0 * mass * velocity * velocity / (16.0 * scale)).powf(0.2);
                (k, k)
            }
            HostModel::Stiffness { hertz, normal, shear, .. } => {
                let factor = if hertz { 1.5 * root } else { 1.0 };
                (normal * factor, shear * factor)
            }
        };
        Stiffness { normal, shear, ..Stiffness::default() }
    }
}
