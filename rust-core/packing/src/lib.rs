//! Sphere packings: initial positions and radii of particles, and their bonds.
//!
//! A [`Packing`] is a list of spheres with or without a periodic cell. It comes from a [`lattice`], a [`mod@file`], or random
//! compaction ([`mod@random_dense`], [`mod@cooker`], [`growth`], [`discs`]). It can be tiled and cropped to a [`shape`]. [`summary`] and
//! [`isotropy`] measure its quality; [`bonding`] creates the bonds. [`aggregates`] divides a specimen into mortar and aggregates,
//! [`fibers`] adds fibers.

pub mod aggregates;
mod bad_lines;
pub mod bonding;
mod cloud;
pub mod cooker;
pub mod discs;
pub mod fibers;
pub mod file;
pub mod growth;
pub mod import;
pub mod isotropy;
pub mod lattice;
pub mod memory;
pub mod random;
pub mod random_dense;
pub mod section;
pub mod shape;
pub mod size;
pub mod stl;
pub mod summary;
pub mod tile_crop;

pub use cooker::{Cooked, Cooker, CookerProgress, CookerStage, Correction, Target, cook};
pub use discs::random_discs;
pub use file::{export_csv, export_text, import_text};
pub use growth::{Grown, GrownBox, grown_box};
pub use import::import;
pub use isotropy::{DirectionHistogram, link_vectors};
pub use lattice::Lattice;
pub use random::Random;
pub use random_dense::{Compaction, Progress, Protocol, RandomDense, Stage, random_dense};
pub use section::smallest_section;
pub use shape::Shape;
pub use size::SizeDistribution;
pub use stl::{Surface, read_stl};
pub use summary::PackingSummary;
pub use tile_crop::{Crop, cut_away, tile, tile_and_crop};

use concordem_contact::math::Vec3;
use concordem_solver::neighbor::NeighborError;
use concordem_solver::state::Cell;
use concordem_solver::state::particles::Sphere;

/// Relative difference up to which a distance equals a limit: for bonds, layers, selections, and crops.
///
/// Distances of lattices and of files with 15 digits have rounding errors of some 1e-16 times coordinate over distance:
/// 1e-12 in a body ten thousand particles across. The tolerance exceeds that by three orders of magnitude and is small
/// compared with any difference that a model intends.
pub const TIE: f64 = 1e-9;

/// Spheres in space, periodic if there is a cell.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Packing {
    /// The spheres.
    pub spheres: Vec<Sphere>,
    /// Periodic cell, if the packing is periodic.
    pub cell: Option<Cell>,
}

