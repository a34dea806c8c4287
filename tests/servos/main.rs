//! Servos of cells and walls over rates, stiffnesses, targets, and sizes: they reach the target, or say that they cannot.
//!
//! The tests run a small map. With `CONCORDEM_SERVOS` they run the large one (`make servos`), which goes on where it was interrupted, and
//! writes its runs to `cells.json` and `walls.json`.

use std::fmt::Write as _;
use std::time::Instant;

use concordem::math::Mat3;
use concordem::schedule::{Simulation, StopReason};
use concordem_tests::runs::{made, started};
use concordem_tests::study::{Journal, path_of};
use serde_json::{Value, json};

/// Share of the target by which a servo that stands may be off.
const TOLERANCE: f64 = 0.01;

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    /// In equilibrium, at the target.
    Reached,
    /// At the target; its steps were too few for equilibrium.
    Near,
    /// Off the target, as a warning before the run had said.
    Announced,
    /// Off the target without a warning, or at it in words only.
    Wrong,
}

/// What a run came to.
struct Run {
    end: End,
    /// Steps that it took.
    steps: u64,
    /// Largest error of what its servos control, relative to the target.
    error: f64,
    /// What is wrong.
    fault: String,
}

/// Runs a scenario to its end; `error`: largest error of what its servos control, relative to the target.
fn run(text: &str, error: impl Fn(&Simulation) -> f64) -> Run {
    let assembly = made(text);
    let keys = ["loading.maximum_strain_rate", "loading.stress"];
    let announced = assembly.summary.warnings.iter().any(|warning| keys.contains(&warning.key.as_str()));
    let mut run = started(assembly);
    let (reason, fault) = loop {
        match run.advance() {
            Ok(advance) => {
                if let Some(reason) = advance.stopped {
                    break (Some(reason), String::new());
                }
            }
            Err(error) => break (None, error.to_string()),
        }
    };
    let (error, unmet) = (error(&run), run.unmet());
    let off = error.is_nan() || error > TOLERANCE;
    let (end, fault) = match (reason, off) {
        (None, _) => (End::Wrong, fault),
        (Some(StopReason::Equilibrium), true) => (End::Wrong, "in equilibrium off the target".into()),
        (Some(StopReason::Equilibrium), false) if !unmet.is_empty() => {
            (End::Wrong, format!("equilibrium, but {unmet:?}"))
        }
        (Some(StopReason::Equilibrium), false) => (End::Reached, fault),
        (Some(_), false) => (End::Near, fault),
        (Some(_), true) if unmet.is_empty() => (End::Wrong, "off the target, and the end does not say so".into()),
        (Some(_), true) if !announced => (End::Wrong, "off the target, and no warning said so".into()),
        (Some(_), true) => (End::Announced, fault),
    };
    Run { end, steps: run.state.clock.step, error, fault }
}

impl Run {
    fn to_json(&self) -> Value {
        json!({ "end": format!("{:?}", self.end), "steps": self.steps, "error": self.error, "fault": self.fault })
    }

    fn of_json(found: &Value) -> Self {
        let ends = [End::Reached, End::Near, End::Announced, End::Wrong];
        Self {
            end: ends.into_iter().find(|end| found["end"] == format!("{end:?}")).expect("an end"),
            steps: found["steps"].as_u64().expect("a number"),
            // JSON has no NaN.
            error: found["error"].as_f64().unwrap_or(f64::NAN),
            fault: found["fault"].as_str().expect("a text").to_owned(),
        }
    }
}

/// The runs of a map.
struct Map {
    name: &'static str,
    started: Instant,
    /// Of the large map.
    journal: Option<Journal>,
    runs: Vec<(String, Run)>,
}

impl Map {
    fn new(name: &'static str) -> Self {
        let journal = large().then(|| Journal::open(&format!("servos-of-{name}")));
        Self { name, started: Instant::now(), journal, runs: Vec::new() }
    }

    fn add(&mut self, cell: String, run: impl FnOnce() -> Run) {
        let run = match &mut self.journal {
            Some(journal) => Run::of_json(&journal.part(&cell, || run().to_json())),
            None => run(),
        };
        let Run { end, steps, error, fault } = &run;
        let (count, seconds) = (self.runs.len() + 1, self.started.elapsed().as_secs());
        println!(
            "{} {count}, {seconds} s: {cell}: {end:?} after {steps} steps, off by {error:.2e}; {fault}",
            self.name
        );
        self.runs.push((cell, run));
        self.write(false);
    }

