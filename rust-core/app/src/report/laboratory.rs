//! Section of the report: results of standard tests of beams, cylinders, and notched beams.

use std::fmt::Write as _;

use super::figures::{RISING, still_rises};
use super::html::{escape, number, percent};
use super::meaning::Measured;
use super::{History, OutputError, Run, hopkinson, restitution, triaxial};
use concordem_scenario::schema::quantity::{CrossSection, Length};
use concordem_scenario::schema::{CutShape, Loading, Scenario, Shape};

/// The standard test of a run, by its scenario.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Test {
    /// A beam on two supports.
    Flexure(Beam),
    /// A cylinder between two plates, on which the stress is `2F/(π D L)`.
    Splitting {
        /// `π D L/2`, m²; of a length of 1 m in two dimensions.
        area: f64,
    },
    /// Direct tension or compression.
    Uniaxial,
}

/// A beam on two supports. Lengths in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Beam {
    /// Width b, 1 m in two dimensions.
    pub(super) width: f64,
    /// Height h.
    pub(super) height: f64,
    /// Distance of the supports l.
    pub(super) span: f64,
    /// Distance of the rollers; 0 in three-point bending.
    pub(super) inner_span: f64,
    /// Depth a₀ of the notch in the middle of the lower side; `None` without one, or with cuts of other forms.
    pub(super) notch: Option<f64>,
}

impl Test {
    /// The test of a scenario; `None` for other loadings.
    pub(super) fn of(scenario: &Scenario) -> Option<Self> {
        match &scenario.loading {
            Loading::Platens { area: Some(CrossSection::Splitting), .. } => {
                let Some(Shape::Cylinder { radius, height, .. }) = scenario.packing.shape() else { return None };
                let length = if scenario.dimension == 2 { 1.0 } else { height.si() };
                Some(Self::Splitting { area: std::f64::consts::PI * radius.si() * length })
            }
            Loading::Uniaxial { .. } | Loading::Platens { .. } => Some(Self::Uniaxial),
            Loading::Flexure { axis, across, span, inner_span, .. } => {
                let Some(Shape::Box { size, center, .. }) = scenario.packing.shape() else { return None };
                let across = Loading::direction_across(*axis, *across, scenario.dimension);
                let third = 3 - axis.index() - across;
                let center = center.map_or([0.0; 3], |center| center.map(Length::si));
                let width = if scenario.dimension == 2 { 1.0 } else { size[third].si() };
                let mut beam = Beam {
                    width,
                    height: size[across].si(),
                    span: span.si(),
                    inner_span: inner_span.si(),
                    notch: None,
                };
                if let [cut] = &scenario.cuts[..] {
                    let low = [axis.index(), across, third].map(|i| center[i] - 0.5 * size[i].si());
                    let thickness = (scenario.dimension == 3).then_some(width);
                    beam.notch = extents(&cut.shape).and_then(|cut| {
                        let cut = [axis.index(), across, third].map(|i| cut[i]);
                        notch(cut, low, [center[axis.index()], beam.height], thickness)
                    });
                }
                Some(Self::Flexure(beam))
            }
            _ => None,
        }
    }

    /// Whether the stress of the result is one in the specimen's cross-section, hence f_t or f_c.
    pub(super) fn is_axial(self) -> bool {
        self == Self::Uniaxial
    }

    /// Results of a run from its strains and stresses (Pa); `length`: the length that strains refer to, m.
    pub(super) fn rows(self, strain: &[f64], stress: &[f64], length: Option<f64>) -> Vec<Measured> {
        let peak = stress.iter().copied().fold(0.0, f64::max);
        if peak <= 0.0 {
            return Vec::new();
        }
        let note = if still_rises(stress, peak) { RISING } else { "" };
        match self {
            Self::Uniaxial => fracture_energy(strain, stress, peak, length).into_iter().collect(),
            Self::Splitting { .. } => {
                vec![("f<sub>st</sub>", format!("splitting strength, 2F/(π D L){note}"), "MPa", 1e-6 * peak)]
            }
            Self::Flexure(beam) => beam.rows(strain, stress, peak, note),
        }
    }
}

/// Stress at the end over the peak, below which a specimen counts as broken.
const BROKEN: f64 = 0.3;

