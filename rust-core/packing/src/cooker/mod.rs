//! Dense packings between walls by forced insertion: the cooker algorithm (Jebahi, André, Terreros, Iordanoff 2015, section 2.3.1).
//!
//! 1. **Fill.** Spheres are placed at random where they touch nothing, until a number of tries fails.
//! 2. **Force.** A packet of spheres is inserted although it overlaps, each at the place with the most room among the failed tries.
//! 3. **Relax.** The spheres move under contact forces with damping until they are at rest.
//! 4. Repeat until the target is reached: a coordination number, a solid fraction, or a mean overlap. If a packet leads beyond the
//!    target, the packing before it is restored, and half a packet is inserted.
//! 5. **Soften.** The stiffness of the walls falls in steps to a thousandth, and the spheres relax after each: the packing expands until
//!    its overlaps vanish, and loses contacts.
//! 6. **Correct** the network ([`Correction`]).
//!
//! Algorithm 2 of the source fills free space only; its text (section 2.3.1.2) has the forced insertion. It gives no constants; those
//! here are at the constants.

mod fill;
mod measure;
mod relax;
#[cfg(test)]
mod tests;

use super::{Packing, PackingError, Random, Shape, SizeDistribution, positive, within};
use concordem_solver::neighbor::spatial_order;
use concordem_solver::state::particles::Sphere;
use fill::Filler;
pub use measure::{BOUNDARY_DEPTH, Measured, boundary};
use measure::{measure, touching};
use relax::{Rest, Vessel};

/// Share of the expected number of spheres in a packet: a fiftieth raises the solid fraction by 0.013.
const PACKET: f64 = 0.02;
/// Solid fraction that dense packings reach, for the expected number of spheres.
const DENSE: f64 = 0.64;
/// Stiffness of the walls after softening, over that before. A packing with overlaps of a hundredth then presses its walls outward by
/// ten times the expansion that removes its overlaps, at a hundredth of its pressure.
const SOFTEST: f64 = 1e-3;
/// Mean overlap over mean radius beyond which a target counts as out of reach: spheres are no longer a model of a packing.
pub const LARGEST_OVERLAP: f64 = 0.2;
/// Share of spheres lost through the walls beyond which a target counts as out of reach. Sharp edges of meshes lose one in a hundred.
const LARGEST_LOSS: f64 = 0.05;
/// Relative excess over a target coordination number or overlap that is accepted.
const EXCESS: f64 = 0.01;

/// What ends the insertion of spheres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// Mean number of contacts of a sphere inside ([`Measured::coordination`]). 6.2 in the source.
    Coordination(f64),
    /// Volume of all spheres over volume of the vessel.
    SolidFraction(f64),
    /// Mean overlap of touching spheres over the mean radius.
    Overlap(f64),
}

impl Target {
    fn name(self) -> &'static str {
        match self {
            Self::Coordination(_) => "the coordination number",
            Self::SolidFraction(_) => "the solid fraction",
            Self::Overlap(_) => "the mean overlap over the mean radius",
        }
    }

    fn value(self) -> f64 {
        match self {
            Self::Coordination(value) | Self::SolidFraction(value) | Self::Overlap(value) => value,
        }
    }

    fn of(self, now: &Measured) -> f64 {
        match self {
            Self::Coordination(_) => now.coordination,
            Self::SolidFraction(_) => now.solid_fraction,
            Self::Overlap(_) => now.overlap,
        }
    }
}

/// How the network of links is kept or completed when softening opens contacts (section 2.3.1.3 of the source).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Correction {
    /// Not at all: links are contacts.
    #[default]
    None,
    /// Before softening, each contact becomes a spring whose length at rest is the sum of the radii. These pairs stay the links.
    FrozenLinks,
    /// After softening, radii are enlarged for the search of links only, until spheres inside have as many links as before.
    EnlargedRadii,
}

