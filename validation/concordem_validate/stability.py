"""The automatic time step of bonded particles, computed here: 0.8 · 2/ω of the assembled springs, by dense eigenvalues.

In the highest mode of central differences the displacements change their sign at each step. Strains of deformable particles that follow
the forces of the step before then act with the other sign: f = k (G x + S f + T g), with elongations G x of the bonds, shear forces
g = k_t H x, and the elongations S f + T g that the strains of the particles make. Iterated strains act with their own sign. Dashpots
C = β K lower the limit to (2/ω)(√(1 + ζ²) − ζ), ζ = βω/2 (Belytschko 1983).
"""
import math

import numpy as np

from .errors import Unsupported
from .quantity import si

# dense matrices of six times as many rows
_MOST = 300
_SAFETY = 0.8
# The program iterates for the largest eigenvalue, ω², until it lies in an interval of 1e-4, and takes the upper end.
TOLERANCE = 1e-4


def time_step(document, start):
    """The step, s; raises Unsupported for what is not computed here."""
    alone = _unknown(document, start)
    if alone:
        raise Unsupported(f"the automatic time step is not computed here with {alone}; give integration.time_step")
    law, plane = document["material"][0]["linear_bond"], document.get("dimension", 3) == 2
    normal, shear = si(law["normal_stiffness"]), si(law.get("shear_stiffness", 0))
    stretch, slip = _maps(start)
    stiffness = _effective(document, start, stretch, slip, normal, shear)
    inertia = np.repeat(np.column_stack([start.mass, start.inertia(plane)]), 3, axis=1).ravel()
    free = np.tile([1, 1, 0, 0, 0, 1] if plane else [1] * 6, len(start.mass)).astype(bool)
    root = 1 / np.sqrt(inertia[free])
    frequency = math.sqrt(np.linalg.eigvalsh(root[:, None] * stiffness[np.ix_(free, free)] * root)[-1])
    a, b = start.bonds.T
    reduced = float((start.mass[a] * start.mass[b] / (start.mass[a] + start.mass[b])).max())
    softest = min(k for k in (normal, shear) if k > 0)
    zeta = si(law.get("damping_ratio", 0)) * math.sqrt(reduced / softest) * frequency
    return _SAFETY * 2 / frequency * (math.sqrt(1 + zeta**2) - zeta)


def _unknown(document, start):
    """What a scenario has that its step depends on and that is not computed here, in words."""
    bonds, laws = document.get("bonds", {}), [m.get("linear_bond") for m in document["material"]]
    if bonds.get("law") != "linear_bond" or not len(start.bonds) or laws[0] is None or any(law != laws[0] for law in laws):
        return "other bonds than linear ones of one kind"
    if set(laws[0]) - {"normal_stiffness", "shear_stiffness", "damping_ratio", "normal_strength", "shear_strength", "friction_coefficient"}:
        return "other stiffnesses of bonds than given ones"
    if document["contacts"]["law"] != "none" or document.get("wall"):
        return "contacts or walls"
    if set(document.get("integration", {})) - {"time_step", "gravity"} or document.get("heat") or len(start.cell):
        return "damping, heat, a periodic cell, or a safety factor"
    if any(document.get("deformable", {}).get("condition") is None and "deformable" in m for m in document["material"]):
        return "deformable particles without a given condition"
    if document.get("prescribe") and any("deformable" in m for m in document["material"]):
        return "prescribed motion of deformable particles"
    return f"more than {_MOST} particles" if len(start.mass) > _MOST else ""


def _directions(start):
    branch = start.position[start.bonds[:, 1]] - start.position[start.bonds[:, 0]]
    length = np.linalg.norm(branch, axis=1)
    return branch / length[:, None], length


def _maps(start):
    """Elongations, and slip vectors, of the bonds by displacements and rotations of the particles."""
    count = len(start.bonds)
    stretch, slip = np.zeros((count, 6 * len(start.mass))), np.zeros((count, 3, 6 * len(start.mass)))
    for k, ((a, b), n, length) in enumerate(zip(start.bonds, *_directions(start))):
        across, turned = np.eye(3) - np.outer(n, n), np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
        arm = length * start.radius[[a, b]] / (start.radius[a] + start.radius[b])
        for p, sign, part in ((a, -1, arm[0]), (b, 1, arm[1])):
            stretch[k, 6 * p:6 * p + 3] = sign * n
            slip[k, :, 6 * p:6 * p + 3], slip[k, :, 6 * p + 3:6 * p + 6] = sign * across, part * turned
    return stretch, slip.reshape(3 * count, -1)


def _effective(document, start, stretch, slip, normal, shear):
    """Stiffness in the highest mode; symmetric, because the rest adds only its square."""
    of_normal, of_shear = _strains(document, start)
    sign = 1 if document.get("deformable", {}).get("update", "lagged") == "lagged" else -1
    answer = np.linalg.inv(np.eye(len(stretch)) / normal - sign * of_normal)
    whole = shear * slip.T @ slip + stretch.T @ answer @ (stretch + sign * shear * of_shear @ slip)
    return 0.5 * (whole + whole.T)


def _strains(document, start):
    """Elongation of each bond by the strains that unit normal, and shear, forces of all bonds make in the particles (Madan 2019, 2.48, 2.49)."""
    count, plane = len(start.bonds), document.get("dimension", 3) == 2
    of_normal, of_shear = np.zeros((count, count)), np.zeros((count, 3 * count))
    tables = [m.get("deformable") for m in document["material"]]
    condition = document.get("deformable", {}).get("condition", "solid")
    direction, _ = _directions(start)
    for p, r in enumerate(start.radius):
        if not (table := tables[start.material[p]]):
            continue
        young, nu = si(table["young"]), si(table["poisson"])
        mine = np.flatnonzero((start.bonds == p).any(axis=1))
        n = direction[mine]
        volume = math.pi * r**2 if plane else 4 / 3 * math.pi * r**3
        cosine, part = n @ n.T, r**2 / (volume * young)
        trace = nu * (1 + nu) if condition == "plane-strain" else nu
        of_normal[np.ix_(mine, mine)] += part * ((1 + nu) * cosine**2 - trace)
        of_shear.reshape(count, count, 3)[np.ix_(mine, mine)] += part * (1 + nu) * cosine[:, :, None] * n[:, None, :]
    return of_normal, of_shear
