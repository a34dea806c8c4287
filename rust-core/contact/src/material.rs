//! Materials: density, elastic constants of the particles, and the parameter tables of contact laws.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::law::{self, Elastic, Factors, Fault, HasTable, LawName, LawTable, RegisteredLaw};
use crate::quantity::{Conductivity, Density, Expansion, Number, SpecificHeat, Stress, Temperature};
use crate::scatter::{Scatter, StrengthScatter};

/// Elastic constants of particles that deform under their contacts (Madan 2019).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ParticleElasticity {
    /// Young's modulus of the particles, Pa.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub young: Stress,
    /// Poisson's ratio of the particles.
    #[schemars(extend("exclusiveMinimum" = -1, "maximum" = 0.5))]
    pub poisson: Number,
}

/// Thermal constants.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Thermal {
    /// Heat capacity per mass, J/(kg·K). Required.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub specific_heat: SpecificHeat,
    /// Thermal conductivity, W/(m·K). Required.
    #[schemars(extend("minimum" = 0))]
    pub conductivity: Conductivity,
    /// Linear thermal expansion of bonds, 1/K; default: 0.
    #[serde(default)]
    pub expansion: Expansion,
    /// Density of the bulk, kg/m³, which the volumes of the cells of the particles refer to; default: the mass of the particles
    /// divided by the volume of their cells, so that all particles together have the heat capacity of their mass.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub bulk_density: Option<Density>,
    /// How the constants vary with the temperature; default: not at all.
    /// Example: `variation = { temperature = ["300 K", "900 K"], specific_heat = [1, 1.4], conductivity = [1, 0.6] }`.
    pub variation: Option<ThermalVariation>,
}

/// Factors on the constants of a material at given temperatures: linear in between, constant below the first and above the last temperature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ThermalVariation {
    /// Temperatures in ascending order, at least two, K. Required.
    pub temperature: Vec<Temperature>,
    /// Factors on the heat capacity, one per temperature; default: 1.
    pub specific_heat: Option<Vec<Number>>,
    /// Factors on the conductivity; default: 1.
    pub conductivity: Option<Vec<Number>>,
    /// Factors on the thermal expansion, `d(strain)/dT`; default: 1.
    pub expansion: Option<Vec<Number>>,
    /// Factors on the stiffness of bonds, and of contacts between particles; default: 1. A bond has the mean of its two particles.
    pub stiffness: Option<Vec<Number>>,
    /// Factors on the strength of bonds: on all stresses or forces at which they fail or slip; default: 1. A bond has the mean of its
    /// two particles.
    pub strength: Option<Vec<Number>>,
}

/// Title of the table of a law, for the schema.
fn about<L: RegisteredLaw>() -> String {
    format!("Parameters of the {}.", L::TITLE)
}

