//! Arguments that the shim passes to the bonded engine, and their conversion to Rust types.

#![allow(unsafe_code)] // pointers from the shim

use std::ffi::{CStr, c_char};

use concordem_c_abi::slice;
use concordem_contact::law::cpm::{CpmFormulation, CpmParameters, DamageLaw, friction_of_yade};
use concordem_contact::math::Mat3;
use concordem_solver::state::Cell;

use crate::assembly::{Bodies, Contacts, Origin, PairParameters, STORED, cell_of, motion_measure};

/// Columns of `count` bodies, see `Bodies` in `src/assembly/concrete.rs`. Vectors have three reals, orientations four.
#[repr(C)]
#[derive(Debug)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct BodyArrays {
    count: usize,
    id: *const u32,
    position: *const f64,
    velocity: *const f64,
    orientation: *const f64,
    angular_velocity: *const f64,
    radius: *const f64,
    mass: *const f64,
    inertia: *const f64,
    material: *const u32,
    constraint: *const u32,
    lost: *const u32,
}

/// Columns of `count` contacts, see `Contacts` in `src/assembly/concrete.rs`.
#[repr(C)]
#[derive(Debug)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct ContactArrays {
    count: usize,
    pair: *const u32,
    image: *const i8,
    bonded: *const u8,
    length: *const f64,
    area: *const f64,
    normal: *const f64,
    distance: *const f64,
    history: *const f64,
    radii: *const f64,
    reference_overlap: *const f64,
    stored: *const f64,
}

/// Parameters of concrete between materials `a` and `b`, as in YADE's material and law.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct PairCoefficients {
    a: u32,
    b: u32,
    young: f64,
    shear_ratio: f64,
    cohesion: f64,
    friction_angle: f64,
    crack_onset_strain: f64,
    ductility: f64,
    shear_contribution: f64,
    prestress: f64,
    omega_threshold: f64,
    soft_strain: f64,
    relative_soft_stiffness: f64,
    damage_law: i32,
    never_damage: i32,
}

/// Edges (m, as columns), deformation gradient, and velocity gradient (1/s) of the cell, in row-major order.
#[repr(C)]
#[derive(Debug)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct CellArrays {
    edges: [f64; 9],
    gradient: [f64; 9],
    rate: [f64; 9],
}

/// Counts and energies of an assembly. Energies in J: dissipated by damage, friction, and dashpots, error of the work rule, and
/// stored.
#[repr(C)]
#[derive(Debug)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct Facts {
    pub(super) particles: usize,
    pub(super) bonds: usize,
    pub(super) broken: u64,
    pub(super) steps: u64,
    pub(super) neighbor_list_rebuilds: u64,
    pub(super) dissipated: [f64; 4],
    pub(super) stored: f64,
    /// Volume of the cell in the last step, m³; 0 without a cell.
    pub(super) cell_volume: f64,
    pub(super) needs_rotation: i32,
    pub(super) threads: i32,
}

/// Concrete to take over.
#[repr(C)]
#[derive(Debug)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct ConcreteScene {
    bodies: *const BodyArrays,
    contacts: *const ContactArrays,
    /// Parameters of all pairs of materials.
    pairs: *const PairCoefficients,
    pair_count: usize,
    material_count: usize,
    /// Name of the kinematics.
    kinematics: *const c_char,
    /// Formulation of the law: yade-public, thesis, or woo.
    formulation: *const c_char,
    /// Null: not periodic.
    pub(super) cell: *const CellArrays,
    /// Time step, s.
    pub(super) dt: f64,
}

/// The scene in one step.
#[repr(C)]
#[derive(Debug)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct BondedStep {
    /// Returns 1 if particle `k` is still body `id` of the scene, else 0; called from several threads with `context`. States of deleted
    /// bodies are not read.
    pub(super) present: extern "C" fn(context: *const std::ffi::c_void, k: usize, id: u32) -> i32,
    pub(super) context: *const std::ffi::c_void,
    /// For each particle the addresses of its position, velocity, angular velocity (three reals each), and orientation (x, y, z, w).
    pub(super) states: *const [*const f64; 4],
    /// For each particle the address of the bit mask of its prescribed degrees of freedom.
    pub(super) blocked: *const *const u32,
    /// Null: not periodic.
    pub(super) cell: *const CellArrays,
    /// Stops OpenMP's waiting threads (`omp_pause_resource_all`); null if YADE does not use OpenMP.
    pub(super) pause: Option<unsafe extern "C" fn(kind: i32) -> i32>,
    /// Time step, s.
    pub(super) dt: f64,
    /// Whether to sum stored energies.
    pub(super) sample: i32,
}

/// The text at `pointer`.
///
/// # Safety
/// `pointer` must point to a zero-terminated string.
pub(super) unsafe fn text<'a>(pointer: *const c_char) -> Result<&'a str, String> {
    // SAFETY: guaranteed by the caller.
    unsafe { CStr::from_ptr(pointer) }.to_str().map_err(|error| error.to_string())
}

/// The cell, if there is one.
///
/// # Safety
/// `arrays` must be null or point to a cell.
pub(super) unsafe fn cell(arrays: *const CellArrays, dt: f64) -> Option<Cell> {
    // SAFETY: guaranteed by the caller.
    let arrays = unsafe { arrays.as_ref() }?;
    let matrix = |rows: &[f64; 9]| Mat3::from_row_slice(rows);
    Some(cell_of(matrix(&arrays.edges), matrix(&arrays.gradient), matrix(&arrays.rate), dt))
}

