//! Random places without overlap.

use super::{Field, Form, Inclusion, Region, apart};
use crate::{PackingError, Random};
use concordem_contact::math::{Mat3, Vec3, sin_cos};
use std::f64::consts::TAU;

/// Rules of the placing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Smallest distance of two inclusions, divided by the mean of their sizes. 0.05 in Stránský 2018.
    pub clearance: f64,
    /// Smallest distance of two inclusions, m.
    pub gap: f64,
    /// Smallest distance from the surface of the mould, m.
    pub wall_gap: f64,
    /// Places tried for each inclusion. 1000 in Stránský 2018.
    pub attempts: u32,
}

impl Default for Placement {
    fn default() -> Self {
        Self { clearance: 0.05, gap: 0.0, wall_gap: 0.0, attempts: 10_000 }
    }
}

/// A body to place.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// Shape.
    pub form: Form,
    /// Size, m.
    pub size: f64,
    /// Number of the group that it belongs to.
    pub group: usize,
}

/// Puts each body at a random place with a random orientation, uniform in the region among the places where it does not come
/// too near to the bodies placed before: random sequential addition, from the largest to the smallest. `fixed` are in place from
/// the start, wherever they are.
///
/// # Errors
/// Rules that are negative or not finite; [`PackingError::NoPlace`] if no place is found for a body.
pub fn place(
    region: Region,
    mut requests: Vec<Request>,
    fixed: &[Inclusion],
    placement: &Placement,
    random: &mut Random,
) -> Result<Field, PackingError> {
    for (name, value) in [
        ("the clearance of the aggregates", placement.clearance),
        ("the gap between aggregates", placement.gap),
        ("the gap between aggregates and mould", placement.wall_gap),
    ] {
        crate::within(name, value, 0.0, f64::MAX)?;
    }
    // A stable sort: bodies of equal size stay in the order of their groups.
    requests.sort_by(|a, b| b.size.total_cmp(&a.size));
    let planar = region.planar;
    let count = requests.len();
    let wanted: f64 =
        requests.iter().map(|one| one.form.measure(planar) * power(one.size, planar)).sum::<f64>() / region.volume();
    let mut field = Field::new(region, count + fixed.len());
    for inclusion in fixed {
        field.add(inclusion.clone());
    }
    let images = field.images();
    let largest =
        requests.first().map_or(0.0, |one| one.size).max(fixed.iter().map(|one| one.size).fold(0.0, f64::max));
    let mut placed = 0.0;
    for (number, Request { form, size, group }) in requests.into_iter().enumerate() {
        let gap = |other: f64| placement.gap.max(0.5 * placement.clearance * (size + other));
        let mut inclusion = Inclusion { form, size, group, center: Vec3::zeros(), rotation: Mat3::identity() };
        let mut attempts = 0;
        loop {
            if attempts == placement.attempts {
                return Err(PackingError::NoPlace { number, count, size, attempts, reached: placed, wanted });
            }
            attempts += 1;
            if !matches!(inclusion.form, Form::Sphere) {
                inclusion.rotation = rotation(random, planar);
            }
            let relative = random.uniform_vector();
            if !field.region().put(&mut inclusion, &relative, placement.wall_gap) {
                continue;
            }
            let near = |other: &Inclusion, shift: &Vec3| !apart(&inclusion, other, shift, gap(other.size));
            let free = field.is_free(&inclusion, gap(largest), &near)
                && images.iter().all(|shift| apart(&inclusion, &inclusion, shift, gap(size)));
            if free {
                placed += inclusion.measure(planar) / field.region().volume();
                field.add(inclusion);
                break;
            }
        }
    }
    Ok(field)
}

fn power(size: f64, planar: bool) -> f64 {
    if planar { size * size } else { size * size * size }
}

/// A random rotation, uniform over all rotations (Shoemake 1992, Graphics Gems III, 124); in the plane, about z.
fn rotation(random: &mut Random, planar: bool) -> Mat3 {
    if planar {
        let (sine, cosine) = sin_cos(TAU * random.uniform());
        return Mat3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0);
    }
    let [u, v, w] = random.uniform_vector().into();
    let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
    let ((s1, c1), (s2, c2)) = (sin_cos(TAU * v), sin_cos(TAU * w));
    let (x, y, z, q) = (a * s1, a * c1, b * s2, b * c2);
    Mat3::new(
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - z * q),
        2.0 * (x * z + y * q),
        2.0 * (x * y + z * q),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - x * q),
        2.0 * (x * z - y * q),
        2.0 * (y * z + x * q),
        1.0 - 2.0 * (x * x + y * y),
    )
}
