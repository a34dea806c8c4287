//! Results of the network: counts, energies, virial, stress, couple stress, rows of contacts.

use concordem_contact::constraint::Constraint;
use concordem_contact::law::EnergySplit;
use concordem_contact::math::Vec3;
use concordem_operator::stress::{ParticleVolume, Partition, particle_moments, region_stress};
use concordem_operator::{ContactSet, LoadSet, Region, Truncation, couple_stress};
use concordem_solver::forces::BondEvent;
use concordem_solver::heat::{HeatLedger, HeatState};
use concordem_solver::integrate::Damping;
use concordem_solver::record::ContactForces;
use concordem_solver::state::contacts::{ContactFlags, Pair};
use concordem_solver::time_step::{self, TimeStepBounds};

use super::{Network, NetworkError, blocks};
use crate::atoms::{FROZEN_MASS, Tag};
use crate::records::Record;

/// Sums over the bonds and contacts that a processor counts.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sums {
    /// Intact bonds.
    pub bonds: f64,
    /// Bonds broken so far.
    pub broken: f64,
    /// Unbonded contacts that touch.
    pub contacts: f64,
    /// Energy stored in normal deformation, shear, bending, and twist at the last sampled step, J.
    pub stored: [f64; 4],
    /// Energy dissipated so far by damage and breaking, by friction, and by dashpots, J.
    pub dissipated: [f64; 3],
    /// Error of the trapezoidal work rule so far, J.
    pub integration: f64,
    /// Largest reference or current length of a bond, m.
    pub longest: f64,
    /// Heat content relative to the reference temperature, heat from sources, and heat through the boundary so far, J.
    pub heat: [f64; 3],
}

/// Reals of a row of [`Network::take_breaks`].
pub const BREAK: usize = 12;

/// A bond that broke: the lower id, the other one, step, contact point (m), fractions of normal, shear, bending, and twist in the energy that it
/// stored, dissipated energy (J), and 1 if shear broke it by a criterion of shear, else 0.
pub(super) fn row_of_break([a, b]: [Tag; 2], step: i64, event: &BondEvent) -> [f64; BREAK] {
    let sum: f64 = event.stored.iter().sum();
    let [normal, shear, bending, twist] = event.stored.map(|part| if sum > 0.0 { part / sum } else { 0.0 });
    let [x, y, z] = event.position.into();
    [
        a as f64,
        b as f64,
        step as f64,
        x,
        y,
        z,
        normal,
        shear,
        bending,
        twist,
        event.energy,
        f64::from(u8::from(event.in_shear)),
    ]
}

/// A recorded contact that a processor counts.
struct Counted {
    /// Its place among the recorded ones.
    row: usize,
    /// The lower id, and the other one.
    tags: [Tag; 2],
    /// −1 if the recorded force acts on the atom with the higher id.
    sign: f64,
    area: f64,
    damage: f64,
    /// 1 for a bond, 0 for a contact.
    bonded: f64,
}

/// Number of reals in [`Network::totals`].
pub const TOTALS: usize = 12;

impl Network {
    pub(super) fn tags_of(&self, pair: Pair) -> [Tag; 2] {
        [self.tags[pair.a as usize], self.tags[pair.b as usize]]
    }

    /// Sums over the bonds and contacts that this processor counts.
    pub fn sums(&self) -> Sums {
        let bonds = self.state.bonds[0].contacts();
        let (mut count, mut longest) = (0.0, 0.0f64);
        for k in 0..bonds.len() {
            let view = bonds.view(k);
            if !view.flags.has(ContactFlags::BROKEN) {
                count += f64::from(u8::from(!view.flags.has(ContactFlags::NOT_OWNED)));
                longest = longest.max(view.previous.length).max(view.reference.length);
            }
        }
        let touching = self.state.contacts.as_ref().map_or(0, |block| {
            let block = block.contacts();
            let counts = |k: &usize| {
                let flags = block.view(*k).flags;
                flags.carries() && !flags.has(ContactFlags::NOT_OWNED)
            };
            (0..block.len()).filter(counts).count()
        });
        longest = longest.max(self.longest_waiting());
        longest = self.fresh.iter().map(|bond| bond.length).fold(longest, f64::max);
        let (s, d) = (&self.stored, &self.dissipated);
        Sums {
            bonds: count,
            broken: self.broken,
            contacts: touching as f64,
            stored: [s.stored_normal, s.stored_shear, s.stored_bending, s.stored_twist],
            dissipated: [d.damage, d.friction, d.viscous],
            integration: d.integration,
            longest,
            heat: self.heat_sums(),
        }
    }