macro_rules! with_tables {
    ($($key:ident: $Law:ident,)*) => {
        /// A material.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct Material {
            /// Name, by which sets and walls refer to it. Particles that no set assigns to another material have the
            /// first one.
            pub name: String,
            /// Mass density of the particles themselves (not of the packing), kg/m³.
            #[schemars(extend("exclusiveMinimum" = 0))]
            pub density: Density,
            $(
                #[doc = concat!("Parameters of [`", stringify!($Law), "`](law::", stringify!($key), ").")]
                #[schemars(extend("description" = about::<law::$key::$Law>()))]
                pub $key: Option<<law::$key::$Law as RegisteredLaw>::Table>,
            )*
            /// Elastic constants of the particles themselves, which deform under their contacts; rigid if left out.
            pub deformable: Option<ParticleElasticity>,
            /// Thermal constants. Required with `[heat]`.
            pub thermal: Option<Thermal>,
            /// Scatter of the strengths of bonds; default: none.
            pub strength_scatter: Option<StrengthScatter>,
        }

        /// Parameters between two materials, instead of the mean of both.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct Interface {
            /// Names of the two materials. With `[aggregates]`, the name of the same material twice: bonds between two of its
            /// aggregates.
            pub between: [String; 2],
            /// Material whose parameters the interface takes, times the `factors`, for the laws that have no table here; default:
            /// the mean of both materials. Example: `of = "mortar"`.
            pub of: Option<String>,
            /// Factors on the parameters of the material `of`; default: all are 1.
            /// Example: `factors = { stiffness = 0.5, strength = 0.5, ductility = 0.1 }`.
            pub factors: Option<Factors>,
            $(
                #[doc = concat!("Parameters of [`", stringify!($Law), "`](law::", stringify!($key), ").")]
                #[schemars(extend("description" = about::<law::$key::$Law>()))]
                pub $key: Option<<law::$key::$Law as RegisteredLaw>::Table>,
            )*
        }

        impl Material {
            /// The tables present, by law.
            pub fn tables(&self) -> Vec<(LawName, &dyn LawTable)> {
                let mut tables: Vec<(LawName, &dyn LawTable)> = Vec::new();
                $(tables.extend(self.$key.as_ref().map(|table| (LawName::$Law, table as &dyn LawTable)));)*
                tables
            }
        }

        impl Interface {
            /// The tables present, by law.
            pub fn tables(&self) -> Vec<(LawName, &dyn LawTable)> {
                let mut tables: Vec<(LawName, &dyn LawTable)> = Vec::new();
                $(tables.extend(self.$key.as_ref().map(|table| (LawName::$Law, table as &dyn LawTable)));)*
                tables
            }
        }

        impl Material {
            /// Why the factors of an interface do not apply to the table of a law; `None` if they do, or without a table.
            pub fn fault_of_factors(&self, law: LawName, factors: &Factors) -> Option<Fault> {
                match law {
                    $(LawName::$Law => law::$key::$Law::scaled(self.$key.as_ref()?, factors).err(),)*
                }
            }
        }

        $(
            impl HasTable<law::$key::$Law> for Material {
                fn table(&self) -> Option<&<law::$key::$Law as RegisteredLaw>::Table> {
                    self.$key.as_ref()
                }
            }
            impl HasTable<law::$key::$Law> for Interface {
                fn table(&self) -> Option<&<law::$key::$Law as RegisteredLaw>::Table> {
                    self.$key.as_ref()
                }
            }
        )*
    };
}
crate::for_each_law!(with_tables);

impl Material {
    /// The table of a law, if present.
    pub fn table_of(&self, law: LawName) -> Option<&dyn LawTable> {
        self.tables().into_iter().find(|(name, _)| *name == law).map(|(_, table)| table)
    }

    /// Whether the material has parameters of the law.
    pub fn has(&self, law: LawName) -> bool {
        self.table_of(law).is_some()
    }

    /// Scatter of the strengths of bonds by material; empty if no material has one.
    pub fn scatter_of_strengths(materials: &[Self]) -> Vec<Option<Scatter>> {
        let of = |material: &Self| material.strength_scatter.as_ref().and_then(StrengthScatter::scatter);
        let all: Vec<_> = materials.iter().map(of).collect();
        if all.iter().all(Option::is_none) { Vec::new() } else { all }
    }

    /// Faults of `strength_scatter` for bonds of a law; keys are those of that table.
    pub fn faults_of_scatter(&self, law: Option<LawName>) -> Vec<Fault> {
        let Some(scatter) = &self.strength_scatter else { return Vec::new() };
        let mut faults = scatter.faults();
        faults.extend(self.fault_of_strengths(law));
        faults
    }

    /// Why bonds of this material and law cannot have strengths that differ.
    pub fn fault_of_strengths(&self, law: Option<LawName>) -> Option<Fault> {
        let factors = Factors { strength: Number::new(0.5), ..Factors::default() };
        let table = law.and_then(|law| Some((law, self.table_of(law)?)));
        match table {
            None => {
                let help = "give bonds, and the table of their law, or remove this table";
                Some(Fault::conflict("", "has no effect: only bonds have a strength", help))
            }
            Some((law, table)) => match table.fault_of_variation() {
                Some(fault) => {
                    let name = law.key();
                    let of = if fault.key.is_empty() { name.to_owned() } else { format!("{name}.{}", fault.key) };
                    let help = "remove this table, or use another law or option";
                    Some(Fault::conflict("", format!("`{of}`: {}", fault.message), help))
                }
                None => self
                    .fault_of_factors(law, &factors)
                    .map(|fault| Fault::conflict("", format!("has no effect: {}", fault.message), fault.help)),
            },
        }
    }

    /// Elastic constants of the particles; rigid if they do not deform.
    pub fn elasticity(&self) -> Elastic {
        self.deformable.as_ref().map_or(Elastic::RIGID, |t| Elastic { young: t.young.si(), poisson: t.poisson.si() })
    }
}

impl Interface {
    /// Whether the interface is between these two materials, in either order.
    pub fn joins(&self, a: &str, b: &str) -> bool {
        let [x, y] = &self.between;
        (x == a && y == b) || (x == b && y == a)
    }
}
