//! Strains of particles, as colors.

use std::collections::HashMap;

use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::Region;
use concordem_operator::strain::{Dimension, affine_fit};
use concordem_solver::neighbor::candidate_pairs;
use concordem_solver::state::Cell;
use rayon::prelude::*;

use super::fields::{reals, vectors, whole};
use crate::output::frames::Frame;

/// Names of the components, with their places in the matrix.
const COMPONENTS: [(&str, usize, usize); 6] = [
    ("strain-xx", 0, 0),
    ("strain-yy", 1, 1),
    ("strain-zz", 2, 2),
    ("strain-xy", 0, 1),
    ("strain-yz", 1, 2),
    ("strain-zx", 2, 0),
];
/// Name of the largest principal strain.
const PRINCIPAL: &str = "principal-strain";
/// Name of the change of the volume, of plane bodies that of the area.
const VOLUMETRIC: &str = "volumetric-strain";
/// Particles are neighbors if their distance at the start is at most this multiple of the sum of their radii: a dense packing has some 14 of
/// them, up to a diameter and a half away.
const REACH: f64 = 1.5;

/// Names of all strains.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    COMPONENTS.iter().map(|(name, ..)| *name).chain([PRINCIPAL, VOLUMETRIC])
}

/// Whether this field is a strain.
pub(super) fn is_strain(name: &str) -> bool {
    names().any(|other| other == name)
}

/// A strain of the particles of `now`; NaN where neighbors do not span space.
///
/// With the displacement gradient `H` of the best fit to a particle and its neighbors at the start, the components are those of the Green–Lagrange
/// strain `E = ½(H + Hᵀ + HᵀH)`, which a rotation does not change, the principal strain is its largest eigenvalue, and the volumetric strain
/// `det(1 + H) − 1`.
///
/// # Errors
/// The snapshots have no displacements, or no particle has enough neighbors.
pub(super) fn of_particles(first: &Frame, now: &Frame, dimension: u8, name: &str) -> Result<Vec<f64>, String> {
    let gradients = gradients(first, now, if dimension == 2 { Dimension::Two } else { Dimension::Three })?;
    let value = |h: &Option<Mat3>| {
        let Some(h) = h else { return f64::NAN };
        let e = (h + h.transpose() + h.transpose() * h) * 0.5;
        match COMPONENTS.iter().find(|(other, ..)| *other == name) {
            Some(&(_, i, j)) => e[(i, j)],
            None if name == VOLUMETRIC => (Mat3::identity() + h).determinant() - 1.0,
            None => largest(&e, dimension),
        }
    };
    let found: Vec<f64> = gradients.iter().map(value).collect();
    if found.iter().all(|value| value.is_nan()) {
        return Err("no particle has neighbors on all sides, so there are no strains; choose another field".to_owned());
    }
    Ok(found)
}

/// The largest eigenvalue; of plane bodies in the plane.
fn largest(e: &Mat3, dimension: u8) -> f64 {
    if dimension == 2 {
        return e.fixed_view::<2, 2>(0, 0).into_owned().symmetric_eigenvalues().max();
    }
    e.symmetric_eigenvalues().max()
}

