#!/usr/bin/env python3
"""Posteriors of materials with known parameters: how often do intervals of 90 % hold the truth?

    validation/posteriors.py [--full | --table]

For each material, `concordem sweep` computes an ensemble, and runs of fifty other materials with other packings. Each of these gives
measured curves with noise, and `concordem.inference` the intervals of its parameters. Results are written to
validation/results/posteriors.json after every material. Without --full, a smaller ensemble of the first material runs with the same
code, and the figures on record are checked.
"""

import subprocess
import sys
import tempfile
import time
import tomllib
import warnings
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import h5py
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from concordem_validate import scenario, study as studies

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "target/release/concordem"
TEMPLATES = ROOT / "rust-core/scenario/src/schema/templates"
RESULTS = ROOT / "validation/results/posteriors.json"

TRIALS = 50
#: Seeds of the packings: those of an ensemble, then those of the measured specimens. All trials share the ensemble's packings, whose mean is not that
#: of all; more of them, and another packing for each specimen, make the trials nearly independent.
PACKINGS, OTHERS = range(1, 9), 101
#: Share of the range from which an interval of 90 % says nothing; it is 0.9 if all values are equally probable.
WIDE = 0.85
#: Of the largest measured value: noise of each point. Machines reach 1 % (ISO 7500-1, class 1).
NOISE = 0.01


@dataclass(frozen=True)
class Test:
    """One test of a laboratory: its scenario, curves by name (abscissa, ordinate, end), and numbers."""

    document: dict
    curves: dict
    numbers: tuple = ()


@dataclass(frozen=True)
class Material:
    """Ranges of the parameters by key, tests, and points of the ensemble."""

    ranges: dict
    tests: dict
    count: int
    #: Parameters that the curves need not determine.
    loose: tuple = field(default=())


def with_template(name, **changes):
    """A template; keys of `changes` have two underscores for a dot."""
    document = tomllib.loads((TEMPLATES / f"{name}.toml").read_text())
    return scenario.changed(document, {key.replace("__", "."): value for key, value in changes.items()})


def free_cell(document, rate, strain):
    """Of a periodic cell: uniaxial stress along z."""
    zero = [["0 Pa"] * 3] * 3
    loading = {"kind": "cell-stress", "stress": zero, "strain_rate": ["free", "free", f"{rate} 1/s"], "maximum_strain_rate": "100 1/s"}
    sample = [{"operator": "cell-strain", "name": "cell", "interval": 10}]
    return scenario.changed(document, {"loading": loading, "stop": {"strain": strain}, "output": {"sample_interval": 10}, "sample": sample})


def elastic():
    cell = free_cell(with_template("cpm-periodic", packing__count=100, material__0__cpm__never_damage=True), 1, 1.05e-4)
    curves = {"stress": ("strain", "stress", 1e-4), "lateral strain": ("strain", "cell gradient_xx", 1e-4)}
    return Material({"material[0].cpm.young": (15e9, 30e9), "material[0].cpm.shear_ratio": (0.05, 0.5)}, {"cell": Test(cell, curves)}, 32)


def glass():
    shape = {"kind": "cylinder", "radius": "5 mm", "height": "20 mm", "axis": "x"}
    bar = with_template("beam-tension", packing__count=300, packing__shape=shape, loading__strain_rate="4 1/s",
                        stop={"strain": 1.6e-3, "drop_to": 0.5}, output={"sample_interval": 10})
    # Before any specimen breaks; its strength is the largest stress.
    test = Test(bar, {"stress": ("strain", "stress", 3e-4)}, ("f_t",))
    return Material({"material[0].cohesive_beam.young": (200e9, 400e9), "material[0].cohesive_beam.tensile_strength": (200e6, 400e6)}, {"tension": test}, 40)


def prism(law, parameters, rate, stop):
    """A box of some hundred and fifty spheres, compressed or pulled along z."""
    return {
        "version": 1,
        "packing": {"kind": "random-dense", "count": 200, "radius": "1 mm", "seed": 1, "shape": {"kind": "box", "size": ["8 mm", "8 mm", "16 mm"]}},
        "material": [{"name": "material", "density": 4800, law: parameters}],
        "bonds": {"law": law, "interaction_ratio": 1.5}, "contacts": {"law": law},
        "integration": {"damping": {"kind": "local", "coefficient": 0.3}},
        "loading": {"kind": "uniaxial", "axis": "z", "strain_rate": f"{rate} 1/s", "lateral": "free"},
        "stop": stop, "output": {"sample_interval": 10},
        "sample": [{"operator": "affine-strain", "name": "middle", "interval": 10,
                    "region": {"kind": "box", "minimum": ["-5 mm", "-5 mm", "-4 mm"], "maximum": ["5 mm", "5 mm", "4 mm"]}}],
    }


