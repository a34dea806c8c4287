"""Analytical solution of a Hertz impact: k = 4/3 E* √R*, δ = (5 m* v²/4k)^(2/5), F = k δ^(3/2), t = 2.943 δ/v (Timoshenko & Goodier)."""
import math

import numpy as np
from concordem_validate.quantity import si
from concordem_validate.result import Result

# t v/δ of an elastic Hertz impact: (4/5) √π Γ(2/5)/Γ(9/10)
DURATION = 0.8 * math.sqrt(math.pi) * math.gamma(0.4) / math.gamma(0.9)


def impacts(task):
    """Per impact: the sphere, its partner (None: the plane), relative speed, closed form F, δ, t."""
    document, start = task.scenario, task.start
    laws = [m["hertz_mindlin"] for m in document["material"]]
    compliance = lambda m: (1 - si(m["poisson"]) ** 2) / si(m["young"])
    if document.get("wall"):
        pairs = [(p, None) for p in range(len(start.radius))]
    else:
        pairs = [(0, 1), (2, 3)]
    out = []
    for a, b in pairs:
        own = compliance(laws[start.material[a]])
        other = compliance(laws[-1]) if b is None else own
        radius = start.radius[a] if b is None else start.radius[a] / 2
        mass = start.mass[a] if b is None else start.mass[a] / 2
        speed = np.linalg.norm(start.velocity[a] - (0 if b is None else start.velocity[b]))
        k = 4 / 3 / (own + other) * math.sqrt(radius)
        overlap = (5 * mass * speed**2 / (4 * k)) ** 0.4
        out.append((a, b, speed, k * overlap**1.5, overlap, DURATION * overlap / speed))
    return out


def analytic(task):
    result = Result("analytic", task.start.dt)
    rows = impacts(task)
    result.numbers["measures"] = {
        "peak_force": [r[3] for r in rows], "peak_overlap": [r[4] for r in rows], "duration": [r[5] for r in rows],
        "restitution": [1.0] * len(rows)}
    return result


def measures(task, result):
    x, dt = result.series["position"].values, result.dt
    mass, radius = result.fields["mass"][0], result.fields["radius"][0]
    out = {"peak_force": [], "peak_overlap": [], "duration": [], "restitution": []}
    pairs = [(p, None) for p in range(x.shape[1])] if task.scenario.get("wall") else [(0, 1), (2, 3)]
    for a, b in pairs:
        if b is None:
            way = x[:, a, 2] - radius[a]
            reduced = mass[a]
        else:
            way = x[:, b, 0] - x[:, a, 0] - radius[a] - radius[b]
            reduced = mass[a] / 2
        # second differences of positions are the acceleration in leapfrog and Verlet
        out["peak_force"].append(float(reduced * np.max(np.diff(way, 2)) / dt**2))
        low = int(np.argmin(way))
        # parabola through the three lowest points
        f0, f1, f2 = way[low - 1:low + 2]
        out["peak_overlap"].append(float(-(f1 - (f2 - f0) ** 2 / (8 * (f0 - 2 * f1 + f2)))))
        inside = np.flatnonzero(way < 0)
        first, last = inside[0], inside[-1]
        cross = lambda k: k + way[k] / (way[k] - way[k + 1])
        out["duration"].append(float((cross(last) - cross(first - 1)) * dt))
        speed = np.diff(way) / dt
        out["restitution"].append(float(-speed[-1] / speed[0]))
    return out
