"""`O.interactions` and `Body.intrs()` of a scene with bonded engines, and YADE's C++ functions that read interactions.

The bonds are not in YADE's container. A script gets a container that answers for YADE's own interactions and for the bonds
(:mod:`._mirror`). A function in C++ walks through the vector of the container; for the duration of its call, that vector is another one, with
the bonds at its end. Nothing is copied into YADE, so nothing must be taken out again.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import itertools
from typing import Any, Callable, Iterator, Protocol, Sequence

import numpy as np

from ._memory import known_address_of, known_pointer
from ._mirror import Mirror
from ._rules import refuse
from ._scene import at_rest, host


class Owner(Protocol):
    """A bonded engine, as the owner of bonds."""

    def mirror(self) -> Mirror:
        """The bonds as objects of YADE."""

    def refuse_erasing(self) -> None:
        """Raise YadeError if bonds cannot be erased now."""


#: YADE's own methods of the container, by name; empty until others stand in their place.
_of_yade: dict[str, Any] = {}


class Own:
    """YADE's container with YADE's own methods."""

    def __init__(self, container: Any) -> None:
        self._container = container

    def __getattr__(self, name: str) -> Any:
        own = _of_yade.get(name)
        return getattr(self._container, name) if own is None else functools.partial(own, self._container)

    def __iter__(self) -> Any:
        return _of_yade["__iter__"](self._container)

    def __len__(self) -> int:
        return int(_of_yade["__len__"](self._container))

    def __getitem__(self, pair: tuple[int, int]) -> Any:
        return _of_yade["__getitem__"](self._container, pair)


def install(kind: Any, hidden: Callable[[], Sequence[Owner]]) -> None:
    """Let all objects of YADE's class of the container, also those that a script has kept, answer with the bonds of the engines that `hidden` gives."""
    for name in ("__iter__", "__len__", "__getitem__", "countReal", "has", "nth", "withBody", "withBodyAll", "all", "erase", "clear", "eraseNonReal"):
        _of_yade[name] = getattr(kind, name)
        setattr(kind, name, _with_bonds(name, hidden))
    kind.own = property(Own)


def _with_bonds(name: str, hidden: Callable[[], Sequence[Owner]]) -> Any:
    own = _of_yade[name]

    @functools.wraps(own)
    def method(self: Any, *arguments: Any, **named: Any) -> Any:
        engines = hidden()
        return getattr(Contacts(Own(self), engines), name)(*arguments, **named) if engines else own(self, *arguments, **named)

    return method


class Contacts:
    """`O.interactions` with the bonds, which come first, ordered by the ids of their bodies."""

    def __init__(self, own: Own, engines: Sequence[Owner]) -> None:
        self.own = own
        self._engines = engines
        self._mirrors = [engine.mirror() for engine in engines]

    def __iter__(self) -> Iterator[Any]:
        return itertools.chain(*(mirror.contacts() for mirror in self._mirrors), self.own)

    def _count(self) -> int:
        return sum(len(mirror) for mirror in self._mirrors)

    def __len__(self) -> int:
        return len(self.own) + self._count()

    def __getitem__(self, pair: tuple[int, int]) -> Any:
        one, two = pair
        for mirror in self._mirrors:
            found = mirror.find(one, two)
            if found is not None:
                return found
        return self.own[one, two]

    def countReal(self) -> int:
        """Number of real interactions."""
        return int(self.own.countReal()) + self._count()

    def has(self, id1: int, id2: int, onlyReal: bool = False) -> bool:
        """Whether two bodies interact."""
        return any(mirror.find(id1, id2) is not None for mirror in self._mirrors) or bool(self.own.has(id1, id2, onlyReal))

    def nth(self, place: int) -> Any:
        """One interaction."""
        for mirror in self._mirrors:
            if 0 <= place < len(mirror):
                return mirror.nth(place)
            place -= len(mirror)
        return self.own.nth(place)

    def withBody(self, number: int) -> list[Any]:
        """Real interactions of one body."""
        return [contact for mirror in self._mirrors for contact in mirror.of_body(number)] + list(self.own.withBody(number))

    def withBodyAll(self, number: int) -> list[Any]:
        """Interactions of one body."""
        return [contact for mirror in self._mirrors for contact in mirror.of_body(number)] + list(self.own.withBodyAll(number))

    def all(self, onlyReal: bool = False) -> list[Any]:
        """All interactions."""
        return [contact for mirror in self._mirrors for contact in mirror.contacts()] + list(self.own.all(onlyReal))

    def erase(self, id1: int, id2: int) -> None:
        """Erase one interaction. A bond is gone before the next step."""
        for engine, mirror in zip(self._engines, self._mirrors):
            if mirror.find(id1, id2) is not None:
                engine.refuse_erasing()
                mirror.erase(id1, id2)
                return
        self.own.erase(id1, id2)

    def clear(self) -> None:
        """Erase all interactions."""
        for engine in self._engines:
            engine.refuse_erasing()
        for mirror in self._mirrors:
            mirror.clear()
        self.own.clear()

    def eraseNonReal(self) -> None:
        """Erase interactions that are not real; bonds are."""
        self.own.eraseNonReal()


