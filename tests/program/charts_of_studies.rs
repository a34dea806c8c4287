//! What pages of structures, sweeps, and standard tests show is what is in their files.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use concordem::math::{Vec3, sin_cos};
use concordem::operator::structure::Geode;
use concordem::output::{ResultFile, RunFiles, RunHeader, SeriesColumn};
use concordem::program::exit;
use concordem::state::columns::{ColumnError, ColumnSink, WriteColumns};
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

use crate::CELL;
use crate::drawing::{Drawing, attribute, between, is_written, number, rows, section};

fn real(value: &serde_json::Value) -> f64 {
    value.as_f64().expect("a number")
}

fn list(value: &serde_json::Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(real).collect()
}

/// A number of a file, as a page writes it.
fn cell_of(table: &[Vec<String>], name: &str) -> String {
    let row = table.iter().find(|row| row.first().is_some_and(|first| first.starts_with(name)));
    row.unwrap_or_else(|| panic!("no {name} in {table:?}"))[1].clone()
}

/// The bars of the radii are the counts of the file, and the rose is made of the densities of the file: each face of the geode that points to
/// the viewer lies as far from the middle as its density, in the color of that density.
#[test]
fn radii_and_rose_of_a_packing_are_those_of_its_json_file() {
    let folder = TempDir::new().expect("a temporary folder");
    let cell = write(
        folder.path(),
        "cell.toml",
        &CELL.replace(
            "count = 60\nradius = \"1 mm\"",
            "count = 120\nradii = { kind = \"uniform\", minimum = \"0.7 mm\", maximum = \"1.3 mm\" }",
        ),
    );
    let given = concordem(["characterise", text(&cell)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let page = std::fs::read_to_string(folder.path().join("cell.structure.html")).expect("a page");
    let json = std::fs::read_to_string(folder.path().join("cell.structure.json")).expect("a file");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");

    let radii = &json["radii"];
    let (low, high, counts) = (real(&radii["smallest"]), real(&radii["largest"]), list(&radii["counts"]));
    assert_eq!(counts.iter().sum::<f64>(), 120.0);
    assert!(low < 0.8e-3 && high > 1.2e-3, "{radii}");
    let side = |k: usize| 1e3 * (low + (high - low) * k as f64 / counts.len() as f64);
    let bars = counts.iter().enumerate().flat_map(|(k, count)| [(side(k), *count), (side(k + 1), *count)]);
    let outline = std::iter::once((side(0), 0.0)).chain(bars).chain([(side(counts.len()), 0.0)]);
    Drawing::of(&page, "radii").shows("Radii", outline);
    let table = rows(&page);
    is_written(cell_of(&table, "Mean radius").trim_end_matches(" m"), real(&radii["mean"]));
    let dispersion = number(cell_of(&table, "Dispersion").trim_end_matches(" %"));
    assert!((dispersion - 100.0 * real(&radii["dispersion"])).abs() <= 0.0501, "{dispersion}");

    let densities = list(&json["isotropy"]["densities"]);
    let (geode, rose) = (Geode::new(), between(&page, "<svg class=\"rose\"", "</svg>"));
    let half = 0.5 * number(attribute(rose, "width"));
    let unit = number(attribute(between(rose, "<circle", "/>"), "r"));
    assert_eq!(attribute(rose, "cx"), format!("{half}"));
    let drawn: BTreeSet<(String, String)> = rose
        .split("<polygon")
        .skip(1)
        .map(|polygon| (attribute(polygon, "points").to_owned(), attribute(polygon, "fill").to_owned()))
        .collect();
    // The viewer stands at an azimuth of 0.6 and an elevation of 0.45 rad.
    let ((sin_a, cos_a), (sin_e, cos_e)) = (sin_cos(0.6), sin_cos(0.45));
    let (toward, right) = (Vec3::new(cos_a * cos_e, sin_a * cos_e, sin_e), Vec3::new(-sin_a, cos_a, 0.0));
    let up = toward.cross(&right);
    let mut colors = BTreeSet::new();
    for (face, &density) in geode.faces().iter().zip(&densities) {
        let [a, b, c] = face.map(|corner| corner * density.min(1.8));
        if (b - a).cross(&(c - a)).dot(&toward) <= 0.0 {
            continue;
        }
        let place = |x: &Vec3| format!("{:.1},{:.1}", half + unit * x.dot(&right), half - unit * x.dot(&up));
        // From gray at 1 to red at 1.5, and to blue at 0.5.
        let share = ((density - 1.0) / 0.5).clamp(-1.0, 1.0);
        let end = if share < 0.0 { [38.0, 92.0, 160.0] } else { [190.0, 60.0, 30.0] };
        let [red, green, blue] = end.map(|end: f64| (218.0 + (end - 218.0) * share.abs()).round());
        let polygon = ([a, b, c].each_ref().map(place).join(" "), format!("rgb({red},{green},{blue})"));
        assert!(drawn.contains(&polygon), "a face of density {density} is not drawn: {polygon:?}");
        colors.insert(polygon.1);
    }
    assert!(colors.len() > 10, "{colors:?}");
    let links: f64 = densities.iter().zip(geode.shares()).map(|(density, share)| density * share).sum();
    assert!((links - 1.0).abs() < 1e-12, "shares of all links: {links}");
}

/// Curves and rows of a sweep of structures are the means of its points; each curve has its own name.
#[test]
fn page_of_a_sweep_of_structures_has_the_means_of_its_points() {
    let folder = TempDir::new().expect("a temporary folder");
    let block = CELL
        .replace(
            "seed = 1\n[packing.shape]\nkind = \"periodic\"",
            "seed = 1\n[packing.shape]\nkind = \"box\"\nsize = [\"9 mm\", \"9 mm\", \"9 mm\"]",
        )
        .replace("count = 60", "count = 200");
    write(folder.path(), "block.toml", &block);
    let sweep = "version = 1\nscenario = \"block.toml\"\nstudy = \"structure\"\n\
                 [[axis]]\nname = \"z\"\nkey = \"bonds.coordination\"\nvalues = [8, 9, 10]\n\
                 [[axis]]\nkey = \"packing.seed\"\nvalues = [1, 2]\naverage = true\n";
    let sweep = write(folder.path(), "sweep.toml", sweep);
    let given = concordem(["sweep", "-q", "--csv", text(&sweep)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let page = std::fs::read_to_string(folder.path().join("sweep.html")).expect("a page");
    let csv = std::fs::read_to_string(folder.path().join("sweep.csv")).expect("a table");
    let heads: Vec<&str> = csv.lines().next().expect("heads").split(',').map(|head| head.trim_matches('"')).collect();
    let column = |name: &str| -> Vec<f64> {
        let k = heads.iter().position(|head| *head == name).unwrap_or_else(|| panic!("no {name} in {heads:?}"));
        csv.lines().skip(1).map(|line| line.split(',').nth(k).expect("a cell").parse().expect("a number")).collect()
    };
    let along = column("z");
    assert_eq!(along.len(), 6);
    let means = |name: &str| {
        let values = column(name);
        [8.0, 9.0, 10.0].map(|at| {
            let own = along.iter().zip(&values).filter(|(other, _)| **other == at).map(|(_, value)| *value);
            (at, own.clone().sum::<f64>() / own.count() as f64)
        })
    };
    let sum = |a: [(f64, f64); 3], b: [(f64, f64); 3]| [0, 1, 2].map(|k| (a[k].0, a[k].1 + b[k].1));
    let independent = sum(means("isotropy_floor_percent"), means("isotropy_noise_percent"));
    let all = [
        ("over-0-0", "all", means("links_per_sphere")),
        ("over-0-0", "all, at the boundary", means("links_at_boundary")),
        ("over-0-1", "all", means("hull_fraction")),
        ("over-0-1", "all, effective", means("effective_fraction")),
        ("over-0-2", "all", means("isotropy_percent")),
        ("over-0-2", "all, independent links", independent),
        ("over-0-3", "all", means("overlap")),
    ];
    for (chart, name, points) in all {
        let chart = Drawing::of(&page, chart);
        chart.shows(name, points);
        let mut names = chart.names();
        names.sort_unstable();
        let count = names.len();
        names.dedup();
        assert_eq!(names.len(), count, "{names:?}");
    }
    let table: Vec<Vec<String>> = rows(section(&page, "All points")).into_iter().filter(|row| row.len() > 2).collect();
    assert_eq!(table.len(), 3, "{table:?}");
    let columns = [
        "spheres",
        "links_per_sphere",
        "links_at_boundary",
        "hull_fraction",
        "shape_fraction",
        "effective_fraction",
        "isotropy_percent",
    ];
    for (k, name) in columns.into_iter().enumerate() {
        for (row, (at, mean)) in table.iter().zip(means(name)) {
            assert_eq!(number(&row[0]), at);
            is_written(row[k + 1].split(" ± ").next().expect("a mean"), mean);
        }
    }
}

struct Nothing;
impl WriteColumns for Nothing {
    fn write(&self, _: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        Ok(())
    }
}

/// A result with this curve of strain and stress (Pa).
fn result(path: &Path, scenario: &str, curve: &[(f64, f64)]) -> ResultFile {
    let series = ["strain", "stress"].map(|name| SeriesColumn::new(name, "1", "")).to_vec();
    let header = RunHeader {
        scenario: scenario.to_owned(),
        provenance: vec![("specimen_length_m".into(), "0.042".into())],
        series,
        operators: vec![],
        earlier: BTreeMap::new(),
    };
    let mut files = RunFiles::create(path, header, false).expect("a result");
    for (strain, stress) in curve {
        files.append_sample(&[*strain, *stress]).expect("a record");
    }
    files.finish(&Nothing, &Nothing).expect("a result");
    ResultFile::open(path).expect("a result")
}

/// A curve with a peak (Pa) at a strain, which falls to a tenth of it.
fn curve(peak: f64, strain: f64) -> Vec<(f64, f64)> {
    let stress = |x: f64| if x < 1.0 { peak * x } else { peak * (1.0 - 0.45 * (x - 1.0)) };
    (0..=30).map(|k| (strain * 0.1 * f64::from(k), stress(0.1 * f64::from(k)))).collect()
}

/// The page about results.
fn report(folder: &Path, results: &[&str]) -> String {
    let page = folder.join("report.html");
    let paths: Vec<String> = results.iter().map(|name| text(&folder.join(name)).to_owned()).collect();
    let mut arguments = vec!["report", "--force", "-o", text(&page)];
    arguments.extend(paths.iter().map(String::as_str));
    let given = concordem(arguments);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    std::fs::read_to_string(page).expect("a page")
}

/// Area below the curve that a file holds.
fn area(result: &ResultFile) -> f64 {
    let [strain, stress] = ["strain", "stress"].map(|name| result.samples(name).expect("a series"));
    strain.windows(2).zip(stress.windows(2)).map(|(e, s)| 0.5 * (s[0] + s[1]) * (e[1] - e[0])).sum()
}

fn peak(result: &ResultFile) -> f64 {
    result.samples("stress").expect("a series").into_iter().fold(0.0, f64::max)
}

/// The scenario of the template of a notched beam of this height (mm), with a span of four heights.
fn beam(height: f64) -> String {
    let template = concordem::scenario::template("concrete-bending").expect("a template").text;
    let changes = [
        ("[\"100 mm\", \"20 mm\", \"20 mm\"]", format!("[\"{} mm\", \"20 mm\", \"{height} mm\"]", 4.5 * height)),
        ("[0, \"-12 mm\", \"-12 mm\"]", format!("[0, \"-12 mm\", \"{} mm\"]", -0.5 * height - 2.0)),
        ("[0, 0, \"8.7 mm\"]", format!("[0, 0, \"{} mm\"]", 2.0 + height / 2.0)),
        ("span = \"90 mm\"", format!("span = \"{} mm\"", 4.0 * height)),
    ];
    changes.iter().fold(template.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    })
}

/// Strength, toughness, and work of fracture of notched beams, with other forms of the formulas than the program has; crosses and fitted
/// line of the size effect; the table of the fit.
#[test]
fn tests_of_beams_are_those_of_their_files() {
    let folder = TempDir::new().expect("a temporary folder");
    let heights = [10.0, 20.0, 40.0];
    // On no law exactly, so that the fit has an error.
    let noise = [1.01, 0.98, 1.005];
    let mut strengths = Vec::new();
    let mut files = Vec::new();
    for (height, noise) in heights.into_iter().zip(noise) {
        let wanted = noise * 5e6 / (1.0_f64 + height / 50.0).sqrt();
        let file = result(&folder.path().join(format!("{height}.h5")), &beam(height), &curve(wanted, 1e-4));
        strengths.push(peak(&file));
        files.push(file);
    }
    let page = report(folder.path(), &["10.h5", "20.h5", "40.h5"]);
    let table: Vec<Vec<String>> =
        rows(section(&page, "Results of the test")).into_iter().filter(|row| row.len() == 4).collect();
    assert_eq!(table.len(), 9, "{table:?}");
    for ((file, height), rows) in files.iter().zip(heights).zip(table.chunks(3)) {
        let (h, width, notch) = (1e-3 * height, 20e-3, 0.5e-3 * height);
        let symbols: Vec<&str> = rows.iter().map(|row| row[1].as_str()).collect();
        assert_eq!(symbols, ["ffl", "KIc", "GF"]);
        is_written(&rows[0][3], 1e-6 * peak(file));
        // ASTM E399: K = (F l / (b h^1.5)) f(α) with f(0.5) = 2.6627 to four digits.
        let force = 2.0 * width * h * h * peak(file) / (3.0 * 4.0 * h);
        let toughness = force * 4.0 * h / (width * h.powf(1.5)) * 2.6627;
        assert!((number(&rows[1][3]) / (1e-6 * toughness) - 1.0).abs() < 1e-3, "{rows:?} {toughness}");
        // Force and deflection of a beam in three points: F = 2bh²σ/(3l), w = l²ε/(6h); over the ligament.
        let work = 2.0 * width * h * h / (3.0 * 4.0 * h) * (16.0 * h * h / (6.0 * h)) * area(file);
        is_written(&rows[2][3], work / (width * (h - notch)));
        assert!(rows[2][2].contains("10.0 %"), "{rows:?}");
    }

    let name = "notch 0.5000 of the height";
    let chart = Drawing::of(&page, "size-effect");
    assert_eq!(chart.names(), [name, &format!("fit, {name}")]);
    chart.shows(name, heights.into_iter().zip(strengths.iter().map(|strength| 1e-6 * strength)));
    // The line 1/σ² = a + c D through three points, by the normal equations.
    let (x, y): (Vec<f64>, Vec<f64>) = heights.iter().zip(&strengths).map(|(h, s)| (*h, (1e-6 * s).powi(-2))).unzip();
    let [sx, sy] = [&x, &y].map(|all| all.iter().sum::<f64>());
    let [sxx, sxy] = [&x, &y].map(|all| all.iter().zip(&x).map(|(a, b)| a * b).sum::<f64>());
    let slope = (3.0 * sxy - sx * sy) / (3.0 * sxx - sx * sx);
    let start = (sy - slope * sx) / 3.0;
    let law = |height: f64| (start + slope * height).powf(-0.5);
    chart.shows(
        &format!("fit, {name}"),
        (0..=40).map(|k| 10.0 * 4.0_f64.powf(f64::from(k) / 40.0)).map(|d| (d, law(d))),
    );
    let table: Vec<Vec<String>> =
        rows(section(&page, "Size effect")).into_iter().filter(|row| row.len() == 4).collect();
    let values: Vec<&str> = table.iter().map(|row| row[3].split(" ± ").next().expect("a value")).collect();
    assert_eq!(table.iter().map(|row| row[1].as_str()).collect::<Vec<_>>(), ["B ft", "D0", "KIf"]);
    is_written(values[0], start.powf(-0.5));
    is_written(values[1], start / slope);
    // K = (2/3) σ √h f(0.5) on a span of four heights, of infinitely large beams: σ √h = 1/√c.
    let toughness = 2.0 / 3.0 * (slope * 1e3).powf(-0.5) * 2.6627;
    assert!((number(values[2]) / toughness - 1.0).abs() < 1e-3, "{values:?} {toughness}");
}

/// A cylinder that splits, and a bar in tension that breaks.
#[test]
fn tests_of_cylinders_and_bars_are_those_of_their_files() {
    let folder = TempDir::new().expect("a temporary folder");
    let template = |name: &str| concordem::scenario::template(name).expect("a template").text;
    let cylinder = result(&folder.path().join("cylinder.h5"), template("concrete-splitting"), &curve(3.3e6, 2e-4));
    let page = report(folder.path(), &["cylinder.h5"]);
    let table = rows(section(&page, "Results of the test"));
    let row = |table: &[Vec<String>], symbol: &str| {
        let found = table.iter().find(|row| row.get(1).is_some_and(|other| other == symbol));
        found.unwrap_or_else(|| panic!("no {symbol} in {table:?}")).clone()
    };
    let strength = row(&table, "fst");
    assert!(strength[2].contains("2F/(π D L)"), "{strength:?}");
    is_written(&strength[3], 1e-6 * peak(&cylinder));
    assert!(!page.contains("<h2>Size effect</h2>"));

    // Its strains refer to the length of 42 mm that the file names.
    let bar = result(&folder.path().join("bar.h5"), template("cpm-small"), &curve(2.5e6, 1e-4));
    let page = report(folder.path(), &["bar.h5"]);
    let energy = row(&rows(section(&page, "Results of the test")), "GF");
    assert!(energy[2].contains("10.0 %"), "{energy:?}");
    is_written(&energy[3], 42e-3 * area(&bar));
}
