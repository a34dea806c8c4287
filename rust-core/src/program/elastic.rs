//! `concordem elastic`: Young's modulus and Poisson's ratio of a scenario's packing and bonds, four ways.

use std::fmt::Write as _;
use std::path::PathBuf;

use nalgebra::Matrix6;

use super::drive::{Meter, build};
use super::{Console, Failure, Work};
use crate::assembly::Assembly;
use crate::operator::affine_stiffness::isotropic_moduli;
use crate::scenario::{ProblemKind, Scenario};
use crate::statics::relaxed::{Relaxation, relaxed_stiffness};
use crate::statics::{Accuracy, CellStiffness, ElasticConstants, LinkNetwork, StaticsError, cell_stiffness};

/// Arguments of `concordem elastic`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Scenario file with a periodic packing and bonds; its loading is not used
    scenario: PathBuf,
    /// Leave out the relaxed dynamics, the slowest of the four
    #[arg(long)]
    no_dynamics: bool,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Relative residual at which the static solution stops
    #[arg(long, value_name = "SHARE", default_value_t = Accuracy::default().residual)]
    residual: f64,
    #[command(flatten)]
    work: Work,
}

/// What was found.
struct Answers {
    closed: Option<(f64, f64)>,
    affine: ElasticConstants,
    cell: CellStiffness,
    network: ElasticConstants,
    dynamics: Option<(ElasticConstants, u64)>,
    /// `ΣLA/3V` for cross-sections of the links by Ē, i.e. `Σ k_N L²/3V`, Pa.
    stiffness_sum: f64,
    shear_ratio: f64,
    particles: usize,
}

pub(super) fn elastic(arguments: &Arguments, console: &mut Console<'_>) -> Result<(), Failure> {
    if !(arguments.residual > 0.0 && arguments.residual < 1e-3) {
        let message =
            format!("--residual is {:e}; a share between 0 and 1e-3 is wanted, say 1e-11", arguments.residual);
        return Err(Failure::Usage(message));
    }
    let scenario = Scenario::read(&arguments.scenario)?;
    let visible = console.interactive && !arguments.work.quiet;
    let answers = arguments.work.install(|| {
        let meter = Meter::new(visible);
        let assembly = build(&scenario, &meter)?;
        let answers = find(arguments, assembly, &meter).map_err(|error| failed(&scenario, error));
        meter.finish();
        answers
    })?;
    console.print(&if arguments.json { json(&answers) } else { table(&answers) })
}

/// Why there is no answer, at its place in the scenario.
pub(super) fn failed(scenario: &Scenario, error: StaticsError) -> Failure {
    let problem = |key: &str, help: &str| {
        Failure::Scenario(scenario.problem(ProblemKind::Conflict, key, error.to_string(), help))
    };
    match error {
        StaticsError::NoLinks => problem("bonds", "add [bonds] with a law and an interaction ratio"),
        StaticsError::NoCell => problem(
            "packing",
            "elastic constants are those of a periodic packing: write kind = \"periodic\" under [packing.shape]",
        ),
        other => Failure::Statics(other),
    }
}

fn find(arguments: &Arguments, assembly: Assembly, meter: &Meter) -> Result<Answers, StaticsError> {
    let Assembly { state, model, .. } = assembly;
    let network = LinkNetwork::of_state(&state)?;
    let accuracy = Accuracy { residual: arguments.residual, ..Accuracy::default() };
    meter.stage("statics", 0.0);
    let cell = cell_stiffness(&network, accuracy)?;
    let constants = ElasticConstants::of(&cell.relaxed)?;
    let (normal, shear) = network.moduli_sums();
    let volume = network.volume.ok_or(StaticsError::NoCell)?;
    let (stiffness_sum, shear_ratio) = (normal / (3.0 * volume), shear / normal);
    let point_links = network.links.iter().all(|l| l.stiffness.bending == 0.0 && l.stiffness.twist == 0.0);
    let dynamics = if arguments.no_dynamics {
        None
    } else {
        meter.stage("dynamics", 0.0);
        let (stiffness, steps) = relaxed_stiffness(&state, &model, Relaxation::default())?;
        Some((ElasticConstants::of(&stiffness)?, steps))
    };
    Ok(Answers {
        closed: if point_links { isotropic_moduli(normal, volume, 1.0, shear_ratio).ok() } else { None },
        affine: ElasticConstants::of(&cell.affine)?,
        network: constants,
        dynamics,
        stiffness_sum,
        shear_ratio,
        particles: state.particles.len(),
        cell,
    })
}

