"""Reads the memory of this process and finds fields of YADE's objects in it.

Memory is read through ``/proc/self/mem``: a wrong guess is an error, not a crash.
"""

from __future__ import annotations

import ctypes
import os
import struct
from typing import Any, Callable

from .._errors import YadeError

_PAGE = 4096


def usable_size(address: int) -> int:
    """Size of the block of the C library's heap that begins at `address`; 0 if none does.

    Reads past the end of an object find other objects, which may contain the same numbers by chance.
    """
    # glibc stores the size before the block, with flags in the lowest three bits.
    before = memory.read(address - 8, 8)
    size = struct.unpack("<Q", before)[0] & ~7 if len(before) == 8 else 0
    return size - 8 if size % 16 == 0 and 32 <= size < 1 << 20 else 0


class Memory:
    """The memory of this process. Reading an invalid address returns fewer bytes instead of crashing."""

    def __init__(self) -> None:
        self._open()
        # The open file stays that of the parent.
        os.register_at_fork(after_in_child=self._open)

    def _open(self) -> None:
        self._file = os.open("/proc/self/mem", os.O_RDONLY)

    def read(self, address: int, size: int) -> bytes:
        """`size` bytes at `address`; fewer if the mapped memory ends before."""
        data = b""
        while len(data) < size:
            at = address + len(data)
            part = min(size - len(data), _PAGE - at % _PAGE)
            try:
                data += os.pread(self._file, part, at)
            except (OSError, OverflowError):
                break
        return data

    def pointer(self, address: int) -> int:
        """The pointer stored at `address`; 0 if the memory is not mapped."""
        data = self.read(address, 8)
        return int(struct.unpack("<Q", data)[0]) if len(data) == 8 else 0


memory = Memory()


def image_of(address: int, span: int) -> bytes:
    """The object at `address`: at most `span` bytes, and none behind its block of the heap.

    With an allocator that does not tell the size, all `span` bytes: reads cannot crash, and a number that is found once more behind the object
    is an error (:meth:`Finder.offset`). Nothing may be written without a size.
    """
    return memory.read(address, min(span, usable_size(address) or span))


def address_of(instance: Any) -> int:
    """Address of the C++ object behind a Python object of YADE (boost::python, held by a shared pointer)."""
    holder = memory.pointer(id(instance) + 40)
    return memory.pointer(holder + 16)


def known_pointer(address: int) -> int:
    """The pointer stored at an address that has been checked. Unlike :meth:`Memory.pointer`, without a call of the system."""
    return int(ctypes.c_uint64.from_address(address).value)


def known_address_of(instance: Any) -> int:
    """:func:`address_of` once the layout has been checked."""
    return known_pointer(known_pointer(id(instance) + 40) + 16)


def pack_real(value: Any) -> bytes:
    """The bytes of a real, a vector, or a quaternion."""
    try:
        return struct.pack("<%dd" % len(value), *(float(value[k]) for k in range(len(value))))
    except TypeError:
        return struct.pack("<d", float(value))


def pack_mask(blocked: str) -> int:
    """The bit mask of `State.blockedDOFs`."""
    return sum(1 << "xyzXYZ".index(letter) for letter in blocked)


def pack_matrix(value: Any) -> bytes:
    """The bytes of a 3x3 matrix, in Eigen's column-major order."""
    return struct.pack("<9d", *(float(value[i, j]) for j in range(3) for i in range(3)))


def pack_int(value: Any) -> bytes:
    """The bytes of an int or a vector of ints."""
    try:
        return struct.pack("<%di" % len(value), *(int(value[k]) for k in range(len(value))))
    except TypeError:
        return struct.pack("<i", int(value))


class Finder:
    """Finds the offsets of the fields of a class at which memory agrees with all observations."""

    def __init__(self, what: str, span: int = 1024) -> None:
        self.what = what
        self._span = span
        self._places: dict[str, set[int]] = {}
        self._values: dict[str, set[bytes]] = {}

    def observe(self, name: str, address: int, data: bytes, step: int = 4) -> None:
        """Record that the field `name` of the object at `address` contains the bytes `data`; search every `step` bytes."""
        image = image_of(address, self._span)
        places = self._places.get(name)
        candidates = range(0, len(image) - len(data) + 1, step) if places is None else sorted(places)
        self._places[name] = {k for k in candidates if image[k : k + len(data)] == data}
        self._values.setdefault(name, set()).add(data)

    def observe_pointer(self, name: str, address: int, target: int) -> None:
        """Record that the field `name` of the object at `address` is a shared pointer to `target`."""
        self.observe(name, address, struct.pack("<Q", target), step=8)

    def adjacent(self, first: str, second: str, distance: int) -> None:
        """Keep only offsets where `second` is `distance` bytes after `first`, as declared in the class.

        Adjacent heap memory may contain one small number such as an id by chance, but hardly both.
        """
        places = {k for k in self._places.get(first, set()) if k + distance in self._places.get(second, set())}
        self._places[first], self._places[second] = places, {k + distance for k in places}

    def offset(self, name: str, prefer_first: bool = False) -> int:
        """Offset of the field, bytes.

        Raises YadeError if memory agrees at no offset, or at several unless `prefer_first`.
        """
        places = self._places.get(name, set())
        if len(self._values.get(name, ())) < 2:
            raise YadeError(f"YADE's memory: {self.what}.{name} had too few different values to find its offset; please report this", "Layout")
        if len(places) > 1 and prefer_first:
            return min(places)
        if len(places) != 1:
            raise YadeError(f"YADE's memory: {self.what}.{name} was found at {len(places)} offsets instead of one", "Layout")
        return next(iter(places))


def flag_offset(what: str, name: str, instance: Any, set_flag: Callable[[bool], None], span: int = 1024) -> int:
    """Offset of a bool that `set_flag` sets: the only byte that changes with it."""
    address = address_of(instance)
    images = []
    for value in (False, True, False, True):
        set_flag(value)
        images.append(image_of(address, span))
    length = min(map(len, images))
    places = [k for k in range(length) if tuple(image[k] for image in images) == (0, 1, 0, 1)]
    if len(places) != 1:
        raise YadeError(f"YADE's memory: {what}.{name} was found at {len(places)} offsets instead of one", "Layout")
    return places[0]
