//! The table `[heat]` of a scenario, and of a host's `heat FILE`: the network, initial temperatures, sources, and the surface.

mod rules;

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::quantity::{
    HeatFlux, HeatTransfer, Length, Number, Power, PowerDensity, Temperature, ThermalResistance, Velocity,
};

/// Heat conduction, and thermal expansion of bonds. Every material needs a table `thermal`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Heat {
    /// How heat flows between particles; default: "power".
    #[serde(default)]
    pub model: HeatNetwork,
    /// Pairs that exchange heat, with the models "ordered" and "disordered"; default: "contacts".
    pub pairs: Option<HeatPairs>,
    /// Two particles are in contact if their center distance is at most this ratio times the sum of their radii, with pairs
    /// "contacts"; default: 1. Example: `contact_ratio = 1.01`.
    #[schemars(extend("minimum" = 1, "maximum" = 2))]
    pub contact_ratio: Option<Number>,
    /// Initial temperature, K. Required. Example: `temperature = "293 K"`.
    #[schemars(extend("minimum" = 0))]
    pub temperature: Temperature,
    /// Temperature at which bonds have their length at bonding, K; default: the initial temperature.
    #[schemars(extend("minimum" = 0))]
    pub reference_temperature: Option<Temperature>,
    /// Whether the run starts from the steady state under the sources and boundaries at time zero; default: false. The initial
    /// temperatures then matter only as the reference temperature.
    #[serde(default)]
    pub steady: bool,
    /// Time integration; default: "explicit".
    #[serde(default)]
    pub scheme: HeatScheme,
    /// Thermal time that passes in one second of the time of the run; default: 1. Times and velocities in the tables
    /// `[[heat.source]]` and `[[heat.boundary]]`, and the histories that they name, are in thermal time. Example: `time_factor = 1e4`.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub time_factor: Number,
    /// Whether particles move; default: true. With false, the run only conducts heat.
    #[serde(default = "yes")]
    pub motion: bool,
    /// Whether the energy that contacts dissipate by damage, friction, and dashpots heats their two particles, half each (at a wall: its
    /// particle); default: false.
    #[serde(default)]
    pub dissipation: bool,
    /// Thermal resistance of the crack where a bond broke, m²·K/W; default: cracks insulate. Example: `crack_resistance = 1e-4`.
    #[schemars(extend("minimum" = 0))]
    pub crack_resistance: Option<ThermalResistance>,
    /// Heat between particles that touch at the time: those that come together later, and those at a crack that closes; default: none,
    /// heat flows only between neighbors at the start. Required with the model "contacts". It needs a law in `[contacts]`, and exactly one
    /// of `resistance` and `constriction`. Example: `contact = { resistance = "1e-5 m^2*K/W" }`.
    pub contact: Option<HeatContact>,
    /// Initial temperatures of sets; default: none. A later one overrides an earlier one.
    #[serde(default, rename = "initial")]
    pub initials: Vec<HeatInitial>,
    /// Sources of heat; default: none.
    #[serde(default, rename = "source")]
    pub sources: Vec<HeatSource>,
    /// Prescribed temperatures and exchange with the surroundings; default: none, the body is insulated.
    #[serde(default, rename = "boundary")]
    pub boundaries: Vec<HeatBoundary>,
}

fn one() -> Number {
    Number::new(1.0)
}

fn yes() -> bool {
    true
}

/// How heat flows between particles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HeatNetwork {
    /// Through the faces of the power diagram: exact for linear fields.
    #[default]
    Power,
    /// By the number of neighbors, as in Jebahi et al. 2015, table 3.1; three dimensions.
    Disordered,
    /// As in a simple cubic (in two dimensions: square) lattice, the 7-point stencil; Jebahi et al. 2015, (3.7) to (3.10).
    Ordered,
    /// Through the contacts of the moment, and through bonds, between particles of their own volume: for grains that flow.
    Contacts,
}

/// The name in a scenario.
impl fmt::Display for HeatNetwork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// Heat between particles that touch at the time, with exactly one of `resistance` and `constriction`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeatContact {
    /// Thermal resistance of a contact, m²·K/W; 0 for none. Its area is 4 R_A R_B (in two dimensions 2 √(R_A R_B)); at a crack it is that of
    /// the link. Example: `resistance = "1e-5 m^2*K/W"`.
    #[schemars(extend("minimum" = 0))]
    pub resistance: Option<ThermalResistance>,
    /// Whether heat flows through the circle of a Hertzian contact, which grows with the overlap, 2 λ a; default: false.
    #[serde(default)]
    pub constriction: bool,
}

