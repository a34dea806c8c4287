//! Straight fibers as chains of touching spheres: random places without overlap, between aggregates.

use crate::aggregates::{Field, Form, Inclusion, Region, apart};
use crate::{PackingError, Random};
use concordem_contact::math::{Mat3, Vec3, sin_cos};
use std::f64::consts::{PI, TAU};

/// A straight fiber: a cylinder with round ends, seen as a chain of spheres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fiber {
    /// Middle, m.
    pub middle: Vec3,
    /// Unit vector along the fiber.
    pub direction: Vec3,
    /// Length from end to end, m.
    pub length: f64,
    /// Diameter, m.
    pub diameter: f64,
    /// Number of the group that it belongs to.
    pub group: usize,
}

/// A fiber to place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FiberRequest {
    /// Length from end to end, m.
    pub length: f64,
    /// Diameter, m.
    pub diameter: f64,
    /// Direction; `None`: random, uniform over all directions.
    pub direction: Option<Vec3>,
    /// Number of the group that it belongs to.
    pub group: usize,
}

/// Rules of the placing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FiberPlacement {
    /// Smallest distance of a fiber from other fibers and from aggregates, m.
    pub gap: f64,
    /// Smallest distance from the surface of the mould, m.
    pub wall_gap: f64,
    /// Places tried for each fiber.
    pub attempts: u32,
}

/// Number of spheres of a fiber: as many as fit without overlap.
///
/// # Errors
/// A fiber shorter than two spheres.
pub fn sphere_count(length: f64, diameter: f64) -> Result<usize, PackingError> {
    crate::positive("the diameter of a fiber", diameter)?;
    crate::positive("the length of a fiber", length)?;
    // Rounding must not take a sphere from a fiber as long as a whole number of diameters.
    let count = (length / diameter * (1.0 + 1e-12)).floor();
    crate::within("the length of a fiber divided by its diameter", count, 2.0, 1e5)?;
    Ok(count as usize)
}

impl Fiber {
    /// Centers of its spheres from one end to the other, m. The first and the last sphere touch the ends; the distance of
    /// neighbors is at least the diameter.
    pub fn centers(&self) -> impl Iterator<Item = Vec3> + use<> {
        let count = sphere_count(self.length, self.diameter).unwrap_or(0);
        let Self { middle, direction, length, diameter, .. } = *self;
        let last = count.saturating_sub(1).max(1) as f64;
        (0..count).map(move |k| middle + direction * ((length - diameter) * (k as f64 / last - 0.5)))
    }

    /// Volume of the cylinder, `π d² l/4`, m³.
    pub fn volume(&self) -> f64 {
        0.25 * PI * self.diameter * self.diameter * self.length
    }

    /// Smallest distance between the surfaces of the fiber and of its copy, moved by `shift` (m).
    fn distance_to_copy(&self, shift: &Vec3) -> f64 {
        let along = shift.dot(&self.direction);
        let across = (shift - self.direction * along).norm();
        let beyond = (along.abs() - (self.length - self.diameter)).max(0.0);
        across.hypot(beyond) - self.diameter
    }

    fn spheres(&self) -> impl Iterator<Item = Inclusion> + use<> {
        let (size, group) = (self.diameter, self.group);
        self.centers().map(move |center| Inclusion {
            form: Form::Sphere,
            size,
            center,
            rotation: Mat3::identity(),
            group,
        })
    }
}

/// Number of fibers with a volume of `fraction` times that of the region: the nearest whole number.
///
/// # Errors
/// Sizes that are not positive, or more fibers than can be handled.
pub fn count_for(fraction: f64, length: f64, diameter: f64, region: &Region) -> Result<usize, PackingError> {
    sphere_count(length, diameter)?;
    let count = (fraction * region.volume() / (0.25 * PI * diameter * diameter * length)).round();
    let limit = 1e7;
    if count > limit {
        return Err(PackingError::TooMany { count, limit });
    }
    Ok(count as usize)
}

