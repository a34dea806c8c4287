"""Runs engines on cases. Finished runs are stored under the hash of their inputs, so that an interrupted round can continue."""
import copy
import hashlib
import json
import os
import platform
import shutil
import stat
import sys
import tempfile
import threading
import traceback
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path

import numpy as np

from . import compare, programs, provenance, registry, scenario, timing
from . import start as starts
from .case import Check
from .engines import concordem
from .errors import Crashed, HarnessError, Incomparable, NotInstalled, Refused, TimedOut, Unsupported
from .plants import fingerprint
from .process import plain
from .result import Result
from .rounds import Outcome, Round

_PACKAGE = Path(__file__).parent
# what a run goes through; reports and comparisons are made again each time
_OF_RUNS = ("engines", "process.py", "quantity.py", "result.py", "scenario.py", "selfcheck.py", "stability.py", "start.py")
# texts about a case, and checks, which change no run; changed scenarios are hashed themselves
_OF_NO_RUN = {"README.md", "case.toml"}
START = dict(name="start state", kind="start", peer="scenario", variants=["*"], of="start", tolerance=starts.ROUNDING,
             reason="Positions, radii, masses, bonds, velocities, and the step by NumPy from the scenario: products of a few numbers.")


def strict_by_default():
    return os.environ.get("CI", "").lower() not in ("", "0", "false")


def harness_hash():
    """Hash of the translations, so that a changed harness does not reuse old runs."""
    return programs.digest_all([_PACKAGE / name for name in _OF_RUNS])


def case_hash(task):
    """Hash of everything of a case that a run may read: all its files, and those that its scenario names elsewhere."""
    one = hashlib.sha256(json.dumps([task.scenario, task.peer_scenario, task.command], sort_keys=True, default=str).encode())
    files = {p for p in task.folder.rglob("*") if p.is_file() and p.name not in _OF_NO_RUN and "__pycache__" not in p.parts}
    files |= {task.folder / text for text in _texts(task.scenario) if _is_file(task.folder / text)}
    for path in sorted(files):
        one.update(f"{os.path.relpath(path, task.folder)} {programs.digest(path)}".encode())
    return one.hexdigest()[:24]


def refuse_stale(case, outcomes):
    """Stored results of a case that has changed since say nothing about it."""
    for task in case.tasks:
        hashes = {case_hash(task)}
        if task.peer_scenario:
            hashes.add(case_hash(replace(task, scenario=task.peer_scenario)))
        for outcome in outcomes.values():
            if (outcome.case, outcome.variant, outcome.status) == (task.case, task.variant, "done"):
                about = outcome.provenance()
                if about and about.get("case_hash") not in hashes:
                    outcome.status = "stale"
                    outcome.message = "the case has changed since this run; make the round again"


def _is_file(path):
    try:
        return path.is_file()
    except OSError:
        return False


