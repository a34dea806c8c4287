//! `concordem measure`: evaluates operators on the final state of a run.

use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::OnceLock;

use super::recording::{UNBONDED, WALLS};
use super::so_far::open_result;
use super::{Console, Failure};
use crate::output::{OutputError, ResultFile};
use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::stress::{ParticleVolume, Partition};
use concordem_operator::tessellation::Mesh;
use concordem_operator::{OperatorError, Truncation};
use concordem_scenario::assembly::{apply_loads, samples};
use concordem_scenario::sampling::{Bonds, Operator, SampledQuantity, SampledState, ScheduledOperator, rigid_links};
use concordem_scenario::schema::quantity::{Area, StrainRate, Velocity, Volume, vector};
use concordem_scenario::schema::{self as scenario, SampleRegion, Scenario};
use concordem_solver::record::{ContactForces, Forces};
use concordem_solver::state::columns::{ColumnData, StoredColumn};
use concordem_solver::state::{Cell, Constraint, Particles, Sphere};

/// Arguments of `concordem measure`.
#[derive(Debug, clap::Args)]
pub(super) struct MeasureArguments {
    /// Result file
    file: PathBuf,
    #[arg(long, value_name = "NAME", value_parser = operator, help = operator_help())]
    operator: Vec<Operator>,
    /// Region, as in a scenario: '{ kind = "sphere", center = [0, 0, 0], radius = "5 mm" }'; by default the periodic cell
    #[arg(long, value_name = "TABLE", requires = "operator")]
    region: Option<String>,
    /// Treatment of contacts that cross the boundary of the region: internal-only, half-crossing, or branch-clipped
    #[arg(long, value_name = "NAME", value_parser = truncation, requires = "operator")]
    truncation: Option<Truncation>,
    /// Division of branch vectors between particles, for particle-stress: contact-point or half-branch
    #[arg(long, value_name = "NAME", value_parser = partition, requires = "operator")]
    partition: Option<Partition>,
    /// Name of the wall, for wall-traction
    #[arg(long, value_name = "NAME", requires = "operator")]
    wall: Option<String>,
    /// Reference area, for wall-traction: "36 mm^2"
    #[arg(long, value_name = "AREA", requires = "operator")]
    area: Option<String>,
    /// Name of the set, for set-force and set-motion; twice for gauge
    #[arg(long, value_name = "NAME", requires = "operator")]
    set: Vec<String>,
    /// Number of cells of a box along x, y, z; gives one row per cell
    #[arg(long, value_name = "NX,NY,NZ", value_parser = grid, requires = "region")]
    grid: Option<[usize; 3]>,
    /// Print the stress of every particle instead of the mean, for particle-stress: one row per particle, over the
    /// volume of its sphere (or disc)
    #[arg(long, requires = "operator")]
    each: bool,
    /// Print comma-separated values
    #[arg(long)]
    csv: bool,
}

fn operator_names() -> String {
    Operator::ALL.map(Operator::name).join(", ")
}

fn operator_help() -> String {
    format!(
        "What to evaluate: {}; may be repeated. By default, the [[sample]] tables of the scenario",
        operator_names()
    )
}

fn operator(text: &str) -> Result<Operator, String> {
    Operator::of_name(text).ok_or_else(|| format!("choose one of {}", operator_names()))
}

fn truncation(text: &str) -> Result<Truncation, String> {
    match text {
        "internal-only" => Ok(Truncation::InternalOnly),
        "half-crossing" => Ok(Truncation::HalfCrossing),
        "branch-clipped" => Ok(Truncation::BranchClipped),
        _ => Err("choose internal-only, half-crossing, or branch-clipped".into()),
    }
}

fn partition(text: &str) -> Result<Partition, String> {
    match text {
        "contact-point" => Ok(Partition::ContactPoint),
        "half-branch" => Ok(Partition::HalfBranch),
        _ => Err("choose contact-point or half-branch".into()),
    }
}

fn grid(text: &str) -> Result<[usize; 3], String> {
    let counts: Option<Vec<usize>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match counts.as_deref() {
        Some(&[x, y, z]) if x > 0 && y > 0 && z > 0 => Ok([x, y, z]),
        _ => Err("write three positive integers, such as 4,4,8".into()),
    }
}