impl BodyArrays {
    /// Ids, masses, and moments of inertia.
    ///
    /// # Safety
    /// The columns must have `count` rows.
    pub(super) unsafe fn identity<'a>(&self) -> (&'a [u32], &'a [f64], &'a [f64]) {
        // SAFETY: guaranteed by the caller.
        unsafe { (slice(self.id, self.count), slice(self.mass, self.count), slice(self.inertia, self.count)) }
    }

    unsafe fn view<'a>(&self) -> Bodies<'a> {
        let n = self.count;
        // SAFETY: the columns have `count` rows.
        unsafe {
            Bodies {
                id: slice(self.id, n),
                position: slice(self.position.cast(), n),
                velocity: slice(self.velocity.cast(), n),
                orientation: slice(self.orientation, 4 * n),
                angular_velocity: slice(self.angular_velocity.cast(), n),
                radius: slice(self.radius, n),
                mass: slice(self.mass, n),
                inertia: slice(self.inertia, n),
                material: slice(self.material, n),
                constraint: slice(self.constraint, n),
                lost: slice(self.lost, n),
            }
        }
    }
}

impl ContactArrays {
    /// `bonded`: this object's flags as booleans.
    unsafe fn view<'a>(&self, bonded: &'a [bool]) -> Contacts<'a> {
        let n = self.count;
        // SAFETY: the columns have `count` rows.
        unsafe {
            Contacts {
                pair: slice(self.pair.cast(), n),
                image: slice(self.image.cast(), n),
                bonded,
                length: slice(self.length, n),
                area: slice(self.area, n),
                normal: slice(self.normal.cast(), n),
                distance: slice(self.distance, n),
                history: slice(self.history, 11 * n),
                radii: slice(self.radii, n),
                reference_overlap: slice(self.reference_overlap, n),
                stored: slice(self.stored, STORED.len() * n),
                own: &[],
            }
        }
    }
}

impl PairCoefficients {
    fn parameters(&self, formulation: CpmFormulation) -> Result<PairParameters, String> {
        let damage_law = match self.damage_law {
            0 => DamageLaw::Linear,
            1 => DamageLaw::Exponential,
            other => return Err(format!("damLaw of a material is {other}; give 0 or 1")),
        };
        let parameters = CpmParameters {
            mode: formulation,
            damage_law,
            omega_threshold: self.omega_threshold,
            never_damage: self.never_damage != 0,
            shear_contribution: self.shear_contribution,
            soft_strain: self.soft_strain,
            relative_soft_stiffness: self.relative_soft_stiffness,
            isotropic_prestress: self.prestress,
            ..CpmParameters::new(
                self.young,
                self.shear_ratio,
                self.cohesion,
                friction_of_yade(self.friction_angle).map_err(|error| error.to_string())?,
                self.crack_onset_strain,
                self.ductility,
            )
        };
        Ok(PairParameters { a: self.a as u16, b: self.b as u16, parameters })
    }
}

/// The formulation of the concrete law with this name.
fn formulation_of(name: &str) -> Result<CpmFormulation, String> {
    match name {
        "yade-public" => Ok(CpmFormulation::YadePublic),
        "thesis" => Ok(CpmFormulation::Thesis),
        "woo" => Ok(CpmFormulation::Woo),
        other => Err(format!("mode is \"{other}\"; give \"yade-public\", \"thesis\", or \"woo\"")),
    }
}

impl ConcreteScene {
    /// Call `take` with the bodies, the contacts, and the origin of the assembly.
    ///
    /// # Safety
    /// The pointers must point to what the fields describe.
    pub(super) unsafe fn with<T>(
        &self,
        take: impl FnOnce(&Bodies<'_>, &Contacts<'_>, Origin) -> Result<T, String>,
    ) -> Result<T, String> {
        // SAFETY: guaranteed by the caller.
        unsafe {
            let contacts = &*self.contacts;
            let bonded: Vec<bool> = slice(contacts.bonded, contacts.count).iter().map(|&flag| flag != 0).collect();
            let formulation = formulation_of(text(self.formulation)?)?;
            let pairs: Result<Vec<PairParameters>, String> =
                slice(self.pairs, self.pair_count).iter().map(|pair| pair.parameters(formulation)).collect();
            let origin = Origin::Concrete {
                kinematics: motion_measure(text(self.kinematics)?)?,
                materials: self.material_count,
                damping: 0.0,
                gravity: [0.0; 3],
                pairs: pairs?,
                own: Vec::new(),
            };
            take(&(*self.bodies).view(), &contacts.view(&bonded), origin)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// YADE's materials have an angle: every formulation has its tangent with the bits of YADE, or refuses it.
    #[test]
    fn friction_has_the_bits_of_yade() {
        let pair = |friction_angle| PairCoefficients {
            a: 0,
            b: 0,
            young: 25e9,
            shear_ratio: 0.2,
            cohesion: 3e6,
            friction_angle,
            crack_onset_strain: 1e-4,
            ductility: 30.0,
            shear_contribution: 0.0,
            prestress: 0.0,
            omega_threshold: 1.0,
            soft_strain: 0.0,
            relative_soft_stiffness: 0.0,
            damage_law: 1,
            never_damage: 0,
        };
        for mode in [CpmFormulation::YadePublic, CpmFormulation::Thesis, CpmFormulation::Woo] {
            for angle in [0.0_f64, 0.3, 0.67, 0.8_f64.atan(), 1.5] {
                let found = pair(angle).parameters(mode).unwrap().parameters.friction_coefficient;
                assert_eq!(found.to_bits(), angle.tan().to_bits(), "{angle}");
            }
            for angle in [-0.1, 1.6, 3.5, f64::NAN] {
                let message = pair(angle).parameters(mode).unwrap_err();
                assert!(message.contains("an angle from 0 to below π/2 rad"), "{message}");
            }
        }
    }
}
