//! One step of heat conduction.

use std::collections::HashSet;

use concordem_contact::kinematics::deformable::SurfaceDisplacement;
use concordem_contact::math::Vec3;
use rayon::prelude::*;

use super::contact::Touching;
use super::implicit;
use super::network::{Exposure, Link};
use super::supply::{Exchange, Factors, Spread, factor};
use super::{HeatModel, HeatState};
use crate::SolverError;
use crate::energy::Sum;
use crate::evaluation::TILE;
use crate::forces::walls::element_table;
use crate::state::contacts::{BrokenBond, ContactFlags};
use crate::state::{Particles, State};

/// Conducts heat. Holds scratch data only.
#[derive(Debug, Clone, Default)]
pub struct HeatPass {
    /// First entry of each particle in `halves`, then the number of entries.
    start: Vec<u32>,
    /// The links of each particle: the particle at the other end, and the number of the link.
    halves: Vec<(u32, u32)>,
    /// Conductance of each link, W/K.
    conductance: Vec<f64>,
    /// Whether a crack cuts a link.
    cracked: Vec<bool>,
    /// Whether the temperature of a particle is prescribed.
    held: Vec<bool>,
    /// Which particles have been bonded, by particle.
    bonded: Vec<Vec<u32>>,
    /// Pairs whose bond has broken.
    parted: HashSet<(u32, u32)>,
    /// Number of broken bonds that are known.
    broken: usize,
    /// Contacts with walls at present, by [`Supply::walls`](super::Supply::walls).
    touching: Vec<Vec<Exposure>>,
    /// Contacts between particles that conduct at present ([`HeatModel::contact`]).
    pub(super) touching_now: Touching,
    /// Present factors of what enters from outside.
    pub factors: Factors,
    /// Heat that flows into each particle at the temperatures of the start of the step, W.
    pub(super) rate: Vec<f64>,
    /// Change of the temperatures in an implicit step, K.
    pub(super) change: Vec<f64>,
    /// `−d rate/dT` by the surface, W/K.
    pub(super) surface: Vec<f64>,
    /// Change of each temperature in the step, K.
    pub increment: Vec<f64>,
}

