//! Crack surfaces as polygons for VTK.

use std::fmt::Write as _;
use std::path::Path;

use super::{beside, free};
use crate::output::crack_faces::{CrackFace, CrackFaces};
use crate::output::error::OutputError;
use crate::output::result::ResultFile;
use crate::output::sealed;

/// A crack surface that was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Cracks {
    /// The file.
    pub file: std::path::PathBuf,
    /// Number of faces.
    pub faces: usize,
    /// Their area, m² (in the plane, of unit depth).
    pub area: f64,
    /// Number of bonds that broke or were damaged, but whose particles have no common face.
    pub without_face: usize,
}

/// Writes `STEM.cracks.vtp`: one polygon for each bond that broke, or whose damage passed `output.events_damage`.
///
/// # Errors
/// The file exists and `overwrite` is not set, the result has no snapshots, or a file cannot be read or written.
pub fn write(result: &ResultFile, stem: &Path, overwrite: bool) -> Result<Cracks, OutputError> {
    let path = beside(stem, ".cracks.vtp");
    free(std::slice::from_ref(&path), overwrite)?;
    let CrackFaces { faces, without_face } = CrackFaces::of(result)?;
    sealed::write_text(&path, &polydata(&faces))?;
    let area = faces.iter().map(|face| face.area.norm()).sum();
    Ok(Cracks { file: path, faces: faces.len(), area, without_face })
}

/// The faces as XML of VTK (`PolyData`, format version 0.1, text).
fn polydata(cracks: &[CrackFace]) -> String {
    let points: usize = cracks.iter().map(|crack| crack.corners.len()).sum();
    let mut text = String::from("<?xml version=\"1.0\"?>\n");
    text += "<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\">\n<PolyData>\n";
    let _ = writeln!(
        text,
        "<Piece NumberOfPoints=\"{points}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"{}\">",
        cracks.len()
    );
    text += "<Points>\n";
    let corners = cracks.iter().flat_map(|crack| &crack.corners);
    array(&mut text, "Float64", "Points", 3, corners.flat_map(|corner| [corner.x, corner.y, corner.z]));
    text += "</Points>\n<Polys>\n";
    array(&mut text, "Int64", "connectivity", 1, 0..points);
    let mut end = 0;
    let ends = cracks.iter().map(|crack| {
        end += crack.corners.len();
        end
    });
    array(&mut text, "Int64", "offsets", 1, ends);
    text += "</Polys>\n<CellData Scalars=\"opening\">\n";
    let each = |value: &dyn Fn(&CrackFace) -> f64| cracks.iter().map(value).collect::<Vec<f64>>();
    array(&mut text, "Float64", "area", 1, each(&|crack| crack.area.norm()));
    array(&mut text, "Float64", "opening", 1, each(&CrackFace::opening));
    array(&mut text, "Float64", "slip", 1, each(&CrackFace::slip));
    array(&mut text, "Float64", "normal", 3, cracks.iter().map(|crack| crack.normal).flat_map(|n| [n.x, n.y, n.z]));
    array(&mut text, "Float64", "time", 1, each(&|crack| crack.event.time));
    array(&mut text, "Float64", "damage", 1, each(&|crack| crack.event.damage));
    array(&mut text, "Float64", "energy", 1, each(&|crack| crack.event.energy));
    array(&mut text, "Float64", "mode_shares", 4, cracks.iter().flat_map(|crack| crack.event.mode_shares));
    array(&mut text, "UInt8", "mode", 1, cracks.iter().map(|crack| mode(&crack.event.mode_shares)));
    array(&mut text, "UInt8", "in_shear", 1, cracks.iter().map(|crack| u8::from(crack.event.in_shear)));
    array(&mut text, "UInt16", "joint", 1, cracks.iter().map(|crack| crack.event.joint.unwrap_or(u16::MAX)));
    array(&mut text, "UInt16", "materials", 2, cracks.iter().flat_map(|crack| crack.materials));
    array(&mut text, "UInt32", "ids", 2, cracks.iter().flat_map(|crack| [crack.event.id_a, crack.event.id_b]));
    text + "</CellData>\n</Piece>\n</PolyData>\n</VTKFile>\n"
}

/// The deformation that stored most of the energy: 0 normal, 1 shear, 2 bending, 3 twist.
fn mode(shares: &[f64; 4]) -> usize {
    (1..4).fold(0, |best, k| if shares[k] > shares[best] { k } else { best })
}

fn array<T: std::fmt::Debug>(
    text: &mut String,
    kind: &str,
    name: &str,
    components: usize,
    values: impl IntoIterator<Item = T>,
) {
    let _ = writeln!(
        text,
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">"
    );
    for value in values {
        // The shortest digits that give the same number.
        let _ = write!(text, "{value:?} ");
    }
    text.push_str("\n</DataArray>\n");
}
