//! Coordination number of a bounded body (Jebahi et al. 2015, \[2.6\] and the correction in the text below it).

use crate::error::OperatorError;

/// Coordination numbers of a packing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordination {
    /// `2C/N` \[2.6\] with all links `C` and particles `N`, which counts particles at the surface as if they were inside.
    pub of_all: f64,
    /// Mean number of links of a particle inside: `(2 N_ii + N_ib)/N_i` with the links between two particles inside and between
    /// one inside and one at the boundary. Links between two particles at the boundary do not count. NaN if there is none inside.
    pub inside: f64,
    /// Mean number of links of a particle at the boundary; NaN if there is none.
    pub at_boundary: f64,
    /// Particles inside.
    pub particles_inside: usize,
    /// Links `N_ii` between two particles inside.
    pub links_inside: usize,
    /// Links `N_ib` between one particle inside and one at the boundary.
    pub links_across: usize,
    /// Links between two particles at the boundary.
    pub links_at_boundary: usize,
    /// Particles without a link.
    pub without: usize,
}

/// Coordination numbers of particles with the links `pairs`; `boundary`: whether each particle belongs to the boundary.
///
/// \[2.6\] holds without a boundary. The source leaves out the particles at the boundary "as well as the contacts between them";
/// a link from inside to the boundary then counts once, for the particle inside.
///
/// # Errors
/// A pair that names a particle that does not exist.
///
/// ```
/// use concordem_operator::structure::coordination;
///
/// // A row of three; the last particle is at the boundary.
/// let found = coordination(&[[0, 1], [1, 2]], &[false, false, true]).unwrap();
/// // (2 · 1 link inside + 1 across) / 2 particles
/// assert_eq!(found.inside, 1.5);
/// ```
pub fn coordination(pairs: &[[u32; 2]], boundary: &[bool]) -> Result<Coordination, OperatorError> {
    let count = boundary.len();
    let mut links = vec![0_u32; count];
    let (mut inside, mut across, mut outside) = (0, 0, 0);
    for (entry, pair) in pairs.iter().enumerate() {
        if let Some(&index) = pair.iter().find(|p| **p as usize >= count) {
            return Err(OperatorError::Index { name: "pairs", entry, index, count });
        }
        let [a, b] = pair.map(|p| p as usize);
        links[a] += 1;
        links[b] += 1;
        match (boundary[a], boundary[b]) {
            (false, false) => inside += 1,
            (true, true) => outside += 1,
            _ => across += 1,
        }
    }
    let at_boundary = boundary.iter().filter(|b| **b).count();
    let per = |ends: usize, particles: usize| ends as f64 / particles as f64;
    Ok(Coordination {
        of_all: per(2 * pairs.len(), count),
        inside: per(2 * inside + across, count - at_boundary),
        at_boundary: per(2 * outside + across, at_boundary),
        particles_inside: count - at_boundary,
        links_inside: inside,
        links_across: across,
        links_at_boundary: outside,
        without: links.iter().filter(|n| **n == 0).count(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of 4³ spheres on a simple cubic lattice: the 8 inside have 6 links each, 12 among themselves and 24 to the boundary.
    #[test]
    fn a_cubic_body_has_six_links_inside() {
        let at = |i: u32, j: u32, k: u32| (k * 4 + j) * 4 + i;
        let mut pairs = Vec::new();
        let mut boundary = Vec::new();
        for k in 0..4 {
            for j in 0..4 {
                for i in 0..4 {
                    boundary.push([i, j, k].iter().any(|n| *n == 0 || *n == 3));
                    if i < 3 {
                        pairs.push([at(i, j, k), at(i + 1, j, k)]);
                    }
                    if j < 3 {
                        pairs.push([at(i, j, k), at(i, j + 1, k)]);
                    }
                    if k < 3 {
                        pairs.push([at(i, j, k), at(i, j, k + 1)]);
                    }
                }
            }
        }
        let found = coordination(&pairs, &boundary).unwrap();
        assert_eq!(found.inside, 6.0);
        assert_eq!((found.links_inside, found.links_across, found.links_at_boundary), (12, 24, 108));
        assert_eq!(found.of_all, 2.0 * 144.0 / 64.0);
        assert_eq!(found.at_boundary, (2.0 * 108.0 + 24.0) / 56.0);
        assert!(coordination(&[[0, 64]], &boundary).is_err());
        assert!(coordination(&[], &[true]).unwrap().inside.is_nan());
    }
}
