//! Section of the report: pulses in a split Hopkinson bar, with strength and strain rate of the specimen by the theory of one-dimensional waves.

use super::chart::{Axis, Chart, Series, Style, side_by_side};
use super::meaning::Measured;
use super::{OutputError, Run};
use concordem_contact::math::Vec3;
use concordem_scenario::sampling::Operator;
use concordem_scenario::schema::quantity::vector;
use concordem_scenario::schema::{Loading, SampleRegion, Scenario, Selection};
use concordem_solver::state::columns::{ColumnData, StoredColumn};

/// Colors of incident, reflected, and transmitted pulse.
const COLORS: [&str; 3] = ["#1f6fb4", "#c8501e", "#3f8f5a"];

/// A striker, a bar with a gauge, a specimen of another material, and a bar with a gauge, in this order along an axis. Lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Bars {
    axis: usize,
    /// Speed of the striker, m/s.
    speed: f64,
    /// Length of the striker, and distance of its face from the first gauge.
    striker: [f64; 2],
    /// Length of the specimen, and distances of the gauges from its faces.
    specimen: [f64; 3],
    /// Names of the gauges.
    gauges: [String; 2],
}

/// Extent of a box along an axis.
fn extent(selection: &Selection, axis: usize) -> Option<[f64; 2]> {
    let Selection::Box { minimum, maximum } = selection else { return None };
    Some([minimum[axis].si(), maximum[axis].si()])
}

/// Middle of a region.
fn middle(region: &SampleRegion) -> Option<Vec3> {
    match region {
        SampleRegion::Box { minimum, maximum } => Some((vector(minimum) + vector(maximum)) * 0.5),
        SampleRegion::Cylinder { center, .. } => Some(vector(center)),
        _ => None,
    }
}

impl Bars {
    /// The bars of a scenario: one set with a velocity along an axis, one set with a material of its own, both boxes, and a `region-stress` in each
    /// bar. `None` for others.
    pub(super) fn of(scenario: &Scenario) -> Option<Self> {
        let ([initial], Loading::None) = (&scenario.initials[..], &scenario.loading) else { return None };
        let mut own = scenario.sets.iter().filter(|set| set.material.is_some());
        let (specimen, None) = (own.next()?, own.next()) else { return None };
        let striker = scenario.sets.iter().find(|set| set.name == initial.set)?;
        let velocity = vector(&initial.velocity);
        let axis = velocity.iamax();
        let speed = velocity[axis].abs();
        if speed == 0.0 || velocity.norm() > speed {
            return None;
        }
        // Along the motion, whichever its direction.
        let along = |ends: [f64; 2]| if velocity[axis] > 0.0 { ends } else { [-ends[1], -ends[0]] };
        let [back, face] = along(extent(&striker.selection, axis)?);
        let [near, far] = along(extent(&specimen.selection, axis)?);
        let stresses = scenario.samples.iter().filter(|sample| sample.operator == Operator::RegionStress);
        let places = stresses.filter_map(|sample| {
            let at = middle(sample.region.as_ref()?)?[axis] * velocity[axis].signum();
            Some((sample.name().to_owned(), at))
        });
        let places: Vec<(String, f64)> = places.collect();
        let [first, second] = &places[..] else { return None };
        let (first, second) = if first.1 < second.1 { (first, second) } else { (second, first) };
        let is_ordered = back < face && face < first.1 && first.1 < near && near < far && far < second.1;
        is_ordered.then(|| Self {
            axis,
            speed,
            striker: [face - back, first.1 - face],
            specimen: [far - near, near - first.1, second.1 - far],
            gauges: [first.0.clone(), second.0.clone()],
        })
    }

    /// Names of the two gauges.
    pub(super) fn names(&self) -> &[String; 2] {
        &self.gauges
    }

    /// Axis of the bars, 0 to 2.
    pub(super) fn axis(&self) -> usize {
        self.axis
    }

