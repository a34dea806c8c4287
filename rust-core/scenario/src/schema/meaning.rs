//! Checks what a scenario means: values that do not fit together, names that nothing has, spheres that overlap.

use std::path::Path;

use super::document::Document;
use super::error::{Problem, ProblemKind};
use super::quantity::{Component, Dimension, Length, Quantity, vector};
use super::structure::{listing, nearest};
use super::{
    Axis, DeformableUpdate, LawName, Loading, Misuse, Packing, Radii, SampleRegion, Scenario, Selection, Shape,
    WallShape,
};
use concordem_contact::law::{FaultKind, LawTable};
use concordem_contact::math::Vec3;

/// Ids are 32-bit.
const MOST_PARTICLES: f64 = u32::MAX as f64;
/// Overlap, as a fraction of the smaller radius, above which two listed spheres count as a mistake. Without bonds an
/// overlap is an elastic energy that shoots the pair apart; a hundredth allows for rounded coordinates.
const OVERLAP_UNBONDED: f64 = 0.01;
/// The same with bonds, which may be made free of force at an overlap.
const OVERLAP_BONDED: f64 = 0.5;
/// Two moduli of a stress tensor count as equal within this relative difference (rounding of unit conversion).
const SYMMETRY: f64 = 1e-12;

/// All faults of meaning.
pub(super) fn check(document: &Document<'_>, scenario: &Scenario) -> Vec<Problem> {
    let mut checker = Checker { document, scenario, problems: Vec::new() };
    checker.packing();
    checker.materials();
    checker.laws();
    checker.loading();
    checker.stop();
    checker.walls();
    checker.sets();
    checker.clumps();
    checker.samples();
    checker.output();
    if scenario.dimension == 2 {
        checker.plane();
    }
    checker.deformable();
    checker.problems
}

/// All files that a scenario names and that are not there.
pub(super) fn check_files(document: &Document<'_>, scenario: &Scenario, directory: &Path) -> Vec<Problem> {
    let mut checker = Checker { document, scenario, problems: Vec::new() };
    for (key, path) in scenario.files() {
        checker.file(&key, directory, path);
    }
    if let Some(file) = &scenario.output.file {
        let target = directory.join(file);
        let parent = target.parent().unwrap_or(directory);
        if target.is_dir() {
            let help = format!("name a file in it: \"{}/result.h5\"", file.trim_end_matches('/'));
            checker.add(ProblemKind::File, "output.file", "is a folder", help);
        } else if !parent.as_os_str().is_empty() && !parent.is_dir() {
            let message = format!("the folder {} does not exist", parent.display());
            checker.add(ProblemKind::File, "output.file", message, "make the folder, or name another file");
        }
    }
    checker.problems
}

struct Checker<'a> {
    document: &'a Document<'a>,
    scenario: &'a Scenario,
    problems: Vec<Problem>,
}

