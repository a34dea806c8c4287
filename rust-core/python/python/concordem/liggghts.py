"""LIGGGHTS with ConcorDEM laws, driven from Python through its C library interface.

>>> from concordem.liggghts import Liggghts                                                     # doctest: +SKIP
>>> with Liggghts(library="target/liggghts/libconcordem-liggghts.so") as host:                  # doctest: +SKIP
...     host.commands(script)
...     host.run(100)
...     host.positions[:, 2].max(), host.fix("bonds"), host.bonds("bonds")["force"]

`make liggghts` builds the library. Without `library`, it is searched in the folder of the launcher on PATH. Under MPI
(``mpirun -np 4 python script.py``), every process opens LIGGGHTS, runs the same commands, and sees its own atoms.

On an invalid command, LIGGGHTS prints a message and ends the process; use a separate process to survive it. Only one instance can
be open at a time.
"""

from __future__ import annotations

import atexit
import ctypes
import os
import shutil
import sys
import traceback
from pathlib import Path
from types import TracebackType
from typing import Any, Sequence

import numpy as np
import numpy.typing as npt

from ._errors import ConcordemError

__all__ = ["Liggghts", "LiggghtsError"]

#: A row of :meth:`Liggghts.bonds`.
_ROW = np.dtype(
    [
        ("id_a", "f8"),
        ("id_b", "f8"),
        ("force", "f8", 3),
        ("moment", "f8", 3),
        ("point", "f8", 3),
        ("length", "f8"),
        ("area", "f8"),
        ("damage", "f8"),
        ("bonded", "f8"),
        ("reserved", "f8"),
    ]
)

_LIBRARY = "libconcordem-liggghts.so"


class LiggghtsError(ConcordemError):
    """LIGGGHTS cannot be loaded, is closed, or has no object with the given name."""


def _find(library: str | os.PathLike[str] | None) -> Path:
    """Path of the library: `library`, else CONCORDEM_LIGGGHTS, else in the folder of the launcher on PATH."""
    given = library if library is not None else os.environ.get("CONCORDEM_LIGGGHTS")
    if given is not None:
        path = Path(given)
    else:
        launcher = shutil.which("concordem-liggghts")
        path = Path(launcher).resolve().parent / _LIBRARY if launcher else Path(_LIBRARY)
    if not path.is_file():
        raise LiggghtsError(
            f"{path} is missing; build it with `make liggghts`, then give its path by `library=` or the environment variable "
            "CONCORDEM_LIGGGHTS, or add its folder to PATH"
        )
    return path.resolve()


