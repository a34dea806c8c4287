//! The state that operators read: particles, contact forces, damage of bonds, and motion since the start.

use std::sync::OnceLock;

use concordem_contact::math::{Mat3, Quat, Vec3, atan2};
use concordem_operator::strain::Dimension;
use concordem_operator::stress::{Partition, particle_moments};
use concordem_operator::tessellation::{Mesh, delaunay};
use concordem_operator::{ContactSet, LoadSet, OperatorError, Period, couple_stress};
use concordem_solver::heat::HeatFlows;
use concordem_solver::record::{ContactForces, Forces};
use concordem_solver::state::contacts::Pair;
use concordem_solver::state::particles::Load;
use concordem_solver::state::{Cell, Constraint, Particles, State};

/// Bonds, as needed for damage tensors: one entry per bond in each list.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Bonds {
    /// Particles A and B, by index.
    pub pair: Vec<[u32; 2]>,
    /// Midpoint, m.
    pub midpoint: Vec<Vec3>,
    /// Unit vector along the bond.
    pub normal: Vec<Vec3>,
    /// Damage, 0 to 1.
    pub damage: Vec<f64>,
    /// Fraction of the strength that is lost, 0 to 1.
    pub lost_strength: Vec<f64>,
}

impl Bonds {
    /// The bonds of a state at its present positions, with the damage recorded together with `forces`, so that stress
    /// and damage of one row belong to the same positions. Broken bonds keep the direction that they had when they
    /// broke, and lie half way between their particles.
    pub fn of(state: &State, forces: &Forces) -> Self {
        let mut bonds = Self::default();
        let mut damage = forces.contacts.damage.iter();
        let position = &state.particles.position;
        let ends = |pair: Pair, image: [i8; 3]| {
            let shift = state.cell.map_or_else(Vec3::zeros, |cell| cell.shift(image));
            [position[pair.a as usize], position[pair.b as usize] + shift]
        };
        for block in &state.bonds {
            for k in 0..block.len() {
                let view = block.view(k);
                let [a, b] = ends(view.pair, view.flags.image);
                let damage = damage.next().copied().unwrap_or_else(|| [block.damage(k), block.lost_strength(k)]);
                bonds.push([view.pair.a, view.pair.b], &a, &(b - a), &(b - a).normalize(), damage);
            }
        }
        for bond in state.broken_bonds() {
            let [a, b] = ends(bond.pair, bond.image);
            bonds.push([bond.pair.a, bond.pair.b], &a, &(b - a), &bond.previous.normal, [1.0, 1.0]);
        }
        bonds
    }

    /// Adds a bond between the particles `pair`: position of A (m), branch vector (m), direction, damage and lost strength.
    pub fn push(&mut self, pair: [u32; 2], a: &Vec3, branch: &Vec3, normal: &Vec3, [damage, lost_strength]: [f64; 2]) {
        self.pair.push(pair);
        self.midpoint.push(a + branch * 0.5);
        self.normal.push(*normal);
        self.damage.push(damage);
        self.lost_strength.push(lost_strength);
    }
}

/// Temperatures of the particles.
#[derive(Debug, Clone, Copy)]
pub struct SampledHeat<'a> {
    /// Temperature of each particle, K.
    pub temperature: &'a [f64],
    /// Heat capacity of each particle, J/K.
    pub capacity: &'a [f64],
    /// Heat that flows along links and through the surface; may be empty unless an operator needs it.
    pub flows: &'a HeatFlows,
}

