//! Representative cells against springs, and their saved states.

use std::path::Path;

use concordem_contact::math::{Mat3, Vec3};
use concordem_multiscale::{CellError, RepresentativeCell, Response, deform};
use concordem_scenario::assembly::assemble;
use concordem_scenario::schema::Scenario;

const RADIUS: f64 = 1e-3;
const STIFFNESS: f64 = 1e6;

fn lattice(strength: &str, extra: &str) -> Result<RepresentativeCell, CellError> {
    let text = format!(
        "version = 1\n\
         [packing]\nkind = 'lattice'\nlattice = 'fcc'\nradius = '1 mm'\nrepeats = [2, 2, 2]\nshape = {{ kind = 'periodic' }}\n\
         [[material]]\nname = 'm'\ndensity = '2500 kg/m^3'\n\
         linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 2e5{strength} }}\n\
         [bonds]\nlaw = 'linear_bond'\ninteraction_ratio = 1.01\n[contacts]\nlaw = 'none'\n\
         [stop]\nsteps = 1000000\n{extra}"
    );
    let scenario = Scenario::parse("<test>", &text).unwrap();
    RepresentativeCell::new(&assemble(&scenario, Path::new("."), &mut |_, _| ()).unwrap())
}

/// Stress of the uniform field of an fcc lattice: `q = ΣLk/V` by direction; here summed over the twelve neighbors of a particle.
fn uniform(gradient: &Mat3) -> Mat3 {
    let mut sum = Mat3::zeros();
    for i in 0..3 {
        for (a, b) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            let mut n = Vec3::zeros();
            n[(i + 1) % 3] = a;
            n[(i + 2) % 3] = b;
            let branch = gradient * n.normalize() * (2.0 * RADIUS);
            let normal = branch.normalize();
            let force = normal * (STIFFNESS * (branch.norm() - 2.0 * RADIUS));
            sum += branch * force.transpose() * 0.5;
        }
    }
    // Volume per particle.
    sum / (4.0 * 2.0_f64.sqrt() * RADIUS.powi(3) * gradient.determinant())
}

#[test]
fn stretched_lattice_has_the_stress_of_its_springs() {
    // Without rotation of the principal axes there is no shear in the bonds of a stretch along all axes alike.
    let mut cell = lattice("", "").unwrap();
    let gradient = Mat3::identity() * 1.001;
    cell.deform(&gradient, 1).unwrap();
    let response = cell.response().unwrap();
    let wanted = uniform(&gradient);
    // Rounding of positions, some 1e-18 m, over the elongation of 2e-6 m.
    assert!((response.stress - wanted).norm() < 1e-10 * wanted.norm(), "{} {wanted}", response.stress);
    assert!((cell.deformation_gradient() - gradient).norm() < 1e-15);
    assert!(response.couple_stress.norm() < 1e-12 * wanted.norm());
    assert_eq!(response.bonds, 6 * 32);
}

#[test]
fn stiffness_is_that_of_the_uniform_field() {
    let cell = lattice("", "").unwrap();
    let stiffness = cell.stiffness().unwrap();
    // q (k_N + k_T)/6 and so on, Stránský 2018, (3.31), with q = Σ L k/V and springs for moduli.
    let q = 6.0 * 4.0 * RADIUS * RADIUS / (4.0 * 2.0_f64.sqrt() * RADIUS.powi(3));
    let (normal, shear) = (STIFFNESS, 2e5);
    for (found, wanted) in [
        (stiffness[(0, 0)], q * (normal + shear) / 6.0),
        (stiffness[(0, 1)], q * (normal - shear) / 12.0),
        (stiffness[(3, 3)], q * (normal + shear) / 12.0),
    ] {
        // Conjugate gradients on a lattice end at once.
        assert!((found - wanted).abs() < 1e-9 * wanted, "{found} {wanted}");
    }
}

