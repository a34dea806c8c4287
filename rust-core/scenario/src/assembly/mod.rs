//! From a scenario to a state, a model, and a plan.

mod loading;
mod place;
pub mod samples;
#[cfg(feature = "hdf5")]
pub mod sphere_pack;

use std::path::Path;

use crate::schedule::{Schedule, Stop};
use crate::schema::{self, Scenario, Selection};
use concordem_contact::kinematics::deformable::{Condition, Deformable, Update};
use concordem_contact::law::cpm::Cpm;
use concordem_contact::math::Vec3;
use concordem_packing::{PackingError, bonding, mass_of};
use concordem_solver::coupling::Convergence;
use concordem_solver::fracture::virial::HydrostaticStrength;
use concordem_solver::integrate::Damping;
pub use concordem_solver::laws;
use concordem_solver::laws::LawError;
use concordem_solver::neighbor::{NeighborError, spatial_order};
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::{Clump, Constraint, Particles, Sphere, State, Wall, WallShape};
use concordem_solver::time_step::{self, TimeStepBounds};
use concordem_solver::{Model, Scheme};
pub use place::{Placed, place};

/// Why a scenario cannot be built.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AssemblyError {
    /// The packing cannot be made.
    #[error("packing: {0}")]
    Packing(#[from] PackingError),
    /// The neighbour search refused.
    #[error("bonding: {0}")]
    Neighbor(#[from] NeighborError),
    /// The parameters of two materials do not make a law.
    #[error("law `{law}` between materials `{a}` and `{b}`: {message}")]
    Parameters {
        /// Law.
        law: &'static str,
        /// First material.
        a: String,
        /// Second material.
        b: String,
        /// What is wrong.
        message: String,
    },
    /// The scenario asks for something that this packing does not have.
    #[error("{key}: {message}")]
    Unfit {
        /// Key of the scenario.
        key: String,
        /// What is wrong, and what would be right.
        message: String,
    },
    /// The time step is above the stability bound.
    #[error(
        "integration.time_step is {given:.6e} s, but the assembled system is stable only below {bound:.6e} s \
         (largest frequency {frequency:.4e} rad/s); use \"auto\" or a smaller step, or set \
         integration.allow_unstable = true to run it all the same"
    )]
    Unstable {
        /// Time step given, s.
        given: f64,
        /// Stability bound, s.
        bound: f64,
        /// Largest angular frequency, rad/s.
        frequency: f64,
    },
    /// The strains of deformable particles and the forces would not find each other.
    #[error(
        "material.deformable: strains and forces do not settle, the spectral radius of their iteration is \
         {spectral_radius:.5}; the particles' Young's modulus must be above {young:.5e} Pa{}, or set \
         integration.allow_unstable = true to run it all the same",
        if *lagged {
            format!(" (or write deformable.update = \"iterated\" with relaxation below {relaxation:.3})")
        } else {
            format!(" (or lower deformable.relaxation below {relaxation:.3})")
        }
    )]
    NotConvergent {
        /// Spectral radius of the iteration.
        spectral_radius: f64,
        /// Whether the strains lag.
        lagged: bool,
        /// Relaxation below which the iteration converges.
        relaxation: f64,
        /// Least modulus of the softest material, if all are scaled alike, Pa.
        young: f64,
    },
    /// `time_step = "auto"` has nothing to go by.
    #[error("integration.time_step is \"auto\", but no contact gives a bound: give a time step in seconds")]
    NoTimeStep,
    /// A file cannot be read.
    #[error("{path}: {message}")]
    File {
        /// Path.
        path: String,
        /// What happened.
        message: String,
    },
}

impl From<LawError> for AssemblyError {
    fn from(error: LawError) -> Self {
        match error {
            LawError::Parameters { law, materials, source } => {
                let [a, b] = *materials;
                Self::Parameters { law, a, b, message: source.to_string() }
            }
            other => unfit("material", other.to_string()),
        }
    }
}

