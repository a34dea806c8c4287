//! Cracks and acoustic emissions of a finished run.

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem::state::columns::ColumnData;
use concordem_tests::commands::{concordem, text, write};
use concordem_tests::pairs::PulledPairs;
use tempfile::TempDir;

const PAIRS: usize = 40;

/// Pairs that are pulled apart, joined by beams whose strengths scatter.
const BEAMS: PulledPairs<'_> = PulledPairs {
    count: PAIRS,
    law: "cohesive_beam",
    material: "cohesive_beam = { young = 1e9, radius_ratio = 1, tensile_strength = 1e6 }
        strength_scatter = { weibull_modulus = 4, seed = 2 }",
    time_step: 1e-6,
    steps: 5000,
};

/// The scenario of these pairs.
fn pairs() -> String {
    BEAMS.scenario()
}

/// The same with another motion of the right spheres.
fn pulled(motion: &str, history: &str) -> String {
    let scenario = pairs();
    let changed = scenario.replace("velocity = [0.001, 0, 0]", &format!("{motion}\n{history}"));
    assert_ne!(changed, scenario);
    changed
}

/// Numbers of a column of comma-separated values.
fn column(csv: &str, name: &str) -> Vec<f64> {
    let at = csv.lines().next().expect("a header").split(',').position(|title| title == name).expect("a column");
    csv.lines().skip(1).map(|line| line.split(',').nth(at).expect("a cell").parse().expect("a number")).collect()
}

