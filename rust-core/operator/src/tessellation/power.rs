//! Power (Laguerre) diagram: the cell of a point p is where its power `|x − x_p|² − R_p²` is smallest. Equal or zero
//! radii give the Voronoi diagram.
//!
//! Every face is computed separately: the radical plane of two particles, cut by the radical planes of all others and
//! by the domain. There is no topology that rounding could break: a vertex that several planes share within rounding
//! changes areas only by rounding. Faces are exact to rounding of their coordinates, also in degenerate lattices.

use rayon::prelude::*;

use super::{check_points, spacing, wrapped};
use crate::error::{OperatorError, check_finite, check_length, check_volume};
use crate::interruption::Watch;
use crate::region::HalfSpace;
use crate::strain::Dimension;
use concordem_contact::math::{Mat3, Vec3, any_perpendicular};

/// Domain of the diagram.
#[derive(Debug, Clone, PartialEq)]
pub enum Domain {
    /// A box (z is ignored in the plane).
    Box {
        /// Lower corner, m.
        low: Vec3,
        /// Upper corner, m.
        high: Vec3,
    },
    /// Intersection of half-spaces that encloses all points.
    HalfSpaces(Vec<HalfSpace>),
    /// A periodic cell with these edges as columns, m.
    Periodic(Mat3),
}

impl Domain {
    /// An error if the sides of the domain are not finite.
    fn check(&self) -> Result<(), OperatorError> {
        match self {
            Self::Box { low, high } => check_finite("sides of the domain", &[*low, *high]),
            Self::HalfSpaces(planes) => {
                let sides: Vec<Vec3> = planes.iter().flat_map(|plane| [plane.point, plane.normal]).collect();
                check_finite("sides of the domain", &sides)
            }
            Self::Periodic(edges) => check_finite("edges of the cell", edges.as_slice()),
        }
    }

    fn half_spaces(&self, plane: bool) -> Vec<HalfSpace> {
        match self {
            Self::Box { low, high } => (0..if plane { 2 } else { 3 })
                .flat_map(|k| {
                    let normal = Vec3::ith(k, 1.0);
                    [HalfSpace { point: *low, normal: -normal }, HalfSpace { point: *high, normal }]
                })
                .collect(),
            Self::HalfSpaces(planes) => {
                planes.iter().map(|p| HalfSpace { point: p.point, normal: p.normal.normalize() }).collect()
            }
            Self::Periodic(_) => Vec::new(),
        }
    }
}

/// The other side of a face.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Neighbor {
    /// Another particle, or one of its images.
    Particle {
        /// Index.
        point: u32,
        /// Image, in numbers of cell edges.
        image: [i32; 3],
    },
    /// The border of the domain: number of the half-space (box: x low, x high, y low, …).
    Border(u32),
}

/// A face of the diagram.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// Particle it belongs to (of two, the one with the lower index).
    pub point: u32,
    /// What lies behind.
    pub neighbor: Neighbor,
    /// Area times unit normal, away from the particle, m² (m in the plane).
    pub area: Vec3,
    /// From the particle to the centroid of the face, m.
    pub centroid: Vec3,
    /// Distance of the particle from the plane of the face, m (negative if it lies behind it).
    pub distance: f64,
    /// From the particle to the neighbor's center (border: to the centroid), m.
    pub branch: Vec3,
}

/// Power diagram of particles.
#[derive(Debug, Clone, PartialEq)]
pub struct PowerDiagram {
    /// Space dimension.
    pub dimension: Dimension,
    /// Faces, each once, by particle; faces on the border of the domain included.
    pub faces: Vec<Face>,
    /// Volume of each particle's cell, m³.
    pub volumes: Vec<f64>,
}

impl PowerDiagram {
    /// Volume of all cells, m³.
    pub fn volume(&self) -> f64 {
        self.volumes.iter().sum()
    }

