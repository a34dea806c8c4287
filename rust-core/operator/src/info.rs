//! Name, unit, and equation of an operator, for lists and documentation.

/// What an operator computes; each operator's file has constants of this type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OperatorInfo {
    /// Name, as in scenarios and result files.
    pub name: &'static str,
    /// SI unit of the main result.
    pub unit: &'static str,
    /// Equation of the main result, in the notation of the crate's documentation.
    pub equation: &'static str,
    /// Source of the equation.
    pub source: &'static str,
}