/// The state of a run at one moment: the input of operators.
pub struct SampledState<'a> {
    /// Particles.
    pub particles: &'a Particles,
    /// Periodic cell.
    pub cell: Option<Cell>,
    /// Time, s.
    pub time: f64,
    /// Bonds; may be empty unless an operator needs them.
    pub bonds: &'a Bonds,
    /// Contact forces.
    pub forces: &'a Forces,
    /// Forces inside rigid bodies; see [`rigid_links`].
    pub links: &'a ContactForces,
    /// Initial positions, m; may be empty unless an operator needs them.
    pub initial_positions: &'a [Vec3],
    /// Edges of the periodic cell at the start, as columns, m.
    pub initial_edges: Option<Mat3>,
    /// Delaunay mesh of the initial positions, built at its first use.
    pub mesh: &'a OnceLock<Result<Mesh, OperatorError>>,
    /// Temperatures, if heat flows.
    pub heat: Option<SampledHeat<'a>>,
    /// Gravity, m/s².
    pub gravity: Vec3,
    /// Whether particles are discs of unit depth.
    pub planar: bool,
}

/// Motion from which a strain or its rate is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum MotionKind {
    /// Displacements and rotations since the start.
    Displacement,
    /// Velocities and angular velocities.
    Rate,
}

/// Positions (m) with displacements (m) and rotations (rad), or velocities (m/s) and angular velocities (rad/s), and the
/// corresponding change of the periodic cell.
pub(super) struct Motion {
    pub(super) position: Vec<Vec3>,
    pub(super) displacement: Vec<Vec3>,
    pub(super) rotation: Vec<Vec3>,
    pub(super) period: Option<Period>,
}

