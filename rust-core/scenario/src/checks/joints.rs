//! Checks of joints.

use super::Checker;
use crate::schema::{Joint, JointShape, LawName};

impl Checker<'_> {
    pub(super) fn joints(&mut self) {
        let scenario = self.scenario;
        if scenario.joints.is_empty() {
            return;
        }
        let of_bonds = scenario.bonds.as_ref().map(|bonds| bonds.law);
        for (key, law) in [("bonds.law", of_bonds), ("contacts.law", scenario.contacts.law.law())] {
            if law != Some(LawName::Jointed) {
                let key = if key == "bonds.law" && law.is_none() { "joint[0]" } else { key };
                let help = "write law = \"jointed\" in [bonds] and in [contacts], or remove the joints";
                self.conflict(key, "only bonds and contacts of the law \"jointed\" can lie on joints", help);
            }
        }
        for (what, given) in [
            ("the joints would have to continue in the next cell", scenario.packing.is_periodic()),
            ("joints do not expand, and conduct no heat", scenario.heat.is_some()),
            ("bonds along fibers do not know joints", scenario.fibers.is_some()),
            ("[[bonding]] makes bonds that do not know joints", !scenario.bondings.is_empty()),
        ] {
            if given {
                self.conflict("joint[0]", format!("cannot be combined: {what}"), "remove one of the two");
            }
        }
        for (at, joint) in scenario.joints.iter().enumerate() {
            self.joint(&format!("joint[{at}]"), joint);
        }
    }

    fn joint(&mut self, key: &str, joint: &Joint) {
        let right = std::f64::consts::FRAC_PI_2;
        for (name, angle) in [("friction_angle", joint.friction_angle), ("dilation_angle", Some(joint.dilation_angle))]
        {
            if let Some(given) = angle.filter(|angle| angle.si() >= right) {
                let help = format!("plain numbers are radians; did you mean \"{} deg\"?", given.si());
                self.range(&format!("{key}.{name}"), "must be less than a right angle", help);
            }
        }
        match joint.friction() {
            None => {
                let help = "add `friction_angle = \"30 deg\"`, or `friction_coefficient = 0.6` (the tangent)";
                self.missing(
                    &format!("{key}.friction_angle"),
                    "neither `friction_angle` nor `friction_coefficient`",
                    help,
                );
            }
            Some(_) if joint.friction_angle.is_some() && joint.friction_coefficient.is_some() => {
                let help = "keep one: `friction_coefficient` is the tangent of `friction_angle`";
                self.conflict(
                    &format!("{key}.friction_angle"),
                    "both `friction_angle` and `friction_coefficient`",
                    help,
                );
            }
            // Rounding of a tangent.
            Some(friction) if friction >= 0.0 && joint.dilation_angle.si().tan() > friction * (1.0 + 1e-12) => {
                let help = "lower it; a joint that climbs more steeply than it rubs would gain energy";
                self.range(&format!("{key}.dilation_angle"), "is larger than the angle of friction", help);
            }
            Some(_) => {}
        }
        match &joint.shape {
            JointShape::Plane { normal, count, spacing, .. } => {
                self.joint_normal(key, normal);
                if *count > 1 && spacing.is_none() {
                    let help = "give the distance from one plane to the next";
                    self.missing(&format!("{key}.shape.spacing"), "several planes need a spacing", help);
                }
                if *count == 1 && spacing.is_some() {
                    let help = "give `count`, or remove the key";
                    self.conflict(&format!("{key}.shape.spacing"), "has no effect on one plane", help);
                }
            }
            JointShape::Disc { normal, .. } => self.joint_normal(key, normal),
            JointShape::Facets { .. } => {}
        }
    }

    fn joint_normal(&mut self, key: &str, normal: &[crate::schema::quantity::Number; 3]) {
        if super::components(normal).iter().all(|x| *x == 0.0) {
            self.range(&format!("{key}.shape.normal"), "has no direction", "give the normal, such as [0, 0, 1]");
        }
    }
}
