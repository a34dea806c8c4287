//! Problems of a scenario, reported with position, value, and remedy.

use std::fmt;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use super::document::Document;
use super::setting::Given;

/// Number of problems that a message shows.
pub const MOST_SHOWN: usize = 10;

/// Name and text of a scenario.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Source {
    /// Name shown in messages, usually the file name.
    pub name: Arc<str>,
    /// Text.
    pub text: Arc<str>,
    /// The text of the file and the settings, if there are some; `text` contains them.
    pub given: Option<Arc<Given>>,
}

impl Source {
    /// A text without settings.
    pub fn new(name: &str, text: &str) -> Self {
        Self { name: name.into(), text: text.into(), given: None }
    }

    /// Line and column of a byte, both counted from 1; columns count characters. For many bytes use a `Cursor`.
    pub fn position(&self, byte: usize) -> (usize, usize) {
        Cursor::new(&self.text).position(byte)
    }
}

/// Finds lines and columns of bytes in a text. Bytes in ascending order take one pass over the text, however many they are.
#[derive(Debug)]
struct Cursor<'a> {
    text: &'a str,
    /// The last byte, and its line and column.
    at: usize,
    line: usize,
    column: usize,
    /// Bytes passed so far.
    #[cfg(test)]
    passed: usize,
}

impl<'a> Cursor<'a> {
    fn new(text: &'a str) -> Self {
        Self {
            text,
            at: 0,
            line: 1,
            column: 1,
            #[cfg(test)]
            passed: 0,
        }
    }

    /// Line and column of a byte, both counted from 1; columns count characters.
    fn position(&mut self, byte: usize) -> (usize, usize) {
        let mut byte = byte.min(self.text.len());
        while !self.text.is_char_boundary(byte) {
            byte -= 1;
        }
        if byte < self.at {
            (self.at, self.line, self.column) = (0, 1, 1);
        }
        let between = &self.text[self.at..byte];
        match between.rfind('\n') {
            Some(last) => {
                self.line += between.matches('\n').count();
                self.column = between[last + 1..].chars().count() + 1;
            }
            None => self.column += between.chars().count(),
        }
        #[cfg(test)]
        {
            self.passed += between.len();
        }
        self.at = byte;
        (self.line, self.column)
    }
}

/// Class of a problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ProblemKind {
    /// The text is not TOML.
    Syntax,
    /// A key that does not exist.
    UnknownKey,
    /// A required key that is missing.
    MissingKey,
    /// A value of the wrong type, or a word that is not allowed.
    WrongType,
    /// A string with a wrong or missing unit.
    WrongUnit,
    /// A value out of range.
    OutOfRange,
    /// A name that does not exist.
    UnknownName,
    /// Values that contradict each other.
    Conflict,
    /// A file that cannot be read.
    File,
    /// Not an error: the scenario is valid, but may not do what its author expects.
    Warning,
}

/// One problem of a scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// Class.
    pub kind: ProblemKind,
    /// Key path, such as `material[0].cpm.young`, counted from 0; empty for the file as a whole.
    pub key: String,
    /// The value, as written.
    pub value: Option<String>,
    /// Range of bytes in the text.
    pub span: Range<usize>,
    /// What is wrong.
    pub message: String,
    /// The remedy.
    pub help: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.key.is_empty() {
            match &self.value {
                Some(value) => write!(formatter, "{} = {value}: ", self.key)?,
                None => write!(formatter, "{}: ", self.key)?,
            }
        }
        formatter.write_str(&self.message)
    }
}

impl std::error::Error for Problem {}

/// All problems of a scenario. The message gives line, key, value, and remedy of the first ten.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.plain())]
#[non_exhaustive]
pub struct ScenarioError {
    /// The scenario.
    pub source_text: Source,
    /// The problems, in the order of the text; never empty.
    pub problems: Vec<Problem>,
}

/// Where a problem is: in the scenario, or in a setting.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Location {
    /// Name and text of the file, or the setting.
    pub source: Source,
    /// Range of bytes in the text.
    pub span: Range<usize>,
    /// Line and column of its start, both counted from 1; columns count characters.
    pub position: (usize, usize),
    /// Whether it is a setting, which has no lines.
    pub is_setting: bool,
}

impl ScenarioError {
    /// Sorts the problems by position and drops duplicates.
    pub fn new(source: &Source, mut problems: Vec<Problem>) -> Self {
        let mut shown = source.clone();
        if let Some(given) = &source.given {
            // Positions refer to the file as its author knows it, without the settings.
            shown.text = given.text.clone();
            if let Ok(document) = Document::parse(&shown) {
                for problem in &mut problems {
                    let (span, value) = document.locate(&problem.key);
                    problem.span = match given.cause(&problem.key, value.is_none()) {
                        Some(setting) => {
                            setting.place(matches!(problem.kind, ProblemKind::UnknownKey | ProblemKind::MissingKey))
                        }
                        None => span,
                    };
                }
            }
        }
        problems.sort_by(|a, b| (a.span.start, a.span.end, &a.key).cmp(&(b.span.start, b.span.end, &b.key)));
        problems.dedup();
        Self { source_text: shown, problems }
    }

