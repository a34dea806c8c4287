//! Checks overlaps before the first step, whose elastic energy would drive particles apart: between particles of files
//! and clumps, and with walls.

use std::collections::BTreeMap;

use super::{AssemblyError, material_index, unfit};
use crate::checks::{OVERLAP_BONDED, OVERLAP_DEEP, OVERLAP_UNBONDED, length};
use crate::schema::{self, Packing, Problem, Scenario};
use concordem_contact::math::Vec3;
use concordem_solver::neighbor::{candidate_pairs, candidate_pairs_with_others};
use concordem_solver::state::contacts::Pair;
use concordem_solver::state::{Cell, State, Wall};

/// Refuses particles inside or behind walls.
///
/// # Errors
/// A particle overlaps a wall by more than [`OVERLAP_UNBONDED`] of its radius.
pub(super) fn refuse_walls(scenario: &Scenario, state: &State) -> Result<(), AssemblyError> {
    let particles = &state.particles;
    let cell = state.cell.as_ref();
    // Deepest overlap of every particle: depth over radius, wall, particle.
    let mut deepest: BTreeMap<usize, (f64, usize)> = BTreeMap::new();
    let passes = Passing::of(scenario);
    let mut add = |w: usize, element: usize, p: usize, shift: Vec3| {
        if passes.each_other(particles.material[p], state.walls[w].material) {
            return;
        }
        let x = particles.position[p] - shift;
        let depth = 1.0 - distance(&state.walls[w], element, &x, cell) / particles.radius[p];
        if depth > OVERLAP_UNBONDED && deepest.get(&p).is_none_or(|(other, _)| depth > *other) {
            deepest.insert(p, (depth, w));
        }
    };
    // The neighbor search treats triangles as spheres, numbered after the particles.
    let (mut position, mut reach) = (particles.position.clone(), particles.radius.clone());
    let mut triangles = Vec::new();
    for (w, wall) in state.walls.iter().enumerate() {
        for element in 0..wall.element_count() {
            if let Some((center, radius)) = wall.bounds(element) {
                position.push(center);
                reach.push(radius);
                triangles.push((w, element));
            } else if let Some(cell) = cell {
                for p in 0..particles.len() {
                    for image in wall.images_near(&particles.position[p], particles.radius[p], cell) {
                        add(w, element, p, cell.matrix * Vec3::from(image.map(|n| n as f64)));
                    }
                }
            } else {
                (0..particles.len()).for_each(|p| add(w, element, p, Vec3::zeros()));
            }
        }
    }
    if !triangles.is_empty() {
        for pair in candidate_pairs_with_others(&position, &reach, particles.len(), cell)? {
            let (w, element) = triangles[pair.b as usize - particles.len()];
            add(w, element, pair.a as usize, cell.map_or_else(Vec3::zeros, |cell| cell.shift(pair.image)));
        }
    }
    let count = deepest.len();
    let deepest = deepest.into_iter().map(|(p, (depth, w))| (depth, w, p)).reduce(|a, b| if b.0 > a.0 { b } else { a });
    let Some((depth, w, p)) = deepest else { return Ok(()) };
    let place = particles.position[p];
    let remedy = wall_of(scenario, w).map_or("move the wall or the particle", |(_, wall)| wall.shape.kind().remedy());
    let others = if count > 1 { format!("; {count} particles overlap walls") } else { String::new() };
    let message = format!(
        "particle {} at ({:.6e}, {:.6e}, {:.6e}) m lies {} deep in the wall \"{}\" before the first step{others}; {}",
        particles.id[p],
        place.x,
        place.y,
        place.z,
        length(depth * particles.radius[p]),
        state.walls[w].name,
        remedy
    );
    Err(unfit(&key_of_wall(scenario, w), message))
}

/// Distance from `x` (m) to an element of a wall, m; negative behind it. In a periodic cell planes have two sides.
fn distance(wall: &Wall, element: usize, x: &Vec3, cell: Option<&Cell>) -> f64 {
    let found = wall.closest_point_of_image(element, x, cell, [0; 3]);
    found.map_or_else(|| wall.distance(element, x), |found| found.distance)
}

/// The `[[wall]]` of the wall with this number in the state (a box has six), with its index; `None` for walls of the loading.
fn wall_of(scenario: &Scenario, number: usize) -> Option<(usize, &schema::Wall)> {
    let mut first = 0;
    scenario.walls.iter().enumerate().find(|(_, wall)| {
        first += wall.shape.kind().faces().len();
        number < first
    })
}

/// Key of the wall with this number in the state.
pub(super) fn key_of_wall(scenario: &Scenario, number: usize) -> String {
    wall_of(scenario, number).map_or_else(|| "loading".to_owned(), |(at, _)| format!("wall[{at}].shape"))
}

