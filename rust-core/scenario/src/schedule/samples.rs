//! Operators that are evaluated during a run.

use std::sync::OnceLock;

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::math::{Mat3, Quat, Vec3, atan2};
use concordem_operator::coarse_grain::{Kernel, coarse_grain};
use concordem_operator::power::power;
use concordem_operator::strain::{AffineFit, Dimension, affine_fit, cell_strain, satake_strain};
use concordem_operator::stress::{
    Partition, boundary_stress, kinetic_stress, particle_moments, region_stress, region_stress_from_particles,
    solid_fraction, wall_traction,
};
use concordem_operator::tessellation::{Domain, Mesh, delaunay, power_diagram};
use concordem_operator::{
    ContactSet, LoadSet, OperatorError, Period, Region, Truncation, couple_stress, damage, fabric,
};
use concordem_solver::record::Forces;
use concordem_solver::state::{Cell, Particles, State};

/// What an operator gives: a name and a unit for a number of reals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quantity {
    /// Name.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Reals: 1, 3, or 9 (a tensor by rows).
    pub components: usize,
    /// Meaning.
    pub description: &'static str,
}

/// An operator that can be evaluated during a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Operator {
    /// Stress by the branch sum, and its kinetic part.
    RegionStress,
    /// Stress as volume average over particles, walls included, and the mean stress of the particles themselves.
    ParticleStress,
    /// Stress and couple stress of the whole body from the forces of walls and supports.
    BoundaryStress,
    /// Force of the particles on a wall, and over its area.
    WallTraction,
    /// Stress and couple stress about the region's centre, from contacts internal to the region.
    CoupleStress,
    /// Best affine fit of displacement and rotation since the start: gradient, Cosserat strain, curvature.
    AffineStrain,
    /// The same of velocity and spin.
    AffineRate,
    /// Displacement gradient since the start by the Delaunay cells of the start.
    CellStrain,
    /// Velocity gradient by the same cells where they are now.
    CellRate,
    /// Displacement gradient with rotations since the start by contact cells (power diagram) of the periodic cell.
    ContactCellStrain,
    /// Velocity gradient with spins by contact cells.
    ContactCellRate,
    /// Fabric tensor and coordination number.
    Fabric,
    /// Solid fraction and porosity.
    Porosity,
    /// Damage tensors of the bonds (their damage as the law has it, and that of strength; broken ones counted as 1).
    DamageTensor,
    /// Power of the contacts, and what of it stress and strain rate explain.
    Power,
    /// Density, momentum, and stress at a point by a smooth kernel: the region is a sphere, the kernel's support.
    CoarseGrain,
}

const fn tensor(name: &'static str, unit: &'static str, description: &'static str) -> Quantity {
    Quantity { name, unit, components: 9, description }
}
const fn vector(name: &'static str, unit: &'static str, description: &'static str) -> Quantity {
    Quantity { name, unit, components: 3, description }
}
const fn scalar(name: &'static str, unit: &'static str, description: &'static str) -> Quantity {
    Quantity { name, unit, components: 1, description }
}

impl Operator {
    /// All of them.
    pub const ALL: [Self; 16] = [
        Self::RegionStress,
        Self::ParticleStress,
        Self::BoundaryStress,
        Self::WallTraction,
        Self::CoupleStress,
        Self::AffineStrain,
        Self::AffineRate,
        Self::CellStrain,
        Self::CellRate,
        Self::ContactCellStrain,
        Self::ContactCellRate,
        Self::Fabric,
        Self::Porosity,
        Self::DamageTensor,
        Self::Power,
        Self::CoarseGrain,
    ];

