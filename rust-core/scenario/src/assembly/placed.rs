//! A packing, with what the later stages and reports need to know of its making.

use concordem_packing::bonding::{ratio_for_coordination, ratio_inside};
use concordem_packing::cooker::Measured;
use concordem_packing::{Packing, Shape};
use concordem_solver::neighbor::NeighborError;

/// A packing with the shape that was cut out of it.
pub struct Placed {
    /// The spheres, and the periodic cell if there is one.
    pub packing: Packing,
    /// Solid volume divided by volume (in the plane: area of the discs divided by area), of the periodic cell or of the
    /// packing before it was cut.
    pub packing_fraction: Option<f64>,
    /// Cross-sections of the shape perpendicular to x, y, z, m².
    pub cross_sections: Option<[f64; 3]>,
    /// The periodic packing that `packing` was cut from, if any.
    pub unit: Option<Packing>,
    /// The shape that was cut out or filled, if any.
    pub body: Option<Shape>,
    /// The packing between walls, if it is one.
    pub walled: Option<Walled>,
}

impl Placed {
    /// A packing that nothing was cut out of.
    pub(super) fn without_shape(packing: Packing) -> Self {
        Self { packing, packing_fraction: None, cross_sections: None, unit: None, body: None, walled: None }
    }

    /// Interaction ratio at which the packing has `coordination` bonds per particle, and the coordination number reached: of the periodic
    /// packing, of the particles inside a packing between walls, or of all particles. `None` if there are too few pairs.
    ///
    /// # Errors
    /// Input that the neighbor search rejects.
    pub fn ratio_for_coordination(&self, coordination: f64) -> Result<Option<(f64, f64)>, NeighborError> {
        if let Some(walled) = &self.walled {
            return ratio_inside(&self.packing.spheres, None, &walled.boundary, coordination);
        }
        let whole = self.unit.as_ref().unwrap_or(&self.packing);
        ratio_for_coordination(&whole.spheres, whole.cell.as_ref(), coordination)
    }
}

/// Facts about a packing between walls.
pub struct Walled {
    /// Whether each sphere belongs to the boundary: nearer to a wall than two mean radii.
    pub boundary: Vec<bool>,
    /// Links that become bonds, as pairs of spheres, if the packing determines them.
    pub network: Option<Vec<[u32; 2]>>,
    /// Interaction ratio that gives the network, with enlarged radii.
    pub interaction_ratio: Option<f64>,
    /// How a cooker packing was made.
    pub cooked: Option<Cooking>,
}

/// How a cooker packing was made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cooking {
    /// Before the walls softened.
    pub filled: Measured,
    /// At the end.
    pub last: Measured,
    /// Mean number of links of a sphere inside.
    pub links_inside: f64,
    /// Forced insertions.
    pub packets: usize,
    /// Spheres that were pushed through a wall and removed.
    pub lost: usize,
    /// Time steps of all relaxations.
    pub steps: u64,
}
