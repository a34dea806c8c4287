//! What must hold for every scenario that runs.

use std::collections::BTreeSet;
use std::path::Path;

use concordem::math::{Mat3, Vec3};
use concordem::sampling::Record;
use concordem::state::State;
use concordem::state::columns::{ColumnStore, StoredColumn};
use concordem_tests::on_threads;

use crate::case::{Case, Loading};
use crate::compare::turnover;
use crate::heat::SPECIFIC_HEAT;
use crate::run::{Options, Outcome, Run, run};
use crate::slaves::Moved;
use crate::twins;

/// Name of a part of the energy, and where a record has it.
type Part = (&'static str, fn(&Record) -> f64);

/// All oracles. Each must have compared something in the scenarios of the record.
pub const ORACLES: &[&str] = &[
    "negative dissipation",
    "falling dissipation",
    "kinetic energy",
    "energy created",
    "momentum",
    "angular momentum",
    "stress of loads",
    "heat",
    "trace of fabric",
    "porosity",
    "mean stress of particles",
    "parts of the power",
    "sum of internal forces",
    "recorded motion",
    "servo of a cell",
    "servo of a wall",
    "threads",
    "restart",
    "sampling",
    "turn",
    "image shift",
    "infinite walls",
    "facets",
    "mesh",
    "slaves",
];

/// What an oracle found.
#[derive(Debug)]
pub struct Finding {
    pub oracle: &'static str,
    pub detail: String,
}

/// What the oracles found in a scenario.
#[derive(Debug, Default)]
pub struct Judgement {
    pub findings: Vec<Finding>,
    /// Oracles that compared something.
    pub compared: BTreeSet<&'static str>,
}

impl Judgement {
    pub fn find(&mut self, oracle: &'static str, detail: String) {
        self.findings.push(Finding { oracle, detail });
    }

    /// Says that an oracle has compared something.
    pub fn compared(&mut self, oracle: &'static str) {
        assert!(ORACLES.contains(&oracle), "{oracle} is not in the list");
        self.compared.insert(oracle);
    }
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
pub fn judge(case: &Case, folder: &Path) -> (Verdict, Judgement) {
    let mut judged = Judgement::default();
    let base = match run(case, folder, Options::default()) {
        Err(panic) => {
            judged.find("panic", panic.clone());
            return (Verdict::Ended(panic), judged);
        }
        Ok(Outcome::Refused(message)) => {
            if !has_remedy(&message) {
                judged.find("refusal without a remedy", message.clone());
            }
            return (Verdict::Refused(message), judged);
        }
        Ok(Outcome::Failed(message, base)) => {
            // The guard looks at records, between which the energy of an unstable motion grows without limit.
            if !guarded(&message) {
                energy(case, &base, &mut judged);
            }
            return (Verdict::Ended(message), judged);
        }
        Ok(Outcome::Done(base)) => base,
    };
    energy(case, &base, &mut judged);
    balance(&base, &mut judged);
    heat(&base, &mut judged);
    operators(&base, &mut judged);
    follow(case, &base, &mut judged);
    servo_of_cell(case, &base, &mut judged);
    servos_of_walls(case, &base, &mut judged);
    // The twins have the same time step: "auto" rests on a Lanczos iteration whose start vector is not that of another frame.
    let mut same = case.clone();
    same.time_step = Some(base.dt);
    repeats(&same, &base, folder, &mut judged);
    let chaotic = twins::compare(&same, &base, folder, &mut judged);
    (Verdict::Ran { chaotic }, judged)
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
fn energy(case: &Case, run: &Run, judged: &mut Judgement) {
    let scale = turnover(run);
    // Roundings: forces times the rounding of coordinates, over all steps.
    let tolerance = 1e-9 * scale + 1e-16;
    // In Woo's formulation of the concrete law shear has no memory: unloading recovers slip, and with it the work of friction. It
    // is a state without a potential, which can make energy.
    let woo = case.materials.contains("woo");
    // Overstress counts as a stress without stored energy: its share of an unloading step can be negative.
    let overstress = case.materials.contains("damage_time");
    judged.compared("negative dissipation");
    judged.compared("falling dissipation");
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
            judged.find("negative dissipation", format!("{name} {lowest:.2e} of {scale:.2e} J"));
        }
        let fall = run.records.windows(2).map(|w| of(&w[1]) - of(&w[0])).fold(0.0, f64::min);
        // A contact takes back what a bond that breaks under pressure has released, one step later.
        if fall < -tolerance && lowest >= -tolerance && name != "damage" {
            judged.find("falling dissipation", format!("{name} by {fall:.2e} of {scale:.2e} J"));
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
    judged.compared("kinetic energy");
    // At half steps a vibration with Ω = ωΔt has up to 1/(1 − Ω²/4) of the energy that leapfrog conserves; "auto" has Ω ≤ 1.6.
    if kinetic > 3.0 * available + 1e-16 {
        judged.find("kinetic energy", format!("{kinetic:.3e} J of {available:.3e} J available"));
    }
    // Others are guarded up to 5 %.
    if yade {
        return;
    }
    judged.compared("energy created");
    // Walls have no energy in the ledger: the guard adds that of all particles at the velocity of the fastest wall.
    let wall = run.state.walls.iter().map(|wall| wall.speed().powi(2)).fold(0.0, f64::max);
    let of_walls = 0.5 * run.state.particles.mass.iter().sum::<f64>() * wall;
    // A run that ends is not judged at its last record, which may come many steps after the one before.
    let created = created(&run.records[..run.records.len().saturating_sub(1)]);
    if created > 0.05 * (scale.max(available) + of_walls) + 1e-16 {
        judged.find("energy created", format!("{created:.2e} of {scale:.2e} J"));
    }
}

/// Heat is conserved to rounding: relative to what has moved, and to the content of all particles.
fn heat(run: &Run, judged: &mut Judgement) {
    let Some(state) = &run.state.heat else { return };
    judged.compared("heat");
    let content = run.state.particles.mass.iter().sum::<f64>() * SPECIFIC_HEAT * 300.0;
    for record in &run.records {
        let scale = content + record.heat_sources.abs() + record.heat_boundary.abs();
        if record.heat_residual.abs() > 1e-12 * scale || record.heat_residual.is_nan() {
            judged.find("heat", format!("residual {:.2e} of {scale:.2e} J", record.heat_residual));
            return;
        }
    }
    if state.temperature.iter().any(|t| !t.is_finite()) {
        judged.find("heat", "a temperature is not finite".to_owned());
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
fn balance(run: &Run, judged: &mut Judgement) {
    let [linear, angular] = run.balance.error;
    let errors = [("momentum", linear), ("angular momentum", angular), ("stress of loads", run.balance.stress)];
    for ((name, error), compared) in errors.into_iter().zip(run.balance.compared()) {
        if compared {
            judged.compared(name);
        }
        if error.is_nan() || error > 1e-12 {
            judged.find(name, format!("{error:.1e} of the scale"));
        }
    }
}

/// What repeats a recorded motion is where this motion ends. Tolerance: roundings of places of up to 0.1 m, over 300 steps.
fn follow(case: &Case, run: &Run, judged: &mut Judgement) {
    let (initial, state) = (&run.initial, &run.state);
    if !case.slaves.is_empty() {
        judged.compared("recorded motion");
    }
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
        judged.find("recorded motion", format!("off by {worst:.1e} m"));
    }
}

/// The stress of a cell is that of its servo, or the run says that it is not. Between 0.1 and 1 % of the target, which surround the
/// tolerance of 0.5 %, either is right.
fn servo_of_cell(case: &Case, run: &Run, judged: &mut Judgement) {
    let (Loading::CellStress(target, _), true, Some(cell)) = (&case.loading, case.stages.is_empty(), &run.state.cell)
    else {
        return;
    };
    let stress = run.virial / cell.volume();
    let error = ((stress + stress.transpose()) * 0.5 - target).abs().max() / target.abs().max();
    let said = run.unmet.iter().any(|said| said.starts_with("the stress of the cell"));
    judged.compared("servo of a cell");
    if error.is_nan() || error > 0.01 && !said || error < 0.001 && said {
        judged.find("servo of a cell", format!("off by {error:.1e} of the target, and the run says {:?}", run.unmet));
    }
}

/// The force of a wall is that of its servo, or the run says that it is not. Between 0.5 and 2 %, which surround the bound of 1 %, either is
/// right. No wall is faster than its servo may be.
fn servos_of_walls(case: &Case, run: &Run, judged: &mut Judgement) {
    for (k, (wall, found)) in case.walls.iter().zip(&run.state.walls).enumerate() {
        let Some(servo) = &wall.servo else { continue };
        let name = format!("wall `w{k}`");
        let said = run.unmet.iter().any(|said| said.contains(&name));
        if found.velocity.norm() > servo.maximum_speed * (1.0 + 1e-15) {
            judged.find("servo of a wall", format!("{name} moves with {} m/s", found.velocity.norm()));
        }
        if wall.history.is_some() || !case.stages.is_empty() {
            continue;
        }
        // The particles push the wall back with the force that it presses with.
        let error = (1.0 + found.force.dot(&servo.direction) / servo.force).abs();
        judged.compared("servo of a wall");
        if error.is_nan() || error > 0.02 && !said || error < 0.005 && said {
            judged.find("servo of a wall", format!("{name} is off by {error:.1e}, and the run says {:?}", run.unmet));
        }
    }
}

/// Operators agree with each other where they give the same quantity.
fn operators(run: &Run, judged: &mut Judgement) {
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
            judged.compared(what);
            if error > 1e-9 {
                judged.find("operators", format!("{what} at step {step}: {error:.1e}"));
                return;
            }
        }
    }
}

/// The same bits on several threads and after a restart, and the same state with samples at other steps.
fn repeats(case: &Case, base: &Run, folder: &Path, judged: &mut Judgement) {
    let half = Options { restart: Some(case.steps / 2), ..Options::default() };
    let whole = base.bits();
    let again =
        [("threads", on_threads(3, || run(case, folder, Options::default()))), ("restart", run(case, folder, half))];
    for (name, outcome) in again {
        let other = match outcome {
            Ok(Outcome::Done(other)) => other.bits(),
            Ok(Outcome::Refused(message) | Outcome::Failed(message, _)) | Err(message) => {
                judged.find(name, message);
                continue;
            }
        };
        judged.compared(name);
        let parts: Vec<&str> =
            [("records", whole.0 == other.0), ("operators", whole.1 == other.1), ("state", whole.2 == other.2)]
                .iter()
                .filter(|(_, same)| !same)
                .map(|(part, _)| *part)
                .collect();
        if !parts.is_empty() {
            judged.find(name, format!("differ: {}", parts.join(", ")));
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
            judged.compared("sampling");
            let different = different_columns(&base.state, &other.state);
            if !different.is_empty() {
                judged.find("sampling", format!("with another interval of samples differ: {}", different.join(", ")));
            }
        }
        // So does the guard of the energy, and operators may not exist at other steps.
        Ok(Outcome::Failed(message, _)) if guarded(&message) || message.starts_with("sample `") => {}
        Ok(Outcome::Refused(message) | Outcome::Failed(message, _)) | Err(message) => judged.find("sampling", message),
    }
}

/// Whether the guard of the energy ended a run.
pub fn guarded(message: &str) -> bool {
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
