//! Sphere packs in HDF5: `position` (N×3, m), `radius` (N, m), and for a periodic pack `cell` (3×3, m; a row is an
//! edge vector). Units are attributes. Any program may write such files. Files of this program end with a seal
//! ([`super::seal`]); their attribute `kind` says that the seal is required. A seal is always checked if present.

use std::path::Path;

use super::checked_hdf5 as checked;
use super::seal::{self, SealError};
use crate::files;
use concordem_contact::math::{Mat3, Vec3};
use concordem_packing::Packing;
use concordem_solver::state::{Cell, Sphere};

/// Options for opening HDF5 files: closing a file closes all its objects, and file locks are off.
///
/// Locks are not needed, because no other process uses an unfinished file and a finished one never changes. They fail
/// on some network file systems, and a child process that another thread starts while a file is open would keep the
/// lock.
pub fn options() -> hdf5::FileBuilder {
    let mut options = hdf5::File::with_options();
    options.with_fapl(|fapl| fapl.fclose_degree(hdf5::file::FileCloseDegree::Strong).file_locking(false));
    options
}

/// Attribute of the packs that this program writes.
const KIND: &str = "kind";

/// Reads a sphere pack.
///
/// # Errors
/// The file cannot be read; the message says what is missing or wrong.
pub fn read(path: &Path) -> Result<Packing, String> {
    hdf5::silence_errors(true);
    let length = files::open_regular(path).and_then(|file| file.metadata()).map_err(|error| error.to_string())?.len();
    let sealed = match seal::check(path) {
        Ok(()) => true,
        Err(SealError::Missing) => false,
        Err(error) => return Err(format!("is damaged: {error}. Use an intact copy, or pack it again")),
    };
    let file = options().open(path).map_err(|error| format!("not a readable HDF5 file: {error}"))?;
    if !sealed && file.attr(KIND).is_ok() {
        return Err("is cut off or changed: its seal is missing. Use an intact copy, or pack it again".to_owned());
    }
    let column = |name: &str| -> Result<(Vec<usize>, Vec<f64>), String> {
        let dataset = file.dataset(name).map_err(|_| format!("has no dataset `{name}`"))?;
        let values = checked::values::<f64>(&dataset, length, true)
            .map_err(|error| format!("dataset `{name}` does not hold real numbers: {error}"))?;
        Ok((dataset.shape(), values))
    };
    let (shape, positions) = column("position")?;
    let (radius_shape, radii) = column("radius")?;
    let count = radii.len();
    if radius_shape != [count] || shape != [count, 3] {
        return Err(format!(
            "`position` and `radius` have the shapes {shape:?} and {radius_shape:?}; they must be [N, 3] and [N]"
        ));
    }
    let cell = if file.link_exists("cell") {
        let (shape, edges) = column("cell")?;
        if shape != [3, 3] {
            return Err(format!("`cell` has the shape {shape:?}; it must be [3, 3]"));
        }
        let cell = Cell::new(Mat3::from_column_slice(&edges));
        if !cell.volume().is_normal() {
            return Err(format!("`cell` is {edges:?}; it must have a finite volume"));
        }
        Some(cell)
    } else {
        None
    };
    let spheres: Vec<Sphere> = positions
        .chunks_exact(3)
        .zip(&radii)
        .map(|(x, &radius)| Sphere { position: Vec3::new(x[0], x[1], x[2]), radius })
        .collect();
    let bad = |s: &Sphere| !(s.radius > 0.0 && s.radius.is_finite() && s.position.iter().all(|x| x.is_finite()));
    if let Some(k) = spheres.iter().position(bad) {
        let s = &spheres[k];
        return Err(format!(
            "row {k} is the sphere {:?}, radius {}: coordinates must be finite and radii positive",
            s.position.as_slice(),
            s.radius
        ));
    }
    Ok(Packing { spheres, cell })
}

