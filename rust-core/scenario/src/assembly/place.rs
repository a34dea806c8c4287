//! Makes the packing of a scenario, or reads it from a file, and cuts it to shape.

use std::io::BufReader;
use std::path::Path;

use super::cache::{FROM_CACHE, PackingCache, Stored};
use super::placed::Placed;
use super::radii::sizes;
use super::stl::Named;
use super::{AssemblyError, Progress, plane, unfit, walled};
use crate::schema::quantity::vector;
use crate::schema::{self, Axis, Quantity, Scenario};
use concordem_contact::math::{Mat3, Vec3};
use concordem_files::paths::{is_hdf5, open_regular};
use concordem_packing::random_dense::{self, Protocol, RandomDense};
use concordem_packing::{Crop, Lattice, Packing, Random, Shape, import, random_discs, tile, tile_and_crop};
use concordem_solver::state::{Cell, Sphere};

/// Reads a sphere pack from an HDF5 file, or says why it cannot.
pub(super) type PackReader = fn(&Path) -> Result<Packing, String>;

/// A [`PackReader`] for libraries that must not need HDF5.
///
/// # Errors
/// Always.
pub(super) fn without_hdf5(_: &Path) -> Result<Packing, String> {
    Err("HDF5 sphere packs cannot be read here; write the packing as text (x y z r per line)".to_owned())
}

/// Makes or reads the packing of a scenario; its paths are relative to `folder`.
///
/// # Errors
/// The packing cannot be made, a file cannot be read, or the packing of a plane scenario leaves the plane.
pub fn place(scenario: &Scenario, folder: &Path, progress: Progress<'_>) -> Result<Placed, AssemblyError> {
    place_cached(scenario, folder, None, progress)
}

/// [`place`] with a cache, from which packings that take long to make are read, and in which they are stored.
///
/// # Errors
/// Those of [`place`].
pub fn place_cached(
    scenario: &Scenario,
    folder: &Path,
    cache: Option<&PackingCache>,
    progress: Progress<'_>,
) -> Result<Placed, AssemblyError> {
    place_with(scenario, folder, concordem_files::sphere_pack::read, cache, progress)
}

/// [`place`] with another reader of HDF5 files.
pub(super) fn place_with(
    scenario: &Scenario,
    folder: &Path,
    read_hdf5: PackReader,
    cache: Option<&PackingCache>,
    progress: Progress<'_>,
) -> Result<Placed, AssemblyError> {
    let mut placed = make(scenario, folder, read_hdf5, cache, progress)?;
    if scenario.dimension == 2 {
        plane::check(&placed.packing)?;
    }
    let whole = placed.unit.as_ref().unwrap_or(&placed.packing);
    // A solid fraction by volume has no meaning for spheres with centers in one plane either.
    let plane = scenario.dimension == 2 || matches!(scenario.packing, schema::Packing::RandomDiscs { .. });
    let of_cell = if plane { whole.area_fraction() } else { whole.packing_fraction() };
    placed.packing_fraction = of_cell.or(placed.packing_fraction);
    Ok(placed)
}

