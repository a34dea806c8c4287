#!/usr/bin/env python3
"""Acoustic emission and fragments of a rock: b-value, Kaiser effect, and sieve curves after an impact and between plates, beside published values.

    validation/acoustic_emission.py [--full | --table]

Each case is one run of the program, read by its commands `events` and `fragments` with their defaults. Results are written to
validation/results/acoustic_emission.json after every case, so that an interrupted study continues where it stopped. Without --full, the
smallest cases run with the same code and must reproduce the recorded values, and the statements about the values on record are checked.
"""

import csv
import re
import subprocess
from functools import partial
from pathlib import Path

import numpy as np

import laboratory
from concordem_validate import study as studies

RESULTS = Path(__file__).resolve().parent / "results/acoustic_emission.json"

SEEDS = range(1, 6)
FEW = range(1, 4)
# Largest stresses of the cycles, over the strength of the same specimen without cycles.
LEVELS = (0.5, 0.7, 0.9)
# Strain rates, 1/s.
FAST, SLOW = 2, 0.5
# A reloading below this share of the former largest stress should be silent.
SILENT = 0.95
# b is counted once more from magnitudes larger by this.
LARGER = 0.3
# And from emissions that last this many times as long as by default.
LONGER = 10
# Velocities of the impacts, m/s.
VELOCITIES = (6, 8, 10, 14)

# Sizes of a cylinder: number of spheres to pack, radius and height, mm.
SMALL, LARGE, BALL = (1500, 8, 32), (6000, 12.7, 50.8), (5000, 13, 26)


def rock(size, seed, scatter=True):
    """The rock of docs/book/how-to/count-cracks.md, without loading. Its strengths scatter by a Weibull modulus of 4, or not."""
    count, radius, height = size
    document = {
        "version": 1, "title": "Rock",
        "packing": {"kind": "random-dense", "count": count, "radii": {"kind": "uniform", "minimum": "0.75 mm", "maximum": "1.25 mm"},
                    "seed": seed, "friction": 0, "shape": {"kind": "cylinder", "radius": f"{radius} mm", "height": f"{height} mm", "axis": "x"}},
        "material": [{"name": "rock", "density": "4100 kg/m^3",
                      "cohesive_beam": {"young": "60 GPa", "radius_ratio": 0.8, "tensile_strength": "20 MPa", "cohesion": "60 MPa",
                                        "friction_angle": "35 deg", "moment_share": 0.2},
                      "frictional": {"young": "60 GPa", "stiffness_ratio": 0.4, "friction_coefficient": 0.6}}],
        "bonds": {"law": "cohesive_beam", "interaction_ratio": 1.1}, "contacts": {"law": "frictional"},
        "output": {"sample_interval": 10, "snapshot_interval": 1_000_000},
    }
    if scatter:
        document["material"][0]["strength_scatter"] = {"weibull_modulus": 4, "seed": seed}
    return document


def pressed(size, seed, scatter=True, levels=(), rate=FAST):
    """Uniaxial compression until the stress has halved, unloaded before from each of the stresses `levels` (Pa) to a tenth of it."""
    document = rock(size, seed, scatter)
    # Weak enough for the strength, see the book.
    document["integration"] = {"damping": {"kind": "local", "coefficient": 0.1}}
    document["loading"] = {"kind": "uniaxial", "axis": "x", "strain_rate": f"-{rate} 1/s"}
    document["stage"] = [stage for number, level in enumerate(levels) for stage in (
        {"name": f"load {number}", "stop": {"stress": -level}}, {"name": f"unload {number}", "rate": -1, "stop": {"stress": -0.1 * level}})]
    document["stage"].append({"name": "fail", "stop": {"drop_to": 0.5, "strain": -1e-2}})
    return document


def thrown(size, velocity, seed):
    """A cylinder thrown at a wall with its side. Nothing damps but friction. The time is that in which a wave passes it 150 times."""
    document = rock(size, seed)
    document["set"] = [{"name": "all", "selection": {"kind": "all"}}]
    document["initial"] = [{"set": "all", "velocity": [0, f"{velocity} m/s", 0]}]
    document["wall"] = [{"name": "wall", "material": "rock",
                         # Spheres at the surface stick out by up to their radius.
                         "shape": {"kind": "plane", "point": [0, f"{size[1] + 1.3} mm", 0], "normal": [0, -1, 0]}}]
    document["stop"] = {"time": "1 ms"}
    return document


