//! From the parameter tables of a scenario to rows of a law: one line of registration per law.

use crate::schema::{self, ContactLawName, LawName};
use concordem_contact::law::{
    BeamModel, CohesiveBeam, ContactStiffness, Cpm, CpmParameters, Elastic, Frictional, HertzMindlin,
    LinearBond, Section,
};
use concordem_solver::PairCoefficients;
use concordem_solver::forces::{EvaluatedContacts, LawLoops};
use concordem_solver::state::contacts::ContactBlock;

use super::{AssemblyError, unfit};

/// How the rows of a law come from the tables of materials and interfaces.
trait FromTables: LawLoops {
    /// Table of the law in a scenario.
    type Table;
    /// The table of a material.
    fn of_material(material: &schema::Material) -> Option<&Self::Table>;
    /// The table of an interface.
    fn of_interface(interface: &schema::Interface) -> Option<&Self::Table>;
    /// The row of a contact whose sides have these tables.
    fn row(a: &Self::Table, b: &Self::Table) -> Result<Self, String>;
}

/// A block without contacts, and which of its rows serves which materials.
pub type BlockAndRows = (Box<dyn EvaluatedContacts>, PairCoefficients);

/// A block of law `law` without contacts, with all its rows, and which row serves which pairs of `materials`. Pairs of
/// which one has no table of the law get no row.
pub fn block(
    law: LawName,
    materials: &[schema::Material],
    interfaces: &[schema::Interface],
) -> Result<BlockAndRows, AssemblyError> {
    match law {
        LawName::Cpm => table::<Cpm>(materials, interfaces),
        LawName::LinearBond => table::<LinearBond>(materials, interfaces),
        LawName::CohesiveBeam => table::<CohesiveBeam>(materials, interfaces),
        LawName::Frictional => table::<Frictional>(materials, interfaces),
        LawName::HertzMindlin => table::<HertzMindlin>(materials, interfaces),
    }
}

/// Like [`block`], for contacts without a bond; nothing for [`ContactLawName::None`].
pub fn contact_block(
    law: ContactLawName,
    materials: &[schema::Material],
    interfaces: &[schema::Interface],
) -> Result<Option<BlockAndRows>, AssemblyError> {
    match law {
        ContactLawName::None => Ok(None),
        ContactLawName::LinearBond => {
            let (mut materials, mut interfaces) = (materials.to_vec(), interfaces.to_vec());
            after_linear_bond(&mut materials, &mut interfaces);
            table::<Frictional>(&materials, &interfaces).map(Some)
        }
        other => other.law().map(|law| block(law, materials, interfaces)).transpose(),
    }
}

fn table<L: FromTables>(
    materials: &[schema::Material],
    interfaces: &[schema::Interface],
) -> Result<BlockAndRows, AssemblyError> {
    let mut rows = Vec::new();
    let mut map = PairCoefficients::new(materials.len());
    for (i, a) in materials.iter().enumerate() {
        for (j, b) in materials.iter().enumerate().skip(i) {
            let interface = interfaces.iter().find(|interface| {
                let [x, y] = &interface.between;
                (x == &a.name && y == &b.name) || (x == &b.name && y == &a.name)
            });
            let between = interface.and_then(L::of_interface);
            let (Some(table_a), Some(table_b)) = (between.or(L::of_material(a)), between.or(L::of_material(b))) else {
                continue;
            };
            let row = L::row(table_a, table_b).map_err(|message| AssemblyError::Parameters {
                law: L::NAME,
                a: a.name.clone(),
                b: b.name.clone(),
                message,
            })?;
            // Every ordered pair has a row, so that 255 materials make 65025 of them.
            let most = usize::from(PairCoefficients::NONE);
            if rows.len() + if i == j { 1 } else { 2 } > most {
                let message = format!(
                    "the materials with parameters of \"{0}\" make more pairs than the {most} that contacts can tell apart; \
                     give `{0}` to at most 255 materials, or join those with the same parameters",
                    L::NAME
                );
                return Err(unfit("material", message));
            }
            map.set(i as u16, j as u16, rows.len() as u16);
            rows.push(row);
            if i != j {
                map.set(j as u16, i as u16, rows.len() as u16);
                rows.push(row.exchanged());
            }
        }
    }
    Ok((Box::new(ContactBlock::new(rows)), map))
}

