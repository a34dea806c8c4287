//! Checks of aggregates and pores.

use super::{Checker, length};
use crate::schema::{AggregateGroup, AggregateShape, Aggregates, Axis, GradingTable, Packing, Shape, Surface};

impl Checker<'_> {
    pub(super) fn aggregates(&mut self) {
        let scenario = self.scenario;
        let Some(aggregates) = &scenario.aggregates else { return };
        self.region_of_aggregates(aggregates);
        self.mix(aggregates);
        let mut total = 0.0;
        for (at, group) in aggregates.groups.iter().enumerate() {
            let path = format!("aggregates.group[{at}]");
            self.phase(&path, group);
            self.sizes(&path, aggregates, group);
            self.shape_of_aggregates(&path, group);
            let amount = aggregates.fraction(group).and_then(Result::ok).zip(group.curve().and_then(Result::ok));
            total += amount.map_or(0.0, |(fraction, (_, share))| fraction * share);
        }
        if total >= 1.0 {
            let message = format!("all groups together have {total:.3} of the volume of the specimen");
            self.conflict("aggregates.group", message, "give less; random places exist up to about 0.5");
        }
    }

    /// Whether all centers of particles, and so of aggregates, lie in the plane z = 0.
    fn aggregates_in_plane(&self) -> bool {
        self.scenario.dimension == 2 || matches!(self.scenario.packing, Packing::RandomDiscs { .. })
    }

    /// Checks the surface of the specimen.
    fn region_of_aggregates(&mut self, aggregates: &Aggregates) {
        let packing = &self.scenario.packing;
        if packing.is_periodic() {
            if aggregates.surface.is_some() {
                let help = "remove the key; aggregates of a periodic packing are periodic";
                self.conflict("aggregates.surface", "a periodic packing has no surface", help);
            }
            if aggregates.wall_gap.si() > 0.0 {
                self.conflict("aggregates.wall_gap", "a periodic packing has no mould", "remove the key");
            }
        } else if aggregates.surface == Some(Surface::Sawn) && aggregates.wall_gap.si() > 0.0 {
            self.conflict(
                "aggregates.wall_gap",
                "sawn faces have no mould",
                "remove the key, or write surface = \"mould\"",
            );
        }
        let planar = self.aggregates_in_plane();
        let upright = match packing.shape() {
            Some(Shape::Hyperboloid { .. } | Shape::Mesh { .. } | Shape::Cylinder { axis: Axis::X | Axis::Y, .. }) => {
                false
            }
            Some(Shape::Box { .. } | Shape::Cylinder { .. } | Shape::Periodic { .. }) | None => true,
        };
        if planar && !upright && aggregates.surface != Some(Surface::Sawn) {
            let help =
                "cut a box or a cylinder along z out of the packing, or write surface = \"sawn\" in [aggregates]";
            self.conflict("packing.shape.kind", "is no mould for aggregates in a plane", help);
        }
    }

    fn mix(&mut self, aggregates: &Aggregates) {
        let Some(mix) = &aggregates.mix else { return };
        let names: Vec<&str> = mix.components.iter().map(|component| component.name.as_str()).collect();
        for (at, name) in names.iter().enumerate() {
            let key = format!("aggregates.mix.components[{at}].name");
            if names[..at].contains(name) {
                self.conflict(&key, "another component has this name", "give each its own name");
            }
        }
        if mix.unit_weight.is_some() && mix.air.is_some() {
            let help = "keep one: the air is the rest that the unit weight leaves";
            self.conflict("aggregates.mix.air", "gives both `air` and `unit_weight`", help);
        }
        let total: f64 = mix.components.iter().map(|component| component.content.si()).sum();
        if mix.unit_weight.is_some_and(|weight| weight.si() > total) {
            let message = format!("is larger than the sum of the contents, {total} kg/m^3");
            let help = "check the contents and the unit weight; without air they are equal";
            self.range("aggregates.mix.unit_weight", message, help);
        }
        if aggregates.groups.iter().all(|group| group.component.is_none()) {
            let help = "write component = \"...\" in a group instead of its `volume_fraction`, or remove the mix";
            self.conflict("aggregates.mix", "has no effect: no group names a component", help);
        }
    }

    /// Checks what a group is: aggregates of a material, or pores.
    fn phase(&mut self, path: &str, group: &AggregateGroup) {
        let key = format!("{path}.material");
        match (&group.material, group.remove_particles) {
            (None, false) => {
                let help = "add `material = \"...\"` for aggregates, or `remove_particles = true` for pores";
                self.missing(&key, "gives neither `material` nor `remove_particles`", help);
            }
            (Some(_), true) => {
                let help = "keep `material` for aggregates, or `remove_particles` for pores";
                self.conflict(&key, "gives both `material` and `remove_particles`", help);
            }
            (Some(name), false) => {
                self.known_material(&key, name);
                if self.scenario.materials.first().is_some_and(|first| first.name == *name) {
                    let help = "list the material of the mortar first, and name another one here";
                    self.conflict(&key, "is the material of the mortar: the first material", help);
                }
            }
            (None, true) => {}
        }
    }

    /// Checks the sizes and the amount of a group.
    fn sizes(&mut self, path: &str, aggregates: &Aggregates, group: &AggregateGroup) {
        let amounts = [
            ("volume_fraction", group.volume_fraction.is_some()),
            ("component", group.component.is_some()),
            ("first_step", group.first_step.is_some()),
        ];
        let given: Vec<&str> = amounts.iter().filter(|(_, given)| *given).map(|(key, _)| *key).collect();
        match (&group.grading, &group.spheres) {
            (None, None) => {
                let help = "add `grading = { kind = \"fuller\", largest = \"16 mm\" }`, or list `spheres`";
                self.missing(&format!("{path}.grading"), "gives neither `grading` nor `spheres`", help);
                return;
            }
            (Some(_), Some(_)) => {
                let help = "keep one; spheres in given places are a group of their own";
                self.conflict(&format!("{path}.spheres"), "gives both `grading` and `spheres`", help);
                return;
            }
            (None, Some(spheres)) => {
                self.given_spheres(path, spheres);
                let others = [("smallest", group.smallest.is_some()), ("shape", group.shape.is_some())];
                let others = others.iter().filter(|(_, given)| *given).map(|(key, _)| *key);
                for key in given.iter().copied().chain(others) {
                    let help = "the spheres have their radii and places: remove this key";
                    self.conflict(&format!("{path}.{key}"), "has no effect with `spheres`", help);
                }
                return;
            }
            (Some(grading), None) => self.grading(path, group, grading),
        }
        match given[..] {
            [] => {
                let help = "add `volume_fraction = 0.3`, or `component` to take it from a mix";
                self.missing(&format!("{path}.volume_fraction"), "the amount is missing", help);
            }
            [_] => {}
            [first, second, ..] => {
                let message = format!("gives both `{first}` and `{second}`");
                self.conflict(&format!("{path}.{second}"), message, "keep one of them");
            }
        }
        if let Some(name) = &group.component {
            self.component(&format!("{path}.component"), aggregates, name);
        }
    }

    fn component(&mut self, key: &str, aggregates: &Aggregates, name: &str) {
        let names: Vec<&str> =
            aggregates.mix.iter().flat_map(|mix| &mix.components).map(|component| component.name.as_str()).collect();
        if aggregates.mix.is_none() {
            let help = "add [aggregates.mix] with its components, or give `volume_fraction`";
            self.missing("aggregates.mix", "no mix has this component", help);
        } else if !names.contains(&name) {
            let known: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
            let help = format!("choose {}", super::listing(&known));
            self.add(crate::schema::ProblemKind::UnknownName, key, "no component of the mix has this name", help);
        }
    }

    fn grading(&mut self, path: &str, group: &AggregateGroup, grading: &GradingTable) {
        let key = format!("{path}.grading");
        match grading {
            GradingTable::Sieves { sizes, passing } if sizes.len() != passing.len() => {
                let message = format!("{} passing fractions for {} sieves", passing.len(), sizes.len());
                self.conflict(&format!("{key}.passing"), message, "give one fraction per sieve");
                return;
            }
            GradingTable::Fuller { .. } if group.smallest.is_none() => {
                let help = "add `smallest = \"4 mm\"`; finer aggregates belong to the mortar";
                self.missing(&format!("{path}.smallest"), "missing key, required by this grading", help);
                return;
            }
            GradingTable::Single { .. } if group.smallest.is_some() => {
                self.conflict(&format!("{path}.smallest"), "has no effect on a single size", "remove the key");
                return;
            }
            _ => {}
        }
        if let Some(Err(error)) = group.curve() {
            let help = "sieves and fractions ascend, the last fraction is 1, and `smallest` lies between the sieves; Stránský 2018 has \
                        9.5, 12.5, and 19 mm";
            self.range(&key, error.to_string(), help);
        }
        if group.first_step.is_some() {
            let step = format!("{path}.first_step");
            if group.shape.as_ref().is_some_and(|shape| !matches!(shape, AggregateShape::Sphere {})) {
                self.conflict(&step, "is a rule for spheres", "give `volume_fraction`, or remove `shape`");
            }
            if self.aggregates_in_plane() {
                self.conflict(&step, "is a rule in three dimensions", "give `volume_fraction`");
            }
        }
    }

    fn given_spheres(&mut self, path: &str, spheres: &[[crate::schema::quantity::Length; 4]]) {
        let key = format!("{path}.spheres");
        if spheres.is_empty() {
            self.range(&key, "no spheres", "list at least one as [x, y, z, radius]");
        }
        for (at, sphere) in spheres.iter().enumerate() {
            if sphere[3].si() <= 0.0 {
                let message = format!("the radius {} is not positive", length(sphere[3].si()));
                self.range(&format!("{key}[{at}][3]"), message, "give a positive radius");
            }
            if self.aggregates_in_plane() && sphere[2].si() != 0.0 {
                let help = "all particles and aggregates lie in this plane";
                self.conflict(&format!("{key}[{at}][2]"), "is not in the plane z = 0", help);
            }
        }
    }

    fn shape_of_aggregates(&mut self, path: &str, group: &AggregateGroup) {
        if !self.aggregates_in_plane() {
            return;
        }
        let key = format!("{path}.shape");
        match &group.shape {
            Some(AggregateShape::Polyhedron { .. } | AggregateShape::Mesh { .. }) => {
                let help = "use \"sphere\" (discs) or \"ellipsoid\" (ellipses), or a packing in space";
                self.conflict(&format!("{key}.kind"), "is not possible in two dimensions", help);
            }
            Some(AggregateShape::Ellipsoid { flatness, .. }) if flatness.si() != 1.0 => {
                let help = "remove the key; an ellipse has only an `elongation`";
                self.conflict(&format!("{key}.flatness"), "points out of the plane", help);
            }
            _ => {}
        }
    }
}