/// Writes a sphere pack; it replaces an existing file once the new one is complete.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, packing: &Packing) -> Result<(), String> {
    hdf5::silence_errors(true);
    let path = &files::target(path).map_err(|error| error.to_string())?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."));
    let temporary = tempfile::Builder::new()
        .prefix(".spheres")
        .suffix(".h5")
        .tempfile_in(folder)
        .map_err(|error| error.to_string())?
        .into_temp_path();
    let fill = || -> hdf5::Result<()> {
        let file = options().create(&temporary)?;
        let kind: hdf5::types::VarLenUnicode = "sphere pack".parse().unwrap_or_default();
        file.new_attr::<hdf5::types::VarLenUnicode>().create(KIND)?.write_scalar(&kind)?;
        let positions: Vec<[f64; 3]> = packing.spheres.iter().map(|s| s.position.into()).collect();
        let flat: &[f64] = bytemuck::cast_slice(&positions);
        let place = file.new_dataset::<f64>().shape([packing.spheres.len(), 3]).create("position")?;
        place.write_raw(flat)?;
        let radii: Vec<f64> = packing.spheres.iter().map(|s| s.radius).collect();
        let radius = file.new_dataset::<f64>().shape([radii.len()]).create("radius")?;
        radius.write_raw(&radii)?;
        let mut with_unit = vec![place, radius];
        if let Some(cell) = &packing.cell {
            let edges = file.new_dataset::<f64>().shape([3, 3]).create("cell")?;
            edges.write_raw(cell.matrix.as_slice())?;
            with_unit.push(edges);
        }
        for dataset in with_unit {
            let unit: hdf5::types::VarLenUnicode = "m".parse().unwrap_or_default();
            dataset.new_attr::<hdf5::types::VarLenUnicode>().create("unit")?.write_scalar(&unit)?;
        }
        file.close()
    };
    fill().map_err(|error| error.to_string())?;
    seal::append(&temporary).map_err(|error| error.to_string())?;
    temporary.persist(path).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reading returns the written pack bit for bit; other files are refused with a reason.
    #[test]
    fn packs_are_read_back_unchanged() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("pack.h5");
        let spheres = vec![
            Sphere { position: Vec3::new(0.1, -0.0, 1.0 / 3.0), radius: 0.5 },
            Sphere { position: Vec3::new(2.0, 1e-300, 3.0), radius: 0.25 },
        ];
        let matrix = Mat3::new(1.0, 0.2, 0.3, 0.0, 2.0, 0.1, 0.0, 0.0, 3.0);
        for cell in [None, Some(Cell::new(matrix))] {
            let packing = Packing { spheres: spheres.clone(), cell };
            write(&path, &packing).expect("written");
            assert_eq!(read(&path).expect("read"), packing);
        }
        std::fs::write(&path, "x y z r").expect("written");
        assert!(read(&path).expect_err("no HDF5").contains("HDF5"));
        let file = options().create(&path).expect("created");
        file.new_dataset::<f64>().shape([1]).create("radius").expect("a dataset");
        drop(file);
        assert!(read(&path).expect_err("no positions").contains("`position`"));
    }

    /// Files with a changed byte, cut files, and our files without a seal are refused; files of other programs need no seal.
    #[test]
    fn damaged_packs_are_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("pack.h5");
        let spheres = vec![Sphere { position: Vec3::new(0.1, 0.2, 0.3), radius: 0.5 }; 40];
        write(&path, &Packing { spheres, cell: None }).expect("written");
        let whole = std::fs::read(&path).expect("bytes");
        for at in [whole.len() / 2, whole.len() - 1] {
            let mut bytes = whole.clone();
            bytes[at] ^= 1;
            std::fs::write(&path, bytes).expect("written");
            let error = read(&path).expect_err("a changed byte");
            assert!(error.contains("damaged"), "{error}");
        }
        std::fs::write(&path, &whole[..whole.len() - 56]).expect("written");
        let error = read(&path).expect_err("no seal");
        assert!(error.contains("seal is missing"), "{error}");
    }

    /// A shape that the file cannot hold is refused before memory is allocated.
    #[test]
    fn impossible_shapes_are_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("pack.h5");
        let file = options().create(&path).expect("created");
        file.new_dataset::<f64>().chunk([16, 3]).shape([1 << 40, 3]).create("position").expect("a dataset");
        file.new_dataset::<f64>().chunk([16]).shape([1 << 40]).create("radius").expect("a dataset");
        drop(file);
        let error = read(&path).expect_err("terabytes");
        assert!(error.contains("claims the shape"), "{error}");
    }
}