/// A scenario, built.
pub struct Assembly {
    /// The state before the first step.
    pub state: State,
    /// The model.
    pub model: Model,
    /// The plan.
    pub schedule: Schedule,
    /// Facts about what was built.
    pub summary: Summary,
}

/// Facts about what was built.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Particles.
    pub particles: usize,
    /// Bonds.
    pub bonds: usize,
    /// Bonds per particle, `2N_b/N`.
    pub coordination: f64,
    /// Bonds per particle in the packing before it was cut, and the interaction ratio that gives them, when the scenario
    /// asks for a coordination.
    pub bulk: Option<(f64, f64)>,
    /// Share of solid in the volume of the packing, if it has one.
    pub packing_fraction: Option<f64>,
    /// Cross-section and length of the loaded specimen, m², m.
    pub specimen: Option<(f64, f64)>,
    /// Stability bounds.
    pub bounds: TimeStepBounds,
    /// Whether strains and forces of deformable particles find each other.
    pub convergence: Option<Convergence>,
    /// `min r √(ρ/E)`, s, with the stiffest modulus of the materials, if any law has a modulus.
    pub p_wave: Option<f64>,
    /// The run was allowed to be unstable, and is.
    pub unstable: bool,
    /// Memory of state and solver in bytes, about.
    pub memory: usize,
}

/// Progress of the assembly: a name of the stage, and how far it is, 0 to 1.
pub type Progress<'a> = &'a mut dyn FnMut(&str, f64);

/// Make only the packing of a scenario. Paths in it are relative to `folder`.
pub fn pack(
    scenario: &Scenario,
    folder: &Path,
    progress: Progress<'_>,
) -> Result<concordem_packing::Packing, AssemblyError> {
    Ok(place(scenario, folder, progress)?.packing)
}

/// Build a scenario. Paths in it are relative to `folder`.
pub fn assemble(scenario: &Scenario, folder: &Path, progress: Progress<'_>) -> Result<Assembly, AssemblyError> {
    let placed = place(scenario, folder, progress)?;
    assemble_placed(scenario, folder, &placed, progress)
}

