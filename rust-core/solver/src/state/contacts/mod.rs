//! Contacts: one contiguous block per law, sorted by particle index, hence along the space-filling curve.

mod order;

use std::any::Any;

use bytemuck::Pod;
use concordem_contact::columns::Item;
use rayon::prelude::*;

use super::columns::{Column, ColumnError, ColumnSink, ColumnSource, RowsOfReals};
use super::table::Table;
use crate::state::Particles;
use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::law::{ContactGeometry, ContactLaw, Field, Kinematics, LawState, Reference, Stiffness};

pub use super::pairs::{BrokenBond, ContactFlags, Pair};

/// Column of the length in a table of references, and in one of geometries.
const LENGTH: usize = 0;
const PREVIOUS_LENGTH: usize = 3;

/// All contacts under one law.
#[derive(Debug, Clone, Default)]
pub struct ContactBlock<L: ContactLaw> {
    /// Pair coefficients (part of the model; constant).
    pub rows: Vec<L>,
    /// The particles.
    pub pair: Vec<Pair>,
    /// Image, pair coefficients, flags.
    pub flags: Vec<ContactFlags>,
    /// Reference length and area.
    pub reference: Table<Reference>,
    /// Normal and length of the last step.
    pub previous: Table<PreviousGeometry>,
    /// History.
    pub history: Table<L::State>,
    /// Reference lengths of the bonds at the reference temperature, m; empty if bonds do not expand.
    pub rest_length: Vec<f64>,
    /// Largest factor on the stiffness by material, over all temperatures (part of the model); empty if it is constant.
    pub largest_factor: Vec<f64>,
}

/// One contact, whatever its law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactView {
    /// Particles.
    pub pair: Pair,
    /// Image, pair coefficients, flags.
    pub flags: ContactFlags,
    /// Reference length and area.
    pub reference: Reference,
    /// Normal and length of the last step.
    pub previous: PreviousGeometry,
}

impl<L: ContactLaw> ContactBlock<L> {
    /// An empty block with the given pair coefficients.
    pub fn new(rows: Vec<L>) -> Self {
        Self {
            rows,
            pair: Vec::new(),
            flags: Vec::new(),
            reference: Table::default(),
            previous: Table::default(),
            history: Table::default(),
            rest_length: Vec::new(),
            largest_factor: Vec::new(),
        }
    }

    /// Number of contacts, broken and inactive ones included.
    pub fn len(&self) -> usize {
        self.pair.len()
    }

    /// Whether there are no contacts.
    pub fn is_empty(&self) -> bool {
        self.pair.is_empty()
    }

    /// Add a contact without history; call [`Self::sort`] after the last one.
    pub fn push(&mut self, pair: Pair, flags: ContactFlags, reference: Reference, previous: PreviousGeometry) {
        self.pair.push(pair);
        self.flags.push(flags);
        self.reference.push(reference);
        self.previous.push(previous);
        self.history.push(L::State::default());
        if !self.rest_length.is_empty() {
            self.rest_length.push(reference.length);
        }
    }

    /// Geometry of contact `k`. With a wall, B has zero radius and infinite mass.
    #[inline(always)]
    pub fn geometry(&self, k: usize, particles: &Particles, with_wall: bool) -> ContactGeometry {
        let (a, b) = (self.pair[k].a as usize, self.pair[k].b as usize);
        let Reference { length: reference_length, area } = self.reference.get(k);
        ContactGeometry {
            reference_length,
            area,
            radius_a: particles.radius[a],
            radius_b: if with_wall { 0.0 } else { particles.radius[b] },
            mass_a: particles.mass[a],
            mass_b: if with_wall { f64::INFINITY } else { particles.mass[b] },
        }
    }
}

