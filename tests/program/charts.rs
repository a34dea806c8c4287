//! What charts and tables of a page show is what is in the file, to the width of a line and the digits of a number.

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem::state::columns::ColumnData;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

use crate::drawing::{Drawing, is_written, number, rows, section};
use crate::pages::page_of_prism;
use crate::{CELL, PRISM};

/// Components of a symmetric tensor, and their places among nine numbers.
const TENSOR: [(&str, usize); 6] = [("xx", 0), ("yy", 4), ("zz", 8), ("xy", 1), ("yz", 5), ("zx", 6)];

fn samples(result: &ResultFile, name: &str) -> Vec<f64> {
    result.samples(name).expect("a series")
}

/// The curve, its peak, and the slope at its beginning: drawn, named, and in the table.
#[test]
fn curve_and_its_figures_are_those_of_the_file() {
    let folder = TempDir::new().expect("a temporary folder");
    let (page, result) = page_of_prism(folder.path());
    let (strain, stress) = (samples(&result, "strain"), samples(&result, "stress"));
    let chart = Drawing::of(&page, "curve-tension");
    let [curve, slope] = chart.names()[..] else { panic!("{:?}", chart.names()) };
    assert_eq!((curve, chart.along.as_str()), ("prism.h5", "strain, ‰"));
    chart.shows(curve, strain.iter().zip(&stress).map(|(e, s)| (1e3 * e, 1e-6 * s)));
    let (at, peak) =
        strain.iter().zip(&stress).fold((0.0, 0.0), |most, (e, s)| if *s > most.1 { (*e, *s) } else { most });
    assert!(stress.last().is_some_and(|last| *last < 0.9 * peak), "the prism does not soften");
    // The straight line through the beginning of the curve, up to 30 % of the peak, by least squares.
    let fitted: Vec<[f64; 2]> =
        strain.iter().zip(&stress).take_while(|(_, s)| **s <= 0.3 * peak).map(|(e, s)| [*e, *s]).collect();
    let count = fitted.len() as f64;
    let mean = [0, 1].map(|k: usize| fitted.iter().map(|point| point[k]).sum::<f64>() / count);
    let product =
        |i: usize, j: usize| fitted.iter().map(|point| (point[i] - mean[i]) * (point[j] - mean[j])).sum::<f64>();
    let modulus = product(0, 1) / product(0, 0);
    let gigapascals = slope.strip_prefix("E = ").and_then(|text| text.split(" GPa").next()).expect("a modulus");
    assert!(slope.contains(" GPa (middle half "), "{slope}");
    is_written(gigapascals, 1e-9 * modulus);
    chart.shows(slope, [(0.0, 0.0), (1e3 * peak / modulus, 1e-6 * peak)]);
    let table = rows(section(&page, "Stiffness and strength"));
    let cell = |symbol: &str| {
        let row = table.iter().find(|row| row.first().is_some_and(|first| first == symbol));
        row.unwrap_or_else(|| panic!("no {symbol} in {table:?}"))[2].clone()
    };
    is_written(&cell("E"), 1e-9 * modulus);
    is_written(&cell("ft"), 1e-6 * peak);
    is_written(&cell("ε(ft)"), 1e3 * at);
    assert!(page.contains(&format!(">{}</text>", cell("ft"))), "the peak has its value");
}

