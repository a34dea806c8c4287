//! Reading sweeps, and their points.

use super::*;

const SCENARIO: &str = "version = 1\n[packing]\nkind = \"lattice\"\nlattice = \"fcc\"\nradius = 1e-3\n\
    repeats = [2, 2, 2]\nshape = { kind = \"periodic\" }\n[[material]]\nname = \"m\"\ndensity = 2000\n\
    linear_bond = { normal_stiffness = 1e7, shear_stiffness = 0 }\n[bonds]\nlaw = \"linear_bond\"\n\
    interaction_ratio = 1.1\n[contacts]\nlaw = \"none\"\n[stop]\nsteps = 1\n";

fn sweep(axes: &str) -> Result<Sweep, ReadError> {
    let text = format!("version = 1\nscenario = \"s.toml\"\n{axes}");
    let source = Source::new("sweep.toml", &text);
    let mut sweep = Sweep::parse(source, &|_| Ok(("s.toml".into(), SCENARIO.to_owned())))?;
    sweep.check_points()?;
    Ok(sweep)
}

#[test]
fn points_are_all_combinations() {
    let sweep = sweep(
        "[[axis]]\nkey = \"bonds.interaction_ratio\"\nvalues = [1.1, 1.5]\n[[axis]]\nname = \"springs\"\n\
         keys = [\"material[0].linear_bond.normal_stiffness\", \"material[0].linear_bond.shear_stiffness\"]\n\
         values = [[1e7, 0], [\"2e7 N/m\", 1e6], [3e7, 3e7]]\n[[axis]]\nkey = \"title\"\nvalues = [\"a\"]\n",
    )
    .unwrap();
    assert_eq!((sweep.points(), sweep.place(4)), (6, vec![1, 1, 0]));
    let scenario = sweep.scenario(4).unwrap();
    let bond = scenario.materials[0].linear_bond.as_ref().unwrap();
    assert_eq!((bond.normal_stiffness.si(), bond.shear_stiffness.si()), (2e7, 1e6));
    assert_eq!(scenario.bonds.unwrap().interaction_ratio.si(), 1.5);
    assert_eq!((scenario.title.as_str(), sweep.axes[1].text(1).as_str()), ("a", "2e7 N/m, 1000000.0"));
}

#[test]
fn ranges_keep_their_ends() {
    let sweep =
        sweep("[[axis]]\nkey = \"bonds.interaction_ratio\"\nlogarithmic = { from = 1.1, to = 1.9, count = 3 }\n")
            .unwrap();
    let numbers: Vec<f64> = (0..3).filter_map(|k| sweep.axes[0].number(k)).collect();
    assert_eq!((numbers[0], numbers[2]), (1.1, 1.9));
    assert!((numbers[1] - (1.1_f64 * 1.9).sqrt()).abs() < 1e-11);
}

const SAMPLED: &str = "[sampling]\nmethod = \"sobol\"\ncount = 8\n\
    [[axis]]\nkey = \"bonds.interaction_ratio\"\nlinear = { from = 1.1, to = 1.9 }\n\
    [[axis]]\nkey = \"title\"\nvalues = [\"a\", \"b\", \"c\"]\n\
    [[axis]]\nkey = \"material[0].density\"\nlogarithmic = { from = 1e3, to = 1e4 }\n";

/// Sampled axes count as one axis, at the place of the first of them, and have the same index.
#[test]
fn sampled_axes_are_one_axis() {
    let read = |text: &str| sweep(text);
    let sweep = read(SAMPLED).unwrap();
    assert_eq!(sweep.points(), 24);
    for point in 0..24 {
        assert_eq!(sweep.place(point), [point / 3, point % 3, point / 3]);
    }
    let scenario = sweep.scenario(23).unwrap();
    let density = sweep.axes[2].number(7).unwrap();
    assert_eq!((scenario.materials[0].density.si(), scenario.title.as_str()), (density, "c"));
    for (axis, from, to) in [(0, 1.1, 1.9), (2, 1e3, 1e4)] {
        let numbers: Vec<f64> = (0..8).filter_map(|k| sweep.axes[axis].number(k)).collect();
        assert!(numbers.iter().all(|number| (from..=to).contains(number)), "{numbers:?}");
        let distinct: BTreeSet<u64> = numbers.iter().map(|number| number.to_bits()).collect();
        assert_eq!(distinct.len(), 8);
        assert!(numbers.iter().all(|number| format!("{number:.11e}").parse() == Ok(*number)), "twelve digits");
    }
    // Half of the samples of a logarithmic axis are in the lower half of the logarithms.
    let low = (0..8).filter(|&k| sweep.axes[2].number(k).unwrap() < 10.0_f64.powf(3.5)).count();
    assert_eq!(low, 4);
    // The seed changes the samples.
    let other = read(&SAMPLED.replace("count = 8", "count = 8\nseed = 2")).unwrap();
    assert_ne!(other.axes[0], sweep.axes[0]);
    let first = read(&SAMPLED.replace("count = 8", "count = 8\nseed = 1")).unwrap();
    assert_eq!(first.axes, sweep.axes);
}

