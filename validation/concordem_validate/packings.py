"""Packings that a program generates, checked without it: lattices site by site, random packings by density and contacts."""
import math

import numpy as np

from .errors import Incomparable
from .quantity import si, vector

# Distances on a lattice are sums of up to hundreds of edges.
_SITE = 1e-9
# Spheres that touch after compaction, with the overlap that the residual pressure leaves.
_TOUCH = 1e-4
_OVERLAP = 0.01
# Random packings of equal spheres: 0.64 without friction, and down to 0.555 with (Onoda & Liniger 1990). The surface of a specimen adds
# some hundredths.
_DENSITY, _DENSITY_WITH_FRICTION = (0.60, 0.67), (0.53, 0.67)
# Without friction a jammed sphere has 6 contacts in the mean, less a few rattlers; with friction at least 4 (O'Hern et al. 2003).
_CONTACTS, _CONTACTS_WITH_FRICTION = (5.0, 7.0), (3.5, 7.0)
_FEWEST = 20

_LATTICES = {
    "sc": ((1, 1, 1), [(0, 0, 0)]),
    "bcc": ((2 / math.sqrt(3),) * 3, [(0, 0, 0), (0.5, 0.5, 0.5)]),
    "fcc": ((math.sqrt(2),) * 3, [(0, 0, 0), (0.5, 0.5, 0), (0.5, 0, 0.5), (0, 0.5, 0.5)]),
    "hcp": ((1, math.sqrt(3), math.sqrt(8 / 3)), [(0, 0, 0), (0.5, 0.5, 0), (0.5, 5 / 6, 0.5), (0, 1 / 3, 0.5)]),
    "square": ((1, 1, 0), [(0, 0, 0)]),
    "triangular": ((1, math.sqrt(3), 0), [(0, 0, 0), (0.5, 0.5, 0)]),
}


def check(document, exported):
    """Refuse a generated packing that the scenario does not describe. Returns what was compared, and what only the program says."""
    packing = document["packing"]
    compared = ["radius"] if _radii(packing, exported.radius) else []
    _extent(packing, exported)
    match packing["kind"]:
        case "lattice":
            _lattice(packing, exported)
            return [*compared, "sites of the lattice"], []
        case "random-dense" if "radius" in packing:
            return [*compared, *_random(document, exported)], ["places in the packing"]
    return compared, ["packing"] if compared else ["packing", "radius"]


def _refuse(text):
    raise Incomparable("start", f"start state: {text}")


def _radii(packing, radius):
    """Equal radii, or those of a distribution between its ends."""
    if "radius" in packing:
        low = high = si(packing["radius"], "m")
    elif isinstance(packing.get("radii"), dict) and {"minimum", "maximum"} <= set(packing["radii"]):
        low, high = si(packing["radii"]["minimum"]), si(packing["radii"]["maximum"])
    else:
        return False
    worst = int(np.argmax(np.maximum(low - radius, radius - high)))
    if not low * (1 - 1e-14) <= radius[worst] <= high * (1 + 1e-14):
        _refuse(f"the radius of particle {worst} is {radius[worst]!r} m in the program, but {low:.17g} to {high:.17g} m by the scenario")
    return True


def _extent(packing, exported):
    """Spheres reach within a few radii of the faces of their box, and do not pass them by more than one."""
    shape, radius = packing.get("shape", {}), float(exported.radius.max())
    if shape.get("kind") == "box":
        size, extent = np.array(vector(shape["size"], "m")), np.ptp(exported.position, axis=0) + 2 * radius
        flat = packing["kind"] == "random-discs" or packing.get("lattice") in ("square", "triangular")
        wrong = (extent > size + 2 * radius) | (extent < size - 6 * radius)
        if wrong[:2 if flat else 3].any():
            _refuse(f"the packing is {extent} m large, the scenario asks for {size} m")


def _lattice(packing, exported):
    """All sites of the lattice, each once, and no place beside one."""
    edges, basis = _LATTICES[packing["lattice"]]
    edges, basis, x = 2 * si(packing["radius"], "m") * np.array(edges), np.array(basis, float), exported.position
    plane = edges[2] == 0
    unit = np.where(edges > 0, edges, 1.0)
    for anchor in basis:
        # in edges of a cell from the site of the first sphere
        place = (x - x[0]) / unit + anchor
        beside = np.abs(place[:, None] - basis - np.round(place[:, None] - basis)).max(axis=2).min(axis=1)
        if beside.max() <= _SITE * max(1.0, np.abs(place).max()) and not (plane and np.ptp(x[:, 2])):
            break
    else:
        _refuse(f"particle {int(np.argmax(beside))} is at no site of the lattice `{packing['lattice']}` of spheres of {packing['radius']}")
    sites = {tuple(site) for site in np.round(12 * place).astype(int).tolist()}
    if len(sites) != len(x):
        _refuse("two particles are at the same site of the lattice")
    shape = packing.get("shape", {"kind": "periodic"})
    if shape["kind"] == "periodic":
        repeats = [1 if plane and k == 2 else n for k, n in enumerate(packing["repeats"])]
        wanted = len(basis) * math.prod(repeats)
        if len(exported.cell) and np.abs(exported.cell[:2 if plane else 3] / (edges * repeats)[:2 if plane else 3] - 1).max() > _SITE:
            _refuse(f"the edges of the cell are {exported.cell} m, those of the lattice {edges * repeats} m")
    elif (inside := _inside(shape, -si(packing["radius"], "m") if shape.get("keep", "whole-spheres") == "whole-spheres" else 0.0)) is not None:
        reach = [np.arange(math.floor(place[:, k].min()) - 2, math.ceil(place[:, k].max()) + 3) for k in range(3)]
        grid = np.stack(np.meshgrid(*(reach[:2] if plane else reach), *([[0]] if plane else []), indexing="ij"), axis=-1).reshape(-1, 1, 3)
        wanted = int(inside(x[0] + ((grid + basis).reshape(-1, 3) - anchor) * unit, _SITE * si(packing["radius"], "m")).sum())
    else:
        return
    if len(x) != wanted:
        _refuse(f"the program has {len(x)} particles, the lattice {wanted} sites in the shape")


