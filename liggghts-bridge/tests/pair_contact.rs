//! Contacts of LIGGGHTS' neighbor lists: its own models reproduced, and ConcorDEM laws.

use std::fmt::Write as _;

use crate::harness::spheres::{cloud, difference, floor, result};
use crate::harness::{Atom, Dumped, data_file, dump, frames, head, run, tables};
use concordem_contact::law::{Elastic, HertzMindlin};
use concordem_contact::math::Vec3;
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::surface::Plane;
use concordem_solver::state::{Particles, Sphere, State, Wall, WallShape};
use concordem_solver::{Model, PairCoefficients, Scheme, Solver};

#[test]
fn liggghts_models_are_reproduced() {
    let folder = tempfile::tempdir().unwrap();
    cloud(&folder.path().join("cloud.data"));
    for model in ["hertz", "hertz/stiffness", "hooke", "hooke/stiffness"] {
        for shear in ["history", "no_history", "off"] {
            let native = result(
                folder.path(),
                &format!("pair_style gran model {model} tangential {shear}\npair_coeff * *"),
                1,
                2,
            );
            let pair = format!("pair_style gran model concordem/{model} tangential {shear}\npair_coeff * *");
            let ours = result(folder.path(), &pair, 1, 2);
            let apart = difference(&ours, &native);
            println!("{model} {shear}: {apart:?}");
            // The spheres must have collided, which changes velocities considerably.
            let first = difference(&native[..1], &native[native.len() - 1..]);
            assert!(first[1] > 0.1, "{first:?}");
            // Rounding, amplified by collisions; the run is short enough that both trajectories agree.
            assert!(apart.iter().all(|d| *d < 1e-12), "{model} {shear}: {apart:?}");
        }
    }
}

#[test]
fn liggghts_walls_are_reproduced() {
    let folder = tempfile::tempdir().unwrap();
    cloud(&folder.path().join("cloud.data"));
    floor(folder.path());
    for model in ["hertz", "hertz/stiffness", "hooke", "hooke/stiffness"] {
        for shear in ["history", "no_history", "off"] {
            let with = |prefix: &str| {
                let model = format!("model {prefix}{model} tangential {shear}");
                // Both runs use the native pair style; only the walls differ.
                let native = model.replace("concordem/", "");
                let pair = format!(
                    "pair_style gran {native}\npair_coeff * *\nfix mesh all mesh/surface file floor.stl type 1\n\
                     fix floor all wall/gran {model} mesh n_meshes 1 meshes mesh\n\
                     fix side all wall/gran {model} primitive type 2 xplane 0.01"
                );
                result(folder.path(), &pair, 1, 2)
            };
            let (native, ours) = (with(""), with("concordem/"));
            let apart = difference(&ours, &native);
            println!("{model} {shear}: {apart:?}");
            // Rounding, amplified by collisions; the run is short enough that both trajectories agree.
            assert!(apart.iter().all(|d| *d < 1e-12), "{model} {shear}: {apart:?}");
        }
    }
}

