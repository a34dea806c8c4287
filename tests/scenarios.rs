//! Good scenarios are accepted, and bad ones refused with a message that gives position, key, value, and remedy.
//!
//! The messages are stored beside the scenarios; `INSTA_UPDATE=always cargo test -p concordem-tests` updates them.

use std::path::{Path, PathBuf};

use concordem::scenario::{ProblemKind, ReadError, Scenario, TEMPLATES};
use rstest::rstest;

/// Path relative to this folder, in which the tests run, so that messages do not depend on its location.
fn relative(path: &Path) -> &Path {
    path.strip_prefix(env!("CARGO_MANIFEST_DIR")).expect("a file of this folder")
}

fn stem(path: &Path) -> &str {
    path.file_stem().and_then(|stem| stem.to_str()).expect("a file name")
}

#[rstest]
fn bad(#[files("scenarios/bad/*.toml")] path: PathBuf) {
    let error = match Scenario::read(relative(&path)) {
        Err(ReadError::Scenario(error)) => error,
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("{} is accepted", path.display()),
    };
    for problem in &error.problems {
        assert!(problem.span.end <= error.source_text.text.len(), "the position of `{problem}` is outside the text");
        assert!(!problem.help.is_empty(), "`{problem}` has no remedy");
    }
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path("scenarios/bad");
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.set_input_file(relative(&path));
    settings.bind(|| insta::assert_snapshot!(stem(&path), error));
}

#[rstest]
fn good(#[files("scenarios/good/*.toml")] path: PathBuf) {
    if let Err(error) = Scenario::read(relative(&path)) {
        panic!("{error}");
    }
}

/// A damaged text is accepted, or refused with positions inside the text; the reader never fails otherwise.
#[test]
fn damaged_texts_are_accepted_or_refused_with_valid_positions() {
    let look = |text: &str| {
        if let Err(error) = Scenario::parse("damaged.toml", text) {
            assert!(!error.problems.is_empty());
            for problem in &error.problems {
                let (start, end) = (problem.span.start, problem.span.end);
                let length = error.source_text.text.len();
                // A text that passes the schema must not fail in the reader, which cannot name the key.
                assert!(problem.kind == ProblemKind::Syntax || !problem.key.is_empty(), "`{problem}` names no key");
                assert!(start <= end && end <= length, "`{problem}` is at {start}..{end} of {length} bytes");
            }
            assert!(error.to_string().contains("damaged.toml:"));
        }
    };
    let words = ["nan", "-1", "1e999", "\"\"", "[]", "{}", "[[[]]]", "true", "\"30 mm\"", "1979-05-27", "[{}]", "0"];
    for template in TEMPLATES {
        let text = template.text;
        // Cut off anywhere.
        for end in (0..text.len()).step_by(7).filter(|&end| text.is_char_boundary(end)) {
            look(&text[..end]);
        }
        let lines: Vec<&str> = text.lines().collect();
        for at in 0..lines.len() {
            let without: Vec<&str> =
                lines.iter().enumerate().filter(|(k, _)| *k != at).map(|(_, line)| *line).collect();
            look(&without.join("\n"));
            // A repeated line, and a value of another type.
            let mut twice = lines.clone();
            twice.insert(at, lines[at]);
            look(&twice.join("\n"));
            if let Some((key, _)) = lines[at].split_once('=') {
                for word in words {
                    let line = format!("{key} = {word}");
                    let mut changed = lines.clone();
                    changed[at] = &line;
                    look(&changed.join("\n"));
                }
            }
        }
    }
}

