//! Joints: which particles lie on which side of them, and the blocks of bonds and contacts that know them.

use std::collections::BTreeMap;
use std::path::Path;

use super::stl::Named;
use super::{AssemblyError, unfit};
use crate::schema::quantity::vector;
use crate::schema::{Joint, JointShape, Problem, Quantity, Scenario};
use concordem_contact::law::Jointed;
use concordem_contact::law::jointed::{self, JointedRock, JointedRockState, OPEN};
use concordem_contact::math::Vec3;
use concordem_packing::{Surface, TIE};
use concordem_solver::forces::EvaluatedContacts;
use concordem_solver::joints::{Joints, Mark};
use concordem_solver::state::contacts::{ContactBlock, ContactFlags, Contacts};
use concordem_solver::state::surface::Surface as _;
use concordem_solver::state::{State, surface::Facets};
use concordem_solver::{Model, PairCoefficients};

/// Puts the joints of a scenario into the blocks of bonds and contacts, and into the model. Returns the number of bonds across each `[[joint]]`,
/// and warnings. `interaction_ratio`: of the bonds.
pub(super) fn add(
    scenario: &Scenario,
    folder: &Path,
    interaction_ratio: f64,
    model: &mut Model,
    state: &mut State,
) -> Result<(Vec<usize>, Vec<Problem>), AssemblyError> {
    if scenario.joints.is_empty() {
        return Ok(Default::default());
    }
    let mut rows: Vec<JointedRock> = Vec::new();
    let mut marks = Vec::new();
    // Number of the table of each joint.
    let mut table_of = Vec::new();
    let [bonds, contacts] = [state.bonds.first(), state.contacts.as_ref()].map(|block| rows_of(block?.as_ref()));
    let (Some(bonds), Some(contacts)) = (bonds, contacts) else { return Ok(Default::default()) };
    let first = bonds.len();
    let wall_contacts = state.wall_contacts.is_some();
    let largest = state.particles.radius.iter().copied().fold(0.0, f64::max);
    for (at, joint) in scenario.joints.iter().enumerate() {
        for place in places(at, joint, folder)? {
            let number = table_of.len() as u16;
            table_of.push(at as u16);
            let mut row_of_normal: BTreeMap<[u64; 3], usize> = BTreeMap::new();
            for (p, x) in state.particles.position.iter().enumerate() {
                // No bond is longer, and no contact.
                let reach = interaction_ratio * (state.particles.radius[p] + largest) * (1.0 + TIE);
                let Some((normal, in_front)) = place.side(x, reach) else { continue };
                let key = [normal.x, normal.y, normal.z].map(f64::to_bits);
                let row = *row_of_normal.entry(key).or_insert_with(|| {
                    rows.push(JointedRock { joint: Some(constants(joint, normal)), bond: bonds[0] });
                    first + rows.len() - 1
                });
                if row >= usize::from(PairCoefficients::NONE) {
                    let message = format!(
                        "the joints have more than the {} directions that can be numbered; simplify the surface",
                        usize::from(PairCoefficients::NONE) - first
                    );
                    return Err(unfit(&format!("joint[{at}].shape"), message));
                }
                marks.push((state.particles.id[p], Mark { joint: number, in_front, row: row as u16 }));
            }
        }
    }
    model.joints = Joints::new(marks, table_of.clone());
    let with_joints = |plain: &[Jointed]| {
        let off: Vec<JointedRock> = plain.iter().map(|&bond| JointedRock { bond, joint: None }).collect();
        [off, rows.clone()].concat()
    };
    let mut block = block_with(with_joints(&bonds), state.bonds[0].contacts());
    let mut crossing = vec![0; scenario.joints.len()];
    for k in model.joints.assign(&mut block, &state.particles) {
        let pair = block.pair[k];
        let ids = [pair.a, pair.b].map(|p| state.particles.id[p as usize]);
        if let Some(mark) = model.joints.between(ids) {
            crossing[usize::from(table_of[usize::from(mark.joint)])] += 1;
        }
        let joint = block.rows[usize::from(block.flags[k].row)].joint;
        if joint.is_some_and(|joint| !joint.is_cohesive()) {
            // Cracked from the start, which is no event.
            block.history.set(k, JointedRockState { crack: OPEN, ..JointedRockState::default() });
            block.flags[k].bits |= ContactFlags::REPORTED;
        }
    }
    state.bonds[0] = Box::new(block);
    // Bonds and contacts have the same rows: the tables of the materials are the same.
    let block: Box<dyn EvaluatedContacts> = Box::new(ContactBlock::new(with_joints(&contacts)));
    if wall_contacts {
        state.wall_contacts = Some(block.boxed_clone());
    }
    state.contacts = Some(block);
    let idle = |at: &usize| crossing[*at] == 0;
    let warn = |at: usize| {
        let (low, high) = super::bounds(state.particles.position.iter());
        let help =
            format!("check its position and its units, or remove it; the centers lie {}", super::between(&low, &high));
        scenario.warning(&format!("joint[{at}].shape"), "crosses no bond", help)
    };
    let warnings = (0..crossing.len()).filter(idle).map(warn).collect();
    Ok((crossing, warnings))
}

/// The rows of a block of the law `jointed`; the checks of the scenario guarantee that it is one.
fn rows_of(block: &dyn EvaluatedContacts) -> Option<Vec<Jointed>> {
    Some(block.contacts().as_any().downcast_ref::<ContactBlock<Jointed>>()?.rows.clone())
}

