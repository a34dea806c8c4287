//! Heat through contacts that form later, and through cracks that close.

use concordem_contact::law::frictional::ContactStiffness;
use concordem_contact::law::{Frictional, LinearBond};
use concordem_contact::math::{Mat3, Vec3};
use concordem_packing::Random;
use concordem_solver::heat::implicit::to_steady_state;
use concordem_solver::heat::pass::HeatPass;
use concordem_solver::heat::{ContactConduction, ContactExchange, HeatModel, Held, ThermalMaterial, network};
use concordem_solver::state::columns::{ColumnStore, WriteColumns};
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::{Cell, Particles, Sphere, State};
use concordem_solver::{Model, PairCoefficients, Solver, SolverError};

use super::{PLAIN, cubes, model, stable_step, temperatures};

/// A second material.
const OTHER: ThermalMaterial = ThermalMaterial { specific_heat: 1.5, conductivity: 5.0, expansion: 0.0 };

const RESISTANCE: ContactConduction =
    ContactConduction { exchange: ContactExchange::Resistance(0.3), planar: false, watched: true };
const CONSTRICTION: ContactConduction = ContactConduction { exchange: ContactExchange::Constriction, ..RESISTANCE };

/// Spheres at the given places, each with its radius and material.
fn spheres(list: &[([f64; 3], f64, u16)]) -> Particles {
    let mut particles = Particles::default();
    for (position, radius, material) in list {
        let mass = 4.0 * radius * radius * radius;
        particles.push(Sphere { position: Vec3::from(*position), radius: *radius }, *material, mass, 0.1 * mass);
    }
    particles
}

/// A model of grains that touch with the stiffness 1000 N/m and without friction, and its state.
fn grains(
    particles: Particles,
    contact: ContactConduction,
    temperature: Vec<f64>,
    cell: Option<&Cell>,
) -> (State, Model) {
    let stiffness = ContactStiffness::Given { normal: 1000.0, shear: 500.0 };
    let law = Frictional::new(stiffness, 0.0, 0.0).unwrap();
    let mut rows = PairCoefficients::new(2);
    for (a, b) in [(0, 0), (0, 1), (1, 1)] {
        rows.set(a, b, 0);
    }
    let network = network::grains(&particles, &[], contact.planar);
    let mut heat = model(network, &particles, &[PLAIN, OTHER]);
    heat.contact = Some(contact);
    heat.mechanics = true;
    let mut state = State { heat: Some(heat.start(temperature)), particles, cell: cell.copied(), ..State::default() };
    state.contacts = Some(Box::new(ContactBlock::new(vec![law])));
    state.clock.dt = 1e-3;
    (state, Model { heat: Some(heat), contact_rows: rows, ..Model::default() })
}

fn heat_of(model: &Model) -> &HeatModel {
    model.heat.as_ref().unwrap()
}

