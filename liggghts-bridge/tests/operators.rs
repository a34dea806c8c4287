//! Results that LIGGGHTS and LAMMPS compute from the bond forces, compared with our operators on the same state.

use std::fmt::Write as _;

use crate::harness::{Atom, Dice, Host, data_file_for, dump_for, frames, head_for, run_in, tables, thermo};
use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::stress::{ParticleVolume, Partition, axial, particle_stress, region_stress};
use concordem_operator::{ContactSet, LoadSet, Region, Truncation, couple_stress};

const VOLUME: f64 = 7e-5;
const CENTROID: [f64; 3] = [0.02, 0.021, 0.045];

/// A perturbed block of 5 × 5 × 10 moving spheres of different sizes.
fn block() -> Vec<Atom> {
    let mut dice = Dice(5);
    (0..5 * 5 * 10_usize)
        .map(|k| {
            let place = Vec3::new((k % 5) as f64, (k / 5 % 5) as f64, (k / 25) as f64) * 0.0098;
            let mut atom = Atom::resting(place + dice.vector() * 3e-4, 0.005 * (0.9 + 0.2 * dice.roll()));
            atom.velocity = Vec3::new(0.0, 0.0, 3.0 * place.z) + dice.vector() * 0.5;
            atom.spin = dice.vector() * 50.0;
            atom
        })
        .collect()
}

#[test]
#[expect(clippy::too_many_lines, reason = "one comparison, step by step")]
fn stress_and_couple_stress_match_the_operators() {
    let folder = tempfile::tempdir().unwrap();
    let atoms = block();
    let radius: Vec<f64> = atoms.iter().map(|atom| atom.radius).collect();
    for (host, processors) in
        [(Host::Liggghts, 1), (Host::Liggghts, 2), (Host::Liggghts, 4), (Host::Lammps, 1), (Host::Lammps, 2)]
    {
        data_file_for(
            host,
            &folder.path().join("block.data"),
            &atoms,
            &[],
            Vec3::repeat(-0.03),
            Vec3::new(0.08, 0.08, 0.14),
        );
        let mut script = head_for(host, "block.data", "f f f", 5e-4, 1e-6);
        let columns = |name: &str, range: std::ops::RangeInclusive<usize>| {
            " ".to_owned() + &range.map(|k| format!("{name}[{k}]")).collect::<Vec<_>>().join(" ")
        };
        let format = |columns: usize, first: &str| match host {
            Host::Liggghts => format!("format \"{first}{}\"", " %.17g".repeat(columns)),
            Host::Lammps => "format float %.17g".to_owned(),
        };
        writeln!(
            script,
            "fix integrate all nve/sphere\n\
             fix bonds all concordem/bond cohesive_beam young 5e9 poisson 0.2 radius_ratio 0.6 tensile_strength 2e7 bond distance 1.3 \
             contact hertz_mindlin contact.young 1e9 contact.poisson 0.2 contact.friction_coefficient 0.4 contact.restitution 0.7\n\
             compute rows all concordem/bond/local bonds\n\
             compute point all concordem/stress/atom bonds\n\
             compute half all concordem/stress/atom bonds partition half-branch volume packing 0.62\n\
             compute couple all concordem/couple bonds volume {VOLUME:e} centroid {} {} {}\n\
             dump rows all local 40 rows.dump{}\ndump_modify rows {}\n\
             dump stress all custom 40 stress.dump id{}{}\ndump_modify stress sort id {}\n\
             thermo_style custom step{}\nthermo 40\nthermo_modify format float %20.16g",
            CENTROID[0],
            CENTROID[1],
            CENTROID[2],
            columns("c_rows", 1..=11),
            format(10, "%.17g"),
            columns("c_point", 1..=9),
            columns("c_half", 1..=9),
            format(18, "%d"),
            columns("c_couple", 1..=18),
        )
        .unwrap();
        script.push_str(&dump_for(host, "out.dump", 40));
        script.push_str("run 120\n");
        let printed = run_in(host, folder.path(), &script, processors);
        let global = thermo(&printed);
        let stresses = tables(&folder.path().join("stress.dump"));
        let rows = tables(&folder.path().join("rows.dump"));
        let moved = frames(&folder.path().join("out.dump"));
        assert_eq!((global.len(), rows.len(), stresses.len()), (4, 4, 4));
        for (((step, atoms), (_, rows)), ((_, stresses), global)) in
            moved.iter().zip(&rows).zip(stresses.iter().zip(&global)).skip(1)
        {
            let position: Vec<Vec3> = atoms.iter().map(|atom| atom.position).collect();
            let vector = |row: &[f64], k: usize| Vec3::new(row[k], row[k + 1], row[k + 2]);
            let pair: Vec<[u32; 2]> = rows.iter().map(|row| [row[0] as u32 - 1, row[1] as u32 - 1]).collect();
            let branch: Vec<Vec3> = pair.iter().map(|p| position[p[1] as usize] - position[p[0] as usize]).collect();
            let force: Vec<Vec3> = rows.iter().map(|row| vector(row, 2)).collect();
            let moment: Vec<Vec3> = rows.iter().map(|row| vector(row, 5)).collect();
            let point: Vec<Vec3> = rows.iter().map(|row| vector(row, 8)).collect();
            assert!(pair.len() > 500);
            let contacts = ContactSet::new(&position, &pair, &branch, &point, &force, Some(&moment)).unwrap();
            let close = |found: &[f64], expected: &Mat3, size: f64, what: &str| {
                let worst = (Mat3::from_row_slice(found) - expected).norm() / size;
                // Tolerance: the same terms are summed in another order.
                assert!(worst <= 1e-12, "{host:?}, {processors}, step {step}, {what}: {worst:e}");
            };
            for (first, partition, volume) in [
                (1, Partition::ContactPoint, ParticleVolume::Sphere),
                (10, Partition::HalfBranch, ParticleVolume::Packing(0.62)),
            ] {
                let expected =
                    particle_stress(&contacts, &LoadSet::none(), partition, &volume.of(&radius).unwrap()).unwrap();
                let size = expected.iter().map(Mat3::norm).fold(0.0, f64::max);
                for (row, expected) in stresses.iter().zip(&expected) {
                    close(&row[first..first + 9], expected, size, "stress of an atom");
                }
            }
            let expected = region_stress(&contacts, &Region::All { volume: VOLUME }, Truncation::BranchClipped, None)
                .unwrap()
                .stress;
            let size: f64 = branch.iter().zip(&force).map(|(l, f)| l.norm() * f.norm()).sum::<f64>() / VOLUME;
            close(&global[10..19], &expected, size, "stress");
            let couple = couple_stress::internal(&contacts, VOLUME, &Vec3::from(CENTROID)).unwrap();
            close(&global[1..10], &couple, size * 0.1, "couple stress");
            assert!(couple.norm() > 0.0 && axial(&expected).norm() > 0.0);
        }
    }
}

