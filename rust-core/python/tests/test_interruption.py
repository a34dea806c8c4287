"""Work in Rust that takes long answers signals: every kind of loop that can run for more than a second."""

import _thread
import os
import signal
import threading
import time

import concordem
import numpy as np
import pytest
from concordem import coupling
from concordem import operators as op

pytestmark = pytest.mark.once

rng = np.random.default_rng(1)


def points(count):
    return rng.uniform(0.0, 1.0, (count, 3))


def contacts(x, count):
    pair = np.sort(rng.choice(len(x), (count, 2)), axis=0).astype(np.uint32)
    pair[:, 1] = (pair[:, 0] + 1) % len(x)
    branch = np.full((count, 3), 0.01)
    return op.Contacts(pair=pair, branch=branch, point=x[pair[:, 0]], force=np.ones((count, 3)))


PERIOD = op.Period(np.eye(3))
# Over nine cells along each edge.
WIDE = op.Region.box([-4.0] * 3, [4.9] * 3)
PRISM = {
    "packing": {"kind": "random-dense", "count": 60, "radius": "1 mm", "seed": 1, "shape": {"kind": "periodic"}},
    "material": {"name": "m", "density": 2000, "linear_bond": {"normal_stiffness": 1e7, "shear_stiffness": 2e6}},
    "bonds": {"law": "linear_bond", "coordination": 8},
    "contacts": {"law": "none"},
    "stop": {"steps": 10**9},
}


def coarse_grain():
    x = points(3000)
    table, at = contacts(x, 20_000), points(200_000)
    return lambda: op.coarse_grain(x, table, np.ones(3000), np.zeros((3000, 3)), 0.1, at)


def region_stress():
    x = points(50_000)
    table = contacts(x, 1_000_000)
    return lambda: op.region_stress(x, table, WIDE, period=PERIOD)


def fabric():
    x = points(50_000)
    table = contacts(x, 1_000_000)
    return lambda: op.fabric(x, table, WIDE, period=PERIOD)


def affine_fit():
    x = points(1_000_000)
    return lambda: op.affine_fit(x, x, WIDE, period=PERIOD)


def solid_fraction():
    x = points(1_000_000)
    return lambda: op.solid_fraction(x, np.ones(len(x)), WIDE, period=PERIOD)


def delaunay():
    x = points(1_000_000)
    return lambda: op.delaunay(x)


def power_diagram():
    x = points(200_000)
    return lambda: op.power_diagram(x, np.zeros(len(x)), low=[-0.1] * 3, high=[1.1] * 3)


def neighbors():
    x = points(100_000)
    return lambda: concordem.packing.summary(x, np.full(len(x), 0.005), interaction_ratio=12.0)


def structure():
    n = 60
    x = 2e-3 * np.stack(np.meshgrid(*3 * [np.arange(n)], indexing="ij"), -1).reshape(-1, 3)
    packing = concordem.packing.Packing(x + 0.0, np.full(len(x), 1e-3), None)
    return lambda: concordem.packing.characterise(packing)


def damage_plastic():
    law = coupling.DamagePlastic(30e9, 0.2, 30e6, 3e6, 200.0)
    strain = 1e-3 * rng.uniform(-1, 1, (300_000, 3, 3))
    strain += strain.transpose(0, 2, 1)
    state = np.zeros((len(strain), 8))
    return lambda: law.update(strain, state, 0.01, True)


def cells():
    cells = coupling.RepresentativeCells(concordem.Scenario(**PRISM), 2)
    gradient = np.tile(np.eye(3) * 1.000001, (2, 1, 1))
    return lambda: cells.deform(gradient, 2_000_000)


LATTICE = {"kind": "lattice", "lattice": "fcc", "radius": "1 mm", "shape": {"kind": "periodic"}}
TOUCHING = {"law": "linear_bond", "interaction_ratio": 1.01}


def block(side):
    return concordem.Scenario(**(PRISM | {"packing": LATTICE | {"repeats": [side] * 3}, "bonds": TOUCHING, "stop": {"steps": 10}}))


def elastic():
    scenario = block(40)
    return lambda: concordem.elastic_constants(scenario, dynamics=True)


