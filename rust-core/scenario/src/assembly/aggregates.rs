//! Aggregates and pores of a scenario: their places, and the particles inside.

use std::path::Path;
use std::sync::Arc;

use super::place::solid;
use super::placed::Placed;
use super::stl::Named;
use super::{AssemblyError, Progress, material_index};
use crate::schema::{self, AggregateGroup, AggregateShape, Problem, Scenario, Surface};
use concordem_contact::math::{Mat3, Vec3};
use concordem_packing::aggregates::{
    Field, Form, Inclusion, MeshForm, Placement, Polyhedron, Region, Request, place, sizes,
};
use concordem_packing::{PackingError, Random, Shape};
use concordem_solver::state::{Cell, Sphere};

/// Aggregates and pores in their places.
pub(super) struct Places<'a> {
    table: &'a schema::Aggregates,
    field: Field,
}

/// The phases of an assembled scenario, for reports.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Phases {
    /// Groups of aggregates and pores, in the order of the scenario.
    pub groups: Vec<Phase>,
    /// Particles outside of all aggregates, and their share of the volume of all particles before pores removed some.
    pub matrix: (usize, f64),
}

/// One group of aggregates or pores.
#[derive(Debug, Clone, PartialEq)]
pub struct Phase {
    /// Name of its material, or "pores".
    pub name: String,
    /// Number of aggregates.
    pub count: usize,
    /// Their volume divided by that of the specimen (areas in two dimensions).
    pub volume_fraction: f64,
    /// Number of particles inside.
    pub particles: usize,
    /// Share of the volume of all particles that these have.
    pub share: f64,
    /// Number of aggregates without any particle.
    pub empty: usize,
}

/// Which aggregate each of some spheres belongs to, from 1; 0 for none.
#[derive(Default)]
pub(super) struct Division {
    /// Number of the aggregate (or fiber), from 1; 0 for the matrix. Empty if there are neither.
    pub(super) number: Vec<u32>,
    /// Material of the group of each aggregate (or fiber); `None` for pores, and for given aggregates.
    pub(super) material: Vec<Option<u16>>,
    /// Materials of the other spheres; the first one where the list ends.
    pub(super) of_matrix: Vec<u16>,
}

/// Places the aggregates of a scenario; `None` if it has none.
pub(super) fn build<'a>(
    scenario: &'a Scenario,
    folder: &Path,
    placed: &Placed,
    progress: Progress<'_>,
) -> Result<Option<Places<'a>>, AssemblyError> {
    let Some(table) = &scenario.aggregates else { return Ok(None) };
    progress("aggregates", 0.0);
    let region = region(scenario, table.surface, folder, placed)?;
    let dimension = if region.is_planar() { 2 } else { 3 };
    let mut random = Random::new(table.seed);
    let (mut requests, mut fixed) = (Vec::new(), Vec::new());
    for (group, one) in table.groups.iter().enumerate() {
        if let Some(spheres) = &one.spheres {
            fixed.extend(spheres.iter().map(|s| Inclusion {
                form: Form::Sphere,
                size: 2.0 * s[3].si(),
                center: Vec3::new(s[0].si(), s[1].si(), s[2].si()),
                rotation: Mat3::identity(),
                group,
            }));
            continue;
        }
        // The checks of the scenario guarantee a grading.
        let Some(curve) = one.curve() else { continue };
        let (grading, share) = curve?;
        if let Some(step) = one.first_step {
            let sizes = sizes::ascending(&grading, step.si())?;
            requests.extend(sizes.into_iter().map(|size| Request { form: Form::Sphere, size, group }));
            continue;
        }
        let Some(fraction) = table.fraction(one) else { continue };
        let key = format!("aggregates.group[{group}].shape.path");
        let mut form = forms(one.shape.as_ref(), &key, folder, &mut random)?;
        let bodies = sizes::descending(&grading, fraction? * share * region.volume(), dimension, &mut form)?;
        requests.extend(bodies.into_iter().map(|(form, size)| Request { form, size, group }));
    }
    let placement = Placement {
        clearance: table.clearance.si(),
        gap: table.gap.si(),
        wall_gap: table.wall_gap.si(),
        attempts: table.attempts,
    };
    let field = place(region, requests, &fixed, &placement, &mut random).map_err(|error| match error {
        PackingError::NoPlace { .. } => super::unfit(
            "aggregates",
            format!(
                "{error}. Give a smaller volume fraction, smaller clearance and gaps, more attempts, or another seed; in a mould, \
                 aggregates must be small compared to the specimen"
            ),
        ),
        other => other.into(),
    })?;
    Ok(Some(Places { table, field }))
}

