//! Loading of a scenario: chooses end layers, platens, or the cell, and sets initial velocities and constraints.

mod flexure;

use super::histories::stages;
use super::selection::{bounds_along, extents, layer, member_of_clump};
use super::{AssemblyError, material_index, placed::Placed, unfit};
use crate::schedule::Loading;
use crate::schedule::loading::Gauge;
use crate::schema::quantity::{Component, CrossSection, Length, StrainRate, Velocity};
use crate::schema::{self, Axis, End, Lateral, Quantity, Scenario};
use concordem_contact::math::{Mat3, Vec3};
use concordem_packing::smallest_section;
use concordem_solver::state::surface::Plane;
use concordem_solver::state::{Constraint, Particles, State, Wall, WallShape};

/// Builds the loading of a scenario whose bonds have this interaction ratio.
pub(super) fn build(
    scenario: &Scenario,
    placed: &Placed,
    interaction_ratio: f64,
    state: &mut State,
) -> Result<Loading, AssemblyError> {
    let largest = state.particles.radius.iter().copied().fold(0.0, f64::max);
    // A loading that follows a gauge starts from rest.
    let first_factor = if scenario.loading.opening().is_some() {
        0.0
    } else {
        stages(scenario).first().map_or(1.0, |stage| stage.factor(0.0))
    };
    let bond_reach = (1.0 + 2.0 * interaction_ratio) * largest;
    let mut builder = Builder { scenario, placed, bond_reach, first_factor, state };
    match &scenario.loading {
        schema::Loading::None => Ok(Loading::None),
        schema::Loading::Uniaxial {
            axis,
            strain_rate,
            layer_thickness,
            lateral,
            initial_velocity_field,
            area,
            gauge_length,
            opening: _,
        } => {
            let ends = builder.end_layers(*axis, *layer_thickness)?;
            let test = UniaxialTest {
                axis: axis.index(),
                strain_rate: *strain_rate,
                lateral: *lateral,
                initial_velocity_field: *initial_velocity_field,
                area: *area,
                gauge_length: *gauge_length,
            };
            builder.uniaxial(&test, ends)
        }
        schema::Loading::Bending { axis, about, rate, layer_thickness, initial_velocity_field } => {
            builder.rotating([*axis, *about], rate.si(), *layer_thickness, *initial_velocity_field)
        }
        schema::Loading::Torsion { axis, rate, layer_thickness, initial_velocity_field } => {
            builder.rotating([*axis; 2], rate.si(), *layer_thickness, *initial_velocity_field)
        }
        schema::Loading::CellStrain { velocity_gradient } => {
            builder.cell_strain(Mat3::from_fn(|i, j| velocity_gradient[i][j].si()))
        }
        schema::Loading::CellStress { stress, strain_rate, maximum_strain_rate, tolerance } => {
            let stress = Mat3::from_fn(|i, j| stress[i][j].si());
            builder.cell_stress(stress, strain_rate.map(Component::si), maximum_strain_rate.si(), tolerance.si())
        }
        schema::Loading::Platens { axis, closing_velocity, material, strip_width, area, opening: _ } => {
            match strip_width {
                Some(width) => builder.splitting_strips(axis.index(), width.si(), closing_velocity.si()),
                None => builder.platens(*axis, *closing_velocity, material.as_deref().unwrap_or_default(), *area),
            }
        }
        schema::Loading::Flexure { .. } => builder.flexure(),
    }
}

/// Indices of the particles of the lower and the upper end layer.
type EndLayers = [Vec<usize>; 2];

/// How two end layers move apart.
struct UniaxialTest {
    axis: usize,
    strain_rate: StrainRate,
    lateral: Lateral,
    initial_velocity_field: bool,
    area: Option<CrossSection>,
    gauge_length: Option<Length>,
}

/// Elastic section of a specimen whose ends rotate.
struct Section {
    /// Stress at the surface divided by the end moment, 1/m³.
    stress_of_moment: f64,
    /// Distance of the surface from the neutral plane or the axis, m.
    lever: f64,
    /// Cross-section, m².
    area: f64,
}

struct Builder<'a> {
    scenario: &'a Scenario,
    placed: &'a Placed,
    /// Default thickness of end layers, m.
    bond_reach: f64,
    /// Factor of the loading's rate at the start, from the first stage.
    first_factor: f64,
    state: &'a mut State,
}

