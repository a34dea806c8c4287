//! Tables with columns separated by commas, semicolons, or white space, with or without a header.

use super::columns::{Columns, split_name};
use super::{Read, bad};
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

/// Reads a table.
pub(super) fn read(text: &str, separator: Separator) -> Result<Read, PackingError> {
    let mut columns: Option<Columns> = None;
    let (mut scales, mut unit) = ([1.0; 4], None);
    let mut packing = Packing::default();
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
            packing.spheres.push(columns.sphere(number, line, &words, scales)?);
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
    let columns = Columns::of(&names)?
        .ok_or("the header must name the columns x, y, z, and radius (or diameter), with a unit as in x [mm]")?;
    let units = columns.units(&units, &names)?;
    Ok((columns, units))
}
