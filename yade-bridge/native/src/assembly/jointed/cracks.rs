//! Cracks of a step, and contacts that end in it. The law tells them in the histories; here they get their places, and the contacts end.

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::math::Vec3;
use concordem_solver::state::Particles;
use concordem_solver::state::contacts::{ContactBlock, ContactFlags, Pair};

use super::super::Assembly;
use super::law::{EVENT, JointedFriction, JointedFrictionState, event};

/// In what a bond cracked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CrackKind {
    /// Tension: 1 in YADE's record.
    Tension = 1,
    /// Shear: 2 in YADE's record.
    Shear = 2,
}

/// A crack, with what YADE writes to its record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crack {
    /// Steps of the assembly before that of the crack.
    pub step: u64,
    /// Ids of the bodies, the smaller one first.
    pub ids: [u32; 2],
    /// In what.
    pub kind: CrackKind,
    /// Contact point, m.
    pub point: Vec3,
    /// Normal from the first body to the second.
    pub normal: Vec3,
    /// Mean radius, m.
    pub size: f64,
    /// Energy that the bond had stored before the step, J.
    pub energy: f64,
    /// `crossSection`, m².
    pub area: f64,
}

/// What has happened to bonds.
#[derive(Debug, Clone, Default)]
pub struct Happenings {
    /// Cracks, in the order of the steps and of the bodies.
    pub cracks: Vec<Crack>,
    /// Ids of the bodies of bonds that began.
    pub begun: Vec<[u32; 2]>,
}

impl Crack {
    /// Of a contact with this history and geometry, in step `step`.
    fn of(
        step: u64,
        pair: Pair,
        history: &JointedFrictionState,
        last: &PreviousGeometry,
        particles: &Particles,
    ) -> Self {
        let mut sides = [pair.a, pair.b].map(|p| p as usize);
        let mut normal = last.normal;
        if particles.id[sides[0]] > particles.id[sides[1]] {
            sides.reverse();
            normal = -normal;
        }
        let [one, two] = sides.map(|p| particles.radius[p]);
        let overlap = one + two - last.length;
        let in_tension = history.event as u8 & event::TENSION != 0;
        Self {
            step,
            ids: sides.map(|p| particles.id[p]),
            kind: if in_tension { CrackKind::Tension } else { CrackKind::Shear },
            point: particles.position[sides[0]] + normal * (one - 0.5 * overlap),
            normal,
            size: 0.5 * (one + two),
            energy: history.crack_energy,
            area: history.cross_section,
        }
    }
}

impl Assembly {
    /// Note cracks and bonds that began in the last step, and end the contacts that the law has ended; returns the number of cracks.
    pub(in super::super) fn note_cracks(&mut self) -> usize {
        let contacts = self.state.contacts.as_mut().map(|block| block.contacts_mut().as_any_mut());
        let Some(block) = contacts.and_then(|any| any.downcast_mut::<ContactBlock<JointedFriction>>()) else {
            return 0;
        };
        let events = block.history.column(EVENT).iter().enumerate();
        let found: Vec<usize> = events.filter(|(_, event)| **event != 0.0).map(|(k, _)| k).collect();
        let step = self.state.clock.step.saturating_sub(1);
        let (particles, first) = (&self.state.particles, self.happenings.cracks.len());
        for k in found {
            let (history, pair) = (block.history.get(k), block.pair[k]);
            let happened = |kinds: u8| history.event as u8 & kinds != 0;
            let ends = [pair.a, pair.b].map(|p| p as usize);
            let cracked = happened(event::TENSION | event::SHEAR);
            if happened(event::BOND) {
                self.happenings.begun.push(ends.map(|p| particles.id[p]));
            }
            if cracked {
                self.happenings.cracks.push(Crack::of(step, pair, &history, &block.previous.get(k), particles));
            }
            if cracked || happened(event::END) {
                for p in ends {
                    let counts = if cracked { &mut self.losses } else { &mut self.openings };
                    counts[p] += 1;
                }
            }
            if happened(event::END) {
                block.history.set(k, JointedFrictionState::default());
                block.flags[k].bits &= !(ContactFlags::ACTIVE | ContactFlags::REPORTED);
            } else {
                block.history.set(k, JointedFrictionState { event: 0.0, ..history });
            }
        }
        let cracks = &mut self.happenings.cracks[first..];
        cracks.sort_by_key(|crack| crack.ids);
        cracks.len()
    }
}
