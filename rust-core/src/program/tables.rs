//! The particles and contacts at the end of a run, as tables for people.

use crate::math::Vec3;
use crate::plan::samples::rotation_vector;
use crate::solver::record::{Forces, WallForces};
use crate::state::State;
use crate::state::columns::{Column, ColumnError, ColumnSink, WriteColumns};
use crate::state::contacts::{BrokenBond, Contacts, Pair};

/// Tables of a state: `particles/…` with a row per particle in the order of the ids, `cell/…`, `contacts/LAW/…` with a row
/// per bond, broken ones included, `contacts/unbonded_LAW/…`, `contacts/walls/…`.
pub(super) struct Tables<'a> {
    pub state: &'a State,
    /// Displacement of every particle since the start, m, in the state's order.
    pub displacement: &'a [Vec3],
    /// Forces of all contacts of the state.
    pub forces: &'a Forces,
}

impl WriteColumns for Tables<'_> {
    fn write(&self, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        let particles = &self.state.particles;
        let mut order: Vec<usize> = (0..particles.len()).collect();
        order.sort_by_key(|&p| particles.id[p]);
        let ids: Vec<u32> = order.iter().map(|&p| particles.id[p]).collect();
        sink.column("particles/id", Column::u32(&ids))?;
        let vectors = [
            ("position", &particles.position[..], "m"),
            ("displacement", self.displacement, "m"),
            ("velocity", &particles.velocity, "m/s"),
            ("angular_velocity", &particles.angular_velocity, "rad/s"),
        ];
        for (name, values, unit) in vectors {
            let reals: Vec<f64> = order.iter().flat_map(|&p| values[p].iter().copied()).collect();
            sink.column(&format!("particles/{name}"), Column::f64(&reals, 3, unit))?;
        }
        let damage = bond_damage(self.state);
        let scalars =
            [("radius", &particles.radius[..], "m"), ("mass", &particles.mass, "kg"), ("damage", &damage, "1")];
        for (name, values, unit) in scalars {
            let reals: Vec<f64> = order.iter().map(|&p| values[p]).collect();
            sink.column(&format!("particles/{name}"), Column::f64(&reals, 1, unit))?;
        }
        let material: Vec<u16> = order.iter().map(|&p| particles.material[p]).collect();
        sink.column("particles/material", Column::u16(&material))?;
        let fragments = crate::fracture::fragments::fragments(self.state);
        let fragment: Vec<u32> = order.iter().map(|&p| fragments[p]).collect();
        sink.column("particles/fragment", Column::u32(&fragment))?;
        sink.column("particles/sets", Column::u64(&order.iter().map(|&p| particles.tags[p]).collect::<Vec<_>>()))?;
        let rotation: Vec<f64> =
            order.iter().flat_map(|&p| rotation_vector(&particles.orientation[p]).data.0[0]).collect();
        sink.column("particles/rotation", Column::f64(&rotation, 3, "rad"))?;
        let prescribed: Vec<u8> = order.iter().map(|&p| particles.constraint[p].0).collect();
        sink.column("particles/prescribed", Column::u8(&prescribed))?;
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
        let mut from = 0;
        for (place, (block, &end)) in self.state.bonds.iter().zip(ends).enumerate() {
            let broken: Vec<BrokenBond> =
                self.state.broken.iter().filter(|bond| bond.block as usize == place).copied().collect();
            contacts(self.state, block.contacts(), &broken, block.law(), self.forces, from..end, sink)?;
            from = end;
        }
        if let Some(block) = &self.state.contacts {
            let end = ends.last().copied().unwrap_or(from);
            contacts(
                self.state,
                block.contacts(),
                &[],
                &format!("{UNBONDED}{}", block.law()),
                self.forces,
                from..end,
                sink,
            )?;
        }
        if !self.state.walls.is_empty() {
            walls(self.state, &self.forces.walls, sink)?;
        }
        Ok(())
    }
}

/// Name of a table of unbonded contacts, before that of their law.
pub(super) const UNBONDED: &str = "unbonded_";
/// Name of the table of contacts with walls.
pub(super) const WALLS: &str = "walls";

fn walls(state: &State, forces: &WallForces, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
    let ids: Vec<u32> = forces.particle.iter().map(|&p| state.particles.id[p as usize]).collect();
    let path = |name: &str| format!("contacts/{WALLS}/{name}");
    sink.column(&path("id"), Column::u32(&ids))?;
    sink.column(&path("wall"), Column::u32(&forces.wall))?;
    for (name, values, unit) in
        [("position", &forces.point, "m"), ("force", &forces.force, "N"), ("moment", &forces.moment, "N m")]
    {
        sink.column(&path(name), Column::f64(bytemuck::cast_slice(values), 3, unit))?;
    }
    Ok(())
}

