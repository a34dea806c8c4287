"""Fills the objects of bonds when a script reads one: an object that it asks for, or that it has kept from an earlier step. Loops that read nothing cost
no values.

After each step, the attributes of interactions, and of the geometry and physics of bonds, are others. The first one that a script reads fills the
objects and puts YADE's own attributes back.

A script and its PyRunners may read in two threads at once, while YADE's loop runs in the background.
"""

from __future__ import annotations

import contextlib
import contextvars
import functools
import threading
from typing import Any, Iterator, Protocol

from ._scene import host


class Waiting(Protocol):
    """Objects of a bonded engine whose values are not those of the last step."""

    @property
    def classes(self) -> tuple[str, str]:
        """Names of YADE's classes of their geometry and physics."""

    def fill(self) -> None:
        """Write the values of the last step into the objects."""

    def match(self) -> None:
        """Let those objects be real whose contacts exist after the last step."""


_PARTS = ("geom", "phys")
#: What is read of an interaction itself.
_OF_CONTACT = (*_PARTS, "cellDist", "dict", "updateAttrs")
#: YADE's own attributes, while others stand in their place; None: those of the base class.
_own: dict[tuple[Any, str], Any] = {}
_waiting: list[Waiting] = []
#: Number of calls of :func:`wait`.
_waits = 0
#: Held while attributes are exchanged, but not while objects are filled: that may wait for a step, whose thread may wait for this lock.
_lock = threading.Lock()


#: Whether this thread fills objects now.
_fills = contextvars.ContextVar("fills", default=False)


@contextlib.contextmanager
def filling() -> Iterator[None]:
    """Within this, objects are filled, and for this thread their attributes are YADE's own."""
    before = _fills.set(True)
    try:
        yield
    finally:
        _fills.reset(before)


def wait(objects: Waiting) -> None:
    """Fill these objects when a script reads one."""
    global _waits
    wrapper = host().wrapper
    kinds = (wrapper.Interaction, *(getattr(wrapper, name) for name in objects.classes))
    with _lock:
        _waits += 1
        if objects not in _waiting:
            _waiting.append(objects)
        for kind in kinds:
            for name, (own, other) in _others(kind).items():
                if (kind, name) not in _own:
                    _own[kind, name] = own
                    setattr(kind, name, other)


def end(objects: Waiting | None) -> None:
    """Do not fill these objects any more, because their engine has ended."""
    with _lock:
        if objects in _waiting:
            _waiting.remove(objects)


def put(contact: Any, geometry: Any, physics: Any) -> None:
    """Give an interaction its parts, whether objects wait or not."""
    kind = host().wrapper.Interaction
    for name, value in zip(_PARTS, (geometry, physics)):
        own = _own.get((kind, name))
        if own is None:
            setattr(contact, name, value)
        else:
            own.__set__(contact, value)


@functools.cache
def _others(kind: Any) -> dict[str, tuple[Any, property]]:
    """The attributes of a class that are read, with those that fill the objects before: name, YADE's own in this class, other."""
    is_contact = kind is host().wrapper.Interaction
    names = _OF_CONTACT if is_contact else [name for name in dir(kind) if not name.startswith("_")]
    found = {}
    for name in names:
        own = getattr(kind, name)
        if isinstance(own, property) or callable(own):
            found[name] = (vars(kind).get(name), property(functools.partial(_read, own), functools.partial(_write, own)))
    if is_contact:
        found["isReal"] = (vars(kind)["isReal"], property(functools.partial(_is_real, kind.isReal)))
    return found


def _put_back(names: list[tuple[Any, str]]) -> None:
    for kind, name in names:
        own = _own.pop((kind, name))
        if own is None:
            delattr(kind, name)
        else:
            setattr(kind, name, own)


def _fill() -> None:
    """Fill all objects that wait, and put YADE's attributes back."""
    if _fills.get():
        return
    while True:
        with _lock:
            _put_back(list(_own))
            if not _waiting:
                return
            objects = _waiting.pop()
        objects.fill()


def _read(own: Any, part: Any) -> Any:
    _fill()
    return own.__get__(part, type(part))


def _write(own: Any, part: Any, value: Any) -> None:
    _fill()
    own.__set__(part, value)


def _is_real(own: Any, contact: Any) -> Any:
    """Whether a contact is real, which needs no values."""
    if not _fills.get():
        with _lock:
            found, waits = list(_waiting), _waits
        for objects in found:
            objects.match()
        name = (host().wrapper.Interaction, "isReal")
        with _lock:
            # Another thread may have ended a step meanwhile.
            if name in _own and waits == _waits:
                _put_back([name])
    return own.__get__(contact, type(contact))
