//! Stress operators under every kind of external action: in equilibrium, the stress of the contacts, of the particles, and of the boundary are
//! one, wherever the origin lies.

mod shared;

use std::fmt::Write as _;
use std::path::Path;

use concordem_contact::math::{Mat3, Vec3};
use concordem_scenario::schedule::StopReason;
use shared::{number, place, set, simulation};

const VOLUME: f64 = 200e-9;

/// A block of 3 × 3 × 3 bonded spheres of 1 mm around a place, with an action, which has the coordinates of this place.
fn block(at: Vec3, action: &str) -> String {
    let mut spheres = String::new();
    for k in 0..27 {
        let x = Vec3::from([k % 3, k / 3 % 3, k / 9].map(|n| 2e-3 * (f64::from(n) - 1.0))) + at;
        let _ = write!(spheres, "[{:?}, {:?}, {:?}, 1e-3],", x.x, x.y, x.z);
    }
    let tables =
        if action.contains("[[clump]]") { "" } else { "[bonds]\nlaw = \"linear_bond\"\ninteraction_ratio = 1.5\n" };
    let steps = if action.contains("[[slave]]") { RECORDED } else { 60_000 };
    let samples = ["region-stress", "particle-stress", "boundary-stress"].map(|operator| {
        format!("[[sample]]\noperator = \"{operator}\"\nregion = {{ kind = \"all\", volume = {VOLUME} }}\n")
    });
    format!(
        "version = 1\n[packing]\nkind = \"spheres\"\nspheres = [{spheres}]\n[[material]]\nname = \"m\"\ndensity = 2500\n\
         linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 3e5, damping_ratio = 0.2 }}\n\
         frictional = {{ normal_stiffness = 1e6, shear_stiffness = 3e5, friction_coefficient = 0.4, damping_ratio = 0.2 }}\n\
         {tables}[contacts]\nlaw = \"frictional\"\n[stop]\nunbalanced = 1e-6\nsteps = {steps}\n{}{}{}{action}\n{}",
        set("bottom", &(0..9).collect::<Vec<_>>()),
        set("top", &(18..27).collect::<Vec<_>>()),
        set("all", &(0..27).collect::<Vec<_>>()),
        samples.concat()
    )
}

/// A wall around the block.
fn wall(shape: &str, more: &str) -> String {
    format!("[[wall]]\nmaterial = \"m\"\nshape = {{ {shape} }}\n{more}\n")
}

const DAMPED: &str = "damping = { kind = \"local\", coefficient = 0.5 }";

/// A surface of one triangle for a file.
fn stl(corners: &[Vec3; 3]) -> String {
    let vertex = |x: &Vec3| format!("vertex {:e} {:e} {:e}\n", x.x, x.y, x.z);
    let loops: String = corners.iter().map(vertex).collect();
    format!("solid s\nfacet normal 0 0 1\nouter loop\n{loops}endloop\nendfacet\nendsolid s\n")
}

/// Steps of recorded motions, and of the runs that follow them.
const RECORDED: usize = 20_000;

