//! Columns of a table: their names, units, and places.

use super::bad;
use crate::PackingError;
use concordem_contact::math::Vec3;
use concordem_contact::quantity::Length;
use concordem_solver::state::particles::Sphere;

/// Names of the three coordinates; the first row whose names are all there holds.
const COORDINATES: [[&str; 3]; 6] = [
    ["x", "y", "z"],
    ["xu", "yu", "zu"],
    ["points:0", "points:1", "points:2"],
    ["points_0", "points_1", "points_2"],
    ["position_x", "position_y", "position_z"],
    ["pos_x", "pos_y", "pos_z"],
];
/// Names of the radius, and of the diameter.
const RADII: [&str; 3] = ["r", "radius", "rad"];
const DIAMETERS: [&str; 2] = ["d", "diameter"];
/// Names of the number of the clump to which a sphere belongs; −1 for none.
const CLUMPS: [&str; 4] = ["clump", "clumpid", "clump_id", "id_multisphere"];

/// Places of x, y, z, and the radius (with the factor that a diameter needs) in a line.
pub(super) struct Columns {
    pub(super) places: [usize; 4],
    pub(super) factor: f64,
    /// Place of the number of the clump.
    pub(super) clump: Option<usize>,
    /// Number of columns of every line, if it is known.
    pub(super) count: Option<usize>,
}

/// A name such as `x [mm]`, `x (mm)`, or `x mm`, split into the name, in lower case, and the unit; `None` if it is no name.
pub(super) fn split_name(name: &str) -> Option<(String, Option<&str>)> {
    let name = name.trim().trim_matches('"').trim();
    let end = name.find(['[', '(', ' ']).unwrap_or(name.len());
    let (word, rest) = name.split_at(end);
    let unit = rest.trim_matches(['[', ']', '(', ')', ' ']);
    (word.starts_with(|c: char| c.is_alphabetic() || c == '_'))
        .then(|| (word.to_lowercase(), Some(unit).filter(|unit| !unit.is_empty())))
}

impl Columns {
    /// x, y, z, and the radius in the first four columns.
    pub(super) fn first_four() -> Self {
        Self { places: [0, 1, 2, 3], factor: 1.0, clump: None, count: Some(4) }
    }

    /// The place that the column of this name has in a file without names.
    pub(super) fn place_without_names(name: &str) -> Option<usize> {
        let coordinate = COORDINATES.iter().find_map(|names| names.iter().position(|known| *known == name));
        coordinate.or_else(|| RADII.contains(&name).then_some(3))
    }

    /// `None` if a coordinate or the radius is missing.
    ///
    /// # Errors
    /// A name that stands for two columns, or a radius beside a diameter.
    pub(super) fn of(names: &[String]) -> Result<Option<Self>, String> {
        let find = |word: &str| -> Result<Option<usize>, String> {
            let mut places = names.iter().enumerate().filter(|(_, name)| *name == word).map(|(place, _)| place);
            let found = places.next();
            if places.next().is_some() {
                return Err(format!("two columns are called {word:?}"));
            }
            Ok(found)
        };
        let any = |words: &[&str]| -> Result<Option<usize>, String> {
            words.iter().map(|word| find(word)).find_map(Result::transpose).transpose()
        };
        let mut coordinates = None;
        for [x, y, z] in COORDINATES {
            if let (Some(x), Some(y), Some(z)) = (find(x)?, find(y)?, find(z)?) {
                coordinates = Some([x, y, z]);
                break;
            }
        }
        let radius = match (any(&RADII)?, any(&DIAMETERS)?) {
            (Some(radius), Some(diameter)) => {
                let [radius, diameter] = [radius, diameter].map(|place| &names[place]);
                return Err(format!("{radius:?} and {diameter:?} both give the size; remove one column, or rename it"));
            }
            (Some(place), None) => Some((place, 1.0)),
            (None, diameter) => diameter.map(|place| (place, 0.5)),
        };
        let (Some([x, y, z]), Some((r, factor))) = (coordinates, radius) else { return Ok(None) };
        Ok(Some(Self { places: [x, y, z, r], factor, clump: any(&CLUMPS)?, count: Some(names.len()) }))
    }

