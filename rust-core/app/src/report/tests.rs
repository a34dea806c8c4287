//! Pages about synthetic results.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use super::cracks::{base64, share_of_scale};
use super::html::number;
use super::*;
use crate::output::{RunFiles, RunHeader, SeriesColumn, Snapshot, StoredSnapshot};
use concordem_contact::math::Vec3;
use concordem_solver::fracture::Event;
use concordem_solver::state::columns::{ColumnError, ColumnSink, WriteColumns};

struct Nothing;
impl WriteColumns for Nothing {
    fn write(&self, _: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        Ok(())
    }
}

/// A synthetic specimen: a curve with the given peak, an energy ledger that closes, and an inclined crack.
fn synthetic(path: &Path, peak_stress: f64, peak_strain: f64, title: &str) -> ResultFile {
    synthetic_run(path, peak_stress, peak_strain, format!("title = \"{title}\"\n# a < b & c\n"))
}

fn synthetic_run(path: &Path, peak_stress: f64, peak_strain: f64, scenario: String) -> ResultFile {
    synthetic_until(path, (peak_stress, peak_strain), scenario, 2.6)
}

/// The run ends at the strain of the peak times `end`.
#[expect(clippy::too_many_lines, reason = "a result file, table by table")]
fn synthetic_until(path: &Path, (peak_stress, peak_strain): (f64, f64), scenario: String, end: f64) -> ResultFile {
    const NAMES: [&str; 19] = [
        "time",
        "step",
        "strain",
        "stress",
        "kinetic",
        "stored_normal",
        "stored_shear",
        "stored_bending",
        "stored_twist",
        "damage",
        "friction",
        "viscous",
        "integration",
        "numerical_damping",
        "boundary_work",
        "external_work",
        "residual",
        "broken",
        "damaged",
    ];
    let header = RunHeader {
        scenario,
        provenance: vec![("threads".into(), "2".into()), ("time_step".into(), "2.4787e-7 s".into())],
        series: NAMES.map(|name| SeriesColumn::new(name, "1", "")).to_vec(),
        operators: vec![],
        earlier: BTreeMap::new(),
    };
    let mut files = RunFiles::create(path, header, false).unwrap();
    let modulus = 27e9 * peak_stress.signum();
    let volume = 1.25e-4;
    let (mut work, mut last) = (0.0, (0.0, 0.0));
    let mut random = 12345_u64;
    let mut uniform = || {
        random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (random >> 11) as f64 / (1_u64 << 53) as f64
    };
    let end = peak_strain * end;
    for k in 0..=300 {
        let strain = end * f64::from(k) / 300.0;
        let x = strain / peak_strain;
        // The curve is straight at first, rounded at the peak, and then softens.
        let initial = modulus * peak_strain.abs() / peak_stress;
        let stress = peak_stress * (initial * x) / (1.0 + (initial - 2.0) * x + x * x).max(initial * x * 0.2);
        work += 0.5 * (stress + last.1) * (strain - last.0) * volume;
        last = (strain, stress);
        let stored = (0.5 * stress * stress / 27e9 * volume).min(work);
        let lost = work - stored;
        let row = [
            strain / 0.4,
            f64::from(k),
            strain,
            stress,
            0.02 * lost,
            0.8 * stored,
            0.2 * stored,
            0.0,
            0.0,
            0.6 * lost,
            0.3 * lost,
            0.0,
            1e-9 * lost,
            0.08 * lost,
            work,
            0.0,
            1e-12 * work,
            f64::from(k),
            0.0,
        ];
        files.append_sample(&row).unwrap();
    }
    for k in 0..4000 {
        let (x, y) = (uniform() * 0.05, uniform() * 0.05);
        let z = 0.02 + 0.3 * x + 0.006 * (uniform() - 0.5) * (1.0 + 4.0 * uniform());
        files.append_event(Event {
            time: 0.0,
            step: k,
            id_a: k as u32,
            id_b: k as u32 + 1,
            position: Vec3::new(x, y, z),
            mode_shares: [1.0, 0.0, 0.0, 0.0],
            in_shear: false,
            energy: 1e-6,
            damage: 0.9 + 0.1 * uniform(),
            joint: None,
        });
    }
    let position = [Vec3::zeros(), Vec3::new(0.05, 0.05, 0.05)];
    let snapshot = Snapshot { time: 0.0, step: 0, id: &[0, 1], position: &position, cell: None, fields: vec![] };
    files.append_snapshot(Arc::new(StoredSnapshot::of(&snapshot).unwrap())).unwrap();
    files.note("wall_time", "71.2 s");
    files.finish(&Nothing, &Nothing).unwrap();
    ResultFile::open(path).unwrap()
}

