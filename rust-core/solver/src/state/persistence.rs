//! The state as columns, for checkpoints and hashes.

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::law::Reference;
use concordem_contact::math::{Mat3, Quat, Symmetric, Vec3};

use super::columns::with_length;
use super::contacts::{BrokenBond, Contacts, Pair};
use super::{
    Cell, Clock, Clump, Column, ColumnError, ColumnSink, ColumnSource, Constraint, Load, Particles, State, Wall,
    WriteColumns,
};
use crate::energy::{Ledger, Sum};
use crate::heat::{HeatLedger, HeatState};

impl State {
    /// Replace the state by the columns of a checkpoint. Laws and pair coefficients stay, so the state must come from
    /// the same scenario.
    ///
    /// # Errors
    /// A column that is missing or does not fit.
    pub fn read(&mut self, source: &mut dyn ColumnSource) -> Result<(), ColumnError> {
        let mut particles = read_particles(source)?;
        let cell = read_cell(source)?;
        for (k, block) in self.bonds.iter_mut().enumerate() {
            let path = format!("bonds/{k}_{}", block.law());
            block.read(&path, source)?;
        }
        self.broken = read_broken(source)?;
        if let Some(block) = &mut self.contacts {
            block.read("contacts", source)?;
        }
        if let Some(block) = &mut self.wall_contacts {
            block.read("wall_contacts", source)?;
        }
        for (k, wall) in self.walls.iter_mut().enumerate() {
            read_wall(wall, &format!("walls/{k}"), source)?;
        }
        for (k, clump) in self.clumps.iter_mut().enumerate() {
            read_clump(clump, &format!("clumps/{k}"), source)?;
        }
        let step = with_length("clock/step", source.u64("clock/step")?, 1)?[0];
        let dt = with_length("clock/time_step", source.f64("clock/time_step")?, 1)?[0];
        let ledger = read_ledger(source)?;
        let heat = if self.heat.is_some() { Some(read_heat(source, particles.id.len())?) } else { None };
        let path = "particles/load_dyads";
        if source.exists(path) {
            let reals = with_length(path, source.f64(path)?, 6 * particles.loads.len())?;
            for (load, r) in particles.loads.iter_mut().zip(reals.chunks_exact(6)) {
                load.virial = Symmetric([r[0], r[1], r[2], r[3], r[4], r[5]]);
            }
        }
        self.motion = read_motion(source, particles.id.len())?;
        self.schedule_memory = source.f64("plan")?;
        self.particles = particles;
        self.cell = cell;
        self.clock = Clock { step, dt };
        self.ledger = ledger;
        self.heat = heat;
        Ok(())
    }
}

impl State {
    /// Check indices of particles, walls, clumps, and blocks, which a corrupt or foreign file could get wrong.
    ///
    /// # Errors
    /// The first index that is out of range.
    pub fn check_indices(&self) -> Result<(), ColumnError> {
        let count = self.particles.len();
        let outside = |path: &str, row: usize, what: &str| {
            Err(ColumnError::Value {
                path: path.to_owned(),
                row,
                problem: format!("names a {what} that does not exist"),
            })
        };
        let pairs = |block: &dyn Contacts, path: &str, walls: Option<usize>| {
            let bad = |k: usize| {
                let Pair { a, b } = block.view(k).pair;
                a as usize >= count || b as usize >= walls.unwrap_or(count)
            };
            match (0..block.len()).find(|&k| bad(k)) {
                Some(k) => outside(path, k, "particle or wall element"),
                None => Ok(()),
            }
        };
        for block in &self.bonds {
            pairs(block.contacts(), "bonds", None)?;
        }
        if let Some(block) = &self.contacts {
            pairs(block.contacts(), "contacts", None)?;
        }
        if let Some(block) = &self.wall_contacts {
            let elements = self.walls.iter().map(Wall::element_count).sum();
            pairs(block.contacts(), "wall_contacts", Some(elements))?;
        }
        let missing = |pair: &Pair| pair.a as usize >= count || pair.b as usize >= count;
        if let Some(k) = self.broken.iter().position(|b| missing(&b.pair) || usize::from(b.block) >= self.bonds.len()) {
            return outside("broken/pair", k, "particle or block");
        }
        if let Some(k) = self.particles.loads.iter().position(|load| load.particle as usize >= count) {
            return outside("particles/loads", k, "particle");
        }
        let clump = |&clump: &u32| clump != u32::MAX && clump as usize >= self.clumps.len();
        if let Some(k) = self.particles.clump.iter().position(clump) {
            return outside("particles/clump", k, "clump");
        }
        Ok(())
    }
}