/// Two spheres (λ = 2 and 5, c = 3 and 1.5, R = 0.5 and 0.7) approach each other at constant speed. Apart, their temperatures stay. In
/// contact, the difference decays by `1 − GΔt(1/C_A + 1/C_B)` per explicit step and by `1/(1 + …)` per implicit one, with the conductance of
/// the overlap at the start of the step: `4R_AR_B/(R_A/λ_A + r + R_B/λ_B)` or `4a/(1/λ_A + 1/λ_B)`, `a² = δR_AR_B/(R_A+R_B)`. The heat
/// that one gains the other loses.
#[test]
fn two_bodies_brought_into_contact_equalize() {
    let [radius_a, radius_b] = [0.5, 0.7];
    for contact in [RESISTANCE, CONSTRICTION, ContactConduction { planar: true, ..RESISTANCE }] {
        for implicit in [false, true] {
            let mut particles = spheres(&[([0.0; 3], radius_a, 0), ([1.25, 0.0, 0.0], radius_b, 1)]);
            // So heavy that contact forces do not change the motion.
            for p in 0..2 {
                particles.mass[p] = 1e30;
            }
            particles.velocity[1] = Vec3::new(-0.5, 0.0, 0.0);
            let (mut state, mut model) = grains(particles, contact, vec![300.0, 400.0], None);
            let heat = model.heat.as_mut().unwrap();
            heat.implicit = implicit;
            heat.capacity = vec![2.0, 3.0];
            *state.heat.as_mut().unwrap() = heat.start(vec![300.0, 400.0]);
            let mut solver = Solver::new(model.clone(), &mut state).unwrap();
            let (mut difference, mut touched) = (100.0, 0);
            for _ in 0..400 {
                let overlap = radius_a + radius_b - (state.particles.position[1] - state.particles.position[0]).norm();
                let conductance = match contact.exchange {
                    _ if overlap <= 0.0 => 0.0,
                    ContactExchange::Resistance(r) => {
                        let area =
                            if contact.planar { 2.0 * (radius_a * radius_b).sqrt() } else { 4.0 * radius_a * radius_b };
                        area / (radius_a / 2.0 + r + radius_b / 5.0)
                    }
                    ContactExchange::Constriction => {
                        4.0 * (overlap * radius_a * radius_b / 1.2).sqrt() / (1.0 / 2.0 + 1.0 / 5.0)
                    }
                };
                touched += u32::from(overlap > 0.0);
                let ratio = conductance * 1e-3 * (1.0 / 2.0 + 1.0 / 3.0);
                difference *= if implicit { 1.0 / (1.0 + ratio) } else { 1.0 - ratio };
                solver.step(&mut state).unwrap();
                let [a, b] = [temperatures(&state)[0], temperatures(&state)[1]];
                // Implicit steps are solved to 1e-12.
                assert!((b - a - difference).abs() < 1e-9, "{} {difference}", b - a);
            }
            assert!((100..350).contains(&touched) && difference < 90.0, "{touched} {difference}");
            let found = state.heat.as_ref().unwrap();
            assert!(heat_of(&model).residual(found).abs() < 1e-12 * 1800.0);
        }
    }
}

/// A stack of six spheres between two held temperatures, in the steady state: contacts lie in series, so the temperatures step by
/// `Q/G` with `Q = ΔT/(Σ 1/G)`, whether the steady state is solved or reached by implicit steps. The flux of each contact is Q.
#[test]
fn resistances_of_a_stack_add_up() {
    for contact in [RESISTANCE, CONSTRICTION] {
        let mut particles = cubes([1, 1, 6]);
        let gaps = [1e-3, 2e-3, 4e-3, 8e-3, 16e-3];
        for (p, gap) in gaps.iter().enumerate() {
            particles.position[p + 1].z = particles.position[p].z + 1.0 - gap;
        }
        let (mut state, mut model) = grains(particles, contact, vec![300.0; 6], None);
        let heat = model.heat.as_mut().unwrap();
        (heat.implicit, heat.mechanics) = (true, false);
        heat.supply.held =
            vec![Held { particles: vec![0], temperature: 400.0 }, Held { particles: vec![5], temperature: 300.0 }];
        state.clock.dt = 1e4;
        let resistance = |gap: &f64| match contact.exchange {
            ContactExchange::Resistance(r) => 0.5 / 2.0 + r + 0.5 / 2.0,
            ContactExchange::Constriction => 1.0 / (4.0 * (gap * 0.25).sqrt()),
        };
        let all: f64 = gaps.iter().map(resistance).sum();
        let mut solver = Solver::new(model.clone(), &mut state).unwrap();
        let mut steady = state.heat.clone().unwrap();
        let mut pass = HeatPass::new(heat_of(&model), &state);
        to_steady_state(heat_of(&model), &state.particles, &mut pass, &mut steady).unwrap();
        for _ in 0..10 {
            solver.step(&mut state).unwrap();
        }
        let mut expected = 400.0;
        for (p, gap) in gaps.iter().enumerate() {
            expected -= 100.0 * resistance(gap) / all;
            // The iterations end at 1e-12 of the flows, some 10 W; the update multiplies them by Δt/C = 3e3 K/J.
            for found in [steady.temperature[p + 1], temperatures(&state)[p + 1]] {
                assert!((found - expected).abs() < 1e-7, "{p} {found} {expected}");
            }
        }
        let flows = solver.heat_flows(&mut state).unwrap();
        assert_eq!(flows.flow.len(), 5);
        for (flow, (branch, gap)) in flows.flow.iter().zip(flows.branch.iter().zip(gaps)) {
            assert!((flow * all / 100.0 - 1.0).abs() < 1e-8, "{flow}");
            assert!((branch.z - (1.0 - gap)).abs() < 1e-15);
        }
    }
}

