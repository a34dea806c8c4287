//! Histogram of directions on a geode, and how much it deviates from isotropy (Jebahi et al. 2015, algorithm 3 and \[2.8\]).

use crate::error::OperatorError;
use concordem_contact::math::{Vec3, atan2};

/// Subdivisions of the icosahedron: 20·4² = 320 faces.
const SUBDIVISIONS: u32 = 2;
/// Children of a face.
const CHILDREN: usize = 4;

/// An icosahedron whose faces are divided twice, projected to the unit sphere: 320 spherical triangles.
///
/// The book calls the faces equal; their solid angles are 0.934 to 1.190 of the mean.
#[derive(Debug, Clone, PartialEq)]
pub struct Geode {
    /// Corners of all triangles of each level: 20, 80, and 320; the children of triangle `k` are `4k` to `4k + 3`.
    levels: Vec<Vec<[Vec3; 3]>>,
    opposite: Vec<usize>,
    share: Vec<f64>,
}

impl Default for Geode {
    fn default() -> Self {
        Self::new()
    }
}

impl Geode {
    /// Number of faces.
    pub const FACES: usize = 320;

    /// The geode of 320 faces.
    pub fn new() -> Self {
        Self::divided(SUBDIVISIONS)
    }

    /// An icosahedron divided `times` times: `20·4^times` faces.
    pub(super) fn divided(times: u32) -> Self {
        let mut levels = vec![icosahedron()];
        for _ in 0..times {
            let coarse = &levels[levels.len() - 1];
            let fine = coarse.iter().flat_map(divided_triangle).collect();
            levels.push(fine);
        }
        let mut geode = Self { levels, opposite: Vec::new(), share: Vec::new() };
        let faces = geode.faces();
        let centers: Vec<Vec3> = faces.iter().map(center).collect();
        let share: Vec<f64> = faces.iter().map(|face| solid_angle(face) / (4.0 * std::f64::consts::PI)).collect();
        geode.share = share;
        geode.opposite = centers.iter().map(|x| geode.face_of(&-x)).collect();
        geode
    }

    /// Corners of the faces on the unit sphere.
    pub fn faces(&self) -> &[[Vec3; 3]] {
        &self.levels[self.levels.len() - 1]
    }

    /// Solid angle of each face over 4π.
    pub fn shares(&self) -> &[f64] {
        &self.share
    }

    /// Face that the ray along `direction` (any length but zero) crosses. On an edge, the face with the lower number.
    pub fn face_of(&self, direction: &Vec3) -> usize {
        let deepest = |level: &[[Vec3; 3]], first: usize, count: usize| {
            let depth = |k: usize| depth_within(&level[k], direction);
            (first + 1..first + count).fold((first, depth(first)), |best, k| {
                let found = depth(k);
                if found > best.1 { (k, found) } else { best }
            })
        };
        let mut face = deepest(&self.levels[0], 0, self.levels[0].len()).0;
        for level in &self.levels[1..] {
            face = deepest(level, CHILDREN * face, CHILDREN).0;
        }
        face
    }

    /// Face opposite to a face.
    pub fn opposite(&self, face: usize) -> usize {
        self.opposite[face]
    }

    /// Histogram of the directions of `links` (m, any length but zero): each link counts in the two faces that its line crosses.
    ///
    /// # Errors
    /// A link that is zero or not finite.
    pub fn orientations(&self, links: &[Vec3]) -> Result<Orientations, OperatorError> {
        crate::error::check_finite("links", links)?;
        let mut counts = vec![0_u64; self.faces().len()];
        for link in links {
            if link.norm_squared() == 0.0 {
                let demand = "a link needs a direction";
                return Err(OperatorError::Constant { name: "length of a link", value: 0.0, demand });
            }
            let face = self.face_of(link);
            counts[face] += 1;
            counts[self.opposite[face]] += 1;
        }
        let faces = counts.len() as f64;
        let mean = 1.0 / faces;
        let floor = self.share.iter().map(|share| (share - mean) * (share - mean)).sum::<f64>() / faces;
        Ok(Orientations { links: links.len() as u64, shares: self.share.clone(), floor, counts })
    }
}