#[test]
fn a_page_has_all_figures_and_loads_nothing_from_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    let tension = synthetic(&folder.path().join("tension.h5"), 3.5e6, 1.6e-4, "Cube <in> tension");
    let compression = synthetic(&folder.path().join("compression.h5"), -32e6, -1.9e-3, "Cube in compression");
    let page = page(&[tension, compression], &ReferenceFigures::stransky_specimen_1()).unwrap();
    for expected in [
        "Cube &lt;in&gt; tension · Cube in compression",
        // f_t, f_c, and their ratio: ours and published.
        "<td class=\"number\">3.500</td><td class=\"number\">3.475</td><td class=\"number\">+0.7 %</td><td class=\"number\">±6.0 %</td>",
        "<td class=\"number\">32.00</td><td class=\"number\">32.50</td><td class=\"number\">−1.5 %</td>",
        "<td class=\"number\">9.143</td><td class=\"number\">9.350</td>",
        "E/Ē",
        ": 4000 bonds. 300 bonds broke.",
        "Residual of the balance: at most",
        "1.00·10⁻¹² of the largest work",
        "<td>threads</td><td class=\"value\" colspan=\"2\">2</td>",
        "<td>wall time</td>",
        "# a &lt; b &amp; c",
    ] {
        assert!(page.contains(expected), "no {expected}");
    }
    // Charts have text alternatives, and peaks are labeled with their values.
    for expected in [
        "<svg class=\"chart\"",
        "role=\"img\"",
        "<title id=\"curve-tension-title\">Stress and strain in tension</title>",
        "published peak",
        ">3.500</text>",
        ">32.00</text>",
        "aria-label=\"Front view: 4000 bonds",
    ] {
        assert!(page.contains(expected), "no {expected}");
    }
    // The page loads no scripts, style sheets, or imports from elsewhere, and it is small.
    for loading in ["src=\"", "<link", "@import", "https://"] {
        assert!(!page.contains(loading), "{loading}");
    }
    assert!(page.len() < 150_000, "{} bytes", page.len());
    if let Ok(path) = std::env::var("CONCORDEM_TEST_REPORT") {
        std::fs::write(path, page).unwrap();
    }
}

