//! Checks of plane scenarios: no particle leaves the plane z = 0.

use super::{Checker, components};
use crate::schema::quantity::{Component, Length};
use crate::schema::{Axis, LawName, Loading, Packing, VelocityField};
use crate::walls::IN_TWO_DIMENSIONS as HELP;

/// A vector of the scenario: key, value, and whether it is a rotation or a moment.
type Entry = (String, [f64; 3], bool);

impl Checker<'_> {
    pub(super) fn plane(&mut self) {
        self.packing_in_plane();
        self.laws_in_plane();
        self.clumps_in_plane();
        self.walls_in_plane();
        let mut outside = self.loading_out_of_plane();
        for (key, value, is_rotation) in self.vectors() {
            let forbidden: &[usize] = if is_rotation { &[0, 1] } else { &[2] };
            outside.extend(forbidden.iter().filter(|&&i| value[i] != 0.0).map(|i| format!("{key}[{i}]")));
        }
        for key in outside {
            self.conflict(&key, "points out of the plane", HELP);
        }
    }

    fn packing_in_plane(&mut self) {
        match &self.scenario.packing {
            Packing::RandomDense { .. } | Packing::Cooker { .. } | Packing::Growth { .. } => {
                self.conflict(
                    "packing.kind",
                    "gives spheres in three dimensions",
                    "use \"random-discs\", or dimension = 3",
                );
            }
            Packing::Lattice { lattice, .. } if !lattice.is_planar() => {
                let help = "use \"square\" or \"triangular\", or dimension = 3";
                self.conflict("packing.lattice", "is not a planar lattice", help);
            }
            Packing::Spheres { spheres, cell } => {
                self.cell_in_plane(cell.as_ref());
                if let Some(at) = spheres.iter().position(|sphere| sphere[2].si() != 0.0) {
                    self.conflict(&format!("packing.spheres[{at}][2]"), "is not in the plane z = 0", HELP);
                }
            }
            Packing::File { cell, .. } => self.cell_in_plane(cell.as_ref()),
            _ => {}
        }
    }

    /// Refuses laws of spheres, which have no meaning between discs of unit depth.
    fn laws_in_plane(&mut self) {
        let scenario = self.scenario;
        let bonds = scenario.bonds.as_ref().map(|bonds| bonds.law);
        let in_use = |law: LawName| bonds == Some(law) || scenario.contacts.law.law() == Some(law);
        let materials = scenario.materials.iter().enumerate();
        let interfaces = scenario.interfaces.iter().enumerate();
        let tables = materials
            .map(|(at, material)| (format!("material[{at}]"), material.tables()))
            .chain(interfaces.map(|(at, interface)| (format!("interface[{at}]"), interface.tables())));
        for (owner, tables) in tables {
            for (law, table) in tables.into_iter().filter(|(law, _)| in_use(*law)) {
                let Some(fault) = table.fault_in_plane() else { continue };
                let path = format!("{owner}.{}", law.key());
                let key = if fault.key.is_empty() { path } else { format!("{path}.{}", fault.key) };
                self.conflict(&key, fault.message, fault.help);
            }
        }
    }

    /// Checks that the cell of a plane packing is as deep as the discs.
    fn cell_in_plane(&mut self, cell: Option<&[Length; 3]>) {
        if cell.is_some_and(|cell| cell[2].si() != 1.0) {
            let help = "write 1: with dimension = 2, discs and cell are 1 m deep, and forces are per meter of depth";
            self.conflict("packing.cell[2]", "a plane cell must be 1 m deep", help);
        }
    }

    fn clumps_in_plane(&mut self) {
        for (at, clump) in self.scenario.clumps.iter().enumerate() {
            let spheres = clump.spheres.iter().flatten().enumerate();
            for (k, _) in spheres.filter(|(_, sphere)| sphere[2].si() != 0.0) {
                self.conflict(&format!("clump[{at}].spheres[{k}][2]"), "is not in the plane z = 0", HELP);
            }
        }
    }

    /// Checks the axes of the loading; returns the keys of its components that point out of the plane.
    fn loading_out_of_plane(&mut self) -> Vec<String> {
        match &self.scenario.loading {
            Loading::Uniaxial { axis: Axis::Z, .. }
            | Loading::Platens { axis: Axis::Z, .. }
            | Loading::Bending { axis: Axis::Z, .. } => {
                let help = "write axis = \"x\" or axis = \"y\"";
                self.conflict("loading.axis", "the loading acts along z, out of the plane", help);
            }
            Loading::Flexure { axis: Axis::Z, .. } => {
                self.conflict("loading.axis", "the beam points out of the plane", "write axis = \"x\" or axis = \"y\"");
            }
            Loading::Flexure { across: Some(Axis::Z), .. } => {
                self.conflict("loading.across", "points out of the plane", "remove `across`");
            }
            Loading::Bending { about: Axis::X | Axis::Y, .. } => {
                self.conflict("loading.about", "rotates the ends out of the plane", "write about = \"z\"");
            }
            Loading::Torsion { .. } => {
                let help = "use \"uniaxial\" or \"bending\", or dimension = 3";
                self.conflict("loading.kind", "torsion rotates the ends out of the plane", help);
            }
            Loading::CellStrain { velocity_gradient } => {
                let places = [(2, 0), (2, 1), (2, 2), (0, 2), (1, 2)];
                let outside = places.into_iter().filter(|&(row, column)| velocity_gradient[row][column].si() != 0.0);
                return outside.map(|(row, column)| format!("loading.velocity_gradient[{row}][{column}]")).collect();
            }
            Loading::CellStress { stress, strain_rate, .. } => {
                if strain_rate[2] != Component::Free {
                    self.conflict("loading.strain_rate[2]", "points out of the plane", HELP);
                }
                let row = stress[2].iter().enumerate().filter(|(_, component)| component.si() != 0.0);
                return row.map(|(column, _)| format!("loading.stress[2][{column}]")).collect();
            }
            _ => {}
        }
        Vec::new()
    }

    /// Velocities, forces, and rotations of the scenario.
    fn vectors(&self) -> Vec<Entry> {
        let scenario = self.scenario;
        let mut vectors: Vec<Entry> =
            vec![("integration.gravity".to_owned(), components(&scenario.integration.gravity), false)];
        for (at, wall) in scenario.walls.iter().enumerate() {
            vectors.push((format!("wall[{at}].velocity"), components(&wall.velocity), false));
            if let Some(motion) = &wall.motion {
                vectors.push((format!("wall[{at}].motion.displacement"), components(&motion.displacement), false));
                if let Some(rotation) = &motion.rotation {
                    vectors.push((format!("wall[{at}].motion.rotation"), components(rotation), true));
                }
                for (k, row) in motion.vertices.iter().flatten().enumerate() {
                    vectors.push((format!("wall[{at}].motion.vertices[{k}]"), components(row), false));
                }
            }
            if let Some(direction) = wall.servo.as_ref().and_then(|servo| servo.direction.as_ref()) {
                vectors.push((format!("wall[{at}].servo.direction"), components(direction), false));
            }
        }
        for (at, one) in scenario.prescribed.iter().enumerate() {
            let velocity = one.velocity.map(|component| Component::si(component).unwrap_or(0.0));
            let angular_velocity = one.angular_velocity.map(|component| Component::si(component).unwrap_or(0.0));
            vectors.push((format!("prescribe[{at}].velocity"), velocity, false));
            let displacement = one.displacement.map(|component| Component::si(component).unwrap_or(0.0));
            vectors.push((format!("prescribe[{at}].displacement"), displacement, false));
            vectors.push((format!("prescribe[{at}].angular_velocity"), angular_velocity, true));
            match &one.field {
                Some(VelocityField::Rotation { axis, .. }) => {
                    vectors.push((format!("prescribe[{at}].field.axis"), components(axis), true));
                }
                Some(VelocityField::Linear { velocity_gradient, .. }) => {
                    for (row, gradient) in velocity_gradient.iter().enumerate() {
                        let key = format!("prescribe[{at}].field.velocity_gradient[{row}]");
                        let [x, y, z] = components(gradient);
                        // Along z nothing moves, and no velocity changes.
                        vectors.push((key, [0.0, 0.0, if row == 2 { x.abs() + y.abs() + z.abs() } else { z }], false));
                    }
                }
                None => {}
            }
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
            let angular_velocity = one.angular_velocity.as_ref().map_or([0.0; 3], components);
            vectors.push((format!("clump[{at}].velocity"), velocity, false));
            vectors.push((format!("clump[{at}].angular_velocity"), angular_velocity, true));
        }
        vectors
    }
}
