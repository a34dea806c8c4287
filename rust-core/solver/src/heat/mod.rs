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
//! The network is that of the initial positions. It changes where bonds break: there, the resistance of the crack lies in
//! series with the link.

pub mod expansion;
pub mod implicit;
pub mod network;
pub mod pass;
pub mod supply;
pub mod tables;

pub use network::{Exposure, Link, Network};
pub use supply::{Exchange, Held, Source, Spread, Supply, SurfaceExchange};

use crate::energy::Sum;
use crate::state::Particles;

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

/// Everything about heat that stays constant while the solver steps.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatModel {
    /// Constants of the materials.
    pub materials: Vec<ThermalMaterial>,
    /// Links, volumes, and surfaces.
    pub network: Network,
    /// Heat capacity of each particle, J/K.
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
    /// Resistance of a crack, m²·K/W; infinite if cracks insulate.
    pub crack_resistance: f64,
}

impl HeatModel {
    /// Whether bonds expand.
    pub fn expands(&self) -> bool {
        self.materials.iter().any(|material| material.expansion != 0.0)
    }

    /// Thermal strain of a particle of material `material` at `temperature` (K).
    #[inline]
    pub fn strain(&self, material: u16, temperature: f64) -> f64 {
        self.materials[material as usize].expansion * (temperature - self.reference_temperature)
    }

    /// Heat content `Σ C (T − T_ref)`, J.
    pub fn content(&self, heat: &HeatState) -> f64 {
        let mut sum = Sum::default();
        for ((capacity, temperature), correction) in self.capacity.iter().zip(&heat.temperature).zip(&heat.correction) {
            sum.add(capacity * (temperature - self.reference_temperature));
            sum.add(capacity * correction);
        }
        sum.get()
    }

    /// The state of particles at the given temperatures, K, from which a run starts.
    pub fn start(&self, temperature: Vec<f64>) -> HeatState {
        let n = temperature.len();
        let mut heat =
            HeatState { temperature, correction: vec![0.0; n], warming: vec![0.0; n], ledger: HeatLedger::default() };
        heat.ledger.initial = self.content(&heat);
        heat
    }

    /// Error of the balance of heat, J: heat at the start plus supplied heat minus the present heat.
    pub fn residual(&self, heat: &HeatState) -> f64 {
        let mut sum = Sum::default();
        for term in [heat.ledger.initial, heat.ledger.sources.get(), heat.ledger.boundary.get(), -self.content(heat)] {
            sum.add(term);
        }
        sum.get()
    }

    /// Mean temperature, weighted by heat capacity, K.
    pub fn mean_temperature(&self, heat: &HeatState) -> f64 {
        let capacity: f64 = self.capacity.iter().sum();
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
    /// Balance of heat.
    pub ledger: HeatLedger,
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
}

impl HeatLedger {
    /// All terms, for checkpoints.
    pub fn to_reals(&self) -> [f64; 5] {
        let ([a, b], [c, d]) = (self.sources.parts(), self.boundary.parts());
        [self.initial, a, b, c, d]
    }

    /// The ledger of [`Self::to_reals`].
    pub fn from_reals([initial, a, b, c, d]: [f64; 5]) -> Self {
        Self { initial, sources: Sum::from_parts([a, b]), boundary: Sum::from_parts([c, d]) }
    }
}
