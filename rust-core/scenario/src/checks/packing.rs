//! Checks of the packing: sizes, number of particles, and overlaps.

use std::path::Path;

use super::{Checker, length};
use crate::schema::quantity::{Length, vector};
use crate::schema::{Lattice, Packing, Radii, Shape};
use concordem_contact::math::{Mat3, Vec3};
use concordem_files::paths::is_hdf5;
use concordem_packing::Correction;
use concordem_solver::neighbor::{CandidatePair, candidate_pairs};
use concordem_solver::state::Cell;

/// Largest number of particles: identifiers have 32 bits.
const MOST_PARTICLES: f64 = u32::MAX as f64;
/// Overlap, as a fraction of the smaller radius, above which two listed spheres are considered a mistake. Without bonds, the
/// elastic energy of an overlap drives the pair apart at high speed; 0.01 allows for rounded coordinates.
pub(crate) const OVERLAP_UNBONDED: f64 = 0.01;
/// The same for bonded spheres, which are unstrained at the start in spite of an overlap: each reaches the center of the other.
pub(crate) const OVERLAP_BONDED: f64 = 1.0;
/// Overlap of bonded spheres from which the energy that their contact has once the bond breaks is worth a warning.
pub(crate) const OVERLAP_DEEP: f64 = 0.5;
/// Largest number of overlapping pairs that are reported individually.
const PAIRS_REPORTED: usize = 5;

