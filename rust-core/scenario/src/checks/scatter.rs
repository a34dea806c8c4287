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

    /// Factors that the scenario gives: positive, for rigid particles whose bonds have a strength.
    pub(super) fn strength_factors(&mut self) {
        let scenario = self.scenario;
        let Some(bonds) = scenario.bonds.as_ref().filter(|bonds| !bonds.strength_factors.is_empty()) else { return };
        let path = "bonds.strength_factors";
        if let Some(at) = bonds.strength_factors.iter().position(|factor| factor.si() <= 0.0) {
            self.range(
                &format!("{path}[{at}]"),
                "must be positive",
                "a bond without strength is no bond: leave it out",
            );
        }
        if scenario.aggregates.is_some() {
            let message = "not with [aggregates], whose pores remove spheres";
            return self.conflict(path, message, "give the aggregates by [phases]");
        }
        if scenario.fibers.is_some() {
            let message = "not with [fibers], which remove the spheres in their way";
            return self.conflict(path, message, "use material.strength_scatter");
        }
        if let Some(at) = scenario.materials.iter().position(|material| material.deformable.is_some()) {
            let message = format!("not with deformable particles (material[{at}].deformable)");
            return self.conflict(path, message, "remove one of the two");
        }
        let bonded = materials_of_particles(scenario);
        let of_bonds = scenario.materials.iter().filter(|material| bonded.contains(&&material.name[..]));
        let faults =
            of_bonds.filter(|material| material.has(bonds.law)).filter_map(|m| m.fault_of_strengths(Some(bonds.law)));
        for fault in faults.collect::<Vec<_>>() {
            self.fault(path, fault);
        }
    }

    fn law_of_fibers(&self, material: &Material) -> Option<LawName> {
        let fibers = self.scenario.fibers.as_ref()?;
        fibers.groups.iter().any(|group| group.material == material.name).then_some(LawName::CohesiveBeam)
    }
}
