//! Section of the report: forces of laboratory tests over what the laboratory measures, the motion of plates or rollers and the opening of a
//! notch.

use std::fmt::Write as _;

use super::chart::{Axis, Chart, Series, Style};
use super::html::escape;
use super::laboratory::Test;
use super::samples::at_step;
use super::{OutputError, Run};
use concordem_solver::state::columns::ColumnData;

/// A curve of force over displacement.
struct Curve {
    id: String,
    heading: String,
    /// Label of the abscissa, and factor from m.
    x: (String, f64),
    /// Displacements, m, and forces, N; per meter of depth in two dimensions.
    points: Vec<(f64, f64)>,
}

/// Charts of all runs that are tests with forces; empty without any.
pub(super) fn section(runs: &[Run]) -> Result<String, OutputError> {
    let mut html = String::new();
    for (k, run) in runs.iter().enumerate() {
        for curve in curves(run, k)? {
            let of = if runs.len() > 1 { format!(", {}", run.label()) } else { String::new() };
            let heading = escape(&format!("{}{of}", curve.heading));
            let _ = writeln!(html, "<div><h3>{heading}</h3>{}</div>", curve.chart(run).html());
        }
    }
    Ok(if html.is_empty() {
        html
    } else {
        format!("<h2>Force and displacement</h2>\n<div class=\"pair\">\n{html}</div>\n")
    })
}

fn curves(run: &Run, k: usize) -> Result<Vec<Curve>, OutputError> {
    let over_strain = |displacement: f64, force: f64| -> Vec<(f64, f64)> {
        run.history.strain.iter().zip(&run.history.stress).map(|(e, s)| (e * displacement, s * force)).collect()
    };
    let curve = |name: &str, heading: &str, label: &str, points: Vec<(f64, f64)>| Curve {
        id: format!("force-{k}-{name}"),
        heading: heading.to_owned(),
        x: (format!("{label}, mm"), 1e3),
        points,
    };
    Ok(match run.test {
        // The strain is the approach of the plates over their distance, negative.
        Some(Test::Splitting { area }) => {
            let Some(distance) = run.length else { return Ok(Vec::new()) };
            let points = over_strain(-distance, area);
            vec![curve("plates", "Force of a plate over the approach of the plates", "approach of the plates", points)]
        }
        Some(Test::Flexure(beam)) => {
            let points = over_strain(beam.deflection_per_strain(), beam.force_per_stress());
            let mut all = vec![curve("rollers", "Force over the deflection", "deflection under the rollers", points)];
            for gauge in &run.gauges {
                all.extend(over_gauge(run, k, gauge, beam.force_per_stress())?);
            }
            all
        }
        _ => Vec::new(),
    })
}

/// Force over the elongation of a gauge, such as the opening of the mouth of a notch; `None` if the result lacks it.
fn over_gauge(run: &Run, k: usize, gauge: &str, force: f64) -> Result<Option<Curve>, OutputError> {
    if !run.file.has_series("step") || !run.file.operators()?.iter().any(|operator| operator == gauge) {
        return Ok(None);
    }
    let table = run.file.rows(&format!("samples/{gauge}"))?;
    let column = |name: &str| {
        let (_, column) = table.iter().find(|(other, _)| other == name)?;
        match &column.data {
            ColumnData::F64(data) => Some(data.clone()),
            ColumnData::U64(data) => Some(data.iter().map(|&number| number as f64).collect()),
            _ => None,
        }
    };
    let (Some(at), Some(elongation)) = (column("step"), column("elongation")) else { return Ok(None) };
    let (steps, stress) = (run.file.samples("step")?, run.file.samples("stress")?);
    let points = at.iter().zip(elongation).map(|(at, u)| (u, force * at_step(&steps, &stress, *at))).collect();
    Ok(Some(Curve {
        id: format!("force-{k}-{}", super::samples::identifier(gauge)),
        heading: format!("Force over the elongation of “{gauge}”"),
        x: (format!("elongation of “{gauge}”, µm"), 1e6),
        points,
    }))
}

impl Curve {
    fn chart(&self, run: &Run) -> Chart {
        let largest = self.points.iter().fold(0.0_f64, |most, point| most.max(point.1.abs()));
        let (unit, scale) = if largest < 1e3 { ("N", 1.0) } else { ("kN", 1e-3) };
        let per_depth = if run.is_plane { "/m" } else { "" };
        let (label, factor) = &self.x;
        let series = Series {
            name: run.name.clone(),
            color: run.color,
            style: Style::Line,
            points: self.points.iter().map(|(u, force)| (u * factor, force * scale)).collect(),
            in_legend: false,
            marks_peak: true,
        };
        Chart {
            id: self.id.clone(),
            title: format!("{} of {}", self.heading, run.name),
            x: Axis::new(label),
            y: Axis::new(&format!("force, {unit}{per_depth}")),
            series: vec![series],
            ..Chart::default()
        }
    }
}
