//! The stock LIGGGHTS with our styles as a library of this process, through its C library interface, loaded at run time.
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
//! Views are LIGGGHTS' own arrays, borrowed from the instance: no command can run while one is held. LIGGGHTS answers wrong
//! commands by ending the process with a message; where that must not happen, give it a process of its own. Under MPI every
//! process opens LIGGGHTS, gives the same commands, and sees its own atoms. One that panics ends them all: the others would
//! wait for it for ever.

#![allow(unsafe_code)]

use std::ffi::{CString, c_char, c_int, c_void};
use std::marker::PhantomData;
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_NOW};

use crate::records::{Record, width_of};

/// Why LIGGGHTS cannot do what was asked. The message says what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DriverError {
    /// The library is not there or cannot be loaded.
    #[error(
        "cannot load {path}: {message}; build it with `make liggghts`, which needs Debian's packages liggghts and libopenmpi-dev"
    )]
    Load {
        /// The library.
        path: PathBuf,
        /// Why not.
        message: String,
    },
    /// There is an instance already.
    #[error("LIGGGHTS is open already in this process, and MPI serves one instance at a time: drop the first one")]
    Open,
    /// A word with a zero byte in it.
    #[error("`{0}` has a zero byte in it, which ends a word in C; remove it")]
    ZeroByte(String),
    /// A script that ends with `&`.
    #[error("the script ends in the middle of a line: its last line ends with `&`")]
    Unfinished,
    /// Atoms have no such property.
    #[error("atoms have no `{0}`: is there an `atom_style sphere`, and were atoms made?")]
    NoProperty(&'static str),
    /// A fix without that output.
    #[error("there is no fix `{0}` with that output")]
    NoFix(String),
    /// A place beyond a fix's vector.
    #[error("the vector of fix `{id}` has {length} numbers, counted from 1: there is no number {index}")]
    NoNumber {
        /// The fix.
        id: String,
        /// Numbers in its vector; 0 if it has none.
        length: usize,
        /// What was asked for.
        index: usize,
    },
    /// No bonds under that name.
    #[error("there is no fix concordem/bond of id `{0}`")]
    NoBonds(String),
}

/// A bond or contact of a fix concordem/bond, as it was at the last step with output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bond {
    /// Ids of A and B.
    pub ids: [i32; 2],
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
    /// Whether it is a bond; else a contact.
    pub bonded: bool,
}

type Handle = *mut c_void;

/// The functions of the interface.
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

/// Loaded once and never unloaded: MPI and LIGGGHTS leave things behind that outlive an instance.
static INTERFACE: OnceLock<Interface> = OnceLock::new();
static IS_OPEN: AtomicBool = AtomicBool::new(false);

unsafe extern "C" {
    fn atexit(function: extern "C" fn()) -> c_int;
}

