//! Regular packings of equal touching spheres.

use super::{Crop, Packing, PackingError, Shape, TIE, affordable, positive};
use concordem_contact::math::Vec3;
use concordem_solver::state::Cell;
use concordem_solver::state::particles::Sphere;

/// A regular arrangement of equal touching spheres; the two plane ones consist of discs of unit depth in a plane of
/// constant z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Lattice {
    /// Simple cubic: 6 neighbors, solid fraction π/6.
    SimpleCubic,
    /// Body-centered cubic: 8 neighbors, π√3/8.
    BodyCentered,
    /// Face-centered cubic: 12 neighbors, π/√18.
    FaceCentered,
    /// Hexagonal close packing with the ideal axis ratio √(8/3): 12 neighbors, π/√18.
    HexagonalClosePacked,
    /// Plane square: 4 neighbors.
    Square,
    /// Plane triangular: 6 neighbors.
    Triangular,
}

impl Lattice {
    /// Whether the arrangement is plane.
    pub fn is_plane(self) -> bool {
        matches!(self, Self::Square | Self::Triangular)
    }

    /// Edges (m) of the right-angled unit cell of spheres of `radius` (m). The third edge of the plane lattices is the
    /// unit depth of 2-D problems, 1 m.
    pub fn unit_cell(self, radius: f64) -> Vec3 {
        let d = 2.0 * radius;
        match self {
            Self::SimpleCubic => Vec3::repeat(d),
            Self::BodyCentered => Vec3::repeat(2.0 * d / 3.0_f64.sqrt()),
            Self::FaceCentered => Vec3::repeat(d * 2.0_f64.sqrt()),
            Self::HexagonalClosePacked => Vec3::new(d, d * 3.0_f64.sqrt(), d * (8.0_f64 / 3.0).sqrt()),
            Self::Square => Vec3::new(d, d, 1.0),
            Self::Triangular => Vec3::new(d, d * 3.0_f64.sqrt(), 1.0),
        }
    }

