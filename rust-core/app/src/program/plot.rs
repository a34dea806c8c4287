//! `concordem plot`: a figure of one sampled quantity over another, of one or more results.

use std::path::PathBuf;

use super::so_far::open_result;
use super::{Console, Failure};
use crate::figure::{Curve, Figure};
use crate::output::{OutputError, ResultFile, sealed};
use crate::prefix::with_prefix;
use concordem_scenario::schema::quantity::Length;

/// Points of a mean curve.
const POINTS: usize = 400;
/// Points per meter.
const PT: f64 = 72.0 / 25.4e-3;
/// Smallest and largest edge of a figure, m.
const EDGES: [f64; 2] = [0.04, 1.0];

/// Arguments of `concordem plot`.
#[derive(Debug, clap::Args)]
pub struct PlotArguments {
    /// Results
    #[arg(required = true)]
    pub files: Vec<PathBuf>,
    /// Figure to write, FILE.svg or FILE.pdf; by default the name of the first result with .svg
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long, short)]
    pub force: bool,
    /// Quantity to the right; by default the strain, or the time of runs without
    #[arg(long, value_name = "SERIES")]
    pub x: Option<String>,
    /// Quantity up; by default the stress, or the kinetic energy of runs without
    #[arg(long, value_name = "SERIES")]
    pub y: Option<String>,
    /// One curve for all results with the same title: their mean, with a band of one standard deviation to both sides
    #[arg(long)]
    pub mean: bool,
    /// Draw compression to the right and up
    #[arg(long)]
    pub compression: bool,
    /// Width and height of the figure: "85 mm,60 mm"
    #[arg(long, value_name = "WIDTH,HEIGHT", default_value = "85 mm,60 mm", value_parser = size)]
    pub size: [f64; 2],
}

/// Reads width and height of a figure with their units, `85 mm,60 mm`; returns them in pt.
///
/// # Errors
///
/// What is wrong with the text.
pub fn size(text: &str) -> Result<[f64; 2], String> {
    let edge = |text: &str| {
        let length = Length::parse(text.trim()).map_err(|error| error.to_string())?.si();
        let [least, most] = EDGES;
        let is_fit = (least..=most).contains(&length);
        is_fit
            .then_some((length * PT * 100.0).round() / 100.0)
            .ok_or_else(|| format!("{text}: an edge is from 40 mm to 1 m"))
    };
    let (width, height) = text.split_once(',').ok_or("write width and height: \"85 mm,60 mm\"")?;
    Ok([edge(width)?, edge(height)?])
}

/// A result as a curve, in SI units.
struct Run {
    file: String,
    title: String,
    points: Vec<[f64; 2]>,
}

pub(super) fn plot(arguments: &PlotArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let path = plot_results(arguments, console)?;
    console.print(&format!("{}\n", path.display()))
}

/// Writes a figure of results, as `concordem plot` does, and returns its path.
///
/// # Errors
///
/// If a result cannot be read or does not have the series, there is no result, or the file cannot be written.
pub fn plot_results(arguments: &PlotArguments, console: &mut Console<'_>) -> Result<PathBuf, Failure> {
    if arguments.files.is_empty() {
        return Err(Failure::Usage("there is no result to draw".to_owned()));
    }
    let results = arguments.files.iter().map(|path| open_result(path, console)).collect::<Result<Vec<_>, _>>()?;
    let path = arguments.output.clone().unwrap_or_else(|| arguments.files[0].with_extension("svg"));
    let is_pdf = match path.extension().and_then(|extension| extension.to_str()) {
        Some("svg") => false,
        Some("pdf") => true,
        _ => {
            return Err(Failure::Usage(format!("{}: a figure is .svg or .pdf", path.display())));
        }
    };
    let path = sealed::target(&path)?;
    if path.exists() && !arguments.force {
        return Err(OutputError::Exists { path }.into());
    }
    let figure = figure(&results, arguments)?;
    let nothing = || Failure::Usage("there are no finite values to draw".to_owned());
    if is_pdf {
        sealed::write_bytes(&path, &figure.pdf().ok_or_else(nothing)?)?;
    } else {
        sealed::write_text(&path, &figure.svg().ok_or_else(nothing)?)?;
    }
    Ok(path)
}

