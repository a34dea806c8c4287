"""LIGGGHTS driven from Python, in separate processes, because it ends the process on errors."""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

LIBRARY = Path(__file__).parents[3] / os.environ.get("CARGO_TARGET_DIR", "target") / "liggghts/libconcordem-liggghts.so"

BEGIN = """
import sys
import tempfile
import numpy as np
from concordem.liggghts import Liggghts, LiggghtsError
host = Liggghts(library=sys.argv[1])
host.commands('''
units si
atom_style sphere
atom_modify map array sort 0 0
boundary f f f
newton off   # both atoms store a bond
communicate single vel yes
region box block -0.02 0.06 -0.02 0.06 -0.02 0.06 units box
create_box 1 box
lattice sc 0.0099
region block block 0 0.038 0 0.038 0 0.038 units box
create_atoms 1 region block
set group all diameter 0.01 density 2500
neighbor 0.001 bin
neigh_modify delay 0
timestep 1e-7
fix integrate all nve/sphere
fix bonds all concordem/bond cohesive_beam young 30e9 poisson 0.2 &
  radius_ratio 0.5 bond distance 1.2
''')
"""


def run(script, processes=1):
    mpi = ["mpirun", "--allow-run-as-root", "--oversubscribe", "--bind-to", "none", "-np", str(processes)] if processes > 1 else []
    # Open MPI 4 fails if two runs create or remove its common folder below /tmp at the same time.
    with tempfile.TemporaryDirectory() as folder:
        environment = dict(
            os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", OMPI_MCA_orte_tmpdir_base=folder)
        return subprocess.run(
            ["timeout", "120", *mpi, sys.executable, "-c", BEGIN + script, str(LIBRARY)],
            env=environment, capture_output=True, text=True, errors="replace")


def test_views_and_forces_of_bonds():
    """The forces in LIGGGHTS' arrays are the sums of the bond forces, and writing to a view moves atoms."""
    done = run("""
host.run(0)
assert len(host) == host.owned == 64 and host.fix("bonds") == 144
host.velocities[:] = np.random.default_rng(1).normal(size=(64, 3)) * 0.1
before = host.positions.copy()
host.run(50)
assert np.abs(host.positions - before).max() > 1e-8
assert np.all(host.radii == 0.005) and host.types.tolist() == [1] * 64
rows = host.bonds("bonds")
assert len(rows) == 144 and np.all(rows["bonded"] == 1)
order = {i: k for k, i in enumerate(host.ids.tolist())}
force = np.zeros((64, 3)); torque = np.zeros((64, 3))
for row in rows:
    a, b = order[int(row["id_a"])], order[int(row["id_b"])]
    force[a] += row["force"]; force[b] -= row["force"]
    for p, sign in ((a, 1), (b, -1)):
        torque[p] += sign * (np.cross(row["point"] - host.positions[p], row["force"]) + row["moment"])
size = np.abs(force).max()
assert size > 0
# sums of six terms in another order
assert np.abs(force - host.forces).max() < 1e-13 * np.abs(rows["force"]).max()
assert np.abs(torque - host.torques).max() < 1e-12 * np.abs(torque).max()
assert host.fix("bonds", 4) > 0 and host.fix("bonds", 12) > 0.0099
momentum = (host.masses[:, None] * host.velocities).sum(axis=0)
print("momentum", momentum)
try:
    host.bonds("nobody")
except LiggghtsError as error:
    assert "there is no fix concordem/bond" in str(error)
else:
    raise AssertionError("not refused")
try:
    Liggghts(library=sys.argv[1])
except LiggghtsError as error:
    assert "close it first" in str(error)
host.close()
try:
    host.run(1)
except LiggghtsError as error:
    assert "closed" in str(error)
print("done")
""")
    assert done.returncode == 0 and "done" in done.stdout, done.stdout + done.stderr


def test_two_processes_share_the_atoms():
    done = run("""
host.run(10)
sys.stdout.write(f"rank {len(host)} {host.owned} {host.fix('bonds'):g} {len(host.bonds('bonds'))};")
sys.stdout.flush()
host.close()
""", processes=2)
    assert done.returncode == 0, done.stdout + done.stderr
    # Both write to one stream, so a line break between their outputs may be missing.
    ranks = [[int(word) for word in words] for words in re.findall(r"rank (\d+) (\d+) (\d+) (\d+);", done.stdout)]
    assert [rank[0::2] for rank in ranks] == [[64, 144]] * 2, done.stdout
    assert sum(rank[1] for rank in ranks) == 64 and sum(rank[3] for rank in ranks) == 144
    assert all(rank[1] > 0 for rank in ranks)


def test_scripts_are_read_as_liggghts_reads_files(tmp_path):
    log = tmp_path / "log"
    done = run(f"""
host.commands('''log {log}
print "left # right" # a comment
print "joined &
here"
''')
host.close()
print("done")
""")
    assert done.returncode == 0 and "done" in done.stdout, done.stdout + done.stderr
    printed = log.read_text().splitlines()
    assert "left # right" in printed and "joined here" in printed, printed


def test_invalid_indices_of_a_fix_are_errors():
    done = run("""
host.run(0)
for name, index, message in [("bonds", 0, "has no output 0: its vector has 16 elements, counted from 1"),
                             ("bonds", 17, "has no output 17"), ("integrate", 1, "has 0 elements"),
                             ("nobody", 1, "there is no fix `nobody`")]:
    try:
        host.fix(name, index)
    except LiggghtsError as error:
        assert message in str(error), error
    else:
        raise AssertionError(f"no error: {name} {index}")
assert host.fix("bonds", 12) > 0.0099
print("done")
""")
    assert done.returncode == 0 and "done" in done.stdout, done.stdout + done.stderr


def test_a_process_that_fails_ends_the_others():
    done = run("""
import os
with host:
    if os.environ["OMPI_COMM_WORLD_RANK"] == "1":
        raise ValueError("on purpose")
    host.run(10)
    print("went on")
""", processes=2)
    assert done.returncode not in (0, 124) and "ValueError: on purpose" in done.stderr, done.stdout + done.stderr
    assert "went on" not in done.stdout


def test_a_missing_library_is_named():
    from concordem.liggghts import Liggghts, LiggghtsError

    with pytest.raises(LiggghtsError, match="make liggghts"):
        Liggghts(library="/no/such/library.so")


def test_rows_match_the_library():
    """A row has sixteen reals, as in the library."""
    from concordem import liggghts

    assert liggghts._ROW.itemsize == 16 * np.dtype(float).itemsize
