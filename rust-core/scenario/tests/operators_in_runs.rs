//! Operators on running simulations: particle stress equals boundary stress, and power is balanced.

use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::couple_stress::conjugate;
use concordem_operator::power::power;
use concordem_operator::strain::{Dimension, affine_fit};
use concordem_operator::stress::{Partition, boundary_stress, particle_moments, region_stress};
use concordem_operator::*;
use concordem_scenario::assembly::{Assembly, assemble};
use concordem_scenario::schema::Scenario;
use concordem_solver::Solver;
use concordem_solver::state::State;
use concordem_solver::state::contacts::ContactFlags;
use std::fmt::Write as _;
use std::path::Path;

/// Reproducible random numbers.
struct Random(u64);

impl Random {
    fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }
    /// Between 0 and 1 (SplitMix64).
    fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
    fn real(&mut self) -> f64 {
        2.0 * self.share() - 1.0
    }
    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.real(), self.real(), self.real())
    }
}

fn built(text: &str) -> Assembly {
    let scenario = Scenario::parse("test.toml", text).unwrap_or_else(|error| panic!("{error}"));
    assemble(&scenario, Path::new(""), &mut |_, _| ()).unwrap()
}

/// Spheres with initial velocities in a box: they fall, slide, and roll without damping.
fn spheres_in_a_box() -> Assembly {
    let mut r = Random::new(21);
    let mut spheres = String::new();
    let mut sets = String::new();
    for k in 0..125 {
        let at = Vec3::new(f64::from(k % 5), f64::from(k / 5 % 5), f64::from(k / 25)) * 2.0 + r.vector() * 0.05;
        let _ = write!(
            spheres,
            "[{}, {}, {}, {}],",
            at.x * 1e-3,
            at.y * 1e-3,
            at.z * 1e-3,
            (0.8 + 0.14 * r.share()) * 1e-3
        );
    }
    for k in 0..8 {
        let v = r.vector() * 2.0;
        let ids: Vec<String> = (0..125).filter(|p| p % 8 == k).map(|p| p.to_string()).collect();
        let _ = write!(
            sets,
            "[[set]]\nname = \"s{k}\"\nselection = {{ kind = \"ids\", ids = [{}] }}\n[[initial]]\nset = \"s{k}\"\n\
             velocity = [{}, {}, {}]\nangular_velocity = [{}, 0, 100]\n",
            ids.join(","),
            v.x,
            v.y,
            v.z,
            300.0 * v.x
        );
    }
    built(&format!(
        "version = 1\n[packing]\nkind = \"spheres\"\nspheres = [{spheres}]\n[[material]]\nname = \"m\"\ndensity = 2500\n\
         hertz_mindlin = {{ young = \"20 MPa\", poisson = 0.25, friction_coefficient = 0.4, restitution = 0.8 }}\n\
         [contacts]\nlaw = \"hertz_mindlin\"\n[integration]\ngravity = [0, 0, -9.81]\n\
         [[wall]]\nmaterial = \"m\"\nshape = {{ kind = \"box\", minimum = [\"-1.0 mm\", \"-1.0 mm\", \"-1.0 mm\"], \
         maximum = [\"9.0 mm\", \"9.0 mm\", \"9.0 mm\"] }}\n{sets}[stop]\nsteps = 10\n"
    ))
}

/// `Σ V_pσ_p = Σ x_w⊗f_w + Σ x_p⊗(b − m a)` at every sample of a run with impacts, friction, walls, and gravity. The
/// accelerations are computed from the velocities of the run. They are differences of velocities of 1 m/s, each known to
/// 1e-16, over steps of about 1e-7 s: an error of 1e-9 m/s², against 1e5 m/s² in impacts. Summed over particles, errors of
/// at least 1e-12 of the moments are expected; the tolerance is 1e-10.
#[test]
fn all_state_identity_on_a_running_simulation() {
    let Assembly { mut state, model, .. } = spheres_in_a_box();
    let gravity = model.gravity;
    let mut solver = Solver::new(model, &mut state).unwrap();
    let mut worst = 0.0_f64;
    let (mut contacts, mut at_walls) = (0, 0);
    for step in 0..3000 {
        if step % 50 != 0 {
            solver.step_with(&mut state, false).unwrap();
            continue;
        }
        let forces = solver.record(&mut state).unwrap();
        let before = state.particles.clone();
        solver.step_with(&mut state, false).unwrap();
        // The recorded forces are those of the step, up to the order of additions.
        let set = forces.contacts.set(&before).unwrap();
        let walls = forces.walls.set(&before).unwrap();
        let mut net: Vec<Vec3> = couple_stress::resultants(&set).iter().map(|w| w.force).collect();
        forces.walls.particle.iter().zip(&forces.walls.force).for_each(|(&p, f)| net[p as usize] += f);
        let size = net.iter().map(Vec3::norm).fold(1e-30, f64::max);
        for (found, net) in solver.forces().iter().zip(&net) {
            assert!((found - net).norm() < 1e-13 * size);
        }
        let left: Mat3 = particle_moments(&set, &walls, Partition::ContactPoint).iter().sum();
        let mut right = boundary_stress(&walls, 1.0).unwrap();
        let mut scale = right.abs().max() + left.abs().max();
        for p in 0..before.len() {
            let a = (state.particles.velocity[p] - before.velocity[p]) / state.clock.dt;
            let term = before.position[p] * ((gravity - a) * before.mass[p]).transpose();
            // Scale: the sum of the magnitudes of all terms.
            scale += before.position[p].norm() * before.mass[p] * (gravity.norm() + a.norm());
            right += term;
        }
        worst = worst.max((left - right).abs().max() / scale);
        contacts += set.len();
        at_walls += walls.len();
        // With internal contacts only, rigid force and moment are rounding errors in any state (A3 of the test case).
        if set.len() > 3 {
            let t = conjugate(&set, &Region::All { volume: 1.0 }, &Vec3::zeros(), None).unwrap();
            let all: f64 = forces.contacts.force.iter().map(Vec3::norm).sum();
            assert!(t.rigid_force.norm() < 1e-12 * all && t.rigid_moment.norm() < 1e-12 * all * 1e-2);
        }
    }
    println!("all-state identity: {worst:.1e} over 60 samples with {contacts} contacts, {at_walls} at walls");
    assert!(contacts > 1000 && at_walls > 200, "{contacts} {at_walls}");
    assert!(worst < 1e-10, "{worst:e}");
}

