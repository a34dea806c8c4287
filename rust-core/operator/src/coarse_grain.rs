//! Fields at points by coarse-graining with a smooth kernel.

use rayon::prelude::*;

use super::contact_set::ContactSet;
use super::error::{OperatorError, check_finite, check_length, check_not_negative};
use super::interruption::Watch;
use super::region::Period;
use super::strain::Dimension;
use concordem_contact::math::{Mat3, Vec3};

/// Nodes and weights of Gauss' rule with four points; the other two nodes are symmetric.
const NODES: [(f64, f64); 2] =
    [(0.339_981_043_584_856_3, 0.652_145_154_862_546_1), (0.861_136_311_594_052_6, 0.347_854_845_137_453_85)];

/// Kernel `φ(r) = C (1 − r²/c²)³` for `r < c`, of unit integral: twice continuously differentiable, with compact support.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kernel {
    support: f64,
    factor: f64,
}

impl Kernel {
    /// A kernel with the support `support` (m).
    pub fn new(support: f64, dimension: Dimension) -> Result<Self, OperatorError> {
        use std::f64::consts::PI;
        if !(support > 0.0 && support.is_finite()) {
            let demand = "it must be positive";
            return Err(OperatorError::Constant { name: "support of the kernel", value: support, demand });
        }
        let factor = match dimension {
            Dimension::Two => 4.0 / (PI * support * support),
            Dimension::Three => 315.0 / (64.0 * PI * support * support * support),
        };
        Ok(Self { support, factor })
    }

    /// `φ(r)`, 1/m³ (1/m² in the plane).
    pub fn at(&self, r: &Vec3) -> f64 {
        let q = 1.0 - r.norm_squared() / (self.support * self.support);
        if q > 0.0 { self.factor * (q * q * q) } else { 0.0 }
    }

    /// `∫₀¹ φ(x + s l) ds`: weight of a branch vector at a point. Exact by Gauss' rule with four points, because the
    /// kernel is a polynomial of degree six in s where it is not zero.
    pub fn along(&self, x: &Vec3, l: &Vec3) -> f64 {
        let ball = super::Region::Sphere { center: Vec3::zeros(), radius: self.support };
        let Some([from, to]) = ball.part_of_segment(x, l) else { return 0.0 };
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let mut sum = 0.0;
        for (node, weight) in NODES {
            sum += weight * (self.at(&(x + l * (middle - half * node))) + self.at(&(x + l * (middle + half * node))));
        }
        half * sum
    }
}

/// Coarse-grained fields at a point.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CoarseField {
    /// Mass density, kg/m³.
    pub density: f64,
    /// Momentum density, kg/(m²·s).
    pub momentum: Vec3,
    /// Contact stress, Pa (tension positive).
    pub stress: Mat3,
    /// Kinetic stress `−Σ m (v−V)⊗(v−V) φ`, `V` the mean velocity at the point, Pa.
    pub kinetic_stress: Mat3,
}

/// Particles or contacts between two looks whether the work shall stop: each may have a thousand images.
const PART: usize = 1024;

/// Fields at `points` (m) by coarse-graining (Goldhirsch 2010): `ρ = Σ m φ(r−x)`, `p = Σ m v φ`,
/// `σ = Σ_c l⊗f^A ∫₀¹ φ(r − x_A − s l) ds`. Continuous in space, and the integral of the stress over all space is exactly
/// the branch sum.
///
/// # Errors
/// Slices of different lengths, numbers that are not finite, a kernel that reaches over many periodic cells.
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::{ContactSet, coarse_grain::{Kernel, coarse_grain}, strain::Dimension};
///
/// // Two spheres of radius 1 m pull each other with 5 N.
/// let position = [Vec3::zeros(), Vec3::new(2.0, 0.0, 0.0)];
/// let (pair, branch, point, force) = ([[0, 1]], [Vec3::x() * 2.0], [Vec3::x()], [Vec3::x() * 5.0]);
/// let contacts = ContactSet::new(&position, &pair, &branch, &point, &force, None).unwrap();
///
/// let kernel = Kernel::new(3.0, Dimension::Three).unwrap();
/// let still = [Vec3::zeros(); 2];
/// let found = coarse_grain(&contacts, &[1.0, 1.0], &still, &kernel, &[Vec3::x()], None).unwrap();
/// // Both masses are 1 m from the point.
/// assert!((found[0].density - 2.0 * kernel.at(&Vec3::x())).abs() < 1e-15);
/// assert!(found[0].stress[(0, 0)] > 0.0);
/// ```
pub fn coarse_grain(
    contacts: &ContactSet<'_>,
    mass: &[f64],
    velocity: &[Vec3],
    kernel: &Kernel,
    points: &[Vec3],
    period: Option<&Period>,
) -> Result<Vec<CoarseField>, OperatorError> {
    let position = contacts.position();
    check_length("mass", mass.len(), position.len(), "particle")?;
    check_length("velocity", velocity.len(), position.len(), "particle")?;
    check_not_negative("mass", mass.iter().copied())?;
    check_finite("velocity", velocity)?;
    check_finite("points", points)?;
    super::Region::Sphere { center: Vec3::zeros(), radius: kernel.support }.check_period(period)?;
    let none = Vec3::zeros();
    let shifted = |image: Vec3| period.map_or(none, |period| period.edges * image);
    let carried = |image: Vec3| period.map_or(none, |period| period.change * image);
    let watch = Watch::here();
    let field = |r: &Vec3| {
        let ball = super::Region::Sphere { center: *r, radius: kernel.support };
        let (mut field, images) = (CoarseField::default(), ball.images(period));
        for p in 0..position.len() {
            if p.is_multiple_of(PART) {
                watch.look();
            }
            for image in images.of(&position[p], &none) {
                let weight = mass[p] * kernel.at(&(position[p] + shifted(image) - r));
                if weight > 0.0 {
                    let v = velocity[p] + carried(image);
                    field.density += weight;
                    field.momentum += v * weight;
                    field.kinetic_stress -= (v * weight) * v.transpose();
                }
            }
        }
        if field.density > 0.0 {
            field.kinetic_stress += field.momentum * field.momentum.transpose() / field.density;
        }
        for k in 0..contacts.len() {
            if k.is_multiple_of(PART) {
                watch.look();
            }
            let (x, l) = (position[contacts.pair()[k][0] as usize], contacts.branch()[k]);
            for image in images.of(&x, &l) {
                let weight = kernel.along(&(x + shifted(image) - r), &l);
                if weight > 0.0 {
                    field.stress += (l * weight) * contacts.force()[k].transpose();
                }
            }
        }
        field
    };
    Ok(points.par_iter().map(field).collect())
}
