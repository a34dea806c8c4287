//! Heat conduction between the atoms of one processor, and the expansion of their bonds.
//!
//! The temperature of an atom travels with it ([`super::memory`]), and what conducts along a bond with its record. A step conducts
//! from the temperatures of the last step: each processor knows those of its atoms and ghosts, and all bonds of its atoms, so it
//! computes the heat that flows into its atoms. The flow between two processors is computed on both, with the same bits. The new
//! temperatures reach the ghosts with the positions; then bonds get the lengths of these temperatures, on both processors the same.

use concordem_contact::heat::HeatNetwork;
use concordem_contact::math::Vec3;
use concordem_contact::quantity::Quantity;
use concordem_solver::heat::expansion::Expansion;
use concordem_solver::heat::network::{self, NearPair};
use concordem_solver::heat::pass::HeatPass;
use concordem_solver::heat::{
    ContactConduction, Curves, Exchange, Exposure, HeatLedger, HeatModel, HeatState, Held, Link, Source, Spread,
    Supply, SurfaceExchange,
};
use concordem_solver::state::Particles;

use super::exchange::Arriving;
use super::heat_network::NetworkFile;
use super::{Network, NetworkError};
use crate::atoms::{Atoms, Tag};
use crate::options::HeatTables;
use crate::records::{Record, THERMAL, ascending};

/// What a bond keeps for heat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ThermalBond {
    /// Ids of A and B.
    pub(super) tags: [Tag; 2],
    /// Length at the reference temperature, m.
    rest: f64,
    /// Area through which heat flows, m².
    pub(super) area: f64,
    /// Distances of A and B from it, m.
    pub(super) lengths: [f64; 2],
}

impl ThermalBond {
    /// For a record.
    pub(super) fn reals(&self) -> [f64; THERMAL] {
        [self.rest, self.area, self.lengths[0], self.lengths[1]]
    }

    /// Ids, the lower one first.
    fn key(&self) -> [Tag; 2] {
        ascending(self.tags)
    }

    fn of(record: &Record, width: usize) -> Self {
        let at = width - THERMAL;
        let [rest, area, of_a, of_b] = [0, 1, 2, 3].map(|k| record.history[at + k]);
        Self { tags: record.tags, rest, area, lengths: [of_a, of_b] }
    }
}

/// Heat conduction of a network.
pub(super) struct Thermal {
    pub(super) tables: HeatTables,
    /// The file of `heat_network`, if there is one.
    pub(super) file: Option<NetworkFile>,
    /// Bit of each group of the tables.
    bits: Vec<i32>,
    /// Volume of all atoms of each group, m³.
    volumes: Vec<f64>,
    model: HeatModel,
    pass: HeatPass,
    expansion: Expansion,
    /// Of all bonds since the last rebuild, sorted by ids, the lower one first.
    pub(super) bonds: Vec<ThermalBond>,
    /// Bit mask of the groups of each particle.
    mask: Vec<i32>,
    /// Largest stable time step of the motion, s, and the atom that needs it.
    bound: (f64, Tag),
    /// Whether bonds broke since the links were made.
    stale: bool,
    /// Whether the heat at the start is known.
    pub(super) begun: bool,
}

impl Thermal {
    pub(super) fn new(tables: HeatTables) -> Self {
        let heat = &tables.heat;
        let temperature = heat.temperature.si();
        let model = HeatModel {
            materials: tables.materials.clone(),
            curves: Curves { materials: tables.curves.clone(), of: Vec::new() },
            network: network::Network::default(),
            capacity: Vec::new(),
            supply: Supply::default(),
            reference_temperature: heat.reference_temperature.map_or(temperature, Quantity::si),
            time_factor: heat.time_factor.si(),
            implicit: false,
            mechanics: true,
            dissipation: false,
            crack_resistance: f64::INFINITY,
            contact: heat.contact.as_ref().map(|contact| ContactConduction::of(contact, false, true)),
        };
        Self {
            bits: vec![0; tables.groups.len()],
            volumes: vec![0.0; tables.groups.len()],
            file: tables.network.clone().map(NetworkFile::new),
            tables,
            model,
            pass: HeatPass::default(),
            expansion: Expansion::default(),
            bonds: Vec::new(),
            mask: Vec::new(),
            bound: (f64::INFINITY, 0),
            stale: false,
            begun: false,
        }
    }

