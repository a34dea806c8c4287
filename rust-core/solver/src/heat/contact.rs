//! Heat through the contacts of the moment: of particles that touch now, wherever they were at the start.
//!
//! Pairs that a link joins do not need them, unless a crack cuts the link. There, the contact closes the crack.
//!
//! Two models ([`ContactExchange`]):
//!
//! - A resistance `r` (m²·K/W) between two bodies: `G = A / (R_a/λ_a + r + R_b/λ_b)` with the area `A = 4 R_a R_b` of a square layer (in
//!   the plane `2 √(R_a R_b)`), as at walls ([`WallExchange`](super::WallExchange)). At a closed crack, `1/G = 1/G_o + r/A` with the
//!   conductance `G_o` and the area of the link.
//! - The constriction of the flow in two half-spaces that meet in a circle of the radius `a = √(δ R_a R_b/(R_a + R_b))` (Hertz 1882) at
//!   the overlap δ: `1/G = 1/(4 λ_a a) + 1/(4 λ_b a)` (Holm 1967; for spheres Batchelor and O'Brien 1977), at most as much as without
//!   resistance.
//!
//! Which contacts touch follows from the positions alone, so nothing about them is stored.

use concordem_contact::heat::HeatContact;
use concordem_contact::kinematics::deformable::SurfaceDisplacement;
use concordem_contact::math::Vec3;
use rayon::prelude::*;

use super::HeatModel;
use super::pass::{HeatPass, conductance};
use crate::evaluation::TILE;
use crate::state::contacts::{ContactFlags, Contacts};
use crate::state::{Cell, Particles, State};

/// How particles that touch exchange heat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactConduction {
    /// What flows through a contact.
    pub exchange: ContactExchange,
    /// Whether particles are discs of unit depth.
    pub planar: bool,
    /// Whether an explicit step fails where contacts are so many that it is beyond its bound.
    pub watched: bool,
}

/// What flows through a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ContactExchange {
    /// Thermal resistance of the contact, m²·K/W.
    Resistance(f64),
    /// Constriction in the circle of a Hertzian contact; spheres only.
    Constriction,
}

/// Bins of the radii in [`ContactConduction::most`].
const BINS: u32 = 64;

impl ContactConduction {
    /// What a table says about contacts.
    pub fn of(contact: &HeatContact, planar: bool, watched: bool) -> Self {
        let exchange = contact
            .resistance
            .map_or(ContactExchange::Constriction, |resistance| ContactExchange::Resistance(resistance.si()));
        Self { exchange, planar, watched }
    }

    /// Conductance of two touching particles with the radii (m), conductivities (W/(m·K)), and the radius of their contact (m), W/K.
    #[inline]
    pub fn conductance(&self, radii: [f64; 2], conductivities: [f64; 2], spot: f64) -> f64 {
        match self.exchange {
            ContactExchange::Resistance(resistance) => self.between(radii, conductivities, resistance),
            ContactExchange::Constriction => {
                constriction(conductivities, spot).min(self.between(radii, conductivities, 0.0))
            }
        }
    }

    /// Conductance between two centers with a resistance (m²·K/W) halfway, W/K.
    #[inline]
    fn between(&self, [radius_a, radius_b]: [f64; 2], [a, b]: [f64; 2], resistance: f64) -> f64 {
        let area = if self.planar { 2.0 * (radius_a * radius_b).sqrt() } else { 4.0 * radius_a * radius_b };
        area / (radius_a / a + resistance + radius_b / b)
    }

    /// Conductance that a contact gives a link with a crack, which conducts `whole` without it (W/K) through `area` (m²), W/K.
    #[inline]
    fn closed(&self, whole: f64, area: f64, conductivities: [f64; 2], spot: f64) -> f64 {
        match self.exchange {
            ContactExchange::Resistance(resistance) => 1.0 / (1.0 / whole + resistance / area),
            ContactExchange::Constriction => constriction(conductivities, spot).min(whole),
        }
    }