/// Puts each fiber at a random place among those where it is inside the mould (with its spheres) and not too near to `aggregates`
/// and to the fibers placed before: random sequential addition in the given order. `fixed` fibers are in place from the start,
/// wherever they are.
///
/// # Errors
/// Rules that are negative or not finite; [`PackingError::NoPlace`] if no place is found for a fiber.
pub fn place_fibers(
    region: &Region,
    aggregates: &[Inclusion],
    requests: &[FiberRequest],
    fixed: &[Fiber],
    placement: &FiberPlacement,
    random: &mut Random,
) -> Result<Vec<Fiber>, PackingError> {
    crate::within("the gap of the fibers", placement.gap, 0.0, f64::MAX)?;
    crate::within("the gap between fibers and mould", placement.wall_gap, 0.0, f64::MAX)?;
    let mut spheres = aggregates.len();
    for (length, diameter) in
        fixed.iter().map(|one| (one.length, one.diameter)).chain(requests.iter().map(|one| (one.length, one.diameter)))
    {
        spheres += sphere_count(length, diameter)?;
    }
    let mut field = Field::new(region.clone(), spheres);
    for inclusion in aggregates.iter().cloned().chain(fixed.iter().flat_map(Fiber::spheres)) {
        field.add(inclusion);
    }
    let images = field.images();
    let wanted = requests.iter().map(|one| 0.25 * PI * one.diameter * one.diameter * one.length).sum::<f64>();
    let mut fibers = fixed.to_vec();
    let mut reached = 0.0;
    for (number, request) in requests.iter().enumerate() {
        let &FiberRequest { length, diameter, direction, group } = request;
        let place = (0..placement.attempts).find_map(|_| {
            let direction = direction.unwrap_or_else(|| random_direction(random));
            let middle = region.point(&random.uniform_vector());
            let fiber = Fiber { middle, direction, length, diameter, group };
            let free = |sphere: &Inclusion| {
                let near = |other: &Inclusion, shift: &Vec3| !apart(sphere, other, shift, placement.gap);
                region.holds_sphere(&sphere.center, 0.5 * diameter + placement.wall_gap)
                    && field.is_free(sphere, placement.gap, &near)
            };
            // The ends first: they leave the mould most often.
            let ends = [fiber.spheres().next(), fiber.spheres().last()];
            let fits = ends.iter().flatten().all(free)
                && fiber.spheres().all(|sphere| free(&sphere))
                && images.iter().all(|shift| fiber.distance_to_copy(shift) >= placement.gap);
            fits.then_some(fiber)
        });
        let Some(fiber) = place else {
            let volume = region.volume();
            return Err(PackingError::NoPlace {
                number,
                count: requests.len(),
                size: length,
                attempts: placement.attempts,
                reached: reached / volume,
                wanted: wanted / volume,
            });
        };
        reached += fiber.volume();
        fiber.spheres().for_each(|sphere| field.add(sphere));
        fibers.push(fiber);
    }
    Ok(fibers)
}