    /// Faces on the border of the domain, in order.
    pub fn border(&self) -> impl Iterator<Item = &Face> {
        self.faces.iter().filter(|face| matches!(face.neighbor, Neighbor::Border(_)))
    }
}

/// Power diagram of particles at `position` (m) with `radius` (m; zeros: Voronoi diagram) within a domain.
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::strain::Dimension;
/// use concordem_operator::tessellation::{Domain, power_diagram};
///
/// // Two equal spheres share a box of 2 m³.
/// let position = [Vec3::new(0.5, 0.5, 0.5), Vec3::new(1.5, 0.5, 0.5)];
/// let domain = Domain::Box { low: Vec3::zeros(), high: Vec3::new(2.0, 1.0, 1.0) };
/// let diagram = power_diagram(&position, &[0.5, 0.5], &domain, Dimension::Three).unwrap();
/// assert!((diagram.volumes[0] - 1.0).abs() < 1e-12);
/// ```
pub fn power_diagram(
    position: &[Vec3],
    radius: &[f64],
    domain: &Domain,
    dimension: Dimension,
) -> Result<PowerDiagram, OperatorError> {
    check_length("radius", radius.len(), position.len(), "particle")?;
    check_points(position, dimension == Dimension::Two)?;
    domain.check()?;
    if position.is_empty() {
        return Err(OperatorError::EmptyRegion { what: "particle" });
    }
    if let Some(p) = radius.iter().position(|r| !(*r >= 0.0 && r.is_finite())) {
        let demand = "radii must be finite and not negative";
        return Err(OperatorError::Constant { name: "radius", value: radius[p], demand });
    }
    let plane = dimension == Dimension::Two;
    let planes = domain.half_spaces(plane);
    for (p, x) in position.iter().enumerate() {
        if planes.iter().any(|h| (x - h.point).dot(&h.normal) > 0.0) {
            return Err(OperatorError::OpenCell { point: p });
        }
    }
    let bins = Bins::new(position, radius, domain, plane)?;
    let watch = Watch::here();
    let cell = |p| {
        watch.look();
        bins.cell(p, &planes, Cell { outlines: None, wanted: None, reach: 2.5 * bins.spacing })
    };
    let cells: Vec<(Vec<Face>, f64)> = (0..position.len()).into_par_iter().map(cell).collect::<Result<_, _>>()?;
    let mut faces = Vec::new();
    let mut volumes = Vec::with_capacity(cells.len());
    for (p, (cell, volume)) in cells.into_iter().enumerate() {
        volumes.push(volume);
        faces.extend(cell.into_iter().filter(|face| match face.neighbor {
            Neighbor::Particle { point, image } => (p as u32, [0; 3]) < (point, image),
            Neighbor::Border(_) => true,
        }));
    }
    Ok(PowerDiagram { dimension, faces, volumes })
}

/// A face between two particles, with its outline.
#[derive(Debug, Clone, PartialEq)]
pub struct Polygon {
    /// Indices of the two particles, the lower one first.
    pub pair: [u32; 2],
    /// Image of the second particle, in numbers of cell edges.
    pub image: [i32; 3],
    /// Corners of the convex polygon around the normal, m. In the plane, a strip of unit depth.
    pub corners: Vec<Vec3>,
    /// Area times unit normal, from the first particle to the second one, m² (m in the plane).
    pub area: Vec3,
}

