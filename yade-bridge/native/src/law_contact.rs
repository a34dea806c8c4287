//! Any law for one contact of YADE, computed from the bodies' own positions and rotations: what the generated functors call.
//!
//! A row of coefficients is made of the tables of two materials, which the functors write as TOML, as in a scenario. Motion is
//! measured by [`MotionMeasure::Finite`], as by default in the solver and in the bonded engine.

#![allow(unsafe_code)] // C functions and pointers into YADE's objects

use std::collections::HashMap;
use std::ffi::{CStr, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{LazyLock, Mutex, PoisonError};

use concordem_c_abi::{Message, guarded};
use concordem_contact::kinematics::sphere_sphere::{ImageShift, initial_geometry};
use concordem_contact::kinematics::{BranchVector, MotionMeasure, PreviousGeometry};
use concordem_contact::law::{self, ContactLaw, LawName, LawState, LawTable, Reference, RegisteredLaw, Status};
use concordem_contact::math::{Vec3, quaternion_of_rotation_vector};
use concordem_contact::step::{self, Contact, Ends, How};

use crate::body_motion::{BodyMotion, BondOutcome};

/// A body of a contact.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct LawBody {
    motion: BodyMotion,
    /// Radius, m.
    radius: f64,
    /// Mass, kg.
    mass: f64,
}

/// Motion, history, and results of one contact; SI units.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct LawContact {
    bodies: [LawBody; 2],
    /// Displacement of the second body's periodic image, m.
    shift: [f64; 3],
    /// Velocity of this displacement, m/s.
    shift_velocity: [f64; 3],
    /// Time step, s.
    dt: f64,
    /// Mean radius of the bonded spheres, m.
    mean_radius: f64,
    /// Length without strain, m, and area, m²; a length of 0 before the first step, which sets both.
    reference_length: f64,
    area: f64,
    /// Distance of the centers at the last step, m, and the direction from the first body to the second.
    length: f64,
    normal: [f64; 3],
    /// History: address of the reals of the law.
    history: *mut f64,
    /// Force on the first body, N; the second gets the opposite.
    force: [f64; 3],
    /// Torques on both bodies about their centers, N·m.
    torque: [[f64; 3]; 2],
    /// Moment on the first body about the contact point, N·m.
    moment: [f64; 3],
    /// Stiffnesses in tension and shear, N/m, bending and twist, N·m/rad.
    stiffness: [f64; 4],
    /// Stored energy, J.
    stored_energy: f64,
    /// Energies of this step, J: dissipated by damage, friction, dashpots; error of the work rule.
    damage_energy: f64,
    friction_energy: f64,
    viscous_energy: f64,
    integration_energy: f64,
}

/// A row of coefficients of some law, as a bond or as a contact.
trait Row: Send + Sync {
    /// One step of a contact. An error leaves the history unchanged.
    unsafe fn step(&self, contact: &mut LawContact) -> BondOutcome;
}

struct Bond<L>(L);
struct Unbonded<L>(L);

impl<L: ContactLaw> Row for Bond<L> {
    unsafe fn step(&self, contact: &mut LawContact) -> BondOutcome {
        // SAFETY: the caller's promise.
        unsafe { step::<L, true>(&self.0, contact) }
    }
}

impl<L: ContactLaw> Row for Unbonded<L> {
    unsafe fn step(&self, contact: &mut LawContact) -> BondOutcome {
        // SAFETY: the caller's promise.
        unsafe { step::<L, false>(&self.0, contact) }
    }
}

/// One step of a contact.
unsafe fn step<L: ContactLaw, const BONDED: bool>(law: &L, c: &mut LawContact) -> BondOutcome {
    // SAFETY: the caller's promise.
    let mut motions = unsafe { [c.bodies[0].motion.read(), c.bodies[1].motion.read()] };
    let [LawBody { radius: radius_a, mass: mass_a, .. }, LawBody { radius: radius_b, mass: mass_b, .. }] = c.bodies;
    let (shift, shift_velocity) = (Vec3::from(c.shift), Vec3::from(c.shift_velocity));
    let begins = c.reference_length <= 0.0;
    let mut previous = PreviousGeometry { normal: c.normal.into(), length: c.length };
    let mut reference = Reference { length: c.reference_length, area: c.area };
    if begins {
        let now = initial_geometry(&motions[0].position, &motions[1].position, &shift);
        if BONDED {
            // Earlier motion of the bodies does not strain the bond.
            previous = now;
            reference = Reference { length: now.length, area: law.bonded_area(radius_a, radius_b, c.mean_radius) };
        } else {
            let [a, b] = &motions;
            let moved = (b.velocity + shift_velocity - a.velocity) * c.dt;
            let before = BranchVector::of(&(b.position + shift - a.position - moved));
            previous = PreviousGeometry { normal: before.normal, length: before.length };
            reference = L::unbonded_reference(now.length, radius_a, radius_b);
        }
    }
    if !(begins && BONDED) {
        for motion in &mut motions {
            motion.rotation_increment = quaternion_of_rotation_vector(&(motion.angular_velocity * c.dt));
        }
    }
    let mut state = L::State::default();
    let width = state.as_reals().len();
    let reals: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut state));
    // SAFETY: the caller's promise: as many reals as the law's history has.
    unsafe { std::ptr::copy_nonoverlapping(c.history, reals.as_mut_ptr(), width) };
    let image = ImageShift { displacement: shift, velocity: shift_velocity, periodic: false };
    let [a, b] = &motions;
    let ends = Ends {
        motion: [a, b],
        radius: [radius_a, radius_b],
        mass: [mass_a, mass_b],
        image: &image,
        surface_displacement: None,
    };
    let before = Contact { bonded: BONDED, reference, previous, history: state };
    let stepped = step::step(law, &before, &ends, &How::new(MotionMeasure::Finite, c.dt));
    let (response, wrenches) = (stepped.response, stepped.wrenches());
    let moment = if L::TRANSMITS_MOMENT { response.moment } else { Vec3::zeros() };
    let (force, energy) = (response.force, response.energy);
    if !(force.norm_squared() + moment.norm_squared() + energy.stored()).is_finite() {
        return BondOutcome::NotANumber;
    }
    let point = stepped.point();
    let stiffness = law.stiffness(&point.geometry);
    (c.reference_length, c.area) = (reference.length, reference.area);
    (c.length, c.normal) = (point.length, point.normal.into());
    c.force = force.into();
    c.torque = [wrenches.a.torque.into(), wrenches.b.torque.into()];
    c.moment = moment.into();
    c.stiffness = [stiffness.normal, stiffness.shear, stiffness.bending, stiffness.twist];
    c.stored_energy = if response.status == Status::Lives { energy.stored() } else { 0.0 };
    c.damage_energy = energy.damage;
    c.friction_energy = energy.friction;
    c.viscous_energy = energy.viscous;
    c.integration_energy = energy.integration;
    // SAFETY: as above.
    unsafe { std::ptr::copy_nonoverlapping(response.state.as_reals().as_ptr(), c.history, width) };
    match response.status {
        Status::Lives => BondOutcome::Lives,
        Status::Broke | Status::BrokeInShear => BondOutcome::Broke,
        Status::Opened => BondOutcome::Opened,
    }
}

