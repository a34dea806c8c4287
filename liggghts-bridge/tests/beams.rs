//! Cohesive beams in LIGGGHTS and LAMMPS compared with analytical solutions: a cantilever at rest, and bars pulled until they break.

use std::f64::consts::PI;
use std::fmt::Write as _;

use crate::harness::{Atom, Host, data_file_for, dump_for, frames, head_for, run_in, thermo};
use concordem_contact::math::Vec3;

const RADIUS: f64 = 0.005;
const RUNS: [(Host, usize); 5] =
    [(Host::Liggghts, 1), (Host::Liggghts, 2), (Host::Liggghts, 4), (Host::Lammps, 1), (Host::Lammps, 2)];

#[test]
fn the_deflection_of_a_cantilever_follows_beam_theory() {
    // Ten Euler-Bernoulli beams between sphere centers are exact at the nodes.
    let (young, beam_radius, count) = (1e9, 0.5 * RADIUS, 11_usize);
    let length = 2.0 * RADIUS * (count - 1) as f64;
    let stiffness = young * PI * beam_radius.powi(4) / 4.0;
    // Small enough that the effect of finite rotations is below 1e-7.
    let wanted = 1e-4 * length;
    let load = 3.0 * stiffness * wanted / length.powi(3);
    let atoms: Vec<Atom> =
        (0..count).map(|k| Atom::resting(Vec3::new(2.0 * RADIUS * k as f64, 0.0, 0.0), RADIUS)).collect();
    let mut alone: Option<(Host, Vec<u8>)> = None;
    for (host, processors) in RUNS {
        let folder = tempfile::tempdir().unwrap();
        let data = folder.path().join("chain.data");
        data_file_for(host, &data, &atoms, &[], Vec3::repeat(-0.02), Vec3::new(0.12, 0.02, 0.02));
        let mut script = head_for(host, "chain.data", "f f f", 1e-3, 1e-5);
        writeln!(
            script,
            "processors * 1 1\ngroup tip id {count}\ngroup clamped id 1\ngroup free subtract all clamped\n\
             fix integrate free nve/sphere\n\
             fix bonds all concordem/bond cohesive_beam young {young:e} poisson 0.2 radius_ratio 0.5 bond distance 1.01\n\
             fix drag free viscous 0.4\n\
             variable load equal {load:e}*(1-exp(-step*1e-5/0.005))\nfix load tip addforce 0 v_load 0\nthermo 10000"
        )
        .unwrap();
        // `processors` must precede the creation of the box.
        script =
            script.replacen("processors * 1 1\n", "", 1).replacen("newton off\n", "newton off\nprocessors * 1 1\n", 1);
        script.push_str(&dump_for(host, "out.dump", 3000));
        // The bits of the first tenth tell whether they depend on the number of processors.
        writeln!(script, "run {}", if processors == 1 { 30000 } else { 3000 }).unwrap();
        run_in(host, folder.path(), &script, processors);
        let path = folder.path().join("out.dump");
        let bytes = std::fs::read(&path).unwrap();
        if processors > 1 {
            let (of, one) = alone.as_ref().unwrap();
            assert!(*of == host && one.starts_with(&bytes), "{host:?}: the result depends on the number of processors");
            assert_eq!(frames(&path).len(), 2, "{host:?}");
            continue;
        }
        let (_, end) = frames(&path).pop().unwrap();
        for (k, atom) in end.iter().enumerate() {
            let x = 2.0 * RADIUS * k as f64;
            let expected = load * x * x * (3.0 * length - x) / (6.0 * stiffness);
            assert!(
                (atom.position.y - expected).abs() <= 1e-6 * wanted,
                "{host:?}: deflection at {x} is {:e}, not {expected:e}",
                atom.position.y
            );
        }
        println!("{host:?}: tip at {:.9} of the closed form", end[count - 1].position.y / wanted);
        alone = Some((host, bytes));
    }
}

#[test]
fn bars_break_at_their_strength() {
    // Columns of a cubic lattice, stretched uniformly from the start to avoid waves.
    let (young, strength, rate, dt) = (5e9, 5e6, 1.0, 1e-6);
    let (side, height) = (3_usize, 12_usize);
    let middle = RADIUS * (height - 1) as f64;
    let atoms: Vec<Atom> = (0..side * side * height)
        .map(|k| {
            let cell = Vec3::new((k % side) as f64, (k / side % side) as f64, (k / (side * side)) as f64);
            let mut atom = Atom::resting(cell * (2.0 * RADIUS), RADIUS);
            atom.velocity.z = rate * (atom.position.z - middle);
            atom
        })
        .collect();
    let columns = (side * side) as f64;
    let area = PI * (0.5 * RADIUS).powi(2);
    let mut first: Option<(Host, Vec<u8>)> = None;
    for (host, processors) in RUNS {
        let folder = tempfile::tempdir().unwrap();
        let data = folder.path().join("bars.data");
        data_file_for(host, &data, &atoms, &[], Vec3::repeat(-0.02), Vec3::new(0.05, 0.05, 0.15));
        let mut script = head_for(host, "bars.data", "f f f", 5e-4, dt);
        let top = 2.0 * RADIUS * (height - 1) as f64;
        let speed = rate * middle;
        writeln!(
            script,
            "region low block INF INF INF INF INF 0.001 units box\nregion high block INF INF INF INF {:e} INF units box\n\
             group low region low\ngroup high region high\ngroup free subtract all low high\nfix integrate free nve/sphere\n\
             fix low low move linear 0 0 -{speed:e} units box\nfix high high move linear 0 0 {speed:e} units box\n\
             fix bonds all concordem/bond cohesive_beam young {young:e} poisson 0.2 radius_ratio 0.5 tensile_strength {strength:e} \
             bond distance 1.01\n\
             compute pull low reduce sum fz\nthermo_style custom step c_pull f_bonds f_bonds[2] f_bonds[4] f_bonds[8]\n\
             thermo_modify format float %20.15g\nthermo 1",
            top - 0.001
        )
        .unwrap();
        script.push_str(&dump_for(host, "out.dump", 100));
        script.push_str("run 1200\n");
        let rows = thermo(&run_in(host, folder.path(), &script, processors));
        let peak = rows.iter().map(|row| row[1]).fold(0.0, f64::max);
        let expected = columns * strength * area;
        // Stress increment of one step over the strength; the last force before failure is at most this far below the strength.
        let increment = rate * dt * young / strength;
        println!("{host:?}, {processors}: peak {:.6} of the strength, a step adds {increment:.6}", peak / expected);
        assert!((1.0 - 1.5 * increment..=1.0 + 1e-9).contains(&(peak / expected)), "{host:?}: {peak} {expected}");
        // Stored energy just before failure: ½σ²/E per volume of beam.
        let stored = rows.iter().map(|row| row[4]).fold(0.0, f64::max);
        let full = 0.5 * strength * strength / young * area * top * columns;
        assert!((stored / full - 1.0).abs() <= 3.0 * increment, "stored {stored} {full}");
        let end = rows.last().unwrap();
        assert!(end[3] >= columns && end[2] + end[3] == rows[0][2], "{end:?}");
        assert!(end[1].abs() < 0.5 * expected, "the bars still pull: {end:?}");
        let bytes = std::fs::read(folder.path().join("out.dump")).unwrap();
        if let Some((_, one)) = first.as_ref().filter(|(other, _)| *other == host) {
            assert!(*one == bytes, "{host:?}: the result depends on the number of processors");
        }
        first = Some((host, bytes));
    }
}
