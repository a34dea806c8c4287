//! Energy ledger: the balance of work, kinetic and stored energy, and dissipation. Every term has a formula of its own; the
//! residual shows the error of the balance.

use super::step_sums::{DeformationSums, KickSums};
use concordem_contact::law::EnergySplit;

/// A compensated sum (Neumaier 1974).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sum {
    value: f64,
    correction: f64,
}

impl Sum {
    /// Add a term.
    pub fn add(&mut self, term: f64) {
        let total = self.value + term;
        self.correction +=
            if self.value.abs() >= term.abs() { (self.value - total) + term } else { (term - total) + self.value };
        self.value = total;
    }

    /// The sum so far.
    pub fn get(&self) -> f64 {
        self.value + self.correction
    }

    /// Value and correction, for checkpoints.
    pub fn parts(&self) -> [f64; 2] {
        [self.value, self.correction]
    }

    /// The sum with these [`parts`](Self::parts).
    pub fn from_parts(parts: [f64; 2]) -> Self {
        Self { value: parts[0], correction: parts[1] }
    }
}

/// The ledger at the time of the last force evaluation. All in J.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ledger {
    /// Whether the first step, which sets the initial energy, has been booked.
    pub started: bool,
    /// Kinetic plus stored energy at the start.
    pub initial: f64,
    /// Kinetic energy `Σ ½ m v⁻·v⁺ + ½ I ω⁻·ω⁺`, with the mean motion of a periodic cell.
    pub kinetic: f64,
    /// Stored in contacts: normal, shear, bending, twist.
    pub stored: [f64; 4],
    /// Stored in deformable particles.
    pub deformation: f64,
    /// Dissipated by damage and breaking.
    pub damage: Sum,
    /// Dissipated by plastic slip and friction.
    pub friction: Sum,
    /// Dissipated by dashpots.
    pub viscous: Sum,
    /// Integration error at kinks of laws.
    pub integration: Sum,
    /// Dissipated by artificial damping.
    pub numerical_damping: Sum,
    /// Work of prescribed motion, of walls, and of the cell's deformation.
    pub boundary_work: Sum,
    /// Work of gravity and external loads.
    pub external_work: Sum,
    /// Dissipated by the lag of the particles' strains behind the forces.
    pub deformation_lag: Sum,
    /// Lost (gained if negative) by forces that strain particles but do not depend on their strain.
    pub deformation_other: Sum,
    /// Work of the thermal expansion of bonds.
    pub expansion_work: Sum,
    /// Work of the change of stiffness with the temperature.
    pub stiffness_work: Sum,
    /// Work of the thermal expansion over the half step after the present instant.
    pending_expansion: f64,
    /// Numerical damping, boundary work, and external work over the half step after the present instant.
    pending: [f64; 3],
}

impl Ledger {
    /// Book one step: energies of the contacts, sums of the kick, energies of deformable particles, and work of cell and
    /// walls over the half steps before and after. The caller adds the work of loads and reactions on deformable particles
    /// to `kick` and `others`. `affine`: kinetic energy of the mean motion of a cell, J, which counts as work done before the first step.
    pub fn book(
        &mut self,
        contacts: &EnergySplit,
        kick: &KickSums,
        deformation: &DeformationSums,
        others: [f64; 2],
        affine: f64,
    ) {
        self.kinetic = kick.kinetic;
        self.stored = [contacts.stored_normal, contacts.stored_shear, contacts.stored_bending, contacts.stored_twist];
        self.deformation = deformation.stored;
        let before = [kick.damping[0], kick.boundary[0] + others[0], kick.external[0]];
        if self.started {
            self.damage.add(contacts.damage);
            self.friction.add(contacts.friction);
            self.viscous.add(contacts.viscous);
            self.integration.add(contacts.integration);
            self.deformation_lag.add(deformation.lag);
            self.deformation_other.add(deformation.other);
            for (sum, k) in
                [&mut self.numerical_damping, &mut self.boundary_work, &mut self.external_work].into_iter().zip(0..3)
            {
                sum.add(self.pending[k]);
                sum.add(before[k]);
            }
        } else {
            self.started = true;
            // Bonds that break at once held energy, too: a contact that follows takes a part of it back.
            self.damage.add(contacts.damage);
            self.initial = self.kinetic + self.stored.iter().sum::<f64>() + self.deformation + contacts.damage - affine;
            self.boundary_work.add(affine);
        }
        self.pending = [kick.damping[1], kick.boundary[1] + others[1], kick.external[1]];
    }

    /// Book the work of the thermal expansion over the half steps before and after the present instant, J. Call it before
    /// [`Self::book`].
    pub fn book_expansion(&mut self, [before, after]: [f64; 2]) {
        if self.started {
            self.expansion_work.add(self.pending_expansion);
            self.expansion_work.add(before);
        }
        self.pending_expansion = after;
    }

    /// Add work of prescribed motion over the half step after the present instant, J, which was not known when the step was booked.
    pub fn add_boundary_work(&mut self, work: f64) {
        self.pending[1] += work;
    }

    /// Book the work of the change of stiffness since the last step, J. Call it before [`Self::book`].
    pub fn book_stiffness(&mut self, work: f64) {
        if self.started {
            self.stiffness_work.add(work);
        }
    }

    /// Energy stored in contacts, J.
    pub fn stored_total(&self) -> f64 {
        self.stored.iter().sum()
    }

