"""Bending waves of a chain of masses with rotary inertia, joined by beam elements, around a ring.

Deflection w and slope s of a Bloch wave obey M ü = −K u, with M = diag(m, J) and, for the springs k_s = 12EI/L³(1+Φ) across
w_{n+1} − w_n − L (s_n + s_{n+1})/2 and k_b = EI/L across s_{n+1} − s_n,
K = [[2 k_s (1−c), i k_s L d], [−i k_s L d, k_s L² (1+c)/2 + 2 k_b (1−c)]], c = cos qL, d = sin qL.
Leapfrog turns a mode that starts with a velocity V into V dt sin(nθ)/sin θ, 2 − 2 cos θ = (ω dt)², exactly; one at rest under a
constant F (per mass) into F (1 − cos((n+½)θ)/cos(½θ))/ω².
"""
import math

import numpy as np
from concordem_validate.engines import translate
from concordem_validate.quantity import si
from concordem_validate.result import Result


def scenario(document):
    packing = document["packing"]
    if packing["kind"] != "ring":
        return document
    count, radius = packing["count"], si(packing["radius"])
    # the centers of spheres are exact multiples of the radius
    document["packing"] = {
        "kind": "spheres", "cell": [2 * radius * count, 20 * radius, 20 * radius],
        "spheres": [[radius * (2 * i + 1), 10 * radius, 10 * radius, radius] for i in range(count)]}
    if "force" in packing:
        document["set"] = [{"name": f"bead{i}", "selection": {"kind": "ids", "ids": [i]}} for i in (count // 4, 3 * count // 4)]
        document["force"] = [{"set": f"bead{i}", "force": [0, 0, sign * si(packing["force"])]}
                             for i, sign in ((count // 4, 1), (3 * count // 4, -1))]
        return document
    speed, q = si(packing["speed"]), 2 * math.pi * packing["mode"] / count
    document["set"], document["initial"] = [], []
    for i in range(count):
        x = (i - count / 2) / packing["width"]
        v = speed * math.exp(-0.5 * x * x)
        document["set"].append({"name": f"bead{i}", "selection": {"kind": "ids", "ids": [i]}})
        # slope s = dw/dx is a rotation by -s about y
        slope = -v * (x / packing["width"] * math.cos(q * (i - count / 2)) + q * math.sin(q * (i - count / 2))) / (2 * radius)
        document["initial"].append({"set": f"bead{i}", "velocity": [0, 0, v * math.cos(q * (i - count / 2))],
                                    "angular_velocity": [0, -slope, 0]})
    return document


def _springs(task):
    """k_s, k_b, L, m, J, and of the beam itself EI, κGA (infinite: slender), per length ρA."""
    law, start = task.scenario["material"][0]["cohesive_beam"], task.start
    e, b, r = si(law["young"]), si(law["radius"]), float(start.radius[0])
    length, second, area = 2 * r, math.pi * b**4 / 4, math.pi * b**2
    shear = si(law["shear_coefficient"]) * e / (2 + 2 * si(law["poisson"])) * area if law.get("model") == "timoshenko" else math.inf
    phi = 12 * e * second / (shear * length**2)
    mass = float(start.mass[0])
    return 12 * e * second / length**3 / (1 + phi), e * second / length, length, mass, 0.4 * mass * r * r, e * second, shear


def _modes(task):
    """Frequencies (count, 2) and shapes of all Bloch waves; the first is the bending wave."""
    ks, kb, length, mass, inertia, *_ = _springs(task)
    count = len(task.start.radius)
    root = np.sqrt([mass, inertia])
    q = 2 * np.pi * np.fft.fftfreq(count)
    k = np.zeros((count, 2, 2), complex)
    k[:, 0, 0] = 2 * ks * (1 - np.cos(q))
    k[:, 0, 1] = 1j * ks * length * np.sin(q)
    k[:, 1, 0] = -k[:, 0, 1]
    k[:, 1, 1] = ks * length**2 * (1 + np.cos(q)) / 2 + 2 * kb * (1 - np.cos(q))
    values, shapes = np.linalg.eigh(k / np.outer(root, root))
    return q, np.sqrt(np.maximum(values, 0)), shapes, root


def analytic(task):
    q, omega, shapes, root = _modes(task)
    start, dt = task.start, task.start.dt
    steps = np.arange(0, translate.steps_of(task.scenario, dt) + 1, task.scenario["output"]["snapshot_interval"])
    theta = np.arccos(1 - (omega * dt) ** 2 / 2)
    force, _ = translate.forces(task.scenario, start)
    to_modes = lambda w, s: np.einsum("qab,qa->qb", shapes.conj(), np.fft.fft(np.array([w, s]), axis=1).T * root)
    if force.any():
        load = to_modes(force[:, 2] / start.mass, np.zeros(len(q)))
        with np.errstate(divide="ignore", invalid="ignore"):
            # u_n: constant force from rest; the initial velocity is that half a step earlier
            grown = [np.where(theta > 1e-9, (1 - np.cos((n + 0.5) * theta) / np.cos(0.5 * theta)) / np.maximum(omega, 1e-300) ** 2,
                              0.5 * n * (n + 1) * dt**2) for n in steps]
        amplitude = np.array(grown) * load
    else:
        rate = to_modes(start.velocity[:, 2], -start.angular_velocity[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            grown = [np.where(theta > 1e-9, np.sin(n * theta) / np.sin(theta), n) * dt for n in steps]
        amplitude = np.array(grown) * rate
    waves = np.einsum("qab,tqb->taq", shapes, amplitude) / root[:, None]
    w, s = np.fft.ifft(waves, axis=2).real.transpose(1, 0, 2)
    x = np.repeat(start.position[None], len(steps), axis=0)
    x[:, :, 2] += w
    result = Result("analytic", dt)
    result.add("position", steps, x, "m")
    if not force.any():
        wanted = _seen(task)
        exact = omega[wanted, 0]
        ks, kb, length, mass, inertia, bending, shear = _springs(task)
        k = 2 * np.pi * np.asarray(wanted) / len(q) / length
        # the beam as a continuum of the same mass and rotary inertia per length: (EI k² + κGA − J'ω²)(κGA k² − ρA ω²) = (κGA)² k²
        rho, rotary = mass / length, inertia / length
        if math.isinf(shear):
            continuum = np.sqrt(bending * k**4 / (rho + rotary * k**2))
        else:
            a, b, c = rho * rotary, rho * (bending * k**2 + shear) + rotary * shear * k**2, bending * k**2 * shear * k**2
            continuum = np.sqrt((b - np.sqrt(b * b - 4 * a * c)) / (2 * a))
        result.numbers["measures"] = {"frequencies": exact.tolist(), "long_waves": continuum[:2].tolist()}
    return result


def _seen(task):
    """Waves around the ring with amplitudes large enough to measure their frequency."""
    return [2, 3, 4, 5, 6, 7, 8, 9, 10]


def measures(task, result):
    """Frequencies of the standing parts of the waves, from three consecutive snapshots: a(t+h) + a(t−h) = 2 cos(ωh) a(t)."""
    if task.variant == "push":
        return {}
    series = result.series["position"]
    w = series.values[:, :, 2] - series.values[0, :, 2]
    h = (series.steps[1] - series.steps[0]) * result.dt
    amplitudes = np.fft.fft(w, axis=1)
    found = []
    for mode in _seen(task):
        a = amplitudes[:, mode]
        middle, ends = a[1:-1], a[2:] + a[:-2]
        # least squares of one cosine; the rotary branch is fast and weak
        found.append(math.acos(float((ends * middle.conj()).real.sum() / (2 * (abs(middle) ** 2).sum()))) / h)
    # correct for the frequency error of leapfrog
    found = 2 / result.dt * np.sin(np.array(found) * result.dt / 2)
    return {"frequencies": found.tolist(), "long_waves": found[:2].tolist()}
