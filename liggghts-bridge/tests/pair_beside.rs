//! LIGGGHTS' models of cohesion and rolling friction beside our models of `pair_style gran` and `fix wall/gran`.

mod harness;

use std::f64::consts::PI;
use std::fmt::Write as _;

use concordem_contact::math::Vec3;
use harness::spheres::{STEPS, cloud, difference, floor, model, result};
use harness::{Atom, Dumped, data_file, dump, frames, head, run};

/// Properties of LIGGGHTS' cohesion and rolling models.
const PROPERTIES: &str = "fix q1 all property/global coefficientRollingFriction peratomtypepair 2 0.02 0.01 0.01 0.03\n\
    fix q2 all property/global coefficientRollingViscousDamping peratomtypepair 2 0.3 0.2 0.2 0.1\n\
    fix q3 all property/global rollingStiffness scalar 2.0\n\
    fix q4 all property/global cohesionEnergyDensity peratomtypepair 2 2e5 1e5 1e5 3e5\n\
    fix q5 all property/global surfaceLiquidContentInitial scalar 0.02\n\
    fix q6 all property/global surfaceTension scalar 0.5\n\
    fix q7 all property/global fluidViscosity scalar 0.01\n\
    fix q8 all property/global contactAngle peratomtype 0.3 0.4\n\
    fix q9 all property/global minSeparationDistanceRatio scalar 1.01\n\
    fix q10 all property/global maxSeparationDistanceRatio scalar 1.1\n";

/// Pair style and walls with the models `models` and the settings `settings`, which LIGGGHTS wants last. Walls get no model easo, with
/// which LIGGGHTS ends with a memory fault.
fn with_walls(models: &str, settings: &str) -> String {
    let walls = models.replace("cohesion easo/capillary/viscous", "");
    format!(
        "{PROPERTIES}pair_style gran {models} {settings}\npair_coeff * *\nfix mesh all mesh/surface file floor.stl type 1\n\
         fix floor all wall/gran {walls} mesh n_meshes 1 meshes mesh {settings}\n\
         fix side all wall/gran {walls} primitive type 2 xplane 0.01 {settings}"
    )
}

#[test]
fn each_model_acts_as_beside_liggghts_own() {
    let folder = tempfile::tempdir().unwrap();
    cloud(&folder.path().join("cloud.data"));
    floor(folder.path());
    let moved =
        |models: &str, settings: &str| result(folder.path(), &with_walls(&format!("model {models}"), settings), 1, 2);
    for (own, beside, settings) in [
        ("hertz tangential history", "rolling_friction cdt", "torsionTorque on"),
        ("hooke/stiffness tangential history", "rolling_friction epsd", ""),
        ("hooke tangential no_history", "rolling_friction epsd2", "torsionTorque on"),
        ("hertz/stiffness tangential history", "rolling_friction epsd3", ""),
        ("hertz tangential history", "cohesion sjkr", "tangential_reduce on"),
        ("hooke/stiffness tangential off", "cohesion sjkr2 rolling_friction cdt", ""),
        ("hooke tangential no_history", "cohesion washino/capillary/viscous", "tangential_reduce on"),
        ("hertz/stiffness tangential history", "cohesion easo/capillary/viscous rolling_friction epsd2", ""),
    ] {
        let of = |prefix: &str| format!("{prefix}{own} {beside}");
        let (theirs, ours) = (moved(&of(""), settings), moved(&of("concordem/"), settings));
        let apart = difference(&ours, &theirs);
        let effect = difference(&theirs, &moved(own, ""));
        println!("{own} {beside} {settings}: {apart:?}, effect {effect:?}");
        assert!(effect[2] > 1e-3, "the models were meant to change the motion: {effect:?}");
        // Rounding, amplified by collisions; as without the models.
        assert!(apart.iter().all(|d| *d < 1e-12), "{own} {beside}: {apart:?}");
    }
}

const BOTH: &str = "model concordem/hertz tangential history cohesion sjkr2 rolling_friction epsd";

