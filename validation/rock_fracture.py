#!/usr/bin/env python3
"""Rock in tension: the fracture energy of notched prisms over the size of their particles, and the strength of cells over their volume.

    validation/rock_fracture.py [--full | --table]

Each case is one run of the program. Results are written to validation/results/rock_fracture.json after every case, so that an interrupted
study continues where it stopped. Without --full, the smallest cases run with the same code and must reproduce the recorded values, and the
statements about the values on record are checked.
"""

import tempfile
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

import laboratory
from concordem_validate import study as studies

RESULTS = Path(__file__).resolve().parent / "results/rock_fracture.json"

# A prism pulled along z, with a notch from one side at half its length, mm. Its ends move without rotation, so that the whole ligament opens
# and the load falls to nothing; a bent beam keeps a compressed zone.
DEPTH, THICKNESS, LENGTH, NOTCH = 30.0, 20.0, 32.0, 10.0
LIGAMENT = (DEPTH - NOTCH) * THICKNESS * 1e-6
# Layers that are moved, mm, the same for all particles.
LAYER = 6.5
# Spheres of the periodic packings. Diameters of the spheres of prisms, mm, with as many packings, and prisms that are cut from each: the parts of
# the cell in which they would crack hardly overlap. Few large particles scatter more, and are cheaper.
SPHERES = 2000
DIAMETERS = {4.0: (6, 4), 2.0: (5, 2), 1.0: (2, 2)}
PLACES = ((0, 0, 0), (0.5, 0.5, 0.5), (0, 0.5, 0), (0.5, 0, 0.5))
# Strain rate, 1/s, and the stress at which a prism counts as broken, over its strength.
RATE, BROKEN = 5.0, 0.03

# Spheres of periodic cells, of a diameter of 2 mm; packings of each; their strain rate, 1/s; Weibull moduli of the strengths of their bonds, 0 for
# equal strengths. Bars would be cut, and the soft skin of small ones would make their strength rise with the volume.
CELLS, CELL_SEEDS, CELL_RATE = (80, 160, 320, 640), range(1, 11), 1.0
MODULI = (0, 4)

BEAM = {"young": "60 GPa", "radius_ratio": 0.8, "tensile_strength": "10 MPa", "cohesion": "25 MPa", "friction_angle": "35 deg", "moment_share": 0.2}
KINDS = ("exponential", "linear", "equal energies", "brittle")
FRICTION = {"young": "60 GPa", "stiffness_ratio": 0.4, "friction_coefficient": 0.6}
# Energies of bonds, J/m². In tension, a bond of the largest particles stores 1/17 of it at its strength.
ENERGY = 60.0
SOFTENING = {"fracture_energy": ENERGY, "shear_fracture_energy": 5 * ENERGY, "mixture_exponent": 2}


def prisms():
    """Kind of bonds, diameter (mm), seed, place in the packing, and rate over the usual one."""
    for diameter, (packings, places) in DIAMETERS.items():
        for seed in range(1, packings + 1):
            for place in range(places):
                for kind in KINDS:
                    # The finest prisms take a minute each.
                    if diameter > 1 or kind == "exponential" or (place == 0 and kind != "linear"):
                        yield f"{kind}, {diameter:g} mm, packing {seed}, place {place}", (kind, diameter, seed, place, 1.0)
    for place in range(2):
        yield f"half the rate, 2 mm, packing 1, place {place}", ("exponential", 2.0, 1, place, 0.5)


PRISMS = dict(prisms())
CELL_CASES = {f"cell of {count} spheres, modulus {modulus}, seed {seed}": (count, modulus, seed)
              for count in CELLS for seed in CELL_SEEDS for modulus in MODULI}
CASES = PRISMS | CELL_CASES
REDUCED = [f"{kind}, 4 mm, packing 1, place 0" for kind in ("exponential", "linear", "brittle")] + ["cell of 80 spheres, modulus 4, seed 1"]


@lru_cache
def packing(seed, count=SPHERES):
    """Centers and edges of a periodic packing of spheres of a diameter of 1, which serves particles of all sizes."""
    import concordem

    found = concordem.Scenario.from_dict({
        "version": 1, "packing": {"kind": "random-dense", "count": count, "radius": "0.5 mm", "seed": seed, "shape": {"kind": "periodic"}},
        "material": [{"name": "rock", "density": "4100 kg/m^3", "frictional": FRICTION}], "contacts": {"law": "frictional"},
        "stop": {"steps": 1}}).pack(threads=1)
    return found.positions * 1e3, np.diag(found.cell) * 1e3


