//! A batch of contacts: read into columns, measured and evaluated, then committed.
//!
//! Contacts with equal parameters, under a law with a straight form, go through columns ([`ContactColumns::apply`]); those of which
//! the straight form is not certain are stepped one by one. Of other contacts the columns only measure the motion, and the law
//! responds to each.

use bytemuck::Pod;
use concordem_contact::columns::{Arrays as _, BATCH, Item, Lanes, all_plus_zero, places};
use concordem_contact::kinematics::{Kinematics, MotionMeasure, Pose};
use concordem_contact::law::{ContactLaw, Masses, Status};
use concordem_contact::math::{Quat, Symmetric, Vec3};
use concordem_contact::step::{Contact, How, Stepped, step};
use concordem_contact::straight::{ContactColumns, Run};

use super::kinds::LoopKind;
use super::tile::{PendingContact, TileEvaluator};
use crate::state::Particles;
use crate::state::contacts::{ContactFlags, Pair};
use crate::state::table::Rows;

impl<L: ContactLaw, K: LoopKind, T: Lanes> TileEvaluator<'_, L, K, T> {
    /// Whether this loop may evaluate the law in columns. A straight form knows no energies that only samples need, and no elongations
    /// one step ago of particles that deform.
    const STRAIGHT: bool = L::COLUMNS.is_some() && !K::SAMPLE && !(K::DEFORM && L::READS_OLD_ELONGATION);

    /// Evaluate the first `count` contacts of the batch, each once and in ascending order.
    #[inline(always)]
    pub(super) fn evaluate(&mut self, measure: MotionMeasure, count: usize, columns: &mut ContactColumns<L>) {
        let count = count.min(BATCH);
        if count == 0 {
            return;
        }
        if Self::STRAIGHT {
            let law = *self.law(&self.pending[0]);
            if law.is_straight(measure) && self.alike(count) {
                self.evaluate_in_columns(&law, measure, count, columns);
                return;
            }
        }
        let in_columns = match measure {
            MotionMeasure::Finite => !K::YADE,
            MotionMeasure::Yade | MotionMeasure::YadeRatcheting => K::YADE,
            MotionMeasure::FirstOrder => false,
        };
        if in_columns && L::Kinematics::IS_POINT {
            self.evaluate_measured(measure, count, columns);
        } else {
            for i in 0..count {
                self.evaluate_one(self.pending[i], measure);
            }
        }
    }

    /// Evaluate contacts with equal parameters by the straight form of their law.
    #[inline(always)]
    fn evaluate_in_columns(&mut self, law: &L, measure: MotionMeasure, count: usize, columns: &mut ContactColumns<L>) {
        let reads = ContactColumns::<L>::USE;
        self.read_motion(count, columns);
        self.read(&self.tile.history, count, &mut columns.history);
        let reduced = reads.optional > 0 && !law.uses_optional_part() && all_plus_zero(columns.optional_reals(), count);
        self.read(&self.tile.reference, count, &mut columns.reference);
        self.read_bonded(count, &mut columns.bonded);
        if reads.masses == Masses::Read || reads.masses == Masses::WithOptionalPart && !reduced {
            self.read_masses(count, &mut columns.masses);
        }
        if K::DEFORM {
            for i in 0..count {
                columns.surface_displacement.set(i, self.surface_displacement(&self.pending[i]));
            }
        }
        if K::SCATTERED {
            for (strength, pending) in columns.strength.iter_mut().zip(&self.pending[..count]) {
                *strength = self.tile.strength[pending.contact as usize];
            }
        }
        // Each choice calls with constants: a loop for each.
        let run = Run {
            measure: MotionMeasure::Finite,
            reduced: false,
            deforms: K::DEFORM,
            dashpots_strain: K::DEFORM && self.context.dashpots_strain,
            scattered: K::SCATTERED,
            dt: self.context.dt,
        };
        let unchanged = if reduced { reads.optional } else { 0 };
        if !K::YADE && reduced {
            let run = Run { reduced: true, ..run };
            columns.look_ahead(law, count, run);
            columns.apply(law, run);
        } else if !K::YADE {
            columns.look_ahead(law, count, run);
            columns.apply(law, run);
        } else if measure == MotionMeasure::Yade {
            columns.apply(law, Run { measure: MotionMeasure::Yade, ..run });
        } else {
            columns.apply(law, Run { measure: MotionMeasure::YadeRatcheting, ..run });
        }
        self.commit_columns(measure, count, columns, unchanged);
    }

    /// Measure contacts in columns, and let the law respond to each.
    #[inline(always)]
    fn evaluate_measured(&mut self, measure: MotionMeasure, count: usize, columns: &mut ContactColumns<L>) {
        self.read_motion(count, columns);
        self.read(&self.tile.reference, count, &mut columns.reference);
        self.read_bonded(count, &mut columns.bonded);
        self.read_masses(count, &mut columns.masses);
        let (dt, ratcheting) = (self.context.dt, measure == MotionMeasure::YadeRatcheting);
        match (K::YADE, ratcheting) {
            (false, _) => columns.measure(MotionMeasure::Finite, dt),
            (true, false) => columns.measure(MotionMeasure::Yade, dt),
            (true, true) => columns.measure(MotionMeasure::YadeRatcheting, dt),
        }
        for i in 0..count {
            let measured = if K::YADE { MotionMeasure::Yade } else { MotionMeasure::Finite };
            if let Some(kinematics) = L::Kinematics::of_point(&columns.motion(i, measured)) {
                self.respond(self.pending[i], &kinematics);
            }
        }
    }

    /// Let the law respond to the motion of a contact, and commit the response.
    #[inline(always)]
    fn respond(&mut self, contact: PendingContact, kinematics: &L::Kinematics) {
        if (K::SAMPLE || K::SCATTERED)
            && L::VARIES
            && let Some(factors) = self.context.factors
        {
            self.evaluate_with_factors(contact, kinematics, &factors);
            return;
        }
        let (law, history) = (self.law(&contact), self.tile.history.get(contact.contact as usize));
        let how = How::new(self.context.mode, self.context.dt);
        if !self.deforms() {
            let stepped = Stepped::of(law, *kinematics, &history, &how);
            self.commit(contact, &stepped);
            return;
        }
        let now = self.surface_displacement(&contact).quadratic(&kinematics.point().normal);
        // The approach one step ago costs memory traffic, so it stays NaN for surviving contacts of laws that do not read it.
        let reads_before = L::READS_OLD_ELONGATION || contact.begins;
        let before = if reads_before { self.surface_approach_before(&contact) } else { f64::NAN };
        let stepped = Stepped::of(law, kinematics.with_surface_displacement(now, before), &history, &how);
        if !reads_before && stepped.response.status != Status::Lives {
            // The response of a contact that ends also depends on the elongation one step ago.
            self.evaluate_one_again(contact, self.context.mode);
            return;
        }
        self.commit(contact, &stepped);
    }

    /// Evaluate one contact.
    #[inline(always)]
    pub(super) fn evaluate_one(&mut self, contact: PendingContact, measure: MotionMeasure) {
        let k = contact.contact as usize;
        let (motions, image) = (self.context.motions(contact.pair), self.image(k));
        let ends = self.context.ends(contact.pair, &motions, &image, self.deforms());
        let before = self.contact(k);
        if (K::SAMPLE || K::SCATTERED)
            && L::VARIES
            && let Some(factors) = self.context.factors
        {
            let kinematics = ends.measure(&before, measure, self.context.dt);
            self.evaluate_with_factors(contact, &kinematics, &factors);
            return;
        }
        let stepped = step(self.law(&contact), &before, &ends, &How::new(measure, self.context.dt));
        self.commit(contact, &stepped);
    }

    /// [`Self::evaluate_one`], of a contact that columns or a first response leave. Cold and not inlined, because few contacts need it.
    #[cold]
    #[inline(never)]
    pub(super) fn evaluate_one_again(&mut self, contact: PendingContact, measure: MotionMeasure) {
        self.evaluate_one(contact, measure);
    }

    /// Contact `k` at the end of the previous step.
    #[inline(always)]
    pub(super) fn contact(&self, k: usize) -> Contact<L::State> {
        let Self { tile, .. } = self;
        Contact {
            bonded: tile.flags[k].has(ContactFlags::BONDED),
            reference: tile.reference.get(k),
            previous: tile.previous.get(k),
            history: tile.history.get(k),
        }
    }

    /// The law with the parameters of a contact.
    #[inline(always)]
    pub(super) fn law(&self, contact: &PendingContact) -> &L {
        &self.rows[self.tile.flags[contact.contact as usize].row as usize]
    }

    /// Whether the first `count` contacts have equal parameters.
    #[inline(always)]
    fn alike(&self, count: usize) -> bool {
        let row = |pending: &PendingContact| self.tile.flags[pending.contact as usize].row;
        if let Some(full) = self.full {
            return full.all.row == full.any.row;
        }
        self.rows.len() == 1 || self.pending[..count].iter().all(|pending| row(pending) == row(&self.pending[0]))
    }

    /// Whether a contact begins with the energy of a bond that broke before.
    #[inline(always)]
    pub(super) fn inherits(&self, contact: &PendingContact) -> bool {
        contact.begins && self.tile.flags[contact.contact as usize].has(ContactFlags::KEPT_REFERENCE)
    }

    /// Places of the contacts of the batch in the tile.
    #[inline(always)]
    pub(super) fn listed(&self) -> [u32; BATCH] {
        let mut contacts = [0; BATCH];
        for (contact, pending) in contacts.iter_mut().zip(&self.pending) {
            *contact = pending.contact;
        }
        contacts
    }

    /// Read the rows of the first `count` contacts; as all methods that read, it fills a group of four places to its end.
    #[inline(always)]
    fn read<R: Item + Pod>(&self, rows: &Rows<'_, R>, count: usize, arrays: &mut R::Arrays) {
        match self.full {
            Some(full) => rows.read_run(full.first, arrays),
            None => rows.read(&self.listed()[..count], arrays),
        }
    }

    /// Read the motion of the first `count` contacts.
    #[inline(always)]
    fn read_motion(&self, count: usize, columns: &mut ContactColumns<L>) {
        // A measure of orientations does not depend on the previous step.
        if !L::Kinematics::READS_ORIENTATIONS {
            self.read(&self.tile.previous, count, &mut columns.poses.previous);
        }
        if K::YADE {
            self.read_velocities(count, columns);
            return;
        }
        let poses = &mut columns.poses;
        for i in (0..count).step_by(4) {
            let [a, b] = self.four_poses(places(i, count));
            poses.a.set_four(i, a, self.lanes);
            poses.b.set_four(i, b, self.lanes);
        }
        if K::PERIODIC {
            poses.shift = bytemuck::Zeroable::zeroed();
            if self.full.is_none_or(|full| full.any.image != [0; 3]) {
                for i in 0..count {
                    let k = self.pending[i].contact as usize;
                    if self.tile.flags[k].image != [0; 3] {
                        poses.shift.set(i, self.image(k).displacement);
                    }
                }
            }
        }
        if !L::Kinematics::READS_ORIENTATIONS && self.context.oriented {
            for i in 0..count {
                let [a, b] = self.rotations_in_step(self.pending[i].pair);
                poses.a.rotation.set(i, a);
                poses.b.rotation.set(i, b);
            }
        }
    }

    /// Read positions, radii, and velocities, for YADE's measures.
    #[inline(always)]
    fn read_velocities(&self, count: usize, columns: &mut ContactColumns<L>) {
        let (poses, velocities, lanes) = (&mut columns.poses, &mut columns.velocities, self.lanes);
        let particles = self.context.particles;
        for i in (0..count).step_by(4) {
            let places = places(i, count);
            let [[a, b, c, d], on_b] = self.four_poses(places);
            poses.a.position.set_four(i, [&a.position, &b.position, &c.position, &d.position], lanes);
            for (k, pose) in (i..).zip([a, b, c, d]) {
                poses.a.radius[k] = pose.radius;
            }
            let [a, b, c, d] = on_b;
            poses.b.position.set_four(i, [&a.position, &b.position, &c.position, &d.position], lanes);
            for (k, pose) in (i..).zip([a, b, c, d]) {
                poses.b.radius[k] = pose.radius;
            }
            let [p, q, r, s] = places;
            let pair = |place: usize| self.pending[place].pair;
            let (a, b) = ([pair(p).a, pair(q).a, pair(r).a, pair(s).a], [pair(p).b, pair(q).b, pair(r).b, pair(s).b]);
            let Particles { velocity, angular_velocity, .. } = particles;
            velocities.velocity_a.set_four(i, of_four(velocity, a), lanes);
            velocities.velocity_b.set_four(i, of_four(velocity, b), lanes);
            velocities.angular_velocity_a.set_four(i, of_four(angular_velocity, a), lanes);
            velocities.angular_velocity_b.set_four(i, of_four(angular_velocity, b), lanes);
        }
    }

    /// Poses of A, and those of B, of four contacts. (`map` of an array would not be inlined.)
    #[inline(always)]
    fn four_poses(&self, [i, j, k, l]: [usize; 4]) -> [[&Pose; 4]; 2] {
        let poses = |i: usize| {
            let Pair { a, b } = self.pending[i].pair;
            [&self.context.poses[a as usize], &self.context.poses[b as usize]]
        };
        let [[ai, bi], [aj, bj], [ak, bk], [al, bl]] = [poses(i), poses(j), poses(k), poses(l)];
        [[ai, aj, ak, al], [bi, bj, bk, bl]]
    }

    /// Write 1 for a bond, else 0.
    #[inline(always)]
    fn read_bonded(&self, count: usize, column: &mut [f64; BATCH]) {
        if let Some(full) = self.full
            && full.all.has(ContactFlags::BONDED) == full.any.has(ContactFlags::BONDED)
        {
            *column = [f64::from(u8::from(full.all.has(ContactFlags::BONDED))); BATCH];
            return;
        }
        for (bonded, pending) in column.iter_mut().zip(&self.pending[..count]) {
            *bonded = f64::from(u8::from(self.tile.flags[pending.contact as usize].has(ContactFlags::BONDED)));
        }
    }

    /// Read the masses of the first `count` contacts.
    #[inline(always)]
    fn read_masses(&self, count: usize, [of_a, of_b]: &mut [[f64; BATCH]; 2]) {
        let mass = &self.context.particles.mass[..];
        for ((a, b), pending) in of_a.iter_mut().zip(of_b).zip(&self.pending[..count]) {
            (*a, *b) = (mass[pending.pair.a as usize], mass[pending.pair.b as usize]);
        }
    }

    /// Rotations of two particles in the step, where their poses contain orientations: in scenes with beams. A separate function,
    /// or else the compiler would select the address of each number for every contact.
    #[cold]
    #[inline(never)]
    fn rotations_in_step(&self, Pair { a, b }: Pair) -> [Quat; 2] {
        [a, b].map(|p| self.context.particles.rotation_increment[p as usize])
    }

    /// Sum of the surface displacements of a contact's particles, m.
    #[inline(always)]
    fn surface_displacement(&self, contact: &PendingContact) -> Symmetric {
        let Pair { a, b } = contact.pair;
        self.context.surface_displacement[a as usize].0 + self.context.surface_displacement[b as usize].0
    }

    /// How far the surfaces of a contact's particles had moved towards each other one step ago, m.
    #[inline(always)]
    fn surface_approach_before(&self, contact: &PendingContact) -> f64 {
        let before = |p: u32| self.context.surface_displacement_before(p as usize);
        let Pair { a, b } = contact.pair;
        (before(a) + before(b)).quadratic(&self.tile.previous.get(contact.contact as usize).normal)
    }
}

/// Four rows. (Neither a closure nor `map` would be inlined.)
#[inline(always)]
fn of_four(rows: &[Vec3], [a, b, c, d]: [u32; 4]) -> [&Vec3; 4] {
    [&rows[a as usize], &rows[b as usize], &rows[c as usize], &rows[d as usize]]
}
