//! A packing with its links and the shape that bounds it, from a file.

use std::path::Path;

use super::CharacteriseError;
use crate::output::ResultFile;
use concordem_contact::math::{Mat3, Vec3};
use concordem_files::sphere_pack;
use concordem_packing::bonding::{ratio_for_coordination, ratio_inside};
use concordem_packing::cooker::boundary;
use concordem_packing::{Packing, Shape, TIE, import};
use concordem_scenario::assembly::{Placed, divided, place};
use concordem_scenario::schema::{Quantity, Scenario, Setting};
use concordem_solver::neighbor::candidate_pairs;
use concordem_solver::state::columns::{ColumnData, StoredColumn};
use concordem_solver::state::{Cell, Sphere};

/// What the links of a packing are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Links {
    /// Pairs with center distance up to this ratio times the sum of the radii; 1: touching spheres.
    Near(f64),
    /// Intact bonds of a result.
    Bonds,
    /// Links that the packing determines: frozen links, or those of enlarged radii.
    Network,
}

/// Choice of links and of the shape.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Choice {
    /// Links are pairs with center distance up to this ratio times the sum of the radii.
    pub interaction_ratio: Option<f64>,
    /// Links are the nearest pairs, as many per sphere (inside).
    pub coordination: Option<f64>,
    /// Shape that bounds the spheres; default: that of the scenario, or the hull of the spheres.
    pub shape: Option<Shape>,
    /// Edges of the periodic cell of a text file, m.
    pub cell: Option<[f64; 3]>,
    /// Settings that replace keys of a scenario.
    pub settings: Vec<Setting>,
}

/// A packing with its links and the shape that bounds it.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Name of the file.
    pub name: String,
    /// The spheres, and the cell if the packing is periodic.
    pub packing: Packing,
    /// Shape that bounds the spheres, if it is known.
    pub shape: Option<Shape>,
    /// What the links are.
    pub kind: Links,
    /// Pairs of spheres.
    pub pairs: Vec<[u32; 2]>,
    /// Branch vector of each pair, m.
    pub branches: Vec<Vec3>,
    /// Material of each sphere, and names of the materials; empty if unknown.
    pub materials: (Vec<u16>, Vec<String>),
    /// Number of the aggregate of each sphere, 0 for none; empty without aggregates.
    pub aggregates: Vec<u32>,
}

