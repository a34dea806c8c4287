"""Euler-Bernoulli's cantilever with forces at its nodes: statics in closed form, free motion by linear beam elements."""
import math

import numpy as np
from concordem_validate.engines import translate
from concordem_validate.quantity import si
from concordem_validate.result import Result


def _droop(task):
    """Σ P x² (3L − x)/6EI."""
    start, law = task.start, task.scenario["material"][0]["cohesive_beam"]
    gravity = abs(si(task.scenario["integration"]["gravity"][2]))
    stiffness = si(law["young"]) * math.pi * si(law["radius"]) ** 4 / 4
    x = start.position[1:, 0] - start.position[0, 0]
    length = x[-1]
    return float(np.sum(start.mass[1:] * gravity * x**2 * (3 * length - x)) / (6 * stiffness))


def _elements(task):
    """Linear Euler-Bernoulli elements in the plane x z, and torsion; lumped masses; leapfrog."""
    start, document = task.start, task.scenario
    law = document["material"][0]["cohesive_beam"]
    e, nu, b = si(law["young"]), si(law["poisson"]), si(law["radius"])
    second, polar = math.pi * b**4 / 4, math.pi * b**4 / 2
    n, length = len(start.radius), float(start.position[1, 0] - start.position[0, 0])
    k = np.zeros((3 * n, 3 * n))  # w, rotation about y, twist about x per node
    for i in range(n - 1):
        a = e * second / length**3
        # dw/dx = -rotation about y
        local = a * np.array([[12, -6 * length, -12, -6 * length], [-6 * length, 4 * length**2, 6 * length, 2 * length**2],
                              [-12, 6 * length, 12, 6 * length], [-6 * length, 2 * length**2, 6 * length, 4 * length**2]])
        at = [3 * i, 3 * i + 1, 3 * i + 3, 3 * i + 4]
        k[np.ix_(at, at)] += local
        twist = e / (2 + 2 * nu) * polar / length
        at = [3 * i + 2, 3 * i + 5]
        k[np.ix_(at, at)] += twist * np.array([[1, -1], [-1, 1]])
    mass = np.zeros(3 * n)
    mass[0::3] = start.mass
    mass[1::3] = mass[2::3] = 0.4 * start.mass * start.radius**2
    force, moment = translate.forces(document, start)
    load = np.zeros(3 * n)
    load[0::3], load[1::3], load[2::3] = force[:, 2], moment[:, 1], moment[:, 0]
    u, v = np.zeros(3 * n), np.zeros(3 * n)
    v[0::3], v[1::3], v[2::3] = start.velocity[:, 2], start.angular_velocity[:, 1], start.angular_velocity[:, 0]
    steps, interval = translate.steps_of(document, start.dt), document["output"]["snapshot_interval"]
    at, places = [], []
    for step in range(steps + 1):
        if step % interval == 0:
            at.append(step)
            places.append(u.copy())
        a = (load - k @ u) / mass
        a[:3] = 0.0
        v += a * start.dt
        u += v * start.dt
    return np.array(at), np.array(places)


def analytic(task):
    result = Result("analytic", task.start.dt)
    if any(task.scenario["integration"].get("gravity", [0])):
        result.numbers["measures"] = {"droop": _droop(task)}
        return result
    at, u = _elements(task)
    x = np.repeat(task.start.position[None], len(at), axis=0)
    x[:, :, 2] += u[:, 0::3]
    result.add("position", at, x, "m")
    return result


def measures(task, result):
    x = result.series["position"].values
    return {"droop": float(x[0, -1, 2] - x[-1, -1, 2])}
