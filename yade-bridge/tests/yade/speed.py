"""Speed of operators, hand-over, and bonded engine, compared with YADE in the same run.

    yade -n -x -jN speed.py [steps]

Prints one JSON object, times by the wall clock and by the processor (of all threads of the process: with one thread it says
what the work costs even if others use the machine, but for caches and memory they share). A specimen of concrete of 24,000 spheres in tension; whole steps, timed over at least `steps`
steps after a warm-up, best of two, taken in turn so that foreign load hits all alike. `share` is the part of the step
that YADE itself costs in the bonded engine (all engines but ours).
"""

import json
import os
import sys
import time

import numpy as np

# YADE runs scripts under its own __file__.
sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from specimen import *
from yade import utils

import concordem
import concordem.yade as bridge
from concordem.yade import _lending

steps = int(os.environ.get("SPEED_STEPS", "60"))
unit = concordem.packing.random_dense(2000, 1.2e-3, dispersion=0.2, seed=1)
edges = unit.cell
offsets = np.array([[i, j, k] for i in range(2) for j in range(2) for k in range(3)])
places = np.concatenate([unit.positions + offset @ edges.T for offset in offsets])
spheres = np.column_stack([places, np.tile(unit.radii, len(offsets))]).tolist()


def timed(work, count):
    """Wall time and CPU time per step, s."""
    start = time.perf_counter(), time.process_time()
    work(count)
    return (time.perf_counter() - start[0]) / count, (time.process_time() - start[1]) / count


def best(values):
    """Smallest wall time and smallest CPU time, s."""
    return min(v[0] for v in values), min(v[1] for v in values)


def run(count):
    """Single steps of YADE's loop, because O.run waits by polling."""
    for _ in range(count):
        O.step()


def prepared():
    """The specimen after its first steps."""
    concrete(rate=0.5, spheres=spheres, verlet=0.5e-3)
    run(3)


found = {"threads": O.numThreads, "particles": len(spheres)}
prepared()
real = len(bridge.snapshot().contacts.pair)
found["bonds"] = real

# Operators compared with a Python loop over the interactions, the alternative in a script.
stress = np.zeros((3, 3))


def python_loop(count):
    for i in O.interactions:
        branch = np.array(O.bodies[i.id2].state.pos - O.bodies[i.id1].state.pos)
        stress[:] += np.outer(branch, np.array(-(i.phys.normalForce + i.phys.shearForce)))


loop = timed(python_loop, 1)
bulk = best([timed(lambda n: bridge.snapshot().region_stress(volume=1.0), 1) for _ in range(5)])
ours = bridge.snapshot().region_stress(volume=1.0).stress
assert abs(ours - stress).max() < 1e-9 * abs(stress).max()
found["operator"] = {"python_loop_s": loop, "ours_s": bulk, "ratio": [loop[0] / bulk[0], loop[1] / bulk[1]]}

times = {"yade": [], "advance": [], "engine": [], "engine_finite": [], "advance_finite": []}
for _ in range(2):
    prepared()
    times["yade"].append(timed(run, steps))
    times["advance"].append(timed(lambda n: bridge.advance(n), 12 * steps))
    times["advance_finite"].append(timed(lambda n: bridge.advance(n, kinematics="finite", mode="thesis"), 12 * steps))
    for name, options in (("engine", {}), ("engine_finite", dict(kinematics="finite", mode="thesis"))):
        prepared()
        engine = bridge.take_over(**options)
        run(3)
        times[name].append(timed(run, 2 * steps))
        if name == "engine_finite":
            O.timingEnabled = True
            for e in _lending.raw_engines():
                e.execTime = 0
            run(steps)
            spent = {type(e).__name__: e.execTime for e in _lending.raw_engines()}
            O.timingEnabled = False
            total = sum(spent.values())
            found["share"] = {k: round(v / total, 3) for k, v in spent.items()}
        engine.remove()
reference = best(times["yade"])
for name, values in times.items():
    wall, processor = best(values)
    found[name] = {
        "wall_ms": 1e3 * wall,
        "processor_ms": 1e3 * processor,
        "ratio_wall": reference[0] / wall,
        "ratio_processor": reference[1] / processor,
    }
print("RESULT " + json.dumps(found))