def rock(centers, edges, diameter, law, beam, folder):
    """Bonded spheres of a periodic packing, without loading."""
    import concordem

    path = Path(folder) / "spheres.txt"
    centers, edges, radius = centers * diameter * 1e-3, edges * diameter * 1e-3, 0.5e-3 * diameter
    concordem.packing.write(path, centers, np.full(len(centers), radius), np.diag(edges))
    return {
        "version": 1, "title": "Rock in tension",
        "packing": {"kind": "file", "path": str(path), "cell": [float(edge) for edge in edges]},
        "material": [{"name": "rock", "density": "4100 kg/m^3", law: beam, "frictional": FRICTION}],
        "bonds": {"law": law, "interaction_ratio": 1.1},
        # Faces of a crack do not touch: those of the notch would press on each other as they did in the packing.
        "contacts": {"law": "frictional", "exclude": [["rock", "rock"]]},
        "integration": {"damping": {"kind": "local", "coefficient": 0.1}},
        "output": {"sample_interval": 10},
    }


def prism(kind, diameter, seed, place, rate, folder):
    """A notched prism with bonds of a kind, cut from a place of a packing, at a multiple of the usual rate."""
    centers, edges = packing(seed)
    centers = (centers + PLACES[place] * edges) % edges
    beam = BEAM | SOFTENING | {"softening": "linear" if kind == "linear" else "exponential"}
    if kind == "equal energies":
        beam["shear_fracture_energy"] = ENERGY
    law, beam = ("cohesive_beam", BEAM) if kind == "brittle" else ("softening_beam", beam)
    document = rock(centers, edges, diameter, law, beam, folder)
    document["packing"]["shape"] = laboratory.box(DEPTH, THICKNESS, LENGTH)
    document["cut"] = [{"shape": {"kind": "parallelogram", "corner": [f"{-DEPTH / 2 - 1} mm", f"{-THICKNESS / 2 - 1} mm", 0],
                                  "edges": [[f"{NOTCH + 1} mm", 0, 0], [0, f"{THICKNESS + 2} mm", 0]]}}]
    document["loading"] = {"kind": "uniaxial", "axis": "z", "strain_rate": f"{RATE * rate} 1/s", "layer_thickness": f"{LAYER} mm"}
    # The load of brittle bonds swings as they break.
    document["stop"] = {"strain": 8e-4} if kind == "brittle" else {"strain": 5e-3, "drop_to": BROKEN}
    return document


def cell(count, modulus, seed, folder):
    """A periodic cell of brittle bonds whose strengths have a Weibull modulus, pulled along z, without stress along x and y."""
    document = rock(*packing(seed, count), 2.0, "cohesive_beam", BEAM, folder)
    if modulus:
        document["material"][0]["strength_scatter"] = {"weibull_modulus": modulus, "seed": seed}
    document["loading"] = {"kind": "cell-stress", "stress": [[0, 0, 0]] * 3, "strain_rate": ["free", "free", f"{CELL_RATE} 1/s"],
                           "maximum_strain_rate": "100 1/s"}
    document["stop"] = {"strain": 1e-3, "drop_to": 0.5}
    return document


def shares(file, diameter):
    """Of the bonds: area that crosses the ligament per its area, and share of the energy dissipated more than two diameters from its plane."""
    law = next(name for name in file["contacts"] if not name.startswith("unbonded"))
    table = {name: file[f"contacts/{law}/{name}"][()] for name in ("position", "branch", "area")}
    # Mean number of bonds above the ligament that cross a plane within a quarter of the length between the grips.
    half = 1e-3 * (LENGTH / 2 - LAYER) / 2
    middle, reach = table["position"][:, 2], 0.5 * np.abs(table["branch"][:, 2])
    inside = np.clip(np.minimum(middle + reach, half) - np.maximum(middle - reach, -half), 0, None) / (2 * half)
    over = table["position"][:, 0] > 1e-3 * (NOTCH - DEPTH / 2)
    found = {"bonds": len(middle), "bond_area_over_ligament": float(np.sum((inside * table["area"])[over]) / LIGAMENT)}
    if law == "softening_beam":
        energy = file[f"contacts/{law}/history_dissipated"][()]
        found["far_energy_share"] = float(np.sum(energy[np.abs(middle) > 2e-3 * diameter]) / np.sum(energy))
    return found


