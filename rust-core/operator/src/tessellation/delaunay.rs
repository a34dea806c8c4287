//! Delaunay triangulation, periodic or not, with exact predicates.
//!
//! The crate `simple_delaunay_lib` is used in space, `spade` in the plane. Both use the adaptive exact predicates of
//! `robust`.

use simple_delaunay_lib::delaunay_3d::delaunay_struct_3d::DelaunayStructure3D;
use simple_delaunay_lib::delaunay_3d::simplicial_struct_3d::Node;
use spade::Triangulation;

use super::mesh::{Corner, Mesh};
use super::{check_points, spacing, wrapped};
use crate::error::OperatorError;
use crate::interruption::look;
use crate::strain::Dimension;
use concordem_contact::math::{Mat3, Vec3};

/// Delaunay triangulation of points (m): the convex hull is filled with tetrahedra (triangles in the plane z = 0), or, with
/// the edge vectors of a periodic cell (m, as columns), all of periodic space.
///
/// If more than four points lie on a sphere, the triangulation is one of several; averages do not depend on the choice.
/// In a periodic cell such ties are broken by shifting the points by 1e-7 of their spacing, only for the choice of the
/// cells. The positions stay. So cells of zero volume, or of a volume negative by rounding, may occur.
pub fn delaunay(position: &[Vec3], dimension: Dimension, periodic: Option<&Mat3>) -> Result<Mesh, OperatorError> {
    check_points(position, dimension == Dimension::Two)?;
    match periodic {
        None => {
            let cells = triangulate(position, dimension)?;
            let corners = cells.into_iter().map(|point| Corner { point, image: [0; 3] }).collect();
            Mesh::new(dimension, position.len(), false, corners)
        }
        Some(edges) => triangulate_periodic(position, dimension, edges),
    }
}

/// Corners of all cells, one cell after the other.
fn triangulate(position: &[Vec3], dimension: Dimension) -> Result<Vec<u32>, OperatorError> {
    if dimension == Dimension::Two { triangles(position) } else { tetrahedra(position) }
}

fn triangles(position: &[Vec3]) -> Result<Vec<u32>, OperatorError> {
    let points = position.iter().map(|x| spade::Point2::new(x.x, x.y)).collect();
    let mesh = spade::DelaunayTriangulation::<spade::Point2<f64>>::bulk_load_stable(points)
        .map_err(|error| OperatorError::Triangulation { reason: error.to_string() })?;
    if mesh.num_inner_faces() == 0 {
        return Err(flat(position.len(), Dimension::Two));
    }
    let corners = mesh.inner_faces().flat_map(|face| face.vertices().map(|v| v.fix().index() as u32));
    Ok(corners.collect())
}

fn flat(points: usize, dimension: Dimension) -> OperatorError {
    let two = dimension == Dimension::Two;
    OperatorError::Flat {
        points,
        dimension: if two { 2 } else { 3 },
        ratio: 0.0,
        needed: if two { 3 } else { 4 },
        flat: if two { "line" } else { "plane" },
    }
}

fn orientation(x: [&Vec3; 4]) -> f64 {
    let [a, b, c, d] = x.map(|x| robust::Coord3D { x: x.x, y: x.y, z: x.z });
    robust::orient3d(a, b, c, d)
}

/// Four points that do not lie in a plane, far apart.
fn first_tetrahedron(position: &[Vec3]) -> Option<[usize; 4]> {
    let farthest = |measure: &dyn Fn(&Vec3) -> f64| {
        let mut best = (0, 0.0);
        for (p, x) in position.iter().enumerate() {
            let m = measure(x);
            if m > best.1 {
                best = (p, m);
            }
        }
        (best.1 > 0.0).then_some(best.0)
    };
    let x0 = position.first()?;
    let second = farthest(&|x| (x - x0).norm_squared())?;
    let along = position[second] - x0;
    let third = farthest(&|x| (x - x0).cross(&along).norm_squared())?;
    let fourth = farthest(&|x| orientation([x0, &position[second], &position[third], x]).abs())?;
    Some([0, second, third, fourth])
}

/// Points that are inserted before the next look whether the work shall stop: half a second.
const INSERTED: usize = 50_000;

fn tetrahedra(position: &[Vec3]) -> Result<Vec<u32>, OperatorError> {
    let failed = |error: &dyn std::fmt::Display| OperatorError::Triangulation { reason: error.to_string() };
    let first = first_tetrahedron(position).ok_or_else(|| flat(position.len(), Dimension::Three))?;
    // The library starts from the first points in the list and requires four that are not in a plane.
    let mut order = first.to_vec();
    order.extend((0..position.len()).filter(|p| !first.contains(p)));
    let places: Vec<[f64; 3]> = order.iter().map(|&p| position[p].into()).collect();
    let mut structure = DelaunayStructure3D::new();
    structure.insert_vertices(&places[..4].to_vec(), false).map_err(|error| failed(&error))?;
    for places in places[4..].chunks(INSERTED) {
        look();
        structure.insert_vertices(&places.to_vec(), true).map_err(|error| failed(&error))?;
    }
    look();
    let mesh = structure.get_simplicial();
    let mut corners = Vec::with_capacity(4 * mesh.get_nb_tetrahedra());
    for k in 0..mesh.get_nb_tetrahedra() {
        let nodes = mesh.get_tetrahedron(k).map_err(|error| failed(&error))?.nodes();
        let mut cell = [0; 4];
        let mut finite = true;
        for (corner, node) in cell.iter_mut().zip(nodes) {
            match node {
                Node::Value(v) => *corner = order[v] as u32,
                Node::Infinity => finite = false,
            }
        }
        if finite {
            // The library orients the other way round.
            cell.swap(2, 3);
            corners.extend(cell);
        }
    }
    Ok(corners)
}