    /// Number of bonds whose A this processor owns, and number of bonds whose B it owns. Summed over processors, both equal the total
    /// number of bonds if every processor knows all bonds of its atoms.
    pub fn ends(&self) -> [f64; 2] {
        let bonds = self.state.bonds[0].contacts();
        let mut ends = [0.0; 2];
        for view in (0..bonds.len()).map(|k| bonds.view(k)).filter(|view| !view.flags.has(ContactFlags::BROKEN)) {
            for (end, p) in ends.iter_mut().zip([view.pair.a, view.pair.b]) {
                *end += f64::from(u8::from(self.owned[p as usize]));
            }
        }
        ends
    }

    /// Totals for a restart file, to be summed over processors: number of broken bonds, dissipated energies, and stored energies of the
    /// last sampled step, heat content at the start, heat from sources and through the boundary (J).
    pub fn totals(&self) -> [f64; TOTALS] {
        let (d, s) = (&self.dissipated, &self.stored);
        let heat = self.state.heat.as_ref().map_or_else(HeatLedger::default, |heat| heat.ledger);
        [
            self.broken,
            d.damage,
            d.friction,
            d.viscous,
            d.integration,
            s.stored_normal,
            s.stored_shear,
            s.stored_bending,
            s.stored_twist,
            heat.initial,
            heat.sources.get(),
            heat.boundary.get(),
        ]
    }

    /// Step of the net forces stored with the atoms, if any.
    pub fn found_at(&self) -> Option<i64> {
        self.found_at
    }

    /// Continue from a restart file with the totals of this processor and the step whose forces the file contains.
    pub fn resume(&mut self, totals: &[f64; TOTALS], found_at: Option<i64>) {
        let [broken, damage, friction, viscous, integration, normal, shear, bending, twist, initial, sources, boundary] =
            *totals;
        if let Some(thermal) = &mut self.thermal {
            thermal.begun = true;
            let ledger = HeatLedger::from_reals([initial, sources, 0.0, boundary, 0.0]);
            self.state.heat = Some(HeatState { ledger, ..HeatState::default() });
        }
        self.found_at = found_at;
        self.broken = broken;
        self.dissipated = EnergySplit { damage, friction, viscous, integration, ..EnergySplit::default() };
        self.stored = EnergySplit {
            stored_normal: normal,
            stored_shear: shear,
            stored_bending: bending,
            stored_twist: twist,
            ..EnergySplit::default()
        };
    }

    /// Contact forces of the last recorded step.
    pub fn recorded(&self) -> &ContactForces {
        &self.recorded
    }

    /// Atom ids of the bonds with an atom on this processor that broke in the last force computation.
    pub fn broken_now(&self) -> &[[Tag; 2]] {
        &self.broken_now
    }

    /// Keep rows for [`Self::take_breaks`] from now on.
    pub fn keep_breaks(&mut self) {
        self.breaks.get_or_insert_default();
    }

    /// Rows of the bonds that broke since the last call and that this processor counts, [`BREAK`] reals each, in the order of the steps.
    pub fn take_breaks(&mut self) -> Vec<f64> {
        self.breaks.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Virial `−Σ l⊗f^A` (J) of the recorded contacts: xx, yy, zz, xy, xz, yz, branch vector first. Each atom gets half of a contact,
    /// so the sum over processors is complete. The halves of owned atoms are also added to `per_atom` (six reals per atom of the
    /// host), unless it is empty.
    pub fn virial(&self, per_atom: &mut [f64]) -> [f64; 6] {
        let mut total = [0.0; 6];
        let r = &self.recorded;
        for ((pair, l), f) in r.pair.iter().zip(&r.branch).zip(&r.force) {
            let half = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|(i, j)| -0.5 * l[i] * f[j]);
            for p in pair.map(|p| p as usize) {
                if !self.owned[p] {
                    continue;
                }
                for (sum, half) in total.iter_mut().zip(half) {
                    *sum += half;
                }
                if let Some(of_atom) = per_atom.get_mut(6 * self.atom[p] as usize..).and_then(|rest| rest.get_mut(..6))
                {
                    for (sum, half) in of_atom.iter_mut().zip(half) {
                        *sum += half;
                    }
                }
            }
        }
        total
    }