def test(program, case, options):
    """The figures of one run."""
    with tempfile.TemporaryDirectory() as folder:
        document = prism(*PRISMS[case], folder) if case in PRISMS else cell(*CELL_CASES[case], folder)
        with laboratory.run(program, document, options) as (_, file, seconds):
            return {"wall_s": seconds} | (measured(file, PRISMS[case][1]) if case in PRISMS else strength(file))


def strength(file):
    """Strength of a cell, and bonds broken by then."""
    samples = file["samples"]
    peak = int(np.argmax(samples["stress"]))
    return {"particles": len(file["particles/radius"]), "steps": int(samples["step"][-1]), "peak_stress_pa": float(samples["stress"][peak]),
            "strain_at_peak": float(samples["strain"][peak]), "broken_at_peak": int(samples["broken"][peak])}


def measured(file, diameter):
    """Strength of a prism, and the energies dissipated per area of its ligament."""
    samples = file["samples"]
    last = {name: float(values[-1]) for name, values in samples.items()}
    stored = sum(last[f"stored_{name}"] - float(samples[f"stored_{name}"][0]) for name in ("normal", "shear", "bending", "twist"))
    work = last["boundary_work"] - stored - last["kinetic"] + float(samples["kinetic"][0])
    return {
        "particles": len(file["particles/radius"]), "steps": int(last["step"]),
        "peak_stress_pa": float(np.max(samples["stress"])) * DEPTH * THICKNESS * 1e-6 / LIGAMENT,
        "fracture_energy_j_per_m2": last["damage"] / LIGAMENT, "work_j_per_m2": work / LIGAMENT,
        "damping_share": last["numerical_damping"] / last["boundary_work"], "kinetic_share": last["kinetic"] / last["boundary_work"],
        "last_stress_over_peak": last["stress"] / float(np.max(samples["stress"])), "last_strain": last["strain"]} | shares(file, diameter)


def study(names, known, save, about, program, options):
    for case in names:
        if case in known:
            continue
        known[case] = test(program, case, options) | about
        save()
        print(f"{case}: {known[case]}", flush=True)


def missing(known):
    return [case for case in CASES if case not in known]


def check_same(found, known):
    """Differences from the recorded values, as messages."""
    return [f"{case}: {quantity} is {values[quantity]!r}, but the recorded value is {known[case][quantity]!r}. If that is meant, remove the case "
            "from the results and run the full study again"
            for case, values in found.items() for quantity in {"peak_stress_pa", "fracture_energy_j_per_m2", "steps"} & values.keys()
            # Results are bitwise equal on all machines; recorded values have 17 digits.
            if abs(values[quantity] - known[case][quantity]) > 1e-12 * abs(known[case][quantity])]


def figures(known, kind, diameter):
    """Prisms of a kind and their strength (MPa), fracture energy (J/m²), its ratio to that of a bond, and area of bonds over the ligament: mean
    and standard error; and the median of the energy. None without prisms."""
    found = [known[case] for case in PRISMS if case.startswith(f"{kind}, {diameter:g} mm")]
    if not found:
        return None
    energy = np.array([case["fracture_energy_j_per_m2"] for case in found])
    return {"prisms": len(found), "strength": mean([case["peak_stress_pa"] * 1e-6 for case in found]), "energy": mean(energy),
            "median": float(np.median(energy)), "over_bond": mean(energy / ENERGY),
            "bond_area": mean([case["bond_area_over_ligament"] for case in found])}


def mean(values):
    """Mean and standard error."""
    return float(np.mean(values)), float(np.std(values, ddof=1) / len(values) ** 0.5)


