//! A scenario whose vectors can be turned and shifted, and its text.

use std::fmt::Write as _;

use concordem::math::{Mat3, Vec3};

use crate::fibers::Fiber;
use crate::slaves::Slave;

/// Takes a file, by name, and returns its path for the scenario.
pub type Files<'a> = &'a dyn Fn(&str, &[u8]) -> String;

/// Shape of a wall.
#[derive(Clone, Debug)]
pub enum Shape {
    /// Point and normal.
    Plane(Vec3, Vec3),
    /// Triangles.
    Facets(Vec<[Vec3; 3]>),
    /// Vertices and triangles, moved by the velocity of the wall through a history of their own.
    Mesh(Vec<Vec3>, Vec<[u32; 3]>),
    /// A point of the axis, its direction (0 to 2), radius, whether particles are inside, and the length, if it is finite.
    Cylinder(Vec3, usize, f64, bool, Option<f64>),
    /// Center and edges of a rectangle.
    Plate(Vec3, [Vec3; 2]),
    /// Center, normal, and radius of a disc.
    Disc(Vec3, Vec3, f64),
}

/// A servo of a wall.
#[derive(Clone, Debug)]
pub struct Servo {
    /// Force on the particles, N.
    pub force: f64,
    pub maximum_speed: f64,
    /// Unit vector along which the wall pushes: the normal of a plane.
    pub direction: Vec3,
}

/// A wall.
#[derive(Clone, Debug)]
pub struct Wall {
    pub shape: Shape,
    pub velocity: Vec3,
    pub servo: Option<Servo>,
    /// Number of the history that multiplies the velocity, or the force of the servo.
    pub history: Option<usize>,
    /// Angular velocity of a plane about its normal, with the number of the history that multiplies it.
    pub rotation: Option<(f64, Option<usize>)>,
}

/// A membrane around all particles.
#[derive(Clone, Debug)]
pub struct Membrane {
    pub pressure: f64,
    /// Number of the history that multiplies the pressure.
    pub history: Option<usize>,
    /// Axis (0 to 2) at whose ends it is open.
    pub open_along: Option<usize>,
}

/// A joint of rock: a plane.
#[derive(Clone, Debug)]
pub struct Joint {
    pub point: Vec3,
    pub normal: Vec3,
    /// Strengths and angles.
    pub keys: &'static str,
}

/// A rigid body: packed particles by number, or added spheres.
#[derive(Clone, Debug)]
pub struct Clump {
    pub members: Vec<usize>,
    pub spheres: Vec<(Vec3, f64)>,
    /// Velocity and angular velocity.
    pub motion: Option<(Vec3, Vec3)>,
}

/// Loading of the specimen.
#[derive(Clone, Debug)]
pub enum Loading {
    None,
    CellStrain(Mat3),
    /// Stress, and largest rate.
    CellStress(Mat3, f64),
    /// Axis, strain rate, and whether the ends are fixed across it.
    Uniaxial(usize, f64, bool),
    /// Axis, closing velocity.
    Platens(usize, f64),
}

/// Region of an operator.
#[derive(Clone, Debug)]
pub enum Region {
    /// None is given: the operator reads a wall.
    None,
    All(f64),
    Cell,
    Box(Vec3, Vec3),
    Sphere(Vec3, f64),
    Cylinder(Vec3, Vec3, f64, f64),
    Ellipsoid(Vec3, Vec3),
    /// Particles by number, and their volume.
    Set(Vec<usize>, f64),
    /// The operator reads a set: particles by number, and the point of its moments.
    OfSet(Vec<usize>, Option<Vec3>),
    /// The operator reads two sets.
    Between([Vec<usize>; 2]),
}

/// An operator.
#[derive(Clone, Debug)]
pub struct Sample {
    pub operator: &'static str,
    pub region: Region,
    /// Other keys, as text.
    pub keys: String,
    /// Velocity of the region.
    pub velocity: Vec3,
}

/// A prescribed motion; `None` is free.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    pub velocity: [Option<f64>; 3],
    pub angular_velocity: [Option<f64>; 3],
    /// Displacement at the factor 1 of the history.
    pub displacement: [Option<f64>; 3],
    /// Number of the history.
    pub history: Option<usize>,
}