impl Builder<'_> {
    fn uniaxial(&mut self, test: &UniaxialTest, [lower, upper]: EndLayers) -> Result<Loading, AssemblyError> {
        let axis = test.axis;
        let particles = &self.state.particles;
        let mean =
            |layer: &[usize]| layer.iter().map(|&p| particles.position[p][axis]).sum::<f64>() / layer.len() as f64;
        let (bottom, top) = (mean(&lower), mean(&upper));
        let distance = top - bottom;
        let length = test.gauge_length.map_or(distance, Quantity::si);
        let area = self.area(axis, test.area)?;
        let rate = test.strain_rate.si();
        let middle = 0.5 * (bottom + top);
        let half = 0.5 * rate * length;
        let factor = self.first_factor;
        if test.initial_velocity_field {
            start(self.state, |position, velocity, _| {
                velocity[axis] = factor * (rate * (position[axis] - middle)).clamp(-half.abs(), half.abs());
            });
        }
        let constraint = match test.lateral {
            Lateral::Free => Constraint::translation_along(axis),
            Lateral::Fixed => Constraint::ALL,
        };
        for (layer, speed) in [(&lower, -half), (&upper, half)] {
            let mut velocity = Vec3::zeros();
            velocity[axis] = speed;
            for &p in layer {
                prescribe(&mut self.state.particles, p, constraint, &velocity)?;
            }
        }
        let gauge = Gauge::new(self.state, axis, bottom, top);
        let layers = [lower, upper].map(indices);
        Ok(Loading::Uniaxial { axis, layers, speed: half, distance, length, area, gauge })
    }

    fn platens(
        &mut self,
        axis: Axis,
        closing_velocity: Velocity,
        material: &str,
        area: Option<CrossSection>,
    ) -> Result<Loading, AssemblyError> {
        let axis = axis.index();
        let (low, high) = bounds_along(extents(&self.state.particles, axis));
        let sign = if area == Some(CrossSection::Splitting) { -1.0 } else { 1.0 };
        let area = self.area(axis, area)?;
        let first = self.state.walls.len();
        let speed = 0.5 * closing_velocity.si();
        let material = material_index(self.scenario, material);
        for (name, at, sign) in [("lower platen", low, 1.0), ("upper platen", high, -1.0)] {
            let mut normal = Vec3::zeros();
            normal[axis] = sign;
            let mut point = Vec3::zeros();
            point[axis] = at;
            let velocity = normal * speed;
            let shape = WallShape::rigid(Plane { point, normal });
            self.state.walls.push(Wall::new(name, shape, material, velocity));
        }
        let gauge = Gauge::new(self.state, axis, low, high);
        Ok(Loading::Platens { axis, walls: [first, first + 1], speed, length: high - low, area, sign, gauge })
    }

    fn cell_strain(&mut self, gradient: Mat3) -> Result<Loading, AssemblyError> {
        let cell = self.state.cell.as_mut().ok_or_else(no_cell)?;
        let initial_gradient = gradient * self.first_factor;
        cell.velocity_gradient = initial_gradient;
        let initial_volume = cell.volume();
        start(self.state, |position, velocity, _| *velocity = initial_gradient * position);
        Ok(Loading::CellStrain { initial_volume, velocity_gradient: gradient })
    }

    fn cell_stress(
        &self,
        stress: Mat3,
        strain_rate: [Option<f64>; 3],
        maximum_rate: f64,
        tolerance: f64,
    ) -> Result<Loading, AssemblyError> {
        if self.state.cell.is_none() {
            return Err(no_cell());
        }
        // For zero stress the stiffness of the cell, which is not known yet, sets the scale: see `Loading::tune`.
        let largest = stress.abs().max();
        let reference = if largest > 0.0 { largest } else { 1.0 };
        Ok(Loading::CellStress {
            stress,
            strain_rate,
            maximum_rate,
            stiffness: 0.0,
            strain: 0.0,
            settling: 0.0,
            tolerance,
            reference,
        })
    }

    /// End layers that rotate in opposite directions; `axes`: of the specimen, and of the rotation.
    fn rotating(
        &mut self,
        axes: [Axis; 2],
        rate: f64,
        thickness: Option<Length>,
        initial_field: bool,
    ) -> Result<Loading, AssemblyError> {
        let [axis, about] = axes.map(Axis::index);
        let section = self.section(axis, about)?;
        let layers = self.end_layers(axes[0], thickness)?;
        let particles = &self.state.particles;
        let mean = |layer: &Vec<usize>| layer.iter().map(|&p| particles.position[p]).sum::<Vec3>() / layer.len() as f64;
        let centers = [mean(&layers[0]), mean(&layers[1])];
        let length = centers[1][axis] - centers[0][axis];
        if initial_field {
            self.start_rotation([axis, about], rate * self.first_factor, length, (centers[0] + centers[1]) * 0.5);
        }
        for &p in layers.iter().flatten() {
            let particles = &mut self.state.particles;
            let before = particles.constraint[p];
            // The layers rotate about `about` and move across it and along the specimen: no other motion may be prescribed.
            let conflict = (0..3).any(|i| {
                let moves = i != about || about == axis || particles.velocity[p][i] != 0.0;
                let rotates = i == about || particles.angular_velocity[p][i] != 0.0;
                before.translation(i) && moves || before.rotation(i) && rotates
            });
            if conflict {
                return Err(prescribed_twice(particles, p));
            }
            particles.constraint[p] = Constraint::ALL;
        }
        let Section { stress_of_moment, lever, area } = section;
        let layers = layers.map(indices);
        Ok(Loading::Turning { axis, about, layers, rate, length, stress_of_moment, lever, area })
    }

    /// Sets initial velocities of uniform curvature or twist between the rotating ends.
    fn start_rotation(&mut self, [axis, about]: [usize; 2], rate: f64, length: f64, center: Vec3) {
        let (mut along, mut rotation_axis) = (Vec3::zeros(), Vec3::zeros());
        along[axis] = 1.0;
        rotation_axis[about] = 1.0;
        start(self.state, |position, velocity, angular_velocity| {
            let arm = position - center;
            let s = arm[axis].clamp(-0.5 * length, 0.5 * length);
            let rotation = rotation_axis * (rate * s / length);
            // Deflection of uniform curvature; zero in torsion.
            let deflection = rotation_axis.cross(&along) * (0.5 * rate / length * (s * s - 0.25 * length * length));
            *velocity = rotation.cross(&(arm - along * arm[axis])) + deflection;
            *angular_velocity = rotation;
        });
    }

    /// Section of a box or a cylinder along `axis` that rotates about `about`.
    fn section(&self, axis: usize, about: usize) -> Result<Section, AssemblyError> {
        use std::f64::consts::PI;
        match self.scenario.packing.shape() {
            Some(schema::Shape::Box { size, .. }) if axis != about => {
                let height = size[3 - axis - about].si();
                let width = if self.scenario.dimension == 2 { 1.0 } else { size[about].si() };
                // (h/2)/(bh³/12)
                let stress_of_moment = 6.0 / (width * height * height);
                Ok(Section { stress_of_moment, lever: 0.5 * height, area: width * height })
            }
            Some(schema::Shape::Cylinder { radius, .. }) => {
                let r = radius.si();
                // R/(πR⁴/4) in bending, R/(πR⁴/2) in torsion
                let factor = if axis == about { 2.0 } else { 4.0 };
                Ok(Section { stress_of_moment: factor / (PI * r * r * r), lever: r, area: PI * r * r })
            }
            _ => Err(unfit("loading.kind", "the section must be a box or a cylinder".into())),
        }
    }

    /// Particles of the two end layers of a specimen along an axis.
    ///
    /// The default thickness is the reach of a bond from the outermost centers: every cross-section beyond it is crossed by
    /// as many bonds as one deep inside. With thinner layers a specimen breaks too early, at its grips.
    fn end_layers(&self, axis: Axis, thickness: Option<Length>) -> Result<EndLayers, AssemblyError> {
        let thickness = thickness.map_or(self.bond_reach, Quantity::si);
        let particles = &self.state.particles;
        let extents = extents(particles, axis.index());
        let lower = layer(extents.clone(), End::Minimum, thickness);
        let upper = layer(extents.clone(), End::Maximum, thickness);
        if lower.is_empty() || upper.is_empty() || lower.iter().any(|p| upper.contains(p)) {
            let (low, high) = bounds_along(extents);
            let message = format!(
                "end layers of {thickness:.4} m do not fit a specimen {:.4} m long: they are empty or overlap; make the layers one to three \
                 particle diameters thick, or the specimen longer",
                high - low
            );
            return Err(unfit("loading.layer_thickness", message));
        }
        if let Some((id, clump)) = member_of_clump(particles, &lower).or_else(|| member_of_clump(particles, &upper)) {
            let message = format!(
                "an end layer contains particle {id}, which belongs to clump[{clump}] and moves with it; make the layers \
                 thinner, or remove the clump"
            );
            return Err(unfit("loading.layer_thickness", message));
        }
        Ok([lower, upper])
    }

    /// The given area, or the cross-section perpendicular to `axis`, m².
    fn area(&self, axis: usize, given: Option<CrossSection>) -> Result<f64, AssemblyError> {
        Ok(match given {
            Some(CrossSection::Given(area)) => area.si(),
            Some(CrossSection::Hull) => smallest_section(&self.placed.packing.spheres, axis, 8),
            Some(CrossSection::Splitting) => match self.scenario.packing.shape() {
                Some(schema::Shape::Cylinder { radius, height, axis: along, .. }) if along.index() != axis => {
                    let length = if self.scenario.dimension == 2 { 1.0 } else { height.si() };
                    std::f64::consts::PI * radius.si() * length
                }
                _ => {
                    return Err(unfit(
                        "loading.area",
                        "\"splitting\" needs a cylinder that lies across the axis".into(),
                    ));
                }
            },
            None => self.cross_section(axis),
        })
    }

    /// Cross-section perpendicular to `axis`, m²: of the packing's shape, else of the bounding box; of unit depth in two
    /// dimensions.
    fn cross_section(&self, axis: usize) -> f64 {
        let width = |k: usize| {
            let (low, high) = bounds_along(extents(&self.state.particles, k));
            high - low
        };
        if self.scenario.dimension == 2 {
            let across = usize::from(axis == 0);
            return match self.scenario.packing.shape() {
                Some(schema::Shape::Box { size, .. }) => size[across].si(),
                _ => width(across),
            };
        }
        if let Some(area) = self.placed.cross_sections.map(|areas| areas[axis]) {
            return area;
        }
        (0..3).filter(|&k| k != axis).map(width).product()
    }
}

