//! Differences between two runs that should be equal up to rounding.
//!
//! How far roundings grow depends on the scenario. A third run measures it: its particles start [`NOISE`] beside their places,
//! which is a hundred times the roundings of the coordinates and of a few hundred steps (coordinates of 1e-2 m are rounded by
//! 2e-18 m; √300 of them make 3e-17 m, and there are a handful per step). What two runs differ by may be [`MARGIN`] times what
//! this displacement changes, plus [`FLOOR`]. Where it changes more than [`CHAOS`], nothing can be said.

use std::collections::BTreeMap;

use concordem::math::{Mat3, Vec3};
use concordem::sampling::Record;

use crate::case::Turn;
use crate::heat::SPECIFIC_HEAT;
use crate::run::{Run, tensor};

/// Displacements that measure the growth of roundings, m.
pub const NOISE: f64 = 1e-14;

/// Largest number of directions of the displacements. Each may show which side of a threshold is open; what none of sixteen explains
/// is a fault.
pub const MOST_DIRECTIONS: usize = 16;

/// Largest ratio of a difference to what the noise makes: single displacements grow differently.
const MARGIN: f64 = 100.0;

/// Difference relative to the scale of a quantity that is always allowed: sums of some hundred terms.
const FLOOR: f64 = 1e-11;

/// Relative change by the noise above which a quantity counts as chaotic.
const CHAOS: f64 = 1e-3;

/// Difference of each quantity over its scale.
pub type Differences = BTreeMap<String, f64>;

/// What a comparison leaves out.
pub type Excluded<'a> = &'a dyn Fn(&str) -> bool;

/// Relative differences of `other` from `base`; `other` is turned by `turn`.
pub fn differences(base: &Run, other: &Run, turn: &Turn) -> Differences {
    let mut found = Differences::new();
    let mut of_particles = |name: &str, of: &dyn Fn(&Run, usize) -> Vec3, scale: Option<f64>| {
        let [a, b] = [base, other].map(|run| run.by_id().iter().map(|&p| of(run, p)).collect::<Vec<Vec3>>());
        let worst = a.iter().zip(&b).map(|(a, b)| (turn.vector(a) - b).norm()).fold(0.0, max);
        let scale = scale.unwrap_or_else(|| a.iter().map(Vec3::norm).fold(0.0, f64::max));
        found.insert(name.to_owned(), worst / scale.max(f64::MIN_POSITIVE));
    };
    // As velocities of surfaces at 1 mm.
    let fastest = base.fastest;
    let spin = base.state.particles.angular_velocity.iter().map(Vec3::norm).fold(fastest / 1e-3, f64::max);
    of_particles("angular velocity", &|run, p| run.state.particles.angular_velocity[p], Some(spin));
    // What images of a particle in a moving cell have in common: velocity and displacement beside those of the cell.
    of_particles(
        "velocity",
        &|run, p| {
            let (x, v) = (run.state.particles.position[p], run.state.particles.velocity[p]);
            run.state.cell.map_or(v, |cell| v - cell.velocity_gradient * x)
        },
        None,
    );
    // Radii are 1 mm.
    of_particles(
        "position",
        &|run, p| {
            let (now, cell) = (&run.state.particles, run.state.cell.as_ref());
            let then = run.initial.particles.position[p];
            now.position[p] + now.unwrapping(p, cell) - cell.map_or(then, |cell| cell.deformation_gradient * then)
        },
        Some(1e-3),
    );
    of_records(base, other, &mut found);
    of_rows(base, other, turn, &mut found);
    found
}

