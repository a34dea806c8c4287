//! Walls, sets of particles, clumps, and the motions and forces prescribed to them.

pub use concordem_solver::state::PointOfAction;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::packing::Axis;
use super::quantity::{
    Angle, AngularVelocity, Area, Component, Force, Inertia, Length, Mass, Moment, Number, StrainRate, Stress, Time,
    Velocity,
};
use crate::walls::WallShape;

/// A rigid wall that particles touch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// Name in results; default: "wall N", counted from 0. Example: `name = "floor"`.
    pub name: Option<String>,
    /// Surface of the wall. Required. Example: `shape = { kind = "plane", point = [0, 0, 0], normal = [0, 0, 1] }`.
    pub shape: WallShape,
    /// Name of the material of the wall. Required.
    pub material: String,
    /// Velocity of the wall, m/s; default: zero. Example: `velocity = [0, 0, "-1 mm/s"]`.
    #[serde(default)]
    pub velocity: [Velocity; 3],
    /// Name of a history that multiplies the velocity, or the force or pressure of the servo; default: constant.
    pub history: Option<String>,
    /// Rotation about the normal of a "plane" or a round "plate", or the axis of a "cylinder"; default: none. Particles feel the velocity
    /// of the turning surface. Example: `rotation = { angular_velocity = "10 rad/s" }`.
    pub rotation: Option<WallRotation>,
    /// Servo: the wall moves until it presses on the particles with a given force or pressure. Default: none, the wall moves with
    /// `velocity`. Example: `servo = { pressure = "2 MPa", maximum_speed = "0.1 m/s" }`.
    pub servo: Option<Servo>,
    /// Motion of the vertices of a "mesh"; default: none, they stay where they are, or where Python puts them. Only for "mesh".
    /// Example: `motion = { rotation = [0, 0, "360 deg"], center = [0, 0, 0], history = "turn" }`.
    pub motion: Option<MeshMotion>,
}

impl Wall {
    /// Names of its surfaces, six for a box; `number`: its index among all walls.
    pub fn names(&self, number: usize) -> Vec<String> {
        let name = self.name.clone().unwrap_or_else(|| format!("wall {number}"));
        self.shape.kind().faces().iter().map(|face| format!("{name}{face}")).collect()
    }
}

/// Motion of the vertices of a mesh, over the change `g` of a history's factor since the start: a vertex that starts at `X` is at
/// `c + d g + R(X + u g - c)`. `R` rotates by `g` times the rotation vector about the center `c`; `d` is the displacement of all
/// vertices, and `u` that of the vertex alone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshMotion {
    /// Name of the history. Required. Example: `history = "turn"`.
    pub history: String,
    /// Displacement of all vertices at the change 1, m; default: zero. Example: `displacement = [0, 0, "-1 mm"]`.
    #[serde(default)]
    pub displacement: [Length; 3],
    /// Rotation vector at the change 1, rad: its direction is the axis, its length the angle; default: zero. Needs `center`.
    pub rotation: Option<[Angle; 3]>,
    /// A point on the axis of the rotation, m. Required with `rotation`.
    pub center: Option<[Length; 3]>,
    /// Displacements of the single vertices at the change 1, m, one row per vertex in the order of the mesh; default: none.
    /// They rotate with `rotation`. Example: `vertices = [[0, 0, 0], ["1 mm", 0, 0], [0, 0, 0]]`.
    pub vertices: Option<Vec<[Length; 3]>>,
}

/// Rotation of a plane or a round plate about its normal, or of a cylinder about its axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WallRotation {
    /// Angular velocity, rad/s, by the right-hand rule about the normal or the axis. Required. Example:
    /// `angular_velocity = "10 rad/s"`.
    pub angular_velocity: AngularVelocity,
    /// A point of the axis about which a "plane" turns, m; it moves with the wall. Default: the `point` of the shape. Not for a
    /// "cylinder" and a "plate", which turn about their own axes.
    pub point: Option<[Length; 3]>,
    /// Name of a history that multiplies the angular velocity; default: constant.
    pub history: Option<String>,
}

