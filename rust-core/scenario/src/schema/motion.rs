//! Time integration, loading, end of the run, and output.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::opening::OpeningControl;
use super::packing::Axis;
use super::quantity::{
    Acceleration, AngularVelocity, Component, CrossSection, Length, Number, StrainRate, Stress, Time, TimeStep,
    Velocity,
};

/// Time integration.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Integration {
    /// Integration scheme; default: "leapfrog".
    pub scheme: Scheme,
    /// Time step, s; default: "auto", the tightest stability bound times `safety`. Example: `time_step = "0.2 us"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub time_step: TimeStep,
    /// Fraction of the stability bound that the time step "auto" uses; default: 0.8.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub safety: Safety,
    /// Largest fraction of the stability bound of a single contact that the time step "auto" uses, for every pair of
    /// materials that can touch and every wall. Default: 0.1 without bonds, which keeps the energy of an elastic impact
    /// within 1 %; 0.5 with bonds, where most contacts form only after failure.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub contact_safety: Option<Number>,
    /// Continue even if integration errors have changed the energy by more than 5 %, or the motion is unstable;
    /// default: false, which ends the run with an error. `allow_unstable` implies it.
    pub allow_energy_error: bool,
    /// Run even if the time step exceeds the stability bound, at the start or later, or the strains of deformable
    /// particles do not converge; default: false.
    pub allow_unstable: bool,
    /// Numerical damping; default: none. Example: `damping = { kind = "local", coefficient = 0.3 }`.
    pub damping: Damping,
    /// Gravitational acceleration, m/s²; default: zero. Example: `gravity = [0, 0, -9.81]`.
    pub gravity: [Acceleration; 3],
}

/// Fraction of the stability bound; default: 0.8.
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
    /// The fraction.
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
    /// No damping.
    #[default]
    None,
    /// Local damping of each component: reduces a force that acts along the motion and increases one that acts against it
    /// (Cundall 1987, as in YADE).
    Local {
        /// Fraction of the force; 0.1 to 0.3 is usual. Required. Example: `coefficient = 0.3`.
        #[schemars(extend("minimum" = 0, "maximum" = 1))]
        coefficient: Number,
        /// Fraction of the moment; default: the same as `coefficient`.
        #[schemars(extend("minimum" = 0, "maximum" = 1))]
        rotation: Option<Number>,
    },
    /// A force against the velocity, proportional to the magnitude of the acting force.
    Nonviscous {
        /// Fraction of the force; 0.1 to 0.3 is usual. Required. Example: `coefficient = 0.3`.
        #[schemars(extend("minimum" = 0, "maximum" = 1))]
        coefficient: Number,
        /// Fraction of the moment; default: the same as `coefficient`.
        #[schemars(extend("minimum" = 0, "maximum" = 1))]
        rotation: Option<Number>,
    },
    /// Numerical dissipation of the highest frequencies by the integrator, which overweights the acceleration in the
    /// new position (Tchamwa and Wielgosz 1999).
    TchamwaWielgosz {
        /// Weight of the acceleration; default: 1.3, as in Jebahi et al. 2015. A weight of 1 dissipates nothing.
        #[serde(default = "phi")]
        #[schemars(extend("minimum" = 1, "maximum" = 2))]
        phi: Number,
        /// Term that the weight multiplies; default: "tchamwa-wielgosz".
        #[serde(default)]
        form: DampingForm,
    },
}

/// Term that the weight of the acceleration multiplies in damping by the integrator.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DampingForm {
    /// x' = x + v dt + phi a dt^2, v' = v + a dt.
    #[default]
    TchamwaWielgosz,
    /// x' = x + v dt + phi a dt^2/2, v' = v + (a + a') dt/2: dissipates half as much.
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

