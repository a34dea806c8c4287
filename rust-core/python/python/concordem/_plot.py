"""Curves of samples with matplotlib, which is optional."""

from __future__ import annotations

import tomllib
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._core import Result, Simulation
from ._types import Reals, units

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["plot"]

_FITTED_SHARE = 0.3
"""Share of the peak stress up to which E is fitted; that of reports (rust-core/app/src/report/figures.rs)."""
_STILL_RISING = 0.999
"""Share of the largest stress at the end above which it is no peak; that of reports."""
_SCATTER = 1.0 / 3.0
"""Largest standard error of E, as a fraction of it; that of reports."""
_LEAST_STRAIN = 1e-12
"""Least range of strains to which E is fitted: smaller ones are rounding errors; that of reports."""


def plot(
    source: Simulation | Result | NDArray[np.void], x: str | None = None, y: str | None = None, axes: Axes | None = None, **style: Any
) -> Axes:
    """Plot one sampled quantity over another with matplotlib, and return the axes.

    ``source``: a simulation (its samples so far), a result, or a structured array such as ``simulation.operator_samples["name"]``.
    ``x`` and ``y``: names of quantities, such as "time", "broken", or "kinetic". Without them: stress over strain if both are measured,
    else kinetic energy over time. ``axes``: where to draw; by default new axes. Axes that have labels keep them, and without ``x`` and ``y``
    get the curve that they name. Other arguments go to ``Axes.plot``.

    Numbers are in SI units, as in the samples; labels show the unit. On a curve of stress over strain a dot marks the stress of largest
    magnitude, unless it is that of the end. Of tests in direct tension or compression a dotted line shows E, fitted as in reports: least
    squares from the first sample to the last one before the stress exceeds 30 % of its peak. Over the strain between the ends, which contains
    that of the rigid end layers, the legend gives E of the middle half first.

    >>> import concordem
    >>> simulation = concordem.Scenario.template("hertz-impact").simulation(threads=1)
    >>> reason = simulation.step(20)
    >>> axes = concordem.plot(simulation)
    >>> axes.get_ylabel()
    'kinetic, J'
    >>> simulation.plot("time", "friction", axes=axes, label="friction") is axes
    True
    """
    samples = source if isinstance(source, np.ndarray) else source.samples
    if not samples.dtype.names:
        raise TypeError("plot needs a simulation, a result, or a structured array with named columns")
    if x is None and y is None:
        x, y = _default(samples) if axes is None else _of_labels(samples, axes)
    elif x is None:
        x = "time"
    elif y is None:
        raise TypeError(f"plot got x = {x!r} without y; name the quantity of the vertical axis, such as y='stress'")
    assert y is not None
    across, up = _column(samples, x), _column(samples, y)
    own_axes = axes is None
    if axes is None:
        try:
            from matplotlib import pyplot
        except ImportError as error:
            raise ImportError("matplotlib is missing; install it with: python -m pip install matplotlib") from error
        axes = pyplot.subplots()[1]
    (curve,) = axes.plot(across, up, **style)
    if not axes.get_xlabel():
        axes.set_xlabel(_label(samples, x))
    if not axes.get_ylabel():
        axes.set_ylabel(_label(samples, y))
    if own_axes:
        # Powers of ten beside the axis, because numbers are in SI units. Axes of others may have scales that refuse this.
        axes.ticklabel_format(scilimits=(-3, 4))
    if x in ("strain", "gauge_strain") and y == "stress":
        middle = samples["gauge_strain"] if x == "strain" and "gauge_strain" in samples.dtype.names else None
        _mark(axes, curve.get_color(), across, up, middle, _is_axial(source))
    return axes


def _method(
    self: Simulation | Result, x: str | None = None, y: str | None = None, axes: Axes | None = None, **style: Any
) -> Axes:
    """Plot one sampled quantity over another with matplotlib; see `concordem.plot`."""
    return plot(self, x, y, axes, **style)


