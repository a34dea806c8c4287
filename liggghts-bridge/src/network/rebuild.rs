//! Builds the solver's state from the atoms and records of a processor after migration.

use concordem_contact::kinematics::sphere_sphere::initial_geometry;
use concordem_contact::law::{LawName, Reference};
use concordem_contact::math::{Mat3, Vec3};
use concordem_solver::Solver;
use concordem_solver::neighbor::candidate_pairs;
use concordem_solver::state::contacts::{ContactFlags, Pair};
use concordem_solver::state::{Cell, Particles, Sphere, State};

use super::{Network, NetworkError};
use crate::atoms::{Atoms, vector};
use crate::options::{Creation, Listed};
use crate::records::{Kind, Record};

/// Stands for the particle of an atom that is neither owned nor a ghost.
pub(super) const ABSENT: u32 = u32::MAX;

impl Network {
    /// Queue bonds of the user's list for the next rebuild, and forget those that this processor kept. Every processor must call this.
    pub fn make_listed(&mut self, bonds: impl Iterator<Item = Listed>) {
        self.fresh.extend(bonds.map(|(tags, length)| Record::fresh(tags, length)));
        if let Creation::List(kept) = &mut self.options.creation {
            *kept = Vec::new();
        }
    }

    /// Queue bonds from the host's lists (two ids and the bond type) for the next rebuild. A bond may be given on any processor, also on
    /// several.
    pub fn make_given(&mut self, bonds: &[[i32; 3]]) {
        for &[a, b, bond_type] in bonds {
            let mut record = Record::fresh([a.min(b), a.max(b)], None);
            if !self.options.bond_types.is_empty() {
                let kind = (bond_type - 1) as u16;
                // A type without parameters does not exist: the bond style requires them for all.
                record.row = self.bond_coefficients.get(kind, kind).unwrap_or_default();
            }
            self.fresh.push(record);
        }
    }

    /// Rebuild the state for the current distribution of atoms. `skin` (m): skin of the host's neighbor lists. `cutoff` (m): distance
    /// up to which ghosts exist. `mean_radius` (m): mean radius of the bonded atoms; only new bonds need it.
    ///
    /// # Errors
    /// An atom without parameters, a bond to an atom that does not exist here, a periodic box that is too small, or invalid ids.
    pub fn rebuild(
        &mut self,
        atoms: &mut Atoms<'_>,
        skin: f64,
        cutoff: f64,
        mean_radius: f64,
    ) -> Result<(), NetworkError> {
        self.check_ids(atoms)?;
        let mut records = self.records()?;
        self.place_particles(atoms)?;
        self.adjacency = None;
        self.particle_of.clear();
        self.generation += 1;
        let mut ends = self.ends_of(&records);
        if self.follow_lists(&mut records, &ends) {
            ends = self.ends_of(&records);
        }
        let largest = self.state.particles.radius.iter().copied().fold(0.0, f64::max);
        let smallest = self.state.particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
        // Same range as the host's lists.
        self.model.skin = if smallest.is_finite() { skin / smallest } else { 0.0 };
        let mut longest = if self.state.contacts.is_some() { 2.0 * largest + skin } else { 0.0 };
        for block in self.state.bonds.iter_mut().chain(&mut self.state.contacts) {
            block.contacts_mut().retain_where(&|_| false);
        }
        for (record, ends) in records.into_iter().zip(ends) {
            let ends = ends.map(|p| (p != ABSENT).then_some(p as usize));
            if !ends.iter().flatten().any(|&p| self.owned[p]) {
                continue;
            }
            match ends {
                [Some(a), Some(b)] => {
                    longest = longest.max(self.place_record(record, [a, b], &atoms.edge, mean_radius)?);
                }
                [a, _] if record.kind == Kind::Bond => {
                    let (tag, partner) = if a.is_some() { (0, 1) } else { (1, 0) };
                    let [tag, partner] = [record.tags[tag], record.tags[partner]];
                    return Err(NetworkError::OutOfSight { tag, partner, cutoff });
                }
                _ => self.dormant.push(record),
            }
        }
        for (axis, edge) in ['x', 'y', 'z'].into_iter().zip(atoms.edge) {
            if edge > 0.0 && edge < 2.0 * longest {
                return Err(NetworkError::BoxTooSmall { axis, edge, longest });
            }
        }
        self.state.clock.dt = atoms.dt;
        self.solver = Some(Solver::for_subdomain(self.model.clone(), &mut self.state, self.owned.clone())?);
        Ok(())
    }