/// Why a packing cannot be made, read, or measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PackingError {
    /// A number that must be positive and finite is not.
    #[error("{name} is {value}; it must be positive and finite")]
    NotPositive {
        /// What the number means.
        name: &'static str,
        /// Its value in SI units.
        value: f64,
    },
    /// A number lies outside its range.
    #[error("{name} is {value}; it must lie between {low} and {high}")]
    OutOfRange {
        /// What the number means.
        name: &'static str,
        /// Its value in SI units.
        value: f64,
        /// Smallest allowed value.
        low: f64,
        /// Largest allowed value.
        high: f64,
    },
    /// A size distribution that is empty or not in order.
    #[error("size distribution: {reason}")]
    BadSizes {
        /// What is wrong with it.
        reason: String,
    },
    /// A file that holds no packing in a known format.
    #[error("{reason}")]
    Foreign {
        /// What it is, and the remedy.
        reason: String,
    },
    /// A shape without interior.
    #[error("shape: {reason}")]
    BadShape {
        /// What is wrong with it.
        reason: String,
    },
    /// A triangle mesh that does not enclose a volume.
    #[error(
        "the triangle mesh is not closed: {edges} edges do not belong to an even number of triangles, one of them from \
         ({}, {}, {}) to ({}, {}, {}) m",
        from[0], from[1], from[2], to[0], to[1], to[2]
    )]
    MeshNotClosed {
        /// Number of open edges.
        edges: usize,
        /// Start of one of them, m.
        from: [f64; 3],
        /// Its end, m.
        to: [f64; 3],
    },
    /// An operation that needs a periodic cell was given a packing without one.
    #[error("this needs a periodic packing, but the packing has no cell")]
    NoCell,
    /// A shape so large, or spheres so small, that the result would not fit.
    #[error("this would make {count:.0e} spheres; at most {limit:e} can be handled")]
    TooMany {
        /// Expected number.
        count: f64,
        /// Largest possible number.
        limit: f64,
    },
    /// More memory than the machine has.
    #[error("this needs about {:.1} GB of memory for {what}; this machine has {:.1} GB", bytes / 1e9, total / 1e9)]
    Memory {
        /// What needs the memory.
        what: String,
        /// Estimated need, bytes.
        bytes: f64,
        /// Memory of the machine, bytes.
        total: f64,
    },
    /// A packing without spheres where some are needed.
    #[error("the packing has no spheres")]
    Empty,
    /// A line of a sphere file that is not four numbers.
    #[error("line {line}: {reason}: {text:?}{others}")]
    BadLine {
        /// Line number, from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
        /// Beginning of the line.
        text: String,
        /// The numbers of further lines that are wrong, as the end of the message.
        others: String,
    },
    /// Reading or writing failed.
    #[error("{action}: {source}")]
    Io {
        /// Failed action, with its object.
        action: String,
        /// Error of the system.
        source: std::io::Error,
    },
    /// Too many spheres for random positions without contact.
    #[error(
        "no place for a sphere of radius {radius} m in a periodic cube of edge {edge} m with {placed} spheres after \
         {attempts} attempts"
    )]
    NoRoom {
        /// Number of spheres placed before.
        placed: usize,
        /// Radius of the sphere that does not fit, m.
        radius: f64,
        /// Edge of the cell, m.
        edge: f64,
        /// Number of positions tried.
        attempts: usize,
    },
    /// No place for an aggregate or a pore.
    #[error(
        "no place for inclusion {} of {count} (size {size:.4e} m) after {attempts} attempts: the inclusions before it fill \
         {reached:.4} of the volume, all would fill {wanted:.4}",
        number + 1
    )]
    NoPlace {
        /// Number of the inclusion, from 0.
        number: usize,
        /// Number of all inclusions to place.
        count: usize,
        /// Its size, m.
        size: f64,
        /// Number of places tried.
        attempts: u32,
        /// Volume fraction of the inclusions placed before.
        reached: f64,
        /// Volume fraction of all inclusions to place.
        wanted: f64,
    },
    /// A compaction that did not finish.
    #[error(
        "the compaction has not settled after {steps} steps: in the {stage} the pressure is {pressure} of the modulus \
         (wanted {goal}) and the unbalanced force {unbalanced}"
    )]
    NotSettled {
        /// Steps done.
        steps: u64,
        /// `"compression"` or `"release"`.
        stage: &'static str,
        /// Pressure over modulus.
        pressure: f64,
        /// Target pressure over modulus.
        goal: f64,
        /// Unbalanced force.
        unbalanced: f64,
    },
    /// A target of a packing between walls that is out of reach.
    #[error(
        "{name} {wanted} was not reached; the best is {best:.4}, at mean overlaps up to {overlap} of the mean radius: choose a lower \
         target"
    )]
    TargetNotReached {
        /// What the target is.
        name: &'static str,
        /// Its value.
        wanted: f64,
        /// Best value reached.
        best: f64,
        /// Mean overlap over mean radius at which the search ends.
        overlap: f64,
    },
    /// Spheres that were pressed through the walls.
    #[error(
        "the target presses spheres through the walls: {lost} were lost, {left} are left; choose a lower target, or finer spheres"
    )]
    Leaking {
        /// Number of spheres lost.
        lost: usize,
        /// Number of spheres inside.
        left: usize,
    },
    /// Spheres between walls that do not come to rest.
    #[error(
        "the spheres are not at rest after {steps} steps: the unbalanced force is {unbalanced:.3e} (wanted {goal}); give another \
         seed"
    )]
    NotAtRest {
        /// Steps of this relaxation.
        steps: u64,
        /// Unbalanced force.
        unbalanced: f64,
        /// Unbalanced force at rest.
        goal: f64,
    },
    /// Discs that do not come to rest.
    #[error("the discs have not come to rest after {steps} steps; give another seed")]
    Restless {
        /// Steps done.
        steps: u64,
    },
    /// A parameter of the contact law used for compaction is out of range.
    #[error(transparent)]
    Law(#[from] concordem_contact::law::common::ParameterError),
    /// The solver failed during compaction.
    #[error("compaction: {0}")]
    Solver(#[from] concordem_solver::SolverError),
    /// The neighbor search rejected the packing.
    #[error(transparent)]
    Neighbor(#[from] NeighborError),
}

impl Packing {
    /// Volume of all spheres, m³ (overlaps counted twice).
    pub fn solid_volume(&self) -> f64 {
        self.spheres.iter().map(|s| 4.0 / 3.0 * std::f64::consts::PI * s.radius * s.radius * s.radius).sum()
    }

    /// Solid fraction: solid volume over cell volume; `None` without a cell.
    pub fn packing_fraction(&self) -> Option<f64> {
        self.cell.map(|cell| self.solid_volume() / cell.volume())
    }

    /// Area of all discs over the area of the plane cell, whose third edge is along z; `None` without a cell.
    pub fn area_fraction(&self) -> Option<f64> {
        let discs: f64 = self.spheres.iter().map(|s| std::f64::consts::PI * s.radius * s.radius).sum();
        self.cell.map(|cell| discs * cell.matrix[(2, 2)].abs() / cell.volume())
    }

    /// Positions of all spheres, m.
    pub fn positions(&self) -> Vec<Vec3> {
        self.spheres.iter().map(|s| s.position).collect()
    }

    /// Wrap all positions into the cell, so that they are `H s` with `0 ≤ s < 1`. No effect without a cell.
    pub fn wrap(&mut self) {
        let Some(cell) = self.cell else { return };
        let Some(inverse) = cell.matrix.try_inverse() else { return };
        for sphere in &mut self.spheres {
            sphere.position -= cell.matrix * (inverse * sphere.position).map(f64::floor);
        }
    }

    /// Move all spheres so that the first lies at the origin, and wrap.
    pub fn center_on_first(&mut self) {
        let Some(first) = self.spheres.first().map(|s| s.position) else { return };
        for sphere in &mut self.spheres {
            sphere.position -= first;
        }
        self.wrap();
    }
}

/// An error if the number is not positive and finite.
pub(crate) fn positive(name: &'static str, value: f64) -> Result<f64, PackingError> {
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(PackingError::NotPositive { name, value }) }
}

/// An error if the number is outside `low..=high`.
pub(crate) fn within(name: &'static str, value: f64, low: f64, high: f64) -> Result<f64, PackingError> {
    if value >= low && value <= high { Ok(value) } else { Err(PackingError::OutOfRange { name, value, low, high }) }
}

/// An error if so many spheres cannot be numbered, or if their list does not fit into memory.
pub(crate) fn affordable(count: f64) -> Result<(), PackingError> {
    const LIMIT: f64 = 4.0e9;
    if count.is_nan() || count > LIMIT {
        return Err(PackingError::TooMany { count, limit: LIMIT });
    }
    memory::affordable_bytes(&format!("{count:.4e} spheres"), count * memory::SPHERE)
}

/// An error if the compaction of so many spheres does not fit into memory.
pub(crate) fn compactable(count: f64) -> Result<(), PackingError> {
    affordable(count)?;
    memory::affordable_bytes(&format!("the compaction of {count:.4e} spheres"), count * memory::COMPACTED)
}

/// Mass (kg) and moment of inertia (kg·m²) of a sphere, or of a disc of unit depth.
pub fn mass_of(radius: f64, density: f64, planar: bool) -> (f64, f64) {
    use std::f64::consts::PI;
    if planar {
        let mass = density * PI * radius * radius;
        (mass, 0.5 * mass * radius * radius)
    } else {
        let mass = density * 4.0 / 3.0 * PI * radius * radius * radius;
        (mass, 0.4 * mass * radius * radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disc of unit depth has ½mr², a sphere ⅖mr². Roundings of a few products.
    #[test]
    fn discs_and_spheres_have_their_moments_of_inertia() {
        let (mass, inertia) = mass_of(2.0, 3.0, true);
        assert!((mass / (12.0 * std::f64::consts::PI) - 1.0).abs() < 1e-15 && inertia == 2.0 * mass);
        let (mass, inertia) = mass_of(2.0, 3.0, false);
        assert!((mass / (32.0 * std::f64::consts::PI) - 1.0).abs() < 1e-15, "{mass}");
        assert!((inertia / (1.6 * mass) - 1.0).abs() < 1e-15, "{inertia}");
    }
}

/// The code of the README is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
