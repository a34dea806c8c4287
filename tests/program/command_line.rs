//! Help, schema, templates, checks of scenarios, and exit codes.

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem::scenario::TEMPLATES;
use concordem_tests::commands::{Given, concordem, text, write};
use tempfile::TempDir;

use crate::{PRISM, prism};

#[test]
fn the_help_lists_commands_examples_and_exit_codes() {
    let given = concordem(["--help"]);
    assert_eq!(given.code, exit::DONE);
    for word in [
        "init",
        "check",
        "run",
        "resume",
        "info",
        "measure",
        "events",
        "report",
        "pack",
        "schema",
        "Examples:",
        "Exit codes:",
        "130",
    ] {
        assert!(given.out.contains(word), "the help does not mention {word}:\n{}", given.out);
    }
    let listed = concordem(["init"]).out;
    assert!(TEMPLATES.iter().all(|template| listed.contains(template.name)), "{listed}");
}

#[test]
fn the_schema_is_json_with_descriptions() {
    let given = concordem(["schema"]);
    assert_eq!(given.code, exit::DONE);
    for word in ["\"$schema\"", "additionalProperties", "Normal modulus of a bond, Pa", "x-units"] {
        assert!(given.out.contains(word), "{word} is missing");
    }
}

#[test]
fn templates_are_valid_and_do_not_overwrite_existing_files() {
    let folder = TempDir::new().expect("a temporary folder");
    for template in TEMPLATES {
        let path = folder.path().join(template.name).with_extension("toml");
        let given = concordem(["init", "--template", template.name, text(folder.path())]);
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        assert_eq!(std::fs::read_to_string(&path).expect("the template"), template.text);
        let given = concordem(["check", "--no-build", text(&path)]);
        assert_eq!(given.code, exit::DONE, "{}", given.err);
    }
    let path = write(folder.path(), "mine.toml", "precious");
    let given = concordem(["init", "--template", "cpm-small", text(&path)]);
    assert_eq!(given.code, exit::FILE);
    assert!(given.err.contains("--force"), "{}", given.err);
    assert_eq!(std::fs::read_to_string(&path).expect("the file"), "precious");
    assert_eq!(concordem(["init", "--template", "cpm-small", "--force", text(&path)]).code, exit::DONE);
}

#[test]
fn wrong_arguments_and_bad_files_give_the_documented_exit_codes() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 10);
    assert_eq!(concordem(["walk"]).code, exit::USAGE);
    assert_eq!(concordem(["init", "--template", "no-such"]).code, exit::USAGE);
    let missing = folder.path().join("missing");
    for command in ["check", "run", "info", "report", "resume"] {
        let given = concordem([command, text(&missing)]);
        assert_eq!(given.code, exit::FILE, "{command}: {}", given.err);
        assert!(given.err.contains("missing"), "{command} does not name the file: {}", given.err);
    }
    let binary = folder.path().join("binary.toml");
    std::fs::write(&binary, [b'a', b'\n', 0xff, 0xfe]).expect("a file");
    let given = concordem(["check", text(&binary)]);
    assert_eq!(given.code, exit::FILE);
    assert!(given.err.contains("binary.toml:2:"), "{}", given.err);
    // A file of another program, and a path that cannot be written to, because its parent is a file.
    let given = concordem(["info", text(&scenario)]);
    assert_eq!(given.code, exit::FILE, "{}", given.err);
    let given = concordem(["run", text(&scenario), "-o", text(&scenario.join("result.h5"))]);
    assert_eq!(given.code, exit::FILE, "{}", given.err);
    // An existing result is kept.
    let result = folder.path().join("prism.h5");
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    let given = concordem(["run", text(&scenario)]);
    assert_eq!(given.code, exit::FILE);
    assert!(given.err.contains("--force"), "{}", given.err);
    assert_eq!(concordem(["run", "-q", "--force", text(&scenario)]).code, exit::DONE);
    // A result that is cut off is refused.
    let bytes = std::fs::read(&result).expect("the result");
    for part in [1, 2, 3] {
        std::fs::write(&result, &bytes[..bytes.len() * part / 4]).expect("a file");
        for command in ["info", "report"] {
            let given = concordem([command, text(&result)]);
            assert_eq!(given.code, exit::FILE, "{}", given.err);
        }
    }
}

