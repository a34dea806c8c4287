//! Snapshots, exports, tables, reports, and live pages of runs in two dimensions, in periodic cells, with walls, clumps, deformable
//! particles, and heat, and of their continuations.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use concordem::program::exit;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

use crate::export::reals;
use crate::watch::{free_port, get};

/// What a run must show.
struct Case {
    name: &'static str,
    scenario: &'static str,
    particles: usize,
    /// Law of its bonds; empty without bonds.
    law: &'static str,
    /// What follows `ITEM: BOX BOUNDS` in its dumps.
    region: &'static str,
    /// A field of the snapshots that only this case has.
    field: &'static str,
}

/// Bonds of discs and spheres.
const BONDED: &str = r#"
[bonds]
law = "linear_bond"
interaction_ratio = 1.1
[contacts]
law = "none"
"#;

const CASES: &[Case] = &[
    Case {
        name: "plane",
        scenario: r#"
dimension = 2
packing = { kind = "lattice", lattice = "square", radius = "1 mm", repeats = [5, 8, 1] }
material = [{ name = "m", density = 2000, linear_bond = { normal_stiffness = 7e10, shear_stiffness = 7e9, damping_ratio = 0.1 } }]
loading = { kind = "uniaxial", axis = "y", strain_rate = "0.2 1/s" }
BONDED"#,
        particles: 40,
        law: "linear_bond",
        region: " ff ff ff",
        field: "",
    },
    Case {
        name: "plane-periodic",
        scenario: r#"
dimension = 2
packing = { kind = "random-discs", count = 40, radius = "1 mm", seed = 1, shape = { kind = "periodic" } }
material = [{ name = "m", density = 2000, linear_bond = { normal_stiffness = 1e7, shear_stiffness = 2e6 } }]
loading = { kind = "cell-strain", velocity_gradient = [[0.1, 0, 0], [0, 0, 0], [0, 0, 0]] }
BONDED"#,
        particles: 40,
        law: "linear_bond",
        region: " pp pp pp",
        field: "",
    },
    Case {
        name: "periodic",
        scenario: r#"
packing = { kind = "random-dense", count = 80, radius = "1 mm", seed = 1, shape = { kind = "periodic" } }
material = [{ name = "m", density = 2000, linear_bond = { normal_stiffness = 1e7, shear_stiffness = 2e6 } }]
loading = { kind = "cell-strain", velocity_gradient = [[0, 0, 10], [0, 0, 0], [0, 0, 20]] }
BONDED"#,
        particles: 80,
        law: "linear_bond",
        region: " abc origin pp pp pp",
        field: "",
    },
    Case {
        name: "walls",
        scenario: r#"
packing = { kind = "lattice", lattice = "sc", radius = "5 mm", repeats = [3, 3, 3] }
material = [{ name = "m", density = 2500, frictional = { normal_stiffness = 1e5, shear_stiffness = 3e4 } }]
wall = [{ material = "m", shape = { kind = "plane", point = [0, 0, "-5 mm"], normal = [0, 0, 1] } }]
contacts = { law = "frictional" }
integration = { gravity = [0, 0, -9.81] }"#,
        particles: 27,
        law: "",
        region: " ff ff ff",
        field: "",
    },
    Case {
        name: "clumps",
        scenario: r#"
packing = { kind = "lattice", lattice = "sc", radius = "5 mm", repeats = [3, 3, 2] }
material = [{ name = "m", density = 2500, frictional = { normal_stiffness = 1e5, shear_stiffness = 3e4 } }]
set = [{ name = "pair", selection = { kind = "ids", ids = [0, 1] } }]
clump = [{ set = "pair" }, { spheres = [["60 mm", 0, 0, "5 mm"], ["64 mm", 0, 0, "4 mm"]], material = "m", mass = "3 g", inertia = ["1e-7 kg*m^2", "2e-7 kg*m^2", "2e-7 kg*m^2"], velocity = ["-1 m/s", 0, 0] }]
contacts = { law = "frictional" }"#,
        particles: 20,
        law: "",
        region: " ff ff ff",
        field: "",
    },
    Case {
        name: "deformable discs",
        scenario: r#"
dimension = 2
packing = { kind = "lattice", lattice = "square", radius = "1 mm", repeats = [5, 8, 1] }
material = [{ name = "m", density = 2000, deformable = { young = "200 GPa", poisson = 0.35 }, linear_bond = { normal_stiffness = 7e10, shear_stiffness = 7e9, damping_ratio = 0.7 } }]
deformable = { condition = "plane-strain", update = "lagged" }
set = [{ name = "top", selection = { kind = "layer", axis = "y", end = "maximum", thickness = "1.5 mm" } }]
force = [{ set = "top", force = [0, "-10 kN", 0], acts = "push" }]
BONDED"#,
        particles: 40,
        law: "linear_bond",
        region: " ff ff ff",
        field: "",
    },
    Case {
        name: "deformable spheres",
        scenario: r#"
packing = { kind = "lattice", lattice = "sc", radius = "1 mm", repeats = [3, 3, 5] }
material = [{ name = "m", density = 2000, deformable = { young = "200 GPa", poisson = 0.3 }, linear_bond = { normal_stiffness = 5e7, shear_stiffness = 1e7, damping_ratio = 0.7 } }]
deformable = { update = "iterated" }
loading = { kind = "uniaxial", axis = "z", strain_rate = "1 1/s" }
BONDED"#,
        particles: 45,
        law: "linear_bond",
        region: " ff ff ff",
        field: "",
    },
    Case {
        name: "heat",
        scenario: r#"
packing = { kind = "lattice", lattice = "sc", radius = "1 mm", repeats = [3, 3, 5] }
material = [{ name = "m", density = 2500, linear_bond = { normal_stiffness = 1e7, shear_stiffness = 3e6 }, thermal = { specific_heat = "800 J/kg/K", conductivity = "1.1 W/m/K", expansion = "9e-6 1/K", bulk_density = 2500 } }]
set = [{ name = "base", selection = { kind = "layer", axis = "z", end = "minimum", thickness = "1 mm" } }]
heat = { model = "ordered", pairs = "bonds", temperature = "293 K", reference_temperature = "293 K", scheme = "implicit", time_factor = 1e4, boundary = [{ face = "z minimum", temperature = "350 K" }] }
BONDED"#,
        particles: 45,
        law: "linear_bond",
        region: " ff ff ff",
        field: "temperature",
    },
];

