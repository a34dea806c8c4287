//! Stiffness and strength of a specimen from its stress-strain curve, and published values to compare with.

/// Sense of loading of a uniaxial test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sense {
    /// The stress of largest magnitude is tensile.
    Tension,
    /// The stress of largest magnitude is compressive.
    Compression,
}

/// Stiffness and strength from one stress-strain curve. Strains and stresses are positive in tension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveFigures {
    /// Tension or compression.
    pub sense: Sense,
    /// Young's modulus E, Pa: slope of a straight line fitted to the beginning of the curve (least squares, with
    /// intercept), from the first sample to the last one before the stress first exceeds [`FITTED_SHARE`] of its peak in this sense.
    /// `None` with fewer than three samples, and where they lie on no line.
    pub modulus: Option<f64>,
    /// The same, using the strain of the middle half of the specimen, if measured.
    pub gauge_modulus: Option<f64>,
    /// Number of fitted samples.
    pub fitted: usize,
    /// Stress at the peak, Pa; negative in compression.
    pub peak_stress: f64,
    /// Strain at the peak.
    pub peak_strain: f64,
    /// Whether the peak is the end: then it is the largest stress so far, and no strength.
    pub rises: bool,
}

/// Share of the peak at the end of the curve, above which the peak is the end.
const STILL_RISING: f64 = 0.999;

/// What tables say of a stress that [rises](CurveFigures::rises).
pub const RISING: &str = "; the stress still rises at the end of the run";

/// Whether the last stress is the largest one, `peak` (Pa).
pub fn still_rises(stress: &[f64], peak: f64) -> bool {
    stress.iter().rev().find(|stress| stress.is_finite()).is_some_and(|last| last / peak > STILL_RISING)
}

/// Fraction of the peak stress up to which the modulus is fitted. In the concrete particle model no bond is damaged there:
/// the tensile strength is approximately 1.4 times the stress at which damage begins.
pub const FITTED_SHARE: f64 = 0.3;

/// Largest standard error of a modulus, as a fraction of it: a slope that is less than three of its errors may as well be another one. Samples of a
/// specimen that stands still, or swings about its rest, have such slopes.
const SCATTER: f64 = 1.0 / 3.0;

/// Least range of strains to which a modulus is fitted. Strains are differences of coordinates, which round by 1e-16 of themselves in each step.
const LEAST_STRAIN: f64 = 1e-12;

/// The largest magnitude of the stresses, if it is no more than rounding errors (Pa).
pub fn only_rounding(stress: &[f64], rounding: f64) -> Option<f64> {
    let largest =
        stress.iter().copied().filter(|stress| stress.is_finite()).fold(0.0, |most: f64, s| most.max(s.abs()));
    (largest > 0.0 && largest <= rounding).then_some(largest)
}

impl CurveFigures {
    /// Figures of a curve; `None` without a finite, nonzero stress.
    pub fn of(strain: &[f64], stress: &[f64]) -> Option<Self> {
        let samples: Vec<(f64, f64)> = strain
            .iter()
            .copied()
            .zip(stress.iter().copied())
            .filter(|(e, s)| e.is_finite() && s.is_finite())
            .collect();
        let (peak_strain, peak_stress) =
            samples.iter().copied().reduce(|peak, sample| if sample.1.abs() > peak.1.abs() { sample } else { peak })?;
        if peak_stress == 0.0 {
            return None;
        }
        // A specimen that is pulled beyond its peak and then pressed is straight up to a share of the first peak, which is the smaller one.
        // A sense counts where strain and stress agree: a specimen that springs back as it breaks has no other peak.
        let of_sense = |sign: f64| {
            let agree = samples.iter().filter(|(strain, stress)| strain * sign > 0.0 && stress * sign > 0.0);
            agree.fold(0.0_f64, |most, (_, stress)| most.max(stress.abs()))
        };
        let peaks = [of_sense(1.0), of_sense(-1.0)];
        let is_straight = |&(strain, stress): &(f64, f64)| {
            let own = if strain * stress > 0.0 { peaks[usize::from(stress < 0.0)] } else { peak_stress.abs() };
            stress.abs() <= FITTED_SHARE * own
        };
        let straight = samples.iter().take_while(|sample| is_straight(sample)).count();
        Some(Self {
            sense: if peak_stress > 0.0 { Sense::Tension } else { Sense::Compression },
            modulus: slope(&samples[..straight]),
            gauge_modulus: None,
            fitted: straight,
            peak_stress,
            peak_strain,
            rises: still_rises(stress, peak_stress),
        })
    }

