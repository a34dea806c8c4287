//! Assembly: the state contains everything that a scenario specifies, or the scenario is refused.

use std::path::Path;

use concordem::assembly::{Assembly, AssemblyError};
use concordem::law::{CohesiveBeam, ContactLaw, Cpm, Frictional, HertzMindlin};
use concordem::math::{Vec3, rotate};
use concordem::schedule::Loading;
use concordem::solver::Solver;
use concordem::solver::forces::EvaluatedContacts;
use concordem::state::contacts::ContactBlock;
use concordem_tests::runs::{self, finish, refusal, sound, started};

fn built(text: &str) -> Result<Assembly, AssemblyError> {
    runs::built(text, Path::new("scenarios/good"))
}

fn made(text: &str) -> Assembly {
    sound(built(text))
}

/// Key and message of the error for a text that must be refused.
fn refused(text: &str) -> (String, String) {
    refusal(built(text))
}

/// Scenario of ten planes of nine bonded spheres along z, with the text `more`.
fn bar(more: &str) -> String {
    format!(
        "version = 1
        [packing]
        kind = \"lattice\"
        lattice = \"sc\"
        radius = 1.0
        repeats = [3, 3, 10]
        [[material]]
        name = \"stone\"
        density = 1000
        linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 1e5 }}
        [bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.1
        [contacts]
        law = \"none\"
        [stop]
        steps = 10
        {more}"
    )
}

/// Two touching spheres of materials that differ in the key `differs`, with the law `law` for contacts, and for bonds if `bonds`.
fn two_materials(law: &str, keys: &str, differs: &str, bonds: bool) -> Assembly {
    let bonds = if bonds { format!("[bonds]\nlaw = \"{law}\"\ninteraction_ratio = 1.5") } else { String::new() };
    let material = |name: &str, factor: &str| {
        format!("[[material]]\nname = \"{name}\"\ndensity = 1000\n{law} = {{ {keys}, {differs} = {factor}e9 }}\n")
    };
    made(&format!(
        "version = 1
        [packing]
        kind = \"spheres\"
        spheres = [[0, 0, 0, 1], [2, 0, 0, 1]]
        {}{}
        [contacts]
        law = \"{law}\"
        {bonds}
        [stop]
        steps = 1",
        material("one", "25"),
        material("other", "30"),
    ))
}

/// The friction coefficients of all pairs of materials in a block of the law `L`, which `of` gives.
fn frictions<L: ContactLaw>(block: &dyn EvaluatedContacts, of: fn(&L) -> f64) -> Vec<u64> {
    let block = block.contacts().as_any().downcast_ref::<ContactBlock<L>>().expect("contacts of this law");
    block.rows.iter().map(|row| of(row).to_bits()).collect()
}

/// Beams have the radius that their rule gives, between spheres of 1, 3, and 3 m: the mean of all is 7/3 m, and of the first pair the
/// smaller radius is 1 m, the mean 2 m, and the harmonic mean 2·1·3/4 = 1.5 m.
#[test]
fn beams_have_the_radius_of_their_rule() {
    for (rule, first, second) in [
        ("", 7.0 / 3.0, 7.0 / 3.0),
        ("radius_rule = \"mean-of-all\"", 7.0 / 3.0, 7.0 / 3.0),
        ("radius_rule = \"smaller\"", 1.0, 3.0),
        ("radius_rule = \"mean\"", 2.0, 3.0),
        ("radius_rule = \"harmonic-mean\"", 1.5, 3.0),
    ] {
        let assembly = made(&format!(
            "version = 1
            [packing]
            kind = \"spheres\"
            spheres = [[0, 0, 0, 1.0], [4, 0, 0, 3.0], [10, 0, 0, 3.0]]
            [[material]]
            name = \"stone\"
            density = 1000
            [material.cohesive_beam]
            young = 1e9
            radius_ratio = 0.5
            {rule}
            [bonds]
            law = \"cohesive_beam\"
            interaction_ratio = 1.1
            [contacts]
            law = \"none\"
            [stop]
            steps = 10"
        ));
        let contacts = assembly.state.bonds[0].contacts();
        let block = contacts.as_any().downcast_ref::<ContactBlock<CohesiveBeam>>().expect("beams");
        for (k, radius) in [first, second].into_iter().enumerate() {
            let area = std::f64::consts::PI * 0.25 * radius * radius;
            // Three roundings.
            assert!((block.reference.get(k).area / area - 1.0).abs() < 1e-15, "{rule}, bond {k}");
        }
    }
}

