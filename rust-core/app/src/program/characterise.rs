//! `concordem characterise`: structure of a packing.

use std::path::{Path, PathBuf};

use super::drive::check_page_name;
use super::meter::Meter;
use super::readable::count;
use super::settings::Settings;
use super::{Console, Facts, Failure, Work};
use crate::characterise::{Body, CharacteriseError, Characteristics, Choice, characterise};
use crate::output::{OutputError, sealed};
use crate::report::structure;
use concordem_packing::Shape;
use concordem_packing::cooker::BOUNDARY_DEPTH;
use concordem_scenario::assembly::solid;
use concordem_scenario::schema;

/// Arguments of `concordem characterise`.
#[derive(Debug, clap::Args)]
pub(super) struct CharacteriseArguments {
    /// Packing: text with the columns x y z r in meters, HDF5 sphere pack, result, or scenario, whose packing is made
    file: PathBuf,
    /// Web page to write; by default FILE.structure.html. The JSON file has the same name with .json
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite existing files
    #[arg(long, short)]
    force: bool,
    /// Links are pairs with center distance up to this ratio times the sum of the radii; by default the bonds of a result or scenario,
    /// otherwise touching spheres
    #[arg(long, value_name = "RATIO", conflicts_with = "coordination")]
    interaction_ratio: Option<f64>,
    /// Links are the nearest pairs, this many per sphere
    #[arg(long, value_name = "NUMBER")]
    coordination: Option<f64>,
    /// Shape that bounds the spheres, as in a scenario: '{ kind = "cylinder", radius = "5 mm", height = "20 mm" }'; by default that of
    /// the scenario, otherwise the convex hull of the spheres
    #[arg(long, value_name = "TABLE")]
    shape: Option<String>,
    /// Edges of the periodic cell of a text file: 20 mm,20 mm,20 mm
    #[arg(long, value_name = "X,Y,Z", value_parser = edges)]
    cell: Option<[f64; 3]>,
    /// Spheres with their centers nearer to the surface than this many mean radii belong to the boundary
    #[arg(long, value_name = "NUMBER", default_value_t = BOUNDARY_DEPTH)]
    boundary: f64,
    #[command(flatten)]
    settings: Settings,
    #[command(flatten)]
    work: Work,
}

fn edges(text: &str) -> Result<[f64; 3], String> {
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    let lengths: Result<Vec<f64>, String> = parts
        .iter()
        .map(|part| match part.parse() {
            Ok(value) => Ok(value),
            Err(_) => schema::quantity::Length::parse(part).map(schema::Quantity::si).map_err(|e| e.to_string()),
        })
        .collect();
    match lengths?[..] {
        [x, y, z] if [x, y, z].iter().all(|edge: &f64| *edge > 0.0 && edge.is_finite()) => Ok([x, y, z]),
        _ => Err("write three positive lengths, such as 20 mm,20 mm,40 mm".into()),
    }
}

impl From<CharacteriseError> for Failure {
    fn from(error: CharacteriseError) -> Self {
        match error {
            CharacteriseError::Scenario(error) => error.into(),
            CharacteriseError::Assembly(error) => Self::Assembly(error),
            CharacteriseError::Output(error) => error.into(),
            CharacteriseError::Operator(error) => error.into(),
            CharacteriseError::File { path, problem } => {
                Self::File { path, action: "read", error: std::io::Error::other(problem) }
            }
            other => Self::Usage(other.to_string()),
        }
    }
}

