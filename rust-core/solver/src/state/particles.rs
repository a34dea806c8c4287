//! Particles as a struct of arrays.

use concordem_contact::Cell;
pub use concordem_contact::Constraint;
use rayon::prelude::*;

use concordem_contact::kinematics::Pose;
use concordem_contact::math::{Quat, Symmetric, Vec3};

/// Spherical particles (discs in 2-D) as a struct of arrays. The index is the position along a space-filling curve; `id` is
/// the stable number of a particle.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Particles {
    /// Stable id, unique.
    pub id: Vec<u32>,
    /// Position, m.
    pub position: Vec<Vec3>,
    /// Velocity, m/s; at the half step before the positions' time (leapfrog).
    pub velocity: Vec<Vec3>,
    /// Orientation, body → world, unit.
    pub orientation: Vec<Quat>,
    /// Rotation of the last step as a unit quaternion (the orientation before it was
    /// `rotation_increment⁻¹ · orientation`).
    pub rotation_increment: Vec<Quat>,
    /// Angular velocity, rad/s; at the half step.
    pub angular_velocity: Vec<Vec3>,
    /// Radius, m.
    pub radius: Vec<f64>,
    /// Mass, kg.
    pub mass: Vec<f64>,
    /// Moment of inertia about any axis, kg·m².
    pub inertia: Vec<f64>,
    /// Material, index into the model's table.
    pub material: Vec<u16>,
    /// Rigid clump the particle belongs to, or `u32::MAX`.
    pub clump: Vec<u32>,
    /// Prescribed degrees of freedom.
    pub constraint: Vec<Constraint>,
    /// Tags of the scenario's named sets, one bit each.
    pub tags: Vec<u64>,
    /// Net force (N) and torque (N·m) of the last step, if the damping reads them; otherwise empty.
    pub previous: Vec<[Vec3; 2]>,
    /// Number of cells by which each particle was moved back so far: without these moves its position would be
    /// `x + H·image`. Empty until a particle is moved.
    pub image: Vec<[i32; 3]>,
    /// Particle virials; empty if the particles are rigid.
    pub deformation: Vec<Deformation>,
    /// Number of the aggregate to which each particle belongs, from 1; 0 for none. Empty without aggregates.
    pub aggregate: Vec<u32>,
    /// Constant external loads, at most one per particle, by ascending particle.
    pub loads: Vec<Load>,
}

/// A constant external load on a particle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Index of the particle.
    pub particle: u32,
    /// Force, N.
    pub force: Vec3,
    /// Moment, N·m.
    pub moment: Vec3,
    /// Particle virial `±Σ f⊗f/|f|`, N, of forces that pull (+) on the particle's surface or push (−) against it. Zero
    /// for forces on the body.
    pub virial: Symmetric,
}

/// Particle virials `Σ ½(n⊗f + f⊗n)` of a deformable particle, N; `n` points from the center to the point where the
/// force `f` acts.
#[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Deformation {
    /// Virial of all forces of the last step, N.
    pub virial: Symmetric,
    /// Virial from which the strains of the last step were computed, N.
    pub used: Symmetric,
    /// Virial of the contact forces that do not depend on the strain, N.
    pub other: Symmetric,
    /// Virial of the reaction of a prescribed motion, N.
    pub reaction: Symmetric,
}

/// Where an external force acts on its particle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PointOfAction {
    /// On the whole body, like a weight.
    #[default]
    Body,
    /// At the point of the surface in the direction of the force: it pulls.
    Pull,
    /// At the point of the surface opposite to the direction of the force: it pushes.
    Push,
}

/// Position and radius of a particle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Center, m.
    pub position: Vec3,
    /// Radius, m.
    pub radius: f64,
}

impl Particles {
    /// Write position, rotation, and radius of each particle into `poses`. `oriented`: the rotation is the orientation,
    /// otherwise the rotation of the step.
    pub fn poses(&self, oriented: bool, poses: &mut Vec<Pose>) {
        let rotation = if oriented { &self.orientation } else { &self.rotation_increment };
        poses.resize(self.len(), Pose { position: Vec3::zeros(), rotation: Quat::identity(), radius: 0.0 });
        let given = self.position.par_iter().zip(rotation).zip(&self.radius);
        poses.par_iter_mut().zip(given).with_min_len(1024).for_each(|(pose, ((position, rotation), radius))| {
            // Field by field: a whole pose would be built on the stack and read back before its parts have arrived there.
            pose.position = *position;
            pose.rotation = *rotation;
            pose.radius = *radius;
        });
    }

    /// Displacement from the position of particle `p` to its position without the moves back by whole cells, m.
    pub fn unwrapping(&self, p: usize, cell: Option<&Cell>) -> Vec3 {
        match (self.image.get(p), cell) {
            (Some(image), Some(cell)) if *image != [0; 3] => cell.matrix * Vec3::from(image.map(f64::from)),
            _ => Vec3::zeros(),
        }
    }

    /// Root mean square of the radii, m; 0 without particles.
    pub fn mean_radius(&self) -> f64 {
        (self.radius.iter().map(|r| r * r).sum::<f64>() / self.len().max(1) as f64).sqrt()
    }

    /// Number of the aggregate to which particle `p` belongs, from 1; 0 for none.
    pub fn aggregate_of(&self, p: usize) -> u32 {
        self.aggregate.get(p).copied().unwrap_or(0)
    }

