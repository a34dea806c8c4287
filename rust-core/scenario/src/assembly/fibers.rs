//! Fibers of a scenario: their places, the particles that make room for them, and the bonds along them.

use std::path::Path;

use super::aggregates::{Division, Places, region};
use super::cuts::Cuts;
use super::placed::Placed;
use super::{AssemblyError, Progress, material_index, unfit};
use crate::schema::quantity::vector;
use crate::schema::{FiberGroup, Problem, Quantity, Scenario, Surface};
use concordem_contact::math::Vec3;
use concordem_packing::fibers::{Fiber, FiberPlacement, FiberRequest, count_for, place_fibers};
use concordem_packing::{PackingError, Random, Shape};
use concordem_solver::PairCoefficients;
use concordem_solver::neighbor::candidate_pairs;
use concordem_solver::state::{Cell, Particles, Sphere};

/// Share of the packing that fibers may remove without a warning.
const MUCH: f64 = 0.1;

/// The fibers of an assembled scenario, for reports.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FiberFacts {
    /// Groups, in the order of the scenario.
    pub groups: Vec<FiberPhase>,
    /// Particles of the packing that were removed, and their share of its volume.
    pub removed: (usize, f64),
    /// Numbers of bonds along fibers, and between fibers and other particles.
    pub bonds: [usize; 2],
}

/// One group of fibers.
#[derive(Debug, Clone, PartialEq)]
pub struct FiberPhase {
    /// Name of its material.
    pub name: String,
    /// Number of fibers.
    pub count: usize,
    /// Volume of the fibers, as cylinders, divided by that of the specimen.
    pub volume_fraction: f64,
    /// Number of particles.
    pub particles: usize,
}

/// Fibers in their places.
pub(super) struct Chains {
    fibers: Vec<Fiber>,
    /// Volume of the region, m³.
    volume: f64,
    clearing: f64,
    /// The shape whose faces cut the fibers.
    sawn: Option<Shape>,
    /// Edges of the box in which sawn fibers are periodic.
    edges: Vec3,
}

/// Pairs of neighbors along fibers, by the numbers of the particles in the scenario.
#[derive(Default)]
pub(super) struct Links {
    pub(super) pairs: Vec<[u32; 2]>,
    /// Materials of fibers.
    pub(super) materials: Vec<u16>,
    pub(super) facts: FiberFacts,
}

/// Places the fibers of a scenario between its aggregates; `None` if it has none.
pub(super) fn build(
    scenario: &Scenario,
    folder: &Path,
    placed: &Placed,
    aggregates: Option<&Places<'_>>,
    progress: Progress<'_>,
) -> Result<Option<Chains>, AssemblyError> {
    let Some(table) = &scenario.fibers else { return Ok(None) };
    progress("fibers", 0.0);
    let surface = match &scenario.aggregates {
        Some(aggregates) => aggregates.surface,
        None => table.surface,
    };
    let own;
    let region = if let Some(places) = aggregates {
        places.field().region()
    } else {
        own = region(scenario, surface, folder, placed)?;
        &own
    };
    let (mut requests, mut fixed) = (Vec::new(), Vec::new());
    for (number, group) in table.groups.iter().enumerate() {
        let diameter = group.diameter.si();
        fixed.extend(group.lines.iter().flatten().map(|line| fiber_between(line, diameter, number)));
        // The checks of the scenario guarantee a length unless lines are given.
        let Some(length) = group.length.map(Quantity::si) else { continue };
        let count = match (group.volume_fraction, group.count) {
            (Some(fraction), _) => count_for(fraction.si(), length, diameter, region)?,
            (None, count) => count.unwrap_or(0) as usize,
        };
        let direction = group.direction.map(|direction| Vec3::from(direction.map(Quantity::si)).normalize());
        requests.extend(vec![FiberRequest { length, diameter, direction, group: number }; count]);
    }
    let placement = FiberPlacement { gap: table.gap.si(), wall_gap: table.wall_gap.si(), attempts: table.attempts };
    let inclusions = aggregates.map_or(&[][..], |places| places.field().inclusions());
    let mut random = Random::new(table.seed);
    let fibers =
        place_fibers(region, inclusions, &requests, &fixed, &placement, &mut random).map_err(|error| match error {
            PackingError::NoPlace { number, count, attempts, reached, wanted, .. } => {
                let message = format!(
                    "no place for fiber {} of {count} after {attempts} attempts: those before it are {reached:.4} of the volume, \
                     all would be {wanted:.4}. Give fewer or shorter fibers, smaller gaps, more attempts, or another seed; in a \
                     mould, fibers must be shorter than the specimen",
                    number + 1
                );
                unfit("fibers", message)
            }
            other => other.into(),
        })?;
    let sawn = if surface == Some(Surface::Sawn) { scenario.packing.shape() } else { None };
    let sawn = sawn.map(|shape| super::solid(shape, folder)).transpose()?.map(|(shape, _)| shape);
    let edges = sawn.as_ref().map_or_else(Vec3::zeros, |shape| shape.bounds().1 - shape.bounds().0);
    Ok(Some(Chains { fibers, volume: region.volume(), clearing: table.clearing.si(), sawn, edges }))
}

