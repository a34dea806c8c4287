"""The motion of bonded bodies in place of YADE's NewtonIntegrator, with its bits.

NewtonIntegrator takes some 0.1 µs per body and step, as long as our solver takes for two bonds. A bonded engine with `motion=True` moves its
bodies itself, in YADE's memory, with the settings that NewtonIntegrator has at that time. If the scene has other bodies, NewtonIntegrator
moves those: they get a bit of groupMask, which becomes its `mask`. Otherwise it is set to dead=True.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any, Iterator

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ._concrete import engine_of
from ._memory import address_of
from ._rules import is_a, refuse
from ._scene import gather, host

if TYPE_CHECKING:
    from ._engine import BondedEngine

_REMEDY = "take the bonds over with motion=False, so that YADE moves the bodies"


def free_bit(used: int) -> int:
    """A bit of groupMask that nobody uses."""
    free = [bit for bit in range(30) if not used >> bit & 1]
    if not free:
        raise refuse("all bits of the bodies' groupMask are in use; free one", "Masks")
    return 1 << free[-1]


#: Engines that have nothing to do while all bodies are bonded and move with the bonds.
_IDLE = ("ForceResetter", "InsertionSortCollider", "InteractionLoop", "NewtonIntegrator")
#: Interval of the checks of a bonded engine, steps.
_CHECKS = 64


def _observers(engines: list[Any], place: int) -> list[tuple[Any, bool]] | None:
    others = [
        (engine, k > place)
        for k, engine in enumerate(engines)
        if k != place and not engine.dead and type(engine).__name__ not in _IDLE
    ]
    return others if all(is_a(engine, "PeriodicEngine") for engine, _ in others) else None


def _due(engine: Any, now: int, dt: float) -> int | None:
    """The next step in which a PeriodicEngine may act; None if none is foreseen. A period of real time ends while a step is computed."""
    if 0 <= engine.nDo <= engine.nDone:
        return None
    if engine.nDone == 0:
        return now
    steps = []
    if engine.iterPeriod > 0:
        steps.append(engine.iterLast + engine.iterPeriod)
    if engine.virtPeriod > 0:
        # One step early, because YADE adds up the time with rounding.
        steps.append(now + int((engine.virtPeriod - (host().omega.time - engine.virtLast)) / dt) - 1)
    return max(min(steps), now) if steps else None


def only_integrator(engines: list[Any]) -> Any:
    """The only NewtonIntegrator of these engines, dead or not."""
    found = [engine for engine in engines if is_a(engine, "NewtonIntegrator")]
    if len(found) != 1:
        raise refuse(f"O.engines has {len(found)} engines NewtonIntegrator; keep exactly one", "Engines")
    return found[0]


def _set_dead(newton: Any, dead: bool) -> None:
    """Stop the integrator, or start it. Its own attribute refuses that a script does so while a bonded engine moves the bodies."""
    host().wrapper.Engine.dead.fset(newton, dead)


class Motion:
    """Moves the bodies of an engine."""

    def __init__(self, engine: BondedEngine) -> None:
        self._engine = engine
        #: The integrator that the engine replaces; None before the start.
        self._newton: Any = None
        #: Engines of O.engines that run now and then, each with whether it comes after the bonded engine; None if another one acts in every step.
        self._observers: list[tuple[Any, bool]] | None = None
        #: Bit of groupMask of the bodies that NewtonIntegrator moves; 0 if there are none.
        self._bit = 0

    @property
    def active(self) -> bool:
        """Whether the engine moves its bodies."""
        return self._newton is not None

    def begin(self) -> None:
        """Take the bodies from NewtonIntegrator. Raises YadeError if they would move otherwise than in YADE."""
        self._refuse_step_under_way("start")
        newton = engine_of("NewtonIntegrator")
        # Use the dictionary, because reading the attribute prints a warning.
        if newton.dict().get("densityScaling") or newton.mask != -1:
            raise refuse(f"motion=True does not support densityScaling and mask of NewtonIntegrator; unset them, or {_REMEDY}", "Motion")
        omega = host().omega
        for number in self._engine.ids:
            if not omega.bodies[int(number)].isStandalone:
                raise refuse(f"body {int(number)} belongs to a clump, which NewtonIntegrator moves; {_REMEDY}", "Motion")
        engines = list(omega.engines)
        self.check()
        self._refuse_between(engines, next(k for k, engine in enumerate(engines) if is_a(engine, "InteractionLoop")))
        self._newton = newton
        self._share()

    def resume(self, bit: int) -> None:
        """Go on in a scene that was saved with `bit`."""
        self._newton, self._bit = only_integrator(host().omega.engines), bit
        self.check()
        self._share()

    @property
    def bit(self) -> int:
        """Bit of groupMask of the bodies that NewtonIntegrator moves; 0 if there are none."""
        return self._bit

    def end(self) -> None:
        """Let NewtonIntegrator move the bodies again."""
        self._refuse_step_under_way("end")
        self._engine.solver.move_bodies(None)
        _set_dead(self._newton, False)
        if self._bit:
            self._newton.mask = -1
            for body in host().omega.bodies:
                if body is not None:
                    body.groupMask &= ~self._bit
            self._bit = 0
        self._newton = None

    def _refuse_step_under_way(self, what: str) -> None:
        if host().omega.subStep >= 0:
            raise refuse(
                f"motion=True cannot {what} within a step, in which the bodies would move twice or not at all; call this between two steps, "
                f"not from a PyRunner, or {_REMEDY}",
                "Motion",
            )

    @contextlib.contextmanager
    def suspended(self) -> Iterator[None]:
        """Within this, NewtonIntegrator looks as without `motion=True`. No step is possible."""
        before = self._newton.dead, self._newton.mask
        _set_dead(self._newton, False)
        self._newton.mask = -1
        try:
            yield
        finally:
            _set_dead(self._newton, before[0])
            self._newton.mask = before[1]

    def check(self) -> None:
        """Raise YadeError if YADE would do more in a step than this."""
        omega = host().omega
        if omega.periodic:
            raise refuse(f"motion=True does not support periodic scenes; {_REMEDY}", "Motion")
        if omega.trackEnergy:
            raise refuse(f"with motion=True, O.energy would lack the energies of the bonded bodies; set O.trackEnergy = False, or {_REMEDY}", "Motion")
        layout = host().layout
        aspherical = gather(self._engine._bodies, "Body.flags", "i32") & layout["Body.aspherical"] != 0
        if aspherical.any():
            raise refuse(f"body {int(self._engine.ids[aspherical][0])} is aspherical; set aspherical=False, or {_REMEDY}", "Motion")

    def check_engines(self, engines: list[Any], place: int) -> None:
        """Raise YadeError unless the bodies may be moved in the engine at `place` instead of NewtonIntegrator."""
        newton = only_integrator(engines)
        if address_of(newton) != address_of(self._newton):
            raise refuse(
                "O.engines has another NewtonIntegrator than at the take-over, which would move the bonded bodies a second time; keep the old one "
                f"and change its attributes, or {_REMEDY}",
                "Motion",
            )
        self._refuse_between(engines, place)
        self._observers = _observers(engines, place)
        if newton.dead == bool(self._bit) or newton.mask != (self._bit or -1):
            wanted = f"mask={self._bit}, dead=False" if self._bit else "dead=True"
            raise refuse(
                f"NewtonIntegrator has mask={newton.mask}, dead={newton.dead}, so the bonded bodies would move twice, or others not at all; "
                f"the bonded engine moves them: set {wanted}, or {_REMEDY}",
                "Motion",
            )

    def _refuse_between(self, engines: list[Any], place: int) -> None:
        between = [engine for engine in engines[place + 1 : engines.index(only_integrator(engines))] if not engine.dead]
        if between:
            raise refuse(
                f"O.engines has {type(between[0]).__name__} between the bonded engine and NewtonIntegrator, and the bodies would move before it; "
                f"put it in front of InteractionLoop or behind NewtonIntegrator, or {_REMEDY}",
                "Motion",
            )

    def steps_at_once(self, now: int, dt: float) -> int:
        """Number of steps from the present one on in which nothing but the bonds acts, at most until the next multiple of 64 (for the checks).

        Only in a run: `O.step()` is one step. Engines that derive from PeriodicEngine (PyRunner, VTKRecorder, ...) see the steps in which they
        are due.
        """
        omega = host().omega
        most = _CHECKS - now % _CHECKS
        if self._bit or self._observers is None or not omega.running or omega.subStepping or omega.stopAtTime > 0:
            return 1
        # A step alone finds that a script has made the scene periodic, and adds permanent forces.
        if omega.periodic or omega.forces.getPermForceUsed():
            return 1
        if omega.stopAtIter > now:
            most = min(most, omega.stopAtIter - now)
        for engine, is_after in self._observers:
            due = _due(engine, now, dt)
            if due is not None:
                most = min(most, due - now + is_after)
        return max(most, 1)

    def adopt(self) -> None:
        """Let NewtonIntegrator move bodies that were created since."""
        if self._engine.solver.body_count != self._count:
            self._share()

    def _share(self) -> None:
        """Divide the bodies between NewtonIntegrator and the engine."""
        newton, bodies = self._newton, self._other_bodies()
        if len(bodies):
            self._mark(bodies)
            _set_dead(newton, False)
            newton.mask = self._bit
        else:
            _set_dead(newton, True)
            # The collider reads here how far bodies have moved, and searches in every step if it is 0 or above 1. It has nothing to find.
            newton.maxVelocitySq = 0.5
        layout = host().layout
        state = {name: layout[f"State.{name}"] for name in ("mass", "inertia")}
        self._count = self._engine.solver.move_bodies(
            {
                **state,
                "is_damped": layout["State.isDamped"],
                "newton": address_of(newton),
                "damping": layout["NewtonIntegrator.damping"],
                "gravity": layout["NewtonIntegrator.gravity"],
                "damp_gravity": layout["NewtonIntegrator.dampGravity"],
                "mask": layout["NewtonIntegrator.mask"],
                "dead": layout["Engine.dead"],
                "bound": layout["Body.bound"],
                "reference": layout["Bound.refPos"],
                "sweep": layout["Bound.sweepLength"],
                "expected_mask": int(newton.mask),
                "expected_dead": bool(newton.dead),
                "others": bool(self._bit),
            }
        )

    def _other_bodies(self) -> NDArray[np.int64]:
        """Ids of the bodies that NewtonIntegrator moves."""
        every = _core.memory_targets(self._engine._container + host().layout["bodies.vector"])
        others = every != 0
        others[self._engine.ids] = False
        return np.flatnonzero(others)

    def _mark(self, numbers: NDArray[np.int64]) -> None:
        omega = host().omega
        others = [omega.bodies[int(number)] for number in numbers]
        masks = {body.groupMask & ~self._bit for body in others}
        apart = [(one, two) for one in masks for two in masks if not one & two]
        if apart:
            raise refuse(
                f"bodies with groupMask {apart[0][0]} and {apart[0][1]} do not touch each other, but would with the common bit that motion=True "
                f"gives them; {_REMEDY}",
                "Motion",
            )
        if not self._bit:
            used = engine_of("InsertionSortCollider").avoidSelfInteractionMask
            for body in omega.bodies:
                if body is not None:
                    used |= body.groupMask
            self._bit = free_bit(used)
        for body in others:
            body.groupMask |= self._bit
