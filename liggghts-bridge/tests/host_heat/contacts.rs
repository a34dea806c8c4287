//! Heat through contacts in the hosts: closed forms.

use super::{BOTH, CAPACITY, CONDUCTANCE, GLASS, LINEAR, ORDERED, R, Vec3, lattice, output, start, temperatures};
use crate::harness::{run_in, tables, thermo};

/// Two grains that touch, without bonds: each step shortens the difference by the same factor. With constriction, heat flows through the
/// circle of the overlap δ, `G = 2 λ a` with `a = √(δ R/2)` (Batchelor and O'Brien 1977).
#[test]
fn grains_exchange_heat_while_they_touch() {
    let (resistance, overlap): (f64, f64) = (1e-3, 0.02 * R);
    let with_resistance = 4.0 * R * R / (2.0 * R / 1.1 + resistance);
    let with_constriction = 2.0 * 1.1 * (overlap * R / 2.0).sqrt();
    for (contact, conductance) in
        [(format!("resistance = {resistance}"), with_resistance), ("constriction = true".to_owned(), with_constriction)]
    {
        for host in BOTH {
            let folder = tempfile::tempdir().unwrap();
            let mut atoms = lattice([2, 1, 1], 0.0);
            atoms[1].position.x = 2.0 * R - overlap;
            std::fs::write(
                folder.path().join("heat.toml"),
                format!(
                    "[heat]\nmodel = \"contacts\"\ncontact = {{ {contact} }}\ntemperature = 300\n\
                     [[heat.initial]]\nset = \"hot\"\ntemperature = 400\n"
                ),
            )
            .unwrap();
            let head = start(host, folder.path(), &atoms, 1e-3);
            let script = format!(
                "{head}group hot id 1\nfix bonds all concordem/bond none contact frictional normal_stiffness 1 shear_stiffness 1 \
                 friction_coefficient 0 {GLASS} heat heat.toml\n{}run 500\n",
                output(host, 500)
            );
            run_in(host, folder.path(), &script, 2);
            let found = temperatures(folder.path());
            let expected = 100.0 * (1.0 - 2.0 * conductance * 1e-3 / CAPACITY).powi(500);
            // 500 roundings of 400 K; those of the overlap, 1e-18 of 2e-5 m, change 100 K by 1e-11.
            assert!(
                (found[0] - found[1] - expected).abs() < 1e-10 && expected < 98.0,
                "{host:?}, {contact}: {found:?} {expected}"
            );
        }
    }
}

/// A bond that a spin breaks while its spheres are pressed together: the closed crack conducts `1/G = 1/G₀ + r/A` with the conductance
/// `G₀` and the area A of the bond, where `contact` gives a resistance, and not at all otherwise.
#[test]
fn closed_cracks_conduct_as_contacts() {
    const RESISTANCE: f64 = 2e-3;
    let factor = 0.005 * CAPACITY / CONDUCTANCE / 1e-6;
    let decay = |conductance: f64| 1.0 - 2.0 * conductance * factor * 1e-6 / CAPACITY;
    let closed = 1.0 / (1.0 / CONDUCTANCE + RESISTANCE / (4.0 * R * R));
    for (contact, after) in [(format!("contact = {{ resistance = {RESISTANCE:e} }}\n"), closed), (String::new(), 0.0)] {
        for host in BOTH {
            let folder = tempfile::tempdir().unwrap();
            let mut atoms = lattice([2, 1, 1], 0.0);
            atoms[0].spin = Vec3::new(0.0, 0.0, 100.0);
            atoms[0].velocity.x = 0.01;
            std::fs::write(
                folder.path().join("heat.toml"),
                format!(
                    "{ORDERED}temperature = 300\ntime_factor = {factor:e}\n{contact}[[heat.initial]]\nset = \"hot\"\ntemperature = 400\n"
                ),
            )
            .unwrap();
            let head = start(host, folder.path(), &atoms, 1e-6);
            let script = format!(
                "{head}group hot id 1\nfix bonds all concordem/bond {LINEAR} normal_strength 1e6 shear_strength 0.5 {GLASS} heat heat.toml bond distance 1.01 \
                 contact frictional contact.normal_stiffness 1e6 contact.shear_stiffness 1e5 contact.friction_coefficient 0.3\n\
                 fix integrate all nve/noforce\n{}run 100\n",
                output(host, 1)
            );
            let printed = thermo(&run_in(host, folder.path(), &script, 2));
            let broke = printed.iter().position(|row| row[2] == 1.0).expect("the bond breaks");
            assert!((10..60).contains(&broke), "{host:?}: it breaks in step {broke}");
            let frames = tables(&folder.path().join("out.dump"));
            let apart: Vec<f64> = frames.iter().map(|(_, rows)| rows[0][7] - rows[1][7]).collect();
            for (step, pair) in apart.windows(2).enumerate() {
                // The bond breaks within its step.
                let conductance = match (step + 1).cmp(&broke) {
                    std::cmp::Ordering::Less => CONDUCTANCE,
                    std::cmp::Ordering::Equal => continue,
                    std::cmp::Ordering::Greater => after,
                };
                // Roundings of 400 K, over the difference of some 60 K.
                let expected = decay(conductance);
                assert!(
                    (pair[1] / pair[0] - expected).abs() < 1e-14 * 300.0,
                    "{host:?}, {contact}, {step}: {pair:?} {expected}"
                );
            }
        }
    }
}
