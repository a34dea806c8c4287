//! Two particles moved along a prescribed path in LIGGGHTS and LAMMPS, compared with direct calls of the same laws.

use std::fmt::Write as _;

use crate::harness::{self, Atom, Host, data_file_for, dump_for, frames, head_for, run_in};
use concordem_contact::kinematics::sphere_sphere::{ImageShift, Motion, initial_geometry};
use concordem_contact::kinematics::{ContactInput, MotionMeasure, PreviousGeometry};
use concordem_contact::law::{
    BeamDamping, BeamFractureEnergy, BeamModel, CohesiveBeam, ContactGeometry, ContactLaw, ContactStiffness, Cpm,
    CpmParameters, DampedBeam, Elastic, Frictional, HertzMindlin, Jointed, Kinematics, LinearBond, PairRadius, Section,
    Softening, SofteningBeam, Status,
};
use concordem_contact::math::{Quat, Vec3, normalized, quaternion_of_rotation_vector};
use concordem_contact::scatter::{Distribution, Scatter};

/// A leg of the path: number of steps, and velocities and angular velocities of both particles.
type Leg = (usize, [Vec3; 2], [Vec3; 2]);

const RADIUS: [f64; 2] = [0.004, 0.005];
const DT: f64 = 1e-6;

/// So dense that forces do not change the velocities: v + (Δt/2m) f rounds to v.
const DENSITY: f64 = 1e40;

/// Stretch, shear with rotation, rotate rigidly, twist and bend, push together until the surfaces overlap, pull apart.
fn path(pull: f64) -> Vec<Leg> {
    let v = Vec3::new;
    let o = Vec3::zeros();
    vec![
        (40, [v(-pull, 0.0, 0.0), v(pull, 0.1 * pull, 0.0)], [o, o]),
        (
            60,
            [v(0.3, -0.4 * pull, pull), v(0.3 - 0.2 * pull, pull, 0.4)],
            [v(300.0, -200.0, 500.0), v(-100.0, 90.0, 400.0)],
        ),
        (50, [o, o], [v(0.0, 700.0, -50.0), v(900.0, 0.0, 10.0)]),
        (120, [v(6.0, 0.0, 1.0), v(-6.0, 0.2, 0.0)], [v(0.0, 0.0, 4000.0), v(2000.0, 0.0, 4000.0)]),
        (30, [v(-1.0, 3.0, 0.0), v(1.0, -1.0, 0.0)], [v(3000.0, 0.0, 4000.0), o]),
        (250, [v(-8.0, 0.0, 0.3), v(9.0, 0.0, 0.0)], [o, v(0.0, 500.0, 0.0)]),
    ]
}

fn start() -> [Vec3; 2] {
    [Vec3::new(0.021, 0.03, 0.028), Vec3::new(0.0303, 0.0302, 0.0275)]
}

