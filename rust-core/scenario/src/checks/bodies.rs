//! Checks of sets, prescribed motions, forces, and clumps.

use super::{Checker, SYMMETRY};
use crate::schema::quantity::{Component, Length, vector};
use crate::schema::{Clump, Packing, ParticleSet, Quantity, Selection};

impl Checker<'_> {
    /// Sets, and the motions and forces that refer to them.
    pub(super) fn sets(&mut self) {
        let scenario = self.scenario;
        let names: Vec<&str> = scenario.sets.iter().map(|set| set.name.as_str()).collect();
        self.unique("set", &names);
        for (at, set) in scenario.sets.iter().enumerate() {
            self.set(at, set);
        }
        for (at, prescribed) in scenario.prescribed.iter().enumerate() {
            self.known_set(&format!("prescribe[{at}].set"), &prescribed.set);
            let free = prescribed.velocity.iter().all(|component| *component == Component::Free)
                && prescribed.displacement.iter().all(|component| *component == Component::Free)
                && prescribed.angular_velocity.iter().all(|component| *component == Component::Free)
                && prescribed.field.is_none();
            if free {
                let help = "give `velocity`, `displacement`, `angular_velocity`, or `field`, with \"free\" for components that follow the forces";
                self.conflict(&format!("prescribe[{at}]"), "prescribes no component of the motion", help);
            }
        }
        self.slaves();
        for (at, force) in scenario.forces.iter().enumerate() {
            self.known_set(&format!("force[{at}].set"), &force.set);
            if vector(&force.force).norm() == 0.0 && vector(&force.moment).norm() == 0.0 {
                let help = "give `force` or `moment`, or remove the table";
                self.conflict(&format!("force[{at}]"), "gives neither `force` nor `moment`", help);
            }
        }
        for (at, initial) in scenario.initials.iter().enumerate() {
            self.known_set(&format!("initial[{at}].set"), &initial.set);
        }
    }

    fn slaves(&mut self) {
        let scenario = self.scenario;
        for (at, slave) in scenario.slaves.iter().enumerate() {
            let key = format!("slave[{at}]");
            match (&slave.set, &slave.wall) {
                (Some(set), None) => self.known_set(&format!("{key}.set"), set),
                (None, Some(wall)) => self.mesh_of_slave(&format!("{key}.wall"), wall),
                (Some(_), Some(_)) => {
                    self.conflict(&key, "gives both `set` and `wall`", "give each a [[slave]] and a file of its own");
                }
                (None, None) => self.missing(&format!("{key}.set"), "missing key", "give `set` or `wall`"),
            }
            if scenario.slaves[..at].iter().any(|other| other.set == slave.set && other.wall == slave.wall) {
                self.conflict(&key, "another [[slave]] moves the same", "remove one");
            }
        }
        let refused = [("[heat]", scenario.heat.is_some()), ("a periodic cell", scenario.packing.is_periodic())];
        for (what, _) in refused.into_iter().filter(|(_, present)| *present && !scenario.slaves.is_empty()) {
            self.conflict("slave[0]", format!("not possible with {what}"), "remove one of the two");
        }
    }

    /// Checks that a wall is a mesh without a motion.
    fn mesh_of_slave(&mut self, key: &str, name: &str) {
        let scenario = self.scenario;
        let meshes = scenario.walls.iter().filter(|wall| wall.shape.kind().is_mesh());
        let names: Vec<&str> = meshes.clone().filter_map(|wall| wall.name.as_deref()).collect();
        self.known(key, "wall", name, &names);
        if meshes.clone().any(|wall| wall.name.as_deref() == Some(name) && wall.motion.is_some()) {
            self.conflict(key, "this wall has a `motion`, too", "remove one of the two motions");
        }
    }

    fn set(&mut self, at: usize, set: &ParticleSet) {
        let scenario = self.scenario;
        if let Some(material) = &set.material {
            self.known_material(&format!("set[{at}].material"), material);
        }
        let path = format!("set[{at}].selection");
        match &set.selection {
            Selection::Box { minimum, maximum } => self.corners(&path, minimum, maximum),
            Selection::Ids { ids } => {
                // The number of spheres of other packings, and with fibers, is unknown until they are made.
                let Packing::Spheres { spheres, .. } = &scenario.packing else { return };
                if scenario.fibers.is_some() {
                    return;
                }
                let of_clumps: usize =
                    scenario.clumps.iter().filter_map(|clump| clump.spheres.as_ref()).map(Vec::len).sum();
                let count = spheres.len() + of_clumps;
                if let Some(bad) = ids.iter().position(|id| *id as usize >= count) {
                    let message = format!("the packing has only {count} spheres");
                    let help = "spheres are numbered from 0";
                    self.range(&format!("{path}.ids[{bad}]"), message, help);
                }
            }
            _ => {}
        }
    }

    pub(super) fn clumps(&mut self) {
        let scenario = self.scenario;
        if scenario.loading.drives_cell() && !scenario.clumps.is_empty() {
            let help = "rigid bodies do not follow the deformation of a driven cell; remove the clumps, or [loading]";
            let message = format!("clumps are not possible with \"{}\" loading", scenario.loading.kind());
            self.conflict("clump[0]", message, help);
        }
        for (at, clump) in scenario.clumps.iter().enumerate() {
            let path = format!("clump[{at}]");
            self.members(&path, clump);
            if let Some(material) = &clump.material {
                self.known_material(&format!("{path}.material"), material);
            }
            if let Some(inertia) = &clump.inertia {
                let [a, b, c] = inertia.map(Quantity::si);
                let key = format!("{path}.inertia");
                if a > b || b > c {
                    self.conflict(&key, "is not in ascending order", "write the smallest moment of inertia first");
                } else if c > (a + b) * (1.0 + SYMMETRY) {
                    let message = "no rigid body has such moments: the largest exceeds the sum of the other two";
                    self.range(&key, message, "check their order and units, or omit `inertia`");
                }
            }
        }
    }

    /// Members of a clump: packed particles or added spheres.
    fn members(&mut self, path: &str, clump: &Clump) {
        match (&clump.set, &clump.spheres) {
            (None, None) => {
                let help = "give `set` to join packed particles, or `spheres` to add some";
                self.missing(path, "gives neither `set` nor `spheres`", help);
            }
            (Some(_), Some(_)) => {
                let help = "keep `set` to join packed particles, or `spheres` to add some";
                self.conflict(&format!("{path}.set"), "gives both `set` and `spheres`", help);
            }
            (Some(set), None) => {
                self.known_set(&format!("{path}.set"), set);
                if clump.material.is_some() {
                    let help = "packed particles have a material already; change it in [[set]]";
                    self.conflict(&format!("{path}.material"), "has no effect with `set`", help);
                }
            }
            (None, Some(spheres)) => self.added_spheres(&format!("{path}.spheres"), spheres),
        }
    }

    /// Spheres of a clump; they may overlap.
    fn added_spheres(&mut self, key: &str, spheres: &[[Length; 4]]) {
        if spheres.is_empty() {
            self.range(key, "no spheres", "list at least one as [x, y, z, radius]");
        }
        self.radii_of_spheres(key, spheres);
    }
}
