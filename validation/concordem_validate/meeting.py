"""How two series meet: on one abscissa, whole, in one unit, without a guess between or beyond their points."""
from dataclasses import dataclass

import numpy as np

from .errors import HarnessError, Incomparable
from .quantity import factor

# Points of two grids are the same if they lie closer than this part of their spacing: times are products with a rounded step.
_SAME = 1e-6


@dataclass
class Pair:
    """Two series at common points `x`; `steps` where both have steps of one length."""

    x: np.ndarray
    axis: str
    a: np.ndarray
    b: np.ndarray
    unit: str
    steps: np.ndarray = None


@dataclass
class Span:
    """What a run was to cover: its last step, by how many steps it may go on, and the largest interval of records, in steps of `dt`."""

    steps: int
    beyond: int
    interval: int
    dt: float


# Times in tables may have six digits.
_PRINTED = 2e-6
# A step of the code that adapts it varies less within a run.
_HOLE = 10


_PART = "; a check of a part needs a window: `from_step`, `to_step`, `from`, or `to`"


def covers(what, x, over, span, begins=True, ends=True, remedy=""):
    """Refuse a series that does not go from the beginning of the run to its end, each within a step, or that goes on. A window needs no ends."""
    step = 1.0 if over == "step" else span.dt
    end, slack = span.steps * step, step * (1 + _SAME) + _PRINTED * span.steps * step
    if begins and abs(x[0]) > slack:
        raise Incomparable("short", f"{what} begins at {over} {x[0]:.9g}, but the run at 0{remedy}")
    if x[-1] - end > max(slack, span.beyond * step * (1 + _SAME)):
        raise Incomparable("error", f"{what} goes on to {over} {x[-1]:.9g}, but the run ends at {end:.9g}; stop there")
    gaps = np.diff(x)
    # records at equal intervals may leave a rest at the end
    rest = len(gaps) and np.ptp(gaps) <= 10 * _SAME * gaps.max() + slack - step and gaps.max() <= span.interval * step + slack - step \
        and end - x[-1] < gaps.max()
    if ends and end - x[-1] > slack and not rest:
        raise Incomparable("short", f"{what} ends at {over} {x[-1]:.9g}, but the run at {end:.9g}{remedy}")


def of(result, name, who=None):
    """A series, or a refusal that names what there is."""
    who = who or result.engine
    if name not in result.series:
        raise Incomparable("error", f"{who} has no series `{name}`; use one of {', '.join(sorted(result.series)) or '(it has none)'}")
    one = result.series[name]
    if len(one.steps) == 0:
        raise Incomparable("empty", f"`{name}` of {who} is empty")
    return one


def _abscissa(result, name, over, who):
    """Values and unit of the axis of a series: steps, time, or another series on the same grid."""
    one = result.series[name]
    if over == "step":
        x, unit = one.steps.astype(float), "1"
    elif over == "time":
        x, unit = result.time(name), "s"
    else:
        other = of(result, over, who)
        if not np.array_equal(other.steps, one.steps) or other.values.ndim > 1 and other.values.size != len(other.values):
            raise Incomparable("error", f"`{over}` of {who} is no axis for `{name}`: give one number at each of its samples")
        x, unit = other.values.reshape(len(one.steps)), other.unit
    if not np.isfinite(x).all():
        raise Incomparable("nan", f"`{over}` of {who} is not a number at sample {int(np.flatnonzero(~np.isfinite(x))[0])}")
    return x, unit


def _ascending(x, over, who):
    """An axis must run one way; one that falls, such as a compressive strain, is turned."""
    way = np.sign(x[-1] - x[0]) or 1.0
    if np.any(np.diff(x) * way <= 0):
        at = int(np.flatnonzero(np.diff(x) * way <= 0)[0]) + 1
        raise Incomparable("error", f"`{over}` of {who} does not run one way (sample {at}); set a window, or compare over time")
    return way


def _window(check, over, dt):
    """First and last point of the window on the axis, None without."""
    if check.first is not None or check.last is not None:
        return check.first, check.last
    scale = 1.0 if over == "step" else dt if over == "time" else None
    if scale is None and (check.from_step or check.to_step is not None):
        raise HarnessError(f"check `{check.name}`: a window of steps needs `over` to be step or time; give `from` and `to`")
    return (check.from_step * scale if check.from_step else None), (check.to_step * scale if check.to_step is not None else None)


