//! Characterisation of lattices and of cut packings.

use super::*;
use crate::report::structure::page;
use concordem_contact::math::Vec3;
use concordem_packing::random_dense::{RandomDense, random_dense};
use concordem_packing::{Crop, Lattice, Shape, SizeDistribution};

fn of(packing: concordem_packing::Packing, shape: Option<Shape>) -> Characteristics {
    let choice = Choice { shape, ..Choice::default() };
    characterise(&Body::of_packing("packing".to_owned(), packing, &choice).unwrap(), 2.0).unwrap()
}

/// A periodic face-centered cubic lattice: 12 neighbors, solid fraction π/√18, all cells alike, fabric isotropic. The twelve directions
/// lie on edges or in faces of the geode: `e` is that of at least 12 and at most 48 faces, hundreds of times that of isotropic links.
#[test]
fn fcc_is_far_from_isotropic() {
    let found = of(Lattice::FaceCentered.periodic(1e-3, [5; 3]).unwrap(), None);
    assert_eq!((found.spheres, found.network.links), (500, 3000));
    assert_eq!(found.network.coordination.inside, 12.0);
    let close_packed = std::f64::consts::PI / 18.0_f64.sqrt();
    // A hundred roundings.
    approx::assert_relative_eq!(found.density.cell.unwrap()[1], close_packed, max_relative = 1e-12);
    approx::assert_relative_eq!(found.density.effective.unwrap(), close_packed, max_relative = 1e-12);
    assert!(found.density.cells.as_ref().unwrap().fraction[1] < 1e-12);
    for value in found.network.fabric.unwrap().1 {
        approx::assert_relative_eq!(value, 1.0 / 3.0, max_relative = 1e-12);
    }
    let o = &found.network.orientations;
    assert!(
        o.deviation() > (1.0 / 48.0 - 1.0 / 320.0) / 320.0 && o.deviation() < (1.0 / 12.0) / 320.0,
        "{}",
        o.deviation()
    );
    assert!(o.deviation_from_isotropy() > 100.0 * o.noise());
    assert!(found.density.hull.is_none() && found.layers.is_none() && found.boundary_depth.is_none());
    let g = found.pair_correlation.as_ref().unwrap();
    assert_eq!(g.centers, 500);
    // No neighbor nearer than 2R, the first shell at 2R, none until 2√2 R.
    let at = |r: f64| g.g[(r / 10.0 * g.g.len() as f64) as usize];
    assert!(at(1.9) == 0.0 && (at(2.01) > 10.0 || at(1.99) > 10.0) && at(2.4) == 0.0, "{:?}", &g.g[35..60]);
    let html = page(&found);
    assert!(html.contains("Rose of the links") && !html.contains("NaN"));
    assert_eq!(found.json()["coordination"]["inside"], 12.0);
}

/// A cube cut from a simple cubic lattice of 6³ touching spheres: those inside have six neighbors; hull and shape are the cube. The hull is
/// rounded at edges and corners by the spheres: (1 − π/4) R² per edge length 2·5R, and the corners.
#[test]
fn a_cubic_body() {
    let cube = Shape::new_box(Vec3::zeros(), Vec3::repeat(12.0)).unwrap();
    let packing = Lattice::SimpleCubic.fill(1.0, &cube, Crop::WholeSpheres, Vec3::repeat(1.0)).unwrap();
    let found = of(packing, Some(cube));
    assert_eq!(found.spheres, 216);
    let c = &found.network.coordination;
    assert_eq!((c.inside, c.particles_inside), (6.0, 64));
    let [volume, fraction] = found.density.shape.unwrap();
    approx::assert_relative_eq!(volume, 1728.0, max_relative = 1e-14);
    approx::assert_relative_eq!(fraction, std::f64::consts::PI / 6.0, max_relative = 1e-13);
    let pi = std::f64::consts::PI;
    let hull = 1728.0 - 12.0 * 10.0 * (1.0 - 0.25 * pi) - (8.0 - 4.0 / 3.0 * pi);
    // Planes 5° apart follow the rounding.
    approx::assert_relative_eq!(found.density.hull.unwrap()[0], hull, max_relative = 1e-3);
    approx::assert_relative_eq!(found.density.effective.unwrap(), pi / 6.0, max_relative = 1e-12);
    let layers = found.layers.unwrap();
    // Spheres of the outermost layer have their centers at depth 1: five, four, or three neighbors.
    assert_eq!(layers.particles.iter().sum::<u64>(), 216);
    let outermost = layers.particles.iter().position(|n| *n > 0).unwrap();
    assert_eq!(layers.particles[outermost], 152);
    approx::assert_relative_eq!(
        layers.links[outermost],
        (96.0 * 5.0 + 48.0 * 4.0 + 8.0 * 3.0) / 152.0,
        max_relative = 1e-14
    );
}