impl Body {
    /// Reads a sphere file (text or HDF5), a result, or a scenario, whose packing is made.
    ///
    /// # Errors
    /// The file cannot be read, or the choice does not fit it.
    pub fn read(path: &Path, choice: &Choice, progress: &mut dyn FnMut(&str, f64)) -> Result<Self, CharacteriseError> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        let file = |problem: String| CharacteriseError::File { path: path.to_owned(), problem };
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let fixed = |what: &str| {
            choice.cell.map_or(Ok(()), |_| {
                Err(CharacteriseError::Choice(format!("a cell is given, but {what} has its own; leave it out")))
            })
        };
        if let Some(setting) = choice.settings.first()
            && extension != "toml"
        {
            let given = setting.shown();
            return Err(CharacteriseError::Choice(format!(
                "{given}: only a scenario has keys, and {} is none; leave it out, or give a .toml file",
                path.display()
            )));
        }
        let name = choice.settings.iter().fold(name, |name, setting| format!("{name} {}", setting.shown()));
        match extension.as_str() {
            "toml" => {
                fixed("a scenario")?;
                let scenario = Scenario::read_with(path, &choice.settings)?;
                let placed = place(&scenario, &scenario.directory(), progress)?;
                Self::of_placed(name, &scenario, &placed, choice)
            }
            "h5" | "hdf5" => {
                fixed("an HDF5 file")?;
                match sphere_pack::read(path) {
                    Ok(packing) => Self::of_packing(name, packing, choice),
                    Err(pack) => match ResultFile::open(path) {
                        Ok(result) => Self::of_result(name, &result, choice),
                        Err(result) => Err(file(format!("it {pack}; as a result: {result}"))),
                    },
                }
            }
            _ => {
                let reader = std::fs::File::open(path).map_err(|error| file(error.to_string()))?;
                // The message of a bad line names the line; here it gets the file.
                let mut packing =
                    import(std::io::BufReader::new(reader), None).map_err(|error| file(error.to_string()))?;
                if packing.cell.is_some() {
                    fixed("this file")?;
                }
                let given = choice.cell.map(|edges| Cell::new(Mat3::from_diagonal(&Vec3::from(edges))));
                packing.cell = given.or(packing.cell);
                Self::of_packing(name, packing, choice)
            }
        }
    }

    /// A packing with the links of a choice.
    ///
    /// # Errors
    /// The choice does not fit the packing.
    pub fn of_packing(name: String, packing: Packing, choice: &Choice) -> Result<Self, CharacteriseError> {
        if packing.cell.is_some() && choice.shape.is_some() {
            let message = "a periodic packing has no surface; leave the shape out";
            return Err(CharacteriseError::Choice(message.to_owned()));
        }
        if packing.spheres.is_empty() {
            let message = format!("{name} has no spheres; each line of a packing is x y z r, in m");
            return Err(CharacteriseError::Choice(message));
        }
        let flat = |sphere: &Sphere| sphere.position.z == packing.spheres[0].position.z;
        if packing.spheres.len() > 1 && packing.spheres.iter().all(flat) {
            let message = "all centers lie in one plane normal to z; only packings in space can be characterised";
            return Err(CharacteriseError::Choice(message.to_owned()));
        }
        let mut body = Self {
            name,
            shape: choice.shape.clone(),
            kind: Links::Near(1.0),
            packing,
            pairs: Vec::new(),
            branches: Vec::new(),
            materials: (Vec::new(), Vec::new()),
            aggregates: Vec::new(),
        };
        body.link_near(choice)?;
        Ok(body)
    }

    /// The packing of a scenario, with its phases; by default with the links that become its bonds. If aggregates, given phases, fibers, or
    /// sets divide it, cuts, pores, and fibers have removed their particles.
    ///
    /// # Errors
    /// The choice does not fit the packing.
    pub fn of_placed(
        name: String,
        scenario: &Scenario,
        placed: &Placed,
        choice: &Choice,
    ) -> Result<Self, CharacteriseError> {
        let mut choice = choice.clone();
        let free = choice.interaction_ratio.is_none() && choice.coordination.is_none();
        let network = placed.walled.as_ref().and_then(|walled| walled.network.clone()).filter(|_| free);
        if let Some(bonds) = scenario.bonds.as_ref().filter(|_| free && network.is_none()) {
            choice.coordination = bonds.coordination.map(Quantity::si);
            choice.interaction_ratio = bonds.coordination.is_none().then(|| bonds.interaction_ratio.si());
            if let (Some(z), Some(unit)) = (choice.coordination, &placed.unit) {
                // Bonds are counted in the periodic packing from which the body was cut.
                let ratio = ratio_for_coordination(&unit.spheres, unit.cell.as_ref(), z)?;
                choice.interaction_ratio = Some(ratio.ok_or_else(|| too_few(z))?.0);
                choice.coordination = None;
            }
        }
        if placed.packing.cell.is_none() {
            choice.shape = choice.shape.or_else(|| placed.body.clone());
        }
        let particles = divided(scenario, &scenario.directory(), placed, &mut |_, _| ())?;
        let Some(particles) = particles.filter(|_| network.is_none()) else {
            let mut body = Self::of_packing(name, placed.packing.clone(), &choice)?;
            if let Some(network) = network {
                body.set_links(Links::Network, network);
            }
            return Ok(body);
        };
        let places = particles.position.iter().zip(&particles.radius);
        let spheres = places.map(|(&position, &radius)| Sphere { position, radius }).collect();
        let packing = Packing { spheres, cell: placed.packing.cell };
        let mut body = Self::of_packing(name, packing, &choice)?;
        body.materials = (particles.material, scenario.materials.iter().map(|m| m.name.clone()).collect());
        body.aggregates = particles.aggregate;
        Ok(body)
    }

    fn of_result(name: String, result: &ResultFile, choice: &Choice) -> Result<Self, CharacteriseError> {
        let table = result.rows("particles")?;
        let (position, radius) = (vectors(&table, "position"), reals(&table, "radius"));
        let spheres = (position.iter().zip(&radius)).map(|(&position, &radius)| Sphere { position, radius }).collect();
        let edges = result.table("cell").map(|cell| reals(&cell, "edges")).unwrap_or_default();
        let cell = (edges.len() == 9).then(|| Cell::new(Mat3::from_row_slice(&edges)));
        let mut body = Self::of_packing(name, Packing { spheres, cell }, choice)?;
        let free = choice.interaction_ratio.is_none() && choice.coordination.is_none();
        if let Some((pairs, branches)) = bonds(result, &table)?.filter(|_| free) {
            (body.kind, body.pairs, body.branches) = (Links::Bonds, pairs, branches);
        }
        if let Some(ColumnData::U16(material)) = column(&table, "material") {
            body.materials.0.clone_from(material);
        }
        if let Some(ColumnData::U32(aggregate)) = column(&table, "aggregate") {
            body.aggregates.clone_from(aggregate);
        }
        let scenario = toml::from_str::<toml::Table>(&result.scenario()?).unwrap_or_default();
        let materials = scenario.get("material").and_then(toml::Value::as_array);
        let name = |material: &toml::Value| material.get("name").and_then(toml::Value::as_str).unwrap_or("").to_owned();
        body.materials.1 = materials.map_or_else(Vec::new, |list| list.iter().map(name).collect());
        Ok(body)
    }

    /// Links of the nearest pairs.
    fn link_near(&mut self, choice: &Choice) -> Result<(), CharacteriseError> {
        let (spheres, cell) = (&self.packing.spheres, self.packing.cell.as_ref());
        let ratio = match (choice.interaction_ratio, choice.coordination) {
            (Some(_), Some(_)) => {
                let message = "an interaction ratio and a coordination number are given; leave one out";
                return Err(CharacteriseError::Choice(message.to_owned()));
            }
            (Some(ratio), None) if !(1.0..=10.0).contains(&ratio) => {
                let message = format!("the interaction ratio is {ratio}; it must lie between 1 and 10");
                return Err(CharacteriseError::Choice(message));
            }
            (Some(ratio), None) => ratio,
            (None, Some(z)) => {
                let found = match &self.shape {
                    Some(shape) => ratio_inside(spheres, cell, &boundary(spheres, shape), z)?,
                    None => ratio_for_coordination(spheres, cell, z)?,
                };
                found.ok_or_else(|| too_few(z))?.0
            }
            (None, None) => 1.0,
        };
        let reach: Vec<f64> = spheres.iter().map(|sphere| sphere.radius * ratio * (1.0 + TIE)).collect();
        let candidates = candidate_pairs(&self.packing.positions(), &reach, cell)?;
        self.kind = Links::Near(ratio);
        self.pairs = candidates.iter().map(|pair| [pair.a, pair.b]).collect();
        self.branches = candidates
            .iter()
            .map(|pair| {
                let shift = cell.map_or_else(Vec3::zeros, |cell| cell.shift(pair.image));
                spheres[pair.b as usize].position + shift - spheres[pair.a as usize].position
            })
            .collect();
        Ok(())
    }

    /// Replaces the links of a packing without a cell.
    fn set_links(&mut self, kind: Links, pairs: Vec<[u32; 2]>) {
        let place = |p: u32| self.packing.spheres[p as usize].position;
        self.branches = pairs.iter().map(|[a, b]| place(*b) - place(*a)).collect();
        (self.kind, self.pairs) = (kind, pairs);
    }
}

