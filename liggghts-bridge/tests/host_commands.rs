//! Commands of LIGGGHTS and LAMMPS beside our styles: every style that the programs list, and the commands of scripts that act on atoms, bonds, lists, or
//! boxes, has a row or a class in a file of `host_commands/HOST/`, of which the book prints a table.
//!
//! A row has a small deck. Stock runs it with its own contacts or bonds, our styles with the same law: the atoms must end alike. The command must have an
//! effect, or the row says that it has none. Or our styles refuse the command, with the text of the row. Keys of rows: see [`Row`].

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::harness::{self, Atom, Dice, Host, attempt_in, data_file_for, run_together, text};
use concordem_contact::math::Vec3;
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    decks: BTreeMap<String, Deck>,
    row: Vec<Row>,
    class: Vec<Class>,
}

/// What a row's commands are put into.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Deck {
    /// For the page.
    #[expect(dead_code, reason = "read by the book")]
    says: String,
    head: String,
    /// Styles of the host.
    stock: String,
    /// Our styles with the same law.
    ours: BTreeMap<String, String>,
    /// For `beside_pair`.
    #[serde(default)]
    beside: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    /// Commands with their styles as in the list of the program, such as `fix adapt`; or commands of scripts.
    commands: Vec<String>,
    /// Names of decks, if not all.
    decks: Option<Vec<String>>,
    /// Our styles, if not all of the deck.
    with: Option<Vec<String>>,
    /// LAMMPS' atom style, if it is not the deck's.
    atoms: Option<String>,
    /// Lines before the box is read.
    #[serde(default)]
    first: String,
    /// Lines after the styles; `fix integrate all nve/sphere` follows unless they have a fix of this id.
    #[serde(default)]
    lines: String,
    /// Lines between two runs; without it there is one run.
    between: Option<String>,
    /// The group that is compared, if not all atoms.
    of: Option<String>,
    /// Further columns of dumps to compare.
    #[serde(default)]
    also: String,
    /// LIGGGHTS: the fix stands beside our pair style, without which the host refuses the command.
    #[serde(default)]
    beside_pair: bool,
    /// Our styles end the run with this text.
    refused: Option<String>,
    /// Our styles warn with this text, and run; nothing is compared.
    warned: Option<String>,
    /// The command changes nothing in the motion of these atoms.
    #[serde(default)]
    no_effect: bool,
    /// Also on two processes, because the command concerns what they exchange.
    #[serde(default)]
    two_processes: bool,
    /// Largest relative difference from stock, if not [`TOLERANCE`]; `says` has the reason.
    tolerance: Option<f64>,
    /// Not in random scripts; `says` has the reason.
    #[serde(default)]
    alone: bool,
    /// The test that shows it, instead of a deck: `FILE::FUNCTION`.
    test: Option<String>,
    /// For the page: what a user must know.
    #[expect(dead_code, reason = "read by the book")]
    says: Option<String>,
}

/// Commands that have no deck.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Class {
    /// For the page: why.
    #[expect(dead_code, reason = "read by the book")]
    says: String,
    /// As in [`Row`]; an `*` at the end stands for the rest of a name. Rows and earlier classes come first.
    commands: Vec<String>,
}

impl Row {
    fn decks<'a>(&'a self, table: &'a Table) -> impl Iterator<Item = (&'a str, &'a Deck)> {
        let decks = table.decks.iter().map(|(name, deck)| (name.as_str(), deck));
        decks.filter(|(name, _)| {
            self.test.is_none() && self.decks.as_ref().is_none_or(|of| of.iter().any(|own| own == name))
        })
    }

    fn with(&self, style: &str) -> bool {
        self.with.as_ref().is_none_or(|with| with.iter().any(|own| own == style))
    }
}

/// Forty steps amplify the rounding of another order of sums to less.
const TOLERANCE: f64 = 1e-9;
const RADIUS: f64 = 0.005;
const BOTH: [Host; 2] = [Host::Liggghts, Host::Lammps];

/// All files of the host's folder as one table.
fn table(host: Host) -> Table {
    let name = if host == Host::Liggghts { "liggghts" } else { "lammps" };
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/host_commands").join(name);
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let text = files.iter().fold(String::new(), |out, file| out + &std::fs::read_to_string(file).unwrap());
    toml::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
}