fn table(answers: &Answers) -> String {
    let Answers { cell, network, .. } = answers;
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
            "{} rattlers (no force, left out); {} motions of single particles that no link resists",
            cell.loose.rattlers, cell.loose.mechanisms
        );
    }
    let _ =
        writeln!(text, "\n  {:<36}{:>13}{:>11}{:>13}{:>13}{:>11}", "", "E, GPa", "ν", "K, GPa", "G, GPa", "E − net");
    let mut row = |name: &str, e: f64, nu: f64, k: f64, g: f64| {
        let gap = 100.0 * (e / network.mean_young - 1.0);
        let (e, k, g) = (e * 1e-9, k * 1e-9, g * 1e-9);
        let _ = writeln!(text, "  {name:<36}{e:>13.6}{nu:>11.6}{k:>13.6}{g:>13.6}{gap:>+10.3}%");
    };
    if let Some((e, nu)) = answers.closed {
        row("closed form, all directions alike", e, nu, e / (3.0 * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)));
    }
    let mut of = |name: &str, c: &ElasticConstants| row(name, c.mean_young, c.mean_poisson, c.bulk, c.mean_shear);
    of("affine sum over the links", &answers.affine);
    of("static network, particles free", network);
    if let Some((dynamics, _)) = &answers.dynamics {
        of("relaxed dynamics", dynamics);
    }
    let a = network.anisotropy();
    let _ = write!(
        text,
        "\nAnisotropy of the network: ΔE/E {:.4}, Δν {:.4}, ΔG/G {:.4}, coupling/E {:.4}\n\
         Directions 1, 2, 3: E {} GPa; G23, G31, G12 {} GPa\n",
        a.young,
        a.poisson,
        a.shear,
        a.coupling,
        list(&network.young, 1e-9),
        list(&network.shear, 1e-9),
    );
    text += "\nSensitivities of the network (exact): change per relative change of a stiffness\n";
    for (name, share) in ["normal", "shear", "bending", "twist"].iter().zip(&cell.share) {
        if share.abs().max() > 0.0 {
            let (e, nu) = network.derivatives(share);
            let _ = writeln!(text, "  {name:<10} dE/E {:>+10.6}   dν {nu:>+10.6}", e / network.mean_young);
        }
    }
    text += "\nStiffness of the network, GPa (11, 22, 33, 23, 31, 12; engineering shear strains)\n";
    for i in 0..6 {
        text += " ";
        for j in 0..6 {
            let _ = write!(text, "{:>13.6}", network.stiffness[(i, j)] * 1e-9);
        }
        text += "\n";
    }
    let _ = writeln!(text, "\nStatic solution: {} iterations at most", cell.iterations);
    if let Some((_, steps)) = &answers.dynamics {
        let _ = writeln!(text, "Relaxed dynamics: {steps} steps at most");
    }
    text
}

fn list(values: &[f64], scale: f64) -> String {
    values.iter().map(|value| format!("{:.6}", value * scale)).collect::<Vec<_>>().join(", ")
}

fn json(answers: &Answers) -> String {
    let matrix =
        |m: &Matrix6<f64>| -> Vec<Vec<f64>> { m.row_iter().map(|row| row.iter().copied().collect()).collect() };
    let constants = |c: &ElasticConstants| {
        serde_json::json!({
            "young_pa": c.mean_young, "poisson": c.mean_poisson, "bulk_pa": c.bulk, "shear_pa": c.mean_shear,
            "young_by_direction_pa": c.young, "shear_23_31_12_pa": c.shear, "poisson_by_directions": c.poisson,
            "stiffness_pa": matrix(&c.stiffness), "compliance_per_pa": matrix(&c.compliance),
            "anisotropy": c.anisotropy(),
        })
    };
    let derivatives: serde_json::Map<String, serde_json::Value> = ["normal", "shear", "bending", "twist"]
        .iter()
        .zip(&answers.cell.share)
        .map(|(name, share)| {
            let (e, nu) = answers.network.derivatives(share);
            ((*name).to_owned(), serde_json::json!({ "young_pa": e, "poisson": nu }))
        })
        .collect();
    let value = serde_json::json!({
        "particles": answers.particles,
        "links": answers.cell.links,
        "rattlers": answers.cell.loose.rattlers,
        "mechanisms": answers.cell.loose.mechanisms,
        "stiffness_sum_pa": answers.stiffness_sum,
        "shear_ratio": answers.shear_ratio,
        "closed_form": answers.closed.map(|(e, nu)| serde_json::json!({ "young_pa": e, "poisson": nu })),
        "affine": constants(&answers.affine),
        "static": constants(&answers.network),
        "static_derivatives_by_log_stiffness": derivatives,
        "relaxed_dynamics": answers.dynamics.as_ref().map(|(c, _)| constants(c)),
    });
    format!("{value:#}\n")
}
