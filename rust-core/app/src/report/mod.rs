//! The report: one HTML page about one or more finished runs, or about a sweep.
//!
//! A page shows stress-strain curves, the properties of the specimen and published ones, pictures before and after, the materials in a section, the damaged bonds, emissions and
//! fragments, the energy balance, and the provenance of the numbers. It needs no other file and no network.

mod chart;
mod coverage;
mod cracks;
mod curves;
mod energy;
pub mod figures;
mod forces;
mod heat;
mod hopkinson;
mod html;
mod laboratory;
mod materials;
mod meaning;
mod phases;
mod pictures;
mod properties;
mod provenance;
mod recipe;
mod restitution;
mod rose;
mod samples;
mod signals;
mod size_effect;
mod sketch;
mod slices;
pub mod structure;
mod summary;
pub mod sweep;
#[cfg(test)]
mod tests;
mod triaxial;

use std::path::Path;

use crate::output::{OutputError, ResultFile, sealed};
use crate::provenance::{ENDED, PROGRAM, STOPPED, UNFINISHED};
pub(crate) use chart::Scale;
use concordem_scenario::schedule::Rounding;
use concordem_scenario::schema::Scenario;
pub(crate) use coverage::Coverage;
pub(crate) use cracks::base64;
use figures::only_rounding;
pub use figures::{CurveFigures, Given, ReferenceFigures, Sense};
pub(crate) use html::escape;
use html::{frame, number};
use laboratory::Test;
use meaning::Meaning;
pub(crate) use summary::properties_of_run;
pub use summary::{Property, RISES, properties, summary};

/// Name of the provenance entry with the size of rounding errors of the stress in one step, Pa.
pub(crate) const STRESS_ROUNDING: &str = "stress_rounding_pa";

/// Name of the provenance entry with the length that strains refer to, m.
pub(crate) const SPECIMEN_LENGTH: &str = "specimen_length_m";

/// Colors of the runs, distinguishable with red-green color blindness.
const RUN_COLORS: [&str; 6] = ["#1f6fb4", "#c8501e", "#3f8f5a", "#7d57a8", "#b08a00", "#4a5560"];

/// One result with the data for all sections.
struct Run<'a> {
    file: &'a ResultFile,
    name: String,
    title: String,
    /// Of all records of this result.
    strain: Vec<f64>,
    /// The curve from the start of the test on, also through the runs before.
    history: History,
    coverage: Coverage,
    /// The largest stress (Pa), if the run has nothing but rounding errors of stress, hence no figures and no results of a test.
    noise: Option<f64>,
    figures: Option<CurveFigures>,
    /// Standard test of the scenario; `None` for other loadings and unreadable scenarios.
    test: Option<Test>,
    /// What strain and stress are; as in a specimen with free sides if the scenario cannot be read.
    meaning: Meaning,
    /// What runs of the same material have in common, and the names of the materials.
    material: String,
    materials: String,
    /// The parameters of the bonds, without published values.
    bonds: ReferenceFigures,
    /// Gauges that the scenario samples.
    gauges: Vec<String>,
    /// Whether the scenario is one in the plane, of unit depth.
    is_plane: bool,
    /// Whether the scenario has bonds; so it is for one that cannot be read.
    is_bonded: bool,
    /// The scenario; `None` if it cannot be read.
    scenario: Option<Scenario>,
    /// Length that strains refer to, m, if the result has it.
    length: Option<f64>,
    /// Date on which the run ended, if the result has it.
    ended: Option<String>,
    /// Author of the scenario; may be empty.
    author: String,
    /// Of the result of an unfinished run: how far it is.
    unfinished: Option<String>,
    color: &'static str,
}

/// A curve of strain and stress, Pa.
struct History {
    strain: Vec<f64>,
    stress: Vec<f64>,
}