/// A direction, uniform over the sphere: the coordinate along any axis is uniform (Archimedes).
fn random_direction(random: &mut Random) -> Vec3 {
    let z = 2.0 * random.uniform() - 1.0;
    let (sine, cosine) = sin_cos(TAU * random.uniform());
    let across = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(across * cosine, across * sine, z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Shape;
    use concordem_solver::state::Cell;

    const RULES: FiberPlacement = FiberPlacement { gap: 0.1, wall_gap: 0.2, attempts: 20_000 };

    /// Smallest distance between the axes of two fibers, by the nearest of their spheres.
    fn gap(a: &Fiber, b: &Fiber, shift: &Vec3) -> f64 {
        let distance = |x: Vec3| b.centers().map(|y| (y + shift - x).norm()).fold(f64::INFINITY, f64::min);
        a.centers().map(distance).fold(f64::INFINITY, f64::min) - 0.5 * (a.diameter + b.diameter)
    }

    /// Fibers keep their distances from each other, from an aggregate, from the faces of a mould, and from all images in a cell.
    #[test]
    fn fibers_keep_their_distances() {
        let stone = Inclusion {
            form: Form::Sphere,
            size: 6.0,
            center: Vec3::new(5.0, 5.0, 5.0),
            rotation: Mat3::identity(),
            group: 0,
        };
        let mould = Region::mould(Shape::new_box(Vec3::zeros(), Vec3::repeat(14.0)).unwrap(), false).unwrap();
        let cell =
            Region::periodic(Vec3::zeros(), &Cell::new(Mat3::from_diagonal(&Vec3::repeat(14.0))), false).unwrap();
        for region in [mould, cell] {
            let request = FiberRequest { length: 6.0, diameter: 0.5, direction: None, group: 3 };
            let along = FiberRequest { direction: Some(Vec3::x()), ..request };
            let requests: Vec<_> = (0..60).map(|k| if k % 4 == 0 { along } else { request }).collect();
            let mut random = Random::new(7);
            let fibers =
                place_fibers(&region, std::slice::from_ref(&stone), &requests, &[], &RULES, &mut random).unwrap();
            assert_eq!(fibers.len(), 60);
            let shifts: Vec<Vec3> = if region.is_periodic() {
                (0..27)
                    .map(|k| Vec3::new(f64::from(k % 3 - 1), f64::from(k / 3 % 3 - 1), f64::from(k / 9 - 1)) * 14.0)
                    .collect()
            } else {
                vec![Vec3::zeros()]
            };
            // Rounding of coordinates of some ten.
            let rounding = 1e-12;
            for (k, a) in fibers.iter().enumerate() {
                for shift in &shifts {
                    for b in &fibers[..k] {
                        assert!(gap(a, b, shift) >= 0.1 - rounding);
                    }
                    if *shift != Vec3::zeros() {
                        assert!(gap(a, a, shift) >= 0.1 - rounding);
                    }
                    assert!(a.centers().all(|x| (x + shift - stone.center).norm() >= 3.0 + 0.25 + 0.1 - rounding));
                }
                if !region.is_periodic() {
                    let inside = |x: f64| (0.45 - rounding..=13.55 + rounding).contains(&x);
                    assert!(a.centers().all(|x| x.iter().all(|&x| inside(x))));
                }
                assert!((a.direction.norm() - 1.0).abs() < 1e-15);
            }
            assert!(fibers.iter().step_by(4).all(|fiber| fiber.direction == Vec3::x()));
        }
    }

    /// The same seed gives the same fibers bit for bit; without space for another one the error says how far it got.
    #[test]
    fn places_depend_on_the_seed_and_end_when_nothing_fits() {
        let region = Region::mould(Shape::new_box(Vec3::zeros(), Vec3::repeat(10.0)).unwrap(), false).unwrap();
        let request = FiberRequest { length: 8.0, diameter: 1.0, direction: None, group: 0 };
        let place = |count: usize, seed: u64| {
            let rules = FiberPlacement { gap: 0.0, wall_gap: 0.0, attempts: 3000 };
            place_fibers(&region, &[], &vec![request; count], &[], &rules, &mut Random::new(seed))
        };
        assert_eq!(place(8, 1).unwrap(), place(8, 1).unwrap());
        assert_ne!(place(8, 1).unwrap(), place(8, 2).unwrap());
        match place(400, 1) {
            Err(PackingError::NoPlace { number, count: 400, .. }) => assert!(number >= 8),
            other => panic!("{other:?}"),
        }
        // 1 % of 1000 m³ are 1.59 fibers of 2π m³.
        assert_eq!(count_for(0.01, 8.0, 1.0, &region).unwrap(), 2);
    }

    /// Directions are uniform: the mean of the dyad is a third of the unit tensor, up to the scatter of 20,000 directions
    /// (0.298/√20000 = 0.0021 for a diagonal component; five of them here).
    #[test]
    fn random_directions_are_uniform() {
        let mut random = Random::new(1);
        let mean = (0..20_000)
            .map(|_| random_direction(&mut random))
            .fold(Mat3::zeros(), |sum, n| sum + n * n.transpose() / 20_000.0);
        assert!((mean - Mat3::identity() / 3.0).amax() < 0.0105, "{mean}");
    }

    /// Spheres touch or have small gaps, and span the fiber from end to end.
    #[test]
    fn spheres_span_the_fiber() {
        for (length, count) in [(6.0, 12), (6.4, 12), (1.0, 2), (0.3 * 7.0, 4)] {
            let fiber =
                Fiber { middle: Vec3::new(1.0, 2.0, 3.0), direction: Vec3::z(), length, diameter: 0.5, group: 0 };
            let centers: Vec<Vec3> = fiber.centers().collect();
            assert_eq!(centers.len(), count);
            assert!(centers.windows(2).all(|pair| (pair[1] - pair[0]).norm() >= 0.5 * (1.0 - 1e-12)));
            let span = (centers[count - 1] - centers[0]).norm();
            assert!((span + 0.5 - length).abs() < 1e-12);
        }
        assert!(sphere_count(0.9, 0.5).is_err() && sphere_count(1.0, 0.0).is_err());
        assert_eq!(sphere_count(2.1, 0.7).unwrap(), 3);
    }
}