impl WriteColumns for State {
    fn write(&self, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        write_particles(&self.particles, sink)?;
        if let Some(cell) = &self.cell {
            write_cell(cell, sink)?;
        }
        for (k, block) in self.bonds.iter().enumerate() {
            block.write(&format!("bonds/{k}_{}", block.law()), sink)?;
        }
        if !self.broken.is_empty() {
            write_broken(&self.broken, sink)?;
        }
        if let Some(block) = &self.contacts {
            block.write("contacts", sink)?;
        }
        if let Some(block) = &self.wall_contacts {
            block.write("wall_contacts", sink)?;
        }
        for (k, wall) in self.walls.iter().enumerate() {
            write_wall(wall, &format!("walls/{k}"), sink)?;
        }
        for (k, clump) in self.clumps.iter().enumerate() {
            write_clump(clump, &format!("clumps/{k}"), sink)?;
        }
        sink.column("clock/step", Column::u64(&[self.clock.step]))?;
        sink.column("clock/time_step", Column::f64(&[self.clock.dt], 1, "s"))?;
        sink.column("ledger", Column::f64(&self.ledger.to_reals(), 1, "J"))?;
        if !self.particles.deformation.is_empty() {
            sink.column("ledger_deformation", Column::f64(&self.ledger.deformation_reals(), 1, "J"))?;
        }
        if let Some(heat) = &self.heat {
            write_heat(heat, sink)?;
            sink.column("ledger_expansion", Column::f64(&self.ledger.expansion_reals(), 1, "J"))?;
            sink.column("ledger_stiffness", Column::f64(&self.ledger.stiffness_work.parts(), 1, "J"))?;
        }
        if let Some(motion) = &self.motion {
            let reals: Vec<f64> = motion.iter().flat_map(|(v, w)| [v.x, v.y, v.z, w.x, w.y, w.z]).collect();
            sink.column("particles/next_motion", Column::f64(&reals, 6, "m/s, rad/s"))?;
        }
        sink.column("plan", Column::f64(&self.schedule_memory, 1, "see plan"))
    }
}

