"""LIGGGHTS 3.8.0 as Debian ships it: scenario and start state become a data file and a deck.

Native models only: `hertz_mindlin` → `hertz tangential history`, `frictional` with stiffnesses → `hooke/stiffness
tangential history`. Bonded laws have none in the public build; they will come by our plugin, as a further entry of
`_MODELS` that loads it (`pair_style gran model ...`) and fixes the bonds of the start state.
"""
import math
import re
import shutil
import subprocess
from functools import cache

import numpy as np

from .. import process
from ..errors import Crashed, NotInstalled, Unsupported
from ..quantity import si, vector
from ..result import Result
from . import translate

_MPI = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}


@cache
def version():
    if not shutil.which("liggghts"):
        raise NotInstalled("LIGGGHTS is not installed: apt install liggghts")
    package = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", "liggghts"], capture_output=True, text=True)
    return f"liggghts {package.stdout.strip() or 'of unknown version'}"


def _number(value):
    return repr(float(value))


def _pairs(function, materials):
    """A property of pairs of materials, row by row."""
    return " ".join(_number(function(a, b)) for a in materials for b in materials)


def _hertz_mindlin(document):
    laws = [m["hertz_mindlin"] for m in document["material"]]
    for law in laws:
        translate.law_keys("liggghts", law, {"young", "poisson", "friction_coefficient", "restitution"})
    lines = ["hard_particles yes"] if max(si(m["young"]) for m in laws) > 1e9 else []
    lines.append("soft_particles yes" if min(si(m["young"]) for m in laws) < 5e6 else "")
    mean = lambda key, default: lambda a, b: 0.5 * (si(a.get(key, default)) + si(b.get(key, default)))
    properties = [
        "youngsModulus peratomtype " + " ".join(_number(si(m["young"])) for m in laws),
        "poissonsRatio peratomtype " + " ".join(_number(si(m["poisson"])) for m in laws),
        f"coefficientRestitution peratomtypepair {len(laws)} " + _pairs(mean("restitution", 1), laws),
        f"coefficientFriction peratomtypepair {len(laws)} "
        + _pairs(lambda a, b: 0.5 * (translate.friction(a) + translate.friction(b)), laws),
    ]
    # no tangential dashpot in our law
    return lines, properties, "model hertz tangential history"


def _frictional(document):
    laws = [m["frictional"] for m in document["material"]]
    for law in laws:
        translate.law_keys("liggghts", law, {
            "young", "stiffness_ratio", "normal_stiffness", "shear_stiffness", "friction_coefficient", "damping_ratio"})
    if any("normal_stiffness" not in m or si(m.get("damping_ratio", 0)) for m in laws):
        raise Unsupported("liggghts: linear contacts only without dashpots, and with both stiffnesses")
    # N/m of two materials: the mean, as ours; stiffnesses are those of the contact
    mean = lambda key: lambda a, b: 0.5 * (si(a[key]) + si(b[key]))
    zero = lambda a, b: 0.0
    n = len(laws)
    properties = [
        f"kn peratomtypepair {n} " + _pairs(mean("normal_stiffness"), laws),
        f"kt peratomtypepair {n} " + _pairs(mean("shear_stiffness"), laws),
        f"gamman peratomtypepair {n} " + _pairs(zero, laws),
        f"gammat peratomtypepair {n} " + _pairs(zero, laws),
        f"coefficientFriction peratomtypepair {n} "
        + _pairs(lambda a, b: 0.5 * (translate.friction(a) + translate.friction(b)), laws),
    ]
    return [], properties, "model hooke/stiffness tangential history"


_MODELS = {"hertz_mindlin": _hertz_mindlin, "frictional": _frictional}