#[test]
fn liggghts_pressure_includes_the_virial_of_bonds() {
    let folder = tempfile::tempdir().unwrap();
    data_file_for(
        Host::Liggghts,
        &folder.path().join("block.data"),
        &block(),
        &[],
        Vec3::repeat(-0.03),
        Vec3::new(0.08, 0.08, 0.14),
    );
    let volume = 0.11 * 0.11 * 0.17;
    for processors in [1, 2] {
        let mut script = head_for(Host::Liggghts, "block.data", "f f f", 5e-4, 1e-6);
        writeln!(
            script,
            "fix integrate all nve/sphere\n\
             fix bonds all concordem/bond cpm young 1e9 shear_ratio 0.3 cohesion 4e6 friction_coefficient 0.8 crack_onset_strain 1e-3 \
             relative_ductility 4 bond distance 1.4 contact cpm\n\
             compute couple all concordem/couple bonds volume {volume:e} centroid 0 0 0\n\
             compute p all pressure thermo_temp virial\ncompute s all stress/atom virial\n\
             compute t all reduce sum c_s[1] c_s[2] c_s[3] c_s[4] c_s[5] c_s[6]\n\
             thermo_style custom step c_p[1] c_p[2] c_p[3] c_p[4] c_p[5] c_p[6] c_couple[10] c_couple[14] c_couple[18] c_couple[11] \
             c_couple[12] c_couple[15] c_t[1] c_t[2] c_t[3] c_t[4] c_t[5] c_t[6]\n\
             thermo 20\nthermo_modify format float %20.16g\nrun 60"
        )
        .unwrap();
        let rows = thermo(&run_in(Host::Liggghts, folder.path(), &script, processors));
        assert_eq!(rows.len(), 4);
        for row in &rows[1..] {
            let size = row[7..13].iter().fold(0.0f64, |size, s| size.max(s.abs()));
            assert!(size > 0.0);
            for k in 0..6 {
                // Tension is a negative pressure; stress/atom of LIGGGHTS is not divided by the volume. Tolerance: some thousand terms
                // are summed in another order.
                assert!((row[1 + k] + row[7 + k]).abs() <= 1e-12 * size, "{k}: {row:?}");
                assert!((row[13 + k] - row[7 + k] * volume).abs() <= 1e-12 * size * volume, "{k}: {row:?}");
            }
        }
    }
}

/// A run that begins where one ended reports the stress with which that one ended, dashpots included: nothing has moved. Rounding of
/// the springs alone, 1e-12 of sums of some thousand terms.
#[test]
fn a_run_begins_with_the_stress_that_the_last_one_ended_with() {
    let folder = tempfile::tempdir().unwrap();
    let atoms = block();
    for host in [Host::Liggghts, Host::Lammps] {
        let file = folder.path().join("block.data");
        data_file_for(host, &file, &atoms, &[], Vec3::repeat(-0.03), Vec3::new(0.08, 0.08, 0.14));
        let mut script = head_for(host, "block.data", "f f f", 5e-4, 1e-6);
        writeln!(
            script,
            "fix integrate all nve/sphere\n\
             fix bonds all concordem/bond linear_bond normal_stiffness 1e6 shear_stiffness 4e5 damping_ratio 0.3 bond distance 1.3 \
             contact hertz_mindlin contact.young 1e9 contact.poisson 0.2 contact.friction_coefficient 0.4 contact.restitution 0.5\n\
             compute couple all concordem/couple bonds volume {VOLUME:e} centroid 0 0 0\n\
             thermo_style custom step c_couple[10] c_couple[14] c_couple[18] c_couple[11] c_couple[15]\n\
             thermo 40\nthermo_modify format float %20.16g\nrun 40\nrun 40"
        )
        .unwrap();
        let rows = thermo(&run_in(host, folder.path(), &script, 1));
        let at_seam: Vec<_> = rows.iter().filter(|row| row[0] == 40.0).collect();
        assert_eq!(at_seam.len(), 2, "{host:?}: {rows:?}");
        let size = at_seam[0][1..].iter().fold(0.0_f64, |size, s| size.max(s.abs()));
        let error = at_seam[0].iter().zip(at_seam[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size;
        println!("{host:?}: the stress at the seam differs by {error:.1e}");
        assert!(size > 0.0 && error < 1e-12, "{host:?}: {error:e}");
    }
}