impl Checker<'_> {
    fn add(&mut self, kind: ProblemKind, key: &str, message: impl Into<String>, help: impl Into<String>) {
        let (span, value) = self.document.locate(key);
        let (message, help) = (message.into(), help.into());
        self.problems.push(Problem { kind, key: key.to_owned(), value, span, message, help });
    }

    fn conflict(&mut self, key: &str, message: impl Into<String>, help: impl Into<String>) {
        self.add(ProblemKind::Conflict, key, message, help);
    }

    fn range(&mut self, key: &str, message: impl Into<String>, help: impl Into<String>) {
        self.add(ProblemKind::OutOfRange, key, message, help);
    }

    fn file(&mut self, key: &str, directory: &Path, path: &str) {
        let full = directory.join(path);
        match std::fs::metadata(&full) {
            Ok(data) if data.is_dir() => self.add(ProblemKind::File, key, "is a folder", "name a file"),
            Ok(_) => {}
            Err(error) => {
                let message = format!("cannot read {}: {error}", full.display());
                let help = "check the name; it is relative to the scenario's folder";
                self.add(ProblemKind::File, key, message, help);
            }
        }
    }

    /// The name must be one of those given.
    fn known(&mut self, key: &str, what: &str, name: &str, names: &[&str]) {
        if names.contains(&name) {
            return;
        }
        let help = match (nearest(name, names.iter().copied()), names) {
            (_, []) => format!("there is no {what} at all: add [[{what}]] with name = \"{name}\""),
            (Some(other), _) => format!("did you mean \"{other}\"?"),
            (None, _) => {
                let quoted: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
                format!("choose {}, or add a [[{what}]] of this name", listing(&quoted))
            }
        };
        self.add(ProblemKind::UnknownName, key, format!("no {what} has this name"), help);
    }

    /// Names must be unique and not empty.
    fn unique(&mut self, table: &str, names: &[&str]) {
        for (at, name) in names.iter().enumerate() {
            let key = format!("{table}[{at}].name");
            if name.trim().is_empty() {
                self.range(&key, "an empty name", "give it a name");
            } else if names[..at].contains(name) {
                self.conflict(&key, format!("two of [[{table}]] have this name"), "give each its own name");
            }
        }
    }

    fn material_names(&self) -> Vec<&str> {
        self.scenario.materials.iter().map(|material| material.name.as_str()).collect()
    }

    fn known_material(&mut self, key: &str, name: &str) {
        let scenario = self.scenario;
        let names: Vec<&str> = scenario.materials.iter().map(|material| material.name.as_str()).collect();
        self.known(key, "material", name, &names);
    }

    fn known_set(&mut self, key: &str, name: &str) {
        let scenario = self.scenario;
        let names: Vec<&str> = scenario.sets.iter().map(|set| set.name.as_str()).collect();
        self.known(key, "set", name, &names);
    }

    // ---------------------------------------------------------------------------------------------- packing

    fn packing(&mut self) {
        let scenario = self.scenario;
        match &scenario.packing {
            Packing::RandomDense { count, radius, radii, shape, .. }
            | Packing::RandomDiscs { count, radius, radii, shape, .. } => {
                match (radius, radii) {
                    (None, None) => self.add(
                        ProblemKind::MissingKey,
                        "packing.radius",
                        "neither `radius` nor `radii`",
                        "add `radius = \"1 mm\"` for equal spheres, or [packing.radii] for a distribution",
                    ),
                    (Some(_), Some(_)) => self.conflict(
                        "packing.radius",
                        "both `radius` and `radii`",
                        "keep `radius` for equal spheres, or [packing.radii] for a distribution",
                    ),
                    _ => {}
                }
                if let Some(radii) = radii {
                    self.radii(radii);
                }
                let range = match (radius, radii) {
                    (Some(radius), _) => Some((radius.si(), radius.si())),
                    (None, Some(radii)) => Some(radii.range()),
                    (None, None) => None,
                };
                self.shape(shape, range, true);
                if let Shape::Periodic { tiles } = shape {
                    if matches!(scenario.packing, Packing::RandomDiscs { .. }) && tiles[2] != 1 {
                        let help = format!("write tiles = [{}, {}, 1]", tiles[0], tiles[1]);
                        self.conflict("packing.shape.tiles", "discs lie in one plane", help);
                    }
                    let total = tiles.iter().fold(*count as f64, |total, n| total * *n as f64);
                    self.few_enough("packing.shape.tiles", total);
                }
            }
            Packing::Lattice { lattice, radius, repeats, shape } => {
                if let Some(shape) = shape {
                    self.shape(shape, Some((radius.si(), radius.si())), true);
                }
                match (repeats, shape) {
                    (None, None | Some(Shape::Periodic { .. })) => self.add(
                        ProblemKind::MissingKey,
                        "packing.repeats",
                        "the lattice has no size",
                        "add `repeats = [10, 10, 10]` (unit cells along x, y, z), or a [packing.shape] to fill",
                    ),
                    (Some(repeats), _) => {
                        if lattice.is_planar() && repeats[2] != 1 {
                            let help = format!("write repeats = [{}, {}, 1]", repeats[0], repeats[1]);
                            self.conflict("packing.repeats", "this lattice is planar, so one layer along z", help);
                        }
                        // At most 4 particles per unit cell (face-centred cubic).
                        self.few_enough("packing.repeats", repeats.iter().fold(4.0, |total, n| total * *n as f64));
                    }
                    _ => {}
                }
            }
            Packing::File { cell, shape, .. } => {
                if let Some(shape) = shape {
                    self.shape(shape, None, cell.is_some());
                }
            }
            Packing::Spheres { spheres, cell } => {
                if spheres.is_empty() && scenario.clumps.iter().all(|clump| clump.spheres.is_none()) {
                    self.range("packing.spheres", "no spheres", "list at least one as [x, y, z, radius]");
                }
                self.spheres("packing.spheres", spheres, true);
                if let Some(cell) = cell {
                    let largest = spheres.iter().fold(0.0_f64, |largest, sphere| largest.max(sphere[3].si()));
                    for (at, edge) in cell.iter().enumerate() {
                        if edge.si() <= 2.0 * largest {
                            let message =
                                format!("the cell is no wider than the largest sphere ({})", length(2.0 * largest));
                            let help = "a sphere would touch its own image; make the cell wider";
                            self.range(&format!("packing.cell[{at}]"), message, help);
                        }
                    }
                }
            }
        }
    }

    fn few_enough(&mut self, key: &str, count: f64) {
        if count.is_finite() && count > MOST_PARTICLES {
            let message =
                format!("about {count:.1e} particles, more than the {MOST_PARTICLES:.1e} that can be numbered");
            self.range(key, message, "check the units of the sizes and radii; plain numbers are metres");
        }
    }

    fn radii(&mut self, radii: &Radii) {
        match radii {
            Radii::Uniform { minimum, maximum } | Radii::LogNormal { minimum, maximum, .. }
                if minimum.si() > maximum.si() =>
            {
                self.conflict("packing.radii.minimum", "larger than `maximum`", "exchange the two");
            }
            Radii::LogNormal { median, minimum, maximum, .. }
                if median.si() < minimum.si() || median.si() > maximum.si() =>
            {
                let help = "choose limits on both sides of the median";
                self.conflict("packing.radii.median", "not between `minimum` and `maximum`", help);
            }
            Radii::Table { radii, shares } => {
                if radii.len() != shares.len() {
                    let message = format!("{} shares for {} radii", shares.len(), radii.len());
                    self.conflict("packing.radii.shares", message, "give one share per radius");
                } else if shares.iter().all(|share| share.si() <= 0.0) {
                    self.range("packing.radii.shares", "all shares are zero", "give at least one a positive share");
                }
            }
            _ => {}
        }
    }

    fn shape(&mut self, shape: &Shape, radii: Option<(f64, f64)>, has_cell: bool) {
        let volume = match shape {
            Shape::Box { size } => size.iter().map(|edge| edge.si()).product(),
            Shape::Cylinder { radius, height, .. } => 3.0 * radius.si() * radius.si() * height.si(),
            Shape::Hyperboloid { radius, waist_radius, height, .. } => {
                if waist_radius.si() > radius.si() {
                    let help = "the waist is the narrowest part; use a cylinder for a straight specimen";
                    self.conflict("packing.shape.waist_radius", "larger than the radius at the ends", help);
                }
                3.0 * waist_radius.si() * radius.si() * height.si()
            }
            Shape::Mesh { .. } => 0.0,
            Shape::Periodic { .. } => {
                if !has_cell {
                    let help = "add `cell = [...]` with the edges of the cell the file was made in";
                    self.conflict("packing.shape.kind", "the packing has no periodic cell", help);
                }
                return;
            }
        };
        let Some((smallest, largest)) = radii else { return };
        let widths: Vec<(String, f64)> = match shape {
            Shape::Box { size } => {
                size.iter().enumerate().map(|(at, edge)| (format!("packing.shape.size[{at}]"), edge.si())).collect()
            }
            Shape::Cylinder { radius, height, .. } => vec![
                ("packing.shape.radius".to_owned(), 2.0 * radius.si()),
                ("packing.shape.height".to_owned(), height.si()),
            ],
            Shape::Hyperboloid { waist_radius, height, .. } => vec![
                ("packing.shape.waist_radius".to_owned(), 2.0 * waist_radius.si()),
                ("packing.shape.height".to_owned(), height.si()),
            ],
            Shape::Mesh { .. } | Shape::Periodic { .. } => Vec::new(),
        };
        for (key, width) in widths {
            // In two dimensions the size along z is of no account.
            if width < 2.0 * largest && !(self.scenario.dimension == 2 && key.ends_with("size[2]")) {
                let message = format!("the shape is narrower than a particle ({})", length(2.0 * largest));
                self.range(&key, message, "check the units; plain numbers are metres");
            }
        }
        self.few_enough("packing.shape", volume / (4.0 * smallest * smallest * smallest));
    }

    /// Radii, and overlaps among the spheres of a list.
    fn spheres(&mut self, key: &str, spheres: &[[Length; 4]], overlaps: bool) {
        for (at, sphere) in spheres.iter().enumerate() {
            if sphere[3].si() <= 0.0 {
                let message = "the radius must be greater than 0";
                self.range(&format!("{key}[{at}][3]"), message, "a sphere is [x, y, z, radius]");
            }
        }
        if !overlaps {
            return;
        }
        let bonded = self.scenario.bonds.is_some();
        let allowed = if bonded { OVERLAP_BONDED } else { OVERLAP_UNBONDED };
        // Sweep along x: a sphere is compared with those that begin before it ends.
        let place = |at: usize| Vec3::new(spheres[at][0].si(), spheres[at][1].si(), spheres[at][2].si());
        let radius = |at: usize| spheres[at][3].si();
        let mut order: Vec<usize> = (0..spheres.len()).filter(|&at| radius(at) > 0.0).collect();
        order.sort_by(|&a, &b| (place(a).x - radius(a)).total_cmp(&(place(b).x - radius(b))).then(a.cmp(&b)));
        let mut found = Vec::new();
        for (rank, &a) in order.iter().enumerate() {
            for &b in order[rank + 1..].iter().take_while(|&&b| place(b).x - radius(b) < place(a).x + radius(a)) {
                let overlap = radius(a) + radius(b) - (place(b) - place(a)).norm();
                if overlap > allowed * radius(a).min(radius(b)) {
                    found.push((a.min(b), a.max(b), overlap));
                }
            }
        }
        found.sort_by_key(|&(a, b, _)| (a, b));
        let count = found.len();
        for (a, b, overlap) in found.into_iter().take(5) {
            let others = if count > 5 { format!(" ({count} pairs overlap in all)") } else { String::new() };
            let message = format!("overlaps sphere {a} by {}{others}", length(overlap));
            let help = if bonded {
                "move it, or make it smaller; bonded spheres may overlap by half of the smaller radius"
            } else {
                "move it, or make it smaller; join spheres that are meant to overlap in a [[clump]]"
            };
            self.conflict(&format!("{key}[{b}]"), message, help);
        }
    }

    // ---------------------------------------------------------------------------------------------- materials

    fn materials(&mut self) {
        let scenario = self.scenario;
        let names = self.material_names().into_iter().map(str::to_owned).collect::<Vec<_>>();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        self.unique("material", &names);
        let materials = scenario.materials.iter().map(|material| material.tables()).enumerate();
        let interfaces = scenario.interfaces.iter().map(|interface| interface.tables()).enumerate();
        let tables = materials
            .map(|(at, tables)| (format!("material[{at}]"), tables))
            .chain(interfaces.map(|(at, tables)| (format!("interface[{at}]"), tables)));
        let mut first: Vec<(LawName, String, String)> = Vec::new();
        for (owner, tables) in tables {
            for (law, table) in tables {
                self.law_table(&format!("{owner}.{}", law.key()), law, table, &mut first);
            }
        }
        for (at, interface) in scenario.interfaces.iter().enumerate() {
            for (side, name) in interface.between.iter().enumerate() {
                self.known_material(&format!("interface[{at}].between[{side}]"), name);
            }
            let key = format!("interface[{at}].between");
            if interface.between[0] == interface.between[1] {
                let help = "give the parameters in the material itself";
                self.conflict(&key, "an interface of a material with itself", help);
            }
            let same = |other: &[String; 2]| {
                let [a, b] = &interface.between;
                (&other[0] == a && &other[1] == b) || (&other[0] == b && &other[1] == a)
            };
            if scenario.interfaces[..at].iter().any(|other| same(&other.between)) {
                self.conflict(&key, "a second interface between these materials", "join the two");
            }
        }
    }

    /// Faults of the table of a law at `path`; `first` holds the key that all tables of a law must agree on: law, value, path.
    fn law_table(
        &mut self,
        path: &str,
        law: LawName,
        table: &dyn LawTable,
        first: &mut Vec<(LawName, String, String)>,
    ) {
        for fault in table.faults() {
            let key = if fault.key.is_empty() { path.to_owned() } else { format!("{path}.{}", fault.key) };
            let kind = match fault.kind {
                FaultKind::Missing => ProblemKind::MissingKey,
                FaultKind::Conflict => ProblemKind::Conflict,
                FaultKind::Range => ProblemKind::OutOfRange,
            };
            self.add(kind, &key, fault.message, fault.help);
        }
        let Some((key, value)) = table.uniform_key() else { return };
        match first.iter().find(|(other, _, _)| *other == law) {
            None => first.push((law, value, path.to_owned())),
            Some((_, same, other)) if *same != value => {
                let help = format!("one run has one {key} of the model; make it that of `{other}`");
                self.conflict(&format!("{path}.{key}"), format!("`{other}` has another {key}"), help);
            }
            Some(_) => {}
        }
    }

    /// Deformable particles: their options, and what they go with.
    fn deformable(&mut self) {
        let scenario = self.scenario;
        let first = scenario.materials.iter().position(|material| material.deformable.is_some());
        if let Some(options) = &scenario.deformable {
            if first.is_none() {
                let help =
                    "add `deformable = { young = \"200 GPa\", poisson = 0.3 }` to a material, or remove [deformable]";
                self.conflict("deformable", "no material is deformable", help);
            }
            if let Some(condition) = options.condition
                && condition.is_planar() != (scenario.dimension == 2)
            {
                let help = if scenario.dimension == 2 {
                    "discs are in \"plane-strain\" or \"plane-stress\""
                } else {
                    "spheres are \"solid\"; leave it out, or use dimension = 2"
                };
                self.conflict(
                    "deformable.condition",
                    format!("not a condition in dimension {}", scenario.dimension),
                    help,
                );
            }
            if options.update == DeformableUpdate::Lagged {
                let given = [
                    ("tolerance", options.tolerance.is_some()),
                    ("maximum_iterations", options.maximum_iterations.is_some()),
                    ("relaxation", options.relaxation.is_some()),
                ];
                for (key, given) in given {
                    if given {
                        let help = "write update = \"iterated\", or remove this key";
                        self.conflict(&format!("deformable.{key}"), "has no effect without iteration", help);
                    }
                }
            }
        }
        let Some(first) = first else { return };
        let key = format!("material[{first}].deformable");
        let laws = scenario.bonds.iter().map(|bonds| bonds.law).chain(scenario.contacts.law.law());
        for law in laws {
            if !law.facts().deforms {
                let message = format!("the law \"{}\" does not know deformable particles", law.key());
                let deforming = LawName::ALL.iter().filter(|law| law.facts().deforms);
                let quoted: Vec<String> = deforming.map(|law| format!("\"{}\"", law.key())).collect();
                let help = format!("use {}, or remove this table", listing(&quoted));
                self.conflict(&key, message, help);
            }
        }
        if !scenario.clumps.is_empty() {
            let help = "the forces inside a clump are not known; remove the clumps, or this table";
            self.conflict(&key, "members of clumps cannot deform", help);
        }
    }

    /// Every material that takes part must have parameters of the laws in use.
    fn laws(&mut self) {
        let scenario = self.scenario;
        let mut particle_materials = vec![scenario.materials[0].name.as_str()];
        particle_materials.extend(scenario.sets.iter().filter_map(|set| set.material.as_deref()));
        particle_materials.extend(scenario.clumps.iter().filter_map(|clump| clump.material.as_deref()));
        let mut touching_materials = particle_materials.clone();
        touching_materials.extend(scenario.walls.iter().map(|wall| wall.material.as_str()));
        if let Loading::Platens { material, .. } = &scenario.loading {
            touching_materials.push(material);
        }
        let mut wanted: Vec<(&str, LawName, &[&str])> = Vec::new();
        if let Some(bonds) = &scenario.bonds {
            if bonds.coordination.is_some() && bonds.interaction_ratio.si() != 1.0 {
                let help = "the ratio follows from the number of bonds: remove one of the two keys";
                self.conflict("bonds.interaction_ratio", "has no effect beside `coordination`", help);
            }
            wanted.push(("bonds.law", bonds.law, &particle_materials));
        }
        if let Some(law) = scenario.contacts.law.law() {
            wanted.push(("contacts.law", law, &touching_materials));
        } else {
            let help = "choose a contact law such as \"frictional\"";
            if !scenario.walls.is_empty() {
                self.conflict("contacts.law", "without a contact law particles pass through the walls", help);
            }
            if matches!(scenario.loading, Loading::Platens { .. }) {
                self.conflict("contacts.law", "without a contact law particles pass through the platens", help);
            }
        }
        for (at, material) in scenario.materials.iter().enumerate() {
            let lacking: Vec<_> = wanted
                .iter()
                .filter(|(_, law, names)| names.contains(&material.name.as_str()) && !material.has(*law))
                .collect();
            for (rank, (key, law, _)) in lacking.iter().enumerate() {
                if lacking[..rank].iter().any(|(_, other, _)| other == law) {
                    continue;
                }
                let law = law.key();
                let message = format!("material \"{}\" has no table of this law, which {key} asks for", material.name);
                let help = format!("add [material.{law}] below this [[material]]");
                self.add(ProblemKind::MissingKey, &format!("material[{at}].{law}"), message, help);
            }
        }
    }

    // ---------------------------------------------------------------------------------------------- loading

    fn loading(&mut self) {
        let scenario = self.scenario;
        let periodic = scenario.packing.is_periodic();
        let kind = scenario.loading.kind();
        if scenario.loading.drives_cell() && !periodic {
            let help = "give [packing.shape] kind = \"periodic\" (or a `cell` for spheres), or load by \"uniaxial\"";
            self.conflict("loading.kind", "there is no periodic cell to drive", help);
        }
        let by_ends = matches!(
            scenario.loading,
            Loading::Uniaxial { .. } | Loading::Platens { .. } | Loading::Bending { .. } | Loading::Torsion { .. }
        );
        if by_ends && periodic {
            let help = "load the cell by \"cell-strain\", or cut a specimen out with another [packing.shape]";
            self.conflict("loading.kind", format!("a periodic cell has no ends for \"{kind}\" loading"), help);
        }
        match &scenario.loading {
            Loading::None => {}
            Loading::Uniaxial { axis, strain_rate, layer_thickness, .. } => {
                if strain_rate.si() == 0.0 {
                    let help = "positive pulls, negative presses: strain_rate = \"0.4 1/s\"";
                    self.range("loading.strain_rate", "must not be zero", help);
                }
                if strain_rate.si() > 0.0 && scenario.bonds.is_none() {
                    let help = "add [bonds], or press with a negative strain rate";
                    self.conflict("loading.strain_rate", "nothing holds the particles together in tension", help);
                }
                let length = scenario.packing.shape().and_then(|shape| length_along(shape, *axis));
                if let (Some(thickness), Some(along)) = (layer_thickness, length)
                    && 2.0 * thickness.si() >= along
                {
                    let message = format!("two layers leave nothing of the specimen's {}", self::length(along));
                    let help = "one to three particle diameters are usual; check the units";
                    self.range("loading.layer_thickness", message, help);
                }
            }
            Loading::Bending { axis, about, rate, .. } => {
                if rate.si() == 0.0 {
                    self.range(
                        "loading.rate",
                        "must not be zero",
                        "the ends turn against each other: rate = \"1 rad/s\"",
                    );
                }
                if axis == about {
                    let help = "bend about an axis across the specimen";
                    self.conflict("loading.about", "is the axis of the specimen itself", help);
                }
                self.section("loading.kind", *axis);
            }
            Loading::Torsion { axis, rate, .. } => {
                if rate.si() == 0.0 {
                    self.range(
                        "loading.rate",
                        "must not be zero",
                        "the ends turn against each other: rate = \"1 rad/s\"",
                    );
                }
                if !matches!(scenario.packing.shape(), Some(Shape::Cylinder { axis: along, .. }) if along == axis) {
                    let help = "give [packing.shape] kind = \"cylinder\" with the same axis";
                    self.conflict("loading.kind", "torsion needs a cylinder along its axis for the stress", help);
                }
            }
            Loading::CellStrain { velocity_gradient } => {
                if velocity_gradient.iter().flatten().all(|rate| rate.si() == 0.0) {
                    let help = "rows are components of the velocity, columns directions; at least one is not zero";
                    self.range("loading.velocity_gradient", "must not be all zero", help);
                }
            }
            Loading::CellStress { stress, .. } => {
                for (row, column) in [(0, 1), (0, 2), (1, 2)] {
                    let (upper, lower) = (stress[row][column].si(), stress[column][row].si());
                    if (upper - lower).abs() > SYMMETRY * upper.abs().max(lower.abs()) {
                        let message = format!("must equal the component in row {row}, column {column}");
                        let help = "a stress of a cell in equilibrium is symmetric";
                        self.conflict(&format!("loading.stress[{column}][{row}]"), message, help);
                    }
                }
            }
            Loading::Platens { material, .. } => self.known_material("loading.material", material),
        }
        self.initial_field();
    }

    /// Where the loading sets the velocities at the start, nothing else does.
    fn initial_field(&mut self) {
        let scenario = self.scenario;
        let loading = &scenario.loading;
        let (translations, rotations) = match loading {
            Loading::Uniaxial { axis, initial_velocity_field: true, .. } => {
                (std::array::from_fn(|i| i == axis.index()), [false; 3])
            }
            Loading::Bending { initial_velocity_field: true, .. }
            | Loading::Torsion { initial_velocity_field: true, .. } => ([true; 3], [true; 3]),
            Loading::CellStrain { .. } => ([true; 3], [false; 3]),
            _ => return,
        };
        let help = if loading.drives_cell() {
            "particles of a driven cell start with its affine velocity; leave this out, or prescribe the motion"
        } else {
            "leave this out, or write initial_velocity_field = false in [loading]"
        };
        let mut given: Vec<(String, [f64; 3], [bool; 3])> = Vec::new();
        for (at, initial) in scenario.initials.iter().enumerate() {
            given.push((format!("initial[{at}].velocity"), components(&initial.velocity), translations));
            given.push((format!("initial[{at}].angular_velocity"), components(&initial.angular_velocity), rotations));
        }
        for (at, clump) in scenario.clumps.iter().enumerate() {
            let velocity = clump.velocity.as_ref().map_or([0.0; 3], components);
            let spin = clump.angular_velocity.as_ref().map_or([0.0; 3], components);
            given.push((format!("clump[{at}].velocity"), velocity, translations));
            given.push((format!("clump[{at}].angular_velocity"), spin, rotations));
        }
        let message = format!("\"{}\" loading sets this velocity at the start", loading.kind());
        for (key, value, set) in given {
            for i in 0..3 {
                if set[i] && value[i] != 0.0 {
                    self.conflict(&format!("{key}[{i}]"), &message, help);
                }
            }
        }
    }

    /// Bending needs a section whose moment of inertia is known.
    fn section(&mut self, key: &str, axis: Axis) {
        let known = match self.scenario.packing.shape() {
            Some(Shape::Box { .. }) => true,
            Some(Shape::Cylinder { axis: along, .. }) => *along == axis,
            _ => false,
        };
        if !known {
            let help = "give [packing.shape] kind = \"box\", or \"cylinder\" with the same axis";
            self.conflict(key, "bending needs a box, or a cylinder along its axis, for the stress", help);
        }
    }

    fn stop(&mut self) {
        let scenario = self.scenario;
        let stop = &scenario.stop;
        let never = stop.drop_to.is_none()
            && stop.strain.is_none()
            && stop.time.is_none()
            && stop.steps.is_none()
            && stop.unbalanced.is_none();
        if never {
            self.add(
                ProblemKind::MissingKey,
                "stop",
                "nothing ever stops the run",
                "add [stop] with at least one of `steps`, `time`, `strain`, `drop_to`, and `unbalanced`",
            );
        }
        if stop.drop_to.is_some() && matches!(scenario.loading, Loading::None | Loading::CellStress { .. }) {
            let help = "use it with \"uniaxial\", \"platens\", or \"cell-strain\" loading";
            self.conflict("stop.drop_to", "this loading has no peak stress to drop from", help);
        }
        if stop.strain.is_some() && matches!(scenario.loading, Loading::None) {
            let help = "stop by `time` or `steps`, or add [loading]";
            self.conflict("stop.strain", "without loading no strain is measured", help);
        }
    }

    // ---------------------------------------------------------------------------------------------- bodies

    fn corners(&mut self, path: &str, minimum: &[Length; 3], maximum: &[Length; 3]) {
        for at in 0..3 {
            if minimum[at].si() >= maximum[at].si() {
                let axis = ["x", "y", "z"][at];
                let message = format!("not less than `maximum` along {axis}");
                self.conflict(&format!("{path}.minimum[{at}]"), message, "exchange the two");
            }
        }
    }

    fn walls(&mut self) {
        let scenario = self.scenario;
        for (at, wall) in scenario.walls.iter().enumerate() {
            self.known_material(&format!("wall[{at}].material"), &wall.material);
            let path = format!("wall[{at}].shape");
            match &wall.shape {
                WallShape::Plane { normal, .. } if vector(normal).norm() == 0.0 => {
                    let help = "it points from the wall to the particles: normal = [0, 0, 1] for a floor";
                    self.range(&format!("{path}.normal"), "must not be zero", help);
                }
                WallShape::Box { minimum, maximum } => self.corners(&path, minimum, maximum),
                _ => {}
            }
        }
    }

    fn sets(&mut self) {
        let scenario = self.scenario;
        let names: Vec<&str> = scenario.sets.iter().map(|set| set.name.as_str()).collect();
        self.unique("set", &names);
        for (at, set) in scenario.sets.iter().enumerate() {
            if let Some(material) = &set.material {
                self.known_material(&format!("set[{at}].material"), material);
            }
            let path = format!("set[{at}].selection");
            match &set.selection {
                Selection::Box { minimum, maximum } => self.corners(&path, minimum, maximum),
                Selection::Ids { ids } => {
                    if let Packing::Spheres { spheres, .. } = &scenario.packing {
                        let listed: usize =
                            scenario.clumps.iter().filter_map(|clump| clump.spheres.as_ref()).map(Vec::len).sum();
                        let count = spheres.len() + listed;
                        if let Some((bad, _)) = ids.iter().enumerate().find(|(_, id)| **id as usize >= count) {
                            let message = format!("there are only {count} spheres");
                            let help = "spheres are numbered from 0";
                            self.range(&format!("{path}.ids[{bad}]"), message, help);
                        }
                    }
                }
                _ => {}
            }
        }
        for (at, prescribed) in scenario.prescribed.iter().enumerate() {
            self.known_set(&format!("prescribe[{at}].set"), &prescribed.set);
            let free = prescribed.velocity.iter().all(|component| *component == Component::Free)
                && prescribed.angular_velocity.iter().all(|component| *component == Component::Free);
            if free {
                let help = "give `velocity` or `angular_velocity`, with \"free\" for the components left to the forces";
                self.conflict(&format!("prescribe[{at}]"), "prescribes nothing", help);
            }
        }
        for (at, force) in scenario.forces.iter().enumerate() {
            self.known_set(&format!("force[{at}].set"), &force.set);
            if vector(&force.force).norm() == 0.0 && vector(&force.moment).norm() == 0.0 {
                self.conflict(
                    &format!("force[{at}]"),
                    "neither force nor moment",
                    "give `force` or `moment`, or remove it",
                );
            }
        }
        for (at, initial) in scenario.initials.iter().enumerate() {
            self.known_set(&format!("initial[{at}].set"), &initial.set);
        }
    }

    fn clumps(&mut self) {
        let scenario = self.scenario;
        if scenario.loading.drives_cell() && !scenario.clumps.is_empty() {
            let help = "rigid bodies do not follow the deformation of a driven cell; remove the clumps, or [loading]";
            let message = format!("a clump in a cell that \"{}\" loading drives", scenario.loading.kind());
            self.conflict("clump[0]", message, help);
        }
        for (at, clump) in scenario.clumps.iter().enumerate() {
            let path = format!("clump[{at}]");
            match (&clump.set, &clump.spheres) {
                (None, None) => self.add(
                    ProblemKind::MissingKey,
                    &path,
                    "neither `set` nor `spheres`",
                    "give `set` to join packed particles, or `spheres` to add some",
                ),
                (Some(_), Some(_)) => {
                    let help = "keep `set` to join packed particles, or `spheres` to add some";
                    self.conflict(&format!("{path}.set"), "both `set` and `spheres`", help);
                }
                (Some(set), None) => {
                    self.known_set(&format!("{path}.set"), set);
                    if clump.material.is_some() {
                        let help = "the particles have their material already; give it in [[set]]";
                        self.conflict(&format!("{path}.material"), "a material for particles of a set", help);
                    }
                }
                (None, Some(spheres)) => {
                    if spheres.is_empty() {
                        self.range(&format!("{path}.spheres"), "no spheres", "list at least one as [x, y, z, radius]");
                    }
                    // Spheres of one body may overlap.
                    self.spheres(&format!("{path}.spheres"), spheres, false);
                }
            }
            if let Some(material) = &clump.material {
                self.known_material(&format!("{path}.material"), material);
            }
            if let Some(inertia) = &clump.inertia {
                let [a, b, c] = inertia.map(Quantity::si);
                let key = format!("{path}.inertia");
                if a > b || b > c {
                    self.conflict(&key, "not in rising order", "write the smallest moment of inertia first");
                } else if c > (a + b) * (1.0 + SYMMETRY) {
                    let message = "no body has these: the largest exceeds the sum of the other two";
                    self.range(&key, message, "check their order and units, or leave `inertia` out");
                }
            }
        }
    }

    fn samples(&mut self) {
        let scenario = self.scenario;
        let names: Vec<&str> = scenario.samples.iter().map(super::OperatorSample::name).collect();
        for (at, sample) in scenario.samples.iter().enumerate() {
            let path = format!("sample[{at}]");
            // Without a name of its own a sample has that of its operator.
            let key = if sample.name.is_some() { format!("{path}.name") } else { format!("{path}.operator") };
            let name = names[at];
            if name.trim().is_empty() || name.contains('/') || name.starts_with('.') {
                self.range(&key, "no name for a group of the result", "use letters, digits, hyphens, and spaces");
            } else if names[..at].contains(&name) {
                let help = "give each its own: name = \"core stress\"";
                self.conflict(&key, "another [[sample]] has this name", help);
            } else if crate::schedule::Record::COLUMNS.iter().any(|column| column.name == name) {
                let help = format!("choose another, like \"{name} in the core\"");
                self.conflict(&key, "the result has a series of this name already", help);
            }
            let misuse = sample.misuse(scenario.dimension);
            let misused = misuse.is_some();
            if let Some(Misuse { key, message, help }) = misuse {
                self.conflict(&format!("{path}.{key}"), message, help);
            } else if let Some(wall) = &sample.wall {
                let names = scenario.wall_names();
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                self.known(&format!("{path}.wall"), "wall", wall, &names);
            }
            let region = format!("{path}.region");
            let needs_region = sample.operator != crate::schedule::Operator::WallTraction;
            match &sample.region {
                None | Some(SampleRegion::Cell) if needs_region && !misused && !scenario.packing.is_periodic() => {
                    let key = if sample.region.is_some() { &region } else { &path };
                    let help = "give region = { kind = \"box\", minimum = [...], maximum = [...] }, or another kind";
                    self.conflict(key, "the packing is not periodic: there is no cell to sample", help);
                }
                Some(SampleRegion::Box { minimum, maximum }) => self.corners(&region, minimum, maximum),
                Some(SampleRegion::Cylinder { axis, .. }) if vector(axis).norm() == 0.0 => {
                    self.range(&format!("{region}.axis"), "must not be zero", "axis = [0, 0, 1] is along z");
                }
                Some(SampleRegion::Set { set, .. }) => self.known_set(&format!("{region}.set"), set),
                Some(SampleRegion::Material { material, .. }) => {
                    self.known_material(&format!("{region}.material"), material);
                }
                Some(SampleRegion::HalfSpaces { planes, .. }) => {
                    if planes.is_empty() {
                        let help = "planes = [{ point = [0, 0, 0], normal = [0, 0, 1] }] is all below z = 0";
                        self.range(&format!("{region}.planes"), "no plane", help);
                    }
                    for (k, plane) in planes.iter().enumerate() {
                        if vector(&plane.normal).norm() == 0.0 {
                            let help = "it points out of the region: normal = [0, 0, 1] bounds it above";
                            self.range(&format!("{region}.planes[{k}].normal"), "must not be zero", help);
                        }
                    }
                }
                _ => {}
            }
        }
    }

    fn output(&mut self) {
        if let Some(file) = &self.scenario.output.file {
            let extension = Path::new(file).extension().and_then(|extension| extension.to_str());
            if !matches!(extension, Some("h5" | "hdf5" | "vtkhdf")) {
                let name = Path::new(file).with_extension("h5");
                let help = format!("write \"{}\"; csv = true writes the samples as CSV beside it", name.display());
                self.range("output.file", "a result file is HDF5", help);
            }
        }
    }

    // ---------------------------------------------------------------------------------------------- two dimensions

    /// Nothing leaves the plane z = 0 in two dimensions.
    fn plane(&mut self) {
        let scenario = self.scenario;
        let help = "with dimension = 2 all is in the plane z = 0 and rotates about z";
        if let Packing::RandomDense { .. } = &scenario.packing {
            self.conflict("packing.kind", "spheres in space", "use \"random-discs\", or dimension = 3");
        }
        if let Packing::Lattice { lattice, .. } = &scenario.packing
            && !lattice.is_planar()
        {
            let help = "use \"square\" or \"triangular\", or dimension = 3";
            self.conflict("packing.lattice", "not a planar lattice", help);
        }
        if let Packing::Spheres { spheres, .. } = &scenario.packing
            && let Some(at) = spheres.iter().position(|sphere| sphere[2].si() != 0.0)
        {
            self.conflict(&format!("packing.spheres[{at}][2]"), "not in the plane z = 0", help);
        }
        let mut bad: Vec<String> = Vec::new();
        for (at, clump) in scenario.clumps.iter().enumerate() {
            let spheres = clump.spheres.iter().flatten().enumerate();
            for (k, _) in spheres.filter(|(_, sphere)| sphere[2].si() != 0.0) {
                self.conflict(&format!("clump[{at}].spheres[{k}][2]"), "not in the plane z = 0", help);
            }
        }
        match &scenario.loading {
            Loading::Uniaxial { axis: Axis::Z, .. }
            | Loading::Platens { axis: Axis::Z, .. }
            | Loading::Bending { axis: Axis::Z, .. } => {
                let help = "write axis = \"x\" or axis = \"y\"";
                self.conflict("loading.axis", "loading along z in two dimensions", help);
            }
            Loading::Bending { about: Axis::X | Axis::Y, .. } => {
                self.conflict("loading.about", "the ends turn out of the plane", "write about = \"z\"");
            }
            Loading::Torsion { .. } => {
                let help = "use \"uniaxial\" or \"bending\", or dimension = 3";
                self.conflict("loading.kind", "torsion turns the ends out of the plane", help);
            }
            Loading::CellStrain { velocity_gradient } => {
                let row = velocity_gradient[2].iter().enumerate().filter(|(_, rate)| rate.si() != 0.0);
                bad.extend(row.map(|(column, _)| format!("loading.velocity_gradient[2][{column}]")));
            }
            Loading::CellStress { stress, .. } => {
                let row = stress[2].iter().enumerate().filter(|(_, component)| component.si() != 0.0);
                bad.extend(row.map(|(column, _)| format!("loading.stress[2][{column}]")));
            }
            _ => {}
        }
        let mut vectors: Vec<(String, [f64; 3], bool)> =
            vec![("integration.gravity".to_owned(), components(&scenario.integration.gravity), false)];
        for (at, wall) in scenario.walls.iter().enumerate() {
            vectors.push((format!("wall[{at}].velocity"), components(&wall.velocity), false));
        }
        for (at, one) in scenario.prescribed.iter().enumerate() {
            let value = |component: &Component<_>| component.si().unwrap_or(0.0);
            vectors.push((
                format!("prescribe[{at}].velocity"),
                std::array::from_fn(|i| value(&one.velocity[i])),
                false,
            ));
            let turn = std::array::from_fn(|i| one.angular_velocity[i].si().unwrap_or(0.0));
            vectors.push((format!("prescribe[{at}].angular_velocity"), turn, true));
        }
        for (at, one) in scenario.forces.iter().enumerate() {
            vectors.push((format!("force[{at}].force"), components(&one.force), false));
            vectors.push((format!("force[{at}].moment"), components(&one.moment), true));
        }
        for (at, one) in scenario.initials.iter().enumerate() {
            vectors.push((format!("initial[{at}].velocity"), components(&one.velocity), false));
            vectors.push((format!("initial[{at}].angular_velocity"), components(&one.angular_velocity), true));
        }
        for (at, one) in scenario.clumps.iter().enumerate() {
            let velocity = one.velocity.as_ref().map_or([0.0; 3], components);
            let spin = one.angular_velocity.as_ref().map_or([0.0; 3], components);
            vectors.push((format!("clump[{at}].velocity"), velocity, false));
            vectors.push((format!("clump[{at}].angular_velocity"), spin, true));
        }
        for (key, value, axial) in vectors {
            let forbidden: &[usize] = if axial { &[0, 1] } else { &[2] };
            bad.extend(forbidden.iter().filter(|&&i| value[i] != 0.0).map(|i| format!("{key}[{i}]")));
        }
        for key in bad {
            self.conflict(&key, "leads out of the plane", help);
        }
    }
}

fn components<D: Dimension>(quantities: &[Quantity<D>; 3]) -> [f64; 3] {
    quantities.map(Quantity::si)
}

/// Length of a shape along an axis, m.
fn length_along(shape: &Shape, along: Axis) -> Option<f64> {
    match shape {
        Shape::Box { size } => Some(size[along.index()].si()),
        Shape::Cylinder { radius, height, axis } | Shape::Hyperboloid { radius, height, axis, .. } => {
            Some(if *axis == along { height.si() } else { 2.0 * radius.si() })
        }
        Shape::Mesh { .. } | Shape::Periodic { .. } => None,
    }
}

/// A length for messages.
fn length(metres: f64) -> String {
    let (scale, unit) = if metres >= 1.0 {
        (1.0, "m")
    } else if metres >= 1e-4 {
        (1e3, "mm")
    } else {
        (1e6, "um")
    };
    let text = format!("{:.4}", metres * scale);
    format!("{} {unit}", text.trim_end_matches('0').trim_end_matches('.'))
}
