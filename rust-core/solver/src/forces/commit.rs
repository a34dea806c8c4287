//! Commit of a contact's response: new history, totals, and forces on its particles.

use concordem_contact::columns::{Arrays as _, Lanes};
use concordem_contact::kinematics::deformable::{ParticleVirial, ParticleVirials};
use concordem_contact::kinematics::{MotionMeasure, PointKinematics, PreviousGeometry};
use concordem_contact::law::{ContactLaw, EnergySplit, LawState, Response, Status};
use concordem_contact::math::{Mat3, Vec3};
use concordem_contact::step::{Stepped, wrenches};
use concordem_contact::straight::{ContactColumns, Results};
use concordem_contact::wrench::{Wrenches, wrenches_of_four};

use super::BondEvent;
use super::kinds::LoopKind;
use super::tile::{LOCAL, PendingContact, TileEvaluator};
use crate::state::contacts::{ContactFlags, Pair};

/// Force, torques, and virial of a contact on its two particles.
struct Action<'a> {
    /// Unit normal from A to B.
    normal: &'a Vec3,
    /// Forces and torques on A and B.
    wrenches: &'a Wrenches,
    /// Contribution to the particle virials, if the particles deform.
    virial: Option<&'a ParticleVirial>,
}

impl<L: ContactLaw, K: LoopKind, T: Lanes> TileEvaluator<'_, L, K, T> {
    /// Commit the step of a contact.
    #[inline(always)]
    pub(super) fn commit(&mut self, contact: PendingContact, stepped: &Stepped<L>) {
        let (point, response) = (stepped.point(), &stepped.response);
        if self.deforms() {
            let viscous = L::viscous_force(&point.normal, &response.state);
            let virial = ParticleVirial::of(&point.normal, &response.force, &viscous, self.context.dashpots_strain);
            self.commit_response(contact, point, response, Some(&virial));
        } else {
            self.commit_response(contact, point, response, None);
        }
    }

    /// Commit a law's response to a contact.
    #[inline(always)]
    pub(super) fn commit_response(
        &mut self,
        pending: PendingContact,
        point: &PointKinematics,
        response: &Response<L::State>,
        virial: Option<&ParticleVirial>,
    ) {
        let inherits = self.inherits(&pending);
        let PendingContact { contact, slot, pair, begins, counted } = pending;
        let k = contact as usize;
        let a = pair.a as usize;
        let flags = &mut self.tile.flags[k];
        let totals = &mut self.totals;
        let &PointKinematics { normal, arm_a, arm_b, .. } = point;
        let mut dissipated = response.energy.dissipated();
        if inherits && counted && point.elongation_old < 0.0 {
            let law = &self.rows[flags.row as usize];
            let [regained, undone] = inherited_energy(law, point, response);
            totals.energy.damage -= regained;
            dissipated -= regained;
            totals.energy.integration -= undone;
        }
        self.tile.previous.set(k, PreviousGeometry { normal, length: point.length });
        if counted {
            totals.energy.damage += response.energy.damage;
            totals.energy.friction += response.energy.friction;
            totals.energy.viscous += response.energy.viscous;
            totals.energy.integration += response.energy.integration;
        }
        if response.status != Status::Lives {
            // Reported when it cracked, or open from the start.
            let failed = L::OUTLIVES_FAILURE && flags.has(ContactFlags::REPORTED);
            self.tile.history.set(k, end(flags, response.status, response.state));
            if response.status.is_broken() {
                let position = self.context.poses[a].position + normal * point.to_contact_point();
                let row = flags.row as usize;
                let offset = point.geometry.reference_length - self.rows[row].unstrained_length(&point.geometry);
                let undone = not_released([point.elongation_old + offset, point.elongation + offset], &response.energy);
                if counted {
                    totals.energy.damage -= undone;
                    dissipated -= undone;
                    totals.energy.integration += undone;
                }
                let (energy, stored, in_shear) = L::event(response);
                log_event(&mut totals.bond_events, pair, 1.0, position, energy, stored, [true, !failed, in_shear]);
            } else if !begins {
                log_opening(&mut totals.opened, pair);
            }
            if K::SAMPLE && self.context.heats {
                log_heat(&mut totals.dissipated, pair, dissipated);
            }
            if slot != LOCAL {
                self.clear_slot(slot);
            }
            return;
        }
        self.tile.history.set(k, response.state);
        let damage = L::damage(&response.state);
        if damage >= self.context.damage_threshold && !flags.has(ContactFlags::REPORTED) {
            flags.bits |= ContactFlags::REPORTED;
            let position = self.context.poses[a].position + normal * point.to_contact_point();
            let ((energy, stored, in_shear), fails) = (L::event(response), L::OUTLIVES_FAILURE && damage >= 1.0);
            log_event(&mut totals.bond_events, pair, damage, position, energy, stored, [false, fails, in_shear]);
        }
        if K::SAMPLE && self.context.heats {
            log_heat(&mut totals.dissipated, pair, dissipated);
        }
        let force = response.force;
        if K::SAMPLE && counted {
            totals.energy.stored_normal += response.energy.stored_normal;
            totals.energy.stored_shear += response.energy.stored_shear;
            totals.energy.stored_bending += response.energy.stored_bending;
            totals.energy.stored_twist += response.energy.stored_twist;
            totals.force_squared += force.norm_squared();
            if L::TRANSMITS_MOMENT {
                totals.moment_squared += response.moment.norm_squared();
            }
        }
        let wrenches = wrenches::<L>(&normal, [arm_a, arm_b], response);
        self.add_stress(&pending, point.length, &normal, &wrenches);
        self.accumulate(&pending, &Action { normal: &normal, wrenches: &wrenches, virial });
    }

    /// Commit the first `count` contacts from columns: geometries and histories all at once, forces and energies four at a time where
    /// the straight form is certain of all four. The last `unchanged` numbers of each history stay as they are.
    #[inline(always)]
    pub(super) fn commit_columns(
        &mut self,
        measure: MotionMeasure,
        count: usize,
        columns: &mut ContactColumns<L>,
        unchanged: usize,
    ) {
        // Bit `i`: contact `i` is stepped alone.
        let mut alone = 0_u32;
        let threshold = self.context.damage_threshold;
        // All columns at once, without a branch per contact; not with a damage of NaN.
        let mut all_certain = true;
        for damage in &columns.results.damage {
            all_certain &= *damage < threshold;
        }
        if !all_certain || self.full.is_none() {
            for i in 0..count {
                alone |= u32::from(self.is_alone(i, columns.results.damage[i])) << i;
            }
        }
        if alone != 0 {
            self.keep(alone, count, columns);
        }
        let Results { geometry, history, .. } = &columns.results;
        match self.full {
            Some(full) => self.tile.previous.write_run(full.first, geometry, 0),
            None => self.tile.previous.write(&self.listed()[..count], geometry),
        }
        if ContactColumns::<L>::USE.history {
            match self.full {
                Some(full) => self.tile.history.write_run(full.first, history, unchanged),
                // Also the unchanged numbers: few batches have gaps.
                None => self.tile.history.write(&self.listed()[..count], history),
            }
        }
        for first in (0..count).step_by(4) {
            let group = first..count.min(first + 4);
            if group.len() == 4 && (alone >> first).trailing_zeros() >= 4 {
                self.commit_four(first, &columns.results);
                continue;
            }
            for i in group {
                if alone >> i & 1 == 1 {
                    self.evaluate_one_again(self.pending[i], measure);
                } else {
                    self.commit_from_columns(i, &columns.results);
                }
            }
        }
    }

    /// Put the geometry and history before the step of the contacts `alone` into the results: they are stepped after the columns are
    /// stored.
    #[inline(always)]
    fn keep(&self, alone: u32, count: usize, columns: &mut ContactColumns<L>) {
        for i in (0..count).filter(|i| alone >> i & 1 == 1) {
            columns.results.geometry.set(i, self.tile.previous.get(self.pending[i].contact as usize));
            columns.results.history.set(i, columns.history.get(i));
        }
    }

    /// Whether contact `i` of the batch, with this damage in columns, is stepped alone: it inherits energy, and the ledger needs its
    /// whole motion; it begins between particles that deform; it ends; or the event log reports it, with energies that columns leave out.
    #[inline(always)]
    fn is_alone(&self, i: usize, damage: f64) -> bool {
        let pending = &self.pending[i];
        if pending.begins && (K::DEFORM || self.inherits(pending)) {
            return true;
        }
        let reported = || self.tile.flags[pending.contact as usize].has(ContactFlags::REPORTED);
        damage.is_nan() || damage >= self.context.damage_threshold && !reported()
    }

    /// Add the forces and energies of contact `i` of the batch.
    ///
    /// Each number is read where it is added, so that it needs no register before.
    #[inline(always)]
    fn commit_from_columns(&mut self, i: usize, results: &Results<L>) {
        let mut energy = self.totals.energy;
        self.add_energies(i, results, &mut energy);
        self.totals.energy = energy;
        let wrenches = results.wrenches.get(i);
        let PreviousGeometry { normal, length } = results.geometry.get(i);
        let pending = self.pending[i];
        self.add_stress(&pending, length, &normal, &wrenches);
        self.add_wrenches(i, results, &wrenches);
    }

    /// As [`Self::commit_from_columns`] for contacts `i` to `i + 3` of the batch.
    #[inline(always)]
    fn commit_four(&mut self, i: usize, results: &Results<L>) {
        // A copy, which stays in registers.
        let mut energy = self.totals.energy;
        for r in 0..4 {
            self.add_energies(i + r, results, &mut energy);
        }
        self.totals.energy = energy;
        let wrenches = wrenches_of_four(&results.wrenches, i, self.lanes);
        if K::PERIODIC {
            let mut sums = [self.totals.virial, self.totals.crossing];
            for (i, wrenches) in (i..).zip(&wrenches) {
                let PreviousGeometry { normal, length } = results.geometry.get(i);
                self.add_stress_to(&mut sums, &self.pending[i], length, &normal, wrenches);
            }
            [self.totals.virial, self.totals.crossing] = sums;
        }
        for (i, wrenches) in (i..).zip(&wrenches) {
            self.add_wrenches(i, results, wrenches);
        }
    }

    /// Add the energies of contact `i` of the batch to `energy`.
    #[inline(always)]
    fn add_energies(&self, i: usize, results: &Results<L>, energy: &mut EnergySplit) {
        let may = ContactColumns::<L>::USE;
        if self.pending[i].counted {
            if may.damage {
                energy.damage += results.damage_energy[i];
            }
            if may.viscous {
                energy.viscous += results.viscous[i];
            }
            if may.integration {
                energy.integration += results.integration[i];
            }
            if may.friction {
                energy.friction += results.friction[i];
            }
        }
    }

    /// Add the forces of contact `i` of the batch.
    #[inline(always)]
    fn add_wrenches(&mut self, i: usize, results: &Results<L>, wrenches: &Wrenches) {
        let (pending, normal) = (self.pending[i], results.geometry.normal.get(i));
        let virial =
            K::DEFORM.then(|| ParticleVirial { normal, pressure: results.pressure[i], other: results.other.get(i) });
        self.accumulate(&pending, &Action { normal: &normal, wrenches, virial: virial.as_ref() });
    }

    /// Add the force of a contact to the sums of the stress in a periodic cell.
    #[inline(always)]
    fn add_stress(&mut self, pending: &PendingContact, length: f64, normal: &Vec3, wrenches: &Wrenches) {
        let mut sums = [self.totals.virial, self.totals.crossing];
        self.add_stress_to(&mut sums, pending, length, normal, wrenches);
        [self.totals.virial, self.totals.crossing] = sums;
    }

    /// As [`Self::add_stress`], to copies of `virial` and `crossing`, which stay in registers.
    #[inline(always)]
    fn add_stress_to(
        &self,
        [virial, crossing]: &mut [Mat3; 2],
        pending: &PendingContact,
        length: f64,
        normal: &Vec3,
        wrenches: &Wrenches,
    ) {
        if K::PERIODIC && pending.counted {
            let force = &wrenches.a.force;
            *virial += (normal * length) * force.transpose();
            let i = self.tile.flags[pending.contact as usize].image;
            if i != [0, 0, 0] {
                *crossing += force * Vec3::new(f64::from(i[0]), f64::from(i[1]), f64::from(i[2])).transpose();
            }
        }
    }

    /// Add a contact to the totals and to its particles: directly if they lie in the tile, otherwise through its halo
    /// slot.
    #[inline(always)]
    fn accumulate(&mut self, pending: &PendingContact, action: &Action<'_>) {
        let &Action { normal, wrenches, virial } = action;
        let force = &wrenches.a.force;
        let &PendingContact { contact, slot, pair, counted, .. } = pending;
        let totals = &mut self.totals;
        totals.active += u64::from(counted);
        if K::SAMPLE
            && counted
            && let (Some(rates), Some(&rest)) = (&self.context.expansion, self.tile.rest_length.get(contact as usize))
        {
            let [before, after] = rates.work(pair.a, pair.b, rest, force.dot(normal));
            totals.expansion[0] += before;
            totals.expansion[1] += after;
        }
        let (a, b) = (pair.a as usize - self.tile.base, (pair.b as usize).wrapping_sub(self.tile.base));
        if let Some(virial) = virial {
            let parts = virial.parts();
            let ParticleVirials { virials: sums, reaction_sums } = &mut self.tile.virials;
            let (constraint, reacting) = (&self.context.particles.constraint, self.context.reacting);
            sums[a] += parts;
            if constraint[pair.a as usize].any(reacting) {
                reaction_sums[a].add(virial);
            }
            if slot == LOCAL {
                sums[b] += parts;
                if constraint[pair.b as usize].any(reacting) {
                    reaction_sums[b].add_opposite(virial);
                }
            } else {
                self.tile.virial_halo[slot as usize] = *virial;
            }
        }
        self.tile.net[a] += &wrenches.a;
        if slot == LOCAL {
            self.tile.net[b] += &wrenches.b;
        } else {
            self.tile.halo[slot as usize] = wrenches.b;
        }
    }
}

