//! Walls: planes, cylinders, [`FiniteShape`]s, and triangle surfaces with prescribed motion; [`Mesh`] for triangles with moving vertices.
//!
//! In a periodic cell, which must be at rest, walls have images like particles: image i is the wall moved by `H i`. A
//! plane across one of the edges is then a sheet that particles touch from both sides, because the next image of the
//! space in front lies behind it.

use super::Cell;
use super::finite_walls::FiniteShape;
use super::mesh::Mesh;
use super::triangle::closest_on_triangle;
use concordem_contact::math::{Mat3, Vec3};
pub use concordem_contact::wall::ClosestPoint;

/// Shape of a wall at zero displacement.
#[derive(Debug, Clone, PartialEq)]
pub enum WallShape {
    /// Solid half-space behind a plane.
    Plane {
        /// A point of the surface, m.
        point: Vec3,
        /// Unit normal, pointing out of the wall towards the particles.
        normal: Vec3,
    },
    /// Circular cylinder, infinite along its axis.
    Cylinder {
        /// A point of the axis, m.
        point: Vec3,
        /// Unit vector of the axis.
        axis: Vec3,
        /// Radius, m.
        radius: f64,
        /// Whether particles are inside (a vessel) or outside (a rod).
        inside: bool,
    },
    /// Plate, rod, or tube.
    Finite(FiniteShape),
    /// Triangles, which particles touch from both sides.
    Facets {
        /// Corners, m.
        triangles: Vec<[Vec3; 3]>,
    },
    /// Triangles whose vertices move on their own, touched from both sides. The wall itself has no displacement and no velocity.
    Mesh(Mesh),
}

/// Rotation of a plane or disc about its normal, or of a cylinder, rod, or tube about its axis: the surface slides, and its place stays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turning {
    /// A point of the axis at zero displacement, m.
    pub center: Vec3,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vec3,
    /// Angular velocity in the last step, rad/s, with which its contacts have moved.
    pub previous: Vec3,
}

/// A wall.
#[derive(Debug, Clone, PartialEq)]
pub struct Wall {
    /// Name in the scenario.
    pub name: String,
    /// Shape at zero displacement.
    pub shape: WallShape,
    /// Material, index into the model's table.
    pub material: u16,
    /// Displacement so far, m.
    pub displacement: Vec3,
    /// Velocity, m/s.
    pub velocity: Vec3,
    /// Velocity in the last step, m/s; the work of its second half belongs to it.
    pub previous_velocity: Vec3,
    /// Rotation about its own axis, if it turns.
    pub turning: Option<Turning>,
    /// Force of the particles on the wall in the last step, N.
    pub force: Vec3,
    /// Its moment about the origin of the displaced wall, N·m.
    pub torque: Vec3,
}

impl Wall {
    /// A wall at its initial place, not yet loaded, with a constant velocity (m/s) so far.
    pub fn new(name: impl Into<String>, shape: WallShape, material: u16, velocity: Vec3) -> Self {
        let zero = Vec3::zeros();
        let name = name.into();
        Self {
            name,
            shape,
            material,
            displacement: zero,
            velocity,
            previous_velocity: velocity,
            turning: None,
            force: zero,
            torque: zero,
        }
    }

    /// Velocity (m/s) in the last step of the surface at the point `x` (m), and angular velocity (rad/s).
    pub fn motion_at(&self, x: &Vec3) -> (Vec3, Vec3) {
        self.turning.map_or((self.velocity, Vec3::zeros()), |turning| {
            let arm = x - self.displacement - turning.center;
            (self.velocity + turning.previous.cross(&arm), turning.previous)
        })
    }

    /// Power of the particles on the wall if it had this velocity (m/s) and angular velocity (rad/s), W.
    pub fn power(&self, velocity: &Vec3, angular_velocity: &Vec3) -> f64 {
        let translation = self.force.dot(velocity);
        self.turning.map_or(translation, |turning| {
            translation + (self.torque - turning.center.cross(&self.force)).dot(angular_velocity)
        })
    }

    /// Number of elements: triangles, or 1.
    pub fn element_count(&self) -> usize {
        match &self.shape {
            WallShape::Facets { triangles } => triangles.len(),
            WallShape::Mesh(mesh) => mesh.triangles().len(),
            WallShape::Plane { .. } | WallShape::Cylinder { .. } | WallShape::Finite(_) => 1,
        }
    }

