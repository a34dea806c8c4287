//! Assembly: from a scenario to a state, a model, and a schedule.
//!
//! `assemble_stages` lists the stages; each stage has its own file. Particles and clumps come first, because walls,
//! bonds, and the loading refer to them; the time step comes last, because it depends on all of them.

mod aggregates;
mod bodies;
mod cache;
mod confinement;
mod cuts;
mod doubts;
mod error;
mod faces;
mod fibers;
mod heat;
mod histories;
mod joints;
mod loading;
mod membranes;
mod memory;
mod model;
mod motions;
mod opening;
mod overlaps;
mod particles;
mod place;
mod placed;
mod plane;
mod proportions;
mod radii;
pub mod restart;
pub mod samples;
mod selection;
mod slaves;
mod stl;
mod strengths;
mod surface;
mod time_step;
mod walled;
mod walls;

use std::path::Path;

use cuts::Cuts;
use fibers::Links;

use crate::schedule::{Bonding, Histories, Moment, Rounding, Schedule, Stop};
use crate::schema::{LawName, Problem, Quantity, Scenario};
use concordem_contact::law::cpm::Cpm;
use concordem_contact::math::Vec3;
use concordem_packing::TIE;
use concordem_packing::bonding::{self, BondCount};
use concordem_solver::collision::Collision;
use concordem_solver::coupling::Convergence;
use concordem_solver::forces::EvaluatedContacts;
pub use concordem_solver::laws;
use concordem_solver::state::contacts::{ContactBlock, Contacts, Pair};
use concordem_solver::state::{Particles, State};
use concordem_solver::time_step::TimeStepBounds;
use concordem_solver::{Model, PairCoefficients};

pub use aggregates::{Phase, Phases};
pub use bodies::apply_loads;
pub use cache::PackingCache;
pub use doubts::most_steps;
use doubts::{between, bounds};
pub use error::{AssemblyError, unfit};
pub use fibers::{FiberFacts, FiberPhase};
pub use model::deformable;
pub use place::{place, place_cached, solid};
pub use placed::{Cooking, Placed, Walled};
pub use surface::half_spaces;
pub use time_step::{Sharpness, settles};

/// A built scenario.
pub struct Assembly {
    /// The state before the first step.
    pub state: State,
    /// Laws and parameters.
    pub model: Model,
    /// Loading, samples, and stop conditions.
    pub schedule: Schedule,
    /// Facts about the assembled system, for reports.
    pub summary: Summary,
}

/// Facts about the assembled system, for reports.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Number of particles.
    pub particles: usize,
    /// Number of bonds.
    pub bonds: usize,
    /// Bonds per particle, `2N_b/N`.
    pub coordination: f64,
    /// Bonds per particle in the packing before it was cut, and the interaction ratio that gives them, if the scenario gives
    /// a coordination number.
    pub bulk: Option<(f64, f64)>,
    /// Aggregates and pores, if the scenario has some.
    pub phases: Option<Phases>,
    /// Fibers, if the scenario has some.
    pub fibers: Option<FiberFacts>,
    /// With aggregates: numbers of bonds (but those of fibers) within the mortar, within aggregates, between mortar and aggregates, and between two
    /// aggregates.
    pub bonds_by_phase: Option<[usize; 4]>,
    /// Number of bonds across each `[[joint]]`.
    pub joint_bonds: Vec<usize>,
    /// Solid volume divided by the volume of the packing, if it has one.
    pub packing_fraction: Option<f64>,
    /// Cross-section and length of the loaded specimen, m², m.
    pub specimen: Option<(f64, f64)>,
    /// Stability bounds.
    pub bounds: TimeStepBounds,
    /// The stiffest contact that may form.
    pub collision: Option<Collision>,
    /// Largest stable time step, s, including damping and contacts that may form.
    pub stable_step: f64,
    /// Largest explicit step of heat conduction, s (time of the run); infinite for implicit steps; `None` without heat.
    pub heat_step: Option<f64>,
    /// Convergence of the iteration between strains and forces of deformable particles.
    pub convergence: Option<Convergence>,
    /// `min r √(ρ/E)`, s, with the stiffest modulus of the materials, if any law has a modulus.
    pub p_wave: Option<f64>,
    /// Whether the time step exceeds the stability bound (only if the scenario allows it).
    pub unstable: bool,
    /// Estimated peak memory of a run, from the assembly to the result, bytes.
    pub memory: usize,
    /// Warnings found while the scenario was built. [`Scenario::warnings`] finds those that follow from its text alone.
    pub warnings: Vec<Problem>,
}