/// 27 spheres of 10 mm: in touch, bonded (LAMMPS), or pressed together (LIGGGHTS); and surfaces.
fn write_files(host: Host, folder: &Path) {
    let cube = |spacing: f64, scatter: f64| -> Vec<Atom> {
        let mut dice = Dice(3);
        let atom = |k: usize| {
            let place = Vec3::new((k % 3) as f64 - 1.0, (k / 3 % 3) as f64 - 1.0, (k / 9) as f64 - 1.0) * spacing;
            let mut atom = Atom::resting(place + dice.vector() * scatter, 0.005);
            atom.kind = 1 + usize::from(k >= 18);
            atom.velocity = dice.vector() * 0.2;
            atom.spin = dice.vector() * 10.0;
            atom
        };
        (0..27).map(atom).collect()
    };
    let (low, high) = (Vec3::new(-0.05, -0.05, -0.015), Vec3::new(0.05, 0.05, 0.025));
    std::fs::write(folder.join("clump.txt"), "-0.001 0 0 0.002\n0.001 0 0 0.002\n").unwrap();
    // Tables and parameters that fixes read.
    for entry in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/host_commands/files")).unwrap() {
        let file = entry.unwrap().path();
        std::fs::copy(&file, folder.join(file.file_name().unwrap())).unwrap();
    }
    // In LAMMPS' data files, atoms without bonds have style sphere.
    let write = |name: &str, atoms: &[Atom]| data_file_for(Host::Liggghts, &folder.join(name), atoms, &[], low, high);
    write("contact.data", &cube(0.0098, 1e-4));
    write("pressed.data", &cube(0.0099, 0.0));
    let atoms = cube(0.01, 0.0);
    let mut bonds = Vec::new();
    for b in 0..atoms.len() {
        for a in 0..b {
            if (atoms[a].position - atoms[b].position).norm() < 0.0102 {
                bonds.push([a + 1, b + 1]);
            }
        }
    }
    let listed = bonds.iter().fold(String::new(), |out, [a, b]| out + &format!("{a} {b} 0.01\n"));
    std::fs::write(folder.join("bonds.txt"), listed).unwrap();
    if host == Host::Lammps {
        let file = folder.join("bond.data");
        data_file_for(host, &file, &atoms, &bonds, low, high);
        // One bond has a type of its own.
        let text = std::fs::read_to_string(&file).unwrap().replace("1 bond types", "2 bond types");
        std::fs::write(&file, text.replace("\n54 1 ", "\n54 2 ")).unwrap();
    }
    for (name, z, up) in [("floor.stl", -0.0145, true), ("face.stl", 0.0245, false)] {
        let corner = |x: f64, y: f64| format!("vertex {x} {y} {z}\n");
        let [a, b, c, d] = [corner(-0.04, -0.04), corner(0.04, -0.04), corner(0.04, 0.04), corner(-0.04, 0.04)];
        let facet = |corners: [&str; 3]| {
            let [a, b, c] = if up { corners } else { [corners[0], corners[2], corners[1]] };
            let normal = if up { 1 } else { -1 };
            format!("facet normal 0 0 {normal}\nouter loop\n{a}{b}{c}endloop\nendfacet\n")
        };
        std::fs::write(
            folder.join(name),
            format!("solid s\n{}{}endsolid s\n", facet([&a, &b, &c]), facet([&a, &c, &d])),
        )
        .unwrap();
    }
}

/// The script of a row with these styles; `row` is `None`: without its commands.
fn script(host: Host, deck: &Deck, styles: &str, row: &Row, commands: bool, dump: &str) -> String {
    let mut out = deck.head.clone();
    if let Some(atoms) = &row.atoms {
        out = out.replacen("atom_style sphere\n", &format!("atom_style {atoms}\n"), 1);
    }
    if commands {
        out = out.replacen("read_data", &format!("{}\nread_data", row.first), 1);
    }
    out += styles;
    let lines = if commands { row.lines.as_str() } else { "" };
    writeln!(out, "{lines}").unwrap();
    if !lines.contains("fix integrate") {
        out.push_str("fix integrate all nve/sphere\n");
    }
    match &row.between {
        Some(between) => write!(out, "run 20\n{}\nrun 20\n", if commands { between } else { "" }),
        None => writeln!(out, "run 40"),
    }
    .unwrap();
    let also = if commands { row.also.as_str() } else { "" };
    let columns = format!("id x y z vx vy vz omegax omegay omegaz fx fy fz tqx tqy tqz {also}");
    let count = columns.split_whitespace().count() - 1;
    let format = match host {
        Host::Liggghts => format!("format \"%d{}\"", " %.17g".repeat(count)),
        Host::Lammps => "format float %.17g".to_owned(),
    };
    let of = row.of.as_deref().unwrap_or("all");
    writeln!(out, "write_dump {of} custom {dump} {columns} modify sort id {format}").unwrap();
    out
}

