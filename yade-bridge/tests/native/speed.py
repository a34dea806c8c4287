"""Speeds of the native plugin beside YADE's own in the same run, whole steps of concrete in tension (24,000 spheres).

    yade -n -x -jN speed.py          (by run.sh speed)

Prints one JSON object: times by the wall clock and by the processor, best of rounds taken in turn so that foreign load hits all
alike; `share` is what each of YADE's engines costs beside the bonded engine. The law functor is set beside YADE's in one scene
whose law changes every few steps: scenes made anew lie otherwise in memory, which makes a tenth. Its ratio is the median of pairs.
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


def functor_beside_yades(rounds=12):
    """Milliseconds per step with YADE's law and with ours, and the median ratio of pairs."""
    concrete(rate=0.5, spheres=spheres, verlet=0.5e-3)
    run(3)
    loop = next(i for i, e in enumerate(O.engines) if isinstance(e, InteractionLoop))
    laws = {"yade": Law2_ScGeom_CpmPhys_Cpm, "functor": Law2_ScGeom_CpmPhys_Rust}
    times = {name: [] for name in laws}
    for k in range(rounds):
        for name in sorted(laws, reverse=k % 2):
            before = O.engines[loop]
            changed = InteractionLoop(before.geomDispatcher.functors, before.physDispatcher.functors, [laws[name]()])
            O.engines = O.engines[:loop] + [changed] + O.engines[loop + 1 :]
            run(3)
            times[name].append(timed(15)[0])
    ratio = np.median(np.array(times["yade"]) / times["functor"])
    return {
        "yade_ms": round(1e3 * np.median(times["yade"]), 3),
        "wall_ms": round(1e3 * np.median(times["functor"]), 3),
        "ratio_wall": round(ratio, 3),
    }


CASES = {
    "yade": None,
    "engine": {},
    "engine_finite": dict(kinematics="finite", mode="thesis"),
}
found = {"threads": O.numThreads, "particles": len(spheres), "functor": functor_beside_yades()}
times = {name: [] for name in CASES}
for _ in range(2):
    for name, engine in CASES.items():
        concrete(rate=0.5, spheres=spheres, verlet=0.5e-3)
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