/// The larger one; not a number stays.
fn max(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Largest energy present or dissipated, J.
pub fn turnover(run: &Run) -> f64 {
    let one = |r: &Record| {
        [
            r.kinetic,
            r.stored_normal,
            r.stored_shear,
            r.stored_bending,
            r.stored_twist,
            r.stored_deformation,
            r.damage,
            r.friction,
            r.viscous,
            r.numerical_damping,
            r.deformation_lag,
            r.deformation_other,
        ]
        .iter()
        .map(|energy| energy.abs())
        .sum::<f64>()
    };
    run.records.iter().map(one).fold(0.0, f64::max)
}

fn of_records(base: &Run, other: &Run, found: &mut Differences) {
    if base.records.len() != other.records.len() {
        found.insert("records".into(), f64::INFINITY);
        return;
    }
    let energy = turnover(base);
    // The heat that warms all particles by 1 K, or what has entered.
    let entered = |r: &Record| r.heat_sources.abs() + r.heat_boundary.abs();
    let warmed = base.state.particles.mass.iter().sum::<f64>() * SPECIFIC_HEAT;
    let heat = base.records.iter().map(entered).fold(warmed, f64::max);
    for (k, column) in Record::COLUMNS.iter().enumerate() {
        let pairs = || base.records.iter().zip(&other.records).map(|(a, b)| (a.to_row()[k], b.to_row()[k]));
        let own = pairs().map(|(a, _)| a.abs()).fold(0.0, f64::max);
        let scale = match column.unit {
            "J" if column.name.starts_with("heat_") => heat,
            "J" => energy,
            // A ratio of forces, which is 0 without contacts.
            _ if column.name == "unbalanced" => own.max(1.0),
            _ => own,
        };
        let worst = pairs().map(|(a, b)| (a - b).abs()).fold(0.0, max);
        found.insert(format!("series {}", column.name), worst / scale.max(f64::MIN_POSITIVE));
    }
}

/// Quantities of one unit have one scale: a part of a sum can vanish.
fn of_rows(base: &Run, other: &Run, turn: &Turn, found: &mut Differences) {
    let fastest = base.fastest;
    for (k, sample) in base.operators.iter().enumerate() {
        let mut first = 0;
        let cells = sample.cells();
        // Of what a uniform motion gives: velocities, over 1 mm, and powers of the forces.
        let mut scales: BTreeMap<&str, f64> =
            BTreeMap::from([("m/s", fastest), ("rad/s", fastest / 1e-3), ("1/s", fastest / 1e-3), ("m", 1e-3)]);
        let force = base.balance.largest_force;
        scales.extend([("W", fastest * force), ("1/(m s)", fastest / 1e-6), ("N", force), ("N/m", force / 1e-3)]);
        // The density is 2500 kg/m³.
        scales.insert("Pa", 2500.0 * fastest * fastest);
        let mut differences = Vec::new();
        for quantity in sample.operator.quantities() {
            let width = quantity.components;
            let mut worst = 0.0_f64;
            let scale = scales.entry(quantity.unit).or_insert(f64::MIN_POSITIVE);
            for ((operator, step), a) in base.rows.range((k, 0)..=(k, u64::MAX)) {
                let Some(b) = other.rows.get(&(*operator, *step)) else {
                    worst = f64::INFINITY;
                    continue;
                };
                for cell in 0..cells {
                    let at = first + cell * width..first + (cell + 1) * width;
                    let (a, b) = (&a[at.clone()], &b[at]);
                    if a.iter().chain(b).all(|value| value.is_nan()) {
                        continue;
                    }
                    let (difference, size) = values(a, b, turn);
                    worst = max(worst, difference);
                    *scale = scale.max(size);
                }
            }
            differences.push((quantity, worst));
            first += width * cells;
        }
        for (quantity, worst) in differences {
            // Orientations round, also those of bodies that never turn: 1e-15 rad, over a length of 1 mm.
            let least = match quantity.unit {
                "rad" => 1e-15 / FLOOR,
                "1/m" => 1e-12 / FLOOR,
                _ => f64::MIN_POSITIVE,
            };
            let entry = found.entry(format!("{} {}", sample.operator.name(), quantity.name)).or_insert(0.0);
            *entry = max(*entry, worst / scales[quantity.unit].max(least));
        }
    }
}

/// Difference of `b` from the turned `a`, and the size of `a`.
fn values(a: &[f64], b: &[f64], turn: &Turn) -> (f64, f64) {
    match a.len() {
        3 => {
            let v = Vec3::from_column_slice(a);
            ((turn.vector(&v) - Vec3::from_column_slice(b)).norm(), v.norm())
        }
        9 => {
            let t: Mat3 = tensor(a);
            ((turn.tensor(&t) - tensor(b)).norm(), t.norm())
        }
        _ => ((a[0] - b[0]).abs(), a[0].abs()),
    }
}

/// What differs by more than `noise` explains.
pub fn excess(differences: &Differences, noise: &Differences, excluded: Excluded<'_>) -> Vec<String> {
    let mut found = Vec::new();
    for (name, difference) in differences {
        let explained = noise.get(name).copied().unwrap_or(0.0);
        // A fit amplifies roundings by its condition number.
        let floor = if name.starts_with("affine-") { 10.0 * FLOOR } else { FLOOR };
        // Not a number counts as an excess.
        let fine = *difference <= MARGIN * explained + floor;
        if !fine && explained < CHAOS && !excluded(name) {
            found.push(format!("{name}: {difference:.1e} (noise {explained:.1e})"));
        }
    }
    found
}

/// Whether the motion is so sensitive that comparisons say nothing.
pub fn chaotic(noise: &Differences) -> bool {
    ["position", "velocity"].iter().any(|name| noise.get(*name).is_none_or(|value| value.is_nan() || *value >= CHAOS))
}
