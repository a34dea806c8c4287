"""A scene of concrete handed to our solver for a while, and back."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .. import _core
from ._concrete import PAUSED, REPLACED, Concrete, add_to_clock, cell_of, class_of, refuse, write_bodies, write_contacts
from ._scene import at_rest, host


class HandedOver(NamedTuple):
    """What happened during a hand-over."""

    steps: int
    """Steps taken by our solver."""
    broken: int
    """Bonds that broke."""
    erased: int
    """Interactions erased in YADE: broken bonds, contacts that opened."""
    made: int
    """Interactions made in YADE: contacts that began."""


def _check_engines(strict: bool) -> None:
    for engine in host().omega.engines:
        name = class_of(engine)
        if engine.dead or name in REPLACED or (name in PAUSED and not strict):
            continue
        raise refuse(
            f"O.engines has {name}, which would not act while our solver advances the scene. Make it dead=True if that is "
            "what you want, or use concordem.yade.take_over, which leaves all engines at work",
            "Engines",
        )


def advance(
    steps: int, kinematics: str | None = None, mode: str = "yade-public", threads: int | None = None
) -> HandedOver:
    """Let our solver take `steps` steps of the live scene of concrete, and write the result back.

    Bodies with blocked degrees of freedom keep their velocity, as in YADE. The periodic cell deforms with its velocity
    gradient. Scripts and recorders (PyRunner, VTKRecorder, ...) pause meanwhile; engines that move or load bodies are
    refused. With the default `kinematics` and `mode` it is YADE's own concrete, to rounding; `kinematics="finite"` with
    `mode="thesis"` is the corrected law, and faster. The result does not depend on the number of threads.
    """
    at_rest()
    if steps < 0:
        raise ValueError(f"steps is {steps}")
    omega = host().omega
    _check_engines(strict=False)
    concrete = Concrete()
    if len(concrete.others.ids):
        raise refuse(
            f"body {int(concrete.others.ids[0])} is no sphere of CpmMat: walls and other bodies cannot be handed over; "
            "concordem.yade.take_over leaves them to YADE",
            "OtherBodies",
        )
    if omega.forces.getPermForceUsed():
        raise refuse("permanent forces (O.forces.setPermF) cannot be handed over", "Forces")
    if any(body.aspherical for body in omega.bodies):
        raise refuse("a body is aspherical")
    solver = concrete.hosted(kinematics or concrete.settings.kinematics, mode, True, threads)
    broken = solver.advance(steps)
    write_bodies(concrete, solver)
    if omega.periodic:
        _write_cell(solver)
    add_to_clock(steps, concrete.settings.dt)
    counts = write_contacts(solver, mode)
    return HandedOver(steps, broken, counts["erased"], counts["made"])


def _write_cell(solver: _core.Hosted) -> None:
    omega = host().omega
    found = solver.cell
    assert found is not None
    # Back by the motion that YADE will make at the beginning of its next step.
    rate = cell_of(omega)[2]
    edges, gradient = (np.linalg.solve(np.eye(3) + omega.dt * rate, part) for part in found)

    def matrix(values: Any) -> Any:
        return host().names.Matrix3(*(float(x) for x in values.reshape(-1)))

    # The order matters: setting hSize leaves the transformation alone, setting trsf leaves hSize.
    omega.cell.hSize = matrix(edges)
    omega.cell.trsf = matrix(gradient)
