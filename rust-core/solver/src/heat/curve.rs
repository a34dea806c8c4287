//! Thermal constants that vary with the temperature.
//!
//! A [`Curve`] is a factor on a constant: linear between its points, constant outside them. What follows from it over a change of
//! temperature is its integral: the heat `c ∫ f dT` per mass that a particle takes up, and the thermal strain `α ∫ f dT`.

use concordem_contact::material::Material;
use concordem_contact::quantity::Number;

/// A factor on a constant, as a function of the temperature.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Temperatures in ascending order, K.
    temperature: Vec<f64>,
    /// Factor at each.
    factor: Vec<f64>,
}

impl Curve {
    /// The curve through these points. Temperatures (K) ascend; there is at least one.
    pub fn new(temperature: Vec<f64>, factor: Vec<f64>) -> Self {
        debug_assert!(!temperature.is_empty() && temperature.len() == factor.len());
        Self { temperature, factor }
    }

    /// Factor at a temperature (K).
    pub fn at(&self, temperature: f64) -> f64 {
        let Self { temperature: knots, factor } = self;
        let above = knots.partition_point(|knot| *knot <= temperature);
        if above == 0 || above == knots.len() {
            return factor[above.saturating_sub(1)];
        }
        let share = (temperature - knots[above - 1]) / (knots[above] - knots[above - 1]);
        factor[above - 1] + share * (factor[above] - factor[above - 1])
    }

    /// The next point of the curve beyond a temperature, upward or downward, K; infinite if there is none.
    fn next(&self, temperature: f64, upward: bool) -> f64 {
        let knots = &self.temperature;
        if upward {
            let above = knots.partition_point(|knot| *knot <= temperature);
            return knots.get(above).copied().unwrap_or(f64::INFINITY);
        }
        let below = knots.partition_point(|knot| *knot < temperature);
        if below == 0 { f64::NEG_INFINITY } else { knots[below - 1] }
    }

    /// Integral of the factor from the temperature `from` (K) over a change (K).
    pub fn integral(&self, from: f64, change: f64) -> f64 {
        if !change.is_finite() {
            return change;
        }
        let (mut at, mut left, mut sum) = (from, change, 0.0);
        loop {
            let room = self.next(at, change > 0.0) - at;
            if left.abs() <= room.abs() {
                return sum + 0.5 * left * (self.at(at) + self.at(at + left));
            }
            sum += 0.5 * room * (self.at(at) + self.at(at + room));
            left -= room;
            at += room;
        }
    }

    /// The change (K) from the temperature `from` (K) over which the integral of the factor has the value `integral`. All factors
    /// are positive.
    pub fn change(&self, from: f64, integral: f64) -> f64 {
        if !integral.is_finite() {
            return integral;
        }
        let (mut at, mut left, mut sum) = (from, integral, 0.0);
        loop {
            let next = self.next(at, integral > 0.0);
            let (room, here) = (next - at, self.at(at));
            if room.is_infinite() {
                return sum + left / here;
            }
            let there = self.at(next);
            let whole = 0.5 * room * (here + there);
            if left.abs() <= whole.abs() {
                // The root of `here δ + ½ slope δ² = left` without cancellation.
                let slope = (there - here) / room;
                return sum + 2.0 * left / (here + (here * here + 2.0 * slope * left).max(0.0).sqrt());
            }
            sum += room;
            left -= whole;
            at = next;
        }
    }

    /// Lowest and highest factor.
    pub fn range(&self) -> [f64; 2] {
        let least = self.factor.iter().copied().fold(f64::INFINITY, f64::min);
        [least, self.factor.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
    }
}

/// Curves of the constants of a material; `None`: constant.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MaterialCurves {
    /// Of the heat capacity.
    pub specific_heat: Option<Curve>,
    /// Of the conductivity.
    pub conductivity: Option<Curve>,
    /// Of the thermal expansion: of the slope `dε/dT`.
    pub expansion: Option<Curve>,
    /// Of the stiffness of bonds and contacts.
    pub stiffness: Option<Curve>,
    /// Of the strength of bonds.
    pub strength: Option<Curve>,
}

