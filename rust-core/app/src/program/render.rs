//! `concordem render`: pictures of a result as PNG.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::measure::particle_stresses;
use super::so_far::open_result;
use super::{Console, Failure};
use crate::output::{OutputError, ResultFile, sealed};
use crate::pictures::{Moments, Picture, PictureError, Request, Section, Shown, picture};
use concordem_contact::math::{Mat3, Vec3};
use concordem_scenario::schema::Scenario;
use concordem_scenario::schema::quantity::{Length, Time};

/// Arguments of `concordem render`.
#[derive(Debug, clap::Args)]
pub(super) struct RenderArguments {
    /// Result
    file: PathBuf,
    /// File to write; by default the name of the result with .png
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long, short)]
    force: bool,
    /// What to draw, separated by commas; the last one of particles, bonds, cracks has the colors, those before it are pale
    #[arg(long, value_enum, value_delimiter = ',', default_value = "particles,walls,cell")]
    show: Vec<Shown>,
    /// Field that gives the color. Particles: any field of the snapshots, speed, diameter, stress, stress-xx, strain-xx, principal-strain, ...; default
    /// damage, or speed without bonds. Bonds: damage (default), normal-force, shear-force, opening. Cracks: mode (default), time, opening, slip, energy
    #[arg(long, value_name = "FIELD")]
    color: Option<String>,
    /// Values at both ends of the colors, in SI units: 0,2.5; by default the smallest and the largest one
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, allow_hyphen_values = true)]
    range: Option<[f64; 2]>,
    /// Direction of the eye from the body: x, -y, z, or three numbers 1,-2,1; by default obliquely from the front, of a plane body from above
    #[arg(long, value_name = "DIRECTION", value_parser = direction, allow_hyphen_values = true)]
    view: Option<Vec3>,
    /// Only what a plane cuts, seen from its front: y through the middle, or "y=2 mm"
    #[arg(long, value_name = "PLANE", value_parser = section)]
    slice: Option<Section>,
    /// Remove what lies between a plane and the eye: x through the middle, or "x=5 mm"; may be repeated
    #[arg(long, value_name = "PLANE", value_parser = section)]
    cut: Vec<Section>,
    /// Displacements times this factor
    #[arg(long, value_name = "NUMBER", default_value_t = 1.0)]
    magnify: f64,
    /// Time of the snapshot, "2 ms"; the nearest one is taken, by default the last. Repeated, it makes an animation
    #[arg(long, value_name = "TIME", value_parser = time, conflicts_with = "animate")]
    time: Vec<f64>,
    /// An animated PNG of all snapshots, or of at most so many, evenly chosen (60 without a number)
    #[arg(long, value_name = "N", num_args = 0..=1, require_equals = true, default_missing_value = "60",
          value_parser = clap::value_parser!(u32).range(2..=1000))]
    animate: Option<u32>,
    /// Images of an animation per second
    #[arg(long, value_name = "NUMBER", default_value_t = 10.0)]
    rate: f64,
    /// Width of the image in pixels, or width and height: 1200x800; by default the height fits the body
    #[arg(long, value_name = "SIZE", default_value = "1000", value_parser = size)]
    size: (usize, Option<usize>),
}

fn finite(text: &str) -> Result<f64, String> {
    let number: f64 = text.trim().parse().map_err(|_| format!("\"{text}\" is not a number"))?;
    if number.is_finite() { Ok(number) } else { Err(format!("\"{text}\" is not finite")) }
}

fn range(text: &str) -> Result<[f64; 2], String> {
    let (low, high) = text.split_once(',').ok_or("write two numbers: 0,2.5")?;
    Ok([finite(low)?, finite(high)?])
}

/// Reads a finite time with its unit, s.
///
/// # Errors
///
/// What is wrong with the text.
pub fn time(text: &str) -> Result<f64, String> {
    let time = Time::parse(text).map_err(|error| error.to_string())?.si();
    if time.is_finite() { Ok(time) } else { Err(format!("{text} must be finite")) }
}

fn axis(text: &str) -> Option<usize> {
    ["x", "y", "z"].iter().position(|name| *name == text.trim())
}

/// Reads the direction of the eye from the body: `x`, `-y`, or three numbers, `1,-2,1`.
///
/// # Errors
///
/// What is wrong with the text.
pub fn direction(text: &str) -> Result<Vec3, String> {
    let (sign, name) = text.strip_prefix('-').map_or((1.0, text), |name| (-1.0, name));
    if let Some(axis) = axis(name) {
        let mut direction = Vec3::zeros();
        direction[axis] = sign;
        return Ok(direction);
    }
    let numbers = text.split(',').map(finite).collect::<Result<Vec<f64>, _>>();
    match numbers.as_deref() {
        Ok(&[x, y, z]) if [x, y, z] != [0.0; 3] => Ok(Vec3::new(x, y, z)),
        _ => Err("write x, y, z, -x, -y, -z, or three numbers that are not all zero: 1,-2,1".to_owned()),
    }
}

