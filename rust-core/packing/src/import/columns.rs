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

/// Part of a diameter by which it may differ from twice the radius in the same line: files have at least six digits of each.
const ROUNDING: f64 = 1e-5;

/// Places of x, y, z, and the radius (with the factor that a diameter needs) in a line.
pub(super) struct Columns {
    pub(super) places: [usize; 4],
    pub(super) factor: f64,
    /// Place of the diameter in a file that has the radius, too, and its unit, m.
    pub(super) diameter: Option<(usize, f64)>,
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
        Self { places: [0, 1, 2, 3], factor: 1.0, diameter: None, clump: None, count: Some(4) }
    }

    /// The place that the column of this name has in a file without names.
    pub(super) fn place_without_names(name: &str) -> Option<usize> {
        let coordinate = COORDINATES.iter().find_map(|names| names.iter().position(|known| *known == name));
        coordinate.or_else(|| RADII.contains(&name).then_some(3))
    }

    /// `None` if a coordinate or the radius is missing.
    ///
    /// # Errors
    /// A name that stands for two columns.
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
        let (radius, diameter) = (any(&RADII)?, any(&DIAMETERS)?);
        let size = radius.map(|place| (place, 1.0)).or_else(|| diameter.map(|place| (place, 0.5)));
        let (Some([x, y, z]), Some((r, factor))) = (coordinates, size) else { return Ok(None) };
        let diameter = radius.and(diameter).map(|place| (place, 1.0));
        Ok(Some(Self { places: [x, y, z, r], factor, diameter, clump: any(&CLUMPS)?, count: Some(names.len()) }))
    }

    /// The unit (m) of the lengths that a sphere has, from the units of all columns.
    ///
    /// # Errors
    /// Unknown units, and units of some columns only.
    pub(super) fn units(&mut self, units: &[Option<&str>], names: &[String]) -> Result<Option<[f64; 4]>, String> {
        let places: Vec<usize> = self.places.into_iter().chain(self.diameter.map(|(place, _)| place)).collect();
        let scale = |place: &usize| -> Result<Option<f64>, String> {
            let length =
                |unit| Length::parse(&format!("1 {unit}")).map_err(|_| format!("{unit:?} is not a unit of length"));
            Ok(units[*place].map(length).transpose()?.map(Length::si))
        };
        let scales = places.iter().map(scale).collect::<Result<Vec<_>, _>>()?;
        if scales.iter().all(Option::is_none) {
            return Ok(None);
        }
        let without: Vec<&str> = places
            .iter()
            .zip(&scales)
            .filter(|(_, scale)| scale.is_none())
            .map(|(place, _)| &names[*place][..])
            .collect();
        if !without.is_empty() {
            return Err(format!(
                "the columns {} have no unit, but others have one; give all of them a unit, such as x [mm]",
                without.join(", ")
            ));
        }
        let scales: Vec<f64> = scales.into_iter().flatten().collect();
        if let (Some((_, scale)), Some(given)) = (&mut self.diameter, scales.get(4)) {
            *scale = *given;
        }
        Ok(Some([scales[0], scales[1], scales[2], scales[3]]))
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
        if let Some((place, scale)) = self.diameter {
            let word = words.get(place).ok_or_else(|| bad(number, format!("expected {} columns", place + 1), line))?;
            let (twice, diameter) = (2.0 * values[3], real(number, line, word)? * scale);
            if (diameter - twice).abs() > ROUNDING * twice.abs() {
                let reason = format!(
                    "the diameter {diameter} is not twice the radius {}; remove or rename one column",
                    values[3]
                );
                return Err(bad(number, reason, line));
            }
        }
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
