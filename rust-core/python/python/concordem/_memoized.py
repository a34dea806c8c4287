"""Packings from the data base of YADE's randomDensePack and randomPeriPack (memoizeDb), without YADE."""

from __future__ import annotations

import io
import os
import pickle
import pickletools
import sqlite3
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ._errors import PackingError
from ._types import MemoizedPacking, Packing

__all__ = ["read_memoized"]

_COLUMNS = "radius, rRelFuzz, dimx, dimy, dimz, N, timestamp, periodic, pack"
"""What YADE writes to the table `packings`."""
_INSTRUCTIONS = frozenset(
    "PROTO FRAME MARK EMPTY_LIST LIST APPEND APPENDS TUPLE TUPLE2 TUPLE3 BINFLOAT SHORT_BINUNICODE BINUNICODE GLOBAL STACK_GLOBAL REDUCE "
    "MEMOIZE BINPUT LONG_BINPUT BINGET LONG_BINGET STOP".split()
)
"""What pickles of packings consist of, by any version of YADE."""
_REMEDY = "If you trust the file, load the packing in YADE and write it with SpherePack.save; concordem.packing.read reads that"


def read_memoized(path: str | PathLike[str]) -> list[MemoizedPacking]:
    """All packings of a data base of YADE (``memoizeDb`` of ``randomDensePack`` and ``randomPeriPack``), oldest first.

    YADE stores packings as pickles, and loading a pickle can run any program. Therefore only numbers, tuples, lists, and YADE's vectors
    are read, without importing anything; a data base with other content raises :class:`PackingError`.

    >>> import concordem
    >>> for found in concordem.packing.read_memoized("packings.db"):                 # doctest: +SKIP
    ...     print(found.radius, found.radius_fuzz, found.periodic, len(found.packing.radii))
    >>> concordem.packing.write("spheres.txt", *found.packing)                       # doctest: +SKIP
    """
    place = Path(path)
    # SQLite would say only that it is unable to open the file.
    with open(place, "rb"):
        pass
    connection = sqlite3.connect(f"{place.resolve().as_uri()}?mode=ro", uri=True)
    try:
        rows = connection.execute(f"SELECT {_COLUMNS} FROM packings ORDER BY timestamp, rowid").fetchall()
    except sqlite3.DatabaseError as error:
        raise PackingError(
            f"{os.fspath(path)}: not a data base of YADE's randomDensePack ({error}); give the file named by memoizeDb, or use concordem.packing.read for others",
            "Foreign",
        ) from error
    finally:
        connection.close()
    return [_packing(f"{os.fspath(path)}: packing {number}", row) for number, row in enumerate(rows, 1)]


def _packing(place: str, row: tuple[Any, ...]) -> MemoizedPacking:
    """The packing in one row of the table."""
    *numbers, periodic, blob = row
    try:
        radius, fuzz, *dimensions, count, time = (float(number) for number in numbers)
    except (TypeError, ValueError) as error:
        raise PackingError(f"{place}: a parameter is not a number ({error}). {_REMEDY}", "Foreign") from error
    if not isinstance(blob, bytes):
        raise PackingError(f"{place}: the column `pack` is not a pickle. {_REMEDY}", "Foreign")
    spheres = _spheres(place, blob)
    if len(spheres) != count:
        raise PackingError(f"{place}: {len(spheres)} spheres instead of N = {count:g}; the file is damaged. {_REMEDY}", "Foreign")
    size = np.array(dimensions)
    if periodic and not (np.isfinite(size).all() and (size > 0).all()):
        raise PackingError(f"{place}: a periodic cell with the edges {dimensions}; the file is damaged. {_REMEDY}", "Foreign")
    packing = Packing(spheres[:, :3].copy(), spheres[:, 3].copy(), np.diag(size) if periodic else None)
    return MemoizedPacking(packing, radius, fuzz, size, bool(periodic), time)


def _spheres(place: str, blob: bytes) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Center and radius of each sphere, (n, 4)."""
    try:
        _inspect(blob)
        items = _Harmless(io.BytesIO(blob)).load()
    # A pickle of a stranger can fail in any way, also for lack of memory.
    except Exception as error:
        raise PackingError(f"{place}: refused: {error}. {_REMEDY}", "Foreign") from error
    if not isinstance(items, list):
        raise PackingError(f"{place}: refused: the pickle contains no list of spheres. {_REMEDY}", "Foreign")
    rows = np.empty((len(items), 4))
    for row, item in zip(rows, items):
        # `SpherePack.toList` adds a third entry, the clump, to members of clumps.
        if not (isinstance(item, tuple) and len(item) == 2 and isinstance(item[0], tuple) and len(item[0]) == 3):
            raise PackingError(f"{place}: refused: an entry is not ((x, y, z), radius), such as a member of a clump. {_REMEDY}", "Foreign")
        values = (*item[0], item[1])
        if not all(isinstance(value, float) for value in values):
            raise PackingError(f"{place}: refused: a coordinate or radius is not a number of double precision. {_REMEDY}", "Foreign")
        row[:] = values
    if not (np.isfinite(rows).all() and (rows[:, 3] > 0).all()):
        raise PackingError(f"{place}: a coordinate is not finite, or a radius is not positive; the file is damaged. {_REMEDY}", "Foreign")
    return rows


def _inspect(blob: bytes) -> None:
    """Refuse a pickle with instructions that packings do not need."""
    for instruction, argument, _ in pickletools.genops(blob):
        if instruction.name not in _INSTRUCTIONS:
            raise pickle.UnpicklingError(f"the pickle has the instruction {instruction.name}, which YADE's packings do not contain")
        # The unpickler allocates as many places as the number says.
        if instruction.name == "LONG_BINPUT" and int(argument or 0) > len(blob):
            raise pickle.UnpicklingError(f"the pickle asks for {argument} places in memory")


class _Vector3:
    """Stands for YADE's class of vectors in pickles. Without a dictionary, so that a pickle cannot change it."""

    __slots__ = ()

    def __call__(self, x: object, y: object, z: object) -> tuple[object, object, object]:
        return x, y, z


class _Harmless(pickle.Unpickler):
    """Makes numbers, tuples, and lists. Imports and calls nothing but the stand-in for YADE's vectors."""

    def find_class(self, module: str, name: str) -> _Vector3:
        # The module of the vectors depends on the version of YADE.
        if name == "Vector3" and module in ("minieigen", "yade.minieigenHP", "yade._minieigenHP"):
            return _Vector3()
        raise pickle.UnpicklingError(f"the pickle asks for {module}.{name}, which YADE's packings do not contain")