/// A recorded motion of `count` particles (`width` 6) or vertices (3): upwards with 1 mm/s for 200 steps, then at rest.
fn recorded(count: usize, width: usize) -> Vec<u8> {
    let shape = format!("({}, {count}, {width})", RECORDED + 1);
    let head = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    let length = (10 + head.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{head:<width$}\n", width = length - 1).bytes());
    for step in 0..=RECORDED {
        for k in 0..count * width {
            let speed: f64 = if step <= 200 && k % width == 2 { 1e-3 } else { 0.0 };
            bytes.extend(speed.to_le_bytes());
        }
    }
    bytes
}

/// What moves the bottom from outside, as a coupling with finite elements does: the name of its action.
const COUPLED: &str = "motion from outside";

/// Every kind of action on the block at a place, by name. Files go to `folder`.
fn actions(at: Vec3, folder: &Path) -> Vec<(&'static str, String)> {
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.join(format!("{:.0}-{name}", 1e3 * at.z));
        std::fs::write(&path, bytes).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let point = |x: f64, y: f64, z: f64| format!("[{:?}, {:?}, {:?}]", at.x + x, at.y + y, at.z + z);
    let still = format!("[integration]\n{DAMPED}\n");
    let weight = format!("[integration]\ngravity = [0, 0, -98.1]\n{DAMPED}\n");
    let held = "[[prescribe]]\nset = \"bottom\"\nvelocity = [0, 0, 0]\nangular_velocity = [0, 0, 0]\n";
    let floor = wall(&format!("kind = \"plane\", point = {}, normal = [0, 0, 1]", point(0.0, 0.0, -3e-3)), "");
    let servo = "servo = { force = 5, maximum_speed = 0.1 }";
    let along = "servo = { force = 5, maximum_speed = 0.1, direction = [0, 0, -1] }";
    let piston = |shape: &str, servo: &str| still.clone() + &floor + &wall(shape, servo);
    let disc = format!("kind = \"plate\", center = {}, normal = [0, 0, 1], radius = 5e-3", point(0.0, 0.0, 3.001e-3));
    let plate =
        format!("kind = \"plate\", center = {}, edges = [[8e-3, 0, 0], [0, 8e-3, 0]]", point(0.0, 0.0, 3.001e-3));
    let rod = format!(
        "kind = \"cylinder\", center = {}, axis = \"y\", radius = 4e-3, side = \"outside\"",
        point(0.0, 0.0, 7.001e-3)
    );
    let corners = [[-8e-3, -8e-3], [8e-3, -8e-3], [0.0, 12e-3]].map(|[x, y]| point(x, y, -3e-3));
    let mesh = format!("kind = \"mesh\", vertices = [{}], triangles = [[0, 1, 2]]", corners.join(", "));
    let sides = |d: f64| format!("kind = \"box\", minimum = {}, maximum = {}", point(-d, -d, -d), point(d, d, d));
    let pull = "[[force]]\nset = \"top\"\nforce = [0.3, 0, 2]\n";
    let corners_at = |z: f64| [[-8e-3, -8e-3], [8e-3, -8e-3], [0.0, 12e-3]].map(|[x, y]| at + Vec3::new(x, y, z));
    let facets =
        |name: &str, z: f64| format!("kind = \"facets\", path = \"{}\"", file(name, stl(&corners_at(z)).as_bytes()));
    let slave = |of: &str, count, width| {
        let path = file(&format!("{}.npy", of.len()), &recorded(count, width));
        format!("[[slave]]\n{of}\npath = \"{path}\"\n")
    };
    vec![
        ("weight on a held set", weight.clone() + held),
        ("weight on a floor", weight.clone() + &floor),
        ("weight on a mesh", weight.clone() + &wall(&mesh, "")),
        ("force on a held set", still.clone() + held + pull),
        (
            "moment on a held set",
            still.clone() + held + "[[force]]\nset = \"top\"\nforce = [0, 0, 0]\nmoment = [0, 0.001, 0]\n",
        ),
        (
            "servo of a plane",
            piston(&format!("kind = \"plane\", point = {}, normal = [0, 0, -1]", point(0.0, 0.0, 3.001e-3)), servo),
        ),
        ("servo of a disc", piston(&disc, along)),
        ("servo of a rectangle", piston(&plate, along)),
        ("servo of a roller", piston(&rod, along)),
        ("servos of a box", still.clone() + &wall(&sides(3.001e-3), "servo = { pressure = 1e5, maximum_speed = 0.1 }")),
        ("narrow box", still.clone() + &wall(&sides(2.999e-3), "")),
        (
            "tube",
            still.clone()
                + held
                + &wall(
                    &format!("kind = \"cylinder\", center = {}, axis = \"z\", radius = 3.825e-3", point(0.0, 0.0, 0.0)),
                    "",
                ),
        ),
        ("membrane", still.clone() + "[[membrane]]\npressure = 1e5\n"),
        ("weight on facets", weight.clone() + &wall(&facets("floor.stl", -3e-3), "")),
        ("servo of facets", piston(&facets("piston.stl", 3.001e-3), along)),
        ("weight on a recorded set", weight.clone() + held + &slave("set = \"bottom\"", 9, 6)),
        (
            "weight on a recorded mesh",
            weight.clone() + &wall(&mesh, "name = \"mesh\"") + &slave("wall = \"mesh\"", 3, 3),
        ),
        (COUPLED, weight.clone() + held),
        ("clump on a floor", weight + &floor + "[[clump]]\nset = \"all\"\n"),
    ]
}

/// Tensors of the three operators at the end.
fn stresses(text: &str, name: &str) -> [Mat3; 3] {
    let mut run = simulation(text);
    let last = loop {
        if name == COUPLED && run.state.clock.step <= 201 {
            let speed = if run.state.clock.step < 201 { 1e-3 } else { 0.0 };
            let moves = |p: usize| if p < 9 { Vec3::z() * speed } else { Vec3::zeros() };
            run.state.motion = Some((0..27).map(|p| (moves(p), Vec3::zeros())).collect());
        }
        let advance = run.advance().unwrap();
        if advance.stopped.is_some() {
            assert_eq!(advance.stopped, Some(StopReason::Equilibrium), "{name}");
            break advance;
        }
    };
    ["region-stress", "particle-stress", "boundary-stress"].map(|operator| {
        let operators = &run.schedule.operators;
        let k = number(operators, operator);
        let row = last.operators.iter().rfind(|row| row.operator == k).unwrap();
        Mat3::from_row_slice(&row.values[place(&operators[k], "stress")])
    })
}

/// Tolerance 1e-4: the unbalanced force is 1e-6 of those in contacts at most, but the net force of the body is a sum over 27 particles, and the
/// block is as wide as three of them; the servo is within 1 % of its force, but the forces are those of one instant.
#[test]
fn stresses_agree_under_every_action_wherever_the_origin_lies() {
    let folder = tempfile::tempdir().unwrap();
    let [here, there] = [Vec3::zeros(), Vec3::new(0.05, -0.1, 0.2)].map(|at| actions(at, folder.path()));
    for ((name, here), (_, there)) in here.into_iter().zip(there) {
        let shifted = Vec3::new(0.05, -0.1, 0.2);
        let all = [stresses(&block(Vec3::zeros(), &here), name), stresses(&block(shifted, &there), name)];
        let size = all[0][0].abs().max();
        assert!(size > 1.0, "{name}: {size}");
        for found in all.iter().flatten() {
            let error = (found - all[0][0]).abs().max() / size;
            assert!(error < 1e-4, "{name}: {error:e}\n{found}{}", all[0][0]);
        }
    }
}

/// A column between plates, as in a test of a granular material: the region is the box between the plates, its mean stress is the force times the
/// height over the volume, and a grid of the box has the same mean.
#[test]
fn regions_reach_to_the_walls() {
    let text = "version = 1
        [packing]
        kind = \"spheres\"
        spheres = [[0, 0, 1e-3, 1e-3], [0, 0, 3e-3, 1e-3], [0, 0, 5e-3, 1e-3]]
        [[material]]
        name = \"m\"
        density = 2500
        frictional = { normal_stiffness = 1e5, shear_stiffness = 1e5, friction_coefficient = 0.3 }
        [contacts]
        law = \"frictional\"
        [[wall]]
        material = \"m\"
        shape = { kind = \"plane\", point = [0, 0, 0], normal = [0, 0, 1] }
        [[wall]]
        material = \"m\"
        shape = { kind = \"plane\", point = [0, 0, 6e-3], normal = [0, 0, -1] }
        servo = { force = 0.5, maximum_speed = 0.01 }
        [integration]
        damping = { kind = \"local\", coefficient = 0.5 }
        [[sample]]
        operator = \"region-stress\"
        region = { kind = \"box\", minimum = [-2e-3, -2e-3, 0], maximum = [2e-3, 2e-3, 6e-3] }
        [[sample]]
        name = \"layers\"
        operator = \"region-stress\"
        region = { kind = \"box\", minimum = [-2e-3, -2e-3, 0], maximum = [2e-3, 2e-3, 6e-3] }
        grid = [1, 1, 5]
        [[sample]]
        operator = \"coarse-grain\"
        region = { kind = \"sphere\", center = [0, 0, 3e-4], radius = 2e-4 }
        [stop]
        unbalanced = 1e-9
        time = 0.5
        ";
    let mut run = simulation(text);
    let last = loop {
        let advance = run.advance().unwrap();
        if advance.stopped.is_some() {
            break advance;
        }
    };
    let of = |name: &str| {
        let k = number(&run.schedule.operators, name);
        let row = last.operators.iter().rfind(|row| row.operator == k).unwrap();
        row.values[place(&run.schedule.operators[k], "stress")].to_vec()
    };
    // The force at the end is that of the servo, within 1 %.
    let force = run.state.walls[1].force.z;
    assert!((force / 0.5 - 1.0).abs() < 0.01, "{force}");
    // The column is as high as the piston now stands. At rest to 1e-9, and forces are known one step before the piston.
    let height = 6e-3 + run.state.walls[1].displacement.z;
    let wanted = -force * height / 96e-9;
    let mean = of("region-stress")[8];
    assert!((mean / wanted - 1.0).abs() < 1e-6, "{mean} {wanted}");
    let layers: Vec<f64> = of("layers").chunks(9).map(|stress| stress[8]).collect();
    assert!((layers.iter().sum::<f64>() / 5.0 / mean - 1.0).abs() < 1e-12, "{layers:?}");
    // Between the center of the first sphere and the floor, where no contact of two spheres is.
    assert!(of("coarse-grain")[8] < -1e6, "{:?}", of("coarse-grain"));
}