/// A friction coefficient arrives in every law as it is written, within a material and between two that differ otherwise.
#[test]
fn friction_arrives_in_the_laws_as_it_is_written() {
    let contacts = |assembly: Assembly| assembly.state.contacts.expect("unbonded contacts");
    let of_frictional = |law: &Frictional| law.friction;
    let of_cpm = |law: &Cpm| law.parameters().friction_coefficient;
    let mut found = Vec::new();
    for mode in ["thesis", "woo"] {
        let keys = format!(
            "mode = \"{mode}\", shear_ratio = 0.2, cohesion = 3e6, crack_onset_strain = 1e-4, relative_ductility = 30, \
             friction_coefficient = 0.8"
        );
        let assembly = two_materials("cpm", &keys, "young", true);
        found.push(frictions(&*assembly.state.bonds[0], of_cpm));
        found.push(frictions(&*contacts(assembly), of_cpm));
    }
    let springs = "shear_stiffness = 1e6, friction_coefficient = 0.8";
    let broken = two_materials("linear_bond", springs, "normal_stiffness", true);
    found.push(frictions(&*contacts(broken), of_frictional));
    let frictional = two_materials("frictional", springs, "normal_stiffness", false);
    found.push(frictions(&*contacts(frictional), of_frictional));
    let spheres = "poisson = 0.2, restitution = 0.8, friction_coefficient = 0.8";
    let hertz = two_materials("hertz_mindlin", spheres, "young", false);
    found.push(frictions(&*contacts(hertz), |law: &HertzMindlin| law.friction));
    for bits in found {
        assert!(bits.len() >= 3 && bits.iter().all(|&bits| bits == 0.8_f64.to_bits()), "{bits:x?}");
    }
}

