//! Reads strings of HDF5 files without the HDF5 library.
//!
//! Strings of variable length are stored in global heaps, which the library (1.10.8) reads without checking lengths and
//! indices: a forged file makes it write beyond its buffers, or loop forever. This module reads the bytes from the object
//! header to the heap and checks every offset and length. It supports only the layout that this program writes: superblock
//! 0, object headers of version 1 (HDF5 File Format Specification 3.0, sections II.A, III.E, IV.A.1, IV.A.2.m).

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use hdf5::{Dataset, Location};

/// Largest number of blocks read for one object header; in a forged file blocks may refer to each other.
const MOST_BLOCKS: usize = 64;
/// Length of the parts that are read from the disk, bytes: what describes an object mostly lies in one of them.
const PART: u64 = 4096;
/// Type of the message that points to the continuation of an object header.
const CONTINUATION: u16 = 0x10;
/// Type of the message that holds an attribute.
const ATTRIBUTE: u16 = 0x0c;

/// The string in an attribute of an object in the file at `path`.
///
/// # Errors
/// There is no such attribute, it is not a string, or the file is damaged.
pub fn attribute(path: &Path, object: &Location, name: &str) -> Result<String, String> {
    let mut bytes = Bytes::open(path)?;
    let reference = bytes.attribute(address(object)?, name.as_bytes())?;
    bytes.heap_text(&reference)
}

/// Names of all attributes of an object in the file at `path`.
///
/// # Errors
/// The file is damaged.
pub fn attribute_names(path: &Path, object: &Location) -> Result<Vec<String>, String> {
    let messages = Bytes::open(path)?.attribute_messages(address(object)?)?;
    let names = messages.iter().filter_map(|message| Attribute::of(message));
    names
        .map(|found| String::from_utf8(found.name.to_vec()).map_err(|_| "has a name that is not UTF-8".to_owned()))
        .collect()
}

/// The string in a scalar dataset in the file at `path`.
///
/// # Errors
/// It is not a string, or the file is damaged.
pub fn dataset(path: &Path, dataset: &Dataset) -> Result<String, String> {
    let offset = dataset.offset().ok_or("has no address in the file")?;
    let mut bytes = Bytes::open(path)?;
    let reference = bytes.array::<16>(offset)?;
    bytes.heap_text(&reference)
}

/// Address of an object in its file. The crate exposes it only in the debug output of a token.
fn address(object: &Location) -> Result<u64, String> {
    let info = object.loc_info().map_err(|error| error.to_string())?;
    let shown = format!("{:?}", info.token);
    address_in(&shown).ok_or_else(|| format!("has no address ({shown})"))
}

/// Reads the debug output of a token: the address itself before HDF5 1.12, later 16 bytes that begin with it, the lowest byte first.
fn address_in(shown: &str) -> Option<u64> {
    let Some((_, list)) = shown.split_once('[') else {
        let digits: String = shown.chars().filter(char::is_ascii_digit).collect();
        return digits.parse().ok();
    };
    let bytes: Option<Vec<u8>> = list.split_once(']')?.0.split(',').map(|byte| byte.trim().parse().ok()).collect();
    Some(u64::from_le_bytes(*bytes?.first_chunk()?))
}

/// A message in an object header.
pub(crate) struct Message {
    /// Type.
    pub(crate) kind: u16,
    /// Whether the content is stored elsewhere; this program does not write such messages.
    pub(crate) shared: bool,
    /// Content.
    pub(crate) data: Vec<u8>,
}

/// A file that is read at checked offsets.
pub(crate) struct Bytes {
    file: File,
    length: u64,
    /// Where the part that was read last begins, and its bytes: most reads are of a few bytes near the last ones.
    part: (u64, Vec<u8>),
}

impl Bytes {
    /// Length of the file.
    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    pub(crate) fn open(path: &Path) -> Result<Self, String> {
        let say = |error: io::Error| error.to_string();
        let file = File::open(path).map_err(say)?;
        let length = file.metadata().map_err(say)?.len();
        let mut bytes = Self { file, length, part: (0, Vec::new()) };
        let head = bytes.array::<16>(0)?;
        // Version 0 with addresses and lengths of 8 bytes.
        if &head[..8] != b"\x89HDF\r\n\x1a\n" {
            return Err("is not in an HDF5 file".to_owned());
        }
        if head[8] != 0 || head[13..15] != [8, 8] {
            return Err("is in a file with a layout that this program does not write".to_owned());
        }
        Ok(bytes)
    }