    /// Length of the striker and distance of its face from the first gauge; length of the specimen and distances of the gauges from its faces, m.
    pub(super) fn lengths(&self) -> ([f64; 2], [f64; 3]) {
        (self.striker, self.specimen)
    }

    /// What the gauges say, from their compressive stresses (Pa) at common times (s); `None` if there is no pulse.
    ///
    /// The first gauge sees the incident pulse from the time `t₀` on, at which it reaches half of its largest stress: `c = d/t₀` with its distance
    /// `d` from the striker of length `l`. In the middle half of the pulse's duration `2l/c` its mean stress is `ρ c V/2` with the striker's velocity
    /// `V`, which gives `ρ c`.
    fn read(&self, time: &[f64], [first, second]: [&[f64]; 2]) -> Option<Pulses> {
        let largest = first.iter().copied().fold(0.0_f64, f64::max);
        let front = time[first.iter().position(|stress| *stress > 0.5 * largest)?];
        let [length, to_gauge] = self.striker;
        let [thickness, before, behind] = self.specimen;
        let wave_speed = to_gauge / front;
        let duration = 2.0 * length / wave_speed;
        let inside = |t: &f64| (front + 0.25 * duration..=front + 0.75 * duration).contains(t);
        let plateau: Vec<f64> = time.iter().zip(first).filter(|(t, _)| inside(t)).map(|(_, stress)| *stress).collect();
        let incident = plateau.iter().sum::<f64>() / plateau.len() as f64;
        if !(incident > 0.0 && wave_speed.is_finite()) {
            return None;
        }
        let impedance = 2.0 * incident / self.speed;
        // The reflection is at the first gauge when it has come back as far as the transmitted pulse has gone on.
        let lag = (before - behind) / wave_speed;
        let reflected = |t: f64| {
            let at = t + lag;
            let next = time.partition_point(|other| *other < at);
            let (Some(last), true) = (next.checked_sub(1), next < time.len()) else { return None };
            let share = (at - time[last]) / (time[next] - time[last]);
            Some(-(first[last] + share * (first[next] - first[last])))
        };
        let rate = |t: f64| Some(2.0 * reflected(t)? / (impedance * thickness));
        let arrival = front + (before + behind) / wave_speed;
        // The tension of the reflection follows the incident pulse.
        let is_over = |(t, stress): &(&f64, &f64)| **t > front + 0.75 * duration && **stress <= 0.0;
        let returns = time.iter().zip(first).find(is_over).map_or(f64::INFINITY, |(t, _)| *t);
        let (mut curve, mut strain, mut last) = (Vec::new(), 0.0, None);
        for (t, stress) in time.iter().zip(second).filter(|(t, _)| **t >= arrival) {
            let Some(rate) = rate(*t) else { break };
            if let Some((before, rate_before)) = last.replace((*t, rate)) {
                strain += 0.5 * (rate + rate_before) * (t - before);
            }
            curve.push((strain, *stress));
        }
        let peak = (0..second.len()).max_by(|a, b| second[*a].total_cmp(&second[*b]))?;
        let is_apart = duration <= 2.0 * before / wave_speed;
        let rate = rate(time[peak]).filter(|_| is_apart);
        let curve = if is_apart { curve } else { Vec::new() };
        Some(Pulses { incident, wave_speed, returns, strength: second[peak], rate, curve })
    }
}

/// What the gauges of the bars say.
#[derive(Debug, Clone, PartialEq)]
struct Pulses {
    /// Stress of the incident pulse, Pa.
    incident: f64,
    /// Speed of waves in the bars, m/s.
    wave_speed: f64,
    /// When the first gauge sees tension behind the incident pulse, s.
    returns: f64,
    /// Largest transmitted stress, Pa.
    strength: f64,
    /// Strain rate of the specimen at that moment, 1/s; `None` where the pulses overlap at the first gauge, and where the run ends before.
    rate: Option<f64>,
    /// Strain and stress (Pa) of the specimen.
    curve: Vec<(f64, f64)>,
}

