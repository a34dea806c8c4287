"""Units of measured values, and curves of a laboratory."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._errors import InferenceError

Reals = NDArray[np.float64]

_PREFIXES = {"G": 1e9, "M": 1e6, "k": 1e3, "d": 1e-1, "c": 1e-2, "m": 1e-3, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "n": 1e-9}
#: Units by name: SI unit and factor.
_UNITS = {
    "": ("1", 1.0), "1": ("1", 1.0), "-": ("1", 1.0), "%": ("1", 1e-2), "‰": ("1", 1e-3), "microstrain": ("1", 1e-6), "µm/m": ("1", 1e-6),
    "um/m": ("1", 1e-6), "mm/mm": ("1", 1.0), "m/m": ("1", 1.0), "m": ("m", 1.0), "s": ("s", 1.0), "min": ("s", 60.0), "h": ("s", 3600.0),
    "N": ("N", 1.0), "Pa": ("Pa", 1.0), "bar": ("Pa", 1e5), "J": ("J", 1.0), "W": ("W", 1.0), "K": ("K", 1.0), "kg": ("kg", 1.0),
    "g": ("kg", 1e-3), "t": ("kg", 1e3), "rad": ("rad", 1.0), "deg": ("rad", math.pi / 180), "Hz": ("1/s", 1.0),
}  # fmt: skip

#: Units as products, so that N/mm^2 is Pa, and J/m^2 is N/m.
_PARTS = {"Pa": (("N", 1.0), ("m", -2.0)), "J": (("N", 1.0), ("m", 1.0))}


def _one(name: str) -> tuple[str, float] | None:
    """SI unit and factor of a unit without products; None if it is not known."""
    if name in _UNITS:
        return _UNITS[name]
    prefix, base = name[:1], name[1:]
    if prefix in _PREFIXES and base in ("m", "s", "N", "Pa", "J", "W", "K", "g", "Hz"):
        unit, factor = _UNITS[base]
        return unit, factor * _PREFIXES[prefix]
    return None


def unit_of(text: str) -> tuple[str, float]:
    """SI unit and factor of a unit such as "MPa", "N/mm^2", or "%"."""
    text = text.strip().replace("²", "^2").replace("³", "^3").replace("·", "*").replace(" ", "*")
    whole = _one(text)
    if whole is not None:
        return whole
    factor = 1.0
    powers: dict[str, float] = {}
    for sign, name, power in re.findall(r"(^|[*/])([^*/^]+)(?:\^(-?[\d.]+))?", text):
        one = _one(name)
        if one is None:
            raise InferenceError(f"the unit {text!r} is not known; write it with prefixes of SI, such as MPa, kN/mm, J/m^2, %, or 1")
        exponent = float(power or 1) * (-1 if sign == "/" else 1)
        factor *= one[1] ** exponent
        for base, of_base in _PARTS.get(one[0], ((one[0], 1.0),)):
            powers[base] = powers.get(base, 0.0) + exponent * of_base
    powers = {base: exponent for base, exponent in powers.items() if exponent and base != "1"}
    if powers == {"N": 1.0, "m": -2.0}:
        return "Pa", factor
    above = [base if exponent == 1 else f"{base}^{exponent:g}" for base, exponent in powers.items() if exponent > 0]
    below = [base if exponent == -1 else f"{base}^{-exponent:g}" for base, exponent in powers.items() if exponent < 0]
    return "/".join(["*".join(above) or "1", *below]), factor


def quantity(value: Any, what: str) -> tuple[float, str | None]:
    """A number in SI units, with the unit if it has one: 3.0, or "3 MPa"."""
    if isinstance(value, str):
        parts = re.fullmatch(r"\s*([-+]?[\d._]+(?:[eE][-+]?\d+)?)\s*(.*?)\s*", value)
        try:
            number = float(parts[1]) if parts else math.nan
        except ValueError:
            number = math.nan
        if parts is None or math.isnan(number):
            raise InferenceError(f"{what} is {value!r}; give a number, or a number with its unit, such as '3 MPa'")
        if not parts[2]:
            return number, None
        unit, factor = unit_of(parts[2])
        return number * factor, unit
    try:
        number = float(value)
    except (TypeError, ValueError) as error:
        raise InferenceError(f"{what} is {value!r}; give a number, or a number with its unit, such as '3 MPa'") from error
    if not math.isfinite(number):
        raise InferenceError(f"{what} is {number}; give a finite number")
    return number, None


@dataclass(frozen=True)
class Curve:
    """A measured curve in SI units: `y` over `x`, in any order and at any points.

    >>> from concordem.inference import Curve
    >>> curve = Curve([0.0, 1e-4, 2e-4], [0.0, 3e6, 4e6], x_unit="1", y_unit="Pa")
    >>> len(curve.within(0.0, 1e-4).x)
    2
    """

    x: Reals
    """Abscissa, such as the strain, SI unit, (m,)."""
    y: Reals
    """Ordinate, such as the stress, SI unit, (m,)."""
    x_name: str = "x"
    """Name of the abscissa."""
    y_name: str = "y"
    """Name of the ordinate."""
    x_unit: str | None = None
    """SI unit of the abscissa; None if it is not known."""
    y_unit: str | None = None
    """SI unit of the ordinate; None if it is not known."""

    def __post_init__(self) -> None:
        for name in ("x", "y"):
            try:
                values = np.array(getattr(self, name), np.float64)
            except (TypeError, ValueError) as error:
                raise InferenceError(f"{name} of the curve is no array of numbers; give two arrays of equal length") from error
            object.__setattr__(self, name, values)
        if self.x.ndim != 1 or self.x.shape != self.y.shape or len(self.x) < 2:
            raise InferenceError(f"the curve has {self.x.shape} and {self.y.shape} values; give two arrays of equal length, at least 2")
        for name, values in (("x", self.x), ("y", self.y)):
            if not np.isfinite(values).all():
                at = int(np.argmin(np.isfinite(values)))
                raise InferenceError(f"{name}[{at}] of the curve is {values[at]}; remove the point or give a finite number")

    @staticmethod
    def from_csv(path: str | PathLike[str], x: str | None = None, y: str | None = None) -> Curve:
        """Read a curve from a CSV file; the header, or the line below it, has the units.

        Parameters
        ----------
        path : a file such as ``strain [%],stress [MPa]`` and one line per point. Commas, semicolons, or tabs separate; with semicolons
            and tabs, decimal commas are read. Lines that begin with ``#`` are comments. "1" is the unit of dimensionless columns.
        x, y : names of the columns, without units; not needed if the file has two columns.

        Returns
        -------
        Curve : in SI units.

        Raises
        ------
        FileNotFoundError : there is no such file. InferenceError : a column has no unit or an unknown one, or a cell is no number.
        """
        path = Path(path)
        try:
            text = path.read_text(encoding="utf-8-sig")
        except UnicodeDecodeError:
            text = path.read_text(encoding="latin-1")
        lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip() and not line.lstrip().startswith("#")]
        if len(lines) < 3:
            raise InferenceError(f"{path} has {len(lines)} lines; a curve has a header with units and at least two points")
        head = lines[0][1]
        separator = next((mark for mark in ("\t", ";", ",") if mark in head), None)
        if separator is None:
            raise InferenceError(f"{path}:{lines[0][0]}: {head!r} is one column; separate columns by commas, semicolons, or tabs")
        rows = [(k, [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]) for k, line in lines]
        names, units = [], []
        for cell in rows[0][1]:
            found = re.fullmatch(r"(.*?)\s*[\[(]([^\])]*)[\])]", cell)
            names.append(found[1].strip() if found else cell)
            units.append(found[2] if found else None)
        body = rows[1:]
        if all(unit is None for unit in units):
            # Machines write the units below the names.
            second = [cell.strip("[]() ") for cell in body[0][1]]
            if len(second) == len(names) and not any(_is_number(cell, separator) and cell != "1" for cell in second):
                units, body = list(second), body[1:]
        chosen = []
        for wanted, place in ((x, 0), (y, 1)):
            if wanted is None and len(names) != 2:
                raise InferenceError(f"{path} has the columns {', '.join(names)}; choose two of them by x= and y=")
            if wanted is not None and names.count(wanted) != 1:
                raise InferenceError(f"{path} has {names.count(wanted)} columns {wanted!r}; choose from {', '.join(names)}")
            chosen.append(place if wanted is None else names.index(wanted))
        factors, si = [], []
        for column in chosen:
            unit = units[column]
            if unit is None:
                raise InferenceError(
                    f"{path}: the column {names[column]!r} has no unit; write it in the header, as '{names[column]} [MPa]', or [1] without dimension"
                )
            try:
                base, factor = unit_of(unit)
            except InferenceError as error:
                raise InferenceError(f"{path}: column {names[column]!r}: {error}") from None
            factors.append(factor)
            si.append(base)
        values = np.empty((len(body), 2))
        for row, (number, cells) in enumerate(body):
            for k, column in enumerate(chosen):
                cell = cells[column] if column < len(cells) else ""
                if not _is_number(cell, separator):
                    raise InferenceError(f"{path}:{number}: {names[column]!r} is {cell!r}; give a number, or remove the line")
                values[row, k] = float(cell.replace(",", ".")) * factors[k]
        return Curve(values[:, 0], values[:, 1], names[chosen[0]], names[chosen[1]], si[0], si[1])

    def within(self, low: float, high: float) -> Curve:
        """The points with ``low <= x <= high``, in SI units."""
        kept = (self.x >= low) & (self.x <= high)
        if kept.sum() < 2:
            raise InferenceError(f"{kept.sum()} points of the curve lie from {low} to {high}; it reaches from {self.x.min()} to {self.x.max()}")
        return Curve(self.x[kept], self.y[kept], self.x_name, self.y_name, self.x_unit, self.y_unit)

    def thinned(self, count: int) -> Curve:
        """At most ``count`` points: means over neighbors in the order of the curve."""
        if count < 2:
            raise InferenceError(f"a curve of {count} points is none; give at least 2")
        if len(self.x) <= count:
            return self
        parts = np.array_split(np.arange(len(self.x)), count)
        x, y = (np.array([values[part].mean() for part in parts]) for values in (self.x, self.y))
        return Curve(x, y, self.x_name, self.y_name, self.x_unit, self.y_unit)


def _is_number(cell: str, separator: str) -> bool:
    """Whether a cell is a finite number; with other separators, a comma may be the decimal mark."""
    if separator == "," and "," in cell:
        return False
    try:
        return math.isfinite(float(cell.replace(",", ".")))
    except ValueError:
        return False


def curve_of(given: Any, name: str) -> Curve:
    """A measured curve from what users give: a curve, a file, or two arrays."""
    if isinstance(given, Curve):
        return given
    if isinstance(given, str | PathLike):
        return Curve.from_csv(given)
    try:
        x, y = given
    except (TypeError, ValueError) as error:
        raise InferenceError(f"the measured curve {name!r} is a {type(given).__name__}; give a Curve, a CSV file, or (x, y)") from error
    return Curve(x, y)


def reals(values: ArrayLike, what: str, dimension: int) -> Reals:
    """Finite numbers as an array of so many dimensions."""
    try:
        array = np.array(values, np.float64)
    except (TypeError, ValueError) as error:
        raise InferenceError(f"{what} is no array of numbers; give {dimension} dimensions of equal rows") from error
    if array.ndim != dimension:
        raise InferenceError(f"{what} has the shape {array.shape}; give {dimension} dimensions")
    return array
