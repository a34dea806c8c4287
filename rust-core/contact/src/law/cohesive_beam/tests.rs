//! Conformance of the beam, single-bond atlas against closed forms, and failure criterion.

use super::*;
use crate::conformance::frame::{FrameRecord, FrameStation, FrameSubject, check, drive, legs};
use crate::conformance::{GEOMETRY, Native, Random, Report, at_rest};
use crate::math::Quat;

const YOUNG: f64 = 2.0e9;
const POISSON: f64 = 0.3;

fn beam() -> CohesiveBeam {
    CohesiveBeam::new(YOUNG, POISSON, Section::Radius(0.3)).unwrap()
}

fn subject(name: &'static str, beam: CohesiveBeam) -> FrameSubject<Native<CohesiveBeam>> {
    let area = beam.bonded_area(GEOMETRY.radius_a, GEOMETRY.radius_b, 1.0);
    let geometry = ContactGeometry { reference_length: 2.1, area, ..GEOMETRY };
    FrameSubject {
        name,
        host: Native(beam),
        geometry,
        elongation: 0.4,
        rotation: 0.7,
        twist: 2.0,
        failure: None,
        dt: 1e-3,
    }
}

fn conforms(subject: &FrameSubject<Native<CohesiveBeam>>) {
    let report: Report = check(subject);
    println!("{report}");
    assert!(report.passed(), "{report}");
}

#[test]
fn euler_bernoulli_beam_conforms() {
    conforms(&subject("Euler-Bernoulli beam", beam()));
}

#[test]
fn timoshenko_beam_conforms() {
    let model = BeamModel::Timoshenko { shear_coefficient: 0.9 };
    conforms(&subject("Timoshenko beam", CohesiveBeam { model, ..beam() }));
}

#[test]
fn springs_conform() {
    conforms(&subject("dual spring", CohesiveBeam { model: BeamModel::DualSpring { ratio: 0.4 }, ..beam() }));
    conforms(&subject("spring", CohesiveBeam { model: BeamModel::Spring, ..beam() }));
}

#[test]
fn brittle_beam_conforms() {
    // Breaks in pure tension at E Δl/l₀ = σ_f, an elongation of 0.21; bending of 0.05 rad stays below.
    let strong = CohesiveBeam { strength: 0.1 * YOUNG, ..beam() };
    let mut subject = subject("brittle beam", strong);
    (subject.elongation, subject.rotation, subject.twist, subject.failure) = (0.05, 0.05, 0.05, Some(0.4));
    conforms(&subject);
}

/// The four formulas of the source with balanced signs, by components (X, Y, Z) of end rotations and twist.
/// `shear_length` (m) is the length by which end moments are divided.
fn four_formulas(g: &ContactGeometry, s: &FrameStation, shear_length: f64) -> [Vec3; 4] {
    let (area, l) = (g.area, g.reference_length);
    let inertia = area * area / (4.0 * PI);
    let shear_modulus = YOUNG / (2.0 * (1.0 + POISSON));
    let ([ay, az], [by, bz]) = (s.a, s.b);
    let shear = 6.0 * YOUNG * inertia / (l * shear_length);
    let bend = 2.0 * YOUNG * inertia / l;
    let twist = shear_modulus * 2.0 * inertia / l * s.twist;
    let force = Vec3::new(YOUNG * area * s.elongation / l, -shear * (az + bz), shear * (ay + by));
    [
        force,
        -force,
        Vec3::new(twist, -bend * (2.0 * ay + by), -bend * (2.0 * az + bz)),
        Vec3::new(-twist, -bend * (ay + 2.0 * by), -bend * (az + 2.0 * bz)),
    ]
}

