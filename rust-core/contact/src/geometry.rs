//! Geometry of a contact: its constants, its unstrained reference, and its normal and length of the previous step.

use core::f64::consts::PI;

use crate::math::{Vec3, norm};

/// Constants of a contact and of its two particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactGeometry {
    /// Center distance of the unstrained contact, m (sphere against wall: distance of the center from the wall).
    pub reference_length: f64,
    /// Area of the contact's cross-section, m².
    pub area: f64,
    /// Radius of A, m.
    pub radius_a: f64,
    /// Radius of B, m; 0 for a wall.
    pub radius_b: f64,
    /// Mass of A, kg.
    pub mass_a: f64,
    /// Mass of B, kg; infinite for a wall.
    pub mass_b: f64,
}

impl ContactGeometry {
    /// Reduced mass `m_A m_B/(m_A+m_B)`, kg; `m_A` against a wall.
    #[inline]
    pub fn reduced_mass(&self) -> f64 {
        if self.mass_b.is_infinite() { self.mass_a } else { self.mass_a * self.mass_b / (self.mass_a + self.mass_b) }
    }

    /// Effective radius `R_A R_B/(R_A+R_B)`, m; `R_A` against a wall.
    #[inline]
    pub fn effective_radius(&self) -> f64 {
        if self.radius_b <= 0.0 {
            self.radius_a
        } else {
            self.radius_a * self.radius_b / (self.radius_a + self.radius_b)
        }
    }
}

/// Unstrained geometry of a contact. The solver stores it when the contact begins.
#[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Reference {
    /// Center distance without strain, m.
    pub length: f64,
    /// Area of the cross-section, m².
    pub area: f64,
}

/// Normal and length of a contact at the end of the previous step.
#[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct PreviousGeometry {
    /// Unit normal from A to B.
    pub normal: Vec3,
    /// Center distance, m.
    pub length: f64,
}

crate::column_arrays! { pub Reference { length: f64, area: f64 } }

crate::column_arrays! { pub PreviousGeometry { normal: Vec3, length: f64 } }

/// Geometry of a contact whose history starts now: `l = x_B + shift − x_A`, positions and shift in m.
#[inline]
pub fn initial_geometry(a: &Vec3, b: &Vec3, shift: &Vec3) -> PreviousGeometry {
    let l = b + shift - a;
    let length = norm(&l);
    PreviousGeometry { normal: l / length, length }
}

/// Area `π min(R_A, R_B)²` of a contact, m² (Stránský 2018, (2.14); YADE). Pass the radius 0 for a wall or facet.
pub fn contact_area(radius_a: f64, radius_b: f64) -> f64 {
    let radius = if radius_a <= 0.0 {
        radius_b
    } else if radius_b <= 0.0 {
        radius_a
    } else {
        radius_a.min(radius_b)
    };
    PI * (radius * radius)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The smaller sphere limits the cross-section; a wall or facet has none of its own.
    #[test]
    fn the_smaller_sphere_has_the_area() {
        for (a, b, radius) in [(1.0, 3.0, 1.0), (3.0, 1.0, 1.0), (2.0, 0.0, 2.0), (0.0, 2.0, 2.0)] {
            assert_eq!(contact_area(a, b), PI * (radius * radius), "{a} {b}");
        }
    }
}