    /// Where each of these problems is. Takes one pass over the text for all problems in their order.
    pub fn locate(&self, problems: &[Problem]) -> Vec<Location> {
        let given = self.source_text.given.as_ref();
        let given = given.and_then(|given| Some((given, Document::parse(&self.source_text).ok()?)));
        let mut cursor = Cursor::new(&self.source_text.text);
        let one = |problem: &Problem| {
            let cause = given
                .as_ref()
                .and_then(|(given, document)| given.cause(&problem.key, document.locate(&problem.key).1.is_none()));
            let span = problem.span.clone();
            if let Some(setting) = cause {
                let source = Source::new(setting.door.name(), &setting.shown());
                let position = source.position(span.start);
                return Location { source, span, position, is_setting: true };
            }
            let position = cursor.position(span.start);
            Location { source: self.source_text.clone(), span, position, is_setting: false }
        };
        problems.iter().map(one).collect()
    }

    /// The problems to show, and the number of further ones.
    pub fn shown(&self) -> (&[Problem], usize) {
        let count = self.problems.len().min(MOST_SHOWN);
        (&self.problems[..count], self.problems.len() - count)
    }

    fn plain(&self) -> String {
        let one = |(problem, place): (&Problem, Location)| {
            let help = if problem.help.is_empty() { String::new() } else { format!("\n  help: {}", problem.help) };
            let Location { source, position: (line, column), is_setting, .. } = place;
            if is_setting {
                return format!("{}: {problem}{help}", source.text);
            }
            format!("{}:{line}:{column}: {problem}{help}", source.name)
        };
        let (shown, further) = self.shown();
        let mut lines: Vec<String> = shown.iter().zip(self.locate(shown)).map(one).collect();
        if further > 0 {
            lines.push(format!("and {further} more problems"));
        }
        lines.join("\n")
    }
}

/// Why a scenario file could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The file cannot be opened or read.
    #[error("cannot read {}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error reported by the operating system.
        #[source]
        error: std::io::Error,
    },
    /// The file is HDF5, probably a result.
    #[error(
        "{0} is an HDF5 file, not a scenario. If it is a result, use `concordem report {0}`, `info`, or `resume`; `info --scenario` \
         prints its scenario",
        path.display()
    )]
    Hdf5 {
        /// The file.
        path: PathBuf,
    },
    /// The file is not UTF-8 text.
    #[error("{}:{line}: the line has bytes that are not UTF-8; save the file as UTF-8, in the menu \"Save as\" of the editor", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// First line with such bytes, counted from 1.
        line: usize,
    },
    /// The file is text in UTF-16.
    #[error("{} is text in UTF-16; save it as UTF-8, in the menu \"Save as\" of the editor", path.display())]
    Utf16 {
        /// The file.
        path: PathBuf,
    },
    /// A setting cannot be applied to the scenario.
    #[error("{0}")]
    Setting(String),
    /// The scenario has errors.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
}

/// Rendering with an excerpt of the text, by miette.
mod rendered {
    use super::{Problem, ProblemKind, ScenarioError};
    use miette::{Diagnostic, LabeledSpan, Severity, SourceCode};
    use std::fmt::Display;

    impl Diagnostic for Problem {
        fn severity(&self) -> Option<Severity> {
            Some(if self.kind == ProblemKind::Warning { Severity::Warning } else { Severity::Error })
        }
        fn help<'a>(&'a self) -> Option<Box<dyn Display + 'a>> {
            if self.help.is_empty() { None } else { Some(Box::new(&self.help)) }
        }
        fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
            Some(Box::new(std::iter::once(LabeledSpan::underline(self.span.clone()))))
        }
    }

    impl Diagnostic for ScenarioError {
        fn source_code(&self) -> Option<&dyn SourceCode> {
            Some(&self.source_text)
        }
        fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn Diagnostic> + 'a>> {
            Some(Box::new(self.problems.iter().map(|problem| problem as &dyn Diagnostic)))
        }
    }

    impl SourceCode for super::Source {
        fn read_span<'a>(
            &'a self,
            span: &miette::SourceSpan,
            before: usize,
            after: usize,
        ) -> Result<Box<dyn miette::SpanContents<'a> + 'a>, miette::MietteError> {
            let contents = self.text.read_span(span, before, after)?;
            Ok(Box::new(
                miette::MietteSpanContents::new_named(
                    self.name.to_string(),
                    contents.data(),
                    *contents.span(),
                    contents.line(),
                    contents.column(),
                    contents.line_count(),
                )
                .with_language("TOML"),
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines and columns are those of a count from the start, also at ends of lines, within characters, and backwards.
    #[test]
    fn positions_are_counted_from_the_start() {
        let text = "a = 1\nb = \"\u{fc}\u{20ac}\"\n\nc";
        let mut cursor = Cursor::new(text);
        for byte in (0..=text.len() + 2).chain([3, 0, 9]) {
            let end = (0..=byte.min(text.len())).rev().find(|end| text.is_char_boundary(*end)).unwrap();
            let lines: Vec<&str> = text[..end].split('\n').collect();
            let expected = (lines.len(), lines[lines.len() - 1].chars().count() + 1);
            assert_eq!(cursor.position(byte), expected, "{byte}");
            assert_eq!(Source::new("a", text).position(byte), expected, "{byte}");
        }
    }

    /// Any number of places take one pass over the text, whether they lie on many lines or on one.
    #[test]
    fn many_places_take_one_pass() {
        for text in ["x = [1],\n".repeat(1000), "[1, -1], ".repeat(1000)] {
            let mut cursor = Cursor::new(&text);
            for byte in (0..text.len()).step_by(9) {
                cursor.position(byte);
            }
            assert_eq!(cursor.passed, text.len() - 9);
        }
    }
}