    /// Closest point of element `element` to the point `x` (m); `None` where its direction is undefined: `x` on the axis of a
    /// cylinder, on a triangle, or on a plate.
    pub fn closest_point(&self, element: usize, x: &Vec3) -> Option<ClosestPoint> {
        let x = x - self.displacement;
        match &self.shape {
            WallShape::Plane { point, normal } => {
                Some(ClosestPoint { normal: -normal, distance: (x - point).dot(normal), interior: true })
            }
            WallShape::Cylinder { point, axis, radius, inside } => {
                let r = x - point;
                let radial = r - axis * r.dot(axis);
                let rho = radial.norm();
                if rho == 0.0 {
                    return None;
                }
                let outward = radial / rho;
                Some(if *inside {
                    ClosestPoint { normal: outward, distance: radius - rho, interior: true }
                } else {
                    ClosestPoint { normal: -outward, distance: rho - radius, interior: true }
                })
            }
            WallShape::Finite(shape) => shape.closest_point(&x),
            WallShape::Facets { triangles } => on_triangle(&x, &triangles[element]),
            WallShape::Mesh(mesh) => on_triangle(&x, &mesh.corners(element)),
        }
    }

    /// Distance of the point `x` (m) from element `element`, m, negative behind it; also where [`Self::closest_point`] is `None`.
    pub fn distance(&self, element: usize, x: &Vec3) -> f64 {
        if let Some(found) = self.closest_point(element, x) {
            return found.distance;
        }
        match &self.shape {
            WallShape::Cylinder { radius, inside: true, .. } => *radius,
            WallShape::Cylinder { radius, .. } => -radius,
            WallShape::Finite(shape) => shape.distance(&(x - self.displacement)),
            WallShape::Plane { .. } | WallShape::Facets { .. } | WallShape::Mesh(_) => 0.0,
        }
    }

    /// [`Self::closest_point`] of the image `image` of the wall in a periodic cell.
    pub fn closest_point_of_image(
        &self,
        element: usize,
        x: &Vec3,
        cell: Option<&Cell>,
        image: [i8; 3],
    ) -> Option<ClosestPoint> {
        let Some(cell) = cell else { return self.closest_point(element, x) };
        let found = self.closest_point(element, &(x - cell.shift(image)))?;
        if matches!(self.shape, WallShape::Plane { .. }) && found.distance < 0.0 {
            return Some(ClosestPoint { normal: -found.normal, distance: -found.distance, interior: true });
        }
        Some(found)
    }

