//! Tables of particles and contacts in a result, for the final state of a run.

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::law::Reference;
use concordem_contact::math::Vec3;
use concordem_scenario::sampling::rotation_vector;
use concordem_solver::Strengths;
use concordem_solver::joints::Joints;
use concordem_solver::record::{Forces, WallForces};
use concordem_solver::state::State;
use concordem_solver::state::columns::{Column, ColumnError, ColumnSink, WriteColumns};
use concordem_solver::state::contacts::{BrokenBond, ContactFlags, ContactView, Contacts, Pair, is_open};
use rayon::prelude::*;

/// Tables of a state: `particles/…` with one row per particle in the order of ids, `cell/…`, `contacts/LAW/…` with one row
/// per bond, including broken ones, `contacts/unbonded_LAW/…`, `contacts/walls/…`.
pub(in crate::program) struct Tables<'a> {
    pub state: &'a State,
    /// Displacement of every particle since the start, m, in the state's order.
    pub displacement: &'a [Vec3],
    /// Forces of all contacts of the state.
    pub forces: &'a Forces,
    /// Factors on the strengths of the bonds.
    pub strengths: &'a Strengths,
    /// Joints between the particles.
    pub joints: &'a Joints,
}

impl WriteColumns for Tables<'_> {
    fn write(&self, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        let particles = &self.state.particles;
        let mut order: Vec<usize> = (0..particles.len()).collect();
        order.par_sort_by_key(|&p| particles.id[p]);
        sink.column("particles/id", Column::u32(&picked(&order, |p| particles.id[p])))?;
        let positions = self.state.unwrapped_positions();
        let vectors = [
            ("position", &positions[..], "m"),
            ("displacement", self.displacement, "m"),
            ("velocity", &particles.velocity, "m/s"),
            ("angular_velocity", &particles.angular_velocity, "rad/s"),
        ];
        for (name, values, unit) in vectors {
            let rows = picked(&order, |p| values[p]);
            sink.column(&format!("particles/{name}"), Column::f64(bytemuck::cast_slice(&rows), 3, unit))?;
        }
        let damage = bond_damage(self.state);
        let scalars =
            [("radius", &particles.radius[..], "m"), ("mass", &particles.mass, "kg"), ("damage", &damage, "1")];
        for (name, values, unit) in scalars {
            sink.column(&format!("particles/{name}"), Column::f64(&picked(&order, |p| values[p]), 1, unit))?;
        }
        sink.column("particles/material", Column::u16(&picked(&order, |p| particles.material[p])))?;
        if !particles.aggregate.is_empty() {
            sink.column("particles/aggregate", Column::u32(&picked(&order, |p| particles.aggregate[p])))?;
        }
        if !self.strengths.by_particle.is_empty() {
            let factors = picked(&order, |p| self.strengths.of_particle(particles.id[p]));
            sink.column("particles/strength_factor", Column::f64(&factors, 1, "1"))?;
        }
        let fragments = concordem_solver::fracture::fragments::fragments(self.state);
        sink.column("particles/fragment", Column::u32(&picked(&order, |p| fragments[p])))?;
        sink.column("particles/sets", Column::u64(&picked(&order, |p| particles.tags[p])))?;
        let rotation = picked(&order, |p| rotation_vector(&particles.orientation[p]));
        sink.column("particles/rotation", Column::f64(bytemuck::cast_slice(&rotation), 3, "rad"))?;
        sink.column("particles/prescribed", Column::u8(&picked(&order, |p| particles.constraint[p].0)))?;
        if let Some(cell) = &self.state.cell {
            for (name, matrix, unit) in [
                ("edges", &cell.matrix, "m"),
                ("deformation_gradient", &cell.deformation_gradient, "1"),
                ("velocity_gradient", &cell.velocity_gradient, "1/s"),
            ] {
                let rows = matrix.transpose();
                sink.column(&format!("cell/{name}"), Column::f64(rows.as_slice(), 3, unit))?;
            }
        }
        let ends = &self.forces.contacts.block_end;
        let (mut from, mut first) = (0, 0);
        for (place, (block, &end)) in self.state.bonds.iter().zip(ends).enumerate() {
            let broken: Vec<BrokenBond> =
                self.state.broken_bonds().filter(|bond| bond.block as usize == place).copied().collect();
            let rows = Rows { forces: from..end, first };
            contacts(self.state, block.contacts(), &broken, block.law(), self.forces, rows, sink)?;
            if !self.joints.is_empty() {
                joint_numbers(self.state, block.contacts(), &broken, self.joints, block.law(), sink)?;
            }
            if !self.strengths.are_equal() {
                strength_factors(self.state, block.contacts(), &broken, self.strengths, block.law(), sink)?;
            }
            (from, first) = (end, first + block.len());
        }
        if let Some(block) = &self.state.contacts {
            let end = ends.last().copied().unwrap_or(from);
            contacts(
                self.state,
                block.contacts(),
                &[],
                &format!("{UNBONDED}{}", block.law()),
                self.forces,
                Rows { forces: from..end, first },
                sink,
            )?;
        }
        if !self.state.walls.is_empty() {
            walls(self.state, &self.forces.walls, sink)?;
        }
        Ok(())
    }
}