/// Displacement gradient of each particle of `now`.
fn gradients(first: &Frame, now: &Frame, dimension: Dimension) -> Result<Vec<Option<Mat3>>, String> {
    let started = displacements(first)?;
    let present = displacements(now)?;
    let row_of: HashMap<usize, usize> = whole(now, "id").into_iter().enumerate().map(|(row, id)| (id, row)).collect();
    // Particles that are there both at the start and now.
    let rows: Vec<[usize; 2]> =
        whole(first, "id").iter().enumerate().filter_map(|(then, id)| Some([then, *row_of.get(id)?])).collect();
    let points = vectors(&first.points);
    let position: Vec<Vec3> = rows.iter().map(|[then, _]| points[*then]).collect();
    let displacement: Vec<Vec3> = rows.iter().map(|&[then, row]| present[row] - started[then]).collect();
    let radius = reals(first, "radius");
    let reach: Vec<f64> = rows.iter().map(|[then, _]| REACH * radius[*then]).collect();
    let matrix = |frame: &Frame| frame.cell.map(|edges| Mat3::from_columns(&edges.map(Vec3::from)));
    let cells = matrix(first).zip(matrix(now));
    let cell = cells.map(|(before, _)| Cell::new(before));
    let pairs = candidate_pairs(&position, &reach, cell.as_ref()).map_err(|error| error.to_string())?;
    // Neighbors of each particle: number, sign, and image.
    let mut neighbors: Vec<Vec<(usize, f64, Vec3)>> = vec![Vec::new(); rows.len()];
    for pair in pairs {
        let (a, b, image) = (pair.a as usize, pair.b as usize, Vec3::from(pair.image.map(f64::from)));
        neighbors[a].push((b, 1.0, image));
        neighbors[b].push((a, -1.0, image));
    }
    let gradient = |(p, near): (usize, &Vec<(usize, f64, Vec3)>)| {
        let (mut x, mut u) = (vec![Vec3::zeros()], vec![Vec3::zeros()]);
        for &(q, sign, image) in near {
            let (shift, change) =
                cells.map_or_else(Default::default, |(before, now)| (before * image, (now - before) * image));
            x.push(position[q] - position[p] + shift * sign);
            u.push(displacement[q] - displacement[p] + change * sign);
        }
        let fit = affine_fit(&x, &u, &[], &Region::All { volume: 1.0 }, None, dimension).ok()?;
        Some(fit.gradient)
    };
    let fitted: Vec<Option<Mat3>> = neighbors.par_iter().enumerate().map(gradient).collect();
    let mut gradients = vec![None; present.len()];
    for ([_, row], fit) in rows.iter().zip(fitted) {
        gradients[*row] = fit;
    }
    Ok(gradients)
}

