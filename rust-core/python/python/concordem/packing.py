"""Packings: lattices, random dense packings, text files, data bases of YADE, and their structure.

>>> from concordem import packing
>>> cubic = packing.lattice("simple-cubic", radius=0.5, repeats=(2, 2, 2))
>>> len(cubic.radii), packing.summary(*cubic).coordination
(8, 6.0)

Packings between walls come from scenarios: ``Scenario(...).pack()`` with ``packing = {"kind": "cooker", ...}``.
"""

from __future__ import annotations

import json
from os import PathLike
from typing import Any

from ._core import (
    characterise_file,
    characterise_packing,
    lattice,
    packing_summary as summary,
    random_dense,
    read_packing as read,
    spatial_order,
    write_packing as write,
)
from ._memoized import read_memoized
from ._types import MemoizedPacking, Packing, PackingSummary

__all__ = [
    "MemoizedPacking",
    "Packing",
    "PackingSummary",
    "characterise",
    "lattice",
    "random_dense",
    "read",
    "read_memoized",
    "spatial_order",
    "summary",
    "write",
]


def characterise(packing: Packing | str | PathLike[str], **options: Any) -> dict[str, Any]:
    """Structure of a packing: coordination, density, sizes, directions, order, as ``concordem characterise`` writes it to JSON.

    ``packing``: a :class:`Packing`, or a sphere file, result, or scenario. Options: ``interaction_ratio`` or ``coordination`` choose the
    links (default: touching spheres, or the bonds of a result or scenario); ``boundary``: depth of the boundary in mean radii (default 2);
    ``page``: web page to write; of a file also ``cell``, edges of the periodic cell of a text file in m, ``threads``, and ``progress``.

    >>> from concordem import packing
    >>> found = packing.characterise(packing.lattice("face-centered", radius=1e-3, repeats=(3, 3, 3)))
    >>> found["coordination"]["inside"], round(found["solid_fraction"]["cell"], 4)
    (12.0, 0.7405)
    """
    if isinstance(packing, Packing):
        text = characterise_packing(packing.positions, packing.radii, packing.cell, **options)
    else:
        text = characterise_file(packing, **options)
    found: dict[str, Any] = json.loads(text)
    return found