    /// Particles of both ends of each record, [`ABSENT`] if this processor does not know the atom.
    fn ends_of(&self, records: &[Record]) -> Vec<[u32; 2]> {
        let particle = |tag: i32| self.tags.binary_search(&tag).map_or(ABSENT, |p| p as u32);
        records.iter().map(|record| record.tags.map(particle)).collect()
    }

    /// Append the bond or contact of `record` between particles `a` and `b` to its block; returns the larger of its reference and
    /// current length (m).
    fn place_record(
        &mut self,
        mut record: Record,
        [a, b]: [usize; 2],
        edge: &[f64; 3],
        mean_radius: f64,
    ) -> Result<f64, NetworkError> {
        let State { particles, bonds, contacts, cell, .. } = &mut self.state;
        let bonds = bonds[0].contacts_mut();
        let between = particles.position[b] - particles.position[a];
        let image = image_of(&between, edge);
        let is_bond = record.kind == Kind::Bond;
        let coefficients = if is_bond { &self.bond_coefficients } else { &self.model.contact_rows };
        let by_bond_type = is_bond && !self.options.bond_types.is_empty();
        let by_atoms = || coefficients.get(particles.material[a], particles.material[b]);
        let Some(row) = (if by_bond_type { Some(record.row) } else { by_atoms() }) else {
            let types = [a, b].map(|p| i32::from(particles.material[p]) + 1);
            let law = if is_bond { self.options.law } else { self.options.contact.law() };
            return Err(NetworkError::NoRow {
                a: record.tags[0],
                b: record.tags[1],
                law: law.map_or("none", LawName::key),
                types,
            });
        };
        if record.is_fresh() {
            let shift = cell.map_or_else(Vec3::zeros, |cell: Cell| cell.shift(image));
            record.frame = initial_geometry(&particles.position[a], &particles.position[b], &shift);
            let length = record.reference.length;
            record.reference = Reference {
                length: if length > 0.0 { length } else { record.frame.length },
                area: bonds.bonded_area(row, particles.radius[a], particles.radius[b], mean_radius),
            };
        }
        let mut length = record.reference.length;
        if record.flags & ContactFlags::ACTIVE != 0 {
            length = length.max(record.frame.length);
        }
        let not_owned = if self.owned[a] { 0 } else { ContactFlags::NOT_OWNED };
        let flags = ContactFlags { row, bits: record.flags | not_owned, image, padding: 0 };
        let pair = Pair { a: a as u32, b: b as u32 };
        let block = if is_bond { Some(bonds) } else { contacts.as_mut().map(|block| block.contacts_mut()) };
        if let Some(block) = block {
            block.push_with_history(pair, flags, record.reference, record.frame, &record.history);
        }
        Ok(length)
    }

