//! `concordem elastic`: elastic constants of a scenario's packing and bonds, by four methods.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use nalgebra::Matrix6;

use super::drive::build;
use super::meter::Meter;
use super::settings::Settings;
use super::{Console, Failure, Work};
use concordem_scenario::assembly::Assembly;
use concordem_scenario::schema::{ProblemKind, Scenario};
use concordem_statics::relaxed::{Relaxation, relaxed_stiffness};
use concordem_statics::{
    Accuracy, CellStiffness, ClosedForm, Derivatives, ElasticConstants, LinkNetwork, StaticsError,
    cell_stiffness_and_derivatives, closed_form,
};

/// Arguments of `concordem elastic`.
#[derive(Debug, clap::Args)]
pub(super) struct ElasticArguments {
    /// Scenario file with a periodic packing and bonds; its loading is ignored
    scenario: PathBuf,
    #[command(flatten)]
    settings: Settings,
    /// Skip relaxed dynamics, the slowest of the four methods
    #[arg(long)]
    no_dynamics: bool,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Relative residual of the static solution
    #[arg(long, value_name = "SHARE", default_value_t = Accuracy::default().residual)]
    residual: f64,
    #[command(flatten)]
    work: Work,
}

/// Results of all methods.
struct Results {
    closed: Option<ClosedForm>,
    affine: ElasticConstants,
    cell: CellStiffness,
    network: ElasticConstants,
    dynamics: Option<(ElasticConstants, u64)>,
    /// `ΣLA/3V` for cross-sections of the links by Ē, i.e. `Σ k_N L²/3V`, Pa.
    stiffness_sum: f64,
    shear_ratio: f64,
    particles: usize,
    deformable: bool,
    /// Duration of the static solution, s.
    time: f64,
}

pub(super) fn elastic(arguments: &ElasticArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    if !(arguments.residual > 0.0 && arguments.residual < 1e-3) {
        let message =
            format!("--residual is {:e}; it must be between 0 and 1e-3, for example 1e-11", arguments.residual);
        return Err(Failure::Usage(message));
    }
    let scenario = arguments.settings.read(&arguments.scenario)?;
    let cache = console.cache();
    let display = console.display(&arguments.work);
    let answers = arguments.work.install(|| {
        let meter = Meter::new(display);
        let assembly = build(&scenario, cache.as_ref(), &meter)?;
        if !arguments.work.quiet {
            meter.finish();
            console.warn(&scenario, &scenario.warnings());
            console.warn(&scenario, &assembly.summary.warnings);
        }
        let answers = find(arguments, assembly, &meter).map_err(|error| failed(&scenario, error));
        meter.finish();
        answers
    })?;
    console.print(&if arguments.json { json(&answers) } else { table(&answers) })
}

/// A failure with its position in the scenario.
pub(super) fn failed(scenario: &Scenario, error: StaticsError) -> Failure {
    let problem = |key: &str, help: &str| {
        Failure::Scenario(scenario.problem(ProblemKind::Conflict, key, error.to_string(), help))
    };
    match error {
        StaticsError::NoLinks => problem("bonds", "add [bonds] with a law and an interaction ratio"),
        StaticsError::NoCell => problem(
            "packing",
            "elastic constants need a periodic packing; write kind = \"periodic\" under [packing.shape]",
        ),
        other => Failure::Statics(other),
    }
}

fn find(arguments: &ElasticArguments, assembly: Assembly, meter: &Meter) -> Result<Results, StaticsError> {
    let Assembly { state, model, .. } = assembly;
    let network = LinkNetwork::of_model(&state, &model)?;
    let accuracy = Accuracy { residual: arguments.residual, ..Accuracy::default() };
    meter.stage("statics", 0.0);
    let start = Instant::now();
    let cell = cell_stiffness_and_derivatives(&network, accuracy)?;
    let time = start.elapsed().as_secs_f64();
    let constants = cell.constants()?;
    let (normal, shear) = network.moduli_sums();
    let volume = network.volume.ok_or(StaticsError::NoCell)?;
    let (stiffness_sum, shear_ratio) = (normal / (3.0 * volume), shear / normal);
    let dynamics = if arguments.no_dynamics {
        None
    } else {
        meter.stage("dynamics", 0.0);
        let (stiffness, steps) = relaxed_stiffness(&state, &model, Relaxation::default())?;
        Some((cell.constants_of(&stiffness)?, steps))
    };
    Ok(Results {
        closed: closed_form(&network),
        affine: cell.affine_constants()?,
        network: constants,
        dynamics,
        stiffness_sum,
        shear_ratio,
        particles: state.particles.len(),
        deformable: !network.compliance.is_empty(),
        time,
        cell,
    })
}

