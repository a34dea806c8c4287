//! The concrete law in YADE's form agrees with YADE bit for bit.
//!
//! `golden/yade/make_gold.py` ran Debian's YADE 2023.02a and recorded every input and output of its law
//! `Law2_ScGeom_CpmPhys_Cpm` and of the geometry functor before it. These tests apply our kinematics and law to the same
//! positions, velocities, and rates. "Equal" means the same 64 bits; there is no tolerance in this file.

use concordem::kinematics::sphere_sphere::{ImageShift, Motion, measure};
use concordem::kinematics::{ContactInput, MotionMeasure, PreviousGeometry};
use concordem::law::cpm::{Cpm, CpmFormulation, CpmState, CpmTable, DamageLaw, contact_area};
use concordem::law::{ContactGeometry, ContactLaw, RegisteredLaw as _, Status};
use concordem::math::{Quat, Vec3};
use concordem::quantity::{Angle, Number, Stress};
use concordem_tests::gold::{Row, Table, read};
use std::collections::BTreeMap;

/// One material as in a scenario; what belongs to the law in YADE comes from `law`.
fn material(material: &Row<'_>, law: &Row<'_>) -> CpmTable {
    CpmTable {
        mode: CpmFormulation::YadePublic,
        young: Stress::new(material.real("young")),
        shear_ratio: Number::new(material.real("poisson")),
        cohesion: Stress::new(material.real("sigma_t")),
        friction_angle: Some(Angle::new(material.real("friction_angle"))),
        friction_coefficient: None,
        crack_onset_strain: Number::new(material.real("eps_crack_onset")),
        relative_ductility: Some(Number::new(material.real("rel_ductility"))),
        fracture_energy: None,
        damage_law: if material.real("dam_law") == 0.0 { DamageLaw::Linear } else { DamageLaw::Exponential },
        omega_threshold: Number::new(law.real("omega_threshold")),
        never_damage: material.flag("never_damage"),
        shear_contribution: Number::new(material.real("shear_contribution")),
        soft_strain: Some(Number::new(law.real("eps_soft"))),
        relative_soft_stiffness: Some(Number::new(law.real("rel_kn_soft"))),
        isotropic_prestress: Stress::new(material.real("iso_prestress")),
        yield_surface: None,
        yield_log_speed: None,
        damage_time: None,
        damage_rate_exponent: None,
        plasticity_time: None,
        plasticity_rate_exponent: None,
    }
}

/// The law between two materials.
fn law_of(first: &CpmTable, second: &CpmTable) -> Cpm {
    Cpm::row(first, second).expect("YADE accepts these")
}

/// Asserts that two numbers are equal in every bit; `place` locates a difference.
fn same(ours: f64, yades: f64, what: &str, place: &str) {
    assert!(ours.to_bits() == yades.to_bits(), "{place}: {what} is {ours:e}, YADE has {yades:e}");
}

fn same_vector(ours: &Vec3, yades: &Vec3, what: &str, place: &str) {
    for axis in 0..3 {
        same(ours[axis], yades[axis], &format!("{what}[{axis}]"), place);
    }
}

fn motion(row: &Row<'_>, number: u8) -> Motion {
    Motion {
        position: row.vector(&format!("x{number}")),
        velocity: row.vector(&format!("v{number}")),
        angular_velocity: row.vector(&format!("w{number}")),
        // not read by the first-order kinematics
        rotation_increment: Quat::identity(),
        orientation: Quat::identity(),
    }
}

/// Replays the steps of one contact.
struct Replay {
    law: Cpm,
    mode: MotionMeasure,
    image: ImageShift,
    dt: f64,
    geometry: ContactGeometry,
    bonded: bool,
    frame: Option<PreviousGeometry>,
    state: CpmState,
}

/// How often each event occurred, to show what a test covers.
#[derive(Default, Debug)]
struct Coverage {
    steps: usize,
    slips: usize,
    damaging: usize,
    softening: usize,
    broke: usize,
    opened: usize,
    unbonded: usize,
}

