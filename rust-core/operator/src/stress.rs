//! Stress from contacts: of single particles, of regions, from boundary forces, and from walls.

use std::ops::Range;

use rayon::prelude::*;

use super::contact_set::{ContactSet, LoadSet};
use super::error::{OperatorError, check_length, check_not_negative, check_volume};
use super::region::{self, Period, Region, Truncation};
use super::sum::{sum_tiles, sums};
use concordem_contact::math::{Mat3, Vec3};

/// Division of the branch vector of a contact between its two particles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Partition {
    /// At the contact point: arms `c − x_p` (ERDC 2019, (8); Stránský 2018, (4.58)).
    #[default]
    ContactPoint,
    /// In the middle, whatever the radii (Jebahi et al. 2015, (1.13)). Equal to the division at the contact point if
    /// that is in the middle; the total over internal contacts is always the same.
    HalfBranch,
}

/// Volume that a particle's stress refers to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParticleVolume {
    /// Volume of the sphere: `4πR³/3`.
    Sphere,
    /// Volume of a disc of unit depth: `πR²`.
    Disc,
    /// Volume of the sphere over a solid fraction (YADE's concrete model: 0.62).
    Packing(f64),
}

impl ParticleVolume {
    /// Volumes of particles with the given radii (m), m³. (Volumes of Voronoi or Laguerre cells come from
    /// [`super::tessellation::PowerDiagram::volumes`].)
    pub fn of(self, radius: &[f64]) -> Result<Vec<f64>, OperatorError> {
        use std::f64::consts::PI;
        let fraction = match self {
            Self::Packing(fraction) if !(fraction > 0.0 && fraction <= 1.0) => {
                let demand = "a packing fraction is more than 0 and at most 1";
                return Err(OperatorError::Constant { name: "packing fraction", value: fraction, demand });
            }
            Self::Packing(fraction) => fraction,
            _ => 1.0,
        };
        let ball = |r: f64| 4.0 / 3.0 * PI * (r * r * r);
        let volume = |&r: &f64| if self == Self::Disc { PI * (r * r) } else { ball(r) / fraction };
        radius.iter().map(|r| check_volume("a particle", volume(r))).collect()
    }
}

/// Moments `V_p σ_p = Σ_c r^{pc}⊗f^{pc}` (J) of every particle over its contacts and loads, with the arms of [`Partition`].
/// Loads (walls) always act with their own arm `c − x_p`.
///
/// Divided by a particle's volume this is its mean stress if it is in equilibrium (ERDC 2019, (8); operator O1, O2).
pub fn particle_moments(contacts: &ContactSet<'_>, loads: &LoadSet<'_>, partition: Partition) -> Vec<Mat3> {
    let mut moments = match partition {
        Partition::ContactPoint => particle_sums(contacts, |c| {
            let force = c.force.transpose();
            (c.arm_a * force, -(c.arm_b * force))
        }),
        Partition::HalfBranch => particle_sums(contacts, |c| {
            let half = (c.branch * 0.5) * c.force.transpose();
            (half, half)
        }),
    };
    for k in 0..loads.len() {
        let (p, point, force, _) = loads.get(k);
        moments[p] += (point - contacts.position()[p]) * force.transpose();
    }
    moments
}

/// Stress `σ_p` (Pa) of every particle: [`particle_moments`] over the volumes (m³).
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::{ContactSet, LoadSet, stress::{Partition, particle_stress}};
///
/// // Two spheres of radius 1 m pull each other with 5 N.
/// let position = [Vec3::zeros(), Vec3::new(2.0, 0.0, 0.0)];
/// let (pair, branch, point, force) = ([[0, 1]], [Vec3::x() * 2.0], [Vec3::x()], [Vec3::x() * 5.0]);
/// let contacts = ContactSet::new(&position, &pair, &branch, &point, &force, None).unwrap();
///
/// let stress = particle_stress(&contacts, &LoadSet::none(), Partition::ContactPoint, &[4.0, 4.0]).unwrap();
/// // Arm 1 m, force 5 N, volume 4 m³, for both.
/// assert_eq!([stress[0][(0, 0)], stress[1][(0, 0)]], [1.25, 1.25]);
/// ```
pub fn particle_stress(
    contacts: &ContactSet<'_>,
    loads: &LoadSet<'_>,
    partition: Partition,
    volumes: &[f64],
) -> Result<Vec<Mat3>, OperatorError> {
    check_length("volumes", volumes.len(), contacts.position().len(), "particle")?;
    volumes.iter().try_for_each(|&v| check_volume("a particle", v).map(drop))?;
    let mut stress = particle_moments(contacts, loads, partition);
    stress.par_iter_mut().zip(volumes).for_each(|(stress, volume)| *stress /= *volume);
    Ok(stress)
}

