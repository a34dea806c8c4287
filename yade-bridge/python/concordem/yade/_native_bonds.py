"""Methods of `BondedEngine_Rust` that the bonded engine without headers has, too: its bonds as arrays, as interactions of YADE, in files.

Both engines are made from the same code, so this package reads what the plugin saves with a scene: each call copies the bonds.
"""

from __future__ import annotations

import contextlib
import functools
import os
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._errors import YadeError
from .._types import Contacts
from . import _hooks, _interactions, _vtk
from ._concrete import add_to_lost, scatter, write_states
from ._memory import address_of, known_address_of
from ._mirror import Mirror
from ._own import STORED, damage
from ._rules import refuse
from ._scene import Reals, bodies, gather, host, of_class
from ._scene import interactions as interactions_of_yade

#: Addresses of the engines whose bonds are shown as interactions.
_shown: set[int] = set()
#: The bonds as objects of YADE, by address of the engine.
_mirrors: dict[int, Mirror] = {}
_hooks.forgetters.append(_mirrors.clear)


def is_shown(engine: Any) -> bool:
    """Whether the bonds of a `BondedEngine_Rust` are in O.interactions now."""
    return bool(_shown) and address_of(engine) in _shown


class NativeBonds:
    """A `BondedEngine_Rust` and a copy of its bonds."""

    def __init__(self, engine: Any) -> None:
        follow(engine)
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
        update_lost(self._native)

    def hand_over_objects(self) -> None:
        """Let the objects that a script has kept share what YADE has got."""
        found = _mirrors.get(address_of(self._native))
        if found is not None:
            found.hand_over()

    def _take_out(self) -> None:
        """The engine ends when the bonds are in O.interactions: until then they would be lost by an error."""

    def _put_in(self) -> None:
        """The engine was not taken out."""

    def _release(self) -> None:
        self._native.release()

    def _as_yades(self) -> contextlib.AbstractContextManager[None]:
        return contextlib.nullcontext()


def mirror(engine: Any) -> Mirror:
    """The bonds of a `BondedEngine_Rust` as objects of YADE."""
    address = address_of(engine)
    if address not in _mirrors:

        def here() -> Any:
            # Not the object of Python, which would keep the engine alive.
            return next(e for e in host().omega.engines if address_of(e) == address)

        def moment() -> Any:
            now = here()
            return known_address_of(host().omega._sceneObj), host().omega.iter, now.steps, now.broken

        _mirrors[address] = Mirror(lambda: NativeBonds(here()), moment)
    return _mirrors[address]


def follow(engine: Any) -> bool:
    """Let the engine have what a script has changed or erased in O.interactions: give the bonds back to YADE, change them there, and take them
    over. Returns whether it has bonds then."""
    found = _mirrors.get(address_of(engine)) if _mirrors else None
    if found is None or not found.changed():
        return True
    if host().omega.subStep >= 0:
        raise refuse(
            "bonds of BondedEngine_Rust were changed within a step, in which it cannot follow; change them between two steps, not from a PyRunner",
            "Changed",
        )
    wanted, values = found.interactions(), found.values()
    found.followed()
    _interactions.give_back(NativeBonds(engine))
    own, made = host().interactions, interactions_of_yade()
    pairs = {pair: k for k, pair in enumerate(zip(wanted.id1.tolist(), wanted.id2.tolist()))}
    row = [pairs.get((min(one, two), max(one, two)), -1) for one, two in zip(made.id1.tolist(), made.id2.tolist())]
    inside = of_class(made.phys, "CpmPhys.vtable")
    gone = np.flatnonzero(inside & (np.array(row) < 0))
    for k in gone:
        own.erase(int(made.id1[k]), int(made.id2[k]))
    own.eraseNonReal()
    kept = np.flatnonzero(inside & (np.array(row) >= 0))
    place = np.array(row)[kept]
    phys = np.ascontiguousarray(made.phys[kept])
    before = gather(phys, "CpmPhys.kappaD")
    for name, column in values.items():
        if column.dtype == np.float64:
            scatter(phys, f"CpmPhys.{name}", column[place])
    # YADE's law computes damage anew in each step, ours from the strain that grows.
    damaged = np.flatnonzero(values["kappaD"][place] != before)
    stored = np.stack([values[name][place[damaged]].astype(float) for name in STORED], axis=1)
    scatter(phys[damaged], "CpmPhys.omega", damage(stored, values["kappaD"][place[damaged]]))
    for k in kept[values["isCohesive"][place] != gather(made.phys[kept], "CpmPhys.isCohesive", "u8")]:
        contact = own[int(made.id1[k]), int(made.id2[k])]
        contact.phys.isCohesive = not contact.phys.isCohesive
    if not values["isCohesive"].any():
        # It stopped when it gave the bonds back.
        warnings.warn("a script has erased all bonds of BondedEngine_Rust, so it ends, and YADE goes on with the contacts", stacklevel=2)
        return False
    engine.dead = False
    _asked(engine.takeOver)
    return True


def update_lost(engine: Any) -> None:
    """Write to YADE's states how many bonds and contacts their bodies have lost."""
    solver, everything = NativeBonds(engine).solver, bodies()
    state = np.ascontiguousarray(everything.state[np.searchsorted(everything.ids, solver.bodies()["id"])])
    bonds, openings = solver.losses()
    before = gather(state, "CpmState.numBrokenCohesive", "i32")
    add_to_lost(state, (bonds + openings).astype(np.int32) - before)


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
