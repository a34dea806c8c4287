//! Volume of a region, and whether it contains points and parts of segments.

use super::Region;
use crate::OperatorError;
use crate::error::check_volume;
use concordem_contact::math::{Mat3, Vec3};

impl Region {
    /// Volume, m³ (per unit depth for regions that are infinite in one direction).
    ///
    /// # Errors
    /// A region without a valid shape or volume.
    pub fn volume(&self) -> Result<f64, OperatorError> {
        use std::f64::consts::PI;
        let positive = |kind, name, value: f64| {
            if value > 0.0 {
                Ok(value)
            } else {
                Err(OperatorError::Region { kind, name, value, demand: "it must be positive" })
            }
        };
        let finite = |kind, name, point: &Vec3| match point.iter().find(|x| !x.is_finite()) {
            Some(&value) => Err(OperatorError::Region { kind, name, value, demand: "it must be finite" }),
            None => Ok(()),
        };
        let volume = match self {
            Self::All { volume } | Self::Particles { volume, .. } => *volume,
            Self::HalfSpaces { planes, volume } => {
                if let Some(plane) = planes.iter().find(|plane| plane.normal.norm_squared() == 0.0) {
                    positive("half-space", "length of its normal", plane.normal.norm())?;
                }
                for plane in planes {
                    finite("half-space", "component of its normal", &plane.normal)?;
                    finite("half-space", "coordinate of its point", &plane.point)?;
                }
                *volume
            }
            Self::Box { low, high } => {
                let mut volume = 1.0;
                for k in 0..3 {
                    let side = positive("box", ["side along x", "side along y", "side along z"][k], high[k] - low[k])?;
                    volume *= if side.is_infinite() { 1.0 } else { side };
                }
                volume
            }
            Self::Sphere { center, radius } => {
                finite("sphere", "coordinate of its center", center)?;
                let r = positive("sphere", "radius", *radius)?;
                4.0 / 3.0 * PI * (r * r * r)
            }
            Self::Cylinder { center, axis, radius, half_length } => {
                finite("cylinder", "coordinate of its center", center)?;
                let r = positive("cylinder", "radius", *radius)?;
                let h = positive("cylinder", "half length", *half_length)?;
                // The tolerance accepts a unit vector whose components are rounded to 1e-6.
                if axis.norm().is_nan() || (axis.norm() - 1.0).abs() > 1e-6 {
                    let (name, value) = ("length of its axis", axis.norm());
                    return Err(OperatorError::Region { kind: "cylinder", name, value, demand: "it must be 1" });
                }
                PI * (r * r) * if h.is_infinite() { 1.0 } else { 2.0 * h }
            }
            Self::Ellipsoid { center, axes } => {
                finite("ellipsoid", "coordinate of its center", center)?;
                4.0 / 3.0 * PI * positive("ellipsoid", "determinant of its axes", axes.determinant().abs())?
            }
            Self::Parallelepiped { corner, edges } => {
                finite("parallelepiped", "coordinate of its corner", corner)?;
                positive("parallelepiped", "determinant of its edges", edges.determinant().abs())?
            }
        };
        check_volume("the region", volume)
    }

    /// Whether the particle `p` at `x` (m) belongs to the region.
    #[inline]
    pub fn contains(&self, p: usize, x: &Vec3) -> bool {
        match self {
            Self::All { .. } => true,
            Self::Box { low, high } => (0..3).all(|k| low[k] <= x[k] && x[k] < high[k]),
            Self::Sphere { center, radius } => (x - center).norm_squared() < radius * radius,
            Self::Cylinder { center, axis, radius, half_length } => {
                let r = x - center;
                let along = r.dot(axis);
                along.abs() < *half_length && (r - axis * along).norm_squared() < radius * radius
            }
            Self::Ellipsoid { center, axes } => {
                axes.try_inverse().is_some_and(|inverse| (inverse * (x - center)).norm_squared() < 1.0)
            }
            Self::Parallelepiped { corner, edges } => edges.try_inverse().is_some_and(|inverse| {
                let s = inverse * (x - corner);
                (0..3).all(|k| (0.0..1.0).contains(&s[k]))
            }),
            Self::HalfSpaces { planes, .. } => planes.iter().all(|plane| (x - plane.point).dot(&plane.normal) < 0.0),
            Self::Particles { member, .. } => member.get(p).copied().unwrap_or(false),
        }
    }

    /// Fraction of the segment from `x` to `x + l` inside the region, 0 to 1.
    pub fn fraction_of_segment(&self, x: &Vec3, l: &Vec3) -> f64 {
        self.part_of_segment(x, l).map_or(0.0, |[from, to]| to - from)
    }

    /// The part of the segment from `x` to `x + l` inside the region, as an interval of fractions of its length. There
    /// is one part, because all regions with a shape are convex.
    pub(crate) fn part_of_segment(&self, x: &Vec3, l: &Vec3) -> Option<[f64; 2]> {
        let mut range = [0.0_f64, 1.0];
        match self {
            Self::All { .. } | Self::Particles { .. } => {}
            Self::Box { low, high } => {
                for k in 0..3 {
                    cut_slab(&mut range, x[k], l[k], low[k], high[k]);
                }
            }
            Self::Sphere { center, radius } => cut_ball(&mut range, &(x - center), l, *radius),
            Self::Cylinder { center, axis, radius, half_length } => {
                let r = x - center;
                let (along, rate) = (r.dot(axis), l.dot(axis));
                cut_slab(&mut range, along, rate, -half_length, *half_length);
                cut_ball(&mut range, &(r - axis * along), &(l - axis * rate), *radius);
            }
            Self::Ellipsoid { center, axes } => {
                let inverse = axes.try_inverse().unwrap_or_else(Mat3::zeros);
                cut_ball(&mut range, &(inverse * (x - center)), &(inverse * l), 1.0);
            }
            Self::Parallelepiped { corner, edges } => {
                let inverse = edges.try_inverse().unwrap_or_else(Mat3::zeros);
                let (s, t) = (inverse * (x - corner), inverse * l);
                for k in 0..3 {
                    cut_slab(&mut range, s[k], t[k], 0.0, 1.0);
                }
            }
            Self::HalfSpaces { planes, .. } => {
                for plane in planes {
                    cut_slab(
                        &mut range,
                        (x - plane.point).dot(&plane.normal),
                        l.dot(&plane.normal),
                        f64::NEG_INFINITY,
                        0.0,
                    );
                }
            }
        }
        (range[1] > range[0]).then_some(range)
    }

