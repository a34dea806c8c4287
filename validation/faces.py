#!/usr/bin/env python3
"""Bodies that are cut from a packing: stiffness and strength with and without larger areas of the bonds near their faces, and splitting by strips.

    validation/faces.py [--full | --table]

Each case is one run of the program. Results are written to validation/results/faces.json after every case, so that an interrupted study
continues where it stopped. Without --full, the smallest cases run with the same code and must reproduce the recorded values, and the
statements about the values on record are checked. The concrete is that of laboratory.py.
"""

import json
import subprocess
import tempfile
from functools import partial
from pathlib import Path

import confinement
import laboratory
import numpy as np
from concordem_validate import scenario
from concordem_validate import study as studies

RESULTS = Path(__file__).resolve().parent / "results/faces.json"
SEEDS = (1, 2, 3, 4, 5)
# Heights of square bars, mm, in diameters of particles 5, 7, and 10.
HEIGHTS = (10, 14, 20)
FACES = {"as cut": False, "corrected": True}
# Diameters of cylinders, mm; strips are 5 mm wide, five radii.
DIAMETERS = (32, 48)
WIDTH = 5
CONCRETES = {"": {}, "saturating ": confinement.MATERIAL}


def corrected(document, faces):
    if FACES[faces]:
        document["bonds"]["face_correction"] = True
    return document


def bar(height, bending, faces, seed):
    """The elastic beam of laboratory.py with a square section."""
    document = laboratory.elastic_beam(height, bending, seed)
    document["packing"]["shape"] = laboratory.box(4.5 * height, height, height)
    return corrected(document, faces)


def prism(concrete, faces, seed):
    return corrected(laboratory.prism(seed, **CONCRETES[concrete]), faces)


def cylinder(concrete, diameter, by, faces, seed):
    """Splitting between plates or strips."""
    document = laboratory.cylinder(seed)
    document["material"][0]["cpm"] |= CONCRETES[concrete]
    document["packing"]["shape"]["radius"] = f"{diameter / 2} mm"
    if by == "strips":
        del document["loading"]["material"]
        document["loading"]["strip_width"] = f"{WIDTH} mm"
        document["loading"]["closing_velocity"] = f"{100 * diameter / 32} mm/s"
        document["stop"] |= {"drop_to": 0.6}
    return corrected(document, faces)


def cell(seed):
    """The periodic cell that the bodies are cut from."""
    document = laboratory.concrete({"kind": "periodic"}, seed, "Cell")
    document["packing"]["count"] = 500
    document["stop"] = {"steps": 1}
    return document


CASES = {
    **{f"cell, seed {s}": (cell, s) for s in SEEDS},
    **{f"bar {h} mm, {'bent' if bending else 'pulled'}, {faces}, seed {s}": (bar, h, bending, faces, s)
       for h in HEIGHTS for bending in (True, False) for faces in FACES for s in SEEDS[:3 if h == HEIGHTS[-1] else 5]},
    **{f"{c}prism, {faces}, seed {s}": (prism, c, faces, s) for c in CONCRETES for faces in FACES for s in SEEDS},
    **{f"{c}cylinder {d} mm, {by}, {faces}, seed {s}": (cylinder, c, d, by, faces, s)
       for c in CONCRETES for d in DIAMETERS for by in ("plates", "strips") for faces in FACES for s in SEEDS
       if (by == "strips" and not c) or d == DIAMETERS[0] and (by == "strips" or not c)},
}
REDUCED = ["cell, seed 1", "bar 10 mm, bent, corrected, seed 1", "bar 10 mm, pulled, corrected, seed 1", "cylinder 32 mm, strips, corrected, seed 1"]


