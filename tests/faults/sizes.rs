//! Impossible sizes are refused with a number in the message, before memory or time is spent.

use std::time::{Duration, Instant};

use concordem::program::exit;
use concordem_tests::commands::{Given, concordem, text, write};
use tempfile::TempDir;

const REST: &str = r#"
[[material]]
name = "grain"
density = 2500
frictional = { normal_stiffness = 1e5, shear_stiffness = 3e4, friction_coefficient = 0.5 }
[contacts]
law = "frictional"
[integration]
time_step = "1 us"
[stop]
steps = 20
"#;

/// Runs `concordem check` on a packing; it must be quick.
fn check(packing: &str, more: &str) -> Given {
    let folder = TempDir::new().expect("a folder");
    write(folder.path(), "one.txt", "0 0 0 0.001\n");
    write(folder.path(), "empty.txt", "# nothing\n");
    write(folder.path(), "far.stl", &stl(1e15));
    let scenario = write(folder.path(), "run.toml", &format!("version = 1\n[packing]\n{packing}\n{REST}{more}"));
    let start = Instant::now();
    let given = concordem(["check", "-q", text(&scenario)]);
    assert!(start.elapsed() < Duration::from_secs(10), "{packing} takes {:?}", start.elapsed());
    given
}

/// A surface of one triangle with corners about `far` meters away.
fn stl(far: f64) -> String {
    format!(
        "solid s\nfacet normal 0 0 1\nouter loop\nvertex {far:e} 0 0\nvertex {far:e} 1 0\nvertex {far:e} 0 1\nendloop\n\
         endfacet\nendsolid s\n"
    )
}

#[test]
fn impossible_sizes_are_refused_with_a_number() {
    const CELL: &str = "cell = [\"10 mm\", \"10 mm\", \"10 mm\"]";
    for (packing, words) in [
        // 3.4e9 copies of one sphere: 160 GB.
        (
            format!("kind = \"file\"\npath = \"one.txt\"\n{CELL}\nshape = {{ kind = \"box\", size = [15, 15, 15] }}"),
            "GB",
        ),
        (
            format!(
                "kind = \"file\"\npath = \"one.txt\"\n{CELL}\nshape = {{ kind = \"box\", size = [1e9, 1e9, 1e9] }}"
            ),
            "1e33 spheres; at most",
        ),
        (
            format!("kind = \"file\"\npath = \"empty.txt\"\n{CELL}\nshape = {{ kind = \"box\", size = [1, 1, 1] }}"),
            "no spheres",
        ),
        ("kind = \"file\"\npath = \"empty.txt\"".to_owned(), "no spheres"),
        ("kind = \"lattice\"\nlattice = \"fcc\"\nradius = \"1 mm\"\nrepeats = [100000, 10000, 1]".to_owned(), "GB"),
        (
            "kind = \"random-dense\"\ncount = 100_000_000\nradius = \"1 mm\"\nshape = { kind = \"periodic\" }"
                .to_owned(),
            "GB",
        ),
        (
            "kind = \"spheres\"\nspheres = [[1e15, 0, 0, \"1 mm\"], [0, 0, 0, \"1 mm\"]]".to_owned(),
            "1e15 m from the origin",
        ),
    ] {
        let given = check(&packing, "");
        assert_eq!(given.code, exit::USAGE, "{packing}: {}{}", given.out, given.err);
        assert!(given.err.contains(words) && given.err.contains("run.toml"), "{packing}: {}", given.err);
    }
}

