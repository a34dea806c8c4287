//! Particles, bonds, and cracks of a snapshot as bodies to draw.

use std::collections::HashMap;

use concordem_contact::math::{Mat3, Vec3};
use concordem_picture::colors::pale;
use concordem_picture::key::INK;
use concordem_picture::{Cut, Layer, Line, Polygon, Rod, Sphere, View};
use concordem_solver::state::columns::ColumnData;

use super::fields::{self, vectors};
use super::request::{Section, Shown};
use super::values::{self, Colored, Coloring, PLAIN};
use super::{PictureError, Source};
use crate::output::crack_faces::CrackFace;
use crate::output::export::Lines;
use crate::output::frames::Frame;

/// Radius of a rod over the mean radius of the particles; of the line of a crack in the plane.
const ROD: f64 = 0.22;
const CRACK: f64 = 0.3;
/// Cosine between view and plane below which the plane is seen from its edge.
const EDGEWISE: f64 = 1e-6;

/// Bodies of one image, without their colors.
pub(super) struct Scene {
    /// Time of the snapshot, s.
    pub time: f64,
    /// Place of a slice or of a plane body towards the eye, m.
    pub section: Option<f64>,
    /// Whether the cracks are shown.
    pub has_cracks: bool,
    /// Values of the foremost bodies.
    pub colored: Option<Colored>,
    foremost: Option<Shown>,
    spheres: Vec<(usize, Vec3, f64)>,
    rods: Vec<(usize, [Vec3; 2], f64)>,
    faces: Vec<(usize, Vec<Vec3>)>,
    lines: Vec<[Vec3; 2]>,
    cuts: Vec<Cut>,
    is_flat: bool,
}

impl Scene {
    /// The bodies of snapshot `k`.
    pub(super) fn of(source: &Source<'_>, k: usize) -> Result<Self, PictureError> {
        let request = source.request;
        let frame = source.frames.read(k)?;
        let first = source.frames.read(0)?;
        let radius = fields::reals(&frame, "radius").to_vec();
        let mean = radius.iter().sum::<f64>() / radius.len().max(1) as f64;
        let cell = frame.cell.map(|edges| Mat3::from_columns(&edges.map(Vec3::from)));
        let is_reference = request.shows(Shown::Cracks);
        let centers = if is_reference { vectors(&first.points) } else { magnified(&frame, request.magnify) };
        let centers: Vec<Vec3> = centers.into_iter().map(|x| wrapped(x, cell.as_ref())).collect();
        let plane = |section: &Section| Plane::of(section, &vectors(&first.points));
        let slice = request.slice.as_ref().map(plane);
        let cuts =
            request.cuts.iter().map(|cut| plane(cut).seen_from(&source.view)).collect::<Result<Vec<Cut>, _>>()?;
        let is_plane = source.scenario.dimension == 2;
        let mut scene = Self {
            time: frame.time,
            section: match &slice {
                Some(plane) => Some(plane.normal.dot(&source.view.towards) * plane.place),
                None => is_plane.then_some(0.0),
            },
            has_cracks: is_reference,
            colored: None,
            foremost: request.foremost(),
            spheres: Vec::new(),
            rods: Vec::new(),
            faces: Vec::new(),
            lines: Vec::new(),
            cuts,
            is_flat: slice.is_some() || is_plane,
        };
        if request.shows(Shown::Particles) {
            for (p, (x, r)) in centers.iter().zip(&radius).enumerate() {
                match &slice {
                    None => scene.spheres.push((p, *x, *r)),
                    Some(plane) => scene.spheres.extend(plane.circle(*x, *r).map(|(x, r)| (p, x, r))),
                }
            }
        }
        let near = |x: &Vec3| slice.as_ref().is_none_or(|plane| plane.distance(x).abs() <= mean);
        if request.shows(Shown::Bonds) {
            let lines = bonds_at(source, &frame, k)?;
            scene.rods = rods(&frame, &centers, &lines, ROD * mean);
            scene.rods.retain(|(_, ends, _)| near(&(0.5 * (ends[0] + ends[1]))));
            scene.colored =
                Some(values::of_bonds(&lines.fields, color_or(source, "damage")).map_err(PictureError::Unfit)?);
        }
        if let Some(cracks) = &source.cracks {
            for (n, crack) in cracks.faces.iter().enumerate().filter(|(_, crack)| crack.event.time <= frame.time) {
                let middle = crack.corners.iter().sum::<Vec3>() / crack.corners.len().max(1) as f64;
                match crack.corners[..] {
                    _ if !near(&middle) => {}
                    [a, b] => scene.rods.push((n, [a, b], CRACK * mean)),
                    _ => scene.faces.push((n, crack.corners.clone())),
                }
            }
            let wanted = color_or(source, "mode");
            scene.colored = Some(of_cracks(&cracks.faces, wanted).map_err(PictureError::Unfit)?);
            if request.shows(Shown::Bonds) {
                return Err(PictureError::Unfit(
                    "bonds are drawn in the body as it moves, cracks in the body before; show one of them".to_owned(),
                ));
            }
        }
        if scene.foremost == Some(Shown::Particles) {
            let name = color_or(source, values::usual(source.scenario));
            let colored = values::of_particles([&first, &frame], source.scenario, source.stress.as_ref(), name);
            scene.colored = Some(colored.map_err(PictureError::Unfit)?);
        }
        if let (true, Some(cell)) = (request.shows(Shown::Cell), &cell) {
            scene.lines = edges(cell, is_plane);
        }
        Ok(scene)
    }

