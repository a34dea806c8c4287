//! All that changes during a run: particles, contacts, cell, walls, clock, ledger. Serialisable and complete.

pub mod clumps;
pub mod columns;
pub mod contacts;
pub mod particles;
pub mod walls;

pub use clumps::Clump;
pub use concordem_contact::Cell;
use contacts::{BrokenBond, Pair};

pub use columns::{Column, ColumnError, ColumnSink, ColumnSource, WriteColumns};
pub use particles::{Constraint, Deformation, Load, LoadLever, Particles, Sphere};
pub use walls::{Wall, WallShape};

use crate::energy::Ledger;
use crate::forces::EvaluatedContacts;
use columns::with_length;
use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::law::Reference;
use concordem_contact::math::{Mat3, Quat, Symmetric, Vec3};

/// Time of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Clock {
    /// Steps done.
    pub step: u64,
    /// Time step, s.
    pub dt: f64,
}

impl Clock {
    /// Time, s.
    pub fn time(&self) -> f64 {
        self.step as f64 * self.dt
    }
}

/// The complete state of a simulation.
#[derive(Default)]
pub struct State {
    /// Particles.
    pub particles: Particles,
    /// Periodic cell, if any.
    pub cell: Option<Cell>,
    /// Bonds, a block per law.
    pub bonds: Vec<Box<dyn EvaluatedContacts>>,
    /// Bonds that broke, in the order in which they did.
    pub broken: Vec<BrokenBond>,
    /// Unbonded contacts and candidates, if unbonded pairs interact.
    pub contacts: Option<Box<dyn EvaluatedContacts>>,
    /// Walls.
    pub walls: Vec<Wall>,
    /// Contacts with walls.
    pub wall_contacts: Option<Box<dyn EvaluatedContacts>>,
    /// Rigid clumps.
    pub clumps: Vec<Clump>,
    /// Time.
    pub clock: Clock,
    /// Energies.
    pub ledger: Ledger,
    /// Memory of the plan: peaks, servo terms, and other reals of the loading by position.
    pub schedule_memory: Vec<f64>,
}

impl Clone for State {
    fn clone(&self) -> Self {
        Self {
            particles: self.particles.clone(),
            cell: self.cell,
            bonds: self.bonds.iter().map(|b| b.boxed_clone()).collect(),
            broken: self.broken.clone(),
            contacts: self.contacts.as_ref().map(|b| b.boxed_clone()),
            walls: self.walls.clone(),
            wall_contacts: self.wall_contacts.as_ref().map(|b| b.boxed_clone()),
            clumps: self.clumps.clone(),
            clock: self.clock,
            ledger: self.ledger,
            schedule_memory: self.schedule_memory.clone(),
        }
    }
}

impl State {
    /// All bonds that have not broken.
    pub fn bond_count(&self) -> usize {
        self.bonds
            .iter()
            .map(|b| (0..b.len()).filter(|&k| !b.view(k).link.has(contacts::ContactFlags::BROKEN)).count())
            .sum()
    }

    /// Replace all that changes by the columns of a checkpoint. The state must come from the same scenario: laws and
    /// their parameter rows are kept.
    pub fn read(&mut self, source: &mut dyn ColumnSource) -> Result<(), ColumnError> {
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
        let mut particles = Particles {
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
            previous: if source.exists("particles/previous_wrench") {
                let path = "particles/previous_wrench";
                bytemuck::cast_slice(&with_length(path, source.f64(path)?, 6 * n)?).to_vec()
            } else {
                Vec::new()
            },
            deformation: if source.exists("particles/deformation") {
                let path = "particles/deformation";
                bytemuck::cast_slice(&with_length(path, source.f64(path)?, 24 * n)?).to_vec()
            } else {
                Vec::new()
            },
            loads: source
                .f64("particles/loads")?
                .chunks_exact(7)
                .map(|r| Load {
                    particle: r[0] as u32,
                    force: Vec3::new(r[1], r[2], r[3]),
                    moment: Vec3::new(r[4], r[5], r[6]),
                    dyad: Symmetric::default(),
                })
                .collect(),
            id,
        };
        let cell = if source.exists("cell") {
            let reals = with_length("cell", source.f64("cell")?, 36)?;
            let matrix = |k: usize| Mat3::from_column_slice(&reals[9 * k..9 * k + 9]);
            Some(Cell {
                matrix: matrix(0),
                deformation_gradient: matrix(1),
                velocity_gradient: matrix(2),
                matrix_change: matrix(3),
            })
        } else {
            None
        };
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
            let path = format!("walls/{k}");
            let reals = with_length(&path, source.f64(&path)?, 12)?;
            let v = |i: usize| Vec3::new(reals[i], reals[i + 1], reals[i + 2]);
            (wall.displacement, wall.velocity, wall.force, wall.torque) = (v(0), v(3), v(6), v(9));
        }
        for (k, clump) in self.clumps.iter_mut().enumerate() {
            let path = format!("clumps/{k}");
            let r = with_length(&path, source.f64(&path)?, 13)?;
            let v = |i: usize| Vec3::new(r[i], r[i + 1], r[i + 2]);
            (clump.position, clump.velocity, clump.angular_momentum) = (v(0), v(3), v(6));
            clump.orientation = Quat::new(r[12], r[9], r[10], r[11]);
        }
        let step = with_length("clock/step", source.u64("clock/step")?, 1)?[0];
        let dt = with_length("clock/time_step", source.f64("clock/time_step")?, 1)?[0];
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
        let path = "particles/load_dyads";
        if source.exists(path) {
            let reals = with_length(path, source.f64(path)?, 6 * particles.loads.len())?;
            for (load, r) in particles.loads.iter_mut().zip(reals.chunks_exact(6)) {
                load.dyad = Symmetric([r[0], r[1], r[2], r[3], r[4], r[5]]);
            }
        }
        self.schedule_memory = source.f64("plan")?;
        self.particles = particles;
        self.cell = cell;
        self.clock = Clock { step, dt };
        self.ledger = ledger;
        Ok(())
    }
}

