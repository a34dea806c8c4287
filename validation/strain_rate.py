#!/usr/bin/env python3
"""Strength of concrete over the strain rate, without inertia: periodic cells with viscous slip, beside a code of practice.

    validation/strain_rate.py [--full | --table]

The density of a cell is scaled by the inverse square of the rate, so that a run has the same steps and the same share of inertia at every
rate: without viscosity, the strength does not depend on it. Each case is one run of the program. Results are written to
validation/results/strain_rate.json after every case, so that an interrupted study continues where it stopped. Without --full, the smallest
case runs with the same code and must reproduce the recorded values, and the statements about the values on record are checked.
"""

from functools import partial
from pathlib import Path

import confinement
import laboratory
from concordem_validate import study as studies

RESULTS = Path(__file__).resolve().parent / "results/strain_rate.json"
SPHERES = 500

#: Found by a search with one cell. A small exponent makes the strength rise by nearly equal steps for each factor of ten in the rate, as in
#: experiments. Viscous damage would raise the strength in tension alone.
VISCOSITY = {"plasticity_time": "4e-5 s", "plasticity_rate_exponent": 0.12}

# Strain rates, 1/s. The first one is the quasi-static rate of the code.
RATES = {"tension": (1e-6, 1e-4, 1e-2, 1, 10), "compression": (30e-6, 1e-3, 1e-1, 1, 30)}
# fib Model Code 2010, 5.1.11.2: exponents of the rate over the quasi-static one, up to 10 1/s in tension and 30 1/s in compression.
EXPONENTS = {"tension": 0.018, "compression": 0.014}
# Rate, 1/s, of confinement.py, at its density.
SLOW = {"tension": 0.4, "compression": 3.0}


def cell(loading, rate, viscous, scaled, seed):
    """A cell of the concrete of confinement.py at a strain rate; with its own density unless `scaled`."""
    factor = rate / SLOW[loading]
    sign = 1 if loading == "tension" else -1
    document = laboratory.cell((0, 0), (None, None, sign * rate), seed, **confinement.MATERIAL, **(VISCOSITY if viscous else {}))
    document["packing"]["count"] = SPHERES
    document["loading"]["maximum_strain_rate"] = f"{100 * factor} 1/s"
    if scaled:
        document["material"][0]["density"] = f"{4800 / factor**2} kg/m^3"
    return document


def cases():
    for seed in laboratory.SEEDS:
        for loading, rates in RATES.items():
            for rate in rates:
                yield f"{loading}, viscous, {rate:g} 1/s, seed {seed}", (loading, rate, True, True, seed)
            for rate in (rates[0], rates[-1]):
                yield f"{loading}, not viscous, {rate:g} 1/s, seed {seed}", (loading, rate, False, True, seed)
            yield f"{loading}, inertia alone, {rates[-1]:g} 1/s, seed {seed}", (loading, rates[-1], False, False, seed)


CASES = dict(cases())
REDUCED = ["tension, viscous, 1 1/s, seed 1"]


def study(names, known, save, about, program, options):
    for case in names:
        if case in known:
            continue
        known[case] = laboratory.test(program, cell(*CASES[case]), options) | about
        save()
        print(f"{case}: {known[case]}", flush=True)


def of_code(loading, rate):
    """Strength over the quasi-static one."""
    return (rate / RATES[loading][0]) ** EXPONENTS[loading]


def ratios(known, loading):
    """For each rate: strength over that at the first rate, and that of the code."""
    strength = {rate: laboratory.strength(known, f"{loading}, viscous, {rate:g} 1/s")[0] for rate in RATES[loading]}
    static = strength[RATES[loading][0]]
    return [(rate, found / static, of_code(loading, rate)) for rate, found in strength.items()]


def missing(known):
    return [case for case in CASES if case not in known]


def table(known):
    """The recorded values as rows of the table in docs/book/evidence/laboratory-tests.md."""
    if missing(known):
        return
    for loading in RATES:
        for rate, ours, wanted in ratios(known, loading):
            mean, deviation = laboratory.strength(known, f"{loading}, viscous, {rate:g} 1/s")
            print(f"| {loading} | {rate:g} | {mean * 1e-6:.2f} ± {deviation * 1e-6:.2f} | {ours:.3f} | {wanted:.3f} |")
        first, last = RATES[loading][0], RATES[loading][-1]
        for name in (f"not viscous, {first:g}", f"not viscous, {last:g}", f"inertia alone, {last:g}"):
            mean, deviation = laboratory.strength(known, f"{loading}, {name} 1/s")
            print(f"{loading}, {name} 1/s: {mean * 1e-6:.3f} ± {deviation * 1e-6:.3f}")


def check_record(known):
    """Statements of the book about the values on record that do not hold, as messages."""
    if missing(known):
        return [f"not on record: {', '.join(missing(known))}"]
    wrong = []
    for loading, rates in RATES.items():
        for rate, ours, wanted in ratios(known, loading):
            # Experiments scatter by more.
            if abs(ours / wanted - 1) > 0.05:
                wrong.append(f"{loading} at {rate:g} 1/s: {ours:.3f} times the quasi-static strength, {wanted:.3f} expected")
        slow, fast = (laboratory.strength(known, f"{loading}, not viscous, {rate:g} 1/s")[0] for rate in (rates[0], rates[-1]))
        # The same steps in other units; rounding and the order of a servo's steps differ.
        if abs(fast / slow - 1) > 0.005:
            wrong.append(f"{loading} without viscosity: {slow} Pa and {fast} Pa")
    return wrong


def main():
    studies.run(__file__, __doc__, laboratory.PROGRAM, RESULTS, full=partial(study, CASES), reduced=partial(study, REDUCED),
                check_reduced=laboratory.check_same, check_record=check_record, table=table)


if __name__ == "__main__":
    main()
