//! Section of the report: stress-strain curves.

use std::fmt::Write as _;

use super::Run;
use super::chart::{Axis, Chart, ReferenceLine, Series, Style};
use super::figures::{ReferenceFigures, Sense};
use super::html::number;

/// Color of published values.
const PUBLISHED: &str = "#1f262d";

/// A symbol without HTML.
fn plain(symbol: &str) -> String {
    symbol.replace("<sub>", "").replace("</sub>", "")
}

/// The straight line with the slope of the beginning of the curve, from the origin to the stress at the peak.
fn slope(run: &Run, sense: Sense) -> Option<Series> {
    let figures = run.figures.filter(|figures| figures.sense == sense)?;
    let modulus = run.modulus().filter(|modulus| *modulus > 0.0)?;
    let symbol = plain(run.meaning.slope()?.0);
    let end = (figures.peak_stress / modulus * 1e3, figures.peak_stress * 1e-6);
    Some(Series {
        name: format!("{symbol} = {} GPa", number(modulus * 1e-9)),
        color: run.color,
        style: Style::Dotted,
        points: vec![(0.0, 0.0), end],
        in_legend: true,
        marks_peak: false,
    })
}

/// One chart per sense of loading, because their scales differ tenfold.
pub(super) fn section(runs: &[Run], reference: &ReferenceFigures) -> String {
    // Runs without stress and strain have no curve.
    if runs.iter().all(|run| run.figures.is_none()) {
        return String::new();
    }
    let mut html = String::from("<h2>Stress and strain</h2>\n<div class=\"pair\">\n");
    for (sense, name) in [(Sense::Tension, "tension"), (Sense::Compression, "compression")] {
        let mut series: Vec<Series> = runs
            .iter()
            .filter(|run| run.figures.is_some_and(|figures| figures.sense == sense))
            .map(|run| Series {
                name: run.name.clone(),
                color: run.color,
                style: Style::Line,
                points: run.history.strain.iter().zip(&run.history.stress).map(|(e, s)| (e * 1e3, s * 1e-6)).collect(),
                in_legend: true,
                marks_peak: true,
            })
            .collect();
        if series.is_empty() {
            continue;
        }
        series.extend(runs.iter().filter_map(|run| slope(run, sense)));
        let (strain, strength, sign) = match sense {
            Sense::Tension => (reference.tensile_strain, reference.tensile_strength, 1.0),
            Sense::Compression => (reference.compressive_strain, reference.compressive_strength, -1.0),
        };
        let stress = strength.map(|strength| sign * strength.middle() * 1e-6);
        if let Some((strain, stress)) = strain.zip(stress) {
            series.push(Series {
                name: "published peak".into(),
                color: PUBLISHED,
                style: Style::Diamonds,
                points: vec![(strain.middle() * 1e3, stress)],
                in_legend: true,
                marks_peak: false,
            });
        }
        let line = stress.map(|value| ReferenceLine { name: "published strength".into(), value });
        let chart = Chart {
            id: format!("curve-{name}"),
            title: format!("Stress and strain in {name}"),
            x: Axis::new("strain, ‰"),
            y: Axis::new("stress, MPa"),
            series,
            reference_lines: line.into_iter().collect(),
            legend: true,
        };
        let _ = writeln!(html, "<div><h3>In {name}</h3>{}</div>", chart.html());
    }
    html + "</div>\n"
}
