//! Walls, sets of particles, and what is done to them.

pub use concordem_solver::state::LoadLever;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::packing::Axis;
use super::quantity::{AngularVelocity, Component, Force, Inertia, Length, Mass, Moment, Number, Velocity};

/// A wall: a surface that particles touch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// Name, for output.
    pub name: Option<String>,
    /// Its surface.
    pub shape: WallShape,
    /// Name of its material.
    pub material: String,
    /// Velocity, m/s.
    #[serde(default)]
    pub velocity: [Velocity; 3],
}

/// Surface of a wall.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum WallShape {
    /// Plane.
    Plane {
        /// A point on it, m.
        point: [Length; 3],
        /// Direction from the wall towards the particles; of any length.
        normal: [Number; 3],
    },
    /// The six faces of a box, particles inside.
    Box {
        /// Corner of smallest coordinates, m.
        minimum: [Length; 3],
        /// Corner of largest coordinates, m.
        maximum: [Length; 3],
    },
    /// Endless circular cylinder.
    Cylinder {
        /// A point on its axis, m.
        center: [Length; 3],
        /// Direction of its axis.
        #[serde(default)]
        axis: Axis,
        /// Radius, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
        /// Where the particles are.
        #[serde(default)]
        side: Side,
    },
    /// Triangles of an STL file; they act from both sides.
    Facets {
        /// STL file, relative to the scenario.
        path: String,
        /// Length of one unit of the file: `"1 mm"` for a file in millimetres.
        #[serde(default = "super::packing::one_metre")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        unit: Length,
    },
}

/// Side of a cylinder.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// Inside.
    #[default]
    Inside,
    /// Outside.
    Outside,
}

/// A named set of particles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ParticleSet {
    /// Name.
    pub name: String,
    /// Which particles, by their place at the start.
    pub selection: Selection,
    /// Material of these particles; a later set overrides an earlier one.
    pub material: Option<String>,
}

/// A choice of particles, spheres added by `[[clump]]` among them; by place means that the centre is inside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Selection {
    /// All.
    All,
    /// Inside a box.
    Box {
        /// Corner of smallest coordinates, m.
        minimum: [Length; 3],
        /// Corner of largest coordinates, m.
        maximum: [Length; 3],
    },
    /// Inside a sphere.
    Sphere {
        /// Centre, m.
        center: [Length; 3],
        /// Radius, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
    },
    /// Within a distance of one end of the bounding box of all spheres.
    Layer {
        /// Direction.
        axis: Axis,
        /// Which end.
        end: End,
        /// Thickness, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        thickness: Length,
    },
    /// By number, counted from 0 in the order of the packing; spheres added by `[[clump]]` come behind it.
    Ids {
        /// The numbers.
        #[schemars(length(min = 1))]
        ids: Vec<u32>,
    },
}

/// End of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum End {
    /// Smallest coordinate.
    Minimum,
    /// Largest coordinate.
    Maximum,
}

/// A motion prescribed to the particles of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Prescribe {
    /// Name of the set.
    pub set: String,
    /// Velocity by component, m/s; "free" leaves a component to the forces. It is the velocity in space in a driven periodic
    /// cell, too: [0, 0, 0] holds a particle where it is while the cell moves past it. Only with the kinematics "yade" and
    /// "yade-ratcheting" the cell carries it along, as YADE's cell does with blocked bodies: the velocity then changes with
    /// the cell's velocity gradient L by dL x and by L v dt.
    #[serde(default)]
    pub velocity: [Component<super::quantity::dimension::OfVelocity>; 3],
    /// Angular velocity by component, rad/s; "free" leaves a component to the moments.
    #[serde(default)]
    pub angular_velocity: [Component<super::quantity::dimension::OfAngularVelocity>; 3],
}

/// A rigid body of several spheres.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Clump {
    /// Name of a set of packed particles to be joined; or give `spheres`.
    pub set: Option<String>,
    /// Spheres added to the packing, one `[x, y, z, radius]` each, m; or give `set`.
    pub spheres: Option<Vec<[Length; 4]>>,
    /// Name of the material of added spheres, whatever their sets say; by default that of their sets, else the first one.
    pub material: Option<String>,
    /// Mass, kg; by default that of the spheres, overlaps counted once per sphere.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub mass: Option<Mass>,
    /// Moments of inertia about the body's principal axes, kg·m², smallest first; by default those of the spheres.
    #[schemars(transform = super::quantity::positive_items)]
    pub inertia: Option<[Inertia; 3]>,
    /// Velocity of the centre of mass at the start, m/s; by default that which `[[initial]]` gives all of its members, else
    /// none.
    pub velocity: Option<[Velocity; 3]>,
    /// Angular velocity at the start, rad/s; none by default.
    pub angular_velocity: Option<[AngularVelocity; 3]>,
}

/// A constant force on each particle of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AppliedForce {
    /// Name of the set.
    pub set: String,
    /// Force on each particle, N.
    #[serde(default)]
    pub force: [Force; 3],
    /// Moment on each particle, N·m.
    #[serde(default)]
    pub moment: [Moment; 3],
    /// Where the force acts; it matters to deformable particles only.
    #[serde(default)]
    pub acts: LoadLever,
}

/// Velocity of the particles of a set at the start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Initial {
    /// Name of the set.
    pub set: String,
    /// Velocity, m/s.
    #[serde(default)]
    pub velocity: [Velocity; 3],
    /// Angular velocity, rad/s.
    #[serde(default)]
    pub angular_velocity: [AngularVelocity; 3],
}