    /// Figures of a curve with an additional strain of the middle half of the specimen.
    pub fn with_gauge(strain: &[f64], gauge_strain: &[f64], stress: &[f64]) -> Option<Self> {
        let figures = Self::of(strain, stress)?;
        Some(Self { gauge_modulus: Self::of(gauge_strain, stress).and_then(|gauged| gauged.modulus), ..figures })
    }
}

/// Slope of the least-squares line; `None` if the samples do not determine it.
fn slope(samples: &[(f64, f64)]) -> Option<f64> {
    let range = |of: fn(&(f64, f64)) -> f64| {
        let values = || samples.iter().map(of);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    };
    if samples.len() < 3 || range(|sample| sample.0) < LEAST_STRAIN {
        return None;
    }
    let count = samples.len() as f64;
    let mean_x = samples.iter().map(|(x, _)| x).sum::<f64>() / count;
    let mean_y = samples.iter().map(|(_, y)| y).sum::<f64>() / count;
    let xx: f64 = samples.iter().map(|(x, _)| (x - mean_x).powi(2)).sum();
    let xy: f64 = samples.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let slope = xy / xx;
    let left: f64 = samples.iter().map(|(x, y)| (y - mean_y - slope * (x - mean_x)).powi(2)).sum();
    let error = (left / (count - 2.0) / xx).sqrt();
    (error <= SCATTER * slope.abs()).then_some(slope)
}

/// A published value: one number or a range, and how much other packings scatter around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Given {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Standard deviation between packings made in the same way, as a fraction of their mean.
    pub scatter: Option<f64>,
}

impl Given {
    /// One number.
    pub fn exactly(value: f64) -> Self {
        Self { low: value, high: value, scatter: None }
    }

    /// The same value, with the scatter between packings.
    pub fn with_scatter(self, scatter: f64) -> Self {
        Self { scatter: Some(scatter), ..self }
    }

    /// Middle of the range.
    pub fn middle(self) -> f64 {
        0.5 * (self.low + self.high)
    }
}

/// Published values for the same specimen, and the bond parameters that make values dimensionless.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReferenceFigures {
    /// Source of the values; empty if there are none.
    pub source: String,
    /// Normal modulus of the bonds Ē, Pa.
    pub bond_modulus: Option<f64>,
    /// Crack onset strain of a bond, ε₀.
    pub crack_onset_strain: Option<f64>,
    /// Young's modulus E, Pa.
    pub modulus: Option<Given>,
    /// Tensile strength f_t, Pa.
    pub tensile_strength: Option<Given>,
    /// Strain at f_t.
    pub tensile_strain: Option<Given>,
    /// Compressive strength f_c, Pa, positive.
    pub compressive_strength: Option<Given>,
    /// Strain at f_c, negative.
    pub compressive_strain: Option<Given>,
    /// f_c/f_t.
    pub strength_ratio: Option<Given>,
    /// E/Ē.
    pub modulus_ratio: Option<Given>,
    /// f_t/(Ē ε₀).
    pub tensile_ratio: Option<Given>,
}