    /// A time step (s) for which the bonds and contacts of this processor are stable: the largest one, unless a quick estimate, which is
    /// smaller, exceeds `dt` (s).
    pub fn stable_step(&mut self, dt: f64) -> f64 {
        let suffices = |quick: &TimeStepBounds| quick.limit(&Damping::None) >= dt;
        // For the solver, held particles are constrained. Here it does not move them, so that else nothing needs to know.
        let held = |mass: &f64| if *mass >= FROZEN_MASS { Constraint::ALL } else { Constraint::FREE };
        let constraint = self.state.particles.mass.iter().map(held).collect();
        let free = std::mem::replace(&mut self.state.particles.constraint, constraint);
        let bounds = time_step::bounds_unless(&self.state, self.model.deformable.as_ref(), suffices).0;
        self.state.particles.constraint = free;
        bounds.limit(&Damping::None)
    }

    fn recorded_at(&self, step: i64) -> Result<&ContactForces, NetworkError> {
        if self.recorded_at == Some(step) || self.solver.is_none() {
            Ok(&self.recorded)
        } else {
            Err(NetworkError::NotRecorded { step })
        }
    }

    /// Write the stress (Pa) of owned atoms at `step`: [`particle_moments`] of the recorded contacts divided by the volumes. Nine reals
    /// per atom of the host: xx, xy, xz, yx, …, position first. No communication is needed, because this processor knows every
    /// contact of its owned atoms.
    ///
    /// # Errors
    /// No recorded forces at this step, or an error of the operator.
    pub fn stress(
        &self,
        step: i64,
        partition: Partition,
        volume: ParticleVolume,
        per_atom: &mut [f64],
    ) -> Result<(), NetworkError> {
        let particles = &self.state.particles;
        let contacts = self.recorded_at(step)?.set(particles)?;
        let moments = particle_moments(&contacts, &LoadSet::none(), partition);
        let volumes = volume.of(&particles.radius)?;
        for (p, (moment, volume)) in moments.iter().zip(&volumes).enumerate().filter(|(p, _)| self.owned[*p]) {
            let stress = (moment / *volume).transpose();
            per_atom[9 * self.atom[p] as usize..][..9].copy_from_slice(stress.as_slice());
        }
        Ok(())
    }

    /// Sums over the contacts recorded at `step` that this processor counts, to be summed over processors: `Σ l⊗f^A` (J), and the
    /// couple stress about the origin times the volume, without its axial part (N·m²). Nine reals each, in the order of
    /// [`Self::stress`].
    ///
    /// # Errors
    /// A periodic box, no recorded forces at this step, or an error of the operator.
    pub fn couple_sums(&self, step: i64) -> Result<[f64; 18], NetworkError> {
        if self.state.cell.is_some() {
            return Err(NetworkError::Periodic);
        }
        let all = self.recorded_at(step)?;
        let mut counted = ContactForces::default();
        for k in (0..all.pair.len()).filter(|&k| self.owned[all.pair[k][0] as usize]) {
            counted.pair.push(all.pair[k]);
            counted.branch.push(all.branch[k]);
            counted.point.push(all.point[k]);
            counted.force.push(all.force[k]);
            counted.moment.push(all.moment[k]);
        }
        let contacts: ContactSet<'_> = counted.set(&self.state.particles)?;
        let stress = region_stress(&contacts, &Region::All { volume: 1.0 }, Truncation::BranchClipped, None)?.stress;
        // The axial part vanishes about the origin.
        let couple = couple_stress::internal(&contacts, 1.0, &Vec3::zeros())?;
        let mut sums = [0.0; 18];
        sums[..9].copy_from_slice(stress.transpose().as_slice());
        sums[9..].copy_from_slice(couple.transpose().as_slice());
        Ok(sums)
    }

    /// Reals per record of [`Self::histories`].
    pub fn record_reals(&self) -> usize {
        Record::reals(self.width)
    }