def _texts(value):
    """All texts of a scenario."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, (dict, list)):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _texts(item)


def _hash_of(start):
    """Hash of a start state by content."""
    if start is None:
        return ""
    one = hashlib.sha256()
    for name, values in sorted(start.__dict__.items()):
        one.update(name.encode() + np.ascontiguousarray(values).tobytes())
    return one.hexdigest()[:24]


class Runner:
    def __init__(self, folder, jobs=None, fresh=False, quiet=False, time_factor=1.0):
        self.folder, self.fresh, self.quiet, self.time_factor = Path(folder), fresh, quiet, time_factor
        (self.folder / "runs").mkdir(parents=True, exist_ok=True)
        # what lies here is no input of engines in the folder above
        (self.folder / "runs" / ".round").touch()
        self.jobs = jobs or _jobs()
        self.lock = threading.Lock()
        self.locks, self.made = {}, set()
        self.start_verdicts, self.judged, self.versions = {}, {}, {}
        self.done = 0
        self.total = 0

    def _lock(self, key):
        with self.lock:
            return self.locks.setdefault(key, threading.Lock())

    def version(self, engine):
        """Version of an engine, asked once in a round: its programs have many files."""
        with self._lock(f"version of {engine}"):
            if engine not in self.versions:
                try:
                    self.versions[engine] = registry.ENGINES[engine].version()
                except NotInstalled as error:
                    self.versions[engine] = error
            found = self.versions[engine]
        if isinstance(found, NotInstalled):
            raise NotInstalled(str(found))
        return found

    def key(self, task, engine):
        """Hash of all that a run depends on: engine, translation, case, start state, planted defects."""
        one = registry.ENGINES[engine]
        # what is planted in another engine changes nothing here; the start state is hashed itself
        plant = [fingerprint(f) for name in dict.fromkeys([engine, engine.split("@")[0]]) for f in task.plant.get(name, [])]
        also = getattr(one, "also", lambda _: "")(task)
        if engine == concordem.NAME and task.peer:
            also += self.key(self.with_start(copy.copy(task), task.peer), task.peer)
        # only our program runs again with other threads
        threads = task.check_threads and engine.split("@")[0] == concordem.NAME
        text = json.dumps([engine, self.version(engine), harness_hash(), case_hash(task), _hash_of(task.start), plant, threads, also], default=str)
        return hashlib.sha256(text.encode()).hexdigest()[:24]

    def with_start(self, task, engine):
        if registry.needs_start(engine) and task.command != "elastic":
            task.start = self.start_of(task)
        return task

    def start_of(self, task):
        """The start state: that of the program, compared with the scenario; without the program, the scenario's."""
        try:
            version = self.version(concordem.NAME)
        except NotInstalled as error:
            try:
                return starts.state(task.scenario, task.folder)
            except Unsupported as unsupported:
                raise NotInstalled(f"{unsupported} ({error})") from None
        planted = [fingerprint(f) for f in task.plant.get("start", [])]
        text = json.dumps([version, harness_hash(), case_hash(task), planted])
        key = hashlib.sha256(text.encode()).hexdigest()[:24]
        with self._lock(key):
            try:
                start = self._exported(task, key)
            except HarnessError:
                # a scenario of other codes that ours does not know; its own run fails where a case asks for it
                try:
                    return starts.state(task.scenario, task.folder)
                except Unsupported:
                    pass
                raise
            if key not in self.judged:
                self.judged[key] = self._judge_start(task, start)
            # variants may share a scenario
            self.start_verdicts[task.case, task.variant] = replace(self.judged[key], case=task.case, variant=task.variant)
            return start

    def _exported(self, task, key):
        path = self.folder / "runs" / f"start-{key}.npz"
        if path.exists() and (not self.fresh or key in self.made):
            with np.load(path) as file:
                data = {name: file[name] for name in file.files}
            data["dt"] = float(data["dt"])
            return starts.Start(**data)
        with tempfile.TemporaryDirectory(prefix="concordem-start-") as folder:
            start = concordem.export_start(task, Path(folder), 300 * self.time_factor)
            for change in task.plant.get("start", []):
                change(start)
            partial = Path(folder) / "start.npz"
            np.savez(partial, **start.__dict__)
            # a folder of its own for the name, because rounds may share the output
            shutil.copy(partial, unique := path.with_name(f".{path.name}.{os.getpid()}.{threading.get_ident()}"))
            unique.replace(path)
        self.made.add(key)
        return start

    def _judge_start(self, task, start):
        """A verdict about the start state: peers that get a wrong one from us would agree with us."""
        verdict = compare.Verdict(task.case, task.variant, Check(**START), "pass", 0.0)
        try:
            words, alone = starts.compare(start, task.scenario, task.folder)
            verdict.message = "compared: " + ", ".join(words) + (f"; of ConcorDEM alone: {', '.join(alone)}" if alone else "")
        except Unsupported as error:
            verdict.status, verdict.message = "skipped", str(error)
        except Exception as error:
            compare.fail(verdict, error)
        return verdict

    def one(self, task, engine, limit, quiet=False, added=False):
        """Run one engine on one variant, or reuse a finished run. `added`: the case does not name the engine, so it may refuse."""
        out = Outcome(task.case, task.variant, engine, "done")
        try:
            self.with_start(task, engine)
            key = self.key(task, engine)
            # operators may need a state while its run is still in progress
            with self._lock(key):
                self._run(out, key, task, limit)
        except HarnessError as error:
            kinds = {NotInstalled: "missing", TimedOut: "timeout", Unsupported: "skipped" if added else "unsupported", Refused: "skipped",
                     Crashed: "crashed"}
            out.status = error.cause if isinstance(error, Incomparable) else kinds.get(type(error), "error")
            out.message, out.path = plain(error), None
            if type(error) is Unsupported and task.place:
                out.message += scenario.line_of(task.place, out.message)
        except Exception:
            out.status, out.message, out.path = "error", "internal error of the engine or the harness: " + plain(traceback.format_exc()), None
        return out if quiet else self._say(out, task)

    def _run(self, out, key, task, limit):
        engine = out.engine
        out.path = self.folder / "runs" / f"{task.case}.{task.variant}.{engine}.{key}.h5"
        if (not self.fresh or key in self.made) and out.is_whole(key):
            out.kept = key not in self.made
            return
        if engine == concordem.NAME and task.peer:
            theirs = self.one(copy.copy(task), task.peer, limit, quiet=True)
            if theirs.status != "done":
                out.status, out.message, out.path = theirs.status, f"no state of {task.peer}: {theirs.message}", None
                return
            task.frozen = theirs.result()
        elif engine != concordem.NAME and task.peer_scenario:
            task.scenario = task.peer_scenario
        about = dict(key=key, case_hash=case_hash(task), harness_hash=harness_hash(), start_hash=_hash_of(task.start))
        scratch = Path(tempfile.mkdtemp(prefix=f"concordem-{engine}-"))
        try:
            result = registry.ENGINES[engine].run(task, scratch, limit * self.time_factor)
            if not isinstance(result, Result):
                place = f"{task.folder / 'case.py'}: `analytic`" if engine == "analytic" else f"the function `run` of {engine}"
                raise HarnessError(f"{place} returned {type(result).__name__}; return a Result")
        except BaseException as error:
            # its output helps to find the cause
            keep = self.folder / "failed" / f"{task.case}.{task.variant}.{engine}"
            _keep(scratch, keep)
            if isinstance(error, HarnessError):
                # the message names what is still there
                error.args = (str(error).replace(str(scratch), str(keep)), *error.args[1:])
            raise
        finally:
            shutil.rmtree(scratch, ignore_errors=True)
        result.provenance.update(
            **about, engine_version=self.version(engine), host=platform.platform(), processor=provenance.processor(),
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

    def run(self, cases, plant=None, added=()):
        """All engines on all variants, then all checks. `added`: engines that the cases do not name."""
        plant = plant or {}
        round_ = Round()
        jobs = []
        for case in cases:
            for task in case.tasks:
                task.plant = plant
                for engine in dict.fromkeys([case.reference, *case.engines_of[task.variant]]):
                    jobs.append((case, task, engine))
        self.done, self.total = 0, len(jobs)
        # in the order of cases: readable, and hardly slower than starting with the longest
        with ThreadPoolExecutor(self.jobs) as pool:
            outcomes = pool.map(lambda job: self.one(copy.copy(job[1]), job[2], job[0].time_limit, added=job[2] in added), jobs)
            for outcome in outcomes:
                round_.outcomes[outcome.case, outcome.variant, outcome.engine] = outcome
        for case in cases:
            # after all runs, when nothing else runs
            round_.times |= timing.measure(self, case, round_.outcomes)
            round_.verdicts += compare.judge(case, round_.outcomes, plant, round_.times)
        round_.starts = self._starts(cases, round_)
        return round_

    def _starts(self, cases, round_):
        """Verdicts about the start states of all variants, and about the masses, radii, and steps of the engines."""
        out = []
        for case in cases:
            for task in case.tasks:
                own = round_.outcomes.get((task.case, task.variant, concordem.NAME))
                if task.command == "elastic" or not (own and own.status == "done" or (task.case, task.variant) in self.start_verdicts):
                    continue
                try:
                    start = self.start_of(copy.copy(task))
                except HarnessError as error:
                    out.append(compare.fail(compare.Verdict(task.case, task.variant, Check(**START), "fail"), error))
                    continue
                verdict = self.start_verdicts.get((task.case, task.variant))
                if verdict is None:
                    continue
                out.append(self._of_engines(verdict, task, start, round_))
        return out

    @staticmethod
    def _of_engines(verdict, task, start, round_):
        """The verdict, with what the engines say that they computed with."""
        said = []
        for (case, variant, engine), outcome in round_.outcomes.items() if verdict.status == "pass" and task.command == "run" else ():
            if (case, variant) == (task.case, task.variant) and outcome.status == "done" and "@" not in engine:
                try:
                    names = starts.compare_run(outcome.result(), start, task.scenario.get("dimension", 3) == 2)
                    said += [f"{engine} has the same {', '.join(names)}"] if names else []
                except HarnessError as error:
                    return compare.fail(verdict, error)
        verdict.message += "".join(f"; {text}" for text in said)
        return verdict


# of a failed run; a program may write until the disk is full
_MOST_KEPT = 100 << 20


def _keep(scratch, keep):
    """Copy the plain files of a failed run, the small ones first. Links may lead to anything, pipes wait for ever."""
    shutil.rmtree(keep, ignore_errors=True)
    keep.mkdir(parents=True, exist_ok=True)
    files, left = [], []
    for top, folders, names in os.walk(scratch):
        # MPI removes its own files meanwhile
        folders[:] = [name for name in folders if not name.startswith("ompi.")]
        for path in (Path(top, name) for name in [*names, *folders]):
            try:
                about = path.lstat()
            except OSError:
                continue
            if stat.S_ISREG(about.st_mode):
                files.append((about.st_size, path))
            elif not stat.S_ISDIR(about.st_mode):
                left.append(f"{path.relative_to(scratch)}: no plain file")
    room = _MOST_KEPT
    for size, path in sorted(files):
        place = keep / path.relative_to(scratch)
        try:
            if size > room:
                left.append(f"{path.relative_to(scratch)}: {size} bytes, more than is kept")
                continue
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, place, follow_symlinks=False)
            room -= size
        except OSError as error:
            left.append(f"{path.relative_to(scratch)}: {error.strerror}")
    if left:
        (keep / "left-out.txt").write_text("\n".join(left) + "\n", errors="replace")


def _jobs():
    """Number of parallel engines: one per processor, and at least one gigabyte of memory each."""
    try:
        with open("/proc/meminfo") as file:
            free = next(int(line.split()[1]) for line in file if line.startswith("MemAvailable")) / 2**20
    except (OSError, StopIteration):
        free = 4
    return max(1, min(os.cpu_count() or 1, int(free)))
