//! Sphere packs in HDF5: `position` (N×3, m), `radius` (N, m), and for a periodic pack `cell` (3×3, m; a row is an
//! edge vector). Units are attributes. Any program may write such files, as plain HDF5 ([`crate::flat_hdf5`]). Files of this
//! program end with a seal ([`crate::seal`]); their attribute `kind` says that the seal is required. A seal is always
//! checked if present. The HDF5 library writes packs, but does not read them.

use std::path::Path;

use crate::checked_hdf5::options;
use crate::flat_hdf5::{FlatFile, Numbers, REMEDY};
use crate::paths;
use crate::seal::{self, SealError};
use concordem_contact::math::{Mat3, Vec3};
use concordem_packing::Packing;
use concordem_solver::state::{Cell, Sphere};

/// Attribute of the packs that this program writes.
const KIND: &str = "kind";

/// Reads a sphere pack.
///
/// # Errors
/// The file cannot be read; the message says what is missing or wrong.
pub fn read(path: &Path) -> Result<Packing, String> {
    paths::open_regular(path).map_err(|error| error.to_string())?;
    let sealed = match seal::check(path) {
        Ok(()) => true,
        Err(SealError::Missing) => false,
        Err(error) => return Err(format!("is damaged: {error}. Use an intact copy, or pack it again")),
    };
    let unreadable = |problem| format!("cannot be read as HDF5: it {problem}. {REMEDY}");
    let mut file = FlatFile::open(path).map_err(unreadable)?;
    if !sealed && file.has_attribute(KIND).map_err(unreadable)? {
        return Err("is cut off or changed: its seal is missing. Use an intact copy, or pack it again".to_owned());
    }
    let has_cell = file.has("cell");
    let mut column = |name: &str| -> Result<(Vec<usize>, Vec<f64>), String> {
        if !file.has(name) {
            return Err(format!("has no dataset `{name}`"));
        }
        let read = file.numbers(name).map_err(|problem| format!("cannot be read: `{name}` {problem}. {REMEDY}"))?;
        let Numbers { shape, values } = read;
        Ok((shape, values))
    };
    let (shape, positions) = column("position")?;
    let (radius_shape, radii) = column("radius")?;
    let count = radii.len();
    if radius_shape != [count] || shape != [count, 3] {
        return Err(format!(
            "`position` and `radius` have the shapes {shape:?} and {radius_shape:?}; they must be [N, 3] and [N]"
        ));
    }
    let cell = if has_cell {
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
    let path = &paths::target(path).map_err(|error| error.to_string())?;
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."));
    let unfinished = paths::new_unfinished(folder).map_err(|error| error.to_string())?;
    let temporary = unfinished.path();
    let fill = || -> hdf5::Result<()> {
        let file = options().create(temporary)?;
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
            // Dropping a dataset writes what the library still holds back, and reports no errors.
            dataset.flush()?;
        }
        file.flush()?;
        file.close()
    };
    fill().map_err(|error| error.to_string())?;
    seal::append(temporary).map_err(|error| error.to_string())?;
    if !is_same(&read(temporary)?, packing) {
        return Err("what was written, read back, differs: the disk or the file system lost it".to_owned());
    }
    paths::put_in_place(unfinished, path).map_err(|error| error.to_string())?;
    paths::sync_folder(folder).map_err(|error| error.to_string())
}