/// Relative accuracy to which the volumes of the cells must add up to that of the periodic cell: 1e6 cells with
/// roundings of 1e-16 each, relative to the volume of a cell or more, stay well below.
const FILLED: f64 = 1e-9;

fn triangulate_periodic(position: &[Vec3], dimension: Dimension, edges: &Mat3) -> Result<Mesh, OperatorError> {
    let plane = dimension == Dimension::Two;
    let mut edges = *edges;
    if plane {
        edges[(2, 2)] = 1.0;
    }
    let volume = super::super::error::check_volume("the periodic cell", edges.determinant().abs())?;
    if position.is_empty() {
        return Err(OperatorError::EmptyRegion { what: "particle" });
    }
    let (home, cells) = wrapped(position, &edges, plane)?;
    let step = spacing(volume, position.len(), plane);
    let inverse = edges.try_inverse().unwrap_or_else(Mat3::identity);
    let mut outcome = Err(OperatorError::PeriodicGap { found: 0.0, expected: volume });
    // Images up to three spacings beyond the cell suffice for most packings; two whole cells for all that are not
    // sparse.
    for (attempt, reach) in [3.0, 6.0, f64::INFINITY].into_iter().enumerate() {
        let margin = |k: usize| {
            let width = 1.0 / inverse.row(k).norm();
            if plane && k == 2 { 0.0 } else { (reach * step / width).min(2.0) }
        };
        let margin = [margin(0), margin(1), margin(2)];
        let jittered: Vec<Vec3> =
            home.iter().enumerate().map(|(p, x)| x + jitter(p, attempt, plane) * (1e-7 * step)).collect();
        outcome = periodic_cells(&jittered, &inverse, &edges, margin, dimension).and_then(|corners| {
            let corners = corners
                .into_iter()
                .map(|mut corner| {
                    for (i, c) in corner.image.iter_mut().zip(cells[corner.point as usize]) {
                        *i -= c;
                    }
                    corner
                })
                .collect();
            let mesh = Mesh::new(dimension, position.len(), true, corners)?;
            let period = super::super::Period::of(edges);
            let found: f64 = (0..mesh.len()).map(|k| mesh.geometry(k, position, Some(&period)).0).sum();
            if (found - volume).abs() > FILLED * volume {
                return Err(OperatorError::PeriodicGap { found, expected: volume });
            }
            Ok(mesh)
        });
        if outcome.is_ok() {
            break;
        }
    }
    outcome
}

/// Cells of the triangulation of points and their images, those with the smallest corner in the cell at the origin.
fn periodic_cells(
    home: &[Vec3],
    inverse: &Mat3,
    edges: &Mat3,
    margin: [f64; 3],
    dimension: Dimension,
) -> Result<Vec<Corner>, OperatorError> {
    let most = margin.map(|m| m.ceil() as i32);
    let mut places = Vec::new();
    let mut names = Vec::new();
    for z in -most[2]..=most[2] {
        for y in -most[1]..=most[1] {
            for x in -most[0]..=most[0] {
                let image = [x, y, z];
                let shift = edges * Vec3::from(image.map(f64::from));
                for (p, home) in home.iter().enumerate() {
                    let s = inverse * home;
                    if (0..3).all(|k| {
                        let at = s[k] + f64::from(image[k]);
                        -margin[k] <= at && at <= 1.0 + margin[k]
                    }) || image == [0; 3]
                    {
                        places.push(home + shift);
                        names.push(Corner { point: p as u32, image });
                    }
                }
            }
        }
    }
    let cells = triangulate(&places, dimension)?;
    let size = if dimension == Dimension::Two { 3 } else { 4 };
    let mut corners = Vec::new();
    for cell in cells.chunks_exact(size) {
        let cell = cell.iter().map(|&k| names[k as usize]);
        if cell.clone().min().is_some_and(|least| least.image == [0; 3]) {
            corners.extend(cell);
        }
    }
    Ok(corners)
}

/// A reproducible vector with components between −1 and 1.
fn jitter(p: usize, attempt: usize, plane: bool) -> Vec3 {
    // The finalizer of SplitMix64 turns consecutive numbers into unrelated bits.
    let bits = |k: u64| {
        let mut z =
            (p as u64 * 4 + k + 1).wrapping_add(attempt as u64 * 0x51ed_270b).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    Vec3::new(bits(0), bits(1), if plane { 0.0 } else { bits(2) })
}