    /// Reads `count` bytes at offset `at`.
    pub(crate) fn read(&mut self, at: u64, count: u64) -> Result<Vec<u8>, String> {
        let Some(end) = at.checked_add(count).filter(|end| *end <= self.length) else {
            return Err("refers to an address beyond the end of the file".to_owned());
        };
        if count > PART {
            return self.read_disk(at, count);
        }
        let (first, part) = &self.part;
        if at < *first || end > first + part.len() as u64 {
            let first = at - at % PART;
            self.part = (first, self.read_disk(first, (2 * PART).min(self.length - first))?);
        }
        let (first, part) = &self.part;
        let skipped = (at - first) as usize;
        Ok(part[skipped..skipped + count as usize].to_vec())
    }

    /// Reads `count` bytes at offset `at`, which the file has.
    fn read_disk(&mut self, at: u64, count: u64) -> Result<Vec<u8>, String> {
        let mut bytes = vec![0; count as usize];
        let found = self.file.seek(SeekFrom::Start(at)).and_then(|_| self.file.read_exact(&mut bytes));
        found.map_err(|error| error.to_string())?;
        Ok(bytes)
    }

    /// Reads an array of bytes at offset `at`.
    pub(crate) fn array<const N: usize>(&mut self, at: u64) -> Result<[u8; N], String> {
        let bytes = self.read(at, N as u64)?;
        bytes.try_into().map_err(|_| "is cut off".to_owned())
    }

    /// The reference to the string in an attribute of the object whose header is at `at`.
    fn attribute(&mut self, at: u64, name: &[u8]) -> Result<[u8; 16], String> {
        for message in self.attribute_messages(at)? {
            if let Some(found) = text_reference(&message, name)? {
                return Ok(found);
            }
        }
        Err("does not exist".to_owned())
    }

    /// Whether the object whose header is at `at` has an attribute of this name.
    pub(crate) fn has_attribute(&mut self, at: u64, name: &[u8]) -> Result<bool, String> {
        let messages = self.attribute_messages(at)?;
        Ok(messages.iter().filter_map(|message| Attribute::of(message)).any(|attribute| attribute.name == name))
    }

    /// The messages of all attributes of the object whose header is at `at`.
    fn attribute_messages(&mut self, at: u64) -> Result<Vec<Vec<u8>>, String> {
        let messages = self.messages(at)?.into_iter();
        Ok(messages
            .filter(|message| message.kind == ATTRIBUTE && !message.shared)
            .map(|message| message.data)
            .collect())
    }

    /// All messages of the object whose header is at `at`.
    pub(crate) fn messages(&mut self, at: u64) -> Result<Vec<Message>, String> {
        let head = self.array::<16>(at)?;
        if head[0] != 1 {
            return Err(format!("belongs to an object with a header of version {}", head[0]));
        }
        let mut blocks = vec![(at.saturating_add(16), u64::from(u32_at(&head, 8)))];
        let (mut next, mut messages) = (0, Vec::new());
        while let Some(&(from, length)) = blocks.get(next) {
            next += 1;
            let block = self.read(from, length)?;
            let mut rest = &block[..];
            while rest.len() >= 8 {
                let (kind, size, flags) = (u16_at(rest, 0), usize::from(u16_at(rest, 2)), rest[4]);
                let Some(message) = rest.get(8..8 + size) else { return Err("is cut off".to_owned()) };
                if kind == CONTINUATION && size >= 16 && blocks.len() < MOST_BLOCKS {
                    blocks.push((u64_at(message, 0), u64_at(message, 8)));
                }
                messages.push(Message { kind, shared: flags & 2 != 0, data: message.to_vec() });
                rest = &rest[8 + size..];
            }
        }
        Ok(messages)
    }

    /// The string behind a reference, which consists of length, address of a global heap, and index of an object in it.
    fn heap_text(&mut self, reference: &[u8; 16]) -> Result<String, String> {
        let (length, at, wanted) = (u64::from(u32_at(reference, 0)), u64_at(reference, 4), u32_at(reference, 12));
        if length == 0 {
            return Ok(String::new());
        }
        let head = self.array::<16>(at)?;
        if &head[..4] != b"GCOL" {
            return Err("refers to an address without a heap".to_owned());
        }
        let heap = self.read(at, u64_at(&head, 8))?;
        let mut rest = heap.get(16..).unwrap_or_default();
        while rest.len() >= 16 {
            let (index, size) = (u32::from(u16_at(rest, 0)), u64_at(rest, 8));
            // Object 0 is the free space at the end.
            let whole = usize::try_from(size).ok().and_then(|size| size.checked_next_multiple_of(8)?.checked_add(16));
            let Some(whole) = whole.filter(|whole| index != 0 && *whole <= rest.len()) else { break };
            if index == wanted {
                if size != length {
                    return Err(format!("has {length} bytes, but {size} are stored"));
                }
                let text = rest[16..16 + size as usize].to_vec();
                return String::from_utf8(text).map_err(|_| "is a string with bytes that are not UTF-8".to_owned());
            }
            rest = &rest[whole..];
        }
        Err("refers to a string that its heap does not contain".to_owned())
    }
}

