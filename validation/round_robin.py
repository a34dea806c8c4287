#!/usr/bin/env python3
"""The round robin: Chung and Ooi's impacts, and the bulk processes of Dosta et al. 2024, in all codes that are here, with their times.

    validation/round_robin.py [--full] [--only silo,drum] [--page]

Runs one engine at a time and writes validation/results/round-robin.json after every case, so that an interrupted study continues where it
stopped; then docs/book/evidence/round-robin.md from it. `--full`: also the case of full size, for hours. `--page`: only the page.
"""
import argparse
import copy
import json
import math
import os
import platform
import resource
import sys
from datetime import datetime, timezone
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from concordem_validate import case as cases
from concordem_validate import compare, provenance, runner
from concordem_validate.rounds import Round, describe

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "validation/results/round-robin.json"
PAGE = ROOT / "docs/book/evidence/round-robin.md"
IMPACTS = ["hertz-normal", "hertz-restitution", "hertz-oblique", "chung-ooi"]
BULK = ["silo", "drum", "penetration"]
FULL = ["penetration-25000"]
# engines that have no particles, and therefore no time
TIMELESS = {"analytic", "table"}
# What the publication and YADE's deck of it (examples/DEM2020Benchmark) run: spheres, steps, and the small case with the same process.
# How many spheres the drum has is in a file that we do not have.
PUBLISHED = [("silo, M1, 5 s", 122_000, 3_333_333, "silo"), ("silo, M2, 5 s", 122_000, 2_500_000, "silo"),
             ("drum, 5 s, per 10,000 spheres", 10_000, 6_250_000, "drum"),
             *((f"penetration, {n:,} spheres, 0.1 s", n + 1, 200_000, "penetration") for n in (25_000, 50_000, 100_000))]
# the larger of two measured cases tells more
LARGER = {"penetration": "penetration-25000"}
# of ten spheres in flight: nearly all of its time is the start of a program
START = "hertz-restitution"
NAMES = {"concordem": "ConcorDEM", "yade": "YADE", "liggghts": "LIGGGHTS", "liggghts-np2": "LIGGGHTS, 2 processes", "analytic": "closed form",
         "table": "published"}


def timed(made, task, engine, limit):
    """What an engine did, and the seconds of a processor that it took. A run that an interrupted study has finished is kept with its seconds."""
    outcome, seconds = None, None
    for again in (False, True):
        # a stored run without its seconds is that of another study
        made.fresh = again
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        outcome = made.one(copy.copy(task), engine, limit)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if outcome.status != "done":
            break
        note = _note(outcome)
        if not outcome.kept:
            note.write_text(repr(sum(getattr(after, key) - getattr(before, key) for key in ("ru_utime", "ru_stime"))))
        if note.exists():
            seconds = float(note.read_text())
            break
    return outcome, seconds


def _note(outcome):
    return outcome.path.with_suffix(".seconds")