/// Writes the page about `inputs` to `out`, replacing an existing file.
///
/// # Errors
/// There is no input, a result cannot be read, or the page cannot be written.
pub fn write_report(inputs: &[ResultFile], out: &Path, reference: &ReferenceFigures) -> Result<(), OutputError> {
    sealed::write_text(out, &page(inputs, reference)?)
}

/// The page about `inputs` as text.
///
/// # Errors
/// There is no input, or a result cannot be read.
pub fn page(inputs: &[ResultFile], reference: &ReferenceFigures) -> Result<String, OutputError> {
    if inputs.is_empty() {
        return Err(OutputError::Report { problem: "no result file is given".into() });
    }
    let runs = inputs.iter().enumerate().map(|(k, file)| Run::new(file, k)).collect::<Result<Vec<_>, _>>()?;
    let body = [
        heading(&runs),
        properties::section(&runs, reference),
        laboratory::section(&runs)?,
        size_effect::section(&runs),
        curves::section(&runs, reference),
        triaxial::section(&runs)?,
        hopkinson::section(&runs)?,
        forces::section(&runs)?,
        heat::section(&runs)?,
        samples::section(&runs)?,
        sketch::section(&runs),
        materials::section(&runs)?,
        pictures::section(&runs),
        phases::section(&runs)?,
        slices::section(&runs)?,
        cracks::section(&runs)?,
        signals::section(&runs)?,
        energy::section(&runs)?,
        provenance::section(&runs)?,
    ]
    .concat();
    Ok(frame(&page_title(&runs), &body))
}

impl<'a> Run<'a> {
    fn new(file: &'a ResultFile, k: usize) -> Result<Self, OutputError> {
        let strain = file.samples("strain")?;
        let history = History { strain: file.history("strain")?, stress: file.history("stress")? };
        let provenance = file.provenance()?;
        let coverage = Coverage::of(&provenance);
        let name = file.path().file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let text = file.scenario()?;
        let scenario = Scenario::parse("scenario", &text).ok();
        let names =
            |scenario: &Scenario| -> Vec<String> { scenario.materials.iter().map(|m| m.name.clone()).collect() };
        let materials = scenario.as_ref().map(names).unwrap_or_default().join(", ");
        let gauges = scenario.as_ref().map(gauges_of).unwrap_or_default();
        let is_plane = scenario.as_ref().is_some_and(|scenario| scenario.dimension == 2);
        let is_bonded = scenario.as_ref().is_none_or(|scenario| scenario.bonds.is_some());
        let test = scenario.as_ref().and_then(Test::of);
        let meaning = scenario.as_ref().map_or(Meaning::Layers, Meaning::of);
        // Also of a scenario that this program cannot read.
        let table = toml::from_str::<toml::Table>(&text).unwrap_or_default();
        let [title, author] =
            ["title", "author"].map(|key| table.get(key).and_then(toml::Value::as_str).unwrap_or_default().to_owned());
        let figures = if file.has_series("gauge_strain") {
            CurveFigures::with_gauge(&history.strain, &file.history("gauge_strain")?, &history.stress)
        } else {
            CurveFigures::of(&history.strain, &history.stress)
        };
        // The peak may lie before the first record.
        let entry = |name: &str| provenance.iter().find(|(other, _)| other == name);
        let number = |name: &str| entry(name).and_then(|(_, value)| value.parse::<f64>().ok());
        let counts = file.series().iter().any(|series| series.name == "step");
        let steps = if counts { file.samples("step")?.last().copied().unwrap_or(0.0) as u64 } else { 0 };
        let rounding = Rounding { one_step: number(STRESS_ROUNDING).unwrap_or(0.0) }.after(steps);
        let noise = only_rounding(&history.stress, rounding);
        let is_known = coverage != Coverage::Unknown && noise.is_none();
        let (figures, test) = if is_known { (figures, test) } else { (None, None) };
        let length = number(SPECIMEN_LENGTH);
        let ended = entry(ENDED).map(|(_, date)| date.clone());
        let reason = entry(STOPPED).map(|(_, reason)| reason.clone());
        let unfinished = reason.filter(|reason| reason.starts_with(UNFINISHED));
        let color = RUN_COLORS[k % RUN_COLORS.len()];
        let (material, bonds) = (recipe::material(&text), bonds_of(scenario.as_ref()));
        Ok(Self {
            file,
            name,
            title,
            strain,
            history,
            coverage,
            noise,
            figures,
            test,
            meaning,
            material,
            materials,
            bonds,
            gauges,
            is_plane,
            is_bonded,
            scenario,
            length,
            ended,
            author,
            unfinished,
            color,
        })
    }

