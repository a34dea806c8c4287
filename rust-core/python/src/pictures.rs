//! Pictures and figures of results, as the program writes them.

use std::path::PathBuf;

use concordem::pictures::{Moments, Request, Section, Shown};
use concordem::program::plot::{PlotArguments, plot_results, size as size_of_figure};
use concordem::program::render::{direction, render_result, section, size as size_of_picture, time as time_of};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBool;

use crate::commands::{call, result_of, results_of};

/// What a reader of texts makes of an argument, which is a text, a number, or several numbers.
fn read<T>(name: &str, given: &Bound<'_, PyAny>, read: impl Fn(&str) -> Result<T, String>) -> PyResult<T> {
    let text = if let Ok(text) = given.extract::<String>() {
        text
    } else if let Ok(number) = given.extract::<f64>() {
        number.to_string()
    } else {
        let numbers: Vec<f64> =
            given.extract().map_err(|_| PyTypeError::new_err(format!("{name} is {given}; give a text or numbers")))?;
        numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
    };
    read(&text).map_err(|reason| PyValueError::new_err(format!("{name}: {reason}")))
}

/// One item, or each item of a sequence; a text is one item.
fn items<'py>(given: &Bound<'py, PyAny>) -> PyResult<Vec<Bound<'py, PyAny>>> {
    if given.extract::<String>().is_ok() || given.try_iter().is_err() {
        return Ok(vec![given.clone()]);
    }
    given.try_iter()?.collect()
}

fn shown(given: &Bound<'_, PyAny>) -> PyResult<Shown> {
    let name: String = given.extract().map_err(|_| PyTypeError::new_err(format!("show has {given}; give names")))?;
    Shown::of_name(&name).map_err(|names| PyValueError::new_err(format!("show has \"{name}\"; give some of {names}")))
}

/// Both ends of the colors.
fn ends(given: &Bound<'_, PyAny>) -> PyResult<[f64; 2]> {
    match given.extract::<[f64; 2]>() {
        Ok(ends) if ends.iter().all(|end| end.is_finite()) => Ok(ends),
        _ => Err(PyValueError::new_err(format!("range is {given}; give two finite numbers"))),
    }
}

/// A time: a number, s, or a text with a unit.
fn moment(given: &Bound<'_, PyAny>) -> PyResult<f64> {
    match given.extract::<f64>() {
        Ok(seconds) if seconds.is_finite() => Ok(seconds),
        _ => read("time", given, time_of),
    }
}

/// The moments that two arguments choose.
fn moments(time: Option<&Bound<'_, PyAny>>, animate: Option<&Bound<'_, PyAny>>) -> PyResult<Moments> {
    let most = match animate {
        None => None,
        Some(given) if given.is_instance_of::<PyBool>() => given.extract::<bool>()?.then_some(60),
        Some(given) => match given.extract::<usize>() {
            Ok(most @ 2..=1000) => Some(most),
            _ => return Err(PyValueError::new_err(format!("animate is {given}; give True, or 2 to 1000 images"))),
        },
    };
    match (time, most) {
        (Some(_), Some(_)) => Err(PyValueError::new_err("give either time or animate")),
        (None, Some(most)) => Ok(Moments::All(most)),
        (Some(times), None) => Ok(Moments::Near(items(times)?.iter().map(moment).collect::<PyResult<_>>()?)),
        (None, None) => Ok(Moments::Last),
    }
}