/// Asymmetry of a stiffness that is an error of the solution: the residual of the iteration is 1e-11.
const SYMMETRIC: f64 = 1e-8;

/// Unit of moduli in a table and the factor from Pa, such that six decimals show at least six digits of `modulus` (Pa).
fn unit_of(modulus: f64) -> (&'static str, f64) {
    match modulus.abs() {
        size if size >= 1e8 => ("GPa", 1e-9),
        size if size >= 1e5 => ("MPa", 1e-6),
        size if size >= 1e2 => ("kPa", 1e-3),
        _ => ("Pa", 1.0),
    }
}

fn table(answers: &Results) -> String {
    let Results { cell, network, .. } = answers;
    let (unit, scale) = unit_of(network.mean_young);
    let mut text = format!(
        "{} particles, {} links ({:.2} per particle); Σk_N L²/3V = {:.6e} Pa, k_T/k_N = {:.6}\n",
        answers.particles,
        cell.links,
        2.0 * cell.links as f64 / answers.particles as f64,
        answers.stiffness_sum,
        answers.shear_ratio,
    );
    if cell.loose.rattlers + cell.loose.mechanisms > 0 {
        let _ = writeln!(
            text,
            "{} rattlers (carry no force, excluded); {} mechanisms (motions of single particles that strain no link)",
            cell.loose.rattlers, cell.loose.mechanisms
        );
    }
    let _ = writeln!(
        text,
        "\n  {:<36}{:>13}{:>11}{:>13}{:>13}{:>11}",
        "",
        format!("E, {unit}"),
        "ν",
        format!("K, {unit}"),
        format!("G, {unit}"),
        "E − net"
    );
    let mut row = |name: &str, e: f64, nu: f64, k: f64, g: f64| {
        let gap = 100.0 * (e / network.mean_young - 1.0);
        let (e, k, g) = (e * scale, k * scale, g * scale);
        let _ = writeln!(text, "  {name:<36}{e:>13.6}{nu:>11.6}{k:>13.6}{g:>13.6}{gap:>+10.3}%");
    };
    if let Some(c) = answers.closed {
        let name = if answers.deformable { "closed form, mean field" } else { "closed form, isotropic" };
        row(name, c.young, c.poisson, c.bulk, c.shear);
    }
    let mut of = |name: &str, c: &ElasticConstants| row(name, c.mean_young, c.mean_poisson, c.bulk, c.mean_shear);
    of("affine sum over the links", &answers.affine);
    of("static network, particles free", network);
    if let Some((dynamics, _)) = &answers.dynamics {
        of("relaxed dynamics", dynamics);
    }
    let a = network.anisotropy();
    let n = network.dimension;
    let _ = write!(
        text,
        "\nAnisotropy of the network: ΔE/E {:.4}, Δν {:.4}, ΔG/G {:.4}, coupling/E {:.4}\n\
         Directions {}: E {} {unit}; {} {} {unit}\n",
        a.young,
        a.poisson,
        a.shear,
        a.coupling,
        if n == 2 { "1, 2" } else { "1, 2, 3" },
        list(&network.young[..n], scale),
        if n == 2 { "G12" } else { "G23, G31, G12" },
        list(if n == 2 { &network.shear[2..] } else { &network.shear }, scale),
    );
    if network.asymmetry > SYMMETRIC {
        let _ = writeln!(
            text,
            "The stiffness is not symmetric: D_ij and D_ji differ by up to {:.2e} of the largest entry; the constants are those of its \
             symmetric part",
            network.asymmetry
        );
    }
    if let Some(derivatives) = &cell.derivatives {
        text += &sensitivities(answers, derivatives);
    }
    text += &stiffness(network, unit, scale);
    let _ = writeln!(text, "\nStatic solution: at most {} iterations, {:.2} s", cell.iterations, answers.time);
    if let Some((_, steps)) = &answers.dynamics {
        let _ = writeln!(text, "Relaxed dynamics: at most {steps} steps");
    }
    text
}

/// The matrix of the stiffness.
fn stiffness(network: &ElasticConstants, unit: &str, scale: f64) -> String {
    let (places, names): (&[usize], _) = if network.dimension == 2 {
        (&[0, 1, 5], "11, 22, 12")
    } else {
        (&[0, 1, 2, 3, 4, 5], "11, 22, 33, 23, 31, 12")
    };
    let mut text = format!("\nStiffness of the network, {unit} ({names}; engineering shear strains)\n");
    for &i in places {
        text += " ";
        for &j in places {
            let _ = write!(text, "{:>13.6}", network.stiffness[(i, j)] * scale);
        }
        text += "\n";
    }
    text
}

