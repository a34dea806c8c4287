//! Bonds near the faces of a body that is cut from a periodic packing.
//!
//! A cut removes whole bonds, also their parts inside the body, so that a layer of about a quarter of a diameter carries nothing. Here the bonds of
//! a particle that remain take over what the lost parts carried within the face: with the areas A, lengths L, and directions n of bonds, the part t
//! of a lost bond that lies inside, and w = 1 − (n·m)² with the mean direction m of the lost bonds,
//!
//! `p = 1 + Σ_lost t A L w / (½ Σ_left A L w)`,
//!
//! and the area of a bond is multiplied by the mean of both particles' p. Sums of A L over a body are thus those of its volume in the packing.

use concordem_contact::geometry::contact_area;
use concordem_contact::math::Vec3;
use concordem_packing::{Crop, Shape, TIE, cut_away};
use concordem_solver::neighbor::candidate_pairs;
use concordem_solver::state::Particles;
use concordem_solver::state::contacts::Contacts;

use super::{AssemblyError, Placed, unfit};
use crate::schema::{Problem, Scenario};

/// Largest p: a particle in the corner of a box has lost seven of eight neighbors.
const LARGEST: f64 = 8.0;
/// Halvings of the part of a bond that lies inside: 1e-6 of its length.
const HALVINGS: usize = 20;
/// An interaction ratio below which the layer is only half as stiff as it should be: the few bonds of a particle there no longer move together.
const FEWEST: f64 = 1.3;

/// Multiplies the areas of the bonds near faces, if the scenario wants it.
pub(super) fn correct(
    scenario: &Scenario,
    placed: &Placed,
    interaction_ratio: f64,
    particles: &Particles,
    bonds: &mut dyn Contacts,
) -> Result<Option<Problem>, AssemblyError> {
    if !scenario.bonds.as_ref().is_some_and(|section| section.face_correction) {
        return Ok(None);
    }
    let (Some(unit), Some(body)) = (&placed.unit, &placed.body) else {
        return Err(unfit("bonds.face_correction", "needs a body that is cut from a periodic packing".into()));
    };
    let factors = factors(unit, body, interaction_ratio, particles)?;
    bonds.scale_areas(&|pair| 0.5 * (factors[pair.a as usize] + factors[pair.b as usize]));
    Ok((interaction_ratio < FEWEST).then(|| {
        let message = format!(
            "has half of its effect at an interaction ratio of {interaction_ratio:.3}: too few bonds meet at a particle"
        );
        scenario.warning("bonds.face_correction", message, "give bonds.interaction_ratio = 1.5, or larger specimens")
    }))
}

/// The factor p of every particle.
fn factors(
    unit: &concordem_packing::Packing,
    body: &Shape,
    interaction_ratio: f64,
    particles: &Particles,
) -> Result<Vec<f64>, AssemblyError> {
    let count = particles.len();
    let largest = unit.spheres.iter().map(|sphere| sphere.radius).fold(0.0, f64::max);
    let lost = cut_away(unit, body, Crop::Centers, Vec3::zeros(), 2.0 * largest * interaction_ratio * (1.0 + TIE))?;
    let position: Vec<Vec3> =
        particles.position.iter().copied().chain(lost.iter().map(|sphere| sphere.position)).collect();
    let radius: Vec<f64> = particles.radius.iter().copied().chain(lost.iter().map(|sphere| sphere.radius)).collect();
    let reach: Vec<f64> = radius.iter().map(|r| r * interaction_ratio * (1.0 + TIE)).collect();
    let pairs = candidate_pairs(&position, &reach, None)?;
    let pairs: Vec<[usize; 2]> =
        pairs.iter().map(|pair| [pair.a as usize, pair.b as usize]).filter(|[a, _]| *a < count).collect();
    // From the particle to its neighbor: unit vector, and A L.
    let bond = |from: usize, to: usize| {
        let branch = position[to] - position[from];
        let length = branch.norm();
        (branch / length, contact_area(radius[from], radius[to]) * length)
    };
    let mut direction = vec![Vec3::zeros(); count];
    for &[a, b] in pairs.iter().filter(|[_, b]| *b >= count) {
        let (n, _) = bond(a, b);
        direction[a] += n * contact_area(radius[a], radius[b]);
    }
    // A particle whose lost bonds cancel out has no direction: all of its bonds count in full.
    for m in &mut direction {
        *m = m.try_normalize(0.0).unwrap_or_default();
    }
    let weight = |p: usize, n: &Vec3| 1.0 - n.dot(&direction[p]).powi(2);
    let mut sums = vec![[0.0; 2]; count];
    for &[a, b] in &pairs {
        let (n, volume) = bond(a, b);
        if b < count {
            sums[a][0] += 0.5 * volume * weight(a, &n);
            sums[b][0] += 0.5 * volume * weight(b, &n);
        } else {
            sums[a][1] += part_inside(body, &position[a], &position[b]) * volume * weight(a, &n);
        }
    }
    Ok(sums.iter().map(|[left, lost]| if *lost > 0.0 { (1.0 + lost / left).min(LARGEST) } else { 1.0 }).collect())
}