def between_plates(seed, shape, velocity, stop):
    """A body of the rock between two plates that close along z."""
    document = rock(BALL, seed)
    document["packing"]["shape"] = shape
    document["integration"] = {"damping": {"kind": "local", "coefficient": 0.1}}
    document["loading"] = {"kind": "platens", "axis": "z", "closing_velocity": f"{velocity} m/s", "material": "rock"}
    document["stop"] = stop
    return document


def split(seed):
    """A disc of a diameter of 32 mm that splits between plates (Brazilian test), loaded as fast as the cylinders."""
    document = between_plates(seed, {"kind": "cylinder", "radius": "16 mm", "height": "16 mm", "axis": "y"}, 0.032 * FAST, {"drop_to": 0.5, "strain": 1e-2})
    document["loading"]["area"] = "splitting"
    return document


def crushed(seed):
    """An agglomerate as high as its diameter of 26 mm, crushed from its side at 4 m/s to five sixths."""
    return between_plates(seed, {"kind": "cylinder", "radius": "13 mm", "height": "26 mm", "axis": "x"}, 4, {"strain": 1 / 6})


def number(pattern, text):
    """The numbers in the groups of a pattern, and None where it does not occur."""
    found = re.search(pattern, text)
    return [float(group.replace("\u202f", "").replace(" ", "")) for group in found.groups()] if found else None


def said(program, command, path, *options):
    return subprocess.run([program, command, path.with_suffix(".h5"), *options], check=True, capture_output=True, text=True).stdout