/// The faces between the wanted pairs of particles in their power diagram; see [`power_diagram`]. Pairs without a common face have none;
/// in a small periodic cell a pair can have several.
///
/// # Errors
/// Those of [`power_diagram`].
///
/// # Panics
/// A pair names a particle that does not exist.
pub fn power_polygons(
    position: &[Vec3],
    radius: &[f64],
    domain: &Domain,
    dimension: Dimension,
    wanted: &[[u32; 2]],
) -> Result<Vec<Polygon>, OperatorError> {
    check_length("radius", radius.len(), position.len(), "particle")?;
    check_points(position, dimension == Dimension::Two)?;
    domain.check()?;
    let mut pairs: Vec<[u32; 2]> = wanted.iter().map(|&[a, b]| [a.min(b), a.max(b)]).collect();
    pairs.sort_unstable();
    pairs.dedup();
    if pairs.is_empty() {
        return Ok(Vec::new());
    }
    let bins = Bins::new(position, radius, domain, dimension == Dimension::Two)?;
    let planes = domain.half_spaces(dimension == Dimension::Two);
    let groups: Vec<&[[u32; 2]]> = pairs.chunk_by(|a, b| a[0] == b[0]).collect();
    let watch = Watch::here();
    let found: Vec<Vec<Polygon>> = groups
        .into_par_iter()
        .map(|group| {
            watch.look();
            let p = group[0][0];
            let mut outlines = Vec::new();
            let faces = bins.wanted_faces(p as usize, &planes, group, &mut outlines)?;
            let polygon = |(face, outline): (Face, Vec<Vec3>)| match face.neighbor {
                // A particle and its own image have two faces, one of each kind; the other pairs have theirs once.
                Neighbor::Particle { point, image } if group.binary_search(&[p, point]).is_ok() => Some(Polygon {
                    pair: [p, point],
                    image,
                    corners: outline.iter().map(|corner| position[p as usize] + corner).collect(),
                    area: face.area,
                }),
                _ => None,
            };
            Ok(faces.into_iter().zip(outlines).filter_map(polygon).collect())
        })
        .collect::<Result<_, OperatorError>>()?;
    Ok(found.into_iter().flatten().collect())
}

/// A neighbor and its radical plane `n·y = h`, `y` from the particle.
struct Plane {
    neighbor: Neighbor,
    normal: Vec3,
    distance: f64,
    branch: Vec3,
    /// Distance of the neighbor's center.
    reach: f64,
}

/// What is asked of the cell of a particle.
struct Cell<'a> {
    /// Receives the corners of each face, from the particle.
    outlines: Option<&'a mut Vec<Vec<Vec3>>>,
    /// Pairs whose faces are needed, sorted; `None`: all faces.
    wanted: Option<&'a [[u32; 2]]>,
    /// Distance of the farthest particles that count at first, m.
    reach: f64,
}

/// Particles sorted into bins for the neighbor search.
struct Bins<'a> {
    position: Vec<Vec3>,
    /// Cells by which the positions were wrapped.
    moved: Vec<[i32; 3]>,
    radius: &'a [f64],
    largest: f64,
    plane: bool,
    periodic: bool,
    edges: Mat3,
    inverse: Mat3,
    /// Offset subtracted from the positions (without a periodic cell).
    origin: Vec3,
    count: [i32; 3],
    start: Vec<u32>,
    members: Vec<u32>,
    spacing: f64,
    /// Radius that reaches every particle; infinite in a periodic cell.
    all: f64,
}

