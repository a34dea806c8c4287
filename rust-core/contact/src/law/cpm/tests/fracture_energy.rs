//! Softening by a fracture energy: bonds of any length dissipate the same energy per area.

use super::*;

/// Fracture energy, J/m².
const G: f64 = 2000.0;

fn with_energy(damage_law: DamageLaw) -> CpmParameters {
    CpmParameters { damage_law, relative_ductility: 0.0, fracture_energy: G, ..concrete() }
}

/// Pull a bond of the length `length` (m) and a unit area until it breaks in steps of ε₀/`fineness`; the response to the state `old` each time.
/// Returns the work of the mean forces, J, and the dissipation by damage.
fn pulled_apart(law: &Cpm, length: f64, fineness: f64) -> [f64; 2] {
    let geometry = ContactGeometry { reference_length: length, area: 1.0, ..geometry() };
    let (mut state, mut strain, mut force) = (CpmState::default(), 0.0, 0.0);
    let [mut work, mut damage] = [0.0; 2];
    loop {
        let now = strain + 1e-4 / fineness;
        let k = PointKinematics {
            geometry,
            length: length * (1.0 + now),
            length_old: length * (1.0 + strain),
            elongation: length * now,
            elongation_old: length * strain,
            gap: 0.0,
            ..straight(strain, now, Vec3::zeros(), true)
        };
        let response = law.respond(&k, &state, 1.0);
        damage += response.energy.damage;
        if response.status != Status::Lives {
            return [work, damage];
        }
        work += 0.5 * (force + response.force.x) * (now - strain) * length;
        (state, strain, force) = (response.state, now, response.force.x);
    }
}

/// The energy per area of lengths over a factor of 8: steps of ε₀/1000 err by (1e-3 ε₀/ε_f)²/12 of the softening part, and at a threshold of
/// 1 − 1e-9 the strength left is less than 1e-5 of G. The linear law loses all its strength; the last step adds half of one.
#[test]
fn bonds_of_all_lengths_dissipate_the_same_energy() {
    for damage_law in [DamageLaw::Linear, DamageLaw::Exponential] {
        let law = law(CpmParameters { omega_threshold: 1.0 - 1e-9, ..with_energy(damage_law) });
        // The longest of this material has 13.33 m.
        for length in [1.0, 2.0, 4.0, 8.0] {
            let [work, damage] = pulled_apart(&law, length, 1000.0);
            close(work, G, 1e-6);
            close(damage, G, 1e-6);
        }
    }
}

/// A bond has the bits of one whose ductility is the one that follows from its length.
#[test]
fn the_ductility_follows_from_the_length() {
    for damage_law in [DamageLaw::Linear, DamageLaw::Exponential] {
        let given = with_energy(damage_law);
        let length = geometry().reference_length;
        let ductility = given.softening_strain(length) / given.crack_onset_strain;
        // G/(Ēε₀²L) = 2000/(30e9 · 1e-8 · 2) = 10/3.
        let wanted = if damage_law == DamageLaw::Linear { 20.0 / 3.0 } else { 17.0 / 6.0 };
        close(ductility, wanted, 1e-15);
        let of_energy = law(given);
        let of_ratio = law(CpmParameters { relative_ductility: ductility, fracture_energy: 0.0, ..given });
        let mut bonds = [Bond::new(of_energy), Bond::new(of_ratio)];
        for strain in [0.5e-4, 1.5e-4, 1e-4, 2.5e-4, -1e-4, 4e-4] {
            for bond in &mut bonds {
                bond.go(strain, Vec3::new(0.0, 1e-5, 0.0));
            }
            let [ours, theirs] = &bonds;
            // A product and a division of the softening strain: a few roundings.
            close(ours.normal_stress, theirs.normal_stress, 1e-14);
            let of = |law: &Cpm, bond: &Bond| law.lost_strength(Reference { length, area: 1.0 }, &bond.state);
            assert!((of(&of_energy, ours) - of(&of_ratio, theirs)).abs() < 1e-14);
        }
        let again = given.with_ductility(ductility, length);
        close(again.fracture_energy, G, 1e-15);
    }
}

/// At another temperature ω stays the same function of κ/ε₀, so the energy has the factor strength²/stiffness.
#[test]
fn the_energy_follows_strength_and_stiffness() {
    let cold = law(CpmParameters { omega_threshold: 1.0 - 1e-9, ..with_energy(DamageLaw::Exponential) });
    let hot = cold.at_temperature(&TemperatureFactors { stiffness: 0.8, strength: 0.5 });
    let [work, _] = pulled_apart(&hot, 2.0, 1000.0);
    close(work, G * 0.5 * 0.5 / 0.8, 1e-6);
}

#[test]
fn what_contradicts_itself_is_refused() {
    let energy = with_energy(DamageLaw::Exponential);
    // 2G/(Ēε₀²) = 4000/300 m.
    close(law(energy).longest_bond(), 40.0 / 3.0, 1e-15);
    assert_eq!(law(concrete()).longest_bond(), f64::INFINITY);
    assert_eq!(Cpm::new(&CpmParameters { relative_ductility: 30.0, ..energy }), Err(CpmError::SoftensTwice));
    for mode in [CpmFormulation::YadePublic, CpmFormulation::Woo] {
        assert_eq!(Cpm::new(&CpmParameters { mode, ..energy }), Err(CpmError::OnlyInThesis));
    }
    let negative = Cpm::new(&CpmParameters { fracture_energy: -1.0, ..energy });
    assert!(matches!(negative, Err(CpmError::OutOfRange { name: "fracture_energy", .. })));
    assert_eq!(energy.average(&concrete()), Err(CpmError::Unlike { name: "fracture_energy" }));
    let more = CpmParameters { fracture_energy: 3.0 * G, ..energy };
    assert_eq!(energy.average(&more).map(|mean| mean.fracture_energy), Ok(2.0 * G));
}
