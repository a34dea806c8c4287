//! The stock LIGGGHTS with our styles, loaded at run time as a library and called through its C interface.
//!
//! ```no_run
//! use concordem_liggghts::driver::Liggghts;
//! let mut host = Liggghts::open("target/liggghts/libconcordem-liggghts.so".as_ref(), &["-log", "none"])?;
//! host.commands("units si\natom_style sphere\nread_data specimen.data\n")?;
//! host.run(200)?;
//! let highest = host.positions()?.iter().map(|x| x[2]).fold(f64::NEG_INFINITY, f64::max);
//! # Ok::<(), concordem_liggghts::driver::DriverError>(())
//! ```
//!
//! Views are LIGGGHTS' own arrays, borrowed from the instance, so no command can run while a view exists. On an invalid command,
//! LIGGGHTS prints a message and ends the process; run it in a separate process where that must not happen. Under MPI, every
//! process opens LIGGGHTS, issues the same commands, and sees its own atoms. A panic in one process ends all of them, because the
//! others would wait for it forever.

#![allow(unsafe_code)]

use std::ffi::{CString, c_char, c_int, c_void};
use std::marker::PhantomData;
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_NOW};

use crate::atoms::Tag;
use crate::records::{Record, width_of};

/// Why a call failed. The message gives the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DriverError {
    /// The library does not exist or cannot be loaded.
    #[error(
        "cannot load {path}: {message}; build it with `make liggghts`, which needs the Debian packages liggghts and libopenmpi-dev"
    )]
    Load {
        /// The library.
        path: PathBuf,
        /// Cause.
        message: String,
    },
    /// An instance exists already.
    #[error("LIGGGHTS is already open in this process, and MPI allows one instance at a time; drop the first one")]
    Open,
    /// A word contains a zero byte.
    #[error("`{0}` contains a zero byte, which would end the word in C; remove it")]
    ZeroByte(String),
    /// The script ends with `&`.
    #[error("the last line of the script ends with `&`, but no line follows; remove the `&` or add the line")]
    Unfinished,
    /// Atoms have no such property.
    #[error("atoms have no property `{0}`; use `atom_style sphere` and create atoms first")]
    NoProperty(&'static str),
    /// There is no such fix, or it has no such output.
    #[error("there is no fix `{0}` with this output; check the id")]
    NoFix(String),
    /// Index out of range.
    #[error("fix `{id}` has no output {index}: its vector has {length} elements, counted from 1")]
    NoNumber {
        /// The fix.
        id: String,
        /// Length of its vector; 0 if it has none.
        length: usize,
        /// The index.
        index: usize,
    },
    /// There is no such fix concordem/bond.
    #[error("there is no fix concordem/bond with id `{0}`; check the id")]
    NoBonds(String),
}

/// A bond or contact of a fix concordem/bond at the last step with output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bond {
    /// Ids of A and B, the lower one first.
    pub ids: [Tag; 2],
    /// Force on A, N.
    pub force: [f64; 3],
    /// Moment on A about the contact point, N·m.
    pub moment: [f64; 3],
    /// Contact point, m.
    pub point: [f64; 3],
    /// Length, m.
    pub length: f64,
    /// Area, m².
    pub area: f64,
    /// Damage.
    pub damage: f64,
    /// Whether it is a bond or an unbonded contact.
    pub bonded: bool,
}

type Handle = *mut c_void;

struct Interface {
    open: unsafe extern "C" fn(c_int, *mut *mut c_char, *mut Handle),
    close: unsafe extern "C" fn(Handle),
    command: unsafe extern "C" fn(Handle, *const c_char) -> *mut c_char,
    extract_global: unsafe extern "C" fn(Handle, *const c_char) -> *mut c_void,
    extract_atom: unsafe extern "C" fn(Handle, *const c_char) -> *mut c_void,
    extract_fix: unsafe extern "C" fn(Handle, *const c_char, c_int, c_int, c_int, c_int) -> *mut c_void,
    free: unsafe extern "C" fn(*mut c_void),
    fix_size: unsafe extern "C" fn(Handle, *const c_char) -> c_int,
    processes: unsafe extern "C" fn(Handle) -> c_int,
    abort: unsafe extern "C" fn(Handle),
    count: unsafe extern "C" fn(Handle) -> c_int,
    mpi: unsafe extern "C" fn(c_int) -> c_int,
    rows: unsafe extern "C" fn(Handle, *const c_char, *mut i64) -> *mut f64,
    rows_delete: unsafe extern "C" fn(*mut f64, i64),
    records: unsafe extern "C" fn(Handle, *const c_char, *mut i64, *mut i64) -> *mut f64,
    records_delete: unsafe extern "C" fn(*mut f64, i64, i64),
}

