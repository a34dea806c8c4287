//! Heat conduction between particles, as a pass beside the contact laws, and the thermal strains that it gives bonds.
//!
//! Heat flows along links ([`network`]) by Fourier's law (Jebahi et al. 2015, (3.3)–(3.6)):
//!
//! `C_i dT_i/dt = Σ_j G_ij (T_j − T_i) + Q_i`,  `G_ij = A / (d_i/λ_i + d_j/λ_j)`
//!
//! with the heat capacity `C` (J/K), the area `A` of the link (m²), the distances `d` of the centers from it (m), the
//! conductivities `λ` (W/(m·K)) of the two materials in series, and the heat `Q` that sources and the surface supply
//! ([`supply`]). Each link takes from one particle what it gives to the other, with the same bits, so heat is conserved.
//!
//! A step of the solver conducts for the thermal time `time_factor × Δt` ([`HeatModel::time_factor`]): explicitly
//! (forward Euler, stable below [`pass::HeatPass::stable_step`]), or implicitly (backward Euler, [`implicit`]).
//!
//! Bonds expand with the temperature: their reference length is `l₀ = l_r (1 + ½(ε_A + ε_B))` with the thermal strains
//! `ε = α (T − T_ref)` of their particles ([`expansion`]). Every law of bonds reads the reference length, so none knows
//! of temperatures.
//!
//! Stiffness and strength of bonds and contacts may depend on the temperature ([`softening`]).
//!
//! Heat capacity, conductivity, and expansion may vary with the temperature ([`curve`]). The temperatures then follow from the heat
//! that each particle takes up, `∫ C dT`, so heat is conserved as with constants. Conductances have the temperatures of the start of
//! a step.
//!
//! The network is that of the initial positions. It changes where bonds break: there, the resistance of the crack lies in
//! series with the link. Contacts that form later, and cracks that close, conduct if the model says how ([`contact`]).

pub mod contact;
pub mod curve;
pub mod expansion;
pub mod flow;
pub mod implicit;
pub mod network;
pub mod pass;
pub mod softening;
pub mod supply;
pub mod tables;

pub use contact::{ContactConduction, ContactExchange};
pub use curve::{Curve, Curves, MaterialCurves};
pub use flow::HeatFlows;
pub use network::{Exposure, Link, Network};
pub use supply::{Exchange, Held, Source, Spread, Supply, SurfaceExchange, WallExchange};

use concordem_contact::material::Material;

use crate::energy::Sum;
use crate::state::Particles;
use crate::state::contacts::Pair;

/// Thermal constants of a material.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ThermalMaterial {
    /// Heat capacity per mass, J/(kg·K).
    pub specific_heat: f64,
    /// Thermal conductivity, W/(m·K).
    pub conductivity: f64,
    /// Linear thermal expansion, 1/K.
    pub expansion: f64,
}

impl ThermalMaterial {
    /// The constants of a material; zero if it has none.
    pub fn of(material: &Material) -> Self {
        material.thermal.as_ref().map_or_else(Self::default, |thermal| Self {
            specific_heat: thermal.specific_heat.si(),
            conductivity: thermal.conductivity.si(),
            expansion: thermal.expansion.si(),
        })
    }
}

/// Everything about heat that stays constant while the solver steps.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatModel {
    /// Constants of the materials.
    pub materials: Vec<ThermalMaterial>,
    /// How they vary with the temperature; empty if they do not.
    pub curves: Curves,
    /// Links, volumes, and surfaces.
    pub network: Network,
    /// Heat capacity of each particle, J/K; of a factor of 1 if it varies with the temperature.
    pub capacity: Vec<f64>,
    /// Heat that enters from outside.
    pub supply: Supply,
    /// Temperature at which bonds have their length at bonding, K.
    pub reference_temperature: f64,
    /// Thermal time that passes in one unit of the time of the motion.
    pub time_factor: f64,
    /// Whether steps are implicit.
    pub implicit: bool,
    /// Whether particles move; otherwise a step only conducts heat.
    pub mechanics: bool,
    /// Whether the energy that contacts dissipate heats their particles.
    pub dissipation: bool,
    /// Resistance of a crack, m²·K/W; infinite if cracks insulate.
    pub crack_resistance: f64,
    /// How particles without a link exchange heat while they touch; `None`: not at all.
    pub contact: Option<ContactConduction>,
}

