//! Recorded motions of particles and meshes in a random scenario.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use concordem::math::Vec3;
use concordem_tests::random::Random;

use crate::case::{Action, Case, Files, Motion, Region, Sample, Shape, Turn, Wall};
use crate::generator::{ids, planar, spin, vector};

/// What a recorded motion moves.
#[derive(Clone, Debug)]
pub enum Moved {
    /// Particles, by number.
    Particles(Vec<usize>),
    /// The mesh of a wall, by number: velocities of the vertices.
    Driven(usize),
    /// The mesh of a wall, by number: places and velocities of the vertices.
    Placed(usize),
}

/// A recorded motion: `amplitude f(k)` in step k, counted from 1. Entry 0 of the file is the motion before the first step.
#[derive(Clone, Debug)]
pub struct Slave {
    pub moved: Moved,
    /// Velocity and angular velocity of each particle or vertex.
    pub amplitude: Vec<[Vec3; 2]>,
    /// Steps in which the motion swings once; constant if `None`.
    pub period: Option<f64>,
    /// Steps of the file.
    pub steps: u64,
}

impl Slave {
    pub fn turned(&self, turn: &Turn) -> Self {
        let mut slave = self.clone();
        slave.amplitude.iter_mut().flatten().for_each(|v| *v = turn.vector(v));
        slave
    }

    /// Velocity and angular velocity of particle or vertex `row` in step `k`.
    pub fn motion(&self, k: u64, row: usize) -> [Vec3; 2] {
        let factor = self.period.map_or(1.0, |period| (TAU * k as f64 / period + row as f64).sin());
        self.amplitude[row].map(|v| v * factor)
    }

    /// Tables of the scenario, and the file.
    pub fn text(&self, number: usize, case: &Case, files: Files<'_>) -> String {
        let count = self.amplitude.len();
        let mut places = match &self.moved {
            Moved::Placed(wall) => vertices(case, *wall).to_vec(),
            _ => Vec::new(),
        };
        let mut vectors = Vec::new();
        for k in 0..=self.steps {
            for (row, [velocity, spin]) in (0..count).map(|row| self.motion(k, row)).enumerate() {
                match &self.moved {
                    Moved::Particles(_) => vectors.extend([velocity, spin]),
                    Moved::Driven(_) => vectors.push(velocity),
                    Moved::Placed(_) => {
                        if k > 0 {
                            places[row] += velocity * case.time_step.unwrap_or_default();
                        }
                        vectors.extend([places[row], velocity]);
                    }
                }
            }
        }
        let shape = [self.steps as usize + 1, count, 3 * vectors.len() / (count * (self.steps as usize + 1))];
        let path = files(&format!("slave-{number}.npy"), &npy(shape, &vectors));
        match &self.moved {
            Moved::Particles(ids) => {
                let (name, zero) = (format!("slaves {number}"), "[0, 0, 0]");
                let selection = format!("{{ kind = \"ids\", ids = {ids:?} }}");
                format!(
                    "[[set]]\nname = \"{name}\"\nselection = {selection}\n[[prescribe]]\nset = \"{name}\"\nvelocity = {zero}\n\
                     angular_velocity = {zero}\n[[slave]]\nset = \"{name}\"\npath = \"{path}\"\n"
                )
            }
            Moved::Driven(wall) | Moved::Placed(wall) => {
                format!("[[slave]]\nwall = \"w{wall}\"\npath = \"{path}\"\n")
            }
        }
    }
}

/// Adds recorded motions; seldom where they are refused.
pub fn add(random: &mut Random, case: &mut Case) {
    let refused = case.cell.is_some() || case.heat.is_some();
    if refused && random.happens(0.95) {
        return;
    }
    if random.happens(0.7) {
        particles(random, case);
    }
    if case.contacts != "none" && random.happens(0.6) {
        mesh(random, case);
    }
}

/// Particles that nothing else moves.
fn particles(random: &mut Random, case: &mut Case) {
    let mut some = ids(random, case.spheres.len(), 4);
    let moved = |id: &usize| {
        case.clumps.iter().any(|clump| clump.members.contains(id))
            || case.actions.iter().any(|(ids, action)| matches!(action, Action::Prescribe(_)) && ids.contains(id))
    };
    // Seldom what is refused.
    if !random.happens(0.05) {
        some.retain(|id| !moved(id));
    }
    if some.is_empty() {
        return;
    }
    let out_of_plane = random.happens(0.05);
    let dimension = if out_of_plane { 3 } else { case.dimension };
    let amplitude =
        some.iter().map(|_| [planar(dimension, vector(random, 1.0)), spin(dimension, vector(random, 200.0))]).collect();
    let steps = length(random, case);
    case.slaves.push(Slave { moved: Moved::Particles(some), amplitude, period: period(random), steps });
}

