//! Some hundred and ten typical mistakes of new users. None is silent, and every message says where (file and line, or the option), what (key and
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
    // Each word, number, and table of its own.
    scenario(
        "unit in the wrong case",
        ("cohesion = \"3 MPa\"", "cohesion = \"3 Mpa\""),
        &["cpm.cohesion = \"3 Mpa\"", "unknown unit `Mpa`"],
        "such as Pa, kPa, MPa",
    ),
    scenario(
        "strain in percent",
        ("crack_onset_strain = 1e-4", "crack_onset_strain = 0.01"),
        &["cpm.crack_onset_strain = 0.01", "breaks long before"],
        "write the strain itself, such as 1e-4",
    ),
    scenario(
        "rate of a laboratory with an end by steps",
        ("strain_rate = \"20 1/s\"", "strain_rate = \"1e-5 1/s\""),
        &["loading.strain_rate = \"1e-5 1/s\"", "`stop.steps` ends the run at a strain of"],
        "raise `loading.strain_rate` or `stop.steps`",
    ),
    scenario(
        "list of tables in single brackets",
        ("[output]", "[set]\nname = \"top\"\nselection = { kind = \"all\" }\n[output]"),
        &["set: expected a list of tables"],
        "write [[set]] with double brackets",
    ),
    scenario(
        "axis in upper case",
        ("strain_rate = \"20 1/s\"", "axis = \"Z\"\nstrain_rate = \"20 1/s\""),
        &["loading.axis = \"Z\""],
        "did you mean \"z\"?",
    ),
    scenario(
        "Poisson's ratio of a bond",
        ("shear_ratio = 0.2", "poisson = 0.2"),
        &["material[0].cpm.poisson: unknown key"],
        "`poisson` is called `shear_ratio` here",
    ),
    scenario(
        "gravity at the top",
        ("version = 1", "gravity = -9.81\nversion = 1"),
        &["gravity: unknown key"],
        "`gravity` is a key of [integration]",
    ),
    scenario(
        "gravity as one number",
        ("[integration]", "[integration]\ngravity = -9.81"),
        &["integration.gravity = -9.81"],
        "Example: `gravity = [",
    ),
    scenario(
        "damping that is no number",
        ("coefficient = 0.3", "coefficient = nan"),
        &["integration.damping.coefficient = nan", "not a number"],
        "Example: `coefficient = 0.3`",
    ),
    scenario(
        "stage without an end",
        ("[stop]\nstrain = 1e-3\nsteps = 1_000\n", "[[stage]]\nname = \"load\"\n"),
        &["stage[0].stop: missing key"],
        "add [stage.stop]",
    ),
    scenario(
        "name of a stage twice",
        (
            "[stop]\nstrain = 1e-3\nsteps = 1_000\n",
            "[[stage]]\nname = \"load\"\nstop = { strain = 1e-4 }\n[[stage]]\nname = \"load\"\nstop = { strain = 2e-4 }\n",
        ),
        &["stage[1].name = \"load\"", "another [[stage]] has this name"],
        "give each its own name",
    ),
    scenario(
        "misspelled material",
        ("[output]", "[[set]]\nname = \"top\"\nselection = { kind = \"all\" }\nmaterial = \"concrte\"\n[output]"),
        &["set[0].material = \"concrte\"", "no material has this name"],
        "did you mean \"concrete\"?",
    ),
    scenario(
        "share in percent",
        ("[output]", "[output]\nevents_damage = 90"),
        &["output.events_damage = 90", "at most 1"],
        "did you mean \"90 %\"?",
    ),
    scenario("misspelled table", ("[output]", "[outputs]"), &["outputs: unknown key"], "did you mean `output`?"),
    scenario(
        "keys of another loading",
        ("kind = \"uniaxial\"", "kind = \"platens\""),
        &["loading.strain_rate: unknown key for kind \"platens\"", "loading.closing_velocity: missing key"],
        "`strain_rate` is a key of [loading] of kind \"cell-stress\" or [loading] of kind \"uniaxial\"",
    )
    .at("m.toml:18:"),
    // Packing files.
    packing(
        "table in mm",
        "x,y,z,r\n0,0,0,1\n0,0,2,1\n0,0,4,1\n0,0,6,1\n0,0,8,1\n",
        &["packing.path = \"p.txt\"", "mean radius is 1 m"],
        "unit = \"1 mm\"",
    ),
    // What does not fit spheres of meters is named, and so is the unit.
    packing(
        "two spheres in mm",
        "x,y,z,r\n0,0,0,1\n0,0,2,1\n",
        &["loading.layer_thickness", "in p.txt the mean radius is 1 m", "numbers in a file without a unit are meters"],
        "write unit = \"1 mm\" in [packing]",
    ),
    packing(
        "negative radius",
        "x,y,z,r\n0,0,0,-1e-3\n0,0,2e-3,1e-3\n",
        &["packing.path = \"p.txt\"", "line 2: the radius -0.001 is not positive", "0,0,0,-1e-3"],
        "columns x, y, z, radius",
    ),
    packing(
        "coordinate that is no number",
        "x,y,z,r\n0,0,nan,1e-3\n0,0,2e-3,1e-3\n",
        &["packing.path = \"p.txt\"", "line 2: NaN is not finite", "0,0,nan,1e-3"],
        "columns x, y, z, radius",
    ),
    packing(
        "table without radii",
        "x,y,z\n0,0,0\n0,0,2e-3\n",
        &["packing.path = \"p.txt\"", "line 1", "x,y,z"],
        "must name the columns x, y, z, and radius",
    ),
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
    // Text that was pasted, and slips of typing.
    scenario(
        "typographic quotation marks",
        ("young = \"25 GPa\"", "young = “25 GPa”"),
        &["young = “25 GPa”", "`“` (U+201C) is a typographic quotation mark"],
        "young = \"25 GPa\"",
    ),
    scenario(
        "Unicode minus",
        ("strain = 1e-3", "strain = −3"),
        &["strain = −3", "not the minus of the keyboard"],
        "strain = -3",
    ),
    scenario(
        "Unicode minus in quotes",
        ("strain_rate = \"20 1/s\"", "strain_rate = \"−3 1/s\""),
        &["loading.strain_rate = \"−3 1/s\"", "(U+2212)"],
        "write \"-3 1/s\"",
    ),
    scenario(
        "letter of another alphabet in a word",
        ("law = \"cpm\"\ninteraction", "law = \"срm\"\ninteraction"),
        &["bonds.law = \"срm\"", "letter of another alphabet"],
        "write \"cpm\"",
    ),
    scenario(
        "semicolon",
        ("steps = 1_000", "steps = 1_000;"),
        &["steps = 1_000;"],
        "without a semicolon: steps = 1_000",
    ),
    scenario("colon for =", ("steps = 1_000", "steps: 1_000"), &["steps: 1_000"], "steps = 1_000"),
    scenario("True", ("[output]", "[output]\ncsv = True"), &["csv = True"], "write true in lower case"),
    scenario(
        "path with backslashes",
        ("[output]", "[output]\nfile = \"C:\\data\\r.h5\""),
        &["file = \"C:\\data\\r.h5\""],
        "in single quotes: 'C:\\data\\r.h5'",
    ),
    scenario(
        "table of a law above its material",
        ("[[material]]\n", "[material.hertz_mindlin]\nyoung = 1e9\n[[material]]\n"),
        &["duplicate key", "[[material]]"],
        "move [material.hertz_mindlin] below [[material]]",
    ),
    scenario(
        "table twice with its place",
        ("[output]", "[loading]\nkind = \"uniaxial\"\nstrain_rate = 1\n[output]"),
        &["duplicate key", "[loading]", "1 problem"],
        "line 18 has it, too",
    ),
    scenario(
        "key below the table of a law",
        ("[bonds]\n", "[material.hertz_mindlin]\nyoung = 1e9\npoisson = 0.2\ndensity = 4800\n[bonds]\n"),
        &["material[0].hertz_mindlin.density"],
        "`density` is a key of [material], but stands below [material.hertz_mindlin]: move it up",
    ),
    scenario(
        "key below [packing.shape]",
        (
            "radius = \"1 mm\"\nshape = { kind = \"box\", size = [\"9 mm\", \"9 mm\", \"16 mm\"] }",
            "[packing.shape]\nkind = \"box\"\nsize = [\"9 mm\", \"9 mm\", \"16 mm\"]\nlattice = \"fcc\"",
        ),
        &["packing.shape.lattice"],
        "`lattice` is a key of [packing], but stands below [packing.shape]: move it up",
    ),
    // Factors of a thousand.
    scenario(
        "modulus in MPa",
        ("young = \"25 GPa\"", "young = \"25 MPa\""),
        &["cpm.young = \"25 MPa\"", "softer than any concrete"],
        "concrete has some \"25 GPa\"",
    ),
    scenario(
        "region in meters",
        (
            "[output]",
            "[[sample]]\noperator = \"region-stress\"\nregion = { kind = \"sphere\", center = [0, 0, 0], radius = 5 }\n[output]",
        ),
        &["sample[0].region.radius = 5", "the region is 10 m wide"],
        "check the unit",
    ),
    scenario(
        "volume in meters",
        ("[output]", "[[sample]]\noperator = \"fabric\"\nregion = { kind = \"all\", volume = 1 }\n[output]"),
        &["sample[0].region.volume = 1", "the box around the body"],
        "\"16 cm^3\"",
    ),
    scenario(
        "STL of a wall in mm",
        ("[output]", "[[wall]]\nmaterial = \"concrete\"\nshape = { kind = \"facets\", path = \"cube.stl\" }\n[output]"),
        &["wall[0].shape", "the wall is 20 m wide"],
        "unit = \"1 mm\"",
    ),
    scenario(
        "STL of the body in mm",
        ("\"box\", size = [\"9 mm\", \"9 mm\", \"16 mm\"]", "\"mesh\", path = \"cube.stl\""),
        &["packing.shape"],
        "unit = \"1 mm\"",
    ),
    scenario(
        "open surface",
        ("\"box\", size = [\"9 mm\", \"9 mm\", \"16 mm\"]", "\"mesh\", path = \"open.stl\""),
        &["packing.shape.path = \"open.stl\"", "not closed"],
        "needs a closed one",
    ),
    scenario(
        "OBJ as STL",
        ("[output]", "[[wall]]\nmaterial = \"concrete\"\nshape = { kind = \"facets\", path = \"part.obj\" }\n[output]"),
        &["wall[0].shape.path = \"part.obj\"", "an OBJ file, not STL"],
        "save the surface as STL",
    ),
    scenario(
        "rate of a laboratory",
        (
            "strain_rate = \"20 1/s\"\n[stop]\nstrain = 1e-3\nsteps = 1_000",
            "strain_rate = \"1e-7 1/s\"\n[stop]\nstrain = 1e-3",
        ),
        &["loading.strain_rate = \"1e-7 1/s\"", "days on one core"],
        "rates of 0.1 to 100 1/s",
    ),
    scenario(
        "rate of a laboratory for a few particles",
        (
            "strain_rate = \"20 1/s\"\n[stop]\nstrain = 1e-3\nsteps = 1_000",
            "strain_rate = \"1e-6 1/s\"\n[stop]\nstrain = 1e-3",
        ),
        &["loading.strain_rate = \"1e-6 1/s\"", "steps of"],
        "rates of 0.1 to 100 1/s",
    ),
    scenario(
        "random packing in an STL file in mm",
        (
            "lattice\"\nlattice = \"fcc\"\nradius = \"1 mm\"\nshape = { kind = \"box\", size = [\"9 mm\", \"9 mm\", \"16 mm\"] }",
            "random-dense\"\ncount = 50\nradius = \"1 mm\"\nshape = { kind = \"mesh\", path = \"cube.stl\" }",
        ),
        &["spheres; at most"],
        "unit = \"1 mm\"",
    ),
    scenario(
        "specimen of a few rows",
        ("\"9 mm\", \"9 mm\", \"16 mm\"", "\"9 mm\", \"9 mm\", \"4 mm\""),
        &["loading.layer_thickness", "do not fit a specimen"],
        "one to three particle diameters",
    )
    .at("m.toml:18:"),
    scenario("strain in percent", ("strain = 1e-3", "strain = 0.5"), &["stop.strain = 0.5", "is 50 %"], "\"0.5 %\""),
    scenario(
        "set beside the body",
        (
            "[output]",
            "[[set]]\nname = \"top\"\nselection = { kind = \"box\", minimum = [-5, -5, 7], maximum = [5, 5, 9] }\n[output]",
        ),
        &["set[0].selection", "the centers lie between ["],
        "check its position and units",
    ),
    scenario(
        "notch beside the beam",
        (
            "[output]",
            "[[cut]]\nshape = { kind = \"parallelogram\", corner = [0, -10, -10], edges = [[0, 1, 0], [0, 0, 1]] }\n[output]",
        ),
        &["cut[0].shape", "crosses no bond"],
        "the centers lie between [",
    ),
    scenario(
        "two walls of one name",
        (
            "[output]",
            "[[wall]]\nname = \"w\"\nmaterial = \"concrete\"\nshape = { kind = \"plane\", point = [0, 0, \"-20 mm\"], normal = [0, 0, 1] }\n\
             [[wall]]\nname = \"w\"\nmaterial = \"concrete\"\nshape = { kind = \"plane\", point = [0, 0, \"20 mm\"], normal = [0, 0, -1] }\n[output]",
        ),
        &["wall[1].name = \"w\"", "wall[0] is called \"w\", too"],
        "give each [[wall]] its own `name`",
    ),
    packing(
        "table with decimal commas",
        "x,y,z,r\n0,5,1,0,2,0,0,1\n",
        &["packing.path = \"p.txt\"", "line 2", "expected 4 columns, found 8"],
        "write decimals with a point: 0.5, or separate columns by semicolons",
    ),
    command(
        "setting without =",
        "check m.toml --set packing.radius",
        "--set",
        &["packing.radius"],
        "packing.radius=\"2 mm\"",
    ),
    command(
        "setting with a space for =",
        "check m.toml --set packing.radius 2mm",
        "--set packing.radius 2mm",
        &["write = between key and value"],
        "--set packing.radius=\"2mm\"",
    ),
    command(
        "calibration in GPa",
        "calibrate elastic --law cpm --young 30 --poisson 0.2",
        "--young",
        &["plain numbers are Pa"],
        "\"30 GPa\"",
    ),
    command(
        "measure without a region",
        "measure r.h5",
        "--region",
        &["has no [[sample]]"],
        "--operator region-stress --region '{ kind = \"sphere\"",
    ),
    command(
        "operator without a region",
        "measure r.h5 --operator region-stress",
        "--region:",
        &["the packing has no periodic cell"],
        "such as { kind = \"sphere\"",
    ),
    // Commands.
    command(
        "elastic constants of a body",
        "elastic m.toml",
        "m.toml:2:",
        &["packing: the assembly has no periodic cell"],
        "write kind = \"periodic\" under [packing.shape]",
    ),
    command("result that is cut off", "report cut.h5", "cut.h5", &["its seal is missing"], "use an intact copy"),
    command(
        "result with a changed bit",
        "report bit.h5",
        "bit.h5",
        &["its content has changed since it was written"],
        "Use an intact copy",
    ),
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
        "misspelled key on the command line that the scenario has",
        "check m.toml --set packing.radus=2",
        "--set packing.radus=2",
        &["packing.radus", "unknown key"],
        "did you mean `radius`, which is given, too?",
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