/// A ring of spheres through a periodic cell: a wave decays by `1 − (GΔt/C)(2 − 2 cos 2π/N)` per step, also across the border.
#[test]
fn a_ring_through_the_border_conducts() {
    let mut particles = cubes([8, 1, 1]);
    let cell = Cell::new(Mat3::from_diagonal(&Vec3::new(8.0 * 0.999, 3.0, 3.0)));
    for position in &mut particles.position {
        position.x *= 0.999;
    }
    let wave = |p: usize| (std::f64::consts::TAU * p as f64 / 8.0).cos();
    let start: Vec<f64> = (0..8).map(|p| 300.0 + 10.0 * wave(p)).collect();
    let (mut state, mut model) = grains(particles, RESISTANCE, start, Some(&cell));
    let heat = model.heat.as_mut().unwrap();
    heat.mechanics = false;
    let capacity = heat.capacity[0];
    state.clock.dt = 0.05;
    let mut solver = Solver::new(model, &mut state).unwrap();
    for _ in 0..100 {
        solver.step(&mut state).unwrap();
    }
    let factor = 1.0 - 0.05 / capacity / (0.25 + 0.3 + 0.25) * (2.0 - 2.0 * std::f64::consts::FRAC_PI_4.cos());
    assert!(factor.powi(100) < 0.8);
    for p in 0..8 {
        let expected = 300.0 + 10.0 * wave(p) * factor.powi(100);
        // Roundings of 300 K.
        assert!((temperatures(&state)[p] - expected).abs() < 1e-10, "{p} {} {expected}", temperatures(&state)[p]);
    }
}

/// The bond of two spheres breaks, they part, and they come together again. The conductance of their link, of the area 2, is 4 while the
/// bond holds, nothing or that of `crack_resistance` while the crack is open, and `1/(1/4 + r/2)` while it is closed. Afterwards the same with
/// constriction: that of the overlap, at most that of the link.
#[test]
fn a_crack_that_closes_conducts() {
    for (contact, open) in [(RESISTANCE, f64::INFINITY), (RESISTANCE, 4.0), (CONSTRICTION, f64::INFINITY)] {
        let mut rows = PairCoefficients::new(2);
        rows.set(0, 0, 0);
        let particles = cubes([2, 1, 1]);
        let bond = LinearBond::new(1000.0, 50.0, 0.0, 1.0, f64::INFINITY).unwrap();
        let mut bonds = ContactBlock::new(vec![bond]);
        concordem_packing::bonding::bond(&mut bonds, &rows, &particles, None, 1.01).unwrap();
        let (mut state, mut model) = grains(particles, contact, vec![300.0; 2], None);
        state.bonds.push(Box::new(bonds));
        let heat = model.heat.as_mut().unwrap();
        let pairs = network::touching(&state.particles, None, 1.0).unwrap();
        heat.network = network::grains(&state.particles, &pairs, false);
        heat.network.links[0].area = 2.0;
        heat.crack_resistance = open;
        for p in 0..2 {
            state.particles.mass[p] = 1e30;
        }
        let mut solver = Solver::new(model.clone(), &mut state).unwrap();
        let expected = |length: f64, broken: bool| {
            if !broken {
                return 4.0;
            }
            match contact.exchange {
                _ if length >= 1.0 => 1.0 / (0.25 + open / 2.0),
                ContactExchange::Resistance(r) => 1.0 / (0.25 + r / 2.0),
                ContactExchange::Constriction => (4.0 * ((1.0 - length) * 0.25).sqrt()).min(4.0),
            }
        };
        let mut seen = [0; 3];
        for step in 0..600 {
            state.particles.velocity[1].x = if step < 100 { 0.1 } else { -0.1 };
            let broken = !state.broken.is_empty();
            let length = state.particles.position[1].x - state.particles.position[0].x;
            solver.step(&mut state).unwrap();
            // The bond of this step may have broken since.
            if broken != state.broken.is_empty() {
                let found: f64 = solver.heat().unwrap().links(0).map(|(_, conductance)| conductance).sum();
                assert!((found - expected(length, broken)).abs() < 1e-13, "{step} {length} {found}");
                seen[if !broken {
                    0
                } else if length < 1.0 {
                    2
                } else {
                    1
                }] += 1;
            }
        }
        assert!(seen.iter().all(|count| *count > 10), "{seen:?}");
    }
}

