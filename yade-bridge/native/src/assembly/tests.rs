//! Tests with three spheres of concrete that a host moves.

use concordem_contact::law::cpm::{CpmParameters, DamageLaw};

use super::*;

/// Three spheres of concrete in a row, the first two bonded; the third comes from the right.
fn three_spheres(kinematics: MotionMeasure) -> Assembly {
    with_clumps(kinematics, &[]).expect("the input is valid")
}

/// What the contact of the three spheres stores of its bodies, as YADE does.
#[derive(Clone, Copy)]
struct Stored {
    length: f64,
    radii: f64,
    reference_overlap: f64,
    parameters: [f64; STORED.len()],
}

/// Of two spheres of the material below that touched when they were bonded.
fn touching() -> Stored {
    let parameters = [25e9, 0.2 * 25e9, 0.6, 3e6, 1e-4, 10.0 * 1e-4, 0.0, 0.0, 1.0, 0.0];
    Stored { length: 2e-3, radii: 2e-3, reference_overlap: 0.0, parameters }
}

/// The three spheres, some of them in clumps.
fn with_clumps(kinematics: MotionMeasure, clumps: &[HostClump]) -> Result<Assembly, String> {
    taken_over(kinematics, clumps, touching(), [DamageLaw::Exponential; 2])
}

/// The three spheres with what their contact stores, and the damage laws of two materials, of which they have the first.
fn taken_over(
    kinematics: MotionMeasure,
    clumps: &[HostClump],
    stored: Stored,
    laws: [DamageLaw; 2],
) -> Result<Assembly, String> {
    let position = [Vec3::zeros(), Vec3::new(2e-3, 0.0, 0.0), Vec3::new(4.1e-3, 0.0, 0.0)];
    let velocity = [Vec3::zeros(), Vec3::new(0.1, 0.02, 0.0), Vec3::new(-3.0, 0.0, 0.0)];
    let bodies = Bodies {
        id: &[7, 3, 11],
        position: &position,
        velocity: &velocity,
        orientation: &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        angular_velocity: &[Vec3::zeros(); 3],
        radius: &[1e-3; 3],
        mass: &[1e-5; 3],
        inertia: &[4e-12; 3],
        material: &[0; 3],
        constraint: &[0; 3],
        lost: &[5, 0, 2],
    };
    let contacts = Contacts {
        pair: &[[1, 0]],
        image: &[[0; 3]],
        bonded: &[true],
        length: &[stored.length],
        area: &[3e-6],
        normal: &[Vec3::new(-1.0, 0.0, 0.0)],
        distance: &[2e-3],
        history: &[0.0, 2e-4, 0.3, 0.0, 0.0, 0.0, 1e-5, 0.0, 0.0, 0.0, 0.0],
        radii: &[stored.radii],
        reference_overlap: &[stored.reference_overlap],
        stored: &stored.parameters,
        own: &[],
    };
    let pairs = [(0, 0), (0, 1), (1, 1)].map(|(a, b)| PairParameters {
        a,
        b,
        parameters: CpmParameters { damage_law: laws[b as usize], ..material() },
    });
    let origin = Origin::Concrete {
        kinematics,
        materials: 2,
        damping: 0.0,
        gravity: [0.0; 3],
        pairs: pairs.into(),
        own: vec![],
    };
    Assembly::concrete(&bodies, &contacts, clumps, origin, None, 1e-7)
}

/// The material of the spheres.
fn material() -> CpmParameters {
    CpmParameters::new(25e9, 0.2, 3e6, 0.6, 1e-4, 10.0)
}

/// A clump of these two spheres.
fn clump_of(members: [u32; 2], offsets: [Vec3; 2], position: Vec3) -> HostClump {
    HostClump {
        members: members.to_vec(),
        offsets: offsets.to_vec(),
        orientations: vec![Quat::identity(); 2],
        position,
        velocity: Vec3::zeros(),
        orientation: Quat::identity(),
        angular_momentum: Vec3::zeros(),
        mass: 2e-5,
        inertia: Vec3::new(8e-12, 2e-11, 2e-11),
        constraint: 0,
    }
}

