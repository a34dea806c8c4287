//! Checks of joints.

use super::Checker;
use crate::schema::{Joint, JointShape, LawName, Orientation};

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
            JointShape::Plane { count, spacing, .. } => {
                if *count > 1 && spacing.is_none() {
                    let help = "give the distance from one plane to the next";
                    self.missing(&format!("{key}.shape.spacing"), "several planes need a spacing", help);
                }
                if *count == 1 && spacing.is_some() {
                    let help = "give `count`, or remove the key";
                    self.conflict(&format!("{key}.shape.spacing"), "has no effect on one plane", help);
                }
            }
            JointShape::Disc { .. } | JointShape::Facets { .. } => {}
        }
        if let Some(orientation) = joint.shape.orientation() {
            self.joint_orientation(key, &orientation);
        }
    }

    fn joint_orientation(&mut self, key: &str, orientation: &Orientation) {
        let Orientation { normal, dip, dip_direction } = orientation;
        let of = |name: &str| format!("{key}.shape.{name}");
        match (normal, dip) {
            (None, None) => {
                let help = "give `normal`, such as [0, 0, 1], or `dip`, such as \"60 deg\"";
                self.missing(&of("normal"), "needs `normal` or `dip`", help);
            }
            (Some(_), Some(_)) => self.conflict(&of("dip"), "both `dip` and `normal`", "remove one of them"),
            (Some(normal), None) if super::components(normal).iter().all(|x| *x == 0.0) => {
                self.range(&of("normal"), "has no direction", "give the normal, such as [0, 0, 1]");
            }
            // A rounding error of a right angle.
            (None, Some(dip)) if !(0.0..=std::f64::consts::FRAC_PI_2 * (1.0 + 1e-12)).contains(&dip.si()) => {
                self.range(
                    &of("dip"),
                    "must lie between 0 and 90°",
                    "write degrees as \"60 deg\"; a plane that falls the other way has another `dip_direction`",
                );
            }
            _ => {}
        }
        if dip.is_none() && dip_direction.is_some() {
            self.conflict(&of("dip_direction"), "has no effect without `dip`", "give `dip`, or remove the key");
        }
    }
}
