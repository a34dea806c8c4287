"""Finds where YADE stores the fields of the physics and geometry of contacts with histories, in objects of its own: no scene is needed."""

from __future__ import annotations

import ctypes
import functools
from typing import Any, Sequence

from .._errors import YadeError
from ._memory import Finder, address_of, flag_offset, memory, pack_real, usable_size
from ._scene import host

#: Attributes of ScGeom6D beyond those of ScGeom, which Python can only read, and their numbers of reals.
GEOMETRY = {"initialOrientation1": 4, "initialOrientation2": 4, "twistCreep": 4, "twist": 1, "bending": 3}


@functools.cache
def add_physics(kind: str, reals: Sequence[str], vectors: Sequence[str], flags: Sequence[str]) -> None:
    """Add the offsets of these attributes of a class of physics to the layout of YADE's objects; a version may lack some reals. Once per class.

    Raises YadeError if a field is not found.
    """
    physics, finder = getattr(host().wrapper, kind)(), Finder(kind)
    address = address_of(physics)
    names = [name for name in reals if hasattr(physics, name)]
    for k in range(1, 4):
        for place, name in enumerate(names):
            setattr(physics, name, 1.25 * k + 17.0 * place)
        for place, name in enumerate(vectors):
            setattr(physics, name, host().names.Vector3(1000.5 * k, 7.0 * place + k, -3.0 * k))
        for name in (*names, *vectors):
            finder.observe(name, address, pack_real(getattr(physics, name)), 8)
    found = {f"{kind}.{name}": finder.offset(name) for name in (*names, *vectors)}
    for name in flags:
        try:
            found[f"{kind}.{name}"] = flag_offset(kind, name, physics, functools.partial(setattr, physics, name))
        except AttributeError:
            found[f"{kind}.{name}"] = _flag_to_read(kind, physics, name)
    found[f"{kind}.vtable"] = memory.pointer(address)
    host().layout.update(found)


def _flag_to_read(kind: str, physics: Any, name: str) -> int:
    """Offset of a flag that is set and that Python can only read: clear each byte that is 1 for a moment."""
    address = address_of(physics)
    places = []
    for place, value in enumerate(memory.read(address, usable_size(address))):
        if value != 1:
            continue
        byte = ctypes.c_uint8.from_address(address + place)
        byte.value = 0
        if not getattr(physics, name):
            places.append(place)
        byte.value = 1
    if len(places) != 1:
        raise YadeError(f"YADE's memory: {kind}.{name} was found at {len(places)} offsets instead of one", "Layout")
    return places[0]


@functools.cache
def add_geometry() -> None:
    """Add the offsets of ScGeom6D; once. Raises YadeError if a field is not found.

    Writes different numbers behind the fields of ScGeom in an object, and reads its attributes.
    """
    layout, geometry = host().layout, host().wrapper.ScGeom6D()
    address = address_of(geometry)
    # The fields of a derived class lie behind those of its base.
    first = max(place + (24 if name in ("ScGeom.normal", "ScGeom.contactPoint", "ScGeom.shearInc") else 8) for name, place in layout.items() if name.startswith("ScGeom.") and name != "ScGeom.vtable")
    places = range(first, usable_size(address) - 7, 8)
    for place in places:
        ctypes.c_double.from_address(address + place).value = 1.0 + place / 4096
    found = {}
    for name, count in GEOMETRY.items():
        value = getattr(geometry, name)
        start = (value if count == 1 else value[0]) - 1.0
        place = round(start * 4096)
        if place not in places or any((value if count == 1 else value[k]) != 1.0 + (place + 8 * k) / 4096 for k in range(count)):
            raise YadeError(f"YADE's memory: ScGeom6D.{name} was not found", "Layout")
        found[f"ScGeom6D.{name}"] = place
    found["ScGeom6D.vtable"] = memory.pointer(address)
    layout.update(found)
