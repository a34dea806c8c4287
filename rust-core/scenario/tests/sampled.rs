//! Operators of `[[sample]]` on running simulations.

mod shared;

use std::fmt::Write as _;

use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::strain::Dimension;
use concordem_operator::strain::cosserat;
use concordem_operator::tessellation::{Domain, power_diagram};
use concordem_scenario::sampling::{Operator, RegionRule, ScheduledOperator, rotation_vector};
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::template;

use shared::{number, place, simulation};

/// The rows of all operators at one step.
struct Rows {
    schedule: Vec<ScheduledOperator>,
    values: Vec<Vec<f64>>,
}

impl Rows {
    /// Takes `steps` steps and returns the rows of the last one; the intervals of the operators must match this step.
    fn of(simulation: &mut Simulation, steps: u64) -> Self {
        let mut values = Vec::new();
        for _ in 0..steps {
            let advance = simulation.advance().unwrap();
            values = advance.operators.into_iter().map(|row| row.values).collect();
        }
        let schedule = simulation.schedule.operators.clone();
        assert_eq!(values.len(), schedule.len());
        for (sample, row) in schedule.iter().zip(&values) {
            assert_eq!(row.len(), sample.operator.width() * sample.cells(), "{}", sample.name);
            assert!(row.iter().all(|value| value.is_finite()), "{}: {row:?}", sample.name);
        }
        Self { schedule, values }
    }

    fn reals(&self, name: &str, quantity: &str) -> &[f64] {
        let k = number(&self.schedule, name);
        &self.values[k][place(&self.schedule[k], quantity)]
    }

    fn tensor(&self, name: &str, quantity: &str) -> Mat3 {
        Mat3::from_row_slice(self.reals(name, quantity))
    }

    fn vector(&self, name: &str, quantity: &str) -> Vec3 {
        Vec3::from_row_slice(self.reals(name, quantity))
    }
}

#[track_caller]
fn near(a: &Mat3, b: &Mat3, error: f64) {
    assert!((a - b).abs().max() <= error, "{a}{b} differ by {:e}, allowed {error:e}", (a - b).abs().max());
}

/// The definition of an operator is complete, and its line in the list, from which readers find the file, has its name.
#[test]
fn operators_have_the_names_of_their_lines() {
    for operator in Operator::ALL {
        let definition = operator.definition();
        let capitalized = |word: &str| word[..1].to_uppercase() + &word[1..];
        assert_eq!(format!("{operator:?}"), definition.name.split('-').map(capitalized).collect::<String>());
        assert!(!definition.meaning.is_empty() && !definition.quantities.is_empty(), "{operator:?}");
    }
}

