"""Verdicts: the difference between ConcorDEM and a peer, and whether it is within the tolerance."""
import json
import math
from dataclasses import dataclass, field

import numpy as np

from .errors import HarnessError
from .quantity import si
from .result import Result


@dataclass
class Verdict:
    """One check of one variant (or of all variants of an ensemble)."""

    case: str
    variant: str
    check: object
    status: str  # pass, known, fail, missing
    difference: float = math.nan
    message: str = ""
    steps: np.ndarray = None
    growth: np.ndarray = None
    values: tuple = None
    band: tuple = None
    peer: str = field(init=False)

    def __post_init__(self):
        self.peer = self.check.peer


def measures(case, task, result):
    """The numbers of a result: those of a table, or those that `measures` in the case's case.py computes from it."""
    if "measures" in result.numbers:
        return result.numbers["measures"]
    function = getattr(case.module, "measures", None)
    if function is None:
        raise HarnessError(f"case {case.name} has no function `measures` in case.py; add it")
    return function(task, result)


def _norms(values):
    """Norms of vectors or absolute values, one per step and particle."""
    return np.linalg.norm(values.reshape(len(values), -1, _width(values)), axis=2)


def _scale(scale, reference):
    """Scale of a difference: the largest value, the largest displacement since the first step, or a given quantity."""
    if scale == "maximum":
        size = float(_norms(reference).max(initial=0.0))
    elif scale == "displacement":
        size = float(_norms(reference - reference[0]).max(initial=0.0))
    else:
        size = si(scale)
    if not size > 0:
        raise HarnessError(f"the scale of the comparison ({scale}) is {size}, but must be positive; give another scale")
    return size


def _width(values):
    return 3 if values.ndim >= 2 and values.shape[-1] == 3 else 1


def series(check, ours, theirs):
    """Largest difference at each common step of the window, over the scale."""
    for result, who in ((ours, "concordem"), (theirs, check.peer)):
        if check.of not in result.series:
            raise HarnessError(f"{who} has no series `{check.of}`; use one of {', '.join(sorted(result.series))}")
    a, b = ours.series[check.of], theirs.series[check.of]
    if a.unit != b.unit:
        raise HarnessError(f"`{check.of}` has unit {a.unit} in ConcorDEM and {b.unit} in the peer")
    if not math.isclose(ours.dt, theirs.dt, rel_tol=1e-14):
        raise HarnessError(f"time steps differ: {ours.dt!r} s in ConcorDEM, {theirs.dt!r} s in the peer")
    steps, at_a, at_b = np.intersect1d(a.steps, b.steps, return_indices=True)
    inside = (steps >= check.from_step) & (steps <= (steps.max(initial=0) if check.to_step is None else check.to_step))
    if inside.sum() < 2:
        raise HarnessError(f"`{check.of}` has fewer than two common steps in the window")
    if check.to_step is not None and steps.max() < check.to_step:
        raise HarnessError(f"the window ends at step {check.to_step}, but the common steps end at {steps.max()}")
    if a.values.shape[1:] != b.values.shape[1:]:
        raise HarnessError(f"`{check.of}` has shape {a.values.shape[1:]} in ConcorDEM and {b.values.shape[1:]} in the peer")
    x, y = a.values[at_a][inside], b.values[at_b][inside]
    size = _scale(check.scale, y)
    return steps[inside], _norms(x - y).max(axis=1) / size, (x, y)


def scalar(check, ours, theirs):
    for values, who in ((ours, "concordem"), (theirs, check.peer)):
        if check.of not in values:
            raise HarnessError(f"{who} has no number `{check.of}`; use one of {', '.join(sorted(values))}")
    x, y = np.atleast_1d(np.asarray(ours[check.of], float)), np.atleast_1d(np.asarray(theirs[check.of], float))
    if x.shape != y.shape:
        raise HarnessError(f"`{check.of}` has shape {x.shape} in ConcorDEM and {y.shape} in the peer")
    if check.scale == "sum":
        # mean error over mean magnitude, as in the tests of Kratos
        return float(np.sum(np.abs(x - y)) / np.sum(np.abs(y))), (x, y)
    size = float(np.max(np.abs(y))) if check.scale == "maximum" else si(check.scale)
    if not size > 0:
        raise HarnessError(f"the scale of `{check.of}` is {size}; give `scale`")
    return float(np.max(np.abs(x - y))) / size, (x, y)


