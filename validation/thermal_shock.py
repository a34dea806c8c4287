#!/usr/bin/env python3
"""Spacing of cracks after a thermal shock: four severities, three packings each.

    validation/thermal_shock.py [--full | --table | --picture FILE]

A hot plate of discs (diameter about 1 mm, brittle bonds) whose lower face is suddenly kept cold. The severity is the drop of the temperature
over the smallest one that breaks a clamped bond, φ_n/(k l α). Cracks are counted along lines at several depths. Results are written to
validation/results/thermal_shock.json after every plate, so that an interrupted study continues where it stopped. Without --full, two small
plates run with the same code and must reproduce the recorded values, and the statements about the values on record are checked.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from concordem_validate import scenario, study as studies

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "target/release/concordem"
RESULTS = ROOT / "validation/results/thermal_shock.json"

SEVERITIES = (2.0, 2.83, 4.0, 5.66)
SEEDS = (1, 2, 3)
# Depths of the lines, mm, that is, mean diameters of the discs.
DEPTHS = (2, 3, 4, 6, 8, 10, 12)
# Width and height, mm; steps; thermal time over time of motion.
PLATE = (240, 50, 9000, 2e4)
SMALL = (60, 25, 3000, 2e4)
# The same thermal time at half the speed: what changes is due to the inertia of the plate.
SLOW = (240, 50, 18000, 1e4)
# N and N/m per bond of 1 mm, 1/K: a drop of 100 K breaks a clamped bond.
STRENGTH, STIFFNESS, EXPANSION = 100, 1e8, 1e-5
CRITICAL = STRENGTH / (STIFFNESS * 1e-3 * EXPANSION)


def shock(severity, seed, width, height, steps, time_factor):
    discs = round(width * height * 0.83 / (np.pi / 4))
    return {
        "version": 1, "dimension": 2, "title": f"Thermal shock of severity {severity}",
        "packing": {
            "kind": "random-discs", "count": discs, "seed": seed,
            "radii": {"kind": "uniform", "minimum": "0.45 mm", "maximum": "0.55 mm"},
            "shape": {"kind": "box", "size": [f"{width} mm", f"{height} mm", "1 mm"]}},
        "material": [{
            "name": "glass", "density": 2500,
            "linear_bond": {"normal_stiffness": STIFFNESS, "shear_stiffness": 0.3 * STIFFNESS, "normal_strength": STRENGTH,
                            "shear_strength": 1e9, "damping_ratio": 0.02},
            "thermal": {"specific_heat": 800, "conductivity": 1, "expansion": EXPANSION}}],
        "bonds": {"law": "linear_bond", "interaction_ratio": 1.1}, "contacts": {"law": "none"},
        "heat": {"temperature": 293 + CRITICAL * severity, "time_factor": time_factor,
                 "boundary": [{"face": "y minimum", "temperature": 293}]},
        "integration": {"damping": {"kind": "local", "coefficient": 0.3}},
        "output": {"snapshot_interval": steps}, "stop": {"steps": steps},
    }


def broken(severity, seed, plate, program, options):
    """Midpoints of the broken bonds from the lower left corner, mm, and the height of the discs."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plate.toml"
        path.write_text(scenario.dumps(shock(severity, seed, *plate)))
        subprocess.run([program, "run", "--quiet", *options, path], check=True, capture_output=True, text=True)
        with h5py.File(path.with_suffix(".h5")) as file:
            points = file["VTKHDF/Points"][:len(file["VTKHDF/PointData/id"])]
            return (file["events/position"][:, :2] - points.min(axis=0)[:2]) * 1e3


def count(positions, depth):
    """Cracks that cross the line at `depth`: groups of broken bonds in a band of 1.5 diameters, 2 diameters or more apart."""
    along = np.sort(positions[np.abs(positions[:, 1] - depth) < 0.75, 0])
    return int(len(along) > 0) + int((np.diff(along) > 2.0).sum())


def measured(severity, seed, plate, program, options):
    positions = broken(severity, seed, plate, program, options)
    return {"width_mm": plate[0], "broken": len(positions), "cracks": {str(depth): count(positions, depth) for depth in DEPTHS}}


def name(severity, seed, plate):
    return f"severity {severity}, seed {seed}, {plate[0]} mm" + (", half the speed" if plate == SLOW else "")


def add(cases, known, save, about, program, options):
    for case in cases:
        if name(*case) not in known:
            start = time.monotonic()
            known[name(*case)] = measured(*case, program, options) | {"wall_s": round(time.monotonic() - start, 1)} | about
            save()
            print(name(*case), known[name(*case)]["cracks"], flush=True)


def reduced(known, save, about, program, options):
    add([(severity, 1, SMALL) for severity in (SEVERITIES[0], SEVERITIES[2])], known, save, about, program, options)


def full(known, save, about, program, options):
    add([(severity, seed, PLATE) for seed in SEEDS for severity in SEVERITIES], known, save, about, program, options)
    add([(SEVERITIES[2], seed, SLOW) for seed in SEEDS], known, save, about, program, options)


