//! `concordem fragments`: sieve curve, debris, largest fragment, velocities.

use std::fmt::Write as _;
use std::path::PathBuf;

use super::readable::{count, seconds};
use super::so_far::open_result;
use super::{Console, Facts, Failure};
use crate::output::{ParticlesAt, ResultFile};
use crate::signals::fragments::{Fragments, Size, usual_size};
use concordem_operator::fragments::Fragment;
use concordem_operator::fragments::sieve::{Estimate, Fit};
use concordem_operator::strain::Dimension;
use concordem_scenario::schema::Scenario;
use concordem_scenario::schema::quantity::Time;

/// Arguments of `concordem fragments`.
#[derive(Debug, clap::Args)]
pub(super) struct FragmentsArguments {
    /// Result file
    file: PathBuf,
    /// Time of the snapshot, "2 ms"; the nearest one is taken, by default the final state
    #[arg(long, value_name = "TIME", value_parser = time)]
    time: Option<Time>,
    /// Size of a fragment; by default "sieve" in space and "sphere" in the plane or in a periodic cell
    #[arg(long, value_enum)]
    size: Option<Size>,
    /// Only particles of this set, such as a specimen without the grains that strike it
    #[arg(long, value_name = "NAME")]
    set: Option<String>,
    /// Print comma-separated values: of each fragment, or of the sieve curve
    #[arg(long, value_enum, value_name = "TABLE", num_args = 0..=1, require_equals = true, default_missing_value = "fragments")]
    csv: Option<Table>,
}

/// A table of comma-separated values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Table {
    /// One line per fragment, the heaviest first
    Fragments,
    /// Share of the mass that passes each size
    Curve,
}

fn time(text: &str) -> Result<Time, String> {
    let time = Time::parse(text).map_err(|error| error.to_string())?;
    if time.si().is_finite() { Ok(time) } else { Err(format!("{text} must be finite")) }
}

pub(super) fn fragments(arguments: &FragmentsArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let result = open_result(&arguments.file, console)?;
    let name = arguments.file.display().to_string();
    let scenario = Scenario::parse(&name, &result.scenario()?)?;
    if scenario.bonds.is_none() {
        return Err(Failure::Usage(format!("{name}: the run has no [bonds], so nothing breaks into fragments")));
    }
    let snapshot = arguments.time.map(|time| nearest(&result, time.si())).transpose()?;
    let mut particles = ParticlesAt::read(&result, snapshot)?;
    if let Some(set) = &arguments.set {
        particles = particles.of_set(bit(&scenario, set)?);
    }
    if particles.position.is_empty() {
        return Err(Failure::Usage(format!("{name}: there are no particles to measure")));
    }
    let dimension = if scenario.dimension == 2 { Dimension::Two } else { Dimension::Three };
    let usual = usual_size(dimension, particles.is_periodic);
    let size = arguments.size.unwrap_or(usual);
    if size == Size::Sieve && usual != Size::Sieve {
        let why = if dimension == Dimension::Two { "in the plane" } else { "through the faces of a periodic cell" };
        let message = format!("--size sieve: fragments have no intermediate axis {why}; choose --size sphere");
        return Err(Failure::Usage(message));
    }
    let found = Fragments::of(&particles, dimension, size)
        .map_err(|error| Failure::Usage(format!("{name}: particles: {error}")))?;
    match arguments.csv {
        Some(Table::Fragments) => console.print(&table(&found)),
        Some(Table::Curve) => console.print(&curve(&found)),
        None => {
            let head = format!("{name}, at {}", seconds(particles.time));
            console.print(&format!("{head}\n{}\n{}", facts(&found, size, usual, dimension), sieves(&found)))
        }
    }
}

