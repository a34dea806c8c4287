//! `concordem check`: size, time step, and estimated run time of a scenario.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::drive::build;
use super::meter::Meter;
use super::readable::{bytes, count, seconds};
use super::settings::Settings;
use super::{Console, Facts, Failure, Work};
use concordem_scenario::assembly::{Assembly, FiberPhase, Summary, most_steps};
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::Scenario;
use concordem_solver::heat::HeatModel;
use concordem_solver::integrate::Damping;

/// Arguments of `concordem check`.
#[derive(Debug, clap::Args)]
pub(super) struct CheckArguments {
    /// Scenario file
    scenario: PathBuf,
    #[command(flatten)]
    settings: Settings,
    /// Check the text only, without building the particles
    #[arg(long)]
    no_build: bool,
    #[command(flatten)]
    work: Work,
}

/// Duration for which steps are timed.
const TIMING: Duration = Duration::from_millis(1500);

pub(super) fn check(arguments: &CheckArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let scenario = arguments.settings.read(&arguments.scenario)?;
    let head = format!("{}: valid scenario\n", arguments.scenario.display());
    if !arguments.work.quiet {
        console.warn(&scenario, &scenario.warnings());
    }
    if arguments.no_build {
        return console.print(&head);
    }
    let cache = console.cache();
    let display = console.display(&arguments.work);
    let facts = arguments.work.install(|| {
        let meter = Meter::new(display);
        let assembly = build(&scenario, cache.as_ref(), &meter)?;
        meter.finish();
        if !arguments.work.quiet {
            console.warn(&scenario, &assembly.summary.warnings);
        }
        Ok(inspect(&scenario, assembly)?.facts)
    })?;
    console.print(&format!("{head}{facts}"))
}

