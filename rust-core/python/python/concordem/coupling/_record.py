"""Motions of a coupled run, from which a scenario repeats it without finite elements."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from .._errors import CouplingError
from ._protocol import Reals


class MotionRecord:
    """Motions of sets and meshes, step by step, for the tables ``[[slave]]`` of a scenario."""

    def __init__(self, step: int) -> None:
        if step != 0:
            raise CouplingError(f"a record begins with the run, but this one is at step {step}; build the coupling at step 0", "Record")
        self._motions: dict[tuple[str, str], list[Reals]] = {}

    def add(self, kind: str, name: str, *motion: Reals) -> None:
        """Append an entry of the "set" or "wall" `name`: three or six components per row."""
        self._motions.setdefault((kind, name), []).append(np.concatenate(motion, axis=1))

    def write(self, folder: str | PathLike[str]) -> list[dict[str, Any]]:
        """Write a file for each motion, and return the tables ``[[slave]]``, with paths relative to the folder."""
        target = Path(folder)
        target.mkdir(parents=True, exist_ok=True)
        tables = []
        for number, ((kind, name), entries) in enumerate(self._motions.items()):
            path = f"slave-{number}.npy"
            np.save(target / path, np.ascontiguousarray(np.stack(entries), dtype="<f8"))
            tables.append({kind: name, "path": path})
        return tables


def written(record: MotionRecord | None, folder: str | PathLike[str]) -> list[dict[str, Any]]:
    """See :meth:`MotionRecord.write`."""
    if record is None:
        raise CouplingError("nothing was recorded; build the coupling with record", "Record")
    return record.write(folder)
