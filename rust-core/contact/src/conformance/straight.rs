//! The straight form of a law against its response, bit for bit.

use super::{Finding, Host, LawState, MotionMeasure, PointKinematics, SEEDS, STEPS, Subject, drive};
use crate::law::{ColumnUse, ContactLaw, EnergySplit, Given, Masses, Reference, Response, Status};

/// What a straight form returns for a step; `None` if the law has none under this measure.
pub(super) fn outcome<L: ContactLaw<Kinematics = PointKinematics>>(
    law: &L,
    measure: MotionMeasure,
    kinematics: &PointKinematics,
    old: &L::State,
    dt: f64,
) -> Option<Outcome<L::State>> {
    let uses = L::COLUMNS.filter(|_| law.is_straight(measure))?;
    let reals = old.as_reals();
    let optional = &reals[reals.len() - uses.optional..];
    let reduced = uses.optional > 0 && !law.uses_optional_part() && optional.iter().all(|x| x.to_bits() == 0);
    let mut given = Given { measure, reduced, ahead: [f64::NAN; 2] };
    let mut motion = *kinematics;
    if uses.masses == Masses::Unread || uses.masses == Masses::WithOptionalPart && reduced {
        (motion.geometry.mass_a, motion.geometry.mass_b) = (f64::NAN, f64::NAN);
    }
    if L::LOOKS_AHEAD {
        let reference = Reference { length: motion.geometry.reference_length, area: motion.geometry.area };
        let argument = L::argument_ahead(old, &law.straight(&motion, old, &given, dt).0.state);
        if !argument.is_nan() {
            given.ahead = [argument, law.value_ahead(reference, argument)];
        }
    }
    let (mut response, certain) = law.straight(&motion, old, &given, dt);
    let energy = &mut response.energy;
    let kept = [
        (uses.damage, &mut energy.damage),
        (uses.friction, &mut energy.friction),
        (uses.viscous, &mut energy.viscous),
        (uses.integration, &mut energy.integration),
    ];
    for (kept, energy) in kept {
        if !kept {
            *energy = 0.0;
        }
    }
    response.state = stored(&uses, reduced, old, &response.state);
    Some(Outcome { response, certain })
}

/// The history that the solver stores.
fn stored<S: LawState>(uses: &ColumnUse, reduced: bool, old: &S, new: &S) -> S {
    if !uses.history {
        return *old;
    }
    let mut state = *new;
    if reduced {
        let (reals, kept) = (bytemuck::cast_slice_mut::<S, f64>(core::slice::from_mut(&mut state)), old.as_reals());
        let first = kept.len() - uses.optional;
        reals[first..].copy_from_slice(&kept[first..]);
    }
    state
}

/// What the solver does with a contact in columns.
pub struct Outcome<S> {
    response: Response<S>,
    certain: bool,
}

pub(super) fn straight<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    let (mut different, mut certain, mut all) = (0_u32, 0_u32, 0_u32);
    for measure in [MotionMeasure::Finite, MotionMeasure::Yade, MotionMeasure::YadeRatcheting] {
        for window in [&subject.elastic, &subject.inelastic] {
            for seed in 0..SEEDS {
                let path = subject.moving_path(&subject.closed_path(window, true, seed, STEPS), seed);
                for record in drive(subject, measure, &path) {
                    let Some(found) = subject.host.straight(measure, &record.kinematics, &record.old, subject.dt)
                    else {
                        continue;
                    };
                    all += 1;
                    if found.certain {
                        certain += 1;
                        different += u32::from(!same(&found.response, &record.response));
                    }
                }
            }
        }
    }
    if all == 0 {
        return;
    }
    findings.push(Finding::at_most(
        "straight form: certain steps that differ from the response in any bit",
        f64::from(different),
        0.0,
        "columns give the bits of contacts one by one",
    ));
    findings.push(Finding::at_least(
        "straight form: certain steps",
        f64::from(certain) / f64::from(all),
        0.1,
        "a form that is rarely certain saves no time",
    ));
}

/// Whether all that the solver uses of two responses has the same bits.
fn same<S: LawState>(a: &Response<S>, b: &Response<S>) -> bool {
    let bits = |r: &Response<S>| -> Vec<u64> {
        let EnergySplit { damage, friction, viscous, integration, .. } = r.energy;
        // A zero of either sign adds nothing to a sum.
        let energies = [damage, friction, viscous, integration].map(|x| x + 0.0);
        r.force.iter().chain(&r.moment).chain(r.state.as_reals()).copied().chain(energies).map(f64::to_bits).collect()
    };
    b.status == Status::Lives && bits(a) == bits(b)
}
