//! Some sixty typical mistakes of new users. None is silent, and every message says where (file and line, or the option), what (key and
//! value), and how to mend it.

use std::fmt::Write as _;
use std::path::Path;

use concordem::program::exit;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

/// A small bar of concrete on a lattice.
const BAR: &str = r#"version = 1
[packing]
kind = "lattice"
lattice = "fcc"
radius = "1 mm"
shape = { kind = "box", size = ["9 mm", "9 mm", "16 mm"] }
[[material]]
name = "concrete"
density = 4800
cpm = { young = "25 GPa", shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = 5, cohesion = "3 MPa", friction_coefficient = 0.8 }
[bonds]
law = "cpm"
interaction_ratio = 1.5
[contacts]
law = "cpm"
[integration]
damping = { kind = "local", coefficient = 0.3 }
[loading]
kind = "uniaxial"
strain_rate = "20 1/s"
[stop]
strain = 1e-3
steps = 1_000
[output]
sample_interval = 10
"#;

/// The packing of [`BAR`] from a file.
const FILE: &str = "[packing]\nkind = \"file\"\npath = \"p.txt\"\n";

/// A mistake: how to make it, and what the message must contain.
struct Mistake {
    name: &'static str,
    /// Text of the scenario to replace, and its replacement, whose first line the message must name.
    change: (&'static str, &'static str),
    /// Content of the packing file.
    packing: &'static str,
    /// The command; `m.toml` is the scenario.
    command: &'static str,
    /// Place (if it is not the line of the change), key and value, remedy.
    place: &'static str,
    what: &'static [&'static str],
    remedy: &'static str,
}

impl Mistake {
    /// The same at another place, because what is missing has no line.
    const fn at(mut self, place: &'static str) -> Self {
        self.place = place;
        self
    }
}

/// A mistake in the scenario.
const fn scenario(
    name: &'static str,
    change: (&'static str, &'static str),
    what: &'static [&'static str],
    remedy: &'static str,
) -> Mistake {
    Mistake { name, change, packing: "", command: "check m.toml", place: "", what, remedy }
}

/// A mistake in a packing file.
const fn packing(
    name: &'static str,
    content: &'static str,
    what: &'static [&'static str],
    remedy: &'static str,
) -> Mistake {
    Mistake { name, change: ("", ""), packing: content, command: "check m.toml", place: "m.toml:", what, remedy }
}

/// A mistake on the command line.
const fn command(
    name: &'static str,
    command: &'static str,
    place: &'static str,
    what: &'static [&'static str],
    remedy: &'static str,
) -> Mistake {
    Mistake { name, change: ("", ""), packing: "", command, place, what, remedy }
}

