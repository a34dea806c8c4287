//! Section of the report: the materials of the particles, in a section through the specimen.

use std::fmt::Write as _;

use super::Run;
use super::html::{escape, number, percent};
use crate::output::{OutputError, ResultFile};
use concordem_contact::math::Vec3;
use concordem_solver::state::columns::ColumnData;

/// Colors of the materials, the first one light: it is that of the mortar.
const COLORS: [&str; 6] = ["#ddd8cb", "#6b5847", "#a8794e", "#5f7f6a", "#4f6d8f", "#8c5a72"];
/// Largest number of circles in a picture.
const MOST_CIRCLES: usize = 20_000;
/// Width of a picture.
const WIDTH: f64 = 420.0;

/// The particles of a result before the run, or at its end if it has no displacements.
struct Particles {
    position: Vec<Vec3>,
    radius: Vec<f64>,
    material: Vec<u16>,
    /// Number of the aggregate of each particle; empty without aggregates.
    aggregate: Vec<u32>,
}

/// Pictures and tables of the runs with more than one material; empty if there is none.
pub(super) fn section(runs: &[Run]) -> Result<String, OutputError> {
    let mut html = String::new();
    for run in runs {
        let particles = Particles::read(run.file);
        let last = particles.material.iter().copied().max().unwrap_or(0);
        if last == 0 {
            continue;
        }
        let names = names(run.file)?;
        let name =
            |material: u16| names.get(usize::from(material)).cloned().unwrap_or_else(|| format!("material {material}"));
        let _ = writeln!(
            html,
            "<h3>{}</h3>\n<div class=\"pair\">\n<div>{}</div>",
            escape(&run.label()),
            particles.picture(&name)
        );
        let _ = writeln!(html, "<div>{}</div>\n</div>", particles.table(last, &name));
    }
    Ok(if html.is_empty() { html } else { format!("<h2>Phases</h2>\n{html}") })
}

/// Names of the materials in the scenario of a result.
fn names(file: &ResultFile) -> Result<Vec<String>, OutputError> {
    let scenario = toml::from_str::<toml::Table>(&file.scenario()?).unwrap_or_default();
    let materials = scenario.get("material").and_then(toml::Value::as_array);
    let name = |material: &toml::Value| material.get("name").and_then(toml::Value::as_str).unwrap_or("").to_owned();
    Ok(materials.map_or_else(Vec::new, |list| list.iter().map(name).collect()))
}

impl Particles {
    fn read(file: &ResultFile) -> Self {
        // A result without particles, as other programs may write, has no phases.
        let table = file.rows("particles").unwrap_or_default();
        let column = |name: &str| table.iter().find(|(column, _)| column == name).map(|(_, column)| &column.data);
        let reals = |name: &str| match column(name) {
            Some(ColumnData::F64(data)) => data.as_slice(),
            _ => &[],
        };
        let vectors = |name: &str| reals(name).chunks_exact(3).map(Vec3::from_column_slice).collect::<Vec<_>>();
        let mut position = vectors("position");
        for (x, u) in position.iter_mut().zip(vectors("displacement")) {
            *x -= u;
        }
        let material = match column("material") {
            Some(ColumnData::U16(data)) => data.clone(),
            _ => Vec::new(),
        };
        let aggregate = match column("aggregate") {
            Some(ColumnData::U32(data)) => data.clone(),
            _ => Vec::new(),
        };
        Self { position, radius: reals("radius").to_vec(), material, aggregate }
    }

    /// Particles, share of the volume, and number of aggregates of each material.
    fn table(&self, last: u16, name: &dyn Fn(u16) -> String) -> String {
        let planar = self.position.iter().all(|x| x.z == self.position[0].z);
        let measure = |r: &f64| if planar { r * r } else { r * r * r };
        let total: f64 = self.radius.iter().map(measure).sum();
        let mut html = String::from(
            "<table>\n<tr><th>Material</th><th>Particles</th><th>Share of the solid</th><th>Aggregates or fibers</th></tr>\n",
        );
        for material in 0..=last {
            let own = || (0..self.material.len()).filter(|&p| self.material[p] == material);
            let share = own().map(|p| measure(&self.radius[p])).sum::<f64>() / total;
            let mut numbers: Vec<u32> =
                own().filter_map(|p| self.aggregate.get(p).copied()).filter(|n| *n > 0).collect();
            numbers.sort_unstable();
            numbers.dedup();
            let aggregates = if numbers.is_empty() { "–".to_owned() } else { numbers.len().to_string() };
            let _ = writeln!(
                html,
                "<tr><td><svg class=\"swatch\" width=\"12\" height=\"12\" aria-hidden=\"true\"><rect width=\"12\" height=\"12\" \
                 fill=\"{}\"/></svg> {}</td><td>{}</td><td>{}</td><td>{aggregates}</td></tr>",
                color(material),
                escape(&name(material)),
                own().count(),
                percent(share)
            );
        }
        html + "</table>\n"
    }

