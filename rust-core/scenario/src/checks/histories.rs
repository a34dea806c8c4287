//! Checks of histories, of what follows them, and of stages.

use super::Checker;
use crate::schedule::{Expression, ExpressionFault, History};
use crate::schema::quantity::{Component, Number, Time, vector};
use crate::schema::{Control, HistoryShape, Loading, Prescribe, Stage, StageStop, VelocityField};
use concordem_contact::kinematics::MotionMeasure;

/// Sign of the strain that the loading makes at a positive rate; `None` if the specimen or a servo decides.
fn direction_of_strain(loading: &Loading) -> Option<f64> {
    if loading.opening().is_some() {
        return None;
    }
    // The strain of a cell is the component with the largest rate.
    let largest = |rates: &mut dyn Iterator<Item = f64>| rates.reduce(|a, b| if b.abs() > a.abs() { b } else { a });
    let rate = match loading {
        Loading::Uniaxial { strain_rate, .. } => strain_rate.si(),
        Loading::Platens { .. } => -1.0,
        Loading::Flexure { .. } => 1.0,
        Loading::Bending { rate, .. } | Loading::Torsion { rate, .. } => rate.si(),
        Loading::CellStrain { velocity_gradient } => {
            largest(&mut velocity_gradient.iter().flatten().map(|rate| rate.si()))?
        }
        Loading::CellStress { strain_rate, .. } => largest(&mut strain_rate.iter().filter_map(|rate| rate.si()))?,
        Loading::None => return None,
    };
    (rate != 0.0).then(|| rate.signum())
}