fn indices(layer: Vec<usize>) -> Vec<u32> {
    layer.into_iter().map(|p| p as u32).collect()
}

fn no_cell() -> AssemblyError {
    unfit("loading", "the packing has no periodic cell".into())
}

/// Sets initial velocities: `field` changes velocity and angular velocity at a position. Prescribed components keep their
/// velocity, and a clump starts with the field at its center of mass.
fn start(state: &mut State, field: impl Fn(&Vec3, &mut Vec3, &mut Vec3)) {
    let particles = &mut state.particles;
    for p in 0..particles.len() {
        if particles.clump[p] != u32::MAX {
            continue;
        }
        let (mut velocity, mut angular_velocity) = (particles.velocity[p], particles.angular_velocity[p]);
        field(&particles.position[p], &mut velocity, &mut angular_velocity);
        for i in 0..3 {
            if !particles.constraint[p].translation(i) {
                particles.velocity[p][i] = velocity[i];
            }
            if !particles.constraint[p].rotation(i) {
                particles.angular_velocity[p][i] = angular_velocity[i];
            }
        }
    }
    for clump in &mut state.clumps {
        let (mut velocity, mut angular_velocity) =
            (clump.velocity, clump.angular_velocity(&clump.angular_momentum, &clump.orientation));
        field(&clump.position, &mut velocity, &mut angular_velocity);
        clump.start(velocity, angular_velocity, particles);
    }
}