/// Build a scenario on a packing that was made for it, or for another one with the same `packing` and `dimension`.
pub fn assemble_placed(
    scenario: &Scenario,
    folder: &Path,
    placed: &Placed,
    progress: Progress<'_>,
) -> Result<Assembly, AssemblyError> {
    let planar = scenario.dimension == 2;
    let mut particles = Particles::default();
    let densities: Vec<f64> = scenario.materials.iter().map(|m| m.density.si()).collect();
    if scenario.sets.len() > 64 {
        return Err(unfit("set", format!("{} sets are given; at most 64 are possible", scenario.sets.len())));
    }
    // Spheres of clumps come behind the packing.
    let mut all = placed.packing.spheres.clone();
    let mut added = Vec::with_capacity(scenario.clumps.len());
    for clump in &scenario.clumps {
        let first = all.len();
        all.extend(
            clump
                .spheres
                .iter()
                .flatten()
                .map(|s| Sphere { position: Vec3::new(s[0].si(), s[1].si(), s[2].si()), radius: s[3].si() }),
        );
        added.push(first..all.len());
    }
    let mut materials = vec![0u16; all.len()];
    let mut tags = vec![0u64; all.len()];
    for (k, set) in scenario.sets.iter().enumerate() {
        let members = select(&set.selection, &all, &set.name)?;
        let material = set.material.as_deref().map(|name| material_index(scenario, name));
        for p in members {
            tags[p] |= 1 << k;
            if let Some(material) = material {
                materials[p] = material;
            }
        }
    }
    let mut clump_members: Vec<Vec<u32>> = Vec::with_capacity(added.len());
    for (clump, added) in scenario.clumps.iter().zip(added) {
        if let Some(name) = &clump.material {
            materials[added.clone()].fill(material_index(scenario, name));
        }
        clump_members.push(if let Some(name) = &clump.set {
            let bit = 1u64 << set_index(scenario, name);
            (0..all.len() as u32).filter(|&p| tags[p as usize] & bit != 0).collect()
        } else {
            (added.start as u32..added.end as u32).collect()
        });
    }
    for ((sphere, &material), &tag) in all.iter().zip(&materials).zip(&tags) {
        let density = densities[material as usize];
        let (mass, inertia) = mass_of(sphere.radius, density, planar);
        particles.push(*sphere, material, mass, inertia);
        if let Some(last) = particles.tags.last_mut() {
            *last = tag;
        }
        if planar && let Some(last) = particles.constraint.last_mut() {
            *last = Constraint::OUT_OF_PLANE;
        }
    }
    for (k, members) in clump_members.iter().enumerate() {
        if members.is_empty() {
            return Err(unfit(&format!("clump[{k}]"), "the set has no particle".into()));
        }
        for &m in members {
            if particles.clump[m as usize] != u32::MAX {
                let message = format!("particle {m} already belongs to clump {}", particles.clump[m as usize]);
                return Err(unfit(&format!("clump[{k}]"), message));
            }
            particles.clump[m as usize] = k as u32;
        }
    }
    // Store particles along a space-filling curve; the user's numbers stay in `id`.
    let order = spatial_order(&particles.position, placed.packing.cell.as_ref());
    let particles = particles.permuted(&order);
    let mut index_of = vec![0u32; order.len()];
    for (new, &old) in order.iter().enumerate() {
        index_of[old as usize] = new as u32;
    }
    let mut state = State { particles, cell: placed.packing.cell, ..State::default() };
    motions(scenario, &mut state)?;
    for (number, (clump, members)) in scenario.clumps.iter().zip(&clump_members).enumerate() {
        let mut members: Vec<u32> = members.iter().map(|&m| index_of[m as usize]).collect();
        members.sort_unstable();
        let inertia = clump.inertia.map(|i| Vec3::new(i[0].si(), i[1].si(), i[2].si()));
        let (velocity, spin) = motion_of_clump(clump, number, &members, &state.particles)?;
        let mut body = Clump::new(members, &state.particles, clump.mass.map(schema::Quantity::si), inertia);
        if planar {
            body.constraint = Constraint::OUT_OF_PLANE;
        }
        body.start(velocity, spin, &mut state.particles);
        state.clumps.push(body);
    }

    // Laws.
    let mut model = Model {
        mode: scenario.kinematics,
        scheme: match scenario.integration.scheme {
            schema::Scheme::Leapfrog => Scheme::Leapfrog,
            schema::Scheme::VelocityVerlet => Scheme::VelocityVerlet,
        },
        damping: damping(&scenario.integration.damping),
        gravity: schema::quantity::vector(&scenario.integration.gravity),
        damage_threshold: scenario.output.events_damage.si(),
        hydrostatic_strength: hydrostatic_strength(scenario),
        deformable: deformable(scenario),
        ..Model::default()
    };
    let mut bonds = 0;
    let mut bulk = None;
    // Of bonds; without them particles reach as far as they touch.
    let mut interaction_ratio = 1.0;
    if let Some(section) = &scenario.bonds {
        progress("bonding", 0.0);
        let (mut block, rows) = laws::block(section.law, &scenario.materials, &scenario.interfaces)?;
        interaction_ratio = section.interaction_ratio.si();
        if let Some(coordination) = section.coordination {
            let whole = placed.unit.as_ref().unwrap_or(&placed.packing);
            let found = bonding::ratio_for_coordination(&whole.spheres, whole.cell.as_ref(), coordination.si())?;
            let (found, reached) = found.ok_or_else(|| {
                let message = format!("{} bonds per particle are not to be had", coordination.si());
                unfit("bonds.coordination", message + " within twice the radii; random packings have 6 to 12")
            })?;
            interaction_ratio = found;
            bulk = Some((reached, found));
        }
        bonds = bonding::bond(block.contacts_mut(), &rows, &state.particles, state.cell.as_ref(), interaction_ratio)?;
        state.bonds.push(block);
    }
    if let Some((block, rows)) = laws::contact_block(scenario.contacts.law, &scenario.materials, &scenario.interfaces)?
    {
        model.wall_rows = rows.clone();
        model.contact_rows = rows;
        if !scenario.walls.is_empty() || matches!(scenario.loading, schema::Loading::Platens { .. }) {
            state.wall_contacts = Some(block.boxed_clone());
        }
        state.contacts = Some(block);
    }
    for (k, wall) in scenario.walls.iter().enumerate() {
        add_wall(scenario, folder, k, wall, &mut state)?;
    }
    if !state.walls.is_empty() && state.wall_contacts.is_none() {
        return Err(unfit("contacts.law", "walls need a law of contact; \"none\" makes particles pass".into()));
    }

    // Loading, which also sets velocities and constraints.
    let loading = loading::build(scenario, placed, interaction_ratio, &mut state)?;
    let operators = samples::of(scenario, &state.particles, state.cell.is_some())?;
    let schedule = Schedule {
        loading,
        places: samples::places(&operators, &state),
        operators,
        plane: planar,
        stop: Stop {
            drop_to: scenario.stop.drop_to.map(schema::Quantity::si),
            strain: scenario.stop.strain.map(schema::Quantity::si),
            time: scenario.stop.time.map(schema::Quantity::si),
            steps: scenario.stop.steps,
            unbalanced: scenario.stop.unbalanced.map(schema::Quantity::si),
        },
        sample_interval: scenario.output.sample_interval,
        snapshot_interval: scenario.output.snapshot_interval,
        checkpoint_interval: scenario.output.checkpoint_interval,
    };

    // Time step.
    progress("time step", 0.0);
    let mut probe = state.clone();
    // Let candidates near each other count, as if they touched.
    concordem_solver::Solver::new(model.clone(), &mut probe).map_err(|error| unfit("packing", error.to_string()))?;
    let (bounds, convergence) = time_step::bounds_with(&probe, model.deformable.as_ref());
    if let (Some(deformable), Some(convergence)) = (&model.deformable, convergence) {
        settles(deformable, &convergence, scenario.integration.allow_unstable)?;
    }
    let limit = bounds.spectral.max(bounds.per_particle) * model.damping.stability();
    let mut unstable = false;
    state.clock.dt = match scenario.integration.time_step {
        schema::TimeStep::Auto if limit.is_finite() => limit * scenario.integration.safety.si(),
        schema::TimeStep::Auto => return Err(AssemblyError::NoTimeStep),
        schema::TimeStep::Given(step) => {
            unstable = step.si() > limit;
            if unstable && !scenario.integration.allow_unstable {
                return Err(AssemblyError::Unstable { given: step.si(), bound: limit, frequency: bounds.frequency });
            }
            step.si()
        }
    };
    let n = state.particles.len();
    let summary = Summary {
        particles: n,
        bonds,
        coordination: if n > 0 { 2.0 * bonds as f64 / n as f64 } else { 0.0 },
        bulk,
        packing_fraction: placed.packing_fraction,
        specimen: schedule.loading.dimensions(),
        bounds,
        convergence,
        p_wave: stiffest_modulus(scenario).map(|young| time_step::p_wave(&state.particles, young)),
        unstable,
        memory: memory(&probe),
    };
    Ok(Assembly { state, model, schedule, summary })
}