/// The particles without the virials of their loads, which are read last.
fn read_particles(source: &mut dyn ColumnSource) -> Result<Particles, ColumnError> {
    let vec3 = |source: &mut dyn ColumnSource, path: &str, count: usize| -> Result<Vec<Vec3>, ColumnError> {
        let reals = with_length(path, source.f64(path)?, 3 * count)?;
        Ok(reals.chunks_exact(3).map(|c| Vec3::new(c[0], c[1], c[2])).collect())
    };
    let quat = |source: &mut dyn ColumnSource, path: &str, count: usize| -> Result<Vec<Quat>, ColumnError> {
        let reals = with_length(path, source.f64(path)?, 4 * count)?;
        Ok(reals.chunks_exact(4).map(|c| Quat::new(c[3], c[0], c[1], c[2])).collect())
    };
    let id = source.u32("particles/id")?;
    let n = id.len();
    Ok(Particles {
        position: vec3(source, "particles/position", n)?,
        velocity: vec3(source, "particles/velocity", n)?,
        orientation: quat(source, "particles/orientation", n)?,
        rotation_increment: quat(source, "particles/rotation_increment", n)?,
        angular_velocity: vec3(source, "particles/angular_velocity", n)?,
        radius: with_length("particles/radius", source.f64("particles/radius")?, n)?,
        mass: with_length("particles/mass", source.f64("particles/mass")?, n)?,
        inertia: with_length("particles/inertia", source.f64("particles/inertia")?, n)?,
        material: with_length("particles/material", source.u16("particles/material")?, n)?,
        clump: with_length("particles/clump", source.u32("particles/clump")?, n)?,
        constraint: with_length("particles/constraint", source.u8("particles/constraint")?, n)?
            .into_iter()
            .map(Constraint)
            .collect(),
        tags: with_length("particles/tags", source.u64("particles/tags")?, n)?,
        previous: read_optional(source, "particles/previous_wrench", 6 * n)?,
        image: read_images(source, n)?,
        aggregate: if source.exists("particles/aggregate") {
            with_length("particles/aggregate", source.u32("particles/aggregate")?, n)?
        } else {
            Vec::new()
        },
        deformation: read_optional(source, "particles/deformation", 24 * n)?,
        loads: whole_rows("particles/loads", source.f64("particles/loads")?, 7)?
            .chunks_exact(7)
            .map(|r| Load {
                particle: r[0] as u32,
                force: Vec3::new(r[1], r[2], r[3]),
                moment: Vec3::new(r[4], r[5], r[6]),
                virial: Symmetric::default(),
            })
            .collect(),
        id,
    })
}

/// Cells by which particles were moved back; empty if the column does not exist.
fn read_images(source: &mut dyn ColumnSource, n: usize) -> Result<Vec<[i32; 3]>, ColumnError> {
    let reals: Vec<[f64; 3]> = read_optional(source, "particles/image", 3 * n)?;
    Ok(reals.into_iter().map(|image| image.map(|cells| cells as i32)).collect())
}

/// The values, or [`ColumnError::Ragged`] if they do not make whole rows.
fn whole_rows(path: &str, values: Vec<f64>, components: usize) -> Result<Vec<f64>, ColumnError> {
    if values.len().is_multiple_of(components) {
        return Ok(values);
    }
    Err(ColumnError::Ragged { path: path.to_owned(), len: values.len(), components })
}

/// Rows of reals; empty if the column does not exist.
fn read_optional<T: bytemuck::Pod>(
    source: &mut dyn ColumnSource,
    path: &str,
    count: usize,
) -> Result<Vec<T>, ColumnError> {
    if !source.exists(path) {
        return Ok(Vec::new());
    }
    Ok(bytemuck::cast_slice(&with_length(path, source.f64(path)?, count)?).to_vec())
}

