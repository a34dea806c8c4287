#!/usr/bin/env python3
"""Time per step in LAMMPS with the bond styles concordem/..., relative to `bpm/rotational`.

Both run the same spheres and bonds and check a breakage criterion at every step, which is never met. In the open box on one
processor, our own solver is also timed (rust-core/app/examples/speed: whole steps, with neighbor search and damping).

Prints the median of several rounds. Rounds alternate between the styles, so that a busy machine slows them equally. On one
processor the time is CPU time (LAMMPS' "CPU use"); on several it is wall time, because MPICH waits actively. --shuffled: ids in random
order, as in data files of many programs; LAMMPS sorts its atoms in space. --json FILE writes the figures.
--rebuild: instead, the time of a rebuild of our bonds, in steps: runs that rebuild the lists in every step, minus runs that never do,
minus the same difference without our bonds; also on two processors, in a lattice that moves across their borders by half a skin per rebuild.
--impact: instead, processor time of whole runs of the example bpm/impact with our beams
and with those of LAMMPS. From the fastest round each.
  liggghts-bridge/lammps/compare_speed.py --docs | --check   prints the blocks for docs/book/evidence/lammps.md from the results files, or fails
                                                             if they are not up to date
  liggghts-bridge/lammps/compare_speed.py [--rounds 5] [--edge 22] [--processors 1 2] [--shuffled] [--rebuild | --impact] [--json FILE]
"""
import argparse
import itertools
import json
import math
import os
import random
import re
import statistics
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.join(HERE, "../..")
sys.path.insert(0, os.path.join(ROOT, "validation"))
from concordem_validate import provenance

RESULTS = os.path.join(ROOT, "validation/results/lammps-speed.json")
REBUILDS = os.path.join(ROOT, "validation/results/lammps-rebuild.json")
DOCS = os.path.join(ROOT, "docs/book/evidence/lammps.md")
VENV = os.path.join(ROOT, ".venv-lammps/bin")
PLUGINS = os.path.join(os.environ.get("CARGO_TARGET_DIR", os.path.join(ROOT, "target")), "lammps")
SPACING = 0.01
RADIUS = 0.005
YOUNG, POISSON, RATIO = 30e9, 0.2, 0.5
SKIN, DT = 0.001, 1e-7
STEPS = 100
HEAD = f"""units si
atom_style bpm/sphere
atom_modify sort 0 0
boundary {{boundary}}
newton off
comm_modify vel yes
read_data {{data}}
special_bonds lj 0 1 1 coul 1 1 1
neighbor {SKIN} bin
neigh_modify delay 0
comm_modify cutoff 0.018
timestep {DT}
"""
# Only LAMMPS' own style needs the integration of the atoms' quaternions.
INTEGRATORS = {True: "fix integrate all nve/bpm/sphere\n", False: "fix integrate all nve/sphere\n"}


def rotational():
    """Commands for bpm/rotational: stiffnesses of the same Euler-Bernoulli beam (N/m, N m), thresholds that are never met."""
    radius = RATIO * RADIUS
    area, bending = math.pi * radius**2, math.pi * radius**4 / 4
    axial = YOUNG * area / SPACING
    shear = 12 * YOUNG * bending / SPACING**3
    torsion = YOUNG / (2 * (1 + POISSON)) * 2 * bending / SPACING
    bend = YOUNG * bending / SPACING
    return (f"bond_style bpm/rotational smooth no\n"
            f"bond_coeff 1 {axial} {shear} {torsion} {bend} 1e6 1e6 1e6 1e6 0 0 0 0\n")


STYLES = {
    "bpm/rotational": rotational(),
    "concordem/cohesive_beam": "bond_style concordem/cohesive_beam\n"
    f"bond_coeff * young {YOUNG} poisson {POISSON} radius_ratio {RATIO} tensile_strength 1e12\n",
    "concordem/cpm": "bond_style concordem/cpm\n"
    "bond_coeff * young 30e9 shear_ratio 0.2 cohesion 4.5e6 friction_coefficient 0.8 crack_onset_strain 1 relative_ductility 10\n",
    "concordem/linear_bond": "bond_style concordem/linear_bond\nbond_coeff * normal_stiffness 1e6 shear_stiffness 4e5\n",
}