/// Loaded once and never unloaded, because MPI and LIGGGHTS keep global state beyond the life of an instance.
static INTERFACE: OnceLock<Interface> = OnceLock::new();
static IS_OPEN: AtomicBool = AtomicBool::new(false);

unsafe extern "C" {
    fn atexit(function: extern "C" fn()) -> c_int;
}

/// Runs at exit: MPI can be initialized only once per process; LIGGGHTS initializes it but does not finalize it.
extern "C" fn end_mpi() {
    if let Some(interface) = INTERFACE.get() {
        // SAFETY: does nothing unless MPI is running.
        unsafe { (interface.mpi)(1) };
    }
}

impl Interface {
    fn load(path: &Path) -> Result<Self, DriverError> {
        let failed = |message: String| DriverError::Load { path: path.to_owned(), message };
        if !path.is_file() {
            return Err(failed("there is no such file".into()));
        }
        // Some LIGGGHTS libraries use libm without linking it; a program that has not loaded libm crashes while binding them.
        // SAFETY: libm has no initialization code.
        let mathematics = unsafe { Library::open(Some("libm.so.6"), RTLD_NOW | RTLD_GLOBAL) };
        let _ = ManuallyDrop::new(mathematics.map_err(|error| failed(error.to_string()))?);
        // SAFETY: our library is loaded first, replaces some LIGGGHTS functions, and then loads LIGGGHTS; its initialization code
        // only fills LIGGGHTS' tables of styles.
        let library = unsafe { Library::open(Some(path), RTLD_NOW | RTLD_GLOBAL) };
        let library = ManuallyDrop::new(library.map_err(|error| failed(error.to_string()))?);
        macro_rules! symbol {
            ($name:literal) => {
                // SAFETY: the types match LIGGGHTS' `library.h` and `shim/library.cpp`.
                *unsafe { library.get($name) }.map_err(|error| failed(error.to_string()))?
            };
        }
        Ok(Self {
            open: symbol!(b"lammps_open_no_mpi\0"),
            close: symbol!(b"lammps_close\0"),
            command: symbol!(b"lammps_command\0"),
            extract_global: symbol!(b"lammps_extract_global\0"),
            extract_atom: symbol!(b"lammps_extract_atom\0"),
            extract_fix: symbol!(b"lammps_extract_fix\0"),
            free: symbol!(b"lammps_free\0"),
            fix_size: symbol!(b"concordem_liggghts_fix_size\0"),
            processes: symbol!(b"concordem_liggghts_processes\0"),
            abort: symbol!(b"concordem_liggghts_abort\0"),
            count: symbol!(b"lammps_get_natoms\0"),
            mpi: symbol!(b"concordem_liggghts_mpi\0"),
            rows: symbol!(b"concordem_liggghts_rows\0"),
            rows_delete: symbol!(b"concordem_liggghts_rows_delete\0"),
            records: symbol!(b"concordem_liggghts_records\0"),
            records_delete: symbol!(b"concordem_liggghts_records_delete\0"),
        })
    }
}

fn word(text: &str) -> Result<CString, DriverError> {
    CString::new(text).map_err(|_| DriverError::ZeroByte(text.replace('\0', "\\0")))
}

/// The LIGGGHTS instance of this process. It is not `Send`, because MPI must be called from one thread.
pub struct Liggghts {
    interface: &'static Interface,
    handle: Handle,
    one_thread: PhantomData<*const ()>,
}

impl Liggghts {
    /// Open LIGGGHTS with the styles of `library` (`libconcordem-liggghts.so`) and the given command-line arguments. The library is
    /// loaded on the first call in a process; later calls ignore `library`.
    pub fn open(library: &Path, arguments: &[&str]) -> Result<Self, DriverError> {
        if IS_OPEN.swap(true, Ordering::SeqCst) {
            return Err(DriverError::Open);
        }
        let opened = Self::open_first(library, arguments);
        if opened.is_err() {
            IS_OPEN.store(false, Ordering::SeqCst);
        }
        opened
    }

    fn open_first(library: &Path, arguments: &[&str]) -> Result<Self, DriverError> {
        if INTERFACE.get().is_none() {
            // No race: IS_OPEN admits one caller at a time.
            let _ = INTERFACE.set(Interface::load(library)?);
        }
        let interface = INTERFACE.get().expect("set above");
        let words = std::iter::once("liggghts").chain(arguments.iter().copied());
        let words: Vec<CString> = words.map(word).collect::<Result<_, _>>()?;
        let mut pointers: Vec<*mut c_char> = words.iter().map(|word| word.as_ptr().cast_mut()).collect();
        let mut handle = std::ptr::null_mut();
        // SAFETY: `open` copies the words, which live until it returns. `end_mpi` may run at any time.
        unsafe {
            if (interface.mpi)(0) == 0 {
                atexit(end_mpi);
            }
            (interface.open)(pointers.len() as c_int, pointers.as_mut_ptr(), &raw mut handle);
        }
        Ok(Self { interface, handle, one_thread: PhantomData })
    }