impl Replay {
    fn new(law: Cpm, gold: &Row<'_>, constants: &Row<'_>) -> Self {
        let place = "constants";
        let p = law.parameters();
        same(p.young, constants.real("young"), "young", place);
        same(p.shear_modulus(), constants.real("shear_modulus"), "shear modulus", place);
        same(p.friction_coefficient, constants.real("tan_friction"), "tan_friction", place);
        same(p.cohesion, constants.real("cohesion"), "cohesion", place);
        same(p.crack_onset_strain, constants.real("eps_crack_onset"), "crack onset strain", place);
        same(p.softening_strain(1.0), constants.real("eps_fracture"), "softening strain", place);
        same(p.shear_contribution, constants.real("shear_contribution"), "shear contribution", place);
        same(p.isotropic_prestress, constants.real("iso_prestress"), "prestress", place);
        assert_eq!(p.never_damage, constants.flag("never_damage"));
        let (radius_a, radius_b) = (constants.real("r1"), constants.real("r2"));
        let length = constants.real("length");
        let area = contact_area(radius_a, radius_b);
        same(area, constants.real("area"), "area", place);
        same(radius_a + radius_b - length, constants.real("reference_penetration"), "reference penetration", place);
        same(area * p.young / length, constants.real("kn"), "kn", place);
        same(area * p.shear_modulus() / length, constants.real("ks"), "ks", place);
        let shift = gold.vector("shift");
        Self {
            law,
            mode: if gold.flag("ratcheting") { MotionMeasure::YadeRatcheting } else { MotionMeasure::Yade },
            image: ImageShift { displacement: shift, velocity: Vec3::zeros(), periodic: shift != Vec3::zeros() },
            dt: gold.real("dt"),
            geometry: ContactGeometry { reference_length: length, area, radius_a, radius_b, mass_a: 1.0, mass_b: 1.0 },
            bonded: constants.flag("cohesive"),
            frame: None,
            state: CpmState::default(),
        }
    }

    /// Takes the history from the recorded outputs of a step instead of from the replay.
    fn adopt(&mut self, row: &Row<'_>) {
        let penetration = row.real("penetration");
        let reference = self.geometry.radius_a + self.geometry.radius_b - self.geometry.reference_length;
        self.state = CpmState {
            normal_strain: (reference - penetration) / self.geometry.reference_length,
            kappa: row.real("kappa"),
            omega: row.real("omega"),
            plastic_normal_strain: row.real("eps_n_plastic"),
            damage_strain: 0.0,
            shear_strain: row.vector("eps_t"),
            plastic_shear_strain: row.vector("eps_t_plastic"),
        };
        let length = self.geometry.radius_a + self.geometry.radius_b - penetration;
        self.frame = Some(PreviousGeometry { normal: row.vector("normal"), length });
    }

    /// Replays one step and compares everything that YADE recorded.
    fn step(&mut self, row: &Row<'_>, place: &str, coverage: &mut Coverage) {
        let (a, b) = (motion(row, 1), motion(row, 2));
        // YADE does not rotate a contact in the step that creates it
        let frame = self.frame.unwrap_or_else(|| {
            let l = b.position + self.image.displacement - a.position;
            let length = concordem::math::yade_order::norm(&l);
            same(length, self.geometry.reference_length, "reference length", place);
            PreviousGeometry { normal: l / length, length }
        });
        let input = ContactInput {
            a: &a,
            b: &b,
            image: &self.image,
            geometry: &self.geometry,
            previous: &frame,
            bonded: self.bonded,
            dt: self.dt,
        };
        let k = measure(self.mode, &input);
        let old = self.state;
        let response = self.law.respond(&k, &old, self.dt);
        coverage.steps += 1;
        coverage.unbonded += usize::from(!self.bonded);
        let alive = row.flag("alive");
        assert_eq!(response.status == Status::Lives, alive, "{place}: {:?}", response.status);
        if !alive {
            assert_eq!(response.status, if self.bonded { Status::Broke } else { Status::Opened });
            coverage.broke += usize::from(self.bonded);
            coverage.opened += usize::from(!self.bonded);
            return;
        }
        same(-k.gap, row.real("penetration"), "penetration", place);
        same_vector(&k.normal, &row.vector("normal"), "normal", place);
        same_vector(&k.shear_increment, &row.vector("shear_increment"), "shear increment", place);
        let state = response.state;
        same(state.normal_strain + self.law.prestress_strain(), row.real("eps_n"), "epsN", place);
        same(state.plastic_normal_strain, row.real("eps_n_plastic"), "epsNPl", place);
        same(state.kappa, row.real("kappa"), "kappaD", place);
        same(state.omega, row.real("omega"), "omega", place);
        same_vector(&state.shear_strain, &row.vector("eps_t"), "epsT", place);
        same_vector(&state.plastic_shear_strain, &row.vector("eps_t_plastic"), "epsTPl", place);
        let force = -row.vector("normal_force") - row.vector("shear_force");
        same_vector(&response.force, &force, "force", place);
        let area = self.geometry.area;
        let normal_force = -(k.normal * (row.real("sigma_n") * area));
        same_vector(&normal_force, &row.vector("normal_force"), "normal force of sigmaN", place);
        same_vector(&(-(row.vector("sigma_t") * area)), &row.vector("shear_force"), "shear force of sigmaT", place);
        coverage.slips += usize::from(state.plastic_shear_strain != old.plastic_shear_strain);
        coverage.damaging += usize::from(state.omega > old.omega && self.bonded);
        coverage.softening += usize::from(state.plastic_normal_strain != old.plastic_normal_strain);
        self.state = state;
        self.frame = Some(PreviousGeometry { normal: k.normal, length: k.length });
    }
}