/// Wrench on both particles after every step from direct calls of `bond` until it breaks, then of `contact` when the surfaces touch.
#[expect(clippy::too_many_lines, reason = "the solver of two particles, written out as the reference")]
fn direct<B: ContactLaw, C: ContactLaw>(
    bond: Option<&B>,
    contact: &C,
    legs: &[Leg],
    mode: MotionMeasure,
) -> Vec<([Vec3; 2], [Vec3; 2])> {
    let mass = RADIUS.map(|r| 4.0 * std::f64::consts::PI / 3.0 * r * r * r * DENSITY);
    let mut at = start().map(|position| Motion {
        position,
        velocity: Vec3::zeros(),
        angular_velocity: Vec3::zeros(),
        rotation_increment: Quat::identity(),
        orientation: Quat::identity(),
    });
    let mut frame = initial_geometry(&at[0].position, &at[1].position, &Vec3::zeros());
    let rest = frame.length;
    let mut geometry = ContactGeometry {
        reference_length: rest,
        area: bond.map_or(0.0, |law| law.bonded_area(RADIUS[0], RADIUS[1], 0.5 * (RADIUS[0] + RADIUS[1]))),
        radius_a: RADIUS[0],
        radius_b: RADIUS[1],
        mass_a: mass[0],
        mass_b: mass[1],
    };
    let mut bonded = bond.is_some();
    let mut kept: Option<f64> = None;
    let mut bond_history = B::State::default();
    let mut history: Option<C::State> = None;
    let mut out = Vec::new();
    let still = std::iter::once((1, [Vec3::zeros(); 2], [Vec3::zeros(); 2]));
    for (steps, velocity, spin) in still.chain(legs.iter().copied()) {
        for _ in 0..steps {
            for p in 0..2 {
                at[p].velocity = velocity[p];
                at[p].angular_velocity = spin[p];
                at[p].position += velocity[p] * DT;
                at[p].rotation_increment = quaternion_of_rotation_vector(&(spin[p] * DT));
                at[p].orientation = normalized(&(at[p].rotation_increment * at[p].orientation));
            }
            let (image, [a, b]) = (ImageShift::default(), at);
            let between = at[1].position - at[0].position;
            let mut wrench = ([Vec3::zeros(); 2], [Vec3::zeros(); 2]);
            let mut give = |force: Vec3, moment: Vec3, normal: Vec3, arm_a: f64, arm_b: f64| {
                let lever = normal.cross(&force);
                wrench = ([force, -force], [lever * arm_a + moment, lever * arm_b - moment]);
            };
            if let (true, Some(law)) = (bonded, bond) {
                let input = ContactInput {
                    a: &a,
                    b: &b,
                    image: &image,
                    geometry: &geometry,
                    previous: &frame,
                    bonded: true,
                    dt: DT,
                };
                let k = B::Kinematics::measure(mode, &input);
                let answer = law.respond(&k, &bond_history, DT);
                let point = *k.point();
                frame = PreviousGeometry { normal: point.normal, length: point.length };
                bond_history = answer.state;
                if answer.status.is_broken() {
                    bonded = false;
                    kept = law
                        .kept_reference(concordem_contact::law::Reference { length: rest, area: geometry.area })
                        .map(|r| r.length);
                } else {
                    give(answer.force, answer.moment, point.normal, point.arm_a, point.arm_b);
                }
            } else {
                let touching = kept.unwrap_or(RADIUS[0] + RADIUS[1]);
                if history.is_none() && between.norm() - touching < 0.0 {
                    let before = between - (at[1].velocity - at[0].velocity) * DT;
                    frame = PreviousGeometry { normal: before / before.norm(), length: before.norm() };
                    if kept.is_none() {
                        let reference = C::unbonded_reference(between.norm(), RADIUS[0], RADIUS[1]);
                        geometry.reference_length = reference.length;
                        geometry.area = reference.area;
                    }
                    history = Some(C::State::default());
                }
                if let Some(old) = history {
                    let input = ContactInput {
                        a: &a,
                        b: &b,
                        image: &image,
                        geometry: &geometry,
                        previous: &frame,
                        bonded: false,
                        dt: DT,
                    };
                    let k = C::Kinematics::measure(mode, &input);
                    let answer = contact.respond(&k, &old, DT);
                    let point = *k.point();
                    frame = PreviousGeometry { normal: point.normal, length: point.length };
                    history = Some(answer.state);
                    if answer.status == Status::Lives {
                        give(answer.force, answer.moment, point.normal, point.arm_a, point.arm_b);
                    } else {
                        history = None;
                    }
                }
            }
            out.push(wrench);
        }
    }
    out
}

/// The styles that compute the forces.
#[derive(Debug, Clone, Copy, PartialEq)]
enum By {
    Fix,
    BondStyle,
    /// The contact law in a separate pair style.
    BondAndPairStyle,
    PairStyle,
}