/// Recipe of a packing between walls.
#[derive(Debug, Clone, PartialEq)]
pub struct Cooker {
    /// The vessel: a box, a cylinder, or a closed mesh.
    pub shape: Shape,
    /// Radii of the spheres.
    pub sizes: SizeDistribution,
    /// Seed of radii and positions. The same seed gives the same packing on any number of threads.
    pub seed: u64,
    /// What ends the insertion.
    pub target: Target,
    /// Coefficient of friction between spheres; walls have none.
    pub friction: f64,
    /// Spheres per forced insertion; `None`: a fiftieth of the expected number.
    pub packet: Option<usize>,
    /// Failed tries to place a sphere after which there is no free space.
    pub attempts: usize,
    /// Steps in which the walls soften; 0 leaves the overlaps.
    pub softening: u32,
    /// Correction of the network.
    pub correction: Correction,
    /// Unbalanced force at rest: root mean square net force over root mean square contact force.
    pub unbalanced: f64,
    /// Largest number of time steps of one relaxation.
    pub step_limit: u64,
}

impl Cooker {
    /// A recipe with the usual constants.
    pub fn new(shape: Shape, sizes: SizeDistribution, target: Target, seed: u64) -> Self {
        Self {
            shape,
            sizes,
            seed,
            target,
            friction: 0.0,
            packet: None,
            attempts: 500,
            softening: 6,
            correction: Correction::None,
            unbalanced: 1e-2,
            step_limit: 100_000,
        }
    }

    fn check(&self) -> Result<f64, PackingError> {
        within("the coefficient of friction", self.friction, 0.0, 1e3)?;
        positive(self.target.name(), self.target.value())?;
        positive("the number of tries", self.attempts as f64)?;
        positive("the size of a packet", self.packet.unwrap_or(1) as f64)?;
        within("the unbalanced force", self.unbalanced, 1e-6, 0.5)?;
        if let Target::SolidFraction(value) = self.target {
            within("the solid fraction", value, 0.0, 0.9)?;
        }
        if let Target::Overlap(value) = self.target {
            within("the mean overlap over the mean radius", value, 0.0, LARGEST_OVERLAP)?;
        }
        self.shape.volume()
    }
}

/// Stage of the work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CookerStage {
    /// Inserting spheres.
    Filling,
    /// Softening the walls.
    Softening,
}

/// Progress of the work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CookerProgress {
    /// Present stage.
    pub stage: CookerStage,
    /// Share of the stage, 0 to 1, as far as it can be estimated.
    pub share: f64,
    /// The packing now.
    pub now: Measured,
}

/// A finished packing.
#[derive(Debug, Clone, PartialEq)]
pub struct Cooked {
    /// The packing, in spatial order, without a cell.
    pub packing: Packing,
    /// Links between spheres, with a [`Correction`].
    pub network: Option<Vec<[u32; 2]>>,
    /// Interaction ratio that gives the network, with [`Correction::EnlargedRadii`].
    pub interaction_ratio: Option<f64>,
    /// Mean number of links of a sphere inside.
    pub links_inside: f64,
    /// Before softening.
    pub filled: Measured,
    /// At the end.
    pub last: Measured,
    /// Forced insertions.
    pub packets: usize,
    /// Spheres that were pushed through a wall and removed.
    pub lost: usize,
    /// Time steps of all relaxations.
    pub steps: u64,
}

/// Makes a dense packing between walls.
///
/// # Errors
/// A shape without walls here, parameters out of range, a target out of reach, or spheres that do not come to rest.
pub fn cook(recipe: &Cooker, progress: &mut dyn FnMut(CookerProgress)) -> Result<Cooked, PackingError> {
    let volume = recipe.check()?;
    let mut work = Work::new(recipe, volume)?;
    let filled = work.fill(progress)?;
    let frozen = match recipe.correction {
        Correction::FrozenLinks => Some(touching(&work.spheres)?),
        _ => None,
    };
    let mut last = filled;
    for step in 1..=recipe.softening {
        let softness = f64::from(step) / f64::from(recipe.softening);
        let stiffness = concordem_contact::math::exp(softness * concordem_contact::math::ln(SOFTEST));
        work.settle(stiffness, frozen.as_deref(), relax::FREE)?;
        last = work.measure()?;
        progress(CookerProgress { stage: CookerStage::Softening, share: softness, now: last });
    }
    let (lost, left) = (work.lost, work.spheres.len());
    if lost as f64 > LARGEST_LOSS * left as f64 {
        return Err(PackingError::Leaking { lost, left });
    }
    let (network, interaction_ratio, links_inside) = work.network(frozen, &filled, &last)?;
    let Work { spheres, packets, lost, steps, .. } = work;
    let packing = Packing { spheres, cell: None };
    Ok(Cooked { packing, network, interaction_ratio, links_inside, filled, last, packets, lost, steps })
}

