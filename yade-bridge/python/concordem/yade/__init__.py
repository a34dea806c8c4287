"""ConcorDEM's operators, solver, and bonds in a YADE script.

Import it inside YADE (``yade script.py``). The import finds the data of YADE's objects in memory and compares them with YADE's own
Python; it raises :class:`concordem.YadeError` on any difference. On a version of YADE that was not tested, only the native plugin
works; everything else raises when it is called.

* :func:`snapshot`: the current scene as arrays, with stress, couple stress, strain, and fabric.
* :func:`advance`: the solver computes steps of a concrete scene and writes the result back.
* :func:`take_over`, :func:`bond`: the bonded engine stores and computes the bonds; everything else stays with YADE.
* :func:`save`, :func:`load`: `O.save` and `O.load` with the bonds of bonded engines.
* :func:`load_native`, :func:`use_rust_cpm`: the native plugin, built by ``python3 -m concordem.yade build``.
"""

from .._errors import YadeError

from ._engine import BondedEngine, _run, bond, load, save, take_over
from ._handover import HandedOver, advance
from ._native import load as load_native
from ._native import use_rust_cpm
from ._scene import Snapshot, host, snapshot

__all__ = [
    "BondedEngine",
    "HandedOver",
    "Snapshot",
    "advance",
    "bond",
    "load",
    "load_native",
    "save",
    "snapshot",
    "take_over",
    "use_rust_cpm",
]

# Find and compare now: a YADE that does not fit fails at import, not during a run.
try:
    host()
except YadeError as error:
    if error.kind not in ("NotInYade", "Version"):
        raise
