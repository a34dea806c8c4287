//! LIGGGHTS' models of cohesion and rolling friction beside our models of `pair_style gran` and `fix wall/gran`.

use std::f64::consts::PI;
use std::fmt::Write as _;

use crate::harness::spheres::{STEPS, cloud, difference, floor, model, result};
use crate::harness::{Atom, Dumped, data_file, dump, frames, head, run};
use concordem_contact::math::Vec3;

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
        let begin = "units si\natom_style sphere\natom_modify sort 0 0\nboundary f f f\nnewton off\n\
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

/// Sphere 1, which overlaps sphere 2 (`two`) or a floor by 0.1 mm.
fn pressed(two: bool) -> [Atom; 2] {
    let mut atoms =
        [Atom::resting(Vec3::new(0.0, 0.0, 0.0049), 0.005), Atom::resting(Vec3::new(0.0, 0.0, 0.0127), 0.003)];
    atoms[1].kind = 2;
    if !two {
        atoms[1].position.z = 0.04;
    }
    atoms
}

/// States of these spheres at every tenth of `steps` steps of 1 us, if not `two` above a floor. No dashpots act.
fn moved(models: &str, atoms: &[Atom; 2], two: bool, steps: usize) -> Vec<(u64, Vec<Dumped>)> {
    let folder = tempfile::tempdir().unwrap();
    data_file(&folder.path().join("cloud.data"), atoms, Vec3::repeat(-0.02), Vec3::repeat(0.05));
    let wall =
        if two { String::new() } else { format!("fix floor all wall/gran {models} primitive type 1 zplane 0.0\n") };
    let properties = model(&format!("pair_style gran {models}\npair_coeff * *")).replace("0.9 0.7 0.7 0.5", "1 1 1 1");
    let mut script = head("cloud.data", "f f f", 1e-3, 1e-6);
    write!(script, "{PROPERTIES}{properties}{wall}fix integrate all nve/sphere\n{}run {steps}\n", dump("out.dump", 10))
        .unwrap();
    run(folder.path(), &script, 1);
    frames(&folder.path().join("out.dump"))
}

/// Normal springs of the laws of ConcorDEM: name, and force (N) at an overlap (m) of sphere 1 with the floor and with sphere 2.
type Springs = (&'static str, [Box<dyn Fn(f64) -> f64>; 2]);

/// Effective radii of the contacts with the floor and between the spheres, m.
const EFFECTIVE: [f64; 2] = [0.005, 0.005 * 0.003 / 0.008];

fn springs() -> [Springs; 2] {
    let bulk = [(1.0 - 0.09) / 5e6, (1.0 - 0.04) / 2e7];
    let hertz = |young: f64, radius: f64| -> Box<dyn Fn(f64) -> f64> {
        Box::new(move |overlap| 4.0 / 3.0 * young * radius.sqrt() * overlap.powf(1.5))
    };
    let of_hertz = [hertz(1.0 / (2.0 * bulk[0]), EFFECTIVE[0]), hertz(1.0 / (bulk[0] + bulk[1]), EFFECTIVE[1])];
    let linear = |stiffness: f64| -> Box<dyn Fn(f64) -> f64> { Box::new(move |overlap| stiffness * overlap) };
    [("hertz_mindlin", of_hertz), ("frictional", [linear(4e4), linear(3e4)])]
}

/// Areas of LIGGGHTS' model sjkr2 at an overlap (m), m².
fn areas(overlap: f64) -> [f64; 2] {
    [2.0 * PI * EFFECTIVE[0] * overlap, 4.0 * PI * EFFECTIVE[1] * overlap]
}

/// Before the first step the laws of ConcorDEM have no shear force and no dashpot, so closed forms give force and torque: the normal
/// spring, LIGGGHTS' cohesion per contact area, and a rolling torque `μ_r k_n δ R*` against the relative spin.
#[test]
fn concordem_laws_give_the_closed_forms() {
    // Types 1 and 1 at the floor, 1 and 2 between the spheres.
    let energies = [(2e5, 0.02), (1e5, 0.01)];
    for (model, springs) in springs() {
        for (k, two) in [false, true].into_iter().enumerate() {
            let mut atoms = pressed(two);
            atoms[0].spin = Vec3::new(0.0, 3.0, 0.0);
            atoms[1].spin = Vec3::new(0.0, -1.0, 0.0);
            let models = format!("model concordem/{model} cohesion sjkr2 rolling_friction cdt");
            let state = moved(&models, &atoms, two, 0)[0].1[0];
            let overlap = if two { 2e-4 } else { 1e-4 };
            let (cohesion, rolling) = energies[k];
            let spring = springs[k](overlap);
            let force = (spring - cohesion * areas(overlap)[k]) * if two { -1.0 } else { 1.0 };
            let torque = -rolling * spring * EFFECTIVE[k];
            println!("{model}, two {two}: {} {} N, {} {torque} N·m", state.force.z, force, state.torque.y);
            // Rounding; the overlap is the difference of lengths 50 to 80 times as large.
            let close = |a: f64, b: f64| (a - b).abs() < 1e-12 * spring.abs().max(b.abs());
            assert!(close(state.force.z, force), "{model}: {state:?} {force}");
            assert!((state.torque.y - torque).abs() < 1e-12 * torque.abs(), "{model}: {state:?} {torque}");
        }
    }
}

/// In motion, too: at every step the spring of the present overlap less the cohesion of the present area; and while sphere 1 slides over
/// the floor, friction by the spring alone, which no cohesion increases.
#[test]
fn concordem_laws_give_the_closed_forms_in_motion() {
    for (model, springs) in springs() {
        let models = format!("model concordem/{model} cohesion sjkr2");
        for (k, two) in [false, true].into_iter().enumerate() {
            let mut atoms = pressed(two);
            atoms[0].velocity = if two { Vec3::new(0.0, 0.0, 0.2) } else { Vec3::new(2.0, 0.0, -0.1) };
            // Until shortly before the spheres part.
            let steps = if two { 100 } else { 200 };
            let states = moved(&models, &atoms, two, steps);
            assert_eq!(states.len(), steps / 10 + 1);
            let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
            for (step, state) in &states {
                let (one, other) = (&state[0], &state[1]);
                let overlap = if two { 0.008 - (other.position.z - one.position.z) } else { 0.005 - one.position.z };
                (least, most) = (least.min(overlap), most.max(overlap));
                let spring = springs[k](overlap);
                let force = (spring - [2e5, 1e5][k] * areas(overlap)[k]) * if two { -1.0 } else { 1.0 };
                // Rounding; the overlap is the difference of lengths 50 to 120 times as large.
                assert!((one.force.z - force).abs() < 2e-12 * spring, "{model}, {two}, {step}: {one:?} {force}");
                if two {
                    assert!((one.force + other.force).norm() < 1e-15, "{model}, {step}: {state:?}");
                } else if *step >= 100 {
                    // By then the shear spring has grown to its limit (4e-5 m at 2 m/s: 20 to 40 steps).
                    assert!((one.force.x + 0.4 * spring).abs() < 2e-12 * spring, "{model}, {step}: {one:?} {spring}");
                }
            }
            assert!(most - least > 1e-5 && least > 0.0, "{model}, {two}: the overlap changes: {least} {most}");
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