fn write_particles(p: &Particles, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
    let vec3 = |sink: &mut dyn ColumnSink, path: &str, data: &[Vec3], unit: &'static str| {
        sink.column(path, Column::f64(bytemuck::cast_slice(data), 3, unit))
    };
    let reals = |sink: &mut dyn ColumnSink, path: &str, data: &[f64], unit: &'static str| {
        sink.column(path, Column::f64(data, 1, unit))
    };
    sink.column("particles/id", Column::u32(&p.id))?;
    vec3(sink, "particles/position", &p.position, "m")?;
    vec3(sink, "particles/velocity", &p.velocity, "m/s")?;
    sink.column("particles/orientation", Column::f64(bytemuck::cast_slice(&p.orientation), 4, "1"))?;
    sink.column("particles/rotation_increment", Column::f64(bytemuck::cast_slice(&p.rotation_increment), 4, "1"))?;
    vec3(sink, "particles/angular_velocity", &p.angular_velocity, "rad/s")?;
    reals(sink, "particles/radius", &p.radius, "m")?;
    reals(sink, "particles/mass", &p.mass, "kg")?;
    reals(sink, "particles/inertia", &p.inertia, "kg m^2")?;
    sink.column("particles/material", Column::u16(&p.material))?;
    sink.column("particles/clump", Column::u32(&p.clump))?;
    sink.column("particles/constraint", Column::u8(bytemuck::cast_slice(&p.constraint)))?;
    sink.column("particles/tags", Column::u64(&p.tags))?;
    if !p.previous.is_empty() {
        sink.column("particles/previous_wrench", Column::f64(bytemuck::cast_slice(&p.previous), 6, "N, N m"))?;
    }
    if !p.aggregate.is_empty() {
        sink.column("particles/aggregate", Column::u32(&p.aggregate))?;
    }
    if !p.image.is_empty() {
        // Whole numbers are exact.
        let image: Vec<f64> = p.image.iter().flatten().map(|&cells| f64::from(cells)).collect();
        sink.column("particles/image", Column::f64(&image, 3, "1"))?;
    }
    if !p.deformation.is_empty() {
        sink.column("particles/deformation", Column::f64(bytemuck::cast_slice(&p.deformation), 24, "N"))?;
    }
    let loads: Vec<f64> = p
        .loads
        .iter()
        .flat_map(|l| [f64::from(l.particle), l.force.x, l.force.y, l.force.z, l.moment.x, l.moment.y, l.moment.z])
        .collect();
    sink.column("particles/loads", Column::f64(&loads, 7, "1, N, N m"))?;
    if p.loads.iter().any(|load| load.virial != Symmetric::default()) {
        let virials: Vec<f64> = p.loads.iter().flat_map(|load| load.virial.0).collect();
        sink.column("particles/load_dyads", Column::f64(&virials, 6, "N"))?;
    }
    Ok(())
}

/// Motions of the next step of `n` particles, if there are any.
fn read_motion(source: &mut dyn ColumnSource, n: usize) -> Result<Option<Vec<(Vec3, Vec3)>>, ColumnError> {
    let path = "particles/next_motion";
    if !source.exists(path) {
        return Ok(None);
    }
    let reals = with_length(path, source.f64(path)?, 6 * n)?;
    let motion = |r: &[f64]| (Vec3::new(r[0], r[1], r[2]), Vec3::new(r[3], r[4], r[5]));
    Ok(Some(reals.chunks_exact(6).map(motion).collect()))
}

fn read_cell(source: &mut dyn ColumnSource) -> Result<Option<Cell>, ColumnError> {
    if !source.exists("cell") {
        return Ok(None);
    }
    let reals = with_length("cell", source.f64("cell")?, 36)?;
    let matrix = |k: usize| Mat3::from_column_slice(&reals[9 * k..9 * k + 9]);
    Ok(Some(Cell {
        matrix: matrix(0),
        deformation_gradient: matrix(1),
        velocity_gradient: matrix(2),
        matrix_change: matrix(3),
    }))
}

fn write_cell(cell: &Cell, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
    let mut reals = Vec::with_capacity(36);
    for matrix in [&cell.matrix, &cell.deformation_gradient, &cell.velocity_gradient, &cell.matrix_change] {
        reals.extend_from_slice(matrix.as_slice());
    }
    sink.column("cell", Column::f64(&reals, 9, "m, 1, 1/s, m"))
}

fn read_wall(wall: &mut Wall, path: &str, source: &mut dyn ColumnSource) -> Result<(), ColumnError> {
    let reals = with_length(path, source.f64(path)?, 15)?;
    let v = |i: usize| Vec3::new(reals[i], reals[i + 1], reals[i + 2]);
    (wall.displacement, wall.velocity, wall.force, wall.torque, wall.previous_velocity) =
        (v(0), v(3), v(6), v(9), v(12));
    if let Some(turning) = &mut wall.turning {
        let path = format!("{path} turning");
        let reals = with_length(&path, source.f64(&path)?, 6)?;
        let v = |i: usize| Vec3::new(reals[i], reals[i + 1], reals[i + 2]);
        (turning.angular_velocity, turning.previous) = (v(0), v(3));
    }
    if let Some(mesh) = wall.mesh_mut() {
        let path = format!("{path}_vertices");
        let reals = with_length(&path, source.f64(&path)?, 12 * mesh.position.len())?;
        for (k, r) in reals.chunks_exact(12).enumerate() {
            let v = |i: usize| Vec3::new(r[i], r[i + 1], r[i + 2]);
            (mesh.position[k], mesh.velocity[k], mesh.previous_velocity[k], mesh.force[k]) = (v(0), v(3), v(6), v(9));
        }
        mesh.check().map_err(|error| ColumnError::Value { path, row: 0, problem: error.to_string() })?;
    }
    Ok(())
}