impl SampledState<'_> {
    /// Contacts and forces inside rigid bodies in one list; `None` without rigid bodies.
    pub(super) fn carrying(&self) -> Option<ContactForces> {
        if self.links.pair.is_empty() {
            return None;
        }
        let mut all = self.forces.contacts.clone();
        all.pair.extend(&self.links.pair);
        all.branch.extend(&self.links.branch);
        all.point.extend(&self.links.point);
        all.force.extend(&self.links.force);
        all.moment.extend(&self.links.moment);
        Some(all)
    }

    /// Contacts with walls: each is a contact of a particle with itself whose branch vector ends at the contact point. What walls exert is
    /// part of the stress up to their surface.
    pub(super) fn at_walls(&self) -> ContactForces {
        let walls = &self.forces.walls;
        let arm = |(&p, point): (&u32, &Vec3)| point - self.particles.position[p as usize];
        ContactForces {
            pair: walls.particle.iter().map(|&p| [p, p]).collect(),
            branch: walls.particle.iter().zip(&walls.point).map(arm).collect(),
            point: walls.point.clone(),
            force: walls.force.clone(),
            moment: walls.moment.clone(),
            ..ContactForces::default()
        }
    }

    /// Moments `R n⊗f` (J) of given loads that act on the surface of deformable particles, by particle; `None` if there are none.
    pub(super) fn surface_moments(&self) -> Option<Vec<Mat3>> {
        let particles = self.particles;
        let mut moments = vec![Mat3::zeros(); particles.len()];
        let mut found = false;
        for load in &particles.loads {
            let moment = surface_moment(particles, load);
            found |= moment != Mat3::zeros();
            moments[load.particle as usize] += moment;
        }
        found.then_some(moments)
    }

    /// Dimension of space.
    pub(super) fn dimension(&self) -> Dimension {
        if self.planar { Dimension::Two } else { Dimension::Three }
    }

    /// Periodic images with their rate of change.
    pub(super) fn period(&self) -> Option<Period> {
        self.cell.map(|cell| Period { edges: cell.matrix, change: cell.velocity_gradient * cell.matrix })
    }

    /// Delaunay mesh of the initial positions.
    pub(super) fn initial_mesh(&self) -> Result<&Mesh, OperatorError> {
        let build = || delaunay(self.initial_positions, self.dimension(), self.initial_edges.as_ref());
        self.mesh.get_or_init(build).as_ref().map_err(Clone::clone)
    }

    /// Displacements since the start, or velocities.
    pub(super) fn motion(&self, kind: MotionKind) -> Motion {
        let particles = self.particles;
        if kind == MotionKind::Rate {
            return Motion {
                position: particles.position.clone(),
                displacement: particles.velocity.clone(),
                rotation: particles.angular_velocity.clone(),
                period: self.period(),
            };
        }
        let cell = self.cell.as_ref();
        let displacements = particles
            .position
            .iter()
            .zip(self.initial_positions)
            .enumerate()
            .map(|(p, (now, then))| now - then + particles.unwrapping(p, cell));
        Motion {
            position: self.initial_positions.to_vec(),
            displacement: displacements.collect(),
            rotation: particles.orientation.iter().map(rotation_vector).collect(),
            period: self
                .cell
                .zip(self.initial_edges)
                .map(|(cell, edges)| Period { edges, change: cell.deformation_gradient * edges - edges }),
        }
    }

    /// The motion as the mesh of the initial positions takes it: of particles that were never moved back by whole cells, in a
    /// cell whose edges were never shortened.
    pub(super) fn motion_of_mesh(&self, kind: MotionKind) -> Motion {
        let mut motion = self.motion(kind);
        let (MotionKind::Rate, Some(cell)) = (kind, &self.cell) else { return motion };
        for p in 0..self.particles.len() {
            let way = self.particles.unwrapping(p, Some(cell));
            motion.position[p] += way;
            motion.displacement[p] += cell.velocity_gradient * way;
        }
        motion.period = self.initial_edges.map(|edges| {
            let edges = cell.deformation_gradient * edges;
            Period { edges, change: cell.velocity_gradient * edges }
        });
        motion
    }

    /// Moments `V_p σ_p` (J) of all particles, including the forces of walls, given loads, and rigid bodies.
    pub(super) fn particle_moments(&self, partition: Partition) -> Result<Vec<Mat3>, OperatorError> {
        let particles = self.particles;
        let joined = self.carrying();
        let contacts = joined.as_ref().unwrap_or(&self.forces.contacts).set(particles)?;
        let mut moments = particle_moments(&contacts, &self.forces.walls.set(particles)?, partition);
        for load in &particles.loads {
            moments[load.particle as usize] += surface_moment(particles, load);
        }
        Ok(moments)
    }

    /// Volume of every particle, m³.
    pub(super) fn volumes(&self) -> Vec<f64> {
        self.particles.radius.iter().map(|r| concordem_packing::mass_of(*r, 1.0, self.planar).0).collect()
    }

    /// Mean position of all particles, m.
    pub(super) fn mean_position(&self) -> Vec3 {
        self.particles.position.iter().sum::<Vec3>() / self.particles.len().max(1) as f64
    }

    /// Center of mass of all particles, m. Weight, and the inertia of a uniform acceleration, have no moment about it.
    pub(super) fn center_of_mass(&self) -> Vec3 {
        let Particles { position, mass, .. } = self.particles;
        let total: f64 = mass.iter().sum();
        position.iter().zip(mass).map(|(x, m)| x * *m).sum::<Vec3>() / total.max(f64::MIN_POSITIVE)
    }

    /// External loads on the body: the forces of walls, given forces and moments, and the reactions of prescribed degrees of
    /// freedom ([`Self::reactions`]).
    pub(super) fn external_loads(&self, contacts: &ContactSet<'_>) -> Loads {
        let particles = self.particles;
        let walls = &self.forces.walls;
        let mut loads = Loads {
            particle: walls.particle.clone(),
            point: walls.point.clone(),
            force: walls.force.clone(),
            moment: walls.moment.clone(),
            surface: Mat3::zeros(),
        };
        for load in &particles.loads {
            let p = load.particle as usize;
            loads.particle.push(load.particle);
            loads.point.push(particles.position[p]);
            loads.force.push(load.force);
            loads.moment.push(load.moment);
            loads.surface += surface_moment(particles, load);
        }
        for reaction in self.reactions(contacts) {
            loads.particle.push(reaction.particle);
            loads.point.push(particles.position[reaction.particle as usize]);
            loads.force.push(reaction.force);
            loads.moment.push(reaction.moment);
        }
        loads
    }

    /// Reactions of prescribed degrees of freedom: the opposite of what contacts, walls, given loads, and weight exert along
    /// them. This holds as long as the prescribed motion has no acceleration.
    pub(super) fn reactions(&self, contacts: &ContactSet<'_>) -> Vec<Reaction> {
        let particles = self.particles;
        let walls = &self.forces.walls;
        // Discs stay in the plane without supports.
        let given = if self.planar { Constraint(!Constraint::OUT_OF_PLANE.0) } else { Constraint::ALL };
        let prescribed = |constraint: &Constraint| Constraint(constraint.0 & given.0);
        if particles.constraint.iter().all(|constraint| prescribed(constraint) == Constraint::FREE) {
            return Vec::new();
        }
        let mut net = couple_stress::resultants(contacts);
        for k in 0..walls.particle.len() {
            let p = walls.particle[k] as usize;
            net[p].force += walls.force[k];
            net[p].moment += (walls.point[k] - particles.position[p]).cross(&walls.force[k]) + walls.moment[k];
        }
        for load in &particles.loads {
            net[load.particle as usize].force += load.force;
            net[load.particle as usize].moment += load.moment;
        }
        let mut reactions = Vec::new();
        for (p, constraint) in particles.constraint.iter().enumerate() {
            let constraint = prescribed(constraint);
            if constraint == Constraint::FREE {
                continue;
            }
            let reaction = |prescribed: &dyn Fn(usize) -> bool, load: Vec3| {
                Vec3::from_fn(|k, _| if prescribed(k) { -load[k] } else { 0.0 })
            };
            let load = net[p].force + self.gravity * particles.mass[p];
            reactions.push(Reaction {
                particle: p as u32,
                force: reaction(&|k| constraint.translation(k), load),
                moment: reaction(&|k| constraint.rotation(k), net[p].moment),
            });
        }
        reactions
    }

    /// Position of a particle without jumps at periodic borders, m.
    pub(super) fn unwrapped(&self, p: u32) -> Vec3 {
        let p = p as usize;
        self.particles.position[p] + self.particles.unwrapping(p, self.cell.as_ref())
    }

    /// Mean of a quantity over the particles `members`.
    pub(super) fn mean_over(members: &[u32], value: impl Fn(u32) -> Vec3) -> Vec3 {
        members.iter().map(|&p| value(p)).sum::<Vec3>() / members.len().max(1) as f64
    }

    /// Mean displacement of the particles `members` since the start, m.
    pub(super) fn mean_displacement(&self, members: &[u32]) -> Vec3 {
        Self::mean_over(members, |p| self.unwrapped(p) - self.initial_positions[p as usize])
    }
}

