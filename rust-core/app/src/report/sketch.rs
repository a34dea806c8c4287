//! Section of the report: a sketch of each test, with its supports, plates, and loads.

use std::fmt::Write as _;

use super::Run;
use super::hopkinson::Bars;
use super::html::{escape, number};
use super::laboratory::{Beam, Test};
use super::meaning::Meaning;
use concordem_scenario::schema::{Loading, Shape};

/// Size of a sketch, and its room around the specimen, px.
const SIZE: [f64; 2] = [420.0, 250.0];
const ROOM: [f64; 2] = [70.0, 62.0];
/// Length of an arrow, px.
const ARROW: f64 = 30.0;

/// Sketches of all runs with a test; runs with the same sketch share it.
pub(super) fn section(runs: &[Run]) -> String {
    let mut all: Vec<(String, Vec<&str>)> = Vec::new();
    for run in runs {
        let Some(sketch) = of(run) else { continue };
        match all.iter_mut().find(|(other, _)| *other == sketch) {
            Some((_, names)) => names.push(&run.name),
            None => all.push((sketch, vec![&run.name])),
        }
    }
    if all.is_empty() {
        return String::new();
    }
    let one = |(sketch, names): &(String, Vec<&str>)| {
        let names = escape(&names.join(", "));
        format!(
            "<figure class=\"plot\">{sketch}<figcaption class=\"quiet\">{names}, not to scale where thin.</figcaption></figure>\n"
        )
    };
    format!("<h2>Set-up</h2>\n<div class=\"pair\">\n{}</div>\n", all.iter().map(one).collect::<String>())
}

/// The sketch of a run; `None` for loadings that have none.
fn of(run: &Run) -> Option<String> {
    let scenario = run.scenario.as_ref()?;
    let shape = scenario.packing.shape();
    let is_pulled = run.history.strain.iter().sum::<f64>() > 0.0;
    if let Some(bars) = Bars::of(scenario) {
        let Some(Shape::Box { size, .. }) = shape else { return None };
        return Some(hopkinson(&bars, size[bars.axis()].si()));
    }
    match (Test::of(scenario), &scenario.loading) {
        (Some(Test::Flexure(beam)), Loading::Flexure { axis, .. }) => {
            let Some(Shape::Box { size, .. }) = shape else { return None };
            Some(bent(&beam, size[axis.index()].si()))
        }
        (Some(Test::Splitting { .. }), _) => {
            let Some(Shape::Cylinder { radius, height, .. }) = shape else { return None };
            Some(split(2.0 * radius.si(), height.si()))
        }
        (_, Loading::Uniaxial { axis, .. } | Loading::Platens { axis, .. }) => {
            let [width, height] = match shape? {
                Shape::Box { size, .. } => [size[(axis.index() + 1) % 3].si(), size[axis.index()].si()],
                Shape::Cylinder { radius, height, axis: own, .. } if own == axis => [2.0 * radius.si(), height.si()],
                Shape::Cylinder { radius, .. } => [2.0 * radius.si(); 2],
                _ => return None,
            };
            let is_plates = matches!(scenario.loading, Loading::Platens { .. });
            let ends = if is_plates { Ends::Plates } else { Ends::Layers };
            Some(loaded([width, height], ends, is_pulled, scenario.is_enclosed()))
        }
        (_, Loading::CellStress { .. } | Loading::CellStrain { .. }) => match run.meaning {
            Meaning::FreeCell => Some(loaded([1.0, 1.0], Ends::Cell, is_pulled, false)),
            Meaning::LateralStress | Meaning::Oedometric => Some(loaded([1.0, 1.0], Ends::Cell, is_pulled, true)),
            _ => None,
        },
        _ => None,
    }
}

/// What holds the ends of a specimen.
#[derive(Clone, Copy, PartialEq)]
enum Ends {
    Layers,
    Plates,
    Cell,
}

/// A drawing that grows; lengths in m from its middle, upwards, times a scale.
struct Sketch {
    body: String,
    scale: f64,
}

impl Sketch {
    /// For a specimen of this width and height, m.
    fn new(size: [f64; 2]) -> Self {
        let scale = [0, 1].map(|k| (SIZE[k] - 2.0 * ROOM[k]) / size[k]);
        Self { body: String::new(), scale: scale[0].min(scale[1]) }
    }

    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [0.5 * SIZE[0] + self.scale * x, 0.5 * SIZE[1] - self.scale * y]
    }

    fn rectangle(&mut self, middle: [f64; 2], size: [f64; 2], style: &str) {
        let [x, y] = self.at([middle[0] - 0.5 * size[0], middle[1] + 0.5 * size[1]]);
        let [width, height] = size.map(|edge| edge * self.scale);
        let _ =
            write!(self.body, "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" {style}/>");
    }

    /// An arrow of the length [`ARROW`] in the direction `way`, whose tip is at a point, `gap` px before it.
    fn arrow(&mut self, tip: [f64; 2], way: [f64; 2], gap: f64) {
        let [x, y] = self.at(tip);
        let back = |by: f64| [x - by * way[0], y + by * way[1]];
        let ([x1, y1], [x2, y2], [x3, y3]) = (back(gap + ARROW), back(gap + 7.0), back(gap));
        let [across_x, across_y] = [4.0 * way[1], 4.0 * way[0]];
        let _ = write!(
            self.body,
            "<path d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}\" stroke=\"#c8501e\" stroke-width=\"2\"/>\
             <path d=\"M{x3:.1} {y3:.1}L{:.1} {:.1}L{:.1} {:.1}Z\" fill=\"#c8501e\"/>",
            x2 + across_x,
            y2 + across_y,
            x2 - across_x,
            y2 - across_y
        );
    }

    /// A text, `down` px below a point.
    fn text(&mut self, point: [f64; 2], down: f64, text: &str) {
        let [x, y] = self.at(point);
        let _ = write!(self.body, "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{text}</text>", y + down);
    }

    fn done(self, title: &str) -> String {
        format!(
            "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{title}\" font-size=\"13\">{}</svg>",
            SIZE[0], SIZE[1], self.body
        )
    }
}