    /// Create one particle per atom of the group, ordered by id. An owned atom has priority over its ghosts.
    fn place_particles(&mut self, atoms: &Atoms<'_>) -> Result<(), NetworkError> {
        let mut order: Vec<(i32, u32)> = Vec::with_capacity(atoms.tag.len());
        order.extend(
            atoms
                .tag
                .iter()
                .zip(atoms.mask)
                .enumerate()
                .filter(|(_, (_, mask))| *mask & atoms.group != 0)
                .map(|(i, (&tag, _))| (tag, i as u32)),
        );
        order.sort_unstable();
        if let Some(&(tag, _)) = order.first().filter(|first| first.0 <= 0) {
            return Err(NetworkError::BadTag { tag });
        }
        let both_owned = |w: &&[(i32, u32)]| w[0].0 == w[1].0 && (w[1].1 as usize) < atoms.owned;
        if let Some(twice) = order.windows(2).find(both_owned) {
            return Err(NetworkError::BadTag { tag: twice[0].0 });
        }
        order.dedup_by_key(|entry| entry.0);
        self.tags = order.iter().map(|entry| entry.0).collect();
        self.atom = order.iter().map(|entry| entry.1).collect();
        self.owned = self.atom.iter().map(|&i| (i as usize) < atoms.owned).collect();
        let particles = &mut self.state.particles;
        *particles = Particles::default();
        for &i in &self.atom {
            let i = i as usize;
            let (radius, mass) = (atoms.radius[i], atoms.mass[i]);
            let sphere = Sphere { position: vector(atoms.position, i), radius };
            particles.push(sphere, (atoms.kind[i] - 1) as u16, mass, 0.4 * mass * (radius * radius));
        }
        self.state.cell = (atoms.edge != [0.0; 3]).then(|| {
            // The other axes have no periodic images, so any edge longer than the extent of the atoms works.
            let extent = |axis: usize| {
                let of = |fold: fn(f64, f64) -> f64, start: f64| {
                    particles.position.iter().map(|x| x[axis]).fold(start, fold)
                };
                let span = of(f64::max, f64::NEG_INFINITY) - of(f64::min, f64::INFINITY);
                4.0 * span.max(atoms.edge.iter().copied().fold(0.0, f64::max))
            };
            let edge = Vec3::from_fn(|axis, _| if atoms.edge[axis] > 0.0 { atoms.edge[axis] } else { extent(axis) });
            Cell::new(Mat3::from_diagonal(&edge))
        });
        Ok(())
    }

    /// Queue bonds between all unbonded pairs of the group that are closer than the user's factor times the sum of their radii. Call
    /// [`Self::rebuild`] afterwards. Returns the number of bonds that this processor counts.
    ///
    /// # Errors
    /// The neighbor search fails.
    pub fn make_near(&mut self) -> Result<usize, NetworkError> {
        let Creation::Distance(factor) = self.options.creation else { return Ok(0) };
        let particles = &self.state.particles;
        // Search slightly farther: rounding in the search depends on the other atoms of this processor and must not affect the result.
        let reach: Vec<f64> = particles.radius.iter().map(|r| r * factor * (1.0 + 1e-9)).collect();
        let present: std::collections::HashSet<[i32; 2]> = {
            let bonds = self.state.bonds[0].contacts();
            (0..bonds.len()).map(|k| self.tags_of(bonds.view(k).pair)).collect()
        };
        let mut made = 0;
        for pair in candidate_pairs(&particles.position, &reach, self.state.cell.as_ref())? {
            let (a, b) = (pair.a as usize, pair.b as usize);
            let tags = [self.tags[a], self.tags[b]];
            let coefficients = &self.bond_coefficients;
            let shift = self.state.cell.map_or_else(Vec3::zeros, |cell| cell.shift(pair.image));
            let distance = initial_geometry(&particles.position[a], &particles.position[b], &shift).length;
            if distance >= factor * (particles.radius[a] + particles.radius[b]) {
                continue;
            }
            if !(self.owned[a] || self.owned[b])
                || coefficients.get(particles.material[a], particles.material[b]).is_none()
                || present.contains(&tags)
            {
                continue;
            }
            made += usize::from(self.owned[a]);
            self.fresh.push(Record::fresh(tags, None));
        }
        Ok(made)
    }
}

/// Periodic image of B closest to A; `between` is the position of B minus that of A. 0 along axes that are not periodic.
fn image_of(between: &Vec3, edge: &[f64; 3]) -> [i8; 3] {
    [0, 1, 2].map(|axis| if edge[axis] > 0.0 { -(between[axis] / edge[axis]).round() as i8 } else { 0 })
}