#[test]
fn impossible_grids_walls_and_time_steps_are_refused() {
    const TWO: &str = "kind = \"spheres\"\nspheres = [[0, 0, 0, \"1 mm\"], [\"2.1 mm\", 0, 0, \"1 mm\"]]";
    let sampled = "[[sample]]\noperator = \"fabric\"\ngrid = [1000000, 1000000, 1000]\n\
                   region = { kind = \"box\", minimum = [0, 0, 0], maximum = [1, 1, 1] }\n";
    let given = check(TWO, sampled);
    assert!(
        given.code == exit::USAGE && given.err.contains("sample[0].grid") && given.err.contains("GB"),
        "{}",
        given.err
    );
    let wall = "[[wall]]\nmaterial = \"grain\"\nshape = { kind = \"facets\", path = \"far.stl\" }\n";
    // A wall far away touches nothing and must not cost time.
    let given = check(TWO, wall);
    assert_eq!(given.code, exit::DONE, "{}{}", given.out, given.err);
    for step in ["0", "\"0 s\"", "1e-320"] {
        let folder = TempDir::new().expect("a folder");
        let rest = REST.replace("\"1 us\"", step);
        let scenario = write(folder.path(), "run.toml", &format!("version = 1\n[packing]\n{TWO}\n{rest}"));
        let given = concordem(["check", "-q", text(&scenario)]);
        assert!(given.code == exit::USAGE && given.err.contains("integration.time_step"), "{step}: {}", given.err);
    }
}

/// A region of meters for millimeters, in a periodic cell, is refused at once, with the key and a remedy: every image of the cell takes as long
/// as the cell. A grid is not, if its cells are as small as the periodic one.
#[test]
fn a_region_over_very_many_images_is_refused_at_once() {
    let cell = "version = 1\n[packing]\nkind = \"lattice\"\nlattice = \"fcc\"\nradius = \"1 mm\"\nrepeats = [2, 2, 2]\n\
                shape = { kind = \"periodic\" }\n[output]\nsample_interval = 10\n";
    let regions = [
        ("kind = \"sphere\", center = [0, 0, 0], radius = 5", ""),
        ("kind = \"box\", minimum = [0, 0, 0], maximum = [5, 5, 5]", ""),
        ("kind = \"box\", minimum = [0, 0, 0], maximum = [5, 5, 5]", "grid = [2, 2, 2]"),
        ("kind = \"cylinder\", center = [0, 0, 0], axis = [0, 0, 1], radius = 5, height = 5", ""),
        ("kind = \"ellipsoid\", center = [0, 0, 0], half_axes = [5, 5, 5]", ""),
    ];
    for (region, grid) in regions {
        for operator in ["region-stress", "porosity", "affine-rate", "fabric"] {
            if !grid.is_empty() && operator == "affine-rate" {
                continue;
            }
            let folder = TempDir::new().expect("a folder");
            let sample = format!("[[sample]]\noperator = \"{operator}\"\nregion = {{ {region} }}\n{grid}\n");
            let scenario = write(folder.path(), "run.toml", &format!("{cell}{REST}{sample}"));
            for command in ["check", "run"] {
                let start = Instant::now();
                let given = concordem([command, "-q", text(&scenario)]);
                assert!(start.elapsed() < Duration::from_secs(5), "{region} takes {:?}", start.elapsed());
                assert_eq!(given.code, exit::USAGE, "{command} {operator} {region}: {}", given.err);
                for words in ["sample[0].region", "images of the periodic cell", "check its unit"] {
                    assert!(given.err.contains(words), "{command} {operator} {region}: {}", given.err);
                }
            }
        }
    }
    // 12 cells along each edge, 1,728 in all; each cell of the grid reaches over a few.
    let edge = 12.0 * 2.0 * 2e-3 * std::f64::consts::SQRT_2;
    let folder = TempDir::new().expect("a folder");
    let sample = format!(
        "[[sample]]\noperator = \"porosity\"\ngrid = [12, 12, 12]\nregion = {{ kind = \"box\", minimum = [0, 0, 0], \
         maximum = [{edge}, {edge}, {edge}] }}\n"
    );
    let scenario = write(folder.path(), "run.toml", &format!("{cell}{REST}{sample}"));
    for command in ["check", "run"] {
        let given = concordem([command, "-q", text(&scenario)]);
        assert_eq!(given.code, exit::DONE, "{command}: {}", given.err);
    }
}

