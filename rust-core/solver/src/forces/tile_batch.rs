//! The batch of a tile's contacts, as measures and laws see it: what they read of a contact, and what they store.

use bytemuck::Pod;
use concordem_contact::columns::{BATCH, Item, Lanes};
use concordem_contact::kinematics::deformable::ParticleVirial;
use concordem_contact::kinematics::sphere_sphere::{ImageShift, Motion};
use concordem_contact::kinematics::{MotionSink, MotionSource, PointKinematics, Pose, PreviousGeometry};
use concordem_contact::law::{
    Batch, ColumnResult, ColumnResults, ContactGeometry, ContactLaw, Kinematics, Reference, Response, Status,
};
use concordem_contact::math::{Quat, Symmetric, Vec3};

use super::motion_of;
use super::tile::{PendingContact, TileEvaluator};
use crate::state::contacts::{ContactFlags, Pair};
use crate::state::table::Rows;

impl<L: ContactLaw, T: Lanes, const PERIODIC: bool, const SAMPLE: bool, const DEFORM: bool, const SIZE: usize>
    TileEvaluator<'_, L, T, PERIODIC, SAMPLE, DEFORM, SIZE>
{
    /// The contacts of a batch of columns.
    #[inline(always)]
    fn listed(&self) -> [u32; BATCH] {
        let mut contacts = [0; BATCH];
        for (contact, pending) in contacts.iter_mut().zip(&self.pending) {
            *contact = pending.contact;
        }
        contacts
    }

    /// Read the rows of the first `count` contacts.
    #[inline(always)]
    fn read<R: Item + Pod>(&self, rows: &Rows<'_, R>, count: usize, arrays: &mut R::Arrays) {
        match self.full {
            Some(full) => rows.read_run(full.first, arrays),
            None => rows.read(&self.listed()[..count], arrays),
        }
    }

    /// Rotations of two particles in the step, where their poses contain orientations: in scenes with beams. A separate function,
    /// or else the compiler would select the address of each number for every contact.
    #[cold]
    #[inline(never)]
    fn rotations_in_step(&self, Pair { a, b }: Pair) -> [Quat; 2] {
        [a, b].map(|p| self.context.particles.rotation_increment[p as usize])
    }

    /// How far the surfaces of a contact's particles had moved towards each other one step ago, m.
    #[inline(always)]
    fn surface_approach_before(&self, contact: u32) -> f64 {
        let before = |p: u32| self.context.surface_displacement_before(p as usize);
        let Pair { a, b } = self.tile.pair[contact as usize];
        (before(a) + before(b)).quadratic(&self.tile.previous.get(contact as usize).normal)
    }

    /// Evaluate contact `i` again, because it ends in this step and its response then also depends on the elongation
    /// one step ago. `approach`: how far the surfaces have moved towards each other, m.
    #[cold]
    #[inline(never)]
    fn evaluate_again(&mut self, i: usize, kinematics: L::Kinematics, approach: f64) {
        let contact = self.pending[i].contact;
        let deformed = kinematics.with_surface_displacement(approach, self.surface_approach_before(contact));
        let response = self.law(i).respond(&deformed, &self.history(i), self.context.dt);
        self.commit(i, deformed.point(), &response);
    }
}

