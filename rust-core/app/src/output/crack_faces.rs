//! Crack surfaces: the faces of the power diagram between particles whose bond has broken.
//!
//! The diagram is that of the first snapshot, so cracks are shown in the body before it deforms, and the area of a crack across a specimen
//! is that of its section. Opening and slip are those of the last snapshot. The faces across a plane joint zigzag along it; they count with
//! their projections on the joint, which add up to its area, and with its normal.

use std::collections::{BTreeMap, HashMap};

use super::error::OutputError;
use super::frames::{Frame, Frames};
use super::hdf;
use super::result::ResultFile;
use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::strain::Dimension;
use concordem_operator::tessellation::{Domain, Polygon, power_polygons};
use concordem_scenario::assembly::half_spaces;
use concordem_scenario::schema::Scenario;
use concordem_solver::fracture::Event;
use concordem_solver::state::columns::ColumnData;
use concordem_solver::state::{Particles, Sphere};

/// One broken bond with its face.
#[derive(Debug, Clone, PartialEq)]
pub struct CrackFace {
    /// Corners of the face in the first snapshot, m.
    pub corners: Vec<Vec3>,
    /// Area times unit normal, m² (in the plane of unit depth); across a plane joint, the projection on it.
    pub area: Vec3,
    /// Unit normal; across a plane joint, the normal of the joint.
    pub normal: Vec3,
    /// The break.
    pub event: Event,
    /// Displacement of the second particle relative to the first one until the last snapshot, m; the normal points to the second one.
    pub jump: Vec3,
    /// Numbers of the materials of both particles.
    pub materials: [u16; 2],
}

impl CrackFace {
    /// Width of the crack, m: the displacement along the normal.
    pub fn opening(&self) -> f64 {
        self.jump.dot(&self.normal)
    }

    /// Displacement across the normal, m.
    pub fn slip(&self) -> f64 {
        (self.jump - self.normal * self.opening()).norm()
    }
}

/// The cracks of a result.
#[derive(Debug, Clone, PartialEq)]
pub struct CrackFaces {
    /// One face for each bond that broke, or whose damage passed `output.events_damage`.
    pub faces: Vec<CrackFace>,
    /// Number of such bonds whose particles have no common face.
    pub without_face: usize,
}

impl CrackFaces {
    /// The cracks of a result.
    ///
    /// # Errors
    /// The result has no snapshots, or cannot be read.
    pub fn of(result: &ResultFile) -> Result<Self, OutputError> {
        let text = result.scenario()?;
        let scenario = Scenario::parse("scenario of the result", &text)
            .map_err(|error| hdf::damaged(result.path(), error.to_string()))?;
        let frames = Frames::of_particles(result.root(), result.path())?;
        let Some(last) = frames.len().checked_sub(1) else {
            return Err(hdf::damaged(result.path(), "there are no snapshots".to_owned()));
        };
        let (first, last) = (frames.read(0)?, frames.read(last)?);
        let mut events: BTreeMap<[u32; 2], Event> = BTreeMap::new();
        for event in result.events()? {
            // The time of the first event of a pair counts: later ones tell that a damaged bond is gone.
            events.entry([event.id_a.min(event.id_b), event.id_a.max(event.id_b)]).or_insert(event);
        }
        let edges = edges(result)?;
        let body = Body::new(&scenario, &first, &last, edges);
        let wanted: Vec<([u32; 2], Event)> =
            events.into_iter().filter_map(|(ids, e)| Some((body.rows(ids)?, e))).collect();
        let pairs: Vec<[u32; 2]> = wanted.iter().map(|(pair, _)| *pair).collect();
        let polygons = power_polygons(&body.position, &body.radius, &body.domain, body.dimension, &pairs)
            .map_err(|error| hdf::damaged(result.path(), error.to_string()))?;
        let mut nearest: HashMap<[u32; 2], Polygon> = HashMap::new();
        for polygon in polygons {
            // In a small cell, a bond joins the nearest images.
            let length = |one: &Polygon| body.branch(one, 0).norm();
            let other = nearest.get(&polygon.pair);
            if other.is_none_or(|other| length(&polygon) < length(other)) {
                nearest.insert(polygon.pair, polygon);
            }
        }
        let count = wanted.len();
        let faces: Vec<CrackFace> = wanted
            .into_iter()
            .filter_map(|([a, b], event)| {
                let polygon = nearest.remove(&[a.min(b), a.max(b)])?;
                let jump = body.branch(&polygon, 1) - body.branch(&polygon, 0);
                let materials = polygon.pair.map(|p| body.material[p as usize]);
                let (area, normal) = match normal_of_joint(&scenario, &event) {
                    // The particles lie on two sides of the joint, so that the projection is not zero.
                    Some(normal) => (normal * normal.dot(&polygon.area), normal * normal.dot(&polygon.area).signum()),
                    None => (polygon.area, polygon.area.normalize()),
                };
                Some(CrackFace { corners: polygon.corners, area, normal, event, jump, materials })
            })
            .collect();
        Ok(Self { without_face: count - faces.len(), faces })
    }
}

