#!/usr/bin/env python3
"""How much faster the straight form makes the law of the tutorial in LIGGGHTS and LAMMPS, beside the same law without it.

    speed.py TREE FOLDER [ROUNDS]             prints the times; they are not judged, because machines differ
    speed.py TREE FOLDER [ROUNDS] --record    also times the solver (the example straight_form, which must be built), and writes
                                              validation/results/straight-form.json and its table in docs/book/evidence/speed.md

A cubic lattice of 27,000 spheres that overlap a little and move at random; all contacts hold. Runs alternate, and the fastest counts.
Both laws must end with the same positions to the last bit.
"""
import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "validation"), str(Path(__file__).resolve().parent)]

from concordem_validate import provenance  # noqa: E402
from distributed import Program  # noqa: E402

EXAMPLE = ROOT / "target/release/examples/straight_form"
RESULTS = ROOT / "validation/results/straight-form.json"
PAGE = ROOT / "docs/book/evidence/speed.md"
BEGIN, END = "<!-- new_law/speed.py: figures -->", "<!-- end of straight forms -->"

SIDE, STEPS, RADIUS, SPACING, DENSITY = 30, 200, 0.005, 0.00995, 2500.0
#: The solver measures the motion of every law in columns, but for the first-order measure, with which each contact is stepped alone.
LAWS = {"straight": "adhesive", "scalar": "adhesive_scalar", "alone": "adhesive_scalar kinematics first-order", "none": None}
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
        name, *options = law.split()
        text += f"fix stick all concordem/bond none contact {name} {WORDS} {' '.join(options)}\n"
    digits = 'format "%d %.17g %.17g %.17g"' if host == "liggghts" else "format float %.17g"
    text += f"fix integrate all nve/sphere\nthermo {STEPS}\nrun 10\nrun {STEPS}\n"
    return text + f"write_dump all custom out.txt id x y z modify sort id {digits}\n"


def in_hosts(tree, folder, rounds):
    """Milliseconds of a step, by host and law."""
    found = {}
    for host in ("liggghts", "lammps"):
        program = Program(host, "fix", tree, folder / host)
        text, fastest, ends = data(host), dict.fromkeys(LAWS, float("inf")), {}
        for _ in range(rounds):
            for name, law in LAWS.items():
                printed = program.run(script(host, law), text)
                seconds = float(re.findall(r"Loop time of (\S+)", printed)[-1])
                fastest[name] = min(fastest[name], seconds)
                ends[name] = program.frames("out.txt", 4)
        assert ends["scalar"] == ends["straight"] != ends["none"], f"{host}: the straight form changes the result"
        found[host] = {name: seconds / STEPS * 1e3 for name, seconds in fastest.items()}
    return found


def in_solver(rounds):
    """Those of the example; `alone` steps contacts one by one."""
    printed = subprocess.run([EXAMPLE, str(rounds)], capture_output=True, text=True, check=True).stdout
    straight, scalar, alone, none = map(float, re.findall(r"(\d+\.\d+) (?:with the|without it|one by one|without contacts)", printed)[:4])
    return {"straight": straight, "scalar": scalar, "alone": alone, "none": none}


def counted():
    """Instructions per contact and step in the solver, those of a step without contacts subtracted: two counts of each run of the example."""
    contacts = 3 * SIDE**2 * (SIDE - 1)

    def count(run, rounds):
        command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", EXAMPLE, str(rounds), str(run)]
        said = subprocess.run(command, capture_output=True, text=True, check=True).stderr
        return int(re.search(r"Collected : (\d+)", said)[1])

    found = {name: (count(run, 3) - count(run, 1)) / (2 * 20 * contacts) for run, name in enumerate(LAWS)}
    return {name: round(number - found["none"]) for name, number in found.items() if name != "none"}


NAMES = {"solver": "solver, 1 thread", "liggghts": "LIGGGHTS, 1 process", "lammps": "LAMMPS, 1 process"}
SHOWN = {"scalar": "without its straight form", "alone": "one by one, motion included"}


def gains(times):
    """How many times as long contacts, and whole steps, take without the straight form."""
    return {
        name: [(times[name] - times["none"]) / (times["straight"] - times["none"]), times[name] / times["straight"]]
        for name in SHOWN
    }


def insert(page):
    """The text of a page with the table of the record between the marks."""
    record = json.loads(RESULTS.read_text())
    head, rest = page.split(BEGIN, 1)
    _, tail = rest.split(END, 1)
    load = " to ".join(f"{one:.1f}" for one in record["load_average"])
    lines = [
        f"{record['machine']}; {record['date']}, commit {record['commit'][:12]}; load average {load}. Fastest of {record['rounds']} rounds.",
        "",
        "| Program | Contacts | Step, ms | With it, ms | No contacts, ms | Contacts take longer | Steps take longer |",
        "|---|---|---|---|---|---|---|",
    ]
    for host, times in record["hosts"].items():
        for name, (contacts, steps) in gains(times).items():
            numbers = " | ".join(f"{times[key]:.2f}" for key in (name, "straight", "none"))
            lines.append(f"| {NAMES[host]} | {SHOWN[name]} | {numbers} | {contacts:.2f} times | {steps:.2f} times |")
    counts = record["instructions"]
    lines += [
        "",
        f"Instructions per contact and step in the solver, counted by valgrind with AVX2: {counts['straight']} with the straight form, "
        f"{counts['scalar']} without it, {counts['alone']} one by one.",
    ]
    return "\n".join([head + BEGIN, *lines, END + tail])


def main(tree, folder, *words):
    record = "--record" in words
    rounds = next((int(word) for word in words if word.isdigit()), 5)
    load = os.getloadavg()[0]
    hosts = {**({"solver": in_solver(rounds)} if record else {}), **in_hosts(Path(tree).resolve(), Path(folder).resolve(), rounds)}
    for host, times in hosts.items():
        shown = ", ".join(f"{name} {milliseconds:.2f}" for name, milliseconds in times.items())
        print(f"{host}: a step in ms: {shown}")
        for name, (contacts, steps) in gains(times).items():
            print(f"  {SHOWN[name]}: contacts take {contacts:.2f} times as long, whole steps {steps:.2f} times")
    if record:
        found = {
            "commit": provenance.of_tree(),
            "machine": f"{provenance.processor()}, {os.cpu_count()} processors",
            "date": time.strftime("%Y-%m-%d", time.gmtime()),
            "rounds": rounds,
            "load_average": [load, os.getloadavg()[0]],
            "hosts": hosts,
            "instructions": counted(),
        }
        RESULTS.write_text(json.dumps(found, indent=1) + "\n")
        PAGE.write_text(insert(PAGE.read_text()))


if __name__ == "__main__":
    main(*sys.argv[1:])