/// Times (s) and compressive stresses of a gauge along an axis, Pa.
fn gauge(run: &Run, name: &str, axis: usize) -> Result<Option<[Vec<f64>; 2]>, OutputError> {
    if !run.file.operators()?.iter().any(|operator| operator == name) {
        return Ok(None);
    }
    let table = run.file.rows(&format!("samples/{name}"))?;
    let reals = |wanted: &str| match table.iter().find(|(name, _)| name == wanted).map(|(_, column)| column) {
        Some(StoredColumn { data: ColumnData::F64(values), .. }) => Some(values),
        _ => None,
    };
    let (Some(time), Some(stress)) = (reals("time"), reals("stress")) else { return Ok(None) };
    Ok(Some([time.clone(), stress.iter().skip(4 * axis).step_by(9).map(|stress| -stress).collect()]))
}

/// Times (s) and compressive stresses of both gauges, Pa.
type Gauges = (Vec<f64>, [Vec<f64>; 2]);

/// The gauges of a run with bars, and what they say.
fn pulses(run: &Run) -> Result<Option<(Gauges, Pulses)>, OutputError> {
    let Some(bars) = run.scenario.as_ref().and_then(Bars::of) else { return Ok(None) };
    let [first, second] = [gauge(run, &bars.gauges[0], bars.axis)?, gauge(run, &bars.gauges[1], bars.axis)?];
    let Some(([time, first], [other, second])) = first.zip(second) else { return Ok(None) };
    let read = (time == other).then(|| bars.read(&time, [&first, &second])).flatten();
    Ok(read.map(|pulses| ((time, [first, second]), pulses)))
}

/// Strength, strain rate, and incident pulse of a run with bars; empty for others.
pub(super) fn rows(run: &Run) -> Result<Vec<Measured>, OutputError> {
    let Some((_, pulses)) = pulses(run)? else { return Ok(Vec::new()) };
    let strength = "strength: the largest transmitted stress, for a specimen with the section of the bars";
    let mut rows: Vec<Measured> = vec![("f<sub>c,d</sub>", strength.to_owned(), "MPa", 1e-6 * pulses.strength)];
    if let Some(rate) = pulses.rate {
        let name = "strain rate at that moment, 2 σ<sub>r</sub>/(ρ c L)".to_owned();
        rows.push(("dε/dt", name, "1/s", rate));
    }
    rows.push(("σ<sub>i</sub>", "incident pulse, ρ c V/2".to_owned(), "MPa", 1e-6 * pulses.incident));
    rows.push(("c", "speed of waves in the bars".to_owned(), "m/s", pulses.wave_speed));
    Ok(rows)
}

/// Incident, reflected, and transmitted pulse, and the curve of the specimen, of every run with bars.
pub(super) fn section(runs: &[Run]) -> Result<String, OutputError> {
    let mut charts = Vec::new();
    for (k, run) in runs.iter().enumerate() {
        let Some(((time, stresses), pulses)) = pulses(run)? else { continue };
        let of = if runs.len() > 1 { format!(", {}", run.label()) } else { String::new() };
        let series = |name: &str, color: usize, points: Vec<(f64, f64)>, in_legend: bool| Series {
            name: name.to_owned(),
            color: COLORS[color],
            style: Style::Line,
            points,
            in_legend,
            marks_peak: color == 2,
        };
        let part = |gauge: usize, from: f64, to: f64| -> Vec<(f64, f64)> {
            let points = time.iter().zip(&stresses[gauge]).filter(|(t, _)| (from..to).contains(*t));
            points.map(|(t, stress)| (t * 1e6, stress * 1e-6)).collect()
        };
        let end = f64::INFINITY;
        let lines = vec![
            series("incident pulse", 0, part(0, 0.0, pulses.returns), true),
            series("its reflection", 1, part(0, pulses.returns, end), true),
            series("transmitted pulse", 2, part(1, 0.0, end), true),
        ];
        let chart = |id: &str, title: &str, [x, y]: [&str; 2], series: Vec<Series>| Chart {
            id: format!("pulses-{k}-{id}"),
            title: format!("{title} of {}", run.name),
            x: Axis::new(x),
            y: Axis::new(y),
            legend: series.len() > 1,
            series,
            ..Chart::default()
        };
        let axes = ["time, µs", "compressive stress in the bars, MPa"];
        charts.push((format!("Pulses at the gauges{of}"), chart("bars", "Pulses", axes, lines)));
        if !pulses.curve.is_empty() {
            let points = pulses.curve.iter().map(|(e, s)| (e * 1e3, s * 1e-6)).collect();
            let axes = ["compressive strain of the specimen, ‰", "compressive stress, MPa"];
            let curve = chart("specimen", "Specimen", axes, vec![series(&run.name, 2, points, false)]);
            charts.push((format!("Stress and strain of the specimen{of}"), curve));
        }
    }
    let note = "The transmitted pulse gives the stress of the specimen; its strain rate is 2 σ<sub>r</sub>/(ρ c L) with the stress \
                σ<sub>r</sub> of the reflection, the length L of the specimen, and ρ c from the incident pulse.";
    Ok(side_by_side("Split Hopkinson bar", &charts, note))
}

