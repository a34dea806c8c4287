//! `calibrate rock` finds strengths of bonds, and says what it cannot reach.

use concordem::assembly::assemble;
use concordem::program::exit;
use concordem::scenario::{Scenario, template};
use concordem::schedule::Simulation;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

/// The text with these changes.
fn changed(mut text: String, changes: &[(&str, &str)]) -> String {
    for (from, to) in changes {
        assert!(text.contains(from), "no `{from}` in\n{text}");
        text = text.replace(from, to);
    }
    text
}

/// The template with few spheres and a fast loading.
fn cell() -> String {
    let text = template("rock-triaxial").expect("the template").text.to_owned();
    changed(text, &[("count = 500", "count = 90"), ("\"-3 1/s\"", "\"-10 1/s\"")])
}

/// The template's bonds as beams.
fn beams() -> String {
    let jointed = cell();
    let (start, end) =
        (jointed.find("[material.jointed]").expect("the table"), jointed.find("[bonds]").expect("the end"));
    let table = "[material.cohesive_beam]\nyoung = \"200 GPa\"\nradius_ratio = 0.5\ntensile_strength = \"20 MPa\"\ncohesion = \"60 MPa\"\nfriction_angle = \"20 deg\"\n\n";
    let text = format!("{}{table}{}", &jointed[..start], &jointed[end..]);
    changed(
        text,
        &[
            ("[bonds]\nlaw = \"jointed\"", "[bonds]\nlaw = \"cohesive_beam\""),
            ("[contacts]\nlaw = \"jointed\"", "[contacts]\nlaw = \"none\""),
        ],
    )
}

/// Largest stress (Pa) of a run of the cell at this lateral pressure (Pa) and rate (1/s) along z.
fn strength(scenario: &str, pressure: f64, rate: f64) -> f64 {
    let start = scenario.find("[loading]").expect("the loading");
    let end = scenario.find("[output]").expect("the output");
    let stages = if pressure > 0.0 {
        "[[stage]]\nname = \"consolidate\"\ncontrol = \"stress\"\nstop = { unbalanced = 1e-2 }\n\n\
         [[stage]]\nname = \"load\"\nstop = { drop_to = 0.85 }\n\n"
    } else if rate > 0.0 {
        "[stop]\ndrop_to = 0.5\n\n"
    } else {
        "[stop]\ndrop_to = 0.85\n\n"
    };
    let loading = format!(
        "[loading]\nkind = \"cell-stress\"\nstress = [[{p}, 0, 0], [0, {p}, 0], [0, 0, {p}]]\nstrain_rate = [\"free\", \"free\", {rate}]\n\
         maximum_strain_rate = 100\n\n{stages}",
        p = -pressure
    );
    let text = format!("{}{loading}{}", &scenario[..start], &scenario[end..]);
    let scenario = Scenario::parse("cell.toml", &text).unwrap_or_else(|error| panic!("{error}"));
    let built = assemble(&scenario, std::path::Path::new("."), &mut |_, _| {}).expect("a cell");
    let mut simulation = Simulation::new(built.state, built.model, built.schedule).expect("a simulation");
    let mut largest = 0.0_f64;
    while simulation.stopped().is_none() {
        let advance = simulation.advance().expect("a step");
        for record in advance.sample.iter().chain(&advance.last) {
            if record.stress.abs() > largest.abs() {
                largest = record.stress;
            }
        }
    }
    largest
}

/// The number after a name in the output, and whether the line holds it.
fn number(output: &str, name: &str) -> f64 {
    let line =
        output.lines().find(|line| line.trim_start().starts_with(name)).unwrap_or_else(|| panic!("{name}: {output}"));
    let rest = line.trim_start()[name.len()..].trim_start();
    let word = rest.split([' ', '°', ',']).next().expect("a number");
    word.parse().unwrap_or_else(|_| panic!("{word} in {line}"))
}

