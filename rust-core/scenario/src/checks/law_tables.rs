//! Checks of the parameter tables of single laws: keys that exclude or require each other.

use super::Checker;
use crate::schema::{BeamModel, CohesiveBeam, Cpm, CpmFormulation, DamageLaw, Frictional, YieldSurface};

impl Checker<'_> {
    /// A table of the concrete particle model.
    pub(super) fn cpm(&mut self, path: &str, cpm: &Cpm) {
        self.cpm_friction(path, cpm);
        if cpm.damage_law == DamageLaw::Linear && cpm.relative_ductility.si() <= 1.0 {
            let message = "must be greater than 1 with the linear damage law";
            let help = "it is the strain at zero stress divided by the strain at peak stress";
            self.range(&format!("{path}.relative_ductility"), message, help);
        }
        if cpm.relative_soft_stiffness.is_some() && cpm.soft_strain.is_none() {
            let help = "add `soft_strain = -3e-3`, the strain at which hardening begins, or remove it";
            self.conflict(&format!("{path}.relative_soft_stiffness"), "has no effect without `soft_strain`", help);
        }
        if cpm.relative_soft_stiffness.is_none() && cpm.soft_strain.is_some() {
            let help = "add `relative_soft_stiffness = 0.3`, the hardening modulus divided by the normal modulus";
            let message = "missing key, required by `soft_strain`";
            self.missing(&format!("{path}.relative_soft_stiffness"), message, help);
        }
        self.cpm_formulation(path, cpm);
    }

    fn cpm_friction(&mut self, path: &str, cpm: &Cpm) {
        let key = format!("{path}.friction_angle");
        match (cpm.friction_coefficient, cpm.friction_angle) {
            (None, None) => self.missing(
                &key,
                "neither `friction_angle` nor `friction_coefficient`",
                "add `friction_coefficient = 0.8` (the tangent), or `friction_angle = \"38 deg\"`",
            ),
            (Some(_), Some(_)) => self.conflict(
                &key,
                "both `friction_angle` and `friction_coefficient`",
                "keep one: `friction_coefficient` is the tangent of `friction_angle`",
            ),
            (None, Some(angle)) if angle.si() >= std::f64::consts::FRAC_PI_2 => {
                let help = format!("plain numbers are radians; did you mean \"{} deg\"?", angle.si());
                self.range(&key, "must be less than a right angle", help);
            }
            _ => {}
        }
    }

    /// Keys that only the formulation "woo" reads, and those that it requires together.
    fn cpm_formulation(&mut self, path: &str, cpm: &Cpm) {
        let woo = cpm.mode == CpmFormulation::Woo;
        let rates = [
            [("damage_time", cpm.damage_time.is_some()), ("damage_rate_exponent", cpm.damage_rate_exponent.is_some())],
            [
                ("plasticity_time", cpm.plasticity_time.is_some()),
                ("plasticity_rate_exponent", cpm.plasticity_rate_exponent.is_some()),
            ],
        ];
        for [time, exponent] in rates {
            if time.1 != exponent.1 && woo {
                let (given, missing) = if time.1 { (time.0, exponent.0) } else { (exponent.0, time.0) };
                let help = format!("add `{missing} = ...`, or remove `{given}`");
                self.conflict(&format!("{path}.{given}"), format!("`{given}` requires `{missing}`"), help);
            }
        }
        let surface =
            [("yield_surface", cpm.yield_surface.is_some()), ("yield_log_speed", cpm.yield_log_speed.is_some())];
        for (key, given) in surface.into_iter().chain(rates.into_iter().flatten()) {
            if given && !woo {
                let help = "write mode = \"woo\" for the full model, or remove this key";
                self.conflict(&format!("{path}.{key}"), "has no effect in this mode of the model", help);
            }
        }
        let logarithmic =
            matches!(cpm.yield_surface, Some(YieldSurface::Logarithmic | YieldSurface::LogarithmicLinear));
        let key = format!("{path}.yield_log_speed");
        match (logarithmic, cpm.yield_log_speed.is_some()) {
            (true, false) if woo => {
                let message = "missing key, required by a logarithmic yield surface";
                self.missing(&key, message, "add `yield_log_speed = 0.1`");
            }
            (false, true) if woo => {
                let help = "write yield_surface = \"logarithmic\" or \"logarithmic-linear\", or remove this key";
                self.conflict(&key, "has no effect with this yield surface", help);
            }
            _ => {}
        }
    }

    /// A table of the cohesive beam.
    pub(super) fn cohesive_beam(&mut self, path: &str, law: &CohesiveBeam) {
        let help = "give `radius_ratio` (relative to the mean radius of the particles) or `radius`";
        match (law.radius_ratio.is_some(), law.radius.is_some()) {
            (true, true) => self.conflict(&format!("{path}.radius"), "the radius of the beam is given twice", help),
            (false, false) => self.missing(path, "the radius of the beam is missing", help),
            _ => {}
        }
        if law.shear_coefficient.is_some() && law.model != BeamModel::Timoshenko {
            let help = "write model = \"timoshenko\", or remove this key";
            self.conflict(&format!("{path}.shear_coefficient"), "has no effect with this model", help);
        }
        let key = format!("{path}.shear_ratio");
        match (law.shear_ratio.is_some(), law.model == BeamModel::DualSpring) {
            (true, false) => {
                let help = "write model = \"dual-spring\", or remove this key";
                self.conflict(&key, "has no effect with this model", help);
            }
            (false, true) => {
                let message = "missing key, required by model \"dual-spring\"";
                self.missing(&key, message, "add `shear_ratio = 0.4`");
            }
            _ => {}
        }
    }

    /// A table of the linear frictional contact.
    pub(super) fn frictional(&mut self, path: &str, law: &Frictional) {
        let moduli = [("young", law.young.is_some()), ("stiffness_ratio", law.stiffness_ratio.is_some())];
        let springs =
            [("normal_stiffness", law.normal_stiffness.is_some()), ("shear_stiffness", law.shear_stiffness.is_some())];
        let help = "give `young` and `stiffness_ratio` (the stiffness grows with the radius), \
                    or `normal_stiffness` and `shear_stiffness` (the same for all contacts)";
        let any = |pair: &[(&str, bool); 2]| pair.iter().any(|(_, given)| *given);
        if any(&moduli) && any(&springs) {
            let key = springs.iter().find(|(_, given)| *given).map_or("normal_stiffness", |(key, _)| key);
            self.conflict(&format!("{path}.{key}"), "the stiffness is given twice", help);
        } else if !any(&moduli) && !any(&springs) {
            self.missing(path, "the stiffness is missing", help);
        } else {
            let pair = if any(&moduli) { moduli } else { springs };
            for (key, given) in pair {
                if !given {
                    self.missing(&format!("{path}.{key}"), "missing key", help);
                }
            }
        }
    }
}
