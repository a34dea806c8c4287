//! Interior of a closed triangle mesh.

use std::collections::BTreeMap;
use std::io::Read;

use robust::{Coord, Coord3D, orient2d, orient3d};

use crate::{PackingError, Surface, read_stl};
use concordem_contact::math::Vec3;

/// A closed triangle mesh.
///
/// A point is inside if the ray from it along +z crosses the surface an odd number of times. Exact predicates (Shewchuk
/// 1997, Discrete Comput. Geom. 18, 305) on each edge in a fixed direction decide which triangles the ray crosses, so
/// that all triangles that share an edge or a vertex count a ray through it consistently. The result is correct for
/// every point off the surface, however the mesh lies. The orientation of the triangles does not matter; overlapping
/// closed shells exclude each other's overlap.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    low: Vec3,
    high: Vec3,
    /// Numbers of columns of a grid in the xy plane. The triangles whose bounding boxes meet column `c` are the entries
    /// `starts[c]..starts[c + 1]` of `members`.
    columns: [usize; 2],
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl Mesh {
    /// A mesh from vertices (m) and triangles (indices of three vertices each).
    ///
    /// # Errors
    /// Coordinates that are not finite, indices out of range, no triangle, triangles that stand twice, or edges that do not belong to an
    /// even number of triangles.
    pub fn new(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, PackingError> {
        let bad = |reason: String| Err(PackingError::BadShape { reason });
        if let Some(index) = vertices.iter().position(|v| !v.iter().all(|c| c.is_finite())) {
            return bad(format!("vertex {index} of the mesh is not finite"));
        }
        for (index, triangle) in triangles.iter().enumerate() {
            if let Some(corner) = triangle.iter().find(|corner| **corner as usize >= vertices.len()) {
                return bad(format!("triangle {index} names vertex {corner}, but there are {}", vertices.len()));
            }
        }
        if triangles.is_empty() || u32::try_from(triangles.len()).is_err() {
            return bad(format!("a mesh of {} triangles", triangles.len()));
        }
        // A triangle that stands twice would not count at all, because a ray crosses it twice.
        let mut turned: Vec<[u32; 3]> = triangles.iter().filter_map(beginning_with_the_smallest).collect();
        turned.sort_unstable();
        let twice = turned.windows(2).filter(|pair| pair[0] == pair[1]).count();
        if twice > 0 {
            return bad(format!(
                "{twice} of the {} triangles of the mesh stand there before; remove them",
                triangles.len()
            ));
        }
        let mut edges: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        for &[a, b, c] in &triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                if from != to {
                    *edges.entry((from.min(to), from.max(to))).or_default() += 1;
                }
            }
        }
        let mut open = edges.iter().filter(|(_, count)| **count % 2 == 1).map(|(edge, _)| edge);
        if let Some(&(from, to)) = open.next() {
            return Err(PackingError::MeshNotClosed {
                edges: 1 + open.count(),
                from: vertices[from as usize].into(),
                to: vertices[to as usize].into(),
            });
        }
        let used = || triangles.iter().flatten().map(|index| &vertices[*index as usize]);
        let low = used().fold(Vec3::repeat(f64::INFINITY), |low, v| low.inf(v));
        let high = used().fold(Vec3::repeat(f64::NEG_INFINITY), |high, v| high.sup(v));
        let per_axis = ((triangles.len() as f64).sqrt().ceil() as usize).clamp(1, 1024);
        let mut mesh =
            Self { vertices, triangles, low, high, columns: [per_axis; 2], starts: Vec::new(), members: Vec::new() };
        mesh.sort_into_columns();
        Ok(mesh)
    }

    /// Read a mesh in STL format ([`read_stl`]); coordinates are multiplied by `scale` to give m.
    ///
    /// # Errors
    /// Errors of the reader, a file that is not STL, and errors of [`Self::new`].
    pub fn from_stl(mut reader: impl Read, scale: f64) -> Result<Self, PackingError> {
        super::positive("the scale of the mesh", scale)?;
        let io = |source| PackingError::Io { action: "cannot read the STL mesh".into(), source };
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).map_err(io)?;
        let Surface { vertices, triangles } = read_stl(&bytes, scale)?;
        Self::new(vertices, triangles)
    }

    /// The mesh moved by `shift` (m), then scaled.
    ///
    /// # Errors
    /// A shift or a scale that is not finite.
    pub fn moved(&self, shift: &Vec3, scale: f64) -> Result<Self, PackingError> {
        Self::new(self.vertices.iter().map(|vertex| (vertex + shift) * scale).collect(), self.triangles.clone())
    }

    /// Vertices, m.
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Corners of every triangle, m.
    pub fn corners_of_triangles(&self) -> Vec<[Vec3; 3]> {
        (0..self.triangles.len() as u32).map(|k| self.corners(k)).collect()
    }

    /// Volume, m³.
    ///
    /// # Errors
    /// Triangles without a common orientation: some edge has the same direction in two triangles.
    pub fn volume(&self) -> Result<f64, PackingError> {
        let mut balance: BTreeMap<(u32, u32), i32> = BTreeMap::new();
        for &[a, b, c] in &self.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *balance.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
            }
        }
        if balance.values().any(|sum| *sum != 0) {
            let reason = "the triangles of the mesh have no common orientation, so it has no volume";
            return Err(PackingError::BadShape { reason: reason.to_owned() });
        }
        let middle = 0.5 * (self.low + self.high);
        let part = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|index| self.vertices[index as usize] - middle);
            a.cross(&b).dot(&c) / 6.0
        };
        Ok(self.triangles.iter().map(part).sum::<f64>().abs())
    }

    /// Corners of the bounding box, m.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        (self.low, self.high)
    }

    /// Whether a point (m) lies inside and at least `margin` (m) away from all triangles; for a negative margin, whether it
    /// lies inside, or nearer than `-margin` to a triangle.
    pub fn contains(&self, point: &Vec3, margin: f64) -> bool {
        // Also false for NaN.
        if !((point - self.low).min() >= margin && (self.high - point).min() >= margin) {
            return false;
        }
        let column = self.column_of(point.x, point.y);
        let crossings = self.column(column).iter().filter(|index| self.ray_crosses(point, **index)).count();
        let inside = crossings % 2 == 1;
        if margin < 0.0 { inside || !self.is_clear(point, -margin) } else { inside && self.is_clear(point, margin) }
    }

    fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|index| self.vertices[index as usize])
    }

    fn column(&self, [i, j]: [usize; 2]) -> &[u32] {
        let number = j * self.columns[0] + i;
        &self.members[self.starts[number] as usize..self.starts[number + 1] as usize]
    }

    fn column_of(&self, x: f64, y: f64) -> [usize; 2] {
        let place = |value: f64, axis: usize| {
            let size = self.high[axis] - self.low[axis];
            let fraction = if size > 0.0 { (value - self.low[axis]) / size } else { 0.0 };
            ((fraction * self.columns[axis] as f64).max(0.0) as usize).min(self.columns[axis] - 1)
        };
        [place(x, 0), place(y, 1)]
    }

    /// Columns that intersect the rectangle between two points.
    fn columns_between(&self, low: &Vec3, high: &Vec3) -> impl Iterator<Item = [usize; 2]> + use<> {
        let (first, last) = (self.column_of(low.x, low.y), self.column_of(high.x, high.y));
        (first[1]..=last[1]).flat_map(move |j| (first[0]..=last[0]).map(move |i| [i, j]))
    }

    fn sort_into_columns(&mut self) {
        let columns = self.columns[0] * self.columns[1];
        let mut lists: Vec<Vec<u32>> = vec![Vec::new(); columns];
        for index in 0..self.triangles.len() as u32 {
            let [a, b, c] = self.corners(index);
            for [i, j] in self.columns_between(&a.inf(&b).inf(&c), &a.sup(&b).sup(&c)) {
                lists[j * self.columns[0] + i].push(index);
            }
        }
        self.starts = vec![0; columns + 1];
        for (number, list) in lists.iter().enumerate() {
            self.starts[number + 1] = self.starts[number] + list.len() as u32;
        }
        self.members = lists.concat();
    }

    /// Whether the ray from `point` along +z crosses a triangle.
    fn ray_crosses(&self, point: &Vec3, triangle: u32) -> bool {
        let flat = |v: &Vec3| Coord { x: v.x, y: v.y };
        let corners = self.corners(triangle);
        // Seen along z: is the point inside the triangle? Count the edges that a ray along +x crosses. Each edge goes
        // from its lower to its upper end, so that triangles sharing it agree.
        let mut inside = false;
        for k in 0..3 {
            let (u, v) = (&corners[k], &corners[(k + 1) % 3]);
            if (u.y <= point.y) != (v.y <= point.y) {
                let (lower, upper) = if u.y < v.y { (u, v) } else { (v, u) };
                inside ^= orient2d(flat(lower), flat(upper), flat(point)) > 0.0;
            }
        }
        if !inside {
            return false;
        }
        let [a, b, c] = &corners;
        let solid = |v: &Vec3| Coord3D { x: v.x, y: v.y, z: v.z };
        // orient3d is positive for a point below a triangle that is counter-clockwise seen from above.
        let below = orient3d(solid(a), solid(b), solid(c), solid(point));
        if orient2d(flat(a), flat(b), flat(c)) > 0.0 { below > 0.0 } else { below < 0.0 }
    }

    /// Whether no triangle is nearer than `margin`.
    fn is_clear(&self, point: &Vec3, margin: f64) -> bool {
        let reach = Vec3::new(margin, margin, 0.0);
        self.columns_between(&(point - reach), &(point + reach)).all(|column| {
            self.column(column).iter().all(|index| squared_distance(point, &self.corners(*index)) >= margin * margin)
        })
    }
}