/// The midpoint form of the same beam, from displacements and rotations of the two centers.
fn midpoint_form(g: &ContactGeometry, s: &FrameStation) -> [Vec3; 4] {
    let (area, l) = (g.area, g.reference_length);
    let inertia = area * area / (4.0 * PI);
    let shear_modulus = YOUNG / (2.0 * (1.0 + POISSON));
    let x = Vec3::x();
    let (ta, tb) = (Vec3::new(0.0, s.a[0], s.a[1]), Vec3::new(s.twist, s.b[0], s.b[1]));
    let slide = -tb.cross(&(x * (0.5 * l))) - ta.cross(&(x * (0.5 * l)));
    let force = x * (YOUNG * area / l * s.elongation) + slide * (12.0 * YOUNG * inertia / (l * l * l));
    let turn = tb - ta;
    let middle = (turn - x * turn.x) * (YOUNG * inertia / l) + x * (turn.x * shear_modulus * 2.0 * inertia / l);
    let torque = (x * (0.5 * l)).cross(&force);
    [force, -force, middle + torque, -middle + torque]
}

fn forces_of(record: &FrameRecord<CohesiveBeamState>) -> [Vec3; 4] {
    [record.force, -record.force, record.moments[0], record.moments[1]]
}

/// Largest difference relative to the largest component, for a length of order 1 m.
fn difference(one: &[Vec3; 4], two: &[Vec3; 4]) -> f64 {
    let force = two[0].norm() + two[2].norm() + two[3].norm();
    let moment = force;
    ((one[0] - two[0]).norm() / force)
        .max((one[1] - two[1]).norm() / force)
        .max((one[2] - two[2]).norm() / moment)
        .max((one[3] - two[3]).norm() / moment)
}

/// The four formulas balance and equal the midpoint form, up to rounding of sums of a few products.
#[test]
fn four_formulas_and_midpoint_form_agree() {
    let geometry = subject("", beam()).geometry;
    let mut random = Random::new(1);
    for _ in 0..1000 {
        let mut any = || random.uniform(-1.0, 1.0);
        let station = FrameStation { elongation: any(), a: [any(), any()], b: [any(), any()], twist: any() };
        let four = four_formulas(&geometry, &station, geometry.reference_length);
        let balance = four[2] + four[3] + (Vec3::x() * geometry.reference_length).cross(&four[1]);
        assert!(balance.norm() < 1e-14 * (four[2].norm() + four[3].norm()), "{balance}");
        assert!(difference(&midpoint_form(&geometry, &station), &four) < 2e-15);
    }
}

/// The printed signs of [2.9], [2.11], [2.12] do not balance. The test keeps anyone from restoring them.
#[test]
fn printed_signs_do_not_balance() {
    let geometry = subject("", beam()).geometry;
    let station = FrameStation { a: [0.01, 0.02], b: [0.03, -0.01], ..FrameStation::default() };
    let mut printed = four_formulas(&geometry, &station, geometry.reference_length);
    printed[0].z = -printed[0].z;
    printed[2].z = -printed[2].z;
    assert!((printed[0] + printed[1]).norm() > 0.1 * printed[1].norm());
}

/// One bond, moved in `steps` steps from rest to `station`.
fn at(beam: CohesiveBeam, station: FrameStation) -> (FrameRecord<CohesiveBeamState>, ContactGeometry) {
    let subject = subject("bond", beam);
    let stations = legs(&[FrameStation::default(), station], 50);
    let records = drive(&subject, &stations, &at_rest, &[Quat::identity(); 2], false);
    (*records.last().unwrap(), subject.geometry)
}