/// Tables and keys without effect are accepted with a warning.
#[test]
fn unused_tables_and_keys_are_reported() {
    let text = "
        version = 1
        kinematics = \"yade\"
        [packing]
        kind = \"spheres\"
        spheres = [[0, 0, 0, 1], [2, 0, 0, 1]]
        [[material]]
        name = \"glass\"
        density = 2500
        cohesive_beam = { young = 1e9, radius_ratio = 0.5 }
        hertz_mindlin = { young = 1e9, poisson = 0.2 }
        [[material]]
        name = \"spare\"
        density = 2500
        cohesive_beam = { young = 1e9, radius_ratio = 0.5 }
        [[interface]]
        between = [\"glass\", \"spare\"]
        linear_bond = { normal_stiffness = 1, shear_stiffness = 1 }
        [bonds]
        law = \"cohesive_beam\"
        [contacts]
        law = \"none\"
        [[set]]
        name = \"right\"
        selection = { kind = \"ids\", ids = [1] }
        [[force]]
        set = \"right\"
        force = [1, 0, 0]
        acts = \"pull\"
        [integration]
        time_step = 1e-6
        safety = 0.5
        [stop]
        steps = 2";
    let scenario = Scenario::parse("unused.toml", text).unwrap_or_else(|error| panic!("{error}"));
    let keys: Vec<String> = scenario.warnings().into_iter().map(|warning| warning.key).collect();
    let expected = [
        "kinematics",
        "material[0].hertz_mindlin",
        "material[1].name",
        "interface[0].linear_bond",
        "force[0].acts",
        "integration.safety",
    ];
    assert_eq!(keys, expected);
    // Keys of bonds in the table of a law that only contacts use.
    let contacts = text
        .replace(
            "cohesive_beam = { young = 1e9, radius_ratio = 0.5 }",
            "linear_bond = { normal_stiffness = 1, shear_stiffness = 1, normal_strength = 1 }",
        )
        .replace(
            "[bonds]\n        law = \"cohesive_beam\"\n        [contacts]\n        law = \"none\"",
            "[contacts]\n        law = \"linear_bond\"",
        );
    let scenario = Scenario::parse("unused.toml", &contacts).unwrap_or_else(|error| panic!("{error}"));
    let warnings = scenario.warnings();
    assert!(warnings.iter().any(|w| w.key == "material[0].linear_bond.normal_strength"), "{warnings:?}");
}

/// A stage that ends by its strain alone, and strains away from it, is named for every loading that makes a strain of its own.
#[test]
fn stages_that_go_away_from_their_strain_are_named() {
    let bar = "shape = { kind = \"box\", size = [\"10 mm\", \"10 mm\", \"40 mm\"] }";
    let loadings = [
        (bar, "kind = \"uniaxial\"\nstrain_rate = 1", 1.0),
        (bar, "kind = \"uniaxial\"\nstrain_rate = -1", -1.0),
        (bar, "kind = \"platens\"\nclosing_velocity = 1\nmaterial = \"m\"", -1.0),
        (bar, "kind = \"bending\"\nabout = \"y\"\nrate = -1", -1.0),
        ("shape = { kind = \"cylinder\", radius = \"5 mm\", height = \"40 mm\" }", "kind = \"torsion\"\nrate = 2", 1.0),
        (bar, "kind = \"flexure\"\naxis = \"z\"\nspan = 0.03\nstrip_width = 3e-3\nclosing_velocity = 1", 1.0),
        (
            "repeats = [3, 3, 3]\nshape = { kind = \"periodic\" }",
            "kind = \"cell-strain\"\nvelocity_gradient = [[0.1, 0, 0], [0, 0, -2], [0, 0, 1]]",
            -1.0,
        ),
        (
            "repeats = [3, 3, 3]\nshape = { kind = \"periodic\" }",
            "kind = \"cell-stress\"\nstress = [[0, 0, 0], [0, 0, 0], [0, 0, 0]]\nmaximum_strain_rate = 9\nstrain_rate = [\"free\", \"free\", -1]",
            -1.0,
        ),
    ];
    for (shape, loading, direction) in loadings {
        let warned = |strain: f64, rate: f64| {
            let text = format!(
                "version = 1\n[packing]\nkind = \"lattice\"\nlattice = \"fcc\"\nradius = \"1 mm\"\n{shape}\n[[material]]\nname = \"m\"\n\
                 density = 2500\nlinear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 1e5 }}\nfrictional = {{ normal_stiffness = 1e6, \
                 shear_stiffness = 1e5, friction_coefficient = 0.5 }}\n[bonds]\nlaw = \"linear_bond\"\n[contacts]\nlaw = \"frictional\"\n\
                 [loading]\n{loading}\n[[stage]]\nname = \"a\"\nstop = {{ strain = {} }}\n[[stage]]\nname = \"b\"\nrate = {rate}\n\
                 stop = {{ strain = {strain} }}\n",
                1e-3 * direction
            );
            let scenario = Scenario::parse("stages.toml", &text).unwrap_or_else(|error| panic!("{loading}\n{error}"));
            scenario.warnings().into_iter().find(|warning| warning.key == "stage[1].stop.strain").map(|w| w.message)
        };
        for (strain, rate) in [(2e-3, 1.0), (0.5e-3, -1.0), (-1e-3, -2.0)] {
            assert_eq!(warned(strain * direction, rate), None, "{loading}: {strain} {rate}");
        }
        for (strain, rate) in [(0.5e-3, 1.0), (2e-3, -1.0), (2e-3, 0.0)] {
            let message =
                warned(strain * direction, rate).unwrap_or_else(|| panic!("{loading}: {strain} {rate}: no word"));
            let what = match rate * direction {
                rate if rate > 0.0 => "raises",
                rate if rate < 0.0 => "lowers",
                _ => "holds",
            };
            assert!(message.contains(&format!("the stage {what} the strain from")), "{message}");
        }
    }
}
