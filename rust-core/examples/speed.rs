//! How long a step takes: CPM bonds on a jittered lattice, ns per bond and step.
use concordem::kinematics::Mode;
use concordem::law::{Cpm, CpmParameters};
use concordem::math::Vec3;
use concordem::neighbor::spatial_order;
use concordem::solver::{MaterialRows, Model, Solver};
use concordem::state::contacts::ContactBlock;
use concordem::state::{Particles, Sphere, State};

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let n: usize = args.get(1).map_or(26, |a| a.parse().unwrap());
    let steps: usize = args.get(2).map_or(200, |a| a.parse().unwrap());
    let mode = match args.get(3).map(String::as_str) {
        Some("yade") => Mode::YadeRatcheting,
        Some("first") => Mode::FirstOrder,
        _ => Mode::Finite,
    };
    let mut particles = Particles::default();
    let r = 1e-3;
    let m = 4800.0 * 4.0 / 3.0 * std::f64::consts::PI * r * r * r;
    for k in 0..n * n * n {
        let u = |s: usize| ((k * 7919 + s * 104_729) % 1000) as f64 / 1000.0 - 0.5;
        let x =
            Vec3::new((k % n) as f64 + 0.3 * u(1), (k / n % n) as f64 + 0.3 * u(2), (k / (n * n)) as f64 + 0.3 * u(3));
        particles.push(Sphere { position: x * (2.0 * r), radius: r }, 0, m, 0.4 * m * r * r);
    }
    let order = spatial_order(&particles.position, None);
    let mut particles = particles.permuted(&order);
    for p in 0..particles.len() {
        let x = particles.position[p];
        particles.velocity[p] = Vec3::new(0.0, 0.0, 0.4 * (x.z - 0.025));
    }
    let law = Cpm::new(&CpmParameters::new(25e9, 0.2, 3e6, 0.8f64.atan(), 1e-4, 30.0)).unwrap();
    let mut rows = MaterialRows::new(1);
    rows.set(0, 0, 0);
    let mut bonds = ContactBlock::new(vec![law]);
    let count = concordem::assembly::bonding::bond(&mut bonds, &rows, &particles, None, 1.5).unwrap();
    let mut state = State { particles, bonds: vec![Box::new(bonds)], ..State::default() };
    if args.get(4).is_some() {
        state.contacts = Some(Box::new(ContactBlock::new(vec![law])));
    }
    state.clock.dt = 2.4787e-7;
    let model = Model { mode, contact_rows: rows, ..Model::default() };
    let mut solver = Solver::new(model, &mut state).unwrap();
    for _ in 0..20 {
        solver.step(&mut state).unwrap();
    }
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let start = std::time::Instant::now();
        for _ in 0..steps / 5 {
            solver.step_with(&mut state, false).unwrap();
        }
        best = best.min(start.elapsed().as_secs_f64() / (steps / 5) as f64);
    }
    println!(
        "{} particles, {count} bonds, {:.3} ms per step, {:.1} ns per bond-step, residual {:.2e} of {:.2e}",
        state.particles.len(),
        best * 1e3,
        best / count as f64 * 1e9,
        state.ledger.residual(),
        state.ledger.initial
    );
}
