//! Section of the report: the size effect, from beams that differ in size only.

use std::fmt::Write as _;

use super::chart::{Axis, Chart, Series, Style};
use super::figures::still_rises;
use super::html::{escape, number};
use super::laboratory::{Beam, Test};
use super::{RUN_COLORS, Run, recipe};

/// Fewest heights to which a law is fitted.
const LEAST_SIZES: usize = 3;
/// Largest relative difference of the proportions of beams that count as similar.
const SIMILAR: f64 = 0.01;

/// Strengths of similar beams of one material.
struct Family {
    beam: Beam,
    /// Tables of the scenario that similar beams share.
    recipe: String,
    /// Height (m) and nominal strength (Pa) of each beam, by height.
    points: Vec<(f64, f64)>,
}

/// A value and its standard error.
type Estimate = (f64, f64);

/// Least-squares line `y = start + slope x`.
#[derive(Debug, Clone, Copy)]
struct Line {
    start: Estimate,
    slope: Estimate,
    /// Covariance of start and slope.
    covariance: f64,
    /// Coefficient of determination R².
    determination: f64,
}

/// A fitted law of the nominal strength σ over the height D.
#[derive(Debug, Clone, Copy)]
enum Law {
    /// Bažant 1984, with a notch (type II): `σ = B f_t/√(1 + D/D₀)`. `B f_t` in Pa, `D₀` in m, and
    /// `σ √D` of large beams, `B f_t √D₀`, in Pa √m.
    Notched { strength: Estimate, transition: Estimate, large: Estimate, determination: f64 },
    /// Without a notch (type I, exponent 1): `σ = f_∞ (1 + D_b/D)`. `f_∞` in Pa, `D_b` in m.
    Unnotched { strength: Estimate, layer: Estimate, determination: f64 },
}

impl Line {
    /// The line through the points; `None` for fewer than three, or if all have one abscissa.
    fn through(points: &[(f64, f64)]) -> Option<Self> {
        let count = points.len() as f64;
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
        let (x, y) = (mean(&|point| point.0), mean(&|point| point.1));
        let xx: f64 = points.iter().map(|point| (point.0 - x).powi(2)).sum();
        let yy: f64 = points.iter().map(|point| (point.1 - y).powi(2)).sum();
        let xy: f64 = points.iter().map(|point| (point.0 - x) * (point.1 - y)).sum();
        if points.len() < 3 || xx <= 0.0 {
            return None;
        }
        let slope = xy / xx;
        let start = y - slope * x;
        let left: f64 = points.iter().map(|point| (point.1 - start - slope * point.0).powi(2)).sum();
        let variance = left / (count - 2.0) / xx;
        Some(Self {
            start: (start, (variance * (xx / count + x * x)).sqrt()),
            slope: (slope, variance.sqrt()),
            covariance: -variance * x,
            determination: if yy > 0.0 { 1.0 - left / yy } else { 1.0 },
        })
    }

    /// Ratio of slope and start. Its error takes the covariance of both into account, to first order.
    fn ratio(&self) -> Estimate {
        let ((a, error_a), (b, error_b)) = (self.start, self.slope);
        let variance = error_b.powi(2) - 2.0 * b / a * self.covariance + (b / a * error_a).powi(2);
        (b / a, variance.max(0.0).sqrt() / a.abs())
    }
}

impl Law {
    /// Fit to heights (m) and strengths (Pa). With a notch, `1/σ²` is linear in D (RILEM TC 89-FMT 1990); without, σ is linear in 1/D.
    /// `None` if the law does not describe the strengths: they do not fall with the height, or the line has no positive start.
    fn fit(points: &[(f64, f64)], has_notch: bool) -> Option<Self> {
        if has_notch {
            let line = Line::through(&points.iter().map(|&(d, s)| (d, s.powi(-2))).collect::<Vec<_>>())?;
            let (inverse, spread) = line.ratio();
            let root = |(value, error): Estimate| (value.powf(-0.5), 0.5 * value.powf(-1.5) * error);
            (line.start.0 > 0.0 && inverse > 0.0).then(|| Self::Notched {
                strength: root(line.start),
                transition: (1.0 / inverse, spread / inverse.powi(2)),
                large: root(line.slope),
                determination: line.determination,
            })
        } else {
            let line = Line::through(&points.iter().map(|&(d, s)| (1.0 / d, s)).collect::<Vec<_>>())?;
            (line.start.0 > 0.0 && line.slope.0 > 0.0).then(|| Self::Unnotched {
                strength: line.start,
                layer: line.ratio(),
                determination: line.determination,
            })
        }
    }