/// Force (N) and moment (N·m) about its center with which a prescribed motion acts on a particle.
pub(super) struct Reaction {
    /// Index of the particle.
    pub(super) particle: u32,
    pub(super) force: Vec3,
    pub(super) moment: Vec3,
}

/// `R n⊗f` (N·m) of a load that acts on the surface of its particle; zero for loads on the body.
fn surface_moment(particles: &Particles, load: &Load) -> Mat3 {
    load.virial.matrix() * particles.radius[load.particle as usize]
}

/// Largest relative difference of two distances that is rounding.
const SAME_DISTANCE: f64 = 1e-9;

/// Forces inside rigid bodies, as contacts between their members; stress operators need them in addition to the contacts.
///
/// Contacts, walls, and given loads exert a net force `F` and moment `M` on a member, which passes them on to the body. They
/// are in equilibrium with the inertia of the body; the part of a member of mass `m` in a body of mass `Σm` is `F_body m/Σm`
/// (including weight). So a straight link from the member nearest to the center of mass transmits `F − F_body m/Σm` and `M`
/// to each other member. The mean stress of the body does not depend on the choice of the central member, because these
/// forces sum to zero. The paths of the forces inside the body are a choice that matters only for regions that cut the body.
/// Rotational inertia is neglected.
pub fn rigid_links(
    particles: &Particles,
    forces: &Forces,
    bodies: &[Vec<u32>],
) -> Result<ContactForces, OperatorError> {
    let mut links = ContactForces::default();
    if bodies.is_empty() {
        return Ok(links);
    }
    let mut net = couple_stress::resultants(&forces.contacts.set(particles)?);
    let walls = &forces.walls;
    for k in 0..walls.particle.len() {
        let p = walls.particle[k] as usize;
        net[p].force += walls.force[k];
        net[p].moment += (walls.point[k] - particles.position[p]).cross(&walls.force[k]) + walls.moment[k];
    }
    for load in &particles.loads {
        net[load.particle as usize].force += load.force;
        net[load.particle as usize].moment += load.moment;
    }
    for members in bodies {
        let of = |p: u32| p as usize;
        let mass: f64 = members.iter().map(|&m| particles.mass[of(m)]).sum();
        let total: Vec3 = members.iter().map(|&m| net[of(m)].force).sum();
        let weighted: Vec3 = members.iter().map(|&m| particles.position[of(m)] * particles.mass[of(m)]).sum();
        let center = weighted / mass;
        let distance = |m: u32| (particles.position[of(m)] - center).norm();
        // Of members equally near that with the lowest number, so that rounding does not choose.
        let nearer = |a: u32, b: u32| {
            let (of_a, of_b) = (distance(a), distance(b));
            let tie = (of_a - of_b).abs() <= SAME_DISTANCE * of_a.max(of_b);
            let first = if tie { particles.id[of(a)] < particles.id[of(b)] } else { of_a < of_b };
            if first { a } else { b }
        };
        let Some(hub) = members.iter().copied().reduce(nearer) else { continue };
        for &member in members.iter().filter(|&&member| member != hub) {
            let (start, end) = (particles.position[of(hub)], particles.position[of(member)]);
            let branch = end - start;
            let force = net[of(member)].force - total * (particles.mass[of(member)] / mass);
            links.pair.push([hub, member]);
            links.branch.push(branch);
            links.point.push(start + branch * 0.5);
            links.force.push(force);
            // About the midpoint of the link, so that the moments on the member cancel.
            links.moment.push(net[of(member)].moment + (branch * 0.5).cross(&force));
            links.place.push(0);
        }
    }
    Ok(links)
}