const BODY: &str = "fill=\"#ddd8cb\" stroke=\"#4a5560\"";
const HELD: &str = "fill=\"#8f9aa5\" stroke=\"#4a5560\"";
const CELL: &str = "fill=\"#ddd8cb\" stroke=\"#4a5560\" stroke-dasharray=\"5 4\"";

/// A length in mm.
fn millimeters(length: f64) -> String {
    format!("{} mm", number(length * 1e3))
}

/// A specimen that is pulled or pressed along its axis, upright, and pressed from its sides or not.
fn loaded(size: [f64; 2], ends: Ends, is_pulled: bool, is_confined: bool) -> String {
    let mut sketch = Sketch::new(size);
    let [width, height] = size;
    sketch.rectangle([0.0; 2], size, if ends == Ends::Cell { CELL } else { BODY });
    let thick = 6.0 / sketch.scale;
    for side in [-1.0, 1.0] {
        let end = 0.5 * side * height;
        match ends {
            Ends::Layers => sketch.rectangle([0.0, end - 0.5 * side * thick], [width, thick], HELD),
            Ends::Plates => sketch.rectangle([0.0, end + 0.5 * side * thick], [1.2 * width, thick], HELD),
            Ends::Cell => {}
        }
        let (way, gap) = if is_pulled { (side, -ARROW - 10.0) } else { (-side, 10.0) };
        sketch.arrow([0.0, end], [0.0, way], gap);
        for height in [-0.3, 0.0, 0.3].map(|share| share * height) {
            if is_confined {
                sketch.arrow([0.5 * side * width, height], [-side, 0.0], 3.0);
            }
        }
    }
    if ends != Ends::Cell {
        sketch.text([0.0; 2], 4.0, &format!("{} × {}", millimeters(width), millimeters(height)));
    }
    sketch.done("Specimen with the loads on its ends and sides")
}

/// A beam on two supports.
fn bent(beam: &Beam, length: f64) -> String {
    let Beam { height, span, inner_span, notch, .. } = *beam;
    let mut sketch = Sketch::new([length, height]);
    sketch.rectangle([0.0; 2], [length, height], BODY);
    if let Some(depth) = notch {
        let width = 4.0 / sketch.scale;
        sketch.rectangle([0.0, 0.5 * (depth - height)], [width, depth], "fill=\"#ffffff\" stroke=\"#4a5560\"");
    }
    for side in [-1.0, 1.0] {
        let [x, y] = sketch.at([0.5 * side * span, -0.5 * height]);
        let _ = write!(sketch.body, "<path d=\"M{x:.1} {y:.1}l-9 16h18Z\" {HELD}/>");
    }
    let rollers: &[f64] = if inner_span > 0.0 { &[-0.5, 0.5] } else { &[0.0] };
    for share in rollers {
        sketch.arrow([share * inner_span, 0.5 * height], [0.0, -1.0], 2.0);
    }
    let notch = notch.map_or_else(String::new, |depth| format!(", a₀ = {}", millimeters(depth)));
    let inner = if inner_span > 0.0 { format!(", rollers {} apart", millimeters(inner_span)) } else { String::new() };
    let text = format!("l = {}, h = {}{notch}{inner}", millimeters(span), millimeters(height));
    sketch.text([0.0, -0.5 * height], 36.0, &text);
    sketch.done("Beam on two supports, with its rollers")
}

/// A cylinder that lies between two plates.
fn split(diameter: f64, length: f64) -> String {
    let mut sketch = Sketch::new([diameter; 2]);
    let ([x, y], radius) = (sketch.at([0.0; 2]), 0.5 * diameter * sketch.scale);
    let _ = write!(sketch.body, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" {BODY}/>");
    let thick = 6.0 / sketch.scale;
    for side in [-1.0, 1.0] {
        sketch.rectangle([0.0, 0.5 * side * (diameter + thick)], [0.8 * diameter, thick], HELD);
        sketch.arrow([0.0, 0.5 * side * diameter], [0.0, -side], 9.0);
    }
    sketch.text([0.0; 2], 4.0, &format!("D = {}, L = {}", millimeters(diameter), millimeters(length)));
    sketch.done("Cylinder between two plates")
}

