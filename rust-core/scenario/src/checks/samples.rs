//! Checks of the operators that a scenario samples.

use super::Checker;
use super::structure::wording::listing;
use crate::sampling::{Operator, Refusal, RegionRule, SampleKey, Surroundings};
use crate::schema::quantity::vector;
use crate::schema::{OperatorSample, SampleRegion};
use concordem_operator::Truncation;

/// Largest number of values of one record: 0.8 GB.
const MOST_VALUES: f64 = 1e8;

/// A problem of a sample: keys that contradict each other.
pub struct Misuse {
    /// Key within the table of the sample.
    pub key: &'static str,
    /// What is wrong.
    pub message: String,
    /// The remedy.
    pub help: String,
}

impl Misuse {
    fn new(key: &'static str, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { key, message: message.into(), help: help.into() }
    }
}

impl OperatorSample {
    /// The first problem that the sample alone reveals: a key that its operator does not use, or a region that it does
    /// not accept.
    pub fn misuse(&self, dimension: u8) -> Option<Misuse> {
        self.unused_key()
            .or_else(|| self.missing_object())
            .or_else(|| self.unfit_region())
            .or_else(|| self.region_out_of_plane(dimension))
            .or_else(|| self.unfit_options(dimension))
            .or_else(|| self.unfit_grid(dimension))
    }

    /// A key that the operator does not use.
    fn unused_key(&self) -> Option<Misuse> {
        let unused = |key: &SampleKey| self.gives(*key) && !self.operator.definition().uses(*key);
        let key = SampleKey::ALL.into_iter().find(unused)?;
        let users: Vec<&str> =
            Operator::ALL.into_iter().filter(|other| other.definition().uses(key)).map(Operator::name).collect();
        // Most operators use the keys of a region; listing them all would not help.
        let help =
            if users.len() > 4 { "remove it".to_owned() } else { format!("remove it, or use {}", listing(&users)) };
        Some(Misuse::new(key.name(), format!("the operator {} does not use this key", self.operator.name()), help))
    }

    /// The wall with its area, or the sets, of an operator that reads these.
    fn missing_object(&self) -> Option<Misuse> {
        let rule = self.operator.definition().region;
        let missing = match rule {
            RegionRule::Wall => self.wall.is_none() || self.area.is_none(),
            RegionRule::WallAlone => self.wall.is_none(),
            RegionRule::Set => self.set.is_none(),
            RegionRule::TwoSets => self.sets.is_none(),
            _ => false,
        };
        missing.then(|| {
            Misuse::new("operator", format!("{} {}", self.operator.name(), rule.requirement()), rule.example())
        })
    }

    /// Whether the region is the periodic cell.
    fn is_cell(&self) -> bool {
        matches!(self.region, None | Some(SampleRegion::Cell))
    }

    /// Whether the region is a list of particles.
    fn is_list(&self) -> bool {
        self.region.as_ref().is_some_and(SampleRegion::is_list)
    }

    /// A region that the operator does not accept.
    fn unfit_region(&self) -> Option<Misuse> {
        let rule = self.operator.definition().region;
        let whole = matches!(self.region, Some(SampleRegion::All { .. }));
        let accepted = match rule {
            RegionRule::Any | RegionRule::Wall | RegionRule::WallAlone | RegionRule::Set | RegionRule::TwoSets => true,
            RegionRule::WholeBody => whole,
            RegionRule::WholeBodyOrCell => whole || self.is_cell(),
            RegionRule::PeriodicCell => self.is_cell(),
            RegionRule::Sphere => matches!(self.region, Some(SampleRegion::Sphere { .. })),
            RegionRule::Shape => !self.is_list(),
        };
        if accepted {
            return None;
        }
        let key = if self.region.is_some() { "region" } else { "operator" };
        let message = format!("the operator {} {}", self.operator.name(), rule.requirement());
        Some(Misuse::new(key, message, rule.example()))
    }

    /// A region with its own depth in two dimensions, where regions have unit depth.
    fn region_out_of_plane(&self, dimension: u8) -> Option<Misuse> {
        let solid = matches!(self.region, Some(SampleRegion::Cylinder { .. } | SampleRegion::Ellipsoid { .. }));
        (dimension == 2 && solid).then(|| {
            let help =
                "use kind = \"sphere\" for a disc, \"box\" for a rectangle, or \"half-spaces\" with the area times 1 m";
            Misuse::new("region", "with dimension = 2 regions have unit depth, but this kind has its own depth", help)
        })
    }

    /// Options that the region does not allow.
    fn unfit_options(&self, dimension: u8) -> Option<Misuse> {
        let (is_cell, is_list) = (self.is_cell(), self.is_list());
        if is_list && self.truncation == Some(Truncation::BranchClipped) {
            let message = "a list of particles has no boundary to clip at";
            return Some(Misuse::new("truncation", message, "use \"half-crossing\" or \"internal-only\""));
        }
        let fixed = is_cell || is_list || matches!(self.region, Some(SampleRegion::All { .. }));
        if self.gives(SampleKey::Velocity) && fixed {
            return Some(Misuse::new("velocity", "this region cannot move", "remove it"));
        }
        if self.gives(SampleKey::VelocityGradient) && is_cell {
            return Some(Misuse::new("velocity_gradient", "the periodic cell has its own deformation", "remove it"));
        }
        if self.gives(SampleKey::VelocityGradient) && dimension == 2 {
            let message = "in two dimensions a region of this kind cannot deform, because it has no ends along z";
            return Some(Misuse::new("velocity_gradient", message, "remove it, or move the region by `velocity`"));
        }
        None
    }

