"""A row of masses and brittle springs, integrated by leapfrog independently of the solver."""
import numpy as np
from concordem_validate.quantity import si
from concordem_validate.result import Result


def scenario(document):
    document["packing"]["spheres"] = [[2e-3 * i, 0.0, 0.0, 1e-3] for i in range(20)]
    return document


def analytic(task):
    start, law = task.start, task.scenario["material"][0]["linear_bond"]
    k, strength = si(law["normal_stiffness"]), si(law["normal_strength"])
    x, v = start.position[:, 0].copy(), start.velocity[:, 0].copy()
    length = np.diff(x)
    whole = np.ones(len(length), bool)
    broke = []
    steps, interval = task.scenario["stop"]["steps"], task.scenario["output"]["snapshot_interval"]
    at, places = [], []
    for step in range(steps + 1):
        if step % interval == 0:
            at.append(step)
            places.append(start.position + np.outer(x - start.position[:, 0], [1, 0, 0]))
        pull = k * (np.diff(x) - length)
        for b in np.flatnonzero(whole & (pull > strength)):
            broke.append([step, b])
        whole &= pull <= strength
        pull = np.where(whole, pull, 0.0)
        force = np.append(pull, 0.0) - np.insert(pull, 0, 0.0)
        # the motion of the ends is prescribed
        force[[0, -1]] = 0.0
        v += force / start.mass * start.dt
        x += v * start.dt
    result = Result("analytic", start.dt)
    result.add("position", at, places, "m")
    result.numbers["measures"] = {"first_break_step": float(broke[0][0]), "first_break_bond": float(broke[0][1]),
                                  "breaks": float(len(broke))}
    return result


def measures(task, result):
    step, bond = result.fields["events/step"][0], result.fields["events/id_a"][0]
    return {"first_break_step": float(step[0]), "first_break_bond": float(bond[0]), "breaks": float(len(step))}
