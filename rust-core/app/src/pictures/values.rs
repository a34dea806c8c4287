//! Colors of particles and bonds by a field.

use std::collections::{BTreeMap, HashMap};

use concordem_contact::math::Mat3;
use concordem_picture::Color;
use concordem_picture::colors::{Scale, of_kind};
use concordem_picture::key::Key;
use concordem_scenario::schema::Scenario;
use concordem_solver::state::columns::{ColumnData, StoredColumn};

use super::fields::{reals, whole};
use super::strain;
use crate::output::frames::Frame;
use crate::output::stream::StoredField;
use crate::prefix::with_prefix;

/// Color of what has no value.
pub(super) const PLAIN: Color = [150, 158, 166];
/// Names of the axes.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];
/// Names of the components of a stress, with their places in the matrix.
const STRESSES: [(&str, usize, usize); 6] = [
    ("stress-xx", 0, 0),
    ("stress-yy", 1, 1),
    ("stress-zz", 2, 2),
    ("stress-xy", 0, 1),
    ("stress-yz", 1, 2),
    ("stress-zx", 2, 0),
];
/// Name of the mean normal stress.
const MEAN_STRESS: &str = "stress";

/// One value per thing that is drawn, in the order of the field.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Colored {
    /// Numbers of a quantity.
    Numbers {
        /// Its name.
        name: String,
        /// Its unit.
        unit: String,
        /// The values.
        of: Vec<f64>,
    },
    /// Kinds, with their names.
    Kinds {
        /// Number of the kind.
        of: Vec<usize>,
        /// Names by number.
        names: Vec<String>,
    },
}

/// Whether this field is a stress.
pub(super) fn is_stress(name: &str) -> bool {
    name == MEAN_STRESS || STRESSES.iter().any(|(other, ..)| *other == name)
}

/// The field that says most of the particles: damage where there are bonds, else speed.
pub(super) fn usual(scenario: &Scenario) -> &'static str {
    if scenario.bonds.is_some() { "damage" } else { "speed" }
}

/// The values of particles. Frames: the first one, and the one that is drawn.
///
/// # Errors
/// There is no such field; the message lists those that there are.
pub(super) fn of_particles(
    [first, frame]: [&Frame; 2],
    scenario: &Scenario,
    stress: Option<&BTreeMap<u32, Mat3>>,
    name: &str,
) -> Result<Colored, String> {
    if is_stress(name) {
        return Ok(stresses(frame, scenario, stress, name));
    }
    if strain::is_strain(name) {
        let of = strain::of_particles(first, frame, scenario.dimension, name)?;
        return Ok(Colored::Numbers { name: spoken(name), unit: String::new(), of });
    }
    match name {
        "material" => Ok(materials(frame, scenario)),
        "fragment" if frame.field("fragment").is_some() => Ok(fragments(&whole(frame, "fragment"))),
        "diameter" => {
            let of = reals(frame, "radius").iter().map(|radius| 2.0 * radius).collect();
            Ok(Colored::Numbers { name: name.to_owned(), unit: "m".to_owned(), of })
        }
        "speed" => of_field(frame, "velocity", "speed").ok_or_else(|| "the snapshots have no velocity".to_owned()),
        _ => of_field(frame, name, name).ok_or_else(|| {
            let mut names: Vec<String> = ["speed", "diameter"].map(str::to_owned).to_vec();
            for field in frame.fields.iter().filter(|field| field.name != "id") {
                names.push(field.name.replace('_', "-"));
                if field.column.components == 3 {
                    names.extend(AXES.map(|axis| format!("{}-{axis}", field.name.replace('_', "-"))));
                }
            }
            names.push(MEAN_STRESS.to_owned());
            names.extend(STRESSES.map(|(name, ..)| name.to_owned()));
            names.extend(strain::names().map(str::to_owned));
            format!("particles have no field “{name}”; there are: {}", names.join(", "))
        }),
    }
}

/// The values of bonds.
///
/// # Errors
/// There is no such field; the message lists those that there are.
pub(super) fn of_bonds(fields: &[StoredField], name: &str) -> Result<Colored, String> {
    let wanted = name.replace('-', "_");
    let numeric =
        |field: &&StoredField| matches!(field.column.data, ColumnData::F64(_)) && field.column.components == 1;
    let found = fields.iter().filter(numeric).find(|field| field.name == wanted);
    let found = found.ok_or_else(|| {
        let names: Vec<String> = fields.iter().filter(numeric).map(|field| field.name.replace('_', "-")).collect();
        format!("bonds have no field “{name}”; there are: {}", names.join(", "))
    })?;
    Ok(Colored::Numbers {
        name: spoken(name),
        unit: found.unit.clone(),
        of: numbers(&found.column).unwrap_or_default(),
    })
}

