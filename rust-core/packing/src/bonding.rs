//! Bonds between neighboring particles at the start of a run.

use crate::TIE;
use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::kinematics::sphere_sphere::initial_geometry;
use concordem_contact::law::Reference;
use concordem_contact::math::Vec3;
use concordem_solver::PairCoefficients;
use concordem_solver::neighbor::{NeighborError, candidate_pairs};
use concordem_solver::state::contacts::{ContactFlags, Contacts, Pair};
use concordem_solver::state::{Cell, Particles};

/// Number of bonds made by [`bond`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct BondCount {
    /// All bonds.
    pub bonds: usize,
    /// Bonds whose length equals the largest one up to the relative tolerance [`TIE`]. Without the tolerance, rounding
    /// would decide which of them exist.
    pub ties: usize,
}

/// Bond all pairs whose center distance is at most `interaction_ratio` times the sum of their radii (Stránský 2018,
/// §2.1), up to the relative tolerance [`TIE`], except within a clump and between materials without pair coefficients.
/// Bonds have the present length and normal, and the cross-section of their law
/// ([`ContactLaw::bonded_area`](concordem_contact::law::ContactLaw::bonded_area)).
///
/// # Errors
/// Input that the neighbor search rejects.
pub fn bond(
    block: &mut dyn Contacts,
    rows: &PairCoefficients,
    particles: &Particles,
    cell: Option<&Cell>,
    interaction_ratio: f64,
) -> Result<BondCount, NeighborError> {
    bond_unless(block, rows, particles, cell, interaction_ratio, &|_| true, &mut |_, _| false)
}

/// As [`bond`], but in a block that may hold other bonds, and without the bonds for which `severed` is true; its arguments are the two
/// centers, m. `counts`: particles whose radii count in the mean radius to which sections refer.
///
/// # Errors
/// Those of [`bond`].
pub fn bond_unless(
    block: &mut dyn Contacts,
    rows: &PairCoefficients,
    particles: &Particles,
    cell: Option<&Cell>,
    interaction_ratio: f64,
    counts: &dyn Fn(usize) -> bool,
    severed: &mut dyn FnMut(&Vec3, &Vec3) -> bool,
) -> Result<BondCount, NeighborError> {
    let before = block.len();
    let reach: Vec<f64> = particles.radius.iter().map(|r| r * interaction_ratio * (1.0 + TIE)).collect();
    let mut ties = 0;
    let mut bonder = Bonder::new(rows, particles, severed);
    let candidates = candidate_pairs(&particles.position, &reach, cell)?;
    bonder.found.reserve(candidates.len());
    for candidate in candidates {
        let (a, b) = (candidate.a as usize, candidate.b as usize);
        let shift = cell.map_or_else(Vec3::zeros, |cell| cell.shift(candidate.image));
        if let Some(length) = bonder.bond(Pair { a: candidate.a, b: candidate.b }, candidate.image, &shift) {
            let sum = particles.radius[a] + particles.radius[b];
            ties += usize::from(length >= interaction_ratio * sum * (1.0 - TIE));
        }
    }
    bonder.finish(block, counts);
    Ok(BondCount { bonds: block.len() - before, ties })
}

/// Bond pairs as [`bond`] does, in a block that may hold bonds already, if they are `wanted`. Returns the new bonds, in ascending order.
///
/// # Errors
/// Those of [`bond`].
pub fn bond_more(
    block: &mut dyn Contacts,
    rows: &PairCoefficients,
    particles: &Particles,
    cell: Option<&Cell>,
    interaction_ratio: f64,
    wanted: &dyn Fn(Pair, [i8; 3]) -> bool,
) -> Result<Vec<(Pair, [i8; 3])>, NeighborError> {
    let reach: Vec<f64> = particles.radius.iter().map(|r| r * interaction_ratio * (1.0 + TIE)).collect();
    let never = &mut |_: &Vec3, _: &Vec3| false;
    let mut bonder = Bonder::new(rows, particles, never);
    let mut made = Vec::new();
    for candidate in candidate_pairs(&particles.position, &reach, cell)? {
        let (pair, image) = (Pair { a: candidate.a, b: candidate.b }, candidate.image);
        let shift = cell.map_or_else(Vec3::zeros, |cell| cell.shift(image));
        if wanted(pair, image) && bonder.bond(pair, image, &shift).is_some() {
            made.push((pair, image));
        }
    }
    bonder.finish(block, &|_| true);
    made.sort_unstable();
    Ok(made)
}