/// Striker, bar, specimen, and bar, `whole` (m) together.
fn hopkinson(bars: &Bars, whole: f64) -> String {
    let ([striker, to_gauge], [specimen, before, behind]) = bars.lengths();
    let known = [striker, to_gauge + before, specimen];
    let lengths = [known[0], known[1], known[2], whole - known.iter().sum::<f64>()];
    let mut sketch = Sketch::new([whole, 0.08 * whole]);
    let mut from = -0.5 * whole;
    for (k, (length, name)) in lengths.into_iter().zip(["striker", "bar", "specimen", "bar"]).enumerate() {
        let shift = if k == 0 { -8.0 / sketch.scale } else { 0.0 };
        let style = if k == 2 { BODY } else { HELD };
        sketch.rectangle([from + 0.5 * length + shift, 0.0], [length, 0.06 * whole], style);
        sketch.text([from + 0.5 * length + shift, -0.03 * whole], if k == 2 { 34.0 } else { 18.0 }, name);
        from += length;
    }
    let face = -0.5 * whole + striker;
    for gauge in [face + to_gauge, face + to_gauge + before + specimen + behind] {
        sketch.rectangle([gauge, 0.035 * whole], [0.01 * whole, 0.01 * whole], "fill=\"#1f6fb4\"");
        sketch.text([gauge, 0.04 * whole], -8.0, "gauge");
    }
    sketch.arrow([face - striker, 0.0], [1.0, 0.0], 14.0);
    sketch.done("Striker, bars with gauges, and specimen")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numbers of a drawing's commands of one kind, such as `M` of arrows.
    fn numbers(sketch: &str, before: &str) -> Vec<Vec<f64>> {
        let all = sketch.split(before).skip(1).map(|rest| {
            let end = rest.find(['"', 'Z']).unwrap_or(rest.len());
            let words = rest[..end].split(['L', ' ', 'l']);
            words.filter_map(|word| word.parse().ok()).collect()
        });
        all.collect()
    }

    /// Shafts of arrows: where each begins and ends, px.
    fn shafts(sketch: &str) -> Vec<[f64; 4]> {
        let shafts = numbers(sketch, "<path d=\"M").into_iter().filter(|path| path.len() == 4);
        shafts.map(|path| [path[0], path[1], path[2], path[3]]).collect()
    }

    /// Pressed specimens have arrows towards their ends, pulled ones away from them, confined ones three more on each side; lengths are to
    /// scale and written.
    #[test]
    fn specimens_have_their_size_and_loads() {
        for (is_pulled, is_confined, count) in [(false, false, 2), (true, false, 2), (false, true, 8)] {
            let sketch = loaded([0.05, 0.1], Ends::Plates, is_pulled, is_confined);
            assert!(sketch.contains("50.00 mm × 100.0 mm"), "{sketch}");
            let found = shafts(&sketch);
            assert_eq!(found.len(), count, "{sketch}");
            let middle = 0.5 * SIZE[1];
            for [x1, y1, x2, y2] in found {
                if x1 == x2 {
                    assert_eq!((y2 - middle).abs() > (y1 - middle).abs(), is_pulled, "{y1} {y2}");
                } else {
                    assert!((x2 - 0.5 * SIZE[0]).abs() < (x1 - 0.5 * SIZE[0]).abs(), "{x1} {x2}");
                }
            }
            let (_, body) = sketch.split_once("width=\"").expect("a body");
            let width: f64 = body.split('"').next().unwrap_or_default().parse().expect("a number");
            let (_, body) = body.split_once("height=\"").expect("a body");
            let height: f64 = body.split('"').next().unwrap_or_default().parse().expect("a number");
            assert!((height / width - 2.0).abs() < 0.01, "{height} {width}");
        }
    }

    /// Supports stand at the span, rollers of four-point bending at the inner one, and the notch has its depth.
    #[test]
    fn beams_have_their_supports_and_notch() {
        let beam =
            |inner_span: f64, notch: Option<f64>| Beam { width: 0.05, height: 0.1, span: 0.3, inner_span, notch };
        let scale = Sketch::new([0.4, 0.1]).scale;
        for (inner, rollers) in [(0.0, 1), (0.1, 2)] {
            let sketch = bent(&beam(inner, Some(0.02)), 0.4);
            let supports: Vec<f64> = numbers(&sketch, "<path d=\"M")
                .iter()
                .filter(|path| path.len() != 4 && path[1] > 0.5 * SIZE[1])
                .map(|path| path[0])
                .collect();
            assert_eq!(supports.len(), 2, "{sketch}");
            assert!((supports[1] - supports[0] - 0.3 * scale).abs() < 0.2, "{supports:?}");
            let found = shafts(&sketch);
            assert_eq!(found.len(), rollers);
            assert!((found[rollers - 1][0] - found[0][0] - inner * scale).abs() < 0.2, "{found:?}");
            assert!(sketch.contains("l = 300.0 mm, h = 100.0 mm, a₀ = 20.00 mm"), "{sketch}");
            assert_eq!(sketch.contains("rollers 100.0 mm apart"), inner > 0.0);
        }
    }
}