/// Every refusal of samples and curves gives position, value, and remedy.
#[test]
fn wrong_samples_and_curves_are_refused() {
    let curve = |keys: &str| {
        let text = "study = \"run\"\n[[axis]]\nkey = \"title\"\nvalues = [\"a\"]\n[[curve]]\n".to_owned();
        text + keys
    };
    let axis = "[[axis]]\nkey = \"bonds.interaction_ratio\"\n";
    let good = "x = \"strain\"\ny = \"stress\"\nfrom = 0\nto = 1\ncount = 5\n";
    let axes: Vec<String> =
        (0..257).map(|k| format!("[[axis]]\nkey = \"a{k}\"\nlinear = {{ from = 0, to = 1 }}\n")).collect();
    let many = "[sampling]\nmethod = \"sobol\"\ncount = 4\n".to_owned() + &axes.concat();
    for (text, line, words) in [
        (format!("{axis}linear = {{ from = 1.1, to = 1.5 }}\n"), 5, "has no `count`, and the sweep has no [sampling]"),
        (format!("{axis}values = [1.1]\n[sampling]\nmethod = \"sobol\"\ncount = 4\n"), 6, "no axis is sampled"),
        (SAMPLED.replace("count = 8", "count = 0"), 5, "0 samples are not possible"),
        (SAMPLED.replace("count = 8", "count = 65537"), 5, "65537 samples are not possible"),
        (SAMPLED.replace("count = 8", "count = -1"), 5, "-1"),
        (SAMPLED.replace("sobol", "halton"), 4, "halton"),
        (SAMPLED.replace("count = 8", "count = 8\nseed = -1"), 6, "-1"),
        (SAMPLED.replace("count = 8", "counts = 8"), 5, "unknown field"),
        (SAMPLED.replace("1.9 }", "1.9 }\naverage = true"), 9, "a sampled axis has no mean"),
        (SAMPLED.replace("from = 1e3", "from = 0"), 14, "cannot be logarithmic"),
        (SAMPLED.replace("to = 1.9", "to = inf"), 8, "is not possible"),
        (SAMPLED.replace("from = 1.1", "from = -1.1"), 6, "refuses bonds.interaction_ratio = "),
        (many, 4, "257 axes are sampled; the Sobol sequence has 256 dimensions"),
        (curve(&good.replace("\"strain\"", "\"strein\"")), 8, "no series `strein`; there are time, step, strain"),
        (curve(&good.replace("\"stress\"", "\"max stress\"")), 9, "no series `max stress`"),
        (curve(&good.replace("\"stress\"", "\"f_t\"")), 9, "no series `f_t`"),
        (curve(&good.replace("to = 1", "to = 0")), 11, "a curve from 0 to 0 is not possible"),
        (curve(&good.replace("from = 0", "from = nan")), 11, "is not possible"),
        (curve(&good.replace("count = 5", "count = 1")), 12, "with 1 abscissas is not possible"),
        (curve(&good.replace("count = 5", "count = 10001")), 12, "with 10001 abscissas"),
        (curve(&format!("{good}name = \"a/b\"\n")), 13, "no name of a dataset"),
        (curve(&format!("{good}[[curve]]\n{good}")), 13, "two curves have the name `stress over strain`"),
        (
            curve(&format!("{}[[curve]]\nname = \"a\"\n{good}", good.replace("= 5", "= 9999"))),
            12,
            "have 10004 numbers per point",
        ),
        (curve(good).replace("study = \"run\"\n", ""), 6, "only the study \"run\" records curves"),
    ] {
        let ReadError::Scenario(error) = sweep(&text).unwrap_err() else { panic!("{text}: another error") };
        let message = error.to_string();
        assert!(message.contains(words), "{text}\n{message}");
        assert!(message.starts_with(&format!("sweep.toml:{line}:")), "{text}\n{message}");
        assert!(message.contains("help: "), "{message}");
    }
}

