"""An engine of the user: any command that reads a task and writes a result.

The command gets the start state and the scenario in SI units (`{task}`, JSON; `{state}`, HDF5; `{scenario}`, the TOML as written), and
writes `{output}`: CSV with a row of units, or HDF5. It ends with 77 if it cannot compute the scenario.

For the self-check `restart`, `command` also writes `{checkpoint}`, from which the command `restart` continues.
"""
import copy
import hashlib
import json
import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import h5py

from .. import process, programs, scenario, selfcheck
from ..errors import Crashed, HarnessError, Incomparable, NotInstalled, Unsupported
from ..quantity import si
from ..result import Result
from . import translate

FORMAT = "concordem-validate task 1"
UNSUPPORTED = 77
_CHECKPOINT = "checkpoint"
# variables of the shell that choose what a program loads
_LOADING = ("LD_LIBRARY_PATH", "LD_PRELOAD", "PYTHONHOME", "PYTHONPATH")
_PLACES = ("{task}", "{state}", "{scenario}", "{output}", "{case}", "{checkpoint}")


class CommandEngine:
    """An engine given by `[engine.NAME]` in the user's `validate.toml`, whose folder is `home`."""

    def __init__(self, name, home, command, *, version=None, inputs=(), output="csv", environment=None, needs_start=True, restart=None):
        self.NAME, self.NEEDS_START = name, needs_start
        # several engines run at a time, so each gets one thread unless the user says otherwise
        self.home, self.output, self.environment = Path(home), output, {**process.ONE_THREAD, **(environment or {})}
        self.words, self.ask, self.again = (self._split(*one) for one in (("command", command), ("version", version), ("restart", restart)))
        self.inputs = self._texts("inputs", inputs)
        # what a call of the harness writes beside `validate.toml` is no input
        self.written = set()
        self._texts("environment", [*self.environment, *self.environment.values()])
        if not any("{output}" in word for word in self.words):
            raise HarnessError(f"engine `{name}`: `command` has no {{output}}; name the file that it writes")
        for key, words in (("command", self.words), ("restart", self.again)) if self.again else ():
            for place in ("{checkpoint}", "{output}"):
                if not any(place in word for word in words):
                    raise HarnessError(f"engine `{name}`: `{key}` has no {place}, which `restart` needs; name the file")

    def _split(self, key, command):
        """The words of a command; `None` without."""
        if command is None:
            return None
        try:
            words = shlex.split(command) if isinstance(command, str) else self._texts(key, command)
        except ValueError as error:
            raise HarnessError(f"engine `{self.NAME}`: `{key}` cannot be split into words: {error}; mend its quotation marks") from None
        if not words:
            raise HarnessError(f"engine `{self.NAME}`: `{key}` is empty; give the command")
        unknown = {place for word in words for place in re.findall(r"\{[a-z_]+\}", word)} - set(_PLACES)
        if unknown:
            raise HarnessError(f"engine `{self.NAME}`: `{key}` has {', '.join(sorted(unknown))}; use {', '.join(_PLACES)}")
        return words

    def _texts(self, key, values):
        wrong = next((v for v in values if not isinstance(v, str) or "\0" in v), None)
        if wrong is not None:
            raise HarnessError(f"engine `{self.NAME}`: `{key}` has {wrong!r}; give texts")
        return list(values)

    def _program(self):
        """The file of the first word: beside validate.toml, or in PATH."""
        own = self.home / self.words[0]
        found = str(own) if own.is_file() else shutil.which(self.words[0])
        if not found:
            raise NotInstalled(f"the program `{self.words[0]}` of engine `{self.NAME}` is missing; install it, or mend `command` in {self.home}/validate.toml")
        return Path(found).absolute()

    def _named(self):
        """Files and folders that the commands and variables name, also within a word such as `--config=FILE`, and programs by their names."""
        files, folders = {}, {}
        for word in [*self.words, *(self.again or []), *self.environment.values()]:
            for part in dict.fromkeys([word, *re.split(r"[\s=,:;'\"]+", word)]):
                if not part or "{" in part or part in (".", ".."):
                    continue
                own, program = self.home / part, shutil.which(part) if "/" not in part else None
                try:
                    if own.is_file() or program:
                        files[own if own.is_file() else Path(program)] = None
                    elif Path(part).is_absolute() and own.is_dir():
                        folders[own] = None
                except OSError:
                    continue  # too long for a name
        return list(files), list(folders)

    def _scripts(self, files):
        """Named files that a program reads; those among the programs of the system have no folder of their own."""
        programs_of = {Path(p).resolve() for p in os.environ.get("PATH", "").split(os.pathsep) if p}
        return [path for path in files if programs.is_script(path) and path.resolve().parent not in programs_of]

    def _imports(self, scripts):
        """What scripts and modules of Python import; every Python of the command is asked."""
        out = []
        for words in (self.words, *([self.again] if self.again else [])):
            for k, word in enumerate(words):
                python = str(self.home / word) if (self.home / word).is_file() else shutil.which(word)
                if python and re.fullmatch(r"(python|pypy)[\d.]*", Path(word).name):
                    modules = [b for a, b in zip(words[k + 1:], words[k + 2:]) if a == "-m"]
                    out += programs.imports(python, [p for p in scripts if p.suffix == ".py"], modules, self.environment)
        return out

    def _files(self):
        """Files that the command names, those of `inputs`, and what scripts import. Without `inputs` all files in the folders of scripts."""
        found, folders = self._named()
        scripts = self._scripts(found)
        for path in list(found):
            found += programs.loads(path)
        found += self._imports(scripts)
        folders += [place for path in scripts for place in {path.absolute().parent, path.resolve().parent}]
        for folder in [] if self.inputs else dict.fromkeys(folders):
            try:
                found += programs.tree(folder, {self.home / "validate.toml", *self.written})
            except programs.TooMany as many:
                raise HarnessError(f"{self.home}/validate.toml: engine `{self.NAME}`: {many}, which a run may depend on; name those that it reads in "
                                   "`inputs`") from None
        for pattern in self.inputs:
            try:
                matched = sorted(p for p in self.home.glob(pattern) if p.is_file())
            except (ValueError, NotImplementedError) as error:
                raise HarnessError(f"{self.home}/validate.toml: engine `{self.NAME}`: `inputs` has {pattern!r}: {error}; mend it") from None
            if not matched:
                raise HarnessError(f"{self.home}/validate.toml: engine `{self.NAME}`: no file matches `{pattern}` of `inputs`; mend it")
            found += matched
        return found

    def version(self):
        """Hash of the program, of the files that it depends on, and of the words of its table; and what the program says of itself."""
        table = [self.words, self.again, self.output, self.NEEDS_START, sorted(self.environment.items()), [os.environ.get(name) for name in _LOADING]]
        words = hashlib.sha256(json.dumps(table).encode()).hexdigest()[:16]
        text = f"{self.NAME} sha256 {programs.identity(self._program(), self._files())} command {words}"
        if self.ask:
            try:
                said = subprocess.run(self._command(self.ask, {}), cwd=self.home, capture_output=True, text=True, errors="replace", timeout=60)
            except (OSError, subprocess.TimeoutExpired) as error:
                raise NotInstalled(f"`{' '.join(self.ask)}` of engine `{self.NAME}` cannot be run: {error}; mend `version` in "
                                   f"{self.home}/validate.toml") from None
            if said.returncode:
                raise NotInstalled(f"{self.home}/validate.toml: `{' '.join(self.ask)}` of engine `{self.NAME}` ends with {said.returncode}; mend `version`")
            text += f", {said.stdout.strip()[:200]}"
        return text

    def same_as(self):
        """What two engines share that are one program: the contents of their scripts and of what these import, and all other words."""
        files, _ = self._named()
        scripts = self._scripts(files)
        local = [p for p in self._imports(scripts) if p.is_file()]
        content = [programs.meaning(p) for p in scripts] or [programs.identity(self._program())]
        names = {word for word in self.words if (self.home / word).is_file() or "/" not in word and shutil.which(word)}
        other = [programs.digest(p) for p in files if p not in scripts and not (p.stat().st_mode & 0o111)]
        inputs = {programs.meaning(p) for pattern in self.inputs for p in self.home.glob(pattern) if p.is_file()} - set(content)
        return (*content, *sorted(map(programs.meaning, local)), *other, *sorted(inputs), *(word for word in self.words if word not in names),
                *sorted(self.environment.items()))

    def _command(self, words, places):
        # a link is what a virtual environment knows itself by, so it stays one
        beside = self.home / words[0]
        out = [str(self._program()) if words[0] == self.words[0] else str(beside.absolute()) if beside.is_file() else words[0]]
        for word in words[1:]:
            own = self.home / word
            for place, path in places.items():
                word = word.replace(place, str(path))
            out.append(str(own.absolute()) if own.is_file() else word)
        return out

    def run(self, task, folder, limit):
        return self._once(self.words, task, folder, limit)

    def run_in_two(self, task, folder, limit):
        """Half of the run, then the rest by the command `restart`, which gets the file that the first has written."""
        if not self.again:
            raise Unsupported(f"engine `{self.NAME}` has no command `restart`; add it to validate.toml, or leave `{self.NAME}@restart` out")
        half, first = selfcheck.half_of(task), copy.copy(task)
        first.scenario = {**copy.deepcopy(task.scenario), "stop": {"steps": half}}
        places = [folder / name for name in ("first", "second")]
        for place in places:
            place.mkdir()
        before = self._once(self.words, first, places[0], limit)
        checkpoint = places[0] / _CHECKPOINT
        if not checkpoint.exists():
            raise Crashed(f"{self.NAME} ended without writing {{checkpoint}}, {checkpoint.name}; mend `command`")
        shutil.copy(checkpoint, places[1] / _CHECKPOINT)
        return selfcheck.joined(before, self._once(self.again, task, places[1], limit), half)

    def _once(self, words, task, folder, limit):
        places = dict(zip(_PLACES, (folder / "task.json", folder / "state.h5", folder / "scenario.toml",
                                    folder / f"result.{'csv' if self.output == 'csv' else 'h5'}", task.folder, folder / _CHECKPOINT)))
        steps = self._write(task, places)
        command = self._command(words, places)
        _, wall = process.run(command, folder, limit, self.environment, refusal=UNSUPPORTED)
        output = places["{output}"]
        if not os.path.lexists(output):
            raise Crashed(f"{self.NAME} ended without writing {output.name}. {process.tail(folder / 'log.txt')}")
        if output.is_symlink():
            # the file behind it may be of another run
            raise Incomparable("error", f"{output} is a link to {os.readlink(output)}; write the file itself")
        result = Result.read(output, task.start.dt if task.start else None)
        if "measures" in result.numbers:
            raise Incomparable("error", f"{output} has the number `measures`, which is of closed forms and tables; `case.py` computes those of {self.NAME}")
        if not result.series and not result.numbers:
            raise Incomparable("empty", f"{self.NAME} wrote a result without series and numbers")
        result.engine = self.NAME
        result.numbers.setdefault("wall_s", wall)
        if steps:
            result.numbers.setdefault("steps", steps)
        result.provenance["command"] = " ".join(words)
        return result

    def _write(self, task, places):
        """The task as JSON, HDF5, and TOML; returns the number of steps, if the scenario gives it."""
        data = task_data(task)
        places["{task}"].write_text(json.dumps(data, indent=1))
        places["{scenario}"].write_text(scenario.dumps(task.scenario))
        if task.start is not None:
            write_state(places["{state}"], data)
        return data["steps"]


