//! Warnings about an assembled scenario that is valid but probably not what its author expects: spheres of meters, regions without
//! particles, a loading that is too fast or never ends.

use std::collections::BTreeMap;
use std::path::Path;

use super::AssemblyError;
use super::place::lattice_of;
use super::selection::{bounds_along, extents};
use crate::checks::length;
use crate::sampling::{SampledRegion, ScheduledOperator};
use crate::schedule::Schedule;
use crate::schema::{Loading, Packing, Problem, Scenario, Shape};
use concordem_contact::math::Vec3;
use concordem_files::paths::is_hdf5;
use concordem_operator::{Period, Region};
use concordem_packing::Crop;
use concordem_solver::fracture::fragments::bonded_pieces;
use concordem_solver::state::State;

/// Mean radii of a file, m, outside of which its unit is doubtful.
const RADII: [f64; 2] = [1e-7, 0.2];
/// Strain of the specimen while a wave crosses it, above which its ends are loaded long before its middle. Concrete and rock break at
/// 1e-4 to 1e-2.
const FAST: f64 = 1e-2;
/// Strain below which no material breaks.
const BREAKING: f64 = 1e-5;
/// A run ends early below this part of the strain at which it should end.
const EARLY: f64 = 1e-2;
/// Duration of a run, s, that is probably a mistake: a week.
const LONG: f64 = 7.0 * 86_400.0;
/// More steps than any run of explicit dynamics needs: at the rate of a laboratory, also for a few particles.
const MOST_STEPS: f64 = 1e9;
/// Times of a step per bond and per particle on one core, s: CPM takes some 50 ns per bond, the integration 20 ns per particle.
const PER_BOND: f64 = 50e-9;
const PER_PARTICLE: f64 = 20e-9;

/// Largest possible number of steps, and the stop condition that sets this limit; `None` if it depends on the run.
pub fn most_steps(scenario: &Scenario, schedule: &Schedule, dt: f64) -> Option<(f64, &'static str)> {
    let stop = &scenario.stop;
    let rate = strain_rate(scenario, schedule);
    let limits = [
        stop.steps.map(|steps| (steps as f64, "steps")),
        stop.time.map(|time| ((time.si() / dt).ceil(), "time")),
        stop.strain.zip(rate).map(|(strain, rate)| ((strain.si() / (rate * dt)).ceil(), "strain")),
    ];
    limits.into_iter().flatten().reduce(|a, b| if b.0 < a.0 { b } else { a })
}

/// Magnitude of the strain rate of the loading, 1/s.
fn strain_rate(scenario: &Scenario, schedule: &Schedule) -> Option<f64> {
    // The specimen decides how fast the ends follow an opening.
    if scenario.loading.opening().is_some() {
        return None;
    }
    match &scenario.loading {
        Loading::Uniaxial { strain_rate, .. } => Some(strain_rate.si().abs()),
        Loading::CellStrain { velocity_gradient } => {
            velocity_gradient.iter().flatten().map(|rate| rate.si().abs()).reduce(f64::max)
        }
        Loading::Platens { closing_velocity, .. } => {
            schedule.loading.dimensions().map(|(_, length)| closing_velocity.si() / length)
        }
        Loading::Flexure { closing_velocity, .. } => match &schedule.loading {
            crate::schedule::Loading::Flexure(flexure) => Some(closing_velocity.si() * flexure.strain_of_deflection),
            _ => None,
        },
        Loading::Bending { rate, .. } | Loading::Torsion { rate, .. } => {
            schedule.loading.strain_of_angle().map(|per_angle| rate.si().abs() * per_angle)
        }
        Loading::CellStress { strain_rate, .. } => {
            strain_rate.iter().filter_map(|rate| rate.si()).map(f64::abs).reduce(f64::max)
        }
        Loading::None => None,
    }
}

/// What is doubtful about the unit of a packing file with these radii, m.
fn doubtful_unit(scenario: &Scenario, radii: &[f64]) -> Option<String> {
    let Packing::File { path, unit: None, .. } = &scenario.packing else { return None };
    let mean = radii.iter().sum::<f64>() / radii.len() as f64;
    let is_usual = (RADII[0]..=RADII[1]).contains(&mean);
    (!is_usual && !is_hdf5(Path::new(path)))
        .then(|| format!("the mean radius is {}; numbers in a file without a unit are meters", length(mean)))
}

