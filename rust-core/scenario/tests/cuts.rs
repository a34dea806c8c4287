//! Cuts: numbers of severed bonds on lattices, removed particles, periodic images, messages.

use std::path::Path;

use concordem_scenario::assembly::{Assembly, assemble};
use concordem_scenario::schema::Scenario;

fn assembled(text: &str) -> Assembly {
    let scenario = Scenario::parse("test.toml", text).unwrap_or_else(|error| panic!("{error}"));
    assemble(&scenario, Path::new(""), &mut |_, _| ()).unwrap_or_else(|error| panic!("{error}"))
}

/// A cubic lattice of `n³` touching spheres of radius 1 mm, bonded, the first one in the origin; with a cell of its size or without.
fn cube(n: usize, periodic: bool, cuts: &str) -> String {
    let mut spheres = Vec::new();
    for i in 0..n * n * n {
        let x = [i % n, i / n % n, i / (n * n)].map(|k| 2 * k);
        spheres.push(format!("[\"{} mm\", \"{} mm\", \"{} mm\", \"1 mm\"]", x[0], x[1], x[2]));
    }
    let cell = if periodic { format!("cell = [\"{0} mm\", \"{0} mm\", \"{0} mm\"]", 2 * n) } else { String::new() };
    format!(
        "version = 1
        [packing]
        kind = \"spheres\"
        spheres = [{}]
        {cell}
        [[material]]
        name = \"m\"
        density = 2500
        linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 5e5 }}
        [bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.01
        [contacts]
        law = \"linear_bond\"
        [stop]
        steps = 1
        {cuts}",
        spheres.join(", ")
    )
}

fn cut(shape: &str) -> String {
    format!("[[cut]]\nshape = {{ {shape} }}\n")
}

/// Bonds of the cube without cuts: three directions, `n²(n − 1)` each.
const ALL: usize = 3 * 16 * 3;

/// Surfaces between two layers sever one bond per pair of particles, on the whole section or on a part of it. A surface through the
/// centers of a layer separates this layer from one neighbor, not from both.
#[test]
fn surfaces_sever_what_crosses_them() {
    let plane = |x: &str, y: &str| {
        cut(&format!(
            "kind = \"parallelogram\", corner = [\"{x}\", \"-1 mm\", \"-1 mm\"], edges = [[0, \"{y}\", 0], [0, 0, \"9 mm\"]]"
        ))
    };
    for (cuts, severed) in [
        (plane("3 mm", "9 mm"), 16),
        (plane("3 mm", "4 mm"), 8),
        (plane("4 mm", "9 mm"), 16),
        (plane("3 mm", "9 mm") + &plane("3 mm", "4 mm"), 16),
        (plane("3 mm", "9 mm") + &plane("1 mm", "4 mm"), 24),
    ] {
        let summary = assembled(&cube(4, false, &cuts)).summary;
        assert_eq!((summary.bonds, summary.warnings.len()), (ALL - severed, 0), "{cuts}");
    }
    let idle = assembled(&cube(4, false, &plane("7 mm", "9 mm"))).summary;
    assert!(idle.bonds == ALL && idle.warnings[0].to_string().contains("crosses no bond"), "{:?}", idle.warnings);
}