/// A pair of particles in ascending order.
fn ordered(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

impl HeatPass {
    /// The pass for `state`, which may have cracks already.
    pub fn new(model: &HeatModel, state: &State) -> Self {
        let n = state.particles.len();
        let links = &model.network.links;
        let mut start = vec![0_u32; n + 1];
        for link in links {
            start[link.a as usize + 1] += 1;
            start[link.b as usize + 1] += 1;
        }
        for p in 0..n {
            start[p + 1] += start[p];
        }
        let mut next = start.clone();
        let mut halves = vec![(0, 0); 2 * links.len()];
        for (k, link) in links.iter().enumerate() {
            for (p, other) in [(link.a, link.b), (link.b, link.a)] {
                halves[next[p as usize] as usize] = (other, k as u32);
                next[p as usize] += 1;
            }
        }
        let mut held = vec![false; n];
        for p in model.supply.held.iter().flat_map(|held| &held.particles) {
            held[*p as usize] = true;
        }
        let mut bonded = vec![Vec::new(); n];
        let intact = state.bonds.iter().flat_map(|block| (0..block.len()).map(|k| block.view(k)));
        let intact = intact.filter(|view| !view.flags.has(ContactFlags::BROKEN)).map(|view| view.pair);
        for pair in intact.chain(state.broken.iter().map(|bond| bond.pair)) {
            bonded[pair.a as usize].push(pair.b);
            bonded[pair.b as usize].push(pair.a);
        }
        for others in &mut bonded {
            others.sort_unstable();
            others.dedup();
        }
        let mut pass = Self { start, halves, held, bonded, ..Self::default() };
        pass.cracked = vec![false; links.len()];
        pass.cut(&state.broken);
        pass.touch(model, state, &[]);
        let temperature = state.heat.as_ref().map_or(&[][..], |heat| &heat.temperature);
        pass.conductance = pass.conductances(model, &state.particles, |p, material| {
            model.conductivity(material, temperature.get(p).copied().unwrap_or(model.reference_temperature))
        });
        pass
    }

    /// Find the particles that touch walls and each other now. Candidates of contacts are those of the neighbor list; which of them
    /// touch depends on the positions alone, and on the surface displacements `surface` (m) of deformable particles.
    pub fn touch(&mut self, model: &HeatModel, state: &State, surface: &[SurfaceDisplacement]) {
        self.meet(model, state, surface);
        let walls = &model.supply.walls;
        self.touching.iter_mut().for_each(Vec::clear);
        self.touching.resize(walls.len(), Vec::new());
        let Some(block) = state.wall_contacts.as_ref().filter(|_| !walls.is_empty()) else { return };
        let elements = element_table(&state.walls);
        // Image of the last contact of each wall.
        let mut images: Vec<Vec<[i8; 3]>> = vec![Vec::new(); walls.len()];
        for k in 0..block.len() {
            let view = block.view(k);
            let (wall, element) = elements[view.pair.b as usize];
            let p = view.pair.a as usize;
            let (center, radius, image) = (&state.particles.position[p], state.particles.radius[p], view.flags.image);
            for ((exchange, touching), images) in walls.iter().zip(&mut self.touching).zip(&mut images) {
                if exchange.wall != wall as usize {
                    continue;
                }
                let wall = &state.walls[exchange.wall];
                let found = wall.closest_point_of_image(element as usize, center, state.cell.as_ref(), image);
                let reach = |normal: &Vec3| radius + surface.get(p).map_or(0.0, |w| w.0.quadratic(normal));
                let touching_wall = found.filter(|closest| closest.distance < reach(&closest.normal));
                let Some(closest) = touching_wall else { continue };
                // One contact of a particle with each image of a wall.
                let same = touching.iter().zip(images.iter()).rev().take_while(|(other, _)| other.particle == p as u32);
                if same.into_iter().all(|(_, other)| *other != image) {
                    touching.push(exchange.contact(p as u32, radius, closest.normal));
                    images.push(image);
                }
            }
        }
    }

    /// All parts of the surface at present, and contacts with walls: with what flows through them, and its factor.
    pub(super) fn surfaces<'a>(
        &'a self,
        model: &'a HeatModel,
    ) -> impl Iterator<Item = (&'a Exposure, &'a Exchange, f64)> {
        let parts = model.supply.surfaces.iter().enumerate().flat_map(|(k, part)| {
            let factor = factor(&self.factors.surfaces, k);
            part.exposures.iter().map(move |exposure| (exposure, &part.exchange, factor))
        });
        let walls = model.supply.walls.iter().zip(&self.touching).enumerate().flat_map(|(k, (wall, touching))| {
            let factor = factor(&self.factors.walls, k);
            touching.iter().map(move |exposure| (exposure, &wall.exchange, factor))
        });
        parts.chain(walls)
    }

    /// Put the resistance of cracks in series with the links across bonds that have broken since the last call.
    ///
    /// A link without a bond is cut when no intact path of two bonds joins its particles any more, if there was one. Call
    /// [`Self::refresh`] afterwards.
    fn cut(&mut self, broken: &[BrokenBond]) -> bool {
        let new = broken.get(self.broken..).unwrap_or_default();
        self.broken = broken.len();
        let parted: Vec<(u32, u32)> = new.iter().map(|bond| ordered(bond.pair.a, bond.pair.b)).collect();
        self.parted.extend(&parted);
        let mut changed = false;
        for p in parted.iter().flat_map(|&(a, b)| [a, b]) {
            for half in self.start[p as usize]..self.start[p as usize + 1] {
                let (other, link) = self.halves[half as usize];
                if self.is_cut(p, other) && !self.cracked[link as usize] {
                    self.cracked[link as usize] = true;
                    changed = true;
                }
            }
        }
        changed
    }

    /// Account for bonds that have broken since the last call.
    pub fn crack(&mut self, model: &HeatModel, particles: &Particles, heat: &HeatState, broken: &[BrokenBond]) {
        if self.cut(broken) {
            self.refresh(model, particles, heat);
        }
    }

    /// Compute the conductances at the present temperatures.
    fn refresh(&mut self, model: &HeatModel, particles: &Particles, heat: &HeatState) {
        self.conductance = self.present_conductances(model, particles, heat);
    }

    /// Conductance of each link at the present temperatures, W/K.
    pub(super) fn present_conductances(&self, model: &HeatModel, particles: &Particles, heat: &HeatState) -> Vec<f64> {
        self.conductances(model, particles, |p, material| model.conductivity(material, heat.temperature[p]))
    }

    /// Conductance of each link with the conductivities `of` (W/(m·K)) of a particle and its material, W/K.
    fn conductances(
        &self,
        model: &HeatModel,
        particles: &Particles,
        of: impl Fn(usize, u16) -> f64 + Sync,
    ) -> Vec<f64> {
        let links = model.network.links.par_iter().zip(&self.cracked).with_min_len(TILE);
        let one = |(link, cracked): (&Link, &bool)| {
            let [a, b] = [link.a, link.b].map(|p| of(p as usize, particles.material[p as usize]));
            let whole = conductance(link, a, b);
            if *cracked { 1.0 / (1.0 / whole + model.crack_resistance / link.area) } else { whole }
        };
        links.map(one).collect()
    }

    /// Numbers of the links between two particles.
    #[inline]
    pub(super) fn links_between(&self, a: u32, b: u32) -> impl Iterator<Item = u32> + '_ {
        let halves = &self.halves[self.start[a as usize] as usize..self.start[a as usize + 1] as usize];
        halves.iter().filter(move |(other, _)| *other == b).map(|(_, link)| *link)
    }

    /// Whether a crack cuts a link.
    #[inline]
    pub(super) fn is_cracked(&self, link: u32) -> bool {
        self.cracked[link as usize]
    }

    /// Whether a crack separates two linked particles.
    fn is_cut(&self, a: u32, b: u32) -> bool {
        let bond = |p: u32, q: u32| self.bonded[p as usize].binary_search(&q).is_ok();
        let intact = |p: u32, q: u32| bond(p, q) && !self.parted.contains(&ordered(p, q));
        if bond(a, b) {
            return !intact(a, b);
        }
        let mut between = self.bonded[a as usize].iter().filter(|&&c| bond(c, b)).peekable();
        between.peek().is_some() && between.all(|&c| !(intact(a, c) && intact(c, b)))
    }

    /// Largest time step (s, thermal time) for which an explicit step cannot overshoot: `min C_i/Σ_j G_ij`, the surface included.
    /// Sufficient for stability. Infinite without any exchange. With constants that vary, it holds at all temperatures: lowest
    /// capacities, largest conductivities. With contacts that form later, it holds for as many as fit around a particle.
    pub fn stable_step(&self, model: &HeatModel, particles: &Particles, heat: &HeatState) -> f64 {
        self.stable_steps(model, particles, heat).into_iter().fold(f64::INFINITY, f64::min)
    }

    /// The bound of [`Self::stable_step`] that each particle sets; infinite where the temperature is prescribed.
    pub fn stable_steps(&self, model: &HeatModel, particles: &Particles, heat: &HeatState) -> Vec<f64> {
        let mut sums = vec![0.0; particles.len()];
        let largest = self.conductances(model, particles, |_, material| model.largest_conductivity(material));
        for (p, sum) in sums.iter_mut().enumerate() {
            let halves = &self.halves[self.start[p] as usize..self.start[p + 1] as usize];
            *sum = halves.iter().fold(0.0, |sum, (_, link)| sum + largest[*link as usize]);
        }
        for (k, part) in model.supply.surfaces.iter().enumerate() {
            for exposure in &part.exposures {
                let p = exposure.particle as usize;
                let conductivity = model.largest_conductivity(particles.material[p]);
                let hottest = part.exchange.hottest(heat.temperature[p]);
                sums[p] += part.exchange.flow(exposure, conductivity, hottest, factor(&self.factors.surfaces, k)).1;
            }
        }
        // Any particle may touch any wall.
        for (p, sum) in sums.iter_mut().enumerate().filter(|_| !model.supply.walls.is_empty()) {
            let conductivity = model.largest_conductivity(particles.material[p]);
            for wall in &model.supply.walls {
                let contact = wall.contact(p as u32, particles.radius[p], Vec3::zeros());
                *sum += wall.exchange.flow(&contact, conductivity, heat.temperature[p], 1.0).1;
            }
        }
        add_later_contacts(model, particles, &mut sums);
        let of = |(p, sum): (usize, &f64)| if self.held[p] { f64::INFINITY } else { model.lowest_capacity(p) / sum };
        sums.iter().enumerate().map(of).collect()
    }

    /// Fail if contacts have become so many that an explicit step of `dt` (s, thermal time) is beyond its bound.
    fn check_contacts(&self, model: &HeatModel, particles: &Particles, dt: f64) -> Result<(), SolverError> {
        let watched = model.contact.as_ref().is_some_and(|contact| contact.watched);
        if model.implicit || !watched {
            return Ok(());
        }
        let bound = |p: usize| {
            let sum: f64 = self.links(p).map(|(_, conductance)| conductance).sum();
            model.lowest_capacity(p) / (sum + self.surface[p])
        };
        let beyond = |p: &usize| !self.held[*p] && !self.touching_now.of(*p).is_empty() && dt > bound(*p);
        let first = (0..particles.len()).into_par_iter().with_min_len(TILE).find_first(beyond);
        first.map_or(Ok(()), |p| {
            let (id, contacts) = (particles.id[p], self.touching_now.of(p).len());
            Err(SolverError::HeatOutgrown { id, contacts, bound: bound(p), dt })
        })
    }

    /// Other end and conductance (W/K) of each link and each present contact of particle `p`.
    #[inline]
    pub fn links(&self, p: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let halves = &self.halves[self.start[p] as usize..self.start[p + 1] as usize];
        let links = halves.iter().map(|&(other, link)| (other as usize, self.conductance[link as usize]));
        links.chain(self.touching_now.of(p).iter().map(|&(other, conductance)| (other as usize, conductance)))
    }

    /// Whether the temperature of particle `p` is prescribed.
    pub fn is_held(&self, p: usize) -> bool {
        self.held[p]
    }

    /// Heat that flows along the links into each particle at the given temperatures (K), W.
    pub(super) fn conduct(&self, temperature: &[f64], into: &mut Vec<f64>) {
        let of = |p: usize| {
            let mut sum = 0.0;
            for &(other, link) in &self.halves[self.start[p] as usize..self.start[p + 1] as usize] {
                sum += self.conductance[link as usize] * (temperature[other as usize] - temperature[p]);
            }
            for &(other, conductance) in self.touching_now.of(p) {
                sum += conductance * (temperature[other as usize] - temperature[p]);
            }
            sum
        };
        (0..temperature.len()).into_par_iter().with_min_len(TILE).map(of).collect_into_vec(into);
    }

    /// Compute the change of the temperatures in a step of `dt` (s, thermal time) that begins at the thermal time `time`
    /// (s), and book the heat that enters.
    ///
    /// # Errors
    /// An implicit step that does not converge; an explicit one beyond its bound because of present contacts.
    pub fn begin(
        &mut self,
        model: &HeatModel,
        particles: &Particles,
        heat: &mut HeatState,
        time: f64,
        dt: f64,
    ) -> Result<(), SolverError> {
        let n = particles.len();
        self.change.clear();
        self.change.resize(n, 0.0);
        // A steady state has no end: sources stay where they are.
        let middle = if dt.is_finite() { time + 0.5 * dt } else { time };
        let entering = self.find_rates(model, particles, heat, middle);
        self.check_contacts(model, particles, dt)?;
        heat.ledger.sources.add(entering * dt);
        if dt.is_finite() {
            for (rate, dissipated) in self.rate.iter_mut().zip(&mut heat.dissipated) {
                *rate += std::mem::take(dissipated) / dt;
            }
        }
        for (k, held) in model.supply.held.iter().enumerate() {
            let target = held.temperature * factor(&self.factors.held, k);
            for &p in &held.particles {
                let p = p as usize;
                self.change[p] = (target - heat.temperature[p]) - heat.correction[p];
            }
        }
        if model.implicit {
            implicit::solve_step(self, model, heat, dt)?;
        }
        self.book_surfaces(model, particles, heat, dt);
        self.finish_rates(model.implicit);
        let increment = |p: usize| {
            if self.held[p] { self.change[p] } else { model.warming_of(p, heat.temperature[p], self.rate[p] * dt) }
        };
        let mut increments = std::mem::take(&mut self.increment);
        (0..n).into_par_iter().with_min_len(TILE).map(increment).collect_into_vec(&mut increments);
        self.increment = increments;
        for p in model.supply.held.iter().flat_map(|held| &held.particles) {
            let p = *p as usize;
            let stored = model.heat_of(p, heat.temperature[p], self.increment[p]);
            heat.ledger.boundary.add(stored);
            heat.ledger.boundary.add(-self.rate[p] * dt);
        }
        Ok(())
    }

    /// Heat that flows into each particle at its present temperature, W, and minus the derivative of the part through the surface
    /// with respect to the temperature, W/K; sources are those at the thermal time `time` (s).
    pub fn rates(&mut self, model: &HeatModel, particles: &Particles, heat: &HeatState, time: f64) -> (&[f64], &[f64]) {
        self.find_rates(model, particles, heat, time);
        (&self.rate, &self.surface)
    }

    /// [`Self::rates`]; returns the power of all sources, W.
    fn find_rates(&mut self, model: &HeatModel, particles: &Particles, heat: &HeatState, time: f64) -> f64 {
        if model.curves.conductivity_varies() {
            self.refresh(model, particles, heat);
            self.weigh(model, particles, &heat.temperature);
        }
        let mut rate = std::mem::take(&mut self.rate);
        self.conduct(&heat.temperature, &mut rate);
        self.rate = rate;
        self.surface.clear();
        self.surface.resize(particles.len(), 0.0);
        let power = self.add_sources(model, particles, time);
        self.add_surfaces(model, particles, heat);
        power
    }

    /// Add the power of the sources at the thermal time `time` (s); returns their sum, W.
    fn add_sources(&mut self, model: &HeatModel, particles: &Particles, time: f64) -> f64 {
        let mut total = Sum::default();
        for (k, source) in model.supply.sources.iter().enumerate() {
            let power = source.power * factor(&self.factors.sources, k);
            match &source.spread {
                Spread::Shares(shares) => {
                    for &(p, share) in shares {
                        self.rate[p as usize] += power * share;
                        total.add(power * share);
                    }
                }
                Spread::Gaussian { center, velocity, radius } => {
                    let weights = gaussian(model, particles, &(center + velocity * time), *radius);
                    let sum: f64 = weights.iter().sum();
                    if sum > 0.0 {
                        for (rate, weight) in self.rate.iter_mut().zip(weights) {
                            let part = power * (weight / sum);
                            *rate += part;
                            total.add(part);
                        }
                    }
                }
            }
        }
        total.get()
    }

    /// Add the heat through the surface at the temperatures of the start of the step.
    fn add_surfaces(&mut self, model: &HeatModel, particles: &Particles, heat: &HeatState) {
        let (mut rate, mut surface) = (std::mem::take(&mut self.rate), std::mem::take(&mut self.surface));
        for (exposure, exchange, factor) in self.surfaces(model) {
            let p = exposure.particle as usize;
            let conductivity = model.conductivity(particles.material[p], heat.temperature[p]);
            let (flow, slope) = exchange.flow(exposure, conductivity, heat.temperature[p], factor);
            rate[p] += flow;
            surface[p] += slope;
        }
        (self.rate, self.surface) = (rate, surface);
    }

    /// Book the heat through the surface. In an implicit step it follows from the temperatures of its end.
    fn book_surfaces(&self, model: &HeatModel, particles: &Particles, heat: &mut HeatState, dt: f64) {
        for (exposure, exchange, factor) in self.surfaces(model) {
            let p = exposure.particle as usize;
            let conductivity = model.conductivity(particles.material[p], heat.temperature[p]);
            let (flow, slope) = exchange.flow(exposure, conductivity, heat.temperature[p], factor);
            let change = if model.implicit { self.change[p] } else { 0.0 };
            heat.ledger.boundary.add((flow - slope * change) * dt);
        }
    }

    /// In an implicit step: the rates at the temperatures of its end. The update by these rates conserves heat however exactly
    /// the equations were solved.
    fn finish_rates(&mut self, implicit: bool) {
        if !implicit {
            return;
        }
        let mut flows = Vec::new();
        self.conduct(&self.change, &mut flows);
        let slopes = self.surface.iter().zip(&self.change);
        for ((rate, flow), (slope, change)) in self.rate.iter_mut().zip(flows).zip(slopes) {
            *rate += flow - slope * change;
        }
    }

    /// Apply the change of the temperatures; returns whether all are finite.
    pub fn finish(&self, heat: &mut HeatState) -> bool {
        let HeatState { temperature, correction, warming, .. } = heat;
        let rows = temperature.par_iter_mut().zip(correction).zip(warming).zip(&self.increment).with_min_len(TILE);
        let apply = |(((temperature, correction), warming), increment): (((&mut f64, &mut f64), &mut f64), &f64)| {
            // The sum of two numbers and its error (Knuth 1969, 4.2.2).
            let (old, change) = (*temperature, increment + *correction);
            let new = old + change;
            let part = new - old;
            *correction = (old - (new - part)) + (change - part);
            *temperature = new;
            *warming = *increment;
            new.is_finite()
        };
        rows.map(apply).reduce(|| true, |a, b| a & b)
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        4 * self.start.len()
            + 8 * self.halves.len()
            + 8 * self.conductance.len()
            + 33 * self.held.len()
            + self.touching_now.bytes()
    }
}

