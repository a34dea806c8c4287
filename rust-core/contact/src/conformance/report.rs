//! Findings of the suite and their report.

use std::fmt;

/// One measured value and its bound.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Name of the check.
    pub check: String,
    /// Measured value.
    pub measured: f64,
    /// Bound of the value.
    pub bound: Bound,
    /// Reason for the bound.
    pub reason: &'static str,
}

/// Bound of a [`Finding`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// At most.
    AtMost(f64),
    /// At least.
    AtLeast(f64),
}

impl Finding {
    pub(super) fn at_most(check: impl Into<String>, measured: f64, bound: f64, reason: &'static str) -> Self {
        Self { check: check.into(), measured, bound: Bound::AtMost(bound), reason }
    }

    pub(super) fn at_least(check: impl Into<String>, measured: f64, bound: f64, reason: &'static str) -> Self {
        Self { check: check.into(), measured, bound: Bound::AtLeast(bound), reason }
    }

    /// Whether the bound holds. NaN passes no bound.
    pub fn passed(&self) -> bool {
        match self.bound {
            Bound::AtMost(bound) => self.measured <= bound,
            Bound::AtLeast(bound) => self.measured >= bound,
        }
    }
}

/// All findings of a subject.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// Name of the subject.
    pub subject: String,
    /// The findings, in the order of the checks.
    pub findings: Vec<Finding>,
}

impl Report {
    /// Whether every bound holds.
    pub fn passed(&self) -> bool {
        self.findings.iter().all(Finding::passed)
    }

    /// The findings that fail.
    pub fn failures(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|finding| !finding.passed())
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "conformance of {}", self.subject)?;
        for finding in &self.findings {
            let verdict = if finding.passed() { "ok  " } else { "FAIL" };
            let (sign, bound) = match finding.bound {
                Bound::AtMost(bound) => ("<=", bound),
                Bound::AtLeast(bound) => (">=", bound),
            };
            writeln!(
                f,
                "{verdict} {:<66} {:>10.2e} {sign} {bound:<8.2e} {}",
                finding.check, finding.measured, finding.reason
            )?;
        }
        Ok(())
    }
}