def deck(task, ranks):
    """Data file and deck."""
    document, start = task.scenario, task.start
    translate.check_keys(document, "liggghts")
    if document.get("bonds") or document.get("loading", {}).get("kind", "none") != "none":
        raise Unsupported("liggghts: no native model of bonds, no translation of loading")
    if document.get("prescribe") or document.get("force"):
        raise Unsupported("liggghts: no translation of prescribed motions and forces")
    if translate.local_damping(document):
        raise Unsupported("liggghts: local damping is none of its schemes")
    law = document["contacts"]["law"]
    if law not in _MODELS:
        raise Unsupported(f"liggghts: no native model of `{law}`")
    head, properties, style = _MODELS[law](document)
    steps = translate.steps_of(document, start.dt)
    interval = document.get("output", {}).get("snapshot_interval") or steps
    extent = 20 * start.radius.max()
    travel = np.abs(start.velocity).max() * steps * start.dt
    low, high = start.position.min(axis=0) - extent - travel, start.position.max(axis=0) + extent + travel
    data = ["LIGGGHTS data file of a start state", "", f"{len(start.radius)} atoms", "",
            f"{len(document['material'])} atom types", ""]
    data += [f"{_number(low[k])} {_number(high[k])} {c}lo {c}hi" for k, c in enumerate("xyz")]
    data += ["", "Atoms", ""]
    for p, (x, r, m) in enumerate(zip(start.position, start.radius, start.mass)):
        density = m / (4 / 3 * math.pi * r**3)
        data.append(" ".join([str(p + 1), str(start.material[p] + 1), _number(2 * r), _number(density), *map(_number, x)]))
    data += ["", "Velocities", ""]
    for p in range(len(start.radius)):
        data.append(" ".join([str(p + 1), *map(_number, start.velocity[p]), *map(_number, start.angular_velocity[p])]))
    skin = start.radius.min() * 0.5
    lines = [
        "atom_style granular", "atom_modify map array sort 0 0.0", "boundary f f f", "newton off",
        "communicate single vel yes", "units si", *filter(None, head),
        "read_data data.txt", f"neighbor {_number(skin)} bin", "neigh_modify delay 0",
        *[f"fix property{k} all property/global {p}" for k, p in enumerate(properties)],
        f"pair_style gran {style} tangential_damping off", "pair_coeff * *", f"timestep {_number(start.dt)}",
    ]
    for k, (axis, position, _, velocity, material) in enumerate(translate.planes(document)):
        if any(velocity):
            raise Unsupported("liggghts: no translation of moving walls")
        lines.append(f"fix wall{k} all wall/gran {style} primitive type {material + 1} "
                     f"{'xyz'[axis]}plane {_number(position)} tangential_damping off")
    gravity = vector(document.get("integration", {}).get("gravity", [0, 0, 0]))
    size = math.sqrt(sum(g * g for g in gravity))
    if size:
        lines.append(f"fix gravity all gravity {_number(size)} vector " + " ".join(map(_number, gravity)))
    columns = "id x y z vx vy vz omegax omegay omegaz fx fy fz"
    lines += [
        "fix integrate all nve/sphere", f"dump all all custom {interval} dump.txt {columns}",
        'dump_modify all sort id format "%d' + " %.17g" * 12 + '"', "thermo 1000000", f"run {steps}"]
    return "\n".join(data) + "\n", "\n".join(lines) + "\n", steps


def _dump(path, count):
    """Steps and columns of a text dump."""
    steps, frames = [], []
    with open(path) as file:
        for line in file:
            if line.startswith("ITEM: TIMESTEP"):
                steps.append(int(next(file)))
            elif line.startswith("ITEM: ATOMS"):
                rows = np.array([[float(v) for v in next(file).split()] for _ in range(count)])
                frames.append(rows[np.argsort(rows[:, 0]), 1:])
    return np.array(steps), np.array(frames)


class Liggghts:
    """LIGGGHTS on a number of ranks."""

    def __init__(self, name, ranks):
        self.NAME, self.ranks = name, ranks

    version = staticmethod(version)

    def run(self, task, folder, limit):
        data, script, steps = deck(task, self.ranks)
        for change in task.plant.get("liggghts", []):
            script = change(script)
        (folder / "data.txt").write_text(data)
        (folder / "in.txt").write_text(script)
        # `-screen none` crashes this version (quirk liggghts-screen-none); waiting ranks yield to whoever works
        command = ["liggghts", "-in", "in.txt", "-log", "log.liggghts"]
        if self.ranks > 1:
            command = ["mpirun", "-np", str(self.ranks), "--oversubscribe", "--mca", "mpi_yield_when_idle", "1", *command]
        text, wall = process.run(command, folder, limit, {**process.ONE_THREAD, **_MPI})
        if not (folder / "dump.txt").exists():
            raise Crashed("LIGGGHTS ended without a dump (see log.txt)")
        count = len(task.start.radius)
        at, frames = _dump(folder / "dump.txt", count)
        if len(at) == 0 or at[-1] < steps - steps % max(1, at[1] - at[0] if len(at) > 1 else 1):
            raise Crashed("LIGGGHTS ended before the last step (see log.txt)")
        result = Result(self.NAME, task.start.dt)
        for name, unit, columns in (("position", "m", slice(0, 3)), ("velocity", "m/s", slice(3, 6)),
                                    ("angular_velocity", "rad/s", slice(6, 9))):
            result.add(name, at, frames[:, :, columns], unit, "All particles")
        if count == 2 and not task.scenario.get("wall") and not task.scenario.get("integration", {}).get("gravity"):
            result.add("contact_force", at, frames[:, 0, 9:12], "N", "Force of the contact on particle 0")
        result.fields["radius"] = (task.start.radius, "m")
        result.fields["mass"] = (task.start.mass, "kg")
        loop = re.search(r"Loop time of ([\d.eE+-]+)", text)
        wall = float(loop[1]) if loop else wall
        result.numbers.update(wall_s=wall, particles=count, steps=steps,
                              particle_steps_per_s=count * steps / wall if wall else None)
        result.provenance.update(version=version(), command=" ".join(command), velocity_at="full steps",
                                 ranks=str(self.ranks))
        return result


ONE, TWO = Liggghts("liggghts", 1), Liggghts("liggghts-np2", 2)