impl<L: ContactLaw, T: Lanes, const PERIODIC: bool, const SAMPLE: bool, const DEFORM: bool, const SIZE: usize>
    MotionSource for TileEvaluator<'_, L, T, PERIODIC, SAMPLE, DEFORM, SIZE>
{
    const PERIODIC: bool = PERIODIC;
    const DEFORM: bool = DEFORM;

    #[inline(always)]
    fn lanes(&self) -> impl Lanes {
        self.lanes
    }

    #[inline(always)]
    fn poses(&self, i: usize) -> [&Pose; 2] {
        let Pair { a, b } = self.pending[i].pair;
        [&self.context.poses[a as usize], &self.context.poses[b as usize]]
    }

    #[inline(always)]
    fn has_rotations(&self) -> bool {
        self.context.oriented
    }

    #[inline(always)]
    fn may_cross_border(&self) -> bool {
        self.full.is_none_or(|full| full.any.image != [0; 3])
    }

    #[inline(always)]
    fn all_bonded(&self) -> bool {
        self.full.is_some_and(|full| full.all.has(ContactFlags::BONDED))
    }

    #[inline(always)]
    fn rotations(&self, i: usize) -> Option<[Quat; 2]> {
        self.context.oriented.then(|| self.rotations_in_step(self.pending[i].pair))
    }

    #[inline(always)]
    fn shift(&self, i: usize) -> Option<Vec3> {
        let k = self.pending[i].contact as usize;
        (self.tile.flags[k].image != [0; 3]).then(|| self.image(k).displacement)
    }

    #[inline(always)]
    fn motions(&self, i: usize) -> ([Motion; 2], ImageShift) {
        let PendingContact { contact, pair: Pair { a, b }, .. } = self.pending[i];
        let k = contact as usize;
        let particles = self.context.particles;
        ([motion_of(particles, a as usize), motion_of(particles, b as usize)], self.image(k))
    }

    #[inline(always)]
    fn velocities(&self, i: usize) -> ([&Vec3; 2], [&Vec3; 2]) {
        let (Pair { a, b }, particles) = (self.pending[i].pair, self.context.particles);
        let (velocity, spin) = (&particles.velocity, &particles.angular_velocity);
        ([&velocity[a as usize], &velocity[b as usize]], [&spin[a as usize], &spin[b as usize]])
    }

    #[inline(always)]
    fn ends(&self, i: usize) -> ([Vec3; 2], [Quat; 2], Vec3) {
        let PendingContact { contact, pair: Pair { a, b }, .. } = self.pending[i];
        let k = contact as usize;
        debug_assert!(self.context.oriented);
        let both = [&self.context.poses[a as usize], &self.context.poses[b as usize]];
        (both.map(|pose| pose.position), both.map(|pose| pose.rotation), self.image(k).displacement)
    }

    #[inline(always)]
    fn constants(&self, i: usize) -> (ContactGeometry, PreviousGeometry, bool) {
        let Pair { a, b } = self.pending[i].pair;
        let [radius_a, radius_b] = [a, b].map(|p| self.context.poses[p as usize].radius);
        let ([mass_a, mass_b], k) = (self.masses(i), self.pending[i].contact as usize);
        let Reference { length: reference_length, area } = self.tile.reference.get(k);
        let geometry = ContactGeometry { reference_length, area, radius_a, radius_b, mass_a, mass_b };
        (geometry, self.previous(i), self.bonded(i))
    }

    #[inline(always)]
    fn bonded(&self, i: usize) -> bool {
        self.tile.flags[self.pending[i].contact as usize].has(ContactFlags::BONDED)
    }

    #[inline(always)]
    fn read_references(&self, count: usize, arrays: &mut <Reference as Item>::Arrays) {
        self.read(&self.tile.reference, count, arrays);
    }

    #[inline(always)]
    fn previous(&self, i: usize) -> PreviousGeometry {
        self.tile.previous.get(self.pending[i].contact as usize)
    }

    #[inline(always)]
    fn read_previous(&self, count: usize, arrays: &mut <PreviousGeometry as Item>::Arrays) {
        self.read(&self.tile.previous, count, arrays);
    }

    #[inline(always)]
    fn masses(&self, i: usize) -> [f64; 2] {
        let Pair { a, b } = self.pending[i].pair;
        [a, b].map(|p| self.context.particles.mass[p as usize])
    }

    #[inline(always)]
    fn read_masses(&self, count: usize, [of_a, of_b]: [&mut [f64; BATCH]; 2]) {
        let mass = &self.context.particles.mass[..];
        for ((a, b), pending) in of_a.iter_mut().zip(of_b).zip(&self.pending[..count]) {
            (*a, *b) = (mass[pending.pair.a as usize], mass[pending.pair.b as usize]);
        }
    }

    #[inline(always)]
    fn surface_displacement(&self, i: usize) -> Symmetric {
        let Pair { a, b } = self.pending[i].pair;
        self.context.surface_displacement[a as usize].0 + self.context.surface_displacement[b as usize].0
    }
}

