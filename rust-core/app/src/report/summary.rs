//! The properties of a specimen as text, for the end of a run and `concordem info`.

use super::figures::{CurveFigures, RISING, Sense, only_rounding, still_rises};
use super::html::{number, percent};
use super::laboratory::{self, Test};
use super::meaning::Meaning;
use super::{Coverage, History, OutputError, ResultFile, Run};
use concordem_scenario::schema::Scenario;

/// A symbol or a text of the page without HTML.
fn plain(text: &str) -> String {
    text.replace("<sub>", "_").replace("</sub>", "")
}

/// A property of the specimen.
#[derive(Debug, Clone, PartialEq)]
pub struct Property {
    /// Symbol, such as "f_t".
    pub symbol: String,
    /// Value and unit, with a note.
    pub value: String,
}

/// E, strengths, and fracture energies of a result, as far as its test defines them.
///
/// # Errors
/// The result cannot be read.
pub fn summary(result: &ResultFile) -> Result<Vec<Property>, OutputError> {
    let run = Run::new(result, 0)?;
    let mut properties = Vec::new();
    let mut add = |symbol: &str, value: String| {
        // Symbols of the page are HTML.
        properties.push(Property { symbol: plain(symbol), value });
    };
    let free = run.meaning.is_uniaxial_stress();
    if let Some(figures) = run.figures.filter(|_| run.test.is_some_and(Test::is_axial)) {
        // First the one that is free of the rigid end layers.
        if let Some(modulus) = figures.gauge_modulus.filter(|_| free) {
            add("E", format!("{} GPa, in the middle half", number(modulus * 1e-9)));
        }
        if let Some(modulus) = figures.modulus.filter(|_| free) {
            let rigid = if run.meaning == Meaning::Layers { " with the rigid end layers" } else { "" };
            let share = percent(super::figures::FITTED_SHARE);
            add("E", format!("{} GPa, between the ends{rigid}, up to {share} of the peak", number(modulus * 1e-9)));
        }
        // A specimen that a membrane or walls enclose has neither E nor f_t or f_c.
        let (symbol, name) = run.meaning.largest(figures.sense == Sense::Tension);
        let name = if free { String::new() } else { format!(", {name}") };
        let note = if figures.rises { RISING } else { "" };
        let strain = number(figures.peak_strain * 1e3);
        add(symbol, format!("{} MPa at a strain of {strain} ‰{name}{note}", number(figures.peak_stress.abs() * 1e-6)));
    }
    for (symbol, name, unit, value) in laboratory::results(&run)? {
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        add(symbol, format!("{}{unit}, {}", number(value), plain(&name)));
    }
    if let Some(note) = run.note_on_noise() {
        add("stress", note);
    }
    if let Some(note) = run.coverage.note() {
        add("records", note);
    }
    Ok(properties)
}

/// Name of the property that is 1 if the stress still rises at the end of the run: then its largest value is no strength; else 0.
pub const RISES: &str = "rises_at_end";

/// Properties of the specimen of a result, by symbol, in SI units, as a sweep names them. Empty without a test that defines some.
///
/// # Errors
/// The result cannot be read.
pub fn properties(result: &ResultFile) -> Result<Vec<(String, f64)>, OutputError> {
    let run = Run::new(result, 0)?;
    let Ok(scenario) = Scenario::parse("scenario", &result.scenario()?) else { return Ok(Vec::new()) };
    if run.coverage == Coverage::Unknown || run.noise.is_some() {
        return Ok(Vec::new());
    }
    let gauge = if result.has_series("gauge_strain") { result.history("gauge_strain")? } else { Vec::new() };
    let History { strain, stress } = &run.history;
    Ok(properties_of_run(&scenario, [strain, &gauge, stress], run.length, 0.0))
}

/// Properties of a run with this scenario, by symbol, in SI units. `curves`: strain, strain of the middle half (may be empty), and stress
/// (Pa) of all records; `length`: the length that strains refer to, m; `rounding`: rounding errors of the stress, Pa.
pub(crate) fn properties_of_run(
    scenario: &Scenario,
    [strain, gauge, stress]: [&[f64]; 3],
    length: Option<f64>,
    rounding: f64,
) -> Vec<(String, f64)> {
    let mut found = Vec::new();
    let Some(test) = Test::of(scenario).filter(|_| only_rounding(stress, rounding).is_none()) else { return found };
    let free = Meaning::of(scenario).is_uniaxial_stress();
    if let Some(figures) = CurveFigures::with_gauge(strain, gauge, stress).filter(|_| test.is_axial()) {
        found.extend(figures.modulus.filter(|_| free).map(|modulus| ("E".to_owned(), modulus)));
        found.extend(figures.gauge_modulus.filter(|_| free).map(|modulus| ("E_gauge".to_owned(), modulus)));
        let symbol = match (free, figures.sense) {
            (true, Sense::Tension) => "f_t",
            (true, Sense::Compression) => "f_c",
            (false, _) => "sigma_max",
        };
        found.push((symbol.to_owned(), figures.peak_stress.abs()));
        found.push(("strain_at_peak".to_owned(), figures.peak_strain));
    }
    let largest =
        stress.iter().copied().fold(0.0_f64, |most, stress| if stress.abs() > most.abs() { stress } else { most });
    if largest != 0.0 {
        found.push((RISES.to_owned(), f64::from(u8::from(still_rises(stress, largest)))));
    }
    for (symbol, _, unit, value) in test.rows(strain, stress, length) {
        let scale = if unit.starts_with("MPa") { 1e6 } else { 1.0 };
        found.push((plain(symbol), value * scale));
    }
    found
}