/// Numbers of a field by its name, with hyphens or underscores: of vectors the length, or with -x, -y, or -z a component.
fn of_field(frame: &Frame, name: &str, label: &str) -> Option<Colored> {
    let name = name.replace('-', "_");
    let field = |name: &str| frame.fields.iter().find(|field| field.name == name && field.name != "id");
    if let Some(field) = field(&name) {
        let of = match (&field.column.data, field.column.components) {
            (ColumnData::F64(values), 3) => {
                let (vectors, _) = values.as_chunks::<3>();
                vectors.iter().map(|v| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()).collect()
            }
            _ => numbers(&field.column)?,
        };
        return Some(Colored::Numbers { name: spoken(label), unit: field.unit.clone(), of });
    }
    let (stem, axis) = name.rsplit_once('_')?;
    let (field, axis) = (field(stem)?, AXES.iter().position(|other| *other == axis)?);
    let (ColumnData::F64(values), 3) = (&field.column.data, field.column.components) else { return None };
    let of = values.iter().skip(axis).step_by(3).copied().collect();
    Some(Colored::Numbers { name: spoken(label), unit: field.unit.clone(), of })
}

fn numbers(column: &StoredColumn) -> Option<Vec<f64>> {
    match &column.data {
        _ if column.components != 1 => None,
        ColumnData::F64(values) => Some(values.clone()),
        ColumnData::U64(values) => Some(values.iter().map(|value| *value as f64).collect()),
        ColumnData::U32(values) => Some(values.iter().map(|value| f64::from(*value)).collect()),
        ColumnData::U16(values) => Some(values.iter().map(|value| f64::from(*value)).collect()),
        ColumnData::U8(values) => Some(values.iter().map(|value| f64::from(*value)).collect()),
        ColumnData::I8(values) => Some(values.iter().map(|value| f64::from(*value)).collect()),
    }
}

fn spoken(name: &str) -> String {
    name.replace(['_', '-'], " ")
}

/// Stress over the volume of the sphere, or of the disc.
fn stresses(frame: &Frame, scenario: &Scenario, stress: Option<&BTreeMap<u32, Mat3>>, name: &str) -> Colored {
    let directions = if scenario.dimension == 2 { 2 } else { 3 };
    let of = |tensor: &Mat3| match STRESSES.iter().find(|(other, ..)| *other == name) {
        Some(&(_, i, j)) => 0.5 * (tensor[(i, j)] + tensor[(j, i)]),
        None => (0..directions).map(|k| tensor[(k, k)]).sum::<f64>() / f64::from(directions as u8),
    };
    let value = |id: &usize| stress.and_then(|all| all.get(&(*id as u32))).map_or(0.0, of);
    let label = if name == MEAN_STRESS { "mean stress".to_owned() } else { spoken(name) };
    Colored::Numbers { name: label, unit: "Pa".to_owned(), of: whole(frame, "id").iter().map(value).collect() }
}

fn materials(frame: &Frame, scenario: &Scenario) -> Colored {
    let names = scenario.materials.iter().map(|material| shortened(&material.name)).collect();
    Colored::Kinds { of: whole(frame, "material"), names }
}

/// Most characters of a name beside a picture, so that the body has room beside it.
const LONGEST_NAME: usize = 20;

/// A name in one short line.
fn shortened(name: &str) -> String {
    let line: Vec<char> = name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    if line.len() <= LONGEST_NAME {
        return line.into_iter().collect();
    }
    line[..LONGEST_NAME - 3].iter().chain(&['.'; 3]).collect()
}

/// The largest fragment, single particles, and the others in turn.
fn fragments(of: &[usize]) -> Colored {
    let mut sizes: HashMap<usize, usize> = HashMap::new();
    for fragment in of {
        *sizes.entry(*fragment).or_default() += 1;
    }
    let mut order: Vec<(usize, usize)> = sizes.into_iter().collect();
    order.sort_by_key(|&(fragment, size)| (std::cmp::Reverse(size), fragment));
    let kind_of: HashMap<usize, usize> = order
        .iter()
        .enumerate()
        .map(|(rank, &(fragment, size))| {
            let kind = if rank == 0 {
                0
            } else if size == 1 {
                7
            } else {
                1 + (rank - 1) % 6
            };
            (fragment, kind)
        })
        .collect();
    let names = ["largest fragment", "others", "", "", "", "", "", "single particles"].map(str::to_owned);
    Colored::Kinds { of: of.iter().map(|fragment| kind_of[fragment]).collect(), names: names.to_vec() }
}

/// From the values of all images to colors.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Coloring {
    range: [f64; 2],
    scale: Scale,
    key: Key,
}