    /// Run one script command.
    pub fn command(&mut self, line: &str) -> Result<(), DriverError> {
        let line = word(line)?;
        // SAFETY: the instance exists; LIGGGHTS copies the line. No view exists, since views borrow `self`.
        unsafe { (self.interface.command)(self.handle, line.as_ptr()) };
        Ok(())
    }

    /// Run the lines of a script. As in LIGGGHTS input files, a line that ends with `&` continues on the next line, even if it is a
    /// comment. LIGGGHTS itself strips the comments.
    pub fn commands(&mut self, script: &str) -> Result<(), DriverError> {
        let mut line = String::new();
        for part in script.lines() {
            let part = part.trim_end();
            if let Some(part) = part.strip_suffix('&') {
                line.push_str(part);
                continue;
            }
            line.push_str(part);
            if !line.trim().is_empty() {
                self.command(line.trim())?;
            }
            line.clear();
        }
        if line.trim().is_empty() { Ok(()) } else { Err(DriverError::Unfinished) }
    }

    /// Run `steps` steps.
    pub fn run(&mut self, steps: u64) -> Result<(), DriverError> {
        self.command(&format!("run {steps}"))
    }

    /// Number of atoms in all processes.
    pub fn count(&self) -> usize {
        // SAFETY: the instance exists.
        unsafe { (self.interface.count)(self.handle) as usize }
    }

    /// Number of atoms owned by this process.
    pub fn owned(&self) -> usize {
        // SAFETY: `nlocal` is an int.
        unsafe {
            let number = (self.interface.extract_global)(self.handle, c"nlocal".as_ptr());
            number.cast::<c_int>().as_ref().map_or(0, |&number| number as usize)
        }
    }

    /// Pointer to an atom property.
    fn property(&self, name: &'static str) -> Result<*mut c_void, DriverError> {
        let text = word(name)?;
        // SAFETY: the instance exists; LIGGGHTS only compares the name.
        let found = unsafe { (self.interface.extract_atom)(self.handle, text.as_ptr()) };
        if found.is_null() { Err(DriverError::NoProperty(name)) } else { Ok(found) }
    }

    /// A property with three reals per atom.
    fn vectors(&self, name: &'static str) -> Result<(*mut [f64; 3], usize), DriverError> {
        let rows = self.property(name)?.cast::<*mut [f64; 3]>();
        let count = self.owned();
        // SAFETY: an array of `count` pointers to contiguous rows.
        Ok((if count == 0 { std::ptr::null_mut() } else { unsafe { *rows } }, count))
    }

    fn view(&self, name: &'static str) -> Result<&[[f64; 3]], DriverError> {
        let (rows, count) = self.vectors(name)?;
        // SAFETY: `nlocal` rows of LIGGGHTS' array. Only commands change it, and they need `&mut self`.
        Ok(if count == 0 { &[] } else { unsafe { std::slice::from_raw_parts(rows, count) } })
    }

    fn view_mut(&mut self, name: &'static str) -> Result<&mut [[f64; 3]], DriverError> {
        let (rows, count) = self.vectors(name)?;
        // SAFETY: as above; `&mut self` excludes other views.
        Ok(if count == 0 { &mut [] } else { unsafe { std::slice::from_raw_parts_mut(rows, count) } })
    }

    fn numbers<T>(&self, name: &'static str) -> Result<&[T], DriverError> {
        let numbers = self.property(name)?.cast::<T>();
        let count = self.owned();
        // SAFETY: `nlocal` numbers; the callers below give the right type.
        Ok(if count == 0 { &[] } else { unsafe { std::slice::from_raw_parts(numbers, count) } })
    }

    /// Positions of this process's atoms, m.
    pub fn positions(&self) -> Result<&[[f64; 3]], DriverError> {
        self.view("x")
    }

    /// Mutable positions, m.
    pub fn positions_mut(&mut self) -> Result<&mut [[f64; 3]], DriverError> {
        self.view_mut("x")
    }

    /// Velocities, m/s.
    pub fn velocities(&self) -> Result<&[[f64; 3]], DriverError> {
        self.view("v")
    }

    /// Mutable velocities, m/s.
    pub fn velocities_mut(&mut self) -> Result<&mut [[f64; 3]], DriverError> {
        self.view_mut("v")
    }

    /// Angular velocities, rad/s.
    pub fn spins(&self) -> Result<&[[f64; 3]], DriverError> {
        self.view("omega")
    }

    /// Mutable angular velocities, rad/s.
    pub fn spins_mut(&mut self) -> Result<&mut [[f64; 3]], DriverError> {
        self.view_mut("omega")
    }

