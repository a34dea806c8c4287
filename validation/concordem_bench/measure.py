"""Runs a case: its sides in turn, in alternating order, and the ratio of each round."""
import math
import os
import statistics
import time


def value(side, ratio, first):
    """What a ratio divides."""
    run = side[-1]
    if ratio.value == "breaking":
        return run["details"]["breaking" if first else "quiet"]["median_ns"]
    # No ratio, but a figure: over 1.
    if ratio.value == "memory":
        return run["details"]["peak_bytes_per_particle"] * 1e-3 if first else 1.0
    if ratio.value in ("wall_s", "first_step_s"):
        return run[ratio.value] if first else 1.0
    if ratio.value == "wall_ns":
        return run["details"]["loop_s"] / run["details"]["steps"] / run["contacts"] * 1e9
    return run[ratio.value]


def difference(a, b):
    """Relative difference of two numbers."""
    return abs(a - b) / max(abs(a), abs(b)) if a != b else 0.0


def run(case, rounds, say):
    """The figures of a case. Exits if two programs do not compute the same, because their times mean nothing then."""
    began, load = time.time(), os.getloadavg()[0]
    runs = {name: [] for name in case.sides}
    ratios = {ratio.name: [] for ratio in case.ratios}
    checks = []
    for k in range(rounds):
        for name in list(case.sides)[:: -1 if k % 2 else 1]:
            runs[name].append(case.sides[name]())
        for ratio in case.ratios:
            a, b = (value(runs[side], ratio, first) for side, first in zip(ratio.sides, (True, False)))
            if a is None or b is None:
                raise SystemExit(f"{case.name}: no step of the kind that {ratio.name} compares")
            ratios[ratio.name].append(a / b)
        if k == 0:
            checks = [_check(case, check, runs) for check in case.checks]
        say(f"{case.name}, round {k + 1} of {rounds}: " + ", ".join(f"{name} {values[-1]:.2f}" for name, values in ratios.items()))
    return {
        "what": case.what,
        "rounds": rounds,
        "seconds": round(time.time() - began),
        "load_average": [load, os.getloadavg()[0]],
        "sides": {name: _summary(found) for name, found in runs.items()},
        "ratios": [{"name": r.name, "median": statistics.median(ratios[r.name]), "rounds": ratios[r.name], "goal": r.goal,
                    "at_least": r.at_least} for r in case.ratios],
        "checks": checks,
    }


def _check(case, check, runs):
    a, b = (runs[side][0]["state"][check.key] for side in check.sides)
    found = difference(a, b)
    if not found <= check.tolerance or not math.isfinite(a) or a == 0.0:
        raise SystemExit(f"{case.name}: {check.key} of {check.sides[0]} is {a!r}, of {check.sides[1]} {b!r}: they differ by {found:.1e}, "
                         f"more than {check.tolerance:g}. {check.reason}")
    return {"sides": check.sides, "key": check.key, "values": [a, b], "difference": found, "tolerance": check.tolerance,
            "reason": check.reason}


def _summary(found):
    """Median times, and the details of the run with the median time."""
    middle = sorted(found, key=lambda run: run["ns"])[len(found) // 2]
    return {"ns": statistics.median(run["ns"] for run in found), "rounds_ns": [run["ns"] for run in found],
            "process_s": statistics.median(run["process_s"] for run in found), "contacts": middle["contacts"],
            "state": middle["state"], "details": middle["details"]}
