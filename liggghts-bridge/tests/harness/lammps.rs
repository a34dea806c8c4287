//! Laws and a specimen for LAMMPS.

use std::path::Path;

use concordem_contact::math::Vec3;

use super::{Host, bar, data_file_for};

pub const DT: f64 = 5e-7;
pub const LAW: &str = "cpm young 30e9 shear_ratio 0.2 cohesion 4.5e6 friction_coefficient 0.8 crack_onset_strain 1.5e-4 \
                   relative_ductility 4 omega_threshold 0.99";
pub const BEAM: &str = "cohesive_beam young 5e9 poisson 0.2 radius_ratio 0.6 tensile_strength 5e6";

/// Write the bar without bonds (`bar.data`) and with bonds in the atoms' lists (`bonded.data`); returns the number of bonds.
pub fn write_bar(folder: &Path) -> usize {
    let (atoms, bonds) = bar();
    let (low, high) = (Vec3::repeat(-0.03), Vec3::new(0.08, 0.08, 0.18));
    data_file_for(Host::Lammps, &folder.join("bar.data"), &atoms, &[], low, high);
    data_file_for(Host::Lammps, &folder.join("bonded.data"), &atoms, &bonds, low, high);
    bonds.len()
}

pub const LINEAR: &str = "normal_stiffness 2e5 shear_stiffness 1e5 friction_coefficient 0.3 damping_ratio 0.1";
