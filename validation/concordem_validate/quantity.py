"""Quantities of scenarios in SI units: `30e9` and `"30 GPa"` are the same."""
import math
import re

from .errors import HarnessError

_UNITS = {
    "1": 1.0, "%": 0.01, "m": 1.0, "g": 1e-3, "t": 1e3, "s": 1.0, "min": 60.0, "h": 3600.0, "rad": 1.0,
    "deg": math.pi / 180.0, "°": math.pi / 180.0, "rev": 2.0 * math.pi, "rpm": math.pi / 30.0, "Hz": 1.0, "N": 1.0,
    "Pa": 1.0, "bar": 1e5, "J": 1.0, "W": 1.0, "K": 1.0,
}
_PREFIXES = {"T": 12, "G": 9, "M": 6, "k": 3, "h": 2, "d": -1, "c": -2, "m": -3, "u": -6, "µ": -6, "μ": -6, "n": -9}
_NUMBER = re.compile(r"\s*([+-]?[\d_]*\.?[\d_]*(?:[eE][+-]?\d+)?)\s*(.*)$")
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")


def _unit(symbol):
    """Factor and power of ten of a unit with its prefix."""
    if symbol in _UNITS:
        return _UNITS[symbol], 0
    if symbol[:1] in _PREFIXES and symbol[1:] in _UNITS:
        return _UNITS[symbol[1:]], _PREFIXES[symbol[0]]
    raise HarnessError(f"unknown unit `{symbol}`")


def si(value):
    """A number, or a string with a unit, as a real in SI units.

    Powers of ten are added to the exponent before the number is parsed, as in the program, so that both are bitwise equal.
    """
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value)
    if not isinstance(value, str):
        raise HarnessError(f"`{value}` is not a quantity; give a number, or a string such as \"30 GPa\"")
    number, unit = _NUMBER.match(value).groups()
    if not number.strip("+-."):
        raise HarnessError(f"`{value}` does not begin with a number; give a number and a unit")
    number = number.replace("_", "")
    factor, ten = 1.0, 0
    over = False
    for part in re.split(r"([/*· ])", unit.translate(_SUPERSCRIPTS).strip()):
        part = part.strip()
        if part == "/":
            over = True
        elif part and part not in "*·":
            match = re.fullmatch(r"(\D+?|1)(?:\^?(-?\d+))?", part)
            if not match:
                raise HarnessError(f"cannot read the unit of `{value}`")
            power = int(match[2] or 1) * (-1 if over else 1)
            one, shift = _unit(match[1])
            factor *= one**power
            ten += shift * power
    mantissa, _, exponent = number.lower().partition("e")
    return float(f"{mantissa}e{int(exponent or 0) + ten}") * factor


def vector(values):
    """Three quantities."""
    return [si(v) for v in values]