/// A stage of the loading.
#[derive(Clone, Debug)]
pub struct Stage {
    pub rate: f64,
    /// Number of the history.
    pub history: Option<usize>,
    /// Conditions, as text.
    pub stop: String,
}

/// What a set of particles, given by number, is prescribed, loaded with, or starts with.
#[derive(Clone, Debug)]
pub enum Action {
    Prescribe(Motion),
    /// Force, moment, number of a history, and where the force acts on deformable particles.
    Force(Vec3, Vec3, Option<usize>, &'static str),
    /// Initial velocity and angular velocity.
    Initial(Vec3, Vec3),
}

/// Heat conduction: the keys of its tables, and the particles of the set "hot".
#[derive(Clone, Debug)]
pub struct Heat {
    pub keys: String,
    pub hot: Vec<usize>,
}

/// A scenario.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name in reports.
    pub name: String,
    pub dimension: u8,
    pub kinematics: &'static str,
    pub spheres: Vec<(Vec3, f64)>,
    /// Edges of the periodic cell.
    pub cell: Option<Vec3>,
    /// Tables of the materials; the first is "m", the second, if any, "n".
    pub materials: String,
    /// Particles of the second material.
    pub second: Vec<usize>,
    /// Whether small aggregates give the second material instead of a set.
    pub aggregates: bool,
    /// Law and interaction ratio.
    pub bonds: Option<(&'static str, f64)>,
    pub contacts: &'static str,
    /// Further tables.
    pub options: String,
    pub scheme: &'static str,
    pub damping: String,
    pub gravity: Vec3,
    /// Time step; "auto" if `None`.
    pub time_step: Option<f64>,
    pub loading: Loading,
    /// Factors over time, as text.
    pub histories: Vec<String>,
    pub stages: Vec<Stage>,
    pub walls: Vec<Wall>,
    pub clumps: Vec<Clump>,
    pub actions: Vec<(Vec<usize>, Action)>,
    /// Heat conduction.
    pub heat: Option<Heat>,
    pub fiber: Option<Fiber>,
    pub membrane: Option<Membrane>,
    pub joint: Option<Joint>,
    pub slaves: Vec<Slave>,
    pub samples: Vec<Sample>,
    pub interval: u64,
    pub steps: u64,
}

/// A rotation that permutes the axes, with signs.
#[derive(Clone, Copy, Debug)]
pub struct Turn(pub Mat3);

impl Turn {
    /// A quarter turn about z; in space the axes are then permuted in a cycle.
    pub fn of(dimension: u8) -> Self {
        let quarter = Mat3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        let cycle = Mat3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
        Self(if dimension == 2 { quarter } else { cycle * quarter })
    }

    /// The vector in the turned scenario. Adding zero makes −0 a 0.
    pub fn vector(&self, v: &Vec3) -> Vec3 {
        (self.0 * v).map(|c| c + 0.0)
    }

    /// Lengths along the axes.
    pub fn lengths(&self, v: &Vec3) -> Vec3 {
        (self.0 * v).abs()
    }

    /// The axis that `axis` becomes, and its sign.
    pub fn axis(&self, axis: usize) -> (usize, f64) {
        let column = self.0.column(axis);
        let k = (0..3).find(|&k| column[k] != 0.0).unwrap_or(0);
        (k, column[k])
    }

    pub fn tensor(&self, t: &Mat3) -> Mat3 {
        self.0 * t * self.0.transpose()
    }

    fn components(&self, given: &[Option<f64>; 3]) -> [Option<f64>; 3] {
        let mut turned = [None; 3];
        for (axis, value) in given.iter().enumerate() {
            let (to, sign) = self.axis(axis);
            turned[to] = value.map(|value| value * sign + 0.0);
        }
        turned
    }