impl<'a> Bins<'a> {
    fn new(position: &[Vec3], radius: &'a [f64], domain: &Domain, plane: bool) -> Result<Self, OperatorError> {
        let n = position.len();
        let (periodic, mut edges, origin) = if let Domain::Periodic(edges) = domain {
            (true, *edges, Vec3::zeros())
        } else {
            let low = position.iter().fold(Vec3::repeat(f64::INFINITY), |m, x| m.inf(x));
            let high = position.iter().fold(Vec3::repeat(f64::NEG_INFINITY), |m, x| m.sup(x));
            // A box slightly larger than the extent of the points, so that none lies on its upper border.
            let size = (high - low) * 1.001;
            let least = size.max().max(f64::MIN_POSITIVE.sqrt()) * 1e-3;
            (false, Mat3::from_diagonal(&size.sup(&Vec3::repeat(least))), low)
        };
        if plane {
            edges[(2, 2)] = 1.0;
        }
        let volume = check_volume("the domain", edges.determinant().abs())?;
        let inverse = edges.try_inverse().ok_or(OperatorError::Volume { of: "the domain", volume })?;
        let relative: Vec<Vec3> = position.iter().map(|x| x - origin).collect();
        let (home, moved) = if periodic { wrapped(&relative, &edges, plane)? } else { (relative, vec![[0; 3]; n]) };
        let spacing = spacing(volume, n, plane);
        let count = [0, 1, 2].map(|k| {
            let width = 1.0 / inverse.row(k).norm();
            if plane && k == 2 { 1 } else { ((width / spacing) as i32).clamp(1, 1 << 9) }
        });
        let mut bins = Self {
            position: home,
            moved,
            radius,
            largest: radius.iter().copied().fold(0.0, f64::max),
            plane,
            periodic,
            edges,
            inverse,
            origin,
            count,
            start: Vec::new(),
            members: Vec::new(),
            spacing,
            all: if periodic { f64::INFINITY } else { 2.0 * edges.norm() },
        };
        let bin_count = count.iter().map(|&c| c as usize).product::<usize>();
        let of: Vec<usize> = bins.position.iter().map(|x| bins.number(bins.bin(x))).collect();
        let mut start = vec![0_u32; bin_count + 1];
        for &b in &of {
            start[b + 1] += 1;
        }
        for b in 0..bin_count {
            start[b + 1] += start[b];
        }
        let mut next = start.clone();
        let mut members = vec![0; n];
        for (p, &b) in of.iter().enumerate() {
            members[next[b] as usize] = p as u32;
            next[b] += 1;
        }
        (bins.start, bins.members) = (start, members);
        Ok(bins)
    }

    fn bin(&self, x: &Vec3) -> [i32; 3] {
        let s = self.inverse * x;
        [0, 1, 2].map(|k| ((s[k] * f64::from(self.count[k])).floor() as i32).clamp(0, self.count[k] - 1))
    }

    fn number(&self, bin: [i32; 3]) -> usize {
        ((bin[2] * self.count[1] + bin[1]) * self.count[0] + bin[0]) as usize
    }

    /// Radical planes with all particles within `reach` of particle `p`, nearest first.
    fn planes(&self, p: usize, reach: f64, planes: &mut Vec<Plane>) {
        planes.clear();
        let x = self.position[p];
        let at = self.bin(&x);
        let extent = [0, 1, 2].map(|k| {
            if self.plane && k == 2 {
                return 0;
            }
            let bin_width = 1.0 / self.inverse.row(k).norm() / f64::from(self.count[k]);
            let bins = (reach / bin_width).ceil();
            if self.periodic { bins as i32 } else { bins.min(f64::from(self.count[k])) as i32 }
        });
        let own = self.radius[p];
        // Bins, of which there are images in a periodic cell only.
        let [along_x, along_y, along_z] = [0, 1, 2].map(|k| {
            let range = at[k] - extent[k]..=at[k] + extent[k];
            let is_known = move |bin: &i32| self.periodic || (0..self.count[k]).contains(bin);
            range.filter(is_known).map(move |bin| (bin.rem_euclid(self.count[k]), bin.div_euclid(self.count[k])))
        });
        for (z, image_z) in along_z {
            for (y, image_y) in along_y.clone() {
                for (x_bin, image_x) in along_x.clone() {
                    let image = [image_x, image_y, image_z];
                    let number = self.number([x_bin, y, z]);
                    let shift = self.edges * Vec3::from(image.map(f64::from));
                    for &q in &self.members[self.start[number] as usize..self.start[number + 1] as usize] {
                        let q = q as usize;
                        if q == p && image == [0; 3] {
                            continue;
                        }
                        let branch = self.position[q] + shift - x;
                        let length = branch.norm();
                        if length > reach {
                            continue;
                        }
                        let normal = branch / length;
                        let r = self.radius[q];
                        let distance = 0.5 * (length + (own - r) * ((own + r) / length));
                        // In terms of the given positions, before wrapping.
                        let mut named = image;
                        for (k, n) in named.iter_mut().enumerate() {
                            *n += self.moved[p][k] - self.moved[q][k];
                        }
                        let neighbor = Neighbor::Particle { point: q as u32, image: named };
                        planes.push(Plane { neighbor, normal, distance, branch, reach: length });
                    }
                }
            }
        }
        planes.sort_by(|a, b| a.reach.total_cmp(&b.reach));
    }