    /// Writes the record of the large map. After each run, so that a map that is not finished has a record, too.
    fn write(&self, complete: bool) {
        let Some(journal) = &self.journal else { return };
        let [reached, near, announced, wrong] =
            [End::Reached, End::Near, End::Announced, End::Wrong].map(|end| self.count(end));
        let others: Vec<Value> = (self.runs.iter().filter(|(_, run)| run.end != End::Reached))
            .map(|(cell, run)| json!({ "run": cell, "found": run.to_json() }))
            .collect();
        let largest = self.runs.iter().filter(|(_, run)| run.end == End::Reached).map(|(_, run)| run.error);
        let figures = json!({
            "complete": complete, "runs": self.runs.len(), "reached": reached, "near": near, "announced": announced,
            "wrong": wrong, "largest_error_of_reached": largest.fold(0.0, f64::max), "not_reached": others,
        });
        let record = path_of("tests/servos").join(self.name).with_extension("json");
        std::fs::write(record, journal.record(figures)).expect("a record");
    }

    fn count(&self, end: End) -> usize {
        self.runs.iter().filter(|(_, run)| run.end == end).count()
    }

    /// Says which runs went wrong, after all of them.
    fn conclude(&self) {
        let wrong: Vec<String> = (self.runs.iter().filter(|(_, run)| run.end == End::Wrong))
            .map(|(cell, run)| format!("{cell}: off by {:.2e}: {}", run.error, run.fault))
            .collect();
        let counts = [End::Reached, End::Near, End::Announced, End::Wrong].map(|end| self.count(end));
        println!("{}: reached, near, announced, wrong: {counts:?}", self.name);
        self.write(true);
        assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), self.runs.len(), wrong.join("\n"));
    }
}