/// Notched beams of three heights whose strengths follow `5 MPa/√(1 + D/50 mm)`; one beam of another concrete, and one of other proportions.
#[test]
fn beams_of_several_heights_give_the_size_effect() {
    let folder = tempfile::tempdir().unwrap();
    let template = concordem_scenario::schema::template("concrete-bending").unwrap().text;
    let beam = |name: &str, height: f64, span: f64, friction: &str| {
        let low = -0.5 * height - 2.0;
        let scenario = template
            .replacen(
                "[\"100 mm\", \"20 mm\", \"20 mm\"]",
                &format!("[\"{} mm\", \"20 mm\", \"{height} mm\"]", 4.5 * height),
                1,
            )
            .replacen("[0, \"-12 mm\", \"-12 mm\"]", &format!("[0, \"-12 mm\", \"{low} mm\"]"), 1)
            .replacen("[0, 0, \"8.7 mm\"]", &format!("[0, 0, \"{} mm\"]", 2.0 + height / 2.0), 1)
            .replacen("span = \"90 mm\"", &format!("span = \"{} mm\"", span * height), 1)
            .replacen("friction_coefficient = 0.8", friction, 1);
        let peak = 5e6 / (1.0 + height / 50.0).sqrt();
        synthetic_run(&folder.path().join(name), peak, 1.6e-4, scenario)
    };
    let usual = "friction_coefficient = 0.8";
    let mut inputs = Vec::from([10.0, 20.0, 40.0].map(|height| beam(&format!("{height}.h5"), height, 4.0, usual)));
    inputs.push(beam("other.h5", 30.0, 4.0, "friction_coefficient = 0.7"));
    inputs.push(beam("long.h5", 30.0, 4.1, usual));
    // Beams whose cuts are no notch have no law, and are not those without a cut.
    let sphere = "\n[[cut]]\nshape = { kind = \"sphere\", center = [0, 0, 0], radius = \"1 mm\" }\n";
    for height in [15.0, 25.0, 35.0] {
        inputs.push(beam(&format!("cut-{height}.h5"), height, 4.0, &format!("{usual}{sphere}")));
    }
    let html = page(&inputs, &ReferenceFigures::default()).unwrap();
    // The peak of the curve is at a sample, so that its strength is exact.
    for text in [
        "<h2>Size effect</h2>",
        "notch 0.5000 of the height: 3 beams of 10.00, 20.00, 40.00 mm",
        "5.000 ± ",
        "50.00 ± ",
        "K<sub>If</sub>",
    ] {
        assert!(html.contains(text), "{text}");
    }
    assert!(!html.contains("no notch: "), "beams with other cuts");
    assert!(
        !page(&inputs[1..], &ReferenceFigures::default()).unwrap().contains("Size effect"),
        "two heights are not enough"
    );
}

#[test]
fn a_result_without_a_specimen_is_not_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    let series = ["strain", "stress"].map(|name| SeriesColumn::new(name, "1", "")).to_vec();
    let header = RunHeader {
        scenario: "not even TOML =".into(),
        provenance: vec![],
        series,
        operators: vec![],
        earlier: BTreeMap::new(),
    };
    RunFiles::create(&path, header, false).unwrap().finish(&Nothing, &Nothing).unwrap();
    let empty = page(&[ResultFile::open(&path).unwrap()], &ReferenceFigures::none(None, None)).unwrap();
    assert!(empty.contains("No bond reached the damage") && !empty.contains("Energy balance"));
    assert!(matches!(page(&[], &ReferenceFigures::default()), Err(OutputError::Report { .. })));
}

#[test]
fn the_color_scale_has_equal_steps_per_power_of_ten_of_the_remaining_stiffness() {
    assert_eq!(share_of_scale(0.2), 0.0, "below the scale");
    assert_eq!(share_of_scale(0.5), 0.0);
    assert_eq!(share_of_scale(1.0), 1.0, "no stiffness left");
    // Equal steps per factor of ten in the remaining stiffness, up to the rounding of 1 - 0.99 and 1 - 0.999.
    let steps = [0.9, 0.99, 0.999].map(share_of_scale);
    assert!(((steps[2] - steps[1]) - (steps[1] - steps[0])).abs() < 1e-12, "{steps:?}");
}

/// The page about a result, without its scenario, and without the parameters of the materials, among which are moduli.
fn before_materials(result: &ResultFile) -> String {
    before_provenance(result).split_once("<h2>Materials</h2>").unwrap().0.to_owned()
}

/// The page about a result, without its scenario.
fn before_provenance(result: &ResultFile) -> String {
    let html = page(std::slice::from_ref(result), &ReferenceFigures::default()).unwrap();
    html.split_once("<h2>Provenance</h2>").unwrap().0.to_owned()
}