/// Receives the progress of the assembly: the name of a stage and its completed fraction, 0 to 1.
pub type Progress<'a> = &'a mut dyn FnMut(&str, f64);

/// Makes only the packing of a scenario; its paths are relative to `folder`.
///
/// # Errors
/// The packing cannot be made or read.
pub fn pack(
    scenario: &Scenario,
    folder: &Path,
    progress: Progress<'_>,
) -> Result<concordem_packing::Packing, AssemblyError> {
    Ok(place(scenario, folder, progress)?.packing)
}

/// Builds a scenario; its paths are relative to `folder`.
///
/// # Errors
/// The packing cannot be made, the scenario does not fit it, or the time step is unstable.
pub fn assemble(scenario: &Scenario, folder: &Path, progress: Progress<'_>) -> Result<Assembly, AssemblyError> {
    let placed = place(scenario, folder, progress)?;
    assemble_placed(scenario, folder, &placed, progress)
}

/// Builds a scenario as [`assemble`] does; packings that take long to make are read from the cache, and stored there. `sharpness`: of the
/// stability bounds in the summary; [`assemble`] finds sharp ones.
///
/// # Errors
/// Those of [`assemble`].
pub fn assemble_cached(
    scenario: &Scenario,
    folder: &Path,
    cache: Option<&PackingCache>,
    sharpness: Sharpness,
    progress: Progress<'_>,
) -> Result<Assembly, AssemblyError> {
    let placed = place_cached(scenario, folder, cache, progress)?;
    let how = Assembling { replace: &mut |_, _| (), sharpness };
    assemble_stages(scenario, folder, &placed, how, progress)
}

/// Builds a scenario as [`assemble`] does, but refuses sphere packs in HDF5. A library that calls only this one can be linked
/// without HDF5.
///
/// # Errors
/// Those of [`assemble`]; a packing in an HDF5 file.
pub fn assemble_without_hdf5(
    scenario: &Scenario,
    folder: &Path,
    progress: Progress<'_>,
) -> Result<Assembly, AssemblyError> {
    let placed = place::place_with(scenario, folder, place::without_hdf5, None, progress)?;
    assemble_placed(scenario, folder, &placed, progress)
}

/// The particles of a scenario in the order of their ids, with materials and aggregates, if anything divides them: aggregates, given
/// phases, fibers, or sets with a material. Particles that cuts and pores remove are left out. `None` if they all have one material.
///
/// # Errors
/// The scenario does not fit the packing.
pub fn divided(
    scenario: &Scenario,
    folder: &Path,
    placed: &Placed,
    progress: Progress<'_>,
) -> Result<Option<Particles>, AssemblyError> {
    let by_sets = scenario.sets.iter().any(|set| set.material.is_some());
    if !(by_sets || scenario.aggregates.is_some() || scenario.phases.is_some() || scenario.fibers.is_some()) {
        return Ok(None);
    }
    let cuts = Cuts::new(scenario, folder, placed.packing.cell.as_ref())?;
    let aggregates = aggregates::build(scenario, folder, placed, progress)?;
    let chains = fibers::build(scenario, folder, placed, aggregates.as_ref(), progress)?;
    let particles = particles::build(scenario, placed, &cuts, aggregates.as_ref(), chains.as_ref())?.state.particles;
    let mut order: Vec<u32> = (0..particles.len() as u32).collect();
    order.sort_unstable_by_key(|&p| particles.id[p as usize]);
    Ok(Some(particles.permuted(&order)))
}

/// Builds a scenario on a packing made earlier for this scenario, or for one with the same `packing` and `dimension`.
///
/// # Errors
/// The scenario does not fit the packing, or the time step is unstable.
pub fn assemble_placed(
    scenario: &Scenario,
    folder: &Path,
    placed: &Placed,
    progress: Progress<'_>,
) -> Result<Assembly, AssemblyError> {
    assemble_with(scenario, folder, placed, &mut |_, _| (), progress)
}

