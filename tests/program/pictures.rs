//! What pictures of a page show is what is in the file: as many points, at their places, in the box of the specimen.

use concordem::math::Vec3;
use concordem::state::columns::{ColumnData, StoredColumn};
use tempfile::TempDir;

use crate::drawing::{attribute, between, from_base64, number, rows, section, words};
use crate::pages::page_of_prism;

/// A column of reals.
fn reals<'a>(table: &'a [(String, StoredColumn)], name: &str) -> &'a [f64] {
    match table.iter().find(|(other, _)| other == name).map(|(_, column)| &column.data) {
        Some(ColumnData::F64(data)) => data,
        _ => panic!("no reals {name}"),
    }
}

fn vectors(table: &[(String, StoredColumn)], name: &str) -> Vec<Vec3> {
    reals(table, name).chunks_exact(3).map(Vec3::from_column_slice).collect()
}

/// The numbers of a list "[1, 2]" after a key.
fn list(text: &str, key: &str) -> Vec<f64> {
    let numbers = between(text, &format!("{key}: ["), "]");
    numbers.split(',').map(|number| number.trim().parse().expect("a number")).collect()
}

/// The picture of damaged bonds has all bonds with at least half of their stiffness lost, at their places, the most damaged first.
#[test]
fn damaged_bonds_are_those_of_the_file() {
    let folder = TempDir::new().expect("a temporary folder");
    let (page, result) = page_of_prism(folder.path());
    let table = result.rows("contacts/cpm").expect("contacts");
    let (position, damage) = (vectors(&table, "position"), reals(&table, "damage"));
    let opening: Vec<f64> = vectors(&table, "branch")
        .iter()
        .zip(reals(&table, "reference_length"))
        .map(|(branch, reference)| branch.norm() - reference)
        .collect();
    let mut bonds: Vec<usize> = (0..damage.len()).filter(|&k| damage[k] >= 0.5).collect();
    bonds.sort_by(|a, b| damage[*b].total_cmp(&damage[*a]));
    let widest = bonds.iter().map(|&k| opening[k]).fold(0.0, f64::max);
    assert!(bonds.len() > 10 && widest > 0.0, "{} bonds", bonds.len());
    let part = section(&page, "Damaged bonds");
    assert!(part.contains(&format!("Each point is a damaged bond: {} bonds.", bonds.len())));
    let broken = result.samples("broken").expect("a series").last().copied().expect("records");
    assert!(part.contains(&format!(" {broken:.0} bonds broke.")));
    let data = between(part, "drawCracks(", ");</script>");
    let (size, points) = (list(data, "size"), from_base64(between(data, "points: \"", "\"")));
    let (low, high) = result.bounds().expect("readable").expect("snapshots");
    let around = |(low, high): (Vec3, Vec3), x: &Vec3| (low.inf(x), high.sup(x));
    let (low, high) = bonds.iter().map(|&k| &position[k]).fold((low, high), around);
    // Places are whole numbers; the longest edge has 10,000.
    let unit = 10_000.0 / (high - low).max();
    for (axis, size) in size.iter().enumerate() {
        assert!((size - unit * (high - low)[axis]).abs() <= 0.5, "{size:?}");
    }
    let shown: f64 = between(data, "widest: ", ",").parse().expect("a number");
    assert!((shown - 1e6 * widest).abs() < 1e-12 * shown, "{shown} µm");
    assert_eq!(points.len(), 8 * bonds.len());
    for (point, &k) in points.chunks_exact(8).zip(&bonds) {
        let place = words(&point[..6]);
        for (axis, place) in place.iter().enumerate() {
            assert!((f64::from(*place) - unit * (position[k] - low)[axis]).abs() <= 0.501, "{place:?}");
        }
        // From 0.5 to 0.999, each factor of ten in the remaining stiffness is a step of equal length.
        let shade = 255.0 * (0.5 / (1.0 - damage[k].min(0.999))).log10() / 500.0_f64.log10();
        assert!((f64::from(point[6]) - shade).abs() <= 0.501, "{} {shade}", point[6]);
        let open = 255.0 * (opening[k] / widest).clamp(0.0, 1.0).sqrt();
        assert!((f64::from(point[7]) - open).abs() <= 0.501, "{} {open}", point[7]);
    }
}

