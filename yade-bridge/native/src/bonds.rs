//! The bonded engine behind C functions: an [`Assembly`] that the shim fills, asks, and keeps.
//!
//! Every function that can fail returns a negative number and leaves a message; none unwinds into C++.

#![allow(unsafe_code, clippy::missing_safety_doc)]

use std::ffi::{CStr, c_char};

use concordem_contact::law::cpm::{CpmFormulation, CpmParameters, DamageLaw};
use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::stress::{ParticleVolume, Partition, particle_stress, region_stress};
use concordem_operator::{LoadSet, Region, Truncation};
use concordem_solver::forces::EvaluatedContacts;
use concordem_solver::state::Cell;
use concordem_solver::state::contacts::ContactFlags;

use crate::assembly::{Assembly, Bodies, Contacts, Given, Origin, PAUSE_SOFT, PauseThreads, Row, cell_of, mode_of};
use crate::guard::{Message, guarded};
use concordem_contact::prefetch::{AHEAD, prefetch};

/// Bonds of a scene, with the threads that find their forces.
pub struct Bonds {
    assembly: Assembly,
    pool: rayon::ThreadPool,
}

/// [`Bodies`] as pointers.
#[repr(C)]
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
}

/// [`Contacts`] as pointers.
#[repr(C)]
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
}

/// Parameters of concrete between two materials, as YADE's material and law have them.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct RowValues {
    a: u32,
    b: u32,
    young: f64,
    shear_ratio: f64,
    cohesion: f64,
    friction_angle: f64,
    crack_onset: f64,
    ductility: f64,
    shear_contribution: f64,
    prestress: f64,
    omega_threshold: f64,
    soft_strain: f64,
    relative_soft_stiffness: f64,
    damage_law: i32,
    never_damage: i32,
}

/// Edges, deformation gradient, velocity gradient of the cell, row by row.
#[repr(C)]
pub struct CellArrays {
    edges: [f64; 9],
    gradient: [f64; 9],
    rate: [f64; 9],
}

/// Numbers of an assembly.
#[repr(C)]
pub struct Facts {
    particles: usize,
    bonds: usize,
    broken: u64,
    steps: u64,
    searches: u64,
    dissipated: [f64; 4],
    stored: f64,
    needs_rotation: i32,
    threads: i32,
}

unsafe fn slice<'a, T>(pointer: *const T, length: usize) -> &'a [T] {
    // SAFETY: the shim passes arrays of this length, or of none.
    if pointer.is_null() || length == 0 { &[] } else { unsafe { std::slice::from_raw_parts(pointer, length) } }
}

unsafe fn text<'a>(pointer: *const c_char) -> Result<&'a str, String> {
    // SAFETY: the shim passes strings that end with a zero.
    unsafe { CStr::from_ptr(pointer) }.to_str().map_err(|error| error.to_string())
}

unsafe fn cell(arrays: *const CellArrays, dt: f64) -> Option<Cell> {
    // SAFETY: null or a cell.
    let arrays = unsafe { arrays.as_ref() }?;
    let matrix = |rows: &[f64; 9]| Mat3::from_row_slice(rows);
    Some(cell_of(matrix(&arrays.edges), matrix(&arrays.gradient), matrix(&arrays.rate), dt))
}

unsafe fn bodies<'a>(arrays: &BodyArrays) -> Bodies<'a> {
    let n = arrays.count;
    // SAFETY: the shim's arrays have `count` rows.
    unsafe {
        Bodies {
            id: slice(arrays.id, n),
            position: slice(arrays.position.cast(), n),
            velocity: slice(arrays.velocity.cast(), n),
            orientation: slice(arrays.orientation, 4 * n),
            angular_velocity: slice(arrays.angular_velocity.cast(), n),
            radius: slice(arrays.radius, n),
            mass: slice(arrays.mass, n),
            inertia: slice(arrays.inertia, n),
            material: slice(arrays.material, n),
            constraint: slice(arrays.constraint, n),
        }
    }
}