    fn unfit_grid(&self, dimension: u8) -> Option<Misuse> {
        let grid = self.grid?;
        if grid.contains(&0) {
            let help = "write for example grid = [4, 4, 8], with 1 for directions that are not divided";
            return Some(Misuse::new("grid", "the number of cells must be at least 1", help));
        }
        // In floating point, because the product may exceed the range of integers.
        let values = grid.iter().map(|n| *n as f64).product::<f64>() * self.operator.width() as f64;
        if values > MOST_VALUES {
            let message = format!(
                "each record would hold {values:.3e} numbers, {:.3e} GB; at most {MOST_VALUES:.0e} are possible",
                values * 8e-9
            );
            return Some(Misuse::new("grid", message, "use fewer cells, or a smaller box"));
        }
        if !matches!(self.region, Some(SampleRegion::Box { .. })) {
            let help = "write region = { kind = \"box\", minimum = [...], maximum = [...] }";
            return Some(Misuse::new("grid", "only a box can be divided into a grid", help));
        }
        (dimension == 2 && grid[2] != 1)
            .then(|| Misuse::new("grid", "in two dimensions a grid has one cell along z", "write grid = [4, 4, 1]"))
    }
}

impl Checker<'_> {
    pub(super) fn samples(&mut self) {
        for (at, sample) in self.scenario.samples.iter().enumerate() {
            let path = format!("sample[{at}]");
            self.sample_name(at, sample, &path);
            let misuse = sample.misuse(self.scenario.dimension);
            let misused = misuse.is_some();
            if let Some(Misuse { key, message, help }) = misuse {
                self.conflict(&format!("{path}.{key}"), message, help);
            }
            if let Some(wall) = sample.wall.as_ref().filter(|_| sample.operator.definition().uses(SampleKey::Wall)) {
                let names = self.scenario.wall_names();
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                self.known(&format!("{path}.wall"), "wall", wall, &names);
            }
            for (key, set) in
                sample.set.iter().map(|set| ("set", set)).chain(sample.sets.iter().flatten().map(|set| ("sets", set)))
            {
                self.known_set(&format!("{path}.{key}"), set);
            }
            if let Some([first, second]) = &sample.sets
                && first == second
            {
                let help = "name the set on the other side, as in sets = [\"left\", \"right\"]";
                self.conflict(&format!("{path}.sets"), "a set has no distance from itself", help);
            }
            let definition = sample.operator.definition();
            if definition.needs_heat() && self.scenario.heat.is_none() {
                let message = "the scenario has no heat conduction";
                self.conflict(&format!("{path}.operator"), message, "add [heat] with `temperature`");
            }
            let surroundings = Surroundings { is_periodic: self.scenario.packing.is_periodic() };
            if let Some(Refusal { message, help }) = (definition.check)(&surroundings) {
                self.conflict(&format!("{path}.operator"), message, help);
            }
            self.sample_region(sample, &path, misused);
        }
    }

    fn sample_name(&mut self, at: usize, sample: &OperatorSample, path: &str) {
        // A sample without a name takes the name of its operator.
        let key = if sample.name.is_some() { format!("{path}.name") } else { format!("{path}.operator") };
        let name = sample.name();
        let twice = self.scenario.samples[..at].iter().any(|other| other.name() == name);
        if name.trim().is_empty() || name.contains('/') || name.starts_with('.') {
            let message = "is not a valid name for a group of the result file";
            self.range(&key, message, "use letters, digits, hyphens, and spaces");
        } else if twice {
            self.conflict(&key, "another [[sample]] has this name", "give each its own: name = \"core stress\"");
        } else if crate::sampling::Record::COLUMNS.iter().any(|column| column.name == name) {
            let help = format!("choose another name, such as \"{name} in the core\"");
            self.conflict(&key, "the result has a time series of this name", help);
        }
    }

    fn sample_region(&mut self, sample: &OperatorSample, path: &str, misused: bool) {
        let key = format!("{path}.region");
        let needs_region = sample.operator.definition().region.has_region();
        match &sample.region {
            None | Some(SampleRegion::Cell) if needs_region && !misused && !self.scenario.packing.is_periodic() => {
                let key = if sample.region.is_some() { &key } else { path };
                let help = "give region = { kind = \"box\", minimum = [...], maximum = [...] }, or another kind";
                self.conflict(key, "the packing has no periodic cell to sample", help);
            }
            Some(SampleRegion::Box { minimum, maximum }) => self.corners(&key, minimum, maximum),
            Some(SampleRegion::Cylinder { axis, .. }) if vector(axis).norm() == 0.0 => {
                self.range(&format!("{key}.axis"), "must not be zero", "axis = [0, 0, 1] is along z");
            }
            Some(SampleRegion::Set { set, .. }) => self.known_set(&format!("{key}.set"), set),
            Some(SampleRegion::Material { material, .. }) => {
                self.known_material(&format!("{key}.material"), material);
            }
            Some(SampleRegion::HalfSpaces { planes, .. }) => {
                if planes.is_empty() {
                    let help = "planes = [{ point = [0, 0, 0], normal = [0, 0, 1] }] is all below z = 0";
                    self.range(&format!("{key}.planes"), "no planes", help);
                }
                for (k, plane) in planes.iter().enumerate() {
                    if vector(&plane.normal).norm() == 0.0 {
                        let help = "it points out of the region: normal = [0, 0, 1] bounds the region from above";
                        self.range(&format!("{key}.planes[{k}].normal"), "must not be zero", help);
                    }
                }
            }
            _ => {}
        }
    }
}
