"""Data bases of YADE's randomDensePack: read without YADE, and without trusting them."""

import os
import pickle
import shutil
import sqlite3
import struct
import subprocess
import sys
import types

import concordem
import numpy as np
import pytest
from concordem import packing

CREATE = (
    "CREATE TABLE packings (radius real, rRelFuzz real, dimx real, dimy real, dimz real, N integer, timestamp real, periodic integer, pack blob)"
)

MAKE = """
from yade import pack
import pickle, sqlite3
common = dict(radius=0.01, memoizeDb="packings.db", seed=1, returnSpherePack=True)
pack.randomDensePack(pack.inAlignedBox((0, 0, 0), (0.1, 0.1, 0.1)), rRelFuzz=0.2, spheresInCell=60, **common)
pack.randomDensePack(pack.inAlignedBox((0, 0, 0), (0.06, 0.08, 0.1)), rRelFuzz=0.1, **common)
for number, (blob,) in enumerate(sqlite3.connect("packings.db").execute("SELECT pack FROM packings ORDER BY timestamp")):
    with open(f"{number}.txt", "w") as file:
        for (x, y, z), r in pickle.loads(blob):
            print(repr(x), repr(y), repr(z), repr(r), file=file)
"""


def test_packings_of_yade(tmp_path):
    (tmp_path / "make.py").write_text(MAKE)
    run = subprocess.run(["yade", "-n", "-x", "make.py"], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300)
    assert (tmp_path / "1.txt").exists(), run.stdout + run.stderr
    periodic, boxed = packing.read_memoized(tmp_path / "packings.db")
    for number, found in enumerate((periodic, boxed)):
        # YADE's own reading, digit for digit.
        told = np.loadtxt(tmp_path / f"{number}.txt")
        assert np.array_equal(told, np.column_stack([found.packing.positions, found.packing.radii]))
        assert found.radius == 0.01 and found.time > 1.6e9
    assert periodic.periodic and periodic.radius_fuzz == 0.2 and len(periodic.packing.radii) == 60
    assert np.array_equal(periodic.packing.cell, np.diag(periodic.dimensions))
    assert not boxed.periodic and boxed.packing.cell is None and boxed.radius_fuzz == 0.1
    assert boxed.dimensions == pytest.approx([0.06, 0.08, 0.1])
    packing.write(tmp_path / "p.txt", *periodic.packing)
    assert np.array_equal(packing.read(tmp_path / "p.txt").cell, periodic.packing.cell)


@pytest.fixture(params=["minieigen", "yade._minieigenHP"])
def vector(request, monkeypatch):
    """A class that pickles as the vectors of old and new versions of YADE do."""
    module = types.ModuleType(request.param)

    class Vector3:
        def __init__(self, x, y, z):
            self.all = (x, y, z)

        def __reduce__(self):
            return Vector3, self.all

    Vector3.__module__, Vector3.__qualname__ = request.param, "Vector3"
    module.Vector3 = Vector3
    if "." in request.param:
        monkeypatch.setitem(sys.modules, "yade", types.ModuleType("yade"))
    monkeypatch.setitem(sys.modules, request.param, module)
    return Vector3


def database(folder, blob, count=2, **changes):
    row = {"radius": 1.0, "fuzz": 0.1, "x": 4.0, "y": 5.0, "z": 6.0, "N": count, "time": 7.0, "periodic": 1, **changes}
    place = folder / "packings #1.db"
    place.unlink(missing_ok=True)
    connection = sqlite3.connect(place)
    with connection:
        connection.execute(CREATE)
        connection.execute("INSERT INTO packings VALUES (?,?,?,?,?,?,?,?,?)", (*row.values(), blob))
    connection.close()
    return place