#[test]
fn bad_scenarios_are_shown_with_their_text() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = write(
        folder.path(),
        "prism.toml",
        &PRISM.replace("STEPS", "10").replace("radius = \"1 mm\"", "radius = \"1 GPa\"").replace("bonds", "bond"),
    );
    for command in ["check", "run", "pack"] {
        let given = concordem([command, text(&scenario)]);
        assert_eq!(given.code, exit::USAGE);
        let shown = given.err.replace(text(folder.path()), "FOLDER");
        insta::assert_snapshot!("two_problems", shown);
    }
}

#[test]
fn unstable_steps_are_refused_with_both_numbers_unless_allowed() {
    let folder = TempDir::new().expect("a temporary folder");
    let unstable = PRISM.replace("STEPS", "5").replace("[integration]", "[integration]\ntime_step = \"1 ms\"");
    let scenario = write(folder.path(), "unstable.toml", &unstable);
    let given = concordem(["run", text(&scenario)]);
    assert_eq!(given.code, exit::PHYSICS);
    for word in ["1.00000e-3 s", "stability bound of", "allow_unstable", "time_step = \"1 ms\""] {
        assert!(given.err.contains(word), "{word} is missing: {}", given.err);
    }
    assert!(!folder.path().join("unstable.h5.parts").exists(), "a refused run leaves no files");
    let allowed = unstable.replace("[integration]", "[integration]\nallow_unstable = true");
    // Unbreakable bonds, so that the energy grows without limit.
    let allowed =
        allowed.replace("omega_threshold = 0.9", "never_damage = true").replace("steps = 5", "steps = 100000");
    let scenario = write(folder.path(), "allowed.toml", &allowed);
    let given = concordem(["run", text(&scenario)]);
    assert_eq!(given.code, exit::PHYSICS, "an unstable run ends with this exit code: {}", given.err);
    assert!(given.err.contains("no longer finite"), "{}", given.err);
    assert!(!folder.path().join("allowed.h5").exists(), "a failed run leaves no complete result");
}

/// A quantity or a number may begin with a minus: what reads it says what is wrong.
#[test]
fn negative_quantities_reach_their_check() {
    for (arguments, told) in [
        (&["calibrate", "elastic", "--law", "cpm", "--young", "-75 GPa", "--poisson", "0.2"][..], "must be positive"),
        (
            &["calibrate", "cohesive_beam", "--young", "-75 GPa", "--poisson", "0.2", "--density", "2200"],
            "must be positive",
        ),
        (&["calibrate", "concrete", "x.toml", "--tensile-strength", "-3 MPa"], "must be positive"),
        (&["events", "x.h5", "--distance", "-2 mm"], "must be positive"),
        (&["run", "x.toml", "-j", "-3"], "is not in 1..=1024"),
        (&["calibrate", "cohesive_beam", "--count", "-5"], "invalid value '-5'"),
    ] {
        let given = concordem(arguments.iter().copied());
        assert_eq!(given.code, exit::USAGE, "{arguments:?}");
        assert!(given.err.contains(told) && !given.err.contains("unexpected argument"), "{arguments:?}: {}", given.err);
    }
}

/// The default step is 0.8 of the bound without damping, and of the bound with local damping 0.3 that times √1.3.
#[test]
fn the_check_tells_the_bounds_that_it_means() {
    let folder = TempDir::new().expect("a temporary folder");
    let shown = concordem(["check", "-q", text(&prism(folder.path(), 300))]).out;
    let line = shown.lines().find(|line| line.trim_start().starts_with("time step ")).expect("the step");
    let part = format!("{:.3} of the stability bound with damping", 0.8 * 1.3_f64.sqrt());
    assert!(line.contains(&part) && line.contains("(0.800 of that without damping"), "{line}");
    let undamped =
        PRISM.replace("STEPS", "300").replace("{ kind = \"local\", coefficient = 0.3 }", "{ kind = \"none\" }");
    let shown = concordem(["check", "-q", text(&write(folder.path(), "undamped.toml", &undamped))]).out;
    let line = shown.lines().find(|line| line.trim_start().starts_with("time step ")).expect("the step");
    assert!(line.contains("0.800 of the stability bound, ") && !line.contains("damping"), "{line}");
}