/// The value of each particle, in this order.
fn picked<T: Send>(order: &[usize], value: impl Fn(usize) -> T + Sync) -> Vec<T> {
    order.par_iter().with_min_len(SMALL).map(|&p| value(p)).collect()
}

/// Fewest rows that a thread computes at a time.
const SMALL: usize = 1 << 12;

/// Prefix of the table of unbonded contacts, before the name of their law.
pub(in crate::program) const UNBONDED: &str = "unbonded_";
/// Name of the table of contacts with walls.
pub(in crate::program) const WALLS: &str = "walls";

fn walls(state: &State, forces: &WallForces, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
    let ids: Vec<u32> = forces.particle.iter().map(|&p| state.particles.id[p as usize]).collect();
    let path = |name: &str| format!("contacts/{WALLS}/{name}");
    sink.column(&path("id"), Column::u32(&ids))?;
    sink.column(&path("wall"), Column::u32(&forces.wall))?;
    let points: Vec<Vec3> =
        forces.particle.iter().zip(&forces.point).map(|(&p, x)| x + state.unwrapping(p as usize)).collect();
    for (name, values, unit) in
        [("position", &points, "m"), ("force", &forces.force, "N"), ("moment", &forces.moment, "N m")]
    {
        sink.column(&path(name), Column::f64(bytemuck::cast_slice(values), 3, unit))?;
    }
    Ok(())
}

/// A row of a table of contacts.
struct Row {
    pair: Pair,
    branch: Vec3,
    position: Vec3,
    force: Vec3,
    moment: Vec3,
    previous: PreviousGeometry,
    reference: Reference,
    damage: f64,
    lost_strength: f64,
    broken: bool,
}

/// Location of a block's forces in [`Forces`].
struct Rows {
    /// Range of the contacts that carry force.
    forces: std::ops::Range<usize>,
    /// Index of the block's first contact among all contacts.
    first: usize,
}