/// A block of contacts, whatever its law, for everything but the force evaluation.
pub trait Contacts: Send + Sync {
    /// Name of the law.
    fn law(&self) -> &'static str;
    /// Whether the law supports deformable particles ([`ContactLaw::DEFORMS`]).
    fn deforms(&self) -> bool;
    /// Whether the measure reads orientations (otherwise rotations of the step).
    fn reads_orientations(&self) -> bool;
    /// [`ContactLaw::READS_OLD_ELONGATION`].
    fn reads_old_elongation(&self) -> bool;
    /// Number of entries, broken and inactive ones included.
    fn len(&self) -> usize;
    /// Whether there are no contacts.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Contact `k`.
    fn view(&self, k: usize) -> ContactView;
    /// Largest stiffness of contact `k`.
    fn stiffness(&self, k: usize, particles: &Particles, with_wall: bool) -> Stiffness;
    /// Largest stiffness of contact `k` at its present overlap `overlap` (m), if that is beyond the overlap for which
    /// [`Self::stiffness`] holds.
    fn stiffness_at(&self, k: usize, particles: &Particles, with_wall: bool, overlap: f64) -> Stiffness;
    /// Largest stiffness of a contact with the pair coefficients `row` between particles of the given masses (kg) and
    /// radii (m; B is a wall with radius 0 and infinite mass) that meet at `speed` (m/s), and its overlap (m).
    fn impact(&self, row: u16, geometry: &ContactGeometry, speed: f64) -> (Stiffness, f64);
    /// [`ContactLaw::STIFFENS`].
    fn stiffens(&self) -> bool;
    /// Largest stiffness of a contact with the pair coefficients `row` up to the overlap `overlap` (m).
    fn compressed(&self, row: u16, geometry: &ContactGeometry, overlap: f64) -> Stiffness;
    /// Damage of contact `k`, 0 to 1.
    fn damage(&self, k: usize) -> f64;
    /// Fraction of its strength that contact `k` has lost, 0 to 1.
    fn lost_strength(&self, k: usize) -> f64;
    /// Add a contact without history; call [`Self::sort`] after the last one.
    fn push(&mut self, pair: Pair, flags: ContactFlags, reference: Reference, previous: PreviousGeometry);
    /// Add a contact with the history `history`, in the order of [`Self::history_fields`]; call [`Self::sort`] after the
    /// last one. Missing numbers are zero, surplus ones are ignored.
    fn push_with_history(
        &mut self,
        pair: Pair,
        flags: ContactFlags,
        reference: Reference,
        previous: PreviousGeometry,
        history: &[f64],
    );
    /// Sort by particles and image.
    fn sort(&mut self);
    /// Insert a contact without history into a sorted block.
    fn insert(&mut self, pair: Pair, flags: ContactFlags, reference: Reference, previous: PreviousGeometry);
    /// Particles of all contacts.
    fn pairs(&self) -> &[Pair];
    /// Flags of all contacts.
    fn flags(&self) -> &[ContactFlags];
    /// References of all contacts.
    fn references(&self) -> &Table<Reference>;
    /// Normals and lengths of all contacts in the last step.
    fn previous(&self) -> &Table<PreviousGeometry>;
    /// Replace the image of every contact by `image` of its particles and image.
    fn map_images(&mut self, image: &dyn Fn(Pair, [i8; 3]) -> [i8; 3]);
    /// Make room for `count` more contacts, and no more.
    fn reserve(&mut self, count: usize);
    /// Replace particles and flags of every contact by those of `relink`; remove the contacts for which it returns none.
    fn relink(&mut self, relink: &dyn Fn(Pair, ContactFlags) -> Option<(Pair, ContactFlags)>);
    /// Remove contacts, given in ascending order.
    fn remove(&mut self, removed: &[u32]);
    /// Keep only the contacts for whose flags `keep` holds.
    fn retain_where(&mut self, keep: &dyn Fn(&ContactFlags) -> bool);
    /// Keep the contacts of the pairs, with their images, for which `keep` holds.
    fn retain_pairs(&mut self, keep: &dyn Fn(Pair, [i8; 3]) -> bool);
    /// Cross-section of a bond with the pair coefficients `row`, m²; see [`ContactLaw::bonded_area`].
    fn bonded_area(&self, row: u16, radius_a: f64, radius_b: f64, mean_radius: f64) -> f64;
    /// Axial force of bond `k`, N, at its length in the last evaluation; see [`ContactLaw::axial_force`].
    fn axial_force(&self, k: usize, particles: &Particles) -> Option<f64>;
    /// Distances from the centers of A and B to the contact point of contact `k`, m, at the center distance `length` (m).
    fn arms(&self, k: usize, particles: &Particles, length: f64) -> (f64, f64);
    /// Release the bonds for which `condition` holds: they break at their next evaluation.
    fn release(&mut self, condition: &dyn Fn(&Pair) -> bool);
    /// Reference of an unbonded contact that begins; see [`ContactLaw::unbonded_reference`].
    fn unbonded_reference(&self, length: f64, radius_a: f64, radius_b: f64) -> Reference;
    /// Reference that the broken bond `k` leaves to the unbonded contact; see [`ContactLaw::kept_reference`].
    fn kept_reference(&self, k: usize) -> Option<Reference>;
    /// Center distance at which bond `k` is without normal force, m; see [`ContactLaw::unstrained_length`].
    fn unstrained_length(&self, k: usize, particles: &Particles) -> f64;
    /// Overlap at which a contact of parameter row `row` presses with `force` (N), m; see [`ContactLaw::overlap_under`].
    fn overlap_under(&self, row: u16, geometry: &ContactGeometry, force: f64) -> f64;
    /// Set the largest factors on the stiffness by material, over all temperatures; empty if it is constant.
    fn set_largest_factor(&mut self, by_material: &[f64]);
    /// Largest factor on the stiffness of contacts between two materials.
    fn largest_factor(&self, a: u16, b: u16) -> f64;
    /// Let the bonds expand: their present reference lengths belong to the reference temperature.
    fn begin_expansion(&mut self);
    /// Reference lengths of the bonds at the reference temperature, m, one per bond; a host sets them after it has moved bonds.
    fn rest_lengths_mut(&mut self) -> &mut Vec<f64>;
    /// Give each bond its reference length at the thermal strains `strain` of the particles ([`crate::heat::expansion`]).
    /// `continued`: the lengths of the last step move along.
    fn expand(&mut self, strain: &[f64], continued: bool);
    /// Fields of the history.
    fn history_fields(&self) -> &'static [Field];
    /// Number `n` of the histories of all contacts, in the order of [`Self::history_fields`]; a vector has three.
    fn history_column(&self, n: usize) -> &[f64];
    /// Write all columns under `path`.
    fn write(&self, path: &str, sink: &mut dyn ColumnSink) -> Result<(), ColumnError>;
    /// Replace all columns by those under `path`.
    fn read(&mut self, path: &str, source: &mut dyn ColumnSource) -> Result<(), ColumnError>;
    /// Memory per contact in bytes.
    fn bytes_per_contact(&self) -> usize;
    /// For downcasting to the typed block.
    fn as_any(&self) -> &dyn Any;
    /// For downcasting to the typed block.
    fn as_any_mut(&mut self) -> &mut dyn Any;
}

