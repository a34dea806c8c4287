"""A bed of spheres in a box, and a ball that hits it."""
import random

from concordem_validate.quantity import si


def scenario(document):
    """Points of a cubic lattice, each moved a little along every axis, between five walls; the ball is the last sphere."""
    bed = document.pop("bed")
    chance = random.Random(bed["seed"])
    radius, spacing, jitter, ball = (si(bed[key]) for key in ("radius", "spacing", "jitter", "ball"))
    nx, ny, nz = bed["cells"]
    moved = lambda k, n: spacing * (k - 0.5 * (n - 1)) + chance.uniform(-jitter, jitter)
    spheres = [[moved(i, nx), moved(j, ny), radius + jitter + spacing * k + chance.uniform(-jitter, jitter), radius]
               for k in range(nz) for j in range(ny) for i in range(nx)]
    top = radius + jitter + spacing * (nz - 1) + radius
    document["packing"]["spheres"] = [*spheres, [0, 0, top + si(bed["above"]) + ball, ball]]
    document["set"] = [{"name": "ball", "material": "steel", "selection": {"kind": "ids", "ids": [len(spheres)]}}]
    document["initial"] = [{"set": "ball", "velocity": [0, 0, -si(bed["speed"])]}]
    half = [0.5 * spacing * n + jitter for n in (nx, ny)]
    height = si(bed.get("height", top + 20 * ball))
    document["wall"] = [{"name": "box", "material": "steel",
                         "shape": {"kind": "box", "minimum": [-half[0], -half[1], 0], "maximum": [*half, height]}}]
    return document


def measures(task, result):
    """Height of the ball over time, and its way."""
    height = result.series["position"].values[:, -1, 2]
    return {"way": (height[0] - height[1:]).tolist(), "depth": float(height[0] - height.min())}


def curves(task, result):
    """What the benchmark counts: time in s, and height of the ball in m."""
    series = result.series["position"]
    return {"height of the ball, m": (series.steps * result.dt, series.values[:, -1, 2])}
