//! Numbers that are not finite: every operator refuses them, or returns something that is not finite, but no plausible value.

use super::*;
use crate::strain::{Dimension, affine_fit};
use crate::structure::{layers, pair_correlation};
use crate::tessellation::{Domain, delaunay, power_diagram};

/// Inputs of the operators: five particles, of which three touch, in a periodic cell with edges of 4 m.
#[derive(Clone)]
struct Inputs {
    position: Vec<Vec3>,
    velocity: Vec<Vec3>,
    mass: Vec<f64>,
    branch: Vec<Vec3>,
    point: Vec<Vec3>,
    force: Vec<Vec3>,
    moment: Vec<Vec3>,
    matrix: Vec<Mat3>,
    points: Vec<Vec3>,
    distance: f64,
    edges: Mat3,
    change: Mat3,
    center: Vec3,
    radius: f64,
}

const PAIRS: [[u32; 2]; 2] = [[0, 1], [1, 2]];

impl Inputs {
    fn sound() -> Self {
        let position: Vec<Vec3> = [[0.1, 0.0, 0.0], [1.1, 0.1, 0.0], [1.2, 1.1, 0.1], [0.2, 0.3, 1.0], [0.9, 0.8, 0.7]]
            .map(Vec3::from)
            .into();
        let branch = PAIRS.map(|[a, b]| position[b as usize] - position[a as usize]).to_vec();
        let point = PAIRS.map(|[a, b]| (position[b as usize] + position[a as usize]) * 0.5).to_vec();
        let ones = |n: usize| vec![Vec3::new(1.0, 0.5, 0.25); n];
        Self {
            velocity: position.iter().map(|x| x * 0.5).collect(),
            mass: vec![1.0; 5],
            branch,
            point,
            force: ones(2),
            moment: ones(2),
            matrix: vec![Mat3::identity(); 5],
            points: ones(1),
            distance: 1.0,
            edges: Mat3::from_diagonal_element(4.0),
            change: Mat3::zeros(),
            center: Vec3::new(0.5, 0.5, 0.5),
            radius: 1.9,
            position,
        }
    }

    /// Every number of the inputs by its name, to be changed.
    fn numbers(&mut self) -> Vec<(&'static str, &mut f64)> {
        fn of<'a>(name: &'static str, rows: &'a mut [Vec3]) -> impl Iterator<Item = (&'static str, &'a mut f64)> {
            rows.iter_mut().flat_map(move |row| row.iter_mut().map(move |number| (name, number)))
        }
        let mut all: Vec<(&'static str, &mut f64)> = Vec::new();
        all.extend(of("position", &mut self.position));
        all.extend(of("velocity", &mut self.velocity));
        all.extend(of("branch", &mut self.branch));
        all.extend(of("point", &mut self.point));
        all.extend(of("force", &mut self.force));
        all.extend(of("moment", &mut self.moment));
        all.extend(of("points", &mut self.points));
        all.extend(self.mass.iter_mut().map(|mass| ("mass", mass)));
        all.extend(self.matrix.iter_mut().flat_map(|matrix| matrix.iter_mut().map(|number| ("matrix", number))));
        all.push(("distance", &mut self.distance));
        all.extend(self.edges.iter_mut().map(|number| ("edges", number)));
        all.extend(self.change.iter_mut().map(|number| ("change", number)));
        all.extend(self.center.iter_mut().map(|number| ("center", number)));
        all.push(("radius", &mut self.radius));
        all
    }