    /// The unit (m) of the lengths that a sphere has, from the units of all columns.
    ///
    /// # Errors
    /// Unknown units, and units of some columns only.
    pub(super) fn units(&self, units: &[Option<&str>], names: &[String]) -> Result<Option<[f64; 4]>, String> {
        let mut scales = [None; 4];
        for (scale, &place) in scales.iter_mut().zip(&self.places) {
            let Some(unit) = units[place] else { continue };
            let length =
                Length::parse(&format!("1 {unit}")).map_err(|_| format!("{unit:?} is not a unit of length"))?;
            *scale = Some(length.si());
        }
        match scales {
            [None, None, None, None] => Ok(None),
            [Some(x), Some(y), Some(z), Some(r)] => Ok(Some([x, y, z, r])),
            _ => {
                let without = self.places.iter().filter(|place| units[**place].is_none());
                let without: Vec<&str> = without.map(|place| &names[*place][..]).collect();
                Err(format!(
                    "the columns {} have no unit, but others have one; give all of them a unit, such as x [mm]",
                    without.join(", ")
                ))
            }
        }
    }

    /// The sphere of a line; `scales`: units of x, y, z, and the radius.
    pub(super) fn sphere(
        &self,
        number: usize,
        line: &str,
        words: &[&str],
        scales: [f64; 4],
    ) -> Result<Sphere, PackingError> {
        if let Some(count) = self.count.filter(|count| *count != words.len()) {
            let reason = format!("expected {count} columns, found {}{}", words.len(), decimal_commas(words, count));
            return Err(bad(number, reason, line));
        }
        let mut values = [0.0; 4];
        for ((value, &place), scale) in values.iter_mut().zip(&self.places).zip(scales) {
            let word = words.get(place).ok_or_else(|| bad(number, format!("expected {} columns", place + 1), line))?;
            *value = real(number, line, word)? * scale;
        }
        values[3] *= self.factor;
        if let Some(word) = self.clump.and_then(|place| words.get(place)) {
            loose(number, line, word)?;
        }
        sphere(number, line, values)
    }
}

/// Whether a word is a name that columns have here.
pub(super) fn is_known(name: &str) -> bool {
    COORDINATES.iter().flatten().chain(&RADII).chain(&DIAMETERS).any(|known| *known == name)
}

/// What to do about decimal commas that make more columns than there are.
fn decimal_commas(words: &[&str], count: usize) -> &'static str {
    if words.len() > count { "; write decimals with a point: 0.5, or separate columns by semicolons" } else { "" }
}

/// A sphere from x, y, z and its radius.
pub(super) fn sphere(number: usize, line: &str, [x, y, z, radius]: [f64; 4]) -> Result<Sphere, PackingError> {
    if radius > 0.0 {
        Ok(Sphere { position: Vec3::new(x, y, z), radius })
    } else {
        Err(bad(number, format!("the radius {radius} is not positive"), line))
    }
}

pub(super) fn real(number: usize, line: &str, word: &str) -> Result<f64, PackingError> {
    match word.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(value) => Err(bad(number, format!("{value} is not finite"), line)),
        Err(_) => Err(bad(number, format!("{word:?} is not a number"), line)),
    }
}

/// Refuses a sphere that belongs to a clump.
///
/// # Errors
/// A number of a clump, which is not negative.
pub(crate) fn loose(number: usize, line: &str, word: &str) -> Result<(), PackingError> {
    match word.parse::<f64>() {
        Ok(-1.0) => Ok(()),
        Ok(clump) if clump >= 0.0 && clump.fract() == 0.0 => {
            let reason = format!(
                "the sphere belongs to clump {clump}, and a packing has no clumps; write -1 in this column, and join the spheres by \
                 [[clump]] with a `set` of their ids"
            );
            Err(bad(number, reason, line))
        }
        _ => Err(bad(number, format!("{word:?} is not a number of a clump; -1 stands for none"), line)),
    }
}
