//! What a device cannot do of a scenario.

use super::Checker;
use crate::schema::{Damping, Document, LawName, Loading, Scenario, ScenarioError};
use concordem_contact::kinematics::MotionMeasure;

impl Scenario {
    /// Check that a device can take steps of this scenario ([`Simulation::use_device`](crate::schedule::Simulation::use_device)).
    ///
    /// # Errors
    /// All keys that no device supports.
    pub fn check_device(&self) -> Result<(), ScenarioError> {
        let Ok(document) = Document::parse(&self.source) else { return Ok(()) };
        let mut checker = Checker { document: &document, scenario: self, problems: Vec::new() };
        checker.device();
        if checker.problems.is_empty() { Ok(()) } else { Err(ScenarioError::new(&self.source, checker.problems)) }
    }
}

impl Checker<'_> {
    fn device(&mut self) {
        let scenario = self.scenario;
        if scenario.packing.is_periodic() {
            let key = if scenario.packing.shape().is_some() { "packing.shape.kind" } else { "packing.cell" };
            self.not_on_device(key, "periodic cells");
        }
        if !matches!(scenario.loading, Loading::None | Loading::Uniaxial { .. }) {
            self.not_on_device("loading.kind", "this loading");
        } else if scenario.loading.opening().is_some() {
            self.not_on_device("loading.opening", "a loading that follows a gauge");
        }
        if scenario.kinematics != MotionMeasure::Finite {
            self.not_on_device("kinematics", "kinematics other than \"finite\"");
        }
        if !matches!(scenario.integration.damping, Damping::None | Damping::Local { .. }) {
            self.not_on_device("integration.damping.kind", "this damping");
        }
        for (given, key, what) in [
            (!scenario.stages.is_empty(), "stage", "stages"),
            (!scenario.walls.is_empty(), "wall", "walls"),
            (!scenario.membranes.is_empty(), "membrane", "membranes"),
            (!scenario.clumps.is_empty(), "clump", "clumps"),
            (!scenario.forces.is_empty(), "force", "forces on particles"),
            (!scenario.joints.is_empty(), "joint", "joints"),
            (!scenario.slaves.is_empty(), "slave", "motions of files"),
            (!scenario.bondings.is_empty(), "bonding", "bonds made during the run"),
        ] {
            if given {
                self.not_on_device(&format!("{key}[0]"), what);
            }
        }
        if scenario.heat.is_some() {
            self.not_on_device("heat", "heat");
        }
        for (at, prescribe) in scenario.prescribed.iter().enumerate() {
            if prescribe.history.is_some() {
                self.not_on_device(&format!("prescribe[{at}].history"), "motions that change with time");
            }
        }
        if scenario.bonds.as_ref().is_some_and(|bonds| !bonds.strength_factors.is_empty()) {
            self.not_on_device("bonds.strength_factors", "strengths that differ");
        }
        for (at, material) in scenario.materials.iter().enumerate() {
            if material.deformable.is_some() {
                self.not_on_device(&format!("material[{at}].deformable"), "deformable particles");
            }
            if material.strength_scatter.is_some() {
                self.not_on_device(&format!("material[{at}].strength_scatter"), "strengths that scatter");
            }
            let law: Option<LawName> = scenario.bonds.as_ref().map(|bonds| bonds.law);
            let table = law.and_then(|law| Some((law, material.table_of(law)?)));
            if let Some((law, _)) = table.filter(|(_, table)| table.hydrostatic_strength().is_some()) {
                let key = format!("material[{at}].{}.hydrostatic_strength", law.key());
                self.not_on_device(&key, "a mean stress at which particles fail");
            }
        }
    }

    fn not_on_device(&mut self, key: &str, what: &str) {
        self.conflict(key, format!("a device does not support {what}"), "run without --device");
    }
}
