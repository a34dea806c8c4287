"""Result of an engine, in one format for all engines: HDF5 with units, or CSV with a row of units.

A result has series, each on a grid of steps (`samples`: forces and curves, `snapshots`: all particles), fields of the
particles that do not change, plain numbers, and its provenance.

Conventions for all engines: SI; tension positive; `position` of step k belongs to time k·dt; `velocity` of step k is the one that the
scheme has at that time (leapfrog: that of step k − ½, see the attribute `velocity_at`); forces of a record of step k belong to the
positions of step k; the force of a contact is the one on the particle with the lower id.
"""
import csv
import difflib
import hashlib
import json
import math
import os
import re
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

from .errors import HarnessError, Incomparable
from .quantity import base, si

FORMAT = "concordem-validate result 1"
_AXES = "xyz"


@dataclass
class Series:
    """Values of one quantity at its steps. Codes without a fixed step give times instead."""

    steps: np.ndarray
    values: np.ndarray
    unit: str
    description: str = ""
    times: np.ndarray = None


@dataclass
class Result:
    engine: str
    dt: float
    series: dict = field(default_factory=dict)
    fields: dict = field(default_factory=dict)
    numbers: dict = field(default_factory=dict)
    provenance: dict = field(default_factory=dict)

    def add(self, name, steps, values, unit, description="", times=None):
        steps, values = np.asarray(steps, dtype=np.int64), np.asarray(values, dtype=float)
        if len(steps) != len(values):
            raise ValueError(f"{name}: {len(steps)} steps, {len(values)} values")
        self.series[name] = Series(steps, values, unit, description, times)

    def time(self, name):
        one = self.series[name]
        return one.steps * self.dt if one.times is None else one.times

    def write(self, path):
        # a name of its own, because rounds may share a folder
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", suffix=".part", delete=False) as place:
            partial = Path(place.name)
        with h5py.File(partial, "w", locking=False) as file:
            file.attrs["format"] = FORMAT
            file.attrs["engine"] = self.engine
            file.attrs["time_step_s"] = self.dt
            for name, one in self.series.items():
                group = file.create_group(f"series/{name}")
                group.create_dataset("step", data=one.steps)
                values = group.create_dataset("values", data=one.values, compression="gzip")
                values.attrs.update(unit=one.unit, description=one.description)
                group.create_dataset("time", data=self.time(name)).attrs["unit"] = "s"
            for name, (values, unit) in self.fields.items():
                file.create_dataset(f"fields/{name}", data=values).attrs["unit"] = unit
            file.create_group("provenance").attrs.update({k: str(v) for k, v in self.provenance.items()})
            file.attrs["numbers"] = json.dumps(self.numbers)
        with open(partial, "rb+") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
            file.seek(0, os.SEEK_END)
            file.write(_SEAL + digest.encode())
        partial.chmod(0o644)
        partial.replace(path)

    @classmethod
    def read(cls, path, dt=None):
        """The result in a file; `dt` is the time step of a CSV file that has a column `step` and no `time`."""
        path = Path(path)
        if path.exists() and not path.is_file():
            # a pipe would wait for ever
            raise Incomparable("error", f"{path} is no plain file; write a file")
        if path.suffix.lower() == ".csv":
            return _read_csv(cls, path, dt)
        check_seal(path)
        try:
            return _read_hdf5(cls, path)
        except KeyError as error:
            raise Incomparable("error", f"{path} is no result of the harness: {error.args[0]}; write the format `{FORMAT}`") from None
        except HarnessError:
            raise
        except Exception as error:  # the library raises many kinds for damaged files
            error = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise Incomparable("error", f"{path} cannot be read ({error}); it is damaged, or neither HDF5 nor CSV") from None


# What we write ends with a hash of all before it, which HDF5 does not read: a damaged file can give other numbers, or hang the library.
_SEAL = b"sha256:"


