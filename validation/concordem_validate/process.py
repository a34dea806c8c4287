"""Runs an engine in a process of its own, which is stopped with all its children when its time is up."""
import os
import signal
import subprocess
import time

from .errors import Crashed, TimedOut

# Peers must not share out their work over threads: their sums would depend on it (YADE), or they would fight for cores.
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def run(command, folder, limit, environment=None, accept=(0,)):
    """The output and the wall time of a command; raises [`TimedOut`] or [`Crashed`]."""
    log = folder / "log.txt"
    start = time.perf_counter()
    with open(log, "w") as file:
        child = subprocess.Popen(
            [str(part) for part in command], cwd=folder, stdout=file, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
            env={**os.environ, **(environment or {})}, start_new_session=True)
        try:
            code = child.wait(timeout=limit)
        except BaseException as error:
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()
            if isinstance(error, subprocess.TimeoutExpired):
                raise TimedOut(f"not done after {limit:g} s; stopped. {_tail(log)}") from None
            raise
    if code not in accept:
        raise Crashed(f"ended with code {code}. {_tail(log)}")
    return log.read_text(errors="replace"), time.perf_counter() - start


def _tail(log, lines=6):
    return "Last output: " + " | ".join(log.read_text(errors="replace").strip().splitlines()[-lines:])
