//! Warnings about regions and walls whose size differs so much from that of the body that probably a unit is wrong: meters for
//! millimeters, cubic meters for cubic centimeters.

use crate::checks::length;
use crate::schema::quantity::vector;
use crate::schema::{Problem, SampleRegion, Scenario};
use crate::walls::WallKind;
use concordem_contact::math::Vec3;
use concordem_solver::state::{State, Surface};

/// A region is doubtful if it is larger than the body by this factor.
const REGION: f64 = 10.0;
/// The same for a surface from a file without `unit`.
const FILE: f64 = 100.0;
/// The same for other walls, and for the distance of a plane: drops from some height are not doubtful.
const WALL: f64 = 1000.0;

/// The body at the start.
struct Body {
    low: Vec3,
    high: Vec3,
    /// Its largest edge, m.
    size: f64,
    /// Volume of the box around it, and of its particles, m³.
    volumes: [f64; 2],
}

impl Body {
    fn of(state: &State, planar: bool) -> Self {
        let particles = &state.particles;
        let (mut low, mut high) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        let mut solid = 0.0;
        for (x, &r) in particles.position.iter().zip(&particles.radius) {
            (low, high) = (low.inf(&x.add_scalar(-r)), high.sup(&x.add_scalar(r)));
            solid += std::f64::consts::PI * if planar { r * r } else { 4.0 / 3.0 * r.powi(3) };
        }
        let edges = high - low;
        // In two dimensions, bodies have unit depth.
        let around = edges.x * edges.y * if planar { 1.0 } else { edges.z };
        Self { low, high, size: edges.max(), volumes: [around, solid] }
    }
}

/// Warns about regions and walls.
pub(super) fn warnings(scenario: &Scenario, state: &State) -> Vec<Problem> {
    let planar = scenario.dimension == 2;
    let body = Body::of(state, planar);
    regions(scenario, &body, planar).into_iter().chain(walls(scenario, state, &body)).collect()
}

fn regions(scenario: &Scenario, body: &Body, planar: bool) -> Vec<Problem> {
    let mut warnings = Vec::new();
    for (at, sample) in scenario.samples.iter().enumerate() {
        let key = format!("sample[{at}].region");
        let (part, wide) = match &sample.region {
            Some(SampleRegion::Box { minimum, maximum }) => {
                let edges = vector(maximum) - vector(minimum);
                ("maximum", if planar { edges.x.max(edges.y) } else { edges.max() })
            }
            Some(SampleRegion::Sphere { radius, .. }) => ("radius", 2.0 * radius.si()),
            Some(SampleRegion::Cylinder { radius, height, .. }) => ("radius", (2.0 * radius.si()).max(height.si())),
            Some(SampleRegion::Ellipsoid { half_axes, .. }) => ("half_axes", 2.0 * vector(half_axes).max()),
            Some(
                SampleRegion::All { volume }
                | SampleRegion::Set { volume, .. }
                | SampleRegion::Material { volume, .. }
                | SampleRegion::HalfSpaces { volume, .. },
            ) => {
                let [around, solid] = body.volumes;
                let volume = volume.si();
                let whole = matches!(sample.region, Some(SampleRegion::All { .. }));
                if volume > REGION * around || whole && volume < solid / REGION {
                    let message = format!(
                        "the volume is {volume:.3e} m^3, but the box around the body has {around:.3e} m^3 and the particles {solid:.3e} m^3"
                    );
                    let help =
                        "check the unit: the values are averages over this volume; write for example \"16 cm^3\"";
                    warnings.push(scenario.warning(&format!("{key}.volume"), message, help));
                }
                continue;
            }
            Some(SampleRegion::Cell) | None => continue,
        };
        if wide > REGION * body.size {
            let message = format!("the region is {} wide, but the body {}", length(wide), length(body.size));
            let help =
                "check the unit: plain numbers are meters, and the values are averages over the volume of the region";
            warnings.push(scenario.warning(&format!("{key}.{part}"), message, help));
        }
    }
    warnings
}

/// Largest edge of a wall, m, and the factor from which on it is doubtful; `None` for unbounded walls.
fn size_of(kind: &dyn WallKind, surface: &dyn Surface) -> Option<(f64, f64)> {
    if let Some(width) = kind.width() {
        return Some((width, WALL));
    }
    let edge = |axis: Vec3| surface.span(&axis).map(|[low, high]| high - low);
    let edges = [edge(Vec3::x())?, edge(Vec3::y())?, edge(Vec3::z())?];
    let of_triangles = kind.is_mesh() || kind.file().is_some();
    Some((edges.into_iter().fold(0.0, f64::max), if of_triangles { FILE } else { WALL }))
}

fn walls(scenario: &Scenario, state: &State, body: &Body) -> Vec<Problem> {
    let mut warnings = Vec::new();
    let smallest = state.particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
    let mut first = 0;
    for (at, wall) in scenario.walls.iter().enumerate() {
        let (kind, made) = (wall.shape.kind(), &state.walls[first]);
        first += kind.faces().len();
        let key = format!("wall[{at}].shape");
        let help = if kind.file().is_some() {
            "check the unit: if the numbers of the file are millimeters, write unit = \"1 mm\" in the shape"
        } else {
            "check the unit: plain numbers are meters"
        };
        if let Some(place) = kind.unbounded() {
            let away = made.distance(0, &(0.5 * (body.low + body.high))).abs();
            if away > WALL * body.size {
                let message =
                    format!("the wall is {} away from the body, which is {} wide", length(away), length(body.size));
                warnings.push(scenario.warning(&format!("{key}.{place}"), message, help));
            }
            continue;
        }
        let Some((size, factor)) = size_of(kind, made.shape.surface()) else { continue };
        if size > factor * body.size || size < smallest / REGION {
            let message = format!("the wall is {} wide, but the body {}", length(size), length(body.size));
            warnings.push(scenario.warning(&key, message, help));
        }
    }
    warnings
}
