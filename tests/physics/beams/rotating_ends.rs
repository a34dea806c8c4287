//! Bending and torsion by rotating ends.

use std::f64::consts::PI;

use concordem::assembly::Assembly;
use concordem::output::hash::state_hash;
use concordem::schedule::Simulation;
use concordem::state::columns::ColumnStore;
use concordem_tests::on_threads;
use concordem_tests::runs::{finish, made, started};

/// A block or column of a simple cubic lattice of spheres of radius 1 mm; `shape` and `loading` as in a scenario.
fn lattice(shape: &str, loading: &str, strength: &str) -> String {
    format!(
        "version = 1\n[packing]\nkind = \"lattice\"\nlattice = \"sc\"\nradius = 1e-3\nshape = {shape}\n[[material]]\n\
         name = \"m\"\ndensity = 3000\n[material.cohesive_beam]\nyoung = 1e9\npoisson = 0.25\nradius_ratio = 0.8\n{strength}\n\
         [bonds]\nlaw = \"cohesive_beam\"\ninteraction_ratio = 1.01\n[contacts]\nlaw = \"none\"\n[integration]\n\
         damping = {{ kind = \"tchamwa-wielgosz\" }}\n[loading]\n{loading}\nlayer_thickness = 2e-3\n[stop]\nsteps = 400\n\
         [output]\nsample_interval = 1\n"
    )
}

/// In pure bending of a prism of 3×3 columns all sections stay plane, so `M = κ(EA Σy² + 9 EI)` of the columns. The initial
/// velocity field is that of uniform curvature, so there is no vibration; the onset of damping leaves 1e-4.
#[test]
fn a_bent_lattice_has_the_stiffness_of_its_columns() {
    on_threads(1, || {
        let shape = "{ kind = \"box\", size = [0.024, 0.0085, 0.0085] }";
        let loading = "kind = \"bending\"\naxis = \"x\"\nabout = \"z\"\nrate = 0.5";
        let assembly = made(&lattice(shape, loading, ""));
        let n = assembly.summary.particles;
        let ys: Vec<f64> = {
            let mut ys: Vec<f64> = assembly.state.particles.position.iter().map(|x| x.y).collect();
            ys.sort_unstable_by(f64::total_cmp);
            ys.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
            ys
        };
        let middle = ys.iter().sum::<f64>() / ys.len() as f64;
        let columns = ys.len() as f64;
        let mut simulation = started(assembly);
        let sample = finish(&mut simulation).expect("records");
        let r: f64 = 0.8e-3;
        let (area, inertia) = (PI * r * r, PI * r.powi(4) / 4.0);
        let stiffness =
            1e9 * (area * columns * ys.iter().map(|y| (y - middle).powi(2)).sum::<f64>() + columns * columns * inertia);
        // stress = M·6/bh², strain = κh/2
        let h: f64 = 0.0085;
        let measured = sample.stress * h.powi(3) / 6.0 / (sample.strain / (0.5 * h));
        let residual = simulation.state.ledger.residual() / simulation.state.ledger.boundary_work.get();
        println!("{n} spheres: EI {measured:.6e} N m², columns {stiffness:.6e}, residual {residual:.1e}");
        assert!((measured / stiffness - 1.0).abs() < 1e-4, "{measured:e} {stiffness:e}");
        assert!(residual.abs() < 1e-6, "{residual:e}");
    });
}

/// Torsion of a single column: `T = G I_O θ'` of its beams. The tolerance is the same as in bending.
#[test]
fn a_twisted_column_has_the_stiffness_of_its_beams() {
    on_threads(1, || {
        let shape = "{ kind = \"cylinder\", radius = 0.0011, height = 0.024, axis = \"x\" }";
        let loading = "kind = \"torsion\"\naxis = \"x\"\nrate = 2.0";
        let assembly = made(&lattice(shape, loading, ""));
        let spheres = assembly.summary.particles;
        let sample = finish(&mut started(assembly)).expect("records");
        assert_eq!(spheres, 11, "one column");
        let r: f64 = 0.8e-3;
        let stiffness = 1e9 / 2.5 * PI * r.powi(4) / 2.0;
        // stress = 2T/πR³, strain = Rθ'
        let radius: f64 = 0.0011;
        let measured = sample.stress / sample.strain * PI * radius.powi(4) / 2.0;
        println!("GI {measured:.6e} N m², beam {stiffness:.6e}");
        assert!((measured / stiffness - 1.0).abs() < 1e-4, "{measured:e} {stiffness:e}");
    });
}

/// A bent, breaking prism restarted from checkpoints ends with the same bits: the checkpoint contains the force that drives
/// the free axial motion of the ends.
#[test]
fn bending_restarts_bit_for_bit_from_any_step() {
    on_threads(2, || {
        let shape = "{ kind = \"box\", size = [0.024, 0.0085, 0.0085] }";
        let loading = "kind = \"bending\"\naxis = \"x\"\nabout = \"z\"\nrate = 50.0";
        let text = lattice(shape, loading, "tensile_strength = \"2 MPa\"");
        let run = |interval: u64| {
            let Assembly { state, model, schedule, .. } = made(&text);
            let mut simulation = Simulation::new(state, model.clone(), schedule.clone()).unwrap();
            let mut broken = 0;
            loop {
                let advance = simulation.advance().unwrap();
                broken += advance.events.len();
                if advance.stopped.is_some() {
                    break;
                }
                if simulation.state.clock.step.is_multiple_of(interval) {
                    let mut columns = ColumnStore::of(&simulation.state).unwrap();
                    let mut again = made(&text).state;
                    again.read(&mut columns).unwrap();
                    simulation = Simulation::new(again, model.clone(), schedule.clone()).unwrap();
                }
            }
            assert!(broken > 0, "the prism must break");
            state_hash(&simulation.state).unwrap()
        };
        let reference = run(u64::MAX);
        assert_eq!(reference, run(61));
        assert_eq!(reference, run(7));
    });
}