def _inside(shape, margin):
    """Whether centers lie inside a box or a cylinder whose surface is moved outward by `margin`, up to a tie; `None` for other shapes."""
    center = np.array(vector(shape.get("center", [0, 0, 0])))
    if shape["kind"] == "box":
        half = 0.5 * np.array(vector(shape["size"], "m")) + margin
        return lambda x, tie=0.0: (np.abs(x - center) <= half + tie).all(axis=1)
    if shape["kind"] == "cylinder":
        axis = "xyz".index(shape.get("axis", "z"))
        radius, half = si(shape["radius"]) + margin, 0.5 * si(shape["height"]) + margin
        across = lambda x: np.linalg.norm(np.delete(x - center, axis, axis=1), axis=1)
        return lambda x, tie=0.0: (across(x) <= radius + tie) & (np.abs((x - center)[:, axis]) <= half + tie)
    return None


def _volume(shape, exported):
    match shape["kind"]:
        case "periodic":
            return float(np.prod(exported.cell))
        case "box":
            return math.prod(vector(shape["size"], "m"))
        case "cylinder":
            return math.pi * si(shape["radius"]) ** 2 * si(shape["height"])
    return None


def _random(document, exported):
    """Number, overlaps, density, and contacts of a dense packing of equal spheres; returns what could be checked."""
    packing, shape = document["packing"], document["packing"]["shape"]
    x, radius, count = exported.position, si(packing["radius"], "m"), len(exported.radius)
    if shape["kind"] == "periodic" and count != packing["count"]:
        _refuse(f"{count} particles, the scenario asks for {packing['count']}")
    nearest, touching = _neighbors(x, exported.cell, 2 * radius)
    if nearest.min() < 1 - _OVERLAP:
        _refuse(f"particle {int(np.argmin(nearest))} overlaps another by {1 - nearest.min():.2g} of their diameter")
    compared, frictionless = ["overlaps"], not si(packing.get("friction", 0)) and packing.get("protocol", "jammed") == "jammed"
    inner = np.ones(count, bool)
    if shape["kind"] != "periodic":
        # a sphere whose neighbors may have been cut away does not count
        outer, deep = _inside(shape, 0.0), _inside(shape, -2 * radius)
        if outer is None:
            return compared
        if shape.get("keep", "centers") == "centers" and not outer(x, _SITE * radius).all():
            _refuse(f"particle {int(np.argmin(outer(x, _SITE * radius)))} is outside of the shape")
        inner = deep(x)
    if shape.get("keep", "centers") == "centers" and not document.get("cut"):
        density = count * 4 / 3 * math.pi * radius**3 / _volume(shape, exported)
        low, high = _DENSITY if frictionless else _DENSITY_WITH_FRICTION
        if not low <= density <= high:
            _refuse(f"the packing fills {density:.3f} of its shape; dense random packings fill {low} to {high}")
        compared.append(f"density {density:.3f}")
    if inner.sum() >= _FEWEST:
        mean = float(touching[inner].mean())
        low, high = _CONTACTS if frictionless else _CONTACTS_WITH_FRICTION
        if not low <= mean <= high:
            _refuse(f"a sphere inside touches {mean:.2f} others in the mean; in a jammed packing {low} to {high}")
        compared.append(f"{mean:.2f} contacts per sphere")
    return compared


def _neighbors(x, cell, diameter):
    """Distance of the nearest neighbor over the diameter, and the number of touching ones."""
    nearest, touching = np.zeros(len(x)), np.zeros(len(x), int)
    for a in range(len(x)):
        branch = x - x[a]
        if len(cell):
            branch -= cell * np.round(branch / cell)
        distance = np.linalg.norm(branch, axis=1) / diameter
        distance[a] = np.inf
        nearest[a], touching[a] = distance.min(), int((distance <= 1 + _TOUCH).sum())
    return nearest, touching
