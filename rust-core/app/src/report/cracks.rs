//! Section of the report: damaged bonds in space, colored by damage.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::Run;
use super::html::escape;
use crate::output::{OutputError, ResultFile};
use concordem_contact::math::Vec3;
use concordem_solver::state::columns::ColumnData;

/// Largest number of points in a picture; the most damaged bonds are shown. Each point takes
/// eleven bytes of the page, and more points would not make the picture clearer.
const MOST_POINTS: usize = 40_000;
/// Smallest damage of bonds that are shown; the color scale begins here.
const SHOWN_DAMAGE: f64 = 0.5;
/// Number of bonds that a page shows first: with more, as in compression, the picture would be full, so only the widest are shown.
const FIRST_SHOWN: usize = 1500;
/// Damage at the end of the color scale.
const DARKEST_DAMAGE: f64 = 0.999;

/// A damaged bond.
struct DamagedBond {
    position: Vec3,
    damage: f64,
    /// Length less the length without strain, m; `None` in event logs.
    opening: Option<f64>,
}

pub(super) fn section(runs: &[Run]) -> Result<String, OutputError> {
    if runs.iter().all(|run| !run.is_bonded) {
        return Ok(String::new());
    }
    let mut html = String::from("<h2>Damaged bonds</h2>\n");
    for (k, run) in runs.iter().enumerate().filter(|(_, run)| run.is_bonded) {
        let mut bonds = damaged_bonds(run.file)?;
        let total = bonds.len();
        bonds.truncate(MOST_POINTS);
        let _ = writeln!(html, "<h3>{}</h3>", escape(&run.label()));
        if bonds.is_empty() {
            html += "<p>No bond reached the damage at which events are logged.</p>\n";
            continue;
        }
        let broken = run.last("broken")?.map_or(String::new(), |broken| format!(" {broken:.0} bonds broke."));
        let shown = if total > bonds.len() {
            format!("the {} most damaged of {total} bonds", bonds.len())
        } else {
            format!("{total} bonds")
        };
        let _ = writeln!(
            html,
            "<p>Each point is a damaged bond: {shown}.{broken} The color is the damage:</p>\n{}",
            ramp()
        );
        let openings = widest(&bonds);
        let alternative = format!("{shown}, points colored by damage, in a box around the specimen");
        let _ = write!(
            html,
            "<div class=\"pair\">\n<div><canvas id=\"front-{k}\" role=\"img\" aria-label=\"Front view: {alternative}\">\
             {alternative}</canvas><p class=\"quiet\">Front view.</p></div>\n\
             <div><canvas class=\"turns\" id=\"turn-{k}\" tabindex=\"0\" role=\"img\" aria-label=\"Rotatable view: \
             {alternative}\">{alternative}</canvas><p class=\"quiet\">Drag, or press the arrow keys, to rotate.</p></div>\n\
             </div>\n<p class=\"controls\"><label>Show bonds with a damage of at least <input type=\"range\" id=\"least-{k}\" min=\"0\" \
             max=\"255\" value=\"0\"> <output for=\"least-{k}\"></output></label>\n<label{}>and an opening of at least \
             <input type=\"range\" id=\"open-{k}\" min=\"0\" max=\"255\" value=\"{}\"> <output for=\"open-{k}\"></output></label></p>\n\
             <p role=\"status\" id=\"shown-{k}\"></p>\n\
             <script>drawCracks(\"front-{k}\", \"turn-{k}\", [\"least-{k}\", \"open-{k}\", \"shown-{k}\"], {});</script>\n",
            if openings.is_some() { "" } else { " hidden" },
            openings.map_or(0, |widest| first_opening(&bonds, widest)),
            points_as_json(run.file, &bonds)?
        );
    }
    Ok(html)
}

/// Positions of damaged bonds with their damage at the end: from the contact tables if these have both, else from
/// the event log (the last event of each pair).
fn damaged_bonds(file: &ResultFile) -> Result<Vec<DamagedBond>, OutputError> {
    let mut bonds = Vec::new();
    for law in file.laws()? {
        let table = file.rows(&format!("contacts/{law}"))?;
        let column = |name: &str, components: usize| {
            table.iter().find(|(column, _)| column == name).and_then(|(_, column)| match &column.data {
                ColumnData::F64(data) if column.components == components => Some(data),
                _ => None,
            })
        };
        if let (Some(position), Some(damage)) = (column("position", 3), column("damage", 1)) {
            let openings: Vec<Option<f64>> = match (column("branch", 3), column("reference_length", 1)) {
                (Some(branch), Some(reference)) => {
                    let lengths = branch.chunks_exact(3).map(|branch| Vec3::from_column_slice(branch).norm());
                    lengths.zip(reference).map(|(length, reference)| Some(length - reference)).collect()
                }
                _ => vec![None; damage.len()],
            };
            let rows = position.chunks_exact(3).zip(damage).zip(openings);
            bonds.extend(rows.filter(|((_, damage), _)| **damage >= SHOWN_DAMAGE).map(
                |((position, &damage), opening)| DamagedBond {
                    position: Vec3::from_column_slice(position),
                    damage,
                    opening,
                },
            ));
        }
    }
    if bonds.is_empty() {
        let last: BTreeMap<(u32, u32), DamagedBond> = file
            .events()?
            .into_iter()
            .map(|event| {
                let bond = DamagedBond { position: event.position, damage: event.damage, opening: None };
                ((event.id_a, event.id_b), bond)
            })
            .collect();
        bonds = last.into_values().collect();
    }
    bonds.retain(|bond| bond.damage.is_finite() && bond.position.iter().all(|x| x.is_finite()));
    // A stable sort: pages of the same result have the same bytes.
    bonds.sort_by(|a, b| b.damage.total_cmp(&a.damage));
    Ok(bonds)
}

