"""Parameters of concrete: of contacts whose values a script has set after YADE had made them, and values that mean no value in YADE."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._scene import Ints, Reals

#: Parameters of a contact that YADE takes from its materials, in the order of the solver, with their types in memory.
STORED = {
    **dict.fromkeys(("E", "G", "tanFrictionAngle", "undamagedCohesion", "epsCrackOnset", "epsFracture"), "f64"),
    **{"equivStrainShearContrib": "f64", "isoPrestress": "f64", "damLaw": "i32", "neverDamage": "u8"},
}
_AT = {name: k for k, name in enumerate(STORED)}
#: The ratio of strains that stands for `relDuctility = 0`. Beyond the onset, both make the damage 1, to the bit.
_BRITTLE = 1e-300


def defined(row: dict[str, Any]) -> dict[str, Any]:
    """Parameters of a pair of materials with numbers for what YADE leaves undefined, and the same forces."""
    found = dict(row)
    if math.isnan(found["cohesion"]):
        # YADE's largest shear stress then is 0, whatever the friction.
        found["cohesion"] = found["friction_angle"] = 0.0
    if found["relative_ductility"] == 0 and found["damage_law"] == "exponential":
        found["relative_ductility"] = _BRITTLE
    if found["never_damage"] and not (found["crack_onset_strain"] > 0 and found["relative_ductility"] > 0):
        found["crack_onset_strain"], found["relative_ductility"] = 1.0, 2.0
    return found


def _defined_columns(stored: Reals) -> Reals:
    """As :func:`defined`, of what contacts have stored."""
    found = stored.copy()
    onset, fracture = found[:, _AT["epsCrackOnset"]], found[:, _AT["epsFracture"]]
    without = np.isnan(found[:, _AT["undamagedCohesion"]])
    found[without, _AT["undamagedCohesion"]] = found[without, _AT["tanFrictionAngle"]] = 0.0
    brittle = (fracture == 0) & (found[:, _AT["damLaw"]] == 1)
    fracture[brittle] = onset[brittle] * _BRITTLE
    unused = (found[:, _AT["neverDamage"]] != 0) & ~((onset > 0) & (fracture > 0))
    onset[unused], fracture[unused] = 1.0, 2.0
    return found


def _of_materials(row: dict[str, Any]) -> list[float]:
    """What YADE stores in a contact of materials with these parameters."""
    onset = row["crack_onset_strain"]
    friction = math.tan(row["friction_angle"])
    return [
        *(row["young"], row["young"] * row["shear_ratio"], friction, row["cohesion"], onset, onset * row["relative_ductility"]),
        *(row["shear_contribution"], row["isotropic_prestress"], float(row["damage_law"] == "exponential"), float(row["never_damage"])),
    ]


class Own(NamedTuple):
    """Contacts with parameters of their own."""

    laws: list[dict[str, Any]]
    """Parameters, without repetitions."""
    row: NDArray[np.uint32]
    """For each contact one more than its place in `laws`, or 0 for the parameters of its materials."""
    stored: Reals
    """What the contacts have stored, with numbers for what is undefined."""
    one: Ints
    """First bodies of the contacts that have their own."""
    two: Ints
    """Second bodies of these."""
    values: Reals
    """What these have stored."""

    def kind(self) -> dict[str, Any]:
        """What a bonded engine saves of it."""
        if not self.laws:
            return {"own": [], "own_pairs": []}
        rows = np.column_stack([self.one, self.two, self.values])
        return {"own": self.laws, "own_pairs": rows.tolist()}


def own_of(stored: Reals, laws: list[tuple[int, int, dict[str, Any]]], materials: Any, bonded: Any, ids: Any) -> Own:
    """Which of the bonds differ from their materials. `stored`: of each contact; `laws`: of each pair of materials; `materials`, `ids`: (n, 2)."""
    raw, stored = stored, _defined_columns(stored)
    wanted = np.zeros_like(stored)
    for i, j, row in laws:
        low, high = materials.min(axis=1), materials.max(axis=1)
        wanted[(low == i) & (high == j)] = _of_materials(row)
    # The solver's rule, which allows for the rounding of a few operations.
    same = (np.abs(stored - wanted) <= 1e-12 * np.abs(wanted)) | (stored.view(np.uint64) == wanted.view(np.uint64))
    # There are two damage laws; another number is refused.
    known = np.isin(stored[:, _AT["damLaw"]], (0, 1))
    own = np.flatnonzero(~same.all(axis=1) & np.asarray(bonded, bool) & known)
    number = np.zeros(len(stored), np.uint32)
    made: list[dict[str, Any]] = []
    if len(own):
        distinct, row_of = np.unique(stored[own], axis=0, return_inverse=True)
        number[own] = row_of.reshape(-1) + 1
        settings = {name: laws[0][2][name] for name in ("mode", "omega_threshold", "soft_strain", "relative_soft_stiffness")}
        made = [{**settings, **_law_of(values)} for values in distinct.tolist()]
    return Own(made, number, stored, ids[own, 0], ids[own, 1], raw[own])


def damage(stored: Reals, kappa: Reals) -> Reals:
    """Damage of bonds with these values (Law2_ScGeom_CpmPhys_Cpm): YADE's law computes it anew in each step, so that a changed onset acts at once."""
    onset, fracture = stored[:, _AT["epsCrackOnset"]], stored[:, _AT["epsFracture"]]
    with np.errstate(all="ignore"):
        linear = (1.0 - onset / kappa) / (1.0 - onset / fracture)
        exponential = 1.0 - onset / kappa * np.exp(-(kappa - onset) / fracture)
    found = np.where(stored[:, _AT["damLaw"]] == 0, linear, exponential)
    return np.where((kappa < onset) | (stored[:, _AT["neverDamage"]] != 0), 0.0, found)


def _law_of(values: list[float]) -> dict[str, Any]:
    """The parameters that a contact with these stored values has."""
    young, shear, friction, cohesion, onset, fracture, contribution, prestress, law, never = values
    return {
        "young": young,
        "shear_ratio": shear / young if young else math.nan,
        "cohesion": cohesion,
        "friction_coefficient": friction,
        "crack_onset_strain": onset,
        "relative_ductility": fracture / onset if onset else math.nan,
        "damage_law": "linear" if law == 0 else "exponential",
        "never_damage": bool(never),
        "shear_contribution": contribution,
        "isotropic_prestress": prestress,
    }


def rows_of_pairs(kind: dict[str, Any], one: Any, two: Any) -> tuple[NDArray[np.int64], Reals]:
    """Which of these pairs of bodies have parameters of their own, and those, a column per name of `STORED`. `kind`: see :meth:`Own.kind`."""
    pairs = np.array(kind.get("own_pairs") or np.zeros((0, 2 + len(STORED))), float)

    def keys(first: Any, second: Any) -> NDArray[np.int64]:
        first, second = np.asarray(first).astype(np.int64), np.asarray(second).astype(np.int64)
        return np.asarray(np.minimum(first, second) << 32 | np.maximum(first, second))

    known, wanted = keys(pairs[:, 0], pairs[:, 1]), keys(one, two)
    order = np.argsort(known)
    place = np.minimum(np.searchsorted(known[order], wanted), max(len(known) - 1, 0))
    found = np.flatnonzero(known[order][place] == wanted) if len(known) else np.zeros(0, np.int64)
    return found, pairs[order[place[found]], 2:] if len(found) else np.zeros((0, len(STORED)))
