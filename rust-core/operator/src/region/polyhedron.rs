//! Extent of an intersection of half-spaces along the edges of a periodic cell.

use super::HalfSpace;
use concordem_contact::math::{Mat3, Vec3};

/// Regions that reach further than this many edges are unbounded.
const FARTHEST: f64 = 1e3;
/// Relative size below which a determinant is zero: rounding of edges and normals.
const ROUNDING: f64 = 1e-12;
/// Sine of the angle below which a plane is parallel to an edge. In a driven cell, the rounding errors of many steps add up.
const PARALLEL: f64 = 1e-9;

/// Extent of a region along an edge of the periodic cell, in numbers of edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Extent {
    /// From and to, in numbers of edges.
    Bounded([f64; 2]),
    /// The region does not change if it moves along the edge: one image represents all.
    Invariant,
    /// Infinite.
    Unbounded,
}

impl Extent {
    pub(super) fn range(self) -> Option<[f64; 2]> {
        if let Self::Bounded(range) = self { Some(range) } else { None }
    }
}

/// Extent along each edge of the cell with the edge vectors `edges` (m). In reduced coordinates `x = H s` the half-space
/// `n·(x − p) < 0` is `(Hᵀn)·s < n·p`. The extent is that of the corners of the polyhedron.
pub(super) fn reduced_bounds(planes: &[HalfSpace], edges: &Mat3) -> [Extent; 3] {
    let mut faces: Vec<(Vec3, f64)> = planes
        .iter()
        .map(|plane| {
            let normal = edges.transpose() * plane.normal;
            let size = normal.norm();
            (normal / size, plane.normal.dot(&plane.point) / size)
        })
        .collect();
    let invariant: [bool; 3] = std::array::from_fn(|k| faces.iter().all(|(normal, _)| normal[k].abs() <= PARALLEL));
    // A large box closes the polyhedron; a unit box does so where the region is invariant.
    for k in 0..3 {
        for sign in [-1.0, 1.0] {
            let mut normal = Vec3::zeros();
            normal[k] = sign;
            faces.push((normal, if invariant[k] { 1.0 } else { FARTHEST }));
        }
    }
    let (mut low, mut high) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    for i in 0..faces.len() {
        for j in 0..i {
            for k in 0..j {
                let matrix = Mat3::from_rows(&[faces[i].0.transpose(), faces[j].0.transpose(), faces[k].0.transpose()]);
                if matrix.determinant().abs() < ROUNDING {
                    continue;
                }
                let Some(inverse) = matrix.try_inverse() else { continue };
                let corner = inverse * Vec3::new(faces[i].1, faces[j].1, faces[k].1);
                let slack = 1e-9 * (1.0 + corner.norm());
                if faces.iter().all(|(normal, offset)| normal.dot(&corner) <= offset + slack) {
                    low = low.inf(&corner);
                    high = high.sup(&corner);
                }
            }
        }
    }
    std::array::from_fn(|k| {
        if invariant[k] {
            Extent::Invariant
        } else if low[k] > high[k] {
            // No corner: the half-spaces have no point in common.
            Extent::Bounded([0.0, -1.0])
        } else if low[k] <= -0.999 * FARTHEST || high[k] >= 0.999 * FARTHEST {
            Extent::Unbounded
        } else {
            Extent::Bounded([low[k], high[k]])
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(point: [f64; 3], normal: [f64; 3]) -> HalfSpace {
        HalfSpace { point: point.into(), normal: normal.into() }
    }

    #[test]
    fn slabs_wedges_and_tetrahedra() {
        let edges = Mat3::from_diagonal(&Vec3::new(2.0, 4.0, 8.0));
        let slab = [plane([1.0, 0.0, 0.0], [1.0, 0.0, 0.0]), plane([-3.0, 0.0, 0.0], [-2.0, 0.0, 0.0])];
        let [x, y, z] = reduced_bounds(&slab, &edges);
        let Extent::Bounded([from, to]) = x else { panic!("{x:?}") };
        // Corners of three unit planes: a few roundings of 1.5.
        assert!((from + 1.5).abs() < 1e-14 && (to - 0.5).abs() < 1e-14, "{from} {to}");
        assert_eq!([y, z], [Extent::Invariant; 2]);
        let [x, ..] = reduced_bounds(&slab[..1], &edges);
        assert_eq!(x, Extent::Unbounded);
        let tetrahedron = [
            plane([0.0; 3], [-1.0, 0.0, 0.0]),
            plane([0.0; 3], [0.0, -1.0, 0.0]),
            plane([0.0; 3], [0.0, 0.0, -1.0]),
            plane([8.0, 0.0, 0.0], [1.0, 1.0, 1.0]),
        ];
        for (extent, far) in reduced_bounds(&tetrahedron, &edges).into_iter().zip([4.0, 2.0, 1.0]) {
            let Extent::Bounded([from, to]) = extent else { panic!("{extent:?}") };
            assert!(from.abs() < 1e-12 && (to - far).abs() < 1e-12, "{from} {to} {far}");
        }
        // In a cell with a tilted edge, a slab across x is unbounded along that edge, unless rounding tilts it.
        for (tilt, unbounded) in [(0.1, true), (1e-6, true), (1e-10, false)] {
            let mut tilted = edges;
            tilted[(0, 1)] = tilt;
            let found = reduced_bounds(&slab, &tilted);
            assert_eq!(found.contains(&Extent::Unbounded), unbounded, "{tilt} {found:?}");
            assert_eq!(found[1] == Extent::Invariant, !unbounded, "{tilt} {found:?}");
        }
        let nothing = [plane([0.0; 3], [1.0, 0.0, 0.0]), plane([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0])];
        assert_eq!(reduced_bounds(&nothing, &edges)[0], Extent::Bounded([0.0, -1.0]));
    }
}