/// Each energy is an area on top of those before; the line is the work; the table has the last values.
#[test]
fn stacked_energies_are_those_of_the_file() {
    let folder = TempDir::new().expect("a temporary folder");
    let (page, result) = page_of_prism(folder.path());
    let strain = samples(&result, "strain");
    let chart = Drawing::of(&page, "energy-0");
    assert_eq!(chart.along, "strain, ‰ (magnitude)");
    let stored = ["stored_normal", "stored_shear", "stored_bending", "stored_twist"];
    let terms: [(&str, &[&str]); 5] = [
        ("stored in bonds and contacts", &stored),
        ("motion", &["kinetic"]),
        ("damage and breaking", &["damage"]),
        ("friction and plastic slip", &["friction"]),
        ("artificial damping", &["numerical_damping"]),
    ];
    let sum = |names: &[&str]| {
        let mut sum = vec![0.0; strain.len()];
        for name in names {
            sum.iter_mut().zip(samples(&result, name)).for_each(|(sum, value)| *sum += 1e3 * value);
        }
        sum
    };
    let along = |values: Vec<f64>| strain.iter().map(|e| 1e3 * e.abs()).zip(values).collect::<Vec<_>>();
    let table = rows(section(&page, "Energy balance"));
    let mut below: Vec<&str> = Vec::new();
    for (name, series) in &terms {
        below.extend(*series);
        let last = sum(series).last().copied().expect("records");
        if sum(series).iter().all(|value| *value == 0.0) {
            assert!(!chart.names().contains(name), "{name} is zero, and drawn");
            continue;
        }
        chart.shows(name, along(sum(&below)));
        let row = table.iter().find(|row| row.first().is_some_and(|first| first == name));
        is_written(&row.unwrap_or_else(|| panic!("no {name} in {table:?}"))[1], last);
    }
    // The line of the work begins at the top of the stack: with the energy at the start.
    below.extend(["integration", "residual"]);
    let work = sum(&["boundary_work", "external_work"]);
    let start = sum(&below)[0] - work[0];
    assert!(start > 0.0, "the prism moves from the start");
    let work: Vec<f64> = work.iter().map(|work| work + start).collect();
    let row =
        table.iter().find(|row| row.first().is_some_and(|first| first.starts_with("work done on the specimen, with")));
    is_written(&row.unwrap_or_else(|| panic!("no work in {table:?}"))[1], *work.last().expect("records"));
    chart.shows("work done on the specimen", along(work));
}

/// Every quantity of every operator that changes has a chart with a line for each component, over the strain at its step; constants are listed.
#[test]
fn samples_of_operators_are_those_of_the_file() {
    let folder = TempDir::new().expect("a temporary folder");
    let (page, result) = page_of_prism(folder.path());
    let (strain, steps) = (samples(&result, "strain"), samples(&result, "step"));
    let operators = result.operators().expect("operators");
    assert_eq!(operators.len(), 2);
    let mut charts = 0;
    for operator in operators {
        let table = result.rows(&format!("samples/{operator}")).expect("rows");
        let step = table.iter().find(|(name, _)| name == "step").expect("steps");
        let ColumnData::U64(step) = &step.1.data else { panic!("no whole steps") };
        assert!(step.len() > 10, "{step:?}");
        let at: Vec<f64> = (step.iter())
            .map(|step| 1e3 * strain[steps.iter().position(|other| *other == *step as f64).expect("a record")])
            .collect();
        for (quantity, column) in table.iter().filter(|(name, _)| name != "time" && name != "step") {
            let ColumnData::F64(values) = &column.data else { panic!("no numbers") };
            let unit = result.unit(&format!("samples/{operator}"), quantity).expect("a unit");
            let factor = match unit.as_str() {
                "Pa" => 1e-6,
                "m" => 1e3,
                "m^2" => 1e6,
                "m^3" => 1e9,
                _ => 1.0,
            };
            let name = quantity.replace('_', " ");
            if column.components == 1 && values.iter().all(|value| *value == values[0]) {
                assert!(page.contains(&format!("{operator}, {name}: ")), "{operator} {name}");
                continue;
            }
            let chart = Drawing::of(&page, &format!("sample-0-{operator}-{}", quantity.replace('_', "-")));
            let single = [(name.as_str(), 0)];
            let parts: &[(&str, usize)] = match column.components {
                9 => &TENSOR,
                3 => &[("x", 0), ("y", 1), ("z", 2)],
                _ => &single,
            };
            assert_eq!(chart.names(), parts.iter().map(|(name, _)| *name).collect::<Vec<_>>(), "{operator} {quantity}");
            for (name, place) in parts {
                let drawn = values.iter().skip(*place).step_by(column.components).map(|value| value * factor);
                chart.shows(name, at.iter().copied().zip(drawn));
            }
            charts += 1;
        }
    }
    assert_eq!(page.matches("id=\"sample-0-").count(), 2 * charts, "a title and a description of each chart");
}

