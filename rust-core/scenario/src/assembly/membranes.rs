//! Finds the faces of membranes: the border of the space between the particles.
//!
//! The Delaunay cells of the centers fill their convex hull. From outside, cells are removed whose circumscribed sphere, which is empty
//! of centers, is wider than the reach of the membrane; so it sinks into wide gaps at the surface, but does not enter pores inside. The
//! border of the cells that remain is closed, so that pressure on it has neither a resultant force nor a moment.

use super::motions::history;
use super::selection::{bounds_along, extents, layer};
use super::{AssemblyError, unfit};
use crate::schedule::Membrane;
use crate::schema::{self, End, Quantity, Scenario};
use concordem_contact::math::Vec3;
use concordem_operator::strain::Dimension;
use concordem_operator::tessellation::{Mesh, delaunay};
use concordem_solver::state::Particles;

/// Reach of a membrane over the largest radius. Between touching spheres of one size, empty spheres through the centers have at most
/// 1.73 radii (simple cubic), in random packings some 2.
const REACH: f64 = 2.5;

/// The membranes of a scenario; their places in the list of loads are still empty.
pub(super) fn build(scenario: &Scenario, particles: &Particles) -> Result<Vec<Membrane>, AssemblyError> {
    if scenario.membranes.is_empty() {
        return Ok(Vec::new());
    }
    let planar = scenario.dimension == 2;
    let dimension = if planar { Dimension::Two } else { Dimension::Three };
    let mesh = delaunay(&particles.position, dimension, None)
        .map_err(|error| unfit("membrane", format!("the centers of the particles have no surface: {error}")))?;
    scenario
        .membranes
        .iter()
        .enumerate()
        .map(|(number, membrane)| one(scenario, particles, &mesh, number, membrane))
        .collect()
}

fn one(
    scenario: &Scenario,
    particles: &Particles,
    mesh: &Mesh,
    number: usize,
    membrane: &schema::Membrane,
) -> Result<Membrane, AssemblyError> {
    let planar = scenario.dimension == 2;
    let largest = particles.radius.iter().copied().fold(0.0, f64::max);
    let reach = membrane.reach.map_or(REACH * largest, Quantity::si);
    let mut faces = border(mesh, &particles.position, reach);
    if faces.is_empty() {
        let message =
            format!("encloses nothing: all gaps between the particles are wider than its reach of {reach:e} m");
        return Err(unfit(&format!("membrane[{number}].reach"), message));
    }
    if let Some(axis) = membrane.open_along {
        let axis = axis.index();
        let (low, high) = bounds_along(extents(particles, axis));
        let thickness = 2.0 * particles.mean_radius();
        let mut at_end = vec![[false; 2]; particles.len()];
        for (side, end) in [End::Minimum, End::Maximum].into_iter().enumerate() {
            for p in layer(extents(particles, axis), end, thickness) {
                at_end[p][side] = true;
            }
        }
        faces.retain(|face| [0, 1].iter().all(|&side| face.iter().any(|&p| !at_end[p as usize][side])));
        if faces.is_empty() {
            let message = format!("leaves out everything: the specimen is only {} m long along this axis", high - low);
            return Err(unfit(&format!("membrane[{number}].open_along"), message));
        }
    }
    let history = membrane.history.as_deref().and_then(|name| history(scenario, name));
    Ok(Membrane { pressure: membrane.pressure.si(), history, places: Vec::new(), faces, planar, reach })
}