# Two-sided 95 % quantiles of Student's t for 1, 2, ... degrees of freedom (Abramowitz & Stegun 1964, table 26.10).
_T = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228]


def band(differences):
    """Mean and half width of its 95 % confidence interval."""
    d = np.asarray(differences)
    if len(d) < 3:
        raise HarnessError("an ensemble needs at least three members")
    t = _T[min(len(d) - 2, len(_T) - 1)]
    return float(d.mean()), float(t * d.std(ddof=1) / math.sqrt(len(d)))


def _settle(verdict, difference):
    check = verdict.check
    verdict.difference = difference
    if math.isnan(difference):
        verdict.status, verdict.message = "fail", "the difference is NaN"
    elif check.known is not None:
        low, high = check.known
        verdict.status = "known" if low <= difference <= high else "fail"
        if verdict.status == "fail":
            verdict.message = f"the known difference is {low:g} … {high:g}, so quirk {check.quirk} has changed"
    else:
        verdict.status = "pass" if difference <= check.tolerance else "fail"
    return verdict


def judge(case, outcomes, plant):
    """All verdicts of a case."""
    tasks = {task.variant: task for task in case.tasks}
    results = {}

    def result(variant, engine):
        key = case.name, variant, engine
        if key not in results:
            results[key] = outcomes[key].result()
            for change in plant.get(f"result:{engine}", []):
                change(results[key])
        return results[key]

    verdicts = []
    for check in case.checks:
        variants = case.variants_of(check)
        if check.kind == "ensemble":
            verdicts.append(_ensemble(case, check, variants, outcomes, result, tasks))
            continue
        for variant in variants:
            verdict = Verdict(case.name, variant, check, "fail")
            bad = _unfinished(case, variant, check, outcomes)
            if bad:
                verdict.status, verdict.message = bad
            else:
                try:
                    ours, theirs = result(variant, "concordem"), result(variant, check.peer)
                    if check.kind == "series":
                        verdict.steps, verdict.growth, verdict.values = series(check, ours, theirs)
                        _settle(verdict, float(verdict.growth.max()))
                    else:
                        task = tasks[variant]
                        difference, verdict.values = scalar(
                            check, measures(case, task, ours), measures(case, task, theirs))
                        _settle(verdict, difference)
                except HarnessError as error:
                    verdict.status, verdict.message = "fail", str(error)
            verdicts.append(verdict)
    return verdicts


def _unfinished(case, variant, check, outcomes):
    for engine in ("concordem", check.peer):
        outcome = outcomes[case.name, variant, engine]
        if outcome.status != "done":
            return ("missing" if outcome.status == "missing" else "fail"), f"{engine} {outcome.status}: {outcome.message}"
    return None


def _ensemble(case, check, variants, outcomes, result, tasks):
    verdict = Verdict(case.name, f"{len(variants)} members", check, "fail")
    differences = []
    for variant in variants:
        bad = _unfinished(case, variant, check, outcomes)
        if bad:
            verdict.status, verdict.message = bad
            return verdict
        try:
            ours, theirs = (measures(case, tasks[variant], result(variant, e)) for e in ("concordem", check.peer))
            scale = abs(theirs[check.of]) if check.scale == "maximum" else si(check.scale)
            differences.append((ours[check.of] - theirs[check.of]) / scale)
        except (HarnessError, KeyError) as error:
            verdict.message = f"{variant}: {error}"
            return verdict
    try:
        mean, half = band(differences)
    except HarnessError as error:
        verdict.message = str(error)
        return verdict
    verdict.band = mean, half
    verdict.values = (np.array(differences), np.zeros(len(differences)))
    # equivalence test: the whole confidence interval of the mean difference must be within the tolerance
    verdict.message = f"mean difference {mean:+.2e} ± {half:.1e} (95 %)"
    message = verdict.message
    _settle(verdict, abs(mean) + half)
    verdict.message = message
    return verdict



