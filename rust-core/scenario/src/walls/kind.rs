//! What the program asks of a kind of wall.

use concordem_contact::law::Fault;
use concordem_contact::math::Vec3;
use concordem_packing::Surface;
use concordem_solver::state::WallShape;

/// Remedy for what leaves the plane of a scenario in two dimensions.
pub(crate) const IN_TWO_DIMENSIONS: &str =
    "with dimension = 2 all motion is in the plane z = 0, and all rotation is about z";

/// A file with triangles that a kind names.
#[derive(Debug, Clone, Copy)]
pub struct NamedFile<'a> {
    /// Its path, the key `path`.
    pub path: &'a str,
    /// Length of one unit of the file, m.
    pub unit: f64,
}

/// Why a wall cannot be made: the key in the table of its shape, empty for the table as a whole, and a message with its remedy.
pub type Unfit = (&'static str, String);

/// A kind of wall. What most kinds do not have, has a default.
pub trait WallKind {
    /// Faults of the values of its keys.
    fn faults(&self) -> Vec<Fault> {
        Vec::new()
    }

    /// Faults in two dimensions, where a wall must be perpendicular to the plane z = 0.
    fn faults_in_plane(&self) -> Vec<Fault>;

    /// The surfaces, one for each of [`Self::faces`]. `file`: what [`Self::file`] contains.
    ///
    /// # Errors
    /// The values, or those of the file, are no surface.
    fn surfaces(&self, file: Option<Surface>) -> Result<Vec<WallShape>, Unfit>;

    /// What the names of its walls have after that of the table; a box has six.
    fn faces(&self) -> &'static [&'static str] {
        &[""]
    }

    /// The file with its triangles.
    fn file(&self) -> Option<NamedFile<'_>> {
        None
    }

    /// Whether it encloses the particles, which then are a specimen under a pressure.
    fn encloses(&self) -> bool {
        false
    }

    /// Unit vector of the axis about which it can turn and stay in its place; `None`: it cannot.
    fn axis(&self) -> Option<Vec3> {
        None
    }

    /// Whether it can turn.
    fn can_turn(&self) -> bool {
        self.axis().is_some()
    }

    /// Whether it can turn in two dimensions, about z.
    fn can_turn_in_plane(&self) -> bool {
        true
    }

    /// Whether it can turn only about an axis through its own point, in place of any parallel one.
    fn has_own_axis(&self) -> bool {
        true
    }

    /// The point to which moments on it refer, m, on its axis if it has one.
    fn point(&self) -> Option<Vec3> {
        None
    }

    /// Direction from face `face` to the particles, not of length 1, in which servos push; `None` for shapes without one.
    fn normal(&self, _face: usize) -> Option<Vec3> {
        None
    }

    /// Largest edge, diameter, or length, m; `None`: that of the surfaces.
    fn width(&self) -> Option<f64> {
        None
    }

    /// For a kind without a size: the key of its place, which may be too far away.
    fn unbounded(&self) -> Option<&'static str> {
        None
    }

    /// What to do about particles inside it before the first step.
    fn remedy(&self) -> &'static str {
        "move the wall or the particle"
    }

    /// Whether its vertices move on their own.
    fn is_mesh(&self) -> bool {
        false
    }

    /// Number of vertices that its keys give.
    fn vertices(&self) -> Option<usize> {
        None
    }
}