/// Number of pieces into which a list of contacts is cut for sums by particle. Fixed, so that the order of additions
/// does not depend on the number of threads.
const PIECES: usize = 16;

/// Sums by particle of the values that `of` assigns to A and B of every contact, in an order that depends only on the
/// contacts.
///
/// Each piece of the list adds to its own particles in place, and to particles of a later piece in a halo, like the
/// solver's tiles. That requires contacts at least roughly sorted by particle; others are added in one piece.
pub(super) fn particle_sums<T, F>(contacts: &ContactSet<'_>, of: F) -> Vec<T>
where
    T: Default + Clone + Send + Sync + std::ops::AddAssign,
    F: Fn(&super::Contact) -> (T, T) + Sync,
{
    let n = contacts.position().len();
    let count = contacts.len();
    let pair = contacts.pair();
    let bounds = |k: usize| k * count / PIECES..(k + 1) * count / PIECES;
    // Sums of the contacts of a piece, for particles from `low` on, split where the next piece's particles begin.
    let add = |piece: Range<usize>, low: usize, own: &mut [T], halo: &mut [T]| {
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                let split = low + own.len();
                let mut put = |p: usize, value: T| {
                    *(if p < split { &mut own[p - low] } else { &mut halo[p - split] }) += value;
                };
                // Consecutive contacts with the same A add to a local sum, in the same order.
                let part = contacts.part(piece);
                let mut k = 0;
                while k < part.len() {
                    let a = part.pair()[k][0];
                    let mut sum = T::default();
                    while k < part.len() && part.pair()[k][0] == a {
                        let contact = part.get(k);
                        let (to_a, to_b) = of(&contact);
                        sum += to_a;
                        put(contact.b, to_b);
                        k += 1;
                    }
                    put(a as usize, sum);
                }
            },
        );
    };
    let mut sums = vec![T::default(); n];
    let mut range: Vec<(usize, usize)> = (0..PIECES)
        .into_par_iter()
        .map(|k| {
            let piece = pair[bounds(k)].as_flattened();
            let (first, last) = pulp::Arch::new().dispatch(
                #[inline(always)]
                || piece.iter().fold((u32::MAX, 0), |(low, high), &p| (p.min(low), p.max(high))),
            );
            if piece.is_empty() { (n, 0) } else { (first as usize, last as usize + 1) }
        })
        .collect();
    range.push((n, n));
    let halo = |k: usize| range[k].1.saturating_sub(range[k + 1].0);
    let is_sorted = range.windows(2).all(|w| w[0].0 <= w[1].0);
    if count < 4096 || !is_sorted || (0..PIECES).map(halo).sum::<usize>() > n {
        add(0..count, 0, &mut sums, &mut []);
        return sums;
    }
    let mut rest = &mut sums[range[0].0..];
    let mut pieces = Vec::with_capacity(PIECES);
    for k in 0..PIECES {
        let (own, others) = rest.split_at_mut(range[k + 1].0 - range[k].0);
        pieces.push((k, own, vec![T::default(); halo(k)]));
        rest = others;
    }
    pieces.par_iter_mut().for_each(|(k, own, halo)| add(bounds(*k), range[*k].0, own, halo));
    let halos: Vec<(usize, Vec<T>)> = pieces.into_iter().map(|(k, _, halo)| (range[k + 1].0, halo)).collect();
    for (first, halo) in halos {
        sums[first..].iter_mut().zip(halo).for_each(|(sum, value)| *sum += value);
    }
    sums
}

