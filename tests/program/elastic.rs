//! `elastic` computes elastic constants, `calibrate elastic` finds the parameters that give them.

use std::fmt::Write as _;
use std::path::Path;

use concordem::program::exit;
use concordem::scenario::TEMPLATES;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

use crate::CELL;

/// `calibrate elastic` inverts `elastic`: from the constants of a cell with Ē = 25 GPa, Ḡ/Ē = 0.2 it recovers these
/// parameters. Poisson's ratio is found to 1e-9 and its slope over the stiffness ratio is 0.3, so the ratio is found to
/// 1e-8.
#[test]
fn calibrate_elastic_recovers_the_parameters_of_elastic_constants() {
    let folder = TempDir::new().expect("a temporary folder");
    let template = TEMPLATES.iter().find(|t| t.name == "cpm-periodic").expect("the template");
    let scenario = write(folder.path(), "cell.toml", &template.text.replace("count = 1000", "count = 120"));
    let shown = concordem(["elastic", text(&scenario)]);
    assert_eq!(shown.code, exit::DONE, "{}", shown.err);
    for row in ["closed form", "affine sum", "static network", "relaxed dynamics", "Sensitivities"] {
        assert!(shown.out.contains(row), "{row}:\n{}", shown.out);
    }
    let given = concordem(["elastic", "--json", text(&scenario)]);
    let found: serde_json::Value = serde_json::from_str(&given.out).expect("JSON");
    let (young, poisson) = (&found["static"]["young_pa"], &found["static"]["poisson"]);
    let gap = found["relaxed_dynamics"]["young_pa"].as_f64().expect("E") / young.as_f64().expect("E") - 1.0;
    assert!(gap.abs() < 2e-6, "statics and dynamics differ by {gap:e}");
    // Start from other stiffnesses, and recover the first ones.
    let other = template.text.replace("count = 1000", "count = 120").replace("\"25 GPa\"", "\"7 GPa\"");
    let other = write(folder.path(), "other.toml", &other.replace("shear_ratio = 0.2", "shear_ratio = 0.9"));
    let wanted = folder.path().join("wanted.toml");
    let (young, poisson) = (young.to_string(), poisson.to_string());
    let arguments =
        ["calibrate", "elastic", text(&other), "--young", &young, "--poisson", &poisson, "-o", text(&wanted)];
    let calibrated = concordem(arguments);
    assert_eq!(calibrated.code, exit::DONE, "{}", calibrated.err);
    let written = std::fs::read_to_string(&wanted).expect("the scenario");
    let value = |key: &str| -> f64 {
        let line = written.lines().find(|line| line.starts_with(key)).expect("the key");
        line.split('=').nth(1).and_then(|value| value.trim().parse().ok()).expect("a number")
    };
    assert!((value("young") / 25e9 - 1.0).abs() < 1e-7 && (value("shear_ratio") / 0.2 - 1.0).abs() < 1e-7, "{written}");
    assert_eq!(concordem(arguments).code, exit::FILE, "it does not overwrite");
    let far = concordem(["calibrate", "elastic", text(&other), "--young", "30 GPa", "--poisson", "0.45"]);
    assert!(far.code == exit::PHYSICS && far.err.contains("out of reach"), "{}", far.err);
}