impl MaterialCurves {
    /// The curves of a material (`thermal.variation`).
    pub fn of(material: &Material) -> Self {
        let variation = material.thermal.as_ref().and_then(|thermal| thermal.variation.as_ref());
        variation.map_or_else(Self::default, |variation| {
            let of = |factors: &Option<Vec<Number>>| {
                let temperature = variation.temperature.iter().map(|t| t.si()).collect();
                factors.as_ref().map(|factors| Curve::new(temperature, factors.iter().map(|f| f.si()).collect()))
            };
            Self {
                specific_heat: of(&variation.specific_heat),
                conductivity: of(&variation.conductivity),
                expansion: of(&variation.expansion),
                stiffness: of(&variation.stiffness),
                strength: of(&variation.strength),
            }
        })
    }
}

/// Which constants vary with the temperature, by material.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curves {
    /// Of each material.
    pub materials: Vec<MaterialCurves>,
    /// Material of each particle.
    pub of: Vec<u16>,
}

impl Curves {
    /// Curve of the heat capacity of particle `p`.
    #[inline]
    pub fn specific_heat(&self, p: usize) -> Option<&Curve> {
        self.materials.get(*self.of.get(p)? as usize)?.specific_heat.as_ref()
    }

    /// Curve of the conductivity of a material.
    #[inline]
    pub fn conductivity(&self, material: u16) -> Option<&Curve> {
        self.materials.get(material as usize)?.conductivity.as_ref()
    }

    /// Curve of the thermal expansion of a material.
    #[inline]
    pub fn expansion(&self, material: u16) -> Option<&Curve> {
        self.materials.get(material as usize)?.expansion.as_ref()
    }

    /// Curve of the stiffness of a material.
    #[inline]
    pub fn stiffness(&self, material: u16) -> Option<&Curve> {
        self.materials.get(material as usize)?.stiffness.as_ref()
    }

    /// Curve of the strength of a material.
    #[inline]
    pub fn strength(&self, material: u16) -> Option<&Curve> {
        self.materials.get(material as usize)?.strength.as_ref()
    }

    /// Whether any stiffness or strength varies.
    pub fn softens(&self) -> bool {
        self.materials.iter().any(|curves| curves.stiffness.is_some() || curves.strength.is_some())
    }

    /// Whether any conductivity varies.
    pub fn conductivity_varies(&self) -> bool {
        self.materials.iter().any(|curves| curves.conductivity.is_some())
    }

    /// Whether any heat capacity varies.
    pub fn specific_heat_varies(&self) -> bool {
        self.materials.iter().any(|curves| curves.specific_heat.is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Trapezoids under a curve, by hand; it is constant outside its points.
    #[test]
    fn integrals_are_areas() {
        let curve = Curve::new(vec![1.0, 2.0, 4.0], vec![1.0, 3.0, 2.0]);
        assert_eq!([0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0].map(|t| curve.at(t)), [1.0, 1.0, 2.0, 3.0, 2.5, 2.0, 2.0]);
        for (from, change, area) in
            [(0.0, 5.0, 1.0 + 2.0 + 5.0 + 2.0), (1.5, 0.5, 1.25), (1.0, 1.0, 2.0), (2.0, 1.0, 2.75), (5.0, 1.0, 2.0)]
        {
            assert_eq!(curve.integral(from, change), area);
            assert_eq!(curve.integral(from + change, -change), -area);
            // One root.
            for (from, change, area) in [(from, change, area), (from + change, -change, -area)] {
                assert!((curve.change(from, area) - change).abs() < 1e-15 * 8.0, "{from} {change}");
            }
        }
        assert_eq!(curve.range(), [1.0, 3.0]);
        assert_eq!((curve.integral(2.0, 0.0), curve.change(2.0, 0.0)), (0.0, 0.0));
    }
}