/// The region of aggregates and fibers: the periodic cell, the shape of the packing, or the box around its spheres.
pub(super) fn region(
    scenario: &Scenario,
    surface: Option<Surface>,
    folder: &Path,
    placed: &Placed,
) -> Result<Region, AssemblyError> {
    let planar = scenario.dimension == 2 || matches!(scenario.packing, schema::Packing::RandomDiscs { .. });
    if let Some(cell) = &placed.packing.cell {
        return Ok(Region::periodic(Vec3::zeros(), cell, planar)?);
    }
    let shape = if let Some(shape) = scenario.packing.shape() {
        solid(shape, folder)?.0
    } else {
        let spheres = &placed.packing.spheres;
        let ends =
            |sphere: &Sphere| (sphere.position.add_scalar(-sphere.radius), sphere.position.add_scalar(sphere.radius));
        let around = spheres.iter().map(ends).reduce(|(low, high), (a, b)| (low.inf(&a), high.sup(&b)));
        let (low, high) = around.ok_or(PackingError::Empty)?;
        Shape::new_box(low, high)?
    };
    if surface == Some(Surface::Sawn) {
        let (low, high) = shape.bounds();
        return Ok(Region::periodic(low, &Cell::new(Mat3::from_diagonal(&(high - low))), planar)?);
    }
    Ok(Region::mould(shape, planar)?)
}

/// A source of bodies of one shape.
fn forms<'a>(
    shape: Option<&AggregateShape>,
    key: &str,
    folder: &Path,
    random: &'a mut Random,
) -> Result<impl FnMut() -> Form + use<'a>, AssemblyError> {
    enum Source {
        Same(Form),
        Random(usize, f64, f64),
    }
    let source = match shape {
        None | Some(AggregateShape::Sphere {}) => Source::Same(Form::Sphere),
        Some(AggregateShape::Ellipsoid { elongation, flatness }) => {
            Source::Same(Form::Ellipsoid { elongation: elongation.si(), flatness: flatness.si() })
        }
        Some(AggregateShape::Polyhedron { corners, elongation, flatness }) => {
            Source::Random(*corners as usize, elongation.si(), flatness.si())
        }
        Some(AggregateShape::Mesh { path }) => {
            let mesh = Named { folder, path, unit: 1.0, key }.closed()?;
            Source::Same(Form::Mesh(Arc::new(MeshForm::new(&mesh)?)))
        }
    };
    // The first polyhedron shows whether the numbers make sense.
    if let Source::Random(corners, elongation, flatness) = source {
        Polyhedron::random(corners, elongation, flatness, &mut random.clone())?;
    }
    Ok(move || match &source {
        Source::Same(form) => form.clone(),
        Source::Random(corners, elongation, flatness) => {
            let body = Polyhedron::random(*corners, *elongation, *flatness, random);
            body.map_or(Form::Sphere, |body| Form::Polyhedron(Arc::new(body)))
        }
    })
}

