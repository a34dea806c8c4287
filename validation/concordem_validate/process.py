"""Runs an engine in a separate process, which is stopped with all its children at the time limit."""
import os
import re
import signal
import subprocess
import time

from .errors import Crashed, Refused, TimedOut

# One thread per peer: sums must not depend on threads (YADE), and peers must not compete for cores.
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
_TAIL = 1 << 16
# colors and other commands to a terminal, and what XML and JSON readers refuse
_ESCAPES = re.compile("\x1b(?:\\[[0-?]*[ -/]*[@-~]|\\][^\x07\x1b]*(?:\x07|\x1b\\\\)?|.)?")
_CONTROLS = re.compile("[^\t\n\x20-\x7e\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def plain(text):
    """A text without control characters, which colored output has."""
    return _CONTROLS.sub("", _ESCAPES.sub("", str(text)))


def patience(limit):
    """How long a run may take that needs `limit` seconds alone: where more runs than processors share the machine, each one waits for its turn."""
    return limit * max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))


def _wait(child, limit):
    """Exit code of a child; raises subprocess.TimeoutExpired. The load may change while it runs, and has the last word."""
    start = time.perf_counter()
    while True:
        elapsed = time.perf_counter() - start
        try:
            return child.wait(timeout=max(0.0, patience(limit) - elapsed))
        except subprocess.TimeoutExpired:
            if time.perf_counter() - start >= patience(limit):
                raise


def run(command, folder, limit, environment=None, refusal=None):
    """Output and wall time (s) of a command; raises TimedOut or Crashed, or Refused if it ends with the code `refusal`."""
    log = folder / "log.txt"
    start = time.perf_counter()
    with open(log, "w") as file:
        child = subprocess.Popen(
            [str(part) for part in command], cwd=folder, stdout=file, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
            # Open MPI 4 fails if two runs create or remove its common folder below /tmp at the same time.
            env={**os.environ, "OMPI_MCA_orte_tmpdir_base": str(folder), **(environment or {})}, start_new_session=True)
        try:
            code = _wait(child, limit)
        except BaseException as error:
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()
            if isinstance(error, subprocess.TimeoutExpired):
                raise TimedOut(f"stopped after the time limit of {limit:g} s. {tail(log)}") from None
            raise
    if code == refusal and code is not None:
        said = _last(log)
        raise Refused(said[-1] if said else "it cannot compute this scenario")
    if code:
        raise Crashed(f"exited with code {code}. {tail(log)}")
    return log.read_text(errors="replace"), time.perf_counter() - start


def tail(log, lines=6):
    """The last lines that a command wrote, for messages."""
    return "Last output: " + " | ".join(_last(log)[-lines:])


def _last(log):
    """Lines at the end of a log, which may be large."""
    with open(log, "rb") as file:
        file.seek(max(0, os.fstat(file.fileno()).st_size - _TAIL))
        return plain(file.read().decode(errors="replace")).strip().splitlines()
