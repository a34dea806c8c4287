//! Specimens: shape and position, and the cross-section and gauge length that stress and strain refer to.

use std::path::Path;

use concordem_contact::math::Vec3;
use concordem_scenario::assembly::{Assembly, assemble};
use concordem_scenario::schedule::{Loading, Simulation};
use concordem_scenario::schema::Scenario;

/// A block of spheres of radius 1 mm on a simple cubic lattice with points at multiples of 2 mm.
fn lattice(shape: &str, loading: &str) -> Result<Assembly, String> {
    let text = format!(
        "version = 1\n[packing]\nkind = \"lattice\"\nlattice = \"sc\"\nradius = \"1 mm\"\nshape = {shape}\n\
         [[material]]\nname = \"bar\"\ndensity = 2000\n[material.linear_bond]\nnormal_stiffness = 1e6\nshear_stiffness = 1e5\n\
         [bonds]\nlaw = \"linear_bond\"\ninteraction_ratio = 1.1\n[contacts]\nlaw = \"none\"\n\
         [loading]\n{loading}\n[stop]\nsteps = 1\n"
    );
    let scenario = Scenario::parse("test.toml", &text).map_err(|error| error.to_string())?;
    assemble(&scenario, Path::new(""), &mut |_, _| ()).map_err(|error| error.to_string())
}

const PULL: &str = "kind = \"uniaxial\"\naxis = \"x\"\nstrain_rate = \"2 1/s\"\nlayer_thickness = \"1.5 mm\"";

#[test]
fn a_shape_may_lie_anywhere_and_keep_centers_or_whole_spheres() {
    // The points at x = 0, 2, ... 8 mm lie in the box of 8.1 mm around x = 4 mm; the spheres at 2, 4, 6 mm lie entirely
    // inside.
    let shape =
        |keep: &str| format!("{{ kind = \"box\", size = [8.1e-3, 4.1e-3, 4.1e-3], center = [\"4 mm\", 0, 0]{keep} }}");
    for (keep, count, low, high) in
        [("", 3, 2e-3, 6e-3), (", keep = \"whole-spheres\"", 3, 2e-3, 6e-3), (", keep = \"centers\"", 5 * 9, 0.0, 8e-3)]
    {
        let state = lattice(&shape(keep), PULL).unwrap().state;
        let along = || state.particles.position.iter().map(|x| x.x);
        assert_eq!(state.particles.len(), count, "{keep}");
        assert!((along().fold(f64::INFINITY, f64::min) - low).abs() < 1e-12);
        assert!((along().fold(0.0, f64::max) - high).abs() < 1e-12);
    }
    let cylinder = "{ kind = \"cylinder\", radius = 2.5e-3, height = 8.1e-3, axis = \"x\", center = [0, \"20 mm\", 0], keep = \"centers\" }";
    let state = lattice(cylinder, PULL).unwrap().state;
    // Five layers, each with the point on the axis and its four neighbors 2 mm away.
    assert_eq!(state.particles.len(), 5 * 5);
    let mean = state.particles.position.iter().sum::<Vec3>() / 25.0;
    assert!((mean - Vec3::new(0.0, 0.02, 0.0)).norm() < 1e-12);
}

#[test]
fn stress_refers_to_the_hull_and_strain_to_the_gauge_length() {
    let shape = "{ kind = \"box\", size = [10.1e-3, 4.1e-3, 4.1e-3], keep = \"centers\" }";
    let dimensions =
        |more: &str| lattice(shape, &format!("{PULL}\n{more}")).unwrap().schedule.loading.dimensions().unwrap();
    // The centers span 8 mm by 4 mm by 4 mm; the shape is wider.
    let (area, length) = dimensions("");
    assert!((area - 4.1e-3 * 4.1e-3).abs() < 1e-18 && (length - 8e-3).abs() < 1e-15);
    let (area, length) = dimensions("area = \"hull\"\ngauge_length = \"5 mm\"");
    // A square of 4 mm, offset by 1 mm with round corners; polygons with 64 corners are up to 1.2e-3 mm inside the circles.
    let expected = 16e-6 + 4.0 * 4e-6 + std::f64::consts::PI * 1e-6;
    assert!(area < expected && expected - area < 1.3e-3 * 24e-6, "{area}");
    assert!((length - 5e-3).abs() < 1e-18);

    // The ends separate at the strain rate times the gauge length.
    let Assembly { state, schedule, .. } = lattice(shape, &format!("{PULL}\ngauge_length = \"5 mm\"")).unwrap();
    let Loading::Uniaxial { layers, distance, .. } = &schedule.loading else { panic!("uniaxial") };
    let speed = |layer: &[u32]| state.particles.velocity[layer[0] as usize].x;
    assert!((speed(&layers[1]) - speed(&layers[0]) - 2.0 * 5e-3).abs() < 1e-15);
    assert!((distance - 8e-3).abs() < 1e-15);
}