def task_data(task):
    """What an engine needs, in SI units. Format: docs/book/reference/harness.md."""
    document, start = task.scenario, task.start
    output = document.get("output", {})
    data = {"format": FORMAT, "case": task.case, "variant": task.variant, "scenario": in_si(document), "time_step": None, "steps": None,
            "sample_interval": output.get("sample_interval", 10), "snapshot_interval": output.get("snapshot_interval")}
    if start is None:
        return data
    try:
        data["steps"] = translate.steps_of(document, start.dt)
    except Unsupported:
        pass
    fixed, velocity, spin = translate.prescribed(document, start)
    force, moment = translate.forces(document, start)
    data.update(
        time_step=start.dt, position=start.position.tolist(), velocity=velocity.tolist(), angular_velocity=spin.tolist(),
        radius=start.radius.tolist(), mass=start.mass.tolist(), inertia=start.inertia(document.get("dimension", 3) == 2).tolist(),
        material=start.material.tolist(), fixed=["".join(sorted(f)) for f in fixed], force=force.tolist(), moment=moment.tolist(),
        bonds=start.bonds.tolist(), bond_length=start.reference_length.tolist(), cell=start.cell.tolist())
    return data


_ARRAYS = {"position": "m", "velocity": "m/s", "angular_velocity": "rad/s", "radius": "m", "mass": "kg", "inertia": "kg*m^2", "material": "1",
           "force": "N", "moment": "N*m", "bonds": "1", "bond_length": "m", "cell": "m"}


def write_state(path, data):
    """The arrays of a task as HDF5; the rest as JSON in the attribute `task`."""
    with h5py.File(path, "w") as file:
        file.attrs["format"] = FORMAT
        for name, unit in _ARRAYS.items():
            file.create_dataset(name, data=data[name]).attrs["unit"] = unit
        file.attrs["task"] = json.dumps({k: v for k, v in data.items() if k not in _ARRAYS})


def in_si(value):
    """A scenario whose quantities are numbers in SI units; other texts stay."""
    if isinstance(value, dict):
        return {key: in_si(item) for key, item in value.items()}
    if isinstance(value, list):
        return [in_si(item) for item in value]
    if isinstance(value, str):
        try:
            return si(value)
        except HarnessError:
            return value
    return value