def size_effect(known, modulus):
    """Slope of the logarithm of the strength over that of the volume, with its standard error, and mean strengths (MPa)."""
    cases = [(count, known[f"cell of {count} spheres, modulus {modulus}, seed {seed}"]) for count in CELLS for seed in CELL_SEEDS]
    (_, slope), (_, error) = laboratory.line(np.log([count for count, _ in cases]), np.log([case["peak_stress_pa"] for _, case in cases]))
    means = [mean([case["peak_stress_pa"] * 1e-6 for count, case in cases if count == one]) for one in CELLS]
    broken = [float(np.mean([case["broken_at_peak"] for count, case in cases if count == one])) for one in CELLS]
    return float(slope), float(error), means, broken


def halved(known):
    """Fracture energies at half the rate over those at the usual rate."""
    return [known[case]["fracture_energy_j_per_m2"] / known[case.replace("half the rate", "exponential")]["fracture_energy_j_per_m2"]
            for case in PRISMS if case.startswith("half the rate")]


def table(known):
    """The recorded values as rows of the tables in docs/book/evidence/cohesive-beam.md."""
    if missing(known):
        return
    show = lambda pair, digits: f"{pair[0]:.{digits}f} ± {pair[1]:.{digits}f}"
    for kind in KINDS:
        for diameter in DIAMETERS:
            if found := figures(known, kind, diameter):
                digits = 2 if kind == "brittle" else 0
                print(f"| {kind} | {diameter:g} | {found['prisms']} | {show(found['strength'], 2)} | {show(found['energy'], digits)} | "
                      f"{found['median']:.{digits}f} | {show(found['over_bond'], 3 if digits else 2)} | {found['bond_area'][0]:.2f} |")
    print("half the rate over the usual one:", ", ".join(f"{one:.3f}" for one in halved(known)))
    softening = [known[case] for case, (kind, *_) in PRISMS.items() if kind != "brittle"]
    print(f"work over energy: at most {max(one['work_j_per_m2'] / one['fracture_energy_j_per_m2'] for one in softening):.3f}; damping: at most "
          f"{max(one['damping_share'] for one in softening):.3f} of the work; motion at the end: {max(one['kinetic_share'] for one in softening):.3f}")
    for modulus in MODULI:
        slope, error, means, broken = size_effect(known, modulus)
        print(f"| {modulus or 'equal'} | " + " | ".join(show(one, 2) for one in means) + f" | {slope:.3f} ± {error:.3f} | "
              + ", ".join(f"{one:.0f}" for one in broken) + " |")


def check_record(known):
    """Statements of the book about the values on record that do not hold, as messages."""
    if missing(known):
        return [f"not on record: {', '.join(missing(known))}"]
    wrong = [f"{case}: not broken at the end" for case, (kind, *_) in PRISMS.items() if kind != "brittle" and known[case]["last_stress_over_peak"] > 0.06]
    energies = [figures(known, "exponential", diameter)["energy"][0] for diameter in DIAMETERS]
    # Over a factor of 4 in size, within 10 % of their mean.
    if max(abs(energy / np.mean(energies) - 1) for energy in energies) > 0.1:
        wrong.append(f"fracture energies: {energies}")
    # The rest of the work went into damping.
    wrong += [f"{case}: the work is {known[case]['work_j_per_m2']} J/m²" for case, (kind, *_) in PRISMS.items()
              if kind in ("exponential", "linear") and not 1 < known[case]["work_j_per_m2"] / known[case]["fracture_energy_j_per_m2"] < 1.04]
    if any(abs(ratio - 1) > 0.03 for ratio in halved(known)):
        wrong.append(f"half the rate: {halved(known)}")
    # Bonds that break at once: the energy rises with the size.
    energies = [figures(known, "brittle", diameter)["energy"][0] for diameter in DIAMETERS]
    if not all(1.5 < large / small < 2.1 for large, small in zip(energies, energies[1:], strict=False)):
        wrong.append(f"fracture energies of brittle bonds: {energies}")
    # Strengths that scatter do not make a cell a weakest link, whose slope is -1/4.
    slopes = [size_effect(known, modulus)[0] for modulus in MODULI]
    if any(abs(slope) > 0.05 for slope in slopes):
        wrong.append(f"slopes of the strength over the volume: {slopes}")
    return wrong


def main():
    studies.run(__file__, __doc__, laboratory.PROGRAM, RESULTS, full=partial(study, CASES), reduced=partial(study, REDUCED),
                check_reduced=check_same, check_record=check_record, table=table)


if __name__ == "__main__":
    main()
