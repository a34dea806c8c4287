#!/usr/bin/env python3
"""The rigid box of ERDC TR-14-6 Report 3, section 5.2: three sphere sizes in two boxes, sampled while the lid moves down.

    validation/rigid_box_sampling.py [--full] [--built]

Each case is one run of `examples/rigid_box_sampling.rs`. YADE's operators (`yade_operators.py`) are then applied to its final state
and must agree with ours (A8). Results are written to validation/results/rigid_box_sampling.json after every case, so that an
interrupted study continues where it stopped; finished cases are checked again. Without --full, one case with a tenth of the spheres
runs, and no results are written. A criterion that is not met is an error, unless it is listed in `OTHERS`; a listed one that is met is
also an error.
"""

import argparse
import json
import math
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from concordem_validate import provenance

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "target/release/examples/rigid_box_sampling"
RESULTS = ROOT / "validation/results/rigid_box_sampling.json"

# Sums over about ten thousand contacts, each term rounded to 1.1e-16: 1e-12 if all errors add up; recorded: 2e-14.
ROUNDING = 1e-12
# Command that applies YADE's operators to a state.
SAME = ["stress", "particle_stress", "fabric", "coordination", "porosity", "cell_volume"]
# Forces on rigid blocks cancel in pairs, which leaves the rounding of the terms, relative to the sum of all terms: a hundred times
# 1.1e-16; recorded: 2e-17.
RIGID = 1e-14
# Cases (size, box) in which the other strain components are 7.6 to 17.3 % of the lid's instead of at most 7 %. These specimens have 307
# to 672 spheres; the two with more than 950 meet the criterion.
OTHERS = {(1, 1), (2, 1), (1, 2), (2, 2)}


def flat(value):
    return [x for part in value for x in flat(part)] if isinstance(value, list) else [value]


def in_yade(state, strict):
    """Largest difference between YADE's operators and ours on the state, over the largest value, by operator."""
    if not shutil.which("yade"):
        if strict:
            sys.exit("rigid_box_sampling.py: YADE is not installed: apt install yade")
        return {"skipped": "YADE is not installed"}
    script = Path(__file__).with_name("yade_operators.py")
    command = ["yade", "-n", "-x", "-j1", str(script)]
    answer = subprocess.run(command, env=os.environ | {"STATE": state}, stdout=subprocess.PIPE, text=True)
    lines = [line for line in answer.stdout.splitlines() if line.startswith("{")]
    if answer.returncode or not lines:
        sys.exit(f"rigid_box_sampling.py: YADE failed on {state}:\n{answer.stdout}")
    theirs = json.loads(lines[-1])
    ours = json.loads(Path(state).read_text())["found"]
    inner = ours.pop("inner_cell")
    for found in (ours, theirs):
        found["cell_volume"] = [v for v, within in zip(found["cell_volume"], inner) if within]
    result = {"version": theirs["version"], "inner_cells": sum(inner)}
    for name in SAME:
        pairs = list(zip(flat(ours[name]), flat(theirs[name]), strict=True))
        result[name] = max(abs(x - y) for x, y in pairs) / max(abs(x) for x, _ in pairs)
    return result


def run(*arguments, strict):
    with tempfile.TemporaryDirectory() as folder:
        state = str(Path(folder) / "state.json")
        command = [PROGRAM, *map(str, arguments), state]
        result = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout)
        result["A8"] = in_yade(state, strict)
    return result


def failures(result, strict):
    """Acceptance criteria that a case does not meet, as messages."""
    wrong = []

    def demand(holds, what):
        if not holds:
            wrong.append(f"size {result['case']}, box {result['geometry']}: {what}")

    # A1 and A2 assume a network that is fine compared with the sampling sphere, which a tenth of the spheres is not.
    if result["scale"] == 1:
        strain, others = result["A1"]["ratio"], result["A1"]["largest_other_over_zz"]
        demand(abs(strain - 1) < 0.1, f"A1: the strain is {strain:.3f} of the lid's; 1 within 0.1 is expected")
        if (result["case"], result["geometry"]) in OTHERS:
            demand(others >= 0.07, f"A1: other components are {others:.3f} of the lid's, below 0.07 again; remove the case from OTHERS")
        else:
            demand(others < 0.07, f"A1: other components are {others:.3f} of the lid's; below 0.07 is expected")
        ratio = result["A2"]["internal_over_clipped_trace"] / result["A2"]["law_by_branch"]
        demand(abs(ratio - 1) < 0.05, f"A2: internal-only over clipped is {ratio:.3f} of the law; 1 within 0.05 is expected")
    rigid, balance = max(result["A3"].values()), result["A6"]["balance"]
    demand(rigid < RIGID, f"A3: forces and moments of rigid blocks are {rigid:.1e}; below {RIGID:.0e} is expected")
    demand(balance < ROUNDING, f"A6: the force balance of all states has an error of {balance:.1e}; below {ROUNDING:.0e} is expected")
    first, second = result["A7"]["singular_values"][:2]
    demand(second > 1e-3 * first, f"A7: singular values of the couple stress are {first:.3g}, {second:.3g}: rank 1")
    if strict or "skipped" not in result["A8"]:
        for name in SAME:
            apart = result["A8"].get(name, math.inf)
            demand(apart < ROUNDING, f"A8: {name} differs from YADE's by {apart:.1e}; below {ROUNDING:.0e} is expected")
    return wrong


def stop_at(wrong):
    if wrong:
        sys.exit("rigid_box_sampling.py: " + "\n".join(wrong))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="all cases with the printed numbers of spheres; hours")
    parser.add_argument("--built", action="store_true", help="the example is built already, as cargo test leaves it")
    arguments = parser.parse_args()
    if arguments.full and arguments.built:
        parser.error("--full builds the example itself, so that its figures are those of the commit on record")
    if not arguments.built:
        build = ["cargo", "build", "--release", "-p", "concordem", "--example", "rigid_box_sampling"]
        subprocess.run(build, check=True, cwd=ROOT)
    if not arguments.full:
        strict = bool(os.environ.get("CI"))
        result = run(1, 1, 10, strict=strict)
        print(json.dumps({name: result[name] for name in ("A1", "A2", "A3", "A6", "A8")}, indent=1))
        stop_at(failures(result, strict))
        return
    results = json.loads(RESULTS.read_text())
    commit = provenance.of_tree()
    known = {(case["case"], case["geometry"]) for case in results["cases"]}
    for case in [(size, box) for box in (1, 2) for size in (1, 2, 3)]:
        if case in known:
            continue
        result = run(*case, 1, strict=True)
        stop_at(failures(result, True))
        results["cases"].append(result | {"commit": commit, "machine": f"{platform.machine()}, {os.cpu_count()} processors"})
        temporary = RESULTS.with_suffix(".tmp")
        temporary.write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n")
        temporary.replace(RESULTS)
        print(f"size {case[0]}, box {case[1]}: done", flush=True)
    stop_at([what for case in results["cases"] for what in failures(case, True)])


if __name__ == "__main__":
    main()