/// The law equals the closed forms on paths where they hold at any size. 1e-14: a dozen roundings.
#[test]
fn finite_deformations_meet_the_closed_forms() {
    for size in [1e-6, 1e-2, 1.0] {
        for (name, station) in [
            ("tension", FrameStation { elongation: 0.5 * size, ..FrameStation::default() }),
            ("compression", FrameStation { elongation: -0.5 * size, ..FrameStation::default() }),
            ("torsion", FrameStation { twist: 2.5 * size, ..FrameStation::default() }),
            (
                "bent to a circle",
                FrameStation { a: [-1.2 * size, 0.0], b: [1.2 * size, 0.0], ..FrameStation::default() },
            ),
            ("S shape", FrameStation { a: [0.0, 0.9 * size], b: [0.0, 0.9 * size], ..FrameStation::default() }),
            (
                "one end, stretched",
                FrameStation { a: [0.6 * size, -0.8 * size], elongation: 0.1, ..FrameStation::default() },
            ),
        ] {
            let (record, geometry) = at(beam(), station);
            let length = geometry.reference_length + station.elongation;
            let error = difference(&forces_of(&record), &four_formulas(&geometry, &station, length));
            println!("{name} {size:e}: {error:.1e}");
            // Rounding of the bond's direction (1e-16 rad) relative to the rotation, and of the length (4e-16 m)
            // relative to the elongation of half the size.
            assert!(error < 1e-14 + 1e-15 / size, "{name} at {size}: {error:e}");
        }
    }
}

/// For mixed rotations out of one plane the formulas are the first order of the law; the next order falls with the
/// size.
#[test]
fn mixed_deformations_meet_the_closed_forms_to_first_order() {
    let error = |size: f64| {
        let station =
            FrameStation { elongation: 0.0, a: [size, 0.5 * size], b: [-0.7 * size, 0.9 * size], twist: 1.5 * size };
        let (record, geometry) = at(beam(), station);
        difference(&forces_of(&record), &four_formulas(&geometry, &station, geometry.reference_length))
    };
    let (coarse, fine) = (error(1e-2), error(1e-3));
    println!("mixed: {coarse:.2e} {fine:.2e}");
    assert!(coarse < 2e-2 && fine < 2e-3, "{coarse:e} {fine:e}");
    assert!((coarse / fine - 10.0).abs() < 1.0, "not first order relative to the rotation: {coarse:e} {fine:e}");
}

/// The closed form of the energy and its split equal those of the source (tension, bending with shear, torsion) and the
/// accumulated work [2.17]–[2.19] of the loads on the bond: in total to second order of the step at finite rotations,
/// by parts at small ones (at finite rotations the X parts and the Y, Z parts mix).
#[test]
fn accumulated_work_is_the_closed_form() {
    for (size, steps) in [(1e-4, 400), (0.3, 400)] {
        let subject = subject("bond", beam());
        let target = FrameStation {
            elongation: 0.1 * size,
            a: [size, 0.5 * size],
            b: [-0.7 * size, 0.9 * size],
            twist: 1.5 * size,
        };
        let records =
            drive(&subject, &legs(&[FrameStation::default(), target], steps), &at_rest, &[Quat::identity(); 2], false);
        let mut split = [0.0; 3];
        for pair in records.windows(2) {
            let mean = |k: usize| (forces_of(&pair[0])[k] + forces_of(&pair[1])[k]) * 0.5;
            let k = &pair[1].kinematics;
            let (pull, turn_a, turn_b) = (k.displacement, k.turn_a, k.turn_b);
            let (force, ma, mb) = (mean(0), mean(2), mean(3));
            let across = |a: &Vec3, b: &Vec3| a.y * b.y + a.z * b.z;
            split[0] += force.x * pull.x;
            split[1] += across(&force, &pull) - across(&ma, &turn_a) - across(&mb, &turn_b);
            split[2] -= ma.x * turn_a.x + mb.x * turn_b.x;
        }
        let energy = records.last().unwrap().response.energy;
        let closed = [energy.stored_normal, energy.stored_shear + energy.stored_bending, energy.stored_twist];
        let total: f64 = closed.iter().sum();
        println!("size {size}: work {split:?}, closed form {closed:?}");
        assert!((split.iter().sum::<f64>() - total).abs() < 2e-5 * total, "{split:?} {closed:?}");
        let g = subject.geometry;
        let inertia = g.area * g.area / (4.0 * PI);
        let dot = |p: [f64; 2], q: [f64; 2]| p[0] * q[0] + p[1] * q[1];
        let book = 2.0 * YOUNG * inertia / g.reference_length
            * (dot(target.a, target.a) + dot(target.a, target.b) + dot(target.b, target.b));
        // A dozen roundings, and 3e-16/size from rounding of the direction.
        assert!((closed[1] - book).abs() < (1e-14 + 1e-15 / size) * book, "{closed:?} {book}");
        if size < 1e-3 {
            for k in 0..3 {
                assert!((split[k] - closed[k]).abs() < 3e-4 * closed[k], "{k}: {split:?} {closed:?}");
            }
        }
    }
}

