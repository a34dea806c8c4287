"""The states of a coupled run that has failed, in files."""

from __future__ import annotations

import pickle
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Iterator, Sequence

from ._protocol import FiniteElements

if TYPE_CHECKING:
    from .._core import Simulation


@contextmanager
def rescued(folder: str | PathLike[str] | None, simulation: Simulation, elements: Sequence[FiniteElements]) -> Iterator[None]:
    """If the block fails, write the present states to the folder, and add a note to the error that names the files.

    `particles.h5` is a checkpoint (`Simulation.load`), `elements-K.pickle` what `save` of elements K returned (`pickle.load`, then
    `restore`). The step that failed may be done on one side only: repair its cause, and compare steps before going on.
    """
    target = None if folder is None else Path(folder)
    try:
        yield
    except Exception as error:
        if target is None:
            raise
        notes = []
        try:
            target.mkdir(parents=True, exist_ok=True)
            simulation.save(target / "particles.h5")
            notes.append(f"particles.h5 (step {simulation.state.step})")
            for number, side in enumerate(elements):
                name = f"elements-{number}.pickle"
                (target / name).write_bytes(pickle.dumps(side.save()))
                notes.append(name)
            error.add_note(f"the states at the error are in {target}: {', '.join(notes)}")
        # The elements are foreign: their `save` and the pickling of its result may raise anything, which must not hide the first error.
        except Exception as second:
            error.add_note(f"of the states at the error only these are in {target}: {', '.join(notes) or 'none'}, because {second}")
        raise