/// A cube with edges of 20 units, the same without its top, and a triangle as OBJ.
fn write_surfaces(folder: &Path) {
    let corner = |k: usize| [k & 1, k >> 1 & 1, k >> 2 & 1].map(|bit| if bit == 0 { -10 } else { 10 });
    let faces = [
        [0, 2, 1],
        [1, 2, 3],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
        [4, 5, 6],
        [5, 7, 6],
    ];
    let facet = |face: &[usize; 3]| {
        let vertices = face.map(|k| {
            let [x, y, z] = corner(k);
            format!("vertex {x} {y} {z}\n")
        });
        format!("facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n", vertices.concat())
    };
    for (name, count) in [("cube.stl", 12), ("open.stl", 10)] {
        let facets: String = faces[..count].iter().map(facet).collect();
        write(folder, name, &format!("solid\n{facets}endsolid\n"));
    }
    write(folder, "part.obj", "# a part\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
}

/// Files in other encodings, other decks, and names without their ending.
#[test]
fn mistakes_in_files_and_other_decks_are_explained() {
    let folder = TempDir::new().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name);
    let check = |name: &str, bytes: &[u8]| {
        std::fs::write(path(name), bytes).expect("a file");
        concordem(["check", "--no-build", text(&path(name))])
    };
    let utf16: Vec<u8> = [0xff, 0xfe].into_iter().chain(BAR.encode_utf16().flat_map(u16::to_le_bytes)).collect();
    let latin = BAR.replace("version", "# K\u{f6}rner\nversion").chars().map(|c| c as u8).collect::<Vec<u8>>();
    let template = |name: &str| concordem::scenario::template(name).expect("a template").text;
    let gauge = template("concrete-bending").replacen("gauge = \"crack mouth\"", "gauge = \"cmod\"", 1);
    let tension = template("concrete-triaxial").replacen("[[\"-5 MPa\"", "[[\"5 MPa\"", 1);
    let soft = template("hertz-impact").replace("GPa", "Pa");
    let long = template("concrete-bending").replacen("span = \"90 mm\"", "span = \"900 mm\"", 1);
    let lying = template("concrete-splitting").replacen("axis = \"z\"", "axis = \"y\"", 1);
    let coarse = template("concrete-mesoscale").replacen("\"9.5 mm\"", "\"95 mm\"", 1);
    let cases: [(&str, &[u8], &[&str]); 8] = [
        (
            "long.toml",
            long.as_bytes(),
            &["loading.span = \"900 mm\": is longer than the beam, 100 mm", "let the beam stick out"],
        ),
        (
            "lying.toml",
            lying.as_bytes(),
            &[
                "lying.toml:48:8",
                "loading.area = \"splitting\"",
                "needs a cylinder that lies across the axis",
                "give [packing.shape] kind = \"cylinder\" with another axis",
            ],
        ),
        (
            "coarse.toml",
            coarse.as_bytes(),
            &["aggregates.group[0].grading", "no grading up to 0.095 m", "Stránský 2018 has 9.5, 12.5, and 19 mm"],
        ),
        ("utf16.toml", &utf16[..], &["is text in UTF-16; save it as UTF-8"][..]),
        ("latin.toml", &latin[..], &["latin.toml:1: the line has bytes that are not UTF-8; save the file as UTF-8"]),
        (
            "gauge.toml",
            gauge.as_bytes(),
            &[
                "loading.opening.gauge = \"cmod\"",
                "no gauge has this name",
                "or add [[sample]] with name = \"cmod\", operator = \"gauge\", and two `sets`",
            ],
        ),
        (
            "tension.toml",
            tension.as_bytes(),
            &[
                "loading.stress[0][0] = \"5 MPa\"",
                "pulls along x, because tension is positive",
                "write \"-5 MPa\" for a pressure",
            ],
        ),
        ("soft.toml", soft.as_bytes(), &["hertz_mindlin.young", "softer than any solid", "check the unit"]),
    ];
    for (name, bytes, expected) in cases {
        let given = check(name, bytes);
        // Lines of a picture are wrapped.
        let plain = given.err.replace("\n  | ", " ").replace("\n        ", " ");
        for part in expected {
            assert!(plain.contains(part), "{name}: no {part:?} in\n{plain}");
        }
    }
    // Lines that end with a carriage return alone are lines.
    let old = check("old.toml", BAR.replace('\n', "\r").as_bytes());
    assert_eq!(old.code, exit::DONE, "{}", old.err);
    // So are those of Windows, behind a byte order mark; a space that does not break is a space; names of files may have any letter.
    let windows = format!("\u{feff}{}", BAR.replace('\n', "\r\n").replace("25 GPa", "25\u{a0}GPa"));
    let odd = check("prüf ß.toml", windows.as_bytes());
    assert!(odd.code == exit::DONE && !odd.err.contains("error"), "{}", odd.err);
    // Temporary files are no business of the user.
    let nowhere = concordem(["run", text(&path("old.toml")), "-o", "/proc/x.h5"]);
    assert!(nowhere.err.contains("/proc cannot be written") && !nowhere.err.contains(".unfinished"), "{}", nowhere.err);
    let without = concordem(["check", text(&path("old"))]);
    assert!(without.err.contains("Did you mean") && without.err.contains("old.toml?"), "{}", without.err);
    let brazilian = concordem(["init", "--template", "brazilian", text(&path("split.toml"))]);
    assert_eq!(brazilian.code, exit::DONE, "{}", brazilian.err);
    let written = std::fs::read_to_string(path("split.toml")).expect("a template");
    assert!(written.contains(template("concrete-splitting")));
}

