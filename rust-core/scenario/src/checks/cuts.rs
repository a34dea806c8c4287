//! Checks of cuts.

use super::Checker;
use crate::schema::CutShape;
use crate::schema::quantity::vector;

impl Checker<'_> {
    pub(super) fn cuts(&mut self) {
        let scenario = self.scenario;
        for (at, cut) in scenario.cuts.iter().enumerate() {
            let key = format!("cut[{at}]");
            if scenario.bonds.is_none() && !cut.remove_particles {
                let help = "add [bonds], or remove the cut";
                self.conflict(&key, "has no effect on a scenario without bonds", help);
            }
            if cut.remove_particles && !cut.shape.is_solid() {
                let help = "use \"box\", \"sphere\", or \"cylinder\", or remove `remove_particles`";
                self.conflict(&format!("{key}.remove_particles"), "this shape has no inside", help);
            }
            self.cut_shape(&format!("{key}.shape"), &cut.shape);
        }
    }

    fn cut_shape(&mut self, path: &str, shape: &CutShape) {
        let plane = self.scenario.dimension == 2;
        match shape {
            CutShape::Line { from, to } => {
                if !plane {
                    let help = "use \"parallelogram\" in three dimensions";
                    self.conflict(&format!("{path}.kind"), "a line cuts only in two dimensions", help);
                }
                if from.iter().zip(to).all(|(a, b)| a.si() == b.si()) {
                    self.range(&format!("{path}.to"), "is the same point as `from`", "give the other end of the line");
                }
            }
            CutShape::Parallelogram { edges, .. } => {
                let [u, v] = [vector(&edges[0]), vector(&edges[1])];
                if u.cross(&v).norm() <= 1e-9 * u.norm() * v.norm() {
                    let help = "give two edges with different directions";
                    self.range(&format!("{path}.edges"), "the edges span no area", help);
                }
            }
            CutShape::Box { minimum, maximum } => self.corners(path, minimum, maximum),
            CutShape::Sphere { .. } | CutShape::Cylinder { .. } | CutShape::Facets { .. } => {}
        }
    }
}