/// As [`bond_unless`], but for given pairs, the lower index first, without a periodic cell.
pub fn bond_links(
    block: &mut dyn Contacts,
    rows: &PairCoefficients,
    particles: &Particles,
    links: &[[u32; 2]],
    counts: &dyn Fn(usize) -> bool,
    severed: &mut dyn FnMut(&Vec3, &Vec3) -> bool,
) -> BondCount {
    let before = block.len();
    let mut bonder = Bonder::new(rows, particles, severed);
    for &[a, b] in links {
        bonder.bond(Pair { a, b }, [0; 3], &Vec3::zeros());
    }
    bonder.finish(block, counts);
    BondCount { bonds: block.len() - before, ties: 0 }
}

/// Longest of given pairs over the sum of their radii; at least 1.
pub fn longest(links: &[[u32; 2]], particles: &Particles) -> f64 {
    let ratio = |&[a, b]: &[u32; 2]| {
        let (a, b) = (a as usize, b as usize);
        (particles.position[a] - particles.position[b]).norm() / (particles.radius[a] + particles.radius[b])
    };
    links.iter().map(ratio).fold(1.0, f64::max)
}

/// Collects bonds. Their cross-sections may depend on the mean radius of the bonded particles, which is known at the end.
struct Bonder<'a> {
    rows: &'a PairCoefficients,
    particles: &'a Particles,
    severed: &'a mut dyn FnMut(&Vec3, &Vec3) -> bool,
    found: Vec<(Pair, ContactFlags, PreviousGeometry)>,
}

impl<'a> Bonder<'a> {
    fn new(
        rows: &'a PairCoefficients,
        particles: &'a Particles,
        severed: &'a mut dyn FnMut(&Vec3, &Vec3) -> bool,
    ) -> Self {
        Self { rows, particles, severed, found: Vec::new() }
    }

    /// Bonds a pair; returns its length, m, or `None` if it must not be bonded.
    fn bond(&mut self, pair: Pair, image: [i8; 3], shift: &Vec3) -> Option<f64> {
        let particles = self.particles;
        let (a, b) = (pair.a as usize, pair.b as usize);
        if particles.clump[a] != u32::MAX && particles.clump[a] == particles.clump[b] {
            return None;
        }
        let aggregates = [particles.aggregate_of(a), particles.aggregate_of(b)];
        let row = self.rows.of_bond([particles.material[a], particles.material[b]], aggregates)?;
        if (self.severed)(&particles.position[a], &(particles.position[b] + shift)) {
            return None;
        }
        let geometry = initial_geometry(&particles.position[a], &particles.position[b], shift);
        let flags = ContactFlags { row, bits: ContactFlags::BONDED | ContactFlags::ACTIVE, image, padding: 0 };
        self.found.push((pair, flags, geometry));
        Some(geometry.length)
    }

    /// Adds the bonds to a block and sorts it.
    fn finish(self, block: &mut dyn Contacts, counts: &dyn Fn(usize) -> bool) {
        let radius = &self.particles.radius;
        let mean_radius = self.mean_radius(counts);
        block.reserve(self.found.len());
        for (pair, flags, geometry) in self.found {
            let area = block.bonded_area(flags.row, radius[pair.a as usize], radius[pair.b as usize], mean_radius);
            block.push(pair, flags, Reference { length: geometry.length, area }, geometry);
        }
        block.sort();
    }

    /// Mean radius of the particles that get bonds, m; 0 without bonds. As in LIGGGHTS and LAMMPS, particles without bonds do not
    /// count, nor do those without `counts`.
    fn mean_radius(&self, counts: &dyn Fn(usize) -> bool) -> f64 {
        let mut bonded = vec![false; self.particles.len()];
        for (pair, ..) in &self.found {
            bonded[pair.a as usize] = true;
            bonded[pair.b as usize] = true;
        }
        let counted = (0..bonded.len()).filter(|&p| bonded[p] && counts(p));
        let (count, sum) = counted.fold((0, 0.0), |(count, sum), p| (count + 1, sum + self.particles.radius[p]));
        sum / f64::from(count.max(1))
    }
}