/// The error of a scenario whose key `key` does not fit what was built.
pub fn unfit(key: &str, message: String) -> AssemblyError {
    AssemblyError::Unfit { key: key.to_owned(), message }
}

fn material_index(scenario: &Scenario, name: &str) -> u16 {
    scenario.materials.iter().position(|m| m.name == name).unwrap_or(0) as u16
}

fn set_index(scenario: &Scenario, name: &str) -> usize {
    scenario.sets.iter().position(|s| s.name == name).unwrap_or(0)
}

/// Largest modulus in any table of a law, Pa.
fn stiffest_modulus(scenario: &Scenario) -> Option<f64> {
    let tables = scenario.materials.iter().flat_map(schema::Material::tables);
    tables.filter_map(|(_, table)| table.modulus()).reduce(f64::max)
}

fn damping(damping: &schema::Damping) -> Damping {
    let (translation, rotation) = damping.coefficients();
    match damping {
        schema::Damping::None => Damping::None,
        schema::Damping::Local { .. } => Damping::Local { translation, rotation },
        schema::Damping::Nonviscous { .. } => Damping::NonViscous { translation, rotation },
        schema::Damping::TchamwaWielgosz { phi, form } => match form {
            schema::DampingForm::TchamwaWielgosz => Damping::TchamwaWielgosz { phi: phi.si() },
            schema::DampingForm::PositionTerm => Damping::position_term(phi.si()),
        },
    }
}

