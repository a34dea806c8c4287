"""Verdicts: the difference between two engines in what a check names, and whether it is within the tolerance."""
import datetime
import math
import traceback
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from . import balance, meeting, norms, timing
from . import difference as bits
from .engines.translate import steps_of
from .errors import HarnessError, Incomparable
from .quantity import si

# Two-sided 95 % quantiles of Student's t for 1, 2, ... degrees of freedom (Abramowitz & Stegun 1964, table 26.10).
_T = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228]


@dataclass
class Verdict:
    """One check of one variant (or of all variants of an ensemble), between the reference and a peer."""

    case: str
    variant: str
    check: object
    status: str  # pass, known, fail, missing, skipped
    difference: float = math.nan
    message: str = ""
    cause: str = ""  # of a failure: difference, short, nan, empty, timeout, crashed, unsupported, blind, start, expired, error
    steps: np.ndarray = None
    axis: str = "step"
    growth: np.ndarray = None
    values: tuple = None
    band: tuple = None
    peer: str = None
    reference: str = "concordem"

    def __post_init__(self):
        self.peer = self.peer or self.check.peer


def measures(case, task, result):
    """The numbers of a result: those of a table, or those that `measures` in the case's case.py computes from it."""
    if "measures" in result.numbers:
        return result.numbers["measures"]
    function = getattr(case.module, "measures", None)
    if function is None:
        if result.numbers:
            return result.numbers
        raise HarnessError(f"case {case.name} has no function `measures` in case.py; add it")
    found = function(task, result)
    if not isinstance(found, dict):
        raise HarnessError(f"{case.folder / 'case.py'}: `measures` returned {found!r} for {result.engine} in variant {task.variant}; return a table of numbers")
    return found


def scale_of(scale, reference):
    """Scale of a difference: the largest value, the largest displacement since the first step, or a given quantity."""
    if scale == "maximum":
        size = float(norms.sizes(reference).max(initial=0.0))
    elif scale == "displacement":
        size = float(norms.sizes(reference - reference[0]).max(initial=0.0))
    else:
        size = si(scale)
    if not size > 0:
        raise Incomparable("error", f"the scale of the comparison ({scale}) is {size}, but must be positive; give another scale")
    return size


def _matched(check, pair, ours, theirs):
    """Particles in one order: by id as they come, or each with the one at its place at the first common point."""
    if check.match == "id" or pair.a.ndim < 3:
        return pair
    a, b = (meeting.of(r, "position").values[0] for r in (ours, theirs))
    nearest = np.array([int(np.argmin(np.linalg.norm(b - place, axis=1))) for place in a])
    if len(set(nearest.tolist())) != len(nearest):
        raise Incomparable("error", "particles cannot be matched by place: two have the same nearest partner")
    pair.b = pair.b[:, nearest]
    return pair


def _moved(check, ours, theirs, unit):
    """The reference's particles moved as a rigid body onto the peer's at each point (Kabsch 1976), where the check asks for shape only."""
    if check.frame == "fixed":
        return ours
    if ours.ndim != 3 or unit != "m" or ours.shape[1] < 2:
        raise Incomparable("error", f"`frame = \"{check.frame}\"` needs positions of several particles")
    moved = np.empty_like(ours)
    for k, (a, b) in enumerate(zip(ours, theirs)):
        left, _, right = np.linalg.svd((a - a.mean(axis=0)).T @ (b - b.mean(axis=0)))
        turn = left @ np.diag([1, 1, np.sign(np.linalg.det(left @ right))]) @ right
        moved[k] = (a - a.mean(axis=0)) @ turn + b.mean(axis=0)
    return moved


def series(check, ours, theirs, names=("concordem", None), span=None):
    """The common points, the difference over the scale at each, and the two curves; refuses a check that could not fail."""
    names = (names[0], names[1] or check.peer)
    pair = _matched(check, meeting.meet(check, ours, theirs, names, span), ours, theirs)
    pair.a = _moved(check, pair.a, pair.b, pair.unit)
    size = scale_of(check.scale, pair.b)
    number = norms.NORMS[check.norm](pair.x, pair.a, pair.b, size)
    _can_fail(check, pair, size)
    pair.growth = norms.sizes(pair.a - pair.b).max(axis=1) / size
    return pair, number


