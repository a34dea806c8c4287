//! Tests of the Hertz-Mindlin contact.

//! Benchmark tests 1 to 4 of Chung & Ooi 2011, Granular Matter 13:643, by direct integration of the two bodies.

use super::*;
use crate::kinematics::sphere_sphere::{ImageShift, Motion, initial_geometry, measure};
use crate::kinematics::{ContactInput, MotionMeasure, PreviousGeometry, Transport};
use crate::math::sin_cos;

/// Largest values in a collision, and the motion after it.
#[derive(Debug, Clone, Copy, Default)]
struct Collision {
    largest_force: f64,
    largest_overlap: f64,
    duration: f64,
    /// Velocity and angular velocity of A afterwards.
    velocity: Vec3,
    spin: Vec3,
}

fn mass_of(radius: f64, density: f64) -> f64 {
    4.0 / 3.0 * std::f64::consts::PI * radius * radius * radius * density
}

/// Closed form of the elastic collision: `δ = (5 m v²/(4k))^{2/5}`, `F = k δ^{3/2}`, `t = 2.943 δ/v` with the
/// constant `(4/5)√π Γ(2/5)/Γ(9/10) = 2.9432751`, at relative velocity `v`, reduced mass `m`.
fn hertz(law: &HertzMindlin, radius: f64, mass: f64, speed: f64) -> (f64, f64, f64) {
    let k = 4.0 / 3.0 * law.effective_young * radius.sqrt();
    let overlap = libm::pow(1.25 * mass * speed * speed / k, 0.4);
    (k * overlap * overlap.sqrt(), overlap, 2.9432751 * overlap / speed)
}

/// Two equal spheres that meet head on with ±`speed`, measured by the library's kinematics.
fn two_spheres(law: &HertzMindlin, radius: f64, mass: f64, speed: f64, dt: f64) -> Collision {
    let geometry = ContactGeometry {
        reference_length: 2.0 * radius,
        area: 0.0,
        radius_a: radius,
        radius_b: radius,
        mass_a: mass,
        mass_b: mass,
    };
    let body = |x: f64, v: f64| Motion {
        position: Vec3::new(x, 0.0, 0.0),
        velocity: Vec3::new(v, 0.0, 0.0),
        angular_velocity: Vec3::zeros(),
        rotation_increment: crate::math::Quat::identity(),
        orientation: crate::math::Quat::identity(),
    };
    let (mut a, mut b) = (body(-radius, speed), body(radius, -speed));
    let mut frame = initial_geometry(&a.position, &b.position, &Vec3::zeros());
    let mut state = HertzMindlinState::default();
    let mut out = Collision::default();
    let mut steps = 0;
    loop {
        a.position += a.velocity * dt;
        b.position += b.velocity * dt;
        let image = ImageShift::default();
        let input =
            ContactInput { a: &a, b: &b, image: &image, geometry: &geometry, previous: &frame, bonded: false, dt };
        let kinematics = measure(MotionMeasure::Finite, &input);
        let response = law.respond(&kinematics, &state, dt);
        out.largest_force = out.largest_force.max(response.force.norm());
        out.largest_overlap = out.largest_overlap.max(-kinematics.elongation);
        steps += 1;
        if response.status == Status::Opened {
            out.duration = f64::from(steps) * dt;
            out.velocity = a.velocity;
            return out;
        }
        a.velocity += response.force * (dt / mass);
        b.velocity -= response.force * (dt / mass);
        state = response.state;
        frame = PreviousGeometry { normal: kinematics.normal, length: kinematics.length };
    }
}