/// A mesh of two triangles at one side of the particles.
fn mesh(random: &mut Random, case: &mut Case) {
    let axis = random.below(if case.dimension == 2 { 2 } else { 3 });
    let lowest = case.spheres.iter().map(|(x, r)| x[axis] - r).fold(f64::INFINITY, f64::min) - 1e-6;
    let corner = |a: f64, b: f64| {
        let mut x = Vec3::zeros();
        (x[axis], x[(axis + 1) % 3], x[(axis + 2) % 3]) = (lowest, a / 64.0, b / 64.0);
        x
    };
    let vertices = vec![corner(-1.0, -1.0), corner(2.0, -1.0), corner(2.0, 2.0), corner(-1.0, 2.0)];
    let shape = Shape::Mesh(vertices, vec![[0, 1, 2], [0, 2, 3]]);
    let number = case.walls.len();
    case.walls.push(Wall { shape, velocity: Vec3::zeros(), servo: None, history: None, rotation: None });
    let period = period(random);
    let one = planar(case.dimension, vector(random, 0.5));
    // In the plane both ends of an edge along z move alike.
    let bends = period.is_some() && case.dimension == 3;
    let amplitude = (0..4)
        .map(|_| [if bends { planar(case.dimension, vector(random, 0.5)) } else { one }, Vec3::zeros()])
        .collect();
    let moved = if random.happens(0.5) { Moved::Driven(number) } else { Moved::Placed(number) };
    if let Moved::Placed(_) = moved {
        // Places need the step. Below that of all scenarios here, which is some 1e-7 s.
        case.time_step = Some(if case.dimension == 2 { 2e-7 } else { 2e-8 });
    }
    let steps = length(random, case);
    case.slaves.push(Slave { moved, amplitude, period, steps });
    if random.happens(0.3) {
        let keys = format!("wall = \"w{number}\"\narea = 1e-5\n");
        case.samples.push(Sample { operator: "wall-traction", region: Region::None, keys, velocity: Vec3::zeros() });
    }
}

fn period(random: &mut Random) -> Option<f64> {
    random.happens(0.6).then(|| random.one_of(&[20.0, 60.0, 200.0]))
}

/// Steps of a file: at least those of the run, but seldom fewer.
fn length(random: &mut Random, case: &Case) -> u64 {
    if random.happens(0.03) { case.steps - 1 } else { case.steps + random.below(3) as u64 }
}

fn vertices(case: &Case, wall: usize) -> &[Vec3] {
    let Shape::Mesh(vertices, _) = &case.walls[wall].shape else { panic!("wall {wall} is no mesh") };
    vertices
}

/// The scenario with the same motions given otherwise, if it can be: constant ones of particles by `[[prescribe]]`, constant ones of
/// meshes by their `motion`, and places by velocities.
pub fn given_otherwise(case: &Case) -> Option<Case> {
    if case.slaves.is_empty() {
        return None;
    }
    let mut twin = case.clone();
    let mut changed = false;
    twin.slaves.retain_mut(|slave| {
        let constant = slave.period.is_none();
        match slave.moved.clone() {
            Moved::Particles(ids) if constant => {
                for (id, [v, w]) in ids.into_iter().zip(&slave.amplitude) {
                    let all = |v: &Vec3| [v.x, v.y, v.z].map(Some);
                    let motion = Motion { velocity: all(v), angular_velocity: all(w), ..Motion::default() };
                    twin.actions.push((vec![id], Action::Prescribe(motion)));
                }
            }
            Moved::Driven(wall) | Moved::Placed(wall) if constant => twin.walls[wall].velocity = slave.amplitude[0][0],
            Moved::Placed(wall) => {
                slave.moved = Moved::Driven(wall);
                changed = true;
                return true;
            }
            _ => return true,
        }
        changed = true;
        false
    });
    changed.then_some(twin)
}

/// An array in NumPy's format.
fn npy(shape: [usize; 3], vectors: &[Vec3]) -> Vec<u8> {
    let [a, b, c] = shape;
    let mut header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({a}, {b}, {c}), }}");
    // The values begin at a multiple of 64 bytes.
    while !(10 + header.len() + 1).is_multiple_of(64) {
        header.push(' ');
    }
    let _ = writeln!(header);
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    vectors.iter().flat_map(|v| v.iter()).for_each(|c| bytes.extend(c.to_le_bytes()));
    bytes
}
