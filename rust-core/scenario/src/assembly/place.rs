//! Packing of a scenario.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use super::{AssemblyError, Progress, unfit};
use crate::schema::{self, Axis, Scenario};
use concordem_contact::math::{Mat3, Vec3};
use concordem_packing::random_dense::{self, Protocol, RandomDense};
use concordem_packing::shape::Mesh;
use concordem_packing::{
    Crop, Lattice, Packing, Random, Shape, SizeDistribution, import_text, random_discs, tile, tile_and_crop,
};
use concordem_solver::state::{Cell, Sphere};

/// A packing, and what is known of the shape that was cut out of it.
pub struct Placed {
    /// The spheres, and the periodic cell if there is one.
    pub packing: Packing,
    /// Solid volume per volume, of the periodic cell or of the packing that was cut.
    pub packing_fraction: Option<f64>,
    /// Cross-sections perpendicular to x, y, z of the shape, m².
    pub cross_sections: Option<[f64; 3]>,
    /// The periodic packing that `packing` was cut from.
    pub unit: Option<Packing>,
}

/// Make or read the packing of a scenario; `folder` is that of the scenario, to which file names in it refer.
pub fn place(scenario: &Scenario, folder: &Path, progress: Progress<'_>) -> Result<Placed, AssemblyError> {
    let whole = |packing: Packing| Placed {
        packing_fraction: packing.packing_fraction().filter(|_| scenario.dimension == 3),
        packing,
        cross_sections: None,
        unit: None,
    };
    match &scenario.packing {
        schema::Packing::RandomDense { .. } => {
            let unit = compact(&scenario.packing, progress)?;
            cut(unit, scenario.packing.shape(), folder)
        }
        schema::Packing::RandomDiscs { count, radius, radii, solid_fraction, seed, shape } => {
            let sizes = sizes(radius.map(schema::Quantity::si), radii.as_ref());
            let radii = sizes.radii(*count as usize, *seed)?;
            let mut random = Random::new(*seed);
            let share = solid_fraction.si();
            let unit = random_discs(&radii, share, 1.0, &mut random, &mut |part| progress("compaction", part))?;
            // Other layers of the cell, which is 1 m along z, are no discs of this plane.
            let mut placed = cut(unit, Some(shape), folder)?;
            placed.packing.spheres.retain(|disc| disc.position.z == 0.0);
            Ok(Placed { packing_fraction: Some(share), ..placed })
        }
        schema::Packing::Lattice { lattice, radius, repeats, shape } => {
            let lattice = match lattice {
                schema::Lattice::Sc => Lattice::SimpleCubic,
                schema::Lattice::Bcc => Lattice::BodyCentered,
                schema::Lattice::Fcc => Lattice::FaceCentered,
                schema::Lattice::Hcp => Lattice::HexagonalClosePacked,
                schema::Lattice::Square => Lattice::Square,
                schema::Lattice::Triangular => Lattice::Triangular,
            };
            let repeats = repeats.map_or([1; 3], |r| r.map(|n| n as u32));
            match shape {
                None => {
                    // One block of the lattice, not periodic.
                    let mut block = lattice.periodic(radius.si(), repeats)?;
                    block.cell = None;
                    Ok(whole(block))
                }
                Some(schema::Shape::Periodic { tiles }) => {
                    let mut counts = [0; 3];
                    for axis in 0..3 {
                        counts[axis] = repeats[axis].saturating_mul(tiles[axis] as u32);
                    }
                    Ok(whole(lattice.periodic(radius.si(), counts)?))
                }
                Some(shape) => {
                    let (solid, cross_sections) = solid(shape, folder)?;
                    let packing = lattice.fill(radius.si(), &solid, Vec3::zeros())?;
                    Ok(Placed { packing, packing_fraction: None, cross_sections, unit: None })
                }
            }
        }
        schema::Packing::File { path, cell, shape } => {
            let file = folder.join(path);
            let open = |error: std::io::Error| AssemblyError::File {
                path: file.display().to_string(),
                message: error.to_string(),
            };
            let is_hdf5 = file.extension().is_some_and(|e| e == "h5" || e == "hdf5");
            let mut packing = if is_hdf5 {
                read_hdf5(&file)?
            } else {
                import_text(BufReader::new(File::open(&file).map_err(open)?))?
            };
            if let Some(edges) = cell {
                packing.cell = Some(Cell::new(Mat3::from_diagonal(&schema::quantity::vector(edges))));
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
            let cell = cell.map(|edges| Cell::new(Mat3::from_diagonal(&schema::quantity::vector(&edges))));
            Ok(whole(Packing { spheres, cell }))
        }
    }
}

/// An HDF5 sphere pack, where this build cannot read it.
#[cfg(not(feature = "hdf5"))]
fn read_hdf5(file: &Path) -> Result<Packing, AssemblyError> {
    let message = "HDF5 sphere packs cannot be read here; write the packing as text (x y z r per line)".to_owned();
    Err(AssemblyError::File { path: file.display().to_string(), message })
}

/// An HDF5 sphere pack.
#[cfg(feature = "hdf5")]
fn read_hdf5(file: &Path) -> Result<Packing, AssemblyError> {
    super::sphere_pack::read(file).map_err(|message| AssemblyError::File { path: file.display().to_string(), message })
}

/// Tile or crop a packing.
fn cut(unit: Packing, shape: Option<&schema::Shape>, folder: &Path) -> Result<Placed, AssemblyError> {
    let packing_fraction = unit.packing_fraction();
    match shape {
        None => Ok(Placed { packing: unit, packing_fraction, cross_sections: None, unit: None }),
        Some(schema::Shape::Periodic { tiles }) => {
            let packing = tile(&unit, tiles.map(|n| n as u32))?;
            Ok(Placed { packing, packing_fraction, cross_sections: None, unit: Some(unit) })
        }
        Some(shape) => {
            let (solid, cross_sections) = solid(shape, folder)?;
            let (packing, unit) = if unit.cell.is_some() {
                (tile_and_crop(&unit, &solid, Crop::Centers, Vec3::zeros())?, Some(unit))
            } else {
                let spheres = unit.spheres.into_iter().filter(|s| solid.contains(&s.position, 0.0)).collect();
                (Packing { spheres, cell: None }, None)
            };
            Ok(Placed { packing, packing_fraction, cross_sections, unit })
        }
    }
}

/// The shape of a scenario, and its cross-sections where they do not depend on the place.
fn solid(shape: &schema::Shape, folder: &Path) -> Result<(Shape, Option<[f64; 3]>), AssemblyError> {
    let ends = |axis: Axis, height: f64| {
        let mut half = Vec3::zeros();
        half[axis.index()] = 0.5 * height;
        (-half, half)
    };
    Ok(match shape {
        schema::Shape::Box { size } => {
            let size = schema::quantity::vector(size);
            let areas = [size.y * size.z, size.z * size.x, size.x * size.y];
            (Shape::new_box(size * -0.5, size * 0.5)?, Some(areas))
        }
        schema::Shape::Cylinder { radius, height, axis } => {
            let (base, top) = ends(*axis, height.si());
            let (r, h) = (radius.si(), height.si());
            let mut areas = [2.0 * r * h; 3];
            areas[axis.index()] = std::f64::consts::PI * r * r;
            (Shape::new_cylinder(base, top, r)?, Some(areas))
        }
        schema::Shape::Hyperboloid { radius, waist_radius, height, axis } => {
            let (base, top) = ends(*axis, height.si());
            let waist = waist_radius.si();
            let mut areas = [2.0 * waist * height.si(); 3];
            // The stress of interest is that of the waist, where it breaks.
            areas[axis.index()] = std::f64::consts::PI * waist * waist;
            (Shape::new_hyperboloid(base, top, radius.si(), waist)?, Some(areas))
        }
        schema::Shape::Mesh { path, unit } => {
            let file = folder.join(path);
            let reader = BufReader::new(File::open(&file).map_err(|error| AssemblyError::File {
                path: file.display().to_string(),
                message: error.to_string(),
            })?);
            (Shape::Mesh(Mesh::from_stl(reader, unit.si())?), None)
        }
        schema::Shape::Periodic { .. } => {
            return Err(unfit("packing.shape", "a periodic packing has no outline".into()));
        }
    })
}

/// Triangles of an STL file, scaled to metres.
pub(super) fn triangles(folder: &Path, path: &str, unit: f64) -> Result<Vec<[Vec3; 3]>, AssemblyError> {
    let file = folder.join(path);
    let fail = |message: String| AssemblyError::File { path: file.display().to_string(), message };
    let mut reader = BufReader::new(File::open(&file).map_err(|error| fail(error.to_string()))?);
    let mesh = stl_io::read_stl(&mut reader).map_err(|error| fail(format!("not a readable STL file: {error}")))?;
    let corner = |index: usize| {
        mesh.vertices
            .get(index)
            .map(|v| Vec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2])) * unit)
            .ok_or_else(|| fail(format!("names corner {index}, which it does not have")))
    };
    mesh.faces.iter().map(|f| Ok([corner(f.vertices[0])?, corner(f.vertices[1])?, corner(f.vertices[2])?])).collect()
}