impl Case {
    fn scenario(&self, steps: u64) -> String {
        let bonds = if self.law.is_empty() { "" } else { "bond_snapshots = true\n" };
        let body = self.scenario.replace("BONDED", BONDED);
        format!(
            "version = 1\ntitle = \"{}\"{body}\n[stop]\nsteps = {steps}\n[output]\nsample_interval = 20\nsnapshot_interval = 50\n{bonds}csv = true\n",
            self.name
        )
    }
}

fn done(arguments: &[&str]) -> String {
    let given = concordem(arguments.iter().copied());
    assert_eq!(given.code, exit::DONE, "{}: {}", arguments.join(" "), given.err);
    given.out
}

/// A snapshot of a dump: what follows `BOX BOUNDS`, the box, the names of the columns, the rows.
struct Dumped {
    region: String,
    bounds: Vec<Vec<f64>>,
    columns: Vec<String>,
    rows: Vec<Vec<f64>>,
}

fn dumped(path: &Path) -> Vec<Dumped> {
    let text = std::fs::read_to_string(path).expect("a dump");
    let numbers = |line: &str| -> Vec<f64> { line.split(' ').map(|word| word.parse().expect("a number")).collect() };
    text.split("ITEM: TIMESTEP\n")
        .skip(1)
        .map(|part| {
            let lines: Vec<&str> = part.lines().collect();
            assert!(lines[1].starts_with("ITEM: NUMBER OF "), "{}", lines[1]);
            let columns = lines[7].split(' ').skip(2).map(str::to_owned).collect();
            let rows: Vec<_> = lines[8..].iter().map(|line| numbers(line)).collect();
            assert_eq!(rows.len(), lines[2].parse::<usize>().expect("a count"));
            let region = lines[3].strip_prefix("ITEM: BOX BOUNDS").expect("a box").to_owned();
            Dumped { region, bounds: lines[4..7].iter().map(|line| numbers(line)).collect(), columns, rows }
        })
        .collect()
}

impl Dumped {
    fn column(&self, name: &str) -> Vec<f64> {
        let k = self.columns.iter().position(|column| column == name).unwrap_or_else(|| panic!("no column {name}"));
        self.rows.iter().map(|row| row[k]).collect()
    }

    /// Edge vectors of a periodic box.
    fn edges(&self) -> Option<[[f64; 3]; 3]> {
        let row = |k: usize| std::array::from_fn(|axis| self.bounds[k][axis]);
        match &self.region[..] {
            " ff ff ff" => None,
            " pp pp pp" => Some(std::array::from_fn(|k| {
                std::array::from_fn(|axis| if axis == k { self.bounds[k][1] - self.bounds[k][0] } else { 0.0 })
            })),
            " abc origin pp pp pp" => Some([row(0), row(1), row(2)]),
            other => panic!("{other}"),
        }
    }
}