/// One row per bond, broken bonds last and without history, and per unbonded contact with a force. Force and moment act on
/// the first particle, the moment about `position`.
fn contacts(
    state: &State,
    block: &dyn Contacts,
    broken: &[BrokenBond],
    name: &str,
    forces: &Forces,
    rows: Rows,
    sink: &mut dyn ColumnSink,
) -> Result<(), ColumnError> {
    let Rows { forces: rows, first } = rows;
    let particles = &state.particles;
    let bonded = !name.starts_with(UNBONDED);
    let forces = &forces.contacts;
    // Index of the force of every contact; `usize::MAX` without a force.
    let mut row_of = vec![usize::MAX; block.len()];
    for row in rows {
        row_of[forces.place[row] as usize] = row;
    }
    let shown: Vec<usize> = (0..block.len()).filter(|&k| bonded || row_of[k] != usize::MAX).collect();
    let branch_of = |pair: Pair, image: [i8; 3]| {
        let shift = state.cell.map_or_else(Vec3::zeros, |cell| cell.shift(image));
        particles.position[pair.b as usize] + shift - particles.position[pair.a as usize]
    };
    let live = |&k: &usize| {
        let ContactView { pair, flags, reference, previous } = block.view(k);
        let branch = branch_of(pair, flags.image);
        let carried = (row_of[k] != usize::MAX).then_some(row_of[k]);
        let (position, force, moment) = carried.map_or_else(
            || {
                let (arm, _) = block.arms(k, particles, branch.norm());
                (particles.position[pair.a as usize] + branch.normalize() * arm, Vec3::zeros(), Vec3::zeros())
            },
            |row| (forces.point[row], forces.force[row], forces.moment[row]),
        );
        // Damage at the same positions as the force.
        let [damage, lost_strength] = forces.damage.get(first + k).copied().unwrap_or_default();
        let position = position + state.unwrapping(pair.a as usize);
        Row { pair, branch, position, force, moment, previous, reference, damage, lost_strength, broken: false }
    };
    let gone = |&BrokenBond { pair, image, reference, previous, .. }: &BrokenBond| Row {
        pair,
        branch: branch_of(pair, image),
        // Half way between its particles.
        position: particles.position[pair.a as usize]
            + state.unwrapping(pair.a as usize)
            + branch_of(pair, image) * 0.5,
        force: Vec3::zeros(),
        moment: Vec3::zeros(),
        previous,
        reference,
        damage: 1.0,
        lost_strength: 1.0,
        broken: true,
    };
    let path = |column: &str| format!("contacts/{name}/{column}");
    let mut columns = RowColumns::with_capacity(shown.len() + broken.len());
    shown.chunks(ROWS_AT_A_TIME).for_each(|part| columns.extend(part, live, &particles.id));
    columns.extend(broken, gone, &particles.id);
    columns.write(&path, sink)?;
    let mut offset = 0;
    for field in block.history_fields() {
        // Broken bonds keep zeros.
        let mut values = vec![0.0; field.components * (shown.len() + broken.len())];
        values.par_chunks_mut(field.components).zip(&shown).with_min_len(SMALL).for_each(|(row, &k)| {
            for (n, number) in row.iter_mut().enumerate() {
                *number = block.history_column(offset + n)[k];
            }
        });
        sink.column(&path(&format!("history_{}", field.name)), Column::f64(&values, field.components, field.unit))?;
        offset += field.components;
    }
    Ok(())
}

/// Numbers of the tables of the joints that bonds lie across, broken bonds last.
fn joint_numbers(
    state: &State,
    block: &dyn Contacts,
    broken: &[BrokenBond],
    joints: &Joints,
    name: &str,
    sink: &mut dyn ColumnSink,
) -> Result<(), ColumnError> {
    let id = |p: u32| state.particles.id[p as usize];
    let of = |pair: Pair| joints.table_between([id(pair.a), id(pair.b)]).unwrap_or(u16::MAX);
    let pairs = block.pairs().iter().copied().chain(broken.iter().map(|bond| bond.pair));
    let numbers: Vec<u16> = pairs.map(of).collect();
    sink.column(&format!("contacts/{name}/joint"), Column::u16(&numbers))
}

/// Factors on the strengths of bonds, broken bonds last.
fn strength_factors(
    state: &State,
    block: &dyn Contacts,
    broken: &[BrokenBond],
    strengths: &Strengths,
    name: &str,
    sink: &mut dyn ColumnSink,
) -> Result<(), ColumnError> {
    let of = |pair, reference: Reference| strengths.of_bond(&state.particles, pair, reference.area);
    let mut values: Vec<f64> = Vec::with_capacity(block.len() + broken.len());
    values.extend((0..block.len()).map(|k| of(block.view(k).pair, block.view(k).reference)));
    values.extend(broken.iter().map(|bond| of(bond.pair, bond.reference)));
    sink.column(&format!("contacts/{name}/strength_factor"), Column::f64(&values, 1, "1"))
}

