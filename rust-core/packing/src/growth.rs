//! Packings between rigid walls by growing spheres (the generator of the test case of ERDC TR-14-6 Report 3,
//! §5.2; Lubachevsky and Stillinger 1990 grow spheres without elasticity).
//!
//! Small spheres without contact start at random positions in a cube with six rigid walls. All radii grow by the same
//! factor while the spheres move under Hertz-Mindlin contacts with friction, until they reach the given pressure on the
//! walls. Then growth only maintains the pressure until the packing is at rest. Because of friction the packings are
//! looser than those of [`mod@super::random_dense`], and they are layered along the walls.

use std::f64::consts::PI;

use super::cloud::random_cloud;
use super::{PackingError, Random, SizeDistribution, positive, within};
use concordem_contact::law::{Elastic, HertzMindlin, Reference};
use concordem_contact::math::{Vec3, cbrt};
use concordem_solver::integrate::Damping;
use concordem_solver::neighbor::spatial_order;
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::surface::Plane;
use concordem_solver::state::{Particles, State, Wall, WallShape};
use concordem_solver::{Model, PairCoefficients, Solver, StepReport, time_step};

/// Parameters of a grown packing.
#[derive(Debug, Clone, PartialEq)]
pub struct GrownBox {
    /// Radii; only their ratios matter, because growth ends at the given pressure.
    pub sizes: SizeDistribution,
    /// Number of spheres.
    pub count: usize,
    /// Edge of the cube between the walls, m; one corner is the origin.
    pub edge: f64,
    /// Seed of radii and initial positions.
    pub seed: u64,
    /// Density of the spheres, kg/m³.
    pub density: f64,
    /// Elasticity of the spheres.
    pub elastic: Elastic,
    /// Friction between spheres.
    pub friction: f64,
    /// Friction at the rigid walls.
    pub wall_friction: f64,
    /// Mean pressure on the six walls, Pa.
    pub pressure: f64,
    /// Unbalanced force at which the packing is at rest.
    pub unbalanced: f64,
    /// Largest number of steps until it is at rest.
    pub step_limit: u64,
}

/// A grown packing with its contacts, their history, and the walls, ready for loading.
pub struct Grown {
    /// The state; walls are x low, x high, y low, y high, z low, z high.
    pub state: State,
    /// The model; local damping.
    pub model: Model,
    /// Mean pressure on the walls, Pa.
    pub pressure: f64,
    /// Final radii over the initial ones.
    pub growth: f64,
    /// Steps done.
    pub steps: u64,
}

/// Solid fraction at which growth begins; random positions without contact are easy to find there.
const START: f64 = 0.15;
/// Growth per step before the spheres press on each other: a sphere as large as its spacing is pushed by less than a
/// thousandth of its radius while it settles (some ten steps).
const FREE_GROWTH: f64 = 4e-5;
/// Growth per step under pressure: Hertzian contacts at a pressure of 1e-4 of the modulus overlap by some thousandths.
const PRESSED_GROWTH: f64 = 4e-6;
/// Fraction of the pressure from which the slower growth applies.
const PRESSED: f64 = 1e-3;
/// Tolerance of the pressure, relative.
const PRESSURE_TOLERANCE: f64 = 0.02;
/// Steps between rebuilds of the neighbor list, in which radii grow by at most 2e-3. A contact detected late begins
/// with an overlap of that size, which only matters while all spheres move.
const REBUILD_INTERVAL: u64 = 50;
/// Local damping.
const DAMPING: f64 = 0.3;

