"""A drum of triangles that turns about y, filled to a half with a lattice of large and small spheres."""
import math
import random

import numpy as np
from concordem_validate.quantity import si


def shell(radius, width, sides):
    """Vertices and triangles of the mantle, and of both ends as fans about their middles."""
    size = radius / math.cos(math.pi / sides)
    vertices = [[size * math.cos(2 * math.pi * k / sides), y, size * math.sin(2 * math.pi * k / sides)]
                for y in (-0.5 * width, 0.5 * width) for k in range(sides)] + [[0, -0.5 * width, 0], [0, 0.5 * width, 0]]
    triangles = []
    for k in range(sides):
        following = (k + 1) % sides
        triangles += [[k, following, sides + following], [k, sides + following, sides + k], [2 * sides, k, following],
                      [2 * sides + 1, sides + following, sides + k]]
    return vertices, triangles


def scenario(document):
    """Each cell of a lattice has one large sphere, or eight small ones, in turn by chance; those that lie in the drum stay."""
    drum = document.pop("drum")
    chance = random.Random(drum["seed"])
    radius, width, small, large, spacing, jitter = (si(drum[key]) for key in ("radius", "width", "small", "large", "spacing", "jitter"))
    vertices, triangles = shell(radius, width, drum["sides"])
    nx, ny, nz = drum["cells"]
    spheres = {small: [], large: []}
    places = [(spacing * (i - 0.5 * (nx - 1)), spacing * (j - 0.5 * (ny - 1)), -radius + large + jitter + spacing * k)
              for k in range(nz) for j in range(ny) for i in range(nx)]
    for place in places:
        size = chance.choice([small, large])
        quarters = [0] if size == large else [-0.25, 0.25]
        for step in [(a, b, c) for a in quarters for b in quarters for c in quarters]:
            x = [p + spacing * s + chance.uniform(-jitter, jitter) for p, s in zip(place, step)]
            if math.hypot(x[0], x[2]) <= radius - size:
                spheres[size].append([*x, size])
    document["packing"]["spheres"] = [*spheres[small], *spheres[large]]
    number = len(spheres[small])
    document["set"] = [{"name": "M2", "material": "M2", "selection": {"kind": "ids", "ids": list(range(number, number + len(spheres[large])))}}]
    # a turn that goes on with constant speed
    document["history"] = [{"name": "turn", "shape": {"kind": "table", "points": [[0, 0], [1000, 1000]]}}]
    document["wall"] = [{"name": "drum", "material": "steel", "shape": {"kind": "mesh", "vertices": vertices, "triangles": triangles},
                         "motion": {"history": "turn", "rotation": [0, si(drum["speed"]), 0], "center": [0, 0, 0]}}]
    return document


def measures(task, result):
    """Over the second half of the run: center of mass along x and z of M1 and of M2 (m), and the shares of M1 and M2 in the quadrants that are
    counted in the publication, x > 0 > z (`low`, of M1 alone) and x < 0 < z."""
    series = result.series["position"]
    late = series.values[series.steps >= series.steps[-1] // 2]
    radius = result.fields["radius"][0]
    out = {"center": []}
    for name, chosen in (("M1", radius < radius.max()), ("M2", radius == radius.max())):
        x, z = late[:, chosen, 0], late[:, chosen, 2]
        out["center"] += [float(x.mean()), float(z.mean())]
        out |= {f"low {name}": float(((x > 0) & (z < 0)).mean()), f"high {name}": float(((x < 0) & (z > 0)).mean())}
    return {**out, "low": out["low M1"]}


def curves(task, result):
    """What the benchmark counts: time in s, and spheres of each material in the two quadrants."""
    series, radius = result.series["position"], result.fields["radius"][0]
    x, z = series.values[:, :, 0], series.values[:, :, 2]
    out = {}
    for name, chosen in (("small", radius < radius.max()), ("large", radius == radius.max())):
        for place, inside in (("low", (x > 0) & (z < 0)), ("high", (x < 0) & (z > 0))):
            out[f"{name} spheres, {place}"] = (series.steps * result.dt, inside[:, chosen].sum(axis=1))
    return out
