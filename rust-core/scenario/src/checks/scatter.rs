//! Strengths of bonds that scatter.

use super::Checker;
use super::laws::materials_of_particles;
use crate::schema::Material;
use concordem_contact::law::LawName;

impl Checker<'_> {
    /// Tables `strength_scatter` of the materials: a distribution, and bonds with a strength that takes factors.
    pub(super) fn strength_scatter(&mut self) {
        let scenario = self.scenario;
        let of_bonds = scenario.bonds.as_ref().map(|bonds| bonds.law);
        let deformable = scenario.materials.iter().position(|material| material.deformable.is_some());
        for (at, material) in scenario.materials.iter().enumerate() {
            if material.strength_scatter.is_none() {
                continue;
            }
            let path = format!("material[{at}].strength_scatter");
            if let Some(other) = deformable {
                let message = format!("not with deformable particles (material[{other}].deformable)");
                self.conflict(&path, message, "remove one of the two");
                continue;
            }
            let law = of_bonds.filter(|law| material.has(*law)).or_else(|| self.law_of_fibers(material));
            // Then the table of the law is missing, which is a problem of its own.
            if law.is_none() && of_bonds.is_some() && materials_of_particles(scenario).contains(&&material.name[..]) {
                continue;
            }
            for fault in material.faults_of_scatter(law) {
                self.fault(&path, fault);
            }
        }
    }

    fn law_of_fibers(&self, material: &Material) -> Option<LawName> {
        let fibers = self.scenario.fibers.as_ref()?;
        fibers.groups.iter().any(|group| group.material == material.name).then_some(LawName::CohesiveBeam)
    }
}
