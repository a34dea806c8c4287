//! Particles: spheres of the packing and of clumps, with sets, materials, masses, and clump membership.

use std::ops::Range;

use super::aggregates::{Division, Phases, Places, given};
use super::cuts::Cuts;
use super::fibers::{Chains, Links};
use super::selection::select;
use super::{AssemblyError, Placed, material_index, set_index, unfit};
use crate::schema::Scenario;
use concordem_contact::math::Vec3;
use concordem_packing::mass_of;
use concordem_solver::neighbor::spatial_order;
use concordem_solver::state::{Constraint, Particles, Sphere, State};

/// Largest number of sets: a particle stores its sets as the bits of a 64-bit number.
const MOST_SETS: usize = 64;

/// Members of every clump, as indices of the state.
pub(super) type ClumpMembers = Vec<Vec<u32>>;

/// The particles of a scenario.
pub(super) struct Built {
    /// The state with particles and cell.
    pub(super) state: State,
    pub(super) members: ClumpMembers,
    /// Phases, if the scenario has aggregates.
    pub(super) phases: Option<Phases>,
    /// Pairs along fibers, if it has fibers.
    pub(super) links: Option<Links>,
}

/// Builds a state with the particles and the cell of a scenario.
pub(super) fn build(
    scenario: &Scenario,
    placed: &Placed,
    cuts: &Cuts,
    aggregates: Option<&Places<'_>>,
    chains: Option<&Chains>,
) -> Result<Built, AssemblyError> {
    let cell = placed.packing.cell.as_ref();
    let mut packed = cuts.remaining(scenario, &placed.packing.spheres);
    let (mut division, phases) = aggregates.map(|aggregates| aggregates.divide(scenario, &mut packed)).unzip();
    let remains = |sphere: &Sphere| !cuts.remaining(scenario, std::slice::from_ref(sphere)).is_empty();
    division = given(scenario, &placed.packing.spheres, &remains)?.or(division);
    let links = chains
        .map(|chains| chains.add(scenario, cuts, cell, &mut packed, division.get_or_insert_default()))
        .transpose()?;
    let (spheres, added) = with_clumps(scenario, packed);
    let mut materials = vec![0u16; spheres.len()];
    let mut aggregate = Vec::new();
    if let Some(Division { number, material, of_matrix }) = division {
        materials[..of_matrix.len()].copy_from_slice(&of_matrix);
        for (material_of, &number) in materials.iter_mut().zip(&number) {
            let of_aggregate = number.checked_sub(1).and_then(|body| material[body as usize]);
            *material_of = of_aggregate.unwrap_or(*material_of);
        }
        aggregate = number;
        aggregate.resize(spheres.len(), 0);
    }
    let tags = sets(scenario, &spheres, &mut materials, &mut aggregate, links.as_ref())?;
    for (clump, added) in scenario.clumps.iter().zip(&added) {
        if let Some(name) = &clump.material {
            materials[added.clone()].fill(material_index(scenario, name));
        }
    }
    let members = members(scenario, &added, &tags);
    let mut particles = particles(scenario, &spheres, &materials, &tags);
    particles.aggregate = aggregate;
    join_clumps(&members, &mut particles)?;
    // Particles are ordered along a space-filling curve; `id` keeps their numbers in the scenario.
    let order = spatial_order(&particles.position, cell);
    let particles = particles.permuted(&order);
    let mut index_of = vec![0u32; order.len()];
    for (new, &old) in order.iter().enumerate() {
        index_of[old as usize] = new as u32;
    }
    let reindex = |members: Vec<u32>| {
        let mut members: Vec<u32> = members.into_iter().map(|m| index_of[m as usize]).collect();
        members.sort_unstable();
        members
    };
    let members = members.into_iter().map(reindex).collect();
    let state = State { particles, cell: placed.packing.cell, ..State::default() };
    Ok(Built { state, members, phases, links })
}