/// Prescribes the degrees of freedom `constraint` of a particle of an end layer: it moves with `velocity` without rotation.
///
/// # Errors
/// Another motion is already prescribed for the particle.
fn prescribe(
    particles: &mut Particles,
    p: usize,
    constraint: Constraint,
    velocity: &Vec3,
) -> Result<(), AssemblyError> {
    let before = particles.constraint[p];
    for i in 0..3 {
        let moved = constraint.translation(i) && before.translation(i) && particles.velocity[p][i] != velocity[i];
        let rotated = constraint.rotation(i) && before.rotation(i) && particles.angular_velocity[p][i] != 0.0;
        if moved || rotated {
            return Err(prescribed_twice(particles, p));
        }
        if constraint.translation(i) {
            particles.velocity[p][i] = velocity[i];
        }
        if constraint.rotation(i) {
            particles.angular_velocity[p][i] = 0.0;
        }
    }
    particles.constraint[p] = before.with(constraint);
    Ok(())
}

/// Error for a particle in an end layer that already has another prescribed motion.
fn prescribed_twice(particles: &Particles, p: usize) -> AssemblyError {
    let message = format!(
        "an end layer moves particle {}, for which [[prescribe]] gives another motion; exclude the particles of the layers \
         from its set, or make the layers thinner",
        particles.id[p]
    );
    unfit("loading.layer_thickness", message)
}