/// Scenarios that a newcomer wrote and that passed without a word: bodies that are none, numbers off by six digits, and tests without end.
#[test]
fn doubtful_specimens_and_strengths_are_named() {
    let folder = TempDir::new().expect("a temporary folder");
    let rock = "cohesive_beam = { young = \"60 GPa\", radius_ratio = 0.8, tensile_strength = \"20 MPa\" }";
    let bar =
        BAR.lines().map(|line| if line.starts_with("cpm =") { rock } else { line }).collect::<Vec<_>>().join("\n");
    let bar = bar.replace("law = \"cpm\"\ninteraction_ratio = 1.5", "law = \"cohesive_beam\"\ninteraction_ratio = 1.1");
    let bar = bar.replace("[contacts]\nlaw = \"cpm\"", "[contacts]\nlaw = \"none\"");
    let notched = concordem::scenario::template("concrete-bending").expect("a template").text;
    // Nine spheres in a row along z, with the text `more` behind each.
    let row = |more: &str| (0..9).map(|k| format!("0,0,{},1{more}", 2 * k)).collect::<Vec<_>>().join("\n");
    write(folder.path(), "stray.csv", &format!("x [mm],y [mm],z [mm],r [mm]\n{}\n100,0,4,1\n", row("")));
    write(folder.path(), "twice.csv", &format!("x [mm],y [mm],z [mm],r [mm]\n{}\n0,0,4,1\n", row("")));
    write(folder.path(), "both.csv", &format!("x [mm],y [mm],z [mm],r [mm],d [mm]\n{}\n", row(",5")));
    let start = bar.find("[packing]").expect("a packing");
    let end = bar.find("[[material]]").expect("a material");
    let file = |name: &str| format!("{}[packing]\nkind = \"file\"\npath = \"{name}\"\n{}", &bar[..start], &bar[end..]);
    let stages =
        bar.replace("[stop]\nstrain = 1e-3\nsteps = 1_000", "[[stage]]\nname = \"load\"\nstop = { strain = -1e-4 }");
    let cases: [(&str, String, &[&str]); 11] = [
        ("through.toml", notched.replace("\"8.7 mm\"", "\"28.7 mm\""), &["cut[0]", "pieces of 905 and 904 particles"]),
        (
            "gauge.toml",
            notched.replace("[\"left\", \"right\"]", "[\"left\", \"left\"]"),
            &["sample[0].sets", "no distance from itself"],
        ),
        (
            "pascals.toml",
            bar.replace("\"20 MPa\"", "20"),
            &["tensile_strength = 20", "a strain of 3e-10", "write \"20 MPa\""],
        ),
        ("thick.toml", bar.replace("ratio = 0.8", "ratio = 80"), &["radius_ratio = 80", "80 times as thick"]),
        (
            "spring.toml",
            bar.replace("radius_ratio", "model = \"spring\", cohesion = \"60 MPa\", radius_ratio"),
            &["cohesion = \"60 MPa\"", "bear no shear"],
        ),
        (
            "scatter.toml",
            bar.replace("density = 4800", "density = 4800\nstrength_scatter = { weibull_modulus = 0.01 }"),
            &["weibull_modulus = 0.01", "orders of magnitude"],
        ),
        (
            "signs.toml",
            stages,
            &["stage[0].stop.strain = -1e-4", "the stage raises the strain from 0", "it never ends"],
        ),
        ("stray.toml", file("stray.csv"), &["lie beside it: along x it is 102 mm long with them, 2 mm without"]),
        ("twice.toml", file("twice.csv"), &["overlap by 2.000 of the smaller radius"]),
        (
            "both.toml",
            file("both.csv"),
            &[
                "line 2: the diameter 0.005 is not twice the radius 0.001; remove or rename one column",
                "8 more lines are wrong: 3, 4, 5, 6, 7, ...",
            ],
        ),
        ("whole.toml", bar.replace("\"16 mm\"] }", "\"16 mm\"], keep = \"centers\" }"), &[]),
    ];
    for (name, text, expected) in cases {
        write(folder.path(), name, &text);
        let given = concordem(["check", folder.path().join(name).to_str().expect("a path")]);
        // Lines of a picture are wrapped.
        let plain = given.err.replace("\n  | ", " ").replace("\n        ", " ");
        for part in expected {
            assert!(plain.contains(part), "{name}: no {part:?} in\n{plain}");
        }
        assert!(!expected.is_empty() || given.err.is_empty(), "{name}: {plain}");
    }
}

/// Every message has a score: one point each for the place, for key and value, and for the remedy.
#[test]
fn typical_mistakes_are_explained() {
    let folder = TempDir::new().expect("a temporary folder");
    write_surfaces(folder.path());
    write(folder.path(), "r.toml", &BAR.replace("steps = 1_000", "steps = 10"));
    assert_eq!(concordem(["run", "-q", text(&folder.path().join("r.toml"))]).code, exit::DONE);
    let mut bytes = std::fs::read(folder.path().join("r.h5")).expect("a result");
    let middle = bytes.len() / 2;
    std::fs::write(folder.path().join("cut.h5"), &bytes[..middle]).expect("a file");
    bytes[middle] ^= 1;
    std::fs::write(folder.path().join("bit.h5"), &bytes).expect("a file");
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
    assert!(
        MISTAKES.len() >= 110 && report.is_empty(),
        "mean {mean:.2} of 3 for {} mistakes\n{report}",
        MISTAKES.len()
    );
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
