//! The straight form of a law, in which many contacts run at once.
//!
//! A law that gives its response without branches as well ([`ContactLaw::straight`](super::ContactLaw::straight)) runs in the vector
//! registers of the processor. It knows nothing of columns: the solver reads contacts into them, 16 at a time, applies the law, and
//! stores the results ([`crate::straight`]). A contact of which the straight form is not certain takes
//! [`respond`](super::ContactLaw::respond).
//!
//! ```
//! use concordem_contact::kinematics::{MotionMeasure, PointKinematics};
//! use concordem_contact::law::{ColumnUse, ContactGeometry, ContactLaw, EnergySplit, Given, Response, Stiffness};
//!
//! /// A spring of stiffness `self.0` (N/m) that pushes, but does not pull.
//! #[derive(Clone, Copy)]
//! struct Bumper(f64);
//!
//! concordem_contact::law_state! {
//!     /// Nothing to remember.
//!     pub struct BumperState {}
//! }
//!
//! impl ContactLaw for Bumper {
//!     type State = BumperState;
//!     type Kinematics = PointKinematics;
//!     const NAME: &'static str = "bumper";
//!     /// Its straight form reads no masses and dissipates nothing.
//!     const COLUMNS: Option<ColumnUse> = Some(ColumnUse::ELASTIC);
//!
//!     fn respond(&self, motion: &PointKinematics, old: &BumperState, dt: f64) -> Response<BumperState> {
//!         let (response, holds) = self.straight(motion, old, &Given::NOTHING, dt);
//!         if holds { response } else { Response::opened(EnergySplit::default()) }
//!     }
//!
//!     fn straight(&self, motion: &PointKinematics, _: &BumperState, _: &Given, _: f64) -> (Response<BumperState>, bool) {
//!         let response = Response::of_force(motion.normal * (self.0 * motion.elongation), BumperState {});
//!         (response, motion.elongation < 0.0)
//!     }
//!
//!     fn stiffness(&self, _: &ContactGeometry) -> Stiffness {
//!         Stiffness { normal: self.0, ..Stiffness::default() }
//!     }
//! }
//! ```

use crate::kinematics::MotionMeasure;

/// What the straight form of a law reads and changes. The solver moves nothing else.
#[derive(Debug, Clone, Copy)]
pub struct ColumnUse {
    /// When it reads masses.
    pub masses: Masses,
    /// Whether the history changes.
    pub history: bool,
    /// How many reals at the end of the history belong to an optional part of the law (a dashpot). While they are zero and
    /// the law does not use that part ([`super::ContactLaw::uses_optional_part`]), [`Given::reduced`] says so.
    pub optional: usize,
    /// Whether [`super::EnergySplit::damage`] may differ from zero.
    pub damage: bool,
    /// Whether [`super::EnergySplit::friction`] may differ from zero.
    pub friction: bool,
    /// Whether [`super::EnergySplit::viscous`] may differ from zero.
    pub viscous: bool,
    /// Whether [`super::EnergySplit::integration`] may differ from zero.
    pub integration: bool,
}

impl ColumnUse {
    /// Everything: right for any law.
    pub const ALL: Self = Self {
        masses: Masses::Read,
        history: true,
        optional: 0,
        damage: true,
        friction: true,
        viscous: true,
        integration: true,
    };
    /// A law of springs that reads no masses.
    pub const ELASTIC: Self = Self {
        masses: Masses::Unread,
        history: false,
        optional: 0,
        damage: false,
        friction: false,
        viscous: false,
        integration: false,
    };
}

/// When the straight form of a law reads [`super::ContactGeometry::mass_a`] and `mass_b`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Masses {
    /// Never.
    Unread,
    /// With the optional part.
    WithOptionalPart,
    /// Always.
    Read,
}

/// What is known before the straight form runs.
#[derive(Debug, Clone, Copy)]
pub struct Given {
    /// How the motion is measured.
    pub measure: MotionMeasure,
    /// Whether the straight form may leave out the optional part; see [`ColumnUse::optional`].
    pub reduced: bool,
    /// Argument and value of [`super::ContactLaw::value_ahead`] for this contact; NaN if it was not computed.
    pub ahead: [f64; 2],
}

impl Given {
    /// Nothing is known; the measure is the finite one.
    pub const NOTHING: Self = Self { measure: MotionMeasure::Finite, reduced: false, ahead: [f64::NAN; 2] };
}