/// What gives the file a unit.
const UNIT: &str = "write unit = \"1 mm\" in [packing]";

/// Warns about a packing file whose radii are probably not in meters.
pub(super) fn sizes(scenario: &Scenario, radii: &[f64]) -> Option<Problem> {
    let message = doubtful_unit(scenario, radii)?;
    Some(scenario.warning("packing.path", message, format!("{UNIT}, or unit = \"1 m\" if meters are meant")))
}

/// The error, with a doubtful unit of the packing file: what does not fit spheres of meters often fits those of millimeters.
pub(super) fn with_unit(scenario: &Scenario, radii: &[f64], error: AssemblyError) -> AssemblyError {
    match (error, doubtful_unit(scenario, radii)) {
        (AssemblyError::Unfit { key, message }, Some(doubt)) => {
            let Packing::File { path, .. } = &scenario.packing else { return AssemblyError::Unfit { key, message } };
            AssemblyError::Unfit { key, message: format!("{message}. Or in {path} {doubt}: {UNIT}") }
        }
        (error, _) => error,
    }
}

/// Warns about operators whose region contains no center of a particle at the start.
pub(super) fn empty_regions(scenario: &Scenario, operators: &[ScheduledOperator], state: &State) -> Vec<Problem> {
    let positions = &state.particles.position;
    let period = state.cell.map(|cell| Period::of(cell.matrix));
    let empty = |operator: &ScheduledOperator| match &operator.region {
        SampledRegion::Cell | SampledRegion::Moving { region: Region::All { .. }, .. } => false,
        SampledRegion::Moving { region, .. } => {
            let images = region.images(period.as_ref());
            (0..positions.len()).all(|p| images.inside(p, &positions[p]).next().is_none())
        }
    };
    let doubtful = operators.iter().enumerate().filter(|(_, operator)| empty(operator));
    let (low, high) = bounds(positions.iter());
    doubtful
        .map(|(k, _)| {
            let help = format!("check its position and units; the centers lie {}", between(&low, &high));
            let message = "no particle lies in this region at the start, so its values may be not-a-number";
            scenario.warning(&format!("sample[{k}].region"), message, help)
        })
        .collect()
}

/// Corners of the box around points.
pub(super) fn bounds<'a>(positions: impl Iterator<Item = &'a Vec3>) -> (Vec3, Vec3) {
    let start = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    positions.fold(start, |(low, high), x| (low.inf(x), high.sup(x)))
}

/// A box for messages.
pub(super) fn between(low: &Vec3, high: &Vec3) -> String {
    format!(
        "between [{:.3e}, {:.3e}, {:.3e}] and [{:.3e}, {:.3e}, {:.3e}] m",
        low.x, low.y, low.z, high.x, high.y, high.z
    )
}

/// Warns about a run that ends only after weeks, and about a loading that is faster than waves can follow.
///
/// `p_wave`: time in which a wave crosses the radius of the smallest particle, s.
pub(super) fn rates(scenario: &Scenario, schedule: &Schedule, state: &State, p_wave: Option<f64>) -> Vec<Problem> {
    let dt = state.clock.dt;
    let mut warnings: Vec<Problem> = too_short(scenario, schedule, state).into_iter().collect();
    let bonds: usize = state.bonds.iter().map(|block| block.contacts().len()).sum();
    let step = bonds as f64 * PER_BOND + state.particles.len() as f64 * PER_PARTICLE;
    if let Some((steps, key)) = most_steps(scenario, schedule, dt)
        && (steps * step > LONG || steps > MOST_STEPS)
    {
        let hours = steps * step / 3600.0;
        let plain = |value: f64, unit: &str| {
            if value < 1e3 { format!("{value:.0} {unit}") } else { format!("{value:.0e} {unit}") }
        };
        let time = if hours > 48.0 { plain(hours / 24.0, "days") } else { plain(hours, "hours") };
        let message = format!("the run may take {steps:.1e} steps of {dt:.2e} s, about {time} on one core");
        let (place, help) = match (key, key_of_rate(&scenario.loading)) {
            ("strain", Some(rate)) => {
                (rate, "load faster: discrete element runs use rates of 0.1 to 100 1/s, or check the unit")
            }
            _ => {
                (if key == "time" { "stop.time" } else { "stop.steps" }, "end the run earlier, or use fewer particles")
            }
        };
        warnings.push(scenario.warning(place, message, help));
    }
    let Some((rate, key)) = strain_rate(scenario, schedule).zip(key_of_rate(&scenario.loading)) else {
        return warnings;
    };
    warnings.extend(ends_early(scenario, rate, key, dt));
    let Some(((_, length), p_wave)) = schedule.loading.dimensions().zip(p_wave) else { return warnings };
    let smallest = state.particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
    let crossing = length * p_wave / smallest;
    if rate * crossing > FAST {
        let message = format!(
            "a wave needs {crossing:.2e} s to cross the specimen, which is strained by {:.1e} meanwhile: its ends break before its middle \
             is loaded",
            rate * crossing
        );
        let slower = 1e-2 * FAST / (rate * crossing);
        let help = match key {
            "loading.strain_rate" => format!("use a strain rate below {:.1e} 1/s", slower * rate),
            _ => format!("load at most {slower:.1e} times as fast"),
        };
        warnings.push(scenario.warning(key, message, help));
    }
    warnings
}

