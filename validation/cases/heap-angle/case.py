"""A random column on a rough floor, and the slope of the remaining heap."""
import math
import random

import numpy as np
from concordem_validate.quantity import si


def scenario(document):
    """A floor of fixed spheres, and above it points of a lattice, each moved by up to 6 % of the spacing."""
    packing = document["packing"]
    chance = random.Random(packing["seed"])
    spacing, radius = si(packing["spacing"]), si(packing["radius"])
    nx, ny = packing["floor"]
    spheres = [[radius * (2 * i + 1), radius * (2 * j + 1), -radius, radius] for i in range(nx) for j in range(ny)]
    held = len(spheres)
    moved = lambda k: spacing * (k + 0.5 + chance.uniform(-0.06, 0.06))
    a, b, c = packing["cells"]
    spheres += [[moved(i), moved(j) + 0.4e-3, moved(k), radius] for k in range(c) for j in range(b) for i in range(a)]
    document["packing"] = {"kind": "spheres", "spheres": spheres}
    document["set"] = [{"name": "floor", "selection": {"kind": "ids", "ids": list(range(held))}}]
    document["prescribe"] = [{"set": "floor", "velocity": [0, 0, 0], "angular_velocity": [0, 0, 0]}]
    return document


def measures(task, result):
    """Slope of the surface, and the number of remaining spheres. The surface is at twice the mean height of slices one diameter wide."""
    x, radius = result.series["position"].values[-1], result.fields["radius"][0][0]
    heap = x[x[:, 2] > 0]
    middles = np.arange(radius, 26 * radius, 2 * radius)
    slices = [heap[np.abs(heap[:, 0] - m) <= radius, 2] for m in middles]
    surface = np.array([(m, 2 * one.mean()) for m, one in zip(middles, slices) if len(one) >= 5])
    slope = np.polyfit(surface[:, 0], surface[:, 1], 1)[0]
    return {"angle": math.degrees(math.atan(-slope)), "stay": float(len(heap))}
