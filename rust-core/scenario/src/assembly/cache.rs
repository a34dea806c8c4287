//! Stores packings that take long to make, so that `check`, `run`, and `resume` of a scenario make them once.
//!
//! A file holds the numbers of one packing, bit for bit, and a hash of itself. Its name is the hash of everything that the packing depends
//! on: its keys, the mesh that it fills, and the program. A file that is damaged is ignored; a folder that cannot be written to, too.

use std::fs;
use std::path::{Path, PathBuf};

use concordem_contact::math::{Mat3, Vec3};
use concordem_packing::Packing;
use concordem_solver::state::{Cell, Sphere};

/// Size of all files, bytes, above which the oldest are removed.
const LARGEST: u64 = 2 << 30;
const MAGIC: &[u8] = b"concordem packing 1\n";
/// Length of the hash at the end.
const HASH: usize = 32;

/// Name of the stage in which a packing is read from the cache.
pub(super) const FROM_CACHE: &str = "from cache";

/// A folder with packings.
#[derive(Debug, Clone)]
pub struct PackingCache {
    folder: PathBuf,
    /// Identity of the program: another program may make another packing from the same keys.
    program: String,
}

/// A packing with the facts that a [`super::Placed`] holds besides.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Stored {
    pub packing: Packing,
    /// Pairs of spheres that become bonds, if the packing determines them.
    pub links: Option<Vec<[u32; 2]>>,
    /// Other numbers, in an order that the caller knows.
    pub numbers: Vec<f64>,
}

impl PackingCache {
    /// A cache in `folder`, which is made when needed; `program` identifies the program.
    pub fn new(folder: PathBuf, program: String) -> Self {
        Self { folder, program }
    }

    /// The file of the packing that depends on these texts and bytes.
    fn file(&self, depends_on: &[&[u8]]) -> PathBuf {
        let mut hasher = blake3::Hasher::new();
        for part in [self.program.as_bytes()].iter().chain(depends_on) {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part);
        }
        self.folder.join(format!("{}.packing", &hasher.finalize().to_hex()[..32]))
    }

    /// A stored packing; `None` if there is none, or if the file is damaged.
    pub(super) fn read(&self, depends_on: &[&[u8]]) -> Option<Stored> {
        let bytes = fs::read(self.file(depends_on)).ok()?;
        let (content, hash) = bytes.split_at_checked(bytes.len().checked_sub(HASH)?)?;
        if blake3::hash(content).as_bytes() != hash {
            return None;
        }
        decode(content.strip_prefix(MAGIC)?)
    }

    /// Stores a packing, and removes the oldest ones if all together are large. Failures are ignored: the packing can be made again.
    pub(super) fn write(&self, depends_on: &[&[u8]], stored: &Stored) {
        let _ = self.try_write(&self.file(depends_on), stored);
        let _ = remove_oldest(&self.folder);
    }

    fn try_write(&self, file: &Path, stored: &Stored) -> std::io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let mut content = MAGIC.to_vec();
        encode(stored, &mut content);
        let hash = blake3::hash(&content);
        content.extend_from_slice(hash.as_bytes());
        // Another process may read the file at the same time, so it appears as a whole.
        let mut unfinished = tempfile::NamedTempFile::new_in(&self.folder)?;
        std::io::Write::write_all(&mut unfinished, &content)?;
        unfinished.persist(file)?;
        Ok(())
    }
}

/// Four lists of numbers, each after its length: spheres, edges of the cell, other numbers, links.
fn encode(stored: &Stored, content: &mut Vec<u8>) {
    let spheres = stored.packing.spheres.iter().flat_map(|s| [s.position.x, s.position.y, s.position.z, s.radius]);
    let cell = stored.packing.cell.iter().flat_map(|cell| cell.matrix.iter().copied());
    let links = stored.links.iter().flatten().flatten().map(|&sphere| f64::from(sphere));
    let lists: [Vec<f64>; 4] = [spheres.collect(), cell.collect(), stored.numbers.clone(), links.collect()];
    content.push(u8::from(stored.links.is_some()));
    for list in lists {
        content.extend_from_slice(&(list.len() as u64).to_le_bytes());
        for number in list {
            content.extend_from_slice(&number.to_le_bytes());
        }
    }
}

fn decode(content: &[u8]) -> Option<Stored> {
    let (&has_links, mut rest) = content.split_first()?;
    let mut list = || -> Option<Vec<f64>> {
        let (length, after) = rest.split_first_chunk::<8>()?;
        let bytes = usize::try_from(u64::from_le_bytes(*length)).ok()?.checked_mul(8)?;
        let (numbers, after) = after.split_at_checked(bytes)?;
        rest = after;
        let (numbers, _) = numbers.as_chunks::<8>();
        Some(numbers.iter().map(|number| f64::from_le_bytes(*number)).collect())
    };
    let (spheres, cell, numbers, links) = (list()?, list()?, list()?, list()?);
    let (spheres, _) = spheres.as_chunks::<4>();
    let sphere = |&[x, y, z, radius]: &[f64; 4]| Sphere { position: Vec3::new(x, y, z), radius };
    let (pairs, _) = links.as_chunks::<2>();
    Some(Stored {
        packing: Packing {
            spheres: spheres.iter().map(sphere).collect(),
            cell: (cell.len() == 9).then(|| Cell::new(Mat3::from_column_slice(&cell))),
        },
        links: (has_links == 1).then(|| pairs.iter().map(|pair| pair.map(|sphere| sphere as u32)).collect()),
        numbers,
    })
}

/// Removes the oldest files of a folder until the others are small enough together.
fn remove_oldest(folder: &Path) -> std::io::Result<()> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let data = entry.metadata()?;
        if entry.path().extension().is_some_and(|extension| extension == "packing") {
            files.push((data.modified()?, data.len(), entry.path()));
        }
    }
    files.sort();
    let mut total: u64 = files.iter().map(|(_, size, _)| size).sum();
    for (_, size, path) in files {
        if total <= LARGEST {
            break;
        }
        fs::remove_file(path)?;
        total -= size;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packings_come_back_bit_for_bit_and_damaged_files_are_ignored() {
        let folder = tempfile::tempdir().unwrap();
        let cache = PackingCache::new(folder.path().join("new"), "program".into());
        let spheres = vec![Sphere { position: Vec3::new(0.1, -0.0, 1.0 / 3.0), radius: 1e-300 }; 3];
        let cell = Some(Cell::new(Mat3::new(1.0, 0.1, 0.0, 0.0, 1.0 / 3.0, 0.2, 0.0, 0.0, 2.0e-5)));
        let stored = Stored {
            packing: Packing { spheres, cell },
            links: Some(vec![[0, 1], [1, 2]]),
            numbers: vec![0.1, f64::INFINITY],
        };
        let keys: &[&[u8]] = &[b"a", b"b"];
        assert_eq!(cache.read(keys), None);
        cache.write(keys, &stored);
        assert_eq!(cache.read(keys), Some(stored.clone()));
        // Other keys, other borders between them, and another program have other files.
        assert_eq!(cache.read(&[b"ab"]), None);
        assert_eq!(PackingCache::new(folder.path().join("new"), "other".into()).read(keys), None);
        let path = cache.file(keys);
        let whole = fs::read(&path).unwrap();
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 1;
            fs::write(&path, &bytes).unwrap();
            assert_eq!(cache.read(keys), None, "byte {at}");
            fs::write(&path, &whole[..at]).unwrap();
            assert_eq!(cache.read(keys), None, "cut at {at}");
        }
        let empty = Stored::default();
        cache.write(keys, &empty);
        assert_eq!(cache.read(keys), Some(empty));
    }
}
