//! Characterisation of a packing: coordination, density, sizes, directions, order (Jebahi et al. 2015, section 2.3.2).
//!
//! [`Body`] is a packing with its links and the shape that bounds it, read from a sphere file, a result, or a scenario.
//! [`characterise`] measures it; [`Characteristics::json`] and the report show the results.

mod body;
mod density;
mod json;
mod network;
mod phases;
mod study;
#[cfg(test)]
mod tests;

pub use body::{Body, Choice, Links};
pub use density::{Cells, Density};
pub use network::Network;
pub use phases::PhaseShare;
pub(crate) use study::structure;

use std::path::PathBuf;

use concordem_operator::OperatorError;
use concordem_operator::structure::{Layers, PairCorrelation, Sizes, sizes};
use concordem_packing::PackingError;
use concordem_scenario::assembly::AssemblyError;
use concordem_scenario::schema::ReadError;
use concordem_solver::neighbor::NeighborError;

use crate::output::OutputError;

/// Classes of a histogram of radii.
const CLASSES: usize = 24;

/// Why a packing cannot be characterised.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CharacteriseError {
    /// The file is no packing.
    #[error("{} cannot be read as a packing: {problem}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// A choice that does not fit the packing.
    #[error("{0}")]
    Choice(String),
    /// The scenario is invalid.
    #[error(transparent)]
    Scenario(#[from] ReadError),
    /// The packing of the scenario cannot be made.
    #[error(transparent)]
    Assembly(#[from] AssemblyError),
    /// The result cannot be read.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The packing cannot be measured.
    #[error(transparent)]
    Packing(#[from] PackingError),
    /// A measure rejects the packing.
    #[error(transparent)]
    Operator(#[from] OperatorError),
    /// The neighbor search rejects the packing.
    #[error(transparent)]
    Neighbor(#[from] NeighborError),
}

/// All measures of a packing.
#[derive(Debug, Clone, PartialEq)]
pub struct Characteristics {
    /// Name of the file.
    pub name: String,
    /// Number of spheres.
    pub spheres: usize,
    /// What the links are.
    pub links: Links,
    /// Distance from the surface up to which spheres belong to the boundary, m; `None` for a periodic packing.
    pub boundary_depth: Option<f64>,
    /// Radii.
    pub sizes: Sizes,
    /// Links: coordination, lengths, directions, fabric.
    pub network: Network,
    /// Solid fractions.
    pub density: Density,
    /// Solid fraction and links by depth; `None` for a periodic packing.
    pub layers: Option<Layers>,
    /// Pair correlation function; `None` if the packing is too small.
    pub pair_correlation: Option<PairCorrelation>,
    /// Materials and aggregates of a result or a scenario; empty for other files.
    pub phases: Vec<PhaseShare>,
    /// With aggregates (or fibers): links within the mortar, within aggregates, between mortar and aggregates, and between two aggregates.
    pub links_by_phase: Option<[usize; 4]>,
}

/// Measures a packing; `boundary`: spheres with their centers nearer to the surface than this many mean radii belong to the boundary.
///
/// # Errors
/// A packing without spheres, or with numbers that are not finite.
pub fn characterise(body: &Body, boundary: f64) -> Result<Characteristics, CharacteriseError> {
    if !(boundary >= 0.0 && boundary.is_finite()) {
        let message = format!("the boundary depth is {boundary} mean radii; it must be finite and not negative");
        return Err(CharacteriseError::Choice(message));
    }
    let radius: Vec<f64> = body.packing.spheres.iter().map(|sphere| sphere.radius).collect();
    let sizes = sizes(&radius, CLASSES)?;
    let surface = density::Surface::of(body)?;
    let depth = boundary * sizes.mean;
    let outer: Vec<bool> =
        body.packing.spheres.iter().map(|sphere| surface.is_nearer(&sphere.position, depth)).collect();
    let network = Network::of(body, &outer)?;
    let density = Density::of(body, &surface, &outer)?;
    let layers = density::layers_of(body, &surface, sizes.mean)?;
    let pair_correlation = density::correlation_of(body, &surface, &density, sizes.mean)?;
    Ok(Characteristics {
        name: body.name.clone(),
        spheres: radius.len(),
        links: body.kind,
        boundary_depth: body.packing.cell.is_none().then_some(depth),
        sizes,
        network,
        density,
        layers,
        pair_correlation,
        phases: phases::shares(body),
        links_by_phase: phases::links(body),
    })
}
