"""The states of a coupled run that has failed or was interrupted, in files."""

from __future__ import annotations

import pickle
import signal
import threading
from contextlib import contextmanager
from io import BytesIO
from os import PathLike
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Callable, Iterator, Mapping, Sequence

import numpy as np

from .._core import CellStates
from .._errors import CouplingError
from ._materials import CellMaterial
from ._protocol import FiniteElements, Reals

if TYPE_CHECKING:
    from .._core import Simulation


@contextmanager
def rescued(
    folder: str | PathLike[str] | None, simulation: Simulation, elements: Sequence[FiniteElements], arrays: Mapping[str, Reals] | None = None
) -> Iterator[Callable[[], None]]:
    """If the block fails, write the present states to the folder, and add a note to the error that names the files.

    `particles.h5` is a checkpoint (`Simulation.load`), `elements-K.pickle` what `save` of elements K returned (`restore_elements`),
    `NAME.npy` each of `arrays`. A step that failed may be done on one side only: repair its cause, and compare steps before going on.

    Ctrl-C is deferred: the block calls the yielded function after each step, when both sides are at the same time, and KeyboardInterrupt is
    raised there. A second Ctrl-C takes effect immediately.
    """
    try:
        with _deferred_interrupt() as between:
            yield between
    except (Exception, KeyboardInterrupt) as error:
        if folder is not None:
            error.add_note(_written(Path(folder), simulation, elements, arrays or {}))
        raise


def _written(target: Path, simulation: Simulation, elements: Sequence[FiniteElements], arrays: Mapping[str, Reals]) -> str:
    """Write the states; says what was written."""
    notes = []
    try:
        target.mkdir(parents=True, exist_ok=True)
        simulation.save(target / "particles.h5")
        notes.append(f"particles.h5 (step {simulation.state.step})")
        for name, values in arrays.items():
            np.save(target / f"{name}.npy", values)
            notes.append(f"{name}.npy")
        for number, side in enumerate(elements):
            notes += write_elements(side, target, number)
        return f"the states at the error are in {target}: {', '.join(notes)}"
    # The elements are foreign: their `save` and the pickling of its result may raise anything, which must not hide the first error.
    except Exception as second:
        return f"of the states at the error only these are in {target}: {', '.join(notes) or 'none'}, because {second}"


@contextmanager
def _deferred_interrupt() -> Iterator[Callable[[], None]]:
    """Ctrl-C takes effect where the block calls what it gets."""
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        # Signals reach the main thread only; or they are ignored, or do not go through Python.
        yield lambda: None
        return
    asked: list[Any] = []

    def note(number: int, frame: Any) -> None:
        if asked:
            before(number, frame)
        asked.append(frame)

    def between() -> None:
        if asked:
            frame = asked[0]
            asked.clear()
            before(signal.SIGINT, frame)

    signal.signal(signal.SIGINT, note)
    try:
        yield between
        between()
    finally:
        signal.signal(signal.SIGINT, before)


def _cells(elements: Any) -> list[CellMaterial]:
    """Materials that are cells of particles, in the order in which `save` takes their states."""
    material = getattr(elements, "material", None)
    return [one for one in getattr(material, "materials", [material]) if isinstance(one, CellMaterial)]


class _Pickler(pickle.Pickler):
    """Leaves out the states of cells, which have files of their own."""

    def __init__(self, file: IO[bytes]) -> None:
        super().__init__(file)
        self.states: list[CellStates] = []

    def persistent_id(self, obj: Any) -> int | None:
        if not isinstance(obj, CellStates):
            return None
        self.states.append(obj)
        return len(self.states) - 1


class _Unpickler(pickle.Unpickler):
    def __init__(self, file: IO[bytes], states: Sequence[CellStates]) -> None:
        super().__init__(file)
        self._states = states

    def persistent_load(self, pid: Any) -> CellStates:
        states: CellStates = self._states[pid]
        return states


def write_elements(elements: FiniteElements, folder: str | PathLike[str], number: int = 0) -> list[str]:
    """Write the state of elements, what their `save` returns, to `elements-NUMBER.pickle` in the folder; returns the names of what was written.

    Cells of particles at integration points (:class:`CellMaterial`) go to the folders `elements-NUMBER-cells-K`, K the number of the material;
    see :meth:`RepresentativeCells.write`. `restore_elements` reads all.
    """
    target, names = Path(folder), [f"elements-{number}.pickle"]
    cells = _cells(elements)
    # In memory first, so that no half file remains.
    file = BytesIO()
    pickler = _Pickler(file)
    pickler.dump(elements.save())
    (target / names[0]).write_bytes(file.getvalue())
    if len(pickler.states) != len(cells):
        raise CouplingError(f"the elements saved the states of {len(pickler.states)} groups of cells, but have {len(cells)}", "Cells")
    for k, material in enumerate(cells):
        names.append(f"elements-{number}-cells-{k}")
        material.cells.write(target / names[-1])
    return names


def restore_elements(elements: FiniteElements, folder: str | PathLike[str], number: int = 0) -> None:
    """Go back to a state in files that `rescue` of a coupling, or `write_elements`, wrote: the elements then continue bit by bit.

    Args: `elements`: built as those that were written; `number`: position among the bodies of a `ContactCoupling`, else 0. Files of pickle
    can run programs: take them from sources that you trust.
    """
    target = Path(folder)
    states = []
    for k, material in enumerate(_cells(elements)):
        material.cells.read(target / f"elements-{number}-cells-{k}")
        states.append(material.cells.save())
    with open(target / f"elements-{number}.pickle", "rb") as file:
        elements.restore(_Unpickler(file, states).load())