/// Particles that a link joins exchange heat once while they touch: the contact adds nothing to the link.
#[test]
fn linked_particles_exchange_heat_once() {
    let mut particles = cubes([2, 1, 1]);
    particles.position[1].x = 0.99;
    let pairs = network::touching(&particles, None, 1.0).unwrap();
    let (mut state, mut model) = grains(particles, RESISTANCE, vec![300.0, 400.0], None);
    let heat = model.heat.as_mut().unwrap();
    heat.network = network::grains(&state.particles, &pairs, false);
    let mut solver = Solver::new(model, &mut state).unwrap();
    for _ in 0..3 {
        solver.step(&mut state).unwrap();
    }
    let found: Vec<f64> = solver.heat().unwrap().links(0).map(|(_, conductance)| conductance).collect();
    // A λ/l.
    assert!(found.len() == 1 && (found[0] - 2.0 / 0.99).abs() < 1e-14, "{found:?}");
}

/// Grains that fly about and collide in a periodic cell with the given edge (m).
fn flowing(count: usize, edge: f64, contact: ContactConduction) -> (State, Model) {
    let mut random = Random::new(3);
    let mut list: Vec<([f64; 3], f64, u16)> = Vec::new();
    while list.len() < count {
        let radius = 0.5 + 0.5 * random.uniform();
        let place = [(); 3].map(|()| edge * random.uniform());
        let apart = |(other, r, _): &([f64; 3], f64, u16)| {
            let nearest = |d: f64| d - edge * (d / edge).round();
            let squared: f64 = (0..3).map(|k| nearest(other[k] - place[k]).powi(2)).sum();
            squared > (0.9 * (radius + r)).powi(2)
        };
        if list.iter().all(apart) {
            list.push((place, radius, (list.len() % 2) as u16));
        }
    }
    let mut particles = spheres(&list);
    for velocity in &mut particles.velocity {
        *velocity = Vec3::from_fn(|_, _| 4.0 * (random.uniform() - 0.5));
    }
    let temperature: Vec<f64> = (0..count).map(|_| 300.0 + 100.0 * random.uniform()).collect();
    grains(particles, contact, temperature, Some(&Cell::new(Mat3::from_diagonal_element(edge))))
}

/// Flowing grains conserve heat to rounding over 1e4 steps, the span of their temperatures shrinks, and at the explicit bound no temperature leaves the
/// range of the start; implicit steps conserve it as well.
#[test]
fn flowing_grains_conserve_heat() {
    for (contact, implicit) in [(RESISTANCE, false), (CONSTRICTION, false), (RESISTANCE, true)] {
        let (mut state, mut model) = flowing(40, 6.0, contact);
        let steps = if implicit { 1000 } else { 10_000 };
        model.heat.as_mut().unwrap().implicit = implicit;
        let mut solver = Solver::new(model.clone(), &mut state).unwrap();
        // Thermal time so fast that steps of the motion are at the explicit bound.
        let bound = stable_step(&solver, &state);
        let mut faster = model.clone();
        faster.heat.as_mut().unwrap().time_factor = bound / state.clock.dt;
        solver = Solver::new(faster, &mut state).unwrap();
        let range = |state: &State| {
            temperatures(state).iter().fold([f64::INFINITY, 0.0], |[low, high], t| [t.min(low), t.max(high)])
        };
        let mut before = range(&state);
        let mut exchanged = 0;
        for step in 0..steps {
            solver.step(&mut state).unwrap();
            let now = range(&state);
            // Roundings of the stored temperature.
            assert!(now[0] >= before[0] - 1e-12 && now[1] <= before[1] + 1e-12, "{step} {before:?} {now:?}");
            exchanged += usize::from(now != before);
            before = now;
        }
        assert!(exchanged > 10 && before[1] - before[0] < 80.0, "{exchanged} {before:?}");
        let found = state.heat.as_ref().unwrap();
        let content: f64 = heat_of(&model).capacity.iter().sum::<f64>() * 350.0;
        assert!(
            heat_of(&model).residual(found).abs() < 1e-14 * content,
            "{:e}",
            heat_of(&model).residual(found) / content
        );
    }
}