/// Length of a vector, or of its shortest periodic image.
fn shortest(vector: [f64; 3], edges: Option<[[f64; 3]; 3]>) -> f64 {
    let length = |vector: [f64; 3]| vector.iter().map(|x| x * x).sum::<f64>().sqrt();
    let Some(edges) = edges else { return length(vector) };
    // Unwrapped positions of these short runs are at most one cell apart.
    let images = (0..125).map(|k| [k % 5 - 2, k / 5 % 5 - 2, k / 25 - 2]);
    let image = |n: [i32; 3]| {
        std::array::from_fn(|axis| vector[axis] + (0..3).map(|k| f64::from(n[k]) * edges[k][axis]).sum::<f64>())
    };
    images.map(|n| length(image(n))).fold(f64::INFINITY, f64::min)
}

/// The result, its exports, table, report, and information agree with each other.
fn check(case: &Case, result: &Path, problems: &mut String) {
    let file = hdf5::File::open(result).expect("a result");
    let name = case.name;
    let stem = result.with_extension("");
    let beside = |ending: &str| PathBuf::from(format!("{}{ending}", text(&stem)));
    let mut expect = |holds: bool, what: &str| {
        if !holds {
            writeln!(problems, "{name}: {what}").expect("a string");
        }
    };
    // Samples and their table.
    let samples = reals(&file, "samples/stress").len();
    let table = std::fs::read_to_string(beside(".csv")).expect("a table");
    expect(table.lines().count() == samples + 1, "the table has a row per sample");
    // Snapshots: the last one is the final state.
    let snapshots = reals(&file, "VTKHDF/Steps/Values").len();
    let points = reals(&file, "VTKHDF/Points");
    expect(snapshots >= 4 && points.len() == 3 * case.particles * snapshots, "every snapshot has all particles");
    expect(points.iter().all(|x| x.is_finite()), "positions are numbers");
    expect(case.field.is_empty() || file.dataset(&format!("VTKHDF/PointData/{}", case.field)).is_ok(), case.field);
    let bonds =
        if case.law.is_empty() { 0 } else { reals(&file, &format!("contacts/{}/reference_length", case.law)).len() };
    // Not `length`, which belongs to the evaluation before the last motion.
    let branches = if bonds == 0 { Vec::new() } else { reals(&file, &format!("contacts/{}/branch", case.law)) };
    let lengths: f64 = branches.chunks(3).map(|l| shortest([l[0], l[1], l[2]], None)).sum();
    // The program opens the file, too.
    drop(file);
    // ParaView.
    let exported = concordem(["export", "--force", text(result)]);
    expect(exported.code == exit::DONE && exported.err.is_empty(), &exported.err);
    let bonds_file = beside(".bonds.vtkhdf");
    expect(bonds_file.exists() == (bonds > 0), "bonds are exported if there are any");
    if bonds > 0 {
        let lines = hdf5::File::open(&bonds_file).expect("bonds");
        let points = reals(&lines, "VTKHDF/Points");
        let of_line = |p: &[f64]| shortest(std::array::from_fn(|axis| p[3 + axis] - p[axis]), None);
        let found: f64 = points[points.len() - 6 * bonds..].chunks(6).map(of_line).sum();
        // Sums of a few hundred numbers, to rounding.
        expect((found - lengths).abs() < 1e-9 * lengths, &format!("lines of {found} m for bonds of {lengths} m"));
        expect(reals(&lines, "VTKHDF/Steps/Values").len() == snapshots, "bonds in every snapshot");
    }
    let particles = hdf5::File::open(beside(".particles.vtkhdf")).expect("particles");
    expect(reals(&particles, "VTKHDF/Points") == points, "the exported particles are those of the result");
    // OVITO and LAMMPS.
    let exported = concordem(["export", "--force", text(result), "--format", "lammps"]);
    expect(exported.code == exit::DONE && exported.err.is_empty(), &exported.err);
    let dump = dumped(&beside(".dump"));
    expect(dump.len() == snapshots, "a dump has all snapshots");
    let last = dump.last().expect("a snapshot");
    expect(last.region == case.region, &format!("the box is{} instead of{}", last.region, case.region));
    let axes = if last.edges().is_some() { ["xu", "yu", "zu"] } else { ["x", "y", "z"] };
    let position = axes.map(|axis| last.column(axis));
    let flat: Vec<f64> = (0..case.particles).flat_map(|k| [0, 1, 2].map(|axis| position[axis][k])).collect();
    expect(flat == points[points.len() - 3 * case.particles..], "the dump has the positions of the last snapshot");
    if bonds > 0 {
        let local = dumped(&beside(".bonds.dump"));
        let last_bonds = local.last().expect("a snapshot");
        expect(
            local.len() == snapshots && last_bonds.rows.len() == bonds,
            "a local dump has the bonds of all snapshots",
        );
        let pairs = ["batom1", "batom2"].map(|name| last_bonds.column(name));
        let id = last.column("id");
        let row = |wanted: f64| id.iter().position(|id| *id == wanted).expect("a particle");
        let between = |k: usize| {
            let [a, b] = [row(pairs[0][k]), row(pairs[1][k])];
            shortest(std::array::from_fn(|axis| position[axis][b] - position[axis][a]), last_bonds.edges())
        };
        let found: f64 = (0..bonds).map(between).sum();
        expect(
            (found - lengths).abs() < 1e-9 * lengths,
            &format!("the dump has bonds of {found} m instead of {lengths} m"),
        );
    }
    let script = std::fs::read_to_string(beside(".ovito.py")).expect("a script");
    expect(
        !["PERIODIC", "DATA", "PARTICLES", "BONDS", "COLUMNS", "STEM"].iter().any(|word| script.contains(word)),
        "the script is filled in",
    );
    // Report and information.
    done(&["report", "--force", text(result)]);
    let page = std::fs::read_to_string(result.with_extension("html")).expect("a page");
    expect(page.contains(&format!("<title>{name}")) && page.contains("<svg"), "the report has a title and charts");
    expect(has_numbers_only(&page), "the report has numbers only");
    let shown = done(&["info", text(result)]);
    expect(
        shown.lines().any(|line| line.starts_with("  particles  ") && line.ends_with(&format!(" {}", case.particles))),
        &shown,
    );
}

