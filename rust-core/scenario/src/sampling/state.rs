//! The state that operators read: particles, contact forces, damage of bonds, and motion since the start.

use std::sync::OnceLock;

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::math::{Mat3, Quat, Vec3, atan2};
use concordem_operator::strain::Dimension;
use concordem_operator::tessellation::{Mesh, delaunay};
use concordem_operator::{ContactSet, LoadSet, OperatorError, Period, couple_stress};
use concordem_solver::record::Forces;
use concordem_solver::state::{Cell, Constraint, Particles, State};

/// Bonds as the damage tensor reads them: one entry per bond in each list.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Bonds {
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
    /// The bonds of a state, broken ones included at the present position of their particle A.
    pub fn of(state: &State) -> Self {
        let mut bonds = Self::default();
        for block in &state.bonds {
            for k in 0..block.len() {
                let view = block.view(k);
                let a = &state.particles.position[view.pair.a as usize];
                bonds.push(a, &view.previous, [block.damage(k), block.lost_strength(k)]);
            }
        }
        for bond in &state.broken {
            bonds.push(&state.particles.position[bond.pair.a as usize], &bond.previous, [1.0, 1.0]);
        }
        bonds
    }

    /// Add a bond whose particle A is at `a` (m), with its damage and lost strength.
    pub fn push(&mut self, a: &Vec3, geometry: &PreviousGeometry, [damage, lost_strength]: [f64; 2]) {
        self.midpoint.push(a + geometry.normal * (0.5 * geometry.length));
        self.normal.push(geometry.normal);
        self.damage.push(damage);
        self.lost_strength.push(lost_strength);
    }
}

/// The state of a run at one moment, as operators read it.
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
    /// Position of every particle at the start, m; may be empty unless an operator needs them.
    pub initial_positions: &'a [Vec3],
    /// Delaunay mesh of the initial positions, built at its first use.
    pub mesh: &'a OnceLock<Result<Mesh, OperatorError>>,
    /// Gravity, m/s².
    pub gravity: Vec3,
    /// Whether particles are discs of unit depth.
    pub planar: bool,
}

/// The motion that a strain is fitted to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum MotionKind {
    /// Displacements and rotations since the start.
    Displacement,
    /// Velocities and angular velocities.
    Rate,
}

/// Positions (m) with displacements (m) and rotations (rad), or velocities (m/s) and angular velocities (rad/s), and the
/// same change of the periodic cell.
pub(super) struct Motion {
    pub(super) position: Vec<Vec3>,
    pub(super) displacement: Vec<Vec3>,
    pub(super) rotation: Vec<Vec3>,
    pub(super) period: Option<Period>,
}

impl SampledState<'_> {
    /// Dimension of space.
    pub(super) fn dimension(&self) -> Dimension {
        if self.planar { Dimension::Two } else { Dimension::Three }
    }

    /// Periodic images with their rate of change.
    pub(super) fn period(&self) -> Option<Period> {
        self.cell.map(|cell| Period { edges: cell.matrix, change: cell.velocity_gradient * cell.matrix })
    }

    /// Edges of the periodic cell at the start: `F⁻¹ h`.
    fn initial_edges(&self) -> Option<Mat3> {
        self.cell.map(|cell| cell.deformation_gradient.try_inverse().unwrap_or_else(Mat3::identity) * cell.matrix)
    }

    /// Delaunay mesh of the initial positions.
    pub(super) fn initial_mesh(&self) -> Result<&Mesh, OperatorError> {
        let build = || delaunay(self.initial_positions, self.dimension(), self.initial_edges().as_ref());
        self.mesh.get_or_init(build).as_ref().map_err(Clone::clone)
    }

    /// Motion since the start, or rate of motion.
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
        let displacements = particles.position.iter().zip(self.initial_positions).map(|(now, then)| now - then);
        Motion {
            position: self.initial_positions.to_vec(),
            displacement: displacements.collect(),
            rotation: particles.orientation.iter().map(rotation_vector).collect(),
            period: self
                .cell
                .zip(self.initial_edges())
                .map(|(cell, edges)| Period { edges, change: cell.matrix - edges }),
        }
    }

    /// Volume of every particle, m³.
    pub(super) fn volumes(&self) -> Vec<f64> {
        self.particles.radius.iter().map(|r| concordem_packing::mass_of(*r, 1.0, self.planar).0).collect()
    }

    /// Mean position of all particles, m.
    pub(super) fn mean_position(&self) -> Vec3 {
        self.particles.position.iter().sum::<Vec3>() / self.particles.len().max(1) as f64
    }

    /// External loads on the body: the forces of walls, and the reactions of prescribed degrees of freedom.
    ///
    /// A reaction is the opposite of what contacts, walls, and weight exert along its degree of freedom; this holds as
    /// long as the prescribed motion has no acceleration.
    pub(super) fn external_loads(&self, contacts: &ContactSet<'_>) -> Loads {
        let particles = self.particles;
        let walls = &self.forces.walls;
        let mut loads = Loads {
            particle: walls.particle.clone(),
            point: walls.point.clone(),
            force: walls.force.clone(),
            moment: walls.moment.clone(),
        };
        if particles.constraint.iter().all(|c| *c == Constraint::FREE) {
            return loads;
        }
        let mut net = couple_stress::resultants(contacts);
        for k in 0..walls.particle.len() {
            let p = walls.particle[k] as usize;
            net[p].force += walls.force[k];
            net[p].moment += (walls.point[k] - particles.position[p]).cross(&walls.force[k]) + walls.moment[k];
        }
        for (p, constraint) in particles.constraint.iter().enumerate() {
            if *constraint == Constraint::FREE {
                continue;
            }
            let reaction = |prescribed: &dyn Fn(usize) -> bool, load: Vec3| {
                Vec3::from_fn(|k, _| if prescribed(k) { -load[k] } else { 0.0 })
            };
            let load = net[p].force + self.gravity * particles.mass[p];
            loads.particle.push(p as u32);
            loads.point.push(particles.position[p]);
            loads.force.push(reaction(&|k| constraint.translation(k), load));
            loads.moment.push(reaction(&|k| constraint.rotation(k), net[p].moment));
        }
        loads
    }
}

/// Loads on particles, owned; see [`LoadSet`].
pub(super) struct Loads {
    particle: Vec<u32>,
    point: Vec<Vec3>,
    pub(super) force: Vec<Vec3>,
    moment: Vec<Vec3>,
}

impl Loads {
    /// The loads, borrowed for an operator, on a body of `particles` particles.
    pub(super) fn set(&self, particles: usize) -> Result<LoadSet<'_>, OperatorError> {
        LoadSet::new(particles, &self.particle, &self.point, &self.force, Some(&self.moment))
    }
}

/// Rotation vector (rad) of a unit quaternion, by the rotation of at most π.
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