/// Grow a packing; `progress` gets the step, the solid fraction, the pressure (Pa), and the unbalanced force.
///
/// # Errors
/// Parameters out of range; no rest within the step limit.
pub fn grown_box(recipe: &GrownBox, progress: &mut dyn FnMut(u64, f64, f64, f64)) -> Result<Grown, PackingError> {
    positive("edge of the box", recipe.edge)?;
    positive("density", recipe.density)?;
    positive("pressure", recipe.pressure)?;
    positive("unbalanced force", recipe.unbalanced)?;
    within("number of spheres", recipe.count as f64, 1.0, 1e8)?;
    let mut state = small_spheres(recipe)?;
    let wanted: f64 = recipe.sizes.radii(recipe.count, recipe.seed)?.iter().sum();
    let damping = Damping::Local { translation: DAMPING, rotation: DAMPING };
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let model = Model { damping, contact_rows: rows.clone(), wall_rows: rows, ..Model::default() };
    let area = recipe.edge * recipe.edge;
    let mut pressure = 0.0;
    let mut solver = Solver::new(model.clone(), &mut state)?;
    loop {
        let step = state.clock.step;
        let error = 1.0 - pressure / recipe.pressure;
        // Within the tolerance the radii stay constant, otherwise the spheres would never be at rest.
        let growth = if pressure < PRESSED * recipe.pressure {
            FREE_GROWTH
        } else if error.abs() < 0.5 * PRESSURE_TOLERANCE {
            0.0
        } else {
            PRESSED_GROWTH * error.clamp(-1.0, 1.0)
        };
        if growth != 0.0 {
            grow(&mut state, 1.0 + growth);
        }
        if step.is_multiple_of(REBUILD_INTERVAL) {
            state.clock.dt = stable_step(&state, recipe);
            solver = Solver::new(model.clone(), &mut state)?;
        }
        let look = step.is_multiple_of(100);
        let report = solver.step_with(&mut state, look)?;
        // Averaged over some ten steps, so that single impacts do not control the growth.
        let now = wall_pressure(&state, area);
        pressure += 0.1 * (now - pressure);
        if look {
            let unbalanced = unbalanced(&report);
            progress(step, solid(&state) / (recipe.edge * area), pressure, unbalanced);
            let reached = (now / recipe.pressure - 1.0).abs() < PRESSURE_TOLERANCE;
            if reached && unbalanced < recipe.unbalanced {
                let growth = state.particles.radius.iter().sum::<f64>() / wanted;
                return Ok(Grown { state, model, pressure: now, growth, steps: step });
            }
            if step >= recipe.step_limit {
                return Err(PackingError::NotSettled {
                    steps: step,
                    stage: "growth",
                    pressure: now / recipe.elastic.young,
                    goal: recipe.pressure / recipe.elastic.young,
                    unbalanced,
                });
            }
        }
    }
}

/// Spheres at random positions in the box, without contact, and the walls.
fn small_spheres(recipe: &GrownBox) -> Result<State, PackingError> {
    let mut radii = recipe.sizes.radii(recipe.count, recipe.seed)?;
    let solid: f64 = radii.iter().map(|r| 4.0 / 3.0 * PI * (r * r * r)).sum();
    let scale = cbrt(START * recipe.edge.powi(3) / solid);
    for r in &mut radii {
        *r *= scale;
    }
    let largest = radii.iter().copied().fold(0.0, f64::max);
    // Centers at least one largest radius from the walls.
    let inner = recipe.edge - 2.0 * largest;
    positive("space between the walls left for the largest sphere", inner)?;
    let mut random = Random::new(recipe.seed ^ 0x9e37_79b9_7f4a_7c15);
    let mut spheres = random_cloud(radii, inner, &mut random, &mut |_| {})?;
    for sphere in &mut spheres {
        sphere.position += Vec3::repeat(largest);
    }
    let positions: Vec<Vec3> = spheres.iter().map(|sphere| sphere.position).collect();
    let mut particles = Particles::default();
    for k in spatial_order(&positions, None) {
        let sphere = spheres[k as usize];
        let mass = recipe.density * 4.0 / 3.0 * PI * sphere.radius.powi(3);
        particles.push(sphere, 0, mass, 0.4 * mass * sphere.radius * sphere.radius);
    }
    let law = HertzMindlin::new(recipe.elastic, recipe.elastic, recipe.friction, 0.5)?;
    let wall_law = HertzMindlin::new(recipe.elastic, Elastic::RIGID, recipe.wall_friction, 0.5)?;
    let walls = (0..6)
        .map(|k| {
            let (axis, high) = (k / 2, k % 2 == 1);
            let normal = Vec3::ith(axis, if high { -1.0 } else { 1.0 });
            let point = if high { Vec3::ith(axis, recipe.edge) } else { Vec3::zeros() };
            Wall::new(
                format!("{} {}", ["x", "y", "z"][axis], if high { "high" } else { "low" }),
                WallShape::rigid(Plane { point, normal }),
                0,
                Vec3::zeros(),
            )
        })
        .collect();
    Ok(State {
        particles,
        contacts: Some(Box::new(ContactBlock::new(vec![law]))),
        wall_contacts: Some(Box::new(ContactBlock::new(vec![wall_law]))),
        walls,
        ..State::default()
    })
}

/// Multiply all radii by a factor, and scale masses and reference lengths of contacts accordingly.
fn grow(state: &mut State, factor: f64) {
    let cube = factor * factor * factor;
    let particles = &mut state.particles;
    for p in 0..particles.len() {
        particles.radius[p] *= factor;
        particles.mass[p] *= cube;
        particles.inertia[p] *= cube * factor * factor;
    }
    for block in state.contacts.iter_mut().chain(&mut state.wall_contacts) {
        if let Some(block) = block.contacts_mut().as_any_mut().downcast_mut::<ContactBlock<HertzMindlin>>() {
            for k in 0..block.len() {
                let Reference { length, area } = block.reference.get(k);
                block.reference.set(k, Reference { length: length * factor, area: area * (factor * factor) });
            }
        }
    }
}

