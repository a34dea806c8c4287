//! Balance of momentum, and of the stresses of all particles against the loads on the body.
//!
//! In a step every particle gets the impulse `F Δt` of its net force. Contacts give equal and opposite forces with a common
//! point, so that only gravity, given loads, and walls change the sums. They do so exactly, whatever the step.

use concordem::math::{Mat3, Vec3, rotate};
use concordem::operator::Region;
use concordem::sampling::{Operator, SampledRegion, ScheduledOperator};
use concordem::schedule::Simulation;
use concordem::solver::Scheme;
use concordem::state::State;

use crate::case::{Case, Loading};

/// Sums of momentum, and what changes them.
pub struct Balance {
    /// Axes along which the momentum, and about which the angular momentum is free.
    linear: [bool; 3],
    angular: [bool; 3],
    periodic: bool,
    at_start: [Vec3; 2],
    impulse: [Vec3; 2],
    /// Scales: sum of all magnitudes.
    scale: [f64; 2],
    /// Error of linear and angular momentum at the end, over the scale.
    pub error: [f64; 2],
    /// Largest error of the stress of all particles against the loads, over the scale, and what it was compared with.
    pub stress: f64,
    /// Largest sum of the magnitudes of all net forces, N.
    pub largest_force: f64,
    particles: Option<(Mat3, f64)>,
    boundary: Option<(Mat3, f64)>,
    region: Option<(Mat3, f64)>,
    /// Largest radius, m.
    reach: f64,
    sampled: u64,
    /// Whether stresses were compared.
    stresses: bool,
}

/// What a step changes, before it.
pub struct Before {
    walls: Vec<Vec3>,
    positions: Vec<Vec3>,
    bodies: Vec<Vec3>,
    step: u64,
}

impl Balance {
    pub fn new(case: &Case, state: &State) -> Self {
        let particles = &state.particles;
        // Artificial damping acts on every particle by itself. YADE's cell accelerates particles.
        let damped = !case.damping.contains("none");
        let yade = case.kinematics.starts_with("yade") && case.cell.is_some();
        // Particles follow every change of the cell's velocity gradient.
        let driven = match &case.loading {
            Loading::CellStress(..) => true,
            Loading::CellStrain(_) => !case.stages.is_empty(),
            _ => false,
        };
        let free = |axis: usize, rotation: bool| {
            !(damped || yade || driven)
                && (0..particles.len()).filter(|&p| particles.clump[p] == u32::MAX).all(|p| {
                    let c = particles.constraint[p];
                    !(if rotation { c.rotation(axis) } else { c.translation(axis) })
                })
        };
        let linear = [0, 1, 2].map(|axis| free(axis, false));
        let angular = [0, 1, 2].map(|axis: usize| {
            // Joints transmit no torques.
            case.joint.is_none()
                && case.cell.is_none()
                && linear[(axis + 1) % 3]
                && linear[(axis + 2) % 3]
                && free(axis, true)
        });
        let mut balance = Self {
            linear,
            angular,
            periodic: case.cell.is_some(),
            at_start: [Vec3::zeros(); 2],
            impulse: [Vec3::zeros(); 2],
            scale: [0.0; 2],
            error: [0.0; 2],
            stress: 0.0,
            largest_force: 0.0,
            particles: None,
            boundary: None,
            region: None,
            reach: particles.radius.iter().copied().fold(0.0, f64::max),
            sampled: u64::MAX,
            stresses: false,
        };
        let (sums, scale) = momentum(state);
        (balance.at_start, balance.scale) = (sums, scale);
        balance
    }

    pub fn before(state: &State) -> Before {
        Before {
            walls: state.walls.iter().map(|wall| wall.displacement).collect(),
            positions: state.particles.position.clone(),
            bodies: state.clumps.iter().map(|clump| clump.position).collect(),
            step: state.clock.step,
        }
    }

    /// Add the impulses of a step.
    pub fn step(&mut self, before: &Before, simulation: &Simulation) {
        let (state, model) = (&simulation.state, simulation.solver.model());
        let half = model.scheme == Scheme::VelocityVerlet && before.step == 0;
        let dt = state.clock.dt * if half { 0.5 } else { 1.0 };
        let particles = &state.particles;
        let (mut force, mut torque) = (Vec3::zeros(), Vec3::zeros());
        let mut scale = [0.0; 2];
        let mut add = |x: &Vec3, f: &Vec3, m: &Vec3, sum: bool| {
            if sum {
                force += f;
                torque += x.cross(f) + m;
            }
            scale[0] += f.norm() * dt;
            scale[1] += (x.norm() * f.norm() + m.norm()) * dt;
        };
        for p in 0..particles.len() {
            let (load, moment) = particles.load(p as u32);
            let weight = if particles.clump[p] == u32::MAX { model.gravity * particles.mass[p] } else { Vec3::zeros() };
            add(&before.positions[p], &(load + weight), &moment, true);
            add(&before.positions[p], &simulation.solver.forces()[p], &simulation.solver.torques()[p], false);
        }
        for (clump, x) in state.clumps.iter().zip(&before.bodies) {
            add(x, &(model.gravity * clump.mass), &Vec3::zeros(), true);
        }
        for (wall, x) in state.walls.iter().zip(&before.walls) {
            add(x, &-wall.force, &-wall.torque, true);
        }
        self.impulse[0] += force * dt;
        self.impulse[1] += torque * dt;
        self.scale[0] += scale[0];
        self.largest_force = self.largest_force.max(scale[0] / dt);
        self.scale[1] += scale[1];
    }

