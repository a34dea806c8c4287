//! Which part of a test the records of a result cover.

/// Which part of a test the records of a result cover.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Coverage {
    /// All of it, also the runs that this one continues.
    Whole,
    /// The present loading; the specimen was loaded in another way before.
    OtherLoading,
    /// A part: the run continues a state without records.
    Unknown,
}

impl Coverage {
    /// Name of the provenance entry of continued runs.
    pub(crate) const ENTRY: &str = "records";

    /// The coverage of a result, by its provenance.
    pub(crate) fn of(provenance: &[(String, String)]) -> Self {
        let text = provenance.iter().find(|(name, _)| name == Self::ENTRY).map_or("", |(_, text)| text);
        [Self::OtherLoading, Self::Unknown].into_iter().find(|one| one.to_string() == text).unwrap_or(Self::Whole)
    }

    /// What a reader of strengths and moduli must know.
    pub(super) fn note(self) -> Option<String> {
        (self != Self::Whole).then(|| self.to_string())
    }
}

impl std::fmt::Display for Coverage {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::Whole => "of the whole test, also of the runs before",
            Self::OtherLoading => "from this loading on; the specimen was loaded in another way before",
            Self::Unknown => {
                "from the restart on, since a checkpoint has none; moduli, strengths, and energies of the test are not known (continue from a \
                 result for them)"
            }
        })
    }
}