const MISTAKES: &[Mistake] = &[
    // Units and sizes.
    scenario("density in g/cm³", ("density = 4800", "density = 4.8"), &["material[0].density = 4.8"], "\"4.8 g/cm^3\""),
    scenario("density in kg/m³ times 1000", ("density = 4800", "density = 4.8e6"), &["density", "4.8e6"], "g/cm^3"),
    scenario(
        "radius in mm",
        (
            "radius = \"1 mm\"\nshape = { kind = \"box\", size = [\"9 mm\", \"9 mm\", \"16 mm\"] }",
            "radius = 1\nshape = { kind = \"box\", size = [9, 9, 16] }",
        ),
        &["packing.radius = 1"],
        "\"1 mm\"",
    ),
    scenario("modulus in GPa", ("young = \"25 GPa\"", "young = 25"), &["cpm.young = 25"], "\"25 GPa\""),
    scenario(
        "number and unit without quotes",
        ("radius = \"1 mm\"", "radius = 1 mm"),
        &["radius = 1 mm"],
        "quotes: \"1 mm\"",
    ),
    scenario("decimal comma", ("radius = \"1 mm\"", "radius = 1,5"), &["radius = 1,5"], "with a point: 1.5"),
    scenario(
        "unknown unit",
        ("radius = \"1 mm\"", "radius = \"1 milli\""),
        &["packing.radius = \"1 milli\""],
        "such as m, cm, mm",
    ),
    scenario(
        "unit of another dimension",
        ("radius = \"1 mm\"", "radius = \"1 GPa\""),
        &["packing.radius = \"1 GPa\"", "stress"],
        "such as m, cm, mm",
    ),
    scenario(
        "1e8 spheres",
        (
            "lattice\"\nlattice = \"fcc\"\nradius = \"1 mm\"\nshape = { kind = \"box\", size = [\"9 mm\", \"9 mm\", \"16 mm\"] }",
            "random-dense\"\ncount = 100_000_000\nradius = \"1 mm\"\nshape = { kind = \"box\", size = [\"9 mm\", \"9 mm\", \"16 mm\"] }",
        ),
        &["packing.count = 100_000_000", "GB of memory"],
        "fewer or larger particles",
    ),
    scenario(
        "shape in meters",
        ("\"9 mm\", \"9 mm\", \"16 mm\"", "9, 9, 16"),
        &["packing.shape", "particles exceed"],
        "check the units",
    ),
    scenario(
        "shape narrower than a particle",
        ("\"9 mm\", \"9 mm\", \"16 mm\"", "\"9 um\", \"9 mm\", \"16 mm\""),
        &["packing.shape.size[0] = \"9 um\""],
        "check the units",
    ),
    scenario(
        "friction in degrees",
        ("friction_coefficient = 0.8", "friction_coefficient = 38"),
        &["cpm.friction_coefficient = 38"],
        "tangent of the angle",
    ),
    scenario(
        "strain in percent or per mille",
        ("crack_onset_strain = 1e-4", "crack_onset_strain = 0.1"),
        &["cpm.crack_onset_strain = 0.1"],
        "1e-4",
    ),
    // Keys and words.
    scenario(
        "misspelled key",
        ("strain_rate = \"20 1/s\"", "strainrate = \"20 1/s\""),
        &["loading.strainrate"],
        "did you mean `strain_rate`?",
    ),
    scenario(
        "misspelled law",
        ("law = \"cpm\"\ninteraction", "law = \"cmp\"\ninteraction"),
        &["bonds.law = \"cmp\""],
        "did you mean \"cpm\"?",
    ),
    scenario(
        "key twice",
        ("lattice = \"fcc\"", "lattice = \"fcc\"\nlattice = \"sc\""),
        &["duplicate key", "lattice = \"sc\""],
        "keep one of the two",
    ),
    scenario("word without quotes", ("lattice = \"fcc\"", "lattice = fcc"), &["lattice = fcc"], "put words in quotes"),
    scenario("missing key", ("radius = \"1 mm\"\n", ""), &["packing.radius: missing key"], "add `radius = ...`")
        .at("m.toml:2:"),
    scenario(
        "name of YADE",
        ("crack_onset_strain", "epsCrackOnset"),
        &["material[0].cpm.epsCrackOnset"],
        "is called `crack_onset_strain`",
    ),
    scenario("one material in single brackets", ("[[material]]", "[material]"), &["material"], "[[material]]"),
    scenario(
        "law without table",
        ("law = \"cpm\"\n[integration]", "law = \"frictional\"\n[integration]"),
        &["material[0].frictional", "contacts.law"],
        "add [material.frictional]",
    )
    .at("m.toml:7:"),
    scenario("no end", ("[stop]\nstrain = 1e-3\nsteps = 1_000\n", ""), &["stop: the run has no end"], "add [stop]")
        .at("m.toml:1:"),
    scenario(
        "unknown set",
        ("[stop]", "[[force]]\nset = \"tpo\"\nforce = [1, 0, 0]\n[stop]"),
        &["force[0].set = \"tpo\""],
        "add [[set]]",
    ),
    scenario(
        "table twice",
        ("[output]", "[packing]\n[output]"),
        &["duplicate key", "[packing]"],
        "keep one of the two",
    ),
    // What does not fit together.
    scenario(
        "no bonds",
        ("interaction_ratio = 1.5", "interaction_ratio = 0.5"),
        &["bonds.interaction_ratio = 0.5"],
        "at least 1",
    ),
    scenario(
        "hopelessly slow",
        ("strain_rate = \"20 1/s\"", "strain_rate = \"1e-9 1/s\""),
        &["loading.strain_rate", "1e-9"],
        "raise `loading.strain_rate`",
    ),
    scenario(
        "too fast",
        ("strain_rate = \"20 1/s\"", "strain_rate = \"1e5 1/s\""),
        &["loading.strain_rate", "1e5"],
        "use a strain rate below",
    ),
    scenario(
        "too long",
        ("strain = 1e-3\nsteps = 1_000", "steps = 10_000_000_000_000"),
        &["stop.steps = 10_000_000_000_000", "days"],
        "end the run earlier",
    ),
    scenario(
        "unstable step",
        ("[integration]", "[integration]\ntime_step = \"1 ms\""),
        &["integration.time_step = \"1 ms\"", "stability bound of"],
        "write \"auto\" or a smaller step",
    ),
    scenario(
        "layer thicker than the bar",
        ("kind = \"uniaxial\"", "kind = \"uniaxial\"\nlayer_thickness = \"1 m\""),
        &["loading.layer_thickness = \"1 m\""],
        "one to three particle diameters",
    ),
    scenario(
        "empty region",
        (
            "[output]",
            "[[sample]]\noperator = \"region-stress\"\nregion = { kind = \"sphere\", center = [1, 0, 0], radius = \"1 mm\" }\n[output]",
        ),
        &["sample[0].region", "no particle lies in this region"],
        "check its position and units",
    ),
    scenario(
        "empty set",
        (
            "[output]",
            "[[set]]\nname = \"top\"\nselection = { kind = \"box\", minimum = [1, 1, 1], maximum = [2, 2, 2] }\n[output]",
        ),
        &["set[0]", "top"],
        "check its position and units",
    ),
    scenario(
        "wall in the bar",
        (
            "[output]",
            "[[wall]]\nmaterial = \"concrete\"\nshape = { kind = \"plane\", point = [0, 0, 0], normal = [0, 0, 1] }\n[output]",
        ),
        &["wall[0].shape", "before the first step"],
        "turn the normal",
    ),
    scenario(
        "result that is no HDF5",
        ("[output]", "[output]\nfile = \"r.pdf\""),
        &["output.file = \"r.pdf\""],
        "\"r.h5\"",
    ),
    scenario(
        "result in a missing folder",
        ("[output]", "[output]\nfile = \"no/r.h5\""),
        &["output.file = \"no/r.h5\""],
        "create the folder",
    ),
    scenario(
        "unused table",
        ("density = 4800", "density = 4800\nhertz_mindlin = { young = \"25 GPa\", poisson = 0.2 }"),
        &["material[0].hertz_mindlin", "no effect"],
        "remove the table",
    ),
    scenario(
        "missing packing file",
        (
            "kind = \"lattice\"\nlattice = \"fcc\"\nradius = \"1 mm\"\nshape = { kind = \"box\", size = [\"9 mm\", \"9 mm\", \"16 mm\"] }",
            "kind = \"file\"\npath = \"q.txt\"",
        ),
        &["packing.path = \"q.txt\"", "No such file"],
        "check the path",
    ),
    // Packing files.
    packing(
        "packing in mm",
        "0 0 0 1\n0 0 2 1\n0 0 4 1\n0 0 6 1\n0 0 8 1\n",
        &["packing.path = \"p.txt\"", "mean radius is 1 m"],
        "unit = \"1 mm\"",
    ),
    packing(
        "empty packing file",
        "# x y z r\n",
        &["packing.path = \"p.txt\"", "has no spheres"],
        "one sphere per line, x y z r",
    ),
    packing(
        "table without names",
        "a,b,c,d\n1,2,3,4\n",
        &["packing.path = \"p.txt\"", "line 1", "a,b,c,d"],
        "x, y, z, and radius",
    ),
    packing(
        "line that is cut off",
        "0 0 0 1e-3\n0 0 2e-3\n",
        &["packing.path = \"p.txt\"", "line 2", "0 0 2e-3"],
        "x y z r",
    ),
    packing(
        "overlapping spheres",
        "0 0 0 1e-3\n0 0 1e-4 1e-3\n0 0 2e-3 1e-3\n0 0 4e-3 1e-3\n0 0 8e-3 1e-3\n",
        &["packing", "overlap by 1.9"],
        "check positions, radii, and units",
    ),
    // Commands.
    command("page as PDF", "report r.h5 -o x.pdf", "--output x.pdf", &["HTML"], "use x.html"),
    command("result as PDF", "run m.toml -o x.pdf", "--output x.pdf", &["HDF5"], "use x.h5"),
    command(
        "report of a scenario",
        "report m.toml",
        "m.toml",
        &["is a scenario, not a result"],
        "run it first: concordem run",
    ),
    command("run of a result", "run r.h5", "r.h5", &["is an HDF5 file, not a scenario"], "use `concordem report"),
    command(
        "sweep of a scenario",
        "sweep m.toml",
        "m.toml:",
        &["this is a scenario, not a sweep"],
        "scenario = \"m.toml\"",
    ),
    command(
        "result where nothing can be written",
        "run m.toml -o /proc/x.h5",
        "/proc",
        &["cannot be written"],
        "choose another folder",
    ),
    command("missing scenario", "run n.toml", "n.toml", &["No such file"], "`concordem init` lists templates"),
    command("existing result", "run m.toml -o r.h5", "r.h5", &["already exists"], "--force"),
    command("run that never began", "resume never.h5", "never.h5", &["there is no run"], "Check the name"),
    command(
        "wrong value on the command line",
        "check m.toml --set loading.strain_rate=5x",
        "--set loading.strain_rate=5x",
        &["loading.strain_rate = \"5x\"", "unknown unit"],
        "such as 1/s",
    ),
    command(
        "wrong key on the command line",
        "check m.toml --set loading.strain_rte=5",
        "--set loading.strain_rte=5",
        &["loading.strain_rte", "unknown key"],
        "`strain_rate`",
    ),
    command(
        "wrong value of the only material on the command line",
        "check m.toml --set material.density=-1",
        "--set material.density=-1",
        &["material[0].density = -1"],
        "must be greater than 0",
    ),
    command(
        "doubtful value of a material by name",
        "check m.toml --set material[concrete].density=4.8",
        "--set material[concrete].density=4.8",
        &["material[0].density = 4.8"],
        "\"4.8 g/cm^3\"",
    ),
    command("unknown key", "explain strain_rat", "strain_rat", &["no key `strain_rat`"], "`loading.strain_rate`"),
    command("unknown command", "chek m.toml", "chek", &["unrecognized subcommand"], "'check'"),
];

