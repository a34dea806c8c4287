"""Oblique impacts. With sliding throughout, friction alone determines e_t, angular velocity, and rebound angle (Chung & Ooi 2011)."""
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
        "sliding_tangential_restitution": tangential, "sliding_spin": spin, "sliding_rebound_angle": angle}
    return result


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
    return {name: values.tolist() for name, values in out.items()}