/// Displacements, m.
fn displacements(frame: &Frame) -> Result<Vec<Vec3>, String> {
    let found = vectors(reals(frame, "displacement"));
    if 3 * found.len() == frame.points.len() {
        Ok(found)
    } else {
        Err("the snapshots have no displacements, so there are no strains; choose another field".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::stream::StoredField;
    use concordem_contact::math::{quaternion_of_rotation_vector, rotate};
    use concordem_solver::state::columns::{ColumnData, StoredColumn};

    /// A snapshot of particles with these centers and displacements.
    fn frame(points: &[Vec3], displacement: &[Vec3], cell: Option<Mat3>) -> Frame {
        let flat = |vectors: &[Vec3]| vectors.iter().flat_map(|x| [x.x, x.y, x.z]).collect::<Vec<f64>>();
        let field = |name: &str, components: usize, data: ColumnData| StoredField {
            name: name.to_owned(),
            unit: String::new(),
            description: String::new(),
            column: StoredColumn { components, data },
        };
        Frame {
            time: 0.0,
            step: 0,
            points: flat(points),
            cell: cell.map(|matrix| [0, 1, 2].map(|k| matrix.column(k).into_owned().into())),
            fields: vec![
                field("id", 1, ColumnData::U32((0..points.len() as u32).collect())),
                field("radius", 1, ColumnData::F64(vec![1.0; points.len()])),
                field("displacement", 3, ColumnData::F64(flat(displacement))),
            ],
        }
    }

    /// A cube of spheres, out of order by up to a tenth of their distance.
    fn cube(edge: usize) -> Vec<Vec3> {
        let mut places = Vec::new();
        for k in 0..edge.pow(3) {
            let at = [k / edge.pow(2), k / edge % edge, k % edge].map(|i| 2.0 * i as f64);
            let stir = |n: usize| 0.2 * ((k * (7 + 4 * n) % 11) as f64 / 11.0 - 0.5);
            places.push(Vec3::from(at) + Vec3::new(stir(0), stir(1), stir(2)));
        }
        places
    }

    fn strain(first: &Frame, now: &Frame, dimension: u8, name: &str) -> Vec<f64> {
        of_particles(first, now, dimension, name).unwrap()
    }

    /// A large rotation after a stretch `U`: strains are `½(U² − 1)`, the volume changes by `det U`. In the body, and in a cell that moves along.
    /// Rounding.
    #[test]
    fn strains_of_a_stretched_and_turned_body() {
        let stretch = Mat3::new(1.02, 0.01, 0.0, 0.01, 0.99, 0.003, 0.0, 0.003, 1.0);
        let turn = quaternion_of_rotation_vector(&Vec3::new(0.3, -0.8, 0.5));
        let gradient = Mat3::from_columns(&stretch.column_iter().map(|u| rotate(&turn, &u.into())).collect::<Vec<_>>());
        let e = (stretch * stretch - Mat3::identity()) * 0.5;
        let points = cube(4);
        let moved: Vec<Vec3> = points.iter().map(|x| gradient * x - x).collect();
        let now: Vec<Vec3> = points.iter().map(|x| gradient * x).collect();
        for cell in [None, Some(Mat3::from_diagonal_element(8.0))] {
            let first = frame(&points, &vec![Vec3::zeros(); points.len()], cell);
            let last = frame(&now, &moved, cell.map(|matrix| gradient * matrix));
            let wanted = COMPONENTS.map(|(name, i, j)| (name, e[(i, j)]));
            let others = [(PRINCIPAL, e.symmetric_eigenvalues().max()), (VOLUMETRIC, stretch.determinant() - 1.0)];
            for (name, wanted) in wanted.into_iter().chain(others) {
                for found in strain(&first, &last, 3, name) {
                    assert!((found - wanted).abs() < 1e-13, "{name}: {found} {wanted}");
                }
            }
        }
    }

    /// In the plane, the third direction does not count: a body pressed on all sides has a negative principal strain. A particle without neighbors
    /// has no strain, and a body of such has none at all.
    #[test]
    fn plane_bodies_and_single_particles() {
        let mut points: Vec<Vec3> = cube(5).into_iter().take(25).map(|x| Vec3::new(x.y, x.z, 0.0)).collect();
        points.push(Vec3::new(100.0, 0.0, 0.0));
        let moved: Vec<Vec3> = points.iter().map(|x| x * -0.01).collect();
        let first = frame(&points, &vec![Vec3::zeros(); points.len()], None);
        let last = frame(&points, &moved, None);
        let found = strain(&first, &last, 2, PRINCIPAL);
        let wanted = 0.5 * (0.99_f64.powi(2) - 1.0);
        assert!(found[..25].iter().all(|value| (value - wanted).abs() < 1e-14), "{found:?}");
        assert!(found[25].is_nan());
        let alone = frame(&points[25..], &moved[25..], None);
        assert!(of_particles(&alone, &alone, 3, PRINCIPAL).unwrap_err().contains("no strains"));
    }

    /// Particles that came later have no strain; those that left are no neighbors. Rows may be in another order.
    #[test]
    fn particles_are_found_by_their_ids() {
        let points = cube(3);
        let first = frame(&points, &vec![Vec3::zeros(); points.len()], None);
        let moved: Vec<Vec3> = points.iter().rev().map(|x| Vec3::x() * (1e-3 * x.x)).collect();
        let mut last = frame(&points, &moved, None);
        let mut ids: Vec<u32> = (0..points.len() as u32).rev().collect();
        ids[0] = 99;
        last.fields[0].column.data = ColumnData::U32(ids);
        let found = strain(&first, &last, 3, "strain-xx");
        assert!(found[0].is_nan());
        assert!(found[1..].iter().all(|value| (value - (1e-3 + 0.5e-6)).abs() < 1e-15), "{found:?}");
    }
}