    fn corners(&self, a: &Vec3, b: &Vec3) -> (Vec3, Vec3) {
        let (a, b) = (self.vector(a), self.vector(b));
        (a.inf(&b), a.sup(&b))
    }
}

impl Case {
    /// The whole scenario, turned.
    pub fn turned(&self, turn: &Turn) -> Self {
        let mut case = self.clone();
        let v = |x: &mut Vec3| *x = turn.vector(x);
        case.spheres.iter_mut().for_each(|s| v(&mut s.0));
        case.cell = case.cell.map(|cell| turn.lengths(&cell));
        v(&mut case.gravity);
        if let Some(fiber) = &mut case.fiber {
            fiber.ends.iter_mut().for_each(v);
        }
        if let Some(Joint { point, normal, .. }) = &mut case.joint {
            [point, normal].into_iter().for_each(v);
        }
        if let Some(Membrane { open_along: Some(axis), .. }) = &mut case.membrane {
            *axis = turn.axis(*axis).0;
        }
        case.loading = match &case.loading {
            Loading::None => Loading::None,
            Loading::CellStrain(gradient) => Loading::CellStrain(turn.tensor(gradient)),
            Loading::CellStress(stress, rate) => Loading::CellStress(turn.tensor(stress), *rate),
            Loading::Uniaxial(axis, rate, fixed) => Loading::Uniaxial(turn.axis(*axis).0, *rate, *fixed),
            Loading::Platens(axis, speed) => Loading::Platens(turn.axis(*axis).0, *speed),
        };
        for wall in &mut case.walls {
            v(&mut wall.velocity);
            wall.servo.iter_mut().for_each(|servo| v(&mut servo.direction));
            match &mut wall.shape {
                Shape::Plane(point, normal) | Shape::Disc(point, normal, _) => {
                    v(point);
                    v(normal);
                }
                Shape::Facets(triangles) => triangles.iter_mut().flatten().for_each(v),
                Shape::Mesh(vertices, _) => vertices.iter_mut().for_each(v),
                Shape::Cylinder(center, axis, ..) => {
                    v(center);
                    *axis = turn.axis(*axis).0;
                }
                Shape::Plate(center, edges) => {
                    v(center);
                    edges.iter_mut().for_each(v);
                }
            }
        }
        for clump in &mut case.clumps {
            clump.spheres.iter_mut().for_each(|s| v(&mut s.0));
            if let Some((velocity, spin)) = &mut clump.motion {
                v(velocity);
                v(spin);
            }
        }
        for (_, action) in &mut case.actions {
            match action {
                Action::Prescribe(motion) => {
                    for given in [&mut motion.velocity, &mut motion.angular_velocity, &mut motion.displacement] {
                        *given = turn.components(given);
                    }
                }
                Action::Force(a, b, ..) | Action::Initial(a, b) => {
                    v(a);
                    v(b);
                }
            }
        }
        case.slaves = self.slaves.iter().map(|slave| slave.turned(turn)).collect();
        for sample in &mut case.samples {
            v(&mut sample.velocity);
            match &mut sample.region {
                Region::Box(low, high) => (*low, *high) = turn.corners(low, high),
                Region::Sphere(center, _) => v(center),
                Region::Cylinder(center, axis, ..) => {
                    v(center);
                    v(axis);
                }
                Region::Ellipsoid(center, axes) => {
                    v(center);
                    *axes = turn.lengths(axes);
                }
                Region::OfSet(_, about) => about.iter_mut().for_each(v),
                Region::None | Region::All(_) | Region::Cell | Region::Set(..) | Region::Between(_) => {}
            }
        }
        case
    }

