//! Structure of packings: coordination, density, sizes, and directions, all from positions, radii, and pairs.
//!
//! Sources: Jebahi, André, Terreros, Iordanoff 2015, section 2.3 (coordination number [2.6], dispersion [2.7], isotropy [2.8]);
//! equation numbers at each measure.

mod coordination;
mod geode;
mod hull;
mod layers;
mod pair_correlation;
mod sizes;

pub use coordination::{Coordination, coordination};
pub use geode::{Geode, Orientations};
pub use hull::Hull;
pub use layers::{Layers, layers};
pub use pair_correlation::{PairCorrelation, pair_correlation};
pub use sizes::{Sizes, sizes};
