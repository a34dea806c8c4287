//! Section of the report: deviator and volume of a specimen whose sides are under pressure.

use super::chart::{Axis, Chart, Series, Style, side_by_side};
use super::figures::{RISING, still_rises};
use super::meaning::Measured;
use super::{Coverage, OutputError, Run};

/// A specimen under lateral pressure; all with the signs of the field, where compression is positive if the deviator presses.
struct Confined {
    is_pressed: bool,
    /// Strain along the axis.
    strain: Vec<f64>,
    /// `σ₁ − σ₃`, Pa: axial less lateral stress in compression, the opposite in extension.
    deviator: Vec<f64>,
    /// Lateral pressure, Pa.
    pressure: Vec<f64>,
    /// Volumetric strain, with the sign of the axial one.
    volume: Vec<f64>,
}

impl Confined {
    /// `None` for runs with free sides, and for those whose stress is nothing but rounding errors.
    fn of(run: &Run) -> Result<Option<Self>, OutputError> {
        let is_known = run.noise.is_none() && run.coverage != Coverage::Unknown;
        if !is_known || !run.file.has_series("lateral_stress") {
            return Ok(None);
        }
        let [lateral, volume] = [run.file.history("lateral_stress")?, run.file.history("volumetric_strain")?];
        let (strain, stress) = (&run.history.strain, &run.history.stress);
        if [stress.len(), lateral.len(), volume.len()] != [strain.len(); 3] {
            // It continues a run that had free sides.
            return Ok(None);
        }
        let deviator: Vec<f64> = stress.iter().zip(&lateral).map(|(axial, lateral)| axial - lateral).collect();
        let largest = deviator.iter().copied().fold(0.0_f64, |most, q| if q.abs() > most.abs() { q } else { most });
        let sign = largest.signum();
        let signed = |values: &[f64]| values.iter().map(|value| sign * value).collect();
        let pressure = lateral.iter().map(|lateral| -lateral).collect();
        let (strain, deviator, volume) = (signed(strain), signed(&deviator), signed(&volume));
        Ok((largest != 0.0).then_some(Self { is_pressed: sign < 0.0, strain, deviator, pressure, volume }))
    }

    fn rows(&self) -> Vec<Measured> {
        let Some(at) = (0..self.deviator.len()).max_by(|a, b| self.deviator[*a].total_cmp(&self.deviator[*b])) else {
            return Vec::new();
        };
        let peak = self.deviator[at];
        let note = if still_rises(&self.deviator, peak) { RISING } else { "" };
        let positive = if self.is_pressed { "compaction" } else { "dilation" };
        vec![
            ("q<sub>max</sub>", format!("largest deviator, σ<sub>1</sub> − σ<sub>3</sub>{note}"), "MPa", 1e-6 * peak),
            ("p<sub>l</sub>", "lateral pressure at it".to_owned(), "MPa", 1e-6 * self.pressure[at]),
            ("ε<sub>v</sub>", format!("volumetric strain at it, {positive} positive"), "‰", 1e3 * self.volume[at]),
        ]
    }

    fn charts(&self, run: &Run, k: usize) -> [(String, Chart); 2] {
        let (axial, volume) = if self.is_pressed {
            ("axial compressive strain, ‰", "volumetric strain, ‰ (compaction positive)")
        } else {
            ("axial strain, ‰", "volumetric strain, ‰ (dilation positive)")
        };
        let chart = |id: &str, heading: &str, label: &str, values: &[f64], factor: f64, marks_peak: bool| {
            let points = self.strain.iter().zip(values).map(|(e, value)| (e * 1e3, value * factor)).collect();
            let series = Series {
                name: run.name.clone(),
                color: run.color,
                style: Style::Line,
                points,
                in_legend: false,
                marks_peak,
            };
            let chart = Chart {
                id: format!("triaxial-{k}-{id}"),
                title: format!("{heading} of {}", run.name),
                x: Axis::new(axial),
                y: Axis::new(label),
                series: vec![series],
                ..Chart::default()
            };
            (heading.to_owned(), chart)
        };
        [
            chart("deviator", "Deviator", "deviator σ₁ − σ₃, MPa", &self.deviator, 1e-6, true),
            chart("volume", "Change of volume", volume, &self.volume, 1e3, false),
        ]
    }
}

/// Results of a specimen under lateral pressure; empty for other runs.
pub(super) fn rows(run: &Run) -> Result<Vec<Measured>, OutputError> {
    Ok(Confined::of(run)?.map_or_else(Vec::new, |confined| confined.rows()))
}

/// Deviator and volume over the axial strain, of every run whose sides are under pressure.
pub(super) fn section(runs: &[Run]) -> Result<String, OutputError> {
    let mut charts = Vec::new();
    for (k, run) in runs.iter().enumerate() {
        let Some(confined) = Confined::of(run)? else { continue };
        let of = if runs.len() > 1 { format!(", {}", run.label()) } else { String::new() };
        charts.extend(confined.charts(run, k).map(|(heading, chart)| (heading + &of, chart)));
    }
    let note = "Strains count from the start of the run, a consolidation included.";
    Ok(side_by_side("Under lateral pressure", &charts, note))
}
