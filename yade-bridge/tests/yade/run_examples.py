"""Runs the examples of the bridge (yade-bridge/examples) in stock YADE, as a user would, and checks the numbers that they print.

    python3 run_examples.py [FOLDER]     FOLDER: that of the examples, if they are elsewhere
"""

import os
import re
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
EXAMPLES = sys.argv[1] if len(sys.argv) > 1 else os.path.join(HERE, "../../examples")
#: Ranges of the printed numbers, wide enough for other versions of YADE: a stiffness between those of the material's extremes, a strength
#: near the cohesion, forces, and how much breaks.
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
    # f_c (MPa), cracks in tension, in shear, in the file, whole bonds
    "rock_compression": [(30, 300), (500, 3000), (20, 1500), (500, 4000), (50, 2500)],
}
#: One example on two threads, too.
THREADED = "notched_beam"
#: What the numbers of an example must have in common.
RELATIONS = {
    # The roller hits the beam (0.3 m/s; the first bending mode takes 0.35 ms, the run 2.4 ms), so peaks do not balance: the beam's inertia and
    # damping take a part of the load. Measured 0.6.
    "notched_beam": {"the supports get a large part of the load": lambda load, reaction, broken: 0.4 * load < reaction < 0.9 * load},
    # Of the same run.
    "rock_compression": {"the file has each crack": lambda strength, tension, shear, lines, whole: lines == tension + shear},
    "uniaxial": {"most bonds hold": lambda stiffness, strength, broken, bonds: broken < 0.2 * bonds},
    "wall_impact": {"nearly all bonds break": lambda broken, bonds, before, after: 0.7 * bonds < broken <= bonds},
    "pulled_apart": {
        "what has not broken comes back as interactions": lambda force, broken, bonds, interactions: 0.95 * (bonds - broken) < interactions < bonds
    },
}


def run(name, folder, threads):
    """The numbers after RESULT."""
    script = os.path.join(EXAMPLES, name + ".py")
    done = subprocess.run(
        ["yade", "-n", "-x", f"-j{threads}", script], cwd=folder, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=300, check=False
    )
    result = [line for line in done.stdout.splitlines() if line.startswith("RESULT")]
    assert len(result) == 1, done.stdout[-2000:] + done.stderr[-2000:]
    print(name, f"-j{threads}", result[0])
    return [float(number) for number in re.findall(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?", result[0])]


failed = 0
with tempfile.TemporaryDirectory() as folder:
    for name, threads in [(name, 1) for name in RANGES] + [(THREADED, 2)]:
        started = time.perf_counter()
        try:
            found, ranges = run(name, folder, threads), RANGES[name]
            assert len(found) == len(ranges) and all(low <= x <= high for x, (low, high) in zip(found, ranges)), (found, ranges)
            for text, holds in RELATIONS.get(name, {}).items():
                assert holds(*found), (text, found)
            print(f"ok {name} -j{threads} {time.perf_counter() - started:.1f} s")
        except (AssertionError, subprocess.SubprocessError) as error:
            failed += 1
            print(f"FAILED {name} -j{threads}: {error}", file=sys.stderr)
sys.exit(1 if failed else 0)
