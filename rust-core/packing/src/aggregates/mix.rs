//! Mix design: from masses per volume of concrete to volume fractions.

use crate::{PackingError, positive, within};

/// A component of the mix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Component {
    /// Mass per volume of concrete, kg/m³.
    pub content: f64,
    /// Density, kg/m³.
    pub density: f64,
}

/// Fraction of air from the unit weight of the fresh concrete (kg/m³): `1 − unit weight / Σ contents` (Stránský 2018, program of
/// chapter 8).
///
/// # Errors
/// A unit weight that is not positive, or larger than the sum of the contents.
pub fn air(components: &[Component], unit_weight: f64) -> Result<f64, PackingError> {
    positive("the unit weight", unit_weight)?;
    let total: f64 = components.iter().map(|component| component.content).sum();
    within("the unit weight", unit_weight, 0.0, total)?;
    Ok(1.0 - unit_weight / total)
}

/// Volume fraction of one component, `(m/ρ)(1 − a)/Σ(m_i/ρ_i)`, with the fraction of air `a`.
///
/// ```
/// use concordem_packing::aggregates::mix::{Component, volume_fraction};
///
/// let water = Component { content: 200.0, density: 1000.0 };
/// let cement = Component { content: 310.0, density: 3100.0 };
/// let aggregate = Component { content: 1755.0, density: 2700.0 };
/// // 0.2 + 0.1 + 0.65 m³ make 0.95 m³; 5 % air fill the rest.
/// let fraction = volume_fraction(&[water, cement, aggregate], aggregate, 0.05)?;
/// assert!((fraction - 0.65).abs() < 1e-12);
/// # Ok::<(), concordem_packing::PackingError>(())
/// ```
///
/// # Errors
/// Contents or densities that are not positive; air outside 0 to 1.
pub fn volume_fraction(components: &[Component], of: Component, air: f64) -> Result<f64, PackingError> {
    within("the fraction of air", air, 0.0, 1.0)?;
    let mut total = 0.0;
    for component in components {
        positive("the content of a component", component.content)?;
        positive("the density of a component", component.density)?;
        total += component.content / component.density;
    }
    Ok(of.content / positive("the density of a component", of.density)? * (1.0 - air) / positive("the mix", total)?)
}