/// Receives the state with all bonds and the blocks of contacts, before the time step is chosen. It may replace laws.
pub type ReplaceLaws<'a> = &'a mut dyn FnMut(&mut State, &Model);

/// Builds a scenario as [`assemble_placed`] does, with laws of the caller.
///
/// # Errors
/// Those of [`assemble_placed`].
pub fn assemble_with(
    scenario: &Scenario,
    folder: &Path,
    placed: &Placed,
    replace: ReplaceLaws<'_>,
    progress: Progress<'_>,
) -> Result<Assembly, AssemblyError> {
    assemble_stages(scenario, folder, placed, Assembling { replace, sharpness: Sharpness::Sharp }, progress)
}

/// What callers choose of an assembly besides its scenario.
struct Assembling<'a> {
    /// May replace laws.
    replace: ReplaceLaws<'a>,
    /// Of the stability bounds in the summary.
    sharpness: Sharpness,
}

/// The stages from a packing to an assembly.
fn assemble_stages(
    scenario: &Scenario,
    folder: &Path,
    placed: &Placed,
    how: Assembling<'_>,
    progress: Progress<'_>,
) -> Result<Assembly, AssemblyError> {
    stages(scenario, folder, placed, how, progress).map_err(|error| {
        let radii: Vec<f64> = placed.packing.spheres.iter().map(|sphere| sphere.radius).collect();
        doubts::with_unit(scenario, &radii, error)
    })
}

fn stages(
    scenario: &Scenario,
    folder: &Path,
    placed: &Placed,
    Assembling { replace, sharpness }: Assembling<'_>,
    progress: Progress<'_>,
) -> Result<Assembly, AssemblyError> {
    memory::check_particles(scenario, placed)?;
    let mut cuts = Cuts::new(scenario, folder, placed.packing.cell.as_ref())?;
    let aggregates = aggregates::build(scenario, folder, placed, progress)?;
    let chains = fibers::build(scenario, folder, placed, aggregates.as_ref(), progress)?;
    let built = particles::build(scenario, placed, &cuts, aggregates.as_ref(), chains.as_ref())?;
    let particles::Built { mut state, members, phases, links } = built;
    if state.particles.is_empty() {
        let message = "has no particles: check the file, the shape, and the units".to_owned();
        return Err(unfit("packing", message));
    }
    near_origin(&state)?;
    bodies::apply_motions(scenario, &mut state)?;
    bodies::add_clumps(scenario, &members, &mut state)?;
    let mut model = model::build(scenario);
    model.strengths = strengths::build(scenario, placed, &cuts, &state)?;
    let mut warnings = phases.as_ref().map_or_else(Vec::new, |phases| phases.doubtful(scenario));
    let bonded = add_bonds(scenario, (placed, links), &mut cuts, &mut state, &mut warnings, progress)?;
    add_contacts(scenario, &mut model, &mut state)?;
    let (joint_bonds, idle) = joints::add(scenario, folder, bonded.interaction_ratio, &mut model, &mut state)?;
    warnings.extend(idle);
    replace(&mut state, &model);
    walls::add(scenario, folder, &mut state)?;
    let recorded = slaves::build(scenario, folder, &mut state)?;
    let mut schedule = schedule(scenario, placed, bonded.interaction_ratio, &mut state)?;
    overlaps::refuse_walls(scenario, &state)?;
    warnings.extend(overlaps::of_particles(scenario, &state)?);
    let heat = heat::build(scenario, &mut state, &mut model)?;
    progress("time step", 0.0);
    let mut tune = |state: &State, stiffness_sum: f64| schedule.loading.tune(state, stiffness_sum);
    let step = time_step::choose(scenario, &model, &mut state, sharpness, &mut tune)?;
    state.clock.dt = step.dt;
    schedule.rounding = Rounding::new(&state, schedule.loading.volume(&state), step.stiffness_sum);
    schedule.histories = histories::build(scenario, &schedule.loading, &mut state)?;
    schedule.histories.heat = heat;
    schedule.histories.recorded = recorded;
    slaves::start(&schedule.histories, &mut state)?;
    schedule.bond_rows = bonded.rows;
    schedule.servos = walls::servos(scenario, &step, &mut state)?;
    let p_wave = time_step::p_wave(scenario, &state.particles);
    warnings.extend(doubts::sizes(scenario, &state.particles.radius));
    warnings.extend(proportions::warnings(scenario, &state));
    warnings.extend(doubts::empty_regions(scenario, &schedule.operators, &state));
    warnings.extend(doubts::rates(scenario, &schedule, &state, p_wave));
    warnings.extend(doubts::unfilled(scenario, &state));
    warnings.extend(doubts::pieces(scenario, &state));
    warnings.extend(strengths::doubtful(scenario, &state));
    let particles = state.particles.len();
    let summary = Summary {
        particles,
        bonds: bonded.bonds,
        coordination: if particles > 0 { 2.0 * bonded.bonds as f64 / particles as f64 } else { 0.0 },
        bulk: bonded.bulk,
        bonds_by_phase: (phases.is_some() || scenario.phases.is_some()).then_some(bonded.by_phase),
        phases,
        joint_bonds,
        fibers: bonded.fibers,
        packing_fraction: placed.packing_fraction,
        specimen: schedule.loading.dimensions(),
        bounds: step.bounds,
        collision: step.collision,
        stable_step: step.limit,
        convergence: step.convergence,
        p_wave,
        heat_step: step.heat,
        unstable: step.unstable,
        memory: step.memory,
        warnings,
    };
    Ok(Assembly { state, model, schedule, summary })
}

