//! Lists the members of HDF5 groups without the HDF5 library, and checks all groups of a file before the library reads them.
//!
//! The library (1.10.8) reads the names of members from a heap whose length it does not check against the file: a forged file
//! makes it read beyond its buffers. This module knows old-style groups (HDF5 File Format Specification 3.0, sections II.A,
//! III.A.1, III.B to III.D, IV.A.2.r).

use std::collections::BTreeSet;
use std::path::Path;

use crate::hdf5_text::{Bytes, u16_at, u32_at, u64_at};

/// Type of the message in the object header of a group: addresses of its tree and of its heap.
pub(crate) const SYMBOL_TABLE: u16 = 0x11;
/// Largest number of nodes read for the list of members; in a forged file nodes may refer to each other.
const MOST_NODES: usize = 100_000;
/// Largest number of members, and longest name of one: their product limits the time that a forged file may take.
const MOST_MEMBERS: usize = 100_000;
const LONGEST_NAME: usize = 256;
/// Largest number of objects in a file.
const MOST_OBJECTS: usize = 10_000_000;

/// A member of a group.
pub(crate) struct Member {
    pub(crate) name: Vec<u8>,
    /// Address of its object header.
    pub(crate) address: u64,
    /// Addresses of tree and heap of a group, as its parent repeats them.
    pub(crate) table: Option<[u64; 2]>,
}

/// Checks that the lists of members of all groups lie in the file.
///
/// # Errors
/// The file is damaged, or has a layout that this program does not write.
pub fn check(path: &Path) -> Result<(), String> {
    let mut bytes = Bytes::open(path)?;
    let head = bytes.array::<96>(0)?;
    let mut objects = vec![(u64_at(&head, 64), table_of(&head[56..96]))];
    let mut known = BTreeSet::from([objects[0].0]);
    while let Some((address, repeated)) = objects.pop() {
        let messages = bytes.messages(address)?;
        let mut tables = messages.iter().filter(|message| message.kind == SYMBOL_TABLE);
        let table = match (tables.next(), tables.next()) {
            (None, _) => None,
            (Some(message), None) if !message.shared && message.data.len() >= 16 => {
                Some([u64_at(&message.data, 0), u64_at(&message.data, 8)])
            }
            _ => return Err("has a group that cannot be read".to_owned()),
        };
        if repeated.is_some() && repeated != table {
            return Err("has a group with two lists of members".to_owned());
        }
        let Some(table) = table else { continue };
        for member in members(&mut bytes, table)? {
            if known.insert(member.address) {
                objects.push((member.address, member.table));
            } else if member.table.is_some() {
                return Err("has a group with two names".to_owned());
            }
        }
        if known.len() > MOST_OBJECTS {
            return Err(format!("has more than {MOST_OBJECTS} objects"));
        }
    }
    Ok(())
}

/// Addresses of tree and heap that an entry of a list of members repeats.
fn table_of(entry: &[u8]) -> Option<[u64; 2]> {
    (u32_at(entry, 16) == 1).then(|| [u64_at(entry, 24), u64_at(entry, 32)])
}

/// Members of a group: a B-tree of nodes with entries, whose names lie in a local heap. Symbolic links are left out.
pub(crate) fn members(bytes: &mut Bytes, [tree, heap]: [u64; 2]) -> Result<Vec<Member>, String> {
    let head = bytes.array::<32>(heap)?;
    if &head[..4] != b"HEAP" {
        return Err("refers to an address without names".to_owned());
    }
    let names = bytes.read(u64_at(&head, 24), u64_at(&head, 8))?;
    let mut nodes = vec![tree];
    let (mut next, mut members) = (0, Vec::new());
    while let Some(&at) = nodes.get(next) {
        next += 1;
        if nodes.len() > MOST_NODES {
            return Err(format!("has more than {MOST_NODES} nodes in its list of members"));
        }
        let head = bytes.array::<8>(at)?;
        let count = u64::from(u16_at(&head, 6));
        if members.len() + usize::from(u16_at(&head, 6)) > MOST_MEMBERS {
            return Err(format!("has more than {MOST_MEMBERS} members"));
        }
        match &head[..4] {
            // Type 0: a list of members. Keys and children alternate.
            b"TREE" if head[4] == 0 => {
                let children = bytes.read(at.saturating_add(24), 16 * count)?;
                nodes.extend(children.chunks_exact(16).map(|child| u64_at(child, 8)));
            }
            b"SNOD" => {
                for entry in bytes.read(at.saturating_add(8), 40 * count)?.chunks_exact(40) {
                    let name = usize::try_from(u64_at(entry, 0)).ok().and_then(|at| names.get(at..));
                    let name = name.map(|rest| &rest[..rest.len().min(LONGEST_NAME)]);
                    let name = name.and_then(|rest| rest.split(|byte| *byte == 0).next());
                    let name = name.ok_or("has a member whose name lies outside of the list of names")?;
                    // A cache of type 2 is a symbolic link.
                    if u32_at(entry, 16) != 2 {
                        members.push(Member { name: name.to_vec(), address: u64_at(entry, 8), table: table_of(entry) });
                    }
                }
            }
            _ => return Err("refers to an address without members".to_owned()),
        }
    }
    Ok(members)
}