/// Split the arguments of a fix for a bond style and a pair style: bond law, its parameters, contact law, its parameters, common
/// options.
fn parts(law: &str) -> [String; 5] {
    let mut parts: [String; 5] = Default::default();
    let mut words = law.split_whitespace();
    words.next().unwrap().clone_into(&mut parts[0]);
    while let (Some(key), Some(value)) = (words.next(), words.next()) {
        match (key, key.strip_prefix("contact.")) {
            ("bond", _) if value == "distance" => drop(words.next()),
            ("bond", _) => {}
            ("contact", _) => value.clone_into(&mut parts[2]),
            ("kinematics", _) => write!(parts[4], "{key} {value} ").unwrap(),
            (_, Some(key)) => write!(parts[3], "{key} {value} ").unwrap(),
            _ => write!(parts[1], "{key} {value} ").unwrap(),
        }
    }
    parts
}

/// Run LIGGGHTS and LAMMPS along the same path and compare every step.
fn compare(law: &str, legs: &[Leg], expected: &[([Vec3; 2], [Vec3; 2])], breaks: bool) {
    compare_in(Host::Liggghts, By::Fix, law, legs, expected, breaks);
    let others: &[By] = if law.contains("bond none") {
        &[By::Fix, By::PairStyle]
    } else {
        &[By::Fix, By::BondStyle, By::BondAndPairStyle]
    };
    for by in others {
        compare_in(Host::Lammps, *by, law, legs, expected, breaks);
    }
}

fn compare_in(host: Host, by: By, law: &str, legs: &[Leg], expected: &[([Vec3; 2], [Vec3; 2])], breaks: bool) {
    let folder = tempfile::tempdir().unwrap();
    let atoms: Vec<Atom> = start()
        .iter()
        .zip(RADIUS)
        .map(|(&position, radius)| Atom { density: DENSITY, ..Atom::resting(position, radius) })
        .collect();
    let data = folder.path().join("two.data");
    let listed = matches!(by, By::BondStyle | By::BondAndPairStyle);
    data_file_for(
        host,
        &data,
        &atoms,
        if listed { &[[1, 2]] } else { &[] },
        Vec3::zeros(),
        Vec3::new(0.06, 0.06, 0.06),
    );
    // The middle of the box, where processors meet, is between the particles.
    let mut script = head_for(host, "two.data", "f f f", 1e-3, DT);
    writeln!(script, "group a id 1\ngroup b id 2\nfix integrate all nve/sphere").unwrap();
    let [bond, of_bond, contact, of_contact, of_both] = parts(law);
    let name = match by {
        By::Fix => {
            writeln!(script, "fix bonds all concordem/bond {law}").unwrap();
            "f_bonds"
        }
        By::BondStyle => {
            let words: Vec<&str> = of_contact.split_whitespace().collect();
            let of_contact = words.chunks(2).fold(String::new(), |all, pair| all + "contact." + &pair.join(" ") + " ");
            writeln!(script, "bond_style concordem/{bond} contact {contact} {of_both}").unwrap();
            writeln!(script, "bond_coeff * {of_bond} {of_contact}").unwrap();
            "f_concordem_bonds"
        }
        By::BondAndPairStyle => {
            writeln!(script, "pair_style concordem/{contact}\npair_coeff * * {of_contact}").unwrap();
            writeln!(script, "bond_style concordem/{bond} {of_both}\nbond_coeff * {of_bond}").unwrap();
            "f_concordem_bonds"
        }
        By::PairStyle => {
            writeln!(script, "pair_style concordem/{contact} {of_both}\npair_coeff * * {of_contact}").unwrap();
            "f_concordem_contacts"
        }
    };
    writeln!(script, "thermo_style custom step {name} {name}[2]\nthermo 1").unwrap();
    script.push_str(&dump_for(host, "out.dump", 1));
    script.push_str("run 0\n");
    for (steps, velocity, spin) in legs {
        for (p, name) in ["a", "b"].iter().enumerate() {
            let (v, w) = (velocity[p], spin[p]);
            writeln!(script, "velocity {name} set {:e} {:e} {:e} units box", v.x, v.y, v.z).unwrap();
            match host {
                Host::Liggghts => {
                    writeln!(script, "set group {name} omegax {:e} omegay {:e} omegaz {:e}", w.x, w.y, w.z).unwrap();
                }
                Host::Lammps => writeln!(script, "set group {name} omega {:e} {:e} {:e}", w.x, w.y, w.z).unwrap(),
            }
        }
        writeln!(script, "run {steps}").unwrap();
    }
    for processors in [1, 2] {
        let printed = run_in(host, folder.path(), &script, processors);
        if breaks {
            let broken = harness::thermo(&printed).last().unwrap()[2];
            assert_eq!(broken, 1.0, "{host:?} {by:?}, {law}: the bond should break");
        }
        let found = frames(&folder.path().join("out.dump"));
        assert!(expected.len() > 500);
        for (step, atoms) in &found {
            let (force, torque) = &expected[*step as usize];
            for p in 0..2 {
                // Same function, same numbers; the tolerance covers the last digit of printing and the addition to zero.
                let close = |a: &Vec3, b: &Vec3| (a - b).norm() <= 1e-14 * b.norm();
                assert!(
                    close(&atoms[p].force, &force[p]) && close(&atoms[p].torque, &torque[p]),
                    "{host:?} {by:?}, {law}, {processors} processors, step {step}, particle {p}: {:?} instead of {:?} {:?}",
                    atoms[p],
                    force[p],
                    torque[p]
                );
            }
        }
        // Dumps of steps that end one run and begin the next occur once.
        assert_eq!(found.last().unwrap().0 as usize, expected.len() - 1);
    }
}

