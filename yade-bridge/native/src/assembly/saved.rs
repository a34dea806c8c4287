//! Serializes an assembly to 32-bit words for the host's save file.

use std::path::Path;

use concordem_scenario::assembly::assemble_without_hdf5;
use concordem_scenario::schema::Scenario;
use concordem_solver::Model;
use concordem_solver::state::State;
use concordem_solver::state::columns::{ColumnData, ColumnKind, ColumnStore, StoredColumn};

use super::{Assembly, Origin, same_length};

impl Assembly {
    /// The complete assembly as 32-bit words; [`Self::from_words`] reads them.
    ///
    /// # Errors
    /// The state cannot be written as columns.
    pub fn to_words(&self) -> Result<Vec<i32>, String> {
        let store = ColumnStore::of(&self.state).map_err(|error| error.to_string())?;
        let mut bytes = MAGIC.to_vec();
        let mut put = |data: &[u8]| {
            bytes.extend((data.len() as u64).to_le_bytes());
            bytes.extend(data);
        };
        put(toml::to_string(&self.origin).map_err(|error| error.to_string())?.as_bytes());
        put(bytemuck::cast_slice(&self.losses));
        put(bytemuck::cast_slice(&self.openings));
        put(bytemuck::cast_slice(&self.dissipated));
        for (path, column) in store.iter() {
            put(path.as_bytes());
            put(&[column.kind() as u8]);
            put(&(column.components as u64).to_le_bytes());
            put(column.borrow().bytes());
        }
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        Ok(bytes.chunks_exact(4).map(|c| i32::from_le_bytes([c[0], c[1], c[2], c[3]])).collect())
    }

    /// Read an assembly that [`Self::to_words`] wrote.
    ///
    /// # Errors
    /// Words of another version, truncated words, or an origin that is not stored in the words.
    pub fn from_words(words: &[i32]) -> Result<Self, String> {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let mut rest = bytes
            .strip_prefix(MAGIC)
            .ok_or("the saved bonds were written by another version of ConcorDEM; use that one")?;
        let mut take = || -> Result<&[u8], String> {
            let cut = || "the saved bonds are truncated".to_owned();
            let (length, tail) = rest.split_first_chunk::<8>().ok_or_else(cut)?;
            let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| cut())?;
            let (part, tail) = tail.split_at_checked(length).ok_or_else(cut)?;
            rest = tail;
            Ok(part)
        };
        let text = String::from_utf8(take()?.to_vec()).map_err(|error| error.to_string())?;
        let origin: Origin = toml::from_str(&text).map_err(|error| error.to_string())?;
        let losses: Vec<u32> = numbers(take()?, u32::from_le_bytes);
        let openings: Vec<u32> = numbers(take()?, u32::from_le_bytes);
        let dissipated: Vec<f64> = numbers(take()?, f64::from_le_bytes);
        let mut store = read_columns(&mut take)?;
        let (mut state, model) = Self::empty_state(&origin)?;
        state.read(&mut store).and_then(|()| state.check_indices()).map_err(|error| error.to_string())?;
        same_length("losses", losses.len(), state.particles.len())?;
        let mut made = Self::new(state, model, origin)?;
        made.broken = losses.iter().map(|&n| u64::from(n)).sum::<u64>() / 2;
        same_length("openings", openings.len(), losses.len())?;
        (made.losses, made.openings) = (losses, openings);
        for (to, from) in made.dissipated.iter_mut().zip(dissipated) {
            *to = from;
        }
        Ok(made)
    }

    /// State with empty blocks of the right kinds, to be filled from columns, and the model.
    fn empty_state(origin: &Origin) -> Result<(State, Model), String> {
        Ok(match origin {
            Origin::Concrete { .. } => {
                let (block, model) = Self::empty_concrete(origin)?;
                let mut state = State { bonds: vec![Box::new(block.clone())], ..State::default() };
                state.contacts = Some(Box::new(block));
                (state, model)
            }
            Origin::Cohesive { .. } | Origin::Jointed { .. } => Self::empty_with_histories(origin)?,
            Origin::Scenario { text } => {
                let scenario = Scenario::parse("scenario", text).map_err(|_| "the saved scenario is invalid")?;
                let made = assemble_without_hdf5(&scenario, Path::new("."), &mut |_, _| {})
                    .map_err(|error| error.to_string())?;
                (made.state, made.model)
            }
            Origin::Elsewhere {} => {
                return Err("these bonds were saved by another engine; load them with concordem.yade.load".into());
            }
        })
    }
}

/// Read columns until the end of the words; `take` returns the next part.
fn read_columns<'a>(take: &mut impl FnMut() -> Result<&'a [u8], String>) -> Result<ColumnStore, String> {
    let mut store = ColumnStore::default();
    while let Ok(path) = take() {
        if path.is_empty() {
            break;
        }
        let path = String::from_utf8(path.to_vec()).map_err(|error| error.to_string())?;
        let kind = take()?.first().copied();
        let components: Vec<u64> = numbers(take()?, u64::from_le_bytes);
        let data = take()?;
        let data = match kind {
            Some(k) if k == ColumnKind::F64 as u8 => ColumnData::F64(numbers(data, f64::from_le_bytes)),
            Some(k) if k == ColumnKind::U64 as u8 => ColumnData::U64(numbers(data, u64::from_le_bytes)),
            Some(k) if k == ColumnKind::U32 as u8 => ColumnData::U32(numbers(data, u32::from_le_bytes)),
            Some(k) if k == ColumnKind::U16 as u8 => ColumnData::U16(numbers(data, u16::from_le_bytes)),
            Some(k) if k == ColumnKind::U8 as u8 => ColumnData::U8(data.to_vec()),
            Some(k) if k == ColumnKind::I8 as u8 => ColumnData::I8(numbers(data, i8::from_le_bytes)),
            _ => return Err(format!("the saved bonds contain a column {path} of an unknown kind")),
        };
        let components = components.first().map_or(1, |&count| count as usize);
        store.insert(&path, StoredColumn { data, components }).map_err(|error| error.to_string())?;
    }
    Ok(store)
}

/// First bytes of the words: kind and version.
const MAGIC: &[u8] = b"concordem bonds 2\n\0\0";

/// Numbers from little-endian bytes.
fn numbers<const N: usize, T>(bytes: &[u8], number: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks::<N>().0.iter().map(|&chunk| number(chunk)).collect()
}