impl Places<'_> {
    /// The aggregates and pores in their region.
    pub(super) fn field(&self) -> &Field {
        &self.field
    }

    /// Finds the aggregate of every sphere, and removes the spheres in pores.
    pub(super) fn divide(&self, scenario: &Scenario, spheres: &mut Vec<Sphere>) -> (Division, Phases) {
        let groups = &self.table.groups;
        let bodies = self.field.inclusions();
        let planar = self.field.region().is_planar();
        let depths: Vec<f64> = groups.iter().map(|group| group.depth.si()).collect();
        let measure = |sphere: &Sphere| if planar { sphere.radius.powi(2) } else { sphere.radius.powi(3) };
        let mut filled = vec![0_usize; bodies.len()];
        let mut shares = vec![0.0; groups.len()];
        let (mut matrix, mut total) = ((0, 0.0), 0.0);
        let mut number = Vec::with_capacity(spheres.len());
        spheres.retain(|sphere| {
            let found = self.field.at(&sphere.position, &|group| depths[group] * sphere.radius);
            total += measure(sphere);
            match found {
                None => {
                    matrix.0 += 1;
                    matrix.1 += measure(sphere);
                }
                Some(body) => {
                    filled[body] += 1;
                    shares[bodies[body].group] += measure(sphere);
                    if groups[bodies[body].group].remove_particles {
                        return false;
                    }
                }
            }
            number.push(found.map_or(0, |body| body as u32 + 1));
            true
        });
        let volume = self.field.region().volume();
        let phase = |(k, group): (usize, &AggregateGroup)| {
            let own = || bodies.iter().zip(&filled).filter(move |(body, _)| body.group == k);
            Phase {
                name: group.title().to_owned(),
                count: own().count(),
                volume_fraction: own().map(|(body, _)| body.measure(planar)).sum::<f64>() / volume,
                particles: own().map(|(_, count)| count).sum(),
                share: shares[k] / total,
                empty: own().filter(|(_, count)| **count == 0).count(),
            }
        };
        let phases =
            Phases { groups: groups.iter().enumerate().map(phase).collect(), matrix: (matrix.0, matrix.1 / total) };
        let material_of = |group: &AggregateGroup| group.material.as_deref().map(|name| material_index(scenario, name));
        let material = bodies.iter().map(|body| material_of(&groups[body.group])).collect();
        (Division { number, material, of_matrix: Vec::new() }, phases)
    }
}

/// The given materials and aggregates of the spheres that remain of a packing; `None` if the scenario gives none.
pub(super) fn given(
    scenario: &Scenario,
    packed: &[Sphere],
    remains: &dyn Fn(&Sphere) -> bool,
) -> Result<Option<Division>, AssemblyError> {
    let Some(table) = &scenario.phases else { return Ok(None) };
    let (given, count) = (table.materials.len(), packed.len());
    if given != count {
        let message = format!("{given} materials are given for {count} spheres; give one per sphere of the packing");
        return Err(super::unfit("phases.materials", message));
    }
    let numbers = table.aggregates.iter().copied().chain(std::iter::repeat(0));
    let rows = packed.iter().zip(&table.materials).zip(numbers).filter(|((sphere, _), _)| remains(sphere));
    let (of_matrix, number): (Vec<u16>, Vec<u32>) = rows.map(|((_, &material), number)| (material, number)).unzip();
    // The last number counts, so that those of fibers come after it; spheres have their materials from the list.
    let last = number.iter().copied().max().unwrap_or(0) as usize;
    Ok(Some(Division { number, material: vec![None; last], of_matrix }))
}

impl Phases {
    /// Warnings about aggregates without particles.
    pub(super) fn doubtful(&self, scenario: &Scenario) -> Vec<Problem> {
        let warn = |(at, phase): (usize, &Phase)| {
            let help = "use smaller particles, or a larger smallest size";
            let message = match (phase.empty, phase.count) {
                (0, _) => return None,
                (empty, count) if empty == count => "no particle is inside of these aggregates or pores".to_owned(),
                (empty, count) => format!("{empty} of the {count} aggregates or pores contain no particle"),
            };
            Some(scenario.warning(&format!("aggregates.group[{at}]"), message, help))
        };
        self.groups.iter().enumerate().filter_map(warn).collect()
    }
}

/// The interfaces of a scenario, with those between two aggregates of one material that it does not give: they are as between the
/// material and the mortar (Stránský 2018, program of chapter 8).
pub(super) fn interfaces(scenario: &Scenario) -> Vec<schema::Interface> {
    let mut all = scenario.interfaces.clone();
    let mortar = &scenario.materials[0].name;
    for name in scenario.materials_of_aggregates() {
        if all.iter().any(|one| one.joins(name, name)) {
            continue;
        }
        if let Some(around) = scenario.interfaces.iter().find(|one| one.joins(mortar, name)) {
            all.push(schema::Interface { between: [name.to_owned(), name.to_owned()], ..around.clone() });
        }
    }
    all
}

/// Numbers of bonds: within the mortar, within aggregates, between mortar and aggregate, and between two aggregates.
pub(super) fn count_bonds(pairs: impl Iterator<Item = [u32; 2]>) -> [usize; 4] {
    let mut counts = [0; 4];
    for [a, b] in pairs {
        counts[match (a, b) {
            (0, 0) => 0,
            (a, b) if a == b => 1,
            (0, _) | (_, 0) => 2,
            _ => 3,
        }] += 1;
    }
    counts
}