pub(super) fn run(arguments: &CharacteriseArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    if let Some(path) = &arguments.output {
        check_page_name("--output ", path)?;
    }
    let page = arguments.output.clone().unwrap_or_else(|| arguments.file.with_extension("structure.html"));
    let page = sealed::target(&page)?;
    let json = page.with_extension("json");
    for path in [&page, &json] {
        if path.exists() && !arguments.force {
            return Err(OutputError::Exists { path: path.clone() }.into());
        }
    }
    let choice = Choice {
        interaction_ratio: arguments.interaction_ratio,
        coordination: arguments.coordination,
        shape: arguments.shape.as_deref().map(read_shape).transpose()?,
        cell: arguments.cell,
        settings: arguments.settings.list().to_vec(),
    };
    let display = console.display(&arguments.work);
    let found = arguments.work.install(|| {
        let meter = Meter::new(display);
        let body = Body::read(&arguments.file, &choice, &mut |stage, share| meter.stage(stage, share))
            .map_err(|error| failed(&arguments.file, error))?;
        let found = characterise(&body, arguments.boundary)?;
        meter.finish();
        Ok(found)
    })?;
    let text = serde_json::to_string_pretty(&found.json()).map_err(|error| Failure::Usage(error.to_string()))?;
    sealed::write_text(&json, &(text + "\n"))?;
    sealed::write_text(&page, &structure::page(&found))?;
    console.print(&format!("{}\n{}\n{}", page.display(), json.display(), facts(&found)))
}

/// A failure with its position in the scenario, if the file is one.
fn failed(path: &Path, error: CharacteriseError) -> Failure {
    match (error, schema::Scenario::read(path)) {
        (CharacteriseError::Assembly(error), Ok(scenario)) => Failure::of_assembly(&scenario, error),
        (error, _) => error.into(),
    }
}

fn read_shape(text: &str) -> Result<Shape, Failure> {
    #[derive(serde::Deserialize)]
    struct Table {
        shape: schema::Shape,
    }
    let wrong = |message: &str| Failure::Usage(format!("--shape is not a valid shape: {message}"));
    let table: Table = toml::from_str(&format!("shape = {text}\n")).map_err(|error| wrong(error.message()))?;
    if table.shape.keep().is_some() {
        return Err(wrong("`keep` has no effect here; remove it"));
    }
    Ok(solid(&table.shape, Path::new("")).map_err(|error| wrong(&error.to_string()))?.0)
}

/// A value with its unit, or a dash.
fn facts(found: &Characteristics) -> Facts {
    let mut facts = Facts::default();
    let or_dash = |value: f64, digits: usize| {
        if value.is_finite() { format!("{value:.digits$}") } else { "–".to_owned() }
    };
    let coordination = &found.network.coordination;
    facts.add("spheres", count(found.spheres));
    facts.add("links", format!("{}, {}", count(found.network.links), found.links.text()));
    facts.add("links per sphere inside", or_dash(coordination.inside, 3));
    if found.boundary_depth.is_some() {
        facts.add("at the boundary", or_dash(coordination.at_boundary, 3));
    }
    let density = &found.density;
    for (name, value) in [("cell", density.cell), ("hull", density.hull), ("shape", density.shape)] {
        if let Some([_, fraction]) = value {
            facts.add(&format!("solid fraction of the {name}"), format!("{fraction:.4}"));
        }
    }
    if let Some(fraction) = density.effective {
        facts.add("solid fraction inside (power cells)", format!("{fraction:.4}"));
    }
    let sizes = &found.sizes;
    facts.add("mean radius", format!("{:.4e} m", sizes.mean));
    facts.add("dispersion of radii", format!("{:.4}", sizes.dispersion));
    if let Some([mean, deviation, ..]) = found.network.length {
        facts.add("link length over sum of radii", format!("{mean:.4} ± {deviation:.4}"));
    }
    let [mean, largest] = found.network.overlap;
    facts.add("overlap over sum of radii", format!("mean {mean:.2e}, largest {largest:.2e}"));
    let directions = &found.network.orientations;
    if directions.links > 0 {
        let (e, floor) = (directions.deviation(), directions.floor);
        facts.add("isotropy e", format!("{e:.3e}, in percent² {:.5}", 1e4 * e));
        facts.add(
            "e less that of equal solid angles",
            format!("{:.3e}, in percent² {:.5}", e - floor, 1e4 * (e - floor)),
        );
        let ratio = directions.deviation_from_isotropy() / directions.noise();
        facts.add("over that of independent isotropic links", format!("{ratio:.2}"));
    }
    facts
}
