//! Pairs of spheres, each a specimen of one bond, that are pulled apart.

use std::fmt::Write as _;

/// Pairs that are pulled apart: 10 mm between them, radius 1 mm, length of the bond 2 mm.
pub struct PulledPairs<'a> {
    /// How many.
    pub count: usize,
    /// Law of the bonds.
    pub law: &'a str,
    /// Keys of the material: the table of the law, and others.
    pub material: &'a str,
    /// Time step, s.
    pub time_step: f64,
    /// Steps of the run.
    pub steps: usize,
}

impl PulledPairs<'_> {
    /// Distance of the spheres of a pair, m.
    pub const LENGTH: f64 = 2e-3;
    /// Velocity at which a pair is pulled apart, m/s.
    pub const SPEED: f64 = 1e-3;

    /// The scenario; its last table is `[output]`.
    pub fn scenario(&self) -> String {
        let Self { count, law, material, time_step, steps } = self;
        let (length, speed) = (Self::LENGTH, Self::SPEED);
        let mut spheres = String::new();
        for k in 0..*count {
            let y = 1e-2 * k as f64;
            let _ = write!(spheres, "[0, {y:?}, 0, 1e-3], [{length:?}, {y:?}, 0, 1e-3], ");
        }
        format!(
            "version = 1
            [packing]
            kind = \"spheres\"
            spheres = [{spheres}]
            [[material]]
            name = \"m\"
            density = 2500
            {material}
            [bonds]
            law = \"{law}\"
            interaction_ratio = 1.01
            [contacts]
            law = \"none\"
            [[set]]
            name = \"left\"
            selection = {{ kind = \"box\", minimum = [-1e-3, -1, -1], maximum = [1e-3, 3, 1] }}
            [[set]]
            name = \"right\"
            selection = {{ kind = \"box\", minimum = [1e-3, -1, -1], maximum = [1, 3, 1] }}
            [[prescribe]]
            set = \"left\"
            velocity = [0, 0, 0]
            [[prescribe]]
            set = \"right\"
            velocity = [{speed:?}, 0, 0]
            [integration]
            time_step = {time_step:?}
            allow_unstable = true
            [stop]
            steps = {steps}
            [output]
            sample_interval = 1000
            "
        )
    }
}