/// In a periodic cell under shear and stretch, Delaunay cells give the strain of the periodic cell for any motion of the
/// particles, contact cells add the rotations, and three definitions of stress agree. Tolerance: rounding in sums of a
/// thousand terms, 1e-12 of the largest.
#[test]
fn all_operators_of_a_periodic_cell() {
    let text = template("cpm-periodic").unwrap().text.replace("count = 1000", "count = 120");
    let text = text.replace("[0, 0, 0.4]", "[2, 0, 4]");
    let mut samples = "[[set]]\nname = \"all\"\nselection = { kind = \"all\" }\n".to_owned();
    for (name, id) in [("first", 0), ("second", 1)] {
        let _ = writeln!(samples, "[[set]]\nname = \"{name}\"\nselection = {{ kind = \"ids\", ids = [{id}] }}");
    }
    for operator in Operator::ALL {
        let definition = operator.definition();
        let region = match definition.region {
            // This cell has no walls and conducts no heat.
            RegionRule::WholeBody | RegionRule::Wall | RegionRule::WallAlone => continue,
            _ if definition.needs_heat() => continue,
            RegionRule::Sphere => "region = { kind = \"sphere\", center = [0, 0, 0], radius = \"9 mm\" }\n",
            RegionRule::Set => "set = \"all\"\n",
            RegionRule::TwoSets => "sets = [\"first\", \"second\"]\n",
            RegionRule::Any | RegionRule::WholeBodyOrCell | RegionRule::PeriodicCell | RegionRule::Shape => "",
        };
        let _ = write!(samples, "[[sample]]\noperator = \"{}\"\ninterval = 299\n{region}", operator.name());
    }
    let mut simulation = simulation(&format!("{text}\n{samples}"));
    let places = simulation.state.particles.position.clone();
    let rows = Rows::of(&mut simulation, 300);
    // The rows belong to the state before the last step.
    let (dt, cell) = (simulation.state.clock.dt, simulation.state.cell.unwrap());
    let l = cell.velocity_gradient;
    let matrix = cell.matrix - cell.matrix_change;
    let first = cell.deformation_gradient.try_inverse().unwrap() * cell.matrix;
    let gradient = (matrix - first) * first.try_inverse().unwrap();
    assert!(gradient[(2, 2)] > 100.0 * dt && gradient[(2, 0)] > 100.0 * dt);
    let strain = gradient.abs().max();
    near(&rows.tensor("cell-strain", "gradient"), &gradient, 1e-9 * strain);
    near(&rows.tensor("cell-rate", "gradient"), &l, 1e-12 * l.abs().max());
    let contact_cells = rows.tensor("contact-cell-strain", "gradient");
    // Contact cells add the rotations, averaged by cell volume. Contacts lie on the lines of centers, not in the middle
    // of the faces, and the rotations are one step later, so the tolerance is a few percent of the strain.
    let diagram =
        power_diagram(&places, &simulation.state.particles.radius, &Domain::Periodic(first), Dimension::Three);
    let volumes = diagram.unwrap().volumes;
    let turned: Vec3 = simulation
        .state
        .particles
        .orientation
        .iter()
        .zip(&volumes)
        .map(|(q, v)| rotation_vector(q) * (v / volumes.iter().sum::<f64>()))
        .sum();
    let expected = gradient + cosserat::cross_of_identity(&turned);
    near(&contact_cells, &expected, 0.02 * strain);
    // Stress from branch vectors, from particles, and from net wrenches.
    let stress = rows.tensor("region-stress", "stress");
    let size = stress.abs().max();
    assert!(size > 1e5, "{stress}");
    near(&rows.tensor("particle-stress", "stress"), &stress, 1e-12 * size);
    near(&rows.tensor("couple-stress", "stress"), &stress, 1e-12 * size);
    let solid = rows.reals("particle-stress", "solid_fraction")[0];
    near(&(rows.tensor("particle-stress", "mean_particle_stress") * solid), &stress, 1e-12 * size);
    assert_eq!(rows.reals("porosity", "solid_fraction")[0], solid);
    // The power put into contacts is the power of stress and strain rate plus that of the non-affine motion.
    let power = |name: &str| rows.reals("power", name)[0];
    let all = power("contacts");
    assert!(all > 0.0 && power("gap").abs() > 1e-6 * all, "{all} {}", power("gap"));
    assert!((all - power("stress") - power("couple") - power("gap")).abs() < 1e-9 * all);
    // A kernel that contains about seventy particles gives the mean density.
    let mass: f64 = simulation.state.particles.mass.iter().sum();
    let density = mass / cell.volume();
    assert!((rows.reals("coarse-grain", "density")[0] / density - 1.0).abs() < 0.05);
}

/// Spheres compressed in a box: the forces on the walls are those at the boundary, and the boundary stress equals
/// the particle stress up to weight and inertia.
#[test]
fn walls_and_boundary() {
    let mut samples = String::new();
    let ends = ["x minimum", "x maximum", "y minimum", "y maximum", "z minimum", "z maximum"];
    for end in ends {
        let _ = write!(
            samples,
            "[[sample]]\nname = \"{end}\"\noperator = \"wall-traction\"\nwall = \"box {end}\"\narea = \"50 mm^2\"\n"
        );
    }
    for operator in ["boundary-stress", "particle-stress"] {
        let _ = write!(
            samples,
            "[[sample]]\noperator = \"{operator}\"\nregion = {{ kind = \"all\", volume = \"600 mm^3\" }}\n"
        );
    }
    let mut spheres = String::new();
    for k in 0..64 {
        let at = [k % 4, k / 4 % 4, k / 16].map(|i| f64::from(2 * i - 3) * 1e-3);
        let _ = write!(spheres, "[{}, {}, {}, 1e-3],", at[0], at[1], at[2]);
    }
    let mut simulation = simulation(&format!(
        "version = 1\n[packing]\nkind = \"spheres\"\nspheres = [{spheres}]\n[[material]]\nname = \"m\"\ndensity = 2500\n\
         frictional = {{ young = \"10 MPa\", stiffness_ratio = 0.3, friction_coefficient = 0.4 }}\n[contacts]\n\
         law = \"frictional\"\n[integration]\ngravity = [0, 0, -9.81]\ndamping = {{ kind = \"local\", coefficient = 0.5 }}\n\
         [[wall]]\nname = \"box\"\nmaterial = \"m\"\nshape = {{ kind = \"box\", minimum = [\"-3.992 mm\", \"-3.992 mm\", \
         \"-3.991 mm\"], maximum = [\"3.992 mm\", \"3.992 mm\", \"3.992 mm\"] }}\n[stop]\nsteps = 100000\n[output]\n\
         sample_interval = 2999\n{samples}"
    ));
    let rows = Rows::of(&mut simulation, 3000);
    let forces = ends.map(|end| rows.vector(end, "force"));
    for (k, force) in forces.iter().enumerate() {
        // The particles push the walls outward.
        assert!(force[k / 2] * if k % 2 == 0 { -1.0 } else { 1.0 } > 0.0, "{k}: {force}");
        assert_eq!(rows.vector(ends[k], "traction"), force / 50e-6);
        assert_eq!(rows.reals(ends[k], "contacts"), [16.0]);
    }
    let total = rows.vector("boundary-stress", "force");
    let size: f64 = forces.iter().map(Vec3::norm).sum();
    assert!((total + forces.iter().sum::<Vec3>()).norm() < 1e-13 * size);
    let (outer, inner) = (rows.tensor("boundary-stress", "stress"), rows.tensor("particle-stress", "stress"));
    assert!(inner.trace() < -100.0, "{inner}");
    // The difference is the weight and the remaining inertia of 64 spheres, 1e-4 N each; the walls push each of them with
    // about 1e-1 N (8 um · 1e4 N/m).
    near(&outer, &inner, 0.01 * inner.abs().max());
}

