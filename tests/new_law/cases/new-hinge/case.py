"""The free sphere as a point with two springs, stepped by the leapfrog; and its twist in closed form."""
import math

import numpy as np
from concordem_validate.engines import translate
from concordem_validate.quantity import si
from concordem_validate.result import Result


def analytic(task):
    start, document = task.start, task.scenario
    law = {key: si(value) for key, value in document["material"][0]["hinge"].items()}
    steps, interval = translate.steps_of(document, start.dt), document["output"]["snapshot_interval"]
    at = np.arange(0, steps + 1, interval)
    mass, inertia, dt = start.mass[1], 0.4 * start.mass[1] * start.radius[1] ** 2, start.dt
    result = Result("analytic", dt)
    if task.variant == "twist":
        # sin(φ/2) = ½ Δt √(k/I); angular velocities of half steps
        half = math.asin(0.5 * dt * math.sqrt(law["twisting_stiffness"] / inertia))
        spin = np.zeros((len(at), 2, 3))
        # that of step n is of n − ½: ω₀ cos((n − ½) φ)/cos(φ/2), and the given one at the start
        spin[:, 1, 0] = start.angular_velocity[1, 0] * np.cos((2 * at - 1) * half) / math.cos(half)
        spin[0] = start.angular_velocity
        result.add("angular_velocity", at, spin, "rad/s")
        return result
    length = float(start.position[1, 0] - start.position[0, 0])
    shear, bending = law["shear_stiffness"] * (0.5 * length) ** 2, law["bending_stiffness"]
    u, angle, v, w = 0.0, 0.0, float(start.velocity[1, 1]), float(start.angular_velocity[1, 2])
    places = []
    for step in range(steps + 1):
        if step % interval == 0:
            places.append(u)
        # Sum of the rotations of both ends relative to the branch vector, which has turned by u/l.
        sum_ = angle - 2 * u / length
        v += dt * shear * sum_ * 2 / length / mass
        w -= dt * (shear * sum_ + bending * angle) / inertia
        u, angle = u + dt * v, angle + dt * w
    x = np.repeat(start.position[None], len(at), axis=0)
    x[:, 1, 1] += places
    result.add("position", at, x, "m")
    return result
