//! Test case of ERDC TR-14-6 Report 3, §5.2: spheres are grown in a rigid cube, compressed by its lid, and sampled in a
//! sphere in the middle. Prints one JSON object.
//!
//! `cargo run --release --example rigid_box_sampling -- CASE GEOMETRY [SCALE [STATE]]`: case 1 to 3; geometry 1: the printed
//! cube of 6 in with as many spheres of the printed sizes as fit; 2: a cube of 10.2 in with the printed number. `SCALE`
//! divides the number of spheres (radii grow with it), for a quick test. The file `STATE` (JSON)
//! receives the final state, its forces, and the results of the operators, for comparison with another program
//! (`validation/yade_operators.py`).
//!
//! The report does not give these values, chosen here: Hertz-Mindlin spheres of E = 200 MPa, ν = 0.25, ρ = 2650 kg/m³,
//! friction 0.5, at the walls 0.51 (from its wall stresses), no gravity, local damping 0.3; radii between the printed
//! bounds with the printed mean (density ∝ exp(b r)); grown to 69 kPa; lid at 0.4/s, an inertial number of 1e-3 or
//! less.

use concordem::law::Elastic;
use concordem::math::{Mat3, Vec3};
use concordem::operator::strain::{Dimension, affine_fit};
use concordem::operator::stress::{
    ParticleVolume, Partition, boundary_stress, kinetic_stress, particle_moments, particle_stress, region_stress,
    solid_fraction,
};
use concordem::operator::tessellation::{Domain, power_diagram};
use concordem::operator::{LoadSet, Region, Truncation, couple_stress, fabric};
use concordem::packing::{GrownBox, SizeDistribution, grown_box};
use concordem::solver::Solver;
use concordem::solver::record::Forces;
use concordem::state::Particles;
use serde_json::json;

const INCH: f64 = 0.0254;

/// Smallest, largest, mean radius (in), spheres in the printed cube, spheres that fit 6 in.
const CASES: [(f64, f64, f64, usize, usize); 3] =
    [(0.14, 0.31, 0.24, 9029, 1773), (0.08, 0.23, 0.19, 18015, 3706), (0.06, 0.22, 0.16, 27025, 5498)];

/// Random radii between bounds with a given mean: density `exp(b ξ)` of `ξ` from −1 to 1, whose mean is
/// `coth b − 1/b`.
fn radii(low: f64, high: f64, mean: f64) -> SizeDistribution {
    let wanted = (2.0 * mean - low - high) / (high - low);
    let (mut from, mut to) = (1e-6, 50.0);
    for _ in 0..100 {
        let b: f64 = 0.5 * (from + to);
        if 1.0 / libm::tanh(b) - 1.0 / b < wanted { from = b } else { to = b }
    }
    let classes = (0..200).map(|k| (f64::from(k) + 0.5) / 200.0);
    SizeDistribution::Discrete(classes.map(|s| (low + (high - low) * s, libm::exp(from * (2.0 * s - 1.0)))).collect())
}

fn rows(m: &Mat3) -> Vec<Vec<f64>> {
    (0..3).map(|i| (0..3).map(|j| m[(i, j)]).collect()).collect()
}

fn list(vectors: &[Vec3]) -> Vec<[f64; 3]> {
    vectors.iter().map(|v| [v.x, v.y, v.z]).collect()
}

/// Particles, contacts, and the operator results that another program can compute, too. Cells of the power diagram at the
/// border are omitted, because they depend on how a program closes its diagram.
fn frozen_state(particles: &Particles, forces: &Forces, edge: f64, lid: &Vec3) -> serde_json::Value {
    let set = forces.contacts.set(particles).expect("contacts");
    let (low, high) = (Vec3::zeros(), Vec3::repeat(edge) + lid);
    let volume = (high - low).product();
    let whole = Region::All { volume };
    let volumes = ParticleVolume::Sphere.of(&particles.radius).expect("radii");
    let of_particles =
        particle_stress(&set, &LoadSet::none(), Partition::ContactPoint, &volumes).expect("volumes above 0");
    let fabric = fabric::fabric(&set, &whole, Truncation::BranchClipped, None).expect("contacts");
    // YADE closes its diagram at the bounding box of the spheres; cells well inside the box are not cut.
    let mut domain = [Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)];
    for (x, r) in particles.position.iter().zip(&particles.radius) {
        domain = [domain[0].inf(&x.add_scalar(-0.9 * r)), domain[1].sup(&x.add_scalar(0.9 * r))];
    }
    let domain = Domain::Box { low: domain[0], high: domain[1] };
    let diagram = power_diagram(&particles.position, &particles.radius, &domain, Dimension::Three).expect("cells");
    let mut inner = vec![true; particles.len()];
    diagram.border().for_each(|face| inner[face.point as usize] = false);
    json!({
        "volume": volume, "position": list(&particles.position), "radius": particles.radius, "mass": particles.mass,
        "velocity": list(&particles.velocity), "pair": forces.contacts.pair, "point": list(&forces.contacts.point),
        "force": list(&forces.contacts.force),
        "found": {
            "stress": rows(&region_stress(&set, &whole, Truncation::BranchClipped, None).expect("a volume").stress),
            "kinetic_stress":
                rows(&kinetic_stress(&particles.position, &particles.mass, &particles.velocity, &whole, None).expect("mass")),
            "particle_stress": of_particles.iter().map(rows).collect::<Vec<_>>(),
            "fabric": rows(&fabric.tensor), "coordination": fabric.coordination,
            "porosity": 1.0 - solid_fraction(&particles.position, &volumes, &whole, None).expect("a volume"),
            "cell_volume": diagram.volumes, "inner_cell": inner,
        },
    })
}