/// Mean stress of a region, with its volume and number of contacts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RegionStress {
    /// Stress `σ_ij` (i: position, j: force), Pa; tension positive, not symmetrized.
    pub stress: Mat3,
    /// Volume of the region, m³.
    pub volume: f64,
    /// Weight of contacts at the border.
    pub truncation: Truncation,
    /// Number of contacts with full weight.
    pub full: f64,
    /// Number of contacts with partial weight.
    pub partial: f64,
}

sums!(BranchSums { moment: Mat3, full: f64, partial: f64 });

/// Stress of a region by the branch sum `σ = (1/V) Σ_c w_c l⊗f^A` (operator O3; Stránský 2018, (4.56)).
///
/// `w_c` is the contact's weight by [`Truncation`]. With `period`, all periodic images that reach into the region are
/// included. The result does not depend on the contact points, and on the particles' reference points only if the
/// particles are not in equilibrium.
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::{ContactSet, Region, Truncation, stress::region_stress};
///
/// // Two spheres of radius 1 m pull each other with 5 N.
/// let position = [Vec3::zeros(), Vec3::new(2.0, 0.0, 0.0)];
/// let (pair, branch, point, force) = ([[0, 1]], [Vec3::x() * 2.0], [Vec3::x()], [Vec3::x() * 5.0]);
/// let contacts = ContactSet::new(&position, &pair, &branch, &point, &force, None).unwrap();
///
/// let found = region_stress(&contacts, &Region::All { volume: 10.0 }, Truncation::BranchClipped, None).unwrap();
/// // σ = Σ l ⊗ f / V
/// assert_eq!(found.stress[(0, 0)], 1.0);
/// ```
pub fn region_stress(
    contacts: &ContactSet<'_>,
    region: &Region,
    truncation: Truncation,
    period: Option<&Period>,
) -> Result<RegionStress, OperatorError> {
    let volume = region::check(region, truncation, contacts.position(), period)?;
    let (branch, force) = (contacts.branch(), contacts.force());
    let sums = if matches!(region, Region::All { .. }) {
        let mut sums = sum_tiles(contacts.len(), |range| {
            let mut moment = Mat3::zeros();
            for (l, f) in branch[range.clone()].iter().zip(&force[range]) {
                moment += l * f.transpose();
            }
            BranchSums { moment, full: 0.0, partial: 0.0 }
        });
        sums.full = contacts.len() as f64;
        sums
    } else {
        let count = |sums: &mut BranchSums, k: usize, x: &Vec3| {
            let ([a, b], l) = (contacts.pair()[k], &branch[k]);
            let weight = region::weight(region, truncation, a as usize, b as usize, x, l);
            if weight > 0.0 {
                sums.moment += (l * weight) * force[k].transpose();
                *(if weight < 1.0 { &mut sums.partial } else { &mut sums.full }) += 1.0;
            }
        };
        sum_tiles(contacts.len(), |range| match period {
            None => pulp::Arch::new().dispatch(
                #[inline(always)]
                || away_from_border(contacts, region, range, count),
            ),
            Some(period) => {
                let (mut sums, images) = (BranchSums::default(), region.images(Some(period)));
                for k in range {
                    let x = &contacts.position()[contacts.pair()[k][0] as usize];
                    for image in images.of(x, &branch[k]) {
                        count(&mut sums, k, &(x + period.edges * image));
                    }
                }
                sums
            }
        })
    };
    Ok(RegionStress { stress: sums.moment / volume, volume, truncation, full: sums.full, partial: sums.partial })
}