/// Pairs far apart are emissions of one break each, with the energy ½ E A (fσ/E)² l of a beam; with a long distance and duration all breaks
/// are one. A step is at least 1/800 of the elongation at which a bond breaks: 3e-3 of the energy.
#[test]
fn breaks_are_counted_by_mode_and_grouped() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = write(folder.path(), "pairs.toml", &BEAMS.scenario());
    let given = concordem(["run", "-q", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let path = folder.path().join("pairs.h5");
    let given = concordem(["events", text(&path)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    println!("{}", given.out);
    for (name, value) in [("broken bonds", "40"), ("in tension", "40"), ("in shear", "0")] {
        let line = given.out.lines().find(|line| line.contains(name)).expect(name);
        assert_eq!(line.split_whitespace().last(), Some(value), "{line}");
    }
    assert!(given.out.contains("emissions") && given.out.contains("40, of breaks within 2.000e-3 m and 3.162e-6 s"));
    let csv = concordem(["events", text(&path), "--csv"]).out;
    let energies = column(&csv, "energy [J]");
    assert_eq!((energies.len(), column(&csv, "breaks")), (PAIRS, vec![1.0; PAIRS]));
    // The strengths of the result file give the energies.
    let result = ResultFile::open(&path).expect("a result");
    let rows = result.rows("contacts/cohesive_beam").expect("bonds");
    let of = |name: &str| {
        let (_, column) = rows.iter().find(|(column, _)| column == name).expect("a column");
        let ColumnData::F64(values) = &column.data else { panic!("not reals") };
        values.clone()
    };
    let (factors, areas) = (of("strength_factor"), of("area"));
    let mut wanted: Vec<f64> =
        factors.iter().zip(&areas).map(|(factor, area)| 0.5 * 1e9 * area * (factor * 1e-3).powi(2) * 2e-3).collect();
    wanted.sort_by(f64::total_cmp);
    // Weaker bonds break earlier.
    for (energy, wanted) in energies.iter().zip(&wanted) {
        assert!(energy / wanted > 1.0 - 1e-9 && energy / wanted < 1.003, "{energy} {wanted}");
    }
    for (energy, magnitude) in energies.iter().zip(column(&csv, "magnitude")) {
        assert!((magnitude - (2.0 / 3.0 * energy.log10() - 3.2)).abs() < 1e-12);
    }
    let all = concordem(["events", text(&path), "--distance", "1 m", "--duration", "1 s", "--csv"]).out;
    let together: f64 = energies.iter().sum();
    assert_eq!(column(&all, "breaks"), [PAIRS as f64]);
    assert!((column(&all, "energy [J]")[0] / together - 1.0).abs() < 1e-14);
    // A tenth as many emissions count from a great magnitude on.
    let few = concordem(["events", text(&path), "--completeness", "0"]);
    assert!(few.out.contains("too few"), "{}", few.out);
    for (option, value) in [
        ("--distance", "0 mm"),
        ("--distance", "1 s"),
        ("--duration", "soon"),
        ("--completeness", "x"),
        ("--completeness", "nan"),
    ] {
        let given = concordem(["events", text(&path), option, value]);
        assert_eq!(given.code, exit::USAGE, "{option} {value}: {}", given.out);
        assert!(given.err.contains(option), "{}", given.err);
    }
    assert_eq!(concordem(["events", text(&scenario)]).code, exit::FILE);
}

/// Pairs that are pressed and sheared break by the shear criterion of their law, although a beam stores most of its energy in bending then.
#[test]
fn pressed_pairs_break_in_shear() {
    let folder = TempDir::new().expect("a temporary folder");
    for (law, keys) in [
        ("cohesive_beam", "young = 1e9, radius_ratio = 1, tensile_strength = 1e6, cohesion = 1e6, moment_share = 0"),
        (
            "damped_beam",
            "young = 1e9, radius_ratio = 1, tensile_strength = 1e6, cohesion = 1e6, moment_share = 0, damping_ratio = 0.1",
        ),
        (
            "softening_beam",
            "young = 1e9, radius_ratio = 1, tensile_strength = 1e6, cohesion = 1e6, moment_share = 0, fracture_energy = 2, \
             shear_fracture_energy = 0.01",
        ),
        ("linear_bond", "normal_stiffness = 1e6, shear_stiffness = 1e6, normal_strength = 3, shear_strength = 3"),
        (
            "jointed",
            "young = 1e9, stiffness_ratio = 0.3, tensile_strength = 1e6, cohesion = 1e6, friction_coefficient = 0.2",
        ),
    ] {
        let material = format!("{law} = {{ {keys} }}");
        let scenario = PulledPairs { law, material: &material, ..BEAMS }.scenario();
        // Without rotation, so that no sphere rolls on the other one.
        let scenario = scenario
            .replace("velocity = [0.001, 0, 0]", "velocity = [-1e-4, 5e-3, 0]")
            .replace("[[prescribe]]", "[[prescribe]]\nangular_velocity = [0, 0, 0]");
        let file = write(folder.path(), "sheared.toml", &scenario);
        done(["run", "-q", "--force", text(&file)]);
        let path = folder.path().join("sheared.h5");
        let events = ResultFile::open(&path).expect("a result").events().expect("events");
        assert!(events.len() == PAIRS && events.iter().all(|event| event.in_shear), "{material}: {events:?}");
        let given = done(["events", text(&path), "--duration", "1 us"]);
        for (name, value) in [("in tension", "0"), ("in shear", "40")] {
            let line = given.lines().find(|line| line.contains(name)).expect(name);
            assert_eq!(line.split_whitespace().last(), Some(value), "{material}: {given}");
        }
    }
}

/// Softening beams are damaged before they break. Each counts once, and the emissions have the energy that the ledger lost.
#[test]
fn softening_beams_count_once() {
    let folder = TempDir::new().expect("a temporary folder");
    let material = "softening_beam = { young = 1e9, radius_ratio = 1, tensile_strength = 4e6, fracture_energy = 40 }";
    let scenario = PulledPairs { law: "softening_beam", material, time_step: 4e-5, steps: 1000, ..BEAMS }.scenario();
    let file = write(folder.path(), "softening.toml", &scenario);
    done(["run", "-q", text(&file)]);
    let path = folder.path().join("softening.h5");
    let result = ResultFile::open(&path).expect("a result");
    let events = result.events().expect("events");
    let broken: Vec<_> = events.iter().filter(|event| event.damage == 1.0).collect();
    assert_eq!((events.len(), broken.len()), (2 * PAIRS, PAIRS));
    let expected = 40.0 * std::f64::consts::PI * 1e-6;
    assert!(broken.iter().all(|event| (event.energy / expected - 1.0).abs() < 1e-3), "{:?}", broken[0]);
    let given = done(["events", text(&path), "--distance", "1 mm"]);
    let value = |name: &str| {
        let line =
            given.lines().find(|line| line.trim().starts_with(name)).unwrap_or_else(|| panic!("{name}: {given}"));
        line.trim()[name.len()..].trim().split([' ', ',']).next().expect("a value").parse::<f64>().expect("a number")
    };
    assert_eq!((value("broken bonds"), value("emissions")), (PAIRS as f64, PAIRS as f64));
    assert!(!given.contains("damaged bonds"), "{given}");
    let dissipated = *result.samples("damage").expect("a series").last().expect("a record");
    assert!((value("energy") / dissipated - 1.0).abs() < 1e-3, "{given} {dissipated}");
}

/// Bonds without a modulus need a duration; a run without cracks says so.
#[test]
fn a_duration_is_asked_for_where_none_follows() {
    let folder = TempDir::new().expect("a temporary folder");
    let material = "linear_bond = { normal_stiffness = 1e6, shear_stiffness = 1e6 }";
    let scenario = PulledPairs { law: "linear_bond", material, steps: 10, ..BEAMS }.scenario();
    let scenario = write(folder.path(), "springs.toml", &scenario);
    let given = concordem(["run", "-q", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let path = folder.path().join("springs.h5");
    let given = concordem(["events", text(&path)]);
    assert_eq!(given.code, exit::USAGE);
    assert!(given.err.contains("--duration"), "{}", given.err);
    let given = concordem(["events", text(&path), "--duration", "1 us"]);
    assert_eq!(given.code, exit::DONE);
    assert!(given.out.contains("broken bonds") && !given.out.contains("emissions"), "{}", given.out);
}

/// A program that must succeed; its output.
fn done<const N: usize>(arguments: [&str; N]) -> String {
    let given = concordem(arguments);
    assert_eq!(given.code, exit::DONE, "{arguments:?}: {}", given.err);
    given.out
}

/// A program that must be refused with these words.
fn refused<const N: usize>(arguments: [&str; N], words: &str) {
    let given = concordem(arguments);
    assert_eq!(given.code, exit::USAGE, "{arguments:?}: {}", given.out);
    assert!(given.err.contains(words), "{arguments:?}: {}", given.err);
}

/// The pairs of a row along y are cut by faces across x that fill the section of the body, 392 mm × 2 mm; all open by the displacement of 5 µm,
/// without slip. All lie at 0° in the plane of x and y, and have no direction in that of y and z.
#[test]
fn cracks_have_area_width_and_direction() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = write(folder.path(), "pairs.toml", &pairs());
    done(["run", "-q", text(&scenario)]);
    let path = folder.path().join("pairs.h5");
    let file = text(&path);
    let summary = done(["events", file, "--faces"]);
    println!("{summary}");
    assert!(summary.contains("7.8400e-4 m², 40 faces") && summary.contains("5.000 µm wide and slipped by 0.000 µm"));
    assert!(summary.contains("1.000 across (1.00, 0.00, 0.00)"));
    let faces = done(["events", file, "--csv=faces"]);
    let (area, opening) = (column(&faces, "area [m²]"), column(&faces, "opening [m]"));
    // Rounding of positions of 0.4 m.
    // The body ends 1e-9 of its size beyond its spheres. Positions gain 1e-9 m in each of 5000 steps, with a rounding of 1e-19 m each.
    assert!((area.iter().sum::<f64>() / 7.84e-4 - 1.0).abs() < 1e-8);
    assert!(opening.iter().all(|width| (width - 5e-6).abs() < 1e-15), "{opening:?}");
    assert_eq!(column(&faces, "shear"), [0.0; PAIRS]);
    let rose = done(["events", file, "--csv=rose"]);
    let (angle, area) = (column(&rose, "angle [deg]"), column(&rose, "area [m²]"));
    assert_eq!((angle.len(), angle[1]), (24, 7.5));
    assert!((area[0] / 7.84e-4 - 1.0).abs() < 1e-8 && area[1..].iter().all(|area| *area == 0.0), "{rose}");
    let none = column(&done(["events", file, "--csv=rose", "--across", "x"]), "area [m²]");
    assert!(none.iter().all(|area| *area == 0.0));
    // What an option does not change is refused.
    refused(["events", file, "--across", "x"], "--csv=rose");
    refused(["events", file, "--csv=faces", "--distance", "1 mm"], "--distance changes nothing");
    refused(["events", file, "--csv", "--completeness", "1"], "--completeness changes nothing in --csv=emissions");
    refused(["events", file, "--csv=load", "--faces"], "--faces changes nothing");
    for (option, value) in [("--unloading", "nan"), ("--unloading", "1"), ("--onset", "0"), ("--onset", "x")] {
        refused(["events", file, option, value], option);
    }
}

/// Elongation at which each bond breaks, m: strength over modulus is 1e-3 times its factor, and a bond is 2 mm long.
fn elongations(path: &std::path::Path) -> Vec<f64> {
    let rows = ResultFile::open(path).expect("a result").rows("contacts/cohesive_beam").expect("bonds");
    let (_, column) = rows.iter().find(|(name, _)| name == "strength_factor").expect("factors");
    let ColumnData::F64(factors) = &column.data else { panic!("not reals") };
    factors.iter().map(|factor| factor * 2e-6).collect()
}

/// Brittle bonds remember the largest load exactly: pulled by 1.2 µm, released, and pulled by 5 µm, the next one breaks at its own elongation u. The
/// load is the stored energy here: with the same bonds `(u/1.2 µm)²` of the former one. The record in which a bond breaks lacks a part of its
/// energy, one of as many as are left.
#[test]
fn brittle_bonds_remember_the_load() {
    let folder = TempDir::new().expect("a temporary folder");
    let history = "history = \"cycle\"
        [[history]]
        name = \"cycle\"
        shape = { kind = \"table\", points = [[0, 0], [1.2e-3, 1.2e-6], [2.2e-3, 0.2e-6], [7e-3, 5e-6]] }";
    let scenario = pulled("displacement = [1, 0, 0]", history)
        .replace("steps = 5000", "steps = 7000")
        .replace("sample_interval = 1000", "sample_interval = 10");
    let scenario = write(folder.path(), "cycle.toml", &scenario);
    done(["run", "-q", text(&scenario)]);
    let path = folder.path().join("cycle.h5");
    let file = text(&path);
    let summary = done(["events", file, "--load", "stored_normal"]);
    println!("{summary}");
    let line = summary.lines().find(|line| line.contains("Felicity")).expect("a reloading");
    let ratio: f64 = line.split_whitespace().last().and_then(|word| word.parse().ok()).expect("a ratio");
    let breaking = elongations(&path);
    let next = breaking.iter().copied().filter(|u| *u > 1.2e-6).fold(f64::INFINITY, f64::min);
    let left = breaking.iter().filter(|u| **u > 1.2e-6).count();
    assert!((ratio - (next / 1.2e-6).powi(2)).abs() < 1.0 / left as f64, "{line} {next}");
    assert!(!done(["events", file]).contains("reloadings"), "nothing loads the ends of a specimen here");
    let table = done(["events", file, "--csv=load", "--load", "stored_normal"]);
    let (count, energy) = (column(&table, "emissions"), column(&table, "energy [J]"));
    assert!(count.windows(2).all(|pair| pair[0] <= pair[1]) && count.last() == Some(&(PAIRS as f64)));
    let emissions = column(&done(["events", file, "--csv"]), "energy [J]");
    assert!((energy.last().expect("a record") / emissions.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    // While the load falls and rises again to the former one, nothing is heard: 2 ms, 200 records.
    let still = count.chunk_by(|one, other| one == other).map(<[f64]>::len).max();
    assert!(still >= Some(200), "{still:?}");
    refused(["events", file, "--csv=load", "--load", "length"], "length");
}

/// The report shows the numbers of the commands: 40 bonds broken in tension, 40 emissions, too few for a b-value, 80 single particles.
#[test]
fn the_report_counts_cracks_emissions_and_fragments() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = write(folder.path(), "pairs.toml", &pairs());
    done(["run", "-q", text(&scenario)]);
    done(["report", text(&folder.path().join("pairs.h5"))]);
    let page = std::fs::read_to_string(folder.path().join("pairs.html")).expect("a page");
    for (name, value) in [
        ("bonds broken in tension", "40"),
        ("bonds broken in shear", "0"),
        ("acoustic emissions", "40"),
        ("fragments", "80, 80 of them single particles"),
        ("mass of single particles", "100.0 %"),
    ] {
        let row = format!("<tr><td>{name}</td><td class=\"number\">{value}</td></tr>");
        assert!(page.contains(&row), "{row}");
    }
    for chart in ["emissions-0", "magnitudes-0", "sieve-0"] {
        assert!(page.contains(&format!("id=\"{chart}-title\"")), "{chart}");
    }
}

/// Pairs have a longest axis of 2√6 r and the others of 2r, and fall apart into single spheres, of which the right ones move on.
#[test]
fn fragments_are_measured_at_any_time() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = write(folder.path(), "pairs.toml", &pairs());
    done(["run", "-q", text(&scenario)]);
    let path = folder.path().join("pairs.h5");
    let file = text(&path);
    let summary = done(["fragments", file]);
    println!("{summary}");
    assert!(summary.contains("80, 100.00 % of the mass") && summary.contains("too few fragments"));
    assert!(summary.contains("5.000e-4 m/s in the mean of their mass") || summary.contains("at most 1.000e-3 m/s"));
    let table = done(["fragments", file, "--csv"]);
    assert_eq!(column(&table, "particles"), [1.0; 2 * PAIRS]);
    let mass = 4.0 / 3.0 * std::f64::consts::PI * 1e-9 * 2500.0;
    assert!(column(&table, "mass [kg]").iter().all(|found| (found / mass - 1.0).abs() < 1e-14));
    assert!(column(&table, "size [m]").iter().all(|size| (size / 2e-3 - 1.0).abs() < 1e-14));
    let moving = column(&table, "vx [m/s]").iter().filter(|v| **v > 0.0).count();
    assert_eq!(moving, PAIRS);
    let table = done(["fragments", file, "--time", "0 s", "--csv=fragments"]);
    assert_eq!(column(&table, "particles"), [2.0; PAIRS]);
    assert!(column(&table, "longest axis [m]").iter().all(|axis| (axis / (2e-3 * 6.0_f64.sqrt()) - 1.0).abs() < 1e-12));
    assert!(column(&table, "size [m]").iter().all(|size| (size / 2e-3 - 1.0).abs() < 1e-12));
    assert!(column(&table, "mass [kg]").iter().all(|found| (found / mass / 2.0 - 1.0).abs() < 1e-14));
    // The sphere of two has the diameter 2 cbrt(2) r; all pass at once.
    let curve = done(["fragments", file, "--time", "0 s", "--size", "sphere", "--csv=curve"]);
    assert_eq!(column(&curve, "passing").last(), Some(&1.0));
    assert!((column(&curve, "size [m]")[0] / (2e-3 * 2.0_f64.cbrt()) - 1.0).abs() < 1e-14);
    assert!(done(["fragments", file, "--set", "left"]).contains("40, 100.00 % of the mass"));
    refused(["fragments", file, "--set", "middle"], "left, right");
    for time in ["1 s", "-1 s"] {
        refused(["fragments", file, &format!("--time={time}")], "outside of the snapshots");
    }
    for (option, value) in [("--time", "nan"), ("--time", "1 mm"), ("--size", "shape"), ("--csv", "x")] {
        refused(["fragments", file, &format!("{option}={value}")], option);
    }
    let scenario = pairs().replace("strength_scatter = { weibull_modulus = 4, seed = 2 }", "");
    let (before, bonds) = scenario.split_once("[bonds]").expect("bonds");
    let (_, behind) = bonds.split_once("[contacts]").expect("contacts");
    let loose = format!("{before}[contacts]{behind}");
    let scenario = write(folder.path(), "loose.toml", &loose);
    done(["run", "-q", text(&scenario)]);
    refused(["fragments", text(&folder.path().join("loose.h5"))], "no [bonds]");
}

/// Three pairs that are pulled apart: across an open joint, across one with strength, and across none. Nothing breaks in the first, whose
/// bond just comes apart: it is neither an event nor a broken bond. The others have an event each, with the number of the joint.
#[test]
fn events_name_the_joint_and_open_joints_do_not_break() {
    let scenario = r#"
        version = 1
        [packing]
        kind = "spheres"
        spheres = [[0, 0, 0, 1], [0, 0, 2, 1], [10, 0, 0, 1], [10, 0, 2, 1], [20, 0, 0, 1], [20, 0, 2, 1]]
        [[material]]
        name = "rock"
        density = 1000
        jointed = { young = "1 MPa", stiffness_ratio = 0.3, tensile_strength = 10, cohesion = 10, friction_angle = "30 deg" }
        [bonds]
        law = "jointed"
        interaction_ratio = 1.05
        [contacts]
        law = "jointed"
        [[set]]
        name = "lower"
        selection = { kind = "box", minimum = [-2, -2, -2], maximum = [22, 2, 1] }
        [[set]]
        name = "upper"
        selection = { kind = "box", minimum = [-2, -2, 1], maximum = [22, 2, 4] }
        [[prescribe]]
        set = "lower"
        velocity = [0, 0, 0]
        [[prescribe]]
        set = "upper"
        velocity = [0, 0, 1e-3]
        [[joint]]
        shape = { kind = "disc", center = [0, 0, 1], normal = [0, 0, 1], radius = 3 }
        normal_stiffness = "1 MPa/m"
        shear_stiffness = "1 MPa/m"
        friction_angle = "30 deg"
        [[joint]]
        shape = { kind = "disc", center = [10, 0, 1], normal = [0.6, 0, 0.8], radius = 3 }
        normal_stiffness = "1 MPa/m"
        shear_stiffness = "1 MPa/m"
        friction_angle = "30 deg"
        tensile_strength = 1
        cohesion = 1
        [integration]
        time_step = 1e-3
        [stop]
        steps = 1000
        [output]
        snapshot_interval = 500
    "#;
    let folder = TempDir::new().expect("a temporary folder");
    let file = write(folder.path(), "joints.toml", scenario);
    done(["run", "-q", text(&file)]);
    let path = folder.path().join("joints.h5");
    let result = ResultFile::open(&path).expect("a result");
    let events = result.events().expect("events");
    let mut joints: Vec<(u32, Option<u16>)> = events.iter().map(|event| (event.id_a, event.joint)).collect();
    joints.sort_unstable();
    assert_eq!(joints, [(2, Some(1)), (4, None)]);
    assert_eq!(result.samples("broken").expect("a series").last(), Some(&2.0));
    let bonds = result.rows("contacts/jointed").expect("a table");
    let numbers = |name: &str| match &bonds.iter().find(|(column, _)| column == name).expect(name).1.data {
        ColumnData::U16(values) => values.iter().map(|&n| u32::from(n)).collect::<Vec<_>>(),
        ColumnData::U8(values) => values.iter().map(|&n| u32::from(n)).collect(),
        _ => panic!("{name}"),
    };
    assert_eq!((numbers("joint"), numbers("broken")), (vec![1, 65535], vec![1, 1]));
    let given = done(["events", text(&path), "--duration", "1 us"]);
    for (name, value) in [("broken bonds", "2"), ("joint[0]", "0"), ("joint[1]", "1")] {
        let line = given.lines().find(|line| line.contains(name)).expect(name);
        assert_eq!(line.split_whitespace().last(), Some(value), "{given}");
    }
    // The spheres part along z: width and slip of the crack across the joint are those along and across its normal.
    let faces = done(["events", text(&path), "--csv=faces"]);
    assert_eq!(column(&faces, "joint"), [1.0, 65535.0]);
    let (width, slip) = (column(&faces, "opening [m]"), column(&faces, "slip [m]"));
    let moved = width[1];
    assert!(moved > 5e-4 && slip[1] < 1e-12 * moved, "{faces}");
    let near = |found: f64, share: f64| (found - share * moved).abs() < 1e-9 * moved;
    assert!(near(width[0], 0.8) && near(slip[0], 0.6), "{faces}");
    assert_eq!([column(&faces, "nx")[0], column(&faces, "nz")[0]].map(f64::abs), [0.6, 0.8]);
}
