//! Copies of a periodic packing: larger periodic cells, and bodies of any shape cut from them.

use super::{Packing, PackingError, Shape, TIE, affordable, within};
use concordem_contact::math::{Mat3, Vec3};
use concordem_solver::state::Cell;
use concordem_solver::state::particles::Sphere;

/// Largest number of copies of a cell considered for one body.
const MAX_COPIES: f64 = 4.0e9;

/// Which spheres belong to a cropped body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Crop {
    /// Those that lie entirely inside the shape: no sphere sticks out. A sphere that touches the surface from inside stays.
    #[default]
    WholeSpheres,
    /// Those whose centers lie inside or on the surface: the density near the surface is that of the bulk.
    Centers,
}

impl Crop {
    /// Whether a sphere stays. Distances to the surface count up to [`TIE`] times the radius, so that spheres that touch it
    /// and centers that lie on it stay, whatever the last digit says.
    pub fn keeps(self, sphere: &Sphere, shape: &Shape) -> bool {
        let margin = match self {
            Self::WholeSpheres => sphere.radius * (1.0 - TIE),
            Self::Centers => -sphere.radius * TIE,
        };
        shape.contains(&sphere.position, margin)
    }
}

/// A periodic packing of `repeats` copies of a periodic packing along each edge of its cell.
///
/// # Errors
/// No cell, no repeats, or too many spheres.
pub fn tile(packing: &Packing, repeats: [u32; 3]) -> Result<Packing, PackingError> {
    let cell = packing.cell.ok_or(PackingError::NoCell)?;
    let copies: f64 = repeats.iter().map(|n| f64::from(*n)).product();
    within("the number of copies of the packing", copies, 1.0, f64::MAX)?;
    let count = copies * packing.spheres.len() as f64;
    affordable(count)?;
    let mut spheres = Vec::with_capacity(count as usize);
    for k in 0..repeats[2] {
        for j in 0..repeats[1] {
            for i in 0..repeats[0] {
                let shift = cell.matrix * Vec3::new(f64::from(i), f64::from(j), f64::from(k));
                spheres
                    .extend(packing.spheres.iter().map(|s| Sphere { position: s.position + shift, radius: s.radius }));
            }
        }
    }
    let matrix = cell.matrix * Mat3::from_diagonal(&Vec3::from(repeats.map(f64::from)));
    Ok(Packing { spheres, cell: Some(Cell::new(matrix)) })
}

/// A body cropped from a periodic packing: copies of the cell cover `shape`, and the spheres that belong to it stay.
///
/// The corner of one copy of the cell lies at `anchor` (m). The spheres are ordered copy by copy, x fastest, each copy
/// in the packing's order. No new overlaps arise, because any two spheres of the body are two of the infinite periodic
/// packing.
///
/// # Errors
/// No cell, or too many spheres.
pub fn tile_and_crop(packing: &Packing, shape: &Shape, crop: Crop, anchor: Vec3) -> Result<Packing, PackingError> {
    let mut spheres = Vec::new();
    for_each_copy(packing, shape.bounds(), anchor, |sphere| {
        if crop.keeps(&sphere, shape) {
            spheres.push(sphere);
        }
    })?;
    Ok(Packing { spheres, cell: None })
}

/// The spheres that [`tile_and_crop`] cuts away and whose centers lie in the box around `shape`, or at most `reach` (m) outside of it; in the same order.
///
/// # Errors
/// Those of [`tile_and_crop`].
pub fn cut_away(
    packing: &Packing,
    shape: &Shape,
    crop: Crop,
    anchor: Vec3,
    reach: f64,
) -> Result<Vec<Sphere>, PackingError> {
    let (low, high) = shape.bounds();
    let (low, high) = (low.add_scalar(-reach), high.add_scalar(reach));
    let mut spheres = Vec::new();
    for_each_copy(packing, (low, high), anchor, |sphere| {
        let near = (0..3).all(|axis| (low[axis]..=high[axis]).contains(&sphere.position[axis]));
        if near && !crop.keeps(&sphere, shape) {
            spheres.push(sphere);
        }
    })?;
    Ok(spheres)
}