/// Makes the packing, without its solid fraction.
fn make(
    scenario: &Scenario,
    folder: &Path,
    read_hdf5: PackReader,
    cache: Option<&PackingCache>,
    progress: Progress<'_>,
) -> Result<Placed, AssemblyError> {
    let whole = Placed::without_shape;
    match &scenario.packing {
        schema::Packing::RandomDense { shape, .. } => {
            let unit = compact_cached(&scenario.packing, cache, progress)?;
            cut(unit, Some(shape), folder)
        }
        schema::Packing::RandomDiscs { count, radius, radii, solid_fraction, seed, shape } => {
            let sizes = sizes(radius.map(Quantity::si), radii.as_ref());
            let radii = sizes.radii(*count as usize, *seed)?;
            let mut random = Random::new(*seed);
            let fraction = solid_fraction.si();
            let unit = random_discs(&radii, fraction, 1.0, &mut random, &mut |part| progress("compaction", part))?;
            // The cell is 1 m deep along z; images of the discs along z are outside the plane.
            let mut placed = cut(unit, Some(shape), folder)?;
            placed.packing.spheres.retain(|disc| disc.position.z == 0.0);
            Ok(placed)
        }
        schema::Packing::Cooker { shape, .. } | schema::Packing::Growth { shape, .. } => {
            let mesh = match (cache, shape) {
                (Some(_), schema::Shape::Mesh { path, .. }) => std::fs::read(folder.join(path)).unwrap_or_default(),
                _ => Vec::new(),
            };
            let cache = cache.map(|cache| (cache, &mesh[..]));
            walled::cached(&scenario.packing, solid(shape, folder)?, cache, progress)
        }
        schema::Packing::Lattice { lattice, radius, repeats, shape } => {
            let repeats = repeats.map_or([1; 3], |r| r.map(|n| n as u32));
            match shape {
                None | Some(schema::Shape::Periodic { .. }) => {
                    Ok(whole(block(lattice_of(*lattice), radius.si(), repeats, shape.as_ref())?))
                }
                Some(shape) => {
                    let (solid, cross_sections) = solid(shape, folder)?;
                    let crop = shape.keep().unwrap_or(Crop::WholeSpheres);
                    let (lattice, radius) = (lattice_of(*lattice), radius.si());
                    let origin = match (shape, crop) {
                        (schema::Shape::Box { .. }, Crop::WholeSpheres) => {
                            let (low, high) = solid.bounds();
                            lattice.origin_in(radius, &low, &high)
                        }
                        _ => Vec3::zeros(),
                    };
                    let packing = lattice.fill(radius, &solid, crop, origin)?;
                    Ok(Placed { cross_sections, body: Some(solid), ..whole(packing) })
                }
            }
        }
        schema::Packing::File { path, unit, cell, shape } => {
            let mut packing = read_file(&folder.join(path), unit.map(Quantity::si), read_hdf5)?;
            if let Some(edges) = cell {
                packing.cell = Some(Cell::new(Mat3::from_diagonal(&vector(edges))));
            }
            match shape {
                None => Ok(whole(packing)),
                shape => cut(packing, shape.as_ref(), folder),
            }
        }
        schema::Packing::Spheres { spheres, cell } => {
            let spheres = spheres
                .iter()
                .map(|s| Sphere { position: Vec3::new(s[0].si(), s[1].si(), s[2].si()), radius: s[3].si() })
                .collect();
            let cell = cell.map(|edges| Cell::new(Mat3::from_diagonal(&vector(&edges))));
            Ok(whole(Packing { spheres, cell }))
        }
    }
}

pub(super) fn lattice_of(lattice: schema::Lattice) -> Lattice {
    match lattice {
        schema::Lattice::Sc => Lattice::SimpleCubic,
        schema::Lattice::Bcc => Lattice::BodyCentered,
        schema::Lattice::Fcc => Lattice::FaceCentered,
        schema::Lattice::Hcp => Lattice::HexagonalClosePacked,
        schema::Lattice::Square => Lattice::Square,
        schema::Lattice::Triangular => Lattice::Triangular,
    }
}

/// A block of unit cells of a lattice; with a periodic shape, a periodic cell and its copies.
fn block(
    lattice: Lattice,
    radius: f64,
    repeats: [u32; 3],
    shape: Option<&schema::Shape>,
) -> Result<Packing, AssemblyError> {
    if let Some(schema::Shape::Periodic { tiles }) = shape {
        let counts = std::array::from_fn(|axis| repeats[axis].saturating_mul(tiles[axis] as u32));
        return Ok(lattice.periodic(radius, counts)?);
    }
    let mut block = lattice.periodic(radius, repeats)?;
    block.cell = None;
    Ok(block)
}

fn cannot_read(file: &Path, message: &dyn ToString) -> AssemblyError {
    AssemblyError::File { path: file.display().to_string(), message: message.to_string() }
}

/// A sphere pack in HDF5, or a text file; `unit`: length of one unit of a text file, m.
fn read_file(file: &Path, unit: Option<f64>, read_hdf5: PackReader) -> Result<Packing, AssemblyError> {
    if is_hdf5(file) {
        return read_hdf5(file).map_err(|message| cannot_read(file, &message));
    }
    let reader = BufReader::new(open_regular(file).map_err(|error| cannot_read(file, &error))?);
    import(reader, unit).map_err(|error| unfit("packing.path", format!("{}: {error}", file.display())))
}

/// Tiles or crops a packing.
fn cut(unit: Packing, shape: Option<&schema::Shape>, folder: &Path) -> Result<Placed, AssemblyError> {
    match shape {
        None => Ok(Placed::without_shape(unit)),
        Some(schema::Shape::Periodic { tiles }) => {
            let packing = tile(&unit, tiles.map(|n| n as u32))?;
            Ok(Placed { unit: Some(unit), ..Placed::without_shape(packing) })
        }
        Some(shape) => {
            let (solid, cross_sections) = solid(shape, folder)?;
            let crop = shape.keep().unwrap_or(Crop::Centers);
            let (packing, unit) = if unit.cell.is_some() {
                (tile_and_crop(&unit, &solid, crop, Vec3::zeros())?, Some(unit))
            } else {
                let spheres = unit.spheres.into_iter().filter(|s| crop.keeps(s, &solid)).collect();
                (Packing { spheres, cell: None }, None)
            };
            Ok(Placed { cross_sections, unit, body: Some(solid), ..Placed::without_shape(packing) })
        }
    }
}