fn write_wall(wall: &Wall, path: &str, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
    let mut reals = Vec::with_capacity(15);
    for v in [&wall.displacement, &wall.velocity, &wall.force, &wall.torque, &wall.previous_velocity] {
        reals.extend_from_slice(v.as_slice());
    }
    sink.column(path, Column::f64(&reals, 15, "m, m/s, N, N m, m/s"))?;
    if let Some(turning) = &wall.turning {
        let reals: Vec<f64> = [turning.angular_velocity, turning.previous].iter().flatten().copied().collect();
        sink.column(&format!("{path} turning"), Column::f64(&reals, 6, "rad/s"))?;
    }
    if let Some(mesh) = wall.mesh() {
        let mut reals = Vec::with_capacity(12 * mesh.position.len());
        for k in 0..mesh.position.len() {
            for v in [&mesh.position[k], &mesh.velocity[k], &mesh.previous_velocity[k], &mesh.force[k]] {
                reals.extend_from_slice(v.as_slice());
            }
        }
        sink.column(&format!("{path}_vertices"), Column::f64(&reals, 12, "m, m/s, m/s, N"))?;
    }
    Ok(())
}

fn read_clump(clump: &mut Clump, path: &str, source: &mut dyn ColumnSource) -> Result<(), ColumnError> {
    let reals = with_length(path, source.f64(path)?, 13)?;
    let v = |i: usize| Vec3::new(reals[i], reals[i + 1], reals[i + 2]);
    (clump.position, clump.velocity, clump.angular_momentum) = (v(0), v(3), v(6));
    clump.orientation = Quat::new(reals[12], reals[9], reals[10], reals[11]);
    Ok(())
}

fn write_clump(clump: &Clump, path: &str, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
    let mut reals = Vec::with_capacity(13);
    for v in [&clump.position, &clump.velocity, &clump.angular_momentum] {
        reals.extend_from_slice(v.as_slice());
    }
    reals.extend_from_slice(clump.orientation.coords.as_slice());
    sink.column(path, Column::f64(&reals, 13, "m, m/s, kg m^2/s, 1"))
}

fn read_ledger(source: &mut dyn ColumnSource) -> Result<Ledger, ColumnError> {
    let reals = source.f64("ledger")?;
    let mut ledger = Ledger::from_reals(&reals).ok_or_else(|| ColumnError::Length {
        path: "ledger".into(),
        expected: Ledger::default().to_reals().len(),
        found: reals.len(),
    })?;
    let path = "ledger_deformation";
    if source.exists(path) {
        let reals = with_length(path, source.f64(path)?, 5)?;
        ledger.set_deformation([reals[0], reals[1], reals[2], reals[3], reals[4]]);
    }
    let path = "ledger_expansion";
    if source.exists(path) {
        let reals = with_length(path, source.f64(path)?, 3)?;
        ledger.set_expansion([reals[0], reals[1], reals[2]]);
    }
    let path = "ledger_stiffness";
    if source.exists(path) {
        let reals = with_length(path, source.f64(path)?, 2)?;
        ledger.stiffness_work = Sum::from_parts([reals[0], reals[1]]);
    }
    Ok(ledger)
}