impl FromTables for Cpm {
    type Table = schema::Cpm;
    fn of_material(material: &schema::Material) -> Option<&Self::Table> {
        material.cpm.as_ref()
    }
    fn of_interface(interface: &schema::Interface) -> Option<&Self::Table> {
        interface.cpm.as_ref()
    }
    fn row(a: &Self::Table, b: &Self::Table) -> Result<Self, String> {
        let parameters = |table: &schema::Cpm| {
            let optional = |value: Option<schema::Quantity<_>>| value.map_or(0.0, schema::Quantity::si);
            CpmParameters {
                mode: table.mode,
                damage_law: table.damage_law,
                omega_threshold: table.omega_threshold.si(),
                never_damage: table.never_damage,
                shear_contribution: table.shear_contribution.si(),
                soft_strain: optional(table.soft_strain),
                relative_soft_stiffness: optional(table.relative_soft_stiffness),
                isotropic_prestress: table.isotropic_prestress.si(),
                yield_surface: table.yield_surface.unwrap_or_default(),
                yield_log_speed: table.yield_log_speed.map_or(0.1, schema::Quantity::si),
                damage_time: table.damage_time.map_or(0.0, schema::Quantity::si),
                damage_rate_exponent: table.damage_rate_exponent.map_or(1.0, schema::Quantity::si),
                plastic_time: table.plasticity_time.map_or(0.0, schema::Quantity::si),
                plastic_rate_exponent: table.plasticity_rate_exponent.map_or(1.0, schema::Quantity::si),
                ..CpmParameters::new(
                    table.young.si(),
                    table.shear_ratio.si(),
                    table.cohesion.si(),
                    table.friction_angle.map_or_else(
                        || concordem_contact::math::atan2(table.friction_tangent(), 1.0),
                        schema::Quantity::si,
                    ),
                    table.crack_onset_strain.si(),
                    table.relative_ductility.si(),
                )
            }
        };
        let (a, b) = (parameters(a), parameters(b));
        // Averaging equal parameters could round; take them as they are.
        let mean = if a == b { a } else { a.average(&b).map_err(|error| error.to_string())? };
        Self::new(&mean).map_err(|error| error.to_string())
    }
}

impl FromTables for LinearBond {
    type Table = schema::LinearBond;
    fn of_material(material: &schema::Material) -> Option<&Self::Table> {
        material.linear_bond.as_ref()
    }
    fn of_interface(interface: &schema::Interface) -> Option<&Self::Table> {
        interface.linear_bond.as_ref()
    }
    fn row(a: &Self::Table, b: &Self::Table) -> Result<Self, String> {
        let mean = |of: fn(&Self::Table) -> f64| 0.5 * (of(a) + of(b));
        let strength = |value: Option<schema::Quantity<_>>| value.map_or(f64::INFINITY, schema::Quantity::si);
        let mut bond = Self::new(
            mean(|t| t.normal_stiffness.si()),
            mean(|t| t.shear_stiffness.si()),
            mean(|t| t.damping_ratio.si()),
            0.5 * (strength(a.normal_strength) + strength(b.normal_strength)),
            0.5 * (strength(a.shear_strength) + strength(b.shear_strength)),
        )
        .map_err(|error| error.to_string())?;
        bond.subtract_initial_gap = a.subtract_initial_gap && b.subtract_initial_gap;
        Ok(bond)
    }
}

impl FromTables for CohesiveBeam {
    type Table = schema::CohesiveBeam;
    fn of_material(material: &schema::Material) -> Option<&Self::Table> {
        material.cohesive_beam.as_ref()
    }
    fn of_interface(interface: &schema::Interface) -> Option<&Self::Table> {
        interface.cohesive_beam.as_ref()
    }
    fn row(a: &Self::Table, b: &Self::Table) -> Result<Self, String> {
        let mean = |of: fn(&Self::Table) -> f64| 0.5 * (of(a) + of(b));
        let section = match (a.radius_ratio, b.radius_ratio, a.radius, b.radius) {
            (Some(a), Some(b), _, _) => Section::Ratio(0.5 * (a.si() + b.si())),
            (_, _, Some(a), Some(b)) => Section::Radius(0.5 * (a.si() + b.si())),
            _ => {
                return Err("one material gives `radius_ratio`, the other `radius`; give both the same, or an \
                            [[interface]]"
                    .to_owned());
            }
        };
        if a.model != b.model || a.bending_term != b.bending_term {
            return Err("the materials have different `model` or `bending_term`; add an [[interface]]".to_owned());
        }
        let optional = |value: Option<schema::Quantity<_>>, or: f64| value.map_or(or, schema::Quantity::si);
        let model = match a.model {
            schema::BeamModel::EulerBernoulli => BeamModel::EulerBernoulli,
            schema::BeamModel::Timoshenko => BeamModel::Timoshenko {
                shear_coefficient: 0.5 * (optional(a.shear_coefficient, 0.9) + optional(b.shear_coefficient, 0.9)),
            },
            schema::BeamModel::DualSpring => {
                BeamModel::DualSpring { ratio: 0.5 * (optional(a.shear_ratio, 0.0) + optional(b.shear_ratio, 0.0)) }
            }
            schema::BeamModel::Spring => BeamModel::Spring,
        };
        let strength = |t: &Self::Table| t.tensile_strength.map_or(f64::INFINITY, schema::Quantity::si);
        let beam = Self {
            young: mean(|t| t.young.si()),
            poisson: mean(|t| t.poisson.si()),
            section,
            model,
            strength: 0.5 * (strength(a) + strength(b)),
            bending_term: a.bending_term,
        };
        beam.validate().map_err(|error| error.to_string())?;
        Ok(beam)
    }
}

