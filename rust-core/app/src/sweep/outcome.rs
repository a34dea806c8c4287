//! Numbers of a point of a sweep.

use std::borrow::Cow;

/// A quantity of a point.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quantity {
    /// Name.
    pub name: Cow<'static, str>,
    /// SI unit; "1" for a pure number.
    pub unit: Cow<'static, str>,
    /// Description.
    pub description: Cow<'static, str>,
}

macro_rules! quantities {
    ($list:ident: $($name:literal $unit:literal $description:literal,)*) => {
        pub(super) const $list: &[Quantity] =
            &[$(Quantity {
                name: Cow::Borrowed($name), unit: Cow::Borrowed($unit), description: Cow::Borrowed($description),
            }),*];
    };
}

quantities! {
    QUANTITIES:
    "particles" "1" "Particles",
    "links" "1" "Bonds",
    "coordination" "1" "Bonds per particle",
    "packing_fraction" "1" "Solid fraction of the cell",
    "rattlers" "1" "Particles that carry no force; they are excluded",
    "mechanisms" "1" "Motions of single particles that strain no bond",
    "stiffness_sum" "Pa" "Sum of k_N L^2 over d V, d the dimension",
    "shear_ratio" "1" "Sum of k_T L^2 over sum of k_N L^2",
    "spectral_radius" "1" "Spectral radius of the iteration between strains and forces of deformable particles",
    "closed_young" "Pa" "Young's modulus, closed form",
    "closed_poisson" "1" "Poisson's ratio, closed form",
    "affine_young" "Pa" "Young's modulus, affine sum",
    "affine_poisson" "1" "Poisson's ratio, affine sum",
    "young" "Pa" "Young's modulus, static network",
    "poisson" "1" "Poisson's ratio, static network",
    "bulk" "Pa" "Bulk modulus, static network",
    "shear" "Pa" "Shear modulus, static network",
    "anisotropy_young" "1" "Largest deviation of a Young's modulus from the mean, divided by the mean",
    "anisotropy_poisson" "1" "Largest deviation of a Poisson's ratio from the mean",
    "anisotropy_shear" "1" "Largest deviation of a shear modulus from E/2(1+nu), divided by that",
    "anisotropy_coupling" "1" "Largest stiffness that vanishes for isotropy, divided by E",
    "iterations" "1" "Iterations of the static solution",
    "dynamic_young" "Pa" "Young's modulus, relaxed dynamics",
    "dynamic_poisson" "1" "Poisson's ratio, relaxed dynamics",
    "dynamic_steps" "1" "Steps of the longest relaxation",
}

quantities! {
    STRUCTURE:
    "spheres" "1" "Spheres",
    "spheres_inside" "1" "Spheres that do not belong to the boundary",
    "links_per_sphere" "1" "Links per sphere inside",
    "links_at_boundary" "1" "Links per sphere at the boundary",
    "contacts_filled" "1" "Contacts per sphere inside before the walls soften",
    "overlap_filled" "1" "Mean overlap over mean radius before the walls soften",
    "overlap" "1" "Mean overlap over sum of radii",
    "hull_fraction" "1" "Solid fraction of the convex hull",
    "shape_fraction" "1" "Solid fraction of the shape",
    "effective_fraction" "1" "Solid fraction of the power cells inside",
    "mean_radius" "m" "Mean radius",
    "dispersion" "1" "Largest less smallest radius over mean radius",
    "isotropy" "1" "Deviation from isotropy e, frequencies as fractions",
    "isotropy_percent" "1" "The same, frequencies in percent",
    "isotropy_floor_percent" "1" "The same for isotropy, because the faces of the geode differ",
    "isotropy_noise_percent" "1" "The same for as many independent isotropic links, less the floor",
}

/// Name of the stiffness matrix in files; it has 36 numbers per point.
pub const STIFFNESS: &str = "stiffness";

/// Largest number of results of runs.
pub(super) const MOST_RESULTS: usize = 61;

/// Result of a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Values in the order of [`columns`](super::point::columns), then ordinates of all curves; NaN for missing numbers.
    pub values: Vec<f64>,
    /// Problem of a failed point.
    pub problem: Option<String>,
}

impl Outcome {
    /// Outcome without any of its numbers yet.
    pub fn new(numbers: usize) -> Self {
        Self { values: vec![f64::NAN; numbers], problem: None }
    }

    /// Outcome of a failed point.
    pub fn failed(numbers: usize, problem: String) -> Self {
        Self { problem: Some(problem), ..Self::new(numbers) }
    }

    /// Value of a quantity; NaN if it is missing.
    pub fn get(&self, name: &str) -> f64 {
        place(name).and_then(|k| self.values.get(k)).map_or(f64::NAN, |value| *value)
    }

    /// Sets the value of a quantity.
    pub(crate) fn set(&mut self, name: &str, value: f64) {
        if let Some(of) = place(name).and_then(|k| self.values.get_mut(k)) {
            *of = value;
        }
    }
}

/// Place of a quantity. Those of both studies have different names and begin at the first number of a point.
fn place(name: &str) -> Option<usize> {
    let of = |list: &[Quantity]| list.iter().position(|quantity| quantity.name == name);
    of(QUANTITIES).or_else(|| of(STRUCTURE))
}
