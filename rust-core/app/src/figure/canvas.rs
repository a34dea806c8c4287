//! What a format of figures draws.

/// Red, green, and blue.
pub(super) type Ink = [u8; 3];

/// A place, pt from the upper left.
pub(super) type Place = (f64, f64);

/// Which part of a text is at its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// A page on which one draws.
pub(super) trait Canvas {
    /// A line through places; `dash`: lengths of its parts and gaps, pt.
    fn line(&mut self, places: &[Place], color: Ink, width: f64, dash: &[f64]);
    /// An area; `share`: the share of the paper that it covers.
    fn area(&mut self, outline: &[Place], color: Ink, share: f64);
    /// A text on its base line, also one that runs up.
    fn text(&mut self, place: Place, anchor: Anchor, is_upright: bool, text: &str);
}
