//! Section of the report: damaged bonds in space, colored by damage.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::Run;
use super::html::escape;
use crate::output::{OutputError, ResultFile};
use concordem_contact::math::Vec3;
use concordem_solver::state::columns::ColumnData;

/// Largest number of points in a picture; the most damaged bonds are shown. Each point takes
/// ten bytes of the page, and more points would not make the picture clearer.
const MOST_POINTS: usize = 40_000;
/// Smallest damage of bonds that are shown; the color scale begins here.
const SHOWN_DAMAGE: f64 = 0.5;
/// Damage at the end of the color scale.
const DARKEST_DAMAGE: f64 = 0.999;

/// A damaged bond.
struct DamagedBond {
    position: Vec3,
    damage: f64,
}

pub(super) fn section(runs: &[Run]) -> Result<String, OutputError> {
    let mut html = String::from("<h2>Damaged bonds</h2>\n");
    for (k, run) in runs.iter().enumerate() {
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
        let alternative = format!("{shown}, points colored by damage, in a box around the specimen");
        let _ = write!(
            html,
            "<div class=\"pair\">\n<div><canvas id=\"front-{k}\" role=\"img\" aria-label=\"Front view: {alternative}\">\
             {alternative}</canvas><p class=\"quiet\">Front view.</p></div>\n\
             <div><canvas class=\"turns\" id=\"turn-{k}\" tabindex=\"0\" role=\"img\" aria-label=\"Rotatable view: \
             {alternative}\">{alternative}</canvas><p class=\"quiet\">Drag, or press the arrow keys, to rotate.</p></div>\n\
             </div>\n<p class=\"controls\"><label>Show bonds with a damage of at least <input type=\"range\" id=\"least-{k}\" min=\"0\" \
             max=\"255\" value=\"0\"> <output for=\"least-{k}\"></output></label></p>\n\
             <script>drawCracks(\"front-{k}\", \"turn-{k}\", \"least-{k}\", {});</script>\n",
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
            let rows = position.chunks_exact(3).zip(damage);
            bonds.extend(
                rows.filter(|(_, damage)| **damage >= SHOWN_DAMAGE)
                    .map(|(position, &damage)| DamagedBond { position: Vec3::from_column_slice(position), damage }),
            );
        }
    }
    if bonds.is_empty() {
        let last: BTreeMap<(u32, u32), DamagedBond> = file
            .events()?
            .into_iter()
            .map(|event| ((event.id_a, event.id_b), DamagedBond { position: event.position, damage: event.damage }))
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
pub(super) fn ramp() -> String {
    let mut html = String::from("<div class=\"ramp\">");
    for (damage, text) in [(SHOWN_DAMAGE, "0.5"), (0.9, "0.9"), (0.99, "0.99"), (DARKEST_DAMAGE, "0.999 to 1")] {
        let _ = write!(html, "<span style=\"left: {:.0}%\">{text}</span>", 100.0 * share_of_scale(damage));
    }
    html + "</div>"
}

/// The points in base 64, seven bytes each: positions in 1/10000 of the longest edge of the box around the specimen, as
/// three 16-bit numbers with the low byte first, and a shade from 0 to 255.
fn points_as_json(file: &ResultFile, bonds: &[DamagedBond]) -> Result<String, OutputError> {
    let around = |bounds: Option<(Vec3, Vec3)>, point: Vec3| {
        Some(bounds.map_or((point, point), |(low, high)| (low.inf(&point), high.sup(&point))))
    };
    let bounds = bonds.iter().map(|bond| bond.position).fold(file.bounds()?, around);
    let (corner, far) = bounds.unwrap_or_default();
    let longest = (far - corner).max();
    let unit = if longest > 0.0 { 10_000.0 / longest } else { 0.0 };
    let size = (far - corner) * unit;
    let mut bytes = Vec::with_capacity(7 * bonds.len());
    for bond in bonds {
        let place = (bond.position - corner) * unit;
        place.iter().for_each(|x| bytes.extend((x.round() as u16).to_le_bytes()));
        bytes.push((255.0 * share_of_scale(bond.damage)).round() as u8);
    }
    let discs = if size.z < 1.0 { discs_as_json(file, corner, unit)? } else { String::new() };
    Ok(format!("{{size: [{:.0}, {:.0}, {:.0}], points: \"{}\"{discs}}}", size.x, size.y, size.z, base64(&bytes)))
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
pub(super) fn base64(bytes: &[u8]) -> String {
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