/// A block with the contacts of another one, without their histories.
fn block_with(rows: Vec<JointedRock>, contacts: &dyn Contacts) -> ContactBlock<JointedRock> {
    let mut block = ContactBlock::new(rows);
    for k in 0..contacts.len() {
        let view = contacts.view(k);
        block.push(view.pair, view.flags, view.reference, view.previous);
    }
    block
}

/// Constants of a joint with a normal.
fn constants(joint: &Joint, normal: Vec3) -> jointed::Joint {
    jointed::Joint {
        normal,
        normal_stiffness: joint.normal_stiffness.si(),
        shear_stiffness: joint.shear_stiffness.si(),
        tensile_strength: joint.tensile_strength.si(),
        cohesion: joint.cohesion.si(),
        friction: joint.friction().unwrap_or(0.0),
        dilation: joint.dilation_angle.si().tan(),
    }
}

/// Where one joint lies.
enum Place {
    /// A plane, or a disc in it: a point, the unit normal, and the radius.
    Plane(Vec3, Vec3, f64),
    Facets(Facets, Vec<[Vec3; 2]>),
}

/// Unit normal of a plane or a disc.
fn unit_normal(joint: &Joint) -> Vec3 {
    joint.shape.unit_normal().unwrap_or_default()
}

/// The places of the joints of table `at`.
fn places(at: usize, joint: &Joint, folder: &Path) -> Result<Vec<Place>, AssemblyError> {
    Ok(match &joint.shape {
        JointShape::Plane { point, count, spacing, .. } => {
            let (point, normal) = (vector(point), unit_normal(joint));
            let step = normal * spacing.map_or(0.0, Quantity::si);
            let plane = |k: u32| Place::Plane(point + step * f64::from(k), normal, f64::INFINITY);
            (0..*count).map(plane).collect()
        }
        JointShape::Disc { center, radius, .. } => {
            vec![Place::Plane(vector(center), unit_normal(joint), radius.si())]
        }
        JointShape::Facets { path, unit } => {
            let key = format!("joint[{at}].shape.path");
            let named = Named { folder, path, unit: unit.si(), key: &key };
            let surface = named.read()?;
            let rim = rim(&surface).map_err(|problem| named.fail(&problem))?;
            let triangles = surface.triangles_with_area();
            if triangles.is_empty() {
                return Err(named.fail(&"none of its triangles has an area"));
            }
            vec![Place::Facets(Facets { triangles }, rim)]
        }
    })
}

/// Edges of a surface that only one triangle has.
fn rim(surface: &Surface) -> Result<Vec<[Vec3; 2]>, String> {
    let mut count: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for [a, b, c] in &surface.triangles {
        if a == b || b == c || c == a {
            continue;
        }
        for edge in [[*a, *b], [*b, *c], [*c, *a]] {
            *count.entry(edge).or_default() += 1;
        }
    }
    if let Some(([a, _], _)) = count.iter().find(|(_, times)| **times > 1) {
        let x = surface.vertices[*a as usize];
        return Err(format!(
            "two triangles at ({:e}, {:e}, {:e}) m run the same way along their common edge, so that their fronts are on two sides; orient \
             the triangles alike, and save surfaces that branch as several files",
            x.x, x.y, x.z
        ));
    }
    let alone = |[a, b]: &[u32; 2]| !count.contains_key(&[*b, *a]);
    let ends = |[a, b]: &[u32; 2]| [*a, *b].map(|vertex| surface.vertices[vertex as usize]);
    Ok(count.keys().filter(|edge| alone(edge)).map(ends).collect())
}

impl Place {
    /// Normal of the joint next to the point `x` (m), and whether the point lies in front; `None` farther than `reach` (m), and beyond the
    /// rim.
    fn side(&self, x: &Vec3, reach: f64) -> Option<(Vec3, bool)> {
        match self {
            Self::Plane(point, normal, radius) => {
                let height = (x - point).dot(normal);
                let from_center = (x - point) - normal * height;
                // A center on the plane is in front, also with rounding.
                let is_near = height.abs() <= reach && from_center.norm() <= *radius;
                is_near.then_some((*normal, height >= -TIE * reach))
            }
            Self::Facets(facets, rim) => {
                let distances: Vec<f64> = (0..facets.elements())
                    .map(|k| facets.closest_point(k, x).map_or(0.0, |found| found.distance))
                    .collect();
                let nearest = distances.iter().copied().fold(f64::INFINITY, f64::min);
                if nearest > reach {
                    return None;
                }
                // At an edge or a corner, the triangles around it together tell the side.
                let around: Vec<usize> =
                    (0..distances.len()).filter(|&k| distances[k] <= nearest + TIE * reach).collect();
                let first = *around.first()?;
                let normal = |k: usize| {
                    let [a, b, c] = facets.triangles[k];
                    (b - a).cross(&(c - a)).normalize()
                };
                let Some(found) = facets.closest_point(first, x) else { return Some((normal(first), true)) };
                let to = found.normal * found.distance;
                if !found.interior && rim.iter().any(|edge| is_on(&(x + to), edge, TIE * reach)) {
                    return None;
                }
                let front: Vec3 = around.iter().map(|&k| normal(k)).sum();
                Some((normal(first), -to.dot(&front) >= -TIE * reach))
            }
        }
    }
}

/// Whether a point lies on an edge, up to a distance, m.
fn is_on(x: &Vec3, [from, to]: &[Vec3; 2], within: f64) -> bool {
    let along = to - from;
    let s = ((x - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
    (from + along * s - x).norm() <= within
}
