//! Operators combined with other features: given loads, rigid bodies, periodic images, damage, and the final state.

mod shared;

use std::fmt::Write as _;
use std::path::Path;

use concordem_contact::math::{Mat3, Vec3};
use concordem_scenario::assembly::assemble;
use concordem_scenario::sampling::Record;
use concordem_scenario::schedule::{Advance, Simulation};
use concordem_scenario::schema::{Scenario, template};

use shared::{SPRING, bonded, number, place, set, simulation, spheres};

/// Values of a quantity in the last row of the operator `name`.
fn reals(simulation: &Simulation, advance: &Advance, name: &str, quantity: &str) -> Vec<f64> {
    let operators = &simulation.schedule.operators;
    let k = number(operators, name);
    let row = advance.operators.iter().rev().find(|row| row.operator == k).unwrap();
    row.values[place(&operators[k], quantity)].to_vec()
}

fn tensor(simulation: &Simulation, advance: &Advance, name: &str, quantity: &str) -> Mat3 {
    Mat3::from_row_slice(&reals(simulation, advance, name, quantity))
}

fn vector(simulation: &Simulation, advance: &Advance, name: &str, quantity: &str) -> Vec3 {
    Vec3::from_column_slice(&reals(simulation, advance, name, quantity))
}

/// Advances until the run ends; returns the last step, which has the final rows.
fn to_the_end(simulation: &mut Simulation) -> Advance {
    loop {
        let advance = simulation.advance().unwrap();
        if advance.stopped.is_some() {
            return advance;
        }
    }
}