def packing(path, edge, neighbors, periodic, shuffled=False, speed=0.0):
    """Write a cubic lattice with 3 (face) or 9 (face and edge) bonds per sphere to `path`, which moves along x (m/s); return the number of
    bonds."""
    ids = list(range(1, edge**3 + 1))
    if shuffled:
        random.Random(1).shuffle(ids)
    steps = [s for s in itertools.product((-1, 0, 1), repeat=3) if s > (0, 0, 0) and sum(map(abs, s)) <= (1 if neighbors == 3 else 2)]
    assert len(steps) == neighbors
    bonds = []
    for x, y, z in itertools.product(range(edge), repeat=3):
        for a, b, c in steps:
            if not periodic and not all(0 <= v < edge for v in (x + a, y + b, z + c)):
                continue
            other = (x + a) % edge + ((y + b) % edge) * edge + ((z + c) % edge) * edge**2
            bonds.append((ids[x + y * edge + z * edge**2], ids[other]))
    with open(path, "w") as out:
        out.write(f"packing\n\n{edge**3} atoms\n1 atom types\n{len(bonds)} bonds\n1 bond types\n20 extra bond per atom\n"
                  "30 extra special per atom\n\n")
        for axis in "xyz":
            # A box that is not periodic needs a margin around the spheres.
            margin = 0.0 if periodic else SPACING
            out.write(f"{-margin} {edge * SPACING + margin} {axis}lo {axis}hi\n")
        out.write("\nAtoms\n\n")
        for k in range(edge**3):
            x, y, z = (k % edge, k // edge % edge, k // edge**2)
            out.write(f"{ids[k]} 1 1 {2 * RADIUS} 2500 {x * SPACING:.17g} {y * SPACING:.17g} {z * SPACING:.17g}\n")
        out.write("\nVelocities\n\n")
        for k in range(edge**3):
            v = [((k * a) % 1009 / 1009 - 0.5) * 0.02 for a in (7919, 104729, 1299709)]
            out.write(f"{ids[k]} {v[0] + speed:.17g} {v[1]:.17g} {v[2]:.17g} 0 0 0\n")
        out.write("\nBonds\n\n")
        for k, (a, b) in enumerate(bonds):
            out.write(f"{k + 1} 1 {a} {b}\n")
    return len(bonds)


OWN = {f"our solver, {law}": law for law in ("cohesive_beam", "cpm", "linear_bond", "deformable")}


def own(folder, law, edge, neighbors):
    """Time per step (s) of our solver on one thread, and the number of bonds, for the lattice of `packing`."""
    path = os.path.join(folder, "lattice.txt")
    with open(path, "w") as out:
        for k in range(edge**3):
            out.write(" ".join(f"{v * SPACING:.17g}" for v in (k % edge, k // edge % edge, k // edge**2)) + f" {RADIUS}\n")
    command = [os.path.join(os.environ.get("CARGO_TARGET_DIR", os.path.join(ROOT, "target")), "release/examples/speed"), path, law, "--ratio", "1.05" if neighbors == 3 else "1.5", "--steps", str(2 * STEPS)]
    found = json.loads(subprocess.run(command, cwd=ROOT, env=dict(os.environ, RAYON_NUM_THREADS="1"), check=True, capture_output=True,
                                      text=True).stdout)
    return found["ns_per_bond_step_median"] * found["bonds"] * 1e-9, found["bonds"]


def run(folder, style, data, boundary, processors, shuffled=False, lists=None):
    with open(os.path.join(folder, "in"), "w") as out:
        head = HEAD.format(data=data, boundary=boundary) + INTEGRATORS[style.startswith("bpm")] + STYLES[style]
        if lists:
            head = head.replace("neigh_modify delay 0", lists)
        if shuffled:
            head = head.replace("sort 0 0", f"sort 1000 {1.2 * SPACING}")
        out.write(head + f"thermo {STEPS}\nrun 20\nrun {STEPS}\n")
    printed = subprocess.run(
        [os.path.join(VENV, "mpirun"), "-np", str(processors), os.path.join(VENV, "lmp"), "-in", "in", "-log", "none"],
        cwd=folder, env=dict(os.environ, LAMMPS_PLUGIN_PATH=PLUGINS), check=True, capture_output=True, text=True).stdout
    seconds = float(re.findall(r"Loop time of (\S+)", printed)[-1])
    if processors == 1:
        seconds *= float(re.findall(r"([\d.]+)% CPU use", printed)[-1]) / 100
    part = {name: float(share) for name, share in re.findall(r"^(\w+) +\| .*\| +([\d.]+)$", printed.split("Loop time")[-1], re.M)}
    return seconds / STEPS, part.get("Comm", float("nan"))


def rebuilds(folder, edge, rounds, moving):
    """Time of a rebuild over that of a step, for our styles on a lattice with nine bonds per sphere: open, at rest, on one processor; or
    periodic, moving across the border of two by half a skin per step."""
    bonds = packing(os.path.join(folder, "data"), edge, 9, moving, speed=0.5 * SKIN / DT if moving else 0.0)
    boundary, processors = ("p p p", 2) if moving else ("f f f", 1)
    STYLES["zero"] = "bond_style zero\nbond_coeff *\n"
    lists = {"never": "neigh_modify every 1000 delay 1000", "always": "neigh_modify every 1 delay 0 check no"}
    styles = ("zero", "concordem/cohesive_beam", "concordem/cpm", "concordem/linear_bond")
    best = {(style, when): math.inf for style in styles for when in lists}
    for _ in range(rounds):
        for style, when in best:
            best[style, when] = min(best[style, when], run(folder, style, "data", boundary, processors, lists=lists[when])[0])
    host = best["zero", "always"] - best["zero", "never"]
    for style in styles[1:]:
        # A whole step of LAMMPS, with our bonds; LAMMPS' own rebuild is subtracted.
        step, rebuild = best[style, "never"], best[style, "always"] - best[style, "never"] - host
        yield {"style": style, "spheres": edge**3, "bonds": bonds, "processors": processors, "moving": moving, "step_s": step, "rebuild_s": rebuild, "rebuild_in_steps": rebuild / step}
        where = "moving, 2 processors" if moving else "at rest, 1 processor"
        print(f"{where}: {style:26} step {step * 1e3:6.1f} ms, rebuild {rebuild * 1e3:6.1f} ms: {rebuild / step:.2f} steps", flush=True)


def impacts(rounds):
    """Processor time (s) of whole runs of bpm/impact, and the bonds that are left."""
    best = {}
    for _ in range(rounds):
        for bonds in ("bpm", "concordem"):
            before = os.times()
            printed = subprocess.run(
                [os.path.join(VENV, "mpirun"), "-np", "1", os.path.join(VENV, "lmp"), "-log", "none", "-var", "bonds", bonds,
                 "-in", os.path.join(ROOT, "liggghts-bridge/examples/bpm-impact-lammps.in")],
                cwd=ROOT, env=dict(os.environ, LAMMPS_PLUGIN_PATH=PLUGINS), check=True, capture_output=True, text=True).stdout
            after = os.times()
            seconds = after.children_user + after.children_system - before.children_user - before.children_system
            last = [line.split() for line in printed.splitlines() if re.match(r" *\d+( +-?[\d.e+-]+){7} *$", line)][-1]
            if bonds not in best or seconds < best[bonds]["processor_s"]:
                best[bonds] = {"bonds": bonds, "processor_s": seconds, "bond_ends_left": float(last[6]), "speed": float(last[7])}
    for found in best.values():
        print(f"bpm/impact with the bonds of {found['bonds']:9}: {found['processor_s']:6.2f} s", flush=True)
        yield found


def blocks():
    """Blocks of the docs from the results files, each between comment lines that name it."""
    with open(RESULTS) as file:
        speed = json.load(file)
    with open(REBUILDS) as file:
        rebuilt = json.load(file)

    def found(style, boundary, neighbors, processors=1):
        return next(f for f in speed["figures"] if f["style"] == style and f["boundary"] == boundary and f["processors"] == processors
                    and round(f["bonds"] / f["spheres"] / 3) == neighbors // 3)

    ours = ["cohesive_beam", "cpm", "linear_bond"]
    lines = [f"{speed['machine']['model']}, medians of {len(speed['figures'][0]['ratios'])} rounds:", "",
             "| Box, bonds per sphere | `bpm/rotational` | " + " | ".join(f"`{law}`" for law in ours) + " |", "|---|---|---|---|---|"]
    for boundary, box in (("f f f", "open"), ("p p p", "periodic")):
        for neighbors in (3, 9):
            cells = [f"{found('bpm/rotational', boundary, neighbors)['ns_per_bond_step']:.0f} ns per bond"]
            for law in ours:
                figure = found(f"concordem/{law}", boundary, neighbors)
                cells.append(f"{figure['ns_per_bond_step']:.0f} ({figure['ratio']:.2f})")
            lines.append(f"| {box}, {neighbors} | " + " | ".join(cells) + " |")
    own = ["| Bonds per sphere, our solver | " + " | ".join(f"`{law}`" for law in ours) + " | `linear_bond` between deformable particles |",
           "|---|---|---|---|---|"]
    for neighbors in (3, 9):
        figures = [found(f"our solver, {law}", "f f f", neighbors) for law in (*ours, "deformable")]
        own.append(f"| {neighbors} | " + " | ".join(f"{f['ns_per_bond_step']:.0f} ({f['ratio']:.2f})" for f in figures) + " |")
    first = rebuilt["figures"][0]
    rebuild = [f"A rebuild of the bonds, when LAMMPS rebuilds its lists, in ms and in steps (target: two steps). {rebuilt['machine']['model']}, "
               f"{first['spheres']:,} spheres with up to nine bonds each, fastest of {rebuilt['rounds']} rounds.", "",
               "| Lattice | " + " | ".join(f"`{law}`" for law in ours) + " |", "|---|---|---|---|"]
    for moving, lattice in ((False, "at rest, one processor"), (True, "moving by half a skin per rebuild across the border of two processors")):
        figures = {f["style"]: f for f in rebuilt["figures"] if f["moving"] == moving}
        cells = [figures[f"concordem/{law}"] for law in ours]
        rebuild.append(f"| {lattice} | " + " | ".join(f"{f['rebuild_s'] * 1e3:.1f} ms, {f['rebuild_in_steps']:.2f}" for f in cells) + " |")
    parts = (("cost", lines), ("our solver", own), ("rebuild", rebuild))
    return ["\n".join([f"<!-- lammps/compare_speed.py: {name} -->", *part, "<!-- end -->"]) for name, part in parts]


def main():
    started = time.monotonic()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--edge", type=int)
    parser.add_argument("--processors", type=int, nargs="+")
    parser.add_argument("--shuffled", action="store_true")
    only = parser.add_mutually_exclusive_group()
    only.add_argument("--rebuild", action="store_true")
    only.add_argument("--impact", action="store_true")
    parser.add_argument("--json")
    parser.add_argument("--docs", action="store_true")
    parser.add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    if arguments.docs:
        print("\n\n".join(blocks()))
        return
    if arguments.check:
        with open(DOCS) as file:
            docs = file.read()
        for block in blocks():
            if block not in docs:
                sys.exit(f"docs/book/evidence/lammps.md does not show the results files; it should contain\n{block}")
        return
    if (arguments.rebuild or arguments.impact) and (arguments.processors or arguments.shuffled):
        parser.error("--rebuild and --impact run on one processor, with ids in order; leave --processors and --shuffled out")
    if arguments.impact and arguments.edge:
        parser.error("--impact runs the example as it is; leave --edge out")
    arguments.edge, arguments.processors = arguments.edge or 22, arguments.processors or [1, 2]
    figures = []
    with tempfile.TemporaryDirectory() as folder:
        if arguments.rebuild:
            for moving in (False, True):
                figures += rebuilds(folder, arguments.edge, arguments.rounds, moving)
        if arguments.impact:
            figures += impacts(arguments.rounds)
        cases = [] if arguments.rebuild or arguments.impact else itertools.product(("f f f", "p p p"), (3, 9))
        for boundary, neighbors in cases:
            bonds = packing(os.path.join(folder, "data"), arguments.edge, neighbors, boundary[0] == "p", arguments.shuffled)
            for processors in arguments.processors:
                ours = OWN if processors == 1 and boundary == "f f f" else {}
                found = {style: [] for style in (*STYLES, *ours)}
                for _ in range(arguments.rounds):
                    for style in STYLES:
                        found[style].append(run(folder, style, "data", boundary, processors, arguments.shuffled))
                    for name, law in ours.items():
                        step, count = own(folder, law, arguments.edge, neighbors)
                        assert count == bonds, f"{count} bonds, LAMMPS has {bonds}"
                        found[name].append((step, 0.0))
                native = [step for step, _ in found["bpm/rotational"]]
                for style, rounds in found.items():
                    ratios = [step / other for (step, _), other in zip(rounds, native)]
                    figures.append({
                        "style": style, "boundary": boundary, "spheres": arguments.edge**3, "bonds": bonds, "processors": processors,
                        "ns_per_bond_step": statistics.median(step for step, _ in rounds) / bonds * 1e9,
                        "ratio": statistics.median(ratios), "ratios": ratios,
                        "communication_percent": statistics.median(share for _, share in rounds)})
                    f = figures[-1]
                    print(f"{boundary}, {bonds} bonds on {processors}: {style:26} {f['ns_per_bond_step']:7.1f} ns per bond and step, "
                          f"{f['ratio']:.2f} of bpm/rotational (rounds {min(ratios):.2f} to {max(ratios):.2f}), "
                          f"communication {f['communication_percent']:.1f} %", flush=True)
    if arguments.json:
        with open(arguments.json, "w") as out:
            commit = subprocess.run(["git", "-C", HERE, "rev-parse", "HEAD"], capture_output=True, text=True).stdout.strip()
            machine = {"processors": os.cpu_count(), "model": provenance.processor()}
            duration = round(time.monotonic() - started)
            json.dump({"commit": commit, "machine": machine, "duration_s": duration, "load_average": os.getloadavg(), "rounds": arguments.rounds,
                       "figures": figures}, out, indent=1)
            out.write("\n")


if __name__ == "__main__":
    main()