    /// Why the run has no modulus and no strength, if its stress is nothing but rounding errors.
    fn note_on_noise(&self) -> Option<String> {
        let largest = self.noise? / 1e6;
        Some(format!("no more than {} MPa, which are rounding errors: no modulus, no strength", number(largest)))
    }

    /// The slope at the beginning of the curve, Pa, where it is a modulus.
    fn modulus(&self) -> Option<f64> {
        self.meaning.slope()?;
        self.figures?.modulus
    }

    /// The last value of a series; `None` if the series is missing or empty.
    fn last(&self, series: &str) -> Result<Option<f64>, OutputError> {
        if self.file.has_series(series) { Ok(self.file.samples(series)?.last().copied()) } else { Ok(None) }
    }

    fn label(&self) -> String {
        if self.title.is_empty() { self.name.clone() } else { format!("{} ({})", self.title, self.name) }
    }
}

/// Names of the gauges between two sets.
fn gauges_of(scenario: &Scenario) -> Vec<String> {
    let gauges = scenario.samples.iter().filter(|sample| sample.operator.name() == "gauge");
    gauges.map(|sample| sample.name().to_owned()).collect()
}

/// The parameters of the bonds of the first material, without published values.
pub(crate) fn bonds_of(scenario: Option<&Scenario>) -> ReferenceFigures {
    let cpm = scenario.and_then(|scenario| scenario.materials.first()?.cpm.as_ref());
    ReferenceFigures::none(cpm.map(|cpm| cpm.young.si()), cpm.map(|cpm| cpm.crack_onset_strain.si()))
}

fn page_title(runs: &[Run]) -> String {
    let mut titles: Vec<&str> = runs.iter().map(|run| run.title.as_str()).filter(|title| !title.is_empty()).collect();
    titles.dedup();
    if titles.is_empty() {
        let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
        names.join(" · ")
    } else {
        titles.join(" · ")
    }
}

/// The authors of the scenarios, each once.
fn authors(runs: &[Run]) -> String {
    let mut names: Vec<&str> = runs.iter().map(|run| run.author.as_str()).filter(|name| !name.is_empty()).collect();
    names.dedup();
    if names.is_empty() { String::new() } else { format!("; by {}", escape(&names.join(", "))) }
}

fn heading(runs: &[Run]) -> String {
    let file = |run: &Run| {
        let ended = run.ended.as_ref().map_or_else(String::new, |date| format!(" of {date} UTC"));
        format!("<code>{}</code>{ended}", escape(&run.name))
    };
    let files: Vec<String> = runs.iter().map(file).collect();
    let note = |run: &Run| Some(format!("<p>Records of {}: {}.</p>\n", escape(&run.name), run.coverage.note()?));
    let unfinished =
        |run: &Run| Some(format!("<p><b>{}</b> is {}.</p>\n", escape(&run.name), escape(run.unfinished.as_ref()?)));
    let noise = |run: &Run| Some(format!("<p>Stress of {}: {}.</p>\n", escape(&run.name), run.note_on_noise()?));
    format!(
        "<h1>{}</h1>\n<p class=\"quiet\">Results {}, computed by {PROGRAM}{}. Tension is positive.</p>\n{}",
        escape(&page_title(runs)),
        files.join(", "),
        authors(runs),
        runs.iter().flat_map(|run| [unfinished(run), note(run), noise(run)]).flatten().collect::<String>(),
    )
}
