"""Rigid clumps of a scene: to our solver, and back."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ._memory import pack_mask
from ._rules import refuse
from ._scene import Ints, host


def _turned(orientation: Any, rotation: Any) -> Any:
    """The orientation after a rotation by this vector (rad)."""
    angle = rotation.norm()
    return type(orientation)(rotation / angle, angle) * orientation if angle else orientation


class Clumps:
    """The clumps with members among some spheres. `ids`: of these spheres, one per row of the arrays for our solver."""

    def __init__(self, ids: Ints) -> None:
        omega = host().omega
        row = {int(number): k for k, number in enumerate(ids)}
        #: Bodies of the clumps, which have no shape of their own.
        self.bodies: list[Any] = []
        #: Members that are not among the spheres, with their clump.
        self.foreign: list[tuple[int, int]] = []
        self._members: list[tuple[int, int, Any, Any]] = []
        for body in omega.bodies:
            if body is None or not body.isClump:
                continue
            members = body.shape.members
            mine = {number: place for number, place in members.items() if number in row}
            if not mine:
                continue
            self.foreign += [(int(number), int(body.id)) for number in members if number not in mine]
            self._members += [(row[number], len(self.bodies), *mine[number]) for number in sorted(mine)]
            self.bodies.append(body)

    def refuse_motion(self, newton: Any, periodic: bool) -> None:
        """Raise YadeError if our solver cannot move the clumps as YADE does."""
        if self.bodies and periodic and any(any(row) for row in host().omega.cell.velGrad):
            raise refuse("clumps in a periodic cell that deforms cannot be handed over; use concordem.yade.take_over", "Clumps")
        if self.foreign:
            member, clump = self.foreign[0]
            raise refuse(
                f"body {member} in clump {clump} is not a sphere of CpmMat, and only these can be handed over; use "
                "concordem.yade.take_over",
                "Clumps",
            )
        for body in self.bodies:
            moments, blocked = body.state.inertia, pack_mask(body.state.blockedDOFs) >> 3
            if blocked and not (blocked == 7 and body.state.angVel.norm() == 0):
                raise refuse(
                    f"clump {body.id} has blocked rotations ({body.state.blockedDOFs}), and only clumps without, or with all blocked and "
                    "no angular velocity, can be handed over; use concordem.yade.take_over",
                    "Clumps",
                )
            unequal = not moments[0] == moments[1] == moments[2]
            if unequal and not blocked and not (body.aspherical and newton.exactAsphericalRot):
                raise refuse(
                    f"clump {body.id} has different moments of inertia, but YADE rotates it as a sphere (aspherical or "
                    "NewtonIntegrator.exactAsphericalRot is False), which our solver does not; set both to True",
                    "Clumps",
                )

    def arrays(self, newton: Any, dt: float) -> dict[str, Any]:
        """The arrays for `Hosted.concrete`."""
        states = [body.state for body in self.bodies]

        def rows(values: list[Any], width: int) -> Any:
            return np.array([[value[k] for k in range(width)] for value in values], float).reshape(-1, width)

        return {
            "position": rows([state.pos for state in states], 3),
            "velocity": rows([state.vel for state in states], 3),
            "orientation": rows([state.ori for state in states], 4),
            "angular_momentum": rows([_angular_momentum(body, newton, dt) for body in self.bodies], 3),
            "mass": np.array([state.mass for state in states], float),
            "inertia": rows([state.inertia for state in states], 3),
            "constraint": np.array([pack_mask(state.blockedDOFs) for state in states], np.uint32),
            "member": np.array([member[0] for member in self._members], np.uint32),
            "of": np.array([member[1] for member in self._members], np.uint32),
            "offset": rows([member[2] for member in self._members], 3),
            "relative": rows([member[3] for member in self._members], 4),
        }

    def write(self, solver: _core.Hosted) -> None:
        """Write the motion of the clumps back to YADE; that of the members is written with the spheres."""
        if not self.bodies:
            return
        now = {name: values.tolist() for name, values in solver.clumps().items()}
        for k, body in enumerate(self.bodies):
            state = body.state
            vector, quaternion = type(state.pos), type(state.ori)
            x, y, z, w = now["orientation"][k]
            state.pos, state.vel = vector(*now["position"][k]), vector(*now["velocity"][k])
            state.ori = quaternion(w, x, y, z)
            # YADE's integrators keep one of these, depending on the version.
            state.angVel, state.angMom = vector(*now["angular_velocity"][k]), vector(*now["angular_momentum"][k])


def _angular_momentum(body: Any, newton: Any, dt: float) -> Any:
    """Angular momentum of a clump half a step ago, kg m^2/s, world axes."""
    state = body.state
    exact = body.aspherical and newton.exactAsphericalRot and not pack_mask(state.blockedDOFs) >> 3
    if exact and "Fincham" in str(getattr(newton, "rotAlgorithm", "Fincham1992")):
        return state.angMom
    # YADE keeps the angular velocity of the half step. Its last step rotated the clump about that vector.
    middle = _turned(state.ori, state.angVel * (-0.5 * dt))
    spin = middle.conjugate() * state.angVel
    return middle * type(spin)(*(spin[k] * state.inertia[k] for k in range(3)))