    /// Its name in scenarios and results.
    pub fn name(self) -> &'static str {
        match self {
            Self::RegionStress => "region-stress",
            Self::ParticleStress => "particle-stress",
            Self::BoundaryStress => "boundary-stress",
            Self::WallTraction => "wall-traction",
            Self::CoupleStress => "couple-stress",
            Self::AffineStrain => "affine-strain",
            Self::AffineRate => "affine-rate",
            Self::CellStrain => "cell-strain",
            Self::CellRate => "cell-rate",
            Self::ContactCellStrain => "contact-cell-strain",
            Self::ContactCellRate => "contact-cell-rate",
            Self::Fabric => "fabric",
            Self::Porosity => "porosity",
            Self::DamageTensor => "damage-tensor",
            Self::Power => "power",
            Self::CoarseGrain => "coarse-grain",
        }
    }

    /// What it gives, in the order of the values.
    pub fn quantities(self) -> &'static [Quantity] {
        const VOLUME: Quantity = scalar("volume", "m^3", "Volume of the region");
        const CONTACTS: Quantity = scalar("contacts", "1", "Contacts that counted");
        const PARTICLES: Quantity = scalar("particles", "1", "Particles that counted");
        const CELLS: Quantity = scalar("cells", "1", "Cells that counted");
        match self {
            Self::RegionStress => {
                const {
                    &[
                        tensor("stress", "Pa", "Branch sum, rows: normal, columns: force; tension positive"),
                        tensor("kinetic_stress", "Pa", "Kinetic part, -sum m v'v'/V, not in `stress`"),
                        VOLUME,
                        CONTACTS,
                    ]
                }
            }
            Self::ParticleStress => {
                const {
                    &[
                        tensor("stress", "Pa", "Sum of V_p sigma_p over the region's volume"),
                        tensor("mean_particle_stress", "Pa", "Mean of sigma_p weighted by the particles' volumes"),
                        scalar("solid_fraction", "1", "Volume of particles over volume of the region, by centres"),
                        VOLUME,
                    ]
                }
            }
            Self::BoundaryStress => {
                const {
                    &[
                        tensor("stress", "Pa", "Sum of x f/V over walls and supports"),
                        tensor("couple_stress", "N/m", "Couple stress of the same about the middle of all particles"),
                        vector("force", "N", "Sum of the forces: what weight and inertia take"),
                        scalar("loads", "1", "Contacts with walls, and particles whose motion is prescribed"),
                    ]
                }
            }
            Self::WallTraction => {
                const {
                    &[
                        vector("force", "N", "Force of the particles on the wall"),
                        vector("traction", "Pa", "The same over the area given"),
                        CONTACTS,
                    ]
                }
            }
            Self::CoupleStress => {
                const {
                    &[
                        tensor("stress", "Pa", "Stress of contacts internal to the region"),
                        tensor("couple_stress", "N/m", "Couple stress about the region's centre"),
                        vector("rigid_force", "N/m^3", "Sum of internal forces per volume; rounding"),
                        vector("rigid_moment", "N/m^2", "Sum of internal moments per volume; rounding"),
                        VOLUME,
                        CONTACTS,
                    ]
                }
            }
            Self::AffineStrain => {
                const {
                    &[
                        tensor("gradient", "1", "Displacement gradient du_i/dx_j, positions of the start"),
                        tensor("cosserat_strain", "1", "Cosserat strain du_j/dx_i - e_ijk phi_k"),
                        tensor("curvature", "1/m", "Curvature dphi_j/dx_i"),
                        vector("rotation", "rad", "Mean rotation of particles"),
                        scalar("residual", "m", "Root mean square of displacement that is not affine"),
                        PARTICLES,
                    ]
                }
            }
            Self::AffineRate => {
                const {
                    &[
                        tensor("gradient", "1/s", "Velocity gradient dv_i/dx_j"),
                        tensor("cosserat_rate", "1/s", "Cosserat strain rate dv_j/dx_i - e_ijk w_k"),
                        tensor("curvature_rate", "1/(m s)", "Rate of curvature dw_j/dx_i"),
                        vector("spin", "rad/s", "Mean spin of particles"),
                        scalar("residual", "m/s", "Root mean square of velocity that is not affine"),
                        PARTICLES,
                    ]
                }
            }
            Self::CellStrain => {
                const { &[tensor("gradient", "1", "Displacement gradient du_i/dx_j, cells of the start"), VOLUME, CELLS] }
            }
            Self::CellRate => const { &[tensor("gradient", "1/s", "Velocity gradient dv_i/dx_j"), VOLUME, CELLS] },
            Self::ContactCellStrain => {
                const {
                    &[
                        tensor("gradient", "1", "du_i/dx_j + e_ijk phi_k: the transposed Cosserat strain"),
                        VOLUME,
                        scalar("faces", "1", "Faces between contact cells"),
                    ]
                }
            }
            Self::ContactCellRate => {
                const {
                    &[
                        tensor("gradient", "1/s", "dv_i/dx_j + e_ijk w_k: the transposed Cosserat strain rate"),
                        VOLUME,
                        scalar("faces", "1", "Faces between contact cells"),
                    ]
                }
            }
            Self::Fabric => {
                const {
                    &[
                        tensor("fabric", "1", "Fabric tensor, trace 1"),
                        scalar("coordination", "1", "Mean number of contacts per particle"),
                        CONTACTS,
                        PARTICLES,
                    ]
                }
            }
            Self::Porosity => {
                const {
                    &[
                        scalar("solid_fraction", "1", "Volume of particles over volume of the region, by centres"),
                        scalar("porosity", "1", "One minus the solid fraction"),
                        VOLUME,
                    ]
                }
            }
            Self::DamageTensor => {
                const {
                    &[
                        tensor("damage", "1", "Damage tensor by least squares for even directions"),
                        tensor(
                            "damage_exact",
                            "1",
                            "The same for the directions as they are; NaN if these are too few",
                        ),
                        tensor("strength_damage", "1", "Damage tensor of the strength that bonds have lost"),
                        scalar("mean_damage", "1", "Mean damage of the bonds"),
                        scalar("mean_strength_damage", "1", "Mean of the strength that bonds have lost"),
                        CONTACTS,
                    ]
                }
            }
            Self::Power => {
                const {
                    &[
                        scalar("contacts", "W", "Power put into the contacts"),
                        scalar("stress", "W", "What stress and Cosserat strain rate explain of it"),
                        scalar("couple", "W", "What couple stress and curvature rate explain"),
                        scalar("gap", "W", "The rest: motion that is not affine"),
                    ]
                }
            }
            Self::CoarseGrain => {
                const {
                    &[
                        scalar("density", "kg/m^3", "Mass density"),
                        vector("velocity", "m/s", "Momentum over mass density"),
                        tensor("stress", "Pa", "Contact stress; tension positive"),
                        tensor("kinetic_stress", "Pa", "Kinetic stress, not in `stress`"),
                    ]
                }
            }
        }
    }

    /// Number of reals of a row.
    pub fn width(self) -> usize {
        self.quantities().iter().map(|quantity| quantity.components).sum()
    }

    /// Whether it needs the places of the particles at the start.
    pub fn needs_places(self) -> bool {
        matches!(self, Self::AffineStrain | Self::CellStrain | Self::CellRate | Self::ContactCellStrain)
    }
}