/// Two spheres 20 mm apart along x, the first at `x`, and the text `more`; the volume of the body is 1e-5 m³.
fn pair(x: f64, law: &str, table: &str, more: &str) -> String {
    let start = bonded(&spheres(&[[x, 0.0, 0.0, 0.01], [x + 0.02, 0.0, 0.0, 0.01]]), law, table);
    let sets = set("left", &[0]) + &set("right", &[1]);
    format!(
        "{start}{sets}
        {more}
        [[sample]]
        operator = \"boundary-stress\"
        region = {{ kind = \"all\", volume = 1e-5 }}
        [[sample]]
        operator = \"couple-stress\"
        region = {{ kind = \"all\", volume = 1e-5 }}
        [stop]
        steps = 1"
    )
}

/// Boundary stress of a pair pulled by 1 kN at both ends: 20 mm · 1 kN / 1e-5 m³ = 2 MPa from the start, wherever the body
/// is. Tolerance: rounding of positions of 0.1 m over 0.02 m.
#[test]
fn boundary_stress_counts_given_forces() {
    let forces = "[[force]]\nset = \"right\"\nforce = [1000, 0, 0]\n[[force]]\nset = \"left\"\nforce = [-1000, 0, 0]";
    for x in [0.0, 0.1] {
        let mut run = simulation(&pair(x, "linear_bond", SPRING, forces));
        let first = run.advance().unwrap();
        let row = first.operators.iter().find(|row| row.step == 0).unwrap();
        assert!((row.values[0] / 2e6 - 1.0).abs() < 1e-14, "{}", row.values[0]);
        assert_eq!(reals(&run, &first, "boundary-stress", "loads"), [2.0]);
    }
    // One end is fixed: its support carries the load of the other end only in equilibrium, but carries a load on the fixed
    // particle itself at once.
    let held = "[[prescribe]]\nset = \"left\"\nvelocity = [0, 0, 0]\n[[force]]\nset = \"left\"\nforce = [0, 500, 0]";
    let mut run = simulation(&pair(0.1, "linear_bond", SPRING, held));
    let first = run.advance().unwrap();
    let row = first.operators.iter().find(|row| row.step == 0).unwrap();
    assert!(row.values[..9].iter().all(|component| *component == 0.0), "{:?}", row.values);
}

/// Moments of ±1e-3 N·m at the ends of a beam of 20 mm give the couple stress 20 mm · 1e-3 N·m / 1e-5 m³ = 2 N/m: from the
/// loads immediately, from the contacts once the beam is in equilibrium.
#[test]
fn couple_stress_counts_given_moments() {
    let moments = "[[force]]\nset = \"right\"\nmoment = [0, 0, 1e-3]\n[[force]]\nset = \"left\"\nmoment = [0, 0, -1e-3]
        [integration]\ndamping = { kind = \"local\", coefficient = 0.7 }";
    let text = pair(-0.01, "cohesive_beam", "{ young = 1e9, radius_ratio = 0.5 }", moments);
    let mut run = simulation(&text.replace("steps = 1", "steps = 5000"));
    let last = to_the_end(&mut run);
    let from_loads = tensor(&run, &last, "boundary-stress", "couple_stress");
    let from_contacts = tensor(&run, &last, "couple-stress", "couple_stress");
    // Damping leaves 1e-9 of the moment; the ends of the beam have moved by 1e-4 of its length.
    assert!((from_loads[(0, 2)] / 2.0 - 1.0).abs() < 1e-3, "{from_loads}");
    assert!((from_contacts - from_loads).norm() < 1e-6 * from_loads.norm(), "{from_contacts} {from_loads}");
}

/// Two dumbbells between plates: 70 mm high, 4 cm² in section.
const DUMBBELLS: &str = "
    version = 1
    [packing]
    kind = \"spheres\"
    spheres = []
    [[material]]
    name = \"m\"
    density = 2500
    frictional = { normal_stiffness = 1e6, shear_stiffness = 0, damping_ratio = 0.3 }
    [contacts]
    law = \"frictional\"
    [[clump]]
    spheres = [[0, 0, 0.01, 0.01], [0, 0, 0.025, 0.01]]
    [[clump]]
    spheres = [[0, 0, 0.045, 0.01], [0, 0, 0.06, 0.01]]
    [[wall]]
    name = \"low\"
    material = \"m\"
    shape = { kind = \"plane\", point = [0, 0, 0], normal = [0, 0, 1] }
    [[wall]]
    name = \"high\"
    material = \"m\"
    shape = { kind = \"plane\", point = [0, 0, 0.07], normal = [0, 0, -1] }
    velocity = [0, 0, -1e-3]
    [integration]
    time_step = 1e-5
    damping = { kind = \"local\", coefficient = 0.7 }
    [stop]
    steps = 20000
    [output]
    sample_interval = 20000
    [[sample]]
    operator = \"wall-traction\"
    wall = \"low\"
    area = 4e-4
    [[sample]]
    operator = \"region-stress\"
    name = \"between centers\"
    region = { kind = \"box\", minimum = [-0.01, -0.01, 0.012], maximum = [0.01, 0.01, 0.058] }
    [[sample]]
    operator = \"region-stress\"
    name = \"inside a body\"
    region = { kind = \"box\", minimum = [-0.01, -0.01, 0.012], maximum = [0.01, 0.01, 0.022] }
    [[sample]]
    operator = \"particle-stress\"
    region = { kind = \"box\", minimum = [-0.01, -0.01, 0], maximum = [0.01, 0.01, 0.07] }
    [[sample]]
    operator = \"boundary-stress\"
    region = { kind = \"all\", volume = 2.8e-5 }
";

/// Rigid bodies carry stress, too: every section of a column of dumbbells carries the traction of the plates. Tolerance
/// 1e-3: the plates approach by 0.2 mm of 70 mm, so the volumes of regions in which the column shortens are wrong by at
/// most 3e-3; the sections of fixed boxes are exact. The unbalanced force at 1 mm/s is below 1e-4.
#[test]
fn rigid_bodies_transmit_stress() {
    let mut run = simulation(DUMBBELLS);
    let last = to_the_end(&mut run);
    let traction = vector(&run, &last, "wall-traction", "traction").z;
    assert!(traction.abs() > 1e4, "{traction}");
    // The traction is the force on the lower wall, downward in compression; its sign is that of the stress.
    for name in ["between centers", "inside a body"] {
        let stress = tensor(&run, &last, name, "stress")[(2, 2)];
        assert!((stress / traction - 1.0).abs() < 1e-3, "{name}: {stress} {traction}");
    }
    let particles = tensor(&run, &last, "particle-stress", "stress")[(2, 2)];
    let boundary = tensor(&run, &last, "boundary-stress", "stress")[(2, 2)];
    assert!((particles / boundary - 1.0).abs() < 1e-3, "{particles} {boundary}");
    // No contact lies in the second box: forces inside bodies do not count as contacts.
    assert_eq!(reals(&run, &last, "inside a body", "contacts"), [0.0]);
    assert_eq!(reals(&run, &last, "between centers", "contacts"), [1.0]);
}

/// Parameters of concrete.
const CONCRETE: &str = "{ young = 25e9, shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = 30, \
    cohesion = 3e6, friction_coefficient = 0.8 }";

/// A periodic cube of 4³ spheres with 192 bonds, and operators in two halves of it: as boxes and as slabs between planes.
fn halves() -> String {
    let packing = "kind = \"lattice\"
        lattice = \"sc\"
        radius = 1e-3
        repeats = [4, 4, 4]
        shape = { kind = \"periodic\" }";
    let mut text = bonded(packing, "cpm", CONCRETE).replace("interaction_ratio = 1.01", "interaction_ratio = 1.2")
        + "[loading]
        kind = \"cell-strain\"
        velocity_gradient = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        [stop]
        steps = 100
        ";
    for (operator, count) in [("damage-tensor", 3), ("fabric", 3), ("region-stress", 3), ("porosity", 3)] {
        for (k, (low, high)) in
            [(-1.5e-3, 2.5e-3), (2.5e-3, 6.5e-3), (10.5e-3, 14.5e-3)].into_iter().take(count).enumerate()
        {
            let _ = write!(text,
                "[[sample]]
                operator = \"{operator}\"
                name = \"{operator} box {k}\"
                region = {{ kind = \"box\", minimum = [{low}, -0.5e-3, -0.5e-3], maximum = [{high}, 7.5e-3, 7.5e-3] }}
                [[sample]]
                operator = \"{operator}\"
                name = \"{operator} slab {k}\"
                region = {{ kind = \"half-spaces\", volume = 256e-9, planes = [
                    {{ point = [{high}, 0, 0], normal = [1, 0, 0] }}, {{ point = [{low}, 0, 0], normal = [-2, 0, 0] }}] }}
                "
            );
        }
    }
    text
}

/// Each half of a periodic cell has half of the bonds, contacts, and particles, wherever it lies, as a box and as a slab.
#[test]
fn regions_see_periodic_images() {
    let mut run = simulation(&halves());
    let first = run.advance().unwrap();
    for k in 0..3 {
        for kind in ["box", "slab"] {
            let count =
                |operator: &str, quantity: &str| reals(&run, &first, &format!("{operator} {kind} {k}"), quantity)[0];
            assert_eq!(count("damage-tensor", "contacts"), 96.0, "{kind} {k}");
            assert_eq!(count("fabric", "particles"), 32.0, "{kind} {k}");
            // Clipped bonds add up: 4 slabs of 16 bonds along x, 4 layers of 32 across it. Tolerance: sums of 96 fractions.
            assert!((count("fabric", "contacts") - 96.0).abs() < 1e-9, "{kind} {k}");
            // Each sphere fills π/6 of its cube.
            let solid = count("porosity", "solid_fraction");
            assert!((solid / std::f64::consts::PI * 6.0 - 1.0).abs() < 1e-12, "{kind} {k}: {solid}");
        }
    }
}

/// A half-space that no other plane closes contains infinitely many images and is refused.
#[test]
fn unbounded_half_spaces_are_refused_in_a_periodic_cell() {
    let text = halves().replace(", { point = [-0.0015, 0, 0], normal = [-2, 0, 0] }", "");
    let scenario = Scenario::parse("test.toml", &text).unwrap_or_else(|error| panic!("{error}"));
    let Err(error) = assemble(&scenario, Path::new(""), &mut |_, _| ()) else { panic!("accepted") };
    let message = error.to_string();
    assert!(message.starts_with("sample[1].region: the half-spaces are unbounded along edge 0"), "{message}");
}

/// A slab whose faces are not parallel to the edges of the deforming cell any more would contain infinitely many images. It
/// is refused before the run, whether the loading prescribes shear or a servo may cause it; a box is not.
#[test]
fn slabs_in_a_sheared_cell_are_refused() {
    let stretch = "velocity_gradient = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]";
    let message = |text: &str| {
        let scenario = Scenario::parse("test.toml", text).unwrap_or_else(|error| panic!("{error}"));
        assemble(&scenario, Path::new(""), &mut |_, _| ()).err().map(|error| error.to_string())
    };
    assert!(halves().contains(stretch));
    assert_eq!(message(&halves()), None);
    // The second edge turns towards x, where the slabs have their faces.
    let sheared = halves().replace(stretch, "velocity_gradient = [[0, 1, 0], [0, 0, 0], [0, 0, 0]]");
    let servo = halves()
        .replace("kind = \"cell-strain\"", "kind = \"cell-stress\"")
        .replace(stretch, "stress = [[-1e5, 0, 0], [0, -1e5, 0], [0, 0, -1e5]]\nmaximum_strain_rate = 0.1");
    for text in [&sheared, &servo] {
        let message = message(text).expect("refused");
        assert!(message.starts_with("sample[1].region: the loading may turn the edges of the cell"), "{message}");
        assert!(message.contains("unbounded along edge") && message.contains("use a box"), "{message}");
    }
}

/// A slab whose faces stay parallel to the edges of a sheared cell keeps half of the particles. Before, slabs in sheared cells
/// gave not-a-number.
#[test]
fn slabs_along_the_shear_stay_slabs() {
    let sheared = halves().replace("[[1, 0, 0], [0, 1, 0], [0, 0, 1]]", "[[0, 1, 0], [0, 0, 0], [0, 0, 0]]");
    let boxes_only: Vec<&str> = sheared.split("[[sample]]").filter(|part| !part.contains("half-spaces")).collect();
    let text = boxes_only[0].to_owned()
        + "[[sample]]
           operator = \"fabric\"
           name = \"slab\"
           region = { kind = \"half-spaces\", volume = 256e-9, planes = [
               { point = [0, 2.5e-3, 0], normal = [0, 1, 0] }, { point = [0, -1.5e-3, 0], normal = [0, -1, 0] }] }
           ";
    let mut run = simulation(&text);
    let last = to_the_end(&mut run);
    assert_eq!(reals(&run, &last, "slab", "particles")[0], 32.0);
    assert!(run.state.cell.unwrap().matrix[(0, 1)] > 0.0);
}

/// Three bonded spheres of concrete in a row; the ends move apart.
fn chain() -> String {
    let places = [0.0, 2e-3, 4e-3].map(|x| [x, 0.0, 0.0, 1e-3]);
    let sets = [("left", &[0][..]), ("middle", &[1]), ("right", &[2]), ("first two", &[0, 1])];
    bonded(&spheres(&places), "cpm", CONCRETE) + &sets.map(|(name, ids)| set(name, ids)).concat() + MOTION
}

/// The ends move apart, and operators measure in every step.
const MOTION: &str = "
    [[prescribe]]
    set = \"left\"
    velocity = [0, 0, 0]
    [[prescribe]]
    set = \"middle\"
    velocity = [0.04, 0, 0]
    [[prescribe]]
    set = \"right\"
    velocity = [0.04, 0, 0]
    [integration]
    time_step = 5e-7
    [stop]
    steps = 40
    [output]
    sample_interval = 10
    [[sample]]
    operator = \"damage-tensor\"
    region = { kind = \"all\", volume = 1e-8 }
    interval = 1
    [[sample]]
    operator = \"damage-tensor\"
    name = \"of the first two\"
    region = { kind = \"set\", set = \"first two\", volume = 1e-8 }
    interval = 1
    [[sample]]
    operator = \"region-stress\"
    region = { kind = \"all\", volume = 1e-8 }
    interval = 1
";

/// Damage and stress of a row belong to the same positions: `ω = 1 − ε₀/ε exp(−(ε−ε₀)/ε_f)` and `σ = (1−ω) Ē ε`, with the
/// strain of the bond at the time of the row. Only the first bond stretches; the list of particles contains it entirely, and
/// half of the second. Tolerance: positions of 2e-3 m are known to 4e-19 m, elongations are 1e-7 m, so the strain is known
/// to 1e-11, amplified by the slope of the damage.
#[test]
fn damage_belongs_to_the_positions_of_its_row() {
    let mut run = simulation(&chain());
    let mut seen = 0;
    loop {
        let x = &run.state.particles.position;
        let strain = (x[1].x - x[0].x).abs().max((x[2].x - x[1].x).abs()) / 2e-3 - 1.0;
        let advance = run.advance().unwrap();
        let row = advance.operators.iter().find(|row| row.operator == 0).unwrap();
        let mean = row.values[27];
        let omega = if strain > 1e-4 { 1.0 - 1e-4 / strain * (-(strain - 1e-4) / 30e-4).exp() } else { 0.0 };
        assert!((mean - 0.5 * omega).abs() < 1e-9, "step {}: {mean} {omega}", row.step);
        let stress = advance.operators.iter().find(|row| row.operator == 2).unwrap().values[0];
        // One bond of π·1e-6 m² with a branch of 2e-3 m (1 + ε), in 1e-8 m³.
        let expected = (1.0 - omega) * 25e9 * strain * std::f64::consts::PI * 1e-6 * 2e-3 * (1.0 + strain) / 1e-8;
        assert!((stress - expected).abs() < 1e-8 * 25e9 * 1e-4, "step {}: {stress} {expected}", row.step);
        let of_two = advance.operators.iter().find(|row| row.operator == 1).unwrap();
        assert_eq!(of_two.values[29], 1.5);
        assert!((of_two.values[27] - omega / 1.5).abs() < 1e-9);
        seen += usize::from(omega > 0.1);
        if advance.stopped.is_some() {
            break;
        }
    }
    assert!(seen > 10, "{seen}");
}

/// A bond enters the event log once when it is damaged, and counts as damaged, not as broken, however long it is damaged.
#[test]
fn a_damaged_bond_is_one_event() {
    let mut run = simulation(&chain().replace("[output]", "[output]\nevents_damage = 0.5"));
    let mut events = Vec::new();
    let last = loop {
        let advance = run.advance().unwrap();
        events.extend(advance.events);
        if let Some(last) = advance.last {
            break last;
        }
    };
    assert_eq!(events.len(), 1, "{events:?}");
    assert!(
        (events[0].id_a, events[0].id_b) == (0, 1) && events[0].damage > 0.5 && events[0].damage < 0.8,
        "{events:?}"
    );
    assert_eq!((last.damaged, last.broken), (1.0, 0.0));
}

/// Every run ends with a record and rows of its final state, for any intervals. They equal those of a longer run bit for
/// bit, and writing them does not change the state.
#[test]
fn the_final_state_has_a_record() {
    let run_to = |steps: u64| {
        let mut run = simulation(&chain().replace("steps = 40", &format!("steps = {steps}")));
        let mut records: Vec<Record> = Vec::new();
        let mut rows: Vec<(u64, usize, Vec<u64>)> = Vec::new();
        let mut last = None;
        loop {
            let advance = run.advance().unwrap();
            records.extend(advance.sample);
            let bits = |values: Vec<f64>| values.into_iter().map(f64::to_bits).collect();
            rows.extend(advance.operators.into_iter().map(|row| (row.step, row.operator, bits(row.values))));
            if let Some(record) = advance.last {
                last = Some(record);
            }
            if advance.stopped.is_some() {
                return (records, rows, last.unwrap(), run.state.clock.time());
            }
        }
    };
    let (records, rows, last, time) = run_to(20);
    assert_eq!(records.iter().map(|record| record.step).collect::<Vec<_>>(), [0.0, 10.0]);
    assert_eq!((last.step, last.time), (20.0, time));
    assert_eq!(rows.iter().map(|row| row.0).max(), Some(20));
    let (longer, further, _, _) = run_to(31);
    let same = longer.iter().find(|record| record.step == 20.0).unwrap();
    let bits = |record: &Record| record.to_row().into_iter().map(f64::to_bits).collect::<Vec<_>>();
    assert_eq!(bits(&last), bits(same));
    for row in &rows {
        assert!(further.contains(row), "{row:?}");
    }
}

/// The stress of an empty region is not-a-number, not zero.
#[test]
fn the_stress_of_an_empty_region_is_not_a_number() {
    let text = chain().replace(
        "[[sample]]\n    operator = \"region-stress\"\n    region = { kind = \"all\", volume = 1e-8 }",
        "[[sample]]\n    operator = \"particle-stress\"\n    region = { kind = \"sphere\", center = [1, 0, 0], radius = 1e-3 }
        [[sample]]\n    operator = \"region-stress\"\n    region = { kind = \"sphere\", center = [1, 0, 0], radius = 1e-3 }",
    );
    let mut run = simulation(&text);
    let first = run.advance().unwrap();
    for name in ["particle-stress", "region-stress"] {
        assert!(reals(&run, &first, name, "stress").iter().all(|component| component.is_nan()), "{name}");
    }
}

/// Spheres without forces in a cell that shears, once stretched too: they go with the cell.
fn sheared_cell(gradient: &str, steps: u64) -> String {
    let mut spheres = String::new();
    for k in 0..27_u32 {
        let noise = |m: u32| f64::from((k * 7919 + m * 104_729) % 1009) / 1009.0 * 0.6;
        let x = |m: u32, n: u32| f64::from(n) + 0.2 + noise(m);
        let _ = write!(spheres, "[{:?}, {:?}, {:?}, 0.05],", x(1, k % 3), x(2, k / 3 % 3), x(3, k / 9));
    }
    format!(
        "version = 1
        [packing]
        kind = \"spheres\"
        spheres = [{spheres}]
        cell = [3, 3, 3]
        [[material]]
        name = \"m\"
        density = 1
        [contacts]
        law = \"none\"
        [loading]
        kind = \"cell-strain\"
        velocity_gradient = {gradient}
        [integration]
        time_step = 0.01
        [stop]
        steps = {steps}
        [output]
        sample_interval = 10
        [[sample]]
        operator = \"cell-strain\"
        [[sample]]
        operator = \"cell-rate\"
        "
    )
}

/// The mesh of cell strains is that of the start: after the edges of a sheared cell were shortened, which happens at step 256, the
/// strain is still that of the cell, and its rate, too. Tolerance: 300 roundings of edges of 3 m in cells of 1 m.
#[test]
fn cell_strains_survive_shortened_edges() {
    let mut run = simulation(&sheared_cell("[[0, 0.6, 0], [0, 0, 0], [0, 0, 0]]", 300));
    let edges = run.state.cell.unwrap().matrix;
    let last = to_the_end(&mut run);
    let cell = run.state.cell.unwrap();
    assert!((cell.matrix - cell.deformation_gradient * edges).norm() > 1.0, "the edges must have been shortened");
    let strain = tensor(&run, &last, "cell-strain", "gradient");
    assert!((strain - (cell.deformation_gradient - Mat3::identity())).norm() < 1e-12, "{strain}");
    let rate = tensor(&run, &last, "cell-rate", "gradient");
    assert!((rate - cell.velocity_gradient).norm() < 1e-12, "{rate}");
}

/// A run that goes on from a stored state gives the same strains, bit for bit.
#[test]
fn cell_strains_survive_a_restart() {
    use concordem_scenario::assembly::restart::apply;
    use concordem_solver::state::columns::ColumnStore;
    let text = sheared_cell("[[0.1, 0.3, 0], [0, -0.2, 0.1], [0.05, 0, 0.1]]", 60);
    let run = |restart: bool| {
        let scenario = Scenario::parse("test.toml", &text).unwrap_or_else(|error| panic!("{error}"));
        let mut run = simulation(&text);
        let mut rows = Vec::new();
        while run.stopped().is_none() {
            if restart && run.state.clock.step == 35 {
                let mut columns = ColumnStore::of(&run.state).unwrap();
                let mut assembly = assemble(&scenario, Path::new(""), &mut |_, _| ()).unwrap();
                apply(&mut assembly, &mut columns, &scenario, &[], false).unwrap();
                run = Simulation::new(assembly.state, assembly.model, assembly.schedule).unwrap();
            }
            let bits = |values: Vec<f64>| values.into_iter().map(f64::to_bits).collect::<Vec<_>>();
            rows.extend(
                run.advance().unwrap().operators.into_iter().map(|row| (row.step, row.operator, bits(row.values))),
            );
        }
        rows
    };
    assert_eq!(run(false), run(true));
}

/// A broken bond lies half way between its particles, whichever of them is called A.
#[test]
fn broken_bonds_lie_between_their_particles() {
    let text = chain()
        .replace("relative_ductility = 30", "relative_ductility = 3, omega_threshold = 0.5")
        .replace("velocity = [0.04, 0, 0]", "velocity = [40, 0, 0]")
        .replace("time_step = 5e-7", "time_step = 5e-7\n    allow_energy_error = true")
        .replace("steps = 40", "steps = 200");
    let mut run = simulation(&text.replace(
        "region = { kind = \"all\", volume = 1e-8 }\n    interval = 1\n    [[sample]]\n    operator = \"damage-tensor\"",
        "region = { kind = \"box\", minimum = [2.9e-3, -1e-3, -1e-3], maximum = [3.1e-3, 1e-3, 1e-3] }\n    interval = 1
        [[sample]]\n    operator = \"damage-tensor\"",
    ));
    let last = to_the_end(&mut run);
    // The first two are 2 mm + 200 · 0.5 us · 40 m/s = 6 mm apart.
    let mut x: Vec<f64> = run.state.particles.position.iter().map(|x| x.x).collect();
    x.sort_by(f64::total_cmp);
    assert!((x[1] - 6e-3).abs() < 1e-12, "{x:?}");
    assert_eq!(reals(&run, &last, "damage-tensor", "contacts"), [1.0]);
    assert_eq!(reals(&run, &last, "damage-tensor", "mean_damage"), [1.0]);
}
/// Values of an operator at the start of a run.
fn at_start(simulation: &mut Simulation, name: &str) -> Vec<f64> {
    let k = number(&simulation.schedule.operators, name);
    let first = simulation.advance().unwrap();
    first.operators.iter().find(|row| row.operator == k && row.step == 0).unwrap().values.clone()
}

/// A support bears the weight of the particle that it holds, from the start: with gravity along x, a held sphere of mass m at x in a
/// body of 1e-5 m³, 10 mm from the center of mass, has the boundary stress `x mg/V`. Some roundings.
#[test]
fn supports_bear_weight() {
    let held = "[[prescribe]]\nset = \"left\"\nvelocity = [0, 0, 0]\n[integration]\ngravity = [-9.81, 0, 0]";
    let values = at_start(&mut simulation(&pair(0.1, "linear_bond", SPRING, held)), "boundary-stress");
    let weight = 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * 1e-6 * 9.81;
    assert!((values[0] / (-0.01 * weight / 1e-5) - 1.0).abs() < 1e-12, "{values:?}");
}

/// A dumbbell of two equal spheres at ±10 mm, loaded at its ends; the volume of the body is 1e-5 m³.
fn dumbbell(loads: &str) -> Simulation {
    let text = "
        version = 1
        [packing]
        kind = \"spheres\"
        spheres = []
        [[material]]
        name = \"m\"
        density = 2500
        frictional = { normal_stiffness = 1e6, shear_stiffness = 0 }
        [contacts]
        law = \"frictional\"
        [[clump]]
        spheres = [[-0.01, 0, 0, 0.01], [0.01, 0, 0, 0.01]]
        [integration]
        time_step = 1e-6
        [stop]
        steps = 1
        [[sample]]
        operator = \"region-stress\"
        region = { kind = \"all\", volume = 1e-5 }
        [[sample]]
        operator = \"couple-stress\"
        region = { kind = \"all\", volume = 1e-5 }
        ";
    simulation(&[text, &set("left", &[0]), &set("right", &[1]), loads].concat())
}

/// A force of 100 N that pulls one end of a free dumbbell accelerates both ends: the bar between them bears one half of it, 20 mm ·
/// 50 N/V. Under forces across the bar that turn it, held by moments at the ends, every member is in equilibrium with the moments of
/// the bar: a couple stress of `−Σ x⊗M = 0`. Some roundings.
#[test]
fn bodies_bear_inertia_and_moments() {
    let pulled = "[[force]]\nset = \"right\"\nforce = [100, 0, 0]";
    let stress = at_start(&mut dumbbell(pulled), "region-stress");
    assert!((stress[0] / (0.02 * 50.0 / 1e-5) - 1.0).abs() < 1e-12, "{stress:?}");
    let turned = "[[force]]\nset = \"right\"\nforce = [0, 100, 0]\nmoment = [0, 0, -1]
        [[force]]\nset = \"left\"\nforce = [0, -100, 0]\nmoment = [0, 0, -1]";
    let mut run = dumbbell(turned);
    let operators = &run.schedule.operators;
    let place = place(&operators[number(operators, "couple-stress")], "couple_stress");
    let couple = &at_start(&mut run, "couple-stress")[place];
    // Moments of 1 N·m at 10 mm in 1e-5 m³ would be 1000 N/m each.
    assert!(couple.iter().all(|component| component.abs() < 1e-9), "{couple:?}");
}

/// Spheres that follow a deforming cell have no kinetic stress, however fast the cell moves: `mv²/V` would be 1e3 Pa.
#[test]
fn the_motion_of_the_cell_is_no_kinetic_stress() {
    let packing = "kind = \"lattice\"
        lattice = \"sc\"
        radius = 0.1
        repeats = [3, 3, 3]
        shape = { kind = \"periodic\" }";
    let text = bonded(packing, "linear_bond", "{ normal_stiffness = 1e6, shear_stiffness = 0 }")
        + "[loading]
        kind = \"cell-strain\"
        velocity_gradient = [[2, 1, 0], [0, -1, 0], [0, 3, 1]]
        [stop]
        steps = 1
        [[sample]]
        operator = \"region-stress\"
        region = { kind = \"box\", minimum = [-0.05, -0.05, -0.05], maximum = [0.35, 0.35, 0.35] }
        ";
    let values = at_start(&mut simulation(&text), "region-stress");
    // Rounding of velocities of 1 m/s.
    assert!(values[9..18].iter().all(|component| component.abs() < 1e-20), "{values:?}");
}

/// Spheres that all move alike keep their distances: no strain, however often they are moved back into the cell, which happens after
/// some 30 cells, to one sphere by one cell more than to another.
#[test]
fn particles_moved_back_are_not_strained() {
    let text = "
        version = 1
        [packing]
        kind = \"spheres\"
        spheres = [[0.1, 0.1, 0.1, 0.01], [0.5, 0.2, 0.1, 0.01], [0.9, 0.7, 0.4, 0.01], [0.2, 0.8, 0.9, 0.01], [0.6, 0.5, 0.6, 0.01]]
        cell = [1, 1, 1]
        [[material]]
        name = \"m\"
        density = 2500
        frictional = { normal_stiffness = 1, shear_stiffness = 0 }
        [contacts]
        law = \"frictional\"
        [[set]]
        name = \"all\"
        selection = { kind = \"all\" }
        [[initial]]
        set = \"all\"
        velocity = [150, 0, 0]
        [integration]
        time_step = 1e-3
        [stop]
        steps = 600
        [[sample]]
        operator = \"affine-strain\"
        interval = 599
        ";
    let mut run = simulation(text);
    let last = to_the_end(&mut run);
    assert!(run.state.particles.image.iter().any(|image| image[0] > 32), "{:?}", run.state.particles.image);
    // Rounding of displacements of 90 m over distances of 1 m.
    let gradient = tensor(&run, &last, "affine-strain", "gradient");
    assert!(gradient.abs().max() < 1e-12, "{gradient}");
}

/// The last row belongs to a step that is not taken. It counts the bonds of the event log, which ends before that step.
#[test]
fn counts_of_the_last_row_are_those_of_the_events() {
    let text = template("cpm-small").unwrap().text;
    let mut run = simulation(text);
    let (mut events, mut steps_with_events) = (0, 0);
    while steps_with_events < 60 {
        // Costs as much as many steps.
        if events > 0 {
            let last = run.present().unwrap().sample.unwrap();
            assert_eq!(last.broken + last.damaged, f64::from(events));
        }
        let advance = run.advance().unwrap();
        assert!(advance.stopped.is_none());
        events += advance.events.len() as u32;
        steps_with_events += u32::from(!advance.events.is_empty());
    }
}