def meet(check, ours, theirs, names, span=None):
    """The two series of a check at common points. `span`: what the run was to cover, where the scenario gives it."""
    a, b = of(ours, check.of, names[0]), of(theirs, check.of, names[1])
    scale = factor(b.unit, a.unit)
    if a.values.shape[1:] != b.values.shape[1:]:
        raise Incomparable("error", f"`{check.of}` has shape {a.values.shape[1:]} in {names[0]} and {b.values.shape[1:]} in {names[1]}")
    over = check.over
    if over == "step" and not np.isclose(ours.dt, theirs.dt, rtol=1e-14, atol=0):
        raise Incomparable("error", f"time steps differ: {ours.dt!r} s in {names[0]}, {theirs.dt!r} s in {names[1]}; compare over time")
    (x, unit), (y, other) = _abscissa(ours, check.of, over, names[0]), _abscissa(theirs, check.of, over, names[1])
    y = y * factor(other, unit)
    way = _ascending(x, over, names[0])
    if len({way, _ascending(y, over, names[1])}) > 1:
        raise Incomparable("error", f"`{over}` rises in one of {names[0]} and {names[1]} and falls in the other")
    first, last = _window(check, over, ours.dt)
    _whole(check, x, y, way, first, last, names)
    for values, data, who in ((x, a.values, names[0]), (y, b.values, names[1])):
        if span is not None and over in ("step", "time"):
            covers(f"`{check.of}` of {who}", values, over, span, first is None, last is None, _PART)
        _no_hole(check, values, who)
        _finite(check, values, data, way, first, last, who)
    at, u, v = _common(check, x * way, a.values, y * way, b.values * scale, names)
    inside = np.ones(len(at), bool)
    slack = _SAME * np.min(np.diff(at), initial=np.inf) if len(at) > 1 else 0.0
    if first is not None:
        inside &= at * way >= first - slack if way > 0 else at * way <= first + slack
    if last is not None:
        inside &= at * way <= last + slack if way > 0 else at * way >= last - slack
    if inside.sum() < 2:
        raise Incomparable("short", f"`{check.of}` has fewer than two common points in the window")
    at, u, v = at[inside] * way, u[inside], v[inside]
    steps = np.round(at if over == "step" else at / ours.dt).astype(np.int64) if over in ("step", "time") and ours.dt > 0 else None
    return Pair(at, over, u, v, a.unit, steps)


def _whole(check, x, y, way, first, last, names):
    """Both series begin and end at the same point, unless the check has a window that both reach."""
    spacing = min(np.min(np.abs(np.diff(v)), initial=np.inf) for v in (x, y))
    slack = _SAME * spacing if np.isfinite(spacing) else 0.0
    for values, who in ((x, names[0]), (y, names[1])):
        if last is not None and way * (last - values[-1]) > slack:
            raise Incomparable("short", f"the window ends at {check.over} {last:.9g}, but `{check.of}` of {who} ends at {values[-1]:.9g}")
        if first is not None and way * (values[0] - first) > slack:
            raise Incomparable("short", f"the window begins at {check.over} {first:.9g}, but `{check.of}` of {who} begins at {values[0]:.9g}")
    # interpolated curves over a measured axis, such as strain, end where the shorter one ends, within the spacing there
    gap = lambda v, k: abs(v[k + 1] - v[k]) if len(v) > 1 else 0.0
    spread = lambda k: max(gap(x, k), gap(y, k)) if check.meet == "interpolate" else slack
    if last is None and abs(x[-1] - y[-1]) > spread(-2):
        short = names[0] if way * (x[-1] - y[-1]) < 0 else names[1]
        raise Incomparable("short", f"`{check.of}` of {short} ends early: {check.over} {x[-1]:.9g} in {names[0]}, {y[-1]:.9g} in {names[1]}; "
                                    "a check of a part needs `to_step` or `to`")
    if first is None and abs(x[0] - y[0]) > spread(0):
        late = names[0] if way * (x[0] - y[0]) > 0 else names[1]
        raise Incomparable("short", f"`{check.of}` of {late} begins late: {check.over} {x[0]:.9g} in {names[0]}, {y[0]:.9g} in {names[1]}; "
                                    "a check of a part needs `from_step` or `from`")