    /// The text of the scenario; `files` takes the surfaces of triangles and the recorded motions.
    pub fn text(&self, files: Files<'_>) -> String {
        let mut text = format!("version = 1\ntitle = \"{}\"\n", self.name);
        let _ = writeln!(text, "dimension = {}\nkinematics = \"{}\"", self.dimension, self.kinematics);
        let _ = writeln!(text, "[packing]\nkind = \"spheres\"\nspheres = [");
        for (x, r) in &self.spheres {
            let _ = writeln!(text, "  [{:?}, {:?}, {:?}, {r:?}],", x.x, x.y, x.z);
        }
        let _ = writeln!(text, "]");
        if let Some(cell) = &self.cell {
            let _ = writeln!(text, "cell = {}", list(cell));
        }
        text += &self.materials;
        if let Some((law, ratio)) = self.bonds {
            let _ = writeln!(text, "[bonds]\nlaw = \"{law}\"\ninteraction_ratio = {ratio:?}");
        }
        let _ = writeln!(text, "[contacts]\nlaw = \"{}\"", self.contacts);
        text += &self.options;
        let _ = writeln!(text, "[integration]\nscheme = \"{}\"", self.scheme);
        match self.time_step {
            Some(step) => drop(writeln!(text, "time_step = {step:?}")),
            None => text += "time_step = \"auto\"\n",
        }
        let _ = writeln!(text, "damping = {}\ngravity = {}", self.damping, list(&self.gravity));
        text += &self.loading_text();
        self.write_time(&mut text);
        self.write_walls(&mut text, files);
        self.write_bodies(&mut text);
        if let Some(Heat { keys, hot }) = &self.heat {
            let selection = format!("{{ kind = \"ids\", ids = {hot:?} }}");
            let _ = writeln!(text, "[[set]]\nname = \"hot\"\nselection = {selection}\n[heat]\n{keys}");
        }
        text += &self.fiber.as_ref().map_or_else(String::new, Fiber::text);
        if let Some(Membrane { pressure, history, open_along }) = &self.membrane {
            let _ = writeln!(text, "[[membrane]]\npressure = {pressure:?}\n{}", follows(*history));
            if let Some(axis) = open_along {
                let _ = writeln!(text, "open_along = \"{}\"", ["x", "y", "z"][*axis]);
            }
        }
        if let Some(Joint { point, normal, keys }) = &self.joint {
            let shape = format!("{{ kind = \"plane\", point = {}, normal = {} }}", list(point), list(normal));
            let _ =
                writeln!(text, "[[joint]]\nshape = {shape}\nnormal_stiffness = 3e12\nshear_stiffness = 1e12\n{keys}");
        }
        for (k, slave) in self.slaves.iter().enumerate() {
            text += &slave.text(k, self, files);
        }
        self.write_samples(&mut text);
        let _ = writeln!(text, "[output]\nsample_interval = {}\n[stop]\nsteps = {}", self.interval, self.steps);
        text
    }

    fn loading_text(&self) -> String {
        let axis = |axis: usize| ["x", "y", "z"][axis];
        match &self.loading {
            Loading::None => String::new(),
            Loading::CellStrain(gradient) => {
                format!("[loading]\nkind = \"cell-strain\"\nvelocity_gradient = {}\n", matrix(gradient))
            }
            Loading::CellStress(stress, rate) => format!(
                "[loading]\nkind = \"cell-stress\"\nstress = {}\nmaximum_strain_rate = {rate:?}\n",
                matrix(stress)
            ),
            Loading::Uniaxial(along, rate, fixed) => format!(
                "[loading]\nkind = \"uniaxial\"\naxis = \"{}\"\nstrain_rate = {rate:?}\nlateral = \"{}\"\n\
                 layer_thickness = 1.1e-3\n",
                axis(*along),
                if *fixed { "fixed" } else { "free" }
            ),
            Loading::Platens(along, speed) => format!(
                "[loading]\nkind = \"platens\"\naxis = \"{}\"\nclosing_velocity = {speed:?}\nmaterial = \"m\"\n",
                axis(*along)
            ),
        }
    }

    /// Histories and stages.
    fn write_time(&self, text: &mut String) {
        for (k, shape) in self.histories.iter().enumerate() {
            let _ = writeln!(text, "[[history]]\nname = \"h{k}\"\nshape = {shape}");
        }
        for (k, Stage { rate, history, stop }) in self.stages.iter().enumerate() {
            let _ = writeln!(text, "[[stage]]\nname = \"stage {k}\"\nstop = {{ {stop} }}");
            if *rate != 1.0 {
                let _ = writeln!(text, "rate = {rate:?}");
            }
            *text += &follows(*history);
        }
    }