#[test]
fn check_pack_run_info_and_report_work_together() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 300);
    let given = concordem(["check", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    for word in ["particles", "bonds", "memory", "time step", "estimated time"] {
        assert!(given.out.contains(word), "{word} is missing: {}", given.out);
    }
    let given = concordem(["pack", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let packed = std::fs::read_to_string(folder.path().join("prism.spheres.txt")).expect("the packing");
    let spheres = packed.lines().filter(|line| !line.starts_with('#')).count();
    assert!(spheres > 100, "{spheres} spheres");
    let result = folder.path().join("prism.h5");
    let given = concordem(["run", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(given.err.contains("the given number of steps was reached"), "{}", given.err);
    let file = ResultFile::open(&result).expect("the result");
    assert_eq!(file.table("particles").expect("particles")[0].1.borrow().len() % spheres, 0);
    // One record every 7 steps, and one for the final state.
    assert_eq!(file.samples("step").expect("steps").len(), 300_usize.div_ceil(7) + 1);
    assert_eq!(file.snapshot_times().expect("snapshots").len(), 4);
    let given = concordem(["info", text(&result)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let hash = concordem(["info", "--hash", text(&result)]).out;
    assert!(hash.len() == 65 && given.out.contains(hash.trim()), "{hash}");
    assert_eq!(concordem(["info", "--scenario", text(&result)]).out, std::fs::read_to_string(&scenario).expect("it"));
    let given = concordem(["report", text(&result)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let page = std::fs::read_to_string(folder.path().join("prism.html")).expect("the page");
    assert!(page.contains("Prism") && page.contains("</html>"));
    assert_eq!(concordem(["report", text(&result)]).code, exit::FILE, "the page already exists");
    assert_eq!(concordem(["report", "--force", text(&result)]).code, exit::DONE);
    let given = concordem(["resume", text(&result)]);
    assert_eq!(given.code, exit::DONE);
    assert!(given.err.contains("is finished"), "{}", given.err);
}

/// For discs in a plane cell, `pack` and `check` report the solid fraction of the scenario.
#[test]
fn pack_and_check_agree_on_discs() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scenario = write(
        folder.path(),
        "discs.toml",
        "version = 1\ndimension = 2\n[packing]\nkind = \"random-discs\"\ncount = 40\n\
         radii = { kind = \"uniform\", minimum = \"0.8 mm\", maximum = \"1.2 mm\" }\nsolid_fraction = 0.9\nseed = 1\n\
         shape = { kind = \"periodic\" }\n[[material]]\nname = \"disc\"\ndensity = 2000\n\
         linear_bond = { normal_stiffness = 7e10, shear_stiffness = 0 }\n[bonds]\nlaw = \"linear_bond\"\n\
         coordination = 5\n[contacts]\nlaw = \"none\"\n[stop]\nsteps = 1\n",
    );
    let fraction = |given: &Given| {
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        let line = given.out.lines().find(|line| line.contains("solid fraction")).expect("a solid fraction");
        line.split_whitespace().last().expect("a number").to_owned()
    };
    assert_eq!(fraction(&concordem(["check", text(&scenario)])), "0.9000");
    let packed = concordem(["pack", text(&scenario)]);
    assert_eq!(fraction(&packed), "0.9000");
    // Bonds at the interaction ratio that gives the target coordination number.
    assert!(
        packed.out.lines().any(|line| line.contains("bonds per sphere") && line.ends_with("5.000")),
        "{}",
        packed.out
    );
}