def _timeless(value):
    """Numbers without timings."""
    if isinstance(value, dict):
        return {k: _timeless(v) for k, v in value.items() if not (k in ("wall_s", "particle_steps_per_s") or k.endswith("_seconds"))}
    return [_timeless(v) for v in value] if isinstance(value, list) else value


def same_bits(a, b):
    """Bitwise differences between two results of ConcorDEM, without timings; empty if there are none."""
    found = []
    for kind in ("series", "fields"):
        x, y = getattr(a, kind), getattr(b, kind)
        found += [f"{kind}/{name} is in one only" for name in sorted(x.keys() ^ y.keys())]
        for name in sorted(x.keys() & y.keys()):
            pairs = [(x[name].steps, y[name].steps), (x[name].values, y[name].values)] if kind == "series" else [(x[name][0], y[name][0])]
            if any(u.dtype != v.dtype or u.shape != v.shape or u.tobytes() != v.tobytes() for u, v in pairs):
                found.append(f"{kind}/{name} differs")
    # JSON contains all digits
    if len({json.dumps(_timeless(r.numbers), sort_keys=True) for r in (a, b)}) > 1:
        found.append("numbers differ")
    if a.dt != b.dt or a.provenance.get("state_hash") != b.provenance.get("state_hash"):
        found.append("the time step or the final state hash differs")
    return found


def rounds(a, b, engine="concordem"):
    """Lines about all results of an engine in two folders, and whether all are bitwise equal."""
    names = [{path.name for path in folder.glob(f"runs/*.{engine}.*.h5")} for folder in (a, b)]
    if not names[0] & names[1]:
        raise HarnessError(f"{a} and {b} have no common results of {engine}; run two rounds with `run --output`")
    lines = [f"{name} is in one round only" for name in sorted(names[0] ^ names[1])]
    for name in sorted(names[0] & names[1]):
        lines += [f"{name}: {what}" for what in same_bits(Result.read(a / "runs" / name), Result.read(b / "runs" / name))]
    good = not lines
    return lines + [f"{len(names[0] & names[1])} results of {engine} compared" + (", all bitwise equal" if good else "")], good


def files(a, b, tolerance):
    """Lines about all series of two results, and whether both have all series and all are within the tolerance."""
    lines, good = [], bool(a.series.keys() & b.series.keys())
    if not good:
        lines.append("no common series")
    if not math.isclose(a.dt, b.dt, rel_tol=1e-14):
        good = False
        lines.append(f"time steps differ: {a.dt!r} s and {b.dt!r} s")
    for name in sorted(a.series.keys() | b.series.keys()):
        x, y = a.series.get(name), b.series.get(name)
        if x is None or y is None:
            good = False
            lines.append(f"{name:24} is in the {'second' if x is None else 'first'} only")
            continue
        steps, at_a, at_b = np.intersect1d(x.steps, y.steps, return_indices=True)
        shapes = x.values.shape[1:], y.values.shape[1:]
        unlike = (f"units {x.unit} and {y.unit}" if x.unit != y.unit else f"shapes {shapes[0]} and {shapes[1]}" if shapes[0] != shapes[1]
                  else "no common steps" if len(steps) == 0 else "")
        if unlike:
            good = False
            lines.append(f"{name:24} cannot be compared: {unlike}")
            continue
        u, v = x.values[at_a], y.values[at_b]
        size = float(np.max(np.abs(v))) if v.size else 0.0
        difference = float(np.max(np.abs(u - v))) if v.size else 0.0
        relative = difference / size if size > 0 else difference
        within = relative <= tolerance
        good &= within
        # results may have different steps; report how many are common
        part = "" if len(steps) == len(x.steps) == len(y.steps) else f", at {len(steps)} common steps of {len(x.steps)} and {len(y.steps)}"
        lines.append(f"{name:24} {difference:.3e} {x.unit} of {size:.3e} {x.unit}: {relative:.2e}{part}"
                     f"{'' if within else '  beyond ' + format(tolerance, 'g')}")
    return lines, good
