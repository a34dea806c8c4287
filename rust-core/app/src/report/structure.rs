//! The page of a characterised packing.

use std::fmt::Write as _;

use super::chart::{Axis, Chart, ReferenceLine, Series, Style};
use super::html::{escape, frame, number, percent};
use super::rose;
use crate::characterise::Characteristics;
use crate::provenance::PROGRAM;

const COLOR: &str = "#1f6fb4";
const OTHER: &str = "#c8501e";

/// The page as text.
pub fn page(found: &Characteristics) -> String {
    let title = format!("Structure of {}", found.name);
    let body = [
        format!(
            "<h1>{}</h1>\n<p class=\"quiet\">Computed by {PROGRAM}. Links: {}.{}</p>\n",
            escape(&title),
            escape(&found.links.text()),
            found.boundary_depth.map_or_else(
                || " Periodic packing.".to_owned(),
                |depth| format!(
                    " Spheres with their centers less than {} m below the surface are the boundary.",
                    number(depth)
                )
            )
        ),
        table(found),
        directions(found),
        links(found),
        density(found),
        order(found),
        phases(found),
    ]
    .concat();
    frame(&title, &body)
}

/// A row of a table: name and value.
type Row = (String, String);

fn table(found: &Characteristics) -> String {
    let c = &found.network.coordination;
    let d = &found.density;
    let row = |name: &str, value: String| (name.to_owned(), value);
    let mut rows = vec![
        row("Spheres", found.spheres.to_string()),
        row("Links", found.network.links.to_string()),
        row("Links per sphere inside, (2 N<sub>ii</sub> + N<sub>ib</sub>)/N<sub>i</sub>", number(c.inside)),
    ];
    if found.boundary_depth.is_some() {
        rows.push(row("Links per sphere at the boundary", number(c.at_boundary)));
        rows.push(row("Spheres inside", c.particles_inside.to_string()));
    }
    rows.push(row("2C/N of all spheres", number(c.of_all)));
    rows.push(row("Spheres without link", c.without.to_string()));
    for (name, value) in [("periodic cell", d.cell), ("convex hull", d.hull), ("shape", d.shape)] {
        if let Some([_, fraction]) = value {
            rows.push(row(&format!("Solid fraction of the {name}"), number(fraction)));
        }
    }
    if let Some(fraction) = d.effective {
        rows.push(row("Effective solid fraction (spheres inside, power cells)", number(fraction)));
    }
    rows.push(row("Mean radius", format!("{} m", number(found.sizes.mean))));
    rows.push(row("Dispersion κ = (R<sub>max</sub> − R<sub>min</sub>)/R̄", percent(found.sizes.dispersion)));
    let [mean, largest] = found.network.overlap;
    rows.push(row("Overlap over sum of radii, mean and largest", format!("{}, {}", number(mean), number(largest))));
    two_columns(&rows)
}

fn two_columns(rows: &[Row]) -> String {
    let line = |(name, value): &Row| format!("<tr><td>{name}</td><td class=\"number\">{value}</td></tr>\n");
    format!("<table>\n{}</table>\n", rows.iter().map(line).collect::<String>())
}

/// Numbers in classes as an outline of bars.
fn histogram(id: &str, title: &str, label: &str, classes: &[(f64, f64)], unit: f64) -> String {
    let half = if classes.len() > 1 {
        0.5 * (classes[1].0 - classes[0].0)
    } else {
        classes.first().map_or(1.0, |c| (0.01 * c.0.abs()).max(1e-6))
    };
    let mut points = Vec::new();
    for &(middle, value) in classes {
        points.extend([(unit * (middle - half), value), (unit * (middle + half), value)]);
    }
    if let (Some(first), Some(last)) = (points.first().copied(), points.last().copied()) {
        points.insert(0, (first.0, 0.0));
        points.push((last.0, 0.0));
    }
    let series = vec![series(title, COLOR, points)];
    let chart = Chart {
        id: id.to_owned(),
        title: title.to_owned(),
        x: Axis::new(label),
        y: Axis::new("number"),
        series,
        ..Chart::default()
    };
    format!("<div><h3>{}</h3>{}</div>\n", escape(title), chart.html())
}

fn series(name: &str, color: &'static str, points: Vec<(f64, f64)>) -> Series {
    Series { name: name.to_owned(), color, style: Style::Line, points, in_legend: true, marks_peak: false }
}

fn counted(classes: &[(f64, u64)]) -> Vec<(f64, f64)> {
    classes.iter().map(|(middle, n)| (*middle, *n as f64)).collect()
}

fn directions(found: &Characteristics) -> String {
    let o = &found.network.orientations;
    if o.links == 0 {
        return "<h2>Directions</h2>\n<p>There are no links between two spheres inside.</p>\n".to_owned();
    }
    let densities = o.densities();
    let mut classes: Vec<(f64, f64)> = (0..40).map(|k| (0.05 * (f64::from(k) + 0.5), 0.0)).collect();
    for density in &densities {
        classes[((density / 0.05) as usize).min(39)].1 += 1.0;
    }
    let both = |value: f64| format!("{} ({} percent²)", number(value), number(1e4 * value));
    let mut rows = vec![
        ("Links between two spheres inside".to_owned(), o.links.to_string()),
        ("e = (1/N) Σ (f<sub>i</sub> − 1/N)²".to_owned(), both(o.deviation())),
        ("Floor: e of isotropy, because the faces differ by −7 to +19 %".to_owned(), both(o.floor)),
        ("e less the floor".to_owned(), both(o.deviation() - o.floor)),
        ("Deviation from the solid angles of the faces".to_owned(), both(o.deviation_from_isotropy())),
        ("The same for as many independent isotropic links".to_owned(), both(o.noise())),
        ("Ratio of the two (isotropic: 1 ± 0.3)".to_owned(), number(o.deviation_from_isotropy() / o.noise())),
    ];
    if let Some((_, [low, middle, high])) = found.network.fabric {
        let text = format!("{}, {}, {}", number(low), number(middle), number(high));
        rows.push(("Eigenvalues of the fabric tensor (isotropic: ⅓)".to_owned(), text));
    }
    format!(
        "<h2>Directions</h2>\n<div class=\"pair\">\n<div><h3>Rose of the links</h3>{}\
         <p class=\"quiet\">Faces at a distance from the middle that is the density of links, over that of isotropy (circle; longest \
         1.8). Red: more, blue: fewer links.</p></div>\n<div>{}</div>\n{}</div>\n",
        rose::svg(&densities, "Rose of the directions of the links"),
        two_columns(&rows),
        histogram("densities", "Density of links on the 320 faces, over that of isotropy", "density", &classes, 1.0),
    )
}