/// MPI can be started once in a process; LIGGGHTS starts it and leaves it to us to end it.
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
        // Some of LIGGGHTS' libraries use the C library's mathematics without saying so; a program that has not loaded it crashes
        // while they are bound. It stays loaded.
        // SAFETY: no code runs by loading it.
        let mathematics = unsafe { Library::open(Some("libm.so.6"), RTLD_NOW | RTLD_GLOBAL) };
        let _ = ManuallyDrop::new(mathematics.map_err(|error| failed(error.to_string()))?);
        // SAFETY: ours comes first of all libraries and stands in for functions of LIGGGHTS, which it loads; its start-up code
        // fills LIGGGHTS' tables of styles and does nothing else.
        let library = unsafe { Library::open(Some(path), RTLD_NOW | RTLD_GLOBAL) };
        let library = ManuallyDrop::new(library.map_err(|error| failed(error.to_string()))?);
        macro_rules! symbol {
            ($name:literal) => {
                // SAFETY: the type is that of LIGGGHTS' `library.h` and of `shim/library.cpp`.
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

/// A LIGGGHTS of this process. MPI wants one thread: it cannot be sent to another.
pub struct Liggghts {
    interface: &'static Interface,
    handle: Handle,
    one_thread: PhantomData<*const ()>,
}

impl Liggghts {
    /// Open LIGGGHTS with the styles of `library` (`libconcordem-liggghts.so`); `arguments` are those of its command line. The
    /// first call in a process decides about the library.
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
            // Only the one who has set IS_OPEN gets here.
            let _ = INTERFACE.set(Interface::load(library)?);
        }
        let interface = INTERFACE.get().expect("set above");
        let words = std::iter::once("liggghts").chain(arguments.iter().copied());
        let words: Vec<CString> = words.map(word).collect::<Result<_, _>>()?;
        let mut pointers: Vec<*mut c_char> = words.iter().map(|word| word.as_ptr().cast_mut()).collect();
        let mut handle = std::ptr::null_mut();
        // SAFETY: `open` copies the words, which live until it returns. `atexit` gets a function that may run at any time.
        unsafe {
            if (interface.mpi)(0) == 0 {
                atexit(end_mpi);
            }
            (interface.open)(pointers.len() as c_int, pointers.as_mut_ptr(), &raw mut handle);
        }
        Ok(Self { interface, handle, one_thread: PhantomData })
    }

    /// One command of a script.
    pub fn command(&mut self, line: &str) -> Result<(), DriverError> {
        let line = word(line)?;
        // SAFETY: the instance lives; LIGGGHTS copies the line. No view is held: they borrow `self`.
        unsafe { (self.interface.command)(self.handle, line.as_ptr()) };
        Ok(())
    }

    /// The lines of a script, as LIGGGHTS reads a file: `&` as the last character of a line, in a comment too, lets the next one
    /// follow in its place; comments, which begin with `#` outside quotes, are LIGGGHTS' to find.
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

    /// Compute `steps` steps.
    pub fn run(&mut self, steps: u64) -> Result<(), DriverError> {
        self.command(&format!("run {steps}"))
    }

    /// Number of atoms of all processes.
    pub fn count(&self) -> usize {
        // SAFETY: the instance lives.
        unsafe { (self.interface.count)(self.handle) as usize }
    }

    /// Number of atoms of this process.
    pub fn owned(&self) -> usize {
        // SAFETY: LIGGGHTS knows `nlocal`, an int.
        unsafe {
            let number = (self.interface.extract_global)(self.handle, c"nlocal".as_ptr());
            number.cast::<c_int>().as_ref().map_or(0, |&number| number as usize)
        }
    }

    /// Where a property of atoms lies.
    fn property(&self, name: &'static str) -> Result<*mut c_void, DriverError> {
        let text = word(name)?;
        // SAFETY: the instance lives; LIGGGHTS compares the name.
        let found = unsafe { (self.interface.extract_atom)(self.handle, text.as_ptr()) };
        if found.is_null() { Err(DriverError::NoProperty(name)) } else { Ok(found) }
    }

    /// A property with three reals per atom.
    fn vectors(&self, name: &'static str) -> Result<(*mut [f64; 3], usize), DriverError> {
        let rows = self.property(name)?.cast::<*mut [f64; 3]>();
        let count = self.owned();
        // SAFETY: an array of `count` pointers to rows that lie one after the other.
        Ok((if count == 0 { std::ptr::null_mut() } else { unsafe { *rows } }, count))
    }

    fn view(&self, name: &'static str) -> Result<&[[f64; 3]], DriverError> {
        let (rows, count) = self.vectors(name)?;
        // SAFETY: `nlocal` rows of LIGGGHTS' array, which only commands change; those need the instance as a whole.
        Ok(if count == 0 { &[] } else { unsafe { std::slice::from_raw_parts(rows, count) } })
    }

    fn view_mut(&mut self, name: &'static str) -> Result<&mut [[f64; 3]], DriverError> {
        let (rows, count) = self.vectors(name)?;
        // SAFETY: as above; the instance is borrowed for writing, so that there is no other view.
        Ok(if count == 0 { &mut [] } else { unsafe { std::slice::from_raw_parts_mut(rows, count) } })
    }

    fn numbers<T>(&self, name: &'static str) -> Result<&[T], DriverError> {
        let numbers = self.property(name)?.cast::<T>();
        let count = self.owned();
        // SAFETY: `nlocal` numbers of the type that the callers below state.
        Ok(if count == 0 { &[] } else { unsafe { std::slice::from_raw_parts(numbers, count) } })
    }

    /// Positions of this process's atoms, m.
    pub fn positions(&self) -> Result<&[[f64; 3]], DriverError> {
        self.view("x")
    }

    /// Positions, to be changed.
    pub fn positions_mut(&mut self) -> Result<&mut [[f64; 3]], DriverError> {
        self.view_mut("x")
    }

    /// Velocities, m/s.
    pub fn velocities(&self) -> Result<&[[f64; 3]], DriverError> {
        self.view("v")
    }

    /// Velocities, to be changed.
    pub fn velocities_mut(&mut self) -> Result<&mut [[f64; 3]], DriverError> {
        self.view_mut("v")
    }

    /// Angular velocities, rad/s.
    pub fn spins(&self) -> Result<&[[f64; 3]], DriverError> {
        self.view("omega")
    }

    /// Angular velocities, to be changed.
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

    /// What a fix tells of itself: its number, or number `index` (from 1) of its vector, over all processes, all of which ask.
    pub fn fix(&self, id: &str, index: Option<usize>) -> Result<f64, DriverError> {
        let text = word(id)?;
        let (kind, place) = match index {
            None => (0, 0),
            Some(index) => {
                // LIGGGHTS does not check: a place that is not there would be read all the same.
                // SAFETY: the instance lives; the name is compared.
                let length = unsafe { (self.interface.fix_size)(self.handle, text.as_ptr()) };
                let length = usize::try_from(length).map_err(|_| DriverError::NoFix(id.to_owned()))?;
                if !(1..=length).contains(&index) {
                    return Err(DriverError::NoNumber { id: id.to_owned(), length, index });
                }
                (1, (index - 1) as c_int)
            }
        };
        // SAFETY: a copy that is ours to free, or null.
        unsafe {
            let found = (self.interface.extract_fix)(self.handle, text.as_ptr(), 0, kind, place, 0);
            let value = found.cast::<f64>().as_ref().copied().ok_or_else(|| DriverError::NoFix(id.to_owned()))?;
            (self.interface.free)(found);
            Ok(value)
        }
    }

    /// Bonds and contacts of a fix concordem/bond that this process counts, with the forces of the last step with output, as at
    /// the end of every run.
    pub fn bonds(&self, id: &str) -> Result<Vec<Bond>, DriverError> {
        let text = word(id)?;
        let mut count = 0;
        // SAFETY: `count` rows that are given back.
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
            ids: [row[0] as i32, row[1] as i32],
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

    /// What the laws remember of the bonds and contacts of a fix concordem/bond that this process counts, as they are now: reference,
    /// frame, history, in the law's own order of reals.
    pub fn histories(&self, id: &str) -> Result<Vec<Record>, DriverError> {
        let text = word(id)?;
        let (mut count, mut length) = (0, 0);
        // SAFETY: `count` records of `length` reals that are given back.
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
    /// The end of LIGGGHTS; while a panic unwinds, and there are other processes, the end of them all.
    fn drop(&mut self) {
        // SAFETY: opened once, closed once; views are gone.
        unsafe {
            if std::thread::panicking() && (self.interface.processes)(self.handle) > 1 {
                (self.interface.abort)(self.handle);
            }
            (self.interface.close)(self.handle);
        }
        IS_OPEN.store(false, Ordering::SeqCst);
    }
}
