//! Division of space by the particles' centers: Delaunay triangulations and power diagrams.

mod delaunay;
mod mesh;
mod power;

pub use delaunay::delaunay;
pub(super) use mesh::face_area;
pub use mesh::{Corner, Mesh};
pub use power::{Domain, Face, Neighbor, Polygon, PowerDiagram, power_diagram, power_polygons};

use super::error::{OperatorError, check_finite};
use concordem_contact::math::{Mat3, Vec3};

/// Mean distance of points: the edge of the cube (square in the plane) per point, m.
fn spacing(volume: f64, count: usize, plane: bool) -> f64 {
    let each = volume / count.max(1) as f64;
    if plane { each.sqrt() } else { concordem_contact::math::cbrt(each) }
}

/// An error if points are not finite or coincide; in the plane their coordinate z does not count.
fn check_points(position: &[Vec3], plane: bool) -> Result<(), OperatorError> {
    check_finite("position", position)?;
    let mut order: Vec<u32> = (0..position.len() as u32).collect();
    // With 0 for −0, which are the same place but not in the order of bits.
    let key = |p: u32| {
        let x = position[p as usize];
        Vec3::new(x.x, x.y, if plane { 0.0 } else { x.z }).add_scalar(0.0)
    };
    order.sort_unstable_by(|&p, &q| {
        let (x, y) = (key(p), key(q));
        x.x.total_cmp(&y.x).then(x.y.total_cmp(&y.y)).then(x.z.total_cmp(&y.z)).then(p.cmp(&q))
    });
    match order.windows(2).find(|w| key(w[0]) == key(w[1])) {
        Some(w) => Err(OperatorError::Coincident { first: w[0] as usize, second: w[1] as usize }),
        None => Ok(()),
    }
}

/// Points moved into the periodic cell at the origin, and the number of edges each was moved by. In the plane z becomes 0: rounding
/// can make it negative, which is the cell below.
fn wrapped(position: &[Vec3], edges: &Mat3, plane: bool) -> Result<(Vec<Vec3>, Vec<[i32; 3]>), OperatorError> {
    let inverse = edges.try_inverse().ok_or(OperatorError::Volume { of: "the periodic cell", volume: 0.0 })?;
    let mut out = Vec::with_capacity(position.len());
    let mut cells = Vec::with_capacity(position.len());
    for x in position {
        let s = inverse * x;
        let cell = [s.x.floor(), s.y.floor(), if plane { 0.0 } else { s.z.floor() }];
        let mut home = x - edges * Vec3::from(cell);
        if plane {
            home.z = 0.0;
        }
        out.push(home);
        cells.push(cell.map(|c| c as i32));
    }
    Ok((out, cells))
}
