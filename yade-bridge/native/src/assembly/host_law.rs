//! What the take-over needs of a law of the host.

use concordem_solver::forces::LawLoops;

/// A law of the host, whose histories have all that it keeps of a contact.
pub trait HostLaw: LawLoops {
    /// Attributes of a material.
    type Material: Copy;
    /// What holds for all contacts.
    type Rules: Copy;

    /// The law between two materials.
    fn of(materials: [Self::Material; 2], rules: Self::Rules) -> Self;

    /// Whether a history can be that of a contact.
    fn is_valid(state: &Self::State) -> bool;

    /// Whether the contact has cohesion.
    fn is_bond(state: &Self::State) -> bool;
}