    /// Forces of the last step, N.
    pub fn forces(&self) -> Result<&[[f64; 3]], DriverError> {
        self.view("f")
    }

    /// Torques of the last step, N·m.
    pub fn torques(&self) -> Result<&[[f64; 3]], DriverError> {
        self.view("torque")
    }

    /// Radii, m.
    pub fn radii(&self) -> Result<&[f64], DriverError> {
        self.numbers("radius")
    }

    /// Masses, kg.
    pub fn masses(&self) -> Result<&[f64], DriverError> {
        self.numbers("rmass")
    }

    /// Ids.
    pub fn ids(&self) -> Result<&[i32], DriverError> {
        self.numbers("id")
    }

    /// Types, from 1.
    pub fn types(&self) -> Result<&[i32], DriverError> {
        self.numbers("type")
    }

    /// Output of a fix: its scalar, or element `index` (from 1) of its vector. The value covers all processes, and all of them must
    /// call this.
    pub fn fix(&self, id: &str, index: Option<usize>) -> Result<f64, DriverError> {
        let text = word(id)?;
        let (kind, place) = match index {
            None => (0, 0),
            Some(index) => {
                // LIGGGHTS would read out of bounds: it does not check the index.
                // SAFETY: the instance exists; LIGGGHTS only compares the name.
                let length = unsafe { (self.interface.fix_size)(self.handle, text.as_ptr()) };
                let length = usize::try_from(length).map_err(|_| DriverError::NoFix(id.to_owned()))?;
                if !(1..=length).contains(&index) {
                    return Err(DriverError::NoNumber { id: id.to_owned(), length, index });
                }
                (1, (index - 1) as c_int)
            }
        };
        // SAFETY: the result is null, or a copy that we must free.
        unsafe {
            let found = (self.interface.extract_fix)(self.handle, text.as_ptr(), 0, kind, place, 0);
            let value = found.cast::<f64>().as_ref().copied().ok_or_else(|| DriverError::NoFix(id.to_owned()))?;
            (self.interface.free)(found);
            Ok(value)
        }
    }

    /// Bonds and contacts of a fix concordem/bond that this process counts, with their forces at the last step with output (the end
    /// of a run is always one).
    pub fn bonds(&self, id: &str) -> Result<Vec<Bond>, DriverError> {
        let text = word(id)?;
        let mut count = 0;
        // SAFETY: `count` rows, freed below.
        let rows: Vec<f64> = unsafe {
            let rows = (self.interface.rows)(self.handle, text.as_ptr(), &raw mut count);
            if rows.is_null() {
                return Err(DriverError::NoBonds(id.to_owned()));
            }
            let copy = std::slice::from_raw_parts(rows, count as usize * crate::network::Network::ROW).to_vec();
            (self.interface.rows_delete)(rows, count);
            copy
        };
        let vector = |row: &[f64], k: usize| [row[k], row[k + 1], row[k + 2]];
        let bond = |row: &[f64]| Bond {
            ids: [row[0] as Tag, row[1] as Tag],
            force: vector(row, 2),
            moment: vector(row, 5),
            point: vector(row, 8),
            length: row[11],
            area: row[12],
            damage: row[13],
            bonded: row[14] == 1.0,
        };
        Ok(rows.chunks_exact(crate::network::Network::ROW).map(bond).collect())
    }

    /// Current records of the bonds and contacts of a fix concordem/bond that this process counts: reference, previous geometry, and
    /// the history of the law. Their A is the atom that comes first in the order of the particles, not that with the lower id.
    pub fn histories(&self, id: &str) -> Result<Vec<Record>, DriverError> {
        let text = word(id)?;
        let (mut count, mut length) = (0, 0);
        // SAFETY: `count` records of `length` reals, freed below.
        let reals: Vec<f64> = unsafe {
            let reals = (self.interface.records)(self.handle, text.as_ptr(), &raw mut count, &raw mut length);
            if reals.is_null() {
                return Err(DriverError::NoBonds(id.to_owned()));
            }
            let copy = std::slice::from_raw_parts(reals, (count * length) as usize).to_vec();
            (self.interface.records_delete)(reals, count, length);
            copy
        };
        let length = length as usize;
        Ok(reals.chunks_exact(length).filter_map(|record| Record::read(record, width_of(length))).collect())
    }
}

impl Drop for Liggghts {
    /// Close LIGGGHTS. During a panic, abort all MPI processes if there are several.
    fn drop(&mut self) {
        // SAFETY: opened once, closed once; no view exists.
        unsafe {
            if std::thread::panicking() && (self.interface.processes)(self.handle) > 1 {
                (self.interface.abort)(self.handle);
            }
            (self.interface.close)(self.handle);
        }
        IS_OPEN.store(false, Ordering::SeqCst);
    }
}