    /// Faces of particle `p` among which are all those with its partners in the pairs `wanted`; the corners of each, from the particle, go
    /// to `outlines`.
    fn wanted_faces(
        &self,
        p: usize,
        domain: &[HalfSpace],
        wanted: &[[u32; 2]],
        outlines: &mut Vec<Vec<Vec3>>,
    ) -> Result<Vec<Face>, OperatorError> {
        let mut cell = Cell { outlines: Some(outlines), wanted: None, reach: 2.5 * self.spacing };
        // In a cell, each image of a partner may have a face. Only all faces tell how far they may lie.
        if !self.periodic {
            let distance = |&[_, q]: &[u32; 2]| (self.position[q as usize] - self.position[p]).norm();
            let farthest = wanted.iter().map(distance).fold(0.0, f64::max);
            // With room for rounding.
            cell = Cell { wanted: Some(wanted), reach: cell.reach.max(farthest * (1.0 + 1e-9)), ..cell };
        }
        Ok(self.cell(p, domain, cell)?.0)
    }

    /// Faces and volume of the cell of particle `p`; without a meaning if only some faces are wanted, the volume.
    fn cell(
        &self,
        p: usize,
        domain: &[HalfSpace],
        Cell { mut outlines, wanted, mut reach }: Cell<'_>,
    ) -> Result<(Vec<Face>, f64), OperatorError> {
        let mut planes = Vec::new();
        let own = self.radius[p];
        let x = self.position[p];
        // `domain` refers to the given positions.
        let given = x + self.origin;
        loop {
            self.planes(p, reach, &mut planes);
            for (number, half) in domain.iter().enumerate() {
                let distance = (half.point - given).dot(&half.normal);
                planes.push(Plane {
                    neighbor: Neighbor::Border(number as u32),
                    normal: half.normal,
                    distance,
                    branch: Vec3::zeros(),
                    reach: distance,
                });
            }
            let (faces, volume, farthest) = self.faces(p, &planes, 4.0 * reach, wanted, outlines.as_deref_mut());
            // No particle beyond `reach` has a radical plane nearer than this.
            let missed = 0.5 * (reach - (self.largest * self.largest - own * own) / reach);
            if missed >= farthest || (reach >= self.all && farthest < 3.0 * reach) {
                return Ok((faces, volume));
            }
            if (reach >= self.all && !self.periodic) || reach > 1e3 * self.spacing * (self.position.len() as f64) {
                return Err(OperatorError::OpenCell { point: p });
            }
            reach *= 1.6;
        }
    }