impl ReferenceFigures {
    /// Specimen 1 of Stránský 2018, section 2.5.3: 50 mm cube, Ē = 25 GPa, ε₀ = 1e-4. The scatter is that of five
    /// packings of the study `validation/specimens.py` (cases "as published").
    pub fn stransky_specimen_1() -> Self {
        let one = |value, scatter| Some(Given::exactly(value).with_scatter(scatter));
        Self {
            source: "Stránský 2018, section 2.5.3, specimen 1 (numbers of the author's result files)".into(),
            bond_modulus: Some(25e9),
            crack_onset_strain: Some(1e-4),
            modulus: one(27.03e9, 0.018),
            tensile_strength: one(3.475e6, 0.060),
            tensile_strain: one(1.586e-4, 0.081),
            compressive_strength: one(32.50e6, 0.025),
            compressive_strain: one(-1.859e-3, 0.023),
            strength_ratio: one(9.35, 0.051),
            modulus_ratio: one(1.081, 0.018),
            tensile_ratio: one(1.390, 0.060),
        }
    }

    /// Specimen 4 of Stránský 2018, section 2.5.3: as specimen 1, with bonds twice as stiff and twice as strong.
    pub fn stransky_specimen_4() -> Self {
        let one = |value| Some(Given::exactly(value));
        Self {
            source: "Stránský 2018, section 2.5.3, specimen 4 (numbers of the author's result files)".into(),
            bond_modulus: Some(50e9),
            crack_onset_strain: Some(1e-4),
            modulus: Some(Given { low: 54.3e9, high: 54.7e9, scatter: None }),
            tensile_strength: one(6.930e6),
            tensile_strain: one(1.586e-4),
            compressive_strength: one(64.35e6),
            compressive_strain: one(-1.859e-3),
            strength_ratio: one(9.29),
            modulus_ratio: one(1.09),
            tensile_ratio: one(1.386),
        }
    }

    /// No published values; the bond parameters, if known.
    pub fn none(bond_modulus: Option<f64>, crack_onset_strain: Option<f64>) -> Self {
        Self { bond_modulus, crack_onset_strain, ..Self::default() }
    }
}

/// Mean over the runs of one kind, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    /// The mean; the value itself of a single run.
    pub value: f64,
    /// Standard deviation of two or more runs.
    pub deviation: Option<f64>,
}

impl Mean {
    /// The mean of the values; `None` without any.
    fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let values: Vec<f64> = values.collect();
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let square: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        let deviation = (values.len() > 1).then(|| (square / (count - 1.0)).sqrt());
        (!values.is_empty()).then_some(Self { value: mean, deviation })
    }

    /// A value without scatter.
    fn alone(value: f64) -> Self {
        Self { value, deviation: None }
    }
}

/// One row of the table of figures.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Symbol, as HTML.
    pub symbol: &'static str,
    /// Name.
    pub name: &'static str,
    /// Unit to print.
    pub unit: &'static str,
    /// Factor from SI to the printed unit.
    pub scale: f64,
    /// Our value.
    pub ours: Option<Mean>,
    /// Published value, SI.
    pub source: Option<Given>,
    /// Whether it follows from a stress that still rises at the end of a run.
    pub rises: bool,
}

impl Row {
    /// Whether there is something to show.
    pub fn is_known(&self) -> bool {
        self.ours.is_some() || self.source.is_some()
    }
}

/// Curves of specimens of one material.
#[derive(Debug, Clone, Default)]
pub struct Curves {
    /// Runs in tension.
    pub tension: Vec<CurveFigures>,
    /// Runs in compression.
    pub compression: Vec<CurveFigures>,
}

impl Curves {
    /// The mean of a figure: of the runs in tension that have it, else of those in compression.
    fn first(&self, of: fn(&CurveFigures) -> Option<f64>) -> Option<Mean> {
        Mean::of(self.tension.iter().filter_map(of)).or_else(|| Mean::of(self.compression.iter().filter_map(of)))
    }
}

