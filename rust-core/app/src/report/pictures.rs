//! Section of the report: the particles before the run, by their materials, with the walls, and at its end.

use std::fmt::Write as _;

use super::Run;
use super::cracks::base64;
use super::html::escape;
use crate::pictures::{Moments, Request, Section, picture};

/// Width of a picture, px.
const WIDTH: usize = 640;
/// Most runs with pictures, because each picture takes some hundred kilobytes of the page.
const MOST_RUNS: usize = 4;

/// Pictures of each run; empty for results without snapshots.
pub(super) fn section(runs: &[Run]) -> String {
    let mut html = String::new();
    for run in runs.iter().take(MOST_RUNS) {
        let last = if run.is_bonded { "damage of their bonds" } else { "speed" };
        let before = Request { color: Some("material".to_owned()), moments: start(run), ..small() };
        let mut shown = vec![figure(run, "Before the run", "material", &before)];
        if let Some(moments) = fastest(run).filter(|_| !run.is_bonded) {
            shown.push(figure(run, "At its fastest", last, &Request { moments, ..small() }));
        }
        shown.push(figure(run, "At the end", last, &small()));
        let shown: Vec<String> = shown.into_iter().flatten().collect();
        if !shown.is_empty() {
            let _ = writeln!(html, "<h3>{}</h3>\n<div class=\"pair\">\n{}</div>", escape(&run.label()), shown.concat());
        }
    }
    if html.is_empty() { html } else { format!("<h2>Pictures</h2>\n{html}") }
}

/// A section through the body at the end, colored by temperature: across its shortest extent, or all of a plane one.
pub(super) fn temperatures(run: &Run) -> String {
    let Ok(Some((low, high))) = run.file.bounds() else { return String::new() };
    let extent = high - low;
    let slice = (!run.is_plane).then(|| Section { axis: extent.imin(), place: None });
    let request = Request { color: Some("temperature".to_owned()), slice, ..small() };
    figure(run, "Section at the end", "temperature", &request).unwrap_or_default()
}

fn small() -> Request {
    Request { size: (WIDTH, None), ..Request::default() }
}

/// The snapshot nearest to the largest kinetic energy; `None` if it is the first or the last one.
fn fastest(run: &Run) -> Option<Moments> {
    let (times, kinetic) = (run.file.samples("time").ok()?, run.file.samples("kinetic").ok()?);
    let at = (0..kinetic.len()).max_by(|a, b| kinetic[*a].total_cmp(&kinetic[*b]))?;
    let snapshots = run.file.snapshot_times().ok()?;
    let distance = |k: &usize| (snapshots[*k] - times[at]).abs();
    let nearest = (0..snapshots.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    (nearest > 0 && nearest + 1 < snapshots.len()).then(|| Moments::Near(vec![snapshots[nearest]]))
}

/// The first snapshot.
fn start(run: &Run) -> Moments {
    let times = run.file.snapshot_times().unwrap_or_default();
    times.first().map_or(Moments::Last, |first| Moments::Near(vec![*first]))
}

/// A picture with its caption; `None` for what cannot be drawn, which is not what the page is about.
fn figure(run: &Run, heading: &str, by: &str, request: &Request) -> Option<String> {
    let made = picture(run.file, run.scenario.as_ref()?, request, None).ok()?;
    let text = escape(&format!("{heading}: particles, colored by {by}"));
    let notes: Vec<String> = made.notes.iter().map(|note| format!(" Note: {}.", escape(note))).collect();
    let notes = notes.concat();
    Some(format!(
        "<figure class=\"plot\"><img class=\"particles\" alt=\"{text}\" src=\"data:image/png;base64,{}\"/>\
         <figcaption class=\"quiet\">{text}.{}</figcaption></figure>\n",
        base64(&made.png),
        notes
    ))
}