/// The fingerprint includes a file that only an axis names; the location of the folder does not matter.
#[test]
fn fingerprints_include_the_files_of_all_points() {
    let fingerprint = |second: &str| {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write("first.txt", "0 0 0 1e-3\n");
        write("second.txt", second);
        let file = "kind = \"file\"\npath = \"first.txt\"\ncell = [2e-3, 2e-3, 2e-3]\n";
        let lattice = "kind = \"lattice\"\nlattice = \"fcc\"\nradius = 1e-3\nrepeats = [2, 2, 2]\n";
        write("s.toml", &SCENARIO.replace(lattice, file));
        let axis = "[[axis]]\nkey = \"packing.path\"\nvalues = [\"first.txt\", \"second.txt\"]\n";
        write("sweep.toml", &format!("version = 1\nscenario = \"s.toml\"\n{axis}"));
        Sweep::read(&folder.path().join("sweep.toml")).unwrap().fingerprint().unwrap()
    };
    let spheres = "0 0 0 1e-3\n";
    assert_eq!(fingerprint(spheres), fingerprint(spheres));
    assert_ne!(fingerprint(spheres), fingerprint(&spheres.replace("0 0 0", "0 0 1e-4")));
}

/// Settings change the scenario of all points; a setting of a key that the sweep varies would have no effect.
#[test]
fn settings_change_the_scenario() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.toml"), SCENARIO).unwrap();
    let path = folder.path().join("sweep.toml");
    let axis = "[[axis]]\nkey = \"bonds.interaction_ratio\"\nvalues = [1.1, 1.5]\n";
    std::fs::write(&path, format!("version = 1\nscenario = \"s.toml\"\n{axis}")).unwrap();
    let read = |setting: &str| {
        Sweep::read_with(&path, &[Setting::parse("title=a").unwrap(), Setting::parse(setting).unwrap()])
    };
    let sweep = read("material[0].density=1000").unwrap();
    assert_eq!(sweep.scenario(1).unwrap().materials[0].density.si(), 1000.0);
    assert_ne!(sweep.fingerprint().unwrap(), Sweep::read(&path).unwrap().fingerprint().unwrap());
    let error = read("bonds.interaction_ratio=1.3").unwrap_err().to_string();
    assert!(error.contains("--set bonds.interaction_ratio=1.3: the sweep varies bonds.interaction_ratio"), "{error}");
    assert!(read("material[0].densty=1000").is_err());
}

#[test]
fn errors_give_position_problem_and_remedy() {
    for (axes, line, words) in [
        ("", 1, "the sweep has no axis"),
        ("[[axis]]\nvalues = [1]\n", 3, "either `key` or `keys`"),
        ("[[axis]]\nkey = \"bonds.interaction_ratio\"\n", 3, "one of `values`, `linear`, `logarithmic`"),
        ("[[axis]]\nkey = \"bond.interaction_ratio\"\nvalues = [1]\n", 4, "has no `bond`, needed for"),
        ("[[axis]]\nkey = \"bonds.interaction_ratio\"\nvalues = [1.1, -2]\n", 3, "interaction_ratio = -2"),
        ("[[axis]]\nkey = \"material[0].linear_bond.stiffness\"\nvalues = [1]\n", 3, "stiffness"),
        ("[[axis]]\nkey = \"packing.shape.kind\"\nvalues = [\"cube\"]\n", 3, "cube"),
        ("[[axis]]\nkeys = [\"a\", \"b\"]\nvalues = [[1]]\n", 5, "there are 2 keys, but a point has 1 values"),
        (
            "[[axis]]\nkey = \"bonds.interaction_ratio\"\nlogarithmic = { from = 0, to = 1, count = 3 }\n",
            5,
            "cannot be logarithmic",
        ),
        ("[[axis]]\nkey = \"bonds.interaction_ratio\"\nvalue = [1]\n", 5, "unknown field"),
    ] {
        let ReadError::Scenario(error) = sweep(axes).unwrap_err() else { panic!("{axes}: another error") };
        let text = error.to_string();
        assert!(text.contains(words), "{axes}\n{text}");
        assert!(text.starts_with(&format!("sweep.toml:{line}:")), "{axes}\n{text}");
        assert!(text.contains("help: "), "{text}");
    }
}