/// A servo: the wall moves along its direction with the speed `min(g (F0 - F), maximum_speed)`, F being the force on the particles
/// in the last step. The gain g follows from the stiffness of the contacts, so that the wall does not oscillate. With `opening` the
/// wall moves so that the elongation of a gauge is a given one, as in `loading.opening`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Servo {
    /// Wanted force on the particles, N. Required unless `pressure` or `opening` is given. Not for a "box".
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub force: Option<Force>,
    /// Wanted pressure on the particles, Pa. Required unless `force` or `opening` is given. Each face of a "box" has it.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub pressure: Option<Stress>,
    /// Area on which the pressure acts, m². Required with `pressure`, but not for a "box": the pressure on its faces acts on their
    /// present area between the neighboring faces. Example: `area = "36 mm^2"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub area: Option<Area>,
    /// Direction in which the wall pushes, a vector of any length. Required for "cylinder", "plate", and "facets", which move as a whole;
    /// a "plane" and the faces of a "box" push along their normals.
    pub direction: Option<[Number; 3]>,
    /// Wanted elongation of a gauge, m, positive or negative: that which grows as the wall moves along its direction. Required unless
    /// `force` or `pressure` is given. The `history` of the wall multiplies it. Not for a "box". Example: `opening = "0.1 mm"`.
    pub opening: Option<Length>,
    /// Name of a `[[sample]]` with the operator "gauge". Required with `opening`. Example: `gauge = "crack mouth"`.
    pub gauge: Option<String>,
    /// Time in which the wall makes up for an error of the opening, s, about a quarter of the period of the slowest vibration
    /// of the specimen. Required with `opening`. Example: `response_time = "50 us"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub response_time: Option<Time>,
    /// Displacement of the wall per error of the opening, at once; default: 0.5. Only with `opening`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub gain: Option<Number>,
    /// Largest speed of the wall, m/s. Required. It has this speed until a tenth of the force is missing. Example:
    /// `maximum_speed = "0.1 m/s"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub maximum_speed: Velocity,
}

/// A named set of particles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ParticleSet {
    /// Name of the set. Required. Example: `name = "top"`.
    pub name: String,
    /// Particles of the set, by their initial position or number. Required.
    /// Example: `selection = { kind = "layer", axis = "z", end = "maximum", thickness = "2 mm" }`.
    pub selection: Selection,
    /// Name of the material of these particles; default: unchanged. A later set overrides an earlier one.
    pub material: Option<String>,
}

/// A selection of particles, including the spheres of `[[clump]]`; a particle is inside a shape if its center is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Selection {
    /// All particles.
    All,
    /// Particles inside a box.
    Box {
        /// Corner with the smallest coordinates, m. Required.
        minimum: [Length; 3],
        /// Corner with the largest coordinates, m. Required.
        maximum: [Length; 3],
    },
    /// Particles inside a sphere.
    Sphere {
        /// Center, m. Required.
        center: [Length; 3],
        /// Radius, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
    },
    /// Particles within a distance of one end of the bounding box of all spheres.
    Layer {
        /// Axis of the layer. Required.
        axis: Axis,
        /// End of the axis. Required.
        end: End,
        /// Thickness of the layer, m. Required. Example: `thickness = "2 mm"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        thickness: Length,
    },
    /// Particles by number, counted from 0 in the order of the packing; the spheres of `[[clump]]` follow.
    Ids {
        /// Numbers of the particles. Required. Example: `ids = [0, 1]`.
        #[schemars(length(min = 1))]
        ids: Vec<u32>,
    },
}

/// End of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum End {
    /// End with the smallest coordinate.
    Minimum,
    /// End with the largest coordinate.
    Maximum,
}

/// A prescribed motion of the particles of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Prescribe {
    /// Name of the set. Required.
    pub set: String,
    /// Velocity, m/s; a component "free" follows the forces. Default: all components free.
    /// Example: `velocity = ["free", "free", "1 mm/s"]`.
    ///
    /// In a driven periodic cell, too, this is the velocity in space: `[0, 0, 0]` holds a particle in place while the cell
    /// deforms. With the kinematics "yade" and "yade-ratcheting" the cell carries the particle along, as
    /// YADE's cell does with blocked bodies; the velocity then changes by dL x when the velocity gradient L changes, and
    /// by L v dt in each step.
    #[serde(default)]
    pub velocity: [Component<super::quantity::dimension::OfVelocity>; 3],
    /// Angular velocity, rad/s; a component "free" follows the moments. Default: all components free.
    /// Example: `angular_velocity = [0, 0, 0]`.
    #[serde(default)]
    pub angular_velocity: [Component<super::quantity::dimension::OfAngularVelocity>; 3],
    /// Displacement, m, which needs a `history`: this vector times the change of the factor since the start, so that the particles
    /// start where the packing has them. A component "free" follows the forces, or `velocity`. Default: all components free.
    /// Example: `displacement = ["free", "free", "1 mm"]`.
    #[serde(default)]
    pub displacement: [Component<super::quantity::dimension::OfLength>; 3],
    /// Velocity field: the velocity follows from the present position. Default: none.
    /// Example: `field = { kind = "rotation", point = [0, 0, 0], axis = [0, 0, 1], angular_velocity = "10 rad/s" }`.
    pub field: Option<VelocityField>,
    /// Name of a history that multiplies velocity, angular velocity, displacement, and field; default: constant velocities.
    pub history: Option<String>,
}