impl HeatModel {
    /// Whether bonds expand.
    pub fn expands(&self) -> bool {
        self.materials.iter().any(|material| material.expansion != 0.0)
    }

    /// Thermal strain of a particle of material `material` at `temperature` (K).
    #[inline]
    pub fn strain(&self, material: u16, temperature: f64) -> f64 {
        self.strain_of(material, self.reference_temperature, temperature - self.reference_temperature)
    }

    /// Thermal strain that a particle of material `material` gains from the temperature `from` (K) over a change (K).
    #[inline]
    pub fn strain_of(&self, material: u16, from: f64, change: f64) -> f64 {
        let warming = self.curves.expansion(material).map_or(change, |curve| curve.integral(from, change));
        self.materials[material as usize].expansion * warming
    }

    /// Conductivity of a material at `temperature` (K), W/(m·K).
    #[inline]
    pub fn conductivity(&self, material: u16, temperature: f64) -> f64 {
        let constant = self.materials[material as usize].conductivity;
        self.curves.conductivity(material).map_or(constant, |curve| constant * curve.at(temperature))
    }

    /// Factor on the stiffness of a material at `temperature` (K).
    #[inline]
    pub fn stiffness_factor(&self, material: u16, temperature: f64) -> f64 {
        self.curves.stiffness(material).map_or(1.0, |curve| curve.at(temperature))
    }

    /// Factor on the strength of a material at `temperature` (K).
    #[inline]
    pub fn strength_factor(&self, material: u16, temperature: f64) -> f64 {
        self.curves.strength(material).map_or(1.0, |curve| curve.at(temperature))
    }

    /// Largest factor on the stiffness of each material; empty if stiffness and strength are constant.
    pub fn largest_stiffness_factors(&self) -> Vec<f64> {
        if !self.curves.softens() {
            return Vec::new();
        }
        let largest = |material: usize| self.curves.stiffness(material as u16).map_or(1.0, |curve| curve.range()[1]);
        (0..self.materials.len()).map(largest).collect()
    }

    /// Largest conductivity of a material, W/(m·K).
    pub fn largest_conductivity(&self, material: u16) -> f64 {
        let constant = self.materials[material as usize].conductivity;
        self.curves.conductivity(material).map_or(constant, |curve| constant * curve.range()[1])
    }

    /// Lowest heat capacity of particle `p`, J/K.
    pub fn lowest_capacity(&self, p: usize) -> f64 {
        self.curves.specific_heat(p).map_or(self.capacity[p], |curve| self.capacity[p] * curve.range()[0])
    }

    /// Heat that particle `p` takes up from the temperature `from` (K) over a change (K), J.
    #[inline]
    pub fn heat_of(&self, p: usize, from: f64, change: f64) -> f64 {
        self.capacity[p] * self.curves.specific_heat(p).map_or(change, |curve| curve.integral(from, change))
    }

    /// Change of the temperature of particle `p` from `from` (K) as it takes up heat (J), K.
    #[inline]
    pub fn warming_of(&self, p: usize, from: f64, heat: f64) -> f64 {
        let change = heat / self.capacity[p];
        self.curves.specific_heat(p).map_or(change, |curve| curve.change(from, change))
    }

    /// Heat content `Σ C (T − T_ref)`, J; `Σ ∫ C dT` if capacities vary.
    pub fn content(&self, heat: &HeatState) -> f64 {
        let mut sum = Sum::default();
        for (p, (temperature, correction)) in heat.temperature.iter().zip(&heat.correction).enumerate() {
            sum.add(self.heat_of(p, self.reference_temperature, temperature - self.reference_temperature));
            sum.add(self.heat_of(p, *temperature, *correction));
        }
        sum.get()
    }

    /// The state of particles at the given temperatures, K, from which a run starts.
    pub fn start(&self, temperature: Vec<f64>) -> HeatState {
        let n = temperature.len();
        let dissipated = if self.dissipation { vec![0.0; n] } else { Vec::new() };
        let (correction, warming) = (vec![0.0; n], vec![0.0; n]);
        let mut heat = HeatState { temperature, correction, warming, dissipated, ledger: HeatLedger::default() };
        heat.ledger.initial = self.content(&heat);
        heat
    }

