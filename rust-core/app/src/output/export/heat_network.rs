//! Export of the heat network at the start for bonded runs in LIGGGHTS and LAMMPS (`heat_network FILE` there). Ids count from 1.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::{beside, free};
use crate::output::error::OutputError;
use crate::output::sealed;
use concordem_contact::heat::HeatNetwork;
use concordem_solver::heat::HeatModel;
use concordem_solver::state::State;

/// Writes `STEM.heat.txt` with the heat capacities of the particles, and the areas of their bonds. A bond without a link has an area of
/// zero.
///
/// # Errors
/// The outer one: the file exists and `overwrite` is not set, or it cannot be written. The inner one is the number of links that do not
/// lie along a bond of their own, which the hosts cannot have.
pub fn write(
    model: HeatNetwork,
    state: &State,
    heat: &HeatModel,
    stem: &Path,
    overwrite: bool,
) -> Result<Result<PathBuf, usize>, OutputError> {
    let path = beside(stem, ".heat.txt");
    free(std::slice::from_ref(&path), overwrite)?;
    let ordered = |a: u32, b: u32| [a.min(b), a.max(b)];
    let views = state.bonds.iter().flat_map(|block| (0..block.len()).map(|k| block.view(k)));
    let mut bonds: Vec<([u32; 2], f64)> =
        views.map(|view| (ordered(view.pair.a, view.pair.b), view.reference.length)).collect();
    bonds.sort_by_key(|bond| bond.0);
    let mut links: Vec<([u32; 2], [f64; 3])> = Vec::with_capacity(heat.network.links.len());
    for link in &heat.network.links {
        let lengths = if link.a < link.b { [link.length_a, link.length_b] } else { [link.length_b, link.length_a] };
        links.push((ordered(link.a, link.b), [link.area, lengths[0], lengths[1]]));
    }
    links.sort_by_key(|link| link.0);
    let twice = links.windows(2).filter(|pair| pair[0].0 == pair[1].0).count();
    let alone = links.iter().filter(|link| bonds.binary_search_by_key(&link.0, |bond| bond.0).is_err()).count();
    if twice + alone > 0 {
        return Ok(Err(twice + alone));
    }
    let mut text = "# Heat network at the start, for `heat_network` of fix concordem/bond\n".to_owned();
    let _ = writeln!(text, "model {model}\n# atom: id, heat capacity (J/K), volume (m^3)");
    let id = |p: u32| state.particles.id[p as usize] + 1;
    for p in 0..state.particles.len() {
        let _ = writeln!(text, "atom {} {:?} {:?}", id(p as u32), heat.capacity[p], heat.network.volume[p]);
    }
    text += "# bond: ids, area (m^2), distances of both particles from it (m)\n";
    for (pair, length) in bonds {
        let found = links.binary_search_by_key(&pair, |link| link.0).map(|k| links[k].1);
        let [area, of_a, of_b] = found.unwrap_or([0.0, 0.5 * length, 0.5 * length]);
        let _ = writeln!(text, "bond {} {} {area:?} {of_a:?} {of_b:?}", id(pair[0]), id(pair[1]));
    }
    sealed::write_text(&path, &text)?;
    Ok(Ok(path))
}