def _can_fail(check, pair, size):
    """A check sees nothing if the first value, held, would pass as well; or, of a wanted constant, if zero would."""
    limit = check.known[1] if check.known else check.tolerance
    if check.constant:
        held = np.zeros_like(pair.b)
        if not pair.b.any():
            return
    else:
        held = _held(check, pair)
        if np.array_equal(pair.b[:1].repeat(len(pair.b), axis=0), pair.b):
            raise Incomparable("blind", f"`{check.of}` is constant, so the check sees no motion; give `constant = true` if it must be")
    try:
        blind = norms.NORMS[check.norm](pair.x, held, pair.b, size) <= limit
    except HarnessError:
        return
    if blind:
        raise Incomparable("blind", f"the check cannot fail: {'zero' if check.constant else 'the first value, held,'} is within the tolerance "
                                    f"{limit:g}; lower it")


def _held(check, pair):
    """The peer's first value at all points: what an engine gives that does nothing."""
    return _moved(check, pair.b[:1].repeat(len(pair.b), axis=0), pair.b, pair.unit)


def scalar(check, ours, theirs, names=("concordem", None)):
    names = (names[0], names[1] or check.peer)
    for values, who in zip((ours, theirs), names):
        if check.of not in values:
            raise Incomparable("error", f"{who} has no number `{check.of}`; use one of {', '.join(sorted(values))}")
    for values, who in zip((ours, theirs), names):
        try:
            np.asarray(values[check.of], float)
        except (TypeError, ValueError):
            raise Incomparable("error", f"`{check.of}` of {who} is {values[check.of]!r}; give numbers") from None
    x, y = (np.atleast_1d(np.asarray(values[check.of], float)) for values in (ours, theirs))
    if x.shape != y.shape:
        raise Incomparable("error", f"`{check.of}` has shape {x.shape} in {names[0]} and {y.shape} in {names[1]}")
    if x.size == 0:
        raise Incomparable("empty", f"`{check.of}` has no numbers")
    for values, who in zip((x, y), names):
        if not np.isfinite(values).all():
            raise Incomparable("nan", f"`{check.of}` of {who} is not a finite number")
    if check.scale == "sum":
        # mean error over mean magnitude, as in the tests of Kratos
        size, off = float(np.sum(np.abs(y))), float(np.sum(np.abs(x - y)))
    else:
        size = float(np.max(np.abs(y))) if check.scale == "maximum" else si(check.scale)
        off = float(np.max(np.abs(x - y)))
    if not size > 0:
        raise Incomparable("error", f"the scale of `{check.of}` is {size}; give `scale`")
    if not (x.any() or y.any() or check.may_be_zero):
        raise Incomparable("blind", f"`{check.of}` is zero in both, as in a run that does nothing; give `may_be_zero = true` if it must be")
    limit = check.known[1] if check.known else check.tolerance
    if y.any() and not check.may_be_zero and (1.0 if check.scale == "sum" else float(np.max(np.abs(y))) / size) <= limit:
        raise Incomparable("blind", f"the check cannot fail: zero is within the tolerance {limit:g}; lower it")
    return off / size, (x, y)


def band(differences):
    """Mean and half width of its 95 % confidence interval."""
    d = np.asarray(differences)
    if len(d) < 3:
        raise Incomparable("short", "an ensemble needs at least three members")
    t = _T[min(len(d) - 2, len(_T) - 1)]
    return float(d.mean()), float(t * d.std(ddof=1) / math.sqrt(len(d)))