def _no_hole(check, x, who):
    """Curves are interpolated between neighbors only: what happens in a long gap would not be compared."""
    gaps = np.abs(np.diff(x))
    if check.meet == "interpolate" and check.over in ("step", "time") and len(gaps) > 2 and gaps.max() > _HOLE * np.median(gaps):
        k = int(gaps.argmax())
        raise Incomparable("short", f"`{check.of}` of {who} has no sample between {check.over} {x[k]:.9g} and {x[k + 1]:.9g}; write at equal intervals")


def _finite(check, x, values, way, first, last, who):
    """All values of the window are numbers, also those between the common points."""
    inside = np.ones(len(x), bool)
    if first is not None:
        inside &= (x - first) * way >= 0
    if last is not None:
        inside &= (last - x) * way >= 0
    bad = ~np.isfinite(values.reshape(len(x), -1)) & inside[:, None]
    if bad.any():
        k, column = np.argwhere(bad)[0]
        raise Incomparable("nan", f"`{check.of}` of {who} is not a finite number at {check.over} {x[k]:.9g} (column {column})")


def _common(check, x, a, y, b, names):
    """Points that both have; or, where the check says so, the points of the coarser series, and the finer one interpolated."""
    if check.meet == "interpolate":
        coarse_first = len(x) <= len(y)
        at = x if coarse_first else y
        fine = (y, b) if coarse_first else (x, a)
        keep = (at >= fine[0][0]) & (at <= fine[0][-1])
        at = at[keep]
        between = _between(at, *fine)
        return (at, a[keep], between) if coarse_first else (at, between, b[keep])
    near = np.clip(np.searchsorted(y, x), 1, len(y) - 1) if len(y) > 1 else np.zeros(len(x), int)
    near = np.where(np.abs(y[near] - x) < np.abs(y[near - 1] - x), near, near - 1) if len(y) > 1 else near
    spacing = min(np.min(np.diff(v), initial=np.inf) for v in (x, y))
    same = np.abs(y[near] - x) <= (_SAME * spacing if np.isfinite(spacing) else 0.0)
    at_a, at_b = np.flatnonzero(same), near[same]
    if len(at_a) == 0:
        raise Incomparable("error", f"`{check.of}` of {names[0]} and {names[1]} has no common points; give `meet = \"interpolate\"`")
    if len(at_a) < max(len(x), len(y)):
        _nested(check, x, y, len(at_a), names)
    return x[at_a], a[at_a], b[at_b]


def _nested(check, x, y, common, names):
    """Grids of different intervals agree if the coarser one is regular and lies in the finer one within their common range."""
    low, high = max(x[0], y[0]), min(x[-1], y[-1])
    spacing = min(np.min(np.diff(v), initial=np.inf) for v in (x, y))
    slack = _SAME * spacing
    parts = [(v[(v >= low - slack) & (v <= high + slack)], who) for v, who in ((x, names[0]), (y, names[1]))]
    coarse, who = min(parts, key=lambda part: len(part[0]))
    gaps = np.diff(coarse)
    # the last sample may follow at the end of the run, after less than an interval
    regular = len(gaps) < 2 or np.ptp(gaps[:-1]) <= 10 * slack and gaps[-1] <= gaps[0] + 10 * slack
    if common < len(coarse) or not regular:
        raise Incomparable("error", f"`{check.of}`: {names[0]} and {names[1]} have only {common} common points of {len(x)} and {len(y)}, "
                                    f"or a sample of {who} is missing; give `meet = \"interpolate\"`, or the same interval")


def _between(at, x, values):
    """Linear interpolation inside the range of `x`; never beyond it."""
    k = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    t = ((at - x[k]) / (x[k + 1] - x[k])).reshape(-1, *[1] * (values.ndim - 1))
    return values[k] * (1 - t) + values[k + 1] * t