#[test]
fn two_and_four_processors_give_the_same_motion() {
    let folder = tempfile::tempdir().unwrap();
    cloud(&folder.path().join("cloud.data"));
    floor(folder.path());
    let models = with_walls(BOTH, "");
    let once = result(folder.path(), &models, 1, 1);
    for processors in [2, 4] {
        let apart = difference(&result(folder.path(), &models, processors, 1), &once);
        println!("{processors} processors: {apart:?}");
        // LIGGGHTS adds the forces of an atom in an order that depends on the processors; collisions amplify the rounding.
        assert!(apart.iter().all(|d| *d < 1e-12), "{processors} processors: {apart:?}");
    }
}

/// A restart on two processors goes on as that of LIGGGHTS' own combination. (Neither goes on as a run without restart: LIGGGHTS finds
/// the forces of the first step from other velocities.)
#[test]
fn histories_go_through_restarts() {
    let folder = tempfile::tempdir().unwrap();
    cloud(&folder.path().join("cloud.data"));
    floor(folder.path());
    let half = STEPS / 2;
    let restarted = |prefix: &str| {
        let models = with_walls(&BOTH.replace("concordem/", prefix), "");
        let script = |begin: &str, end: &str| {
            begin.to_owned() + &model(&models) + "fix integrate all nve/sphere\nthermo 100\n" + end
        };
        let first = script(&head("cloud.data", "f f f", 1e-3, 2e-6), &format!("run {half}\nwrite_restart half.bin\n"));
        run(folder.path(), &first, 1);
        let begin = "units si\natom_style sphere\natom_modify map array sort 0 0\nboundary f f f\nnewton off\n\
                     communicate single vel yes\nread_restart half.bin\nneighbor 1e-3 bin\nneigh_modify delay 0\ntimestep 2e-6\n";
        run(folder.path(), &script(begin, &format!("{}run {half}\n", dump("again.dump", 100))), 2);
        frames(&folder.path().join("again.dump"))
    };
    let (ours, theirs) = (restarted("concordem/"), restarted(""));
    assert!(ours.len() == 3 && theirs.len() == 3, "{}", ours.len());
    let apart = difference(&ours, &theirs);
    println!("restart: {apart:?}, moved {:?}", difference(&ours[..1], &ours[2..]));
    // Rounding, amplified by collisions.
    assert!(apart.iter().all(|d| *d < 1e-12), "{apart:?}");
}

/// Forces and torques at step 0 of sphere 1, which overlaps sphere 2 (`two`) or a floor.
fn at_rest(models: &str, two: bool) -> Dumped {
    let folder = tempfile::tempdir().unwrap();
    let mut atoms =
        [Atom::resting(Vec3::new(0.0, 0.0, 0.0049), 0.005), Atom::resting(Vec3::new(0.0, 0.0, 0.0127), 0.003)];
    atoms[0].spin = Vec3::new(0.0, 3.0, 0.0);
    atoms[1].spin = Vec3::new(0.0, -1.0, 0.0);
    atoms[1].kind = 2;
    if !two {
        atoms[1].position.z = 0.04;
    }
    data_file(&folder.path().join("cloud.data"), &atoms, Vec3::repeat(-0.02), Vec3::repeat(0.05));
    let wall =
        if two { String::new() } else { format!("fix floor all wall/gran {models} primitive type 1 zplane 0.0\n") };
    let mut script = head("cloud.data", "f f f", 1e-3, 1e-6);
    write!(script, "{PROPERTIES}{}", model(&format!("pair_style gran {models}\npair_coeff * *"))).unwrap();
    write!(script, "{wall}fix integrate all nve/sphere\n{}run 0\n", dump("out.dump", 1)).unwrap();
    run(folder.path(), &script, 1);
    frames(&folder.path().join("out.dump"))[0].1[0]
}