/// Energy of a contact at its first evaluation that no work of this step explains, in two parts, J.
///
/// The contact continues a bond that broke under compression. The energy of that bond was booked as released; the contact regains
/// the part that it stores at the overlap of the breaking step. The rest is an error: because the forces of the breaking step are
/// void, half of this step's work is not done.
#[inline(always)]
fn inherited_energy<L: ContactLaw>(law: &L, point: &PointKinematics, response: &Response<L::State>) -> [f64; 2] {
    let Response { force, energy, .. } = response;
    let along = point.normal * (point.elongation - point.elongation_old);
    let work = 0.5 * force.dot(&(along + point.shear_increment));
    let unexplained = energy.stored() + energy.dissipated() + energy.integration - work;
    if point.elongation >= 0.0 {
        return [unexplained, 0.0];
    }
    let regained = law.work_before(point, energy.stored_normal);
    [regained, unexplained - regained]
}

/// Part of the damage of a breaking step that the particles never stored, J.
///
/// Laws book the energy at the end of the step as damage, and take back as `integration` the half of the step's work that the
/// void forces of its end did not do. Both together are what the particles lose: for a spring `½k u_old u`, between the energies
/// before and after the step. It is the damage, and no error, as long as it is not negative.
///
/// Under pressure the contact that follows takes over the normal energy after the step, so that the normal half stays an error.
/// `old`, `now`: elongation of the normal spring before and after the step, m.
#[inline(always)]
fn not_released([old, now]: [f64; 2], energy: &EnergySplit) -> f64 {
    if now < 0.0 {
        let normal = energy.stored_normal * (1.0 - old / now);
        return (-energy.integration - normal).min(energy.damage - energy.stored_normal);
    }
    (-energy.integration).min(energy.damage)
}