    /// Center of the region, m; `None` if it has none.
    pub fn center(&self) -> Option<Vec3> {
        match self {
            Self::All { .. } | Self::Particles { .. } | Self::HalfSpaces { .. } => None,
            Self::Box { low, high } => {
                // The center of an infinite side is the plane z = 0.
                let middle = (low + high) * 0.5;
                Some(middle.map(|m| if m.is_nan() { 0.0 } else { m }))
            }
            Self::Sphere { center, .. } | Self::Cylinder { center, .. } | Self::Ellipsoid { center, .. } => {
                Some(*center)
            }
            Self::Parallelepiped { corner, edges } => Some(corner + edges * Vec3::repeat(0.5)),
        }
    }

    /// Bounding box of the region; `None` if it is infinite or has no shape.
    pub(super) fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let around = |center: &Vec3, half: Vec3| Some((center - half, center + half));
        match self {
            Self::All { .. } | Self::Particles { .. } | Self::HalfSpaces { .. } => None,
            Self::Box { low, high } => Some((*low, *high)),
            Self::Sphere { center, radius } => around(center, Vec3::repeat(*radius)),
            Self::Cylinder { center, axis, radius, half_length } => {
                // Infinite like a disc: finite across the axis.
                let along = axis.map(|a| if a == 0.0 { 0.0 } else { a.abs() * *half_length });
                around(center, along + Vec3::repeat(*radius))
            }
            Self::Ellipsoid { center, axes } => around(center, Vec3::from_fn(|i, _| axes.row(i).norm())),
            Self::Parallelepiped { corner, edges } => {
                let low = Vec3::from_fn(|i, _| edges.row(i).iter().map(|e| e.min(0.0)).sum());
                let high = Vec3::from_fn(|i, _| edges.row(i).iter().map(|e| e.max(0.0)).sum());
                Some((corner + low, corner + high))
            }
        }
    }

    /// Lower bound of the distance from `x` to the border, m: positive inside, negative outside, zero if unknown.
    #[inline(always)]
    pub(crate) fn depth(&self, x: &Vec3) -> f64 {
        match self {
            Self::All { .. } => f64::INFINITY,
            Self::Particles { .. } => 0.0,
            Self::Box { low, high } => {
                let side = |k: usize| (x[k] - low[k]).min(high[k] - x[k]);
                side(0).min(side(1)).min(side(2))
            }
            Self::Sphere { center, radius } => radius - (x - center).norm(),
            Self::Cylinder { center, axis, radius, half_length } => {
                let r = x - center;
                let along = r.dot(axis);
                (radius - (r - axis * along).norm()).min(half_length - along.abs())
            }
            Self::Ellipsoid { center, axes } => {
                // The inverse shrinks lengths at most by its norm.
                let inverse = axes.try_inverse().unwrap_or_else(Mat3::zeros);
                (1.0 - (inverse * (x - center)).norm()) / inverse.norm()
            }
            Self::Parallelepiped { corner, edges } => {
                let inverse = edges.try_inverse().unwrap_or_else(Mat3::zeros);
                let s = inverse * (x - corner);
                let side = |k: usize| s[k].min(1.0 - s[k]) / inverse.row(k).norm();
                side(0).min(side(1)).min(side(2))
            }
            Self::HalfSpaces { planes, .. } => planes
                .iter()
                .map(|plane| (plane.point - x).dot(&plane.normal) / plane.normal.norm())
                .fold(f64::INFINITY, f64::min),
        }
    }
}

/// The part of `range` (in units of `l`) for which `low ≤ x + s l < high`.
fn cut_slab(range: &mut [f64; 2], x: f64, l: f64, low: f64, high: f64) {
    if l == 0.0 {
        if !(low <= x && x < high) {
            range[1] = range[0];
        }
        return;
    }
    let (a, b) = ((low - x) / l, (high - x) / l);
    range[0] = range[0].max(a.min(b));
    range[1] = range[1].min(a.max(b)).max(range[0]);
}

/// The part of `range` (in units of `l`) for which `|x + s l| < radius`.
fn cut_ball(range: &mut [f64; 2], x: &Vec3, l: &Vec3, radius: f64) {
    let (a, b, c) = (l.norm_squared(), x.dot(l), x.norm_squared() - radius * radius);
    let discriminant = b * b - a * c;
    if a == 0.0 {
        if c >= 0.0 {
            range[1] = range[0];
        }
    } else if discriminant <= 0.0 {
        range[1] = range[0];
    } else {
        // Compute the root without cancellation first, and the other from the product of both.
        let q = -(b + discriminant.sqrt().copysign(b));
        let (first, second) = (q / a, c / q);
        range[0] = range[0].max(first.min(second));
        range[1] = range[1].min(first.max(second)).max(range[0]);
    }
}