pub(super) fn measure(arguments: &MeasureArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let result = open_result(&arguments.file, console)?;
    let scenario = Scenario::parse(&arguments.file.display().to_string(), &result.scenario()?)?;
    let moment = Moment::read(&result, &scenario)?;
    let text = if arguments.operator.is_empty() {
        let samples = samples::of(&scenario, &moment.particles, moment.cell.as_ref())
            .map_err(|error| Failure::of_assembly(&scenario, error))?;
        if samples.is_empty() {
            let message = "the scenario of the run has no [[sample]]; choose an operator and a region: --operator region-stress --region \
                           '{ kind = \"sphere\", center = [0, 0, 0], radius = \"5 mm\" }'";
            return Err(Failure::Usage(message.into()));
        }
        // Moving regions are at their final position.
        samples.iter().map(|sample| moment.show(sample, arguments.csv)).collect::<Result<String, _>>()?
    } else {
        let wanted = arguments.region.as_deref().map(read_region).transpose()?;
        let area = arguments.area.as_deref().map(read_area).transpose()?;
        let mut text = String::new();
        for &operator in &arguments.operator {
            let sample = scenario::OperatorSample {
                grid: arguments.grid,
                truncation: arguments.truncation,
                partition: arguments.partition,
                wall: arguments.wall.clone(),
                area,
                set: arguments.set.first().filter(|_| arguments.set.len() == 1).cloned(),
                sets: <[String; 2]>::try_from(arguments.set.clone()).ok(),
                ..whole(operator, wanted.clone())
            };
            if let Some(misuse) = sample.misuse(scenario.dimension) {
                let key = misuse.key.replace('_', "-");
                return Err(Failure::Usage(format!("--{key}: {}; {}", misuse.message, misuse.help)));
            }
            if let Some(wall) = sample.wall.as_ref().filter(|wall| !scenario.wall_names().contains(wall)) {
                let names = scenario.wall_names().join(", ");
                return Err(Failure::Usage(format!("--wall: no wall is called \"{wall}\"; the walls are: {names}")));
            }
            let sample = samples::one(&scenario, &moment.particles, moment.cell.as_ref(), "--region", &sample)
                .map_err(|error| Failure::Usage(error.to_string().replace("--region.region", "--region")))?;
            if sample.is_empty(&moment.state())? {
                let message = "--region: no particle and no contact lies in the region; move or enlarge it";
                return Err(Failure::Usage(message.into()));
            }
            text += &if arguments.each {
                if operator != Operator::ParticleStress {
                    return Err(Failure::Usage("--each is for --operator particle-stress".into()));
                }
                moment.each(&sample)?
            } else {
                moment.show(&sample, arguments.csv)?
            };
        }
        text
    };
    console.print(&text)
}

/// An operator without options.
fn whole(operator: Operator, region: Option<SampleRegion>) -> scenario::OperatorSample {
    scenario::OperatorSample {
        operator,
        name: None,
        region,
        grid: None,
        truncation: None,
        partition: None,
        wall: None,
        area: None,
        set: None,
        sets: None,
        about: None,
        velocity: [Velocity::new(0.0); 3],
        velocity_gradient: [[StrainRate::new(0.0); 3]; 3],
        interval: None,
    }
}

/// Stress of each particle at the end, Pa, over the volume of its sphere or disc, by its id.
pub(super) fn particle_stresses(result: &ResultFile, scenario: &Scenario) -> Result<HashMap<u32, Mat3>, Failure> {
    let moment = Moment::read(result, scenario)?;
    // The volume is that of the mean, which is not asked for.
    let everything = SampleRegion::All { volume: Volume::new(1.0) };
    let sample = whole(Operator::ParticleStress, Some(everything));
    let sample = samples::one(scenario, &moment.particles, moment.cell.as_ref(), "stress", &sample)
        .map_err(|error| Failure::of_assembly(scenario, error))?;
    moment.stresses(&sample)
}

fn read_area(text: &str) -> Result<Area, Failure> {
    Area::parse(text).map_err(|error| Failure::Usage(format!("--area: {error}")))
}

fn read_region(text: &str) -> Result<SampleRegion, Failure> {
    #[derive(serde::Deserialize)]
    struct Table {
        region: SampleRegion,
    }
    toml::from_str::<Table>(&format!("region = {text}\n"))
        .map(|table| table.region)
        .map_err(|error| Failure::Usage(format!("--region is not a valid region: {}", error.message())))
}

