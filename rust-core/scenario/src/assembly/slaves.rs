//! Recorded motions of `[[slave]]`.

use std::io::{BufReader, Read};
use std::path::Path;

use super::bodies::members;
use super::{AssemblyError, unfit};
use crate::schedule::{Histories, Moved, RecordedMotion};
use crate::schema::{Scenario, Slave};
use concordem_contact::math::Vec3;
use concordem_files::paths::open_regular;
use concordem_solver::state::{Constraint, State};

/// Reads the files of `[[slave]]`. What they move gets its largest speeds, which bound the time step; [`start`] sets those of the
/// start.
///
/// # Errors
/// Files that cannot be read or do not fit, particles whose motion is not prescribed, and meshes with a motion of their own.
pub(super) fn build(
    scenario: &Scenario,
    folder: &Path,
    state: &mut State,
) -> Result<Vec<RecordedMotion>, AssemblyError> {
    let mut motions = Vec::new();
    for (at, slave) in scenario.slaves.iter().enumerate() {
        let path = folder.join(&slave.path);
        let fail = |message: String| AssemblyError::File { path: path.display().to_string(), message };
        let array = open_regular(&path)
            .map_err(|error| error.to_string())
            .and_then(|file| Array::read(BufReader::new(file)))
            .map_err(fail)?;
        let motion = motion(scenario, at, slave, state, &array)?;
        let steps = motion.steps();
        if scenario.stop.steps.is_none_or(|limit| limit > steps) {
            let message = format!(
                "the file of slave[{at}] ends after {steps} steps; give `steps` of at most that number, because nothing moves the \
                 slaves afterwards"
            );
            return Err(unfit("stop.steps", message));
        }
        motions.push(motion);
    }
    for motion in &motions {
        let fastest = motion.fastest().into_iter().map(|speed| Vec3::x() * speed);
        match &motion.moved {
            Moved::Particles(particles) => {
                particles.iter().zip(fastest).for_each(|(&p, speed)| state.particles.velocity[p as usize] = speed);
            }
            Moved::Driven(wall) | Moved::Placed(wall) => {
                if let Some(mesh) = state.walls[*wall].mesh_mut() {
                    mesh.velocity.iter_mut().zip(fastest).for_each(|(velocity, speed)| *velocity = speed);
                }
            }
        }
    }
    Ok(motions)
}

/// Sets the motion before the first step.
///
/// # Errors
/// Particles that also follow a history; places at which a triangle has no area.
pub(super) fn start(histories: &Histories, state: &mut State) -> Result<(), AssemblyError> {
    for (at, motion) in histories.recorded.iter().enumerate() {
        if let Moved::Particles(particles) = &motion.moved {
            let follows = |p: &&u32| histories.motions.iter().any(|timed| timed.particles.contains(p));
            if let Some(&p) = particles.iter().find(follows) {
                let id = state.particles.id[p as usize];
                let message = format!("particle {id} follows a history or a field, too; remove one of the motions");
                return Err(unfit(&format!("slave[{at}].set"), message));
            }
        }
        motion.start(state).map_err(|error| unfit(&format!("slave[{at}].path"), error.to_string()))?;
    }
    Ok(())
}

/// The motion of one table.
fn motion(
    scenario: &Scenario,
    at: usize,
    slave: &Slave,
    state: &State,
    array: &Array,
) -> Result<RecordedMotion, AssemblyError> {
    let [_, count, components] = array.shape;
    let file = |message: String| unfit(&format!("slave[{at}].path"), message);
    let (moved, wanted, what) = match (&slave.set, &slave.wall) {
        (Some(set), _) => {
            let mut particles = members(scenario, &state.particles, set);
            particles.sort_unstable_by_key(|&p| state.particles.id[p]);
            if let Some(&free) = particles.iter().find(|&&p| state.particles.constraint[p] != Constraint::ALL) {
                let message = format!(
                    "the motion of particle {} is not prescribed; add a [[prescribe]] with set = \"{set}\", velocity = [0, 0, 0], \
                     angular_velocity = [0, 0, 0]",
                    state.particles.id[free]
                );
                return Err(unfit(&format!("slave[{at}].set"), message));
            }
            let wanted = particles.len();
            (Moved::Particles(particles.into_iter().map(|p| p as u32).collect()), wanted, "particles")
        }
        (None, wall) => {
            let name = wall.as_deref().unwrap_or_default();
            let found = state.walls.iter().position(|wall| wall.name == name);
            let mesh = found.and_then(|wall| Some((wall, state.walls[wall].mesh()?.position.len())));
            let Some((wall, vertices)) = mesh else {
                let message = format!("no wall named \"{name}\" has the kind \"mesh\"");
                return Err(unfit(&format!("slave[{at}].wall"), message));
            };
            (if components == 3 { Moved::Driven(wall) } else { Moved::Placed(wall) }, vertices, "vertices")
        }
    };
    if count != wanted {
        return Err(file(format!("the file has {count} {what}, \"{}\" has {wanted}", slave.name())));
    }
    let driven = matches!(moved, Moved::Driven(_));
    if components != if driven { 3 } else { 6 } {
        let wanted = if matches!(moved, Moved::Particles(_)) { "6" } else { "3 or 6" };
        return Err(file(format!("the file has {components} components per row; \"{}\" takes {wanted}", slave.name())));
    }
    let vectors: Vec<Vec3> = array.values.chunks_exact(3).map(|v| Vec3::new(v[0], v[1], v[2])).collect();
    if let Some(row) = vectors.iter().position(|v| !v.iter().all(|c| c.is_finite())) {
        let step = row / (count * if driven { 1 } else { 2 });
        return Err(file(format!("a number of entry {step} is not finite")));
    }
    let motion = RecordedMotion { moved, count, vectors };
    if scenario.dimension == 2 {
        refuse_out_of_plane(&motion, state).map_err(file)?;
    }
    Ok(motion)
}