fn last(folder: &Path, dump: &str) -> Vec<Vec<f64>> {
    harness::tables(&folder.join(dump)).pop().unwrap_or_else(|| panic!("{dump} is empty")).1
}

/// [`harness::apart`] of dumps of [`script`].
fn apart(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    harness::apart(a, b, Some(7), RADIUS)
}

fn styles_of(deck: &Deck, name: &str, row: &Row) -> String {
    let beside = if row.beside_pair && name == "fix" { deck.beside.as_str() } else { "" };
    format!("{beside}{}", deck.ours[name])
}

/// All rows with a deck: stock, stock without the command, and ours, some also on two processes.
fn compare(host: Host) {
    let table = table(host);
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_files(host, folder);
    let [mut stock, mut ours, mut again] = [const { Vec::new() }; 3];
    let mut compared = Vec::new();
    for (k, row) in table.row.iter().enumerate().filter(|(_, row)| row.refused.is_none() && row.warned.is_none()) {
        for (name, deck) in row.decks(&table) {
            let dump = |of: &str| format!("{k}.{name}.{of}");
            stock.push(script(host, deck, &deck.stock, row, true, &dump("stock")));
            stock.push(script(host, deck, &deck.stock, row, false, &dump("without")));
            for style in deck.ours.keys().filter(|style| row.with(style)) {
                let styles = styles_of(deck, style, row);
                ours.push(script(host, deck, &styles, row, true, &dump(style)));
                if row.two_processes {
                    again.push(script(host, deck, &styles, row, true, &dump(&format!("{style}.2"))));
                }
                compared.push((row, [dump("stock"), dump("without"), dump(style), dump(&format!("{style}.2"))]));
            }
        }
    }
    for (scripts, processors) in [(&stock, 1), (&ours, 1), (&again, 2)] {
        run_together(host, folder, scripts, processors);
    }
    let mut wrong = String::new();
    for (row, [stock, without, ours, again]) in &compared {
        let (theirs, mine) = (last(folder, stock), last(folder, ours));
        let effect = apart(&theirs, &last(folder, without));
        let far = apart(&mine, &theirs);
        let tolerance = row.tolerance.unwrap_or(TOLERANCE);
        let mut say = |text: String| writeln!(wrong, "{:?} {ours}: {text}", row.commands).unwrap();
        if far > tolerance {
            say(format!("{far:.1e} from stock; the effect of the command is {effect:.1e}"));
        }
        if row.no_effect == (effect > 10.0 * tolerance) {
            say(format!("its effect is {effect:.1e}"));
        }
        if row.two_processes {
            let far = apart(&last(folder, again), &mine);
            if far > TOLERANCE {
                say(format!("{far:.1e} on two processes"));
            }
        }
    }
    assert!(wrong.is_empty(), "{host:?}, {} decks:\n{wrong}", compared.len());
}

#[test]
fn commands_of_liggghts_do_with_our_styles_what_they_do_with_its_own() {
    compare(Host::Liggghts);
}

#[test]
fn commands_of_lammps_do_with_our_styles_what_they_do_with_its_own() {
    compare(Host::Lammps);
}

/// One start per deck; two at a time.
#[test]
fn what_our_styles_refuse_or_doubt_is_said_by_name() {
    for host in BOTH {
        let table = table(host);
        let folder = tempfile::tempdir().unwrap();
        write_files(host, folder.path());
        let mut wrong = String::new();
        for row in &table.row {
            let Some(wanted) = row.refused.as_ref().or(row.warned.as_ref()) else { continue };
            // One deck is enough, because the styles have one fix.
            if let Some((name, deck)) = row.decks(&table).next() {
                for style in deck.ours.keys().filter(|style| row.with(style)) {
                    let script = script(host, deck, &styles_of(deck, style, row), row, true, "none");
                    let output = attempt_in(host, folder.path(), &script, 1);
                    let printed = text(&output);
                    if output.status.success() != row.warned.is_some() || !printed.contains(wanted.as_str()) {
                        let from = printed.find("ERROR").unwrap_or(printed.len().saturating_sub(300));
                        let end: String = printed[from..].chars().take(400).collect();
                        writeln!(wrong, "{:?} {name} {style}: no `{wanted}` in {end}", row.commands).unwrap();
                    }
                }
            }
        }
        assert!(wrong.is_empty(), "{host:?}:\n{wrong}");
    }
}

