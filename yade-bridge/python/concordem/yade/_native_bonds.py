"""Methods of `BondedEngine_Rust` that the bonded engine without headers has, too: its bonds as arrays, as interactions of YADE, in files.

Both engines are made from the same code, so this package reads what the plugin saves with a scene: each call copies the bonds.
"""

from __future__ import annotations

import contextlib
import functools
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._errors import YadeError
from .._types import Contacts
from . import _interactions, _vtk
from ._concrete import write_states
from ._memory import address_of
from ._rules import refuse
from ._scene import Reals, host

#: Addresses of the engines whose bonds are shown as interactions.
_shown: set[int] = set()


def is_shown(engine: Any) -> bool:
    """Whether the bonds of a `BondedEngine_Rust` are in O.interactions now."""
    return bool(_shown) and address_of(engine) in _shown


class NativeBonds:
    """A `BondedEngine_Rust` and a copy of its bonds."""

    def __init__(self, engine: Any) -> None:
        self._native = engine
        self.name = engine.label or "BondedEngine_Rust"
        self._kind = {"kind": "scenario" if engine.scenario else "concrete", "mode": engine.mode}
        self._placed = True
        self._next = host().omega.iter + 1
        self._update_states = int(engine.updateStates)

    @functools.cached_property
    def solver(self) -> _core.Hosted:
        """The copy."""
        return _core.Hosted.of_words(_asked(self._native.words), host().omega.numThreads)

    @functools.cached_property
    def ids(self) -> NDArray[np.int32]:
        """Ids of the bodies."""
        return np.asarray(self.solver.bodies()["id"], np.int32)

    @property
    def _shown(self) -> bool:
        return is_shown(self._native)

    @_shown.setter
    def _shown(self, shown: bool) -> None:
        (_shown.add if shown else _shown.discard)(address_of(self._native))

    def check(self, deep: bool) -> None:
        """Raise YadeError unless the scene is as the engine needs it."""
        _asked(self._native.check)

    def update_states(self) -> None:
        """Write CpmState."""
        write_states(self.solver)

    def _take_out(self) -> None:
        """The engine ends when the bonds are in O.interactions: until then they would be lost by an error."""

    def _put_in(self) -> None:
        """The engine was not taken out."""

    def _release(self) -> None:
        self._native.release()

    def _as_yades(self) -> contextlib.AbstractContextManager[None]:
        return contextlib.nullcontext()


def _asked(function: Any) -> Any:
    """What a function of the engine returns, or its error as a YadeError."""
    try:
        return function()
    except RuntimeError as error:
        raise YadeError(str(error), "Scene") from None


def contacts(engine: Any) -> dict[str, NDArray[np.void]]:
    """As :meth:`concordem.yade.BondedEngine.contacts`."""
    return NativeBonds(engine).solver.contacts()


def forces(engine: Any) -> tuple[Reals, Contacts]:
    """As :meth:`concordem.yade.BondedEngine.forces`, with the positions of the last step."""
    return NativeBonds(engine).solver.forces(False)


def temperatures(engine: Any) -> tuple[NDArray[np.uint32], Reals]:
    """As :meth:`concordem.yade.BondedEngine.temperatures`."""
    solver = NativeBonds(engine).solver
    found = solver.temperatures
    if found is None:
        raise ValueError("no heat flows; give a scenario with [heat]")
    return solver.bodies()["id"], found


def interactions(engine: Any) -> contextlib.AbstractContextManager[None]:
    """As :meth:`concordem.yade.BondedEngine.interactions`."""
    return _interactions.shown(NativeBonds(engine))


def give_back(engine: Any) -> dict[str, int]:
    """As :meth:`concordem.yade.BondedEngine.give_back`, between two steps."""
    if host().omega.subStep >= 0:
        raise refuse("give_back() cannot be called within a step; call it between two steps, not from a PyRunner", "EngineOrder")
    return _interactions.give_back(NativeBonds(engine))


def write_vtk(engine: Any, prefix: str | os.PathLike[str]) -> list[str]:
    """As :meth:`concordem.yade.BondedEngine.write_vtk`."""
    return _vtk.write(NativeBonds(engine), os.fspath(prefix))


def add_methods(made: Any) -> None:
    """Add these methods to the class of the plugin."""
    for method in (contacts, forces, temperatures, interactions, give_back, write_vtk):
        setattr(made, method.__name__, method)