/// Mark a contact that broke or opened; returns the history that it keeps. `last`: its history after the step.
#[inline(always)]
fn end<S: LawState>(flags: &mut ContactFlags, status: Status, last: S) -> S {
    if status.is_broken() {
        flags.bits |= ContactFlags::BROKEN;
        last
    } else {
        flags.bits &= !(ContactFlags::ACTIVE | ContactFlags::REPORTED);
        S::default()
    }
}

/// Add an unbonded contact that opened.
#[cold]
#[inline(never)]
fn log_opening(log: &mut Vec<Pair>, pair: Pair) {
    log.push(pair);
}

/// Add the energy (J) that a contact dissipated, if any.
#[cold]
#[inline(never)]
pub(super) fn log_heat(log: &mut Vec<(Pair, f64)>, pair: Pair, energy: f64) {
    if energy != 0.0 {
        log.push((pair, energy));
    }
}

/// Add a bond event to the log. The last argument: whether the bond broke, whether it lost its cohesion, and whether in shear.
///
/// Takes scalars: if any part of a [`Response`] went to a cold function, even as a copy, the compiler would keep the
/// responses of all contacts in memory instead of registers.
#[cold]
#[inline(never)]
fn log_event(
    log: &mut Vec<BondEvent>,
    pair: Pair,
    damage: f64,
    position: Vec3,
    energy: f64,
    stored: [f64; 4],
    [broke, fails, in_shear]: [bool; 3],
) {
    log.push(BondEvent { pair, broke, fails, in_shear, damage, position, energy, stored });
}