#[expect(clippy::too_many_lines, reason = "a study, step by step, and the record of its figures")]
fn main() {
    let begin = std::time::Instant::now();
    let numbers: Vec<usize> = std::env::args().skip(1).take(3).map(|a| a.parse().expect("a number")).collect();
    let (case, geometry) = (numbers[0], numbers[1]);
    let scale = numbers.get(2).copied().unwrap_or(1);
    let state_file = std::env::args().nth(4);
    let (low, high, mean, many, few) = CASES[case - 1];
    let (edge, count) = if geometry == 1 { (6.0 * INCH, few) } else { (10.2 * INCH, many) };
    let density = 2650.0;
    let recipe = GrownBox {
        sizes: radii(low * INCH, high * INCH, mean * INCH),
        count: count / scale,
        edge,
        seed: case as u64,
        density,
        elastic: Elastic { young: 200e6, poisson: 0.25 },
        friction: 0.5,
        wall_friction: 0.51,
        pressure: 69e3,
        unbalanced: 5e-3,
        step_limit: 2_000_000,
    };
    let grown = grown_box(&recipe, &mut |step, fraction, pressure, unbalanced| {
        if step % 10_000 == 0 {
            eprintln!("growth, step {step}: solid {fraction:.4}, {pressure:.3e} Pa, unbalanced {unbalanced:.1e}");
        }
    })
    .expect("a packing");
    let mut state = grown.state;
    let places = state.particles.position.clone();
    // The lid.
    let (stroke, rate) = (0.4 * INCH, 0.4);
    state.walls[5].velocity = Vec3::new(0.0, 0.0, -rate * edge);
    let steps = (stroke / (rate * edge * state.clock.dt)).round() as u64;
    let mut solver = Solver::new(grown.model, &mut state).expect("a sound state");
    for step in 0..steps {
        solver.step_with(&mut state, false).expect("stable");
        if step % 10_000 == 0 {
            eprintln!("lid, step {step} of {steps}: top {:.3e} Pa", state.walls[5].force.z / (edge * edge));
        }
    }
    let forces = solver.record(&mut state).expect("forces");
    let before = state.particles.clone();
    let walls_before = state.walls.clone();
    let report = solver.step_with(&mut state, true).expect("stable");

    // The sphere in the middle of the initial cube.
    let centre = Vec3::repeat(0.5 * edge);
    let region = Region::Sphere { center: centre, radius: 2.0 * INCH };
    let set = forces.contacts.set(&before).expect("contacts");
    let walls = forces.walls.set(&before).expect("loads");
    let displacement: Vec<Vec3> = before.position.iter().zip(&places).map(|(now, then)| now - then).collect();
    let rotation: Vec<Vec3> = before.orientation.iter().map(concordem::sampling::rotation_vector).collect();
    let fit = affine_fit(&places, &displacement, &rotation, &region, None, Dimension::Three).expect("particles");
    let now =
        affine_fit(&before.position, &displacement, &rotation, &region, None, Dimension::Three).expect("particles");
    let stress = |truncation| region_stress(&set, &region, truncation, None).expect("a region");
    let [internal, half, clipped] =
        [Truncation::InternalOnly, Truncation::HalfCrossing, Truncation::BranchClipped].map(stress);
    let conjugate = couple_stress::conjugate(&set, &region, &centre, None).expect("contacts");
    let inside = fabric::fabric(&set, &region, Truncation::InternalOnly, None).expect("contacts");
    let all = 2.0 * set.len() as f64 / before.len() as f64;
    let volumes: Vec<f64> = before.radius.iter().map(|r| 4.0 / 3.0 * std::f64::consts::PI * r.powi(3)).collect();
    let law = |length: f64| {
        let q = length / (2.0 * INCH);
        1.0 - 0.75 * q + q * q * q / 16.0
    };
    if let Some(file) = state_file {
        let frozen = frozen_state(&before, &forces, edge, &walls_before[5].displacement);
        std::fs::write(&file, frozen.to_string()).expect("a file that can be written");
    }
    let mean_radius = before.radius.iter().sum::<f64>() / before.len() as f64;
    let force_sum: f64 = forces.contacts.force.iter().map(Vec3::norm).sum();
    let couple_values = conjugate.couple_stress.svd(false, false).singular_values;

    // Force balance over all states and walls.
    let left: Mat3 = particle_moments(&set, &walls, Partition::ContactPoint).iter().sum();
    let mut right = boundary_stress(&walls, 1.0).expect("a volume");
    for p in 0..before.len() {
        // Damping and inertia balance the contact forces: b − m a = −F.
        let net = solver.forces()[p];
        right -= before.position[p] * net.transpose();
    }
    let height = edge + walls_before[5].displacement.z;
    let area = |k: usize| if k / 2 == 2 { edge * edge } else { edge * height };
    let traction: Vec<Vec<f64>> = (0..6).map(|k| (state.walls[k].force / area(k)).iter().copied().collect()).collect();
    let side: Vec<f64> = (0..4).map(|k| (traction[k][2] / traction[k][k / 2]).abs()).collect();
    let strain = fit.strain();
    let platen = -stroke / edge;
    let others = [(0, 0), (1, 1), (0, 1), (1, 2), (0, 2)].iter().map(|&ij| strain[ij].abs()).fold(0.0, f64::max);
    println!(
        "{}",
        serde_json::to_string_pretty(&json!({
            "case": case, "geometry": geometry, "scale": scale, "spheres": before.len(), "edge_m": edge,
            "duration_s": begin.elapsed().as_secs_f64(),
            "steps": { "growth": grown.steps, "lid": steps, "time_step_s": state.clock.dt },
            "inertial_number": rate * 2.0 * mean_radius * (density / 69e3).sqrt(),
            "growth": grown.growth, "start_pressure_Pa": grown.pressure,
            "unbalanced": (report.kick.net_force_squared / report.kick.free_particles as f64).sqrt()
                / (report.force_squared / report.active.iter().sum::<u64>() as f64).sqrt(),
            "mean_radius_in": mean_radius / INCH,
            "rev": {
                "spheres": inside.particles, "contacts": inside.contacts,
                "porosity": 1.0 - solid_fraction(&before.position, &volumes, &region, None).expect("a region"),
                "coordination": inside.coordination, "coordination_of_all": all,
                "coordination_ratio": inside.coordination / all,
                "mean_branch_in": inside.branch_length / INCH,
            },
            "A1": {
                "platen_strain": platen, "strain_zz": strain[(2, 2)], "ratio": strain[(2, 2)] / platen,
                "strain_zz_present_configuration": now.strain()[(2, 2)],
                "largest_other_over_zz": others / strain[(2, 2)].abs(),
                "strain": rows(&strain), "curvature_1_per_m": rows(&fit.curvature),
                "micro_rotation": fit.micro_rotation().iter().copied().collect::<Vec<f64>>(),
            },
            "A2": {
                "internal_over_clipped_zz": internal.stress[(2, 2)] / clipped.stress[(2, 2)],
                "internal_over_clipped_trace": internal.stress.trace() / clipped.stress.trace(),
                "half_over_clipped_trace": half.stress.trace() / clipped.stress.trace(),
                "law_by_branch": law(inside.branch_length), "law_by_mean_radius": law(2.0 * mean_radius),
            },
            "A3": {
                "rigid_force": conjugate.rigid_force.norm() * conjugate.volume / force_sum,
                "rigid_moment": conjugate.rigid_moment.norm() * conjugate.volume / (force_sum * mean_radius),
            },
            "A4": {
                "clipped_Pa": rows(&clipped.stress), "internal_Pa": rows(&internal.stress),
                "bottom_Pa": traction[4][2], "top_Pa": traction[5][2],
                "clipped_zz_over_mean_of_both": clipped.stress[(2, 2)] / (0.5 * (traction[4][2] - traction[5][2])),
                "bottom_over_top": (traction[4][2] / traction[5][2]).abs(),
                "lateral_over_axial": (0..4).map(|k| traction[k][k / 2].abs()).sum::<f64>() / 4.0
                    / (0.5 * (traction[4][2].abs() + traction[5][2].abs())),
            },
            "A5": { "side_wall_shear_over_normal": side, "wall_friction": 0.51 },
            "A6": { "balance": (left - right).abs().max() / left.abs().max() },
            "A7": {
                "couple_stress_N_per_m": rows(&conjugate.couple_stress),
                "singular_values": couple_values.iter().copied().collect::<Vec<f64>>(),
            },
            "wall_traction_Pa": traction,
        }))
        .expect("numbers")
    );
}
