//! Section of the report: temperatures over time, and a section through the body at the end.

use std::fmt::Write as _;

use super::chart::{Axis, Chart, Series, Style, side_by_side};
use super::pictures::temperatures;
use super::{OutputError, Run};
use crate::output::frames::Frames;
use concordem_solver::state::columns::ColumnData;

/// Colors of the lowest, mean, and highest temperature.
const COLORS: [&str; 3] = ["#1f6fb4", "#1f262d", "#c8501e"];

/// Temperatures of every run with heat conduction; empty without any.
pub(super) fn section(runs: &[Run]) -> Result<String, OutputError> {
    let mut html = String::new();
    for (k, run) in runs.iter().enumerate() {
        if run.scenario.as_ref().is_none_or(|scenario| scenario.heat.is_none())
            || !run.file.has_series("mean_temperature")
        {
            continue;
        }
        let of = if runs.len() > 1 { format!(", {}", run.label()) } else { String::new() };
        let heading = format!("Temperature over time{of}");
        let pairs = [(heading, chart(run, k)?)];
        html += &side_by_side(
            "Temperature",
            &pairs,
            "The lowest and the highest temperature of a particle come from the snapshots.",
        );
        let _ = writeln!(html, "<div class=\"pair\">\n{}</div>", temperatures(run));
    }
    Ok(html)
}

fn chart(run: &Run, k: usize) -> Result<Chart, OutputError> {
    let (time, mean) = (run.file.samples("time")?, run.file.samples("mean_temperature")?);
    let last = time.last().copied().unwrap_or(0.0);
    let (unit, factor) = if last < 1e-3 {
        ("µs", 1e6)
    } else if last < 1.0 {
        ("ms", 1e3)
    } else {
        ("s", 1.0)
    };
    let mut ends = [Vec::new(), Vec::new()];
    if !run.file.snapshot_times()?.is_empty() {
        let frames = Frames::of_particles(run.file.root(), run.file.path())?;
        for at in 0..frames.len() {
            let frame = frames.read(at)?;
            let Some(ColumnData::F64(values)) = frame.field("temperature") else { continue };
            let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
            let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            ends[0].push((frame.time * factor, lowest));
            ends[1].push((frame.time * factor, highest));
        }
    }
    let series = |name: &str, at: usize, style: Style, points: Vec<(f64, f64)>| Series {
        name: name.to_owned(),
        color: COLORS[at],
        style,
        points,
        in_legend: true,
        marks_peak: false,
    };
    let [lowest, highest] = ends;
    let mean = time.iter().zip(&mean).map(|(t, mean)| (t * factor, *mean)).collect();
    Ok(Chart {
        id: format!("temperature-{k}"),
        title: format!("Temperature of {}", run.name),
        x: Axis::new(&format!("time, {unit}")),
        y: Axis::new("temperature, K"),
        series: vec![
            series("highest", 2, Style::LineAndDots, highest),
            series("mean, by heat capacity", 1, Style::Line, mean),
            series("lowest", 0, Style::LineAndDots, lowest),
        ],
        legend: true,
        ..Chart::default()
    })
}