/// Loading of the specimen.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Loading {
    /// No loading beyond gravity, walls, forces, and prescribed motions.
    #[default]
    None,
    /// Two end layers move apart or together at constant velocity; the stress is their mean force divided by the area.
    Uniaxial {
        /// Direction of loading; default: "z".
        #[serde(default)]
        axis: Axis,
        /// Rate of the engineering strain between the ends, 1/s; positive in tension. Required.
        /// Example: `strain_rate = "0.4 1/s"`.
        strain_rate: StrainRate,
        /// Thickness of each end layer, m; default: (1 + 2 interaction ratio) times the largest radius. With that thickness
        /// every cross-section outside the layers is crossed by as many bonds as one deep inside.
        #[schemars(extend("exclusiveMinimum" = 0))]
        layer_thickness: Option<Length>,
        /// Motion of the end layers across the axis; default: "free".
        #[serde(default)]
        lateral: Lateral,
        /// Whether the initial velocity varies linearly between the ends, which avoids a shock wave; default: true.
        #[serde(default = "yes")]
        initial_velocity_field: bool,
        /// Cross-section that the stress refers to, m²; default: that of the packing's shape, else of the bounding box.
        /// "hull": the smallest of eight sections; the area of a section is that of the convex hull of the spheres that
        /// its plane cuts. Example: `area = "25 cm^2"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        area: Option<CrossSection>,
        /// Length that strain and strain rate refer to, m; default: the initial distance of the mean positions of the
        /// layers. To compare with a published test, give the distance over which it measured. Example: `gauge_length =
        /// "47.3 mm"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        gauge_length: Option<Length>,
        /// Control by the opening of a crack, up to `strain_rate`; default: none, a constant velocity. Example:
        /// `opening = { gauge = "crack mouth", rate = "1 mm/s", response_time = "50 us" }`.
        opening: Option<OpeningControl>,
    },
    /// Two end layers rotate rigidly in opposite directions about an axis across the specimen, and move freely along
    /// its axis. The stress is that in the outer fiber of an elastic beam under the mean of both end moments.
    Bending {
        /// Axis of the specimen; default: "z".
        #[serde(default)]
        axis: Axis,
        /// Axis about which the ends rotate, each by half of the angle. Required. Example: `about = "y"`.
        about: Axis,
        /// Rate of change of the angle between the ends, rad/s. Required. Example: `rate = "8 rad/s"`.
        rate: AngularVelocity,
        /// Thickness of each end layer, m; default: as for "uniaxial".
        #[schemars(extend("exclusiveMinimum" = 0))]
        layer_thickness: Option<Length>,
        /// Whether the initial velocity is that of uniform curvature, which avoids a shock wave; default: true.
        #[serde(default = "yes")]
        initial_velocity_field: bool,
    },
    /// Two end layers rotate rigidly in opposite directions about the axis of a cylinder, and move freely along it. The
    /// stress is the shear stress at the surface of an elastic cylinder under the mean of both end moments.
    Torsion {
        /// Axis of the specimen; default: "z".
        #[serde(default)]
        axis: Axis,
        /// Rate of change of the angle between the ends, rad/s. Required. Example: `rate = "8 rad/s"`.
        rate: AngularVelocity,
        /// Thickness of each end layer, m; default: as for "uniaxial".
        #[schemars(extend("exclusiveMinimum" = 0))]
        layer_thickness: Option<Length>,
        /// Whether the initial velocity is that of uniform twist, which avoids a shock wave; default: true.
        #[serde(default = "yes")]
        initial_velocity_field: bool,
    },
    /// The periodic cell follows a velocity gradient. Particles start with its affine velocity and follow its changes,
    /// except in prescribed components.
    CellStrain {
        /// Velocity gradient, 1/s: row i, column j is the derivative of velocity component i along axis j. Required.
        /// Example: `velocity_gradient = [[0, 0, 0], [0, 0, 0], [0, 0, 0.4]]`.
        velocity_gradient: [[StrainRate; 3]; 3],
    },
    /// A servo deforms the periodic cell until its mean stress reaches a target. Particles follow the cell, except in
    /// prescribed components.
    CellStress {
        /// Target stress, symmetric, tension positive, Pa. Required.
        /// Example: `stress = [["-1 MPa", 0, 0], [0, "-1 MPa", 0], [0, 0, "-1 MPa"]]`.
        stress: [[Stress; 3]; 3],
        /// Strain rates of axes that do not follow their stress, 1/s; "free" axes and shear follow it. Default: all free. The
        /// stress of such an axis is the target of stages with `control = "stress"`; without such a stage it must be 0.
        /// Example of a triaxial test: `strain_rate = ["free", "free", "-0.1 1/s"]`.
        #[serde(default)]
        strain_rate: [Component<super::quantity::dimension::OfStrainRate>; 3],
        /// Largest strain rate that the servo may use, 1/s. Required. Choose it well above the strain rates of the specimen.
        /// Example: `maximum_strain_rate = "1 1/s"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        maximum_strain_rate: StrainRate,
        /// Relative error at which the target stress counts as reached; default: 0.005.
        #[serde(default = "servo_tolerance")]
        #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
        tolerance: Number,
    },
    /// Two rigid plates press on the ends of the specimen, or strips of particles on a cylinder that splits.
    Platens {
        /// Direction of loading; default: "z".
        #[serde(default)]
        axis: Axis,
        /// Velocity at which the plates approach each other, m/s. Required. Example: `closing_velocity = "10 mm/s"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        closing_velocity: Velocity,
        /// Name of the material of the plates. Required unless `strip_width` is given.
        material: Option<String>,
        /// Width of the two strips of particles, one radius of the largest particle deep, that move along `axis` in place of plates, and freely
        /// across it, m; for `area = "splitting"`. Plates touch single particles of a rough surface, and crush them. Take a tenth of the
        /// diameter, and at least five radii. Default: none, plates. Example: `strip_width = "5 mm"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        strip_width: Option<Length>,
        /// Cross-section that the stress refers to, m²; default: that of the packing's shape, else of the bounding box.
        /// "hull": the smallest of eight sections; the area of a section is that of the convex hull of the spheres that
        /// its plane cuts. "splitting": the plates split a cylinder that lies between them; the stress is the tension
        /// `2P/(pi D L)` in its middle, positive. Example: `area = "25 cm^2"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        area: Option<CrossSection>,
        /// Control by the opening of a crack, up to `closing_velocity`; default: none, a constant velocity. Example:
        /// `opening = { gauge = "crack mouth", rate = "1 mm/s", response_time = "50 us" }`.
        opening: Option<OpeningControl>,
    },
    /// A beam on two supports is bent in three or four points: one or two rollers press on its other side. The stress is that in
    /// the outer fiber of an elastic beam, `6M/(b h^2)`; the strain that of such a beam with the deflection w under the rollers,
    /// `3h w/(a (3l - 4a))` with the distance a between support and roller.
    Flexure {
        /// Axis of the beam; default: "x". The packing must be a box.
        #[serde(default = "along_x")]
        axis: Axis,
        /// Direction in which the supports push; the rollers push against it. Default: "z", in two dimensions "y"; "x" for a beam
        /// along that axis.
        across: Option<Axis>,
        /// Distance between the supports, m. Required. Example: `span = "100 mm"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        span: Length,
        /// Distance between two rollers, m; default: 0, one roller (three-point bending).
        #[serde(default = "no_length")]
        #[schemars(extend("minimum" = 0))]
        inner_span: Length,
        /// Width of the strips of particles on the surface of the beam that supports and rollers hold and move along `across`; they
        /// move freely along the other axes, and rotate. m. Required unless `roller_radius` is given. Take two to three radii of
        /// the particles: wider strips clamp the beam.
        #[schemars(extend("exclusiveMinimum" = 0))]
        strip_width: Option<Length>,
        /// Radius of supports and rollers as cylindrical walls that touch the nearest particle, m. Required unless `strip_width` is
        /// given. On a rough surface they touch single particles, on which a beam in three dimensions can roll.
        #[schemars(extend("exclusiveMinimum" = 0))]
        roller_radius: Option<Length>,
        /// Velocity at which the rollers approach the supports, m/s. Required. Example: `closing_velocity = "10 mm/s"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        closing_velocity: Velocity,
        /// Name of the material of supports and rollers. Required with `roller_radius`.
        material: Option<String>,
        /// Control by the opening of a crack, up to `closing_velocity`; default: none, a constant velocity. Example:
        /// `opening = { gauge = "crack mouth", rate = "1 mm/s", response_time = "50 us" }`.
        opening: Option<OpeningControl>,
    },
}