/// Largest allowed rounding error of a coordinate, as a fraction of the radius: overlaps of 1e-3 radii keep one digit.
const COARSEST: f64 = 1e-4;

/// Refuses positions so far from the origin that their rounding errors are not small compared to the radii.
fn near_origin(state: &State) -> Result<(), AssemblyError> {
    let particles = &state.particles;
    let rounding = |p: usize| particles.position[p].amax() * f64::EPSILON;
    match (0..particles.len()).find(|&p| rounding(p) > COARSEST * particles.radius[p]) {
        None => Ok(()),
        Some(p) => {
            let (distance, radius) = (particles.position[p].amax(), particles.radius[p]);
            let message = format!(
                "particle {} lies {distance:e} m from the origin, where coordinates are rounded by {:.1e} m: too coarse for its \
                 radius of {radius:e} m. Move the packing near the origin, and check the units",
                particles.id[p],
                rounding(p)
            );
            Err(unfit("packing", message))
        }
    }
}

/// Result of bonding.
struct Bonded {
    /// Number of bonds.
    bonds: usize,
    /// Center distance below which particles are bonded, divided by the sum of their radii; 1 without bonds.
    interaction_ratio: f64,
    /// See [`Summary::bulk`].
    bulk: Option<(f64, f64)>,
    /// See [`Summary::bonds_by_phase`].
    by_phase: [usize; 4],
    /// See [`Summary::fibers`].
    fibers: Option<FiberFacts>,
    /// Pair coefficients.
    rows: PairCoefficients,
}

impl Bonded {
    /// No bonds at the start.
    fn none(interaction_ratio: f64, rows: PairCoefficients) -> Self {
        Self { bonds: 0, interaction_ratio, bulk: None, by_phase: [0; 4], fibers: None, rows }
    }
}