/// A concrete prism, pulled with damping until it softens.
const PRISM: &str = r#"
version = 1
[packing]
kind = "lattice"
lattice = "fcc"
radius = "1 mm"
shape = { kind = "box", size = ["9 mm", "9 mm", "16 mm"] }
[[material]]
name = "concrete"
density = 4800
LAW
[contacts]
law = "none"
[integration]
damping = { kind = "local", coefficient = 0.3 }
gravity = [0, 0, -9.81]
[loading]
kind = "uniaxial"
strain_rate = "20 1/s"
[stop]
steps = 10
"#;
const CPM: &str = r#"cpm = { young = "25 GPa", shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = 5, cohesion = "3 MPa", friction_coefficient = 0.8 }
[bonds]
law = "cpm"
interaction_ratio = 1.5"#;

const LOCAL: &str = "{ kind = \"local\", coefficient = 0.3 }";
const BEAM: &str = r#"[material.cohesive_beam]
young = "40 GPa"
poisson = 0.2
radius_ratio = 0.6
tensile_strength = "250 MPa"
bending_term = "mid-section"
[bonds]
law = "cohesive_beam"
interaction_ratio = 1.5"#;

/// The prism with randomly placed spheres: without symmetry, couple stresses do work, too.
fn random_prism(law: &str, damping: &str) -> Assembly {
    let mut r = Random::new(22);
    let mut spheres = String::new();
    for k in 0..5 * 5 * 9 {
        let at = Vec3::new(f64::from(k % 5), f64::from(k / 5 % 5), f64::from(k / 25)) * 1.9 + r.vector() * 0.15;
        let _ =
            write!(spheres, "[{}, {}, {}, {}],", at.x * 1e-3, at.y * 1e-3, at.z * 1e-3, (0.8 + 0.2 * r.share()) * 1e-3);
    }
    let from = PRISM.find("kind = \"lattice\"").unwrap();
    let to = PRISM.find("[[material]]").unwrap();
    let text = PRISM.replace(&PRISM[from..to], &format!("kind = \"spheres\"\nspheres = [{spheres}]\n"));
    built(&text.replace("LAW", law).replace(LOCAL, damping))
}

