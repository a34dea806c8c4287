"""Random scripts that meddle with bonds in mid-run, in stock YADE and beside a bonded engine: what test_random_scripts.py and random_histories.py share.

CONCORDEM_SCRIPTS sets how many, CONCORDEM_SEED the number of the first one. A script that fails prints its number, with which it runs alone.
"""

import collections
import math
import os
import random

from yade import O
from yade.minieigenHP import Vector3

from concordem import YadeError

FIRST = int(os.environ.get("CONCORDEM_SEED", "1"))


def how_many(usual):
    """Number of scripts of this run."""
    return int(os.environ.get("CONCORDEM_SCRIPTS", usual))


def actions(chance, followed, may_be_refused):
    """Two to six actions, ordered by their steps: step, function, seed."""
    kinds = [may_be_refused if chance.random() < 0.12 else followed for _ in range(chance.randrange(2, 7))]
    found = [(chance.randrange(1, 90), chance.choice(kind), chance.randrange(1 << 30)) for kind in kinds]
    return sorted(found, key=lambda action: action[0])


def ahead(goal, single=False):
    """Run until this iteration. (O.run(0) would run forever.)"""
    if single:
        while O.iter < goal:
            O.step()
    elif O.iter < goal:
        O.run(goal - O.iter, True)


def nudge():
    """Change one bit of a coordinate."""
    state = O.bodies[37].state
    state.pos = Vector3(math.nextafter(state.pos[0], 1.0), state.pos[1], state.pos[2])


class Refused(Exception):
    """A script was refused, with what it had done before."""

    def __init__(self, error, taken):
        super().__init__(str(error))
        self.taken = taken


def taken_actions(case, one, ours):
    """Take the actions of a case, `one(step, function, seed)` each; returns their names."""
    start, taken = O.iter, []
    try:
        if ours:
            import concordem.yade

            concordem.yade.take_over(motion=case["motion"])
        for step, function, seed in case["actions"]:
            one(start + step, function, random.Random(seed))
            taken.append(function.__name__)
        ahead(start + 100)
    except YadeError as error:
        assert ours
        raise Refused(error, taken) from error
    return taken


def compare(script, run, may_be_refused, count, tolerance):
    """Each script in both; `run(case, ours, nudged=False)` gives displacements, what must be equal, and the names of the actions. A displacement may
    differ by `tolerance` of the largest one, and beyond it by a hundred times what one bit of a coordinate makes in stock YADE. Returns how often each
    action was followed, how often each was refused, and how many scripts were so sensitive that they say nothing else."""
    followed, refused, worst, sensitive = collections.Counter(), collections.Counter(), 0.0, 0
    may = {action.__name__ for action in may_be_refused}
    for number in range(FIRST, FIRST + count):
        case = script(number)
        try:
            try:
                found, ours, taken = run(case, ours=True)
            except Refused as error:
                blamed = [function.__name__ for _, function, _ in case["actions"][: len(error.taken) + 1] if function.__name__ in may]
                assert (blamed or case["motion"]) and "\n" not in str(error) and len(str(error)) > 40, str(error)
                refused[blamed[-1] if blamed else "motion"] += 1
                continue
            wanted, stock, _ = run(case, ours=False)
            scale = abs(wanted).max()
            difference = abs(wanted - found).max() / scale
            if difference > tolerance:
                bit = abs(wanted - run(case, ours=False, nudged=True)[0]).max() / scale
                print(f"script {number}: {difference:.1e}, one bit in stock YADE makes {bit:.1e}")
                sensitive += 1
                assert difference < 100 * bit, f"displacements differ by {difference:.1e}"
                continue
            for name in stock:
                assert stock[name] == ours[name], f"{name} differ: {stock[name]} {ours[name]}"[:500]
            worst = max(worst, difference)
            followed.update(taken)
        except Exception as error:
            raise AssertionError(f"script {number}: {case}: {type(error).__name__}: {error}") from error
    print("followed", dict(followed))
    print("refused", dict(refused))
    print("largest difference: %.1e" % worst)
    return followed, refused, sensitive
