"""Analytical solutions of motions of a pair."""
import math

import numpy as np
from concordem_validate.engines import translate
from concordem_validate.quantity import si
from concordem_validate.result import Result


def analytic(task):
    start, document = task.start, task.scenario
    result = Result("analytic", start.dt)
    steps = translate.steps_of(document, start.dt)
    if task.variant == "whirling":
        result.numbers["measures"] = {"angular_momentum_drift": 0.0, "energy_residual": 0.0}
        return result
    # rotating spheres at fixed positions: the contact slides at constant velocity, so the shear force grows linearly
    law = document["material"][0]["cpm"]
    _, _, spin = translate.prescribed(document, start)
    l = start.position[1] - start.position[0]
    length = np.linalg.norm(l)
    n = l / length
    gap = length - start.radius.sum()
    arms = (start.radius[0] + gap / 2) * n, -(start.radius[1] + gap / 2) * n
    sliding = np.cross(spin[1], arms[1]) - np.cross(spin[0], arms[0])
    sliding -= (sliding @ n) * n
    twist = 0.5 * (spin[0] + spin[1]) @ n
    area = math.pi * start.radius.min() ** 2
    stiffness = si(law["young"]) * si(law["shear_ratio"]) * area / length
    at = np.arange(steps + 1)
    t = at * start.dt
    # the mean rotation about the normal rotates the shear displacement: ds/dt = u + ω n × s
    u, across = sliding, np.cross(n, sliding)
    if abs(twist) > 0:
        phase = twist * t
        slid = (np.sin(phase)[:, None] * u + (1 - np.cos(phase))[:, None] * across) / twist
    else:
        slid = t[:, None] * u
    result.add("contact_force", at, stiffness * slid, "N", "Force of the bond on the first sphere")
    return result


def measures(task, result):
    """Angular momentum at each step and the ledger's residual, relative to their magnitudes.

    Leapfrog keeps x_k × v_{k-1/2} + I ω exactly when every force acts at the same point on both spheres: positions move along the
    velocities, and a kick changes orbit and spin by opposite moments.
    """
    mass, radius = result.fields["mass"][0], result.fields["radius"][0]
    x, v, w = (result.series[name].values for name in ("position", "velocity", "angular_velocity"))
    total = np.einsum("p,npi->ni", mass, np.cross(x, v)) + np.einsum("p,npi->ni", 0.4 * mass * radius**2, w)
    drift = np.linalg.norm(total - total[0], axis=1).max() / np.linalg.norm(total[0])
    kinetic = result.series["kinetic"].values[0]
    return {"angular_momentum_drift": float(drift),
            "energy_residual": float(np.abs(result.series["residual"].values).max() / kinetic)}
