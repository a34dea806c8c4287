//! What the temperature changes: lengths of bonds, and the largest stiffness.

use concordem_contact::law::ContactLaw;
use rayon::prelude::*;

use super::{ContactBlock, ContactFlags};

/// Column of the length in a table of references, and in one of geometries.
const LENGTH: usize = 0;
const PREVIOUS_LENGTH: usize = 3;

/// Lengths of bonds, and largest factors on the stiffness, at the temperatures of the particles.
pub trait ContactTemperature: Send + Sync {
    /// Set the largest factors on the stiffness by material, over all temperatures; empty if it is constant.
    fn set_largest_factor(&mut self, by_material: &[f64]);
    /// Largest factor on the stiffness of contacts between two materials.
    fn largest_factor(&self, a: u16, b: u16) -> f64;
    /// Let the bonds expand: their present reference lengths belong to the reference temperature.
    fn begin_expansion(&mut self);
    /// Reference lengths of the bonds at the reference temperature, m, one per bond; a host sets them after it has moved bonds.
    fn rest_lengths_mut(&mut self) -> &mut Vec<f64>;
    /// Give each bond its reference length at the thermal strains `strain` of the particles ([`crate::heat::expansion`]).
    /// `continued`: the lengths of the last step move along.
    fn expand(&mut self, strain: &[f64], continued: bool);
}

impl<L: ContactLaw> ContactTemperature for ContactBlock<L> {
    fn set_largest_factor(&mut self, by_material: &[f64]) {
        self.largest_factor = by_material.to_vec();
    }
    fn largest_factor(&self, a: u16, b: u16) -> f64 {
        let of = |material: u16| self.largest_factor.get(material as usize).copied().unwrap_or(1.0);
        0.5 * (of(a) + of(b))
    }
    fn begin_expansion(&mut self) {
        self.rest_length = self.reference.column(LENGTH).to_vec();
    }
    fn rest_lengths_mut(&mut self) -> &mut Vec<f64> {
        &mut self.rest_length
    }
    fn expand(&mut self, strain: &[f64], continued: bool) {
        let Self { pair, flags, reference, previous, rest_length, .. } = self;
        let lengths = (reference.column_mut(LENGTH), previous.column_mut(PREVIOUS_LENGTH));
        let rows = pair.par_iter().zip(flags).zip(lengths.0).zip(lengths.1).zip(rest_length).with_min_len(1024);
        rows.for_each(|((((pair, flags), reference), previous), rest)| {
            // A bond that broke leaves its length to the contact that follows.
            if flags.has(ContactFlags::BROKEN) {
                return;
            }
            let length = *rest * (1.0 + 0.5 * (strain[pair.a as usize] + strain[pair.b as usize]));
            if continued {
                *previous += length - *reference;
            }
            *reference = length;
        });
    }
}