/// The deformed slice has the particles, displacements, and damage of the snapshots.
#[test]
fn deformed_slice_is_that_of_the_file() {
    let folder = TempDir::new().expect("a temporary folder");
    let (page, result) = page_of_prism(folder.path());
    let slice = result.slice(3000, 16).expect("readable").expect("snapshots");
    let data = between(section(&page, "Deformed slice"), "drawSlice(", ");</script>");
    let longest = (0..2).map(|axis| slice.bounds[1][axis] - slice.bounds[0][axis]).fold(0.0, f64::max);
    let unit = 10_000.0 / longest;
    let particles = words(&from_base64(between(data, "particles: \"", "\"")));
    assert_eq!((particles.len(), slice.count), (3 * slice.count, slice.cut));
    for (k, drawn) in particles.chunks_exact(3).enumerate() {
        let wanted =
            [slice.points[2 * k] - slice.bounds[0][0], slice.points[2 * k + 1] - slice.bounds[0][1], slice.radius[k]];
        for (drawn, wanted) in drawn.iter().zip(wanted) {
            assert!((f64::from(*drawn) - unit * wanted).abs() <= 0.501, "{drawn} {wanted}");
        }
    }
    let frames: Vec<&str> = data.split("moved: \"").skip(1).map(|rest| rest.split('"').next().expect("data")).collect();
    assert_eq!(frames.len(), result.snapshot_times().expect("times").len());
    let largest: f64 = between(data, "unit: ", ",").parse().expect("a number");
    let step = largest / 32_767.0;
    for (frame, wanted) in frames.iter().zip(&slice.frames) {
        let bytes = from_base64(frame);
        assert_eq!(bytes.len(), 5 * slice.count);
        for (k, drawn) in bytes.chunks_exact(5).enumerate() {
            for (word, wanted) in words(&drawn[..4]).iter().zip(&wanted.displacement[2 * k..]) {
                let drawn = step * f64::from(word.cast_signed());
                assert!((drawn - unit * wanted).abs() <= 0.501 * step, "{drawn} {wanted}");
            }
            assert!((f64::from(drawn[4]) - 255.0 * wanted.damage[k]).abs() <= 0.501, "{}", drawn[4]);
        }
    }
    // What moves in the file moves in the picture: the ends, apart.
    assert!(largest > 1.0, "{largest}");
}

/// The section through two materials has a circle for each particle that the plane meets; the table has all particles, and shares of 100 %.
#[test]
fn section_through_the_phases_is_that_of_the_file() {
    let folder = TempDir::new().expect("a temporary folder");
    let (page, result) = page_of_prism(folder.path());
    let table = result.rows("particles").expect("particles");
    let radius = reals(&table, "radius");
    let displacement = vectors(&table, "displacement");
    let position: Vec<Vec3> = vectors(&table, "position").iter().zip(&displacement).map(|(x, u)| x - u).collect();
    let ColumnData::U16(material) = &table.iter().find(|(name, _)| name == "material").expect("materials").1.data
    else {
        panic!("no materials")
    };
    let part = section(&page, "Phases");
    let (low, high) = (position.iter()).fold((position[0], position[0]), |(low, high), x| (low.inf(x), high.sup(x)));
    let middle = 0.5 * (low.y + high.y);
    let reach = radius.iter().copied().fold(0.0, f64::max);
    let svg = between(part, "<svg class=\"section\"", "</svg>");
    let size: Vec<f64> = attribute(svg, "viewBox").split(' ').map(|text| text.parse().expect("a number")).collect();
    let scale = size[2] / (high.x - low.x + 2.0 * reach);
    assert!((size[3] - scale * (high.z - low.z + 2.0 * reach)).abs() <= 0.5, "{size:?}");
    // Places with one decimal, from the left and from the top.
    let met: Vec<usize> = (0..position.len()).filter(|&p| (position[p].y - middle).abs() < radius[p]).collect();
    let wanted: Vec<[f64; 3]> = (met.iter())
        .map(|&p| {
            let cut = (radius[p].powi(2) - (position[p].y - middle).powi(2)).sqrt();
            [scale * (position[p].x - low.x + reach), scale * (high.z + reach - position[p].z), scale * cut]
        })
        .collect();
    let mut drawn: Vec<([f64; 3], &str)> = (svg.split("<circle").skip(1))
        .map(|circle| {
            let place = ["cx", "cy", "r"].map(|name| attribute(circle, name).parse().expect("a number"));
            (place, attribute(circle, "fill"))
        })
        .collect();
    assert_eq!(drawn.len(), wanted.len());
    // The colors of the materials stand beside their names.
    let colors: Vec<&str> = part.split("<rect").skip(1).map(|swatch| attribute(swatch, "fill")).collect();
    for (circle, &p) in wanted.iter().zip(&met) {
        let color = colors[usize::from(material[p])];
        let is_it = |other: &([f64; 3], &str)| {
            other.1 == color && other.0.iter().zip(circle).all(|(a, b)| (a - b).abs() <= 0.051)
        };
        let at = drawn.iter().position(is_it).unwrap_or_else(|| panic!("no circle at {circle:?} of {color}"));
        drawn.swap_remove(at);
    }
    let phases: Vec<Vec<String>> = rows(part).into_iter().filter(|row| row.len() == 4).collect();
    assert_eq!(phases.len(), 2, "{phases:?}");
    let mut shares = 0.0;
    for (k, row) in phases.iter().enumerate() {
        assert_eq!(row[0].trim(), ["concrete", "weak"][k]);
        assert_eq!(number(&row[1]) as usize, material.iter().filter(|other| usize::from(**other) == k).count());
        shares += number(row[2].trim_end_matches(" %"));
    }
    // Two shares, each rounded to one decimal.
    assert!((shares - 100.0).abs() <= 0.1001, "{shares}");
}