/// Adds bonds between particles.
fn add_bonds(
    scenario: &Scenario,
    (placed, links): (&Placed, Option<Links>),
    cuts: &mut Cuts,
    state: &mut State,
    warnings: &mut Vec<Problem>,
    progress: Progress<'_>,
) -> Result<Bonded, AssemblyError> {
    let Some(section) = &scenario.bonds else {
        if scenario.dimension == 2 {
            plane::check_reach(&placed.packing, 1.0)?;
        }
        let rows = PairCoefficients::default();
        return Ok(Bonded::none(1.0, rows));
    };
    progress("bonding", 0.0);
    let (mut block, mut rows) = laws::block(section.law, &scenario.materials, &aggregates::interfaces(scenario))?;
    let mut interaction_ratio = section.interaction_ratio.si();
    if !section.at_start {
        let ratio = scenario.bondings.iter().map(|bonding| bonding.interaction_ratio.si()).fold(1.0, f64::max);
        if scenario.dimension == 2 {
            plane::check_reach(&placed.packing, ratio * (1.0 + TIE))?;
        }
        state.bonds.push(block);
        return Ok(Bonded::none(ratio, rows));
    }
    let mut bulk = None;
    if let Some(coordination) = section.coordination {
        let found = placed.ratio_for_coordination(coordination.si())?;
        let (ratio, reached) = found.ok_or_else(|| {
            let message = format!(
                "no interaction ratio up to 2 gives {} bonds per particle; random packings allow 6 to 12",
                coordination.si()
            );
            unfit("bonds.coordination", message)
        })?;
        interaction_ratio = ratio;
        bulk = Some((reached, ratio));
    }
    let cell = state.cell;
    let cell = cell.as_ref();
    if scenario.dimension == 2 {
        plane::check_reach(&placed.packing, interaction_ratio * (1.0 + TIE))?;
    }
    let links = links.as_ref();
    let along = links.map_or(Ok(None), |links| bond_fibers(scenario, links, cuts, state, &mut block, &mut rows))?;
    let particles = &state.particles;
    // Sections refer to the mean radius of the packing, without fibers.
    let counts = &|p: usize| links.is_none_or(|links| !links.has(particles.material[p]));
    let network = placed.walled.as_ref().and_then(|walled| walled.network.as_ref());
    let severed = &mut |p: &Vec3, q: &Vec3| cuts.sever(p, q);
    let count = if let Some(links) = network {
        let links = in_order_of_state(links, particles, placed.packing.spheres.len())?;
        interaction_ratio = bonding::longest(&links, particles);
        bonding::bond_links(block.contacts_mut(), &rows, particles, &links, counts, severed)
    } else {
        memory::check_bonds(particles, cell, interaction_ratio)?;
        bonding::bond_unless(block.contacts_mut(), &rows, particles, cell, interaction_ratio, counts, severed)?
    };
    warnings.extend(faces::correct(scenario, placed, interaction_ratio, particles, block.contacts_mut())?);
    warnings.extend(doubtful_bonds(scenario, &count, bulk));
    warnings.extend(long_bonds(scenario, block.contacts(), particles)?);
    warnings.extend(cuts.without_effect(scenario, &state.particles.position));
    let ends = |k: usize| block.contacts().view(k).pair;
    let numbers = |Pair { a, b }: Pair| [a, b].map(|p| particles.aggregate_of(p as usize));
    let in_fiber = |p: u32| links.is_some_and(|links| links.has(particles.material[p as usize]));
    let to_fiber = |pair: &Pair| in_fiber(pair.a) != in_fiber(pair.b);
    let others = |pair: &Pair| !in_fiber(pair.a) && !in_fiber(pair.b);
    let pairs = || (0..block.len()).map(ends);
    let by_phase = aggregates::count_bonds(pairs().filter(others).map(numbers));
    let held = pairs().filter(to_fiber).count();
    let mut fibers = None;
    let mut bonds = block.len();
    state.bonds.push(block);
    if let Some((links, (made, chains))) = links.zip(along) {
        bonds += chains.as_ref().map_or(0, |chains| chains.len());
        state.bonds.extend(chains);
        let facts = FiberFacts { bonds: [made, held], ..links.facts.clone() };
        warnings.extend(fibers::doubtful(scenario, &facts));
        fibers = Some(facts);
    }
    Ok(Bonded { bonds, interaction_ratio, bulk, by_phase, fibers, rows })
}

/// Bonds along fibers: their number, and their block unless it is that of the other bonds.
type ChainBonds = (usize, Option<Box<dyn EvaluatedContacts>>);