/// A row for every bond, broken ones last and without history, and for every unbonded contact that carries something. Force
/// and moment act on the first particle, the moment about `position`.
fn contacts(
    state: &State,
    block: &dyn Contacts,
    broken: &[BrokenBond],
    name: &str,
    forces: &Forces,
    rows: std::ops::Range<usize>,
    sink: &mut dyn ColumnSink,
) -> Result<(), ColumnError> {
    let particles = &state.particles;
    let bonded = !name.starts_with(UNBONDED);
    let forces = &forces.contacts;
    // Row of the forces for every contact, if it carries any.
    let mut row_of = vec![usize::MAX; block.len()];
    for row in rows {
        row_of[forces.place[row] as usize] = row;
    }
    let shown: Vec<usize> = (0..block.len()).filter(|&k| bonded || row_of[k] != usize::MAX).collect();
    let count = shown.len();
    let (mut branch, mut force, mut moment) = (Vec::new(), Vec::new(), Vec::new());
    let mut ids = Vec::with_capacity(2 * count);
    let (mut position, mut normal) = (Vec::with_capacity(3 * count), Vec::with_capacity(3 * count));
    let (mut length, mut reference, mut area) = (Vec::new(), Vec::new(), Vec::new());
    let (mut damage, mut lost_strength) = (Vec::new(), Vec::new());
    let branch_of = |pair: Pair, image: [i8; 3]| {
        let shift = state.cell.map_or_else(Vec3::zeros, |cell| cell.shift(image));
        particles.position[pair.b as usize] + shift - particles.position[pair.a as usize]
    };
    for &k in &shown {
        let view = block.view(k);
        let (a, b) = (view.pair.a as usize, view.pair.b as usize);
        ids.extend([particles.id[a], particles.id[b]]);
        let l = branch_of(view.pair, view.link.image);
        branch.extend(l.iter());
        if let Some(row) = Some(row_of[k]).filter(|&row| row != usize::MAX) {
            position.extend(forces.point[row].iter());
            force.extend(forces.force[row].iter());
            moment.extend(forces.moment[row].iter());
        } else {
            let (arm, _) = block.arms(k, particles, l.norm());
            position.extend((particles.position[a] + l.normalize() * arm).iter());
            force.extend([0.0; 3]);
            moment.extend([0.0; 3]);
        }
        normal.extend(view.frame.normal.iter());
        length.push(view.frame.length);
        reference.push(view.reference.length);
        area.push(view.reference.area);
        damage.push(block.damage(k));
        lost_strength.push(block.lost_strength(k));
    }
    for bond in broken {
        let (a, b) = (bond.pair.a as usize, bond.pair.b as usize);
        ids.extend([particles.id[a], particles.id[b]]);
        branch.extend(branch_of(bond.pair, bond.image).iter());
        // Where it was, seen from A.
        position.extend((particles.position[a] + bond.frame.normal * (0.5 * bond.frame.length)).iter());
        force.extend([0.0; 3]);
        moment.extend([0.0; 3]);
        normal.extend(bond.frame.normal.iter());
        length.push(bond.frame.length);
        reference.push(bond.reference.length);
        area.push(bond.reference.area);
        damage.push(1.0);
        lost_strength.push(1.0);
    }
    let is_broken: Vec<u8> = (0..count + broken.len()).map(|row| u8::from(row >= count)).collect();
    let path = |column: &str| format!("contacts/{name}/{column}");
    sink.column(&path("ids"), Column::U32 { data: &ids, components: 2, unit: "1" })?;
    sink.column(&path("position"), Column::f64(&position, 3, "m"))?;
    sink.column(&path("branch"), Column::f64(&branch, 3, "m"))?;
    sink.column(&path("force"), Column::f64(&force, 3, "N"))?;
    sink.column(&path("moment"), Column::f64(&moment, 3, "N m"))?;
    sink.column(&path("normal"), Column::f64(&normal, 3, "1"))?;
    sink.column(&path("length"), Column::f64(&length, 1, "m"))?;
    sink.column(&path("reference_length"), Column::f64(&reference, 1, "m"))?;
    sink.column(&path("area"), Column::f64(&area, 1, "m^2"))?;
    sink.column(&path("damage"), Column::f64(&damage, 1, "1"))?;
    sink.column(&path("lost_strength"), Column::f64(&lost_strength, 1, "1"))?;
    sink.column(&path("broken"), Column::u8(&is_broken))?;
    let (fields, reals) = block.history_reals();
    let width: usize = fields.iter().map(|field| field.components).sum();
    let mut offset = 0;
    for field in fields {
        let at = |k: usize| k * width + offset;
        let values = shown.iter().flat_map(|&k| reals[at(k)..at(k) + field.components].iter().copied());
        let values: Vec<f64> = values.chain(std::iter::repeat_n(0.0, field.components * broken.len())).collect();
        sink.column(&path(&format!("history_{}", field.name)), Column::f64(&values, field.components, field.unit))?;
        offset += field.components;
    }
    Ok(())
}

/// Mean damage of the bonds of each particle, broken ones counted as 1; 0 for particles that never had a bond.
pub(super) fn bond_damage(state: &State) -> Vec<f64> {
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
    state.broken.iter().for_each(|bond| add(bond.pair, 1.0));
    sum.iter().zip(&count).map(|(sum, count)| if *count > 0.0 { sum / count } else { 0.0 }).collect()
}
