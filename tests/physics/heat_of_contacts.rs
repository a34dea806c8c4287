//! Heat between grains that flow: in two dimensions, with clumps, deformable particles, loads, walls, and in a periodic cell.

use std::fmt::Write as _;

use concordem::state::columns::ColumnStore;
use concordem::state::contacts::ContactFlags;
use concordem_tests::on_threads;
use concordem_tests::runs::{made, started};

/// Law of all grains; they conduct as well as they touch.
const GRAINS: &str = "
[[material]]
name = \"g\"
density = 2500
frictional = { normal_stiffness = 1e4, shear_stiffness = 3e3, friction_coefficient = 0.3, damping_ratio = 0.1 }
thermal = { specific_heat = 1, conductivity = 20 }
[contacts]
law = \"frictional\"
[[set]]
name = \"hot\"
selection = { kind = \"ids\", ids = [0, 1, 4] }
";

/// How they exchange heat, from a hot set.
fn heat(contact: &str) -> String {
    format!(
        "[heat]\nmodel = \"contacts\"\ntemperature = 300\ncontact = {{ {contact} }}\n[[heat.initial]]\nset = \"hot\"\ntemperature = 400\n"
    )
}

/// A floor and four sides around a square of 7 mm; in two dimensions without those along z.
fn vessel(dimension: usize) -> String {
    let floor = if dimension == 2 { "[0, 1, 0]" } else { "[0, 0, 1]" };
    let mut planes =
        vec![("floor", "[0, 0, 0]", floor), ("w", "[0, 0, 0]", "[1, 0, 0]"), ("e", "[7e-3, 0, 0]", "[-1, 0, 0]")];
    if dimension == 3 {
        planes.extend([("s", "[0, 0, 0]", "[0, 1, 0]"), ("n", "[0, 7e-3, 0]", "[0, -1, 0]")]);
    }
    let mut text = String::new();
    for (name, point, normal) in planes {
        let _ = writeln!(
            text,
            "[[wall]]\nname = \"{name}\"\nmaterial = \"g\"\nshape = {{ kind = \"plane\", point = {point}, normal = {normal} }}"
        );
    }
    text
}

/// Grains in a loose lattice above the floor, out of line, so that they scatter.
fn grains(dimension: usize) -> String {
    let mut list = Vec::new();
    for k in 0..(if dimension == 2 { 9 } else { 27 }) {
        let (i, j, l) = (k % 3, k / 3 % 3, k / 9);
        let at = |n: usize, shift: f64| 1.2e-3 + 2.2e-3 * n as f64 + shift * 1e-4 * ((k * 7 % 5) as f64 - 2.0);
        let radius = 0.75e-3 + 2e-5 * (k % 6) as f64;
        let (y, z) = if dimension == 2 { (at(j, 0.0), 0.0) } else { (at(j, -0.5), at(l, 0.0)) };
        list.push(format!("[{}, {y}, {z}, {radius}]", at(i, 1.0)));
    }
    format!("[packing]\nkind = \"spheres\"\nspheres = [{}]\n", list.join(", "))
}

/// The run of a scenario: heat flows between exactly those particles that press on each other; heat is conserved to rounding; what passes
/// through walls and held temperatures is in the balance. The same bits for one and three threads, and after restarts.
fn flows_where_forces_act(text: &str, steps: u64) {
    let bits = |threads: usize, restart: Option<u64>| {
        on_threads(threads, || {
            let mut simulation = started(made(text));
            let mut carried = 0;
            let mut seen = Vec::new();
            for step in 0..steps {
                if restart.is_some_and(|every| step % every == 3) {
                    let mut columns = ColumnStore::of(&simulation.state).unwrap();
                    let mut other = made(text);
                    other.state.read(&mut columns).unwrap();
                    simulation = started(other);
                }
                let flows = simulation.solver.heat_flows(&mut simulation.state).unwrap();
                let links = simulation.solver.model().heat.as_ref().unwrap().network.links.len();
                let walls = flows.pair.iter().filter(|pair| pair[0] == pair[1]).count();
                let mut touching: Vec<[u32; 2]> = flows.pair[links..flows.pair.len() - walls].to_vec();
                simulation.advance().unwrap();
                let block = simulation.state.contacts.as_ref().unwrap();
                let views = (0..block.len()).map(|k| block.view(k)).filter(|view| view.flags.has(ContactFlags::ACTIVE));
                let mut pressing: Vec<[u32; 2]> = views.map(|view| [view.pair.a, view.pair.b]).collect();
                touching.sort_unstable();
                pressing.sort_unstable();
                assert_eq!(touching, pressing, "step {step}");
                carried += touching.len();
                seen.push(flows.flow.iter().sum::<f64>().to_bits());
            }
            let model = simulation.solver.model().heat.as_ref().unwrap();
            let heat = simulation.state.heat.clone().unwrap();
            let content = model.capacity.iter().sum::<f64>() * 400.0;
            assert!(model.residual(&heat).abs() < 1e-14 * content, "{:e}", model.residual(&heat) / content);
            (heat, simulation.state.particles.position, seen, carried)
        })
    };
    let whole = bits(1, None);
    let mixed = whole.0.temperature.iter().filter(|t| (300.1..399.9).contains(*t)).count();
    assert!(whole.3 > 100 && mixed > 4, "{} {mixed}", whole.3);
    assert!(whole == bits(3, None));
    assert!(whole == bits(1, Some(97)));
}

/// Grains that fall into a vessel, and discs; the floor is hot.
#[test]
fn in_a_vessel_under_gravity() {
    for (dimension, gravity) in [(2, "[0, -300, 0]"), (3, "[0, 0, -300]")] {
        let text = format!(
            "version = 1\ndimension = {dimension}\n{}{GRAINS}{}{}
            [[heat.boundary]]
            wall = \"floor\"
            temperature = 350
            [integration]
            gravity = {gravity}
            [stop]
            steps = 100000",
            grains(dimension),
            vessel(dimension),
            heat("resistance = 1e-6"),
        );
        flows_where_forces_act(&text, 2000);
    }
}

/// A periodic cell that shears and shrinks.
#[test]
fn in_a_sheared_cell() {
    let text = format!(
        "version = 1\n{}cell = [6.6e-3, 6.6e-3, 6.6e-3]\n{GRAINS}{}
        [loading]
        kind = \"cell-strain\"
        velocity_gradient = [[-100, 500, 0], [0, -100, 0], [0, 0, -100]]
        [integration]
        time_step = 1e-6
        [stop]
        steps = 100000",
        grains(3),
        heat("constriction = true"),
    );
    flows_where_forces_act(&text, 3000);
}

/// A clump falls among the grains of a vessel. Its members have no contact with each other, but exchange heat like bonded particles.
#[test]
fn of_a_clump() {
    let text = format!(
        "version = 1\n{}{GRAINS}{}{}
        [[clump]]
        spheres = [[3e-3, 3e-3, 8e-3, 0.6e-3], [3.6e-3, 3e-3, 8e-3, 0.6e-3]]
        material = \"g\"
        velocity = [1, 0.5, -3]
        [integration]
        gravity = [0, 0, -300]
        [stop]
        steps = 100000",
        grains(3),
        vessel(3),
        heat("constriction = true"),
    );
    assert_eq!(made(&text).model.heat.expect("heat").network.links.len(), 1);
    flows_where_forces_act(&text, 2000);
}

/// Deformable grains that a force presses together: heat flows as soon as their bulging surfaces meet.
#[test]
fn of_deformable_grains_under_a_load() {
    let text = format!(
        "version = 1\n{}{}{}{}
        [[set]]
        name = \"all\"
        selection = {{ kind = \"all\" }}
        [[force]]
        set = \"all\"
        force = [0, 0, -2e-3]
        [stop]
        steps = 100000",
        grains(3),
        GRAINS.replace("thermal =", "deformable = { young = 1e8, poisson = 0.3 }\nthermal ="),
        vessel(3),
        heat("resistance = 0"),
    );
    flows_where_forces_act(&text, 2000);
}

/// The halves of a cube of bonded grains collide: contacts of grains that were not neighbors, and cracks that open and close, conduct;
/// grains that keep their bond have no contact.
#[test]
fn of_bodies_that_break() {
    let text = format!(
        "version = 1
        [packing]
        kind = \"lattice\"
        lattice = \"sc\"
        radius = \"1 mm\"
        repeats = [4, 4, 4]
        {}
        [bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.01
        {}
        [[set]]
        name = \"half\"
        selection = {{ kind = \"box\", minimum = [-1, -1, -1], maximum = [4.5e-3, 1, 1] }}
        [[initial]]
        set = \"half\"
        velocity = [3, 1, 0.5]
        [integration]
        time_step = 2e-6
        [stop]
        steps = 100000",
        GRAINS.replace("thermal =", "linear_bond = { normal_stiffness = 1e4, shear_stiffness = 3e3, normal_strength = 0.3, shear_strength = 0.3 }\nthermal ="),
        heat("resistance = 1e-6").replace("\"contacts\"", "\"ordered\"\npairs = \"bonds\""),
    );
    flows_where_forces_act(&text, 2000);
}
