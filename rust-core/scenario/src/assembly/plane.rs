//! Plane scenarios: packings in the plane z = 0, whose periodic cell has unit depth.

use super::{AssemblyError, unfit};
use concordem_packing::Packing;

/// Depth of discs and of plane periodic cells, m.
const DEPTH: f64 = 1.0;

/// Refuses packings that are not in the plane, and periodic cells that are not an upright prism of unit depth.
pub(super) fn check(packing: &Packing) -> Result<(), AssemblyError> {
    if let Some((at, sphere)) = packing.spheres.iter().enumerate().find(|(_, sphere)| sphere.position.z != 0.0) {
        let message = format!(
            "sphere {at} lies at z = {:?} m, but with dimension = 2 all centers lie in the plane z = 0; write 0 in the third \
             column, or use dimension = 3",
            sphere.position.z
        );
        return Err(unfit("packing", message));
    }
    let Some(cell) = &packing.cell else { return Ok(()) };
    let edges = &cell.matrix;
    let tilted = [(2, 0), (2, 1), (0, 2), (1, 2)].into_iter().any(|place| edges[place] != 0.0);
    if tilted || edges[(2, 2)] != DEPTH {
        let message = format!(
            "the periodic cell is {:?} m deep along z{}, but with dimension = 2 it is {DEPTH} m deep, as the discs are; \
             write packing.cell = [\"{:?} m\", \"{:?} m\", 1]",
            edges[(2, 2)],
            if tilted { " and leans out of the plane" } else { "" },
            edges[(0, 0)],
            edges[(1, 1)]
        );
        return Err(unfit("packing", message));
    }
    Ok(())
}

/// Refuses discs that would reach their own images one depth away along z.
///
/// `reach`: largest center distance of a bond or contact, divided by the sum of the radii.
pub(super) fn check_reach(packing: &Packing, reach: f64) -> Result<(), AssemblyError> {
    let largest = packing.spheres.iter().fold(0.0_f64, |largest, sphere| largest.max(sphere.radius));
    let distance = 2.0 * largest * reach.max(1.0);
    if packing.cell.is_none() || distance < DEPTH {
        return Ok(());
    }
    let message = format!(
        "discs reach {distance:?} m far, and the plane periodic cell is {DEPTH} m deep: they would touch their own images along \
         z; scale all lengths down, for example to millimeters"
    );
    Err(unfit("packing", message))
}
