//! The time series of a run: its columns, and one record per row.

/// A column of the time series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SeriesColumn {
    /// Name of the column.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Description of the column.
    pub description: &'static str,
}

macro_rules! series {
    ($($(#[doc = $doc:literal])+ $name:ident : $unit:literal,)*) => {
        /// One row of the time series.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct Record { $($(#[doc = $doc])+ pub $name: f64,)* }
        impl Record {
            /// The columns, in the order of [`Self::to_row`].
            pub const COLUMNS: &'static [SeriesColumn] = &[$(SeriesColumn {
                name: stringify!($name),
                unit: $unit,
                description: concat!($($doc),+),
            }),*];
            /// The columns that a result has: those at the end only if something presses on the sides of the specimen.
            pub fn columns(is_confined: bool) -> &'static [SeriesColumn] {
                &Self::COLUMNS[..Self::COLUMNS.len() - if is_confined { 0 } else { 2 }]
            }
            /// The values in the order of [`Self::COLUMNS`].
            pub fn to_row(&self) -> Vec<f64> {
                vec![$(self.$name),*]
            }
            /// The record with the values of a row in that order; `None` for a row of another length.
            pub fn of_row(row: &[f64]) -> Option<Self> {
                let mut values = row.iter().copied();
                let record = Self { $($name: values.next()?),* };
                values.next().is_none().then_some(record)
            }
        }
    };
}

series! {
    /// Time
    time: "s",
    /// Step
    step: "1",
    /// Strain along the loading axis
    strain: "1",
    /// Strain along the loading axis in the middle half of the specimen, fitted to its particles
    gauge_strain: "1",
    /// Stress along the loading axis
    stress: "Pa",
    /// Kinetic energy, ½ m v⁻·v⁺
    kinetic: "J",
    /// Energy stored by normal deformation of contacts
    stored_normal: "J",
    /// Energy stored by shear
    stored_shear: "J",
    /// Energy stored by bending
    stored_bending: "J",
    /// Energy stored by twist
    stored_twist: "J",
    /// Energy stored in deformable particles
    stored_deformation: "J",
    /// Energy dissipated by damage and breakage
    damage: "J",
    /// Energy dissipated by plastic slip and friction
    friction: "J",
    /// Energy dissipated by dashpots
    viscous: "J",
    /// Integration error at kinks of laws
    integration: "J",
    /// Energy dissipated by numerical damping
    numerical_damping: "J",
    /// Energy dissipated because the strains of deformable particles lag behind the forces
    deformation_lag: "J",
    /// Energy lost (negative: created) by forces that deform particles but do not depend on the deformation
    deformation_other: "J",
    /// Work of prescribed motions, walls, and the cell
    boundary_work: "J",
    /// Work of gravity and given forces
    external_work: "J",
    /// Work of the thermal expansion of bonds
    expansion_work: "J",
    /// Work of the change of stiffness with the temperature
    stiffness_work: "J",
    /// Residual of the energy balance
    residual: "J",
    /// Mean temperature, weighted by heat capacity; 0 without heat conduction
    mean_temperature: "K",
    /// Heat from sources
    heat_sources: "J",
    /// Heat through the surface and from prescribed temperatures
    heat_boundary: "J",
    /// Heat from damage, friction, and dashpots; 0 unless heat.dissipation is on
    heat_dissipation: "J",
    /// Residual of the balance of heat
    heat_residual: "J",
    /// Bonds broken so far
    broken: "1",
    /// Bonds whose damage passed the event threshold so far
    damaged: "1",
    /// Bonds and contacts that carry force
    contacts: "1",
    /// Net force on free bodies over contact force, or net moment over contact moment if larger (root mean squares)
    unbalanced: "1",
    /// Mean stress across the loading axis at the sides of the specimen; only where something presses on them
    lateral_stress: "Pa",
    /// Change of the volume over the volume at the start; only where something presses on the sides of the specimen
    volumetric_strain: "1",
}