/// Strengths are measured at one onset strain and scaled, so what does not scale is refused. The slope of a logarithmic yield surface is no
/// friction, so 20 is not taken for degrees there.
#[test]
fn calibrate_concrete_refuses_what_does_not_scale() {
    let folder = TempDir::new().expect("a temporary folder");
    let template = TEMPLATES.iter().find(|t| t.name == "cpm-small").expect("the template");
    let targets = ["--young", "30 GPa", "--poisson", "0.2", "--tensile-strength", "3 MPa", "--compressive-strength"];
    for line in [
        "isotropic_prestress = \"-1 MPa\"",
        "damage_time = \"1 ms\"\ndamage_rate_exponent = 1",
        "plasticity_time = \"1 ms\"\nplasticity_rate_exponent = 1",
    ] {
        let given = template.text.replace("friction_coefficient", &format!("{line}\nfriction_coefficient"));
        let path = write(folder.path(), "given.toml", &given);
        let refused = concordem(["calibrate", "concrete", text(&path)].into_iter().chain(targets).chain(["30 MPa"]));
        let key = format!("material[0].cpm.{}", line.split(' ').next().expect("a key"));
        assert_eq!(refused.code, exit::USAGE, "{}", refused.err);
        assert!(refused.err.contains(&key) && refused.err.contains("give it again afterwards"), "{}", refused.err);
    }
    let rough = template.text.replace("friction_coefficient = 0.8", "friction_coefficient = 20");
    let surface = "yield_surface = \"logarithmic-linear\"\nyield_log_speed = 0.02\nfriction_coefficient";
    let smooth = rough.replace("friction_coefficient", surface);
    // A second material with a linear surface is warned about, although the surfaces of both have no mean.
    let table = &rough[rough.find("[[material]]").expect("the table")..rough.find("[bonds]").expect("the end")];
    let both = smooth.replace("[bonds]", &format!("{}[bonds]", table.replace("\"concrete\"", "\"other\"")));
    for (given, place, code) in [
        (rough.clone(), Some("material[0].cpm.friction_coefficient"), exit::DONE),
        (smooth, None, exit::DONE),
        (both, Some("material[1].cpm.friction_coefficient"), exit::USAGE),
    ] {
        let checked = concordem(["check", text(&write(folder.path(), "rough.toml", &given))]);
        assert_eq!(checked.code, code, "{}", checked.err);
        let warnings: Vec<&str> = checked.err.lines().filter(|line| line.contains("no solid is so rough")).collect();
        assert_eq!(warnings.len(), usize::from(place.is_some()), "{}", checked.err);
        assert!(place.is_none_or(|place| warnings[0].contains(place)), "{}", checked.err);
    }
}

/// For each law and deformable particles: the constants E and ν of planted parameters are given as targets with the scenario
/// of another law, on the same bonds, and the calibration recovers the parameters. Poisson's ratio is found to 1e-9 and its
/// slope over the stiffnesses is at least 0.1; the tolerance is 1e-6 (required: 1e-3). The written scenario has the target
/// constants.
#[test]
fn parameters_of_each_law_are_found_from_a_scenario_of_another() {
    let folder = TempDir::new().expect("a temporary folder");
    let plain = write(folder.path(), "plain.toml", CELL);
    let of = |law: &str, table: &str| {
        let text = CELL.replace("linear_bond = { normal_stiffness = 1e7, shear_stiffness = 2e6 }", table);
        text.replace("law = \"linear_bond\"", &format!("law = \"{law}\""))
    };
    let constants = |path: &Path| -> [f64; 2] {
        let given = concordem(["elastic", "--json", "--no-dynamics", text(path)]);
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        let found: serde_json::Value = serde_json::from_str(&given.out).expect("JSON");
        ["young_pa", "poisson"].map(|key| found["static"][key].as_f64().expect("a number"))
    };
    let cpm = "cpm = { young = 20e9, shear_ratio = 0.3, crack_onset_strain = 1e-4, relative_ductility = 30, cohesion = 3e6, \
               friction_coefficient = 0.8 }";
    let beam = "cohesive_beam = { young = 300e9, poisson = 0.3, radius_ratio = 0.6 }";
    let joint = "jointed = { young = 40e9, stiffness_ratio = 0.25, tensile_strength = 1e7, cohesion = 5e7, friction_coefficient = 0.5 }";
    let bond = "linear_bond = { normal_stiffness = 3e7, shear_stiffness = 9e6 }";
    // k_n/(R E_p) = 3e7/(1e-3·1.2e11) = 0.25.
    let deformable = "linear_bond = { normal_stiffness = 3e7, shear_stiffness = 9e6 }\ndeformable = { young = 1.2e11, poisson = 0.4 }";
    let other = write(folder.path(), "other.toml", &of("cpm", cpm));
    let cases = [
        ("cpm", cpm, &plain, &[][..], &["young", "shear_ratio"][..]),
        ("cohesive_beam", beam, &plain, &[], &["young", "radius_ratio"]),
        ("jointed", joint, &plain, &[], &["young", "stiffness_ratio"]),
        ("linear_bond", bond, &other, &[], &["normal_stiffness", "shear_stiffness"]),
        (
            "linear_bond",
            deformable,
            &other,
            &["--deformable", "--particle-poisson", "0.4", "--particle-softness", "0.25"],
            &["normal_stiffness", "shear_stiffness", "young"],
        ),
    ];
    for (number, (law, table, start, options, keys)) in cases.into_iter().enumerate() {
        let planted = of(law, table);
        let wanted = constants(&write(folder.path(), "planted.toml", &planted));
        let output = folder.path().join(format!("found-{number}.toml"));
        let [young, poisson] = wanted.map(|value| value.to_string());
        let arguments = ["calibrate", "elastic", text(start), "--law", law, "--young", &young, "--poisson", &poisson];
        let given = concordem(arguments.iter().chain(options).chain(&["-o", text(&output)]));
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        let written = std::fs::read_to_string(&output).expect("the scenario");
        for key in keys {
            let after = |text: &str| -> f64 {
                let mut places =
                    text.split(|c: char| c.is_whitespace() || "{},".contains(c)).filter(|word| !word.is_empty());
                places.find(|word| word == key).expect("the key");
                places.nth(1).and_then(|word| word.parse().ok()).expect("a number")
            };
            // The first key of this name is the right one in both texts, for beams and for deformable particles.
            let error = after(&written) / after(&planted) - 1.0;
            println!("{law} {key}: {error:+.1e}");
            assert!(error.abs() < 1e-6, "{law} {key}: {error:e}\n{written}");
        }
        assert!(!written.contains(if law == "linear_bond" { "cpm" } else { "linear_bond" }), "{written}");
        let again = constants(&output);
        assert!(
            (again[0] / wanted[0] - 1.0).abs() < 1e-7 && (again[1] - wanted[1]).abs() < 1e-7,
            "{again:?} {wanted:?}"
        );
        assert_eq!(concordem(["check", text(&output)]).code, exit::DONE, "{written}");
    }
    // Without bonds in the scenario, or without a scenario, bonds are made.
    let bare = CELL.replace("[bonds]\nlaw = \"linear_bond\"\ncoordination = 8\n", "");
    let bare = write(folder.path(), "bare.toml", &bare);
    let output = folder.path().join("made.toml");
    for start in [&[text(&bare)][..], &[]] {
        let asked = ["--young", "30 GPa", "--poisson", "0.2", "--law", "cpm", "--force", "-o", text(&output)];
        let given = concordem(["calibrate", "elastic"].iter().chain(start).chain(&asked));
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        let [young, poisson] = constants(&output);
        assert!((young / 30e9 - 1.0).abs() < 1e-7 && (poisson - 0.2).abs() < 1e-7, "{young:e} {poisson}");
    }
}

