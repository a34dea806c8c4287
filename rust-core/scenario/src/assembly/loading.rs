//! Loading of a scenario: layers, plates, cell; sets initial velocities and constraints.

use super::{AssemblyError, bounds_along, layer, material_index, member_of_clump, place::Placed, unfit};
use crate::schedule::Loading;
use crate::schedule::loading::Gauge;
use crate::schema::{self, End, Lateral, Scenario};
use concordem_contact::math::{Mat3, Vec3};
use concordem_solver::state::{Constraint, Particles, State, Wall, WallShape};

/// The loading of a scenario whose bonds reach as far as `interaction_ratio` says.
pub(super) fn build(
    scenario: &Scenario,
    placed: &Placed,
    interaction_ratio: f64,
    state: &mut State,
) -> Result<Loading, AssemblyError> {
    let bond_reach = (1.0 + 2.0 * interaction_ratio) * state.particles.radius.iter().copied().fold(0.0, f64::max);
    let thickness_of = |given: &Option<schema::quantity::Length>| given.map_or(bond_reach, schema::Quantity::si);
    match &scenario.loading {
        schema::Loading::None => Ok(Loading::None),
        schema::Loading::Uniaxial { axis, strain_rate, layer_thickness, lateral, initial_velocity_field, area } => {
            let axis = axis.index();
            let [lower, upper] = end_layers(state, axis, thickness_of(layer_thickness))?;
            let particles = &state.particles;
            let mean =
                |layer: &[usize]| layer.iter().map(|&p| particles.position[p][axis]).sum::<f64>() / layer.len() as f64;
            let (bottom, top) = (mean(&lower), mean(&upper));
            let length = top - bottom;
            let area = area.map_or_else(|| cross_section(scenario, state, placed, axis), schema::Quantity::si);
            let rate = strain_rate.si();
            let middle = 0.5 * (bottom + top);
            let half = 0.5 * rate * length;
            if *initial_velocity_field {
                start(state, |place, velocity, _| {
                    velocity[axis] = (rate * (place[axis] - middle)).clamp(-half.abs(), half.abs());
                });
            }
            let constraint = match lateral {
                Lateral::Free => Constraint::translation_along(axis),
                Lateral::Fixed => Constraint::ALL,
            };
            for (layer, speed) in [(&lower, -half), (&upper, half)] {
                let mut velocity = Vec3::zeros();
                velocity[axis] = speed;
                for &p in layer {
                    hold(&mut state.particles, p, constraint, &velocity)?;
                }
            }
            let indices = |layer: Vec<usize>| layer.into_iter().map(|p| p as u32).collect();
            let gauge = Gauge::new(state, axis, bottom, top);
            Ok(Loading::Uniaxial { axis, layers: [indices(lower), indices(upper)], length, area, gauge })
        }
        schema::Loading::Bending { axis, about, rate, layer_thickness, initial_velocity_field } => {
            let thickness = thickness_of(layer_thickness);
            turning(scenario, state, [axis.index(), about.index()], rate.si(), thickness, *initial_velocity_field)
        }
        schema::Loading::Torsion { axis, rate, layer_thickness, initial_velocity_field } => {
            let thickness = thickness_of(layer_thickness);
            turning(scenario, state, [axis.index(); 2], rate.si(), thickness, *initial_velocity_field)
        }
        schema::Loading::CellStrain { velocity_gradient } => {
            let gradient = Mat3::from_fn(|i, j| velocity_gradient[i][j].si());
            let cell =
                state.cell.as_mut().ok_or_else(|| unfit("loading", "the packing has no periodic cell".into()))?;
            cell.velocity_gradient = gradient;
            let initial_volume = cell.volume();
            start(state, |place, velocity, _| *velocity = gradient * place);
            Ok(Loading::CellStrain { initial_volume })
        }
        schema::Loading::CellStress { stress, maximum_strain_rate, tolerance } => {
            let stress = Mat3::from_fn(|i, j| stress[i][j].si());
            let cell = state.cell.ok_or_else(|| unfit("loading", "the packing has no periodic cell".into()))?;
            let size = stress.abs().max();
            let rate = maximum_strain_rate.si();
            // The full rate while the error is a tenth of the wanted stress or more (of 1 Pa for a zero stress).
            let gain = rate / (0.1 * size.max(1.0));
            let _ = cell;
            Ok(Loading::CellStress { stress, maximum_rate: rate, gain, tolerance: tolerance.si() })
        }
        schema::Loading::Platens { axis, closing_velocity, material, area } => {
            let axis = axis.index();
            let particles = &state.particles;
            let (low, high) =
                bounds_along(particles.position.iter().zip(&particles.radius).map(|(x, r)| (x[axis], *r)));
            let area = area.map_or_else(|| cross_section(scenario, state, placed, axis), schema::Quantity::si);
            let first = state.walls.len();
            for (name, at, sign) in [("lower platen", low, 1.0), ("upper platen", high, -1.0)] {
                let mut normal = Vec3::zeros();
                normal[axis] = sign;
                let mut point = Vec3::zeros();
                point[axis] = at;
                state.walls.push(Wall {
                    name: name.into(),
                    shape: WallShape::Plane { point, normal },
                    material: material_index(scenario, material),
                    displacement: Vec3::zeros(),
                    velocity: normal * (0.5 * closing_velocity.si()),
                    force: Vec3::zeros(),
                    torque: Vec3::zeros(),
                });
            }
            let gauge = Gauge::new(state, axis, low, high);
            Ok(Loading::Platens { axis, walls: [first, first + 1], length: high - low, area, gauge })
        }
    }
}