    /// Strength (Pa) at a height (m).
    fn at(&self, height: f64) -> f64 {
        match self {
            Self::Notched { strength, transition, .. } => strength.0 / (1.0 + height / transition.0).sqrt(),
            Self::Unnotched { strength, layer, .. } => strength.0 * (1.0 + layer.0 / height),
        }
    }

    /// Symbol, meaning with unit, and value with its error, of each parameter.
    fn rows(&self, beam: &Beam) -> Vec<(&'static str, String, Estimate)> {
        let scaled = |(value, error): Estimate, scale: f64| (value * scale, error * scale);
        match *self {
            Self::Notched { strength, transition, large, determination } => {
                let law = format!(
                    "strength of small beams, σ = B f<sub>t</sub>/√(1 + D/D<sub>0</sub>), R² = {}, MPa",
                    number(determination)
                );
                let mut rows = vec![
                    ("B f<sub>t</sub>", law, scaled(strength, 1e-6)),
                    ("D<sub>0</sub>", "transitional height, mm".to_owned(), scaled(transition, 1e3)),
                ];
                // The intensity is proportional to σ √D.
                let intensity = |large: f64| beam.stress_intensity(large / beam.height.sqrt(), beam.notch?);
                if let Some(toughness) = intensity(large.0).zip(intensity(large.1)) {
                    let name = "fracture toughness of infinitely large beams (ASTM E399), MPa √m".to_owned();
                    rows.push(("K<sub>If</sub>", name, scaled(toughness, 1e-6)));
                }
                rows
            }
            Self::Unnotched { strength, layer, determination } => {
                let law = format!(
                    "strength of large beams, σ = f<sub>∞</sub> (1 + D<sub>b</sub>/D), R² = {}, MPa",
                    number(determination)
                );
                vec![
                    ("f<sub>∞</sub>", law, scaled(strength, 1e-6)),
                    (
                        "D<sub>b</sub>",
                        "thickness of the layer in which cracks begin, mm".to_owned(),
                        scaled(layer, 1e3),
                    ),
                ]
            }
        }
    }
}