/// A velocity field, which prescribes the velocity of a set by its present positions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum VelocityField {
    /// Rotation of the set as a rigid body: the particles stay on circles about the axis, and turn about their centers with the
    /// same angular velocity.
    Rotation {
        /// A point of the axis, m. Required.
        point: [Length; 3],
        /// Direction of the axis, a vector of any length. Required. Example: `axis = [0, 0, 1]`.
        axis: [Number; 3],
        /// Angular velocity, rad/s, by the right-hand rule. Required. Example: `angular_velocity = "10 rad/s"`.
        angular_velocity: AngularVelocity,
        /// Axes along which the particles follow the forces instead of the field; default: none. Example: `free = ["z"]`.
        #[serde(default)]
        free: Vec<Axis>,
    },
    /// Affine motion `v = L (x - x0)`: strain, rotation, or both. Rotations of the particles follow `angular_velocity`.
    Linear {
        /// The point `x0` without velocity, m; default: the origin.
        #[serde(default)]
        point: [Length; 3],
        /// Velocity gradient L, 1/s: row i, column j is the derivative of velocity component i along axis j. Required.
        /// Example, pure shear: `velocity_gradient = [[0, 0.1, 0], [0.1, 0, 0], [0, 0, 0]]`.
        velocity_gradient: [[StrainRate; 3]; 3],
        /// Axes along which the particles follow the forces instead of the field; default: none. Example: `free = ["z"]`.
        #[serde(default)]
        free: Vec<Axis>,
    },
}

impl VelocityField {
    /// Axes along which the particles follow the forces.
    pub fn free(&self) -> &[Axis] {
        match self {
            Self::Rotation { free, .. } | Self::Linear { free, .. } => free,
        }
    }
}

/// A rigid body made of several spheres.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Clump {
    /// Name of a set of packed particles to join. Required unless `spheres` is given.
    pub set: Option<String>,
    /// Spheres added to the packing, one `[x, y, z, radius]` each, m. Required unless `set` is given.
    pub spheres: Option<Vec<[Length; 4]>>,
    /// Name of the material of the added spheres; overrides the materials of sets. Default: the material of their sets, else
    /// the first material.
    pub material: Option<String>,
    /// Mass, kg; default: the sum over the spheres, which counts overlaps twice.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub mass: Option<Mass>,
    /// Principal moments of inertia, kg·m², smallest first; default: those of the spheres.
    #[schemars(transform = super::quantity::positive_items)]
    pub inertia: Option<[Inertia; 3]>,
    /// Initial velocity of the center of mass, m/s; default: the velocity that `[[initial]]` gives to all members, else
    /// zero.
    pub velocity: Option<[Velocity; 3]>,
    /// Initial angular velocity, rad/s; default: zero.
    pub angular_velocity: Option<[AngularVelocity; 3]>,
}

/// A force on each particle of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AppliedForce {
    /// Name of the set. Required.
    pub set: String,
    /// Force on each particle, N; default: zero. Example: `force = [0, 0, "-10 N"]`.
    #[serde(default)]
    pub force: [Force; 3],
    /// Moment on each particle, N·m; default: zero.
    #[serde(default)]
    pub moment: [Moment; 3],
    /// Name of a history that multiplies force and moment; default: constant.
    pub history: Option<String>,
    /// Point of action of the force on deformable particles; default: "body". Rigid particles ignore it.
    #[serde(default)]
    pub acts: PointOfAction,
}

/// Initial velocity of the particles of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Initial {
    /// Name of the set. Required.
    pub set: String,
    /// Initial velocity, m/s; default: zero. Example: `velocity = ["1 m/s", 0, 0]`.
    #[serde(default)]
    pub velocity: [Velocity; 3],
    /// Initial angular velocity, rad/s; default: zero.
    #[serde(default)]
    pub angular_velocity: [AngularVelocity; 3],
}
