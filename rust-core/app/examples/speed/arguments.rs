//! Command line of the example.

use concordem::kinematics::MotionMeasure;
use concordem::solver::Scheme;

/// Names of the laws. `cpm-yade` is `cpm` in YADE's form, `deformable` is `linear_bond` between deformable particles,
/// `hertz_mindlin` has no bonds.
pub const LAWS: [&str; 6] = ["cpm", "cpm-yade", "cohesive_beam", "linear_bond", "deformable", "hertz_mindlin"];

/// What to run.
pub struct Arguments {
    /// Text file with the spheres.
    pub packing: String,
    /// One of [`LAWS`].
    pub law: String,
    /// `--ratio`: pairs are bonded below this multiple of the sum of their radii.
    pub ratio: f64,
    /// `--steps` after the warm-up.
    pub steps: usize,
    /// `--warmup`: steps before the measured ones.
    pub warmup: usize,
    /// `--kinematics finite` or `yade-ratcheting`.
    pub kinematics: MotionMeasure,
    /// `--rate`: strain rate, 1/s.
    pub rate: f64,
    /// `--shake`: no grips; spheres start with velocities up to this, m/s.
    pub shake: Option<f64>,
    /// `--young`, Pa.
    pub young: f64,
    /// `--density`, kg/m³.
    pub density: f64,
    /// `--ductility`: relative ductility of the concrete law.
    pub ductility: f64,
    /// `--break-at`: damage at which bonds of the concrete law break.
    pub break_at: Option<f64>,
    /// `--time-step`, s; otherwise half the smallest radius over the wave speed.
    pub time_step: Option<f64>,
}

impl Arguments {
    /// Read `PACKING LAW [--OPTION VALUE]...`.
    pub fn parse(words: &[String]) -> Result<Self, String> {
        let [packing, law, options @ ..] = words else {
            return Err(format!("give a packing file and a law: {}", LAWS.join(", ")));
        };
        let mut found = Self {
            packing: packing.clone(),
            law: law.clone(),
            ratio: 1.5,
            steps: 500,
            warmup: 20,
            kinematics: MotionMeasure::Finite,
            rate: 0.05,
            shake: None,
            young: 25e9,
            density: 4800.0,
            ductility: 30.0,
            break_at: None,
            time_step: None,
        };
        for option in options.chunks(2) {
            let [name, value] = option else { return Err(format!("{} needs a value", option[0])) };
            let bad = || format!("{name} {value}: not a valid value");
            let number = || value.parse::<f64>().map_err(|_| bad());
            let count = || value.parse::<usize>().map_err(|_| bad());
            match name.as_str() {
                "--ratio" => found.ratio = number()?,
                "--steps" => found.steps = count()?,
                "--warmup" => found.warmup = count()?,
                "--rate" => found.rate = number()?,
                "--shake" => found.shake = Some(number()?),
                "--young" => found.young = number()?,
                "--density" => found.density = number()?,
                "--ductility" => found.ductility = number()?,
                "--break-at" => found.break_at = Some(number()?),
                "--time-step" => found.time_step = Some(number()?),
                "--kinematics" => {
                    found.kinematics = match value.as_str() {
                        "finite" => MotionMeasure::Finite,
                        "yade-ratcheting" => MotionMeasure::YadeRatcheting,
                        _ => return Err(bad()),
                    }
                }
                _ => return Err(format!("{name} is not an option of this example")),
            }
        }
        Ok(found)
    }

    /// Shaken spheres are compared with programs whose velocities start at time 0.
    pub fn scheme(&self) -> Scheme {
        if self.shake.is_some() { Scheme::VelocityVerlet } else { Scheme::Leapfrog }
    }
}