#[test]
fn restored_cell_continues_bit_by_bit_alone_and_among_others() {
    let turned = |k: f64| Mat3::new(1.0, 0.002 * k, 0.0, -0.001, 1.0 + 0.001 * k, 0.0, 0.0, 0.0, 1.0);
    let mut cells: Vec<_> = (0..4).map(|_| lattice("", "").unwrap()).collect();
    let gradients: Vec<_> = (0..4).map(|k| turned(f64::from(k))).collect();
    for done in deform(&mut cells, &gradients, 7) {
        done.unwrap();
    }
    let saved: Vec<_> = cells.iter().map(RepresentativeCell::snapshot).collect();
    let work = |cell: &mut RepresentativeCell| cell.response().unwrap().work.to_bits();
    let works: Vec<_> = cells.iter_mut().map(work).collect();
    let next: Vec<_> = (0..4).map(|k| turned(f64::from(k) + 1.0)).collect();
    for done in deform(&mut cells, &next, 9) {
        done.unwrap();
    }
    for (k, cell) in cells.iter_mut().enumerate() {
        let mut alone = lattice("", "").unwrap();
        alone.restore(&saved[k]).unwrap();
        assert_eq!(work(&mut alone), works[k], "cell {k}");
        alone.deform(&next[k], 9).unwrap();
        let bits = |cell: &RepresentativeCell| {
            cell.state()
                .particles
                .position
                .iter()
                .chain(&cell.state().particles.velocity)
                .flat_map(|v| v.map(f64::to_bits).data.0[0])
                .collect::<Vec<_>>()
        };
        assert_eq!(bits(&alone), bits(cell), "cell {k}");
        assert_eq!(work(&mut alone), work(cell), "cell {k}");
    }
}

#[test]
fn what_a_cell_cannot_do_is_refused() {
    let loading = "[loading]\nkind = 'cell-strain'\nvelocity_gradient = [[0, 0, 0], [0, 0, 0], [0, 0, 1]]\n";
    assert!(matches!(lattice("", loading), Err(CellError::Driven { what: "a [loading]" })));
    let mut cell = lattice(", normal_strength = 1.0", "").unwrap();
    assert!(matches!(cell.deform(&-Mat3::identity(), 1), Err(CellError::Inverted { .. })));
    assert!(matches!(cell.deform(&Mat3::identity(), 0), Err(CellError::NoSteps)));
    cell.deform(&(Mat3::identity() * 1.0002), 5).unwrap();
    assert!(matches!(cell.deform(&(Mat3::identity() * 1.002), 5), Err(CellError::NoBonds { .. })));
}

/// A cell after a ramp to this gradient in this number of steps, still moving.
fn ramped(gradient: &Mat3, steps: u32) -> RepresentativeCell {
    let mut cell = lattice("", "").unwrap();
    cell.deform(gradient, steps).unwrap();
    cell
}

/// The work of the stress is the energy of the springs, `½ k (2r e)²` each, while the cell moves and once it is held (Hill and Mandel). A stretch
/// along all axes turns no spring, so that the trapezoidal rule is exact for any number of steps.
#[test]
fn work_of_the_stress_is_the_stored_energy_while_the_cell_moves() {
    let strain = 1e-4;
    let gradient = Mat3::identity() * (1.0 + strain);
    let wanted = 6.0 * 32.0 * 0.5 * STIFFNESS * (2.0 * RADIUS * strain).powi(2);
    for steps in [1, 2, 10, 100] {
        let mut cell = ramped(&gradient, steps);
        let particles = &cell.state().particles;
        let motion: f64 = particles.velocity.iter().zip(&particles.mass).map(|(v, m)| 0.5 * m * v.norm_squared()).sum();
        // The tolerance sees the energy of the mean motion, which is no part of the work.
        assert!(motion > 1e-4 * wanted, "{steps}: {motion}");
        // Rounding of positions, some 1e-18 m, over the elongation of 2e-9 m in the shortest steps.
        for held in 0..3 {
            let work = cell.response().unwrap().work;
            assert!((work / wanted - 1.0).abs() < 1e-9, "{steps}, {held}: {work} {wanted}");
            cell.deform(&gradient, 1).unwrap();
        }
    }
}

