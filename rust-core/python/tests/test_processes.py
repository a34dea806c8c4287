"""Threads and processes: forked children compute, one thread stays one thread, and work that would not end is refused."""

import os
import subprocess
import sys
import textwrap

import concordem
import numpy as np
import pytest
from concordem import operators

BEGIN = """
    import multiprocessing, os, sys
    import concordem
    import numpy as np
    from concordem import operators

    scenario = concordem.Scenario.template("hertz-impact")

    def threads():
        return len(os.listdir("/proc/self/task"))
"""


def run(script, *arguments):
    """Run a script in a process of its own, which has started no threads."""
    text = textwrap.dedent(BEGIN) + textwrap.dedent(script)
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    found = subprocess.run([sys.executable, "-c", text, *arguments], capture_output=True, text=True, timeout=60, env=environment)
    assert found.returncode == 0, found.stderr
    return found.stdout.split()


@pytest.mark.parametrize("parent", ["nothing", "built", "all"])
def test_a_forked_child_computes(parent):
    """After whatever the parent has computed, a child has its bits: in simulations of its own and of the parent, and in operators."""
    script = """
        parent = sys.argv[1]

        def job(threads):
            simulation = scenario.simulation(threads=threads)
            simulation.step(5)
            x = np.array([[0.0, 0, 0], [2, 0, 0]])
            volume = operators.solid_fraction(x, [1.0, 1.0], operators.Region.all(4.0))
            more = ""
            if parent != "nothing":
                mine.step(5)
                more = mine.state_hash()
            return f"{simulation.state_hash()}{volume}{more}"

        if parent == "built":
            mine = scenario.simulation(threads=2)
        elif parent == "all":
            mine = scenario.simulation()
            mine.step(3)
            mine.restore(mine.snapshot())
        with multiprocessing.get_context("fork").Pool(2) as pool:
            found = [pool.map_async(job, [threads, threads]).get(timeout=40) for threads in (1, 2, None)]
        expected = job(1) if parent == "nothing" else None
        print(len({one for some in found for one in some} | ({expected} - {None})))
    """
    if parent == "nothing":
        assert run(script, parent) == ["1"]
        return
    # The parent's simulation goes on in each child: the states of the second job of a child differ from those of the first.
    assert int(run(script.replace("mine.step(5)", "pass"), parent)[0]) == 1
    run(script, parent)


def test_one_thread_starts_no_other():
    script = """
        before = threads()
        simulation = scenario.simulation(threads=1)
        simulation.step(20)
        simulation.restore(simulation.snapshot())
        simulation.step(2)
        simulation.forces(), simulation.bonds(), simulation.state_hash(), simulation.save(sys.argv[1])
        again = concordem.Simulation.load(sys.argv[1], threads=1)
        again.step(2)
        import time
        # The worker that builds a simulation ends with it.
        for _ in range(50):
            if threads() == before:
                break
            time.sleep(0.05)
        print(threads() - before)
    """
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        assert run(script, os.path.join(folder, "state.h5")) == ["0"]


def test_indices_that_do_not_fit_are_refused():
    position = np.array([[0.0, 0, 0], [2, 0, 0]])

    def stress(j):
        contacts = operators.Contacts(pair=np.array([[0, j]]), branch=[[2.0, 0, 0]], point=[[1.0, 0, 0]], force=[[-3.0, 0, 0]])
        return operators.region_stress(position, contacts, operators.Region.all(4.0)).stress[0, 0]

    assert stress(1) == -1.5
    with pytest.raises(concordem.OperatorError, match="names the particle 2"):
        stress(2)
    for j in (2**32 + 1, 2**32, 2**40):
        with pytest.raises(ValueError, match=f"{j} is out of range: the numbers of this array are of type uint32"):
            stress(j)
    with pytest.raises(ValueError, match="the smallest index is -1; indices start at 0"):
        stress(-1)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", ["branch", "point", "force", "moment"])
def test_contacts_that_are_not_finite_are_refused(name, value):
    """A region does not contain a point that is no number: its stress would be 0."""
    columns = {"pair": [[0, 1]], "branch": [[1.0, 0, 0]], "point": [[0.5, 0, 0]], "force": [[1.0, 0, 0]], "moment": [[0.0, 0, 0]]}
    columns[name] = [[value, 0, 0]]
    position, region = np.array([[0.0, 0, 0], [1, 0, 0]]), operators.Region.sphere([0, 0, 0], 1.5)
    period = operators.Period(np.diag([3.0, 3, 3]))
    for call in (
        lambda contacts: operators.region_stress(position, contacts, region, period=period),
        lambda contacts: operators.fabric(position, contacts, region),
        lambda contacts: operators.coarse_grain(position, contacts, [1.0, 1.0], np.zeros((2, 3)), 1.0, np.zeros((1, 3)), period=period),
    ):
        with pytest.raises(concordem.OperatorError, match=f"entry 0 of `{name}` is not a finite number"):
            call(operators.Contacts(**columns))


def test_work_without_end_is_refused():
    position = np.array([[0.0, 0, 0], [1, 0, 0]])
    contacts = operators.Contacts(pair=[[0, 1]], branch=[[1.0, 0, 0]], point=[[0.5, 0, 0]], force=[[1.0, 0, 0]])
    period = operators.Period(np.diag([3.0, 3, 3]))
    with pytest.raises(concordem.OperatorError, match="images of the periodic cell, and at most 1000 are allowed"):
        operators.region_stress(position, contacts, operators.Region.sphere([0, 0, 0], 1e4), period=period)
    points = np.array([[-2.0, 0, -1], [-0.0, -0.0, 0.0], [0, 1, 2], [0, -1, 1], [0.0, 0.0, -0.0], [1, -2, 1], [-2, -1, 0]])
    with pytest.raises(concordem.OperatorError, match="the points 1 and 4 are at the same place"):
        operators.delaunay(points)