def _default(samples: NDArray[np.void]) -> tuple[str, str]:
    """The names of x and y that show most."""
    names = samples.dtype.names or ()
    # Runs without loading record zeros.
    if {"strain", "stress"} <= set(names) and np.any(samples["strain"] != 0) and np.any(samples["stress"] != 0):
        return "strain", "stress"
    if {"time", "kinetic"} <= set(names):
        return "time", "kinetic"
    raise TypeError(f"these samples have no default curve; choose x and y from: {', '.join(names)}")


def _of_labels(samples: NDArray[np.void], axes: Axes) -> tuple[str, str]:
    """The names of x and y that the labels of these axes show; without labels, those of new axes."""
    labels = axes.get_xlabel(), axes.get_ylabel()
    if labels == ("", ""):
        return _default(samples)
    known = {_label(samples, name): name for name in samples.dtype.names or ()}
    if labels[0] not in known or labels[1] not in known:
        raise ValueError(f"the axes show {labels[1]!r} over {labels[0]!r}, which these samples do not name so; choose x and y")
    return known[labels[0]], known[labels[1]]


def _column(samples: NDArray[np.void], name: str) -> Reals:
    names = samples.dtype.names or ()
    if name not in names:
        raise ValueError(f"there is no quantity {name!r}; choose from: {', '.join(names)}")
    column: Reals = samples[name]
    if column.ndim > 1:
        raise ValueError(f"{name!r} has several components {column.shape[1:]}; plot one with matplotlib, such as table[{name!r}][:, 0]")
    return column


def _label(samples: NDArray[np.void], name: str) -> str:
    """Name and unit; quantities without dimension have no unit."""
    unit = units(samples)[name]
    title = name.replace("_", " ")
    return title if unit == "1" else f"{title}, {unit}"


def _is_axial(source: Simulation | Result | NDArray[np.void]) -> bool:
    """Whether the stress is that of a cross-section in direct tension or compression, so that the slope is E."""
    if isinstance(source, np.ndarray):
        return False
    text = source.scenario_text if isinstance(source, Result) else source.scenario.text
    loading = tomllib.loads(text).get("loading", {})
    kind, area = loading.get("kind"), loading.get("area")
    return bool(kind == "uniaxial" or (kind == "platens" and area != "splitting"))


def _mark(axes: Axes, color: Any, strain: Reals, stress: Reals, middle: Reals | None, axial: bool) -> None:
    """Mark the peak, and draw the line of E of direct tests; `middle`: strain of the middle half, beside that between the ends."""
    known = np.isfinite(strain) & np.isfinite(stress)
    strain, stress, middle = strain[known], stress[known], None if middle is None else middle[known]
    if not np.any(stress):
        return
    at = int(np.argmax(np.abs(stress)))
    peak = float(stress[at])
    if abs(stress[-1]) <= _STILL_RISING * abs(peak):
        axes.plot([strain[at]], [peak], "o", color=color, label=f"peak: {peak / 1e6:.4g} MPa at a strain of {strain[at]:.3g}")
    modulus = _slope(strain, stress, _FITTED_SHARE * abs(peak)) if axial else None
    if modulus is not None and modulus > 0:
        within = None if middle is None else _slope(middle, stress, _FITTED_SHARE * abs(peak))
        text = f"E = {modulus / 1e9:.4g} GPa"
        if within is not None:
            # The rigid end layers count in the strain between the ends.
            text = f"E = {within / 1e9:.4g} GPa in the middle half, {modulus / 1e9:.4g} GPa between the ends"
        axes.plot([0.0, peak / modulus], [0.0, peak], ":", color=color, label=text)
    if axes.get_legend_handles_labels()[1]:
        axes.legend()


def _slope(strain: Reals, stress: Reals, limit: float) -> float | None:
    """Slope of the least-squares line through the samples before the stress first exceeds the limit; None with fewer than three, and where they
    lie on no line."""
    above = np.abs(stress) > limit
    count = int(np.argmax(above)) if above.any() else len(stress)
    if count < 3 or np.ptp(strain[:count]) < _LEAST_STRAIN:
        return None
    x, y = strain[:count] - strain[:count].mean(), stress[:count] - stress[:count].mean()
    square = float(x @ x)
    slope = float(x @ y) / square
    left = y - slope * x
    error = float(np.sqrt(left @ left / (count - 2) / square))
    return slope if error <= _SCATTER * abs(slope) else None
