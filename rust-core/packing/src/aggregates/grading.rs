//! Gradings: which fraction of the mass passes a sieve.

use crate::{PackingError, positive};
use concordem_contact::math::{exp, ln};

/// A sieve curve: the fraction of the mass that passes a sieve, by the size of its openings.
#[derive(Debug, Clone, PartialEq)]
pub struct Grading(Curve);

#[derive(Debug, Clone, PartialEq)]
enum Curve {
    /// Sizes (m, ascending) and passing fractions (ascending from 0 to 1); linear in the logarithm of the size between them.
    Sieves(Vec<(f64, f64)>),
    /// `(d/D)^q`, the part between the smallest and the largest size.
    Fuller { smallest: f64, largest: f64, exponent: f64 },
}

impl Grading {
    /// A curve through sieves: sizes (m, ascending) with passing fractions (ascending, 1 at the end). Between two sieves the
    /// passing mass is linear in the logarithm of the size. A first fraction above 0 belongs to particles finer than the first
    /// sieve, which [`Self::from`] cuts off.
    ///
    /// # Errors
    /// Fewer than two sieves, sizes or fractions that are not in order, a last fraction other than 1.
    pub fn sieves(points: Vec<(f64, f64)>) -> Result<Self, PackingError> {
        let bad = |reason: String| Err(PackingError::BadSizes { reason });
        if points.len() < 2 {
            return bad(format!("a sieve curve needs two points at least, not {}", points.len()));
        }
        for &(size, passing) in &points {
            positive("a size of the sieve curve", size)?;
            crate::within("a passing fraction of the sieve curve", passing, 0.0, 1.0)?;
        }
        for pair in points.windows(2) {
            if pair[0].0 >= pair[1].0 || pair[0].1 > pair[1].1 {
                return bad(format!(
                    "the sieve curve must rise: ({} m, {}) is followed by ({} m, {})",
                    pair[0].0, pair[0].1, pair[1].0, pair[1].1
                ));
            }
        }
        let (first, last) = (points[0].1, points[points.len() - 1].1);
        if last != 1.0 || first == 1.0 {
            return bad(format!("a sieve curve rises to the passing fraction 1, not from {first} to {last}"));
        }
        Ok(Self(Curve::Sieves(points)))
    }

    /// The curve of Fuller and Thompson (1907), `(d/D)^q` with the largest size `D`, between a smallest and the largest size, m.
    /// Fuller's exponent is 0.5; 0.45 is usual for asphalt, Andreasen's is 0.37.
    ///
    /// # Errors
    /// Sizes that are not positive or not in order, an exponent that is not positive.
    pub fn fuller(smallest: f64, largest: f64, exponent: f64) -> Result<Self, PackingError> {
        positive("the smallest size", smallest)?;
        positive("the largest size", largest)?;
        positive("the exponent of the grading", exponent)?;
        if smallest >= largest {
            let reason = format!("the smallest size {smallest} m is not below the largest, {largest} m");
            return Err(PackingError::BadSizes { reason });
        }
        Ok(Self(Curve::Fuller { smallest, largest, exponent }))
    }

    /// One size, m.
    ///
    /// # Errors
    /// A size that is not positive.
    pub fn single(size: f64) -> Result<Self, PackingError> {
        positive("the size", size)?;
        // A curve must rise: from just below the size.
        Ok(Self(Curve::Sieves(vec![(size * (1.0 - 1e-12), 0.0), (size, 1.0)])))
    }

    /// The coarse aggregates (4.75 mm and more) of the concretes of Stránský 2018, table 8.1, by their largest size, 9.5, 12.5, or
    /// 19 mm; `None` for another size.
    pub fn stransky(largest: f64) -> Option<Self> {
        // Sieves in mm with the kg/m³ between each and the one before.
        let classes: &[(f64, f64)] = match () {
            () if (largest / 9.5e-3 - 1.0).abs() < crate::TIE => &[(4.75, 0.0), (9.5, 750.0)],
            () if (largest / 12.5e-3 - 1.0).abs() < crate::TIE => &[(4.75, 0.0), (9.5, 300.0), (12.5, 450.0)],
            () if (largest / 19e-3 - 1.0).abs() < crate::TIE => {
                &[(4.75, 0.0), (9.5, 300.0), (12.5, 300.0), (19.0, 150.0)]
            }
            () => return None,
        };
        let mut below = 0.0;
        let points = classes.iter().map(|(size, mass)| {
            below += mass;
            (size * 1e-3, below / 750.0)
        });
        Some(Self(Curve::Sieves(points.collect())))
    }

    /// The part of the curve with sizes from `smallest` (m) on, normalized to its own mass; also returns the fraction of the mass
    /// that this part has.
    ///
    /// # Errors
    /// A size outside of the curve.
    pub fn from(self, smallest: f64) -> Result<(Self, f64), PackingError> {
        let (low, high) = self.bounds();
        crate::within("the smallest size", smallest, low, high * (1.0 - crate::TIE))?;
        let below = self.passing(smallest);
        let part = match self.0 {
            Curve::Fuller { largest, exponent, smallest: _ } => {
                return Ok((Self(Curve::Fuller { smallest, largest, exponent }), 1.0 - below));
            }
            Curve::Sieves(points) => {
                let rest = points.into_iter().filter(|(size, _)| *size > smallest);
                let rest = rest.map(|(size, passing)| (size, (passing - below) / (1.0 - below)));
                std::iter::once((smallest, 0.0)).chain(rest).collect()
            }
        };
        Ok((Self(Curve::Sieves(part)), 1.0 - below))
    }

    /// Smallest and largest size, m.
    pub fn bounds(&self) -> (f64, f64) {
        match &self.0 {
            Curve::Sieves(points) => (points[0].0, points[points.len() - 1].0),
            Curve::Fuller { smallest, largest, .. } => (*smallest, *largest),
        }
    }

    /// Fraction of the mass that passes the size `d`, m.
    pub fn passing(&self, d: f64) -> f64 {
        match &self.0 {
            Curve::Sieves(points) => {
                let above = points.partition_point(|(size, _)| *size <= d);
                match above {
                    0 => 0.0,
                    above if above == points.len() => 1.0,
                    above => {
                        let ((low, before), (high, after)) = (points[above - 1], points[above]);
                        before + (after - before) * (ln(d / low) / ln(high / low))
                    }
                }
            }
            Curve::Fuller { largest, exponent, .. } => {
                if d >= *largest {
                    1.0
                } else {
                    exp(exponent * ln(d / largest))
                }
            }
        }
    }

    /// Size (m) that the fraction `passing` of the mass passes; the inverse of [`Self::passing`], within the bounds.
    pub fn size(&self, passing: f64) -> f64 {
        let (smallest, largest) = self.bounds();
        let size = match &self.0 {
            Curve::Sieves(points) => {
                let above = points.partition_point(|(_, fraction)| *fraction < passing).clamp(1, points.len() - 1);
                let ((low, before), (high, after)) = (points[above - 1], points[above]);
                if after > before { low * exp(ln(high / low) * (passing - before) / (after - before)) } else { high }
            }
            Curve::Fuller { exponent, .. } => largest * exp(ln(passing.max(f64::MIN_POSITIVE)) / exponent),
        };
        size.clamp(smallest, largest)
    }

    /// Fraction of the mass below the smallest size: 0, except for Fuller's curve.
    pub(super) fn finer(&self) -> f64 {
        match self.0 {
            Curve::Sieves(ref points) => points[0].1,
            Curve::Fuller { smallest, .. } => self.passing(smallest),
        }
    }
}