/// Work of fracture of a specimen in direct tension over its cross-section, `L ∫σ dε`, if it breaks.
fn fracture_energy(strain: &[f64], stress: &[f64], peak: f64, length: Option<f64>) -> Option<Measured> {
    let last = stress.last()? / peak;
    let compressed = stress.iter().any(|stress| -stress > peak);
    if !(0.0..BROKEN).contains(&last) || compressed {
        return None;
    }
    let work: f64 = strain.windows(2).zip(stress.windows(2)).map(|(e, s)| 0.5 * (s[0] + s[1]) * (e[1] - e[0])).sum();
    let name = format!("work of fracture over the cross-section, until the stress is {} of the peak", percent(last));
    Some(("G<sub>F</sub>", name, "N/m", length? * work))
}

impl Beam {
    /// `note`: what to say of the largest stress.
    fn rows(&self, strain: &[f64], stress: &[f64], peak: f64, note: &str) -> Vec<Measured> {
        let name = if self.notch.is_some() {
            "nominal strength of the full height, 3 F a/(b h²)"
        } else {
            "flexural strength, 3 F a/(b h²)"
        };
        let mut rows: Vec<Measured> = vec![("f<sub>fl</sub>", format!("{name}{note}"), "MPa", 1e-6 * peak)];
        let Some(notch) = self.notch else { return rows };
        if let Some(intensity) = self.stress_intensity(peak, notch) {
            let name = format!("fracture toughness from the largest force (ASTM E399){note}");
            rows.push(("K<sub>Ic</sub>", name, "MPa √m", 1e-6 * intensity));
        }
        let last = stress.last().copied().unwrap_or(peak) / peak;
        let work = self.work(strain, stress) / (self.width * (self.height - notch));
        let name = format!("work of fracture over the ligament, until the force is {} of the largest", percent(last));
        rows.push(("G<sub>F</sub>", name, "N/m", work));
        rows
    }

    /// Force of all rollers over the nominal stress, m²: `b h²/(3a)`.
    pub(super) fn force_per_stress(&self) -> f64 {
        self.width * self.height.powi(2) / (3.0 * self.arm())
    }

    /// Deflection under the rollers over the nominal strain, m: `a (3l − 4a)/(3h)`.
    pub(super) fn deflection_per_strain(&self) -> f64 {
        self.arm() * (3.0 * self.span - 4.0 * self.arm()) / (3.0 * self.height)
    }

    /// Distance `a` of support and roller, m.
    fn arm(&self) -> f64 {
        0.5 * (self.span - self.inner_span)
    }

    /// Work of the rollers, J: `∫F dw` with force `F` and deflection `w`.
    fn work(&self, strain: &[f64], stress: &[f64]) -> f64 {
        let area: f64 =
            strain.windows(2).zip(stress.windows(2)).map(|(e, s)| 0.5 * (s[0] + s[1]) * (e[1] - e[0])).sum();
        self.force_per_stress() * self.deflection_per_strain() * area
    }

    /// Stress intensity factor of a crack of depth `notch` (m) at a nominal stress `σ = 3Fl/(2bh²)`, Pa·√m; `None` unless the beam
    /// is bent in three points on a span of four heights, to 1 %.
    ///
    /// ASTM E399: `K = F l/(b h^(3/2)) 3√α (1.99 − α (1 − α)(2.15 − 3.93α + 2.7α²))/(2 (1 + 2α)(1 − α)^(3/2))`, `α = a₀/h`.
    pub(super) fn stress_intensity(&self, stress: f64, notch: f64) -> Option<f64> {
        if self.inner_span > 0.0 || (self.span / (4.0 * self.height) - 1.0).abs() > 0.01 {
            return None;
        }
        let alpha = notch / self.height;
        let shape = alpha.sqrt() * (1.99 - alpha * (1.0 - alpha) * (2.15 - 3.93 * alpha + 2.7 * alpha * alpha))
            / ((1.0 + 2.0 * alpha) * (1.0 - alpha).powf(1.5));
        Some(stress * self.height.sqrt() * shape)
    }
}