impl RowValues {
    fn row(&self, mode: CpmFormulation) -> Result<Row, String> {
        let damage_law = match self.damage_law {
            0 => DamageLaw::Linear,
            1 => DamageLaw::Exponential,
            other => return Err(format!("damLaw of a material is {other}; it may be 0 or 1")),
        };
        let parameters = CpmParameters {
            mode,
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
                self.friction_angle,
                self.crack_onset,
                self.ductility,
            )
        };
        Ok(Row { a: self.a as u16, b: self.b as u16, parameters })
    }
}

fn law_mode(name: &str) -> Result<CpmFormulation, String> {
    match name {
        "yade-public" => Ok(CpmFormulation::YadePublic),
        "thesis" => Ok(CpmFormulation::Thesis),
        "woo" => Ok(CpmFormulation::Woo),
        other => Err(format!("mode is \"{other}\"; it may be \"yade-public\", \"thesis\", \"woo\"")),
    }
}

/// An assembly with threads, behind a pointer.
unsafe fn boxed(message: *const Message, threads: i32, make: impl FnOnce() -> Result<Assembly, String>) -> *mut Bonds {
    let mut made = std::ptr::null_mut();
    // SAFETY: the message is the shim's.
    unsafe {
        guarded(message, || {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.max(1) as usize).build();
            let pool = pool.map_err(|error| format!("cannot start {threads} threads: {error}"))?;
            let assembly = make()?;
            made = Box::into_raw(Box::new(Bonds { assembly, pool }));
            Ok::<_, String>(0)
        });
    }
    made
}

/// Concrete taken over from the scene; null and a message if it cannot be.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_concrete(
    body_arrays: *const BodyArrays,
    contacts: *const ContactArrays,
    rows: *const RowValues,
    row_count: usize,
    materials: usize,
    kinematics: *const c_char,
    mode: *const c_char,
    cell_arrays: *const CellArrays,
    dt: f64,
    threads: i32,
    message: *const Message,
) -> *mut Bonds {
    // SAFETY: the shim's arrays, of the lengths it says.
    unsafe {
        boxed(message, threads, || {
            let c = &*contacts;
            let n = c.count;
            let flags = slice(c.bonded, n);
            let bonded: Vec<bool> = flags.iter().map(|&flag| flag != 0).collect();
            let contacts = Contacts {
                pair: slice(c.pair.cast(), n),
                image: slice(c.image.cast(), n),
                bonded: &bonded,
                length: slice(c.length, n),
                area: slice(c.area, n),
                normal: slice(c.normal.cast(), n),
                distance: slice(c.distance, n),
                history: slice(c.history, 11 * n),
            };
            let mode = law_mode(text(mode)?)?;
            let rows: Result<Vec<Row>, String> = slice(rows, row_count).iter().map(|row| row.row(mode)).collect();
            let origin = Origin::Concrete {
                kinematics: mode_of(text(kinematics)?)?,
                materials,
                damping: 0.0,
                gravity: [0.0; 3],
                rows: rows?,
            };
            Assembly::concrete(&bodies(&*body_arrays), &contacts, origin, cell(cell_arrays, dt), dt)
        })
    }
}

/// Bonds of a scenario between bodies of the scene; of `bodies`, only id, mass, and inertia are read.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_scenario(
    scenario: *const c_char,
    body_arrays: *const BodyArrays,
    dt: f64,
    threads: i32,
    message: *const Message,
) -> *mut Bonds {
    // SAFETY: the shim's arrays, of the lengths it says.
    unsafe {
        boxed(message, threads, || {
            let all = &*body_arrays;
            let n = all.count;
            Assembly::of_text(text(scenario)?, slice(all.id, n), slice(all.mass, n), slice(all.inertia, n), dt)
        })
    }
}

/// What [`concordem_yade_bonds_words`] gave.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_load(
    words: *const i32,
    count: usize,
    threads: i32,
    message: *const Message,
) -> *mut Bonds {
    // SAFETY: the shim's array.
    unsafe { boxed(message, threads, || Assembly::from_words(slice(words, count))) }
}

/// The end of an assembly.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_delete(bonds: *mut Bonds) {
    if !bonds.is_null() {
        // SAFETY: made here, deleted once.
        drop(unsafe { Box::from_raw(bonds) });
    }
}