/// The shear stiffness of the Timoshenko beam is bending and shear in series: a cantilever deflects by `Pl³/3EI +
/// Pl/κGS`.
#[test]
fn timoshenko_cantilever() {
    let kappa = 0.9;
    let beam = CohesiveBeam { model: BeamModel::Timoshenko { shear_coefficient: kappa }, ..beam() };
    let g = subject("", beam).geometry;
    let (k, l) = (beam.stiffnesses(&g), g.reference_length);
    // Force 1 at B: the moment in the middle is l/2, so θ_B = l/2k_b; the tip moves by 1/k_s + θ_B l/2.
    let tip = 1.0 / k.shear + l * l / (4.0 * k.bending);
    let inertia = g.area * g.area / (4.0 * PI);
    let shear_modulus = YOUNG / (2.0 * (1.0 + POISSON));
    let exact = l * l * l / (3.0 * YOUNG * inertia) + l / (kappa * shear_modulus * g.area);
    // Five roundings.
    assert!((tip - exact).abs() < 1e-15 * exact, "{tip} {exact}");
}

/// Rankine's stress `σ = ½(σ_n+√(σ_n²+4τ²))` written out for the three bending terms.
#[test]
fn rankine_stress_in_three_readings() {
    let g = subject("", beam()).geometry;
    let r: f64 = 0.3;
    let inertia = PI * r.powi(4) / 4.0;
    let station = FrameStation { elongation: 0.01, a: [0.002, 0.01], b: [0.004, -0.03], twist: 0.02 };
    let [force, _, moment_a, moment_b] = four_formulas(&g, &station, g.reference_length);
    let forces = EndLoads { force, moment_a, moment_b };
    let l = g.reference_length;
    let shear_modulus = YOUNG / (2.0 * (1.0 + POISSON));
    let tau = shear_modulus * 0.02 / l * r;
    let hypot = |y: f64, z: f64| (y * y + z * z).sqrt();
    let bend = 2.0 * YOUNG * inertia / l;
    for (reading, moment) in [
        // ½(M_A−M_B) = (EI/l)(θ_B−θ_A)
        (BendingTerm::MidSection, YOUNG * inertia / l * hypot(0.002, -0.04)),
        // ½(M_A+M_B) = (3EI/l)(θ_A+θ_B)
        (BendingTerm::HalfSum, 3.0 * YOUNG * inertia / l * hypot(0.006, -0.02)),
        (BendingTerm::LargerEnd, bend * hypot(0.002 + 0.008, 0.01 - 0.06)),
    ] {
        let normal = YOUNG * 0.01 / l + moment * r / inertia;
        let exact = 0.5 * (normal + (normal * normal + 4.0 * tau * tau).sqrt());
        let beam = CohesiveBeam { bending_term: reading, ..beam() };
        let stress = beam.rankine_stress(g.area, force.x, &Vec3::x(), &forces);
        // A few dozen roundings.
        assert!((stress - exact).abs() < 1e-14 * exact, "{reading:?}: {stress} {exact}");
    }
}

