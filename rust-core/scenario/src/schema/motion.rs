//! Time integration, loading, and the end of a run.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::packing::Axis;
use super::quantity::{
    Acceleration, AngularVelocity, Area, Length, Number, StrainRate, Stress, Time, TimeStep, Velocity,
};

/// Time integration.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Integration {
    /// Scheme.
    pub scheme: Scheme,
    /// Time step, s, or "auto": the sharpest stability bound times `safety`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub time_step: TimeStep,
    /// Factor on the stability bound when the time step is "auto".
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub safety: Safety,
    /// Accept a time step above the stability bound.
    pub allow_unstable: bool,
    /// Numerical damping.
    pub damping: Damping,
    /// Gravity, m/s².
    pub gravity: [Acceleration; 3],
}

/// Factor on the stability bound; 0.8 unless given.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline)]
pub struct Safety(pub Number);

impl Default for Safety {
    fn default() -> Self {
        Self(Number::new(0.8))
    }
}

impl Safety {
    /// The factor.
    pub fn si(self) -> f64 {
        self.0.si()
    }
}

/// Integration scheme.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Velocities at half steps, positions at full steps.
    #[default]
    Leapfrog,
    /// Velocities and positions at full steps.
    VelocityVerlet,
}

/// Numerical damping.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Damping {
    /// None.
    #[default]
    None,
    /// Local damping by component: a component of force is reduced where it works with the motion, increased where
    /// against (Cundall 1987, as in YADE).
    Local {
        /// Share of the force; 0.1 to 0.3 are usual.
        #[schemars(extend("minimum" = 0, "maximum" = 1))]
        coefficient: Number,
        /// The same for moments; that of forces when left out.
        #[schemars(extend("minimum" = 0, "maximum" = 1))]
        rotation: Option<Number>,
    },
    /// A force against the velocity, of a size in proportion to that of the acting force.
    Nonviscous {
        /// Share of the force; 0.1 to 0.3 are usual.
        #[schemars(extend("minimum" = 0, "maximum" = 1))]
        coefficient: Number,
        /// The same for moments; that of forces when left out.
        #[schemars(extend("minimum" = 0, "maximum" = 1))]
        rotation: Option<Number>,
    },
    /// Dissipation of the fastest vibrations by the integrator, with the acceleration weighted in the new position
    /// (Tchamwa and Wielgosz 1999).
    TchamwaWielgosz {
        /// Weight; 1 dissipates nothing, 1.3 is used by Jebahi et al. 2015.
        #[serde(default = "phi")]
        #[schemars(extend("minimum" = 1, "maximum" = 2))]
        phi: Number,
        /// Where the weight stands.
        #[serde(default)]
        form: DampingForm,
    },
}

/// Where the weight of the acceleration stands in damping by the integrator.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DampingForm {
    /// x' = x + v dt + phi a dt^2, v' = v + a dt.
    #[default]
    TchamwaWielgosz,
    /// x' = x + v dt + phi a dt^2/2, v' = v + (a + a') dt/2: half as strong.
    PositionTerm,
}

impl Damping {
    /// Coefficients of translation and rotation.
    pub fn coefficients(&self) -> (f64, f64) {
        match self {
            Self::None | Self::TchamwaWielgosz { .. } => (0.0, 0.0),
            Self::Local { coefficient, rotation } | Self::Nonviscous { coefficient, rotation } => {
                (coefficient.si(), rotation.unwrap_or(*coefficient).si())
            }
        }
    }
}