def welch(a, b):
    """Difference of the means of two independent samples, and half width of its 95 % interval (Welch 1947)."""
    a, b = np.asarray(a), np.asarray(b)
    if min(len(a), len(b)) < 3:
        raise Incomparable("short", "an ensemble needs at least three members")
    u, v = a.var(ddof=1) / len(a), b.var(ddof=1) / len(b)
    freedom = (u + v) ** 2 / (u**2 / (len(a) - 1) + v**2 / (len(b) - 1)) if u + v > 0 else math.inf
    # fewer degrees of freedom widen the interval
    t = _T[max(1, min(int(min(freedom, len(_T))), len(_T))) - 1]
    return float(a.mean() - b.mean()), float(t * math.sqrt(u + v))


def _settle(verdict, difference, roles_changed=False):
    check = verdict.check
    verdict.difference = difference
    if math.isnan(difference):
        verdict.status, verdict.cause, verdict.message = "fail", "nan", "the difference is NaN"
    elif check.band is not None:
        low, high = check.band
        verdict.status = "pass" if low <= difference <= high else "fail"
        verdict.cause = "" if verdict.status == "pass" else "difference"
        if verdict.status == "fail":
            verdict.message = f"the ratio of run times is {difference:.3g}, allowed are {low:g} to {high:g}. {verdict.message}"
    elif check.known is not None:
        low, high = check.known
        # the range is of the pair that it was measured with; another pair may differ less
        verdict.status = "known" if (0.0 if roles_changed else low) <= difference <= high else "fail"
        if verdict.status == "fail":
            verdict.cause = "difference"
            verdict.message = f"the known difference is {low:g} … {high:g}, so quirk {check.quirk} has changed"
        elif check.until and check.until < datetime.date.today():
            verdict.status, verdict.cause = "fail", "expired"
            verdict.message = f"the known difference {check.quirk} was accepted until {check.until}; mend it, or renew `until` in quirks.toml"
    else:
        verdict.status = "pass" if difference <= check.tolerance else "fail"
        verdict.cause = "" if verdict.status == "pass" else "difference"
    return verdict


def fail(verdict, error):
    """A verdict about a comparison that could not be made."""
    verdict.status, verdict.difference = "fail", math.nan
    if isinstance(error, HarnessError):
        verdict.cause, verdict.message = getattr(error, "cause", "error"), str(error)
    else:
        place = traceback.extract_tb(error.__traceback__)[-1]
        verdict.cause = "error"
        verdict.message = f"{Path(place.filename).name}:{place.lineno}: {type(error).__name__}: {error}"
    return verdict