/// Which deformations break a beam of strength 0.1 E: tension at Δl/l₀ = 0.1; never compression; bending to a circle
/// with the terms of the middle section and the larger end, but not with the printed half sum; torsion at `Gτr/l₀ =
/// σ_f`.
#[test]
fn which_deformation_breaks() {
    let broke = |reading: BendingTerm, station: FrameStation| {
        let beam = CohesiveBeam { strength: 0.1 * YOUNG, bending_term: reading, ..beam() };
        at(beam, station).0.response.status == Status::Broke
    };
    let mid = BendingTerm::MidSection;
    let pull = |elongation: f64| FrameStation { elongation, ..FrameStation::default() };
    assert!(!broke(mid, pull(0.209)) && broke(mid, pull(0.211)) && !broke(mid, pull(-1.5)));
    // M r/I = (E/l₀)·2φ·r = 0.1 E at φ = 0.35
    let circle = |angle: f64| FrameStation { a: [-angle, 0.0], b: [angle, 0.0], ..FrameStation::default() };
    for reading in [mid, BendingTerm::LargerEnd] {
        assert!(!broke(reading, circle(0.349)) && broke(reading, circle(0.351)), "{reading:?}");
    }
    assert!(!broke(BendingTerm::HalfSum, circle(1.5)));
    // S shape: no moment in the middle; the ends have 6EIφ/l₀, so φ = 0.1·2.1/(6·0.3) = 0.11667
    let wave = |angle: f64| FrameStation { a: [angle, 0.0], b: [angle, 0.0], ..FrameStation::default() };
    assert!(!broke(mid, wave(0.5)));
    for reading in [BendingTerm::HalfSum, BendingTerm::LargerEnd] {
        assert!(!broke(reading, wave(0.116)) && broke(reading, wave(0.117)), "{reading:?}");
    }
    // τ = G θ r/l₀ = E θ r/(2.6 l₀) = 0.1 E at θ = 0.1·2.6·2.1/0.3 = 1.82
    let twisted = |twist: f64| FrameStation { twist, ..FrameStation::default() };
    assert!(!broke(mid, twisted(1.819)) && broke(mid, twisted(1.821)));
}

const ROCK: ShearStrength = ShearStrength { cohesion: 4.0e7, friction_coefficient: 0.7, moment_share: 0.3 };

/// Fifty random loads, each scaled until the closed form of Potyondy and Cundall is reached: just below it the beam holds, just above it
/// breaks. 1e-12: some tens of roundings.
#[test]
fn rock_breaks_on_the_envelope_of_tension_and_shear() {
    let g = subject("", beam()).geometry;
    let r: f64 = 0.3;
    let (inertia, polar) = (PI * r.powi(4) / 4.0, PI * r.powi(4) / 2.0);
    let rock = CohesiveBeam { strength: 2.0e7, shear: ROCK, ..beam() };
    let mut random = Random::new(7);
    let mut in_shear = 0;
    for _ in 0..50 {
        let mut any = || random.uniform(-1.0, 1.0);
        let (axial, across, bending, twist) = (any(), any(), any(), any());
        let loads = |scale: f64| EndLoads {
            force: Vec3::new(axial, across, 0.0) * scale,
            moment_a: Vec3::new(twist, 0.0, bending) * scale,
            moment_b: Vec3::new(-twist, 0.0, -bending) * scale,
        };
        let normal = axial / g.area;
        let tension = normal + 0.3 * bending.abs() * r / inertia;
        let shear = across.abs() / g.area + 0.3 * twist.abs() * r / polar;
        let slope = shear + 0.7 * normal;
        let of_tension = if tension > 0.0 { 2.0e7 / tension } else { f64::INFINITY };
        let of_shear = if slope > 0.0 { 4.0e7 / slope } else { f64::INFINITY };
        in_shear += usize::from(of_shear < of_tension);
        let limit = of_tension.min(of_shear);
        let breaks = |scale: f64| {
            let loads = loads(scale);
            let moment = rock.bending(&Vec3::x(), &loads);
            let stresses = SectionStresses::of(g.area, axial * scale, &Vec3::x(), &loads, moment);
            rock.breaks(g.area, &stresses, &Vec3::x(), &loads.force)
        };
        if limit.is_finite() {
            // By the smaller limit alone, unless both are as good as equal.
            let expected = [of_tension < of_shear, of_shear < of_tension];
            assert_eq!(breaks(limit * (1.0 - 1e-12)), [false; 2], "{axial} {across} {bending} {twist}");
            assert_eq!(breaks(limit * (1.0 + 1e-12)), expected, "{axial} {across} {bending} {twist}");
        } else {
            assert_eq!(breaks(1e30), [false; 2]);
        }
    }
    // Both modes are met often.
    assert!((10..40).contains(&in_shear), "{in_shear}");
}

