//! Reads plain HDF5 files of other programs without the HDF5 library, which can crash on forged files.
//!
//! A plain file has superblock 0, object headers of version 1, old-style groups, and real numbers that lie in one block:
//! what the library and h5py write by default, without chunks and compression. Every offset and length is checked against
//! the file (HDF5 File Format Specification 3.0, sections II.A, III.A.1, III.B to III.D, IV.A.1, IV.A.2.b, d, i, r).

use std::collections::BTreeMap;
use std::path::Path;

use crate::hdf5_groups::{SYMBOL_TABLE, members};
use crate::hdf5_text::{Bytes, Message, u32_at, u64_at};

/// How to make a file that can be read; ends messages.
pub const REMEDY: &str = "Write it in HDF5's oldest format without chunks and compression, as h5py does by default (`h5repack -l \
                          CONTI -f NONE OLD NEW` converts a file), or as text with the columns x y z r";

/// Types of the messages in an object header.
mod kind {
    pub const DATASPACE: u16 = 0x01;
    pub const DATATYPE: u16 = 0x03;
    pub const LAYOUT: u16 = 0x08;
}

/// A plain HDF5 file.
pub struct FlatFile {
    bytes: Bytes,
    /// Address of the root group.
    root: u64,
    /// Addresses of the members of the root group.
    members: BTreeMap<Vec<u8>, u64>,
}

/// Shape and values of a dataset, in row-major order.
pub struct Numbers {
    /// Shape.
    pub shape: Vec<usize>,
    /// Values.
    pub values: Vec<f64>,
}

impl FlatFile {
    /// Opens a file and lists its members.
    ///
    /// # Errors
    /// The file is not HDF5, not plain, or damaged.
    pub fn open(path: &Path) -> Result<Self, String> {
        let mut bytes = Bytes::open(path)?;
        let head = bytes.array::<72>(0)?;
        if u64_at(&head, 24) != 0 {
            return Err("begins with the data of another program".to_owned());
        }
        let mut file = Self { bytes, root: u64_at(&head, 64), members: BTreeMap::new() };
        let table = file.message(file.root, SYMBOL_TABLE, 16).map_err(|_| "has a group of another layout")?;
        let members = members(&mut file.bytes, [u64_at(&table, 0), u64_at(&table, 8)])?;
        file.members = members.into_iter().map(|member| (member.name, member.address)).collect();
        Ok(file)
    }

    /// Whether the root group has a member of this name.
    pub fn has(&self, name: &str) -> bool {
        self.members.contains_key(name.as_bytes())
    }

    /// Whether the root group has an attribute of this name.
    ///
    /// # Errors
    /// The file is damaged.
    pub fn has_attribute(&mut self, name: &str) -> Result<bool, String> {
        self.bytes.has_attribute(self.root, name.as_bytes())
    }

    /// The only message of this type in the header of an object, with at least `length` bytes.
    fn message(&mut self, object: u64, kind: u16, length: usize) -> Result<Vec<u8>, String> {
        let mut found = self.bytes.messages(object)?.into_iter().filter(|message| message.kind == kind);
        match (found.next(), found.next()) {
            (Some(Message { data, shared: false, .. }), None) if data.len() >= length => Ok(data),
            _ => Err("has no description that can be read".to_owned()),
        }
    }

    /// The real numbers of a dataset.
    ///
    /// # Errors
    /// There is no such dataset, it does not hold real numbers in one block, or its shape does not fit the file.
    pub fn numbers(&mut self, name: &str) -> Result<Numbers, String> {
        let at = *self.members.get(name.as_bytes()).ok_or("does not exist")?;
        let shape = shape_of(&self.message(at, kind::DATASPACE, 4)?)?;
        let real =
            Real::of(&self.message(at, kind::DATATYPE, 8)?).ok_or("does not hold real numbers of 4 or 8 bytes")?;
        let too_large =
            || format!("claims the shape {shape:?}, more than its file of {} bytes can hold", self.bytes.length());
        let count = shape.iter().try_fold(1_usize, |product, &n| product.checked_mul(n)).ok_or_else(too_large)?;
        let size = (count as u64).checked_mul(real.size as u64).filter(|size| *size <= self.bytes.length());
        let size = size.ok_or_else(too_large)?;
        let layout = self.message(at, kind::LAYOUT, 4)?;
        let stored = match (layout[0], layout[1]) {
            (3, 0) => layout.get(4..4 + size as usize).map(<[u8]>::to_vec),
            (3, 1) if count == 0 => Some(Vec::new()),
            // All bits set: no values were written, or they lie in another file.
            (3, 1) if layout.len() >= 18 && u64_at(&layout, 2) != u64::MAX && u64_at(&layout, 10) >= size => {
                Some(self.bytes.read(u64_at(&layout, 2), size)?)
            }
            (3, 1) => None,
            (3, 2) => return Err("is stored in chunks".to_owned()),
            (version, _) => return Err(format!("has a layout of version {version}")),
        };
        let stored = stored.ok_or("has fewer values than its shape")?;
        Ok(Numbers { values: stored.chunks_exact(real.size).map(|bytes| real.value(bytes)).collect(), shape })
    }
}

/// Shape in a dataspace message.
fn shape_of(space: &[u8]) -> Result<Vec<usize>, String> {
    let first = match space[0] {
        1 => 8,
        // Type 2: no values at all.
        2 if space[3] != 2 => 4,
        _ => return Err("has no values".to_owned()),
    };
    let sizes = space.get(first..first + 8 * usize::from(space[1])).ok_or("has a shape that is cut off")?;
    sizes
        .chunks_exact(8)
        .map(|n| usize::try_from(u64_at(n, 0)).map_err(|_| "has an impossible shape".to_owned()))
        .collect()
}

/// How a real number is stored: IEEE 754 with 4 or 8 bytes.
struct Real {
    size: usize,
    big_endian: bool,
}

impl Real {
    /// From a datatype message; `None` for other types.
    fn of(datatype: &[u8]) -> Option<Self> {
        let properties = datatype.get(8..20)?;
        let size = u32_at(datatype, 4);
        // Offset and bits; position and size of exponent and mantissa; bias of the exponent; position of the sign.
        let (ieee, sign) = match size {
            4 => ([0, 0, 32, 0, 23, 8, 0, 23, 127, 0, 0, 0], 31),
            8 => ([0, 0, 64, 0, 52, 11, 0, 52, 255, 3, 0, 0], 63),
            _ => return None,
        };
        // Class 1 is real. Bits 0 and 6 of the flags: order of the bytes; bits 4 and 5: the mantissa begins with an implied 1.
        let plain = datatype[0] & 0x0f == 1 && datatype[1] & 0x70 == 0x20 && datatype[2] == sign && properties == ieee;
        plain.then_some(Self { size: size as usize, big_endian: datatype[1] & 1 == 1 })
    }

    fn value(&self, bytes: &[u8]) -> f64 {
        let bits = |at: usize| u64::from(bytes[if self.big_endian { self.size - 1 - at } else { at }]) << (8 * at);
        let bits = (0..self.size).map(bits).sum::<u64>();
        if self.size == 4 { f64::from(f32::from_bits(bits as u32)) } else { f64::from_bits(bits) }
    }
}
