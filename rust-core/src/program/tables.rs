//! The particles and contacts at the end of a run, as tables for people.

use crate::math::Vec3;
use crate::state::State;
use crate::state::columns::{Column, ColumnError, ColumnSink, WriteColumns};
use crate::state::contacts::{Contacts, Link};

/// Tables of a state: `particles/…` with a row per particle in the order of the ids, `contacts/LAW/…` with a row per
/// bond, broken ones included.
pub(super) struct Tables<'a> {
    pub state: &'a State,
    /// Displacement of every particle since the start, m, in the state's order.
    pub displacement: &'a [Vec3],
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
        for block in &self.state.bonds {
            contacts(self.state, block.contacts(), sink)?;
        }
        Ok(())
    }
}

fn contacts(state: &State, block: &dyn Contacts, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
    let particles = &state.particles;
    let count = block.len();
    let mut ids = Vec::with_capacity(2 * count);
    let (mut position, mut normal) = (Vec::with_capacity(3 * count), Vec::with_capacity(3 * count));
    let (mut length, mut reference, mut area) = (Vec::new(), Vec::new(), Vec::new());
    let (mut damage, mut broken) = (Vec::new(), Vec::new());
    for k in 0..count {
        let view = block.view(k);
        let (a, b) = (view.pair.a as usize, view.pair.b as usize);
        ids.extend([particles.id[a], particles.id[b]]);
        let broke = view.link.has(Link::BROKEN);
        let (arm, _) = block.arms(k, particles, view.frame.length);
        position.extend((particles.position[a] + view.frame.normal * arm).iter());
        normal.extend(view.frame.normal.iter());
        length.push(view.frame.length);
        reference.push(view.reference.length);
        area.push(view.reference.area);
        damage.push(if broke { 1.0 } else { block.damage(k) });
        broken.push(u8::from(broke));
    }
    let path = |name: &str| format!("contacts/{}/{name}", block.law());
    sink.column(&path("ids"), Column::U32 { data: &ids, components: 2, unit: "1" })?;
    sink.column(&path("position"), Column::f64(&position, 3, "m"))?;
    sink.column(&path("normal"), Column::f64(&normal, 3, "1"))?;
    sink.column(&path("length"), Column::f64(&length, 1, "m"))?;
    sink.column(&path("reference_length"), Column::f64(&reference, 1, "m"))?;
    sink.column(&path("area"), Column::f64(&area, 1, "m^2"))?;
    sink.column(&path("damage"), Column::f64(&damage, 1, "1"))?;
    sink.column(&path("broken"), Column::u8(&broken))?;
    let (fields, reals) = block.history_reals();
    let width: usize = fields.iter().map(|field| field.components).sum();
    let mut offset = 0;
    for field in fields {
        let rows = reals.chunks_exact(width.max(1));
        let values: Vec<f64> = rows.flat_map(|row| row[offset..offset + field.components].iter().copied()).collect();
        sink.column(&path(&format!("history_{}", field.name)), Column::f64(&values, field.components, field.unit))?;
        offset += field.components;
    }
    Ok(())
}

/// Mean damage of the bonds of each particle; 0 for particles without bonds.
pub(super) fn bond_damage(state: &State) -> Vec<f64> {
    let mut sum = vec![0.0; state.particles.len()];
    let mut count = vec![0.0; state.particles.len()];
    for block in &state.bonds {
        for k in 0..block.len() {
            let view = block.view(k);
            let damage = if view.link.has(Link::BROKEN) { 1.0 } else { block.damage(k) };
            for p in [view.pair.a, view.pair.b] {
                sum[p as usize] += damage;
                count[p as usize] += 1.0;
            }
        }
    }
    sum.iter().zip(&count).map(|(sum, count)| if *count > 0.0 { sum / count } else { 0.0 }).collect()
}
