"""Conduction in a simple cubic block: explicit steps in closed form.

The modes of the 7-point stencil in an insulated block are products of cos(pi k (i + 1/2)/N) along each axis, and a forward Euler step
of dt multiplies each by 1 - dt/C sum G (2 - 2 cos(pi k/N)) (any textbook of finite differences).
"""
import numpy as np
from concordem_validate.quantity import si
from concordem_validate.result import Result


def scenario(document):
    packing = document["packing"]
    (nx, ny, nz), radius, spacing = packing["repeats"], si(packing["radius"]), si(packing["spacing"])
    grid = [(i, j, k) for k in range(nz) for j in range(ny) for i in range(nx)]
    document["packing"] = {"kind": "spheres", "spheres": [[spacing * i, spacing * j, spacing * k, radius] for i, j, k in grid]}
    hot = [p for p, (i, j, k) in enumerate(grid) if i < 2 and j < 2 and k < 3]
    document["set"] = [{"name": "hot", "selection": {"kind": "ids", "ids": hot}}]
    if len(document["material"]) > 1:
        half = [p for p, (i, _, _) in enumerate(grid) if i >= nx // 2]
        document["set"].append({"name": "half", "selection": {"kind": "ids", "ids": half}, "material": document["material"][1]["name"]})
    return document


def analytic(task):
    document, start = task.scenario, task.start
    thermal, heat = document["material"][0]["thermal"], document["heat"]
    radius = start.radius[0]
    places = [np.unique(np.round(start.position[:, axis], 9)) for axis in range(3)]
    shape = tuple(len(x) for x in places)
    at = tuple(np.rint(start.position[:, axis] / (places[axis][1] - places[axis][0])).astype(int) for axis in range(3))
    length = float(np.linalg.norm(start.position[1] - start.position[0]))
    temperature = np.full(shape, si(heat["temperature"]))
    for p in document["set"][0]["selection"]["ids"]:
        temperature[tuple(x[p] for x in at)] = si(heat["initial"][0]["temperature"])
    # the equation of each cell: mass c dT/dt = 4 R^2 conductivity/l sum (T_j - T)
    rate = 4 * radius**2 * si(thermal["conductivity"]) / length / (start.mass[0] * si(thermal["specific_heat"]))
    modes, decay = [], 0.0
    for axis, n in enumerate(shape):
        k, i = np.arange(n)[:, None], np.arange(n)[None]
        mode = np.cos(np.pi * k * (i + 0.5) / n)
        modes.append(mode / np.linalg.norm(mode, axis=1)[:, None])
        decay = decay + (2 - 2 * np.cos(np.pi * np.arange(n) / n)).reshape([-1 if a == axis else 1 for a in range(3)])
    parts = np.einsum("ai,bj,ck,ijk->abc", *modes, temperature)
    steps = np.arange(0, document["stop"]["steps"] + 1, document["output"]["snapshot_interval"])
    values = []
    for n in steps:
        now = np.einsum("ai,bj,ck,abc->ijk", *modes, parts * (1 - start.dt * rate * decay) ** n)
        values.append(now[at])
    result = Result("analytic", start.dt)
    result.add("temperature", steps, values, "K")
    return result