/// Where an operator samples.
#[derive(Debug, Clone, PartialEq)]
pub enum SampledRegion {
    /// A region that moves by `x → x⁰ + exp(L t)(x − x⁰) + v t`, `x⁰` its centre at time zero (the origin if it has none).
    Moving {
        /// The region at time zero.
        region: Region,
        /// Velocity `v`, m/s.
        velocity: Vec3,
        /// Velocity gradient `L`, 1/s.
        gradient: Mat3,
    },
    /// The periodic cell, whatever its volume is by then.
    Cell,
}

/// A wall with the area that tractions refer to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledWall {
    /// Index.
    pub wall: u32,
    /// Area, m².
    pub area: f64,
}

/// An operator with its region and interval.
#[derive(Debug, Clone, PartialEq)]
pub struct OperatorSample {
    /// Name, of the group in the result.
    pub name: String,
    /// What is evaluated.
    pub operator: Operator,
    /// Where.
    pub region: SampledRegion,
    /// Cells along x, y, z that a box is divided into; each gives its own values.
    pub grid: Option<[usize; 3]>,
    /// How contacts at the border count.
    pub truncation: Truncation,
    /// How branches are divided between particles.
    pub partition: Partition,
    /// The wall, for tractions.
    pub wall: Option<SampledWall>,
    /// Steps between two evaluations.
    pub interval: u64,
}

/// Bonds as the damage tensor needs them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Bonds {
    /// Middle, m.
    pub middle: Vec<Vec3>,
    /// Direction.
    pub normal: Vec<Vec3>,
    /// Damage, 0 to 1.
    pub damage: Vec<f64>,
    /// Share of the strength that is lost, 0 to 1.
    pub lost_strength: Vec<f64>,
}