/// Write the contacts with history; candidates follow from the positions.
fn write_columns<L: ContactLaw>(
    block: &ContactBlock<L>,
    path: &str,
    sink: &mut dyn ColumnSink,
) -> Result<(), ColumnError> {
    let has_history = |flags: &ContactFlags| {
        flags.bits & (ContactFlags::ACTIVE | ContactFlags::KEPT_REFERENCE | ContactFlags::BROKEN) != 0
    };
    let mut only = ContactBlock::<L>::new(Vec::new());
    let block = if block.flags.iter().all(has_history) {
        block
    } else {
        only.clone_from(block);
        only.retain(has_history);
        &only
    };
    let u32s = |data, components| Column::U32 { data, components, unit: "1" };
    sink.column(&format!("{path}/pair"), u32s(bytemuck::cast_slice(&block.pair), 2))?;
    sink.column(
        &format!("{path}/link"),
        Column::U8 { data: bytemuck::cast_slice(&block.flags), components: 8, unit: "1" },
    )?;
    write_table(&block.reference, &format!("{path}/reference"), "m, m^2", sink)?;
    write_table(&block.previous, &format!("{path}/frame"), "1, 1, 1, m", sink)?;
    write_table(&block.history, &format!("{path}/history"), "see fields", sink)?;
    if block.rest_length.is_empty() {
        return Ok(());
    }
    sink.column(&format!("{path}/rest_length"), Column::f64(&block.rest_length, 1, "m"))
}