/// The final state of a run, as operators read it.
pub struct Moment {
    particles: Particles,
    cell: Option<Cell>,
    time: f64,
    bonds: Bonds,
    forces: Forces,
    links: ContactForces,
    places: Vec<Vec3>,
    mesh: OnceLock<Result<Mesh, OperatorError>>,
    gravity: Vec3,
    plane: bool,
}

/// The columns of a table.
struct Table {
    name: String,
    file: PathBuf,
    columns: BTreeMap<String, StoredColumn>,
}

impl Table {
    fn read(result: &ResultFile, name: &str) -> Result<Self, Failure> {
        let columns = result.rows(name)?.into_iter().collect();
        Ok(Self { name: name.to_owned(), file: result.path().to_owned(), columns })
    }

    fn missing(&self, column: &str) -> Failure {
        Failure::Usage(format!(
            "{} has no {}/{column}: an older version of this program wrote it; run its scenario again",
            self.file.display(),
            self.name
        ))
    }

    /// A column with this number of components.
    fn column(&self, column: &str, components: usize) -> Result<&ColumnData, Failure> {
        let found = self.columns.get(column).ok_or_else(|| self.missing(column))?;
        if found.components != components {
            let problem =
                format!("`{}/{column}` has {} components instead of {components}", self.name, found.components);
            return Err(OutputError::Damaged { path: self.file.clone(), problem }.into());
        }
        Ok(&found.data)
    }

    fn numbers(&self, column: &str, components: usize) -> Result<&[f64], Failure> {
        match self.column(column, components)? {
            ColumnData::F64(data) => Ok(data),
            _ => Err(self.missing(column)),
        }
    }

    fn reals(&self, column: &str) -> Result<&[f64], Failure> {
        self.numbers(column, 1)
    }

    fn vectors(&self, column: &str) -> Result<Vec<Vec3>, Failure> {
        Ok(concordem_operator::vectors("column", self.numbers(column, 3)?)?.to_vec())
    }

    fn flags(&self, column: &str) -> Result<Vec<bool>, Failure> {
        match self.column(column, 1)? {
            ColumnData::U8(data) => Ok(data.iter().map(|&flag| flag != 0).collect()),
            _ => Err(self.missing(column)),
        }
    }

    fn indices(&self, column: &str, components: usize) -> Result<&[u32], Failure> {
        match self.column(column, components)? {
            ColumnData::U32(data) => Ok(data),
            _ => Err(self.missing(column)),
        }
    }
}

/// Fails if a membrane presses on the particles: its forces are not in the result.
fn refuse_membranes(scenario: &Scenario) -> Result<(), Failure> {
    if scenario.membranes.is_empty() {
        return Ok(());
    }
    let message =
        "the run has a [[membrane]], whose forces are not stored: add the operator as a [[sample]] of the run";
    Err(Failure::Usage(message.into()))
}

impl Moment {
    /// The particles.
    pub fn particles(&self) -> &Particles {
        &self.particles
    }

    /// The periodic cell.
    pub fn cell(&self) -> Option<&Cell> {
        self.cell.as_ref()
    }

    /// Values of an operator, in the order of its quantities.
    ///
    /// # Errors
    /// The operator cannot be evaluated, or nothing lies in its region.
    pub fn evaluate(&self, sample: &ScheduledOperator) -> Result<Vec<f64>, Failure> {
        let state = self.state();
        if sample.is_empty(&state)? {
            let message = "region: no particle and no contact lies in the region; move or enlarge it";
            return Err(Failure::Usage(message.into()));
        }
        Ok(sample.evaluate(&state)?)
    }