/// Everything as words, given to `take` (with `context`) once; 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_words(
    bonds: *const Bonds,
    take: extern "C" fn(*mut std::ffi::c_void, *const i32, usize),
    context: *mut std::ffi::c_void,
    message: *const Message,
) -> i64 {
    // SAFETY: the shim's own.
    unsafe {
        guarded(message, || {
            let words = (*bonds).assembly.to_words()?;
            take(context, words.as_ptr(), words.len());
            Ok::<_, String>(0)
        })
    }
}

/// Numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_facts(bonds: *const Bonds, facts: *mut Facts) {
    // SAFETY: the shim's own.
    unsafe {
        let Bonds { assembly: a, pool } = &*bonds;
        *facts = Facts {
            particles: a.state.particles.len(),
            bonds: a.state.bond_count(),
            broken: a.broken,
            steps: a.state.clock.step,
            searches: a.solver.neighbor_rebuilds(),
            dissipated: a.dissipated,
            stored: a.stored,
            needs_rotation: i32::from(a.needs_rotation),
            threads: pool.current_num_threads() as i32,
        };
    }
}

/// Ids of the bodies, in the order of the particles; as many as `Facts::particles`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_ids(bonds: *const Bonds) -> *const u32 {
    // SAFETY: the shim's own.
    unsafe { (*bonds).assembly.state.particles.id.as_ptr() }
}

/// Forces and torques of the last step, three reals for each particle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_forces(
    bonds: *const Bonds,
    force: *mut *const f64,
    torque: *mut *const f64,
) {
    // SAFETY: the shim's own.
    unsafe {
        let solver = &(*bonds).assembly.solver;
        *force = solver.forces().as_ptr().cast();
        *torque = solver.torques().as_ptr().cast();
    }
}

/// One step at the places and with the motion that `states` points to: for each particle the addresses of three, three,
/// three, and four reals (position, velocity, angular velocity, orientation x, y, z, w); `blocked` to its prescribed degrees
/// of freedom ([`Constraint`](concordem_solver::state::Constraint)). They are read only if `present` (with `context`) says, to any
/// thread, that they are still those of the particle's body. `pause`: OpenMP's function for [`Assembly::wants_room`], or null.
/// How many bonds broke, or −1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_step(
    bonds: *mut Bonds,
    present: extern "C" fn(*const std::ffi::c_void, usize, u32) -> i32,
    context: *const std::ffi::c_void,
    states: *const [*const f64; 4],
    blocked: *const *const u32,
    dt: f64,
    cell_arrays: *const CellArrays,
    sample: i32,
    pause: Option<PauseThreads>,
    message: *const Message,
) -> i64 {
    // SAFETY: as many rows as particles; each address is that of a living state of the scene.
    unsafe {
        guarded(message, || {
            let Bonds { assembly, pool } = &mut *bonds;
            if let Some(pause) = pause.filter(|_| assembly.wants_room(pool.current_num_threads())) {
                pause(PAUSE_SOFT);
            }
            let count = assembly.state.particles.len();
            // As addresses: several threads read what they point to, and nobody writes meanwhile.
            let (states, blocked) = (slice(states.cast::<[usize; 4]>(), count), slice(blocked.cast::<usize>(), count));
            let (rotation, constraint) = (assembly.needs_rotation, assembly.needs_constraint);
            let cell = cell(cell_arrays, dt);
            let context = context as usize;
            let broken = pool.install(|| {
                assembly.take_motions(dt, |k, body| {
                    if present(context as *const std::ffi::c_void, k, body) == 0 {
                        return Err(format!(
                            "body {body} is gone or was replaced; its bonds cannot go on. release() the engine first"
                        ));
                    }
                    if let Some(next) = states.get(k + AHEAD) {
                        next[..if rotation { 4 } else { 3 }].iter().for_each(|&address| prefetch(address));
                    }
                    let [position, velocity, spin, orientation] = states[k];
                    let vector = |address: usize| Vec3::from(*(address as *const [f64; 3]));
                    Ok(Given {
                        position: vector(position),
                        velocity: vector(velocity),
                        angular_velocity: vector(spin),
                        orientation: if rotation { *(orientation as *const [f64; 4]) } else { [0.0; 4] },
                        constraint: if constraint { *(blocked[k] as *const u32) } else { 0 },
                    })
                })?;
                assembly.find_forces(dt, cell, sample != 0)
            })?;
            Ok::<_, String>(broken as i64)
        })
    }
}