/// Two spheres on prescribed paths with every option of YADE's law, from the first step on; our law computes the history.
#[test]
fn law_tester_paths_bit_for_bit() {
    let tables = read("law_tester.bin");
    let cases: Vec<&str> = tables.keys().filter_map(|name| name.strip_suffix(".steps")).collect();
    assert_eq!(cases.len(), 31);
    let mut coverage = Coverage::default();
    for case in cases {
        let table = |part: &str| &tables[&format!("{case}.{part}")];
        let gold = table("law").row(0);
        let [first, second] = [0, 1].map(|row| material(&table("materials").row(row), &gold));
        let law = law_of(&first, &second);
        let constants = table("constants").row(0);
        let exponential = law.parameters().damage_law == DamageLaw::Exponential;
        assert_eq!(usize::from(exponential), constants.real("dam_law") as usize);
        let mut replay = Replay::new(law, &gold, &constants);
        for (number, row) in table("steps").rows().enumerate() {
            replay.step(&row, &format!("{case}, step {number}"), &mut coverage);
        }
    }
    println!("{coverage:?}");
    assert!(coverage.steps > 2900 && coverage.slips > 400 && coverage.damaging > 600 && coverage.softening > 200);
    assert!(coverage.broke >= 6 && coverage.opened >= 4 && coverage.unbonded > 150);
}

/// Contacts from uniaxial tests of a specimen, in windows of consecutive steps: the first step of a window takes its history
/// from YADE, the following steps from our law. Contacts that form within a window start without history.
#[test]
fn specimen_contacts_bit_for_bit() {
    let tables = read("specimen.bin");
    for (run, broken, loose) in [("tension", 0, 0), ("compression", 0, 0), ("softening", 5, 50)] {
        let gold = tables[&format!("{run}.law")].row(0);
        let material = material(&tables[&format!("{run}.materials")].row(0), &gold);
        let law = law_of(&material, &material);
        let mut coverage = Coverage::default();
        let prefix = format!("{run}.");
        for (name, table) in &tables {
            let Some(contact) = name.strip_prefix(&prefix).and_then(|rest| rest.strip_suffix(".steps")) else {
                continue;
            };
            let constants = tables[&format!("{run}.{contact}.constants")].row(0);
            let mut replay = Replay::new(law, &gold, &constants);
            for (number, row) in table.rows().enumerate() {
                if number == 0 && !row.flag("fresh") {
                    replay.adopt(&row);
                } else {
                    replay.step(&row, &format!("{run}, contact {contact}, row {number}"), &mut coverage);
                }
            }
        }
        println!("{run}: {coverage:?}");
        assert!(coverage.steps >= 400 && coverage.slips > 40 && coverage.damaging > 40, "{run}: {coverage:?}");
        assert!(coverage.broke >= broken && coverage.unbonded >= loose, "{run}: {coverage:?}");
        assert_eq!(coverage.softening > 0, run == "softening");
    }
}

/// State of a pair, as YADE treats it.
#[derive(Clone, Copy, PartialEq)]
enum Pair {
    /// Bonded in the first step.
    Bonded,
    /// Its bond broke, or its contact opened.
    Apart,
    /// In contact without a bond, since the given step.
    Loose(usize),
}