/// Parts of an attribute message.
struct Attribute<'a> {
    name: &'a [u8],
    kind: &'a [u8],
    space: &'a [u8],
    data: &'a [u8],
}

impl<'a> Attribute<'a> {
    /// `None` if the message has an unknown version or is cut off.
    fn of(message: &'a [u8]) -> Option<Self> {
        if message.len() < 8 {
            return None;
        }
        let (first, padded) = match message[0] {
            1 => (8, true),
            2 => (8, false),
            3 => (9, false),
            _ => return None,
        };
        let mut rest = message.get(first..)?;
        let mut part = |at: usize| {
            let size = usize::from(u16_at(message, at));
            let (part, others) = rest.split_at_checked(if padded { size.next_multiple_of(8) } else { size })?;
            rest = others;
            part.get(..size)
        };
        let (name, kind, space) = (part(2)?, part(4)?, part(6)?);
        Some(Self { name: name.split(|byte| *byte == 0).next()?, kind, space, data: rest })
    }
}

/// The reference in an attribute message, if the attribute has this name.
fn text_reference(message: &[u8], name: &[u8]) -> Result<Option<[u8; 16]>, String> {
    let Some(Attribute { kind, space, data, .. }) = Attribute::of(message).filter(|found| found.name == name) else {
        return Ok(None);
    };
    // Class 9: variable length; kind 1: string; the 16 bytes are a length, an address, and an index.
    let text = kind.len() >= 8 && kind[0] & 0x0f == 9 && kind[1] & 0x0f == 1 && u32_at(kind, 4) == 16;
    let scalar = space.len() >= 4 && space[1] == 0 && (space[0] == 1 || (space[0] == 2 && space[3] == 0));
    match data.first_chunk::<16>() {
        Some(reference) if text && scalar => Ok(Some(*reference)),
        _ => Err("is not a string".to_owned()),
    }
}

pub(crate) fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

pub(crate) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from(u16_at(bytes, at)) | u32::from(u16_at(bytes, at + 2)) << 16
}

pub(crate) fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from(u32_at(bytes, at)) | u64::from(u32_at(bytes, at + 4)) << 32
}

#[cfg(test)]
mod tests {
    use super::*;
    use hdf5::types::VarLenUnicode;

    /// The debug output of tokens of HDF5 1.10 and of HDF5 2.
    #[test]
    fn addresses_are_read_from_the_tokens_of_old_and_new_libraries() {
        assert_eq!(address_in("LocationToken(228192)"), Some(228_192));
        let new = "LocationToken(H5O_token_t { __data: [96, 123, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0] })";
        assert_eq!(address_in(new), Some(228_192));
        assert_eq!(address_in("LocationToken(H5O_token_t { __data: [96, 123] })"), None);
    }

    /// Strings are read back unchanged: in attributes so many that headers have continuations, and in datasets; empty
    /// and long.
    #[test]
    fn strings_are_read_back_unchanged() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("texts.h5");
        let texts: Vec<String> = (0..40).map(|k| "±ü".repeat(k * k)).collect();
        let file = crate::checked_hdf5::options().create(&path).expect("a file");
        let group = file.create_group("g").expect("a group");
        for (k, text) in texts.iter().enumerate() {
            let text: VarLenUnicode = text.parse().expect("a text");
            let attribute = group.new_attr::<VarLenUnicode>().create(&*format!("a{k}")).expect("an attribute");
            attribute.write_scalar(&text).expect("written");
            let data = group.new_dataset::<VarLenUnicode>().create(&*format!("d{k}")).expect("a dataset");
            data.write_scalar(&text).expect("written");
        }
        group.new_attr::<f64>().create("number").and_then(|a| a.write_scalar(&1.0)).expect("written");
        file.close().expect("closed");
        let file = crate::checked_hdf5::options().open(&path).expect("a file");
        let group = file.group("g").expect("the group");
        for (k, text) in texts.iter().enumerate() {
            assert_eq!(attribute(&path, &group, &format!("a{k}")).expect("a text"), *text);
            assert_eq!(dataset(&path, &group.dataset(&format!("d{k}")).expect("it")).expect("a text"), *text);
        }
        assert_eq!(attribute(&path, &group, "number"), Err("is not a string".to_owned()));
        assert_eq!(attribute(&path, &group, "none"), Err("does not exist".to_owned()));
        let names = attribute_names(&path, &group).expect("names");
        assert!(names.len() == 41 && (0..40).all(|k| names.contains(&format!("a{k}"))), "{names:?}");
    }
}
