#!/usr/bin/env python3
"""The fracture energy of concrete over the size of its particles: periodic cells pulled apart, with bonds of a given energy and of a given ductility.

    validation/fracture_energy.py [--full | --table]

Each case is one run of the program. Results are written to validation/results/fracture_energy.json after every case, so that an interrupted
study continues where it stopped. Without --full, the smallest case runs with the same code and must reproduce the recorded values, and the
statements about the values on record are checked.
"""

from functools import partial
from pathlib import Path

import numpy as np

import confinement
import laboratory
from concordem_validate import study as studies

RESULTS = Path(__file__).resolve().parent / "results/fracture_energy.json"

# Radii, mm, over a factor of 4.
RADII = (1.0, 0.5, 0.25)
SPHERES = 1000
# A crack that branches or turns costs up to half as much again, so that few packings do not suffice.
SEEDS = {"energy": range(1, 11), "ductility": range(1, 6)}
#: Both give bonds of a mean length of 2.35 mm, that between spheres of 1 mm, the softening strain of 10 times the onset.
SOFTENING = {"energy": {"fracture_energy": "6.17 J/m^2"}, "ductility": {"relative_ductility": 10}}
# The stress at which a cell counts as broken, over its strength.
BROKEN = 0.03


def cell(softening, radius, count, seed):
    """A cell pulled apart, of the concrete that confinement.py compares with experiments."""
    # Cells of all sizes open equally fast, as one of 1,000 spheres of 1 mm at 0.4 1/s.
    rate = 0.4 * 10 / (count ** (1 / 3) * radius)
    document = laboratory.cell((0, 0), (None, None, rate), seed, **confinement.MATERIAL)
    cpm = document["material"][0]["cpm"]
    del cpm["relative_ductility"]
    cpm |= SOFTENING[softening]
    document["packing"] |= {"radius": f"{radius} mm", "count": count}
    # The opening at which a crack is free does not depend on the cell, the strain does.
    document["stage"] = [{"name": "load", "stop": {"strain": 8e-3 / radius, "drop_to": BROKEN}}]
    document["output"]["sample_interval"] = document["sample"][0]["interval"] = 50
    return document


def cases():
    """Cells of equally many spheres."""
    for softening in SOFTENING:
        for seed in SEEDS[softening]:
            for radius in RADII:
                yield f"{softening}, radius {radius} mm, 1000 spheres, seed {seed}", (softening, radius, SPHERES, seed)


CASES = dict(cases())
REDUCED = ["energy, radius 1.0 mm, 1000 spheres, seed 1"]


def test(program, document, options):
    """Strength, and the energy dissipated per area, of one run."""
    with laboratory.run(program, document, options) as (_, file, seconds):
        samples = file["samples"]
        edges = file["cell/edges"][()]
        last = {name: samples[name][-1] for name in ("boundary_work", "kinetic", "stored_normal", "stored_shear", "stress", "strain")}
        dissipated = last["boundary_work"] - last["kinetic"] - last["stored_normal"] - last["stored_shear"]
        area = float(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1])))
        return {
            "wall_s": seconds, "particles": len(file["particles/radius"]), "steps": int(samples["step"][-1]),
            "peak_stress_pa": float(np.max(samples["stress"])), "fracture_energy_j_per_m2": float(dissipated / area),
            "last_stress_pa": float(last["stress"]), "last_strain": float(last["strain"])}


def study(names, known, save, about, program, options):
    for case in names:
        if case in known:
            continue
        known[case] = test(program, cell(*CASES[case]), options) | about
        save()
        print(f"{case}: {known[case]}", flush=True)


def mean(known, start, quantity):
    """Mean and standard error over the seeds of the cases that begin with `start`."""
    values = np.array([known[case][quantity] for case in CASES if case.startswith(start)])
    return float(values.mean()), float(values.std(ddof=1) / len(values) ** 0.5)


def table(known):
    """The recorded values as rows of the table in docs/book/evidence/laboratory-tests.md."""
    if missing(known):
        return
    for softening in SOFTENING:
        for radius in RADII:
            start = f"{softening}, radius {radius} mm, 1000"
            (energy, error), (strength, deviation) = mean(known, start, "fracture_energy_j_per_m2"), mean(known, start, "peak_stress_pa")
            print(f"| {softening} | {radius} mm | {energy:.1f} ± {error:.1f} | {strength * 1e-6:.2f} ± {deviation * 1e-6:.2f} |")


def missing(known):
    return [case for case in CASES if case not in known]


def check_record(known):
    """Statements of the book about the values on record that do not hold, as messages."""
    if missing(known):
        return [f"not on record: {', '.join(missing(known))}"]
    # The peak may lie between two samples.
    most = 1.01 * BROKEN
    wrong = [f"{case}: not broken at the end" for case in CASES if known[case]["last_stress_pa"] > most * known[case]["peak_stress_pa"]]
    of = lambda start: mean(known, start, "fracture_energy_j_per_m2")[0]
    energies = [of(f"energy, radius {radius} mm, 1000") for radius in RADII]
    # Over a factor of 4 in size, within 10 % of their mean.
    middle = sum(energies) / len(energies)
    if max(abs(energy / middle - 1) for energy in energies) > 0.1:
        wrong.append(f"fracture energies: {energies}")
    energies = [of(f"ductility, radius {radius} mm, 1000") for radius in RADII]
    # With a ductility, it follows the radius.
    if not all(1.8 <= large / small <= 2.2 for large, small in zip(energies, energies[1:], strict=False)):
        wrong.append(f"fracture energies with a ductility: {energies}")
    return wrong


def check_same(found, known):
    """Differences from the recorded values, as messages."""
    return [f"{case}: {quantity} is {values[quantity]!r}, but the recorded value is {known[case][quantity]!r}. If that is meant, remove the case "
            "from the results and run the full study again"
            for case, values in found.items() for quantity in ("peak_stress_pa", "fracture_energy_j_per_m2", "steps")
            # Results are bitwise equal on all machines; recorded values have 17 digits.
            if abs(values[quantity] - known[case][quantity]) > 1e-12 * abs(known[case][quantity])]


def main():
    studies.run(__file__, __doc__, laboratory.PROGRAM, RESULTS, full=partial(study, CASES), reduced=partial(study, REDUCED),
                check_reduced=check_same, check_record=check_record, table=table)


if __name__ == "__main__":
    main()