def check_seal(path, needed=False):
    """Hash of a file of ours; refuses one that is not what was written. Files of other programs have no seal, those of a round need one."""
    size = len(_SEAL) + 64
    try:
        with open(path, "rb") as file:
            file.seek(0, os.SEEK_END)
            body = file.tell() - size
            file.seek(max(body, 0))
            tail = file.read(size)
            if body < 0 or not tail.startswith(_SEAL):
                if needed:
                    raise Incomparable("error", f"{path} has no hash at its end: it is damaged, or was changed by another program; make it again")
                return None
            file.seek(0)
            one = hashlib.sha256()
            while body:
                part = file.read(min(body, 1 << 20))
                one.update(part)
                body -= len(part)
    except OSError:
        return None  # the reader says it better
    if one.hexdigest().encode() != tail[len(_SEAL):]:
        raise Incomparable("error", f"{path} is not what was written: it is damaged, or was changed; make it again")
    return tail[len(_SEAL):].decode()


def _own(path, file):
    """Refuse data of other files, which may be of another run."""
    def walk(group):
        for name in group:
            link = group.get(name, getlink=True)
            if isinstance(link, h5py.ExternalLink):
                raise Incomparable("error", f"{path}: `{group.name}/{name}` is a link to another file; write the values themselves")
            one = group.get(name)
            if isinstance(one, h5py.Dataset) and (one.external or one.is_virtual):
                raise Incomparable("error", f"{path}: the values of `{one.name}` are in another file; write them into this one")
            if isinstance(one, h5py.Group) and not isinstance(link, h5py.SoftLink):
                walk(one)
    walk(file)


def _read_hdf5(cls, path):
    with h5py.File(path, "r", locking=False) as file:
        if file.attrs["format"] != FORMAT:
            raise Incomparable("error", f"{path} has the format {str(file.attrs['format'])!r}, this version reads {FORMAT!r}; write that")
        _own(path, file)
        result = cls(str(file.attrs["engine"]), float(file.attrs["time_step_s"]))
        for name, group in file.get("series", {}).items():
            values, steps = group["values"], group["step"][()]
            times = group["time"][()] if "time" in group else None
            if times is not None and np.array_equal(times, steps * result.dt):
                times = None
            if "unit" not in values.attrs:
                raise Incomparable("error", f"{path}: series `{name}` has no attribute `unit`; add it, `1` for a plain number")
            if len(steps) != len(values):
                raise Incomparable("error", f"{path}: series `{name}` has {len(steps)} steps and {len(values)} values")
            result.series[name] = Series(
                steps, values[()].astype(float), str(values.attrs["unit"]), str(values.attrs.get("description", "")), times)

        def take(name, one):
            if isinstance(one, h5py.Dataset):
                result.fields[name] = (one[()], str(one.attrs["unit"]))

        if "fields" in file:
            file["fields"].visititems(take)
        result.numbers = json.loads(file.attrs.get("numbers", "{}"))
        if "provenance" in file:
            result.provenance = {k: str(v) for k, v in file["provenance"].attrs.items()}
    return result


def _read_csv(cls, path, dt):
    """Columns by a row of names and a row of units: `time` or `step`; `force`; `force.x`; `position.0.x` of particle 0."""
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            rows = [(number, row) for number, row in enumerate(csv.reader(file), 1) if row and not row[0].lstrip().startswith("#")]
    except UnicodeDecodeError as error:
        raise Incomparable("error", f"{path} is not UTF-8 ({error.reason} at byte {error.start}); write text in UTF-8") from None
    except csv.Error as error:
        raise Incomparable("error", f"{path} is no table of numbers: {error}; separate columns by commas, and rows by ends of lines") from None
    if len(rows) < 3:
        raise Incomparable("empty", f"{path} has no numbers; it needs a row of names, a row of units, and rows of numbers")
    (_, names), (line, units), *body = rows
    names, units = [n.strip() for n in names], [u.strip() for u in units]
    if len(units) != len(names) or all(_is_number(u) for u in units):
        raise Incomparable("error", f"{path}:{line}: the second row must give a unit for each of the {len(names)} columns, "
                                    "`1` for a plain number")
    table = np.empty((len(body), len(names)))
    for k, (line, row) in enumerate(body):
        if len(row) != len(names):
            raise Incomparable("error", f"{path}:{line}: {len(row)} values for {len(names)} columns; the file is cut off, or a comma is missing")
        for c, word in enumerate(row):
            try:
                # other programs than Python read no other digits, and no 1_000
                table[k, c] = float(word if word.isascii() and "_" not in word else "no number")
            except ValueError:
                raise Incomparable("error", f"{path}:{line}: `{word}` in column `{names[c]}` is not a number") from None
    columns = {}
    for c, (name, unit) in enumerate(zip(names, units)):
        # a misspelled axis would be a series, and its steps would be counted
        meant = difflib.get_close_matches(name, ("step", "time"), 1, 0.75) if name not in ("step", "time") else []
        if not name or meant:
            raise Incomparable("error", f"{path}: column {c + 1} is called `{name}`; {f'did you mean {meant[0]}?' if meant else 'give it a name'}")
        if name in columns:
            raise Incomparable("error", f"{path}: column `{name}` appears twice; rename one")
        try:
            size = 1.0 if unit in ("", "1") else si(f"1 {unit}")
        except HarnessError as error:
            raise Incomparable("error", f"{path}: column `{name}`: {error}") from None
        if unit == "":
            raise Incomparable("error", f"{path}: column `{name}` has no unit; give one, `1` for a plain number")
        columns[name] = (table[:, c] * size, base(unit))
    return _assembled(cls, path, columns, dt)


