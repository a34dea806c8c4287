//! Pictures of results: particles, bonds, cracks, and walls at chosen times, from any side, cut open or as a slice.

mod bodies;
mod fields;
mod request;
mod strain;
mod values;
mod walls;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::output::crack_faces::CrackFaces;
use crate::output::frames::{Frame, Frames};
use crate::output::{OutputError, ResultFile};
use crate::provenance::SCENARIO_FILE;
use bodies::Scene;
use concordem_contact::math::{Mat3, Vec3};
use concordem_picture::key::{INK, Key, draw_axes, draw_length};
use concordem_picture::{Camera, EncodingError, Image, Sheet, TEXT_HEIGHT, View, Wall, Walls, draw, png, text};
use concordem_scenario::schema::Scenario;
pub use request::{Moments, Request, Section, Shown};
use values::{Colored, Coloring};

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// The result has not what is asked for.
    #[error("{0}")]
    Unfit(String),
    /// The result cannot be read.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The file cannot be made.
    #[error(transparent)]
    Encoding(#[from] EncodingError),
}

/// A picture, or an animation.
#[derive(Debug)]
pub struct Picture {
    /// The file.
    pub png: Vec<u8>,
    /// Number of images in it.
    pub images: usize,
    /// What a reader of the picture must know.
    pub notes: Vec<String>,
}

/// Free border of the image, and room for the line of the time and for the scale and the axes below, px.
const BORDER: usize = 18;
const ABOVE: usize = TEXT_HEIGHT + 10;
const BELOW: usize = 84;
/// Least width of the drawing beside the key, px.
const LEAST: usize = 160;
/// Part of the longest edge of the body by which walls are drawn beyond it.
const BEYOND: f64 = 0.05;
/// Direction of the eye from a body: its front, somewhat from the right and from above.
const OBLIQUE: [f64; 3] = [0.55, -1.0, 0.45];

/// What all images of a picture share.
struct Source<'a> {
    result: &'a ResultFile,
    scenario: &'a Scenario,
    request: &'a Request,
    frames: Frames,
    /// Stress of each particle at the end, Pa, by its id, if it gives the color.
    stress: Option<BTreeMap<u32, Mat3>>,
    /// The cracks, if they are shown.
    cracks: Option<CrackFaces>,
    view: View,
}

/// Draws a result. `stress`: of each particle at the end, Pa, by its id, if [`Request::needs_stress`].
///
/// # Errors
/// The result has no snapshots, or not what the request asks for.
pub fn picture(
    result: &ResultFile,
    scenario: &Scenario,
    request: &Request,
    stress: Option<BTreeMap<u32, Mat3>>,
) -> Result<Picture, PictureError> {
    let times = result.snapshot_times()?;
    let chosen = request.moments.choose(&times).map_err(PictureError::Unfit)?;
    request.check(scenario, &times, &chosen).map_err(PictureError::Unfit)?;
    let frames = Frames::of_particles(result.root(), result.path())?;
    let view = view(request, scenario, &frames.read(0)?)?;
    let cracks = request.shows(Shown::Cracks).then(|| CrackFaces::of(result)).transpose()?;
    let source = Source { result, scenario, request, frames, stress, cracks, view };
    let mut notes = Vec::new();
    let scenes = chosen.iter().map(|&k| Scene::of(&source, k)).collect::<Result<Vec<Scene>, _>>()?;
    if let (Some(cracks), true) = (&source.cracks, scenes.iter().any(|scene| scene.has_cracks)) {
        notes.extend(left_out(cracks));
    }
    let colored: Vec<&Colored> = scenes.iter().filter_map(|scene| scene.colored.as_ref()).collect();
    let coloring = Coloring::of(&colored, request.range);
    let walls = if request.shows(Shown::Walls) {
        walls::of(result, scenario, &folder(result)?, &source.frames.read(0)?, &mut notes)?
    } else {
        Vec::new()
    };
    let layout = Layout::of(&source, &scenes, coloring.as_ref().map(Coloring::key))?;
    let mut images = Vec::new();
    let last = times.len() - 1;
    for (scene, &k) in scenes.iter().zip(&chosen) {
        let shown: Vec<&walls::Placed> = walls.iter().filter(|wall| wall.stays || k == last).collect();
        images.push(layout.image(scene, coloring.as_ref(), &shown));
    }
    if let Some(wall) = walls.iter().find(|wall| !wall.stays)
        && chosen.iter().any(|&k| k != last)
    {
        notes.push(format!("the wall “{}” has moved; it is drawn at the end only", wall.name));
    }
    Ok(Picture { images: images.len(), png: png(&images, request.rate)?, notes })
}

/// The folder of the scenario, to which the files of walls refer.
fn folder(result: &ResultFile) -> Result<PathBuf, OutputError> {
    let provenance = result.provenance()?;
    let file = provenance.into_iter().find(|(name, _)| name == SCENARIO_FILE).map(|(_, file)| PathBuf::from(file));
    Ok(file.as_deref().and_then(Path::parent).unwrap_or(Path::new("")).to_owned())
}

/// Bonds that broke but have no face.
fn left_out(cracks: &CrackFaces) -> Option<String> {
    let count = cracks.without_face;
    (count > 0)
        .then(|| format!("{count} broken bonds are not drawn, because the cells of their particles do not touch"))
}

