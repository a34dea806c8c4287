//! Scripts in Python: templates with marks such as `@DATA@`, which become literals.

use std::ffi::OsStr;
use std::fmt::Write as _;

/// The template with `values` in place of their marks. Everything happens in one pass: a value may look like a mark.
pub(super) fn filled(template: &str, values: &[(&str, String)]) -> String {
    let mut script = String::with_capacity(template.len());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once('@') {
        script += before;
        let found = values.iter().find_map(|(name, value)| Some((value, after.strip_prefix(name)?.strip_prefix('@')?)));
        rest = if let Some((value, after)) = found {
            script += value;
            after
        } else {
            script.push('@');
            after
        };
    }
    script + rest
}

/// A literal of Python for a name of a file. Bytes that are not UTF-8 become what Python makes of them.
pub(super) fn literal(name: &OsStr) -> String {
    let mut text = String::from("\"");
    for chunk in name.as_encoded_bytes().utf8_chunks() {
        for character in chunk.valid().chars() {
            match character {
                '"' | '\\' => text.extend(['\\', character]),
                _ if character.is_ascii_graphic() || character == ' ' || character.is_alphanumeric() => {
                    text.push(character);
                }
                _ => _ = write!(text, "\\U{:08x}", u32::from(character)),
            }
        }
        for byte in chunk.invalid() {
            let _ = write!(text, "\\udc{byte:02x}");
        }
    }
    text.push('"');
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_become_values_once() {
        let values = [("A", "@B@".to_owned()), ("B", "b".to_owned())];
        assert_eq!(filled("@A@ @B@ @C@ @ @A", &values), "@B@ b @C@ @ @A");
    }

    #[test]
    fn names_become_literals() {
        assert_eq!(literal(OsStr::new("a b-é.h5")), "\"a b-é.h5\"");
        assert_eq!(literal(OsStr::new("\"); f(\"\\\n\u{202e}")), r#""\"); f(\"\\\U0000000a\U0000202e""#);
        #[cfg(unix)]
        {
            use std::os::unix::ffi::OsStrExt as _;
            assert_eq!(literal(OsStr::from_bytes(b"a\xffb")), r#""a\udcffb""#);
        }
    }
}