/// Least and largest coordinate of a cut along x, y, z, m; `None` for round shapes and surfaces from files.
fn extents(cut: &CutShape) -> Option<[[f64; 2]; 3]> {
    let range = |values: &[f64]| {
        [values.iter().copied().fold(f64::INFINITY, f64::min), values.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
    };
    Some(match cut {
        CutShape::Line { from, to } => {
            [range(&[from[0].si(), to[0].si()]), range(&[from[1].si(), to[1].si()]), range(&[0.0])]
        }
        CutShape::Parallelogram { corner, edges: [u, v] } => [0, 1, 2].map(|i| {
            let [c, u, v] = [corner[i].si(), u[i].si(), v[i].si()];
            range(&[c, c + u, c + v, c + u + v])
        }),
        CutShape::Box { minimum, maximum } => [0, 1, 2].map(|i| range(&[minimum[i].si(), maximum[i].si()])),
        _ => return None,
    })
}

/// Depth of a cut with these extents along the beam, across it, and along its width, in the middle of the lower side; `low`: lower
/// corner of the beam; `thickness`: of a beam in space. `None` if the cut is no such notch: it must be narrow, reach through the lower side
/// and the whole width, and end inside.
fn notch(cut: [[f64; 2]; 3], low: [f64; 3], [middle, height]: [f64; 2], thickness: Option<f64>) -> Option<f64> {
    let [along, across, third] = cut;
    let depth = across[1] - low[1];
    let is_narrow =
        along[1] - along[0] <= 0.25 * height && (0.5 * (along[0] + along[1]) - middle).abs() <= 0.1 * height;
    let is_through = thickness.is_none_or(|width| third[0] <= low[2] && third[1] >= low[2] + width);
    (is_narrow && is_through && across[0] <= low[1] && depth > 0.0 && depth < height).then_some(depth)
}

/// Results of a run, by what kind of test it is.
///
/// # Errors
/// The result cannot be read.
pub(super) fn results(run: &Run) -> Result<Vec<Measured>, OutputError> {
    let History { strain, stress } = &run.history;
    let of_test = run.test.map_or_else(Vec::new, |test| test.rows(strain, stress, run.length));
    Ok([of_test, triaxial::rows(run)?, hopkinson::rows(run)?, restitution::rows(run)?].concat())
}

/// Table of the results of all runs that are tests; empty if there is none.
pub(super) fn section(runs: &[Run]) -> Result<String, OutputError> {
    let mut html = String::new();
    for run in runs {
        for (symbol, name, unit, value) in results(run)? {
            let unit = if unit.is_empty() { String::new() } else { format!(", {unit}") };
            let _ = writeln!(
                html,
                "<tr><td>{}</td><td class=\"symbol\">{symbol}</td><td>{name}{unit}</td><td class=\"number\">{}</td></tr>",
                escape(&run.label()),
                number(value)
            );
        }
    }
    if html.is_empty() {
        return Ok(html);
    }
    let symbols = if runs.iter().any(|run| run.test.is_some_and(|test| !test.is_axial())) {
        "<p class=\"quiet\">F is the force of all rollers, or of a plate; a the distance of support and roller, b and h width and height of the \
         beam; D and L diameter and length of the cylinder.</p>\n"
    } else {
        ""
    };
    Ok(format!(
        "<h2>Results of the test</h2>\n<div class=\"scroll\" tabindex=\"0\"><table>\n<tr><th>run</th><th>symbol</th><th>meaning</th>\
         <th class=\"number\">value</th></tr>\n{html}</table></div>\n{symbols}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use concordem_scenario::schema::template;

    fn test_of(text: &str) -> Option<Test> {
        Test::of(&Scenario::parse("test.toml", text).unwrap_or_else(|error| panic!("{error}")))
    }

    #[test]
    fn tests_are_known_by_their_scenario() {
        let text = |name: &str| template(name).unwrap().text.to_owned();
        let beam = text("concrete-bending");
        let Some(Test::Flexure(found)) = test_of(&beam) else { panic!("no beam") };
        assert_eq!((found.width, found.height, found.span, found.inner_span), (0.02, 0.02, 0.09, 0.0));
        // From −12 to −3.3 mm, and the beam begins at −10 mm.
        assert!((found.notch.unwrap() - 6.7e-3).abs() < 1e-12, "{found:?}");
        // A cut that does not reach through the width, one on the upper side, and two cuts.
        for (from, to) in [
            ("[0, \"24 mm\", 0]", "[0, \"12 mm\", 0]"),
            ("corner = [0, \"-12 mm\", \"-12 mm\"]", "corner = [0, \"-12 mm\", \"4 mm\"]"),
            (
                "[integration]",
                "[[cut]]\nshape = { kind = \"sphere\", center = [0, 0, 0], radius = \"2 mm\" }\n[integration]",
            ),
        ] {
            let Some(Test::Flexure(found)) = test_of(&beam.replacen(from, to, 1)) else { panic!("no beam") };
            assert_eq!(found.notch, None, "{to}");
        }
        let Some(Test::Splitting { area }) = test_of(&text("concrete-splitting")) else { panic!("no splitting test") };
        // π D L/2 of the template’s cylinder, with D = 40 mm and L = 15 mm.
        assert!((area / (std::f64::consts::PI * 0.02 * 0.015) - 1.0).abs() < 1e-12, "{area}");
        assert_eq!(test_of(&text("cpm-small")), Some(Test::Uniaxial));
        assert_eq!(test_of(&text("concrete-triaxial")), None);
    }

    /// The work of a linear elastic beam is half of force times deflection. The formula of ASTM E399 for `K = F l/(b h^1.5) f` has the values
    /// of the standard's table, f(0.45) = 2.29 and f(0.50) = 2.66, rounded to two decimals.
    #[test]
    fn work_and_toughness_of_a_beam() {
        let beam = Beam { width: 0.01, height: 0.02, span: 0.08, inner_span: 0.0, notch: Some(0.01) };
        let (strain, stress): (Vec<f64>, Vec<f64>) =
            (0..=10).map(|k| (1e-5 * f64::from(k), 3e5 * f64::from(k))).unzip();
        // F = 2bh²σ/(3l), w = l²ε/(6h).
        let (force, deflection) = (2.0 * 0.01 * 4e-4 * 3e6 / 0.24, 6.4e-3 * 1e-4 / 0.12);
        assert!((beam.work(&strain, &stress) / (0.5 * force * deflection) - 1.0).abs() < 1e-12);
        for (alpha, table) in [(0.45, 2.29), (0.5, 2.66)] {
            let found = beam.stress_intensity(3e6, alpha * 0.02).unwrap();
            let expected = force * 0.08 / (0.01 * 0.02_f64.powf(1.5)) * table;
            assert!((found - expected).abs() < 5e-3 / table * expected, "{alpha}: {found} {expected}");
        }
        assert_eq!(Beam { span: 0.09, ..beam }.stress_intensity(3e6, 0.01), None);
        assert_eq!(Beam { inner_span: 0.02, ..beam }.stress_intensity(3e6, 0.01), None);
        let symbols: Vec<&str> = Test::Flexure(beam).rows(&strain, &stress, None).iter().map(|row| row.0).collect();
        assert_eq!(symbols, ["f<sub>fl</sub>", "K<sub>Ic</sub>", "G<sub>F</sub>"]);
        // What is never in tension has no strength.
        let splitting = Test::Splitting { area: 1.0 };
        let rows = splitting.rows(&strain, &stress, None);
        assert_eq!(rows[0].3, 3.0);
        assert!(rows[0].1.contains("still rises"), "it ends at its largest stress");
        let dropped: Vec<f64> = stress[..10].iter().copied().chain([1.0]).collect();
        assert!(!splitting.rows(&strain, &dropped, None)[0].1.contains("still rises"));
        assert!(splitting.rows(&strain, &[-1.0; 11], None).is_empty());
        // A bar of 2 m in tension that breaks: half of 2 Pa times 1e-3, twice over, times its length.
        let (strain, stress) = ([0.0, 1e-3, 2e-3], [0.0, 2.0, 0.0]);
        let rows = Test::Uniaxial.rows(&strain, &stress, Some(2.0));
        assert!(rows.len() == 1 && (rows[0].3 - 2.0 * 2e-3).abs() < 1e-15, "{rows:?}");
        assert!(Test::Uniaxial.rows(&strain, &stress, None).is_empty(), "its length is unknown");
        assert!(Test::Uniaxial.rows(&strain, &[0.0, 2.0, 1.0], Some(2.0)).is_empty(), "it does not break");
    }
}
