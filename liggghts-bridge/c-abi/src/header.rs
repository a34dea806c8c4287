//! The C header of a bridge: generated from its Rust sources by cbindgen, plus a `static_assert` for every field.
//!
//! The header is committed, so compiling a shim does not need cbindgen. A test in each bridge calls [`Header::check`], which fails
//! if the header is out of date.

use std::fmt::Write;
use std::path::{Path, PathBuf};

pub use type_layout::{Field, TypeLayout, TypeLayoutInfo};

/// Environment variable that makes [`Header::check`] write the header instead of comparing it.
pub const WRITE: &str = "CONCORDEM_WRITE_HEADER";

/// Spelling of Rust field names in C++.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldNames {
    /// Unchanged.
    Snake,
    /// `shear_modulus` becomes `shearModulus`.
    Camel,
}

/// A header to generate.
#[derive(Debug)]
pub struct Header<'a> {
    /// Path of the committed header.
    pub path: &'a Path,
    /// Rust sources whose `extern "C"` functions and `repr(C)` types it declares.
    pub sources: &'a [PathBuf],
    /// Comment at the top.
    pub comment: &'a str,
    /// Spelling of field names.
    pub fields: FieldNames,
    /// C names of types and constants that do not get the prefix `Concordem`.
    pub names: &'a [(&'a str, &'a str)],
    /// Layouts of all `repr(C)` structures in the sources.
    pub layouts: &'a [TypeLayoutInfo],
}

fn camel(name: &str) -> String {
    let mut upper = false;
    name.chars()
        .filter_map(|c| {
            let keep = c != '_';
            let c = if upper { c.to_ascii_uppercase() } else { c };
            upper = !keep;
            keep.then_some(c)
        })
        .collect()
}

impl Header<'_> {
    fn text(&self) -> String {
        let mut config = cbindgen::Config {
            language: cbindgen::Language::Cxx,
            header: Some(self.comment.to_owned()),
            pragma_once: true,
            no_includes: true,
            sys_includes: vec!["stddef.h".into(), "stdint.h".into()],
            usize_is_size_t: true,
            line_length: 132,
            tab_width: 2,
            documentation_style: cbindgen::DocumentationStyle::Cxx,
            ..cbindgen::Config::default()
        };
        config.export.prefix = Some("Concordem".into());
        config.export.renaming_overrides_prefixing = true;
        config.export.rename = self.names.iter().map(|&(from, to)| (from.to_owned(), to.to_owned())).collect();
        config.enumeration.rename_variants = cbindgen::RenameRule::None;
        if self.fields == FieldNames::Camel {
            config.structure.rename_fields = cbindgen::RenameRule::CamelCase;
        }
        let mut builder = cbindgen::Builder::new().with_config(config);
        for source in self.sources {
            builder = builder.with_src(source);
        }
        let mut made = Vec::new();
        builder.generate().expect("cbindgen generates a header").write(&mut made);
        let mut text = String::from_utf8(made).expect("the header is UTF-8");
        text.push_str("\n// Layout of the structures in Rust.\n");
        for layout in self.layouts {
            self.assert_layout(layout, &mut text);
        }
        let defined = text.lines().filter(|line| line.starts_with("struct ") && line.ends_with('{')).count();
        assert!(
            defined == self.layouts.len(),
            "the header defines {defined} structures, but `layouts` has {}; list the layouts of all",
            self.layouts.len()
        );
        text.push('\n');
        let hash = crate::header_hash(text.as_bytes());
        writeln!(text, "#define CONCORDEM_HEADER_HASH UINT64_C({hash:#018x})")
            .expect("writing to a string cannot fail");
        assert!(crate::header_hash(text.as_bytes()) == hash, "the hash must not depend on the line that defines it");
        text
    }

    fn assert_layout(&self, layout: &TypeLayoutInfo, text: &mut String) {
        let renamed = self.names.iter().find(|(from, _)| *from == layout.name);
        let name = renamed.map_or_else(|| format!("Concordem{}", layout.name), |(_, to)| (*to).to_owned());
        let mut offset = 0;
        for field in &layout.fields {
            let size = match field {
                Field::Padding { size } => size,
                Field::Field { name: field, size, .. } => {
                    let field = if self.fields == FieldNames::Camel { camel(field) } else { field.to_string() };
                    writeln!(
                        text,
                        "static_assert(offsetof({name}, {field}) == {offset} && sizeof({name}::{field}) == {size}, \"{name}::{field}\");"
                    )
                    .expect("writing to a string cannot fail");
                    size
                }
            };
            offset += size;
        }
        let TypeLayoutInfo { size, alignment, .. } = layout;
        writeln!(text, "static_assert(sizeof({name}) == {size} && alignof({name}) == {alignment}, \"{name}\");")
            .expect("writing to a string cannot fail");
    }

    /// Compare the committed header with the sources, or write it if [`WRITE`] is set.
    ///
    /// # Panics
    /// If the header is out of date or cannot be read or written.
    pub fn check(&self) {
        let wanted = self.text();
        if std::env::var_os(WRITE).is_some() {
            std::fs::write(self.path, wanted).expect("the header can be written");
            return;
        }
        let found = std::fs::read_to_string(self.path).expect("the header can be read");
        assert!(
            found == wanted,
            "{} is out of date; regenerate it with {WRITE}=1 cargo test -p <this crate> c_header",
            self.path.display()
        );
    }
}
