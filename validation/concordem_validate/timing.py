"""Ratios of run times: two engines in turn, one at a time, on this machine. A time alone says nothing about another machine or hour."""
import copy
import hashlib
import json
import platform
import shutil
import tempfile
from pathlib import Path

from . import provenance, registry
from .errors import HarnessError, Incomparable

# shorter runs are mostly the start of a program
SHORTEST = 5e-3
_DEFAULT = 3


def keys(case):
    """What a case wants timed: (variant, reference, peer) and how often."""
    for check in case.checks:
        if check.kind == "speed":
            for variant in case.variants_of(check):
                yield (variant, *check.pair), check.repeats or _DEFAULT


def measure(runner, case, outcomes):
    """Pairs of seconds of all speed checks of a case, by (case, variant, reference, peer)."""
    found = {}
    for (variant, *pair), repeats in keys(case):
        done = [outcomes.get((case.name, variant, name)) for name in pair]
        if all(one is not None and one.status == "done" for one in done):
            task = next(task for task in case.tasks if task.variant == variant)
            seconds = _stored(runner, case, task, pair, repeats, done)
            key = case.name, variant, *pair
            found[key] = max(seconds, found.get(key, []), key=len)
    return found


def _stored(runner, case, task, pair, repeats, outcomes):
    """Times of the same two runs on the same machine are kept, like runs are."""
    runs = [one.provenance().get("key") for one in outcomes]
    text = json.dumps([pair, repeats, runs, platform.node(), provenance.processor()])
    path = runner.folder / "runs" / f"times-{hashlib.sha256(text.encode()).hexdigest()[:24]}.json"
    if path.exists() and not runner.fresh:
        try:
            return json.loads(path.read_text())
        except ValueError:
            pass  # damaged: timed again
    # what is timed must do what was compared
    samples = {name: _samples(one.result()) for name, one in zip(pair, outcomes)}
    seconds = []
    for number in range(repeats):
        # each engine is first as often as the other, as far as the number allows
        order = pair if number % 2 == 0 else pair[::-1]
        times = {name: _time(runner, case, task, name, samples[name]) for name in order}
        seconds.append([times[name] for name in pair])
    partial = path.with_suffix(".part")
    partial.write_text(json.dumps(seconds))
    partial.replace(path)
    return seconds


def _samples(result):
    return {name: len(one.steps) for name, one in result.series.items()}


def _time(runner, case, task, name, samples):
    own = copy.copy(task)
    own.check_threads = False
    runner.with_start(own, name)
    if name != "concordem" and own.peer_scenario:
        own.scenario = own.peer_scenario
    folder = Path(tempfile.mkdtemp(prefix=f"concordem-time-{name}-"))
    try:
        result = registry.ENGINES[name].run(own, folder, case.time_limit * runner.time_factor)
        return result.numbers.get("wall_s") if _samples(result) == samples else None
    except HarnessError:
        return None
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def ratio(seconds, names):
    """Median of the ratios, and words about it; refuses what says nothing."""
    if not seconds:
        raise Incomparable("error", "the two engines were not timed in this round; run it again")
    for name, times in zip(names, zip(*seconds)):
        if not all(times):
            raise Incomparable("error", f"a run of {name} has no number `wall_s`, or failed when it was timed, or did not end where the compared run ends")
        if min(times) < SHORTEST:
            raise Incomparable("blind", f"runs of {name} take {min(times):.2g} s, too short for a ratio; take more steps or particles")
    ratios = sorted(a / b for a, b in seconds)
    middle = len(ratios) // 2
    median = ratios[middle] if len(ratios) % 2 else 0.5 * (ratios[middle - 1] + ratios[middle])
    fastest = ", ".join(f"{name} {min(times):.3g} s" for name, times in zip(names, zip(*seconds)))
    return median, f"{len(ratios)} ratios from {ratios[0]:.3g} to {ratios[-1]:.3g}; {fastest}"