impl Bonds {
    /// Those of a state, broken ones included, where particle A is now.
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
    pub fn push(&mut self, a: &Vec3, frame: &PreviousGeometry, [damage, lost_strength]: [f64; 2]) {
        self.middle.push(a + frame.normal * (0.5 * frame.length));
        self.normal.push(frame.normal);
        self.damage.push(damage);
        self.lost_strength.push(lost_strength);
    }
}

/// What operators need of a moment of a run.
pub struct Sampled<'a> {
    /// Particles.
    pub particles: &'a Particles,
    /// Periodic cell.
    pub cell: Option<Cell>,
    /// Time, s.
    pub time: f64,
    /// Bonds; may be empty when no damage tensor is wanted.
    pub bonds: &'a Bonds,
    /// Forces of contacts.
    pub forces: &'a Forces,
    /// Position of every particle at the start, m; may be empty when no operator needs it.
    pub places: &'a [Vec3],
    /// Delaunay cells of these places, made when first needed.
    pub mesh: &'a OnceLock<Result<Mesh, OperatorError>>,
    /// Gravity, m/s².
    pub gravity: Vec3,
    /// Whether discs of unit depth.
    pub plane: bool,
}

/// Motion that strains are made of: positions, displacements, rotations, and how the period follows.
struct Motion {
    position: Vec<Vec3>,
    displacement: Vec<Vec3>,
    rotation: Vec<Vec3>,
    period: Option<Period>,
}

impl Sampled<'_> {
    fn dimension(&self) -> Dimension {
        if self.plane { Dimension::Two } else { Dimension::Three }
    }

    /// The period with its rate.
    fn period(&self) -> Option<Period> {
        self.cell.map(|cell| Period { edges: cell.matrix, change: cell.velocity_gradient * cell.matrix })
    }

    /// Edges of the periodic cell at the start.
    fn first_edges(&self) -> Option<Mat3> {
        self.cell.map(|cell| cell.deformation_gradient.try_inverse().unwrap_or_else(Mat3::identity) * cell.matrix)
    }

    /// Displacements since the start, or velocities.
    fn motion(&self, rates: bool) -> Motion {
        let particles = self.particles;
        if rates {
            return Motion {
                position: particles.position.clone(),
                displacement: particles.velocity.clone(),
                rotation: particles.angular_velocity.clone(),
                period: self.period(),
            };
        }
        Motion {
            position: self.places.to_vec(),
            displacement: particles.position.iter().zip(self.places).map(|(now, then)| now - then).collect(),
            rotation: particles.orientation.iter().map(rotation_vector).collect(),
            period: self
                .cell
                .zip(self.first_edges())
                .map(|(cell, edges)| Period { edges, change: cell.matrix - edges }),
        }
    }

    fn volumes(&self) -> Vec<f64> {
        self.particles.radius.iter().map(|r| concordem_packing::mass_of(*r, 1.0, self.plane).0).collect()
    }

    /// What the outside exerts on the body: the recorded forces of walls, and the reactions of prescribed freedoms, which are
    /// the opposite of what contacts, walls, and weight exert along them (as long as these move without acceleration).
    fn loads(&self, contacts: &ContactSet<'_>) -> Loads {
        let particles = self.particles;
        let walls = &self.forces.walls;
        let mut loads = Loads {
            particle: walls.particle.clone(),
            point: walls.point.clone(),
            force: walls.force.clone(),
            moment: walls.moment.clone(),
        };
        if particles.constraint.iter().all(|c| *c == concordem_solver::state::Constraint::FREE) {
            return loads;
        }
        let mut net = couple_stress::resultants(contacts);
        for k in 0..walls.particle.len() {
            let p = walls.particle[k] as usize;
            net[p].force += walls.force[k];
            net[p].moment += (walls.point[k] - particles.position[p]).cross(&walls.force[k]) + walls.moment[k];
        }
        for (p, constraint) in particles.constraint.iter().enumerate() {
            if *constraint == concordem_solver::state::Constraint::FREE {
                continue;
            }
            let held =
                |is_held: &dyn Fn(usize) -> bool, by: Vec3| Vec3::from_fn(|k, _| if is_held(k) { -by[k] } else { 0.0 });
            loads.particle.push(p as u32);
            loads.point.push(particles.position[p]);
            loads.force.push(held(&|k| constraint.translation(k), net[p].force + self.gravity * particles.mass[p]));
            loads.moment.push(held(&|k| constraint.rotation(k), net[p].moment));
        }
        loads
    }
}