/// Joins the particles of each fiber by beams: in the `block` of bonds if these are beams too, else in a block of their own. Afterwards
/// `rows` have no coefficients between fibers.
fn bond_fibers(
    scenario: &Scenario,
    links: &Links,
    cuts: &mut Cuts,
    state: &State,
    block: &mut Box<dyn EvaluatedContacts>,
    rows: &mut PairCoefficients,
) -> Result<Option<ChainBonds>, AssemblyError> {
    let particles = &state.particles;
    let pairs = links.in_order_of_state(particles);
    let severed = &mut |p: &Vec3, q: &Vec3| cuts.sever(p, q);
    let law = LawName::CohesiveBeam;
    let chains = if block.law() == law.key() {
        (bonding::bond_links(block.contacts_mut(), rows, particles, &pairs, &|_| true, severed).bonds, None)
    } else {
        // Interfaces of the other bonds do not matter along a fiber; their own tables let fibers of two kinds differ.
        let with_tables = scenario.interfaces.iter().filter(|one| one.cohesive_beam.is_some()).cloned();
        let (mut own, rows) = laws::block(law, &scenario.materials, &with_tables.collect::<Vec<_>>())?;
        let made = bonding::bond_links(own.contacts_mut(), &rows, particles, &pairs, &|_| true, severed);
        (made.bonds, Some(own))
    };
    links.part(rows);
    Ok(Some(chains))
}

/// Pairs of spheres of the packing as pairs of particles, the lower index first; `spheres`: number of spheres of the packing.
fn in_order_of_state(
    links: &[[u32; 2]],
    particles: &Particles,
    spheres: usize,
) -> Result<Vec<[u32; 2]>, AssemblyError> {
    let mut index_of = vec![u32::MAX; particles.len().max(spheres)];
    for (index, &id) in particles.id.iter().enumerate() {
        index_of[id as usize] = index as u32;
    }
    if particles.len() < spheres {
        let message = "numbers the spheres of the packing, but a [[cut]] or a pore removes some; remove the key, and give \
                       bonds.coordination";
        return Err(unfit("packing.correction", message.into()));
    }
    let pair = |link: &[u32; 2]| {
        let [a, b] = link.map(|sphere| index_of[sphere as usize]);
        [a.min(b), a.max(b)]
    };
    Ok(links.iter().map(pair).collect())
}

/// Warns if there are no bonds, or if their number depends on a tie. `bulk`: see [`Summary::bulk`].
fn doubtful_bonds(scenario: &Scenario, count: &BondCount, bulk: Option<(f64, f64)>) -> Option<Problem> {
    let key = if bulk.is_some() { "bonds.coordination" } else { "bonds.interaction_ratio" };
    if count.bonds == 0 {
        let help = "check positions, radii, and units, or give a larger `interaction_ratio`, such as 1.1";
        return Some(scenario.warning(key, "no two particles are near enough for a bond, so there are no bonds", help));
    }
    if count.ties == 0 {
        return None;
    }
    let message = format!(
        "{} of the {} bonds are as long as the longest that the interaction ratio allows, up to a relative difference of \
         {TIE:e}; they count as bonds here, but rounding decides about them in other codes",
        count.ties, count.bonds
    );
    let help = match bulk {
        Some((reached, _)) => format!(
            "pairs that are equally far apart are bonded all or none: the packing has {reached} bonds per particle; give that \
             number, or `interaction_ratio`"
        ),
        None => "give a ratio between two distances; 1.01 bonds all particles that touch".to_owned(),
    };
    Some(scenario.warning(key, message, help))
}

/// Bonds that are long for their fracture energy: an error where they have stored it before they soften, a warning where they soften more
/// steeply than they load.
fn long_bonds(
    scenario: &Scenario,
    block: &dyn Contacts,
    particles: &Particles,
) -> Result<Option<Problem>, AssemblyError> {
    // Exponential softening begins with the slope Ēε₀/ε_f, which is Ē at the length 2G/(3Ēε₀²), a third of the longest one.
    let Some((k, ratio)) = block.relatively_longest().filter(|(_, ratio)| *ratio > 1.0 / 3.0) else {
        return Ok(None);
    };
    let length = block.view(k).reference.length;
    let key = format!("material[{}].{}", particles.material[block.view(k).pair.a as usize], block.law());
    let longest = length / ratio;
    if ratio >= 1.0 {
        let message = format!(
            "a bond is {length:.4e} m long; from {longest:.4e} m on it stores its fracture energy before it softens. Use smaller particles, or a \
             larger `fracture_energy`"
        );
        return Err(unfit(&key, message));
    }
    let message = format!(
        "its bonds of more than {:.4e} m, up to {length:.4e} m, soften more steeply than they load: the body may break at once, and dissipate more",
        longest / 3.0
    );
    Ok(Some(scenario.warning(&key, message, "use smaller particles, or a larger `fracture_energy`")))
}