impl Family {
    /// Families of the runs that bend a beam, each with enough heights.
    fn all(runs: &[Run]) -> Vec<Self> {
        let mut families: Vec<Self> = Vec::new();
        for run in runs {
            let Some(Test::Flexure(beam)) = run.test else { continue };
            let strength = run.history.stress.iter().copied().fold(0.0, f64::max);
            // What still rises has no strength yet.
            if strength <= 0.0 || still_rises(&run.history.stress, strength) {
                continue;
            }
            let Some(recipe) = recipe(run, &beam) else { continue };
            match families.iter_mut().find(|family| family.recipe == recipe && similar(&family.beam, &beam)) {
                Some(family) => family.points.push((beam.height, strength)),
                None => families.push(Self { beam, recipe, points: vec![(beam.height, strength)] }),
            }
        }
        for family in &mut families {
            family.points.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        families.retain(|family| family.heights().len() >= LEAST_SIZES);
        families
    }

    fn heights(&self) -> Vec<f64> {
        let mut heights: Vec<f64> = self.points.iter().map(|point| point.0).collect();
        heights.dedup_by(|a, b| (*a / *b - 1.0).abs() < 1e-9);
        heights
    }

    fn name(&self) -> String {
        match self.beam.notch {
            Some(notch) => format!("notch {} of the height", number(notch / self.beam.height)),
            None => "no notch".into(),
        }
    }
}

/// What beams of one family share: material, particles, bonds, and what lies inside. `None` for a beam with cuts other than a notch, to
/// which no law applies.
fn recipe(run: &Run, beam: &Beam) -> Option<String> {
    let text = run.file.scenario().ok()?;
    let table: toml::Table = toml::from_str(&text).ok()?;
    if table.contains_key("cut") && beam.notch.is_none() {
        return None;
    }
    let integration = recipe::part(&table, "integration", &["damping", "kinematics"]);
    Some(format!("{} {integration:?}", recipe::material(&text)))
}

/// Whether two beams have the same proportions. Only the height counts for the law, so that widths may differ.
fn similar(a: &Beam, b: &Beam) -> bool {
    let proportions = |beam: &Beam| {
        [beam.span / beam.height, beam.inner_span / beam.height, beam.notch.map_or(0.0, |notch| notch / beam.height)]
    };
    a.notch.is_some() == b.notch.is_some()
        && proportions(a).iter().zip(proportions(b)).all(|(x, y)| (x - y).abs() <= SIMILAR * x.abs().max(y.abs()))
}

/// Strengths over the height with the fitted laws; empty unless similar beams of three or more heights are given.
pub(super) fn section(runs: &[Run]) -> String {
    let families = Family::all(runs);
    if families.is_empty() {
        return String::new();
    }
    let (mut rows, mut series) = (String::new(), Vec::new());
    for (family, color) in families.iter().zip(RUN_COLORS.iter().cycle()) {
        let law = Law::fit(&family.points, family.beam.notch.is_some());
        add_rows(&mut rows, family, law);
        series.push(curve(family.name(), color, Style::Crosses, &family.points));
        if let (Some(law), [first, .., last]) = (law, &family.heights()[..]) {
            let steps = 40;
            let height = |k: i32| first * (last / first).powf(f64::from(k) / f64::from(steps));
            let fitted: Vec<_> = (0..=steps).map(|k| (height(k), law.at(height(k)))).collect();
            series.push(curve(format!("fit, {}", family.name()), color, Style::Line, &fitted));
        }
    }
    let chart = Chart {
        id: "size-effect".into(),
        title: "Nominal strength over the height of the beam".into(),
        x: Axis { label: "height D, mm".into(), logarithmic: true },
        y: Axis { label: "nominal strength σ, MPa".into(), logarithmic: true },
        series,
        reference_lines: Vec::new(),
        legend: true,
    };
    format!(
        "<h2>Size effect</h2>\n<div class=\"scroll\" tabindex=\"0\"><table>\n<tr><th>beams</th><th>symbol</th><th>meaning</th>\
         <th class=\"number\">value</th></tr>\n{rows}</table></div>\n<p class=\"quiet\">Similar beams of one material; σ is the largest \
         3 F a/(b D²). Laws are fitted by least squares to single beams: 1/σ² over D with a notch (Bažant 1984, RILEM TC 89-FMT), σ over 1/D \
         without. ± is one standard error of the fit. A sawn face has a soft layer of a quarter of a particle's diameter, which lowers the \
         strength of small beams.</p>\n<div class=\"pair\"><div>{}</div></div>\n",
        chart.html()
    )
}

fn curve(name: String, color: &'static str, style: Style, points: &[(f64, f64)]) -> Series {
    let points = points.iter().map(|(height, strength)| (1e3 * height, 1e-6 * strength)).collect();
    Series { name, color, style, points, in_legend: true, marks_peak: false }
}

fn add_rows(html: &mut String, family: &Family, law: Option<Law>) {
    let heights: Vec<String> = family.heights().iter().map(|height| number(1e3 * height)).collect();
    let beams = escape(&format!("{}: {} beams of {} mm", family.name(), family.points.len(), heights.join(", ")));
    let mut row = |symbol: &str, meaning: &str, value: &str| {
        let _ = writeln!(
            html,
            "<tr><td>{beams}</td><td class=\"symbol\">{symbol}</td><td>{meaning}</td><td class=\"number\">{value}</td></tr>"
        );
    };
    let Some(law) = law else {
        row("", "no law fits: the strength does not fall with the height, or falls faster than D<sup>−1/2</sup>", "–");
        return;
    };
    for (symbol, meaning, (value, error)) in law.rows(&family.beam) {
        row(symbol, &meaning, &format!("{} ± {}", number(value), number(error)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEIGHTS: [f64; 4] = [0.01, 0.02, 0.04, 0.08];

    fn points(law: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        HEIGHTS.map(|height| (height, law(height))).to_vec()
    }

    /// Strengths on a law give its parameters, to the rounding of a line whose abscissas spread by a factor of eight.
    #[test]
    fn strengths_on_a_law_give_its_parameters() {
        let close = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        let beam = Beam { width: 0.01, height: 0.02, span: 0.08, inner_span: 0.0, notch: Some(0.01) };
        let law = Law::fit(&points(|d| 5e6 / (1.0 + d / 0.05).sqrt()), true).unwrap();
        let values: Vec<f64> = law.rows(&beam).iter().map(|row| row.2.0).collect();
        close(values[0], 5.0);
        close(values[1], 50.0);
        // K = F l/(b h^1.5) f(0.5) with f = 2.66 to two decimals (ASTM E399), and F l/(b h^1.5) = 2/3 σ √h for a span of any length.
        assert!((values[2] / (2.0 / 3.0 * 5.0 * 0.05_f64.sqrt() * 2.66) - 1.0).abs() < 5e-3 / 2.66, "{values:?}");
        let law = Law::fit(&points(|d| 4e6 * (1.0 + 0.003 / d)), false).unwrap();
        let values: Vec<f64> = law.rows(&beam).iter().map(|row| row.2.0).collect();
        close(values[0], 4.0);
        close(values[1], 3.0);
        close(law.at(0.03), 4.4e6);
    }

    /// Errors of all parameters, against the errors that those of single strengths propagate to: derivatives by differences, and the residual
    /// variance of the fitted line.
    #[test]
    fn errors_of_the_parameters_follow_from_those_of_the_strengths() {
        let beam = Beam { width: 0.01, height: 0.02, span: 0.08, inner_span: 0.0, notch: Some(0.01) };
        for has_notch in [true, false] {
            // The line is fitted to y(x); noise of the same size in all y.
            let transformed = |d: f64, s: f64| if has_notch { (d, s.powi(-2)) } else { (1.0 / d, s) };
            let strength = |y: f64| if has_notch { y.powf(-0.5) } else { y };
            let given: Vec<(f64, f64)> = [1.02, 0.97, 1.03, 0.98]
                .iter()
                .zip(points(|d| if has_notch { 5e6 / (1.0 + d / 0.05).sqrt() } else { 4e6 * (1.0 + 0.003 / d) }))
                .map(|(noise, (d, s))| (d, noise * s))
                .collect();
            let values = |points: &[(f64, f64)]| -> Vec<Estimate> {
                Law::fit(points, has_notch).unwrap().rows(&beam).iter().map(|row| row.2).collect()
            };
            let line: Vec<(f64, f64)> = given.iter().map(|&(d, s)| transformed(d, s)).collect();
            let fitted = Line::through(&line).unwrap();
            let residual: f64 =
                line.iter().map(|(x, y)| (y - fitted.start.0 - fitted.slope.0 * x).powi(2)).sum::<f64>() / 2.0;
            let found = values(&given);
            for (k, (_, error)) in found.iter().enumerate() {
                let derivative = |point: usize| {
                    let step = 1e-5 * line[point].1;
                    let shifted = |sign: f64| {
                        let mut changed = given.clone();
                        changed[point].1 = strength(line[point].1 + sign * step);
                        values(&changed)[k].0
                    };
                    (shifted(1.0) - shifted(-1.0)) / (2.0 * step)
                };
                let expected = (0..4).map(|point| derivative(point).powi(2) * residual).sum::<f64>().sqrt();
                // Differences of second order in 1e-5.
                assert!((error / expected - 1.0).abs() < 1e-6, "{has_notch} {k}: {error} {expected}");
            }
        }
    }

    /// Strengths that rise with the height, and those that fall faster than linear fracture mechanics allows.
    #[test]
    fn strengths_beside_the_laws_have_no_fit() {
        for has_notch in [true, false] {
            assert!(Law::fit(&points(|d| 1e6 * (1.0 + d)), has_notch).is_none());
        }
        assert!(Law::fit(&points(|d| 1e6 / d), true).is_none());
        assert!(Law::fit(&points(|_| 1e6)[..2], true).is_none());
    }

    /// Anscombe's first set (1973): y = 3.00 + 0.500 x, standard errors 1.125 and 0.118, R² = 0.667.
    #[test]
    fn errors_of_a_line_are_those_of_a_known_set() {
        let y = [8.04, 6.95, 7.58, 8.81, 8.33, 9.96, 7.24, 4.26, 10.84, 4.82, 5.68];
        let x = [10.0, 8.0, 13.0, 9.0, 11.0, 14.0, 6.0, 4.0, 12.0, 7.0, 5.0];
        let line = Line::through(&x.into_iter().zip(y).collect::<Vec<_>>()).unwrap();
        let rounded = |value: f64| (1e3 * value).round() / 1e3;
        assert_eq!((rounded(line.start.0), rounded(line.slope.0)), (3.0, 0.5));
        assert_eq!((rounded(line.start.1), rounded(line.slope.1)), (1.125, 0.118));
        assert_eq!(rounded(line.determination), 0.667);
        // The ratio by the same set with y → y + δ: its derivative by differences, with the residual variance of 1.2366² on nine degrees.
        let ratio = |k: usize, change: f64| {
            let mut y = y;
            y[k] += change;
            Line::through(&x.into_iter().zip(y).collect::<Vec<_>>()).unwrap().ratio().0
        };
        let variance: f64 = (0..11).map(|k| ((ratio(k, 1e-5) - ratio(k, -1e-5)) / 2e-5 * 1.2366).powi(2)).sum();
        assert!((line.ratio().1 / variance.sqrt() - 1.0).abs() < 1e-4, "{:?} {}", line.ratio(), variance.sqrt());
    }

    #[test]
    fn only_similar_beams_are_compared() {
        let beam = Beam { width: 0.01, height: 0.02, span: 0.08, inner_span: 0.0, notch: Some(0.01) };
        let twice = Beam { width: 0.01, height: 0.04, span: 0.16, notch: Some(0.02), ..beam };
        assert!(similar(&beam, &twice));
        for other in [
            Beam { span: 0.15, ..twice },
            Beam { inner_span: 0.02, ..twice },
            Beam { notch: Some(0.015), ..twice },
            Beam { notch: None, ..twice },
        ] {
            assert!(!similar(&beam, &other), "{other:?}");
        }
    }
}