/// Requests that do not fit the law are refused with a remedy.
#[test]
fn laws_that_do_not_fit_are_refused() {
    let folder = TempDir::new().expect("a temporary folder");
    let bond = "linear_bond = { normal_stiffness = 1e7, shear_stiffness = 2e6 }";
    let plain = write(folder.path(), "plain.toml", CELL);
    let soft = CELL.replace(bond, &format!("{bond}\ndeformable = {{ young = 5e10, poisson = 0.3 }}"));
    let soft = write(folder.path(), "soft.toml", &soft);
    let bare = CELL.replace("[bonds]\nlaw = \"linear_bond\"\ncoordination = 8\n", "");
    let bare = write(folder.path(), "bare.toml", &bare);
    let sheared = "cohesive_beam = { young = 1e9, radius_ratio = 0.5, model = \"timoshenko\" }";
    let sheared = write(folder.path(), "sheared.toml", &CELL.replace(bond, &format!("{bond}\n{sheared}")));
    let mut all = String::new();
    let cases: [(&[&str], u8); 8] = [
        (&[], exit::USAGE),
        (&[text(&bare)], exit::USAGE),
        (&[text(&plain), "--law", "cpm", "--deformable"], exit::USAGE),
        (&[text(&soft), "--law", "cpm"], exit::USAGE),
        (&[text(&sheared), "--law", "cohesive_beam"], exit::USAGE),
        (&[text(&plain), "--deformable", "--particle-poisson", "0.7"], exit::USAGE),
        (&[text(&plain), "--deformable", "--particle-softness", "9"], exit::PHYSICS),
        (&[text(&plain), "--law", "cohesive_beam", "--poisson", "-0.3"], exit::PHYSICS),
    ];
    for (case, code) in cases {
        let poisson: &[&str] = if case.contains(&"--poisson") { &[] } else { &["--poisson", "0.2"] };
        let given = concordem(["calibrate", "elastic", "--young", "30 GPa"].iter().chain(poisson).chain(case));
        let shown = case.join(" ").replace(text(folder.path()), "FOLDER");
        writeln!(all, "$ {shown}\n{}", given.err.replace(text(folder.path()), "FOLDER")).expect("text");
        assert_eq!(given.code, code, "{all}");
    }
    insta::assert_snapshot!("elastic_laws_that_do_not_fit", all);
}
