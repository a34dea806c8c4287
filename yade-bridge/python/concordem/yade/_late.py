"""Bonds that YADE makes after the take-over: bodies settle first and are bonded then, or the script bonds more of them later.

Only YADE makes bonds: contacts that begin before `cohesiveThresholdIter`, or at a distance with an `interactionDetectionFactor` above 1. While it
does, all contacts are YADE's and follow its law, and the bonded engine waits: it gives its bonds back when the script sets one of the two, and
takes all of them over once the last ones have been made.
"""

from __future__ import annotations

import functools
import warnings
from typing import TYPE_CHECKING, Any, NoReturn

from . import _hooks, _interactions
from ._rules import late, refuse
from ._scene import at_rest, host

if TYPE_CHECKING:
    from ._engine import BondedEngine


def _next_contacts() -> int:
    """The iteration in which contacts begin next, if the engine has acted in a step that is under way."""
    omega = host().omega
    return int(omega.iter) + int(omega.subStep >= 0)


def why() -> str:
    """Why YADE makes bonds from now on; empty if it does not."""
    return late(host().omega.engines, _next_contacts())


def tell(engine: BondedEngine) -> None:
    """Warn that a take-over waits."""
    warnings.warn(f"take_over(): {why()}, so YADE computes all contacts until then; {engine._title} has the bonds from then on", stacklevel=3)


def refuse_waiting(what: str) -> NoReturn:
    """Raise YadeError: the bonds of an engine that waits are YADE's."""
    raise refuse(f"{what} has no bonds now: {why() or 'it takes them over in the next step'}; until then they are in O.interactions", "Waits")


def may_begin(engine: BondedEngine) -> bool:
    """Whether the bonds can be given back now: between two steps, or in a step in which the engine has acted."""
    omega = host().omega
    return bool(omega.subStep < 0 or engine._next > omega.iter)


def begin(engine: BondedEngine) -> None:
    """Give the bonds back to YADE, which makes more of them, and wait."""
    if engine._kind.get("motion"):
        raise refuse(
            f"{why()}, but {engine._title} with motion=True cannot wait for more bonds, because it starts between two runs; call give_back() before, and "
            "take_over() after that, or take over with motion=False",
            "Changed",
        )
    broken = engine.broken
    _interactions.hand_over(engine)
    engine._wait(broken)


def end_if_due(engine: BondedEngine) -> None:
    """Take the bonds over if YADE has made the last one."""
    if why():
        return
    from ._take_over import take_over_late

    if not take_over_late(engine):
        warnings.warn(f"YADE has made no bonds, so {engine._title} ends, and YADE goes on without it", stacklevel=2)
        engine.remove()


def _changed_by_script(engine: Any) -> None:
    """Follow a change of one of the two attributes at once: what a check finds later would be too late in a run by single steps."""
    if engine.is_concrete and hasattr(engine, "_waits") and not engine._waits and not engine._shown and why():
        at_rest()
        if not may_begin(engine):
            raise refuse(
                f"{why()}, but {engine._title} has not acted in this step; set it between two steps, or from a PyRunner behind NewtonIntegrator", "EngineOrder"
            )
        engine.check(deep=True)


def install(wrapper: Any) -> None:
    """Let bonded engines follow the two attributes."""
    for kind, name in ((wrapper.Ip2_CpmMat_CpmMat_CpmPhys, "cohesiveThresholdIter"), (wrapper.Ig2_Sphere_Sphere_ScGeom, "interactionDetectionFactor")):
        setattr(kind, name, _followed(getattr(kind, name)))


_hooks.installers.append(install)


def _followed(attribute: Any) -> property:
    @functools.wraps(attribute.fset)
    def put(self: Any, value: Any) -> None:
        before = attribute.fget(self)
        attribute.fset(self, value)
        try:
            for engine in _hooks.bonded():
                _changed_by_script(engine)
        except Exception:
            # Else the next step would be wrong.
            attribute.fset(self, before)
            raise

    return property(attribute.fget, put, None, attribute.__doc__)