/// Interaction ratio at which a packing has `coordination` bonds per particle, and the coordination number reached: the
/// network correction of Jebahi et al. 2015, section 2.3.1.3 (larger radii for the search alone). Instead of bisection,
/// this sorts the pairs by center distance over sum of radii. Pairs with equal ratios, up to the relative tolerance
/// [`TIE`], are bonded together, so the coordination number reached may exceed the requested one. `None` if there are
/// too few pairs within twice the radii.
pub fn ratio_for_coordination(
    spheres: &[concordem_solver::state::Sphere],
    cell: Option<&Cell>,
    coordination: f64,
) -> Result<Option<(f64, f64)>, NeighborError> {
    ratio_inside(spheres, cell, &vec![false; spheres.len()], coordination)
}

/// As [`ratio_for_coordination`], but for the spheres that are not at the `boundary`: their mean number of bonds is
/// `(2 N_ii + N_ib)/N_i` with the bonds among them and those to the boundary.
///
/// # Errors
/// Input that the neighbor search rejects.
pub fn ratio_inside(
    spheres: &[concordem_solver::state::Sphere],
    cell: Option<&Cell>,
    boundary: &[bool],
    coordination: f64,
) -> Result<Option<(f64, f64)>, NeighborError> {
    /// Largest ratio searched.
    const REACH: f64 = 2.0;
    let inside = boundary.iter().filter(|outer| !**outer).count();
    let wanted = 2 * (0.5 * coordination * inside as f64).round() as usize;
    let positions: Vec<Vec3> = spheres.iter().map(|s| s.position).collect();
    let mut reach = 1.1;
    loop {
        let radii: Vec<f64> = spheres.iter().map(|s| s.radius * reach).collect();
        // Each pair with its number of ends inside.
        let mut ratios: Vec<(f64, usize)> = candidate_pairs(&positions, &radii, cell)?
            .iter()
            .map(|pair| {
                let (a, b) = (pair.a as usize, pair.b as usize);
                let shift = cell.map_or_else(Vec3::zeros, |cell| cell.shift(pair.image));
                let ratio = (positions[b] + shift - positions[a]).norm() / (spheres[a].radius + spheres[b].radius);
                (ratio, usize::from(!boundary[a]) + usize::from(!boundary[b]))
            })
            .filter(|(_, ends)| *ends > 0)
            .collect();
        ratios.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let mut ends = 0;
        let enough = ratios.iter().position(|pair| {
            ends += pair.1;
            ends >= wanted
        });
        // One pair more, so that the ratio can lie between two of them.
        if let Some(last) = enough.filter(|last| wanted > 0 && last + 1 < ratios.len()) {
            let ratio = 0.5 * (ratios[last].0 + ratios[last + 1].0);
            let bonds = ratios.partition_point(|each| each.0 <= ratio * (1.0 + TIE));
            let ends: usize = ratios[..bonds].iter().map(|pair| pair.1).sum();
            return Ok(Some((ratio, ends as f64 / inside as f64)));
        }
        if reach >= REACH || wanted == 0 {
            return Ok(None);
        }
        reach = (reach * 1.3).min(REACH);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::Lattice;
    use concordem_contact::law::{CohesiveBeam, LinearBond, Section};
    use concordem_solver::state::Sphere;
    use concordem_solver::state::contacts::ContactBlock;

    /// Number of bonds of a lattice at the interaction ratio 1.
    fn bonds_of(lattice: Lattice, radius: f64, repeats: [u32; 3]) -> BondCount {
        let packing = lattice.periodic(radius, repeats).unwrap();
        let mut particles = Particles::default();
        packing.spheres.iter().for_each(|sphere| particles.push(*sphere, 0, 1.0, 1.0));
        let mut rows = PairCoefficients::new(1);
        rows.set(0, 0, 0);
        let mut block = ContactBlock::new(vec![LinearBond::new(1.0, 1.0, 0.0, f64::INFINITY, f64::INFINITY).unwrap()]);
        bond(&mut block, &rows, &particles, packing.cell.as_ref(), 1.0).unwrap()
    }

    /// Nearest neighbors of a lattice touch: all are bonded, whatever the last digits of the radius. Each particle owns
    /// half of its 6, 8, 12, 12, 4, and 6 bonds.
    #[test]
    fn rounding_does_not_lose_bonds_of_touching_spheres() {
        for radius in [1.0, 1e-3, 0.7e-3, 1.3e-3, 0.123_456_789e-3] {
            for (lattice, particles, neighbors) in [
                (Lattice::SimpleCubic, 27, 6),
                (Lattice::BodyCentered, 54, 8),
                (Lattice::FaceCentered, 108, 12),
                (Lattice::HexagonalClosePacked, 108, 12),
            ] {
                let found = bonds_of(lattice, radius, [3; 3]);
                let all = particles * neighbors / 2;
                assert_eq!(found, BondCount { bonds: all, ties: all }, "{lattice:?}, radius {radius}");
            }
        }
        for radius in [1e-3, 0.7e-3] {
            assert_eq!(bonds_of(Lattice::Square, radius, [3, 3, 1]).bonds, 18);
            assert_eq!(bonds_of(Lattice::Triangular, radius, [3, 3, 1]).bonds, 54);
        }
    }

    /// A simple cubic lattice has 6 touching neighbors, and 18 up to √2 of that distance. Any coordination number
    /// between them is reached at a ratio between 1 and √2, or at √2 itself if it would cut through a shell.
    #[test]
    fn coordination_is_reached() {
        let packing = Lattice::SimpleCubic.periodic(1.0, [4, 4, 4]).unwrap();
        let ratio = |z: f64| ratio_for_coordination(&packing.spheres, packing.cell.as_ref(), z).unwrap();
        let (between, reached) = ratio(6.0).unwrap();
        // Half way from 1 to √2.
        assert!((between - 0.5 * (1.0 + 2f64.sqrt())).abs() < 1e-12 && reached == 6.0, "{between} {reached}");
        // All twelve second neighbors of a particle are bonded, not only those that rounding puts first.
        let (within, reached) = ratio(10.0).unwrap();
        assert!((within - 2f64.sqrt()).abs() < 1e-12 && reached == 18.0, "{within} {reached}");
        assert_eq!(ratio(1000.0), None);
    }

    /// A large sphere far away does not thicken beams whose radius is relative to the mean one.
    #[test]
    fn particles_without_bonds_do_not_count_in_the_mean_radius() {
        let beam = CohesiveBeam::new(1e9, 0.2, Section::Ratio(0.5)).unwrap();
        let mut rows = PairCoefficients::new(1);
        rows.set(0, 0, 0);
        let area = |far: Option<f64>| {
            let mut particles = Particles::default();
            for (k, radius) in [1.0, 2.0, 3.0].into_iter().enumerate() {
                particles.push(Sphere { position: Vec3::x() * 3.0 * k as f64, radius }, 0, 1.0, 1.0);
            }
            if let Some(radius) = far {
                particles.push(Sphere { position: Vec3::y() * 100.0, radius }, 0, 1.0, 1.0);
            }
            let mut block = ContactBlock::new(vec![beam]);
            assert_eq!(bond(&mut block, &rows, &particles, None, 1.0).unwrap().bonds, 2);
            block.reference.get(0).area
        };
        // Exact sums of few digits.
        assert_eq!(area(None), std::f64::consts::PI);
        assert_eq!(area(Some(50.0)), area(None));
    }

    /// Members of a rigid body are not bonded to each other, only to others.
    #[test]
    fn a_body_has_no_bonds_within() {
        let mut particles = Particles::default();
        for k in 0..3 {
            particles.push(Sphere { position: Vec3::x() * 2.0 * f64::from(k), radius: 1.0 }, 0, 1.0, 1.0);
        }
        let mut rows = PairCoefficients::new(1);
        rows.set(0, 0, 0);
        let law = LinearBond::new(1.0, 1.0, 0.0, f64::INFINITY, f64::INFINITY).unwrap();
        for (clump, bonds) in [([u32::MAX; 3], 2), ([0, 0, u32::MAX], 1), ([0, 0, 0], 0), ([u32::MAX, 0, 0], 1)] {
            particles.clump = clump.to_vec();
            let found = bond(&mut ContactBlock::new(vec![law]), &rows, &particles, None, 1.0).unwrap();
            assert_eq!(found.bonds, bonds, "{clump:?}");
        }
    }
}