/// Write a picture or an animation of a result as PNG, as `concordem render` does. Equal results give equal bytes.
///
/// Parameters
/// ----------
/// result : Result, or path of a result.
/// output : path of the picture; by default the name of the result with .png.
/// overwrite : whether to replace a file.
/// show : what to draw: "particles", "bonds", "cracks", "walls", "cell". The last one of particles, bonds, cracks has the colors.
/// color : field that gives the color: of particles any field of the snapshots, "speed", "diameter", "stress-zz", ...; of bonds "damage",
///     "normal-force", "shear-force", "opening"; of cracks "mode", "time", "opening", "slip", "energy".
/// range : values at both ends of the colors, in SI units.
/// view : direction of the eye from the body: "x", "-y", or three numbers.
/// slice : show only what this plane cuts: "y" through the middle, or "y=2 mm".
/// cut : remove what lies between this plane, or these planes, and the eye.
/// magnify : factor of the displacements.
/// time : of the snapshot, s, or a text with a unit; the nearest one is taken, by default the last. Several times make an animation.
/// animate : True, or the largest number of images, for an animation of all snapshots.
/// rate : images of an animation per second.
/// size : width of the image, or width and height, px.
///
/// Returns
/// -------
/// pathlib.Path : the picture.
///
/// Raises
/// ------
/// ValueError : the run does not have what is asked for. ResultError : the result cannot be read, or the file exists.
///
/// >>> import concordem, tempfile
/// >>> folder = tempfile.mkdtemp()
/// >>> result = concordem.run(concordem.Scenario.template("hertz-impact"), f"{folder}/impact.h5", threads=1)
/// >>> concordem.render(result, view="-y", color="speed", size=400).name
/// 'impact.png'
#[pyfunction]
#[pyo3(signature = (
    result, output=None, overwrite=false, show=None, color=None, range=None, view=None, slice=None, cut=None, magnify=1.0, time=None, animate=None,
    rate=10.0, size=None
))]
#[allow(clippy::too_many_arguments)]
fn render(
    py: Python<'_>,
    result: &Bound<'_, PyAny>,
    output: Option<PathBuf>,
    overwrite: bool,
    show: Option<&Bound<'_, PyAny>>,
    color: Option<String>,
    range: Option<&Bound<'_, PyAny>>,
    view: Option<&Bound<'_, PyAny>>,
    slice: Option<&Bound<'_, PyAny>>,
    cut: Option<&Bound<'_, PyAny>>,
    magnify: f64,
    time: Option<&Bound<'_, PyAny>>,
    animate: Option<&Bound<'_, PyAny>>,
    rate: f64,
    size: Option<&Bound<'_, PyAny>>,
) -> PyResult<PathBuf> {
    let file = result_of(result)?;
    let usual = Request::default();
    let plane =
        |name: &'static str| move |given: &Bound<'_, PyAny>| -> PyResult<Section> { read(name, given, section) };
    let size = match size {
        None => usual.size,
        Some(given) => read("size", given, |text| size_of_picture(&text.replace(',', "x")))?,
    };
    let request = Request {
        shown: match show {
            None => usual.shown,
            Some(given) => items(given)?.iter().map(shown).collect::<PyResult<_>>()?,
        },
        color,
        range: range.map(ends).transpose()?,
        direction: view.map(|given| read("view", given, direction)).transpose()?,
        slice: slice.map(plane("slice")).transpose()?,
        cuts: match cut {
            None => Vec::new(),
            Some(given) => items(given)?.iter().map(plane("cut")).collect::<PyResult<_>>()?,
        },
        size,
        magnify,
        moments: moments(time, animate)?,
        rate,
    };
    Ok(call(py, None, |console| render_result(&file, output.as_deref(), overwrite, &request, console))?.0)
}

/// Write a figure of one sampled quantity over another, of one or more results, as SVG or PDF, as `concordem plot` does. To draw into axes of
/// matplotlib, use `plot`.
///
/// Parameters
/// ----------
/// results : Result or path, or several of them.
/// output : path of the figure, .svg or .pdf; by default the name of the first result with .svg.
/// overwrite : whether to replace a file.
/// x, y : names of the quantities; by default strain and stress, or time and kinetic energy of runs without.
/// mean : one curve for all results with the same title: their mean, with a band of one standard deviation to both sides.
/// compression : whether compression is drawn to the right and up.
/// size : width and height with units.
///
/// Returns
/// -------
/// pathlib.Path : the figure.
///
/// Raises
/// ------
/// ValueError : a quantity is missing, or there is nothing to draw. ResultError : a result cannot be read, or the file exists.
///
/// >>> import concordem, tempfile
/// >>> folder = tempfile.mkdtemp()
/// >>> result = concordem.run(concordem.Scenario.template("hertz-impact"), f"{folder}/impact.h5", threads=1)
/// >>> concordem.figure(result, x="time", y="kinetic").name
/// 'impact.svg'
#[pyfunction]
#[pyo3(signature = (results, output=None, overwrite=false, x=None, y=None, mean=false, compression=false, size="85 mm,60 mm"))]
#[allow(clippy::too_many_arguments)]
fn figure(
    py: Python<'_>,
    results: &Bound<'_, PyAny>,
    output: Option<PathBuf>,
    overwrite: bool,
    x: Option<String>,
    y: Option<String>,
    mean: bool,
    compression: bool,
    size: &str,
) -> PyResult<PathBuf> {
    let files = results_of(results)?;
    let size = size_of_figure(size).map_err(|reason| PyValueError::new_err(format!("size: {reason}")))?;
    let arguments = PlotArguments { files, output, force: overwrite, x, y, mean, compression, size };
    call(py, None, |console| plot_results(&arguments, console))
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(render, module)?)?;
    module.add_function(wrap_pyfunction!(figure, module)?)
}
