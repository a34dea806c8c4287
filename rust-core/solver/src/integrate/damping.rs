//! Artificial damping.

use concordem_contact::math::Vec3;

/// Artificial damping of the motion.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub enum Damping {
    /// None.
    #[default]
    None,
    /// Cundall's local damping per component as in YADE: `a_i ← a_i (1 − λ sign(a_i (v_i + ½Δt a_i)))`.
    Local {
        /// λ of the translation, 0 to 1.
        translation: f64,
        /// λ of the rotation, 0 to 1.
        rotation: f64,
    },
    /// Non-viscous damping of vectors, Madan 2019 (2.7)–(2.8): `F ← F − α‖F‖ v/‖v‖`, zero at rest.
    NonViscous {
        /// α of the translation.
        translation: f64,
        /// α of the rotation.
        rotation: f64,
    },
    /// Dissipation of high modes by the integrator, Tchamwa & Wielgosz (1999), as used by Jebahi et al. 2015:
    /// `x' = x + vΔt + φ a Δt²`, `v' = v + a Δt`.
    ///
    /// Eliminating the velocity shows that this is leapfrog under the force `F + (φ−1)(F − F_old)`, where `F_old` is
    /// the net force one step ago: a dashpot on the change of force. The code computes and books it as such; `v` of the
    /// state is the velocity of the step, `(x'−x)/Δt`. The form with φ only on the position's `Δt²/2`
    /// (`x' = x + vΔt + φ½aΔt²`, `v' = v + ½(a+a')Δt`) is the same recursion with `½(1+φ)` in place of φ
    /// ([`Damping::position_term`]). Stable for `ωΔt < 2/√(2φ−1)`; the spectral radius is `√(1−(φ−1)(ωΔt)²)`. With φ on
    /// the velocity, as [2.24]–[2.25] are printed, that term has the opposite sign and the motion grows.
    TchamwaWielgosz {
        /// φ: 1 without dissipation, 1.3 in Jebahi et al.
        phi: f64,
    },
}

impl Damping {
    /// The form with φ only on the position term.
    pub fn position_term(phi: f64) -> Self {
        Self::TchamwaWielgosz { phi: 0.5 * (1.0 + phi) }
    }

    /// Factor `s` by which the damping increases the stiffness in the stability condition: stable for `s (Ω² + 2D) < 4`
    /// with `Ω = ωΔt` and a dashpot `D = cΔt/m` ([`time_step`](crate::time_step)).
    ///
    /// * [`Self::TchamwaWielgosz`]: `2φ − 1`;
    /// * [`Self::Local`], [`Self::NonViscous`]: `1 + λ`, because a force against the motion grows by that factor.
    pub fn stiffening(&self) -> f64 {
        match self {
            Self::None => 1.0,
            Self::Local { translation, rotation } | Self::NonViscous { translation, rotation } => {
                1.0 + translation.max(*rotation)
            }
            Self::TchamwaWielgosz { phi } => 2.0 * phi - 1.0,
        }
    }

    /// Factor on the largest stable time step of the undamped system without dashpots.
    pub fn stability(&self) -> f64 {
        1.0 / self.stiffening().sqrt()
    }

    /// Whether the damping reads the forces of the last step.
    pub fn reads_last_forces(&self) -> bool {
        matches!(self, Self::TchamwaWielgosz { .. })
    }
}

/// Force of [`Damping::Local`] with λ = `coefficient` at the mean velocity `mean` (m/s) of the step, N.
pub(super) fn local_damping_at(force: &Vec3, mean: &Vec3, coefficient: f64) -> Vec3 {
    force.zip_map(mean, |force, mean| if mean == 0.0 { 0.0 } else { -coefficient * force.abs() * mean.signum() })
}

/// Change of force and torque since the last step. Replaces the last values in `previous`; zero without `previous`.
#[inline(always)]
pub(super) fn changes(previous: Option<&mut [Vec3; 2]>, force: &Vec3, torque: &Vec3) -> [Vec3; 2] {
    previous.map_or([Vec3::zeros(); 2], |previous| {
        let old = std::mem::replace(previous, [*force, *torque]);
        [force - old[0], torque - old[1]]
    })
}