def measured(name, folder, few=()):
    """All engines on all variants of a case, or the `few` that are named, one after the other: times of their processes, and all verdicts."""
    case = cases.load(name)
    left_out = [e for e in case.engines if few and e not in few]
    if left_out:
        case = case.only([t.variant for t in case.tasks], [case.reference, *few])
    made = runner.Runner(folder, jobs=1, quiet=True, time_factor=20)
    round_, times = Round(), []
    for task in case.tasks:
        # a second run with two threads is no part of the time
        task.check_threads = False
        # the start state is made before, once
        made.with_start(copy.copy(task), "yade")
        for engine in [case.reference, *case.engines_of[task.variant]]:
            outcome, seconds = timed(made, task, engine, case.time_limit)
            round_.outcomes[name, task.variant, engine] = outcome
            if outcome.status == "done" and engine not in TIMELESS:
                numbers = outcome.result().numbers
                times.append(dict(variant=task.variant, engine=engine, processor_s=round(seconds, 3), particles=numbers.get("particles"),
                                  steps=numbers.get("steps")))
                print(f"{name} · {task.variant} · {engine}: {seconds:.1f} s", flush=True)
    curves = {}
    for (_, variant, engine), outcome in round_.outcomes.items():
        if outcome.status == "done" and hasattr(case.module, "curves"):
            task = next(t for t in case.tasks if t.variant == variant)
            for label, (x, y) in case.module.curves(task, outcome.result()).items():
                curves.setdefault(label, {})[engine] = [[float(f"{v:.5g}") for v in values] for values in (x, y)]
    # ratios of run times are checks of the harness, with both engines in turn
    case.checks = [check for check in case.checks if check.kind != "speed"]
    kept = ("variant", "check", "reference", "peer", "status", "cause", "difference", "tolerance", "known")
    verdicts = [{k: v for k, v in describe(one).items() if k in kept} for one in compare.judge(case, round_.outcomes)]
    states = {f"{o.variant} · {o.engine}": f"{o.status}: {o.message}" for o in round_.outcomes.values() if o.status != "done"}
    versions = {e: made.version(e) for e in dict.fromkeys(o.engine for o in round_.outcomes.values() if o.status == "done") if e not in TIMELESS}
    done = [o for o in round_.outcomes.values() if o.status == "done"]
    for outcome in done:
        # the next study measures again
        _note(outcome).unlink(missing_ok=True)
    return dict(title=case.title, source=case.source, times=times, verdicts=verdicts, not_done=states, left_out=left_out, curves=curves, versions=versions,
                date=datetime.now(timezone.utc).isoformat(timespec="seconds"), processor=provenance.processor(), host=platform.platform(),
                load_average=[round(x, 1) for x in os.getloadavg()], commit=provenance.of_tree())


def _estimates(data):
    """Lines of the page: hours of a processor for what is published, by the steps of a sphere that each engine makes in a second."""
    found = [row for row in PUBLISHED if row[-1] in data]
    if START not in data or not found:
        return []
    start = {t["engine"]: t["processor_s"] for t in data[START]["times"]}
    engines = [t["engine"] for t in data[found[0][-1]]["times"]]
    lines = ["", "## Published sizes", "",
             "Estimates: spheres times steps, at the speed of the largest case of the process that the engine has run, less the start of the program. Spheres",
             "that leave the silo count as if they stayed. 122,000 spheres do not fit into the caches that hold 580: each step of a sphere takes longer.", "",
             "| Published | Steps | " + " | ".join(f"{NAMES.get(e, e)}, hours" for e in engines) + " |", "|---|---|" + "---|" * len(engines)]
    for label, spheres, steps, name in found:
        measured = [t for one in (name, LARGER.get(name)) if one in data for t in data[one]["times"]]
        times = {t["engine"]: (t["processor_s"] - start[t["engine"]]) / (t["particles"] * t["steps"]) for t in measured}
        lines.append(f"| {label} | {steps:,} | " + " | ".join(f"{times[e] * spheres * steps / 3600:.2g}" for e in engines) + " |")
    return lines


def _number(value):
    return "" if value is None else "0" if value == 0 else f"{value:.1e}"


def _rows(one):
    """Of each check the largest difference of each pair over all variants, and what is allowed."""
    found = {}
    for v in one["verdicts"]:
        key = v["check"], v["reference"], v["peer"]
        limit = v.get("tolerance") if v.get("known") is None else v["known"][1]
        old = found.get(key)
        worst = max([x for x in (v["difference"], old and old[0]) if x is not None], default=math.nan)
        states = {v["status"]} | (old[2] if old else set())
        found[key] = worst, max(limit, old[1]) if old else limit, states
    words = {"pass": "agrees", "known": "differs as known", "fail": "FAILS", "missing": "not installed", "skipped": "cannot run"}
    for (check, reference, peer), (worst, limit, states) in found.items():
        state = next(s for s in ("fail", "missing", "skipped", "known", "pass") if s in states)
        yield f"| {check} | {NAMES.get(reference, reference)} | {NAMES.get(peer, peer)} | {_number(worst)} | {_number(limit)} | {words[state]} |"


