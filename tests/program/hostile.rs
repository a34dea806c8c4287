//! Names of files, titles, materials, sets, and axes that mean something in another language: each writer quotes them for its target.

use std::path::Path;

use concordem::program::exit;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

/// Names that would become code, markup, or another name. None has a slash, which no file name has.
const HOSTILE: [&str; 12] = [
    "\"); __import__('os').system('touch evil') #",
    "'); evil() #",
    "\"\"\"\nimport evil\n\"\"\"",
    "</title><script>evil()<\u{2f}script>",
    "\"><img src=x onerror=evil()>",
    "&lt;b&gt;",
    "back\\slash\\",
    "@DATA@ PARTICLES BONDS STEM COLUMNS",
    "comma, \"quote\"\nline",
    "=1+1",
    "$(touch evil)`touch evil`%s{0}",
    "\u{202e}right to left \u{e9}",
];

/// A name without meaning, of which everything is as with a hostile one, except for the name.
const PLAIN: &str = "plain";

/// A name of a file.
fn file_name(name: &str) -> String {
    name.replace('/', "\u{2215}")
}

fn scenario(name: &str) -> String {
    let quoted = serde_json::Value::from(name);
    format!(
        r#"version = 1
title = {quoted}
[packing]
kind = "lattice"
lattice = "fcc"
radius = "1 mm"
repeats = [3, 3, 3]
[[material]]
name = {quoted}
density = 2500
linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 2e5, normal_strength = 0.2, shear_strength = 1 }}
[bonds]
law = "linear_bond"
interaction_ratio = 1.05
[contacts]
law = "none"
[[set]]
name = {quoted}
selection = {{ kind = "ids", ids = [0, 1] }}
[[force]]
set = {quoted}
force = [0, 0, 1e-9]
[loading]
kind = "uniaxial"
strain_rate = "20 1/s"
layer_thickness = "1 mm"
[stop]
steps = 200
[output]
csv = true
snapshot_interval = 50
bond_snapshots = true
"#
    )
}

fn sweep(name: &str, scenario: &str) -> String {
    let (title, scenario) = (serde_json::Value::from(name), serde_json::Value::from(scenario));
    format!(
        "version = 1\ntitle = {title}\nscenario = {scenario}\nstudy = \"structure\"\n[[axis]]\nname = {title}\n\
         key = \"bonds.interaction_ratio\"\nvalues = [1.05, 1.1]\n"
    )
}

/// Writes everything with this name in a folder; returns the texts by the ending of their file.
fn written(folder: &Path, name: &str) -> Vec<(&'static str, String)> {
    let file = file_name(name);
    let source = write(folder, &format!("{file}.toml"), &scenario(name));
    let result = folder.join(format!("{file}.h5"));
    let made = folder.join(format!("{file}.made.html"));
    let swept = write(folder, &format!("{file}.sweep.toml"), &sweep(name, &format!("{file}.toml")));
    let commands: [&[&str]; 7] = [
        &["run", "-q", text(&source)],
        &["report", text(&result)],
        &["export", text(&result)],
        &["export", "--format", "lammps", text(&result)],
        &["export", "--format", "cracks", text(&result)],
        &["sweep", "-q", "--csv", text(&swept)],
        &["characterise", "-q", text(&result), "-o", text(&made)],
    ];
    for command in commands {
        let given = concordem(command.iter().copied());
        assert_eq!(given.code, exit::DONE, "{command:?}: {}", given.err);
    }
    let endings = [
        ".html",
        ".csv",
        ".paraview.py",
        ".ovito.py",
        ".data",
        ".dump",
        ".bonds.dump",
        ".cracks.vtp",
        ".sweep.html",
        ".sweep.csv",
        ".made.html",
        ".made.json",
    ];
    let read = |ending: &&'static str| {
        let path = folder.join(format!("{file}{ending}"));
        (*ending, std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
    };
    endings.iter().map(read).collect()
}

/// Tags, attributes, and texts of scripts of a page, without what stands between the tags.
fn markup(page: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = page;
    while let Some((_, after)) = rest.split_once('<') {
        let tag: String = tag_of(after);
        let end = tag.len();
        let name: String = tag.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '/' || *c == '!').collect();
        rest = &after[end..];
        if name == "script" {
            let (code, after) = rest.split_once("</script>").expect("an end of the script");
            found.push(code.to_owned());
            rest = after;
        }
        // Values of attributes are texts, names are not.
        let names: Vec<&str> = tag.split('"').step_by(2).collect();
        found.push(names.join("\"\""));
    }
    found
}

/// A tag to its end: a `>` outside of quotes.
fn tag_of(text: &str) -> String {
    let mut quoted = false;
    text.chars()
        .take_while(|c| {
            quoted ^= *c == '"';
            quoted || *c != '>'
        })
        .collect()
}

/// A script in Python without the contents of its strings of one line.
fn code(script: &str) -> String {
    let mut bare = String::new();
    let mut quoted = false;
    let mut escaped = false;
    for c in script.chars() {
        match c {
            _ if escaped => escaped = false,
            '\\' if quoted => escaped = true,
            '"' => {
                quoted = !quoted;
                bare.push(c);
            }
            _ if quoted => {}
            _ => bare.push(c),
        }
    }
    bare
}

/// Fields of each line of a table, by RFC 4180.
fn widths(table: &str) -> Vec<usize> {
    let (mut widths, mut fields, mut quoted) = (Vec::new(), 1, false);
    for c in table.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => fields += 1,
            '\n' if !quoted => {
                widths.push(fields);
                fields = 1;
            }
            _ => {}
        }
    }
    widths
}

/// What is not a name is the same for each name, here three in one.
#[test]
fn names_stay_names_in_every_file() {
    let plain = TempDir::new().expect("a folder");
    let expected = written(plain.path(), PLAIN);
    for name in HOSTILE.chunks(3).map(<[&str]>::concat) {
        let folder = TempDir::new().expect("a folder");
        for ((ending, found), (_, plain)) in written(folder.path(), &name).into_iter().zip(&expected) {
            let what = format!("{ending} of {name:?}");
            match ending {
                ".html" | ".sweep.html" | ".made.html" => {
                    let (found, plain) = (markup(&found), markup(plain));
                    let differ = found.iter().zip(&plain).find(|(found, plain)| found != plain);
                    assert!(differ.is_none() && found.len() == plain.len(), "{what}: {differ:?}");
                }
                ".paraview.py" | ".ovito.py" => {
                    assert_eq!(code(&found), code(plain), "{what}");
                    assert_eq!(found.lines().count(), plain.lines().count(), "{what}");
                    assert!(!found.contains(['\u{202e}', '\u{0}']), "{what}");
                }
                ".csv" | ".sweep.csv" => assert_eq!(widths(&found), widths(plain), "{what}"),
                ".made.json" => {
                    let json: serde_json::Value = serde_json::from_str(&found).expect("JSON");
                    assert!(json.is_object(), "{what}");
                }
                _ => assert_eq!(&found, plain, "{what}"),
            }
        }
        assert!(!folder.path().join("evil").exists());
    }
}

/// Commands that a message tells the user to type name the file as one argument.
#[test]
fn messages_name_files_for_a_shell() {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("a $(touch evil) 'b'.toml");
    let given = concordem(["init", "--template", "cpm-small", text(&path)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let (_, command) = given.err.trim_end().split_once("next: concordem check ").expect("a command");
    let output =
        std::process::Command::new("sh").args(["-c", &format!("printf %s {command}")]).output().expect("a shell");
    assert_eq!(String::from_utf8_lossy(&output.stdout), text(&path));
}