def check_reduced(found, known):
    """Runs have the same bits on any machine, so all numbers are equal."""
    return [f"{case}: {values}, on record {known.get(case)}" for case, values in found.items()
            if any(values[key] != known.get(case, {}).get(key) for key in ("width_mm", "broken", "cracks"))]


def spacings(known, plate=PLATE, severities=SEVERITIES):
    """Mean spacings over the packings, mm, and their standard errors, by severity (rows) and depth; infinite without a crack."""
    means, errors = [], []
    for severity in severities:
        counts = np.array([[known[name(severity, seed, plate)]["cracks"][str(depth)] for depth in DEPTHS] for seed in SEEDS])
        with np.errstate(divide="ignore"):
            means.append(plate[0] / counts.mean(axis=0))
        errors.append(means[-1] * counts.std(axis=0, ddof=1) / np.sqrt(len(SEEDS)) / np.maximum(counts.mean(axis=0), 1))
    return np.array(means), np.array(errors)


def exponents(known):
    """Exponents of the spacing, p ~ y^a s^-b, by least squares of the logarithms, with their standard errors."""
    means, _ = spacings(known)
    rows = [(np.log(depth), -np.log(severity), 1.0, np.log(means[i, j]))
            for i, severity in enumerate(SEVERITIES) for j, depth in enumerate(DEPTHS) if np.isfinite(means[i, j])]
    table = np.array(rows)
    solution, residual, _, _ = np.linalg.lstsq(table[:, :3], table[:, 3], rcond=None)
    covariance = np.linalg.inv(table[:, :3].T @ table[:, :3]) * residual[0] / (len(rows) - 3)
    return solution[:2], np.sqrt(np.diag(covariance))[:2]


def check_record(known):
    """More severe shocks make denser cracks at every depth, fewer cracks go deeper, and the speed of the motion does not matter."""
    if any(name(severity, seed, PLATE) not in known for severity in SEVERITIES for seed in SEEDS):
        return ["plates are missing on record"]
    wrong = []
    means, errors = spacings(known)
    for j, depth in enumerate(DEPTHS):
        # four severities, so that a single pair may exchange its order by chance, but not the first and the last
        if not means[-1, j] < 0.8 * means[0, j]:
            wrong.append(f"at {depth} mm: {means[-1, j]:.1f} mm at the largest severity, {means[0, j]:.1f} mm at the smallest")
    for i, severity in enumerate(SEVERITIES):
        if not (np.diff(means[i]) >= 0).all():
            wrong.append(f"at a severity of {severity} the spacing does not grow with the depth: {means[i]}")
    if all(name(SEVERITIES[2], seed, SLOW) in known for seed in SEEDS):
        slow, slow_errors = (row[0] for row in spacings(known, SLOW, SEVERITIES[2:3]))
        # three standard errors of the difference of two means of three plates
        differs = np.abs(slow - means[2]) > 3 * np.hypot(slow_errors, errors[2]) + 0.1 * slow
        if differs[:4].any():
            wrong.append(f"at half the speed: {slow} mm instead of {means[2]} mm")
    return wrong


def table(known):
    means, errors = spacings(known)
    print("| severity | " + " | ".join(f"{depth} mm" for depth in DEPTHS) + " |\n|" + "---|" * (len(DEPTHS) + 1))
    rows = list(zip(SEVERITIES, means, errors))
    if all(name(SEVERITIES[2], seed, SLOW) in known for seed in SEEDS):
        rows.append((f"{SEVERITIES[2]}, half the speed", *(row[0] for row in spacings(known, SLOW, SEVERITIES[2:3]))))
    for label, mean, error in rows:
        print(f"| {label} | " + " | ".join("–" if np.isinf(m) else f"{m:.1f} ± {e:.1f}" for m, e in zip(mean, error)) + " |")
    (depth, severity), (depth_error, severity_error) = exponents(known)
    print(f"\nspacing ~ depth^({depth:.2f} ± {depth_error:.2f}) severity^(-{severity:.2f} ± {severity_error:.2f})")


def picture(path, program):
    """The cracks of one packing at all severities."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(len(SEVERITIES), 1, figsize=(8, 5.2), sharex=True, constrained_layout=True)
    for axis, severity in zip(axes, SEVERITIES):
        positions = broken(severity, SEEDS[0], PLATE, program, [])
        axis.plot(*positions.T, "k.", markersize=1.5)
        axis.set(xlim=(0, PLATE[0]), ylim=(0, 22), aspect="equal", ylabel="depth, mm", title=f"severity {severity}")
        axis.title.set_size("medium")
    axes[-1].set_xlabel("x, mm (cooled face at depth 0; dots: broken bonds)")
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    studies.run(__file__, __doc__, PROGRAM, RESULTS, full=full, reduced=reduced, check_reduced=check_reduced,
                check_record=check_record, table=table, picture=picture)