/// Whole trajectories agree bit for bit: a simple loop of kinematics, law, and YADE's integrator, from the stored initial
/// state, reproduces every stored end force, position, velocity, rotation, and history for 2,000 or 3,000 steps, through
/// damage, slip, breakage, and new contacts.
///
/// This requires YADE's order of summation: forces are added per body in the order in which YADE visits its interactions,
/// which is part of the gold data. In any other order the trajectories diverge, in the tension test by 1e-12 of the end
/// force after 150 steps, 1e-9 after 500, and 1e-5 after 750, because softening amplifies rounding errors.
#[test]
fn trajectories_bit_for_bit() {
    let tables = read("trajectory.bin");
    let laws = read("specimen.bin");
    for run in ["tension", "compression", "softening"] {
        let gold = laws[&format!("{run}.law")].row(0);
        let material = material(&laws[&format!("{run}.materials")].row(0), &gold);
        let law = law_of(&material, &material);
        let (broken, renewed) = follow(&tables, run, law);
        println!("{run}: {broken} bonds broken, {renewed} contacts made later");
        assert_eq!(broken > 1000 && renewed > 10, run == "softening", "{broken} {renewed}");
    }
}

/// Computes one test and compares it with everything stored. Returns the numbers of broken bonds and of new contacts.
fn follow(tables: &BTreeMap<String, Table>, run: &str, law: Cpm) -> (usize, usize) {
    let table = |part: &str| &tables[&format!("{run}.{part}")];
    let setup = table("setup").row(0);
    let (dt, damping) = (setup.real("dt"), setup.real("damping"));
    let initial: Vec<Row<'_>> = table("initial").rows().collect();
    let curve: Vec<Row<'_>> = table("curve").rows().collect();
    let end: Vec<f64> = initial.iter().map(|row| row.real("end")).collect();
    let mut bodies: Vec<Motion> = initial
        .iter()
        .map(|row| Motion {
            position: Vec3::new(row.real("x"), row.real("y"), row.real("z")),
            velocity: row.vector("v"),
            angular_velocity: Vec3::zeros(),
            rotation_increment: Quat::identity(),
            orientation: Quat::identity(),
        })
        .collect();
    let mut contacts: Vec<Contact> = tables["bonds"].rows().map(|row| Contact::bond(&row, &initial)).collect();
    let (mut broken, mut renewed) = (0, 0);
    for step in 0..setup.real("steps") as usize {
        let mut force = vec![Vec3::zeros(); bodies.len()];
        let mut moment = vec![Vec3::zeros(); bodies.len()];
        for contact in &mut contacts {
            let (one, two) = (&bodies[contact.a], &bodies[contact.b]);
            if contact.pair == Pair::Apart {
                if !contact.touches(one, two) {
                    continue;
                }
                contact.renew(one, two, step);
                renewed += 1;
            }
            let bonded = contact.pair == Pair::Bonded;
            let frame = contact.frame.unwrap_or_else(|| straight(one, two));
            let image = ImageShift::default();
            let input = ContactInput {
                a: one,
                b: two,
                image: &image,
                geometry: &contact.geometry,
                previous: &frame,
                bonded,
                dt,
            };
            let k = measure(MotionMeasure::YadeRatcheting, &input);
            let response = law.respond(&k, &contact.state, dt);
            if response.status != Status::Lives {
                broken += usize::from(bonded);
                contact.pair = Pair::Apart;
                continue;
            }
            contact.state = response.state;
            contact.frame = Some(PreviousGeometry { normal: k.normal, length: k.length });
            force[contact.a] += response.force;
            force[contact.b] -= response.force;
            // YADE computes the contact point first; arm times normal would differ in the last bit
            let contact_point = one.position + k.normal * k.arm_a;
            moment[contact.a] += (contact_point - one.position).cross(&response.force);
            moment[contact.b] += (contact_point - two.position).cross(&-response.force);
        }
        if step % 10 == 0 {
            let row = &curve[step / 10];
            assert_eq!(row.real("step") as usize, step);
            for (name, side) in [("force_low", -1.0), ("force_high", 1.0)] {
                let sum = (0..bodies.len()).filter(|&i| end[i] == side).fold(0.0, |sum, i| sum + force[i].z);
                same(sum, row.real(name), name, &format!("{run}, step {step}"));
            }
        }
        for (i, body) in bodies.iter_mut().enumerate() {
            let (mass, inertia) = (initial[i].real("mass"), initial[i].real("inertia"));
            let held = end[i] != 0.0;
            let acceleration = damped(force[i] / mass, &body.velocity, damping, dt, [false, false, held]);
            let spin = damped(moment[i] / inertia, &body.angular_velocity, damping, dt, [held; 3]);
            body.velocity += acceleration * dt;
            body.angular_velocity += spin * dt;
            body.position += body.velocity * dt;
        }
        if tables.contains_key(&format!("{run}.bodies.{}", step + 1)) {
            compare(tables, run, step + 1, &bodies, &contacts);
        }
    }
    (broken, renewed)
}

