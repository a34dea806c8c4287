//! Changes the tables of an HDF5 file by the library, so that the file itself stays sound.

use std::path::Path;

use concordem_tests::random::Random;
use hdf5::{Dataset, File, Group, Result};

/// Numbers that counts, indices, and measured values must not be.
const NUMBERS: [f64; 8] = [0.0, -1.0, 1.0, 65_536.0, 4_294_967_295.0, 1e19, f64::NAN, f64::INFINITY];

/// Removes, replaces, or changes one to three tables, groups, or attributes.
pub fn forge(path: &Path, random: &mut Random) {
    // What the library refuses to change stays as it is.
    let Ok(file) = File::open_rw(path) else { return };
    for _ in 0..=random.below(3) {
        let _ = change(&file, random);
    }
}

fn change(file: &File, random: &mut Random) -> Result<()> {
    let mut parent: Group = file.as_group()?;
    while random.below(3) > 0 {
        let inner = parent.groups()?;
        if inner.is_empty() {
            break;
        }
        parent = random.one_of(&inner);
    }
    let names = parent.member_names()?;
    if names.is_empty() || random.below(8) == 0 {
        let attributes = parent.attr_names()?;
        return if attributes.is_empty() { Ok(()) } else { parent.delete_attr(&random.one_of(&attributes)) };
    }
    let name = random.one_of(&names);
    match random.below(5) {
        0 => parent.unlink(&name),
        1 => {
            parent.unlink(&name)?;
            let length = [0, 1, 2, 1_000][random.below(4)];
            let values = vec![random.one_of(&NUMBERS); length];
            match random.below(4) {
                0 => parent.new_dataset_builder().with_data(&values).create(name.as_str())?,
                1 => parent
                    .new_dataset_builder()
                    .with_data(&values.iter().map(|v| *v as u64).collect::<Vec<_>>())
                    .create(name.as_str())?,
                2 => parent.new_dataset::<u8>().shape((length, 3)).create(name.as_str())?,
                _ => parent.new_dataset::<f64>().shape((length, 3, 3)).create(name.as_str())?,
            };
            Ok(())
        }
        _ => renumber(&parent.dataset(&name)?, random),
    }
}

/// Changes one number of a table.
fn renumber(table: &Dataset, random: &mut Random) -> Result<()> {
    let mut values = table.read_raw::<f64>()?;
    let at = random.below(values.len());
    if let Some(value) = values.get_mut(at) {
        *value = random.one_of(&NUMBERS);
        table.write_raw(&values)?;
    }
    Ok(())
}