/// Lowest and highest temperatures are those of the snapshots, the mean is the sampled one; the table of materials has the scenario's numbers.
#[test]
fn temperatures_and_materials_are_those_of_the_file() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = write(
        folder.path(),
        "hot.toml",
        r#"version = 1
author = "A. Mason & Daughters"
packing = { kind = "lattice", lattice = "sc", radius = "1 mm", repeats = [6, 2, 2] }
contacts = { law = "frictional" }
bonds = { law = "linear_bond", interaction_ratio = 1.01 }
heat = { model = "power", temperature = "300 K", initial = [{ set = "hot", temperature = "400 K" }] }
stop = { steps = 400 }
output = { sample_interval = 20, snapshot_interval = 80 }
[[material]]
name = "glass"
density = "2500 kg/m^3"
frictional = { normal_stiffness = 1e4, shear_stiffness = 3e3, friction_coefficient = 0.3 }
linear_bond = { normal_stiffness = 1e4, shear_stiffness = 3e3 }
thermal = { specific_heat = 0.5, conductivity = "1.1 W/m/K" }
[[material]]
name = "steel"
density = "7800 kg/m^3"
frictional = { normal_stiffness = 2e4, shear_stiffness = 3e3 }
linear_bond = { normal_stiffness = 1e4, shear_stiffness = 3e3 }
thermal = { specific_heat = 0.5, conductivity = "1.1 W/m/K" }
[[set]]
name = "hot"
selection = { kind = "box", minimum = [-1, -1, -1], maximum = ["4 mm", 1, 1] }
material = "steel"
"#,
    );
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    let path = folder.path().join("hot.h5");
    assert_eq!(concordem(["report", text(&path)]).code, exit::DONE);
    let page = std::fs::read_to_string(folder.path().join("hot.html")).expect("a page");
    let result = ResultFile::open(&path).expect("a result");
    let chart = Drawing::of(&page, "temperature-0");
    let unit = match chart.along.as_str() {
        "time, µs" => 1e6,
        "time, ms" => 1e3,
        other => panic!("{other}"),
    };
    let mean = samples(&result, "mean_temperature");
    chart
        .shows("mean, by heat capacity", samples(&result, "time").iter().zip(&mean).map(|(t, mean)| (unit * t, *mean)));
    let fields = result.table("VTKHDF/PointData").expect("fields of the snapshots");
    let (_, temperature) = fields.iter().find(|(name, _)| name == "temperature").expect("temperatures");
    let ColumnData::F64(temperature) = &temperature.data else { panic!("no reals") };
    let times = result.snapshot_times().expect("snapshots");
    let moments: Vec<&[f64]> = temperature.chunks(24).collect();
    assert_eq!((times.len(), moments.len()), (6, 6));
    let ends = |of: fn(f64, f64) -> f64| -> Vec<(f64, f64)> {
        let all = moments.iter().map(|moment| moment.iter().copied().reduce(of).expect("particles"));
        times.iter().map(|time| unit * time).zip(all).collect()
    };
    chart.shows("highest", ends(f64::max));
    chart.shows("lowest", ends(f64::min));
    let (first, last) = (ends(f64::max)[0].1, ends(f64::max)[5].1);
    assert!(first == 400.0 && last < 399.0, "heat flows: {first}, {last}");

    let table = rows(section(&page, "Materials"));
    let row = |name: &str| {
        let found = table.iter().find(|row| row.first().is_some_and(|first| first == name));
        found.unwrap_or_else(|| panic!("{name}: {table:?}")).clone()
    };
    assert_eq!(row("density")[1..], ["2500 kg/m³", "7800 kg/m³"]);
    is_written(&row("frictional: normal stiffness")[2], 2e4);
    assert_eq!(row("frictional: friction coefficient")[2], "–");
    assert!(page.contains("; by A. Mason &amp; Daughters."), "the page has its author");
}

