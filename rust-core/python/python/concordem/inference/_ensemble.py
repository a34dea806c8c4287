"""Runs at many values of the parameters, and what they gave."""

from __future__ import annotations

import tomllib
import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .._core import Scenario, Simulation
from .._errors import ConcordemError, ConcordemWarning, InferenceError
from .._types import units
from ._optional import needed
from ._quantities import Reals, quantity, reals

if TYPE_CHECKING:
    from ._emulator import Emulator

_SCALES = {"linear": "linear", "logarithmic": "logarithmic", "log": "logarithmic"}
_FORMAT = 1


@dataclass(frozen=True)
class Parameter:
    """One parameter of an ensemble: its name and the range in which it was varied."""

    name: str
    """Name, such as "young"."""
    low: float
    """Least value, SI unit."""
    high: float
    """Largest value, SI unit."""
    scale: str = "linear"
    """"linear", or "logarithmic": equal ratios are equally probable."""
    unit: str = ""
    """SI unit; empty if it is not known."""

    def __post_init__(self) -> None:
        if self.scale not in _SCALES:
            raise InferenceError(f"the scale of {self.name!r} is {self.scale!r}; give 'linear' or 'logarithmic'")
        object.__setattr__(self, "scale", _SCALES[self.scale])
        if not (np.isfinite(self.low) and np.isfinite(self.high) and self.low < self.high):
            raise InferenceError(f"{self.name!r} ranges from {self.low} to {self.high}; give a finite low bound and a higher high bound")
        if self.scale == "logarithmic" and self.low <= 0:
            raise InferenceError(f"{self.name!r} ranges from {self.low} on a logarithmic scale; give a positive bound, or the scale 'linear'")

    def to_unit(self, values: ArrayLike) -> Reals:
        """Values as fractions of the range: 0 is ``low``, 1 is ``high``, on the scale of the parameter."""
        values = np.asarray(values, np.float64)
        if self.scale == "logarithmic":
            found: Reals = np.log(values / self.low) / np.log(self.high / self.low)
            return found
        return (values - self.low) / (self.high - self.low)

    def from_unit(self, fractions: ArrayLike) -> Reals:
        """Values at fractions of the range."""
        fractions = np.asarray(fractions, np.float64)
        if self.scale == "logarithmic":
            found: Reals = self.low * (self.high / self.low) ** fractions
            return found
        return self.low + (self.high - self.low) * fractions


@dataclass(frozen=True)
class Output:
    """What the runs of an ensemble gave under one name: a curve, or a number."""

    name: str
    x: Reals | None
    """Common abscissa, (m,); None of a number."""
    mean: Reals
    """Mean over the packings, (n, m); m is 1 of a number."""
    deviations: Reals
    """What single packings differ from the mean of their point, (r, m); no rows without repeated points."""
    unit: str = ""
    x_unit: str = ""


def _parameter(key: str, given: Any) -> Parameter:
    """A parameter from what users give: (low, high), or (low, high, scale)."""
    if isinstance(given, Parameter):
        return given
    if not isinstance(given, Sequence) or isinstance(given, str) or not 2 <= len(given) <= 3:
        raise InferenceError(f"the range of {key!r} is {given!r}; give (low, high), (low, high, 'logarithmic'), or a Parameter")
    (low, first), (high, second) = (quantity(value, f"a bound of {key!r}") for value in given[:2])
    if first != second and None not in (first, second) and 0.0 not in (low, high):
        raise InferenceError(f"the bounds of {key!r} are in {first} and {second}; give the same unit")
    return Parameter(key, low, high, given[2] if len(given) == 3 else "linear", first or second or "")