/// A triangle of three different corners, the smallest first, in its own sense.
fn beginning_with_the_smallest(&[a, b, c]: &[u32; 3]) -> Option<[u32; 3]> {
    let is_flat = a == b || b == c || c == a;
    let turned = if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    };
    (!is_flat).then_some(turned)
}

/// Squared distance of a point to a triangle, m² (Ericson 2005, Real-Time Collision Detection, section 5.1.5).
fn squared_distance(p: &Vec3, [a, b, c]: &[Vec3; 3]) -> f64 {
    let (ab, ac) = (b - a, c - a);
    let ap = p - a;
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ap.norm_squared();
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return bp.norm_squared();
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return cp.norm_squared();
    }
    let vc = d1 * d4 - d3 * d2;
    // Two equal corners a and b make no edge.
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3 {
        return (ap - ab * (d1 / (d1 - d3))).norm_squared();
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (ap - ac * (d2 / (d2 - d6))).norm_squared();
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return (bp - (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))).norm_squared();
    }
    let scale = 1.0 / (va + vb + vc);
    (ap - ab * (vb * scale) - ac * (vc * scale)).norm_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Random, Shape};

    const CUBE: [[u32; 3]; 12] = [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];

    fn cube_vertices() -> Vec<Vec3> {
        (0..8).map(|k| Vec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2 & 1))).collect()
    }

    /// Icosphere of radius 1, its vertices on the sphere.
    fn ball(refinements: usize) -> Mesh {
        let mut vertices = vec![Vec3::x(), -Vec3::x(), Vec3::y(), -Vec3::y(), Vec3::z(), -Vec3::z()];
        let mut triangles: Vec<[u32; 3]> =
            vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        for _ in 0..refinements {
            let mut middles = BTreeMap::new();
            let mut finer = Vec::new();
            for &[a, b, c] in &triangles {
                let mut middle = |u: u32, v: u32| {
                    *middles.entry((u.min(v), u.max(v))).or_insert_with(|| {
                        vertices.push((vertices[u as usize] + vertices[v as usize]).normalize());
                        vertices.len() as u32 - 1
                    })
                };
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            }
            triangles = finer;
        }
        Mesh::new(vertices, triangles).unwrap()
    }

    #[test]
    fn cube_agrees_with_the_box_everywhere() {
        let mesh = Mesh::new(cube_vertices(), CUBE.to_vec()).unwrap();
        let shape = Shape::new_box(Vec3::zeros(), Vec3::repeat(1.0)).unwrap();
        let mut random = Random::new(1);
        for _ in 0..20_000 {
            let point = random.uniform_vector() * 1.4 - Vec3::repeat(0.2);
            let margin = if random.uniform() < 0.5 { 0.0 } else { 0.4 * random.uniform() };
            assert_eq!(mesh.contains(&point, margin), shape.contains(&point, margin), "{point:?} {margin}");
        }
    }

    #[test]
    fn rays_through_edges_and_vertices_are_no_exception() {
        // A lattice of points whose rays meet the diagonals of the faces, and on the ball the poles and meridians.
        let cube = Mesh::new(cube_vertices(), CUBE.to_vec()).unwrap();
        let sphere = ball(3);
        for i in 1..32 {
            for j in 1..32 {
                for k in 1..32 {
                    let point = Vec3::new(f64::from(i), f64::from(j), f64::from(k)) / 32.0;
                    assert!(cube.contains(&point, 0.0), "{point:?}");
                    for outside in [Vec3::x(), Vec3::y(), Vec3::z(), -Vec3::x(), -Vec3::y(), -Vec3::z()] {
                        assert!(!cube.contains(&(point + outside), 0.0), "{point:?}");
                    }
                    let centered = point * 2.0 - Vec3::repeat(1.0);
                    // The polyhedron lies between the unit sphere and one smaller by the sagitta of its largest
                    // triangles (edge below 0.3, circumradius below 0.175): 1 − cos(0.175) < 0.016.
                    let radius = centered.norm();
                    if !(0.984..=1.0).contains(&radius) {
                        assert_eq!(sphere.contains(&centered, 0.0), radius < 1.0, "{centered:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn margin_of_the_ball() {
        let sphere = ball(3);
        let mut random = Random::new(2);
        for _ in 0..3000 {
            let point = random.uniform_vector() * 2.0 - Vec3::repeat(1.0);
            let margin = 0.5 * random.uniform();
            let depth = 1.0 - point.norm();
            // The sagitta, as above.
            if (depth - margin).abs() > 0.016 {
                assert_eq!(sphere.contains(&point, margin), depth > margin, "{point:?} {margin}");
            }
        }
    }

    fn binary_stl(header: &[u8], triangles: &[[u32; 3]]) -> Vec<u8> {
        let mut bytes = vec![0; 80];
        bytes[..header.len()].copy_from_slice(header);
        bytes.extend((triangles.len() as u32).to_le_bytes());
        let vertices = cube_vertices();
        for triangle in triangles {
            bytes.extend([0; 12]);
            for corner in triangle {
                for c in vertices[*corner as usize].iter() {
                    bytes.extend((*c as f32).to_le_bytes());
                }
            }
            bytes.extend([0; 2]);
        }
        bytes
    }

    #[test]
    fn stl_text_and_binary() {
        for header in [&b"cube"[..], b"solid cube"] {
            let mesh = Mesh::from_stl(&binary_stl(header, &CUBE)[..], 2.0e-3).unwrap();
            assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (8, 12));
            assert_eq!(mesh.bounds().1, Vec3::repeat(2.0e-3));
            assert!(mesh.contains(&Vec3::repeat(1.0e-3), 0.99e-3));
        }
        let mut text = String::from("solid cube\n");
        for triangle in CUBE {
            text += "facet normal 0 0 0\nouter loop\n";
            let lines = triangle.map(|corner| {
                let v = cube_vertices()[corner as usize];
                format!("vertex {} {} {}\n", v.x, v.y, v.z)
            });
            text += &(lines.concat() + "endloop\nendfacet\n");
        }
        text += "endsolid cube\n";
        assert_eq!(Mesh::from_stl(text.as_bytes(), 1.0).unwrap().triangles.len(), 12);
    }

    #[test]
    fn broken_meshes_are_refused() {
        assert!(matches!(
            Mesh::from_stl(&binary_stl(b"", &CUBE[..11])[..], 1.0),
            Err(PackingError::MeshNotClosed { edges: 3, .. })
        ));
        let whole = binary_stl(b"", &CUBE);
        for cut in [0, 10, 83, 84, 100, whole.len() - 1] {
            assert!(Mesh::from_stl(&whole[..cut], 1.0).is_err(), "{cut} bytes");
        }
        assert!(Mesh::from_stl(&b"solid x\nfacet nonsense\n"[..], 1.0).is_err());
        assert!(matches!(Mesh::new(cube_vertices(), vec![[0, 1, 8]]), Err(PackingError::BadShape { .. })));
        // With every facet twice, no point would lie inside.
        let twice = Mesh::from_stl(&binary_stl(b"", &[CUBE, CUBE].concat())[..], 1.0).unwrap_err().to_string();
        assert!(twice.contains("12 of the 24 triangles of the mesh stand there before"), "{twice}");
        let mut nan = cube_vertices();
        nan[3].x = f64::NAN;
        assert!(matches!(Mesh::new(nan, CUBE.to_vec()), Err(PackingError::BadShape { .. })));
    }
}