/// Table and chart name slope and largest stress by the kind of loading, with the values of the curve.
#[test]
fn slope_and_largest_stress_have_the_names_of_their_loading() {
    let folder = tempfile::tempdir().unwrap();
    let sheared = ("    [0, 0, 0],", "    [0, 0, 0.1],");
    let unstrained = ("[0, 0, 0.4],", "[0, 0, 0],");
    let membrane = ("[loading]", "[[membrane]]\npressure = \"1 MPa\"\nopen_along = \"z\"\n[loading]");
    for (template, changes, (symbol, slope), largest) in [
        ("cpm-small", &[][..], ("E", "Young’s modulus, from the strain between the ends"), "tensile strength"),
        ("cpm-small", &[membrane], ("dσ/dε", "no Young’s modulus"), "largest axial stress of the enclosed specimen"),
        ("cpm-periodic", &[], ("M", "oedometric modulus"), "largest axial stress, the other axes keep their length"),
        ("cpm-periodic", &[sheared, unstrained], ("G", "shear modulus"), "largest shear stress"),
        ("concrete-triaxial", &[], ("dσ/dε", "slope beside a lateral stress"), "beside the lateral stress"),
        ("beam-bending", &[], ("E<sub>b</sub>", "modulus in bending"), "largest nominal stress in the outer fiber"),
        ("beam-torsion", &[], ("G", "shear modulus in torsion"), "largest shear stress"),
    ] {
        let mut scenario = concordem_scenario::schema::template(template).unwrap().text.to_owned();
        for (from, to) in changes {
            assert!(scenario.contains(from), "{template}: {from}");
            scenario = scenario.replacen(from, to, 1);
        }
        let path = folder.path().join(format!("{template}-{}.h5", changes.len()));
        let result = synthetic_run(&path, 3.5e6, 1.6e-4, scenario);
        let [strain, stress] = ["strain", "stress"].map(|name| result.samples(name).unwrap());
        let modulus = CurveFigures::of(&strain, &stress).unwrap().modulus.unwrap();
        let html = before_provenance(&result);
        let gpa = number(modulus * 1e-9);
        let row = html.lines().find(|line| line.contains(&format!("<td class=\"symbol\">{symbol}</td>"))).unwrap();
        assert!(row.contains(slope) && row.contains(&format!("<td class=\"number\">{gpa}</td>")), "{template}: {row}");
        assert!(html.contains(largest) && html.contains("3.500</td>"), "{template}: {largest}");
        let legend = symbol.replace("<sub>", "").replace("</sub>", "");
        assert!(html.contains(&format!("{legend} = {gpa} GPa")), "{template}: {legend}");
    }
    // A beam with a notch has no modulus either, one name for its strength, and forces over the deflection.
    let notched = concordem_scenario::schema::template("concrete-bending").unwrap().text;
    let result = synthetic_run(&folder.path().join("notched.h5"), 3.5e6, 1.6e-4, notched.to_owned());
    let html = before_materials(&result);
    assert!(!html.contains(" GPa") && html.contains("<h3>In bending, with a cut</h3>") && !html.contains("In tension"));
    assert_eq!(html.matches("f<sub>fl</sub>").count(), 1, "one name of the strength");
    assert!(html.contains("<h3>Force over the deflection</h3>"));
    // A cylinder that splits has no modulus.
    let splitting = concordem_scenario::schema::template("concrete-splitting").unwrap().text;
    let result = synthetic_run(&folder.path().join("splitting.h5"), 3.5e6, 1.6e-4, splitting.to_owned());
    let html = before_materials(&result);
    assert!(html.contains("splitting strength") && !html.contains(" GPa"), "a modulus");
    assert!(
        !html.contains("Stress and strain") && !html.contains("In tension"),
        "the approach of the plates is no strain"
    );
}