/// Where a message shows the line: `m.toml:7:` in plain text, `[m.toml:7:` in a picture.
fn line_of(text: &str, part: &str) -> usize {
    let at = text.find(part).expect("the change is in the text");
    text[..at].matches('\n').count() + 1
}

/// Parts of the message that are missing: the place, the key or value, the remedy.
fn missing(mistake: &Mistake, folder: &Path) -> (Vec<String>, String) {
    let mut scenario = BAR.to_owned();
    let mut place = mistake.place.to_owned();
    if !mistake.packing.is_empty() {
        let (start, end) = (BAR.find("[packing]").expect("a table"), BAR.find("[[material]]").expect("a table"));
        scenario.replace_range(start..end, FILE);
        write(folder, "p.txt", mistake.packing);
    }
    let (old, new) = mistake.change;
    if !old.is_empty() {
        scenario = BAR.replacen(old, new, 1);
        assert_ne!(scenario, BAR, "{}: the change has no effect", mistake.name);
        if place.is_empty() {
            // A message may name any line of the change, and the first line if something is missing.
            place = format!("m.toml:{}:", line_of(BAR, old));
        }
    }
    write(folder, "m.toml", &scenario);
    let arguments = mistake.command.split(' ').enumerate().map(|(k, word)| {
        let extension = Path::new(word).extension().and_then(std::ffi::OsStr::to_str);
        let is_file = k > 0 && matches!(extension, Some("toml" | "h5")) && !word.starts_with('/');
        if is_file { text(&folder.join(word)).to_owned() } else { word.to_owned() }
    });
    let given = concordem(arguments);
    let shown = given.err.replace(&format!("{}/", text(folder)), "");
    // Lines of a picture are wrapped.
    let plain = shown.replace("\n  | ", " ").replace("\n        ", " ");
    assert!(given.code != exit::DONE || shown.contains("warning: "), "{} is silent: {shown}", mistake.name);
    assert_ne!(given.code, exit::INTERNAL, "{}: {shown}", mistake.name);
    let lines = new.matches('\n').count() + 1;
    let first: usize = place.split(':').nth(1).and_then(|line| line.parse().ok()).unwrap_or(0);
    let is_placed = plain.contains(&place)
        || (first > 0 && (first..first + lines).any(|line| plain.contains(&format!("m.toml:{line}:"))));
    let mut lacks = Vec::new();
    if !is_placed {
        lacks.push(format!("the place {place}"));
    }
    if !mistake.what.iter().all(|part| plain.contains(part)) {
        lacks.push(format!("{:?}", mistake.what));
    }
    if !plain.contains(mistake.remedy) {
        lacks.push(format!("the remedy {:?}", mistake.remedy));
    }
    (lacks, shown)
}