fn write_heat(heat: &HeatState, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
    sink.column("heat/temperature", Column::f64(&heat.temperature, 1, "K"))?;
    sink.column("heat/correction", Column::f64(&heat.correction, 1, "K"))?;
    sink.column("heat/warming", Column::f64(&heat.warming, 1, "K"))?;
    if !heat.dissipated.is_empty() {
        sink.column("heat/dissipated", Column::f64(&heat.dissipated, 1, "J"))?;
        sink.column("heat/ledger_dissipation", Column::f64(&heat.ledger.dissipation.parts(), 1, "J"))?;
    }
    sink.column("heat/ledger", Column::f64(&heat.ledger.to_reals(), 1, "J"))
}

fn read_heat(source: &mut dyn ColumnSource, n: usize) -> Result<HeatState, ColumnError> {
    let dissipates = source.exists("heat/dissipated");
    let mut column = |path: &str, count: usize| with_length(path, source.f64(path)?, count);
    let reals = column("heat/ledger", 5)?;
    let mut ledger = HeatLedger::from_reals([reals[0], reals[1], reals[2], reals[3], reals[4]]);
    let mut dissipated = Vec::new();
    if dissipates {
        let parts = column("heat/ledger_dissipation", 2)?;
        ledger.dissipation = Sum::from_parts([parts[0], parts[1]]);
        dissipated = column("heat/dissipated", n)?;
    }
    Ok(HeatState {
        temperature: column("heat/temperature", n)?,
        correction: column("heat/correction", n)?,
        warming: column("heat/warming", n)?,
        dissipated,
        ledger,
    })
}

fn write_broken(broken: &[BrokenBond], sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
    let pair: Vec<Pair> = broken.iter().map(|bond| bond.pair).collect();
    let image: Vec<i8> = broken.iter().flat_map(|bond| bond.image).collect();
    let block: Vec<u16> = broken.iter().map(|bond| bond.block).collect();
    let reference: Vec<Reference> = broken.iter().map(|bond| bond.reference).collect();
    let previous: Vec<PreviousGeometry> = broken.iter().map(|bond| bond.previous).collect();
    sink.column("broken/block", Column::u16(&block))?;
    sink.column("broken/pair", Column::U32 { data: bytemuck::cast_slice(&pair), components: 2, unit: "1" })?;
    sink.column("broken/image", Column::I8 { data: &image, components: 3, unit: "1" })?;
    sink.column("broken/reference", Column::f64(bytemuck::cast_slice(&reference), 2, "m, m^2"))?;
    sink.column("broken/frame", Column::f64(bytemuck::cast_slice(&previous), 4, "1, 1, 1, m"))?;
    // Most states have none.
    if broken.iter().any(|bond| bond.open) {
        let open: Vec<u8> = broken.iter().map(|bond| u8::from(bond.open)).collect();
        sink.column("broken/open", Column::u8(&open))?;
    }
    Ok(())
}

fn read_broken(source: &mut dyn ColumnSource) -> Result<Vec<BrokenBond>, ColumnError> {
    if !source.exists("broken/block") {
        return Ok(Vec::new());
    }
    let block = source.u16("broken/block")?;
    let n = block.len();
    let pair = with_length("broken/pair", source.u32("broken/pair")?, 2 * n)?;
    let image = with_length("broken/image", source.i8("broken/image")?, 3 * n)?;
    let reference = with_length("broken/reference", source.f64("broken/reference")?, 2 * n)?;
    let previous = with_length("broken/frame", source.f64("broken/frame")?, 4 * n)?;
    let open = if source.exists("broken/open") {
        with_length("broken/open", source.u8("broken/open")?, n)?
    } else {
        vec![0; n]
    };
    let bond = |k: usize| BrokenBond {
        block: block[k],
        pair: Pair { a: pair[2 * k], b: pair[2 * k + 1] },
        image: [image[3 * k], image[3 * k + 1], image[3 * k + 2]],
        reference: Reference { length: reference[2 * k], area: reference[2 * k + 1] },
        previous: PreviousGeometry {
            normal: Vec3::from_column_slice(&previous[4 * k..4 * k + 3]),
            length: previous[4 * k + 3],
        },
        open: open[k] != 0,
    };
    Ok((0..n).map(bond).collect())
}
