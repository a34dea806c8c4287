//! Characteristics as JSON. Lengths are in m, volumes in m³; numbers that do not exist are null.

use serde_json::{Value, json};

use super::{Characteristics, Links};

impl Links {
    /// Description for readers.
    pub fn text(self) -> String {
        match self {
            Self::Near(1.0) => "touching spheres".to_owned(),
            Self::Near(ratio) => format!("pairs up to {ratio:.6} times the sum of the radii"),
            Self::Bonds => "intact bonds".to_owned(),
            Self::Network => "links of the packing".to_owned(),
        }
    }
}

impl Characteristics {
    /// All measures as JSON.
    pub fn json(&self) -> Value {
        json!({
            "file": self.name,
            "spheres": self.spheres,
            "links": self.links.text(),
            "boundary_depth": self.boundary_depth,
            "coordination": self.coordination_json(),
            "solid_fraction": self.density_json(),
            "radii": {
                "mean": self.sizes.mean,
                "smallest": self.sizes.smallest,
                "largest": self.sizes.largest,
                "deviation": self.sizes.deviation,
                "dispersion": self.sizes.dispersion,
                "counts": self.sizes.counts,
            },
            "link_length_over_sum_of_radii": {
                "mean": self.network.length.map(|l| l[0]),
                "deviation": self.network.length.map(|l| l[1]),
                "smallest": self.network.length.map(|l| l[2]),
                "largest": self.network.length.map(|l| l[3]),
                "histogram": self.network.lengths,
            },
            "overlap_over_sum_of_radii": { "mean": self.network.overlap[0], "largest": self.network.overlap[1] },
            "fabric": self.network.fabric.map(|(tensor, eigenvalues)| json!({
                "tensor": tensor.transpose().data.0,
                "eigenvalues": eigenvalues,
            })),
            "isotropy": self.isotropy_json(),
            "layers": self.layers.as_ref().map(|layers| json!({
                "depth": layers.depth,
                "solid_fraction": layers.solid_fraction,
                "particles": layers.particles,
                "links": layers.links,
                "solid_fraction_below": layers.deeper,
            })),
            "pair_correlation": self.pair_correlation.as_ref().map(|g| json!({
                "distance": g.distance,
                "g": g.g,
                "centers": g.centers,
            })),
            "phases": self.phases.iter().map(|phase| json!({
                "material": phase.name,
                "particles": phase.particles,
                "share_of_solid": phase.share,
                "aggregates": phase.aggregates,
                "links_per_particle": phase.links,
            })).collect::<Vec<_>>(),
            "links_by_phase": self.links_by_phase.map(|[mortar, within, between, apart]| json!({
                "within_mortar": mortar,
                "within_aggregates": within,
                "mortar_to_aggregate": between,
                "between_aggregates": apart,
            })),
        })
    }

    fn coordination_json(&self) -> Value {
        let c = &self.network.coordination;
        json!({
            "inside": c.inside,
            "at_boundary": c.at_boundary,
            "all": c.of_all,
            "spheres_inside": c.particles_inside,
            "links": self.network.links,
            "links_inside": c.links_inside,
            "links_across": c.links_across,
            "links_at_boundary": c.links_at_boundary,
            "spheres_without_link": c.without,
        })
    }

    fn density_json(&self) -> Value {
        let d = &self.density;
        json!({
            "cell": d.cell.map(|v| v[1]),
            "hull": d.hull.map(|v| v[1]),
            "shape": d.shape.map(|v| v[1]),
            "effective": d.effective,
            "power_cells": d.cells.as_ref().map(|cells| json!({
                "cells": cells.count,
                "mean": cells.fraction[0],
                "deviation": cells.fraction[1],
                "histogram": cells.histogram,
            })),
            "volume_of_spheres": d.solid,
            "volume_of_cell": d.cell.map(|v| v[0]),
            "volume_of_hull": d.hull.map(|v| v[0]),
            "volume_of_shape": d.shape.map(|v| v[0]),
        })
    }

    fn isotropy_json(&self) -> Value {
        let o = &self.network.orientations;
        let noise = o.noise();
        json!({
            "links": o.links,
            "e": o.deviation(),
            "e_percent": o.deviation_percent(),
            "floor": o.floor,
            "floor_percent": 1e4 * o.floor,
            "e_less_floor": o.deviation() - o.floor,
            "e_less_floor_percent": 1e4 * (o.deviation() - o.floor),
            "from_solid_angles": o.deviation_from_isotropy(),
            "from_solid_angles_percent": 1e4 * o.deviation_from_isotropy(),
            "of_independent_isotropic_links": noise,
            "over_independent_isotropic_links": o.deviation_from_isotropy() / noise,
            "densities": o.densities(),
        })
    }
}