/// Solids sever the bonds that reach into them, and remove the particles with their centers inside.
#[test]
fn solids_sever_and_remove() {
    // A slit between two layers; a box, a sphere, and a cylinder around the center (2, 2, 2) mm: six bonds. A cylinder along a row: its
    // three bonds, and four to the sides of each of its particles.
    for (shape, severed, removed) in [
        ("kind = \"box\", minimum = [\"2.9 mm\", -1, -1], maximum = [\"3.1 mm\", 1, 1]", 16, 0),
        (
            "kind = \"box\", minimum = [\"1.5 mm\", \"1.5 mm\", \"1.5 mm\"], maximum = [\"2.5 mm\", \"2.5 mm\", \"2.5 mm\"]",
            6,
            1,
        ),
        ("kind = \"sphere\", center = [\"2 mm\", \"2 mm\", \"2 mm\"], radius = \"0.5 mm\"", 6, 1),
        ("kind = \"cylinder\", center = [\"2 mm\", \"2 mm\", \"2 mm\"], radius = \"0.5 mm\", length = \"1 mm\"", 6, 1),
        ("kind = \"cylinder\", center = [\"2 mm\", \"2 mm\", 0], radius = \"0.5 mm\"", 3 + 4 * 4, 4),
        ("kind = \"cylinder\", center = [0, \"2 mm\", \"2 mm\"], axis = \"x\", radius = \"0.5 mm\"", 3 + 4 * 4, 4),
    ] {
        let kept = assembled(&cube(4, false, &cut(shape)));
        assert_eq!((kept.summary.bonds, kept.summary.particles), (ALL - severed, 64), "{shape}");
        let thinned = assembled(&cube(4, false, &(cut(shape) + "remove_particles = true")));
        assert_eq!((thinned.summary.bonds, thinned.summary.particles), (ALL - severed, 64 - removed), "{shape}");
        let mut ids = thinned.state.particles.id.clone();
        ids.sort_unstable();
        assert!(ids.iter().copied().eq(0..64 - removed as u32), "particles are numbered without gaps");
    }
}

/// In a periodic cell all images of a shape cut: between the last layer and the image of the first one, and wherever the shape lies.
#[test]
fn images_of_a_shape_cut() {
    let all = 3 * 64;
    for x in [7.0, -1.0, 3.0, 3.0 + 24.0, -5.0 - 8.0] {
        let plane = cut(&format!(
            "kind = \"parallelogram\", corner = [\"{x} mm\", \"-1 mm\", \"-1 mm\"], edges = [[0, \"8 mm\", 0], [0, 0, \"8 mm\"]]"
        ));
        assert_eq!(assembled(&cube(4, true, &plane)).summary.bonds, all - 16, "{x}");
        let sphere =
            cut(&format!("kind = \"sphere\", center = [\"{} mm\", 0, \"8 mm\"], radius = \"0.5 mm\"", x + 1.0));
        let thinned = assembled(&cube(4, true, &(sphere + "remove_particles = true"))).summary;
        assert_eq!((thinned.bonds, thinned.particles), (all - 6, 63), "{x}");
    }
}

/// A line cuts discs; a center on the line belongs to its left side.
#[test]
fn lines_cut_discs() {
    let discs = |line: &str| {
        let spheres: Vec<String> =
            (0..25).map(|k| format!("[\"{} mm\", \"{} mm\", 0, \"1 mm\"]", 2 * (k % 5), 2 * (k / 5))).collect();
        format!(
            "version = 1
            dimension = 2
            [packing]
            kind = \"spheres\"
            spheres = [{}]
            [[material]]
            name = \"m\"
            density = 2500
            linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 5e5 }}
            [bonds]
            law = \"linear_bond\"
            interaction_ratio = 1.01
            [contacts]
            law = \"linear_bond\"
            [stop]
            steps = 1
            [[cut]]
            shape = {{ kind = \"line\", {line} }}",
            spheres.join(", ")
        )
    };
    for (line, severed) in [
        ("from = [\"3 mm\", \"-1 mm\"], to = [\"3 mm\", \"9 mm\"]", 5),
        ("from = [\"3 mm\", \"-1 mm\"], to = [\"3 mm\", \"3 mm\"]", 2),
        // Through centers of the third column, upwards: they stay with the left side.
        ("from = [\"4 mm\", \"-1 mm\"], to = [\"4 mm\", \"9 mm\"]", 5),
        // A diagonal crosses two bonds per cell.
        ("from = [\"-1 mm\", \"0 mm\"], to = [\"8 mm\", \"9 mm\"]", 8),
    ] {
        assert_eq!(assembled(&discs(line)).summary.bonds, 40 - severed, "{line}");
    }
}

