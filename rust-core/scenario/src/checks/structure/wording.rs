//! Wording of messages: lists, suggestions, and descriptions of keys.

/// Joins alternatives: "a", "a or b", "a, b, or c".
pub(in crate::checks) fn listing(items: &[impl AsRef<str>]) -> String {
    match items {
        [] => String::new(),
        [one] => one.as_ref().to_owned(),
        [one, two] => format!("{} or {}", one.as_ref(), two.as_ref()),
        [front @ .., last] => {
            let front: Vec<&str> = front.iter().map(AsRef::as_ref).collect();
            format!("{}, or {}", front.join(", "), last.as_ref())
        }
    }
}

/// How similar a candidate must be to a word: about two thirds of the letters agree.
pub(super) const SIMILAR: f64 = 0.6;
/// A word that begins the candidate, or has one wrong letter of ten.
pub(super) const VERY_SIMILAR: f64 = 0.9;

/// The candidate most similar to a word, if any is similar enough.
pub(in crate::checks) fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    nearest_of(word, candidates, SIMILAR)
}

/// The candidate most similar to a word, if it is at least so similar.
pub(super) fn nearest_of<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>, least: f64) -> Option<&'a str> {
    let plain = |text: &str| text.to_lowercase().replace('-', "_");
    let word = plain(word);
    let mut best: Option<(f64, &str)> = None;
    for candidate in candidates {
        let other = plain(candidate);
        // A word that begins another one counts as similar; otherwise the letters that agree count. A candidate that
        // begins the word counts less than one with a single wrong letter: `strain_rte` is `strain_rate`, not `strain`.
        let letters = strsim::normalized_damerau_levenshtein(&word, &other);
        let likeness = if !word.is_empty() && other.starts_with(&word) {
            0.9 + 0.1 * letters
        } else if !other.is_empty() && word.starts_with(&other) {
            letters.max(0.7 + 0.2 * letters)
        } else {
            letters
        };
        if likeness >= least && best.is_none_or(|(most, _)| likeness > most) {
            best = Some((likeness, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// Parameter names of YADE's concrete and jointed models, with the corresponding keys of a scenario. A name may have several: a table has
/// one of them.
pub(super) const YADE_NAMES: &[(&str, &str)] = &[
    ("sigmaT", "cohesion"),
    ("epsCrackOnset", "crack_onset_strain"),
    ("relDuctility", "relative_ductility"),
    ("neverDamage", "never_damage"),
    ("equivStrainShearContrib", "shear_contribution"),
    ("damLaw", "damage_law"),
    ("dmgTau", "damage_time"),
    ("dmgRateExp", "damage_rate_exponent"),
    ("plTau", "plasticity_time"),
    ("plRateExp", "plasticity_rate_exponent"),
    ("isoPrestress", "isotropic_prestress"),
    ("frictionAngle", "friction_angle"),
    ("tensileStrength", "tensile_strength"),
    ("residualFrictionAngle", "residual_friction_angle"),
    ("poisson", "shear_ratio"),
    ("poisson", "stiffness_ratio"),
    ("yieldSurfType", "yield_surface"),
    ("yieldLogSpeed", "yield_log_speed"),
    ("omegaThreshold", "omega_threshold"),
    ("epsSoft", "soft_strain"),
    ("relKnSoft", "relative_soft_stiffness"),
    ("intRadius", "interaction_ratio"),
    ("enlargeFactor", "interaction_ratio"),
    ("strainRate", "strain_rate"),
];

/// Joins a table path and a key.
pub(super) fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}

/// The last key of a path, without its index.
pub(super) fn last_key(path: &str) -> &str {
    let last = path.rsplit('.').next().unwrap_or(path);
    last.split('[').next().unwrap_or(last)
}

/// `material[0].cpm` → `material.cpm`, as in a table header.
pub(super) fn strip_indices(path: &str) -> String {
    let mut out = String::new();
    let mut inside = false;
    for c in path.chars() {
        match c {
            '[' => inside = true,
            ']' => inside = false,
            c if !inside => out.push(c),
            _ => {}
        }
    }
    out
}

/// The meaning of a key, to end a help text: the first paragraph of its description.
pub(super) fn about(path: &str, description: &str) -> String {
    let summary = description.split("\n\n").next().unwrap_or_default().replace('\n', " ");
    if summary.is_empty() { String::new() } else { format!("`{}`: {summary}", last_key(path)) }
}