/// Deformations of one bond that break rock: pulled at `Δl/l₀ = σ_f/E`; pressed never; twisted at `β G τ r/l₀ = c + |σ| tan φ`, later
/// the more it is pressed.
#[test]
fn pressure_makes_rock_stronger_in_shear() {
    let rock = CohesiveBeam { strength: 0.02 * YOUNG, shear: ShearStrength { moment_share: 1.0, ..ROCK }, ..beam() };
    let broke = |elongation: f64, twist: f64| {
        let status = at(rock, FrameStation { elongation, twist, ..FrameStation::default() }).0.response.status;
        // Twist alone breaks it in shear, pull alone in tension.
        assert!(!status.is_broken() || status == if twist == 0.0 { Status::Broke } else { Status::BrokeInShear });
        status.is_broken()
    };
    // 2.1 · 0.02
    assert!(!broke(0.0419, 0.0) && broke(0.0421, 0.0) && !broke(-1.0, 0.0));
    for pressed in [0.0, 0.1, 0.3] {
        let limit = 4.0e7 + 0.7 * YOUNG * pressed / 2.1;
        let twist = limit / (YOUNG / (2.0 * (1.0 + POISSON))) * 2.1 / 0.3;
        assert!(!broke(-pressed, 0.999 * twist) && broke(-pressed, 1.001 * twist), "{pressed}");
    }
}

/// With a cohesion alone the beam breaks in shear, and in tension only where the shear strength ends, at `c / tan φ`.
#[test]
fn cohesion_alone_bounds_the_tension() {
    let rock = CohesiveBeam { shear: ShearStrength { friction_coefficient: 0.5, ..ROCK }, ..beam() };
    let broke = |elongation: f64| {
        at(rock, FrameStation { elongation, ..FrameStation::default() }).0.response.status == Status::BrokeInShear
    };
    // 4e7/0.5 = 0.04 E
    assert!(!broke(2.1 * 0.0399) && broke(2.1 * 0.0401));
}

#[test]
fn rock_conforms() {
    let rock =
        CohesiveBeam { strength: 0.1 * YOUNG, shear: ShearStrength { cohesion: 0.08 * YOUNG, ..ROCK }, ..beam() };
    let mut subject = subject("beam with a shear strength", rock);
    (subject.elongation, subject.rotation, subject.twist, subject.failure) = (0.05, 0.05, 0.05, Some(0.4));
    conforms(&subject);
}

#[test]
fn bad_parameters_are_named() {
    let message = CohesiveBeam::new(-1.0, 0.3, Section::Ratio(0.5)).unwrap_err().to_string();
    assert_eq!(message, "law cohesive_beam: young = -1 must be positive and finite (Pa)");
    assert!(CohesiveBeam::new(1.0, 0.6, Section::Ratio(0.5)).is_err());
    assert!(CohesiveBeam::new(1.0, 0.3, Section::Radius(0.0)).is_err());
    let of_pair = Section::RatioOfPair { ratio: f64::NAN, radius: PairRadius::Smaller };
    assert!(CohesiveBeam::new(1.0, 0.3, of_pair).is_err());
    assert!(CohesiveBeam { strength: f64::NAN, ..beam() }.validate().is_err());
    for shear in [
        ShearStrength { cohesion: 0.0, ..ROCK },
        ShearStrength { friction_coefficient: -0.1, ..ROCK },
        ShearStrength { moment_share: 1.1, ..ROCK },
    ] {
        assert!(CohesiveBeam { shear, ..beam() }.validate().is_err(), "{shear:?}");
    }
    assert!(CohesiveBeam { model: BeamModel::Timoshenko { shear_coefficient: 0.0 }, ..beam() }.validate().is_err());
    assert!(CohesiveBeam { model: BeamModel::DualSpring { ratio: -0.1 }, ..beam() }.validate().is_err());
}

