//! Checks of walls: their shapes, also in two dimensions, motions, rotations, and servos.

use super::Checker;
use super::plane::HELP;
use crate::schema::quantity::{Length, Number, vector};
use crate::schema::{Axis, MeshMotion, Servo, Wall, WallRotation, WallShape};

/// Largest cosine of the angle between the edges of a rectangle.
const PERPENDICULAR: f64 = 1e-9;

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
            let path = format!("wall[{at}].shape");
            match &wall.shape {
                WallShape::Plane { normal, .. } if vector(normal).norm() == 0.0 => {
                    let help = "it points from the wall to the particles: normal = [0, 0, 1] for a floor";
                    self.range(&format!("{path}.normal"), "must not be zero", help);
                }
                WallShape::Box { minimum, maximum } => self.corners(&path, minimum, maximum),
                WallShape::Plate { edges, normal, radius, .. } => self.plate(&path, *edges, *normal, *radius),
                _ => {}
            }
            if let WallShape::Mesh { path, unit, vertices, triangles } = &wall.shape {
                let key = format!("wall[{at}].shape");
                self.mesh(&key, path.is_some(), unit.is_some(), vertices.as_deref(), triangles.as_deref());
                self.moved_mesh(&format!("wall[{at}]"), wall, vertices.as_deref().map(<[_]>::len));
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

    /// A plate is a rectangle with edges, or a disc with a normal and a radius.
    fn plate(
        &mut self,
        key: &str,
        edges: Option<[[Length; 3]; 2]>,
        normal: Option<[Number; 3]>,
        radius: Option<Length>,
    ) {
        let of_disc = [("normal", normal.is_some()), ("radius", radius.is_some())];
        let help = "give `edges` of a rectangle, or `normal` and `radius` of a disc";
        if let Some(edges) = edges {
            for (name, _) in of_disc.into_iter().filter(|(_, given)| *given) {
                self.conflict(&format!("{key}.{name}"), "the plate is a rectangle with `edges`", help);
            }
            let [a, b] = edges.each_ref().map(vector);
            if a.norm() == 0.0 || b.norm() == 0.0 {
                self.range(&format!("{key}.edges"), "an edge is zero", "give two vectors, each as long as the edge");
            } else if a.dot(&b).abs() > PERPENDICULAR * a.norm() * b.norm() {
                let help = "the edges of a rectangle are perpendicular; for another outline use \"facets\"";
                let angle = (a.dot(&b) / (a.norm() * b.norm())).acos().to_degrees();
                let message = format!("are not perpendicular to each other: they meet at {angle:.9} degrees");
                self.range(&format!("{key}.edges"), message, help);
            }
            return;
        }
        match of_disc.map(|(_, given)| given) {
            [false, false] => self.missing(key, "the plate has no outline", help),
            [true, false] => self.missing(key, "the disc has no `radius`", help),
            [false, true] => self.missing(key, "the disc has no `normal`", help),
            [true, true] => {}
        }
        if normal.as_ref().is_some_and(|normal| vector(normal).norm() == 0.0) {
            self.range(
                &format!("{key}.normal"),
                "must not be zero",
                "give a direction across the disc: normal = [0, 0, 1]",
            );
        }
    }

    /// A mesh is read, or given by its vertices and triangles. Its geometry is checked when it is built.
    fn mesh(
        &mut self,
        key: &str,
        path: bool,
        unit: bool,
        vertices: Option<&[[Length; 3]]>,
        triangles: Option<&[[u32; 3]]>,
    ) {
        match (path, vertices.is_some(), triangles.is_some()) {
            (true, false, false) | (false, true, true) => {}
            (true, ..) => {
                let name = if vertices.is_some() { "vertices" } else { "triangles" };
                let help = "keep `path`, or `vertices` and `triangles`";
                self.conflict(&format!("{key}.{name}"), "the mesh is read from `path`, too", help);
            }
            (false, ..) => {
                let help = "give `path`, or both `vertices` and `triangles`";
                self.missing(key, "the mesh has neither a file nor vertices with triangles", help);
            }
        }
        if unit && !path {
            self.conflict(&format!("{key}.unit"), "is the unit of a file, but there is none", "remove `unit`");
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
        match &wall.shape {
            WallShape::Plane { .. } if self.scenario.dimension == 2 => {
                let help = "remove `rotation`, or use a cylinder, which turns about z";
                self.conflict(key, "a plane that turns about its normal leaves two dimensions", help);
            }
            // Meshes are checked apart.
            WallShape::Plane { .. } | WallShape::Mesh { .. } => {}
            WallShape::Cylinder { .. } | WallShape::Plate { edges: None, .. } => {
                if rotation.point.is_some() {
                    let help = "remove `point`; its axis is that of the shape";
                    self.conflict(&format!("{key}.point"), "a wall of this shape turns about its own axis", help);
                }
            }
            WallShape::Box { .. } | WallShape::Plate { .. } | WallShape::Facets { .. } => {
                let help = "remove `rotation`, or use a \"plane\", a \"cylinder\", or a \"plate\" with a `radius`";
                self.conflict(key, "a wall of this shape does not stay in its place when it turns", help);
            }
        }
        if self.scenario.packing.is_periodic() {
            let message = "in a periodic cell the images of a turning wall would have different velocities";
            self.conflict(key, message, "remove `rotation`, or use a packing without a cell");
        }
    }

    fn servo(&mut self, path: &str, wall: &Wall, servo: &Servo) {
        let key = format!("{path}.servo");
        let is_box = wall.shape.faces() > 1;
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
        let needs_direction = wall.shape.normal(0).is_none();
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
            let path = format!("wall[{at}].shape");
            match &wall.shape {
                WallShape::Plane { normal, .. } if normal[2].si() != 0.0 => {
                    self.conflict(&format!("{path}.normal[2]"), "points out of the plane", HELP);
                }
                WallShape::Cylinder { axis: Axis::X | Axis::Y, .. } => {
                    let help = "write axis = \"z\", a circle in the plane";
                    self.conflict(&format!("{path}.axis"), "the axis of the cylinder lies in the plane", help);
                }
                WallShape::Cylinder { length: Some(_), .. } => {
                    let help = "remove `length`; in two dimensions a cylinder is a circle";
                    self.conflict(&format!("{path}.length"), "lies across the plane", help);
                }
                WallShape::Plate { center, edges, normal, radius } => {
                    let upright = |[a, b]: &[[Length; 3]; 2]| {
                        let across = |edge: &[Length; 3]| edge[0].si() == 0.0 && edge[1].si() == 0.0;
                        (across(a) && b[2].si() == 0.0) || (across(b) && a[2].si() == 0.0)
                    };
                    if center[2].si() != 0.0 {
                        let help = "write 0; in two dimensions the plate is a line in the plane";
                        self.conflict(&format!("{path}.center[2]"), "lies outside the plane", help);
                    }
                    let outlined = edges.is_some() || normal.is_some() || radius.is_some();
                    if outlined && !edges.as_ref().is_some_and(upright) {
                        let help = "give edges of which one is across the plane: edges = [[\"20 mm\", 0, 0], [0, 0, \"1 mm\"]]";
                        self.conflict(&path, "the plate is not perpendicular to the plane z = 0", help);
                    }
                }
                _ => {}
            }
        }
    }
}
