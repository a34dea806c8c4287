"""What a script may change in interactions with an effect on the bonds, and whether it did."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from .. import _core
from ._memory import flag_offset
from ._own import STORED
from ._scene import Addresses, gather, host

#: Attributes of the physics that YADE's law reads in its next step, with their types and components. All others are either set by the law
#: in every step, or read by nothing.
_HISTORY = {"kappaD": ("f64", 1), "epsNPl": ("f64", 1), "epsT": ("f64", 3), "epsTPl": ("f64", 3), "isCohesive": ("u8", 1)}
_CONSTANTS = {name: ("f64", 1) for name in ("refLength", "crossSection", "refPD")}
_READ = {**_HISTORY, **_CONSTANTS, **{name: (kind, 1) for name, kind in STORED.items()}}


@functools.cache
def _active_offset() -> int:
    """Offset of `Interaction.isActive`."""
    contact = host().wrapper.Interaction()
    return flag_offset("Interaction", "isActive", contact, functools.partial(setattr, contact, "isActive"))


def values(phys: Addresses) -> dict[str, Any]:
    """Attributes of the physics of concrete that the law reads, row by row."""
    return {name: gather(phys, f"CpmPhys.{name}", kind, width) for name, (kind, width) in _READ.items()}


def everything(address: Addresses, phys: Addresses, concrete: bool) -> dict[str, Any]:
    """What a script may change with an effect, row by row; of other laws than concrete, the forces."""
    return {
        "geom": gather(address, "Interaction.geom", "u64"),
        "phys": gather(address, "Interaction.phys", "u64"),
        "cellDist": gather(address, "Interaction.cellDist", "i32", 3),
        "isActive": _core.memory_gather(address, _active_offset(), "u8", 1),
        **(values(phys) if concrete else {name: gather(phys, f"CpmPhys.{name}", components=3) for name in ("normalForce", "shearForce")}),
    }


def between(before: dict[str, Any], now: dict[str, Any]) -> dict[str, int]:
    """The names whose values differ, with the first row of each."""
    found = {}
    for name, column in before.items():
        # Bytes, because a value that is not a number equals itself.
        one, two = (np.ascontiguousarray(part).view(np.uint8).reshape(len(part), -1) if len(part) else part for part in (column, now[name]))
        differ = one != two
        if differ.any():
            found[name] = int(np.flatnonzero(differ.any(axis=1))[0])
    return found