/// Adds empty blocks of contacts between particles and with walls.
fn add_contacts(scenario: &Scenario, model: &mut Model, state: &mut State) -> Result<(), AssemblyError> {
    let block = laws::contact_block(scenario.contacts.law, &scenario.materials, &aggregates::interfaces(scenario))?;
    let Some((block, mut rows)) = block else { return Ok(()) };
    for [a, b] in &scenario.contacts.exclude {
        rows.remove(material_index(scenario, a), material_index(scenario, b));
    }
    model.wall_rows = rows.clone();
    model.contact_rows = rows;
    if !scenario.wall_names().is_empty() {
        state.wall_contacts = Some(block.boxed_clone());
    }
    state.contacts = Some(block);
    Ok(())
}

/// Builds the schedule: loading (which also sets velocities and constraints), samples, and stop conditions.
fn schedule(
    scenario: &Scenario,
    placed: &Placed,
    interaction_ratio: f64,
    state: &mut State,
) -> Result<Schedule, AssemblyError> {
    let loading = loading::build(scenario, placed, interaction_ratio, state)?;
    let operators = samples::of(scenario, &state.particles, state.cell.as_ref())?;
    let opening = opening::of_loading(scenario, &loading, state)?;
    let confinement = confinement::of(scenario, &loading, state);
    Ok(Schedule {
        opening,
        confinement,
        loading,
        stages: histories::stages(scenario),
        histories: Histories::default(),
        servos: Vec::new(),
        initial_positions: samples::initial_positions(&operators, state),
        initial_edges: state.cell.map(|cell| cell.matrix),
        operators,
        planar: scenario.dimension == 2,
        rounding: Rounding::default(),
        stop: Stop {
            drop_to: scenario.stop.drop_to.map(Quantity::si),
            strain: scenario.stop.strain.map(Quantity::si),
            time: scenario.stop.time.map(Quantity::si),
            steps: scenario.stop.steps,
            unbalanced: scenario.stop.unbalanced.map(Quantity::si),
        },
        bondings: bondings(scenario),
        bond_rows: PairCoefficients::default(),
        allow_unstable: scenario.integration.allow_unstable,
        allow_energy_error: scenario.integration.allow_energy_error || scenario.integration.allow_unstable,
        sample_interval: scenario.output.sample_interval,
        snapshot_interval: scenario.output.snapshot_interval,
        checkpoint_interval: scenario.output.checkpoint_interval,
    })
}

/// Bonds made during the run.
fn bondings(scenario: &Scenario) -> Vec<Bonding> {
    let one = |bonding: &crate::schema::Bonding| {
        let stage =
            bonding.stage.as_ref().and_then(|name| scenario.stages.iter().position(|stage| stage.name == *name));
        let moment = stage.map_or_else(
            || Moment::After {
                time: bonding.time.map_or(0.0, Quantity::si),
                kinetic_energy: bonding.kinetic_energy.map(Quantity::si),
            },
            Moment::EndOfStage,
        );
        let between = bonding.between.as_ref().map(|names| names.each_ref().map(|name| material_index(scenario, name)));
        Bonding { moment, interaction_ratio: bonding.interaction_ratio.si(), between }
    };
    scenario.bondings.iter().map(one).collect()
}

/// Index of a material; the checks of the scenario guarantee that it exists.
fn material_index(scenario: &Scenario, name: &str) -> u16 {
    scenario.materials.iter().position(|m| m.name == name).unwrap_or(0) as u16
}

/// Index of a set; the checks of the scenario guarantee that it exists.
fn set_index(scenario: &Scenario, name: &str) -> usize {
    scenario.sets.iter().position(|s| s.name == name).unwrap_or(0)
}

/// Whether `block` holds bonds of the concrete particle model; reports show the parameters of these.
pub fn is_cpm(block: &dyn Contacts) -> bool {
    block.as_any().is::<ContactBlock<Cpm>>()
}
