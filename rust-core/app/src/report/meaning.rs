//! What the slope and the largest stress of a curve are, by the kind of loading: Young's modulus and a strength only where the sides are
//! free.

use concordem_scenario::schema::quantity::{Component, CrossSection};
use concordem_scenario::schema::{Loading, Scenario};

/// What strain and stress of a run are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Meaning {
    /// Along a specimen with free sides whose ends are held by layers of particles.
    Layers,
    /// Along a specimen with free sides between plates.
    Plates,
    /// Along a periodic cell whose other axes have no stress.
    FreeCell,
    /// Along a specimen that a membrane or walls enclose.
    Enclosed,
    /// Along a cell or a specimen whose other axes keep their length.
    Oedometric,
    /// Along a periodic cell whose other axes keep a stress.
    LateralStress,
    /// Shear of a periodic cell.
    Shear,
    /// In the outer fiber of a bent beam.
    Bending,
    /// Nominal ones of a bent beam with a notch or another cut.
    CutBeam,
    /// At the surface of a twisted cylinder.
    Torsion,
    /// In the middle of a cylinder that splits.
    Splitting,
    /// Of another path of a periodic cell, or without loading.
    Other,
}

/// Symbol (HTML) and name of a quantity.
pub(super) type Named = (&'static str, &'static str);

/// One result of a test: symbol and name (HTML), unit, and value in this unit.
pub(super) type Measured = (&'static str, String, &'static str, f64);

impl Meaning {
    /// The meaning of the curve of a scenario.
    pub(super) fn of(scenario: &Scenario) -> Self {
        match &scenario.loading {
            Loading::Platens { area: Some(CrossSection::Splitting), .. } => Self::Splitting,
            Loading::Uniaxial { .. } | Loading::Platens { .. } if scenario.is_enclosed() => Self::Enclosed,
            Loading::Uniaxial { .. } => Self::Layers,
            Loading::Platens { .. } => Self::Plates,
            Loading::Flexure { .. } | Loading::Bending { .. } if !scenario.cuts.is_empty() => Self::CutBeam,
            Loading::Flexure { .. } | Loading::Bending { .. } => Self::Bending,
            Loading::Torsion { .. } => Self::Torsion,
            Loading::CellStrain { velocity_gradient } => {
                let moving = |(i, j): &(usize, usize)| velocity_gradient[*i][*j].si() != 0.0;
                let all = (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
                match all.filter(moving).collect::<Vec<_>>()[..] {
                    [(i, j)] if i == j => Self::Oedometric,
                    [(_, _)] => Self::Shear,
                    _ => Self::Other,
                }
            }
            Loading::CellStress { stress, strain_rate, .. } => {
                let driven = |axis: &usize| strain_rate[*axis] != Component::Free;
                let moving: Vec<usize> = (0..3).filter(driven).collect();
                let stressed = (0..3).any(|i| (0..3).any(|j| (i != j || !driven(&i)) && stress[i][j].si() != 0.0));
                match (moving.len(), stressed) {
                    (1, false) => Self::FreeCell,
                    (1, true) => Self::LateralStress,
                    _ => Self::Other,
                }
            }
            Loading::None => Self::Other,
        }
    }

    /// Whether slope and largest stress are Young's modulus and a strength of the material.
    pub(super) fn is_uniaxial_stress(self) -> bool {
        matches!(self, Self::Layers | Self::Plates | Self::FreeCell)
    }

    /// What the strain is: that of a split cylinder is the approach of the plates, that of a beam with a notch a nominal one.
    pub(super) fn strain(self) -> &'static str {
        match self {
            Self::Splitting => "approach of the plates over their distance",
            Self::CutBeam => "nominal strain",
            _ => "strain",
        }
    }

    /// The slope at the beginning of the curve; `None` where the curve has no modulus.
    pub(super) fn slope(self) -> Option<Named> {
        Some(match self {
            Self::Layers | Self::Plates => ("E", "Young’s modulus, from the strain between the ends"),
            Self::FreeCell => ("E", "Young’s modulus"),
            Self::Enclosed => ("dσ/dε", "slope of the enclosed specimen, no Young’s modulus"),
            Self::Oedometric => ("M", "oedometric modulus: the other axes keep their length"),
            Self::LateralStress => ("dσ/dε", "slope beside a lateral stress"),
            Self::Shear => ("G", "shear modulus"),
            Self::Bending => ("E<sub>b</sub>", "modulus in bending, by the formulas of an elastic beam"),
            Self::Torsion => ("G", "shear modulus in torsion"),
            Self::Other => ("dσ/dε", "slope"),
            // The formulas of an elastic beam do not hold beside a notch.
            Self::CutBeam | Self::Splitting => return None,
        })
    }

