//! Cuts of a scenario: which bonds are not made, and which particles are left out.

use std::path::Path;

use super::AssemblyError;
use super::stl::Named;
use crate::schema::quantity::vector;
use crate::schema::{CutShape, Problem, Scenario};
use concordem_contact::math::{Mat3, Vec3};
use concordem_packing::TIE;
use concordem_solver::state::{Cell, Sphere};

/// The cuts of a scenario.
pub(super) struct Cuts {
    shapes: Vec<Shape>,
    cell: Option<(Cell, Mat3)>,
    /// Number of bonds that each cut has severed.
    severed: Vec<usize>,
}

/// Shape of a cut.
enum Shape {
    /// Surfaces without thickness.
    Faces(Vec<Face>),
    Box(Vec3, Vec3),
    Sphere(Vec3, f64),
    /// Middle, axis, radius, and half of the length.
    Cylinder(Vec3, usize, f64, f64),
}

/// A parallelogram, or the triangle that is its half.
struct Face {
    corner: Vec3,
    edges: [Vec3; 2],
    triangle: bool,
}

impl Face {
    /// Whether the line from `p` to `q` crosses the face.
    fn is_crossed(&self, p: &Vec3, q: &Vec3) -> bool {
        let [u, v] = &self.edges;
        let normal = u.cross(v);
        let [a, b] = [p, q].map(|x| (x - self.corner).dot(&normal));
        // A center on the plane belongs to the positive side, so that the cut separates two layers of a lattice and not three.
        let rounding = TIE * normal.norm() * (q - p).norm();
        if (a >= -rounding) == (b >= -rounding) {
            return false;
        }
        let x = p + (q - p) * (a / (a - b)) - self.corner;
        let square = normal.norm_squared();
        let (s, t) = (x.cross(v).dot(&normal) / square, u.cross(&x).dot(&normal) / square);
        let end = if self.triangle { s + t } else { s.max(t) };
        s >= -TIE && t >= -TIE && end <= 1.0 + TIE
    }
}

/// The part of the line `p + s (q − p)`, `0 ≤ s ≤ 1`, between two coordinates along an axis.
fn between([first, last]: [f64; 2], p: f64, q: f64, low: f64, high: f64) -> [f64; 2] {
    let d = q - p;
    if d == 0.0 {
        return if p >= low && p <= high { [first, last] } else { [1.0, 0.0] };
    }
    let (a, b) = ((low - p) / d, (high - p) / d);
    [first.max(a.min(b)), last.min(a.max(b))]
}

/// Squared distance of a point from the line from `p` to `q`.
fn distance_squared(point: &Vec3, p: &Vec3, q: &Vec3) -> f64 {
    let d = q - p;
    let square = d.norm_squared();
    let s = if square > 0.0 { ((point - p).dot(&d) / square).clamp(0.0, 1.0) } else { 0.0 };
    (p + d * s - point).norm_squared()
}

impl Shape {
    /// Whether the line from `p` to `q` crosses the shape, or lies inside.
    fn severs(&self, p: &Vec3, q: &Vec3) -> bool {
        match self {
            Self::Faces(faces) => faces.iter().any(|face| face.is_crossed(p, q)),
            Self::Box(low, high) => {
                let part = (0..3).fold([0.0, 1.0], |part, i| between(part, p[i], q[i], low[i], high[i]));
                part[0] <= part[1]
            }
            Self::Sphere(center, radius) => distance_squared(center, p, q) <= radius * radius,
            Self::Cylinder(center, axis, radius, half) => {
                let (low, high) = (center[*axis] - half, center[*axis] + half);
                let [first, last] = between([0.0, 1.0], p[*axis], q[*axis], low, high);
                let across = |s: f64| {
                    let mut x = p + (q - p) * s;
                    x[*axis] = center[*axis];
                    x
                };
                first <= last && distance_squared(center, &across(first), &across(last)) <= radius * radius
            }
        }
    }

    /// Low and high corner of a box around the shape.
    fn bounds(&self) -> (Vec3, Vec3) {
        match self {
            Self::Faces(faces) => faces.iter().fold(
                (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)),
                |(low, high), Face { corner, edges: [u, v], .. }| {
                    [*corner, corner + u, corner + v, corner + u + v]
                        .iter()
                        .fold((low, high), |(low, high), x| (low.inf(x), high.sup(x)))
                },
            ),
            Self::Box(low, high) => (*low, *high),
            Self::Sphere(center, radius) => (center.add_scalar(-radius), center.add_scalar(*radius)),
            Self::Cylinder(center, axis, radius, half) => {
                let mut reach = Vec3::repeat(*radius);
                reach[*axis] = *half;
                (center - reach, center + reach)
            }
        }
    }
}

impl Cuts {
    /// The cuts of a scenario, in a periodic cell if there is one.
    pub(super) fn new(scenario: &Scenario, folder: &Path, cell: Option<&Cell>) -> Result<Self, AssemblyError> {
        let shapes = scenario.cuts.iter().enumerate();
        let shapes = shapes.map(|(number, cut)| shape(number, &cut.shape, folder)).collect::<Result<Vec<_>, _>>()?;
        let cell = cell.and_then(|cell| Some((*cell, cell.matrix.try_inverse()?)));
        Ok(Self { severed: vec![0; shapes.len()], shapes, cell })
    }

