//! Fragments of a result with their sizes and laws.

use crate::output::ParticlesAt;
use concordem_operator::OperatorError;
use concordem_operator::fragments::sieve::{Fit, SieveCurve, gaudin_schuhmann, rosin_rammler};
use concordem_operator::fragments::{Fragment, Membership, measure};
use concordem_operator::strain::Dimension;

/// What the size of a fragment is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Size {
    /// Intermediate axis of the ellipsoid with the same moments, which decides whether a fragment passes a sieve
    Sieve,
    /// Diameter of the sphere (in the plane: disc) with the volume of its particles
    Sphere,
}

/// Fragments with their sizes.
#[derive(Debug, Clone)]
pub struct Fragments {
    /// The heaviest first.
    pub fragments: Vec<Fragment>,
    /// Size of each, m.
    pub size: Vec<f64>,
    /// Sieve curve.
    pub curve: SieveCurve,
    /// Law of Rosin and Rammler.
    pub rosin_rammler: Option<Fit>,
    /// Law of Gaudin and Schuhmann.
    pub gaudin_schuhmann: Option<Fit>,
}

impl Fragments {
    /// The fragments of these particles.
    ///
    /// # Errors
    /// Numbers that are not finite.
    pub fn of(particles: &ParticlesAt, dimension: Dimension, size: Size) -> Result<Self, OperatorError> {
        let fragments = measure(&Membership {
            fragment: &particles.fragment,
            position: &particles.position,
            radius: &particles.radius,
            mass: &particles.mass,
            velocity: &particles.velocity,
            dimension,
        })?;
        let of = |fragment: &Fragment| if size == Size::Sieve { fragment.axes[1] } else { fragment.sphere };
        let size: Vec<f64> = fragments.iter().map(of).collect();
        let mass: Vec<f64> = fragments.iter().map(|fragment| fragment.mass).collect();
        let debris: Vec<bool> = fragments.iter().map(Fragment::is_debris).collect();
        Ok(Self {
            curve: SieveCurve::new(&size, &mass)?,
            rosin_rammler: rosin_rammler(&size, &mass, &debris)?,
            gaudin_schuhmann: gaudin_schuhmann(&size, &mass, &debris)?,
            fragments,
            size,
        })
    }

    /// Mass of all, kg.
    pub fn mass(&self) -> f64 {
        self.fragments.iter().map(|fragment| fragment.mass).sum()
    }

    /// Number and mass (kg) of single particles.
    pub fn debris(&self) -> (usize, f64) {
        let debris = || self.fragments.iter().filter(|fragment| fragment.is_debris());
        (debris().count(), debris().map(|fragment| fragment.mass).sum())
    }
}

/// The size that says most of these particles, if none is asked for: that of sieves in space. In the plane there is no intermediate axis, and
/// through periodic faces a fragment has no axes.
pub fn usual_size(dimension: Dimension, is_periodic: bool) -> Size {
    if dimension == Dimension::Three && !is_periodic { Size::Sieve } else { Size::Sphere }
}