/// Part of the way from a point inside to one outside that lies inside.
fn part_inside(body: &Shape, inside: &Vec3, outside: &Vec3) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle: f64 = 0.5 * (low + high);
        let point = inside + (outside - inside) * middle;
        if body.contains(&point, 0.0) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use concordem_packing::{Lattice, tile_and_crop};

    /// Particles of a body cut from a simple cubic lattice with the spacing 2, whose bonds reach one spacing.
    fn cut(body: &Shape) -> (Particles, Vec<f64>) {
        let unit = Lattice::SimpleCubic.periodic(1.0, [3; 3]).unwrap();
        let spheres = tile_and_crop(&unit, body, Crop::Centers, Vec3::zeros()).unwrap().spheres;
        let mut particles = Particles::default();
        for sphere in spheres {
            particles.push(sphere, 0, 1.0, 1.0);
        }
        let factors = factors(&unit, body, 1.1, &particles).unwrap();
        (particles, factors)
    }

    /// In a block of 3³ spheres whose faces lie a fraction t of a spacing beyond the outermost centers, a lost bond is normal to its face, so that it
    /// carries nothing within: factors of 1. At an edge, the lost bonds point along the diagonal: each carries half, and the one along the edge counts
    /// in full beside two halves: p = 1 + 2t/2 / (½ (2 + 2/2)); at a corner with the weights ⅔: 1 + 3t ⅔/(½ 3 ⅔).
    #[test]
    fn faces_edges_and_corners_of_a_lattice() {
        let lattice = Lattice::SimpleCubic.periodic(1.0, [3; 3]).unwrap();
        let corner = lattice.spheres[0].position;
        for t in [0.25, 0.5, 0.75] {
            let body = Shape::new_box(corner.add_scalar(-2.0 * t), corner.add_scalar(4.0 + 2.0 * t)).unwrap();
            let (particles, factors) = cut(&body);
            assert_eq!(particles.len(), 27);
            for (position, factor) in particles.position.iter().zip(factors) {
                let outer = (0..3).filter(|k| (position[*k] - corner[*k] - 2.0).abs() > 1.0).count();
                let expected = match outer {
                    0 | 1 => 1.0,
                    2 => 1.0 + t / 1.5,
                    _ => 1.0 + 2.0 * t,
                };
                // Twenty halvings.
                assert!((factor - expected).abs() < 2e-6, "{position} {factor} {expected}");
            }
        }
    }

    /// Its lost bonds in all directions cancel out, and none is left that could carry: the factor keeps its bound.
    #[test]
    fn a_particle_alone_has_no_bond_to_correct() {
        let lattice = Lattice::SimpleCubic.periodic(1.0, [3; 3]).unwrap();
        let center = lattice.spheres[0].position;
        let body = Shape::new_sphere(center, 0.5).unwrap();
        let (particles, factors) = cut(&body);
        assert_eq!((particles.len(), factors.len()), (1, 1));
        assert_eq!(factors, [LARGEST]);
    }
}