/// Rows that are computed before they are divided into columns: few enough to stay in the caches.
const ROWS_AT_A_TIME: usize = 1 << 15;

/// A column that all laws share: its name, its unit, and what a row has there.
struct ColumnOf<T> {
    name: &'static str,
    unit: &'static str,
    of: fn(&Row) -> T,
}

/// Columns of vectors.
const VECTORS: [ColumnOf<Vec3>; 5] = [
    ColumnOf { name: "position", unit: "m", of: |row| row.position },
    ColumnOf { name: "branch", unit: "m", of: |row| row.branch },
    ColumnOf { name: "force", unit: "N", of: |row| row.force },
    ColumnOf { name: "moment", unit: "N m", of: |row| row.moment },
    ColumnOf { name: "normal", unit: "1", of: |row| row.previous.normal },
];

/// Columns of numbers.
const SCALARS: [ColumnOf<f64>; 5] = [
    ColumnOf { name: "length", unit: "m", of: |row| row.previous.length },
    ColumnOf { name: "reference_length", unit: "m", of: |row| row.reference.length },
    ColumnOf { name: "area", unit: "m^2", of: |row| row.reference.area },
    ColumnOf { name: "damage", unit: "1", of: |row| row.damage },
    ColumnOf { name: "lost_strength", unit: "1", of: |row| row.lost_strength },
];

/// The columns that all laws share.
struct RowColumns {
    /// Rows computed last, whose memory is used again.
    rows: Vec<Row>,
    ids: Vec<[u32; 2]>,
    /// [`VECTORS`].
    vectors: [Vec<Vec3>; VECTORS.len()],
    /// [`SCALARS`].
    scalars: [Vec<f64>; SCALARS.len()],
    broken: Vec<u8>,
}

impl RowColumns {
    fn with_capacity(count: usize) -> Self {
        Self {
            rows: Vec::new(),
            ids: Vec::with_capacity(count),
            vectors: std::array::from_fn(|_| Vec::with_capacity(count)),
            scalars: std::array::from_fn(|_| Vec::with_capacity(count)),
            broken: Vec::with_capacity(count),
        }
    }

    /// Adds the rows of these contacts; `id`: ids of the particles.
    fn extend<T: Sync>(&mut self, contacts: &[T], row: impl Fn(&T) -> Row + Send + Sync, id: &[u32]) {
        contacts.par_iter().with_min_len(SMALL).map(row).collect_into_vec(&mut self.rows);
        let rows = || self.rows.par_iter().with_min_len(SMALL);
        self.ids.par_extend(rows().map(|row| [row.pair.a, row.pair.b].map(|p| id[p as usize])));
        for (column, of) in self.vectors.iter_mut().zip(VECTORS) {
            column.par_extend(rows().map(of.of));
        }
        for (column, of) in self.scalars.iter_mut().zip(SCALARS) {
            column.par_extend(rows().map(of.of));
        }
        self.broken.par_extend(rows().map(|row| u8::from(row.broken)));
    }

    fn write(&self, path: &dyn Fn(&str) -> String, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        sink.column(&path("ids"), Column::U32 { data: self.ids.as_flattened(), components: 2, unit: "1" })?;
        for (values, ColumnOf { name, unit, .. }) in self.vectors.iter().zip(VECTORS) {
            sink.column(&path(name), Column::f64(bytemuck::cast_slice(values), 3, unit))?;
        }
        for (values, ColumnOf { name, unit, .. }) in self.scalars.iter().zip(SCALARS) {
            sink.column(&path(name), Column::f64(values, 1, unit))?;
        }
        sink.column(&path("broken"), Column::u8(&self.broken))
    }
}