/// With both laws: the written scenario has the strengths that the command prints, found here by runs of that scenario, and these are the
/// targets. One packing of 90 spheres breaks by jumps, so that its functions have steps of some percent: 6 %. What is measured is not
/// measured again, the scenario keeps its comments, and a file is not overwritten.
#[test]
fn written_strengths_are_those_of_the_targets() {
    for (given, targets) in [(cell(), ["8 MPa", "44 MPa"]), (beams(), ["8 MPa", "40 MPa"])] {
        let folder = TempDir::new().expect("a temporary folder");
        let path = write(folder.path(), "cell.toml", &given);
        let output = folder.path().join("rock.toml");
        let [f_t, f_c] = targets;
        let arguments = [
            "calibrate",
            "rock",
            text(&path),
            "--young",
            "50 GPa",
            "--poisson",
            "0.15",
            "--tensile-strength",
            f_t,
            "--compressive-strength",
            f_c,
            "--friction-angle",
            "45 deg",
            "--confining-pressure",
            "6 MPa",
            "--seeds",
            "1",
            "--nearest",
            "-o",
            text(&output),
        ];
        let found = concordem(arguments);
        assert_eq!(found.code, exit::DONE, "{}", found.err);
        println!("{}", found.out);
        let written = std::fs::read_to_string(&output).expect("the scenario");
        assert!(written.contains("# more bonds per particle"), "{written}");
        assert_eq!(written.matches("friction_").count(), 1, "{written}");
        let [tension, compression] = [strength(&written, 0.0, 2.0), -strength(&written, 0.0, -10.0)];
        // The pressure of the command is the target's share of the strength that is reached.
        let pressure = 6e6 / (1e6 * f_c.trim_end_matches(" MPa").parse::<f64>().expect("a number")) * compression;
        let gain = (-strength(&written, pressure, -10.0) - compression) / pressure;
        let angle = ((gain - 1.0) / (gain + 1.0)).asin().to_degrees();
        println!("runs: {tension:e}, {compression:e}, {angle}");
        for (name, here, digit) in [
            ("reached, tension", 1e-6 * tension, 1e-3),
            ("reached, f_c/f_t", compression / tension, 1e-3),
            ("reached, angle of friction", angle, 1e-2),
        ] {
            let printed = number(&found.out, name);
            assert!((printed - here).abs() < 0.51 * digit, "{name}: {printed} printed, {here} here");
        }
        assert!((1e-6 * tension / 8.0 - 1.0).abs() < 0.06, "{}", found.out);
        let ratio = if f_c == "44 MPa" { 5.5 } else { 5.0 };
        assert!((compression / tension / ratio - 1.0).abs() < 0.06, "{}", found.out);
        assert_eq!(concordem(arguments).code, exit::FILE, "it does not overwrite");
        let again = concordem(arguments.into_iter().chain(["--force"]));
        assert!(again.out.contains("measurements") && number(&again.out, "measurements") == 0.0, "{}", again.out);
        assert_eq!(std::fs::read_to_string(&output).expect("the scenario"), written);
    }
}

/// What no bonds reach is refused with the reach; --nearest takes the nearest strengths and says how far they are. Runs end at a strain that follows
/// from the targets, so that another target does not take over what was measured for this one.
#[test]
fn what_is_out_of_reach_is_said() {
    let folder = TempDir::new().expect("a temporary folder");
    let path = write(folder.path(), "cell.toml", &cell());
    let arguments = [
        "calibrate",
        "rock",
        text(&path),
        "--young",
        "50 GPa",
        "--poisson",
        "0.2",
        "--tensile-strength",
        "1 MPa",
        "--compressive-strength",
        "200 MPa",
        "--seeds",
        "1",
    ];
    let refused = concordem(arguments);
    assert_eq!(refused.code, exit::PHYSICS, "{}", refused.err);
    for part in ["Wanted f_c/f_t = 200.00", "times the tensile strength give", "Omit --tensile-strength", "--nearest"] {
        assert!(refused.err.contains(part), "{part}: {}", refused.err);
    }
    let nearest = concordem(arguments.into_iter().chain(["--nearest"]));
    assert_eq!(nearest.code, exit::DONE, "{}", nearest.err);
    assert!(
        nearest.out.contains("out of reach; the nearest strengths") && number(&nearest.out, "measurements") == 0.0,
        "{}",
        nearest.out
    );
    let other = arguments.map(|argument| if argument == "200 MPa" { "150 MPa" } else { argument });
    let other = concordem(other.into_iter().chain(["--nearest"]));
    assert_eq!(other.code, exit::DONE, "{}", other.err);
    assert!(number(&other.out, "measurements") > 0.0, "{}", other.out);
}

/// Scenarios and options that do not fit are refused with a remedy.
#[test]
fn what_does_not_fit_is_refused() {
    let folder = TempDir::new().expect("a temporary folder");
    let refused = |given: &str, more: &[&str], parts: &[&str]| {
        let path = write(folder.path(), "cell.toml", given);
        let targets = ["--young", "50 GPa", "--poisson", "0.2", "--compressive-strength", "100 MPa"];
        let found =
            concordem(["calibrate", "rock", text(&path)].into_iter().chain(targets).chain(more.iter().copied()));
        assert_eq!(found.code, exit::USAGE, "{}\n{}", found.out, found.err);
        for part in parts {
            assert!(found.err.contains(part), "{part}: {}", found.err);
        }
    };
    let concrete = template("concrete-triaxial").expect("the template").text;
    refused(concrete, &[], &["bonds", "only for jointed bonds and cohesive beams", "law = \"jointed\""]);
    let still = changed(
        cell(),
        &[
            ("\"free\", \"free\", \"-10 1/s\"", "\"free\", \"free\", \"free\""),
            ("control = \"stress\" ", ""),
            ("stop = { strain = -1e-2 }", "stop = { steps = 10 }"),
        ],
    );
    refused(&still, &[], &["loading.strain_rate", "exactly one axis must have a strain rate", "rock-triaxial"]);
    let weak = changed(cell(), &[("cohesion = \"20 MPa\"", "cohesion = 0")]);
    refused(&weak, &[], &["tensile strength and cohesion must be positive"]);
    let particle = changed(beams(), &[("radius_ratio = 0.5", "radius_ratio = 0.5\nhydrostatic_strength = \"50 MPa\"")]);
    refused(&particle, &[], &["hydrostatic_strength", "does not scale"]);
    refused(&cell(), &["--confining-pressure", "5 MPa"], &["--friction-angle"]);
    refused(&cell(), &["--friction-angle", "95 deg"], &["not below a right angle"]);
    refused(&cell(), &["--friction-angle", "45"], &["has no unit, but an angle is expected"]);
}
