#!/usr/bin/env python3
"""How much faster the straight form makes the law of the tutorial in LIGGGHTS and LAMMPS, beside the same law without it.

    speed.py TREE FOLDER [ROUNDS]

A cubic lattice of 27,000 spheres that overlap a little and move at random; all contacts hold. Runs alternate, and the fastest counts.
Both laws must end with the same positions to the last bit. The times are printed and not judged, because machines differ.
"""
import re
import sys
from pathlib import Path

from distributed import Program

SIDE, STEPS, RADIUS, SPACING, DENSITY = 30, 200, 0.005, 0.00995, 2500.0
LAWS = {"scalar": "adhesive_scalar", "straight": "adhesive", "none": None}
#: A contact is held by at most a tenth of its pull-off force.
WORDS = "normal_stiffness 1e5 pull_off_force 1e2"
HEAD = {
    "liggghts": "units si\natom_style sphere\natom_modify map array sort 0 0\nboundary f f f\nnewton off\ncommunicate single vel yes\n",
    "lammps": "units si\natom_style bpm/sphere\natom_modify map array sort 0 0\nboundary f f f\nnewton off\ncomm_modify vel yes\n",
}


def data(host):
    count, edge = SIDE**3, SIDE * SPACING
    lines = ["spheres", "", f"{count} atoms", "1 atom types"]
    lines += ["", *(f"{-SPACING!r} {edge!r} {axis}lo {axis}hi" for axis in "xyz"), "", "Atoms", ""]
    molecule = "1 " if host == "lammps" else ""
    for k in range(count):
        x, y, z = (SPACING * place for place in (k % SIDE, k // SIDE % SIDE, k // SIDE**2))
        lines.append(f"{k + 1} {molecule}1 {2 * RADIUS!r} {DENSITY!r} {x!r} {y!r} {z!r}")
    lines += ["", "Velocities", ""]
    for k in range(count):
        v = [(7919 * (3 * k + axis) % 1000) * 2e-6 - 1e-3 for axis in range(3)]
        lines.append(f"{k + 1} " + " ".join(map(repr, v)) + " 0 0 0")
    return "\n".join(lines) + "\n"


def script(host, law):
    text = HEAD[host] + "read_data data.txt\nneighbor 1e-3 bin\nneigh_modify every 1 delay 0\ntimestep 1e-6\n"
    if law:
        text += f"fix stick all concordem/bond none contact {law} {WORDS}\n"
    digits = 'format "%d %.17g %.17g %.17g"' if host == "liggghts" else "format float %.17g"
    text += f"fix integrate all nve/sphere\nthermo {STEPS}\nrun 10\nrun {STEPS}\n"
    return text + f"write_dump all custom out.txt id x y z modify sort id {digits}\n"


def main(tree, folder, rounds=5):
    for host in ("liggghts", "lammps"):
        program = Program(host, "fix", Path(tree).resolve(), Path(folder).resolve() / host)
        text, fastest, ends = data(host), dict.fromkeys(LAWS, float("inf")), {}
        for _ in range(int(rounds)):
            for name, law in LAWS.items():
                printed = program.run(script(host, law), text)
                seconds = float(re.findall(r"Loop time of (\S+)", printed)[-1])
                fastest[name] = min(fastest[name], seconds)
                ends[name] = program.frames("out.txt", 4)
        assert ends["scalar"] == ends["straight"] != ends["none"], f"{host}: the straight form changes the result"
        scalar, straight, none = (fastest[name] for name in LAWS)
        print(
            f"{host}: {scalar / STEPS * 1e3:.2f} ms per step without the straight form, {straight / STEPS * 1e3:.2f} with it, {none / STEPS * 1e3:.2f} "
            f"without contacts: contacts take {(scalar - none) / (straight - none):.2f} times as long, whole steps {scalar / straight:.2f} times"
        )


if __name__ == "__main__":
    main(*sys.argv[1:])