def rock():
    law = {"young": "20 GPa", "stiffness_ratio": 0.3, "tensile_strength": "10 MPa", "cohesion": "40 MPa", "friction_angle": "30 deg"}
    pulled = Test(prism("jointed", law, 4, {"strain": 3e-3, "drop_to": 0.5}), {"tension": ("strain", "stress", 1.5e-4)}, ("f_t",))
    curves = {"compression": ("strain", "stress", -8e-4), "lateral strain": ("strain", "middle gradient_xx", -8e-4)}
    pressed = Test(prism("jointed", law, -8, {"strain": 2e-2, "drop_to": 0.6}), curves, ("f_c",))
    ranges = {"young": (15e9, 30e9), "stiffness_ratio": (0.15, 0.6), "tensile_strength": (6e6, 15e6), "cohesion": (20e6, 60e6)}
    return Material({f"material[0].jointed.{key}": given for key, given in ranges.items()}, {"pulled": pulled, "pressed": pressed}, 48, ("cohesion",))


def concrete():
    law = {"young": "25 GPa", "shear_ratio": 0.2, "crack_onset_strain": 1e-4, "relative_ductility": 20, "cohesion": "3 MPa", "friction_coefficient": 0.8}
    pulled = Test(prism("cpm", law, 3, {"strain": 1.3e-3}), {"tension": ("strain", "stress", 1.2e-3)})
    curves = {"compression": ("strain", "stress", -2.4e-3), "lateral strain": ("strain", "middle gradient_xx", -8e-4)}
    pressed = Test(prism("cpm", law, -8, {"strain": 2.5e-3}), curves)
    ranges = {"young": (20e9, 35e9), "shear_ratio": (0.1, 0.5), "crack_onset_strain": (7e-5, 1.5e-4), "relative_ductility": (8, 40, "logarithmic"),
              "cohesion": (2e6, 8e6)}
    return Material({f"material[0].cpm.{key}": given for key, given in ranges.items()}, {"pulled": pulled, "pressed": pressed}, 64, ("cohesion",))


MATERIALS = {"elastic constants": elastic, "glass beams": glass, "jointed rock": rock, "concrete": concrete}


def name_of(key):
    return key.rpartition(".")[2]


def sweep(program, folder, name, test, axes, **tables):
    """Runs one sweep; returns its result."""
    (folder / f"{name}-scenario.toml").write_text(scenario.dumps(test.document))
    curves = [{"name": label, "x": x, "y": y, "from": 0, "to": end, "count": 41} for label, (x, y, end) in test.curves.items()]
    document = {"version": 1, "scenario": f"{name}-scenario.toml", "study": "run", "results": list(test.numbers) or ["last broken"],
                "axis": axes, "curve": curves, **tables}
    (folder / f"{name}.toml").write_text(scenario.dumps(document))
    subprocess.run([program, "sweep", folder / f"{name}.toml", "-q"], check=True, stdout=subprocess.DEVNULL)
    return folder / f"{name}.h5"


def ensemble(program, folder, material, count, packings):
    from concordem.inference import Ensemble

    axes = [{"name": name_of(key), "key": key, (given[2] if len(given) > 2 else "linear"): {"from": given[0], "to": given[1]}}
            for key, given in material.ranges.items()]
    axes.append({"key": "packing.seed", "values": list(packings)})
    sampling = {"method": "sobol", "count": count}
    return Ensemble.from_sweep(*(sweep(program, folder, name, test, axes, sampling=sampling) for name, test in material.tests.items()))


def others(program, folder, material, parameters, trials):
    """Values of the parameters of other specimens, (trials, d), and what their tests gave, by name: (x, (trials, m)), x is None of numbers."""
    draw = np.random.default_rng(7)
    # The inner four fifths of the ranges: at the ends, intervals are cut.
    truth = np.array([[float(one.from_unit(draw.uniform(0.1, 0.9))) for one in parameters] for _ in range(trials)])
    rows = [[*map(float, row), OTHERS + k] for k, row in enumerate(truth)]
    axes = [{"name": "specimen", "keys": [*material.ranges, "packing.seed"], "values": rows}]
    measured = {}
    for name, test in material.tests.items():
        with h5py.File(sweep(program, folder, f"{name}-others", test, axes)) as file:
            measured |= {label: (file[f"curves/{label}/x"][()], file[f"curves/{label}/y"][()]) for label in test.curves}
            measured |= {label: (None, file[f"points/{label}"][()][:, None]) for label in test.numbers}
    return truth, measured