/// A hyperboloid breaks at its waist, so stress refers to the section there.
#[test]
fn stress_of_a_hyperboloid_refers_to_its_waist() {
    let shape = "{ kind = \"hyperboloid\", radius = 7e-3, waist_radius = 5e-3, height = 16e-3, axis = \"x\", keep = \"centers\" }";
    let (area, _) = lattice(shape, PULL).unwrap().schedule.loading.dimensions().unwrap();
    assert!((area / (25e-6 * std::f64::consts::PI) - 1.0).abs() < 1e-15, "{area}");
}

/// Ends that turn move freely along the axis. After a blow on the middle of a column each end follows its own net force, `v' = v + FΔt/m`, and
/// the column keeps its momentum while it swings; ends that follow the force of the step before gain energy in each period. Rounding of
/// velocities of 1 m/s, over 3,000 steps.
#[test]
fn turning_ends_move_freely_along_the_axis() {
    let shape = "{ kind = \"cylinder\", radius = 1.1e-3, height = 24e-3, axis = \"x\" }";
    let torsion = "kind = \"torsion\"\naxis = \"x\"\nrate = 1\nlayer_thickness = \"3 mm\"";
    let Assembly { state, model, schedule, .. } = lattice(shape, torsion).unwrap();
    let Loading::Turning { layers, .. } = schedule.loading.clone() else { panic!("torsion") };
    let mut run = Simulation::new(state, model, schedule).unwrap();
    let middle = run.state.particles.len() / 2;
    run.state.particles.velocity[middle].x = 1.0;
    let momentum = |run: &Simulation| {
        let particles = &run.state.particles;
        particles.velocity.iter().zip(&particles.mass).map(|(v, m)| v.x * m).sum::<f64>()
    };
    let start = momentum(&run);
    let mut fastest = [0.0_f64; 2];
    for _ in 0..3000 {
        let sum = |layer: &[u32], of: &dyn Fn(usize) -> f64| layer.iter().map(|&p| of(p as usize)).sum::<f64>();
        let before = layers.each_ref().map(|layer| {
            let particles = &run.state.particles;
            sum(layer, &|p| particles.velocity[p].x) / layer.len() as f64
        });
        run.advance().unwrap();
        let particles = &run.state.particles;
        for ((layer, before), fastest) in layers.iter().zip(before).zip(&mut fastest) {
            let force = sum(layer, &|p| run.solver.forces()[p].x);
            let expected = before + force / sum(layer, &|p| particles.mass[p]) * run.state.clock.dt;
            let found = particles.velocity[layer[0] as usize].x;
            assert!((found - expected).abs() < 1e-14, "{found} {expected}");
            *fastest = fastest.max(found.abs());
        }
    }
    assert!((momentum(&run) / start - 1.0).abs() < 1e-11, "{} {start}", momentum(&run));
    // They never move faster than the sphere did after the blow.
    assert!(fastest.iter().all(|speed| (1e-3..1.0).contains(speed)), "{fastest:?}");
}

#[test]
fn a_hull_of_discs_is_refused() {
    let text = "version = 1\ndimension = 2\n[packing]\nkind = \"lattice\"\nlattice = \"square\"\nradius = \"1 mm\"\nrepeats = [9, 9, 1]\n\
                [[material]]\nname = \"bar\"\ndensity = 2000\n[material.linear_bond]\nnormal_stiffness = 1e6\nshear_stiffness = 1e5\n\
                [bonds]\nlaw = \"linear_bond\"\ninteraction_ratio = 1.1\n[contacts]\nlaw = \"none\"\n\
                [loading]\nkind = \"uniaxial\"\naxis = \"x\"\nstrain_rate = 1\narea = \"hull\"\n[stop]\nsteps = 1\n";
    let error = format!("{:?}", Scenario::parse("test.toml", text).unwrap_err());
    assert!(error.contains("hull"), "{error}");
}
