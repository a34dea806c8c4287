//! `characterise` measures packings of all kinds of files; structure sweeps do so for many.

use concordem::program::exit;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

use crate::{CELL, PRISM};

/// Spheres between walls.
const COOKED: &str = r#"
version = 1
[packing]
kind = "cooker"
radii = { kind = "uniform", minimum = "0.875 mm", maximum = "1.125 mm" }
shape = { kind = "box", size = ["9 mm", "9 mm", "9 mm"] }
[[material]]
name = "m"
density = 2000
linear_bond = { normal_stiffness = 1e7, shear_stiffness = 2e6 }
[contacts]
law = "none"
[stop]
steps = 1
"#;

fn json(folder: &TempDir, name: &str) -> serde_json::Value {
    let text = std::fs::read_to_string(folder.path().join(name)).expect("the JSON file");
    serde_json::from_str(&text).expect("JSON")
}

/// A scenario, its packing as text and as HDF5, and the result of its run are the same packing. The text file has 15 digits, and the
/// result is one step later, in which a bonded cell without load does not move.
#[test]
fn all_files_of_a_packing_give_the_same_figures() {
    let folder = TempDir::new().expect("a temporary folder");
    let cell = write(folder.path(), "cell.toml", CELL);
    let (pack, result) = (folder.path().join("cell.pack.h5"), folder.path().join("cell.run.h5"));
    for command in [vec!["pack", text(&cell), "-o", text(&pack)], vec!["run", text(&cell), "-o", text(&result)]] {
        let given = concordem(command);
        assert_eq!(given.code, exit::DONE, "{}", given.err);
    }
    let of = |arguments: &[&str], name: &str| {
        let given = concordem([&["characterise"][..], arguments].concat());
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        assert!(given.out.contains("links per sphere inside"), "{}", given.out);
        json(&folder, name)
    };
    // Eight bonds per particle in all three.
    let scenario = of(&[text(&cell)], "cell.structure.json");
    let packed = of(&[text(&pack), "--coordination", "8"], "cell.pack.structure.json");
    let run = of(&[text(&result)], "cell.run.structure.json");
    assert_eq!(run["links"], "intact bonds");
    assert_eq!(scenario["coordination"]["inside"], 8.0);
    for other in [&packed, &run] {
        assert_eq!(scenario["coordination"], other["coordination"]);
        for (table, key) in [("solid_fraction", "cell"), ("isotropy", "e"), ("radii", "mean")] {
            let (a, b) = (scenario[table][key].as_f64().expect(key), other[table][key].as_f64().expect(key));
            assert!((a / b - 1.0).abs() < 1e-9, "{key}: {a} {b}");
        }
    }
    let page = std::fs::read_to_string(folder.path().join("cell.structure.html")).expect("the page");
    for words in ["Rose of the links", "Pair correlation", "Solid fraction of the power cells inside"] {
        assert!(page.contains(words), "{words}");
    }
    assert_eq!(concordem(["characterise", text(&cell)]).code, exit::FILE, "it does not overwrite");
    assert_eq!(concordem(["characterise", "-f", text(&cell)]).code, exit::DONE);
}

/// A text file with YADE's comment on its cell is periodic: eight spheres, each with six neighbors through the faces of the cell. A cell
/// that is given beside it is refused, and not exchanged for it.
#[test]
fn the_cell_of_a_text_file_counts() {
    let folder = TempDir::new().expect("a temporary folder");
    let places = (0..8).map(|k| format!("{} {} {} 1\n", 2 * (k % 2), 2 * (k / 2 % 2), 2 * (k / 4)));
    let lines: String = places.collect();
    let own = write(folder.path(), "own.txt", &format!("##PERIODIC:: 4 4 4\n{lines}"));
    let bare = write(folder.path(), "bare.txt", &lines);
    for arguments in [vec![text(&own)], vec![text(&bare), "--cell", "4,4,4"]] {
        let given = concordem([&["characterise"][..], &arguments].concat());
        assert_eq!(given.code, exit::DONE, "{}", given.err);
    }
    let found = json(&folder, "own.structure.json");
    assert_eq!(found["solid_fraction"], json(&folder, "bare.structure.json")["solid_fraction"]);
    assert!((found["solid_fraction"]["cell"].as_f64().expect("a cell") - std::f64::consts::PI / 6.0).abs() < 1e-12);
    assert_eq!(found["coordination"]["inside"], 6.0);
    let both = concordem(["characterise", "-f", text(&own), "--cell", "4,4,4"]);
    assert_eq!(both.code, exit::USAGE, "{}", both.err);
    assert!(both.err.contains("a cell is given, but this file has its own; leave it out"), "{}", both.err);
}

