//! Twins of a scenario, whose motion must be the same up to rounding: another frame, other images, other walls, motions given otherwise.

use std::path::Path;

use concordem::math::{Mat3, Vec3};
use concordem_tests::random::Random;

use crate::case::{Action, Case, Loading, Shape, Turn};
use crate::compare::{Differences, MOST_DIRECTIONS, NOISE, chaotic, differences, excess};
use crate::finite_walls;
use crate::oracles::{Judgement, guarded};
use crate::run::{Options, Outcome, Run, run};
use crate::slaves;

/// Quantities in which YADE's torque arms appear: in a periodic scene the arms of A and B do not meet in a point, operators take that
/// of A, and the numbering of the particles decides which one is A.
const YADE_POINTS: [&str; 6] = [
    "power",
    "couple-stress",
    "particle-stress",
    "boundary-stress couple_stress",
    "set-force moment",
    "set-force reaction_moment",
];

/// Compares a scenario with all its twins. Returns whether the motion is too sensitive to compare.
pub fn compare(case: &Case, base: &Run, folder: &Path, judged: &mut Judgement) -> bool {
    let unturned = Turn(Mat3::identity());
    let mut noise = Differences::new();
    let disturb = |noise: &mut Differences, size: f64, direction: usize| {
        let options = Options { noise: size, direction, restart: None };
        let Ok(Outcome::Done(twin)) = run(case, folder, options) else { return false };
        let found = differences(base, &twin, &unturned);
        if chaotic(&found) {
            return false;
        }
        for (name, difference) in found {
            let entry = noise.entry(name).or_insert(0.0);
            // Not a number stays.
            *entry = if difference.is_nan() || entry.is_nan() { f64::NAN } else { entry.max(difference) };
        }
        true
    };
    // In both directions: where something begins within rounding of a step, such as a contact, one of them moves it.
    if ![NOISE, -NOISE].into_iter().all(|size| disturb(&mut noise, size, 0)) {
        return true;
    }
    let mut directions = 1..MOST_DIRECTIONS;
    let mut sensitive = false;
    let moving = matches!(case.loading, Loading::CellStrain(_));
    // The stiffness of a Hertzian impact, which the gain of a servo follows from, grows with the largest speed to be expected: that of a fall
    // through the space that particles and walls take up as they are listed.
    let by_speed = case.contacts == "hertz_mindlin" && case.walls.iter().any(|wall| wall.servo.is_some());
    let mut compare = |name: &'static str, twin: &Case, turn: &Turn, excluded: &dyn Fn(&str) -> bool| {
        if by_speed && ["image shift", "infinite walls", "facets", "mesh"].contains(&name) {
            return;
        }
        let found: Differences = match run(twin, folder, Options::default()) {
            Ok(Outcome::Done(other)) => differences(base, &other, turn),
            // Every triangle near a particle counts for the bound as if it touched: the step of the planes may be too large.
            Ok(Outcome::Refused(message))
                if ["facets", "mesh"].contains(&name) && message.contains("stable only below") =>
            {
                return;
            }
            // Images that move have another energy, by which the guard judges.
            Ok(Outcome::Failed(message, _)) if name == "image shift" && moving && guarded(&message) => return,
            Ok(Outcome::Refused(message) | Outcome::Failed(message, _)) | Err(message) => {
                judged.find(name, message);
                return;
            }
        };
        // A bond that is about to break, or a center at the border of a region, may fall to either side. More directions of noise show
        // whether it does.
        while !excess(&found, &noise, excluded).is_empty() {
            let Some(direction) = directions.next() else {
                judged.find(name, excess(&found, &noise, excluded).join("; "));
                return;
            };
            if !disturb(&mut noise, NOISE, direction) {
                sensitive = true;
                return;
            }
        }
        judged.compared(name);
    };
    let turn = Turn::of(case.dimension);
    let in_cell = case.cell.is_some();
    // The series of strain and stress of a cell are those of one component, whose sign is that of an axis. Cells of a grid are
    // numbered along the axes.
    let grid = case.samples.iter().any(|sample| sample.keys.contains("grid"));
    let two_points = in_cell && case.kinematics.starts_with("yade");
    // A field of strengths is fixed in space.
    if !case.materials.contains("correlation_length") {
        compare("turn", &case.turned(&turn), &turn, &|name| {
            let by_point = YADE_POINTS.iter().any(|start| name.starts_with(start));
            two_points && by_point
                || in_cell && ["series strain", "series gauge_strain", "series stress"].contains(&name)
                || grid && !name.starts_with("series") && name.contains(' ') && name != "angular velocity"
        });
    }
    if let Some(twin) = shifted(case) {
        compare("image shift", &twin, &unturned, &|name| depends_on_images(name, moving));
    }
    if let Some(twin) = finite_walls::infinite(case, &base.state.particles.position) {
        compare("infinite walls", &twin, &unturned, &|_| false);
    }
    if let Some(twin) = with_facets(case) {
        compare("facets", &twin, &unturned, &|_| false);
        // Seldom, to save time: the twin differs only in how the triangles move.
        if case.spheres.len().is_multiple_of(2) {
            compare("mesh", &with_meshes(&twin), &unturned, &|_| false);
        }
    }
    if let Some(twin) = slaves::given_otherwise(case) {
        compare("slaves", &twin, &unturned, &|_| false);
    }
    sensitive
}