/// Histogram of directions on a geode.
#[derive(Debug, Clone, PartialEq)]
pub struct Orientations {
    /// Number of links.
    pub links: u64,
    /// Links whose line crosses each face; each link counts in two opposite faces.
    pub counts: Vec<u64>,
    /// Solid angle of each face over 4π.
    pub shares: Vec<f64>,
    /// Deviation `e` of an isotropic distribution of infinitely many links, because the faces are not equal.
    pub floor: f64,
}

impl Orientations {
    /// Share `f_i` of each face; the sum is 1.
    pub fn frequencies(&self) -> Vec<f64> {
        let total = (2 * self.links).max(1) as f64;
        self.counts.iter().map(|count| *count as f64 / total).collect()
    }

    /// Density of each face: its share over that of an isotropic distribution.
    pub fn densities(&self) -> Vec<f64> {
        self.frequencies().iter().zip(&self.shares).map(|(f, share)| f / share).collect()
    }

    /// Deviation from isotropy \[2.8\] with frequencies as fractions, `e = (1/N) Σ (f_i − 1/N)²`; NaN without links.
    pub fn deviation(&self) -> f64 {
        self.mean_square(|_| 1.0 / self.counts.len() as f64)
    }

    /// The same with frequencies in percent: `10⁴ e`. A plausible reading of the bound 0.0032 in the source, which as a
    /// fraction no sample could exceed: all links in one direction give 0.00155.
    pub fn deviation_percent(&self) -> f64 {
        1e4 * self.deviation()
    }

    /// `(1/N) Σ (f_i − s_i)²` with the shares `s_i` of the solid angle: zero for infinitely many isotropic links.
    pub fn deviation_from_isotropy(&self) -> f64 {
        self.mean_square(|face| self.shares[face])
    }

    /// Mean of [`Self::deviation_from_isotropy`] for independent isotropic links: `Σ p(1 − p)/(2 N n)` over the pairs of opposite
    /// faces, each with the share `p` of the links, of which half falls into either face.
    pub fn noise(&self) -> f64 {
        // A pair's share has the variance p(1 − p)/n; each of its two faces has half of it.
        let faces = self.counts.len() as f64;
        let variance = |share: &f64| 2.0 * share * (1.0 - 2.0 * share) / (4.0 * self.links as f64);
        self.shares.iter().map(variance).sum::<f64>() / faces
    }

    fn mean_square(&self, expected: impl Fn(usize) -> f64) -> f64 {
        if self.links == 0 {
            return f64::NAN;
        }
        let square = |(face, f): (usize, &f64)| (f - expected(face)) * (f - expected(face));
        self.frequencies().iter().enumerate().map(square).sum::<f64>() / self.counts.len() as f64
    }
}