/// Number of the snapshot nearest to a time, s.
fn nearest(result: &ResultFile, time: f64) -> Result<usize, Failure> {
    let times = result.snapshot_times()?;
    let (Some(&first), Some(&last)) = (times.first(), times.last()) else {
        return Err(Failure::Usage(format!("{} has no snapshots; leave out --time", result.path().display())));
    };
    // A time that was printed has lost some digits.
    let slack = 1e-3 * (last - first);
    if time < first - slack || time > last + slack {
        let message = format!("--time {time:e} s lies outside of the snapshots, {first:e} to {last:e} s");
        return Err(Failure::Usage(message));
    }
    let distance = |k: &usize| (times[*k] - time).abs();
    Ok((0..times.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or_default())
}

/// Bit of a set in the marks of particles.
fn bit(scenario: &Scenario, name: &str) -> Result<u64, Failure> {
    scenario.sets.iter().position(|set| set.name == name).map(|at| 1 << at).ok_or_else(|| {
        let names: Vec<&str> = scenario.sets.iter().map(|set| set.name.as_str()).collect();
        let known = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        Failure::Usage(format!("--set {name}: there is no such [[set]]; there are: {known}"))
    })
}

/// Shares of the mass whose sizes are printed.
const SHARES: [f64; 3] = [0.1, 0.5, 0.8];

fn facts(found: &Fragments, size: Size, usual: Size, dimension: Dimension) -> Facts {
    let mut facts = Facts::default();
    let total = found.mass();
    let (debris, dust) = found.debris();
    let percent = |mass: f64| format!("{:.2} % of the mass", 100.0 * mass / total);
    facts.add("fragments", count(found.fragments.len()));
    facts.add("  single particles", format!("{}, {}", count(debris), percent(dust)));
    if let Some(largest) = found.fragments.first() {
        facts.add("largest fragment", format!("{:.4e} kg, {}", largest.mass, percent(largest.mass)));
        facts.add("  particles", count(largest.particles));
        // Axes reach through no periodic face.
        let axes = if dimension == Dimension::Two { &largest.axes[..2] } else { &largest.axes[..] };
        if dimension == Dimension::Two || usual == Size::Sieve {
            let axes: Vec<String> = axes.iter().map(|axis| millimeters(*axis)).collect();
            facts.add("  axes", format!("{} mm", axes.join(", ")));
        }
    }
    let rule = if size == Size::Sieve { "intermediate axis" } else { "equal sphere" };
    let sizes = SHARES.map(|share| found.curve.size_at(share).map_or_else(String::new, millimeters));
    facts.add("size, 10, 50, 80 % of mass", format!("{} mm, {rule}", sizes.join(", ")));
    for (law, symbols, fit) in
        [("Rosin–Rammler", ["x′", "n"], found.rosin_rammler), ("Gaudin–Schuhmann", ["k", "m"], found.gaudin_schuhmann)]
    {
        facts.add(law, fit.map_or_else(|| "too few fragments of similar mass".to_owned(), |fit| law_of(fit, symbols)));
    }
    if let [_, others @ ..] = &found.fragments[..]
        && !others.is_empty()
    {
        let (middle, most) = speeds(others);
        facts.add("speed of the others", format!("{middle:.3e} m/s in the mean of their mass, at most {most:.3e} m/s"));
    }
    facts
}

fn law_of(Fit { size, exponent, deviation, .. }: Fit, [large, power]: [&str; 2]) -> String {
    let Estimate { value, error } = size;
    format!(
        "{large} = {} ± {} mm, {power} = {:.3} ± {:.3}, at most {:.1} % off the curve",
        millimeters(value),
        millimeters(error),
        exponent.value,
        exponent.error,
        100.0 * deviation
    )
}

/// Mean speed weighted by mass, and the largest speed, of the centers of mass, m/s.
fn speeds(fragments: &[Fragment]) -> (f64, f64) {
    let mass: f64 = fragments.iter().map(|fragment| fragment.mass).sum();
    let sum: f64 = fragments.iter().map(|fragment| fragment.mass * fragment.velocity.norm()).sum();
    (sum / mass, fragments.iter().map(|fragment| fragment.velocity.norm()).fold(0.0, f64::max))
}

/// A length in mm with four digits.
fn millimeters(length: f64) -> String {
    let value = 1e3 * length;
    if value == 0.0 || (1e-2..1e4).contains(&value) {
        let digits = if value > 0.0 { (3 - value.log10().floor() as i32).max(0) as usize } else { 0 };
        format!("{value:.digits$}")
    } else {
        format!("{value:.3e}")
    }
}

/// Openings of sieves between a micrometer and a millimeter, µm: every second one of the series R 20/3 (ISO 565).
const OPENINGS: [f64; 10] = [1.0, 2.0, 4.0, 8.0, 16.0, 31.5, 63.0, 125.0, 250.0, 500.0];

/// Openings (m) from the last one that nothing passes to the first one that everything passes.
fn openings(smallest: f64, largest: f64) -> Vec<f64> {
    let all = (-2..4).flat_map(|power| OPENINGS.map(|opening| 1e-6 * opening * 1e3_f64.powi(power)));
    let all: Vec<f64> = all.collect();
    let from = all.partition_point(|opening| *opening < smallest).saturating_sub(1);
    let to = (all.partition_point(|opening| *opening < largest) + 1).min(all.len());
    all.get(from..to).unwrap_or_default().to_vec()
}

fn sieves(found: &Fragments) -> String {
    let mut text = "  sieve [mm]  passing [% of mass]\n".to_owned();
    let (Some(&smallest), Some(&largest)) = (found.curve.size.first(), found.curve.size.last()) else { return text };
    for opening in openings(smallest, largest) {
        let _ = writeln!(text, "  {:>10}  {:7.2}", 1e3 * opening, 100.0 * found.curve.passing_at(opening));
    }
    text
}

/// Fragments, one per line.
fn table(found: &Fragments) -> String {
    let mut text =
        "fragment,particles,mass [kg],size [m],sphere [m],longest axis [m],intermediate axis [m],shortest axis [m],\
                    x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s]\n"
            .to_owned();
    for (fragment, size) in found.fragments.iter().zip(&found.size) {
        let Fragment { number, particles, mass, position: x, velocity: v, sphere, axes: [a, b, c] } = fragment;
        let _ = writeln!(
            text,
            "{number},{particles},{mass:e},{size:e},{sphere:e},{a:e},{b:e},{c:e},{:e},{:e},{:e},{:e},{:e},{:e}",
            x.x, x.y, x.z, v.x, v.y, v.z
        );
    }
    text
}

fn curve(found: &Fragments) -> String {
    let mut text = "size [m],passing\n".to_owned();
    for (size, passing) in found.curve.size.iter().zip(&found.curve.passing) {
        let _ = writeln!(text, "{size:e},{passing}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From the last sieve that nothing passes to the first one that everything passes.
    #[test]
    fn sieves_enclose_the_sizes() {
        let close = |found: Vec<f64>, wanted: &[f64]| {
            assert!(found.len() == wanted.len(), "{found:?}");
            assert!(found.iter().zip(wanted).all(|(one, other)| (one / other - 1.0).abs() < 1e-12), "{found:?}");
        };
        close(openings(1.5e-3, 9e-3), &[1e-3, 2e-3, 4e-3, 8e-3, 16e-3]);
        close(openings(20e-6, 20e-6), &[16e-6, 31.5e-6]);
        assert_eq!(openings(1e9, 1e9).len(), 1);
        assert_eq!([0.0, 1.23456e-3, 0.123, 1e-9].map(millimeters), ["0", "1.235", "123.0", "1.000e-6"]);
    }
}