    pub fn end(&mut self, state: &State) {
        let (sums, scale) = momentum(state);
        for (k, free) in [self.linear, self.angular].into_iter().enumerate() {
            let error = sums[k] - self.at_start[k] - self.impulse[k];
            let worst = (0..3).filter(|&axis| free[axis]).map(|axis| error[axis].abs()).fold(0.0, f64::max);
            self.error[k] = worst / (self.scale[k] + scale[k]).max(f64::MIN_POSITIVE);
        }
    }

    /// Whether linear momentum, angular momentum, and stresses were compared.
    pub fn compared(&self) -> [bool; 3] {
        [self.linear.contains(&true), self.angular.contains(&true), self.stresses]
    }

    /// Compare `Σ V_p σ_p` with the loads: `Σ V_p σ_p = V σ_boundary − Σ (x_p − x̄)⊗F_p` with the net forces `F_p`, which include weight, and
    /// the center of mass `x̄`, in any motion.
    pub fn check_stress(&mut self, simulation: &Simulation, operator: &ScheduledOperator, values: &[f64]) {
        if !matches!(operator.operator, Operator::ParticleStress | Operator::BoundaryStress | Operator::RegionStress) {
            return;
        }
        let SampledRegion::Moving { region: Region::All { volume }, .. } = &operator.region else { return };
        let step = simulation.state.clock.step;
        if self.sampled != step {
            (self.sampled, self.particles, self.boundary, self.region) = (step, None, None, None);
        }
        let found = (Mat3::from_row_slice(&values[..9]) * *volume, *volume);
        match operator.operator {
            Operator::ParticleStress => self.particles = Some(found),
            Operator::BoundaryStress => self.boundary = Some(found),
            _ => self.region = Some(found),
        }
        // Branch vectors end at contact points in the one, at centers in the other.
        if let (Some((of_particles, _)), Some((of_branches, _))) = (self.particles, self.region) {
            self.stresses = true;
            let (scale, error) = (of_particles.norm() + self.reach * self.largest_force, of_particles - of_branches);
            self.stress = self.stress.max(error.abs().max() / scale.max(f64::MIN_POSITIVE));
        }
        let (Some((of_particles, _)), Some((of_loads, _)), false) = (self.particles, self.boundary, self.periodic)
        else {
            return;
        };
        self.stresses = true;
        let (inertia, scale) = inertia(simulation);
        let error = (of_particles - of_loads + inertia).abs().max();
        self.stress = self.stress.max(error / (scale + of_particles.norm() + of_loads.norm()).max(f64::MIN_POSITIVE));
    }
}

/// `Σ (x − x̄)⊗F` with the net forces of the last step at its positions, and the sum of the magnitudes.
fn inertia(simulation: &Simulation) -> (Mat3, f64) {
    let state = &simulation.state;
    let particles = &state.particles;
    let dt = state.clock.dt;
    let (mut sum, mut scale) = (Mat3::zeros(), 0.0);
    let (mut total, mut weighted, mut mass) = (Vec3::zeros(), Vec3::zeros(), 0.0);
    let mut add = |p: usize, x: Vec3, f: Vec3| {
        sum += x * f.transpose();
        scale += x.norm() * f.norm();
        total += f;
        weighted += x * particles.mass[p];
        mass += particles.mass[p];
    };
    let net = |p: usize| simulation.solver.forces()[p] + particles.load(p as u32).0;
    let before = |p: usize| particles.position[p] - particles.velocity[p] * dt;
    for p in 0..particles.len() {
        if particles.clump[p] != u32::MAX {
            continue;
        }
        // Supports carry what is prescribed; their reaction is a load.
        let gravity = simulation.solver.model().gravity * particles.mass[p];
        let given = particles.constraint[p];
        let planar = simulation.schedule.planar;
        let f = Vec3::from_fn(|axis, _| {
            let held = given.translation(axis) && !(planar && axis == 2);
            if held { -gravity[axis] } else { net(p)[axis] }
        });
        add(p, before(p), f);
    }
    for clump in &state.clumps {
        let total: Vec3 = clump.members.iter().map(|&m| net(m as usize)).sum();
        // The members' positions one step ago are not kept: turn them back.
        let mass: f64 = clump.members.iter().map(|&m| particles.mass[m as usize]).sum();
        for &m in &clump.members {
            let m = m as usize;
            let back = particles.rotation_increment[m].conjugate();
            let arm = rotate(&back, &(particles.position[m] - clump.position));
            add(m, clump.position - clump.velocity * dt + arm, total * (particles.mass[m] / mass));
        }
    }
    (sum - weighted / mass * total.transpose(), scale)
}

/// Linear and angular momentum about the origin, and the sums of their magnitudes.
fn momentum(state: &State) -> ([Vec3; 2], [f64; 2]) {
    let particles = &state.particles;
    let (mut sums, mut scale) = ([Vec3::zeros(); 2], [0.0; 2]);
    let mut add = |x: &Vec3, p: Vec3, spin: Vec3| {
        sums[0] += p;
        sums[1] += x.cross(&p) + spin;
        scale[0] += p.norm();
        scale[1] += x.norm() * p.norm() + spin.norm();
    };
    for p in (0..particles.len()).filter(|&p| particles.clump[p] == u32::MAX) {
        let spin = particles.angular_velocity[p] * particles.inertia[p];
        add(&particles.position[p], particles.velocity[p] * particles.mass[p], spin);
    }
    for clump in &state.clumps {
        add(&clump.position, clump.velocity * clump.mass, clump.angular_momentum);
    }
    (sums, scale)
}