/// How the particles deform, if any material does.
pub fn deformable(scenario: &Scenario) -> Option<Deformable> {
    scenario.materials.iter().find(|m| m.deformable.is_some())?;
    let options = scenario.deformable.clone().unwrap_or_default();
    let or = |value: Option<schema::Quantity<_>>, default: f64| value.map_or(default, schema::Quantity::si);
    Some(Deformable {
        elasticity: scenario.materials.iter().map(schema::Material::elasticity).collect(),
        condition: options.condition.unwrap_or(if scenario.dimension == 2 {
            Condition::PlaneStrain
        } else {
            Condition::Solid
        }),
        update: match options.update {
            schema::DeformableUpdate::Lagged => Update::Lagged,
            schema::DeformableUpdate::Iterated => Update::Iterated {
                tolerance: or(options.tolerance, 1e-10),
                maximum: options.maximum_iterations.unwrap_or(200),
                relaxation: or(options.relaxation, 1.0),
            },
        },
        dashpots: options.dashpots,
    })
}

/// Refuse deformable particles whose strains would not settle.
pub fn settles(deformable: &Deformable, convergence: &Convergence, allow: bool) -> Result<(), AssemblyError> {
    let radius = convergence.spectral_radius;
    let relaxation = match deformable.update {
        Update::Lagged => 1.0,
        Update::Iterated { relaxation, .. } => relaxation,
    };
    if allow || relaxation * (1.0 + radius) < 2.0 {
        return Ok(());
    }
    let softest = deformable.elasticity.iter().map(|e| e.young).fold(f64::INFINITY, f64::min);
    Err(AssemblyError::NotConvergent {
        spectral_radius: radius,
        lagged: deformable.update == Update::Lagged,
        relaxation: 2.0 / (1.0 + radius),
        young: softest * radius / (2.0 / relaxation - 1.0).max(f64::MIN_POSITIVE),
    })
}

/// Thresholds of the failure of whole particles, of the law of bonds.
fn hydrostatic_strength(scenario: &Scenario) -> HydrostaticStrength {
    let law = scenario.bonds.as_ref().map(|bonds| bonds.law);
    let threshold = |m: &schema::Material| {
        let table = law.and_then(|law| m.table_of(law));
        table.and_then(concordem_contact::law::LawTable::hydrostatic_strength).unwrap_or(f64::INFINITY)
    };
    let thresholds = scenario.materials.iter().map(threshold).collect();
    HydrostaticStrength { thresholds, planar: scenario.dimension == 2 }
}

fn memory(state: &State) -> usize {
    // Strains and dyads where particles deform: 192 bytes of state, 264 of scratch.
    let each = if state.particles.deformation.is_empty() { 272 } else { 272 + 456 };
    let particles = state.particles.len() * each;
    let contacts: usize = state
        .bonds
        .iter()
        .chain(&state.contacts)
        .chain(&state.wall_contacts)
        // Half a halo slot and its index per contact, about.
        .map(|block| block.len() * (block.bytes_per_contact() + 26))
        .sum();
    particles + contacts
}