/// How the specimen is loaded.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Loading {
    /// Only what gravity, walls, forces, and prescribed motions do.
    #[default]
    None,
    /// Two end layers are moved apart or together at constant velocity; the stress is their mean force over the area.
    Uniaxial {
        /// Direction.
        #[serde(default)]
        axis: Axis,
        /// Rate of the engineering strain between the ends, 1/s; positive pulls.
        strain_rate: StrainRate,
        /// Thickness of each end layer, m; by default the reach of a bond from the outermost centres,
        /// (1 + 2 interaction ratio) times the largest radius, so that no cross-section is weaker than those inside.
        #[schemars(extend("exclusiveMinimum" = 0))]
        layer_thickness: Option<Length>,
        /// What the end layers do across the axis.
        #[serde(default)]
        lateral: Lateral,
        /// Whether the specimen starts with velocities that grow linearly between the ends, which spares it a shock.
        #[serde(default = "yes")]
        initial_velocity_field: bool,
        /// Cross-section for the stress, m²; by default that of the packing's shape, or of the bounding box.
        #[schemars(extend("exclusiveMinimum" = 0))]
        area: Option<Area>,
    },
    /// Two end layers turn rigidly against each other about an axis across the specimen, free along it; the stress is that of the outer
    /// fibre of an elastic beam under the mean of both end moments.
    Bending {
        /// Direction of the specimen.
        #[serde(default)]
        axis: Axis,
        /// Axis about which the ends turn, each by half of the angle.
        about: Axis,
        /// Rate of the angle between the ends, rad/s.
        rate: AngularVelocity,
        /// Thickness of each end layer, m; default as for "uniaxial".
        #[schemars(extend("exclusiveMinimum" = 0))]
        layer_thickness: Option<Length>,
        /// Whether the specimen starts with the velocities of even curvature, which spares it a shock.
        #[serde(default = "yes")]
        initial_velocity_field: bool,
    },
    /// Two end layers turn rigidly against each other about the axis of a cylinder, free along it; the stress is the shear stress at the
    /// surface of an elastic cylinder under the mean of both end moments.
    Torsion {
        /// Direction of the specimen.
        #[serde(default)]
        axis: Axis,
        /// Rate of the angle between the ends, rad/s.
        rate: AngularVelocity,
        /// Thickness of each end layer, m; default as for "uniaxial".
        #[schemars(extend("exclusiveMinimum" = 0))]
        layer_thickness: Option<Length>,
        /// Whether the specimen starts with the velocities of even twist, which spares it a shock.
        #[serde(default = "yes")]
        initial_velocity_field: bool,
    },
    /// The periodic cell follows a velocity gradient; particles start with its affine velocity and go with its changes, but for
    /// prescribed components.
    CellStrain {
        /// Velocity gradient: rows are the components of the velocity, columns the directions; 1/s.
        velocity_gradient: [[StrainRate; 3]; 3],
    },
    /// The periodic cell is driven until its mean stress is the given one; particles go with it, but for prescribed components.
    CellStress {
        /// Wanted stress, symmetric, tension positive, Pa.
        stress: [[Stress; 3]; 3],
        /// Largest strain rate the servo may use, 1/s.
        #[schemars(extend("exclusiveMinimum" = 0))]
        maximum_strain_rate: StrainRate,
        /// Relative error of the stress that counts as reached.
        #[serde(default = "servo_tolerance")]
        #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
        tolerance: Number,
    },
    /// Two rigid plates press on the ends of the specimen.
    Platens {
        /// Direction.
        #[serde(default)]
        axis: Axis,
        /// Velocity at which the plates approach each other, m/s.
        #[schemars(extend("exclusiveMinimum" = 0))]
        closing_velocity: Velocity,
        /// Material of the plates.
        material: String,
        /// Cross-section for the stress, m²; by default that of the packing's shape, or of the bounding box.
        #[schemars(extend("exclusiveMinimum" = 0))]
        area: Option<Area>,
    },
}

impl Loading {
    /// Its name in the scenario.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Uniaxial { .. } => "uniaxial",
            Self::Bending { .. } => "bending",
            Self::Torsion { .. } => "torsion",
            Self::CellStrain { .. } => "cell-strain",
            Self::CellStress { .. } => "cell-stress",
            Self::Platens { .. } => "platens",
        }
    }

    /// Whether it drives the periodic cell.
    pub fn drives_cell(&self) -> bool {
        matches!(self, Self::CellStrain { .. } | Self::CellStress { .. })
    }
}

/// What end layers do across the axis of loading.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Lateral {
    /// They move and rotate freely.
    #[default]
    Free,
    /// They neither move across the axis nor rotate.
    Fixed,
}

/// When a run ends: at the first of these that comes true.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Stop {
    /// Stress has fallen to this fraction of its peak.
    #[schemars(extend("minimum" = 0, "exclusiveMaximum" = 1))]
    pub drop_to: Option<Number>,
    /// Size of the strain along the axis of loading (of the largest strain component, for a periodic cell).
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub strain: Option<Number>,
    /// Time since the start of the run, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub time: Option<Time>,
    /// Number of steps.
    #[schemars(range(min = 1))]
    pub steps: Option<u64>,
    /// Equilibrium: mean resultant force on a body (particle or clump) divided by the mean contact force is below this.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub unbalanced: Option<Number>,
}

/// What is written, and how often.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Result file, relative to the scenario; by default the scenario's name with `.h5`.
    pub file: Option<String>,
    /// Steps between two rows of stress, strain, and energies.
    #[schemars(range(min = 1))]
    pub sample_interval: u64,
    /// Steps between two pictures of all particles and contacts; only the first and the last when left out.
    #[schemars(range(min = 1))]
    pub snapshot_interval: Option<u64>,
    /// Steps between two checkpoints; there is one about every minute in any case.
    #[schemars(range(min = 1))]
    pub checkpoint_interval: Option<u64>,
    /// A bond enters the event log when its damage passes this.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub events_damage: Number,
    /// Write the samples as a CSV file too.
    pub csv: bool,
}

impl Default for Output {
    fn default() -> Self {
        Self {
            file: None,
            sample_interval: 10,
            snapshot_interval: None,
            checkpoint_interval: None,
            events_damage: Number::new(0.9),
            csv: false,
        }
    }
}

fn yes() -> bool {
    true
}

fn phi() -> Number {
    Number::new(1.3)
}

fn servo_tolerance() -> Number {
    Number::new(0.005)
}
