"""beside_h5py.py FIRST RESULT NEW: h5py and concordem in one process, FIRST imported first; each has its own HDF5 library.

h5py reads what concordem wrote, concordem runs and reads while files of h5py are open, and both keep working after the other one. If the
symbols of one library leaked, it would work on the other's identifiers and fail, or crash.
"""

import importlib
import os
import sys
import tempfile

first, result, new = sys.argv[1:]
importlib.import_module(first)

import concordem  # noqa: E402
import h5py  # noqa: E402
import numpy  # noqa: E402
from concordem import _core  # noqa: E402

written = numpy.arange(1000.0).reshape(10, 100)
with h5py.File(new, "w") as file:
    file.create_dataset("before", data=written, compression="gzip")
    # concordem reads, and writes by its program, while h5py has an open file.
    run = concordem.Result(result)
    samples = run.samples
    with tempfile.TemporaryDirectory() as folder:
        scenario = os.path.join(folder, "again.toml")
        with open(scenario, "w", encoding="utf-8") as text:
            text.write(concordem.Scenario.template("cpm-small").text)
        assert _core.run_program(["run", "-q", scenario, "--set", "stop.steps=200"], _core.__file__) == 0
        with h5py.File(os.path.join(folder, "again.h5")) as again:
            steps = concordem.Result(again.filename).samples["step"]
            assert steps[-1] == 200 and (again["samples/step"][:] == steps).all()
    file.create_dataset("after", data=written + 1, compression="gzip")
with h5py.File(new) as file:
    assert (file["before"][:] == written).all()
    assert (file["after"][:] == written + 1).all()
assert len(samples) == len(concordem.Result(result).samples) > 10

# Two libraries, not one: of other versions, or at least loaded from other files. ConcorDEM exports no symbol of its own.
with open("/proc/self/maps", encoding="utf-8") as maps:
    libraries = {line.split()[-1] for line in maps if "libhdf5" in line}
assert libraries and not any("concordem" in library for library in libraries), libraries
import ctypes  # noqa: E402

try:
    ctypes.CDLL(_core.__file__).H5open
except AttributeError:
    pass
else:
    sys.exit("the package exports the symbols of its HDF5")
print(f"{first} first: h5py {h5py.__version__} with HDF5 {h5py.version.hdf5_version} beside concordem {concordem.__version__}")