/// A result has the materials of its particles; without bonds, links are pairs within a ratio.
#[test]
fn results_have_phases() {
    let folder = TempDir::new().expect("a temporary folder");
    let prism = write(folder.path(), "prism.toml", &PRISM.replace("STEPS", "10"));
    assert_eq!(concordem(["run", text(&prism)]).code, exit::DONE);
    let result = folder.path().join("prism.h5");
    assert_eq!(concordem(["characterise", text(&result)]).code, exit::DONE);
    let found = json(&folder, "prism.structure.json");
    assert_eq!(found["phases"][0]["material"], "concrete");
    assert_eq!(found["phases"][1]["material"], "weak");
    let near = concordem(["characterise", "-f", "--interaction-ratio", "1.01", text(&result)]);
    assert_eq!(near.code, exit::DONE, "{}", near.err);
    // Twelve neighbors in a face-centered cubic lattice.
    assert_eq!(json(&folder, "prism.structure.json")["coordination"]["inside"], 12.0);
}

/// A scenario has the phases of its result: materials, aggregates, fibers, and links between them.
#[test]
fn scenarios_have_phases() {
    let folder = TempDir::new().expect("a temporary folder");
    let text_of = |steps: &str| {
        "version = 1
        packing = { kind = \"lattice\", lattice = \"fcc\", radius = \"1 mm\", shape = { kind = \"box\", size = [0.02, 0.02, 0.02] } }
        bonds = { law = \"linear_bond\", interaction_ratio = 1.01 }
        contacts = { law = \"none\" }
        [[material]]
        name = \"mortar\"
        density = 2500
        linear_bond = { normal_stiffness = 1e6, shear_stiffness = 5e5 }
        [[material]]
        name = \"stone\"
        density = 2500
        linear_bond = { normal_stiffness = 1e6, shear_stiffness = 5e5 }
        [[material]]
        name = \"steel\"
        density = 7850
        linear_bond = { normal_stiffness = 1e6, shear_stiffness = 5e5 }
        cohesive_beam = { young = 2e9, radius_ratio = 1 }
        [aggregates]
        [[aggregates.group]]
        material = \"stone\"
        grading = { kind = \"single\", size = \"6 mm\" }
        volume_fraction = 0.1
        [[aggregates.group]]
        remove_particles = true
        grading = { kind = \"single\", size = \"4 mm\" }
        volume_fraction = 0.02
        [fibers]
        [[fibers.group]]
        material = \"steel\"
        diameter = \"1 mm\"
        length = \"8 mm\"
        count = 5
        [stop]
        steps = "
            .to_owned()
            + steps
            + "\n"
    };
    let scenario = write(folder.path(), "concrete.toml", &text_of("1"));
    let given = concordem(["characterise", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let found = json(&folder, "concrete.structure.json");
    let run = write(folder.path(), "run.toml", &text_of("1"));
    assert_eq!(concordem(["run", "-q", text(&run)]).code, exit::DONE);
    let given = concordem(["characterise", text(&folder.path().join("run.h5"))]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let result = json(&folder, "run.structure.json");
    for (phase, name) in ["mortar", "stone", "steel"].into_iter().enumerate() {
        assert_eq!(found["phases"][phase]["material"], name);
        for key in ["particles", "aggregates"] {
            assert_eq!(found["phases"][phase][key], result["phases"][phase][key], "{name} {key}");
        }
    }
    assert_eq!(found["phases"][2]["aggregates"], 5);
    assert_eq!(found["phases"][2]["particles"], 40);
    let page = std::fs::read_to_string(folder.path().join("concrete.structure.html")).expect("the page");
    assert!(page.contains("<td>stone</td>") && page.contains("between mortar and these"));
}

#[test]
fn wrong_arguments_are_refused() {
    let folder = TempDir::new().expect("a temporary folder");
    let cooked = write(folder.path(), "cooked.toml", COOKED);
    let plain = write(folder.path(), "two.txt", "0 0 0 1e-3\n2e-3 0 1e-3 1e-3\n");
    let broken = write(folder.path(), "broken.h5", "no HDF5");
    let cases: [(&[&str], u8, &str); 8] = [
        (&[text(&plain), "--shape", "{ kind = \"ball\" }"], exit::USAGE, "--shape is not a valid shape"),
        (&[text(&plain), "--shape", "{ kind = \"box\", size = [1, 1, 1], keep = \"centers\" }"], exit::USAGE, "keep"),
        (&[text(&plain), "--cell", "1 mm,2 mm"], exit::USAGE, "three positive lengths"),
        (&[text(&plain), "--interaction-ratio", "0.5"], exit::USAGE, "between 1 and 10"),
        (&[text(&plain), "--coordination", "60"], exit::USAGE, "no interaction ratio"),
        (&[text(&plain), "--boundary", "-1"], exit::USAGE, ""),
        (&[text(&broken)], exit::FILE, "cannot read"),
        (&[text(&cooked), "--cell", "1 mm,1 mm,1 mm"], exit::USAGE, "has its own"),
    ];
    for (arguments, code, words) in cases {
        let given = concordem([&["characterise"][..], arguments].concat());
        assert!(given.code == code && given.err.contains(words), "{arguments:?}: {} {}", given.code, given.err);
    }
}

/// A target out of reach is refused at its key, with the best value.
#[test]
fn targets_out_of_reach_have_their_key() {
    let folder = TempDir::new().expect("a temporary folder");
    let far = COOKED.replace("kind = \"cooker\"", "kind = \"cooker\"\ncoordination = 18");
    let scenario = write(folder.path(), "far.toml", &far);
    let given = concordem(["pack", text(&scenario)]);
    assert_eq!(given.code, exit::USAGE);
    assert!(given.err.contains("coordination = 18") && given.err.contains("the best is"), "{}", given.err);
}

/// The fineness study of the source, reduced to two sizes and two seeds: larger packings are denser, because the walls matter less, and
/// nearer to isotropy; all have the coordination number of their target.
#[test]
fn fineness_is_a_sweep() {
    let folder = TempDir::new().expect("a temporary folder");
    let bonded = COOKED.replace("[contacts]", "[bonds]\nlaw = \"linear_bond\"\n[contacts]");
    let corrected = bonded.replace("kind = \"cooker\"", "kind = \"cooker\"\ncorrection = \"enlarged-radii\"");
    write(folder.path(), "cube.toml", &corrected);
    let sweep = write(
        folder.path(),
        "fineness.toml",
        "version = 1\nscenario = \"cube.toml\"\nstudy = \"structure\"\n[[axis]]\nname = \"edge\"\nkey = \"packing.shape.size\"\n\
         values = [[9e-3, 9e-3, 9e-3], [15e-3, 15e-3, 15e-3]]\n[[axis]]\nkey = \"packing.seed\"\nvalues = [1, 2]\naverage = true\n",
    );
    let given = concordem(["sweep", "--csv", text(&sweep)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let table = std::fs::read_to_string(folder.path().join("fineness.csv")).expect("the table");
    let heads: Vec<&str> = table.lines().next().expect("heads").split(',').collect();
    let column = |name: &str| -> Vec<f64> {
        let at = heads.iter().position(|head| head.trim_matches('"') == name).expect(name);
        // The axis of sizes is a list in quotes with commas; count from the end.
        let from_end = heads.len() - at;
        let cell = |line: &str| {
            let cells: Vec<&str> = line.split(',').collect();
            cells[cells.len() - from_end].parse::<f64>().expect("a number")
        };
        table.lines().skip(1).map(cell).collect()
    };
    let (z, hull, e) = (column("links_per_sphere"), column("hull_fraction"), column("isotropy_percent"));
    let inside = column("spheres_inside");
    for k in 0..4 {
        // Whole links.
        assert!((z[k] - 6.2).abs() < 3.0 / inside[k], "{z:?}");
        assert!(e[k] > column("isotropy_floor_percent")[k]);
    }
    assert!(hull[2] + hull[3] > hull[0] + hull[1], "{hull:?}");
    assert!(e[2] + e[3] < e[0] + e[1], "{e:?}");
    let page = std::fs::read_to_string(folder.path().join("fineness.html")).expect("the page");
    for (words, expected) in [("Deviation from isotropy", true), ("static network", false)] {
        assert_eq!(page.contains(words), expected, "{words}");
    }
    let wrong =
        std::fs::read_to_string(&sweep).expect("the sweep").replacen("[[axis]]", "dynamics = true\n[[axis]]", 1);
    let wrong = write(folder.path(), "wrong.toml", &wrong);
    let refused = concordem(["sweep", text(&wrong)]);
    assert!(refused.code == exit::USAGE && refused.err.contains("dynamics"), "{}", refused.err);
}

/// A setting changes the scenario whose packing is made, and the record names it; a file without keys refuses it.
#[test]
fn settings_change_the_packing_of_a_scenario() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = write(folder.path(), "cooked.toml", COOKED);
    let setting = "packing.shape.size=[\"7 mm\", \"9 mm\", \"9 mm\"]";
    let figures = |arguments: &[&str]| {
        let given = concordem([&["characterise", "-f", text(&scenario)][..], arguments].concat());
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        std::fs::read_to_string(folder.path().join("cooked.structure.json")).expect("the JSON file")
    };
    let (own, changed) = (figures(&[]), figures(&["--set", setting]));
    let edited = write(folder.path(), "edited.toml", &COOKED.replacen("\"9 mm\"", "\"7 mm\"", 1));
    assert_eq!(concordem(["characterise", text(&edited)]).code, exit::DONE);
    let table = |text: &str| serde_json::from_str::<serde_json::Value>(text).expect("JSON");
    let by_hand = json(&folder, "edited.structure.json");
    assert_eq!(table(&changed)["coordination"], by_hand["coordination"]);
    assert_eq!(table(&changed)["radii"], by_hand["radii"]);
    assert_ne!(table(&own)["radii"], by_hand["radii"]);
    assert!(changed.contains("cooked.toml --set packing.shape.size="), "{changed}");
    let spheres = write(folder.path(), "spheres.txt", "0 0 0 1e-3\n2e-3 0 0 1e-3\n");
    let refused = concordem(["characterise", "--set", setting, text(&spheres)]);
    assert_ne!(refused.code, exit::DONE);
    assert!(
        refused.err.contains("only a scenario has keys") && refused.err.contains("leave it out"),
        "{}",
        refused.err
    );
}