    /// Initial temperature of an atom with this bit mask of its groups, K.
    pub(super) fn initial_temperature(&self, mask: i32) -> f64 {
        let heat = &self.tables.heat;
        let of_group = heat.initials.iter().rev().find(|one| mask & self.bits[self.tables.group(&one.set)] != 0);
        of_group.map_or(heat.temperature.si(), |one| one.temperature.si())
    }

    /// Volume that an atom of the radius (m) stands for, m³.
    fn volume(&self, radius: f64) -> f64 {
        let edge = 2.0 * radius;
        let grain = 4.0 / 3.0 * radius * radius * radius;
        if self.tables.heat.model == HeatNetwork::Contacts { std::f64::consts::PI * grain } else { edge * edge * edge }
    }

    /// Heat capacity (J/K) of an atom of a material with its mass (kg) and volume (m³).
    fn capacity(&self, material: u16, mass: f64, volume: f64) -> f64 {
        let specific_heat = self.model.materials[material as usize].specific_heat;
        match self.tables.bulk_density[material as usize] {
            Some(density) => density * specific_heat * volume,
            None => mass * specific_heat,
        }
    }

    /// Whether bonds expand.
    pub(super) fn expands(&self) -> bool {
        self.model.expands()
    }

    /// Data of a bond.
    pub(super) fn bond(&self, tags: [Tag; 2]) -> Option<&ThermalBond> {
        self.bonds.binary_search_by_key(&ascending(tags), ThermalBond::key).ok().map(|k| &self.bonds[k])
    }

    /// Length of a bond with the length `rest` (m) at the reference temperature, between particles `a` and `b`, m.
    pub(super) fn length(&self, particles: &Particles, heat: &HeatState, [a, b]: [usize; 2], rest: f64) -> f64 {
        let strain = |p: usize| self.model.strain(particles.material[p], heat.temperature[p]);
        rest * (1.0 + 0.5 * (strain(a) + strain(b)))
    }

    /// Data of new bonds: `pairs` with ids, length at the reference temperature (m), and the vector between the centers.
    fn measure(
        &self,
        particles: &Particles,
        new: &[([Tag; 2], f64)],
        pairs: &[NearPair],
    ) -> Result<Vec<ThermalBond>, NetworkError> {
        if let Some(file) = &self.file {
            let of = |&(tags, rest): &([Tag; 2], f64)| {
                let [area, of_a, of_b] = file.bond(tags)?;
                Ok(ThermalBond { tags, rest, area, lengths: [of_a, of_b] })
            };
            return new.iter().map(of).collect();
        }
        let links = network::ordered(particles, pairs, &[], false).links;
        let of = |(&(tags, rest), link): (&([Tag; 2], f64), &Link)| ThermalBond {
            tags,
            rest,
            area: link.area,
            lengths: [link.length_a, link.length_b],
        };
        Ok(new.iter().zip(&links).map(of).collect())
    }

    /// Heat from outside into the atoms that this processor owns.
    fn supply(&self, owned: &[bool], radius: &[f64]) -> Supply {
        let members = |set: Option<&String>| -> Vec<u32> {
            let Some(set) = set else { return Vec::new() };
            let bit = self.bits[self.tables.group(set)];
            (0..owned.len()).filter(|&p| owned[p] && self.mask[p] & bit != 0).map(|p| p as u32).collect()
        };
        let mut supply = Supply::default();
        for source in &self.tables.heat.sources {
            let whole = source.set.as_ref().map_or(0.0, |set| self.volumes[self.tables.group(set)]);
            let share = |p: u32| (p, self.model.network.volume[p as usize] / whole);
            let power = source.power.map_or(0.0, Quantity::si);
            let power = source.density.map_or(power, |density| density.si() * whole);
            let shares = members(source.set.as_ref()).into_iter().map(share).collect();
            supply.sources.push(Source { power, spread: Spread::Shares(shares) });
        }
        for boundary in &self.tables.heat.boundaries {
            let particles = members(boundary.set.as_ref());
            if let Some(temperature) = boundary.temperature {
                // A later temperature overrides an earlier one.
                for earlier in &mut supply.held {
                    earlier.particles.retain(|p| particles.binary_search(p).is_err());
                }
                supply.held.push(Held { particles, temperature: temperature.si() });
                continue;
            }
            let exposure = |particle: u32| {
                let radius = radius[particle as usize];
                let edge = 2.0 * radius;
                Exposure { particle, face: 0, area: edge * edge, distance: radius, normal: Vec3::zeros() }
            };
            let exposures = particles.into_iter().map(exposure).collect();
            supply.surfaces.push(SurfaceExchange { exposures, exchange: Exchange::of(boundary) });
        }
        supply
    }
}

