//! Check of `bonds.face_correction`.

use super::Checker;
use crate::schema::{Packing, Shape};
use concordem_contact::law::LawName;
use concordem_packing::Crop;

impl Checker<'_> {
    /// The correction needs bonds with an area, made at the start, in a body whose centers fill it, and that is cut from a periodic packing.
    pub(super) fn face_correction(&mut self) {
        let scenario = self.scenario;
        let Some(bonds) = scenario.bonds.as_ref().filter(|bonds| bonds.face_correction) else { return };
        let path = "bonds.face_correction";
        if bonds.law != LawName::Cpm {
            let message = format!("is for \"cpm\", not for \"{}\"", bonds.law.key());
            return self.conflict(path, message, "remove the key");
        }
        if !bonds.at_start {
            return self.conflict(path, "without bonds at the start", "remove the key, or `at_start = false`");
        }
        let cuts_periodic = match &scenario.packing {
            Packing::RandomDense { .. } => true,
            // A sphere pack may hold its cell: the assembly knows.
            Packing::File { shape, .. } => shape.is_some(),
            _ => false,
        };
        let shape = scenario.packing.shape().filter(|shape| !matches!(shape, Shape::Periodic { .. }));
        let Some(shape) = shape.filter(|_| cuts_periodic) else {
            let message = "needs a body that is cut from a periodic packing";
            return self.conflict(path, message, "remove the key, or cut a shape out of a \"random-dense\" packing");
        };
        if shape.keep() == Some(Crop::WholeSpheres) {
            let message = "with `packing.shape.keep = \"whole-spheres\"` the faces are those of the spheres";
            self.conflict(path, message, "remove one of the two");
        }
    }
}