/// Warns about a run that ends long before the strain or the failure at which it should end.
fn ends_early(scenario: &Scenario, rate: f64, key: &str, dt: f64) -> Option<Problem> {
    let stop = &scenario.stop;
    if !scenario.stages.is_empty() {
        return None;
    }
    let by_time = stop.time.map(|time| (time.si(), "stop.time"));
    let by_steps = stop.steps.map(|steps| (steps as f64 * dt, "stop.steps"));
    let (time, end) = [by_time, by_steps].into_iter().flatten().reduce(|a, b| if b.0 < a.0 { b } else { a })?;
    let (wanted, what) = match (stop.strain, stop.drop_to) {
        (Some(strain), _) => (strain.si(), format!("`stop.strain` ({})", strain.si())),
        (None, Some(_)) => (BREAKING, "failure (`stop.drop_to`)".to_owned()),
        (None, None) => return None,
    };
    if rate * time >= EARLY * wanted {
        return None;
    }
    let message = format!("`{end}` ends the run at a strain of {:.1e}, long before {what}", rate * time);
    let help = format!("raise `{key}` or `{end}`, or remove the other end");
    Some(scenario.warning(key, message, help))
}

/// Warns about a run that may end before the servo of its cell has reached the stress.
fn too_short(scenario: &Scenario, schedule: &Schedule, state: &State) -> Option<Problem> {
    let dt = state.clock.dt;
    if !scenario.stages.is_empty() {
        return None;
    }
    let (steps, key) = most_steps(scenario, schedule, dt)?;
    let end = format!("`stop.{key}` ends the run after {:.1e} s", steps * dt);
    if let Some(needed) = schedule.loading.approach().filter(|needed| steps * dt < *needed) {
        let message = format!("{end}, but at this rate the cell may need {needed:.1e} s to reach the stress");
        let help = format!("raise `maximum_strain_rate` or `stop.{key}`");
        return Some(scenario.warning("loading.maximum_strain_rate", message, help));
    }
    let needed = schedule.loading.settling().filter(|needed| steps * dt < *needed)?;
    let message = format!(
        "{end}, but under this stress contacts are so soft that the cell may need {needed:.1e} s to come to rest"
    );
    Some(scenario.warning("loading.stress", message, format!("raise `stop.{key}` or the stress")))
}

/// Part of the particles of a specimen that is a piece, not debris.
const PIECE: f64 = 0.05;
/// Part of its width by which single particles may stand out of it.
const BESIDE: f64 = 0.01;

