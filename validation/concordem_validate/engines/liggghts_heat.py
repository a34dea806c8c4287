"""Heat conduction in LIGGGHTS: `fix heat/gran/conduction`; groups for heat along our bonds.

LIGGGHTS conducts `2 H √a` through a contact, with the harmonic mean H of both conductivities and an area `a` (Chaudhuri et al. 2006):

- of the circle in which the spheres intersect. On particles at rest, our model `ordered` conducts `4 R² H/l` over the distance l. They are
  equal if all contacts are: then LIGGGHTS gets our conductivities times `2 R²/(l √a)`.
- or a constant. Our model `contacts` with a resistance r conducts `4 R²/(2R/λ + r)` while equal spheres touch, which gives the area.
"""
import math

import numpy as np

from ..errors import Unsupported
from ..quantity import si
from . import translate

# `fix nve` has no part in it: nothing moves. Springs of any stiffness make the contacts.
STYLE = "model hooke/stiffness tangential history"


def moves(document):
    """Whether grains move and conduct through their present contacts."""
    return document["heat"].get("model") == "contacts"


def _checked(document):
    heat = document["heat"]
    translate.law_keys("liggghts", heat, {"model", "temperature", "motion", "initial", "contact"})
    if moves(document):
        if "resistance" not in heat["contact"] or len(document["material"]) > 1 or not heat.get("motion", True):
            raise Unsupported("liggghts: heat of moving grains only with `contact.resistance` and one material")
    elif heat.get("model") != "ordered" or heat.get("motion", True) or document["contacts"]["law"] != "none" or "contact" in heat:
        raise Unsupported("liggghts: heat only in the models `contacts`, or `ordered` without motion and contact law")
    for key in ("bonds", "wall", "prescribe", "force", "loading", *(() if moves(document) else ("initial",))):
        if key in document:
            raise Unsupported(f"liggghts: no translation of `{key}` with heat")
    for material in document["material"]:
        translate.law_keys("liggghts", material["thermal"], {"specific_heat", "conductivity"})
    return heat


def _equal(values, what):
    if np.ptp(values) > 1e-9 * values.max():
        raise Unsupported(f"liggghts: its conduction equals ours only if all {what} are equal")
    return float(values.mean())


def _factor(document, start):
    """What multiplies our conductivities."""
    radius = _equal(start.radius, "radii")
    if moves(document):
        return 1.0
    apart = np.linalg.norm(start.position[:, None] - start.position[None], axis=2)
    length = _equal(apart[(apart > 0) & (apart < 2 * radius)], "distances of particles in contact")
    return 2 * radius**2 / (length * math.sqrt(math.pi * (radius**2 - 0.25 * length**2)))


def properties(document, start):
    """Global properties of the materials; of particles at rest also those of springs."""
    _checked(document)
    factor = _factor(document, start)
    thermal = [material["thermal"] for material in document["material"]]
    pairs = len(thermal) ** 2
    each = lambda values: " ".join(repr(float(value)) for value in values)
    springs = [] if moves(document) else [
        f"{name} peratomtypepair {len(thermal)} " + each([value] * pairs) for name, value in (
            ("kn", 1e3), ("kt", 1e3), ("gamman", 0), ("gammat", 0), ("coefficientFriction", 0))]
    return [*springs,
            "thermalConductivity peratomtype " + each(factor * si(t["conductivity"]) for t in thermal),
            "thermalCapacity peratomtype " + each(si(t["specific_heat"]) for t in thermal)]


def _area(document, start):
    if not moves(document):
        return "overlap"
    radius, conductivity = float(start.radius[0]), si(document["material"][0]["thermal"]["conductivity"])
    conductance = 4 * radius**2 / (2 * radius / conductivity + si(document["heat"]["contact"]["resistance"]))
    return f"constant {(conductance / (2 * conductivity)) ** 2!r}"


def lines(document, start, group_lines):
    """The fix and the initial temperatures. They exist only after a run."""
    heat = document["heat"]
    out = [f"fix conduct all heat/gran/conduction initial_temperature {si(heat['temperature'])!r} "
           f"contact_area {_area(document, start)} area_correction no", "run 0"]
    sets = translate.members(document, start)
    for k, one in enumerate(heat.get("initial", [])):
        out += [*group_lines(f"initial{k}", sets[one["set"]]), f"set group initial{k} property/atom Temp {si(one['temperature'])!r}"]
    return out


def groups_of_bonds(document, start, group_lines):
    """Groups for our fix, whose `heat FILE` names them as sets. The fix itself rejects the keys of `[heat]` that it does not know."""
    heat = document.get("heat", {})
    named = {one["set"] for key in ("initial", "source", "boundary") for one in heat.get(key, []) if "set" in one}
    sets = translate.members(document, start)
    return [line for name in sorted(named) for line in group_lines(name, sets[name])]
