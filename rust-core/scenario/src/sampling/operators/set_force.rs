//! Force and moment on a set of particles: `F = Σ f`, `M = Σ ((x_p − x_0) × f + r × f + m)` over the contacts and walls that act
//! on the particles of the set from outside it, with `r` from the center `x_p` of the particle to the point of contact.
//!
//! Forces inside the set cancel. The reaction is the force of the support, grip, or plate that prescribes the motion of the set;
//! it is zero along degrees of freedom that are free.
//!
//! Page: [Load a set](../how-to/load-a-set.md)

use crate::sampling::definition::{
    OperatorDefinition, PARTICLES, RegionRule, Row, SampleKey, SampledQuantity, Sampling, vector,
};
use crate::sampling::state::SampledState;
use concordem_contact::math::Vec3;
use concordem_operator::OperatorError;

const QUANTITIES: &[SampledQuantity] = &[
    vector("force", "N", "Force on the set from other particles and walls"),
    vector("moment", "N m", "Moment of these forces about the point `about`, else the mean position of the set"),
    vector("reaction", "N", "Force with which the prescribed motion acts on the set, without inertia"),
    vector("reaction_moment", "N m", "Moment of the reactions about the same point"),
    PARTICLES,
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "set-force",
    meaning: "Force and moment on a set of particles from outside it, and the reaction of its prescribed motion.",
    quantities: QUANTITIES,
    region: RegionRule::Set,
    keys: &[SampleKey::Set, SampleKey::About],
    evaluate,
    ..OperatorDefinition::PLAIN
};

/// Force (N) and moment about a point (N·m).
#[derive(Default)]
struct Wrench {
    force: Vec3,
    moment: Vec3,
}

impl Wrench {
    /// Adds a force (N) at `arm` (m) from the point, and a moment (N·m).
    fn add(&mut self, arm: &Vec3, force: &Vec3, moment: &Vec3) {
        self.force += force;
        self.moment += arm.cross(force) + moment;
    }
}

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let state = sampling.state;
    let members = sampling.sample.sets.first().ok_or(OperatorError::EmptyRegion { what: "set" })?;
    let mut member = vec![false; state.particles.len()];
    for &p in members {
        member[p as usize] = true;
    }
    let is_member = |p: u32| member[p as usize];
    let about = sampling.sample.about.unwrap_or_else(|| SampledState::mean_over(members, |p| state.unwrapped(p)));
    let arm = |p: u32| state.unwrapped(p) - about;
    let mut outside = Wrench::default();
    for k in 0..sampling.contacts.len() {
        let contact = sampling.contacts.get(k);
        let [a, b] = sampling.contacts.pair()[k];
        match [is_member(a), is_member(b)] {
            [true, false] => outside.add(&(arm(a) + contact.arm_a), &contact.force, &contact.moment),
            [false, true] => outside.add(&(arm(b) + contact.arm_b), &-contact.force, &-contact.moment),
            _ => {}
        }
    }
    let walls = &state.forces.walls;
    for k in (0..walls.particle.len()).filter(|&k| is_member(walls.particle[k])) {
        let p = walls.particle[k];
        let lever = arm(p) + walls.point[k] - state.particles.position[p as usize];
        outside.add(&lever, &walls.force[k], &walls.moment[k]);
    }
    let mut reaction = Wrench::default();
    for r in state.reactions(&sampling.contacts).iter().filter(|r| is_member(r.particle)) {
        reaction.add(&arm(r.particle), &r.force, &r.moment);
    }
    row.vector(&outside.force).vector(&outside.moment).vector(&reaction.force).vector(&reaction.moment);
    row.scalars([members.len() as f64]);
    Ok(())
}