fn too_few(coordination: f64) -> CharacteriseError {
    let message = format!("no interaction ratio up to 2 gives {coordination} links per sphere; give a smaller number");
    CharacteriseError::Choice(message)
}

/// Columns of a table of a result.
type Columns = Vec<(String, StoredColumn)>;

fn column<'a>(table: &'a Columns, name: &str) -> Option<&'a ColumnData> {
    table.iter().find(|(column, _)| column == name).map(|(_, column)| &column.data)
}

fn reals(table: &Columns, name: &str) -> Vec<f64> {
    match column(table, name) {
        Some(ColumnData::F64(data)) => data.clone(),
        _ => Vec::new(),
    }
}

fn vectors(table: &Columns, name: &str) -> Vec<Vec3> {
    reals(table, name).chunks_exact(3).map(Vec3::from_column_slice).collect()
}

/// Pairs and branch vectors (m).
type Linked = (Vec<[u32; 2]>, Vec<Vec3>);

/// Intact bonds of a result; `None` if it has no bonds.
fn bonds(result: &ResultFile, particles: &Columns) -> Result<Option<Linked>, CharacteriseError> {
    let Some(ColumnData::U32(ids)) = column(particles, "id") else { return Ok(None) };
    let row: std::collections::BTreeMap<u32, u32> = ids.iter().zip(0..).map(|(&id, row)| (id, row)).collect();
    let (mut pairs, mut branches, mut any) = (Vec::new(), Vec::new(), false);
    for law in result.laws()? {
        if law == "walls" || law.starts_with("unbonded_") {
            continue;
        }
        let table = result.rows(&format!("contacts/{law}"))?;
        let (Some(ColumnData::U32(ends)), Some(ColumnData::U8(broken))) =
            (column(&table, "ids"), column(&table, "broken"))
        else {
            continue;
        };
        any = true;
        for ((ends, branch), broken) in ends.chunks_exact(2).zip(vectors(&table, "branch")).zip(broken) {
            if let (0, Some(&a), Some(&b)) = (*broken, row.get(&ends[0]), row.get(&ends[1])) {
                pairs.push([a, b]);
                branches.push(branch);
            }
        }
    }
    Ok(any.then_some((pairs, branches)))
}
