//! Heat from outside: sources, heat through the surface, prescribed temperatures.

use concordem_contact::heat::HeatBoundary;
use concordem_contact::math::Vec3;
use concordem_contact::quantity::Quantity;

use super::network::Exposure;

/// Stefan–Boltzmann constant, W/(m²·K⁴) (CODATA 2018).
pub const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;

/// Heat that enters from outside. Factors that change with time multiply all of it ([`Factors`]).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Supply {
    /// Sources.
    pub sources: Vec<Source>,
    /// Exchange through the surface.
    pub surfaces: Vec<SurfaceExchange>,
    /// Exchange through contacts with walls.
    pub walls: Vec<WallExchange>,
    /// Prescribed temperatures.
    pub held: Vec<Held>,
}

/// A source of heat.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// Power, W.
    pub power: f64,
    /// Which particles it heats.
    pub spread: Spread,
}

/// How the power of a source is spread over the particles.
#[derive(Debug, Clone, PartialEq)]
pub enum Spread {
    /// Particles with their shares, which sum up to 1.
    Shares(Vec<(u32, f64)>),
    /// All particles, in proportion to `V exp(−|x − x_s|²/(2 r²))`: a source at `x_s = center + velocity t`.
    Gaussian {
        /// Center at thermal time 0, m.
        center: Vec3,
        /// Velocity in thermal time, m/s.
        velocity: Vec3,
        /// Standard deviation r, m.
        radius: f64,
    },
}

/// Heat through parts of the surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceExchange {
    /// The parts.
    pub exposures: Vec<Exposure>,
    /// What flows through them.
    pub exchange: Exchange,
}

/// Heat through the contacts of particles with a wall, at present: those of particles that touch it.
///
/// A contact has the area `4R²` (in the plane `2R`), which is that of a sphere of a square layer on a flat wall, and the distance R from
/// the center. A particle that touches several triangles of a wall has one contact with it.
#[derive(Debug, Clone, PartialEq)]
pub struct WallExchange {
    /// Index of the wall.
    pub wall: usize,
    /// What flows through each contact.
    pub exchange: Exchange,
    /// Whether particles are discs of unit depth.
    pub planar: bool,
}

impl WallExchange {
    /// The contact of a sphere of the given radius (m) with the wall in the direction of a unit vector.
    pub(super) fn contact(&self, particle: u32, radius: f64, normal: Vec3) -> Exposure {
        let edge = 2.0 * radius;
        let area = if self.planar { edge } else { edge * edge };
        Exposure { particle, face: self.wall as u32, area, distance: radius, normal }
    }
}

/// Heat through a surface; positive into the body. Factors multiply the temperature outside, or the flux.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Exchange {
    /// A surface at this temperature, K: `q = λ (T_o − T)/d`.
    Temperature(f64),
    /// A flux, W/m².
    Flux(f64),
    /// Convection, `q = (T_o − T)/(1/h + d/λ)`.
    Convection {
        /// Coefficient h, W/(m²·K).
        coefficient: f64,
        /// Temperature outside, K.
        ambient: f64,
    },
    /// Radiation, `q = e σ (T_o⁴ − T⁴)`.
    Radiation {
        /// Emissivity e.
        emissivity: f64,
        /// Temperature outside, K.
        ambient: f64,
    },
}

/// Particles at a prescribed temperature.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// The particles.
    pub particles: Vec<u32>,
    /// Temperature, K.
    pub temperature: f64,
}

/// Present factors of the sources, surfaces, and prescribed temperatures; 1 where none is given.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Factors {
    /// Of the sources.
    pub sources: Vec<f64>,
    /// Of the surfaces.
    pub surfaces: Vec<f64>,
    /// Of the walls.
    pub walls: Vec<f64>,
    /// Of the prescribed temperatures, at the end of the step.
    pub held: Vec<f64>,
}

/// Factor `k`, 1 if it is not given.
pub(super) fn factor(factors: &[f64], k: usize) -> f64 {
    factors.get(k).copied().unwrap_or(1.0)
}

impl Exchange {
    /// The exchange of a boundary, which has exactly one.
    pub fn of(boundary: &HeatBoundary) -> Self {
        if let Some(temperature) = boundary.temperature {
            return Self::Temperature(temperature.si());
        }
        if let Some(convection) = &boundary.convection {
            return Self::Convection { coefficient: convection.coefficient.si(), ambient: convection.ambient.si() };
        }
        if let Some(radiation) = &boundary.radiation {
            return Self::Radiation { emissivity: radiation.emissivity.si(), ambient: radiation.ambient.si() };
        }
        Self::Flux(boundary.flux.map_or(0.0, Quantity::si))
    }

    /// Heat into a particle at `temperature` (K) through an area (m²) at a distance (m) from its center, with the
    /// conductivity (W/(m·K)) and a factor, W; and minus its derivative with respect to the temperature, W/K.
    #[inline]
    pub fn flow(&self, exposure: &Exposure, conductivity: f64, temperature: f64, factor: f64) -> (f64, f64) {
        let Exposure { area, distance, .. } = *exposure;
        match *self {
            Self::Flux(flux) => (area * flux * factor, 0.0),
            Self::Temperature(outside) => {
                let conductance = area * conductivity / distance;
                (conductance * (outside * factor - temperature), conductance)
            }
            Self::Convection { coefficient, ambient } => {
                let conductance = area / (1.0 / coefficient + distance / conductivity);
                (conductance * (ambient * factor - temperature), conductance)
            }
            Self::Radiation { emissivity, ambient } => {
                let black = emissivity * STEFAN_BOLTZMANN * area;
                let (outside, cube) = (ambient * factor, temperature * temperature * temperature);
                let fourth = |t: f64| t * t * t * t;
                (black * (fourth(outside) - fourth(temperature)), 4.0 * black * cube)
            }
        }
    }

    /// The larger of a temperature and that outside, K: where the exchange is strongest.
    pub(super) fn hottest(&self, temperature: f64) -> f64 {
        match *self {
            Self::Radiation { ambient, .. } => temperature.max(ambient),
            _ => temperature,
        }
    }
}