    fn write_walls(&self, text: &mut String, files: Files<'_>) {
        let moves = |wall: &Wall| matches!(wall.shape, Shape::Mesh(..)) && wall.velocity != Vec3::zeros();
        if self.walls.iter().any(moves) {
            // One second per unit, longer than any run: displacements are velocities.
            *text += "[[history]]\nname = \"time\"\nshape = { kind = \"table\", points = [[0, 0], [1, 1]] }\n";
        }
        for (k, wall) in self.walls.iter().enumerate() {
            let shape = match &wall.shape {
                Shape::Plane(point, normal) => {
                    format!("{{ kind = \"plane\", point = {}, normal = {} }}", list(point), list(normal))
                }
                Shape::Facets(triangles) => {
                    let path = files(&format!("surface-{k}.stl"), &stl(triangles));
                    format!("{{ kind = \"facets\", path = \"{path}\" }}")
                }
                Shape::Mesh(vertices, triangles) => {
                    let vertices: Vec<String> = vertices.iter().map(list).collect();
                    let vertices = vertices.join(", ");
                    format!("{{ kind = \"mesh\", vertices = [{vertices}], triangles = {triangles:?} }}")
                }
                Shape::Cylinder(center, axis, radius, inside, length) => format!(
                    "{{ kind = \"cylinder\", center = {}, axis = \"{}\", radius = {radius:?}, side = \"{}\"{} }}",
                    list(center),
                    ["x", "y", "z"][*axis],
                    if *inside { "inside" } else { "outside" },
                    length.map_or(String::new(), |length| format!(", length = {length:?}"))
                ),
                Shape::Plate(center, [a, b]) => {
                    format!("{{ kind = \"plate\", center = {}, edges = [{}, {}] }}", list(center), list(a), list(b))
                }
                Shape::Disc(center, normal, radius) => {
                    let [center, normal] = [center, normal].map(list);
                    format!("{{ kind = \"plate\", center = {center}, normal = {normal}, radius = {radius:?} }}")
                }
            };
            let _ = writeln!(text, "[[wall]]\nname = \"w{k}\"\nmaterial = \"m\"\nshape = {shape}");
            if let Shape::Mesh(..) = wall.shape {
                if wall.velocity != Vec3::zeros() {
                    let displacement = list(&wall.velocity);
                    let _ = writeln!(text, "motion = {{ displacement = {displacement}, history = \"time\" }}");
                }
                continue;
            }
            if let Some(Servo { force, maximum_speed, direction }) = &wall.servo {
                let own = matches!(wall.shape, Shape::Plane(..));
                let direction = if own { String::new() } else { format!(", direction = {}", list(direction)) };
                let _ = writeln!(text, "servo = {{ force = {force:?}, maximum_speed = {maximum_speed:?}{direction} }}");
            } else {
                let _ = writeln!(text, "velocity = {}", list(&wall.velocity));
            }
            *text += &follows(wall.history);
            if let Some((speed, history)) = wall.rotation {
                let follows = history.map_or(String::new(), |k| format!(", history = \"h{k}\""));
                let _ = writeln!(text, "rotation = {{ angular_velocity = {speed:?}{follows} }}");
            }
        }
    }

    /// Sets, bodies, and what acts on sets.
    fn write_bodies(&self, text: &mut String) {
        let mut sets = 0;
        let mut set = |text: &mut String, ids: &[usize], material: &str| {
            let name = format!("s{sets}");
            sets += 1;
            let _ =
                writeln!(text, "[[set]]\nname = \"{name}\"\nselection = {{ kind = \"ids\", ids = {ids:?} }}{material}");
            name
        };
        if !self.second.is_empty() && self.aggregates {
            let places = self.second.iter().map(|&id| &self.spheres[id]);
            let places: Vec<String> =
                places.map(|(x, r)| format!("[{:?}, {:?}, {:?}, {:?}]", x.x, x.y, x.z, 0.1 * r)).collect();
            let places = places.join(", ");
            let _ = writeln!(text, "[aggregates]\n[[aggregates.group]]\nmaterial = \"n\"\nspheres = [{places}]");
        } else if !self.second.is_empty() {
            set(text, &self.second, "\nmaterial = \"n\"");
        }
        for clump in &self.clumps {
            if clump.spheres.is_empty() {
                let name = set(text, &clump.members, "");
                let _ = writeln!(text, "[[clump]]\nset = \"{name}\"");
            } else {
                let spheres: Vec<String> =
                    clump.spheres.iter().map(|(x, r)| format!("[{:?}, {:?}, {:?}, {r:?}]", x.x, x.y, x.z)).collect();
                let _ = writeln!(text, "[[clump]]\nspheres = [{}]", spheres.join(", "));
            }
            if let Some((velocity, spin)) = &clump.motion {
                let _ = writeln!(text, "velocity = {}\nangular_velocity = {}", list(velocity), list(spin));
            }
        }
        for (ids, action) in &self.actions {
            let name = set(text, ids, "");
            let (table, keys) = match action {
                Action::Prescribe(motion) => {
                    let keys = format!(
                        "velocity = {}\nangular_velocity = {}\ndisplacement = {}\n{}",
                        components(&motion.velocity),
                        components(&motion.angular_velocity),
                        components(&motion.displacement),
                        follows(motion.history)
                    );
                    ("prescribe", keys)
                }
                Action::Force(force, moment, history, acts) => {
                    let keys = format!(
                        "force = {}\nmoment = {}\nacts = \"{acts}\"\n{}",
                        list(force),
                        list(moment),
                        follows(*history)
                    );
                    ("force", keys)
                }
                Action::Initial(velocity, spin) => {
                    ("initial", format!("velocity = {}\nangular_velocity = {}", list(velocity), list(spin)))
                }
            };
            let _ = writeln!(text, "[[{table}]]\nset = \"{name}\"\n{keys}");
        }
        for (k, sample) in self.samples.iter().enumerate() {
            let sets: &[Vec<usize>] = match &sample.region {
                Region::Set(ids, _) | Region::OfSet(ids, _) => std::slice::from_ref(ids),
                Region::Between(sets) => sets,
                _ => &[],
            };
            for (at, ids) in sets.iter().enumerate() {
                let selection = format!("{{ kind = \"ids\", ids = {ids:?} }}");
                let _ = writeln!(text, "[[set]]\nname = \"sampled {k}-{at}\"\nselection = {selection}");
            }
        }
    }

