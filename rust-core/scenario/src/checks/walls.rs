//! Checks of walls: their motions, rotations, and servos. The file of a kind of wall has the checks of its shape.

use super::Checker;
use crate::schema::quantity::{Length, vector};
use crate::schema::{MeshMotion, Servo, Wall, WallRotation};

impl Checker<'_> {
    pub(super) fn walls(&mut self) {
        if self.scenario.loading.drives_cell() && !self.scenario.walls.is_empty() {
            let help = "rigid walls do not follow the deformation of a driven cell; remove the walls, or [loading]";
            let message = format!("walls are not possible with \"{}\" loading", self.scenario.loading.kind());
            self.conflict("wall[0]", message, help);
        }
        self.names_of_walls();
        for (at, wall) in self.scenario.walls.iter().enumerate() {
            self.known_material(&format!("wall[{at}].material"), &wall.material);
            let kind = wall.shape.kind();
            for fault in kind.faults() {
                self.fault(&format!("wall[{at}].shape"), fault);
            }
            if kind.is_mesh() {
                self.moved_mesh(&format!("wall[{at}]"), wall, kind.vertices());
                continue;
            }
            if wall.motion.is_some() {
                let help = "use shape.kind = \"mesh\"; other walls move with `velocity`";
                self.conflict(&format!("wall[{at}].motion"), "only the vertices of a mesh have a motion", help);
            }
            if let Some(rotation) = &wall.rotation {
                self.wall_rotation(&format!("wall[{at}].rotation"), wall, rotation);
            }
            if let Some(servo) = &wall.servo {
                self.servo(&format!("wall[{at}]"), wall, servo);
            }
        }
    }

    /// Names tell walls apart in samples, results, and scripts, also those that boxes and loadings make.
    fn names_of_walls(&mut self) {
        let scenario = self.scenario;
        let mut taken: Vec<(String, String)> = scenario
            .names_of_loading_walls()
            .into_iter()
            .map(|name| (name, format!("a wall of the \"{}\" loading", scenario.loading.kind())))
            .collect();
        for (at, wall) in scenario.walls.iter().enumerate() {
            let key = format!("wall[{at}]{}", if wall.name.is_some() { ".name" } else { "" });
            if wall.name.as_ref().is_some_and(|name| name.trim().is_empty()) {
                self.range(&key, "the name is empty", "give it a name, or leave out the key");
            }
            let names = wall.names(at);
            if let Some((name, owner)) = taken.iter().find(|(name, _)| names.contains(name)) {
                let message = format!("{owner} is called \"{name}\", too");
                self.conflict(&key, message, "give each [[wall]] its own `name`");
            }
            taken.extend(names.into_iter().map(|name| (name, format!("wall[{at}]"))));
        }
    }

    /// A mesh moves by its vertices, not as a whole.
    fn moved_mesh(&mut self, key: &str, wall: &Wall, vertices: Option<usize>) {
        let help = "use `motion`, with a displacement that follows a history";
        if wall.velocity.iter().any(|component| component.si() != 0.0) {
            self.conflict(&format!("{key}.velocity"), "a mesh moves by its vertices", help);
        }
        for (name, given) in [
            ("history", wall.history.is_some()),
            ("servo", wall.servo.is_some()),
            ("rotation", wall.rotation.is_some()),
        ] {
            if given {
                self.conflict(&format!("{key}.{name}"), "a mesh moves by its vertices", help);
            }
        }
        let Some(MeshMotion { displacement, rotation, center, vertices: single, .. }) = &wall.motion else { return };
        let zero = |vector: &[Length; 3]| vector.iter().all(|component| component.si() == 0.0);
        let turns = rotation.as_ref().is_some_and(|rotation| rotation.iter().any(|angle| angle.si() != 0.0));
        if zero(displacement) && !turns && single.as_ref().is_none_or(|rows| rows.iter().all(zero)) {
            let help = "give `displacement`, `rotation`, or `vertices`, or remove `motion`";
            self.conflict(&format!("{key}.motion"), "moves no vertex", help);
        }
        match (rotation.is_some(), center.is_some()) {
            (true, false) => {
                let help = "give a point on the axis: center = [0, 0, 0]";
                self.missing(&format!("{key}.motion"), "the rotation has no center", help);
            }
            (false, true) => {
                let help = "remove `center`, or give `rotation`";
                self.conflict(&format!("{key}.motion.center"), "there is no rotation about it", help);
            }
            _ => {}
        }
        if let (Some(rows), Some(count)) = (single, vertices)
            && rows.len() != count
        {
            let message = format!("{} rows for {count} vertices", rows.len());
            self.conflict(&format!("{key}.motion.vertices"), message, "give one row per vertex of the mesh");
        }
    }

    fn wall_rotation(&mut self, key: &str, wall: &Wall, rotation: &WallRotation) {
        let kind = wall.shape.kind();
        if !kind.can_turn() {
            let help = "remove `rotation`, or use a \"plane\", a \"cylinder\", or a \"plate\" with a `radius`";
            self.conflict(key, "a wall of this shape does not stay in its place when it turns", help);
        } else if self.scenario.dimension == 2 && !kind.can_turn_in_plane() {
            let help = "remove `rotation`, or use a cylinder, which turns about z";
            self.conflict(key, "a plane that turns about its normal leaves two dimensions", help);
        } else if rotation.point.is_some() && kind.has_own_axis() {
            let help = "remove `point`; its axis is that of the shape";
            self.conflict(&format!("{key}.point"), "a wall of this shape turns about its own axis", help);
        }
        if self.scenario.packing.is_periodic() {
            let message = "in a periodic cell the images of a turning wall would have different velocities";
            self.conflict(key, message, "remove `rotation`, or use a packing without a cell");
        }
    }

    fn servo(&mut self, path: &str, wall: &Wall, servo: &Servo) {
        let key = format!("{path}.servo");
        let is_box = wall.shape.kind().faces().len() > 1;
        if wall.velocity.iter().any(|component| component.si() != 0.0) {
            let help = "remove `velocity`; the servo moves the wall";
            self.conflict(&format!("{path}.velocity"), "the wall has a servo", help);
        }
        self.servo_opening(&key, servo);
        let given: Vec<&str> = [
            ("force", servo.force.is_some()),
            ("pressure", servo.pressure.is_some()),
            ("opening", servo.opening.is_some()),
        ]
        .into_iter()
        .filter_map(|(name, given)| given.then_some(name))
        .collect();
        match given[..] {
            [] => self.missing(&key, "gives neither `force` nor `pressure` nor `opening`", "give one of them"),
            [first, second, ..] => {
                let message = format!("gives both `{first}` and `{second}`");
                self.conflict(&format!("{key}.{first}"), message, "keep one of them");
            }
            [only] if is_box && only != "pressure" => {
                self.conflict(&format!("{key}.{only}"), "a box has six faces", "give `pressure`, or six planes");
            }
            ["pressure"] if !is_box && servo.area.is_none() => {
                let help = "give the `area` on which the pressure acts, or `force`";
                self.missing(&key, "the pressure of this shape needs an area", help);
            }
            _ => {}
        }
        if servo.area.is_some() && (servo.pressure.is_none() || is_box) {
            let message =
                if is_box { "the faces of a box have their own areas" } else { "only a pressure needs an area" };
            self.conflict(&format!("{key}.area"), message, "remove `area`");
        }
        let needs_direction = wall.shape.kind().normal(0).is_none();
        match &servo.direction {
            None if needs_direction => {
                let help = "give the direction in which the wall pushes: direction = [0, 0, -1]";
                self.missing(&key, "a wall of this shape needs a direction", help);
            }
            Some(_) if !needs_direction => {
                let help = "remove `direction`; the wall pushes along its normal";
                self.conflict(&format!("{key}.direction"), "this shape has a direction", help);
            }
            Some(direction) if vector(direction).norm() == 0.0 => {
                self.range(
                    &format!("{key}.direction"),
                    "must not be zero",
                    "give the direction in which the wall pushes",
                );
            }
            _ => {}
        }
    }

    /// Checks that walls are perpendicular to the plane.
    pub(super) fn walls_in_plane(&mut self) {
        for (at, wall) in self.scenario.walls.iter().enumerate() {
            for fault in wall.shape.kind().faults_in_plane() {
                self.fault(&format!("wall[{at}].shape"), fault);
            }
        }
    }
}
