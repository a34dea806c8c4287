"""Runs the examples of the bridge (yade-bridge/examples) in stock YADE, as a user would, and checks the numbers that they print."""

import os
import re
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
#: Ranges of the printed numbers, wide enough for other versions of YADE: a stiffness between those of the material's extremes, a strength
#: near the cohesion, loads that balance, and how much breaks.
RANGES = {
    # E (GPa), f_t (MPa), broken, all
    "uniaxial": [(10, 60), (1, 8), (20, 5000), (2000, 9000)],
    # load, reaction (N), broken
    "notched_beam": [(100, 3000), (100, 3000), (5, 1000)],
    # broken, all, speed before and after (m/s)
    "wall_impact": [(100, 3000), (1000, 4000), (25, 25), (-10, 24)],
    # largest force (N), broken, all, interactions
    "pulled_apart": [(500, 10000), (50, 3000), (1000, 6000), (500, 6000)],
    # f_c (MPa), lateral over axial stress, broken
    "periodic_compression": [(5, 200), (0, 0.5), (0, 3000)],
}


def run(name, folder):
    """The numbers after RESULT."""
    script = os.path.join(HERE, "../../examples", name + ".py")
    done = subprocess.run(
        ["yade", "-n", "-x", "-j1", script], cwd=folder, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=300, check=False
    )
    result = [line for line in done.stdout.splitlines() if line.startswith("RESULT")]
    assert len(result) == 1, done.stdout[-2000:] + done.stderr[-2000:]
    print(name, result[0])
    return [float(number) for number in re.findall(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?", result[0])]


failed = 0
with tempfile.TemporaryDirectory() as folder:
    for name, ranges in RANGES.items():
        started = time.perf_counter()
        try:
            found = run(name, folder)
            assert len(found) == len(ranges) and all(low <= x <= high for x, (low, high) in zip(found, ranges)), (found, ranges)
            print(f"ok {name} {time.perf_counter() - started:.1f} s")
        except (AssertionError, subprocess.SubprocessError) as error:
            failed += 1
            print(f"FAILED {name}: {error}", file=sys.stderr)
sys.exit(1 if failed else 0)