/// In two dimensions particles rotate about z alone, and nothing moves along z.
fn refuse_out_of_plane(motion: &RecordedMotion, state: &State) -> Result<(), String> {
    let leaves = match &motion.moved {
        Moved::Particles(_) => motion.vectors.chunks_exact(2).any(|v| v[0].z != 0.0 || v[1].x != 0.0 || v[1].y != 0.0),
        Moved::Driven(_) => motion.vectors.iter().any(|v| v.z != 0.0),
        Moved::Placed(wall) => {
            let places = state.walls[*wall].mesh().map_or(&[][..], |mesh| &mesh.position);
            let rows = motion.vectors.chunks_exact(2).zip(places.iter().cycle());
            rows.into_iter().any(|(v, place)| v[0].z != place.z || v[1].z != 0.0)
        }
    };
    if leaves { Err("in two dimensions nothing moves out of the plane z = 0".to_owned()) } else { Ok(()) }
}

/// An array of three axes from a file in NumPy's format.
struct Array {
    shape: [usize; 3],
    values: Vec<f64>,
}

impl Array {
    /// Reads format versions 1 and 2: `\x93NUMPY`, version, length of the header, header, values. The header is a Python dictionary.
    fn read(mut file: impl Read) -> Result<Self, String> {
        let fail = |error: std::io::Error| error.to_string();
        let mut start = [0_u8; 8];
        file.read_exact(&mut start).map_err(fail)?;
        if &start[..6] != b"\x93NUMPY" {
            return Err("is not a file in NumPy's format .npy; write it with numpy.save".to_owned());
        }
        let length = match start[6] {
            1 => {
                let mut bytes = [0; 2];
                file.read_exact(&mut bytes).map_err(fail)?;
                usize::from(u16::from_le_bytes(bytes))
            }
            2 => {
                let mut bytes = [0; 4];
                file.read_exact(&mut bytes).map_err(fail)?;
                u32::from_le_bytes(bytes) as usize
            }
            version => return Err(format!("has version {version} of NumPy's format; 1 and 2 are known")),
        };
        // Headers have some hundred bytes.
        if length > 1 << 16 {
            return Err("has a header that is too long".to_owned());
        }
        let mut header = vec![0; length];
        file.read_exact(&mut header).map_err(fail)?;
        let header = String::from_utf8_lossy(&header).into_owned();
        let shape = Self::shape(&header)?;
        let size = shape.iter().try_fold(1_usize, |product, n| product.checked_mul(*n)).filter(|n| *n <= 1 << 40);
        let Some(size) = size else { return Err(format!("has the shape {shape:?}, which is too large")) };
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(fail)?;
        if bytes.len() != 8 * size {
            return Err(format!("has {} bytes of values; its shape {shape:?} needs {}", bytes.len(), 8 * size));
        }
        let number = |bytes: &[u8]| bytes.iter().rev().fold(0_u64, |bits, byte| bits << 8 | u64::from(*byte));
        let values = bytes.chunks_exact(8).map(|bytes| f64::from_bits(number(bytes))).collect();
        Ok(Self { shape, values })
    }

    /// Three axes of 64-bit numbers in C order.
    fn shape(header: &str) -> Result<[usize; 3], String> {
        let after = |key: &str| header.split_once(key).map(|(_, rest)| rest.trim_start());
        if !after("'descr':").is_some_and(|rest| rest.starts_with("'<f8'")) {
            return Err("does not hold 64-bit floating-point numbers (dtype '<f8')".to_owned());
        }
        if !after("'fortran_order':").is_some_and(|rest| rest.starts_with("False")) {
            return Err("is in Fortran order; write it with numpy.ascontiguousarray".to_owned());
        }
        let inside = after("'shape':").and_then(|rest| rest.strip_prefix('(')?.split_once(')')).map(|(axes, _)| axes);
        let axes: Option<Vec<usize>> = inside.and_then(|axes| {
            axes.split(',').map(str::trim).filter(|axis| !axis.is_empty()).map(|axis| axis.parse().ok()).collect()
        });
        match axes.as_deref() {
            Some(&[steps, count, components]) if steps > 0 && count > 0 => Ok([steps, count, components]),
            _ => {
                let found = inside.unwrap_or("?");
                Err(format!("has the shape ({found}); give (steps + 1, particles or vertices, components)"))
            }
        }
    }
}
