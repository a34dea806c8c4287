//! Integers between 2^63 and 2^64, such as seeds, in texts that are edited as TOML.
//!
//! Scenarios may have them, but the crates that edit TOML have none above 2^63 - 1. For these crates each such integer is a string, which
//! holds it as written between two marks.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Begins and ends the string of an integer. Of the private use area of Unicode: no text has it.
const MARK: char = '\u{e0d3}';

/// The text with strings in place of large integers. A text that is not TOML stays as it is.
pub fn protect(text: &str) -> Cow<'_, str> {
    let Ok(root) = DeTable::parse(text) else { return Cow::Borrowed(text) };
    let mut found = Vec::new();
    root.get_ref().values().for_each(|value| collect(value, &mut found));
    if found.is_empty() {
        return Cow::Borrowed(text);
    }
    found.sort_by_key(|span| span.start);
    let (mut protected, mut end) = (String::with_capacity(text.len()), 0);
    for span in found {
        protected += &text[end..span.start];
        let _ = write!(protected, "\"{MARK}{}{MARK}\"", &text[span.clone()]);
        end = span.end;
    }
    protected += &text[end..];
    Cow::Owned(protected)
}

/// The text with the integers that [`protect`] has replaced.
pub fn restore(text: &str) -> String {
    text.replace(&format!("\"{MARK}"), "").replace(&format!("{MARK}\""), "")
}

/// A value with strings in place of large integers.
pub fn protect_value(value: &str) -> String {
    const KEY: &str = "value = ";
    let text = format!("{KEY}{value}");
    protect(&text)[KEY.len()..].to_owned()
}

fn collect(value: &Spanned<DeValue<'_>>, found: &mut Vec<Range<usize>>) {
    match value.get_ref() {
        DeValue::Integer(integer) => {
            let (digits, radix) = (integer.as_str(), integer.radix());
            if i64::from_str_radix(digits, radix).is_err() && u64::from_str_radix(digits, radix).is_ok() {
                found.push(value.span());
            }
        }
        DeValue::Array(values) => values.iter().for_each(|value| collect(value, found)),
        DeValue::Table(table) => table.values().for_each(|value| collect(value, found)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_integers_pass_through_a_crate_that_has_none() {
        let text = "a = 18_446_744_073_709_551_615 # most\nb = [1, { c = 0xffffffffffffffff }]\n[[d]]\ne = 9223372036854775808\nf = -3\n\
                    g = \"18446744073709551615\"\n";
        assert!(text.parse::<toml_edit::DocumentMut>().is_err());
        let document: toml_edit::DocumentMut = protect(text).parse().expect("TOML");
        assert_eq!(restore(&document.to_string()), text);
        assert_eq!(protect("a = 9223372036854775807"), "a = 9223372036854775807");
        assert_eq!(protect("a = 18446744073709551616"), "a = 18446744073709551616", "no number of 64 bits");
        assert_eq!(protect("no toml"), "no toml");
        assert_eq!(restore(&protect_value("9223372036854775808")), "9223372036854775808");
    }
}
