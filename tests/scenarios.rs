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
