//! The text of a scenario as a tree of values, each with its position in the text.

use std::collections::BTreeSet;
use std::ops::Range;

use serde::de::IntoDeserializer;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{Problem, ProblemKind, Source};
use super::syntax;

/// A parsed TOML text with the position of every key.
pub struct Document<'a> {
    pub(crate) source: &'a Source,
    pub(crate) root: Spanned<DeTable<'a>>,
}

impl<'a> Document<'a> {
    /// Parses the text.
    ///
    /// # Errors
    /// All syntax errors, at most one per line.
    pub fn parse(source: &'a Source) -> Result<Self, Vec<Problem>> {
        let (root, errors) = DeTable::parse_recoverable(&source.text);
        let document = Self { source, root };
        if errors.is_empty() {
            return Ok(document);
        }
        // A file that is no scenario has an error in each of its lines.
        let lines: Vec<&str> = source.text.split('\n').map(|line| line.trim_end_matches('\r')).collect();
        let starts: Vec<usize> =
            std::iter::once(0).chain(source.text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        let headers = headers(&lines);
        let (mut problems, mut seen) = (Vec::new(), BTreeSet::new());
        for error in &errors {
            let span = error.span().unwrap_or(0..0);
            let line = starts.partition_point(|start| *start <= span.start) - 1;
            // The keys below a table that is given twice are given twice, too.
            let follows =
                error.message().contains("duplicate key") && headers[line].is_some_and(|at| seen.contains(&at));
            // Report one error per line: the others usually follow from the first.
            if !follows && seen.insert(line) {
                problems.push(syntax::problem(&lines, line, span, error.message()));
            }
        }
        Err(problems)
    }

    /// Deserializes the text with serde, which stops at the first problem.
    pub fn deserialize<T: serde::de::DeserializeOwned>(&self) -> Result<T, Problem> {
        T::deserialize(self.root.clone().into_deserializer()).map_err(|error| {
            let span = error.span().unwrap_or(0..0);
            Problem {
                kind: ProblemKind::WrongType,
                key: String::new(),
                value: Some(self.excerpt(&span)).filter(|text| !text.is_empty()),
                span,
                message: error.message().to_owned(),
                help: "run `concordem schema` for the keys and types of a scenario".to_owned(),
            }
        })
    }

    /// Position and text of the value at a key path such as `material[0].cpm.young`. If there is no such value, the position
    /// of the innermost table that exists, without text.
    pub fn locate(&self, path: &str) -> (Range<usize>, Option<String>) {
        let mut place = 0..0;
        let mut table: Option<&DeTable<'_>> = Some(self.root.get_ref());
        let mut value: Option<&Spanned<DeValue<'_>>> = None;
        for segment in path.split('.').filter(|segment| !segment.is_empty()) {
            let (name, indices) = match segment.find('[') {
                Some(at) => (&segment[..at], &segment[at..]),
                None => (segment, ""),
            };
            let Some((key, found)) = table.and_then(|table| table.get_key_value(name)) else { return (place, None) };
            place = key.span();
            let mut found = found;
            for index in indices.split(['[', ']']).filter(|index| !index.is_empty()) {
                let Some(item) = index
                    .parse()
                    .ok()
                    .and_then(|index: usize| found.get_ref().as_array().and_then(|array| array.get(index)))
                else {
                    return (place, None);
                };
                found = item;
                place = self.place_of_item(found, &place);
            }
            table = found.get_ref().as_table();
            value = Some(found);
        }
        match value {
            Some(value) if value.get_ref().as_table().is_none() => (value.span(), Some(self.excerpt(&value.span()))),
            _ => (place, None),
        }
    }

    /// The text of a range, as written.
    pub(crate) fn written(&self, span: &Range<usize>) -> &str {
        self.source.text.get(span.clone()).unwrap_or("")
    }

    /// Position of an array item: its table header, or the item itself.
    pub(crate) fn place_of_item(&self, item: &Spanned<DeValue<'_>>, parent: &Range<usize>) -> Range<usize> {
        let span = item.span();
        if span.is_empty() { parent.clone() } else { self.first_line(span) }
    }

    /// The part of a span that lies on its first line.
    pub(crate) fn first_line(&self, span: Range<usize>) -> Range<usize> {
        let text = self.source.text.get(span.clone()).unwrap_or("");
        let length = text.find('\n').unwrap_or(text.len());
        span.start..span.start + text[..length].trim_end().len()
    }

    /// A value as written, on one line and shortened to 60 characters.
    pub(crate) fn excerpt(&self, span: &Range<usize>) -> String {
        let text = self.source.text.get(span.clone()).unwrap_or("");
        let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
        if line.chars().count() > 60 { line.chars().take(57).chain("...".chars()).collect() } else { line }
    }
}

/// Index of the header of the table to which each line belongs; `None` for a header itself, and above the first.
fn headers(lines: &[&str]) -> Vec<Option<usize>> {
    let mut header = None;
    let of_line = |(at, line): (usize, &&str)| {
        if line.trim_start().starts_with('[') {
            header = Some(at);
            return None;
        }
        header
    };
    lines.iter().enumerate().map(of_line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A packing given as a scenario has an error in each line; each is found once, with its place. Looking through all lines and all
    /// problems for each error would take hours.
    #[test]
    fn each_line_of_a_file_that_is_no_scenario_has_one_problem() {
        let count = 20_000;
        let lines: Vec<String> = (0..count).map(|k| format!("{}.5 0.25 0.125 1e-3\r\n", k % 7)).collect();
        let text = lines.concat();
        let source = Source::new("packing.txt", &text);
        let problems = Document::parse(&source).err().expect("no scenario");
        assert_eq!(problems.len(), count);
        for (k, problem) in problems.iter().enumerate().step_by(count / 10) {
            assert_eq!(source.position(problem.span.start).0, k + 1);
            assert_eq!(problem.value, Some(format!("{}.5 0.25 0.125 1e-3", k % 7)));
            assert!(problem.help.contains("a row of numbers"), "{}", problem.help);
        }
    }
}
