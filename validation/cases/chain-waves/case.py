"""A chain of masses and springs between fixed ends: omega = 2 sqrt(k/m) sin(q a/2) (any textbook of solid-state physics).

Leapfrog turns a standing wave into u_n = V dt sin(n theta)/sin(theta), cos(theta) = 1 - (omega dt)^2/2, exactly, also beyond the
critical step 2/omega, where theta is complex and u grows.
"""
import cmath
import math

import numpy as np
from concordem_validate.quantity import si
from concordem_validate.result import Result


def scenario(document):
    packing = document["packing"]
    count, radius, mode = packing["count"], si(packing["radius"]), packing["mode"]
    speed = si(packing["speed"])
    document["packing"] = {"kind": "spheres", "spheres": [[2 * radius * i, 0.0, 0.0, radius] for i in range(count)]}
    document["set"] = [{"name": "ends", "selection": {"kind": "ids", "ids": [0, count - 1]}}]
    document["prescribe"] = [{"set": "ends", "velocity": [0, 0, 0], "angular_velocity": [0, 0, 0]}]
    document["initial"] = []
    for i in range(1, count - 1):
        document["set"].append({"name": f"bead{i}", "selection": {"kind": "ids", "ids": [i]}})
        v = speed * math.sin(mode * math.pi * i / (count - 1))
        document["initial"].append({"set": f"bead{i}", "velocity": [v, 0.0, 0.0]})
    if "critical" in packing:
        # a fraction of the largest stable time step, which the shortest wave between fixed ends determines
        mass = si(document["material"][0]["density"]) * 4 / 3 * math.pi * radius**3
        stiffness = si(document["material"][0]["linear_bond"]["normal_stiffness"])
        omega = 2 * math.sqrt(stiffness / mass) * math.sin((count - 2) * math.pi / 2 / (count - 1))
        document["integration"]["time_step"] = packing["critical"] * 2 / omega
    return document


def analytic(task):
    start = task.start
    count = len(start.radius)
    stiffness = si(task.scenario["material"][0]["linear_bond"]["normal_stiffness"])
    v = start.velocity[:, 0]
    # amplitude: scalar product with the standing waves
    shapes = np.sin(np.pi * np.outer(np.arange(1, count - 1), np.arange(count)) / (count - 1))
    mode = 1 + int(np.argmax(np.abs(shapes @ v)))
    omega = 2 * math.sqrt(stiffness / start.mass[0]) * math.sin(mode * math.pi / 2 / (count - 1))
    theta = cmath.acos(1 - (omega * start.dt) ** 2 / 2)
    steps = np.arange(0, task.scenario["stop"]["steps"] + 1, task.scenario["output"]["snapshot_interval"])
    factor = np.array([(cmath.sin(n * theta) / cmath.sin(theta)).real for n in steps])
    x = np.repeat(start.position[None], len(steps), axis=0)
    x[:, :, 0] += factor[:, None] * v * start.dt
    result = Result("analytic", start.dt)
    result.add("position", steps, x, "m")
    return result
