"""Fills the objects of bonds when a script reads the first one, not when it asks for them: a loop that reads nothing then costs no values.

Between both, `Interaction.geom` and `Interaction.phys` are other attributes, which fill the objects and put YADE's own back.
"""

from __future__ import annotations

import functools
from typing import Any, Protocol

from ._scene import host


class Waiting(Protocol):
    """Objects of a bonded engine whose values are not those of the last step."""

    def fill(self) -> None:
        """Write the values of the last step into the objects."""


_NAMES = ("geom", "phys")
#: YADE's own attributes, while others stand in their place.
_own: dict[str, Any] = {}
_waiting: list[Waiting] = []


def wait(objects: Waiting) -> None:
    """Fill these objects when a script reads one."""
    if objects not in _waiting:
        _waiting.append(objects)
    if not _own:
        kind = host().wrapper.Interaction
        for name in _NAMES:
            _own[name] = getattr(kind, name)
            setattr(kind, name, property(functools.partial(_read, name), functools.partial(_write, name)))


def end(objects: Waiting | None) -> None:
    """Do not fill these objects any more, because their engine has ended."""
    if objects in _waiting:
        _waiting.remove(objects)


def put(contact: Any, geometry: Any, physics: Any) -> None:
    """Give a new interaction its parts, whether objects wait or not."""
    for name, value in zip(_NAMES, (geometry, physics)):
        if _own:
            _own[name].__set__(contact, value)
        else:
            setattr(contact, name, value)


def _fill() -> None:
    """Fill all objects that wait, and put YADE's attributes back."""
    for name in _NAMES:
        setattr(host().wrapper.Interaction, name, _own.pop(name))
    while _waiting:
        _waiting.pop().fill()


def _read(name: str, contact: Any) -> Any:
    if _own:
        _fill()
    return getattr(contact, name)


def _write(name: str, contact: Any, value: Any) -> None:
    if _own:
        _fill()
    setattr(contact, name, value)