#[test]
fn linear_bond_equals_direct_calls() {
    let bond = LinearBond::new(1e6, 4e5, 0.1, 300.0, 250.0).unwrap();
    let after = Frictional::new(ContactStiffness::Given { normal: 1e6, shear: 4e5 }, 0.4, 0.1).unwrap();
    let text = "linear_bond normal_stiffness 1e6 shear_stiffness 4e5 damping_ratio 0.1 normal_strength 300 shear_strength 250 \
                friction_coefficient 0.4 bond distance 1.2 contact linear_bond";
    for (mode, name) in [
        (MotionMeasure::Finite, "finite"),
        (MotionMeasure::FirstOrder, "first-order"),
        (MotionMeasure::YadeRatcheting, "yade-ratcheting"),
    ] {
        let legs = path(1.0);
        let expected = direct(Some(&bond), &after, &legs, mode);
        compare(&format!("{text} kinematics {name}"), &legs, &expected, true);
    }
}

/// With a ductility, and with a fracture energy: 1,500 J/m² are a ductility of some 5 for these spheres.
#[test]
fn cpm_equals_direct_calls() {
    for (ductility, energy, softening) in [(5.0, 0.0, "relative_ductility 5"), (0.0, 1500.0, "fracture_energy 1500")] {
        let mut parameters = CpmParameters::new(30e9, 0.2, 3e6, 0.8, 1e-3, ductility);
        parameters.fracture_energy = energy;
        parameters.omega_threshold = 0.9;
        let law = Cpm::new(&parameters).unwrap();
        let legs = path(1.0);
        let expected = direct(Some(&law), &law, &legs, MotionMeasure::Finite);
        compare(
            &format!(
                "cpm young 30e9 shear_ratio 0.2 cohesion 3e6 friction_coefficient 0.8 crack_onset_strain 1e-3 {softening} \
                 omega_threshold 0.9 bond distance 1.5 contact cpm"
            ),
            &legs,
            &expected,
            true,
        );
    }
}

#[test]
fn cohesive_beam_equals_direct_calls() {
    let after = Frictional::new(ContactStiffness::Given { normal: 1e6, shear: 4e5 }, 0.4, 0.0).unwrap();
    let smaller = Section::RatioOfPair { ratio: 0.6, radius: PairRadius::Smaller };
    for (model, text, section, strength) in [
        (BeamModel::EulerBernoulli, "euler-bernoulli", Section::Ratio(0.6), f64::INFINITY),
        (BeamModel::Timoshenko { shear_coefficient: 0.9 }, "timoshenko", Section::Ratio(0.6), f64::INFINITY),
        (BeamModel::EulerBernoulli, "euler-bernoulli radius_rule smaller", smaller, 3e8),
    ] {
        let mut beam = CohesiveBeam::new(70e9, 0.25, section).unwrap();
        beam.model = model;
        beam.strength = strength;
        let legs = path(1.0);
        let expected = direct(Some(&beam), &after, &legs, MotionMeasure::Finite);
        let breaks = strength.is_finite();
        let failure = if breaks { "tensile_strength 3e8" } else { "" };
        compare(
            &format!(
                "cohesive_beam young 70e9 poisson 0.25 radius_ratio 0.6 model {text} {failure} bond distance 1.2 contact \
                 frictional contact.normal_stiffness 1e6 contact.shear_stiffness 4e5 contact.friction_coefficient 0.4"
            ),
            &legs,
            &expected,
            breaks,
        );
    }
}