    /// Lowest and highest coordinates in a view, m.
    pub(super) fn extent(&self, view: &View) -> Option<[Vec3; 2]> {
        let extents = self.layers(None).into_iter().filter_map(|layer| layer.extent(view));
        extents.reduce(|[low, high], other| [low.inf(&other[0]), high.sup(&other[1])])
    }

    /// The bodies with their colors: what is behind first.
    pub(super) fn layers(&self, coloring: Option<&Coloring>) -> Vec<Layer> {
        let color = |n: usize| match (coloring, &self.colored) {
            (Some(coloring), Some(colored)) => coloring.color(colored, n),
            _ => PLAIN,
        };
        let is_first = self.foremost == Some(Shown::Particles);
        let of_sphere = |n: usize| if is_first { color(n) } else { pale(PLAIN) };
        let sphere = |&(n, center, radius): &(usize, Vec3, f64)| Sphere { center, radius, color: of_sphere(n) };
        let line = |ends: &[Vec3; 2]| Line { ends: *ends, color: INK };
        let cuts = || self.cuts.clone();
        let body = Layer {
            spheres: self.spheres.iter().map(sphere).collect(),
            lines: self.lines.iter().map(line).collect(),
            cuts: cuts(),
            is_flat: self.is_flat,
            ..Layer::default()
        };
        if is_first {
            return vec![body];
        }
        let rod = |&(n, ends, radius): &(usize, [Vec3; 2], f64)| Rod { ends, radius, color: color(n) };
        let polygon = |(n, corners): &(usize, Vec<Vec3>)| Polygon { corners: corners.clone(), color: color(*n) };
        let over = Layer {
            rods: self.rods.iter().map(rod).collect(),
            polygons: self.faces.iter().map(polygon).collect(),
            cuts: cuts(),
            ..Layer::default()
        };
        vec![body, over]
    }
}

/// The field that is asked for, or another one.
fn color_or<'a>(source: &'a Source<'_>, usual: &'a str) -> &'a str {
    source.request.color.as_deref().unwrap_or(usual)
}

/// Centers with displacements times a factor.
fn magnified(frame: &Frame, factor: f64) -> Vec<Vec3> {
    let displacement = vectors(fields::reals(frame, "displacement"));
    let moved = |(x, u): (Vec3, &Vec3)| x + u * (factor - 1.0);
    let centers = vectors(&frame.points);
    if displacement.len() == centers.len() {
        centers.into_iter().zip(&displacement).map(moved).collect()
    } else {
        centers
    }
}

/// The image of a point in the periodic cell.
fn wrapped(x: Vec3, cell: Option<&Mat3>) -> Vec3 {
    let Some((cell, back)) = cell.and_then(|cell| Some((cell, cell.try_inverse()?))) else { return x };
    x - cell * (back * x).map(f64::floor)
}

/// The twelve edges of a cell, or the four in the plane.
fn edges(cell: &Mat3, is_plane: bool) -> Vec<[Vec3; 2]> {
    let edge = |k: usize| cell.column(k).into_owned();
    let mut all = Vec::new();
    for along in 0..if is_plane { 2 } else { 3 } {
        for corner in 0..4 {
            let shares = [corner & 1, corner >> 1].map(f64::from);
            let mut start = Vec3::zeros();
            for (k, share) in [(along + 1) % 3, (along + 2) % 3].into_iter().zip(shares) {
                start += edge(k) * share;
            }
            let is_above = is_plane && start.dot(&edge(2)) > 0.0;
            if !is_above {
                all.push([start, start + edge(along)]);
            }
        }
    }
    all
}

/// A plane across an axis.
struct Plane {
    normal: Vec3,
    /// Its place along the normal, m.
    place: f64,
}

impl Plane {
    fn of(section: &Section, centers: &[Vec3]) -> Self {
        let places = centers.iter().map(|x| x[section.axis]);
        let [low, high] = places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        let mut normal = Vec3::zeros();
        normal[section.axis] = 1.0;
        Self { normal, place: section.place.unwrap_or(0.5 * (low + high)) }
    }

    fn distance(&self, x: &Vec3) -> f64 {
        x.dot(&self.normal) - self.place
    }

    /// Where it cuts a sphere.
    fn circle(&self, x: Vec3, radius: f64) -> Option<(Vec3, f64)> {
        let distance = self.distance(&x);
        let square = radius * radius - distance * distance;
        (square > 0.0).then(|| (x - self.normal * distance, square.sqrt()))
    }