    /// The final state of a result with this scenario.
    ///
    /// # Errors
    /// The result lacks a table, or the run has a membrane, whose forces are not stored.
    pub fn read(result: &ResultFile, scenario: &Scenario) -> Result<Self, Failure> {
        refuse_membranes(scenario)?;
        let table = Table::read(result, "particles")?;
        let mut particles = Particles::default();
        let (position, radius, mass) = (table.vectors("position")?, table.reals("radius")?, table.reals("mass")?);
        for (p, x) in position.iter().enumerate() {
            particles.push(Sphere { position: *x, radius: radius[p] }, 0, mass[p], 0.0);
        }
        particles.velocity = table.vectors("velocity")?;
        particles.angular_velocity = table.vectors("angular_velocity")?;
        let Some(ColumnData::U8(prescribed)) = table.columns.get("prescribed").map(|column| &column.data) else {
            return Err(table.missing("prescribed"));
        };
        particles.constraint = prescribed.iter().map(|&bits| Constraint(bits)).collect();
        for (q, angle) in particles.orientation.iter_mut().zip(table.vectors("rotation")?) {
            *q = concordem_contact::math::quaternion_of_rotation_vector(&angle);
        }
        if let Some(ColumnData::U16(material)) = table.columns.get("material").map(|column| &column.data) {
            particles.material.clone_from(material);
        }
        if let Some(ColumnData::U64(sets)) = table.columns.get("sets").map(|column| &column.data) {
            particles.tags.clone_from(sets);
        }
        table.indices("id", 1)?.clone_into(&mut particles.id);
        let row: BTreeMap<u32, u32> = particles.id.iter().zip(0..).map(|(&id, row)| (id, row)).collect();
        let place = |id: u32| row.get(&id).copied().unwrap_or(u32::MAX);
        let places = position.iter().zip(table.vectors("displacement")?).map(|(x, u)| x - u).collect();
        let cell = match Table::read(result, "cell") {
            Ok(table) => {
                let matrix = |name| match table.numbers(name, 3)? {
                    values if values.len() == 9 => Ok(Mat3::from_row_slice(values)),
                    _ => Err(table.missing(name)),
                };
                let mut cell = Cell::new(matrix("edges")?);
                cell.deformation_gradient = matrix("deformation_gradient")?;
                cell.velocity_gradient = matrix("velocity_gradient")?;
                Some(cell)
            }
            Err(_) => None,
        };
        let (mut forces, mut bonds) = (Forces::default(), Bonds::default());
        for law in result.laws()? {
            let table = Table::read(result, &format!("contacts/{law}"))?;
            if law == WALLS {
                forces.walls.particle = table.indices("id", 1)?.iter().map(|&id| place(id)).collect();
                table.indices("wall", 1)?.clone_into(&mut forces.walls.wall);
                forces.walls.point = table.vectors("position")?;
                forces.walls.force = table.vectors("force")?;
                forces.walls.moment = table.vectors("moment")?;
                continue;
            }
            let pairs: Vec<[u32; 2]> =
                table.indices("ids", 2)?.chunks_exact(2).map(|pair| [place(pair[0]), place(pair[1])]).collect();
            let (branch, broken) = (table.vectors("branch")?, table.flags("broken")?);
            let (point, force, moment) =
                (table.vectors("position")?, table.vectors("force")?, table.vectors("moment")?);
            // Broken bonds count as damage, not as contacts.
            let contacts = &mut forces.contacts;
            for k in (0..pairs.len()).filter(|&k| !broken[k]) {
                contacts.pair.push(pairs[k]);
                contacts.branch.push(branch[k]);
                contacts.point.push(point[k]);
                contacts.force.push(force[k]);
                contacts.moment.push(moment[k]);
            }
            if !law.starts_with(UNBONDED) {
                let normal = table.vectors("normal")?;
                let (damage, lost_strength) = (table.reals("damage")?, table.reals("lost_strength")?);
                for (k, pair) in pairs.iter().enumerate() {
                    let a = particles.position.get(pair[0] as usize).copied().unwrap_or_default();
                    // Broken bonds keep the direction at which they broke.
                    let along = if broken[k] { normal[k] } else { branch[k].normalize() };
                    bonds.push(*pair, &a, &branch[k], &along, [damage[k], lost_strength[k]]);
                }
            }
        }
        // Every run ends with a snapshot.
        let time = result.snapshot_times()?.last().copied().unwrap_or_default();
        apply_loads(scenario, &mut particles, time);
        let links = rigid_links(&particles, &forces, &samples::rigid_bodies(scenario, &particles))?;
        let gravity = vector(&scenario.integration.gravity);
        let plane = scenario.dimension == 2;
        Ok(Self { particles, cell, time, bonds, forces, links, places, mesh: OnceLock::new(), gravity, plane })
    }

