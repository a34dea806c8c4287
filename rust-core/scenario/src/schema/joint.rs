//! Joints of rock.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use concordem_contact::math::Vec3;

use super::quantity::{Angle, Dimension, Length, Number, Quantity, Stress};

/// Stiffness per area, Pa/m.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct OfJointStiffness;

impl Dimension for OfJointStiffness {
    const NAME: &'static str = "stiffness per area";
    const UNITS: &'static [&'static str] = &["Pa/m", "MPa/m", "GPa/m"];
}

/// Stiffness per area, Pa/m.
pub type JointStiffness = Quantity<OfJointStiffness>;

/// A joint of rock, or a set of parallel ones: bonds and contacts between particles on its two sides are smooth joints, which slide along
/// it whatever the directions between the particles. Stiffnesses and strengths act on the areas of the bonds, π times the smaller radius
/// squared, which may add up to more than the plane. Needs the law "jointed" for bonds and contacts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Joint {
    /// Where the joint lies at the start. Required. Example: `shape = { kind = "plane", point = [0, 0, 0], normal = [0, 1, 1] }`.
    pub shape: JointShape,
    /// Normal stiffness per area, Pa/m. Required. In YADE: `jointNormalStiffness`. Example: `normal_stiffness = "100 GPa/m"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub normal_stiffness: JointStiffness,
    /// Shear stiffness per area, Pa/m. Required. In YADE: `jointShearStiffness`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub shear_stiffness: JointStiffness,
    /// Tensile strength, Pa; default: 0, none of its own: then the friction cone ends the bonds, at cohesion / friction coefficient. In
    /// YADE: `jointTensileStrength`.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub tensile_strength: Stress,
    /// Shear strength without normal force, Pa; default: 0. Without both strengths the joint is open from the start, and its two faces only
    /// press and slide. In YADE: `jointCohesion`.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub cohesion: Stress,
    /// Tangent of the angle of friction; or give `friction_angle`.
    #[schemars(extend("minimum" = 0))]
    pub friction_coefficient: Option<Number>,
    /// Angle of friction, rad. In YADE: `jointFrictionAngle`.
    #[schemars(extend("minimum" = 0))]
    pub friction_angle: Option<Angle>,
    /// Angle at which the faces climb while they slide, rad; default: 0. At most the angle of friction. In YADE: `jointDilationAngle`.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub dilation_angle: Angle,
}

impl Joint {
    /// Coefficient of friction, if one is given.
    pub(crate) fn friction(&self) -> Option<f64> {
        self.friction_coefficient.map(Quantity::si).or_else(|| self.friction_angle.map(|angle| angle.si().tan()))
    }
}

/// Where a joint lies at the start. A particle belongs to the side on which its center lies; one on the joint to the front, to which the
/// normal points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum JointShape {
    /// An infinite plane, or several parallel ones.
    Plane {
        /// A point of the plane, of several the first, m. Required.
        point: [Length; 3],
        /// Normal, of any length; or give `dip`. Example: `normal = [0, 0.5, 1]`.
        normal: Option<[Number; 3]>,
        /// Angle between the plane and the horizontal, rad, 0 to 90°; z points up. Example: `dip = "60 deg"`.
        dip: Option<Angle>,
        /// Horizontal direction in which the plane falls, rad; default: 0, along y. 90° is along x, as on a map whose north is y.
        dip_direction: Option<Angle>,
        /// Number of planes; default: 1.
        #[serde(default = "one")]
        #[schemars(extend("minimum" = 1, "maximum" = 1000))]
        count: u32,
        /// Distance from one plane to the next, along the normal, m. Required with a `count` above 1.
        #[schemars(extend("exclusiveMinimum" = 0))]
        spacing: Option<Length>,
    },
    /// A circular disc.
    Disc {
        /// Center, m. Required.
        center: [Length; 3],
        /// Normal, of any length; or give `dip`.
        normal: Option<[Number; 3]>,
        /// Angle between the disc and the horizontal, rad, 0 to 90°; z points up.
        dip: Option<Angle>,
        /// Horizontal direction in which the disc falls, rad; default: 0, along y. 90° is along x.
        dip_direction: Option<Angle>,
        /// Radius, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
    },
    /// The triangles of an STL file. Their corners run the same way round, so that all have the front on one side.
    Facets {
        /// Path of the STL file, relative to the scenario. Required. Example: `path = "joint.stl"`.
        path: String,
        /// Length of one unit of the file, m; default: 1 m. Example for a file in millimeters: `unit = "1 mm"`.
        #[serde(default = "super::packing::one_meter")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        unit: Length,
    },
}

/// How a plane joint lies: its normal, or its dip and the direction of the dip.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Orientation {
    pub normal: Option<[Number; 3]>,
    pub dip: Option<Angle>,
    pub dip_direction: Option<Angle>,
}

impl Orientation {
    /// The unit normal, which points up if the dip is given. Zero if neither is given, or the normal is zero.
    pub fn unit_normal(&self) -> Vec3 {
        if let Some(dip) = self.dip.map(Quantity::si) {
            let direction = self.dip_direction.map_or(0.0, Quantity::si);
            let (up, along) = (libm::cos(dip), libm::sin(dip));
            return Vec3::new(along * libm::sin(direction), along * libm::cos(direction), up);
        }
        let normal = self.normal.map_or(Vec3::zeros(), |normal| Vec3::from(normal.map(Quantity::si)));
        normal.try_normalize(0.0).unwrap_or_default()
    }
}

impl JointShape {
    /// Unit normal of a plane or a disc; zero if none is given.
    pub fn unit_normal(&self) -> Option<Vec3> {
        Some(self.orientation()?.unit_normal())
    }

    /// How a plane or a disc lies.
    pub(crate) fn orientation(&self) -> Option<Orientation> {
        match *self {
            Self::Plane { normal, dip, dip_direction, .. } | Self::Disc { normal, dip, dip_direction, .. } => {
                Some(Orientation { normal, dip, dip_direction })
            }
            Self::Facets { .. } => None,
        }
    }
}

fn one() -> u32 {
    1
}
