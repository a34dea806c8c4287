//! Tables with columns separated by commas, semicolons, or white space, with or without a header.

use super::columns::{Columns, split_name};
use super::{Read, bad};
use crate::bad_lines::BadLines;
use crate::{Packing, PackingError};

/// What separates the columns of a table.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Separator {
    Commas,
    /// Commas are decimal points, as spreadsheets of many countries write them.
    Semicolons,
    /// Any white space; the first line names the columns.
    Spaces,
}

impl Separator {
    /// The words of a line without comments.
    fn split(self, content: &str) -> Vec<&str> {
        if self == Self::Spaces {
            return content.split_whitespace().collect();
        }
        let separator = if self == Self::Commas { ',' } else { ';' };
        content.split(separator).map(|word| word.trim().trim_matches('"')).collect()
    }

    /// The names in a header.
    fn names(self, content: &str) -> Vec<String> {
        if self != Self::Spaces {
            return self.split(content).into_iter().map(str::to_owned).collect();
        }
        // A unit may stand apart: `x [mm]`.
        let mut names: Vec<String> = Vec::new();
        for word in content.split_whitespace() {
            match names.last_mut() {
                Some(last) if word.starts_with(['[', '(']) => *last = format!("{last} {word}"),
                _ => names.push(word.to_owned()),
            }
        }
        names
    }
}

/// The columns of a table, and the units (m) of x, y, z, and the radius, if it gives them.
pub(super) struct Named {
    columns: Columns,
    pub(super) units: Option<[f64; 4]>,
}

impl Named {
    /// Whether these are x y z r in m, as in a file without names.
    pub(super) fn is_plain(&self) -> bool {
        let Columns { places, factor, diameter, clump, count } = &self.columns;
        let in_meters = self.units.is_none_or(|units| units == [1.0; 4]);
        (*places, *factor, *diameter, *clump, *count) == ([0, 1, 2, 3], 1.0, None, None, Some(4)) && in_meters
    }
}

/// The columns that a comment before the first sphere names, such as `# r x y z`; of several, the last one. `None` if the first line
/// without a comment names columns itself, or no comment does.
///
/// # Errors
/// A comment with a word for each column that names some of them in another order, but not all that a sphere needs.
pub(super) fn named_by_comment(text: &str, separator: Separator) -> Result<Option<Named>, PackingError> {
    let comments = text.lines().take_while(|line| line.trim().is_empty() || line.trim_start().starts_with('#'));
    let candidates: Vec<(usize, &str)> = comments.enumerate().map(|(k, line)| (k + 1, line)).collect();
    let first = text.lines().nth(candidates.len()).and_then(|line| line.split('#').next()).unwrap_or("");
    let first = if separator == Separator::Semicolons { first.replace(',', ".") } else { first.to_owned() };
    let words = separator.split(first.trim());
    if words.iter().any(|word| !word.is_empty() && word.parse::<f64>().is_err()) {
        return Ok(None);
    }
    for (number, line) in candidates.into_iter().rev() {
        if let Some(named) = of_comment(line, words.len()).map_err(|reason| bad(number, reason, line))? {
            return Ok(Some(named));
        }
    }
    Ok(None)
}

/// The columns that a comment names, `count` words in a row.
fn of_comment(line: &str, count: usize) -> Result<Option<Named>, String> {
    let content = line.trim_start_matches([' ', '\t', '#']).replace([',', ';'], " ");
    let names = Separator::Spaces.names(&content);
    let Some(split) = names.iter().map(|name| split_name(name)).collect::<Option<Vec<_>>>() else { return Ok(None) };
    for part in split.windows(count.max(4)) {
        let (names, mut units): (Vec<String>, Vec<Option<&str>>) = part.iter().cloned().unzip();
        let Ok(Some(mut columns)) = Columns::of(&names) else { continue };
        // The unit after the last name is that of all: `# x y z r (m)`.
        if units.iter().rev().skip(1).all(Option::is_none) {
            units = vec![units.last().copied().flatten(); units.len()];
        }
        let units = columns.units(&units, &names)?;
        return Ok(Some(Named { columns, units }));
    }
    let known = |(place, (name, _)): (usize, &(String, Option<&str>))| {
        super::columns::is_known(name) && Columns::place_without_names(name) != Some(place)
    };
    if split.len() == count && split.iter().enumerate().any(known) {
        return Err(
            "the comment names the columns, but not x, y, z, and r (or radius, diameter); name all of them, or none"
                .to_owned(),
        );
    }
    Ok(None)
}

/// Reads a table; `named`: columns that a comment names.
pub(super) fn read(text: &str, separator: Separator, named: Option<Named>) -> Result<Read, PackingError> {
    let (mut scales, mut unit) = ([1.0; 4], None);
    if let Some(units) = named.as_ref().and_then(|named| named.units) {
        // The numbers are scaled here.
        (scales, unit) = (units, Some(1.0));
    }
    let mut columns: Option<Columns> = named.map(|named| named.columns);
    let mut packing = Packing::default();
    let mut wrong = BadLines::default();
    for (index, line) in text.lines().enumerate() {
        let number = index + 1;
        let content = line.split('#').next().unwrap_or("").trim();
        if content.is_empty() {
            continue;
        }
        let content = if separator == Separator::Semicolons { content.replace(',', ".") } else { content.to_owned() };
        let mut words = separator.split(&content);
        // Spreadsheets end lines with empty cells.
        let count = columns.as_ref().and_then(|columns| columns.count).unwrap_or(1);
        while words.len() > count && words.last().is_some_and(|word| word.is_empty()) {
            words.pop();
        }
        if let Some(columns) = &columns {
            packing.spheres.extend(wrong.keep(number, columns.sphere(number, line, &words, scales)));
        } else if words.iter().any(|word| word.parse::<f64>().is_err()) {
            let (found, given) = header(&separator.names(&content)).map_err(|reason| bad(number, reason, line))?;
            scales = given.unwrap_or(scales);
            // The numbers are scaled here.
            unit = given.map(|_| 1.0);
            columns = Some(found);
        } else if words.len() == 4 {
            let first = Columns::first_four();
            packing.spheres.push(first.sphere(number, line, &words, scales)?);
            columns = Some(first);
        } else {
            let reason = format!(
                "expected the four numbers x, y, z, r, found {}; name other columns in a header, write decimals with a point, or \
                 separate columns by semicolons",
                words.len()
            );
            return Err(bad(number, reason, line));
        }
    }
    wrong.end()?;
    Ok(Read { packing, unit })
}

/// The columns that a header names, and the units (m) of x, y, z, and the radius, if it gives them.
fn header(words: &[String]) -> Result<(Columns, Option<[f64; 4]>), String> {
    let is_decimal =
        |word: &str| word.split_once(',').is_some_and(|(a, b)| [a, b].iter().all(|part| part.parse::<f64>().is_ok()));
    if words.iter().all(|word| word.split_whitespace().all(|part| part.parse::<f64>().is_ok() || is_decimal(part))) {
        return Err("is neither a header nor four numbers; write decimals with a point: 0.5".to_owned());
    }
    let split: Vec<(String, Option<&str>)> =
        words.iter().map(|word| split_name(word).unwrap_or_else(|| (word.clone(), None))).collect();
    let (names, units): (Vec<String>, Vec<Option<&str>>) = split.into_iter().unzip();
    let mut columns = Columns::of(&names)?
        .ok_or("the header must name the columns x, y, z, and radius (or diameter), with a unit as in x [mm]")?;
    let units = columns.units(&units, &names)?;
    Ok((columns, units))
}