#[cfg(test)]
mod tests {
    use super::*;
    use concordem_scenario::schema::template;

    /// The template's bars; a striker of 8 m/s in bars of ρ c = 40 MPa s/m and c = 5000 m/s sends 160 MPa for 32 µs. A specimen that passes on a quarter
    /// reflects the rest; its strain rate is 2 · 120 MPa/(40 MPa s/m · 10 mm) = 600 1/s.
    #[test]
    fn pulses_of_closed_form_are_read() {
        let scenario = Scenario::parse("bars", template("concrete-hopkinson").unwrap().text).unwrap();
        let bars = Bars::of(&scenario).unwrap();
        let near = |found: &[f64], wanted: &[f64]| found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(bars.speed == 8.0 && near(&bars.striker, &[0.08, 0.09]) && near(&bars.specimen, &[0.01, 0.09, 0.06]));
        let (step, speed, duration) = (1e-7, 5000.0, 32e-6);
        let time: Vec<f64> = (0..=880).map(|k| f64::from(k) * step).collect();
        let pulse = |t: f64, at: f64| if t >= at && t < at + duration { 160e6 } else { 0.0 };
        let [gauge, back, behind] = [0.09 / speed, 0.27 / speed, 0.24 / speed].map(|t| t - 0.5 * step);
        let first: Vec<f64> = time.iter().map(|t| pulse(*t, gauge) - 0.75 * pulse(*t, back)).collect();
        let second: Vec<f64> = time.iter().map(|t| 0.25 * pulse(*t, behind)).collect();
        let found = bars.read(&time, [&first, &second]).unwrap();
        assert!(
            (found.incident / 160e6 - 1.0).abs() < 1e-12 && (found.wave_speed / speed - 1.0).abs() < 1e-9,
            "{found:?}"
        );
        assert_eq!(found.strength, 40e6);
        assert!((found.rate.unwrap() / 600.0 - 1.0).abs() < 1e-9, "{found:?}");
        // At constant rate the strain grows by 600 1/s times 32 µs; the ends are known to two steps.
        let strain = found.curve.iter().map(|point| point.0).fold(0.0, f64::max);
        assert!((strain - 600.0 * duration).abs() < 2.0 * 600.0 * step, "{strain}");
        // A longer striker: its pulse is still there when the reflection comes back.
        let long = Bars { striker: [0.1, 0.09], ..bars.clone() };
        let overlapping = long.read(&time, [&first, &second]).unwrap();
        assert!(overlapping.rate.is_none() && overlapping.curve.is_empty());
        assert_eq!(bars.read(&time, [&second, &vec![0.0; time.len()]]).map(|found| found.strength), Some(0.0));
        for name in ["beam-impact", "cpm-small", "hertz-impact"] {
            assert_eq!(Bars::of(&Scenario::parse(name, template(name).unwrap().text).unwrap()), None, "{name}");
        }
    }
}