/// A sphere hits the fixed plane `y = 0` with `speed` at `angle` from the plane's normal and moves in +x. Leapfrog with
/// velocities at half steps, so the displacement of a step is exact.
fn sphere_on_wall(law: &HertzMindlin, radius: f64, mass: f64, speed: f64, angle: f64, dt: f64) -> Collision {
    let geometry = ContactGeometry {
        reference_length: radius,
        area: 0.0,
        radius_a: radius,
        radius_b: 0.0,
        mass_a: mass,
        mass_b: f64::INFINITY,
    };
    let inertia = 0.4 * mass * radius * radius;
    let (sine, cosine) = sin_cos(angle);
    let normal = -Vec3::y();
    let mut length = radius;
    let mut velocity = Vec3::new(speed * sine, -speed * cosine, 0.0);
    let mut spin = Vec3::zeros();
    let mut state = HertzMindlinState::default();
    let mut out = Collision::default();
    let mut steps = 0;
    loop {
        let length_old = length;
        length += velocity.y * dt;
        let gap = length - radius;
        let arm_a = radius + 0.5 * gap;
        // Velocity of the wall's point relative to the sphere's: 0 − (v + ω × a n).
        let slide = -(velocity + spin.cross(&(normal * arm_a))) * dt;
        let kinematics = PointKinematics {
            geometry,
            length,
            length_old,
            elongation: gap,
            elongation_old: length_old - radius,
            gap,
            normal,
            shear_increment: slide - normal * slide.dot(&normal),
            arm_a,
            arm_b: 0.5 * gap,
            bonded: false,
            transport: Transport::identity(normal),
        };
        let response = law.respond(&kinematics, &state, dt);
        out.largest_force = out.largest_force.max(response.force.norm());
        out.largest_overlap = out.largest_overlap.max(-gap);
        steps += 1;
        if response.status == Status::Opened {
            out.duration = f64::from(steps) * dt;
            out.velocity = velocity;
            out.spin = spin;
            return out;
        }
        velocity += response.force * (dt / mass);
        spin += (normal * arm_a).cross(&response.force) * (dt / inertia);
        state = response.state;
    }
}

fn close(value: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((value / expected - 1.0).abs() < tolerance, "{what}: {value} instead of {expected}");
}

/// Test 1: the closed form to 1e-6, and the published numbers to their last digit. Leapfrog with 2e4 steps per
/// collision is off by (2π/4e4)²/24 ≈ 1e-9 at the peak, and the sampled peak misses the true one by as little; the
/// duration is known to one step, 5e-5.
#[test]
fn chung_ooi_1_two_spheres() {
    for (young, poisson, density, force, overlap, duration) in
        [(48e9, 0.20, 2800.0, 10_696.9, 274.11e-6, 40.34e-6), (20e9, 0.25, 2500.0, 7_108.2, 368.30e-6, 54.20e-6)]
    {
        let body = Elastic { young, poisson };
        let law = HertzMindlin::new(body, body, 0.35, 1.0).unwrap();
        let (radius, mass) = (0.01, mass_of(0.01, density));
        let (f, d, t) = hertz(&law, 0.5 * radius, 0.5 * mass, 20.0);
        close(f, force, 0.06 / force, "published force");
        close(d, overlap, 0.006e-6 / overlap, "published overlap");
        close(t, duration, 0.006e-6 / duration, "published duration");
        let out = two_spheres(&law, radius, mass, 10.0, t / 2e4);
        close(out.largest_force, f, 1e-6, "force");
        close(out.largest_overlap, d, 1e-6, "overlap");
        close(out.duration, t, 1e-4, "duration");
        close(-out.velocity.x, 10.0, 1e-6, "velocity afterwards");
    }
}

/// Test 2, with the tolerances of test 1.
#[test]
fn chung_ooi_2_sphere_on_rigid_plane() {
    for (young, poisson, density, force, overlap, duration) in
        [(70e9, 0.30, 2699.0, 11_369.9, 49.717e-6, 731.6e-6), (40e9, 0.35, 1800.0, 7_232.7, 52.123e-6, 767.1e-6)]
    {
        let law = HertzMindlin::new(Elastic { young, poisson }, Elastic::RIGID, 0.0, 1.0).unwrap();
        let (radius, mass) = (0.1, mass_of(0.1, density));
        let (f, d, t) = hertz(&law, radius, mass, 0.2);
        close(f, force, 0.06 / force, "published force");
        close(d, overlap, 0.0006e-6 / overlap, "published overlap");
        close(t, duration, 0.06e-6 / duration, "published duration");
        let out = sphere_on_wall(&law, radius, mass, 0.2, 0.0, t / 2e4);
        close(out.largest_force, f, 1e-6, "force");
        close(out.largest_overlap, d, 1e-6, "overlap");
        close(out.duration, t, 1e-4, "duration");
    }
}