const HEAD: &str = "version = 1
    [integration]
    damping = { kind = \"local\", coefficient = 0.3 }
    [stop]
    unbalanced = 1e-3
    steps = 20000
    [output]
    sample_interval = 20
    ";

/// Bonded concrete, bonded springs, and loose spheres, softer by a factor; all by the law's name.
fn material(law: &str, softer: f64) -> String {
    let parameters = match law {
        "cpm" => format!(
            "{{ young = {}, shear_ratio = 0.2, crack_onset_strain = 1e-2, relative_ductility = 30, cohesion = 1e9, \
             friction_coefficient = 0.8 }}",
            25e9 / softer
        ),
        "linear_bond" => format!("{{ normal_stiffness = {}, shear_stiffness = {} }}", 5e7 / softer, 1e7 / softer),
        _ => format!("{{ young = {}, poisson = 0.2, friction_coefficient = 0.3 }}", 7e10 / softer),
    };
    let mut text = format!("[[material]]\nname = \"m\"\ndensity = 4800\n{law} = {parameters}\n");
    if law == "hertz_mindlin" {
        text += "[contacts]\nlaw = \"hertz_mindlin\"\n";
    } else {
        let _ = write!(text, "[bonds]\nlaw = \"{law}\"\ninteraction_ratio = 1.5\n[contacts]\nlaw = \"none\"\n");
    }
    text
}

/// A cell under a pressure, Pa, or with a shear of a fifth of it.
fn cell(law: &str, softer: f64, random: bool, count: usize, rate: f64, pressure: f64, sheared: bool) -> String {
    let packing = if random {
        format!("kind = \"random-dense\"\ncount = {count}\nradius = 1e-3\nseed = 1\nshape = {{ kind = \"periodic\" }}")
    } else {
        let repeats = ((count as f64 / 4.0).cbrt().round() as usize).max(1);
        format!(
            "kind = \"lattice\"\nlattice = \"fcc\"\nradius = 1e-3\nrepeats = {:?}\nshape = {{ kind = \"periodic\" }}",
            [repeats; 3]
        )
    };
    let shear = if sheared { -0.2 * pressure } else { 0.0 };
    format!(
        "{HEAD}[packing]\n{packing}\n{}[loading]\nkind = \"cell-stress\"\nstress = [[{p}, {shear}, 0], [{shear}, {p}, 0], [0, 0, {p}]]\n\
         maximum_strain_rate = {rate}\n",
        material(law, softer),
        p = -pressure,
    )
}

fn error_of_cell(run: &Simulation, pressure: f64, sheared: bool) -> f64 {
    let mut target = Mat3::identity() * -pressure;
    if sheared {
        (target[(0, 1)], target[(1, 0)]) = (-0.2 * pressure, -0.2 * pressure);
    }
    let Some(cell) = &run.state.cell else { return f64::NAN };
    let stress = run.last_report().virial / cell.volume();
    ((stress + stress.transpose()) * 0.5 - target).abs().max() / pressure
}

/// A cubic lattice in a box whose six faces press, each with a gap of 30 um. (Beds that collapse are slower than any gain: see the limits.)
fn walls(law: &str, softer: f64, count: usize, speed: f64, pressure: f64) -> String {
    let mut spheres = String::new();
    for k in 0..count * count * count {
        let place = |n: usize| 2e-3 * (n % count) as f64;
        let _ = write!(spheres, "[{}, {}, {}, 1e-3],", place(k), place(k / count), place(k / count / count));
    }
    let end = 2e-3 * (count - 1) as f64 + 1.03e-3;
    let material = material("hertz_mindlin", softer)
        .replace("friction_coefficient = 0.3", "friction_coefficient = 0.3, restitution = 0.8");
    let material = if law == "frictional" {
        format!(
            "[[material]]\nname = \"m\"\ndensity = 2500\nfrictional = {{ normal_stiffness = {}, shear_stiffness = {}, \
             friction_coefficient = 0.2, damping_ratio = 0.1 }}\n[contacts]\nlaw = \"frictional\"\n",
            1e6 / softer,
            3e5 / softer
        )
    } else {
        material
    };
    format!(
        "{}[packing]\nkind = \"spheres\"\nspheres = [{spheres}]\n{material}[[wall]]\nname = \"box\"\nmaterial = \"m\"\n\
         shape = {{ kind = \"box\", minimum = [-1.03e-3, -1.03e-3, -1.03e-3], maximum = [{end}, {end}, {end}] }}\n\
         servo = {{ pressure = {pressure}, maximum_speed = {speed} }}\n",
        HEAD.replace("steps = 20000", "steps = 200000")
    )
}

fn error_of_walls(run: &Simulation) -> f64 {
    run.schedule.servos.iter().map(|servo| servo.standing(&run.state).error().abs()).fold(0.0, f64::max)
}

/// Whether to run the large map.
fn large() -> bool {
    std::env::var_os("CONCORDEM_SERVOS").is_some()
}

/// A servo of a cell reaches its target at every rate that can, and otherwise the scenario says so before it runs.
#[test]
fn cells_reach_their_stress_or_say_so() {
    let wide = large();
    let rates: &[f64] = if wide { &[1e-3, 0.1, 1.0, 10.0, 1e3] } else { &[1e-3, 1.0, 1e3] };
    let softer: &[f64] = if wide { &[1.0, 30.0, 1e3] } else { &[1.0, 1e3] };
    let pressures: &[f64] = if wide { &[1e2, 1e4, 1e5, 1e6] } else { &[1e2, 1e5] };
    let counts: &[usize] = if wide { &[32, 108, 500] } else { &[32] };
    let laws: &[(&str, bool)] = if wide {
        &[("cpm", true), ("cpm", false), ("linear_bond", true), ("hertz_mindlin", false), ("hertz_mindlin", true)]
    } else {
        &[("cpm", true), ("hertz_mindlin", false), ("hertz_mindlin", true)]
    };
    let mut map = Map::new("cells");
    for &(law, random) in laws {
        for &count in counts {
            for &soft in softer {
                for &pressure in pressures {
                    for &rate in rates {
                        let sheared = law != "hertz_mindlin";
                        let text = cell(law, soft, random, count, rate, pressure, sheared);
                        map.add(format!("{law} {random} {count} {soft} {pressure:e} {rate:e}"), || {
                            run(&text, |run| error_of_cell(run, pressure, sheared))
                        });
                    }
                }
            }
        }
    }
    map.conclude();
    assert!(map.count(End::Reached) > 2 * map.count(End::Announced));
}

/// The six walls of a box reach their pressure, or the run says that they swing.
#[test]
fn walls_reach_their_pressure() {
    let wide = large();
    // Stiff Hertzian contacts at 10 m/s have so short a step and so high a bound that light walls do not arrive in 200,000 steps.
    let speeds: &[f64] = if wide { &[0.1, 1.0] } else { &[0.1] };
    let pressures: &[f64] = if wide { &[1e3, 1e5, 1e7] } else { &[1e3, 1e5] };
    let counts: &[usize] = if wide { &[3, 6] } else { &[3] };
    let softer: &[f64] = if wide { &[1.0, 30.0] } else { &[1.0] };
    let mut map = Map::new("walls");
    for law in ["frictional", "hertz_mindlin"] {
        for &count in counts {
            for &soft in softer {
                for &pressure in pressures {
                    for &speed in speeds {
                        map.add(format!("{law} {count} {soft} {pressure:e} {speed:e}"), || {
                            run(&walls(law, soft, count, speed, pressure), error_of_walls)
                        });
                    }
                }
            }
        }
    }
    map.conclude();
    assert_eq!(map.count(End::Announced), 0);
}