    /// The stress of largest magnitude; `tension`: whether it is positive.
    pub(super) fn largest(self, tension: bool) -> Named {
        match (self, tension) {
            (Self::Layers | Self::Plates | Self::FreeCell, true) => ("f<sub>t</sub>", "tensile strength"),
            (Self::Layers | Self::Plates | Self::FreeCell, false) => ("f<sub>c</sub>", "compressive strength"),
            (Self::Enclosed, _) => ("σ<sub>max</sub>", "largest axial stress of the enclosed specimen"),
            (Self::Oedometric, _) => ("σ<sub>max</sub>", "largest axial stress, the other axes keep their length"),
            (Self::LateralStress, _) => ("σ<sub>max</sub>", "largest axial stress beside the lateral stress"),
            (Self::Shear | Self::Torsion, _) => ("τ<sub>max</sub>", "largest shear stress"),
            (Self::Bending | Self::CutBeam, _) => ("f<sub>fl</sub>", "largest nominal stress in the outer fiber"),
            (Self::Splitting, _) => ("f<sub>st</sub>", "splitting strength"),
            (Self::Other, _) => ("σ<sub>max</sub>", "largest stress"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use concordem_scenario::schema::template;

    fn meaning(name: &str, change: (&str, &str)) -> Meaning {
        let text = template(name).unwrap().text;
        let changed = text.replacen(change.0, change.1, 1);
        assert!(change.0.is_empty() || changed != text, "{change:?}");
        Meaning::of(&Scenario::parse("test.toml", &changed).unwrap_or_else(|error| panic!("{error}")))
    }

    /// Every kind of loading has its names.
    #[test]
    fn names_follow_the_kind_of_loading() {
        let none = ("", "");
        let membrane = ("[loading]", "[[membrane]]\npressure = \"1 MPa\"\nopen_along = \"z\"\n[loading]");
        for (name, change, slope, largest) in [
            ("cpm-small", none, "E", "f<sub>c</sub>"),
            ("cpm-small", membrane, "dσ/dε", "σ<sub>max</sub>"),
            ("cpm-periodic", none, "M", "σ<sub>max</sub>"),
            ("cpm-periodic", ("[0, 0, 0.4],", "[0, 0.4, 0],"), "G", "τ<sub>max</sub>"),
            ("cpm-periodic", ("    [0, 0, 0],", "    [0.1, 0, 0],"), "dσ/dε", "σ<sub>max</sub>"),
            ("concrete-triaxial", none, "dσ/dε", "σ<sub>max</sub>"),
            ("beam-torsion", none, "G", "τ<sub>max</sub>"),
            ("beam-bending", none, "E<sub>b</sub>", "f<sub>fl</sub>"),
            ("granular-box", none, "dσ/dε", "σ<sub>max</sub>"),
        ] {
            let meaning = meaning(name, change);
            assert_eq!(meaning.slope().map(|(symbol, _)| symbol), Some(slope), "{name} {change:?}");
            assert_eq!(meaning.largest(false).0, largest, "{name} {change:?}");
        }
        assert_eq!(meaning("concrete-splitting", none).slope(), None);
        // Without the cut of the template the formulas of an elastic beam hold.
        let beam = template("concrete-bending").unwrap().text;
        let from = beam.find("\n[[cut]]").unwrap();
        let whole = format!("{}{}", &beam[..from], &beam[from + beam[from..].find("[integration]").unwrap()..]);
        let of =
            |text: &str| Meaning::of(&Scenario::parse("test.toml", text).unwrap_or_else(|error| panic!("{error}")));
        assert_eq!((of(beam), of(beam).slope()), (Meaning::CutBeam, None));
        assert_eq!(of(&whole).slope().map(|(symbol, _)| symbol), Some("E<sub>b</sub>"));
        let free = (
            "stress = [[\"-5 MPa\", 0, 0], [0, \"-5 MPa\", 0], [0, 0, \"-5 MPa\"]]",
            "stress = [[0, 0, 0], [0, 0, 0], [0, 0, \"-5 MPa\"]]",
        );
        assert_eq!(meaning("concrete-triaxial", free), Meaning::FreeCell);
    }
}