/// A section is that of the mean radius of the bonded particles or a given one, whatever the two particles are, or that of their
/// smaller, mean, or harmonic mean radius in either order; the axial force is `ES` times the strain; and the faces of a crack touch where
/// they parted.
#[test]
fn sections_belong_to_the_specimen() {
    let ratio = CohesiveBeam::new(YOUNG, POISSON, Section::Ratio(0.5)).unwrap();
    assert_eq!(ratio.bonded_area(0.8, 1.2, 2.0), PI);
    assert_eq!(beam().bonded_area(0.8, 1.2, 2.0), PI * (0.3 * 0.3));
    // 2·0.5·1.5/2 = 0.75.
    for (radius, value) in [(PairRadius::Smaller, 0.5), (PairRadius::Mean, 1.0), (PairRadius::HarmonicMean, 0.75)] {
        let of_pair = CohesiveBeam::new(YOUNG, POISSON, Section::RatioOfPair { ratio: 0.5, radius }).unwrap();
        let area = PI * (0.25 * value * value);
        assert_eq!([of_pair.bonded_area(0.5, 1.5, 2.0), of_pair.bonded_area(1.5, 0.5, 7.0)], [area; 2], "{radius:?}");
    }
    let geometry = subject("beam", beam()).geometry;
    let force = beam().axial_force(&geometry, 2.1 * 1.25).unwrap();
    // A few roundings.
    assert!((force / (YOUNG * geometry.area * 0.25) - 1.0).abs() < 1e-14, "{force}");
    let reference = Reference { length: 2.1, area: 0.5 };
    assert_eq!(beam().kept_reference(reference), Some(reference));
}

/// A beam that is stretched, bent, and twisted when its particles let go of it releases all that it stores, by whatever mode; and one
/// that turns by more than 3 rad breaks however strong it is.
#[test]
fn a_beam_releases_all_it_stores() {
    let geometry = subject("beam", beam()).geometry;
    let respond = |twist: f64, bonded: bool| {
        let turned = |theta: Vec3| crate::math::quaternion_of_rotation_vector(&theta);
        let length = 2.2;
        let k = FrameKinematics {
            point: BranchVector { length, normal: Vec3::x() }.point(
                &geometry,
                &crate::geometry::PreviousGeometry { normal: Vec3::x(), length },
                bonded,
            ),
            orientation_a: turned(Vec3::new(0.0, 0.1, 0.05)),
            orientation_b: turned(Vec3::x() * twist) * turned(Vec3::new(0.0, -0.2, 0.1)),
            displacement: Vec3::zeros(),
            turn_a: Vec3::zeros(),
            turn_b: Vec3::zeros(),
        };
        let rest = CohesiveBeamState { rest_direction: Vec3::x(), rest_rotation: Vec3::zeros() };
        beam().respond(&k, &rest, 1e-3)
    };
    let (held, released) = (respond(0.3, true), respond(0.3, false));
    let EnergySplit { stored_normal, stored_shear, stored_bending, stored_twist, .. } = held.energy;
    assert!([stored_normal, stored_shear, stored_bending, stored_twist].iter().all(|energy| *energy > 1.0));
    assert_eq!((held.status, released.status), (Status::Lives, Status::Broke));
    assert_eq!(released.energy.damage, stored_normal + stored_shear + stored_bending + stored_twist);
    assert_eq!((respond(2.9, true).status, respond(3.05, true).status), (Status::Lives, Status::Broke));
}