impl FromTables for Frictional {
    type Table = schema::Frictional;
    fn of_material(material: &schema::Material) -> Option<&Self::Table> {
        material.frictional.as_ref()
    }
    fn of_interface(interface: &schema::Interface) -> Option<&Self::Table> {
        interface.frictional.as_ref()
    }
    fn row(a: &Self::Table, b: &Self::Table) -> Result<Self, String> {
        let mean = |x: f64, y: f64| 0.5 * (x + y);
        let stiffness = match (a.young, b.young, a.normal_stiffness, b.normal_stiffness) {
            (Some(young_a), Some(young_b), _, _) => ContactStiffness::Moduli {
                young_a: young_a.si(),
                young_b: young_b.si(),
                ratio: mean(
                    a.stiffness_ratio.map_or(0.0, schema::Quantity::si),
                    b.stiffness_ratio.map_or(0.0, schema::Quantity::si),
                ),
            },
            (_, _, Some(normal_a), Some(normal_b)) => ContactStiffness::Given {
                normal: mean(normal_a.si(), normal_b.si()),
                shear: mean(
                    a.shear_stiffness.map_or(0.0, schema::Quantity::si),
                    b.shear_stiffness.map_or(0.0, schema::Quantity::si),
                ),
            },
            _ => {
                return Err("one material gives `young`, the other `normal_stiffness`; give both the same, or an \
                            [[interface]]"
                    .to_owned());
            }
        };
        // The rougher surface does not matter when the smoother one slides first.
        let friction = a.friction_coefficient.si().min(b.friction_coefficient.si());
        Self::new(stiffness, friction, mean(a.damping_ratio.si(), b.damping_ratio.si()))
            .map_err(|error| error.to_string())
    }
}

impl FromTables for HertzMindlin {
    type Table = schema::HertzMindlin;
    fn of_material(material: &schema::Material) -> Option<&Self::Table> {
        material.hertz_mindlin.as_ref()
    }
    fn of_interface(interface: &schema::Interface) -> Option<&Self::Table> {
        interface.hertz_mindlin.as_ref()
    }
    fn row(a: &Self::Table, b: &Self::Table) -> Result<Self, String> {
        let elastic = |t: &Self::Table| Elastic { young: t.young.si(), poisson: t.poisson.si() };
        Self::new(
            elastic(a),
            elastic(b),
            a.friction_coefficient.si().min(b.friction_coefficient.si()),
            0.5 * (a.restitution.si() + b.restitution.si()),
        )
        .map_err(|error| error.to_string())
    }
}

/// Read every linear bond's table as that of the frictional contact of the same stiffness: what pairs without a bond do
/// under the law `linear_bond`.
fn after_linear_bond(materials: &mut [schema::Material], interfaces: &mut [schema::Interface]) {
    let convert = |table: &Option<schema::LinearBond>| {
        table.as_ref().map(|t| schema::Frictional {
            young: None,
            stiffness_ratio: None,
            normal_stiffness: Some(t.normal_stiffness),
            shear_stiffness: Some(t.shear_stiffness),
            friction_coefficient: t.friction_coefficient,
            damping_ratio: t.damping_ratio,
        })
    };
    for material in materials {
        material.frictional = convert(&material.linear_bond);
    }
    for interface in interfaces {
        interface.frictional = convert(&interface.linear_bond);
    }
}