/// Indices of the spheres in a selection.
fn select(selection: &Selection, spheres: &[Sphere], name: &str) -> Result<Vec<usize>, AssemblyError> {
    let chosen: Vec<usize> = match selection {
        Selection::All => (0..spheres.len()).collect(),
        Selection::Box { minimum, maximum } => {
            let (low, high) = (schema::quantity::vector(minimum), schema::quantity::vector(maximum));
            let inside = |x: &Vec3| (0..3).all(|i| low[i] <= x[i] && x[i] <= high[i]);
            (0..spheres.len()).filter(|&p| inside(&spheres[p].position)).collect()
        }
        Selection::Sphere { center, radius } => {
            let center = schema::quantity::vector(center);
            (0..spheres.len()).filter(|&p| (spheres[p].position - center).norm() <= radius.si()).collect()
        }
        Selection::Layer { axis, end, thickness } => {
            let axis = axis.index();
            layer(spheres.iter().map(|s| (s.position[axis], s.radius)), *end, thickness.si())
        }
        Selection::Ids { ids } => {
            if let Some(bad) = ids.iter().find(|&&id| id as usize >= spheres.len()) {
                let message = format!("`{name}` names particle {bad}, but there are only {}", spheres.len());
                return Err(unfit("set.selection.ids", message));
            }
            ids.iter().map(|&id| id as usize).collect()
        }
    };
    if chosen.is_empty() {
        return Err(unfit("set.selection", format!("no particle lies in set `{name}`; check its place and units")));
    }
    Ok(chosen)
}

/// Indices of the particles whose centre lies within `thickness` of one end of the bounding box of the spheres.
fn layer(extents: impl Iterator<Item = (f64, f64)> + Clone, end: schema::End, thickness: f64) -> Vec<usize> {
    let (low, high) = bounds_along(extents.clone());
    extents
        .enumerate()
        .filter(|(_, (x, _))| match end {
            schema::End::Minimum => x - low <= thickness,
            schema::End::Maximum => high - x <= thickness,
        })
        .map(|(p, _)| p)
        .collect()
}

/// Ends of the bounding box of spheres along an axis, m.
fn bounds_along(extents: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    extents.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (x, r)| (low.min(x - r), high.max(x + r)))
}

/// Initial velocities, prescribed motions, and forces.
///
/// # Errors
/// A motion prescribed to a member of a clump, which moves with its body.
fn motions(scenario: &Scenario, state: &mut State) -> Result<(), AssemblyError> {
    let members = |state: &State, name: &str| -> Vec<usize> {
        let bit = 1u64 << set_index(scenario, name);
        (0..state.particles.len()).filter(|&p| state.particles.tags[p] & bit != 0).collect()
    };
    for initial in &scenario.initials {
        for p in members(state, &initial.set) {
            state.particles.velocity[p] = schema::quantity::vector(&initial.velocity);
            state.particles.angular_velocity[p] = schema::quantity::vector(&initial.angular_velocity);
        }
    }
    for (number, prescribe) in scenario.prescribed.iter().enumerate() {
        let members = members(state, &prescribe.set);
        if let Some((id, clump)) = member_of_clump(&state.particles, &members) {
            let message = format!(
                "set `{}` has particle {id}, which is of clump[{clump}] and moves with it; take the clump's members out \
                 of the set, or remove the clump",
                prescribe.set
            );
            return Err(unfit(&format!("prescribe[{number}].set"), message));
        }
        for p in members {
            for i in 0..3 {
                if let Some(v) = prescribe.velocity[i].si() {
                    state.particles.velocity[p][i] = v;
                    state.particles.constraint[p].0 |= 1 << i;
                }
                if let Some(w) = prescribe.angular_velocity[i].si() {
                    state.particles.angular_velocity[p][i] = w;
                    state.particles.constraint[p].0 |= 8 << i;
                }
            }
        }
    }
    for force in &scenario.forces {
        for p in members(state, &force.set) {
            state.particles.add_load_at(
                p as u32,
                schema::quantity::vector(&force.force),
                schema::quantity::vector(&force.moment),
                force.acts,
            );
        }
    }
    Ok(())
}