/// Whether a page has no value that is not finite; the bytes of its images are letters of any kind.
fn has_numbers_only(page: &str) -> bool {
    let words: String =
        page.split("base64,").map(|part| part.split_once('"').map_or(part, |(_, after)| after)).collect();
    !words.contains("NaN") && !words.contains("inf,")
}

#[test]
fn every_kind_of_run_is_exported_and_reported() {
    let folder = TempDir::new().expect("a temporary folder");
    let mut problems = String::new();
    for (k, case) in CASES.iter().enumerate() {
        let scenario = write(folder.path(), &format!("{k}.toml"), &case.scenario(200));
        let result = folder.path().join(format!("{k}.h5"));
        done(&["run", "-q", text(&scenario), "-o", text(&result)]);
        check(case, &result, &mut problems);
        // Started from that result: the first snapshot is the last one of before.
        let longer = folder.path().join(format!("{k}-longer.h5"));
        done(&["run", "-q", text(&scenario), "-o", text(&longer), "--from", text(&result), "--set", "stop.steps=360"]);
        check(case, &longer, &mut problems);
        let last = |path: &Path, from_end: bool| {
            let points = reals(&hdf5::File::open(path).expect("a result"), "VTKHDF/Points");
            let width = 3 * case.particles;
            if from_end { points[points.len() - width..].to_vec() } else { points[..width].to_vec() }
        };
        if last(&result, true) != last(&longer, false) {
            writeln!(problems, "{}: the continuation begins elsewhere", case.name).expect("a string");
        }
    }
    assert!(problems.is_empty(), "{problems}");
}

/// The page of a running specimen shows its particles: in two dimensions all of them, otherwise a slice.
#[test]
fn every_kind_of_run_can_be_watched() {
    let folder = TempDir::new().expect("a temporary folder");
    let mut problems = String::new();
    for (k, case) in CASES.iter().enumerate() {
        let scenario = write(folder.path(), &format!("{k}.toml"), &case.scenario(50_000_000));
        let port = free_port();
        let result = folder.path().join(format!("{k}.h5"));
        let number = port.to_string();
        let mut child = crate::spawn(&[
            "run",
            "-q",
            text(&scenario),
            "-o",
            text(&result),
            "--watch",
            &number,
            "--set",
            "output.snapshot_interval=1000000000",
        ]);
        let started = std::time::Instant::now();
        let body = loop {
            let answer = get(port, "/state").filter(|answer| answer.contains("\"curve\": [["));
            if answer.is_some() || started.elapsed().as_secs() > 60 || child.try_wait().expect("a child").is_some() {
                break answer;
            }
            std::thread::sleep(std::time::Duration::from_millis(20));
        };
        child.kill().expect("a child");
        child.wait().expect("a child");
        let Some(body) = body else {
            writeln!(problems, "{}: no state appears", case.name).expect("a string");
            continue;
        };
        let (_, body) = body.split_once("\r\n\r\n").expect("a body");
        let state: serde_json::Value = serde_json::from_str(body).unwrap_or_else(|error| panic!("{error}: {body}"));
        // Base 64: four characters for three bytes; six bytes per particle.
        let particles = state["particles"].as_str().map_or(0, |text| text.trim_end_matches('=').len() * 3 / 4 / 6);
        let is_plane = case.scenario.contains("dimension = 2");
        let is_right =
            if is_plane { particles == case.particles } else { particles > 0 && particles <= case.particles };
        if !is_right || state["title"] != case.name {
            writeln!(problems, "{}: {particles} particles of {}", case.name, case.particles).expect("a string");
        }
    }
    assert!(problems.is_empty(), "{problems}");
}