/// Unit normal of the plane joint, if any, that the bond of an event lay across.
fn normal_of_joint(scenario: &Scenario, event: &Event) -> Option<Vec3> {
    scenario.joints.get(usize::from(event.joint?))?.shape.unit_normal()
}

/// Edges of the periodic cell at the start and at the end, as columns, m; `None` without a cell.
fn edges(result: &ResultFile) -> Result<Option<[Mat3; 2]>, OutputError> {
    if !result.root().link_exists("cell") {
        return Ok(None);
    }
    let table: HashMap<String, _> = result.table("cell")?.into_iter().collect();
    let matrix = |name: &str| match table.get(name).map(|column| &column.data) {
        Some(ColumnData::F64(values)) if values.len() == 9 => Ok(Mat3::from_row_slice(values)),
        _ => Err(hdf::damaged(result.path(), format!("`cell/{name}` is not a matrix"))),
    };
    let (last, gradient) = (matrix("edges")?, matrix("deformation_gradient")?);
    let back = gradient.try_inverse().ok_or_else(|| hdf::damaged(result.path(), "the cell has no volume".into()))?;
    Ok(Some([back * last, last]))
}

/// The particles of the first snapshot inside the body.
struct Body {
    position: Vec<Vec3>,
    /// Displacement until the last snapshot, m.
    displacement: Vec<Vec3>,
    radius: Vec<f64>,
    material: Vec<u16>,
    domain: Domain,
    dimension: Dimension,
    edges: Option<[Mat3; 2]>,
    row_of: HashMap<u32, u32>,
}

impl Body {
    fn new(scenario: &Scenario, first: &Frame, last: &Frame, edges: Option<[Mat3; 2]>) -> Self {
        let ids = |frame: &Frame| match frame.field("id") {
            Some(ColumnData::U32(ids)) => ids.clone(),
            _ => Vec::new(),
        };
        let reals = |frame: &Frame, name: &str| match frame.field(name) {
            Some(ColumnData::F64(values)) => values.clone(),
            _ => Vec::new(),
        };
        let vectors = |values: &[f64]| values.chunks_exact(3).map(Vec3::from_column_slice).collect::<Vec<_>>();
        let displacement_of: HashMap<u32, Vec3> =
            ids(last).into_iter().zip(vectors(&reals(last, "displacement"))).collect();
        let started: HashMap<u32, Vec3> = ids(first).into_iter().zip(vectors(&reals(first, "displacement"))).collect();
        let material_of = match first.field("material") {
            Some(ColumnData::U16(material)) => material.clone(),
            _ => Vec::new(),
        };
        let mut all = Particles::default();
        for ((position, radius), material) in
            vectors(&first.points).into_iter().zip(reals(first, "radius")).zip(&material_of)
        {
            all.push(Sphere { position, radius }, *material, 0.0, 0.0);
        }
        let plane = scenario.dimension == 2;
        let planes = if edges.is_some() { Vec::new() } else { half_spaces(scenario, &all) };
        let domain = match edges {
            Some([first, _]) => Domain::Periodic(first),
            None => Domain::HalfSpaces(planes.clone()),
        };
        let mut body = Self {
            position: Vec::new(),
            displacement: Vec::new(),
            radius: Vec::new(),
            material: Vec::new(),
            domain,
            dimension: if plane { Dimension::Two } else { Dimension::Three },
            edges,
            row_of: HashMap::new(),
        };
        for (p, id) in ids(first).into_iter().enumerate().take(all.len()) {
            let x = all.position[p];
            if planes.iter().any(|half| (x - half.point).dot(&half.normal) > 0.0) {
                continue;
            }
            let moved = |of: &HashMap<u32, Vec3>| of.get(&id).copied().unwrap_or_default();
            body.row_of.insert(id, body.position.len() as u32);
            body.position.push(x);
            body.displacement.push(moved(&displacement_of) - moved(&started));
            body.radius.push(all.radius[p]);
            body.material.push(all.material[p]);
        }
        body
    }

    /// Rows of two particles; `None` if one of them lies outside the body.
    fn rows(&self, ids: [u32; 2]) -> Option<[u32; 2]> {
        Some([*self.row_of.get(&ids[0])?, *self.row_of.get(&ids[1])?])
    }

    /// Vector between the particles of a face, m; `time`: 0 for the first snapshot, 1 for the last one.
    fn branch(&self, polygon: &Polygon, time: usize) -> Vec3 {
        let [a, b] = polygon.pair.map(|p| p as usize);
        let shift = self.edges.map_or_else(Vec3::zeros, |edges| edges[time] * Vec3::from(polygon.image.map(f64::from)));
        let moved = (self.displacement[b] - self.displacement[a]) * time as f64;
        self.position[b] - self.position[a] + moved + shift
    }
}