    /// Circles in which the particles meet a plane through the middle: y is constant, or z of a plane packing.
    fn picture(&self, name: &dyn Fn(u16) -> String) -> String {
        let low = self.position.iter().fold(Vec3::repeat(f64::INFINITY), |low, x| low.inf(x));
        let high = self.position.iter().fold(Vec3::repeat(f64::NEG_INFINITY), |high, x| high.sup(x));
        let (across, up, plane) = if high.z == low.z { (0, 1, 2) } else { (0, 2, 1) };
        let middle = 0.5 * (low[plane] + high[plane]);
        let mut circles = Vec::new();
        for ((x, &r), &material) in self.position.iter().zip(&self.radius).zip(&self.material) {
            let square = r * r - (x[plane] - middle) * (x[plane] - middle);
            if square > 0.0 {
                circles.push((x[across], x[up], square.sqrt(), material));
            }
        }
        let whole = circles.len();
        circles.truncate(MOST_CIRCLES);
        let reach = self.radius.iter().copied().fold(0.0, f64::max);
        let width = high[across] - low[across] + 2.0 * reach;
        let height = high[up] - low[up] + 2.0 * reach;
        let scale = WIDTH / width;
        let about = format!(
            "Section {} = {} m through the particles, colored by material: {}",
            ["x", "y", "z"][plane],
            number(middle),
            (0..=self.material.iter().copied().max().unwrap_or(0)).map(name).collect::<Vec<_>>().join(", ")
        );
        let mut svg = format!(
            "<svg class=\"section\" viewBox=\"0 0 {WIDTH} {:.0}\" role=\"img\" aria-label=\"{}\">\n",
            height * scale,
            escape(&about)
        );
        for (x, y, r, material) in &circles {
            let _ = writeln!(
                svg,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{:.1}\" fill=\"{}\"/>",
                (x - low[across] + reach) * scale,
                (high[up] + reach - y) * scale,
                r * scale,
                color(*material)
            );
        }
        let shown = if whole > circles.len() {
            format!(" The first {MOST_CIRCLES} of {whole} circles.")
        } else {
            String::new()
        };
        svg + &format!(
            "</svg>\n<p class=\"quiet\">Particles in the plane {} = {} m before the run.{shown}</p>\n",
            ["x", "y", "z"][plane],
            number(middle)
        )
    }
}

fn color(material: u16) -> &'static str {
    COLORS[usize::from(material) % COLORS.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of 27 spheres, one corner of them an aggregate: the plane through the middle meets nine circles, and the table counts
    /// particles, volumes, and aggregates.
    #[test]
    fn section_and_shares_of_a_cube() {
        let mut particles =
            Particles { position: Vec::new(), radius: vec![1.0; 27], material: vec![0; 27], aggregate: vec![0; 27] };
        for i in 0..27_u32 {
            particles.position.push(Vec3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9)) * 2.0);
        }
        for p in [0, 3, 6] {
            particles.material[p] = 1;
            particles.aggregate[p] = 1 + u32::from(p == 6);
        }
        particles.radius[3] = 0.5;
        let name = |material: u16| ["mortar", "a < b"][usize::from(material)].to_owned();
        let picture = particles.picture(&name);
        assert_eq!(picture.matches("<circle").count(), 9);
        // Of the three particles of the aggregates, the second one lies in the plane.
        assert_eq!(picture.matches(COLORS[1]).count(), 1);
        let table = particles.table(1, &name);
        // 2.125 of 26.125 volumes.
        assert!(table.contains("a &lt; b</td><td>3</td><td>8.1 %</td><td>2</td>"), "{table}");
        assert!(table.contains("mortar</td><td>24</td><td>91.9 %</td><td>–</td>"), "{table}");
    }
}
