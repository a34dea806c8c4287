//! Sums of one step that the ledger books.

/// Sums over the particles of one kick, J. Pairs of works are over the half step before and after the instant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct KickSums {
    /// `Σ ½ m v⁻·v⁺ + ½ I ω⁻·ω⁺`, J.
    pub kinetic: f64,
    /// Energy dissipated by artificial damping, J.
    pub damping: [f64; 2],
    /// Work of the prescribed degrees of freedom, J.
    pub boundary: [f64; 2],
    /// Work of gravity and external loads, J.
    pub external: [f64; 2],
    /// `Σ|F|²` of the net force over free components, N².
    pub net_force_squared: f64,
    /// Number of bodies with a free component: particles, and clumps in place of their members.
    pub free_particles: u64,
    /// `Σ|M|²` of the net moment over free components, N²·m².
    pub net_torque_squared: f64,
    /// Number of bodies with a free rotation.
    pub free_rotations: u64,
    /// Largest `|v|²` after the kick, m²/s².
    pub max_speed_squared: f64,
}

impl KickSums {
    /// Add other sums.
    pub fn merge(&mut self, other: &Self) {
        self.kinetic += other.kinetic;
        for i in 0..2 {
            self.damping[i] += other.damping[i];
            self.boundary[i] += other.boundary[i];
            self.external[i] += other.external[i];
        }
        self.net_force_squared += other.net_force_squared;
        self.free_particles += other.free_particles;
        self.net_torque_squared += other.net_torque_squared;
        self.free_rotations += other.free_rotations;
        self.max_speed_squared = self.max_speed_squared.max(other.max_speed_squared);
    }
}

/// Sums over the particles of one step, J; see [`deformation`](crate::deformation).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DeformationSums {
    /// Energy stored in particles, J.
    pub stored: f64,
    /// Dissipated in the step by the lag of the strains, J.
    pub lag: f64,
    /// Lost in the step to forces that strain particles but do not depend on their strain, J.
    pub other: f64,
    /// Work of external loads in the step, J.
    pub loads: f64,
    /// Work of reactions in the step, J.
    pub reactions: f64,
}
