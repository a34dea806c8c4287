//! Triangulated points.

use crate::error::OperatorError;
use crate::region::Period;
use crate::strain::Dimension;
use concordem_contact::math::Vec3;

/// Corner of a cell: a point, or one of its periodic images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Corner {
    /// Index of the point.
    pub point: u32,
    /// Image, in numbers of cell edges.
    pub image: [i32; 3],
}

impl Corner {
    /// Position of the corner, m; only images need `period`.
    #[inline]
    pub fn place(&self, position: &[Vec3], period: Option<&Period>) -> Vec3 {
        let x = position[self.point as usize];
        period.map_or(x, |period| x + period.edges * self.shift())
    }

    /// Displacement of the corner.
    #[inline]
    pub fn displacement(&self, displacement: &[Vec3], period: Option<&Period>) -> Vec3 {
        let u = displacement[self.point as usize];
        period.map_or(u, |period| u + period.change * self.shift())
    }

    fn shift(self) -> Vec3 {
        Vec3::from_fn(|k, _| f64::from(self.image[k]))
    }
}

/// Tetrahedra (triangles in the plane z = 0) on points, positively oriented, without gaps.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    dimension: Dimension,
    points: usize,
    periodic: bool,
    corners: Vec<Corner>,
    hull: Vec<Corner>,
}

impl Mesh {
    /// A mesh of cells given by their corners (4 each; 3 in the plane), positively oriented: the first three edges from
    /// the first corner are right-handed; triangles run counter-clockwise. Exactly two cells must share every inner
    /// face; a periodic mesh has no other faces.
    pub fn new(
        dimension: Dimension,
        points: usize,
        periodic: bool,
        corners: Vec<Corner>,
    ) -> Result<Self, OperatorError> {
        let size = corners_per_cell(dimension);
        if !corners.len().is_multiple_of(size) {
            return Err(OperatorError::Ragged { name: "corners", found: corners.len(), components: size });
        }
        if let Some(entry) = corners.iter().position(|c| c.point as usize >= points) {
            return Err(OperatorError::Index { name: "corners", entry, index: corners[entry].point, count: points });
        }
        let mut mesh = Self { dimension, points, periodic, corners, hull: Vec::new() };
        mesh.hull = mesh.free_faces()?;
        Ok(mesh)
    }

    /// Space dimension.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// Number of points of the mesh.
    pub fn points(&self) -> usize {
        self.points
    }

    /// Whether the mesh repeats periodically.
    pub fn is_periodic(&self) -> bool {
        self.periodic
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.corners.len() / corners_per_cell(self.dimension)
    }

    /// Whether there are no cells.
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// Corners of cell `k`.
    pub fn cell(&self, k: usize) -> &[Corner] {
        let size = corners_per_cell(self.dimension);
        &self.corners[k * size..(k + 1) * size]
    }

    /// Faces of the outer surface (3 corners each; edges with 2 in the plane), normals outward.
    pub fn hull(&self) -> impl Iterator<Item = &[Corner]> {
        self.hull.chunks_exact(corners_per_cell(self.dimension) - 1)
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        size_of::<Corner>() * (self.corners.len() + self.hull.len())
    }

    /// Volume (m³, area in the plane) of a cell and the outward area vectors (m²) of the faces opposite to each of its
    /// corners.
    pub(crate) fn geometry(&self, k: usize, position: &[Vec3], period: Option<&Period>) -> (f64, [Vec3; 4]) {
        let cell = self.cell(k);
        let x0 = cell[0].place(position, period);
        let e = |i: usize| cell[i].place(position, period) - x0;
        if self.dimension == Dimension::Two {
            let (e1, e2) = (e(1), e(2));
            let normal = |d: Vec3| Vec3::new(d.y, -d.x, 0.0);
            let volume = 0.5 * (e1.x * e2.y - e1.y * e2.x);
            return (volume, [normal(e2 - e1), normal(-e2), normal(e1), Vec3::zeros()]);
        }
        let (e1, e2, e3) = (e(1), e(2), e(3));
        let (s1, s2, s3) = (e3.cross(&e2) * 0.5, e1.cross(&e3) * 0.5, e2.cross(&e1) * 0.5);
        (-e3.dot(&s3) / 3.0, [-(s1 + s2 + s3), s1, s2, s3])
    }

    /// Faces that belong to a single cell; an error if a face belongs to more than two, or if a periodic mesh has such
    /// faces.
    fn free_faces(&self) -> Result<Vec<Corner>, OperatorError> {
        let size = corners_per_cell(self.dimension);
        // Faces with their corners sorted and moved so that the first has image 0, followed by the cell and the
        // opposite corner, from which the order of the corners follows.
        let mut faces: Vec<([Corner; 3], u32)> = Vec::with_capacity(self.len() * size);
        for k in 0..self.len() {
            for opposite in 0..size {
                faces.push((self.face_key(k, opposite), (k * size + opposite) as u32));
            }
        }
        faces.sort_unstable();
        let mut hull = Vec::new();
        for group in faces.chunk_by(|f, g| f.0 == g.0) {
            let open = group.len() == 1;
            if group.len() > 2 || (open && self.periodic) {
                let points = group[0].0[..size - 1].iter().map(|c| c.point).collect();
                return Err(OperatorError::OpenFaces { what: "mesh", points });
            }
            if open {
                let number = group[0].1 as usize;
                hull.extend_from_slice(&self.face(number / size, number % size)[..size - 1]);
            }
        }
        Ok(hull)
    }

    /// Corners of the face of cell `k` opposite to one of its corners, in outward order.
    fn face(&self, k: usize, opposite: usize) -> [Corner; 3] {
        let c = self.cell(k);
        if self.dimension == Dimension::Two {
            let (first, second) = ((opposite + 1) % 3, (opposite + 2) % 3);
            return [c[first], c[second], Corner::default()];
        }
        let [i, j, l] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]][opposite];
        [c[i], c[j], c[l]]
    }

    fn face_key(&self, k: usize, opposite: usize) -> [Corner; 3] {
        let count = corners_per_cell(self.dimension) - 1;
        let mut face = self.face(k, opposite);
        face[..count].sort_unstable();
        let origin = face[0].image;
        for corner in &mut face[..count] {
            for (i, o) in corner.image.iter_mut().zip(origin) {
                *i -= o;
            }
        }
        // Two images of one point among the corners may have changed their order.
        face[..count].sort_unstable();
        face
    }
}

fn corners_per_cell(dimension: Dimension) -> usize {
    if dimension == Dimension::Two { 3 } else { 4 }
}

/// Area vector (m²; length vector in the plane, m) of a face of [`Mesh::hull`].
pub(crate) fn face_area(corners: &[Vec3]) -> Vec3 {
    match corners {
        [a, b] => Vec3::new(b.y - a.y, a.x - b.x, 0.0),
        [a, b, c] => (b - a).cross(&(c - a)) * 0.5,
        _ => Vec3::zeros(),
    }
}
