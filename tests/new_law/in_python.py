"""The new laws from Python: `in_python.py PULL.TOML OUT.JSON`."""
import json
import sys

import concordem
from two_particles import EVERY, Adhesion, Hinge


def by_id(simulation, values):
    order = simulation.state.ids.argsort()
    return values[order].tolist()


def adhesion(case):
    simulation = concordem.Scenario.from_file(case.path).simulation(threads=1)
    tension, positions = 0.0, [by_id(simulation, simulation.state.positions)]
    for step in range(1, case.steps + 1):
        simulation.step(1)
        tension = max(tension, by_id(simulation, simulation.net_forces()[0])[0][0])
        if step % EVERY == 0:
            positions.append(by_id(simulation, simulation.state.positions))
    return dict(tension=tension, positions=positions, hash=simulation.state_hash())


def hinge(case, motion):
    simulation = concordem.Scenario.from_text(case.scenario(motion)).simulation(threads=1)
    rows = []
    for _ in range(case.steps // EVERY):
        simulation.step(EVERY)
        contacts = simulation.forces().contacts
        assert contacts.pair.tolist() == [[0, 1]] and simulation.state.ids.tolist() == [0, 1]
        rows.append(contacts.force[0].tolist() + contacts.moment[0].tolist())
    return dict(rows=rows, hash=simulation.state_hash())


pull, out = sys.argv[1:]
case = Hinge()
with open(out, "w") as file:
    json.dump({"adhesion": adhesion(Adhesion(pull)), **{motion: hinge(case, motion) for motion in case.motions}}, file)