/// Environment variable with which the test below tells a child process what to run.
const CHILD: &str = "CONCORDEM_TEST_RUN_FOR_MEMORY";

/// Not a test: the child process whose memory is measured.
#[test]
#[ignore = "run by another test in a separate process"]
fn child() {
    let Ok(scenario) = std::env::var(CHILD) else { return };
    assert_eq!(concordem(["run", "-q", &scenario]).code, exit::DONE);
    let status = std::fs::read_to_string("/proc/self/status").expect("the system reports memory");
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).expect("the peak");
    let kilobytes = line.split_whitespace().nth(1).expect("a number");
    std::fs::write(format!("{scenario}.peak"), kilobytes).expect("a file");
}

/// Predicted and measured peak memory (bytes) of the run of a scenario, from the assembly to the result.
#[cfg(target_os = "linux")]
fn peaks(source: &str) -> (f64, f64) {
    let folder = TempDir::new().expect("a folder");
    let scenario = write(folder.path(), "run.toml", source);
    let checked = concordem(["check", "-q", text(&scenario)]);
    let line = checked.out.lines().find(|line| line.contains("peak memory"));
    let line = line.unwrap_or_else(|| panic!("no prediction: {}", checked.err));
    let word = line.split_whitespace().rev().nth(1).expect("a number");
    assert!(line.ends_with("MB"), "{line}");
    let predicted = word.parse::<f64>().expect("a number") * 1e6;
    let process = std::process::Command::new(std::env::current_exe().expect("this test"))
        .args(["--exact", "sizes::child", "--ignored"])
        .env(CHILD, &scenario)
        .output()
        .expect("a child");
    assert!(process.status.success(), "{}", String::from_utf8_lossy(&process.stdout));
    let peak = std::fs::read_to_string(format!("{}.peak", text(&scenario))).expect("the peak");
    (predicted, peak.parse::<f64>().expect("a number") * 1024.0)
}

const CPM: &str = "cpm = { young = \"25 GPa\", shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = 5, \
                   cohesion = \"3 MPa\", friction_coefficient = 0.8 }";
const LINEAR: &str = "linear_bond = { normal_stiffness = 1e6, shear_stiffness = 2e5 }";
const BEAM: &str = "cohesive_beam = { young = 1e9, radius_ratio = 0.5 }";
const FRICTION: &str = "frictional = { normal_stiffness = 1e5, shear_stiffness = 3e4, friction_coefficient = 0.5 }";
const HERTZ: &str = "hertz_mindlin = { young = \"1 GPa\", poisson = 0.2, friction_coefficient = 0.5 }";

/// A block of spheres with a radius of 1 mm that touch, and tables of laws in one material.
fn block(lattice: &str, repeats: [u32; 3], tables: &[&str], rest: &str) -> String {
    format!(
        "version = 1\n[packing]\nkind = \"lattice\"\nlattice = \"{lattice}\"\nradius = \"1 mm\"\nrepeats = {repeats:?}\n\
         [[material]]\nname = \"m\"\ndensity = 4800\n{}\n{rest}\n",
        tables.join("\n")
    )
}

/// Bonds and unbonded contacts of a scenario, and a tensile test of three steps.
fn pulled(law: &str, ratio: f64, contacts: &str) -> String {
    format!(
        "[bonds]\nlaw = \"{law}\"\ninteraction_ratio = {ratio}\n[contacts]\nlaw = \"{contacts}\"\n\
         [loading]\nkind = \"uniaxial\"\nstrain_rate = 0.4\n[stop]\nsteps = 3"
    )
}

/// `check` predicts the peak memory of the run within 15 %: the kinds of runs to which its constants were fitted.
#[test]
#[cfg(target_os = "linux")]
fn predicted_memory_agrees_with_the_measured_peak() {
    for (law, table, ratio, contacts) in [("linear_bond", LINEAR, 1.05, "none"), ("cpm", CPM, 1.5, "cpm")] {
        let (predicted, measured) = peaks(&block("hcp", [30, 25, 25], &[table], &pulled(law, ratio, contacts)));
        println!("{law}: predicted {predicted:e}, measured {measured:e}, {:+.3}", predicted / measured - 1.0);
        assert!((predicted / measured - 1.0).abs() < 0.15, "{law}: {predicted:e} instead of {measured:e}");
    }
}

