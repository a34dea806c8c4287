//! What is wrong with a line that is not TOML, and how to write it: mistakes of typing, and of text that was pasted from a document.

use std::ops::Range;

use super::error::{Problem, ProblemKind};

/// The problem that a parser reports for a place in the line with index `line`.
pub(super) fn problem(lines: &[&str], line: usize, span: Range<usize>, message: &str) -> Problem {
    let text = lines.get(line).copied().unwrap_or("");
    Problem {
        kind: ProblemKind::Syntax,
        key: String::new(),
        value: Some(text.trim().to_owned()).filter(|text| !text.is_empty()),
        span,
        message: format!("not valid TOML: {message}"),
        help: help(lines, line, text, message),
    }
}

/// How to write a line.
fn help(lines: &[&str], line: usize, text: &str, message: &str) -> String {
    if message.contains("duplicate key") {
        return of_duplicate(lines, line, text);
    }
    if let Some(help) = foreign_characters(without_comment(text)) {
        return help;
    }
    let content = without_comment(text).trim();
    let value = content.split_once('=').map(|(_, value)| value.trim());
    let starts_as_number =
        |value: &str| value.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+' || c == '.');
    match value {
        None if content.split_whitespace().filter(|word| word.parse::<f64>().is_ok()).count() > 2 => {
            "this is a row of numbers: name a file of spheres in a scenario, [packing] with kind = \"file\" and path = \"...\"".to_owned()
        }
        _ if content.contains('\\') => {
            let value = value.unwrap_or(content).trim_matches('"');
            format!("a backslash begins an escape; write a path with / or in single quotes: '{value}'")
        }
        _ if message.contains("string") && message.contains("expected `") => {
            "close the string with a quotation mark".to_owned()
        }
        _ if content.ends_with(';') => {
            format!("lines end without a semicolon: {}", content.trim_end_matches(';').trim_end())
        }
        None if content.contains(':') && !content.starts_with('[') => {
            let (key, value) = content.split_once(':').unwrap_or((content, ""));
            format!("write = between key and value: {} = {}", key.trim(), value.trim())
        }
        Some(value) if starts_as_number(value) && value.contains(',') && !value.contains('[') => {
            "write decimals with a point: 1.5".to_owned()
        }
        Some(value) if starts_as_number(value) && value.contains(|c: char| c.is_alphabetic() || c == '%') => {
            format!("put a number with a unit in quotes: \"{value}\"")
        }
        Some(value) if ["true", "false"].iter().any(|word| value.eq_ignore_ascii_case(word)) => {
            format!("write {} in lower case", value.to_lowercase())
        }
        Some(value) if ["yes", "on"].iter().any(|word| value.eq_ignore_ascii_case(word)) => {
            "write true for yes".to_owned()
        }
        Some(value) if ["no", "off"].iter().any(|word| value.eq_ignore_ascii_case(word)) => {
            "write false for no".to_owned()
        }
        Some(value) if value.starts_with(|c: char| c.is_alphabetic()) => {
            format!("put words in quotes: \"{value}\"; only true and false are written without")
        }
        _ => "a scenario is a TOML file: lines `key = value` below headers `[table]`; see https://toml.io".to_owned(),
    }
}

/// A line without its comment.
fn without_comment(text: &str) -> &str {
    let mut quote = None;
    for (at, c) in text.char_indices() {
        match (quote, c) {
            (None, '#') => return &text[..at],
            (None, '"' | '\'') => quote = Some(c),
            (Some(open), c) if open == c => quote = None,
            _ => {}
        }
    }
    text
}

/// Where the key or table stood before.
fn of_duplicate(lines: &[&str], line: usize, text: &str) -> String {
    let content = without_comment(text).trim();
    let lines = || lines.iter().take(line).enumerate().map(|(at, line)| (at + 1, without_comment(line).trim()));
    if let Some(name) = content.strip_prefix("[[").and_then(|rest| rest.strip_suffix("]]")) {
        let inner = format!("[{}.", name.trim());
        let single = format!("[{}]", name.trim());
        if let Some((first, other)) = lines().find(|(_, line)| line.starts_with(&inner) || *line == single) {
            return format!(
                "line {first} has {other}, which makes `{name}` a single table: move {other} below {content}"
            );
        }
    }
    let first = if content.starts_with('[') {
        lines().find(|(_, line)| *line == content).map(|(first, _)| first)
    } else {
        // The key in the same table.
        let key = |line: &str| line.split('=').next().map(|key| key.trim().to_owned());
        let wanted = key(content);
        let mut first = None;
        for (at, line) in lines() {
            if line.starts_with('[') {
                first = None;
            } else if line.contains('=') && key(line) == wanted {
                first = Some(at);
            }
        }
        first
    };
    let place = first.map(|first| format!("line {first} has it, too; ")).unwrap_or_default();
    let list = if content.starts_with('[') { "; write the tables of a list as [[name]]" } else { "" };
    format!("{place}keep one of the two{list}")
}

/// Characters of documents that look like those of the keyboard, and what to write.
const LOOK_ALIKE: [(&[char], &str, &str); 4] = [
    (&['“', '”', '„', '«', '»', '″'], "a typographic quotation mark", "\""),
    (&['‘', '’', '‚', '′'], "a typographic quotation mark", "'"),
    (&['−', '–', '—', '‐', '‑', '‒'], "not the minus of the keyboard", "-"),
    (&['\u{a0}', '\u{2007}', '\u{202f}', '\u{2009}', '\u{2003}', '\u{2002}'], "a space of a document", " "),
];

/// Letters of other alphabets that look like Latin ones.
const LETTERS: [(char, char); 24] = [
    ('а', 'a'),
    ('е', 'e'),
    ('о', 'o'),
    ('р', 'p'),
    ('с', 'c'),
    ('х', 'x'),
    ('у', 'y'),
    ('і', 'i'),
    ('ѕ', 's'),
    ('ј', 'j'),
    ('м', 'm'),
    ('к', 'k'),
    ('т', 't'),
    ('н', 'h'),
    ('в', 'b'),
    ('А', 'A'),
    ('В', 'B'),
    ('Е', 'E'),
    ('М', 'M'),
    ('Р', 'P'),
    ('С', 'C'),
    ('ο', 'o'),
    ('α', 'a'),
    ('ν', 'v'),
];

/// A text with the characters of the keyboard in place of those that look like them; `None` if it has none.
pub(crate) fn on_keyboard(text: &str) -> Option<(char, &'static str, String)> {
    let typed = |c: char| {
        let sign = LOOK_ALIKE.iter().find(|(alike, ..)| alike.contains(&c)).map(|(_, what, sign)| (*what, *sign));
        sign.map(|(what, sign)| (what, sign.to_owned())).or_else(|| {
            let letter = LETTERS.iter().find(|(other, _)| *other == c)?;
            Some(("a letter of another alphabet", letter.1.to_string()))
        })
    };
    let (first, what) = text.chars().find_map(|c| typed(c).map(|(what, _)| (c, what)))?;
    let plain = text.chars().map(|c| typed(c).map_or_else(|| c.to_string(), |(_, sign)| sign)).collect();
    Some((first, what, plain))
}

/// What to write in place of characters of a document.
fn foreign_characters(text: &str) -> Option<String> {
    let (first, what, plain) = on_keyboard(text)?;
    Some(format!("`{first}` (U+{:04X}) is {what}; write: {}", u32::from(first), plain.trim()))
}