    /// Largest conductance of all contacts that a particle can have at once with others that do not overlap each other, W/K; with its
    /// radius (m), the smallest and the largest radius of all particles, its conductivity, and the largest one of all, W/(m·K).
    ///
    /// A neighbor of the radius `R_b` covers the solid angle `2π (1 − cos θ)` around the particle, `sin θ = R_b/(R_a + R_b)` (in the plane
    /// the angle `2θ`), so at most `2/(1 − cos θ)` of them fit (`π/θ`). The bins of the radii pair their smallest one, which is the most
    /// numerous, with the conductance of their largest one.
    pub(super) fn most(&self, radius: f64, [smallest, largest]: [f64; 2], conductivities: [f64; 2]) -> f64 {
        let spread = largest / smallest;
        let bins = if spread > 1.0 { BINS } else { 1 };
        let at = |bin: u32| smallest * libm::pow(spread, f64::from(bin) / f64::from(bins));
        let of = |bin: u32| {
            let sine = at(bin) / (radius + at(bin));
            let number = if self.planar {
                std::f64::consts::PI / libm::asin(sine)
            } else {
                2.0 / (1.0 - (1.0 - sine * sine).sqrt())
            };
            number * self.conductance([radius, at(bin + 1)], conductivities, f64::INFINITY)
        };
        (0..bins).map(of).fold(0.0, f64::max)
    }
}

/// Conductance of two half-spaces of the given conductivities (W/(m·K)) that meet in a circle of the radius `spot` (m), W/K.
#[inline]
fn constriction([a, b]: [f64; 2], spot: f64) -> f64 {
    4.0 * spot / (1.0 / a + 1.0 / b)
}

/// Two particles that touch now, without a link, or with one that a crack cuts.
#[derive(Debug, Clone, Copy)]
struct Touch {
    a: u32,
    b: u32,
    /// The link, or [`NO_LINK`].
    link: u32,
    /// Radius of the contact, m.
    spot: f64,
    /// From the center of A to that of B, or of its image, m.
    branch: Vec3,
}

const NO_LINK: u32 = u32::MAX;

/// The contacts that conduct at present. Scratch.
#[derive(Debug, Clone, Default)]
pub(super) struct Touching {
    touches: Vec<Touch>,
    /// Conductance of each, W/K; at a crack, beyond that of the open one.
    conductance: Vec<f64>,
    /// First entry of each particle in `halves`, then the number of entries; empty without contacts.
    start: Vec<u32>,
    /// The contacts of each particle: the particle at the other end, and the conductance, W/K.
    halves: Vec<(u32, f64)>,
}

impl Touching {
    /// The contacts of particle `p`.
    #[inline]
    pub(super) fn of(&self, p: usize) -> &[(u32, f64)] {
        match self.start.get(p..p + 2) {
            Some(range) => &self.halves[range[0] as usize..range[1] as usize],
            None => &[],
        }
    }

    /// Particles, branch vector (m), and conductance (W/K) of each contact.
    pub(super) fn iter(&self) -> impl Iterator<Item = ([u32; 2], Vec3, f64)> + '_ {
        self.touches.iter().zip(&self.conductance).map(|(touch, g)| ([touch.a, touch.b], touch.branch, *g))
    }

    /// Sort the contacts by their particles, each in the order of the contacts.
    fn sort(&mut self, particles: usize) {
        self.start.clear();
        self.halves.clear();
        if self.touches.is_empty() {
            return;
        }
        // Shifted by one, so that filling the entries moves each start to its place.
        self.start.resize(particles + 2, 0);
        for p in self.touches.iter().flat_map(|touch| [touch.a, touch.b]) {
            self.start[p as usize + 2] += 1;
        }
        for p in 0..particles {
            self.start[p + 2] += self.start[p + 1];
        }
        self.halves.resize(2 * self.touches.len(), (0, 0.0));
        for (touch, conductance) in self.touches.iter().zip(&self.conductance) {
            for (p, other) in [(touch.a, touch.b), (touch.b, touch.a)] {
                let next = &mut self.start[p as usize + 1];
                self.halves[*next as usize] = (other, *conductance);
                *next += 1;
            }
        }
    }

    /// Memory in bytes.
    pub(super) fn bytes(&self) -> usize {
        (size_of::<Touch>() + 40) * self.touches.len() + 4 * self.start.len()
    }
}