class Judge:
    """All verdicts of a case."""

    def __init__(self, case, outcomes, plant=None, times=None):
        self.case, self.outcomes, self.plant, self.times = case, outcomes, plant or {}, times or {}
        self.tasks = {task.variant: task for task in case.tasks}
        self.results = {}

    def result(self, variant, engine):
        key = self.case.name, variant, engine
        if key not in self.results:
            self.results[key] = self.outcomes[key].result()
            for change in self.plant.get(f"result:{engine}", []):
                change(self.results[key])
        return self.results[key]

    def verdicts(self):
        out = []
        for check in self.case.checks:
            reference, peer = check.pair
            if check.kind == "ensemble":
                out.append(self._guarded(Verdict(self.case.name, f"{len(self.case.variants_of(check))} members", check, "fail", peer=peer,
                                                 reference=reference), self._ensemble))
                continue
            for variant in self.case.variants_of(check):
                verdict = Verdict(self.case.name, variant, check, "fail", peer=peer, reference=reference)
                bad = self._unfinished(variant, (reference,) if check.kind == "balance" else (reference, peer))
                if bad:
                    verdict.status, verdict.cause, verdict.message = bad
                else:
                    self._guarded(verdict, self._one)
                out.append(verdict)
        return out

    def _guarded(self, verdict, function):
        try:
            function(verdict)
        except Exception as error:
            # one case must not end the round, whatever its case.py raises
            fail(verdict, error)
        return verdict

    def _one(self, verdict):
        check, variant, names = verdict.check, verdict.variant, (verdict.reference, verdict.peer)
        if check.kind == "balance":
            self._balance(verdict)
            return
        ours, theirs = (self.result(variant, name) for name in names)
        for one, name in ((ours, names[0]), (theirs, names[1])):
            if not one.series and not one.numbers:
                raise Incomparable("empty", f"the result of {name} is empty")
        task = self.tasks[variant]
        spans = [span_of(task, one.dt, name) for one, name in zip((ours, theirs), names)]
        if check.kind == "series":
            pair, number = series(check, ours, theirs, names, spans[0])
            verdict.steps, verdict.axis = (pair.steps, "step") if pair.steps is not None else (pair.x, check.over)
            verdict.growth, verdict.values = pair.growth, (pair.a, pair.b)
            if check.twin is not None:
                number, verdict.message = self._beside_twins(verdict, ours, names, pair)
        elif check.kind == "bits":
            for one, name, span in zip((ours, theirs), names, spans):
                _whole_run(one, span, name)
            if ours.series and not any((one.values != one.values[:1]).any() for one in ours.series.values()):
                raise Incomparable("blind", f"nothing changes in the run of {names[0]}, so equal bits say nothing")
            found = bits.same_bits(ours, theirs)
            number, verdict.message = float(len(found)), "; ".join(found[:3])
        elif check.kind == "speed":
            # who does half of the work is twice as fast
            for one, name, span in zip((ours, theirs), names, spans):
                _whole_run(one, span, name)
            number, verdict.message = timing.ratio(self.times.get((self.case.name, variant, *names)), names)
        else:
            for one, name, span in zip((ours, theirs), names, spans):
                _whole_run(one, span, name)
            number, verdict.values = scalar(check, *(measures(self.case, task, one) for one in (ours, theirs)), names)
        message = verdict.message
        _settle(verdict, number, check.roles_changed)
        verdict.message = verdict.message or message

    def _balance(self, verdict):
        """What the reference conserves, by itself."""
        task, result = self.tasks[verdict.variant], self.result(verdict.variant, verdict.reference)
        _whole_run(result, span_of(task, result.dt, verdict.reference), verdict.reference)
        verdict.steps, verdict.growth = balance.of(verdict.check, task, result)
        _settle(verdict, float(verdict.growth.max()))

    def _beside_twins(self, verdict, ours, names, pair):
        """The difference where it is over the tolerance and over a multiple of what one changed bit has made by then."""
        check, name = verdict.check, f"{names[0]}@twin"
        bad = self._unfinished(verdict.variant, [name])
        if bad:
            raise Incomparable("error", f"the twin of {names[0]} is needed: {bad[2]}")
        twins, _ = series(replace(check, twin=None), ours, self.result(verdict.variant, name), (names[0], name))
        parted = np.interp(pair.x, twins.x, np.maximum.accumulate(twins.growth))
        largest = lambda growth: float(growth[growth > check.twin * parted].max(initial=0.0))
        at, size = largest(pair.growth), scale_of(check.scale, pair.b)
        if largest(norms.sizes(_held(check, pair) - pair.b).max(axis=1) / size) <= check.tolerance:
            raise Incomparable("blind", "the check cannot fail: the twins part before the first value, held, is beyond the tolerance; "
                                        "compare an earlier part, or lower `twin`")
        chaos = np.flatnonzero(check.twin * parted > check.tolerance)
        return at, f"twins part beyond the tolerance at {check.over} {pair.x[chaos[0]]:.4g}" if len(chaos) else "twins stay together"

    def _unfinished(self, variant, engines):
        for engine in engines:
            outcome = self.outcomes.get((self.case.name, variant, engine))
            if outcome is None:
                return "missing", "", f"{engine} was not run"
            if outcome.status != "done":
                status = outcome.status if outcome.status in ("missing", "skipped") else "fail"
                return status, "" if status != "fail" else outcome.status, f"{engine} {outcome.status}: {outcome.message}"
        return None

    def _ensemble(self, verdict):
        check, names = verdict.check, (verdict.reference, verdict.peer)
        numbers = []
        for variant in self.case.variants_of(check):
            bad = self._unfinished(variant, names)
            if bad:
                verdict.status, verdict.cause, verdict.message = bad
                return
            task, results = self.tasks[variant], [self.result(variant, name) for name in names]
            for result, name in zip(results, names):
                _whole_run(result, span_of(task, result.dt, name), name)
            pair = [measures(self.case, task, result) for result in results]
            for values, name in zip(pair, names):
                if check.of not in values or not math.isfinite(values[check.of]):
                    raise Incomparable("nan", f"{variant}: `{check.of}` of {name} is missing or not a finite number")
            numbers.append([values[check.of] for values in pair])
        ours, theirs = np.array(numbers, float).T
        for values, name in zip((ours, theirs), names):
            if len(values) > 1 and np.ptp(values) == 0:
                raise Incomparable("blind", f"`{check.of}` of {name} is {values[0]:g} in all {len(values)} members: they are one and the same run, "
                                            "or the number does not depend on it")
        scale = np.abs(theirs) if check.scale == "maximum" else np.full(len(theirs), si(check.scale))
        limit = check.known[1] if check.known else check.tolerance
        if theirs.any() and np.max(np.abs(theirs) / scale) <= limit:
            raise Incomparable("blind", f"the check cannot fail: zero is within the tolerance {limit:g}; lower it")
        verdict.band = band((ours - theirs) / scale) if check.paired else welch(ours / scale.mean(), theirs / scale.mean())
        mean, half = verdict.band
        verdict.values = ((ours - theirs) / scale, np.zeros(len(ours)))
        # equivalence test: the whole confidence interval of the mean difference must be within the tolerance
        _settle(verdict, abs(mean) + half, check.roles_changed)
        verdict.message = verdict.message or f"mean difference {mean:+.2e} ± {half:.1e} (95 %, {len(numbers)} members)"


