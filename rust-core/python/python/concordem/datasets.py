"""Data sets of representative cells, for learning a material's response to strain paths.

:func:`strain_paths` deforms many periodic cells along random paths and keeps what they answer; :func:`load` reads it. h5py is needed:
``python -m pip install 'concordem[inference]'``.

Each file ``chunk-00000.h5`` in the folder holds one batch of p paths with s + 1 states; state 0 is the unstrained cell. Components are 11, 22,
33, 23, 31, 12; shears of ``strain`` are engineering shears.

=================  ==================  ======================================================================================
Dataset            Shape               Is
=================  ==================  ======================================================================================
``strain``         (p, s + 1, 6)       strain of the cell, 1; the deformation gradient is the identity plus this strain
``stress``         (p, s + 1, 6)       mean stress, symmetric part, Pa; tension is positive
``couple_stress``  (p, s + 1, 3, 3)    couple stress about the center of the cell, N/m
``damage``         (p, s + 1, 6)       damage tensor of the bonds, broken ones included, 1
``work``           (p, s + 1)          work of the stress over the volume of the unstrained cell, J/m^3
``bonds``          (p, s + 1)          intact bonds over those at the start, 1
``stiffness``      (p, s + 1, 6, 6)    elastic stiffness of the intact bonds without damage, Pa; if it was asked for
``kind``           (p,)                kind of the path: index into the attribute ``kinds``
``packing``        (p,)                seed of the packing
``path``           (p,)                number of the path, from 0
=================  ==================  ======================================================================================

A cell that cannot follow, such as one without bonds, has NaN from there on. The attributes ``settings``, ``scenario``, and ``kinds`` say how the file
was made; each dataset has the attribute ``unit``.
"""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import RepresentativeCells, Scenario
from ._errors import ConcordemWarning, ContinuumError, InferenceError
from ._progress import bar

__all__ = ["KINDS", "load", "strain_paths"]

Reals = NDArray[np.float64]

KINDS = ("random-walk", "proportional", "cyclic")
"""Kinds of strain paths."""
_PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1))
_UNITS = {"strain": "1", "stress": "Pa", "couple_stress": "N/m", "damage": "1", "work": "J/m^3", "bonds": "1", "stiffness": "Pa", "kind": "1", "packing": "1", "path": "1"}
_ROWS, _COLUMNS = (np.array(side) for side in zip(*_PAIRS))