/// `compute pair/gran/local` and `wall/gran/local`: forces, torques, and histories per contact.
#[test]
fn rows_of_local_computes_equal_those_of_liggghts() {
    let folder = tempfile::tempdir().unwrap();
    cloud(&folder.path().join("cloud.data"));
    floor(folder.path());
    let rows = |prefix: &str, beside: &str, processors: usize| {
        let model = format!("model {prefix}hertz tangential history {beside}");
        // Shear, and the rolling spring.
        let histories = if beside.is_empty() { 3 } else { 6 };
        let columns: Vec<String> = (10..=10 + histories).map(|column| format!(" c_pairs[{column}]")).collect();
        let more = columns.concat();
        let pair = format!(
            "fix r1 all property/global coefficientRollingFriction peratomtypepair 2 0.5 0.3 0.3 0.4\n\
             fix r2 all property/global cohesionEnergyDensity peratomtypepair 2 2e5 1e5 1e5 3e5\npair_style gran {model}\npair_coeff * *\nfix mesh all mesh/surface file floor.stl type 1\n\
             fix floor all wall/gran {model} mesh n_meshes 1 meshes mesh\n\
             compute pairs all pair/gran/local id force torque history delta\ncompute walls all wall/gran/local id force torque\n\
             dump pairs all local 100 pairs.dump c_pairs[1] c_pairs[2] c_pairs[4] c_pairs[5] c_pairs[6] c_pairs[7] c_pairs[8] \
             c_pairs[9]{more}\ndump_modify pairs format \"{}\"\n\
             dump walls all local 100 walls.dump c_walls[3] c_walls[3] c_walls[4] c_walls[5] c_walls[6] c_walls[7] c_walls[8] c_walls[9]\n\
             dump_modify walls format \"{}\"",
            "%.17g ".repeat(9 + histories),
            "%.17g ".repeat(8),
        );
        result(folder.path(), &pair, processors, 1);
        ["pairs.dump", "walls.dump"].map(|name| {
            let mut steps = tables(&folder.path().join(name));
            for (_, rows) in &mut steps {
                rows.sort_by(|a, b| a.partial_cmp(b).unwrap());
            }
            steps
        })
    };
    for (beside, processors) in [("", 1), ("", 2), ("cohesion sjkr rolling_friction epsd2", 2)] {
        // Ghosts lack the last half step of the velocities, so LIGGGHTS' rows depend on the number of processors, and ours do too.
        let native = rows("", beside, processors);
        for (ours, native) in rows("concordem/", beside, processors).iter().zip(&native) {
            let mut seen = 0;
            assert_eq!(ours.len(), native.len());
            for ((step, ours), (_, native)) in ours.iter().zip(native) {
                assert_eq!(ours.len(), native.len(), "step {step}");
                let end = ours.first().map_or(8, Vec::len);
                // Force, torque; of pairs also shear, the spring of rolling friction, and overlap.
                let of_pairs = if end > 8 { vec![8..11, 11..end - 1, end - 1..end] } else { Vec::new() };
                for columns in [2..5, 5..8].into_iter().chain(of_pairs) {
                    let size =
                        native.iter().flat_map(|row| &row[columns.clone()]).fold(0.0f64, |most, x| most.max(x.abs()));
                    for (a, b) in ours.iter().zip(native) {
                        assert_eq!(a[..2], b[..2], "step {step}");
                        // Tolerance: rounding, amplified by some hundred steps of collisions.
                        // LIGGGHTS stores how far the first particle slid on the second; our laws store the opposite.
                        let sign = if columns == (8..11) { -1.0 } else { 1.0 };
                        let close = |(x, y): (&f64, &f64)| (sign * x - y).abs() <= 1e-11 * size;
                        assert!(
                            a[columns.clone()].iter().zip(&b[columns.clone()]).all(close),
                            "step {step}: {a:?} {b:?}"
                        );
                        seen += 1;
                    }
                }
            }
            assert!(seen > 60, "{seen} contacts only");
        }
    }
}

/// With ConcorDEM laws, the rows are the forces that acted, so they add up to the forces on the atoms.
#[test]
fn rows_of_concordem_contacts_add_up_to_the_forces() {
    let folder = tempfile::tempdir().unwrap();
    cloud(&folder.path().join("cloud.data"));
    for model in ["hertz_mindlin", "frictional"] {
        for processors in [1, 2] {
            let pair = format!(
                "pair_style gran model concordem/{model}\npair_coeff * *\ncompute pairs all pair/gran/local id force torque\n\
                 dump pairs all local 100 pairs.dump c_pairs[1] c_pairs[2] c_pairs[4] c_pairs[5] c_pairs[6] c_pairs[7] c_pairs[8] \
                 c_pairs[9]\ndump_modify pairs format \"{}\"",
                "%.17g ".repeat(8)
            );
            let states = result(folder.path(), &pair, processors, 1);
            let rows = tables(&folder.path().join("pairs.dump"));
            assert_eq!(rows.len(), states.len());
            let mut seen = 0;
            for ((step, atoms), (_, rows)) in states.iter().zip(&rows) {
                let mut sums = vec![(Vec3::zeros(), Vec3::zeros()); atoms.len()];
                for n in rows {
                    let [i, j] = [n[0] as usize - 1, n[1] as usize - 1];
                    let (force, torque) = (Vec3::new(n[2], n[3], n[4]), Vec3::new(n[5], n[6], n[7]));
                    // Conservation of angular momentum of the pair gives the torque on the other atom.
                    let between = atoms[i].position - atoms[j].position;
                    sums[i].0 += force;
                    sums[i].1 += torque;
                    sums[j].0 -= force;
                    sums[j].1 -= torque + between.cross(&force);
                }
                seen += rows.len();
                let largest = |get: fn(&Dumped) -> Vec3| atoms.iter().map(|a| get(a).norm()).fold(0.0, f64::max);
                let (most_force, most_torque) = (largest(|a| a.force), largest(|a| a.torque));
                for (k, ((force, torque), atom)) in sums.iter().zip(atoms).enumerate() {
                    // Tolerances: terms are summed in another order; torques use another formula, with positions of 1e-1 m and arms of
                    // 5e-3 m.
                    let apart = ((force - atom.force).norm(), (torque - atom.torque).norm());
                    assert!(
                        apart.0 <= 1e-13 * most_force && apart.1 <= 1e-12 * most_torque,
                        "{model}, {processors} processors, step {step}, atom {}: {apart:?} of {most_force} N, {most_torque} N·m",
                        k + 1
                    );
                }
            }
            assert!(seen > 60, "{seen} contacts only");
        }
    }
}

