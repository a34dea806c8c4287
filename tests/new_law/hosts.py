#!/usr/bin/env python3
"""Runs the new laws of the copy TREE in every host and compares them with closed forms and with each other.

    hosts.py TREE FOLDER        FOLDER/site holds the Python package of the copy; results go to FOLDER
    hosts.py TREE FOLDER native     the results of YADE's native functors in FOLDER/native.json, against those of the first call
"""
import json
import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

from distributed import Program
from two_particles import EVERY, Adhesion, Hinge

HERE = Path(__file__).resolve().parent
# Rounding: 20,000 steps of the collision, 1,000 turns of a unit quaternion; both are some 1e-14 of what they are compared with.
ROUNDING = 1e-12
# A position of 2 mm rounds by up to 2.2e-19 m in each of 1,000 equal steps: 2.2e-16 m of an elongation of 5e-5 m.
PULLED = 5e-12

# Column of the time series that holds the energy of a motion.
STORED = {"pull": "stored_normal", "shear": "stored_shear", "bend": "stored_bending", "twist": "stored_twist"}


def program(folder, adhesion, hinge):
    """Scenarios by the program: the files of results."""
    concordem = os.environ["CONCORDEM"]
    scenarios = {"adhesion": Path(adhesion.path).read_text(), **{motion: hinge.scenario(motion) for motion in hinge.motions}}
    found = {}
    for name, text in scenarios.items():
        (folder / f"{name}.toml").write_text(text)
        for words in (["check", f"{name}.toml"], ["run", "--force", "--quiet", "-j", "2", "-o", f"{name}.h5", f"{name}.toml"]):
            subprocess.run([concordem, *words], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        done = subprocess.run([concordem, "info", "--hash", f"{name}.h5"], cwd=folder, check=True, capture_output=True, text=True)
        found[name] = dict(hash=done.stdout.strip())
        with h5py.File(folder / f"{name}.h5", "r", locking=False) as file:
            if name == "adhesion":
                steps, order = file["VTKHDF/Steps/step"][()], np.argsort(file["VTKHDF/PointData/id"][:2])
                assert steps.tolist() == list(range(0, adhesion.steps + 1, EVERY))
                points, offsets = file["VTKHDF/Points"][()], file["VTKHDF/Steps/PointOffsets"][()]
                found[name]["positions"] = [points[at : at + 2][order].tolist() for at in offsets]
            else:
                table = file["contacts/hinge"]
                found[name]["rows"] = [[*table["force"][0].tolist(), *table["moment"][0].tolist()]]
                assert file["samples/step"][-1] == hinge.steps
                found[name]["stored"] = float(file[f"samples/{STORED[name]}"][-1])
                assert "history_rest_direction" in table
    return found


def python(folder, adhesion):
    out = folder / "python.json"
    environment = {**os.environ, "PYTHONPATH": f"{folder / 'site'}{os.pathsep}{HERE}"}
    subprocess.run([sys.executable, HERE / "in_python.py", adhesion.path, out], env=environment, check=True)
    return json.loads(out.read_text())


def yade(folder, adhesion):
    out = folder / "yade.json"
    out.unlink(missing_ok=True)
    environment = {**os.environ, "PYTHONPATH": str(folder / "site"), "NEW_LAW_PULL": adhesion.path, "NEW_LAW_OUT": str(out)}
    done = subprocess.run(["yade", "-n", "-x", "-j1", HERE / "in_yade.py"], env=environment, cwd=folder, capture_output=True, text=True)
    assert out.exists(), f"YADE: {done.stdout[-2000:]}{done.stderr[-3000:]}"
    return json.loads(out.read_text())


class Verdicts:
    def __init__(self):
        self.failed = 0

    def at_most(self, what, found, limit, reason):
        good = found <= limit
        self.failed += not good
        print(f"{'ok  ' if good else 'FAIL'} {what:58} {found:9.2e} ≤ {limit:.2e}  {reason}")


def judge_closed_forms(verdicts, found, adhesion, hinge):
    for host, results in found.items():
        one = results["adhesion"]
        positions = np.array(one["positions"])
        assert positions.shape == (adhesion.steps // EVERY + 1, 2, 3), (host, positions.shape)
        apart = np.diff(positions[:, 1, 0] - positions[:, 0, 0]) / (EVERY * adhesion.dt)
        assert apart[0] < 0 < apart[-1] and (positions[-1, 1, 0] - positions[-1, 0, 0]) > 2 * adhesion.spheres[0][3] + adhesion.pull_off / adhesion.stiffness
        speed, tolerance = adhesion.parting_speed
        verdicts.at_most(f"{host}: speed after the pull-off", abs(apart[-1] / speed - 1), tolerance / speed, "a step of pull-off")
        if "tension" in one:
            low, high = adhesion.tension
            verdicts.at_most(f"{host}: pull-off force", abs(high - one["tension"]) / high if one["tension"] <= high else np.inf, (high - low) / high, "a step")
        for motion in hinge.motions:
            rows, rounding = np.array(results[motion]["rows"]), PULLED if motion == "pull" else ROUNDING
            steps = [hinge.steps] if len(rows) == 1 else range(EVERY, hinge.steps + 1, EVERY)
            wanted = [hinge.closed_form(motion, step) for step in steps]
            assert len(rows) == len(wanted), (host, motion, len(rows))
            force, moment = np.array([w[0] for w in wanted]), np.array([w[1] for w in wanted])
            # What is zero is measured by the moment of the force, or by the force of the moment, over the length.
            size = max(np.abs(force).max(), np.abs(moment).max() / hinge.length)
            different = max(np.abs(rows[:, :3] - force).max() / size, np.abs(rows[:, 3:] - moment).max() / (size * hinge.length))
            verdicts.at_most(f"{host}: hinge, {motion}", different, rounding, "rounding")
            if "stored" in results[motion]:
                verdicts.at_most(f"{host}: hinge, {motion}, stored energy", abs(results[motion]["stored"] / wanted[-1][2] - 1), 2 * rounding, "rounding")


def judge_hosts(verdicts, found, adhesion, hinge):
    """Bit for bit where the same code moves the particles: the solver, and `fix nve` of both distributed programs."""
    for name in ("adhesion", *hinge.motions):
        same = found["program"][name]["hash"] == found["python"][name]["hash"]
        verdicts.at_most(f"program and Python: {name}", float(not same), 0.0, "the same state, bit for bit")
    assert found["program"]["adhesion"]["positions"] == found["python"]["adhesion"]["positions"]
    for host in ("lammps", "lammps styles"):
        for name in ("adhesion", *hinge.motions):
            verdicts.at_most(f"liggghts and {host}: {name}", float(found["liggghts"][name] != found[host][name]), 0.0, "bit for bit")
    for host in ("yade", "liggghts"):
        judge_against_solver(verdicts, host, found[host], found["python"], hinge)


def judge_against_solver(verdicts, host, theirs, ours, hinge):
    x = np.array(ours["adhesion"]["positions"])
    different = np.abs(np.array(theirs["adhesion"]["positions"]) - x).max() / np.abs(x - x[0]).max()
    verdicts.at_most(f"{host} and the solver: adhesion, positions", different, ROUNDING, "rounding of another integrator")
    for motion in hinge.motions:
        # Moments over the length, as forces.
        one, two = (np.array(rows[motion]["rows"]) / [1, 1, 1, *[hinge.length] * 3] for rows in (theirs, ours))
        verdicts.at_most(f"{host} and the solver: hinge, {motion}", np.abs(one - two).max() / np.abs(two).max(), PULLED if motion == "pull" else ROUNDING, "rounding")


def native(folder, adhesion, hinge):
    found = {name: json.loads((folder / f"{name}.json").read_text()) for name in ("native", "python")}
    verdicts = Verdicts()
    judge_closed_forms(verdicts, {"native functors": found["native"]}, adhesion, hinge)
    judge_against_solver(verdicts, "native functors", found["native"], found["python"], hinge)
    return 1 if verdicts.failed else 0


def main(tree, folder, what=""):
    tree, folder = Path(tree).resolve(), Path(folder).resolve()
    adhesion, hinge = Adhesion(tree / "pull.toml"), Hinge()
    if what == "native":
        return native(folder, adhesion, hinge)
    found = {"program": program(folder, adhesion, hinge), "python": python(folder, adhesion), "yade": yade(folder, adhesion)}
    for name, host, route in (("liggghts", "liggghts", "fix"), ("lammps", "lammps", "fix"), ("lammps styles", "lammps", "style")):
        found[name] = Program(host, route, tree, folder / name.replace(" ", "-")).all(adhesion, hinge)
    verdicts = Verdicts()
    judge_closed_forms(verdicts, found, adhesion, hinge)
    judge_hosts(verdicts, found, adhesion, hinge)
    return 1 if verdicts.failed else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