fn straight(one: &Motion, two: &Motion) -> PreviousGeometry {
    let l = two.position - one.position;
    let length = concordem::math::yade_order::norm(&l);
    PreviousGeometry { normal: l / length, length }
}

struct Contact {
    a: usize,
    b: usize,
    geometry: ContactGeometry,
    pair: Pair,
    frame: Option<PreviousGeometry>,
    state: CpmState,
}

impl Contact {
    fn bond(row: &Row<'_>, initial: &[Row<'_>]) -> Self {
        let (a, b) = (row.real("id1") as usize, row.real("id2") as usize);
        let (radius_a, radius_b) = (initial[a].real("r"), initial[b].real("r"));
        Self {
            a,
            b,
            geometry: ContactGeometry {
                reference_length: row.real("length"),
                area: contact_area(radius_a, radius_b),
                radius_a,
                radius_b,
                mass_a: initial[a].real("mass"),
                mass_b: initial[b].real("mass"),
            },
            pair: Pair::Bonded,
            frame: None,
            state: CpmState::default(),
        }
    }

    /// YADE's contact test, which compares squares.
    fn touches(&self, one: &Motion, two: &Motion) -> bool {
        let l = two.position - one.position;
        let reach = self.geometry.radius_a + self.geometry.radius_b;
        reach * reach - concordem::math::yade_order::dot(&l, &l) >= 0.0
    }

    fn renew(&mut self, one: &Motion, two: &Motion, step: usize) {
        self.pair = Pair::Loose(step);
        self.geometry.reference_length = straight(one, two).length;
        self.frame = None;
        self.state = CpmState::default();
    }
}

/// Compares a whole state with the stored one.
fn compare(tables: &BTreeMap<String, Table>, run: &str, steps: usize, bodies: &[Motion], contacts: &[Contact]) {
    let table = |part: &str| &tables[&format!("{run}.{part}.{steps}")];
    let place = |kind: &str, i: usize| format!("{run}, after {steps} steps, {kind} {i}");
    assert_eq!(table("bodies").rows().count(), bodies.len());
    for (i, (body, row)) in bodies.iter().zip(table("bodies").rows()).enumerate() {
        same_vector(&body.position, &row.vector("x"), "position", &place("body", i));
        same_vector(&body.velocity, &row.vector("v"), "velocity", &place("body", i));
        same_vector(&body.angular_velocity, &row.vector("w"), "rotation", &place("body", i));
    }
    let history = |contact: &Contact, row: &Row<'_>, place: &str| {
        same(contact.state.kappa, row.real("kappa"), "kappa", place);
        // only the last snapshot of a run is complete
        if row.width() > 4 {
            same_vector(&contact.state.shear_strain, &row.vector("eps_t"), "epsT", place);
            same_vector(&contact.state.plastic_shear_strain, &row.vector("eps_t_plastic"), "epsTPl", place);
        }
    };
    for (i, (contact, row)) in contacts.iter().zip(table("bonds").rows()).enumerate() {
        let place = place("bond", i);
        assert_eq!(contact.pair != Pair::Bonded, row.real("kappa").is_nan(), "{place}");
        if contact.pair == Pair::Bonded {
            history(contact, &row, &place);
        }
    }
    let mut later: Vec<&Contact> = contacts.iter().filter(|c| matches!(c.pair, Pair::Loose(_))).collect();
    later.sort_by_key(|contact| (contact.a, contact.b));
    assert_eq!(table("later").rows().count(), later.len(), "{run}, after {steps} steps");
    for (i, (contact, row)) in later.iter().zip(table("later").rows()).enumerate() {
        let place = place("later contact", i);
        let gold = (row.real("id1") as usize, row.real("id2") as usize, row.real("born") as usize);
        let Pair::Loose(born) = contact.pair else { unreachable!("filtered above") };
        assert_eq!((contact.a, contact.b, born), gold, "{place}");
        history(contact, &row, &place);
    }
}

/// YADE's sign function: the sign of 0 is 0.
fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// Acceleration after YADE's damping; zero along blocked axes.
fn damped(acceleration: Vec3, velocity: &Vec3, damping: f64, dt: f64, blocked: [bool; 3]) -> Vec3 {
    let mut out = acceleration;
    for axis in 0..3 {
        let a = acceleration[axis];
        out[axis] = if blocked[axis] { 0.0 } else { a * (1.0 - damping * sign(a * (velocity[axis] + 0.5 * dt * a))) };
    }
    out
}
