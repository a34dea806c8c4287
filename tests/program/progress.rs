//! How far a run has come: by the stop that comes next, of those that can be estimated.

use concordem::program::progress::Progress;
use concordem::scenario::Scenario;
use concordem::schedule::Simulation;

/// The prism, with these stops and stages.
fn simulation(stop: &str) -> Simulation {
    let text = crate::PRISM.replace("steps = STEPS", stop).replace("sample_interval = 7", "sample_interval = 1");
    let scenario = Scenario::parse("prism.toml", &text).unwrap_or_else(|error| panic!("{error}"));
    let assembly =
        concordem::assembly::assemble(&scenario, std::path::Path::new("."), &mut |_, _| {}).expect("a prism");
    Simulation::new(assembly.state, assembly.model, assembly.schedule).expect("a simulation")
}

/// Share and name after every step of 100.
fn shares(stop: &str) -> Vec<Option<(String, f64)>> {
    let mut simulation = simulation(stop);
    let (mut progress, mut strain) = (Progress::default(), 0.0);
    (0..100)
        .map(|_| {
            strain = simulation.advance().expect("a step").sample.map_or(strain, |record| record.strain);
            progress.done(&simulation, strain).map(|done| (done.name(), done.share))
        })
        .collect()
}

/// A stage of 40 steps, then one that ends at rest or at a strain: the share is that of the present stage.
#[test]
fn stages_are_estimated_by_what_ends_them() {
    let stages = "drop_to = 0.1\n[[stage]]\nname = \"first\"\nstop = { steps = 40 }\n[[stage]]\nname = \"second\"\nstop = { unbalanced = 1e-12, strain = 0.1 }";
    let shares = shares(stages);
    // The first look is after step 1, from which the steps count.
    let (name, share) = shares[19].clone().expect("an estimate");
    assert_eq!(name, "stage \"first\", 1 of 2");
    assert_eq!(share, 19.0 / 40.0);
    let second = &shares[50..];
    assert!(second.iter().flatten().all(|(name, _)| name == "stage \"second\", 2 of 2") && second.len() == 50);
    let share = |at: usize| shares[at].clone().expect("an estimate").1;
    assert!(0.0 < share(60) && share(60) < share(99) && share(99) < 1.0, "{} {}", share(60), share(99));
}

/// A stop that comes when it comes gives no share, and the run's own steps give one beside a stage that has none.
#[test]
fn what_cannot_be_estimated_has_no_share() {
    assert!(shares("drop_to = 0.1").iter().all(Option::is_none));
    let stage = "[[stage]]\nname = \"only\"\nstop = { drop_to = 0.5 }";
    assert!(shares(stage).iter().all(Option::is_none));
    let beside = shares(&format!("steps = 200\n{stage}"));
    assert_eq!(beside[99], Some(("running".to_owned(), 0.5)));
}