/// Give the specimen the velocities that `field` has at each place, from the place, the velocity, and the angular
/// velocity there. What is prescribed stays, and a clump starts as its centre of mass.
fn start(state: &mut State, field: impl Fn(&Vec3, &mut Vec3, &mut Vec3)) {
    let particles = &mut state.particles;
    for p in 0..particles.len() {
        if particles.clump[p] != u32::MAX {
            continue;
        }
        let (mut velocity, mut spin) = (particles.velocity[p], particles.angular_velocity[p]);
        field(&particles.position[p], &mut velocity, &mut spin);
        for i in 0..3 {
            if !particles.constraint[p].translation(i) {
                particles.velocity[p][i] = velocity[i];
            }
            if !particles.constraint[p].rotation(i) {
                particles.angular_velocity[p][i] = spin[i];
            }
        }
    }
    for clump in &mut state.clumps {
        let (mut velocity, mut spin) =
            (clump.velocity, clump.angular_velocity(&clump.angular_momentum, &clump.orientation));
        field(&clump.position, &mut velocity, &mut spin);
        clump.start(velocity, spin, particles);
    }
}

/// Let a layer hold the degrees of freedom `constraint` of one of its particles, which moves with `velocity` and does not
/// turn.
///
/// # Errors
/// Something else is prescribed to it.
fn hold(particles: &mut Particles, p: usize, constraint: Constraint, velocity: &Vec3) -> Result<(), AssemblyError> {
    let before = particles.constraint[p];
    for i in 0..3 {
        let moved = constraint.translation(i) && before.translation(i) && particles.velocity[p][i] != velocity[i];
        let turned = constraint.rotation(i) && before.rotation(i) && particles.angular_velocity[p][i] != 0.0;
        if moved || turned {
            return Err(twice_moved(particles, p));
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

/// A particle of an end layer has another motion prescribed.
fn twice_moved(particles: &Particles, p: usize) -> AssemblyError {
    let message = format!(
        "an end layer moves particle {}, to which [[prescribe]] gives another motion; take the particles of the layers out \
         of its set, or make the layers thinner",
        particles.id[p]
    );
    unfit("loading.layer_thickness", message)
}

/// Particles of the two end layers of a specimen along `axis`.
///
/// Behind the default depth every cross-section is crossed by as many bonds as deep inside: one bond's reach, from the
/// outermost centres. With thinner layers a specimen breaks at its grips, too early.
fn end_layers(state: &State, axis: usize, thickness: f64) -> Result<[Vec<usize>; 2], AssemblyError> {
    let particles = &state.particles;
    let extents = || particles.position.iter().zip(&particles.radius).map(|(x, r)| (x[axis], *r));
    let lower = layer(extents(), End::Minimum, thickness);
    let upper = layer(extents(), End::Maximum, thickness);
    if lower.is_empty() || upper.is_empty() || lower.iter().any(|p| upper.contains(p)) {
        let (low, high) = bounds_along(extents());
        let message = format!(
            "end layers of {thickness} m do not fit a specimen {} m long: they are empty or overlap",
            high - low
        );
        return Err(unfit("loading.layer_thickness", message));
    }
    if let Some((id, clump)) = member_of_clump(particles, &lower).or_else(|| member_of_clump(particles, &upper)) {
        let message = format!(
            "an end layer has particle {id}, which is of clump[{clump}] and moves with it; make the layers thinner, or \
             remove the clump"
        );
        return Err(unfit("loading.layer_thickness", message));
    }
    Ok([lower, upper])
}

/// End layers that turn against each other at `rate` (rad/s); `axes`: of the specimen, and about which they turn.
fn turning(
    scenario: &Scenario,
    state: &mut State,
    axes: [usize; 2],
    rate: f64,
    thickness: f64,
    initial_field: bool,
) -> Result<Loading, AssemblyError> {
    use std::f64::consts::PI;
    let [axis, about] = axes;
    let (stress_of_moment, lever, area) = match scenario.packing.shape() {
        Some(schema::Shape::Box { size }) if axis != about => {
            let height = size[3 - axis - about].si();
            let width = if scenario.dimension == 2 { 1.0 } else { size[about].si() };
            // (h/2)/(bh³/12)
            (6.0 / (width * height * height), 0.5 * height, width * height)
        }
        Some(schema::Shape::Cylinder { radius, .. }) => {
            let r = radius.si();
            // R/(πR⁴/4) in bending, R/(πR⁴/2) in torsion
            let factor = if axis == about { 2.0 } else { 4.0 };
            (factor / (PI * r * r * r), r, PI * r * r)
        }
        _ => return Err(unfit("loading.kind", "the section must be a box or a cylinder".into())),
    };
    let layers = end_layers(state, axis, thickness)?;
    let particles = &state.particles;
    let middle = |layer: &Vec<usize>| layer.iter().map(|&p| particles.position[p]).sum::<Vec3>() / layer.len() as f64;
    let centres = [middle(&layers[0]), middle(&layers[1])];
    let length = centres[1][axis] - centres[0][axis];
    let centre = (centres[0] + centres[1]) * 0.5;
    let (mut along, mut spin_axis) = (Vec3::zeros(), Vec3::zeros());
    along[axis] = 1.0;
    spin_axis[about] = 1.0;
    if initial_field {
        start(state, |place, velocity, angular_velocity| {
            let arm = place - centre;
            let along_it = arm[axis].clamp(-0.5 * length, 0.5 * length);
            let spin = spin_axis * (rate * along_it / length);
            // Deflection of even curvature; none in torsion.
            let sag = spin_axis.cross(&along) * (0.5 * rate / length * (along_it * along_it - 0.25 * length * length));
            *velocity = spin.cross(&(arm - along * arm[axis])) + sag;
            *angular_velocity = spin;
        });
    }
    for &p in layers.iter().flatten() {
        let particles = &mut state.particles;
        let before = particles.constraint[p];
        // Layers turn about `about` and move across it and along the specimen: they may be told not to do anything else.
        let twice = (0..3).any(|i| {
            let moves = i != about || about == axis || particles.velocity[p][i] != 0.0;
            let turns = i == about || particles.angular_velocity[p][i] != 0.0;
            before.translation(i) && moves || before.rotation(i) && turns
        });
        if twice {
            return Err(twice_moved(particles, p));
        }
        particles.constraint[p] = Constraint::ALL;
    }
    let layers = layers.map(|layer| layer.into_iter().map(|p| p as u32).collect());
    Ok(Loading::Turning { axis, about, layers, rate, length, stress_of_moment, lever, area })
}

/// Cross-section perpendicular to `axis`, m²: of the packing's shape, else of the bounding box; of unit depth in two
/// dimensions.
fn cross_section(scenario: &Scenario, state: &State, placed: &Placed, axis: usize) -> f64 {
    if scenario.dimension == 2 {
        let across = usize::from(axis == 0);
        if let Some(schema::Shape::Box { size }) = scenario.packing.shape() {
            return size[across].si();
        }
        let particles = &state.particles;
        let (low, high) = bounds_along(particles.position.iter().zip(&particles.radius).map(|(x, r)| (x[across], *r)));
        return high - low;
    }
    if let Some(area) = placed.cross_sections.map(|areas| areas[axis]) {
        return area;
    }
    let particles = &state.particles;
    let extent = |k: usize| {
        let (low, high) = bounds_along(particles.position.iter().zip(&particles.radius).map(|(x, r)| (x[k], *r)));
        high - low
    };
    (0..3).filter(|&k| k != axis).map(extent).product()
}