/// Move the spheres as a host does; returns the bits of the forces of all steps.
fn drive(assembly: &mut Assembly, steps: usize) -> Vec<u64> {
    let mut bits = Vec::new();
    for _ in 0..steps {
        let p = &assembly.state.particles;
        let (position, velocity, angular_velocity) =
            (p.position.clone(), p.velocity.clone(), p.angular_velocity.clone());
        let motion = |k: usize| BodyState {
            position: position[k] + velocity[k] * 1e-7,
            velocity: velocity[k],
            angular_velocity: angular_velocity[k],
            orientation: [0.0, 0.0, 0.0, 1.0],
            constraint: 0,
        };
        assembly.take_motions(1e-7, |k, _| Ok(motion(k))).expect("finite");
        assembly.find_forces(1e-7, None, true).expect("a step");
        bits.extend(assembly.solver.forces().iter().flat_map(|f| f.iter().map(|x| x.to_bits())));
    }
    bits
}

#[test]
fn a_saved_assembly_continues_bitwise_equal() {
    for kinematics in [MotionMeasure::Finite, MotionMeasure::YadeRatcheting] {
        let mut straight = three_spheres(kinematics);
        drive(&mut straight, 500);
        let words = straight.to_words().expect("words");
        let mut again = Assembly::from_words(&words).expect("the same");
        assert_eq!(again.to_words().expect("words"), words);
        let forces = drive(&mut straight, 500);
        assert_eq!(drive(&mut again, 500), forces);
        assert!(forces.iter().any(|&bits| f64::from_bits(bits).abs() > 0.1), "a force acts");
    }
}

/// Lost strength and number of lost contacts of each body, by id.
fn losses(assembly: &Assembly) -> Vec<(u32, f64, u32)> {
    let found = assembly.particle_results().expect("finite forces");
    let mut rows: Vec<_> = (0..3).map(|p| (assembly.state.particles.id[p], found.damage[p], found.lost[p])).collect();
    rows.sort_by_key(|row| row.0);
    rows
}

#[test]
fn losses_before_the_take_over_count() {
    let mut assembly = three_spheres(MotionMeasure::Finite);
    drive(&mut assembly, 1);
    // One bond is left, of bodies 3 and 7; a lost one counts as 1. Body 11 has none.
    let lost_strength = assembly.state.bonds[0].lost_strength(0);
    assert!(lost_strength > 0.05 && lost_strength < 0.5, "{lost_strength}");
    let wanted = vec![(3, lost_strength, 0), (7, (lost_strength + 5.0) / 6.0, 5), (11, 1.0, 2)];
    assert_eq!(losses(&assembly), wanted);
    let again = Assembly::from_words(&assembly.to_words().expect("words")).expect("the same");
    assert_eq!((losses(&again), again.broken), (wanted, 0));
}

#[test]
fn contacts_that_do_not_match_their_bodies_are_rejected() {
    let with = |stored| taken_over(MotionMeasure::Yade, &[], stored, [DamageLaw::Exponential; 2]);
    let refused = |change: &dyn Fn(&mut Stored), text: &str| {
        let mut stored = touching();
        change(&mut stored);
        let message = with(stored).err().unwrap_or_default();
        assert!(message.contains("the contact of bodies ") && message.contains(text), "{text} is not in \"{message}\"");
    };
    refused(&|stored| stored.length = f64::NAN, "has not been evaluated by its law; take one step");
    // A millionth of the radius is far above rounding, and far below what anyone would see.
    refused(&|stored| stored.radii += 2e-9, "do not change radii after bonding");
    refused(&|stored| stored.reference_overlap += 2e-9, "refPD");
    refused(&|stored| stored.reference_overlap = f64::NAN, "refPD");
    refused(&|stored| stored.length += 2e-9, "refPD");
    for (k, name) in STORED.iter().enumerate() {
        // Far above rounding; some are zero.
        refused(&|stored| stored.parameters[k] += 1e-9 * stored.parameters[k].max(1.0), &format!("has {name} = "));
        refused(&|stored| stored.parameters[k] = f64::NAN, &format!("has {name} = NaN"));
    }
    // Rounding of the host is allowed: one unit in the last place.
    let mut stored = touching();
    stored.parameters = stored.parameters.map(|x| x * (1.0 + f64::EPSILON));
    stored.radii = stored.radii.next_up();
    stored.reference_overlap = 2e-19;
    assert!(with(stored).is_ok());
}