/// Pairs that exchange heat.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HeatPairs {
    /// Particles that touch at the start.
    Contacts,
    /// Bonded particles.
    Bonds,
}

/// Time integration of heat conduction.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HeatScheme {
    /// Forward Euler; stable below a bound that `concordem check` prints.
    #[default]
    Explicit,
    /// Backward Euler; stable with any step.
    Implicit,
}

/// Initial temperature of the particles of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeatInitial {
    /// Name of the set. Required.
    pub set: String,
    /// Initial temperature, K. Required.
    #[schemars(extend("minimum" = 0))]
    pub temperature: Temperature,
}

/// A source of heat: of a set, or a spot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeatSource {
    /// Name of the set that is heated uniformly. Required unless `spot` is given.
    pub set: Option<String>,
    /// A spot that may move. Required unless `set` is given.
    /// Example: `spot = { center = [0, 0, "5 mm"], radius = "1 mm", velocity = ["3 mm/s", 0, 0] }`.
    pub spot: Option<HeatSpot>,
    /// Power that the body takes up, W. Required unless `density` is given. Example: `power = "20 W"`.
    pub power: Option<Power>,
    /// Power per volume of a set, W/m³. Required unless `power` is given. Example: `density = "1 W/mm^3"`.
    pub density: Option<PowerDensity>,
    /// Name of a history that multiplies the power; default: constant.
    pub history: Option<String>,
}

/// A spot that heats the particles in proportion to `V exp(-|x - x_s|²/(2 r²))`, with `x_s = center + velocity t`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeatSpot {
    /// Center at the start, m. Required.
    pub center: [Length; 3],
    /// Velocity in thermal time, m/s; default: zero.
    #[serde(default)]
    pub velocity: [Velocity; 3],
    /// Standard deviation r, m. Required.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: Length,
}

/// A prescribed temperature, or exchange with the surroundings. It needs exactly one of `temperature`, `flux`, `convection`, and
/// `radiation`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeatBoundary {
    /// Face of the body: "x minimum", "x maximum", "y minimum", ..., "side" of a cylinder, or "all"; default: "all", or with
    /// `set` and `temperature`: none.
    pub face: Option<String>,
    /// Name of a set: only its particles. With `temperature` and without `face`, the particles themselves have this temperature.
    pub set: Option<String>,
    /// Name of a wall: heat flows between the wall and the particles that touch it at the time, through an area of 4 R² each (in
    /// two dimensions 2 R). With `temperature` it is conducted; with `convection` the coefficient is that of the contact, and the ambient
    /// temperature that of the wall. Not with `face` or `set`. Example: `wall = "floor"`.
    pub wall: Option<String>,
    /// Temperature of the surface, K. Example: `temperature = "798 K"`.
    #[schemars(extend("minimum" = 0))]
    pub temperature: Option<Temperature>,
    /// Heat into the body per area, W/m². Example: `flux = "2 kW/m^2"`.
    pub flux: Option<HeatFlux>,
    /// Convection. Example: `convection = { coefficient = "500 W/m^2/K", ambient = "293 K" }`.
    pub convection: Option<Convection>,
    /// Radiation. Example: `radiation = { emissivity = 0.8, ambient = "293 K" }`.
    pub radiation: Option<Radiation>,
    /// Name of a history that multiplies the temperature (of the surface, or of the surroundings) or the flux; default:
    /// constant.
    pub history: Option<String>,
}

/// Convection: heat `h (T_o - T)` per area.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Convection {
    /// Coefficient of heat transfer, W/(m²·K). Required.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub coefficient: HeatTransfer,
    /// Temperature of the surroundings, K. Required.
    #[schemars(extend("minimum" = 0))]
    pub ambient: Temperature,
}

/// Radiation: heat `e s (T_o⁴ - T⁴)` per area, with the Stefan-Boltzmann constant s.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Radiation {
    /// Emissivity. Required.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub emissivity: Number,
    /// Temperature of the surroundings, K. Required.
    #[schemars(extend("minimum" = 0))]
    pub ambient: Temperature,
}
