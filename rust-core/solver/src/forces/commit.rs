//! Commit of a contact's response: new history, totals, and forces on its particles.

use concordem_contact::columns::Lanes;
use concordem_contact::kinematics::deformable::{ParticleVirial, ParticleVirials};
use concordem_contact::kinematics::{BranchVector, PointKinematics, PreviousGeometry};
use concordem_contact::law::{Batch, ColumnResult, ColumnResults, ContactLaw, EnergySplit, LawState, Response, Status};
use concordem_contact::math::{Mat3, Vec3};
use concordem_contact::wrench::Wrenches;

use super::BondEvent;
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

impl<L: ContactLaw, T: Lanes, const PERIODIC: bool, const SAMPLE: bool, const DEFORM: bool, const SIZE: usize>
    TileEvaluator<'_, L, T, PERIODIC, SAMPLE, DEFORM, SIZE>
{
    /// Commit a law's response to contact `i` of the batch.
    #[inline(always)]
    pub(super) fn commit_response(
        &mut self,
        i: usize,
        point: &PointKinematics,
        response: &Response<L::State>,
        virial: Option<&ParticleVirial>,
    ) {
        let inherits = self.inherits(i);
        let PendingContact { contact, slot, pair, begins, counted } = self.pending[i];
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
            self.tile.history.set(k, end(flags, response.status, response.state));
            if response.status == Status::Broke {
                let position = self.context.poses[a].position + normal * arm_a;
                let row = flags.row as usize;
                let offset = point.geometry.reference_length - self.rows[row].unstrained_length(&point.geometry);
                let undone = not_released([point.elongation_old + offset, point.elongation + offset], &response.energy);
                if counted {
                    totals.energy.damage -= undone;
                    dissipated -= undone;
                    totals.energy.integration += undone;
                }
                let (energy, stored) = (response.energy.damage, stored_by_mode(&response.energy));
                log_event(&mut totals.bond_events, pair, 1.0, position, energy, stored, true);
            } else if !begins {
                log_opening(&mut totals.opened, pair);
            }
            if SAMPLE && self.context.heats {
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
            let position = self.context.poses[a].position + normal * arm_a;
            let (energy, stored) = (response.energy.damage, stored_by_mode(&response.energy));
            log_event(&mut totals.bond_events, pair, damage, position, energy, stored, false);
        }
        if SAMPLE && self.context.heats {
            log_heat(&mut totals.dissipated, pair, dissipated);
        }
        let force = response.force;
        if SAMPLE && counted {
            totals.energy.stored_normal += response.energy.stored_normal;
            totals.energy.stored_shear += response.energy.stored_shear;
            totals.energy.stored_bending += response.energy.stored_bending;
            totals.energy.stored_twist += response.energy.stored_twist;
            totals.force_squared += force.norm_squared();
            if L::TRANSMITS_MOMENT {
                totals.moment_squared += response.moment.norm_squared();
            }
        }
        let mut wrenches = Wrenches::of(&normal, &force, [arm_a, arm_b]);
        if L::TRANSMITS_MOMENT {
            wrenches = wrenches.with_moment(&response.moment);
        }
        self.add_stress(i, &BranchVector { length: point.length, normal }, &wrenches);
        self.accumulate(i, slot, &Action { normal: &normal, wrenches: &wrenches, virial });
    }

    /// Add the forces and energies that a law computed in columns for contact `i` of the batch, which survives.
    ///
    /// Each part of the result is read where it is added, so that the parts need no registers before.
    #[inline(always)]
    pub(super) fn commit_batch_result(&mut self, i: usize, result: &impl ColumnResult) {
        let mut energy = self.totals.energy;
        self.add_energies(i, result, &mut energy);
        self.totals.energy = energy;
        let wrenches = result.wrenches();
        self.add_stress(i, &result.branch(), &wrenches);
        self.add_result(i, result, &wrenches);
    }

    /// As [`Self::commit_batch_result`] for contacts `i` to `i + 3` of the batch.
    #[inline(always)]
    pub(super) fn commit_four_results(&mut self, i: usize, results: &impl ColumnResults<L>) {
        // A copy, which stays in registers.
        let mut energy = self.totals.energy;
        for r in 0..4 {
            self.add_energies(i + r, &results.result(i + r), &mut energy);
        }
        self.totals.energy = energy;
        let wrenches = results.wrenches(i, self.lanes);
        if PERIODIC {
            let mut sums = [self.totals.virial, self.totals.crossing];
            for (i, wrenches) in (i..).zip(&wrenches) {
                self.add_stress_to(&mut sums, i, &results.result(i).branch(), wrenches);
            }
            [self.totals.virial, self.totals.crossing] = sums;
        }
        for (i, wrenches) in (i..).zip(&wrenches) {
            self.add_result(i, &results.result(i), wrenches);
        }
    }

    /// Add the energies of contact `i` of the batch to `energy`.
    #[inline(always)]
    fn add_energies(&self, i: usize, result: &impl ColumnResult, energy: &mut EnergySplit) {
        if self.pending[i].counted {
            if let Some(damage) = result.damage() {
                energy.damage += damage;
            }
            if let Some([viscous, integration]) = result.energy() {
                energy.viscous += viscous;
                energy.integration += integration;
            }
            if let Some(friction) = result.friction() {
                energy.friction += friction;
            }
        }
    }

    /// Add the forces of contact `i` of the batch.
    #[inline(always)]
    fn add_result(&mut self, i: usize, result: &impl ColumnResult, wrenches: &Wrenches) {
        let slot = self.pending[i].slot;
        let BranchVector { normal, .. } = result.branch();
        let virial = result.virial();
        debug_assert!(!SAMPLE && virial.is_some() == self.deforms());
        self.accumulate(i, slot, &Action { normal: &normal, wrenches, virial: virial.as_ref() });
    }

    /// Add the force of contact `i` of the batch to the sums of the stress in a periodic cell.
    #[inline(always)]
    fn add_stress(&mut self, i: usize, branch: &BranchVector, wrenches: &Wrenches) {
        let mut sums = [self.totals.virial, self.totals.crossing];
        self.add_stress_to(&mut sums, i, branch, wrenches);
        [self.totals.virial, self.totals.crossing] = sums;
    }

    /// As [`Self::add_stress`], to copies of `virial` and `crossing`, which stay in registers.
    #[inline(always)]
    fn add_stress_to(&self, [virial, crossing]: &mut [Mat3; 2], i: usize, branch: &BranchVector, wrenches: &Wrenches) {
        let PendingContact { contact, counted, .. } = self.pending[i];
        if PERIODIC && counted {
            let force = &wrenches.a.force;
            *virial += (branch.normal * branch.length) * force.transpose();
            let i = self.tile.flags[contact as usize].image;
            if i != [0, 0, 0] {
                *crossing += force * Vec3::new(f64::from(i[0]), f64::from(i[1]), f64::from(i[2])).transpose();
            }
        }
    }

    /// Add a contact to the totals and to its particles: directly if they lie in the tile, otherwise through its halo
    /// slot.
    #[inline(always)]
    fn accumulate(&mut self, i: usize, slot: u32, action: &Action<'_>) {
        let &Action { normal, wrenches, virial } = action;
        let force = &wrenches.a.force;
        let PendingContact { contact, pair, counted, .. } = self.pending[i];
        let totals = &mut self.totals;
        totals.active += u64::from(counted);
        if SAMPLE
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
    if status == Status::Broke {
        flags.bits |= ContactFlags::BROKEN;
        last
    } else {
        flags.bits &= !(ContactFlags::ACTIVE | ContactFlags::REPORTED);
        S::default()
    }
}

/// Energies stored in normal, shear, bending, and twist deformation, J.
#[inline(always)]
fn stored_by_mode(energy: &EnergySplit) -> [f64; 4] {
    [energy.stored_normal, energy.stored_shear, energy.stored_bending, energy.stored_twist]
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

/// Add a bond event to the log.
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
    broke: bool,
) {
    log.push(BondEvent { pair, broke, damage, position, energy, stored });
}