fn figure(results: &[ResultFile], arguments: &PlotArguments) -> Result<Figure, Failure> {
    let names = names(&results[0], arguments)?;
    let sign = |name: &str| if arguments.compression && is_signed(name) { -1.0 } else { 1.0 };
    if arguments.compression && !names.iter().any(|name| is_signed(name)) {
        let message = format!("compression: neither {} nor {} is a strain or a stress", names[0], names[1]);
        return Err(Failure::Usage(message));
    }
    let signs = [sign(&names[0]), sign(&names[1])];
    let runs = results.iter().map(|result| run(result, &names, signs)).collect::<Result<Vec<Run>, _>>()?;
    let mut curves = if arguments.mean { means(runs)? } else { runs.into_iter().map(alone).collect() };
    let mut labels = [String::new(), String::new()];
    for axis in 0..2 {
        let unit = results[0].unit("samples", &names[axis])?;
        let (label, factor) = label(&names[axis], &unit, signs[axis], range(&curves, axis));
        labels[axis] = label;
        for curve in &mut curves {
            curve.points.iter_mut().for_each(|point| point[axis] *= factor);
            if axis == 1 {
                curve.band.iter_mut().flatten().for_each(|end| *end *= factor);
            }
        }
    }
    Ok(Figure { labels, curves, size: arguments.size })
}

/// Names of the series that are asked for, or that say most of the first result.
fn names(result: &ResultFile, arguments: &PlotArguments) -> Result<[String; 2], Failure> {
    let changes = |name: &str| -> Result<bool, Failure> {
        Ok(result.has_series(name) && result.samples(name)?.iter().any(|value| *value != 0.0))
    };
    // Runs without loading record zeros.
    let usual = if changes("strain")? && changes("stress")? { ["strain", "stress"] } else { ["time", "kinetic"] };
    let [x, y] = usual.map(str::to_owned);
    Ok([arguments.x.clone().unwrap_or(x), arguments.y.clone().unwrap_or(y)])
}

/// Whether tension is positive in a series.
fn is_signed(name: &str) -> bool {
    matches!(name, "strain" | "stress" | "gauge_strain")
}

fn run(result: &ResultFile, names: &[String; 2], signs: [f64; 2]) -> Result<Run, Failure> {
    let [x, y] = [result.history(&names[0])?, result.history(&names[1])?];
    let file = result.path().file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let scenario = toml::from_str::<toml::Table>(&result.scenario()?).unwrap_or_default();
    let title = scenario.get("title").and_then(toml::Value::as_str).unwrap_or(&file).to_owned();
    let points = x.into_iter().zip(y).map(|(x, y)| [signs[0] * x, signs[1] * y]).collect();
    Ok(Run { file, title, points })
}

fn alone(run: Run) -> Curve {
    Curve { name: run.file, points: run.points, band: Vec::new() }
}

/// One curve for each title, in the order of the files.
fn means(runs: Vec<Run>) -> Result<Vec<Curve>, Failure> {
    let mut groups: Vec<(String, Vec<Run>)> = Vec::new();
    for run in runs {
        match groups.iter_mut().find(|(title, _)| *title == run.title) {
            Some((_, group)) => group.push(run),
            None => groups.push((run.title.clone(), vec![run])),
        }
    }
    let curve = |(title, mut group): (String, Vec<Run>)| match group.len() {
        1 => Ok(Curve { name: title, ..alone(group.remove(0)) }),
        _ => mean_of(&title, &group),
    };
    groups.into_iter().map(curve).collect()
}

/// Mean and standard deviation over the abscissas that all runs have.
fn mean_of(title: &str, group: &[Run]) -> Result<Curve, Failure> {
    let mut from = f64::NEG_INFINITY;
    let mut to = f64::INFINITY;
    for run in group {
        let rises = run.points.windows(2).all(|pair| pair[1][0] >= pair[0][0]);
        let falls = run.points.windows(2).all(|pair| pair[1][0] <= pair[0][0]);
        let (Some(first), Some(last)) = (run.points.first(), run.points.last()) else {
            return Err(Failure::Usage(format!("{}: there are no samples", run.file)));
        };
        if !(rises || falls) {
            return Err(Failure::Usage(format!(
                "{}: a mean needs abscissas that only rise or only fall; choose another x, such as time",
                run.file
            )));
        }
        from = from.max(first[0].min(last[0]));
        to = to.min(first[0].max(last[0]));
    }
    if from >= to {
        return Err(Failure::Usage(format!("the results of “{title}” have no abscissas in common")));
    }
    let abscissas = (0..POINTS).map(|k| from + (to - from) * k as f64 / (POINTS - 1) as f64);
    let (mut points, mut band) = (Vec::new(), Vec::new());
    for x in abscissas {
        let values: Vec<f64> = group.iter().map(|run| at(&run.points, x)).collect();
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let deviation = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
        points.push([x, mean]);
        band.push([mean - deviation, mean + deviation]);
    }
    Ok(Curve { name: format!("{title}, mean of {}", group.len()), points, band })
}