impl Checker<'_> {
    /// Histories and the tables that name them.
    pub(super) fn histories(&mut self) {
        let scenario = self.scenario;
        let names: Vec<&str> = scenario.histories.iter().map(|history| history.name.as_str()).collect();
        self.unique("history", &names);
        for (at, history) in scenario.histories.iter().enumerate() {
            if let HistoryShape::Expression { expression, until } = &history.shape {
                self.expression(&format!("history[{at}].shape"), expression, *until);
            }
            let HistoryShape::Table { points, repeat, .. } = &history.shape else { continue };
            let key = format!("history[{at}].shape.points");
            if let Some(k) = points.windows(2).position(|pair| pair[0].0.si() >= pair[1].0.si()) {
                let message = format!("the time of point {} is not later than that of point {k}", k + 1);
                self.range(&key, message, "sort the points by time, and give each time once");
            }
            if *repeat && points.len() < 2 {
                self.range(&key, "one point cannot repeat", "give at least two points");
            }
        }
        for (key, name) in scenario.named_histories() {
            self.known(&key, "history", name, &names);
        }
        for (at, prescribe) in scenario.prescribed.iter().enumerate() {
            self.prescribed_history(at, prescribe);
        }
        for (at, wall) in scenario.walls.iter().enumerate() {
            let mesh = wall.shape.kind().is_mesh();
            if wall.history.is_some() && !mesh && wall.servo.is_none() && wall.velocity.iter().all(|v| v.si() == 0.0) {
                let help = "give the `velocity` that the history multiplies, or remove `history`";
                self.conflict(&format!("wall[{at}].history"), "multiplies a velocity of zero", help);
            }
        }
    }

    /// A formula: its text, and values that are numbers.
    fn expression(&mut self, shape: &str, text: &str, until: Option<Time>) {
        let key = format!("{shape}.expression");
        let expression = match Expression::parse(text) {
            Ok(expression) => expression,
            Err(ExpressionFault { at, message, help }) => {
                self.range(&key, format!("at character {}: {message}", at + 1), help);
                // Point at the fault, where the file has the formula in quotes as it is.
                if let Some(problem) = self.problems.last_mut() {
                    let written = self.document.written(&problem.span);
                    if written.get(1..written.len().max(1) - 1) == Some(text) {
                        problem.span.start += 1 + at;
                        problem.span.end = problem.span.start;
                    }
                }
                return;
            }
        };
        let Some(until) = until.or(self.scenario.stop.time) else {
            let help = "give `until`, the longest time at which the formula is used, or stop.time";
            self.missing(&format!("{shape}.until"), "the bounds of the formula need an end of their search", help);
            return;
        };
        let history = History::Formula { expression, until: until.si() };
        if let Some((time, value)) = history.trials().find(|(_, value)| !value.is_finite()) {
            let help = "change the formula so that it has a value at all times from 0 to `until`";
            self.range(&key, format!("is {value} at t = {time} s"), help);
        }
    }

    fn prescribed_history(&mut self, at: usize, prescribe: &Prescribe) {
        let key = format!("prescribe[{at}]");
        let moved: Vec<usize> = (0..3).filter(|&i| prescribe.displacement[i] != Component::Free).collect();
        if !moved.is_empty() && prescribe.history.is_none() {
            let help = "name a [[history]] whose factor the displacement follows: history = \"NAME\"";
            self.missing(&format!("{key}.displacement"), "a displacement needs a history", help);
        }
        for i in moved {
            if prescribe.velocity[i] != Component::Free {
                let help = "write \"free\" for this component of `velocity` or of `displacement`";
                self.conflict(
                    &format!("{key}.displacement[{i}]"),
                    "the velocity of this component is given, too",
                    help,
                );
            }
        }
        self.field(&key, prescribe);
        let carried = matches!(self.scenario.kinematics, MotionMeasure::Yade | MotionMeasure::YadeRatcheting);
        if prescribe.history.is_some() && carried && self.scenario.loading.drives_cell() {
            let message = "in a driven cell the kinematics of YADE change prescribed velocities, too";
            self.conflict(&format!("{key}.history"), message, "use kinematics = \"finite\"");
        }
    }

    /// A velocity field.
    fn field(&mut self, key: &str, prescribe: &Prescribe) {
        let Some(field) = &prescribe.field else { return };
        let help =
            "keep the field, or the components; the other one belongs into another [[prescribe]] with another set";
        for (name, given) in [
            ("velocity", prescribe.velocity.iter().any(|component| *component != Component::Free)),
            ("displacement", prescribe.displacement.iter().any(|component| *component != Component::Free)),
        ] {
            if given {
                self.conflict(&format!("{key}.{name}"), "the field prescribes the velocity", help);
            }
        }
        if let VelocityField::Rotation { axis, .. } = field {
            if prescribe.angular_velocity.iter().any(|component| *component != Component::Free) {
                self.conflict(&format!("{key}.angular_velocity"), "the field prescribes the angular velocity", help);
            }
            if vector(axis).norm() == 0.0 {
                self.range(&format!("{key}.field.axis"), "must not be zero", "axis = [0, 0, 1] is along z");
            }
        }
        let free = field.free();
        if (0..free.len()).any(|k| free[..k].contains(&free[k])) {
            self.range(&format!("{key}.field.free"), "names an axis twice", "name each axis once");
        } else if free.len() == 3 {
            let help = "remove an axis from `free`, or remove the field";
            self.conflict(&format!("{key}.field.free"), "prescribes no component of the velocity", help);
        }
        if self.scenario.packing.is_periodic() {
            let help = "use \"cell-strain\" loading, or a packing without a cell";
            let message = "in a periodic cell a particle and its image would have different velocities";
            self.conflict(&format!("{key}.field"), message, help);
        }
    }

    /// Stages of the loading.
    pub(super) fn stages(&mut self) {
        let scenario = self.scenario;
        let names: Vec<&str> = scenario.stages.iter().map(|stage| stage.name.as_str()).collect();
        self.unique("stage", &names);
        for (at, stage) in scenario.stages.iter().enumerate() {
            self.stage(&format!("stage[{at}]"), stage);
        }
    }

    /// Warns of stages that strain the specimen away from the strain at which they should end.
    pub(super) fn strains_behind(&mut self) {
        let Some(direction) = direction_of_strain(&self.scenario.loading) else { return };
        // Strain at which the stage begins, where it is known.
        let mut start = Some(0.0);
        for (at, stage) in self.scenario.stages.iter().enumerate() {
            let by_strain_alone = stage.control != Control::Stress
                && stage.stop == StageStop { strain: stage.stop.strain, ..StageStop::default() };
            let Some(target) = stage.stop.strain.filter(|_| by_strain_alone).map(Number::si) else {
                start = None;
                continue;
            };
            let ahead = start.map(|start| (target - start) * direction * stage.rate.si());
            if stage.history.is_none() && ahead.is_some_and(|ahead| ahead <= 0.0) {
                let what = match direction * stage.rate.si() {
                    rate if rate > 0.0 => "raises",
                    rate if rate < 0.0 => "lowers",
                    _ => "holds",
                };
                let message = format!(
                    "the stage {what} the strain from {}, and does not come to this one; unless the run continues another one, it never ends",
                    start.unwrap_or(0.0)
                );
                let help = "tension is positive: check the signs of the strain, of `rate`, and of the loading";
                self.warn(&format!("stage[{at}].stop.strain"), message, help);
            }
            start = Some(target);
        }
    }

    fn stage(&mut self, key: &str, stage: &Stage) {
        let stop = &stage.stop;
        let never = stop.strain.is_none()
            && stop.stress.is_none()
            && stop.drop_to.is_none()
            && stop.time.is_none()
            && stop.steps.is_none()
            && stop.unbalanced.is_none();
        if never {
            let help = "give at least one of `strain`, `stress`, `drop_to`, `time`, `steps`, and `unbalanced`";
            self.missing(&format!("{key}.stop"), "nothing ever ends the stage", help);
        }
        let loading = &self.scenario.loading;
        if matches!(loading, Loading::None) {
            let help = "add [loading], or remove the key";
            for (name, given) in [
                ("rate", stage.rate.si() != 1.0),
                ("history", stage.history.is_some()),
                ("stop.strain", stop.strain.is_some()),
                ("stop.stress", stop.stress.is_some()),
            ] {
                if given {
                    self.conflict(&format!("{key}.{name}"), "has no effect on a run without loading", help);
                }
            }
        }
        if stage.control == Control::Stress && !matches!(loading, Loading::CellStress { .. }) {
            let help = "use \"cell-stress\" loading with `strain_rate`, or remove `control`";
            self.conflict(&format!("{key}.control"), "this loading has no axes that follow their stress", help);
        }
        if stop.drop_to.is_some() && !loading.has_peak() {
            let help = "use it with \"uniaxial\", \"platens\", or \"cell-strain\" loading";
            self.conflict(&format!("{key}.stop.drop_to"), "this loading has no peak stress to drop from", help);
        }
    }

    /// Warns of histories that no table names.
    pub(super) fn unused_histories(&mut self) {
        let scenario = self.scenario;
        for (at, history) in scenario.histories.iter().enumerate() {
            if scenario.named_histories().iter().all(|(_, name)| *name != history.name) {
                let help = "name it in a [[prescribe]], [[force]], [[wall]], [[membrane]], [[stage]], [[heat.source]], or [[heat.boundary]], or remove it";
                self.warn(&format!("history[{at}].name"), "nothing follows this history", help);
            }
        }
    }
}