/// Materials of the fibers of a scenario.
pub(super) fn materials(scenario: &Scenario) -> Vec<u16> {
    let groups = scenario.fibers.iter().flat_map(|fibers| &fibers.groups);
    groups.map(|group| material_index(scenario, &group.material)).collect()
}

fn fiber_between(line: &[[crate::schema::quantity::Length; 3]; 2], diameter: f64, group: usize) -> Fiber {
    let [from, to] = [vector(&line[0]), vector(&line[1])];
    let along = to - from;
    let length = along.norm();
    Fiber { middle: (from + to) * 0.5, direction: along / length, length, diameter, group }
}

impl Chains {
    /// The spheres of a fiber in the specimen, as runs of neighbors. Sawn faces cut fibers; the parts beyond a face enter at the
    /// opposite one. Parts of one sphere are left out.
    fn parts(&self, fiber: &Fiber, cuts: &Cuts, scenario: &Scenario) -> Vec<Vec<Sphere>> {
        let radius = 0.5 * fiber.diameter;
        let shifts: Vec<Vec3> = match &self.sawn {
            None => vec![Vec3::zeros()],
            Some(_) => (0..27)
                .map(|k| Vec3::new(f64::from(k % 3 - 1), f64::from(k / 3 % 3 - 1), f64::from(k / 9 - 1)))
                .map(|image| image.component_mul(&self.edges))
                .collect(),
        };
        let mut parts = Vec::new();
        for shift in shifts {
            let mut part = Vec::new();
            for center in fiber.centers().map(|center| center + shift) {
                let sphere = Sphere { position: center, radius };
                let inside = self.sawn.as_ref().is_none_or(|shape| shape.contains(&center, 0.0));
                if inside && !cuts.remaining(scenario, &[sphere]).is_empty() {
                    part.push(sphere);
                } else {
                    parts.push(std::mem::take(&mut part));
                }
            }
            parts.push(part);
        }
        parts.retain(|part| part.len() > 1);
        parts
    }

    /// Adds the fibers to the spheres of the packing, and removes those that are too near. `division` holds the aggregates, and gets the
    /// numbers of the fibers after theirs.
    pub(super) fn add(
        &self,
        scenario: &Scenario,
        cuts: &Cuts,
        cell: Option<&Cell>,
        spheres: &mut Vec<Sphere>,
        division: &mut Division,
    ) -> Result<Links, AssemblyError> {
        // The checks guarantee the table.
        let groups: &[FiberGroup] = scenario.fibers.as_ref().map_or(&[], |fibers| &fibers.groups);
        let parts: Vec<Vec<Vec<Sphere>>> = self.fibers.iter().map(|fiber| self.parts(fiber, cuts, scenario)).collect();
        let all = parts.iter().flatten().flatten().copied();
        let removed = self.clear(spheres, division, all, cell)?;
        let mut links = Links::default();
        let mut facts = vec![(0, 0.0, 0); groups.len()];
        for (fiber, parts) in self.fibers.iter().zip(&parts) {
            let material = material_index(scenario, &groups[fiber.group].material);
            division.material.push(Some(material));
            let number = division.material.len() as u32;
            for part in parts {
                let first = spheres.len() as u32;
                spheres.extend(part);
                links.pairs.extend((first..spheres.len() as u32 - 1).map(|k| [k, k + 1]));
            }
            division.number.resize(spheres.len(), number);
            let (count, volume, particles) = &mut facts[fiber.group];
            *count += 1;
            *volume += fiber.volume();
            *particles += parts.iter().map(Vec::len).sum::<usize>();
        }
        let phase = |(group, (count, volume, particles)): (&FiberGroup, (usize, f64, usize))| FiberPhase {
            name: group.material.clone(),
            count,
            volume_fraction: volume / self.volume,
            particles,
        };
        links.facts.groups = groups.iter().zip(facts).map(phase).collect();
        links.facts.removed = removed;
        links.materials = materials(scenario);
        Ok(links)
    }