impl Network {
    /// Temperature at which bonds have their reference lengths, K; 0 without heat conduction.
    pub fn reference_temperature(&self) -> f64 {
        self.thermal.as_ref().map_or(0.0, |thermal| thermal.model.reference_temperature)
    }

    /// Names of the host's groups that the tables of heat name.
    pub fn heat_groups(&self) -> &[String] {
        self.thermal.as_ref().map_or(&[], |thermal| &thermal.tables.groups)
    }

    /// Set the bits of [`Self::heat_groups`].
    pub fn set_heat_groups(&mut self, bits: &[i32]) {
        if let Some(thermal) = &mut self.thermal {
            thermal.bits.copy_from_slice(bits);
        }
    }

    /// Groups whose volume sources need ([`Self::set_heat_volume`]).
    pub fn heated_groups(&self) -> Vec<usize> {
        let Some(thermal) = &self.thermal else { return Vec::new() };
        let sets = thermal.tables.heat.sources.iter().filter_map(|source| source.set.as_ref());
        let mut groups: Vec<usize> = sets.map(|set| thermal.tables.group(set)).collect();
        groups.sort_unstable();
        groups.dedup();
        groups
    }

    /// Volumes (m³) of the atoms of a group that this processor owns.
    pub fn heat_volumes(&self, atoms: &Atoms<'_>, group: usize) -> Vec<f64> {
        let Some(thermal) = &self.thermal else { return Vec::new() };
        let bit = thermal.bits[group];
        let members = (0..atoms.owned).filter(|&i| atoms.mask[i] & bit != 0 && atoms.mask[i] & atoms.group != 0);
        members.map(|i| self.heat_of(thermal, atoms, i)[1]).collect()
    }

    /// Set the volume of all atoms of a group, m³.
    pub fn set_heat_volume(&mut self, group: usize, volume: f64) {
        if let Some(thermal) = &mut self.thermal {
            thermal.volumes[group] = volume;
        }
    }

    /// Heat capacity (J/K) and volume (m³) of atom `i`.
    fn heat_of(&self, thermal: &Thermal, atoms: &Atoms<'_>, i: usize) -> [f64; 2] {
        if let Some(reals) = self.layout.heat_of_file(&atoms.memory[i * self.layout.width..]) {
            return if i < atoms.owned { reals } else { [1.0; 2] };
        }
        let volume = thermal.volume(atoms.radius[i]);
        [thermal.capacity((atoms.kind[i] - 1) as u16, atoms.mass[i], volume), volume]
    }

    /// Give the particles their temperatures, heat capacities, and volumes. Particles must be placed.
    pub(super) fn place_heat(&mut self, atoms: &Atoms<'_>) -> Result<(), NetworkError> {
        let Some(mut thermal) = self.thermal.take() else { return Ok(()) };
        thermal.mask = self.atom.iter().map(|&i| atoms.mask[i as usize]).collect();
        let (mut capacity, mut volume) = (Vec::with_capacity(self.atom.len()), Vec::with_capacity(self.atom.len()));
        for (p, &i) in self.atom.iter().enumerate() {
            let [c, v] = self.heat_of(&thermal, atoms, i as usize);
            if c.is_nan() || c <= 0.0 {
                let path = thermal.tables.network.clone().unwrap_or_default();
                return Err(NetworkError::NoHeatAtom { tag: self.tags[p], path });
            }
            capacity.push(c);
            volume.push(v);
        }
        thermal.model.capacity = capacity;
        thermal.model.network.volume = volume;
        thermal.model.curves.of.clone_from(&self.state.particles.material);
        let n = self.atom.len();
        let ledger = self.state.heat.as_ref().map_or_else(HeatLedger::default, |heat| heat.ledger);
        self.state.heat = Some(HeatState {
            temperature: vec![0.0; n],
            correction: vec![0.0; n],
            warming: vec![0.0; n],
            dissipated: Vec::new(),
            ledger,
        });
        self.thermal = Some(thermal);
        self.read_temperatures(atoms);
        Ok(())
    }