    /// Error of the balance of heat, J: heat at the start plus supplied heat minus the present heat.
    pub fn residual(&self, heat: &HeatState) -> f64 {
        let mut sum = Sum::default();
        let HeatLedger { initial, sources, boundary, dissipation } = &heat.ledger;
        for term in [*initial, sources.get(), boundary.get(), dissipation.get(), -self.content(heat)] {
            sum.add(term);
        }
        for waiting in &heat.dissipated {
            sum.add(-waiting);
        }
        sum.get()
    }

    /// Mean temperature, weighted by heat capacity (of a factor of 1), K.
    pub fn mean_temperature(&self, heat: &HeatState) -> f64 {
        let capacity: f64 = self.capacity.iter().sum();
        if self.curves.specific_heat_varies() {
            let products =
                self.capacity.iter().zip(&heat.temperature).map(|(capacity, temperature)| capacity * temperature);
            return products.sum::<f64>() / capacity;
        }
        self.reference_temperature + self.content(heat) / capacity
    }
}

/// Heat capacities `ρ c V`, J/K. `bulk_density` gives for each material the density that the volumes of the network
/// refer to, kg/m³; `None`: the mass of its particles divided by their volume in the network, so that all particles
/// together have the heat capacity of their mass.
pub fn capacities(
    network: &Network,
    particles: &Particles,
    materials: &[ThermalMaterial],
    bulk_density: &[Option<f64>],
) -> Vec<f64> {
    let mut mass = vec![0.0; materials.len()];
    let mut volume = vec![0.0; materials.len()];
    for p in 0..particles.len() {
        let material = particles.material[p] as usize;
        mass[material] += particles.mass[p];
        volume[material] += network.volume[p];
    }
    let density: Vec<f64> = (0..materials.len()).map(|m| bulk_density[m].unwrap_or(mass[m] / volume[m])).collect();
    let of = |p: usize| {
        let material = particles.material[p] as usize;
        density[material] * materials[material].specific_heat * network.volume[p]
    };
    (0..particles.len()).map(of).collect()
}

/// What heat conduction changes during a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HeatState {
    /// Temperature of each particle, K.
    pub temperature: Vec<f64>,
    /// What rounding has cut off from each temperature, K. Without it, the small changes near a steady state would be
    /// lost to rounding, and heat with them.
    pub correction: Vec<f64>,
    /// Change of each temperature in the last step, K.
    pub warming: Vec<f64>,
    /// Heat from dissipation in the last step, which each particle takes up in the next one, J; empty if none becomes heat.
    pub dissipated: Vec<f64>,
    /// Balance of heat.
    pub ledger: HeatLedger,
}

impl HeatState {
    /// Take the energy that contacts dissipated in a step (J), half of it by each particle.
    pub fn take_up(&mut self, dissipated: &[(Pair, f64)]) {
        for (pair, energy) in dissipated {
            let half = 0.5 * energy;
            self.dissipated[pair.a as usize] += half;
            self.dissipated[pair.b as usize] += half;
            self.ledger.dissipation.add(*energy);
        }
    }
}

/// Balance of heat, J.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HeatLedger {
    /// Heat content at the start, relative to the reference temperature.
    pub initial: f64,
    /// Heat from sources.
    pub sources: Sum,
    /// Heat through the surface, and heat that holds prescribed temperatures; positive into the body.
    pub boundary: Sum,
    /// Heat from damage, friction, and dashpots.
    pub dissipation: Sum,
}

impl HeatLedger {
    /// All terms but dissipation, for checkpoints.
    pub fn to_reals(&self) -> [f64; 5] {
        let ([a, b], [c, d]) = (self.sources.parts(), self.boundary.parts());
        [self.initial, a, b, c, d]
    }

    /// The ledger of [`Self::to_reals`].
    pub fn from_reals([initial, a, b, c, d]: [f64; 5]) -> Self {
        Self { initial, sources: Sum::from_parts([a, b]), boundary: Sum::from_parts([c, d]), ..Self::default() }
    }
}
