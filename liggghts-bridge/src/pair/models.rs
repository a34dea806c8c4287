//! The models `concordem/...`, their properties, and their laws.

use concordem_contact::kinematics::MotionMeasure;
use concordem_contact::law::restitution::{End, damping_of_restitution};
use concordem_contact::law::{ContactStiffness, Elastic, Frictional, HertzMindlin, ParameterError};
use concordem_solver::PairCoefficients;

use super::{PairLaw, PairLaws};
use crate::host_laws::{HostContact, HostLaw, HostModel, HostShear};

/// Properties from `fix property/global`: one value per type, or per pair of types in row-major order.
pub struct Properties<'a> {
    /// Number of types.
    pub types: usize,
    /// Young's modulus per type, Pa.
    pub young: &'a [f64],
    /// Poisson's ratio per type.
    pub poisson: &'a [f64],
    /// Coefficient of restitution per pair.
    pub restitution: &'a [f64],
    /// Coefficient of friction per pair.
    pub friction: &'a [f64],
    /// `kn`, `kt`, `gamman`, `gammat` per pair.
    pub stiffness: [&'a [f64]; 4],
    /// Characteristic velocity, m/s.
    pub velocity: f64,
}

/// Properties that a model reads, as bits of [`Model::properties`].
pub mod property {
    /// Young's modulus and Poisson's ratio.
    pub const ELASTIC: u32 = 1;
    /// Coefficient of restitution.
    pub const RESTITUTION: u32 = 2;
    /// Stiffnesses `kn`, `kt`.
    pub const STIFFNESS: u32 = 4;
    /// Damping `gamman`, `gammat`.
    pub const DAMPING: u32 = 8;
    /// Characteristic velocity.
    pub const VELOCITY: u32 = 16;
}

/// A normal model of `pair_style gran`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    /// Name in the script.
    pub name: &'static std::ffi::CStr,
    /// Number in LIGGGHTS' model hash, 13 to 63 (LIGGGHTS uses the lower numbers). Restart files contain it, so it must not change.
    pub number: i32,
    /// Bits of [`property`]. Every model also reads the coefficient of friction; LIGGGHTS' models only with a tangential model.
    pub properties: u32,
    /// Whether the force is proportional to overlap^1.5 instead of to the overlap.
    pub hertzian: bool,
    /// Whether it is a ConcorDEM law, which includes the shear force, instead of a LIGGGHTS model.
    pub is_law: bool,
}

/// All models; [`law`] creates the law of each.
pub const MODELS: [Model; 6] = {
    use property::{DAMPING, ELASTIC, RESTITUTION, STIFFNESS, VELOCITY};
    const fn liggghts(name: &'static std::ffi::CStr, number: i32, properties: u32, hertzian: bool) -> Model {
        Model { name, number, properties, hertzian, is_law: false }
    }
    const fn concordem(name: &'static std::ffi::CStr, number: i32, properties: u32, hertzian: bool) -> Model {
        Model { name, number, properties, hertzian, is_law: true }
    }
    [
        liggghts(c"concordem/hertz", 58, ELASTIC | RESTITUTION, true),
        liggghts(c"concordem/hertz/stiffness", 59, STIFFNESS | DAMPING, true),
        liggghts(c"concordem/hooke", 60, ELASTIC | RESTITUTION | VELOCITY, false),
        liggghts(c"concordem/hooke/stiffness", 61, STIFFNESS | DAMPING, false),
        concordem(c"concordem/hertz_mindlin", 62, ELASTIC | RESTITUTION, true),
        concordem(c"concordem/frictional", 63, STIFFNESS | RESTITUTION, false),
    ]
};

fn pair_laws<L: HostLaw, const FRAMED: bool>(
    types: usize,
    row: impl Fn(usize, usize) -> Result<L, ParameterError>,
) -> Result<Box<dyn PairLaw>, ParameterError> {
    let mut map = PairCoefficients::new(types);
    let mut all = Vec::with_capacity(types * types);
    for a in 0..types {
        for b in 0..types {
            map.set(a as u16, b as u16, all.len() as u16);
            all.push(row(a, b)?);
        }
    }
    Ok(Box::new(PairLaws::<L, FRAMED>::new(all, map, MotionMeasure::Finite)))
}

/// The law of model `model` (index in [`MODELS`]). `shear` applies to LIGGGHTS' models.
///
/// # Errors
/// Invalid parameters, or no such model.
pub fn law(model: usize, shear: HostShear, p: &Properties<'_>) -> Result<Box<dyn PairLaw>, ParameterError> {
    let n = p.types;
    let at = |values: &[f64], a: usize, b: usize| values[a * n + b];
    let effective = |a: usize, b: usize| {
        let bulk = |k: usize| (1.0 - p.poisson[k] * p.poisson[k]) / p.young[k];
        let shear = |k: usize| 2.0 * (2.0 - p.poisson[k]) * (1.0 + p.poisson[k]) / p.young[k];
        (1.0 / (bulk(a) + bulk(b)), 1.0 / (shear(a) + shear(b)))
    };
    let host = |model: HostModel, a, b| Ok(HostContact { model, shear, friction: at(p.friction, a, b) });
    match model {
        0 => pair_laws::<_, false>(n, |a, b| {
            let (young, shear) = effective(a, b);
            host(HostModel::hertz(young, shear, at(p.restitution, a, b)), a, b)
        }),
        1 | 3 => pair_laws::<_, false>(n, |a, b| {
            let [normal, shear, normal_damping, shear_damping] = p.stiffness.map(|values| at(values, a, b));
            let hertz = model == 1;
            host(HostModel::Stiffness { hertz, normal, shear, normal_damping, shear_damping }, a, b)
        }),
        2 => pair_laws::<_, false>(n, |a, b| {
            let log_restitution = at(p.restitution, a, b).ln();
            host(HostModel::Hooke { young: effective(a, b).0, log_restitution, velocity: p.velocity }, a, b)
        }),
        4 => pair_laws::<_, true>(n, |a, b| {
            let elastic = |k: usize| Elastic { young: p.young[k], poisson: p.poisson[k] };
            HertzMindlin::new(elastic(a), elastic(b), at(p.friction, a, b), at(p.restitution, a, b))
        }),
        5 => pair_laws::<_, true>(n, |a, b| {
            let stiffness =
                ContactStiffness::Given { normal: at(p.stiffness[0], a, b), shear: at(p.stiffness[1], a, b) };
            let damping = damping_of_restitution(at(p.restitution, a, b), End::ForceSpent);
            Frictional::new(stiffness, at(p.friction, a, b), damping)
        }),
        _ => Err(ParameterError::OutOfRange {
            law: "of pairs",
            parameter: "model",
            value: model as f64,
            requirement: "a model known to both library and plugin; rebuild both",
        }),
    }
}