/// What `concordem check` finds.
pub struct Checked {
    /// Facts about the assembled system.
    pub summary: Summary,
    /// Time step, s.
    pub time_step: f64,
    /// Measured time of a step, s.
    pub time_per_step: f64,
    /// About the largest number of steps, and the key of `[stop]` that it follows from, if one limits it.
    pub steps: Option<(f64, &'static str)>,
    /// All facts as text.
    facts: Facts,
}

impl Checked {
    /// Names and texts of all facts, as the command prints them.
    pub fn facts(&self) -> &[(String, String)] {
        &self.facts.0
    }
}

/// Facts about a built scenario, some steps of which are timed.
///
/// # Errors
/// A step fails.
pub fn inspect(scenario: &Scenario, assembly: Assembly) -> Result<Checked, Failure> {
    let Assembly { state, model, schedule, summary } = assembly;
    let Summary { bounds, .. } = &summary;
    let dt = state.clock.dt;
    let mut facts = Facts::default();
    if !scenario.title.is_empty() {
        facts.add("title", scenario.title.clone());
    }
    facts.add("particles", count(summary.particles));
    if scenario.bonds.is_some() {
        let per = format!("{}, {:.2} per particle", count(summary.bonds), summary.coordination);
        facts.add("bonds", per);
        if let Some((coordination, ratio)) = summary.bulk {
            facts.add("in the bulk", format!("{coordination:.4} bonds per particle, interaction ratio {ratio:.6}"));
        }
    }
    add_phases(&mut facts, &summary);
    add_fibers(&mut facts, &summary);
    if let Some(fraction) = summary.packing_fraction {
        facts.add("solid fraction", format!("{fraction:.4}"));
    }
    if let Some((area, length)) = summary.specimen {
        facts.add("specimen", format!("cross-section {area:.5e} m², length {length:.5e} m"));
    }
    facts.add("peak memory", format!("about {}", bytes(summary.memory)));
    facts.add("time step", time_step(dt, &summary, &model.damping));
    facts.add(
        "stability bounds",
        format!("spectral {:.5e} s, per particle {:.5e} s", bounds.spectral, bounds.per_particle),
    );
    if let Some(collision) = &summary.collision {
        let [a, b] = collision.materials.map(|m| scenario.materials[m as usize].name.as_str());
        let what = collision.wall.map_or_else(
            || format!("\"{a}\" with \"{b}\""),
            |wall| format!("\"{a}\" with the wall \"{}\"", state.walls[wall].name),
        );
        facts.add(
            "stiffest contact",
            format!("{:.5e} s is the stability bound of {what}", collision.limit(&model.damping)),
        );
    }
    if let (Some(bound), Some(heat)) = (summary.heat_step, &model.heat) {
        facts.add("heat conduction", conduction(bound, heat));
    }
    if let Some(convergence) = summary.convergence {
        let settles = if convergence.bound < 1.0 { "converges" } else { "may not converge" };
        facts.add(
            "deformable particles",
            format!(
                "spectral radius {:.5} (must be below 1 without relaxation); sufficient bound {:.5}: {settles}",
                convergence.spectral_radius, convergence.bound
            ),
        );
    }
    if let Some(p_wave) = summary.p_wave {
        facts.add("P-wave time step", format!("{p_wave:.5e} s (customary estimate, not a stability bound)"));
    }
    if summary.unstable {
        facts.add("warning", "the time step is unstable, which allow_unstable permits");
    }
    let steps = most_steps(scenario, &schedule, dt);
    let mut simulation = Simulation::new(state, model, schedule)?;
    // The first step warms up caches and is not timed.
    simulation.advance()?;
    let start = Instant::now();
    let mut timed = 0_u32;
    while timed < 1000 && start.elapsed() < TIMING {
        timed += 1;
        if simulation.advance()?.stopped.is_some() {
            break;
        }
    }
    let per_step = start.elapsed().as_secs_f64() / f64::from(timed.max(1));
    facts.add("time per step", format!("{} on {} threads", seconds(per_step), rayon::current_num_threads()));
    match steps {
        Some((steps, reason)) => {
            facts.add("steps", format!("at most about {steps:.0}, from stop.{reason}"));
            facts.add("estimated time", format!("at most {}", seconds(steps * per_step)));
        }
        None => facts.add("estimated time", "unknown; it depends on the stop conditions"),
    }
    Ok(Checked { summary, time_step: dt, time_per_step: per_step, steps, facts })
}

/// The time step, and its part of the stability bound if there is one. Damping lowers the bound; `safety` is a part of the one without it.
fn time_step(dt: f64, summary: &Summary, damping: &Damping) -> String {
    let heat = summary.heat_step.unwrap_or(f64::INFINITY);
    let bound = summary.stable_step.min(heat);
    if !bound.is_finite() {
        return format!("{dt:.5e} s");
    }
    let part = format!("{dt:.5e} s, {:.3} of the stability bound", dt / bound);
    let contact = summary.collision.as_ref().map_or(f64::INFINITY, |collision| collision.limit(damping));
    let (damped, undamped) = (summary.bounds.limit(damping), summary.bounds.limit(&Damping::None));
    if bound == heat {
        format!("{part} of heat conduction, {bound:.5e} s")
    } else if bound == contact {
        format!("{part} of the stiffest contact, {bound:.5e} s")
    } else if damped < undamped {
        format!("{part} with damping, {bound:.5e} s ({:.3} of that without damping, {undamped:.5e} s)", dt / undamped)
    } else {
        format!("{part}, {bound:.5e} s")
    }
}

/// Heat conduction with its bound, s (time of the run).
fn conduction(bound: f64, heat: &HeatModel) -> String {
    let links = heat.network.links.len();
    if bound.is_finite() {
        let thermal = bound * heat.time_factor;
        return format!("{links} links, explicit steps are stable below {bound:.5e} s (thermal time {thermal:.5e} s)");
    }
    format!("{links} links, implicit steps, stable with any step")
}

/// Fibers and their bonds.
fn add_fibers(facts: &mut Facts, summary: &Summary) {
    let Some(fibers) = &summary.fibers else { return };
    for phase in &fibers.groups {
        let FiberPhase { name, count: number, volume_fraction, particles } = phase;
        let text = format!("{}, {volume_fraction:.4} of the volume; {} particles", count(*number), count(*particles));
        facts.add(&format!("fibers \"{name}\""), text);
    }
    let (removed, share) = fibers.removed;
    facts.add("room for fibers", format!("{} particles removed, {share:.4} of the solid", count(removed)));
    let [along, held] = fibers.bonds;
    facts.add("bonds of fibers", format!("{} along fibers, {} to other particles", count(along), count(held)));
}

/// Aggregates, pores, and bonds by phase and on joints.
fn add_phases(facts: &mut Facts, summary: &Summary) {
    if !summary.joint_bonds.is_empty() {
        let numbers: Vec<_> = summary.joint_bonds.iter().map(|number| count(*number)).collect();
        facts.add("bonds on joints", numbers.join(", "));
    }
    let Some(phases) = &summary.phases else { return };
    for phase in &phases.groups {
        let text = format!(
            "{}, {:.4} of the volume; {} particles inside, {:.4} of the solid",
            count(phase.count),
            phase.volume_fraction,
            count(phase.particles),
            phase.share
        );
        facts.add(&format!("group \"{}\"", phase.name), text);
    }
    let (particles, share) = phases.matrix;
    facts.add("mortar", format!("{} particles, {share:.4} of the solid", count(particles)));
    if let Some([mortar, aggregates, interface, between]) = summary.bonds_by_phase.filter(|_| summary.bonds > 0) {
        let text = format!(
            "{} in the mortar, {} in aggregates, {} between both, {} between aggregates",
            count(mortar),
            count(aggregates),
            count(interface),
            count(between)
        );
        facts.add("bonds by phase", text);
    }
}