/// Loads on particles, owned.
struct Loads {
    particle: Vec<u32>,
    point: Vec<Vec3>,
    force: Vec<Vec3>,
    moment: Vec<Vec3>,
}

impl Loads {
    fn set(&self, particles: usize) -> Result<LoadSet<'_>, OperatorError> {
        LoadSet::new(particles, &self.particle, &self.point, &self.force, Some(&self.moment))
    }
}

/// The values of a row, in the order of the operator's quantities.
#[derive(Default)]
struct Row(Vec<f64>);

impl Row {
    /// A tensor by rows.
    fn tensor(&mut self, tensor: &Mat3) -> &mut Self {
        self.0.extend(tensor.transpose().iter());
        self
    }

    fn vector(&mut self, vector: &Vec3) -> &mut Self {
        self.0.extend(vector.iter());
        self
    }

    fn reals<const N: usize>(&mut self, reals: [f64; N]) -> &mut Self {
        self.0.extend(reals);
        self
    }
}

impl OperatorSample {
    /// Number of cells that give values of their own.
    pub fn cells(&self) -> usize {
        self.grid.map_or(1, |count| count.iter().product())
    }

    /// Values at a state: for each of [`Operator::quantities`], for each cell of the grid (x fastest), its components.
    ///
    /// A region in which an operator has nothing to work with gives not-a-number, not an error: a moving region may pass
    /// through empty space.
    pub fn evaluate(&self, at: &Sampled<'_>) -> Result<Vec<f64>, OperatorError> {
        let rows = self
            .regions(at)
            .iter()
            .map(|region| match self.values(region, at) {
                Err(OperatorError::EmptyRegion { .. } | OperatorError::Flat { .. }) => {
                    Ok(vec![f64::NAN; self.operator.width()])
                }
                other => other,
            })
            .collect::<Result<Vec<_>, _>>()?;
        let mut values = Vec::with_capacity(self.operator.width() * rows.len());
        let mut first = 0;
        for quantity in self.operator.quantities() {
            let last = first + quantity.components;
            for row in &rows {
                values.extend_from_slice(&row[first..last]);
            }
            first = last;
        }
        Ok(values)
    }

    /// The region now, or the cells of its grid.
    fn regions(&self, at: &Sampled<'_>) -> Vec<Region> {
        let (region, velocity, gradient) = match (&self.region, &at.cell) {
            (SampledRegion::Cell, Some(cell)) => return vec![Region::periodic_cell(&cell.matrix)],
            (SampledRegion::Cell, None) => return vec![Region::All { volume: f64::NAN }],
            (SampledRegion::Moving { region, velocity, gradient }, _) => (region, velocity, gradient),
        };
        let origin = region.center().unwrap_or_else(Vec3::zeros);
        let parts = match (self.grid, region) {
            (Some(count), Region::Box { low, high }) => Region::grid(*low, *high, count),
            _ => vec![region.clone()],
        };
        if *velocity == Vec3::zeros() && *gradient == Mat3::zeros() {
            return parts;
        }
        let deformation = (gradient * at.time).exp();
        parts.iter().map(|part| part.moved(&deformation, &origin, &(velocity * at.time))).collect()
    }

