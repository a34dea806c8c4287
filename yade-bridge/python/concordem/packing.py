"""Packings: lattices, random dense packings, and text files.

>>> from concordem import packing
>>> cubic = packing.lattice("simple-cubic", radius=0.5, repeats=(2, 2, 2))
>>> len(cubic.radii), packing.summary(*cubic).coordination
(8, 6.0)
"""

from ._core import (
    lattice,
    packing_summary as summary,
    random_dense,
    read_packing as read,
    spatial_order,
    write_packing as write,
)
from ._types import Packing, PackingSummary

__all__ = ["Packing", "PackingSummary", "lattice", "random_dense", "read", "spatial_order", "summary", "write"]