fn write_broken(broken: &[BrokenBond], sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
    let pair: Vec<Pair> = broken.iter().map(|bond| bond.pair).collect();
    let image: Vec<i8> = broken.iter().flat_map(|bond| bond.image).collect();
    let block: Vec<u16> = broken.iter().map(|bond| bond.block).collect();
    let reference: Vec<Reference> = broken.iter().map(|bond| bond.reference).collect();
    let frame: Vec<PreviousGeometry> = broken.iter().map(|bond| bond.frame).collect();
    sink.column("broken/block", Column::u16(&block))?;
    sink.column("broken/pair", Column::U32 { data: bytemuck::cast_slice(&pair), components: 2, unit: "1" })?;
    sink.column("broken/image", Column::I8 { data: &image, components: 3, unit: "1" })?;
    sink.column("broken/reference", Column::f64(bytemuck::cast_slice(&reference), 2, "m, m^2"))?;
    sink.column("broken/frame", Column::f64(bytemuck::cast_slice(&frame), 4, "1, 1, 1, m"))
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
    let frame = with_length("broken/frame", source.f64("broken/frame")?, 4 * n)?;
    let bond = |k: usize| BrokenBond {
        block: block[k],
        pair: Pair { a: pair[2 * k], b: pair[2 * k + 1] },
        image: [image[3 * k], image[3 * k + 1], image[3 * k + 2]],
        reference: Reference { length: reference[2 * k], area: reference[2 * k + 1] },
        frame: PreviousGeometry { normal: Vec3::from_column_slice(&frame[4 * k..4 * k + 3]), length: frame[4 * k + 3] },
    };
    Ok((0..n).map(bond).collect())
}

impl WriteColumns for State {
    fn write(&self, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        let p = &self.particles;
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
            let previous = Column::f64(bytemuck::cast_slice(&p.previous), 6, "N, N m");
            sink.column("particles/previous_wrench", previous)?;
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
        if p.loads.iter().any(|load| load.dyad != Symmetric::default()) {
            let dyads: Vec<f64> = p.loads.iter().flat_map(|load| load.dyad.0).collect();
            sink.column("particles/load_dyads", Column::f64(&dyads, 6, "N"))?;
        }
        if let Some(cell) = &self.cell {
            let mut reals = Vec::with_capacity(36);
            for matrix in [&cell.matrix, &cell.deformation_gradient, &cell.velocity_gradient, &cell.matrix_change] {
                reals.extend_from_slice(matrix.as_slice());
            }
            sink.column("cell", Column::f64(&reals, 9, "m, 1, 1/s, m"))?;
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
            let mut r = Vec::with_capacity(12);
            for v in [&wall.displacement, &wall.velocity, &wall.force, &wall.torque] {
                r.extend_from_slice(v.as_slice());
            }
            sink.column(&format!("walls/{k}"), Column::f64(&r, 12, "m, m/s, N, N m"))?;
        }
        for (k, clump) in self.clumps.iter().enumerate() {
            let mut r = Vec::with_capacity(13);
            for v in [&clump.position, &clump.velocity, &clump.angular_momentum] {
                r.extend_from_slice(v.as_slice());
            }
            r.extend_from_slice(clump.orientation.coords.as_slice());
            sink.column(&format!("clumps/{k}"), Column::f64(&r, 13, "m, m/s, kg m^2/s, 1"))?;
        }
        sink.column("clock/step", Column::u64(&[self.clock.step]))?;
        reals(sink, "clock/time_step", &[self.clock.dt], "s")?;
        reals(sink, "ledger", &self.ledger.to_reals(), "J")?;
        if !p.deformation.is_empty() {
            reals(sink, "ledger_deformation", &self.ledger.deformation_reals(), "J")?;
        }
        reals(sink, "plan", &self.schedule_memory, "see plan")
    }
}