    /// Removes the spheres of the packing that are too near to spheres of fibers; returns their number and their share of the volume.
    fn clear(
        &self,
        spheres: &mut Vec<Sphere>,
        division: &mut Division,
        fibers: impl Iterator<Item = Sphere>,
        cell: Option<&Cell>,
    ) -> Result<(usize, f64), AssemblyError> {
        let packed = spheres.len();
        let all: Vec<Sphere> = spheres.iter().copied().chain(fibers).collect();
        let positions: Vec<Vec3> = all.iter().map(|sphere| sphere.position).collect();
        let reach: Vec<f64> = all.iter().map(|sphere| sphere.radius * self.clearing).collect();
        let mut near = vec![false; packed];
        for pair in candidate_pairs(&positions, &reach, cell)? {
            let [a, b] = [pair.a as usize, pair.b as usize];
            if a < packed && b >= packed {
                near[a] = true;
            }
        }
        let cube = |sphere: &Sphere| sphere.radius.powi(3);
        let whole: f64 = spheres.iter().map(cube).sum();
        let gone: f64 = spheres.iter().zip(&near).filter(|(_, near)| **near).map(|(sphere, _)| cube(sphere)).sum();
        division.number.resize(packed, 0);
        let keep = || near.iter().map(|near| !near).chain(std::iter::repeat(true));
        let mut kept = keep();
        spheres.retain(|_| kept.next() == Some(true));
        let mut kept = keep();
        division.number.retain(|_| kept.next() == Some(true));
        let mut kept = keep();
        division.of_matrix.retain(|_| kept.next() == Some(true));
        Ok((packed - spheres.len(), if whole > 0.0 { gone / whole } else { 0.0 }))
    }
}

/// Warns about fibers that removed much of the packing, or that nothing holds.
pub(super) fn doubtful(scenario: &Scenario, facts: &FiberFacts) -> Vec<Problem> {
    let mut warnings = Vec::new();
    let (count, share) = facts.removed;
    if share > MUCH {
        let message = format!("fibers took the place of {count} particles, {share:.3} of the volume of the packing");
        let help = "use particles that are not larger than the fibers, or a smaller `clearing`";
        warnings.push(scenario.warning("fibers.clearing", message, help));
    }
    if facts.bonds[1] == 0 {
        let help = "check the places of the fibers, or give a larger bonds.interaction_ratio";
        warnings.push(scenario.warning("fibers", "no fiber is bonded to a particle of the packing", help));
    }
    warnings
}

impl Links {
    /// The pairs as indices of the state, the lower one first.
    pub(super) fn in_order_of_state(&self, particles: &Particles) -> Vec<[u32; 2]> {
        let mut index_of = vec![0; particles.len()];
        for (index, &id) in particles.id.iter().enumerate() {
            index_of[id as usize] = index as u32;
        }
        let pair = |link: &[u32; 2]| {
            let [a, b] = link.map(|id| index_of[id as usize]);
            [a.min(b), a.max(b)]
        };
        self.pairs.iter().map(pair).collect()
    }

    /// Whether a material is that of a fiber.
    pub(super) fn has(&self, material: u16) -> bool {
        self.materials.contains(&material)
    }

    /// Takes away the coefficients between two fibers, whose particles have no bonds but those along a fiber.
    pub(super) fn part(&self, rows: &mut PairCoefficients) {
        for &a in &self.materials {
            for &b in &self.materials {
                rows.set(a, b, PairCoefficients::NONE);
            }
        }
    }

    /// Refuses a set that gives particles of fibers another material.
    pub(super) fn refuse_material(&self, scenario: &Scenario, at: usize, spheres: &[u32]) -> Result<(), AssemblyError> {
        let mut of_fibers: Vec<u32> = self.pairs.iter().flatten().copied().collect();
        of_fibers.sort_unstable();
        match spheres.iter().find(|sphere| of_fibers.binary_search(sphere).is_ok()) {
            None => Ok(()),
            Some(sphere) => {
                let message = format!(
                    "the set \"{}\" contains particle {sphere} of a fiber, which keeps its material: choose a set without fibers",
                    scenario.sets[at].name
                );
                Err(unfit(&format!("set[{at}].material"), message))
            }
        }
    }
}
