//! Bond of four linear springs: along, across, in bending, and in twist.
//!
//! The stored energy is `U = ½k_n u² + ½k_s (½l₀)²‖θ_A+θ_B‖² + ½k_b ‖θ_B−θ_A‖² + ½k_t τ²`, with the elongation `u` (m), the
//! rotation vectors of both ends `θ_A`, `θ_B` and the twist `τ` (rad), and the reference length `l₀` (m). Forces and moments are
//! its derivatives. A bond whose normal force reaches the strength breaks.

use super::{ContactGeometry, ContactLaw, EnergySplit, Response, Status, Stiffness};
use crate::kinematics::{FrameKinematics, RestFrame};
use crate::math::Vec3;
#[cfg(feature = "std")]
use {
    super::{
        common::{ParameterError, mean_strength, require},
        table::{Fault, LawTable, RegisteredLaw},
    },
    crate::quantity::{self, Force, RotationalStiffness},
    schemars::JsonSchema,
    serde::{Deserialize, Serialize},
};

/// Parameters of a hinge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hinge {
    /// `k_n`, N/m.
    pub normal: f64,
    /// `k_s`, N/m.
    pub shear: f64,
    /// `k_b`, N·m/rad.
    pub bending: f64,
    /// `k_t`, N·m/rad.
    pub twist: f64,
    /// Normal force at which the bond breaks, N; infinite: never.
    pub strength: f64,
}

crate::law_state! {
    /// History of a [`Hinge`]: its unloaded state, see [`RestFrame`].
    pub struct HingeState {
        /// Direction of the unloaded bond in the axes half way between those of the bodies.
        rest_direction: Vec3, "1", Odd;
        /// Vector part of the rotation from either body to these axes.
        rest_rotation: Vec3, "1", Odd;
    }
}

impl ContactLaw for Hinge {
    type State = HingeState;
    type Kinematics = FrameKinematics;
    const NAME: &'static str = "hinge";

    #[inline(always)]
    fn respond(&self, kinematics: &FrameKinematics, old: &HingeState, _dt: f64) -> Response<HingeState> {
        let point = &kinematics.point;
        // The first evaluation, before which the history is zero, defines the unloaded state.
        let rest = if old.rest_direction == Vec3::zeros() {
            kinematics.rest()
        } else {
            RestFrame { direction: old.rest_direction, rotation: old.rest_rotation }
        };
        let rotations = kinematics.rotations(&rest);
        let (sum, difference) = (rotations.a + rotations.b, rotations.b - rotations.a);
        let half = 0.5 * point.geometry.reference_length;

        // Derivatives of the energy.
        let axial = self.normal * point.elongation;
        let (by_shear, by_bending) = (sum * (self.shear * half * half), difference * self.bending);
        let by_twist = self.twist * rotations.twist;
        let loads = rotations.loads(point.length, axial, [by_shear - by_bending, by_shear + by_bending], by_twist);

        let state = HingeState { rest_direction: rest.direction, rest_rotation: rest.rotation };
        let mut energy = EnergySplit {
            stored_normal: 0.5 * axial * point.elongation,
            stored_shear: 0.5 * by_shear.dot(&sum),
            stored_bending: 0.5 * by_bending.dot(&difference),
            stored_twist: 0.5 * by_twist * rotations.twist,
            ..EnergySplit::default()
        };
        if axial >= self.strength || rotations.turned_too_far() || !point.bonded {
            // The stored energy is released. The forces of this step are void, and half of their work with them.
            energy.damage = energy.stored();
            energy.integration = -0.5 * kinematics.work(&loads.force, &loads.moment_a, &loads.moment_b);
            return Response { force: Vec3::zeros(), moment: Vec3::zeros(), state, status: Status::Broke, energy };
        }
        Response { force: loads.force, moment: loads.moment(), state, status: Status::Lives, energy }
    }

    fn stiffness(&self, _geometry: &ContactGeometry) -> Stiffness {
        let Self { normal, shear, bending, twist, .. } = *self;
        Stiffness { normal, shear, bending, twist, ..Stiffness::default() }
    }
}