/// Whether a quantity belongs to the particles where they are listed, and not to the periodic medium. `moving`: images move, so
/// that their energies and powers are others.
///
/// A fit of an affine motion to the particles of a cell weighs them by where they are. The moment of forces that are out of
/// balance depends on where they act. A body's loads have no periodic images.
fn depends_on_images(name: &str, moving: bool) -> bool {
    // A set is the particles as they are listed: its mean place, and arms of forces from there.
    let of_sets = [
        "set-motion position",
        "set-force moment",
        "set-force reaction_moment",
        "gauge length",
        "gauge elongation",
        "gauge strain",
    ];
    let of_moving_sets = ["set-motion displacement", "set-motion velocity", "gauge opening"];
    let energies = [
        "series kinetic",
        "series boundary_work",
        "series external_work",
        "series residual",
        "series numerical_damping",
    ];
    let of_positions =
        ["affine-", "power stress", "power couple", "power gap", "couple-stress couple", "couple-stress rigid_moment"];
    of_positions.iter().any(|start| name.starts_with(start))
        || name.starts_with("boundary-stress")
        || of_sets.contains(&name)
        || moving && of_moving_sets.contains(&name)
        || moving && (energies.contains(&name) || name == "coarse-grain velocity")
}

/// The scenario with particles moved by whole edges of the cell, if that must not change anything.
///
/// In a driven cell an image moves with `v + L H n`, whose rate is `L² H n`: it is accelerated, a particle is not. Only where
/// `L² H n = 0` is an image a particle like others; YADE's kinematics accelerate particles by `L v`, too.
fn shifted(case: &Case) -> Option<Case> {
    let cell = case.cell?;
    let square = match &case.loading {
        Loading::None => Mat3::zeros(),
        Loading::CellStrain(gradient) => gradient * gradient,
        _ => return None,
    };
    // A prescribed velocity is one in space, which images do not have.
    let prescribed = case.actions.iter().any(|(_, action)| matches!(action, Action::Prescribe(..)));
    if prescribed && !matches!(case.loading, Loading::None) {
        return None;
    }
    let mut random = Random::new(case.spheres.len() as u64, 77);
    let mut twin = case.clone();
    let axes = if case.dimension == 2 { 2 } else { 3 };
    let free = |axis: usize| {
        let mut edge = Vec3::zeros();
        edge[axis] = cell[axis];
        axis < axes && (square * edge).norm() == 0.0
    };
    if !(0..3).any(free) {
        return None;
    }
    let numbers = |random: &mut Random| {
        Vec3::from_fn(|axis, _| if free(axis) { random.below(3) as f64 - 1.0 } else { 0.0 }).component_mul(&cell)
    };
    for sphere in &mut twin.spheres {
        sphere.0 += numbers(&mut random);
    }
    for clump in &mut twin.clumps {
        let shift = numbers(&mut random);
        clump.spheres.iter_mut().for_each(|sphere| sphere.0 += shift);
        for &member in &clump.members {
            twin.spheres[member].0 = case.spheres[member].0 + shift;
        }
    }
    Some(twin)
}

/// The scenario with triangles in place of planes and plates.
fn with_facets(case: &Case) -> Option<Case> {
    // Triangles cannot turn.
    let turns = case.walls.iter().any(|wall| wall.rotation.is_some());
    // Particles slow a servo of triangles down in the box around them, which is not the reach of a plate.
    let pushes = case.walls.iter().any(|wall| matches!(wall.shape, Shape::Plate(..)) && wall.servo.is_some());
    if case.cell.is_some()
        || turns
        || pushes
        || !case.walls.iter().any(|wall| matches!(wall.shape, Shape::Plane(..) | Shape::Plate(..)))
    {
        return None;
    }
    let mut twin = case.clone();
    for wall in &mut twin.walls {
        if let Shape::Plate(center, [a, b]) = &wall.shape {
            let corner = |s: f64, t: f64| center + a * (0.5 * s) + b * (0.5 * t);
            let [p, q, r, s] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            // Corners of files have 32 bits.
            if [p, q, r, s].iter().any(|x| x.map(|c| f64::from(c as f32)) != *x) {
                return None;
            }
            wall.shape = Shape::Facets(vec![[p, q, r], [p, r, s]]);
            continue;
        }
        let Shape::Plane(point, normal) = &wall.shape else { continue };
        let axis = normal.iamax();
        // Exact in 32 bits. Not much larger than the specimen: points of a triangle round as its corners do.
        let edge = 1.0 / 64.0;
        let corner = |a: f64, b: f64| {
            let mut x = Vec3::zeros();
            x[axis] = point[axis];
            x[(axis + 1) % 3] = a * edge;
            x[(axis + 2) % 3] = b * edge;
            x
        };
        wall.shape = Shape::Facets(vec![
            [corner(-1.0, -1.0), corner(2.0, -1.0), corner(2.0, 2.0)],
            [corner(-1.0, -1.0), corner(2.0, 2.0), corner(-1.0, 2.0)],
        ]);
    }
    Some(twin)
}

/// The scenario with meshes in place of triangles that move as a whole with a constant velocity.
fn with_meshes(case: &Case) -> Case {
    let mut twin = case.clone();
    for wall in twin.walls.iter_mut().filter(|wall| wall.history.is_none() && wall.servo.is_none()) {
        let Shape::Facets(triangles) = &wall.shape else { continue };
        let mut vertices: Vec<Vec3> = Vec::new();
        let mut number = |corner: &Vec3| {
            vertices.iter().position(|vertex| vertex == corner).unwrap_or_else(|| {
                vertices.push(*corner);
                vertices.len() - 1
            }) as u32
        };
        let triangles = triangles.iter().map(|corners| corners.each_ref().map(&mut number)).collect();
        wall.shape = Shape::Mesh(vertices, triangles);
    }
    twin
}
