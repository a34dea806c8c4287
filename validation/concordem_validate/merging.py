"""One round of those that several machines made."""
import shutil
from pathlib import Path

from . import rounds
from .difference import same_bits
from .errors import HarnessError

# a finished run counts more than an engine that was not there
_WEIGHT = {"missing": 0, "skipped": 1}


def merge(folders, target):
    """One round of several that other machines made; the order does not matter."""
    target = Path(target)
    (target / "runs").mkdir(parents=True, exist_ok=True)
    merged, starts, places = rounds.Round(), {}, {}
    for folder in folders:
        part = rounds.again(folder)
        for key, outcome in part.outcomes.items():
            if outcome.path and not outcome.path.exists():
                raise HarnessError(f"{outcome.path} is missing; copy the whole folder {folder}")
            before = merged.outcomes.get(key)
            if before:
                weights = [_WEIGHT.get(one.status, 2) for one in (before, outcome)]
                if weights == [2, 2]:
                    _consistent(before, outcome, places[key], folder)
                if weights[0] >= weights[1]:
                    continue
            merged.outcomes[key], places[key] = outcome, folder
        for key, seconds in part.times.items():
            # pairs of several machines are all ratios
            merged.times[key] = sorted([*merged.times.get(key, []), *(pair for pair in seconds if pair not in merged.times.get(key, []))], key=str)
        merged.wanted = sorted({*merged.wanted, *part.wanted})
        for start in rounds.record(folder)["starts"]:
            # a start state that was wrong on one machine stays wrong: peers had it
            worst = lambda row: ("skipped", "pass", "fail").index(row["status"])
            before = starts.get((start["case"], start["variant"]))
            if before is None or worst(start) > worst(before):
                starts[start["case"], start["variant"]] = start
    for outcome in merged.outcomes.values():
        if outcome.path:
            place = target / "runs" / outcome.path.name
            if place.resolve() != outcome.path.resolve():
                shutil.copy(outcome.path, place)
            outcome.path = place
    return merged, list(starts.values())


def _consistent(a, b, first, second):
    """Two results of one engine on one variant must be the same: which one a check takes would decide it."""
    where = f"{a.case} · {a.variant} · {a.engine}"
    if (a.status == "done") != (b.status == "done"):
        raise HarnessError(f"{where} is {a.status} in {first} and {b.status} in {second}; merge one of them, or mend the engine")
    found = same_bits(a.result(), b.result()) if a.status == "done" else []
    if found:
        raise HarnessError(f"{where} differs between {first} and {second}: {found[0]}; merge one of them, or run the engine on one machine")