/// Runs of one material share a column, with the mean of those of one kind; another material has its own, without the published values.
#[test]
fn only_runs_of_one_material_are_combined() {
    let folder = tempfile::tempdir().unwrap();
    let template = concordem_scenario::schema::template("cpm-small").unwrap().text;
    let run = |name: &str, peak: f64, from: &str, to: &str| {
        assert!(template.contains(from), "{from}");
        synthetic_run(&folder.path().join(name), peak, 1.6e-4 * peak.signum(), template.replacen(from, to, 1))
    };
    let inputs = [
        run("first.h5", 3e6, "seed = 1 ", "seed = 1 "),
        run("second.h5", 4e6, "seed = 1 ", "seed = 2 "),
        run("pressed.h5", -35e6, "seed = 1 ", "seed = 3 "),
        run("granite.h5", -90e6, "young = \"25 GPa\"", "young = \"60 GPa\""),
    ];
    let one = page(&inputs[..3], &ReferenceFigures::stransky_specimen_1()).unwrap();
    let row = |html: &str, symbol: &str| -> Vec<String> {
        let line =
            html.lines().find(|line| line.starts_with(&format!("<tr><td class=\"symbol\">{symbol}</td>"))).unwrap();
        line.split("<td class=\"number\">").skip(1).map(|cell| cell.split('<').next().unwrap().to_owned()).collect()
    };
    // The standard deviation of 3 and 4 MPa is 1/√2.
    assert_eq!(row(&one, "f<sub>t</sub>")[..2], ["3.500 ± 0.7071", "3.475"]);
    // The samples beside the peak of such a curve are lower by (1 − x)²/(x i), with x = 0.9967 of its strain and i the ratio of the first slope to
    // that to the peak: 9e-5 at 35 MPa, 2.3e-4 at 90 MPa.
    let ratio: f64 = row(&one, "f<sub>c</sub>/f<sub>t</sub>")[0].parse().unwrap();
    assert!((ratio / 10.0 - 1.0).abs() < 2e-4, "{ratio}");
    assert!(
        one.contains(">simulation</th>")
            && one.contains("in tension of first.h5, second.h5")
            && !one.contains("Each column")
    );
    let two = page(&inputs, &ReferenceFigures::stransky_specimen_1()).unwrap();
    let strengths = row(&two, "f<sub>c</sub>");
    assert_eq!([&strengths[0], &strengths[2]], ["35.00", "32.50"]);
    assert!((strengths[1].parse::<f64>().unwrap() / 90.0 - 1.0).abs() < 3e-4, "{strengths:?}");
    assert_eq!(row(&two, "f<sub>c</sub>/f<sub>t</sub>")[1], "–", "granite was not pulled");
    assert!(
        two.contains("granite.h5</span></th>") && two.contains("Each column") && two.contains("published for concrete")
    );
    // The difference is that of the material with published values: 35 of 32.5 MPa.
    assert_eq!(row(&two, "f<sub>c</sub>")[3], "+7.7 %");
    assert!(two.contains("Bonds of concrete: Ē = 60.00 GPa"), "each material has its bonds");
}

/// A page says of which runs the largest stress is no strength.
#[test]
fn a_stress_that_still_rises_is_no_strength() {
    let folder = tempfile::tempdir().unwrap();
    let template = concordem_scenario::schema::template("cpm-small").unwrap().text;
    let note = "the stress still rises at the end of the run";
    let whole = synthetic_run(&folder.path().join("whole.h5"), 3.5e6, 1.6e-4, template.to_owned());
    let html = before_provenance(&whole);
    assert!(!html.contains("still rises"));
    // The records end before the peak.
    let short = synthetic_until(&folder.path().join("short.h5"), (3.5e6, 1.6e-4), template.to_owned(), 0.5);
    let html = before_provenance(&short);
    assert!(
        html.contains(&format!("tensile strength, MPa; {note}"))
            && html.contains("The stress still rises at the end of short.h5")
    );
    let found =
        |result: &ResultFile| properties(result).unwrap().into_iter().find(|(name, _)| name == RISES).unwrap().1;
    assert_eq!((found(&whole), found(&short)), (0.0, 1.0));
}

#[test]
fn numbers_have_four_significant_digits() {
    for (value, text) in [
        (27.034_f64, "27.03"),
        (3.4749e-2, "0.03475"),
        (-1.859, "−1.859"),
        (12345.6, "12346"),
        (0.0, "0"),
        (1.5e-9, "1.50·10⁻⁹"),
        (f64::NAN, "not a number"),
    ] {
        assert_eq!(number(value), text);
    }
}

/// Test vectors of RFC 4648, section 10.
#[test]
fn base64_agrees_with_the_standard() {
    for (text, expected) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
        assert_eq!(base64(text.as_bytes()), expected);
    }
}