/// Faces of the border of the cells that remain, counterclockwise seen from outside; lines repeat their second corner.
fn border(mesh: &Mesh, position: &[Vec3], reach: f64) -> Vec<[u32; 3]> {
    let size = if mesh.dimension() == Dimension::Two { 3 } else { 4 };
    let corners = |cell: usize| mesh.cell(cell).iter().map(|corner| corner.point);
    // Faces by their sorted corners, with the cell and the opposite corner.
    let mut all: Vec<([u32; 3], usize, usize)> = Vec::with_capacity(mesh.len() * size);
    for cell in 0..mesh.len() {
        for opposite in 0..size {
            all.push((face_of(&corners(cell).collect::<Vec<_>>(), opposite).0, cell, opposite));
        }
    }
    all.sort_unstable();
    // Neighbor of each cell behind each of its faces.
    let mut behind = vec![[usize::MAX; 4]; mesh.len()];
    for pair in all.windows(2) {
        let [(a, cell, face), (b, other, opposite)] = [pair[0], pair[1]];
        if a == b {
            behind[cell][face] = other;
            behind[other][opposite] = cell;
        }
    }
    let wide = |cell: usize| {
        let places: Vec<Vec3> = corners(cell).map(|p| position[p as usize]).collect();
        // A flat cell has no such sphere.
        circumradius(&places).is_none_or(|radius| radius > reach)
    };
    let mut removed = vec![false; mesh.len()];
    let outside = |cell: usize| behind[cell][..size].contains(&usize::MAX);
    let mut front: Vec<usize> = (0..mesh.len()).filter(|&cell| outside(cell) && wide(cell)).collect();
    for &cell in &front {
        removed[cell] = true;
    }
    while let Some(cell) = front.pop() {
        for &next in &behind[cell][..size] {
            if next != usize::MAX && !removed[next] && wide(next) {
                removed[next] = true;
                front.push(next);
            }
        }
    }
    let mut faces = Vec::new();
    for cell in (0..mesh.len()).filter(|&cell| !removed[cell]) {
        for (opposite, &next) in behind[cell][..size].iter().enumerate() {
            if next == usize::MAX || removed[next] {
                faces.push(face_of(&corners(cell).collect::<Vec<_>>(), opposite).1);
            }
        }
    }
    faces
}

/// The face of a positively oriented cell opposite to a corner: its corners sorted, and in counterclockwise order seen from outside.
fn face_of(cell: &[u32], opposite: usize) -> ([u32; 3], [u32; 3]) {
    // Outward faces of the corners 0 1 2 3, whose first three edges are right-handed, and of the triangle 0 1 2.
    const SOLID: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
    const FLAT: [[usize; 3]; 3] = [[1, 2, 2], [2, 0, 0], [0, 1, 1]];
    let outward = if cell.len() == 4 { SOLID[opposite] } else { FLAT[opposite] }.map(|k| cell[k]);
    let mut sorted = outward;
    sorted.sort_unstable();
    if cell.len() == 3 {
        sorted = [outward[0].min(outward[1]), outward[0].max(outward[1]), u32::MAX];
    }
    (sorted, outward)
}

/// Radius of the sphere (circle) through the corners of a tetrahedron (triangle), m; `None` if it is flat.
fn circumradius(x: &[Vec3]) -> Option<f64> {
    let edge = |k: usize| x[k] - x[0];
    let (a, b) = (edge(1), edge(2));
    let radius = if x.len() == 3 {
        a.norm() * b.norm() * (a - b).norm() / (2.0 * a.cross(&b).norm())
    } else {
        let c = edge(3);
        let sum = b.cross(&c) * a.norm_squared() + c.cross(&a) * b.norm_squared() + a.cross(&b) * c.norm_squared();
        sum.norm() / (2.0 * a.dot(&b.cross(&c)).abs())
    };
    radius.is_finite().then_some(radius)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit tetrahedron with right angles: the sphere through its corners has the radius √3/2, the faces point outward, and their
    /// areas sum to zero. The circle through a right triangle has half the hypotenuse.
    #[test]
    fn faces_point_outward() {
        let x = [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()];
        assert!((circumradius(&x).unwrap() - 0.75_f64.sqrt()).abs() < 1e-15);
        assert!((circumradius(&x[..3]).unwrap() - 0.5_f64.sqrt()).abs() < 1e-15);
        assert_eq!(circumradius(&[x[0], x[1], x[2], Vec3::new(0.3, 0.2, 0.0)]), None);
        let mut sum = Vec3::zeros();
        for opposite in 0..4 {
            let [a, b, c] = face_of(&[0, 1, 2, 3], opposite).1.map(|p| x[p as usize]);
            let area = (b - a).cross(&(c - a)) * 0.5;
            assert!(area.dot(&(a - x[opposite])) > 0.0, "{opposite}");
            sum += area;
        }
        assert!(sum.norm() < 1e-15);
    }
}