/// The lists of `-help`, with the command of each list.
fn listed(host: Host) -> BTreeSet<String> {
    let printed = harness::help(host);
    let mut names = BTreeSet::new();
    let mut command = None;
    for line in printed.lines() {
        if let Some(title) = line.strip_prefix("* ") {
            command = match title.trim_end().trim_end_matches(':').to_lowercase().replace(" styles", "").as_str() {
                "atom" => Some("atom_style "),
                "integrate" => Some("run_style "),
                "pair" => Some("pair_style "),
                "bond" => Some("bond_style "),
                "fix" => Some("fix "),
                "command" => Some(""),
                _ => None,
            };
        } else if let Some(command) = command {
            names.extend(line.split_whitespace().map(|name| format!("{command}{name}")));
        }
    }
    names
}

#[test]
fn every_command_of_the_programs_has_a_row_or_a_class() {
    for host in BOTH {
        let (table, listed) = (table(host), listed(host));
        assert!(listed.len() > 140, "{host:?}: {listed:?}");
        let rows: BTreeSet<&str> = table.row.iter().flat_map(|row| &row.commands).map(String::as_str).collect();
        let classes: Vec<&str> = table.class.iter().flat_map(|class| &class.commands).map(String::as_str).collect();
        let in_class = |name: &str| {
            classes.iter().any(|class| class.strip_suffix('*').map_or(name == *class, |begin| name.starts_with(begin)))
        };
        let missing: Vec<_> = listed.iter().filter(|name| !rows.contains(name.as_str()) && !in_class(name)).collect();
        assert!(missing.is_empty(), "{host:?} lists {} names without a row: {missing:?}", missing.len());
        // Names that the program does not have. Commands of scripts are in no list.
        let kinds = ["fix ", "pair_style ", "bond_style ", "atom_style ", "run_style "];
        let known = |name: &str| {
            name.contains(',') || !kinds.iter().any(|kind| name.starts_with(kind)) || listed.contains(name)
        };
        let exact = classes.iter().copied().filter(|class| !class.ends_with('*'));
        let unknown: Vec<_> = rows.iter().copied().chain(exact).filter(|name| !known(name)).collect();
        assert!(unknown.is_empty(), "{host:?} has no {unknown:?}");
        let twice: Vec<_> = classes.iter().filter(|class| rows.contains(*class)).collect();
        assert!(twice.is_empty(), "{host:?}: in a row and in a class: {twice:?}");
        for row in &table.row {
            let Some(test) = &row.test else { continue };
            let (file, function) = test.split_once("::").unwrap_or_else(|| panic!("{test}: give FILE::FUNCTION"));
            let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
            let read = |path: PathBuf| std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{test}: {error}"));
            let source = read(folder.join("tests").join(file).with_extension("rs"));
            assert!(source.contains(&format!("fn {function}(")), "{test} does not exist");
            // Scripts are in the source, in the harness, in public decks, or in examples.
            let scripts = ["tests/harness", "tests/public_decks/liggghts", "tests/public_decks/lammps", "examples"]
                .map(|name| folder.join(name))
                .iter()
                .flat_map(|folder| std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()))
                .fold(source, |out, file| out + &read(file));
            for command in &row.commands {
                let name = command.rsplit(' ').next().unwrap().trim_end_matches("/omp");
                assert!(scripts.contains(name), "{test} has no {command}");
            }
        }
    }
}

/// Rows of one line without a part before the box, which can stand in a script together. The integrator is chosen by one row only.
fn combinable<'a>(table: &'a Table, deck: &str) -> Vec<&'a Row> {
    let fits = |row: &&Row| {
        let line = row.lines.trim();
        let plain = row.refused.is_none() && row.warned.is_none() && row.test.is_none() && row.between.is_none();
        let whole = row.first.is_empty() && row.of.is_none() && row.atoms.is_none() && row.also.is_empty();
        plain
            && whole
            && !row.alone
            && row.tolerance.is_none()
            && row.decks.as_ref().is_none_or(|of| of.iter().any(|own| own == deck))
            && row.with.is_none()
            && !line.is_empty()
            && !line.contains('\n')
    };
    table.row.iter().filter(fits).collect()
}

/// Three commands at a time, in scripts drawn at random on 1, 2, or 4 processes: ours beside stock on as many, to [`TOLERANCE`], or a hundred
/// times as far as the last bits of places take stock from itself. `CONCORDEM_HOST_DECKS` sets the number of
/// scripts, `CONCORDEM_HOST_DECKS_SEED` the first one. Random numbers of hosts are those of the process, so other numbers are not compared here.
#[test]
fn random_commands_together_do_what_they_do_with_stock() {
    let number = |name: &str, default: u64| {
        std::env::var(name).map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{name}={text}")))
    };
    let (count, seed) = (number("CONCORDEM_HOST_DECKS", 12), number("CONCORDEM_HOST_DECKS_SEED", 1));
    let [ran, drawn] = harness::record::random("commands", seed, count, 20, compare_random);
    assert!(2 * ran >= drawn, "stock takes {ran} of {drawn} scripts");
}