/// Sum of branch times force over all contacts at the present places, J, row by row (index of the branch first).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_virial(
    bonds: *mut Bonds,
    virial: *mut [f64; 9],
    message: *const Message,
) -> i64 {
    // SAFETY: nine reals.
    unsafe {
        guarded(message, || {
            let Bonds { assembly, pool } = &mut *bonds;
            let forces =
                pool.install(|| assembly.solver.record(&mut assembly.state)).map_err(|error| error.to_string())?;
            let contacts = forces.contacts.set(&assembly.state.particles).map_err(|error| error.to_string())?;
            // Over a volume of 1 the stress is the sum.
            let all = Region::All { volume: 1.0 };
            let sum =
                region_stress(&contacts, &all, Truncation::BranchClipped, None).map_err(|error| error.to_string())?;
            *virial = row_by_row(&sum.stress);
            Ok::<_, String>(0)
        })
    }
}

fn row_by_row(tensor: &Mat3) -> [f64; 9] {
    std::array::from_fn(|k| tensor[(k / 3, k % 3)])
}

/// Share of its strength that a bond has lost: `1 − (1−ω)κ/ε₀` of concrete as YADE has it, the damage of other laws.
fn strength_lost(block: &dyn EvaluatedContacts, k: usize, crack_onset: f64) -> f64 {
    let (fields, reals) = block.history_reals();
    let at = |name: &str| fields.iter().take_while(|f| f.name != name).map(|f| f.components).sum::<usize>();
    let width: usize = fields.iter().map(|f| f.components).sum();
    if fields.iter().all(|f| f.name != "kappa") {
        return block.damage(k);
    }
    let (kappa, omega) = (reals[k * width + at("kappa")], reals[k * width + at("omega")]);
    if kappa < crack_onset { 0.0 } else { 1.0 - (1.0 - omega) * kappa / crack_onset }
}

/// What `CpmState` shows: by particle the mean loss of strength of its links, lost ones included (1), links lost, and mean
/// stress (Pa, row by row, symmetric) over the sphere's volume at a packing fraction of 0.62, half of each branch on either
/// side. As many rows as particles.
#[allow(clippy::needless_range_loop)] // over particles, in several arrays
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_particles(
    bonds: *mut Bonds,
    crack_onset: f64,
    damage: *mut f64,
    lost: *mut u32,
    stress_of: *mut [f64; 9],
    message: *const Message,
) -> i64 {
    // SAFETY: as many entries as particles in each array.
    unsafe {
        guarded(message, || {
            let Bonds { assembly, pool } = &mut *bonds;
            let forces =
                pool.install(|| assembly.solver.record(&mut assembly.state)).map_err(|error| error.to_string())?;
            let state = &assembly.state;
            let count = state.particles.len();
            let (mut links, mut sums) = (vec![0_u32; count], vec![0.0; count]);
            for block in &state.bonds {
                for k in 0..block.len() {
                    let view = block.view(k);
                    if view.flags.has(ContactFlags::BROKEN) {
                        continue;
                    }
                    let of_strength = strength_lost(&**block, k, crack_onset);
                    for p in [view.pair.a, view.pair.b] {
                        links[p as usize] += 1;
                        sums[p as usize] += of_strength;
                    }
                }
            }
            let contacts = forces.contacts.set(&state.particles).map_err(|error| error.to_string())?;
            let stress = ParticleVolume::Packing(0.62)
                .of(&state.particles.radius)
                .and_then(|volumes| particle_stress(&contacts, &LoadSet::none(), Partition::HalfBranch, &volumes))
                .map_err(|error| error.to_string())?;
            for p in 0..count {
                let broken = assembly.losses[p];
                let total = links[p] + broken;
                *damage.add(p) = if total > 0 { (sums[p] + f64::from(broken)) / f64::from(total) } else { 0.0 };
                *lost.add(p) = broken;
                *stress_of.add(p) = row_by_row(&((stress[p] + stress[p].transpose()) * 0.5));
            }
            Ok::<_, String>(0)
        })
    }
}
