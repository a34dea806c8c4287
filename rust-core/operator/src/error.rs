//! Errors of operators.

/// Bad input to an operator.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OperatorError {
    /// Two slices do not have the same length.
    #[error("`{name}` has {found} entries where {expected} are needed, one for each {each}")]
    Length {
        /// Name of the slice.
        name: &'static str,
        /// Entries needed.
        expected: usize,
        /// Entries found.
        found: usize,
        /// What each entry belongs to.
        each: &'static str,
    },
    /// A flat slice is not a whole number of rows.
    #[error("`{name}` has {found} numbers, which is not a multiple of the {components} of a row")]
    Ragged {
        /// Name of the slice.
        name: &'static str,
        /// Numbers found.
        found: usize,
        /// Numbers per row.
        components: usize,
    },
    /// A contact or load names a particle that does not exist.
    #[error("entry {entry} of `{name}` names the particle {index}, but there are {count}")]
    Index {
        /// Name of the slice.
        name: &'static str,
        /// Index of the entry.
        entry: usize,
        /// Particle index in the entry.
        index: u32,
        /// Number of particles.
        count: usize,
    },
    /// The volume to divide by is not positive and finite.
    #[error("the volume of {of} is {volume} m³; it must be positive and finite")]
    Volume {
        /// Name of the region or body.
        of: &'static str,
        /// Its volume, m³.
        volume: f64,
    },
    /// A region has an invalid parameter.
    #[error("a {kind} has {name} = {value}; {demand}")]
    Region {
        /// Kind of region.
        kind: &'static str,
        /// Name of the parameter.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Requirement on the value.
        demand: &'static str,
    },
    /// Half-spaces that contain infinitely many periodic images.
    #[error(
        "the half-spaces are unbounded along edge {axis} of the periodic cell, where infinitely many images lie in them; use a \
         box, add planes, or make the planes parallel to the edge"
    )]
    Unbounded {
        /// Edge of the cell: 0, 1, 2.
        axis: usize,
    },
    /// A region that reaches over very many periodic images.
    #[error(
        "the region reaches over {images:.0e} images of the periodic cell, and at most {most} are allowed; give it a size near that of the \
         cell, and check its unit"
    )]
    Images {
        /// Number of images.
        images: f64,
        /// Largest number allowed.
        most: f64,
    },
    /// The region contains no entries.
    #[error("no {what} lies in the region; move or enlarge it")]
    EmptyRegion {
        /// What the region should contain.
        what: &'static str,
    },
    /// The truncation needs a region with a shape.
    #[error(
        "a region that is a list of particles has no surface to clip branches at; use internal-only or half-crossing"
    )]
    NoSurface,
    /// The points do not span space.
    #[error(
        "the {points} points do not span {dimension} dimensions (smallest to largest principal moment {ratio:.1e}): at \
         least {needed} that do not lie in one {flat} are needed"
    )]
    Flat {
        /// Number of points.
        points: usize,
        /// Space dimension.
        dimension: usize,
        /// Smallest over largest principal second moment.
        ratio: f64,
        /// Smallest number of points needed.
        needed: usize,
        /// "plane" or "line", in which the points lie.
        flat: &'static str,
    },
    /// Two points coincide.
    #[error("the points {first} and {second} are at the same place")]
    Coincident {
        /// First point.
        first: usize,
        /// Second point.
        second: usize,
    },
    /// A value is NaN or infinite.
    #[error("entry {entry} of `{name}` is not a finite number")]
    NotFinite {
        /// Name of the slice.
        name: &'static str,
        /// Index of the entry.
        entry: usize,
    },
    /// A triangulation is not closed.
    #[error("{what}: the triangulation has an open or doubled face at the points {points:?}")]
    OpenFaces {
        /// Name of the triangulation.
        what: &'static str,
        /// Corners of the face.
        points: Vec<u32>,
    },
    /// A cell of a diagram is not closed.
    #[error(
        "the cell of point {point} reaches beyond the domain; give a domain that encloses all points, or a periodic cell"
    )]
    OpenCell {
        /// Index of the point.
        point: usize,
    },
    /// The triangulation of a periodic cell does not fill it.
    #[error(
        "the periodic triangulation fills {found} m³ of the cell's {expected} m³; the cell is too narrow for its \
         particles: repeat it"
    )]
    PeriodicGap {
        /// Volume filled.
        found: f64,
        /// Volume of the cell.
        expected: f64,
    },
    /// A constant is out of its range.
    #[error("{name} = {value}; {demand}")]
    Constant {
        /// Name of the constant.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Requirement on the value.
        demand: &'static str,
    },
    /// A system of equations has no unique solution.
    #[error("{what} cannot be solved: {reason}")]
    Singular {
        /// Name of the system.
        what: &'static str,
        /// Why it has no unique solution.
        reason: &'static str,
    },
    /// The triangulation library failed.
    #[error("the triangulation failed: {reason}")]
    Triangulation {
        /// Message of the library.
        reason: String,
    },
}

pub(super) fn check_length(
    name: &'static str,
    found: usize,
    expected: usize,
    each: &'static str,
) -> Result<(), OperatorError> {
    if found == expected { Ok(()) } else { Err(OperatorError::Length { name, expected, found, each }) }
}

/// The volume, or an error if it is not positive and finite.
pub(super) fn check_volume(of: &'static str, volume: f64) -> Result<f64, OperatorError> {
    if volume > 0.0 && volume.is_finite() { Ok(volume) } else { Err(OperatorError::Volume { of, volume }) }
}

/// The constant, or an error if it is not positive and finite.
pub(super) fn check_positive(name: &'static str, value: f64) -> Result<f64, OperatorError> {
    let demand = "it must be positive";
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(OperatorError::Constant { name, value, demand }) }
}

/// An error if a number is negative or not finite.
pub(super) fn check_not_negative(
    name: &'static str,
    values: impl IntoIterator<Item = f64>,
) -> Result<(), OperatorError> {
    let demand = "it must be finite and not negative";
    let bad = values.into_iter().find(|value| !(*value >= 0.0 && value.is_finite()));
    bad.map_or(Ok(()), |value| Err(OperatorError::Constant { name, value, demand }))
}

/// An error if a number is not between 0 and 1.
pub(super) fn check_share(name: &'static str, value: f64) -> Result<(), OperatorError> {
    let demand = "it must be between 0 and 1";
    if (0.0..=1.0).contains(&value) { Ok(()) } else { Err(OperatorError::Constant { name, value, demand }) }
}

/// An error if a number is not finite. `values`: rows of reals, or single ones.
pub(super) fn check_finite<T: bytemuck::NoUninit>(name: &'static str, values: &[T]) -> Result<(), OperatorError> {
    let reals: &[f64] = bytemuck::cast_slice(values);
    // Without an exit inside a piece, so that the compiler compares several at once.
    let has_bad = |piece: &[f64]| piece.iter().fold(false, |bad, real| bad | !real.is_finite());
    let Some(piece) = reals.chunks(PIECE).position(has_bad) else { return Ok(()) };
    let first = reals[piece * PIECE..].iter().position(|real| !real.is_finite()).unwrap_or_default();
    Err(OperatorError::NotFinite { name, entry: (piece * PIECE + first) * size_of::<f64>() / size_of::<T>() })
}

/// Reals that are compared together.
const PIECE: usize = 1024;