    /// Data of the bonds of this rebuild: those of held ones stay, `arriving` have them in their records, `new` are measured. Bonds must
    /// be in their final places.
    pub(super) fn place_thermal_bonds(
        &mut self,
        arriving: Vec<ThermalBond>,
        new: &[([Tag; 2], f64)],
        pairs: &[NearPair],
    ) -> Result<(), NetworkError> {
        let Some(thermal) = &mut self.thermal else { return Ok(()) };
        let mut known = std::mem::take(&mut thermal.bonds);
        known.extend(arriving);
        known.extend(thermal.measure(&self.state.particles, new, pairs)?);
        if let Some(file) = &mut thermal.file {
            file.forget_answers();
        }
        known.sort_by_key(ThermalBond::key);
        known.dedup_by_key(|bond| bond.key());
        thermal.bonds = known;
        let block = self.state.bonds[0].contacts_mut();
        let tags = &self.tags;
        let mut bonds = Vec::with_capacity(block.len());
        for pair in block.pairs() {
            let wanted = [pair.a, pair.b].map(|p| tags[p as usize]);
            let bond = thermal.bond(wanted).ok_or(NetworkError::BadRecord { tag: wanted[0] })?;
            bonds.push(*bond);
        }
        if thermal.expands() {
            *block.rest_lengths_mut() = bonds.iter().map(|bond| bond.rest).collect();
        }
        bonds.sort_by_key(ThermalBond::key);
        thermal.bonds = bonds;
        self.make_heat_pass();
        Ok(())
    }

    /// What conducts from now on: intact bonds, and what enters from outside.
    fn make_heat_pass(&mut self) {
        let Some(thermal) = &mut self.thermal else { return };
        let block = self.state.bonds[0].contacts();
        let link = |k: usize| {
            let pair = block.view(k).pair;
            let bond = thermal.bond([pair.a, pair.b].map(|p| self.tags[p as usize]))?;
            let [length_a, length_b] = bond.lengths;
            Some(Link { a: pair.a, b: pair.b, area: bond.area, length_a, length_b, branch: Vec3::zeros() })
        };
        let links = (0..block.len()).filter_map(link).filter(|link| link.area > 0.0).collect();
        thermal.model.network.links = links;
        thermal.model.supply = thermal.supply(&self.owned, &self.state.particles.radius);
        thermal.pass = HeatPass::new(&thermal.model, &self.state);
        thermal.stale = false;
        let Some(heat) = &self.state.heat else { return };
        let steps = thermal.pass.stable_steps(&thermal.model, &self.state.particles, heat);
        let of_owned = steps.iter().enumerate().filter(|(p, _)| self.owned[*p]);
        let least = of_owned.fold(
            (f64::INFINITY, 0),
            |least: (f64, Tag), (p, step)| {
                if *step < least.0 { (*step, self.tags[p]) } else { least }
            },
        );
        thermal.bound = (least.0 / thermal.model.time_factor, least.1);
        if !thermal.begun {
            thermal.begun = true;
            let initial = self.heat_content();
            if let Some(heat) = &mut self.state.heat {
                heat.ledger.initial = initial;
            }
        }
    }

    /// Bonds broke: links change before the next step.
    pub(super) fn bonds_broke(&mut self) {
        if let Some(thermal) = &mut self.thermal {
            thermal.stale = true;
        }
    }

    /// Fail if the time step (s) is beyond the bound of explicit conduction.
    ///
    /// # Errors
    /// It is.
    pub fn check_heat_step(&self, dt: f64) -> Result<(), NetworkError> {
        match &self.thermal {
            Some(Thermal { bound: (bound, tag), .. }) if dt > *bound => {
                Err(NetworkError::HeatStep { tag: *tag, dt, bound: *bound })
            }
            _ => Ok(()),
        }
    }