fn along_x() -> Axis {
    Axis::X
}

fn no_length() -> Length {
    Length::new(0.0)
}

impl Loading {
    /// Value of `kind` in the scenario.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Uniaxial { .. } => "uniaxial",
            Self::Bending { .. } => "bending",
            Self::Torsion { .. } => "torsion",
            Self::CellStrain { .. } => "cell-strain",
            Self::CellStress { .. } => "cell-stress",
            Self::Platens { .. } => "platens",
            Self::Flexure { .. } => "flexure",
        }
    }

    /// Index of the direction in which a beam along `axis` is bent.
    pub fn direction_across(axis: Axis, across: Option<Axis>, dimension: u8) -> usize {
        let default = if dimension == 2 {
            usize::from(axis != Axis::Y)
        } else if axis == Axis::Z {
            0
        } else {
            2
        };
        across.map_or(default, Axis::index)
    }

    /// Whether the loading measures a stress that can drop from a peak.
    pub fn has_peak(&self) -> bool {
        match self {
            Self::None => false,
            Self::CellStress { strain_rate, .. } => strain_rate.iter().any(|rate| *rate != Component::Free),
            _ => true,
        }
    }

    /// Control by the opening of a crack.
    pub fn opening(&self) -> Option<&OpeningControl> {
        match self {
            Self::Uniaxial { opening, .. } | Self::Platens { opening, .. } | Self::Flexure { opening, .. } => {
                opening.as_ref()
            }
            _ => None,
        }
    }

    /// Whether the loading drives the periodic cell.
    pub fn drives_cell(&self) -> bool {
        matches!(self, Self::CellStrain { .. } | Self::CellStress { .. })
    }
}