/// Links, the interaction ratio that gives them, and their mean number per sphere inside.
type Network = (Option<Vec<[u32; 2]>>, Option<f64>, f64);

struct Work<'a> {
    recipe: &'a Cooker,
    volume: f64,
    vessel: Vessel,
    supply: Supply<'a>,
    random: Random,
    expected: usize,
    spheres: Vec<Sphere>,
    packets: usize,
    lost: usize,
    steps: u64,
}

impl<'a> Work<'a> {
    fn new(recipe: &'a Cooker, volume: f64) -> Result<Self, PackingError> {
        let (smallest, largest) = recipe.sizes.bounds()?;
        super::compactable(volume / (4.0 * smallest * smallest * smallest))?;
        let vessel = Vessel::new(&recipe.shape, recipe.friction)?;
        let supply = Supply::new(recipe, volume, largest)?;
        let expected = ((DENSE * volume / supply.mean_volume).round() as usize).max(1);
        // A different stream than that of the radii.
        let random = Random::new(recipe.seed ^ 0x9e37_79b9_7f4a_7c15);
        Ok(Self {
            recipe,
            volume,
            vessel,
            supply,
            random,
            expected,
            spheres: Vec::new(),
            packets: 0,
            lost: 0,
            steps: 0,
        })
    }

    /// Inserts spheres until the target is reached.
    fn fill(&mut self, progress: &mut dyn FnMut(CookerProgress)) -> Result<Measured, PackingError> {
        let target = self.recipe.target;
        let mut packet = self.recipe.packet.unwrap_or((PACKET * self.expected as f64) as usize).max(1);
        let mut best: Option<f64> = None;
        let rounds = 200 + 4 * self.expected / packet;
        for _ in 0..rounds {
            let saved = (self.spheres.clone(), self.supply.next);
            self.insert(packet)?;
            let hasty = self.recipe.step_limit.min(relax::HASTY);
            self.relax(1.0, None, Rest { steps: hasty, ..self.rest(relax::LOOSE) })?;
            let mut now = self.measure()?;
            if target.of(&now) >= target.value() {
                // At rest for certain, which may open contacts.
                self.settle(1.0, None, relax::LOOSE)?;
                now = self.measure()?;
            }
            let value = target.of(&now);
            if value.is_finite() {
                best = Some(best.map_or(value, |best| best.max(value)));
            }
            let share = (now.solid_fraction / DENSE).min(0.99);
            progress(CookerProgress { stage: CookerStage::Filling, share, now });
            let exact = matches!(target, Target::SolidFraction(_));
            let beyond = !exact && value > target.value() * (1.0 + EXCESS);
            if beyond && packet > 1 {
                (self.spheres, self.supply.next) = saved;
                packet = (packet / 2).max(1);
            } else if value >= target.value() {
                return Ok(now);
            } else if now.overlap > LARGEST_OVERLAP {
                break;
            }
        }
        Err(PackingError::TargetNotReached {
            name: target.name(),
            wanted: target.value(),
            best: best.unwrap_or(0.0),
            overlap: LARGEST_OVERLAP,
        })
    }

    /// Fills free space, then forces a packet in.
    fn insert(&mut self, packet: usize) -> Result<(), PackingError> {
        let recipe = self.recipe;
        let limit = match recipe.target {
            Target::SolidFraction(wanted) => wanted * self.volume,
            _ => f64::INFINITY,
        };
        let mut solid: f64 = self.spheres.iter().map(volume_of).sum();
        let mut filler = Filler::new(&recipe.shape, self.supply.largest, &self.spheres);
        let mut forced = 0;
        while forced < packet && solid < limit {
            let radius = self.supply.peek()?;
            let (position, gap) = filler.place(radius, recipe.attempts, &mut self.random)?;
            if gap < 0.0 {
                forced += 1;
            }
            let sphere = Sphere { position, radius };
            filler.add(sphere);
            self.supply.next += 1;
            solid += volume_of(&sphere);
        }
        self.packets += usize::from(forced > 0);
        self.spheres = filler.into_spheres();
        let positions: Vec<_> = self.spheres.iter().map(|sphere| sphere.position).collect();
        self.spheres = spatial_order(&positions, None).into_iter().map(|k| self.spheres[k as usize]).collect();
        Ok(())
    }