#[test]
fn materials_with_two_damage_laws_are_rejected() {
    for laws in [[DamageLaw::Linear, DamageLaw::Exponential], [DamageLaw::Exponential, DamageLaw::Linear]] {
        let message = taken_over(MotionMeasure::Yade, &[], touching(), laws).err().unwrap_or_default();
        assert!(message.contains("materials 0 and 1") && message.contains("give both the same"), "{message}");
    }
}

#[test]
fn truncated_words_are_rejected() {
    let words = three_spheres(MotionMeasure::Finite).to_words().expect("words");
    for length in (0..words.len()).step_by(7) {
        assert!(Assembly::from_words(&words[..length]).is_err(), "{length} of {}", words.len());
    }
}

#[test]
fn invalid_input_is_rejected() {
    let mut assembly = three_spheres(MotionMeasure::Finite);
    let nan = Vec3::new(f64::NAN, 0.0, 0.0);
    let place = assembly.state.particles.id.iter().position(|&id| id == 11).expect("it is there");
    let motion = |k| BodyState { velocity: if k == place { nan } else { Vec3::zeros() }, ..BodyState::default() };
    let message = assembly.take_motions(1e-7, |k, _| Ok(motion(k))).expect_err("not finite");
    assert!(message.contains("body 11"), "{message}");
    assert!(assembly.find_forces(0.0, None, false).expect_err("no step").contains("time step"));
    let cell = cell_of(Mat3::identity(), Mat3::identity(), Mat3::zeros(), 1e-7);
    assert!(assembly.find_forces(1e-7, Some(cell), false).expect_err("no cell").contains("periodic"));
    assert!(motion_measure("nonsense").expect_err("unknown").contains("first-order"));
}

#[test]
fn members_of_a_clump_move_together_and_do_not_interact() {
    let (middle, half) = (Vec3::new(3.05e-3, 0.0, 0.0), Vec3::new(1.05e-3, 0.0, 0.0));
    // The members come in the order of the host, which differs from that of the solver.
    let clump = clump_of([2, 1], [half, -half], middle);
    let mut assembly = with_clumps(MotionMeasure::Finite, std::slice::from_ref(&clump)).expect("the input is valid");
    let members = assembly.state.clumps[0].members.clone();
    assert!(members[0] < members[1]);
    let length = |assembly: &Assembly| {
        let [a, b] = [0, 1].map(|k| assembly.state.particles.position[members[k] as usize]);
        (b - a).norm()
    };
    let (start, momentum) = (length(&assembly), |assembly: &Assembly| {
        let p = &assembly.state.particles;
        let alone = (0..3).find(|p| !members.contains(p)).expect("one is not in the clump") as usize;
        p.velocity[alone] * p.mass[alone] + assembly.state.clumps[0].velocity * assembly.state.clumps[0].mass
    });
    for _ in 0..200 {
        assembly.solver.step(&mut assembly.state).expect("a step");
    }
    // Rounding of 200 rotations.
    assert!((length(&assembly) - start).abs() < 1e-13 * start);
    assert!(momentum(&assembly).norm() < 1e-18, "the bond pulls both equally");
    assert!(assembly.state.clumps[0].velocity.norm() > 1e-4, "the bond moves the clump");
    let inner = with_clumps(MotionMeasure::Finite, &[clump_of([0, 1], [-half, half], Vec3::new(1e-3, 0.0, 0.0))]);
    assert!(inner.err().is_some_and(|message| message.contains("away from its place")));
    let half = Vec3::new(1e-3, 0.0, 0.0);
    let inner = with_clumps(MotionMeasure::Finite, &[clump_of([0, 1], [-half, half], half)]);
    assert!(
        inner.err().is_some_and(|message| message.contains("bodies 7 and 3 interact") || message.contains("3 and 7"))
    );
    let twice = with_clumps(MotionMeasure::Finite, &[clump.clone(), clump]);
    assert!(twice.err().is_some_and(|message| message.contains("in two clumps")));
}