SPECIMEN = PRISM | {"packing": {"kind": "random-dense", "count": 100_000, "radius": "1 mm", "seed": 1, "shape": {"kind": "box", "size": ["60 mm"] * 3}}}


def pack():
    scenario = concordem.Scenario(**SPECIMEN)
    return lambda: scenario.pack(threads=1)


def check():
    scenario = concordem.Scenario(**SPECIMEN)
    return lambda: concordem.check(scenario, threads=1)


def random_dense():
    return lambda: concordem.packing.random_dense(200_000, 1.0, threads=1)


def calibrate_elastic():
    scenario = block(40)
    return lambda: concordem.calibrate_elastic(scenario, 30e9, 0.2, threads=1)


def calibrate_cohesive_beam():
    return lambda: concordem.calibrate_cohesive_beam(30e9, 0.2, 2400.0, tensile_strength=3e6, count=200_000, threads=1)


WORK = [coarse_grain, region_stress, fabric, affine_fit, solid_fraction, delaunay, power_diagram, neighbors, structure, damage_plastic,
        cells, elastic, pack, check, random_dense, calibrate_elastic, calibrate_cohesive_beam]


@pytest.mark.parametrize("work", WORK, ids=lambda work: work.__name__)
def test_long_work_answers_ctrl_c(work):
    interrupt(work())


def test_loading_answers_ctrl_c(tmp_path):
    block(24).simulation(threads=1).save(tmp_path / "state.h5")
    interrupt(lambda: concordem.Simulation.load(tmp_path / "state.h5", threads=1))


def interrupt(call):
    """Ctrl-C after 0.3 s ends the call."""
    start, used = time.monotonic(), time.process_time()
    timer = threading.Timer(0.3, _thread.interrupt_main)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            call()
    finally:
        timer.join()
    # Time of processors: that of the clock depends on what else the machine does.
    assert time.monotonic() - start >= 0.3 and time.process_time() - used < 3.0


def test_ctrl_c_during_a_call_that_fails_is_not_lost():
    """Too many bonds for the time step, found after the key was pressed: the error does not hide the key."""
    simulation = block(20).simulation(threads=1)
    with pytest.raises(concordem.SolverError, match="stability bound"):
        simulation.make_bonds(1.9)
    timer = threading.Timer(0.2, _thread.interrupt_main)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        simulation.make_bonds(1.9)
    timer.join()


def test_handlers_of_other_signals_are_called_meanwhile():
    class Ended(Exception):
        pass

    def end(*_):
        raise Ended

    before = signal.signal(signal.SIGTERM, end)
    call = coarse_grain()
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGTERM))
    timer.start()
    start = time.monotonic()
    try:
        with pytest.raises(Ended):
            call()
    finally:
        timer.join()
        signal.signal(signal.SIGTERM, before)
    assert time.monotonic() - start < 3.0


def test_interrupted_cells_go_on_from_a_state():
    """Interrupted between two steps, cells are sound: they go back to a state, and on from there to the same bits."""
    gradient = np.tile(np.eye(3), (2, 1, 1))
    gradient[:, 0, 0] += 1e-4
    interrupted, whole = (coupling.RepresentativeCells(concordem.Scenario(**PRISM), 2) for _ in range(2))
    state = interrupted.save()
    timer = threading.Timer(0.3, _thread.interrupt_main)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        interrupted.deform(gradient, 2_000_000)
    timer.join()
    reached = interrupted.deformation_gradient[:, 0, 0] - 1.0
    assert ((reached > 0.0) & (reached < 1e-4)).all()
    interrupted.restore(state)
    for one in (interrupted, whole):
        one.deform(gradient, 50)
    assert interrupted.state_hashes() == whole.state_hashes()


def test_another_thread_works_on_while_the_main_thread_is_interrupted():
    x = points(20_000)
    table = contacts(x, 100_000)
    wanted = op.region_stress(x, table, WIDE, period=PERIOD).stress
    found = []
    thread = threading.Thread(target=lambda: found.append(op.region_stress(x, table, WIDE, period=PERIOD).stress))
    call = coarse_grain()
    timer = threading.Timer(0.3, _thread.interrupt_main)
    thread.start()
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        call()
    thread.join()
    timer.join()
    assert (found[0] == wanted).all()
