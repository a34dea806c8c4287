//! What a picture shall show.

use clap::ValueEnum;
use concordem_contact::math::Vec3;
use concordem_scenario::schema::Scenario;

use super::values;

/// A kind of thing in a picture. The last one that is shown has the colors of the key; those before it are pale.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub enum Shown {
    /// Spheres
    Particles,
    /// Bonds that have not broken, as rods
    Bonds,
    /// Faces between particles whose bond broke, in the body before it deforms
    Cracks,
    /// Walls, of which one sees the side that particles touch
    Walls,
    /// Edges of the periodic cell
    Cell,
}

impl Shown {
    /// The kind with this name.
    ///
    /// # Errors
    ///
    /// The names that there are.
    pub fn of_name(name: &str) -> Result<Self, String> {
        Self::from_str(name, false).map_err(|_| {
            let names = Self::value_variants().iter().filter_map(Self::to_possible_value);
            names.map(|one| one.get_name().to_owned()).collect::<Vec<_>>().join(", ")
        })
    }
}

/// A plane across an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// The axis, 0 to 2.
    pub axis: usize,
    /// Its place on the axis, m; `None`: the middle of the body.
    pub place: Option<f64>,
}

impl Section {
    /// The side from which drawings show it: x or y to the right, y or z up.
    pub fn from(&self) -> Vec3 {
        [Vec3::x(), -Vec3::y(), Vec3::z()][self.axis]
    }
}

/// Times of the images.
#[derive(Debug, Clone, PartialEq)]
pub enum Moments {
    /// The last snapshot.
    Last,
    /// The snapshots nearest to these times, s.
    Near(Vec<f64>),
    /// All snapshots, or so many of them, evenly chosen.
    All(usize),
}

/// What a picture shall show.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// What is drawn.
    pub shown: Vec<Shown>,
    /// Field that gives the color; `None`: what fits.
    pub color: Option<String>,
    /// Values at the ends of the colors; `None`: the smallest and largest ones.
    pub range: Option<[f64; 2]>,
    /// Direction of the eye from the body; `None`: what fits.
    pub direction: Option<Vec3>,
    /// Show only what a plane cuts.
    pub slice: Option<Section>,
    /// Remove what lies between these planes and the eye.
    pub cuts: Vec<Section>,
    /// Width, and height if it shall not fit the body, px.
    pub size: (usize, Option<usize>),
    /// Factor of the displacements.
    pub magnify: f64,
    /// Times of the images.
    pub moments: Moments,
    /// Images per second of an animation.
    pub rate: f64,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            shown: vec![Shown::Particles, Shown::Walls, Shown::Cell],
            color: None,
            range: None,
            direction: None,
            slice: None,
            cuts: Vec::new(),
            size: (1000, None),
            magnify: 1.0,
            moments: Moments::Last,
            rate: 10.0,
        }
    }
}

impl Request {
    /// Whether this is shown.
    pub fn shows(&self, one: Shown) -> bool {
        self.shown.contains(&one)
    }

    /// What has the colors of the key; `None` without particles, bonds, and cracks.
    pub(super) fn foremost(&self) -> Option<Shown> {
        self.shown.iter().copied().filter(|one| *one <= Shown::Cracks).max()
    }

    /// Whether the colors need the stresses of the particles.
    pub fn needs_stress(&self) -> bool {
        self.foremost() == Some(Shown::Particles) && self.color.as_deref().is_some_and(values::is_stress)
    }

    /// Refuses what does not go together, with the reason. `times`: of the snapshots, s; `chosen`: numbers of those to draw.
    pub(super) fn check(&self, scenario: &Scenario, times: &[f64], chosen: &[usize]) -> Result<(), String> {
        if self.foremost().is_none() {
            return Err("there are no particles, bonds, or cracks to draw; show one of them".to_owned());
        }
        let needs_bonds = self.shown.iter().find(|one| matches!(one, Shown::Bonds | Shown::Cracks));
        if needs_bonds.is_some() && scenario.bonds.is_none() {
            return Err("the run has no [bonds], so it has no bonds and no cracks to draw; show particles".to_owned());
        }
        if self.shows(Shown::Cracks) && self.magnify != 1.0 {
            return Err(
                "cracks are drawn in the body before it deforms; leave out the factor of the displacements".to_owned()
            );
        }
        if self.needs_stress() && chosen.iter().any(|k| k + 1 != times.len()) {
            return Err(
                "a result holds the forces of the end only, so stresses give no color at other times".to_owned()
            );
        }
        if self.slice.is_some() && (self.direction.is_some() || !self.cuts.is_empty()) {
            return Err("a slice is seen from its front and cannot be cut; leave out the view and the cuts".to_owned());
        }
        if !(self.rate.is_finite() && self.rate > 0.0) {
            return Err(format!("{} images per second; give a positive number", self.rate));
        }
        if !self.magnify.is_finite() {
            return Err(format!("the factor of the displacements is {}; give a number", self.magnify));
        }
        match self.range {
            Some([low, high]) if !(low.is_finite() && high.is_finite() && low < high) => {
                Err(format!("the range of the colors is {low} to {high}; give two numbers, the smaller one first"))
            }
            _ => Ok(()),
        }
    }
}

impl Moments {
    /// Numbers of the snapshots to draw. `times`: those of all snapshots, s.
    pub(super) fn choose(&self, times: &[f64]) -> Result<Vec<usize>, String> {
        let (Some(first), Some(last)) = (times.first(), times.last()) else {
            return Err("the result has no snapshots".to_owned());
        };
        // A time that was printed has lost some digits.
        let slack = 1e-3 * (last - first);
        let nearest = |time: &f64| {
            if !(first - slack..=last + slack).contains(time) {
                return Err(format!("the time {time:e} s lies outside of the snapshots, {first:e} to {last:e} s"));
            }
            let distance = |k: &usize| (times[*k] - time).abs();
            Ok((0..times.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or_default())
        };
        match self {
            Self::Last => Ok(vec![times.len() - 1]),
            Self::Near(wanted) => wanted.iter().map(nearest).collect(),
            Self::All(most) => {
                let count = times.len().min((*most).max(1));
                let mut all: Vec<usize> = (0..count)
                    .map(|k| if count == 1 { times.len() - 1 } else { k * (times.len() - 1) / (count - 1) })
                    .collect();
                all.dedup();
                Ok(all)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The nearest snapshots, the ends always among them; no times outside.
    #[test]
    fn snapshots_are_chosen_by_time() {
        let times: Vec<f64> = (0..=10).map(f64::from).collect();
        let of = |moments: Moments| moments.choose(&times);
        assert_eq!(of(Moments::Last), Ok(vec![10]));
        assert_eq!(of(Moments::Near(vec![3.4, 10.0, 0.2])), Ok(vec![3, 10, 0]));
        assert!(of(Moments::Near(vec![11.0])).unwrap_err().contains("0e0 to 1e1 s"));
        assert_eq!(of(Moments::All(3)), Ok(vec![0, 5, 10]));
        assert_eq!(of(Moments::All(1)), Ok(vec![10]));
        assert_eq!(of(Moments::All(99)).unwrap().len(), 11);
        assert!(Moments::Last.choose(&[]).is_err());
    }
}
