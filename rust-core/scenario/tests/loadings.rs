//! Every kind of loading where a run ends, continues, and goes back: the last rows are those of a longer run, and an extended or restored
//! run has the bits of one without interruption.

mod shared;

use std::path::Path;

use concordem_contact::math::Vec3;
use concordem_scenario::assembly::{assemble, restart};
use concordem_scenario::sampling::Record;
use concordem_scenario::schedule::{Advance, Simulation};
use concordem_solver::state::columns::ColumnStore;

use shared::read;

/// Steps of the shorter run; the longer ones take twice as many.
const STEPS: usize = 20;

/// A cubic lattice of bonded spheres.
fn lattice(shape: &str) -> String {
    format!(
        "version = 1
        [packing]
        kind = \"lattice\"
        lattice = \"fcc\"
        radius = \"1 mm\"
        {shape}
        [[material]]
        name = \"m\"
        density = 2500
        linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 2e5, damping_ratio = 0.2 }}
        frictional = {{ normal_stiffness = 1e6, shear_stiffness = 2e5, friction_coefficient = 0.3 }}
        [bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.01
        [contacts]
        law = \"frictional\"
        [output]
        sample_interval = 5
        [[sample]]
        operator = \"region-stress\"
        region = {{ kind = \"all\", volume = \"1 cm^3\" }}
        [[sample]]
        operator = \"power\"
        region = {{ kind = \"all\", volume = \"1 cm^3\" }}
        "
    )
}

const BOX: &str = "shape = { kind = \"box\", size = [0.008, 0.008, 0.016] }";
const CYLINDER: &str = "shape = { kind = \"cylinder\", radius = 0.005, height = 0.016 }";
const CELL: &str = "repeats = [3, 3, 3]\nshape = { kind = \"periodic\" }";
const BEAM: &str = "shape = { kind = \"box\", size = [0.03, 0.008, 0.008] }";

/// A gauge between the ends of the box, and what lets a loading follow it.
const GAUGE: &str = "
    [[set]]
    name = \"low\"
    selection = { kind = \"layer\", axis = \"z\", end = \"minimum\", thickness = \"5 mm\" }
    [[set]]
    name = \"high\"
    selection = { kind = \"layer\", axis = \"z\", end = \"maximum\", thickness = \"5 mm\" }
    [[sample]]
    name = \"opening\"
    operator = \"gauge\"
    sets = [\"low\", \"high\"]
    ";
const OPENING: &str = "opening = { gauge = \"opening\", rate = 0.01, response_time = 3e-5 }";

/// Bodies and loadings of every kind. The rates are high, so that a loading which stops, or starts twice, changes many digits.
fn loadings() -> Vec<(&'static str, String)> {
    let [bar, cylinder, cell, beam] = [BOX, CYLINDER, CELL, BEAM].map(lattice);
    let set = "[[set]]\nname = \"end\"\nselection = { kind = \"layer\", axis = \"z\", end = \"minimum\", thickness = \"1.5 mm\" }\n";
    let held = format!("{set}[[prescribe]]\nset = \"end\"\nvelocity = [0, 0, -0.1]\n");
    vec![
        ("none", format!("{bar}{held}")),
        ("none in a cell", cell.clone()),
        ("uniaxial", format!("{bar}[loading]\nkind = \"uniaxial\"\nstrain_rate = 20")),
        ("uniaxial, held", format!("{bar}[loading]\nkind = \"uniaxial\"\nstrain_rate = -20\nlateral = \"fixed\"")),
        ("uniaxial by a gauge", format!("{bar}{GAUGE}[loading]\nkind = \"uniaxial\"\nstrain_rate = 20\n{OPENING}")),
        ("bending", format!("{bar}[loading]\nkind = \"bending\"\nabout = \"y\"\nrate = 100")),
        ("torsion", format!("{cylinder}[loading]\nkind = \"torsion\"\nrate = 100")),
        (
            "cell-strain",
            format!("{cell}[loading]\nkind = \"cell-strain\"\nvelocity_gradient = [[0, 0, 0], [5, 0, 0], [0, 0, 100]]"),
        ),
        (
            "cell-stress",
            format!(
                "{cell}[loading]\nkind = \"cell-stress\"\nmaximum_strain_rate = 100\n\
                 stress = [[-1e6, 0, 0], [0, -1e6, 0], [0, 0, -1e6]]"
            ),
        ),
        (
            "cell-stress, driven",
            format!(
                "{cell}[loading]\nkind = \"cell-stress\"\nmaximum_strain_rate = 100\n\
                 strain_rate = [\"free\", \"free\", -50]\nstress = [[-1e6, 0, 0], [0, -1e6, 0], [0, 0, 0]]"
            ),
        ),
        ("platens", format!("{bar}[loading]\nkind = \"platens\"\nclosing_velocity = 0.5\nmaterial = \"m\"")),
        (
            "platens by a gauge",
            format!("{bar}{GAUGE}[loading]\nkind = \"platens\"\nclosing_velocity = 0.5\nmaterial = \"m\"\n{OPENING}"),
        ),
        (
            "splitting by strips",
            format!(
                "{cylinder}[loading]\nkind = \"platens\"\naxis = \"x\"\nstrip_width = 0.003\nclosing_velocity = 0.5\n\
                 area = \"splitting\""
            ),
        ),
        (
            "flexure by strips",
            format!("{beam}[loading]\nkind = \"flexure\"\nspan = 0.024\nstrip_width = 0.0021\nclosing_velocity = 0.5"),
        ),
        (
            "flexure by rollers",
            format!(
                "{beam}[loading]\nkind = \"flexure\"\nspan = 0.024\nroller_radius = 0.003\nmaterial = \"m\"\n\
                 closing_velocity = 0.5"
            ),
        ),
    ]
}

/// Each loading alone and with stages, of which the second begins within the shorter run.
fn cases() -> Vec<(String, String)> {
    let stages = "\n[[stage]]\nname = \"to\"\nstop = { steps = 12 }\n[[stage]]\nname = \"fro\"\nrate = -0.5\nstop = { steps = 1000 }\n";
    let mut cases = Vec::new();
    for (name, text) in loadings() {
        if !name.starts_with("none") {
            cases.push((format!("{name}, with stages"), format!("{text}{stages}")));
        }
        cases.push((name.to_owned(), format!("{text}\n")));
    }
    cases
}

/// The scenario with a given number of steps.
fn of_steps(text: &str, steps: usize) -> String {
    format!("{text}[stop]\nsteps = {steps}\n")
}

fn simulation(text: &str) -> Simulation {
    let assembly =
        assemble(&read(text), Path::new(""), &mut |_, _| ()).unwrap_or_else(|error| panic!("{error}\n{text}"));
    Simulation::new(assembly.state, assembly.model, assembly.schedule).unwrap()
}

/// All that comes until the run ends.
fn to_the_end(simulation: &mut Simulation) -> Vec<Advance> {
    let mut all: Vec<Advance> = Vec::new();
    while all.last().is_none_or(|advance| advance.stopped.is_none()) {
        all.push(simulation.advance().unwrap());
    }
    all
}

/// Bits of the record and of all operators of step `step`.
fn rows(steps: &[Advance], step: u64) -> (Vec<u64>, Vec<Vec<u64>>) {
    let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<u64>>();
    let mut records = steps.iter().flat_map(|advance| advance.sample.iter().chain(&advance.last));
    let record = records.rfind(|record| record.step == step as f64).expect("a record");
    let operators = steps.iter().flat_map(|advance| &advance.operators).filter(|row| row.step == step);
    (bits(&record.to_row()), operators.map(|row| bits(&row.values)).collect())
}

/// Asserts that two runs have the same rows at a step.
fn assert_rows(case: &str, [a, b]: [&[Advance]; 2], step: usize) {
    let [a, b] = [a, b].map(|steps| rows(steps, step as u64));
    for (k, (x, y)) in a.0.iter().zip(&b.0).enumerate() {
        let [x, y] = [x, y].map(|bits| f64::from_bits(*bits));
        assert!(x.to_bits() == y.to_bits(), "{case}: {} {x:e} {y:e}", Record::COLUMNS[k].name);
    }
    assert!(!a.1.is_empty() && a.1 == b.1, "{case}: operators");
}

/// The columns of a state, without the schedule's memory of why the run ended.
fn columns(simulation: &Simulation) -> ColumnStore {
    ColumnStore::of(&simulation.state).unwrap()
}

/// Asserts that two states have the same columns.
fn assert_states(case: &str, a: &Simulation, b: &Simulation) {
    let [a, b] = [a, b].map(columns);
    let names = |store: &ColumnStore| store.iter().map(|(path, _)| path.to_owned()).collect::<Vec<_>>();
    assert_eq!(names(&a), names(&b), "{case}");
    for ((path, x), (_, y)) in a.iter().zip(b.iter()) {
        assert!(x.borrow().bytes() == y.borrow().bytes(), "{case}: {path}");
    }
}

/// The rows of the final state are those that a longer run has at that step; a run that is extended, and one that goes back to an earlier
/// state, end with the bits of that longer run.
#[test]
fn ends_extensions_and_returns_have_the_bits_of_one_run() {
    for (case, text) in cases() {
        let long = of_steps(&text, 2 * STEPS);
        let mut whole = simulation(&long);
        let mut all = Vec::new();
        let mut kept = None;
        while whole.stopped().is_none() {
            if whole.state.clock.step == STEPS as u64 - 7 {
                kept = Some(whole.state.clone());
            }
            all.push(whole.advance().unwrap());
        }

        let short = of_steps(&text, STEPS);
        let mut first = simulation(&short);
        let ended = to_the_end(&mut first);
        assert_rows(&case, [&ended, &all], STEPS);

        let (before, after) = (read(&short), read(&long));
        let changes = restart::check(&before, &after, restart::Continuation::NewResult).unwrap();
        let mut assembly = assemble(&after, Path::new(""), &mut |_, _| ()).unwrap();
        restart::apply(&mut assembly, &mut columns(&first), &after, &changes, true).unwrap();
        let mut extended = Simulation::new(assembly.state, assembly.model, assembly.schedule).unwrap();
        let further = to_the_end(&mut extended);
        assert_states(&format!("{case}, extended"), &extended, &whole);
        assert_rows(&case, [&further, &all], 2 * STEPS);

        let mut back = whole;
        back.replace_state(kept.unwrap()).unwrap();
        let again = to_the_end(&mut back);
        assert_states(&format!("{case}, restored"), &back, &extended);
        assert_rows(&case, [&again, &all], 2 * STEPS);
    }
}

/// The last rows of a run that ends with its last stage are those of a run whose stage goes on, and not of a loading at rest.
#[test]
fn a_run_that_ends_with_its_last_stage_has_the_rows_of_a_longer_stage() {
    for (case, text) in loadings() {
        if case.starts_with("none") {
            continue;
        }
        let staged = |steps: usize| {
            let stages = format!(
                "\n[[stage]]\nname = \"to\"\nstop = {{ steps = 7 }}\n\
                 [[stage]]\nname = \"fro\"\nrate = -0.5\nstop = {{ steps = {steps} }}\n"
            );
            to_the_end(&mut simulation(&of_steps(&format!("{text}{stages}"), 1000)))
        };
        assert_rows(case, [&staged(STEPS - 7), &staged(2 * STEPS)], STEPS);
    }
}

/// A motion that waits for the next step is part of the state: it survives a file, and a return to the state.
#[test]
fn a_motion_set_before_a_step_is_part_of_the_state() {
    let (_, text) = loadings().swap_remove(0);
    let text = of_steps(&text, STEPS);
    let mut whole = simulation(&text);
    for _ in 0..5 {
        whole.advance().unwrap();
    }
    let unset = columns(&whole);
    let n = whole.state.particles.len();
    whole.state.motion = Some(vec![(Vec3::new(0.1, 0.05, 0.02), Vec3::zeros()); n]);
    let set = columns(&whole);
    assert!(set != unset);
    let kept = whole.state.clone();
    to_the_end(&mut whole);

    let scenario = read(&text);
    let mut assembly = assemble(&scenario, Path::new(""), &mut |_, _| ()).unwrap();
    restart::apply(&mut assembly, &mut set.clone(), &scenario, &[], false).unwrap();
    let mut loaded = Simulation::new(assembly.state, assembly.model, assembly.schedule).unwrap();
    to_the_end(&mut loaded);
    assert_states("loaded", &loaded, &whole);
    assert!(whole.state.particles.velocity.iter().any(|v| v.z == 0.02));

    let mut without = simulation(&text);
    to_the_end(&mut without);
    assert!(without.state.particles.position != whole.state.particles.position);

    loaded.replace_state(kept).unwrap();
    to_the_end(&mut loaded);
    assert_states("restored", &loaded, &whole);
}