/// Sum over the contacts `range`. If the distance of A to the region's border shows that a contact lies inside or
/// outside, this function handles it with few operations and without reading B; `count` handles the others, given the
/// position of A.
#[inline(always)]
fn away_from_border(
    contacts: &ContactSet<'_>,
    region: &Region,
    range: Range<usize>,
    count: impl Fn(&mut BranchSums, usize, &Vec3),
) -> BranchSums {
    let first = range.start;
    let part = contacts.part(range);
    let (pair, branch, force) = (part.pair(), part.branch(), part.force());
    let (mut moment, mut full) = (Mat3::zeros(), 0.0);
    let mut others = BranchSums::default();
    let mut k = 0;
    while k < pair.len() {
        // Consecutive contacts often have the same A.
        let a = pair[k][0];
        let x = contacts.position()[a as usize];
        let depth = region.depth(&x);
        // A branch vector shorter than the distance to the border does not reach it; the margin covers rounding.
        let (is_inside, safe) = (depth > 0.0, depth * depth * (1.0 - 1e-12));
        while k < pair.len() && pair[k][0] == a {
            if safe > branch[k].norm_squared() {
                if is_inside {
                    moment += branch[k] * force[k].transpose();
                    full += 1.0;
                }
            } else {
                count(&mut others, first + k, &x);
            }
            k += 1;
        }
    }
    others += BranchSums { moment, full, partial: 0.0 };
    others
}

/// Stress of a region as volume average over the particles whose centers lie inside: `σ = (1/V) Σ_p V_p σ_p` (operator
/// O4; ERDC 2019, (9)). `moments` (J) are those of [`particle_moments`]. With `period`, images that lie inside are
/// included.
///
/// Equal to the branch sum over the same contacts if all of them are internal (P3). The second form of (9), solid
/// fraction times mean particle stress, is [`solid_fraction`] times the volume-weighted mean.
pub fn region_stress_from_particles(
    position: &[Vec3],
    moments: &[Mat3],
    region: &Region,
    period: Option<&Period>,
) -> Result<Mat3, OperatorError> {
    check_length("moments", moments.len(), position.len(), "particle")?;
    let volume = region::check(region, Truncation::InternalOnly, position, period)?;
    let images = region.images(period);
    let total: Mat3 = sum_tiles(position.len(), |range| {
        let mut sum = Mat3::zeros();
        for p in range {
            images.inside(p, &position[p]).for_each(|_| sum += moments[p]);
        }
        sum
    });
    Ok(total / volume)
}

/// Stress from the forces on a body's boundary, `σ = (1/V) Σ_e x^e⊗f^e` (operator O5; Stránský 2018, (4.54)).
///
/// Independent of the origin only if the forces are in equilibrium. Then it equals the internal form (test P17 shows
/// the difference for forces that act away from the particles' centers).
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::{LoadSet, stress::boundary_stress};
///
/// // A body of 10 m³ between two walls, which press with 5 N at x = ±1 m.
/// let (particle, point, force) = ([0, 1], [-Vec3::x(), Vec3::x()], [Vec3::x() * 5.0, -Vec3::x() * 5.0]);
/// let loads = LoadSet::new(2, &particle, &point, &force, None).unwrap();
/// assert_eq!(boundary_stress(&loads, 10.0).unwrap()[(0, 0)], -1.0);
/// ```
pub fn boundary_stress(loads: &LoadSet<'_>, volume: f64) -> Result<Mat3, OperatorError> {
    let volume = check_volume("the body", volume)?;
    let mut moment = Mat3::zeros();
    for k in 0..loads.len() {
        let (_, point, force, _) = loads.get(k);
        moment += point * force.transpose();
    }
    Ok(moment / volume)
}

/// Traction of particles on a wall, force over area, Pa (operator O7).
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::stress::wall_traction;
///
/// assert_eq!(wall_traction(&Vec3::new(0.0, 0.0, 6.0), 2.0).unwrap().z, 3.0);
/// ```
pub fn wall_traction(force: &Vec3, area: f64) -> Result<Vec3, OperatorError> {
    if area > 0.0 && area.is_finite() {
        Ok(force / area)
    } else {
        Err(OperatorError::Constant { name: "area of the wall", value: area, demand: "it must be positive" })
    }
}

