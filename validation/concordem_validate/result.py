"""Result of an engine, in one format for all engines: HDF5 with units.

A result has series, each on a grid of steps (`samples`: forces and curves, `snapshots`: all particles), fields of the
particles that do not change, plain numbers, and its provenance.

Conventions for all engines: SI; tension positive; `position` of step k belongs to time k·dt; `velocity` of step k is the one that the
scheme has at that time (leapfrog: that of step k − ½, see the attribute `velocity_at`); forces of a record of step k belong to the
positions of step k; the force of a contact is the one on the particle with the lower id.
"""
import json
from dataclasses import dataclass, field

import h5py
import numpy as np


@dataclass
class Series:
    """Values of one quantity at its steps."""

    steps: np.ndarray
    values: np.ndarray
    unit: str
    description: str = ""


@dataclass
class Result:
    engine: str
    dt: float
    series: dict = field(default_factory=dict)
    fields: dict = field(default_factory=dict)
    numbers: dict = field(default_factory=dict)
    provenance: dict = field(default_factory=dict)

    def add(self, name, steps, values, unit, description=""):
        steps, values = np.asarray(steps, dtype=np.int64), np.asarray(values, dtype=float)
        if len(steps) != len(values):
            raise ValueError(f"{name}: {len(steps)} steps, {len(values)} values")
        self.series[name] = Series(steps, values, unit, description)

    def time(self, name):
        return self.series[name].steps * self.dt

    def write(self, path):
        partial = path.with_suffix(".part")
        with h5py.File(partial, "w", locking=False) as file:
            file.attrs["format"] = "concordem-validate result 1"
            file.attrs["engine"] = self.engine
            file.attrs["time_step_s"] = self.dt
            for name, one in self.series.items():
                group = file.create_group(f"series/{name}")
                group.create_dataset("step", data=one.steps)
                values = group.create_dataset("values", data=one.values, compression="gzip")
                values.attrs.update(unit=one.unit, description=one.description)
                group.create_dataset("time", data=one.steps * self.dt).attrs["unit"] = "s"
            for name, (values, unit) in self.fields.items():
                file.create_dataset(f"fields/{name}", data=values).attrs["unit"] = unit
            file.create_group("provenance").attrs.update({k: str(v) for k, v in self.provenance.items()})
            file.attrs["numbers"] = json.dumps(self.numbers)
        partial.replace(path)

    @classmethod
    def read(cls, path):
        with h5py.File(path, "r", locking=False) as file:
            result = cls(str(file.attrs["engine"]), float(file.attrs["time_step_s"]))
            for name, group in file.get("series", {}).items():
                values = group["values"]
                result.series[name] = Series(
                    group["step"][()], values[()], str(values.attrs["unit"]), str(values.attrs["description"]))
            def take(name, one):
                if isinstance(one, h5py.Dataset):
                    result.fields[name] = (one[()], str(one.attrs["unit"]))

            if "fields" in file:
                file["fields"].visititems(take)
            result.numbers = json.loads(file.attrs["numbers"])
            result.provenance = {k: str(v) for k, v in file["provenance"].attrs.items()}
        return result