def strain_paths(
    scenario: Scenario,
    folder: str | PathLike[str],
    *,
    count: int = 64,
    steps: int = 40,
    amplitude: float = 5e-4,
    kinds: Sequence[str] = KINDS,
    packings: Sequence[int] = (1,),
    substeps: int = 50,
    batch: int = 16,
    seed: int = 1,
    stiffness: bool = False,
    threads: int | None = None,
    progress: bool = False,
) -> list[Path]:
    """Deform periodic cells along random strain paths, and write one HDF5 file per batch into a folder.

    Call it again to continue after an interruption: batches that are finished stay. The files are the same to the byte for any number of
    threads and after any interruption.

    Parameters
    ----------
    scenario : a periodic cell with bonds, such as the template "cpm-periodic"; the paths take the place of `[loading]` and `[stop]`: a
        :class:`~concordem.ConcordemWarning` names what is not used, except `stop.steps`.
    folder : where the files go; made if it is missing.
    count : number of paths. steps : states of each path after the first.
    amplitude : the largest norm (ε:ε)^½ that paths reach lies between 0.3 and 1 times this strain.
    kinds : taken one after the other. "proportional": one random direction; "cyclic": twice forth, back to zero, and forth again, farther;
        "random-walk": sums of random increments.
    packings : seeds of the packing; batches take them one after the other.
    substeps : time steps of the solver per state. More of them are slower loading: inertia must be small beside the strength.
    batch : paths per file. seed : of the paths. stiffness : keep the elastic stiffness as well, which takes some time.
    threads : default: all processors. progress : show a bar.

    Returns
    -------
    list of Path : the files, in the order of the paths.

    Raises
    ------
    InferenceError : a number out of range, or a folder with other paths. ContinuumError, AssemblyError : the scenario is no periodic cell with bonds.
    ImportError : h5py is missing.

    Source of random walks as training data: Mozaffar et al. 2019.

    >>> import tempfile
    >>> from concordem import Scenario, datasets
    >>> tables = Scenario.template("cpm-periodic").with_settings({"packing.count": 60}).to_dict()
    >>> del tables["loading"]
    >>> tables["stop"] = {"steps": 1}
    >>> cell = Scenario.from_dict(tables)
    >>> files = datasets.strain_paths(cell, tempfile.mkdtemp(), count=2, steps=3, threads=1)
    >>> datasets.load(files[0].parent)["stress"].shape
    (2, 4, 6)
    """
    if not isinstance(scenario, Scenario):
        raise InferenceError(f"the scenario is a {type(scenario).__name__}; make one by Scenario.from_file or Scenario.template")
    for name, value in (("count", count), ("steps", steps), ("substeps", substeps), ("batch", batch)):
        if not isinstance(value, int) or value < 1:
            raise InferenceError(f"{name} is {value!r}; give a whole number of at least 1")
    if not 0 < amplitude < 0.5:
        raise InferenceError(f"amplitude is {amplitude}; give a strain between 0 and 0.5")
    if not kinds or any(kind not in KINDS for kind in kinds):
        raise InferenceError(f"kinds is {list(kinds)}; choose from {', '.join(KINDS)}")
    if not packings:
        raise InferenceError("packings is empty; give at least one seed")
    _h5py()
    settings = json.dumps({
        "amplitude": amplitude, "batch": batch, "count": count, "kinds": list(kinds), "packings": list(packings), "seed": seed, "steps": steps,
        "stiffness": stiffness, "substeps": substeps,
    })  # fmt: skip
    tables = scenario.to_dict()
    # A scenario must have a [stop].
    dropped = ["[loading]"] * ("loading" in tables) + [f"stop.{key}" for key in tables.get("stop", {}) if key != "steps"]
    if dropped:
        text = f"{scenario.name}: the strain paths take the place of {', '.join(dropped)}; remove this (stop.steps may stay) to hide the warning"
        warnings.warn(ConcordemWarning(text), stacklevel=2)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / f"chunk-{k:05d}.h5" for k in range(-(-count // batch))]
    for file in sorted(folder.glob("chunk-*.h5")):
        if file not in files or _made_by(file) != (settings, scenario.text):
            raise InferenceError(f"{file} has paths of another scenario or other settings; choose another folder, or remove the file")
    shown = bar() if progress else None
    try:
        for k, file in enumerate(files):
            if not file.exists():
                numbers = range(k * batch, min((k + 1) * batch, count))
                packing = packings[k % len(packings)]
                columns = _answers(scenario, packing, _paths(numbers, seed, steps, amplitude, kinds), substeps, stiffness, threads)
                columns |= {"kind": np.array([n % len(kinds) for n in numbers]), "packing": np.full(len(numbers), packing), "path": np.array(numbers)}
                _write(file, columns, {"settings": settings, "scenario": scenario.text, "kinds": ",".join(kinds)})
            if shown is not None:
                shown(f"{k + 1} of {len(files)} files", (k + 1) / len(files))
    finally:
        if shown is not None:
            shown.close()
    return files


def load(folder: str | PathLike[str]) -> dict[str, NDArray[Any]]:
    """All paths that :func:`strain_paths` has written into a folder: the datasets of its files, joined.

    Raises
    ------
    FileNotFoundError : the folder has no such file. ImportError : h5py is missing.
    """
    h5py = _h5py()
    files = sorted(Path(folder).glob("chunk-*.h5"))
    if not files:
        raise FileNotFoundError(f"{folder} has no file chunk-*.h5; write some with concordem.datasets.strain_paths")
    parts: list[dict[str, NDArray[Any]]] = []
    for path in files:
        with h5py.File(path, "r") as file:
            parts.append({name: data[()] for name, data in file.items()})
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _h5py() -> Any:
    try:
        import h5py
    except ImportError as error:
        raise ImportError("h5py is missing; install it with: python -m pip install 'concordem[inference]'") from error
    return h5py


def _made_by(path: Path) -> tuple[str, str]:
    with _h5py().File(path, "r") as file:
        return str(file.attrs.get("settings", "")), str(file.attrs.get("scenario", ""))


def _paths(numbers: range, seed: int, steps: int, amplitude: float, kinds: Sequence[str]) -> Reals:
    """Strain tensors of paths, (p, steps + 1, 3, 3); each depends on its number alone."""
    found = np.zeros((len(numbers), steps + 1, 3, 3))
    for row, number in enumerate(numbers):
        random = np.random.default_rng([seed, number])
        largest = amplitude * random.uniform(0.3, 1.0)
        at = np.linspace(0.0, 1.0, steps + 1)
        kind = kinds[number % len(kinds)]
        if kind == "random-walk":
            increments = random.normal(size=(steps, 3, 3))
            path = np.concatenate([np.zeros((1, 3, 3)), np.cumsum(increments, axis=0)])
        else:
            course = at if kind == "proportional" else np.interp(at, [0.0, 0.2, 0.4, 0.8, 1.0], [0.0, 0.6, 0.0, 1.0, 0.2])
            path = course[:, None, None] * random.normal(size=(3, 3))
        path = (path + path.transpose(0, 2, 1)) / 2
        found[row] = path * largest / np.sqrt((path**2).sum((1, 2))).max()
    return found


def _answers(scenario: Scenario, packing: int, paths: Reals, substeps: int, stiffness: bool, threads: int | None) -> dict[str, NDArray[Any]]:
    """What cells answer along their paths."""
    count, states = paths.shape[:2]
    tables = scenario.with_settings({"packing.seed": packing}).to_dict()
    # The paths take the place of both.
    tables.pop("loading", None)
    tables["stop"] = {"steps": states * substeps}
    cells = RepresentativeCells(Scenario.from_dict(tables), count, threads=threads)
    first = cells.response()
    columns: dict[str, NDArray[Any]] = {name: np.full((count, states, 6), np.nan) for name in ("strain", "stress", "damage")}
    columns |= {name: np.full((count, states), np.nan) for name in ("work", "bonds")}
    columns["couple_stress"] = np.full((count, states, 3, 3), np.nan)
    if stiffness:
        columns["stiffness"] = np.full((count, states, 6, 6), np.nan)
    columns["strain"][:] = paths[:, :, _ROWS, _COLUMNS] * np.where(_ROWS == _COLUMNS, 1.0, 2.0)
    alive = np.ones(count, bool)
    for state in range(states):
        if state:
            gradient = np.eye(3) + paths[:, state]
            gradient[~alive] = cells.deformation_gradient[~alive]
            try:
                cells.deform(gradient, substeps)
            except ContinuumError:
                # The others have moved.
                followed = np.abs(cells.deformation_gradient - gradient).max((1, 2)) < 1e-12
                lost = alive & ~followed
                if not lost.any() and alive.all():
                    raise
                alive &= followed
            if not alive.any():
                break
        answer = cells.response()
        stress = (answer.stress + answer.stress.transpose(0, 2, 1)) / 2
        columns["stress"][alive, state] = stress[alive][:, _ROWS, _COLUMNS]
        columns["couple_stress"][alive, state] = answer.couple_stress[alive]
        if answer.damage_tensor is not None:
            columns["damage"][alive, state] = answer.damage_tensor[alive][:, _ROWS, _COLUMNS]
        columns["work"][alive, state] = (answer.work / first.volume)[alive]
        columns["bonds"][alive, state] = (answer.bonds / np.maximum(first.bonds, 1))[alive]
        if stiffness:
            columns["stiffness"][alive, state] = cells.stiffness()[alive]
    return columns


def _write(path: Path, columns: dict[str, NDArray[Any]], attributes: dict[str, str]) -> None:
    """A file that is there only when it is complete."""
    h5py = _h5py()
    temporary = path.with_suffix(f".{os.getpid()}.part")
    try:
        with h5py.File(temporary, "w", libver=("earliest", "v110")) as file:
            file.attrs.update(attributes)
            for name in sorted(columns):
                file.create_dataset(name, data=columns[name], track_times=False).attrs["unit"] = _UNITS[name]
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
