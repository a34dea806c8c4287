"""Hand-over: our solver computes steps of a concrete scene and writes it back."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .. import _core
from ._concrete import PAUSED, REPLACED, Concrete, add_to_clock, cell_of, class_of, write_bodies, write_contacts
from ._rules import refuse
from ._scene import at_rest, host


class HandedOver(NamedTuple):
    """Result of a hand-over."""

    steps: int
    """Number of steps."""
    broken: int
    """Number of bonds that broke."""
    erased: int
    """Number of interactions erased in YADE: broken bonds and opened contacts."""
    made: int
    """Number of interactions created in YADE: new contacts."""


def _check_engines(strict: bool) -> None:
    for engine in host().omega.engines:
        name = class_of(engine)
        if engine.dead or name in REPLACED or (name in PAUSED and not strict):
            continue
        raise refuse(
            f"O.engines has {name}, which does not run during a hand-over; set dead=True if that is intended, or use "
            "concordem.yade.take_over, with which all engines run",
            "Engines",
        )


def advance(
    steps: int, kinematics: str | None = None, mode: str = "yade-public", threads: int | None = None
) -> HandedOver:
    """Compute `steps` steps of a concrete scene with our solver and write the result back to YADE.

    Bodies with blocked degrees of freedom keep their velocity, as in YADE. Clumps of spheres move as rigid bodies. The periodic cell deforms with its velocity gradient.
    Scripts and recorders (PyRunner, VTKRecorder, ...) do not run meanwhile; engines that move or load bodies raise YadeError. The
    default `kinematics` and `mode` reproduce YADE's law up to rounding; `kinematics="finite"` with `mode="thesis"` is the corrected
    law, and faster. The result does not depend on the number of threads. Raises YadeError if the scene is not supported.
    """
    at_rest()
    if steps < 0:
        raise ValueError(f"steps is {steps}; give 0 or more")
    omega = host().omega
    _check_engines(strict=False)
    concrete = Concrete()
    clumps = {body.id for body in concrete.clumps.bodies}
    others = [int(number) for number in concrete.others.ids if int(number) not in clumps]
    if others:
        raise refuse(
            f"body {others[0]} is not a sphere of CpmMat, and only these can be handed over; use "
            "concordem.yade.take_over, which supports other bodies",
            "OtherBodies",
        )
    if omega.forces.getPermForceUsed():
        raise refuse("permanent forces (O.forces.setPermF) cannot be handed over; use concordem.yade.take_over", "Forces")
    for body in omega.bodies:
        if body is None:
            continue
        if body.aspherical and not body.isClump:
            raise refuse(f"body {body.id} is aspherical; set aspherical=False")
        if concrete.settings.damping and not body.state.isDamped:
            raise refuse(f"body {body.id} has isDamped=False, and our solver damps all bodies; use concordem.yade.take_over")
    concrete.clumps.refuse_motion(concrete.settings.newton, omega.periodic)
    solver = concrete.hosted(kinematics or concrete.settings.kinematics, mode, True, threads)
    broken = solver.advance(steps)
    write_bodies(concrete, solver)
    if omega.periodic:
        _write_cell(solver)
    add_to_clock(steps, concrete.settings.dt)
    counts = write_contacts(solver, {})
    return HandedOver(steps, broken, counts["erased"], counts["made"])


def _write_cell(solver: _core.Hosted) -> None:
    omega = host().omega
    found = solver.cell
    assert found is not None
    # Subtract the motion of the cell at the beginning of YADE's next step.
    rate = cell_of(omega)[2]
    edges, gradient = (np.linalg.solve(np.eye(3) + omega.dt * rate, part) for part in found)

    def matrix(values: Any) -> Any:
        return host().names.Matrix3(*(float(x) for x in values.reshape(-1)))

    # Setting hSize does not change trsf, and setting trsf does not change hSize.
    omega.cell.hSize = matrix(edges)
    omega.cell.trsf = matrix(gradient)
