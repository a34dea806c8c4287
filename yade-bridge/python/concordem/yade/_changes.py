"""What a script may change in interactions with an effect on the bonds, and whether it did."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from . import _histories
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


class Rows(NamedTuple):
    """Attributes of objects as bytes, because a value that is not a number equals itself."""

    fields: tuple[tuple[str, int], ...]
    """Names, with their numbers of bytes."""
    bytes: NDArray[np.uint8]
    """One row per object."""

    def of(self, keep: NDArray[np.bool_]) -> Rows:
        """The selected objects."""
        return Rows(self.fields, np.ascontiguousarray(self.bytes[keep]))


_SIZES = {"f64": 8, "i32": 4, "u8": 1}


#: What is watched in an interaction, and in physics of other laws than concrete.
_CONTACT = (("geom", 8), ("phys", 8), ("cellDist", 12), ("isActive", 1))
_FORCES = (("normalForce", 24), ("shearForce", 24))
_CONCRETE = tuple((name, _SIZES[kind] * width) for name, (kind, width) in _READ.items())


def of_contacts(address: Addresses) -> Rows:
    """What a script may change with an effect in interactions."""
    offsets = {**host().layout, "Interaction.isActive": _active_offset()}
    return Rows(_CONTACT, _core.memory_rows(address, [(offsets[f"Interaction.{name}"], size) for name, size in _CONTACT]))


def places_in_physics(kind: str) -> list[tuple[int, int]]:
    """Offsets and numbers of bytes of what a script may change with an effect in physics; of laws that YADE does not have, the forces. `kind`: of
    the bonded engine."""
    if kind in _histories.LAWS:
        return _histories.places(kind)
    return [(host().layout[f"CpmPhys.{name}"], size) for name, size in (_CONCRETE if kind == "concrete" else _FORCES)]


def of_physics(found: NDArray[np.uint8], kind: str) -> Rows:
    """What was read at :func:`places_in_physics`."""
    if kind in _histories.LAWS:
        return Rows(_histories.LAWS[kind].watched(), found)
    return Rows(_CONCRETE if kind == "concrete" else _FORCES, found)


def of_geometry(geom: Addresses, kind: str) -> list[Rows]:
    """What a script may change with an effect in the geometry."""
    found = _histories.LAWS[kind].rows_of_geometry(geom) if kind in _histories.LAWS else None
    return [Rows(*found)] if found is not None else []


def everything(address: Addresses, geom: Addresses, phys: Addresses, kind: str) -> list[Rows]:
    """What a script may change with an effect."""
    physics = of_physics(_core.memory_rows(phys, places_in_physics(kind)), kind)
    return [of_contacts(address), physics, *of_geometry(geom, kind)]


def between(before: list[Rows], now: list[Rows]) -> dict[str, int]:
    """The names whose values differ, with the first row of each."""
    found = {}
    for old, new in zip(before, now):
        if np.array_equal(old.bytes, new.bytes):
            continue
        at = 0
        for name, size in old.fields:
            differ = (old.bytes[:, at : at + size] != new.bytes[:, at : at + size]).any(axis=1)
            at += size
            if differ.any():
                found[name] = int(np.flatnonzero(differ)[0])
    return found