/// All values of the tests of one material, with the published ones; the rows are the same for all materials.
pub fn rows(curves: &Curves, given: &ReferenceFigures) -> Vec<Row> {
    let row = |symbol, name, (unit, scale), ours, source| Row { symbol, name, unit, scale, ours, source, rises: false };
    let (gpa, mpa, per_mille, pure) = (("GPa", 1e-9), ("MPa", 1e-6), ("‰", 1e3), ("", 1.0));
    let mean = |curves: &[CurveFigures], of: fn(&CurveFigures) -> f64| Mean::of(curves.iter().map(of));
    let modulus = curves.first(|curve| curve.modulus);
    let tensile = mean(&curves.tension, |curve| curve.peak_stress);
    let compressive = mean(&curves.compression, |curve| -curve.peak_stress);
    let ratio = |a: Option<Mean>, b: Option<f64>| Some(Mean::alone(a?.value / b?));
    let onset = given.bond_modulus.zip(given.crack_onset_strain).map(|(modulus, strain)| modulus * strain);
    let rises = |curves: &[CurveFigures]| curves.iter().any(|curve| curve.rises);
    let [pulled, pressed] = [rises(&curves.tension), rises(&curves.compression)];
    let middle = curves.first(|curve| curve.gauge_modulus);
    vec![
        row("E<sub>g</sub>", "Young’s modulus, from the strain of the middle half", gpa, middle, None),
        row("E", "Young’s modulus, from the strain between the ends", gpa, modulus, given.modulus),
        Row { rises: pulled, ..row("f<sub>t</sub>", "tensile strength", mpa, tensile, given.tensile_strength) },
        row(
            "ε(f<sub>t</sub>)",
            "strain at this stress",
            per_mille,
            mean(&curves.tension, |curve| curve.peak_strain),
            given.tensile_strain,
        ),
        Row {
            rises: pressed,
            ..row("f<sub>c</sub>", "compressive strength", mpa, compressive, given.compressive_strength)
        },
        row(
            "ε(f<sub>c</sub>)",
            "strain at this stress",
            per_mille,
            mean(&curves.compression, |curve| curve.peak_strain),
            given.compressive_strain,
        ),
        Row {
            rises: pulled || pressed,
            ..row(
                "f<sub>c</sub>/f<sub>t</sub>",
                "ratio of the strengths",
                pure,
                ratio(compressive, tensile.map(|mean| mean.value)),
                given.strength_ratio,
            )
        },
        row(
            "E/Ē",
            "Young’s modulus over the modulus of a bond",
            pure,
            ratio(modulus, given.bond_modulus),
            given.modulus_ratio,
        ),
        Row {
            rises: pulled,
            ..row(
                "f<sub>t</sub>/(Ē ε<sub>0</sub>)",
                "tensile strength over the stress at the onset of damage in a bond",
                pure,
                ratio(tensile, onset),
                given.tensile_ratio,
            )
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_a_curve_that_is_straight_and_then_softens() {
        // E = 20 GPa up to 3 MPa, then softening.
        let strain: Vec<f64> = (0..=30).map(|k| f64::from(k) * 1e-5).collect();
        let stress: Vec<f64> =
            strain.iter().map(|&e| if e <= 1.5e-4 { 20e9 * e } else { 3e6 - 10e9 * (e - 1.5e-4) }).collect();
        let figures = CurveFigures::of(&strain, &stress).unwrap();
        assert_eq!(figures.sense, Sense::Tension);
        // Tolerance: some units in the last place of sums of five samples.
        assert!((figures.modulus.unwrap() / 20e9 - 1.0).abs() < 1e-14, "{figures:?}");
        assert_eq!(figures.fitted, 5, "samples 0 to 4: the fifth has 1.0 MPa, more than 0.9 MPa");
        assert!((figures.peak_stress - 3e6).abs() < 1e-6 && (figures.peak_strain - 1.5e-4).abs() < 1e-18);
        let negative: Vec<f64> = stress.iter().map(|s| -s).collect();
        let strain: Vec<f64> = strain.iter().map(|e| -e).collect();
        let mirrored = CurveFigures::of(&strain, &negative).unwrap();
        assert_eq!(mirrored.sense, Sense::Compression);
        assert_eq!(mirrored.modulus, figures.modulus);
        assert_eq!(mirrored.peak_stress, -figures.peak_stress);
    }

    /// Pulled beyond the peak and then pressed: E is that of the first loading, whose peak is a tenth of the other.
    #[test]
    fn the_modulus_is_that_of_the_first_loading() {
        let pulled = (0..=40).map(|k| f64::from(k) * 1e-5);
        let pulled: Vec<(f64, f64)> =
            pulled.map(|e| (e, if e <= 1.5e-4 { 20e9 * e } else { 3e6 - 10e9 * (e - 1.5e-4) })).collect();
        let pressed = (1..=240).map(|k| 4e-4 - f64::from(k) * 1e-5);
        let whole = pulled.iter().copied().chain(pressed.map(|e| (e, 0.5e6 + 15e9 * (e - 4e-4))));
        let (strain, stress): (Vec<f64>, Vec<f64>) = whole.unzip();
        let figures = CurveFigures::of(&strain, &stress).unwrap();
        assert_eq!((figures.sense, figures.fitted), (Sense::Compression, 5));
        assert!((figures.modulus.unwrap() / 20e9 - 1.0).abs() < 1e-14, "{figures:?}");
        let mirror = |values: &[f64]| values.iter().map(|x| -x).collect::<Vec<f64>>();
        let mirrored = CurveFigures::of(&mirror(&strain), &mirror(&stress)).unwrap();
        assert_eq!((mirrored.sense, mirrored.modulus, mirrored.fitted), (Sense::Tension, figures.modulus, 5));
        // A specimen that breaks and springs back while it is still stretched has one peak only.
        let (strain, stress): (Vec<f64>, Vec<f64>) =
            pulled.iter().map(|(e, s)| (*e, if *e < 1.55e-4 { *s } else { -0.1e6 })).unzip();
        let broken = CurveFigures::of(&strain, &stress).unwrap();
        assert_eq!((broken.sense, broken.fitted), (Sense::Tension, 5));
    }

    #[test]
    fn an_offset_does_not_change_the_modulus() {
        let strain: Vec<f64> = (0..100).map(|k| f64::from(k) * 1e-6).collect();
        let stress: Vec<f64> = strain.iter().map(|&e| 20e9 * e + 1e3).collect();
        let modulus = CurveFigures::of(&strain, &stress).unwrap().modulus.unwrap();
        assert!((modulus / 20e9 - 1.0).abs() < 1e-12, "{modulus}");
    }

    #[test]
    fn curves_with_too_few_data_have_no_figures() {
        assert_eq!(CurveFigures::of(&[], &[]), None);
        assert_eq!(CurveFigures::of(&[0.0, 1.0], &[0.0, 0.0]), None);
        assert_eq!(CurveFigures::of(&[0.0, f64::NAN], &[0.0, 5.0]), None);
        let short = CurveFigures::of(&[0.0, 1e-4], &[0.0, 2e6]).unwrap();
        assert_eq!((short.modulus, short.peak_stress), (None, 2e6));
        let standing = CurveFigures::of(&[0.0; 5], &[0.0, 0.1, 0.1, 0.1, 1.0]).unwrap();
        assert_eq!(standing.modulus, None, "without strain there is no slope");
        let heated = CurveFigures::of(&[0.0, 1e-17, 2e-17, 3e-17, 1e-17], &[0.0, 1e5, 2e5, 3e5, 1e6]).unwrap();
        assert_eq!(heated.modulus, None, "the strains are rounding errors");
    }

    /// Samples that lie on no line have no modulus; on a line they may scatter.
    #[test]
    fn a_modulus_needs_a_line() {
        let of = |errors: [f64; 6]| {
            let strain: Vec<f64> = (0..7).map(|k| f64::from(k) * 1e-6).collect();
            let stress: Vec<f64> = strain.iter().zip(errors).map(|(e, error)| 20e9 * e + error).chain([1e6]).collect();
            CurveFigures::of(&strain, &stress).unwrap()
        };
        // Errors of alternating sign a beside 0, 20, 40, 60, 80, 100 kPa: the slope is 20 GPa less 6a/35 per 1e-6, its standard error 0.27994 a per
        // 1e-6 (the root of (6 - 9/17.5)/(4 * 17.5)), a third of the slope at a = 19.78 kPa.
        let alternating = |a: f64| of([a, -a, a, -a, a, -a]);
        assert_eq!(alternating(19e3).fitted, 6);
        assert!((alternating(19e3).modulus.unwrap() / (20e9 - 6.0 / 35.0 * 19e9) - 1.0).abs() < 1e-12);
        assert_eq!(alternating(20e3).modulus, None);
    }

    /// What is not larger than rounding errors is found, whatever its sign; zeros and what is larger are not.
    #[test]
    fn rounding_errors_are_no_stress() {
        assert_eq!(only_rounding(&[0.0, 1e-9, -2e-9, f64::NAN], 1e-8), Some(2e-9));
        assert_eq!(only_rounding(&[0.0, 1e-9, -2e-8], 1e-8), None);
        assert_eq!(only_rounding(&[0.0, 0.0], 1e-8), None);
    }

    #[test]
    fn dimensionless_rows() {
        let tension = CurveFigures {
            gauge_modulus: None,
            sense: Sense::Tension,
            modulus: Some(27.03e9),
            fitted: 10,
            peak_stress: 3.475e6,
            peak_strain: 1.586e-4,
            rises: false,
        };
        let compression = CurveFigures { sense: Sense::Compression, peak_stress: -32.5e6, ..tension };
        let given = ReferenceFigures::stransky_specimen_1();
        let pair = Curves { tension: vec![tension], compression: vec![compression] };
        let known = |curves: &Curves, given: &ReferenceFigures| -> Vec<Row> {
            rows(curves, given).into_iter().filter(Row::is_known).collect()
        };
        let rows = known(&pair, &given);
        for row in &rows {
            let (ours, source) = (row.ours.unwrap().value, row.source.unwrap().middle());
            if row.symbol.starts_with('ε') {
                continue;
            }
            // The source's ratios are rounded to three or four digits.
            assert!((ours / source - 1.0).abs() < 5e-4, "{row:?}");
        }
        assert_eq!(rows.len(), 8);
        let symbols = |rows: &[Row]| rows.iter().map(|row| row.symbol).collect::<Vec<_>>();
        let none = ReferenceFigures::none(None, None);
        let alone = known(&Curves { tension: vec![tension], compression: vec![] }, &none);
        assert_eq!(symbols(&alone), ["E", "f<sub>t</sub>", "ε(f<sub>t</sub>)"]);
        assert!(alone.iter().all(|row| !row.rises && row.ours.unwrap().deviation.is_none()));
        // Two runs of one kind: mean and standard deviation, |a - b|/√2. One that still rises is named at all that follows from it.
        let stronger = CurveFigures { peak_stress: 3.675e6, rises: true, ..tension };
        let two = known(&Curves { tension: vec![tension, stronger], compression: vec![compression] }, &none);
        let strength = two.iter().find(|row| row.symbol == "f<sub>t</sub>").unwrap();
        let Mean { value, deviation } = strength.ours.unwrap();
        // Sums of two numbers of some MPa round by some nano-pascals.
        assert!((value - 3.575e6).abs() < 1e-6 && (deviation.unwrap() - 0.2e6 / 2.0_f64.sqrt()).abs() < 1e-6);
        let rising: Vec<&str> = two.iter().filter(|row| row.rises).map(|row| row.symbol).collect();
        assert_eq!(rising, ["f<sub>t</sub>", "f<sub>c</sub>/f<sub>t</sub>"]);
    }

    /// A curve that ends at its largest stress, or within a thousandth of it, has not passed a peak.
    #[test]
    fn a_curve_that_still_rises_has_no_peak() {
        let rises = |stress: &[f64]| CurveFigures::of(&[0.0, 1.0, 2.0, 3.0], stress).unwrap().rises;
        assert!(rises(&[0.0, 1.0, 2.0, 3.0]) && rises(&[0.0, -1.0, -2.0, -3.0]) && rises(&[0.0, 1.0, 3.0, 2.998]));
        assert!(!rises(&[0.0, 1.0, 3.0, 2.996]) && !rises(&[0.0, 1.0, -3.0, 3.0e-1]));
    }
}
