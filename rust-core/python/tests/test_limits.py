"""Too little memory, and a small stack, are exceptions or do not matter: the process does not end."""

import subprocess
import sys

import pytest

pytestmark = pytest.mark.once

# What remains of the address space is limited after the modules are there.
HEAD = """
import resource, threading
import numpy as np
import concordem
from concordem import coupling, packing
from concordem import operators as op

def limit(megabytes):
    size = int(next(line for line in open("/proc/self/status") if line.startswith("VmSize")).split()[1]) * 1024
    resource.setrlimit(resource.RLIMIT_AS, (size + megabytes * 10**6,) * 2)

def refused(call):
    try:
        call()
    except (MemoryError, concordem.ConcordemError, ValueError) as error:
        assert "GB" in str(error) or "memory" in str(error).lower() or isinstance(error, MemoryError), error
        print("refused:", error)
    else:
        raise SystemExit("not refused")

def scenario(**tables):
    return concordem.Scenario(**({
        "packing": {"kind": "lattice", "lattice": "fcc", "radius": "1 mm", "repeats": [2, 2, 2], "shape": {"kind": "periodic"}},
        "material": {"name": "m", "density": 2000, "linear_bond": {"normal_stiffness": 1e7, "shear_stiffness": 2e6}},
        "bonds": {"law": "linear_bond", "interaction_ratio": 1.01},
        "contacts": {"law": "none"},
        "stop": {"steps": 10},
    } | tables))

limit(400)
"""

CALLS = {
    "lattice": 'refused(lambda: packing.lattice("simple-cubic", 1.0, [400, 400, 400]))',
    "random": "refused(lambda: packing.random_dense(2_000_000, 1.0))",
    "scenario": """
large = {"kind": "lattice", "lattice": "fcc", "radius": "1 mm", "repeats": [100, 100, 100], "shape": {"kind": "periodic"}}
refused(lambda: scenario(packing=large).simulation(threads=1))
refused(lambda: scenario(packing=large).pack())
""",
    "bonds": """
block = {"kind": "lattice", "lattice": "fcc", "radius": "1 mm", "repeats": [20, 20, 20], "shape": {"kind": "periodic"}}
refused(lambda: scenario(packing=block, bonds={"law": "linear_bond", "interaction_ratio": 10.0}).simulation(threads=1))
""",
    "grid of regions": "refused(lambda: op.Region.grid([0, 0, 0], [1, 1, 1], [1000, 1000, 1000]))",
    "cells": "refused(lambda: coupling.RepresentativeCells(scenario(), 10**7, threads=1))",
    "neighbors": """
x = np.random.default_rng(1).uniform(0, 1, (20_000, 3))
refused(lambda: packing.summary(x, np.full(len(x), 0.01), interaction_ratio=50.0))
""",
    "points": "refused(lambda: coupling.DamagePlastic(30e9, 0.2, 30e6, 3e6, 200.0).update(np.zeros((10**6, 3, 3)), np.zeros((10**6, 8)), 0.01, True))",
}


def run(text):
    return subprocess.run([sys.executable, "-c", HEAD + text], capture_output=True, text=True, timeout=120)


@pytest.mark.parametrize("name", CALLS)
def test_too_little_memory_is_an_exception(name):
    given = run(CALLS[name])
    assert given.returncode == 0, f"{given.returncode}: {given.stdout}{given.stderr}"


def test_a_thread_with_a_small_stack():
    """Python itself needs some of the 64 kB that a thread may have; what is left suffices for work in Rust."""
    given = run("""
import copy, tempfile
threading.stack_size(65536)
failures = []
def work():
    try:
        x = np.random.default_rng(1).uniform(0, 1, (200, 3))
        op.delaunay(x)
        op.power_diagram(x, np.zeros(200), low=[-1] * 3, high=[2] * 3)
        run = scenario().simulation(threads=1)
        start = run.snapshot()
        with tempfile.TemporaryDirectory() as folder:
            run.save(folder + "/small.h5")
            copy.copy(run).run()
            run.run()
            run.restore(start)
            assert concordem.Simulation.load(folder + "/small.h5", threads=1).state_hash() == run.state_hash()
        run.change({"stop.steps": 20})
        run.run()
        concordem.elastic_constants(scenario(), threads=1)
    except BaseException as error:
        failures.append(error)
thread = threading.Thread(target=work)
thread.start()
thread.join()
assert not failures, failures
""")
    assert given.returncode == 0, f"{given.returncode}: {given.stdout}{given.stderr}"
