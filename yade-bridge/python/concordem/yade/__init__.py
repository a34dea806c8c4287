"""ConcorDEM's operators, solver, and bonds in a YADE script.

Import this inside YADE (``yade script.py``). The import locates the data of YADE's objects in memory and compares them to the values
that YADE's Python returns; it raises :class:`concordem.YadeError` on any difference. On an untested version of YADE, only the native
plugin works; all other functions raise YadeError.

* :func:`snapshot`: the current scene as arrays, with stress, couple stress, strain, and fabric.
* :func:`advance`: our solver computes steps of a concrete scene and writes the result back.
* :func:`take_over`, :func:`bond`: the bonded engine stores and computes the bonds; YADE does the rest.
* :func:`engines`: the bonded engines of the scene.
* :func:`doctor`: what of a script and its scene is followed and refused; ``python3 -m concordem.yade check script.py`` reads it only.
* :func:`save`, :func:`load`: `O.save` and `O.load` with the bonds of bonded engines.
* :func:`load_native`, :func:`use_rust_cpm`: the native plugin, built by ``python3 -m concordem.yade build``.
"""

from .._errors import YadeError

from . import _pause
from ._doctor import Finding, doctor
from ._engine import BondedEngine, _run, engines
from ._handover import HandedOver, advance
from ._native import load as load_native
from ._native import use_rust_cpm
from ._saved import load, save
from ._scene import Snapshot, host, snapshot
from ._take_over import bond, take_over

__all__ = [
    "BondedEngine",
    "Finding",
    "HandedOver",
    "Snapshot",
    "advance",
    "bond",
    "doctor",
    "engines",
    "load",
    "load_native",
    "save",
    "snapshot",
    "take_over",
    "use_rust_cpm",
]

# Check now, so that an incompatible YADE fails at import and not during a run.
try:
    host()
    _pause.install()
    host().layout
except YadeError as error:
    if error.kind not in ("NotInYade", "Version"):
        raise
