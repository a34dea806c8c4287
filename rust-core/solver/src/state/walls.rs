//! Walls: a rigid [`Surface`], or a [`Mesh`] whose vertices move, and the motion of the wall.

use std::sync::Arc;

use super::Cell;
use super::mesh::Mesh;
use super::surface::{self, Surface};
use concordem_contact::math::Vec3;
pub use concordem_contact::wall::ClosestPoint;

/// Shape of a wall at zero displacement.
#[derive(Debug, Clone)]
pub enum WallShape {
    /// A rigid surface, which stays what it was.
    Rigid(Arc<dyn Surface>),
    /// Triangles whose vertices move on their own, touched from both sides. The wall itself has no displacement and no velocity.
    Mesh(Mesh),
}

impl WallShape {
    /// A rigid surface.
    pub fn rigid(surface: impl Surface + 'static) -> Self {
        Self::Rigid(Arc::new(surface))
    }

    /// The surface.
    pub fn surface(&self) -> &dyn Surface {
        match self {
            Self::Rigid(surface) => surface.as_ref(),
            Self::Mesh(mesh) => mesh,
        }
    }
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
#[derive(Debug, Clone)]
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
    /// Sum of the normal parts of these forces in the last step, N, positive where particles press: of a cylinder around them, the forces sum to
    /// zero, and these do not. Not part of a checkpoint.
    pub pressing: f64,
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
            pressing: 0.0,
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
        self.shape.surface().elements()
    }

    /// Closest point of element `element` to the point `x` (m); `None` where its direction is undefined, as on an axis or a triangle.
    pub fn closest_point(&self, element: usize, x: &Vec3) -> Option<ClosestPoint> {
        self.shape.surface().closest_point(element, &(x - self.displacement))
    }

    /// Distance of the point `x` (m) from element `element`, m, negative behind it; also where [`Self::closest_point`] is `None`.
    pub fn distance(&self, element: usize, x: &Vec3) -> f64 {
        surface::distance(self.shape.surface(), element, &(x - self.displacement))
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
        if found.distance < 0.0 && self.shape.surface().is_sheet_in_cell() {
            return Some(ClosestPoint { normal: -found.normal, distance: -found.distance, interior: true });
        }
        Some(found)
    }

    /// Whether the wall repeats with a periodic cell; otherwise what prevents it.
    ///
    /// # Errors
    /// What prevents it: see [`Surface::repeats_with`].
    pub fn repeats_with(&self, cell: &Cell) -> Result<(), &'static str> {
        self.shape.surface().repeats_with(cell)
    }

    /// Images of a wall without [`Self::bounds`] near the point `x` (m): see [`Surface::images_near`].
    pub fn images_near(&self, x: &Vec3, reach: f64, cell: &Cell) -> Vec<[i64; 3]> {
        self.shape.surface().images_near(&(x - self.displacement), reach, cell)
    }

    /// Center and radius (m) of a ball around element `element`; `None` for surfaces that are one element, which are few and may be large.
    pub fn bounds(&self, element: usize) -> Option<(Vec3, f64)> {
        let (center, radius) = self.shape.surface().ball(element)?;
        Some((center + self.displacement, radius))
    }

    /// Lowest and highest place along the unit vector `along`, m; `None` where the wall has no end.
    pub fn span(&self, along: &Vec3) -> Option<[f64; 2]> {
        let moved = self.displacement.dot(along);
        self.shape.surface().span(along).map(|span| span.map(|place| place + moved))
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