/// A stretch along one axis turns the springs. The error of the trapezoidal rule then is of second order in the time step: the difference of the
/// work between n and 2n steps falls by 4. Its limit is `½ σ:ε V` but for the change of the geometry, and the steps are as near to it.
#[test]
fn work_of_the_stress_is_of_second_order_in_the_step() {
    let strain = 1e-3;
    let mut gradient = Mat3::identity();
    gradient[(0, 0)] += strain;
    let responses = [1, 2, 4].map(|steps| ramped(&gradient, steps).response().unwrap());
    let [one, two, four] = [0, 1, 2].map(|k: usize| responses[k].work);
    let order = (one - two) / (two - four);
    // The next term of the error is smaller by the strain.
    assert!((order - 4.0).abs() < 4.0 * strain, "{order}");
    let limit = four + (four - two) / 3.0;
    for steps in [1, 2, 10, 100] {
        let Response { work, stress, volume, .. } = ramped(&gradient, steps).response().unwrap();
        let square = f64::from(steps * steps);
        let error = (one - limit).abs() / square;
        assert!((work - limit).abs() < 1.01 * error, "{steps}: {work} {limit} {error}");
        let wanted = 0.5 * stress[(0, 0)] * strain * volume;
        assert!((work / wanted - 1.0).abs() < 2.0 * strain, "{steps}: {work} {wanted}");
    }
}

/// Lattices of concrete, some of which have an inner freedom, stretched at once and slowly. Loads that are almost zero have no equilibrium beyond their
/// rounding, which also pushes the whole.
#[test]
fn perfect_lattices_of_concrete_have_a_stiffness() {
    for (kind, repeats) in [("fcc", [2, 2, 2]), ("hcp", [3, 2, 2]), ("bcc", [2, 2, 2])] {
        let text = format!(
            "version = 1\n\
             [packing]\nkind = 'lattice'\nlattice = '{kind}'\nradius = '1 mm'\nrepeats = {repeats:?}\nshape = {{ kind = 'periodic' }}\n\
             [[material]]\nname = 'm'\ndensity = '4800 kg/m^3'\n\
             cpm = {{ young = 25e9, shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = 30, cohesion = 3e6, friction_coefficient = 0.8 }}\n\
             [bonds]\nlaw = 'cpm'\ninteraction_ratio = 1.5\n[contacts]\nlaw = 'cpm'\n\
             [integration]\ndamping = {{ kind = 'local', coefficient = 0.2 }}\n[stop]\nsteps = 1000000\n"
        );
        let scenario = Scenario::parse("<test>", &text).unwrap();
        let assembly = assemble(&scenario, Path::new("."), &mut |_, _| ()).unwrap();
        let before = RepresentativeCell::new(&assembly).unwrap().stiffness().unwrap();
        for steps in [1, 2, 20] {
            let mut cell = RepresentativeCell::new(&assembly).unwrap();
            for k in 1..=steps {
                let strain = 2e-5 * f64::from(k) / f64::from(steps);
                cell.deform(&(Mat3::identity() + Mat3::from_diagonal(&Vec3::new(strain, 0.0, 0.0))), 1).unwrap();
            }
            let after = cell.stiffness().unwrap();
            // Stretched by 2e-5.
            assert!((after - before).abs().max() < 1e-4 * before.max(), "{kind} {steps}: {after} {before}");
        }
    }
}

/// Forces on a particle of a perfect lattice cancel but for rounding, also after hundreds of steps in which positions were rounded: the lattice has
/// its stiffness.
#[test]
fn perfect_lattices_keep_their_stiffness() {
    for steps in [1, 20, 300] {
        let mut cell = lattice("", "").unwrap();
        let before = cell.stiffness().unwrap()[(1, 1)];
        for k in 1..=steps {
            let gradient =
                Mat3::identity() + Mat3::from_diagonal(&Vec3::new(2e-4, 0.0, 0.0)) * (f64::from(k) / f64::from(steps));
            cell.deform(&gradient, 1).unwrap();
        }
        let after = cell.stiffness().unwrap()[(1, 1)];
        // Stretched by 2e-4 across.
        assert!((after / before - 1.0).abs() < 1e-3, "{steps}: {after} {before}");
    }
}