    /// Number of particles.
    #[inline]
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether there are no particles.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Make room for `count` more particles.
    pub fn reserve(&mut self, count: usize) {
        self.id.reserve_exact(count);
        self.position.reserve_exact(count);
        self.velocity.reserve_exact(count);
        self.orientation.reserve_exact(count);
        self.rotation_increment.reserve_exact(count);
        self.angular_velocity.reserve_exact(count);
        self.radius.reserve_exact(count);
        self.mass.reserve_exact(count);
        self.inertia.reserve_exact(count);
        self.material.reserve_exact(count);
        self.clump.reserve_exact(count);
        self.constraint.reserve_exact(count);
        self.tags.reserve_exact(count);
    }

    /// Add a free particle at rest with the given mass (kg) and moment of inertia (kg·m²). Its id is its index.
    pub fn push(&mut self, sphere: Sphere, material: u16, mass: f64, inertia: f64) {
        self.id.push(self.len() as u32);
        self.position.push(sphere.position);
        self.velocity.push(Vec3::zeros());
        self.orientation.push(Quat::identity());
        self.rotation_increment.push(Quat::identity());
        self.angular_velocity.push(Vec3::zeros());
        self.radius.push(sphere.radius);
        self.mass.push(mass);
        self.inertia.push(inertia);
        self.material.push(material);
        self.clump.push(u32::MAX);
        self.constraint.push(Constraint::FREE);
        self.tags.push(0);
        if !self.aggregate.is_empty() {
            self.aggregate.push(0);
        }
    }

    /// Add to the external load of a particle: force in N, moment in N·m. The force acts on the body.
    pub fn add_load(&mut self, particle: u32, force: Vec3, moment: Vec3) {
        self.add_load_at(particle, force, moment, PointOfAction::Body);
    }

    /// [`Self::add_load`] with a force that acts at `acts`.
    pub fn add_load_at(&mut self, particle: u32, force: Vec3, moment: Vec3, acts: PointOfAction) {
        let size = force.norm();
        let sign = match acts {
            PointOfAction::Body => 0.0,
            PointOfAction::Pull => 1.0,
            PointOfAction::Push => -1.0,
        };
        let virial =
            if size > 0.0 { Symmetric::product(&(force * (sign / size)), &force) } else { Symmetric::default() };
        match self.loads.binary_search_by_key(&particle, |load| load.particle) {
            Ok(at) => {
                self.loads[at].force += force;
                self.loads[at].moment += moment;
                self.loads[at].virial += virial;
            }
            Err(at) => self.loads.insert(at, Load { particle, force, moment, virial }),
        }
    }

    /// External load of a particle: force in N, moment in N·m.
    #[inline]
    pub fn load(&self, particle: u32) -> (Vec3, Vec3) {
        load_of(&self.loads, particle)
    }

    /// The same particles in another order: entry `k` of the result is entry `order[k]` of `self`.
    #[must_use]
    pub fn permuted(&self, order: &[u32]) -> Self {
        fn pick<T: Copy>(values: &[T], order: &[u32]) -> Vec<T> {
            order.iter().map(|&k| values[k as usize]).collect()
        }
        Self {
            id: pick(&self.id, order),
            position: pick(&self.position, order),
            velocity: pick(&self.velocity, order),
            orientation: pick(&self.orientation, order),
            rotation_increment: pick(&self.rotation_increment, order),
            angular_velocity: pick(&self.angular_velocity, order),
            radius: pick(&self.radius, order),
            mass: pick(&self.mass, order),
            inertia: pick(&self.inertia, order),
            material: pick(&self.material, order),
            clump: pick(&self.clump, order),
            constraint: pick(&self.constraint, order),
            tags: pick(&self.tags, order),
            previous: if self.previous.is_empty() { Vec::new() } else { pick(&self.previous, order) },
            image: if self.image.is_empty() { Vec::new() } else { pick(&self.image, order) },
            deformation: if self.deformation.is_empty() { Vec::new() } else { pick(&self.deformation, order) },
            aggregate: if self.aggregate.is_empty() { Vec::new() } else { pick(&self.aggregate, order) },
            loads: {
                let place: std::collections::BTreeMap<u32, u32> =
                    order.iter().enumerate().map(|(new, &old)| (old, new as u32)).collect();
                let moved = |load: &Load| place.get(&load.particle).map(|&particle| Load { particle, ..*load });
                let mut loads: Vec<Load> = self.loads.iter().filter_map(moved).collect();
                loads.sort_unstable_by_key(|load| load.particle);
                loads
            },
        }
    }
}

/// Virial of a particle's load among `loads`, which are sorted by particle, N.
#[inline]
pub fn load_virial(loads: &[Load], particle: u32) -> Symmetric {
    if loads.is_empty() {
        return Symmetric::default();
    }
    loads
        .binary_search_by_key(&particle, |load| load.particle)
        .map_or_else(|_| Symmetric::default(), |at| loads[at].virial)
}

/// Force (N) and moment (N·m) of a particle's load among `loads`, which are sorted by particle.
#[inline]
pub fn load_of(loads: &[Load], particle: u32) -> (Vec3, Vec3) {
    if loads.is_empty() {
        return (Vec3::zeros(), Vec3::zeros());
    }
    loads
        .binary_search_by_key(&particle, |load| load.particle)
        .map_or_else(|_| (Vec3::zeros(), Vec3::zeros()), |at| (loads[at].force, loads[at].moment))
}
