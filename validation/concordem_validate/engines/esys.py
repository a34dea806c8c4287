"""ESyS-Particle from Debian (package esys-particle): cohesive beams as its rotational bonds, run by esys_driver.py.

`RotBondPrms` without scaling takes springs along, across, in torsion, and in bending, as the beam's EA/L, 12EI/L³(1+Φ), GJ/L, EI/L;
the one in bending acts on half the angle between the particles (quirk esys-bending-half), so it gets twice. Angles are inverse cosines
as in LAMMPS (quirk lammps-small-angles).
"""
import json
import shutil
from pathlib import Path

import numpy as np

from .. import process, programs
from ..errors import Crashed, NotInstalled, Unsupported
from ..result import Result
from . import translate
from .lammps import beam_springs, small_motion
from .liggghts import MPI

NAME = "esys"
_DRIVER = Path(__file__).with_name("esys_driver.py").read_text()


def version():
    program = shutil.which("esysparticle")
    if not program:
        raise NotInstalled("ESyS-Particle is not installed; run apt install esys-particle")
    # its Python package holds the laws
    package = [p for p in (Path("/usr/lib/python3/dist-packages/esys"), Path(program).parents[1] / "lib/python3/dist-packages/esys") if p.is_dir()]
    return programs.label("esys-particle", program, "--version", package[:1])


def translation(task):
    """The task as plain data."""
    document, start = task.scenario, task.start
    held, velocity, spin = small_motion(NAME, document, start)
    try:
        normal, shear, twist, bending = beam_springs(document, start)
    except Unsupported as error:
        raise Unsupported(f"{NAME}: {error}") from None
    if np.ptp(start.mass) > 0:
        raise Unsupported("esys: all spheres must have the same mass")
    steps = translate.steps_of(document, start.dt)
    return dict(
        position=start.position.tolist(), radius=float(start.radius[0]), mass=float(start.mass[0]), velocity=velocity.tolist(),
        spin=spin.tolist(), held=held, bonds=start.bonds.tolist(), normal=normal, shear=shear, twist=twist, bending=2 * bending,
        dt=start.dt, steps=steps, interval=document.get("output", {}).get("snapshot_interval") or steps)


def run(task, folder, limit):
    data = translation(task)
    for change in task.plant.get(NAME, []):
        change(data)
    (folder / "task.json").write_text(json.dumps(data))
    (folder / "esys_driver.py").write_text(_DRIVER)
    # one master and one worker process
    _, wall = process.run(["mpirun", "-np", "2", "--oversubscribe", "--bind-to", "none", "esysparticle", "esys_driver.py"], folder, limit,
                          {**process.ONE_THREAD, **MPI})
    if not (folder / "out.json").exists():
        raise Crashed("ESyS-Particle ended without a result (see log.txt)")
    out = json.loads((folder / "out.json").read_text())
    result = Result(NAME, task.start.dt)
    for name, unit in (("position", "m"), ("velocity", "m/s"), ("angular_velocity", "rad/s")):
        result.add(name, out["step"], out[name], unit, "All particles")
    result.fields["mass"] = (out["mass"], "kg")
    result.numbers.update(wall_s=wall, particles=len(task.start.radius), steps=data["steps"],
                          particle_steps_per_s=len(task.start.radius) * data["steps"] / wall)
    result.provenance.update(version=version(), command="mpirun -np 2 esysparticle esys_driver.py", velocity_at="half steps", ranks="1")
    return result
