//! Checks of loadings and walls that follow a gauge, and of membranes.

use super::Checker;
use super::structure::wording::{listing, nearest};
use crate::sampling::Operator;
use crate::schedule::simulation::OPENINGS;
use crate::schema::{Loading, OperatorSample, ProblemKind, Servo, Wall};

impl Checker<'_> {
    /// Control of the loading by the opening of a crack.
    pub(super) fn opening(&mut self) {
        let Some(control) = self.scenario.loading.opening() else { return };
        self.known_gauge("loading.opening.gauge", &control.gauge);
        if control.rate.si() == 0.0 {
            let help =
                "positive where the loading lengthens the gauge, negative where it shortens it: rate = \"1 mm/s\"";
            self.range("loading.opening.rate", "must not be zero", help);
        }
    }

    /// Checks that `name` is that of a gauge.
    fn known_gauge(&mut self, key: &str, name: &str) {
        let gauges = self.scenario.samples.iter().filter(|sample| sample.operator == Operator::Gauge);
        let names: Vec<&str> = gauges.map(OperatorSample::name).collect();
        if names.is_empty() {
            let help = format!("add [[sample]] with name = \"{name}\", operator = \"gauge\", and two `sets`");
            self.missing(key, "the scenario has no gauge", help);
            return;
        }
        if names.contains(&name) {
            return;
        }
        let quoted: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
        let help = match nearest(name, names.iter().copied()) {
            Some(other) => format!("did you mean \"{other}\"?"),
            None => format!(
                "choose {}, or add [[sample]] with name = \"{name}\", operator = \"gauge\", and two `sets`",
                listing(&quoted)
            ),
        };
        self.add(ProblemKind::UnknownName, key, "no gauge has this name", help);
    }

    /// The keys of a servo that go with an opening.
    pub(super) fn servo_opening(&mut self, key: &str, servo: &Servo) {
        let Some(opening) = &servo.opening else {
            for (name, given) in [
                ("gauge", servo.gauge.is_some()),
                ("response_time", servo.response_time.is_some()),
                ("gain", servo.gain.is_some()),
            ] {
                if given {
                    let help = "give `opening`, or remove the key";
                    self.conflict(&format!("{key}.{name}"), "only a servo with `opening` uses this key", help);
                }
            }
            return;
        };
        if opening.si() == 0.0 {
            let help = "give the elongation at the factor 1 of the history; its sign says how the gauge changes";
            self.range(&format!("{key}.opening"), "must not be zero", help);
        }
        match &servo.gauge {
            Some(gauge) => self.known_gauge(&format!("{key}.gauge"), gauge),
            None => self.missing(key, "an opening needs a `gauge`", "name a [[sample]] with operator = \"gauge\""),
        }
        if servo.response_time.is_none() {
            let help =
                "give a quarter of the period of the slowest vibration of the specimen: response_time = \"50 us\"";
            self.missing(key, "an opening needs a `response_time`", help);
        }
    }

    /// Walls with `opening`: their number, and the loading, whose servo stores its memory at the same place.
    pub(super) fn opening_walls(&mut self) {
        let follows = |wall: &Wall| wall.servo.as_ref().is_some_and(|servo| servo.opening.is_some());
        let walls: Vec<usize> = (0..self.scenario.walls.len()).filter(|&k| follows(&self.scenario.walls[k])).collect();
        if let (Some(at), Loading::CellStress { .. }) = (walls.first(), &self.scenario.loading) {
            let help = "use another loading, or give the servo a `force`";
            self.conflict(
                &format!("wall[{at}].servo.opening"),
                "cannot be combined with \"cell-stress\" loading",
                help,
            );
        }
        if let Some(at) = walls.get(OPENINGS) {
            let message = format!("more than {OPENINGS} walls follow an opening");
            self.conflict(&format!("wall[{at}].servo.opening"), message, "join walls by \"facets\" of one file");
        }
    }

    /// Membranes, and what they exclude.
    pub(super) fn membranes(&mut self) {
        let scenario = self.scenario;
        if scenario.membranes.is_empty() {
            return;
        }
        for (what, help, given) in [
            (
                "a periodic cell has no surface",
                "use \"cell-stress\" loading, or cut out a specimen with another [packing.shape]",
                scenario.packing.is_periodic(),
            ),
            (
                "a membrane presses on the centers of particles, not on the surfaces of deformable ones",
                "remove `deformable`, or press with walls that have a `servo`",
                scenario.materials.iter().any(|material| material.deformable.is_some()),
            ),
        ] {
            if given {
                self.conflict("membrane[0]", what, help);
            }
        }
        for (at, membrane) in scenario.membranes.iter().enumerate() {
            if scenario.dimension == 2 && membrane.open_along == Some(crate::schema::Axis::Z) {
                let help = "write open_along = \"x\" or \"y\", or remove it";
                self.conflict(&format!("membrane[{at}].open_along"), "points out of the plane", help);
            }
        }
    }
}