/// A materials file.
const SCATTERED: &str = "[[material]]
name = \"glass\"
density = 2500
cohesive_beam = { young = 70e9, poisson = 0.25, radius_ratio = 0.6, tensile_strength = 3e8 }
frictional = { normal_stiffness = 1e6, shear_stiffness = 4e5, friction_coefficient = 0.4 }
strength_scatter = { weibull_modulus = 3, reference_area = 1e-6, seed = 9 }
";

/// The factor on the strength is that of our own solver, whose ids begin with 0.
#[test]
fn scattered_strengths_equal_direct_calls() {
    let after = Frictional::new(ContactStiffness::Given { normal: 1e6, shear: 4e5 }, 0.4, 0.0).unwrap();
    let beam = CohesiveBeam::new(70e9, 0.25, Section::Ratio(0.6)).unwrap();
    let area = beam.bonded_area(RADIUS[0], RADIUS[1], 0.5 * (RADIUS[0] + RADIUS[1]));
    let scatter = Scatter { seed: 9, distribution: Distribution::weibull(3.0, Some(1e-6)) };
    let strength = 3e8 * scatter.factor([0, 1], area);
    println!("strength {strength:e}");
    let legs = path(1.0);
    let steps = |strength| direct(Some(&CohesiveBeam { strength, ..beam }), &after, &legs, MotionMeasure::Finite);
    let expected = steps(strength);
    assert_ne!(expected, steps(3e8));
    let folder = tempfile::tempdir().unwrap();
    let materials = folder.path().join("scatter.toml");
    std::fs::write(&materials, SCATTERED).unwrap();
    let text = format!("cohesive_beam materials {} bond distance 1.2 contact frictional", materials.display());
    for host in [Host::Liggghts, Host::Lammps] {
        compare_in(host, By::Fix, &text, &legs, &expected, true);
    }
}

#[test]
fn damped_beam_equals_direct_calls() {
    let after = Frictional::new(ContactStiffness::Given { normal: 1e6, shear: 4e5 }, 0.4, 0.0).unwrap();
    let beam = CohesiveBeam { strength: 3e8, ..CohesiveBeam::new(70e9, 0.25, Section::Ratio(0.6)).unwrap() };
    let law = DampedBeam { beam, damping: BeamDamping { bending: 0.4, ..DampedBeam::new(beam, 0.1).unwrap().damping } };
    let legs = path(1.0);
    let expected = direct(Some(&law), &after, &legs, MotionMeasure::Finite);
    let undamped = direct(Some(&beam), &after, &legs, MotionMeasure::Finite);
    assert_ne!(expected[5], undamped[5]);
    compare(
        "damped_beam young 70e9 poisson 0.25 radius_ratio 0.6 tensile_strength 3e8 damping_ratio 0.1 bending_damping_ratio 0.4 \
         bond distance 1.2 contact frictional contact.normal_stiffness 1e6 contact.shear_stiffness 4e5 \
         contact.friction_coefficient 0.4",
        &legs,
        &expected,
        true,
    );
}