/// A row of coefficients of a law.
pub struct LawRow(Box<dyn Row>);

/// The table of law `L` in the text of a material. Failure of whole particles is refused, because a functor knows one contact only.
fn table<L: RegisteredLaw>(text: &str) -> Result<L::Table, String> {
    let table: L::Table = toml::from_str(text).map_err(|error| error.message().trim().replace('\n', "; "))?;
    match table.faults().first() {
        None => match table.keys_of_particles().first() {
            None => Ok(table),
            Some(key) => {
                Err(format!("functors cannot use {key}, which breaks all bonds of a particle; use BondedEngine_Rust"))
            }
        },
        Some(fault) => Err(format!(
            "{}{}{}: {}",
            fault.key,
            if fault.key.is_empty() { "" } else { " " },
            fault.message,
            fault.help
        )),
    }
}

fn row<L: RegisteredLaw>(bonded: bool, one: &str, two: &str) -> Result<LawRow, String> {
    let (a, b) = (table::<L>(one)?, table::<L>(two)?);
    let row: Box<dyn Row> = if bonded {
        Box::new(Bond(L::row(&a, &b).map_err(|error| error.to_string())?))
    } else {
        Box::new(Unbonded(L::unbonded_row(&a, &b).map_err(|error| error.to_string())?))
    };
    Ok(LawRow(row))
}

macro_rules! rows {
    ($($key:ident: $Law:ident,)*) => {
        /// The row of `law` between two materials.
        fn row_of(law: LawName, bonded: bool, one: &str, two: &str) -> Result<LawRow, String> {
            match law {
                $(LawName::$Law => row::<law::$key::$Law>(bonded, one, two),)*
            }
        }
    };
}
concordem_contact::for_each_law!(rows);

/// Law, whether it is a bond, and the texts of both materials.
type RowKey = (LawName, bool, String, String);

/// All rows so far. They are few: as many as pairs of materials, whose attributes a script changes rarely.
static ROWS: LazyLock<Mutex<HashMap<RowKey, &'static LawRow>>> = LazyLock::new(Mutex::default);

/// The row of `law` between two materials, whose tables are TOML; it lives as long as the program. Null and a message if it cannot
/// be made.
///
/// # Safety
/// `law`, `one`, and `two` must be strings that end in zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_law_row(
    law: *const c_char,
    bonded: i32,
    one: *const c_char,
    two: *const c_char,
    message: *const Message,
) -> *const LawRow {
    let mut found = std::ptr::null();
    // SAFETY: the caller's promise.
    unsafe {
        let text = |text: *const c_char| CStr::from_ptr(text).to_string_lossy().into_owned();
        guarded(message, || {
            let (law, one, two) = (text(law), text(one), text(two));
            let name = LawName::of_key(&law).ok_or_else(|| format!("there is no law `{law}`"))?;
            let key = (name, bonded != 0, one, two);
            let mut rows = ROWS.lock().unwrap_or_else(PoisonError::into_inner);
            let row = if let Some(row) = rows.get(&key) {
                *row
            } else {
                let row: &'static LawRow = Box::leak(Box::new(row_of(name, key.1, &key.2, &key.3)?));
                rows.insert(key, row);
                row
            };
            found = std::ptr::from_ref(row);
            Ok::<_, String>(0)
        });
    }
    found
}

/// One step of a contact.
///
/// # Safety
/// `row` must come from [`concordem_yade_law_row`]; the addresses in `contact` must be those of living bodies and of a history of
/// this law.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_law_step(row: *const LawRow, contact: *mut LawContact) -> BondOutcome {
    // SAFETY: the caller's promise.
    let (row, contact) = unsafe { (&*row, &mut *contact) };
    catch_unwind(AssertUnwindSafe(|| unsafe { row.0.step(contact) })).unwrap_or(BondOutcome::Internal)
}