/// Reads a plane: an axis, `y`, through the middle of the body, or its place, `y=2 mm`.
///
/// # Errors
///
/// What is wrong with the text.
pub fn section(text: &str) -> Result<Section, String> {
    let (name, place) = text.split_once('=').map_or((text, None), |(name, place)| (name, Some(place)));
    let axis = axis(name).ok_or("write an axis, x, y, or z, or its place: \"y=2 mm\"")?;
    let place = match place {
        Some(place) => Some(Length::parse(place.trim()).map_err(|error| error.to_string())?.si()),
        None => None,
    };
    if place.is_some_and(|place| !place.is_finite()) {
        return Err("the place must be finite".to_owned());
    }
    Ok(Section { axis, place })
}

/// Largest width and height, px: with four samples per pixel some gigabytes of memory.
const LARGEST: usize = 8000;

/// Reads the width of an image, or width and height, px: `800`, `1200x800`.
///
/// # Errors
///
/// What is wrong with the text.
pub fn size(text: &str) -> Result<(usize, Option<usize>), String> {
    let number = |text: &str| match text.trim().parse() {
        Ok(number) if (100..=LARGEST).contains(&number) => Ok(number),
        _ => Err(format!("write a width, or width and height, from 100 to {LARGEST}: 1200x800")),
    };
    match text.split_once('x') {
        Some((width, height)) => Ok((number(width)?, Some(number(height)?))),
        None => Ok((number(text)?, None)),
    }
}

impl RenderArguments {
    fn request(&self) -> Request {
        let moments = match (self.animate, &self.time[..]) {
            (Some(most), _) => Moments::All(most as usize),
            (None, []) => Moments::Last,
            (None, times) => Moments::Near(times.to_vec()),
        };
        Request {
            shown: self.show.clone(),
            color: self.color.clone(),
            range: self.range,
            direction: self.view,
            slice: self.slice,
            cuts: self.cut.clone(),
            size: self.size,
            magnify: self.magnify,
            moments,
            rate: self.rate,
        }
    }
}

pub(super) fn render(arguments: &RenderArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let output = arguments.output.as_deref();
    let (path, count) = render_result(&arguments.file, output, arguments.force, &arguments.request(), console)?;
    let images = if count > 1 { format!("{count} images in ") } else { String::new() };
    console.print(&format!("{images}{}\n", path.display()))
}

/// Writes a picture of a result, as `concordem render` does, and returns its path and the number of images in it. `output`: by default the
/// name of the result with .png. `overwrite`: replace an existing file.
///
/// # Errors
///
/// If the result cannot be read, does not have what is asked for, or the file cannot be written.
pub fn render_result(
    file: &Path,
    output: Option<&Path>,
    overwrite: bool,
    request: &Request,
    console: &mut Console<'_>,
) -> Result<(PathBuf, usize), Failure> {
    let result = open_result(file, console)?;
    let path = output.map_or_else(|| file.with_extension("png"), Path::to_owned);
    check_name(&path)?;
    let path = sealed::target(&path)?;
    if path.exists() && !overwrite {
        return Err(OutputError::Exists { path }.into());
    }
    let made = made(&result, request)?;
    sealed::write_bytes(&path, &made.png)?;
    made.notes.iter().for_each(|note| console.tell(note));
    Ok((path, made.images))
}

/// Draws a result.
pub(super) fn made(result: &ResultFile, request: &Request) -> Result<Picture, Failure> {
    let name = result.path().display().to_string();
    let scenario = Scenario::parse(&name, &result.scenario()?)?;
    let stress: Option<BTreeMap<u32, Mat3>> =
        if request.needs_stress() { Some(particle_stresses(result, &scenario)?.into_iter().collect()) } else { None };
    picture(result, &scenario, request, stress).map_err(|error| match error {
        PictureError::Output(error) => error.into(),
        other => Failure::Usage(format!("{name}: {other}")),
    })
}

/// Refuses names without the extension that viewers expect.
fn check_name(path: &Path) -> Result<(), Failure> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("png" | "apng") => Ok(()),
        _ => Err(Failure::Usage(format!(
            "{}: pictures and animations are PNG and need the extension .png or .apng; use {}",
            path.display(),
            path.with_extension("png").display()
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_planes_sizes_and_ranges_are_read() {
        assert_eq!(direction("-y"), Ok(-Vec3::y()));
        assert_eq!(direction("1,-2, 0.5"), Ok(Vec3::new(1.0, -2.0, 0.5)));
        assert!(["0,0,0", "1,2", "w", "1,2,inf"].iter().all(|text| direction(text).is_err()));
        assert_eq!(section("y"), Ok(Section { axis: 1, place: None }));
        assert_eq!(section("z=-2 mm"), Ok(Section { axis: 2, place: Some(-2e-3) }));
        assert!(["w", "y=3 s", "y=", ""].iter().all(|text| section(text).is_err()));
        assert_eq!((size("800"), size("800x600")), (Ok((800, None)), Ok((800, Some(600)))));
        assert!(["20", "800x", "9000", "-5"].iter().all(|text| size(text).is_err()));
        assert_eq!(range("-1e6,2"), Ok([-1e6, 2.0]));
        assert!(["1", "1,x", "1,nan"].iter().all(|text| range(text).is_err()));
    }
}