    fn rest(&self, loose: f64) -> Rest {
        Rest { unbalanced: self.recipe.unbalanced, loose, steps: self.recipe.step_limit }
    }

    /// Relaxes; returns the unbalanced force at the end. Removes spheres outside, unless there are links.
    fn relax(&mut self, stiffness: f64, links: Option<&[[u32; 2]]>, rest: Rest) -> Result<f64, PackingError> {
        let relaxed = self.vessel.relax(&mut self.spheres, stiffness, links, rest)?;
        self.steps += relaxed.steps;
        if links.is_none() {
            let before = self.spheres.len();
            let shape = &self.recipe.shape;
            self.spheres.retain(|sphere| shape.contains(&sphere.position, 0.0));
            self.lost += before - self.spheres.len();
        }
        Ok(relaxed.unbalanced)
    }

    /// Relaxes until the spheres are at rest.
    fn settle(&mut self, stiffness: f64, links: Option<&[[u32; 2]]>, loose: f64) -> Result<(), PackingError> {
        let rest = self.rest(loose);
        let unbalanced = self.relax(stiffness, links, rest)?;
        let goal = rest.unbalanced;
        if unbalanced <= goal { Ok(()) } else { Err(PackingError::NotAtRest { steps: rest.steps, unbalanced, goal }) }
    }

    fn measure(&self) -> Result<Measured, PackingError> {
        measure(&self.spheres, &self.recipe.shape, self.volume)
    }

    fn network(
        &self,
        frozen: Option<Vec<[u32; 2]>>,
        filled: &Measured,
        last: &Measured,
    ) -> Result<Network, PackingError> {
        let outer = boundary(&self.spheres, &self.recipe.shape);
        match self.recipe.correction {
            Correction::None => Ok((None, None, last.coordination)),
            Correction::FrozenLinks => {
                let links = frozen.unwrap_or_default();
                let inside = measure::links_inside(&links, &outer);
                Ok((Some(links), None, inside))
            }
            Correction::EnlargedRadii => {
                let wanted = match self.recipe.target {
                    Target::Coordination(value) => value,
                    _ => filled.coordination,
                };
                let found = super::bonding::ratio_inside(&self.spheres, None, &outer, wanted)?;
                let (ratio, reached) = found.ok_or(PackingError::TargetNotReached {
                    name: "the coordination number with enlarged radii",
                    wanted,
                    best: last.coordination,
                    overlap: LARGEST_OVERLAP,
                })?;
                Ok((Some(measure::pairs_within(&self.spheres, ratio)?), Some(ratio), reached))
            }
        }
    }
}

fn volume_of(sphere: &Sphere) -> f64 {
    4.0 / 3.0 * std::f64::consts::PI * sphere.radius * sphere.radius * sphere.radius
}

/// Radii in the order of insertion. A radius keeps its turn until it is placed, so that small spheres, which fit more easily, are not
/// preferred.
struct Supply<'a> {
    recipe: &'a Cooker,
    radii: Vec<f64>,
    next: usize,
    batches: u64,
    mean_volume: f64,
    largest: f64,
}

impl<'a> Supply<'a> {
    fn new(recipe: &'a Cooker, volume: f64, largest: f64) -> Result<Self, PackingError> {
        // As many as fill the vessel at the solid fraction of dense packings, so that their radii follow the distribution closely.
        let sample = recipe.sizes.radii(1000, recipe.seed)?;
        let cubes: f64 = sample.iter().map(|r| 4.0 / 3.0 * std::f64::consts::PI * r * r * r).sum();
        let count = ((DENSE * volume / (cubes / 1000.0)).round() as usize).max(16);
        let radii = recipe.sizes.radii(count, recipe.seed)?;
        let cubes: f64 = radii.iter().map(|r| 4.0 / 3.0 * std::f64::consts::PI * r * r * r).sum();
        let mean_volume = cubes / count as f64;
        Ok(Self { recipe, radii, next: 0, batches: 1, mean_volume, largest })
    }

    /// The next radius.
    fn peek(&mut self) -> Result<f64, PackingError> {
        if self.next == self.radii.len() {
            let seed = self.recipe.seed.wrapping_add(0x51_7cc1_b727_220a_u64.wrapping_mul(self.batches));
            self.batches += 1;
            self.radii.extend(self.recipe.sizes.radii(1000, seed)?);
        }
        Ok(self.radii[self.next])
    }
}
