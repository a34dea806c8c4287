//! What must hold for every scenario that runs.

use std::path::Path;

use concordem::math::{Mat3, Vec3};
use concordem::sampling::Record;
use concordem::state::State;
use concordem::state::columns::{ColumnStore, StoredColumn};
use concordem_tests::on_threads;
use concordem_tests::random::Random;

use crate::case::{Action, Case, Loading, Shape, Turn};
use crate::compare::{Differences, MOST_DIRECTIONS, NOISE, chaotic, differences, excess, turnover};
use crate::finite_walls;
use crate::heat::SPECIFIC_HEAT;
use crate::run::{Options, Outcome, Run, run};
use crate::slaves::{self, Moved};

/// Name of a part of the energy, and where a record has it.
type Part = (&'static str, fn(&Record) -> f64);

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

/// What an oracle found.
#[derive(Debug)]
pub struct Finding {
    pub oracle: &'static str,
    pub detail: String,
}

/// How a scenario went.
pub enum Verdict {
    /// It was refused, with this message.
    Refused(String),
    /// It ended in an error, with this message.
    Ended(String),
    /// It ran; whether its motion is too sensitive for comparisons.
    Ran { chaotic: bool },
}

/// Runs a scenario with all its twins.
pub fn judge(case: &Case, folder: &Path) -> (Verdict, Vec<Finding>) {
    let mut findings = Vec::new();
    let mut add = |oracle, detail: String| findings.push(Finding { oracle, detail });
    let base = match run(case, folder, Options::default()) {
        Err(panic) => {
            add("panic", panic.clone());
            return (Verdict::Ended(panic), findings);
        }
        Ok(Outcome::Refused(message)) => {
            if !has_remedy(&message) {
                add("refusal without a remedy", message.clone());
            }
            return (Verdict::Refused(message), findings);
        }
        Ok(Outcome::Failed(message, base)) => {
            // The guard looks at records, between which the energy of an unstable motion grows without limit.
            if !guarded(&message) {
                energy(case, &base, &mut add);
            }
            return (Verdict::Ended(message), findings);
        }
        Ok(Outcome::Done(base)) => base,
    };
    energy(case, &base, &mut add);
    balance(&base, &mut add);
    heat(&base, &mut add);
    operators(&base, &mut add);
    follow(case, &base, &mut add);
    // The twins have the same time step: "auto" rests on a Lanczos iteration whose start vector is not that of another frame.
    let mut same = case.clone();
    same.time_step = Some(base.dt);
    repeats(&same, &base, folder, &mut add);
    let chaotic = twins(&same, &base, folder, &mut add);
    (Verdict::Ran { chaotic }, findings)
}

/// Whether a message tells what to do.
fn has_remedy(message: &str) -> bool {
    let words = [
        "help", "use ", "give ", "remove", "write", "add ", "set ", "move", "choose", "check", "exclude", "lower",
        "join", "must be", "turn ",
    ];
    words.iter().any(|word| message.contains(word))
}

/// No dissipated part is negative or falls, and no energy comes from nowhere.
fn energy(case: &Case, run: &Run, add: &mut dyn FnMut(&'static str, String)) {
    let scale = turnover(run);
    // Roundings: forces times the rounding of coordinates, over all steps.
    let tolerance = 1e-9 * scale + 1e-16;
    // In Woo's formulation of the concrete law shear has no memory: unloading recovers slip, and with it the work of friction. It
    // is a state without a potential, which can make energy.
    let woo = case.materials.contains("woo");
    // Overstress counts as a stress without stored energy: its share of an unloading step can be negative.
    let overstress = case.materials.contains("damage_time");
    let of_record: [Part; 3] = [("damage", |r| r.damage), ("friction", |r| r.friction), ("viscous", |r| r.viscous)];
    for (name, of) in of_record {
        if woo && name == "friction" || overstress && name == "viscous" {
            continue;
        }
        let lowest = run.records.iter().map(of).fold(0.0, f64::min);
        // In the step in which a bond breaks its forces are void, and the surfaces of particles that deform move back. The contact that
        // follows begins with the larger overlap, so it takes back a little more than the bond had (here 1 % of a bond's energy).
        let moved = case.materials.contains("deformable") && name == "damage";
        let tolerance = if moved { 1e-5 * scale } else { tolerance };
        if lowest < -tolerance {
            add("negative dissipation", format!("{name} {lowest:.2e} of {scale:.2e} J"));
        }
        let fall = run.records.windows(2).map(|w| of(&w[1]) - of(&w[0])).fold(0.0, f64::min);
        // A contact takes back what a bond that breaks under pressure has released, one step later.
        if fall < -tolerance && lowest >= -tolerance && name != "damage" {
            add("falling dissipation", format!("{name} by {fall:.2e} of {scale:.2e} J"));
        }
    }
    if woo || !run.state.ledger.started {
        return;
    }
    let largest = |of: fn(&Record) -> f64| run.records.iter().map(|r| of(r).abs()).fold(0.0, f64::max);
    // The last record can be older than the state, and half of the last step's work is not booked yet: that of prescribed motions
    // may be all that they have.
    let ledger = &run.state.ledger;
    let available = ledger.initial.abs()
        + prescribed(run)
        + largest(|r| r.boundary_work).max(ledger.boundary_work.get().abs())
        + largest(|r| r.external_work).max(ledger.external_work.get().abs())
        + largest(|r| r.expansion_work).max(ledger.expansion_work.get().abs())
        + largest(|r| r.stiffness_work).max(ledger.stiffness_work.get().abs());
    // YADE's measures do not close the ledger (docs/book/theory/kinematics.md): what they create is available, too.
    let yade = case.kinematics.starts_with("yade");
    let created = |records: &[Record]| records.iter().map(|r| -r.integration - r.residual).fold(0.0, f64::max);
    let available = if yade { available + created(&run.records) } else { available };
    let kinetic = kinetic(run);
    // At half steps a vibration with Ω = ωΔt has up to 1/(1 − Ω²/4) of the energy that leapfrog conserves; "auto" has Ω ≤ 1.6.
    if kinetic > 3.0 * available + 1e-16 {
        add("kinetic energy", format!("{kinetic:.3e} J of {available:.3e} J available"));
    }
    // Others are guarded up to 5 %.
    if yade {
        return;
    }
    // Walls have no energy in the ledger: the guard adds that of all particles at the velocity of the fastest wall.
    let wall = run.state.walls.iter().map(|wall| wall.speed().powi(2)).fold(0.0, f64::max);
    let of_walls = 0.5 * run.state.particles.mass.iter().sum::<f64>() * wall;
    // A run that ends is not judged at its last record, which may come many steps after the one before.
    let created = created(&run.records[..run.records.len().saturating_sub(1)]);
    if created > 0.05 * (scale.max(available) + of_walls) + 1e-16 {
        add("energy created", format!("{created:.2e} of {scale:.2e} J"));
    }
}

/// Heat is conserved to rounding: relative to what has moved, and to the content of all particles.
fn heat(run: &Run, add: &mut dyn FnMut(&'static str, String)) {
    let Some(state) = &run.state.heat else { return };
    let content = run.state.particles.mass.iter().sum::<f64>() * SPECIFIC_HEAT * 300.0;
    for record in &run.records {
        let scale = content + record.heat_sources.abs() + record.heat_boundary.abs();
        if record.heat_residual.abs() > 1e-12 * scale || record.heat_residual.is_nan() {
            add("heat", format!("residual {:.2e} of {scale:.2e} J", record.heat_residual));
            return;
        }
    }
    if state.temperature.iter().any(|t| !t.is_finite()) {
        add("heat", "a temperature is not finite".to_owned());
    }
}

/// Kinetic energy of the prescribed components of motion, J.
fn prescribed(run: &Run) -> f64 {
    let particles = &run.state.particles;
    let energy = |p: usize, i: usize| {
        let (v, w, given) = (particles.velocity[p][i], particles.angular_velocity[p][i], particles.constraint[p]);
        let translation = if given.translation(i) { particles.mass[p] * v * v } else { 0.0 };
        let rotation = if given.rotation(i) { particles.inertia[p] * w * w } else { 0.0 };
        0.5 * (translation + rotation)
    };
    (0..particles.len()).flat_map(|p| (0..3).map(move |i| (p, i))).map(|(p, i)| energy(p, i)).sum()
}

/// Kinetic energy of the last velocities, J.
fn kinetic(run: &Run) -> f64 {
    let particles = &run.state.particles;
    let free = (0..particles.len()).filter(|&p| particles.clump[p] == u32::MAX).map(|p| {
        let (v, w) = (particles.velocity[p], particles.angular_velocity[p]);
        0.5 * (particles.mass[p] * v.norm_squared() + particles.inertia[p] * w.norm_squared())
    });
    let bodies = run.state.clumps.iter().map(|c| 0.5 * c.mass * c.velocity.norm_squared() + c.rotational_energy());
    free.sum::<f64>() + bodies.sum::<f64>()
}

/// Momentum, and stresses against loads. Tolerance: the roundings of a few hundred steps of some hundred forces.
fn balance(run: &Run, add: &mut dyn FnMut(&'static str, String)) {
    let [linear, angular] = run.balance.error;
    for (name, error) in [("momentum", linear), ("angular momentum", angular), ("stress of loads", run.balance.stress)]
    {
        if error.is_nan() || error > 1e-12 {
            add(name, format!("{error:.1e} of the scale"));
        }
    }
}

/// What repeats a recorded motion is where this motion ends. Tolerance: roundings of places of up to 0.1 m, over 300 steps.
fn follow(case: &Case, run: &Run, add: &mut dyn FnMut(&'static str, String)) {
    let (initial, state) = (&run.initial, &run.state);
    let mut worst = 0.0_f64;
    for slave in &case.slaves {
        let path = |row: usize| (1..=state.clock.step).map(|k| slave.motion(k, row)[0]).sum::<Vec3>() * run.dt;
        let mut compare = |row: usize, from: &Vec3, to: &Vec3| worst = worst.max((to - from - path(row)).norm());
        match &slave.moved {
            Moved::Particles(ids) => {
                let order = run.by_id();
                // A clump that replaces packed spheres does not change the numbers of others.
                ids.iter().enumerate().for_each(|(row, &id)| {
                    let p = order[id];
                    compare(row, &initial.particles.position[p], &state.particles.position[p]);
                });
            }
            Moved::Driven(wall) | Moved::Placed(wall) => {
                let [from, to] = [initial, state].map(|state| state.walls[*wall].mesh().map(|mesh| &mesh.position));
                let (Some(from), Some(to)) = (from, to) else { continue };
                from.iter().zip(to).enumerate().for_each(|(row, (from, to))| compare(row, from, to));
            }
        }
    }
    if worst > 1e-14 || worst.is_nan() {
        add("recorded motion", format!("off by {worst:.1e} m"));
    }
}

/// Operators agree with each other where they give the same quantity.
fn operators(run: &Run, add: &mut dyn FnMut(&'static str, String)) {
    // What the forces do in a uniform motion: powers are differences of it.
    let moving = (run.fastest * run.balance.largest_force).max(f64::MIN_POSITIVE);
    for ((k, step), values) in &run.rows {
        let sample = &run.operators[*k];
        let cells = sample.cells();
        let quantity = |name: &str, cell: usize| -> Vec<f64> {
            let mut first = 0;
            for q in sample.operator.quantities() {
                if q.name == name {
                    return values[first + cell * q.components..first + (cell + 1) * q.components].to_vec();
                }
                first += q.components * cells;
            }
            Vec::new()
        };
        let worst = |a: f64, b: f64| (a - b).abs() / a.abs().max(b.abs()).max(f64::MIN_POSITIVE);
        for cell in 0..cells {
            let scalar = |name: &str| quantity(name, cell)[0];
            let tensor = |name: &str| Mat3::from_row_slice(&quantity(name, cell));
            let (what, error) = match sample.operator.name() {
                "fabric" => ("trace of fabric", worst(tensor("fabric").trace(), 1.0)),
                "porosity" => ("porosity", worst(scalar("solid_fraction") + scalar("porosity"), 1.0)),
                "particle-stress" => {
                    let (a, b) = (tensor("stress"), tensor("mean_particle_stress") * scalar("solid_fraction"));
                    ("mean stress of particles", (a - b).norm() / a.norm().max(f64::MIN_POSITIVE))
                }
                "power" => {
                    let [all, stress, couple, gap] = ["contacts", "stress", "couple", "gap"].map(scalar);
                    ("parts of the power", (all - stress - couple - gap).abs() / moving)
                }
                "couple-stress" => {
                    let force = Vec3::from_column_slice(&quantity("rigid_force", cell)).norm();
                    // Over a length of 1 mm.
                    let scale = tensor("stress").norm() / 1e-3;
                    ("sum of internal forces", force / scale.max(f64::MIN_POSITIVE))
                }
                _ => continue,
            };
            if error > 1e-9 {
                add("operators", format!("{what} at step {step}: {error:.1e}"));
                return;
            }
        }
    }
}

/// The same bits on several threads and after a restart, and the same state with samples at other steps.
fn repeats(case: &Case, base: &Run, folder: &Path, add: &mut dyn FnMut(&'static str, String)) {
    let half = Options { restart: Some(case.steps / 2), ..Options::default() };
    let whole = base.bits();
    let again =
        [("threads", on_threads(3, || run(case, folder, Options::default()))), ("restart", run(case, folder, half))];
    for (name, outcome) in again {
        let other = match outcome {
            Ok(Outcome::Done(other)) => other.bits(),
            Ok(Outcome::Refused(message) | Outcome::Failed(message, _)) | Err(message) => {
                add(name, message);
                continue;
            }
        };
        let parts: Vec<&str> =
            [("records", whole.0 == other.0), ("operators", whole.1 == other.1), ("state", whole.2 == other.2)]
                .iter()
                .filter(|(_, same)| !same)
                .map(|(part, _)| *part)
                .collect();
        if !parts.is_empty() {
            add(name, format!("differ: {}", parts.join(", ")));
        }
    }
    // All conditions of stages but steps are checked with each record.
    if case.stages.iter().any(|stage| stage.stop.contains(',')) {
        return;
    }
    // Steps with a sample have loops of their own.
    let mut sampled = case.clone();
    sampled.interval = if case.interval == 1 { 7 } else { 1 };
    match run(&sampled, folder, Options::default()) {
        // Stops look at records, too.
        Ok(Outcome::Done(other)) if other.state.clock.step != base.state.clock.step => {}
        Ok(Outcome::Done(mut other)) => {
            // Only steps with a sample need the stored energy.
            other.state.ledger.stored = base.state.ledger.stored;
            let different = different_columns(&base.state, &other.state);
            if !different.is_empty() {
                add("sampling", format!("with another interval of samples differ: {}", different.join(", ")));
            }
        }
        // So does the guard of the energy, and operators may not exist at other steps.
        Ok(Outcome::Failed(message, _)) if guarded(&message) || message.starts_with("sample `") => {}
        Ok(Outcome::Refused(message) | Outcome::Failed(message, _)) | Err(message) => add("sampling", message),
    }
}

/// Whether the guard of the energy ended a run.
fn guarded(message: &str) -> bool {
    message.contains("without a s") || message.contains("unstable")
}

/// Names of the columns whose bits differ.
fn different_columns(a: &State, b: &State) -> Vec<String> {
    let [a, b] = [a, b].map(|state| ColumnStore::of(state).expect("columns"));
    let differs = |(name, column): &(&str, &StoredColumn)| {
        // The schedule keeps what it has recorded.
        *name != "plan" && b.get(name).is_none_or(|other| other.borrow().bytes() != column.borrow().bytes())
    };
    a.iter().filter(differs).map(|(name, _)| name.to_owned()).collect()
}

/// Another frame, other images, other walls. Returns whether the motion is too sensitive to compare.
fn twins(case: &Case, base: &Run, folder: &Path, add: &mut dyn FnMut(&'static str, String)) -> bool {
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
    let mut compare = |name: &'static str, twin: &Case, turn: &Turn, excluded: &dyn Fn(&str) -> bool| {
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
                add(name, message);
                return;
            }
        };
        // A bond that is about to break, or a center at the border of a region, may fall to either side. More directions of noise show
        // whether it does.
        while !excess(&found, &noise, excluded).is_empty() {
            let Some(direction) = directions.next() else {
                add(name, excess(&found, &noise, excluded).join("; "));
                return;
            };
            if !disturb(&mut noise, NOISE, direction) {
                sensitive = true;
                return;
            }
        }
    };
    let turn = Turn::of(case.dimension);
    let in_cell = case.cell.is_some();
    // The series of strain and stress of a cell are those of one component, whose sign is that of an axis. Cells of a grid are
    // numbered along the axes.
    let grid = case.samples.iter().any(|sample| sample.keys.contains("grid"));
    let two_points = in_cell && case.kinematics.starts_with("yade");
    compare("turn", &case.turned(&turn), &turn, &|name| {
        let by_point = YADE_POINTS.iter().any(|start| name.starts_with(start));
        two_points && by_point
            || in_cell && ["series strain", "series gauge_strain", "series stress"].contains(&name)
            || grid && !name.starts_with("series") && name.contains(' ') && name != "angular velocity"
    });
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
    if case.cell.is_some()
        || turns
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
    for wall in twin.walls.iter_mut().filter(|wall| wall.history.is_none()) {
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
