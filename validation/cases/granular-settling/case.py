"""A random cloud of spheres, and measures of the bed after it has settled; of a layer that slides down a floor, its friction."""
import random

import numpy as np
from concordem_validate.quantity import si, vector
from concordem_validate.result import Result


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


def analytic(task):
    """A layer of sliding spheres: the impulse of the floor along it is the friction coefficient times that across it."""
    result = Result("analytic", task.start.dt)
    count = len(task.start.radius)
    result.numbers["measures"] = {"friction": [si(task.scenario["material"][0]["hertz_mindlin"]["friction_coefficient"])] * count}
    return result


def friction(task, result):
    """Impulse of the floor along x over that along z, of each sphere, in the last fifth of the run, when no sphere bounces any more.

    While a sphere lands, its contact sticks until the shear spring has its force."""
    velocity = result.series["velocity"]
    first = int(np.searchsorted(velocity.steps, 0.8 * velocity.steps[-1]))
    gravity = np.array(vector(task.scenario["integration"]["gravity"]))
    fall = gravity * (velocity.steps[-1] - velocity.steps[first]) * result.dt
    impulse = velocity.values[-1] - velocity.values[first] - fall
    return (-impulse[:, 0] / impulse[:, 2]).tolist()


def measures(task, result):
    """Mean height while falling and at rest, height of the bed, contacts per sphere, and remaining motion.

    90 % of the centers are below the height of the bed; a contact is a distance below 1.001 diameters."""
    if task.variant == "sliding":
        return {"friction": friction(task, result)}
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