/// Mean damage of the bonds of each particle; broken bonds count as 1. 0 for particles without bonds.
pub(in crate::program) fn bond_damage(state: &State) -> Vec<f64> {
    let mut sum = vec![0.0; state.particles.len()];
    let mut count = vec![0.0; state.particles.len()];
    let mut add = |pair: Pair, damage: f64| {
        for p in [pair.a, pair.b] {
            sum[p as usize] += damage;
            count[p as usize] += 1.0;
        }
    };
    for block in &state.bonds {
        (0..block.len()).for_each(|k| add(block.view(k).pair, block.damage(k)));
    }
    state.broken_bonds().for_each(|bond| add(bond.pair, 1.0));
    sum.iter().zip(&count).map(|(sum, count)| if *count > 0.0 { sum / count } else { 0.0 }).collect()
}

/// All bonds, also broken ones, for a snapshot.
#[derive(Default)]
pub(in crate::program) struct BondRows {
    /// Ids of the particles.
    pub ids: Vec<[u32; 2]>,
    /// Damage; 1 for broken bonds.
    pub damage: Vec<f64>,
    /// Force along the bond, N, positive in tension.
    pub normal_force: Vec<f64>,
    /// Magnitude of the force across the bond, N.
    pub shear_force: Vec<f64>,
    /// Length less the reference length, m.
    pub opening: Vec<f64>,
    /// Whether the bond has broken.
    pub broken: Vec<u8>,
    /// Branch vectors, m.
    pub branch: Vec<Vec3>,
}

impl BondRows {
    /// The bonds of a state; `forces`: those of all its contacts.
    pub(in crate::program) fn of(state: &State, forces: &Forces) -> Self {
        let mut rows = Self::default();
        let (mut from, mut first) = (0, 0);
        for (block, &end) in state.bonds.iter().zip(&forces.contacts.block_end) {
            let mut force = vec![Vec3::zeros(); block.len()];
            for row in from..end {
                force[forces.contacts.place[row] as usize] = forces.contacts.force[row];
            }
            for (k, force) in force.iter().enumerate() {
                let view = block.view(k);
                if view.flags.has(ContactFlags::BROKEN) {
                    if !is_open(block.contacts(), k) {
                        rows.add(state, (view.pair, view.flags.image), view.reference, None);
                    }
                    continue;
                }
                let damage = forces.contacts.damage.get(first + k).map_or_else(|| block.damage(k), |damage| damage[0]);
                rows.add(state, (view.pair, view.flags.image), view.reference, Some((damage, *force)));
            }
            (from, first) = (end, first + block.len());
        }
        for bond in state.broken_bonds() {
            rows.add(state, (bond.pair, bond.image), bond.reference, None);
        }
        rows
    }

    /// Adds a bond; damage and force are `None` if it has broken.
    fn add(&mut self, state: &State, (pair, image): (Pair, [i8; 3]), reference: Reference, live: Option<(f64, Vec3)>) {
        let particles = &state.particles;
        let [a, b] = [pair.a as usize, pair.b as usize];
        let shift = state.cell.map_or_else(Vec3::zeros, |cell| cell.shift(image));
        let branch = particles.position[b] + shift - particles.position[a];
        let length = branch.norm();
        let (damage, force) = live.unwrap_or((1.0, Vec3::zeros()));
        // The force on the first particle points to the second one in tension.
        let normal_force = if length > 0.0 { force.dot(&branch) / length } else { 0.0 };
        self.ids.push([particles.id[a], particles.id[b]]);
        self.damage.push(damage);
        self.normal_force.push(normal_force);
        self.shear_force.push((force.norm_squared() - normal_force * normal_force).max(0.0).sqrt());
        self.opening.push(length - reference.length);
        self.broken.push(u8::from(live.is_none()));
        self.branch.push(branch);
    }
}