impl crate::schema::Scenario {
    /// The histories that the tables name, with the keys that name them.
    fn named_histories(&self) -> Vec<(String, &str)> {
        fn each<'a>(table: &str, names: impl Iterator<Item = &'a Option<String>>) -> Vec<(String, &'a str)> {
            let given = names.enumerate().filter_map(|(at, name)| Some((at, name.as_deref()?)));
            given.map(|(at, name)| (format!("{table}[{at}].history"), name)).collect()
        }
        let mut all = each("prescribe", self.prescribed.iter().map(|table| &table.history));
        all.extend(each("force", self.forces.iter().map(|table| &table.history)));
        all.extend(each("wall", self.walls.iter().map(|table| &table.history)));
        all.extend(each("membrane", self.membranes.iter().map(|table| &table.history)));
        let motions = self.walls.iter().enumerate().filter_map(|(at, wall)| Some((at, wall.motion.as_ref()?)));
        all.extend(motions.map(|(at, motion)| (format!("wall[{at}].motion.history"), &motion.history[..])));
        for (at, wall) in self.walls.iter().enumerate() {
            if let Some(name) = wall.rotation.as_ref().and_then(|rotation| rotation.history.as_deref()) {
                all.push((format!("wall[{at}].rotation.history"), name));
            }
        }
        all.extend(each("stage", self.stages.iter().map(|table| &table.history)));
        if let Some(heat) = &self.heat {
            all.extend(each("heat.source", heat.sources.iter().map(|table| &table.history)));
            all.extend(each("heat.boundary", heat.boundaries.iter().map(|table| &table.history)));
        }
        all
    }
}
