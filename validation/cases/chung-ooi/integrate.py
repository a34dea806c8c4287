"""Impacts of spheres in the plane of their motion, by leapfrog, with one of three published rules for the shear spring of a Hertz contact.

Stiffnesses of Mindlin 1949: normal 4/3 E* sqrt(R*) d^(3/2), shear 8 G* sqrt(R* d). The rules differ where the contact grows or shrinks:

- `kept`: each step adds the present stiffness times the slip to the force (YADE);
- `scaled`: the present stiffness times the whole slip (LIGGGHTS), and friction acts on the absolute normal force, which the dashpot may pull;
- `lost`: as `kept` while the contact grows; while it shrinks, the force shrinks with its stiffness (Walton 1993; ConcorDEM).
"""
import math

import numpy as np
from concordem_validate.quantity import si

RULES = ("kept", "scaled", "lost")


def damping(restitution, may_pull):
    """Factor a of the dashpot a sqrt(m* E* sqrt(R*)) d^(1/4) that gives a restitution."""
    if restitution == 1:
        return 0.0
    if may_pull:
        # Antypov & Elliott 2011
        return math.sqrt(20 / 3) * abs(math.log(restitution)) / math.hypot(math.log(restitution), math.pi)
    low, high = 0.0, 4.0
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _restitution(middle) > restitution else (low, middle)
    return 0.5 * (low + high)


def _restitution(factor, step=1e-3):
    """Of a unit mass at unit speed on a unit contact whose force is cut off at zero."""
    x, v = 0.0, 1.0
    while x >= 0:
        x += 0.5 * step * v
        root = max(x, 0.0)
        v -= step * max(4 / 3 * root**1.5 + factor * root**0.25 * v, 0.0)
        x += 0.5 * step * v
    return -v


def after(task, rule):
    """Velocities and angular velocities at the end of a run; spheres hit the plane, or each second one the one before it."""
    document, start = task.scenario, task.start
    laws = [m["hertz_mindlin"] for m in document["material"]]
    young, nu, mu = [si(law["young"]) for law in laws], si(laws[0]["poisson"]), si(laws[0]["friction_coefficient"])
    # one Poisson's ratio, and shear moduli E/2(1+nu)
    modulus = 1 / sum((1 - nu**2) / e for e in young)
    shear = 1 / sum((2 - nu) * 2 * (1 + nu) / e for e in young)
    wall = "wall" in document
    stride = 1 if wall else 2
    place, velocity = start.position.copy(), start.velocity.copy()
    spin, radius, mass = start.angular_velocity[:, 1].copy(), start.radius, start.mass
    a, b = slice(0, None, stride), slice(1, None, 2)
    # the plane is a body of infinite mass and radius, at rest
    weight = 1 / mass[a] + (0 if wall else 1 / mass[b])
    size = 1 / (1 / radius[a] + (0 if wall else 1 / radius[b]))
    dashpot = damping(si(laws[0]["restitution"]), rule == "scaled") * np.sqrt(modulus * np.sqrt(size) / weight)
    force, slip, before, about = (np.zeros(len(size)) for _ in range(4))
    about = np.array([0.0, 1.0, 0.0])
    for _ in range(document["stop"]["steps"]):
        if wall:
            normal, overlap = np.broadcast_to([0.0, 0.0, -1.0], place.shape), radius - place[:, 2]
        else:
            branch = place[b] - place[a]
            length = np.linalg.norm(branch, axis=1)
            normal, overlap = branch / length[:, None], radius[a] + radius[b] - length
        depth = np.maximum(overlap, 0.0)
        tangent = np.cross(about, normal)
        # of a sphere to the contact point: on the plane, or, of two spheres and in LIGGGHTS, half way through the overlap
        arm = radius[a] - depth * (1.0 if wall and rule != "scaled" else 0.5)
        turning = lambda rate, reach: np.cross(rate[:, None] * about, reach[:, None] * normal)
        relative = velocity[a] + turning(spin[a], arm)
        if not wall:
            other = radius[b] - 0.5 * depth
            relative = relative - velocity[b] + turning(spin[b], other)
        closing, along = np.sum(relative * normal, axis=1), np.sum(relative * tangent, axis=1) * start.dt
        press = 4 / 3 * modulus * np.sqrt(size) * depth**1.5 + dashpot * depth**0.25 * closing
        stiffness = 8 * shear * np.sqrt(size * depth)
        if rule == "scaled":
            force = stiffness * (slip + along)
        else:
            press = np.maximum(press, 0.0)
            shrunk = np.sqrt(np.divide(depth, before, out=np.ones_like(depth), where=before > depth)) if rule == "lost" else 1.0
            force = force * shrunk + stiffness * along
        force = np.where(depth > 0, np.clip(force, -mu * np.abs(press), mu * np.abs(press)), 0.0)
        slip = np.divide(force, stiffness, out=np.zeros_like(force), where=stiffness > 0)
        before = depth
        on_a = -(press[:, None] * normal + force[:, None] * tangent) * (depth > 0)[:, None]
        moment = lambda reach, of: np.cross(reach[:, None] * normal, of)[:, 1]
        kick = lambda who: start.dt / mass[who]
        velocity[a] += kick(a)[:, None] * on_a
        spin[a] += kick(a) / (0.4 * radius[a] ** 2) * moment(arm, on_a)
        if not wall:
            velocity[b] -= kick(b)[:, None] * on_a
            spin[b] += kick(b) / (0.4 * radius[b] ** 2) * moment(other, on_a)
        place += start.dt * velocity
    return velocity, spin[:, None] * about