/// Test 3: restitution. The benchmark's own tolerance is 1e-3. With 2e4 steps per elastic collision the half-step lag
/// of the dashpot leaves less than 2e-4, which is asserted. `e = 0` needs a dashpot that may pull.
#[test]
fn chung_ooi_3_restitution() {
    for (young, poisson, density) in [(380e9, 0.23, 4000.0), (100e9, 0.25, 7000.0)] {
        let body = Elastic { young, poisson };
        let (radius, mass, speed) = (0.0025, mass_of(0.0025, density), 3.9);
        for e in [0.2, 0.4, 0.6, 0.8, 1.0] {
            let never_pulls = HertzMindlin::new(body, Elastic::RIGID, 0.0, e).unwrap();
            let pulls = never_pulls.with_tension_from_damping(e).unwrap();
            let (_, _, t) = hertz(&never_pulls, radius, mass, speed);
            for law in [never_pulls, pulls] {
                let out = sphere_on_wall(&law, radius, mass, speed, 0.0, t / 2e4);
                let found = out.velocity.y / speed;
                println!("chung-ooi 3: e {e} pulls {} gives {found}", law.tension_from_damping);
                assert!((found - e).abs() < 2e-4, "{e}: {found}");
            }
        }
    }
    // Without restitution the contact may pull, and its damping is critical.
    let plastic = HertzMindlin::new(Elastic { young: 380e9, poisson: 0.23 }, Elastic::RIGID, 0.0, 0.0).unwrap();
    assert!(plastic.tension_from_damping && plastic.damping_ratio == 1.0);
}

/// Test 4: oblique impact of an aluminum oxide sphere on a rigid plane, `e = 0.98`, `μ = 0.092`, against the closed
/// form of gross sliding, `e_t = 1 − μ(1+e)/tan θ`, `ω = (5/2)μ(1+e)v cos θ/R`, valid if `tan θ ≥ (7/2)μ(1+e)` (32.5°).
/// 2e-3: the closed form uses the arm `R` instead of `R − δ/2` (δ/2R = 1.6e-3); the lag of the dashpot adds 1e-4.
#[test]
fn chung_ooi_4_sliding() {
    let (friction, e, radius, speed) = (0.092, 0.98, 0.0025, 3.9);
    let law = HertzMindlin::new(Elastic { young: 380e9, poisson: 0.23 }, Elastic::RIGID, friction, e).unwrap();
    let mass = mass_of(radius, 4000.0);
    let (_, _, t) = hertz(&law, radius, mass, speed);
    for degrees in [40.0_f64, 50.0, 60.0, 70.0, 80.0, 85.0] {
        let (sine, cosine) = sin_cos(degrees.to_radians());
        let out = sphere_on_wall(&law, radius, mass, speed, degrees.to_radians(), t / 2e4);
        let impulse = friction * (1.0 + e) * speed * cosine;
        close(out.velocity.x, speed * sine - impulse, 2e-3, "tangential velocity");
        close(-out.spin.z, 2.5 * impulse / radius, 2e-3, "spin");
    }
}

/// Test 4 against the digitized curves of the paper: angle, ratio of tangential velocities, angular velocity (rad/s),
/// rebound angle of the contact patch (degrees). Measure: `Σ|Δ|/Σ|reference|`, as other users of the benchmark do.
/// Tolerances 8e-3, 1.2e-2, and 2e-2 (Kratos' own tests of its law use 1.6e-2, 2.2e-2, and 2.5e-2). Where gross sliding
/// makes the solution known, the digitized values are off by 2e-3, 7e-3, and 5e-3 (up to 2 % at 85°, where the angular
/// velocity is small). The rest is the difference at 10° and 15° between an incremental no-slip spring and the paper's
/// curves.
#[test]
fn chung_ooi_4_digitized() {
    const TABLE: [[f64; 4]; 12] = [
        [10.0, 0.6870, -213.0, -1.56],
        [15.0, 0.6244, -377.8, -5.54],
        [20.0, 0.6161, -510.6, -7.54],
        [25.0, 0.6343, -599.4, -7.54],
        [30.0, 0.6837, -616.5, -3.55],
        [35.0, 0.7372, -582.3, 3.43],
        [40.0, 0.7809, -544.8, 11.57],
        [50.0, 0.8451, -457.0, 29.35],
        [60.0, 0.8929, -357.5, 47.79],
        [70.0, 0.9316, -246.2, 64.58],
        [80.0, 0.9662, -126.3, 78.70],
        [85.0, 0.9827, -63.1, 84.52],
    ];
    let (radius, speed) = (0.0025, 3.9);
    let law = HertzMindlin::new(Elastic { young: 380e9, poisson: 0.23 }, Elastic::RIGID, 0.092, 0.98).unwrap();
    let mass = mass_of(radius, 4000.0);
    let (_, _, t) = hertz(&law, radius, mass, speed);
    let (mut error, mut size) = ([0.0; 3], [0.0; 3]);
    for row in &TABLE {
        let angle = row[0].to_radians();
        let out = sphere_on_wall(&law, radius, mass, speed, angle, t / 2e4);
        let patch = out.velocity.x + radius * out.spin.z;
        let found = [
            out.velocity.x / (speed * sin_cos(angle).0),
            out.spin.z,
            crate::math::atan2(patch, out.velocity.y).to_degrees(),
        ];
        println!("chung-ooi 4: {:2.0}° {found:?} paper {:?}", row[0], &row[1..]);
        for k in 0..3 {
            error[k] += (found[k] - row[k + 1]).abs();
            size[k] += row[k + 1].abs();
        }
    }
    for (k, tolerance) in [8e-3, 1.2e-2, 2e-2].into_iter().enumerate() {
        println!("chung-ooi 4: column {k}: {:.2e}", error[k] / size[k]);
        assert!(error[k] / size[k] < tolerance, "column {k}: {}", error[k] / size[k]);
    }
}

