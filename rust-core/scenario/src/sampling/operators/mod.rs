//! The list of operators; each file defines one, or a strain and its rate.

mod affine_strain;
mod boundary_stress;
mod cell_strain;
mod coarse_grain;
mod contact_cell_strain;
mod couple_stress;
mod damage_tensor;
mod fabric;
mod gauge;
mod heat_flux;
mod particle_stress;
mod porosity;
mod power;
mod region_stress;
mod set_force;
mod set_motion;
mod temperature;
mod wall_moment;
mod wall_traction;

use super::definition::{OperatorDefinition, SampledQuantity};

macro_rules! operators {
    ($($(#[doc = $doc:literal])+ $variant:ident = $name:literal: $file:ident::$definition:ident,)*) => {
        /// An operator that can be evaluated during a run.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        pub enum Operator {
            $($(#[doc = $doc])+ #[serde(rename = $name)] $variant,)*
        }

        impl Operator {
            /// All operators, in the order of the documentation.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$variant),*];

            /// Name in scenarios and results.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// Definition of the operator.
            pub fn definition(self) -> &'static OperatorDefinition {
                match self { $(Self::$variant => &$file::$definition,)* }
            }
        }
    };
}

operators! {
    /// Stress from the sum over branch vectors, and its kinetic part.
    RegionStress = "region-stress": region_stress::DEFINITION,
    /// Stress as the volume average over particles, walls included, and the mean stress in the particles.
    ParticleStress = "particle-stress": particle_stress::DEFINITION,
    /// Stress and couple stress of the whole body from the forces of walls and supports.
    BoundaryStress = "boundary-stress": boundary_stress::DEFINITION,
    /// Force of the particles on a wall, and the traction on a given area.
    WallTraction = "wall-traction": wall_traction::DEFINITION,
    /// Force and moment of the particles on a wall: the torque of a drum, a vane, or a ring shear test.
    WallMoment = "wall-moment": wall_moment::DEFINITION,
    /// Force and moment on a set of particles from outside it, and the reaction of its prescribed motion.
    SetForce = "set-force": set_force::DEFINITION,
    /// Mean position, displacement, and velocity of a set of particles.
    SetMotion = "set-motion": set_motion::DEFINITION,
    /// Length, elongation, strain, and opening between two sets of particles.
    Gauge = "gauge": gauge::DEFINITION,
    /// Stress and couple stress about the center of the region, from contacts internal to the region.
    CoupleStress = "couple-stress": couple_stress::DEFINITION,
    /// Best affine fit of displacement and rotation since the start: gradient, Cosserat strain, curvature.
    AffineStrain = "affine-strain": affine_strain::STRAIN,
    /// Best affine fit of velocity and angular velocity: gradient, Cosserat strain rate, rate of curvature.
    AffineRate = "affine-rate": affine_strain::RATE,
    /// Displacement gradient since the start, averaged over the Delaunay cells of the initial positions.
    CellStrain = "cell-strain": cell_strain::STRAIN,
    /// Velocity gradient, averaged over the same Delaunay cells at their present positions.
    CellRate = "cell-rate": cell_strain::RATE,
    /// Displacement gradient with rotations since the start, from the contact cells (power diagram) of the periodic cell.
    ContactCellStrain = "contact-cell-strain": contact_cell_strain::STRAIN,
    /// Velocity gradient with angular velocities, from the contact cells of the periodic cell.
    ContactCellRate = "contact-cell-rate": contact_cell_strain::RATE,
    /// Fabric tensor and coordination number.
    Fabric = "fabric": fabric::DEFINITION,
    /// Solid fraction and porosity.
    Porosity = "porosity": porosity::DEFINITION,
    /// Mean, lowest, and highest temperature of the particles; needs `[heat]`.
    Temperature = "temperature": temperature::DEFINITION,
    /// Mean heat flux from the sum over the links along which heat flows, surface included; needs `[heat]`.
    HeatFlux = "heat-flux": heat_flux::DEFINITION,
    /// Damage tensors of the bonds: of their damage and of their lost strength; broken bonds count as 1.
    DamageTensor = "damage-tensor": damage_tensor::DEFINITION,
    /// Power put into the contacts, and the parts that stress and strain rate account for.
    Power = "power": power::DEFINITION,
    /// Density, velocity, and stress at a point by a smooth kernel; the region is a sphere, the support of the kernel.
    CoarseGrain = "coarse-grain": coarse_grain::DEFINITION,
}

impl Operator {
    /// The operator with this name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|operator| operator.name() == name)
    }

    /// Quantities that the operator returns, in the order of the values.
    pub fn quantities(self) -> &'static [SampledQuantity] {
        self.definition().quantities
    }

    /// Number of values in a row.
    pub fn width(self) -> usize {
        self.quantities().iter().map(|quantity| quantity.components).sum()
    }
}
