//! The model: integration scheme, damping, gravity, deformable particles, and particle-level failure.

use crate::schema::quantity::vector;
use crate::schema::{self, Scenario};
use concordem_contact::kinematics::deformable::{Condition, Deformable, Update};
use concordem_contact::law::LawTable;
use concordem_solver::fracture::virial::HydrostaticStrength;
use concordem_solver::integrate::Damping;
use concordem_solver::{Model, Scheme};

/// The model of a scenario, without pair coefficients.
pub(super) fn build(scenario: &Scenario) -> Model {
    Model {
        mode: scenario.kinematics,
        scheme: match scenario.integration.scheme {
            schema::Scheme::Leapfrog => Scheme::Leapfrog,
            schema::Scheme::VelocityVerlet => Scheme::VelocityVerlet,
        },
        damping: damping(&scenario.integration.damping),
        gravity: vector(&scenario.integration.gravity),
        damage_threshold: scenario.output.events_damage.si(),
        hydrostatic_strength: hydrostatic_strength(scenario),
        deformable: deformable(scenario),
        watch_contacts: !scenario.integration.allow_unstable,
        ..Model::default()
    }
}

fn damping(damping: &schema::Damping) -> Damping {
    let (translation, rotation) = damping.coefficients();
    match damping {
        schema::Damping::None => Damping::None,
        schema::Damping::Local { .. } => Damping::Local { translation, rotation },
        schema::Damping::Nonviscous { .. } => Damping::NonViscous { translation, rotation },
        schema::Damping::TchamwaWielgosz { phi, form } => match form {
            schema::DampingForm::TchamwaWielgosz => Damping::TchamwaWielgosz { phi: phi.si() },
            schema::DampingForm::PositionTerm => Damping::position_term(phi.si()),
        },
    }
}

/// Deformation of particles, if any material is deformable.
pub fn deformable(scenario: &Scenario) -> Option<Deformable> {
    scenario.materials.iter().find(|m| m.deformable.is_some())?;
    let options = scenario.deformable.clone().unwrap_or_default();
    let or = |value: Option<schema::Quantity<_>>, default: f64| value.map_or(default, schema::Quantity::si);
    Some(Deformable {
        elasticity: scenario.materials.iter().map(schema::Material::elasticity).collect(),
        condition: options.condition.unwrap_or(if scenario.dimension == 2 {
            Condition::PlaneStrain
        } else {
            Condition::Solid
        }),
        update: match options.update {
            schema::DeformableUpdate::Lagged => Update::Lagged,
            schema::DeformableUpdate::Iterated => Update::Iterated {
                tolerance: or(options.tolerance, 1e-10),
                maximum: options.maximum_iterations.unwrap_or(200),
                relaxation: or(options.relaxation, 1.0),
            },
        },
        dashpots: options.dashpots,
    })
}

/// Mean stress at which particle-level failure breaks all bonds of a particle, if the law of the bonds has such a strength.
fn hydrostatic_strength(scenario: &Scenario) -> HydrostaticStrength {
    let law = scenario.bonds.as_ref().map(|bonds| bonds.law);
    let threshold = |m: &schema::Material| {
        let table = law.and_then(|law| m.table_of(law));
        table.and_then(LawTable::hydrostatic_strength).unwrap_or(f64::INFINITY)
    };
    let thresholds = scenario.materials.iter().map(threshold).collect();
    HydrostaticStrength { thresholds, planar: scenario.dimension == 2 }
}
