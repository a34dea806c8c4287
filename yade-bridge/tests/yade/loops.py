"""Processor time of loops over interactions, and of steps with GlobalStiffnessTimeStepper, in stock YADE and beside a bonded engine.

    python3 loops.py [ROUNDS]     with the package in PYTHONPATH; one line of a table per loop

YADE and the engine take turns, each in a process of its own, so that other programs slow both. Times are in ms per step, the medians of the rounds; the
ratio is the median of the pairs, in brackets the smallest and the largest.
"""

import json
import os
import re
import statistics
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__ if "LOOPS" not in os.environ else sys.argv[0]))


def inside(ours):
    """The times of one run, inside YADE."""
    sys.path.insert(0, HERE)
    import specimen
    from yade import O, GlobalStiffnessTimeStepper

    import concordem.yade as bridge

    def scene(*steppers):
        specimen.concrete(rate=20.0)
        O.engines = O.engines[:-1] + list(steppers) + O.engines[-1:]
        O.run(100, True)
        if ours:
            bridge.take_over()
        O.run(2, True)

    loops = {
        "`sum(1 for i in O.interactions)`": lambda: sum(1 for i in O.interactions),
        "one attribute of each": lambda: sum(i.phys.omega for i in O.interactions),
        "two attributes of real ones": lambda: [(i.id1, i.phys.normalForce) for i in O.interactions if i.isReal],
        "`countReal()`": lambda: O.interactions.countReal(),
        "`b.intrs()` of all bodies": lambda: sum(len(b.intrs()) for b in O.bodies),
    }
    found = {}
    scene()
    for name, loop in loops.items():
        found[name] = cost(O.step, loop)
    for interval in (1, 10):
        scene(GlobalStiffnessTimeStepper(timestepSafetyCoefficient=0.4, timeStepUpdateInterval=interval))
        found[f"steps, a stepper in every {'step' if interval == 1 else f'{interval}th'}"] = cost(lambda: None, lambda: O.run(20, True)) / 20
    found["interactions"] = len(O.interactions)
    print("RESULT " + json.dumps(found), flush=True)


def cost(before, act, rounds=31):
    """Median of some rounds, ms."""
    times = []
    for _ in range(rounds):
        before()
        began = time.process_time()
        act()
        times.append(time.process_time() - began)
    return 1e3 * statistics.median(times)


def run(ours):
    """The result of one run in a process of its own."""
    done = subprocess.run(["yade", "-n", "-x", "-j1", os.path.abspath(__file__)], env={**os.environ, "LOOPS": str(int(ours))}, capture_output=True, text=True, check=False)
    found = re.search(r"^RESULT (.*)$", done.stdout, re.M)
    if found is None:
        sys.exit(f"no result:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return json.loads(found[1])


def main(rounds):
    """Print the table."""
    pairs = []
    for k in range(rounds):
        both = {ours: run(ours) for ours in ((False, True) if k % 2 else (True, False))}
        pairs.append((both[False], both[True]))
    print("interactions:", *(one.pop("interactions") for one in pairs[-1]))
    print("| Loop in every step | YADE, ms | ours | YADE / ours |")
    print("|---|---|---|---|")
    for name in pairs[-1][0]:
        ratios = [yade[name] / ours[name] for yade, ours in pairs]
        times = [statistics.median(pair[k][name] for pair in pairs) for k in (0, 1)]
        print(f"| {name} | {times[0]:.2f} | {times[1]:.2f} | {statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f}) |", flush=True)


if "LOOPS" in os.environ:
    inside(os.environ["LOOPS"] == "1")
else:
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