def columns(text):
    """Columns of comma-separated numbers by their names without units."""
    rows = list(csv.DictReader(text.splitlines()))
    return {name.split(" [")[0]: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def slope(magnitudes, complete):
    """b by Aki 1965, and the number of emissions that count."""
    counting = magnitudes[magnitudes >= complete]
    return float(np.log10(np.e) / (counting.mean() - complete)), len(counting)


def emissions(program, path, samples):
    """What `events` says; b before and after the largest stress, of emissions of one bond, of the larger magnitudes alone, and of longer emissions."""
    text, each = said(program, "events", path), columns(said(program, "events", path, "--csv"))
    peak = samples["time"][int(np.argmax(np.abs(samples["stress"][()])))]
    value = r"b-value +(\S+) ± (\S+), ([\d\s]+) emissions from magnitude (\S+) on"
    b, error, counting, complete = number(value, text)
    duration = number(r"of breaks within \S+ m and (\S+) s", text)[0]
    longer = said(program, "events", path, "--duration", f"{LONGER * duration} s")
    magnitude = each["magnitude"]
    parts = {"before_peak": each["time"] <= peak, "after_peak": each["time"] > peak, "single": each["breaks"] == 1}
    parts = {name: slope(magnitude[part], complete) for name, part in parts.items()} | {"larger": slope(magnitude, complete + LARGER)}
    parts["longer"] = [*number(value, longer)[::2]]
    return {"broken": int(each["breaks"].sum()), "emissions": len(magnitude), "single": int(np.sum(each["breaks"] == 1)),
            "most_breaks": int(each["breaks"].max()), "magnitudes": [float(magnitude.min()), float(magnitude.max())],
            "b": b, "b_error": error, "complete_from": complete, "counting": int(counting),
            "most_breaks_of_longer": int(number(r"breaks of the largest +([\d\s]+)\n", longer)[0]), "b_of": parts}


def reloadings(program, path, ends):
    """For each reloading: what `events` says of it, and the numbers of emissions below a share of the former largest stress. `ends` are the times
    at which the stages have ended, s."""
    text, each = said(program, "events", path), columns(said(program, "events", path, "--csv"))
    load = columns(said(program, "events", path, "--csv=load"))
    at = np.interp(each["time"], load["time"], load["load"])
    ratios = [float(ratio) for ratio in re.findall(r"Felicity ratio (\S+)", text)]
    found, top = [], 0.0
    for stage in range(1, len(ends) - 1, 2):
        top = max(top, float(load["load"][load["time"] <= ends[stage - 1]].max()))
        first, unloading = each["time"] <= ends[stage - 1], (each["time"] > ends[stage - 1]) & (each["time"] <= ends[stage])
        again = (each["time"] > ends[stage]) & (each["time"] <= ends[stage + 1])
        found.append({"after_pa": top, "felicity_ratio": ratios[stage // 2], "emissions_before": int(first.sum()),
                      "emissions_unloading": int(unloading.sum()), "emissions_reloading": int(again.sum()),
                      # Beyond the peak the stress falls again: only the rise counts.
                      "emissions_below": int(np.sum(again & (at < SILENT * top) & (each["time"] <= first_passing(load, ends[stage], top))))})
    return found


def first_passing(load, begin, top):
    """The time at which the load first exceeds `top` after `begin`."""
    beyond = (load["time"] > begin) & (load["load"] > top)
    return float(load["time"][np.argmax(beyond)]) if beyond.any() else float(load["time"][-1])


def fragments(program, path):
    """What `fragments` says."""
    text = said(program, "fragments", path)
    found = {"fragments": int(number(r"fragments +([\d\s]+)\n", text)[0]), "single_share": number(r"single particles +.*?([\d.]+) % of the mass", text)[0] / 100,
             "largest_share": number(r"largest fragment +.*?([\d.]+) % of the mass", text)[0] / 100}
    for law, exponent in (("Rosin–Rammler", "n"), ("Gaudin–Schuhmann", "m")):
        fit = number(rf"{law} .*{exponent} = (\S+) ± ([^\s,]+), at most (\S+) %", text)
        found[law] = dict(zip(("exponent", "error", "largest_difference_percent"), fit, strict=True)) if fit else None
    return found


def test(program, document, options):
    with laboratory.run(program, document, options) as (path, file, seconds):
        samples = file["samples"]
        found = {"wall_s": seconds, "particles": len(file["particles/radius"]), "steps": int(samples["step"][-1])}
        if "stage" not in document and "area" not in document.get("loading", {}):
            return found | fragments(program, path)
        found["peak_stress_pa"] = float(np.max(np.abs(samples["stress"])))
        if len(document.get("stage", [1])) == 1:
            return found | emissions(program, path, samples)
        ends = [float(end) for end in re.findall(r": (\S+) s, step", file["provenance"].attrs["stages_ended"])]
        return found | {"reloadings": reloadings(program, path, ends)}


def cases():
    for seed in SEEDS:
        yield f"pressed, seed {seed}", (pressed, SMALL, seed)
        yield f"in cycles, seed {seed}", (pressed, SMALL, seed)
    for seed in FEW:
        yield f"pressed, equal strengths, seed {seed}", (pressed, SMALL, seed, False)
        yield f"pressed, large, seed {seed}", (pressed, LARGE, seed)
    yield "thrown, small, 8 m/s, seed 1", (thrown, SMALL, 8, 1)
    for seed in FEW:
        yield f"in cycles, slow, seed {seed}", (pressed, SMALL, seed)
    for seed in SEEDS:
        for velocity in VELOCITIES:
            yield f"thrown, {velocity} m/s, seed {seed}", (thrown, BALL, velocity, seed)
        yield f"split, seed {seed}", (split, seed)
        yield f"crushed, seed {seed}", (crushed, seed)


CASES = dict(cases())
REDUCED = ["pressed, seed 1", "in cycles, seed 1", "thrown, small, 8 m/s, seed 1", "crushed, seed 1"]


def study(names, known, save, about, program, options):
    for case in names:
        if case in known:
            continue
        build, *arguments = CASES[case]
        if case.startswith("in cycles"):
            # To 0.1 MPa, of the run without cycles, which comes before.
            strength = known[f"pressed, seed {arguments[1]}"]["peak_stress_pa"]
            arguments += [True, [round(level * strength, -5) for level in LEVELS], SLOW if "slow" in case else FAST]
        known[case] = test(program, build(*arguments), options) | about
        save()
        print(f"{case}: {known[case]}", flush=True)


def missing(known):
    return [case for case in CASES if case not in known]


def pressings(known, kind, seeds):
    return [known[f"{kind}, seed {seed}"] for seed in seeds]


def mean(values):
    """Mean and standard error."""
    return float(np.mean(values)), float(np.std(values, ddof=1) / len(values) ** 0.5)


def pooled(runs, part):
    """b and its standard error of a part of the emissions of some runs together: the excess over the magnitude of completeness adds up."""
    counting = sum(run["b_of"][part][1] for run in runs)
    b = counting / sum(count / b for b, count in (run["b_of"][part] for run in runs))
    return b, b / counting**0.5


PRESSED = {"pressed": SEEDS, "pressed, equal strengths": FEW, "pressed, large": FEW}
# Laws of the sieve curve, and the smallest velocity at which they can be fitted.
LAWS = {"Rosin–Rammler": 8, "Gaudin–Schuhmann": 8}
CYCLES = {"in cycles": SEEDS, "in cycles, slow": FEW}


def cycles(known, kind, seeds):
    """For each level: Felicity ratios of all seeds, and all emissions before, while unloading, while reloading, and below the former stress."""
    runs = pressings(known, kind, seeds)
    for number, level in enumerate(LEVELS):
        stages = [run["reloadings"][number] for run in runs]
        counts = [sum(stage[f"emissions_{name}"] for stage in stages) for name in ("before", "unloading", "reloading", "below")]
        yield level, [stage["felicity_ratio"] for stage in stages], counts


def impacts(known, velocity):
    return [known[f"thrown, {velocity} m/s, seed {seed}"] for seed in SEEDS]


def exponents(known, velocity, law):
    return [run[law]["exponent"] for run in impacts(known, velocity) if run[law]]


def table(known):
    """The recorded values as rows of the tables in docs/book/evidence/emissions.md."""
    if missing(known):
        return
    for kind, seeds in PRESSED.items():
        runs = pressings(known, kind, seeds)
        particles, strength, emitted, single = (np.mean([run[name] for run in runs]) for name in ("particles", "peak_stress_pa", "emissions", "single"))
        b, error = mean([run["b"] for run in runs])
        parts = " | ".join("{:.2f} ± {:.2f}".format(*pooled(runs, part)) for part in ("longer", "larger", "before_peak", "after_peak", "single"))
        print(f"| {kind} | {particles:.0f} | {strength * 1e-6:.1f} | {emitted:.0f} | {single / emitted:.2f} | {b:.2f} ± {error:.2f} | {parts} |")
        print("    " + ", ".join(f"{run['b']:.2f} ± {run['b_error']:.2f} ({run['counting']}, at most {run['most_breaks']} breaks)" for run in runs))
    for kind, seeds in CYCLES.items():
        for level, ratios, counts in cycles(known, kind, seeds):
            print(f"| {kind} | {level} | {min(ratios):.3f} to {max(ratios):.3f}, mean {np.mean(ratios):.3f} | " + " | ".join(str(count) for count in counts) + " |")
    for velocity in VELOCITIES:
        runs = impacts(known, velocity)
        single, largest = (np.mean([run[name] for run in runs]) for name in ("single_share", "largest_share"))
        laws = [", ".join(f"{run[law]['exponent']:.2f} ± {run[law]['error']:.2f} ({run[law]['largest_difference_percent']} %)" if run[law] else "–" for run in runs)
                for law in ("Rosin–Rammler", "Gaudin–Schuhmann")]
        print(f"| {velocity} | {single:.2f} | {largest:.2f} | {laws[0]} | {laws[1]} |")
    for name, value in plates(known).items():
        print(f"| {name} | {value[0]:.3f} ± {value[1]:.3f} |")


def plates(known):
    """Mean and standard error over the packings of what the disc and the agglomerate between plates give."""
    discs, grains = ([known[f"{name}, seed {seed}"] for seed in SEEDS] for name in ("split", "crushed"))
    return {"splitting strength, MPa": mean([1e-6 * run["peak_stress_pa"] for run in discs]), "b of a disc": mean([run["b"] for run in discs]),
            "single particles": mean([run["single_share"] for run in grains]), "largest fragment": mean([run["largest_share"] for run in grains]),
            **{law: mean([run[law]["exponent"] for run in grains]) for law in LAWS}}


def check_same(found, known):
    """Differences from the recorded values, as messages."""
    return [f"{case}: {quantity} is {value!r}, but the recorded value is {known[case][quantity]!r}. If that is meant, remove the case from the results "
            "and run the full study again"
            for case, values in found.items() for quantity, value in values.items() if quantity != "wall_s" and not same(value, known[case][quantity])]


def same(now, then):
    """Results are bitwise equal on all machines; recorded values have 17 digits. Means of a library may be rounded otherwise."""
    if isinstance(now, dict):
        return now.keys() == then.keys() and all(same(now[key], then[key]) for key in now)
    if isinstance(now, list | tuple):
        return len(now) == len(then) and all(same(*pair) for pair in zip(now, then, strict=True))
    return now == then if now is None or then is None else abs(now - then) <= 1e-12 * abs(then)


def check_record(known):
    """Statements of the book about the values on record that do not hold, as messages."""
    if missing(known):
        return [f"not on record: {', '.join(missing(known))}"]
    wrong = []

    def demand(holds, what):
        if not holds:
            wrong.append(what)

    for kind, seeds in PRESSED.items():
        runs = pressings(known, kind, seeds)
        values = [run["b"] for run in runs]
        # The range that the book gives.
        demand(all(1.2 <= b <= 1.7 for b in values), f"{kind}: b-values {values}")
        # The numbers bend: a later start gives a steeper line, by more than three standard errors.
        (larger, error), all_ = pooled(runs, "larger"), mean(values)[0]
        demand(larger - 3 * error > all_, f"{kind}: b is {larger} from larger magnitudes, {all_} from the smaller ones on")
        # So does the time that an emission lasts, the other way round.
        longer, error = pooled(runs, "longer")
        demand(longer + 3 * error < all_, f"{kind}: b is {longer} from longer emissions, {all_} by default")
        (before, first), (after, second) = pooled(runs, "before_peak"), pooled(runs, "after_peak")
        demand(before - after > 3 * float(np.hypot(first, second)), f"{kind}: b does not fall at the peak: {before} and {after}")
        # Most emissions are one bond.
        demand(all(run["single"] > 0.8 * run["emissions"] for run in runs), f"{kind}: emissions of one bond")
    for kind, seeds in CYCLES.items():
        for level, ratios, (before, unloading, _, below) in cycles(known, kind, seeds):
            # Emissions begin late by the distance of two emissions, and by what damps.
            demand(all(1 <= ratio <= 1.05 for ratio in ratios), f"{kind}: Felicity ratios at {level} of the strength: {ratios}")
            demand(below == 0 and unloading < 0.05 * before, f"{kind}, {level} of the strength: {before} emissions before, {unloading} while unloading, "
                   f"{below} when loaded again")
    for law, slowest in LAWS.items():
        by_velocity = [float(np.mean(exponents(known, velocity, law))) for velocity in VELOCITIES if velocity >= slowest]
        demand(all(fast < slow for slow, fast in zip(by_velocity, by_velocity[1:], strict=False)), f"{law}: exponents over the velocity {by_velocity}")
    discs = plates(known)
    b, error = discs["b of a disc"]
    cylinders, other = mean([run["b"] for run in pressings(known, "pressed", SEEDS)])
    demand(abs(b - cylinders) < 3 * float(np.hypot(error, other)), f"discs have b {b}, cylinders {cylinders}")
    # The slope of crushed sand, 0.5.
    exponent, error = discs["Gaudin–Schuhmann"]
    demand(abs(exponent - 0.5) < 2 * error, f"crushed agglomerates have the exponent {exponent} ± {error}")
    return wrong


def main():
    studies.run(__file__, __doc__, laboratory.PROGRAM, RESULTS, full=partial(study, CASES), reduced=partial(study, REDUCED),
                check_reduced=check_same, check_record=check_record, table=table)


if __name__ == "__main__":
    main()
