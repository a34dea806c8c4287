//! Heat that flows along the links and through the surface: the input of the mean flux of a region.

use concordem_contact::math::Vec3;

use super::pass::HeatPass;
use super::{HeatModel, HeatState};
use crate::state::{Cell, Particles};

/// Heat that flows along vectors. Their sum `Σ flow × branch` over a volume is its mean heat flux times the volume.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HeatFlows {
    /// Particles of each link; twice the same particle for its surface.
    pub pair: Vec<[u32; 2]>,
    /// From the center of the first particle to that of the second, or to the surface, m.
    pub branch: Vec<Vec3>,
    /// Heat in the direction of the branch, W.
    pub flow: Vec<f64>,
}

impl HeatPass {
    /// The heat that flows at the present temperatures and positions, through the contacts of the last call of [`Self::touch`].
    ///
    /// Of the images of a particle, a link ends at that whose branch is nearest to its branch at the start.
    pub fn flows(&self, model: &HeatModel, particles: &Particles, cell: Option<&Cell>, heat: &HeatState) -> HeatFlows {
        let conductances = self.present_conductances(model, particles, heat);
        let inverse = cell.and_then(|cell| cell.matrix.try_inverse().map(|inverse| (cell.matrix, inverse)));
        let mut flows = HeatFlows::default();
        for (link, conductance) in model.network.links.iter().zip(conductances) {
            let (a, b) = (link.a as usize, link.b as usize);
            let mut branch = particles.position[b] - particles.position[a];
            if let Some((matrix, inverse)) = inverse {
                branch += matrix * (inverse * (link.branch - branch)).map(f64::round);
            }
            flows.pair.push([link.a, link.b]);
            flows.branch.push(branch);
            flows.flow.push(conductance * (heat.temperature[a] - heat.temperature[b]));
        }
        for (pair, branch, conductance) in self.touching_now.iter() {
            let [a, b] = pair.map(|p| heat.temperature[p as usize]);
            flows.pair.push(pair);
            flows.branch.push(branch);
            flows.flow.push(conductance * (a - b));
        }
        for (exposure, exchange, factor) in self.surfaces(model) {
            let p = exposure.particle as usize;
            let conductivity = model.conductivity(particles.material[p], heat.temperature[p]);
            let (inward, _) = exchange.flow(exposure, conductivity, heat.temperature[p], factor);
            flows.pair.push([exposure.particle; 2]);
            flows.branch.push(exposure.normal * exposure.distance);
            flows.flow.push(-inward);
        }
        flows
    }
}