    /// Conduct heat for one time step, from the temperatures, positions, and bonds of the last one. The caller must then update the
    /// ghosts.
    ///
    /// # Errors
    /// A time step beyond the bound.
    pub fn conduct(&mut self, atoms: &mut Atoms<'_>) -> Result<(), NetworkError> {
        if self.thermal.is_none() || self.solver.is_none() {
            return Ok(());
        }
        if self.thermal.as_ref().is_some_and(|thermal| thermal.stale) {
            self.make_heat_pass();
        }
        self.check_heat_step(atoms.dt)?;
        let (Some(thermal), particles) = (&mut self.thermal, &self.state.particles) else { return Ok(()) };
        thermal.pass.touch(&thermal.model, &self.state, &[]);
        let Some(heat) = &mut self.state.heat else { return Ok(()) };
        // Spots, which alone read the time, are rejected.
        thermal.pass.begin(&thermal.model, particles, heat, 0.0, atoms.dt * thermal.model.time_factor)?;
        thermal.pass.finish(heat);
        self.write_temperatures(atoms)
    }

    /// Give bonds their lengths at the present temperatures.
    pub(super) fn expand(&mut self) {
        if let Some(thermal) = self.thermal.as_mut().filter(|thermal| thermal.expands()) {
            thermal.expansion.apply(&thermal.model, &mut self.state, true);
        }
    }

    /// Set the temperature (K) of the owned atoms with the group's bit. Their heat counts as heat through the boundary.
    pub fn set_temperature(&mut self, atoms: &mut Atoms<'_>, bit: i32, temperature: f64) {
        let Some(thermal) = self.thermal.take() else { return };
        for i in (0..atoms.owned).filter(|&i| atoms.mask[i] & bit != 0 && atoms.mask[i] & atoms.group != 0) {
            let [capacity, _] = self.heat_of(&thermal, atoms, i);
            let old = self.layout.set_temperature(&mut atoms.memory[i * self.layout.width..], temperature);
            let material = (atoms.kind[i] - 1) as usize;
            let curve = thermal.model.curves.materials.get(material).and_then(|curves| curves.specific_heat.as_ref());
            let warming = |from: f64, change: f64| curve.map_or(change, |curve| curve.integral(from, change));
            if let Some(heat) = self.state.heat.as_mut().filter(|_| thermal.begun) {
                heat.ledger.boundary.add(capacity * warming(old[0], temperature - old[0]));
                heat.ledger.boundary.add(-capacity * warming(old[0], old[1]));
            }
        }
        self.thermal = Some(thermal);
        // The forces of this step belong to the old lengths.
        self.found_at = None;
    }

    /// Heat content of the owned atoms relative to the reference temperature, J.
    pub(super) fn heat_content(&self) -> f64 {
        let (Some(thermal), Some(heat)) = (&self.thermal, &self.state.heat) else { return 0.0 };
        let reference = thermal.model.reference_temperature;
        let of = |p: usize| {
            let (temperature, correction) = (heat.temperature[p], heat.correction[p]);
            [
                thermal.model.heat_of(p, reference, temperature - reference),
                thermal.model.heat_of(p, temperature, correction),
            ]
        };
        let mut sum = concordem_solver::energy::Sum::default();
        for part in (0..self.owned.len()).filter(|&p| self.owned[p]).flat_map(of) {
            sum.add(part);
        }
        sum.get()
    }

    /// Content, heat from sources, and heat through the boundary of this processor, J.
    pub(super) fn heat_sums(&self) -> [f64; 3] {
        let ledger = self.state.heat.as_ref().map_or_else(HeatLedger::default, |heat| heat.ledger);
        [self.heat_content(), ledger.sources.get(), ledger.boundary.get()]
    }

    /// Data of the arriving bonds.
    pub(super) fn thermal_of(&self, arriving: &Arriving) -> Vec<ThermalBond> {
        if self.thermal.is_none() {
            return Vec::new();
        }
        arriving.bonds().map(|record| ThermalBond::of(&record, self.width)).collect()
    }
}