impl HeatPass {
    /// Find the particles that touch now, and what their contacts conduct. `surface`: surface displacements (m) of deformable particles,
    /// otherwise empty.
    pub(super) fn meet(&mut self, model: &HeatModel, state: &State, surface: &[SurfaceDisplacement]) {
        let (Some(_), Some(block)) = (&model.contact, &state.contacts) else { return };
        let (block, particles, cell) = (block.contacts(), &state.particles, state.cell.as_ref());
        let mut touches = std::mem::take(&mut self.touching_now.touches);
        let of = |k: usize| self.touch_of(model, block, k, particles, cell, surface);
        touches.clear();
        touches.par_extend((0..block.len()).into_par_iter().with_min_len(TILE).filter_map(of));
        self.touching_now.touches = touches;
        self.weigh(model, particles, state.heat.as_ref().map_or(&[][..], |heat| &heat.temperature));
    }

    /// Contact `k`, if it touches and conducts.
    fn touch_of(
        &self,
        model: &HeatModel,
        block: &dyn Contacts,
        k: usize,
        particles: &Particles,
        cell: Option<&Cell>,
        surface: &[SurfaceDisplacement],
    ) -> Option<Touch> {
        let (pair, flags) = (block.pairs()[k], block.flags()[k]);
        let (a, b) = (pair.a as usize, pair.b as usize);
        let shift = cell.map_or(Vec3::zeros(), |cell| cell.shift(flags.image));
        let branch = particles.position[b] + shift - particles.position[a];
        let length = branch.norm();
        // The operations are those that activate the contact.
        let opening = if flags.has(ContactFlags::KEPT_REFERENCE) {
            length - block.view(k).reference.length
        } else {
            length - particles.radius[a] - particles.radius[b]
        };
        let approach =
            if surface.is_empty() { 0.0 } else { (surface[a].0 + surface[b].0).quadratic(&branch.normalize()) };
        let overlap = approach - opening;
        // A particle exchanges no heat with its own image.
        if overlap <= 0.0 || a == b || flags.has(ContactFlags::BROKEN) {
            return None;
        }
        let links = self.links_between(pair.a, pair.b);
        let nearest = links.min_by(|j, k| {
            let apart = |link: u32| {
                let link = &model.network.links[link as usize];
                (if link.a == pair.a { link.branch - branch } else { link.branch + branch }).norm_squared()
            };
            apart(*j).total_cmp(&apart(*k))
        });
        if nearest.is_some_and(|link| !self.is_cracked(link)) {
            return None;
        }
        let radii = [particles.radius[a], particles.radius[b]];
        let spot = (overlap * (radii[0] * radii[1] / (radii[0] + radii[1]))).sqrt();
        Some(Touch { a: pair.a, b: pair.b, link: nearest.unwrap_or(NO_LINK), spot, branch })
    }

    /// Compute what the contacts conduct at the given temperatures, K.
    pub(super) fn weigh(&mut self, model: &HeatModel, particles: &Particles, temperature: &[f64]) {
        let Some(contact) = &model.contact else { return };
        let conductivity = |p: u32| {
            let temperature = temperature.get(p as usize).copied().unwrap_or(model.reference_temperature);
            model.conductivity(particles.material[p as usize], temperature)
        };
        let touching = &mut self.touching_now;
        let of = |touch: &Touch| {
            let conductivities = [touch.a, touch.b].map(conductivity);
            if touch.link == NO_LINK {
                let radii = [touch.a, touch.b].map(|p| particles.radius[p as usize]);
                return contact.conductance(radii, conductivities, touch.spot);
            }
            let link = &model.network.links[touch.link as usize];
            let [a, b] = if link.a == touch.a { conductivities } else { [conductivities[1], conductivities[0]] };
            let whole = conductance(link, a, b);
            let open = 1.0 / (1.0 / whole + model.crack_resistance / link.area);
            // A crack conducts no less for being closed.
            (contact.closed(whole, link.area, [a, b], touch.spot) - open).max(0.0)
        };
        touching.touches.par_iter().with_min_len(TILE).map(of).collect_into_vec(&mut touching.conductance);
        touching.sort(particles.len());
    }
}
