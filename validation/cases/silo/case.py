"""A silo of triangles, filled with a loose lattice of spheres."""
import math
import random

import numpy as np
from concordem_validate.quantity import si


def ring(radius, z, sides):
    """Corners of a polygon around the circle, which it touches from outside with its edges."""
    size = radius / math.cos(math.pi / sides)
    return [[size * math.cos(2 * math.pi * k / sides), size * math.sin(2 * math.pi * k / sides), z] for k in range(sides)]


def band(a, b, sides):
    """Triangles between two rings of corners, the first of which have the numbers `a` and `b`."""
    out = []
    for k in range(sides):
        following = (k + 1) % sides
        out += [[a + k, a + following, b + following], [a + k, b + following, b + k]]
    return out


def scenario(document):
    """The silo stands on its funnel, the end of which is at z = 0; a box below and around it takes what flows out."""
    silo = document.pop("silo")
    chance = random.Random(silo["seed"])
    r, radius, orifice, funnel, height, drop = (si(silo[key]) for key in ("sphere", "radius", "orifice", "funnel", "height", "drop"))
    sides, spacing, jitter = silo["sides"], silo["spacing"] * r, silo["jitter"] * r
    vertices = ring(orifice, 0.0, sides) + ring(radius, funnel, sides) + ring(radius, funnel + height, sides)
    shape = {"kind": "mesh", "vertices": vertices, "triangles": band(0, sides, sides) + band(sides, 2 * sides, sides)}
    spheres, count = [], int(radius / spacing) + 1
    for k in range(silo["layers"]):
        z = (k + 0.5) * spacing
        # inside the funnel the surface is inclined
        within = radius if z > funnel + r else orifice + (radius - orifice) * z / funnel - r * (math.hypot(radius - orifice, funnel) / funnel - 1)
        for i in range(-count, count + 1):
            for j in range(-count, count + 1):
                if math.hypot(i, j) * spacing <= within - r - 2 * jitter:
                    moved = [spacing * n + chance.uniform(-jitter, jitter) for n in (i, j)]
                    spheres.append([*moved, z + chance.uniform(-jitter, jitter), r])
    document["packing"]["spheres"] = spheres
    side, top = 2 * radius, funnel + 2 * height + silo["layers"] * spacing
    document["wall"] = [
        {"name": "silo", "material": "steel", "shape": shape},
        {"name": "box", "material": "steel", "shape": {"kind": "box", "minimum": [-side, -side, -drop], "maximum": [side, side, top]}}]
    return document


def measures(task, result):
    """Spheres that are still above the orifice, over time; and the time at which a quarter has left."""
    series = result.series["position"]
    retained = (series.values[:, :, 2] > 0).sum(axis=1)
    times = series.steps * result.dt
    left = len(series.values[0]) - retained
    quarter = 0.25 * len(series.values[0])
    late = int(np.argmax(left >= quarter))
    arrival = float(np.interp(quarter, left[late - 1:late + 1], times[late - 1:late + 1])) if left[-1] >= quarter else math.inf
    return {"left": left[1:].tolist(), "retained": retained.tolist(), "quarter": arrival}


def curves(task, result):
    """What the benchmark counts: time in s, and spheres in the silo."""
    series = result.series["position"]
    return {"spheres in the silo": (series.steps * result.dt, (series.values[:, :, 2] > 0).sum(axis=1))}