/// Whether two packings have equal bits.
fn is_same(one: &Packing, other: &Packing) -> bool {
    let bits = |packing: &Packing| -> Vec<u64> {
        let spheres = packing.spheres.iter().flat_map(|s| [s.position.x, s.position.y, s.position.z, s.radius]);
        let edges = packing.cell.iter().flat_map(|cell| cell.matrix.iter().copied());
        spheres.chain(edges).map(f64::to_bits).collect()
    };
    bits(one) == bits(other)
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
        file.new_dataset::<f64>().shape([1 << 40, 3]).create("position").expect("a dataset");
        file.new_dataset::<f64>().shape([1 << 40]).create("radius").expect("a dataset");
        drop(file);
        let error = read(&path).expect_err("terabytes");
        assert!(error.contains("claims the shape"), "{error}");
    }

    /// Packs of other programs are read without the HDF5 library: single precision, big-endian numbers, and so many other
    /// datasets that the list of members is a tree of several levels.
    #[test]
    fn packs_of_other_programs_are_read() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("pack.h5");
        let file = options().create(&path).expect("created");
        for k in 0..400 {
            file.new_dataset::<i32>().shape([1]).create(&*format!("other {k}")).expect("a dataset");
        }
        let place = file.new_dataset::<f32>().shape([2, 3]).create("position").expect("a dataset");
        place.write_raw(&[0.5_f32, 0.25, -1.5, 3.0, 4.0, 5.0]).expect("written");
        let radius = file.new_dataset::<f64>().shape([2]).create("radius").expect("a dataset");
        radius.write_raw(&[0.125, 1.0 / 3.0]).expect("written");
        drop((place, radius, file));
        let packing = read(&path).expect("read");
        assert_eq!(packing.cell, None);
        let spheres = [
            Sphere { position: Vec3::new(0.5, 0.25, -1.5), radius: 0.125 },
            Sphere { position: Vec3::new(3.0, 4.0, 5.0), radius: 1.0 / 3.0 },
        ];
        assert_eq!(packing.spheres, spheres);
        // The same file with the bytes of its radii in the other order, which the flag of their type says.
        let mut bytes = std::fs::read(&path).expect("bytes");
        let find = |what: &[u8]| bytes.windows(what.len()).position(|window| window == what).expect("found");
        let radii = [0.125_f64, 1.0 / 3.0].map(f64::to_le_bytes).concat();
        let (at, kind) = (find(&radii), find(&[0x11, 0x20, 0x3f, 0, 8, 0, 0, 0]));
        bytes[at..at + 16].copy_from_slice(&[0.125_f64, 1.0 / 3.0].map(f64::to_be_bytes).concat());
        bytes[kind + 1] |= 1;
        std::fs::write(&path, bytes).expect("written");
        assert_eq!(read(&path).expect("read").spheres, spheres);
    }

    /// What is not plain is refused with a remedy: chunks, integers, text, no values, another format.
    #[test]
    fn other_layouts_are_refused_with_a_remedy() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("pack.h5");
        let refuse = |what: &str, make: &dyn Fn(&hdf5::File)| {
            let file = options().create(&path).expect("created");
            file.new_dataset::<f64>()
                .shape([1])
                .create("radius")
                .expect("a dataset")
                .write_raw(&[1.0])
                .expect("written");
            make(&file);
            drop(file);
            let error = read(&path).expect_err(what);
            assert!(error.contains(what) && error.contains("h5repack") && error.contains("x y z r"), "{what}: {error}");
        };
        refuse("is stored in chunks", &|file| {
            let place = file.new_dataset::<f64>().chunk([1, 3]).shape([1, 3]).create("position").expect("a dataset");
            place.write_raw(&[1.0, 2.0, 3.0]).expect("written");
        });
        refuse("does not hold real numbers", &|file| {
            let place = file.new_dataset::<i64>().shape([1, 3]).create("position").expect("a dataset");
            place.write_raw(&[1_i64, 2, 3]).expect("written");
        });
        refuse("does not hold real numbers", &|file| {
            let text: hdf5::types::VarLenUnicode = "1 2 3".parse().expect("text");
            let place = file.new_dataset::<hdf5::types::VarLenUnicode>().create("position").expect("a dataset");
            place.write_scalar(&text).expect("written");
        });
        refuse("has fewer values", &|file| {
            file.new_dataset::<f64>().shape([1, 3]).create("position").expect("a dataset");
        });
        let mut newer = options();
        newer.with_fapl(|fapl| fapl.libver_latest());
        drop(newer.create(&path).expect("created"));
        let error = read(&path).expect_err("another format");
        assert!(error.contains("layout") && error.contains("h5repack"), "{error}");
    }
}