/// Boundary power = V(σ:γ̇ + μ:κ̇) + power gap + kinetic rate + numerical damping − body-force power. Each term is computed
/// from its own formula with the velocities `½(v⁻+v⁺)`, for which leapfrog satisfies the balance exactly. The tolerance of
/// 1e-9 of the boundary power allows for rounding in some thousand terms of 1e2 N times 1e-1 m/s.
fn power_is_balanced(name: &str, Assembly { mut state, model, .. }: Assembly) -> State {
    let mut solver = Solver::new(model, &mut state).unwrap();
    let volume = 9e-3 * 9e-3 * 16e-3;
    let mut worst = 0.0_f64;
    let mut largest = [0.0_f64; 6];
    for step in 0..4000 {
        if step % 200 != 199 {
            solver.step_with(&mut state, false).unwrap();
            continue;
        }
        let forces = solver.record(&mut state).unwrap();
        let before = state.particles.clone();
        let report = solver.step_with(&mut state, true).unwrap();
        let dt = state.clock.dt;
        let mean = |a: &[Vec3], b: &[Vec3]| -> Vec<Vec3> { a.iter().zip(b).map(|(a, b)| (a + b) * 0.5).collect() };
        let velocity = mean(&before.velocity, &state.particles.velocity);
        let spin = mean(&before.angular_velocity, &state.particles.angular_velocity);
        let set = forces.contacts.set(&before).unwrap();
        let whole = Region::All { volume };
        let fit = affine_fit(&before.position, &velocity, &spin, &whole, None, Dimension::Three).unwrap();
        let inner = power(&set, &velocity, &spin, &[], &fit, volume).unwrap();
        let kinetic: f64 = (0..before.len())
            .map(|p| {
                let dv = state.particles.velocity[p] - before.velocity[p];
                let dw = state.particles.angular_velocity[p] - before.angular_velocity[p];
                (before.mass[p] * dv.dot(&velocity[p]) + before.inertia[p] * dw.dot(&spin[p])) / dt
            })
            .sum();
        let boundary = (report.kick.boundary[0] + report.kick.boundary[1]) / dt;
        let damping = (report.kick.damping[0] + report.kick.damping[1]) / dt;
        let body = (report.kick.external[0] + report.kick.external[1]) / dt;
        let gap = boundary + body - inner.stress - inner.couple - inner.gap - kinetic - damping;
        let size = boundary.abs();
        worst = worst.max(gap.abs() / size);
        for (k, term) in [inner.stress, inner.couple, inner.gap, kinetic, damping, body].into_iter().enumerate() {
            largest[k] = largest[k].max(term.abs() / size);
        }
    }
    println!(
        "{name}: power balance {worst:.1e} of the boundary's; parts of stress, couple, gap, motion, damping, gravity: \
         {largest:?}"
    );
    // Every term is large enough that the balance would fail without it.
    assert!(largest.iter().all(|part| *part > 1e-6), "{largest:?}");
    assert!(worst < 1e-9, "{worst:e}");
    state
}

#[test]
fn power_is_balanced_on_a_loaded_concrete_specimen() {
    let state = power_is_balanced("concrete", random_prism(CPM, LOCAL));
    let damage: f64 = (0..state.bonds[0].len()).map(|k| state.bonds[0].damage(k)).fold(0.0, f64::max);
    assert!(damage > 0.1, "the specimen softens: {damage}");
}

/// Beams transmit moments, so the couple stress does work. The balance holds with local damping and with the damping
/// by the integrator of Jebahi et al. 2015.
#[test]
fn power_is_balanced_on_a_loaded_beam_specimen() {
    for damping in [LOCAL, "{ kind = \"tchamwa-wielgosz\", phi = 1.3 }"] {
        let state = power_is_balanced("beams", random_prism(BEAM, damping));
        // Broken beams are removed at the next neighbor-list rebuild.
        let links =
            (0..state.bonds[0].len()).filter(|&k| !state.bonds[0].view(k).flags.has(ContactFlags::BROKEN)).count();
        let all = random_prism(BEAM, damping).state.bonds[0].len();
        assert!(links < all && links > all / 4, "{links} of {all} beams are left; some should break, but not most");
    }
}

/// The stress of a pulled specimen, measured in two independent ways, agrees: end force divided by area, and branch sum in
/// the middle. In equilibrium both are equal; at this rate, waves cause a difference of a few percent.
#[test]
fn stress_of_a_loaded_specimen() {
    let slow = PRISM.replace("LAW", CPM).replace("20 1/s", "1 1/s").replace("gravity = [0, 0, -9.81]", "");
    let Assembly { mut state, model, schedule, .. } = built(&slow);
    let mut solver = Solver::new(model, &mut state).unwrap();
    for _ in 0..600 {
        solver.step_with(&mut state, false).unwrap();
    }
    let forces = solver.record(&mut state).unwrap();
    solver.step_with(&mut state, false).unwrap();
    let (area, _) = schedule.loading.dimensions().unwrap();
    let concordem_scenario::schedule::Loading::Uniaxial { layers, .. } = &schedule.loading else { panic!("uniaxial") };
    let force = |layer: &[u32]| layer.iter().map(|&p| solver.forces()[p as usize].z).sum::<f64>();
    let ends = 0.5 * (force(&layers[0]) - force(&layers[1])) / area;
    let set = forces.contacts.set(&state.particles).unwrap();
    // A slab across the whole specimen, so that the cross-section is the same.
    let half = 2e-3;
    let slab = Region::Box { low: Vec3::new(-1.0, -1.0, -half), high: Vec3::new(1.0, 1.0, half) };
    let mean = region_stress(&set, &slab, Truncation::BranchClipped, None).unwrap();
    let middle = mean.stress[(2, 2)] * mean.volume / (area * 2.0 * half);
    println!("stress of the specimen: ends {ends:.4e} Pa, branch sum in the middle {middle:.4e} Pa");
    assert!(ends > 1e5 && (middle / ends - 1.0).abs() < 0.05, "{ends} {middle}");
}
