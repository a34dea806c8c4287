//! Counts what happened, by reason.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::{Display, Formatter, Result};

use concordem_tests::study::{commit, record};

use crate::case::Case;
use crate::features::{self, FEATURES};
use crate::oracles::{Finding, Judgement, ORACLES, Verdict};

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
    /// Scenarios that ran, by feature.
    features: BTreeMap<usize, u64>,
    /// Pairs of features in scenarios that ran.
    pairs: BTreeSet<[usize; 2]>,
    /// Scenarios in which an oracle compared something.
    oracles: BTreeMap<&'static str, u64>,
}

impl Report {
    /// Adds the verdict on scenario `number`.
    pub fn add(&mut self, number: u64, case: &Case, verdict: &Verdict, Judgement { findings, compared }: Judgement) {
        for oracle in compared {
            *self.oracles.entry(oracle).or_default() += 1;
        }
        match verdict {
            Verdict::Refused(message) => *self.refused.entry(reason(message)).or_default() += 1,
            Verdict::Ended(message) => {
                let detail = format!("{}\n      {message}", features::line(case));
                self.ended.entry(reason(message)).or_default().push((number, detail));
            }
            Verdict::Ran { chaotic } => {
                self.ran += 1;
                self.chaotic += u64::from(*chaotic);
                let present = features::of(case);
                for (k, &a) in present.iter().enumerate() {
                    *self.features.entry(a).or_default() += 1;
                    self.pairs.extend(present[k + 1..].iter().map(|&b| [a, b]));
                }
            }
        }
        for Finding { oracle, detail } in findings {
            self.findings
                .entry(oracle)
                .or_default()
                .push((number, format!("{}\n      {detail}", features::line(case))));
        }
    }

    /// The counts as JSON, with the commit and the machine.
    pub fn json(&self, seed: u64, minutes: f64) -> String {
        let refused: u64 = self.refused.values().sum();
        let ended: usize = self.ended.values().map(Vec::len).sum();
        let figures = serde_json::json!({
            "seed": seed,
            "scenarios": self.ran + refused + ended as u64,
            "ran": self.ran,
            "ran_too_sensitive_to_compare": self.chaotic,
            "refused": refused,
            "ended_by_an_error": ended,
            "failed": self.failed(),
            "refused_by_reason": self.refused,
            "ended_by_reason": self.ended.iter().map(|(k, all)| (k, all.len())).collect::<BTreeMap<_, _>>(),
            "features": FEATURES.iter().enumerate().map(|(k, feature)| (feature.name, self.features.get(&k).copied().unwrap_or(0)))
                .collect::<BTreeMap<_, _>>(),
            "pairs_of_features": self.pairs_of_features(),
            "oracles": ORACLES.iter().map(|name| (*name, self.oracles.get(name).copied().unwrap_or(0))).collect::<BTreeMap<_, _>>(),
            "failed_by_oracle": self.findings.iter().map(|(k, all)| (k, all.len())).collect::<BTreeMap<_, _>>(),
        });
        record(&commit(), minutes, figures)
    }

    /// How many pairs of features ran, and those that did not, by the first one.
    fn pairs_of_features(&self) -> serde_json::Value {
        let (mut possible, mut never) = (0, BTreeMap::<&str, Vec<&str>>::new());
        for (a, feature) in FEATURES.iter().enumerate() {
            for b in (a + 1..FEATURES.len()).filter(|&b| features::can_meet(a, b)) {
                possible += 1;
                if !self.pairs.contains(&[a, b]) {
                    never.entry(feature.name).or_default().push(FEATURES[b].name);
                }
            }
        }
        let never: BTreeMap<&str, String> = never.into_iter().map(|(name, others)| (name, others.join(", "))).collect();
        serde_json::json!({ "possible": possible, "ran": self.pairs.len(), "never": never })
    }

    /// Features that were in no scenario that ran, and oracles that never compared anything.
    pub fn never(&self) -> Vec<&'static str> {
        let features = (0..FEATURES.len()).filter(|k| !self.features.contains_key(k)).map(|k| FEATURES[k].name);
        features.chain(ORACLES.iter().copied().filter(|name| !self.oracles.contains_key(name))).collect()
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
        let possible = self.pairs_of_features()["possible"].clone();
        writeln!(
            f,
            "{} of {possible} pairs of features ran; in no scenario that ran: {}",
            self.pairs.len(),
            self.never().join(", ")
        )?;
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