    /// The faces bounded by `planes`, the volume, and the distance of the farthest vertex.
    fn faces(
        &self,
        p: usize,
        planes: &[Plane],
        size: f64,
        wanted: Option<&[[u32; 2]]>,
        mut outlines: Option<&mut Vec<Vec<Vec3>>>,
    ) -> (Vec<Face>, f64, f64) {
        if let Some(outlines) = &mut outlines {
            outlines.clear();
        }
        let mut faces = Vec::new();
        let (mut volume, mut farthest) = (0.0, 0.0_f64);
        let mut polygon: Vec<Vec3> = Vec::new();
        let mut cut: Vec<Vec3> = Vec::new();
        let is_wanted = |plane: &Plane| match (wanted, plane.neighbor) {
            (None, _) => true,
            (Some(pairs), Neighbor::Particle { point, .. }) => pairs.binary_search(&[p as u32, point]).is_ok(),
            (Some(_), Neighbor::Border(_)) => false,
        };
        for (k, plane) in planes.iter().enumerate().filter(|(_, plane)| is_wanted(plane)) {
            self.start_polygon(plane, size, &mut polygon);
            let mut reach = farthest_square(&polygon);
            for (other, by) in planes.iter().enumerate() {
                // Most planes lie beyond all corners, with room for rounding.
                let is_beyond = by.distance > 0.0 && by.distance * by.distance > reach * (1.0 + 1e-9);
                if other != k && !is_beyond && clip(&polygon, by, &mut cut) {
                    std::mem::swap(&mut polygon, &mut cut);
                    if polygon.is_empty() {
                        break;
                    }
                    reach = farthest_square(&polygon);
                }
            }
            let Some((area, centroid)) = area_and_centroid(&polygon, &plane.normal) else { continue };
            let depth = if self.plane { 0.0 } else { 1.0 };
            let from_axis = |v: &Vec3| Vec3::new(v.x, v.y, v.z * depth).norm();
            farthest = polygon.iter().map(from_axis).fold(farthest, f64::max);
            volume += plane.distance * area / if self.plane { 2.0 } else { 3.0 };
            if let Some(outlines) = &mut outlines {
                outlines.push(polygon.clone());
            }
            faces.push(Face {
                point: p as u32,
                neighbor: plane.neighbor,
                area: plane.normal * area,
                centroid,
                distance: plane.distance,
                branch: if matches!(plane.neighbor, Neighbor::Border(_)) { centroid } else { plane.branch },
            });
        }
        (faces, volume, farthest)
    }

    /// A square in the plane, large enough to be cut on all sides; in two dimensions a strip of unit depth.
    fn start_polygon(&self, plane: &Plane, size: f64, polygon: &mut Vec<Vec3>) {
        let (n, center) = (plane.normal, plane.normal * plane.distance);
        let (s, t) = if self.plane {
            (Vec3::new(-n.y, n.x, 0.0) * size, Vec3::new(0.0, 0.0, 0.5))
        } else {
            let s = any_perpendicular(&n);
            (s * size, n.cross(&s) * size)
        };
        polygon.clear();
        polygon.extend([center - s - t, center + s - t, center + s + t, center - s + t]);
    }
}

/// Square of the distance of the farthest corner.
fn farthest_square(polygon: &[Vec3]) -> f64 {
    polygon.iter().map(Vec3::norm_squared).fold(0.0, f64::max)
}

/// Writes the part of a convex polygon in front of a plane (Sutherland and Hodgman 1974); whether that is not all of it, else `out` is not written.
fn clip(polygon: &[Vec3], by: &Plane, out: &mut Vec<Vec3>) -> bool {
    let side = |v: &Vec3| by.normal.dot(v) - by.distance;
    if polygon.iter().all(|v| side(v) <= 0.0) {
        return false;
    }
    out.clear();
    let Some(mut last) = polygon.last() else { return true };
    let mut last_side = side(last);
    for v in polygon {
        let this_side = side(v);
        if (last_side > 0.0) != (this_side > 0.0) {
            out.push(last + (v - last) * (last_side / (last_side - this_side)));
        }
        if this_side <= 0.0 {
            out.push(*v);
        }
        (last, last_side) = (v, this_side);
    }
    true
}

/// Area and centroid of a convex polygon; `None` if it has no inside.
fn area_and_centroid(polygon: &[Vec3], normal: &Vec3) -> Option<(f64, Vec3)> {
    let [first, rest @ ..] = polygon else { return None };
    let (mut area, mut moment) = (0.0, Vec3::zeros());
    for w in rest.windows(2) {
        let (a, b) = (w[0] - first, w[1] - first);
        let twice = a.cross(&b).dot(normal);
        area += twice;
        moment += (a + b) * twice;
    }
    (area > 0.0).then(|| (0.5 * area, first + moment / (3.0 * area)))
}
