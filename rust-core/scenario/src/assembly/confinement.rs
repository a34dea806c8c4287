//! Finds what presses on the sides of a loaded specimen.

use super::selection::{bounds_along, extents};
use crate::schedule::loading::Gauge;
use crate::schedule::{Confinement, Loading, Side, Sides};
use crate::schema::Scenario;
use concordem_contact::math::Vec3;
use concordem_solver::state::State;

/// Sine of the largest angle between the axes of the loading and of a cylinder around the specimen.
const PARALLEL: f64 = 1e-9;

/// What presses on the sides; `None` where the sides are free, where the loading has no axis, and where a wall is no box and no cylinder
/// along it.
pub(super) fn of(scenario: &Scenario, loading: &Loading, state: &State) -> Option<Confinement> {
    let axes = usize::from(scenario.dimension);
    let across = |axis: usize| (0..axes).filter(move |other| *other != axis);
    let (axis, gauge, length) = match loading {
        Loading::CellStrain { .. } | Loading::CellStress { .. } => {
            let (axis, column) = loading.component(state);
            let lateral = across(axis).map(|axis| (axis, Gauge::default())).collect();
            let is_axial = axis == column && is_confined_cell(loading, axis);
            return is_axial.then_some(Confinement { sides: Sides::Cell, lateral });
        }
        Loading::Uniaxial { axis, gauge, length, .. } => (*axis, gauge, *length),
        // On a cylinder that splits, plates press across its axis.
        Loading::Platens { axis, gauge, length, sign, .. } if *sign > 0.0 => (*axis, gauge, *length),
        _ => return None,
    };
    let lateral = across(axis).map(|axis| (axis, gauge.turned(state, axis))).collect();
    let sides = if scenario.membranes.is_empty() {
        let (low, high) = bounds_along(extents(&state.particles, axis));
        Sides::Walls(walls(scenario, state, axis)?, [high - low, length])
    } else {
        Sides::Membranes
    };
    Some(Confinement { sides, lateral })
}

/// Whether other axes of the cell keep their length or a stress.
fn is_confined_cell(loading: &Loading, driven: usize) -> bool {
    match loading {
        Loading::CellStrain { velocity_gradient, .. } => {
            let others = (0..9).map(|k| (k / 3, k % 3)).filter(|place| *place != (driven, driven));
            others.into_iter().all(|place| velocity_gradient[place] == 0.0)
        }
        Loading::CellStress { stress, strain_rate, .. } => {
            let moving = (0..3).filter(|axis| strain_rate[*axis].is_some()).count();
            moving == 1 && (0..3).any(|axis| axis != driven && stress[(axis, axis)] != 0.0)
        }
        _ => false,
    }
}

/// The enclosing walls at the sides of the specimen.
fn walls(scenario: &Scenario, state: &State, axis: usize) -> Option<Vec<Side>> {
    let plane = scenario.dimension == 2;
    let mut sides = Vec::new();
    let mut first = 0;
    for wall in &scenario.walls {
        let kind = wall.shape.kind();
        let faces = kind.faces().len();
        if kind.encloses() {
            if let (Some(direction), Some(center)) = (kind.axis(), kind.point()) {
                let mut along = Vec3::zeros();
                along[axis] = 1.0;
                if plane || direction.cross(&along).norm() > PARALLEL {
                    return None;
                }
                sides.push(Side::Round(first, state.walls[first].distance(0, &center)));
            } else {
                // The faces of a box are in pairs along x, y, z.
                let lateral: Vec<usize> = (0..if plane { 2 } else { 3 }).filter(|other| *other != axis).collect();
                for &normal in &lateral {
                    let ends = lateral.iter().find(|other| **other != normal);
                    let ends = ends.map(|end| [first + 2 * end, first + 2 * end + 1]);
                    sides.extend([0, 1].map(|face| Side::Flat(first + 2 * normal + face, ends)));
                }
            }
        }
        first += faces;
    }
    (!sides.is_empty()).then_some(sides)
}