def modulus(program, document, options):
    """Young's moduli of a cell along its axes (Pa), by statics."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cell.toml"
        path.write_text(scenario.dumps(document))
        text = subprocess.run([program, "elastic", "--json", "--quiet", "--no-dynamics", *options, path], check=True, capture_output=True, text=True)
        return {"young_pa": [1 / json.loads(text.stdout)["static"]["compliance_per_pa"][k][k] for k in range(3)]}


def study(names, known, save, about, program, options):
    for case in names:
        if case in known:
            continue
        build, *arguments = CASES[case]
        document = build(*arguments)
        known[case] = (modulus if build is cell else laboratory.test)(program, document, options) | about
        save()
        print(f"{case}: {known[case]}", flush=True)


def moduli(known, height, kind, faces):
    """Moduli of bars for the nominal section over those of their cells along the same axis; empty while runs are missing."""
    ratio = []
    for seed in SEEDS:
        one, whole = known.get(f"bar {height} mm, {kind}, {faces}, seed {seed}"), known.get(f"cell, seed {seed}")
        if one and whole:
            ratio.append(one["section_modulus_pa"] / whole["young_pa"][0])
    return np.array(ratio)


def strengths(known, name):
    """Magnitudes of strengths over the seeds, MPa."""
    return np.array([1e-6 * abs(known[case]["peak_stress_pa"]) for seed in SEEDS if (case := f"{name}, seed {seed}") in known])


def show(values, digits=2):
    return f"{values.mean():.{digits}f} ± {values.std(ddof=1):.{digits}f}" if len(values) > 1 else "–"


def table(known):
    """The recorded values as rows of the tables in docs/book/evidence/laboratory-tests.md."""
    for height in HEIGHTS:
        print(f"| {height} | " + " | ".join(show(moduli(known, height, kind, faces), 3) for faces in FACES for kind in ("pulled", "bent")) + " |")
    for concrete in CONCRETES:
        for name in ["prism", *(f"cylinder {d} mm, {by}" for d in DIAMETERS for by in ("plates", "strips"))]:
            cells = [strengths(known, f"{concrete}{name}, {faces}") for faces in FACES]
            ratio = [one.mean() / strengths(known, f"{concrete}prism, {faces}").mean() if len(one) else np.nan for one, faces in zip(cells, FACES, strict=True)]
            print(f"| {concrete}{name} | " + " | ".join(f"{show(one)} | {r:.2f}" for one, r in zip(cells, ratio, strict=True)) + " |")


def check_same(found, known):
    wrong = laboratory.check_same({name: case for name, case in found.items() if "peak_stress_pa" in case}, known)
    for name, case in found.items():
        # Statics by a library, to 1e-9 of a residual.
        if "young_pa" in case and not np.allclose(case["young_pa"], known[name]["young_pa"], rtol=1e-6, atol=0):
            wrong.append(f"{name}: {case} instead of {known[name]}")
    return wrong


def check_record(known):
    """Statements of the book about the values on record that do not hold, as messages."""
    missing = [case for case in CASES if case not in known]
    if missing:
        return [f"not on record: {', '.join(missing)}"]
    wrong = []

    def demand(holds, what):
        if not holds:
            wrong.append(what)

    for height in HEIGHTS:
        pulled, bent = (moduli(known, height, kind, "corrected").mean() for kind in ("pulled", "bent"))
        # A bar is as stiff as its cell; a bent one, whose outer fibers count most, lacks up to 6 %.
        demand(abs(pulled - 1) < 0.01, f"bars of {height} mm have {pulled:.3f} of the cell's modulus")
        demand(-0.07 < bent - 1 < 0.01, f"bent bars of {height} mm have {bent:.3f} of the cell's modulus")
    for diameter in DIAMETERS:
        ratio = strengths(known, f"cylinder {diameter} mm, strips, corrected").mean() / strengths(known, "prism, corrected").mean()
        # The range of published ratios (EN 1992-1-1, 3.1.2: 1/0.9).
        demand(0.9 < ratio < 1.1, f"cylinders of {diameter} mm between strips bear {ratio:.3f} of the tensile strength")
    return wrong


def main():
    studies.run(__file__, __doc__, laboratory.PROGRAM, RESULTS, full=partial(study, CASES), reduced=partial(study, REDUCED),
                check_reduced=check_same, check_record=check_record, table=table)


if __name__ == "__main__":
    main()