    /// Whether the wall repeats with a periodic cell; otherwise what prevents it.
    ///
    /// # Errors
    /// A plane across more than one edge of the cell, whose images would fill the space, a cylinder along none, and a vessel or a wall
    /// of finite size that does not fit into the cell.
    pub fn repeats_with(&self, cell: &Cell) -> Result<(), &'static str> {
        match &self.shape {
            WallShape::Plane { normal, .. } if across(normal, &cell.matrix).is_none() => Err(
                "the images of a plane must not cut each other: in a periodic cell it must be parallel to two edges",
            ),
            WallShape::Cylinder { axis, radius, inside, .. } => {
                let along = along(axis, &cell.matrix).ok_or(
                    "the images of a cylinder must not cut each other: in a periodic cell its axis must be parallel to an edge",
                )?;
                let others: [usize; 2] = [(along + 1) % 3, (along + 2) % 3];
                let narrowest = others.map(|k| across_edge(cell, k).1).into_iter().fold(f64::INFINITY, f64::min);
                if *inside && 2.0 * radius > narrowest {
                    return Err("the vessel is wider than the periodic cell, so that its images cut each other");
                }
                Ok(())
            }
            WallShape::Finite(shape) => {
                let fits = (0..3).all(|edge| {
                    let (normal, width) = across_edge(cell, edge);
                    2.0 * shape.half_extent(&normal) <= width * (1.0 + PARALLEL)
                });
                fits.then_some(())
                    .ok_or("the wall is longer than the periodic cell is wide, so that its images cut each other")
            }
            WallShape::Plane { .. } | WallShape::Facets { .. } | WallShape::Mesh(_) => Ok(()),
        }
    }

    /// Images of a wall without [`Self::bounds`] nearer to the point `x` (m) than `reach` (m); of a vessel, the image that
    /// contains `x`.
    ///
    /// Image numbers may exceed the range of the flags of a contact.
    pub fn images_near(&self, x: &Vec3, reach: f64, cell: &Cell) -> Vec<[i64; 3]> {
        let x = x - self.displacement;
        match &self.shape {
            WallShape::Plane { point, normal } => {
                let Some(edge) = across(normal, &cell.matrix) else { return Vec::new() };
                let period = normal.dot(&cell.matrix.column(edge));
                let (place, reach) = ((x - point).dot(normal) / period, reach / period.abs());
                let image = |number: i64| std::array::from_fn(|k| if k == edge { number } else { 0 });
                ((place - reach).ceil() as i64..=(place + reach).floor() as i64).map(image).collect()
            }
            WallShape::Cylinder { point, axis, radius, inside } => {
                let (Some(edge), Some(inverse)) = (along(axis, &cell.matrix), cell.matrix.try_inverse()) else {
                    return Vec::new();
                };
                let r = x - point;
                let place = inverse * r;
                let distance = |image: &[i64; 3]| {
                    let r = r - cell.matrix * Vec3::from(image.map(|n| n as f64));
                    (r - axis * r.dot(axis)).norm()
                };
                let others: [usize; 2] = [(edge + 1) % 3, (edge + 2) % 3];
                let around = [0, 1, 2].map(|k| if k == edge { 0 } else { place[k].round() as i64 });
                let mut near: Vec<[i64; 3]> = (0..9)
                    .map(|k| {
                        let mut image = around;
                        image[others[0]] += k % 3 - 1;
                        image[others[1]] += k / 3 - 1;
                        image
                    })
                    .collect();
                if *inside {
                    near.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
                    near.truncate(1);
                    near.retain(|image| radius - distance(image) < reach);
                } else {
                    near.retain(|image| distance(image) - radius < reach);
                }
                near
            }
            WallShape::Finite(shape) => {
                let r = x - shape.center();
                let numbers: [Vec<i64>; 3] = std::array::from_fn(|edge| {
                    let (normal, width) = across_edge(cell, edge);
                    let (place, reach) = (r.dot(&normal) / width, (shape.half_extent(&normal) + reach) / width);
                    ((place - reach).ceil() as i64..=(place + reach).floor() as i64).collect()
                });
                let mut near = Vec::new();
                for &i in &numbers[0] {
                    for &j in &numbers[1] {
                        near.extend(numbers[2].iter().map(|&k| [i, j, k]));
                    }
                }
                near.retain(|image| {
                    let shift = cell.matrix * Vec3::from(image.map(|n| n as f64));
                    shape.distance(&(x - shift)) < reach
                });
                near
            }
            WallShape::Facets { .. } | WallShape::Mesh(_) => Vec::new(),
        }
    }

    /// Center and radius (m) of a ball around a triangle, element `element`; `None` for other shapes, which are few and may be large.
    pub fn bounds(&self, element: usize) -> Option<(Vec3, f64)> {
        let t = match &self.shape {
            WallShape::Facets { triangles } => triangles[element],
            WallShape::Mesh(mesh) => mesh.corners(element),
            WallShape::Plane { .. } | WallShape::Cylinder { .. } | WallShape::Finite(_) => return None,
        };
        let center = (t[0] + t[1] + t[2]) / 3.0;
        let radius = t.iter().map(|c| (c - center).norm()).fold(0.0, f64::max);
        Some((center + self.displacement, radius))
    }

    /// The mesh, if the wall is one.
    pub fn mesh(&self) -> Option<&Mesh> {
        if let WallShape::Mesh(mesh) = &self.shape { Some(mesh) } else { None }
    }

    /// The mesh, to be changed in place.
    pub fn mesh_mut(&mut self) -> Option<&mut Mesh> {
        if let WallShape::Mesh(mesh) = &mut self.shape { Some(mesh) } else { None }
    }

    /// Largest speed of a point of the wall in this step, m/s.
    pub fn speed(&self) -> f64 {
        self.mesh().map_or_else(|| self.velocity.norm(), |mesh| mesh.fastest().0)
    }
}

/// Sine below which two directions are parallel.
const PARALLEL: f64 = 1e-9;

/// The edge of a cell that a plane with this normal cuts, if the plane is parallel to the other two.
fn across(normal: &Vec3, edges: &Mat3) -> Option<usize> {
    let cut = |k: &usize| normal.dot(&edges.column(*k)).abs() > PARALLEL * edges.column(*k).norm();
    let mut edges_cut = (0..3).filter(cut);
    edges_cut.next().filter(|_| edges_cut.next().is_none())
}

/// Unit normal of the face of a cell that edge `edge` crosses, towards its end, and the distance of the two faces, m.
fn across_edge(cell: &Cell, edge: usize) -> (Vec3, f64) {
    let column = |k: usize| cell.matrix.column(k % 3).into_owned();
    let normal = column(edge + 1).cross(&column(edge + 2)).normalize();
    let width = normal.dot(&column(edge));
    (normal * width.signum(), width.abs())
}

/// The edge of a cell along a unit vector, if there is one.
fn along(axis: &Vec3, edges: &Mat3) -> Option<usize> {
    (0..3).find(|&k| axis.cross(&edges.column(k)).norm() < PARALLEL * edges.column(k).norm())
}

/// Closest point of a triangle as seen from `x`; `None` if `x` lies on it.
fn on_triangle(x: &Vec3, corners: &[Vec3; 3]) -> Option<ClosestPoint> {
    let (nearest, interior, _) = closest_on_triangle(x, corners);
    let to = nearest - x;
    let distance = to.norm();
    (distance > 0.0).then(|| ClosestPoint { normal: to / distance, distance, interior })
}