/// Whether a point lies in a solid.
type Inside = fn(f64, f64, f64) -> bool;

/// The bonds of a cut sphere, box, and cylinder are those of which a fine row of points has one inside.
#[test]
fn solids_agree_with_points() {
    let text = |cuts: &str| {
        format!(
            "version = 1
            [packing]
            kind = \"random-dense\"
            count = 300
            radius = \"1 mm\"
            seed = 3
            shape = {{ kind = \"box\", size = [\"12 mm\", \"12 mm\", \"12 mm\"] }}
            [[material]]
            name = \"m\"
            density = 2500
            linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 5e5 }}
            [bonds]
            law = \"linear_bond\"
            interaction_ratio = 1.3
            [contacts]
            law = \"linear_bond\"
            [stop]
            steps = 1
            {cuts}"
        )
    };
    let whole = assembled(&text(""));
    let cases: [(&str, Inside); 3] = [
        ("kind = \"sphere\", center = [\"1 mm\", \"2 mm\", 0], radius = \"2.5 mm\"", |x, y, z| {
            (x - 1e-3).powi(2) + (y - 2e-3).powi(2) + z * z <= 2.5e-3_f64.powi(2)
        }),
        (
            "kind = \"box\", minimum = [\"-2 mm\", \"-1 mm\", \"0.5 mm\"], maximum = [\"3 mm\", \"1.5 mm\", \"2 mm\"]",
            |x, y, z| (-2e-3..=3e-3).contains(&x) && (-1e-3..=1.5e-3).contains(&y) && (0.5e-3..=2e-3).contains(&z),
        ),
        (
            "kind = \"cylinder\", center = [\"1 mm\", 0, \"-1 mm\"], axis = \"y\", radius = \"1.5 mm\", length = \"5 mm\"",
            |x, y, z| (x - 1e-3).hypot(z + 1e-3) <= 1.5e-3 && y.abs() <= 2.5e-3,
        ),
    ];
    let positions = &whole.state.particles.position;
    let bonds = whole.state.bonds[0].contacts();
    for (shape, inside) in cases {
        let crosses = |k: usize| {
            let pair = bonds.view(k).pair;
            let (p, q) = (positions[pair.a as usize], positions[pair.b as usize]);
            (0..=2000).map(|s| p + (q - p) * (f64::from(s) / 2000.0)).any(|x| inside(x.x, x.y, x.z))
        };
        let severed = (0..bonds.len()).filter(|&k| crosses(k)).count();
        let left = assembled(&text(&cut(shape))).summary.bonds;
        // A bond that only grazes a solid can pass between two points.
        assert!(
            severed > 20 && (bonds.len() - left).abs_diff(severed) <= 1,
            "{shape}: {severed} {}",
            bonds.len() - left
        );
    }
}

#[test]
fn impossible_cuts_are_refused() {
    for (cuts, words) in [
        ("[[cut]]\nshape = { kind = \"line\", from = [0, 0], to = [1, 0] }", "cuts only in two dimensions"),
        (
            "[[cut]]\nshape = { kind = \"parallelogram\", corner = [0, 0, 0], edges = [[1, 0, 0], [2, 0, 0]] }",
            "the edges span no area",
        ),
        (
            "[[cut]]\nremove_particles = true\nshape = { kind = \"parallelogram\", corner = [0, 0, 0], edges = [[1, 0, 0], [0, 1, 0]] }",
            "this shape has no inside",
        ),
        ("[[cut]]\nshape = { kind = \"facets\", path = \"no such file.stl\" }", ""),
    ] {
        let text = cube(2, false, cuts);
        let message = match Scenario::parse("test.toml", &text) {
            Err(error) => error.to_string(),
            Ok(scenario) => match assemble(&scenario, Path::new(""), &mut |_, _| ()) {
                Err(error) => error.to_string(),
                Ok(_) => panic!("{cuts} is taken"),
            },
        };
        assert!(message.contains(words), "{message}");
    }
}