/// Write a table row by row.
fn write_table<T: Item + Pod>(
    table: &Table<T>,
    path: &str,
    unit: &'static str,
    sink: &mut dyn ColumnSink,
) -> Result<(), ColumnError> {
    // A law without memory has no history.
    if Table::<T>::WIDTH == 0 {
        return Ok(());
    }
    let rows =
        RowsOfReals { components: Table::<T>::WIDTH, unit, count: table.len(), numbers: &|rows| table.numbers(rows) };
    sink.rows(path, &rows)
}

impl<L: ContactLaw> Contacts for ContactBlock<L> {
    fn law(&self) -> &'static str {
        L::NAME
    }
    fn deforms(&self) -> bool {
        L::DEFORMS
    }
    fn reads_orientations(&self) -> bool {
        L::Kinematics::READS_ORIENTATIONS
    }
    fn reads_old_elongation(&self) -> bool {
        L::READS_OLD_ELONGATION
    }
    fn len(&self) -> usize {
        self.pair.len()
    }
    fn view(&self, k: usize) -> ContactView {
        ContactView {
            pair: self.pair[k],
            flags: self.flags[k],
            reference: self.reference.get(k),
            previous: self.previous.get(k),
        }
    }
    fn stiffness(&self, k: usize, particles: &Particles, with_wall: bool) -> Stiffness {
        let mut geometry = self.geometry(k, particles, with_wall);
        if !self.flags[k].has(ContactFlags::ACTIVE) && !self.flags[k].has(ContactFlags::KEPT_REFERENCE) {
            // A candidate is treated as if it touched now.
            let touching =
                L::unbonded_reference(geometry.radius_a + geometry.radius_b, geometry.radius_a, geometry.radius_b);
            geometry.reference_length = touching.length;
            geometry.area = touching.area;
        }
        self.rows[self.flags[k].row as usize].stiffness(&geometry)
    }
    fn stiffness_at(&self, k: usize, particles: &Particles, with_wall: bool, overlap: f64) -> Stiffness {
        let geometry = self.geometry(k, particles, with_wall);
        self.rows[self.flags[k].row as usize].stiffness_at(&geometry, overlap)
    }
    fn impact(&self, row: u16, geometry: &ContactGeometry, speed: f64) -> (Stiffness, f64) {
        let touching =
            L::unbonded_reference(geometry.radius_a + geometry.radius_b, geometry.radius_a, geometry.radius_b);
        let geometry = ContactGeometry { reference_length: touching.length, area: touching.area, ..*geometry };
        let law = &self.rows[row as usize];
        let overlap = law.impact_overlap(&geometry, speed);
        let stiffness = if overlap > 0.0 { law.stiffness_at(&geometry, overlap) } else { law.stiffness(&geometry) };
        (stiffness, overlap)
    }
    fn stiffens(&self) -> bool {
        L::STIFFENS
    }
    fn compressed(&self, row: u16, geometry: &ContactGeometry, overlap: f64) -> Stiffness {
        self.rows[row as usize].stiffness_at(geometry, overlap)
    }
    fn damage(&self, k: usize) -> f64 {
        L::damage(&self.history.get(k))
    }
    fn lost_strength(&self, k: usize) -> f64 {
        self.rows[self.flags[k].row as usize].lost_strength(&self.history.get(k))
    }
    fn push(&mut self, pair: Pair, flags: ContactFlags, reference: Reference, previous: PreviousGeometry) {
        Self::push(self, pair, flags, reference, previous);
    }
    fn push_with_history(
        &mut self,
        pair: Pair,
        flags: ContactFlags,
        reference: Reference,
        previous: PreviousGeometry,
        history: &[f64],
    ) {
        Self::push(self, pair, flags, reference, previous);
        self.history.set_numbers(self.len() - 1, history);
    }
    fn sort(&mut self) {
        Self::sort(self);
    }
    fn insert(&mut self, pair: Pair, flags: ContactFlags, reference: Reference, previous: PreviousGeometry) {
        Self::insert(self, pair, flags, reference, previous);
    }
    fn pairs(&self) -> &[Pair] {
        &self.pair
    }
    fn flags(&self) -> &[ContactFlags] {
        &self.flags
    }
    fn references(&self) -> &Table<Reference> {
        &self.reference
    }
    fn previous(&self) -> &Table<PreviousGeometry> {
        &self.previous
    }
    fn map_images(&mut self, image: &dyn Fn(Pair, [i8; 3]) -> [i8; 3]) {
        for (pair, flags) in self.pair.iter().zip(&mut self.flags) {
            flags.image = image(*pair, flags.image);
        }
    }
    fn retain_pairs(&mut self, keep: &dyn Fn(Pair, [i8; 3]) -> bool) {
        for (pair, flags) in self.pair.iter().zip(&mut self.flags) {
            flags.padding = u16::from(!keep(*pair, flags.image));
        }
        self.retain(|flags| flags.padding == 0);
    }
    fn reserve(&mut self, count: usize) {
        self.pair.reserve_exact(count);
        self.flags.reserve_exact(count);
        self.reference.reserve_exact(count);
        self.previous.reserve_exact(count);
        self.history.reserve_exact(count);
        if !self.rest_length.is_empty() {
            self.rest_length.reserve_exact(count);
        }
    }
    fn relink(&mut self, relink: &dyn Fn(Pair, ContactFlags) -> Option<(Pair, ContactFlags)>) {
        for (pair, flags) in self.pair.iter_mut().zip(&mut self.flags) {
            if let Some((new_pair, new_flags)) = relink(*pair, *flags) {
                (*pair, *flags) = (new_pair, ContactFlags { padding: 0, ..new_flags });
            } else {
                flags.padding = 1;
            }
        }
        self.retain(|flags| flags.padding == 0);
    }
    fn remove(&mut self, removed: &[u32]) {
        Self::remove(self, removed);
    }
    fn retain_where(&mut self, keep: &dyn Fn(&ContactFlags) -> bool) {
        self.retain(keep);
    }
    fn bonded_area(&self, row: u16, radius_a: f64, radius_b: f64, mean_radius: f64) -> f64 {
        self.rows[row as usize].bonded_area(radius_a, radius_b, mean_radius)
    }
    fn axial_force(&self, k: usize, particles: &Particles) -> Option<f64> {
        let geometry = self.geometry(k, particles, false);
        self.rows[self.flags[k].row as usize].axial_force(&geometry, self.previous.get(k).length)
    }
    fn arms(&self, k: usize, particles: &Particles, length: f64) -> (f64, f64) {
        L::Kinematics::arms(&self.geometry(k, particles, false), length)
    }
    fn release(&mut self, condition: &dyn Fn(&Pair) -> bool) {
        for (pair, flags) in self.pair.iter().zip(&mut self.flags) {
            if condition(pair) {
                flags.bits &= !ContactFlags::BONDED;
            }
        }
    }
    fn unbonded_reference(&self, length: f64, radius_a: f64, radius_b: f64) -> Reference {
        L::unbonded_reference(length, radius_a, radius_b)
    }
    fn kept_reference(&self, k: usize) -> Option<Reference> {
        self.rows[self.flags[k].row as usize].kept_reference(self.reference.get(k))
    }
    fn unstrained_length(&self, k: usize, particles: &Particles) -> f64 {
        self.rows[self.flags[k].row as usize].unstrained_length(&self.geometry(k, particles, false))
    }
    fn overlap_under(&self, row: u16, geometry: &ContactGeometry, force: f64) -> f64 {
        self.rows[row as usize].overlap_under(geometry, force)
    }
    fn set_largest_factor(&mut self, by_material: &[f64]) {
        self.largest_factor = by_material.to_vec();
    }
    fn largest_factor(&self, a: u16, b: u16) -> f64 {
        let of = |material: u16| self.largest_factor.get(material as usize).copied().unwrap_or(1.0);
        0.5 * (of(a) + of(b))
    }
    fn begin_expansion(&mut self) {
        self.rest_length = self.reference.column(LENGTH).to_vec();
    }
    fn rest_lengths_mut(&mut self) -> &mut Vec<f64> {
        &mut self.rest_length
    }
    fn expand(&mut self, strain: &[f64], continued: bool) {
        let Self { pair, flags, reference, previous, rest_length, .. } = self;
        let lengths = (reference.column_mut(LENGTH), previous.column_mut(PREVIOUS_LENGTH));
        let rows = pair.par_iter().zip(flags).zip(lengths.0).zip(lengths.1).zip(rest_length).with_min_len(1024);
        rows.for_each(|((((pair, flags), reference), previous), rest)| {
            // A bond that broke leaves its length to the contact that follows.
            if flags.has(ContactFlags::BROKEN) {
                return;
            }
            let length = *rest * (1.0 + 0.5 * (strain[pair.a as usize] + strain[pair.b as usize]));
            if continued {
                *previous += length - *reference;
            }
            *reference = length;
        });
    }
    fn history_fields(&self) -> &'static [Field] {
        L::State::FIELDS
    }
    fn history_column(&self, n: usize) -> &[f64] {
        self.history.column(n)
    }
    fn write(&self, path: &str, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        write_columns(self, path, sink)
    }
    fn read(&mut self, path: &str, source: &mut dyn ColumnSource) -> Result<(), ColumnError> {
        let pair = source.u32(&format!("{path}/pair"))?;
        let flags = source.u8(&format!("{path}/link"))?;
        let reference = source.f64(&format!("{path}/reference"))?;
        let previous = source.f64(&format!("{path}/frame"))?;
        let width = Table::<L::State>::WIDTH;
        let history = if width > 0 { source.f64(&format!("{path}/history"))? } else { Vec::new() };
        let count = pair.len() / 2;
        let rest = format!("{path}/rest_length");
        let rest_length = if source.exists(&rest) { source.f64(&rest)? } else { Vec::new() };
        if !rest_length.is_empty() && rest_length.len() != count {
            return Err(ColumnError::Length { path: rest, expected: count, found: rest_length.len() });
        }
        for (name, found, expected) in [
            ("link", flags.len(), 8 * count),
            ("reference", reference.len(), 2 * count),
            ("frame", previous.len(), 4 * count),
            ("history", history.len(), width * count),
        ] {
            if found != expected {
                return Err(ColumnError::Length { path: format!("{path}/{name}"), expected, found });
            }
        }
        self.pair = pair.chunks_exact(2).map(|p| Pair { a: p[0], b: p[1] }).collect();
        self.flags = flags.chunks_exact(8).map(bytemuck::pod_read_unaligned).collect();
        self.reference = Table::from_numbers(&reference);
        self.previous = Table::from_numbers(&previous);
        self.history = Table::from_numbers(&history);
        self.rest_length = rest_length;
        if let Some(bad) = self.flags.iter().position(|l| usize::from(l.row) >= self.rows.len()) {
            return Err(ColumnError::Value {
                path: format!("{path}/link"),
                row: bad,
                problem: "names pair coefficients that the scenario does not have".into(),
            });
        }
        Ok(())
    }
    fn bytes_per_contact(&self) -> usize {
        size_of::<Pair>()
            + size_of::<ContactFlags>()
            + size_of::<Reference>()
            + size_of::<PreviousGeometry>()
            + size_of::<L::State>()
    }
    fn as_any(&self) -> &dyn Any {
        self
    }
    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }
}
