//! Packings of other programs: every way in which they are written gives the same spheres, or is refused by its name.

use concordem_contact::math::Vec3;
use concordem_packing::import;
use concordem_solver::state::particles::Sphere;

/// The spheres of all good files here.
fn expected() -> [Sphere; 2] {
    [
        Sphere { position: Vec3::new(0.0, 1.0, 2.0), radius: 0.5 },
        Sphere { position: Vec3::new(-3.0, 4.0, 5.5), radius: 0.25 },
    ]
}

fn spheres(text: &str) -> Vec<Sphere> {
    import(text.as_bytes(), None).unwrap_or_else(|error| panic!("{text}\n{error}")).spheres
}

fn refusal(text: &str) -> String {
    import(text.as_bytes(), None).expect_err(text).to_string()
}

/// All ways to choose one item of each list.
fn product(lists: &[&[&'static str]]) -> Vec<Vec<&'static str>> {
    lists.iter().fold(vec![Vec::new()], |chosen, list| {
        let extend = |front: &Vec<&'static str>| -> Vec<Vec<&'static str>> {
            list.iter().map(|item| front.iter().copied().chain([*item]).collect()).collect()
        };
        chosen.iter().flat_map(extend).collect()
    })
}

/// Tables with every separator, decimal sign, order and name of columns, quotes, further columns, and end of lines.
#[test]
fn tables_give_the_same_spheres_however_they_are_written() {
    let names = [
        "x y z r",
        "X Y Z Radius",
        "Points:0 Points:1 Points:2 diameter",
        "pos_x pos_y pos_z d",
        "points_0 points_1 points_2 rad",
    ];
    let mut count = 0;
    for choice in product(&[
        &names,
        &[",", ";", " ", "\t"],
        &["", "id", "material"],
        &["", "unit"],
        &["", "quoted"],
        &["\n", "\r\n", "\r"],
    ]) {
        let [names, separator, further, unit, quoted, end] = choice[..] else { panic!("{choice:?}") };
        let by_space = separator.trim().is_empty();
        if by_space && !quoted.is_empty() {
            continue;
        }
        let is_diameter = names.contains('d') && !names.contains("rad") && !names.contains("Rad");
        let rows = if is_diameter {
            [[0.0, 1.0, 2.0, 1.0], [-3.0, 4.0, 5.5, 0.5]]
        } else {
            [[0.0, 1.0, 2.0, 0.5], [-3.0, 4.0, 5.5, 0.25]]
        };
        let mut header: Vec<String> = names.split(' ').map(str::to_owned).collect();
        // Lengths in mm, the last in um.
        let scales = if unit.is_empty() { [1.0; 4] } else { [1e3, 1e3, 1e3, 1e6] };
        if !unit.is_empty() {
            for (k, name) in header.iter_mut().enumerate() {
                *name = format!("{name} {}", if k < 3 { "[mm]" } else { "(um)" });
            }
        }
        let mut lines: Vec<Vec<String>> = vec![header];
        for row in rows {
            let word = |(value, scale): (f64, f64)| {
                let text = format!("{:?}", value * scale);
                if separator == ";" { text.replace('.', ",") } else { text }
            };
            lines.push(row.into_iter().zip(scales).map(word).collect());
        }
        if !further.is_empty() {
            // A column in front, another behind.
            for (k, line) in lines.iter_mut().enumerate() {
                line.insert(0, if k == 0 { further.to_owned() } else { k.to_string() });
                line.push(if k == 0 { "mass [kg]".to_owned() } else { "7".to_owned() });
            }
        }
        let quote = |word: &String| if quoted.is_empty() { word.clone() } else { format!("\"{word}\"") };
        let lines: Vec<String> =
            lines.iter().map(|line| line.iter().map(quote).collect::<Vec<_>>().join(separator)).collect();
        let text = lines.join(end) + end;
        let found = spheres(&text);
        assert_eq!(found.len(), 2, "{text}");
        for (found, wanted) in found.iter().zip(expected()) {
            // 1e-3 and 1e-6 are rounded once each.
            let scale = if unit.is_empty() { 0.0 } else { 1e-15 };
            assert!(
                (found.position - wanted.position).norm() <= 8.0 * scale
                    && (found.radius - wanted.radius).abs() <= scale,
                "{text}: {found:?}"
            );
        }
        count += 1;
    }
    assert!(count >= 60, "{count}");
}

/// Text of this program, of YADE, and of others.
#[test]
fn text_gives_the_same_spheres_however_it_is_written() {
    let starts = ["", "# a comment\n\n", "##PERIODIC:: 20 20 20\n", "# x y z r (m)\n", "\u{feff}"];
    let mut count = 0;
    for choice in product(&[
        &starts,
        &[" ", "\t", "   "],
        &["", " -1", " # first"],
        &["", "#format x_y_z_r_matId\n", "#format x_y_z_r_clumpId\n"],
        &["\n", "\r\n", "\r"],
        &["", "\n"],
    ]) {
        let [start, separator, further, format, end, last] = choice[..] else { panic!("{choice:?}") };
        if end == "\r" && !last.is_empty() {
            continue;
        }
        let row = |row: &str| format!("{}{further}\n", row.replace(' ', separator));
        let text = format!("{start}{format}{}{}", row("0 1 2 0.5"), row("-3 4.0 5.5 2.5e-1")).replace('\n', end) + last;
        let packing = import(text.as_bytes(), None).unwrap_or_else(|error| panic!("{text}\n{error}"));
        assert_eq!(packing.spheres, expected(), "{text}");
        assert_eq!(packing.cell.map(|cell| cell.volume()), start.contains("PERIODIC").then_some(8000.0), "{text}");
        count += 1;
    }
    assert!(count >= 60, "{count}");
    let scaled = import("##PERIODIC:: 1 1 1\n0 1 2 0.5\n".as_bytes(), Some(1e-3)).unwrap();
    assert_eq!(scaled.spheres[0], Sphere { position: Vec3::new(0.0, 1e-3, 2e-3), radius: 5e-4 });
    assert!((scaled.cell.unwrap().volume() - 1e-9).abs() < 1e-24);
}

/// A comment that names the columns counts, in any order and with units, as the header of a table does.
#[test]
fn comments_name_columns() {
    let rows = "0.5 0 1 2\n0.25 -3 4 5.5\n";
    let ids = "1 0 1 2 0.5\n2 -3 4 5.5 0.25\n";
    for (text, scale) in [
        (format!("# r x y z\n{rows}"), 1.0),
        (format!("# A packing of two\n#\n#  radius  x  y  z\n\n{rows}"), 1.0),
        (format!("# columns: r, x, y, z\n{rows}"), 1.0),
        (format!("# r x y z (mm)\n{rows}"), 1e-3),
        (format!("# r[mm] x[mm] y [mm] z[mm]\n{rows}"), 1e-3),
        (format!("# diameter x y z\n{}", rows.replace("0.5 ", "1 ").replacen("0.25", "0.5", 1)), 1.0),
        (format!("# id x y z r\n{ids}"), 1.0),
        (format!("# r,x,y,z\n{}", rows.replace(' ', ",")), 1.0),
        (format!("# r;x;y;z\n{}", rows.replace(' ', ";").replace('.', ",")), 1.0),
        // The order without names, with a unit.
        ("# x y z r (cm)\n0 1 2 0.5\n-3 4 5.5 0.25\n".to_owned(), 1e-2),
        // A line that names columns itself counts more than a comment.
        ("# r x y z\nx y z r\n0 1 2 0.5\n-3 4 5.5 0.25\n".to_owned(), 1.0),
        // Words that name no columns.
        ("# the x y z coordinates and radii of all\n0 1 2 0.5\n-3 4 5.5 0.25\n".to_owned(), 1.0),
    ] {
        let packing = import(text.as_bytes(), None).unwrap_or_else(|error| panic!("{text}\n{error}"));
        for (found, wanted) in packing.spheres.iter().zip(expected()) {
            let difference =
                (found.position - wanted.position * scale).norm() + (found.radius - wanted.radius * scale).abs();
            assert!(difference <= 1e-15, "{text}: {found:?}");
        }
        assert_eq!(packing.spheres.len(), 2, "{text}");
    }
    for (text, words) in [
        ("# a packing\n# id x y z\n1 0 0 1\n", "line 2: the comment names the columns"),
        ("# radius a b c\n1 0 0 1\n", "line 1: the comment names the columns"),
        ("# r x y z (furlong)\n1 0 0 1\n", "line 1: \"furlong\" is not a unit of length"),
    ] {
        let error = import(text.as_bytes(), None).expect_err(text).to_string();
        assert!(error.starts_with(words), "{text}: {error}");
    }
    // The file says that its numbers are in m.
    let twice = import("# x y z r (m)\n0 1 2 0.5\n".as_bytes(), Some(1e-3)).unwrap_err().to_string();
    assert!(twice.contains("so does `unit`"), "{twice}");
    // A table keeps the cell of YADE's comment.
    for text in ["##PERIODIC:: 20 20 20\n# r x y z\n0.5 0 1 2\n", "##PERIODIC:: 20 20 20\nx,y,z,r\n0,1,2,0.5\n"] {
        let packing = import(text.as_bytes(), None).unwrap();
        assert_eq!(packing.cell.map(|cell| cell.volume()), Some(8000.0), "{text}");
    }
}

/// A radius beside a diameter, as post-processors write both, is read where they agree to the digits that files have.
#[test]
fn a_diameter_may_stand_beside_the_radius() {
    let texts = [
        "x,y,z,r,d\n0,1,2,0.5,1\n-3,4,5.5,0.25,0.5\n",
        "d x y z radius\n1 0 1 2 0.5\n0.500004 -3 4 5.5 0.25\n",
        "# x y z r d\n0 1 2 0.5 1\n-3 4 5.5 0.25 0.5\n",
        "x [mm],y [mm],z [mm],r [m],d [cm]\n0,1e3,2e3,0.5,100\n-3e3,4e3,5.5e3,0.25,50\n",
        "ITEM: TIMESTEP\n0\nITEM: ATOMS x y z radius diameter\n0 1 2 0.5 1\n-3 4 5.5 0.25 0.5\n",
    ];
    for text in texts {
        assert_eq!(spheres(text), expected(), "{text}");
    }
    // A difference in the fifth digit is another size.
    assert!(
        refusal("x,y,z,r,d\n0,1,2,0.5,1.0001\n").contains("line 2: the diameter 1.0001 is not twice the radius 0.5")
    );
}

/// A data file with one section of atoms; `rows` of the two spheres.
fn data(first: &str, box_lines: &str, head: &str, rows: [&str; 2], rest: &str) -> String {
    format!(
        "{first}\n\n2 atoms\n2 atom types\n\n{box_lines}\nMasses\n\n1 1.0\n2 1.0\n\nAtoms{head}\n\n{}\n{}\n{rest}",
        rows[0], rows[1]
    )
}

const BOX: &str = "-9 9 xlo xhi\n-9 9 ylo yhi\n-9 9 zlo zhi\n";

/// Columns of atoms: number, molecule if the style has one, type, diameter, density, center.
fn rows(is_bonded: bool, flags: &str) -> [String; 2] {
    let molecule = if is_bonded { "1 " } else { "" };
    [format!("1 {molecule}1 1.0 2500 0 1 2{flags}"), format!("2 {molecule}2 0.5 2500 -3 4 5.5{flags}")]
}

#[test]
fn data_files_give_the_same_spheres_however_they_are_written() {
    let firsts = [
        "LAMMPS data file via write_data, version 2 Aug 2023, timestep = 100, units = si",
        "my atoms",
        "# made by hand: Bonds",
    ];
    let boxes = [BOX, "", "-9 9 xlo xhi\n-9 9 ylo yhi\n-9 9 zlo zhi\n0.5 0 0 xy xz yz\n"];
    let styles = [" # sphere", " # bpm/sphere", " # granular"];
    let rests = ["", "\nVelocities\n\n1 0 0 0 0 0 0\n2 0 0 0 0 0 0\n"];
    let mut count = 0;
    for choice in product(&[&firsts, &boxes, &styles, &["", " 0 0 -1", " # second"], &rests]) {
        let [first, box_lines, style, flags, rest] = choice[..] else { panic!("{choice:?}") };
        let rows = rows(style.contains("bpm"), flags);
        let text = data(first, box_lines, style, [&rows[0], &rows[1]], rest);
        assert_eq!(spheres(&text), expected(), "{text}");
        count += 1;
    }
    assert!(count >= 60, "{count}");
}

/// Atom styles of LAMMPS and LIGGGHTS whose columns are not read, and files without a style, whatever the number of their columns.
#[test]
fn other_styles_of_data_files_are_refused_by_name() {
    let styles = [
        "amoeba",
        "angle",
        "apip",
        "atomic",
        "body",
        "bond",
        "charge",
        "convexhull",
        "dielectric",
        "dipole",
        "dpd",
        "edpd",
        "electron",
        "ellipsoid",
        "full",
        "hybrid",
        "hybrid sphere bond",
        "hybrid granular bond/gran",
        "line",
        "mdpd",
        "mesont",
        "molecular",
        "oxdna",
        "peri",
        "rheo",
        "rheo/thermal",
        "smd",
        "sph",
        "spin",
        "superquadric",
        "tdpd",
        "template",
        "tri",
        "wavepacket",
    ];
    for style in styles {
        for columns in [5, 7, 8, 10] {
            let row = |id: usize| format!("{id}{}", " 1".repeat(columns - 1));
            let error = refusal(&data("atoms", BOX, &format!(" # {style}"), [&row(1), &row(2)], ""));
            let named = if style.starts_with("hybrid") { "hybrid style" } else { &format!("the atom style {style:?}") };
            assert!(error.starts_with("line 15: ") && error.contains(named), "{style}: {error}");
        }
    }
    for columns in 5..=12 {
        let row = |id: usize| format!("{id}{}", " 1".repeat(columns - 1));
        let error = refusal(&data("atoms", BOX, "", [&row(1), &row(2)], ""));
        assert!(
            error.contains("does not say its atom style") && error.contains("`Atoms # sphere`"),
            "{columns}: {error}"
        );
    }
}

#[test]
fn contradictions_in_data_files_are_refused() {
    let cases = [
        (
            ["1 1 1.0 2500 0 1 2", "2 2 0.5 2500 -3 4 9.5"],
            "line 18: z = 9.5 lies outside of the box of the header, -9 to 9",
        ),
        (["1 3 1.0 2500 0 1 2", "2 2 0.5 2500 -3 4 5.5"], "line 17: \"3\" is not a type of atom"),
        (["1 0.1 1.0 2500 0 1 2", "2 2 0.5 2500 -3 4 5.5"], "line 17: \"0.1\" is not a type of atom"),
        (["1 1 1.0 -0.8 0 1 2", "2 2 0.5 2500 -3 4 5.5"], "line 17: the density -0.8 is not positive"),
        (["1 1 0 2500 0 1 2", "2 2 0.5 2500 -3 4 5.5"], "line 17: the radius 0 is not positive"),
        (["1 1 1.0 2500 0 1", "2 2 0.5 2500 -3 4 5.5"], "line 17: expected 7 columns, or 10 with image flags, found 6"),
        // A charge and a type in the places of density and diameter.
        (["1 1 1 -0.8 0 1 2", "2 1 1 0.4 3 1 2"], "line 17: the density -0.8 is not positive"),
    ];
    for (rows, message) in cases {
        let error = refusal(&data("atoms", BOX, " # sphere", rows, ""));
        assert!(error.starts_with(message), "{error}");
    }
    let [first, second] = rows(false, "");
    for section in ["Bonds", "Angles", "Ellipsoids", "Bodies"] {
        let error = refusal(&data("atoms", BOX, " # sphere", [&first, &second], &format!("\n{section}\n\n1 1 1 2\n")));
        assert!(error.starts_with(&format!("line 20: the section `{section}` is not read")), "{error}");
    }
    let leaning = format!("{BOX}2 0 0 xy xz yz\n");
    let inside = data("atoms", &leaning, " # sphere", ["1 1 1.0 2500 10.5 1 2", "2 1 0.5 2500 0 0 0"], "");
    assert_eq!(spheres(&inside)[0].position.x, 10.5);
    let centimeters = data("LAMMPS data file, units = cgs", BOX, " # sphere", [&first, &second], "");
    assert_eq!(spheres(&centimeters)[1], Sphere { position: Vec3::new(-0.03, 0.04, 0.055), radius: 0.0025 });
}

/// A dump with given heads.
fn dump(before: &str, bounds: &str, columns: &str, rows: [&str; 2], after: &str) -> String {
    format!(
        "{before}ITEM: TIMESTEP\n5\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS {bounds}\nITEM: ATOMS {columns}\n{}\n{}\n{after}",
        rows[0], rows[1]
    )
}

#[test]
fn dumps_give_the_same_spheres_however_they_are_written() {
    let older = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: ATOMS x y z radius\n9 9 9 9\n";
    let befores = ["", "ITEM: UNITS\nsi\n", "ITEM: TIME\n0.25\n", "ITEM: UNITS\nlj\nITEM: TIME\n0\n", older];
    let bounds = ["pp pp pp\n0 1\n0 1\n0 1", "xy xz yz ff ff ff\n0 1 0\n0 1 0\n0 1 0"];
    let columns: [(&str, [&str; 2]); 5] = [
        ("id type x y z radius", ["1 1 0 1 2 0.5", "2 1 -3 4 5.5 0.25"]),
        ("id radius xu yu zu", ["1 0.5 0 1 2", "2 0.25 -3 4 5.5"]),
        ("diameter z y x", ["1 2 1 0", "0.5 5.5 4 -3"]),
        ("id x y z xu yu zu ix iy iz radius mol", ["1 0 1 2 9 9 9 0 0 0 0.5 1", "2 -3 4 5.5 9 9 9 1 0 0 0.25 1"]),
        (
            "id type type x y z vx vy vz fx fy fz omegax omegay omegaz radius id_multisphere",
            ["1 1 1 0 1 2 0 0 0 0 0 0 0 0 0 0.5 -1", "2 1 1 -3 4 5.5 0 0 0 0 0 0 0 0 0 0.25 -1"],
        ),
    ];
    let mut count = 0;
    for choice in product(&[&befores, &bounds, &["", " ", "\t"], &["", "\n", " \n\n"]]) {
        let [before, bounds, trailing, after] = choice[..] else { panic!("{choice:?}") };
        for (columns, rows) in columns {
            let rows = rows.map(|row| format!("{row}{trailing}"));
            let text = dump(before, bounds, &format!("{columns}{trailing}"), [&rows[0], &rows[1]], after);
            assert_eq!(spheres(&text), expected(), "{text}");
            count += 1;
        }
    }
    assert!(count >= 60, "{count}");
    let micro =
        dump("ITEM: UNITS\nmicro\n", "ff ff ff\n0 1\n0 1\n0 1", "x y z radius", ["0 1 2 0.5", "-3 4 5.5 0.25"], "");
    assert_eq!(spheres(&micro)[0].radius, 0.5e-6);
    assert!(import(micro.as_bytes(), Some(1e-3)).expect_err("two units").to_string().contains("remove one"));
}

/// The first wrong line is shown, and the numbers of the next ones follow; so are sizes that contradict each other.
#[test]
fn errors_name_all_wrong_lines() {
    let cases = [
        (
            "x,y,z,r\n1,2,3,4\n1,2,3,-4\n1,2,3,4\n1,two,3,4\n",
            "line 3: the radius -4 is not positive: \"1,2,3,-4\"; 1 more line is wrong: 5",
        ),
        (
            "1 2 3 -1\n1 2 3\n1 2 3 -1\n1 2 3 -1\n1 2 3 4\n1 2 3 -1\n1 2 3 -1\n1 2 3 -1\n",
            "line 1: the radius -1 is not positive: \"1 2 3 -1\"; 6 more lines are wrong: 2, 3, 4, 6, 7, ...",
        ),
        ("x,y,z,r\n1;2;3;4\n1;2;3;4\n", "line 2: expected 4 columns, found 1: \"1;2;3;4\"; 1 more line is wrong: 3"),
        (
            "2 atoms\n\nAtoms # sphere\n\n1 1 -1 9 0 0 0\n2 1 -1 9 0 0 2\n",
            "line 5: the radius -0.5 is not positive: \"1 1 -1 9 0 0 0\"; 1 more line is wrong: 6",
        ),
        (
            "ITEM: TIMESTEP\n0\nITEM: ATOMS x y z radius\n0 0 0 -1\n0 0 0 1\n0 0 nan 1\n",
            "line 4: the radius -1 is not positive: \"0 0 0 -1\"; 1 more line is wrong: 6",
        ),
        (
            "x,y,z,r,d\n1,2,3,4,8\n1,2,3,4,4\n",
            "line 3: the diameter 4 is not twice the radius 4; remove or rename one column",
        ),
        ("x [m],y [m],z [m],r [m],d\n1,2,3,4,8\n", "line 1: the columns d have no unit, but others have one"),
    ];
    for (text, message) in cases {
        let error = refusal(text);
        assert!(error.contains(message), "{text:?}: {error}");
    }
}

#[test]
fn errors_name_the_line_and_the_remedy() {
    let cases = [
        ("", "has no spheres"),
        ("# nothing\n", "has no spheres"),
        ("a,b,c\n1,2,3\n", "line 1: the header must name the columns x, y, z, and radius"),
        ("x y z\n1 2 3\n", "line 1: the header must name the columns x, y, z, and radius"),
        ("1,2,3\n", "line 1: expected the four numbers x, y, z, r, found 3"),
        (
            "0,5,1,2,0,25\n",
            "line 1: expected the four numbers x, y, z, r, found 6; name other columns in a header, write decimals with a point",
        ),
        ("0,5 1,0 2,0 0,25\n", "line 1: is neither a header nor four numbers; write decimals with a point: 0.5"),
        ("x,y,z,r\n1,2,three,4\n", "line 2: \"three\" is not a number"),
        ("x,y,z,r\n1,2,3\n", "line 2: expected 4 columns, found 3"),
        (
            "x,y,z,r\n0,5,1,2,0,25\n",
            "line 2: expected 4 columns, found 6; write decimals with a point: 0.5, or separate columns by semicolons",
        ),
        ("x y z r\n0 1 2 0.5 7\n", "line 2: expected 4 columns, found 5"),
        ("x [mile],y [m],z [m],r [m]\n1,2,3,4\n", "line 1: \"mile\" is not a unit of length"),
        ("x mass,y,z,r\n1,2,3,4\n", "line 1: \"mass\" is not a unit of length"),
        ("x [mm],y,z,radius\n1,2,3,4\n", "line 1: the columns y, z, radius have no unit, but others have one"),
        ("id,x,y,z,r [mm]\n1,2,3,4,5\n", "line 1: the columns x, y, z have no unit, but others have one"),
        ("x,x,y,z,r\n1,2,3,4,5\n", "line 1: two columns are called \"x\""),
        ("1,2,3,-4\n", "line 1: the radius -4 is not positive"),
        (
            "x,y,z,r,clump\n1,2,3,4,-1\n1,2,3,4,0\n",
            "line 3: the sphere belongs to clump 0, and a packing has no clumps",
        ),
        ("0 0 0 1 -1\n0 0 2 1 3\n", "line 2: the sphere belongs to clump 3"),
        ("2 atoms\n", "without a section `Atoms`"),
        ("ITEM: TIMESTEP\n0\nITEM: NUMBER OF ENTRIES\n0\nITEM: ENTRIES c_1\n", "a dump of LAMMPS without atoms"),
        ("ITEM: TIMESTEP\n0\nITEM: ATOMS id x y z\n1 0 0 0\n", "line 3: the dump needs the columns x y z radius"),
        (
            "ITEM: TIMESTEP\n0\nITEM: ATOMS id xs ys zs radius\n1 0 0 0 1\n",
            "line 3: the dump needs the columns x y z radius",
        ),
        ("ITEM: UNITS\ninch\nITEM: ATOMS x y z radius\n0 0 0 1\n", "line 2: \"inch\" is not a style of units"),
        (
            "ITEM: TIMESTEP\n0\nITEM: ATOMS x y z radius id_multisphere\n0 0 0 1 4\n",
            "line 4: the sphere belongs to clump 4",
        ),
        (
            "3 atoms\n\nAtoms # sphere\n\n1 1 1 9 0 0 0\n2 1 1 9 0 0 2\n",
            "counts 3 atoms, but it lists 2; is it cut off?",
        ),
        (
            "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\nITEM: ATOMS id x y z radius\n1 0 0 0 1\n",
            "counts 2 atoms, but it lists 1; is it cut off?",
        ),
        ("SQLite format 3\0...", "memoizeDb"),
        ("PK\u{3}\u{4}", "save the table as CSV"),
        ("# vtk DataFile Version 3.0\n", "a VTK file"),
        ("<?xml", "an XML file"),
        ("{\"x\": 1}", "a JSON file"),
        ("solid part\n", "an STL surface"),
        ("o part\nv 0 0 0\n", "line 1: the header must name the columns x, y, z, and radius"),
    ];
    for (text, message) in cases {
        let error = refusal(text);
        assert!(error.contains(message), "{text:?}: {error}");
    }
    let cases: [(&[u8], &str); 5] = [
        (b"\xff\xfe0\0 \0", "text in UTF-16; save it as UTF-8"),
        (b"\x1f\x8b\x08", "compressed by gzip"),
        (b"\x93NUMPY", "numpy.savetxt"),
        (b"\x89HDF\r\n\x1a\n", "extension .h5"),
        (b"0 0 0 1\n# gr\xf6\xdfe\n", "line 2: the line has bytes that are not UTF-8; save the file as UTF-8"),
    ];
    for (bytes, message) in cases {
        let error = import(bytes, None).expect_err(message).to_string();
        assert!(error.contains(message), "{error}");
    }
    let twice = import("x [mm],y [mm],z [mm],r [mm]\n1,0,0,1\n".as_bytes(), Some(1e-3)).expect_err("two units");
    assert!(twice.to_string().contains("remove one"));
}