fn links(found: &Characteristics) -> String {
    let sizes = &found.sizes;
    let count = sizes.counts.len() as f64;
    let width = (sizes.largest - sizes.smallest) / count;
    let radii: Vec<(f64, f64)> = (sizes.counts.iter().enumerate())
        .map(|(k, n)| (if width > 0.0 { sizes.smallest + (k as f64 + 0.5) * width } else { sizes.mean }, *n as f64))
        .collect();
    let mut html = String::from("<h2>Lengths</h2>\n<div class=\"pair\">\n");
    html += &histogram("radii", "Radii", "radius, mm", &radii, 1e3);
    if found.network.length.is_some() {
        let stretch = |(ratio, n): &(f64, u64)| (ratio - 1.0, *n as f64);
        let lengths: Vec<(f64, f64)> = found.network.lengths.iter().map(stretch).collect();
        html += &histogram("lengths", "Links between two spheres inside", "length / sum of radii − 1", &lengths, 1.0);
    }
    html + "</div>\n"
}

fn density(found: &Characteristics) -> String {
    let mut html = String::from("<h2>Density</h2>\n<div class=\"pair\">\n");
    if let Some(layers) = &found.layers {
        let in_radii = 1.0 / found.sizes.mean;
        let place = |values: &[f64]| layers.depth.iter().map(|d| d * in_radii).zip(values.iter().copied()).collect();
        let line = |value: Option<f64>, name: &str| value.map(|value| ReferenceLine { name: name.to_owned(), value });
        let finite = |value: f64| value.is_finite().then_some(value);
        let fraction = Chart {
            id: "fraction-by-depth".to_owned(),
            title: "Solid fraction by depth".to_owned(),
            x: Axis::new("depth below the surface / mean radius"),
            y: Axis::new("solid fraction"),
            series: vec![series("layers", COLOR, place(&layers.solid_fraction))],
            reference_lines: line(finite(layers.deeper), "deeper").into_iter().collect(),
            legend: true,
        };
        let number = Chart {
            id: "links-by-depth".to_owned(),
            title: "Links per sphere by depth".to_owned(),
            x: Axis::new("depth of the center / mean radius"),
            y: Axis::new("links per sphere"),
            series: vec![series("layers", OTHER, place(&layers.links))],
            reference_lines: line(finite(found.network.coordination.inside), "inside").into_iter().collect(),
            legend: true,
        };
        let _ = writeln!(html, "<div><h3>Solid fraction by depth</h3>{}</div>", fraction.html());
        let _ = writeln!(html, "<div><h3>Links per sphere by depth</h3>{}</div>", number.html());
    }
    if let Some(cells) = &found.density.cells {
        let classes = counted(&cells.histogram);
        html += &histogram("cells", "Solid fraction of the power cells inside", "solid fraction", &classes, 1.0);
    }
    html + "</div>\n"
}

fn order(found: &Characteristics) -> String {
    let Some(g) = &found.pair_correlation else { return String::new() };
    let in_radii = 1.0 / found.sizes.mean;
    let points = g.distance.iter().map(|r| r * in_radii).zip(g.g.iter().copied()).collect();
    let chart = Chart {
        id: "pair-correlation".to_owned(),
        title: "Pair correlation".to_owned(),
        x: Axis::new("distance / mean radius"),
        y: Axis::new("g"),
        series: vec![series("g", COLOR, points)],
        reference_lines: vec![ReferenceLine { name: "no order".to_owned(), value: 1.0 }],
        legend: true,
    };
    format!("<h2>Order</h2>\n<div class=\"pair\">\n<div><h3>Pair correlation</h3>{}</div>\n</div>\n", chart.html())
}

fn phases(found: &Characteristics) -> String {
    if found.phases.len() < 2 {
        return String::new();
    }
    let mut html = String::from(
        "<h2>Phases</h2>\n<table>\n<tr><th>Material</th><th class=\"number\">Spheres</th><th class=\"number\">Share of the solid</th>\
         <th class=\"number\">Aggregates or fibers</th><th class=\"number\">Links per sphere</th></tr>\n",
    );
    for phase in &found.phases {
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td>\
             <td class=\"number\">{}</td></tr>",
            escape(&phase.name),
            phase.particles,
            percent(phase.share),
            phase.aggregates,
            number(phase.links)
        );
    }
    html += "</table>\n";
    if let Some([mortar, within, between, apart]) = found.links_by_phase {
        let _ = writeln!(
            html,
            "<p>Links within the mortar {mortar}, within aggregates or fibers {within}, between mortar and these {between}, between \
             two of these {apart}.</p>"
        );
    }
    html
}
