"""Speed of the bonded engine beside YADE in small scenes that break: the wall of examples/wall_impact.py, with smaller spheres too.

    python3 small_scenes.py [ROUNDS]     with the package in PYTHONPATH; one line of a table per scene

YADE and the engine take turns, each in a process of its own, so that other programs slow both. The times are those of the processor,
per step, without the start of the programs. The ratio is the median of the pairs; in brackets the smallest and the largest.
"""

import json
import os
import re
import statistics
import subprocess
import sys
import time

#: Radii of the wall's spheres, m.
RADII = (0.01, 0.0072, 0.0065)
EXAMPLE = "../../examples/wall_impact.py"


def inside():
    """One run, inside YADE: microseconds per step in each third of it."""
    wanted = json.loads(os.environ["SMALL_SCENE"])
    with open(wanted["example"]) as file:
        text, count = re.subn(r"radius, speed, steps = \S+,", f"radius, speed, steps = {wanted['radius']},", file.read())
    assert count == 1, "the example begins with its radius"
    before, taken, _ = text.partition("engine = concordem.yade.take_over(motion=True)")
    assert taken, "the example takes its bonds over"
    exec(compile(before + (taken if wanted["ours"] else ""), wanted["example"], "exec"), globals())
    thirds = []
    for _ in range(3):
        began = time.process_time()
        O.run(steps // 3, True)
        thirds.append((time.process_time() - began) / (steps // 3) * 1e6)
    bonds = engine.bond_count if wanted["ours"] else sum(1 for i in O.interactions if getattr(i.phys, "isCohesive", False))
    print("RESULT " + json.dumps({"thirds": thirds, "spheres": len(wall), "bonds": bonds}), flush=True)


def run(radius, ours):
    """The result of one run in a process of its own."""
    wanted = {"radius": radius, "ours": ours, "example": os.path.join(os.path.dirname(os.path.abspath(__file__)), EXAMPLE)}
    environment = {**os.environ, "SMALL_SCENE": json.dumps(wanted)}
    done = subprocess.run(["yade", "-n", "-x", "-j1", os.path.abspath(__file__)], env=environment, capture_output=True, text=True, check=False)
    found = re.search(r"^RESULT (.*)$", done.stdout, re.M)
    if found is None:
        sys.exit(f"no result:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return json.loads(found[1])


def main(rounds):
    """Print the table."""
    print("| Spheres | Bonds at the end, YADE / ours | YADE, µs per step | ours | YADE / ours | in each third |")
    print("|---|---|---|---|---|---|")
    for radius in RADII:
        pairs = []
        for k in range(rounds):
            both = {ours: run(radius, ours) for ours in ((False, True) if k % 2 else (True, False))}
            pairs.append((both[False], both[True]))
        mean = [[statistics.mean(one["thirds"]) for one in pair] for pair in pairs]
        ratios = [yade / ours for yade, ours in mean]
        thirds = [statistics.median(pair[0]["thirds"][k] / pair[1]["thirds"][k] for pair in pairs) for k in range(3)]
        times = [statistics.median(pair[k] for pair in mean) for k in (0, 1)]
        last = pairs[-1]
        print(
            f"| {last[0]['spheres']:,} | {last[0]['bonds']:,} / {last[1]['bonds']:,} | {times[0]:.0f} | {times[1]:.0f} "
            f"| {statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f}) | {', '.join(f'{x:.2f}' for x in thirds)} |",
            flush=True,
        )


if "SMALL_SCENE" in os.environ:
    inside()
else:
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
