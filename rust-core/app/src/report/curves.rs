//! Section of the report: stress-strain curves.

use std::fmt::Write as _;

use super::Run;
use super::chart::{Axis, Chart, ReferenceLine, Series, Style};
use super::figures::{ReferenceFigures, Sense};
use super::html::number;
use super::meaning::Meaning;

/// Color of published values.
const PUBLISHED: &str = "#1f262d";

/// A symbol without HTML.
fn plain(symbol: &str) -> String {
    symbol.replace("<sub>", "").replace("</sub>", "")
}

/// The straight line with the slope of the beginning of the curve, from the origin to the stress at the peak.
fn slope(run: &Run, sign: f64) -> Option<Series> {
    let figures = run.figures?;
    let modulus = run.modulus().filter(|modulus| *modulus > 0.0)?;
    let symbol = plain(run.meaning.slope()?.0);
    let end = (sign * figures.peak_stress / modulus * 1e3, sign * figures.peak_stress * 1e-6);
    let middle = figures.gauge_modulus.filter(|_| run.meaning.is_uniaxial_stress());
    let middle = middle.map(|modulus| format!(" (middle half {})", number(modulus * 1e-9)));
    Some(Series {
        name: format!("{symbol} = {} GPa{}", number(modulus * 1e-9), middle.unwrap_or_default()),
        color: run.color,
        style: Style::Dotted,
        points: vec![(0.0, 0.0), end],
        in_legend: true,
        marks_peak: false,
    })
}

/// A chart of stress over strain: runs of one kind and sense share it, because others have other axes or scales.
#[derive(Clone, Copy, PartialEq)]
struct Panel {
    /// Identifier within the page.
    id: &'static str,
    /// Heading.
    name: &'static str,
    /// Labels of the axes.
    axes: [&'static str; 2],
    /// Sense of a test with published values.
    sense: Option<Sense>,
    /// Factor of both axes: −1 where compression is drawn to the right and up, as laboratories do.
    sign: f64,
}

impl Panel {
    const fn new(id: &'static str, name: &'static str, axes: [&'static str; 2]) -> Self {
        Self { id, name, axes, sense: None, sign: 1.0 }
    }

    /// The chart of a run; `None` for a split cylinder, whose strain is the approach of the plates.
    fn of(run: &Run) -> Option<Self> {
        const AXIAL: [&str; 2] = ["strain, ‰", "stress, MPa"];
        const COMPRESSIVE: [&str; 2] = ["compressive strain, ‰", "compressive stress, MPa"];
        let sense = run.figures?.sense;
        Some(match run.meaning {
            Meaning::Splitting => return None,
            Meaning::Bending => {
                Self::new("bending", "In bending", ["strain of the outer fiber, ‰", "stress of the outer fiber, MPa"])
            }
            Meaning::CutBeam => {
                Self::new("cut", "In bending, with a cut", ["nominal strain, ‰", "nominal stress, MPa"])
            }
            Meaning::Torsion => Self::new(
                "torsion",
                "In torsion",
                ["shear strain at the surface, ‰", "shear stress at the surface, MPa"],
            ),
            Meaning::Shear => Self::new("shear", "In shear", ["shear strain, ‰", "shear stress, MPa"]),
            _ => {
                let (panel, sign) = match sense {
                    Sense::Tension => (Self::new("tension", "In tension", AXIAL), 1.0),
                    Sense::Compression => (Self::new("compression", "In compression", COMPRESSIVE), -1.0),
                };
                Self { sense: Some(sense), sign, ..panel }
            }
        })
    }
}

/// The charts, in the order of the first run of each.
pub(super) fn section(runs: &[Run], reference: &ReferenceFigures) -> String {
    let mut panels: Vec<(Panel, Vec<&Run>)> = Vec::new();
    for run in runs {
        let Some(panel) = Panel::of(run) else { continue };
        match panels.iter_mut().find(|(other, _)| *other == panel) {
            Some((_, own)) => own.push(run),
            None => panels.push((panel, vec![run])),
        }
    }
    if panels.is_empty() {
        return String::new();
    }
    panels.sort_by_key(|(panel, _)| panel.sense == Some(Sense::Compression));
    let mut html = String::from("<h2>Stress and strain</h2>\n<div class=\"pair\">\n");
    for (panel, own) in &panels {
        let chart = chart(*panel, own, reference);
        let _ = writeln!(html, "<div><h3>{}</h3>{}</div>", panel.name, chart.html());
    }
    html + "</div>\n"
}

fn chart(panel: Panel, runs: &[&Run], reference: &ReferenceFigures) -> Chart {
    let line = |run: &&Run| Series {
        name: run.name.clone(),
        color: run.color,
        style: Style::Line,
        points: (run.history.strain.iter().zip(&run.history.stress))
            .map(|(e, s)| (panel.sign * e * 1e3, panel.sign * s * 1e-6))
            .collect(),
        in_legend: true,
        marks_peak: true,
    };
    let mut series: Vec<Series> = runs.iter().map(line).collect();
    series.extend(runs.iter().filter_map(|run| slope(run, panel.sign)));
    let (strain, strength) = match panel.sense {
        Some(Sense::Tension) => (reference.tensile_strain, reference.tensile_strength),
        Some(Sense::Compression) => (reference.compressive_strain, reference.compressive_strength),
        None => (None, None),
    };
    let stress = strength.map(|strength| strength.middle() * 1e-6);
    if let Some((strain, stress)) = strain.zip(stress) {
        series.push(Series {
            name: "published peak".into(),
            color: PUBLISHED,
            style: Style::Diamonds,
            points: vec![(panel.sign * strain.middle() * 1e3, stress)],
            in_legend: true,
            marks_peak: false,
        });
    }
    let line = stress.map(|value| ReferenceLine { name: "published strength".into(), value });
    let [x, y] = panel.axes.map(Axis::new);
    Chart {
        id: format!("curve-{}", panel.id),
        title: format!("Stress and strain {}", panel.name.replacen('I', "i", 1)),
        x,
        y,
        series,
        reference_lines: line.into_iter().collect(),
        legend: true,
    }
}