def _is_number(word):
    try:
        return word != "1" and math.isfinite(float(word))
    except ValueError:
        return False


def _in_step(path, time, step, dt):
    """Refuse steps and times that contradict each other; codes with a step of their own leave the column `step` out."""
    if dt is None or not dt > 0 or not np.isfinite(time).all():
        return
    wanted = step * dt
    # times may be printed with six digits
    off = np.abs(time - wanted) - 0.01 * dt - 2e-6 * np.abs(wanted).max()
    if off.max() > 0:
        k = int(off.argmax())
        raise Incomparable("error", f"{path}: step {step[k]:.0f} has the time {time[k]:.9g} s, but {wanted[k]:.9g} s by the time step {dt:.9g} s; "
                                    "mend one, or leave `step` out")


def _assembled(cls, path, columns, dt):
    """Series from columns: parts such as `.0.x` become axes of an array."""
    (time, unit), (step, _) = columns.pop("time", (None, "s")), columns.pop("step", (None, "1"))
    if unit != "s":
        raise Incomparable("error", f"{path}: column `time` has the unit {unit}; give a time, such as s or ms")
    if time is None and step is None:
        raise Incomparable("error", f"{path} has neither a column `time` nor `step`; add one")
    if step is None:
        step = np.arange(len(time))
    if not np.isfinite(step).all() or (step != np.round(step)).any():
        raise Incomparable("error", f"{path}: column `step` has values that are not whole numbers")
    if time is not None:
        _in_step(path, time, step, dt)
    result = cls(path.stem, math.nan if dt is None else dt)
    if time is None and dt is None:
        result.dt = 1.0
        result.provenance["time_step"] = "unknown: the file has steps and no times"
    groups = {}
    for name, (values, unit) in columns.items():
        series, *parts = name.split(".")
        axis = parts.pop() if parts and parts[-1] in tuple(_AXES) else None
        if len(parts) == 1 and parts[0].isnumeric() and not re.fullmatch("0|[1-9][0-9]*", parts[0], re.ASCII):
            raise Incomparable("error", f"{path}: `{parts[0]}` in column `{name}` is no id of a particle; write 0, 1, 2, …")
        if parts and not (len(parts) == 1 and parts[0].isnumeric()):
            series, parts = ".".join([series, *parts]), []
        groups.setdefault(series, {})[int(parts[0]) if parts else None, axis] = (values, unit)
    for series, members in groups.items():
        ids, axes = sorted({i for i, _ in members} - {None}), sorted({a for _, a in members} - {None})
        wanted = [(i, a) for i in (ids or [None]) for a in (axes or [None])]
        if set(wanted) != set(members) or len({unit for _, unit in members.values()}) > 1 or ids != list(range(len(ids))) \
                or axes not in ([], ["x", "y", "z"], ["x", "y"]):
            raise Incomparable("error", f"{path}: the columns of `{series}` are not whole: give ids 0, 1, …, each with x, y, z, and one unit")
        values = np.stack([members[key][0] for key in wanted], axis=1)
        shape = [len(step), *([len(ids)] if ids else []), *([len(axes)] if axes else [])]
        if axes == ["x", "y"]:
            values, shape[-1] = np.insert(values.reshape(*shape), 2, 0.0, axis=-1), 3
        result.add(series, step, values.reshape(shape), next(iter(members.values()))[1], "", time)
    return result
