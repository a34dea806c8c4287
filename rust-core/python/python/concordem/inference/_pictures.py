"""Corner plots and predictive bands with matplotlib."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import numpy as np

from ._optional import needed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ._ensemble import Parameter
    from ._posterior import Posterior

_COLOR = "#1f5f8b"


_PREFIXES = {9: "G", 6: "M", 3: "k", 0: "", -3: "m", -6: "µ", -9: "n"}


def _scale(largest: float, unit: str) -> tuple[float, str]:
    """The unit in which numbers up to `largest` SI units are short, as its size and its name."""
    power = math.floor(math.log10(largest)) if largest > 0 else 0
    if unit in ("", "1"):
        return (1.0, "") if -2 <= power <= 3 else (10.0**power, f"$10^{{{power}}}$")
    if not re.match(r"(Pa|N|J|W|Hz|m|s)(?!\w|\^)", unit):
        return 1.0, unit
    power = min(max(3 * (power // 3), -9), 9)
    return 10.0**power, _PREFIXES[power] + unit


def _label(name: str, unit: str) -> str:
    title = name.replace("_", " ")
    return f"{title}, {unit}" if unit else title


def _short(axis: Any, size: float) -> None:
    """Short numbers at the ticks of an axis in SI units."""
    from matplotlib import ticker

    axis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value / size:.3g}"))


def _ticks(axis: Any, parameter: Parameter, size: float) -> None:
    """Three ticks with short numbers."""
    from matplotlib import ticker

    axis.set_major_locator(ticker.FixedLocator([float(f"{value:.2g}") for value in parameter.from_unit([0.1, 0.5, 0.9])]))
    _short(axis, size)
    axis.set_minor_locator(ticker.NullLocator())


def corner(of: Posterior) -> Figure:
    """Distribution of each parameter, and samples of each pair."""
    needed("matplotlib")
    from matplotlib import pyplot

    parameters = of.ensemble.parameters
    d = len(parameters)
    figure, grid = pyplot.subplots(d, d, figsize=(2.1 * d + 0.8, 2.1 * d + 0.4), squeeze=False, layout="constrained")
    intervals = of.interval(0.9)
    scales = [_scale(max(abs(one.low), abs(one.high)), one.unit) for one in parameters]
    for row, up in enumerate(parameters):
        for column, across in enumerate(parameters):
            axes: Any = grid[row, column]
            if column > row:
                axes.set_axis_off()
                continue
            axes.set_xlim(across.low, across.high)
            if across.scale == "logarithmic":
                axes.set_xscale("log")
            size, unit = scales[column]
            _ticks(axes.xaxis, across, size)
            if row == column:
                edges = across.from_unit(np.linspace(0, 1, 41))
                # Of one parameter each bin is as wide on its scale.
                axes.hist(of.samples[across.name], edges, color=_COLOR, alpha=0.5, weights=np.full(len(of.samples), 1 / len(of.samples)))
                for end in intervals[across.name]:
                    axes.axvline(end, color=_COLOR, linestyle=":")
                axes.set_yticks([])
                axes.set_title(f"{of.means[across.name] / size:.3g} ± {of.standard_deviations[across.name] / size:.2g}", fontsize="small")
            else:
                some = slice(None, None, max(1, len(of.samples) // 2000))
                axes.plot(of.samples[across.name][some], of.samples[up.name][some], ".", color=_COLOR, alpha=0.15, markersize=2)
                axes.set_ylim(up.low, up.high)
                if up.scale == "logarithmic":
                    axes.set_yscale("log")
                _ticks(axes.yaxis, up, scales[row][0])
                if column == 0:
                    axes.set_ylabel(_label(up.name, scales[row][1]))
                else:
                    axes.tick_params(labelleft=False)
            if row == d - 1:
                axes.set_xlabel(_label(across.name, unit))
            else:
                axes.tick_params(labelbottom=False)
            axes.tick_params(labelsize="x-small")
    return figure


def band(of: Posterior, name: str | None, axes: Axes | None, probability: float) -> Axes:
    """The measured curve over the band that the posterior expects."""
    needed("matplotlib")
    from matplotlib import pyplot

    datum = of._datum(name)
    if axes is None:
        axes = pyplot.subplots(layout="constrained")[1]
    x, low, median, high = of.predictive(datum.output.name, probability)
    _, low_mean, _, high_mean = of.predictive(datum.output.name, probability, noise=False)
    if datum.curve is None:
        axes.errorbar([0], median, [median - low, high - median], fmt="s", color=_COLOR, label=f"{probability:.0%} of measurements")
        axes.plot([0], datum.values, "o", color="black", label="measured")
        axes.set_xticks([])
    else:
        axes.fill_between(x, low, high, color=_COLOR, alpha=0.15, label=f"{probability:.0%} of measurements")
        axes.fill_between(x, low_mean, high_mean, color=_COLOR, alpha=0.35, label=f"{probability:.0%} of specimens, without noise")
        axes.plot(x, median, color=_COLOR, label="median")
        axes.plot(datum.curve.x, datum.curve.y, ".", color="black", markersize=4, label="measured")
        size, unit = _scale(float(np.abs(x).max()), datum.output.x_unit)
        _short(axes.xaxis, size)
        axes.set_xlabel(_label(datum.curve.x_name, unit))
    size, unit = _scale(float(np.abs(median).max()), datum.output.unit)
    _short(axes.yaxis, size)
    axes.set_ylabel(_label(datum.output.name, unit))
    axes.legend()
    return axes