/// Visits the spheres of all copies of a periodic packing that cover a box from `low` to `high` (m), and of one copy more on either side: rounding
/// may put a sphere on the wrong side of a face.
fn for_each_copy(
    packing: &Packing,
    (low, high): (Vec3, Vec3),
    anchor: Vec3,
    mut visit: impl FnMut(Sphere),
) -> Result<(), PackingError> {
    let cell = packing.cell.ok_or(PackingError::NoCell)?;
    let inverse = cell
        .matrix
        .try_inverse()
        .ok_or(PackingError::NotPositive { name: "the volume of the packing's cell", value: cell.volume() })?;
    let mut unit = packing.clone();
    unit.wrap();
    let mut first = Vec3::repeat(f64::INFINITY);
    let mut last = Vec3::repeat(f64::NEG_INFINITY);
    for corner in 0..8 {
        let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
        let place = inverse * (Vec3::new(pick(0), pick(1), pick(2)) - anchor);
        first = first.inf(&place);
        last = last.sup(&place);
    }
    let first = first.map(|c| c.floor() - 1.0);
    let last = last.map(|c| c.floor() + 1.0);
    if unit.spheres.is_empty() {
        return Err(PackingError::Empty);
    }
    let copies = (last - first).add_scalar(1.0).product();
    // Spheres inside the box, at the density of the packing.
    affordable((high - low).product() / cell.volume() * unit.spheres.len() as f64)?;
    within("the number of copies of the packing that cover the shape", copies, 1.0, MAX_COPIES)?;
    for k in first.z as i64..=last.z as i64 {
        for j in first.y as i64..=last.y as i64 {
            for i in first.x as i64..=last.x as i64 {
                let shift = anchor + cell.matrix * Vec3::new(i as f64, j as f64, k as f64);
                let moved = unit.spheres.iter().map(|s| Sphere { position: s.position + shift, radius: s.radius });
                moved.for_each(&mut visit);
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Mesh;
    use crate::{Lattice, PackingSummary, Random};

    /// Spheres placed at random without overlap in a skewed cell; some positions lie outside the cell.
    fn loose_packing() -> Packing {
        let cell = Cell::new(Mat3::new(1.0, 0.3, 0.1, 0.0, 0.9, -0.2, 0.0, 0.0, 1.1));
        let mut random = Random::new(5);
        let mut packing = Packing { spheres: Vec::new(), cell: Some(cell) };
        while packing.spheres.len() < 60 {
            let position = cell.matrix * (random.uniform_vector() * 3.0);
            packing.spheres.push(Sphere { position, radius: 0.08 });
            if PackingSummary::new(&packing, 1.0).unwrap().coordination > 0.0 {
                packing.spheres.pop();
            }
        }
        packing
    }

    #[test]
    fn no_overlaps_at_seams_and_the_right_density() {
        let packing = loose_packing();
        let shape = Shape::new_box(Vec3::new(-2.0, -1.0, 0.5), Vec3::new(2.5, 3.0, 4.0)).unwrap();
        let body = tile_and_crop(&packing, &shape, Crop::Centers, Vec3::new(0.3, 0.2, 0.1)).unwrap();
        assert_eq!(PackingSummary::new(&body, 1.0 - 1.0e-12).unwrap().coordination, 0.0);
        // 63 m³ at 60 spheres per 0.99 m³; the surface of 100 m² cuts through copies of the cell, so the count varies
        // by a few of the ≈100 boundary cells' spheres: 2 % of 3818.
        let expected = 63.0 * 60.0 / 0.99;
        approx::assert_relative_eq!(body.spheres.len() as f64, expected, max_relative = 0.02);
        let whole = tile_and_crop(&packing, &shape, Crop::WholeSpheres, Vec3::new(0.3, 0.2, 0.1)).unwrap();
        assert!(whole.spheres.len() < body.spheres.len());
        assert!(whole.spheres.iter().all(|s| shape.contains(&s.position, s.radius * (1.0 - 1.0e-9))));
    }

    #[test]
    fn every_copy_of_every_sphere_inside_is_there() {
        let packing = loose_packing();
        let cell = packing.cell.unwrap();
        let shape = Shape::new_sphere(Vec3::new(0.2, -0.4, 0.7), 1.7).unwrap();
        let anchor = Vec3::new(0.35, -0.15, 0.6);
        let body = tile_and_crop(&packing, &shape, Crop::Centers, anchor).unwrap();
        let (mut expected, mut nearest) = (0, f64::INFINITY);
        for sphere in &packing.spheres {
            for i in -12..12 {
                for j in -12..12 {
                    for k in -12..12 {
                        let image = Vec3::new(f64::from(i), f64::from(j), f64::from(k));
                        let position = anchor + sphere.position + cell.matrix * image;
                        expected += usize::from(shape.contains(&position, 0.0));
                        nearest = nearest.min((position - body.spheres[0].position).norm());
                    }
                }
            }
        }
        assert_eq!(body.spheres.len(), expected);
        // The spheres lie where the copies are, to rounding.
        assert!(nearest < 1e-14, "{nearest:e}");
    }

    /// What stays and what is cut away are all spheres of the box around the shape and its margin.
    #[test]
    fn what_is_cut_away_completes_the_body() {
        let (packing, anchor, reach) = (loose_packing(), Vec3::new(0.3, 0.2, 0.1), 0.4);
        let shape = Shape::new_sphere(Vec3::new(0.2, -0.4, 0.7), 1.7).unwrap();
        let (low, high) = shape.bounds();
        let whole = Shape::new_box(low.add_scalar(-reach), high.add_scalar(reach)).unwrap();
        for crop in [Crop::Centers, Crop::WholeSpheres] {
            let mut found = cut_away(&packing, &shape, crop, anchor, reach).unwrap();
            assert!(found.iter().all(|sphere| !crop.keeps(sphere, &shape)));
            found.extend(tile_and_crop(&packing, &shape, crop, anchor).unwrap().spheres);
            let mut all = tile_and_crop(&packing, &whole, Crop::Centers, anchor).unwrap().spheres;
            for spheres in [&mut found, &mut all] {
                spheres.sort_by(|a, b| a.position.as_slice().partial_cmp(b.position.as_slice()).unwrap());
            }
            // Both are copies shifted by the same vectors.
            assert_eq!(found, all, "{crop:?}");
        }
    }

    #[test]
    fn periodic_copies_keep_density_and_contacts() {
        let packing = loose_packing();
        let larger = tile(&packing, [2, 3, 1]).unwrap();
        assert_eq!(larger.spheres.len(), 360);
        // A dozen roundings.
        approx::assert_relative_eq!(
            larger.packing_fraction().unwrap(),
            packing.packing_fraction().unwrap(),
            max_relative = 1e-14
        );
        let contacts = |p: &Packing| PackingSummary::new(p, 1.4).unwrap().coordination;
        assert_eq!(contacts(&larger), contacts(&packing));
    }

    /// Centers on the border and spheres that touch it stay for every radius and place of the body, whether their
    /// coordinates are rounded up or down: simple cubic lattices of 7 layers along each axis, whose outermost centers lie on
    /// the faces of a box, and the same with whole spheres. Without the tolerance, 24 of the 80 boxes for centers lose
    /// layers.
    #[test]
    fn layers_on_the_border_stay_for_every_radius() {
        let length = |count: u32| -> f64 { format!("{count}e-4").parse().unwrap() };
        for k in 1..=40 {
            let radius = length(k);
            for center in [0.0, length(14 * k)].map(Vec3::repeat) {
                for (crop, size) in [(Crop::Centers, length(12 * k)), (Crop::WholeSpheres, length(14 * k))] {
                    let half = Vec3::repeat(0.5 * size);
                    let body = Shape::new_box(center - half, center + half).unwrap();
                    let filled = Lattice::SimpleCubic.fill(radius, &body, crop, Vec3::zeros()).unwrap();
                    assert_eq!(filled.spheres.len(), 343, "{radius} {center:?} {crop:?}");
                    let unit = Lattice::SimpleCubic.periodic(radius, [2, 3, 1]).unwrap();
                    let cut = tile_and_crop(&unit, &body, crop, Vec3::zeros()).unwrap();
                    assert_eq!(cut.spheres.len(), 343, "{radius} {center:?} {crop:?}");
                }
            }
        }
    }

    /// The tolerance is that of all shapes: a point on the surface stays, one that is 1e-6 of the radius outside does not.
    #[test]
    fn centers_on_every_surface_stay() {
        let mesh = Mesh::new(
            vec![Vec3::zeros(), Vec3::x() * 0.3, Vec3::y() * 0.3, Vec3::z() * 0.3],
            vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        );
        let z = Vec3::z() * 0.3;
        let cases = [
            (Shape::new_box(Vec3::zeros(), Vec3::repeat(0.3)).unwrap(), Vec3::new(0.1, 0.2, 0.3), Vec3::z()),
            (Shape::new_cylinder(Vec3::zeros(), z, 0.3).unwrap(), Vec3::new(0.18, 0.24, 0.1), Vec3::new(0.6, 0.8, 0.0)),
            (Shape::new_cylinder(Vec3::zeros(), z, 0.3).unwrap(), Vec3::new(0.1, 0.0, 0.3), Vec3::z()),
            (Shape::new_hyperboloid(Vec3::zeros(), z, 0.4, 0.3).unwrap(), Vec3::new(0.18, 0.24, 0.15), Vec3::x()),
            (Shape::new_sphere(Vec3::zeros(), 0.3).unwrap(), Vec3::new(0.18, 0.24, 0.0), Vec3::new(0.6, 0.8, 0.0)),
            (Shape::Mesh(mesh.unwrap()), Vec3::repeat(0.1), Vec3::repeat(3.0_f64.sqrt().recip())),
        ];
        let radius = 0.01;
        for (shape, place, outward) in cases {
            let keeps = |distance: f64| {
                Crop::Centers.keeps(&Sphere { position: place + outward * (distance * radius), radius }, &shape)
            };
            // Coordinates of 0.3 are rounded by some 1e-16, that is 1e-14 of the radius.
            assert!([-1e-6, -1e-12, 0.0, 1e-12, 1e-10].into_iter().all(keeps), "{shape:?}");
            assert!(!keeps(1e-6) && !keeps(1e-2), "{shape:?}");
        }
    }

    #[test]
    fn bad_input_is_refused() {
        let packing = Packing::default();
        let shape = Shape::new_sphere(Vec3::zeros(), 1.0).unwrap();
        assert!(matches!(tile(&packing, [1; 3]), Err(PackingError::NoCell)));
        assert!(matches!(tile_and_crop(&packing, &shape, Crop::Centers, Vec3::zeros()), Err(PackingError::NoCell)));
        assert!(matches!(tile(&loose_packing(), [0, 1, 1]), Err(PackingError::OutOfRange { .. })));
        assert!(matches!(tile(&loose_packing(), [u32::MAX, 1, 1]), Err(PackingError::TooMany { .. })));
    }
}
