"""Two colliding spheres with linear spring, shear spring, and Coulomb friction, implemented independently of the solver.

The shear displacement is turned with the normal exactly; arms end at the contact point half way through the overlap.
"""
import numpy as np
from concordem_validate.engines import translate
from concordem_validate.quantity import si
from concordem_validate.result import Result


def _turn(vector, old, new):
    """Rotate by the smallest rotation that brings `old` to `new`."""
    axis = np.cross(old, new)
    cosine = old @ new
    return vector * cosine + np.cross(axis, vector) + axis * (axis @ vector) / (1 + cosine)


def analytic(task):
    start, law = task.start, task.scenario["material"][0]["frictional"]
    kn, kt, mu = si(law["normal_stiffness"]), si(law["shear_stiffness"]), si(law["friction_coefficient"])
    steps, dt = translate.steps_of(task.scenario, start.dt), start.dt
    interval = task.scenario["output"]["snapshot_interval"]
    x, v, w = start.position.copy(), start.velocity.copy(), start.angular_velocity.copy()
    inertia = 0.4 * start.mass * start.radius**2
    shear, normal_old = {}, {}
    at, positions, spins = [], [], []
    for k in range(steps + 1):
        if k % interval == 0:
            at.append(k)
            positions.append(x.copy())
            spins.append(w.copy())
        force, moment = np.zeros_like(x), np.zeros_like(x)
        for a, b in ((0, 1), (2, 3)):
            l = x[b] - x[a]
            distance = np.linalg.norm(l)
            n, overlap = l / distance, start.radius[a] + start.radius[b] - distance
            if overlap <= 0:
                shear.pop(a, None)
                continue
            arm_a, arm_b = (start.radius[a] - overlap / 2) * n, -(start.radius[b] - overlap / 2) * n
            u = v[b] + np.cross(w[b], arm_b) - v[a] - np.cross(w[a], arm_a)
            u -= (u @ n) * n
            spring = shear.get(a)
            if spring is None:
                spring = np.zeros(3)
            else:
                spring = _turn(spring, normal_old[a], n)
                twist = 0.5 * dt * (w[a] + w[b]) @ n
                spring = spring + twist * np.cross(n, spring)
            spring = spring + u * dt
            limit = mu * kn * overlap
            size = kt * np.linalg.norm(spring)
            if size > limit:
                spring = spring * limit / size
            shear[a], normal_old[a] = spring, n
            f = -kn * overlap * n + kt * spring
            force[a] += f
            force[b] -= f
            moment[a] += np.cross(arm_a, f)
            moment[b] += np.cross(arm_b, -f)
        v += force / start.mass[:, None] * dt
        w += moment / inertia[:, None] * dt
        x += v * dt
    result = Result("analytic", dt)
    result.add("position", at, positions, "m")
    result.add("angular_velocity", at, spins, "rad/s")
    result.fields["mass"], result.fields["radius"] = (start.mass, "kg"), (start.radius, "m")
    return result


def measures(task, result):
    v, w = result.series["velocity"].values, result.series["angular_velocity"].values
    mass, radius = result.fields["mass"][0], result.fields["radius"][0]
    energy = lambda k: float(np.sum(0.5 * mass * (v[k] ** 2).sum(axis=1) + 0.2 * mass * radius**2 * (w[k] ** 2).sum(axis=1)))
    return {"energy_kept": energy(-1) / energy(0), "velocity": v[-1].ravel().tolist(), "spin": w[-1].ravel().tolist()}