/// A stable time step, s: that of the present contacts, and at most that of two smallest spheres at the largest overlap
/// of the law.
fn stable_step(state: &State, recipe: &GrownBox) -> f64 {
    let smallest = state.particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
    let bounds = time_step::bounds(state);
    let waves = 0.3 * smallest * (recipe.density / recipe.elastic.young).sqrt() * PI;
    0.5 * bounds.spectral.max(bounds.per_particle).min(waves)
}

fn wall_pressure(state: &State, area: f64) -> f64 {
    let push = |k: usize| {
        let outward = if k % 2 == 1 { 1.0 } else { -1.0 };
        outward * state.walls[k].force[k / 2]
    };
    (0..6).map(push).sum::<f64>() / (6.0 * area)
}

fn solid(state: &State) -> f64 {
    state.particles.radius.iter().map(|r| 4.0 / 3.0 * PI * (r * r * r)).sum()
}

/// Root mean square net force over root mean square contact force; 1 without contacts.
fn unbalanced(report: &StepReport) -> f64 {
    let contacts: u64 = report.active.iter().sum();
    if contacts == 0 || report.force_squared == 0.0 {
        return 1.0;
    }
    let net = report.kick.net_force_squared / report.kick.free_particles.max(1) as f64;
    (net / (report.force_squared / contacts as f64)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use concordem_solver::state::contacts::ContactFlags;

    /// Grown spheres rest under the requested pressure, equal on all walls, and are dense. A wall touches some 15
    /// spheres, whose forces scatter by as much as their mean: 26 % of scatter, three times that allowed. Random loose
    /// packing has a solid fraction of 0.55; six walls with a void of up to 0.2 diameters each, in a box of 4.5
    /// diameters, leave three quarters of it; random close packing has 0.64.
    #[test]
    fn grown_spheres_press_on_all_walls() {
        let recipe = GrownBox {
            sizes: SizeDistribution::Uniform { low: 0.8e-3, high: 1.2e-3 },
            count: 80,
            edge: 9e-3,
            seed: 3,
            density: 2650.0,
            elastic: Elastic { young: 1e9, poisson: 0.25 },
            friction: 0.5,
            wall_friction: 0.5,
            pressure: 1e5,
            unbalanced: 2e-2,
            step_limit: 400_000,
        };
        let grown = grown_box(&recipe, &mut |_, _, _, _| ()).unwrap();
        let fraction = solid(&grown.state) / recipe.edge.powi(3);
        println!(
            "{} steps, solid fraction {fraction:.3}, pressure {:.4e} Pa, growth {:.3}",
            grown.steps, grown.pressure, grown.growth
        );
        assert!((grown.pressure / 1e5 - 1.0).abs() < PRESSURE_TOLERANCE);
        assert!((0.41..0.64).contains(&fraction), "{fraction}");
        for k in 0..6 {
            let normal = grown.state.walls[k].force[k / 2].abs() / (recipe.edge * recipe.edge);
            assert!((normal / 1e5 - 1.0).abs() < 0.78, "wall {k}: {normal}");
        }
        // Spheres of the given density that touch at the sum of their radii, whatever they were before they grew. The factors of
        // up to 400,000 steps round by 1e-16 each.
        let particles = &grown.state.particles;
        for p in 0..particles.len() {
            let (r, mass) = (particles.radius[p], particles.mass[p]);
            approx::assert_relative_eq!(mass, 2650.0 * 4.0 / 3.0 * PI * r * r * r, max_relative = 1e-9);
            approx::assert_relative_eq!(particles.inertia[p], 0.4 * mass * r * r, max_relative = 1e-9);
        }
        let block = grown.state.contacts.as_ref().unwrap().contacts();
        let touching = (0..block.len()).map(|k| block.view(k)).filter(|view| view.flags.has(ContactFlags::ACTIVE));
        let mut count = 0;
        for view in touching {
            let sum = particles.radius[view.pair.a as usize] + particles.radius[view.pair.b as usize];
            approx::assert_relative_eq!(view.reference.length, sum, max_relative = 1e-9);
            count += 1;
        }
        assert!(count > 80, "{count} contacts");
        let refused = GrownBox { pressure: 0.0, ..recipe };
        assert!(matches!(grown_box(&refused, &mut |_, _, _, _| ()), Err(PackingError::NotPositive { .. })));
    }
}