/// The scatter beside published values is that of the five packings of the study, to half a unit of its last digit.
#[test]
fn the_scatter_is_that_of_the_study() {
    let text = include_str!("../../../../validation/results/specimens.json");
    let study: serde_json::Value = serde_json::from_str(text).unwrap();
    let of = |path: &[&str]| -> f64 {
        let values: Vec<f64> = (1..=5)
            .map(|seed| {
                let case = &study["cases"][format!("as published, seed {seed}")];
                path.iter().fold(case, |at, key| &at[*key]).as_f64().unwrap()
            })
            .collect();
        let mean = values.iter().sum::<f64>() / 5.0;
        (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / 4.0).sqrt() / mean.abs()
    };
    let figures = ReferenceFigures::stransky_specimen_1();
    for (given, path) in [
        (figures.modulus, &["tension", "young_pa"][..]),
        (figures.modulus_ratio, &["young_over_link_modulus"]),
        (figures.tensile_strength, &["tension", "peak_stress_pa"]),
        (figures.tensile_ratio, &["tensile_strength_over_onset"]),
        (figures.tensile_strain, &["tension", "strain_at_peak"]),
        (figures.compressive_strength, &["compression", "peak_stress_pa"]),
        (figures.compressive_strain, &["compression", "strain_at_peak"]),
        (figures.strength_ratio, &["strength_ratio"]),
    ] {
        let (given, found) = (given.unwrap().scatter.unwrap(), of(path));
        assert!((given - found).abs() <= 0.51e-3, "{path:?}: {given} {found}");
    }
}

/// A result of a cell under lateral pressure, whose stresses are known: compression beyond a peak of the deviator of 30 MPa at 4 ‰, under 5 MPa. The volume
/// shrinks by a third of the strain. In extension the deviator is the opposite, and the volume grows.
#[test]
fn deviator_and_volume_under_lateral_pressure() {
    let folder = tempfile::tempdir().unwrap();
    for sign in [-1.0, 1.0] {
        let path = folder.path().join(format!("{sign}.h5"));
        let names = ["time", "step", "strain", "stress", "lateral_stress", "volumetric_strain"];
        let header = RunHeader {
            scenario: concordem_scenario::schema::template("concrete-triaxial").unwrap().text.to_owned(),
            provenance: vec![("ended_utc".into(), "2026-11-30 18:05".into()), ("time_step_s".into(), "1e-7".into())],
            series: names.map(|name| SeriesColumn::new(name, "1", "")).to_vec(),
            operators: vec![],
            earlier: BTreeMap::new(),
        };
        let mut files = RunFiles::create(&path, header, false).unwrap();
        for k in 0..=8 {
            let (k, strain) = (f64::from(k), 1e-3 * f64::from(k));
            let deviator = 30e6 - 30e6 * (strain / 4e-3 - 1.0).powi(2);
            files
                .append_sample(&[1e-6 * k, k, sign * strain, sign * deviator - 5e6, -5e6, sign * strain / 3.0])
                .unwrap();
        }
        files.finish(&Nothing, &Nothing).unwrap();
        let result = ResultFile::open(&path).unwrap();
        let found: Vec<String> =
            summary(&result).unwrap().into_iter().map(|p| format!("{} {}", p.symbol, p.value)).collect();
        let positive = if sign < 0.0 { "compaction" } else { "dilation" };
        for expected in
            ["q_max 30.00 MPa", "p_l 5.000 MPa", &format!("ε_v 1.333 ‰, volumetric strain at it, {positive} positive")]
        {
            assert!(found.iter().any(|text| text.starts_with(expected)), "{expected}: {found:?}");
        }
        let page = page(&[result], &ReferenceFigures::none(None, None)).unwrap();
        for expected in [
            "Under lateral pressure",
            "triaxial-0-deviator",
            positive,
            "of 2026-11-30 18:05 UTC",
            "time step, s",
            "cpm: cohesion",
        ] {
            assert!(page.contains(expected), "{expected}");
        }
    }
}