impl Checker<'_> {
    pub(super) fn packing(&mut self) {
        let scenario = self.scenario;
        match &scenario.packing {
            Packing::RandomDense { count, radius, radii, shape, .. }
            | Packing::RandomDiscs { count, radius, radii, shape, .. } => {
                let discs = matches!(scenario.packing, Packing::RandomDiscs { .. });
                self.random_packing(*count, *radius, radii.as_ref(), shape, discs);
            }
            Packing::Cooker { .. } => self.cooker(),
            Packing::Growth { count, shape, .. } => self.growth(*count, shape),
            Packing::Lattice { lattice, radius, repeats, shape } => {
                self.lattice(*lattice, *radius, *repeats, shape.as_ref());
            }
            Packing::File { path, unit, cell, shape } => {
                if unit.is_some() && is_hdf5(Path::new(path)) {
                    let help = "remove the key: HDF5 sphere packs are in meters";
                    self.conflict("packing.unit", "has no effect on an HDF5 file", help);
                }
                if let Some(shape) = shape {
                    self.shape(shape, None, cell.is_some());
                }
            }
            Packing::Spheres { spheres, cell } => {
                if spheres.is_empty() && scenario.clumps.iter().all(|clump| clump.spheres.is_none()) {
                    self.range("packing.spheres", "no spheres", "list at least one as [x, y, z, radius]");
                }
                self.radii_of_spheres("packing.spheres", spheres);
                self.overlaps("packing.spheres", spheres, cell.as_ref());
                if let Some(cell) = cell {
                    self.cell_of_spheres(cell, spheres);
                }
            }
        }
    }

    fn random_packing(
        &mut self,
        count: u64,
        radius: Option<Length>,
        radii: Option<&Radii>,
        shape: &Shape,
        discs: bool,
    ) {
        let range = self.radius_or_radii(radius, radii);
        self.shape(shape, range, true);
        if let Shape::Periodic { tiles } = shape {
            if discs && tiles[2] != 1 {
                let help = format!("write tiles = [{}, {}, 1]", tiles[0], tiles[1]);
                self.conflict("packing.shape.tiles", "discs lie in one plane", help);
            }
            let total = tiles.iter().fold(count as f64, |total, n| total * *n as f64);
            self.few_enough("packing.shape.tiles", total);
        }
    }

    /// Checks that one of the two is given; returns the range of the radii, m.
    fn radius_or_radii(&mut self, radius: Option<Length>, radii: Option<&Radii>) -> Option<(f64, f64)> {
        match (radius, radii) {
            (None, None) => self.missing(
                "packing.radius",
                "gives neither `radius` nor `radii`",
                "add `radius = \"1 mm\"` for equal spheres, or [packing.radii] for a distribution",
            ),
            (Some(_), Some(_)) => self.conflict(
                "packing.radius",
                "gives both `radius` and `radii`",
                "keep `radius` for equal spheres, or [packing.radii] for a distribution",
            ),
            _ => {}
        }
        if let Some(radii) = radii {
            self.radii(radii);
        }
        radius.map(|radius| (radius.si(), radius.si())).or(radii.map(Radii::range))
    }

    fn cooker(&mut self) {
        let scenario = self.scenario;
        let Packing::Cooker { radius, radii, coordination, solid_fraction, overlap, correction, shape, .. } =
            &scenario.packing
        else {
            return;
        };
        let range = self.radius_or_radii(*radius, radii.as_ref());
        self.shape(shape, range, true);
        let wrong = matches!(shape, Shape::Periodic { .. } | Shape::Hyperboloid { .. });
        let help =
            "use \"box\", \"cylinder\", or \"mesh\"; \"random-dense\" makes periodic packings and cuts other shapes";
        self.vessel(shape, wrong.then_some("the cooker needs the walls of a box, a cylinder, or a closed mesh"), help);
        let given = [("coordination", coordination), ("solid_fraction", solid_fraction), ("overlap", overlap)];
        let given: Vec<&str> = given.iter().filter(|(_, value)| value.is_some()).map(|(key, _)| *key).collect();
        if let [first, second, ..] = given[..] {
            let message = format!("only one key can end the insertion; `{first}` does already");
            self.conflict(
                &format!("packing.{second}"),
                message,
                "keep one of `coordination`, `solid_fraction`, `overlap`",
            );
        }
        match (&scenario.bonds, correction) {
            (_, Correction::None) => {}
            (None, _) => {
                let help = "add [bonds] with a law, or remove the key";
                self.conflict("packing.correction", "determines the bonds, but there are none", help);
            }
            (Some(bonds), _) => {
                let help = "remove one of the two keys";
                if bonds.coordination.is_some() {
                    let message = "has no effect: `packing.correction` determines the bonds";
                    self.conflict("bonds.coordination", message, help);
                } else if bonds.interaction_ratio.si() != 1.0 {
                    let message = "has no effect: `packing.correction` determines the bonds";
                    self.conflict("bonds.interaction_ratio", message, help);
                }
            }
        }
    }

    fn growth(&mut self, count: u64, shape: &Shape) {
        let cube = matches!(shape, Shape::Box { size, .. } if size.iter().all(|edge| edge.si() == size[0].si()));
        self.vessel(
            shape,
            (!cube).then_some("spheres grow in cubes only"),
            "give a box with three equal edges; \"cooker\" fills other shapes",
        );
        self.few_enough("packing.count", count as f64);
    }

    /// Checks the shape of a packing between walls; `problem`: why it does not fit.
    fn vessel(&mut self, shape: &Shape, problem: Option<&'static str>, help: &str) {
        if let Some(problem) = problem {
            self.conflict("packing.shape.kind", problem, help);
        } else if shape.keep().is_some() {
            let message = "has no effect: walls keep the spheres inside, nothing is cut";
            self.conflict("packing.shape.keep", message, "remove the key");
        }
    }

    fn lattice(&mut self, lattice: Lattice, radius: Length, repeats: Option<[u64; 3]>, shape: Option<&Shape>) {
        if let Some(shape) = shape {
            self.shape(shape, Some((radius.si(), radius.si())), true);
        }
        if repeats.is_some() && shape.is_some_and(|shape| !matches!(shape, Shape::Periodic { .. })) {
            let help = "the lattice fills the shape: remove `repeats`, or remove the shape";
            self.conflict("packing.repeats", "has no effect with a shape", help);
        }
        match (repeats, shape) {
            (None, None | Some(Shape::Periodic { .. })) => self.missing(
                "packing.repeats",
                "the size of the lattice is missing",
                "add `repeats = [10, 10, 10]` (unit cells along x, y, z), or a [packing.shape] to fill",
            ),
            (Some(repeats), _) => {
                if lattice.is_planar() && repeats[2] != 1 {
                    let help = format!("write repeats = [{}, {}, 1]", repeats[0], repeats[1]);
                    self.conflict("packing.repeats", "a planar lattice has one layer along z", help);
                }
                // A unit cell has at most 4 particles (face-centered cubic).
                self.few_enough("packing.repeats", repeats.iter().fold(4.0, |total, n| total * *n as f64));
            }
            _ => {}
        }
    }

    fn cell_of_spheres(&mut self, cell: &[Length; 3], spheres: &[[Length; 4]]) {
        let largest = spheres.iter().fold(0.0_f64, |largest, sphere| largest.max(sphere[3].si()));
        for (at, edge) in cell.iter().enumerate() {
            if edge.si() <= 2.0 * largest {
                let message = format!("the cell is not wider than the largest sphere ({})", length(2.0 * largest));
                let help = "a sphere would touch its own image; make the cell wider";
                self.range(&format!("packing.cell[{at}]"), message, help);
            }
        }
    }

    fn few_enough(&mut self, key: &str, count: f64) {
        if count.is_finite() && count > MOST_PARTICLES {
            let message = format!("about {count:.1e} particles exceed the largest number, {MOST_PARTICLES:.1e}");
            self.range(key, message, "check the units of the sizes and radii; plain numbers are meters");
        }
    }

    fn radii(&mut self, radii: &Radii) {
        match radii {
            Radii::Uniform { minimum, maximum } | Radii::LogNormal { minimum, maximum, .. }
                if minimum.si() > maximum.si() =>
            {
                self.conflict("packing.radii.minimum", "is larger than `maximum`", "swap the two");
            }
            Radii::LogNormal { median, minimum, maximum, .. }
                if median.si() < minimum.si() || median.si() > maximum.si() =>
            {
                let help = "choose limits on both sides of the median";
                self.conflict("packing.radii.median", "is not between `minimum` and `maximum`", help);
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

    /// Checks a shape that is cut out of a packing; `radii`: range of the radii (m), if known.
    fn shape(&mut self, shape: &Shape, radii: Option<(f64, f64)>, has_cell: bool) {
        match shape {
            Shape::Hyperboloid { radius, waist_radius, .. } if waist_radius.si() > radius.si() => {
                let help = "the waist is the narrowest part; use a cylinder for a straight specimen";
                self.conflict("packing.shape.waist_radius", "is larger than the radius at the ends", help);
            }
            Shape::Periodic { .. } if !has_cell => {
                let help = "add `cell = [...]` with the edge lengths of the periodic cell of the file";
                self.conflict("packing.shape.kind", "the packing has no periodic cell", help);
            }
            _ => {}
        }
        let Some((smallest, largest)) = radii else { return };
        for (key, width) in widths(shape) {
            // In two dimensions the size along z is ignored.
            if width < 2.0 * largest && !(self.scenario.dimension == 2 && key.ends_with("size[2]")) {
                let message = format!("is narrower than a particle ({})", length(2.0 * largest));
                self.range(&key, message, "check the units; plain numbers are meters");
            }
        }
        if let Some(volume) = volume(shape) {
            self.few_enough("packing.shape", volume / (4.0 * smallest * smallest * smallest));
        }
    }

    /// Checks the radii of listed spheres.
    pub(super) fn radii_of_spheres(&mut self, key: &str, spheres: &[[Length; 4]]) {
        for (at, sphere) in spheres.iter().enumerate() {
            if sphere[3].si() <= 0.0 {
                let message = "the radius must be greater than 0";
                self.range(&format!("{key}[{at}][3]"), message, "a sphere is [x, y, z, radius]");
            }
        }
    }

    /// Checks overlaps between listed spheres, also across the border of the periodic cell.
    fn overlaps(&mut self, key: &str, spheres: &[[Length; 4]], cell: Option<&[Length; 3]>) {
        let bonded = self.scenario.bonds.as_ref().is_some_and(|bonds| bonds.at_start);
        if !self.scenario.contacts.exclude.is_empty() {
            // Which spheres touch depends on their materials, which the assembly finds.
            return;
        }
        let allowed = if bonded { OVERLAP_BONDED } else { OVERLAP_UNBONDED };
        let found = overlapping_pairs(spheres, cell, allowed);
        let count = found.len();
        for Overlap { a, b, across, depth } in found.into_iter().take(PAIRS_REPORTED) {
            let others = if count > PAIRS_REPORTED { format!(" ({count} pairs overlap)") } else { String::new() };
            let border = if across { " across the border of the cell" } else { "" };
            let message = format!("overlaps sphere {a}{border} by {}{others}", length(depth));
            let help = if bonded {
                "move it or make it smaller; bonded spheres may overlap by the smaller radius"
            } else {
                "move it or make it smaller; to let spheres overlap, join them in a [[clump]]"
            };
            self.conflict(&format!("{key}[{b}]"), message, help);
        }
    }

    /// Warns about listed bonded spheres that overlap deeply.
    pub(super) fn deep_overlaps(&mut self) {
        let scenario = self.scenario;
        let Packing::Spheres { spheres, cell } = &scenario.packing else { return };
        let bonded = scenario.bonds.as_ref().is_some_and(|bonds| bonds.at_start);
        if !bonded || scenario.contacts.law.law().is_none() || !scenario.contacts.exclude.is_empty() {
            return;
        }
        let found = overlapping_pairs(spheres, cell.as_ref(), OVERLAP_DEEP);
        let Some(Overlap { a, b, depth, .. }) = found.first() else { return };
        let message = format!(
            "overlaps sphere {a} by {}; {} bonded pairs overlap by more than half of the smaller radius",
            length(*depth),
            found.len()
        );
        let help = "bonds start without force, but a contact that follows a broken bond pushes the spheres apart; \
                    check positions and radii, or write law = \"none\" in [contacts]";
        self.warn(&format!("packing.spheres[{b}]"), message, help);
    }
}

/// Two spheres that overlap.
struct Overlap {
    a: usize,
    b: usize,
    /// Whether the sphere `a` overlaps a periodic image of `b`.
    across: bool,
    /// Depth of the overlap, m.
    depth: f64,
}

/// Pairs of spheres that overlap by more than the fraction `allowed` of the smaller radius, in ascending order.
fn overlapping_pairs(spheres: &[[Length; 4]], cell: Option<&[Length; 3]>, allowed: f64) -> Vec<Overlap> {
    let position: Vec<Vec3> = spheres.iter().map(|s| Vec3::new(s[0].si(), s[1].si(), s[2].si())).collect();
    // Other checks report radii and edges that are not positive.
    let radius: Vec<f64> = spheres.iter().map(|sphere| sphere[3].si().max(0.0)).collect();
    let cell = cell.map(|edges| Cell::new(Mat3::from_diagonal(&vector(edges))));
    let Ok(pairs) = candidate_pairs(&position, &radius, cell.as_ref()) else { return Vec::new() };
    let overlap = |pair: CandidatePair| {
        let (a, b) = (pair.a as usize, pair.b as usize);
        let shift = cell.map_or_else(Vec3::zeros, |cell| cell.shift(pair.image));
        let depth = radius[a] + radius[b] - (position[b] + shift - position[a]).norm();
        let deep = radius[a] > 0.0 && radius[b] > 0.0 && depth > allowed * radius[a].min(radius[b]);
        // Another check reports a cell so narrow that a sphere touches its own image.
        (deep && a != b).then_some(Overlap { a, b, across: pair.image != [0; 3], depth })
    };
    pairs.into_iter().filter_map(overlap).collect()
}

/// A lower bound on the volume of a shape, m³, if it is known without reading a file.
fn volume(shape: &Shape) -> Option<f64> {
    match shape {
        Shape::Box { size, .. } => Some(size.iter().map(|edge| edge.si()).product()),
        Shape::Cylinder { radius, height, .. } => Some(3.0 * radius.si() * radius.si() * height.si()),
        Shape::Hyperboloid { radius, waist_radius, height, .. } => {
            Some(3.0 * waist_radius.si() * radius.si() * height.si())
        }
        Shape::Mesh { .. } | Shape::Periodic { .. } => None,
    }
}

/// Widths of a shape, m, with their keys.
fn widths(shape: &Shape) -> Vec<(String, f64)> {
    match shape {
        Shape::Box { size, .. } => {
            size.iter().enumerate().map(|(at, edge)| (format!("packing.shape.size[{at}]"), edge.si())).collect()
        }
        Shape::Cylinder { radius, height, .. } => {
            vec![
                ("packing.shape.radius".to_owned(), 2.0 * radius.si()),
                ("packing.shape.height".to_owned(), height.si()),
            ]
        }
        Shape::Hyperboloid { waist_radius, height, .. } => vec![
            ("packing.shape.waist_radius".to_owned(), 2.0 * waist_radius.si()),
            ("packing.shape.height".to_owned(), height.si()),
        ],
        Shape::Mesh { .. } | Shape::Periodic { .. } => Vec::new(),
    }
}