    /// Records of the bonds and contacts that this processor counts, as written by [`Record::write`].
    pub fn histories(&self) -> Vec<f64> {
        let mut reals = Vec::new();
        for (kind, block) in blocks(&self.state) {
            for k in (0..block.len()).filter(|&k| !block.view(k).flags.has(ContactFlags::NOT_OWNED)) {
                if let Some(record) = self.record_of(&self.tags, kind, k) {
                    record.write(self.width, &mut reals);
                }
            }
        }
        reals
    }

    /// Reals per row of [`Self::rows`].
    pub const ROW: usize = 16;

    /// Rows of the recorded contacts that this processor counts: the lower id, the other one, force on the first atom (N), moment on it
    /// about the contact point (N·m), contact point (m), length (m), area (m²), damage, whether it is a bond, and a zero.
    pub fn rows(&self) -> Vec<f64> {
        let mut rows = Vec::new();
        let r = &self.recorded;
        self.for_each_counted(|one| {
            rows.extend(one.tags.map(|tag| tag as f64));
            rows.extend((r.force[one.row] * one.sign).iter());
            rows.extend((r.moment[one.row] * one.sign).iter());
            rows.extend(r.point[one.row].iter());
            rows.extend([r.branch[one.row].norm(), one.area, one.damage, one.bonded, 0.0]);
        });
        rows
    }

    /// Reals per line of [`Self::lines`].
    pub const LINE: usize = 19;

    /// Lines for a viewer: the recorded contacts that this processor counts, between atoms whose `mask`, by the host's numbers of atoms, has a bit
    /// of `group`. A line begins with the centers of the atom with the lower id and of the other one, which may lie in another periodic image (m).
    /// Then: both ids, whether it is a bond, damage, normal force (positive in tension) and shear force (N), force on the first atom (N), moment
    /// on it about the contact point (N·m), area (m²).
    pub fn lines(&self, mask: &[i32], group: i32) -> Vec<f64> {
        let mut lines = Vec::new();
        let r = &self.recorded;
        let is_member = |p: usize| mask.get(self.atom[p] as usize).is_some_and(|mask| mask & group != 0);
        self.for_each_counted(|one| {
            let [a, b] = r.pair[one.row].map(|p| p as usize);
            if !is_member(a) || !is_member(b) {
                return;
            }
            let (branch, force) = (r.branch[one.row], r.force[one.row]);
            let mut ends = [self.state.particles.position[a], self.state.particles.position[a] + branch];
            if one.sign < 0.0 {
                ends.reverse();
            }
            let normal = branch.normalize();
            let tension = force.dot(&normal);
            lines.extend(ends.iter().flat_map(|end| end.iter()));
            lines.extend(one.tags.map(|tag| tag as f64));
            lines.extend([one.bonded, one.damage, tension, (force - normal * tension).norm()]);
            lines.extend((force * one.sign).iter());
            lines.extend((r.moment[one.row] * one.sign).iter());
            lines.push(one.area);
        });
        lines
    }

    /// The recorded contacts that this processor counts, in their order.
    fn for_each_counted(&self, mut visit: impl FnMut(Counted)) {
        let r = &self.recorded;
        let mut row = 0;
        for ((_, block), &end) in blocks(&self.state).zip(&r.block_end) {
            while row < end {
                let [a, b] = r.pair[row];
                let pair = Pair { a, b };
                // A bond that has broken at this step is gone, and those behind it have moved up.
                let pairs = block.pairs();
                let k = Some(r.place[row] as usize).filter(|&k| pairs.get(k) == Some(&pair));
                let k = k.or_else(|| pairs.binary_search(&pair).ok());
                let [a, b] = [a as usize, b as usize];
                if self.owned.get(a) == Some(&true) && b < self.tags.len() {
                    let [ta, tb] = self.tags_of(pair);
                    let (area, damage, bonded) = if let Some(k) = k {
                        let view = block.view(k);
                        (
                            view.reference.area,
                            block.damage(k),
                            f64::from(u8::from(view.flags.has(ContactFlags::BONDED))),
                        )
                    } else {
                        (0.0, 1.0, 0.0)
                    };
                    let (tags, sign) = if ta < tb { ([ta, tb], 1.0) } else { ([tb, ta], -1.0) };
                    visit(Counted { row, tags, sign, area, damage, bonded });
                }
                row += 1;
            }
        }
    }
}