impl Coloring {
    /// The colors of these values; `None` without any. `range`: values at the ends.
    pub(super) fn of(all: &[&Colored], range: Option<[f64; 2]>) -> Option<Self> {
        match all.first()? {
            Colored::Kinds { names, .. } => {
                let is_there =
                    |kind: usize| all.iter().any(|one| matches!(one, Colored::Kinds { of, .. } if of.contains(&kind)));
                let names = names.iter().enumerate().filter(|(kind, name)| !name.is_empty() && is_there(*kind));
                let key = Key::Names(names.map(|(kind, name)| (of_kind(kind), name.clone())).collect());
                Some(Self { range: [0.0, 1.0], scale: Scale::Even, key })
            }
            Colored::Numbers { name, unit, .. } => {
                let values = all.iter().flat_map(|one| match one {
                    Colored::Numbers { of, .. } => &of[..],
                    Colored::Kinds { .. } => &[],
                });
                let found = values
                    .filter(|value| value.is_finite())
                    .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(*value), high.max(*value)]);
                let is_damage = name == "damage";
                let range = range.unwrap_or_else(|| fitting(found, is_damage));
                let scale = match range {
                    _ if is_damage => Scale::Damage,
                    [low, high] if low < 0.0 && high > 0.0 => Scale::Signed,
                    _ => Scale::Even,
                };
                let (unit, factor) = with_prefix(unit, range);
                let label = if unit.is_empty() { name.clone() } else { format!("{name}, {unit}") };
                let key = Key::Bar { label, range: range.map(|value| value * factor), scale };
                Some(Self { range, scale, key })
            }
        }
    }

    pub(super) fn key(&self) -> Key {
        self.key.clone()
    }

    /// The color of value number `k`.
    pub(super) fn color(&self, colored: &Colored, k: usize) -> Color {
        match colored {
            Colored::Kinds { of, .. } => of.get(k).map_or(PLAIN, |kind| of_kind(*kind)),
            Colored::Numbers { of, .. } => match of.get(k) {
                Some(value) if value.is_finite() => {
                    let [low, high] = self.range;
                    self.scale.color(if high > low { (value - low) / (high - low) } else { 0.5 })
                }
                _ => PLAIN,
            },
        }
    }
}

/// The range of values: that of damage is known, and values of both signs have zero in the middle.
fn fitting([low, high]: [f64; 2], is_damage: bool) -> [f64; 2] {
    if is_damage || low > high {
        return [0.0, 1.0];
    }
    let most = high.max(-low);
    if low < 0.0 && high > 0.0 { [-most, most] } else { [low, high] }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers_of(name: &str, unit: &str, of: &[f64]) -> Colored {
        Colored::Numbers { name: name.to_owned(), unit: unit.to_owned(), of: of.to_vec() }
    }

    fn label(colored: &Colored, range: Option<[f64; 2]>) -> (String, [f64; 2], Scale) {
        match Coloring::of(&[colored], range).unwrap().key {
            Key::Bar { label, range, scale } => (label, range, scale),
            Key::Names(names) => panic!("{names:?}"),
        }
    }

    /// Damage goes from 0 to 1, both signs are even about zero, and units have prefixes.
    #[test]
    fn ranges_and_units_fit_the_values() {
        let damage = numbers_of("damage", "1", &[0.2, 0.4]);
        assert_eq!(label(&damage, None), ("damage".into(), [0.0, 1.0], Scale::Damage));
        let stress = numbers_of("stress xx", "Pa", &[-3e6, 1e6, f64::NAN]);
        assert_eq!(label(&stress, None), ("stress xx, MPa".into(), [-3.0, 3.0], Scale::Signed));
        let speed = numbers_of("speed", "m/s", &[0.0, 0.25]);
        assert_eq!(label(&speed, None), ("speed, mm/s".into(), [0.0, 250.0], Scale::Even));
        assert_eq!(label(&speed, Some([0.0, 2.0])), ("speed, m/s".into(), [0.0, 2.0], Scale::Even));
        let heat = numbers_of("temperature", "K", &[293.0, 293.0]);
        assert_eq!(label(&heat, None), ("temperature, K".into(), [293.0, 293.0], Scale::Even));
    }

    /// The range of all images counts, and a value beyond the given range has the color of the end.
    #[test]
    fn images_share_their_colors() {
        let (one, other) = (numbers_of("speed", "m/s", &[0.0, 1.0]), numbers_of("speed", "m/s", &[4.0]));
        let both = Coloring::of(&[&one, &other], None).unwrap();
        assert_eq!(both.color(&one, 1), Scale::Even.color(0.25));
        let given = Coloring::of(&[&one, &other], Some([0.0, 1.0])).unwrap();
        assert_eq!(given.color(&other, 0), Scale::Even.color(1.0));
        assert_eq!(given.color(&other, 9), PLAIN);
    }

    /// The largest fragment has the first color, single particles the last one.
    #[test]
    fn fragments_by_their_size() {
        let Colored::Kinds { of, .. } = fragments(&[5, 5, 9, 5, 2, 2]) else { panic!() };
        assert_eq!(of, [0, 0, 7, 0, 1, 1]);
        let key = Coloring::of(&[&fragments(&[1, 1, 4])], None).unwrap().key;
        let wanted = [(of_kind(0), "largest fragment".to_owned()), (of_kind(7), "single particles".to_owned())];
        assert_eq!(key, Key::Names(wanted.to_vec()));
    }
}