/// The same for kinds of runs to which they were not fitted: other laws, deformable particles, operators, clumps, snapshots,
/// periodic cells, particles without contacts.
#[test]
#[ignore = "takes minutes; make test-full runs it"]
#[cfg(target_os = "linux")]
fn predicted_memory_holds_for_other_scenarios() {
    let deformable = "deformable = { young = \"200 GPa\", poisson = 0.3 }";
    let loose = |law: &str| format!("[contacts]\nlaw = \"{law}\"\n[stop]\nsteps = 3");
    let operators = "[[sample]]\noperator = \"region-stress\"\ninterval = 1\n\
                     region = { kind = \"box\", minimum = [0, 0, 0], maximum = [0.05, 0.05, 0.05] }\ngrid = [4, 4, 4]\n\
                     [[sample]]\noperator = \"fabric\"\ninterval = 1\n\
                     region = { kind = \"sphere\", center = [0.02, 0.02, 0.02], radius = 0.01 }\n\
                     [[sample]]\noperator = \"damage-tensor\"\ninterval = 1\n\
                     region = { kind = \"sphere\", center = [0.02, 0.02, 0.02], radius = 0.01 }\n";
    let snapshots = "[output]\nsnapshot_interval = 1\n";
    // 200 clumps of 60 spheres each, beside the block.
    let clump = |row: u32| {
        let spheres: Vec<String> = (0..60)
            .map(|k| format!("[{}, {}, -0.01, 0.001]", 0.0021 * f64::from(k), 0.0021 * f64::from(row)))
            .collect();
        format!("[[clump]]\nmaterial = \"m\"\nspheres = [{}]\n", spheres.join(", "))
    };
    let clumps = (0..200).map(clump).collect::<Vec<_>>().concat();
    let cell = "[packing.shape]\nkind = \"periodic\"\n";
    let strained = "[loading]\nkind = \"cell-strain\"\nvelocity_gradient = [[-1, 0, 0], [0, 0, 0], [0, 0, 0]]\n";
    let beams = pulled("cohesive_beam", 1.05, "frictional");
    let bonded = pulled("linear_bond", 1.05, "none");
    let runs = [
        ("beams with friction", block("hcp", [30, 25, 25], &[BEAM, FRICTION], &beams)),
        ("hertz-mindlin", block("fcc", [30, 25, 25], &[HERTZ], &loose("hertz_mindlin"))),
        ("spheres without contacts", block("sc", [60, 50, 50], &[FRICTION], &loose("frictional"))),
        ("deformable", block("hcp", [30, 25, 25], &[LINEAR, deformable], &bonded)),
        ("operators", block("hcp", [30, 25, 25], &[LINEAR], &format!("{bonded}\n{operators}"))),
        ("snapshots", block("hcp", [30, 25, 25], &[LINEAR], &format!("{bonded}\n{snapshots}"))),
        ("clumps", block("sc", [40, 40, 40], &[FRICTION], &format!("{}\n{clumps}", loose("frictional")))),
        (
            "periodic",
            block("bcc", [40, 35, 35], &[FRICTION], &format!("{}\n{strained}", loose("frictional")))
                .replace("[[material]]", &format!("{cell}[[material]]")),
        ),
    ];
    let mut wrong = Vec::new();
    for (name, source) in &runs {
        let (predicted, measured) = peaks(source);
        let error = predicted / measured - 1.0;
        println!("{name}: predicted {predicted:e}, measured {measured:e}, {error:+.3}");
        if error.abs() > 0.15 {
            wrong.push(format!("{name}: {predicted:e} instead of {measured:e}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