/// The shape of a scenario, with its cross-sections (m²) if they are constant; paths are relative to `folder`.
///
/// # Errors
/// A shape without interior, a file that cannot be read, or a periodic packing, which has no shape.
pub fn solid(shape: &schema::Shape, folder: &Path) -> Result<(Shape, Option<[f64; 3]>), AssemblyError> {
    let center = shape.center().map_or_else(Vec3::zeros, |center| vector(&center));
    let ends = |axis: Axis, height: f64| {
        let mut half = Vec3::zeros();
        half[axis.index()] = 0.5 * height;
        (center - half, center + half)
    };
    Ok(match shape {
        schema::Shape::Box { size, .. } => {
            let size = vector(size);
            let areas = [size.y * size.z, size.z * size.x, size.x * size.y];
            (Shape::new_box(center - size * 0.5, center + size * 0.5)?, Some(areas))
        }
        schema::Shape::Cylinder { radius, height, axis, .. } => {
            let (base, top) = ends(*axis, height.si());
            let (r, h) = (radius.si(), height.si());
            let mut areas = [2.0 * r * h; 3];
            areas[axis.index()] = std::f64::consts::PI * r * r;
            (Shape::new_cylinder(base, top, r)?, Some(areas))
        }
        schema::Shape::Hyperboloid { radius, waist_radius, height, axis, .. } => {
            let (base, top) = ends(*axis, height.si());
            let waist = waist_radius.si();
            let mut areas = [2.0 * waist * height.si(); 3];
            // The specimen breaks at its waist, so the stress refers to the cross-section there.
            areas[axis.index()] = std::f64::consts::PI * waist * waist;
            (Shape::new_hyperboloid(base, top, radius.si(), waist)?, Some(areas))
        }
        schema::Shape::Mesh { path, unit, .. } => {
            let named = Named { folder, path, unit: unit.si(), key: "packing.shape.path" };
            (Shape::Mesh(named.closed()?), None)
        }
        schema::Shape::Periodic { .. } => {
            return Err(unfit("packing.shape", "a periodic packing has no shape to cut".into()));
        }
    })
}

/// The periodic cell of a random dense packing, from the cache if it is there.
fn compact_cached(
    packing: &schema::Packing,
    cache: Option<&PackingCache>,
    progress: Progress<'_>,
) -> Result<Packing, AssemblyError> {
    let Some(cache) = cache else { return compact(packing, progress) };
    let schema::Packing::RandomDense { count, radius, radii, seed, friction, protocol, .. } = packing else {
        return compact(packing, progress);
    };
    // The shape does not matter: all specimens from one cell share it.
    let keys = format!("{count} {radius:?} {radii:?} {seed} {friction:?} {protocol:?}");
    let depends_on: &[&[u8]] = &[b"random-dense", keys.as_bytes()];
    if let Some(stored) = cache.read(depends_on) {
        progress(FROM_CACHE, 1.0);
        return Ok(stored.packing);
    }
    let packing = compact(packing, progress)?;
    cache.write(depends_on, &Stored { packing: packing.clone(), ..Stored::default() });
    Ok(packing)
}

/// Compacts the periodic cell of a random dense packing.
fn compact(packing: &schema::Packing, progress: Progress<'_>) -> Result<Packing, AssemblyError> {
    let schema::Packing::RandomDense { count, radius, radii, seed, friction, protocol, .. } = packing else {
        return Err(unfit("packing.kind", "only \"random-dense\" is compacted".into()));
    };
    let (count, friction) = (*count as usize, friction.si());
    let sizes = sizes(radius.map(Quantity::si), radii.as_ref());
    let recipe = match protocol {
        Protocol::Jammed => RandomDense::jammed(count, 1.0, friction, *seed),
        Protocol::Yade => RandomDense::thesis(count, 1.0, friction, *seed),
    };
    let recipe = RandomDense { sizes, ..recipe };
    let report = &mut |now: random_dense::Progress| {
        // Random clouds start at a fraction of about 0.3 and end at about 0.6: a rough measure of progress.
        progress("compaction", (now.packing_fraction / 0.65).min(0.99));
    };
    Ok(random_dense::random_dense(&recipe, report)?.packing)
}