@pytest.mark.parametrize("protocol", [2, 3, 4, 5])
def test_every_protocol_and_version(tmp_path, vector, protocol):
    blob = pickle.dumps([(vector(1.0, 2.0, 3.0), 0.5), (vector(-1.0, 0.0, 1e-300), 0.25)], protocol)
    (found,) = packing.read_memoized(database(tmp_path, blob))
    assert found.packing.positions.tolist() == [[1, 2, 3], [-1, 0, 1e-300]] and found.packing.radii.tolist() == [0.5, 0.25]
    assert found.packing.cell.diagonal().tolist() == [4, 5, 6] and found.time == 7


class Calls:
    """Pickles as a call."""

    def __init__(self, function, *arguments):
        self.call = function, arguments

    def __reduce__(self):
        return self.call


def test_nothing_foreign_is_run(tmp_path):
    trace = tmp_path / "trace"
    vector = b"cminieigen\nVector3\n"
    for blob, message in [
        # The first has only instructions that packings need, and is stopped by its name.
        (pickle.dumps([Calls(shutil.copy, __file__, str(trace))]), "the pickle asks for shutil.copy"),
        (pickle.dumps(Calls(os.mkdir, str(trace))), "the instruction TUPLE1"),
        (pickle.dumps(np.ones(3)), "the instruction"),
        (b"\x80\x02cminieigen\nVector3.__class__\n.", "the pickle asks for minieigen.Vector3.__class__"),
        (b"\x80\x02" + vector + b"}b.", "the instruction EMPTY_DICT"),
        (b"\x80\x02" + vector + b")\x81.", "the instruction EMPTY_TUPLE"),
        (b"\x80\x02Pelsewhere\n.", "the instruction PERSID"),
        # Would allocate 64 GB.
        (b"\x80\x02]r" + struct.pack("<I", 2**32 - 1) + b".", "asks for 4294967295 places"),
        (b"\x80\x02]", "refused"),
        (b"", "refused"),
        (b"\x80\x02.", "refused"),
        (pickle.dumps("spheres"), "no list of spheres"),
    ]:
        with pytest.raises(concordem.PackingError, match="packing 1: refused: ") as found:
            packing.read_memoized(database(tmp_path, blob))
        assert message in str(found.value) and "load the packing in YADE" in str(found.value)
        assert not trace.exists()


def test_damaged_data(tmp_path):
    one = ((1.0, 2.0, 3.0), 0.5)
    for items, changes, message in [
        ([one], {"count": 2}, "1 spheres instead of N = 2"),
        ([(*one, "clump")], {"count": 1}, "a member of a clump"),
        ([(one[0], "0.5")], {"count": 1}, "not a number of double precision"),
        ([(one[0], -0.5)], {"count": 1}, "a radius is not positive"),
        ([((float("nan"), 0.0, 0.0), 0.5)], {"count": 1}, "not finite"),
        ([one], {"count": 1, "x": 0.0}, "a periodic cell with the edges"),
        ([one], {"count": 1, "x": None}, "a parameter is not a number"),
    ]:
        with pytest.raises(concordem.PackingError, match=message) as found:
            packing.read_memoized(database(tmp_path, pickle.dumps(items), **changes))
        assert "SpherePack.save" in str(found.value)
    with pytest.raises(concordem.PackingError, match="the column `pack` is not a pickle"):
        packing.read_memoized(database(tmp_path, "text"))


def test_other_files(tmp_path):
    with pytest.raises(FileNotFoundError):
        packing.read_memoized(tmp_path / "missing.db")
    assert not (tmp_path / "missing.db").exists()
    other = tmp_path / "other"
    other.write_text("0 0 0 1\n" * 200)
    with pytest.raises(concordem.PackingError, match="not a data base of YADE's randomDensePack .*memoizeDb.*packing.read"):
        packing.read_memoized(other)
    connection = sqlite3.connect(tmp_path / "empty.db")
    with connection:
        connection.execute("CREATE TABLE results (radius real)")
    connection.close()
    with pytest.raises(concordem.PackingError, match="no such table: packings"):
        packing.read_memoized(tmp_path / "empty.db")
