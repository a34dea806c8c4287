"""The bridge to YADE: our operators, our solver, and our bonds in a script of YADE's.

Imported within YADE (``yade script.py``). At import the places of YADE's data in memory are found and compared with what
YADE's own Python says; on any doubt the import is refused (:class:`concordem.YadeError`). Of a version whose memory nobody has
compared, only the native plugin is offered; all else refuses when it is called.

* :func:`snapshot`: the live scene as arrays; stress, couple stress, strain, fabric in bulk.
* :func:`advance`: our solver takes some steps of a scene of concrete, and writes all of it back.
* :func:`take_over`, :func:`bond`: the bonded engine; bonds are ours, everything else stays YADE's.
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

# Find and compare now, so that a YADE that does not fit is refused here and not in the middle of a run.
try:
    host()
except YadeError as error:
    if error.kind not in ("NotInYade", "Version"):
        raise
