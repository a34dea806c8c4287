//! Spheres that also have charges or dipoles, by `atom_style hybrid`: what acts on these moves them beside our contacts as beside the host's own.

use std::fmt::Write as _;
use std::path::Path;

use crate::harness::{Host, apart, run_in, tables};

const RADIUS: f64 = 0.005;
/// Forty steps amplify the rounding of another order of sums to less.
const TOLERANCE: f64 = 1e-9;

/// 27 spheres that overlap a little, of type 1 and 2 in turn.
fn spheres(host: Host) -> String {
    let units = if host == Host::Liggghts { " units box" } else { "" };
    let mut out = format!("region box block -0.05 0.05 -0.05 0.05 -0.05 0.05{units}\ncreate_box 2 box\n");
    for k in 0..27 {
        let [x, y, z] = [k % 3, k / 3 % 3, k / 9].map(|place| 0.00995 * (f64::from(place) - 1.0));
        writeln!(out, "create_atoms {} single {x:e} {y:e} {z:e}{units}", 1 + k % 2).unwrap();
    }
    out + "set group all diameter 0.01 density 2500\ngroup first type 1\ngroup second type 2\nneighbor 2e-3 bin\n\
           neigh_modify every 1 delay 0\ntimestep 1e-6\n"
}

/// The atoms at the end.
fn end(host: Host, folder: &Path, script: &str, processors: usize) -> Vec<Vec<f64>> {
    let columns = "id x y z vx vy vz omegax omegay omegaz fx fy fz tqx tqy tqz";
    let format = match host {
        Host::Liggghts => format!("format \"%d{}\"", " %.17g".repeat(15)),
        Host::Lammps => "format float %.17g".to_owned(),
    };
    let script = format!("{script}run 40\nwrite_dump all custom out.dump {columns} modify sort id {format}\n");
    run_in(host, folder, &script, processors);
    tables(&folder.join("out.dump")).pop().unwrap().1
}

/// Each of `ours` moves the atoms as `stock`, on one and two processors; `acts` has an effect.
fn compare(host: Host, head: &str, stock: &str, ours: &[&str], acts: &str, without: &str) {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for processors in [1, 2] {
        let wanted = end(host, folder, &format!("{head}{stock}{acts}"), processors);
        let calm = end(host, folder, &format!("{head}{stock}{without}"), processors);
        assert!(apart(&wanted, &calm, Some(7), RADIUS) > 1e-3, "{host:?}: no effect of {acts}");
        for styles in ours {
            let far = apart(&end(host, folder, &format!("{head}{styles}{acts}"), processors), &wanted, Some(7), RADIUS);
            assert!(far < TOLERANCE, "{host:?} on {processors}: {far:e} from stock with {styles}");
        }
    }
}

#[test]
fn charged_spheres_in_a_field() {
    let head = format!(
        "units si\natom_style hybrid granular charge\natom_modify map array sort 0 0\nboundary f f f\nnewton off\n\
         communicate single vel yes\n{}set group first charge 1e-3\nset group second charge -2e-3\n\
         fix p1 all property/global youngsModulus peratomtype 1e7 1e7\nfix p2 all property/global poissonsRatio peratomtype 0.3 0.3\n\
         fix p3 all property/global coefficientRestitution peratomtypepair 2 1 1 1 1\n\
         fix p4 all property/global coefficientFriction peratomtypepair 2 0.4 0.4 0.4 0.4\n",
        spheres(Host::Liggghts)
    );
    let model = |name: &str| format!("pair_style gran model {name} tangential off\npair_coeff * *\n");
    let ours = [
        &model("concordem/hertz"),
        "fix ours all concordem/bond none contact hertz_mindlin young 1e7 poisson 0.3 friction_coefficient 0 restitution 1\n",
    ];
    let integrate = "fix integrate all nve/sphere\n";
    let field = format!("fix field all efield 1e3 2e3 -5e2\n{integrate}");
    compare(Host::Liggghts, &head, &model("hertz"), &ours, &field, integrate);
}

/// Random numbers are those of a process, so that both run on as many.
#[test]
fn spheres_with_dipoles_diffuse() {
    let head = format!(
        "units si\natom_style hybrid sphere dipole\nboundary f f f\nnewton off\ncomm_modify vel yes\n{}\
         set group all dipole/random 4711 1e-3\n",
        spheres(Host::Lammps)
    );
    let law = "young 1e7 poisson 0.3 friction_coefficient 0 restitution 1\n";
    let stock = "pair_style granular\npair_coeff * * hertz/material 1e7 1.0 0.3 tangential linear_nohistory 0 0 damping coeff_restitution\n";
    let ours = [
        format!("pair_style concordem/hertz_mindlin\npair_coeff * * {law}"),
        format!("fix ours all concordem/bond none contact hertz_mindlin {law}"),
    ];
    let diffuse = "fix integrate all brownian/sphere 1e18 4242 gamma_t 10 gamma_r 1e-4\n";
    compare(Host::Lammps, &head, stock, &[&ours[0], &ours[1]], diffuse, "fix integrate all nve/sphere\n");
}
