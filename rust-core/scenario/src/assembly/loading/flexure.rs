//! Supports and rollers of a beam.

use super::{Builder, prescribe};
use crate::assembly::selection::{bounds_along, extents, member_of_clump};
use crate::assembly::{AssemblyError, material_index, unfit};
use crate::schedule::{Bearings, Flexure, Loading};
use crate::schema::quantity::CrossSection;
use crate::schema::{self, Quantity};
use concordem_contact::math::Vec3;
use concordem_solver::state::surface::Cylinder;
use concordem_solver::state::{Constraint, Particles, Wall, WallShape};

/// A support (side −1) or a roller (side 1) at a coordinate along the beam, m.
struct Bearing {
    name: &'static str,
    at: f64,
    side: f64,
}

impl Builder<'_> {
    /// Two supports, and one or two rollers on the other side of a beam.
    pub(super) fn flexure(&mut self) -> Result<Loading, AssemblyError> {
        let scenario = self.scenario;
        let schema::Loading::Flexure {
            axis,
            across,
            span,
            inner_span,
            strip_width,
            roller_radius,
            closing_velocity,
            material,
            opening: _,
        } = &scenario.loading
        else {
            return Err(unfit("loading.kind", "is not \"flexure\"".into()));
        };
        let Some(schema::Shape::Box { size, .. }) = scenario.packing.shape() else {
            return Err(unfit("loading.kind", "the beam must be a box".into()));
        };
        let across = schema::Loading::direction_across(*axis, *across, scenario.dimension);
        let (axis, span, inner_span, speed) = (axis.index(), span.si(), inner_span.si(), closing_velocity.si());
        let third = 3 - axis - across;
        let (height, width) = (size[across].si(), if scenario.dimension == 2 { 1.0 } else { size[third].si() });
        let (low, high) = bounds_along(extents(&self.state.particles, axis));
        let at = |offset: f64| 0.5 * (low + high) + 0.5 * offset;
        let mut bearings = vec![
            Bearing { name: "first support", at: at(-span), side: -1.0 },
            Bearing { name: "second support", at: at(span), side: -1.0 },
        ];
        if inner_span > 0.0 {
            bearings.push(Bearing { name: "first roller", at: at(-inner_span), side: 1.0 });
            bearings.push(Bearing { name: "second roller", at: at(inner_span), side: 1.0 });
        } else {
            bearings.push(Bearing { name: "roller", at: at(0.0), side: 1.0 });
        }
        let bearings = match (roller_radius, strip_width) {
            (Some(radius), _) => {
                let material = material.as_deref().map_or(0, |name| material_index(scenario, name));
                self.rollers([axis, across], &bearings, radius.si(), material, speed)?
            }
            (None, width) => self.strips([axis, across], &bearings, width.map_or(0.0, Quantity::si), speed)?,
        };
        let arm = 0.5 * (span - inner_span);
        Ok(Loading::Flexure(Flexure {
            across,
            bearings,
            speed,
            // M = P a/2, and W = b h²/6.
            stress_of_force: 3.0 * arm / (width * height * height),
            strain_of_deflection: 3.0 * height / (arm * (3.0 * span - 4.0 * arm)),
            area: width * height,
            span,
        }))
    }

    /// Two strips of particles, `width` (m) wide, that press on a cylinder along `axis` and split it: the lower one is held, the upper one moves. The
    /// stress is the tension in the middle of an elastic cylinder under two lines of force.
    pub(super) fn splitting_strips(&mut self, axis: usize, width: f64, speed: f64) -> Result<Loading, AssemblyError> {
        let Some(schema::Shape::Cylinder { axis: along, .. }) = self.scenario.packing.shape() else {
            return Err(unfit("loading.strip_width", "the strips must press on a cylinder".into()));
        };
        let aside = 3 - axis - along.index();
        let area = self.area(axis, Some(CrossSection::Splitting))?;
        let middle = |k: usize| bounds_along(extents(&self.state.particles, k));
        let (low, high) = middle(aside);
        let at = 0.5 * (low + high);
        let (low, high) = middle(axis);
        let length = high - low;
        let bearings =
            [Bearing { name: "lower plate", at, side: -1.0 }, Bearing { name: "upper plate", at, side: 1.0 }];
        let bearings = self.strips([aside, axis], &bearings, width, speed)?;
        Ok(Loading::Flexure(Flexure {
            across: axis,
            bearings,
            speed,
            stress_of_force: 1.0 / area,
            strain_of_deflection: -1.0 / length,
            area,
            span: length,
        }))
    }

    /// Cylindrical walls, each of which touches its nearest particle.
    fn rollers(
        &mut self,
        [axis, across]: [usize; 2],
        bearings: &[Bearing],
        radius: f64,
        material: u16,
        speed: f64,
    ) -> Result<Bearings, AssemblyError> {
        let first = self.state.walls.len();
        let mut direction = Vec3::zeros();
        direction[3 - axis - across] = 1.0;
        for bearing in bearings {
            let mut point = Vec3::zeros();
            point[axis] = bearing.at;
            point[across] = touching(&self.state.particles, [axis, across], bearing, radius).ok_or_else(|| {
                unfit("loading.span", format!("no particle lies above or below the {}; shorten the span", bearing.name))
            })?;
            let mut velocity = Vec3::zeros();
            velocity[across] = if bearing.side > 0.0 { -speed } else { 0.0 };
            let shape = WallShape::rigid(Cylinder { point, axis: direction, radius, inside: false });
            self.state.walls.push(Wall::new(bearing.name, shape, material, velocity));
        }
        Ok(Bearings::Rollers { first, rollers: bearings.len() - 2 })
    }

    /// Strips of particles on the surface, `width` (m) wide, and one radius of the largest particle deep.
    fn strips(
        &mut self,
        [axis, across]: [usize; 2],
        bearings: &[Bearing],
        width: f64,
        speed: f64,
    ) -> Result<Bearings, AssemblyError> {
        let particles = &self.state.particles;
        let (low, high) = bounds_along(extents(particles, across));
        let depth = particles.radius.iter().copied().fold(0.0, f64::max);
        let (mut held, mut moved) = (Vec::new(), Vec::new());
        for bearing in bearings {
            let is_in = |p: usize| {
                let (x, r) = (&particles.position[p], particles.radius[p]);
                let inside =
                    if bearing.side > 0.0 { x[across] + r >= high - depth } else { x[across] - r <= low + depth };
                inside && (x[axis] - bearing.at).abs() <= 0.5 * width
            };
            let strip: Vec<usize> = (0..particles.len()).filter(|&p| is_in(p)).collect();
            if strip.is_empty() {
                let message =
                    format!("the strip of the {} has no particle; widen it, or shorten the span", bearing.name);
                return Err(unfit("loading.strip_width", message));
            }
            if let Some((id, clump)) = member_of_clump(particles, &strip) {
                let message = format!(
                    "the strip of the {} contains particle {id}, which belongs to clump[{clump}] and moves with it; make the strip \
                     narrower, or remove the clump",
                    bearing.name
                );
                return Err(unfit("loading.strip_width", message));
            }
            let list = if bearing.side > 0.0 { &mut moved } else { &mut held };
            list.extend(strip.into_iter().map(|p| p as u32));
        }
        let constraint = Constraint::translation_along(across);
        for (strip, speed) in [(&held, 0.0), (&moved, -speed)] {
            let mut velocity = Vec3::zeros();
            velocity[across] = speed;
            for &p in strip {
                prescribe(&mut self.state.particles, p as usize, constraint, &velocity)?;
            }
        }
        let start =
            moved.iter().map(|&p| self.state.particles.position[p as usize][across]).sum::<f64>() / moved.len() as f64;
        Ok(Bearings::Strips { held, moved, start })
    }
}

/// Coordinate along the second one of `axes` at which the axis of a cylinder lies that touches its first particle, m.
fn touching(particles: &Particles, [axis, across]: [usize; 2], bearing: &Bearing, radius: f64) -> Option<f64> {
    let over = |p: usize| {
        let (x, r) = (&particles.position[p], radius + particles.radius[p]);
        let aside = x[axis] - bearing.at;
        (aside.abs() < r).then(|| bearing.side * x[across] + (r * r - aside * aside).sqrt())
    };
    (0..particles.len()).filter_map(over).reduce(f64::max).map(|reach| bearing.side * reach)
}