/// Pairs of materials that pass through each other, as indices.
struct Passing(Vec<[u16; 2]>);

impl Passing {
    fn of(scenario: &Scenario) -> Self {
        let pairs = scenario.contacts.exclude.iter();
        Self(pairs.map(|[a, b]| [material_index(scenario, a), material_index(scenario, b)]).collect())
    }

    fn each_other(&self, a: u16, b: u16) -> bool {
        self.0.iter().any(|pair| *pair == [a, b] || *pair == [b, a])
    }
}

/// Checks overlaps of unbonded particles from a file, from added spheres of clumps, or with fibers, and returns a warning if there are
/// any. (Listed spheres are checked with the text; random packings overlap by design, and so do fibers with what they are bonded to.)
///
/// # Errors
/// Overlaps deeper than [`OVERLAP_BONDED`] of the smaller radius with a bond, or [`OVERLAP_DEEP`] without one; any overlap of a fiber with a particle that it is not bonded to.
pub(super) fn of_particles(scenario: &Scenario, state: &State) -> Result<Option<Problem>, AssemblyError> {
    // The check of listed spheres does not know which materials touch.
    let given = match &scenario.packing {
        Packing::File { .. } => true,
        Packing::Spheres { .. } => !scenario.contacts.exclude.is_empty(),
        _ => false,
    };
    let passes = Passing::of(scenario);
    let added = scenario.clumps.iter().any(|clump| clump.spheres.is_some());
    let fibers = super::fibers::materials(scenario);
    if !(given || added) && fibers.is_empty() {
        return Ok(None);
    }
    // Particles that pass through each other may lie in each other, but bonds may not be as short as they like.
    let passing = scenario.contacts.law.law().is_none();
    let particles = &state.particles;
    // Blocks of bonds are sorted by their pairs.
    let bonded = |pair: &Pair| state.bonds.iter().any(|block| block.pairs().binary_search(pair).is_ok());
    let (mut count, mut refused, mut deepest) = (0_usize, false, None::<(f64, [u32; 2])>);
    for pair in candidate_pairs(&particles.position, &particles.radius, state.cell.as_ref())? {
        let (a, b) = (pair.a as usize, pair.b as usize);
        let one_clump = particles.clump[a] != u32::MAX && particles.clump[a] == particles.clump[b];
        if one_clump || passes.each_other(particles.material[a], particles.material[b]) {
            continue;
        }
        let of_fiber = [a, b].iter().any(|&p| fibers.contains(&particles.material[p]));
        if !(of_fiber || given || added) {
            continue;
        }
        let shift = state.cell.map_or_else(Vec3::zeros, |cell| cell.shift(pair.image));
        let distance = (particles.position[b] + shift - particles.position[a]).norm();
        let smaller = particles.radius[a].min(particles.radius[b]);
        let depth = (particles.radius[a] + particles.radius[b] - distance) / smaller;
        // Few pairs overlap by more than this, so few are looked up among the bonds.
        if depth <= OVERLAP_UNBONDED {
            continue;
        }
        let is_bonded = bonded(&Pair { a: pair.a, b: pair.b });
        if of_fiber && is_bonded || passing && !is_bonded {
            continue;
        }
        // Bonds are unstrained at the start, but a contact that follows a broken one is not.
        let [allowed, most] = if is_bonded { [OVERLAP_DEEP, OVERLAP_BONDED] } else { [OVERLAP_UNBONDED, OVERLAP_DEEP] };
        if depth > allowed {
            count += 1;
            refused |= depth > most || of_fiber;
            if deepest.is_none_or(|(other, _)| depth > other) {
                deepest = Some((depth, [pair.a, pair.b]));
            }
        }
    }
    let Some((depth, pair)) = deepest else { return Ok(None) };
    let [a, b] = pair.map(|p| particles.id[p as usize]);
    let message = format!(
        "particles {a} and {b} overlap by {depth:.3} of the smaller radius before the first step; {count} pairs \
         overlap by more than {OVERLAP_UNBONDED} without a bond, or {OVERLAP_DEEP} with one"
    );
    let of_fiber = pair.iter().any(|&p| fibers.contains(&particles.material[p as usize]));
    let help = if of_fiber {
        "their elastic energy is released at the start; write clearing = 1 in [fibers], which removes particles that overlap fibers"
    } else {
        "their elastic energy is released at the start; check positions, radii, and units, or join them in a [[clump]]"
    };
    let key = match (of_fiber, given) {
        (true, _) => "fibers.clearing",
        (false, true) => "packing",
        (false, false) => "clump",
    };
    if refused {
        return Err(unfit(key, format!("{message}; {help}")));
    }
    Ok(Some(scenario.warning(key, message, help)))
}