def span_of(task, dt, name=""):
    """What a run was to cover, where the scenario says it. An engine with half of the step takes twice as many."""
    dt *= 2 if name.endswith("@half-step") else 1
    if task.command != "run" or not dt > 0:
        return None
    try:
        steps = steps_of(task.scenario, dt)
    except HarnessError:
        return None
    output, often = task.scenario.get("output", {}), [row.get("interval", 1) for row in task.scenario.get("sample", [])]
    samples = output.get("sample_interval", 10)
    # ConcorDEM ends at a time when it takes the next record
    return meeting.Span(steps, samples if "time" in task.scenario.get("stop", {}) else 0, max(samples, output.get("snapshot_interval") or 1, *often, 1), dt)


def _whole_run(result, span, name):
    """Numbers computed from a run need the whole run."""
    if span is None:
        return
    series = [one for one in result.series if len(result.series[one].steps) > 1]
    if result.series and not series:
        one = next(iter(result.series))
        raise Incomparable("short", f"the run of {name} has one sample, of `{one}`, so it says nothing about the whole run")
    for one in series:
        time = result.time(one)
        if not np.isfinite(time).all():
            raise Incomparable("nan", f"the times of `{one}` of {name} are not finite numbers")
        if np.any(np.diff(time) <= 0):
            raise Incomparable("error", f"the times of `{one}` of {name} do not rise")
        meeting.covers(f"`{one}` of {name}", time, "time", span)


def judge(case, outcomes, plant=None, times=None):
    return Judge(case, outcomes, plant, times).verdicts()


def odd_one_out(verdicts):
    """Per check and variant with at least three engines: the one that differs from all others, which agree among themselves."""
    found = []
    groups = {}
    for verdict in verdicts:
        if verdict.values is not None and verdict.check.kind != "ensemble" and math.isfinite(verdict.difference):
            groups.setdefault((verdict.case, verdict.variant, verdict.check.name, verdict.reference), []).append(verdict)
    for (case, variant, name, reference), members in groups.items():
        bad = [v for v in members if v.status == "fail"]
        if len(members) < 2 or not bad:
            continue
        if len(bad) == len(members):
            found.append((case, variant, name, reference))
        elif len(bad) == 1:
            found.append((case, variant, name, bad[0].peer))
    return found