/// Bond of linear springs along, across, in bending, and in twist.
#[cfg(feature = "std")]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HingeTable {
    /// Spring along the bond, N/m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub normal_stiffness: quantity::Stiffness,
    /// Spring across the bond, N/m.
    #[schemars(extend("minimum" = 0))]
    pub shear_stiffness: quantity::Stiffness,
    /// Spring in bending, N·m/rad.
    #[schemars(extend("minimum" = 0))]
    pub bending_stiffness: RotationalStiffness,
    /// Spring in twist, N·m/rad.
    #[schemars(extend("minimum" = 0))]
    pub twisting_stiffness: RotationalStiffness,
    /// Tensile force at which a bond breaks, N; never when left out.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tensile_strength: Option<Force>,
}

#[cfg(feature = "std")]
impl LawTable for HingeTable {
    /// Springs between discs are per unit of depth.
    fn fault_in_plane(&self) -> Option<Fault> {
        None
    }
}

#[cfg(feature = "std")]
impl RegisteredLaw for Hinge {
    type Table = HingeTable;
    type Unbonded = Self;
    const TITLE: &'static str = "hinge";
    const AS_BOND: Option<&'static str> = Some("Bond of linear springs that bends and twists.");

    fn row(a: &HingeTable, b: &HingeTable) -> Result<Self, ParameterError> {
        let mean = |of: fn(&HingeTable) -> f64| 0.5 * (of(a) + of(b));
        let hinge = Self {
            normal: mean(|table| table.normal_stiffness.si()),
            shear: mean(|table| table.shear_stiffness.si()),
            bending: mean(|table| table.bending_stiffness.si()),
            twist: mean(|table| table.twisting_stiffness.si()),
            strength: mean_strength(a.tensile_strength.map(Force::si), b.tensile_strength.map(Force::si)),
        };
        let sound = |value: f64| value >= 0.0 && value.is_finite();
        require(
            hinge.normal > 0.0 && sound(hinge.normal),
            Self::NAME,
            "normal_stiffness",
            hinge.normal,
            "positive (N/m)",
        )?;
        require(sound(hinge.shear), Self::NAME, "shear_stiffness", hinge.shear, "zero or positive (N/m)")?;
        require(sound(hinge.bending), Self::NAME, "bending_stiffness", hinge.bending, "zero or positive (N*m/rad)")?;
        require(sound(hinge.twist), Self::NAME, "twisting_stiffness", hinge.twist, "zero or positive (N*m/rad)")?;
        require(hinge.strength > 0.0, Self::NAME, "tensile_strength", hinge.strength, "positive (N)")?;
        Ok(hinge)
    }

    fn unbonded_row(a: &HingeTable, b: &HingeTable) -> Result<Self, ParameterError> {
        Self::row(a, b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance::Native;
    use crate::conformance::frame::{FrameSubject, check};

    fn conforms(subject: &FrameSubject<Native<Hinge>>) {
        let report = check(subject);
        println!("{report}");
        assert!(report.passed(), "{report}");
    }

    #[test]
    fn hinge_conforms() {
        let hinge = Hinge { normal: 1e6, shear: 4e5, bending: 3e5, twist: 2e5, strength: f64::INFINITY };
        let elastic = FrameSubject {
            name: "hinge",
            host: Native(hinge),
            geometry: ContactGeometry {
                reference_length: 2.1,
                area: 1.0,
                radius_a: 0.8,
                radius_b: 1.2,
                mass_a: 1.0,
                mass_b: 2.0,
            },
            elongation: 0.4,
            rotation: 0.7,
            twist: 2.0,
            failure: None,
            dt: 1e-3,
        };
        conforms(&elastic);
        // Breaks at an elongation of 0.2 m; the paths of the other checks stay below.
        let host = Native(Hinge { strength: 2e5, ..hinge });
        conforms(&FrameSubject { name: "brittle hinge", host, elongation: 0.1, failure: Some(0.4), ..elastic });
    }
}