class Ensemble:
    """Runs at n values of d parameters: curves on a common abscissa, and numbers.

    Make one by :meth:`from_sweep`, :meth:`run`, :meth:`from_model`, or :meth:`from_arrays`.
    """

    def __init__(self, parameters: Sequence[Parameter], inputs: Reals, outputs: Sequence[Output], dofs: int = 0, repeats: float = 1.0) -> None:
        self.parameters = tuple(parameters)
        """The parameters, in the order of the columns of `inputs`."""
        self.inputs = inputs
        """Values of the parameters, SI units, (n, d)."""
        self.outputs = {output.name: output for output in outputs}
        """Curves and numbers by name."""
        self.degrees_of_freedom = dofs
        """Repeated runs less points: how well the scatter of the packings is known; 0 without repeated points."""
        self.repeats = repeats
        """Mean number of packings of a point."""
        self._emulators: dict[tuple[str, ...], Emulator] = {}

    def __len__(self) -> int:
        return len(self.inputs)

    def __repr__(self) -> str:
        ranges = ", ".join(f"{one.name} {one.low:g} to {one.high:g}{' ' + one.unit if one.unit else ''}" for one in self.parameters)
        return f"Ensemble of {len(self)} points, {self.repeats:g} packings each ({ranges}): {', '.join(self.outputs)}"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(one.name for one in self.parameters)

    @staticmethod
    def from_arrays(
        parameters: Sequence[Parameter],
        inputs: ArrayLike,
        curves: Mapping[str, tuple[ArrayLike, ArrayLike]] | None = None,
        scalars: Mapping[str, ArrayLike] | None = None,
        units: Mapping[str, str] | None = None,
    ) -> Ensemble:
        """An ensemble of any model.

        Parameters
        ----------
        parameters : d parameters with their ranges, which hold all inputs.
        inputs : values, (n, d). Rows that are equal are runs of different packings: their mean is fitted, their scatter is kept.
        curves : by name the common abscissa (m,) and the ordinates (n, m), in SI units.
        scalars : by name n numbers.
        units : SI units of curves and scalars by name; ``"x of NAME"`` is that of an abscissa.

        Returns
        -------
        Ensemble : rows with values that are not finite are left out with a :class:`~concordem.ConcordemWarning`.

        Raises
        ------
        InferenceError : shapes that do not fit, inputs outside of the ranges, or too few rows.

        >>> import numpy as np
        >>> from concordem.inference import Ensemble, Parameter
        >>> a = np.linspace(1.0, 2.0, 9)[:, None]
        >>> x = np.linspace(0.0, 1.0, 5)
        >>> len(Ensemble.from_arrays([Parameter("a", 1.0, 2.0)], a, curves={"line": (x, a * x)}))
        9
        """
        parameters = list(parameters)
        values = reals(inputs, "inputs", 2)
        n, d = values.shape
        if d != len(parameters) or not d:
            raise InferenceError(f"inputs has {d} columns for {len(parameters)} parameters; give one column for each")
        if len({one.name for one in parameters}) < d:
            raise InferenceError(f"the parameters are {', '.join(one.name for one in parameters)}; give each its own name")
        unit = dict(units or {})
        columns: dict[str, tuple[Reals | None, Reals]] = {}
        for name, (abscissa, ordinates) in (curves or {}).items():
            x, y = reals(abscissa, f"the abscissa of {name!r}", 1), reals(ordinates, f"the curves {name!r}", 2)
            if y.shape != (n, len(x)):
                raise InferenceError(f"the curves {name!r} have the shape {y.shape}; give ({n}, {len(x)}): inputs, then points of the abscissa")
            if len(x) < 2 or not (np.diff(x) > 0).all():
                raise InferenceError(f"the abscissa of {name!r} does not rise at each of its {len(x)} points; sort it")
            columns[name] = x, y
        for name, given in (scalars or {}).items():
            if name in columns:
                raise InferenceError(f"{name!r} is the name of a curve and of a number; rename one of them")
            y = reals(given, f"the numbers {name!r}", 1)
            if y.shape != (n,):
                raise InferenceError(f"there are {len(y)} numbers {name!r} for {n} inputs; give one for each")
            columns[name] = None, y[:, None]
        if not columns:
            raise InferenceError("the ensemble has neither curves nor numbers; give curves= or scalars=")
        if unknown := set(unit) - set(columns) - {f"x of {name}" for name, (across, _) in columns.items() if across is not None}:
            raise InferenceError(f"units has {sorted(unknown)[0]!r}, which is neither a curve nor a number; the names are {', '.join(columns)}")
        good = np.isfinite(values).all(1)
        for _, y in columns.values():
            good &= np.isfinite(y).all(1)
        if not good.all():
            text = f"{n - good.sum()} of {n} runs have no finite values and are left out, the first is run {int(np.argmin(good))}"
            warnings.warn(ConcordemWarning(text), stacklevel=2)
            values, columns = values[good], {name: (x, y[good]) for name, (x, y) in columns.items()}
        for k, one in enumerate(parameters):
            slack = 1e-9 * (one.high - one.low)
            outside = (values[:, k] < one.low - slack) | (values[:, k] > one.high + slack)
            if outside.any():
                raise InferenceError(f"{one.name!r} is {values[outside, k][0]:g} in a run, outside of its range {one.low:g} to {one.high:g}; widen it")
        points, index = np.unique(values, axis=0, return_inverse=True)
        # The order of the first runs, so that points stay where they were.
        first = np.array([np.argmax(index == k) for k in range(len(points))])
        order = np.argsort(first)
        rank = np.empty_like(order)
        rank[order] = np.arange(len(order))
        points, index = points[order], rank[index.ravel()]
        least = 3 * d + 3
        if len(points) < least:
            raise InferenceError(f"the ensemble has {len(points)} points for {d} parameters; run at least {least}, better {20 * d}")
        count = np.bincount(index)
        dofs = int(len(index) - len(points))
        outputs = []
        for name, (across, y) in columns.items():
            mean = np.zeros((len(points), y.shape[1]))
            np.add.at(mean, index, y)
            mean /= count[:, None]
            deviations = (y - mean[index])[count[index] > 1] if dofs else np.empty((0, y.shape[1]))
            outputs.append(Output(name, across, mean, deviations, unit.get(name, ""), unit.get(f"x of {name}", "")))
        return Ensemble(parameters, points, outputs, dofs, float(count.mean()))

    @staticmethod
    def from_sweep(*paths: str | PathLike[str]) -> Ensemble:
        """The ensemble in the result of a sampled sweep (`concordem sweep`), or of several with the same samples, such as tension and compression.

        Axes that are not sampled must be ``packing.seed``: its values repeat each point, so that their mean is fitted, and their scatter
        is that of the packings. Names that several files have get the name of the file before them: ``"compression E"``.

        Parameters
        ----------
        paths : results whose sweeps have the same axes and the same table ``[sampling]``, but other scenarios.

        Raises
        ------
        FileNotFoundError : there is no such file. InferenceError : no sweep, one without sampled axes, or files with other samples.
        """
        if not paths:
            raise InferenceError("there is no file; give the result of a sampled sweep")
        files = [_read_sweep(Path(path)) for path in paths]
        first = files[0]
        for path, file in zip(paths, files):
            if file.parameters != first.parameters or not np.array_equal(file.inputs, first.inputs):
                raise InferenceError(f"{path} has other samples than {paths[0]}; write the same axes and [sampling] into all sweeps")
        names = [name for file in files for name in (*file.curves, *file.scalars)]
        curves: dict[str, tuple[Reals, Reals]] = {}
        scalars: dict[str, Reals] = {}
        known: dict[str, str] = {}
        for path, file in zip(paths, files):
            label = {name: f"{Path(path).stem} {name}" if names.count(name) > 1 else name for name in (*file.curves, *file.scalars)}
            if twice := sorted((set(curves) | set(scalars)) & set(label.values())):
                raise InferenceError(f"two files give {twice[0]!r}; give the files other names")
            curves |= {label[name]: curve for name, curve in file.curves.items()}
            scalars |= {label[name]: values for name, values in file.scalars.items()}
            for name, new in label.items():
                known |= {of + new: file.units[of + name] for of in ("", "x of ") if of + name in file.units}
        return Ensemble._lenient(first.parameters, first.inputs, curves, scalars, known, ", ".join(map(str, paths)))

    @staticmethod
    def _lenient(
        parameters: Sequence[Parameter],
        inputs: Reals,
        curves: Mapping[str, tuple[Reals, Reals]],
        scalars: Mapping[str, Reals],
        known: Mapping[str, str],
        path: str,
    ) -> Ensemble:
        """As :meth:`from_arrays`; numbers that fewer runs have than most are left out, not the runs."""
        lacking = {name: int((~np.isfinite(np.asarray(values, np.float64))).sum()) for name, values in scalars.items()}
        lacking |= {name: int((~np.isfinite(y)).any(1).sum()) for name, (_, y) in curves.items()}
        if not lacking:
            raise InferenceError(f"{path} has neither curves nor numbers; name results or curves in the sweep file")
        fewest = min(lacking.values())
        left = sorted(name for name, count in lacking.items() if count > max(2 * fewest, 0.2 * len(inputs)))
        if left:
            text = f"{path}: {', '.join(left)} left out: {lacking[left[0]]} of {len(inputs)} runs have no finite {left[0]!r}"
            warnings.warn(ConcordemWarning(text), stacklevel=3)
        return Ensemble.from_arrays(
            parameters,
            inputs,
            {name: curve for name, curve in curves.items() if name not in left},
            {name: values for name, values in scalars.items() if name not in left},
            {name: unit for name, unit in known.items() if name.removeprefix("x of ") not in left},
        )

    @staticmethod
    def from_model(
        model: Callable[[dict[str, float]], Any],
        priors: Mapping[str, Any],
        *,
        count: int = 64,
        x: ArrayLike | None = None,
        seed: int = 1,
        jobs: int = 1,
        name: str = "curve",
    ) -> Ensemble:
        """Call a model at points of a Sobol sequence (Sobol 1967, scrambled as in `scipy.stats.qmc`).

        Parameters
        ----------
        model : function of a dictionary of values by name, SI units. With ``x`` it returns ordinates at ``x``, (m,); without, a dictionary of
            numbers by name.
        priors : by name ``(low, high)``, ``(low, high, "logarithmic")``, or a :class:`Parameter`. Bounds may carry units: ``("20 GPa", "40 GPa")``.
        count : number of points; powers of two fill the ranges best.
        x : abscissa, (m,). seed : of the sequence. jobs : threads that call the model at the same time. name : of the curve.

        Raises
        ------
        InferenceError : as :meth:`from_arrays`.

        >>> from concordem.inference import Ensemble
        >>> ensemble = Ensemble.from_model(lambda values: {"area": values["a"] * values["b"]}, {"a": (1, 2), "b": (1, 2)}, count=16)
        >>> len(ensemble), ensemble.names
        (16, ('a', 'b'))
        """
        parameters = [_parameter(key, given) for key, given in priors.items()]
        inputs = _sobol(parameters, count, seed)
        points = [dict(zip((one.name for one in parameters), map(float, row))) for row in inputs]
        found = _in_threads(model, points, jobs)
        if x is not None:
            ordinates = [reals(values, f"the model's answer at {point}", 1) for values, point in zip(found, points)]
            return Ensemble.from_arrays(parameters, inputs, curves={name: (x, np.array(ordinates))})
        if not all(isinstance(values, Mapping) and values.keys() == found[0].keys() for values in found):
            raise InferenceError("the model returns no dictionary with the same names at every point; return one, or give the abscissa x=")
        return Ensemble.from_arrays(parameters, inputs, scalars={key: np.array([values[key] for values in found], float) for key in found[0]})

    @staticmethod
    def run(
        scenario: Scenario,
        priors: Mapping[str, Any],
        *,
        curve: tuple[str, str] | None = ("strain", "stress"),
        numbers: Mapping[str, Callable[[Simulation], float]] | None = None,
        count: int = 64,
        x: ArrayLike | int = 50,
        packings: Sequence[int] = (),
        seed: int = 1,
        jobs: int = 1,
        progress: bool = False,
    ) -> Ensemble:
        """Run a scenario at points of a Sobol sequence.

        Parameters
        ----------
        scenario : runs to its end at every point.
        priors : ranges by key, such as ``{"material[0].cpm.young": ("20 GPa", "40 GPa")}``; see :meth:`from_model`. The last part of the key
            is the name of the parameter, unless two keys end alike.
        curve : the sampled quantities of abscissa and ordinate; None: no curve. The curve gets the name of the ordinate.
        numbers : functions of the finished simulation by name, such as ``{"peak": lambda run: run.samples["stress"].max()}``.
        count : number of points. x : abscissa in SI units, or the number of equal steps up to where the shortest run ends.
        packings : seeds of the packing; every point runs with each of them; four say how much
            packings scatter. Empty: the seed of the scenario alone.
        seed : of the Sobol sequence. jobs : runs at the same time, in threads: a run holds no lock of Python.
        progress : show a bar.

        Returns
        -------
        Ensemble : the same to the bit for any number of jobs.

        Raises
        ------
        ScenarioError : a key or value that no scenario has. InferenceError : a curve that is shorter than ``x``; as :meth:`from_arrays`.
        """
        if not isinstance(scenario, Scenario):
            raise InferenceError(f"the scenario is a {type(scenario).__name__}; make one by Scenario.from_file or Scenario.template")
        if curve is None and not numbers:
            raise InferenceError("there is nothing to compare; give curve=('strain', 'stress'), or numbers=")
        keys = list(priors)
        short = [key.rpartition(".")[2] for key in keys]
        names = [key if short.count(last) > 1 else last for key, last in zip(keys, short)]
        parameters = []
        for key, name in zip(keys, names):
            one = _parameter(key, priors[key])
            parameters.append(one if isinstance(priors[key], Parameter) else Parameter(name, one.low, one.high, one.scale, one.unit))
        inputs = _sobol(parameters, count, seed)
        seeds: list[int | None] = list(packings) or [None]
        settings = [
            {**dict(zip(keys, map(float, row))), **({} if packing is None else {"packing.seed": packing})}
            for row in inputs
            for packing in seeds
        ]
        known: dict[str, str] = {}

        def one_run(changed: dict[str, Any]) -> tuple[Reals, Reals, dict[str, float]]:
            simulation = scenario.with_settings(changed).simulation(threads=1, snapshots=False)
            simulation.run()
            measured = {name: float(function(simulation)) for name, function in (numbers or {}).items()}
            if curve is None:
                return np.empty(0), np.empty(0), measured
            samples = simulation.samples
            for name in curve:
                if name not in (samples.dtype.names or ()):
                    raise InferenceError(f"there is no sampled quantity {name!r}; choose from {', '.join(samples.dtype.names or ())}")
            known[curve[1]], known[f"x of {curve[1]}"] = units(samples)[curve[1]], units(samples)[curve[0]]
            across, up = samples[curve[0]], samples[curve[1]]
            # Compression counts downwards; the first passage of each value counts.
            sign = -1.0 if across[-1] < 0 else 1.0
            new = np.concatenate([[True], sign * across[1:] > np.maximum.accumulate(sign * across)[:-1]])
            return across[new], up[new], measured

        found = _in_threads(one_run, settings, jobs, progress)
        values = np.repeat(inputs, len(seeds), axis=0)
        curves = {}
        if curve is not None:
            ends = np.array([across[-1] for across, _, _ in found])
            if (ends > 0).any() and (ends < 0).any():
                raise InferenceError(f"{curve[0]!r} ends at {ends.min():g} and at {ends.max():g}; use one direction of loading for all runs")
            shortest = int(np.argmin(np.abs(ends)))
            if isinstance(x, int):
                abscissa = np.sort(np.linspace(0.0, ends[shortest], x + 1))
            else:
                abscissa = reals(x, "x", 1)
                if np.abs(abscissa).max() > abs(ends[shortest]) * (1 + 1e-9):
                    raise InferenceError(
                        f"x reaches {abscissa[np.argmax(np.abs(abscissa))]:g}, but a run ends at {ends[shortest]:g} ({settings[shortest]}); "
                        "shorten x, or let runs go on ([stop])"
                    )
            flip = -1 if ends[0] < 0 else 1
            rows = [np.interp(abscissa, across[::flip], up[::flip]) for across, up, _ in found]
            curves[curve[1]] = abscissa, np.array(rows)
        scalars = {name: np.array([measured[name] for _, _, measured in found]) for name in numbers or {}}
        return Ensemble.from_arrays(parameters, values, curves, scalars, known)

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the ensemble to an .npz file, from which :meth:`load` reads it."""
        path = Path(path)
        if path.suffix != ".npz":
            raise InferenceError(f"the name {path.name!r} does not end in .npz; choose another")
        arrays: dict[str, Any] = {"format": _FORMAT, "inputs": self.inputs, "dofs": self.degrees_of_freedom, "repeats": self.repeats}
        arrays["parameters"] = np.array([[one.name, repr(one.low), repr(one.high), one.scale, one.unit] for one in self.parameters])
        arrays["outputs"] = np.array([[one.name, one.unit, one.x_unit] for one in self.outputs.values()])
        for k, one in enumerate(self.outputs.values()):
            arrays[f"mean_{k}"], arrays[f"deviations_{k}"] = one.mean, one.deviations
            if one.x is not None:
                arrays[f"x_{k}"] = one.x
        np.savez_compressed(path, **arrays)
        return path

    @staticmethod
    def load(path: str | PathLike[str]) -> Ensemble:
        """Read an ensemble that :meth:`save` has written."""
        path = Path(path)
        if not path.exists():
            raise FileNotFoundError(f"{path} does not exist; write it with Ensemble.save")
        try:
            with np.load(path, allow_pickle=False) as file:
                parameters = [Parameter(name, float(low), float(high), scale, unit) for name, low, high, scale, unit in file["parameters"].tolist()]
                outputs = [
                    Output(name, file[f"x_{k}"] if f"x_{k}" in file else None, file[f"mean_{k}"], file[f"deviations_{k}"], unit, x_unit)
                    for k, (name, unit, x_unit) in enumerate(file["outputs"].tolist())
                ]
                return Ensemble(parameters, file["inputs"], outputs, int(file["dofs"]), float(file["repeats"]))
        except (OSError, ValueError, KeyError) as error:
            raise InferenceError(f"{path} is no ensemble that Ensemble.save has written ({error})") from error

    def emulator(self, names: Sequence[str] | None = None) -> Emulator:
        """The fitted emulator of these outputs (default: all); it is fitted once. See :class:`Emulator`."""
        from ._emulator import Emulator

        chosen = tuple(self.outputs) if names is None else tuple(names)
        for name in chosen:
            if name not in self.outputs:
                raise InferenceError(f"the ensemble has no {name!r}; it has {', '.join(self.outputs)}")
        if chosen not in self._emulators:
            self._emulators[chosen] = Emulator(self, chosen)
        return self._emulators[chosen]


def _only_packings_repeat(path: Path, sweep: dict[str, Any]) -> None:
    """Refuse axes that are neither sampled nor seeds: their values would count as packings."""
    for axis in sweep.get("axis", []):
        keys = axis.get("keys", [axis.get("key", "")])
        ranges = [axis[kind] for kind in ("linear", "logarithmic") if kind in axis]
        several = len(axis.get("values", [])) > 1 or any("count" in given for given in ranges)
        if several and not axis.get("average") and not any(key.endswith("seed") for key in keys):
            raise InferenceError(
                f"{path}: the values of {', '.join(keys)} would count as packings of one material; sample them (a range without count), write average = true "
                "into the axis if they only scatter, or compute one sweep for each value and give all files"
            )


class _SweepFile(NamedTuple):
    """What the result of a sampled sweep holds."""

    parameters: list[Parameter]
    inputs: Reals
    curves: dict[str, tuple[Reals, Reals]]
    scalars: dict[str, Reals]
    units: dict[str, str]


def _read_sweep(path: Path) -> _SweepFile:
    if not path.exists():
        raise FileNotFoundError(f"{path} does not exist; write it with: concordem sweep SWEEP.toml")
    h5py = needed("h5py")
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise InferenceError(f"{path} is no HDF5 file; give the result of a sampled sweep, or Ensemble.load for an .npz") from error
    with file:
        if "axes" not in file or "points" not in file:
            raise InferenceError(f"{path} is no result of a sweep; write one with: concordem sweep SWEEP.toml")
        parameters: list[Parameter] = []
        columns: list[Reals] = []
        points = file["points"]
        if "sweep" in file:
            _only_packings_repeat(path, tomllib.loads(_text(file["sweep"][()])))
        for label in sorted(file["axes"], key=lambda one: int(one.split(" ")[0]) if one.split(" ")[0].isdigit() else 0):
            axis = file["axes"][label]
            number, _, name = label.partition(" ")
            if not number.isdigit():
                number, name = str(len(columns)), label
            if not axis.attrs.get("sampled", 0):
                continue
            low, high, scale = float(axis.attrs["from"]), float(axis.attrs["to"]), _text(axis.attrs.get("scale", "linear"))
            parameters.append(Parameter(name, low, high, scale, _unit(axis)))
            columns.append(np.asarray(axis[()], np.float64)[np.asarray(points[f"axis_{number}"][()], np.int64)])
        if not parameters:
            raise InferenceError(f"{path} has no sampled axis; give axes a range without count, such as linear = {{ from = 2e10, to = 4e10 }}")
        units: dict[str, str] = {}
        curves, scalars = {}, {}
        for name, group in file["curves"].items() if "curves" in file else ():
            # Compression counts downwards.
            way = -1 if group["x"][0] > group["x"][-1] else 1
            curves[name] = group["x"][()][::way], group["y"][()][:, ::way]
            units[name], units[f"x of {name}"] = _unit(group["y"]), _unit(group["x"])
        for name, data in points.items():
            values = data[()]
            # What no run has is empty.
            if name.startswith("axis_") or values.ndim != 1 or values.dtype.kind not in "fiu" or np.isnan(np.asarray(values, np.float64)).all():
                continue
            scalars[name] = values
            units[name] = _unit(data)
    return _SweepFile(parameters, np.stack(columns, 1), curves, scalars, units)


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


def _unit(data: Any) -> str:
    return _text(data.attrs.get("unit", ""))


def _sobol(parameters: Sequence[Parameter], count: int, seed: int) -> Reals:
    """Points of a scrambled Sobol sequence in the ranges, (count, d)."""
    if not parameters:
        raise InferenceError("priors is empty; give ranges, such as {'young': ('20 GPa', '40 GPa')}")
    least = 3 * len(parameters) + 3
    if count < least:
        raise InferenceError(f"count is {count}; {len(parameters)} parameters need at least {least} points, better {20 * len(parameters)}")
    needed("scipy")
    from scipy.stats import qmc

    with warnings.catch_warnings():
        # Other numbers than powers of two are allowed.
        warnings.simplefilter("ignore", UserWarning)
        fractions = qmc.Sobol(len(parameters), scramble=True, rng=np.random.default_rng(seed)).random(count)
    return np.stack([one.from_unit(fractions[:, k]) for k, one in enumerate(parameters)], 1)


def _in_threads(function: Callable[[Any], Any], points: Sequence[Any], jobs: int, progress: bool = False) -> list[Any]:
    """The function's answers in the order of the points; an error names its point."""
    if jobs < 1:
        raise InferenceError(f"jobs is {jobs}; give at least 1")
    from .._progress import bar

    shown = bar() if progress else None
    done = 0

    def call(point: Any) -> Any:
        nonlocal done
        try:
            answer = function(point)
        except ConcordemError as error:
            error.add_note(f"at {point}")
            raise
        done += 1
        if shown is not None:
            shown(f"{done} of {len(points)} runs", done / len(points))
        return answer

    try:
        if jobs == 1:
            return [call(point) for point in points]
        with ThreadPoolExecutor(jobs) as pool:
            answers = [pool.submit(call, point) for point in points]
            try:
                return [answer.result() for answer in answers]
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise
    finally:
        if shown is not None:
            shown.close()