#: Where YADE's container has the number of its interactions, from its vector; None: not found yet.
_count_at: int | None = None


def _set_count(vector: int, before: int, count: int) -> None:
    """Set the number of interactions that the container beside this `vector` tells, which YADE's loops in parallel use."""
    global _count_at
    own = host().interactions
    places = range(24, 96, 8) if _count_at is None else (_count_at,)
    for place in places:
        word = ctypes.c_uint64.from_address(vector + place)
        if word.value != before:
            continue
        word.value = count
        if len(own) == count:
            _count_at = place
            return
        word.value = before
    raise refuse("the number of interactions was not found in YADE's memory; please report this", "Layout")


class Loan:
    """From now until :meth:`end`, the vector of YADE's container has the bonds of these engines, too; `stiffness`: only with what a time step
    needs."""

    def __init__(self, engines: Sequence[Owner], stiffness: bool = False) -> None:
        at_rest()
        pointers = np.concatenate([engine.mirror().pointers(stiffness) for engine in engines])
        yade = host()
        layout = yade.layout
        self._vector = known_pointer(known_address_of(yade.omega._sceneObj) + layout["Scene.interactions"]) + layout["interactions.vector"]
        self._place = (ctypes.c_uint64 * 3).from_address(self._vector)
        self._before: list[int] | None = list(self._place)
        own = (self._before[1] - self._before[0]) // 16
        # Shared pointers: the target, and no counter of owners. The owners are the objects of Python, which outlive the loan.
        self._both = np.zeros((own + len(pointers), 2), np.uint64)
        if own:
            self._both[:own] = np.ctypeslib.as_array((ctypes.c_uint64 * (2 * own)).from_address(self._before[0])).reshape(own, 2)
        self._both[own:, 0] = pointers
        start = self._both.ctypes.data
        self._counted = len(yade.interactions)
        self._place[:] = [start, start + self._both.nbytes, start + self._both.nbytes]
        try:
            if len(yade.interactions) == self._counted and len(pointers):
                _set_count(self._vector, self._counted, self._counted + len(pointers))
        except BaseException:
            self.end()
            raise

    def end(self) -> None:
        """Give YADE its own vector back."""
        if self._before is None:
            return
        if len(host().interactions) != self._counted and _count_at is not None:
            ctypes.c_uint64.from_address(self._vector + _count_at).value = self._counted
        self._place[:] = list(self._before)
        self._before = None


@contextlib.contextmanager
def lent(engines: Sequence[Owner]) -> Iterator[None]:
    """Within this, the vector of YADE's container has the bonds, too."""
    loan = Loan(engines)
    try:
        yield
    finally:
        loan.end()