// -----------------------------------------------------------------------------------------------------------
// Conformance

use crate::conformance::{GEOMETRY, Native, Observed, Properties, Station, Subject, Window, atlas, atlas_paths, check};

const BODY: Elastic = Elastic { young: 1e6, poisson: 0.25 };

/// Overlaps are a large fraction of the length, so rounding of positions hides nothing.
fn subject(name: &'static str, law: HertzMindlin) -> Subject<Native<HertzMindlin>> {
    let window = Window { elongation: [-0.4, 0.1], shear: 0.5 };
    Subject {
        name,
        host: Native(law),
        geometry: GEOMETRY,
        bonded: false,
        properties: Properties {
            conservative_normal: law.damping_ratio == 0.0,
            conservative_shear: false,
            dissipation_nonnegative: true,
            // The dashpot vanishes with the overlap, so even a pulling one opens without a jump.
            continuous_failure: true,
            brittle: false,
        },
        elastic: window,
        inelastic: window,
        held: Station { elongation: -0.3, shear: [0.05, -0.04], twist: 0.0 },
        failure: 0.1,
        dt: 1e-3,
    }
}

/// The law written out for two components of shear, without dashpots. Between turning points of the overlap the shear
/// force follows `k_t = 8G*√(R*δ)`: kept while δ grows, scaled with `√δ` while it shrinks.
fn closed_form(law: HertzMindlin) -> impl FnMut(&Observed) -> Option<[f64; 3]> {
    let radius = 0.8 * 1.2 / 2.0;
    let (mut shear_before, mut overlap_before) = ([0.0; 2], 0.0_f64);
    let mut force = [0.0; 2];
    move |now| {
        let overlap = (-now.station.elongation).max(0.0);
        let pressure = 4.0 / 3.0 * law.effective_young * (radius * overlap * overlap * overlap).sqrt();
        let stiffness = 8.0 * law.effective_shear * (radius * overlap).sqrt();
        for k in 0..2 {
            if overlap < overlap_before {
                force[k] *= (overlap / overlap_before).sqrt();
            }
            force[k] += stiffness * (now.station.shear[k] - shear_before[k]);
        }
        (shear_before, overlap_before) = (now.station.shear, overlap);
        let size = (force[0] * force[0] + force[1] * force[1]).sqrt();
        if size > law.friction * pressure {
            for x in &mut force {
                *x *= law.friction * pressure / size;
            }
        }
        Some([-pressure, force[0], force[1]])
    }
}

#[test]
fn undamped_contact_conforms() {
    let law = HertzMindlin::new(BODY, BODY, 0.5, 1.0).unwrap();
    let subject = subject("hertz-mindlin", law);
    let mut report = check(&subject);
    report.findings.extend(atlas(
        &subject,
        &atlas_paths(&subject.inelastic, 50),
        || closed_form(law),
        1e-12,
        "rounding of orientations over 250 steps",
    ));
    println!("{report}");
    assert!(report.passed(), "{report}");
}

#[test]
fn damped_contacts_conform() {
    let mut law = HertzMindlin::new(BODY, Elastic { young: 3e6, poisson: 0.1 }, 0.4, 0.6).unwrap();
    law.shear_damping_ratio = 0.1;
    for law in [law, law.with_tension_from_damping(0.6).unwrap()] {
        let report = check(&subject("damped hertz-mindlin", law));
        println!("{report}");
        assert!(report.passed(), "{report}");
    }
}

