//! Walls repeat with the periodic cell.

use std::path::Path;

use concordem::schedule::Simulation;
use concordem_tests::on_threads;
use concordem_tests::runs::{built, finish, refusal, sound, started};

/// Two triangles that cover the cell at z = 0.2.
const FLOOR: &str = "solid f
facet normal 0 0 1
 outer loop
  vertex 0 0 0.2
  vertex 1 0 0.2
  vertex 1 1 0.2
 endloop
endfacet
facet normal 0 0 1
 outer loop
  vertex 0 0 0.2
  vertex 1 1 0.2
  vertex 0 1 0.2
 endloop
endfacet
endsolid f
";

/// Scenario of a sphere at `position` with this velocity in a cell of 1 m, and a wall.
fn scene(position: [f64; 3], velocity: [f64; 3], shape: &str, more: &str) -> String {
    let [x, y, z] = position;
    format!(
        "version = 1
        [packing]
        kind = \"spheres\"
        spheres = [[{x:?}, {y:?}, {z:?}, 0.02]]
        cell = [1, 1, 1]
        [[material]]
        name = \"m\"
        density = 2500
        frictional = {{ normal_stiffness = 1e6, shear_stiffness = 5e5 }}
        [contacts]
        law = \"frictional\"
        [[wall]]
        name = \"w\"
        material = \"m\"
        shape = {shape}
        [[set]]
        name = \"a\"
        selection = {{ kind = \"ids\", ids = [0] }}
        [[initial]]
        set = \"a\"
        velocity = {velocity:?}
        {more}"
    )
}

fn run(text: &str) -> Simulation {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("floor.stl"), FLOOR).unwrap();
    on_threads(1, || {
        let mut simulation = started(sound(built(text, folder.path())));
        finish(&mut simulation);
        simulation
    })
}

/// A sphere that bounces on a floor of triangles and drifts over the border of the cell, by forty cells, moves up and down
/// like one that does not drift (it used to fall through at the border). 20,000 steps round coordinates of up to 40 m to
/// 7e-15 m; where the sphere passes edges of triangles, its normal is that of the floor to 1e-9.
#[test]
fn a_drifting_sphere_stays_on_its_floor() {
    let floor = "{ kind = \"facets\", path = \"floor.stl\" }";
    let more = "[integration]\ntime_step = 2e-5\ngravity = [0, 0, -9.81]\n[stop]\nsteps = 20000";
    let at = |v: f64| run(&scene([0.9, 0.45, 0.3], [v, 0.3 * v, 0.0], floor, more)).state;
    let (still, drifting) = (at(0.0), at(100.0));
    let (z, expected) = (drifting.particles.position[0].z, still.particles.position[0].z);
    println!("height {z:.12} m drifting, {expected:.12} m at rest; cells {:?}", drifting.particles.image);
    assert!(expected > 0.2 && drifting.unwrapped_positions()[0].x > 40.0);
    assert!((z - expected).abs() < 1e-8, "{z} {expected}");
    let (v, w) = (drifting.particles.velocity[0], drifting.walls[0].torque);
    assert!((v.x - 100.0).abs() < 1e-6 && w.iter().all(|m| m.is_finite()), "{v}");
}

/// A plane across the cell acts on particles in front of it, and through the border on particles behind it.
#[test]
fn a_plane_in_a_cell_has_two_sides() {
    let plane = "{ kind = \"plane\", point = [0.5, 0, 0], normal = [-1, 0, 0] }";
    let more = "[integration]\ntime_step = 1e-5\n[stop]\ntime = 0.1";
    for v in [10.0, -10.0] {
        let state = run(&scene([0.2, 0.5, 0.5], [v, 0.0, 0.0], plane, more)).state;
        let found = state.particles.velocity[0].x;
        println!("{v} m/s before, {found:.4} m/s after");
        // Tolerance: 0.1 % for an elastic impact in some 50 steps.
        assert!((found / v + 1.0).abs() < 1e-3, "{v}: {found}");
    }
}

/// A rod along an edge of the cell repels a sphere that reaches it through the border, and a sphere stays inside a vessel
/// however far it moves along the axis.
#[test]
fn cylinders_in_a_cell_repeat() {
    let more = "[integration]\ntime_step = 1e-5\n[stop]\ntime = 0.1";
    let rod = "{ kind = \"cylinder\", center = [0.5, 0.5, 0], axis = \"z\", radius = 0.1, side = \"outside\" }";
    let state = run(&scene([0.2, 0.5, 0.5], [-10.0, 0.0, 0.0], rod, more)).state;
    assert!((state.particles.velocity[0].x - 10.0).abs() < 0.01, "{}", state.particles.velocity[0]);
    let vessel = "{ kind = \"cylinder\", center = [0.5, 0.5, 0], axis = \"z\", radius = 0.4 }";
    let state = run(&scene([0.5, 0.5, 0.5], [20.0, 0.0, 400.0], vessel, more)).state;
    let x = state.particles.position[0];
    assert!((x.x - 0.5).hypot(x.y - 0.5) < 0.381 && state.unwrapped_positions()[0].z > 40.0, "{x}");
}

/// Walls whose periodic images would intersect are refused.
#[test]
fn walls_that_do_not_repeat_are_refused() {
    for (shape, word) in [
        ("{ kind = \"plane\", point = [0.5, 0, 0], normal = [1, 1, 0] }", "parallel to two edges"),
        ("{ kind = \"cylinder\", center = [0.5, 0.5, 0], radius = 0.6 }", "wider than the periodic cell"),
        (
            "{ kind = \"plate\", center = [0.5, 0.5, 0], edges = [[1.01, 0, 0], [0, 1, 0]] }",
            "longer than the periodic cell",
        ),
    ] {
        let text = scene([0.2, 0.5, 0.5], [1.0, 0.0, 0.0], shape, "[stop]\nsteps = 1");
        let (key, message) = refusal(built(&text, Path::new(".")));
        assert!(key == "wall[0].shape" && message.contains(word), "{key}: {message}");
    }
}

/// A particle whose center lies on a plate or on the axis of a rod, where the closest point has no direction, is refused, too.
#[test]
fn centers_on_finite_walls_are_refused() {
    for shape in [
        "{ kind = \"plate\", center = [0.5, 0.5, 0.5], edges = [[0.8, 0, 0], [0, 0.8, 0]] }",
        "{ kind = \"plate\", center = [0.5, 0.5, 0.5], normal = [0, 0, 1], radius = 0.4 }",
        "{ kind = \"cylinder\", center = [0.5, 0.5, 0.5], axis = \"x\", radius = 0.1, length = 0.8, side = \"outside\" }",
    ] {
        let text = scene([0.4, 0.5, 0.5], [0.0; 3], shape, "[stop]\nsteps = 1");
        let (key, message) = refusal(built(&text, Path::new(".")));
        assert!(key == "wall[0].shape" && message.contains("deep in the wall \"w\""), "{key}: {message}");
    }
}

/// The start check sees images, too: a particle may start in any cell, and overlaps with an image of a wall are refused.
#[test]
fn overlaps_with_images_of_walls_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("floor.stl"), FLOOR).expect("a file");
    for shape in
        ["{ kind = \"plane\", point = [0, 0, 0.2], normal = [0, 0, 1] }", "{ kind = \"facets\", path = \"floor.stl\" }"]
    {
        for cell in [-2.0, -1.0, 0.0, 3.0] {
            let at = |z: f64| built(&scene([0.3, 0.6, z + cell], [0.0; 3], shape, "[stop]\nsteps = 1"), folder.path());
            // Between two sheets, above and below the one in the cell.
            for z in [0.7, 0.1] {
                assert!(at(z).is_ok(), "{shape} {z} {cell}");
            }
            // From both sides.
            for z in [0.21, 0.19] {
                let Err(error) = at(z) else { panic!("accepted: {shape} {z} {cell}") };
                assert!(error.to_string().contains("deep in the wall \"w\""), "{error}");
            }
        }
    }
}