/// Random dense packings of dispersion 25 % are isotropic within a few times the scatter of independent links (contacts of a jammed
/// packing are not quite independent); the surface of a cut one has fewer links.
#[test]
fn a_cut_packing_has_a_weak_skin() {
    let sizes = SizeDistribution::Uniform { low: 0.875, high: 1.125 };
    let unit =
        random_dense(&RandomDense { sizes, ..RandomDense::jammed(600, 1.0, 0.0, 2) }, &mut |_| {}).unwrap().packing;
    let periodic = of(unit.clone(), None);
    let o = &periodic.network.orientations;
    assert!(
        (0.5..2.0).contains(&(o.deviation_from_isotropy() / o.noise())),
        "{}",
        o.deviation_from_isotropy() / o.noise()
    );
    approx::assert_abs_diff_eq!(periodic.sizes.dispersion, 0.25, epsilon = 0.005);
    // Overlaps count twice in the first and not at all in the second; both are the solid fraction of the periodic packing.
    let [_, fraction] = periodic.density.cell.unwrap();
    approx::assert_relative_eq!(periodic.density.effective.unwrap(), fraction, max_relative = 1e-12);
    let cylinder = Shape::new_cylinder(Vec3::new(0.0, 0.0, -7.0), Vec3::new(0.0, 0.0, 7.0), 7.0).unwrap();
    let cut = concordem_packing::tile_and_crop(&unit, &cylinder, Crop::Centers, Vec3::zeros()).unwrap();
    let found = of(cut, Some(cylinder));
    let c = &found.network.coordination;
    assert!(c.at_boundary < 0.85 * c.inside, "{c:?}");
    // Deeper than two radii the layers are those of the periodic packing; some 100 spheres there scatter by 0.02.
    let layers = found.layers.unwrap();
    let deep = || (0..layers.depth.len()).filter(|k| layers.depth[*k] > 2.0 && layers.volume[*k] > 0.0);
    let solid: f64 = deep().map(|k| layers.solid_fraction[k] * layers.volume[k]).sum();
    approx::assert_abs_diff_eq!(solid / deep().map(|k| layers.volume[k]).sum::<f64>(), fraction, epsilon = 0.04);
}

#[test]
fn bad_choices_are_refused() {
    let packing = Lattice::SimpleCubic.periodic(1.0, [3; 3]).unwrap();
    let body = |choice: Choice| Body::of_packing(String::new(), packing.clone(), &choice);
    assert!(body(Choice { interaction_ratio: Some(0.5), ..Choice::default() }).is_err());
    assert!(body(Choice { interaction_ratio: Some(1.2), coordination: Some(6.0), ..Choice::default() }).is_err());
    assert!(body(Choice { coordination: Some(500.0), ..Choice::default() }).is_err());
    assert!(body(Choice { shape: Some(Shape::new_sphere(Vec3::zeros(), 1.0).unwrap()), ..Choice::default() }).is_err());
    let flat = Lattice::Square.periodic(0.1, [3, 3, 1]).unwrap();
    assert!(Body::of_packing(String::new(), flat, &Choice::default()).is_err());
    assert!(characterise(&body(Choice::default()).unwrap(), f64::NAN).is_err());
}
