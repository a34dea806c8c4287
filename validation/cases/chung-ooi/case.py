"""Impacts of spinning spheres. With sliding throughout, friction alone determines what comes off: impulse μ (1+e) m v_n at the contact."""
import math
import runpy
from pathlib import Path

import numpy as np
from concordem_validate.quantity import si
from concordem_validate.result import Result

_INTEGRATE = runpy.run_path(str(Path(__file__).with_name("integrate.py")))


def scenario(document):
    """Spheres, sets, and velocities of the table `impact`."""
    impact = document.pop("impact")
    radius, gap, speed = (si(impact[key]) for key in ("radius", "gap", "speed"))
    law = document["material"][0]["hertz_mindlin"]
    nu = si(law["poisson"])
    slip = [angle * si(law["friction_coefficient"]) * (2 - nu) / (2 - 2 * nu) for angle in impact.get("angles", [])] \
        or [math.tan(math.radians(angle)) for angle in impact["degrees"]]
    spheres, document["set"], document["initial"] = [], [], []

    def add(place, size, velocity, spin=0.0):
        name = f"sphere {len(spheres)}"
        document["set"].append({"name": name, "selection": {"kind": "ids", "ids": [len(spheres)]}})
        document["initial"].append({"set": name, "velocity": velocity, "angular_velocity": [0, spin, 0]})
        spheres.append([*place, size])

    large = 5 * radius
    for k, tangent in enumerate(slip):
        match impact["kind"]:
            case "slide":
                add((8 * radius * k, 0, radius + gap), radius, [tangent * speed, 0, -speed])
            case "spin":
                add((8 * radius * k, 0, radius + gap), radius, [0, 0, -speed], -tangent * speed / radius)
            case "pairs":
                for side in (-1, 1):
                    add((side * (radius + 0.5 * gap), 8 * radius * k, 0), radius, [-side * speed, 0, 0], -side * tangent * speed / radius)
            case "pair-with-large":
                add((-radius - gap, 30 * radius * k, 0), radius, [speed, 0, 0], -tangent * speed / radius)
                add((large, 30 * radius * k, 0), large, [0, 0, 0])
    if impact["kind"] == "pair-with-large":
        document["set"].append({"name": "large", "material": "rigid", "selection": {"kind": "ids", "ids": list(range(1, len(spheres), 2))}})
    elif impact["kind"] in ("slide", "spin"):
        document["wall"] = [{"name": "plane", "material": "rigid", "shape": {"kind": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}}]
    document["packing"]["spheres"] = spheres
    return document


def _patch(task, velocity, spin):
    """Of the small spheres, or of the first of each pair: normal speed toward the contact, velocity of the contact point along it, spin."""
    wall = "wall" in task.scenario
    normal, along, toward = (2, 0, -1.0) if wall else (0, 2, 1.0)
    ours = slice(None, None, 1 if wall else 2)
    radius = np.array([si(sphere[3]) for sphere in task.scenario["packing"]["spheres"]])[ours]
    # ω e_y × r e_n, with e_n along -z or +x: -ωr along x or z
    return toward * velocity[ours, normal], velocity[ours, along] - spin[ours, 1] * radius, spin[ours, 1] * radius


def _slides(task, speed, slip):
    """Restitution, friction, and which spheres slide throughout: with a margin, because damped contacts end to slide a little earlier."""
    law = task.scenario["material"][0]["hertz_mindlin"]
    e, mu = si(law["restitution"]), si(law["friction_coefficient"])
    return e, mu, slip >= 1.1 * 3.5 * mu * (1 + e) * speed


def analytic(task):
    start = task.start
    speed, slip, turns = _patch(task, start.velocity, start.angular_velocity)
    e, mu, slides = _slides(task, speed, slip)
    result = Result("analytic", start.dt)
    if task.variant == "test-7":
        # both contact points move alike: nothing slides
        result.numbers["measures"] = {"spin_ratio": [1.0] * len(speed)}
        return result
    lost = mu * (1 + e) * speed
    found = result.numbers["measures"] = {
        "sliding_patch": ((slip - 3.5 * lost) / slip)[slides].tolist(),
        "sliding_spin": (2.5 * lost / (mu * speed))[slides].tolist()}
    for rule in _INTEGRATE["RULES"]:
        _, patch, turn = _patch(task, *_INTEGRATE["after"](task, rule))
        found |= {f"patch_{rule}": (patch / slip).tolist(), f"spin_{rule}": ((turn - turns) / (mu * speed)).tolist()}
    return result


def measures(task, result):
    velocity, spin = (result.series[name].values for name in ("velocity", "angular_velocity"))
    (speed, slip, turns), (after, patch, turn) = (_patch(task, velocity[k], spin[k]) for k in (0, -1))
    restitution = (-after / speed).tolist()
    if task.variant == "test-7":
        return {"spin_ratio": (turn / turns).tolist(), "restitution": restitution}
    _, mu, slides = _slides(task, speed, slip)
    change = (turn - turns) / (mu * speed)
    # what is compared with the integration by each rule
    same = {f"{name}_{rule}": values.tolist() for rule in _INTEGRATE["RULES"] for name, values in (("patch", patch / slip), ("spin", change))}
    return {"restitution": restitution, "patch": (patch / slip).tolist(), "spin": change.tolist(), **same,
            "sliding_patch": (patch / slip)[slides].tolist(), "sliding_spin": change[slides].tolist()}
