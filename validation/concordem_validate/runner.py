"""Runs engines on cases. Finished runs are stored under the hash of their inputs, so that an interrupted round can continue."""
import copy
import functools
import hashlib
import json
import os
import platform
import shutil
import sys
import tempfile
import threading
import traceback
import types
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from datetime import datetime, timezone
from pathlib import Path

import numpy as np

from . import compare, provenance
from .engines import ENGINES, concordem
from .errors import Crashed, HarnessError, NotInstalled, TimedOut, Unsupported
from .result import Result

_PACKAGE = Path(__file__).parent
# analytical elastic constants need no state
_NEEDS_START = {"yade", "liggghts", "liggghts-np2", "lammps", "esys", "analytic"}


@dataclass
class Outcome:
    """Outcome of one engine on one variant."""

    case: str
    variant: str
    engine: str
    status: str  # done, missing, timeout, crashed, unsupported
    message: str = ""
    path: Path = None
    kept: bool = False

    def result(self):
        return Result.read(self.path)


@dataclass
class Round:
    """All outcomes and verdicts of a round."""

    outcomes: dict = field(default_factory=dict)
    verdicts: list = field(default_factory=list)

    def failed(self, strict):
        bad = [o for o in self.outcomes.values() if o.status not in ("done", "missing")]
        missing = [o for o in self.outcomes.values() if o.status == "missing"]
        wrong = [v for v in self.verdicts if v.status == "fail"]
        return bool(bad or wrong or (strict and missing))


def strict_by_default():
    return os.environ.get("CI", "").lower() not in ("", "0", "false")


def _sources():
    """Hash of the translations, so that a changed harness does not reuse old runs."""
    digest = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*.py")):
        if path.name not in ("cli.py", "report.py", "compare.py", "runner.py", "quirks.py", "case.py"):
            digest.update(path.read_bytes())
    return digest.hexdigest()


def _inputs(task):
    """Hash of the files of a case that affect its runs: packings, tables, case.py."""
    digest = hashlib.sha256(json.dumps(task.scenario, sort_keys=True, default=str).encode())
    for path in sorted(task.folder.rglob("*")):
        if path.is_file() and path.suffix in (".txt", ".py") or path.name == "table.toml":
            digest.update(path.read_bytes())
    return digest.hexdigest()


def fingerprint(what, seen=()):
    """Text that identifies a planted defect: its instructions, constants, and arguments, and those of the functions it calls.

    A name would not do: a run made with another factor under the same name would be taken up.
    """
    if isinstance(what, functools.partial):
        return f"partial({fingerprint([what.func, what.args, what.keywords], seen)})"
    if isinstance(what, types.FunctionType):
        if id(what) in seen:
            return what.__qualname__
        seen = (*seen, id(what))
        cells = [cell.cell_contents for cell in what.__closure__ or ()]
        # functions that it calls in its own file; those of the harness are in `_sources`
        names = sorted(_names(what.__code__) & what.__globals__.keys())
        called = [what.__globals__[name] for name in names]
        called = [f for f in called if isinstance(f, types.FunctionType) and f.__module__ == what.__module__]
        return fingerprint(["function", what.__code__, what.__defaults__, what.__kwdefaults__, cells, called], seen)
    if isinstance(what, types.CodeType):
        return f"code({what.co_code.hex()} {what.co_names} {fingerprint(what.co_consts, seen)})"
    if isinstance(what, dict):
        return "{" + ", ".join(f"{key!r}: {fingerprint(value, seen)}" for key, value in what.items()) + "}"
    if isinstance(what, (list, tuple)):
        return "[" + ", ".join(fingerprint(part, seen) for part in what) + "]"
    return repr(what)


def _names(code):
    """Names that a function and its inner functions use."""
    return set(code.co_names).union(*(_names(part) for part in code.co_consts if isinstance(part, types.CodeType)))