/// The ordinate at an abscissa, on the line between two points; the abscissas rise or fall.
fn at(points: &[[f64; 2]], x: f64) -> f64 {
    let falls = points[points.len() - 1][0] < points[0][0];
    let next = points.partition_point(|point| if falls { point[0] > x } else { point[0] < x });
    let next = next.clamp(1, points.len() - 1);
    let ([x0, y0], [x1, y1]) = (points[next - 1], points[next]);
    if x1 == x0 { y1 } else { y0 + (y1 - y0) * ((x - x0) / (x1 - x0)).clamp(0.0, 1.0) }
}

/// Lowest and highest value along an axis.
fn range(curves: &[Curve], axis: usize) -> [f64; 2] {
    let values = curves.iter().flat_map(|curve| curve.points.iter().map(|point| point[axis]));
    values
        .filter(|value| value.is_finite())
        .fold([0.0, 0.0], |[low, high], value| [f64::min(low, value), f64::max(high, value)])
}

/// Label of an axis, and factor of its values.
fn label(name: &str, unit: &str, sign: f64, range: [f64; 2]) -> (String, f64) {
    let words = name.replace('_', " ");
    let words = if sign < 0.0 { format!("compressive {words}") } else { words };
    if name.ends_with("strain") {
        return (format!("{words}, ‰"), 1e3);
    }
    let (unit, factor) = with_prefix(unit, range);
    (if unit.is_empty() { words } else { format!("{words}, {unit}") }, factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(file: &str, points: &[[f64; 2]]) -> Run {
        Run { file: file.to_owned(), title: "one".to_owned(), points: points.to_vec() }
    }

    /// Of y = x, y = 3 x, and y = 2 x, with other abscissas each, the mean is 2 x and the deviation x, where all three are.
    #[test]
    fn mean_and_deviation_of_lines() {
        let runs = [
            line("a", &[[0.0, 0.0], [1.0, 1.0], [4.0, 4.0]]),
            line("b", &[[0.5, 1.5], [3.0, 9.0]]),
            line("c", &[[5.0, 10.0], [2.0, 4.0], [0.0, 0.0]]),
        ];
        let curve = mean_of("one", &runs).unwrap();
        assert_eq!((curve.points.len(), curve.points[0][0], curve.points[POINTS - 1][0]), (POINTS, 0.5, 3.0));
        for ([x, mean], [low, high]) in curve.points.iter().zip(&curve.band) {
            // Rounding of some operations.
            assert!((mean - 2.0 * x).abs() < 1e-14 && (low - x).abs() < 1e-14 && (high - 3.0 * x).abs() < 2e-14, "{x}");
        }
        assert_eq!(curve.name, "one, mean of 3");
        assert!(mean_of("one", &[line("a", &[[0.0, 0.0], [1.0, 1.0], [0.5, 0.0]])]).is_err());
        assert!(mean_of("one", &[line("a", &[[0.0, 0.0], [1.0, 1.0]]), line("b", &[[2.0, 0.0], [3.0, 1.0]])]).is_err());
    }

    #[test]
    fn labels_and_sizes() {
        assert_eq!(label("strain", "1", -1.0, [0.0, 1e-3]), ("compressive strain, ‰".to_owned(), 1e3));
        assert_eq!(label("stress", "Pa", 1.0, [-4e6, 0.0]), ("stress, MPa".to_owned(), 1e-6));
        assert_eq!(label("kinetic", "J", 1.0, [0.0, 0.0]), ("kinetic, J".to_owned(), 1.0));
        assert_eq!(size("25.4 mm,50.8 mm"), Err("25.4 mm: an edge is from 40 mm to 1 m".to_owned()));
        assert_eq!(size("50.8 mm, 0.0762 m"), Ok([144.0, 216.0]));
        assert!(size("80 mm").is_err() && size("80,60 s").is_err());
    }
}
