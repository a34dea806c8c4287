//! Counts what happened, by reason.

use std::collections::BTreeMap;
use std::fmt::{Display, Formatter, Result};

use crate::case::{Case, Shape};
use crate::oracles::{Finding, Verdict};

/// What happened to all scenarios.
#[derive(Default)]
pub struct Report {
    ran: u64,
    chaotic: u64,
    refused: BTreeMap<String, u64>,
    /// Errors that ended runs: number of the scenario, its features, and the message.
    ended: BTreeMap<String, Vec<(u64, String)>>,
    /// Findings by oracle: number of the scenario, its features, and the detail.
    findings: BTreeMap<&'static str, Vec<(u64, String)>>,
}

impl Report {
    /// Adds the verdict on scenario `number`.
    pub fn add(&mut self, number: u64, case: &Case, verdict: &Verdict, findings: Vec<Finding>) {
        match verdict {
            Verdict::Refused(message) => *self.refused.entry(reason(message)).or_default() += 1,
            Verdict::Ended(message) => {
                let detail = format!("{}\n      {message}", features(case));
                self.ended.entry(reason(message)).or_default().push((number, detail));
            }
            Verdict::Ran { chaotic } => {
                self.ran += 1;
                self.chaotic += u64::from(*chaotic);
            }
        }
        for Finding { oracle, detail } in findings {
            self.findings.entry(oracle).or_default().push((number, format!("{}\n      {detail}", features(case))));
        }
    }

    /// The counts as JSON, with the commit and the machine.
    pub fn json(&self, seed: u64, minutes: f64) -> String {
        let refused: u64 = self.refused.values().sum();
        let ended: usize = self.ended.values().map(Vec::len).sum();
        let output = |program: &str, arguments: &[&str]| {
            let output = std::process::Command::new(program).args(arguments).output().ok();
            output.map_or_else(String::new, |o| String::from_utf8_lossy(&o.stdout).trim().to_owned())
        };
        let processors = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let processor = processors.lines().find_map(|line| line.strip_prefix("model name")?.split(": ").nth(1));
        let result = serde_json::json!({
            "commit": output("git", &["rev-parse", "--short", "HEAD"]),
            "date": output("date", &["+%F"]),
            "machine": {
                "processor": processor,
                "cores": std::thread::available_parallelism().map_or(1, usize::from),
                "system": std::env::consts::OS,
            },
            "minutes": (minutes * 10.0).round() / 10.0,
            "seed": seed,
            "scenarios": self.ran + refused + ended as u64,
            "ran": self.ran,
            "ran_too_sensitive_to_compare": self.chaotic,
            "refused": refused,
            "ended_by_an_error": ended,
            "failed": self.failed(),
            "refused_by_reason": self.refused,
            "ended_by_reason": self.ended.iter().map(|(k, all)| (k, all.len())).collect::<BTreeMap<_, _>>(),
            "failed_by_oracle": self.findings.iter().map(|(k, all)| (k, all.len())).collect::<BTreeMap<_, _>>(),
        });
        format!("{result:#}\n")
    }

    /// Whether every scenario passed.
    pub fn passed(&self) -> bool {
        self.findings.is_empty()
    }

    /// Number of scenarios with findings.
    pub fn failed(&self) -> usize {
        let mut numbers: Vec<u64> = self.findings.values().flatten().map(|(number, _)| *number).collect();
        numbers.sort_unstable();
        numbers.dedup();
        numbers.len()
    }
}

impl Display for Report {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        writeln!(f, "{} scenarios ran, {} of them too sensitive to compare twins", self.ran, self.chaotic)?;
        writeln!(f, "{} refused:", self.refused.values().sum::<u64>())?;
        for (reason, count) in &self.refused {
            writeln!(f, "  {count:5} {reason}")?;
        }
        writeln!(f, "{} ended by an error:", self.ended.values().map(Vec::len).sum::<usize>())?;
        for (reason, all) in &self.ended {
            writeln!(f, "  {:5} {reason}", all.len())?;
            examples(f, all, 4)?;
        }
        for (oracle, all) in &self.findings {
            writeln!(f, "{} scenarios fail: {oracle}", all.len())?;
            examples(f, all, 12)?;
        }
        Ok(())
    }
}

/// The first of some scenarios.
fn examples(f: &mut Formatter<'_>, all: &[(u64, String)], most: usize) -> Result {
    let mut all: Vec<_> = all.iter().collect();
    all.sort();
    for (number, detail) in all.into_iter().take(most) {
        writeln!(f, "    {number}: {detail}")?;
    }
    Ok(())
}

/// A message without its numbers, shortened.
fn reason(message: &str) -> String {
    let mut text = String::new();
    for word in message.split_whitespace().take(40) {
        let number = word.chars().any(|c| c.is_ascii_digit());
        text += if number { "#" } else { word };
        text.push(' ');
    }
    text.chars().take(110).collect()
}

/// The features of a scenario on one line.
fn features(case: &Case) -> String {
    let loading = format!("{:?}", case.loading);
    let loading = loading.split(['(', ' ']).next().unwrap_or_default().to_owned();
    let mut text = format!(
        "{}D {} n={} {}+{} {} {}",
        case.dimension,
        case.kinematics,
        case.spheres.len(),
        case.bonds.map_or("none", |bonds| bonds.0),
        case.contacts,
        case.scheme,
        case.damping.split('"').nth(1).unwrap_or_default()
    );
    for (has, word) in [
        (case.cell.is_some(), "cell"),
        (loading != "None", loading.as_str()),
        (!case.walls.is_empty(), "walls"),
        (case.walls.iter().any(|wall| matches!(wall.shape, Shape::Plate(..) | Shape::Disc(..))), "plate"),
        (case.membrane.is_some(), "membrane"),
        (!case.slaves.is_empty(), "slaves"),
        (!case.clumps.is_empty(), "clump"),
        (case.materials.contains("deformable"), "deformable"),
        (case.materials.contains("yade-public"), "yade-public"),
        (case.materials.contains("woo"), "woo"),
    ] {
        if has {
            text.push(' ');
            text += word;
        }
    }
    text
}
