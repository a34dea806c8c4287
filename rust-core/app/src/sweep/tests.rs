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
