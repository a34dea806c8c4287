//! Keys from the command line, stored packings, explanations of keys, completions, and what a run says.

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem::scenario::Scenario;
use concordem_tests::commands::{concordem, concordem_storing, text, write};
use tempfile::TempDir;

use crate::prism;

fn scenario_of(result: &std::path::Path) -> Scenario {
    let text = ResultFile::open(result).and_then(|file| file.scenario()).expect("a result with its scenario");
    Scenario::parse("result", &text).expect("a valid scenario")
}

/// A run with `--set` equals the run of the edited file, and the result has the changed scenario and the settings.
#[test]
fn settings_replace_keys_and_are_recorded() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 20);
    let set = folder.path().join("set.h5");
    let given = concordem(["run", text(&scenario), "-q", "-o", text(&set), "--set", "material[0].cpm.young=30 GPa"]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let edited = std::fs::read_to_string(&scenario).expect("it").replace("young = \"25 GPa\"", "young = \"30 GPa\"");
    let edited = write(folder.path(), "edited.toml", &edited);
    assert_eq!(concordem(["run", "-q", text(&edited)]).code, exit::DONE);
    let hash = |path: &std::path::Path| concordem(["info", "--hash", text(path)]).out;
    assert_eq!(hash(&set), hash(&folder.path().join("edited.h5")));
    assert_eq!(scenario_of(&set).materials[0].cpm.as_ref().expect("a table").young.si(), 30e9);
    let info = concordem(["info", text(&set)]).out;
    assert!(info.contains("set 1") && info.contains("material[0].cpm.young=30 GPa"), "{info}");
}