/// The spheres that remain of the packing, followed by those that clumps add, and the range of added spheres of every clump.
fn with_clumps(scenario: &Scenario, mut spheres: Vec<Sphere>) -> (Vec<Sphere>, Vec<Range<usize>>) {
    let mut added = Vec::with_capacity(scenario.clumps.len());
    for clump in &scenario.clumps {
        let first = spheres.len();
        let of_clump = clump.spheres.iter().flatten();
        spheres.extend(
            of_clump.map(|s| Sphere { position: Vec3::new(s[0].si(), s[1].si(), s[2].si()), radius: s[3].si() }),
        );
        added.push(first..spheres.len());
    }
    (spheres, added)
}

/// Set membership (one bit per set) of every sphere. A set with a material changes that of its spheres, which then belong to no
/// aggregate.
fn sets(
    scenario: &Scenario,
    spheres: &[Sphere],
    materials: &mut [u16],
    aggregate: &mut [u32],
    fibers: Option<&Links>,
) -> Result<Vec<u64>, AssemblyError> {
    if scenario.sets.len() > MOST_SETS {
        let message = format!("{} sets are given; at most {MOST_SETS} are possible", scenario.sets.len());
        return Err(unfit("set", message));
    }
    let mut tags = vec![0u64; spheres.len()];
    for (k, set) in scenario.sets.iter().enumerate() {
        let material = set.material.as_deref().map(|name| material_index(scenario, name));
        let members = select(&set.selection, spheres, k, &set.name)?;
        if let (Some(_), Some(fibers)) = (material, fibers) {
            let members: Vec<u32> = members.iter().map(|&p| p as u32).collect();
            fibers.refuse_material(scenario, k, &members)?;
        }
        for p in members {
            tags[p] |= 1 << k;
            if let Some(material) = material {
                materials[p] = material;
                if let Some(number) = aggregate.get_mut(p) {
                    *number = 0;
                }
            }
        }
    }
    Ok(tags)
}

/// Members of every clump: the particles of its set, or its added spheres.
fn members(scenario: &Scenario, added: &[Range<usize>], tags: &[u64]) -> ClumpMembers {
    let of_clump = |(clump, added): (&crate::schema::Clump, &Range<usize>)| match &clump.set {
        Some(name) => {
            let bit = 1u64 << set_index(scenario, name);
            (0..tags.len() as u32).filter(|&p| tags[p as usize] & bit != 0).collect()
        }
        None => (added.start as u32..added.end as u32).collect(),
    };
    scenario.clumps.iter().zip(added).map(of_clump).collect()
}

/// Builds the particles with mass and inertia; constrains them to the plane in two dimensions.
fn particles(scenario: &Scenario, spheres: &[Sphere], materials: &[u16], tags: &[u64]) -> Particles {
    let planar = scenario.dimension == 2;
    let densities: Vec<f64> = scenario.materials.iter().map(|m| m.density.si()).collect();
    let mut particles = Particles::default();
    for ((sphere, &material), &tag) in spheres.iter().zip(materials).zip(tags) {
        let (mass, inertia) = mass_of(sphere.radius, densities[material as usize], planar);
        particles.push(*sphere, material, mass, inertia);
        if let Some(last) = particles.tags.last_mut() {
            *last = tag;
        }
        if planar && let Some(last) = particles.constraint.last_mut() {
            *last = Constraint::OUT_OF_PLANE;
        }
    }
    particles
}

/// Marks the members of clumps; a particle belongs to one clump at most.
fn join_clumps(members: &[Vec<u32>], particles: &mut Particles) -> Result<(), AssemblyError> {
    for (k, members) in members.iter().enumerate() {
        if members.is_empty() {
            return Err(unfit(&format!("clump[{k}]"), "the set has no particles".into()));
        }
        for &m in members {
            let clump = &mut particles.clump[m as usize];
            if *clump != u32::MAX {
                let message = format!("particle {m} already belongs to clump {clump}");
                return Err(unfit(&format!("clump[{k}]"), message));
            }
            *clump = k as u32;
        }
    }
    Ok(())
}