def intervals(runs, truth, measured, k):
    """Posterior of one specimen whose curves have noise: what holds the truth, widths over the ranges, and warnings."""
    from concordem.inference import Curve, posterior

    draw = np.random.default_rng(k)
    given, noise = {}, {}
    for label, (x, values) in measured.items():
        size = NOISE * np.abs(values[k]).max()
        noisy = values[k] + draw.normal(0.0, size, values.shape[1])
        given[label], noise[label] = (noisy[0] if x is None else Curve(x, noisy)), size
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = posterior(runs, given, noise=noise, seed=k, draws=200)
    ends = found.interval(0.9)
    holds = [ends[one.name][0] <= value <= ends[one.name][1] for one, value in zip(runs.parameters, truth[k], strict=True)]
    widths = [float(np.ptp(one.to_unit(ends[one.name]))) for one in runs.parameters]
    return holds, widths, found.warnings


def tested(program, folder, material, count, packings, trials):
    """Frequencies with which intervals of 90 % hold the truth."""
    begin = time.monotonic()
    runs = ensemble(program, folder, material, count, packings)
    truth, measured = others(program, folder, material, runs.parameters, trials)
    computed = time.monotonic()
    found = [intervals(runs, truth, measured, k) for k in range(trials)]
    share = np.mean([holds for holds, _, _ in found], axis=0)
    width = np.mean([widths for _, widths, _ in found], axis=0)
    parameters = {}
    for k, one in enumerate(runs.parameters):
        told = [any(f"'{one.name}'" in text for text in notes) for _, _, notes in found]
        silent = sum(widths[k] > WIDE and not said for (_, widths, _), said in zip(found, told, strict=True))
        parameters[one.name] = {"holds": float(share[k]), "width": float(width[k]), "warned": sum(told), "wide_without_warning": silent}
    return {
        "runs": len(material.tests) * (count * len(packings) + trials), "trials": trials, "packings": len(packings),
        "parameters": parameters,
        "warnings": sorted({text.partition(":")[0] for _, _, notes in found for text in notes}),
        "runs_s": round(computed - begin, 1), "posteriors_s": round(time.monotonic() - computed, 1),
    }


def full(known, save, about, program, options):
    for name, material in MATERIALS.items():
        if name not in known:
            with tempfile.TemporaryDirectory() as folder:
                made = material()
                known[name] = tested(program, Path(folder), made, made.count, PACKINGS, TRIALS) | about
            save()
            print(f"{name}: {known[name]}", flush=True)


def reduced(known, save, about, program, options):
    with tempfile.TemporaryDirectory() as folder:
        known["reduced"] = tested(program, Path(folder), elastic(), 10, PACKINGS[:3], 4) | about


def failures(name, found, loose=()):
    wrong = []
    for parameter, values in found["parameters"].items():
        # Of 50 intervals of 90 %, fewer than 40 hold the truth once in a hundred times.
        if not 0.8 <= values["holds"] <= 1.0:
            wrong.append(f"{name}: intervals of {parameter} hold the truth in {values['holds']:.0%} of the trials")
        # An interval of 90 % that has learned nothing has 90 % of the range: two thirds of it.
        if parameter not in loose and values["width"] > 0.6:
            wrong.append(f"{name}: the intervals of {parameter} have {values['width']:.0%} of the range")
        if values["wide_without_warning"]:
            wrong.append(f"{name}: {values['wide_without_warning']} intervals of {parameter} are as wide as the range without a warning")
    return wrong


def check_reduced(found, known):
    share = np.mean([values["holds"] for values in found["reduced"]["parameters"].values()])
    # Of 8 intervals of 90 %, fewer than 5 hold the truth once in two hundred times.
    return [] if share >= 5 / 8 else [f"few intervals hold the truth: {found['reduced']}"]


def check_record(known):
    if missing := [name for name in MATERIALS if name not in known]:
        return [f"not on record: {', '.join(missing)}; run validation/posteriors.py --full"]
    return [text for name, material in MATERIALS.items() for text in failures(name, known[name], material().loose)]


def table(known):
    """The figures on record, as rows of the table in docs/book/evidence/inference.md."""
    for name, found in known.items():
        for parameter, values in found["parameters"].items():
            print(f"| {name} | {parameter} | {values['holds']:.0%} | {values['width']:.0%} | {values['warned']} |")


if __name__ == "__main__":
    studies.run(__file__, __doc__, PROGRAM, RESULTS, full=full, reduced=reduced, check_reduced=check_reduced, check_record=check_record, table=table)
