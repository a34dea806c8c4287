"""Oblique impacts. With sliding throughout, friction alone determines e_t, angular velocity, and rebound angle (Chung & Ooi 2011).

The steepest impact ends to slide while it still approaches; from then on its shear force grows with the stiffness of a contact that sticks,
8 G* sqrt(R* d) at the overlap d."""
import math

import numpy as np
from concordem_validate.quantity import si
from concordem_validate.result import Result

ANGLES = [10, 15, 20, 25, 30, 35, 40, 50, 60, 70, 80, 85]


def analytic(task):
    """Sliding throughout, for tan θ ≥ 7/2 μ (1+e): impulse μ(1+e) m v_n."""
    law, start = task.scenario["material"][0]["hertz_mindlin"], task.start
    e, mu = si(law["restitution"]), si(law["friction_coefficient"])
    tangential, spin, angle = [], [], []
    for k, degrees in enumerate(ANGLES):
        if math.tan(math.radians(degrees)) < 3.5 * mu * (1 + e):
            continue
        v, normal = start.velocity[k, 0], -start.velocity[k, 2]
        change = mu * (1 + e) * normal
        tangential.append((v - change) / v)
        spin.append(-2.5 * change / start.radius[k])
        angle.append(math.degrees(math.atan2(v - 3.5 * change, e * normal)))
    result = Result("analytic", start.dt)
    result.numbers["measures"] = {
        "sliding_tangential_restitution": tangential, "sliding_spin": spin, "sliding_rebound_angle": angle,
        "sticking_stiffness": 8 * effective_shear(task)}
    return result


def effective_shear(task):
    """G* = 1/sum((2 - nu)/G) of sphere and plane, Pa."""
    laws = [material["hertz_mindlin"] for material in task.scenario["material"]]
    return 1 / sum(2 * (1 + si(law["poisson"])) * (2 - si(law["poisson"])) / si(law["young"]) for law in laws)


def sticking_stiffness(task, result):
    """Change of the shear force over the integral of sqrt(R d) du, of the steepest impact, while it sticks and approaches, Pa.

    Forces are mean values between two samples; velocities are known half a step before positions, in the middle of two mean values."""
    velocity = result.series["velocity"]
    v, x = velocity.values[:, 0], result.series["position"].values[:, 0]
    w = result.series["angular_velocity"].values[:, 0, 1]
    between = np.diff(velocity.steps)[0] * result.dt
    radius = result.fields["radius"][0][0] if np.ndim(result.fields["radius"][0]) else result.fields["radius"][0]
    force = np.diff(v, axis=0) / between
    depth = radius - (x[:, 2] - 0.5 * result.dt * v[:, 2])
    mu = si(task.scenario["material"][0]["hertz_mindlin"]["friction_coefficient"])
    sticks = np.abs(force[:, 0]) < 0.95 * mu * force[:, 2]
    change, way = 0.0, 0.0
    for k in range(1, len(force)):
        if sticks[k - 1] and sticks[k] and v[k, 2] < 0 and depth[k] > 0:
            patch = v[k, 0] - (radius - depth[k]) * w[k]
            change += force[k, 0] - force[k - 1, 0]
            way += math.sqrt(radius * depth[k]) * patch * between
    mass = 4 / 3 * math.pi * radius**3 * si(task.scenario["material"][0]["density"])
    return -mass * change / way


def measures(task, result):
    v = result.series["velocity"].values
    w = result.series["angular_velocity"].values[-1, :, 1]
    before, after, radius = v[0], v[-1], result.fields["radius"][0]
    patch = after[:, 0] - radius * w
    angle = np.degrees(np.arctan2(patch, after[:, 2]))
    law = task.scenario["material"][0]["hertz_mindlin"]
    sliding = np.tan(np.radians(ANGLES)) >= 3.5 * si(law["friction_coefficient"]) * (1 + si(law["restitution"]))
    out = {"tangential_restitution": after[:, 0] / before[:, 0], "spin": -w, "rebound_angle": angle}
    out |= {"sliding_" + name: values[sliding] for name, values in out.items()}
    out["normal_restitution"] = -after[:, 2] / before[:, 2]
    return {name: values.tolist() for name, values in out.items()} | {"sticking_stiffness": sticking_stiffness(task, result)}