    fn write_samples(&self, text: &mut String) {
        for (k, sample) in self.samples.iter().enumerate() {
            let _ = writeln!(text, "[[sample]]\noperator = \"{}\"\nname = \"o{k}\"", sample.operator);
            let region = match &sample.region {
                Region::None => None,
                Region::OfSet(_, about) => {
                    let _ = writeln!(text, "set = \"sampled {k}-0\"");
                    if let Some(about) = about {
                        let _ = writeln!(text, "about = {}", list(about));
                    }
                    None
                }
                Region::Between(_) => {
                    let _ = writeln!(text, "sets = [\"sampled {k}-0\", \"sampled {k}-1\"]");
                    None
                }
                Region::All(volume) => Some(format!("kind = \"all\", volume = {volume:?}")),
                Region::Cell => Some("kind = \"cell\"".to_owned()),
                Region::Box(low, high) => {
                    Some(format!("kind = \"box\", minimum = {}, maximum = {}", list(low), list(high)))
                }
                Region::Sphere(center, radius) => {
                    Some(format!("kind = \"sphere\", center = {}, radius = {radius:?}", list(center)))
                }
                Region::Cylinder(center, axis, radius, height) => Some(format!(
                    "kind = \"cylinder\", center = {}, axis = {}, radius = {radius:?}, height = {height:?}",
                    list(center),
                    list(axis)
                )),
                Region::Ellipsoid(center, axes) => {
                    Some(format!("kind = \"ellipsoid\", center = {}, half_axes = {}", list(center), list(axes)))
                }
                Region::Set(_, volume) => Some(format!("kind = \"set\", set = \"sampled {k}-0\", volume = {volume:?}")),
            };
            if let Some(region) = region {
                let _ = writeln!(text, "region = {{ {region} }}");
            }
            if sample.velocity != Vec3::zeros() {
                let _ = writeln!(text, "velocity = {}", list(&sample.velocity));
            }
            *text += &sample.keys;
        }
    }
}

fn list(v: &Vec3) -> String {
    format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z)
}

/// The key that names a history.
fn follows(history: Option<usize>) -> String {
    history.map_or_else(String::new, |k| format!("history = \"h{k}\"\n"))
}

fn matrix(m: &Mat3) -> String {
    let row = |i: usize| list(&Vec3::new(m[(i, 0)], m[(i, 1)], m[(i, 2)]));
    format!("[{}, {}, {}]", row(0), row(1), row(2))
}

fn components(v: &[Option<f64>; 3]) -> String {
    let one = |c: &Option<f64>| c.map_or("\"free\"".to_owned(), |c| format!("{c:?}"));
    format!("[{}, {}, {}]", one(&v[0]), one(&v[1]), one(&v[2]))
}

/// Triangles as a binary STL file.
fn stl(triangles: &[[Vec3; 3]]) -> Vec<u8> {
    let mut bytes = vec![0_u8; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for corners in triangles {
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).normalize();
        for v in std::iter::once(&normal).chain(corners) {
            v.iter().for_each(|c| bytes.extend((*c as f32).to_le_bytes()));
        }
        bytes.extend([0, 0]);
    }
    bytes
}