class Liggghts:
    """A LIGGGHTS instance in this process.

    Methods raise :class:`LiggghtsError` once it is closed.
    """

    _open: Liggghts | None = None

    def __init__(
        self,
        library: str | os.PathLike[str] | None = None,
        arguments: Sequence[str] = ("-screen", "/dev/null", "-log", "none"),
    ) -> None:
        """Open LIGGGHTS with the ConcorDEM styles; `arguments` are its command-line arguments.

        Raises LiggghtsError if the library is missing or an instance is open.
        """
        self._handle: ctypes.c_void_p | None = None
        if Liggghts._open is not None:
            raise LiggghtsError("LIGGGHTS is already open in this process; close it first")
        try:
            # Load our library first: it overrides functions of LIGGGHTS, which it then loads.
            self._library = ctypes.CDLL(str(_find(library)), mode=ctypes.RTLD_GLOBAL)
        except OSError as error:
            raise LiggghtsError(f"{error}; install the Debian packages liggghts and libopenmpi3") from error
        self._declare()
        words = [b"liggghts", *(word.encode() for word in arguments)]
        argv = (ctypes.c_char_p * len(words))(*words)
        handle = ctypes.c_void_p()
        if not self._library.concordem_liggghts_mpi(0):
            # LIGGGHTS initializes MPI, which is possible only once, but does not finalize it.
            atexit.register(self._library.concordem_liggghts_mpi, 1)
        self._library.lammps_open_no_mpi(len(words), argv, ctypes.byref(handle))
        self._handle = handle
        Liggghts._open = self

    def _declare(self) -> None:
        pointer, text, integer = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int
        for name, result, arguments in [
            ("lammps_open_no_mpi", None, [integer, ctypes.POINTER(text), ctypes.POINTER(pointer)]),
            ("lammps_close", None, [pointer]),
            ("lammps_file", None, [pointer, text]),
            ("lammps_command", pointer, [pointer, text]),
            ("lammps_extract_global", pointer, [pointer, text]),
            ("lammps_extract_atom", pointer, [pointer, text]),
            ("lammps_extract_fix", pointer, [pointer, text, integer, integer, integer, integer]),
            ("lammps_extract_compute", pointer, [pointer, text, integer, integer]),
            ("lammps_free", None, [pointer]),
            ("lammps_get_natoms", integer, [pointer]),
            ("concordem_liggghts_rows", ctypes.POINTER(ctypes.c_double), [pointer, text, ctypes.POINTER(ctypes.c_int64)]),
            ("concordem_liggghts_fix_size", integer, [pointer, text]),
            ("concordem_liggghts_processes", integer, [pointer]),
            ("concordem_liggghts_abort", None, [pointer]),
            ("concordem_liggghts_mpi", integer, [integer]),
            ("concordem_liggghts_rows_delete", None, [ctypes.POINTER(ctypes.c_double), ctypes.c_int64]),
        ]:
            function = getattr(self._library, name)
            function.restype = result
            function.argtypes = arguments

    def __enter__(self) -> Liggghts:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close LIGGGHTS. If an exception leaves the block on one of several processes, print its traceback and abort all of them,
        because the others would wait forever; `sys.exit()` does not abort."""
        leaves = isinstance(value, SystemExit) and not value.code
        if value is not None and not leaves and self._handle is not None:
            if self._library.concordem_liggghts_processes(self._handle) > 1:
                traceback.print_exception(kind, value, trace)
                sys.stdout.flush()
                sys.stderr.flush()
                self._library.concordem_liggghts_abort(self._handle)
        self.close()

    def close(self) -> None:
        """Close LIGGGHTS. Do not use views of its arrays afterwards."""
        if self._handle is not None:
            self._library.lammps_close(self._handle)
            self._handle = None
            Liggghts._open = None

    @property
    def _instance(self) -> ctypes.c_void_p:
        if self._handle is None:
            raise LiggghtsError("LIGGGHTS is closed; open a new instance")
        return self._handle

    def command(self, line: str) -> None:
        """Run one script command."""
        self._library.lammps_command(self._instance, line.encode())

    def commands(self, text: str) -> None:
        """Run the lines of a script. As in LIGGGHTS input files, a line that ends with `&` continues on the next line, even if it is
        a comment. LIGGGHTS itself strips the comments."""
        line = ""
        for part in text.splitlines():
            line += part.rstrip()
            if line.endswith("&"):
                line = line[:-1]
                continue
            if line.strip():
                self.command(line.strip())
            line = ""
        if line.strip():
            raise LiggghtsError("the last line of the script ends with `&`, but no line follows; remove the `&` or add the line")

    def file(self, path: str | os.PathLike[str]) -> None:
        """Run the commands of a file."""
        if not Path(path).is_file():
            raise LiggghtsError(f"cannot read {path}; check the path")
        self._library.lammps_file(self._instance, os.fsencode(path))

    def run(self, steps: int) -> None:
        """Run `steps` steps."""
        if steps < 0:
            raise LiggghtsError(f"run {steps}: the number of steps must not be negative")
        self.command(f"run {steps}")

    def __len__(self) -> int:
        """Number of atoms in all processes."""
        return int(self._library.lammps_get_natoms(self._instance))

    @property
    def owned(self) -> int:
        """Number of atoms owned by this process."""
        return self._global_integer("nlocal")

    def _global_integer(self, name: str) -> int:
        address = self._library.lammps_extract_global(self._instance, name.encode())
        if not address:
            raise LiggghtsError(f"LIGGGHTS has no global number `{name}`")
        return ctypes.c_int.from_address(address).value

    def _view(self, name: str, columns: int, kind: type[Any]) -> npt.NDArray[Any]:
        """A view of LIGGGHTS' memory. It becomes invalid when atoms migrate, are created, or are deleted, so get it again after a run."""
        rows = self.owned
        address = self._library.lammps_extract_atom(self._instance, name.encode())
        if not address:
            raise LiggghtsError(f"atoms have no property `{name}`; use atom_style sphere and create atoms first")
        shape = (rows, columns) if columns else (rows,)
        if rows == 0:
            return np.empty(shape, dtype=kind)
        if columns:
            # An array of pointers to contiguous rows.
            address = ctypes.c_void_p.from_address(address).value
        array = (kind * (rows * max(columns, 1))).from_address(address)
        return np.ctypeslib.as_array(array).reshape(shape)

    @property
    def positions(self) -> npt.NDArray[np.float64]:
        """Positions, m, (n, 3). Like the following arrays, a view of LIGGGHTS' memory that is valid until the next run."""
        return self._view("x", 3, ctypes.c_double)

    @property
    def velocities(self) -> npt.NDArray[np.float64]:
        """Velocities, m/s, (n, 3)."""
        return self._view("v", 3, ctypes.c_double)

    @property
    def spins(self) -> npt.NDArray[np.float64]:
        """Angular velocities, rad/s, (n, 3)."""
        return self._view("omega", 3, ctypes.c_double)

    @property
    def forces(self) -> npt.NDArray[np.float64]:
        """Forces, N, (n, 3)."""
        return self._view("f", 3, ctypes.c_double)

    @property
    def torques(self) -> npt.NDArray[np.float64]:
        """Torques, N·m, (n, 3)."""
        return self._view("torque", 3, ctypes.c_double)

    @property
    def radii(self) -> npt.NDArray[np.float64]:
        """Radii, m, (n,)."""
        return self._view("radius", 0, ctypes.c_double)

    @property
    def masses(self) -> npt.NDArray[np.float64]:
        """Masses, kg, (n,)."""
        return self._view("rmass", 0, ctypes.c_double)

    @property
    def ids(self) -> npt.NDArray[np.int32]:
        """Ids, (n,)."""
        return self._view("id", 0, ctypes.c_int)

    @property
    def types(self) -> npt.NDArray[np.int32]:
        """Types, from 1, (n,)."""
        return self._view("type", 0, ctypes.c_int)

    def fix(self, name: str, index: int | None = None) -> float:
        """Output of a fix: its scalar, or element `index` (from 1) of its vector. The value covers all processes, and all of them must
        call this. Raises LiggghtsError if there is no such fix or output."""
        if index is not None:
            # LIGGGHTS would read out of bounds: it does not check the index.
            length = self._library.concordem_liggghts_fix_size(self._instance, name.encode())
            if length >= 0 and not 1 <= index <= length:
                raise LiggghtsError(f"fix `{name}` has no output {index}: its vector has {length} elements, counted from 1")
        kind, place = (0, 0) if index is None else (1, index - 1)
        address = self._library.lammps_extract_fix(self._instance, name.encode(), 0, kind, place, 0)
        if not address:
            raise LiggghtsError(f"there is no fix `{name}` with this output; check the id")
        value = ctypes.c_double.from_address(address).value
        # A copy, which we must free.
        self._library.lammps_free(address)
        return value

    def bonds(self, fix: str) -> npt.NDArray[np.void]:
        """Bonds and contacts of a fix concordem/bond that this process counts, a copy. Fields: ids of A and B, the lower one first, force on
        A (N), moment on A about the contact point (N·m), contact point (m), length (m), area (m²), damage, and whether it is a bond. The
        forces are those of the last step with output; the end of a run is always one. Raises LiggghtsError if there is no such fix."""
        count = ctypes.c_int64()
        rows = self._library.concordem_liggghts_rows(self._instance, fix.encode(), ctypes.byref(count))
        if not rows:
            raise LiggghtsError(f"there is no fix concordem/bond with id `{fix}`; check the id")
        try:
            if count.value == 0:
                return np.empty(0, dtype=_ROW)
            length = count.value * (_ROW.itemsize // 8)
            return np.ctypeslib.as_array(rows, shape=(length,)).copy().view(_ROW)
        finally:
            self._library.concordem_liggghts_rows_delete(rows, count)