/// The beam softens in bending and tension. The strength is large, so that forces are not much smaller than those of the undamaged beam, whose
/// roundings they have.
#[test]
fn softening_beam_equals_direct_calls() {
    let after = Frictional::new(ContactStiffness::Given { normal: 1e6, shear: 4e5 }, 0.4, 0.0).unwrap();
    let beam = CohesiveBeam { strength: 3e8, ..CohesiveBeam::new(70e9, 0.25, Section::Ratio(0.6)).unwrap() };
    let energy = BeamFractureEnergy { tension: 1e7, shear: 2e7, exponent: 1.5 };
    let law = SofteningBeam::new(beam, energy, Softening::Exponential).unwrap();
    let legs = path(1.0);
    let expected = direct(Some(&law), &after, &legs, MotionMeasure::Finite);
    let elastic = CohesiveBeam { strength: f64::INFINITY, ..beam };
    assert_ne!(expected, direct(Some(&elastic), &after, &legs, MotionMeasure::Finite));
    assert_ne!(expected, direct(Some(&beam), &after, &legs, MotionMeasure::Finite));
    compare(
        "softening_beam young 70e9 poisson 0.25 radius_ratio 0.6 tensile_strength 3e8 fracture_energy 1e7 \
         shear_fracture_energy 2e7 mixture_exponent 1.5 softening exponential \
         bond distance 1.2 contact frictional contact.normal_stiffness 1e6 contact.shear_stiffness 4e5 \
         contact.friction_coefficient 0.4",
        &legs,
        &expected,
        true,
    );
}

/// A crack in shear under pressure, then apart, then in contact again.
#[test]
fn jointed_equals_direct_calls() {
    let law = Jointed { residual_friction: 0.2, ..Jointed::new(1e9, 0.25, 2e7, 2e7, 0.5).unwrap() };
    let mut legs = path(1.0);
    let v = |x: f64| Vec3::new(x, 0.0, 0.0);
    legs.push((260, [v(8.0), v(-9.0)], [Vec3::zeros(); 2]));
    let expected = direct(Some(&law), &law, &legs, MotionMeasure::Finite);
    // The bond slides, and the contact presses.
    let whole = Jointed { cohesion: 1e12, tensile_strength: 1e12, ..law };
    let held = direct(Some(&whole), &whole, &legs, MotionMeasure::Finite);
    let same = expected.iter().zip(&held).take_while(|(a, b)| a == b).count();
    assert!((160..270).contains(&same), "{same}");
    assert!(expected.last().is_some_and(|wrench| wrench.0[0] != Vec3::zeros()));
    compare(
        "jointed young 1e9 stiffness_ratio 0.25 tensile_strength 2e7 cohesion 2e7 friction_coefficient 0.5 \
         residual_friction_coefficient 0.2 bond distance 1.2 contact jointed",
        &legs,
        &expected,
        true,
    );
}

#[test]
fn linear_contacts_equal_direct_calls() {
    let law = Frictional::new(ContactStiffness::Given { normal: 1e6, shear: 4e5 }, 0.4, 0.2).unwrap();
    let legs = path(1.0);
    let expected = direct::<LinearBond, _>(None, &law, &legs, MotionMeasure::FirstOrder);
    assert!(expected.iter().filter(|wrench| wrench.0[0] != Vec3::zeros()).count() > 50);
    compare(
        "linear_bond normal_stiffness 1 shear_stiffness 1 bond none kinematics first-order contact frictional \
         contact.normal_stiffness 1e6 contact.shear_stiffness 4e5 contact.friction_coefficient 0.4 contact.damping_ratio 0.2",
        &legs,
        &expected,
        false,
    );
}

#[test]
fn hertz_mindlin_equals_direct_calls() {
    let glass = Elastic { young: 70e6, poisson: 0.2 };
    let law = HertzMindlin::new(glass, glass, 0.35, 0.8).unwrap();
    let legs = path(1.0);
    let expected = direct::<LinearBond, _>(None, &law, &legs, MotionMeasure::Finite);
    assert!(expected.iter().filter(|wrench| wrench.0[0] != Vec3::zeros()).count() > 50);
    compare(
        "linear_bond normal_stiffness 1 shear_stiffness 1 bond none contact hertz_mindlin contact.young 70e6 contact.poisson \
         0.2 contact.friction_coefficient 0.35 contact.restitution 0.8",
        &legs,
        &expected,
        false,
    );
}