    fn values(&self, region: &Region, at: &Sampled<'_>) -> Result<Vec<f64>, OperatorError> {
        let particles = at.particles;
        let contacts = at.forces.contacts.set(particles)?;
        let period = at.period();
        let period = period.as_ref();
        let mut row = Row::default();
        match self.operator {
            Operator::RegionStress => {
                let mean = region_stress(&contacts, region, self.truncation, period)?;
                let kinetic = kinetic(region, at)?;
                row.tensor(&mean.stress).tensor(&kinetic).reals([mean.volume, mean.full + mean.partial]);
            }
            Operator::ParticleStress => {
                let walls = at.forces.walls.set(particles)?;
                let moments = particle_moments(&contacts, &walls, self.partition);
                let stress = region_stress_from_particles(&particles.position, &moments, region, period)?;
                let solid = solid_fraction(&particles.position, &at.volumes(), region, period)?;
                row.tensor(&stress).tensor(&(stress / solid)).reals([solid, region.volume()?]);
            }
            Operator::BoundaryStress => {
                let loads = at.loads(&contacts);
                let set = loads.set(particles.len())?;
                let volume = region.volume()?;
                let middle = middle(particles);
                let couple = couple_stress::external(&particles.position, &set, volume, &middle)?;
                let force: Vec3 = loads.force.iter().sum();
                row.tensor(&boundary_stress(&set, volume)?).tensor(&couple).vector(&force).reals([set.len() as f64]);
            }
            Operator::WallTraction => {
                let wall = self.wall.ok_or(OperatorError::EmptyRegion { what: "wall" })?;
                let walls = &at.forces.walls;
                let mine = || walls.wall.iter().zip(&walls.force).filter(|(k, _)| **k == wall.wall);
                let force = -mine().map(|(_, force)| force).sum::<Vec3>();
                row.vector(&force).vector(&wall_traction(&force, wall.area)?).reals([mine().count() as f64]);
            }
            Operator::CoupleStress => {
                let centre = region.center().unwrap_or_else(|| middle(particles));
                let c = couple_stress::conjugate(&contacts, region, &centre, period)?;
                row.tensor(&c.stress).tensor(&c.couple_stress).vector(&c.rigid_force).vector(&c.rigid_moment);
                row.reals([c.volume, c.contacts as f64]);
            }
            Operator::AffineStrain | Operator::AffineRate => {
                let fit = affine(region, at, self.operator == Operator::AffineRate)?;
                row.tensor(&fit.gradient).tensor(&fit.cosserat_strain()).tensor(&fit.curvature).vector(&fit.rotation);
                row.reals([(fit.residual[0] / fit.particles as f64).sqrt(), fit.particles as f64]);
            }
            Operator::CellStrain | Operator::CellRate => {
                let edges = at.first_edges();
                let mesh = at.mesh.get_or_init(|| delaunay(at.places, at.dimension(), edges.as_ref()));
                let mesh = mesh.as_ref().map_err(Clone::clone)?;
                let m = at.motion(self.operator == Operator::CellRate);
                let all = cell_strain(mesh, &m.position, &m.displacement, m.period.as_ref())?;
                let mean = all.within(mesh, &m.position, region, m.period.as_ref())?;
                row.tensor(&mean.gradient).reals([mean.volume, mean.cells.len() as f64]);
            }
            Operator::ContactCellStrain | Operator::ContactCellRate => {
                let m = at.motion(self.operator == Operator::ContactCellRate);
                let edges = m.period.map(|period| period.edges).ok_or(OperatorError::Singular {
                    what: "the strain of contact cells",
                    reason: "without a periodic cell the motion of their border is not known",
                })?;
                let diagram = power_diagram(&m.position, &particles.radius, &Domain::Periodic(edges), at.dimension())?;
                let strain = satake_strain(&diagram, &m.displacement, &m.rotation, &[], m.period.as_ref())?;
                row.tensor(&strain.gradient).reals([strain.volume, diagram.faces.len() as f64]);
            }
            Operator::Fabric => {
                let fabric = fabric::fabric(&contacts, region, self.truncation, period)?;
                row.tensor(&fabric.tensor).reals([fabric.coordination, fabric.contacts, fabric.particles as f64]);
            }
            Operator::Porosity => {
                let solid = solid_fraction(&particles.position, &at.volumes(), region, period)?;
                row.reals([solid, 1.0 - solid, region.volume()?]);
            }
            Operator::DamageTensor => bond_damage(region, at, &mut row)?,
            Operator::Power => {
                let fit = affine(region, at, true)?;
                let volume = region.volume()?;
                // What the image of B moves faster than B.
                let carried: Vec<Vec3> = at.cell.map_or_else(Vec::new, |cell| {
                    let forces = &at.forces.contacts;
                    let image = |(pair, l): (&[u32; 2], &Vec3)| {
                        let [a, b] = pair.map(|p| particles.position[p as usize]);
                        cell.velocity_gradient * (l - (b - a))
                    };
                    forces.pair.iter().zip(&forces.branch).map(image).collect()
                });
                let p = power(&contacts, &particles.velocity, &particles.angular_velocity, &carried, &fit, volume)?;
                row.reals([p.contacts, p.stress, p.couple, p.gap]);
            }
            Operator::CoarseGrain => {
                let (Region::Sphere { center: centre, radius } | Region::Cylinder { center: centre, radius, .. }) = region else {
                    return Err(OperatorError::Singular {
                        what: "a coarse-grained field",
                        reason: "its region is the support of the kernel, a sphere",
                    });
                };
                let kernel = Kernel::new(*radius, at.dimension())?;
                let fields =
                    coarse_grain(&contacts, &particles.mass, &particles.velocity, &kernel, &[*centre], period)?;
                let field = fields.first().copied().unwrap_or_default();
                // Without mass there is no velocity.
                row.reals([field.density]).vector(&(field.momentum / field.density));
                row.tensor(&field.stress).tensor(&field.kinetic_stress);
            }
        }
        Ok(row.0)
    }
}