/// A prism pulled by its end layers: the boundary stress from the reactions of the layers equals the stress of the body up
/// to inertia, the cells of a grid add up to the box, and regions move and deform.
#[test]
fn supports_grids_and_moving_regions() {
    let region =
        "{ kind = \"box\", minimum = [\"-3 mm\", \"-4 mm\", \"-5 mm\"], maximum = [\"3 mm\", \"4 mm\", \"5 mm\"] }";
    let whole = "{ kind = \"all\", volume = \"1296 mm^3\" }";
    let mut simulation = simulation(&format!(
        "version = 1\n[packing]\nkind = \"lattice\"\nlattice = \"fcc\"\nradius = \"1 mm\"\n\
         shape = {{ kind = \"box\", size = [\"9 mm\", \"9 mm\", \"16 mm\"] }}\n[[material]]\nname = \"concrete\"\n\
         density = 4800\ncpm = {{ young = \"25 GPa\", shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = 5, \
         cohesion = \"3 MPa\", friction_coefficient = 0.8 }}\n[bonds]\nlaw = \"cpm\"\ninteraction_ratio = 1.5\n\
         [contacts]\nlaw = \"none\"\n[integration]\ndamping = {{ kind = \"local\", coefficient = 0.3 }}\n[loading]\n\
         kind = \"uniaxial\"\nstrain_rate = \"1 1/s\"\n[stop]\nsteps = 10000\n[output]\nsample_interval = 599\n\
         [[sample]]\noperator = \"boundary-stress\"\nregion = {whole}\n\
         [[sample]]\noperator = \"region-stress\"\nname = \"whole\"\nregion = {whole}\n\
         [[sample]]\noperator = \"region-stress\"\nname = \"core\"\nregion = {region}\n\
         [[sample]]\noperator = \"region-stress\"\nname = \"map\"\nregion = {region}\ngrid = [2, 3, 4]\n\
         [[sample]]\noperator = \"porosity\"\nname = \"stretched\"\nregion = {region}\n\
         velocity_gradient = [[0, 0, 0], [0, 0, 0], [0, 0, 500]]\n\
         [[sample]]\noperator = \"porosity\"\nname = \"gone\"\nregion = {region}\nvelocity = [0, 0, 100]\n"
    ));
    let rows = Rows::of(&mut simulation, 600);
    let (outer, inner) = (rows.tensor("boundary-stress", "stress"), rows.tensor("whole", "stress"));
    assert!(inner[(2, 2)] > 1e5, "{inner}");
    near(&outer, &inner, 0.05 * inner.abs().max());
    // Clipped branch vectors add up over a partition of space.
    let core = rows.tensor("core", "stress") * rows.reals("core", "volume")[0];
    let (stress, volume) = (rows.reals("map", "stress"), rows.reals("map", "volume"));
    assert_eq!((stress.len(), volume.len()), (9 * 24, 24));
    let sum: Mat3 = stress.chunks(9).zip(volume).map(|(s, v)| Mat3::from_row_slice(s) * *v).sum();
    near(&sum, &core, 1e-12 * core.abs().max());
    // The row belongs to the state one step earlier.
    let time = simulation.state.clock.time() - simulation.state.clock.dt;
    let grown = rows.reals("stretched", "volume")[0] / 480e-9;
    assert!((grown / concordem_contact::math::exp(500.0 * time) - 1.0).abs() < 1e-12, "{grown}");
    assert!(grown > 1.02, "{grown}");
    // 100 m/s for about 1e-4 s: the region has left the specimen.
    assert_eq!(rows.reals("gone", "solid_fraction")[0], 0.0);
}
