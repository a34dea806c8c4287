//! The file of `heat_network FILE`: heat capacities of atoms, and areas of their bonds, as `concordem export --format heat-network`
//! writes them.
//!
//! ```text
//! model disordered
//! atom ID CAPACITY VOLUME                # J/K, m³
//! bond ID ID AREA LENGTH LENGTH          # m², m; the lengths from the center of each atom to the area
//! ```
//!
//! `#` begins a comment. Ids are those of the host.

use std::collections::HashMap;

use concordem_contact::heat::HeatNetwork;

use crate::atoms::{LARGEST_TAG, Tag};
use crate::options::{OptionError, named};

/// Heat capacities and areas.
#[derive(Debug, Clone)]
pub struct HeatNetworkFile {
    /// Name of the file.
    pub path: String,
    /// The model that gave the numbers.
    pub model: HeatNetwork,
    /// Heat capacity (J/K) and volume (m³) of each atom.
    pub atoms: HashMap<Tag, [f64; 2]>,
    /// Area (m²) of each bond, and the distances (m) of the atoms with the lower and the higher id from it.
    pub bonds: HashMap<[Tag; 2], [f64; 3]>,
}

impl HeatNetworkFile {
    /// Read a file.
    ///
    /// # Errors
    /// It cannot be read, or a line is wrong.
    pub fn read(path: &str) -> Result<Self, OptionError> {
        let file = |message: String| OptionError::File { path: path.to_owned(), message };
        let text = std::fs::read_to_string(path).map_err(|error| file(error.to_string()))?;
        let mut model = None;
        let (mut atoms, mut bonds) = (HashMap::new(), HashMap::new());
        for (number, line) in text.lines().enumerate() {
            let words: Vec<&str> = line.split('#').next().unwrap_or_default().split_whitespace().collect();
            let Some((kind, words)) = words.split_first() else { continue };
            let wrong =
                |wanted: &str| file(format!("line {}: `{}` is wrong; write `{wanted}`", number + 1, line.trim()));
            let tag = |k: usize| {
                words.get(k).and_then(|word| word.parse::<Tag>().ok()).filter(|tag| (1..=LARGEST_TAG).contains(tag))
            };
            let real = |k: usize, least: f64| {
                words.get(k).and_then(|word| word.parse::<f64>().ok()).filter(|x| x.is_finite() && *x >= least)
            };
            let (old, wanted) = match (*kind, words.len()) {
                ("model", 1) => {
                    // The model "contacts" has no areas.
                    let known = named(words[0]).filter(|known| *known != HeatNetwork::Contacts);
                    (model.replace(known.ok_or_else(|| wrong("model power|disordered|ordered"))?).is_some(), "")
                }
                ("atom", 3) => {
                    let wanted = "atom ID CAPACITY VOLUME";
                    let (Some(id), Some(capacity), Some(volume)) =
                        (tag(0), real(1, f64::MIN_POSITIVE), real(2, f64::MIN_POSITIVE))
                    else {
                        return Err(wrong(wanted));
                    };
                    (atoms.insert(id, [capacity, volume]).is_some(), wanted)
                }
                ("bond", 5) => {
                    let wanted = "bond ID ID AREA LENGTH LENGTH";
                    let (Some(a), Some(b), Some(area), Some(of_a), Some(of_b)) =
                        (tag(0), tag(1), real(2, 0.0), real(3, 0.0), real(4, 0.0))
                    else {
                        return Err(wrong(wanted));
                    };
                    if a == b || of_a + of_b <= 0.0 {
                        return Err(wrong(wanted));
                    }
                    let lengths = if a < b { [of_a, of_b] } else { [of_b, of_a] };
                    (bonds.insert([a.min(b), a.max(b)], [area, lengths[0], lengths[1]]).is_some(), wanted)
                }
                _ => return Err(wrong("model NAME`, `atom ID CAPACITY VOLUME`, or `bond ID ID AREA LENGTH LENGTH")),
            };
            if old {
                return Err(wrong(&format!("{wanted}` once: it is given twice; remove one `{kind}")));
            }
        }
        let model = model
            .ok_or_else(|| file("the line `model NAME` is missing; add `model disordered`, for example".into()))?;
        Ok(Self { path: path.to_owned(), model, atoms, bonds })
    }
}
