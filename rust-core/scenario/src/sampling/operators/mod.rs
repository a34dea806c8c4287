//! The list of operators.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, Error};
use serde::{Serialize, Serializer};

use super::definition::{OperatorDefinition, SampledQuantity};

// `cargo fmt` does not see the files; `make check` formats them by name.
macro_rules! operators {
    ($($file:ident: $Operator:ident,)*) => {
        $(mod $file;)*

        /// An operator that can be evaluated during a run.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Operator {
            $(#[doc = concat!("The operator of the file `", stringify!($file), ".rs`.")] $Operator,)*
        }

        impl Operator {
            /// All operators, in the order of the documentation.
            pub const ALL: [Self; [$(stringify!($file)),*].len()] = [$(Self::$Operator),*];

            /// Names of all operators, in the same order.
            const NAMES: &'static [&'static str] = &[$($file::DEFINITION.name),*];

            /// Definition of the operator.
            pub fn definition(self) -> &'static OperatorDefinition {
                match self { $(Self::$Operator => &$file::DEFINITION,)* }
            }
        }
    };
}

// One line per operator, as `file: Operator`. To add an operator, add a line.
operators! {
    region_stress: RegionStress,
    particle_stress: ParticleStress,
    boundary_stress: BoundaryStress,
    wall_traction: WallTraction,
    wall_moment: WallMoment,
    set_force: SetForce,
    set_motion: SetMotion,
    gauge: Gauge,
    couple_stress: CoupleStress,
    affine_strain: AffineStrain,
    affine_rate: AffineRate,
    cell_strain: CellStrain,
    cell_rate: CellRate,
    contact_cell_strain: ContactCellStrain,
    contact_cell_rate: ContactCellRate,
    fabric: Fabric,
    porosity: Porosity,
    temperature: Temperature,
    heat_flux: HeatFlux,
    damage_tensor: DamageTensor,
    power: Power,
    coarse_grain: CoarseGrain,
}

impl Operator {
    /// The operator with this name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|operator| operator.name() == name)
    }

    /// Name in scenarios and results.
    pub fn name(self) -> &'static str {
        self.definition().name
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

impl Serialize for Operator {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for Operator {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = Cow::<str>::deserialize(deserializer)?;
        Self::of_name(&name).ok_or_else(|| D::Error::unknown_variant(&name, Self::NAMES))
    }
}

impl JsonSchema for Operator {
    fn schema_name() -> Cow<'static, str> {
        "Operator".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let choice = |operator: Self| {
            let OperatorDefinition { name, meaning, .. } = operator.definition();
            json_schema!({ "description": meaning, "type": "string", "const": name })
        };
        json_schema!({
            "description": "An operator that can be evaluated during a run.",
            "oneOf": Self::ALL.map(choice),
        })
    }
}