/// The same bits for one, two, and four threads, and after a restart in any step, also for the flows that are sampled in each step:
/// several tiles of grains that flow through a periodic cell.
#[test]
fn flowing_grains_have_the_same_bits() {
    let bits = |threads: usize, restart: Option<u64>| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (mut state, model) = flowing(2400, 24.0, CONSTRICTION);
            let mut solver = Solver::new(model.clone(), &mut state).unwrap();
            let mut sums = Vec::new();
            for step in 0..40 {
                if restart.is_some_and(|every| step % every == 1) {
                    let mut columns = ColumnStore::default();
                    state.write(&mut columns).unwrap();
                    let mut other = flowing(2400, 24.0, CONSTRICTION).0;
                    other.read(&mut columns).unwrap();
                    state = other;
                    solver = Solver::new(model.clone(), &mut state).unwrap();
                }
                let flows = solver.heat_flows(&mut state).unwrap();
                sums.push((flows.flow.len(), flows.flow.iter().sum::<f64>().to_bits()));
                solver.step(&mut state).unwrap();
            }
            (temperatures(&state).to_vec(), state.particles.position.clone(), sums)
        })
    };
    let whole = bits(1, None);
    assert!(whole.2.iter().any(|(count, _)| *count > 10));
    for (threads, restart) in [(2, None), (4, None), (1, Some(7)), (2, Some(1))] {
        assert!(whole == bits(threads, restart), "{threads} {restart:?}");
    }
}

/// The bound of a sphere holds for the twelve equal spheres that fit around it and for any mixture of sizes that does, and is at most four
/// times too small; it is that of the initial network without contacts.
#[test]
fn the_bound_holds_for_all_contacts_that_fit() {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut list = vec![([0.0; 3], 0.5, 0)];
    for (y, z) in [(1.0, golden), (1.0, -golden), (-1.0, golden), (-1.0, -golden)] {
        for place in [[0.0, y, z], [y, z, 0.0], [z, 0.0, y]] {
            let scale = 0.999 / (1.0 + golden * golden).sqrt();
            list.push((place.map(|x| x * scale), 0.5, 0));
        }
    }
    for contact in
        [RESISTANCE, ContactConduction { exchange: ContactExchange::Resistance(0.0), ..RESISTANCE }, CONSTRICTION]
    {
        let particles = spheres(&list);
        let (mut state, model) = grains(particles, contact, vec![300.0; 13], None);
        let solver = Solver::new(model.clone(), &mut state).unwrap();
        let heat = heat_of(&model);
        let sum: f64 = HeatPass::new(heat, &state).links(0).map(|(_, conductance)| conductance).sum();
        assert_eq!(HeatPass::new(heat, &state).links(0).count(), 12);
        let found = stable_step(&solver, &state);
        assert!(found <= heat.capacity[0] / sum, "{found} {}", heat.capacity[0] / sum);
        if contact.exchange != ContactExchange::Constriction {
            // Caps of 60° cover at most 14.93 of 15 places; twelve fit.
            assert!(found > heat.capacity[0] / sum / 1.25, "{found} {}", heat.capacity[0] / sum);
        }
        let still = HeatModel { contact: None, ..heat.clone() };
        let still = HeatPass::new(&still, &state).stable_step(&still, &state.particles, state.heat.as_ref().unwrap());
        assert_eq!(still, f64::INFINITY);
    }
}

/// An explicit step beyond the bound of a particle's present contacts fails with the bound, unless the model lets it run; an implicit one
/// never fails.
#[test]
fn too_large_a_step_fails_when_particles_touch() {
    let step = |contact: ContactConduction, implicit: bool, dt: f64| {
        let mut particles = cubes([2, 1, 1]);
        particles.position[1].x = 0.99;
        let (mut state, mut model) = grains(particles, contact, vec![300.0, 400.0], None);
        let heat = model.heat.as_mut().unwrap();
        (heat.mechanics, heat.implicit) = (false, implicit);
        state.clock.dt = dt;
        let bound = heat.capacity[0] / (1.0 / 0.8);
        (Solver::new(model, &mut state).unwrap().step(&mut state).map(|_| ()), bound)
    };
    let (fine, bound) = step(RESISTANCE, false, 1e-3);
    assert_eq!(fine, Ok(()));
    assert_eq!(step(RESISTANCE, false, 0.999 * bound).0, Ok(()));
    match step(RESISTANCE, false, 1.001 * bound).0 {
        Err(SolverError::HeatOutgrown { id: 0, contacts: 1, bound: found, .. }) => {
            assert!((found / bound - 1.0).abs() < 1e-14, "{found} {bound}");
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(step(ContactConduction { watched: false, ..RESISTANCE }, false, 1.001 * bound).0, Ok(()));
    assert_eq!(step(RESISTANCE, true, 100.0 * bound).0, Ok(()));
}