/// Every message has a score: one point each for the place, for key and value, and for the remedy.
#[test]
fn typical_mistakes_are_explained() {
    let folder = TempDir::new().expect("a temporary folder");
    write(folder.path(), "r.toml", &BAR.replace("steps = 1_000", "steps = 10"));
    assert_eq!(concordem(["run", "-q", text(&folder.path().join("r.toml"))]).code, exit::DONE);
    let mut points = 0;
    let mut report = String::new();
    for mistake in MISTAKES {
        let (lacks, shown) = missing(mistake, folder.path());
        points += 3 - lacks.len();
        if !lacks.is_empty() {
            writeln!(report, "{} lacks {}:\n{shown}", mistake.name, lacks.join(", ")).expect("a string");
        }
    }
    let mean = points as f64 / MISTAKES.len() as f64;
    assert!(MISTAKES.len() >= 40 && report.is_empty(), "mean {mean:.2} of 3 for {} mistakes\n{report}", MISTAKES.len());
}

/// At most ten problems are shown, with the number of the others.
#[test]
fn many_problems_are_counted() {
    let folder = TempDir::new().expect("a temporary folder");
    let walls: String = ["a", "b", "c", "d", "e", "f", "g", "h"].map(|key| format!("[[wall]]\n{key} = 1\n")).concat();
    let path = write(folder.path(), "m.toml", &format!("{BAR}{walls}"));
    let given = concordem(["check", text(&path)]);
    assert_eq!(given.code, exit::USAGE);
    assert!(given.err.contains("24 problems; 14 of them are not shown"), "{}", given.err);
    assert_eq!(given.err.matches("help:").count(), 10, "{}", given.err);
}
