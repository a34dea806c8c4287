"""Finds where YADE stores the fields of its objects.

YADE's Python interface returns one object at a time, which takes microseconds per object. Reading all objects at once from memory
needs the offsets of the fields, which depend on version and compiler. :func:`probe` finds them in a separate scene: it sets bodies in
motion, reads every field through Python, and searches memory for the same numbers. A field is found if exactly one offset agrees with
all observations at several moments. :mod:`concordem.yade._scene` checks samples again in the user's scene.
"""

from __future__ import annotations

import os
import struct
from typing import Any

from .._errors import YadeError
from ._memory import address_of, image_of
from ._probe import Layout, find_layout

#: Versions that were tested.
KNOWN_VERSIONS = ("2023.02a", "2025.2.0")
#: Environment variable that allows other versions; all checks stay.
ANY_VERSION = "CONCORDEM_YADE_ANY_VERSION"


def probe(yade: Any) -> Layout:
    """Find all offsets in YADE's alternative scene (O.switchScene), which stays empty; the user's scene does not change.

    Raises YadeError for an untested version, another precision than double, a running or used scene, and fields that are not found.
    """
    version = str(yade.config.version)
    if version not in KNOWN_VERSIONS and not os.environ.get(ANY_VERSION):
        raise YadeError(
            f"this is YADE {version}, but the bridge was tested only with {', '.join(KNOWN_VERSIONS)}; set {ANY_VERSION}=1 to "
            "try it, with all checks",
            "Version",
        )
    if _real_bytes(yade) != 8:
        raise YadeError("this YADE does not use double precision; use one that does", "Precision")
    omega = yade.O
    if omega.running:
        raise YadeError("YADE is running; call O.pause(), then import concordem.yade again", "Running")
    before = (len(omega.bodies), len(omega.engines), omega.iter, omega.dt)
    omega.switchScene()
    try:
        if len(omega.bodies) or len(omega.engines):
            raise YadeError(
                "the alternative scene (O.switchScene) is in use; import concordem.yade before you use it", "SceneInUse"
            )
        layout = find_layout(yade)
    finally:
        omega.resetThisScene()
        omega.switchScene()
    after = (len(omega.bodies), len(omega.engines), omega.iter, omega.dt)
    if before != after and not (before[3] != before[3]):
        raise YadeError(f"the scene changed while YADE's memory was probed: {before} became {after}; please report this", "Layout")
    return layout


def _real_bytes(yade: Any) -> int:
    """8 if YADE stores reals as doubles."""
    state = yade.wrapper.State()
    state.mass = 1.25
    return 8 if struct.pack("<d", 1.25) in image_of(address_of(state), 512) else 0