/// Kinetic part of the stress, `−(1/V) Σ_p m_p (v_p − v̄)⊗(v_p − v̄)` over the particles in a region, Pa (operator O8;
/// Jebahi et al. 2015, (1.6) with the mean velocity taken out).
///
/// Add it to the contact stress where motion transfers momentum (granular flow). In a solid it is small, and its use is
/// disputed, so no operator includes it by default. With `period`, images inside the region are included, with
/// velocities that follow its rate.
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::{Region, stress::kinetic_stress};
///
/// // Two particles of 1 kg fly apart at 2 m/s each: like the pressure of a gas.
/// let (position, velocity) = ([Vec3::zeros(), Vec3::x()], [-Vec3::x() * 2.0, Vec3::x() * 2.0]);
/// let stress = kinetic_stress(&position, &[1.0, 1.0], &velocity, &Region::All { volume: 4.0 }, None).unwrap();
/// assert_eq!(stress[(0, 0)], -2.0);
/// ```
pub fn kinetic_stress(
    position: &[Vec3],
    mass: &[f64],
    velocity: &[Vec3],
    region: &Region,
    period: Option<&Period>,
) -> Result<Mat3, OperatorError> {
    check_length("mass", mass.len(), position.len(), "particle")?;
    check_length("velocity", velocity.len(), position.len(), "particle")?;
    check_not_negative("mass", mass.iter().copied())?;
    let volume = region::check(region, Truncation::InternalOnly, position, period)?;
    sums!(Momentum { mass: f64, momentum: Vec3 });
    let carried = |image: &Vec3| period.map_or_else(Vec3::zeros, |period| period.change * image);
    let images = region.images(period);
    let total: Momentum = sum_tiles(position.len(), |range| {
        let mut sum = Momentum::default();
        for p in range {
            for image in images.inside(p, &position[p]) {
                sum += Momentum { mass: mass[p], momentum: (velocity[p] + carried(&image)) * mass[p] };
            }
        }
        sum
    });
    if total.mass == 0.0 {
        return Err(OperatorError::EmptyRegion { what: "particle" });
    }
    let mean = total.momentum / total.mass;
    let flow: Mat3 = sum_tiles(position.len(), |range| {
        let mut sum = Mat3::zeros();
        for p in range {
            for image in images.inside(p, &position[p]) {
                let v = velocity[p] + carried(&image) - mean;
                sum += (v * mass[p]) * v.transpose();
            }
        }
        sum
    });
    Ok(-flow / volume)
}

/// Solid fraction `n_s = (1/V) Σ V_p` of the particles whose centers lie in a region (ERDC 2019, (9)); the porosity is
/// `1 − n_s`. With `period`, images that lie inside are included.
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::{Region, stress::solid_fraction};
///
/// // Two particles of 1 m³ in 4 m³.
/// let position = [Vec3::zeros(), Vec3::x()];
/// assert_eq!(solid_fraction(&position, &[1.0, 1.0], &Region::All { volume: 4.0 }, None).unwrap(), 0.5);
/// ```
pub fn solid_fraction(
    position: &[Vec3],
    volumes: &[f64],
    region: &Region,
    period: Option<&Period>,
) -> Result<f64, OperatorError> {
    check_length("volumes", volumes.len(), position.len(), "particle")?;
    check_not_negative("volume of a particle", volumes.iter().copied())?;
    let volume = region::check(region, Truncation::InternalOnly, position, period)?;
    let images = region.images(period);
    let solid: f64 = sum_tiles(position.len(), |range| {
        let mut sum = 0.0;
        for p in range {
            images.inside(p, &position[p]).for_each(|_| sum += volumes[p]);
        }
        sum
    });
    Ok(solid / volume)
}

/// Axial part `(1×σ)_k = e_kij σ_ij` of a tensor in position-first order (operator O12).
///
/// `V(1×σ̄) = Σ_c l×f^A = −Σ_e c^e`: it vanishes if the contact moments on every particle cancel.
pub fn axial(tensor: &Mat3) -> Vec3 {
    Vec3::new(tensor[(1, 2)] - tensor[(2, 1)], tensor[(2, 0)] - tensor[(0, 2)], tensor[(0, 1)] - tensor[(1, 0)])
}

/// Symmetric part of a tensor.
pub fn symmetric(tensor: &Mat3) -> Mat3 {
    (tensor + tensor.transpose()) * 0.5
}
