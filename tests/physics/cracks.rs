//! Does every crack have one event, with its mode?

use concordem::fracture::Event;
use concordem_tests::runs::{made, started};

/// Two pairs of rock. The first one is pulled apart. The second one is pressed and sheared: it cracks in shear under pressure, slides on, and
/// parts later, which is no event any more.
#[test]
fn each_crack_of_rock_has_one_event() {
    let mut run = started(made(
        r#"version = 1
        [packing]
        kind = "spheres"
        spheres = [[0, 0, 0, 1e-3], [2e-3, 0, 0, 1e-3], [0, 1e-2, 0, 1e-3], [2e-3, 1e-2, 0, 1e-3]]
        [[material]]
        name = "rock"
        density = 2500
        jointed = { young = 1e9, stiffness_ratio = 0.5, tensile_strength = 1e4, cohesion = 3e4, friction_coefficient = 0.3 }
        [bonds]
        law = "jointed"
        interaction_ratio = 1.1
        [contacts]
        law = "jointed"
        [[set]]
        name = "pulled"
        selection = { kind = "ids", ids = [1] }
        [[initial]]
        set = "pulled"
        velocity = [0.05, 0, 0]
        [[set]]
        name = "pressed"
        selection = { kind = "ids", ids = [3] }
        [[initial]]
        set = "pressed"
        velocity = [-0.2, 0.4, 0.1]
        [integration]
        time_step = 2e-8
        [stop]
        steps = 4000
        [output]
        sample_interval = 1
        "#,
    ));
    let (mut events, mut last, mut parted): (Vec<Event>, _, Vec<u64>) = (Vec::new(), None, Vec::new());
    while run.stopped().is_none() {
        let advance = run.advance().expect("a step");
        events.extend(advance.events);
        last = advance.sample.or(last);
        parted.resize(run.state.broken.len(), run.state.clock.step);
    }
    events.sort_by_key(|event| event.id_a);
    let found: Vec<_> =
        events.iter().map(|event| ([event.id_a, event.id_b], event.mode_shares, event.damage)).collect();
    assert_eq!(found, [([0, 1], [1.0, 0.0, 0.0, 0.0], 1.0), ([2, 3], [0.0, 1.0, 0.0, 0.0], 1.0)]);
    assert!(events.iter().all(|event| event.energy > 0.0));
    let last = last.expect("a record");
    assert_eq!((last.broken, last.damaged), (2.0, 0.0));
    // Both pairs are apart; the second one slid for a while.
    assert_eq!(parted.len(), 2);
    assert!(parted[1] > events[1].step + 20, "{parted:?} {}", events[1].step);
}