    /// Positions of the spheres in the unit cell, as fractions of its edges.
    fn basis(self) -> &'static [[f64; 3]] {
        match self {
            Self::SimpleCubic | Self::Square => &[[0.0, 0.0, 0.0]],
            Self::BodyCentered => &[[0.0, 0.0, 0.0], [0.5, 0.5, 0.5]],
            Self::FaceCentered => &[[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]],
            Self::HexagonalClosePacked => {
                &[[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 5.0 / 6.0, 0.5], [0.0, 1.0 / 3.0, 0.5]]
            }
            Self::Triangular => &[[0.0, 0.0, 0.0], [0.5, 0.5, 0.0]],
        }
    }

    /// A periodic packing of `repeats` unit cells along each axis. The plane lattices have one layer; they ignore the
    /// third number.
    ///
    /// # Errors
    /// A radius that is not positive, no repeats, too many spheres, or a plane lattice of spheres so large that they
    /// would touch their own images at the distance of unit depth.
    ///
    /// ```
    /// use concordem_packing::Lattice;
    ///
    /// let packing = Lattice::FaceCentered.periodic(1e-3, [3, 3, 3]).unwrap();
    /// assert_eq!(packing.spheres.len(), 4 * 27);
    /// ```
    pub fn periodic(self, radius: f64, mut repeats: [u32; 3]) -> Result<Packing, PackingError> {
        positive("the radius of the lattice's spheres", radius)?;
        if self.is_plane() {
            repeats[2] = 1;
            super::within("the radius of a plane periodic lattice of unit depth", radius, 0.0, 0.25)?;
        }
        for count in repeats {
            positive("the number of repeats of the lattice", f64::from(count))?;
        }
        let basis = self.basis();
        let count = repeats.iter().map(|n| f64::from(*n)).product::<f64>() * basis.len() as f64;
        affordable(count)?;
        let edges = self.unit_cell(radius);
        let mut spheres = Vec::with_capacity(count as usize);
        for k in 0..repeats[2] {
            for j in 0..repeats[1] {
                for i in 0..repeats[0] {
                    let cell = Vec3::new(f64::from(i), f64::from(j), f64::from(k));
                    spheres.extend(
                        basis.iter().map(|place| Sphere {
                            position: (cell + Vec3::from(*place)).component_mul(&edges),
                            radius,
                        }),
                    );
                }
            }
        }
        let size = edges.component_mul(&Vec3::from(repeats.map(f64::from)));
        Ok(Packing { spheres, cell: Some(Cell::new_box(size)) })
    }

    /// Where the lattice begins, so that whole spheres fill a box from `low` to `high` (m): the origin, but half a layer beside it, or at
    /// another place, along the axes along which layers then touch both faces.
    pub fn origin_in(self, radius: f64, low: &Vec3, high: &Vec3) -> Vec3 {
        let edges = self.unit_cell(radius);
        let axes = if self.is_plane() { 2 } else { 3 };
        let mut origin = Vec3::zeros();
        for axis in 0..axes {
            let Some(spacing) = self.spacing(axis).map(|fraction| fraction * edges[axis]) else { continue };
            // In layers: from the first face to the origin, and between the first and the last layer.
            let start = (low[axis] + radius) / spacing;
            let layers = (high[axis] - low[axis] - 2.0 * radius) / spacing;
            let tie = TIE * radius / spacing;
            let is_whole = |count: f64| (count - count.round()).abs() <= tie * count.abs().max(1.0);
            if is_whole(layers) && !is_whole(start) {
                origin[axis] = (start - start.floor()) * spacing;
            }
        }
        origin
    }

    /// Distance of the layers along an axis as a fraction of the unit cell; `None` if they are not evenly spaced.
    fn spacing(self, axis: usize) -> Option<f64> {
        let mut layers: Vec<f64> = self.basis().iter().map(|place| place[axis]).collect();
        layers.sort_unstable_by(f64::total_cmp);
        layers.dedup();
        let spacing = 1.0 / layers.len() as f64;
        let even = layers.iter().enumerate().all(|(k, layer)| (layer - k as f64 * spacing).abs() < 1e-9);
        even.then_some(spacing)
    }

    /// Sizes (m) of a box along an axis that whole spheres fill, the next ones below and above `size`; `None` if layers are not evenly
    /// spaced.
    pub fn sizes_around(self, radius: f64, axis: usize, size: f64) -> Option<[f64; 2]> {
        let spacing = self.spacing(axis)? * self.unit_cell(radius)[axis];
        let layers = ((size - 2.0 * radius) / spacing).floor().max(0.0);
        Some([layers, layers + 1.0].map(|layers| 2.0 * radius + layers * spacing))
    }

    /// All spheres of the lattice through `origin` (m) that `crop` keeps in `shape`. Plane lattices lie in the plane
    /// `z = origin.z`.
    ///
    /// # Errors
    /// A radius that is not positive, or a shape with room for too many spheres.
    pub fn fill(self, radius: f64, shape: &Shape, crop: Crop, origin: Vec3) -> Result<Packing, PackingError> {
        positive("the radius of the lattice's spheres", radius)?;
        let edges = self.unit_cell(radius);
        let (low, high) = shape.bounds();
        let mut first = (low - origin).component_div(&edges).map(|c| c.floor() - 1.0);
        let mut last = (high - origin).component_div(&edges).map(f64::ceil);
        if self.is_plane() {
            (first.z, last.z) = (0.0, 0.0);
        }
        let count = (last - first).add_scalar(1.0).product() * self.basis().len() as f64;
        affordable(count)?;
        let mut spheres = Vec::new();
        for k in first.z as i64..=last.z as i64 {
            for j in first.y as i64..=last.y as i64 {
                for i in first.x as i64..=last.x as i64 {
                    let cell = Vec3::new(i as f64, j as f64, k as f64);
                    for place in self.basis() {
                        let position = origin + (cell + Vec3::from(*place)).component_mul(&edges);
                        let sphere = Sphere { position, radius };
                        if crop.keeps(&sphere, shape) {
                            spheres.push(sphere);
                        }
                    }
                }
            }
        }
        Ok(Packing { spheres, cell: None })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use concordem_solver::neighbor::candidate_pairs;

    #[test]
    fn neighbors_and_packing_fractions() {
        let pi = std::f64::consts::PI;
        let cases = [
            (Lattice::SimpleCubic, 6, pi / 6.0),
            (Lattice::BodyCentered, 8, pi * 3.0_f64.sqrt() / 8.0),
            (Lattice::FaceCentered, 12, pi / 18.0_f64.sqrt()),
            (Lattice::HexagonalClosePacked, 12, pi / 18.0_f64.sqrt()),
            // Spheres of radius 0.1 in a layer 1 m deep.
            (Lattice::Square, 4, 0.1 * pi / 6.0 * 2.0),
            (Lattice::Triangular, 6, 0.1 * pi / 27.0_f64.sqrt() * 2.0),
        ];
        for (lattice, neighbors, fraction) in cases {
            // One unit cell, smaller than the reach, and several.
            for repeats in [[1, 1, 1], [3, 2, 4]] {
                let packing = lattice.periodic(0.1, repeats).unwrap();
                let count = packing.spheres.len();
                // 1e-9 of the radius: touching up to rounding; second neighbors are at least 15 % further away.
                let reach = vec![0.1 * (1.0 + 1.0e-9); count];
                let pairs = candidate_pairs(&packing.positions(), &reach, packing.cell.as_ref()).unwrap();
                assert_eq!(2 * pairs.len(), neighbors * count, "{lattice:?} {repeats:?}");
                // A dozen roundings.
                approx::assert_relative_eq!(packing.packing_fraction().unwrap(), fraction, max_relative = 1e-14);
                let less = vec![0.1 * (1.0 - 1.0e-9); count];
                assert!(candidate_pairs(&packing.positions(), &less, packing.cell.as_ref()).unwrap().is_empty());
            }
        }
    }

    #[test]
    fn fill_takes_whole_spheres() {
        let shape = Shape::new_box(Vec3::zeros(), Vec3::repeat(1.0)).unwrap();
        let packing = Lattice::SimpleCubic.fill(0.05, &shape, Crop::WholeSpheres, Vec3::repeat(0.05)).unwrap();
        assert_eq!(packing.spheres.len(), 1000);
        let plane = Lattice::Square.fill(0.05, &shape, Crop::WholeSpheres, Vec3::new(0.05, 0.05, 0.5)).unwrap();
        assert_eq!(plane.spheres.len(), 100);
        assert!(
            Lattice::FaceCentered.fill(0.05, &shape, Crop::WholeSpheres, Vec3::zeros()).unwrap().spheres.len() > 1000
        );
    }

    /// A box that ten spheres fill has ten across, wherever it lies, and one that nine fill keeps nine.
    #[test]
    fn whole_spheres_fill_a_box_that_they_fit() {
        for (lattice, size, count) in [
            (Lattice::SimpleCubic, [20.0, 18.0, 40.0], 10 * 9 * 20),
            (Lattice::SimpleCubic, [19.0, 18.0, 40.0], 9 * 9 * 20),
            (Lattice::FaceCentered, [2.0 + 5.0 * 2.0_f64.sqrt(), 2.0 + 4.0 * 2.0_f64.sqrt(), 3.0], 15),
            (Lattice::Square, [20.0, 18.0, 1.0], 90),
        ] {
            for center in [Vec3::zeros(), Vec3::new(0.3, -7.0, 1.0)] {
                let half = Vec3::from(size) * 0.5e-3;
                let center = center * 1e-3;
                let (low, high) = (center - half, center + half);
                let shape = Shape::new_box(low, high).unwrap();
                let mut origin = lattice.origin_in(1e-3, &low, &high);
                if lattice.is_plane() {
                    origin.z = center.z;
                }
                let crop = if lattice.is_plane() { Crop::Centers } else { Crop::WholeSpheres };
                let packing = lattice.fill(1e-3, &shape, crop, origin).unwrap();
                if size[0] != 19.0 || center == Vec3::zeros() {
                    assert_eq!(packing.spheres.len(), count, "{lattice:?} {size:?} {center}");
                }
            }
        }
    }

    #[test]
    fn bad_input_is_refused() {
        let shape = Shape::new_box(Vec3::zeros(), Vec3::repeat(1.0)).unwrap();
        assert!(matches!(Lattice::SimpleCubic.periodic(0.0, [1; 3]), Err(PackingError::NotPositive { .. })));
        assert!(matches!(Lattice::SimpleCubic.periodic(1.0, [1, 0, 1]), Err(PackingError::NotPositive { .. })));
        assert!(matches!(Lattice::SimpleCubic.periodic(1.0, [u32::MAX; 3]), Err(PackingError::TooMany { .. })));
        assert!(matches!(Lattice::Square.periodic(0.6, [1; 3]), Err(PackingError::OutOfRange { .. })));
        assert!(matches!(
            Lattice::Square.fill(f64::NAN, &shape, Crop::WholeSpheres, Vec3::zeros()),
            Err(PackingError::NotPositive { .. })
        ));
        assert!(matches!(
            Lattice::SimpleCubic.fill(1.0e-8, &shape, Crop::WholeSpheres, Vec3::zeros()),
            Err(PackingError::TooMany { .. })
        ));
    }
}
