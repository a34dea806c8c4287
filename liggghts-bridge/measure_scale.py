#!/usr/bin/env python3
"""Bytes, messages, and memory per process of bonds in LIGGGHTS, with equal parts on 1 to 16 processes of this machine, and a model of
whole nodes of a cluster.

The parts are cubes of 20 atoms along an edge (72,000 bonds) in a periodic box. Bytes and messages are the difference between runs of 5
and 25 steps, counted by the monitoring component of Open MPI; memory is the difference between the largest resident memories with and
without bonds. Nothing is timed, so a busy machine does not matter.
  liggghts-bridge/measure_scale.py          measures, writes validation/results/liggghts-scale.json, prints the tables of
                                            docs/book/reference/liggghts.md
  liggghts-bridge/measure_scale.py --docs   prints the tables from that file
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
    return {"atoms_per_process": EDGE**3, "law": "cpm", "processes": figures}


# Nodes of the model: processes, memory bandwidth (B/s), network bandwidth (B/s), latency (s).
NODE = {"processes": 128, "memory": 400e9, "network": 25e9, "latency": 2e-6}
# Bytes of memory traffic per bond and step with cpm: all 152 bytes are read, and normal, length, and history (120 bytes) written back.
TRAFFIC = 272


def model(timed, bonds_in_all, m):
    """A step on full nodes, m³ atoms per process: processes, nodes, seconds of a step, and the parts."""
    bonds, computing, ghosts, sent, packed = speed.step_of(timed, "cpm", m)
    processes = math.ceil(bonds_in_all / bonds)
    memory = bonds * TRAFFIC / (NODE["memory"] / NODE["processes"])
    wire = sent / (NODE["network"] / NODE["processes"])
    latency = (12 + 2 * math.log2(processes)) * NODE["latency"]
    work = max(computing, memory) * (1 + 15 / 9 / m)
    step = work + wire + latency + ghosts * packed
    return {"processes": processes, "nodes": math.ceil(processes / NODE["processes"]), "bonds": bonds, "alone": computing,
            "work": work, "communication": step - work, "step": step, "efficiency": computing / step}


def tables(result):
    lines = ["| Processes | Bonds | Ghosts each | Sent per step, each | Messages | Memory of a bond, at most | Memory of a process, at most |",
             "|---|---|---|---|---|---|---|"]
    for f in result["processes"]:
        lines.append(f"| {f['processes']} | {f['bonds']:,} | {f['ghosts']:,.0f} | {f['bytes_per_step'] / 1e6:.3f} MB | "
                     f"{f['messages_per_step']:.0f} | {f['bytes_per_bond']:.0f} bytes | {f['memory'] / 1e6:.0f} MB |")
    with open(speed.RESULTS) as file:
        timed = json.load(file)
    lines += ["", "| Bonds in all | m | Processes, nodes | Step of a process alone | On full nodes | Communication | Efficiency |",
              "|---|---|---|---|---|---|---|"]
    for bonds in (1e9, 1e10):
        for m in (100, 46, 22):
            f = model(timed, bonds, m)
            lines.append(f"| 10{'⁹' if bonds == 1e9 else '¹⁰'} | {m} | {f['processes']:,}, {f['nodes']:,} | {f['alone'] * 1e3:.1f} ms | "
                         f"{f['work'] * 1e3:.1f} ms | {f['communication'] * 1e3:.2f} ms | {f['efficiency'] * 100:.0f} % |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--docs", action="store_true")
    if not parser.parse_args().docs:
        result = measure()
        with open(RESULTS, "w") as out:
            json.dump(result, out, indent=1)
            out.write("\n")
    with open(RESULTS) as file:
        print(tables(json.load(file)))


if __name__ == "__main__":
    main()