/// Changes of E and ν with stiffnesses and moduli.
fn sensitivities(answers: &Results, derivatives: &Derivatives) -> String {
    let network = &answers.network;
    let mut text =
        "\nSensitivities of the network (exact): change per relative change of a stiffness or modulus\n".to_owned();
    for (name, change) in by_logarithm(derivatives) {
        if change.abs().max() > 0.0 {
            let (e, nu) = network.derivatives(change);
            let _ = writeln!(text, "  {name:<15} dE/E {:>+10.6}   dν {nu:>+10.6}", e / network.mean_young);
        }
    }
    if answers.deformable {
        let (e, nu) = network.derivatives(&derivatives.particle_poisson);
        let e = e / network.mean_young;
        let _ = writeln!(text, "  {:<15} dE/E {e:>+10.6}   dν {nu:>+10.6}   per unit of it", "particles' ν");
    }
    text
}

/// Logarithmic derivatives with their names.
fn by_logarithm(derivatives: &Derivatives) -> [(&'static str, &Matrix6<f64>); 5] {
    let [normal, shear, bending, twist] = &derivatives.links;
    let particles = &derivatives.particle_young;
    [("normal", normal), ("shear", shear), ("bending", bending), ("twist", twist), ("particles' E", particles)]
}

fn list(values: &[f64], scale: f64) -> String {
    values.iter().map(|value| format!("{:.6}", value * scale)).collect::<Vec<_>>().join(", ")
}

fn json(answers: &Results) -> String {
    let matrix =
        |m: &Matrix6<f64>| -> Vec<Vec<f64>> { m.row_iter().map(|row| row.iter().copied().collect()).collect() };
    let constants = |c: &ElasticConstants| {
        serde_json::json!({
            "dimension": c.dimension, "young_pa": c.mean_young, "poisson": c.mean_poisson, "bulk_pa": c.bulk, "shear_pa": c.mean_shear,
            "young_by_direction_pa": c.young, "shear_23_31_12_pa": c.shear, "poisson_by_directions": c.poisson,
            "stiffness_pa": matrix(&c.stiffness), "asymmetry": c.asymmetry, "compliance_per_pa": matrix(&c.compliance),
            "anisotropy": c.anisotropy(),
        })
    };
    let of = |change: &Matrix6<f64>| {
        let (e, nu) = answers.network.derivatives(change);
        serde_json::json!({ "young_pa": e, "poisson": nu })
    };
    let derivatives = answers.cell.derivatives.as_ref().map(|derivatives| {
        let [normal, shear, bending, twist] = &derivatives.links;
        let mut all = serde_json::json!({
            "normal": of(normal), "shear": of(shear), "bending": of(bending), "twist": of(twist),
        });
        if answers.deformable {
            all["particle_young"] = of(&derivatives.particle_young);
        }
        all
    });
    let by_poisson = answers.cell.derivatives.as_ref().filter(|_| answers.deformable);
    let by_poisson = by_poisson.map(|derivatives| of(&derivatives.particle_poisson));
    let value = serde_json::json!({
        "particles": answers.particles,
        "links": answers.cell.links,
        "rattlers": answers.cell.loose.rattlers,
        "mechanisms": answers.cell.loose.mechanisms,
        "stiffness_sum_pa": answers.stiffness_sum,
        "shear_ratio": answers.shear_ratio,
        "iterations": answers.cell.iterations,
        "static_seconds": answers.time,
        "closed_form": answers.closed.map(|c| {
            serde_json::json!({ "young_pa": c.young, "poisson": c.poisson, "bulk_pa": c.bulk, "shear_pa": c.shear })
        }),
        "affine": constants(&answers.affine),
        "static": constants(&answers.network),
        "static_derivatives_by_log_stiffness": derivatives,
        "static_derivatives_by_particle_poisson": by_poisson,
        "relaxed_dynamics": answers.dynamics.as_ref().map(|(c, _)| constants(c)),
    });
    format!("{value:#}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moduli_of_soft_materials_keep_their_digits() {
        let shown = |modulus: f64| {
            let (unit, scale) = unit_of(modulus);
            format!("{:.6} {unit}", modulus * scale)
        };
        assert_eq!(shown(27.03e9), "27.030000 GPa");
        assert_eq!(shown(2.5e6), "2.500000 MPa");
        assert_eq!(shown(1234.5), "1.234500 kPa");
        assert_eq!(shown(0.4), "0.400000 Pa");
    }
}
