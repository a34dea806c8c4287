"""A random cloud of spheres, and measures of the bed after it has settled."""
import random

import numpy as np
from concordem_validate.quantity import si


def scenario(document):
    """Points of a cubic lattice, each moved by up to 7 % of the spacing along every axis."""
    packing = document["packing"]
    if packing["kind"] != "cloud":
        return document
    chance = random.Random(packing["seed"])
    spacing, radius = si(packing["spacing"]), si(packing["radius"])
    moved = lambda k: spacing * (k + 0.5 + chance.uniform(-0.07, 0.07))
    nx, ny, nz = packing["cells"]
    document["packing"] = {"kind": "spheres", "spheres": [
        [moved(i), moved(j), moved(k), radius] for k in range(nz) for j in range(ny) for i in range(nx)]}
    return document


def measures(task, result):
    """Mean height while falling and at rest, height of the bed, contacts per sphere, and remaining motion.

    90 % of the centers are below the height of the bed; a contact is a distance below 1.001 diameters."""
    series = result.series["position"]
    x = series.values
    end, radius = x[-1], result.fields["radius"][0][0]
    height = x[:, :, 2].mean(axis=1)
    falling = np.interp(0.03, series.steps * result.dt, height)
    pairs, reach = 0, 2.002 * radius
    # check only pairs that are close along x
    along = end[np.argsort(end[:, 0])]
    last = np.searchsorted(along[:, 0], along[:, 0] + reach, side="right")
    for k in range(len(along)):
        pairs += int((np.linalg.norm(along[k + 1:last[k]] - along[k], axis=1) < reach).sum())
    v = result.series["velocity"].values[-1]
    return {"falling": float(falling), "height": float(height[-1]), "top": float(np.quantile(end[:, 2], 0.9)),
            "coordination": 2 * pairs / len(end), "speed": float(np.sqrt((v**2).sum(axis=1).mean()))}
