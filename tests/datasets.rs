//! Datasets of HDF5 files, to compare them bit for bit.

use std::collections::BTreeMap;
use std::path::Path;

/// Contents of a file without attributes (which say when and how it was made): type, shape, and bits of every dataset, by path.
pub type Contents = BTreeMap<String, (String, Vec<usize>, Vec<u64>)>;

/// The datasets of a file.
pub fn datasets(path: &Path) -> Contents {
    let mut all = BTreeMap::new();
    collect(&hdf5::File::open(path).expect("an HDF5 file"), "", &mut all);
    all
}

fn collect(group: &hdf5::Group, prefix: &str, all: &mut Contents) {
    use hdf5::types::{FloatSize, TypeDescriptor, VarLenUnicode};
    for name in group.member_names().expect("a readable group") {
        let path = format!("{prefix}{name}");
        if let Ok(inner) = group.group(&name) {
            collect(&inner, &format!("{path}/"), all);
            continue;
        }
        let data = group.dataset(&name).expect("a group or a dataset");
        let kind = data.dtype().and_then(|kind| kind.to_descriptor()).expect("a type");
        let bits = match &kind {
            // The library fails to read an empty dataset.
            _ if data.size() == 0 => Vec::new(),
            TypeDescriptor::Float(FloatSize::U8) => {
                data.read_raw::<f64>().expect("reals").into_iter().map(f64::to_bits).collect()
            }
            TypeDescriptor::Unsigned(_) => data.read_raw::<u64>().expect("numbers"),
            TypeDescriptor::Integer(_) => {
                data.read_raw::<i64>().expect("numbers").into_iter().map(i64::cast_unsigned).collect()
            }
            TypeDescriptor::VarLenUnicode => {
                let text: VarLenUnicode = data.read_scalar().expect("a text");
                text.bytes().map(u64::from).collect()
            }
            other => panic!("{path} holds {other}, which is not compared yet"),
        };
        all.insert(path, (kind.to_string(), data.shape(), bits));
    }
}