/// Commands drawn at random.
struct Drawn {
    seed: u64,
    host: Host,
    processors: usize,
    /// What a failure says.
    says: String,
    stock: String,
    ours: String,
}

impl Drawn {
    fn new(seed: u64, tables: &[Table; 2]) -> Self {
        let mut dice = Dice(seed);
        let mut pick = |of: usize| (dice.roll() * of as f64) as usize;
        let at = (seed % 2) as usize;
        let (host, table) = (BOTH[at], &tables[at]);
        let name = table.decks.keys().nth(pick(table.decks.len())).unwrap();
        let (deck, rows) = (&table.decks[name], combinable(table, name));
        assert!(rows.len() > 15, "{host:?} {name}: {}", rows.len());
        let mut lines = String::new();
        for n in 0..3 {
            let line = rows[pick(rows.len())].lines.trim();
            if lines.contains("fix integrate") && line.contains("fix integrate") {
                continue;
            }
            writeln!(lines, "{}", line.replacen("fix x ", &format!("fix x{n} "), 1)).unwrap();
        }
        let processors = [1, 2, 4][pick(3)];
        let style = deck.ours.keys().nth(pick(deck.ours.len())).unwrap();
        let row: Row = toml::from_str(&format!("commands = []\nlines = '''\n{lines}'''\nbeside_pair = true")).unwrap();
        let says = format!("script {seed}, {host:?} {name} {style} on {processors}:\n{lines}");
        let stock = script(host, deck, &deck.stock, &row, true, &format!("{seed}.stock"));
        let ours = script(host, deck, &styles_of(deck, style, &row), &row, true, &format!("{seed}.ours"));
        Self { seed, host, processors, says, stock, ours }
    }
}

/// Those of `drawn` that the host alone takes, in a few starts.
fn taken<'a>(host: Host, folder: &Path, mut drawn: &'a [Drawn], processors: usize) -> Vec<&'a Drawn> {
    let mut taken = Vec::new();
    while !drawn.is_empty() {
        let scripts: Vec<String> = drawn.iter().map(|one| one.stock.clone()).collect();
        let output = attempt_in(host, folder, &(scripts.join("clear\n") + "\n"), processors);
        if output.status.success() && !text(&output).contains("ERROR") {
            taken.extend(drawn);
            break;
        }
        // The first one without a dump has failed, and is left out if it does so as the first of a start.
        let done = drawn.iter().take_while(|one| folder.join(format!("{}.stock", one.seed)).exists()).count();
        assert!(done < drawn.len(), "{host:?} ends with an error after the last script:\n{}", text(&output));
        taken.extend(&drawn[..done]);
        drawn = &drawn[done.max(1)..];
    }
    taken
}

/// How many scripts of these seeds stock takes. Panics if ours end otherwise.
fn compare_random(seeds: Range<u64>) -> usize {
    let tables = BOTH.map(table);
    let mut drawn: Vec<Drawn> = seeds.map(|seed| Drawn::new(seed, &tables)).collect();
    drawn.sort_by_key(|one| (one.host == Host::Lammps, one.processors));
    let mut ran = 0;
    for drawn in drawn.chunk_by(|a, b| (a.host, a.processors) == (b.host, b.processors)) {
        let (host, processors) = (drawn[0].host, drawn[0].processors);
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        write_files(host, folder);
        let taken = taken(host, folder, drawn, processors);
        let ours: Vec<String> =
            taken.iter().map(|one| format!("print \"script {}\"\n{}", one.seed, one.ours)).collect();
        run_together(host, folder, &ours, processors);
        for one in &taken {
            let far =
                apart(&last(folder, &format!("{}.ours", one.seed)), &last(folder, &format!("{}.stock", one.seed)));
            if far <= TOLERANCE {
                continue;
            }
            // Some commands amplify rounding: cosh(x) - 1 in fix nvk, for one. How far is stock from itself if the last bits of places change?
            let other = format!("{}.other", one.seed);
            let nudge = "\ndisplace_atoms all move 1e-17 1e-17 1e-17\nrun ";
            let again = one.stock.replace(&format!("{}.stock", one.seed), &other).replacen("\nrun ", nudge, 1);
            run_together(host, folder, &[again], processors);
            let itself = apart(&last(folder, &other), &last(folder, &format!("{}.stock", one.seed)));
            assert!(far <= 100.0 * itself, "{far:.1e} apart, stock from itself {itself:.1e}: {}", one.says);
        }
        ran += taken.len();
    }
    ran
}