    /// Error of the balance, J: initial energy plus work, minus present and dissipated energy.
    pub fn residual(&self) -> f64 {
        let mut sum = Sum::default();
        for term in [
            self.initial,
            self.boundary_work.get(),
            self.external_work.get(),
            self.expansion_work.get(),
            self.stiffness_work.get(),
            -self.kinetic,
            -self.stored[0],
            -self.stored[1],
            -self.stored[2],
            -self.stored[3],
            -self.damage.get(),
            -self.friction.get(),
            -self.viscous.get(),
            -self.integration.get(),
            -self.numerical_damping.get(),
            -self.deformation,
            -self.deformation_lag.get(),
            -self.deformation_other.get(),
        ] {
            sum.add(term);
        }
        sum.get()
    }

    /// Energy without a source so far, J: errors of the integration ([`Self::integration`], [`Self::residual`]) and
    /// artificial damping that drives the motion. Negative if these have destroyed energy.
    ///
    /// Valid after a step that sampled the stored energies.
    pub fn created(&self) -> f64 {
        -self.integration.get() - self.residual() - self.numerical_damping.get().min(0.0)
    }

    /// All energy present or dissipated so far, J: the scale against which [`Self::created`] is judged.
    pub fn turnover(&self) -> f64 {
        // Under a prestress the stored energy can be negative.
        self.kinetic.abs()
            + self.stored_total().abs()
            + self.deformation
            + self.damage.get()
            + self.friction.get()
            + self.viscous.get()
            + self.numerical_damping.get().abs()
            + self.deformation_lag.get().abs()
            + self.deformation_other.get().abs()
    }

    /// The terms of deformable particles, for checkpoints.
    pub fn deformation_reals(&self) -> [f64; 5] {
        let ([a, b], [c, d]) = (self.deformation_lag.parts(), self.deformation_other.parts());
        [self.deformation, a, b, c, d]
    }

    /// Set the terms of [`Self::deformation_reals`].
    pub fn set_deformation(&mut self, [stored, a, b, c, d]: [f64; 5]) {
        self.deformation = stored;
        self.deformation_lag = Sum::from_parts([a, b]);
        self.deformation_other = Sum::from_parts([c, d]);
    }

    /// The terms of thermal expansion, for checkpoints.
    pub fn expansion_reals(&self) -> [f64; 3] {
        let [a, b] = self.expansion_work.parts();
        [a, b, self.pending_expansion]
    }

    /// Set the terms of [`Self::expansion_reals`].
    pub fn set_expansion(&mut self, [a, b, pending]: [f64; 3]) {
        self.expansion_work = Sum::from_parts([a, b]);
        self.pending_expansion = pending;
    }

    /// All other terms, for checkpoints.
    pub fn to_reals(&self) -> Vec<f64> {
        let mut reals = vec![f64::from(u8::from(self.started)), self.initial, self.kinetic];
        reals.extend(self.stored);
        for sum in [
            self.damage,
            self.friction,
            self.viscous,
            self.integration,
            self.numerical_damping,
            self.boundary_work,
            self.external_work,
        ] {
            reals.extend(sum.parts());
        }
        reals.extend(self.pending);
        reals
    }

    /// The ledger of [`Self::to_reals`]; `None` if the number of terms is wrong.
    pub fn from_reals(reals: &[f64]) -> Option<Self> {
        let reals: &[f64; 24] = reals.try_into().ok()?;
        let sum = |k: usize| Sum::from_parts([reals[7 + 2 * k], reals[8 + 2 * k]]);
        Some(Self {
            started: reals[0] != 0.0,
            initial: reals[1],
            kinetic: reals[2],
            stored: [reals[3], reals[4], reals[5], reals[6]],
            damage: sum(0),
            friction: sum(1),
            viscous: sum(2),
            integration: sum(3),
            numerical_damping: sum(4),
            boundary_work: sum(5),
            external_work: sum(6),
            pending: [reals[21], reals[22], reals[23]],
            ..Self::default()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Terms that vanish beside the sum come back when it is small again.
    #[test]
    fn sums_keep_small_terms() {
        let mut sum = Sum::default();
        for term in [1.0, 1e100, 1.0, -1e100] {
            sum.add(term);
        }
        assert_eq!(sum.get(), 2.0);
    }

    /// A ledger after two steps without contacts: kinetic energy and energy of strained particles (J) at both, and what damping
    /// dissipates between them.
    fn after(kinetic: [f64; 2], deformation: [f64; 2], damping: f64) -> Ledger {
        let mut ledger = Ledger::default();
        for step in 0..2 {
            // Half of it before the second instant, half after the first.
            let damping = if step == 0 { [0.0, 0.5 * damping] } else { [0.5 * damping, 0.0] };
            let kick = KickSums { kinetic: kinetic[step], damping, ..KickSums::default() };
            let sums = DeformationSums { stored: deformation[step], ..DeformationSums::default() };
            ledger.book(&EnergySplit::default(), &kick, &sums, [0.0; 2], 0.0);
        }
        ledger
    }

    /// Energy that damping takes has a sink, energy that it makes or that comes from nowhere has no source. All numbers are exact.
    #[test]
    fn energy_without_a_source_is_named() {
        for (kinetic, damping, residual, created) in [
            ([1.0, 0.5], 0.5, 0.0, 0.0),
            ([1.0, 1.5], -0.5, 0.0, 0.5),
            ([1.0, 1.5], 0.0, -0.5, 0.5),
            ([1.0, 0.75], 0.0, 0.25, -0.25),
        ] {
            let ledger = after(kinetic, [0.0; 2], damping);
            assert_eq!((ledger.residual(), ledger.created()), (residual, created), "{kinetic:?} {damping}");
        }
    }

    /// Particles that are strained at the start hold energy, which may become motion.
    #[test]
    fn strained_particles_hold_energy_from_the_start() {
        let ledger = after([0.0, 0.25], [0.25, 0.0], 0.0);
        assert_eq!((ledger.initial, ledger.residual(), ledger.turnover()), (0.25, 0.0, 0.25));
    }
}