/// The table of the provenance has all entries of the file.
#[test]
fn provenance_is_that_of_the_file() {
    let folder = TempDir::new().expect("a temporary folder");
    let (page, result) = page_of_prism(folder.path());
    let table = rows(section(&page, "Provenance"));
    let mut wanted = result.provenance().expect("entries");
    wanted.push(("state hash".to_owned(), result.state_hash().expect("a hash")));
    for (name, value) in &wanted {
        // A unit stands behind a comma.
        let units = [("_s", ", s"), ("_pa", ", Pa"), ("_m", ", m"), ("_utc", ", UTC")];
        let quantity = units.iter().find_map(|(end, unit)| Some(name.strip_suffix(end)?.to_owned() + unit));
        let shown = quantity.unwrap_or_else(|| name.clone()).replace('_', " ");
        let row = table.iter().find(|row| row.first().is_some_and(|first| *first == shown));
        let escaped = value.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;");
        assert_eq!(row.unwrap_or_else(|| panic!("no {name}"))[1], escaped, "{name}");
    }
    assert_eq!(table.iter().filter(|row| row.len() == 2 && !row[0].is_empty()).count(), wanted.len());
}

/// The histograms of a packing contain all spheres, links, cells, and faces; its tables and curves are those of the JSON file.
#[test]
fn page_of_a_packing_is_its_json_file() {
    let folder = TempDir::new().expect("a temporary folder");
    let cell = write(folder.path(), "cell.toml", CELL);
    let given = concordem(["characterise", text(&cell)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let page = std::fs::read_to_string(folder.path().join("cell.structure.html")).expect("a page");
    let json = std::fs::read_to_string(folder.path().join("cell.structure.json")).expect("a file");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let real = |value: &serde_json::Value| value.as_f64().expect("a number");
    // Outlines of bars: the area over the width of a class is the number of all.
    let width = |histogram: &serde_json::Value| real(&histogram[1][0]) - real(&histogram[0][0]);
    let (links, cells) = (&json["link_length_over_sum_of_radii"]["histogram"], &json["solid_fraction"]["power_cells"]);
    for (id, title, width, count) in [
        ("densities", "Density of links on the 320 faces, over that of isotropy", 0.05, 320.0),
        ("lengths", "Links between two spheres inside", width(links), real(&json["isotropy"]["links"])),
        ("cells", "Solid fraction of the power cells inside", width(&cells["histogram"]), real(&cells["cells"])),
    ] {
        let area = Drawing::of(&page, id).area(title);
        // Corners are rounded to a hundredth of a px, of some px for each class.
        assert!((area / width / count - 1.0).abs() < 5e-3, "{id}: {} {count}", area / width);
    }
    let mean = real(&json["radii"]["mean"]);
    let list = |value: &serde_json::Value| value.as_array().expect("a list").iter().map(real).collect::<Vec<f64>>();
    let (distance, g) = (list(&json["pair_correlation"]["distance"]), list(&json["pair_correlation"]["g"]));
    Drawing::of(&page, "pair-correlation").shows("g", distance.iter().map(|r| r / mean).zip(g));
    let table = rows(&page);
    let cell = |name: &str| {
        let row = table.iter().find(|row| row.first().is_some_and(|first| first.starts_with(name)));
        row.unwrap_or_else(|| panic!("no {name} in {table:?}"))[1].clone()
    };
    for (name, value) in [
        ("Spheres", &json["spheres"]),
        ("Links per sphere inside", &json["coordination"]["inside"]),
        ("2C/N of all spheres", &json["coordination"]["all"]),
        ("Solid fraction of the periodic cell", &json["solid_fraction"]["cell"]),
        ("Links between two spheres inside", &json["isotropy"]["links"]),
    ] {
        is_written(&cell(name), real(value));
    }
}

/// The layers below the surface of a packing, and its phases, whose shares are all of the solid.
#[test]
fn layers_and_phases_of_a_packing_are_those_of_its_json_file() {
    let folder = TempDir::new().expect("a temporary folder");
    let prism = write(folder.path(), "prism.toml", &PRISM.replace("STEPS", "1"));
    let given = concordem(["characterise", text(&prism)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let page = std::fs::read_to_string(folder.path().join("prism.structure.html")).expect("a page");
    let json = std::fs::read_to_string(folder.path().join("prism.structure.json")).expect("a file");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let mean = json["radii"]["mean"].as_f64().expect("a radius");
    let list = |name: &str| {
        let values = json["layers"][name].as_array().expect("a list").iter();
        values.map(|value| value.as_f64().unwrap_or(f64::NAN)).collect::<Vec<f64>>()
    };
    for (id, name) in [("fraction-by-depth", "solid_fraction"), ("links-by-depth", "links")] {
        let points = list("depth").into_iter().map(|depth| depth / mean).zip(list(name));
        Drawing::of(&page, id).shows("layers", points.filter(|point| point.1.is_finite()));
    }
    let table = rows(section(&page, "Phases"));
    let phases = json["phases"].as_array().expect("phases");
    let shown: Vec<&Vec<String>> = table.iter().filter(|row| row.len() == 5).collect();
    assert_eq!((shown.len(), phases.len()), (2, 2), "{table:?}");
    let mut shares = 0.0;
    for (row, phase) in shown.iter().zip(phases) {
        assert_eq!(row[0], phase["material"].as_str().expect("a name"));
        assert_eq!(number(&row[1]), phase["particles"].as_f64().expect("a number"));
        is_written(&row[4], phase["links_per_particle"].as_f64().expect("a number"));
        shares += number(row[2].trim_end_matches(" %"));
    }
    // Two shares, each rounded to one decimal.
    assert!((shares - 100.0).abs() <= 0.1001, "{shares}");
}

/// Curves and rows of a sweep are the means of its points.
#[test]
fn page_of_a_sweep_has_the_means_of_its_points() {
    let folder = TempDir::new().expect("a temporary folder");
    write(folder.path(), "cell.toml", CELL);
    let sweep = write(
        folder.path(),
        "sweep.toml",
        "version = 1\nscenario = \"cell.toml\"\n\
         [[axis]]\nname = \"k_t\"\nkey = \"material[0].linear_bond.shear_stiffness\"\nvalues = [1e6, 2e6, 4e6]\n\
         [[axis]]\nkey = \"packing.seed\"\nvalues = [1, 2]\naverage = true\n",
    );
    let given = concordem(["sweep", "-q", "--csv", text(&sweep)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let page = std::fs::read_to_string(folder.path().join("sweep.html")).expect("a page");
    let csv = std::fs::read_to_string(folder.path().join("sweep.csv")).expect("a table");
    let heads: Vec<&str> = csv.lines().next().expect("heads").split(',').map(|head| head.trim_matches('"')).collect();
    let column = |name: &str| -> Vec<f64> {
        let k = heads.iter().position(|head| *head == name).unwrap_or_else(|| panic!("no {name} in {heads:?}"));
        csv.lines().skip(1).map(|line| line.split(',').nth(k).expect("a cell").parse().expect("a number")).collect()
    };
    let along = column("k_t");
    assert_eq!(along.len(), 6);
    let means = |name: &str, scale: f64| {
        let values = column(name);
        [1e6, 2e6, 4e6].map(|at| {
            let own = along.iter().zip(&values).filter(|(other, _)| **other == at).map(|(_, value)| scale * value);
            (at, own.clone().sum::<f64>() / own.count() as f64)
        })
    };
    let chart = Drawing::of(&page, "over-0-0");
    chart.shows("all", means("young", 1e-9));
    chart.shows("all, affine sum", means("affine_young", 1e-9));
    Drawing::of(&page, "over-0-1").shows("all", means("poisson", 1.0));
    let table: Vec<Vec<String>> = rows(section(&page, "All points")).into_iter().filter(|row| row.len() > 2).collect();
    assert_eq!(table.len(), 3, "{table:?}");
    for ((row, young), poisson) in table.iter().zip(means("young", 1e-9)).zip(means("poisson", 1.0)) {
        assert_eq!(number(&row[0]), young.0, "{row:?}");
        for (cell, value) in row[1..3].iter().zip([young.1, poisson.1]) {
            is_written(cell.split(" ± ").next().expect("a mean"), value);
        }
    }
}
