//! A material point under mixed control.
#![allow(dead_code, reason = "each test program uses a part")]

use concordem_continuum::{DamagePlastic, Parameters, State, Update};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// A typical concrete: f_c/f_t = 10.
pub fn concrete() -> DamagePlastic {
    DamagePlastic::new(Parameters::new(30e9, 0.2, 30e6, 3e6, 100.0)).unwrap()
}

/// The material of the sequential study of Stránský 2018, section 6.3. Its element has the size 2 m.
pub fn thesis() -> DamagePlastic {
    DamagePlastic::new(Parameters { softening_ductility: 6.0, ..Parameters::new(33e9, 0.2, 40e6, 1e6, 100.0) }).unwrap()
}

/// A point whose principal strains are driven: that of axis 0 is given, the stresses satisfy `rows · σ = 0` plus `offset`.
pub struct Point<'a> {
    pub law: &'a DamagePlastic,
    pub size: f64,
    pub state: State,
    pub strain: Vector3<f64>,
}

impl<'a> Point<'a> {
    pub fn new(law: &'a DamagePlastic, size: f64) -> Self {
        Self { law, size, state: State::VIRGIN, strain: Vector3::zeros() }
    }

    fn at(&self, strain: &Vector3<f64>) -> Update {
        self.law.update(&Matrix3::from_diagonal(strain), &self.state, self.size).unwrap()
    }

    /// Advance to the axial strain; two stress conditions `rows[k] · (σ₁, σ₂, σ₃) = offset[k]` give the lateral strains, by Newton's
    /// method with the consistent tangent.
    pub fn advance(&mut self, axial: f64, rows: [[f64; 3]; 2], offset: [f64; 2]) -> Update {
        let mut strain = self.strain;
        strain[0] = axial;
        let scale = self.law.parameters().compressive_strength;
        let mut last = f64::INFINITY;
        for _ in 0..60 {
            let update = self.at(&strain);
            let stress = update.stress.diagonal();
            let tangent = update.tangent.fixed_view::<3, 3>(0, 0).into_owned();
            let rows = rows.map(Vector3::from);
            let residual = Vector2::from_fn(|k, _| rows[k].dot(&stress) - offset[k]);
            let size = residual.norm();
            // As far as rounding allows.
            if size < 1e-13 * scale || (size < 1e-9 * scale && size >= last) {
                self.strain = strain;
                self.state = update.state;
                return update;
            }
            last = size;
            let jacobian = Matrix2::from_fn(|k, j| rows[k].dot(&tangent.column(j + 1)));
            let step = jacobian.lu().solve(&residual).unwrap();
            strain[1] -= step[0];
            strain[2] -= step[1];
        }
        panic!("no equilibrium at axial strain {axial:e}: residual {last:e} Pa");
    }

    /// Advance in simple tension or compression.
    pub fn simple(&mut self, axial: f64) -> Update {
        self.advance(axial, [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [0.0; 2])
    }
}

/// A small generator of numbers in [−1, 1].
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    pub fn symmetric(&mut self) -> Matrix3<f64> {
        let [a, b, c, d, e, f] = std::array::from_fn(|_| self.next());
        Matrix3::new(a, f, e, f, b, d, e, d, c)
    }
}
