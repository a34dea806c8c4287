"""Processor time (ms) of loops over interactions in stock YADE and beside a bonded engine, once per step: `yade -n -x -j1 loops.py`."""

import os
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from specimen import *

import concordem.yade as bridge

LOOPS = {
    "all": lambda: sum(1 for i in O.interactions),
    "one attribute": lambda: sum(i.phys.omega for i in O.interactions),
    "two attributes of real ones": lambda: [(i.id1, i.phys.normalForce) for i in O.interactions if i.isReal],
    "countReal()": lambda: O.interactions.countReal(),
    "b.intrs() of all bodies": lambda: sum(len(b.intrs()) for b in O.bodies),
}


def cost(loop, rounds=31):
    """Median of some steps."""
    times = []
    for _ in range(rounds):
        O.step()
        began = time.process_time()
        loop()
        times.append(time.process_time() - began)
    return 1e3 * sorted(times)[rounds // 2]


found = []
for take in (lambda: None, bridge.take_over):
    concrete(rate=20.0)
    O.run(100, True)
    take()
    O.run(2, True)
    found.append([cost(loop) for loop in LOOPS.values()])
print("interactions:", len(O.interactions))
for name, stock, ours in zip(LOOPS, *found):
    print(f"RESULT {name}: stock {stock:.2f}, bonded engine {ours:.2f}")