/// Position of a damage on the color scale, 0 to 1. Every factor of ten in the remaining stiffness `1 − ω` is a step of
/// equal length, because damage comes close to 1 everywhere in a crack.
pub(super) fn share_of_scale(damage: f64) -> f64 {
    let decades = |damage: f64| ((1.0 - SHOWN_DAMAGE) / (1.0 - damage)).log10();
    (decades(damage.clamp(SHOWN_DAMAGE, DARKEST_DAMAGE)) / decades(DARKEST_DAMAGE)).clamp(0.0, 1.0)
}

/// The color scale with its marks.
fn ramp() -> String {
    let mut html = String::from("<div class=\"ramp\">");
    for (damage, text) in [(SHOWN_DAMAGE, "0.5"), (0.9, "0.9"), (0.99, "0.99"), (DARKEST_DAMAGE, "0.999 to 1")] {
        let _ = write!(html, "<span style=\"left: {:.0}%\">{text}</span>", 100.0 * share_of_scale(damage));
    }
    html + "</div>"
}

/// The widest opening, m; `None` if openings are unknown or no bond is open.
fn widest(bonds: &[DamagedBond]) -> Option<f64> {
    let openings = bonds.iter().map(|bond| bond.opening).collect::<Option<Vec<f64>>>()?;
    openings.into_iter().reduce(f64::max).filter(|widest| *widest > 0.0)
}

/// An opening as a number from 0 to 255, on a scale of its square root, because few bonds open widely.
fn share_of_widest(opening: f64, widest: f64) -> u8 {
    (255.0 * (opening / widest).clamp(0.0, 1.0).sqrt()).round() as u8
}

/// Opening, 0 to 255, from which the page shows bonds at first: all, or about the [`FIRST_SHOWN`] widest.
fn first_opening(bonds: &[DamagedBond], widest: f64) -> u8 {
    if bonds.len() <= FIRST_SHOWN {
        return 0;
    }
    let mut shares: Vec<u8> = bonds.iter().filter_map(|bond| Some(share_of_widest(bond.opening?, widest))).collect();
    shares.sort_unstable_by(|a, b| b.cmp(a));
    shares.get(FIRST_SHOWN).copied().unwrap_or(0)
}

/// The points in base 64, eight bytes each: positions in 1/10000 of the longest edge of the box around the specimen, as
/// three 16-bit numbers with the low byte first, a shade from 0 to 255, and the opening from 0 to 255.
fn points_as_json(file: &ResultFile, bonds: &[DamagedBond]) -> Result<String, OutputError> {
    let around = |bounds: Option<(Vec3, Vec3)>, point: Vec3| {
        Some(bounds.map_or((point, point), |(low, high)| (low.inf(&point), high.sup(&point))))
    };
    let bounds = bonds.iter().map(|bond| bond.position).fold(file.bounds()?, around);
    let (corner, far) = bounds.unwrap_or_default();
    let longest = (far - corner).max();
    let unit = if longest > 0.0 { 10_000.0 / longest } else { 0.0 };
    let size = (far - corner) * unit;
    let widest = widest(bonds);
    let mut bytes = Vec::with_capacity(8 * bonds.len());
    for bond in bonds {
        let place = (bond.position - corner) * unit;
        place.iter().for_each(|x| bytes.extend((x.round() as u16).to_le_bytes()));
        bytes.push((255.0 * share_of_scale(bond.damage)).round() as u8);
        bytes.push(widest.zip(bond.opening).map_or(0, |(widest, opening)| share_of_widest(opening, widest)));
    }
    let discs = if size.z < 1.0 { discs_as_json(file, corner, unit)? } else { String::new() };
    let widest = widest.unwrap_or(0.0) * 1e6;
    Ok(format!(
        "{{size: [{:.0}, {:.0}, {:.0}], widest: {widest:e}, points: \"{}\"{discs}}}",
        size.x,
        size.y,
        size.z,
        base64(&bytes)
    ))
}

/// The particles at the end of a plane run, which show its outline and notches: six bytes each, x, y, and radius in
/// the unit of the points. Empty if there are more than [`MOST_POINTS`].
fn discs_as_json(file: &ResultFile, corner: Vec3, unit: f64) -> Result<String, OutputError> {
    let table = file.rows("particles")?;
    let reals = |name: &str| match table.iter().find(|(column, _)| column == name).map(|(_, column)| &column.data) {
        Some(ColumnData::F64(data)) => data.as_slice(),
        _ => &[],
    };
    let (position, radius) = (reals("position"), reals("radius"));
    if radius.len() > MOST_POINTS {
        return Ok(", discs: \"\"".to_owned());
    }
    let mut bytes = Vec::with_capacity(6 * radius.len());
    for (x, r) in position.chunks_exact(3).zip(radius) {
        let place = (Vec3::from_column_slice(x) - corner) * unit;
        for number in [place.x, place.y, r * unit] {
            bytes.extend((number.round() as u16).to_le_bytes());
        }
    }
    Ok(format!(", discs: \"{}\"", base64(&bytes)))
}

/// Bytes in base 64 (RFC 4648, section 4).
pub(crate) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let bits = chunk.iter().enumerate().fold(0_u32, |bits, (k, byte)| bits | u32::from(*byte) << (16 - 8 * k));
        for k in 0..4 {
            let digit = DIGITS[(bits >> (18 - 6 * k) & 63) as usize];
            text.push(if k <= chunk.len() { char::from(digit) } else { '=' });
        }
    }
    text
}