/// Compact the periodic cell of a random dense packing.
fn compact(packing: &schema::Packing, progress: Progress<'_>) -> Result<Packing, AssemblyError> {
    let schema::Packing::RandomDense { count, radius, radii, seed, friction, protocol, .. } = packing else {
        return Err(unfit("packing.kind", "only random-dense is compacted".into()));
    };
    let (count, friction) = (*count as usize, friction.si());
    let sizes = sizes(radius.map(schema::Quantity::si), radii.as_ref());
    let recipe = match protocol {
        Protocol::Jammed => RandomDense::jammed(count, 1.0, friction, *seed),
        Protocol::Yade => RandomDense::thesis(count, 1.0, friction, *seed),
    };
    let recipe = RandomDense { sizes, ..recipe };
    let report = &mut |now: random_dense::Progress| {
        // Random clouds start at about 0.3 and end at about 0.6: what matters is that the bar moves.
        progress("compaction", (now.packing_fraction / 0.65).min(0.99));
    };
    Ok(random_dense::random_dense(&recipe, report)?.packing)
}

/// Sizes of a scenario's packing.
fn sizes(radius: Option<f64>, radii: Option<&schema::Radii>) -> SizeDistribution {
    match (radius, radii) {
        (Some(radius), _) => SizeDistribution::Single(radius),
        (None, Some(schema::Radii::Uniform { minimum, maximum })) => {
            SizeDistribution::Uniform { low: minimum.si(), high: maximum.si() }
        }
        (None, Some(schema::Radii::Table { radii, shares })) => {
            SizeDistribution::Discrete(radii.iter().zip(shares).map(|(r, s)| (r.si(), s.si())).collect())
        }
        (None, Some(schema::Radii::LogNormal { median, deviation, minimum, maximum })) => {
            // A thousand classes of equal width in ln r, weighted with the normal density in ln r.
            const CLASSES: u32 = 1000;
            let (low, high) = (concordem_contact::math::ln(minimum.si()), concordem_contact::math::ln(maximum.si()));
            let middle = concordem_contact::math::ln(median.si());
            let class = |k: u32| {
                let x = low + (high - low) * (f64::from(k) + 0.5) / f64::from(CLASSES);
                let z = (x - middle) / deviation.si();
                (concordem_contact::math::exp(x), concordem_contact::math::exp(-0.5 * z * z))
            };
            SizeDistribution::Discrete((0..CLASSES).map(class).collect())
        }
        // The checks of the scenario refuse a packing with neither.
        (None, None) => SizeDistribution::Discrete(Vec::new()),
    }
}