    /// Whether a cut, or one of its periodic images, severs the line between two centers. Counts the bonds of each cut.
    pub(super) fn sever(&mut self, p: &Vec3, q: &Vec3) -> bool {
        let mut any = false;
        for (shape, count) in self.shapes.iter().zip(&mut self.severed) {
            if images(self.cell.as_ref(), shape, p, q).any(|(p, q)| shape.severs(&p, &q)) {
                any = true;
                *count += 1;
            }
        }
        any
    }

    /// The spheres without those whose centers lie inside a cut that removes particles.
    pub(super) fn remaining(&self, scenario: &Scenario, spheres: &[Sphere]) -> Vec<Sphere> {
        let mut remaining = spheres.to_vec();
        for (cut, shape) in scenario.cuts.iter().zip(&self.shapes).filter(|(cut, _)| cut.remove_particles) {
            debug_assert!(cut.shape.is_solid(), "checked with the scenario");
            remaining.retain(|sphere| {
                let x = &sphere.position;
                !images(self.cell.as_ref(), shape, x, x).any(|(x, _)| shape.severs(&x, &x))
            });
        }
        remaining
    }

    /// Warns of cuts that sever no bond.
    pub(super) fn without_effect(&self, scenario: &Scenario, positions: &[Vec3]) -> Vec<Problem> {
        let (low, high) = super::bounds(positions.iter());
        let idle = |at: &usize| self.severed[*at] == 0 && !scenario.cuts[*at].remove_particles;
        let warn = |at: usize| {
            let help = format!(
                "check its position and its units, or remove it; the centers lie {}",
                super::between(&low, &high)
            );
            scenario.warning(&format!("cut[{at}].shape"), "crosses no bond", help)
        };
        (0..self.shapes.len()).filter(idle).map(warn).collect()
    }
}

/// The line from `p` to `q`, moved so that it can meet the shape: in a cell, its images near it.
fn images<'a>(
    cell: Option<&'a (Cell, Mat3)>,
    shape: &Shape,
    p: &'a Vec3,
    q: &'a Vec3,
) -> impl Iterator<Item = (Vec3, Vec3)> + use<'a> {
    let (low, high) = shape.bounds();
    let is_near = move |(p, q): &(Vec3, Vec3)| {
        (0..3).all(|i| {
            let rounding = TIE * (q - p).norm();
            p[i].max(q[i]) >= low[i] - rounding && p[i].min(q[i]) <= high[i] + rounding
        })
    };
    // From the first cell the shape's own images within one cell around it; the shape may lie anywhere.
    let home = cell.map(|(cell, inverse)| {
        let middle = Vec3::from_fn(|i, _| {
            let middle = 0.5 * (low[i] + high[i]);
            if middle.is_finite() { middle } else { p[i] }
        });
        let [a, b] = [cell.index_of(p, inverse), cell.index_of(&middle, inverse)];
        (cell, [0, 1, 2].map(|i| f64::from(b[i]) - f64::from(a[i])))
    });
    let around = if home.is_some() { -1..=1 } else { 0..=0 };
    let numbers = around.clone().flat_map(move |i| {
        let around = around.clone();
        around.clone().flat_map(move |j| around.clone().map(move |k| [i, j, k]))
    });
    numbers
        .map(move |image: [i32; 3]| {
            let shift = home.map_or_else(Vec3::zeros, |(cell, home)| {
                cell.matrix * Vec3::from_fn(|i, _| home[i] + f64::from(image[i]))
            });
            (p + shift, q + shift)
        })
        .filter(is_near)
}

/// The shape of cut `number`. Surfaces are read from `folder`.
fn shape(number: usize, shape: &CutShape, folder: &Path) -> Result<Shape, AssemblyError> {
    Ok(match shape {
        CutShape::Line { from, to } => {
            let [a, b] = [from, to].map(|x| Vec3::new(x[0].si(), x[1].si(), -1.0));
            // The left side is the positive one: (b − a) × z points to the right.
            let depth = Vec3::new(0.0, 0.0, 2.0);
            Shape::Faces(vec![Face { corner: a, edges: [depth, b - a], triangle: false }])
        }
        CutShape::Parallelogram { corner, edges } => {
            let edges = [vector(&edges[0]), vector(&edges[1])];
            Shape::Faces(vec![Face { corner: vector(corner), edges, triangle: false }])
        }
        CutShape::Box { minimum, maximum } => Shape::Box(vector(minimum), vector(maximum)),
        CutShape::Sphere { center, radius } => Shape::Sphere(vector(center), radius.si()),
        CutShape::Cylinder { center, axis, radius, length } => {
            let half = length.map_or(f64::INFINITY, |length| 0.5 * length.si());
            Shape::Cylinder(vector(center), axis.index(), radius.si(), half)
        }
        CutShape::Facets { path, unit } => {
            let face = |[a, b, c]: [Vec3; 3]| Face { corner: a, edges: [b - a, c - a], triangle: true };
            let key = format!("cut[{number}].shape.path");
            let triangles = Named { folder, path, unit: unit.si(), key: &key }.triangles()?;
            Shape::Faces(triangles.into_iter().map(face).collect())
        }
    })
}