impl<L: ContactLaw, T: Lanes, const PERIODIC: bool, const SAMPLE: bool, const DEFORM: bool, const SIZE: usize>
    MotionSink<L::Kinematics> for TileEvaluator<'_, L, T, PERIODIC, SAMPLE, DEFORM, SIZE>
{
    #[inline(always)]
    fn evaluate(&mut self, i: usize, kinematics: &L::Kinematics) {
        if SAMPLE
            && L::VARIES
            && let Some(softened) = self.context.softening
        {
            self.evaluate_softened(i, kinematics, &softened);
            return;
        }
        let (law, history) = (self.law(i), self.history(i));
        if !self.deforms() {
            let response = law.respond(kinematics, &history, self.context.dt);
            self.commit(i, kinematics.point(), &response);
            return;
        }
        let PendingContact { contact, begins, .. } = self.pending[i];
        let now = self.surface_displacement(i).quadratic(&kinematics.point().normal);
        // The approach one step ago costs memory traffic, so it stays NaN for surviving contacts of laws that do not
        // read it.
        let reads_before = L::READS_OLD_ELONGATION || begins;
        let before = if reads_before { self.surface_approach_before(contact) } else { f64::NAN };
        let deformed = kinematics.with_surface_displacement(now, before);
        let response = law.respond(&deformed, &history, self.context.dt);
        if !reads_before && response.status != Status::Lives {
            self.evaluate_again(i, *kinematics, now);
            return;
        }
        self.commit(i, deformed.point(), &response);
    }
}

impl<L: ContactLaw, T: Lanes, const PERIODIC: bool, const SAMPLE: bool, const DEFORM: bool, const SIZE: usize> Batch<L>
    for TileEvaluator<'_, L, T, PERIODIC, SAMPLE, DEFORM, SIZE>
{
    const SAMPLE: bool = SAMPLE;

    #[inline(always)]
    fn history(&self, i: usize) -> L::State {
        self.tile.history.get(self.pending[i].contact as usize)
    }

    #[inline(always)]
    fn read_histories(&self, count: usize, arrays: &mut <L::State as Item>::Arrays) {
        self.read(&self.tile.history, count, arrays);
    }

    #[inline(always)]
    fn law(&self, i: usize) -> &L {
        &self.rows[self.tile.flags[self.pending[i].contact as usize].row as usize]
    }

    #[inline(always)]
    fn alike(&self, count: usize) -> bool {
        let row = |pending: &PendingContact| self.tile.flags[pending.contact as usize].row;
        if let Some(full) = self.full {
            return full.all.row == full.any.row;
        }
        self.rows.len() == 1 || self.pending[..count].iter().all(|pending| row(pending) == row(&self.pending[0]))
    }

    #[inline(always)]
    fn inherits(&self, i: usize) -> bool {
        let PendingContact { contact, begins, .. } = self.pending[i];
        begins && self.tile.flags[contact as usize].has(ContactFlags::KEPT_REFERENCE)
    }

    #[inline(always)]
    fn may_inherit(&self) -> bool {
        self.full.is_none()
    }

    #[inline(always)]
    fn damage_threshold(&self) -> f64 {
        self.context.damage_threshold
    }

    #[inline(always)]
    fn reports(&self, i: usize, state: &L::State) -> bool {
        let flags = &self.tile.flags[self.pending[i].contact as usize];
        L::damage(state) >= self.context.damage_threshold && !flags.has(ContactFlags::REPORTED)
    }

    #[inline(always)]
    fn dashpots_strain(&self) -> bool {
        self.context.dashpots_strain
    }

    #[inline(always)]
    fn commit(&mut self, i: usize, point: &PointKinematics, response: &Response<L::State>) {
        if self.deforms() {
            let viscous = L::viscous_force(&point.normal, &response.state);
            let virial = ParticleVirial::of(&point.normal, &response.force, &viscous, self.context.dashpots_strain);
            self.commit_response(i, point, response, Some(&virial));
        } else {
            self.commit_response(i, point, response, None);
        }
    }

    #[inline(always)]
    fn store_geometries(&mut self, count: usize, arrays: &<PreviousGeometry as Item>::Arrays) {
        match self.full {
            Some(full) => self.tile.previous.write_run(full.first, arrays, 0),
            None => self.tile.previous.write(&self.listed()[..count], arrays),
        }
    }

    #[inline(always)]
    fn store_histories(&mut self, count: usize, arrays: &<L::State as Item>::Arrays, unchanged: usize) {
        match self.full {
            Some(full) => self.tile.history.write_run(full.first, arrays, unchanged),
            // Also the unchanged numbers: few batches have gaps.
            None => self.tile.history.write(&self.listed()[..count], arrays),
        }
    }

    #[inline(always)]
    fn commit_result(&mut self, i: usize, result: &impl ColumnResult) {
        self.commit_batch_result(i, result);
    }

    #[inline(always)]
    fn commit_four(&mut self, i: usize, results: &impl ColumnResults<L>) {
        self.commit_four_results(i, results);
    }
}