class Runner:
    def __init__(self, folder, jobs=None, fresh=False, quiet=False, time_factor=1.0):
        self.folder, self.fresh, self.quiet, self.time_factor = Path(folder), fresh, quiet, time_factor
        (self.folder / "runs").mkdir(parents=True, exist_ok=True)
        self.jobs = jobs or _jobs()
        self.lock = threading.Lock()
        self.starts, self.running, self.made = {}, {}, set()
        self.done = 0
        self.total = 0

    def key(self, task, engine):
        version = ENGINES[engine].version()
        plant = [fingerprint(f) for name in ("concordem", engine) for f in task.plant.get(name, [])]
        also = getattr(ENGINES[engine], "also", lambda _: "")(task)
        if engine == concordem.NAME and task.peer:
            also += self.key(task, task.peer)
        text = json.dumps([engine, version, concordem.version(), _sources(), _inputs(task), plant, task.check_threads, task.command, also,
                           task.peer_scenario], default=str)
        return hashlib.sha256(text.encode()).hexdigest()[:24]

    def start_of(self, task):
        """The start state, built once for all engines."""
        key = hashlib.sha256((concordem.version() + _sources() + _inputs(task)).encode()).hexdigest()[:24]
        with self.lock:
            lock = self.starts.setdefault(key, threading.Lock())
        with lock:
            path = self.folder / "runs" / f"start-{key}.npz"
            if path.exists() and not self.fresh:
                with np.load(path) as file:
                    data = {name: file[name] for name in file.files}
                data["dt"] = float(data["dt"])
                return concordem.Start(**data)
            with tempfile.TemporaryDirectory(prefix="concordem-start-") as folder:
                start = concordem.export_start(task, Path(folder), 300 * self.time_factor)
            partial = path.with_suffix(".part.npz")
            np.savez(partial, **start.__dict__)
            partial.replace(path)
            return start

    def one(self, task, engine, limit, quiet=False):
        """Run one engine on one variant, or reuse a finished run."""
        out = Outcome(task.case, task.variant, engine, "done")
        try:
            key = self.key(task, engine)
            with self.lock:
                lock = self.running.setdefault(key, threading.Lock())
            # operators may need a state while its run is still in progress
            with lock:
                self._run(out, key, task, limit)
        except NotInstalled as error:
            out.status, out.message, out.path = "missing", str(error), None
        except TimedOut as error:
            out.status, out.message, out.path = "timeout", str(error), None
        except Unsupported as error:
            out.status, out.message, out.path = "unsupported", str(error), None
        except Crashed as error:
            out.status, out.message, out.path = "crashed", str(error), None
        except HarnessError as error:
            out.status, out.message, out.path = "crashed", str(error), None
        except Exception:
            out.status, out.message, out.path = "crashed", "internal error of the harness: " + traceback.format_exc(), None
        return out if quiet else self._say(out, task)

    def _run(self, out, key, task, limit):
        engine = out.engine
        out.path = self.folder / "runs" / f"{task.case}.{task.variant}.{engine}.{key}.h5"
        if out.path.exists() and (not self.fresh or key in self.made):
            out.kept = key not in self.made
            return
        if engine in _NEEDS_START and task.command != "elastic":
            task.start = self.start_of(task)
        if engine == concordem.NAME and task.peer:
            theirs = self.one(copy.copy(task), task.peer, limit, quiet=True)
            if theirs.status != "done":
                out.status, out.message, out.path = theirs.status, f"no state of {task.peer}: {theirs.message}", None
                return
            task.frozen = theirs.result()
        elif engine != concordem.NAME and task.peer_scenario:
            task.scenario = task.peer_scenario
        scratch = Path(tempfile.mkdtemp(prefix=f"concordem-{engine}-"))
        try:
            result = ENGINES[engine].run(task, scratch, limit * self.time_factor)
        except BaseException:
            # its output helps to find the cause
            keep = self.folder / "failed" / f"{task.case}.{task.variant}.{engine}"
            shutil.rmtree(keep, ignore_errors=True)
            shutil.copytree(scratch, keep, dirs_exist_ok=True)
            raise
        finally:
            shutil.rmtree(scratch, ignore_errors=True)
        result.provenance.update(
            engine_version=ENGINES[engine].version(), host=platform.platform(), processor=provenance.processor(),
            date=datetime.now(timezone.utc).isoformat(timespec="seconds"), case=task.case, variant=task.variant,
            load_average=" ".join(f"{x:.1f}" for x in os.getloadavg()))
        result.write(out.path)
        self.made.add(key)

    def _say(self, out, task):
        with self.lock:
            self.done += 1
            if not self.quiet:
                word = "kept" if out.kept else out.status
                print(f"[{self.done:3d}/{self.total}] {out.case} · {out.variant} · {out.engine}: {word} "
                      f"{out.message.splitlines()[0] if out.message else ''}".rstrip(), file=sys.stderr, flush=True)
        return out

    def run(self, cases, plant=None):
        """All engines on all variants, then all checks."""
        round_ = Round()
        jobs = []
        for case in cases:
            for task in case.tasks:
                task.plant = plant or {}
                for engine in dict.fromkeys(["concordem", *case.engines_of[task.variant]]):
                    jobs.append((case, task, engine))
        self.done, self.total = 0, len(jobs)
        # in the order of cases: readable, and hardly slower than starting with the longest
        with ThreadPoolExecutor(self.jobs) as pool:
            outcomes = pool.map(lambda job: self.one(copy.copy(job[1]), job[2], job[0].time_limit), jobs)
            for outcome in outcomes:
                round_.outcomes[outcome.case, outcome.variant, outcome.engine] = outcome
        for case in cases:
            round_.verdicts += compare.judge(case, round_.outcomes, plant or {})
        return round_


def _jobs():
    """Number of parallel engines: one per processor, and at least one gigabyte of memory each."""
    try:
        with open("/proc/meminfo") as file:
            free = next(int(line.split()[1]) for line in file if line.startswith("MemAvailable")) / 2**20
    except (OSError, StopIteration):
        free = 4
    return max(1, min(os.cpu_count() or 1, int(free)))
