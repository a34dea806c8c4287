//! Section of the report: a slice through the middle of the specimen at every snapshot, deformed and colored by damage.

use std::fmt::Write as _;

use super::Run;
use super::cracks::base64;
use super::html::escape;
use crate::output::{OutputError, SliceFrame};

/// Largest number of particles in a slice. More are thinned by a thinner slice.
const MOST_PARTICLES: usize = 3000;
/// Largest number of snapshots; the first and the last one are always among them.
const MOST_SNAPSHOTS: usize = 16;
/// Magnified, the largest displacement between two particles is this part of the picture.
const MAGNIFIED: f64 = 0.06;

pub(super) fn section(runs: &[Run]) -> Result<String, OutputError> {
    let mut body = String::new();
    // Without bonds there is no damage to show.
    for (k, run) in runs.iter().enumerate().filter(|(_, run)| run.is_bonded) {
        let Some(slice) = run.file.slice(MOST_PARTICLES, MOST_SNAPSHOTS)? else { continue };
        let (moved, frames) =
            (slice.frames.iter().any(|frame| frame.displacement.iter().any(|d| *d != 0.0)), slice.frames.len());
        if frames < 2 || !moved {
            continue;
        }
        let names = ["x", "y", "z"];
        let [u, v] = slice.axes.map(|axis| names[axis]);
        let text = format!(
            "{}{} particles of a slice {u}{v} through the middle of the specimen at {frames} times, displaced and colored by damage",
            slice.count,
            if slice.count < slice.cut { format!(" of {}", slice.cut) } else { String::new() }
        );
        let _ = write!(
            body,
            "<h3>{}</h3>\n<p>{}. The color is the mean damage of the bonds of a particle, 0 to 1:</p>\n{}<div class=\"pair\"><div>\
             <canvas class=\"slice\" id=\"slice-{k}\" role=\"img\" aria-label=\"{text}\">{text}</canvas></div></div>\n\
             <p class=\"controls\"><label>Time <input type=\"range\" id=\"time-{k}\" min=\"0\" max=\"{}\" value=\"{}\"> \
             <output for=\"time-{k}\"></output></label>\n<label>Displacements times <input type=\"range\" id=\"scale-{k}\" min=\"0\" \
             max=\"40\" value=\"20\"> <output for=\"scale-{k}\"></output></label></p>\n<script>drawSlice(\"slice-{k}\", \"time-{k}\", \
             \"scale-{k}\", {});</script>\n",
            escape(&run.label()),
            text,
            ramp(),
            frames - 1,
            frames - 1,
            data(&slice, run)
        );
    }
    if body.is_empty() { Ok(body) } else { Ok(format!("<h2>Deformed slice</h2>\n{body}")) }
}

/// The slice as JSON: sizes in 1/10000 of the longest edge; particles in base 64, six bytes each (u, v, radius); for each snapshot
/// displacements as 16-bit numbers with sign (a number is `unit` of the longest edge over 32767) and damage, five bytes each.
fn data(slice: &SliceFrame, run: &Run) -> String {
    let [low, high] = slice.bounds;
    let longest = (high[0] - low[0]).max(high[1] - low[1]);
    let number = |x: f64| (x / longest * 10_000.0).round().clamp(0.0, 65_535.0) as u16;
    let mut bytes = Vec::with_capacity(6 * slice.count);
    for (point, radius) in slice.points.chunks_exact(2).zip(&slice.radius) {
        for value in [number(point[0] - low[0]), number(point[1] - low[1]), number(*radius)] {
            bytes.extend(value.to_le_bytes());
        }
    }
    let largest = slice.frames.iter().flat_map(|frame| &frame.displacement).fold(0.0_f64, |most, d| most.max(d.abs()));
    let mut frames = Vec::new();
    for frame in &slice.frames {
        let mut bytes = Vec::with_capacity(5 * slice.count);
        for (d, damage) in frame.displacement.chunks_exact(2).zip(&frame.damage) {
            for component in d {
                bytes.extend(((component / largest * 32_767.0).round() as i16).to_le_bytes());
            }
            bytes.push((255.0 * damage.clamp(0.0, 1.0)).round() as u8);
        }
        let strain = strain_at(run, frame.time);
        let strain =
            strain.map_or_else(String::new, |strain| format!(", {} {:.4} ‰", run.meaning.strain(), strain * 1e3));
        frames.push(format!("{{label: \"{:.4} ms{strain}\", moved: \"{}\"}}", frame.time * 1e3, base64(&bytes)));
    }
    format!(
        "{{size: [{}, {}], unit: {:e}, magnify: {:e}, particles: \"{}\", frames: [{}]}}",
        number(high[0] - low[0]),
        number(high[1] - low[1]),
        largest / longest * 10_000.0,
        MAGNIFIED * longest / largest,
        base64(&bytes),
        frames.join(", ")
    )
}

/// Strain of the record nearest to a time.
fn strain_at(run: &Run, time: f64) -> Option<f64> {
    if run.strain.iter().all(|strain| *strain == 0.0) {
        return None;
    }
    let times = run.file.samples("time").ok()?;
    let at = times.partition_point(|other| *other < time).min(times.len().checked_sub(1)?);
    run.strain.get(at).copied()
}

/// The color scale, linear in the damage.
fn ramp() -> String {
    let mark = |share: f64| format!("<span style=\"left: {:.0}%\">{share}</span>", 100.0 * share);
    format!("<div class=\"ramp linear\">{}</div>\n", [0.0, 0.25, 0.5, 0.75, 1.0].map(mark).concat())
}