    /// The cut that removes its side towards the eye.
    fn seen_from(self, view: &View) -> Result<Cut, PictureError> {
        let facing = self.normal.dot(&view.towards);
        if facing.abs() < EDGEWISE {
            let message = "the eye sees the plane of the cut from its edge; choose another view or another plane";
            return Err(PictureError::Unfit(message.to_owned()));
        }
        Ok(Cut { normal: self.normal * facing.signum(), distance: self.place * facing.signum() })
    }
}

/// The bonds of snapshot `k`.
fn bonds_at(source: &Source<'_>, frame: &Frame, k: usize) -> Result<Lines, PictureError> {
    let missing = || {
        PictureError::Unfit(
            "the snapshots have no bonds, so they can be drawn at the end only; write bond_snapshots = true in [output] and run again"
                .to_owned(),
        )
    };
    let is_last = k + 1 == source.frames.len();
    Lines::at(source.result, frame, is_last)?.ok_or_else(missing)
}

/// Rods between the particles of bonds that have not broken.
fn rods(frame: &Frame, centers: &[Vec3], lines: &Lines, radius: f64) -> Vec<(usize, [Vec3; 2], f64)> {
    let broken = lines.fields.iter().find(|field| field.name == "broken").map(|field| &field.column.data);
    let is_broken = |k: usize| matches!(broken, Some(ColumnData::U8(flags)) if flags[k] != 0);
    let ids = fields::whole(frame, "id");
    let row_of: HashMap<usize, usize> = ids.iter().enumerate().map(|(row, id)| (*id, row)).collect();
    let ends = vectors(&lines.points);
    let one = |(k, pair): (usize, &[u32; 2])| {
        let [a, b] = pair.map(|id| row_of.get(&(id as usize)).copied());
        let (a, b) = (centers.get(a?)?, centers.get(b?)?);
        // Through a periodic face, the rod goes to the image of the second particle.
        let end = if frame.cell.is_some() { a + (ends[2 * k + 1] - ends[2 * k]) } else { *b };
        Some((k, [*a, end], radius))
    };
    lines.ids.iter().enumerate().filter(|(k, _)| !is_broken(*k)).filter_map(one).collect()
}

/// The values of cracks.
fn of_cracks(cracks: &[CrackFace], name: &str) -> Result<Colored, String> {
    let numbers = |unit: &str, of: &dyn Fn(&CrackFace) -> f64| {
        let of = cracks.iter().map(of).collect();
        Ok(Colored::Numbers { name: name.to_owned(), unit: unit.to_owned(), of })
    };
    match name {
        "mode" => {
            let names = ["", "tension", "", "", "shear"].map(str::to_owned).to_vec();
            let of = cracks.iter().map(|crack| if crack.event.in_shear { 4 } else { 1 }).collect();
            Ok(Colored::Kinds { of, names })
        }
        "time" => numbers("s", &|crack| crack.event.time),
        "opening" => numbers("m", &CrackFace::opening),
        "slip" => numbers("m", &CrackFace::slip),
        "energy" => numbers("J", &|crack| crack.event.energy),
        _ => Err(format!("cracks have no field “{name}”; there are: mode, time, opening, slip, energy")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane through the middle of the centers, and the circle in which it cuts a sphere.
    #[test]
    fn planes_cut_circles() {
        let centers = [Vec3::zeros(), Vec3::new(4.0, 0.0, 0.0)];
        let plane = Plane::of(&Section { axis: 0, place: None }, &centers);
        assert_eq!(plane.place, 2.0);
        let (center, radius) = plane.circle(Vec3::new(1.4, 1.0, 0.0), 1.0).unwrap();
        // A square root: one rounding.
        assert!(center == Vec3::new(2.0, 1.0, 0.0) && (radius - 0.8).abs() < 1e-15, "{radius}");
        assert_eq!(plane.circle(Vec3::new(1.0, 1.0, 0.0), 1.0), None);
        let view = View::from_direction(&Vec3::new(-1.0, 1.0, 0.0)).unwrap();
        let cut = Plane::of(&Section { axis: 0, place: Some(3.0) }, &centers).seen_from(&view).unwrap();
        assert!(cut.removes(&Vec3::new(2.9, 0.0, 0.0)) && !cut.removes(&Vec3::new(3.1, 0.0, 0.0)));
        assert!(Plane::of(&Section { axis: 2, place: None }, &centers).seen_from(&view).is_err());
    }

    /// Centers come into the cell, also an inclined one; it has twelve edges, in the plane four.
    #[test]
    fn centers_come_into_the_cell() {
        let cell = Mat3::from_columns(&[Vec3::new(2.0, 0.0, 0.0), Vec3::new(1.0, 2.0, 0.0), Vec3::new(0.0, 0.0, 2.0)]);
        let inside = wrapped(Vec3::new(-0.4, 3.0, 4.5), Some(&cell));
        assert!((inside - Vec3::new(0.6, 1.0, 0.5)).norm() < 1e-14, "{inside}");
        assert_eq!((edges(&cell, false).len(), edges(&cell, true).len()), (12, 4));
    }
}