const MIDDLE: &str = "
[[set]]
name = \"pair\"
selection = { kind = \"ids\", ids = [40, 41] }
[[clump]]
set = \"pair\"
";

const PULL: &str = "
[loading]
kind = \"uniaxial\"
strain_rate = 0.1
layer_thickness = 2.5
";

/// The example that uses all tables is built and runs, and its bodies start with the given motion.
#[test]
fn clumps_and_walls_are_built() {
    let text = std::fs::read_to_string("scenarios/good/clumps-and-walls.toml").expect("the scenario");
    let Assembly { mut state, model, .. } = made(&text);
    let velocities: Vec<Vec3> = state.clumps.iter().map(|clump| clump.velocity).collect();
    assert_eq!(velocities, [Vec3::new(-1.0, 0.0, 0.0), Vec3::new(0.0, 0.0, -0.01)]);
    // All spheres belong to the set "everything", the fourth one: 24 cells of four spheres in the packing, and two of
    // the first clump.
    assert_eq!(state.particles.len(), 98);
    assert!(state.particles.tags.iter().all(|tag| tag >> 3 & 1 == 1));
    let mut solver = Solver::new(model, &mut state).unwrap();
    for _ in 0..10 {
        solver.step(&mut state).unwrap();
    }
    // A body that touches nothing falls.
    let fallen = state.clumps[0].velocity;
    assert!(fallen.x < -0.9 && fallen.z < 0.0 && state.clumps[1].velocity.z < -0.01, "{fallen}");
}

/// Motions prescribed for members of clumps are refused; the message names set, particle, and clump.
#[test]
fn prescribed_members_are_refused() {
    let (key, message) = refused(&bar(&format!("{MIDDLE}[[prescribe]]\nset = \"pair\"\nvelocity = [0, 0, 1]")));
    assert_eq!(key, "prescribe[0].set");
    for part in ["`pair`", "particle 40", "clump[0]", "from the set"] {
        assert!(message.contains(part), "{message}");
    }
}

/// A clump takes the velocity that [[initial]] gives all of its members; velocities that no rigid body can have are refused.
#[test]
fn clumps_start_with_the_velocity_of_their_members() {
    let initial = |selection: &str, motion: &str| {
        bar(&format!(
            "{MIDDLE}[[set]]\nname = \"some\"\nselection = {selection}\n[[initial]]\nset = \"some\"\n{motion}"
        ))
    };
    let velocity = Vec3::new(0.1, 0.2, 0.3);
    let assembly = made(&initial("{ kind = \"all\" }", "velocity = [0.1, 0.2, 0.3]"));
    assert_eq!(assembly.state.clumps[0].velocity, velocity);
    assert!(assembly.state.particles.velocity.iter().all(|v| *v == velocity));
    let (key, message) = refused(&initial("{ kind = \"ids\", ids = [40] }", "velocity = [0.1, 0.2, 0.3]"));
    assert!(key == "clump[0]" && message.contains("different velocities"), "{key}: {message}");
    let (key, message) = refused(&initial("{ kind = \"all\" }", "angular_velocity = [0, 0, 1]"));
    assert!(key == "clump[0]" && message.contains("its own `angular_velocity`"), "{key}: {message}");
}

/// End layers that contain members of clumps are refused.
#[test]
fn clumps_in_end_layers_are_refused() {
    let clump = "[[set]]\nname = \"pair\"\nselection = { kind = \"ids\", ids = [8, 17] }\n[[clump]]\nset = \"pair\"";
    let (key, message) = refused(&bar(&format!("{PULL}{clump}")));
    assert_eq!(key, "loading.layer_thickness");
    assert!(message.contains("particle 8") && message.contains("clump[0]"), "{message}");
    let turn = "[loading]\nkind = \"bending\"\naxis = \"z\"\nabout = \"x\"\nrate = 0.1\nlayer_thickness = 2.5\n";
    let boxed = |text: String| text.replace("repeats = [3, 3, 10]", "shape = { kind = \"box\", size = [6, 6, 20] }");
    let (key, message) = refused(&boxed(bar(&format!("{turn}{clump}"))));
    assert!(key == "loading.layer_thickness" && message.contains("clump[0]"), "{key}: {message}");
}

/// A clump starts with the velocity field of the loading at its center: 0.1/s times the distance from the middle.
#[test]
fn clumps_start_with_the_velocity_field() {
    let Assembly { state, .. } = made(&bar(&format!("{PULL}{MIDDLE}")));
    let clump = &state.clumps[0];
    // The layers are the outermost planes, at z = 0 and 18.
    let expected = 0.1 * (clump.position.z - 9.0);
    assert!(expected != 0.0 && (clump.velocity.z - expected).abs() < 1e-15, "{} {expected}", clump.velocity);
    for &m in &clump.members {
        assert_eq!(state.particles.velocity[m as usize], clump.velocity);
    }
}

/// Velocity fields do not change prescribed components; particles of layers cannot have another prescribed motion.
#[test]
fn fields_keep_prescribed_velocities() {
    let held = "[[set]]\nname = \"held\"\nselection = { kind = \"ids\", ids = [40] }\n";
    let at_40 = |assembly: &Assembly| {
        let particles = &assembly.state.particles;
        let p = particles.id.iter().position(|&id| id == 40).expect("particle 40");
        (particles.velocity[p], particles.angular_velocity[p])
    };
    let text = bar(&format!("{PULL}{held}[[prescribe]]\nset = \"held\"\nvelocity = [\"free\", \"free\", 0.7]"));
    assert_eq!(at_40(&made(&text)).0.z, 0.7);
    let turn = "[loading]\nkind = \"bending\"\naxis = \"z\"\nabout = \"x\"\nrate = 0.1\nlayer_thickness = 2.5\n";
    let boxed = |text: String| text.replace("repeats = [3, 3, 10]", "shape = { kind = \"box\", size = [6, 6, 20] }");
    let text = bar(&format!("{turn}{held}[[prescribe]]\nset = \"held\"\nangular_velocity = [0.7, \"free\", \"free\"]"));
    assert_eq!(at_40(&made(&boxed(text))).1.x, 0.7);
    let strain = "[loading]\nkind = \"cell-strain\"\nvelocity_gradient = [[0, 0, 0], [0, 0, 0], [0, 0, 0.1]]\n";
    let periodic =
        |text: String| text.replace("repeats =", "shape = { kind = \"periodic\", tiles = [1, 1, 1] }\nrepeats =");
    let text = bar(&format!("{strain}{held}[[prescribe]]\nset = \"held\"\nvelocity = [\"free\", \"free\", 0.7]"));
    assert_eq!(at_40(&made(&periodic(text))).0.z, 0.7);
    // Particle 8 is in the lower layer, which already moves along z.
    let twice = held.replace("[40]", "[8]") + "[[prescribe]]\nset = \"held\"\nvelocity = [\"free\", \"free\", 0.7]";
    let (key, message) = refused(&bar(&format!("{PULL}{twice}")));
    assert!(key == "loading.layer_thickness" && message.contains("particle 8"), "{key}: {message}");
    let (key, _) = refused(&boxed(bar(&format!("{turn}{twice}"))));
    assert_eq!(key, "loading.layer_thickness");
    // Bending in a plane: x is prescribed for all particles.
    let plane = "[[set]]\nname = \"all\"\nselection = { kind = \"all\" }\n[[prescribe]]\nset = \"all\"\nvelocity = [0, \"free\", \"free\"]";
    made(&boxed(bar(&format!("{turn}{plane}"))));
}

/// Layers with `lateral = "fixed"` have no velocity across the axis, whatever the initial velocity of the specimen.
#[test]
fn fixed_layers_do_not_drift() {
    let text = bar(&format!(
        "{PULL}lateral = \"fixed\"\n[[set]]\nname = \"all\"\nselection = {{ kind = \"all\" }}\n[[initial]]\nset = \"all\"\n\
         velocity = [1, 0, 0]\nangular_velocity = [0, 1, 0]"
    ));
    let Assembly { state, schedule, .. } = made(&text);
    let Loading::Uniaxial { layers, .. } = &schedule.loading else { panic!("uniaxial") };
    assert_eq!(layers.each_ref().map(Vec::len), [9, 9]);
    for &p in layers.iter().flatten() {
        let (velocity, spin) = (state.particles.velocity[p as usize], state.particles.angular_velocity[p as usize]);
        assert!(velocity.x == 0.0 && velocity.z != 0.0 && spin == Vec3::zeros(), "{velocity} {spin}");
    }
}

/// By default, end layers are as thick as bonds reach, also if the reach follows from a coordination number. In a
/// face-centered block nine pairs per sphere lie in the shell at √3 diameters (all up to √2 are 9 in the bulk and fewer at
/// surfaces): `1 + 2√3` = 4.46 radii include three planes, at 1, 1 + √2, and 1 + 2√2 radii from the end. Bonds between
/// touching spheres only (3 radii) would include two.
#[test]
fn end_layers_reach_as_far_as_bonds() {
    let text = bar("[loading]\nkind = \"uniaxial\"\nstrain_rate = 0.1")
        .replace("interaction_ratio = 1.1", "coordination = 18")
        .replace("\"sc\"", "\"fcc\"")
        .replace("[3, 3, 10]", "[3, 3, 5]");
    let Assembly { schedule, summary, .. } = made(&text);
    let (_, ratio) = summary.bulk.expect("a coordination");
    assert!((ratio - 3f64.sqrt()).abs() < 1e-12, "{ratio}");
    let Loading::Uniaxial { layers, .. } = &schedule.loading else { panic!("uniaxial") };
    assert_eq!(layers.each_ref().map(Vec::len), [54, 54]);
}

/// Sets include spheres of clumps: by position, by number, and all. The material of a clump, if given, overrides that
/// of sets.
#[test]
fn sets_include_the_spheres_of_clumps() {
    let text = |material: &str| {
        format!(
            "version = 1
            [packing]
            kind = \"spheres\"
            spheres = [[0, 0, 0, 1]]
            [[material]]
            name = \"light\"
            density = 1000
            linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 1e5 }}
            [[material]]
            name = \"heavy\"
            density = 2000
            linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 1e5 }}
            [contacts]
            law = \"linear_bond\"
            [[clump]]
            spheres = [[10, 0, 0, 1], [11, 0, 0, 1]]
            {material}
            [[set]]
            name = \"all\"
            selection = {{ kind = \"all\" }}
            material = \"heavy\"
            [[set]]
            name = \"last\"
            selection = {{ kind = \"ids\", ids = [2] }}
            [[set]]
            name = \"far\"
            selection = {{ kind = \"sphere\", center = [10, 0, 0], radius = 0.5 }}
            [integration]
            time_step = 1e-5
            [stop]
            steps = 1"
        )
    };
    let tags_and_materials = |text: &str| {
        let Assembly { state, .. } = made(text);
        let place = |id: u32| state.particles.id.iter().position(|&other| other == id).expect("the particle");
        [0, 1, 2].map(|id| (state.particles.tags[place(id)], state.particles.material[place(id)]))
    };
    assert_eq!(tags_and_materials(&text("")), [(0b001, 1), (0b101, 1), (0b011, 1)]);
    assert_eq!(tags_and_materials(&text("material = \"light\"")), [(0b001, 1), (0b101, 0), (0b011, 0)]);
}

/// Given moments of inertia, smallest first, are assigned to the principal axes in this order: two spheres above each other
/// have the smallest moment about z.
#[test]
fn given_moments_of_inertia_are_assigned_to_their_axes() {
    let text =
        bar("[[clump]]\nspheres = [[30, 0, 0, 1], [30, 0, 1, 1]]\ninertia = [1, 2, 2]\nangular_velocity = [0, 0, 3]\n\
         velocity = [0, 0, 0]");
    let Assembly { state, .. } = made(&text);
    let clump = &state.clumps[0];
    // Tolerance: rounding of the rotations between body and world axes.
    assert!((clump.angular_momentum - Vec3::new(0.0, 0.0, 3.0)).norm() < 1e-14, "{}", clump.angular_momentum);
    let axis = rotate(&clump.orientation, &Vec3::x());
    assert!((axis.z.abs() - 1.0).abs() < 1e-14, "{axis}");
}

/// Contacts store the index of their pair coefficients in 16 bits, of which one value means none: 255 materials need
/// 255² indices, 256 are too many.
#[test]
fn too_many_materials_are_refused() {
    let text = |count: usize| {
        let material = |k: usize| {
            format!(
                "[[material]]\nname = \"m{k}\"\ndensity = 1000\n\
                 linear_bond = {{ normal_stiffness = {}, shear_stiffness = 1e5 }}\n",
                1_000_000 + k
            )
        };
        let materials: String = (0..count).map(material).collect();
        format!(
            "version = 1\n[packing]\nkind = \"spheres\"\nspheres = [[0, 0, 0, 1], [2, 0, 0, 1]]\n{materials}\
             [bonds]\nlaw = \"linear_bond\"\ninteraction_ratio = 1.1\n[contacts]\nlaw = \"none\"\n\
             [[set]]\nname = \"second\"\nselection = {{ kind = \"ids\", ids = [1] }}\nmaterial = \"m{}\"\n[stop]\nsteps = 1",
            count - 1
        )
    };
    let Assembly { state, .. } = made(&text(255));
    let block = state.bonds[0].contacts();
    // Mean of 1e6 and 1e6 + 254.
    assert_eq!(block.stiffness(0, &state.particles, false).normal, 1_000_127.0);
    let (key, message) = refused(&text(256));
    assert!(key == "material" && message.contains("linear_bond") && message.contains("255"), "{key}: {message}");
}

/// Scenario of two discs in a plane cell; `packing`: keys of the packing.
fn discs(packing: &str) -> String {
    format!(
        "version = 1
        dimension = 2
        [packing]
        {packing}
        [[material]]
        name = \"disc\"
        density = 1000
        linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 1e5 }}
        [bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.01
        [contacts]
        law = \"none\"
        [stop]
        steps = 10"
    )
}

/// Builds a scenario whose packing is a file of discs in `folder`.
fn discs_of_file(folder: &Path, content: &str) -> Result<Assembly, AssemblyError> {
    std::fs::write(folder.join("discs.txt"), content).expect("a temporary folder can be written to");
    let text = discs("kind = \"file\"\npath = \"discs.txt\"");
    runs::built(&text, folder)
}

/// Files of discs are checked like listed discs: centers in the plane, a cell of unit depth. The cell of the scenario
/// replaces that of the file.
#[test]
fn files_of_discs_lie_in_the_plane() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let refusal = |content: &str| refusal(discs_of_file(folder.path(), content));
    let (key, message) = refusal("0 0 0 0.01\n0.019 0 0.005 0.01\n");
    assert!(key == "packing" && message.starts_with("sphere 1 lies at z = 0.005 m"), "{key}: {message}");
    let (_, message) = refusal("##PERIODIC:: 0.04 0.04 0.04\n0.01 0.01 0 0.01\n0.03 0.01 0 0.01\n");
    assert!(message.contains("0.04 m deep along z") && message.contains("[\"0.04 m\", \"0.04 m\", 1]"), "{message}");
    let (_, message) = refusal("# cell 0.04 0 0.001 0 0.04 0 0 0 1\n0.01 0.01 0 0.01\n");
    assert!(message.contains("leans out of the plane"), "{message}");
    let made = discs_of_file(folder.path(), "##PERIODIC:: 0.04 0.04 1\n0.01 0.01 0 0.01\n0.03 0.01 0 0.01\n");
    let summary = sound(made).summary;
    // Two discs of π·0.01² in a square of 0.04: π/8. Tolerance: a few roundings.
    assert!((summary.packing_fraction.expect("a cell") / std::f64::consts::PI * 8.0 - 1.0).abs() < 1e-14);
    assert_eq!(summary.bonds, 2);
}

/// Discs of radius 0.5 m would bond to their own images one depth away and are refused.
#[test]
fn discs_do_not_reach_their_images_along_z() {
    let text = |radius: f64| {
        discs(&format!(
            "kind = \"spheres\"\nspheres = [[{radius}, {radius}, 0, {radius}], [{}, {radius}, 0, {radius}]]\n\
             cell = [{}, {}, 1]",
            3.0 * radius,
            4.0 * radius,
            4.0 * radius
        ))
    };
    let (key, message) = refused(&text(0.499));
    assert!(key == "packing" && message.contains("their own images along z"), "{key}: {message}");
    assert_eq!(made(&text(0.4)).summary.bonds, 2);
}

/// Scenario of a sphere at `place`, and a wall.
fn sphere_and_wall(place: &str, wall: &str) -> String {
    format!(
        "version = 1
        [packing]
        kind = \"spheres\"
        spheres = [[{place}, 0.01]]
        [[material]]
        name = \"a\"
        density = 2500
        frictional = {{ normal_stiffness = 1e6, shear_stiffness = 0 }}
        [[wall]]
        name = \"floor\"
        material = \"a\"
        shape = {wall}
        [contacts]
        law = \"frictional\"
        [integration]
        time_step = 1e-6
        [stop]
        steps = 10"
    )
}

/// Particles inside or behind walls before the first step are refused, because their elastic energy would expel them.
#[test]
fn particles_inside_walls_are_refused() {
    let plane = "{ kind = \"plane\", point = [0, 0, 0], normal = [0, 0, 1] }";
    let rod = "{ kind = \"cylinder\", center = [0, 0, 0], axis = \"x\", radius = 0.02, side = \"outside\" }";
    let tube = "{ kind = \"cylinder\", center = [0, 0, 0], axis = \"x\", radius = 0.02 }";
    for (place, wall, depth) in [
        ("0, 0, 0.005", plane, "5 mm"),
        ("0, 0, -0.3", plane, "310 mm"),
        ("0, 0, 0.0297", rod, "0.3 mm"),
        ("0, 0, 0", rod, "30 mm"),
        ("0, 0, 0.015", tube, "5 mm"),
    ] {
        let (key, message) = refused(&sphere_and_wall(place, wall));
        assert!(
            key == "wall[0].shape" && message.contains(&format!("lies {depth} deep in the wall \"floor\"")),
            "{message}"
        );
    }
    for (place, wall) in [("0, 0, 0.01", plane), ("0, 0, 0.00995", plane), ("0, 0, 0.03", rod), ("0, 0, 0", tube)] {
        made(&sphere_and_wall(place, wall));
    }
}

/// Triangles of a wall that stand twice, in whatever order of their corners, would both push.
#[test]
fn repeated_triangles_of_a_wall_are_refused() {
    let wall = |triangles: &str| {
        bar(&format!(
            "[[wall]]
            material = \"stone\"
            shape = {{ kind = \"mesh\", vertices = [[0, 0, -9], [1, 0, -9], [0, 1, -9], [1, 1, -9]], triangles = {triangles} }}"
        ))
        .replace("law = \"none\"", "law = \"linear_bond\"")
    };
    made(&wall("[[0, 1, 2], [1, 3, 2]]"));
    let (key, message) = refused(&wall("[[0, 1, 2], [1, 3, 2], [2, 1, 0]]"));
    assert!(key == "wall[0].shape" && message.contains("1 of its 3 triangles stand there before"), "{key} {message}");
}

/// If the number of bonds depends on rounding, there is a warning: touching spheres at the interaction ratio 1 are bonded
/// with a warning. There is a warning, too, if there are no bonds.
#[test]
fn doubtful_bonds_are_reported() {
    let keys = |text: &str| -> Vec<String> {
        made(text).summary.warnings.iter().map(|warning| format!("{}: {}", warning.key, warning.message)).collect()
    };
    assert!(keys(&bar("")).is_empty());
    let ties = bar("").replace("interaction_ratio = 1.1", "interaction_ratio = 1");
    let warnings = keys(&ties);
    assert!(
        warnings.len() == 1 && warnings[0].starts_with("bonds.interaction_ratio: 201 of the 201 bonds"),
        "{warnings:?}"
    );
    let none = bar("").replace(
        "kind = \"lattice\"\n        lattice = \"sc\"\n        radius = 1.0\n        repeats = [3, 3, 10]",
        "kind = \"spheres\"\nspheres = [[0, 0, 0, 1], [3, 0, 0, 1]]",
    );
    let none = none.replace("steps = 10", "steps = 10\n[integration]\ntime_step = 1e-3");
    let warnings = keys(&none);
    assert!(warnings.len() == 1 && warnings[0].contains("so there are no bonds"), "{warnings:?}");
}

/// Bonds of 2 m with the crack onset strain 1e-4 and a modulus of 25 GPa store 250 J/m² at the onset of cracks: a fracture energy of less is
/// refused. Below three times as much they soften more steeply than they load, which is reported.
#[test]
fn bonds_long_for_their_fracture_energy_are_reported() {
    let with = |energy: f64| {
        let law = format!(
            "cpm = {{ young = 25e9, shear_ratio = 0.2, cohesion = 3e6, crack_onset_strain = 1e-4, fracture_energy = {energy}, \
             friction_coefficient = 0.8 }}"
        );
        bar("")
            .replace("linear_bond = { normal_stiffness = 1e6, shear_stiffness = 1e5 }", &law)
            .replace("law = \"linear_bond\"", "law = \"cpm\"")
    };
    let (key, message) = refused(&with(249.0));
    assert!(key == "material[0].cpm" && message.contains("a bond is 2.0000e0 m long"), "{key}: {message}");
    assert!(message.contains("from 1.9920e0 m on it stores its fracture energy"), "{message}");
    let warned = |energy| made(&with(energy)).summary.warnings.iter().any(|one| one.key == "material[0].cpm");
    assert!(warned(251.0) && warned(749.0) && !warned(751.0));
}

/// Two spheres of 1 m between platens: three contacts of the stiffness `k` in series. Closed by `Δ`, the column bears `kΔ/3`;
/// stress is that over the given area, strain `Δ/4 m`, both negative. The platens close at 1 mm/s, a thousandth of the speed at which
/// the column answers, so that inertia and damping leave 1 %.
#[test]
fn platens_measure_the_column_between_them() {
    let text = "version = 1
        [packing]
        kind = \"spheres\"
        spheres = [[0, 0, 1, 1], [0, 0, 3, 1]]
        [[material]]
        name = \"m\"
        density = 1000
        frictional = { normal_stiffness = 1e6, shear_stiffness = 0 }
        [contacts]
        law = \"frictional\"
        [loading]
        kind = \"platens\"
        axis = \"z\"
        closing_velocity = 1e-3
        material = \"m\"
        area = 2
        [integration]
        damping = { kind = \"local\", coefficient = 0.5 }
        [stop]
        time = 5
        [output]
        sample_interval = 1";
    let record = finish(&mut started(made(text))).expect("records");
    let closed = 1e-3 * record.time;
    // The sum of 10⁴ or so displacements of 1e-7 m.
    assert!((record.strain + closed / 4.0).abs() < 1e-12, "{} {closed}", record.strain);
    let expected = -1e6 * closed / 3.0 / 2.0;
    assert!((record.stress / expected - 1.0).abs() < 0.01, "{} {expected}", record.stress);
}

/// A bar breaks in tension: every event names its bond by ids in ascending order, and the modes of its energy, which sum up to one.
/// A bond of a straight bar is stretched and nothing else.
#[test]
fn events_name_bonds_and_modes() {
    let text = bar(PULL).replace("shear_stiffness = 1e5", "shear_stiffness = 1e5, normal_strength = 1e4");
    let mut simulation = started(made(&text.replace("steps = 10\n", "steps = 20000\n")));
    let mut events = Vec::new();
    while events.is_empty() {
        let advance = simulation.advance().unwrap();
        events.extend(advance.events);
        assert!(advance.stopped.is_none(), "nothing breaks");
    }
    let ids = &simulation.state.particles.id;
    for event in &events {
        assert!(event.id_a < event.id_b && event.damage == 1.0, "{event:?}");
        let [a, b] = [event.id_a, event.id_b].map(|id| ids.iter().position(|other| *other == id).unwrap());
        let position = &simulation.state.particles.position;
        // The step moves its ends on by up to 1 m/s for 0.05 s.
        assert!((event.position - (position[a] + position[b]) * 0.5).norm() < 0.1, "{event:?}");
        // Four roundings; the bar starts with a field of velocities that strains along the axis alone.
        assert!((event.mode_shares.iter().sum::<f64>() - 1.0).abs() < 1e-15, "{event:?}");
        assert!(event.mode_shares[0] > 0.99, "{event:?}");
    }
}

/// A lattice that stretches evenly: nine chains of bonds, each with `k` times its share of the stretch, over the 6 m × 6 m of the
/// bounding box. The strain is the given rate times time, whatever length it refers to, and the layers move accordingly.
#[test]
fn stress_of_a_stretched_lattice() {
    for (gauge, length) in [("", 18.0), ("gauge_length = 9", 9.0)] {
        let text = bar(&format!("{PULL}\n{gauge}\n[output]\nsample_interval = 1"));
        let record = finish(&mut started(made(&text))).expect("records");
        // Some roundings of positions of 20 m, over displacements of millimeters.
        assert!(record.time > 0.0 && (record.strain / (0.1 * record.time) - 1.0).abs() < 1e-10, "{gauge}: {record:?}");
        if gauge.is_empty() {
            let expected = 9.0 * 1e6 * (record.strain * length / 9.0) / 36.0;
            assert!((record.stress / expected - 1.0).abs() < 1e-9, "{} {expected}", record.stress);
        }
    }
}
