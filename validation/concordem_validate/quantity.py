"""Quantities of scenarios in SI units: `30e9` and `"30 GPa"` are the same."""
import math
import re

from .errors import HarnessError, Incomparable

_UNITS = {
    "1": 1.0, "%": 0.01, "m": 1.0, "g": 1e-3, "t": 1e3, "s": 1.0, "min": 60.0, "h": 3600.0, "rad": 1.0,
    "deg": math.pi / 180.0, "°": math.pi / 180.0, "rev": 2.0 * math.pi, "rpm": math.pi / 30.0, "Hz": 1.0, "N": 1.0,
    "Pa": 1.0, "bar": 1e5, "J": 1.0, "W": 1.0, "K": 1.0,
}
# Powers of m, kg, s, K, and of an angle, which is a dimension here: a speed in rpm is none in Hz.
_DIMENSIONS = {
    "1": (0, 0, 0, 0, 0), "%": (0, 0, 0, 0, 0), "m": (1, 0, 0, 0, 0), "g": (0, 1, 0, 0, 0), "t": (0, 1, 0, 0, 0), "s": (0, 0, 1, 0, 0),
    "min": (0, 0, 1, 0, 0), "h": (0, 0, 1, 0, 0), "rad": (0, 0, 0, 0, 1), "deg": (0, 0, 0, 0, 1), "°": (0, 0, 0, 0, 1),
    "rev": (0, 0, 0, 0, 1), "rpm": (0, 0, -1, 0, 1), "Hz": (0, 0, -1, 0, 0), "N": (1, 1, -2, 0, 0), "Pa": (-1, 1, -2, 0, 0),
    "bar": (-1, 1, -2, 0, 0), "J": (2, 1, -2, 0, 0), "W": (2, 1, -3, 0, 0), "K": (0, 0, 0, 1, 0),
}
_PREFIXES = {"T": 12, "G": 9, "M": 6, "k": 3, "h": 2, "d": -1, "c": -2, "m": -3, "u": -6, "µ": -6, "μ": -6, "n": -9, "p": -12}
_NUMBER = re.compile(r"\s*([+-]?[\d_]*\.?[\d_]*(?:[eE][+-]?\d+)?)\s*(.*)$")
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")


def _unit(symbol):
    """A unit without its prefix, and the power of ten of the prefix."""
    if symbol in _UNITS:
        return symbol, 0
    if symbol[:1] in _PREFIXES and symbol[1:] in _UNITS:
        return symbol[1:], _PREFIXES[symbol[0]]
    raise HarnessError(f"unknown unit `{symbol}`; use {', '.join(u for u in _UNITS if u != '1')}, with a prefix if needed")


def _parts(unit):
    """The units of a product or quotient: (symbol without prefix, power of ten, power). A slash divides by the one unit after it."""
    over = False
    for part in re.split(r"([/*· ])", unit.translate(_SUPERSCRIPTS).strip()):
        part = part.strip()
        if part == "/":
            over = True
        elif part and part not in "*·":
            match = re.fullmatch(r"(\D+?|1)(?:\^?(-?\d+))?", part)
            if not match:
                raise HarnessError(f"cannot read the unit `{unit}`; write for example kg/m^3")
            power = int(match[2] or 1) * (-1 if over else 1)
            over = False
            symbol, ten = _unit(match[1])
            yield symbol, ten, power


def factor(unit, wanted):
    """What values in `unit` are multiplied by to have the unit `wanted`; refuses another dimension."""
    if unit == wanted:
        return 1.0
    dimension = lambda text: [sum(_DIMENSIONS[s][k] * power for s, _, power in _parts(text)) for k in range(5)]
    if dimension(unit) != dimension(wanted):
        raise Incomparable("error", f"the units {unit} and {wanted} measure different things; give values in {wanted}")
    return si(f"1 {unit}") / si(f"1 {wanted}")


def si(value, wanted=None):
    """A number, or a string with a unit, as a real in SI units. `wanted`: a unit of the dimension that a text must have.

    Powers of ten are added to the exponent before the number is parsed, as in the program, so that both are bitwise equal.
    """
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value)
    if not isinstance(value, str):
        raise HarnessError(f"`{value}` is not a quantity; give a number, or a string such as \"30 GPa\"")
    number, unit = _NUMBER.match(value).groups()
    if not any(c.isdigit() for c in number.lower().partition("e")[0]):
        raise HarnessError(f"`{value}` does not begin with a number; give a number and a unit")
    if wanted:
        if not unit.strip():
            raise HarnessError(f"`{value}` has no unit; give a number, or one in {wanted}")
        try:
            factor(unit, wanted)
        except HarnessError as error:
            raise HarnessError(f"`{value}`: {error}") from None
    number = number.replace("_", "")
    size, ten = 1.0, 0
    try:
        for symbol, shift, power in _parts(unit):
            size *= _UNITS[symbol]**power
            ten += shift * power
    except HarnessError as error:
        raise HarnessError(f"`{value}`: {error}") from None
    mantissa, _, exponent = number.lower().partition("e")
    return float(f"{mantissa}e{int(exponent or 0) + ten}") * size


def vector(values, wanted=None):
    """Three quantities."""
    return [si(v, wanted) for v in values]


def base(unit):
    """The same unit without prefixes, in the spelling of results: `kN/mm^2` is `Pa`, others are products of m, kg, s, K, rad."""
    powers = [sum(_DIMENSIONS[s][k] * power for s, _, power in _parts(unit)) for k in range(5)]
    for name in ("1", "m", "s", "N", "Pa", "J", "W", "K", "rad"):
        if list(_DIMENSIONS[name]) == powers:
            return name
    over = lambda sign: "*".join(f"{u}^{abs(p)}" if abs(p) > 1 else u for u, p in zip(("m", "kg", "s", "K", "rad"), powers) if p * sign > 0)
    return (over(1) or "1") + (f"/{over(-1)}" if over(-1) else "")
