//! The list of laws.

/// Calls a macro with all laws, as `name: Type`: the type `Type` of the file `name.rs`, which scenarios and hosts call `name`. To
/// register a law, add a line.
///
/// ```
/// macro_rules! names {
///     ($($key:ident: $Law:ident,)*) => { [$(stringify!($key)),*] };
/// }
/// let names = concordem_contact::for_each_law!(names);
/// assert_eq!(names[0], "cpm");
/// ```
#[macro_export]
macro_rules! for_each_law {
    ($($callback:tt)+) => {
        $($callback)+! {
            cpm: Cpm,
            linear_bond: LinearBond,
            cohesive_beam: CohesiveBeam,
            damped_beam: DampedBeam,
            softening_beam: SofteningBeam,
            jointed: Jointed,
            frictional: Frictional,
            hertz_mindlin: HertzMindlin,
        }
    };
}