def page(data):
    """The page of the book."""
    lines = ["# Evidence: round robin", "",
             "The benchmarks that all codes know: the impacts of Chung & Ooi 2011, and silo, drum, and penetration of Dosta et al. 2024. Every code gets the",
             "same start state. Written by `validation/round_robin.py` from `validation/results/round-robin.json`.", "",
             "The published packings are files that we do not have, and the cases of Dosta et al. are small: their materials, restitutions, frictions, and",
             "counted quantities follow the publication and YADE's deck of it, sizes and speeds do not. So codes are compared with each other there,",
             "not with published curves. Penetration of the published size: `validation/round_robin.py --full`; `--engines liggghts` leaves YADE out. An",
             "interrupted study keeps the engines that have finished.", "",
             "![Curves of the three bulk processes, each in three codes](../images/round-robin.png)", "",
             "*What the benchmark counts, in small, in all codes from the same start. Low is x > 0 > z in the drum, high x < 0 < z.*", "", "## Times", "",
             "Seconds of processor time of one process, with start and output. They compare codes on one machine in one hour, and say nothing of another.", ""]
    engines = list(dict.fromkeys(t["engine"] for one in data.values() for t in one["times"]))
    lines += ["| Case | Particles | Steps | " + " | ".join(NAMES.get(e, e) for e in engines) + " |", "|---|---|---|" + "---|" * len(engines)]
    for name, one in data.items():
        for variant in dict.fromkeys(t["variant"] for t in one["times"]):
            rows = {t["engine"]: t for t in one["times"] if t["variant"] == variant}
            first = next(iter(rows.values()))
            label = name if variant == "main" else f"{name}, {variant}"
            lines.append(f"| {label} | {first['particles']} | {first['steps']} | " + " | ".join(
                f"{rows[e]['processor_s']:.3g}" if e in rows else "" for e in engines) + " |")
    lines += _estimates(data)
    for name, one in data.items():
        lines += ["", f"## {one['title']}", "", f"Case `{name}`, {one['date'][:10]}, {one['processor']}. Source: {one['source']}.", "",
                  "| Check | Reference | Peer | Largest difference | Allowed | Verdict |", "|---|---|---|---|---|---|", *_rows(one)]
        lines += [f"\nNot done: {key}: {message}." for key, message in one["not_done"].items()]
        if one.get("left_out"):
            lines.append(f"\nNot run: {', '.join(NAMES.get(e, e) for e in one['left_out'])}.")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="also the cases of full size")
    parser.add_argument("--only", help="names of cases, separated by commas; they run again")
    parser.add_argument("--engines", help="only these beside the reference, separated by commas")
    parser.add_argument("--page", action="store_true", help="write the page, run nothing")
    options = parser.parse_args()
    data = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    wanted = options.only.split(",") if options.only else [n for n in [*IMPACTS, *BULK, *(FULL if options.full else [])] if n not in data]
    for name in [] if options.page else wanted:
        one = measured(name, ROOT / "target/validate/round-robin", options.engines.split(",") if options.engines else ())
        # another process may have added cases meanwhile
        data = (json.loads(RESULTS.read_text()) if RESULTS.exists() else {}) | {name: one}
        order = [*IMPACTS, *BULK, *FULL]
        data = {key: data[key] for key in sorted(data, key=lambda n: order.index(n) if n in order else len(order))}
        RESULTS.write_text(json.dumps(data, indent=1, ensure_ascii=False) + "\n")
        print(f"{name}: {', '.join(sorted({v['status'] for v in data[name]['verdicts']}))}", flush=True)
    PAGE.write_text(page(data))
    return int(any(v["status"] == "fail" for one in data.values() for v in one["verdicts"]))


if __name__ == "__main__":
    sys.exit(main())