/// `resume` of the scenario file knows the settings of the run; other changes are refused or taken as before.
#[test]
fn settings_survive_an_interruption() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 20);
    let run = ["run", text(&scenario), "-q", "--set", "material[0].cpm.young=30 GPa", "--set", "stop.steps=30"];
    assert_eq!(concordem(run).code, exit::DONE);
    let given = concordem(["resume", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(given.err.contains("is finished; there is nothing to resume"), "{}", given.err);
    // Another value is a change of a finished run.
    let given = concordem(["resume", text(&scenario), "--set", "stop.steps=40"]);
    assert_eq!(given.code, exit::USAGE, "{}", given.err);
    assert!(given.err.contains("stop.steps"), "{}", given.err);
}

/// Wrong settings are reported at the command line, wrong keys of the file at their line, which the settings do not move.
#[test]
fn problems_are_reported_where_they_were_written() {
    let folder = TempDir::new().expect("a temporary folder");
    let path = write(
        folder.path(),
        "wrong.toml",
        &crate::PRISM.replace("STEPS", "5").replace("law = \"cpm\"\n[integration]", "law = \"cmp\"\n[integration]"),
    );
    let line =
        std::fs::read_to_string(&path).expect("it").lines().position(|line| line == "law = \"cmp\"").expect("a line");
    let given = concordem(["check", text(&path), "--set", "packing.radius=1 GPa", "--set", "integration.safety=0.5"]);
    assert_eq!(given.code, exit::USAGE);
    assert!(
        given.err.contains("[command line:1:") && given.err.contains("--set packing.radius=1 GPa"),
        "{}",
        given.err
    );
    assert!(given.err.contains(&format!("wrong.toml:{}:", line + 1)), "{}", given.err);
    for (setting, message) in [("stop", "KEY=VALUE"), ("material[7].density=1", "there is no item `7`")] {
        let given = concordem(["check", text(&path), "--set", setting]);
        assert_eq!(given.code, exit::USAGE);
        assert!(given.err.contains(message), "{}", given.err);
    }
}

/// A packing is made once; the next command reads it, and gives the same bits. A damaged file is made again.
#[test]
fn packings_are_stored() {
    let folder = TempDir::new().expect("a temporary folder");
    let store = folder.path().join("store");
    let scenario = |name: &str, packing: &str| {
        let text = crate::CELL.replace(
            "kind = \"random-dense\"\ncount = 60\nradius = \"1 mm\"\nseed = 1\n[packing.shape]\nkind = \"periodic\"\n",
            packing,
        );
        write(folder.path(), name, &text)
    };
    let random = crate::CELL.to_owned();
    let random = write(folder.path(), "random.toml", &random);
    let cooker = scenario(
        "cooker.toml",
        "kind = \"cooker\"\nradius = \"1 mm\"\ncoordination = 4.5\ncorrection = \"frozen-links\"\n\
         shape = { kind = \"box\", size = [\"12 mm\", \"12 mm\", \"12 mm\"] }\n",
    );
    let cooker = {
        let text = std::fs::read_to_string(&cooker).expect("it").replace("coordination = 8\n", "");
        write(folder.path(), "cooker.toml", &text)
    };
    for (count, scenario) in [random, cooker].iter().enumerate() {
        let result = scenario.with_extension("h5");
        let run = |store: Option<&std::path::Path>| {
            let given = concordem_storing(store.map(Into::into), ["run", "-q", "--force", text(scenario)]);
            assert_eq!(given.code, exit::DONE, "{}", given.err);
            concordem(["info", "--hash", text(&result)]).out
        };
        let alone = run(None);
        assert_eq!(run(Some(&store)), alone);
        let files = || std::fs::read_dir(&store).expect("a folder").map(|entry| entry.expect("a file").path());
        assert_eq!(files().count(), count + 1);
        assert_eq!(run(Some(&store)), alone, "read from the store");
        let newest = files().max_by_key(|path| path.metadata().and_then(|data| data.modified()).expect("a time"));
        let newest = newest.expect("a file");
        let mut bytes = std::fs::read(&newest).expect("bytes");
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        std::fs::write(&newest, &bytes).expect("written");
        assert_eq!(run(Some(&store)), alone, "made again");
    }
}

#[test]
fn keys_are_explained() {
    let given = concordem(["explain", "material.cpm.young"]);
    assert_eq!(given.code, exit::DONE);
    for part in ["material.cpm.young: stress (Pa", "required", "Normal modulus of a bond"] {
        assert!(given.out.contains(part), "{part} is missing: {}", given.out);
    }
    // A name, a table with its keys, words with their meaning, all tables.
    assert!(concordem(["explain", "young"]).out.contains("material.cohesive_beam.young"));
    assert!(concordem(["explain", "stop"]).out.contains("drop_to"));
    assert!(concordem(["explain", "packing.kind"]).out.contains("\"cooker\": Dense packing between walls"));
    assert!(concordem(["explain"]).out.contains("loading"));
    let wrong = concordem(["explain", "strain_rte"]);
    assert_eq!(wrong.code, exit::USAGE);
    assert!(wrong.err.contains("`loading.strain_rate`"), "{}", wrong.err);
}

#[test]
fn shells_get_completions() {
    for shell in ["bash", "zsh", "fish"] {
        let given = concordem(["completions", shell]);
        assert_eq!(given.code, exit::DONE);
        assert!(given.out.contains("resume") && given.out.contains("explain"), "{shell}");
    }
}

/// With `--schema` the template names the schema beside it, and so do later ones in the same folder.
#[test]
fn templates_name_the_schema_beside_them() {
    let folder = TempDir::new().expect("a temporary folder");
    let given = concordem(["init", "--template", "cpm-small", "--schema", text(folder.path())]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let schema = std::fs::read_to_string(folder.path().join("concordem.schema.json")).expect("a schema");
    assert_eq!(schema, concordem(["schema"]).out);
    assert_eq!(concordem(["init", "--template", "hertz-impact", text(folder.path())]).code, exit::DONE);
    for name in ["cpm-small.toml", "hertz-impact.toml"] {
        let path = folder.path().join(name);
        let head = std::fs::read_to_string(&path).expect("a template");
        assert!(head.starts_with("#:schema ./concordem.schema.json\n"), "{head}");
        assert_eq!(concordem(["check", "--no-build", text(&path)]).code, exit::DONE);
    }
}

/// A specimen that breaks in tension has E, f_t, and G_F, at the end of the run and in `info`; G_F is the work at the ends over the
/// cross-section.
#[test]
fn a_run_ends_with_the_properties_of_the_specimen() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = write(
        folder.path(),
        "prism.toml",
        &crate::PRISM
            .replace("steps = STEPS", "strain = 5e-3\ndrop_to = 0.1")
            .replace("sample_interval = 7", "sample_interval = 2")
            .replace("20 1/s", "4 1/s"),
    );
    let given = concordem(["run", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let value = |shown: &str, symbol: &str| -> f64 {
        let line = shown
            .lines()
            .find(|line| line.trim_start().starts_with(symbol))
            .unwrap_or_else(|| panic!("no {symbol}: {shown}"));
        line.split_whitespace().nth(1).expect("a value").parse().expect("a number")
    };
    let result = ResultFile::open(&folder.path().join("prism.h5")).expect("a result");
    let stress = result.samples("stress").expect("stresses");
    let peak = stress.iter().copied().fold(0.0, f64::max);
    // Four digits are printed.
    assert!((value(&given.err, "f_t") - peak * 1e-6).abs() < 1e-3 * peak * 1e-6, "{}", given.err);
    assert!(value(&given.err, "E ") > 1.0);
    // The work at the ends over the area of 81 mm², without the kinetic energy that the ends have from the start: a percent, because
    // stress is the mean of both ends, whose forces differ while waves run.
    let work = result.samples("boundary_work").expect("work");
    let expected = work.last().expect("work") / 81e-6;
    let found = value(&given.err, "G_F");
    assert!((found / expected - 1.0).abs() < 0.05, "{found} {expected}");
    let info = concordem(["info", text(&folder.path().join("prism.h5"))]).out;
    assert!((value(&info, "G_F") - found).abs() < 1e-9, "{info}");
}