/// Loads on particles, owned; see [`LoadSet`].
pub(super) struct Loads {
    particle: Vec<u32>,
    point: Vec<Vec3>,
    pub(super) force: Vec<Vec3>,
    moment: Vec<Vec3>,
    /// `Σ R n⊗f` (N·m) of given forces that act on the surface of deformable particles, at `R n` from the center.
    pub(super) surface: Mat3,
}

impl Loads {
    /// The loads, borrowed for an operator, on a body of `particles` particles.
    pub(super) fn set(&self, particles: usize) -> Result<LoadSet<'_>, OperatorError> {
        LoadSet::new(particles, &self.particle, &self.point, &self.force, Some(&self.moment))
    }
}

/// Rotation vector (rad) of a unit quaternion; the angle is at most π.
///
/// ```
/// use concordem_contact::math::{Quat, Vec3};
/// use concordem_scenario::sampling::rotation_vector;
///
/// let quarter_turn = Quat::new(0.5_f64.sqrt(), 0.0, 0.0, 0.5_f64.sqrt());
/// let expected = Vec3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2);
/// assert!((rotation_vector(&quarter_turn) - expected).norm() < 1e-15);
/// ```
pub fn rotation_vector(q: &Quat) -> Vec3 {
    let (im, w) = if q.w < 0.0 { (-q.imag(), -q.w) } else { (q.imag(), q.w) };
    let s = im.norm();
    // 2 atan2(s, w)/s tends to 2/w for small s, without loss of digits.
    if s == 0.0 { Vec3::zeros() } else { im * (2.0 * atan2(s, w) / s) }
}
