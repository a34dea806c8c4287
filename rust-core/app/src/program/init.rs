//! `concordem init`: write a template.

use std::path::{Path, PathBuf};

use super::{Console, Facts, Failure, shell};
use crate::output::sealed::{write_new_text, write_text};
use concordem_scenario::schema::{OTHER_NAMES, SWEEPS, TEMPLATES, Template, template};

/// Arguments of `concordem init`.
#[derive(Debug, clap::Args)]
pub(super) struct InitArguments {
    /// Template to write; by default, list the templates
    #[arg(long, short, value_name = "NAME", value_parser = names())]
    template: Option<String>,
    /// File or existing folder to write to; by default NAME.toml
    #[arg(requires = "template")]
    path: Option<PathBuf>,
    /// Also write the JSON Schema to concordem.schema.json beside the template, whose first line then names it; editors (Even Better
    /// TOML, Taplo) complete and check keys with it
    #[arg(long, requires = "template")]
    schema: bool,
    /// Overwrite an existing file
    #[arg(long, short)]
    force: bool,
}

/// Name of the schema beside scenarios.
const SCHEMA: &str = "concordem.schema.json";

fn all() -> impl Iterator<Item = &'static Template> {
    TEMPLATES.iter().chain(SWEEPS.iter().map(|(sweep, _)| sweep))
}

fn names() -> clap::builder::PossibleValuesParser {
    clap::builder::PossibleValuesParser::new(all().map(|template| {
        let others = OTHER_NAMES.iter().filter(|(_, name)| *name == template.name).map(|(other, _)| *other);
        clap::builder::PossibleValue::new(template.name).help(template.description).aliases(others)
    }))
}

pub(super) fn init(arguments: &InitArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let Some(template) = arguments.template.as_deref().and_then(template) else {
        let mut templates = Facts::default();
        for template in all() {
            templates.add(template.name, template.description);
        }
        return console.print(&format!("Templates for `concordem init --template NAME`:\n{templates}"));
    };
    let path = target(arguments.path.as_deref(), template.name);
    let schema = path.with_file_name(SCHEMA);
    let swept = swept(template);
    if arguments.schema && swept.is_none() {
        write_text(&schema, &format!("{:#}\n", concordem_scenario::schema::schema()))?;
    }
    write(&path, template, arguments.force)?;
    if let Some(swept) = swept {
        // The sweep needs its scenario in the same folder; an existing file is kept.
        let beside = path.with_file_name(format!("{swept}.toml"));
        if let Some(scenario) = TEMPLATES.iter().find(|template| template.name == swept).filter(|_| !beside.exists()) {
            write(&beside, scenario, false)?;
        }
        let (file, beside) = (path.display(), beside.display());
        console.tell(&format!("wrote {file} and {beside}; next: concordem sweep {}", shell::argument(&path)));
    } else {
        console.tell(&format!("wrote {}; next: concordem check {}", path.display(), shell::argument(&path)));
    }
    Ok(())
}

/// Name of the scenario of a template that is a sweep.
fn swept(template: &Template) -> Option<&'static str> {
    SWEEPS.iter().find(|(sweep, _)| sweep.name == template.name).map(|(_, scenario)| *scenario)
}

/// Writes a template. If the schema lies beside it, its first line names the schema.
fn write(path: &Path, template: &Template, force: bool) -> Result<(), Failure> {
    let named = swept(template).is_none() && path.with_file_name(SCHEMA).exists();
    let head = if named { format!("#:schema ./{SCHEMA}\n") } else { String::new() };
    let text = head + template.text;
    Ok(if force { write_text(path, &text) } else { write_new_text(path, &text) }?)
}

/// Path to write: the given file, or the name of the template in the given folder.
fn target(path: Option<&Path>, name: &str) -> PathBuf {
    let file = format!("{name}.toml");
    match path {
        None => PathBuf::from(file),
        Some(path) if path.is_dir() => path.join(file),
        Some(path) if path.extension().is_none() => path.with_extension("toml"),
        Some(path) => path.to_owned(),
    }
}