fn icosahedron() -> Vec<[Vec3; 3]> {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut corners = Vec::new();
    for axis in 0..3 {
        for (one, other) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
            let mut x = Vec3::zeros();
            x[(axis + 1) % 3] = one;
            x[(axis + 2) % 3] = other;
            corners.push(x.normalize());
        }
    }
    // Neighbors are 1.05 radii apart, others at least 1.7.
    let near = |a: &Vec3, b: &Vec3| (a - b).norm() < 1.3;
    let mut faces = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let (a, b, c) = (corners[i], corners[j], corners[k]);
                if near(&a, &b) && near(&b, &c) && near(&c, &a) {
                    faces.push(if a.dot(&b.cross(&c)) > 0.0 { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    faces
}

/// The four parts of a spherical triangle, by the middles of its edges; all run counter-clockwise seen from outside.
fn divided_triangle([a, b, c]: &[Vec3; 3]) -> [[Vec3; 3]; CHILDREN] {
    let (ab, bc, ca) = ((a + b).normalize(), (b + c).normalize(), (c + a).normalize());
    [[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]]
}

fn center([a, b, c]: &[Vec3; 3]) -> Vec3 {
    (a + b + c).normalize()
}

/// Smallest distance of a direction from the planes through the edges; negative outside.
fn depth_within([a, b, c]: &[Vec3; 3], x: &Vec3) -> f64 {
    let side = |p: &Vec3, q: &Vec3| p.cross(q).dot(x) / p.cross(q).norm();
    // A face and its mirror image have the same planes; only the face lies in front.
    if (a + b + c).dot(x) <= 0.0 {
        return f64::NEG_INFINITY;
    }
    side(a, b).min(side(b, c)).min(side(c, a))
}

/// Solid angle of a triangle of unit vectors (Van Oosterom and Strackee 1983).
fn solid_angle([a, b, c]: &[Vec3; 3]) -> f64 {
    2.0 * atan2(a.dot(&b.cross(c)).abs(), 1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The icosahedron has 20 faces of 0.2π each; its two divisions have 320, whose solid angles fill the sphere and reach from 0.934
    /// to 1.190 of the mean.
    #[test]
    fn faces_fill_the_sphere() {
        let geode = Geode::new();
        assert_eq!((geode.levels[0].len(), geode.faces().len()), (20, Geode::FACES));
        approx::assert_relative_eq!(solid_angle(&geode.levels[0][7]), 0.2 * std::f64::consts::PI, max_relative = 1e-14);
        // 320 roundings of 1e-16.
        approx::assert_relative_eq!(geode.shares().iter().sum::<f64>(), 1.0, max_relative = 1e-13);
        let over_mean = |f: fn(f64, f64) -> f64, start| geode.shares().iter().map(|s| 320.0 * s).fold(start, f);
        // The printed digits.
        approx::assert_abs_diff_eq!(over_mean(f64::min, 9.0), 0.934, epsilon = 5e-4);
        approx::assert_abs_diff_eq!(over_mean(f64::max, 0.0), 1.190, epsilon = 5e-4);
    }

    /// Every face contains its center and no other one does; opposite faces are opposite.
    #[test]
    fn centers_lie_in_their_faces() {
        let geode = Geode::new();
        for (k, face) in geode.faces().iter().enumerate() {
            assert_eq!(geode.face_of(&center(face)), k);
            assert_eq!(geode.opposite(geode.opposite(k)), k);
            let sum = center(face) + center(&geode.faces()[geode.opposite(k)]);
            assert!(sum.norm() < 1e-12, "{k}");
        }
    }

    /// All links along one direction: `e = (2(½ − 1/N)² + (N − 2)/N²)/N`, which is the largest possible value, 0.00155.
    #[test]
    fn one_direction_deviates_most() {
        let geode = Geode::new();
        let found = geode.orientations(&[Vec3::new(0.3, 0.2, 0.9); 7]).unwrap();
        let n = 320.0;
        let expected = (2.0 * (0.5 - 1.0 / n) * (0.5 - 1.0 / n) + (n - 2.0) / (n * n)) / n;
        approx::assert_relative_eq!(found.deviation(), expected, max_relative = 1e-13);
        approx::assert_abs_diff_eq!(found.deviation(), 0.00155, epsilon = 5e-6);
        assert!(geode.orientations(&[Vec3::zeros()]).is_err());
        assert!(geode.orientations(&[]).unwrap().deviation().is_nan());
    }

    /// As many links per face as its solid angle demands leave the floor, 7.3e-4 in percent squared.
    #[test]
    fn unequal_faces_leave_a_floor() {
        let geode = Geode::new();
        let links: Vec<Vec3> = (geode.faces().iter().zip(geode.shares()))
            .flat_map(|(face, share)| std::iter::repeat_n(center(face), (1e6 * share).round() as usize))
            .collect();
        let found = geode.orientations(&links).unwrap();
        // Rounded to whole links: 0.5 of 3000 per face.
        approx::assert_relative_eq!(found.deviation(), found.floor, max_relative = 1e-3);
        approx::assert_abs_diff_eq!(1e4 * found.floor, 7.3e-4, epsilon = 5e-6);
        assert!(found.deviation_from_isotropy() < 1e-4 * found.floor);
    }

    /// Independent isotropic links have the deviation that the noise predicts. The sum over 160 pairs scatters by √(2/160) = 11 %;
    /// the mean of ten samples by 3.5 %, three times that is allowed.
    #[test]
    fn independent_links_deviate_as_expected() {
        let geode = Geode::new();
        let mut seed = 1_u64;
        let mut uniform = || {
            // Knuth's linear congruential generator, upper bits.
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut ratios = 0.0;
        for _ in 0..10 {
            let mut links = Vec::new();
            while links.len() < 5000 {
                let x = Vec3::new(uniform(), uniform(), uniform()) * 2.0 - Vec3::repeat(1.0);
                if x.norm_squared() <= 1.0 {
                    links.push(x);
                }
            }
            let found = geode.orientations(&links).unwrap();
            ratios += found.deviation_from_isotropy() / found.noise() / 10.0;
        }
        assert!((ratios - 1.0).abs() < 0.105, "{ratios}");
    }
}