    /// The stress of every particle of the region, as comma-separated values.
    fn each(&self, sample: &ScheduledOperator) -> Result<String, Failure> {
        let volumes = self.volumes()?;
        let mut text = String::from("id,volume [m^3]");
        for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
            let _ = write!(text, ",stress_{}{} [Pa]", AXES[i], AXES[j]);
        }
        text.push('\n');
        for (p, moment) in sample.particle_moments(&self.state())? {
            let _ = write!(text, "{},{:e}", self.particles.id[p], volumes[p]);
            for s in (moment / volumes[p]).transpose().iter() {
                let _ = write!(text, ",{s:e}");
            }
            text.push('\n');
        }
        Ok(text)
    }

    /// The stress of every particle of the region, Pa, by its id.
    fn stresses(&self, sample: &ScheduledOperator) -> Result<HashMap<u32, Mat3>, Failure> {
        let volumes = self.volumes()?;
        let moments = sample.particle_moments(&self.state())?.into_iter();
        Ok(moments.map(|(p, moment)| (self.particles.id[p], moment / volumes[p])).collect())
    }

    /// Volumes of the spheres or discs, m³.
    fn volumes(&self) -> Result<Vec<f64>, Failure> {
        let volume = if self.plane { ParticleVolume::Disc } else { ParticleVolume::Sphere };
        Ok(volume.of(&self.particles.radius)?)
    }

    /// The state as operators read it.
    fn state(&self) -> SampledState<'_> {
        SampledState {
            particles: &self.particles,
            cell: self.cell,
            time: self.time,
            bonds: &self.bonds,
            forces: &self.forces,
            links: &self.links,
            initial_positions: &self.places,
            initial_edges: self
                .cell
                .map(|cell| cell.deformation_gradient.try_inverse().unwrap_or_else(Mat3::identity) * cell.matrix),
            mesh: &self.mesh,
            // A result does not store the heat capacities.
            heat: None,
            gravity: self.gravity,
            planar: self.plane,
        }
    }

    /// The values of an operator as text.
    fn show(&self, sample: &ScheduledOperator, csv: bool) -> Result<String, Failure> {
        let at = self.state();
        let values = sample.evaluate(&at)?;
        let quantities = sample.operator.quantities();
        let mut text = String::new();
        if csv || sample.grid.is_some() {
            let grid = if sample.grid.is_some() { "i,j,k," } else { "" };
            let _ = writeln!(text, "{grid}{}", quantities.iter().flat_map(heads).collect::<Vec<_>>().join(","));
            for cell in 0..sample.cells() {
                if let Some([nx, ny, _]) = sample.grid {
                    let _ = write!(text, "{},{},{},", cell % nx, cell / nx % ny, cell / (nx * ny));
                }
                let mut rest = &values[..];
                let mut line = Vec::new();
                for quantity in quantities {
                    let (mine, others) = rest.split_at(quantity.components * sample.cells());
                    rest = others;
                    let mine = &mine[cell * quantity.components..][..quantity.components];
                    line.extend(mine.iter().map(|v| format!("{v:e}")));
                }
                let _ = writeln!(text, "{}", line.join(","));
            }
            return Ok(text);
        }
        let _ = writeln!(text, "{}", sample.name);
        let mut rest = &values[..];
        for quantity in quantities {
            let (mine, others) = rest.split_at(quantity.components);
            rest = others;
            let unit = if quantity.unit == "1" { String::new() } else { format!(" {}", quantity.unit) };
            for (line, row) in mine.chunks(3).enumerate() {
                let name = if line == 0 { quantity.name } else { "" };
                let _ = write!(text, "  {name:22}");
                for value in row {
                    let _ = write!(text, "{value:>15.6e}");
                }
                let _ = writeln!(text, "{}", if line == 0 { &unit } else { "" });
            }
        }
        Ok(text)
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// Column headers of a quantity.
fn heads(quantity: &SampledQuantity) -> Vec<String> {
    let unit = quantity.unit;
    let name = quantity.name;
    match quantity.components {
        1 => vec![format!("{name} [{unit}]")],
        3 => AXES.iter().map(|i| format!("{name}_{i} [{unit}]")).collect(),
        _ => AXES.iter().flat_map(|i| AXES.iter().map(move |j| format!("{name}_{i}{j} [{unit}]"))).collect(),
    }
}