/// Motion of end layers across the axis of loading.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Lateral {
    /// The particles move across the axis and rotate freely.
    #[default]
    Free,
    /// The particles neither move across the axis nor rotate.
    Fixed,
}

/// Conditions that end the run; the first one that holds ends it. At least one is required.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Stop {
    /// Stress drops to this fraction of its peak. While a stage unloads, or loads again up to where the run had come, it does not count.
    /// Example: `drop_to = 0.2`.
    #[schemars(extend("minimum" = 0, "exclusiveMaximum" = 1))]
    pub drop_to: Option<Number>,
    /// Magnitude of the strain along the loading axis (periodic cell: of the largest strain component). Example:
    /// `strain = 5e-3`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub strain: Option<Number>,
    /// Time since the start of the run, s. Example: `time = "0.6 ms"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub time: Option<Time>,
    /// Number of steps. Example: `steps = 20_000`.
    #[schemars(range(min = 1))]
    pub steps: Option<u64>,
    /// Equilibrium: the root mean square of the net forces on particles and clumps, divided by that of the contact forces,
    /// falls below this value, and so does the same ratio of moments. Example:
    /// `unbalanced = 1e-3`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub unbalanced: Option<Number>,
}

/// Contents and intervals of the output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Path of the result file, relative to the scenario; default: the name of the scenario with `.h5`.
    pub file: Option<String>,
    /// Steps between two records of stress, strain, and energies; default: 10.
    #[schemars(range(min = 1))]
    pub sample_interval: u64,
    /// Steps between two snapshots of all particles and contacts; default: only the first and the last state.
    #[schemars(range(min = 1))]
    pub snapshot_interval: Option<u64>,
    /// Whether snapshots contain the bonds, too: damage, force, and opening of each, which `concordem export` writes as lines for
    /// ParaView; default: false, because bonds need more space than particles.
    pub bond_snapshots: bool,
    /// Steps between two checkpoints, in addition to those written about every minute; default: none.
    #[schemars(range(min = 1))]
    pub checkpoint_interval: Option<u64>,
    /// Damage above which a bond enters the event log; default: 0.9.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub events_damage: Number,
    /// Whether to write the time series as a CSV file, too; default: false.
    pub csv: bool,
}

impl Default for Output {
    fn default() -> Self {
        Self {
            file: None,
            sample_interval: 10,
            snapshot_interval: None,
            bond_snapshots: false,
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