#[test]
fn bad_parameters_are_named() {
    let message = HertzMindlin::new(BODY, BODY, f64::NAN, 1.0).unwrap_err().to_string();
    assert_eq!(message, "law hertz_mindlin: friction_coefficient = NaN must be finite and not negative");
    assert!(HertzMindlin::new(BODY, BODY, 0.1, 1.1).is_err());
    assert!(HertzMindlin::new(Elastic { poisson: 0.6, ..BODY }, BODY, 0.1, 1.0).is_err());
    assert!(HertzMindlin::new(BODY, BODY, 0.1, 0.5).unwrap().with_tension_from_damping(-0.1).is_err());
}

/// Two materials: the restitution and the shear damping of the mean, the friction of the smoother surface, and the compliances
/// of both bodies added.
#[test]
fn two_materials_share_a_contact() {
    let table = |young: f64, poisson: f64, restitution: f64, other: f64| HertzMindlinTable {
        young: Stress::new(young),
        poisson: Number::new(poisson),
        friction_coefficient: Number::new(other),
        restitution: Number::new(restitution),
        shear_damping_ratio: Number::new(0.5 * other),
    };
    let row = HertzMindlin::row(&table(1e9, 0.25, 0.5, 0.75), &table(4e9, 0.0, 0.75, 0.25)).unwrap();
    let bodies = [Elastic { young: 1e9, poisson: 0.25 }, Elastic { young: 4e9, poisson: 0.0 }];
    let expected = HertzMindlin::new(bodies[0], bodies[1], 0.25, 0.625).unwrap();
    assert_eq!(row, HertzMindlin { shear_damping_ratio: 0.25, ..expected });
    // (1−ν²)/E and 2(1+ν)(2−ν)/E; a few roundings.
    assert!((row.effective_young * (0.9375 / 1e9 + 1.0 / 4e9) - 1.0).abs() < 1e-15);
    assert!((row.effective_shear * (2.0 * 1.25 * 1.75 / 1e9 + 4.0 / 4e9) - 1.0).abs() < 1e-15);
}

/// What the time step knows of a contact follows from its force: the stiffness at an overlap is the slope of the force there, the
/// dashpot is that of the law, and an elastic impact stores all its kinetic energy, `½mv² = ∫f dδ`. Finite differences of 1e-6 of the
/// overlap leave 1e-9; the integral is exact.
#[test]
fn bounds_follow_from_the_force() {
    let law = HertzMindlin::new(Elastic { young: 1e9, poisson: 0.25 }, Elastic { young: 4e9, poisson: 0.0 }, 0.5, 0.6)
        .unwrap();
    let geometry =
        ContactGeometry { reference_length: 3.0, area: 1.0, radius_a: 1.0, radius_b: 2.0, mass_a: 2.0, mass_b: 6.0 };
    // Force (N) and dashpot (N·s/m) at an overlap, for an approach at this rate (m/s).
    let force = |overlap: f64, rate: f64| {
        let dt = 1e-6;
        let k = PointKinematics {
            geometry,
            length: 3.0 - overlap,
            length_old: 3.0 - overlap + rate * dt,
            elongation: -overlap,
            elongation_old: -overlap + rate * dt,
            gap: -overlap,
            normal: Vec3::x(),
            shear_increment: Vec3::zeros(),
            arm_a: 1.0,
            arm_b: 2.0,
            bonded: false,
            transport: Transport::identity(Vec3::x()),
        };
        -law.respond(&k, &HertzMindlinState::default(), dt).force.x
    };
    let overlap = 0.02;
    let h = 1e-6 * overlap;
    let slope = (force(overlap + h, 0.0) - force(overlap - h, 0.0)) / (2.0 * h);
    let found = law.stiffness_at(&geometry, overlap);
    assert!((found.normal / slope - 1.0).abs() < 1e-8, "{} {slope}", found.normal);
    let dashpot = force(overlap, 1.0) - force(overlap, 0.0);
    assert!((found.normal_damping / dashpot - 1.0).abs() < 1e-8, "{} {dashpot}", found.normal_damping);
    // Mindlin: k_t/k_n = 4G*/E*.
    assert!((found.shear / found.normal - 4.0 * law.effective_shear / law.effective_young).abs() < 1e-14);
    let speed = 3.0;
    let deepest = law.impact_overlap(&geometry, speed);
    let (stored, kinetic) = (0.4 * force(deepest, 0.0) * deepest, 0.5 * 1.5 * speed * speed);
    assert!((stored / kinetic - 1.0).abs() < 1e-12, "{stored} {kinetic}");
}