/// Conductance of a link without a crack, with the conductivities of both ends (W/(m·K)), W/K.
pub(super) fn conductance(link: &Link, a: f64, b: f64) -> f64 {
    // A uniform material has one rounding less, and the bits of a finite difference stencil.
    if a == b {
        return link.area * a / (link.length_a + link.length_b);
    }
    link.area / (link.length_a / a + link.length_b / b)
}

/// `V exp(−|x − c|²/(2r²))` of each particle.
fn gaussian(model: &HeatModel, particles: &Particles, center: &Vec3, radius: f64) -> Vec<f64> {
    let weight = |(x, volume): (&Vec3, &f64)| {
        let distance = (x - center).norm_squared() / (radius * radius);
        volume * libm::exp(-0.5 * distance)
    };
    particles.position.par_iter().zip(&model.network.volume).with_min_len(TILE).map(weight).collect()
}

/// Add what all contacts that a particle may have later conduct at most, W/K.
fn add_later_contacts(model: &HeatModel, particles: &Particles, sums: &mut [f64]) {
    let Some(contact) = &model.contact else { return };
    let radii = particles.radius.iter().fold([f64::INFINITY, 0.0], |[low, high], r| [r.min(low), r.max(high)]);
    let conductivity = |p: usize| model.largest_conductivity(particles.material[p]);
    let most = (0..particles.len()).map(conductivity).fold(0.0, f64::max);
    for (p, sum) in sums.iter_mut().enumerate() {
        *sum += contact.most(particles.radius[p], radii, [conductivity(p), most]);
    }
}