/// Before the first step the laws of ConcorDEM have no shear force and no dashpot, so closed forms give force and torque: the normal
/// spring, LIGGGHTS' cohesion per contact area, and a rolling torque `μ_r k_n δ R*` against the relative spin.
#[test]
fn concordem_laws_give_the_closed_forms() {
    let beside = "cohesion sjkr2 rolling_friction cdt";
    // Types 1 and 1 at the floor, 1 and 2 between the spheres.
    let [wall, between] = [(2e5, 0.02), (1e5, 0.01)];
    let hertz = |young: f64, radius: f64, overlap: f64| 4.0 / 3.0 * young * radius.sqrt() * overlap.powf(1.5);
    let bulk = [(1.0 - 0.09) / 5e6, (1.0 - 0.04) / 2e7];
    let (radius, overlap, reduced, overlap_of_two) = (0.005, 1e-4, 0.005 * 0.003 / 0.008, 2e-4);
    for (model, at_floor, of_two) in [
        (
            "hertz_mindlin",
            hertz(1.0 / (2.0 * bulk[0]), radius, overlap),
            hertz(1.0 / (bulk[0] + bulk[1]), reduced, overlap_of_two),
        ),
        ("frictional", 4e4 * overlap, 3e4 * overlap_of_two),
    ] {
        let models = format!("model concordem/{model} {beside}");
        for (two, spring, radius, overlap, (cohesion, rolling), area) in [
            (false, at_floor, radius, overlap, wall, 2.0 * PI * radius * overlap),
            (true, of_two, reduced, overlap_of_two, between, 4.0 * PI * reduced * overlap_of_two),
        ] {
            let state = at_rest(&models, two);
            let force = (spring - cohesion * area) * if two { -1.0 } else { 1.0 };
            let torque = -rolling * spring * radius;
            println!(
                "{model}, two {two}, overlap {overlap}: {} {} N, {} {torque} N·m",
                state.force.z, force, state.torque.y
            );
            // Rounding; the overlap is the difference of lengths 50 to 80 times as large.
            let close = |a: f64, b: f64| (a - b).abs() < 1e-12 * spring.abs().max(b.abs());
            assert!(close(state.force.z, force), "{model}: {state:?} {force}");
            assert!((state.torque.y - torque).abs() < 1e-12 * torque.abs(), "{model}: {state:?} {torque}");
        }
    }
}

/// The fix computes the pair, so the models leave it out: with and without the pair style, the bits are the same.
#[test]
fn pairs_of_a_fix_get_no_cohesion_and_no_rolling_friction() {
    let folder = tempfile::tempdir().unwrap();
    let mut atoms = [Atom::resting(Vec3::zeros(), 0.005), Atom::resting(Vec3::new(0.0098, 0.0, 0.0), 0.005)];
    atoms[0].spin = Vec3::new(1.0, 20.0, 3.0);
    atoms[1].velocity = Vec3::new(-0.1, 0.0, 0.2);
    atoms[1].kind = 2;
    data_file(&folder.path().join("cloud.data"), &atoms, Vec3::repeat(-0.02), Vec3::repeat(0.03));
    let states = |pair: &str, fix: &str| {
        let mut script = head("cloud.data", "f f f", 1e-3, 1e-6) + PROPERTIES + &model(pair);
        write!(script, "{fix}\nfix integrate all nve/sphere\n{}run 200\n", dump("out.dump", 50)).unwrap();
        run(folder.path(), &script, 1);
        frames(&folder.path().join("out.dump"))
    };
    let fix = "fix bonds all concordem/bond linear_bond normal_stiffness 1e5 shear_stiffness 1e4 bond distance 1.2 contact none";
    let alone = states("", fix);
    // With and without histories in LIGGGHTS' lists.
    for models in [BOTH, "model concordem/hooke tangential off cohesion sjkr rolling_friction cdt"] {
        let pair = format!("pair_style gran {models}\npair_coeff * *");
        assert_eq!(states(&pair, fix), alone, "{models}");
        assert_ne!(states(&pair, ""), states("", ""), "{models} was meant to act without the fix");
    }
}
