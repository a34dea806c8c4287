"""Tables of the package for pandas and xarray, which are optional."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._types import _structured, units

if TYPE_CHECKING:
    import pandas
    import xarray

__all__ = ["to_pandas", "to_xarray"]


def to_pandas(table: NDArray[np.void]) -> pandas.DataFrame:
    """A structured array of the package as a data frame; each component of vectors and tensors has its own column.

    Parameters
    ----------
    table : samples, events, contacts, or records of an operator.

    Returns
    -------
    pandas.DataFrame : columns such as ``position_x`` or ``stress_xy``; ``frame.attrs["units"]`` has their SI units.

    Raises
    ------
    ImportError : pandas is missing. TypeError : not a structured array.

    >>> import concordem
    >>> simulation = concordem.Scenario.template("hertz-impact").simulation(threads=1)
    >>> concordem.to_pandas(simulation.events).columns[4]  # doctest: +SKIP
    'position_x'
    """
    _structured(table)
    try:
        import pandas
    except ImportError as error:
        raise ImportError("pandas is missing; install it with: python -m pip install pandas") from error
    columns: dict[str, NDArray[Any]] = {}
    of = units(table)
    kept: dict[str, str] = {}
    for name in table.dtype.names or ():
        values = table[name]
        for place in product(*(range(n) for n in values.shape[1:])):
            axes = ["xyz"[k] if n == 3 else str(k) for k, n in zip(place, values.shape[1:])]
            column = f"{name}_{''.join(axes)}" if axes else name
            index: Any = (slice(None), *place)
            columns[column] = np.ascontiguousarray(values[index])
            kept[column] = of[name]
    frame = pandas.DataFrame(columns)
    frame.attrs["units"] = kept
    return frame


def to_xarray(table: NDArray[np.void]) -> xarray.Dataset:
    """A structured array of the package as a data set; variables have the attribute ``units``.

    Parameters
    ----------
    table : samples, events, contacts, or records of an operator.

    Returns
    -------
    xarray.Dataset : one variable per column, over ``time`` if the table has one, else over ``row``; components of vectors and tensors over
    ``i`` and ``j`` with the labels "x", "y", "z" where there are three.

    Raises
    ------
    ImportError : xarray is missing. TypeError : not a structured array.
    """
    _structured(table)
    try:
        import xarray
    except ImportError as error:
        raise ImportError("xarray is missing; install it with: python -m pip install xarray") from error
    of = units(table)
    names = table.dtype.names or ()
    row = "time" if "time" in names else "row"
    variables: dict[str, Any] = {}
    labels: dict[str, Any] = {}
    for name in names:
        values = np.ascontiguousarray(table[name])
        inner = []
        for axis, count in zip("ijk", values.shape[1:]):
            dimension = axis if count == 3 else f"{axis}{count}"
            inner.append(dimension)
            labels[dimension] = list("xyz") if count == 3 else np.arange(count)
        variables[name] = ((row, *inner), values, {"units": of[name]})
    coordinates = {row: variables.pop("time")} if row == "time" else {}
    return xarray.Dataset(variables, {**coordinates, **labels})
