"""Speeds of the native plugin beside YADE's own in the same run, whole steps of concrete in tension (24,000 spheres).

    yade -n -x -jN speed.py          (by run.sh speed)

Prints one JSON object: times by the wall clock and by the processor, best of rounds taken in turn so that foreign load hits all
alike; `share` is what each of YADE's engines costs beside the bonded engine.
"""

import json
import os
import sys
import time

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from specimen import *

import concordem
import concordem.yade as bridge

bridge.load_native()
steps = int(os.environ.get("SPEED_STEPS", "30"))
unit = concordem.packing.random_dense(2000, 1.2e-3, dispersion=0.2, seed=1)
offsets = np.array([[i, j, k] for i in range(2) for j in range(2) for k in range(3)])
places = np.concatenate([unit.positions + offset @ unit.cell.T for offset in offsets])
spheres = np.column_stack([places, np.tile(unit.radii, len(offsets))]).tolist()


def run(count):
    for _ in range(count):
        O.step()


def timed(count):
    start = time.perf_counter(), time.process_time()
    run(count)
    return (time.perf_counter() - start[0]) / count, (time.process_time() - start[1]) / count


def with_engine(**options):
    O.engines = O.engines[:3] + [BondedEngine_Rust(**options)] + O.engines[3:]
    run(1)


STOCK_LAW = STOCK
RUST_LAW = (STOCK[0], "Law2_ScGeom_CpmPhys_Rust")
CASES = {
    "yade": (STOCK_LAW, None),
    "functor": (RUST_LAW, None),
    "engine": (STOCK_LAW, {}),
    "engine_finite": (STOCK_LAW, dict(kinematics="finite", mode="thesis")),
}
found = {"threads": O.numThreads, "particles": len(spheres)}
times = {name: [] for name in CASES}
for _ in range(2):
    for name, (functors, engine) in CASES.items():
        concrete(rate=0.5, spheres=spheres, verlet=0.5e-3, functors=functors)
        run(2)
        found.setdefault("bonds", sum(i.isReal for i in O.interactions))
        if engine is not None:
            with_engine(**engine)
        run(2)
        times[name].append(timed(steps if engine is None else 2 * steps))
        if name == "engine_finite":
            O.timingEnabled = True
            for e in O.engines:
                e.execTime = 0
            run(steps)
            spent = {type(e).__name__: e.execTime for e in O.engines}
            O.timingEnabled = False
            found["share"] = {k: round(v / sum(spent.values()), 3) for k, v in spent.items()}
best = {name: [min(v[k] for v in values) for k in (0, 1)] for name, values in times.items()}
for name, (wall, processor) in best.items():
    found[name] = {
        "wall_ms": round(1e3 * wall, 3),
        "processor_ms": round(1e3 * processor, 3),
        "ratio_wall": round(best["yade"][0] / wall, 3),
        "ratio_processor": round(best["yade"][1] / processor, 3),
    }
print("RESULT " + json.dumps(found))
