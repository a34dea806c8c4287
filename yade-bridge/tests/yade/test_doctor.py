"""What a script may expect, before it runs: concordem.yade.doctor() and `python3 -m concordem.yade check`."""
# threads: 1

import os
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))

from cohesive_scene import lattice
from specimen import *
from harness import main

import concordem.yade as bridge

SCRIPT = """from yade import pack
O.materials.append(CpmMat(young=1e9, poisson=.2, sigmaT=1e6, epsCrackOnset=1e-4, relDuctility=10, frictionAngle=.6, oldThing=3))
O.engines = [BexResetter(), GlobalStiffnessTimeStepper(timeStepUpdateInterval=10), PDFEngine(),
             PyRunner(command="O.bodies.clump([1, 2])", iterPeriod=1, label="runner")]
for i in O.interactions:
    i.phys.E *= 2
runner.dead = not_a_name
strain = O.engines[5].strain
growParticles(1.1)
"""


def found(script):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "script.py")
        with open(path, "w") as file:
            file.write(script)
        O.reset()
        return [(f.line, f.verdict, f.what) for f in bridge.doctor(path, quiet=True)]


def test_a_script_is_read():
    assert found(SCRIPT) == [
        (2, "unknown", "CpmMat(oldThing=…)"),
        (3, "unknown", "BexResetter"),
        (3, "followed", "GlobalStiffnessTimeStepper"),
        (3, "refused", "PDFEngine"),
        (4, "refused", "clump"),
        (5, "followed", "interactions"),
        (7, "unknown", "not_a_name"),
        (9, "refused", "growParticles"),
    ]
    ((line, verdict, what),) = found('O.dt = 1\nprint "a"\n')
    assert (line, verdict, what) == (2, "unknown", 'print "a"')
    assert found("from yade import plot\nfor k in range(3):\n    plot.addData(k=k, dt=O.dt, stress=getStress(1.0))\n") == []


def test_a_scene_is_examined():
    """Nothing changes: take_over() works after it, or is refused for the reason that was told."""
    for good in (True, False):
        concrete(spheres=[(0, 0, k * 2e-3, 1e-3) for k in range(20)])
        O.run(3, True)
        if not good:
            O.engines = O.engines + [PDFEngine()]
        (finding,) = bridge.doctor(quiet=True, script="")
        assert finding.verdict == ("followed" if good else "refused") and finding.line == 0
        try:
            bridge.take_over()
            assert good and "20 spheres of concrete with 19 contacts" in finding.why, finding
        except bridge.YadeError as error:
            assert not good and str(error) == finding.why
    concrete(spheres=[(0, 0, k * 2e-3, 1e-3) for k in range(20)])
    O.run(3, True)
    next(iter(O.interactions)).phys.E *= 2
    (finding,) = bridge.doctor(quiet=True, script="")
    assert "1 with parameters of their own" in finding.why


def test_a_scene_of_cohesive_spheres_is_examined():
    for good in (True, False):
        lattice(counts=(2, 2, 3), rate=0.0)
        O.engines[2].lawDispatcher.functors[0].twist_creep = not good
        (finding,) = bridge.doctor(quiet=True, script="")
        try:
            bridge.take_over()
            assert good and finding.verdict == "followed" and "12 spheres of CohFrictMat with 20 contacts" in finding.why, finding
        except bridge.YadeError as error:
            assert not good and finding.verdict == "refused" and str(error) == finding.why


def test_the_command():
    with tempfile.TemporaryDirectory() as folder:
        for script, code, text in ((SCRIPT, 1, "6 of 8 remarks are refused or unknown"), ("O.dt = 1\n", 0, "0 of 0 remarks"), (None, 1, "there is no file")):
            path = os.path.join(folder, "script.py")
            if script is None:
                path = os.path.join(folder, "missing.py")
            else:
                with open(path, "w") as file:
                    file.write(script)
            done = subprocess.run(["/usr/bin/python3", "-m", "concordem.yade", "check", path], capture_output=True, text=True, timeout=120, check=False)
            assert done.returncode == code and text in done.stdout + done.stderr, (done.returncode, done.stdout, done.stderr)


main(globals())