/// Warns about a specimen that is no body when its loading begins: a cut goes through, or particles lie beside it, which its length and
/// cross-section then count.
pub(super) fn pieces(scenario: &Scenario, state: &State) -> Option<Problem> {
    let loads_ends = matches!(
        scenario.loading,
        Loading::Uniaxial { .. } | Loading::Flexure { .. } | Loading::Bending { .. } | Loading::Torsion { .. }
    );
    if !loads_ends || scenario.bonds.is_none() || state.bonds.iter().all(|block| block.contacts().is_empty()) {
        return None;
    }
    let fragments = bonded_pieces(state);
    let mut sizes: BTreeMap<u32, usize> = BTreeMap::new();
    for name in &fragments {
        *sizes.entry(*name).or_default() += 1;
    }
    let mut largest: Vec<usize> = sizes.values().copied().collect();
    largest.sort_unstable_by(|a, b| b.cmp(a));
    let count = state.particles.len();
    largest.retain(|size| *size > 1 && *size as f64 >= PIECE * count as f64);
    if let [first, second, ..] = largest[..] {
        let more = if largest.len() > 2 { format!(", and {} more", largest.len() - 2) } else { String::new() };
        let key = if scenario.cuts.is_empty() { "bonds.interaction_ratio" } else { "cut[0]" };
        let message =
            format!("bonds do not join the specimen: it consists of pieces of {first} and {second} particles{more}");
        return Some(scenario.warning(
            key,
            message,
            "check cuts and notches, the interaction ratio, and the unit of the packing",
        ));
    }
    let main = sizes.iter().max_by_key(|(_, size)| **size).map(|(name, _)| *name)?;
    let of_main = |p: &usize| fragments[*p] == main;
    let spheres = |p: usize| (state.particles.position[p], state.particles.radius[p]);
    let (low, high) = box_around((0..count).map(spheres));
    let (low_main, high_main) = box_around((0..count).filter(of_main).map(spheres));
    let axis = (0..3).find(|&axis| high[axis] - low[axis] > (1.0 + BESIDE) * (high_main[axis] - low_main[axis]))?;
    let beside = count - sizes[&main];
    let message = format!(
        "{beside} particles without a bond to the specimen lie beside it: along {} it is {} long with them, {} without; length and \
         cross-section count them",
        ["x", "y", "z"][axis],
        length(high[axis] - low[axis]),
        length(high_main[axis] - low_main[axis])
    );
    Some(scenario.warning("packing", message, "remove them from the packing, or check their positions and units"))
}

/// Corners of the box around spheres, given as centers and radii, m.
fn box_around(spheres: impl Iterator<Item = (Vec3, f64)>) -> (Vec3, Vec3) {
    let start = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    spheres.fold(start, |(low, high), (x, r)| (low.inf(&x.add_scalar(-r)), high.sup(&x.add_scalar(r))))
}

/// Part of the width of a box that a lattice may leave free: stresses that refer to the box are too low by as much.
const FREE: f64 = 0.05;

/// Warns about a lattice whose whole spheres leave a part of their box free.
pub(super) fn unfilled(scenario: &Scenario, state: &State) -> Option<Problem> {
    let Packing::Lattice { lattice, radius, shape: Some(Shape::Box { size, keep, .. }), .. } = &scenario.packing else {
        return None;
    };
    if keep.is_some_and(|keep| keep != Crop::WholeSpheres) {
        return None;
    }
    let axes = if scenario.dimension == 2 { 2 } else { 3 };
    let free = |axis: usize| {
        let (low, high) = bounds_along(extents(&state.particles, axis));
        1.0 - (high - low) / size[axis].si()
    };
    let axis = (0..axes).max_by(|&a, &b| free(a).total_cmp(&free(b)))?;
    if free(axis) <= FREE {
        return None;
    }
    let (width, name) = (size[axis].si(), ["x", "y", "z"][axis]);
    let message = format!(
        "the layers of the lattice leave {} of {} free along {name}; stresses refer to the whole box",
        length(free(axis) * width),
        length(width)
    );
    let help = match lattice_of(*lattice).sizes_around(radius.si(), axis, width) {
        Some([below, above]) => {
            format!("they fill a size of {below:.9e} or {above:.9e} m along {name}; or write keep = \"centers\"")
        }
        None => "choose a size that the layers fill, or write keep = \"centers\"".to_owned(),
    };
    Some(scenario.warning(&format!("packing.shape.size[{axis}]"), message, help))
}

/// Key of the rate of a loading.
fn key_of_rate(loading: &Loading) -> Option<&'static str> {
    match loading {
        Loading::Uniaxial { .. } | Loading::CellStress { .. } => Some("loading.strain_rate"),
        Loading::CellStrain { .. } => Some("loading.velocity_gradient"),
        Loading::Platens { .. } | Loading::Flexure { .. } => Some("loading.closing_velocity"),
        Loading::Bending { .. } | Loading::Torsion { .. } => Some("loading.rate"),
        Loading::None => None,
    }
}