/// The view that is asked for; across a slice; of a plane body from above, of others obliquely from the front.
fn view(request: &Request, scenario: &Scenario, first: &Frame) -> Result<View, PictureError> {
    let radius = fields::reals(first, "radius").iter().copied().fold(0.0, f64::max);
    let heights = first.points.iter().skip(2).step_by(3);
    let [low, high] = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(*z), high.max(*z)]);
    let is_plane = scenario.dimension == 2 || high - low < 0.01 * radius;
    let direction = match (&request.slice, &request.direction) {
        (Some(slice), _) => slice.from(),
        (None, Some(direction)) => *direction,
        (None, None) if is_plane => Vec3::z(),
        (None, None) => Vec3::from(OBLIQUE),
    };
    View::from_direction(&direction).ok_or_else(|| PictureError::Unfit("the direction of the view is zero".to_owned()))
}

/// Where everything is on the images.
struct Layout {
    size: [usize; 2],
    camera: Camera,
    /// Right end and bottom of the drawing.
    end: [usize; 2],
    key: Option<Key>,
    /// Place of a slice or of a plane body towards the eye, m.
    section: Option<f64>,
    /// Box in which walls are drawn, m.
    bounds: [Vec3; 2],
}

impl Layout {
    fn of(source: &Source<'_>, scenes: &[Scene], key: Option<Key>) -> Result<Self, PictureError> {
        let extents = scenes.iter().filter_map(|scene| scene.extent(&source.view));
        let extent = extents.reduce(|[low, high], other| [low.inf(&other[0]), high.sup(&other[1])]);
        let Some(extent) = extent.filter(|[low, high]| (high - low).iter().all(|length| length.is_finite())) else {
            return Err(PictureError::Unfit("there is nothing to draw".to_owned()));
        };
        let (width, height) = source.request.size;
        let beside = key.as_ref().map_or(0, |key| key.width() + BORDER);
        let Some(across) = width.checked_sub(2 * BORDER + beside).filter(|across| *across >= LEAST) else {
            return Err(PictureError::Unfit(format!(
                "an image of {width} pixels has no room for the body beside the key; make it at least {} wide",
                2 * BORDER + beside + LEAST
            )));
        };
        let shape = (extent[1].y - extent[0].y) / (extent[1].x - extent[0].x).max(f64::MIN_POSITIVE);
        let fitting = (shape * across as f64).clamp(0.25 * width as f64, 1.25 * width as f64).round() as usize;
        let others = 2 * BORDER + ABOVE + BELOW;
        let height = height.unwrap_or(fitting + others);
        let Some(tall) = height.checked_sub(others).filter(|tall| *tall >= LEAST / 2) else {
            return Err(PictureError::Unfit(format!("an image must be at least {} high", others + LEAST / 2)));
        };
        let camera = Camera::around(source.view, &extent, [BORDER, BORDER + ABOVE, across, tall]);
        let section = scenes.iter().find_map(|scene| scene.section);
        // Walls are drawn a little beyond the particles. The world is a view along z.
        let world = View { right: Vec3::x(), up: Vec3::y(), towards: Vec3::z() };
        let boxes = scenes.iter().filter_map(|scene| scene.extent(&world));
        let [low, high] =
            boxes.reduce(|[low, high], other| [low.inf(&other[0]), high.sup(&other[1])]).unwrap_or(extent);
        let beyond = Vec3::repeat(BEYOND * (high - low).max());
        let bounds = [low - beyond, high + beyond];
        Ok(Self { size: [width, height], camera, end: [BORDER + across, BORDER + ABOVE + tall], key, section, bounds })
    }

    fn image(&self, scene: &Scene, coloring: Option<&Coloring>, walls: &[&walls::Placed]) -> Image {
        let mut image = Image::white(self.size[0], self.size[1]);
        let elements: Vec<(walls::Element<'_>, Option<(Vec3, f64)>)> =
            walls.iter().flat_map(|wall| wall.elements()).collect();
        let sheets =
            elements.iter().map(|(element, ball)| Wall { sheet: element as &dyn Sheet, ball: *ball }).collect();
        let walls = Walls { all: sheets, section: self.section, bounds: self.bounds };
        draw(&mut image, &scene.layers(coloring), &walls, &self.camera);
        text(&mut image, &moment(scene.time), [BORDER as i64, BORDER as i64 - 4], INK);
        let below = (self.size[1] - BORDER) as i64;
        let room = (self.end[0] - BORDER) as f64;
        draw_length(&mut image, &self.camera, room, [self.end[0] as i64, below]);
        draw_axes(&mut image, &self.camera, [BORDER as f64 + 22.0, below as f64 - 18.0]);
        if let Some(key) = &self.key {
            let top = (BORDER + ABOVE) as i64;
            let height = (self.end[1] as i64 - top).min(420);
            key.draw(&mut image, [(self.end[0] + BORDER) as i64, top, height]);
        }
        image
    }
}

/// A time with four digits in a unit that fits it.
fn moment(time: f64) -> String {
    let (unit, factor) = match time.abs() {
        t if t >= 1.0 || t == 0.0 => ("s", 1.0),
        t if t >= 1e-3 => ("ms", 1e3),
        t if t >= 1e-6 => ("µs", 1e6),
        _ => ("ns", 1e9),
    };
    let number = time * factor;
    let digits = [1e3, 1e2, 1e1].iter().position(|power| number.abs() >= *power).unwrap_or(3);
    format!("t = {number:.digits$} {unit}")
}

#[cfg(test)]
mod tests {
    use super::moment;

    #[test]
    fn times_have_four_digits() {
        assert_eq!(
            [0.0, 1.5e-3, 123.4e-6, 4321.0].map(moment),
            ["t = 0.000 s", "t = 1.500 ms", "t = 123.4 µs", "t = 4321 s"]
        );
    }
}