/// Mean position of all particles, m.
fn middle(particles: &Particles) -> Vec3 {
    particles.position.iter().sum::<Vec3>() / particles.len().max(1) as f64
}

/// Kinetic stress of a region, Pa; zero where there is no particle. In a deforming cell only what departs from its motion
/// counts.
fn kinetic(region: &Region, at: &Sampled<'_>) -> Result<Mat3, OperatorError> {
    let particles = at.particles;
    let gradient = at.cell.map_or_else(Mat3::zeros, |cell| cell.velocity_gradient);
    let motion: Vec<Vec3> = particles.velocity.iter().zip(&particles.position).map(|(v, x)| v - gradient * x).collect();
    let period = at.cell.map(|cell| Period::of(cell.matrix));
    match kinetic_stress(&particles.position, &particles.mass, &motion, region, period.as_ref()) {
        Err(OperatorError::EmptyRegion { .. }) => Ok(Mat3::zeros()),
        other => other,
    }
}

fn affine(region: &Region, at: &Sampled<'_>, rates: bool) -> Result<AffineFit, OperatorError> {
    let m = at.motion(rates);
    affine_fit(&m.position, &m.displacement, &m.rotation, region, m.period.as_ref(), at.dimension())
}

/// Damage tensors of the bonds whose middles lie in a region.
fn bond_damage(region: &Region, at: &Sampled<'_>, row: &mut Row) -> Result<(), OperatorError> {
    // A list of particles has no place that a bond's middle could lie in.
    if matches!(region, Region::Particles { .. }) {
        return Err(OperatorError::NoSurface);
    }
    let bonds = at.bonds;
    let inside: Vec<usize> = (0..bonds.middle.len()).filter(|&k| region.contains(0, &bonds.middle[k])).collect();
    let normal: Vec<Vec3> = inside.iter().map(|&k| bonds.normal[k]).collect();
    let [damages, lost] =
        [&bonds.damage, &bonds.lost_strength].map(|all| inside.iter().map(|&k| all[k]).collect::<Vec<f64>>());
    let exact = match damage::damage_tensor_exact(&normal, &damages) {
        Err(OperatorError::Singular { .. }) => Mat3::repeat(f64::NAN),
        other => other?,
    };
    let count = inside.len() as f64;
    row.tensor(&damage::damage_tensor(&normal, &damages)?).tensor(&exact);
    row.tensor(&damage::damage_tensor(&normal, &lost)?);
    row.reals([damages.iter().sum::<f64>() / count, lost.iter().sum::<f64>() / count, count]);
    Ok(())
}

/// Rotation vector (rad) of a unit quaternion, the short way round.
pub fn rotation_vector(q: &Quat) -> Vec3 {
    let (im, w) = if q.w < 0.0 { (-q.imag(), -q.w) } else { (q.imag(), q.w) };
    let s = im.norm();
    // For small angles 2 atan2(s, w)/s → 2/w without loss.
    if s == 0.0 { Vec3::zeros() } else { im * (2.0 * atan2(s, w) / s) }
}