/// The least id among those of `chosen` that are members of a clump, and its clump.
fn member_of_clump(particles: &Particles, chosen: &[usize]) -> Option<(u32, u32)> {
    let members = chosen.iter().filter(|&&p| particles.clump[p] != u32::MAX);
    members.map(|&p| (particles.id[p], particles.clump[p])).min()
}

/// Velocity (m/s) and angular velocity (rad/s) a clump starts with: its own, else that which [[initial]] gives its
/// members.
///
/// # Errors
/// Motions of the members that are not one translation of the body.
fn motion_of_clump(
    clump: &schema::Clump,
    number: usize,
    members: &[u32],
    particles: &Particles,
) -> Result<(Vec3, Vec3), AssemblyError> {
    let first = particles.velocity[members[0] as usize];
    let velocity = match &clump.velocity {
        Some(velocity) => schema::quantity::vector(velocity),
        None if members.iter().all(|&m| particles.velocity[m as usize] == first) => first,
        None => {
            let message = "[[initial]] gives its members different velocities, which no rigid body has; give the clump its \
                           own `velocity`, or let the set of [[initial]] have all of its members or none";
            return Err(unfit(&format!("clump[{number}]"), message.into()));
        }
    };
    let spin = match &clump.angular_velocity {
        Some(spin) => schema::quantity::vector(spin),
        None if members.iter().all(|&m| particles.angular_velocity[m as usize] == Vec3::zeros()) => Vec3::zeros(),
        None => {
            let message = "[[initial]] gives its members an angular velocity, each about its own centre, which no rigid \
                           body has; give the clump its own `angular_velocity`";
            return Err(unfit(&format!("clump[{number}]"), message.into()));
        }
    };
    Ok((velocity, spin))
}

/// Add a wall of the scenario.
fn add_wall(
    scenario: &Scenario,
    folder: &Path,
    number: usize,
    wall: &schema::Wall,
    state: &mut State,
) -> Result<(), AssemblyError> {
    let name = wall.name.clone().unwrap_or_else(|| format!("wall {number}"));
    let velocity = schema::quantity::vector(&wall.velocity);
    let material = material_index(scenario, &wall.material);
    let mut push = |name: String, shape: WallShape| {
        state.walls.push(Wall {
            name,
            shape,
            material,
            displacement: Vec3::zeros(),
            velocity,
            force: Vec3::zeros(),
            torque: Vec3::zeros(),
        });
    };
    match &wall.shape {
        schema::WallShape::Plane { point, normal } => {
            let normal = schema::quantity::vector(normal);
            push(name, WallShape::Plane { point: schema::quantity::vector(point), normal: normal / normal.norm() });
        }
        schema::WallShape::Box { minimum, maximum } => {
            let (low, high) = (schema::quantity::vector(minimum), schema::quantity::vector(maximum));
            for axis in 0..3 {
                let mut normal = Vec3::zeros();
                normal[axis] = 1.0;
                let label = ["x", "y", "z"][axis];
                push(format!("{name} {label} minimum"), WallShape::Plane { point: low, normal });
                push(format!("{name} {label} maximum"), WallShape::Plane { point: high, normal: -normal });
            }
        }
        schema::WallShape::Cylinder { center, axis, radius, side } => {
            let mut direction = Vec3::zeros();
            direction[axis.index()] = 1.0;
            let inside = *side == schema::Side::Inside;
            push(
                name,
                WallShape::Cylinder {
                    point: schema::quantity::vector(center),
                    axis: direction,
                    radius: radius.si(),
                    inside,
                },
            );
        }
        schema::WallShape::Facets { path, unit } => {
            let triangles = place::triangles(folder, path, unit.si())?;
            push(name, WallShape::Facets { triangles });
        }
    }
    Ok(())
}

/// Whether `block` holds bonds of the concrete particle model (for reports that speak of its parameters).
pub fn is_cpm(block: &dyn concordem_solver::state::contacts::Contacts) -> bool {
    block.as_any().is::<ContactBlock<Cpm>>()
}