#[test]
fn a_concordem_law_at_a_wall_acts_as_in_our_solver() {
    const DT: f64 = 2e-6;
    let folder = tempfile::tempdir().unwrap();
    let mut sphere = Atom::resting(Vec3::new(0.0, 0.0, 0.0052), 0.005);
    sphere.velocity = Vec3::new(0.5, 0.2, -1.0);
    sphere.spin = Vec3::new(30.0, -80.0, 10.0);
    data_file(&folder.path().join("one.data"), &[sphere], Vec3::repeat(-0.02), Vec3::repeat(0.05));
    let model = "model concordem/hertz_mindlin";
    let mut script = head("one.data", "f f f", 1e-3, DT);
    writeln!(
        script,
        "pair_style gran {model}\npair_coeff * *\nfix p1 all property/global youngsModulus peratomtype 2e7\n\
         fix p2 all property/global poissonsRatio peratomtype 0.25\n\
         fix p3 all property/global coefficientRestitution peratomtypepair 1 0.7\n\
         fix p4 all property/global coefficientFriction peratomtypepair 1 0.3\n\
         fix integrate all nve/sphere\nfix floor all wall/gran {model} primitive type 1 zplane 0.0"
    )
    .unwrap();
    script.push_str(&dump("out.dump", 50));
    script.push_str("run 600\n");
    run(folder.path(), &script, 1);

    let elastic = Elastic { young: 2e7, poisson: 0.25 };
    let law = HertzMindlin::new(elastic, elastic, 0.3, 0.7).unwrap();
    let mut particles = Particles::default();
    let r = sphere.radius;
    let mass = 4.0 * std::f64::consts::PI / 3.0 * r * r * r * sphere.density;
    particles.push(Sphere { position: sphere.position, radius: r }, 0, mass, 0.4 * mass * (r * r));
    particles.velocity[0] = sphere.velocity;
    particles.angular_velocity[0] = sphere.spin;
    let floor =
        Wall::new("floor", WallShape::rigid(Plane { point: Vec3::zeros(), normal: Vec3::z() }), 1, Vec3::zeros());
    let mut state = State {
        particles,
        walls: vec![floor],
        wall_contacts: Some(Box::new(ContactBlock::new(vec![law]))),
        ..State::default()
    };
    state.clock.dt = DT;
    let mut wall_rows = PairCoefficients::new(2);
    wall_rows.set(0, 1, 0);
    let model = Model { wall_rows, scheme: Scheme::VelocityVerlet, ..Model::default() };
    let mut solver = Solver::new(model, &mut state).unwrap();
    let mut touched = false;
    for (step, atoms) in frames(&folder.path().join("out.dump")) {
        while state.clock.step < step {
            touched |= solver.step(&mut state).unwrap().active[2] > 0;
        }
        let apart = (atoms[0].position - state.particles.position[0]).norm() / r;
        println!("step {step}: {apart:.1e} radii apart");
        // Rounding of some hundred steps.
        assert!(apart < 1e-12, "step {step}: {apart:e}");
    }
    let end = state.particles.velocity[0];
    assert!(touched && end.z > 0.5, "the sphere was meant to bounce: {end}");
}

#[test]
fn concordem_contacts_are_equal_by_pair_style_and_by_fix() {
    let folder = tempfile::tempdir().unwrap();
    cloud(&folder.path().join("cloud.data"));
    let materials = [(5e6, 0.3, 0.9, 0.4), (2e7, 0.2, 0.5, 0.2)];
    let mut tables = String::new();
    for (k, (young, poisson, restitution, friction)) in materials.iter().enumerate() {
        writeln!(
            tables,
            "[[material]]\nname = \"{k}\"\ndensity = 2500\n[material.hertz_mindlin]\nyoung = {young:e}\npoisson = {poisson}\n\
             restitution = {restitution}\nfriction_coefficient = {friction}\n[material.linear_bond]\nnormal_stiffness = 1\n\
             shear_stiffness = 1\n"
        )
        .unwrap();
    }
    std::fs::write(folder.path().join("materials.toml"), tables).unwrap();
    // For unlike types, the fix uses the mean restitution and the smaller friction, so the properties are set accordingly.
    let fix = "fix contacts all concordem/bond linear_bond materials materials.toml bond none contact hertz_mindlin";
    let by_fix = result(folder.path(), fix, 1, 1);
    for processors in [1, 2, 4] {
        let by_pair =
            result(folder.path(), "pair_style gran model concordem/hertz_mindlin\npair_coeff * *", processors, 1);
        let apart = difference(&by_pair, &by_fix);
        println!("{processors} processors: {apart:?}");
        // The pair style sums in the order of LIGGGHTS' lists; collisions amplify the rounding differences.
        assert!(apart.iter().all(|d| *d < 1e-12), "{apart:?}");
    }
}
