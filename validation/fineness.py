#!/usr/bin/env python3
"""Fineness study of packings between walls (Jebahi et al. 2015, 2.3.2.3): 22 sizes with five seeds each.

    validation/fineness.py [--full | --table]

Cubes of spheres with a dispersion of 25 %, made by the cooker (target 6.2, links of enlarged radii), with 100 to 10,000 spheres. The book
does not give its sizes; these are equidistant in the logarithm of the edge. Each case is one run of `concordem characterise`. Results are
written to validation/results/fineness.json after every case, so that an interrupted study continues where it stopped. Without --full, the
smallest cases run with the same code and must reproduce the recorded values, and the statements about the values on record are checked.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from concordem_validate import scenario, study as studies

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "target/release/concordem"
RESULTS = ROOT / "validation/results/fineness.json"

SEEDS = (1, 2, 3, 4, 5)
# Edges of the cubes, mm, for a mean radius of 1 mm: 97 to 10,000 spheres.
EDGES = tuple(round(9 * (41 / 9) ** (k / 21), 2) for k in range(22))


def cube(edge, seed):
    """Spheres between the walls of a cube."""
    return {
        "version": 1, "title": "Fineness",
        "packing": {
            "kind": "cooker", "correction": "enlarged-radii", "seed": seed,
            "radii": {"kind": "uniform", "minimum": "0.875 mm", "maximum": "1.125 mm"},
            "shape": {"kind": "box", "size": [f"{edge} mm"] * 3}},
        "material": [{"name": "glass", "density": "2500 kg/m^3", "linear_bond": {"normal_stiffness": "1e7 N/m", "shear_stiffness": 0}}],
        "bonds": {"law": "linear_bond"}, "contacts": {"law": "linear_bond"}, "stop": {"steps": 1},
    }


def name(edge, seed):
    return f"edge {edge} mm, seed {seed}"


def measured(edge, seed, program, options):
    """The structure of one packing."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cube.toml"
        path.write_text(scenario.dumps(cube(edge, seed)))
        command = [program, "characterise", "--quiet", "--output", f"{folder}/cube.html", *options, path]
        subprocess.run(command, check=True, capture_output=True, text=True)
        found = json.loads((Path(folder) / "cube.json").read_text())
    return {
        "spheres": found["spheres"], "inside": found["coordination"]["spheres_inside"],
        "links_per_sphere_inside": found["coordination"]["inside"], "at_boundary": found["coordination"]["at_boundary"],
        "isotropy": {key: found["isotropy"][key] for key in ("e_percent", "over_independent_isotropic_links")},
        "solid_fraction": {key: found["solid_fraction"][key] for key in ("hull", "effective", "shape")},
    }


def add(cases, known, save, about, program, options):
    for edge, seed in cases:
        if name(edge, seed) not in known:
            start = time.monotonic()
            known[name(edge, seed)] = measured(edge, seed, program, options) | {"wall_s": round(time.monotonic() - start, 1)} | about
            save()
            print(name(edge, seed), known[name(edge, seed)]["spheres"], flush=True)


def reduced(known, save, about, program, options):
    add([(EDGES[0], seed) for seed in SEEDS[:2]] + [(EDGES[3], 1)], known, save, about, program, options)


def full(known, save, about, program, options):
    add([(edge, seed) for edge in EDGES for seed in SEEDS], known, save, about, program, options)


def check_reduced(found, known):
    """Packings are the same bits on any machine, so all numbers are."""
    return [f"{case}: {values}, on record {known.get(case)}" for case, values in found.items()
            if {key: value for key, value in values.items() if key != "wall_s"}
            != {key: value for key, value in known.get(case, {}).items() if key in values and key != "wall_s"}]


def rows(known):
    """Sizes with all seeds: edge, and means and deviations over the seeds."""
    for edge in EDGES:
        cases = [known[name(edge, seed)] for seed in SEEDS if name(edge, seed) in known]
        if len(cases) == len(SEEDS):
            pick = lambda get: np.array([get(case) for case in cases])
            yield edge, pick(lambda c: c["spheres"]), pick(lambda c: c["links_per_sphere_inside"]), pick(
                lambda c: c["solid_fraction"]["hull"]), pick(lambda c: c["solid_fraction"]["effective"]), pick(
                lambda c: c["isotropy"]["e_percent"])


def check_record(known):
    """Larger packings are denser, because the walls matter less, and nearer to isotropy; the target is met to a link."""
    done = list(rows(known))
    if len(done) < 2:
        return ["fewer than two sizes with all seeds are on record"]
    wrong = []
    first, last = done[0], done[-1]
    if not last[3].mean() > first[3].mean():
        wrong.append(f"solid fraction of the hull: {first[3].mean():.3f} at {first[0]} mm, {last[3].mean():.3f} at {last[0]} mm")
    if not last[5].mean() < first[5].mean():
        wrong.append(f"isotropy: {first[5].mean():.3g} at {first[0]} mm, {last[5].mean():.3g} at {last[0]} mm")
    for edge, spheres, links, *_ in done:
        # whole links among those inside, of which the smallest cube has some 20
        if abs(links.mean() - 6.2) > 3 / np.sqrt(spheres.min()):
            wrong.append(f"links per sphere inside at {edge} mm: {links.mean():.3f}")
    return wrong


def table(known):
    print("| edge / mean radius | spheres | links inside | solid fraction of the hull | effective | e, percent^2 |\n|---|---|---|---|---|---|")
    for edge, *columns in rows(known):
        texts = [f"{c.mean():.0f}" if k == 0 else f"{c.mean():.3g} ± {c.std(ddof=1):.1g}" if k == 4 else f"{c.mean():.4f} ± {c.std(ddof=1):.4f}"
                 for k, c in enumerate(columns)]
        print(f"| {edge} | " + " | ".join(texts) + " |")


if __name__ == "__main__":
    studies.run(__file__, __doc__, PROGRAM, RESULTS, full=full, reduced=reduced, check_reduced=check_reduced,
                check_record=check_record, table=table)