    /// The sum of all numbers that each operator returns, with what it reads.
    fn results(&self) -> Vec<(&'static str, Vec<&'static str>, Result<f64, OperatorError>)> {
        let contacts =
            || ContactSet::new(&self.position, &PAIRS, &self.branch, &self.point, &self.force, Some(&self.moment));
        let loads = || LoadSet::new(5, &[0, 1], &self.point, &self.force, Some(&self.moment));
        let period = Period { edges: self.edges, change: self.change };
        let sphere = Region::Sphere { center: self.center, radius: self.radius };
        let clipped = Truncation::BranchClipped;
        let contact = ["position", "branch", "point", "force", "moment"];
        let region = ["edges", "change", "center", "radius"];
        let read = |more: &[&[&'static str]]| more.concat();
        let sum = |m: &Mat3| m.sum();
        let mut all = Vec::new();
        for (name, period) in [("region-stress", None), ("region-stress in a period", Some(&period))] {
            let used = if period.is_some() { &region[..] } else { &region[2..] };
            let found = contacts().and_then(|set| stress::region_stress(&set, &sphere, clipped, period));
            all.push((name, read(&[&contact, used]), found.map(|found| sum(&found.stress))));
        }
        let whole = Region::All { volume: 64.0 };
        let found = contacts().and_then(|set| stress::region_stress(&set, &whole, clipped, None));
        all.push(("region-stress of all", contact.to_vec(), found.map(|found| sum(&found.stress))));
        let found = contacts().and_then(|set| fabric::fabric(&set, &sphere, clipped, Some(&period)));
        all.push(("fabric", read(&[&contact, &region]), found.map(|found| found.tensor.sum() + found.coordination)));
        let found = contacts().and_then(|set| couple_stress::conjugate(&set, &sphere, &self.center, Some(&period)));
        all.push(("conjugate", read(&[&contact, &region]), found.map(|found| sum(&found.couple_stress))));
        let kernel = coarse_grain::Kernel::new(self.radius, Dimension::Three);
        let found = contacts().and_then(|set| {
            coarse_grain::coarse_grain(&set, &self.mass, &self.velocity, &kernel?, &self.points, Some(&period))
        });
        let used = read(&[&contact, &["edges", "change", "radius", "points", "mass", "velocity"]]);
        all.push(("coarse-grain", used, found.map(|found| sum(&found[0].stress) + found[0].density)));
        let moving = read(&[&["position", "velocity"], &region]);
        let found = stress::kinetic_stress(&self.position, &self.mass, &self.velocity, &sphere, Some(&period));
        all.push(("kinetic stress", read(&[&moving, &["mass"]]), found.map(|found| sum(&found))));
        let found = stress::solid_fraction(&self.position, &self.mass, &sphere, Some(&period));
        all.push(("solid fraction", read(&[&["position", "mass"], &region]), found));
        let found = stress::region_stress_from_particles(&self.position, &self.matrix, &sphere, Some(&period));
        all.push(("stress from particles", read(&[&["position", "matrix"], &region]), found.map(|found| sum(&found))));
        let found = affine_fit(&self.position, &self.velocity, &[], &sphere, Some(&period), Dimension::Three);
        all.push(("affine fit", moving, found.map(|found| sum(&found.gradient))));
        let found = loads().and_then(|set| stress::boundary_stress(&set, 64.0));
        all.push(("boundary stress", vec!["point", "force"], found.map(|found| sum(&found))));
        let found = loads().and_then(|set| couple_stress::external(&self.position, &set, 64.0, &self.center));
        let used = vec!["point", "force", "moment", "center"];
        all.push(("couple stress from loads", used, found.map(|found| sum(&found))));
        let found = pair_correlation(&[([0, 1], self.distance)], &[true; 2], 1.0, 2.0, 4);
        all.push(("pair correlation", vec!["distance"], found.map(|found| found.g.iter().sum())));
        let bounds = (Vec3::repeat(-1.0), Vec3::repeat(3.0));
        let found = layers(&self.position, &self.mass, &[1; 5], &|_| Some(0), bounds, self.radius, 1);
        all.push(("layers", vec!["position", "mass", "radius"], found.map(|found| found.solid_fraction[0])));
        let found = delaunay(&self.position, Dimension::Three, Some(&self.edges));
        all.push(("delaunay", vec!["position", "edges"], found.map(|found| found.len() as f64)));
        let domain = Domain::Periodic(self.edges);
        let found = power_diagram(&self.position, &self.mass, &domain, Dimension::Three);
        all.push(("power diagram", vec!["position", "mass", "edges"], found.map(|found| found.volume())));
        all
    }
}

/// The second number of each array, and single numbers, replaced by NaN and by both infinities.
#[test]
fn numbers_that_are_not_finite_never_give_a_plausible_value() {
    let sound = Inputs::sound();
    for (operator, _, found) in sound.results() {
        assert!(found.as_ref().is_ok_and(|value| value.is_finite()), "{operator}: {found:?}");
    }
    let names: Vec<&str> = sound.clone().numbers().iter().map(|(name, _)| *name).collect();
    let second = |k: &usize| names[..*k].iter().filter(|name| **name == names[*k]).count() == 1;
    let single = |k: &usize| names.iter().filter(|name| **name == names[*k]).count() == 1;
    for k in (0..names.len()).filter(|k| second(k) || single(k)) {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut inputs = sound.clone();
            let (name, number) = inputs.numbers().swap_remove(k);
            *number = bad;
            for (operator, reads, found) in inputs.results() {
                let refused = found.as_ref().map_or(true, |value| !value.is_finite());
                assert!(refused || !reads.contains(&name), "{operator} with {name} = {bad}: {found:?}");
            }
        }
    }
}

/// A region much larger than the periodic cell, as "5 m" for "5 mm", is refused; one of three cells is not.
#[test]
fn regions_reach_over_few_cells() {
    let inputs = Inputs::sound();
    let set = ContactSet::new(&inputs.position, &PAIRS, &inputs.branch, &inputs.point, &inputs.force, None).unwrap();
    let period = Period::of(inputs.edges);
    let stress = |radius: f64| {
        let sphere = Region::Sphere { center: Vec3::zeros(), radius };
        stress::region_stress(&set, &sphere, Truncation::BranchClipped, Some(&period))
    };
    assert!(stress(6.0).is_ok());
    let error = stress(6000.0).unwrap_err().to_string();
    assert!(error.contains("3e10 images") && error.contains("unit"), "{error}");
    // A thin body in a long cell: many images along one edge alone.
    let bar = Region::Box { low: Vec3::new(-400.0, 0.0, 0.0), high: Vec3::new(400.0, 1.0, 1.0) };
    assert!(stress::region_stress(&set, &bar, Truncation::BranchClipped, Some(&period)).is_ok());
}

/// `−0` and `0` are the same place, and in the plane so are points that differ in z: the triangulation would not end.
#[test]
fn points_at_the_same_place_are_refused_whatever_the_sign_of_zero() {
    let place = |z: f64| Vec3::new(-z, z, 0.0);
    let mut points = vec![Vec3::new(-2.0, 0.0, -1.0), place(0.0), Vec3::new(0.0, 1.0, 2.0), Vec3::new(0.0, -1.0, 1.0)];
    points.extend([place(-0.0), Vec3::new(1.0, -2.0, 1.0), Vec3::new(-2.0, -1.0, 0.0)]);
    let coincident =
        |found: Result<(), OperatorError>| matches!(found, Err(OperatorError::Coincident { first: 1, second: 4 }));
    assert!(coincident(delaunay(&points, Dimension::Three, None).map(drop)));
    let domain = Domain::Box { low: Vec3::repeat(-3.0), high: Vec3::repeat(3.0) };
    assert!(coincident(power_diagram(&points, &[0.0; 7], &domain, Dimension::Three).map(drop)));
    points[4].z = 1.0;
    assert!(delaunay(&points, Dimension::Three, None).is_ok());
    assert!(coincident(delaunay(&points, Dimension::Two, None).map(drop)));
}
